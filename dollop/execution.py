"""Performing a task: the supervisory control law that a sequenced LDS induces, and robots that obey it (Sec. III).

In segment k the law maps the current state to a direction, whatever brought the robot there:

    u(p) = (A_k - I)(p - g_k) / |(A_k - I)(p - g_k)|.

A segment stays in force until the robot is within `reach` of its subgoal g_k; then the next one takes over. So a robot
that is kidnapped keeps its segment: it goes on to the subgoal it was heading for, as the user would have done from there,
and skips none. Two control laws make v and omega of it:

- "plain" turns towards u and drives at the demonstrated speed; it knows nothing of what the robot can do.
- "pursuit" rolls the response out from the current state and pursues a point ahead on it, slower where it bends.

Switch rule and controllers are reconstructions; the paper gives neither.

A robot is anything with `pose` (x, y in m, theta in rad: what it believes), `true_pose`, `localised` (whether it trusts
its belief), `touching` (None if it cannot feel), `limits`, `period` in s, `drive(v, omega)`, which lets one period
pass, and `place(pose)`, which kidnaps it.
"""

from collections import namedtuple
from dataclasses import dataclass
from functools import partial
from math import atan2, cos, hypot, isfinite, pi, sin

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from dollop.avoidance import Geodesic, ObstacleMap
from dollop.trajectory import distance_to_polyline

REACH = 0.25
"""How near to its subgoal a segment hands over, in m: nearer, a robot that needs 0.6 m to turn would circle it."""
PATIENCE = 5.0
"""Time in s without progress after which the way is changed or the speed halved."""
STEP = 0.05  # m between the points of a response that is pursued
LOOK_AHEAD = 7  # points: 0.35 m
STRAY = 0.3  # m: farther from its response than this, the robot has been moved, and the response is rolled out anew
FARTHEST = 100.0  # m: a response that has not come to its subgoal after this is given up
SHARP = 1.2  # rad: turn first, then drive
SLOWEST = 1 / 16
JUMP = 0.3  # m in one control period: no robot drives that

Limits = namedtuple("Limits", "speed turn acceleration turn_acceleration")
PIONEER_LIMITS = Limits(0.5, 0.8, 0.5, 1.57)
"""Speed in m/s, turning rate in rad/s (CARMEN, p2d8+), accelerations in m/s^2 and rad/s^2 (Stage, pioneer.inc)."""


@dataclass(frozen=True, eq=False)
class Run:
    """What came of performing a task.

    Attributes
    ----------
    t : (N,) float array
        s from the start, one control period apart.
    poses : (N, 3) float array
        x, y in m, theta in rad, as the robot believed it.
    true_poses : (N, 3) float array
        As it was; the same for a robot that knows its pose.
    active : (N,) int array
        Index of the segment in force.
    localised : (N,) bool array
        Whether the robot trusted its pose.
    clearance : (N,) float array
        Distance in m between the edge of the robot, taken as a disc, and the nearest obstacle on its map.
    finished : bool
        Whether every segment handed over.
    reason : str
        Why not; empty when finished.
    collisions : int
        How often the robot came to touch something: felt by a robot that can, else clearance falling below zero.
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


class Unicycle:
    """A kinematic robot with the Pioneer's limits that knows its pose; it passes through what it hits.

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

    localised, touching = True, None

    def __init__(self, pose, limits=PIONEER_LIMITS, period=0.1):
        self.limits, self.period = Limits(*limits), period
        self.place(pose)

    def place(self, pose):
        """Put the robot at rest at a pose."""
        self.pose = tuple(float(value) for value in pose)
        self.speed = self.turn = 0.0

    @property
    def true_pose(self):
        """The pose, which this robot knows."""
        return self.pose

    def drive(self, speed, turn):
        """Move for one period towards a speed in m/s and a turning rate in rad/s, within the limits."""
        limits, period = self.limits, self.period
        self.speed = approach(self.speed, clip(speed, limits.speed), limits.acceleration * period)
        self.turn = approach(self.turn, clip(turn, limits.turn), limits.turn_acceleration * period)
        x, y, theta = self.pose
        middle = theta + self.turn * period / 2
        way = self.speed * period
        self.pose = x + way * cos(middle), y + way * sin(middle), wrap(theta + self.turn * period)


def clip(value, limit):
    """The value cut to [-limit, limit]."""
    return max(-limit, min(limit, value))


def approach(value, goal, step):
    """The value moved towards the goal by at most `step`."""
    return value + clip(goal - value, step)


