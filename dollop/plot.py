"""The drawing vocabulary: one colour per meaning, the plane in metres, used by figures and
notebooks alike.

What is in the room has colours of Okabe and Ito's palette, what is compared in graphs has those of
Tol's: colour-blind readers can tell them apart. Red boxes, green law and yellow robot are also the
paper's. Black is for what is neutral: subgoals, corners, readings, writing.
"""

from contextlib import contextmanager
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Ellipse, Rectangle
from matplotlib.patheffects import withStroke

USER = "#0072B2"  # blue: the user's track
OBSTACLE = "#D55E00"  # vermilion: boxes of foreground objects
ROBOT = "#F0E442"  # yellow: the robot
LAW = "#009E73"  # green: the control law and its response
SUBGOAL = "#000000"
MOST_LIKELY = "#B0003A"  # crimson: the most-likely path of a CDHMM, red in the paper
RUN = "#CC79A7"  # purple: where the robot went
OCCLUDED = "#E69F00"  # orange: predictions while the user is occluded
BACKGROUND = "#8C8C8C"  # grey: the background map, and how things were before
TRUTH = "#56B4E9"  # light blue: where the user or an object really was
RAY = "#C3CED6"  # pale grey: the laser's rays

RUN_SHADES = ("#CC79A7", "#7A3B62", "#E3A9C8", "#A6437C", "#4F2340")
RUN_LINES = ("-", (0, (7, 1.5)), (0, (5, 1.2, 1, 1.2)), (0, (3, 1)), (0, (9, 1.5, 1, 1.5, 1, 1.5)))
"""Shades of RUN and dashes by which a few runs are told apart."""

HEADS_AT = 0.18, 0.65
"""Where along a law its arrowheads are, as shares of its length: away from the crossing of a
figure-eight.
"""

HALO = withStroke(linewidth=2.5, foreground="white")
"""Keeps writing legible where it lies over lines."""

RIM = 0.25  # m, radius of the robot drawn as a circle

STYLE = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "figure.constrained_layout.use": True,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


@contextmanager
def style():
    """House style for everything drawn inside the `with` block."""
    with plt.rc_context(STYLE):
        yield


def plane(ax=None, title=None):
    """Axes for the plane: metres, equal aspect."""
    ax = ax or plt.gca()
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    if title:
        ax.set_title(title)
    return ax


def grid_map(ax, grid, colour=BACKGROUND):
    """Occupied cells of an OccupancyGrid."""
    rows, columns = grid.occupancy.shape
    x, y = grid.origin[:2]
    extent = (x, x + columns * grid.resolution, y, y + rows * grid.resolution)
    image = np.ma.masked_where(~grid.occupied, np.ones(grid.occupancy.shape))
    ax.imshow(image, origin="lower", extent=extent, cmap=plt.matplotlib.colors.ListedColormap([colour]))


def boxes(ax, boxes, label=None, colour=OBSTACLE, **kwargs):
    """Boxes (N, 4): xmin, ymin, xmax, ymax in m."""
    kwargs = {"fill": False, "edgecolor": colour, "linewidth": 2} | kwargs
    for k, (x0, y0, x1, y1) in enumerate(boxes):
        ax.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, label=label if k == 0 else None, **kwargs))


def robot(ax, pose, radius=RIM, label=None):
    """The robot at pose (x, y, theta): a yellow circle with its heading."""
    x, y, theta = pose
    ax.add_patch(Circle((x, y), radius, facecolor=ROBOT, edgecolor="black", zorder=4))
    ax.plot([], [], "o", color=ROBOT, markeredgecolor="black", markersize=10, label=label)
    ax.plot([x, x + radius * np.cos(theta)], [y, y + radius * np.sin(theta)], color="black", zorder=5)


def path(ax, positions, label=None, colour=USER, **kwargs):
    """A path (N, 2) in m."""
    kwargs = {"linewidth": 1} | kwargs
    ax.plot(*np.asarray(positions).T[:2], color=colour, label=label, **kwargs)


def law(ax, response, label="control law", **kwargs):
    """The response (N, 2) of a control law, and on its way two arrowheads that say which way it is
    walked.
    """
    response = np.asarray(response)
    kwargs = {"linewidth": 2, "colour": LAW} | kwargs
    path(ax, response, label, **kwargs)
    walked = np.append(0, np.hypot(*np.diff(response, axis=0).T).cumsum())
    for share in HEADS_AT:
        k = np.searchsorted(walked, share * walked[-1]).clip(1, len(response) - 1)
        head = {"arrowstyle": "-|>", "mutation_scale": 18, "color": kwargs["colour"], "linewidth": 0}
        ax.annotate("", response[k], response[k - 1], arrowprops=head | {"shrinkA": 0, "shrinkB": 0}, zorder=5)


def subgoals(ax, subgoals, label="subgoals"):
    """Crosses at the subgoals (K, 2)."""
    ax.plot(*np.asarray(subgoals).T, "x", color=SUBGOAL, markersize=9, markeredgewidth=2.5, zorder=6, label=label)


def scan(ax, log, i, label="laser scan"):
    """Scan i of a LaserLog in the world: rays, and points where something came back."""
    x, y, theta = log.poses[i]
    back = np.isfinite(log.ranges[i])
    reach = np.where(back, log.ranges[i], log.max_range)
    ends = np.column_stack([x + reach * np.cos(theta + log.angles), y + reach * np.sin(theta + log.angles)])
    ax.plot(
        *np.stack([np.broadcast_to([x, y], ends.shape), ends], axis=1)[back].transpose(2, 1, 0),
        color=RAY,
        linewidth=0.5,
    )
    ax.plot(*ends[back].T, ".", color="black", markersize=3, label=label)


