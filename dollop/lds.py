"""Describing user trajectories by a sequence of linear dynamical systems (Sec. III).

Within a segment the offset x = p - g from its subgoal g obeys x[n+1] = A x[n]; A comes from closed-form least squares.
The subgoals come from dynamic programming over all divisions of the trajectory into segments. The companion work that
the paper cites for both could not be found: fit, segmentation and the meaning of the tolerance are reconstructions.

Symbols: A (2, 2) matrix of an LDS, G0 = sum x[n] x[n]^T and G1 = sum x[n+1] x[n]^T its statistics, d = 2 dimensions.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dollop.trajectory import (
    align,
    arc_length,
    check_trajectories,
    check_trajectory,
    distance_to_polyline,
    remaining_share,
    resample,
    retime,
)

SHRINKAGE = 1e-3  # share of the mean variance that is added to every direction of G0
STEPS, DECAY = 40, 3.0  # a re-timed segment: its steps, and the time constants over which it decays
HORIZON, SETTLED = 48, 4.0  # the search follows a response over this many points, this many time constants
NOTHING = 1e-18  # m^2, a squared length that counts as zero


@dataclass(frozen=True)
class Statistics:
    """All that the fit needs to know of a segment; those of merged segments are the sum.

    Attributes
    ----------
    G0, G1 : (..., d, d) float arrays
        Sums of x[n] x[n]^T and of x[n+1] x[n]^T over all samples but the last, in m^2, x being the offset from the end.
    """

    G0: np.ndarray
    G1: np.ndarray

    def __add__(self, other):
        return Statistics(self.G0 + other.G0, self.G1 + other.G1)

    @classmethod
    def of(cls, samples):
        """Statistics of trajectories of one length, (..., N, d), each shifted by its own last sample."""
        offsets = samples - samples[..., -1:, :]
        before = np.swapaxes(offsets[..., :-1, :], -1, -2)
        return cls(before @ offsets[..., :-1, :], np.swapaxes(before @ offsets[..., 1:, :], -1, -2))

    @property
    def regular(self):
        """G0 and G1 shrunk towards a uniform decay, so that a straight segment leaves nothing undetermined.

        As if further demonstrations came straight in along each axis with the segment's own `decay`, so the fit stays
        stable. (Shrinking A to zero instead would have every error beside the path undone in one step.)
        """
        size = np.maximum(np.trace(self.G0, axis1=-2, axis2=-1), NOTHING)
        d = self.G0.shape[-1]
        weight = (SHRINKAGE * size / d)[..., None, None] * np.eye(d)
        return self.G0 + weight, self.G1 + self.decay[..., None, None] * weight

    @property
    def decay(self):
        """The one number a that fits x[n+1] = a x[n] best, (...): a = tr G1 / tr G0, always between -1 and 1."""
        size = np.maximum(np.trace(self.G0, axis1=-2, axis2=-1), NOTHING)
        return np.trace(self.G1, axis1=-2, axis2=-1) / size

    @property
    def matrix(self):
        """A = G1 G0^-1 after shrinkage, (..., d, d): closed-form least squares, spectral radius below one."""
        G0, G1 = self.regular
        return np.swapaxes(np.linalg.solve(G0, np.swapaxes(G1, -1, -2)), -1, -2)


@dataclass(frozen=True)
class LDS:
    """A linear dynamical system that comes to rest at its subgoal, from anywhere.

    Attributes
    ----------
    A : (2, 2) float array
        Per step, spectral radius below one.
    goal : (2,) float array
        The subgoal, m.
    statistics : Statistics
        What A was computed from. Adding those of two segments gives the LDS that describes both, if both are re-timed
        or neither is.
    """

    A: np.ndarray
    goal: np.ndarray
    statistics: Statistics = field(repr=False)

    def __post_init__(self):
        radius = np.abs(np.linalg.eigvals(self.A)).max()
        if not radius < 1:
            raise ValueError(f"A must have a spectral radius below one, got {radius}")

    @classmethod
    def from_statistics(cls, statistics, goal):
        """The LDS with the given statistics (G0, G1) that ends at `goal` (2,), in m."""
        return cls(statistics.matrix, np.asarray(goal, float), statistics)

    @classmethod
    def fit(cls, trajectories, retimed=True):
        """Fit one LDS to one or several trajectories by least squares in closed form (Sec. III).

        Each trajectory is shifted by its own end, which makes the estimate stable whatever the data.

        Parameters
        ----------
        trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
            Positions in m.
        retimed : bool
            Fit to the re-timed curves (see `dollop.trajectory.retime`), every trajectory counting the same; or to the
            samples as they are, every sample counting the same and A being per sample.

        Returns
        -------
        LDS
            With its goal at the mean of the ends.

        Raises
        ------
        ValueError
            A trajectory of fewer than three points, without movement, or not finite.

        Examples
        --------
        >>> line = np.linspace([2.0, 1.0], [0.0, 0.0], 20)
        >>> lds = LDS.fit(line)
        >>> bool(abs(np.linalg.eigvals(lds.A)).max() < 1)
        True
        """
        walks = check_trajectories(trajectories)
        samples = [retime(walk, STEPS, DECAY) if retimed else walk for walk in walks]
        first, *others = map(Statistics.of, samples)
        goal = np.mean([walk[-1] for walk in walks], axis=0)
        return cls.from_statistics(sum(others, first), goal)

    def turned(self, angle):
        """The LDS turned about its subgoal by an angle in rad: A <- R A R^T."""
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        G0, G1 = self.statistics.G0, self.statistics.G1
        return replace(self, A=R @ self.A @ R.T, statistics=Statistics(R @ G0 @ R.T, R @ G1 @ R.T))

    def step(self, x):
        """The next state after x, (..., 2), in m: g + A (x - g)."""
        return self.goal + (np.asarray(x, float) - self.goal) @ self.A.T

    def response(self, x0, n):
        """The n steps after x0 (2,), in m: (n + 1, 2), x0 included."""
        return self.goal + powers_on(self.A, np.asarray(x0, float) - self.goal, n)

    def lyapunov(self, x):
        """(x - g)^T G0^-1 (x - g) for x (..., 2) in m: zero at the subgoal, and it never grows along a response."""
        offset = np.asarray(x, float) - self.goal
        return dot(offset, np.linalg.solve(self.statistics.regular[0], offset[..., None])[..., 0])


def powers_on(A, x, n):
    """A^0 x, A^1 x, ..., A^n x for stacked A (..., d, d) and x (..., d): (..., n + 1, d), by doubling."""
    states, step = x[..., None, :], np.swapaxes(A, -1, -2)
    while states.shape[-2] <= n:
        states = np.concatenate([states, states @ step], axis=-2)
        step = step @ step
    return states[..., : n + 1, :]


@dataclass(frozen=True)
class SequencedLDS:
    """A trajectory as a sequence of LDS, each handing over to the next at its subgoal (Sec. III).

    Attributes
    ----------
    segments : tuple of K LDS
        In order.
    start : (2,) float array
        Where the demonstrations start on average, m.
    speeds : (K,) float array
        Mean demonstrated speed along each segment, m/s.
    """

    segments: tuple
    start: np.ndarray
    speeds: np.ndarray

    @property
    def subgoals(self):
        """(K, 2) float array: where the segments end, m."""
        return np.array([segment.goal for segment in self.segments])

    @classmethod
    def fit(cls, trajectories, tolerance=0.02, n_segments=None, retimed=True, sample_period=0.1, candidates=100):
        """Divide one trajectory, or several walks of the same one, into segments with one LDS each (Sec. III).

        Several walks are aligned (`dollop.trajectory.align`); a subgoal is the mean of the places where they are cut,
        and an LDS is fitted to the statistics of all. The error of a segment is the mean distance from the walks' mean
        to the response of its LDS, started at the subgoal before. Dynamic programming finds, among all divisions at the
        candidate cuts, those with the fewest segments of which none has an error above the tolerance, and of these the
        one with the least total error.

        Parameters
        ----------
        trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
            Positions in m; several must start and end at corresponding places.
        tolerance : float
            Largest mean error of a segment in m.
        n_segments : int, optional
            Exactly so many segments with the least total error instead; the tolerance then plays no part.
        retimed : bool
            Whether to fit the re-timed curves or the samples as they are (see `LDS.fit`).
        sample_period : float
            Time between samples in s; only `speeds` depends on it.
        candidates : int
            Number of places, at equal distances, where the trajectory may be cut, both its ends included. The time
            taken grows with the cube.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            Trajectories as in `LDS.fit`, a parameter out of its range, or a tolerance that no division keeps.

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> len(law.segments), law.subgoals.round(6) + 0.0
        (1, array([[0., 1.]]))
        """
        check_search(tolerance, n_segments, sample_period, candidates)
        walks = check_trajectories(trajectories)
        aligned, shares = align(walks, 2 * candidates - 1)
        path, moments = aligned.mean(axis=0)[::2], cut_moments(walks, shares[:, ::2])
        statistics = retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)
        errors = segment_errors(path, statistics)
        cuts = fewest_segments(errors, tolerance) if n_segments is None else best_segments(errors, n_segments)
        spans = zip(cuts[:-1], np.diff(cuts), path[cuts[1:]], strict=True)
        segments = tuple(LDS.from_statistics(statistics(start, length), goal) for start, length, goal in spans)
        return cls(segments, path[0], demonstrated_speeds(walks, moments[:, cuts], sample_period))

    def response(self, start=None, reach=0.01):
        """Follow the segments, handing over to the next within reach of each subgoal.

        Since every LDS is stable, this happens after finitely many steps from any start. The next segment sets out
        from the place of the handing over.

        Parameters
        ----------
        start : (2,) array_like, optional
            m; by default the demonstrations' start.
        reach : float
            m, positive.

        Returns
        -------
        (M, 2) float array
            From start to within reach of the last subgoal, m.
        """
        state = np.asarray(self.start if start is None else start, float)
        if state.shape != (2,) or not np.isfinite(state).all():
            raise ValueError(f"start must be two finite numbers, got {start}")
        if not reach > 0:
            raise ValueError(f"reach must be positive, got {reach}")
        states = [state]
        for segment in self.segments:
            while np.linalg.norm(states[-1] - segment.goal) > reach:
                states.append(segment.step(states[-1]))
        return np.array(states)

    def error(self, trajectory):
        """Mean distance in m from the samples of a trajectory (N, 2) to the response."""
        return self.errors(trajectory)["mean"]

    def errors(self, trajectory):
        """Distances between the samples of a trajectory and the response.

        Parameters
        ----------
        trajectory : (N, 2) array_like
            m.

        Returns
        -------
        dict of float
            In m: "mean" and "max" from the samples to the nearest places on the response; "reverse" the mean from the
            response, sampled at equal distances, to the nearest places on the trajectory.
        """
        samples, response = check_trajectory(trajectory), self.response()
        there = distance_to_polyline(samples, response)
        back = distance_to_polyline(resample(response, len(samples)), samples)
        return {"mean": float(there.mean()), "max": float(there.max()), "reverse": float(back.mean())}

    def with_subgoals(self, subgoals, start=None, turned=False):
        """The same task with its subgoals moved; every LDS keeps its A, so the response adapts by itself.

        Parameters
        ----------
        subgoals : (K, 2) array_like
            m.
        start : (2,) array_like, optional
            Moved as well, m; by default the demonstrations' start stays.
        turned : bool
            Beyond the paper: turn every LDS as the line from the subgoal before to its own has turned.

        Returns
        -------
        SequencedLDS
        """
        goals = np.asarray(subgoals, float)
        if goals.shape != self.subgoals.shape or not np.isfinite(goals).all():
            raise ValueError(f"subgoals must be {len(self.segments)} finite positions, got {subgoals}")
        start = self.start if start is None else np.asarray(start, float)
        if start.shape != (2,) or not np.isfinite(start).all():
            raise ValueError(f"start must be two finite numbers, got {start}")
        segments = [replace(segment, goal=goal) for segment, goal in zip(self.segments, goals, strict=True)]
        if turned:
            turns = chord_angles(start, goals) - chord_angles(self.start, self.subgoals)
            segments = [segment.turned(turn) for segment, turn in zip(segments, turns, strict=True)]
        return replace(self, segments=tuple(segments), start=start)


def chord_angles(start, subgoals):
    """Direction in rad of the lines from each subgoal to the next, (K,), the first from the start."""
    chords = np.diff(np.vstack([start, subgoals]), axis=0)
    return np.arctan2(chords[:, 1], chords[:, 0])


def check_search(tolerance, n_segments, sample_period, candidates):
    """Raise ValueError for a parameter of `SequencedLDS.fit` that is out of its range."""
    if not tolerance > 0:
        raise ValueError(f"tolerance must be positive, got {tolerance}")
    if not 0 < sample_period < np.inf:
        raise ValueError(f"sample_period must be positive, got {sample_period}")
    if candidates < 3:
        raise ValueError(f"candidates must be at least 3, got {candidates}")
    most = (candidates - 1) // 2
    if n_segments is not None and (n_segments != int(n_segments) or not 1 <= n_segments <= most):
        raise ValueError(f"n_segments must be a whole number from 1 to {most} (half the candidates), got {n_segments}")


def cut_moments(walks, shares):
    """When each walk is at given shares (K, C) of its way: (K, C) fractional sample numbers."""
    walked = [arc_length(walk) for walk in walks]
    return np.array([np.interp(s * w[-1], w, np.arange(len(w))) for s, w in zip(shares, walked, strict=True)])


def demonstrated_speeds(walks, moments, sample_period):
    """Mean speed (S,) in m/s between fractional sample numbers (K, S + 1), over all walks."""
    walked = [np.interp(m, np.arange(len(w)), arc_length(w)) for m, w in zip(moments, walks, strict=True)]
    taken = np.maximum(np.diff(moments, axis=1).sum(axis=0), np.finfo(float).tiny)
    return np.diff(walked, axis=1).sum(axis=0) / (taken * sample_period)


def retimed_statistics(aligned):
    """The function (start, length) -> Statistics of re-timed segments, summed over the walks.

    `aligned` (K, 2 C - 1, d) has a sample at each of the C candidate cuts and one between; start (...) counts cuts, and
    all segments of one call have the same length, because then they also share the places at which they are sampled.
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
    """The function (start, length) -> Statistics of the samples as they are, from sums taken once along each walk.

    `moments` (K, C) are the fractional sample numbers of the candidate cuts; start counts cuts, as does length.
    """
    cuts = moments.round().astype(int)
    sums = [running_sums(walk - walk.mean(axis=0)) for walk in walks]

    def statistics(start, length):
        start = np.asarray(start)
        parts = [shifted_sums(s, cut[start], cut[start + length]) for s, cut in zip(sums, cuts, strict=True)]
        return sum(parts[1:], parts[0])

    return statistics