def wrap(angle):
    """The angle in rad, in (-pi, pi]."""
    return pi - (pi - angle) % (2 * pi)


class Guidance:
    """The direction of a sequenced LDS at any state, round obstacles if it is given any.

    Parameters
    ----------
    law : SequencedLDS
    obstacles : ObstacleMap, optional

    Attributes
    ----------
    detours : dict
        For a segment whose response does not get through: the `Geodesic` to its subgoal that is followed instead, or,
        without obstacles, None for the straight line.
    """

    def __init__(self, law, obstacles=None):
        self.obstacles = obstacles
        self.goals = [tuple(segment.goal.tolist()) for segment in law.segments]
        self.steps = [(segment.A - np.eye(2)).ravel().tolist() for segment in law.segments]
        self.weights = [solve_discrete_lyapunov(s.A.T, np.eye(2))[[0, 0, 1], [0, 1, 1]].tolist() for s in law.segments]
        self.detours = {}

    def direction(self, k, x, y):
        """Unit vector in which segment k sends a robot at x, y in m."""
        if k in self.detours:
            return self.detour_direction(k, x, y)
        ux, uy = self.response_direction(k, x, y)
        return self.obstacles.modulate(x, y, ux, uy) if self.obstacles else (ux, uy)

    def response_direction(self, k, x, y):
        """Unit vector of (A_k - I)(p - g_k) at p = (x, y)."""
        (gx, gy), (a, b, c, d) = self.goals[k], self.steps[k]
        x, y = x - gx, y - gy
        ux, uy = a * x + b * y, c * x + d * y
        size = hypot(ux, uy) or 1.0
        return ux / size, uy / size

    def detour_direction(self, k, x, y):
        """Unit vector along the shortest way to subgoal k."""
        if self.detours[k]:
            return self.detours[k].direction(x, y)
        gx, gy = self.goals[k]
        size = hypot(gx - x, gy - y) or 1.0
        return (gx - x) / size, (gy - y) / size

    def detour(self, k):
        """Leave the response of segment k for the shortest way to its subgoal."""
        self.detours[k] = Geodesic(self.obstacles, self.goals[k]) if self.obstacles else None

    def remaining(self, k, x, y):
        """What falls on the way to subgoal k: the length of a detour, else the Lyapunov measure |x|_P of the offset.

        P solves A^T P A - P = -I. Where the robot moves exactly along u it falls: x^T P x is convex and falls from x to A x.
        """
        if self.detours.get(k):
            return self.detours[k].distance(x, y)
        (gx, gy), (p, q, r) = self.goals[k], self.weights[k]
        x, y = x - gx, y - gy
        return (p * x * x + 2 * q * x * y + r * y * y) ** 0.5

    def reached(self, k, x, y, reach):
        """Whether x, y in m is within reach of subgoal k, or of the place nearest to it where the robot has room."""
        gx, gy = self.goals[k]
        if hypot(x - gx, y - gy) < reach:
            return True
        if not self.detours.get(k):
            return False
        gx, gy = self.detours[k].goal
        return hypot(x - gx, y - gy) < reach / 2

    def leg(self, k, x, y):
        """The response of segment k rolled out from x, y in m in steps of 5 cm: a list of places, and whether it arrived."""
        places = []
        for _ in range(round(FARTHEST / STEP)):
            if self.reached(k, x, y, STEP):
                return places, True
            ux, uy = self.direction(k, x, y)
            ux, uy = self.direction(k, x + STEP / 2 * ux, y + STEP / 2 * uy)  # the midpoint keeps spirals from widening
            x, y = x + STEP * ux, y + STEP * uy
            places.append((x, y))
        return places, False

    def way(self, k, x, y):
        """Legs of all segments from k on, from x, y in m: places and the segment each belongs to.

        A leg that does not arrive is replaced by a detour.
        """
        places, segments = [(x, y)], [k]
        for segment in range(k, len(self.goals)):
            leg, arrived = self.leg(segment, *places[-1])
            if not arrived:
                self.detour(segment)
                leg, _ = self.leg(segment, *places[-1])
            places += leg
            segments += [segment] * len(leg)
        return places, segments


