"""Where to cut a trajectory into segments of one LDS each, by dynamic programming (Sec. III).

An LDS is fitted to every possible segment, and what is compared with the trajectory is its whole
response: the error of single steps is tiny for any finely sampled path. The companion work that
the paper cites for the segmentation could not be found: criterion, search and the meaning of the
tolerance are reconstructions.

Symbols: C candidate cuts, d = 2 dimensions, K trajectories; G0 and G1 as in `dollop.lds`.
"""

import numpy as np

from dollop.lds import DECAY, NOTHING, STEPS, Statistics, dot, powers_on
from dollop.trajectory import remaining_share

__all__ = ["HORIZON", "best_segments", "fewest_segments", "raw_statistics", "retimed_statistics", "segment_errors"]

HORIZON, SETTLED = 48, 4.0
"""The search follows a response over this many points, over this many time constants."""

EVEN = 1e-8  # m per squared cut: of equal errors the more even division, not as rounding has it


def retimed_statistics(aligned):
    """The statistics of re-timed segments, summed over the walks (a reconstruction).

    Parameters
    ----------
    aligned : (K, 2 C - 1, d) float array
        Walks in m, with a sample at each of the C candidate cuts and one between.

    Returns
    -------
    callable
        (start, length) -> Statistics (..., d, d). Start (...) and length count cuts; all segments
        of one call have one length, because then they also share the places at which they are
        sampled.

    Examples
    --------
    Those of the piece cut out and re-timed:

    >>> from dollop.trajectory import retime
    >>> line = np.linspace([0.0, 0.0], [4.0, 2.0], 9)
    >>> quick = retimed_statistics(line[None])(1, 3)
    >>> slow = Statistics.of(retime(line[2:9], STEPS, DECAY))
    >>> np.allclose(quick.G0, slow.G0), np.allclose(quick.G1, slow.G1)
    (True, True)
    """

    def statistics(start, length):
        at = 2 * length * (1 - remaining_share(STEPS, DECAY))
        low = np.minimum(at.astype(int), 2 * length - 1)
        rows = 2 * np.asarray(start)[..., None] + low
        before, after = aligned.take(rows, axis=1), aligned.take(rows + 1, axis=1)
        each = Statistics.of(before + (at - low)[:, None] * (after - before))
        return Statistics(each.G0.sum(axis=0), each.G1.sum(axis=0))

    return statistics


def raw_statistics(walks, moments):
    """The statistics of segments of the samples as they are, from sums taken once along each walk.

    Parameters
    ----------
    walks : sequence of K (N_k, d) float arrays
        m.
    moments : (K, C) float array
        Fractional sample numbers of the candidate cuts.

    Returns
    -------
    callable
        (start, length) -> Statistics (..., d, d), as of `retimed_statistics`, summed over the
        walks.

    Examples
    --------
    Those of the samples between the cuts:

    >>> walk = np.random.default_rng(0).normal(size=(9, 2)).cumsum(axis=0)
    >>> quick = raw_statistics([walk], np.arange(0.0, 9.0)[None])(2, 5)
    >>> np.allclose(quick.G1, Statistics.of(walk[2:8]).G1)
    True
    """
    cuts = moments.round().astype(int)
    sums = [running_sums(walk - walk.mean(axis=0)) for walk in walks]

    def statistics(start, length):
        first, *others = map(shifted_sums, sums, cuts[:, start], cuts[:, start + length])
        return sum(others, first)

    return statistics


def running_sums(walk):
    """The walk (N, d), and sums of p[n], p[n] p[n]^T, p[n+1] p[n]^T over the n before each."""
    now, after = walk[:-1], walk[1:]
    terms = now, outer(now, now), outer(after, now)
    return walk, *(np.insert(term.cumsum(axis=0), 0, 0, axis=0) for term in terms)


def shifted_sums(sums, start, end):
    """Statistics of samples start to end (...), shifted by the last: the products expanded."""
    walk, first, now, after = sums
    goal, count = walk[end], (end - start)[..., None, None]
    total = first[end] - first[start]
    later = total + goal - walk[start]
    square = count * outer(goal, goal)
    G0 = now[end] - now[start] - outer(total, goal) - outer(goal, total) + square
    G1 = after[end] - after[start] - outer(later, goal) - outer(goal, total) + square
    # Less than this is what rounding leaves of nothing.
    moves = np.trace(G0, axis1=-2, axis2=-1)[..., None, None] > 1e-10 * np.trace(now[-1])
    return Statistics(np.where(moves, G0, 0), np.where(moves, G1, 0))


def outer(a, b):
    """Outer products a b^T (..., d, d) of vectors (..., d)."""
    return a[..., :, None] * b[..., None, :]


def segment_errors(path, statistics):
    """Total distance from the path to the response of every possible segment (a reconstruction).

    Parameters
    ----------
    path : (C, d) float array
        The walks' mean at the candidate cuts, m.
    statistics : callable
        (start, length) -> Statistics.

    Returns
    -------
    (C, C) float array
        In m: [i, j] for the segment from cut i to cut j, summed over the cuts between; `inf` where
        there is none between, since such a segment would not be put to any test.

    Examples
    --------
    Every piece of a straight line is a segment without error:

    >>> line = np.linspace([0.0, 0.0], [4.0, 2.0], 9)
    >>> errors = segment_errors(line[::2], retimed_statistics(line[None]))
    >>> bool((errors[np.isfinite(errors)] < 1e-9).all())
    True
    """
    errors = np.full((len(path), len(path)), np.inf)
    for length in range(2, len(path)):
        start = np.arange(len(path) - length)
        windows = path[start[:, None] + np.arange(length + 1)]
        offsets = windows - windows[:, -1:]
        responses = candidate_responses(statistics(start, length), offsets[:, 0])
        errors[start, start + length] = distances(offsets[:, 1:-1], responses).sum(axis=1)
    return errors


