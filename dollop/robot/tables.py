"""Runs as tables, a row for each control period (beyond the paper).

The columns are t in s, the pose that the robot believed (x, y in m, theta in rad) and its true one,
the way and the segment in force, whether it was localised, its clearance in m, and what happened:
empty, or one or more of "radius R m" (of the robot, in the first row), "subgoal K", "waits S s",
"kidnapped", "touches", with semicolons between them; in the last row also "finished", or the reason
why not. What nobody knew, such as a true pose, is empty.
"""

import csv
import re

import numpy as np

from dollop.formats.files import FormatError, from_file, read_lines, written_number
from dollop.formats.kinds import RUN
from dollop.formats.writing import whole_file
from dollop.robot import Run

__all__ = ["COLUMNS", "events_of", "load_run", "rows_kidnapped", "save_run"]

COLUMNS = (
    "t", "x", "y", "theta", "true_x", "true_y", "true_theta", "way", "segment", "localised", "clearance", "event",
)  # fmt: skip
FINISHED, BETWEEN = "finished", "; "
STILL = 1e-3
"""m that a robot which stands moves in a period at most: braking ends below it."""
_RADIUS = re.compile(r"radius ([0-9.e+-]+) m")


def save_run(path, run):
    """Write a run as a table, whole or not at all.

    Parameters
    ----------
    path : str or Path
    run : Run

    Raises
    ------
    OSError
        Where the file cannot be written, or what is there is no run.
    """
    events = [BETWEEN.join(each) for each in events_of(run)]
    columns = run.t, *run.poses.T, *run.true_poses.T
    numbers = [list(map(_written, column.tolist())) for column in columns]
    counts = [column.tolist() for column in (run.way, run.active, run.localised.astype(int))]
    clearance = map(_written, run.clearance.tolist())
    with whole_file(path, "w", RUN) as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows(zip(*numbers, *counts, clearance, events, strict=True))


def _written(value):
    """A number to a millionth, nothing for none."""
    return f"{value + 0:.6f}".rstrip("0").rstrip(".") if np.isfinite(value) else ""


def events_of(run):
    """What happened in each period of a run.

    Parameters
    ----------
    run : Run

    Returns
    -------
    list of N lists of str
        See the top of `dollop.robot.tables`.
    """
    events = [[] for _ in run.t]
    events[0].append(f"radius {run.radius:g} m")
    for k in rows_kidnapped(run).tolist():
        events[k].append("kidnapped")
    for k in np.flatnonzero(np.diff(run.active) | np.diff(run.way)) + 1:
        if run.way[k] != run.way[k - 1]:
            events[k].append(f"way {run.way[k]}")
        elif run.active[k] > run.active[k - 1]:
            events[k].append(f"subgoal {run.active[k]}")
    for k, seconds in _waits(run):
        events[k].append(f"waits {seconds:.1f} s")
    for k in _begins(run.clearance < 0):
        events[k].append("touches")
    if run.finished:
        events[-1].append(f"subgoal {run.active[-1] + 1}")
    events[-1].append(FINISHED if run.finished else run.reason.replace(BETWEEN, ", "))
    return events


def rows_kidnapped(run):
    """In which periods of a run the robot stands where it was put.

    Parameters
    ----------
    run : Run

    Returns
    -------
    (M,) int array
    """
    return np.searchsorted(run.t, run.kidnapped - 0.5 * run.t[1:2].sum()).clip(0, len(run.t) - 1)


def _waits(run):
    """When a run began to stand where the task waits, the row, and for how long in s."""
    moves = np.hypot(*np.diff(run.poses[:, :2], axis=0).T)
    begins = _begins(np.append(moves, np.inf) < STILL)
    for k, _, stood in run.waits:
        reached = np.flatnonzero(run.active >= k)
        if stood > 0 and len(begins) and len(reached):
            yield begins[np.abs(begins - reached[0]).argmin()], stood


def _begins(flags):
    """Where in (N,) flags a run of True begins."""
    return np.flatnonzero(np.diff(flags, prepend=False) & flags)


def load_run(path):
    """Read a run that `save_run` wrote.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Run
        Its numbers to a millionth. Its collisions are counted by its clearance.

    Raises
    ------
    FormatError
        For a file that is damaged or no run; with the line.
    """
    lines = (line.decode("utf-8", "replace") for line in read_lines(path))
    rows = list(csv.reader(lines))
    if not rows or tuple(rows[0]) != COLUMNS:
        raise FormatError(f"not a run: its columns must be {','.join(COLUMNS)}", path, 1)
    if len(rows) < 2:
        raise FormatError("a run must have a period, got none", path, 2)
    values = np.array([_numbers(path, k, row) for k, row in enumerate(rows[1:], 2)])
    events = [row[-1].split(BETWEEN) if row[-1] else [] for row in rows[1:]]
    return from_file(path, _as_run, values, events)


def _numbers(path, line, row):
    """The numbers of a row; nothing is NaN."""
    if len(row) != len(COLUMNS):
        raise FormatError(f"a row must have {len(COLUMNS)} columns, got {len(row)}", path, line)
    try:
        pairs = zip(COLUMNS, row[:-1], strict=False)
        return [written_number(name, text) if text else np.nan for name, text in pairs]
    except ValueError as error:
        raise FormatError(str(error), path, line) from None


def _as_run(values, events):
    """The run of rows (N, 11) and what happened in each."""
    t, clearance = values[:, 0], values[:, 10]
    if not events[-1]:
        raise ValueError("the last row must say that the run is finished, or why not")
    end, radius = events[-1][-1], _RADIUS.fullmatch(events[0][0]) if events[0] else None
    kidnapped = [time for time, each in zip(t.tolist(), events, strict=True) if "kidnapped" in each]
    known = {
        "finished": end == FINISHED,
        "reason": "" if end == FINISHED else end,
        "collisions": len(_begins(clearance < 0)),
        "kidnapped": np.array(kidnapped),
        "way": values[:, 7],
    }
    if radius:
        known["radius"] = float(radius[1])
    return Run(
        t,
        values[:, 1:4],
        values[:, 4:7],
        values[:, 8],
        values[:, 9].astype(bool),
        clearance,
        **known,
    )
