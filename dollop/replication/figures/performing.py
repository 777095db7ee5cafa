"""Figures 6b and 7: the control law, and the robot that performs it (Sec. III)."""

import matplotlib.pyplot as plt
import numpy as np

from dollop import plot
from dollop.pose import wrapped
from dollop.replication import drawing, recordings
from dollop.replication.figures.controls import (
    COLUMNS,
    RESPONSES,
    TITLES,
    by_kind,
    draw_distances,
    draw_runs,
    numbers,
)
from dollop.replication.figures.panel import panel
from dollop.replication.runs import distances_to_law, return_times
from dollop.trajectory import distance_to_polyline, mean_trajectory

__all__ = ["law_numbers"]

SIZE = (drawing.WIDTH, 3.1)
EIGHT = {"xlim": (0.9, 8.1), "ylim": (1.9, 5.2)}
"""m, the part of the laboratory in which the figure-eight is."""


@panel("6b", held="Dollop's own response", paper="every LDS alone")
def figure_6b():
    """The subgoals and control law extracted from the demonstrations.

    Crosses are subgoals, where one LDS hands over to the next, numbered in their order; the green
    line is the response of the sequenced LDS started where the laps start, the arrowheads say which
    way it is walked. Every LDS alone, as the paper has it, arrives at its subgoal along the
    direction in which it is slowest: at some it has a corner, the largest of which is told.
    Dollop's own response, which is drawn, is rounded there. The paper: 6 LDS, 20 mm on average.
    """
    shown = recordings.figure_eights()
    robot, task = shown.recording.log.poses[0], shown.task
    law, laps = task.law, shown.laps
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), robot, task.environment.boxes, ax)
    for k, lap in enumerate(laps):
        plot.path(ax, lap, "laps" if k == 0 else None, linewidth=0.4, alpha=0.6)
    plot.law(ax, law.response(), drawing.RESPONSES["held"])
    drawing.order(ax, law.start, law.subgoals)
    drawing.legend_below(figure, ax)
    return figure, {
        **law_numbers(law, laps),
        "tolerance_m": 0.02,
        **response_numbers(law, laps, "held"),
        **{f"paper_{name}": value for name, value in response_numbers(law, laps, "paper").items()},
    }


def response_numbers(law, laps, method):
    """Mean distances in m of laps and of their mean to a response, and its largest corner."""
    response = law.response(method=method)
    away = [distance_to_polyline(walk, response).mean() for walk in (mean_trajectory(laps), *laps)]
    corner = np.degrees(recordings.largest_corner(law, method=method))
    return {
        "mean_error_m": away[0],
        "mean_error_laps_m": np.mean(away[1:]),
        "largest_corner_deg": corner,
    }


def law_numbers(law, walks):
    """Number of segments of a law, and its mean distance in m from the mean of the walks behind it.

    Parameters
    ----------
    law : SequencedLDS
    walks : list of (N_k, 2) float arrays
        In m.

    Returns
    -------
    dict
    """
    return {"n_segments": len(law.segments), "mean_error_m": law.error(mean_trajectory(walks))}


@panel("7a", **COLUMNS)
def figure_7a():
    """Ten runs of Agent Orange performing the estimated trajectory of Figure 6b.

    (a) and (b): the paper's kind of control, which points along the response of every LDS alone and
    knows nothing of wheels, so that the robot swings wide in the curves. (c) and (d): Dollop's own,
    which comes back to what was shown, respects the robot's dynamics and would go round obstacles,
    but here it meets none. The fan is the starts, each a little off. Under each map every run's
    distance from that response from where the run started; the map has the response from where the
    laps start. Dotted lines are where the subgoals are. Of every LDS alone the response has corners
    there; Dollop's own is rounded.
    """
    task, runs_of = recordings.figure_eights().task, by_kind(recordings.eight_runs)
    heights = {"height_ratios": (2, 1, 2, 1)}
    figure, axes = plt.subplots(4, 1, figsize=(drawing.WIDTH, 6.6), gridspec_kw=heights)
    for pair, (kind, runs) in zip(axes.reshape(2, 2), runs_of.items(), strict=True):
        draw_runs(pair[0], task, runs, RESPONSES[kind])
        pair[0].set(xlabel="", **EIGHT)
        draw_distances(pair[1], task.law, runs, RESPONSES[kind])
    highest = max(ax.get_ylim()[1] for ax in axes[1::2])
    for ax in axes[1::2]:
        ax.set(ylim=(0, 1.1 * highest))
    titles = [(title, "the same ten runs along their way") for title in TITLES.values()]
    drawing.lettered(axes, sum(titles, ()))
    drawing.legend_below(figure, *axes[::2])
    return figure, numbers(runs_of, how_near)


