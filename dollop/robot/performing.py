"""Performing a task: robots, kidnapping, and what comes of it (Sec. III; Fig. 7, 10 and 12).

A robot is anything with `pose` (x, y in m, theta in rad: what it believes), `localised` (whether it
trusts its belief), `limits`, `period` in s, and `drive(v, omega)`, which lets one period pass. One
that can feel what it touches has `touching`; one that sees what its map does not have tells it by
`noticed`, an Environment of all that it has noticed so far; a simulated one has `true_pose`, for
measuring, and `place(pose)`, which kidnaps it. Here is a fast one for studies; `dollop.lab` has the
Pioneer.
"""

from dataclasses import dataclass
from itertools import chain
from math import isfinite

import numpy as np

from dollop.checks import (
    check_choice,
    check_has,
    check_positive,
    checked_array,
    checked_flag,
    checked_flags,
    checked_number,
    checked_positions,
    checked_record,
    checked_records,
    checked_whole,
    checked_wholes,
    put_in,
    told,
)
from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.pose import moved_pose
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.control import CONTROL_LAWS, PIONEER_LIMITS, Limits, clip
from dollop.robot.ways import WayKeeper
from dollop.sequenced_lds import SequencedLDS

__all__ = ["Run", "Unicycle", "perform"]

SEARCH_TURN, BACK_OFF, PUSHED = 0.5, 0.1, 2.0
"""A robot that does not know where it is turns on the spot, in rad/s, and moves off what it
touches, in m/s: back, and if that has not helped within so many s, forth."""
LONGEST_RUN, MOST_PERIODS = 1e4, 1_000_000
"""s and control periods after which any run is given up: three hours, or a quarter of one at a thousand a second."""
PERIODS = 1e-3, 10.0
"""s: no motor is told more often what to do, and none is left alone for longer."""
SOONEST = 1e-6
"""s: the shortest time-out."""
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
        As it was; the same for a robot that knows its pose. NaN where nobody knew.
    active : (N,) int array
        Index of the segment in force, within the way in force.
    localised : (N,) bool array
        Whether the robot trusted its pose.
    clearance : (N,) float array
        Distance in m between the edge of the robot, taken as a disc, and the nearest obstacle on
        its map, or that it has noticed by then; NaN where nobody knew where it was.
    finished : bool
        Whether every segment handed over.
    reason : str
        Why not; empty when finished.
    collisions : int
        How often the robot came to touch something: felt by a robot that can, else clearance
        falling below zero.
    kidnapped : (M,) float array
        Times in s.
    way : (N,) int array, optional
        Index of the way in force among the ways of the task; 0, the one most often shown, if not
        given.

    Raises
    ------
    ValueError
        Arrays that are not of one length, or of no period at all; what is no number, flag or text, or
        is not finite before the last period, in which the robot may have lost its pose.
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
    way: np.ndarray = None

    def __post_init__(self):
        t = checked_array("t", self.t, "N")
        if not len(t):
            raise ValueError("a run must have a period, got none")
        way = np.zeros(len(t)) if self.way is None else self.way
        put_in(
            self,
            t=t,
            poses=checked_but_last("poses", self.poses, len(t), 3),
            true_poses=checked_array("true_poses", self.true_poses, len(t), 3, finite=False),
            active=checked_wholes("active", self.active, len(t)),
            localised=checked_flags("localised", self.localised, len(t)),
            clearance=checked_array("clearance", self.clearance, len(t), finite=False),
            finished=checked_flag("finished", self.finished),
            reason=checked_record("reason", self.reason, str),
            collisions=checked_whole("collisions", self.collisions),
            kidnapped=checked_array("kidnapped", self.kidnapped, "M", least=0),
            way=checked_wholes("way", way, len(t)),
        )

    def __repr__(self):
        end = "finished" if self.finished else self.reason
        touched = f"{self.collisions} collisions, least clearance {self.clearance.min():.2f} m"
        return f"Run of {self.t[-1]:.1f} s{told_ways(self)}: {end}; {touched}"


def checked_but_last(name, values, *shape):
    """Values as a float array; ValueError where they are not finite before the last."""
    array = checked_array(name, values, *shape, finite=False)
    checked_array(f"{name} before the last", array[:-1], *array[:-1].shape)
    return array


def told_ways(run):
    """Which ways a run was on and from when in s, where it was not the usual one all the time."""
    if not run.way.any():
        return ""
    changes = np.flatnonzero(np.diff(run.way)) + 1
    later = (f", from {run.t[i]:.1f} s on way {run.way[i]}" for i in changes)
    return f" on way {run.way[0]}{''.join(later)}"


