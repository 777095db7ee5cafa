"""How well associations follow moved objects that others recorded: python -m benchmarks.moved_objects

The folder `moved_objects` in DOLLOP_EXTERNAL_DATA holds two sets of four demonstrations between two frames. Each
demonstration in turn is left out. From the three others the path is associated with the frames and relocated to the
frames of the one left out, of which nothing else is used. There is nothing to tune: the weights' rule is fixed.

An environment is made of frames thus: each frame is one object, at its origin b, its direction that of its first axis.
Their scale, the same in all demonstrations, is left aside, and so is the mirroring of one of the frames: mirrored in
every demonstration, it is undone where it is done.

Every path is resampled to 200 points, demonstrations evenly along their length to be associated point by point. The
error is the mean distance along the dynamic-time-warping path between the relocated path and the true one (resampled
evenly in time), in % of the diagonal of the bounding box of all demonstrations of the set.
"""

import os
from pathlib import Path

import numpy as np
import pandas as pd

from dollop.association import Frames, associate_with_frames

POINTS = 200
# Mean and maximum measured with the same yardstick. TP-GMM is told the frames only, as our methods are; DMP (50 basis
# functions) and ProMP (20) are told the true start and goal.
OTHERS = {
    "options": {"DMP": (7.1, 9.1), "ProMP": (4.2, 6.5), "TP-GMM": (4.7, 7.1)},
    "tpgmm": {"DMP": (6.3, 11.2), "ProMP": (5.1, 10.4), "TP-GMM": (5.4, 8.3)},
}


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


def evenly_in_length(path):
    """(POINTS, 2), evenly spaced along the path."""
    return resample(path, np.r_[0, np.hypot(*np.diff(path, axis=0).T).cumsum()])


def warped_distance(one, other):
    """Mean distance of two paths along their dynamic-time-warping path, the one of least total distance."""
    distances = np.linalg.norm(one[:, None] - other, axis=2)
    before = [(0.0, 0)] + [(np.inf, 0)] * len(other)
    for row in distances.tolist():
        now = [(np.inf, 0)]
        for j, distance in enumerate(row):
            total, length = min(before[j], before[j + 1], now[j], key=lambda end: end[0])
            now.append((total + distance, length + 1))
        before = now
    total, length = before[-1]
    return total / length


def by_mean(demonstrations, frames):
    """The mean of the demonstrations, whatever the frames: the yardstick's check."""
    return np.mean([evenly_in_time(path) for path, _ in demonstrations], axis=0)


def by_both(demonstrations, frames):
    """By closeness and by how little the demonstrations vary: the library's association."""
    paths = [evenly_in_length(path) for path, _ in demonstrations]
    return associate_with_frames(paths, [seen for _, seen in demonstrations]).relocate(frames)


def by_closeness(demonstrations, frames):
    """The mean over demonstrations, each relocated as if it were the only one: by closeness alone."""
    return np.mean([by_both([demonstration], frames) for demonstration in demonstrations], axis=0)


METHODS = {"mean": by_mean, "closeness": by_closeness, "both": by_both}


def errors(demonstrations, method):
    """(D,) error in % of the diagonal for each demonstration left out."""
    paths = [evenly_in_time(path) for path, _ in demonstrations]
    diagonal = np.linalg.norm(np.ptp(np.concatenate(paths), axis=0))
    found = [
        method(demonstrations[:left] + demonstrations[left + 1 :], frames)
        for left, (_, frames) in enumerate(demonstrations)
    ]
    return 100 / diagonal * np.array([warped_distance(p, q) for p, q in zip(found, paths, strict=True)])


def run():
    """One row per set and method: set, method, mean_error and max_error in % of the diagonal."""
    if "DOLLOP_EXTERNAL_DATA" not in os.environ:
        raise ValueError("DOLLOP_EXTERNAL_DATA must name the folder that holds moved_objects, but is not set")
    folder = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "moved_objects"
    rows = []
    for name, read in (("options", read_options), ("tpgmm", read_tpgmm)):
        demonstrations = read(folder / name)
        measured = {key: errors(demonstrations, method) for key, method in METHODS.items()}
        table = {key: (found.mean(), found.max()) for key, found in measured.items()} | OTHERS[name]
        rows += [{"set": name, "method": key, "mean_error": m, "max_error": x} for key, (m, x) in table.items()]
    return pd.DataFrame(rows)


if __name__ == "__main__":
    print(run().to_string(index=False, float_format="{:.2f}".format))
