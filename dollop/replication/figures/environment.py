"""Figures 8 to 10 and x1: matching environments, and the task in moved ones (Sec. IV)."""

from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.patches import ConnectionPatch

from dollop import plot
from dollop.environment import spring_constants, spring_forces
from dollop.matching import match
from dollop.replication import drawing, recordings
from dollop.replication.figures.controls import (
    COLUMNS,
    RESPONSES,
    TITLES,
    at_once,
    by_kind,
    draw_distances,
    draw_runs,
    numbers,
)
from dollop.replication.figures.panel import panel
from dollop.replication.layouts import matching_shares

__all__ = []

NEAR = 5.0  # points that a corner's name stands off it
ROUND = 0.3  # m that are drawn round the boxes of Fig. 8
NOISES = 0.0, 0.025, 0.05, 0.1, 0.15, 0.2  # m, in figure x1
LAYOUTS = range(len(recordings.LAYOUTS))


@panel("8", robust="robust", literal="literal")
def figure_8():
    """The eight objects on the left must be matched to those on the right.

    Here the left ones are above, as demonstrated, and the right ones below, as they stand now: both
    where they are, to one scale. Lines join what is matched. The robust matching keeps each box
    together. Under the literal cost forces within one box outweigh those between boxes, so errors
    of a few centimetres in a box decide: its lines lie on the robust ones or cross between boxes as
    that comes, and its margin is a hair either way. Corners count from zero in the numbers: for 1
    to 8, in this order, which of a (0) to h (7) it goes to. The two costs have different units: the
    literal one is a change in force, the robust one minus the logarithm of the matching's
    probability. The margin says how far behind the second-best matching is; of the robust one by
    how many nats, 3 being a twentieth as probable.
    """
    before, after = recordings.figure_eights().task.environment, recordings.moved_environment(0)
    literal, robust = match(before, after, method="literal"), match(before, after)
    heights = [np.ptp(each.corners[:, 1]) + 2 * ROUND for each in (before, after)]
    size = {"figsize": (drawing.WIDTH, 2.9), "height_ratios": heights}  # so that both have one scale
    figure, axes = plt.subplots(2, 1, sharex=True, **size)
    figure.get_layout_engine().set(hspace=0.2)
    names = "12345678", ascii_lowercase[:8]
    for ax, environment, written in zip(axes, (before, after), names, strict=True):
        plot.plane(ax)
        plot.boxes(ax, environment.boxes, None if ax is axes[0] else "obstacles")
        label_corners(ax, environment, written)
        low, high = environment.corners[:, 1].min() - ROUND, environment.corners[:, 1].max() + ROUND
        ax.set(xlim=(1.8, 7.2), ylim=(low, high), yticks=np.arange(np.ceil(low), high))
    axes[0].set_xlabel("")
    drawing.lettered(axes, ("as demonstrated", "now"), "center")  # the lines are at the sides
    for method, matching, look in (
        ("robust", robust, {"linewidth": 2.2, "alpha": 0.6}),
        ("literal", literal, {"linewidth": 0.9, "linestyle": (0, (4, 3))}),
    ):
        label = {"literal": "literal (the paper's cost)", "robust": "robust (the default)"}[method]
        axes[0].plot([], [], color=drawing.METHODS[method], label=label, **look)
        for a, b in enumerate(matching.indices):
            ends = {
                "xyA": before.corners[a],
                "xyB": after.corners[b],
                "axesA": axes[0],
                "axesB": axes[1],
            }
            told = {"coordsA": "data", "coordsB": "data", "color": drawing.METHODS[method]}
            figure.add_artist(ConnectionPatch(**ends, **told, **look))
    drawing.legend_below(figure, *axes)
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


def label_corners(ax, environment, names):
    """A dot at each corner, and its name outside of its box."""
    aside = NEAR * outwards(environment)
    for place, name, away in zip(environment.corners, names, aside, strict=True):
        drawing.write(ax, name, place, away)
    ax.plot(*environment.corners.T, "o", color="black", markersize=2.5, zorder=6)