class Unicycle:
    """A robot without mass that knows its pose, and passes through what it hits (reconstruction).

    Parameters
    ----------
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    limits : Limits
    period : float
        Control period in s, a millisecond to ten seconds.

    Raises
    ------
    ValueError
        For a pose that is not finite or beyond 1e9, limits that are none, or another period.

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
        self.limits = Limits(*checked_array("limits", limits, 4, finite=False))
        self.period = checked_number("period", period, *PERIODS)
        self.place(pose)

    def place(self, pose):
        """Put the robot at rest at a pose.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.

        Raises
        ------
        ValueError
            For a pose that is not finite, or beyond 1e9.
        """
        self.pose = tuple(checked_positions("the pose of a robot", pose, 3).tolist())
        self.speed = self.turn = 0.0

    def drive(self, speed, turn):
        """Move for one period, towards the speeds asked for as far as the limits allow.

        Parameters
        ----------
        speed : float
            In m/s.
        turn : float
            In rad/s, counter-clockwise.

        Raises
        ------
        ValueError
            For what are no numbers.
        """
        speed, turn = checked_number("speed", speed), checked_number("turn", turn)
        limits, period = self.limits, self.period
        self.speed = approach(self.speed, clip(speed, limits.speed), limits.acceleration * period)
        self.turn = approach(self.turn, clip(turn, limits.turn), limits.turn_acceleration * period)
        arc = self.speed * period, self.turn * period
        self.pose = tuple(moved_pose(self.pose, *arc).tolist())


def approach(value, goal, step):
    """The value moved towards the goal by at most `step`."""
    return value + clip(goal - value, step)


def perform(
    task,
    robot,
    control="pursuit",
    avoid=True,
    background=None,
    kidnap=(),
    timeout=600.0,
    localise_within=120.0,
):
    """Let a robot perform a task (Sec. III; Fig. 7, 10, 12).

    Parameters
    ----------
    task : Task
        Anything with a `law` (SequencedLDS) and an `environment` (Environment). If it has several
        `ways` (tuple of SequencedLDS, the law first) and tells how often each was `shown` (tuple of
        int), the robot takes the one that fits its start and is free, the one shown most often of
        several, and changes to another that is free when it is blocked. The paper's kind, control
        "plain" without avoiding, has one way only: the law.
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
        Give up after this time in s, and in any case after 10,000 s or a million control periods.
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
        or in an obstacle (a subgoal: if every way has such a one), a time-out that is not positive,
        a kidnapping before the start, no ways, or not as many as `shown` counts; for a task or
        robot that lacks something, and what is not of its kind.

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
    avoid = checked_flag("avoid", avoid)
    timeout = min(checked_number("timeout", timeout, SOONEST, np.inf), LONGEST_RUN)
    localise_within = checked_number("localise_within", localise_within, SOONEST, np.inf)
    if background is not None:
        checked_record("background", background, OccupancyGrid)
    kidnap = sorted(checked_kidnappings(kidnap))
    check_robot(robot, kidnap)
    check_has("task", task, "law", "environment")
    checked_record("the task's environment", task.environment, Environment)
    laws, shown = ways_of(task, only=control == "plain" and not avoid)
    places, subgoals = named_places(robot, kidnap), list(map(named_subgoals, laws))
    held = [place[:2] for _, place in [*chain.from_iterable(subgoals), *places]]

    def chart(boxes):
        boxes = np.vstack([task.environment.boxes, boxes])
        return ObstacleMap.of(Environment(boxes), background, held)

    keeper = WayKeeper(laws, shown, robot, control, chart, avoid)
    check_some_way(subgoals, keeper.known)
    check_free(places, keeper.known)
    clearance = Clearance()
    records, reason = drive(keeper, robot, list(kidnap), timeout, localise_within, clearance)
    robot.drive(0.0, 0.0)
    t = np.arange(len(records)) * robot.period
    kidnapped = [time for time, _ in kidnap if time < len(records) * robot.period]
    return as_run(t, records, clearance.all(), reason, kidnapped)


def ways_of(task, only=False):
    """The laws of a task, one for each way, and how often each was shown; or of the first only.

    Raises
    ------
    ValueError
        No ways, or not as many as are counted.
    """
    checked_record("the task's law", task.law, SequencedLDS)
    if only:
        return (task.law,), (1,)
    laws = checked_records("the task's ways", getattr(task, "ways", (task.law,)), SequencedLDS)
    shown = checked_wholes("shown", getattr(task, "shown", (1,) * len(laws)), "W").tolist()
    if not 0 < len(laws) == len(shown):
        got = f"got {len(laws)} ways and {told(shown)}"
        raise ValueError(f"a task must have a way, and shown must count each, {got}")
    return laws, tuple(shown)


def check_robot(robot, kidnap):
    """Refuse what cannot perform a task, or be kidnapped if that is wanted; see the module's top.

    Raises
    ------
    ValueError
        With what is missing, or no number or flag.
    """
    check_has("robot", robot, "pose", "localised", "limits", "period", "drive")
    if kidnap:
        check_has("a robot to be kidnapped", robot, "place")
    checked_number("the robot's period", robot.period, *PERIODS)
    checked_flag("whether the robot is localised", robot.localised)
    checked_array("the robot's pose", robot.pose, 3, finite=False)  # one that is lost may have none
    check_has("the robot's limits", robot.limits, *Limits._fields)
    Limits(*(getattr(robot.limits, name) for name in Limits._fields))


