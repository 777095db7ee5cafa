"""Figures 11, 12 and x2: learning a task from several demonstrations (Sec. V)."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.stats import binomtest
from scipy.stats import t as t_distribution

from dollop import plot
from dollop.replication import baseline, drawing, recordings
from dollop.replication.figures.controls import (
    COLUMNS,
    CONTROLS,
    RESPONSES,
    by_kind,
    draw_runs,
    numbers,
)
from dollop.replication.figures.panel import panel
from dollop.replication.figures.performing import law_numbers

__all__ = []

SIZE = (6, 5.2)
SPREAD = 0.15  # m, standard deviation of a subgoal in figure x2
NUMBERS, FEW = (1, 2, 3, 4, 5, 7, 10), (2, 5, 10)  # of demonstrations
LONGER = tuple(range(8, 16))  # subgoals of tasks that are drawn
SEEDS, SEEDS_LONGER = 50, 7  # of the slalom; of each number of subgoals
LINES = {  # method: name in metrics.json, marker, numbers of demonstrations
    "merging": ("merging", "o", NUMBERS),
    "plain mean": ("mean", "v", NUMBERS),
    "ergodic HMM": ("hmm", "s", FEW),
    "left-to-right HMM": ("left_to_right", "^", FEW),
}


@panel("x2", extra="baseline", **{name: method for method, (name, *_) in LINES.items()})
def figure_x2():
    """Beyond the paper: learning a task from more and more demonstrations.

    Left, how often a method finds the right subgoals of the slalom in the right order, in the middle
    those of tasks of 8 to 15 subgoals that are drawn; right, how far off they are on the slalom
    where their number is right. Bars are 95 % intervals, over 50 seeds of the slalom and 56 tasks.
    Dotted is the error to be expected of the mean of so many subgoals, which falls as one over the
    root of their number. The hidden Markov models are set up as their advocate would, and told the
    spread that merging is told. Left to right, stepping over one state at most, they do as well as
    merging on the slalom; with steps that may
    lead anywhere they miss many of the longer tasks from two demonstrations.
    """
    table = found_by_all()
    figure, axes = plt.subplots(1, 3, figsize=(12, 4))
    for k, (method, rows) in enumerate(table.groupby("method", sort=False)):
        slalom, shift = rows[rows.task == "slalom"], 1.06 ** (k - 1.5)
        draw_shares(axes[0], method, slalom[slalom.n.isin(FEW)], shift)
        draw_shares(axes[1], method, rows[rows.task != "slalom"], shift)
        draw_errors(axes[2], method, slalom, shift**0.25)
    axes[2].plot(
        NUMBERS,
        expected_error(np.array(NUMBERS)),
        ":",
        color="black",
        label="expected of a mean of n",
    )
    for ax in axes:
        ax.set(xlabel="demonstrations", xscale="log")
        ax.set_xticks((1, 2, 5, 10), ("1", "2", "5", "10"))
    axes[0].set(
        title="slalom",
        ylabel="share with right number and order",
        ylim=(-0.03, 1.03),
        xlim=(1.6, 12.5),
    )
    axes[1].set(title="tasks of 8 to 15 subgoals", ylim=(-0.03, 1.03), xlim=(1.6, 6.3))
    axes[2].set(title="slalom", ylabel="mean error of a subgoal [m]", yscale="log")
    axes[2].set_yticks((0.05, 0.1, 0.2, 0.4), ("0.05", "0.1", "0.2", "0.4"))
    for ax in axes:
        ax.minorticks_off()
    drawing.legend_below(figure, *axes)
    return figure, measured(table)


def found_by_all():
    """Structure learners compared (`baseline.study`), on the slalom and on longer tasks, a row each."""
    parts = []
    for method, (_, _, shown) in LINES.items():
        learner = {method: baseline.METHODS[method]}
        parts.append(baseline.study(("slalom",), shown, (SPREAD,), range(SEEDS), learner, jobs=2))
        asked = LONGER, FEW[:2], (SPREAD,), range(SEEDS_LONGER)
        parts.append(baseline.study(*asked, learner, jobs=2))
    return pd.concat(parts)


def expected_error(n):
    """Mean distance in m of the mean of n subgoals to the true one: a Rayleigh distribution's."""
    return SPREAD * np.sqrt(np.pi / 2 / n)


def draw_shares(ax, method, rows, shift):
    """How often a method finds the right subgoals in the right order, with Wilson's intervals."""
    right = rows.groupby("n").right_order.agg(["sum", "count"])
    share = right["sum"] / right["count"]
    counted = right.itertuples(index=False)
    ends = np.transpose([binomtest(k, n).proportion_ci(method="wilson") for k, n in counted])
    draw_points(ax, method, share, np.maximum([share - ends[0], ends[1] - share], 0), shift)


def draw_errors(ax, method, rows, shift):
    """Mean error of the subgoals where their number is right, with the interval of that mean."""
    error = rows.dropna(subset="error").groupby("n").error
    reach = error.sem() * t_distribution.ppf(0.975, np.maximum(error.count() - 1, 1))
    draw_points(ax, method, error.mean(), reach, shift)


