"""The drawing vocabulary: one colour per meaning, and the plane in metres.

What is in the room has colours of Okabe and Ito's palette, what is compared in graphs has those of
Tol's: colour-blind readers can tell them apart. Green law and yellow robot are also the paper's,
whose red boxes are vermilion here. Black is for what is neutral: subgoals, corners, readings,
writing.

Everything is drawn into axes that are given; a label goes into their legend once. Lines and markers
are so many points wide under matplotlib's own `lines.linewidth`, and thinner or wider with it.
"""

from io import BytesIO
from itertools import pairwise
from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Polygon, Rectangle
from matplotlib.patheffects import withStroke

from dollop.checks import checked_array, checked_number, checked_positions, checked_whole
from dollop.environment import checked_boxes
from dollop.foreground import endpoints
from dollop.trajectory import arc_length

USER = "#0072B2"  # blue: the user's track
OBSTACLE = "#D55E00"  # vermilion: boxes of foreground objects
LAW = "#009E73"  # green: the control law and its response
SUBGOAL = "#000000"
RUN = "#CC79A7"  # pink: where the robot went
OCCLUDED = "#E69F00"  # orange: predictions while the user is occluded
_WAIT = "#8A5A00"  # dark orange: times that are written beside a wait
BACKGROUND = "#8C8C8C"  # grey: the background map, and how things were before
TRUTH = "#56B4E9"  # light blue: where the user or an object really was
ROBOT = "#F0E442"  # yellow
MOST_LIKELY = "#B0003A"  # crimson: a CDHMM's most-likely path, red in the paper; first contacts
LATER = LinearSegmentedColormap.from_list("later", ["#9ECAE9", "#08306B"])  # blue, darker with time
_FLOOR = "#E8E8E8"  # palest grey: free floor of a map
_RAY = "#C3CED6"  # pale grey: the laser's rays

_RUN_SHADES = ("#CC79A7", "#7A3B62", "#E3A9C8", "#A6437C", "#4F2340")
_RUN_LINES = ("-", (0, (7, 1.5)), (0, (5, 1.2, 1, 1.2)), (0, (3, 1)), (0, (9, 1.5, 1, 1.5, 1, 1.5)))
"""Shades of RUN and dashes by which a few runs are told apart."""

_HEADS_AT = 0.18, 0.65
"""Where along a law its arrowheads are, as shares of its length: not where an eight crosses."""

_RIM = 0.25
"""Radius in m of the robot, drawn as a circle."""

HALO = withStroke(linewidth=2.5, foreground="white")
"""Keeps writing legible where it lies over lines."""

_LINE = 1.5
"""matplotlib's own `lines.linewidth`, in points."""

STYLE = {
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "figure.constrained_layout.use": True,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
"""House style, as matplotlib's settings."""


def style():
    """House style for everything that is drawn inside a `with` block.

    Returns
    -------
    context manager
    """
    return plt.rc_context(STYLE)


def _pt(points):
    """So many points, more or fewer where a style's lines are wider or thinner than matplotlib's."""
    return points * plt.rcParams["lines.linewidth"] / _LINE


def plane(ax=None, title=None):
    """Axes for the plane: in metres, with equal aspect.

    Parameters
    ----------
    ax : matplotlib.axes.Axes, optional
        The current ones by default.
    title : str, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.gca()
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    if title:
        ax.set_title(title)
    return ax


def workspace(grid, pose=None, obstacles=(), ax=None, title=None):
    """Axes for the plane with the background map, the watching robot and the obstacles' boxes.

    Parameters
    ----------
    grid : OccupancyGrid
    pose : (3,) sequence of float, optional
        Of the robot: x, y in m, theta in rad.
    obstacles : (N, 4) array_like
        xmin, ymin, xmax, ymax in m.
    ax : matplotlib.axes.Axes, optional
        The current ones by default.
    title : str, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = plane(ax, title)
    grid_map(ax, grid)
    boxes(ax, obstacles, "obstacles")
    if pose is not None:
        robot(ax, pose, label="robot")
    return ax


def legend(ax):
    """A legend in rows under the axes, where it hides nothing.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    """
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=5, columnspacing=1.0)


def grid_map(ax, grid, colour=BACKGROUND):
    """The occupied cells of a map.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    grid : OccupancyGrid
    colour : str
    """
    cells(ax, grid.occupied.astype(float), grid, cmap=ListedColormap([colour]))


def whole_map(ax, grid):
    """A map: its occupied cells, and pale its free floor; what is unknown stays blank.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    grid : OccupancyGrid
    """
    cells(ax, grid.free.astype(float), grid, cmap=ListedColormap([_FLOOR]))
    grid_map(ax, grid)
    for colour, name in ((BACKGROUND, "occupied"), (_FLOOR, "free")):
        ax.plot([], [], "s", color=colour, label=name)


