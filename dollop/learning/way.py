"""One way of doing a task: places tied to objects, and the walk that they carry along (Sec. IV-B, beyond the paper).

Where the objects stand elsewhere, the places do, and the walk is displaced with them; the law is
what is fitted to the walk that results (Sec. III), so that it keeps its tolerance in every
environment.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from dollop.checks import (
    FARTHEST,
    checked_array,
    checked_flags,
    checked_number,
    checked_positions,
    checked_records,
    checked_wholes,
    put_in,
)
from dollop.law.pauses import Stood, in_common
from dollop.law.timing import Stands
from dollop.learning.frames import frames_like
from dollop.learning.places import Places
from dollop.learning.ways import PLACES
from dollop.pose import rotation
from dollop.sequenced_lds import LEAST_REACH, LONGEST_PAUSE, PERIODS, SequencedLDS, check_times
from dollop.trajectory import align, arc_length, check_trajectory, resample

__all__ = ["Way", "curve_of", "way_of", "which_places"]

WEIGHTS, ROUNDING = (-1, 2), 1e-6
"""What a weight can be: smooth ones go a little beyond 0 and 1; and what those of a place may miss 1 by."""
LOOSER = 4
"""Times that the tolerance of a law is doubled where objects bend its way too sharply."""
FINE = 200
"""Places between two stands of one pause that are tried for it: less than a centimetre apart."""
SLOWER, FASTER = 0.2, 5.0
"""Most that a step of a walk may be shortened or stretched and still take the time that its new length takes."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way of doing a task (beyond the paper).

    Attributes
    ----------
    walks : tuple of (N_k, 2) float arrays
        What was shown, in m: of one demonstration its own walks, of several their mean, at the pace
        of all.
    shares : tuple of (N_k,) float arrays
        Where along the places each sample of a walk is, from 0 to L - 1.
    home : (L, 2) float array
        Where the places are among the objects as they stood for these walks, in m.
    weights, local : (L, F) and (L, F, 2) float arrays
        As of `Places`.
    objects, turning : (F,) int and bool arrays
        Which object each frame is, and whether it turns with it; see `Frames`.
    members : tuple of int
        The demonstrations that went this way.
    covered : tuple of (float, float)
        From which share of the way to which each of them was seen.
    sample_period : float
        Of the walks, in s.
    tolerance : float
        Largest mean error of a segment of the law in m.
    pauses : (P, 2) float array, optional
        Where along the places, from 0 to L - 1, and how long in s the demonstrators stood: the walks
        are then without it. By default it is found in the walks, and taken out of them. Who stands
        at an end of a walk (see `dollop.law.timing.apart_within`) waits for the recording, and not
        for the task: that is no pause of it.

    Raises
    ------
    ValueError
        Numbers of places, frames or members that contradict each other, or what is no such number.
    """

    walks: tuple
    shares: tuple
    home: np.ndarray
    weights: np.ndarray
    local: np.ndarray
    objects: np.ndarray
    turning: np.ndarray
    members: tuple
    covered: tuple
    sample_period: float
    tolerance: float
    pauses: np.ndarray | None = None

    def __post_init__(self):
        walks = tuple(map(check_trajectory, checked_records("walks", self.walks, object)))
        shares = checked_records("shares", self.shares, object)
        if not walks or len(shares) != len(walks):
            raise ValueError(f"a way needs a share for each of its walks, got {len(shares)}")
        home = checked_positions("home", self.home)
        pairs = zip(shares, walks, strict=True)
        shares = tuple(checked_array("shares", each, len(walk), least=0, most=len(home) - 1) for each, walk in pairs)
        for each in (*walks, *shares):
            each.flags.writeable = False
        for each in shares:
            if (np.diff(each) < 0).any():
                raise ValueError(f"shares must rise from 0 to {len(home) - 1}, got a fall by {-np.diff(each).min():g}")
        least, most = WEIGHTS
        weights = checked_array("weights", self.weights, len(home), "F", least=least, most=most)
        if np.abs(weights.sum(axis=1) - 1).max(initial=0) > ROUNDING:
            raise ValueError("the weights of each place must sum to 1")
        local = checked_array("local", self.local, *weights.shape, 2, least=-2 * FARTHEST, most=2 * FARTHEST)
        frames = weights.shape[1]
        put_in(self, walks=walks, shares=shares, home=home, weights=weights, local=local)
        put_in(
            self,
            objects=checked_wholes("objects", self.objects, frames, least=-1),
            turning=checked_flags("turning", self.turning, frames),
            members=tuple(checked_wholes("members", self.members, "K").tolist()),
            sample_period=checked_number("sample_period", self.sample_period, *PERIODS),
            tolerance=checked_number("tolerance", self.tolerance, LEAST_REACH),
        )
        if not frames or self.objects[-1] != -1 or self.turning[-1] or (self.objects[:-1] < 0).any():
            raise ValueError("the last frame of a way must be the world, and no other")
        covered = checked_array("covered", self.covered, len(self.members), 2, least=-FARTHEST, most=FARTHEST)
        put_in(self, covered=tuple(map(tuple, covered.tolist())))
        if self.pauses is None:
            self._find_pauses()
        pauses = checked_array("pauses", self.pauses, "P", 2, least=0, most=LONGEST_PAUSE)
        if (np.diff(pauses[:, 0]) < 0).any() or pauses[:, 0].max(initial=0) > len(home) - 1:
            raise ValueError(f"pauses must be in order, at places 0 to {len(home) - 1}, got {pauses[:, 0].tolist()}")
        put_in(self, pauses=pauses)

    def _find_pauses(self):
        """Take what pauses the walks have out of them."""
        stands = [Stands.of(walk, self.sample_period, "inner") for walk in self.walks]
        shares = [each.of_walk(share) for each, share in zip(stands, self.shares, strict=True)]
        found = []
        for k, (each, share) in enumerate(zip(stands, shares, strict=True)):
            found += map(Stood, share[each.rows].tolist(), each.seconds.tolist(), [k] * len(each.rows))
        pauses = in_common(found, lambda at: len(stands), arc_length(self.home)[-1], len(self.home) - 1)
        pauses = np.array([pause[:2] for pause in pauses]).reshape(-1, 2)
        put_in(self, walks=tuple(each.walk for each in stands), shares=tuple(shares), pauses=pauses)

    def __repr__(self):
        return f"Way of {len(self.home)} places, shown {len(self.members)} x"

    @cached_property
    def places(self):
        """The places and what they follow."""
        return Places(self.weights, self.local, None, None)

    def among(self, environment, partners, turn=0.0):
        """Where the places are in an environment.

        Parameters
        ----------
        environment : Environment
        partners : (M,) int array
            For each of its objects, which object of the way it is; -1 for none.
        turn : float
            By which offsets from objects whose direction is not known are turned, in rad.

        Returns
        -------
        (L, 2) float array
            In m.

        Raises
        ------
        ValueError
            Where a place follows only what is not there.
        """
        frames = frames_like(self.objects, self.turning, environment, np.asarray(partners, int))
        places = self.places
        if turn:
            still = ~self.turning & (self.objects >= 0)
            local = self.local.copy()
            local[:, still] = local[:, still] @ rotation(turn).T
            places = replace(places, local=local)
        found = places.among(frames)[0]
        lost = np.flatnonzero(np.isnan(found[:, 0]))
        if len(lost):
            followed = np.unique(self.objects[self.weights[lost[0]] > 0]).tolist()
            rule = "a place needs one of the objects that it follows to be matched"
            raise ValueError(f"{rule}, but the matching leaves out all of place {lost[0]}: objects {followed}")
        return found

    def walked(self, now):
        """The walks where the places are now, at the speeds that were shown.

        Parameters
        ----------
        now : (L, 2) float array
            Places in m.

        Returns
        -------
        list of Stands
            In m; the pauses are as long as they were shown, where their places are now.
        """
        places, seconds = self.pauses.T
        rows = [np.abs(share - places[:, None]).argmin(axis=1) for share in self.shares]
        walks = list(self.walks)
        if not np.allclose(now, self.home, rtol=0, atol=1e-9):
            displaced = scipy.interpolate.CubicSpline(np.arange(len(now)), now - self.home)
            moved = [walk + displaced(share) for walk, share in zip(walks, self.shares, strict=True)]
            walks, rows = zip(*map(_at_shown_speed, walks, moved, rows), strict=True)
        return [Stands.known(walk, self.sample_period, row, seconds) for walk, row in zip(walks, rows, strict=True)]

    def law(self, now):
        """The control law along the places as they are now (Sec. III).

        Parameters
        ----------
        now : (L, 2) float array
            Places in m.

        Returns
        -------
        law : SequencedLDS
            It waits where the demonstrators did, and neither at its start nor at its end.
        tolerance : float
            That it keeps, in m: larger than the way's where it bends too sharply for that, as the
            walks that were shown do not.

        Raises
        ------
        ValueError
            Where the walks that were shown cannot be segmented at their tolerance.
        """
        stands, tolerance = self.walked(now), self.tolerance
        at_home = np.allclose(now, self.home, rtol=0, atol=1e-9)
        for _ in range(LOOSER):
            try:
                return self._fitted(stands, tolerance), tolerance
            except ValueError:
                if at_home and len(self.members) == 1:
                    raise
                tolerance *= 2
        return self._fitted(stands, tolerance), tolerance

    def _fitted(self, stands, tolerance):
        law = SequencedLDS.fit_stands(stands, tolerance, sample_period=self.sample_period)
        return law.without_waits_at_ends()


def _at_shown_speed(before, after, stops=()):
    """A walk (N, 2) moved from `before`, sampled anew so that each step keeps its speed.

    And at which samples it then stops that stopped at samples `stops` (P,).
    """
    was, now = (np.linalg.norm(np.diff(walk, axis=0), axis=1) for walk in (before, after))
    stretched = np.clip(now / np.maximum(was, 1e-9), SLOWER, FASTER)
    time = np.concatenate([[0.0], np.where(was > 1e-9, stretched, 1.0).cumsum()])
    at, stops = _ticks(time[-1], time[np.asarray(stops, int)])
    return np.stack([np.interp(at, time, column) for column in after.T], axis=1), stops


def _ticks(lasting, stops):
    """Times from 0 to `lasting`, about 1 apart, and which of them are those of the stops (P,)."""
    ends = np.concatenate([[0.0], stops, [lasting]])
    counts = np.maximum(np.rint(np.diff(ends)).astype(int), np.diff(ends) > 0)
    counts[-1] = max(counts[-1], 2 - counts[:-1].sum())
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], counts, strict=True)]
    return np.append(np.concatenate(parts), lasting), counts[:-1].cumsum()


def curve_of(walks):
    """The places of a demonstration: `PLACES` at equal distances along the mean of its walks.

    Parameters
    ----------
    walks : list of (N_k, 2) float arrays
        In m.

    Returns
    -------
    curve : (PLACES, 2) float array
        In m.
    moments : list of (PLACES,) float arrays
        At which sample each walk is there, as fractional numbers.
    """
    if len(walks) == 1:
        lengths = arc_length(walks[0])
        even = np.linspace(0, lengths[-1], PLACES)
        return resample(walks[0], PLACES), [np.interp(even, lengths, np.arange(len(lengths)))]
    aligned, shares = align(walks, 2 * PLACES - 1)
    mean = aligned.mean(axis=0)
    along = arc_length(mean)
    even = np.interp(np.linspace(0, along[-1], PLACES), along, np.arange(len(mean)))
    curve = np.stack([np.interp(even, np.arange(len(mean)), column) for column in mean.T], axis=1)
    moments = []
    for walk, share in zip(walks, shares, strict=True):
        lengths = arc_length(walk)
        there = np.interp(even, np.arange(len(share)), share) * lengths[-1]
        moments.append(np.interp(there, lengths, np.arange(len(walk))))
    return curve, moments


def way_of(members, laid, frames, home, shown, curves):
    """A way from the walks that were laid onto it.

    Parameters
    ----------
    members : (K,) int array
        Which demonstrations.
    laid : Laid
        Their walks.
    frames : Frames
        Of these demonstrations.
    home : Frames
        Of the environment to learn in.
    shown : sequence of K demonstrations
        With `stands`, `sample_period` and `tolerance`.
    curves : sequence of K (curve, moments)
        From `curve_of`, of their walks without the pauses.

    Returns
    -------
    Way
    """
    places = laid.places
    known = places.weights, places.local, frames.objects, frames.turning, tuple(members.tolist())
    covered = tuple(_range_of(row) for row in laid.covered)
    tolerance = min(each.tolerance for each in shown)
    period = float(np.median([each.sample_period for each in shown]))
    alone = len(members) == 1
    at_home = laid.points[0] if alone else places.among(home)[0]
    pauses = _pauses(laid, shown, curves, at_home, None if alone else places.among(frames))
    if alone:
        walks = tuple(each.walk for each in shown[0].stands)
        shares = tuple(_share_of(walk, at) for walk, at in zip(walks, curves[0][1], strict=True))
    else:
        walk, share = _timed(at_home, _pace(laid, shown, curves), period, pauses[:, 0])
        walks, shares = (walk,), (share,)
    return Way(walks, shares, at_home, *known, covered, period, tolerance, pauses)


def _pauses(laid, shown, curves, places, predicted=None):
    """Where along the places (L, 2), and how long in s, the demonstrators stood: (P, 2).

    Of several demonstrations it is the place from which all stands are seen best, given where the
    way has its places in each of them, `predicted` (K, L, 2).
    """
    found, walks = [], np.zeros(len(places))
    for k, (at, covered, each, (_, moments)) in enumerate(zip(laid.at, laid.covered, shown, curves, strict=True)):
        walks += len(moments) * covered
        inside = np.flatnonzero(covered)
        for j, (stands, moment) in enumerate(zip(each.stands, moments, strict=True)):
            sample = _share_of(stands.walk, moment)[stands.rows]
            seen = (sample >= at[inside[0]]) & (sample <= at[inside[-1]])
            where = np.interp(sample[seen], *_rising(at[inside], inside)).tolist()
            stood = stands.walk[stands.rows[seen]].tolist()
            found += map(
                Stood,
                where,
                stands.seconds[seen].tolist(),
                [(k, j)] * len(where),
                map(tuple, stood),
            )
    pauses = in_common(found, lambda at: walks[round(at)], arc_length(places)[-1], len(places) - 1)
    if predicted is not None:
        pauses = sorted((_best_seen(each.stood, predicted), each.seconds) for each in pauses)
    return np.array([each[:2] for each in pauses]).reshape(-1, 2)


def _best_seen(stood, predicted):
    """Which place, between those of some stands, is the least squared distance from all of them."""
    at = [each.at for each in stood]
    tried = np.linspace(min(at), max(at), FINE)
    missed = np.zeros(FINE)
    for each in stood:
        way = predicted[each.walk[0]]
        x, y = (np.interp(tried, np.arange(len(way)), column) for column in way.T)
        missed += (x - each.place[0]) ** 2 + (y - each.place[1]) ** 2
    return float(tried[np.argmin(np.nan_to_num(missed, nan=np.inf))])


def _rising(values, numbers):
    """Values that never fall, without those that stay, and their numbers: the middle of those."""
    values, which = np.unique(values, return_inverse=True)
    return values, np.bincount(which, numbers) / np.bincount(which)


def _range_of(covered):
    """From which share of the way to which the places (L,) that are covered reach."""
    inside = np.flatnonzero(covered)
    return (
        (float(inside[0] / (len(covered) - 1)), float(inside[-1] / (len(covered) - 1))) if len(inside) else (0.0, 0.0)
    )


def _share_of(walk, moments):
    """Where along the places (L,), at moments of a walk, each of its samples is."""
    keep = np.r_[True, np.diff(moments) > 0]
    return np.interp(np.arange(len(walk)), moments[keep], np.flatnonzero(keep))


def _pace(laid, shown, curves):
    """Mean time (L - 1,) in s from each place to the next, over all walks that were seen there."""
    taken, weight = np.zeros(PLACES - 1), np.zeros(PLACES - 1)
    for at, covered, each, (_, moments) in zip(laid.at, laid.covered, shown, curves, strict=True):
        both = covered[1:] & covered[:-1]
        for moment in moments:
            times = np.interp(at, np.arange(PLACES), moment) * each.sample_period
            taken += np.diff(times) * both
            weight += both
    typical = taken.sum() / max(weight.sum(), 1)
    return np.where(weight > 0, taken / np.maximum(weight, 1), typical)


def _timed(places, pace, period, stops=()):
    """A walk along places (L, 2) that takes `pace` (L - 1,) in s between them, and its share along them.

    Some samples are at `stops` (P,), shares along the places.
    """
    pace = np.maximum(pace, 1e-3 * period)
    time = np.concatenate([[0.0], pace.cumsum()])
    check_times(time[-1], period)
    at, rows = _ticks(time[-1] / period, np.interp(stops, np.arange(len(places)), time) / period)
    share = np.interp(at * period, time, np.arange(len(places)))
    share[rows] = stops
    return scipy.interpolate.CubicSpline(np.arange(len(places)), places)(share), share


def which_places(points, places):
    """Which place each of some points belongs to, in order along the way.

    Parameters
    ----------
    points : (K, 2) float array
        In m, in the order of the way.
    places : (L, 2) float array
        In m.

    Returns
    -------
    (K,) int array
        Never falling, of the least sum of squared distances.

    Examples
    --------
    Of two visits to one place the later one is the later point's.

    >>> way = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [0.0, -1.0]])
    >>> which_places(np.array([[0.0, 0.0], [1.0, 0.9], [0.0, 0.1]]), way).tolist()
    [0, 2, 3]
    """
    squares = ((points[:, None] - places) ** 2).sum(axis=2)
    total, came = squares[0], []
    for row in squares[1:]:
        best = np.where(total == np.minimum.accumulate(total), np.arange(len(total)), 0)
        came.append(np.maximum.accumulate(best))
        total = row + total[came[-1]]
    at = [int(np.argmin(total))]
    for best in came[::-1]:
        at.append(int(best[at[-1]]))
    return np.array(at[::-1])
