"""A lesson: what stands in the room, what was shown, and what the robot made of it.

A lesson is never altered. What is done in it (an object put down, a walk shown) makes the next one,
or is refused with the place where it cannot be; the lesson before is there as it was.
"""

from collections import namedtuple
from dataclasses import dataclass, field, replace
from importlib.util import find_spec

import numpy as np

from dollop import lab
from dollop.environment import Environment
from dollop.foreground import endpoints
from dollop.gridmap import OccupancyGrid
from dollop.lab.outlines import outline_distances
from dollop.lab.person import DEPTH, SHOULDERS, walk
from dollop.lab.scenes import Scene, figure_eight_scene
from dollop.lab.things import Object
from dollop.laser import LaserLog
from dollop.observation import Observer, observe
from dollop.robot.controller import Controller
from dollop.robot.performing import Unicycle
from dollop.task import Demonstration, learn
from dollop.trajectory import arc_length, resample

__all__ = [
    "KINDS", "Lesson", "Refused", "Sight", "driving", "has_laboratory", "seen_points", "walking",
]  # fmt: skip

SHORTEST = 1.5
"""m: who goes less far has shown nothing."""
CLOSE = 0.05
"""m between the places of a drawn walk that are looked at: no wall is thinner."""
VIA = 0.5
"""m between the via-points that the person passes: what is finer is the hand's trembling."""
FROM_BACKGROUND = 0.25
"""m between shoulder and background: nearer, the laser takes the person for the wall (Sec. II)."""
ROBOT = 0.35
"""m round the middle of the robot that are free where it is put down."""
MOST = 8
"""Objects in the room."""
KINDS = {"can": Object.trash_can, "cone": Object.cone}
"""What can be put down: each from the place (2,) of its middle in m."""
RATE = 10.0
"""Positions a second that a walk tells of where no laser sees it."""


class Refused(ValueError):
    """What cannot be done, and where.

    Attributes
    ----------
    place : (2,) float array
        In m.
    """

    def __init__(self, message, place):
        super().__init__(message)
        self.place = np.array(place, dtype=float)


def has_laboratory():
    """Whether there is a laboratory to simulate: PyBullet is installed.

    Returns
    -------
    bool
    """
    return find_spec("pybullet") is not None


