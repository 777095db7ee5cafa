"""Figures 1 to 6a: the laboratory, the way of the data, and observing the user (Sec. II)."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import ConnectionPatch, Rectangle

import dollop
from dollop import lab, plot
from dollop.environment import standing_boxes
from dollop.foreground import ForegroundGrid, endpoints, foreground_mask
from dollop.lab.truth import track_error
from dollop.observation import STATIC_EVERY, foreground_hits
from dollop.replication import drawing, recordings
from dollop.replication.figures.panel import panel

__all__ = []

GAIN, STATIC_GAIN = 0.6, 0.1  # of `dollop.observe` with method="paper"
PIXELS = {"width": 1020, "height": 765, "passes": 9}
"""Of a rendering: as many as the other figures are wide, each the mean of several."""
SIZE = (drawing.WIDTH, 3.1)


@panel("1", rendered=True)
def figure_1():
    """The mobile robot used in these experiments, Agent Orange.

    A Pioneer 2 DX with its real dimensions: two driven wheels, a castor, and the SICK on top. The
    paper has a photograph; this is the model that the simulation drives.
    """
    return drawing.picture(lab.render_robot(**PIXELS)), {}


@panel("2")
def figure_2():
    """Conceptual flow diagram of Dollop.

    Bold is the paper's word for a stage, under it the function that does it and the record that it
    returns. What stands in the upper frame happens once per demonstration; the lower one brings all
    demonstrations together. No arrow points back.
    """
    figure = plt.figure(figsize=(drawing.WIDTH, 4.45))
    figure.set_layout_engine("none")
    ax = figure.add_axes((0, 0, 1, 1))
    for frame in FRAMES:
        draw_frame(ax, *frame)
    for place, words, does, record in WAY.values():
        draw_stage(ax, place, words, f"{does.__qualname__}\n→ {record.__name__}")
    for step in WAY_ON.split():
        draw_step(ax, *(WAY[stage][0] for stage in step.split("-")))
    ax.set(xlim=(0, drawing.WIDTH), ylim=(-0.3, 4.15))
    ax.set_axis_off()
    return figure, {}


STAGE = 1.0, 0.52  # inches: width and height of a stage in the drawing
LEFT, MIDDLE, RIGHT = 0.58, 1.7, 2.82  # of its three columns
WAY = {  # stage: its place in the drawing, the paper's word for it, what does it, what that returns
    "log": ((LEFT, 3.85), "laser log", dollop.read_log, dollop.LaserLog),
    "background": (
        (RIGHT, 3.85),
        "background map",
        dollop.OccupancyGrid.load,
        dollop.OccupancyGrid,
    ),
    "observe": ((MIDDLE, 3.1), "observing\nthe user", dollop.observe, dollop.Observation),
    "subgoals": ((LEFT, 2.35), "computing\nsubgoals", dollop.SequencedLDS.fit, dollop.SequencedLDS),
    "configure": ((RIGHT, 2.35), "environment\nconfiguration", standing_boxes, dollop.Environment),
    "associate": ((MIDDLE, 1.6), "associating\nsubgoals", dollop.associate, dollop.Association),
    "map": ((LEFT, 0.7), "mapping\ndemonstrations", dollop.match, dollop.Matching),
    "learn": (
        (RIGHT, 0.7),
        "learning the\ntask structure",
        dollop.SubgoalHMM.fit,
        dollop.SubgoalHMM,
    ),
    "new": ((LEFT, -0.02), "a new\nenvironment", dollop.observe, dollop.Observation),
    "adapt": ((MIDDLE, -0.02), "updating\nsubgoals", dollop.Task.adapt, dollop.Task),
    "perform": ((RIGHT, -0.02), "performing\nthe task", dollop.perform, dollop.Run),
}
WAY_ON = """log-observe background-observe observe-subgoals observe-configure subgoals-associate
configure-associate associate-map map-learn learn-adapt new-adapt adapt-perform"""
FRAMES = (  # lower left corner, width and height, what holds for the stages in it, and on which side
    ((0.03, 1.28), (3.34, 2.2), "once per\ndemonstration", "left"),
    ((0.03, 0.38), (3.34, 0.84), "all demonstrations: learn → Task", "right"),
)


def draw_frame(ax, corner, size, words, side):
    """A grey field behind stages that belong together, with words along its upper edge."""
    ax.add_patch(Rectangle(corner, *size, facecolor="#EBEBEB", zorder=0))
    x, y = np.add(corner, (0.07 if side == "left" else size[0] - 0.07, size[1] - 0.05))
    ax.text(x, y, words, ha=side, va="top", style="italic", color="0.3")


def draw_stage(ax, place, words, code):
    """A box with a stage's name in words, and under it the names in the code."""
    lower_left = np.subtract(place, np.divide(STAGE, 2))
    edge = {"facecolor": "white", "edgecolor": plot.USER, "linewidth": 0.9}
    ax.add_patch(Rectangle(lower_left, *STAGE, zorder=2, **edge))
    (x, y), middle = place, {"ha": "center", "va": "center", "zorder": 3, "fontsize": 6.2}
    ax.text(x, y + 0.12, words, weight="bold", linespacing=1.0, **middle)
    ax.text(x, y - 0.13, code, family="monospace", linespacing=1.05, **middle)