class Supervisor:
    """Which segment is in force, and whether the robot gets on with it.

    Attributes
    ----------
    active : int
        The segment in force.
    done : bool
        Whether the last one has handed over.
    pace : float
        Share of the demonstrated speed. It is halved when there is no progress: the slower a robot, the more exactly it
        can follow the direction of the law, whose Lyapunov measure falls everywhere, and so every segment hands over.
    """

    def __init__(self, guidance, speeds, robot):
        self.guidance, self.limits, self.period = guidance, robot.limits, robot.period
        self.speeds = [min(float(speed), robot.limits.speed) for speed in speeds]
        self.active, self.done, self.hopeless = 0, False, False
        self.last = robot.pose[:2]
        self.restart()

    def restart(self):
        """Begin the segment in force afresh: at a handing over, and where the robot finds itself elsewhere."""
        self.pace, self.best, self.waited = 1.0, float("inf"), 0.0
        self.guidance.detours.pop(self.active, None)

    def watch(self, x, y, remaining, least):
        """Notice a kidnapping, and the want of progress: `remaining` has not fallen by `least` for some time."""
        if hypot(x - self.last[0], y - self.last[1]) > JUMP:
            self.restart()
        self.last = x, y
        self.waited += self.period
        if remaining < self.best - least:
            self.best, self.waited = remaining, 0.0
        elif self.waited > PATIENCE:
            self.insist()

    def insist(self):
        """Take a detour; if there is one already, halve the pace; if that is very low already, give up."""
        self.best, self.waited = float("inf"), 0.0
        if self.guidance.obstacles and self.active not in self.guidance.detours:
            self.guidance.detour(self.active)
        else:
            self.pace /= 2
            self.hopeless = self.pace < SLOWEST

    def hand_over(self, segment):
        """Put `segment` in force."""
        self.done = segment == len(self.speeds)
        if not self.done:
            self.active = segment
            self.restart()

    def safe(self, speed, x, y, theta):
        """The speed in m/s, or less where it could not be braked in time."""
        if not self.guidance.obstacles:
            return speed
        return min(speed, self.guidance.obstacles.speed_limit(x, y, theta, self.limits.acceleration, self.period))


