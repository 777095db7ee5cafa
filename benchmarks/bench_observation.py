"""Observing: scans per second on the five figure-eights, beside a plain version of the paper's way on whole grids.

python -m benchmarks observation
"""

from pathlib import Path

import numpy as np
from scipy import ndimage

from benchmarks.timing import row, seconds
from dollop import Observer, OccupancyGrid, observe
from dollop.foreground import seen_free
from dollop.lab import Recording
from dollop.observation import foreground_hits
from dollop.tracking import identify_user, track_objects, user_track

DATA = Path(__file__).parents[1] / "data"


def plain_observe(log, background, gains=(0.6, 0.1)):
    """The same stages with every cell of both grids visited in every scan."""
    shape = background.occupancy.shape
    rows, columns = np.indices(shape)
    offset = background.resolution * (np.column_stack([columns.ravel(), rows.ravel()]) + 0.5)
    centres = np.asarray(background.origin) + offset
    grids, objects = [np.zeros(rows.size) for _ in gains], []
    for i, hits in enumerate(foreground_hits(log, background)):
        hit = np.zeros(rows.size, bool)
        hit[hits] = True
        touched = hit | seen_free(centres, log.poses[i], log.angles, log.ranges[i], background.resolution)
        for grid, gain in zip(grids, gains, strict=True):
            grid[touched] += gain * (hit[touched] - grid[touched])
        labels, count = ndimage.label(grids[0].reshape(shape) > 0.5, np.ones((3, 3)))
        sizes, seen = (
            ndimage.sum_labels(cells, labels, np.arange(1, count + 1)) for cells in (np.ones(shape), hit.reshape(shape))
        )
        large = 1 + np.flatnonzero((sizes >= 4) & (seen > 0))
        found = ndimage.center_of_mass(hit.reshape(shape), labels, large) if len(large) else []
        objects.append(background.origin + background.resolution * (np.array(found).reshape(-1, 2)[:, ::-1] + 0.5))
    tracks = track_objects(log.t, objects)
    return user_track(log.t, tracks, identify_user(log.t, tracks))


def run(repeats=7):
    """Time `observe` on the recording in data/.

    Returns
    -------
    list of dict
        Seconds for the whole log; the bounds are 5,000 scans/s, 0.3 ms a scan, and 2,000 scans/s.
    """
    log = Recording.load(DATA / "figure_eights.log.gz").log
    background = OccupancyGrid.load(DATA / "lab.yaml")
    background.distance_field()
    fast, _ = seconds(lambda: observe(log, background), repeats)
    streamed, _ = seconds(lambda: step_by_step(log, background), repeats)
    paper, observation = seconds(lambda: observe(log, background, method="paper"), repeats)
    plain, user = seconds(lambda: plain_observe(log, background), 3)
    apart = np.abs(observation.user.positions - user.positions).max()
    assert apart < 0.05, f"both versions must see the same walk, but they are {apart:.3f} m apart"
    scans = len(log)
    return [
        row(f"observe, {scans} scans ({scans / fast:.0f} scans/s)", fast, plain, scans / 5000),
        row(f"Observer.step ({1e3 * streamed / scans:.3f} ms a scan)", streamed, plain, scans * 0.3e-3),
        row(f"observe, the paper's way ({scans / paper:.0f} scans/s)", paper, plain, scans / 2000),
    ]


def step_by_step(log, background):
    """The log, one scan at a time."""
    observer = Observer(background, log.angles)
    for scan in zip(log.t, log.ranges, log.poses, strict=True):
        observer.step(*scan)
    return observer.observation()
