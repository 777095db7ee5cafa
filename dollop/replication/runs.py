"""Measures of a robot's runs, and places to start them from."""

from math import isfinite

import numpy as np

from dollop.robot.avoidance import Geodesic
from dollop.trajectory import distance_to_polyline

__all__ = ["distances_to_law", "free_poses", "return_times"]

HELD = 1.0
"""Time in s for which a kidnapped robot must keep near the response to count as back on it."""


def free_poses(count, obstacles, goal, seed, room=0.05):
    """Poses anywhere on a map from which a robot can go to a goal, for starts and kidnappings.

    Parameters
    ----------
    count : int
    obstacles : ObstacleMap
    goal : (2,) sequence of float
        m.
    seed : int or Generator
    room : float
        Least distance in m between the robot's edge and any obstacle.

    Returns
    -------
    (count, 3) float array
        x, y in m, theta in rad.
    """
    rng, reachable = np.random.default_rng(seed), Geodesic(obstacles, goal)
    low = np.append(obstacles.origin, -np.pi)
    high = np.append(low[:2] + obstacles.resolution * np.array(obstacles.distances.shape[::-1]), np.pi)
    poses = []
    while len(poses) < count:
        x, y, theta = rng.uniform(low, high)
        if obstacles.edge(x, y) > room and isfinite(reachable.distance(x, y)):
            poses.append((x, y, theta))
    return np.array(poses)


def distances_to_law(run, law):
    """Distance in m of every true pose of a run to the law's response from where the run started:
    (N,).
    """
    positions = run.true_poses[:, :2]
    return distance_to_polyline(positions, law.response(positions[0]))


def return_times(run, law, within=0.10):
    """Time in s from each kidnapping until the robot is back on the response from its start, and
    keeps to it.

    Parameters
    ----------
    run : Run
    law : SequencedLDS
    within : float
        Back is within so many m, for one second.

    Returns
    -------
    (M,) float array
        `inf` where it was kidnapped again, or the run ended, before.
    """
    near = np.append(distances_to_law(run, law) <= within, False)
    away = np.flatnonzero(~near)
    rows = np.arange(len(run.t))
    leaves = away[np.searchsorted(away, rows)]  # the row in which the robot, if it is near, no longer is
    back = (leaves - rows) * np.diff(run.t[:2], prepend=0)[-1] >= HELD
    ends = np.append(run.kidnapped[1:], np.inf)
    spans = [back & (run.t >= start) & (run.t < end) for start, end in zip(run.kidnapped, ends, strict=True)]
    return np.array([run.t[s.argmax()] - t if s.any() else np.inf for s, t in zip(spans, run.kidnapped, strict=True)])
