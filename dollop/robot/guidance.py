"""Where a sequenced LDS sends a robot: its direction at any state, and the response from there (Sec. III).

Round obstacles, if it is told of any, and by a detour where the response does not get through.
"""

from collections import namedtuple
from dataclasses import dataclass
from functools import cached_property
from math import dist

import numpy as np

from dollop.checks import checked_number, put_in
from dollop.law.line import Fading
from dollop.lds import MOST_STEPS
from dollop.pose import towards
from dollop.robot.geodesic import Geodesic

__all__ = ["AT_END", "PIONEER_FOLLOWING", "PIONEER_LIMITS", "STEP", "Following", "Guidance", "Limits"]

STEP = 0.05
"""Distance in m between the places of a response that is pursued."""
FARTHEST, LONGEST = 100.0, 10_000.0
"""Lengths in m after which a response that has not come to its subgoal is given up: so far, or three
times as far as it is to the segment's line and along it; and in any case."""
AT_ONCE = 1_000_000
"""Pairs of places that are compared at once."""
AT_END = STEP
"""Distance in m from where a detour ends within which the robot has come there."""


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
