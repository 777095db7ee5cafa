"""When a demonstrator was where: pauses, and the speed along each segment (beyond the paper)."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from dollop.trajectory import arc_length, at_arc_length

__all__ = ["CORNER", "PARTS", "SOONEST", "Stands", "shown_pauses", "shown_profile", "times_along", "turns_at"]

STILL, LEAST = 0.05, 1.0
"""Who stays within so many metres of a place for so many seconds stands there."""
SLOW = 0.25
"""Nobody stands who is faster than this share of the walk's own mean speed: a path without times, of
which no sample period is known, is not taken for a pause."""
APART = 0.5
"""Way in m over which stands of several walks are one pause."""
PARTS = 16
"""Parts of a segment, each of which has its speed: a person speeds up within a metre, and a segment
is about three metres long."""
SOONEST = 1e-9
"""Samples that a part of a way takes at least: a walk that leaps over it has a speed all the same."""
CORNER, OVER = np.radians(45), 0.1
"""A path that turns by more than this, in rad, between so many metres before and behind has a corner:
on a radius of 0.13 m nobody walks."""


@dataclass(frozen=True, eq=False)
class Stands:
    """A walk without its pauses, and where they were.

    Attributes
    ----------
    walk : (N, 2) float array
        m; every pause is one sample.
    rows : (P,) int array
        Which samples.
    seconds : (P,) float array
        How long each lasted.
    """

    walk: np.ndarray
    rows: np.ndarray
    seconds: np.ndarray

    @classmethod
    def of(cls, walk, period):
        """Take the pauses out of a walk.

        Parameters
        ----------
        walk : (N, 2) float array
            m.
        period : float
            Time between samples in s.

        Returns
        -------
        Stands
            The walk as it is where without its pauses it would be none.

        Examples
        --------
        Two seconds at (1, 0):

        >>> way = np.linspace([0.0, 0.0], [1.0, 0.0], 11)
        >>> stands = Stands.of(np.vstack([way, [way[-1]] * 20, way + [1.0, 0.0]]), 0.1)
        >>> stands.seconds.round(6), stands.walk[stands.rows]
        (array([2.1]), array([[1., 0.]]))
        """
        spans = [_narrowed(walk, *span) for span in _still(walk, period)]
        spans = [(a, b) for a, b in spans if (b - a) * period >= LEAST]
        kept = np.ones(len(walk), bool)
        places = walk.copy()
        for first, last in spans:
            places[first] = walk[first : last + 1].mean(axis=0)
            kept[first + 1 : last + 1] = False
        if kept.sum() < 3 or not (places[kept] != places[kept][0]).any():
            return cls(walk, np.zeros(0, int), np.zeros(0))
        rows = np.cumsum(kept)[[first for first, _ in spans]] - 1
        return cls(places[kept], rows, period * np.array([b - a for a, b in spans], float))


def _still(walk, period):
    """Spans (first, last) of samples that all belong to some window in which the walk stands."""
    width = int(min(np.ceil(LEAST / period - 1e-9), len(walk))) + 1
    speed = arc_length(walk)[-1] / (len(walk) * period)
    radius = min(STILL, SLOW * speed * LEAST)
    if width > len(walk):
        return []
    # Who walks 2 r evenly scatters by r / sqrt(3) about the middle, whichever way he walks.
    centred = walk - walk.mean(axis=0)
    first, second = (uniform_filter1d(each, width, axis=0) for each in (centred, centred**2))
    middle = (second - first**2).sum(axis=1) <= radius**2 / 3
    middle[: width // 2] = middle[len(walk) - (width - 1) // 2 :] = False  # no whole window
    origin = -1 if width % 2 == 0 else 0
    still = maximum_filter1d(middle.astype(np.int8), width, mode="constant", origin=origin)
    edges = np.flatnonzero(np.diff(still, prepend=0, append=0))
    return list(zip(edges[::2], edges[1::2] - 1, strict=True))


def _narrowed(walk, first, last):
    """The span without the steps before and behind: within the radius of the place itself."""
    samples = walk[first : last + 1]
    near = np.flatnonzero(np.hypot(*(samples - samples.mean(axis=0)).T) <= STILL)
    return (first + near[0], first + near[-1]) if len(near) else (first, first)


def shown_pauses(stands, shares, count):
    """Where and how long the walks stood, pooled.

    Parameters
    ----------
    stands : sequence of K Stands
    shares : (K, C) float array
        Shares of each walk's way, rising from 0 to 1, at which it may be cut (see `align`).
    count : float
        The mean length of the walks, m.

    Returns
    -------
    dict of int to float
        For a candidate cut the mean pause in s, where at least half of the walks stood.
    """
    found = []
    for k, each in enumerate(stands):
        way = arc_length(each.walk)
        at = np.interp(way[each.rows] / way[-1], shares[k], np.arange(shares.shape[1]))
        found += zip(at, each.seconds, [k] * len(at), strict=True)
    pauses, apart = {}, max(APART / count * (shares.shape[1] - 1), 2.0)
    for group in _grouped(sorted(found), apart):
        at, seconds, walks = map(np.array, zip(*group, strict=True))
        if len(set(walks)) >= len(stands) / 2:
            pauses[round(at.mean())] = float(seconds.sum() / len(stands))
    return pauses


def _grouped(found, apart):
    """Sorted tuples in groups, in each of which the first entries are at most so far from the first."""
    groups = []
    for each in found:
        if groups and each[0] - groups[-1][0][0] <= apart:
            groups[-1].append(each)
        else:
            groups.append([each])
    return groups


def turns_at(path, ways):
    """How far a path turns between a decimetre before and behind.

    Parameters
    ----------
    path : (N, 2) float array
        m.
    ways : (S,) float array
        Where along it, m.

    Returns
    -------
    (S,) float array
        From 0 to pi, rad; 0 at the ends of the path.

    Examples
    --------
    >>> path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    >>> np.degrees(turns_at(path, np.array([0.5, 1.0, 2.0]))).round()
    array([ 0., 90.,  0.])
    """
    at = np.concatenate([ways - OVER, ways, ways + OVER])
    places = (at_arc_length(path, at) @ (1, 1j)).reshape(3, -1)
    arriving, going_on = places[1] - places[0], places[2] - places[1]
    inner = np.minimum(np.abs(arriving), np.abs(going_on)) > 1e-6  # at an end rounding has the say
    return np.where(inner, np.abs(np.angle(going_on * arriving.conj())), 0.0)


def shown_profile(walks, moments, lengths, period):
    """The speed along each segment, such that the time at each part's end is right.

    Parameters
    ----------
    walks : sequence of K (N_k, 2) float arrays
        Without their pauses, m.
    moments : (K, S + 1) float array
        Fractional sample numbers of the cuts.
    lengths : (S,) float array
        Of the segments of the law, m.
    period : float
        Time between samples in s.

    Returns
    -------
    (S, PARTS) float array
        m/s: the length of a part of the law over the mean time that the walks took for it.
    """
    shares = np.linspace(0, 1, PARTS + 1)
    taken = np.zeros((len(lengths), PARTS))
    for walk, cuts in zip(walks, moments, strict=True):
        way, numbers = arc_length(walk), np.arange(len(walk))
        at = np.interp(cuts, numbers, way)
        between = at[:-1, None] + shares * np.diff(at)[:, None]
        moved = np.diff(way, prepend=-1) > 0
        when = np.interp(between, way[moved], numbers[moved])
        when[:, 0], when[:, -1] = cuts[:-1], cuts[1:]
        taken += np.diff(when, axis=1) * period / len(walks)
    return (lengths / PARTS)[:, None] / np.maximum(taken, SOONEST * period)


def times_along(lines, speeds, pauses):
    """When a law is where on its lines.

    Parameters
    ----------
    lines : sequence of K (V, 2) float arrays
        Of the segments, m.
    speeds : (K, M) float array
        In the M parts of each, m/s.
    pauses : (K + 1,) float array
        At the start and the ends, s.

    Returns
    -------
    t : (N,) float array
        s, never falling, from 0 on.
    places : (N, 2) float array
        m.

    Examples
    --------
    Two metres, the second one slower, and a wait:

    >>> line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    >>> times_along([line], np.array([[1.0, 0.5]]), np.array([0.0, 4.0]))[0]
    array([0., 0., 1., 3., 7.])
    """
    t, places = [np.zeros(1)], [lines[0][:1]]
    for line, along, pause in zip(lines, speeds, pauses, strict=False):
        way = arc_length(line)
        parts = np.linspace(0, way[-1], len(along) + 1)
        ends = np.append(0.0, np.cumsum(np.diff(parts) / np.maximum(along, np.finfo(float).tiny)))
        t.append(t[-1][-1] + pause + np.interp(way, parts, ends))
        places.append(line)
    t.append(t[-1][-1:] + pauses[-1])
    places.append(lines[-1][-1:])
    return np.concatenate(t), np.vstack(places)
