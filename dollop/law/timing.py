"""When a demonstrator was where: stands, and the speed along each segment (beyond the paper)."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import correlate1d, maximum_filter1d, uniform_filter1d

from dollop.trajectory import arc_length, at_arc_length

__all__ = [
    "CORNER",
    "OVER",
    "PARTS",
    "SHARE",
    "SOONEST",
    "Stands",
    "apart_within",
    "shown_profile",
    "times_along",
    "turns_at",
]

STILL, LEAST = 0.05, 1.0
"""Who stays within so many metres of a place for so many seconds stands there."""
SLOW = 0.25
"""Nobody stands who is faster than this share of the walk's own mean speed: a path without times, of
which no sample period is known, is not taken for a pause."""
QUIET, NOISY = 0.01, 0.03
"""m: scatter of the samples along each axis that is small beside `STILL`, and the most that is allowed for:
a laser's track of somebody who stands scatters by 0.5 cm, and by some centimetres where it is seen badly."""
GONE = 0.2
"""m: who has not been so far away between two stands has not gone; it is less than the length of a foot."""
ROUNDS = 3
"""How often a middle is sought anew: then it hardly moves any more."""
APART, SHARE = 0.5, 0.1
"""Way in m, or share of a shorter walk, over which stands of one walk are one pause, and within which of an
end they are at that end: a step is longer. Stands of several walks are one pause over that share of the way:
so far walks among objects that have moved slip along each other."""
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
    inner : (P,) bool array
        Which of them are on the way, and not at an end of the walk (see `apart_within`).
    number : (M,) int array
        For each sample with the pauses which one it is without.
    pooled : bool
        Whether the inner ones are those that all walks of a way have in common, in order.
    """

    walk: np.ndarray
    rows: np.ndarray
    seconds: np.ndarray
    inner: np.ndarray
    number: np.ndarray
    pooled: bool = False

    @classmethod
    def of(cls, walk, period, which="all"):
        """Take the pauses out of a walk.

        Parameters
        ----------
        walk : (N, 2) float array
            m.
        period : float
            Time between samples in s.
        which : {"all", "inner", "ends"}
            All; or those that are half a metre of the way and more from both its ends, or a tenth of
            a shorter one; or only the others.

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
        spans = _spans(walk, period)
        found = cls._without(walk, spans, period)
        if which == "all" or not len(found.rows):
            return found
        chosen = found.inner == (which == "inner")
        found = cls._without(walk, [span for span, of in zip(spans, chosen, strict=True) if of], period)
        return replace(found, inner=np.full(len(found.rows), which == "inner"))

    @classmethod
    def known(cls, walk, period, rows, seconds):
        """A walk of which it is known where somebody stood, but for its ends.

        Parameters
        ----------
        walk : (N, 2) float array
            m; without the pauses that are known.
        period : float
            Time between samples in s.
        rows : (P,) int array
            At which samples they were, in order.
        seconds : (P,) float array
            How long each lasted.

        Returns
        -------
        Stands
            Of those, and of the stands that the walk has at its ends.
        """
        ends, rows = cls.of(walk, period, "ends"), np.asarray(rows, int)
        rows, seconds = (
            np.concatenate([ends.rows, ends.number[rows]]),
            np.concatenate([ends.seconds, seconds]),
        )
        inner, order = np.arange(len(rows)) >= len(ends.rows), np.argsort(rows, kind="stable")
        return cls(ends.walk, rows[order], seconds[order], inner[order], ends.number, pooled=True)

    def of_walk(self, values):
        """What belongs to the samples that are left, of what belongs to those with the pauses.

        Parameters
        ----------
        values : (M, ...) array

        Returns
        -------
        (N, ...) array
            Of each sample in which somebody stood the first.
        """
        return values[np.unique(self.number, return_index=True)[1]]

    @classmethod
    def _without(cls, walk, spans, period):
        """The walk without spans (first, last)."""
        kept = np.ones(len(walk), bool)
        places = walk.copy()
        for first, last in spans:
            places[first] = walk[first : last + 1].mean(axis=0)
            kept[first + 1 : last + 1] = False
        if not spans or kept.sum() < 3 or not (places[kept] != places[kept][0]).any():
            none = np.zeros(0)
            return cls(walk, none.astype(int), none, none.astype(bool), np.arange(len(walk)))
        number, places = np.cumsum(kept) - 1, places[kept]
        rows, seconds = number[[first for first, _ in spans]], [period * (b - a) for a, b in spans]
        way = arc_length(places)
        at, apart = way[rows], apart_within(way[-1])
        return cls(places, rows, np.array(seconds), (at > apart) & (at < way[-1] - apart), number)


