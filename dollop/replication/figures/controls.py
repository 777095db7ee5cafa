"""The robot's runs under both kinds of control, drawn and counted: Figures 7, 10b and 12b."""

import joblib

from dollop import plot
from dollop.replication import recordings

__all__ = ["COLUMNS", "CONTROLS", "RESPONSES", "at_once", "by_kind", "draw_runs", "numbers"]

CONTROLS = {
    "plain": ("the paper's kind of control: plain, obstacles ignored", ("plain", False)),
    "own": ("Dollop's own: pursuit, going round obstacles", ("pursuit", True)),
}
"""What each kind is, and how the recordings are asked for it: control and avoid."""

COLUMNS = {"plain": "plain, obstacles ignored", "own": "pursuit, going round obstacles"}
"""The same in few words, over the columns of numbers."""

RESPONSES = {"plain": "paper", "own": "held"}
"""Which response of the law each kind follows: the plain one that of every LDS alone."""


def at_once(work, arguments):
    """Call a function several times, two at a time; seeds being fixed, the numbers are the same.

    The processes are forked, so that what has been recorded and learned before is theirs as well.

    Parameters
    ----------
    work : callable
        At the top level of a module, so that another process can find it.
    arguments : iterable of tuple
        What each call gets.

    Returns
    -------
    list
        What the calls return, in order.
    """
    return joblib.Parallel(n_jobs=2, backend="multiprocessing")(joblib.delayed(work)(*each) for each in arguments)


def by_kind(work):
    """The runs of both kinds of control.

    Parameters
    ----------
    work : callable
        Takes control and avoid, and returns a list.

    Returns
    -------
    dict
        By kind, a key of `CONTROLS`.
    """
    choices = [choices for _, choices in CONTROLS.values()]
    return dict(zip(CONTROLS, at_once(work, choices), strict=True))


def draw_runs(ax, task, runs, title, method="held"):
    """Draw the response of the law, and the runs of the robot over it.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    task : Task
        What was performed, where it was.
    runs : list of Run
    title : str
    method : {"held", "paper"}
        Which response the runs follow.
    """
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax, title)
    plot.law(ax, task.law.response(method=method))
    plot.runs(ax, runs)


def numbers(runs_of, further=None):
    """What came of runs of both kinds, by the keys of metrics.json.

    Parameters
    ----------
    runs_of : dict
        Lists of as many Run, by kind.
    further : callable, optional
        What else is measured: from a list of Run, and which response they follow, to a dict.

    Returns
    -------
    dict
        `runs` of each kind, all else with the kind before its name.
    """
    measured = {"runs": len(runs_of["plain"])}
    for kind, runs in runs_of.items():
        found = outcome(runs) | (further(runs, RESPONSES[kind]) if further else {})
        measured |= {f"{kind}_{name}": value for name, value in found.items()}
    return measured


def outcome(runs):
    """How many runs finished, how often and in how many something was hit, how near they came."""
    return {
        "finished": sum(run.finished for run in runs),
        "collisions": sum(run.collisions for run in runs),
        "runs_with_collision": sum(run.collisions > 0 for run in runs),
        "min_clearance_m": min(run.clearance.min() for run in runs),
    }
