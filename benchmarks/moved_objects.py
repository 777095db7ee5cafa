"""How well tasks follow moved objects, beside other people's methods: python -m benchmarks.moved_objects

    python -m benchmarks.moved_objects [recorded] [drawn] [--tasks 40] [--first-seed 0] [--jobs 2]
        [--objects 3 4 8] [--numbers 1 2 3 5 10] [--kinds anywhere moved still] [--methods anchored paper ...]
        [--measure warped]

Ours is what the public calls deliver, `dollop.learn` and `Task.adapt`, by both methods, matchings given. TP-GMM is
told where the objects are, ProMP and DMP where the way truly begins and ends (`dollop.replication.peers`, which needs
the extra `peers`); the mean of the demonstrations is told nothing.

`recorded`: the folder `moved_objects` in DOLLOP_EXTERNAL_DATA holds two sets of four demonstrations between two frames.
Each demonstration in turn is left out: from the three others a task is learned and adapted to the frames of the one
left out, of which nothing else is used. A frame is an object, a box of 10 cm at its origin b, its direction that of its
first axis. Frames' scale, the same in all demonstrations, is left aside, and so is the mirroring of one of them:
mirrored in every demonstration, it is undone where it is done. Each set is scaled so that the diagonal of the bounding
box of all its demonstrations is 3 m; ours is measured at tolerances of 1, 2 and 5 cm. Paths are resampled to 200
points. The error is the mean distance along the dynamic-time-warping path between what was found (ours evenly along its
length, the others' evenly in time) and the true path (evenly in time), in % of the diagonal.

`drawn`: tasks among 3, 4 and 8 objects that stand anywhere, 0.5 m from where they were, or still, from 1 to 10
demonstrations. The error is the mean distance of what the person would walk from the way that was found, in % of its
size: the median over the tasks with its 95 % bootstrap interval. `walked again` is the same person's next walk. A
method that refuses a task counts as infinitely far off. A way that passes all places but swings far between them is
near by that measure; `--measure warped` is the mean distance along the dynamic-time-warping path, which forgives none.
"""

import argparse
import os
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from dollop.association import Frames
from dollop.checks import need
from dollop.environment import Environment
from dollop.lab.tasks import KINDS
from dollop.replication import peers
from dollop.task import Demonstration
from dollop.trajectory import resample as evenly_along

POINTS = 200
DIAGONAL, SIDE = 3.0, 0.1  # m: of the sets, and of the boxes
TOLERANCES = (0.01, 0.02, 0.05)  # m
OURS = ("anchored", "paper")
MEASURES = {"nearest": peers.off_way, "warped": peers.off_way_in_order}
OTHERS = [name for name in peers.METHODS if name not in OURS]


def read_options(folder):
    """Four (path (T, 2), Frames) of the set `options`: pixels on a screen."""
    return [_read_option(folder, d) for d in range(4)]


def _read_option(folder, d):
    read = [
        [np.load(folder / f"test_options_tp_{m}_d_{d}_{part}.npy").reshape(shape) for m in range(2)]
        for part, shape in (("A", (2, 2)), ("b", 2))
    ]
    axes, origins = np.array(read[0]), np.array(read[1])
    seen_from_first = np.load(folder / f"test_options{d}.npy")[:, :2]
    return seen_from_first @ axes[0].T + origins[0], _frames(axes, origins)


def read_tpgmm(folder):
    """Four (path (T, 2), Frames) of the set `tpgmm`."""
    return [_read_tpgmm(folder, d) for d in range(1, 5)]


def _read_tpgmm(folder, d):
    def read(name):
        return np.loadtxt(folder / f"sample{d}_{name}.txt", delimiter=",")

    # Rows and columns: time, x, y. The frames stand still during a demonstration, so the first sample has all.
    axes = np.array([read(f"frame{m}_A")[1:, 1:3] for m in (1, 2)])
    origins = np.array([read(f"frame{m}_b")[1:, 0] for m in (1, 2)])
    return read("Data")[1:].T, _frames(axes, origins)


def _frames(axes, origins):
    return Frames(origins, np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))


def resample(path, measure):
    """(POINTS, 2): the path at even steps of an increasing measure (T,) along it."""
    steps = np.linspace(measure[0], measure[-1], POINTS)
    return np.stack([np.interp(steps, measure, axis) for axis in path.T], axis=1)


def evenly_in_time(path):
    """(POINTS, 2), the samples taken to be evenly spaced in time."""
    return resample(path, np.arange(len(path)))


