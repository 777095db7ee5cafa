"""dollop learn: a task from the logs of one or more demonstrations."""

from pathlib import Path

import numpy as np

import dollop
from dollop.cli.naming import check_written, outputs_of, unused
from dollop.cli.picturing import write_task
from dollop.cli.telling import Result, busy, command, tell, tell_notes
from dollop.cli.watching import load_map, map_files, read_log, tell_people, watched
from dollop.formats.kinds import TASK
from dollop.formats.writing import Output
from dollop.trajectory import arc_length

__all__ = ["as_data", "as_lines", "performing", "run"]


def run(options):
    """Learn, dollop learn LOG... --map MAP --out TASK.json.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        If nobody walks in one of the logs, or there is another number of users than of logs.
    """
    out, picture = outputs_of(options, ".json", "a task")
    read = [*options.logs, *map_files(options.map, "LOG", options.logs[0])]
    check_written([Output(out, TASK)], read, picture, out)
    users = _users(options)
    background = load_map(options.map, options.logs[0])
    pairs = zip(options.logs, users, strict=True)
    demonstrations = [_shown(path, user, background, options) for path, user in pairs]
    with busy("learning"):
        task = dollop.learn(demonstrations, method=options.method)
    write_task(task, background, out, picture)
    errors = task.errors()
    lines = (*_shown_lines(task, errors, options.logs), *as_lines(task))
    data = {**as_data(task), "errors": errors}
    then = performing(out, options.map)
    tell(Result(lines, (out, picture), then, task.notes, data), options.json)


def _users(options):
    """Who the user of each log is."""
    users, logs = options.user or ["fastest"], options.logs
    if len(users) not in (1, len(logs)):
        rule = f"--user must be given once, or once for each of {len(logs)} logs"
        raise ValueError(f"{rule}, got {len(users)}")
    return users * len(logs) if len(users) == 1 else users


def _shown(path, user, background, options):
    """The demonstration of a log."""
    log = read_log(path, options, options.map)
    found = watched(log, background, user, options.min_area, what=f"observing {path}")
    if found.user is None:
        tell_notes(found.notes, path)
        raise ValueError(f"nobody walks in {path}; tracks of something else: {len(found.tracks)}")
    tell_people(found, log.t[0], path)
    return dollop.Demonstration.of(found, options.tolerance)


def _shown_lines(task, errors, paths):
    """What each demonstration showed, and how far the task is from it."""
    for path, shown, error in zip(paths, task.demonstrations, errors, strict=True):
        walked = sum(arc_length(walk)[-1] for walk in shown.walks)
        laps = f" in {len(shown.walks)} laps" if len(shown.walks) > 1 else ""
        apart = f"the task is {1000 * error:.0f} mm from it on average"
        near = "set aside" if np.isnan(error) else apart
        yield f"{path}: {walked:.1f} m walked{laps} among {len(shown.environment)} objects; {near}"


def as_lines(task):
    """What a task is, for people.

    Parameters
    ----------
    task : Task

    Returns
    -------
    tuple of str
    """
    length = arc_length(task.law.response())[-1]
    ways = f", {len(task.ways)} ways" if len(task.ways) > 1 else ""
    waits = _waits(task.law)
    stops = f", waits {', '.join(f'{seconds:.1f} s' for _, seconds in waits)}" if waits else ""
    objects = f"{len(task.environment)} objects"
    way = f"{len(task.law.segments)} subgoals over {length:.1f} m{ways}{stops}"
    return (f"a task of {way}, among {objects}",)


def _waits(law):
    """Number, 0 for the start, and time in s of each place where a law waits."""
    pauses = [] if law.pauses is None else law.pauses.tolist()
    return [(k, seconds) for k, seconds in enumerate(pauses) if seconds > 0]


def as_data(task):
    """What a task is, for programs.

    Parameters
    ----------
    task : Task

    Returns
    -------
    dict
    """
    return {
        "start": task.law.start,
        "subgoals": task.law.subgoals,
        "length": arc_length(task.law.response())[-1],
        "seconds": task.law.timed()[0][-1],
        "waits": _waits(task.law),
        "ways": len(task.ways),
        "shown": task.shown,
        "objects": task.environment.boxes,
    }


def performing(out, map):
    """The command that performs a task.

    Parameters
    ----------
    out : str or Path
        Of the task.
    map : str

    Returns
    -------
    str
    """
    new = unused(Path(out).with_name(f"{Path(out).stem}_run.csv"), ".png")
    return command("perform", out, "--map", map, "--out", new)