def running_sums(walk):
    """The walk (N, d) and the sums of p[n], p[n] p[n]^T and p[n+1] p[n]^T over the n before each sample."""
    now, after = walk[:-1], walk[1:]
    terms = now, now[:, :, None] * now[:, None], after[:, :, None] * now[:, None]
    return walk, *(np.concatenate([np.zeros((1, *term.shape[1:])), term.cumsum(axis=0)]) for term in terms)


def shifted_sums(sums, start, end):
    """Statistics of samples start to end (...) of a walk, shifted by the last: the products expanded."""
    walk, first, now, after = sums
    goal, count = walk[end], (end - start)[..., None, None]
    total = first[end] - first[start]
    later = total + walk[end] - walk[start]
    square = count * outer(goal, goal)
    G0 = now[end] - now[start] - outer(total, goal) - outer(goal, total) + square
    G1 = after[end] - after[start] - outer(later, goal) - outer(goal, total) + square
    moves = np.trace(G0, axis1=-2, axis2=-1) > 1e-10 * np.trace(now[-1])  # less is what rounding leaves of nothing
    return Statistics(np.where(moves[..., None, None], G0, 0), np.where(moves[..., None, None], G1, 0))


def outer(a, b):
    return a[..., :, None] * b[..., None, :]


def dot(a, b):
    return np.einsum("...d,...d->...", a, b)