def cells(ax, values, grid, **look):
    """The values of a map's cells as an image; cells that are zero stay blank.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    values : (H, W) or (H W,) array
    grid : OccupancyGrid
        Where the cells lie.
    **look
        Options of `Axes.imshow`.

    Returns
    -------
    matplotlib.image.AxesImage
    """
    image = np.ma.masked_equal(values.reshape(grid.occupancy.shape), 0)
    return ax.imshow(image, origin="lower", extent=grid.extent, **({"cmap": "Blues"} | look))


def boxes(ax, boxes, label=None, colour=OBSTACLE, **look):
    """Boxes of objects.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    boxes : (N, 4) array_like
        xmin, ymin, xmax, ymax in m.
    label : str, optional
    colour : str
    **look
        Options of `matplotlib.patches.Rectangle`.
    """
    look = {"fill": False, "edgecolor": colour, "linewidth": _pt(2), "label": label} | look
    for x0, y0, x1, y1 in checked_boxes(boxes):
        ax.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, **look))
        look["label"] = None


def robot(ax, pose, radius=_RIM, label=None):
    """The robot as a circle with its heading.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    radius : float
        In m.
    label : str, optional
    """
    (x, y, theta), radius = checked_positions("pose", pose, 3), checked_number("radius", radius, 0)
    edge = {"linewidth": _pt(1), "zorder": 4}
    ax.add_patch(Circle((x, y), radius, facecolor=ROBOT, edgecolor="black", **edge))
    look = {"color": ROBOT, "markeredgecolor": "black", "markeredgewidth": _pt(1)}
    ax.plot([], [], "o", markersize=_pt(10), label=label, **look)
    ahead = [x, x + radius * np.cos(theta)], [y, y + radius * np.sin(theta)]
    ax.plot(*ahead, color="black", zorder=5)


def scene(ax, scene, walks=()):
    """What stands in a scene of the laboratory, who walks where, and the robot that watches.

    Furniture that the laser does not meet, above or below it, is pale.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    scene : dollop.lab.Scene
    walks : sequence of dollop.lab.Walk
        Of its people, as `dollop.lab.walks_of` has them; the first is the user's.
    """
    height = scene.robot.beam_height
    ax.add_patch(Polygon(scene.room.corners, fill=False, edgecolor=BACKGROUND, linewidth=2))
    for part in scene.room.furniture:
        shade = 1.0 if part.reaches(height) else 0.25
        ax.add_patch(Polygon(part.outline.border, facecolor=BACKGROUND, alpha=shade))
    label = "objects"
    for each in scene.objects:
        ax.add_patch(Polygon(each.footprint.border, fill=False, edgecolor=OBSTACLE, linewidth=1, linestyle=":"))
        met = each.outline(height)
        if met is not None:
            ax.add_patch(Polygon(met.border, fill=False, edgecolor=OBSTACLE, linewidth=2, label=label))
            label = None
    for move in scene.moves:
        arrow = {"color": OBSTACLE, "arrowstyle": "->"}
        ax.annotate("", move.to, scene.objects[move.object].position, arrowprops=arrow)
    for k, each in enumerate(walks):
        colour, name = (TRUTH, "user, in truth") if k == 0 else (BACKGROUND, "somebody else" if k == 1 else None)
        path(ax, each.positions, name, colour)
        ax.plot(*each.positions[0], "o", color=colour, markersize=4)
    robot(ax, scene.robot.pose, scene.robot.radius, "robot")
    if scene.robot.way:
        path(ax, [scene.robot.pose[:2], *scene.robot.way], None, "black", linestyle="--")
    ax.autoscale_view()


def scan(ax, log, i, label="laser scan"):
    """A laser scan in the world: a ray and a point where something came back.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    log : LaserLog
    i : int
        Which of its scans.
    label : str, optional
    """
    i = checked_whole("i, of the scans,", i, -len(log), len(log) - 1)
    x, y, _ = log.poses[i]
    xs, ys = endpoints(log)[i, np.isfinite(log.ranges[i])].T
    rays = np.stack([np.full_like(xs, x), xs]), np.stack([np.full_like(ys, y), ys])
    ax.plot(*rays, color=_RAY, linewidth=_pt(0.5))
    ax.plot(xs, ys, ".", color="black", markersize=_pt(3), label=label)


