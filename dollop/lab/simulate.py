"""Recording in the laboratory: people watched by a robot that stands or drives, and a tour for the map."""

from dataclasses import replace

import numpy as np
import pandas as pd

from dollop.checks import checked_number, checked_positions, told
from dollop.lab import person
from dollop.lab.driving import ARRIVED, pursue
from dollop.lab.people import walks_of
from dollop.lab.person import check_room
from dollop.lab.pioneer import Pioneer
from dollop.lab.recording import MOVED_COLUMNS, ROBOT_COLUMNS, TRUTH_COLUMNS, Recording
from dollop.lab.rooms import LABORATORY
from dollop.lab.scenes import empty_scene, figure_eight_scene
from dollop.lab.world import World
from dollop.laser import LaserLog
from dollop.pose import moved_pose, wrapped
from dollop.robot.guidance import PIONEER_LIMITS

__all__ = ["record", "record_background", "record_figure_eights", "record_tour", "watch"]

TOUR = np.transpose(
    [
        (4.5, 7.6, 8.1, 7.7, 5.0, 2.4, 1.0, 1.2, 3.2, 5.6, 4.5),
        (2.6, 2.3, 3.6, 4.9, 5.1, 4.9, 3.8, 2.2, 1.6, 1.4, 3.6),
    ]
)
"""Way-points (K, 2) in m of the drive that shows the laser every side of the paper's laboratory."""
PATIENCE = 120.0
"""Time in s within which the robot reaches the next way-point, or never."""
TOUR_LIMITS = PIONEER_LIMITS._replace(turn=1.75)
"""On that drive the robot may turn as fast as it can: 100 deg/s (Player, p2os)."""


def record(scene, seed, walks=None, duration=None):
    """Watch people with the laser of the robot (Sec. II).

    A robot that has somewhere to drive drives there meanwhile; what the log then has of its poses is
    its odometry, and the true ones are part of the truth.

    Parameters
    ----------
    scene : Scene
    seed : int or numpy.random.Generator
        For the errors of laser and odometry.
    walks : sequence of Walk, optional
        Of the people; the scene's own when not given.
    duration : float, optional
        In s; as long as the first walk when not given.

    Returns
    -------
    Recording

    Raises
    ------
    ValueError
        If nobody walks and no duration is given, or as `dollop.lab.people.walks_of`.
    """
    walks = walks_of(scene) if walks is None else tuple(walks)
    if duration is None and (not walks or len(walks[0].t) < 3):
        raise ValueError("a recording needs a first person who walks, or a duration, got neither")
    if duration is not None:
        checked_number("duration", duration, 0.0, 86_400)
    for walk in walks:
        check_room(walk.positions, scene)
    rng, scanner = np.random.default_rng(seed), scene.robot.scanner
    t = np.arange(0.0, walks[0].t[-1] if duration is None else duration, 1 / scanner.rate)
    with World(scene, walks) as world:
        observer = Driving(world, rng) if scene.robot.way else Standing(scene.robot)
        ranges, poses, true_poses = [], [], []
        for time in t:
            world.at(time)
            poses.append(observer.pose)
            true_poses.append(observer.true_pose)
            ranges.append(world.scan(true_poses[-1], rng))
            observer.go_on()
    log = LaserLog(t, np.array(ranges), scanner.angles, np.array(poses), scanner.max_range)
    return Recording(log, truth_of(scene, walks, t, np.array(true_poses)), scene)


class Standing:
    """A robot that stands where it is, and knows it."""

    def __init__(self, robot):
        self.pose = self.true_pose = robot.laser_pose

    def go_on(self):
        """Nothing happens."""


class Driving:
    """A Pioneer that drives along its way, and believes its wheels; poses are those of its laser."""

    def __init__(self, world, rng):
        self._robot = Pioneer(world, world.scene.robot.pose, seed=rng.spawn(1)[0], limits=TOUR_LIMITS)
        self._told, self._goals = world.scene.robot, list(world.scene.robot.way)

    @property
    def pose(self):
        """(3,) where odometry has the laser."""
        return moved_pose(self._robot.odometry, self._told.laser_ahead, 0.0)

    @property
    def true_pose(self):
        """(3,) where the laser is."""
        return self._robot.laser_pose

    def go_on(self):
        """Drive for one scan, and stand at the end of the way."""
        believed = self._robot.odometry
        while self._goals and np.linalg.norm(self._goals[0] - believed[:2]) < ARRIVED:
            self._goals.pop(0)
        command = pursue(believed, self._goals[0], self._told.speed) if self._goals else (0.0, 0.0)
        self._robot.drive(*command)


def truth_of(scene, walks, t, true_poses):
    """Where everybody and everything that moves was at each scan, as the columns of a Recording's truth."""
    columns = {"t": t} if walks or scene.moves or scene.robot.way else {}
    for k, walk in enumerate(walks):
        x, y, heading = np.transpose([(*walk.at(time)[0], wrapped(walk.at(time)[1])) for time in t])
        names = TRUTH_COLUMNS[1:] if k == 0 else [f"{name}_{k}" for name in TRUTH_COLUMNS[1:]]
        columns |= dict(zip(names, (x, y, heading), strict=True))
    for k in sorted({move.object for move in scene.moves}):
        places = np.transpose([scene.object_at(k, time) for time in t])
        columns |= dict(zip((f"{name}_{k}" for name in MOVED_COLUMNS), places, strict=True))
    if scene.robot.way:
        columns |= dict(zip(ROBOT_COLUMNS, true_poses.T, strict=True))
    return pd.DataFrame(columns or {name: [] for name in TRUTH_COLUMNS}, dtype=float)


