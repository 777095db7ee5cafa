"""Recording in the simulated laboratory: a person watched by a standing robot, and a tour for the background map."""

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

TOUR = (
    (4.5, 2.6),
    (7.6, 2.3),
    (8.1, 3.6),
    (7.7, 4.9),
    (5.0, 5.1),
    (2.4, 4.9),
    (1.0, 3.8),
    (1.2, 2.2),
    (3.2, 1.6),
    (5.6, 1.4),
    (4.5, 3.6),
)
"""Way-points in m of the drive that shows the laser every side of the background."""
TOUR_LIMITS = PIONEER_LIMITS._replace(turn=1.75)
"""On that drive the robot may turn as fast as it can: 100 deg/s (Player, p2os)."""


def record(scene, walk, seed, sick=None, legs=False):
    """Watch a walk with the laser of the standing robot.

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
    t = np.arange(0.0, walk.t[-1], 1 / sick.rate)
    pose = laser_pose(scene.robot)
    states = [walk.at(time) for time in t]
    with World(scene, legs) as world:
        ranges = []
        for state in states:
            world.place_person(*state)
            ranges.append(sick.scan(world, pose, rng))
    log = LaserLog(t, np.array(ranges), sick.angles, np.tile(pose, (len(t), 1)), sick.max_range)
    rows = [(time, *position, wrapped(heading)) for time, (position, heading, _) in zip(t, states, strict=True)]
    return Recording(log, pd.DataFrame(rows, columns=TRUTH_COLUMNS), scene)


def watch(scene, seed, duration=6.0, sick=None):
    """What the standing robot's laser sees of a scene in which nobody walks.

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
        ranges = np.array([sick.scan(world, pose, rng) for _ in t])
    log = LaserLog(t, ranges, sick.angles, np.tile(pose, (len(t), 1)), sick.max_range)
    return Recording(log, pd.DataFrame(columns=TRUTH_COLUMNS), scene)


def record_figure_eights(seed, laps=5, scene=None, sick=None, legs=False, **gait):
    """Five figure-eights round two trash cans, seen by the laser (Fig. 6a): a `record` of `person.figure_eight`.

    Parameters
    ----------
    seed : int
    laps : int
    scene : Scene, optional
        `figure_eight_scene()` when not given.
    sick, legs
        As for `record`.
    **gait
        Keywords of `person.figure_eight` and `person.walk`.

    Returns
    -------
    Recording
    """
    scene = scene or figure_eight_scene()
    walking, sensing = np.random.default_rng(seed).spawn(2)
    return record(scene, person.figure_eight(scene, walking, laps, **gait), sensing, sick, legs)


def record_background(seed, sick=None):
    """Drive the robot through the empty laboratory and log the laser with true poses, for a background map.

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
        for goal in np.asarray(TOUR):
            while np.linalg.norm(goal - robot.pose[:2]) > 0.3:
                poses.append(laser_pose(robot.pose))
                ranges.append(sick.scan(world, poses[-1], rng))
                robot.drive(*pursue(robot.pose, goal))
    t = np.arange(len(poses)) / sick.rate
    return LaserLog(t, np.array(ranges), sick.angles, np.array(poses), sick.max_range)


def pursue(pose, goal, speed=0.5, gain=1.5):
    """Speed in m/s and turning rate in rad/s towards a goal (2,), slower the farther it lies off the heading."""
    x, y, theta = pose
    error = wrapped(np.arctan2(goal[1] - y, goal[0] - x) - theta)
    return speed * max(np.cos(error), 0.0) ** 2, gain * error
