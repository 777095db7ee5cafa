"""Figures 11, 12 and x2: learning a task from several demonstrations (Sec. V)."""

from functools import cache
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from scipy.stats import binomtest
from scipy.stats import t as t_distribution

from dollop import lab, plot
from dollop.observation import observe
from dollop.replication import baseline, drawing, recordings
from dollop.replication.figures.controls import (
    COLUMNS,
    RESPONSES,
    TITLES,
    by_kind,
    draw_runs,
    numbers,
)
from dollop.replication.figures.panel import panel
from dollop.replication.figures.performing import law_numbers
from dollop.task import Demonstration, learn

__all__ = []

ROW = {"xlim": (0.6, 8.7), "ylim": (2.0, 5.3)}
"""m, the part of the laboratory in which the row of cones stands."""
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

    (a) How often a method finds the right subgoals of the slalom in the right order, (b) those of
    tasks of 8 to 15 subgoals that are drawn; (c) how far off they are on the slalom where their
    number is right. Bars are 95 % intervals, over 50 seeds of the slalom and 56 tasks. Dotted is
    the error to be expected of the mean of so many subgoals, which falls as one over the root of
    their number. The hidden Markov models are set up as their advocate would, and told the spread
    that merging is told. Left to right, stepping over one state at most, they do as well as merging
    on the slalom; with steps that may lead anywhere they miss many of the longer tasks from two
    demonstrations.
    """
    table = found_by_all()
    figure, mosaic = plt.subplot_mosaic("aaabb;ccccc", figsize=(drawing.WIDTH, 4.0))
    axes = list(mosaic.values())
    for k, (method, rows) in enumerate(table.groupby("method", sort=False)):
        slalom, shift = rows[rows.task == "slalom"], 1.06 ** (k - 1.5)
        draw_shares(axes[0], method, slalom[slalom.n.isin(FEW)], shift)
        draw_shares(axes[1], method, rows[rows.task != "slalom"], shift)
        draw_errors(axes[2], method, slalom, shift**0.25)
    expected = {"linestyle": ":", "color": "black", "label": "expected of a mean of n"}
    axes[2].plot(NUMBERS, expected_error(np.array(NUMBERS)), **expected)
    for ax in axes:
        ax.set(xlabel="demonstrations", xscale="log")
        ax.set_xticks((1, 2, 5, 10), ("1", "2", "5", "10"))
    axes[0].set(ylabel="share right", ylim=(-0.03, 1.03), xlim=(1.6, 12.5))
    axes[1].set(ylim=(-0.03, 1.03), xlim=(1.6, 6.3))
    axes[1].tick_params(labelleft=False)
    axes[2].set(ylabel="error of a subgoal [m]", yscale="log")
    axes[2].set_yticks((0.05, 0.1, 0.2, 0.4), ("0.05", "0.1", "0.2", "0.4"))
    for ax in axes:
        ax.minorticks_off()
    drawing.lettered(axes, ("slalom", "8–15 subgoals", "slalom"))
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
    look = {
        "color": drawing.METHODS[method],
        "marker": LINES[method][1],
        "linestyle": "none",
        "linewidth": 0.8,
    }
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

    A slalom past four cones: (a) as tracked by the laser, and where its subgoals are; (b) the law
    that was made of it, apart, for it lies on the track. Its response is rounded at the subgoals;
    that of every LDS alone would have corners there.
    """
    return draw_demonstration(0)


@panel("11b")
def figure_11b():
    """The second demonstration, in a different environment.

    The same cones, elsewhere: the walk passes each on the same side as before. (a) The track, (b)
    the law.
    """
    return draw_demonstration(1)


def draw_demonstration(k):
    """A demonstration as the laser saw it, and what it is made of."""
    shown = recordings.slalom(k).demonstration
    figure, axes = plt.subplots(2, 1, figsize=(drawing.WIDTH, 3.45), sharex=True)
    (walk,) = shown.trajectory
    for ax in axes:
        plot.workspace(recordings.background_map(), None, shown.environment.boxes, ax)
        drawing.order(ax, shown.law.start, shown.law.subgoals)
        ax.set(**ROW)
    plot.path(axes[0], walk, "user's track", linewidth=0.8)
    plot.law(axes[1], shown.law.response(), drawing.RESPONSES["held"])
    axes[0].set_xlabel("")
    drawing.lettered(axes, ("as tracked", "the law"))
    drawing.legend_below(figure, *axes)
    return figure, law_numbers(shown.law, [walk])