def path(ax, positions, label=None, colour=USER, **look):
    """A path in the plane.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    positions : (N, 2) or (N, 3) array_like
        In m; a third column, the heading of poses, is not drawn.
    label : str, optional
    colour : str
    **look
        Options of `Axes.plot`.
    """
    positions = checked_array("positions", positions, "N", "d", finite=False)
    if positions.shape[1] not in (2, 3):
        raise ValueError(f"positions must be of 2 or 3 columns, got {positions.shape[1]}")
    ax.plot(*positions.T[:2], color=colour, label=label, **({"linewidth": _pt(1)} | look))


def track(ax, track, label="track", **look):
    """The positions of a track, dotted where it was occluded.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    track : Track
    label : str, optional
    **look
        Options of `path`.
    """
    path(ax, track.positions, label, **look)
    dots = {"color": OCCLUDED, "markersize": _pt(4), "zorder": 3, "label": "occluded"}
    ax.plot(*track.positions[track.occluded].T, ".", **dots)


def subgoals(ax, subgoals, label="subgoals"):
    """Subgoals as crosses.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    subgoals : (K, 2) array_like
        In m.
    label : str, optional
    """
    look = {"color": SUBGOAL, "markersize": _pt(9), "markeredgewidth": _pt(2.5), "zorder": 6}
    ax.plot(*checked_positions("subgoals", subgoals).T, "x", label=label, **look)


def start(ax, place, label="start"):
    """Where a law, a walk or a path begins.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    place : (2,) array_like
        In m.
    label : str, optional
    """
    look = {"color": LAW, "markeredgecolor": "black", "markeredgewidth": _pt(1), "zorder": 6}
    ax.plot(*checked_positions("place", place, 2), "o", markersize=_pt(8), label=label, **look)


def law(ax, response, label="control law", **look):
    """The response of a control law, and two arrowheads that say which way it is walked.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    response : (N, 2) array_like
        In m.
    label : str, optional
    **look
        Options of `path`.
    """
    response = checked_positions("response", response)
    look = {"linewidth": _pt(2), "colour": LAW} | look
    path(ax, response, label, **look)
    walked = arc_length(response)
    head = {"mutation_scale": _pt(18), "color": look["colour"], "linewidth": 0}
    for share in _HEADS_AT:
        k = np.searchsorted(walked, share * walked[-1]).clip(1, len(response) - 1)
        _arrow(ax, response[k - 1], response[k], **head)


def runs(ax, runs, first=0):
    """Where the robot went.

    Kidnapped runs have a look each, where there are several, and a number; the kidnapping is a dotted
    leap to a numbered dot.
    A circle is the rim of the robot where a run first touched something.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    runs : sequence of Run
    first : int
        Of which number the first is, from 0, where runs are drawn one by one.
    """
    apart, label = any(len(run.kidnapped) for run in runs), "kidnapped"
    for k, run in enumerate(runs, first):
        look = {"linewidth": _pt(0.9), "alpha": 0.8, "colour": RUN}
        if apart and len(runs) > 1:
            shade, line = _RUN_SHADES[k % 5], _RUN_LINES[k % 5]
            look = {"linewidth": _pt(1.2), "colour": shade, "linestyle": line}
        places = run.true_poses[:, :2]
        leaps = _leaps(run)
        for n, part in enumerate(np.split(places, leaps)):
            path(ax, part, None if n or k > first else "robot's runs", **look)
        for leap in leaps:
            path(ax, places[leap - 1 : leap + 1], label, "black", linestyle=":")
            label = None
            ax.plot(*places[leap], "o", color="black", markersize=_pt(4), zorder=6)
            _write(ax, k + 1, places[leap], (0, 9), ha="center", va="center", weight="bold")
    _contacts(ax, [run for run in runs if run.collisions], width=_pt(0.8))


_TOUCHING = {"colour": MOST_LIKELY, "width": 2.0}
"""Look of the rim where a run touched something: otherwise than the robot at the end, which may stand there."""


def _contacts(ax, runs, colour="black", width=0.8):
    """The rim of the robot where each of some runs first touched something."""
    for run in runs:
        rim = {"fill": False, "edgecolor": colour, "linewidth": width, "zorder": 7}
        ax.add_patch(Circle(_first_contact(run), getattr(run, "radius", _RIM), **rim))
    if runs:
        look = {"color": colour, "fillstyle": "none", "markeredgewidth": width}
        ax.plot([], [], "o", markersize=_pt(10), label="first contact, robot's rim", **look)


def _first_contact(run):
    """Where (2,) a Run that touched something was when its rim first met an obstacle."""
    met = np.flatnonzero(run.clearance < 0)
    return run.true_poses[met[0] if len(met) else run.clearance.argmin(), :2]


