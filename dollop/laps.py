"""The laps of a trajectory that repeats itself, such as the five figure-eights of Fig. 6.

The paper shows one control law for five laps, and does not say how they were cut: this is a
reconstruction.
"""

import numpy as np
import scipy

from dollop.trajectory import arc_length, check_trajectory, resample

__all__ = ["laps"]

# A track repeats itself if a lap later it is this much closer to itself than two random places are.
REPEATS = 1 / 3
LAP_SPREAD = 0.15  # share by which one lap may be shorter or longer than the typical one
# A track is on its laps once it has run this share of a lap within a gate's width of the next lap.
BESIDE = 0.05
GATE_WIDTH = 4.0  # half the gate's width, in median distances between one lap and the next
GATE_SLACK = 0.02  # share of a lap over which a direction is taken, and that a last lap may lack
STRAIGHT = 0.5  # a gate needs a direction: distance made good, as a share of the way walked there

MOST_LOST = 100  # how many times as long as its samples a track may last: else it is the clock that jumped


def lap_lag(track):
    """After how many samples a track repeats itself, 0 if it does not.

    The median distance between places that lie a lag apart along the track drops when the lag is
    one lap. The crossing of a figure-eight does not make it drop: half a lap later hardly any other
    place is met again.

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
    gaps = (np.linalg.norm(track[lag:] - track[:-lag], axis=1) for lag in lags)
    apart = np.array([np.median(gap) for gap in gaps])
    typical = np.sqrt(2 * track.var(axis=0).sum())  # rms distance of two places picked at random
    met = np.maximum.accumulate(apart > typical / 2) & (apart < REPEATS * typical)
    dips, count = scipy.ndimage.label(met)
    return int(lags[np.where(dips == 1, apart, np.inf).argmin()]) if count else 0


def distance_to_next_lap(track, lag):
    """Distance (M,) in m of each place on a track (n, d) to the nearest about lag samples later.

    As many as there are.
    """
    slack = int(LAP_SPREAD * lag)
    here = track[: len(track) - lag - slack]
    later = (track[lag + shift :][: len(here)] for shift in range(-slack, slack + 1))
    return np.min([np.linalg.norm(there - here, axis=1) for there in later], axis=0)


def first_run(beside, run):
    """Index at which the first unbroken run of True begins, 0 if there is none so long."""
    return int(np.argmax(np.convolve(beside, np.ones(run), "valid") > run - 0.5))


def laps(t, positions):
    """Cut the laps out of one continuously walked track (a reconstruction, see the module).

    The length of a lap comes from where the track repeats itself. Ways to and from the laps, which
    run beside no other lap, are dropped. The gate is a line across the track; a lap begins where
    the track crosses it in the gate's direction, about one lap after the last time, so that the
    second visit to a figure-eight's crossing opens no lap. Of all gates on the first lap the one
    with the most laps is taken, and among those the one that is passed most narrowly. What is left
    at head and tail is dropped.

    Parameters
    ----------
    t : (N,) array_like
        Time of each sample in s, increasing.
    positions : (N, 2) array_like
        m.

    Returns
    -------
    list of (N_k, 2) float arrays
        The laps in order, in m, all sampled at the track's median period; the whole track if it
        does not repeat itself.

    Raises
    ------
    ValueError
        A clock that does not increase, or jumps by far, or no trajectory (see `check_trajectory`).

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
    if np.ptp(t) > MOST_LOST * len(t) * period:
        text = f"t must not jump, got {np.ptp(t):g} s for {len(t)} positions"
        raise ValueError(f"{text}, most of them {period:.3g} s apart")
    even = t[0] + period * np.arange(int((t[-1] - t[0]) / period + 1.5))
    points = np.stack([np.interp(even, t, column) for column in points.T], axis=1)
    cuts = lap_cuts(points)
    return [points[start : end + 1] for start, end in zip(cuts[:-1], cuts[1:], strict=True)]


def lap_cuts(points):
    """Samples of a track (N, 2) at which laps begin, and where the last ends (see `laps`)."""
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
    """Crossings of the gate with the most laps, among those of the most narrowly passed."""
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
    slack = GATE_SLACK * lap
    # The last sample stands for all that is beyond: hence all but it.
    first, last = np.searchsorted(walked[:-1], walked[gate] + [-slack, slack])
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