def draw_points(ax, method, values, reach, shift):
    """A point with its interval for each number of demonstrations, beside those of others."""
    look = {"color": drawing.METHODS[method], "marker": LINES[method][1], "linestyle": "none"}
    ax.errorbar(values.index * shift, values, reach, label=method, **look)


def measured(table):
    """Shares, errors and seeds by method for a few n, and how merging's error falls with n."""
    metrics, longer = {}, table[table.task != "slalom"]
    slalom = table[table.task == "slalom"]
    for (method, n), rows in slalom[slalom.n.isin(FEW)].groupby(["method", "n"], sort=False):
        name = LINES[method][0]
        metrics |= {f"{name}_seeds": len(rows), f"{name}_right_{n}": rows.right_order.mean()}
        if rows.right_number.any():
            metrics[f"{name}_error_m_{n}"] = rows.error.mean()
    for (method, n), rows in longer.groupby(["method", "n"], sort=False):
        metrics[f"{LINES[method][0]}_longer_right_{n}"] = rows.right_order.mean()
    error = slalom[slalom.method == "merging"].groupby("n").error.mean()
    metrics["merging_exponent"] = np.polyfit(np.log(error.index), np.log(error), 1)[0]
    metrics["merging_error_by_expected"] = (error / expected_error(error.index)).mean()
    return metrics


@panel("11a")
def figure_11a():
    """The first demonstration of a task, its subgoals and control law.

    A slalom past four cones, as tracked by the laser (thin line), and the law that was made of it
    (wide line).
    """
    return draw_demonstration(0)


@panel("11b")
def figure_11b():
    """The second demonstration, in a different environment.

    The same cones, elsewhere: the walk passes each on the same side as before.
    """
    return draw_demonstration(1)


def draw_demonstration(k):
    """A demonstration as the laser saw it, and what it is made of."""
    scene, shown = recordings.slalom(k).scene, recordings.slalom(k).demonstration
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), scene.robot.pose, shown.environment.boxes, ax)
    (walk,) = shown.trajectory
    plot.law(ax, shown.law.response(), linewidth=4, alpha=0.6)
    plot.path(ax, walk, "user's track", linewidth=1)
    plot.subgoals(ax, shown.law.subgoals)
    drawing.legend_below(figure, ax)
    return figure, law_numbers(shown.law, [walk])


@panel("12a")
def figure_12a():
    """The CDHMM estimated from the demonstrations of Figure 11, with the most-likely path.

    Both demonstrations were mapped to the first one's environment (dots and triangles), each subgoal
    by the objects that its place follows; then states that the evidence cannot tell apart were
    merged. An ellipse is two standard deviations of where a state's subgoal is expected. With two
    demonstrations that is nearly all prior: the model starts from the spread below, which all
    subgoals together tell, and the two of a state change it little.
    """
    task = recordings.slalom_task()
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax)
    for k, (sequence, marker) in enumerate(zip(task.model.sequences, "o^", strict=True)):
        label = f"subgoals of demonstration {k + 1}"
        ax.plot(*sequence.T, marker, color=plot.USER, markersize=4, zorder=6, label=label)
    plot.cdhmm(ax, task.model)
    drawing.legend_below(figure, ax, columns=3)
    return figure, {
        "states_before": sum(len(sequence) for sequence in task.model.sequences),
        "states_after": len(task.model.means),
        "path_length": len(task.model.most_likely_path()),
        "spread_m": task.model.spread,
        "mean_sd_m": np.sqrt(np.trace(task.model.covariances, axis1=1, axis2=2) / 2).mean(),
    }


@panel("12b", **COLUMNS)
def figure_12b():
    """The result after mapping the subgoals to a new environment.

    Nobody ever walked among these cones; the fan is the starts of ten runs, the same above and
    below. Both times the law is what two demonstrations together tell of which cone each of its
    places follows. Above the paper's kind of control: the plain law, which knows of no obstacle and
    comes as near to the cones as the law does. Below Dollop's own, which goes round what is near:
    between two cones it keeps to the middle and leaves the law. The largest corner is where the
    user turned as sharply. A circle, if there is one, is the robot where it first touches something.
    """
    task, runs_of = recordings.new_slalom_task(), by_kind(recordings.slalom_runs)
    figure, axes = plt.subplots(2, 1, figsize=(8, 6.4), sharex=True)
    for ax, (kind, (title, _)) in zip(axes, CONTROLS.items(), strict=True):
        draw_runs(ax, task, runs_of[kind], title, RESPONSES[kind])
        plot.subgoals(ax, task.law.subgoals)
        ax.set(xlim=(0.6, 8.4), ylim=(2.2, 4.8))
    axes[0].set_xlabel("")
    drawing.legend_below(figure, *axes)
    return figure, numbers(runs_of) | {
        "own_passed_on_the_demonstrated_side": passed_rightly(runs_of["own"]),
        "largest_corner_deg": np.degrees(recordings.largest_corner(task.law)),
    }


def passed_rightly(runs):
    """How many runs pass every cone on the demonstrated side.

    Not asked of the plain law's runs: a robot that backs off the cone it touched faces any way
    there.
    """
    shown = recordings.slalom(0).demonstration
    sides = recordings.passing_sides(shown.law.response(), shown.environment.centres)
    return sum(recordings.same_sides(run, recordings.new_slalom_task(), sides) for run in runs)
