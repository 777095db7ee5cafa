"""What of a world is in view of the laser, by geometry: the walk, and the objects."""

import numpy as np

from dollop.lab.driving import planned_poses
from dollop.lab.outlines import meeting
from dollop.lab.person import SHOULDERS
from dollop.pose import moved_pose, wrapped

__all__ = ["in_view", "objects_in_view"]

SEEN = 3
"""Beams of a scan that must meet an object for it to be in view."""
MOMENT = 0.2
"""s between the moments at which that is looked at."""


def in_view(scene, walks):
    """Share of the moments of the walk at which the walker's middle is in view of the laser.

    It is in the field of view and in reach, and neither a thing nor somebody else is between. Where
    the robot drives, it is taken to drive as it is meant to.

    Parameters
    ----------
    scene : Scene
    walks : sequence of Walk
        Of its people.

    Returns
    -------
    float
    """
    times, robot = np.arange(0.0, walks[0].t[-1], MOMENT), scene.robot
    poses = planned_poses(robot, times) if robot.way else np.array([robot.pose])
    poses = np.array([moved_pose(pose, robot.laser_ahead, 0.0) for pose in poses])
    user, *others = (np.column_stack([np.interp(times, each.t, axis) for axis in each.positions.T]) for each in walks)
    away = user - poses[:, :2]
    distances, bearings = np.linalg.norm(away, axis=1), np.arctan2(away[:, 1], away[:, 0])
    if robot.way:
        sights = zip(poses, bearings, strict=True)
        free = np.array([meeting(pose[:2], [bearing], scene.section).min() for pose, bearing in sights])
    else:
        free = meeting(poses[0, :2], bearings, scene.section).min(axis=1)
    seen = (free >= distances) & (distances <= robot.scanner.max_range)
    seen &= np.abs(wrapped(bearings - poses[:, 2])) <= np.radians(robot.scanner.fov) / 2
    sight = away / distances[:, None]
    for other in others:
        along = ((other - poses[:, :2]) * sight).sum(axis=1)
        off = np.linalg.norm(other - poses[:, :2] - along[:, None] * sight, axis=1)
        seen &= ~((along > 0) & (along < distances) & (off < SHOULDERS / 2))
    return float(np.mean(seen))


def objects_in_view(scene, pose=None, objects=None):
    """Which objects a laser sees well enough.

    Three beams of a scan or more meet the object first, and half of those or more that would meet it
    if it stood there alone.

    Parameters
    ----------
    scene : Scene
    pose : (3,) float array, optional
        Of the laser; where it is at the beginning when not given.
    objects : sequence of N Object, optional
        In place of the scene's.

    Returns
    -------
    (N,) bool array
    """
    pose = scene.robot.laser_pose if pose is None else pose
    height, scanner = scene.robot.beam_height, scene.robot.scanner
    outlines = [each.outline(height) for each in (scene.objects if objects is None else objects)]
    if not outlines:
        return np.zeros(0, bool)
    turns = np.arange(-np.pi, np.pi, np.radians(scanner.resolution))
    bearings = pose[2] + turns
    within = np.abs(turns) <= np.radians(scanner.fov) / 2
    to_objects = meeting(pose[:2], bearings, outlines)
    others = [part.outline for part in scene.room.parts if part.reaches(height)]
    nearest = np.minimum(meeting(pose[:2], bearings, others).min(axis=1), to_objects.min(axis=1))
    first = (to_objects <= np.minimum(nearest, scanner.max_range)[:, None]) & within[:, None]
    beams, alone = np.count_nonzero(first, axis=0), np.count_nonzero(np.isfinite(to_objects), axis=0)
    return (beams >= SEEN) & (beams >= alone / 2)
