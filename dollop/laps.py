"""The laps of a trajectory that repeats itself, such as the five figure-eights of Fig. 6.

The paper shows one control law for five laps, and does not say how they were cut: this is a
reconstruction. Time and memory grow about linearly with the number of samples.
"""

from dataclasses import dataclass
from itertools import islice, pairwise
from math import hypot

import numpy as np
import scipy

from dollop.checks import LATEST, Note, checked_array
from dollop.law.timing import Stands, apart_within
from dollop.trajectory import arc_length, check_trajectory, resample

__all__ = ["Cut", "cut_laps", "laps"]

DROPPED = 0.1
"""A demonstration says so where more than this share of the way is dropped for its laps."""

# ---- the way: jitter and standing are no way
JITTERS = 6.0  # standard deviations of jitter: who comes so far has moved
FINEST, COARSEST = 1 / 100, 1 / 10  # bounds of that distance, in sizes of the track
PATCHY = 10, 100_000  # so many times as many samples may fill gaps of the clock, or so many in all
# ---- where a track repeats itself
REPEATS = 1 / 3  # a lap later it is this much closer to itself than two random places are
LAP_POINTS = 200  # so many describe a lap, if the track has as many
PLACES = 1000  # and so many places of the track tell how far apart it is from itself
GOLDEN = (5**0.5 - 1) / 2  # whose multiples fall evenly and never in step
FEWEST = 20  # of them that must meet again
LAG_RATIO = 1.005  # of one lag looked at to the next
TRIALS = 6  # dips of the distance that are tried
# ---- where a lap begins
LAP_SPREAD = 0.15  # share by which one lap may be shorter or longer than the typical one
# A track is on its laps once it has run this share of a lap within a gate's width of the next lap.
BESIDE = 0.05
GATES = 250  # tried on a lap
GATE_WIDTH = 4.0  # half the gate's width, in median distances between one lap and the next
GATE_SLACK = 0.02  # share of a lap over which a direction is taken, and that a last lap may lack
STRAIGHT = 0.5  # a gate needs a direction: distance made good, as a share of the way walked there
# ---- what is no lap
LEAST = 0.6  # share of the way that laps must make up
ALIKE = 0.12  # two laps of one task lie apart by less than this share of their size, on average,
MOSTLY, APART = 0.95, 0.25  # and at this share of their places by less than that one


@dataclass(frozen=True, eq=False)
class Cut:
    """A walk cut into laps, and what was dropped for it (beyond the paper).

    Attributes
    ----------
    laps : list of K (N_k, 2) float arrays
        In m; the whole walk alone if it was not cut.
    times : (K + 1,) float array
        When each lap begins, and when the last ends, in s.
    way : float
        How far was walked in all, in m; jitter and standing do not count.
    before, after : float
        How much of it was dropped before the first lap and after the last, in m.
    doubt : str
        Why a walk that seems to repeat itself was kept whole all the same; empty otherwise.
    stood : float
        How long on the mean somebody stood between two laps, s: at their ends, and not on the way.
    """

    laps: list
    times: np.ndarray
    way: float
    before: float = 0.0
    after: float = 0.0
    doubt: str = ""
    stood: float = 0.0

    def __repr__(self):
        return f"Cut of {self.way:.1f} m into {len(self.laps)} laps, {self.dropped:.0%} dropped"

    @property
    def dropped(self):
        """Share of the way that is in no lap, 0 to 1."""
        return (self.before + self.after) / self.way

    @property
    def notes(self):
        """What somebody who uses the laps must know, a tuple of `Note`; on good input none."""
        told = []
        if self.dropped > DROPPED:
            where = f"{self.before:.1f} m before and {self.after:.1f} m after {len(self.laps)} laps"
            text = f"{self.dropped:.0%} of the {self.way:.1f} m walked are dropped: {where}"
            told.append(Note("laps", f"{text}; more than {DROPPED:.0%} is worth a look"))
        elif self.doubt:
            told.append(Note("laps", f"the walk is kept whole: {self.doubt}", False))
        if self.stood:
            text = f"between two laps somebody stands for {self.stood:.1f} s on the mean"
            told.append(Note("laps", f"{text}: laps begin and end there, it is no pause on the way", False))
        return tuple(told)


