"""A way of doing a task, from demonstrations among objects that stood elsewhere each time (Sec. V, beyond the paper)."""

from dataclasses import dataclass

import numpy as np

from dollop.learning.frames import Frames
from dollop.learning.places import Places, seen_from, tied_places
from dollop.learning.warping import alikeness, warped

PLACES = 80
ROUNDS = 4
REFERENCES = 3
PULL = 5.0
SHARES = (np.linspace(0, 1, PLACES)[:, None] - np.linspace(0, 1, PLACES)) ** 2


@dataclass(frozen=True, eq=False)
class Laid:
    """Walks laid onto the places of one way."""

    points: np.ndarray
    valid: np.ndarray
    at: np.ndarray
    places: Places
    cost: np.ndarray


def laid_onto(curves, frames, reference, rounds=ROUNDS):
    count, n = curves.shape[:2]
    points, valid = curves.copy(), np.zeros((count, n), bool)
    at = np.tile(np.arange(float(n)), (count, 1))
    valid[reference] = True
    only = [reference]
    places = tied_places(points[only], valid[only], frames.of(only))
    local = places.local
    total = np.zeros(count)
    for turn in range(rounds if count > 1 else 0):
        at, covered, total, beyond = warped(
            alikeness(places.posterior, places.candidates, local, frames, curves) + PULL * SHARES
        )
        if turn == 0:
            at[reference], covered[reference] = np.arange(n), True
        points, valid = sampled(curves, at), covered
        places = tied_places(points, valid, frames)
        local = by_others(points, valid, frames)
    return Laid(points, valid, at, tied_places(points, valid, frames, count > 1), total)


def sampled(curves, at):
    """Curves (D, n, 2) at fractional sample numbers (D, L)."""
    low = np.minimum(at.astype(int), curves.shape[1] - 2)
    share = (at - low)[..., None]
    rows = np.arange(len(curves))[:, None]
    return (1 - share) * curves[rows, low] + share * curves[rows, low + 1]


def by_others(points, valid, frames):
    """Mean offsets (D, L, F, 2) over all other demonstrations; over all where there is no other."""
    counted = (valid[:, :, None] & frames.present[:, None])[..., None]
    offsets = frames.seen(points) * counted
    number = counted.sum(axis=0)
    total = offsets.sum(axis=0)
    others = number - counted
    return np.where(others > 0, (total - offsets) / np.maximum(others, 1), total / np.maximum(number, 1))


def learned_way(curves, frames, references=REFERENCES):
    found = [laid_onto(curves, frames, k) for k in range(min(references, len(curves)))]
    return min(found, key=lambda laid: laid.cost.sum())