def draw_step(ax, before, after):
    """An arrow from one stage's edge to the next one's."""
    sideways, upwards = np.sign(np.subtract(after, before))
    half = np.divide(STAGE, 2) * ((sideways, 0) if before[1] == after[1] else (0, upwards))
    look = {
        "arrowstyle": "-|>",
        "linewidth": 0.9,
        "shrinkA": 0,
        "shrinkB": 0,
        "mutation_scale": 7,
        "color": "black",
    }
    ax.annotate("", after - half, before + half, arrowprops=look, zorder=4)


@panel("3")
def figure_3():
    """Sample laser scan.

    The robot sits at the bottom. Every dot is where a beam ended; behind each can and behind the
    user lies a shadow. The names are the laboratory's, for the reader: nothing in the scan says
    which dots are a person, and of a stool there is no more than its column.
    """
    recording = recordings.figure_eights().recording
    log, i = recording.log, scan_beside_the_cans(recording.log)
    figure, ax = plt.subplots(figsize=SIZE)
    plot.scan(ax, log, i)
    plot.robot(ax, log.poses[i], label="robot")
    plot.plane(ax)
    for name, _, at, colour in named(recording, i):
        turned = 90 if abs(at[0] - 4.5) > 4.6 else 0  # beside the room
        drawing.write(ax, name, at, color=colour, rotation=turned)
    ax.set(xlim=(-0.5, 9.5), ylim=(0, 7.5))
    drawing.legend_below(figure, ax)
    return figure, {"beams": len(log.angles), "returns": int(np.isfinite(log.ranges[i]).sum())}


BEHIND = 0.42
"""m from the middle of a can or of the user to its name, in its shadow."""
FURNITURE = (  # name, where it stands, where that is written
    *(("desk", (x, 6.6), (x, 7.25)) for x in (1.5, 3.3, 5.9)),
    ("cabinet", (7.4, 6.53), (7.45, 7.25)),
    *(("stool", (x, y), (x, y - 0.3)) for x, y in ((3.6, 5.9), (6.3, 5.95))),
    ("cabinet", (0.35, 4.95), (-0.27, 4.95)),
    ("cabinet", (8.6, 5.95), (9.27, 5.95)),
    ("cabinet", (8.69, 1.55), (9.27, 1.55)),
    ("wall", (0.0, 2.5), (-0.27, 2.5)),
    ("wall", (9.0, 3.6), (9.27, 3.6)),
    ("desk", (2.1, 0.65), (1.6, 0.35)),
    ("desk", (6.5, 0.65), (7.1, 0.35)),
    ("stool", (1.6, 1.08), (1.15, 1.2)),
    ("stool", (7.2, 1.1), (7.65, 1.2)),
)


def named(recording, i):
    """What a scan's beams meet: name, where it is (2,) and is written (2,), in m, and a colour."""
    log, truth = recording.log, recording.truth
    user = np.array([np.interp(log.t[i], truth.t, truth[axis]) for axis in "xy"])
    things = [("can", place, plot.OBSTACLE) for place in recording.scene.positions]
    things.append(("user", user, plot.USER))
    for name, place, colour in things:
        sight = place - log.poses[i, :2]
        yield name, place, place + BEHIND * sight / np.linalg.norm(sight), colour
    yield from ((name, np.array(place), at, "0.35") for name, place, at in FURNITURE)


