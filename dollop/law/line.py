r"""The line that a sequenced LDS keeps to, and the way back to it after a push (beyond the paper).

The response of segment k from the subgoal before to its own, r[n+1] - g = A (r[n] - g), is what was
shown. For any place r on it the LDS is

    p' = r' + A (p - r),    r' = g + A (r - g):

it moves the place on, and lets the offset e = p - r shrink as it may. Near the line the offset
decays by a rate of its own instead, e' = B e with

    B = (1 - w) A + w c I,    w = exp(-|e|^2 / d^2),    0 <= c < 1,

d being half the segment's way; far from the line w is 0, and the LDS is alone.

Theorem. Whatever the data, no step lets the offset grow, and every segment hands over after
finitely many of them, from any start. Proof. In the segment's Lyapunov norm |e|_V^2 = e^T G0^-1 e
there is a q < 1 such that |A e|_V <= q |e|_V (see `LDS.lyapunov`; G0 is regular). So for any w from
0 to 1

    |B e|_V <= (1 - w) q |e|_V + w c |e|_V <= max(q, c) |e|_V.

Meanwhile n goes up by one with every step, whatever e is: r[n] comes to g, since A is stable, and e
to 0, since c <= |a| < 1, a being the segment's decay. Between two steps, where e is a mean of e and
B e, it is no larger than at the first. Nothing of this hangs on r being the response: any line that
ends in g will do.

That last is made use of: where two segments meet, the line is rounded, so that its direction is
continuous. It still passes every subgoal.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, hypot

import numpy as np

from dollop.lds import MOST_STEPS, powers_on
from dollop.trajectory import arc_length

__all__ = ["FADE", "Fading", "Line", "check_ends", "lines_of"]

FADE = 0.15
"""m of way over which an offset from the line fades to 1/e: about the distance between the wheels and
the centre of a robot, which turns on the spot. In less the way back would be a corner, and in more
a
push at one object would not be over at the next."""

PARTS = 64  # of a segment's way, no place being farther from the next: 4 cm of 3 m
ROUNDED = 1 / 3  # of a segment's way at each of its ends, where the line is rounded
AROUND = 0.04  # share of the way over which the direction is measured where the rounding begins
BEGINS = 1 - ROUNDED + AROUND * np.array([-1.0, 0.0, 1.0])
BULGE = 1 + 2**0.5  # the least curvature, in 1 / length, that turns an end by 1 rad and comes back


@dataclass(frozen=True, eq=False)
class Line:
    """What a segment of a law keeps to, from the subgoal before to its own.

    Attributes
    ----------
    places : (V, 2) float array
        m; the last is the subgoal.
    steps : (V,) float array
        Of the segment's LDS, from 0 on; whole ones and shares between.
    A : (2, 2) float array
        The matrix of the LDS.
    decay : float
        The size of its decay per step, below one.
    """

    places: np.ndarray
    steps: np.ndarray
    A: np.ndarray
    decay: float

    @classmethod
    def of(cls, lds, start, reach):
        """The response of an LDS from a start, to within reach of its subgoal and on into it.

        Parameters
        ----------
        lds : LDS
        start : (2,) float array
            m.
        reach : float
            m.

        Returns
        -------
        Line
            Its places lie at most a 64th of the way apart, on the smooth (Catmull-Rom) curve
            through the states.

        Raises
        ------
        ValueError
            See `check_ends`.

        Examples
        --------
        >>> from dollop.lds import LDS
        >>> line = Line.of(LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]]), np.array([0.0, 1.0]), 0.01)
        >>> line.places[[0, -1]]
        array([[0., 1.],
               [2., 0.]])
        """
        states = np.vstack([states_to(lds, start, reach), lds.goal])
        way = arc_length(states)
        counts = np.ceil(PARTS * (way[1:] - way[:-1]) / max(way[-1], reach)).astype(int).clip(1)
        ends = counts.cumsum()
        after = np.arange(ends[-1]) - (ends - counts).repeat(counts)
        steps = np.arange(len(counts)).repeat(counts) + after / counts.repeat(counts)
        steps = np.append(steps, len(counts))
        return cls(curve(states, steps), steps, lds.A, abs(float(lds.statistics.decay)))

    @cached_property
    def way(self):
        """(V,) float array: the way to each place, m."""
        return arc_length(self.places)

    @cached_property
    def numbers(self):
        """Steps and ways (lists of V float) and the matrix (4 float), for what goes place by place."""
        return self.steps.tolist(), self.way.tolist(), self.A.ravel().tolist()

    def nearest(self, place):
        """The place of the line that is nearest to another.

        Parameters
        ----------
        place : (2,) array_like
            m.

        Returns
        -------
        int
            Its index.
        """
        return int(np.hypot(*(self.places - place).T).argmin())

    def follow(self, start, at, reach):
        """The way from a place beside the line, back to it and on to within reach of the subgoal.

        Parameters
        ----------
        start : (2,) array_like
            m.
        at : int
            Index of the line's place from which the start counts as pushed aside.
        reach : float
            m.

        Returns
        -------
        places : (M, 2) float array
            Of the line, m, in order; the last ones are the subgoal until the offset has faded.
        offsets : (M, 2) float array
            From them, m.

        Raises
        ------
        ValueError
            See `check_ends`.

        Examples
        --------
        Pushed aside by half a metre, it is back on a straight line within one.

        >>> from dollop.lds import LDS
        >>> lds = LDS.fit(np.linspace([0.0, 0.0], [4.0, 0.0], 50))
        >>> line = Line.of(lds, np.zeros(2), 0.01)
        >>> places, offsets = line.follow([1.0, 0.5], line.nearest([1.0, 0.5]), 0.01)
        >>> bool(np.abs(offsets[places[:, 0] > 2.0]).max() < 0.01)
        True
        """
        places, offset = self.places[at:], np.asarray(start, float) - self.places[at]
        if not offset.any():
            return places, np.zeros_like(places)
        fading = Fading(self, at, *offset.tolist())
        offsets = [fading.offset(i) for i in range(at, len(self.places))]
        last = len(self.places)
        while np.hypot(*offsets[-1]) > reach:
            check_ends(last - len(self.places), self.places[-1], reach)
            offsets.append(fading.offset(last))
            last += 1
        rest = np.tile(places[-1], (len(offsets) - len(places), 1))
        return np.vstack([places, rest]), np.array(offsets)


class Fading:
    """An offset from a line as the place on the line moves on: e' = B e, step by step.

    Parameters
    ----------
    line : Line
    at : int
        Index of the place that the offset is from.
    x, y : float
        The offset, m.
    """

    def __init__(self, line, at, x, y):
        self.steps, self.ways, self.matrix = line.numbers
        self.decay, self.near = line.decay, max(self.ways[-1] / 2, 1e-9)
        self.whole = self.steps[at], self.ways[at], x, y
        self.at = at

    def offset(self, i):
        """The offset at a place of the line.

        Parameters
        ----------
        i : int
            Index of the place, not before that of an earlier call; beyond the last, so many steps
            at the subgoal.

        Returns
        -------
        (float, float)
            In m.
        """
        last = len(self.steps) - 1
        step, way = self.steps[min(i, last)] + max(i - last, 0), self.ways[min(i, last)]
        while step > self.whole[0] + 1:
            self.whole = self._moved(1.0, self._way_at(self.whole[0] + 1))
        return self._moved(step - self.whole[0], way)[2:]

    def _way_at(self, step):
        """The way in m to a step, not before an earlier one."""
        while self.at < len(self.steps) - 1 and self.steps[self.at] < step:
            self.at += 1
        after, before = self.at, max(self.at - 1, 0)
        taken = self.steps[after] - self.steps[before]
        share = min((step - self.steps[before]) / taken, 1.0) if taken else 1.0
        return self.ways[before] + share * (self.ways[after] - self.ways[before])

    def _moved(self, share, way):
        """Step, way in m and offset after a share of a step that leads on to so much way."""
        step, begun, x, y = self.whole
        (a, b, c, d), held = self.matrix, exp(-(x * x + y * y) / self.near**2)
        kept = held * min(exp((begun - way) / FADE), self.decay**share) + (1 - held) * (1 - share)
        along = (1 - held) * share
        return (
            step + share,
            way,
            kept * x + along * (a * x + b * y),
            kept * y + along * (c * x + d * y),
        )


def check_ends(steps, goal, reach):
    """Refuse to follow a response any longer that has not come within reach of its subgoal.

    Every one comes there, but some do so too late: where an LDS hardly decays, or where
    coordinates are so large that none need lie within reach of another.

    Parameters
    ----------
    steps : int
        So many were taken.
    goal : (2,) float array
        m.
    reach : float
        m.

    Raises
    ------
    ValueError
        From 100,000 steps on (`dollop.lds.MOST_STEPS`).
    """
    if steps >= MOST_STEPS:
        rule = f"a response must come within {reach:g} m of its subgoal in {MOST_STEPS} steps"
        raise ValueError(f"{rule}, got one to ({goal[0]:.6g}, {goal[1]:.6g}) that does not")


def states_to(lds, start, reach):
    """States (N, 2) of an LDS from a start to the last one that is not within reach of its subgoal."""
    offset, count = start - lds.goal, 64
    while True:
        states = powers_on(lds.A, offset, min(count, MOST_STEPS))
        near = np.hypot(*states.T) <= reach
        if near.any():
            return lds.goal + states[: max(int(near.argmax()), 1)]
        check_ends(count, lds.goal, reach)
        count *= 4


def curve(states, steps):
    """Places (V, 2) at fractional steps (V,) on the Catmull-Rom curve through states (N, 2)."""
    first, last = 2 * states[0] - states[1], 2 * states[-1] - states[-2]
    if len(states) > 2:  # a parabola goes through the first three
        first = 3 * states[0] - 3 * states[1] + states[2]
    slopes = (np.vstack([states[1:], last]) - np.vstack([first, states[:-1]])) / 2
    n = np.minimum(steps.astype(int), len(states) - 2)
    u = (steps - n)[:, None]
    chord = states[n + 1] - states[n]
    return states[n] + u * (chord + (1 - u) * ((1 - u) * (slopes[n] - chord) - u * (slopes[n + 1] - chord)))


def lines_of(segments, start, corners, reach):
    """The lines of all segments of a law, rounded where two meet.

    Parameters
    ----------
    segments : sequence of K LDS
    start : (2,) float array
        m.
    corners : (K,) bool array
        Where a corner was shown, and is kept.
    reach : float
        m, to which the responses are rolled out.

    Returns
    -------
    list of K Line

    Examples
    --------
    Two straight segments at a right angle:

    >>> from dollop.lds import LDS
    >>> ways = np.linspace([0, 0], [2.0, 0], 40), np.linspace([2.0, 0], [2.0, 2.0], 40)
    >>> segments = [LDS.fit(way) for way in ways]
    >>> before, after = lines_of(segments, np.zeros(2), np.array([False, False]), 0.01)
    >>> steps = before.places[-1] - before.places[-2], after.places[1] - after.places[0]
    >>> arriving, going_on = (np.degrees(np.arctan2(*step[::-1])) for step in steps)
    >>> bool(40 < arriving < going_on < 50)
    True
    """
    starts = [start, *(segment.goal for segment in segments[:-1])]
    lines = [Line.of(lds, place, reach) for lds, place in zip(segments, starts, strict=True)]
    for k in np.flatnonzero(~np.asarray(corners[:-1], bool)):
        lines[k : k + 2] = rounded(*lines[k : k + 2])
    return lines


def rounded(before, after):
    """Two lines that meet at a subgoal, which both now pass in one direction.

    Over a share of the way on both sides, a parabola from the line to the subgoal takes its place,
    and on it a bulge that turns its end and is nothing else: of all that do so it has the least
    curvature. The common direction is the one for which the curvature is the same on both sides.
    """
    first, second = Half.of(before.places), Half.of(after.places[::-1])
    if first is None or second is None:
        return before, after
    turn = (second.bend - first.bend) / BULGE + first.end / first.length - second.end / second.length
    direction = turn / (1 / first.length + 1 / second.length)
    places = first.places(direction), second.places(-direction)[::-1]
    return replace(before, places=places[0]), replace(after, places=places[1])


@dataclass(frozen=True, eq=False)
class Half:
    """One half of a rounding: a line (V, 2) in m that leads to the subgoal, and where it is left.

    Attributes
    ----------
    line : (V, 2) float array
        m.
    way : (V,) float array
        Along it, m.
    place, direction : (2,) float arrays
        Where the rounding begins, m, and the unit vector of the line there.
    length : float
        Distance from the place to the subgoal, m.
    """

    line: np.ndarray
    way: np.ndarray
    place: np.ndarray
    direction: np.ndarray
    length: float

    @classmethod
    def of(cls, line):
        """The half of a line; None where it is too short to have a direction."""
        way = arc_length(line)
        if not way[-1] > 0:
            return None
        at = way[-1] * BEGINS
        places = (np.interp(at, way, column).tolist() for column in line.T)
        (tail, x, head), (tail_y, y, head_y) = places
        size, length = hypot(head - tail, head_y - tail_y), hypot(line[-1, 0] - x, line[-1, 1] - y)
        if min(size, length) < 1e-9 * way[-1]:
            return None
        direction = np.array([(head - tail) / size, (head_y - tail_y) / size])
        return cls(line, way, np.array([x, y]), direction, length)

    @cached_property
    def bend(self):
        """(2,) float array: of the parabola, 1/m."""
        return 2 * ((self.line[-1] - self.place) / self.length - self.direction) / self.length

    @property
    def end(self):
        """(2,) float array: the direction in which the parabola comes to the subgoal."""
        return self.direction + self.length * self.bend

    def places(self, direction):
        """The line (V, 2), rounded so that it comes to the subgoal in a direction (2,)."""
        left = (self.way[-1] - self.way) / (ROUNDED * self.way[-1])
        first = len(left) - int(np.searchsorted(left[::-1], 1.0))
        u = left[first:, None]
        t = self.length * (1 - u)
        bulge = np.where(u < 0.5**0.5, u - BULGE / 2 * u**2, BULGE / 2 * (1 - u) ** 2)
        places = self.line.copy()
        places[first:] = self.place + t * self.direction + t**2 * (self.bend / 2)
        places[first:] -= bulge * (self.length * (direction - self.end))
        return places
