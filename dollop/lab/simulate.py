"""Recording in the laboratory: a person watched by a standing robot, and a tour for the map."""

import numpy as np
import pandas as pd

from dollop.lab import person
from dollop.lab.pioneer import Pioneer, laser_pose
from dollop.lab.recording import TRUTH_COLUMNS, Recording
from dollop.lab.scenes import empty_scene, figure_eight_scene
from dollop.lab.sick import SickLMS200
from dollop.lab.world import World
from dollop.laser import LaserLog
from dollop.pose import wrapped
from dollop.robot.control import PIONEER_LIMITS

__all__ = ["record", "record_background", "record_figure_eights", "watch"]

TOUR = np.transpose(
    [
        (4.5, 7.6, 8.1, 7.7, 5.0, 2.4, 1.0, 1.2, 3.2, 5.6, 4.5),
        (2.6, 2.3, 3.6, 4.9, 5.1, 4.9, 3.8, 2.2, 1.6, 1.4, 3.6),
    ]
)
"""Way-points (K, 2) in m of the drive that shows the laser every side of the background."""
TOUR_LIMITS = PIONEER_LIMITS._replace(turn=1.75)
"""On that drive the robot may turn as fast as it can: 100 deg/s (Player, p2os)."""


def record(scene, walk, seed, sick=None, legs=False):
    """Watch a walk with the laser of the standing robot (Sec. II).

    Parameters
    ----------
    scene : Scene
    walk : Walk
    seed : int or numpy.random.Generator
        For the laser's noise.
    sick : SickLMS200, optional
        The laser, in its default mode when not given.
    legs : bool
        Whether the laser meets two striding legs instead of a torso.

    Returns
    -------
    Recording
    """
    sick, rng = sick or SickLMS200(), np.random.default_rng(seed)
    t, pose = np.arange(0.0, walk.t[-1], 1 / sick.rate), laser_pose(scene.robot)
    states = [walk.at(time) for time in t]
    ranges, rows = [], []
    with World(scene, legs) as world:
        for time, (position, heading, phase) in zip(t, states, strict=True):
            world.place_person(position, heading, phase)
            ranges.append(sick.scan(world, pose, rng))
            rows.append((time, *position, wrapped(heading)))
    return as_recording(t, ranges, sick, rows, scene)


def watch(scene, seed, duration=6.0, sick=None):
    """What the standing robot's laser sees of a scene in which nobody walks (Sec. IV).

    Parameters
    ----------
    scene : Scene
    seed : int or numpy.random.Generator
        For the laser's noise.
    duration : float
        s.
    sick : SickLMS200, optional

    Returns
    -------
    Recording
        Its truth has no rows.
    """
    sick, rng = sick or SickLMS200(), np.random.default_rng(seed)
    t, pose = np.arange(0.0, duration, 1 / sick.rate), laser_pose(scene.robot)
    with World(scene) as world:
        ranges = [sick.scan(world, pose, rng) for _ in t]
    return as_recording(t, ranges, sick, [], scene)


def as_recording(t, ranges, sick, rows, scene):
    """The scans (T, B) of the standing robot and the rows of the truth, as a Recording."""
    poses = np.tile(laser_pose(scene.robot), (len(t), 1))
    log = LaserLog(t, np.array(ranges), sick.angles, poses, sick.max_range)
    return Recording(log, pd.DataFrame(rows, columns=TRUTH_COLUMNS), scene)


def record_figure_eights(seed, laps=5, scene=None, sick=None, legs=False, **gait):
    """Figure-eights round two trash cans, seen by the laser (Fig. 6a).

    A `record` of a `figure_eight`.

    Parameters
    ----------
    seed : int or numpy.random.Generator
    laps : int
    scene : Scene, optional
        `figure_eight_scene()` when not given.
    sick : SickLMS200, optional
    legs : bool
        As for `record`.
    **gait
        Keywords of `figure_eight` and `walk`.

    Returns
    -------
    Recording
    """
    scene = scene or figure_eight_scene()
    walking, sensing = np.random.default_rng(seed).spawn(2)
    walk = person.figure_eight(scene, walking, laps, **gait)
    return record(scene, walk, sensing, sick, legs)


def record_background(seed, sick=None):
    """Drive through the empty laboratory and log the laser with true poses, for a map (Sec. II).

    The paper's robot mapped its laboratory by CARMEN; here the poses are known.

    Parameters
    ----------
    seed : int or numpy.random.Generator
        For the laser's noise.
    sick : SickLMS200, optional

    Returns
    -------
    LaserLog
    """
    sick, rng = sick or SickLMS200(), np.random.default_rng(seed)
    scene = empty_scene()
    poses, ranges = [], []
    with World(scene) as world:
        robot = Pioneer(world, scene.robot, limits=TOUR_LIMITS, sick=sick)
        for goal in TOUR:
            while np.linalg.norm(goal - robot.pose[:2]) > 0.3:
                poses.append(laser_pose(robot.pose))
                ranges.append(sick.scan(world, poses[-1], rng))
                robot.drive(*pursue(robot.pose, goal))
    t = np.arange(len(poses)) / sick.rate
    return LaserLog(t, np.array(ranges), sick.angles, np.array(poses), sick.max_range)


def pursue(pose, goal, speed=0.5, gain=1.5):
    """Speed in m/s and turning rate in rad/s towards a goal (2,), slower where it is aside."""
    x, y, theta = pose
    error = wrapped(np.arctan2(goal[1] - y, goal[0] - x) - theta)
    return speed * max(np.cos(error), 0.0) ** 2, gain * error
