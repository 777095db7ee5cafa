"""Performing a task: robots, kidnapping, and what comes of it (Sec. III; Fig. 7, 10 and 12).

A robot is anything with `pose` (x, y in m, theta in rad: what it believes), `localised` (whether it
trusts its belief), `limits`, `period` in s, and `drive(v, omega)`, which lets one period pass. One
that can feel what it touches has `touching`; a simulated one has `true_pose`, for measuring, and
`place(pose)`, which kidnaps it. Here is a fast one for studies; `dollop.lab` has the Pioneer.
"""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from dollop.checks import check_choice, check_positive
from dollop.pose import moved_pose
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.control import CONTROL_LAWS, PIONEER_LIMITS, Guidance, Limits, clip

__all__ = ["Run", "Unicycle", "perform"]

SEARCH_TURN, BACK_OFF, PUSHED = 0.5, 0.1, 2.0
"""A robot that does not know where it is turns on the spot, in rad/s, and moves off what it
touches, in m/s: back, and if that has not helped within so many s, forth."""
HELD = 1.0
"""Time in s for which a robot goes on to move off what it touched."""


@dataclass(frozen=True, eq=False)
class Run:
    """What came of performing a task (Sec. III).

    Attributes
    ----------
    t : (N,) float array
        In s from the start, one control period apart.
    poses : (N, 3) float array
        x, y in m, theta in rad, as the robot believed it.
    true_poses : (N, 3) float array
        As it was; the same for a robot that knows its pose.
    active : (N,) int array
        Index of the segment in force.
    localised : (N,) bool array
        Whether the robot trusted its pose.
    clearance : (N,) float array
        Distance in m between the edge of the robot, taken as a disc, and the nearest obstacle on
        its map.
    finished : bool
        Whether every segment handed over.
    reason : str
        Why not; empty when finished.
    collisions : int
        How often the robot came to touch something: felt by a robot that can, else clearance
        falling below zero.
    kidnapped : (M,) float array
        Times in s.
    """

    t: np.ndarray
    poses: np.ndarray
    true_poses: np.ndarray
    active: np.ndarray
    localised: np.ndarray
    clearance: np.ndarray
    finished: bool
    reason: str
    collisions: int
    kidnapped: np.ndarray

    def __repr__(self):
        end = "finished" if self.finished else self.reason
        touched = f"{self.collisions} collisions, least clearance {self.clearance.min():.2f} m"
        return f"Run of {self.t[-1]:.1f} s: {end}; {touched}"


class Unicycle:
    """A robot without mass that knows its pose, and passes through what it hits (reconstruction).

    Parameters
    ----------
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    limits : Limits
    period : float
        Control period in s.

    Examples
    --------
    From rest it cannot be fast at once.

    >>> robot = Unicycle((0.0, 0.0, 0.0))
    >>> robot.drive(0.5, 0.0)
    >>> round(robot.pose[0], 6)
    0.005
    """

    localised = True

    def __repr__(self):
        return "Unicycle at ({:.2f}, {:.2f}, {:.2f})".format(*self.pose)

    def __init__(self, pose, limits=PIONEER_LIMITS, period=0.1):
        self.limits, self.period = Limits(*limits), period
        self.place(pose)

    def place(self, pose):
        """Put the robot at rest at a pose.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.
        """
        self.pose = tuple(float(value) for value in pose)
        self.speed = self.turn = 0.0

    def drive(self, speed, turn):
        """Move for one period, towards the speeds asked for as far as the limits allow.

        Parameters
        ----------
        speed : float
            In m/s.
        turn : float
            In rad/s, counter-clockwise.
        """
        limits, period = self.limits, self.period
        self.speed = approach(self.speed, clip(speed, limits.speed), limits.acceleration * period)
        self.turn = approach(self.turn, clip(turn, limits.turn), limits.turn_acceleration * period)
        arc = self.speed * period, self.turn * period
        self.pose = tuple(moved_pose(self.pose, *arc).tolist())


def approach(value, goal, step):
    """The value moved towards the goal by at most `step`."""
    return value + clip(goal - value, step)


