"""Trajectories as curves: arc length, re-timing, laps, their mean, and distances between curves (used by Sec. III).

A trajectory is an (N, d) array of positions in m in the order they were visited; d is 2 in the plane.
"""

import numpy as np

REPEATS = 1 / 3  # a track repeats itself if a lap later it is this much closer to itself than two random places are
LAP_SPREAD = 0.15  # share by which one lap may be shorter or longer than the typical one
BESIDE = 0.05  # a track is on its laps once it has run this share of a lap within a gate's width of the next lap
GATE_WIDTH = 4.0  # half the width of the gate, as a multiple of the median distance between one lap and the next
GATE_SLACK = 0.02  # share of a lap over which a direction is taken, and that a last lap may lack
STRAIGHT = 0.5  # a gate needs a direction: distance made good, as a share of the way walked there


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

    Raises
    ------
    ValueError
        Fewer than three points, not planar, not finite, or no movement.
    """
    points = np.asarray(trajectory, float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{name} must have shape (N, 2), got {points.shape}")
    if len(points) < 3:
        raise ValueError(f"{name} must have at least three points, got {len(points)}")
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise ValueError(f"{name} must be finite, got {points[row]} at sample {row}")
    if not (points != points[0]).any():
        raise ValueError(f"{name} must move, got {len(points)} times the position {points[0]}")
    return points


def check_trajectories(trajectories):
    """One trajectory or several, as a list of checked arrays.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
        Positions in m.

    Returns
    -------
    list of (N_k, 2) float arrays

    Raises
    ------
    ValueError
        None given, or one of them is no trajectory (see `check_trajectory`).
    """
    if len(trajectories) == 0:
        raise ValueError("trajectories must hold at least one trajectory, got none")
    if np.ndim(trajectories[0]) == 1:
        return [check_trajectory(trajectories)]
    return [check_trajectory(each, f"trajectory {k}") for k, each in enumerate(trajectories)]


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

    Examples
    --------
    >>> arc_length([[0, 0], [3, 4], [3, 5]])
    array([0., 5., 6.])
    """
    steps = np.linalg.norm(np.diff(np.asarray(points, float), axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def at_arc_length(points, distance):
    """Positions after walking given distances along a trajectory.

    Parameters
    ----------
    points : (N, d) float array
        Positions in m.
    distance : (M,) array_like
        Arc lengths in m.

    Returns
    -------
    (M, d) float array
        Linear between the points, held at both ends.
    """
    walked = arc_length(points)
    moved = np.concatenate([[True], np.diff(walked) > 0])
    columns = (np.interp(distance, walked[moved], column[moved]) for column in np.asarray(points, float).T)
    return np.stack(list(columns), axis=1)


def resample(points, n):
    """The same curve by `n` points at equal distances along it.

    Parameters
    ----------
    points : (N, d) float array
        Positions in m.
    n : int
        At least two.

    Returns
    -------
    (n, d) float array
        First and last are the curve's own.

    Examples
    --------
    >>> resample(np.array([[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]]), 3)[:, 0]
    array([0., 2., 4.])
    """
    return at_arc_length(points, np.linspace(0, arc_length(points)[-1], n))


def remaining_share(n, decay):
    """Share of the way still to go at each of the n + 1 samples of a re-timed segment: geometric, and 0 at the last."""
    return np.append(np.exp(-decay * np.arange(n) / n), 0.0)


def retime(points, n=60, decay=3.0):
    r"""The same curve, walked so that the remaining way decays geometrically.

    A user walks through a subgoal at speed; a linear system that has its equilibrium there can only slow down into it.
    Sample j of the re-timed curve lies where the arc length

    .. math:: r_j = L e^{-c j / n}, \quad j < n, \qquad r_n = 0

    remains, so that the curve keeps its shape and takes the one timing that a linear system can follow.

    Parameters
    ----------
    points : (N, d) float array
        Positions in m.
    n : int
        Number of steps.
    decay : float
        c, the number of time constants over the curve.

    Returns
    -------
    (n + 1, d) float array
        The first and last are the curve's own.
    """
    length = arc_length(points)[-1]
    return at_arc_length(points, length * (1 - remaining_share(n, decay)))


def distance_to_polyline(points, polyline):
    """Distance of each point to the nearest place on a polyline, its edges included.

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

    Examples
    --------
    >>> distance_to_polyline([[1.0, 2.0], [5.0, 0.0]], [[0.0, 0.0], [2.0, 0.0]])
    array([2., 3.])
    """
    points, polyline = np.asarray(points, float), np.asarray(polyline, float)
    edges = np.diff(polyline, axis=0) if len(polyline) > 1 else np.zeros_like(polyline)
    starts = polyline[: len(edges)]
    squared = np.maximum((edges**2).sum(axis=1), np.finfo(float).tiny)
    offsets = points[:, None] - starts
    along = np.clip((offsets * edges).sum(axis=2) / squared, 0, 1)
    return np.sqrt(((offsets - along[..., None] * edges) ** 2).sum(axis=2).min(axis=1))


def align(trajectories, n=200, rounds=3):
    """Several walks along one curve, sampled where they belong together.

    Equal shares of arc length drift apart where one walk swings wider than another. So each walk is laid onto the mean
    of all by the monotone warp with the least squared distance (a shortest path), and the mean is taken anew.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
        Positions in m; all start and end at corresponding places.
    n : int
        Number of samples.
    rounds : int
        How often the walks are laid onto their mean; 0 keeps equal shares of arc length.

    Returns
    -------
    aligned : (K, n, 2) float array
        Sample i of every walk belongs to sample i of every other.
    share : (K, n) float array
        The share of each walk's arc length at which it was sampled, rising from 0 to 1.
    """
    walks = check_trajectories(trajectories)
    share = np.tile(np.linspace(0, 1, n), (len(walks), 1))
    aligned = np.stack([resample(walk, n) for walk in walks])
    fine = np.stack([resample(walk, 2 * n - 1) for walk in walks]) if len(walks) > 1 else None
    for _ in range(rounds if len(walks) > 1 else 0):
        share = monotone_warp(resample(aligned.mean(axis=0), n), fine)
        aligned = np.stack([at_arc_length(w, s * arc_length(w)[-1]) for w, s in zip(walks, share, strict=True)])
    return aligned, share


def monotone_warp(reference, walks, slip=1.0):
    """Lay walks monotonically onto a reference, both sampled at equal distances.

    Parameters
    ----------
    reference : (n, d) float array
        m.
    walks : (K, 2 n - 1, d) float array
        m, sampled twice as finely, so that a walk may lag or lead by half steps, at most twice as fast.
    slip : float
        Weight of the squared slip along the path per step beside the squared distance.

    Returns
    -------
    (K, n) float array
        For each reference sample the share of the walk, rising from 0 to 1.
    """
    n, fine = len(reference), walks.shape[1]
    step = np.linalg.norm(np.diff(walks, axis=1), axis=2).mean(axis=1)
    penalty = slip * (step[:, None] * (np.arange(5) - 2)) ** 2  # five moves: 0 to 4 fine steps
    best = np.full((len(walks), fine + 4), np.inf)
    best[:, 4] = 0.0
    moves = np.empty((n, len(walks), fine), int)
    for i in range(1, n):
        reach = np.stack([best[:, 4 - move : 4 - move + fine] + penalty[:, move, None] for move in range(5)])
        moves[i] = reach.argmin(axis=0)
        best[:, 4:] = reach.min(axis=0) + ((walks - reference[i]) ** 2).sum(axis=2)
    at = np.full((len(walks), n), fine - 1)
    for i in range(n - 1, 0, -1):
        at[:, i - 1] = at[:, i] - moves[i, np.arange(len(walks)), at[:, i]]
    return at / (fine - 1)


def mean_trajectory(trajectories, n=200, rounds=3):
    """The mean of several walks along one curve.

    Parameters
    ----------
    trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
        Positions in m; all start and end at corresponding places.
    n, rounds : int
        As in `align`.

    Returns
    -------
    (n, 2) float array
        m, at equal distances.
    """
    return resample(align(trajectories, n, rounds)[0].mean(axis=0), n)


def lap_lag(track):
    """After how many samples a track repeats itself, 0 if it does not.

    The median distance between places that lie a lag apart along the track drops when the lag is one lap. The crossing
    of a figure-eight does not make it drop: half a lap later hardly any other place is met again.

    Parameters
    ----------
    track : (n, d) float array
        m, at equal distances.

    Returns
    -------
    int
        At most two thirds of n: less than half a lap walked twice is no repetition.
    """
    lags = np.arange(1, 2 * len(track) // 3)
    apart = np.array([np.median(np.linalg.norm(track[lag:] - track[:-lag], axis=1)) for lag in lags])
    typical = np.sqrt(2 * track.var(axis=0).sum())  # rms distance of two places picked at random
    met = np.maximum.accumulate(apart > typical / 2) & (apart < REPEATS * typical)
    if not met.any():
        return 0
    first = np.argmax(met)
    return int(lags[first + np.argmin(apart[first : first + np.argmin(np.append(met[first:], False))])])


def distance_to_next_lap(track, lag):
    """Distance in m of each place on a track (n, d) to the nearest about lag samples later; as many as there are."""
    slack = int(LAP_SPREAD * lag)
    here = track[: len(track) - lag - slack]
    later = (track[lag + shift :][: len(here)] for shift in range(-slack, slack + 1))
    return np.min([np.linalg.norm(there - here, axis=1) for there in later], axis=0)


def first_run(beside, run):
    """Index at which the first unbroken run of True begins, 0 if there is none so long."""
    return int(np.argmax(np.convolve(beside, np.ones(run), "valid") > run - 0.5))


def laps(t, positions):
    """Cut the laps out of one continuously walked track.

    The length of a lap comes from where the track repeats itself (`lap_lag`). Ways to and from the laps, which run
    beside no other lap, are dropped. The gate is a line across the track; a lap begins where the track crosses it in
    the gate's direction, about one lap after the last time, so that the second visit to a figure-eight's crossing opens
    no lap. Of all gates on the first lap the one with the most laps is taken, and among those the one that is passed
    most narrowly. What is left at head and tail is dropped.

    Parameters
    ----------
    t : (N,) array_like
        Time of each sample in s, increasing.
    positions : (N, 2) array_like
        m.

    Returns
    -------
    list of (N_k, 2) float arrays
        The laps in order, all sampled at the track's median period; the whole track if it does not repeat itself.

    Raises
    ------
    ValueError
        A clock that does not increase, or no trajectory (see `check_trajectory`).

    Examples
    --------
    >>> angle = np.linspace(0, 3.5 * 2 * np.pi, 701)
    >>> [len(lap) for lap in laps(angle, np.stack([np.cos(angle), np.sin(angle)], axis=1))]
    [202, 201, 201]
    """
    t, points = np.asarray(t, float), check_trajectory(positions, "positions")
    if t.shape != (len(points),) or not (np.diff(t) > 0).all():
        raise ValueError(f"t must increase and hold one time per position, got shape {t.shape} for {len(points)}")
    period = np.median(np.diff(t))
    even = t[0] + period * np.arange(int((t[-1] - t[0]) / period + 1.5))
    points = np.stack([np.interp(even, t, column) for column in points.T], axis=1)
    cuts = lap_cuts(points)
    return [points[start : end + 1] for start, end in zip(cuts[:-1], cuts[1:], strict=True)]


def lap_cuts(points):
    """Samples of a track (N, 2) at which the laps begin, and the one at which the last ends; see `laps`."""
    walked, n = arc_length(points), min(max(len(points), 100), 1000)
    track, step = resample(points, n), walked[-1] / (n - 1)
    lag = lap_lag(track)
    if not lag:
        return [0, len(points) - 1]
    later, earlier = distance_to_next_lap(track, lag), distance_to_next_lap(track[::-1], lag)
    width = max(GATE_WIDTH * np.median(later), GATE_SLACK * lag * step)
    run = max(1, int(BESIDE * lag))
    ends = first_run(later <= width, run), n - 1 - first_run(earlier <= width, run)
    first, last = np.searchsorted(walked, np.array(ends) * step)
    return [first + cut for cut in best_cuts(points[first : last + 1], lag * step, width)]


def best_cuts(points, lap, width):
    """The gate crossings of the gate with the most laps, among those of the one that is passed most narrowly."""
    walked, end = arc_length(points), len(points) - 1
    best, best_rank = [0, end], (2, -np.inf)
    for gate in np.flatnonzero(walked < lap):
        found = gate_crossings(points, walked, gate, lap, width)
        if (1 - GATE_SLACK) * lap <= walked[-1] - walked[found[-1]] < lap:
            found = [*found, end]
        rank = len(found), -np.linalg.norm(points[found] - points[gate], axis=1).max()
        best, best_rank = (found, rank) if rank >= best_rank else (best, best_rank)
    return best


def gate_crossings(points, walked, gate, lap, width):
    """Samples at which a track passes a gate line, once per lap and in the right direction.

    Parameters
    ----------
    points : (N, 2) float array
        The track in m.
    walked : (N,) float array
        Its arc length in m.
    gate : int
        The line runs through this sample, across the track there.
    lap : float
        Length of a lap in m.
    width : float
        How far from that sample the line still counts, m.

    Returns
    -------
    list of int
        Starting with `gate`; alone if the track is not straight enough there to have a direction.
    """
    first, last = np.searchsorted(walked, [walked[gate] - GATE_SLACK * lap, walked[gate] + GATE_SLACK * lap])
    last = min(last, len(points) - 1)
    heading = points[last] - points[first]
    if np.linalg.norm(heading) <= STRAIGHT * (walked[last] - walked[first]):
        return [gate]
    ahead = (points - points[gate]) @ heading
    aside = np.linalg.norm(points - points[gate], axis=1)
    crossing = np.flatnonzero((ahead[:-1] < 0) & (ahead[1:] >= 0) & (aside[1:] <= width)) + 1
    found = [gate]
    while True:
        due = crossing[np.abs(walked[crossing] - walked[found[-1]] - lap) < LAP_SPREAD * lap]
        if not len(due):
            return found
        found.append(int(due[np.argmin(aside[due])]))
