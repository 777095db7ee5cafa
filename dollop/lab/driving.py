"""Driving from place to place: towards the next one, slower where it is aside. Nothing here needs PyBullet."""

import numpy as np

from dollop.pose import moved_pose, wrapped
from dollop.sequenced_lds import check_times

__all__ = ["ARRIVED", "planned_poses", "pursue"]

ARRIVED = 0.3
"""Distance in m from a way-point at which the next one is driven to."""
STEP = 0.05


def pursue(pose, goal, speed=0.5, gain=1.5):
    """Speed and turning rate towards a goal, slower where it is aside.

    Parameters
    ----------
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    goal : (2,) sequence of float
        In m.
    speed : float
        In m/s.
    gain : float
        Turning rate in rad/s per rad of error.

    Returns
    -------
    speed, turn : float
        In m/s and rad/s.
    """
    x, y, theta = pose
    error = wrapped(np.arctan2(goal[1] - y, goal[0] - x) - theta)
    return speed * max(np.cos(error), 0.0) ** 2, gain * error


def planned_poses(robot, t):
    """Where a robot that drives along its way is meant to be; it will be near.

    Parameters
    ----------
    robot : Robot
    t : (N,) float array
        In s from 0, increasing.

    Returns
    -------
    (N, 3) float array
        x, y in m, theta in rad.

    Raises
    ------
    ValueError
        If it takes more than a million steps of 0.05 s.

    Examples
    --------
    >>> from dollop.lab.things import Robot
    >>> planned_poses(Robot((0.0, 0.0, 0.0), way=[(1.3, 0.0)], speed=0.5), [0.0, 1.0, 9.0]).round(2).tolist()
    [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]
    """
    check_times(t[-1], STEP)
    goals, pose, poses = list(robot.way), np.array(robot.pose), []
    for _ in np.arange(0.0, t[-1] + STEP, STEP):
        poses.append(pose)
        while goals and np.linalg.norm(goals[0] - pose[:2]) <= ARRIVED:
            goals.pop(0)
        speed, turn = pursue(pose, goals[0], robot.speed) if goals else (0.0, 0.0)
        pose = moved_pose(pose, speed * STEP, turn * STEP)
    return np.array(poses)[np.round(np.asarray(t) / STEP).astype(int)]