def apart_within(length):
    """How much of a way is one place where somebody stands.

    Parameters
    ----------
    length : float
        Of the way, m.

    Returns
    -------
    float
        m.

    Examples
    --------
    >>> apart_within(12.0), apart_within(1.0)
    (0.5, 0.1)
    """
    return min(APART, SHARE * length)


def _spans(walk, period):
    """Spans (first, last) of samples in which somebody stands."""
    spans = [_narrowed(walk, *span, _width(period)) for span in _unbroken(walk, _still(walk, period))]
    return [(a, b) for a, b in spans if (b - a) * period >= LEAST]


def _width(period):
    """Samples that last as long as the shortest stand, at least."""
    return int(np.ceil(LEAST / period - 1e-9)) + 1


def _still(walk, period):
    """Spans (first, last) of samples that all belong to some window in which the walk stands."""
    width = min(_width(period), len(walk) + 1)
    speed = arc_length(walk)[-1] / (len(walk) * period)
    radius = min(STILL, SLOW * speed * LEAST)
    if width > len(walk):
        return []
    # Who walks 2 r evenly scatters by r / sqrt(3) about the middle, whichever way he walks.
    centred = walk - walk.mean(axis=0)
    first, second = (uniform_filter1d(each, width, axis=0) for each in (centred, centred**2))
    middle = (second - first**2).sum(axis=1) <= radius**2 / 3 + 2 * _noise(walk)
    # Noise hides a slow step, but not where the window leads to.
    steps = np.arange(width) - (width - 1) / 2
    slope = correlate1d(centred, steps / (steps**2).sum(), axis=0)
    middle &= np.hypot(*slope.T) <= 2 * radius / LEAST * period
    middle[: width // 2] = middle[len(walk) - (width - 1) // 2 :] = False  # no whole window
    origin = -1 if width % 2 == 0 else 0
    still = maximum_filter1d(middle.astype(np.int8), width, mode="constant", origin=origin)
    edges = np.flatnonzero(np.diff(still, prepend=0, append=0))
    return list(zip(edges[::2], edges[1::2] - 1, strict=True))


def _unbroken(walk, spans):
    """Spans in order, where those are one between which nobody has gone."""
    joined = []
    for first, last in spans:
        before = joined[-1] if joined else (first, last)
        places = [walk[a : b + 1].mean(axis=0) for a, b in (before, (first, last))]
        between = walk[before[1] : first + 1]
        gone = max(np.hypot(*(between - place).T).max(initial=0) for place in places)
        if joined and gone <= GONE:
            first = joined.pop()[0]
        joined.append((first, last))
    return joined


def _noise(walk):
    """Variance in m^2 along each axis of what the samples of a walk scatter, beyond what is small.

    Noise of standard deviation s has second differences of median length sqrt(6 ln 4) s.
    """
    bends = np.hypot(*np.diff(walk, 2, axis=0).T)
    scatter = min(np.median(bends) / np.sqrt(6 * np.log(4)), NOISY) if len(bends) else 0.0
    return max(scatter**2 - QUIET**2, 0.0)


def _narrowed(walk, first, last, width):
    """The span without the steps before and behind: within the scatter of the place itself.

    Of Gaussian scatter 94 % lie within twice the median distance. At the ends of a walk, where a
    stand has no length of its own, it is all that is within the radius.
    """
    samples = walk[first : last + 1]
    if first == 0 or last == len(walk) - 1:
        near = np.flatnonzero(np.hypot(*(samples - samples.mean(axis=0)).T) <= STILL)
        return (first + near[0], first + near[-1]) if len(near) else (first, first)
    begins, ends = _of_the_place(samples[: 2 * width]), _of_the_place(samples[-2 * width :])
    return first + begins[0], last + 1 - len(samples[-2 * width :]) + ends[-1]


def _of_the_place(samples):
    """Which of some samples (N, 2) are not steps to or from the place where most of them are."""
    away = np.hypot(*(samples - _middle(samples)).T)
    return np.flatnonzero(away <= np.clip(2 * np.median(away), QUIET, STILL))


def _middle(samples):
    """Where most of some samples (N, 2) are: the mean of those that are not farther than half of them."""
    middle = samples.mean(axis=0)
    for _ in range(ROUNDS):
        away = np.hypot(*(samples - middle).T)
        middle = samples[away <= np.median(away)].mean(axis=0)
    return middle


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
