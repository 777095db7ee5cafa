"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...].

Each figure is one function that returns the drawing and its numbers. `main` writes a PNG per panel and keeps the
numbers in metrics.json.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import ConnectionPatch
from tqdm import tqdm

from dollop import experiments, plot
from dollop.files import whole_file
from dollop.foreground import ForegroundGrid, endpoints, foreground_mask
from dollop.observation import foreground_hits
from dollop.trajectory import distance_to_polyline, mean_trajectory


def figure_1():
    """Agent Orange: a Pioneer 2 DX with its SICK."""
    from dollop.lab import render_robot

    return picture(render_robot()), {}


def figure_3():
    """One sample laser scan in the laboratory."""
    log = experiments.figure_eights().log
    figure, ax = plt.subplots(figsize=(6, 4.7))
    i = scan_beside_the_cans(log)
    plot.scan(ax, log, i)
    plot.robot(ax, log.poses[i], label="robot")
    legend_below(plot.plane(ax))
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
    return picture(render_lab(recording.scene)), {}


def figure_6a():
    """The user's track over five figure-eights, with obstacles and robot."""
    from dollop.lab.truth import track_error

    recording, observation = experiments.figure_eights(), experiments.figure_eights_observed()
    user, sensor = observation.user, recording.log.poses[0]
    figure, ax = workspace(sensor, observation.environment)
    plot.path(ax, user.positions, "user's track", linewidth=0.8)
    ax.plot(*user.positions[user.occluded].T, ".", color=plot.OCCLUDED, markersize=3, label="occluded")
    legend_below(ax)
    bias, errors = track_error(user, recording.truth, sensor)
    return figure, {
        "track_error_mean_m": errors.mean(),
        "track_error_p95_m": np.quantile(errors, 0.95),
        "track_error_max_m": errors.max(),
        "bias_m": bias,
        "occluded_s": np.diff(user.t, prepend=user.t[0])[user.occluded].sum(),
        "losses": observation.losses,
    }


def figure_6b():
    """Subgoals and control law extracted from the demonstrations of Fig. 6a."""
    recording, observation = experiments.figure_eights(), experiments.figure_eights_observed()
    law, laps = experiments.figure_eight_law(), experiments.figure_eight_laps()
    figure, ax = workspace(recording.log.poses[0], observation.environment)
    for k, lap in enumerate(laps):
        plot.path(ax, lap, "laps" if k == 0 else None, linewidth=0.4, alpha=0.6)
    plot.path(ax, law.response(), "control law", plot.LAW, linewidth=2)
    plot.subgoals(ax, law.subgoals)
    legend_below(ax)
    return figure, {
        "n_segments": len(law.segments),
        "mean_error_m": distance_to_polyline(mean_trajectory(laps), law.response()).mean(),
        "mean_error_laps_m": np.mean([law.error(lap) for lap in laps]),
        "tolerance_m": 0.02,
    }


def workspace(sensor, environment):
    """Axes with the background map, the obstacles and the watching robot."""
    figure, ax = plt.subplots(figsize=(6, 5.2))
    plot.grid_map(ax, experiments.background_map())
    plot.boxes(ax, environment.boxes, "obstacles")
    plot.robot(ax, sensor, label="robot")
    return figure, plot.plane(ax)


def legend_below(ax):
    """A legend in one row under the axes, where it hides nothing."""
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=5, columnspacing=1.0)


def picture(image):
    """A rendered image (H, W, 3) as a figure of exactly its pixels."""
    height, width = image.shape[:2]
    dpi = plot.STYLE["savefig.dpi"]
    figure = plt.figure(figsize=(width / dpi, height / dpi), layout="none")
    figure.figimage(image, resize=False)
    return figure


FIGURES = {
    "1": figure_1,
    "3": figure_3,
    "4": figure_4,
    "5": figure_5,
    "6a": figure_6a,
    "6b": figure_6b,
}


def name_of(panel):
    """File name of a panel: "6a" -> "fig_06a.png"."""
    number = panel.rstrip("ab")
    return f"fig_{number.zfill(2)}{panel[len(number) :]}.png"


def rounded(metrics):
    """Numbers to six decimals: what is beyond differs between processors."""
    return {key: round(value, 6) if isinstance(value, float) else value for key, value in metrics.items()}


def make(panel, folder):
    """Draw one panel into `folder`; returns its numbers."""
    with plot.style():
        figure, metrics = FIGURES[panel]()
        with whole_file(folder / name_of(panel)) as stream:
            figure.savefig(stream, format="png", metadata={"Software": None})
        plt.close(figure)
    return rounded(json.loads(json.dumps(metrics, default=float)))


def main(arguments=None):
    """Command line: make the figures named by id, or all."""
    parser = argparse.ArgumentParser(prog="python -m dollop.figures", description=main.__doc__)
    parser.add_argument("ids", nargs="*", metavar="id", help=f"any of {', '.join(FIGURES)}; all when none is given")
    parser.add_argument("--folder", type=Path, default=Path("figures"), help="where to write (default: figures)")
    options = parser.parse_args(arguments)
    unknown = [panel for panel in options.ids if panel not in FIGURES]
    if unknown:
        parser.error(f"no figure {', '.join(unknown)}; known: {', '.join(FIGURES)}")
    try:
        options.folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=options.folder).close()
    except OSError as error:
        parser.error(f"the folder {options.folder} cannot be written to: {error}")
    written = options.folder / "metrics.json"
    metrics = json.loads(written.read_text()) if written.exists() else {}
    panels = options.ids or list(FIGURES)
    for panel in tqdm(panels, desc="figures", unit="panel", file=sys.stderr):
        metrics[panel] = make(panel, options.folder)
    metrics = {panel: metrics[panel] for panel in FIGURES if panel in metrics}
    with whole_file(written, "w") as stream:
        json.dump(metrics, stream, indent=1)
        stream.write("\n")
    print(f"wrote {len(panels)} panels and metrics.json into {options.folder}/")


if __name__ == "__main__":
    main()