def task(ax, task):
    """A task: its way or ways, its subgoals and waits, the objects, and which of them it follows.

    Subgoals are numbered from 1, objects from 0 as in the environment. Where the task was shown
    among the objects as they stand, the walks are drawn too.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    task : Task
    """
    _numbered_boxes(ax, task.environment)
    label = "walks shown"
    for shown in task.demonstrations:
        if np.array_equal(shown.environment.boxes, task.environment.boxes):
            for walk in shown.walks:
                path(ax, walk, label, USER, linewidth=0.6, alpha=0.5)
                label = None
    _follows(ax, task)
    label = "other ways"
    for other in task.ways[1:]:
        law(ax, other.response(), label, linewidth=1.2, linestyle="--")
        label = None
    law(ax, task.law.response(), "way of the task")
    subgoals(ax, task.law.subgoals)
    _numbers(ax, task.law)
    start(ax, task.law.start)
    _waits(ax, task.law)


def _numbered_boxes(ax, environment):
    """The objects of an environment, each with its number."""
    boxes(ax, environment.boxes, "objects, by number")
    for k, (x0, y0, x1, y1) in enumerate(environment.boxes):
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
        _write(ax, k, middle, (0, 0), color=OBSTACLE, ha="center", va="center", weight="bold")


def _numbers(ax, law):
    """The number of each subgoal of a law, from 1 on."""
    for k, place in enumerate(law.subgoals, 1):
        _write(ax, k, place, (6, 5), weight="bold")


_LEAST_FOLLOWED = 0.25
"""The share of a place that an object must carry for a line to be drawn to it: a place has few of so many."""


def _follows(ax, task):
    """A dotted line from the start and each subgoal to the objects that they follow, wider for more of it."""
    tied, label = task.association, "follows"
    places = np.vstack([task.law.start, task.law.subgoals])
    middles = task.environment.boxes.reshape(-1, 2, 2).mean(axis=1)
    for place, corners, weights in zip(places, tied.corners, tied.weights, strict=True):
        shares = np.bincount(corners // 4, weights, minlength=len(middles))
        for k in np.flatnonzero(shares > _LEAST_FOLLOWED):
            look = {"linestyle": ":", "linewidth": 2.5 * shares[k], "zorder": 1}
            path(ax, [place, middles[k]], label, OBSTACLE, **look)
            label = None


def _waits(ax, law, stood=()):
    """A ring, and the time in s, where the law waits; with rows (W, 3) of `Run.waits` how long was stood."""
    places = np.vstack([law.start, law.subgoals])
    pauses = np.zeros(len(places)) if law.pauses is None else law.pauses
    told = {int(k): f"{seconds:.1f} of {shown:.1f} s" for k, shown, seconds in stood}
    label = "waits"
    for k, (place, wait) in enumerate(zip(places, pauses, strict=True)):
        if wait > 0:
            look = {"color": OCCLUDED, "markersize": 16, "markeredgewidth": 2, "fillstyle": "none"}
            ax.plot(*place, "o", label=label, zorder=6, **look)
            _write(ax, told.get(k, f"{wait:.1f} s"), place, (11, -14), color=_WAIT, weight="bold")
            label = None


def run(ax, run, task=None):
    """What came of a task: where the robot was, which subgoals it reached, kidnappings, waits and contacts.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    run : Run
    task : Task, optional
        That was performed; its way in force at the end is drawn, and its objects.
    """
    if task is not None:
        _numbered_boxes(ax, task.environment)
        way = task.ways[min(int(run.way[-1]), len(task.ways) - 1)]
        law(ax, way.response(), "way of the task", linewidth=1.2, alpha=0.7)
        reached = np.asarray(_reached(run, way), bool)
        for flags, look, label in (
            (reached, SUBGOAL, "reached"),
            (~reached, BACKGROUND, "not reached"),
        ):
            if flags.any():
                ax.plot(*way.subgoals[flags].T, "x", color=look, **_CROSS, label=f"subgoals, {label}")
        _numbers(ax, way)
        _waits(ax, way, run.waits)
    places, leaps = run.true_poses[:, :2], _leaps(run)
    for n, part in enumerate(np.split(places, leaps)):
        path(ax, part, None if n else "robot", RUN, linewidth=1.6)
    for n, leap in enumerate(leaps):
        path(
            ax,
            places[leap - 1 : leap + 1],
            None if n else "kidnapped: a, b, …",
            "black",
            linestyle=":",
        )
        ax.plot(*places[leap], "o", color="black", markersize=4, zorder=6)
        letter = ascii_lowercase[n % len(ascii_lowercase)]
        _write(ax, letter, places[leap], (0, 9), ha="center", va="center", weight="bold")
    _contacts(ax, [run] if run.collisions else [], **_TOUCHING)
    known = run.true_poses[np.isfinite(run.true_poses).all(axis=1)]
    if len(known):
        ax.plot(
            *known[0, :2],
            "o",
            color=RUN,
            markeredgecolor="black",
            markersize=7,
            zorder=5,
            label="begin",
        )
        robot(ax, known[-1], run.radius, "robot at the end")


_CROSS = {"markersize": 9, "markeredgewidth": 2.5, "zorder": 6, "linestyle": "none"}


def _leaps(run):
    """Rows of a run in which the robot stands where it was put."""
    return np.searchsorted(run.t, run.kidnapped - 0.5 * run.t[1:2].sum())


def _reached(run, way):
    """Which subgoals (K,) of a way a run reached, bool: what it says, or those before the segment at its end."""
    if len(run.reached) == len(way.segments):
        return run.reached
    return np.arange(len(way.segments)) < (len(way.segments) if run.finished else run.active[-1])


_WIDE, _LEAST_HIGH, _MOST_HIGH = 7.0, 4.5, 9.0
"""Inches: width of a picture, and bounds of its height."""


def figure_of(draw, title=None):
    """A figure of one plane, drawn in house style, with its legend under it.

    Parameters
    ----------
    draw : callable
        Draws into axes.
    title : str, optional

    Returns
    -------
    matplotlib.figure.Figure
        It is no figure of pyplot: nobody has to close it.
    """
    with style():
        figure = Figure(figsize=(_WIDE, _MOST_HIGH))
        FigureCanvasAgg(figure)
        ax = plane(figure.add_subplot(), title)
        draw(ax)
        ax.margins(0.05)
        width, height = np.ptp([ax.get_xlim(), ax.get_ylim()], axis=1)
        figure.set_figheight(np.clip(0.8 + _WIDE * height / width, _LEAST_HIGH, _MOST_HIGH))
        _legend_below(figure, *ax.get_legend_handles_labels())
        return figure


def _legend_below(figure, handles, labels):
    """The legend under the axes, of as many columns as the figure is wide enough for."""
    for columns in (4, 3, 2, 1) if labels else ():
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=columns, columnspacing=1.2)
        if columns == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def png(draw, title=None):
    """A picture of one plane.

    Parameters
    ----------
    draw : callable
        Draws into axes.
    title : str, optional

    Returns
    -------
    bytes
        A PNG; the same for the same drawing.

    Examples
    --------
    >>> png(lambda ax: path(ax, [[0, 0], [1, 2]], "walk"))[1:4]
    b'PNG'
    """
    stream = BytesIO()
    with style():
        figure_of(draw, title).savefig(stream, format="png")
    return stream.getvalue()


