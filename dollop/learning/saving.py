"""Tasks as files: JSON of this library's own format, whose numbers must not contradict each other.

Version 2 of an anchored task holds the ways as they were learned, and no law: that is fitted anew,
so that nothing can contradict it. Version 1, and a task of the paper's method, hold the law and the
ties of its places to corners.
"""

from dataclasses import asdict

import numpy as np

from dollop.association import Association
from dollop.checks import (
    Note,
    check_choice,
    check_positive,
    checked_array,
    checked_positions,
    checked_wholes,
    told,
)
from dollop.environment import Environment, Seen
from dollop.formats.files import check_cells, check_fields, from_file, read_json
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
MOST = 10_000
"""Demonstrations, ways and notes, each; walks are as long as there is room for in a JSON file."""
ALWAYS = "format", "version", "demonstrations"
LAW = "start", "speeds", "segments", "association"
TASK = *ALWAYS, "method", "environment", "objects", "partners", "notes"
SHOWN = "walks", "sample_period", "tolerance"
WAY = (*SHOWN, "shares", "home", "weights", "local", "objects", "turning", "members", "covered")
"""What there must be in a file, and in its parts."""
TIMING = "pauses", "corners", "profile"
"""What there is in a file only where somebody paused: without it versions before this one read it too."""


def as_dict(task):
    """What is saved of a task (beyond the paper).

    Parameters
    ----------
    task : Task

    Returns
    -------
    dict
        Names to numbers, text, lists and arrays, of which JSON makes lists; the model is not in it.

    Raises
    ------
    ValueError
        If there are more than ten thousand demonstrations, ways or notes, which would not be read.
    """
    for name in ("demonstrations", "ways", "notes"):
        _check_count(name, getattr(task, name))
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
    content |= {"turn": task.turn} if task.turn else {}
    return content | ({"ways": list(map(_of_way, task.learned))} if task.learned else _of_law(task))


