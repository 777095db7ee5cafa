"""dollop perform: a simulated robot of a size performs a task."""

from itertools import pairwise
from pathlib import Path

import numpy as np

import dollop
from dollop.checks import checked_number, checked_whole
from dollop.cli.kidnapping import draw_kidnappings
from dollop.cli.naming import check_written, named, outputs_of, unused
from dollop.cli.options import PERFORMED
from dollop.cli.picturing import of_run, write_picture
from dollop.cli.telling import Result, busy, command, tell
from dollop.cli.watching import check_kind, load_map, map_files
from dollop.formats.kinds import GIF, RUN, TASK
from dollop.formats.writing import Output, together
from dollop.robot import ObstacleMap
from dollop.robot.tables import save_run

__all__ = ["ended", "run", "verdict_of"]


def run(options):
    """Perform, dollop perform TASK.json --map MAP --out RUN.csv.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        For a start that is not free for a robot of that radius, and what is no number.
    """
    out, picture, film = _outputs(options)
    count = checked_whole("--kidnap", options.kidnap, most=MOST_KIDNAPPINGS)
    seed = checked_whole("--seed", options.seed)
    _check_limits(options.limits)
    check_kind("TASK", options.task, [TASK], ("MAP", options.map))
    task, background = dollop.Task.load(options.task), load_map(options.map)
    with busy("performing"):
        done = _performed(task, background, count, seed, options)
    with together():
        if film is not None:
            from dollop.cli.filming import write_film

            with busy("filming"):
                write_film(film, done, task, background)
        write_picture(picture, of_run(done, task, background))
        save_run(out, done)
    notes = tuple(dict.fromkeys((*task.notes, *done.notes)))
    written = [each for each in (out, picture, film) if each]
    failed = "" if done.finished else done.reason
    then = _next(done, task, background, options)
    tell(
        Result(_lines(done), written, then, notes, verdict_of(done), failed),
        options.json,
    )


MOST_KIDNAPPINGS = 1000


def _outputs(options):
    """Paths of the run, its picture and its film, if they can be written and are no input."""
    out, picture = outputs_of(options, ".csv", "a run")
    film = None if options.film is None else named(options.film, ".gif", "--film", "a film")
    outputs = [Output(out, RUN), *([] if film is None else [Output(film, GIF)])]
    read = [options.task, *map_files(options.map, "TASK", options.task)]
    check_written(outputs, read, picture, out)
    return out, picture, film


def _performed(task, background, count, seed, options):
    """The run of a robot that starts where the task does, kidnapped so often."""
    radius = checked_number("--radius", options.radius, 1e-3, 100.0)
    start = (*task.law.start, _heading(task.law))
    ways = {"control": options.control, "background": background, "timeout": options.timeout}

    def performed(kidnap):
        robot = dollop.Unicycle(start, options.limits, options.period, radius)
        return dollop.perform(task, robot, kidnap=kidnap, **ways)

    try:
        calm = performed(())
    except ValueError as error:
        raise ValueError(f"{error}{_what_helps(error, options)}") from None
    if not count:
        return calm
    there = task, background, start[:2], radius, seed
    return performed(draw_kidnappings(count, calm.t[-1], options.period, *there))


def _check_limits(limits):
    """Refuse another number of limits, by the name of the option."""
    if len(limits) != 4:
        told = ",".join(f"{each:g}" for each in limits)
        raise ValueError(f"--limits must be four numbers V,W,A,B, got {told}")


def _what_helps(error, options):
    """What to do where a place is not free, after the error; nothing for others."""
    if "must be free" not in str(error):
        return ""
    shown = unused(_beside(options.task, "_shown.png"))
    look = command("show", options.task, "--map", options.map, "--out", shown)
    helps = "a map that has seen the floor there, or dollop adapt where an object stands on it"
    return f"; what helps: {helps}; a look at it: {look}"


def _heading(law):
    """In which direction a law leaves its start, in rad."""
    if hasattr(law, "headings"):
        return float(law.headings[0])
    step = law.response()[1] - law.start
    return float(np.arctan2(step[1], step[0]))


def verdict_of(run):
    """Whether a run was the task, for programs.

    Parameters
    ----------
    run : Run

    Returns
    -------
    dict
    """
    return {name: value for name, value in run.verdict.items() if name != "notes"}


def _lines(run):
    """What came of a run, for people."""
    touched = f"touched something {run.collisions} x" if run.collisions else "touched nothing"
    room = f"{touched}, least clearance {run.least_clearance:.2f} m"
    return (f"{ended(run)}; {room}{_share(run)}{_stood(run)}",)


def ended(run):
    """How a run ended, for people.

    Parameters
    ----------
    run : Run

    Returns
    -------
    str
    """
    after = f"after {run.t[-1]:.1f} s"
    if run.finished:
        return f"finished {after}"
    told = run.reason.startswith("not finished")
    return run.reason if told else f"not finished {after}: {run.reason}"


def _share(run):
    """How much of the task a run was, for people."""
    way = f"; {run.done:.0%} of the way, {run.reached.sum()} of {len(run.reached)} subgoals"
    return f"{way}, at most {run.farthest:.2f} m from the response"


def _stood(run):
    """Which waits a run kept, for people."""
    kept = [f"{stood:.1f} of {shown:.1f} s" for _, shown, stood in run.waits]
    return f"; stood {', '.join(kept)}" if kept else ""


def _next(run, task, background, options):
    """What to do with the task that was performed: the run again where that helps, a look at it, or on with it."""
    if not run.finished:
        better = _better(run, task, background, options)
        if better:
            return _again(options, **better)
        shown = unused(_beside(options.out, "_shown.png"))
        return command("show", options.out, "--map", options.map, "--out", shown)
    route = unused(_beside(options.task, ".geojson"))
    return command("export", options.task, "--to", "nav2", "--out", route)


def _better(run, task, background, options):
    """Options with which a run may be finished that was too slow, or whose robot is too large; none for others."""
    if run.reason.startswith("not finished within"):
        return {"timeout": 2 * options.timeout}
    if not run.reason.startswith("there is no "):
        return {}
    radius = _fitting(task, background, options.radius)
    return {"radius": radius} if radius else {}


SMALLER, SMALLEST, REACH = 0.8, 0.05, dollop.robot.Following().reach
"""Of radii in m that are tried: the share of the one before, the least, and how near in m a subgoal is come to."""


def _fitting(task, background, radius):
    """The largest of the radii that are tried with which a robot gets from subgoal to subgoal, in m; 0 for none."""
    radius = round(SMALLER * radius, 2)
    while radius >= SMALLEST:
        obstacles = ObstacleMap.of(task.environment, background, radius=radius)
        legs = pairwise([task.law.start, *task.law.subgoals])
        if not any(obstacles.no_way(here, there, REACH) for here, there in legs):
            return radius
        radius = round(SMALLER * radius, 2)
    return 0.0


def _again(options, **other):
    """The same command with other options, for a run of its own."""
    now = {name: getattr(options, name) for name in PERFORMED} | other
    said = (f"--{name}={_told(now[name])}" for name in PERFORMED if now[name] != PERFORMED[name])
    new = unused(options.out, ".png")
    return command("perform", options.task, "--map", options.map, *said, "--out", new)


def _told(value):
    """A value as the command line has it."""
    return (
        ",".join(map(_told, value))
        if isinstance(value, tuple)
        else f"{value:.12g}"
        if isinstance(value, float)
        else str(value)
    )


def _beside(path, ending):
    """A name beside a file's, with another ending."""
    return Path(path).with_name(Path(path).stem + ending)
