"""Which way of a task a robot drives, and when it changes to another (beyond the paper).

A task that was shown in several ways has a law for each. What a way is like among obstacles is
found by rolling its response out twice, with obstacles and without. It is *free* where the one
keeps near the other,

    max_p min_q |p - q| <= 2 r + d    in every segment, p on the one, q on the other,

with r the robot's radius and d the distance within which obstacles turn it: so far aside it may be
led by a thing no wider than itself. What leads it farther off is no thing to go round, but closes
the way.

The way in force is blocked where the robot makes no progress, or where a new obstacle closes it.
Then it changes to another way that is free, at the nearest place by driving that lies no farther
along than the robot has come.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, cos, inf, isfinite, sin

import numpy as np

from dollop.checks import Note, check_has
from dollop.robot.control import CONTROL_LAWS
from dollop.robot.geodesic import Geodesic
from dollop.robot.guidance import AT_END, PIONEER_FOLLOWING, STEP, Guidance
from dollop.trajectory import distance_to_polyline

__all__ = ["Way", "WayKeeper", "counterpart", "extra_length", "fitting"]

FINER = 3
"""Into how many cells along each side those of a map are divided on which no way is found."""
SAME = 0.25
"""Distance in m within which two ways are one, and a robot stands where one begins."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way of doing a task (beyond the paper).

    Attributes
    ----------
    index : int
        Among the ways of the task, the most often shown first.
    law : SequencedLDS
    shown : int
        How often it was shown.
    """

    index: int
    law: object
    shown: int = 1

    @cached_property
    def _response(self):
        """Places (M, 2) in m on the response from the way's start, 5 cm apart; segments (M,)."""
        return tuple(map(np.array, Guidance(self.law).way(0, *self.law.start.tolist())))

    @property
    def places(self):
        """(M, 2) float array: the response from the demonstrations' start, 5 cm apart, in m."""
        return self._response[0]

    @property
    def segments(self):
        """(M,) int array: the segment that each place belongs to."""
        return self._response[1]

    def leg(self, k):
        """The places of one segment.

        Parameters
        ----------
        k : int
            The segment.

        Returns
        -------
        (L, 2) float array
            In m, from the subgoal before on.
        """
        first, end = np.searchsorted(self.segments, [k, k + 1])
        return self.places[min(max(first - 1, 0), len(self.places) - 1) : max(end, 1)]

    def nearest(self, k, x, y):
        """The place in a segment that is nearest to a robot.

        Parameters
        ----------
        k : int
            The segment.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        int
            Index into `places`.
        """
        end = np.searchsorted(self.segments, k + 1)
        leg = self.leg(k)
        return int(end - len(leg) + np.hypot(*(leg - [x, y]).T).argmin())


def extra_length(way, obstacles, k, x, y):
    """How much longer obstacles make a way, where they close it (reconstruction).

    Parameters
    ----------
    way : Way
    obstacles : ObstacleMap or None
    k : int
        The segment to begin with.
    x, y : float
        Where to begin, in m.

    Returns
    -------
    float
        In m. 0 where the way is free: where it is led aside nowhere by more than what a thing as
        wide as the robot needs. `inf` where it does not get through, or where a subgoal is off the
        map or in an obstacle.

    Examples
    --------
    A stool is gone round; a wall of 6 m is not.

    >>> from dollop.environment import Environment
    >>> from dollop.robot.avoidance import ObstacleMap
    >>> from dollop.sequenced_lds import SequencedLDS
    >>> way = Way(0, SequencedLDS.fit(np.linspace([0.0, 0.0], [6.0, 0.0], 50)))
    >>> for box in ([2.8, -0.2, 3.2, 0.1], [2.8, -3.0, 3.2, 3.0]):
    ...     obstacles = ObstacleMap.of(Environment([box]), places=[[0, 0], [6, 0]])
    ...     print(extra_length(way, obstacles, 0, 0.0, 0.0) > 0)
    False
    True
    """
    if obstacles is None:
        return 0.0
    if not all(_can_be(obstacles, *goal) for goal in way.law.subgoals[k:].tolist()):
        return inf
    guidance = Guidance(way.law, obstacles)
    led, segments = map(np.array, guidance.way(k, x, y))
    closed, end = False, led[0]
    for segment in range(k, len(way.law.segments)):
        leg = led[segments == segment]
        end = leg[-1] if len(leg) else end
        if not guidance.reached(segment, *end, STEP):
            return inf
        closed |= len(leg) and _astray(leg, way.leg(segment), obstacles)
    own = len(way.places) - way.nearest(k, x, y)
    return max(STEP * (len(led) - own), STEP) if closed else 0.0