def candidate_responses(statistics, x0):
    """Responses (B, HORIZON + 2, d) from offsets x0 (B, d), up to the subgoal at 0.

    Slow systems are shown by every m-th state, m a power of two such that the response settles
    within the horizon.
    """
    time_constants = -1 / np.log(np.clip(statistics.decay, 0.5, 1 - 1e-6))  # in steps
    doublings = np.log2(np.maximum(SETTLED * time_constants / HORIZON, 1)).astype(int)
    step = statistics.matrix
    for k in range(doublings.max()):
        step = np.where((k < doublings)[:, None, None], step @ step, step)
    states = powers_on(step, x0, HORIZON)
    return np.concatenate([states, np.zeros_like(states[:, :1])], axis=1)


def distances(points, polylines):
    """Distances (B, T) of points (B, T, d) to polylines (B, V, d), beside their nearest vertices.

    Only the two edges at the nearest vertex are looked at: that is what makes the search fast.
    Where a polyline comes closest between two vertices that are both farther away than a third one,
    the distance is slightly too large, never too small.
    """
    count, d = polylines.shape[1:]
    vertices = polylines.astype(np.float32)  # only to choose the nearest: |v|^2 - 2 v p
    weights = np.concatenate([-2 * vertices, dot(vertices, vertices)[..., None]], axis=2)
    lifted = np.ones((*points.shape[:2], d + 1), np.float32)
    lifted[..., :d] = points
    closest = (lifted @ np.ascontiguousarray(np.swapaxes(weights, 1, 2))).argmin(axis=2)
    flat, row = polylines.reshape(-1, d), count * np.arange(len(points))[:, None]
    tails = row + np.maximum(closest - 1, 0), row + np.minimum(closest, count - 2)
    edges = (flat.take([tail, tail + 1], axis=0) for tail in tails)
    return np.minimum(*(distance_to_edge(points, *ends) for ends in edges))


def distance_to_edge(points, tail, head):
    """Distance (...) of points to the edges from tail to head, all (..., d)."""
    offset, along = points - tail, head - tail
    share = np.clip(dot(offset, along) / np.maximum(dot(along, along), NOTHING), 0, 1)
    offset -= share[..., None] * along
    return np.sqrt(dot(offset, offset))


def fewest_segments(errors, tolerance):
    """Cuts of the division with the fewest segments of mean error within tolerance (Sec. III).

    Among divisions with as few segments it is the one with the least total error. The meaning of
    the tolerance is a reconstruction.

    Parameters
    ----------
    errors : (C, C) float array
        From `segment_errors`, m.
    tolerance : float
        m.

    Returns
    -------
    (S + 1,) int array
        The cuts of S segments, the first 0 and the last C - 1.

    Raises
    ------
    ValueError
        No division keeps the tolerance; the message says which it could keep.

    Examples
    --------
    Segments that end or begin at cut 2 are perfect, all others are 1 m off at each cut:

    >>> errors = np.ones((5, 5)) * np.maximum(np.arange(5) - np.arange(5)[:, None], 1)
    >>> errors[0, 2] = errors[2, 4] = 0
    >>> fewest_segments(errors, 0.5), fewest_segments(errors, 2)
    (array([0, 2, 4]), array([0, 4]))
    """
    count = len(errors)
    mean = errors / np.maximum(np.arange(count) - np.arange(count)[:, None], 1)
    kept = np.where(mean <= tolerance, errors, np.inf)
    cuts = divide(kept, lambda total, k: np.isfinite(total))
    if cuts is None:
        least = f"with {count} candidate cuts, {least_tolerance(mean):.3g} m can"
        remedy = "a larger tolerance or more candidates would do"
        raise ValueError(f"tolerance {tolerance} m cannot be kept {least}; {remedy}")
    return cuts


def best_segments(errors, n_segments):
    """Cuts of the division into so many segments with the least total error (a reconstruction).

    Parameters
    ----------
    errors : (C, C) float array
        From `segment_errors`, m.
    n_segments : int
        S.

    Returns
    -------
    (S + 1,) int array or None
        The cuts, the first 0 and the last C - 1; None if there are too few candidates.

    Examples
    --------
    As in `fewest_segments`, segments that end or begin at cut 2 are perfect:

    >>> errors = np.ones((5, 5)) * np.maximum(np.arange(5) - np.arange(5)[:, None], 1)
    >>> errors[0, 2] = errors[2, 4] = 0
    >>> best_segments(errors, 2)
    array([0, 2, 4])
    """
    return divide(errors, lambda total, k: k == n_segments)


def divide(errors, enough):
    """Dynamic programming over D[k][j] = min_i D[k-1][i] + errors[i][j], until enough(D[k][-1], k).

    The cuts (k + 1,), or None if it is never enough. On straight parts of a trajectory many
    divisions have the same errors: then the most even one, cut early, is best.
    """
    cut = np.arange(len(errors))
    errors = errors + EVEN * ((cut - cut[:, None]) ** 2 + 0.01 * cut)
    total = np.where(cut == 0, 0.0, np.inf)
    best = np.zeros((len(errors), 1), int)  # the cuts of the best division up to each cut
    for k in range(1, len(errors)):
        sums = total[:, None] + errors
        best = np.column_stack([best[sums.argmin(axis=0)], cut])
        total = sums.min(axis=0)
        if enough(total[-1], k):
            return best[-1]
    return None


def least_tolerance(mean):
    """The least tolerance that some division keeps, for mean errors (C, C)."""
    worst = np.zeros(len(mean))
    for j in range(1, len(mean)):
        worst[j] = np.maximum(worst[:j], mean[:j, j]).min()
    return worst[-1]