def laps(t, positions):
    """Cut the laps out of one continuously walked track (a reconstruction, see the module).

    See `cut_laps`, which also tells what was dropped.

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
        holds less than two laps.

    Raises
    ------
    ValueError
        As `cut_laps`.

    Examples
    --------
    >>> angle = np.linspace(0, 3.5 * 2 * np.pi, 701)
    >>> [len(lap) for lap in laps(angle, np.stack([np.cos(angle), np.sin(angle)], axis=1))]
    [202, 201, 201]
    """
    return cut_laps(t, positions).laps


def cut_laps(t, positions):
    """Cut the laps out of one continuously walked track, and tell what was dropped.

    The length of a lap comes from where the track repeats itself. Ways to and from the laps, which
    run beside no other lap, are dropped. The gate is a line across the track; a lap begins where
    the track crosses it in the gate's direction, about one lap after the last time, so that the
    second visit to a figure-eight's crossing opens no lap. Of all gates on the first lap the one
    with the most laps is taken, among those one where nobody pauses, so that a pause is within the
    laps, and among those the one that is passed most narrowly. What is left at head and tail is
    dropped, and told.

    A walk is kept whole unless at least two full laps of one task are most of the way (60 %): one lap
    and a half show nothing twice from end to end, and who walked them may mean just that. Laps
    that lie apart are no laps: two tasks, one after the other, or the turns of a spiral.

    Parameters
    ----------
    t : (N,) array_like
        Time of each sample in s, increasing.
    positions : (N, 2) array_like
        m; every sample may jitter.

    Returns
    -------
    Cut

    Raises
    ------
    ValueError
        A clock that does not increase, or pauses for so long that gaps are most of the walk; or no
        trajectory (see `check_trajectory`).

    Examples
    --------
    Of two laps and a half, one fifth is dropped; one and a half are kept.

    >>> angle = np.linspace(0, 2 * np.pi, 100)
    >>> found = [cut_laps(t, np.stack([np.cos(t), np.sin(t)], axis=1)) for t in (2.5 * angle, 1.5 * angle)]
    >>> [(len(cut.laps), round(cut.dropped, 1)) for cut in found]
    [(2, 0.2), (1, 0.0)]
    """
    t, points = even_clock(t, check_trajectory(positions, "positions"))
    stands, walked = Stands.of(points, t[1] - t[0], "inner"), way(points)[0]
    at = walked[np.searchsorted(stands.number, stands.rows)]
    cuts, doubt = lap_cuts(points, at)
    stood = between(walked[cuts], at, stands.seconds)
    parts = [points[start : end + 1] for start, end in pairwise(cuts)]
    before, after = walked[cuts[0]], walked[-1] - walked[cuts[-1]]
    return Cut(parts, t[cuts], float(walked[-1]), float(before), float(after), doubt, stood)


def even_clock(t, points):
    """Times (M,) at the median period of a track, and its positions (M, 2) there."""
    t = checked_array("t, one time for each position,", t, len(points), least=-LATEST, most=LATEST)
    falls = np.flatnonzero(np.diff(t) <= 0)
    if len(falls):
        raise ValueError(f"t must increase, got {t[falls[0]]} and then {t[falls[0] + 1]}")
    period = np.median(np.diff(t))
    ticks = (t[-1] - t[0]) / period
    if ticks > max(PATCHY[0] * len(t), PATCHY[1]):
        lasts = f"{t[-1] - t[0]:g} s at a period of {period:g} s"
        raise ValueError(f"t must not consist of gaps, got {len(t)} times for {lasts}")
    even = t[0] + period * np.arange(int(ticks + 1.5))
    return even, np.stack([np.interp(even, t, column) for column in points.T], axis=1)


def size(points):
    """Root mean square distance in m of two places picked at random on a track (N, d)."""
    return np.sqrt(2 * points.var(axis=0).sum())


def way(points):
    """How far was walked, without jitter and standing.

    Parameters
    ----------
    points : (N, 2) float array
        At equal times, m.

    Returns
    -------
    walked : (N,) float array
        m, never decreasing.
    vertices : (M,) int array
        The samples between which that is the straight distance: each the first that is clearly
        elsewhere than the one before.
    """
    # Noise of standard deviation s has second differences of median length sqrt(6 ln 4) s.
    bends = np.linalg.norm(np.diff(points, 2, axis=0), axis=1)
    jitter = np.median(bends) / np.sqrt(6 * np.log(4))
    moved = np.clip(JITTERS * jitter, FINEST * size(points), COARSEST * size(points))
    vertices, (x, y) = [0], points[0]
    for i, (u, v) in enumerate(points.tolist()):
        if hypot(u - x, v - y) >= moved:
            vertices.append(i)
            x, y = u, v
    walked = np.interp(np.arange(len(points)), vertices, arc_length(points[vertices]))
    return walked, np.array(vertices)


