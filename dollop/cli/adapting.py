"""dollop adapt: a task where the objects stand now."""

from dataclasses import replace

import dollop
from dollop.cli.learning import as_data, as_lines, performing
from dollop.cli.naming import check_written, outputs_of
from dollop.cli.picturing import write_task
from dollop.cli.telling import Result, busy, tell, tell_notes
from dollop.cli.watching import check_kind, load_map, map_files, read_log, watched
from dollop.formats.kinds import TASK
from dollop.formats.writing import Output

__all__ = ["how_to_say", "run"]

ABOUT_USER = "people", "exchange", "pieces", "lost", "gap", "seen", "off the map", "speed"
"""Kinds of notes on who walks about, which says nothing of where objects stand."""


def run(options):
    """Adapt, dollop adapt TASK.json LOG --map MAP --out TASK.json.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        If it is not sure of any object which it is, or a place follows nothing that is left.
    """
    out, picture = outputs_of(options, ".json", "a task")
    read = [options.log, *map_files(options.map, "LOG", options.log)]
    check_written([Output(out, TASK)], read, picture, out)
    check_kind("TASK", options.task, [TASK], ("LOG", options.log))
    task = dollop.Task.load(options.task)
    log, background = (
        read_log(options.log, options, options.map),
        load_map(options.map, options.log),
    )
    found = watched(log, background, min_area=options.min_area)
    seen = tuple(note for note in found.notes if note.kind not in ABOUT_USER)
    now = found.environment
    with busy("adapting"):
        adapted = _adapted(task, now, options, seen)
    adapted = replace(adapted, notes=tuple(dict.fromkeys((*adapted.notes, *seen))))
    write_task(adapted, background, out, picture)
    data = {
        **as_data(adapted),
        "objects_before": task.environment.boxes,
        "objects_are": adapted.objects,
    }
    lines = (_went(task, adapted), *as_lines(adapted))
    tell(
        Result(lines, (out, picture), performing(out, options.map), adapted.notes, data),
        options.json,
    )


def _adapted(task, now, options, seen):
    """The task among the objects now; where that is not sure, how to say it is told."""
    matching = None
    if options.matching is not None:
        check_matching(options.matching, task.environment, now)
        matching = dollop.Matching.of_partners(options.matching)
    try:
        return task.adapt(now, matching, options.turned)
    except ValueError as error:
        tell_notes(seen)
        if matching is not None:
            raise
        why = str(error).split("; give matching=")[0]
        raise ValueError(how_to_say(task, now, options.turned, why)) from None


def how_to_say(task, now, turned, why):
    """Why it is refused, and how to say which object is which: by what is most probable, if that is possible.

    Parameters
    ----------
    task : Task
    now : Environment
        Objects as they stand now.
    turned : bool
        As for `Task.adapt`.
    why : str

    Returns
    -------
    str
    """
    partners = dollop.match(task.environment, now).partners
    places = f"then {_places(task.environment)}; now {_places(now)}"
    if not len(now):
        return f"none of the task's objects was found: {places}; the log must show where they stand"
    probable = _possible(task, now, partners, turned)
    if (partners < 0).all():
        why = "none of the task's objects was found again"
    rule = "say where each of the task's objects is now, -1 for one that is gone,"
    example = f"as in --matching={','.join(map(str, probable))}" if probable else "with --matching=N,..."
    return f"{why}; {rule} {example}: {places}"


def _possible(task, now, partners, turned):
    """The partners, if a task can be adapted by them; else none."""
    try:
        task.adapt(now, dollop.Matching.of_partners(partners), turned)
    except ValueError:
        return []
    return partners.tolist()


def check_matching(partners, before, now):
    """Refuse a matching that belongs to other environments.

    Parameters
    ----------
    partners : sequence of int
        To which object now each from before goes, -1 for none.
    before, now : Environment

    Raises
    ------
    ValueError
        For another number of them, a number that no object has, or one that is there twice.
    """
    if len(partners) != len(before):
        rule = f"--matching must have a number for each of the task's {len(before)} objects"
        raise ValueError(f"{rule}, got {len(partners)}")
    wrong = [each for each in partners if not -1 <= each < len(now)]
    if wrong:
        rule = f"--matching must be of the {len(now)} objects seen now, 0 to {len(now) - 1}"
        raise ValueError(f"{rule}, got {wrong[0]}")
    if len({each for each in partners if each >= 0}) < sum(each >= 0 for each in partners):
        told = ",".join(map(str, partners))
        raise ValueError(f"--matching must name no object twice, got {told}")


def _places(environment):
    """The objects of an environment, by number and place."""
    told = (f"{k} at ({x:.2f}, {y:.2f})" for k, (x, y) in enumerate(environment.centres))
    return ", ".join(told) or "none"


def _went(task, adapted):
    """Where the objects of a task went, for people."""
    before, after = task.environment.centres, adapted.environment.centres
    apart = [
        float(((after[now] - before[was]) ** 2).sum() ** 0.5)
        for was, now in zip(task.objects, adapted.objects, strict=True)
        if was >= 0 and now >= 0
    ]
    gone = sum(was >= 0 > now for was, now in zip(task.objects, adapted.objects, strict=True))
    left = f", {gone} not found again" if gone else ""
    farthest = f", by up to {max(apart):.2f} m" if apart else ""
    return f"{len(apart)} of {len(before)} objects found again{farthest}{left}"
