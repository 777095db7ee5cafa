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


@panel("1")
def figure_1():
    """The mobile robot used in these experiments, Agent Orange.

    A Pioneer 2 DX with its real dimensions: two driven wheels, a castor, and the SICK on top. The
    paper has a photograph; this is the model that the simulation drives.
    """
    return drawing.picture(lab.render_robot()), {}


@panel("2")
def figure_2():
    """Conceptual flow diagram of Dollop.

    Bold is the paper's word for a stage, under it the function that does it and the record that it
    returns. What stands in the left frame happens once per demonstration; the right one brings all
    demonstrations together. No arrow points back.
    """
    figure, ax = plt.subplots(figsize=(13, 4.6))
    for corner, size, words in FRAMES:
        draw_frame(ax, corner, size, words)
    for place, words, does, record in WAY.values():
        draw_stage(ax, place, words, f"{does.__qualname__}\n→ {record.__name__}")
    for step in WAY_ON.split():
        draw_step(ax, *(WAY[stage][0] for stage in step.split("-")))
    ax.set(xlim=(-1.4, 15.1), ylim=(-0.85, 4.35), aspect="equal")
    ax.set_axis_off()
    return figure, {}


STAGE = 2.3, 1.1  # width and height of a stage in the drawing
WAY = {  # stage: its place in the drawing, the paper's word for it, what does it, what that returns
    "log": ((0, 3), "laser log", dollop.read_log, dollop.LaserLog),
    "background": ((0, 0), "background map", dollop.OccupancyGrid.load, dollop.OccupancyGrid),
    "observe": ((2.7, 1.5), "observing the user", dollop.observe, dollop.Observation),
    "subgoals": ((5.4, 3), "computing subgoals", dollop.SequencedLDS.fit, dollop.SequencedLDS),
    "configure": ((5.4, 0), "environment\nconfiguration", standing_boxes, dollop.Environment),
    "associate": ((8.1, 1.5), "associating\nsubgoals", dollop.associate, dollop.Association),
    "map": ((10.95, 3), "mapping\ndemonstrations", dollop.match, dollop.Matching),
    "learn": ((13.65, 3), "learning the\ntask structure", dollop.SubgoalHMM.fit, dollop.SubgoalHMM),
    "new": ((10.95, 0), "a new environment", dollop.observe, dollop.Observation),
    "adapt": ((13.65, 1.5), "updating subgoals", dollop.Task.adapt, dollop.Task),
    "perform": ((13.65, 0), "performing the task", dollop.perform, dollop.Run),
}
WAY_ON = """log-observe background-observe observe-subgoals observe-configure subgoals-associate
configure-associate associate-map map-learn learn-adapt new-adapt adapt-perform"""
FRAMES = (  # lower left corner, width and height, what holds for the stages in it
    ((1.4, -0.7), (8.0, 4.85), "once per demonstration"),
    ((9.65, 2.3), (5.3, 1.85), "all demonstrations: learn → Task"),
)


def draw_frame(ax, corner, size, words):
    """A grey field behind stages that belong together, with words along its upper edge."""
    ax.add_patch(Rectangle(corner, *size, facecolor="#EBEBEB", zorder=0))
    x, y = np.add(corner, (0.12, size[1] - 0.12))
    ax.text(x, y, words, va="top", style="italic", color="0.3")


def draw_stage(ax, place, words, code):
    """A box with a stage's name in words, and under it the names in the code."""
    lower_left = np.subtract(place, np.divide(STAGE, 2))
    edge = {"facecolor": "white", "edgecolor": plot.USER, "linewidth": 1.5}
    ax.add_patch(Rectangle(lower_left, *STAGE, zorder=2, **edge))
    (x, y), middle = place, {"ha": "center", "va": "center", "zorder": 3}
    ax.text(x, y + 0.23, words, weight="bold", linespacing=1.0, **middle)
    ax.text(x, y - 0.28, code, family="monospace", fontsize=8, **middle)


def draw_step(ax, before, after):
    """An arrow from one stage's edge to the next one's."""
    sideways, upwards = np.sign(np.subtract(after, before))
    across = before[1] == after[1] or before[0] != after[0]
    half = np.divide(STAGE, 2) * ((sideways, 0) if across else (0, upwards))
    look = {"arrowstyle": "-|>", "linewidth": 1.5}
    ax.annotate("", after - half, before + half, arrowprops=look, zorder=4)


@panel("3")
def figure_3():
    """Sample laser scan.

    The robot sits at the bottom. Every dot is where a beam ended; behind each can and behind the
    user lies a shadow. Nothing in the scan says which dots are a person.
    """
    log = recordings.figure_eights().recording.log
    figure, ax = plt.subplots(figsize=(6, 4.7))
    i = scan_beside_the_cans(log)
    plot.scan(ax, log, i)
    plot.robot(ax, log.poses[i], label="robot")
    plot.plane(ax)
    drawing.legend_below(figure, ax)
    return figure, {"beams": len(log.angles), "returns": int(np.isfinite(log.ranges[i]).sum())}


def scan_beside_the_cans(log):
    """A scan with both cans and the walker in sight: the first after a quarter of a lap."""
    return int(np.searchsorted(log.t, log.t[0] + 6.0))