@panel("9", robust="robust", literal="literal")
def figure_9():
    """Intuitive representation of the spring optimisation.

    (a) Line width grows with the logarithm of the spring constant. (b) Arrows are the forces on one
    box: the short springs within it dwarf all others, and each force points into the box as if
    there were no second one. (c) What the other box alone adds, its arrows lengthened as often as
    the title says: all four nearly alike, to where that box is. This is why the literal matching
    hangs on the boxes' sizes. The numbers are those of Figure 8; the literal matching is what these
    springs lead to.
    """
    environment = recordings.figure_eights().task.environment
    corners = environment.corners
    size = {"figsize": (drawing.WIDTH, 2.75), "height_ratios": (1, 1.75)}
    figure, axes = plt.subplot_mosaic("aa;bc", **size)
    for ax in axes.values():
        draw_springs(ax, corners)
        plot.plane(ax)
    label_corners(axes["a"], environment, "12345678")
    low, high = corners.min(axis=0) - 0.4, corners.max(axis=0) + 0.4
    axes["a"].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    one = np.argsort(corners[:, 0].reshape(-1, 4).mean(axis=1))[0]
    mine = corners[4 * one : 4 * one + 4]
    near = spring_forces(mine)
    far = spring_forces(corners)[4 * one : 4 * one + 4] - near
    times = lengthened(near, far)
    for ax, forces in ((axes["b"], near + far), (axes["c"], times * far)):
        arrows = {"angles": "xy", "scale_units": "xy", "scale": 110, "width": 0.015}
        ax.quiver(*mine.T, *forces.T, color=drawing.FORCE, zorder=5, **arrows)
        middle = environment.centres[one]
        ax.set(xlim=middle[0] + [-0.3, 0.5], ylim=middle[1] + [-0.3, 0.3])
    axes["c"].set_ylabel("")
    titles = (
        "springs, wider where stronger",
        "all forces on one box",
        f"of the other box, × {times:g}",
    )
    drawing.lettered(axes.values(), titles)
    return figure, matching_numbers(environment, recordings.moved_environment(0))


def lengthened(near, far):
    """By how much to draw forces (C, 2) longer, to be seen beside others: a round number."""
    ratio = np.linalg.norm(near, axis=1).max() / np.linalg.norm(far, axis=1).max()
    size = 10 ** np.floor(np.log10(ratio))
    return float(np.floor(ratio / size) * size)


def draw_springs(ax, corners):
    """A line for every two corners; its width grows with the logarithm of the spring constant."""
    constants = spring_constants(corners)
    for m in range(len(corners)):
        for n in range(m):
            width = 0.3 + 0.9 * np.log10(constants[m, n] / constants[constants > 0].min())
            ax.plot(*corners[[m, n]].T, color=drawing.SPRING, linewidth=width, alpha=0.6, zorder=1)


@panel("10a")
def figure_10a():
    """Performing the task of Figure 6b in modified environments: the subgoals.

    Grey dotted boxes and grey crosses: before; solid boxes and black crosses, numbered in their
    order: now. The robot found the moved cans with its own laser. The figure-eight still goes round
    both.
    """
    task, grid = recordings.figure_eights().task, recordings.background_map()
    figure, axes = plt.subplots(len(LAYOUTS), 1, figsize=(drawing.WIDTH, 6.2), sharex=True)
    dotted = {"linestyle": ":", "linewidth": 1}
    grey = {
        "color": plot.BACKGROUND,
        "markeredgewidth": 1,
        "markersize": 4.5,
        "label": "subgoals before",
    }
    for k, ax in enumerate(axes):
        adapted = recordings.adapted_task(k)
        plot.workspace(grid, None, adapted.environment.boxes, ax)
        plot.boxes(ax, task.environment.boxes, "obstacles before", plot.BACKGROUND, **dotted)
        plot.law(ax, adapted.law.response(), drawing.RESPONSES["held"])
        ax.plot(*task.law.subgoals.T, "x", **grey)
        drawing.order(ax, adapted.law.start, adapted.law.subgoals)
    show_part(axes, (1.3, 5.5))
    drawing.lettered(axes, [f"layout {k + 1}" for k in LAYOUTS])
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
        ax.set(xlim=(0.6, 8.5), ylim=heights)
        ax.label_outer()


