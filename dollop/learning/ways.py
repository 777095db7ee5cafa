"""The ways in which a task was shown, each from demonstrations among objects that stood elsewhere (Sec. V and beyond).

Walks of one way are laid onto the places of one of them, what the places follow is told from all
(`dollop.learning.places`), and the walks are laid onto the places again, by turns. Where a walk
then misses the way for a while by more than walks do, it is no walk of this way: the demonstrations
are divided by the two that are least alike, and each part is learned by itself. A walk that lacks
the beginning or the end of the way adds to what it covers.
"""

from dataclasses import dataclass

import numpy as np

from dollop.learning.places import Places, tied_places
from dollop.learning.warping import CUT, alikeness, warped

__all__ = ["MISSED", "PLACES", "Laid", "divided", "laid_together"]

PLACES = 80
"""Of a way: about one every 0.15 m of a walk through a room."""
SPREADS, REFERENCES = (0.5, 0.35, 0.25, 0.15), 5
"""m: how far walks may miss the same place, each time that they are laid onto the way, wide at first
while it is hardly known; and from how many of the walks it begins."""
PULL = 5.0
"""Nats: how much less alike a place and a sample are that lie a whole way apart."""
STRETCH = 0.1
"""Share of the way over which a walk of another way misses it."""
MISSED, BENT = 0.35, 0.15
"""m, and m per metre: by how much a walk of the way may miss it over a stretch where objects hardly moved, and by how
much more where they have moved, since the shape between places bends with them."""
MOST_BENT = 0.8
"""m: the most that a walk of the way may miss it over a stretch."""
BESIDE = 0.1
"""Share of the walk that may lie before or beyond the way."""

_SHARE = np.linspace(0, 1, PLACES)
_SLIP = PULL * (_SHARE[:, None] - _SHARE) ** 2


@dataclass(frozen=True, eq=False)
class Laid:
    """D walks laid onto the L places of one way.

    Attributes
    ----------
    places : Places
    points : (D, L, 2) float array
        Where each walk has each place, in m.
    covered : (D, L) bool array
        False where a walk ends before a place, or begins after it.
    at : (D, L) float array
        At which sample of the walk that is.
    beyond : (D,) float array
        Share of each walk that lies before or beyond the way.
    missed : (D,) float array
        The most by which each walk misses the way over a stretch of it, in m.
    cost : float
        How unlike walks and way are in all, in nats.
    """

    places: Places
    points: np.ndarray
    covered: np.ndarray
    at: np.ndarray
    beyond: np.ndarray
    missed: np.ndarray
    cost: float


def laid_together(curves, frames, references=REFERENCES):
    """Learn one way from walks (a reconstruction).

    Parameters
    ----------
    curves : (D, L, 2) float array
        The walks by `PLACES` samples at equal distances, in m.
    frames : Frames
        Of the D demonstrations.
    references : int
        From how many of the walks to begin, the longest first; the way that is most like all walks
        is kept.

    Returns
    -------
    Laid
    """
    lengths = np.linalg.norm(np.diff(curves, axis=1), axis=2).sum(axis=1)
    longest = np.argsort(-lengths, kind="stable")[: min(references, len(curves))]
    found = [_laid_onto(curves, frames, reference) for reference in longest.tolist()]
    return min(found, key=lambda laid: laid.cost)


def _laid_onto(curves, frames, reference):
    count = len(curves)
    points, at = curves, np.tile(np.arange(float(PLACES)), (count, 1))
    covered, cost, beyond = np.ones((count, PLACES), bool), np.zeros(count), np.zeros(count)
    places = tied_places(points[[reference]], covered[[reference]], frames.of([reference]))
    local = places.local
    for turn, spread in enumerate(SPREADS if count > 1 else ()):
        unlike = alikeness(places.posterior, places.candidates, local, frames, curves, spread)
        at, covered, cost, beyond = warped(unlike + _SLIP)
        if turn == 0:
            at[reference], covered[reference] = np.arange(PLACES), True
        points = _sampled(curves, at)
        places = tied_places(points, covered, frames)
        local = _by_others(points, covered, frames)
    missed = most_missed(places.among(frames), points, covered)
    unlike = float(cost.sum() + CUT * beyond.sum())  # the way should hold all that was shown
    return Laid(places, points, covered, at, beyond / PLACES, missed, unlike)


