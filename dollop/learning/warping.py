"""Laying walks onto a way, seen from the objects (beyond the paper).

When objects move, places do not keep their share of the way. So a walk is laid onto the places of a
way by dynamic time warping in which a sample and a place are alike when some frame that the place
follows sees them at the same spot,

    cost = min(-log sum_F w_F exp(-|offset_F - offset'_F|^2 / (4 sigma^2)), CUT) .

What a walk lacks at its beginning or end, or has more than the way, is left out at a price for each
place.
"""

import numpy as np

__all__ = ["CUT", "alikeness", "warped"]

CUT = 8.0
"""Nats: from where on farther is no less alike."""
SKIPPED, BEYOND = 3.0, 8.0
"""Nats: what it costs that a place at either end has no sample, for a walk may be cut short; and
that a sample has no place, for the way should hold all that was shown."""
FEWEST = 1e-2
"""Share: a frame that a place follows less than that says nothing of it."""


def alikeness(posterior, candidates, local, frames, points, spread):
    """How unlike each place of a way and each sample of a walk are.

    Parameters
    ----------
    weights : (L, F) float array
        How much each place follows each frame.
    local : (L, F, 2) or (D, L, F, 2) float array
        Each place as seen from each frame, in m.
    frames : Frames
        Of the D walks.
    points : (D, M, 2) float array
        The walks, in m.
    spread : float
        How far walks miss the same place, in m.

    Returns
    -------
    (D, L, M) float array
        In nats, from about 0 to `CUT`.
    """
    spots = frames.back(local)
    likelihood = np.zeros((*spots.shape[:2], points.shape[1]))
    for probability, weights in zip(posterior.T, candidates, strict=True):
        rows = np.flatnonzero(probability > FEWEST)
        used = np.flatnonzero(weights)
        if not len(rows):
            continue
        spot = np.einsum("dlfk,f->dlk", spots[:, rows][:, :, used], weights[used])
        gap = ((spot[:, :, None] - points[:, None]) ** 2).sum(axis=3)
        there = frames.present[:, used].all(axis=1)[:, None, None] * probability[rows, None]
        likelihood[:, rows] += there * np.exp(-gap / (4 * spread**2))
    return np.minimum(-np.log(np.maximum(likelihood, 1e-300)), CUT)


def warped(cost, skipped=SKIPPED, beyond=BEYOND):
    """The cheapest monotone way through each matrix of costs, its ends left out where that is cheaper.

    Parameters
    ----------
    cost : (D, L, M) float array
        Of walk d's sample m at place l, in nats.
    skipped, beyond : float
        Of leaving out a place, and a sample, at either end, in nats.

    Returns
    -------
    at : (D, L) float array
        Which sample of the walk is at each place, as fractional numbers.
    covered : (D, L) bool array
        False for places at either end that the walk lacks.
    total : (D,) float array
        In nats.
    beyond : (D,) float array
        How many of a walk's samples are left out at its ends.
    """
    results = [_warped(each, skipped, beyond) for each in cost]
    return tuple(map(np.array, zip(*results, strict=True)))


def _warped(cost, skipped, price):
    places, samples = cost.shape
    total = np.empty((places + 1, samples + 1))
    total[0], total[:, 0] = price * np.arange(samples + 1), skipped * np.arange(places + 1)
    for place in range(1, places + 1):
        sums = np.concatenate([[0.0], cost[place - 1]]).cumsum()
        best = np.minimum(total[place - 1, 1:], total[place - 1, :-1])
        best = np.concatenate([[total[place, 0]], best + cost[place - 1]])
        total[place] = np.minimum.accumulate(best - sums) + sums
    end_place = total[:, -1] + skipped * np.arange(places, -1, -1)
    end_sample = total[-1] + price * np.arange(samples, -1, -1)
    if end_place.min() <= end_sample.min():
        place, sample = int(end_place.argmin()), samples
    else:
        place, sample = places, int(end_sample.argmin())
    at, covered, beyond = _traced(total, cost, place, sample)
    return at, covered, min(end_place.min(), end_sample.min()), beyond


def _traced(total, cost, place, sample):
    """Follow the cheapest way back; see `warped`."""
    places, samples = cost.shape
    sums, counts, beyond = np.zeros(places), np.zeros(places), samples - sample
    while place > 0 and sample > 0:
        sums[place - 1] += sample - 1
        counts[place - 1] += 1
        before = total[place - 1, sample - 1], total[place - 1, sample], total[place, sample - 1]
        step = int(np.argmin(before))
        place, sample = place - (step != 2), sample - (step != 1)
    covered = counts > 0
    covered &= ~_waiting(sums / np.maximum(counts, 1), cost)
    beyond += sample
    at = (
        np.interp(np.arange(places), np.flatnonzero(covered), sums[covered] / counts[covered])
        if covered.any()
        else sums
    )
    return at, covered, beyond


def _waiting(at, cost):
    """Places (L,) for which a walk's first or last sample only waits: it belongs to the most alike."""
    first, last = np.flatnonzero(at == 0), np.flatnonzero(at == cost.shape[1] - 1)
    waiting = np.zeros(len(at), bool)
    if len(first) > 1:
        waiting[first[: int(cost[first, 0].argmin())]] = True
    if len(last) > 1:
        waiting[last[int(cost[last, -1].argmin()) + 1 :]] = True
    return waiting
