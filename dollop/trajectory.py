"""Trajectories as curves: arc length, re-timing, their mean and distances between them (Sec. III).

A trajectory is an (N, d) array of positions in m in the order they were visited; d is 2 in the
plane.
"""

from collections.abc import Sequence

import numpy as np
import scipy

from dollop.checks import (
    checked_array,
    checked_number,
    checked_positions,
    checked_records,
    checked_whole,
)

FAR_APART = 1e10  # m
LEAST_WAY = 1e-6  # m: who has not come so far has not moved
MOST_SAMPLES, MOST_ALIGNED, MOST_DECAY = 10_000_000, 5_000, 500.0  # those aligned are held in pairs
_AT_ONCE = 1 << 14  # pairs of a point and an edge measured at once: they stay in a processor's cache
_FAR, _NEAR = (
    0.2,
    0.15,
)  # of the walks' size: farther is another way, nearer is not (letters of one kind: 0.14)
_STRAY = 1.0  # m, twice as far as walked subgoals scatter: another way, if the others keep together
_TOGETHER = 3.0  # others keep together if this many times as close (sets of one way: 2.8 in 600)
_NAMED = 5  # more walks are counted, not named
_ROUNDS = 3  # how often walks are laid onto their mean: then it hardly changes any more


def check_trajectory(trajectory, name="trajectory"):
    """The trajectory as a float array, if it is one.

    Parameters
    ----------
    trajectory : (N, 2) array_like
        Positions in m.
    name : str
        What to call it in the error.

    Returns
    -------
    (N, 2) float array
        A copy, m.

    Raises
    ------
    ValueError
        Fewer than three points, not planar, not finite, farther away than 1e9 m, or no movement by a
        micrometre.

    Examples
    --------
    >>> check_trajectory([[0, 1], [0, 1], [0, 1]], "walk")
    Traceback (most recent call last):
    ValueError: walk must move, got 3 times the position [0. 1.]
    """
    points = checked_positions(name, trajectory)
    if len(points) < 3:
        raise ValueError(f"{name} must have at least three points, got {len(points)}")
    if not np.abs(points - points[0]).max() > LEAST_WAY:
        raise ValueError(f"{name} must move, got {len(points)} times the position {points[0]}")
    return points


def check_trajectories(trajectories):
    """One trajectory or several, as a list of checked arrays.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like
        Positions in m.

    Returns
    -------
    list of K (N_k, 2) float arrays
        Copies, m.

    Raises
    ------
    ValueError
        None given, or one of them is no trajectory (see `check_trajectory`).

    Examples
    --------
    One walk alone is a list of one.

    >>> walk = [[0, 0], [1, 0], [2, 0]]
    >>> len(check_trajectories(walk)), len(check_trajectories([walk, walk]))
    (1, 2)
    """
    if is_one(trajectories):
        return [check_trajectory(trajectories)]
    trajectories = checked_records("trajectories", trajectories, object)
    if not trajectories:
        raise ValueError("trajectories must hold at least one trajectory, got none")
    return [check_trajectory(each, f"trajectory {k}") for k, each in enumerate(trajectories)]


def is_one(trajectories):
    """Whether it is one trajectory, and not several.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like

    Returns
    -------
    bool
        By its first row, which is numbers; what is neither is several.
    """
    if not isinstance(trajectories, Sequence):
        return len(getattr(trajectories, "shape", ())) == 2
    first = trajectories[0] if len(trajectories) else ()
    if not isinstance(first, Sequence):
        return np.ndim(first) == 1
    return len(first) > 0 and np.isscalar(first[0])


def _curve(name, points, d="d"):
    """Points of a curve (N, d) as a float array of their own, one at least."""
    points = checked_positions(name, points, "N", d)
    if not points.size:
        raise ValueError(f"{name} must be one at least, got none")
    return points


def arc_length(points):
    """Distance walked up to each point.

    Parameters
    ----------
    points : (N, d) array_like
        Positions in m.

    Returns
    -------
    (N,) float array
        m, starting at 0.

    Raises
    ------
    ValueError
        What is no curve of finite numbers within 1e9 m.

    Examples
    --------
    >>> arc_length([[0, 0], [3, 4], [3, 5]])
    array([0., 5., 6.])
    """
    return _arc_length(_curve("points", points))