def _can_be(obstacles, x, y):
    """Whether a place in m is on the map and in no obstacle."""
    return obstacles.holds(x, y) and obstacles.edge(x, y) > -obstacles.radius


def _astray(leg, own, obstacles):
    """Whether places (N, 2) are led farther from a way's own (M, 2) than round what is gone round."""
    return distance_to_polyline(leg, own).max() > 2 * obstacles.radius + obstacles.rules.influence


def counterpart(way, other, at):
    """The place of another way that is as far along as a place of this one (reconstruction).

    What both have in common at the beginning and at the end counts by length, what lies between by
    its share: two ways round a table have come equally far half-way round it.

    Parameters
    ----------
    way, other : Way
    at : int
        Index into `way.places`.

    Returns
    -------
    int
        Index into `other.places`.

    Examples
    --------
    >>> from dollop.sequenced_lds import SequencedLDS
    >>> left, right = (Way(0, SequencedLDS.fit([[0, 0], [1, y], [2, 0.0]])) for y in (-1.0, 1.0))
    >>> half = len(left.places) // 2
    >>> abs(counterpart(left, right, half) - half) <= 1
    True
    """
    near = distance_to_polyline(way.places, other.places) <= SAME
    near_other = distance_to_polyline(other.places, way.places) <= SAME
    size, size_other = len(near), len(near_other)
    before = min(_run_of_true(near), _run_of_true(near_other))
    after = min(_run_of_true(near[::-1]), _run_of_true(near_other[::-1]))
    after = min(after, size - before, size_other - before)
    if at < before:
        return at
    if at >= size - after:
        return size_other - size + at
    share = (at - before) / (size - before - after)
    return before + int(share * (size_other - before - after))


def _run_of_true(flags):
    """How many flags (N,) are true before the first that is not."""
    return int(np.append(flags, False).argmin())


@dataclass(frozen=True)
class _Option:
    """A way to be driven from a segment on: how much longer it gets, how far off it is, in m."""

    way: Way
    segment: int
    extra: float
    misfit: float


def fitting(options):
    """Of ways that could be driven, the one to drive (reconstruction).

    Parameters
    ----------
    options : sequence
        Each with `extra` (m, how much longer obstacles make it), `misfit` (m, how far the robot is
        off it) and `way`, a `Way`.

    Returns
    -------
    object
        One of the options. A free one before one that is closed; of these the one that fits best,
        of those that fit as well within 0.25 m the one shown most often.
    """
    least = min(each.extra for each in options)
    options = [each for each in options if each.extra == least]
    off = min(each.misfit for each in options)
    options = [each for each in options if each.misfit <= off + SAME]
    return max(options, key=lambda each: (each.way.shown, -each.way.index))


