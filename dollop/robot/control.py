"""The supervisory control law that a sequenced LDS induces (end of Sec. III).

In segment k the law maps the current state to a direction, whatever brought the robot there:

    u(p) = (A_k - I)(p - g_k) / |(A_k - I)(p - g_k)|.

A segment stays in force until the robot has come to its subgoal g_k; then the next one takes over.
So a robot that is kidnapped keeps its segment: it goes on to the subgoal it was heading for, as the
user would have done from there. Two control laws make v and omega of it:

- `Plain` turns towards u and drives at the demonstrated speed; it knows nothing of what the robot
  can do. A segment hands over within 0.25 m of its subgoal.
- `Pursuit` rolls the response out from the current state and pursues a point ahead on it, slower
  where it bends. It is the response that comes back to the shown way after a push, and does not turn
  sharply at a subgoal (`dollop.law.line`). A segment hands over where the place on the response that
  is nearest to the robot belongs to the next.

Both drive at the speed that was shown there, and wait at a subgoal as long as the demonstrator did.

The paper gives neither the rule of handing over nor a controller: both are reconstructions.
"""

from bisect import bisect_right
from collections import namedtuple
from dataclasses import dataclass
from functools import cached_property
from math import atan2, copysign, cos, dist, inf, pi, sin, sqrt

import numpy as np

from dollop.checks import checked_number, put_in
from dollop.law.line import Fading
from dollop.lds import MOST_STEPS
from dollop.pose import wrapped
from dollop.robot.avoidance import CREEPING, Geodesic, towards

__all__ = [
    "AT_END",
    "CONTROL_LAWS",
    "PIONEER_FOLLOWING",
    "PIONEER_LIMITS",
    "STEP",
    "Following",
    "Guidance",
    "Limits",
]

STEP = 0.05
"""Distance in m between the places of a response that is pursued."""
FARTHEST, LONGEST = 100.0, 10_000.0
"""Lengths in m after which a response that has not come to its subgoal is given up: so far, or three
times as far as it is to the segment's line and along it; and in any case."""
AT_ONCE = 1_000_000
"""Pairs of places that are compared at once."""
AT_END = STEP
"""Distance in m from where a detour ends within which the robot has come there."""
FACING = 0.1
"""Angle in rad within which a robot that stands looks where it should."""


@dataclass(frozen=True)
class Following:
    """How a robot follows the law of a task (reconstruction); made for one of a Pioneer's size.

    Attributes
    ----------
    reach : float
        Distance in m from its subgoal at which a segment hands over: a robot that needs 0.6 m to
        turn would circle nearer ones.
    look_ahead : float
        How far ahead in m the pursued place is.
    stray : float
        Distance in m from its response at which it is rolled out anew from where the robot is.
    jump : float
        Distance in m that no robot drives in one control period, or twice what it can drive, where
        that is more: it has been kidnapped.
    patience : float
        Time in s without progress after which the way is changed or the speed halved; turning round
        takes half of it.
    least_speed : float
        Speed in m/s that a segment is driven at even where the user hardly moved.
    sharp : float
        Angle in rad from which a robot turns first and drives then.
    turn_gain : float
        Turning rate in rad/s per rad of heading error, at most one over the control period: the
        error fades within a third of a second, about as fast as a Pioneer's turning acceleration
        allows. On a bend the heading lags by turning rate / gain, and that is most of the plain
        law's distance: over twelve laws 78 mm on average with 2, 45 mm with 3.
    slowest : float
        Share of the demonstrated speed below which a robot that makes no progress gives up.

    Raises
    ------
    ValueError
        For what is not a positive number.

    Examples
    --------
    >>> Following(patience=0.0)
    Traceback (most recent call last):
    ValueError: patience must be in 1e-06 to 1e+06, got 0.0
    """

    reach: float = 0.25
    look_ahead: float = 0.35
    stray: float = 0.3
    jump: float = 0.3
    patience: float = 8.0
    least_speed: float = 0.1
    sharp: float = 1.2
    turn_gain: float = 3.0
    slowest: float = 1 / 16

    def __post_init__(self):
        put_in(
            self,
            **{name: checked_number(name, getattr(self, name), 1e-6, 1e6) for name in self.__match_args__},
        )