def scan_beside_the_cans(log):
    """A scan with both cans and the walker in sight: the first after a quarter of a lap."""
    return int(np.searchsorted(log.t, log.t[0] + 6.0))


@panel("4")
def figure_4():
    """Flow diagram for observing the user.

    Every stage of the paper's method with its own intermediate picture. Above, the whole room: the
    background map explains walls and desks, and what is left are foreground cells. All else is
    drawn from the dotted window on, as large as there is room: one can, and the user who walks
    round it. Foreground cells (blue) go two ways. A quick foreground grid follows the user: the
    darker a cell, the more often it was hit of late; its blobs are the foreground objects, a colour
    and a shape each, with their centroids (plus), and tracking these tells the user (blue) from
    what stands still (dark). A second, slower grid forgets the user and keeps the static objects.
    The two stages of the slower grid are drawn after the whole recording, all others at one moment
    of it.
    """
    shown, grid = recordings.figure_eights(), recordings.background_map()
    log, observation = shown.recording.log, shown.observed_as_paper
    i = scan_beside_the_cans(log)
    figure, axes = plt.subplots(4, 2, figsize=(drawing.WIDTH, 5.9))
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.07)
    stages = dict(zip(STAGES, axes.flat, strict=True))
    drawing.lettered(axes.flat, STAGES)
    for ax in axes.flat:
        framed(ax, *((ROOM, (0.45, 0.04)) if ax in axes[0] else (WINDOW, (0.05, 0.84))))
    plot.scan(stages["laser scan"], log, i, label=None)
    plot.grid_map(stages["background map"], grid, colour="black")
    for ax in axes[0]:
        look = {"linewidth": 0.8, "linestyle": ":", "zorder": 6}
        plot.boxes(ax, [np.ravel(WINDOW)], None, plot.BACKGROUND, **look)
    points = endpoints(log)[i]
    cells = foreground_mask(points, grid)
    stages["foreground cells"].plot(*points[cells].T, "s", color=plot.USER, markersize=2.5)
    foreground = draw_memory(stages["foreground grid"], log, grid, range(i + 1), GAIN)
    draw_objects(stages["foreground objects"], foreground)
    some = range(0, len(log.t), STATIC_EVERY)
    draw_memory(stages["slower foreground grid"], log, grid, some, STATIC_GAIN)
    draw_tracks(stages["tracks, and the user"], observation, log.t[i])
    plot.boxes(stages["static objects"], observation.environment.boxes)
    figure.canvas.draw()  # so that the axes are where the arrows ask for them
    for before, after in FLOW:
        connect(figure, stages[before], stages[after])
    return figure, {}


ROOM, WINDOW = (
    ((-0.1, -0.1), (9.1, 7.1)),
    ((5.9, 2.15), (8.5, 4.2)),
)  # m, lower left and upper right corners
STAGES = (  # two columns
    *("laser scan", "background map", "foreground cells", "slower foreground grid"),
    *("foreground grid", "static objects", "foreground objects", "tracks, and the user"),
)
FLOW = (
    ("laser scan", "foreground cells"),
    ("background map", "foreground cells"),
    ("foreground cells", "slower foreground grid"),
    ("foreground cells", "foreground grid"),
    ("slower foreground grid", "static objects"),
    ("foreground grid", "foreground objects"),
    ("foreground objects", "tracks, and the user"),
)


def framed(ax, corners, scale):
    """A part of the plane in a frame, with a metre that begins at shares of its width and height."""
    (left, low), (right, high) = corners
    ax.set(xlim=(left, right), ylim=(low, high), xticks=(), yticks=(), aspect="equal")
    ax.spines[["top", "right"]].set_visible(True)
    x, y = left + scale[0] * (right - left), low + scale[1] * (high - low)
    ax.plot([x, x + 1], [y, y], "|-", color="black", markersize=4, zorder=7)
    drawing.write(ax, "1 m", (x + 0.5, y), (0, 5))