@panel("4")
def figure_4():
    """Flow diagram for observing the user.

    Every stage of the paper's method with its own intermediate picture. The background map explains
    walls and desks (grey dots); what is left are foreground cells (blue). They go two ways. A quick
    foreground grid follows the user: the darker a cell, the more often it was hit of late; its
    blobs are the foreground objects, each with its centroid (plus), and tracking these tells the
    user (blue) from what stands still. A second, slower grid forgets the user and keeps the static
    objects. The two stages of the slower grid are drawn after the whole recording, all others at
    one moment of it.
    """
    shown, grid = recordings.figure_eights(), recordings.background_map()
    log, observation = shown.recording.log, shown.observed_as_paper
    i = scan_beside_the_cans(log)
    figure, axes = plt.subplots(2, 4, figsize=(10, 5.2), sharex=True, sharey=True)
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.12)
    stages = dict(zip(STAGES, axes.flat, strict=True))
    for title, ax in stages.items():
        plot.grid_map(ax, grid, colour="black" if title == "background map" else "#D0D0D0")
        plot.plane(ax, title)
        ax.set(xlim=(-0.1, 9.1), ylim=(-0.1, 7.1), xticks=(0, 3, 6, 9), yticks=(0, 3, 6))
        ax.label_outer()
    plot.scan(stages["laser scan"], log, i, label=None)
    points = endpoints(log)[i]
    cells = foreground_mask(points, grid)
    stages["foreground cells"].plot(*points[~cells].T, ".", color=plot.BACKGROUND, markersize=2)
    stages["foreground cells"].plot(*points[cells].T, ".", color=plot.USER, markersize=4)
    foreground = draw_memory(stages["foreground grid"], log, grid, range(i + 1), GAIN)
    draw_objects(stages["foreground objects"], foreground)
    some = range(0, len(log.t), STATIC_EVERY)
    draw_memory(stages["slower foreground grid"], log, grid, some, STATIC_GAIN)
    draw_tracks(stages["tracks, and the user"], observation, log.t[i])
    plot.boxes(stages["static objects"], observation.environment.boxes)
    figure.canvas.draw()  # so that the axes are where the arrows ask for them
    for before, after in FLOW:
        connect(figure, axes.flat[before], axes.flat[after])
    return figure, {}


STAGES = (  # two rows
    *("laser scan", "foreground cells", "foreground grid", "foreground objects"),
    *("background map", "slower foreground grid", "static objects", "tracks, and the user"),
)
FLOW = (0, 1), (4, 1), (1, 2), (2, 3), (3, 7), (1, 5), (5, 6)  # from stage to stage, numbered so


def connect(figure, before, after):
    """An arrow from one stage to another, to its right, below it, or to its upper right."""
    start, end = (ax.get_subplotspec() for ax in (before, after))
    places = (0.93, 1.02), (0.02, -0.02)
    if start.colspan == end.colspan:
        places = (0.5, -0.02), (0.5, 1.17)
    elif start.rowspan == end.rowspan:
        places = (1.02, 0.5), (-0.02, 0.5)
    look = {"arrowstyle": "-|>", "mutation_scale": 18, "linewidth": 1.8, "color": "black"}
    figure.add_artist(ConnectionPatch(*places, before.transAxes, after.transAxes, **look))


def draw_memory(ax, log, grid, scans, gain):
    """A foreground grid that has taken in some scans, which it returns: the darker the surer."""
    foreground, hits = ForegroundGrid(grid, gain), foreground_hits(log, grid)
    for k in scans:
        foreground.update(hits[k], log.poses[k], log.angles, log.ranges[k])
    known = np.flatnonzero(foreground.value)
    look = {"cmap": "Blues", "vmin": -0.2, "vmax": 1, "s": 3, "marker": "s"}
    ax.scatter(*foreground.centres(known).T, c=foreground.value[known], **look)
    return foreground


def draw_objects(ax, foreground):
    """Blobs, a colour each, and the centroids of the foreground objects."""
    blobs = foreground.blobs()
    places = foreground.centres(blobs.cells @ [foreground.shape[1], 1])
    ax.scatter(*places.T, c=blobs.labels, cmap="Dark2", s=3, marker="s")
    ax.plot(*foreground.objects().T, "k+", markersize=9)


def draw_tracks(ax, observation, now):
    """Every track up to a time in s, the user's over them."""
    for track in observation.tracks:
        plot.path(ax, track.positions[track.t <= now], colour="0.3", linewidth=2)
    user = observation.user
    plot.path(ax, user.positions[user.t <= now], linewidth=2)


@panel("5")
def figure_5():
    """Example setup of the laboratory with two obstacles in the workspace.

    Two trash cans about four metres apart among desks and stools; the robot watches from the wall.
    """
    return drawing.picture(lab.render_lab(recordings.figure_eights().recording.scene)), {}


SIZE = (6, 5.2)


@panel("6a", people="Dollop's own", paper="the paper's method")
def figure_6a():
    """The track of the user during five demonstrations of a figure-eight.

    Orange dots are where the user was out of sight behind a can: the way there is bridged, in the
    paper by Kalman predictions. A laser sees only the near side of a body, so the paper's centroids
    are too near to it; Dollop's own positions, which are drawn, are the middle of the body, and that
    bias is gone. The track error is what remains without it.
    """
    shown = recordings.figure_eights()
    recording, observation = shown.recording, shown.observation
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), recording.log.poses[0], observation.environment.boxes, ax)
    plot.track(ax, observation.user, "user's track", linewidth=0.8)
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
