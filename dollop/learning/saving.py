"""Tasks as files: JSON of this library's own format, whose numbers must not contradict each other.

Version 2 of an anchored task holds the ways as they were learned, and no law: that is fitted anew,
so that nothing can contradict it. Version 1, and a task of the paper's method, hold the law and the
ties of its places to corners.
"""

import json
from dataclasses import asdict

import numpy as np

from dollop.association import Association
from dollop.checks import Note, check_positive, checked_array
from dollop.environment import Environment, Seen
from dollop.formats.files import FormatError, read_bytes
from dollop.lds import LDS, Statistics
from dollop.learning.paper import anchors
from dollop.learning.way import Way
from dollop.learning.ways import PLACES
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import check_trajectories

__all__ = ["as_dict", "read_task"]

FORMAT, VERSION = "dollop task", 2
SAME = 1e-6
"""m: places that two numbers of a file give must agree to this, or to this share of how far they are from 0."""


def as_dict(task):
    """What is saved of a task (beyond the paper).

    Parameters
    ----------
    task : Task

    Returns
    -------
    dict
        Names to numbers, text, lists and arrays, of which JSON makes lists; the model is not in it.
    """
    content = {
        "format": FORMAT,
        "version": VERSION,
        "method": "anchored" if task.learned else "paper",
        "environment": _of_environment(task.environment),
        "objects": task.objects,
        "partners": list(task.partners),
        "notes": [[note.kind, note.text, note.doubt] for note in task.notes],
        "demonstrations": [_of_demonstration(each) for each in task.demonstrations],
    }
    return content | ({"ways": list(map(_of_way, task.learned))} if task.learned else _of_law(task))


def _of_law(task):
    law, tied = task.law, task.association
    return {
        "start": law.start,
        "speeds": law.speeds,
        "segments": [{"goal": each.goal, **asdict(each.statistics)} for each in law.segments],
        "association": {name: getattr(tied, name) for name in ("corners", "weights", "differences")},
    }


def _of_way(way):
    names = (
        "home",
        "weights",
        "local",
        "objects",
        "members",
        "covered",
        "sample_period",
        "tolerance",
    )
    content = {name: getattr(way, name) for name in names}
    return content | {
        "walks": list(way.walks),
        "shares": list(way.shares),
        "turning": way.turning.astype(int),
    }


def _of_demonstration(shown):
    return {
        "walks": shown.walks,
        "environment": _of_environment(shown.environment),
        "sample_period": shown.sample_period,
        "tolerance": shown.tolerance,
        "notes": [[note.kind, note.text, note.doubt] for note in shown.notes],
    }


def _of_environment(environment):
    directions = [None if np.isnan(angle) else angle for angle in environment.directions]
    content = {
        "boxes": environment.boxes,
        "directions": directions,
        "assumed": environment.assumed.astype(int),
    }
    seen = environment.seen
    if seen is None:
        return content
    rows = ["".join(map(str, row)) for row in seen.floor.astype(int)]
    return content | {"seen": {"floor": rows, "origin": list(seen.origin), "resolution": seen.resolution}}


def read_task(path, make_task, make_demonstration, laid_out):
    """A task that was saved (beyond the paper).

    Parameters
    ----------
    path : str or Path
    make_task, make_demonstration : callable
        The records.
    laid_out : callable
        Gives a task of ways its laws in an environment.

    Returns
    -------
    Task

    Raises
    ------
    FormatError
        For a file that is damaged, not a task, of another version, or whose numbers contradict each
        other.
    """
    try:
        content = json.loads(read_bytes(path))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"not a task: {error}", path) from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise FormatError(f"not a task: format must be {FORMAT!r}", path)
    version = content.get("version")
    if type(version) is not int or version not in (1, VERSION):
        raise FormatError(f"version must be 1 or {VERSION}, got {version!r}", path)
    try:
        if version == 1:
            content = _as_version_2(content)
        shown = tuple(make_demonstration(**each) for each in map(_demonstration_from, content["demonstrations"]))
        return _task_from(content, shown, make_task, laid_out)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError) as error:
        raise FormatError(f"a damaged task: {type(error).__name__} {error}", path) from error


def _as_version_2(content):
    """What version 1 holds, by the names of version 2."""
    shown = [each | {"environment": {"boxes": each["boxes"]}, "notes": []} for each in content["demonstrations"]]
    told = {
        "method": "paper",
        "environment": {"boxes": content["boxes"]},
        "notes": [],
        "partners": [],
        "objects": None,
    }
    return content | told | {"demonstrations": shown}


def _task_from(content, shown, make_task, laid_out):
    environment = _environment_from(content["environment"])
    notes = tuple(map(_note_from, content["notes"]))
    partners = _partners_from(content["partners"], shown)
    objects = content["objects"]
    objects = None if objects is None else _numbers("objects", objects, len(environment))
    known = {"demonstrations": shown, "notes": notes, "partners": partners, "objects": objects}
    if content["method"] == "anchored":
        ways = tuple(_way_from(each, len(shown)) for each in content["ways"])
        check_positive("the number of ways", len(ways))
        if max(way.objects.max(initial=-1) for way in ways) >= len(objects):
            raise ValueError(f"the ways follow more than the {len(objects)} objects that there are")
        blank = make_task(None, environment, None, learned=ways, **known)
        return laid_out(blank, environment, objects)
    if content["method"] != "paper":
        raise ValueError(f"method must be 'anchored' or 'paper', got {content['method']!r:.40}")
    law = _law_from(content)
    return make_task(
        law,
        environment,
        _association_from(content["association"], environment, anchors(law)),
        **known,
    )