def between(begins, at, seconds):
    """How long on the mean in s somebody stood where laps begin, but for the first and the last place.

    After so many m laps begin and the last ends (K + 1,), and after so many somebody stood (P,), for so many s.
    """
    inner = begins[1:-1, None]
    if not inner.size:
        return 0.0
    near = np.abs(at - inner) <= apart_within(np.diff(begins).mean())
    return float((near * seconds).sum() / len(inner))


def lap_cuts(points, stood=()):
    """Samples of a track (N, 2) at which laps begin and the last ends, and why there are none.

    Where somebody `stood`, after so many m (P,), is no good place to cut.
    """
    walked, vertices = way(points)
    corners = points[np.append(vertices, len(points) - 1)]
    n = max(len(points), 100)
    track, step, doubt = resample(corners, n), walked[-1] / (n - 1), ""
    for lag in islice(lap_lags(track), TRIALS):
        cuts = cuts_at(points, walked, corners, lag * step, stood)
        fault, after = (
            why_too_few(walked, cuts),
            f"it seems to repeat itself after {lag * step:.1f} m",
        )
        if not fault:
            unlike = why_unlike(points, walked, cuts)
            return ([0, len(points) - 1], f"{after}, but {unlike}") if unlike else (cuts, "")
        doubt = doubt or f"{after}, but {fault}"
    return [0, len(points) - 1], doubt


def lap_lags(track):
    """After how many samples a track seems to repeat itself, the shortest first.

    The distance between places that lie a lag apart along the track drops when the lag is one lap,
    for one lap at least. The crossing of a figure-eight does not make it drop: half a lap later
    hardly any other place is met again.

    Parameters
    ----------
    track : (n, d) float array
        m, at equal distances.

    Returns
    -------
    list of int
        At most two thirds of n: less than half a lap walked twice is no repetition.
    """
    most = 2 * len(track) // 3
    lags = np.unique(np.geomspace(1, most, int(np.log(most) / np.log(LAG_RATIO))).astype(int))
    apart = np.array([distances_apart(track, lag) for lag in lags])
    typical = size(track)
    met = np.maximum.accumulate(apart[:, 0] > typical / 2) & (apart[:, 1] < REPEATS * typical)
    dips, count = scipy.ndimage.label(met)
    return [int(lags[np.where(dips == dip, apart[:, 1], np.inf).argmin()]) for dip in range(1, count + 1)]