def watch(scene, seed, duration=6.0):
    """What the standing robot's laser sees of a scene in which nobody walks (Sec. IV).

    Parameters
    ----------
    scene : Scene
    seed : int or numpy.random.Generator
        For the laser's noise.
    duration : float
        s.

    Returns
    -------
    Recording
        Its truth has no rows.
    """
    return record(scene, seed, (), duration)


def record_figure_eights(seed, laps=5, scene=None, scanner=None, **gait):
    """Figure-eights round two trash cans, seen by the laser (Fig. 6a).

    A `record` of a `figure_eight`.

    Parameters
    ----------
    seed : int or numpy.random.Generator
    laps : int
    scene : Scene, optional
        `figure_eight_scene()` when not given.
    scanner : Scanner, optional
        In place of the scene's own.
    **gait
        Keywords of `figure_eight` and `walk`.

    Returns
    -------
    Recording
    """
    scene = scene or figure_eight_scene()
    if scanner is not None:
        scene = replace(scene, robot=replace(scene.robot, scanner=scanner))
    walking, sensing = np.random.default_rng(seed).spawn(2)
    return record(scene, sensing, [person.figure_eight(scene, walking, laps, **gait)])


def record_background(seed, scanner=None, scene=None, tour=None):
    """Drive through the empty laboratory and log the laser with true poses, for a map (Sec. II).

    The paper's robot mapped its laboratory by CARMEN; here the poses are known.

    Parameters
    ----------
    seed : int or numpy.random.Generator
        For the laser's noise.
    scanner : Scanner, optional
        In place of the scene's own.
    scene : Scene, optional
        Of another room.
    tour : (K, 2) array_like, optional
        Way-points in m, straight lines between which are free; of another room they must be given.

    Returns
    -------
    LaserLog

    Raises
    ------
    ValueError
        If a scene of another room comes without a tour, or a way-point is not reached.
    """
    if tour is None:
        if scene is not None and scene.room is not LABORATORY:
            raise ValueError("another room needs a tour of its own, got none")
        tour = TOUR
    scene, rng = scene or empty_scene(), np.random.default_rng(seed)
    scanner = scanner or scene.robot.scanner
    poses, ranges = [], []
    with World(scene) as world:
        robot = Pioneer(world, scene.robot.pose, limits=TOUR_LIMITS, scanner=scanner)
        for goal in checked_positions("tour", tour):
            begun = len(poses)
            while np.linalg.norm(goal - robot.pose[:2]) > ARRIVED:
                if len(poses) - begun > PATIENCE * scanner.rate:
                    told = f"got {goal.tolist()}, not reached within {PATIENCE:g} s"
                    raise ValueError(f"the places of a tour must be free and the way to them as well, {told}")
                poses.append(robot.laser_pose)
                ranges.append(world.scan(poses[-1], rng, scanner))
                robot.drive(*pursue(robot.pose, goal))
    t = np.arange(len(poses)) / scanner.rate
    return LaserLog(t, np.array(ranges), scanner.angles, np.array(poses), scanner.max_range)


def record_tour(scene, places, seed, stride=0.15, turns=12):
    """Scans along a way through a scene, the laser turned once round at every place, with true poses.

    For a map of any room, where `record_background` drives through the paper's; how the robot got
    from pose to pose is left out, as it is from a log that has been thinned.

    Parameters
    ----------
    scene : Scene
    places : (K, 2) array_like
        In m; straight lines between them are driven.
    seed : int or numpy.random.Generator
        For the laser's noise.
    stride : float
        Distance in m between scans on the way.
    turns : int
        Scans at every place.

    Returns
    -------
    LaserLog
    """
    rng, scanner = np.random.default_rng(seed), scene.robot.scanner
    places = checked_positions("places", places)
    checked_number("stride", stride, 0.01)
    checked_number("turns", turns, 1)
    if not len(places) or not (scene.room.distance(places) > 0).all():
        raise ValueError(f"the places of a tour must be in the room and free, got {told(places.tolist())}")
    poses = [(*places[0], theta) for theta in np.arange(turns) * 2 * np.pi / turns]
    for begin, end in zip(places[:-1], places[1:], strict=True):
        heading = np.arctan2(*(end - begin)[::-1])
        count = max(1, round(np.linalg.norm(end - begin) / stride))
        poses += [(*(begin + share * (end - begin)), heading) for share in np.arange(1, count) / count]
        poses += [(*end, heading + theta) for theta in np.arange(turns) * 2 * np.pi / turns]
    with World(scene) as world:
        ranges = [world.scan(pose, rng) for pose in poses]
    t = np.arange(len(poses)) / scanner.rate
    return LaserLog(t, np.array(ranges), scanner.angles, np.array(poses), scanner.max_range)
