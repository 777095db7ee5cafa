"""Measures of a robot's runs, and places to start them from."""

from itertools import pairwise
from math import isfinite

import numpy as np

from dollop.robot.geodesic import Geodesic
from dollop.trajectory import distance_to_polyline

__all__ = ["distances_to_law", "free_poses", "return_times"]

DRAWS = 10_000
"""Places that are drawn for each pose, at most."""
HELD = 1.0
"""Time in s for which a kidnapped robot must keep near the response to count as back on it."""


def free_poses(count, obstacles, goal, seed, room=0.05):
    """Poses anywhere on a map from which a robot can go to a goal, for starts and kidnappings.

    A reconstruction: the paper does not tell how it chose where to put its robot.

    Parameters
    ----------
    count : int
    obstacles : ObstacleMap
    goal : (2,) sequence of float
        In m.
    seed : int or numpy.random.Generator
    room : float
        Least distance in m between the robot's edge and any obstacle.

    Returns
    -------
    (count, 3) float array
        x, y in m, theta in rad.

    Raises
    ------
    ValueError
        If there are fewer than one such pose in 10,000 draws.
    """
    rng, reachable = np.random.default_rng(seed), Geodesic(obstacles, goal)
    low = np.append(obstacles.origin, -np.pi)
    size = obstacles.resolution * np.array(obstacles.distances.shape[::-1])
    high = np.append(low[:2] + size, np.pi)
    poses, tried = [], 0
    while len(poses) < count:
        tried += 1
        if tried > DRAWS * count:
            raise ValueError(f"the map must have room for a robot, got none in {DRAWS} draws a pose")
        x, y, theta = rng.uniform(low, high)
        if obstacles.edge(x, y) > room and isfinite(reachable.distance(x, y)):
            poses.append((x, y, theta))
    return np.array(poses)


def distances_to_law(run, law, method="held"):
    """How far a robot was from the law's response from where it started (Fig. 7a).

    Parameters
    ----------
    run : Run
    law : SequencedLDS
    method : {"held", "paper"}
        Which response: a robot under the plain law follows every LDS alone, "paper".

    Returns
    -------
    (N,) float array
        Distance of every true pose in m.
    """
    positions = run.true_poses[:, :2]
    return distance_to_polyline(positions, law.response(positions[0], method=method))


def return_times(run, law, within=0.10, method="held"):
    """How soon after each kidnapping the robot is back on the response, and keeps to it (Fig. 7b).

    Parameters
    ----------
    run : Run
    law : SequencedLDS
    within : float
        Back is within so many m of the response from its start, for one second.
    method : {"held", "paper"}
        Which response, as for `distances_to_law`.

    Returns
    -------
    (M,) float array
        In s; `inf` where it was kidnapped again, or the run ended, before.
    """
    away = np.flatnonzero(np.append(distances_to_law(run, law, method) > within, True))
    rows = np.arange(len(run.t))
    leaves = away[np.searchsorted(away, rows)]  # the row in which a robot that is near no longer is
    back = run.t[(leaves - rows) * np.diff(run.t[:2], prepend=0)[-1] >= HELD]
    times = []
    for start, end in pairwise([*run.kidnapped, np.inf]):
        times.append(back[(back >= start) & (back < end)].min(initial=np.inf) - start)
    return np.array(times)
