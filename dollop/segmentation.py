"""Where to cut a trajectory into segments of one LDS each, by dynamic programming (Sec. III).

An LDS is fitted to every possible segment, and what is compared with the trajectory is its whole
response: the error of single steps is tiny for any finely sampled path. The companion work that
the paper cites for the segmentation could not be found: criterion, search and the meaning of the
tolerance are reconstructions.

Symbols: C candidate cuts, d = 2 dimensions, K trajectories; G0 and G1 as in `dollop.lds`.
"""

from functools import lru_cache
from math import prod

import numpy as np

from dollop.lds import DECAY, NOTHING, STEPS, Statistics
from dollop.trajectory import remaining_share

__all__ = [
    "HORIZON",
    "best_segments",
    "cuts_within",
    "fewest_cuts",
    "fewest_segments",
    "raw_statistics",
    "retimed_statistics",
    "segment_errors",
]

HORIZON, SETTLED = 48, 4.0
"""The search follows a response over this many points, over this many time constants."""

AT_ONCE = 4096  # segments looked at together, so that what is held of them stays within some ten MB
FIRST_LOOK = 4  # cuts within a segment
ROUNDING = 1e-9  # share of a sum that its order may change
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
        (start, length) -> Statistics (..., d, d). Start and length (...) count cuts.

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

    columns = np.ascontiguousarray(aligned.transpose(0, 2, 1))
    steps = np.diff(columns, axis=2)
    low, share = retimed_places(aligned.shape[1] // 2 + 1)

    def statistics(start, length):
        rows = low.take(length, axis=0) + 2 * np.asarray(start)[..., None]
        between = share.take(length, axis=0)
        samples = (along_edges(*each, rows, between) for each in zip(columns, steps, strict=True))
        first, *others = map(componentwise_statistics, samples)
        return sum(others, first)

    return statistics


def along_edges(starts, edges, which, share):
    """Places (d, ...) a share of the way along those edges (d, N) that are named."""
    places = edges.take(which, axis=1)
    places *= share
    places += starts.take(which, axis=1)
    return places


@lru_cache(maxsize=4)
def retimed_places(count):
    """Where segments of length 0 to count - 1 are sampled: the samples before, the shares to the next.

    Two (count, STEPS + 1) arrays.
    """
    length = np.arange(count)[:, None]
    at = 2 * length * (1 - remaining_share(STEPS, DECAY))
    low = np.clip(at.astype(int), 0, np.maximum(2 * length - 1, 0))
    return low, at - low


def componentwise_statistics(samples):
    """`Statistics.of` samples (d, ..., N), one component after the other: faster."""
    offsets = samples - samples[..., -1:]
    before, after = offsets[..., :-1], offsets[..., 1:]
    return Statistics(*(np.einsum("a...n,b...n->...ab", each, before) for each in (before, after)))


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
    path : (C, 2) float array
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
    errors = np.full((len(path), len(path)), np.nan)
    cuts = np.arange(len(path))
    fill_errors(errors, path, statistics, (cuts, cuts), np.inf, room_for_responses())
    return looked_at(errors)


def fewest_cuts(path, statistics, tolerance, errors=None):
    """`fewest_segments` of all `segment_errors`, found by looking only at those that can matter.

    Parameters
    ----------
    path : (C, 2) float array
        The walks' mean at the candidate cuts, m.
    statistics : callable
        (start, length) -> Statistics.
    tolerance : float
        Largest mean error of a segment, m.
    errors : (C, C) float array, optional
        As of `cuts_within`; by default nothing is known.

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
    A corner is cut where it is:

    >>> corner = np.array([[min(k, 8), max(k - 8, 0)] for k in range(17)], float)
    >>> fewest_cuts(corner[::2], retimed_statistics(corner[None]), 0.01)
    array([0, 4, 8])
    """
    errors = np.full((len(path), len(path)), np.nan) if errors is None else errors
    impossible = errors == np.inf
    cuts = cuts_within(path, statistics, tolerance, errors)
    if cuts is not None:
        return cuts
    return fewest_segments(np.where(impossible, np.inf, segment_errors(path, statistics)), tolerance)


def cuts_within(path, statistics, tolerance, errors):
    """As `fewest_cuts`, from what is known of the errors; what else is needed is entered there.

    Parameters
    ----------
    path : (C, 2) float array
        The walks' mean at the candidate cuts, m.
    statistics : callable
        (start, length) -> Statistics.
    tolerance : float
        Largest mean error of a segment, m.
    errors : (C, C) float array
        m; NaN where not looked at, `inf` where above the tolerance or refused. Changed in place.

    Returns
    -------
    (S + 1,) int array or None
        The cuts of S segments, the first 0 and the last C - 1; None if no division keeps the
        tolerance.

    Examples
    --------
    A segment that is refused is done without:

    >>> line = np.linspace([0.0, 0.0], [4.0, 2.0], 17)
    >>> known, asked = np.full((9, 9), np.nan), (line[::2], retimed_statistics(line[None]), 0.01)
    >>> cuts_within(*asked, known)
    array([0, 8])
    >>> known[0, 8] = np.inf
    >>> len(cuts_within(*asked, known))
    3
    """
    look_within(path, statistics, tolerance, errors)
    return divide(looked_at(errors), lambda total, k: np.isfinite(total))


def looked_at(errors):
    """Errors (C, C), `inf` where they are not known."""
    return np.where(np.isnan(errors), np.inf, errors)


def look_within(path, statistics, tolerance, errors):
    """Enter the errors (C, C) in m that a division into the fewest segments can need.

    Such a division goes from every cut to one that no fewer segments reach: so first come the cuts
    that one segment within the tolerance reaches, then those that a second reaches from there.
    """
    cuts = np.arange(len(path))
    fresh, missed, room = cuts[:1], cuts[1:], room_for_responses()
    while len(fresh) and cuts[-1] in missed:
        fill_errors(errors, path, statistics, (fresh, missed), tolerance, room)
        hit = np.isfinite(errors[np.ix_(fresh, missed)]).any(axis=0)
        fresh, missed = missed[hit], missed[~hit]


def fill_errors(errors, path, statistics, cuts, tolerance, room):
    """Enter the errors in m of segments between some cuts and others, `inf` where above the tolerance.

    Those that are not NaN are known.
    """
    starts, ends = cuts
    length = ends - starts[:, None]
    rows, columns = np.nonzero((length >= 2) & np.isnan(errors[np.ix_(starts, ends)]))
    order = np.argsort(length[rows, columns], kind="stable")
    start, end = starts[rows[order]], ends[columns[order]]
    for k in range(0, len(order), AT_ONCE):
        some = start[k : k + AT_ONCE], end[k : k + AT_ONCE]
        errors[some] = errors_of_some(path, statistics, *some, tolerance, room)


def room_for_responses():
    """Room for one lot of responses after the other: states, and vertices in single precision.

    Asked of the system anew for each lot, and given back, it would take a tenth of the search.
    """
    states, vertices = (each * (HORIZON + 2) * AT_ONCE for each in (2, 3))
    room = np.empty(states + (vertices + 1) // 2)
    return room[:states], room[states:].view(np.float32)


def part_of(room, *shape):
    """An array of that shape at the beginning of a room."""
    return room[: prod(shape)].reshape(shape)


def errors_of_some(path, statistics, start, end, tolerance, room):
    """Errors (B,) in m of segments from start to end (B,), `inf` where their mean exceeds the tolerance.

    Few cuts all over a segment are looked at first, then as many again, and so on; but no more
    once their distances add up to more than the whole segment is allowed.
    """
    length, columns = end - start, np.ascontiguousarray(path.T)
    goals = columns.take(end, axis=1)
    size, offsets = (HORIZON + 2, len(start)), columns.take(start, axis=1) - goals
    polylines = candidate_responses(statistics(start, length), offsets, part_of(room[0], 2, *size))
    vertices = lifted_vertices(polylines, part_of(room[1], size[1], 3, size[0]))
    order = spread_order(len(path))
    total, left, seen, enough = np.zeros(len(start)), np.arange(len(start)), 0, FIRST_LOOK
    while len(left):
        cuts = start[left, None] + order[length[left], seen : min(enough, length[left].max() - 1)]
        points = columns.take(cuts, axis=1) - goals[:, left, None]
        total[left] += distances(points, polylines, vertices, left).sum(axis=1)
        hopeful = total[left] <= (1 + ROUNDING) * tolerance * length[left]
        left = left[hopeful & (length[left] - 1 > enough)]
        seen, enough = enough, 2 * enough
    return np.where(total / length <= tolerance, total, np.inf)


@lru_cache(maxsize=4)
def spread_order(count):
    """(count, count) ints: row L holds 1 to L - 1, the first few of them all over, then only L.

    L is the end of a segment of that length, which lies on every response.
    """
    bits = int(count - 1).bit_length()
    reversed_bits = sum((np.arange(2**bits) >> k & 1) << (bits - 1 - k) for k in range(bits))
    order = np.tile(np.arange(count)[:, None], (1, count))
    for length in range(2, count):
        order[length, : length - 1] = reversed_bits[(reversed_bits > 0) & (reversed_bits < length)]
    return order


def candidate_responses(statistics, x0, out=None):
    """Responses (2, HORIZON + 2, B) from offsets x0 (2, B), up to the subgoal at 0.

    Slow systems are shown by every m-th state, m a power of two such that the response settles
    within the horizon.
    """
    time_constants = -1 / np.log(np.clip(statistics.decay, 0.5, 1 - 1e-6))  # in steps
    doublings = np.log2(np.maximum(SETTLED * time_constants / HORIZON, 1)).astype(int)
    step = componentwise_matrix(statistics)
    for k in range(doublings.max()):
        step = np.where(k < doublings, product(step, step), step)
    states, known = np.empty((2, HORIZON + 2, x0.shape[1])) if out is None else out, 1
    states[:, 0], states[:, -1] = x0, 0
    while known <= HORIZON:
        more = min(known, HORIZON + 1 - known)
        product(step, states[:, :more], states[:, known : known + more])
        step, known = product(step, step), known + more
    return states


def componentwise_matrix(statistics):
    """`Statistics.matrix` A = G1 G0^-1 as (2, 2, B), by the formula for two dimensions: faster."""
    G0, G1 = (np.ascontiguousarray(each.transpose(1, 2, 0)) for each in statistics.regular)
    adjugate = np.array([[G0[1, 1], -G0[0, 1]], [-G0[1, 0], G0[0, 0]]])
    return product(G1, adjugate) / (G0[0, 0] * G0[1, 1] - G0[0, 1] * G0[1, 0])


def product(A, B, out=None):
    """A B of matrices (2, 2, ...) and (2, m, ...), components first."""
    AB = np.multiply(A[:, :1], B[:1], out=out)
    AB += A[:, 1:] * B[1:]
    return AB


def lifted_vertices(polylines, out=None):
    """-2 v and |v|^2 of the vertices v of polylines (2, V, B), as (B, 3, V): for `nearest_vertices`."""
    count, many = polylines.shape[1:]
    lifted = np.empty((many, 3, count), np.float32) if out is None else out
    np.multiply(polylines.transpose(2, 0, 1), -2, out=lifted[:, :2], casting="same_kind")
    x, y, square = lifted.transpose(1, 0, 2)
    np.multiply(x, x, out=square)
    square += y * y
    square *= 0.25
    return lifted


def nearest_vertices(points, lifted):
    """Which vertex (Q, T) of (Q, 3, V) is nearest to points p (2, Q, T): least |v|^2 - 2 v p."""
    ones = np.ones((*points.shape[1:], 3), np.float32)  # single precision: only to choose
    ones[..., 0], ones[..., 1] = points
    return (ones @ lifted).argmin(axis=2)


def distances(points, polylines, lifted, which):
    """Distances (Q, T) of points (2, Q, T) to the polylines numbered `which` (Q,) of (2, V, B).

    Only the two edges at the nearest vertex are looked at: that is what makes the search fast.
    Where a polyline comes closest between two vertices that are both farther away than a third one,
    the distance is slightly too large, never too small.
    """
    count, many = polylines.shape[1:]
    vertex = nearest_vertices(points, lifted if len(which) == many else lifted[which])
    flat, at = polylines.reshape(2, -1), vertex * many + which[:, None]
    near = flat.take(at, axis=1)
    others = np.where(vertex > 0, -many, 0), np.where(vertex < count - 1, many, 0)
    edges = (flat.take(at + other, axis=1) - near for other in others)
    return np.sqrt(np.minimum(*(squared_distance(points - near, edge) for edge in edges)))


def squared_distance(offset, along):
    """Squared distance (...) of offsets (2, ...) from a place to the edge along (2, ...) from there."""
    (x, y), (u, v) = offset, along
    share = np.clip((x * u + y * v) / np.maximum(u * u + v * v, NOTHING), 0, 1)
    x, y = x - share * u, y - share * v
    return x * x + y * y


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