class Plain(Supervisor):
    """Turn towards the law's direction, drive at the demonstrated speed: v = s max(0, cos e), omega = 2 e."""

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose."""
        remaining = self.guidance.remaining(self.active, x, y)
        self.watch(x, y, remaining, 0.02 * min(remaining, 1.0))
        if self.guidance.reached(self.active, x, y, REACH):
            self.hand_over(self.active + 1)
        ux, uy = self.guidance.direction(self.active, x, y)
        error = wrap(atan2(uy, ux) - theta)
        speed = 0.0 if abs(error) > SHARP else self.speeds[self.active] * self.pace * cos(error)
        return self.safe(speed, x, y, theta), clip(2 * error, self.limits.turn)


class Pursuit(Supervisor):
    """Pursue a point 0.35 m ahead on the response, no faster than the robot can turn there.

    The circle through robot and point has the curvature 2 sin(e) / distance (Coulter, "Implementation of the pure
    pursuit path tracking algorithm", CMU-RI-TR-92-01).
    """

    places = ((float("inf"), float("inf")),)  # no response yet: any pose is astray
    segments, planned, at = (0,), (0.0,), 0

    def plan(self, x, y):
        """Roll the response out from x, y in m; beyond its end it goes straight on, for something to pursue."""
        self.places, self.segments = self.guidance.way(self.active, x, y)
        self.at, self.end = 0, len(self.places) - 1
        ux, uy = self.guidance.direction(len(self.speeds) - 1, *self.places[max(self.end - 1, 0)])
        last_x, last_y = self.places[-1]
        self.places += [(last_x + i * STEP * ux, last_y + i * STEP * uy) for i in range(1, LOOK_AHEAD + 1)]
        demonstrated = np.array(self.speeds)[self.segments + [len(self.speeds) - 1] * LOOK_AHEAD]
        self.planned = bend_speeds(np.array(self.places), demonstrated, self.limits).tolist()

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose."""
        detours = len(self.guidance.detours)
        self.watch(x, y, -self.at, 0)
        if distance(self.places[self.at], x, y) > STRAY or len(self.guidance.detours) != detours:
            self.plan(x, y)
        self.advance(x, y)
        ahead_x, ahead_y = self.places[self.at + LOOK_AHEAD]
        error = wrap(atan2(ahead_y - y, ahead_x - x) - theta)
        if abs(error) > SHARP:
            return 0.0, clip(2 * error, self.limits.turn)
        curvature = 2 * sin(error) / max(hypot(ahead_x - x, ahead_y - y), STEP)
        speed = self.pace * min(self.planned[self.at], self.limits.turn / max(abs(curvature), 1e-9))
        speed = self.safe(speed, x, y, theta)
        return speed, curvature * speed

    def advance(self, x, y):
        """Move on along the response while it comes nearer, handing over where its segments do."""
        here = distance(self.places[self.at], x, y)
        while self.at < self.end and (there := distance(self.places[self.at + 1], x, y)) <= here:
            self.at, here = self.at + 1, there
        if self.segments[self.at] != self.active:
            self.hand_over(self.segments[self.at])
        if self.at == self.end and here < REACH:
            self.hand_over(len(self.speeds))


def distance(place, x, y):
    """Distance in m from a place (x, y) to another."""
    return hypot(place[0] - x, place[1] - y)


def bend_speeds(places, speeds, limits):
    """Speed in m/s at which each of (N, 2) places is passed: as demonstrated, but so that bends can be turned and braked for.

    A fifth of the turning rate stays in hand for corrections.
    """
    steps = np.diff(places, axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    span = 3  # over 0.3 m, for a corner at a subgoal is turned within the look-ahead
    bend = np.abs(headings[2 * span :] - headings[: -2 * span]) / (2 * span * STEP) if len(headings) > 2 * span else [0.0]
    bend = np.pad(bend, (span, len(places) - span - len(bend)), mode="edge")
    speeds = np.minimum(speeds, 0.8 * limits.turn / np.maximum(bend, 1e-9))
    squares = speeds**2 - 2 * limits.acceleration * STEP * np.arange(len(speeds))  # v^2 may fall by 2 a s over s
    return np.sqrt(np.minimum.accumulate((squares)[::-1])[::-1] + 2 * limits.acceleration * STEP * np.arange(len(speeds)))


CONTROL_LAWS = {"plain": Plain, "pursuit": Pursuit}


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
        Anything with a `law` (SequencedLDS) and an `environment` (Environment).
    robot : Unicycle or LocalisedPioneer
        Where it stands is where it starts. It drives until the task is finished or given up.
    control : str
        "plain" or "pursuit", the better one.
    avoid : bool
        Go round obstacles; the paper's law does not.
    background : OccupancyGrid, optional
        Walls and furniture. Without it only the environment's boxes are known.
    kidnap : sequence of (float, (3,) sequence)
        At which times in s the robot is put at which poses.
    timeout : float
        Give up after this time in s.
    localise_within : float
        Give up when the robot has not known where it is for this time in s. Until it knows, it turns on the spot.

    Returns
    -------
    Run

    Raises
    ------
    ValueError
        For an unknown control law, a start, subgoal or kidnapping that is not finite, off the map or in an obstacle, or
        a time that is not positive.
    """
    if control not in CONTROL_LAWS:
        raise ValueError(f"control must be one of {sorted(CONTROL_LAWS)}, got {control!r}")
    if not (timeout > 0 and localise_within > 0):
        raise ValueError(f"timeout and localise_within must be positive, got {timeout} and {localise_within}")
    kidnap = sorted((float(time), tuple(pose)) for time, pose in kidnap)
    places = [*task.law.subgoals, robot.true_pose[:2], *(pose[:2] for _, pose in kidnap)]
    check_finite(places)
    obstacles = ObstacleMap.of(task.environment, background, places)
    check_places(task.law.subgoals, robot.true_pose, kidnap, obstacles)
    supervisor = CONTROL_LAWS[control](Guidance(task.law, obstacles if avoid else None), task.law.speeds, robot)
    records, reason = drive(supervisor, robot, list(kidnap), timeout, localise_within)
    return as_run(records, reason, obstacles, robot.period, [time for time, _ in kidnap])


def drive(supervisor, robot, kidnap, timeout, localise_within):
    """The control loop: one record (pose, true pose, segment, localised, touching) per period, and why it ended."""
    records, blind, still = [], 0.0, Stillness(robot.pose)
    record = partial(state, supervisor, robot)
    while True:
        now = len(records) * robot.period
        if kidnap and now >= kidnap[0][0] - 1e-9:
            robot.place(kidnap.pop(0)[1])
        records.append(record())
        x, y, theta = robot.pose
        if not isfinite(x + y + theta):
            reason = f"the pose must be finite, got {x, y, theta} at {now:.1f} s"
            break
        if not robot.localised:
            blind += robot.period
            command = 0.0, robot.limits.turn
        else:
            blind = 0.0
            command = supervisor.command(x, y, theta)
        reason = (
            (supervisor.done and "")
    ...