@dataclass(frozen=True, eq=False)
class Lesson:
    """What stands in a room, what was shown in it, and what the robot made of that.

    Where there is no PyBullet, nothing is seen by a laser: the robot is told where objects stand and
    how the person walked.

    Attributes
    ----------
    background : OccupancyGrid
    scene : Scene
        What truly stands where.
    seen : Environment
        The objects as the robot's laser sees them.
    demonstrations : tuple of Demonstration
        The walks shown so far, each among the objects as they stood.
    task : Task or None
        What was learned from them, among the objects as they are seen now; None before any walk.
    foretold : tuple of float
        For each walk after the first, how far the task that was learned from those before it would
        have been from it, mean distance in m.
    """

    background: OccupancyGrid
    scene: Scene
    seen: Environment
    demonstrations: tuple = ()
    task: object = None
    foretold: tuple = field(default=())

    @classmethod
    def begin(cls, background, scene=None):
        """A lesson before anything is shown: the robot looks about.

        Parameters
        ----------
        background : OccupancyGrid
        scene : Scene, optional
            Two trash cans when not given.

        Returns
        -------
        Lesson
        """
        scene = scene or figure_eight_scene()
        return cls(background, scene, look(scene, background))

    @property
    def doubts(self):
        """What is in doubt of the task, in words, a tuple."""
        return tuple(str(note) for note in self.task.notes) if self.task else ()

    def nearest(self, place, within=0.35):
        """Which object stands at a place.

        Parameters
        ----------
        place : (2,) sequence of float
            In m.
        within : float
            Of its middle, in m.

        Returns
        -------
        int or None
        """
        if not self.scene.objects:
            return None
        away = np.linalg.norm(self.scene.positions - place, axis=1)
        return int(away.argmin()) if away.min() <= within else None

    def has_room(self, place):
        """Whether the robot can be put down at a place.

        Parameters
        ----------
        place : (2,) sequence of float
            In m.

        Returns
        -------
        bool
        """
        free = self.scene.room.distance([place])[0] >= ROBOT
        return bool(free) and self.nearest(place, 2 * ROBOT) is None

    # ---- objects

    def put(self, kind, place):
        """Put one object more into the room.

        Parameters
        ----------
        kind : str
            A key of `KINDS`.
        place : (2,) sequence of float
            In m.

        Returns
        -------
        Lesson

        Raises
        ------
        Refused
            Where it cannot stand, or if there are eight.
        """
        if len(self.scene.objects) >= MOST:
            raise Refused(f"no more than {MOST} objects", place)
        return self._among((*self.scene.objects, KINDS[kind](place)), place)

    def moved(self, k, place):
        """Move an object.

        Parameters
        ----------
        k : int
            Which of the scene.
        place : (2,) sequence of float
            In m.

        Returns
        -------
        Lesson

        Raises
        ------
        Refused
            Where it cannot stand.
        """
        objects = list(self.scene.objects)
        objects[k] = objects[k].at(place)
        return self._among(objects, place)

    def without(self, k):
        """Take an object away.

        Parameters
        ----------
        k : int
            Which of the scene.

        Returns
        -------
        Lesson

        Raises
        ------
        Refused
            If the task hangs on what is left of nothing.
        """
        objects = list(self.scene.objects)
        gone = objects.pop(k)
        return self._among(objects, gone.position)

    def free(self, k, place):
        """Refuse a place where an object cannot stand, without looking or learning.

        Parameters
        ----------
        k : int
            Which object of the scene.
        place : (2,) sequence of float
            In m.

        Raises
        ------
        Refused
        """
        objects = list(self.scene.objects)
        objects[k] = objects[k].at(place)
        arranged(self.scene, objects, place)

    def _among(self, objects, place):
        """The lesson among other objects: the robot looks again, and adapts what it has learned."""
        scene = arranged(self.scene, objects, place)
        seen = look(scene, self.background)
        try:
            task = self.task and self.task.adapt(seen)
        except ValueError as error:
            raise Refused(f"the robot cannot tell which object is which: {error}", place) from None
        return replace(self, scene=scene, seen=seen, task=task)

    # ---- walks

    def walk(self, points):
        """The person's walk along a line that was drawn.

        Parameters
        ----------
        points : (N, 2) array_like
            In m.

        Returns
        -------
        Walk
            Smooth, as people walk.

        Raises
        ------
        Refused
            A line that leaves the room, leads through or too near to a wall, furniture, an object or
            the robot, or is too short.
        """
        points = np.asarray(points, dtype=float).reshape(-1, 2)
        length = arc_length(points)[-1] if len(points) > 1 else 0.0
        if length < SHORTEST:
            rule = f"too short: a walk is {SHORTEST} m long or more"
            raise Refused(f"{rule}, this one {length:.1f} m", points[-1])
        check_way(resample(points, int(length / CLOSE) + 2), self.scene)
        via = resample(points, max(3, round(length / VIA) + 1))
        try:
            return walk(via, self.scene, len(self.demonstrations), from_background=FROM_BACKGROUND)
        except ValueError as error:
            raise Refused(f"nobody can walk that: {error}", points[len(points) // 2]) from None

    def shown(self, observation):
        """The lesson after a walk was seen: the robot learns from all walks together.

        Parameters
        ----------
        observation : Observation or Demonstration

        Returns
        -------
        Lesson

        Raises
        ------
        ValueError
            If nobody was seen, or nothing can be learned.
        """
        new = observation
        if not isinstance(new, Demonstration):
            new = Demonstration.of(observation)
        demonstrations = (*self.demonstrations, new)
        task = learn(demonstrations, new.environment).adapt(self.seen)
        foretold = self.foretold
        if self.task:
            before = self.task.adapt(new.environment)
            foretold = (*foretold, float(np.mean([before.law.error(each) for each in new.walks])))
        return replace(self, demonstrations=demonstrations, task=task, foretold=foretold)

    def taught(self, points):
        """The lesson after a walk along a drawn line, with nobody looking on.

        Parameters
        ----------
        points : (N, 2) array_like
            In m.

        Returns
        -------
        Lesson

        Raises
        ------
        ValueError
            As `walk` and `shown`.
        """
        return self.shown(followed(walking(self, self.walk(points), len(self.demonstrations))))

    def performed(self, start=None):
        """The run of a robot that performs the task, with nobody looking on.

        Parameters
        ----------
        start : (2,) sequence of float, optional
            Where it is put down in m; the law's start when not given.

        Returns
        -------
        Run

        Raises
        ------
        ValueError
            As `dollop.perform`.
        """
        return followed(driving(self, len(self.demonstrations), start))


def followed(steps):
    """What comes of something that goes on in steps, at its end."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def arranged(scene, objects, place):
    """The scene with other objects, refused at a place if they cannot stand so."""
    try:
        return replace(scene, objects=tuple(objects))
    except ValueError as error:
        raise Refused(str(error), place) from None


def look(scene, background):
    """The objects as the robot sees them from where it stands (Sec. IV)."""
    if not has_laboratory():
        return Environment(scene.boxes)
    return observe(lab.watch(scene, 0).log, background).environment


def check_way(places, scene):
    """Refuse a line (N, 2) at its first place where a person cannot go."""
    left, low, right, high = scene.room.bounds
    x, y = places.T
    outside = (x < left) | (x > right) | (y < low) | (y > high)
    room = scene.room.distance(places)
    to_robot = np.linalg.norm(places - scene.robot.pose[:2], axis=1)
    at_robot = to_robot < scene.robot.radius + DEPTH / 2
    rules = [
        (outside, "the walk leaves the room"),
        (room == 0.0, "the walk leads through a wall or furniture"),
        (room < SHOULDERS / 2 + FROM_BACKGROUND, "too near to a wall or furniture to be seen"),
        (at_robot, "the walk leads through the robot"),
    ]
    if scene.objects:
        gaps = outline_distances(places, [each.footprint for each in scene.objects]).min(axis=1)
        rules.append((gaps <= 0.0, "the walk leads over an object"))
    for wrong, words in rules:
        if wrong.any():
            place = places[wrong.argmax()]
            raise Refused(f"{words} at ({place[0]:.1f}, {place[1]:.1f})", place)


# ---- what goes on while somebody looks

Sight = namedtuple("Sight", "t person log of")
"""A moment of a walk: t in s, where the person is (2,) in m, the LaserLog of that one scan (None
without a laser), and how many moments there are.
"""


def walking(lesson, shown, seed=0):
    """The person walks before the robot's laser, moment by moment.

    Parameters
    ----------
    lesson : Lesson
    shown : Walk
    seed : int or numpy.random.Generator
        For the laser's noise.

    Yields
    ------
    Sight

    Returns
    -------
    Observation or Demonstration
        What was seen, as `Lesson.shown` takes it; the second where there is no laser.
    """
    scene, scanner = lesson.scene, lesson.scene.robot.scanner
    t = np.arange(0.0, shown.t[-1], 1 / (scanner.rate if has_laboratory() else RATE))
    if not has_laboratory():
        places = np.array([shown.at(time)[0] for time in t])
        for time, place in zip(t, places, strict=True):
            yield Sight(time, place, None, len(t))
        return Demonstration(places, lesson.seen)
    rng, pose = np.random.default_rng(seed), scene.robot.laser_pose
    observer = Observer(lesson.background, scanner.angles)
    with lab.World(scene, [shown]) as world:
        for time in t:
            world.at(time)
            ranges = world.scan(pose, rng)
            observer.step(time, ranges, pose)
            log = LaserLog([time], [ranges], scanner.angles, [pose], scanner.max_range)
            yield Sight(time, shown.at(time)[0], log, len(t))
    return observer.observation()


def driving(lesson, seed=0, start=None):
    """The robot performs the task, period by period; whoever looks may have it carried elsewhere.

    It is the simulated Pioneer, which finds itself by its laser; without PyBullet a unicycle.

    Parameters
    ----------
    lesson : Lesson
        With a task.
    seed : int or numpy.random.Generator
        For the errors of odometry, laser and localisation.
    start : (2,) sequence of float, optional
        Where it is put down; the law's start when not given.

    Yields
    ------
    (controller, robot)
        After each period. What is sent, a place (2,) in m, is where the robot stands next.

    Returns
    -------
    Run

    Raises
    ------
    ValueError
        As `dollop.perform`.
    """
    law, background = lesson.task.law, lesson.background
    pose = (*(law.start if start is None else start), float(law.headings[0]))
    world = lab.World(lesson.scene) if has_laboratory() else None
    try:
        robot = Unicycle(pose)
        if world:
            told = background, lesson.seen, seed, start is None
            robot = lab.Pioneer(world, pose, *told)
        controller, carried = Controller(lesson.task, robot, background=background), []
        while not controller.over:
            robot.drive(*controller.step(robot.pose))
            place = yield controller, robot
            if place is not None:
                robot.place((*place, robot.pose[2]))
                carried.append(controller.time)
        return controller.run(carried)
    finally:
        if world:
            world.__exit__()


def seen_points(sight):
    """Where the beams of a moment ended.

    Parameters
    ----------
    sight : Sight

    Returns
    -------
    (N, 2) float array
        In m; none without a laser.
    """
    if sight.log is None:
        return np.empty((0, 2))
    points = endpoints(sight.log)[0]
    return points[np.isfinite(points).all(axis=1)]