def _arc_length(points):
    way = np.zeros(len(points))
    np.linalg.norm(points[1:] - points[:-1], axis=1).cumsum(out=way[1:])
    return way


def at_arc_length(points, distance):
    """Positions after walking given distances along a trajectory.

    Parameters
    ----------
    points : (N, d) array_like
        Positions in m.
    distance : (M,) array_like
        Arc lengths in m.

    Returns
    -------
    (M, d) float array
        m, linear between the points, held at both ends.

    Raises
    ------
    ValueError
        What is no curve of finite numbers within 1e9 m, or no distances.

    Examples
    --------
    >>> at_arc_length([[0, 0], [3, 4], [3, 5]], [2.5, 5.5, 99])
    array([[1.5, 2. ],
           [3. , 4.5],
           [3. , 5. ]])
    """
    return _at_arc_length(_curve("points", points), checked_array("distance", distance, "M"))


def _at_arc_length(points, distance):
    walked = _arc_length(points)
    moved = np.diff(walked, prepend=-1) > 0
    columns = points[moved].T
    return np.stack([np.interp(distance, walked[moved], each) for each in columns], axis=1)


def resample(points, n):
    """The same curve by `n` points at equal distances along it.

    Parameters
    ----------
    points : (N, d) array_like
        Positions in m.
    n : int
        At least two, and ten million at most.

    Returns
    -------
    (n, d) float array
        m; first and last are the curve's own.

    Raises
    ------
    ValueError
        What is no curve of finite numbers within 1e9 m, or no number of points.

    Examples
    --------
    >>> resample([[0, 0], [1, 0], [4, 0]], 3)[:, 0]
    array([0., 2., 4.])
    """
    points, n = _curve("points", points), checked_whole("n", n, 2, MOST_SAMPLES)
    return _at_arc_length(points, np.linspace(0, _arc_length(points)[-1], n))


def remaining_share(n, decay):
    """Share of the way still to go at each sample of a re-timed segment (see `retime`).

    Parameters
    ----------
    n : int
        Number of steps.
    decay : float
        Time constants over the segment.

    Returns
    -------
    (n + 1,) float array
        Geometric from 1 on, and 0 at the last.

    Raises
    ------
    ValueError
        For less than a step or more than ten million, a decay that is negative or beyond 500.

    Examples
    --------
    >>> remaining_share(3, 3 * np.log(2))
    array([1.  , 0.5 , 0.25, 0.  ])
    """
    n, decay = checked_whole("n", n, 1, MOST_SAMPLES), checked_number("decay", decay, 0, MOST_DECAY)
    return np.append(np.exp(-decay * np.arange(n) / n), 0.0)


def retime(points, n=60, decay=3.0):
    r"""The same curve, walked so that the remaining way decays geometrically (a reconstruction).

    A user walks through a subgoal at speed; a linear system that has its equilibrium there can only
    slow down into it. Sample j of the re-timed curve lies where the arc length

    .. math:: r_j = L e^{-c j / n}, \quad j < n, \qquad r_n = 0

    remains, so that the curve keeps its shape and takes the one timing that a linear system can
    follow.

    Parameters
    ----------
    points : (N, d) array_like
        Positions in m.
    n : int
        Number of steps.
    decay : float
        c, the number of time constants over the curve.

    Returns
    -------
    (n + 1, d) float array
        m; the first and last are the curve's own.

    Raises
    ------
    ValueError
        As `remaining_share`, and for what is no curve of finite numbers within 1e9 m.

    Examples
    --------
    >>> retime([[0, 0], [8, 0]], 3, 3 * np.log(2))[:, 0]
    array([0., 4., 6., 8.])
    """
    points = _curve("points", points)
    return _at_arc_length(points, _arc_length(points)[-1] * (1 - remaining_share(n, decay)))


