"""Kidnappings drawn at random: when, and to which free place within reach."""

import numpy as np
import scipy

from dollop.gridmap import in_metres
from dollop.robot import ObstacleMap

__all__ = ["draw_kidnappings", "reachable"]

ROOM = 0.1
"""m between the robot's edge and all that stands there, where it is put and on its way."""


def draw_kidnappings(count, seconds, period, task, background, start, radius, seed):
    """Times and poses at which a robot is put somewhere else, each in a control period of its own.

    Parameters
    ----------
    count : int
    seconds : float
        How long the run is that is disturbed.
    period : float
        Of the control loop in s: of two kidnappings within one, the first would never be noticed.
    task : Task
        Its objects are obstacles.
    background : OccupancyGrid
    start : (2,) sequence of float
        From where the places can be reached, in m.
    radius : float
        Of the robot, in m.
    seed : int

    Returns
    -------
    list of (float, (float, float, float))
        In the order of time: s, and x, y in m, theta in rad.

    Raises
    ------
    ValueError
        If there is no such place, or the run has fewer periods than that.
    """
    most = round(seconds / period) + 1
    if count > most:
        raise ValueError(f"--kidnap must be at most {most} for a run of {seconds:.1f} s, got {count}")
    left = max(seconds - (count - 1) * period, 0.0)
    rng = np.random.default_rng(seed)
    places = reachable(ObstacleMap.of(task.environment, background, radius=radius), start)
    if not len(places):
        rule = f"a robot of {radius:g} m radius must have {ROOM:g} m of room somewhere"
        raise ValueError(f"{rule} that it can drive to, to be kidnapped there")
    chosen = places[rng.integers(len(places), size=count)]
    poses = np.column_stack([chosen, rng.uniform(-np.pi, np.pi, count)])
    times = np.sort(rng.uniform(0, left, count)) + period * np.arange(count)
    return list(zip(times.tolist(), map(tuple, poses.tolist()), strict=True))


def reachable(obstacles, start):
    """Middles of the free cells that hang together with the one nearest to a place.

    Parameters
    ----------
    obstacles : ObstacleMap
    start : (2,) sequence of float
        In m.

    Returns
    -------
    (N, 2) float array
        In m.
    """
    free = obstacles.distances - obstacles.radius > ROOM
    if not free.any():
        return np.empty((0, 2))
    parts, _ = scipy.ndimage.label(free)
    rows, columns = np.nonzero(free)
    x, y = in_metres(columns + 0.5, rows + 0.5, obstacles.origin, obstacles.resolution)
    nearest = np.hypot(x - start[0], y - start[1]).argmin()
    here = parts[rows, columns] == parts[rows[nearest], columns[nearest]]
    return np.column_stack([x, y])[here]