def trials(demonstrations):
    """A trial for each demonstration left out, the diagonal of all of them 3 m."""
    scale = DIAGONAL / np.linalg.norm(
        np.ptp(np.concatenate([evenly_in_time(path) for path, _ in demonstrations]), axis=0)
    )
    shown = [Demonstration(scale * path, as_environment(frames, scale)) for path, frames in demonstrations]
    held_out = [(shown[:k] + shown[k + 1 :], each) for k, each in enumerate(shown)]
    return [peers.Trial(rest, each.environment, evenly_in_time(each.trajectory)) for rest, each in held_out]


def as_environment(frames, scale):
    """Frames as small boxes that face where the frames do."""
    centres = scale * frames.positions
    return Environment(np.hstack([centres - SIDE / 2, centres + SIDE / 2]), directions=frames.directions)


def by_learning(trial, method, tolerance):
    """The path that a learned task takes, evenly along its length."""
    shown = [replace(each, tolerance=tolerance) for each in trial.demonstrations]
    return evenly_along(peers.learned(shown, trial.environment, method), POINTS)


def error(trial, method):
    """In % of the diagonal, and why the method refused, if it did: then the error is infinite."""
    try:
        found = method(trial)
    except ValueError as refused:
        return np.inf, str(refused)
    return 100 / DIAGONAL * peers.warped_distance(found, trial.way), ""


def recorded(others=OTHERS, ours=OURS, tolerances=TOLERANCES):
    """One row per set, method and tolerance: mean_error and max_error in % of the diagonal, and what was refused."""
    if "DOLLOP_EXTERNAL_DATA" not in os.environ:
        raise ValueError("DOLLOP_EXTERNAL_DATA must name the folder that holds moved_objects, but is not set")
    folder = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "moved_objects"
    methods = {(name, np.nan): lambda trial, name=name: evenly_in_time(peers.METHODS[name](trial)) for name in others}
    for name in ours:
        methods |= {(name, 100 * t): partial(by_learning, method=name, tolerance=t) for t in tolerances}
    rows = []
    for name, read in (("options", read_options), ("tpgmm", read_tpgmm)):
        held_out = trials(read(folder / name))
        for (method, tolerance), answer in methods.items():
            errors, refused = zip(*(error(trial, answer) for trial in held_out), strict=True)
            row = {"set": name, "method": method, "tolerance_cm": tolerance}
            told = {
                "mean_error": np.mean(errors),
                "max_error": np.max(errors),
                "refused": "; ".join(filter(None, refused)),
            }
            rows.append(row | told)
    return pd.DataFrame(rows)


def drawn(options):
    """Medians with intervals: one row per kind, objects and n, one column per method."""
    seeds = range(options.first_seed, options.first_seed + options.tasks)
    methods = {name: peers.DRAWN[name] for name in options.methods}
    measure = MEASURES[options.measure]
    found = peers.study(options.objects, options.numbers, seeds, options.kinds, methods, options.jobs, measure)
    for refused, cell in found[found.refused != ""].groupby("refused"):
        print(f"refused {len(cell)} x ({', '.join(sorted(set(cell.method)))}): {refused}")
    table = peers.summary(found)
    table["told"] = [f"{row.median:.1f} [{row.low:.1f}, {row.high:.1f}]" for row in table.itertuples()]
    return table.told.unstack("method")[list(methods)]


def parsed(arguments=None):
    """What the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.moved_objects", description=__doc__.split("\n")[0])
    parser.add_argument("what", nargs="*", choices=["recorded", "drawn", []], help="default: both")
    parser.add_argument("--tasks", type=int, default=40, help="in each cell, default: 40")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--objects", type=int, nargs="+", default=[3, 4, 8])
    parser.add_argument("--numbers", type=int, nargs="+", default=[1, 2, 3, 5, 10], help="of demonstrations")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--measure", default="nearest", choices=list(MEASURES))
    parser.add_argument("--methods", nargs="+", default=list(peers.DRAWN), choices=list(peers.DRAWN))
    return parser.parse_args(arguments)


def main(arguments=None):
    options = parsed(arguments)
    if not set(options.methods) <= {*OURS, "mean", "walked again"}:
        need("peers")
    what = options.what or ["recorded", "drawn"]
    if "recorded" in what:
        others, ours = ([name for name in each if name in options.methods] for each in (OTHERS, OURS))
        print(recorded(others, ours).to_string(index=False, float_format="{:.2f}".format))
    if "drawn" in what:
        print(drawn(options).to_string())


if __name__ == "__main__":
    main()