def workspace(grid, pose=None, obstacles=(), ax=None, title=None):
    """Axes for the plane with the background map, and where given the watching robot and the
    obstacles' boxes.
    """
    ax = plane(ax, title)
    grid_map(ax, grid)
    boxes(ax, obstacles, "obstacles")
    if pose is not None:
        robot(ax, pose, label="robot")
    return ax


def cells(ax, values, grid, **kwargs):
    """Values (H, W) of the cells of `grid` as an image; cells that are zero stay blank."""
    image = np.ma.masked_equal(values.reshape(grid.occupancy.shape), 0)
    return ax.imshow(image, origin="lower", extent=grid.extent, **({"cmap": "Blues"} | kwargs))


def legend(ax):
    """A legend in one row under the axes, where it hides nothing."""
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=5, columnspacing=1.0)


def track(ax, track, label="track", **kwargs):
    """A Track's positions, dotted where it was occluded."""
    path(ax, track.positions, label, **kwargs)
    ax.plot(*track.positions[track.occluded].T, ".", color=OCCLUDED, markersize=4, zorder=3, label="occluded")


def runs(ax, runs):
    """Where the robot went: one line per Run.

    Kidnapped runs have a look and a number each; the kidnapping is a dotted leap to a numbered dot.
    A circle is the rim of the robot where a run first touched something.
    """
    apart = any(len(run.kidnapped) for run in runs)
    for k, run in enumerate(runs):
        look = {"linewidth": 0.9, "alpha": 0.8, "colour": RUN}
        if apart:
            look = {"linewidth": 1.2, "colour": RUN_SHADES[k % 5], "linestyle": RUN_LINES[k % 5]}
        leaps = np.searchsorted(run.t, run.kidnapped - 0.5 * run.t[1])
        for n, part in enumerate(np.split(run.true_poses[:, :2], leaps)):
            path(ax, part, "robot's runs" if k == n == 0 else None, **look)
        for leap in leaps:
            path(ax, run.true_poses[leap - 1 : leap + 1], "kidnapped" if k == 0 else None, "black", linestyle=":")
            place = run.true_poses[leap, :2]
            ax.plot(*place, "o", color="black", markersize=4, zorder=6)
            written = {"textcoords": "offset points", "ha": "center", "va": "center", "path_effects": [HALO]}
            ax.annotate(str(k + 1), place, xytext=(0, 9), weight="bold", zorder=8, **written)
    hit = [run for run in runs if run.collisions]
    for run in hit:
        ax.add_patch(Circle(first_contact(run), RIM, fill=False, edgecolor="black", linewidth=0.8, zorder=7))
    if hit:
        look = {"color": "black", "markersize": 10, "fillstyle": "none", "markeredgewidth": 0.8}
        ax.plot([], [], "o", label="first contact, robot's rim", **look)


def first_contact(run):
    """Where (2,) a Run that touched something was when its rim, taken as a circle, first met an
    obstacle.
    """
    met = np.flatnonzero(run.clearance < 0)
    return run.true_poses[met[0] if len(met) else run.clearance.argmin(), :2]


def cdhmm(ax, model, sd=2.0):
    """A SubgoalHMM in the plane: its states, the steps between them, and the most-likely path in
    red.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    model : SubgoalHMM
        Its states as dots at their means, with their numbers and covariances; its start and its
        end, which have no place, as words beside the states that the most-likely path begins and
        ends in.
    sd : float
        How many standard deviations each state's ellipse reaches.
    """
    way = model.most_likely_path().tolist()
    path_steps = set(pairwise(way))
    steps = np.argwhere(model.transitions > 0).tolist()
    if any((u, v) not in path_steps for u, v in steps):
        ax.plot([], [], color=BACKGROUND, label="other steps")
    ax.plot([], [], color=MOST_LIKELY, label="most-likely path")
    for u, v in steps:
        colour = MOST_LIKELY if (u, v) in path_steps else BACKGROUND
        step(ax, model.means[u], model.means[v], 0.5 + 2.0 * model.transitions[u, v], colour)
    for state, (mean, covariance) in enumerate(zip(model.means, model.covariances, strict=True)):
        label = f"states, {sd:g} sd" if state == 0 else None
        ellipse(ax, mean, covariance, sd, label=label)
        written = {"textcoords": "offset points", "zorder": 8, "path_effects": [HALO]}
        ax.annotate(str(state), mean, xytext=(6, 6), **written)
        if state == way[0]:
            ax.annotate("start", mean, xytext=(-8, 0), ha="right", va="center", style="italic", **written)
        if state == way[-1]:
            ax.annotate("end", mean, xytext=(14, -6), va="center", style="italic", **written)
    ax.plot(*model.means.T, ".", color=SUBGOAL, markersize=6, zorder=7)


def step(ax, tail, head, width, colour):
    """An arrow from one place to another, `width` in points."""
    drawn = {"arrowstyle": "-|>", "linewidth": width, "color": colour, "shrinkA": 0, "shrinkB": 2}
    ax.annotate("", head, tail, arrowprops=drawn, zorder=5)


def ellipse(ax, mean, covariance, sd=2.0, colour=SUBGOAL, label=None):
    """Where a normal distribution of this mean (2,) and covariance (2, 2) reaches `sd` standard
    deviations.
    """
    variances, axes = np.linalg.eigh(covariance)
    width, height = 2 * sd * np.sqrt(variances)
    angle = np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))
    look = {"facecolor": colour, "edgecolor": colour, "alpha": 0.15, "zorder": 3}
    ax.add_patch(Ellipse(mean, width, height, angle=angle, label=label, **look))