@panel("12a")
def figure_12a():
    """The CDHMM estimated from the demonstrations of Figure 11, with the most-likely path.

    Both demonstrations were mapped to the first one's environment, each subgoal by the objects that
    its place follows; then states that the evidence cannot tell apart were merged. (a) In the room,
    the subgoals of each demonstration, and the states that they were merged to. An ellipse is two
    standard deviations of where a state's subgoal is expected. With two demonstrations that is
    nearly all prior: the model starts from the spread below, which all subgoals together tell, and
    the two of a state change it little. (b) The graph: above, a row per demonstration, a state of
    its own for every subgoal, as it was before merging; below, the states after it. Dotted lines
    lead from every subgoal to the state that it went into.
    """
    task = recordings.slalom_task()
    figure = draw_learned(task)
    return figure, model_numbers(task.model)


MARKERS = "o^s"
"""Of the subgoals of each demonstration."""
INSIDE = {"ha": "center", "va": "center_baseline", "zorder": 4}
"""How a number stands in its state."""


def draw_learned(task):
    """The CDHMM of a task in the room, and its graph before and after merging."""
    shown = len(task.model.sequences)
    figure, axes = plt.subplots(
        2,
        1,
        figsize=(drawing.WIDTH, 2.85 + 0.45 * shown),
        gridspec_kw={"height_ratios": (1.5, 0.55 + 0.4 * shown)},
    )
    ax = plot.workspace(recordings.background_map(), None, task.environment.boxes, axes[0])
    for k, sequence in enumerate(task.model.sequences):
        plot.path(ax, sequence, None, linewidth=0.5, linestyle=(0, (2, 2)), zorder=4)
        look = {
            "color": plot.USER,
            "markersize": 3,
            "zorder": 6,
            "label": f"subgoals of demonstration {k + 1}",
        }
        ax.plot(*sequence.T, MARKERS[k], **look)
    plot.cdhmm(ax, task.model)
    ax.set(**ROW)
    draw_graph(axes[1], task.model)
    drawing.lettered(axes, ("in the room", "before merging, and after"))
    drawing.legend_below(figure, axes[0], columns=2)
    return figure


def draw_graph(ax, model):
    """A row of states for each demonstration, and under them the graph that they are merged to.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    model : SubgoalHMM
    """
    rows, states = len(model.states), len(model.means)
    for k, visited in enumerate(model.states):
        y = rows - k
        chain = [-1, *visited.tolist(), states]
        for u, v in pairwise(chain):
            draw_step(ax, (u, y), (v, y), plot.USER, 0.8)
        for number, state in enumerate(visited, 1):
            ax.plot([state, state], [y, 0], ":", color=plot.BACKGROUND, linewidth=0.8, zorder=0)
            ax.plot(
                state,
                y,
                MARKERS[k],
                color="white",
                markeredgecolor=plot.USER,
                markersize=9,
                zorder=3,
            )
            ax.text(state, y, str(number), fontsize=6.2, **INSIDE)
        ax.text(-1.4, y + 0.4, f"demonstration {k + 1}", va="center", path_effects=[plot.HALO])
    way = model.most_likely_path().tolist()
    likely = set(pairwise([-1, *way, states]))
    for u, v in sorted(steps_of(model)):
        colour, width = (plot.MOST_LIKELY, 1.6) if (u, v) in likely else (plot.BACKGROUND, 0.9)
        draw_step(ax, (u, 0), (v, 0), colour, width, bent=v - u > 1)
    for state in range(states):
        ax.plot(state, 0, "o", color="#D9D9D9", markeredgecolor="black", markersize=10, zorder=3)
        ax.text(state, 0, str(state), fontsize=6.5, **INSIDE)
    ax.text(-1.4, 0.4, "merged", va="center", path_effects=[plot.HALO])
    for y in range(rows + 1):
        ax.text(-1, y, "start", ha="center", va="center", style="italic", fontsize=6.5)
        ax.text(states, y, "end", ha="center", va="center", style="italic", fontsize=6.5)
    ax.set(
        xlim=(-1.5, states + 0.4),
        ylim=(-0.9 if len(likely) == len(steps_of(model)) else -1.5, rows + 0.6),
    )
    ax.set_axis_off()