PIONEER_FOLLOWING = Following()
"""As measured with a Pioneer."""


class Limits(namedtuple("Limits", "speed turn acceleration turn_acceleration")):
    """What a robot can do, as CARMEN and Stage have it in their parameters.

    Attributes
    ----------
    speed : float
        In m/s.
    turn : float
        Turning rate in rad/s.
    acceleration : float
        In m/s^2, and as much of braking.
    turn_acceleration : float
        In rad/s^2.

    Raises
    ------
    ValueError
        For what is not a positive number, a millionth at least and a million at most; accelerations may
        be infinite.

    Examples
    --------
    >>> Limits(0.5, 0.8, 0.5, 0.0)
    Traceback (most recent call last):
    ValueError: turn_acceleration must be in 1e-06 to inf, got 0.0
    """

    __slots__ = ()

    def __new__(cls, speed, turn, acceleration, turn_acceleration):
        values = speed, turn, acceleration, turn_acceleration
        most = 1e6, 1e6, np.inf, np.inf  # without mass there is no limit
        checked = zip(cls._fields, values, most, strict=True)
        return super().__new__(cls, *(checked_number(name, value, 1e-6, end) for name, value, end in checked))

    @classmethod
    def _make(cls, values):
        return cls(*values)


PIONEER_LIMITS = Limits(0.5, 0.8, 0.5, 1.57)
"""Of a Pioneer 2 DX: speeds by CARMEN (p2d8+), accelerations by Stage (pioneer.inc)."""