def distance_to_polyline(points, polyline):
    """Distance of each point to the nearest place on a polyline, its edges included.

    Memory grows with N + M, time with N log M or so; with N M where all points are as far from all
    edges.

    Parameters
    ----------
    points : (N, d) array_like
        m.
    polyline : (M, d) array_like
        Its vertices in m.

    Returns
    -------
    (N,) float array
        m.

    Raises
    ------
    ValueError
        What are no finite numbers within 1e9 m, or are of several dimensions.

    Examples
    --------
    >>> distance_to_polyline([[1.0, 2.0], [5.0, 0.0]], [[0.0, 0.0], [2.0, 0.0]])
    array([2., 3.])
    """
    polyline = _curve("polyline", polyline)
    points = checked_positions("points", points, "N", polyline.shape[1])
    edges = np.diff(polyline, axis=0) if len(polyline) > 1 else np.zeros_like(polyline)
    return _distance_to_edges(points, polyline[: len(edges)], edges)


def _distance_to_edges(points, starts, edges):
    """Distances (N,) in m of points (N, d) to the nearest of edges, starts (M, d) and along (M, d).

    Many are divided: the points on either side, each with those edges that can be nearest to one of
    them, which is judged by the distance to the middle of a circle round them.
    """
    if len(points) == 1 or len(points) * len(edges) <= _AT_ONCE:
        return _to_each_edge(points, starts, edges).min(axis=1)
    nearest, widest = np.empty(len(points)), np.ptp(points, axis=0).argmax()
    for some in np.array_split(np.argpartition(points[:, widest], len(points) // 2), 2):
        middle = (points[some].min(axis=0) + points[some].max(axis=0)) / 2
        radius = np.linalg.norm(points[some] - middle, axis=1).max()
        apart = _to_each_edge(middle[None], starts, edges)[0]
        if radius == 0:  # all are one place
            nearest[some] = apart.min()
            continue
        near = ~(apart > (1 + 1e-9) * (apart.min() + 2 * radius))
        nearest[some] = _distance_to_edges(points[some], starts[near], edges[near])
    return nearest


def _to_each_edge(points, starts, edges):
    """Distances (N, M) in m of points (N, d) to edges, see `_distance_to_edges`."""
    squared = np.maximum((edges**2).sum(axis=1), np.finfo(float).tiny)
    offsets = [column[:, None] - start for column, start in zip(points.T, starts.T, strict=True)]
    along = sum(offset * edge for offset, edge in zip(offsets, edges.T, strict=True)) / squared
    along = np.minimum(np.maximum(along, 0), 1)
    beside = (offset - along * edge for offset, edge in zip(offsets, edges.T, strict=True))
    return np.sqrt(sum(each * each for each in beside))  # one component after the other: faster


def align(trajectories, n=200):
    """Several walks along one curve, sampled where they belong together (a reconstruction).

    Equal shares of arc length drift apart where one walk swings wider than another. So each walk is
    laid onto the mean of all by the monotone warp with the least squared distance (a shortest
    path), and the mean is taken anew.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like
        Positions in m; all start and end at corresponding places.
    n : int
        Number of samples.

    Returns
    -------
    aligned : (K, n, 2) float array
        m; sample i of every walk belongs to sample i of every other.
    share : (K, n) float array
        The share of each walk's arc length at which it was sampled, rising from 0 to 1.

    Raises
    ------
    ValueError
        What `check_trajectories` refuses, or less than two samples or more than 5000.

    Examples
    --------
    One walk makes a detour to (1, 1) and back; half of both ways is not the same place:

    >>> line = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])
    >>> detour = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.0], [3.0, 0.0]])
    >>> aligned, share = align([line, detour], 101)
    >>> bool(share[1, 50] > share[0, 50])
    True
    """
    walks, n = check_trajectories(trajectories), checked_whole("n", n, 2, MOST_ALIGNED)
    share = np.tile(np.linspace(0, 1, n), (len(walks), 1))
    aligned = np.stack([resample(walk, n) for walk in walks])
    if len(walks) == 1:
        return aligned, share
    fine = np.stack([resample(walk, 2 * n - 1) for walk in walks])
    lengths = np.array([arc_length(walk)[-1] for walk in walks])
    for _ in range(_ROUNDS):
        share = _monotone_warp(resample(aligned.mean(axis=0), n), fine)
        aligned = np.stack(list(map(_at_arc_length, walks, share * lengths[:, None])))
    return aligned, share


def _monotone_warp(reference, walks):
    """Lay walks monotonically onto a reference, both sampled at equal distances.

    What is least is the sum of squared distances and of squared slips along the path per step.

    Parameters
    ----------
    reference : (n, d) float array
        m.
    walks : (K, 2 n - 1, d) float array
        m, sampled twice as finely, so that a walk may lag or lead by half steps, at most twice as
        fast.

    Returns
    -------
    (K, n) float array
        For each reference sample the share of the walk, rising from 0 to 1.
    """
    n, fine = len(reference), walks.shape[1]
    step = np.linalg.norm(np.diff(walks, axis=1), axis=2).mean(axis=1)
    penalty = (step[:, None] * (np.arange(5) - 2)) ** 2  # five moves: 0 to 4 fine steps
    best = np.full((len(walks), fine + 4), np.inf)
    best[:, 4] = 0.0
    moves = np.empty((n, len(walks), fine), np.int8)
    for i in range(1, n):
        reach = np.stack([best[:, 4 - m :][:, :fine] + penalty[:, m, None] for m in range(5)])
        moves[i] = reach.argmin(axis=0)
        best[:, 4:] = reach.min(axis=0) + ((walks - reference[i]) ** 2).sum(axis=2)
    at = np.full((len(walks), n), fine - 1)
    for i in range(n - 1, 0, -1):
        at[:, i - 1] = at[:, i] - moves[i, np.arange(len(walks)), at[:, i]]
    return at / (fine - 1)


def chained(apart, size, least=0.0):
    """Which of several walks belong together: each keeps close to the next of its way, all along.

    Beyond the paper. Close is within a fifth of the walks' size, which mirrored, reversed and
    truncated walks, other shapes and most detours are not. Where three or more are there to compare,
    a gap above 0.15 of the size, or above 1 m, is too wide as well if it is three times the one
    that half of the walks keep. Two walks that differ by less than a fifth of their size cannot be
    told from one that sways.

    Parameters
    ----------
    apart : (K, K) float array
        The largest distance between any two walks at corresponding places, m.
    size : float
        Of the walks, m: the diagonal of the box round one.
    least : float
        What is close in any case, m.

    Returns
    -------
    way : (K,) int array
        The number of each walk's way; 0 has the most walks, and among equals the first.
    allowed : float
        How far from the next walk is still close, m.

    Raises
    ------
    ValueError
        Distances that are not (K, K) or negative, a negative size.

    Examples
    --------
    Two walks 0.5 m apart can be one way, but not if others keep to 10 cm:

    >>> at = np.array([0.0, 0.5, 0.6, 0.7])
    >>> apart = abs(at[:, None] - at)
    >>> chained(apart[:2, :2], 3.0)[0], chained(apart, 3.0)[0]
    (array([0, 0]), array([1, 0, 0, 0]))
    """
    apart = checked_array("apart", apart, "K", "K", least=0, most=FAR_APART)
    if not apart.size or apart.shape[0] != apart.shape[1]:
        raise ValueError(f"apart must be of any two walks, got shape {apart.shape}")
    size, least = (
        checked_number("size", size, 0, FAR_APART),
        checked_number("least", least, 0, FAR_APART),
    )
    linked = np.maximum(apart, np.finfo(float).tiny)  # 0 would be no link
    gaps = np.sort(scipy.sparse.csgraph.minimum_spanning_tree(linked).data)
    usual = gaps[(len(gaps) - 1) // 2] if len(gaps) else 0.0
    allowed = max(least, min(_FAR * size, max(min(_NEAR * size, _STRAY), _TOGETHER * usual)))
    _, label = scipy.sparse.csgraph.connected_components(linked <= allowed, directed=False)
    order = np.argsort(-np.bincount(label), kind="stable")
    return np.argsort(order)[label], allowed


def ways_apart(trajectories, n=50):
    """Walks sorted by the way they take, any two laid onto each other and compared (see `chained`).

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like
        Positions in m.
    n : int
        Number of samples to compare.

    Returns
    -------
    way : (K,) int array
        As of `chained`.
    allowed : float
        How far from the next walk of its way a walk may be, m.
    apart : (K, K) float array
        The largest distance between two walks at corresponding places, m.

    Raises
    ------
    ValueError
        What `check_trajectories` refuses.

    Examples
    --------
    >>> walk = np.linspace([0.0, 0.0], [4.0, 0.0], 9)
    >>> ways_apart([walk[::-1], walk, walk + 0.1])[0]
    array([1, 0, 0])
    """
    walks, n = check_trajectories(trajectories), checked_whole("n", n, 2, MOST_ALIGNED)
    fine = np.stack([resample(walk, 2 * n - 1) for walk in walks])
    apart = np.empty((len(walks), len(walks)))
    for k, walk in enumerate(fine):
        at = np.rint(_monotone_warp(walk[::2], fine) * (2 * n - 2)).astype(int)
        laid = np.take_along_axis(fine, at[..., None], axis=1)
        apart[k] = np.linalg.norm(laid - walk[::2], axis=2).max(axis=1)
    apart = np.minimum(apart, apart.T)
    return *chained(apart, _size(fine), _step(fine[:, ::2])), apart


def check_one_way(trajectories, aligned):
    """Raise an error if several walks are not walks of one way.

    Parameters
    ----------
    trajectories : sequence of K (N_k, 2) float arrays
        m.
    aligned : (K, n, 2) float array
        The same as of `align`, m: where these belong together, no two are compared anew.

    Raises
    ------
    ValueError
        The message names the walks of the rarer ways, how far they are from the nearest other walk,
        what is allowed and what to do.

    Examples
    --------
    >>> walk = np.linspace([0.0, 0.0], [4.0, 0.0], 9)
    >>> walks = [walk, walk[::-1], walk + 0.1]
    >>> check_one_way(walks, align(walks)[0])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: trajectories must be walks of one way, got trajectory 1 ... m away from trajectories 0, 2; ...
    """
    if len(aligned) == 1:
        return
    apart = np.array([np.linalg.norm(aligned - walk, axis=2).max(axis=1) for walk in aligned])
    if not chained(apart, _size(aligned), _step(aligned))[0].any():
        return
    way, allowed, apart = ways_apart(trajectories)
    others = range(1, way.max() + 1)
    strays = [f"{_named(way == k)} {apart[way == k][:, way != k].min():.3g} m" for k in others]
    if strays:
        raise ValueError(
            f"trajectories must be walks of one way, got {' and '.join(strays)} away from "
            f"{_named(way == 0)}; {allowed:.3g} m to the next one would do ({_FAR} of their size, "
            "less where most are closer): dollop.learn keeps ways apart"
        )


def _size(walks):
    """Diagonal of the box round a walk in m, the median over walks (K, n, 2)."""
    return np.median(np.linalg.norm(np.ptp(walks, axis=1), axis=1))


def _step(walks):
    """The longest distance between neighbouring samples in m, the median over walks (K, n, 2)."""
    return np.median(np.linalg.norm(np.diff(walks, axis=1), axis=2).max(axis=1))


def _named(which):
    """The trajectories where `which` (K,) is true, by number or, if many, by how many they are."""
    numbers = np.flatnonzero(which)
    if len(numbers) > _NAMED:
        return f"{len(numbers)} trajectories"
    return ("trajectory " if len(numbers) == 1 else "trajectories ") + ", ".join(map(str, numbers))


def mean_trajectory(trajectories, n=200):
    """The mean of several walks along one curve (a reconstruction, see `align`).

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like
        Positions in m; all start and end at corresponding places.
    n : int
        Number of samples.

    Returns
    -------
    (n, 2) float array
        m, at equal distances.

    Raises
    ------
    ValueError
        What `check_trajectories` refuses.

    Examples
    --------
    >>> left, right = [[0, 1], [1, 1], [2, 1]], [[0, -1], [1, -1], [2, -1]]
    >>> mean_trajectory([left, right], 3)
    array([[0., 0.],
           [1., 0.],
           [2., 0.]])
    """
    return resample(align(trajectories, n)[0].mean(axis=0), n)