def cdhmm(ax, model, sd=2.0):
    """A CDHMM in the plane: its states, the steps between them, and its most-likely path in crimson.

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
        width = _pt(0.5 + 2.0 * model.transitions[u, v])
        _arrow(ax, *model.means[[u, v]], color=colour, linewidth=width, shrinkB=2)
    for state, (mean, covariance) in enumerate(zip(model.means, model.covariances, strict=True)):
        _ellipse(ax, mean, covariance, sd, None if state else f"states, {sd:g} sd")
        _write(ax, state, mean, (6, 6))
    _write(ax, "start", model.means[way[0]], (-8, 0), ha="right", va="center", style="italic")
    _write(ax, "end", model.means[way[-1]], (14, -6), va="center", style="italic")
    ax.plot(*model.means.T, ".", color=SUBGOAL, markersize=_pt(6), zorder=7)


def _arrow(ax, tail, head, **look):
    """An arrow from one place (2,) to another."""
    look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0} | look
    ax.annotate("", head, tail, arrowprops=look, zorder=5)


def _write(ax, text, place, offset, **look):
    """Write at an offset, in points, from a place (2,)."""
    look = {"textcoords": "offset points", "path_effects": [HALO], "zorder": 8} | look
    ax.annotate(str(text), place, xytext=offset, **look)


def _ellipse(ax, mean, covariance, sd, label):
    """Where a normal distribution of mean (2,) and covariance (2, 2) reaches `sd` deviations."""
    variances, axes = np.linalg.eigh(covariance)
    angle = np.degrees(np.arctan2(axes[1, 0], axes[0, 0]))
    look = {"facecolor": SUBGOAL, "edgecolor": SUBGOAL, "alpha": 0.15, "zorder": 3}
    ax.add_patch(Ellipse(mean, *(2 * sd * np.sqrt(variances)), angle=angle, label=label, **look))
