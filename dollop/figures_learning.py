"""Figures 11, 12 and x2: learning a task from several demonstrations (Sec. V)."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.stats import binomtest

from dollop import baseline, experiments, plot

SPREAD = 0.15  # m, standard deviation of a subgoal in figure x2
NUMBERS, FEW = (1, 2, 3, 4, 5, 7, 10), (2, 5, 10)  # of demonstrations
LINES = {  # method: name in the metrics, colour, marker, seeds, numbers of demonstrations
    "merging": ("merging", plot.LAW, "o", 50, NUMBERS),
    "plain mean": ("mean", plot.BACKGROUND, "v", 50, NUMBERS),
    "HMM, BIC": ("hmm", plot.USER, "s", 3, FEW),
    "left-to-right HMM, BIC": ("left_to_right", plot.OCCLUDED, "^", 3, FEW),
}


def figure_x2():
    """Beyond the paper: the task found, and how far off, against the number of demonstrations; merging beside others.

    A slalom of six subgoals, in 30 % of the demonstrations one more that is no part of it. hmmlearn takes far longer,
    so it gets fewer seeds: the bars, 95 % intervals, say what that costs.
    """
    table = pd.concat(
        baseline.study(("slalom",), numbers, (SPREAD,), range(seeds), (method,))
        for method, (_, _, _, seeds, numbers) in LINES.items()
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    for k, (method, rows) in enumerate(table.groupby("method", sort=False)):
        draw_shares(left, method, rows, shift=0.08 * (k - 1.5))
        draw_errors(right, method, rows)
    right.plot(NUMBERS, ideal_error(np.array(NUMBERS)), ":", color="black", label="ideal: a mean of n, 1/√n")
    left.set(xlabel="demonstrations", ylabel="share with right number and order", ylim=(-0.03, 1.03))
    left.legend(loc="lower right")
    right.set(xlabel="demonstrations", ylabel="mean error of a subgoal [m]", xscale="log", yscale="log")
    right.set_xticks((1, 2, 5, 10), ("1", "2", "5", "10"))
    right.set_yticks((0.05, 0.1, 0.2, 0.5, 1), ("0.05", "0.1", "0.2", "0.5", "1"))
    right.minorticks_off()
    right.legend(loc="upper right")
    return figure, measured(table)


def ideal_error(n):
    """Mean distance in m of the mean of n subgoals to the true one: that of a Rayleigh distribution."""
    return SPREAD * np.sqrt(np.pi / 2 / n)


def draw_shares(ax, method, rows, shift):
    """How often a method finds the right subgoals in the right order, with 95 % intervals (Wilson)."""
    _, colour, marker, seeds, _ = LINES[method]
    right = rows.groupby("n").right_order.agg(["sum", "count"])
    share = right["sum"] / right["count"]
    ends = [binomtest(k, n).proportion_ci(method="wilson") for k, n in right.itertuples(index=False)]
    reach = np.maximum([share - [end.low for end in ends], [end.high for end in ends] - share], 0)
    ax.errorbar(share.index + shift, share, reach, color=colour, marker=marker, label=f"{method} ({seeds} seeds)")


def draw_errors(ax, method, rows):
    """Mean error of the subgoals, where their number is right."""
    _, colour, marker, _, _ = LINES[method]
    error = rows.groupby("n").error.mean().dropna()
    ax.plot(error.index, error, color=colour, marker=marker, label=method)


def measured(table):
    """Shares, errors and seeds by method for a few numbers of demonstrations, and how merging's error falls with n."""
    metrics = {}
    for (method, n), rows in table[table.n.isin(FEW)].groupby(["method", "n"], sort=False):
        name = LINES[method][0]
        metrics |= {f"right_{name}_{n}": rows.right_order.mean(), f"seeds_{name}": len(rows)}
        if rows.right_number.any():
            metrics[f"error_m_{name}_{n}"] = rows.error.mean()
    error = table[table.method == "merging"].groupby("n").error.mean()
    metrics["exponent_merging"] = np.polyfit(np.log(error.index), np.log(error), 1)[0]
    metrics["error_by_ideal_merging"] = (error / ideal_error(error.index)).mean()
    return metrics


def figure_11a():
    """The first demonstration of a slalom, with its subgoals and law."""
    return draw_demonstration(0)


def figure_11b():
    """The second demonstration of it, among cones that stand elsewhere."""
    return draw_demonstration(1)


def draw_demonstration(k):
    """A demonstration as the laser saw it, and what it is made of."""
    recording, shown = experiments.slalom_recording(k), experiments.slalom_demonstration(k)
    figure, ax = plt.subplots(figsize=(6, 5.2))
    plot.workspace(experiments.background_map(), recording.scene.robot, shown.environment.boxes, ax)
    (walk,) = shown.trajectory
    plot.path(ax, walk, "user's track")
    plot.path(ax, shown.law.response(), "control law", plot.LAW, linewidth=2)
    plot.subgoals(ax, shown.law.subgoals)
    plot.legend_below(figure, ax)
    return figure, {"n_segments": len(shown.law.segments), "mean_error_m": shown.law.error(walk)}


def figure_12a():
    """The CDHMM merged from both demonstrations, in the environment of the first; the most-likely path in red."""
    task = experiments.slalom_task()
    figure, ax = plt.subplots(figsize=(6, 5.2))
    plot.workspace(experiments.background_map(), None, task.environment.boxes, ax)
    plot.cdhmm(ax, task.model)
    plot.legend_below(figure, ax)
    return figure, {
        "states_before": sum(len(sequence) for sequence in task.model.sequences),
        "states_after": len(task.model.means),
        "path_length": len(task.model.most_likely_path()),
    }


def figure_12b():
    """The task in an environment that nobody demonstrated it in, performed by the robot."""
    task, runs = experiments.new_slalom_task(), experiments.slalom_runs()
    figure, ax = plt.subplots(figsize=(6, 5.2))
    plot.workspace(experiments.background_map(), None, task.environment.boxes, ax)
    plot.path(ax, task.law.response(), "control law", plot.LAW, linewidth=2)
    plot.subgoals(ax, task.law.subgoals)
    plot.runs(ax, runs)
    plot.legend_below(figure, ax)
    shown = experiments.slalom_demonstration(0)
    sides = experiments.passing_sides(shown.law.response(), shown.environment.centres)
    right = [experiments.same_sides(run, task, sides) for run in runs]
    return figure, experiments.counts(runs) | {
        "passed_on_the_demonstrated_side": sum(right),
        "min_clearance_m": min(run.clearance.min() for run in runs),
    }
