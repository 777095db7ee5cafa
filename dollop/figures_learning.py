"""Figure x2: learning a task from several demonstrations (Sec. V)."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.stats import binomtest

from dollop import baseline, plot

SPREAD = 0.15  # m, standard deviation of a subgoal in figure x2
LINES = {  # method: colour, marker, seeds, numbers of demonstrations
    "merging": (plot.LAW, "o", 60, tuple(range(1, 11))),
    "plain mean": (plot.BACKGROUND, "v", 60, tuple(range(1, 11))),
    "HMM, BIC": (plot.USER, "s", 5, (2, 5, 10)),
    "left-to-right HMM, BIC": (plot.OCCLUDED, "^", 5, (2, 5, 10)),
}


def figure_x2():
    """Beyond the paper: the task found, and how far off, against the number of demonstrations; merging beside others.

    A slalom of six subgoals; in 30 % of the demonstrations one more that is no part of it. hmmlearn is a hundred times
    slower, so it gets fewer seeds: the bars, 95 % intervals, say what that costs.
    """
    table = pd.concat(
        baseline.study(("slalom",), numbers, (SPREAD,), range(seeds), (method,))
        for method, (_, _, seeds, numbers) in LINES.items()
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    for method, rows in table.groupby("method", sort=False):
        draw_shares(left, method, rows)
        draw_errors(right, method, rows)
    n = np.arange(1, 11)
    right.plot(n, ideal_error(n), ":", color="black", label="ideal: a mean of n, 1/√n")
    left.set(xlabel="demonstrations", ylabel="share with right number and order", ylim=(-0.03, 1.03))
    right.set(xlabel="demonstrations", ylabel="mean error of a subgoal [m]", xscale="log", yscale="log")
    right.set_xticks((1, 2, 5, 10), ("1", "2", "5", "10"))
    right.set_yticks((0.05, 0.1, 0.2, 0.5, 1), ("0.05", "0.1", "0.2", "0.5", "1"))
    for ax in (left, right):
        ax.minorticks_off()
    left.legend(loc="lower right")
    right.legend(loc="upper right", ncols=1)
    return figure, measured(table)


def ideal_error(n):
    """Mean distance in m of the mean of n subgoals to the true one: that of a Rayleigh distribution."""
    return SPREAD * np.sqrt(np.pi / 2 / n)


def draw_shares(ax, method, rows):
    """How often a method finds the right subgoals in the right order, with 95 % intervals (Wilson)."""
    colour, marker, seeds, _ = LINES[method]
    right = rows.groupby("n").right_order.agg(["sum", "count"])
    share = right["sum"] / right["count"]
    ends = [binomtest(k, n).proportion_ci(method="wilson") for k, n in right.itertuples(index=False)]
    reach = [share - [end.low for end in ends], [end.high for end in ends] - share]
    ax.errorbar(
        share.index, share, np.maximum(reach, 0), color=colour, marker=marker, label=f"{method} ({seeds} seeds)"
    )


def draw_errors(ax, method, rows):
    """Mean error of the subgoals, where their number is right."""
    colour, marker, _, _ = LINES[method]
    error = rows.groupby("n").error.mean().dropna()
    ax.plot(error.index, error, color=colour, marker=marker, label=method)


def measured(table):
    """Shares, errors and seeds by method for 2, 5 and 10 demonstrations, and how the error falls with n."""
    metrics = {}
    for (method, n), rows in table[table.n.isin((2, 5, 10))].groupby(["method", "n"], sort=False):
        metrics[f"right_{method}_{n}"] = rows.right_order.mean()
        metrics[f"error_m_{method}_{n}"] = rows.error.mean() if rows.right_number.any() else None
        metrics[f"seeds_{method}_{n}"] = len(rows)
    error = table[table.method == "merging"].groupby("n").error.mean()
    metrics["exponent_merging"] = np.polyfit(np.log(error.index), np.log(error), 1)[0]
    metrics["error_by_ideal_merging"] = (error / ideal_error(error.index)).mean()
    return metrics