def _sampled(curves, at):
    """Curves (D, M, 2) at fractional sample numbers (D, L)."""
    low = np.minimum(at.astype(int), curves.shape[1] - 2)
    share = (at - low)[..., None]
    rows = np.arange(len(curves))[:, None]
    return (1 - share) * curves[rows, low] + share * curves[rows, low + 1]


def _by_others(points, covered, frames):
    """Mean offsets (D, L, F, 2) over all other demonstrations; over all where there is no other."""
    counted = (covered[:, :, None] & frames.present[:, None])[..., None]
    offsets = frames.seen(points) * counted
    number, total = counted.sum(axis=0), offsets.sum(axis=0)
    others = number - counted
    return np.where(others > 0, (total - offsets) / np.maximum(others, 1), total / np.maximum(number, 1))


def most_missed(way, points, covered):
    """The most (D,) by which walks miss a way (D, L, 2) over a stretch of it, in m.

    Parameters
    ----------
    way, points : (D, L, 2) float arrays
        Where the way and each walk has each place, in m.
    covered : (D, L) bool array
        Places that count.

    Returns
    -------
    (D,) float array
        0 where a walk covers less than a stretch.
    """
    length = max(1, round(STRETCH * way.shape[1]))
    distance = np.where(covered, np.linalg.norm(np.nan_to_num(way) - points, axis=2), 0.0)
    sums = np.pad(distance.cumsum(axis=1), ((0, 0), (1, 0)))
    return ((sums[:, length:] - sums[:, :-length]) / length).max(axis=1)


def divided(curves, frames):
    """The ways in which walks go: each with its demonstrations (beyond the paper).

    Parameters
    ----------
    curves : (D, L, 2) float array
        As for `laid_together`.
    frames : Frames
        Of the D demonstrations.

    Returns
    -------
    list of (members (K,) int array, Laid)
        The way that was shown most often first.
    """
    parts = _divided(np.arange(len(curves)), curves, frames)
    parts = _joined(parts, curves, frames)
    return sorted(parts, key=lambda part: (-len(part[0]), part[0][0]))


def _divided(members, curves, frames):
    laid = laid_together(curves[members], frames.of(members))
    if len(members) == 1 or is_one_way(laid, frames.of(members)):
        return [(members, laid)]
    strangest = int(np.argmax(laid.missed + laid.beyond))
    to_strangest = [_apart(members[strangest], other, curves, frames) for other in members]
    opposite = int(np.argmax(to_strangest))
    to_opposite = [_apart(members[opposite], other, curves, frames) for other in members]
    nearer = np.array(to_strangest) < np.array(to_opposite)
    nearer[[strangest, opposite]] = True, False
    parts = members[nearer], members[~nearer]
    return [way for part in parts for way in _divided(part, curves, frames)]


def _apart(one, other, curves, frames):
    """How far two walks are from being of one way; the less the more alike, 0 for one and the same."""
    if one == other:
        return -np.inf
    both = np.array([one, other])
    laid = laid_together(curves[both], frames.of(both), references=2)
    return (laid.missed / allowed(frames.of(both)) + laid.beyond / BESIDE).max()


def _joined(parts, curves, frames):
    """Put together what was divided although it is one way."""
    parts = sorted(parts, key=lambda part: -len(part[0]))
    kept = []
    for members, laid in parts:
        for k, (others, _) in enumerate(kept):
            together = np.sort(np.concatenate([others, members]))
            both = laid_together(curves[together], frames.of(together))
            if is_one_way(both, frames.of(together)):
                kept[k] = together, both
                break
        else:
            kept.append((members, laid))
    return kept


def is_one_way(laid, frames):
    """Whether every walk that was laid onto a way is a walk of it.

    Parameters
    ----------
    laid : Laid
    frames : Frames
        Of the same demonstrations.

    Returns
    -------
    bool
    """
    enough = laid.covered.mean(axis=1) >= STRETCH
    return bool((laid.missed <= allowed(frames)).all() and (laid.beyond <= BESIDE).all() and enough.all())


def allowed(frames):
    """By how much a walk may miss its way over a stretch, in m: more where objects have moved more.

    Parameters
    ----------
    frames : Frames

    Returns
    -------
    float
    """
    there = frames.present[..., None]
    number = np.maximum(there.sum(axis=0), 1)
    mean = (frames.origins * there).sum(axis=0) / number
    moved = np.linalg.norm(frames.origins - mean, axis=2)[frames.present & (frames.objects >= 0)]
    spread = np.sqrt(np.mean(moved**2)) if moved.size else 0.0
    return float(min(MISSED + BENT * spread, MOST_BENT))
