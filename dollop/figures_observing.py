"""Figures 1 and 3 to 6a: the laboratory, and observing the user (Sec. II)."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import ConnectionPatch

from dollop import experiments, plot
from dollop.foreground import ForegroundGrid, endpoints, foreground_mask
from dollop.observation import foreground_hits


def figure_1():
    """Agent Orange: a Pioneer 2 DX with its SICK."""
    from dollop.lab import render_robot

    return plot.picture(render_robot()), {}


def figure_3():
    """One sample laser scan in the laboratory."""
    log = experiments.figure_eights().log
    figure, ax = plt.subplots(figsize=(6, 4.7))
    i = scan_beside_the_cans(log)
    plot.scan(ax, log, i)
    plot.robot(ax, log.poses[i], label="robot")
    plot.plane(ax)
    plot.legend_below(figure, ax)
    return figure, {"beams": len(log.angles), "returns": int(np.isfinite(log.ranges[i]).sum())}


def scan_beside_the_cans(log):
    """A scan in which both cans and the walker are in sight: the first after a quarter of the first lap."""
    return int(np.searchsorted(log.t, log.t[0] + 6.0))


def figure_4():
    """Flow diagram for observing the user, each stage with its own intermediate picture."""
    recording, grid = experiments.figure_eights(), experiments.background_map()
    log, observation = recording.log, experiments.figure_eights_observed()
    i = scan_beside_the_cans(log)
    figure, axes = plt.subplots(2, 4, figsize=(13, 6.2), sharex=True, sharey=True)
    figure.get_layout_engine().set(w_pad=0.15, h_pad=0.15)
    stages = axes[0].tolist() + axes[1, ::-1].tolist()
    draw_sensing(stages[:3], log, grid, i)
    draw_objects(stages[3:5], log, grid, i)
    draw_tracks(stages[5:7], observation, log.t[i])
    draw_environment(stages[7], observation)
    for ax, title in zip(stages, STAGES, strict=True):
        plot.grid_map(ax, grid, colour="#D0D0D0")
        plot.plane(ax, title)
        ax.set(xlim=(-0.1, 9.1), ylim=(-0.1, 7.1), xlabel="", ylabel="", xticks=(0, 3, 6, 9), yticks=(0, 3, 6))
    figure.supxlabel("x [m]", fontsize=9)
    figure.supylabel("y [m]", fontsize=9)
    figure.canvas.draw()  # so that the axes are where the arrows ask for them
    for before, after in FLOW:
        connect(figure, stages[before], stages[after])
    return figure, {}


STAGES = (
    "laser scan",
    "background map",
    "foreground cells",
    "foreground grid",
    "foreground objects",
    "Kalman filters, matched tracks",
    "the user: the fastest object",
    "static objects",
)
FLOW = ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (6, 7))


def connect(figure, before, after):
    """An arrow from one stage to the next."""
    start, end = before.get_position().x0, after.get_position().x0
    if start == end:
        places = (0.5, -0.02), (0.5, 1.13)
    else:
        places = ((1.02, 0.5), (-0.02, 0.5)) if start < end else ((-0.02, 0.5), (1.02, 0.5))
    arrow = ConnectionPatch(
        *places, before.transAxes, after.transAxes, arrowstyle="-|>", mutation_scale=20, linewidth=2, color="black"
    )
    figure.add_artist(arrow)


def draw_sensing(axes, log, grid, i):
    """Stages: the scan, the background map, the readings that the map does not explain."""
    plot.scan(axes[0], log, i, label=None)
    plot.grid_map(axes[1], grid, colour="black")
    points = endpoints(log)[i]
    cells = foreground_mask(points, grid)
    axes[2].plot(*points[~cells].T, ".", color=plot.BACKGROUND, markersize=2)
    axes[2].plot(*points[cells].T, ".", color=plot.USER, markersize=4)


def draw_objects(axes, log, grid, i):
    """Stages: the foreground grid, and its blobs with their centroids."""
    foreground = ForegroundGrid(grid, 0.6)
    for k, hits in enumerate(foreground_hits(log, grid)[: i + 1]):
        foreground.update(hits, log.poses[k], log.angles, log.ranges[k])
    blobs = foreground.blobs()
    extent = grid.extent
    axes[0].imshow(
        np.ma.masked_equal(foreground.value.reshape(foreground.shape), 0), origin="lower", extent=extent, cmap="Blues"
    )
    axes[1].scatter(
        *foreground.centres(blobs.cells @ [foreground.shape[1], 1]).T, c=blobs.labels, cmap="Dark2", s=2, marker="s"
    )
    axes[1].plot(*foreground.objects().T, "k+", markersize=9)


def draw_tracks(axes, observation, now):
    """Stages: every track so far, and the user's."""
    for track in observation.tracks:
        plot.path(axes[0], track.positions[track.t <= now], colour="0.3", marker=".", markersize=2)
    user = observation.user
    plot.path(axes[1], user.positions[user.t <= now], colour=plot.USER)


def draw_environment(ax, observation):
    """Stage: the static objects' boxes."""
    plot.boxes(ax, observation.environment.boxes)


def figure_5():
    """The laboratory with two obstacles about four metres apart."""
    from dollop.lab import render_lab

    recording = experiments.figure_eights()
    return plot.picture(render_lab(recording.scene)), {}


SIZE = (6, 5.2)


def figure_6a():
    """The user's track over five figure-eights, with obstacles and robot."""
    from dollop.lab.truth import track_error

    recording, observation = experiments.figure_eights(), experiments.figure_eights_observed()
    user, sensor = observation.user, recording.log.poses[0]
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(experiments.background_map(), sensor, observation.environment.boxes, ax)
    plot.track(ax, user, "user's track", linewidth=0.8)
    plot.legend_below(figure, ax)
    bias, errors = track_error(user, recording.truth, sensor)
    return figure, {
        "track_error_mean_m": errors.mean(),
        "track_error_p95_m": np.quantile(errors, 0.95),
        "track_error_max_m": errors.max(),
        "bias_m": bias,
        "occluded_s": np.diff(user.t, prepend=user.t[0])[user.occluded].sum(),
        "losses": observation.losses,
    }
