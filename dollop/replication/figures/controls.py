"""The robot's runs under both kinds of control, drawn and counted: Figures 7, 10b and 12b."""

import joblib
import numpy as np

from dollop import plot
from dollop.replication import drawing, recordings
from dollop.replication.figures.kept import keep
from dollop.replication.runs import distances_to_law
from dollop.trajectory import arc_length, resample

__all__ = [
    "COLUMNS", "CONTROLS", "RESPONSES", "TITLES", "along_response", "at_once", "by_kind", "draw_distances", "draw_runs",
    "numbers",
]  # fmt: skip

CONTROLS = {
    "plain": ("the paper's kind of control: plain, obstacles ignored", ("plain", False)),
    "own": ("Dollop's own: pursuit, going round obstacles", ("pursuit", True)),
}
"""What each kind is, and how the recordings are asked for it: control and avoid."""

TITLES = {"plain": "the paper's kind of control", "own": "Dollop's own"}
"""The same in the fewest words, over axes."""

COLUMNS = {"plain": "plain, obstacles ignored", "own": "pursuit, going round obstacles"}
"""The same in few words, over the columns of numbers."""

ASIDE = 1.0
"""m by which the distance driven may differ from how far along the response a robot is."""

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
    return keep(work.__name__, lambda: dict(zip(CONTROLS, at_once(work, choices), strict=True)))


def draw_runs(ax, task, runs, method="held"):
    """Draw the robot's runs, over them the law's response, thin and dashed, and its subgoals.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    task : Task
        What was performed, where it was.
    runs : list of Run
    method : {"held", "paper"}
        Which response the runs follow.
    """
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax)
    plot.runs(ax, runs)
    look = {"linewidth": 0.7, "linestyle": (0, (3, 1.2)), "zorder": 4}
    plot.law(ax, task.law.response(method=method), drawing.RESPONSES[method], **look)
    drawing.order(ax, task.law.start, task.law.subgoals)


def draw_distances(ax, law, runs, method):
    """How far each run is from the response, over how far along it; and where the subgoals are."""
    for run in runs:
        along, away = along_response(run, law, method)
        look = {"colour": plot.RUN, "linewidth": 0.6, "alpha": 0.8}
        plot.path(ax, np.column_stack([along, 100 * away]), **look)
    parts = law.responses(method=method)
    places = np.cumsum([arc_length(each)[-1] if len(each) > 1 else 0.0 for each in parts])
    for k, place in enumerate(places, 1):
        ax.axvline(place, color="black", linestyle=":", linewidth=0.6, zorder=0)
        look = {"xycoords": ("data", "axes fraction"), "weight": "bold"}
        drawing.write(ax, str(k), (place, 1.0), (0, -3), **look)
    ax.set(xlabel="distance along the way [m]", ylabel="off [cm]", xlim=(0, places[-1] + 0.2))


def along_response(run, law, method):
    """How far along the response from where it started a run is, and how far from it.

    Where the response crosses itself the nearer part by the distance driven is meant.

    Returns
    -------
    along, away : (N,) float arrays
        In m.
    """
    positions = run.true_poses[:, :2]
    response = resample(law.response(positions[0], method=method), 1000)
    along, driven = arc_length(response), arc_length(positions)
    apart = np.linalg.norm(positions[:, None] - response, axis=2)
    driven *= along[-1] / driven[-1]
    apart[np.abs(driven[:, None] - along) > ASIDE] = np.inf
    return along[apart.argmin(axis=1)], distances_to_law(run, law, method)


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