def _law_from(content):
    segments = content["segments"]
    check_positive("the number of segments", len(segments))
    start = checked_array("start", content["start"], 2)
    speeds = checked_array("speeds", content["speeds"], len(segments))
    check_positive("speeds", speeds.min())
    return SequencedLDS(tuple(map(_segment_from, segments)), start, speeds)


def _segment_from(content):
    G0, G1 = (checked_array(name, content[name], 2, 2) for name in ("G0", "G1"))
    return LDS(Statistics(G0, G1), content["goal"])


def _association_from(content, environment, places):
    """The saved association of places (K, 2) with the corners of an environment, if it puts them there."""
    corners = _numbers("corners", content["corners"], len(environment.corners), len(places), "m", least=0)
    weights = checked_array("weights", content["weights"], *corners.shape)
    differences = checked_array("differences", content["differences"], *corners.shape, 2)
    check_positive("weights", weights.min(initial=0), or_zero=True)
    tied = Association(environment, corners, weights, differences)
    total = weights.sum(axis=1)
    whole = total > 1 - SAME
    found = np.einsum("km,kmd->kd", weights, environment.corners[corners] + differences)
    wrong = np.abs(found - places).max(axis=1, initial=0) > SAME * np.maximum(1, np.abs(places).max(axis=1))
    if (wrong & whole).any():
        k = int(np.flatnonzero(wrong & whole)[0])
        there = f"its association puts it at {found[k].round(3).tolist()}"
        raise ValueError(f"place {k} of the law is at {places[k].round(3).tolist()}, but {there}")
    return tied


def _way_from(content, count):
    weights = checked_array("weights", content["weights"], PLACES, "F")
    frames = weights.shape[1]
    walks = check_trajectories(content["walks"])
    shares = [checked_array("shares", share, len(walk)) for share, walk in zip(content["shares"], walks, strict=True)]
    for share in shares:
        if (np.diff(share) < 0).any() or share[0] < 0 or share[-1] > PLACES - 1:
            raise ValueError(f"shares must rise from 0 to {PLACES - 1}, got {share[0]} to {share[-1]}")
    objects = _numbers("objects", content["objects"], None, frames)
    turning = _numbers("turning", content["turning"], 2, frames, least=0) == 1
    if objects[-1] != -1 or turning[-1] or (objects[:-1] < 0).any():
        raise ValueError("the last frame of a way must be the world, and no other")
    members = _numbers("members", content["members"], count, "K", least=0)
    covered = checked_array("covered", content["covered"], len(members), 2)
    check_positive("sample_period", content["sample_period"])
    check_positive("tolerance", content["tolerance"])
    if np.abs(weights.sum(axis=1) - 1).max() > SAME:
        raise ValueError("the weights of each place must sum to 1")
    return Way(
        tuple(walks), tuple(shares), checked_array("home", content["home"], PLACES, 2), weights,
        checked_array("local", content["local"], PLACES, frames, 2), objects, turning, tuple(members.tolist()),
        tuple(map(tuple, covered.tolist())), content["sample_period"], content["tolerance"],
    )  # fmt: skip


def _numbers(name, values, below, *shape, least=-1):
    """Whole numbers from `least` to below `below`; any length where no shape is given."""
    found = checked_array(name, values, *(shape or ("N",)))
    if (found != found.astype(int)).any() or found.min(initial=least) < least:
        raise ValueError(f"{name} must be whole numbers from {least} on")
    if below is not None and found.max(initial=-1) >= below:
        raise ValueError(f"{name} must be below {below}, got {found.max():g}")
    return found.astype(int)


def _partners_from(content, shown):
    if len(content) not in (0, len(shown)):
        raise ValueError(f"partners must be given for each of {len(shown)} demonstrations, got {len(content)}")
    pairs = zip(content, shown, strict=False)
    lengths = [(each, len(one.environment)) for each, one in pairs]
    return tuple(None if each is None else _numbers("partners", each, None, n) for each, n in lengths)


def _demonstration_from(content):
    return {
        "trajectory": check_trajectories(content["walks"]),
        "environment": _environment_from(content["environment"]),
        "sample_period": content["sample_period"],
        "tolerance": content["tolerance"],
        "notes": tuple(map(_note_from, content["notes"])),
    }


def _note_from(content):
    kind, text, doubt = content
    if not (isinstance(kind, str) and isinstance(text, str) and isinstance(doubt, bool)):
        raise ValueError(f"a note must be kind, text and doubt, got {content!r:.60}")
    return Note(kind, text, doubt)


def _environment_from(content):
    directions = content.get("directions")
    if directions is not None:
        directions = [np.nan if angle is None else angle for angle in directions]
    assumed, seen = content.get("assumed"), content.get("seen")
    if seen is not None:
        floor = np.array([np.frombuffer(row.encode(), np.uint8) == ord("1") for row in seen["floor"]])
        if floor.ndim != 2:
            raise ValueError("the rows of what was seen must be of one length")
        origin = tuple(checked_array("origin", seen["origin"], 2).tolist())
        check_positive("resolution", seen["resolution"])
        seen = Seen(floor, origin, seen["resolution"])
    assumed = None if assumed in (None, []) else np.array(assumed) == 1
    return Environment(content["boxes"], seen, assumed, directions)
