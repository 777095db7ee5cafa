"""Figures 8 to 10 and x1: matching environments, and the task in moved ones (Sec. IV)."""

from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dollop import plot
from dollop.environment import Environment, spring_constants, spring_forces
from dollop.matching import match
from dollop.replication import drawing, recordings
from dollop.replication.figures.controls import (
    COLUMNS,
    CONTROLS,
    RESPONSES,
    at_once,
    by_kind,
    draw_runs,
    numbers,
)
from dollop.replication.figures.panel import panel
from dollop.replication.layouts import matching_shares

__all__ = []

NEAR = 0.11  # m, how far a label stands off its corner in the drawing
ASIDE = 1.0, -2.2  # m, by which Fig. 8 draws the boxes of now aside, so that lines lie apart
WIDE = 10  # inches, figures of three panels
NOISES = 0.0, 0.025, 0.05, 0.1, 0.15, 0.2  # m, in figure x1
LAYOUTS = range(len(recordings.LAYOUTS))


@panel("8", robust="robust", literal="literal")
def figure_8():
    """The eight objects on the left must be matched to those on the right.

    Here the left ones are above and the right ones below, drawn aside so that every line can be
    told apart. The robust matching keeps each box together. Under the literal cost forces within
    one box outweigh those between boxes, so errors of a few centimetres in a box decide: its lines
    lie on the robust ones or cross between boxes as that comes, and its margin is a hair either
    way. Corners count from zero in the numbers: for 1 to 8, in this order, which of a (0) to h (7)
    it goes to. The two costs have different units: the literal one is a change in force, the robust
    one minus the logarithm of the matching's probability. The margin says how far behind the
    second-best matching is; of the robust one by how many nats, 3 being a twentieth as probable.
    """
    before, after = recordings.figure_eights().task.environment, recordings.moved_environment(0)
    literal, robust = match(before, after, method="literal"), match(before, after)
    aside = Environment(after.boxes + np.tile(ASIDE, 2))
    figure, ax = plt.subplots(figsize=(8, 5.4))
    for method, matching, look in (
        ("robust", robust, {"linewidth": 2.5, "alpha": 0.7}),
        ("literal", literal, {"linewidth": 1.5, "linestyle": (0, (4, 3))}),
    ):
        label = {"literal": "literal (the paper's cost)", "robust": "robust (the default)"}[method]
        for a, b in enumerate(matching.indices):
            ends = before.corners[a], aside.corners[b]
            plot.path(ax, ends, None if a else label, drawing.METHODS[method], **look)
    for environment, names, up, words in (  # names stand a little up or down, clear of the lines
        (before, "12345678", (-0.05, 0.04, 0.04, 0.05), "as demonstrated"),
        (aside, ascii_lowercase[:8], (-0.05, -0.04, -0.04, 0.03), "now"),
    ):
        plot.boxes(ax, environment.boxes)
        away = np.column_stack([NEAR * outwards(environment)[:, 0], np.tile(up, 2)])
        label_corners(ax, environment, names, away)
        ax.text(*environment.centres.mean(axis=0), words, ha="center", fontsize=11, style="italic")
    ax.plot([2.2, 3.2], [0.6, 0.6], "|-", color="black", linewidth=1)
    ax.text(2.7, 0.65, "1 m", ha="center", va="bottom")
    ax.set_aspect("equal")
    ax.set_axis_off()
    drawing.legend_below(figure, ax)
    return figure, matching_numbers(before, after)


def matching_numbers(before, after):
    """Corners, cost and margin of the default matching, and of the paper's literal one."""
    found = {"": match(before, after), "literal_": match(before, after, method="literal")}
    measured = {f"{kind}indices": matching.indices.tolist() for kind, matching in found.items()}
    measured |= {f"{kind}cost": matching.cost for kind, matching in found.items()}
    measured |= {f"{kind}margin": matching.margin for kind, matching in found.items()}
    return measured | {"robust_probability": found[""].probability}


def outwards(environment):
    """For each corner (4N, 2) which way along x and y leads out of its box: +1 or -1."""
    return np.sign(environment.corner_offsets)


