"""Observing the user: from a log and a background map to tracks, user and environment (Fig. 4)."""

from dataclasses import dataclass

import numpy as np

from dollop.checks import check_positive
from dollop.environment import Environment
from dollop.foreground import ForegroundGrid, bounding_boxes, endpoints, foreground_mask, seen_free, surface_points
from dollop.gridmap import flat_cells
from dollop.tracking import Track, Tracker, identify_user, track_objects, user_track

__all__ = ["STATIC_EVERY", "Observation", "foreground_hits", "observe", "static_boxes"]

STATIC_EVERY = 5
"""The slow grid looks at every fifth scan: what is static is still there then."""


@dataclass(frozen=True)
class Observation:
    """What Dollop has seen (Sec. II).

    Attributes
    ----------
    tracks : tuple of Track
        Every foreground object, as tracked from scan to scan.
    user : Track or None
        The user's trajectory, joined over losses and smoothed; None if nobody moved.
    environment : Environment
        Boxes of the static foreground objects.
    losses : int
        How often the user was lost and found again as another track.
    """

    tracks: tuple
    user: Track
    environment: Environment
    losses: int

    def __repr__(self):
        return f"Observation of {len(self.tracks)} tracks; user: {self.user}; {self.environment}"


def observe(
    log, background, background_radius=0.20, gain=0.6, static_gain=0.1, min_area=0.01, stride=0.0, tracker=None, seed=0
):
    """Observe a demonstration with the laser (Sec. II).

    Parameters
    ----------
    log : LaserLog
        The scans.
    background : OccupancyGrid
        The background occupancy grid map of the workspace; it must cover the scans.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).
    gain, static_gain : float
        Autoregressive gain of the foreground grid that is tracked, per scan, and of the slow one
        that remembers static objects, per fifth scan: a walker wants no tail, a trash can wants
        patience.
    min_area : float
        Smallest foreground object in m^2 (Sec. II: 100 square centimetres).
    stride : float
        Blobs nearer to each other than this, in m, are one object. Zero for a laser at waist
        height, as in the paper; at leg height a walker is two blobs up to half a metre apart.
    tracker : Tracker, optional
        How objects are tracked; the paper's choices by default.
    seed : int or Generator
        Only for particles.

    Returns
    -------
    Observation

    Raises
    ------
    ValueError
        If the map does not cover the scans or a parameter is out of its range.
    """
    check_positive("min_area", min_area, or_zero=True)
    check_positive("stride", stride, or_zero=True)
    tracker = tracker or Tracker()
    moving, static = ForegroundGrid(background, gain), ForegroundGrid(background, static_gain)
    objects = []
    for i, hits in enumerate(foreground_hits(log, background, background_radius)):
        scan = hits, log.poses[i], log.angles, log.ranges[i]
        moving.update(*scan)
        if i % STATIC_EVERY == 0:
            static.update(*scan)
        objects.append(moving.objects(min_area=min_area, stride=stride))

    def visible(i, points):
        return seen_free(points, log.poses[i], log.angles, log.ranges[i])

    tracks = track_objects(log.t, objects, tracker, visible, seed)
    users = identify_user(log.t, tracks)
    user = user_track(log.t, tracks, users, tracker.motion)
    boxes = static_boxes(static, log.poses[-1, :2], user, min_area)
    losses = max(0, np.count_nonzero(np.diff(users, prepend=-1)) - 1)
    return Observation(tracks, user, Environment(boxes), losses)


def foreground_hits(log, background, background_radius=0.20):
    """Foreground cells of every scan (Sec. II).

    Parameters
    ----------
    log : LaserLog
        T scans.
    background : OccupancyGrid
        The background occupancy grid map; it must cover the scans.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).

    Returns
    -------
    list of T int arrays
        Flat indices into the grid of `background`.

    Raises
    ------
    ValueError
        What `dollop.foreground.foreground_mask` refuses.
    """
    points = endpoints(log)
    mask = foreground_mask(points, background, background_radius)
    scan, surface = surface_points(points, mask, spacing=background.resolution)
    grid = background.origin, background.resolution, background.occupancy.shape
    cells, inside = flat_cells(surface, *grid)
    return np.split(cells, np.searchsorted(scan[inside], np.arange(1, len(log.t))))


def static_boxes(grid, sensor, user=None, min_area=0.01, recent=1.0):
    """Boxes of the static foreground objects in the slow foreground grid (Sec. IV).

    A laser sees the near side only, and a trash can would be half as deep as it is wide. Each box
    is completed away from the sensor to be at least as deep along the line of sight as it is wide
    across it (a reconstruction).

    Parameters
    ----------
    grid : ForegroundGrid
        The slow grid after the last scan.
    sensor : (2,) float array
        Where the objects were seen from, in m.
    user : Track, optional
        Blobs where the user stood in the last `recent` seconds are the user, not objects.
    min_area : float
        m^2.
    recent : float
        s.

    Returns
    -------
    (N, 4) float array
        xmin, ymin, xmax, ymax in m.
    """
    blobs = grid.blobs(min_area=min_area)
    boxes = bounding_boxes(blobs, grid.origin, grid.resolution)
    for k in range(len(blobs)):
        cells = blobs.cells[blobs.labels == k]
        seen = grid.centres(cells @ [grid.shape[1], 1])
        boxes[k] = completed(boxes[k], seen, sensor, grid.resolution)
    if user is None:
        return boxes
    last = user.positions[user.t > user.t[-1] - recent, None]
    low, high = boxes[:, :2] - grid.resolution, boxes[:, 2:] + grid.resolution
    return boxes[~((low <= last) & (last <= high)).all(axis=2).any(axis=0)]


def completed(box, seen, sensor, resolution):
    """Extend `box` (4,) to be as deep along the line of sight as its cells are wide across it.

    `seen` (M, 2) are the centres of the cells, `sensor` (2,) is the laser's place, in m.
    """
    sight = seen.mean(axis=0) - sensor
    sight = sight / np.hypot(*sight)
    aside = np.array([-sight[1], sight[0]])
    along, across = (seen - sensor) @ sight, (seen - sensor) @ aside
    half = (np.ptp(across) + resolution) / 2
    depth = along.min() - resolution / 2 + half
    centre = sensor + depth * sight + (across.min() + across.max()) / 2 * aside
    return np.concatenate([np.minimum(box[:2], centre - half), np.maximum(box[2:], centre + half)])