class WayKeeper:
    """Which way is in force, and the supervisor that drives it (reconstruction).

    Parameters
    ----------
    laws : sequence of SequencedLDS
        One for each way, the most often shown first.
    shown : sequence of int
        How often each was shown.
    robot : Unicycle, or another
    control : str
        A name of `CONTROL_LAWS`.
    chart : callable
        Makes an ObstacleMap of boxes (N, 4) in m that stand there beside what is known.
    avoid : bool
        Go round obstacles.
    rules : Following

    Attributes
    ----------
    known : ObstacleMap
        What is known to stand there.
    way : int
        Index of the way in force.
    left : dict of int to (float, float)
        The ways that the robot has left because it made no progress, and where in m.
    refused : str
        Why no way can be driven from where the robot began; empty if one can.
    lines : dict of int to list of Line
        What the segments keep to, of the ways that were in force.
    supervisor : Supervisor
        Of the way in force.
    """

    def __init__(self, laws, shown, robot, control, chart, avoid=True, rules=PIONEER_FOLLOWING):
        self.ways = [Way(i, law, n) for i, (law, n) in enumerate(zip(laws, shown, strict=True))]
        self.robot, self.control, self.chart, self.avoid, self.rules = (
            robot,
            control,
            chart,
            avoid,
            rules,
        )
        self.noticed, self.felt, self.left = np.empty((0, 4)), np.empty((0, 4)), {}
        self.begun, self.refused, self.lines, self.finer, self.joined = False, "", {}, 1, 0
        self.remap()
        self.enter(self.ways[0])

    @property
    def active(self):
        """Int: the segment in force, of the way in force."""
        return self.supervisor.active

    @property
    def done(self):
        """Bool: whether the last segment of the way in force has handed over."""
        return self.supervisor.done

    @property
    def hopeless(self):
        """Bool: whether there is no progress, and no other way to change to."""
        return self.supervisor.hopeless

    def reason(self, x, y):
        """Where there is no progress, of which way, and what is the matter with the others.

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        str
        """
        closed = self.closed(self.ways[self.way], self.active, x, y)
        told = closed or f"no progress towards subgoal {self.active + 1}"
        if len(self.ways) == 1:
            return told
        others = (self._tell(way.index) for way in self.ways if way.index != self.way)
        return f"{told}{', on' if closed else ' of'} way {self.way} ({', '.join(others)})"

    def _tell(self, way):
        """What is the matter with a way that is not in force."""
        if way not in self.left:
            return f"way {way} is closed"
        return "way {} was left at ({:.2f}, {:.2f})".format(way, *self.left[way])

    def needs(self):
        """How near the robot must come to each subgoal of the way in force.

        Returns
        -------
        (K,) float array
            In m: where a segment hands over, or as near as there is room.
        """
        goals = self.ways[self.way].law.subgoals.tolist()
        if self.obstacles is None:
            return np.full(len(goals), self.rules.reach)
        return np.array([max(self.rules.reach, self.obstacles.nearest_room(*goal) + AT_END) for goal in goals])

    def waits(self):
        """How the robot has waited.

        Returns
        -------
        list of [int, float, float]
            Of each pause of the way in force, from where it was joined on: its place (0 the start, k
            the k-th subgoal), and how long in s it was shown and kept.
        """
        supervisor = self.supervisor
        shown = list(enumerate(supervisor.guidance.pauses))[self.joined + 1 if self.joined else 0 :]
        return [[k, s, supervisor.stood.get(k, 0.0)] for k, s in shown if s >= supervisor.period / 2]

    def notes(self):
        """What the robot noticed that the task's environment does not have.

        Returns
        -------
        tuple of Note
        """
        if not len(self.noticed):
            return ()
        x, y = (self.noticed[0, :2] + self.noticed[0, 2:]) / 2
        what = "an object" if len(self.noticed) == 1 else f"{len(self.noticed)} objects"
        text = f"the robot noticed {what} at ({x:.2f}, {y:.2f}) that its map does not have: look and adapt the task"
        return (Note("changed", text),)

    def closed(self, way, segment, x, y):
        """Why no way leads to the subgoals of a way.

        Parameters
        ----------
        way : Way
        segment : int
            From whose subgoal on.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        str
            Empty if there is one.
        """
        if self.obstacles is None:
            return ""
        for k, goal in enumerate(way.law.subgoals.tolist()[segment:], segment):
            told = self.obstacles.no_way((x, y), goal, self.rules.reach)
            if told:
                return told.format(f"subgoal {k + 1}")
        return ""

    def look_closer(self):
        """Map what is known by finer cells, between which narrower ways lead straighter.

        Returns
        -------
        bool
            Whether that is new.
        """
        if self.finer > 1 or self.obstacles is None:
            return False
        self.finer = FINER
        self.remap()
        return True

    def remap(self):
        """Map what is known to stand there, and what the robot has felt."""
        self.known = self.chart(self.noticed, self.finer)
        felt = self.chart(np.vstack([self.noticed, self.felt]), self.finer) if len(self.felt) else self.known
        self.obstacles = felt if self.avoid else None

    def enter(self, way, segment=None):
        """Put a way in force, from its start or from a segment on.

        Parameters
        ----------
        way : Way
        segment : int, optional
        """
        guidance, waited, last = Guidance(way.law, self.obstacles, self.rules), ([], {}), None
        if segment is not None:
            last = self.supervisor.last
            if way.index == self.way:
                waited = self.supervisor.waits, self.supervisor.stood
            else:
                self.joined = segment
        self.way, self.lines[way.index] = way.index, guidance.lines
        self.supervisor = CONTROL_LAWS[self.control](guidance, way.law.speeds, self.robot, self.rules)
        if segment is not None:
            self.supervisor.begin(segment, *waited)
            self.supervisor.last = last

    def command(self, x, y, theta, elapsed, standing):
        """v in m/s and omega in rad/s for a pose, on the way that fits and is free.

        Parameters
        ----------
        x, y, theta : float
            Pose in m and rad.
        elapsed : float
            Time in s since the last command.
        standing : bool
            Whether the robot has been told to stand.

        Returns
        -------
        command : (float, float)
        most : float
            Speed in m/s from which the robot can still brake in time.
        """
        self.notice(x, y)
        self.supervisor.elapsed = elapsed
        if len(self.ways) > 1 and self.out_of_patience(x, y):
            self.leave(x, y, theta, longest=0.0)
        self.supervisor.elapsed, self.supervisor.standing = elapsed, standing
        command = self.supervisor.command(x, y, theta)
        if len(self.ways) > 1 and self.hopeless and self.leave(x, y, theta, longest=inf):
            self.supervisor.elapsed, self.supervisor.standing = elapsed, standing
            command = self.supervisor.command(x, y, theta)
        here = self.ways[self.way]
        if self.hopeless and self.look_closer():
            self.enter(here, self.active)
        return command, self.supervisor.most

    def begin(self, x, y):
        """Put the way in force that fits the start and is free, once.

        A robot at the start of a way takes one that starts there; elsewhere one on which it stands.

        Parameters
        ----------
        x, y : float
            In m.
        """
        if self.begun:
            return
        self.begun = True
        if self._has_noticed():
            self.enter(self.ways[0])
        closed = [self.closed(way, 0, x, y) for way in self.ways]
        others = f", on way 0 ({len(closed) - 1} more are closed)" if len(closed) > 1 else ""
        if all(closed) and self.look_closer():
            closed = [self.closed(way, 0, x, y) for way in self.ways]
            self.enter(self.ways[0])
        self.refused = closed[0] + others if all(closed) else ""
        if len(self.ways) > 1 and not self.refused:
            self._choose(x, y)

    def _choose(self, x, y):
        """Put the way in force that fits x, y in m and is free."""
        from_starts = [float(np.hypot(*(way.law.start - [x, y]))) for way in self.ways]
        misfits = from_starts
        if min(from_starts) > SAME:
            misfits = [float(distance_to_polyline([[x, y]], way.places)[0]) for way in self.ways]
        last = [way.segments.searchsorted(1) - 1 for way in self.ways]
        options = self.options(self.ways, last, x, y)
        pairs = zip(options, misfits, strict=True)
        options = [replace(each, segment=0, misfit=off) for each, off in pairs]
        self.enter(fitting(options).way)

    def options(self, ways, last, x, y):
        """How ways could be joined by a robot, each at the nearest place up to a last one.

        Parameters
        ----------
        ways : sequence of Way
        last : sequence of int
            Indices into their `places`.
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        list
            As `fitting` takes them.
        """
        geodesic = Geodesic(self.obstacles, (x, y)) if self.obstacles else None
        return [self._option(way, end, geodesic, x, y) for way, end in zip(ways, last, strict=True)]

    def _option(self, way, last, geodesic, x, y):
        places = way.places[: max(last, 0) + 1]
        away = np.hypot(*(places - [x, y]).T)
        if geodesic:
            away = np.array([geodesic.distance(*place) for place in places.tolist()])
            away[self.obstacles.edges(places) <= 0] = inf
        at = int(away.argmin())
        segment = int(way.segments[at])
        reached = isfinite(away[at])
        extra = extra_length(way, self.obstacles, segment, *places[at].tolist()) if reached else inf
        return _Option(way, segment, extra, float(away[at]))

    def others(self, x, y):
        """The ways that the robot could change to, as `fitting` takes them.

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        list
        """
        here = self.ways[self.way]
        at = here.nearest(self.active, x, y)
        ways = [way for way in self.ways if way.index != self.way and way.index not in self.left]
        return self.options(ways, [counterpart(here, way, at) for way in ways], x, y)

    def notice(self, x, y):
        """Map what the robot has noticed, and change where that closes the way in force.

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.
        """
        if not self._has_noticed() or self.obstacles is None:
            return
        here = self.ways[self.way]
        extra = extra_length(here, self.obstacles, self.active, x, y)
        stay = _Option(here, self.active, extra, 0.0)
        others = self.others(x, y) if stay.extra > 0 and len(self.ways) > 1 else []
        best = min([stay, *others], key=lambda each: each.extra)
        best = fitting([each for each in others if each.extra == 0] or [best])
        if best is stay:
            self.supervisor.remap(Guidance(here.law, self.obstacles, self.rules))
        else:
            self.enter(best.way, best.segment)

    def _has_noticed(self):
        """Whether the robot has noticed something new, which is then mapped."""
        noticed = getattr(self.robot, "noticed", None)
        if noticed is None:
            return False
        check_has("what the robot noticed", noticed, "boxes")
        if np.array_equal(noticed.boxes, self.noticed):
            return False
        self.noticed = noticed.boxes
        self.remap()
        return True

    def out_of_patience(self, x, y):
        """Whether there has been no progress for so long that the way counts as blocked.

        It does not where the map tells that a detour is needed that is not taken yet.

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.

        Returns
        -------
        bool
        """
        supervisor, k = self.supervisor, self.active
        if supervisor.waited + supervisor.elapsed <= supervisor.patience:
            return False
        guidance = Guidance(self.ways[self.way].law, self.obstacles, self.rules)
        guidance.way(k, x, y)
        return k in supervisor.guidance.detours or k not in guidance.detours

    def leave(self, x, y, theta, longest):
        """Change to another way, if obstacles make one longer by no more than some length.

        What stands in the way, though the map does not tell, is taken to be as wide as what closes
        a way.

        Parameters
        ----------
        x, y, theta : float
            Pose in m and rad.
        longest : float
            In m; 0 for a free one.

        Returns
        -------
        bool
            Whether there was one.
        """
        felt, self.felt = self.felt, np.vstack([self.felt, self._ahead(x, y, theta)])
        self.remap()
        others = filter(lambda each: isfinite(each.extra), self.others(x, y))
        options = [each for each in others if each.extra <= longest]
        if not options:
            self.felt = felt
            return False
        self.left[self.way] = x, y
        best = fitting(options)
        self.enter(best.way, best.segment)
        return True

    def _ahead(self, x, y, theta):
        """Boxes (N, 4) in m: a bar across what lies ahead, as far off as is kept from obstacles."""
        radius, rules = self.known.radius, self.known.rules
        half, width = radius / 2**0.5, 2 * radius + rules.influence
        along, across = np.array([cos(theta), sin(theta)]), np.array([-sin(theta), cos(theta)])
        count = ceil(width / half)
        aside = np.linspace(-width, width, count)[:, None] * across
        centres = np.array([x, y]) + (2 * radius + rules.kept) * along + aside
        return np.hstack([centres - half, centres + half])