def distances_apart(track, lag):
    """Median distance in m between places a lag apart, and the least mean of it over one lag."""
    stride = max(1, len(track) // PLACES)
    # One place of each stride, never at the same point of it: strides may be in step with the laps.
    strides = np.arange((len(track) - lag) // stride)
    places = stride * strides + (stride * (GOLDEN * strides % 1)).astype(int)
    gaps = np.linalg.norm(track[places + lag] - track[places], axis=1)
    # Few places may meet by chance: of a long walk that makes the window longer than one lag.
    window = min(len(gaps), max(lag // stride, 1 if stride == 1 else FEWEST))
    sums = np.cumsum(np.append(0, gaps))
    return np.median(gaps), (sums[window:] - sums[:-window]).min() / window


def cuts_at(points, walked, corners, lap, stood=()):
    """Samples at which laps of about a known length in m begin, and where the last ends.

    Somebody `stood` after so many m (P,).
    """
    n = int(np.ceil(min(max(len(points), 100), LAP_POINTS * walked[-1] / lap)))
    track, step = resample(corners, n), walked[-1] / (n - 1)
    lag = max(1, round(lap / step))
    later, earlier = distance_to_next_lap(track, lag), distance_to_next_lap(track[::-1], lag)
    width = max(GATE_WIDTH * np.median(later), GATE_SLACK * lap)
    run = max(1, int(BESIDE * lag))
    ends = first_run(later <= width, run), n - 1 - first_run(earlier <= width, run)
    first, last = np.searchsorted(walked, np.array(ends) * step)
    last = len(points) - 1 if ends[1] == n - 1 else last  # who stands at the end is still there
    cuts = best_cuts(points[first : last + 1], walked[first : last + 1], lap, width, stood)
    return [int(first + cut) for cut in cuts]


def distance_to_next_lap(track, lag):
    """Distance (M,) in m of each place on a track (n, d) to the nearest about lag samples later.

    As many as there are.
    """
    slack = int(LAP_SPREAD * lag)
    here = track[: max(1, len(track) - lag - slack)]
    nearest = np.full(len(here), np.inf)
    for shift in range(-slack, slack + 1):
        there = track[lag + shift :][: len(here)]
        nearest = np.minimum(nearest, np.linalg.norm(there - here, axis=1))
    return nearest


def first_run(beside, run):
    """Index at which the first unbroken run of True begins, 0 if there is none so long."""
    return int(np.argmax(np.convolve(beside, np.ones(run), "valid") > run - 0.5))


def best_cuts(points, walked, lap, width, stood=()):
    """Crossings of the gate with the most laps, among those of the most narrowly passed.

    Where somebody `stood` after so many m (P,) is no gate if there is another with as many laps.

    A walk that ends a little before the gate has a last lap as well: if it is as long as others, or,
    rather than none, if it ends near the gate.
    """
    stood, apart = np.asarray(stood) - walked[0], apart_within(lap)
    end, walked = len(points) - 1, walked - walked[0]
    best, best_rank = [0, end], (2, True, False, -np.inf)
    gates = np.flatnonzero(walked < lap)
    for gate in gates[:: -(-len(gates) // GATES)]:
        found = gate_crossings(points, walked, gate, lap, width)
        rest = walked[-1] - walked[found[-1]]
        near = np.linalg.norm(points[end] - points[gate]) <= max(width, GATE_SLACK * lap)
        full = (1 - GATE_SLACK) * lap <= rest < lap
        nearly = not full and near and abs(rest - lap) < LAP_SPREAD * lap
        found = [*found, end] if full or nearly else found
        narrow = -np.linalg.norm(points[found] - points[gate], axis=1).max()
        passed = not (np.abs(walked[found] - stood[:, None]) <= apart).any()
        rank = len(found), not nearly, passed, narrow
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
    found, reached = [int(gate)], walked[crossing]
    while True:
        due = walked[found[-1]] + lap + LAP_SPREAD * lap * np.array([-1, 1])
        one, beyond = np.searchsorted(reached, due)
        if one == beyond:
            return found
        found.append(int(crossing[one + np.argmin(aside[crossing[one:beyond]])]))


def why_too_few(walked, cuts):
    """Why the laps between cuts are too few to be what the walk is about, "" if they are not."""
    share = (walked[cuts[-1]] - walked[cuts[0]]) / walked[-1]
    if len(cuts) < 3:
        return "holds less than two full laps"
    return "" if share >= LEAST else f"its laps would be {share:.0%} of it, less than {LEAST:.0%}"


def why_unlike(points, walked, cuts):
    """Why the laps between cuts are not to be taken for one task, "" if they may be."""
    places = [np.linspace(start, end, LAP_POINTS // 2) for start, end in pairwise(walked[cuts])]
    first, *others = [at_way(points, walked, each) for each in places]
    apart = np.array([distance_between(first, other) for other in others]) / size(first)
    mean, most = apart.mean(axis=1).max(), np.quantile(apart, MOSTLY, axis=1).max()
    if mean < ALIKE and most < APART:
        return ""
    found = f"{mean:.0%} of their size apart on average, {most:.0%} at a twentieth of their places"
    return f"its laps lie up to {found}; laps of one task lie {ALIKE:.0%} and {APART:.0%} apart at most"


def at_way(points, walked, distance):
    """Positions (M, 2) of a track (N, 2) after ways (M,) in m, given that to each sample (N,)."""
    return np.stack([np.interp(distance, walked, column) for column in points.T], axis=1)


def distance_between(one, other):
    """Distance (n,) in m of each place on two laps (n, 2) to the other lap thereabouts, the farther of the two."""
    gaps, share = scipy.spatial.distance.cdist(one, other), np.linspace(0, 1, len(one))
    gaps[np.abs(share[:, None] - share) > LAP_SPREAD] = np.inf
    return np.maximum(gaps.min(axis=0), gaps.min(axis=1))