def label_corners(ax, environment, names, away):
    """A dot at each corner, and its name `away` (4N, 2) from it, in m."""
    look = {"ha": "center", "va": "center", "fontsize": 11, "path_effects": [plot.HALO]}
    for place, name in zip(environment.corners + away, names, strict=True):
        ax.text(*place, name, zorder=7, **look)
    ax.plot(*environment.corners.T, "o", color="black", markersize=4, zorder=6)


@panel("9", robust="robust", literal="literal")
def figure_9():
    """Intuitive representation of the spring optimisation.

    Line width grows with the logarithm of the spring constant; arrows are forces. The short springs
    within a box dwarf all others, and each force points into its own box as if there were no second
    one: this is why the literal matching hangs on the boxes' sizes. The numbers are those of Figure
    8; the literal matching is what these springs lead to.
    """
    environment = recordings.figure_eights().task.environment
    corners = environment.corners
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.2), width_ratios=(3, 1))
    for ax in (left, right):
        draw_springs(ax, corners)
        plot.plane(ax)
    label_corners(left, environment, "12345678", NEAR * outwards(environment))
    low, high = corners.min(axis=0) - 0.35, corners.max(axis=0) + 0.35
    left.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), title="springs, wider where stronger")
    arrows = {"angles": "xy", "scale_units": "xy", "scale": 110, "width": 0.015}
    right.quiver(*corners.T, *spring_forces(corners).T, color=drawing.FORCE, zorder=5, **arrows)
    middle = environment.centres[environment.centres[:, 0].argmin()]
    right.set(xlim=middle[0] + [-0.3, 0.3], ylim=middle[1] + [-0.3, 0.3])
    right.set(title="one box, with the forces", ylabel="")
    return figure, matching_numbers(environment, recordings.moved_environment(0))


def draw_springs(ax, corners):
    """A line for every two corners; its width grows with the logarithm of the spring constant."""
    constants = spring_constants(corners)
    for m in range(len(corners)):
        for n in range(m):
            width = 0.5 + 1.5 * np.log10(constants[m, n] / constants[constants > 0].min())
            ax.plot(*corners[[m, n]].T, color=drawing.SPRING, linewidth=width, alpha=0.6, zorder=1)


@panel("10a")
def figure_10a():
    """Performing the task of Figure 6b in modified environments: the subgoals.

    Grey dotted boxes and grey crosses: before; solid boxes and black crosses: now. The robot found
    the moved cans with its own laser. The figure-eight still goes round both.
    """
    task, grid = recordings.figure_eights().task, recordings.background_map()
    figure, axes = plt.subplots(1, len(LAYOUTS), figsize=(WIDE, 3), sharey=True)
    dotted = {"linestyle": ":", "linewidth": 1.5}
    grey = {"color": plot.BACKGROUND, "markeredgewidth": 1.5, "label": "subgoals before"}
    for k, ax in enumerate(axes):
        adapted, robot = recordings.adapted_task(k), recordings.moved_scene(k).robot.pose
        plot.workspace(grid, robot, adapted.environment.boxes, ax, f"layout {k + 1}")
        plot.boxes(ax, task.environment.boxes, "obstacles before", plot.BACKGROUND, **dotted)
        plot.law(ax, adapted.law.response())
        ax.plot(*task.law.subgoals.T, "x", **grey)
        plot.subgoals(ax, adapted.law.subgoals)
    show_part(axes, (0.2, 5.3))
    drawing.legend_below(figure, axes[0])
    return figure, {"layouts": len(axes)} | adapting()


def adapting():
    """In how many layouts the matching is right, and the largest corner of the adapted laws."""
    corner = max(recordings.largest_corner(recordings.adapted_task(k).law) for k in LAYOUTS)
    right = sum(recordings.matched_right(k) for k in LAYOUTS)
    return {"matching_right": right, "largest_corner_deg": np.degrees(corner)}


def show_part(axes, heights):
    """The middle of the laboratory, between two heights y in m: beyond, every layout is blank."""
    for ax in axes:
        ax.set(xlim=(0.6, 8.6), ylim=heights)
        ax.label_outer()