def segment_errors(path, statistics):
    """Total distance in m from the path to the response of every possible segment.

    Parameters
    ----------
    path : (C, d) float array
        The walks' mean at the candidate cuts.
    statistics : callable
        (start, length) -> Statistics.

    Returns
    -------
    (C, C) float array
        [i, j] for the segment from cut i to cut j, summed over the cuts between; `inf` where there is none between,
        since such a segment would not be put to any test.
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

    Slow systems are shown by every m-th state, m such that the responses settle within the horizon.
    """
    decay = np.clip(np.median(statistics.decay), 0.5, 1 - 1e-6)
    stride = max(1, int(-SETTLED / (HORIZON * np.log(decay))))
    states = powers_on(np.linalg.matrix_power(statistics.matrix, stride), x0, HORIZON)
    return np.concatenate([states, np.zeros_like(states[:, :1])], axis=1)


def distances(points, polylines):
    """Distances (B, T) of points (B, T, d) to polylines (B, V, d), to the two edges beside the nearest vertex.

    That is what makes the search fast. Where a polyline comes closest between two vertices that are both farther away
    than a third one, the distance is slightly too large, never too small.
    """
    count, d = polylines.shape[1:]
    vertices = polylines.astype(np.float32)  # only to choose the nearest: |v|^2 - 2 v p
    weights = np.concatenate([-2 * vertices, dot(vertices, vertices)[..., None]], axis=2)
    lifted = np.ones((*points.shape[:2], d + 1), np.float32)
    lifted[..., :d] = points
    closest = (lifted @ np.ascontiguousarray(np.swapaxes(weights, 1, 2))).argmin(axis=2)
    flat, row = polylines.reshape(-1, d), count * np.arange(len(points))[:, None]
    edges = np.maximum(closest - 1, 0), np.minimum(closest, count - 2)
    return np.minimum(*(distance_to_edge(points, *flat.take([row + e, row + e + 1], axis=0)) for e in edges))