@panel("10b", **COLUMNS)
def figure_10b():
    """Performing the task of Figure 6b in modified environments: the robot's runs.

    Pink lines are runs of the simulated robot; the fan is their starts, each a little off. Left the
    paper's kind of control, right Dollop's own, from the same starts: it follows the law more
    closely, and leaves it only where it is near a can. The law that they follow is dashed, over the
    runs; under each map is how far off the runs are. Of every LDS alone it has corners at its
    subgoals. Clearance is from the robot's rim to the nearest obstacle.
    """
    runs_of = by_kind(runs_in_every_layout)
    heights = (1.6, 1) * len(LAYOUTS)
    figure, rows = plt.subplots(
        2 * len(LAYOUTS),
        2,
        figsize=(drawing.WIDTH, 5.7),
        sharey="row",
        gridspec_kw={"height_ratios": heights},
    )
    for column, (kind, runs) in zip(rows.T, runs_of.items(), strict=True):
        for k, (ax, below) in enumerate(column.reshape(-1, 2)):
            task = recordings.adapted_task(k)
            draw_runs(ax, task, runs[k], RESPONSES[kind])
            draw_distances(below, task.law, runs[k], RESPONSES[kind])
            show_part([ax], (1.2, 5.7))
            ax.set(xticks=(), yticks=(), xlabel="")
            ax.set_ylabel(f"layout {k + 1}" if kind == "plain" else "", labelpad=10)
            below.set_xlabel("distance along the way [m]" if k == LAYOUTS[-1] else "")
    for ax in rows[1::2, 1]:
        ax.set_ylabel("")
    drawing.lettered(rows[0], TITLES.values())
    drawing.legend_below(figure, *rows[::2].flat)
    return figure, adapting() | numbers({kind: sum(runs, []) for kind, runs in runs_of.items()})


def runs_in_every_layout(control, avoid):
    """Runs of the adapted task, a list for each layout."""
    return [recordings.moved_runs(k, control, avoid) for k in LAYOUTS]


@panel("x1", literal="literal", robust="robust")
def figure_x1():
    """Beyond the paper: how matching fares when box sizes are uncertain.

    (a) Objects drawn at random, each moved, and seen with box sizes off by up to so much; the
    numbers are at 5 cm, and beside the share right stands the mean probability that the robust
    matching tells. The literal cost loses its way as soon as boxes are not exact. (b) Cans and
    cones that the simulated laser sees, each layout matched to the first: a laser sees one side of
    a can and is off by some centimetres.
    """
    shares = pd.concat(at_once(shares_of, [(noise,) for noise in NOISES]))
    seen = at_once(recordings.matchings_from_laser, [("cans",), ("cones",)])
    size = {"figsize": (drawing.WIDTH, 2.7), "width_ratios": (1.9, 1)}
    figure, axes = plt.subplots(1, 2, sharey=True, **size)
    draw_shares_by_noise(axes[0], shares)
    draw_shares_seen(axes[1], dict(zip(("2 cans", "4 cones"), seen, strict=True)))
    drawing.lettered(axes, ("random boxes", "boxes seen"))
    drawing.legend_below(figure, axes[0], columns=2)
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
        look["linestyle"] = "--" if method == "literal" else "-"
        ax.plot(rows.noise, rows.right, label=f"{method}, {objects} objects", **look)
    ax.set(xlabel="box sizes off by up to [m]", ylabel="share of layouts all right", ylim=(0, 1.1))


def draw_shares_seen(ax, by_laser):
    """Bars: the share of layouts all right, by what the laser saw and by method."""
    for k, method in enumerate(("literal", "robust")):
        found = [share[method] for share in by_laser.values()]
        look = {
            "color": drawing.METHODS[method],
            "hatch": "////" * (method == "literal"),
            "edgecolor": "white",
        }
        bars = ax.bar(np.arange(2) + 0.4 * k, found, 0.38, linewidth=0, **look)
        ax.bar_label(bars, fmt="%.2f", fontsize=6.2)
    ax.set_xticks(np.arange(2) + 0.2, by_laser)