def connect(figure, before, after):
    """An arrow from one stage to another, to its right, below it, or to its lower left."""
    start, end = (ax.get_subplotspec() for ax in (before, after))
    places = (0.1, -0.02), (0.9, 1.14)
    if start.colspan == end.colspan:
        places = (0.7, -0.02), (0.7, 1.14)
    elif start.rowspan == end.rowspan:
        places = (1.01, 0.5), (-0.01, 0.5)
    look = {"arrowstyle": "-|>", "mutation_scale": 8, "linewidth": 1.0, "color": "black"}
    figure.add_artist(ConnectionPatch(*places, before.transAxes, after.transAxes, **look))


def draw_memory(ax, log, grid, scans, gain):
    """A foreground grid that has taken in some scans, which it returns: the darker the surer."""
    foreground, hits = ForegroundGrid(grid, gain), foreground_hits(log, grid)
    for k in scans:
        foreground.update(hits[k], log.poses[k], log.angles, log.ranges[k])
    known = np.flatnonzero(foreground.value)
    look = {"cmap": "Blues", "vmin": -0.2, "vmax": 1, "s": 7, "marker": "s", "linewidths": 0}
    ax.scatter(*foreground.centres(known).T, c=foreground.value[known], **look)
    return foreground


def draw_objects(ax, foreground):
    """Blobs, a colour and a shape each, and the centroids of the foreground objects."""
    blobs = foreground.blobs()
    places = foreground.centres(blobs.cells @ [foreground.shape[1], 1])
    for k, label in enumerate(np.unique(blobs.labels)):
        look = {"color": BLOBS[k % len(BLOBS)], "marker": "sD^ov"[k % 5], "s": 7, "linewidths": 0}
        ax.scatter(*places[blobs.labels == label].T, **look)
    ax.plot(*foreground.objects().T, "k+", markersize=7, markeredgewidth=1.0)


BLOBS = "#E69F00", "#56B4E9", "#CC79A7", "#0072B2", "#009E73"


def draw_tracks(ax, observation, now):
    """Every track up to a time in s, the user's over them; a dot is where each is now."""
    tracks = [(track, "0.3", 1.2) for track in observation.tracks]
    for track, colour, width in (*tracks, (observation.user, plot.USER, 2.0)):
        known = track.positions[track.t <= now]
        if len(known):
            plot.path(ax, known, colour=colour, linewidth=width)
            ax.plot(*known[-1], "o", color=colour, markersize=3.5)


@panel("5", rendered=True)
def figure_5():
    """Example setup of the laboratory with two obstacles in the workspace.

    Two trash cans about four metres apart among desks and stools; the robot watches from the wall
    while the user walks the figure-eight round the cans. The wall behind the robot is left out.
    """
    scene = recordings.figure_eights().recording.scene
    user = lab.figure_eight(scene, recordings.SEED, laps=1).at(MID_STEP)
    return drawing.picture(lab.render_lab(scene, [user], **PIXELS)), {}


MID_STEP = 13.0
"""Time in s of a walk at which both feet are far apart, and nothing is before the user."""


@panel("6a", people="Dollop's own", paper="the paper's method")
def figure_6a():
    """The track of the user during five demonstrations of a figure-eight.

    Orange dots are where the user was out of sight behind a can: the way there is bridged, in the
    paper by Kalman predictions. A laser sees only the near side of a body, so the paper's centroids
    are too near to it; Dollop's own positions, which are drawn, are the middle of the body, and
    that bias is gone. The track error is what remains without it.
    """
    shown = recordings.figure_eights()
    recording, observation = shown.recording, shown.observation
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), recording.log.poses[0], observation.environment.boxes, ax)
    plot.track(ax, observation.user, "user's track", linewidth=0.5)
    plot.start(ax, observation.user.positions[0])
    drawing.legend_below(figure, ax)
    by_paper = track_numbers(shown.observed_as_paper, recording)
    return figure, {
        **track_numbers(observation, recording),
        **{f"paper_{name}": value for name, value in by_paper.items()},
    }


def track_numbers(observation, recording):
    """How far the user's track is from the truth of a recording, how long it was hidden, and lost."""
    user = observation.user
    bias, errors = track_error(user, recording.truth, recording.log.poses[0])
    return {
        "track_error_mean_m": errors.mean(),
        "track_error_p95_m": np.quantile(errors, 0.95),
        "track_error_max_m": errors.max(),
        "bias_m": bias,
        "occluded_s": np.diff(user.t, prepend=user.t[0])[user.occluded].sum(),
        "losses": observation.losses,
    }