def steps_of(model):
    """Edges (from, to) of a model's graph; -1 is the start, and the number of states its end."""
    edges, states = set(model.segments()), len(model.means)
    return edges | {(int(visited[-1]), states) for visited in model.states}


def draw_step(ax, tail, head, colour, width, bent=False):
    """An arrow from one state of the graph to another, in an arc under those that it passes by."""
    look = {
        "arrowstyle": "-|>",
        "mutation_scale": 6,
        "linewidth": width,
        "color": colour,
        "shrinkA": 6 if tail[0] >= 0 else 11,
        "shrinkB": 7,
    }
    if bent:
        look["connectionstyle"] = f"arc3,rad={1.0 / (head[0] - tail[0]) ** 0.5:.3f}"
    ax.annotate("", head, tail, arrowprops=look, zorder=2)


def model_numbers(model):
    """How many states there are before merging, after it and on the path, and how far they spread."""
    return {
        "states_before": sum(len(sequence) for sequence in model.sequences),
        "states_after": len(model.means),
        "path_length": len(model.most_likely_path()),
        "spread_m": model.spread,
        "mean_sd_m": np.sqrt(np.trace(model.covariances, axis1=1, axis2=2) / 2).mean(),
    }


@panel("x4")
def figure_x4():
    """Beyond the paper: three demonstrations of a slalom, one with a detour, and their graph.

    As Figure 12a, but the graph has a branch. All three were walked past the same four cones; the
    last one went once round the third cone before it went on. (a) The detour has states of its own,
    which no other demonstration has. (b) In the graph the way forks there: the most-likely path,
    which is the task, passes those states by, for two of three went on at once.
    """
    task = detoured_task()
    figure, model = draw_learned(task), task.model
    aside = len(model.means) - len(model.most_likely_path())
    return figure, {
        "demonstrations": len(model.sequences),
        **model_numbers(model),
        "states_aside": aside,
    }


DETOUR_SEED = 1
"""Of the three walks of Fig. x4, and of the laser's noise."""


@cache
def detoured_task():
    """What is learned from three slaloms past the same cones, in the last once round one of them."""
    scene = lab.slalom_scene()
    rng = np.random.default_rng([DETOUR_SEED, 4])
    walks = [lab.slalom(scene, rng, **recordings.KEPT) for _ in range(2)]
    points = detoured_points(scene)
    points += rng.normal(0.0, 0.02, points.shape)
    walks.append(lab.walk(points, scene, rng, **recordings.KEPT))
    logs = [lab.record(scene, [DETOUR_SEED, 4, k], [walk]).log for k, walk in enumerate(walks)]
    seen = [observe(log, recordings.background_map()) for log in logs]
    return learn([Demonstration.of(each) for each in seen])


def detoured_points(scene, swing=0.75):
    """Via-points (K, 2) in m of a slalom that goes once round the third cone."""
    first, second, third, last = scene.positions
    up, along = np.array([0.0, swing]), np.array([swing, 0.0])
    passing = [first - (1.0, 0.0), first + up, second - up, third + up]
    return np.array(
        [
            *passing,
            third + along,
            third - up,
            third - along,
            third + up,
            last - up,
            last + (1.0, 0.0),
        ]
    )


@panel("12b", **COLUMNS)
def figure_12b():
    """The result after mapping the subgoals to a new environment.

    Nobody ever walked among these cones; the fan is the starts of ten runs, the same above and
    below. The law that they follow is dashed, over the runs; above, of every LDS alone, it has
    corners at its subgoals. Both times it is what two demonstrations together tell of which cone
    each of its places follows. Above the paper's kind of control: the plain law, which knows of no
    obstacle and comes as near to the cones as the law does. Below Dollop's own, which goes round
    what is near: between two cones it keeps to the middle and leaves the law. The largest corner is
    where the user turned as sharply. A circle, if there is one, is the robot where it first touches
    something.
    """
    task, runs_of = recordings.new_slalom_task(), by_kind(recordings.slalom_runs)
    figure, axes = plt.subplots(2, 1, figsize=(drawing.WIDTH, 3.45), sharex=True)
    for ax, (kind, runs) in zip(axes, runs_of.items(), strict=True):
        draw_runs(ax, task, runs, RESPONSES[kind])
        ax.set(xlim=(0.6, 8.4), ylim=(2.1, 5.0))
    axes[0].set_xlabel("")
    drawing.lettered(axes, TITLES.values())
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