def _of_law(task):
    law, tied = task.law, task.association
    waits = law.pauses is not None and law.pauses.any()
    timing = {name: getattr(law, name) for name in TIMING} if waits else {}
    content = {name: value for name, value in timing.items() if value is not None}
    return content | {
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
    content |= {"pauses": way.pauses} if len(way.pauses) else {}
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
        other; and beyond the bounds of `dollop.formats.files.read_json`, and 10,000
        demonstrations, ways or notes.
    """
    content = read_json(path, "a task")
    return from_file(path, _task_of, content, make_task, make_demonstration, laid_out)


def _task_of(content, make_task, make_demonstration, laid_out):
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f"not a task: format must be {FORMAT!r}")
    version = content.get("version")
    if type(version) is not int or version not in (1, VERSION):
        raise ValueError(f"version must be 1 or {VERSION}, got {told(version)}")
    if version == 1:
        content = _as_version_2(content)
    check_choice("method", content.get("method"), ("anchored", "paper"))
    further = ["ways"] if content["method"] == "anchored" else LAW
    check_fields("a task", content, (*TASK, *further), ["turn", *(TIMING if further is LAW else ())])
    each_shown = _all("demonstrations", content["demonstrations"], _demonstration_from)
    shown = tuple(make_demonstration(**each) for each in each_shown)
    return _task_from(content, shown, make_task, laid_out)


def _check_count(name, values):
    if len(values) > MOST:
        raise ValueError(f"{name} must be at most {MOST}, got {len(values)}")


def _all(name, content, make, *known):
    """What is made of each of a list, a tuple; what is refused is named by its number."""
    if not isinstance(content, list):
        raise ValueError(f"{name} must be a list, got {told(content)}")
    _check_count(name, content)
    return tuple(_named(f"{name}[{k}]", make, each, *known) for k, each in enumerate(content))


def _named(name, make, *content):
    """What is made of a part; what is refused says of which."""
    try:
        return make(*content)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _as_version_2(content):
    """What version 1 holds, by the names of version 2."""
    check_fields("a task of version 1", content, (*ALWAYS, *LAW, "boxes"))
    shown = _all("demonstrations", content["demonstrations"], _shown_in_version_1)
    empty = {"method": "paper", "notes": [], "partners": [], "objects": None}
    environment = {"boxes": content["boxes"]}
    content = content | empty | {"environment": environment, "demonstrations": list(shown)}
    return {name: value for name, value in content.items() if name != "boxes"}


def _shown_in_version_1(content):
    check_fields("a demonstration of version 1", content, (*SHOWN, "boxes"))
    kept = {name: content[name] for name in SHOWN}
    return kept | {"environment": {"boxes": content["boxes"]}, "notes": []}


def _task_from(content, shown, make_task, laid_out):
    environment = _named("environment", _environment_from, content["environment"])
    partners = _all("partners", content["partners"], _partner_from)
    objects = content["objects"]
    if objects is not None:
        objects = checked_wholes("objects", objects, "N", least=-1, most=len(environment) - 1)
    notes = _all("notes", content["notes"], _note_from)
    known = {
        "demonstrations": shown,
        "notes": notes,
        "partners": partners,
        "turn": content.get("turn", 0.0),
    }
    if content["method"] == "paper":
        law = _law_from(content)
        tied = _named("association", _association_from, content["association"], environment, anchors(law))
        return make_task(law, environment, tied, objects=objects, **known)
    ways = _all("ways", content["ways"], _way_from, len(shown))
    check_positive("the number of ways", len(ways))
    count = len(checked_wholes("objects", objects, "N", least=-1))
    if max(way.objects.max(initial=-1) for way in ways) >= count:
        raise ValueError(f"the ways follow more than the {count} objects that there are")
    return laid_out(known | {"learned": ways}, environment, objects)


def _law_from(content):
    segments = _all("segments", content["segments"], _segment_from)
    check_positive("the number of segments", len(segments))
    timing = {name: content[name] for name in TIMING if name in content}
    return SequencedLDS(segments, content["start"], content["speeds"], **timing)


def _segment_from(content):
    check_fields("a segment", content, ("goal", "G0", "G1"), ["A"])  # A: of the first version 1
    return LDS(
        Statistics(*(checked_array(name, content[name], 2, 2) for name in ("G0", "G1"))),
        content["goal"],
    )


def _association_from(content, environment, places):
    """The saved association of places (K, 2) with the corners of an environment, if it puts them there."""
    check_fields("an association", content, ("corners", "weights", "differences"))
    corners = checked_wholes("corners", content["corners"], len(places), "m")
    tied = Association(environment, corners, content["weights"], content["differences"])
    whole = tied.weights.sum(axis=1) > 1 - SAME
    found = np.einsum("km,kmd->kd", tied.weights, environment.corners[tied.corners] + tied.differences)
    wrong = np.abs(found - places).max(axis=1, initial=0) > SAME * np.maximum(1, np.abs(places).max(axis=1))
    if (wrong & whole).any():
        k = int(np.flatnonzero(wrong & whole)[0])
        there = f"its association puts it at {found[k].round(3).tolist()}"
        raise ValueError(f"place {k} of the law is at {places[k].round(3).tolist()}, but {there}")
    return tied


def _way_from(content, count):
    check_fields("a way", content, WAY, ["pauses"])
    way = Way(**content)
    if len(way.home) != PLACES:
        raise ValueError(f"home must hold {PLACES} places, got {len(way.home)}")
    if max(way.members, default=-1) >= count:
        raise ValueError(f"members must be below {count}, the number of demonstrations, got {max(way.members)}")
    return way


def _walks_from(content):
    """Walks as arrays."""
    return check_trajectories(_all("walks", content, lambda each: checked_positions("a walk", each, "N", 2)))


def _partner_from(content):
    return None if content is None else checked_wholes("partners", content, "N", least=-1)


def _demonstration_from(content):
    check_fields("a demonstration", content, (*SHOWN, "environment", "notes"))
    return {
        "trajectory": _walks_from(content["walks"]),
        "environment": _named("environment", _environment_from, content["environment"]),
        "sample_period": content["sample_period"],
        "tolerance": content["tolerance"],
        "notes": _all("notes", content["notes"], _note_from),
    }


def _note_from(content):
    kinds = [type(each) for each in content] if isinstance(content, list) else []
    if kinds != [str, str, bool]:
        raise ValueError(f"a note must be kind, text and doubt, got {told(content)}")
    return Note(*content)


def _environment_from(content):
    check_fields("an environment", content, ["boxes"], optional=("directions", "assumed", "seen"))
    directions, assumed, seen = (content.get(name) for name in ("directions", "assumed", "seen"))
    if isinstance(directions, list):
        directions = [np.nan if angle is None else angle for angle in directions]
    seen = None if seen is None else _named("seen", _seen_from, seen)
    return Environment(content["boxes"], seen, None if assumed == [] else assumed, directions)


def _seen_from(content):
    check_fields("what was seen", content, ("floor", "origin", "resolution"))
    rows = content["floor"]
    good = isinstance(rows, list) and rows and all(isinstance(row, str) for row in rows)
    if not good or any(row.strip("01") for row in rows):
        raise ValueError(f"the floor must be rows of 0 and 1, got {told(rows)}")
    if len(set(map(len, rows))) > 1 or not rows[0]:
        raise ValueError("the rows of what was seen must be of one length, and not empty")
    check_cells(len(rows[0]), len(rows))
    floor = np.frombuffer("".join(rows).encode(), np.uint8).reshape(len(rows), -1) == ord("1")
    return Seen(floor, content["origin"], content["resolution"])
