"""The user's trajectory as a sequence of linear dynamical systems, the control law (Sec. III)."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dollop.checks import (
    check_choice,
    checked_array,
    checked_flag,
    checked_flags,
    checked_number,
    checked_positions,
    checked_records,
    checked_whole,
    put_in,
)
from dollop.law.line import check_ends, lines_of
from dollop.law.pauses import on_cuts, shown_pauses
from dollop.law.timing import (
    CORNER,
    OVER,
    SOONEST,
    Stands,
    shown_profile,
    times_along,
    turns_at,
)
from dollop.lds import LDS, MOST_STEPS, Statistics
from dollop.pose import wrapped
from dollop.segmentation import (
    best_segments,
    cuts_within,
    fewest_cuts,
    raw_statistics,
    retimed_statistics,
    segment_errors,
)
from dollop.trajectory import (
    align,
    arc_length,
    at_arc_length,
    check_one_way,
    check_trajectories,
    check_trajectory,
    distance_to_polyline,
    resample,
)

__all__ = ["LEAST_REACH", "LONGEST_PAUSE", "PERIODS", "SequencedLDS", "check_times"]

LEAST_REACH = 1e-6  # m: nearer to a subgoal than coordinates can tell, none would ever arrive
REACH = 0.01  # m, to which lines are rolled out
TURNED = np.radians(10)  # over two decimetres: on a radius of 1.1 m, which is no corner
ROUNDS = 8  # how often a walk is divided anew: nearly always two are enough
MOST_CANDIDATES = 400  # the time grows with their cube: some seconds, where 100 take a tenth of one
SPEEDS = 1e-24, 1e24  # m/s: no walk within 1e9 m shows others, by whatever clock
PERIODS = 1e-6, 1e6  # s
LONGEST_PAUSE = 1e11  # s
MOST_TIMES = 1_000_000
"""Times of a response: more than a day, ten times a second."""


@dataclass(frozen=True, eq=False)
class SequencedLDS:
    """A trajectory as a sequence of LDS, each handing over to the next at its subgoal (Sec. III).

    All but the first three attributes are beyond the paper.

    Attributes
    ----------
    segments : tuple of K LDS
        In order.
    start : (2,) float array
        Where the demonstrations start on average, m.
    speeds : (K,) float array
        Mean demonstrated speed along each segment, m/s.
    profile : (K, M) float array, optional
        Speed in each of M equal parts of each segment's way, m/s, such that the time at the end of
        each part is the demonstrated one; by default `speeds` all along.
    pauses : (K + 1,) float array, optional
        How long the demonstrators stood at the start and at each subgoal, s; by default not at all. In
        a task it is 0 at both ends (`without_waits_at_ends`).
    corners : (K,) bool array, optional
        Whether a corner was shown at each subgoal, or a stop; elsewhere the direction of the
        response is continuous. By default there is none.

    Raises
    ------
    ValueError
        No segments, a start beyond 1e9 m, speeds that are not positive, pauses that are negative, or
        another number of them than of segments.
    """

    segments: tuple
    start: np.ndarray
    speeds: np.ndarray
    profile: np.ndarray | None = None
    pauses: np.ndarray | None = None
    corners: np.ndarray | None = None

    def __post_init__(self):
        segments = checked_records("segments", self.segments, LDS)
        if not segments:
            raise ValueError("a law must have a segment, got none")
        least, most = SPEEDS
        put_in(
            self,
            segments=segments,
            start=checked_positions("start", self.start, 2),
            speeds=checked_array("speeds", self.speeds, len(segments), least=least, most=most),
        )
        if self.profile is not None:
            put_in(
                self,
                profile=checked_array("profile", self.profile, len(segments), "M", least=0, most=most),
            )
        if self.pauses is not None:
            put_in(
                self,
                pauses=checked_array("pauses", self.pauses, len(segments) + 1, least=0, most=LONGEST_PAUSE),
            )
        if self.corners is not None:
            put_in(self, corners=checked_flags("corners", self.corners, len(segments)))

    def __repr__(self):
        ends = self.start, self.subgoals[-1]
        way = " to ".join(f"({x:.2f}, {y:.2f})" for x, y in ends)
        return f"SequencedLDS of {len(self.segments)} segments from {way}"

    @property
    def subgoals(self):
        """(K, 2) float array: where the segments end, m."""
        return np.array([segment.goal for segment in self.segments])

    @property
    def headings(self):
        """(K + 1,) float array: where the law leads at the start, and at each subgoal as it arrives, rad.

        In (-pi, pi], over a decimetre of `lines`. A laser cannot tell where somebody who stands looks:
        this is the direction of the walk.

        Examples
        --------
        Two metres along x, one along y:

        >>> corner = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]
        >>> law = SequencedLDS.fit(resample(corner, 61))
        >>> np.degrees(law.headings[[0, -1]]).round() + 0.0
        array([ 0., 90.])
        """
        lines = [line.places for line in self.lines()]
        ends = [arc_length(line)[-1] for line in lines]
        spans = [
            (lines[0], 0.0, OVER),
            *((line, end - OVER, end) for line, end in zip(lines, ends, strict=True)),
        ]
        x, y = np.array([np.diff(at_arc_length(line, (a, b)), axis=0)[0] for line, a, b in spans]).T
        moved = np.hypot(x, y) > LEAST_REACH
        known = np.maximum.accumulate(np.where(moved, np.arange(len(x)), 0))  # who stays has come as before
        return wrapped(np.arctan2(y, x))[known]

    @classmethod
    def fit(
        cls,
        trajectories,
        tolerance=0.02,
        n_segments=None,
        retimed=True,
        sample_period=0.1,
        candidates=100,
    ):
        """Divide a trajectory, or several walks of it, into segments of one LDS each (Sec. III).

        Several walks are aligned (`dollop.trajectory.align`); a subgoal is the mean of the places
        where they are cut, and an LDS is fitted to the statistics of all. The error of a segment is
        the mean distance from the walks' mean to the response of its LDS, started at the subgoal
        before. Dynamic programming finds, among all divisions at the candidate cuts, those with the
        fewest segments of which none has an error above the tolerance, and of these the one with
        the least total error.

        What the law keeps to is rounded where segments meet (beyond the paper). Where that takes
        the mean of all distances above the tolerance, or adds 10 degrees to what the path itself
        turns within a decimetre before and behind, the path is divided anew, at most eight times.
        The first division for which neither holds is taken. If there is none, it is the one that
        breaks these rules least, the first among equals, and nothing is said of it: `errors` tells
        whether the tolerance is kept. So it may be where a walk has loops of a few decimetres. The
        same walks always give the same law.

        Who stays for a second and more within 5 cm of a place pauses there (beyond the paper; samples
        may scatter by 3 cm along each axis). Where at least half of the walks do, there is a subgoal,
        and `pauses` has the mean over all walks, of which those that go on count as 0 s. Of one walk,
        stands within half a metre of the way are one pause; those so near to an end are at the end.

        Parameters
        ----------
        trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
            Positions in m; several must be walks of one way (`dollop.trajectory.ways_apart`).
        tolerance : float
            Largest mean error of a segment in m.
        n_segments : int, optional
            Exactly so many segments with the least total error instead; the tolerance then plays no
            part.
        retimed : bool
            Whether to fit the re-timed curves or the samples as they are (see `LDS.fit`).
        sample_period : float
            Time between samples in s; only `speeds` depends on it.
        candidates : int
            Number of places, at equal distances, where the trajectory may be cut, both its ends
            included; at most 400, for the time taken grows with the cube.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            Trajectories as in `LDS.fit`, walks that are not of one way, a parameter out of its
            range, or a tolerance that no division keeps.

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> len(law.segments), law.subgoals.round(6) + 0.0
        (1, array([[0., 1.]]))
        """
        given = tolerance, n_segments, sample_period, candidates
        _, _, period, _ = checked_search(*given)
        stands = [Stands.of(walk, period) for walk in check_trajectories(trajectories)]
        return cls.fit_stands(stands, tolerance, n_segments, retimed, sample_period, candidates)

    @classmethod
    def fit_stands(
        cls,
        stands,
        tolerance=0.02,
        n_segments=None,
        retimed=True,
        sample_period=0.1,
        candidates=100,
    ):
        """The same, for walks of which it is known where somebody stood (beyond the paper).

        Parameters
        ----------
        stands : sequence of Stands
            Of each walk.
        tolerance, n_segments, retimed, sample_period, candidates
            As for `fit`.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            As `fit`.
        """
        given = tolerance, n_segments, sample_period, candidates
        tolerance, n_segments, sample_period, candidates = checked_search(*given)
        retimed = checked_flag("retimed", retimed)
        walks = [each.walk for each in stands]
        aligned, shares = align(walks, 2 * candidates - 1)
        check_one_way(walks, aligned)
        pauses, aligned, shares = cut_at_pauses(stands, aligned, shares)
        path, moments = aligned.mean(axis=0)[::2], cut_moments(walks, shares[:, ::2])
        statistics = retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)
        division = Division(path, statistics, pauses)
        cuts = division.exactly(n_segments) if n_segments is not None else division.within(tolerance)
        at = moments[:, cuts]
        law = cls(division.segments(cuts), path[0], demonstrated_speeds(walks, at, sample_period))
        lengths = [line.way[-1] for line in division.lines(cuts)]
        return law.with_timing(walks, at, sample_period, *division.stops(cuts), lengths)

    def with_timing(self, walks, moments, sample_period, pauses, corners, lengths):
        """The same law with the timing and the corners of what it was fitted to.

        Parameters
        ----------
        walks : sequence of D (N_k, 2) float arrays
            Without their pauses, m.
        moments : (D, K + 1) float array
            Fractional sample numbers of the subgoals, the start first.
        sample_period : float
            s.
        pauses : (K + 1,) float array
            s.
        corners : (K,) bool array
            Whether one was shown.
        lengths : (K,) sequence of float
            Of the segments' lines, m.

        Returns
        -------
        SequencedLDS
        """
        profile = shown_profile(walks, moments, np.array(lengths), sample_period)
        return replace(self, pauses=pauses, corners=corners, profile=profile)

    def without_waits_at_ends(self):
        """The same law, for a task: what was waited before the first step and after the last is none of it.

        A recording begins before the walk and ends after it, by whoever makes it; how long somebody
        stands there says nothing of the task.

        Returns
        -------
        SequencedLDS
            Without pauses at start and last subgoal.

        Examples
        --------
        >>> x = np.concatenate([np.zeros(30), np.arange(0, 3, 0.1)])
        >>> law = SequencedLDS.fit(np.column_stack([x, 0 * x]))
        >>> law.pauses.round(6), law.without_waits_at_ends().pauses
        (array([3., 0.]), array([0., 0.]))
        """
        if self.pauses is None:
            return self
        pauses = self.pauses.copy()
        pauses[[0, -1]] = 0.0
        return replace(self, pauses=pauses)

    def lines(self, reach=0.01):
        """What each segment keeps to: the response of its LDS from the subgoal before.

        Rounded where two segments meet, unless a corner was shown there (`dollop.law.line`).

        Parameters
        ----------
        reach : float
            m, to which the responses are rolled out.

        Returns
        -------
        list of K Line

        Raises
        ------
        ValueError
            Too small a reach.
        """
        reach = checked_number("reach", reach, LEAST_REACH)
        corners = np.zeros(len(self.segments), bool) if self.corners is None else self.corners
        return lines_of(self.segments, self.start, corners, reach)

    def response(self, start=None, reach=0.01, method="held", segment=0):
        """Follow the segments, handing over to the next within reach of each subgoal (Sec. III).

        Since every LDS is stable, this happens after finitely many steps from any start. The next
        segment sets out from the place of the handing over.

        Parameters
        ----------
        start : (2,) array_like, optional
            m; by default the demonstrations' start.
        reach : float
            m, at least a micrometre.
        method : {"held", "paper"}
            "held": near the response of a segment from the subgoal before, the offset from it fades
            within decimetres, so that after a push the way is soon the shown one again; far from it
            the LDS is alone; through a subgoal the direction is continuous (beyond the paper, as
            stable: see `dollop.law.line`). "paper": every LDS alone.
        segment : int
            The first in force.

        Returns
        -------
        (M, 2) float array
            From start to within reach of the last subgoal, m.

        Raises
        ------
        ValueError
            A start that is no position, too small a reach, another method or segment, or a response
            that is not within reach of a subgoal after 100,000 steps.

        Examples
        --------
        Kidnapped, it still ends at the last subgoal:

        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> bool(np.linalg.norm(law.response([-30.0, 20.0])[-1] - law.subgoals[-1]) <= 0.01)
        True

        Pushed outwards, it comes back to the arc:

        >>> pushed = law.response([1.1, 0.5])
        >>> bool(np.abs(np.hypot(*pushed[len(pushed) // 2 :].T) - 1).max() < 0.01)
        True
        """
        return np.vstack(self.responses(start, reach, method, segment))

    def responses(self, start=None, reach=0.01, method="held", segment=0):
        """The response, segment by segment.

        Parameters
        ----------
        start, reach, method, segment
            See `response`; by default the start is where the segment sets out.

        Returns
        -------
        list of (M_k, 2) float arrays
            Of each segment from the first in force on, m; the first place of each follows on the
            last of the one before. One may be empty.

        Raises
        ------
        ValueError
            As `response`.

        Examples
        --------
        Each ends where it hands over:

        >>> turn = np.linspace(0, 2 * np.pi, 100)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> ends = [response[-1] for response in law.responses()]
        >>> np.allclose(ends, law.subgoals)
        True
        """
        reach = checked_number("reach", reach, LEAST_REACH)
        check_choice("method", method, ("held", "paper"))
        segment = checked_whole("segment", segment, 0, len(self.segments) - 1)
        if start is None:
            start = np.vstack([self.start, self.subgoals])[segment]
        place = checked_positions("start", start, 2)
        parts = (self._held if method == "held" else self._alone)(place, reach, segment)
        return [part[1:] if k else part for k, part in enumerate(parts)]

    def _held(self, place, reach, segment):
        """The response from a place (2,) that comes back to the line of each segment."""
        lines, parts = self.lines(reach)[segment:], []
        for k, line in enumerate(lines):
            places, offsets = line.follow(place, 0 if k else line.nearest(place), reach)
            parts.append(places + offsets)
            place = parts[-1][-1]
        return parts

    def _alone(self, place, reach, segment):
        """The response from a place (2,) of every LDS alone."""
        parts = []
        for each in self.segments[segment:]:
            states = [place]
            while np.linalg.norm(states[-1] - each.goal) > reach:
                check_ends(len(states), each.goal, reach)
                states.append(each.goal + (states[-1] - each.goal) @ each.A.T)
                if (states[-1] == states[-2]).all():  # no nearer in floating point
                    check_ends(MOST_STEPS, each.goal, reach)
            parts.append(np.array(states))
            place = states[-1]
        return parts

    def timed(self, period=0.1):
        """The response at equal times, at the shown speeds and with the shown pauses.

        Beyond the paper.

        Parameters
        ----------
        period : float
            s.

        Returns
        -------
        t : (N,) float array
            From 0 on, s; at the last the task is done.
        positions : (N, 2) float array
            m.

        Raises
        ------
        ValueError
            A period that is not positive, or that makes more than a million times.

        Examples
        --------
        Two metres at a metre per second, half a second at half of it, and a stop for two seconds:

        >>> x = np.concatenate([np.arange(0, 2, 0.1), np.arange(2, 2.25, 0.05), [2.25] * 21])
        >>> law = SequencedLDS.fit(np.column_stack([x, np.zeros_like(x)]))
        >>> t, positions = law.timed()
        >>> bool(np.abs(positions[:, 0] - x[: len(t)]).max() < 0.05), float(t[-1].round(1))
        (True, 4.5)
        """
        period = checked_number("period", period, *PERIODS)
        speeds = self.speeds[:, None] if self.profile is None else self.profile
        pauses = np.zeros(len(self.segments) + 1) if self.pauses is None else self.pauses
        when, places = times_along([line.places for line in self.lines()], speeds, pauses)
        check_times(when[-1], period)
        t = period * np.arange(int(np.ceil(when[-1] / period - 1e-9)) + 1)
        return t, np.stack([np.interp(t, when, column) for column in places.T], axis=1)

    def error(self, trajectory):
        """Mean distance of a trajectory's samples to the response.

        Parameters
        ----------
        trajectory : (N, 2) array_like
            m.

        Returns
        -------
        float
            m.

        Raises
        ------
        ValueError
            No trajectory (see `check_trajectory`).

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> law.error(law.response())
        0.0
        """
        return self.errors(trajectory)["mean"]

    def errors(self, trajectory):
        """Distances between the samples of a trajectory and the response.

        Parameters
        ----------
        trajectory : (N, 2) array_like
            m.

        Returns
        -------
        dict of float
            In m: "mean" and "max" from the samples to the nearest places on the response; "reverse"
            the mean from the response, sampled at equal distances, to the nearest places on the
            trajectory.

        Raises
        ------
        ValueError
            No trajectory (see `check_trajectory`).
        """
        samples, response = check_trajectory(trajectory), self.response()
        there = distance_to_polyline(samples, response)
        back = distance_to_polyline(resample(response, len(samples)), samples)
        return {
            "mean": float(there.mean()),
            "max": float(there.max()),
            "reverse": float(back.mean()),
        }

    def with_subgoals(self, subgoals, start=None, turned=False):
        """The same task with its subgoals moved (Sec. IV).

        Every LDS keeps its A, so the response adapts by itself.

        Parameters
        ----------
        subgoals : (K, 2) array_like
            m.
        start : (2,) array_like, optional
            Moved as well, m; by default the demonstrations' start stays.
        turned : bool
            Beyond the paper: turn every LDS as the line from the subgoal before to its own has
            turned.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            Another number of subgoals, or a position that is not finite.

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> moved = law.with_subgoals(law.subgoals + [3.0, 0.0], law.start + [3.0, 0.0])
        >>> np.allclose(moved.response(), law.response() + [3.0, 0.0])
        True
        """
        goals = checked_positions("subgoals", subgoals, len(self.segments), 2)
        start = checked_positions("start", self.start if start is None else start, 2)
        segments = self.segments
        if checked_flag("turned", turned):
            turns = chord_angles(start, goals) - chord_angles(self.start, self.subgoals)
            segments = map(LDS.turned, segments, turns)
        moved = [replace(segment, goal=goal) for segment, goal in zip(segments, goals, strict=True)]
        return replace(self, segments=tuple(moved), start=start)


def check_times(lasting, period):
    """Refuse what lasts longer than a million periods.

    Parameters
    ----------
    lasting : float
        s.
    period : float
        s.

    Raises
    ------
    ValueError
        The message names both: either the period is wrong, or a pause is one of the clock's.

    Examples
    --------
    >>> check_times(1.7e9, 0.1)
    Traceback (most recent call last):
    ValueError: what is driven must last at most 1000000 periods, got 1.7e+09 s at a period of 0.1 s
    """
    if not lasting <= (MOST_TIMES - 1) * period:
        rule = f"what is driven must last at most {MOST_TIMES} periods"
        raise ValueError(f"{rule}, got {lasting:.6g} s at a period of {period:g} s")


def chord_angles(start, subgoals):
    """Directions (K,) in rad of the lines from each subgoal to the next, from the start on."""
    chords = np.diff(np.vstack([start, subgoals]), axis=0)
    return np.arctan2(chords[:, 1], chords[:, 0])


def checked_search(tolerance, n_segments, sample_period, candidates):
    """The parameters of `SequencedLDS.fit`; ValueError for one that is out of its range."""
    tolerance = checked_number("tolerance", tolerance, LEAST_REACH)
    sample_period = checked_number("sample_period", sample_period, *PERIODS)
    candidates = checked_whole("candidates", candidates, 3, MOST_CANDIDATES)
    if n_segments is not None:  # each of them takes two candidates
        n_segments = checked_whole("n_segments", n_segments, 1, (candidates - 1) // 2)
    return tolerance, n_segments, sample_period, candidates


@dataclass(frozen=True, eq=False)
class Division:
    """What is needed to divide a walk into segments.

    Attributes
    ----------
    path : (C, 2) float array
        The walks' mean at the candidate cuts, m.
    statistics : callable
        (start, length) -> Statistics.
    pauses : dict of int to float
        Seconds stood, by candidate cut.
    """

    path: np.ndarray
    statistics: object
    pauses: dict

    @cached_property
    def errors(self):
        """(C, C) float array from `segment_errors`, m."""
        return segment_errors(self.path, self.statistics)

    def within(self, tolerance):
        """Cuts (S + 1,) of the fewest segments within a tolerance in m, as they are and rounded.

        Where the segments' lines, rounded as they are where they meet, leave the path by more on
        the mean, those that do are refused, and so is one that turns at its end by 10 degrees more
        than the path; with them those like them. Then the walk is divided anew. Where that does not
        end in `ROUNDS`, or no division is left, the least excess is taken, the first among equals.
        """
        errors, tried = self._possible(list(self.pauses), np.nan), []
        cuts = fewest_cuts(self.path, self.statistics, tolerance, errors)
        while cuts is not None:
            excess = self.excess(cuts, tolerance)
            tried.append((excess.max(), cuts))
            if excess.max() <= 1 or len(tried) == ROUNDS:
                break
            for k in np.flatnonzero(excess > 1):
                rows, columns = (slice(max(each - 1, 0), each + 2) for each in cuts[k : k + 2])
                errors[rows, columns] = np.inf
            cuts = cuts_within(self.path, self.statistics, tolerance, errors)
        return min(tried, key=lambda each: each[0])[1]

    def exactly(self, n_segments):
        """Cuts (S + 1,) of so many segments with the least total error.

        The longest pauses have the say where not all of them leave room for the segments.
        """
        required = sorted(self.pauses, key=self.pauses.get)
        required = required[max(len(required) - n_segments + 1, 0) :]
        while True:
            cuts = best_segments(self._possible(required, self.errors), n_segments)
            if cuts is not None or not required:
                return cuts
            required = required[1:]

    def _possible(self, required, errors):
        """Errors (C, C), `inf` where one of some cuts is within a segment; both ends count for it."""
        count = len(self.path)
        kept = np.full((count, count), errors)
        for cut in required:
            if 2 <= cut <= count - 3:
                kept[:cut, cut + 1 :] = np.inf
        return kept

    def segments(self, cuts):
        """The LDS of each segment, for cuts (S + 1,)."""
        return self._looked_at(cuts)[0]

    def lines(self, cuts):
        """The line of each segment (`SequencedLDS.lines`), for cuts (S + 1,)."""
        return self._looked_at(cuts)[1]

    def _looked_at(self, cuts):
        """Segments and lines for cuts (S + 1,), made once."""
        key = cuts.tobytes()
        if key not in self._known:
            of_all, goals = self.statistics(cuts[:-1], np.diff(cuts)), self.path[cuts[1:]]
            segments = tuple(map(LDS, map(Statistics, of_all.G0, of_all.G1), goals))
            self._known[key] = (
                segments,
                lines_of(segments, self.path[0], self.stops(cuts)[1], REACH),
            )
        return self._known[key]

    @cached_property
    def _known(self):
        """Segments and lines of divisions that were looked at."""
        return {}

    def stops(self, cuts):
        """Seconds stood at each cut (S + 1,), and whether there is a corner or a stop at each end (S,)."""
        seconds = np.zeros(len(cuts))
        for cut, pause in self.pauses.items():
            seconds[np.abs(cuts - cut).argmin()] += pause
        return seconds, (self.turns(cuts) > CORNER) | (seconds[1:] > 0)

    def turns(self, cuts):
        """How far (S,) in rad the path turns at the end of each segment, for cuts (S + 1,)."""
        return self._turns[cuts[1:]]

    @cached_property
    def _turns(self):
        """How far (C,) in rad the path turns at each candidate cut."""
        return turns_at(self.path, arc_length(self.path))

    def excess(self, cuts, tolerance):
        """How far (S,) each segment's rounded line is beside the path, and turns at its end too far.

        In units of the tolerance in m and of 10 degrees, the larger of both. While the mean over
        the whole path is within the tolerance, no segment is beside it too far.
        """
        corners, lines = self.stops(cuts)[1], self.lines(cuts)
        spans = zip(cuts[:-1], cuts[1:], lines, strict=True)
        beside = [distance_to_polyline(self.path[i + 1 : j], line.places) for i, j, line in spans]
        total = np.concatenate(beside).mean() / tolerance
        each = np.array(list(map(np.mean, beside))) / tolerance
        whole = np.vstack([line.places for line in lines])
        turns = turns_at(whole, np.cumsum([line.way[-1] for line in lines]))
        turned = np.where(corners, 0, turns - self.turns(cuts)) / TURNED
        return np.maximum(np.where(total > 1, each, np.minimum(each, 1)), turned)


def cut_at_pauses(stands, aligned, shares):
    """Seconds stood by candidate cut, and aligned walks (K, 2 C - 1, 2) and shares (K, 2 C - 1) with cuts there.

    As they are where nobody pauses on the way.
    """
    length, count = arc_length(aligned.mean(axis=0)[::2])[-1], aligned.shape[1] // 2 + 1
    seconds, moved = on_cuts(shown_pauses(stands, shares[:, ::2], length), count)
    if (moved == np.arange(count)).all():
        return seconds, aligned, shares
    fine = np.arange(2 * count - 1)
    moved = 2 * np.interp(fine / 2, np.arange(count), moved)
    shares = np.stack([np.interp(moved, fine, share) for share in shares])
    pairs = zip((each.walk for each in stands), shares, strict=True)
    return (
        seconds,
        np.stack([at_arc_length(walk, share * arc_length(walk)[-1]) for walk, share in pairs]),
        shares,
    )


def cut_moments(walks, shares):
    """When each walk is at given shares (K, C) of its way: (K, C) fractional sample numbers."""
    pairs = zip(shares, map(arc_length, walks), strict=True)
    return np.array([np.interp(share * w[-1], w, np.arange(len(w))) for share, w in pairs])


def demonstrated_speeds(walks, moments, sample_period):
    """Mean speed (S,) in m/s between fractional sample numbers (K, S + 1), over all walks."""
    pairs = zip(moments, map(arc_length, walks), strict=True)
    walked = [np.interp(moment, np.arange(len(w)), w) for moment, w in pairs]
    taken = np.maximum(np.diff(moments, axis=1).sum(axis=0), SOONEST)
    return np.diff(walked, axis=1).sum(axis=0) / (taken * sample_period)