def distance_to_edge(points, tail, head):
    """Distance (...) of points to the edges from tail to head, all (..., d)."""
    offset, along = points - tail, head - tail
    share = np.clip(dot(offset, along) / np.maximum(dot(along, along), NOTHING), 0, 1)
    offset -= share[..., None] * along
    return np.sqrt(dot(offset, offset))


def fewest_segments(errors, tolerance):
    """Cuts of the division with the fewest segments of mean error within tolerance, then the least total error.

    Parameters
    ----------
    errors : (C, C) float array
        From `segment_errors`, m.
    tolerance : float
        m.

    Returns
    -------
    (K + 1,) int array
        The cuts, the first 0 and the last C - 1.

    Raises
    ------
    ValueError
        No division keeps the tolerance; the message says which it could keep.
    """
    count = len(errors)
    mean = errors / np.maximum(np.arange(count) - np.arange(count)[:, None], 1)
    kept = np.where(mean <= tolerance, errors, np.inf)
    cuts = divide(kept, lambda total, k: np.isfinite(total))
    if cuts is None:
        raise ValueError(
            f"tolerance {tolerance} m cannot be kept with {count} candidate cuts, {least_tolerance(mean):.3g} m can; "
            "a larger tolerance or more candidates would do"
        )
    return cuts


def best_segments(errors, n_segments):
    """Cuts (K + 1,) of the division into n_segments with the least total error; errors as in `fewest_segments`."""
    return divide(errors, lambda total, k: k == n_segments)


def divide(errors, enough):
    """Dynamic programming over D[k][j] = min_i D[k-1][i] + errors[i][j], until enough(D[k][-1], k); None if never."""
    total = np.where(np.arange(len(errors)) == 0, 0.0, np.inf)
    before = []
    for k in range(1, len(errors)):
        sums = total[:, None] + errors
        before.append(sums.argmin(axis=0))
        total = sums.min(axis=0)
        if enough(total[-1], k):
            return trace_back(before)
    return None


def trace_back(before):
    """The cuts (K + 1,) from the last one back, before[k][j] being the cut before cut j."""
    cuts = [len(before[0]) - 1]
    for choice in reversed(before):
        cuts.append(choice[cuts[-1]])
    return np.array(cuts[::-1])


def least_tolerance(mean):
    """The least tolerance that some division keeps, for mean errors (C, C)."""
    worst = np.zeros(len(mean))
    for j in range(1, len(mean)):
        worst[j] = np.maximum(worst[:j], mean[:j, j]).min()
    return worst[-1]