@panel("10b", **COLUMNS)
def figure_10b():
    """Performing the task of Figure 6b in modified environments: the robot's runs.

    Pink lines are runs of the simulated robot; the fan is their starts, each a little off. Above
    the paper's kind of control, below Dollop's own, from the same starts: it follows the law more
    closely, and leaves it only where it is near a can. Clearance is from the robot's rim to the
    nearest obstacle.
    """
    figure, rows = plt.subplots(2, len(LAYOUTS), figsize=(WIDE, 4.9), sharex=True, sharey=True)
    runs_of = by_kind(runs_in_every_layout)
    for axes, (kind, (title, _)) in zip(rows, CONTROLS.items(), strict=True):
        for k, ax in enumerate(axes):
            task, runs = recordings.adapted_task(k), runs_of[kind][k]
            draw_runs(ax, task, runs, f"layout {k + 1}", RESPONSES[kind])
        axes[1].set_title(f"{title}\nlayout 2")
    show_part(rows.flat, (1.3, 5.3))
    drawing.legend_below(figure, *rows.flat)
    return figure, adapting() | numbers({kind: sum(runs, []) for kind, runs in runs_of.items()})


def runs_in_every_layout(control, avoid):
    """Runs of the adapted task, a list for each layout."""
    return [recordings.moved_runs(k, control, avoid) for k in LAYOUTS]


@panel("x1", literal="literal", robust="robust")
def figure_x1():
    """Beyond the paper: how matching fares when box sizes are uncertain.

    Left, objects drawn at random, each moved, and seen with box sizes off by up to so much; the
    numbers are at 5 cm, and beside the share right stands the mean probability that the robust
    matching tells. The literal cost loses its way as soon as boxes are not exact. Right, cans
    and cones that the simulated laser sees, each layout matched to the first: a laser sees one side
    of a can and is off by some centimetres.
    """
    shares = pd.concat(at_once(shares_of, [(noise,) for noise in NOISES]))
    seen = at_once(recordings.matchings_from_laser, [("cans",), ("cones",)])
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), width_ratios=(2, 1), sharey=True)
    draw_shares_by_noise(left, shares)
    draw_shares_seen(right, dict(zip(("2 cans", "4 cones"), seen, strict=True)))
    known = shares[shares.noise == 0.05]
    measured = {f"{row.method}_{row.objects}_objects": row.right for row in known.itertuples()}
    for row in known[known.method == "robust"].itertuples():
        measured[f"robust_{row.objects}_objects_told"] = row.probability
    for kind, share in zip(("cans", "cones"), seen, strict=True):
        measured |= {f"{method}_{kind}_seen": right for method, right in share.items()}
    return figure, measured


def shares_of(noise):
    """How often corners are matched right at one noise in m."""
    return matching_shares(noises=(noise,), layouts=300, seed=recordings.SEED)


def draw_shares_by_noise(ax, shares):
    """Share of random layouts all right by the noise of boxes, a line per method and number."""
    for (method, objects), rows in shares.groupby(["method", "objects"]):
        look = {"color": drawing.METHODS[method], "marker": {2: "o", 3: "s", 4: "^"}[objects]}
        ax.plot(rows.noise, rows.right, label=f"{method}, {objects} objects", **look)
    ax.set(xlabel="box sizes off by up to [m]", ylabel="share of layouts all right", ylim=(0, 1.08))
    ax.set_title("random boxes")
    ax.legend(ncols=2, loc="center right", bbox_to_anchor=(1.0, 0.68))


def draw_shares_seen(ax, by_laser):
    """Bars: the share of layouts all right, by what the laser saw and by method."""
    for k, method in enumerate(("literal", "robust")):
        found = [share[method] for share in by_laser.values()]
        bars = ax.bar(np.arange(2) + 0.4 * k, found, 0.38, color=drawing.METHODS[method], label=method)
        ax.bar_label(bars, fmt="%.2f")
    ax.set_xticks(np.arange(2) + 0.2, by_laser)
    ax.set_title("boxes as the laser sees them")