def how_near(runs, method):
    """How far the runs are from the response, and their estimated poses from the true ones."""
    law = recordings.figure_eights().task.law
    distances = np.concatenate([distances_to_law(run, law, method) for run in runs])
    places, turns = np.transpose([pose_errors(run) for run in runs])
    return {
        "mean_distance_m": distances.mean(),
        "max_distance_m": distances.max(),
        "localisation_error_m": places.mean(),
        "localisation_error_deg": np.degrees(turns.mean()),
    }


def pose_errors(run):
    """Mean errors of the estimated pose while the robot trusts it: m and rad."""
    off = (run.poses - run.true_poses)[run.localised]
    return np.hypot(off[:, 0], off[:, 1]).mean(), np.abs(wrapped(off[:, 2])).mean()


@panel("7b", **COLUMNS)
def figure_7b():
    """The response of Agent Orange after being kidnapped.

    Five runs, one a row. A dotted line leads to where the robot was carried, and the number there
    is the run's. Left the paper's kind of control: it heads for the active subgoal through whatever
    is in the way, and the circle is the robot where that first ends in a contact; that the paper's
    robot hit nothing was, as it says, a coincidence. Right Dollop's own, which goes round
    obstacles. One run may touch an obstacle several times, so contacts and runs with a contact are
    counted apart. Time to return: until the robot is within ten centimetres of the response from
    its start and stays there for a second. Dashed green is the response from where the laps start;
    of every LDS alone it has corners at its subgoals.
    """
    task, runs_of = recordings.figure_eights().task, by_kind(recordings.kidnapped_runs)
    count = len(runs_of["plain"])
    size = drawing.WIDTH, 0.92 * count + 0.9
    figure, axes = plt.subplots(count, 2, figsize=size, sharex=True, sharey=True, squeeze=False)
    for column, (kind, runs) in zip(axes.T, runs_of.items(), strict=True):
        for k, (ax, run) in enumerate(zip(column, runs, strict=True)):
            draw_kidnapped(ax, task, run, k, RESPONSES[kind])
    drawing.lettered(axes[0], TITLES.values())
    for k, ax in enumerate(axes[:, 0], 1):
        ax.set_ylabel(f"run {k}")
    drawing.legend_below(figure, *axes.flat)
    return figure, numbers(runs_of, how_soon)


def draw_kidnapped(ax, task, run, k, method):
    """The k-th run, alone in the room, over the response that it follows."""
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax)
    look = {"linewidth": 0.7, "linestyle": (0, (3, 1.2))}
    plot.law(ax, task.law.response(method=method), drawing.RESPONSES[method], **look)
    plot.runs(ax, [run], first=k)
    plot.start(ax, run.true_poses[0, :2])
    ax.set(xlabel="", ylabel="", xlim=(0, 9), ylim=(1.2, 5.9), xticks=(), yticks=())


def how_soon(runs, method):
    """Mean time in s until the kidnapped robots are back on the response, None if none ever is."""
    law = recordings.figure_eights().task.law
    times = np.concatenate([return_times(run, law, method=method) for run in runs])
    back = times[np.isfinite(times)]
    return {"return_time_s": back.mean() if len(back) else None}
