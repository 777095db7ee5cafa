"""Figures 8 to 10 and x1: matching environments, and the task in moved ones (Sec. IV)."""

from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import ConnectionPatch

from dollop import experiments, plot
from dollop.environment import spring_constants, spring_forces
from dollop.layouts import matching_shares
from dollop.matching import match

NEAR = 0.45  # m, how far a label stands off its corner in the drawing


def figure_8():
    """Eight corners on the left, matched to eight on the right: the paper's literal cost, and the robust matching."""
    before, after = experiments.figure_eight_task().environment, experiments.moved_environment(0)
    literal, robust = match(before, after, method="literal"), match(before, after)
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), sharex=True, sharey=True)
    figure.get_layout_engine().set(w_pad=0.1)
    for ax, environment, names in zip(axes, (before, after), ("12345678", ascii_lowercase[:8]), strict=True):
        plot.boxes(ax, environment.boxes)
        label_corners(ax, environment, names)
        plot.plane(ax)
    axes[0].set(xlim=(1.2, 7.8), ylim=(1.4, 5.4), title="as demonstrated")
    axes[1].set(title="now", ylabel="")
    for matching, line, colour in ((literal, "--", plot.OCCLUDED), (robust, "-", plot.LAW)):
        for a, b in enumerate(matching.indices):
            ends = before.corners[a], after.corners[b]
            figure.add_artist(
                ConnectionPatch(*ends, "data", "data", axesA=axes[0], axesB=axes[1], color=colour, ls=line)
            )
    styles = {"literal (the paper's cost)": (plot.OCCLUDED, "--"), "robust (the default)": (plot.LAW, "-")}
    lines = [plt.Line2D([], [], color=colour, ls=line, label=name) for name, (colour, line) in styles.items()]
    figure.legend(handles=lines, loc="outside lower center", ncols=2)
    return figure, {
        "indices": robust.indices.tolist(),
        "cost": robust.cost,
        "margin": robust.margin,
        "indices_literal": literal.indices.tolist(),
        "cost_literal": literal.cost,
        "margin_literal": literal.margin,
    }


def label_corners(ax, environment, names):
    """Write a name beside each corner, away from the middle of its box."""
    middles = np.repeat(environment.centres, 4, axis=0)
    for corner, middle, name in zip(environment.corners, middles, names, strict=True):
        away = corner + (corner - middle) * NEAR / np.linalg.norm(corner - middle)
        ax.text(*away, name, ha="center", va="center", fontsize=11)
    ax.plot(*environment.corners.T, "o", color=plot.SUBGOAL, markersize=4)


def figure_9():
    """The springs between eight corners, thick where they are strong, and the force on each corner."""
    environment = experiments.figure_eight_task().environment
    corners = environment.corners
    constants, forces = spring_constants(corners), spring_forces(corners)
    figure, axes = plt.subplots(1, 2, figsize=(11, 3.2), width_ratios=(2.2, 1))
    for ax in axes:
        for m in range(len(corners)):
            for n in range(m):
                width = 0.5 + 1.5 * np.log10(constants[m, n] / constants[constants > 0].min())
                ax.plot(*corners[[m, n]].T, color=plot.USER, linewidth=width, alpha=0.5, zorder=1)
        ax.quiver(*corners.T, *forces.T, color=plot.OBSTACLE, angles="xy", scale_units="xy", scale=110, zorder=5)
        plot.plane(ax)
    label_corners(axes[0], environment, "12345678")
    low, high = corners.min(axis=0) - 0.7, corners.max(axis=0) + 0.7
    axes[0].set(
        xlim=(low[0], high[0]), ylim=(low[1], high[1]), title="springs, wider where stronger, and forces (arrows)"
    )
    middle = environment.centres[environment.centres[:, 0].argmin()]
    axes[1].set(xlim=middle[0] + [-0.55, 0.55], ylim=middle[1] + [-0.55, 0.55], title="one box, enlarged")
    matching = match(environment, experiments.moved_environment(0), method="literal")
    return figure, {"indices": matching.indices.tolist(), "cost": matching.cost, "margin": matching.margin}


def figure_10a():
    """Moved obstacles, as the robot's laser sees them, and the subgoals that moved with them."""
    task, grid = experiments.figure_eight_task(), experiments.background_map()
    figure, axes = plt.subplots(1, len(experiments.LAYOUTS), figsize=(13, 4.5), sharey=True)
    right = []
    for k, ax in enumerate(axes):
        adapted = experiments.adapted_task(k)
        plot.workspace(grid, experiments.moved_scene(k).robot, adapted.environment.boxes, ax)
        plot.boxes(ax, task.environment.boxes, "obstacles before", "black", linestyle=":", linewidth=1)
        plot.path(ax, adapted.law.response(), "control law", plot.LAW, linewidth=2)
        ax.plot(*task.law.subgoals.T, "x", color=plot.TRUTH, markeredgewidth=2, label="subgoals before")
        plot.subgoals(ax, adapted.law.subgoals)
        right.append(experiments.matched_right(k))
    plot.legend_below(figure, axes[0])
    return figure, {"matching_right": int(sum(right)), "layouts": len(right)}


def figure_10b():
    """The robot performing the adapted task among the moved obstacles."""
    grid = experiments.background_map()
    figure, axes = plt.subplots(1, len(experiments.LAYOUTS), figsize=(13, 4.5), sharey=True)
    everything = []
    for k, ax in enumerate(axes):
        adapted, runs = experiments.adapted_task(k), experiments.moved_runs(k)
        plot.workspace(grid, None, adapted.environment.boxes, ax)
        plot.path(ax, adapted.law.response(), "control law", plot.LAW, linewidth=2)
        plot.runs(ax, runs)
        everything += runs
    plot.legend_below(figure, axes[0])
    return figure, {
        "matching_right": int(sum(experiments.matched_right(k) for k in range(len(axes)))),
        **experiments.counts(everything),
        "min_clearance_m": min(run.clearance.min() for run in everything),
    }


def figure_x1():
    """Beyond the paper: share of layouts with every corner matched right, against box noise and number of objects."""
    shares = matching_shares(noises=(0.0, 0.025, 0.05, 0.1, 0.15, 0.2), layouts=300, seed=experiments.SEED)
    figure, ax = plt.subplots(figsize=(6, 4))
    for (method, objects), rows in shares.groupby(["method", "objects"]):
        colour = plot.LAW if method == "robust" else plot.OBSTACLE
        marker = {2: "o", 3: "s", 4: "^"}[objects]
        ax.plot(rows.noise, rows.right, marker=marker, color=colour, label=f"{method}, {objects} objects")
    ax.set(xlabel="box sizes off by up to [m]", ylabel="share of layouts all right", ylim=(0, 1.03))
    ax.legend(ncols=2, loc="center right", bbox_to_anchor=(1.0, 0.68))
    known = shares[shares.noise == 0.05]
    by_laser = {kind: experiments.matchings_from_laser(kind) for kind in ("cans", "cones")}
    return figure, {f"{row.method}_{row.objects}": row.right for row in known.itertuples()} | {
        f"{method}_{kind}_seen": share for kind, found in by_laser.items() for method, share in found.items()
    }