def perform(
    task, robot, control="pursuit", avoid=True, background=None, kidnap=(), timeout=600.0, localise_within=120.0
):
    """Let a robot perform a task (Sec. III; Fig. 7, 10, 12).

    Parameters
    ----------
    task : Task
        Anything with a `law` (SequencedLDS) and an `environment` (Environment).
    robot : Unicycle, dollop.lab.Pioneer, or one of your own
        See the top of `dollop.robot.performing`. Where it stands is where it starts. It drives
        until the task is finished or given up.
    control : str
        "plain", the paper's kind, or "pursuit", the better one.
    avoid : bool
        Go round obstacles; the paper's law does not.
    background : OccupancyGrid, optional
        Walls and furniture. Without it only the environment's boxes are known.
    kidnap : sequence of (float, (3,) sequence)
        At which times in s the robot is put at which poses.
    timeout : float
        Give up after this time in s.
    localise_within : float
        Give up when the robot has not known where it is for this time in s. Until it knows, it
        turns on the spot, and moves off what it touches.

    Returns
    -------
    Run

    Raises
    ------
    ValueError
        For an unknown control law, a start, subgoal or kidnapping that is not finite, off the map
        or in an obstacle, a time-out that is not positive, or a kidnapping before the start.

    Examples
    --------
    Kidnapped on its way, the robot goes on to the subgoal all the same.

    >>> from dollop import Demonstration, Environment, Task
    >>> walk = np.linspace([0.0, 0.0], [3.0, 1.0], 50)
    >>> task = Task.of(Demonstration(walk, Environment([[1.5, 2.0, 2.0, 2.5]])))
    >>> run = perform(task, Unicycle((0.0, 0.0, 0.3)), kidnap=[(3.0, (0.0, 2.0, 1.0))])
    >>> run.finished, run.collisions, bool(np.hypot(*(run.poses[-1, :2] - walk[-1])) < 0.3)
    (True, 0, True)
    """
    check_choice("control", control, CONTROL_LAWS)
    if not (timeout > 0 and localise_within > 0):
        raise ValueError(f"timeout and localise_within must be positive, got {timeout} and {localise_within}")
    kidnap = sorted((float(time), tuple(pose)) for time, pose in kidnap)
    places = named_places(task.law, robot, kidnap)
    obstacles = ObstacleMap.of(task.environment, background, [place[:2] for _, place in places])
    check_free(places, obstacles)
    guidance = Guidance(task.law, obstacles if avoid else None)
    supervisor = CONTROL_LAWS[control](guidance, task.law.speeds, robot)
    records, reason = drive(supervisor, robot, list(kidnap), timeout, localise_within)
    robot.drive(0.0, 0.0)
    t = np.arange(len(records)) * robot.period
    kidnapped = [time for time, _ in kidnap if time < len(records) * robot.period]
    return as_run(t, records, reason, obstacles, kidnapped)


class Search:
    """What a lost robot does: turn on the spot, and before that move off what it touches."""

    def __init__(self, period):
        self.period, self.speed, self.pushed, self.off = period, -BACK_OFF, 0.0, HELD

    def command(self, touching):
        """v in m/s and omega in rad/s, by whether the robot touches something."""
        if self.off >= HELD and not touching:
            self.speed, self.pushed = -BACK_OFF, 0.0
            return 0.0, SEARCH_TURN
        self.off = 0.0 if touching else self.off + self.period
        self.pushed += self.period if touching else 0.0
        if self.pushed > PUSHED:
            self.speed, self.pushed = -self.speed, 0.0
        return self.speed, 0.0


def drive(supervisor, robot, kidnap, timeout, localise_within):
    """The control loop: what was the case in each period, and why it gave up, or nothing.

    A record is (pose, true pose, segment, localised, touching).
    """
    records, blind, search = [], 0.0, Search(robot.period)
    while True:
        now = len(records) * robot.period
        if kidnap and now > kidnap[0][0] - robot.period / 2:
            robot.place(kidnap.pop(0)[1])
        x, y, theta = pose = robot.pose
        touching = getattr(robot, "touching", None)
        true_pose = getattr(robot, "true_pose", pose)
        records.append((pose, true_pose, supervisor.active, robot.localised, touching))
        if not isfinite(x + y + theta):
            return records, f"the pose must be finite, got {x, y, theta} at {now:.1f} s"
        if robot.localised:
            blind, command = 0.0, supervisor.command(x, y, theta)
        else:
            blind, command = blind + robot.period, search.command(touching)
        if supervisor.done:
            return records, ""
        if supervisor.hopeless:
            return records, f"no progress towards subgoal {supervisor.active} at {now:.1f} s"
        if blind > localise_within:
            return records, f"the robot has not known where it is for {localise_within:g} s"
        if now >= timeout:
            return records, f"not finished within {timeout:g} s"
        robot.drive(*command)


def as_run(t, records, reason, obstacles, kidnapped):
    """The records of the control loop at times (N,) in s as a Run."""
    *poses, active, localised, touching = map(np.array, zip(*records, strict=True))
    poses, true_poses = (each.astype(float) for each in poses)
    clearance = obstacles.edges(true_poses[:, :2])
    contact = clearance < 0 if touching[0] is None else touching.astype(bool)
    collisions = int(np.count_nonzero(np.diff(contact, prepend=False) & contact))
    told = t, poses, true_poses, active, localised, clearance
    return Run(*told, not reason, reason, collisions, np.array(kidnapped, dtype=float))


def named_places(law, robot, kidnap):
    """The places that a run needs, each with its name: subgoals, start, kidnappings.

    Raises
    ------
    ValueError
        One that is not finite, or a kidnapping before the start.
    """
    places = [(f"subgoal {k}", place) for k, place in enumerate(law.subgoals)]
    if robot.localised:
        places.append(("the start", robot.pose))
    for time, pose in kidnap:
        check_positive("the time of a kidnapping", time, or_zero=True)
        places.append((f"the pose of the kidnapping at {time:g} s", pose))
    for name, place in places:
        if not np.isfinite(place).all():
            raise ValueError(f"{name} must be finite, got {place}")
    return places


def check_free(places, obstacles):
    """Raise ValueError for a named place that is off the map or in an obstacle."""
    for name, (x, y, *_) in places:
        there = f"got ({x:.2f}, {y:.2f}), which is"
        if not obstacles.holds(x, y):
            raise ValueError(f"{name} must lie in the lab, {there} off the map")
        if obstacles.edge(x, y) <= -obstacles.radius:
            raise ValueError(f"{name} must be free, {there} in an obstacle or unknown")