class Guidance:
    """The direction of a sequenced LDS at any state (Sec. III), round obstacles if it is given any.

    Parameters
    ----------
    law : SequencedLDS
    obstacles : ObstacleMap, optional
        What to go round; the paper's law goes round nothing.
    rules : Following

    Attributes
    ----------
    goals : list of (float, float)
        Subgoal of each segment in m.
    lines : list of Line
        What each segment keeps to.
    pauses, headings : (K + 1,) sequences of float
        How long the demonstrator stood at the start and at each subgoal in s, and the directions in
        rad in which the law leaves the one and comes to the others.
    detours : dict
        For a segment whose response does not get through: the `Geodesic` to its subgoal that is
        followed instead, or, without obstacles, None for the straight line.

    Examples
    --------
    The direction is that of the step that the LDS would take from there.

    >>> from dollop.sequenced_lds import SequencedLDS
    >>> law = SequencedLDS.fit(np.linspace([0.0, 0.0], [3.0, 1.0], 50))
    >>> step = law.segments[0].step([1.0, 2.0]) - [1.0, 2.0]
    >>> bool(np.allclose(Guidance(law).direction(0, 1.0, 2.0), step / np.linalg.norm(step)))
    True
    """

    def __init__(self, law, obstacles=None, rules=PIONEER_FOLLOWING):
        self.law, self.obstacles = law, obstacles
        self._enough = rules.reach
        self.goals = [tuple(segment.goal.tolist()) for segment in law.segments]
        self._steps = [(segment.A - np.eye(2)).ravel().tolist() for segment in law.segments]
        self.lines = law.lines(STEP / 2)
        self.pauses = [0.0] * (len(self.goals) + 1) if law.pauses is None else law.pauses.tolist()
        self._relative = None if law.profile is None else law.profile / np.asarray(law.speeds)[:, None]
        self._weights = [lyapunov_weights(segment.A) for segment in law.segments]
        self.detours, self._geodesics = {}, {}

    @cached_property
    def headings(self):
        """List of K + 1 float: see the attributes."""
        return self.law.headings.tolist()

    def direction(self, k, x, y):
        """Direction in which a segment sends a robot (Sec. III).

        Parameters
        ----------
        k : int
            The segment.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        (float, float)
            Unit vector; zero at the subgoal.
        """
        (gx, gy), (a, b, c, d) = self.goals[k], self._steps[k]
        offset_x, offset_y = x - gx, y - gy
        return self._led(k, x, y, *towards(a * offset_x + b * offset_y, c * offset_x + d * offset_y))

    def _led(self, k, x, y, ux, uy):
        """The direction (ux, uy) of segment k at x, y in m, led round obstacles or by a detour."""
        if k not in self.detours:
            return self.obstacles.modulate(x, y, ux, uy) if self.obstacles else (ux, uy)
        if self.detours[k]:
            return self.detours[k].direction(x, y)
        return towards(*self.goals[k], x, y)

    def detour(self, k):
        """Leave the response of a segment for the shortest way to its subgoal (reconstruction).

        Parameters
        ----------
        k : int
            The segment.
        """
        if self.obstacles and k not in self._geodesics:
            self._geodesics[k] = Geodesic(self.obstacles, self.goals[k])
        self.detours[k] = self._geodesics.get(k)

    def remaining(self, k, x, y):
        """What falls on the way to a subgoal: a detour's length, else the Lyapunov measure |x|_P.

        P solves A^T P A - P = -I, and x is the offset from the subgoal. Along u the measure falls,
        for x^T P x is convex and falls from x to A x (reconstruction).

        Parameters
        ----------
        k : int
            The segment.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        float
            In m; `inf` where a detour does not lead to the subgoal.
        """
        if self.detours.get(k):
            return self.detours[k].distance(x, y)
        (gx, gy), (p, q, r) = self.goals[k], self._weights[k]
        x, y = x - gx, y - gy
        return (p * x * x + 2 * q * x * y + r * y * y) ** 0.5

    def reached(self, k, x, y, reach):
        """Whether a robot is within reach of a subgoal, or of where the detour to it ends.

        Such an end counts where it is no farther from the subgoal than where a segment hands over.

        Parameters
        ----------
        k : int
            The segment.
        x, y : float
            Where the robot is, in m.
        reach : float
            Distance in m.

        Returns
        -------
        bool
        """
        here, detour = (x, y), self.detours.get(k)
        if dist(self.goals[k], here) < reach:
            return True
        near = detour is not None and dist(detour.goal, self.goals[k]) <= self._enough
        return near and dist(detour.goal, here) < min(reach, AT_END)

    def shown_pace(self, k, places):
        """The speed that was shown at places of a segment, as a share of its mean.

        Parameters
        ----------
        k : int
            The segment.
        places : (N, 2) array_like
            In m.

        Returns
        -------
        (N,) float array
        """
        places = np.asarray(places, float)
        if self._relative is None:
            return np.ones(len(places))
        line, along = self.lines[k], self._relative[k]
        if len(places) == 1:
            share = line.way[line.nearest(places[0])] / max(line.way[-1], STEP)
            return along[[min(int(share * len(along)), len(along) - 1)]]
        parts = np.array_split(places, 1 + len(places) * len(line.places) // AT_ONCE)
        squared = (((part[:, None] - line.places) ** 2).sum(axis=2) for part in parts)
        nearest = np.concatenate([each.argmin(axis=1) for each in squared])
        share = line.way[nearest] / max(line.way[-1], STEP)
        return along[np.minimum((share * len(along)).astype(int), len(along) - 1)]

    def _leg(self, k, x, y, at=None):
        """Places 5 cm apart on the response of segment k from x, y in m, and whether it arrived.

        It is beside place `at` of the segment's line; by default beside the nearest.
        """
        if self.detours.get(k):
            places = list(map(tuple, self.detours[k].path(x, y, STEP).tolist()))
            return places, self.reached(k, *(places[-1] if places else (x, y)), STEP)
        places, line = [], Held(self.lines[k], x, y, at)
        for _ in range(round(line.farthest / STEP)):
            if self.reached(k, x, y, STEP):
                return places, True
            wish = towards(*line.ahead(x, y), x, y)
            ux, uy = self._led(k, x, y, *wish)
            x, y = x + STEP * ux, y + STEP * uy
            if (ux, uy) != wish:  # led elsewhere, the response goes on from there
                line.push(x, y)
            places.append((x, y))
        return places, False

    def way(self, k, x, y):
        """The responses of a segment and of all after it, rolled out one after the other.

        Where one does not arrive, a detour takes its place; where that does not arrive either, the
        way ends (reconstruction).

        Parameters
        ----------
        k : int
            The segment.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        places : list of (float, float)
            In m, 5 cm apart; the first is where the robot is.
        segments : list of int
            The segment that each belongs to.
        """
        places, segments = [(x, y)], [k]
        for segment in range(k, len(self.goals)):
            if segment > k:
                self.detours.pop(segment, None)
            at = 0 if segment > k else None
            leg, arrived = self._leg(segment, *places[-1], at)
            if not arrived:
                self.detour(segment)
                leg, arrived = self._leg(segment, *places[-1], at)
            if not arrived:
                break
            places += leg
            segments += [segment] * len(leg)
        return places, segments


class Held:
    """The response of a segment from x, y in m, which comes back to the segment's line.

    It is beside place `at` of the line, or of all the nearest.
    """

    def __init__(self, line, x, y, at=None):
        self.line, self.places = line, line.places.tolist()
        self.at, self.last = line.nearest((x, y)) if at is None else at, len(self.places) - 1
        away = dist(self.places[self.at], (x, y))
        self.farthest = min(max(FARTHEST, 3 * (away + float(line.way[-1]))), LONGEST)
        self.push(x, y)

    def push(self, x, y):
        """Go on from x, y in m, which is beside the nearest of the places that come next."""
        here = min(self.at, self.last)
        while here < self.last and dist(self.places[here + 1], (x, y)) <= dist(self.places[here], (x, y)):
            here += 1
        line_x, line_y = self.places[here]
        self.at, self.state = here, (x, y)
        self.fading = Fading(self.line, here, x - line_x, y - line_y)

    def ahead(self, x, y):
        """The first of the coming states that is 5 cm from x, y in m.

        Or the subgoal if it comes before, or is not there after a hundred thousand steps.
        """
        goal = self.places[-1]
        while dist(self.state, (x, y)) < STEP:
            late = self.at > self.last + MOST_STEPS
            if late or (self.at >= self.last and dist(self.state, goal) < STEP):
                return goal
            self.at += 1
            line_x, line_y = self.places[min(self.at, self.last)]
            offset_x, offset_y = self.fading.offset(self.at)
            self.state = line_x + offset_x, line_y + offset_y
        return self.state


def lyapunov_weights(A):
    """p, q, r of the P = [[p, q], [q, r]] that solves A^T P A - P = -I."""
    return np.linalg.solve(np.eye(4) - np.kron(A.T, A.T), [1, 0, 0, 1])[[0, 1, 3]].tolist()


class Supervisor:
    """Which segment is in force, and whether the robot gets on with it (Sec. III; reconstruction).

    Parameters
    ----------
    guidance : Guidance
    speeds : (K,) sequence of float
        At which each segment was demonstrated, in m/s.
    robot : Unicycle, or another
        Its limits, period and pose.

    rules : Following

    Attributes
    ----------
    active : int
        The segment in force.
    done : bool
        Whether the last one has handed over, and the robot has waited there.
    hopeless : bool
        Whether there is no progress, however slow the robot.
    waits : list of [int, float]
        Where the robot is still to stand, 0 being the start and k the k-th subgoal, and for how
        long in s, as the demonstrator did.
    stood : dict of int to float
        How long in s it has stood there.
    pace : float
        Share of the demonstrated speed. It is halved when there is no progress: the slower a robot,
        the more exactly it can follow the direction of the law, whose Lyapunov measure falls
        everywhere, and so every segment hands over.
    elapsed : float
        Time in s since the last command.
    standing : bool
        Whether the robot has been told to stand.
    leapt : bool
        Whether the last pose was one that no robot drives to in a period.
    edge, most : float
        How far in m it is from what is nearest, and the speed in m/s from which it can still brake in
        time.
    """

    def __init__(self, guidance, speeds, robot, rules=PIONEER_FOLLOWING):
        self.guidance, self.limits, self.rules = guidance, robot.limits, rules
        self.period = self.elapsed = robot.period
        self.speeds = [float(speed) for speed in speeds]
        self.active, self.handed_over, self.hopeless, self.standing = 0, False, False, True
        self.waits, self.stood = [], {}
        self.fastest = min(self.limits.speed, rules.look_ahead / (2 * self.period))
        self.gain = min(rules.turn_gain, 1 / self.period)
        self.patience = max(rules.patience, 2 * pi / self.limits.turn, 4 * STEP / self.limits.speed)
        self.jump = max(rules.jump, 2 * self.limits.speed * self.period)
        self.last, self.leapt, self.edge, self.most = None, False, inf, inf
        self.tight = guidance.obstacles.rules.tight if guidance.obstacles else 0.0
        self.expect_to_wait(0)
        self.restart()

    @property
    def done(self):
        """Bool: see the attributes."""
        return self.handed_over and not self.waits

    def restart(self):
        """Begin the segment in force: at its full pace, without a detour, and with new patience."""
        self.pace, self.best, self.waited = 1.0, inf, 0.0
        self.guidance.detours.pop(self.active, None)

    def notice_kidnapping(self, x, y):
        """Begin the segment in force afresh where the robot finds itself elsewhere."""
        self.leapt = self.last is not None and dist(self.last, (x, y)) > self.jump
        if self.leapt:
            if self.waits and self.waits[0][0]:  # carried off while it stood: back there
                self.active, self.handed_over, self.waits = self.waits[0][0] - 1, False, []
            self.restart()
        self.last, self.most = (x, y), inf

    def expect_progress(self, remaining, least):
        """Insist where `remaining` has not fallen by more than `least` for some time."""
        self.waited += self.elapsed
        if remaining < self.best - least:
            self.best, self.waited = remaining, 0.0
        elif self.waited > self.patience:
            self.insist()

    def insist(self):
        """Take a detour; where there is one already, halve the pace, and in the end give up."""
        self.best, self.waited = inf, 0.0
        if self.guidance.obstacles and self.active not in self.guidance.detours:
            self.guidance.detour(self.active)
        else:
            self.pace /= 2
            self.hopeless = self.pace < self.rules.slowest

    def hand_over(self, segment):
        """Put `segment` in force, once the robot has stood as long as was shown."""
        for place in range(self.active + 1, segment + 1):
            self.expect_to_wait(place)
        self.handed_over = segment == len(self.speeds)
        if not self.handed_over:
            self.active = segment
            self.restart()

    def begin(self, segment, waits, stood):
        """Put `segment` in force, where the robot is still to wait, and has waited, as told."""
        self.active, self.waits, self.stood = segment, waits, stood
        self.restart()

    def expect_to_wait(self, place):
        """Remember to stand at the start (0) or a subgoal, if the demonstrator did and the robot has not yet."""
        left = self.guidance.pauses[place] - self.stood.get(place, 0.0)
        if left >= self.period / 2:
            self.waits.append([place, left])
            self.stood.setdefault(place, 0.0)

    def wait(self, theta):
        """Brake, stand as long as was shown, and turn to where the demonstrator came from or went to."""
        place, left = self.waits[0]
        if self.standing:
            self.waits[0][1] = left - self.elapsed
            self.stood[place] += self.elapsed
        if self.waits[0][1] < self.elapsed / 2:
            self.waits.pop(0)
        error = wrapped(self.guidance.headings[place] - theta)
        return 0.0, self.turning(error) if self.standing and abs(error) > FACING else 0.0

    def turning(self, error):
        """Turning rate in rad/s by which an error in rad fades, and no faster than it can be ended."""
        most = min(self.gain * abs(error), sqrt(2 * self.limits.turn_acceleration * abs(error)))
        return copysign(min(most, self.limits.turn), error)

    def shown_speeds(self, k, places):
        """Speeds (N,) in m/s shown at places (N, 2) of segment k, within what the robot can."""
        speeds = self.speeds[k] * self.guidance.shown_pace(k, places)
        return np.clip(speeds, self.rules.least_speed, self.fastest)

    def arriving(self, x, y):
        """The speed in m/s from which the robot comes to rest where it is to stand, if that is next."""
        last = self.active + 1 == len(self.speeds)
        if not last and self.guidance.pauses[self.active + 1] < self.period / 2:
            return inf
        return max(
            sqrt(2 * self.limits.acceleration * dist(self.guidance.goals[self.active], (x, y))),
            CREEPING,
        )

    def look(self, x, y, theta):
        """See how near things are, and from which speed the robot can still brake in time."""
        if self.guidance.obstacles:
            braking = self.limits.acceleration, self.period
            self.edge, self.most = self.guidance.obstacles.edge_and_limit(x, y, theta, *braking)


class Plain(Supervisor):
    """Turn towards the law's direction, and drive at the demonstrated speed s.

    With e the heading error in rad, v = s cos e and omega = 3 e; where e is sharp, v = 0.
    """

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose in m and rad."""
        self.notice_kidnapping(x, y)
        if not self.waits and self.guidance.reached(self.active, x, y, self.rules.reach):
            self.hand_over(self.active + 1)
        if self.waits:
            return self.wait(theta)
        if self.handed_over:
            return 0.0, 0.0
        remaining = self.guidance.remaining(self.active, x, y)
        self.expect_progress(remaining, 0.02 * min(remaining, 1.0))
        ux, uy = self.guidance.direction(self.active, x, y)
        if ux == uy == 0.0:
            return 0.0, 0.0
        error = wrapped(atan2(uy, ux) - theta)
        shown = min(float(self.shown_speeds(self.active, [(x, y)])[0]), self.arriving(x, y))
        speed = 0.0 if abs(error) > self.rules.sharp else shown * self.pace * cos(error)
        self.look(x, y, theta)
        return min(speed, self.most), self.turning(error)


class Pursuit(Supervisor):
    """Pursue a point 0.35 m ahead on the response, no faster than the robot can turn there.

    The circle through robot and point has the curvature 2 sin(e) / distance (Coulter,
    "Implementation of the pure pursuit path tracking algorithm", CMU-RI-TR-92-01).
    """

    places = ((inf, inf),)  # no response yet: any pose is astray
    at = 0

    def __init__(self, guidance, speeds, robot, rules=PIONEER_FOLLOWING):
        super().__init__(guidance, speeds, robot, rules)
        self.ahead = max(round(rules.look_ahead / STEP), 1)

    def plan(self, x, y):
        """Roll the response out from x, y in m, and straight on beyond its end, to be pursued."""
        self.places, self.segments = self.guidance.way(self.active, x, y)
        self.at, self.end = 0, len(self.places) - 1
        last = len(self.speeds) - 1
        end_x, end_y = self.places[-1]
        ux, uy = towards(end_x, end_y, *self.places[max(self.end - 2, 0)])
        if ux == uy == 0.0:
            ux, uy = self.guidance.direction(last, end_x, end_y)
        on = range(1, self.ahead + 1)
        self.places += [(end_x + i * STEP * ux, end_y + i * STEP * uy) for i in on]
        places, segments = np.array(self.places), np.array(self.segments + [last] * self.ahead)
        speeds = np.empty(len(segments))
        for k in set(self.segments) | {last}:
            mine = segments == k
            speeds[mine] = self.shown_speeds(k, places[mine])
        speeds[self.stops(segments)] = CREEPING
        self.planned = bend_speeds(places, speeds, self.limits).tolist()

    def stops(self, segments):
        """Where among the places of segments (M,) the robot comes to rest: its waits and the end."""
        waits = np.array(self.guidance.pauses[1:]) >= self.period / 2
        ends = np.flatnonzero(np.diff(segments[: self.end + 1]) > 0)
        return [*ends[waits[segments[ends]]], self.end]

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose in m and rad."""
        self.notice_kidnapping(x, y)
        if dist(self.places[self.at], (x, y)) > self.rules.stray:
            self.plan(x, y)
        if not self.waits:
            self.came = self.came or self.guidance.reached(self.active, x, y, self.rules.reach)
            self.advance(x, y)
        if self.waits:
            return self.wait(theta)
        if self.handed_over:
            return 0.0, 0.0
        ahead = self.pursued(x, y)
        ux, uy = towards(*ahead, x, y)
        self.look(x, y, theta)
        if self.edge <= self.tight:
            ux, uy = self.guidance.obstacles.outwards(x, y, ux, uy)
        error = wrapped(atan2(uy, ux) - theta)
        curvature = 2 * sin(error) / max(dist(ahead, (x, y)), STEP)
        speed = self.pace * min(self.planned[self.at], self.limits.turn / max(abs(curvature), 1e-9))
        speed = min(speed, self.most)
        self.expect_progress(self.end - self.at, 0)
        off = abs(error)
        if off > self.rules.sharp or speed == 0.0 or (self.most < CREEPING and off > FACING):
            return 0.0, self.turning(error)
        return speed, curvature * speed

    def pursued(self, x, y):
        """The place 0.35 m ahead, or a nearer one where going straight there would cut a corner."""
        obstacles, farthest = self.guidance.obstacles, self.at + self.ahead
        if self.active in self.guidance.detours and not self.handed_over:  # a detour is driven to its end
            farthest = min(farthest, max(self.last_of(self.active), self.at + 1))
        for place in self.places[farthest : self.at + 1 : -1]:
            if not obstacles or not obstacles.cuts_corner(x, y, *place):
                return place
        return self.places[self.at + 1]

    def last_of(self, k):
        """Index of the last place of a segment that is in force."""
        return bisect_right(self.segments, k) - 1

    def restart(self):
        """As any supervisor does, and come to the subgoal anew."""
        super().restart()
        self.came = False

    def insist(self):
        """As any supervisor does, and roll the response out anew."""
        super().insist()
        self.places, self.at = Pursuit.places, 0

    def advance(self, x, y):
        """Move on to the nearest place in the look-ahead, and hand over where the response does.

        The whole look-ahead counts: before a sharp turn at a subgoal the next place may be farther
        off, and those after the turn nearer. No segment hands over before the robot has come within
        reach of its subgoal.
        """
        window = range(min(self.at + self.ahead, self.end), self.at - 1, -1)
        nearest = min(window, key=lambda i: dist(self.places[i], (x, y)))
        while self.segments[nearest] > self.active and self.came:
            self.hand_over(self.active + 1)
            self.came = self.guidance.reached(self.active, x, y, self.rules.reach)
        if self.segments[nearest] > self.active:
            nearest = self.last_of(self.active)
        self.at = nearest
        if self.at == self.end and self.guidance.reached(self.active, x, y, self.rules.reach):
            self.hand_over(self.active + 1)


def bend_speeds(places, speeds, limits):
    """Speeds (N,) in m/s at which to pass places (N, 2): as demonstrated, but slower in bends.

    A fifth of the turning rate stays in hand for corrections. Before a bend the speed falls no
    faster than it can.
    """
    steps = np.diff(places, axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    headings = np.pad(headings, (3, 4), mode="edge")  # a corner at a subgoal is turned within 0.3 m
    bends = np.abs(headings[6:] - headings[:-6]) / (6 * STEP)
    speeds = np.minimum(speeds, 0.8 * limits.turn / np.maximum(bends, 1e-9))
    braked = 2 * limits.acceleration * STEP * np.arange(len(places))  # v^2 falls by 2 a s over s
    return np.sqrt(np.minimum.accumulate((speeds**2 + braked)[::-1])[::-1] - braked)


CONTROL_LAWS = {"plain": Plain, "pursuit": Pursuit}
"""By name: classes whose `command` takes a pose and returns v in m/s and omega in rad/s."""