def checked_kidnappings(kidnap):
    """Kidnappings as a list of (time in s, pose (3,) as a tuple).

    Raises
    ------
    ValueError
        For what is no pair of a time from the start on and a pose that is finite.
    """
    found = []
    for each in checked_records("kidnap", kidnap, object):
        pair = checked_records("a kidnapping", each, object)
        if len(pair) != 2:
            raise ValueError(f"a kidnapping must be a time and a pose, got {told(each)}")
        time, pose = pair
        check_positive("the time of a kidnapping", time, or_zero=True)
        pose = checked_positions(f"the pose of the kidnapping at {time:g} s", pose, 3)
        found.append((float(time), tuple(pose.tolist())))
    return found


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


class Clearance:
    """Distances in m from the robot's edge, each on the map of its period, which is not kept."""

    def __init__(self):
        self.known, self.places, self.told = None, [], []

    def add(self, x, y, known):
        """One more place in m, on a map."""
        if known is not self.known and self.places:
            self.all()
        self.known = known
        self.places.append((x, y))

    def all(self):
        """(N,) float array: of all places so far."""
        if self.places:
            self.told.append(self.known.edges(self.places))
            self.places = []
        return np.concatenate(self.told)


def drive(keeper, robot, kidnap, timeout, localise_within, clearance):
    """The control loop: what was the case in each period, and why it gave up, or nothing.

    A record is (pose, true pose, segment, way, localised, touching).
    """
    records, blind, search = [], 0.0, Search(robot.period)
    while True:
        now = len(records) * robot.period
        if kidnap and now > kidnap[0][0] - robot.period / 2:
            robot.place(kidnap.pop(0)[1])
        x, y, theta = pose = tuple(map(float, robot.pose))
        touching = getattr(robot, "touching", None)
        true_pose = getattr(robot, "true_pose", pose)
        finite = isfinite(x + y + theta)
        if robot.localised and finite:
            keeper.begin(x, y)
        state = keeper.active, keeper.way, robot.localised, touching
        records.append((pose, true_pose, *state))
        clearance.add(*true_pose[:2], keeper.known)
        if not finite:
            return records, f"the pose must be finite, got {x, y, theta} at {now:.1f} s"
        if robot.localised:
            blind, command = 0.0, keeper.command(x, y, theta)
        else:
            blind, command = blind + robot.period, search.command(touching)
        if keeper.done:
            return records, ""
        if keeper.hopeless:
            return records, f"{keeper.reason} at {now:.1f} s"
        if blind > localise_within:
            return records, f"the robot has not known where it is for {localise_within:g} s"
        if now >= timeout:
            return records, f"not finished within {timeout:g} s"
        if len(records) > MOST_PERIODS:
            return records, f"not finished within {MOST_PERIODS} periods of {robot.period:g} s"
        robot.drive(*command)


def as_run(t, records, clearance, reason, kidnapped):
    """The records of the control loop at times (N,) in s, with clearances (N,) in m, as a Run."""
    *poses, active, way, localised, touching = map(np.array, zip(*records, strict=True))
    poses, true_poses = (each.astype(float) for each in poses)
    contact = clearance < 0 if touching[0] is None else touching.astype(bool)
    collisions = int(np.count_nonzero(np.diff(contact, prepend=False) & contact))
    columns = t, poses, true_poses, active, localised, clearance
    return Run(*columns, not reason, reason, collisions, np.array(kidnapped, dtype=float), way)


def named_subgoals(law):
    """The subgoals of a law, each with its name."""
    return [(f"subgoal {k}", place) for k, place in enumerate(law.subgoals)]


def named_places(robot, kidnap):
    """The other places that a run needs, each with its name: start, kidnappings.

    Raises
    ------
    ValueError
        One that is not finite.
    """
    places = [("the start", robot.pose)] if robot.localised else []
    places += [(f"the pose of the kidnapping at {time:g} s", pose) for time, pose in kidnap]
    for name, place in places:
        checked_positions(name, place, 3)
    return places


def check_some_way(ways, obstacles):
    """Raise ValueError, that of the first, if in every way a named subgoal is not free."""
    errors = []
    for subgoals in ways:
        try:
            return check_free(subgoals, obstacles)
        except ValueError as error:
            errors.append(error)
    raise errors[0]


def check_free(places, obstacles):
    """Raise ValueError for a named place that is off the map or in an obstacle."""
    for name, (x, y, *_) in places:
        there = f"got ({x:.2f}, {y:.2f}), which is"
        if not obstacles.holds(x, y):
            raise ValueError(f"{name} must lie in the lab, {there} off the map")
        if obstacles.edge(x, y) <= -obstacles.radius:
            raise ValueError(f"{name} must be free, {there} in an obstacle or unknown")
