"""The pauses that several walks have in common, and where a law is cut for them (beyond the paper)."""

from itertools import pairwise
from math import fsum
from typing import NamedTuple

import numpy as np

from dollop.law.timing import SHARE, apart_within
from dollop.trajectory import arc_length

__all__ = ["Pause", "Stood", "in_common", "on_cuts", "shown_pauses"]

ROOM = 2
"""Candidate cuts at least from one pause to the next: of so many a segment consists."""
INSIDE = 1e-3
"""Candidates by which a pause on the way is not at an end, however near to it objects have moved it."""


class Stood(NamedTuple):
    """Where along the way, how long in s and in which walk somebody stood, and where that was, (x, y) in m."""

    at: float
    seconds: float
    walk: object
    place: tuple = ()


class Pause(NamedTuple):
    """Where along the way, how long in s a task pauses, and a list of `Stood` of which that is the mean."""

    at: float
    seconds: float
    stood: list


def in_common(found, count, length, last):
    """The pauses that walks have in common.

    Stands of one walk that are within half a metre (`apart_within`) are one. Those of several walks
    are put together if they are within a tenth of the way, the nearest first, and never two of one
    walk: by so much walks among objects that have moved slip along each other.

    Parameters
    ----------
    found : list of Stood
        Along a way of 0 to `last`.
    count : callable
        How many walks there are at a place.
    length : float
        Of the way, m.
    last : float
        The same, in units of the places along it.

    Returns
    -------
    list of Pause
        In order, where at least half of the walks stood; who did not counts as 0 s.

    Examples
    --------
    Of three walks one does not stand at 3 m, and one alone at 7 m:

    >>> found = [Stood(3.0, 2.0, 0), Stood(7.0, 9.0, 0), Stood(3.2, 4.0, 1)]
    >>> [pause[:2] for pause in in_common(found, lambda at: 3, length=12.0, last=12.0)]
    [(3.1, 2.0)]
    """
    within, between = apart_within(length) / max(length, INSIDE) * last, SHARE * last
    groups = _together(_of_each_walk(found, within), between)
    pauses = [_mean_of(group, max(count(_middle_of(group)), len(group))) for group in groups]
    return [pause for pause in pauses if len(pause.stood) >= count(pause.at) / 2]


def _mean_of(group, walks):
    return Pause(_middle_of(group), fsum(each.seconds for each in group) / walks, group)


def _middle_of(group):
    return fsum(each.at for each in group) / len(group)


def _of_each_walk(found, within):
    """The same, in order, where stands of one walk that are so near to the one before are one with it."""
    single = {}
    for each in sorted(found):
        mine = single.setdefault(each.walk, [])
        if mine and each.at - mine[-1].at <= within:
            longer = max(mine[-1], each, key=lambda stood: stood.seconds)
            each = longer._replace(seconds=mine.pop().seconds + each.seconds)
        mine.append(each)
    return sorted(sum(single.values(), []))


def _together(found, between):
    """Groups of `Stood`, which are in order: the nearest neighbours first, of one walk at most one in each."""
    groups = [[each] for each in found]
    while True:
        gaps = [_gap(*pair) for pair in pairwise(groups)]
        if not gaps or min(gaps) > between:
            return groups
        k = gaps.index(min(gaps))
        groups[k : k + 2] = [groups[k] + groups[k + 1]]


def _gap(group, following):
    """How far apart two groups are along the way; `inf` where one walk is in both."""
    shared = {each.walk for each in group} & {each.walk for each in following}
    return np.inf if shared else _middle_of(following) - _middle_of(group)


def shown_pauses(stands, shares, length):
    """Where and how long the walks stood.

    Parameters
    ----------
    stands : sequence of K Stands
    shares : (K, C) float array
        Shares of each walk's way, rising from 0 to 1, at which it may be cut (see `align`).
    length : float
        The mean length of the walks, m.

    Returns
    -------
    list of Pause
        Along the candidate cuts, 0 to C - 1; those at the ends of the walks are at the first and the
        last.
    """
    last = shares.shape[1] - 1.0
    parts = {0.0: [], last: [], "inner": []}
    for k, each in enumerate(stands):
        way = arc_length(each.walk)
        at = np.interp(way[each.rows] / way[-1], shares[k], np.arange(last + 1))
        at = np.where(each.inner, np.clip(at, INSIDE, last - INSIDE), np.where(at < last / 2, 0.0, last))
        for where, seconds, inner in zip(at.tolist(), each.seconds.tolist(), each.inner.tolist(), strict=True):
            parts["inner" if inner else where].append(Stood(where, seconds, k))
    found = {name: in_common(part, lambda at: len(stands), length, last) for name, part in parts.items()}
    if all(each.pooled for each in stands):
        found["inner"] = _one_by_one(parts["inner"], len(stands))
    return [*found[0.0], *found["inner"], *found[last]]


def _one_by_one(found, walks):
    """The pauses of walks that all stand equally often: the first of each are one, and so on."""
    count = len(found) // walks
    groups = [found[k::count] for k in range(count)]  # those of the first walk are first, in order
    return [_mean_of(group, walks) for group in groups]


def on_cuts(pauses, count):
    """Cuts for pauses, and where the candidates must be moved to for it.

    A pause that is not at an end has a cut of its own, and room for a segment on either side.

    Parameters
    ----------
    pauses : sequence of Pause
        Along the candidates, in order.
    count : int
        How many candidates there are at equal distances, C.

    Returns
    -------
    seconds : dict of int to float
        By candidate.
    moved : (C,) float array
        Where each candidate is to be instead, evenly between the pauses.

    Examples
    --------
    >>> seconds, moved = on_cuts([Pause(4.4, 3.0, [])], 9)
    >>> seconds, moved
    ({4: 3.0}, array([0. , 1.1, 2.2, 3.3, 4.4, 5.3, 6.2, 7.1, 8. ]))
    """
    last, at = count - 1, np.array([each.at for each in pauses])
    inner = np.unique(at[(at > 0) & (at < last)])
    room = ROOM * np.arange(1, len(inner) + 1)
    cuts = np.maximum.accumulate(np.maximum(np.rint(inner), ROOM) - room) + room
    cuts = np.minimum(cuts, last - room[::-1])
    moved = np.interp(np.arange(count), [0, *cuts, last], [0, *inner, last])
    if cuts.min(initial=ROOM) < ROOM:  # more pauses than there is room for
        cuts, moved = np.rint(inner), np.arange(count, dtype=float)
    nearest = np.rint(np.interp(at, [0, *inner, last], [0, *cuts, last])).astype(int)
    seconds = {}
    for cut, pause in zip(nearest.tolist(), pauses, strict=True):
        seconds[cut] = seconds.get(cut, 0.0) + pause.seconds
    return seconds, moved
