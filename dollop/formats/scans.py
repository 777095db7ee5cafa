"""What the readers of laser scans share: how much is forgiven, and a clock that can be used."""

from bisect import bisect_left
from collections import Counter
from typing import NamedTuple

import numpy as np

from dollop.checks import FARTHEST, Note, shortened, told
from dollop.formats.files import FormatError, warn_of

__all__ = [
    "MAX_READINGS",
    "Beams",
    "Scan",
    "check_beams",
    "check_metres",
    "doubtful",
    "forgive",
    "forgive_disorder",
    "longest_rise",
    "no_return_from",
    "usable_scans",
]

NOMINAL_RATE = 10.0
"""Scans per second of a SICK LMS 200 at 1 degree and 38400 baud: what a log without a usable clock
is given.
"""
LONGEST_GAP = 3600.0
"""Seconds without a scan from which on it is the clock that jumped: no log of a demonstration rests
for an hour.
"""
PILE, BELOW = 0.10, 1.0
"""m: how far the readings may vary with which a laser says that nothing came back, and how far below them
there is next to nothing."""
OFTEN, STANDING_OUT, ALIKE = 50, 20, 0.7
"""How many readings are a pile, how many times those below it, and which share of it two values make up:
readings of a wall vary with the laser's noise."""
WIDE = np.radians(30)
"""Bearings in rad that a pile must spread over: the end of a corridor may be read alike often, but it is
narrow."""
MAX_BEAMS, MAX_READINGS = 36_000, 100_000_000
"""Beams of a scan, a hundredth of a degree apart all round, and readings of a log: ten hours of ten
scans of 271 beams a second, for which a gigabyte is needed."""
FULL_TURN = 2 * np.pi + 1e-6
"""rad that beams may spread over, and what rounding adds."""


class Beams(NamedTuple):
    """What must not change within a log: the geometry of its scans.

    Attributes
    ----------
    count : int
        Beams of a scan.
    start, step : float
        First bearing, and from one beam to the next, in rad.
    max_range : float or None
        In m; None where the file does not state it.
    is_sick : bool
        Whether the laser has the error codes of a SICK.
    """

    count: int
    start: float
    step: float
    max_range: float | None
    is_sick: bool = False

    def __str__(self):
        reach = "" if self.max_range is None else f" up to {self.max_range:g} m"
        return f"{self.count} beams from {self.start:.4g} rad, {self.step:.4g} rad apart{reach}"

    @property
    def angles(self):
        """(count,) float array of bearings in rad, in the order of the file."""
        return self.start + self.step * np.arange(self.count)


class Scan(NamedTuple):
    """One scan as its file holds it.

    Attributes
    ----------
    beams : Beams
        Its geometry.
    ranges : (B,) float array
        In m.
    pose : (3,) sequence of float
        Sensor in the world: x, y in m, theta in rad.
    t : float
        Time in s.
    """

    beams: Beams
    ranges: np.ndarray
    pose: tuple
    t: float


def check_beams(beams):
    """Refuse beams that no laser has.

    Parameters
    ----------
    beams : Beams

    Raises
    ------
    ValueError
        If they are more than 36,000 or none, several in one direction, spread over more than a full
        turn, or begin farther than a full turn from straight ahead.
    """
    if not 1 <= beams.count <= MAX_BEAMS:
        raise ValueError(f"a scan must have 1 to {MAX_BEAMS} beams, got {told(beams.count)}")
    spread = abs(beams.step) * (beams.count - 1)
    if beams.step == 0 and beams.count > 1:
        raise ValueError(f"beams must lie apart, got {shortened(str(beams), 100)}")
    if not (spread <= FULL_TURN and abs(beams.start) <= FULL_TURN):
        raise ValueError(f"beams must spread over at most a full turn, got {shortened(str(beams), 100)}")


def check_metres(name, values):
    """Refuse numbers that are no metres.

    Parameters
    ----------
    name : str
        What to call them in the error.
    values : (N,) float array
        In m; at least one.

    Raises
    ------
    ValueError
        If one is NaN, or farther than 1e9 m.
    """
    farthest = np.abs(values).max()
    if not farthest <= FARTHEST:
        raise ValueError(f"{name} must be within {FARTHEST:g} m, got {farthest:g} m")


def usable_scans(path, scans, bad):
    """Scans of one geometry, that of most, with times that increase.

    A few others, and a few broken ones, are left out with a warning (`forgive`). A scan is out of
    order where the clock runs backwards, and where it is farther than an hour from the scan before
    and the scan after. Where at most one scan in twenty is out of order those are left out, with a
    warning. Otherwise the clock is worthless: all scans are kept, in the order of the file, and
    timed at 10 Hz, with the warning that speeds mean nothing. A jump forwards that lasts is only
    warned of: either side of it is in order. The limits are a reconstruction.

    Parameters
    ----------
    path : str or Path
        The file, for messages.
    scans : dict of int to Scan
        The readable scans by their place in the file, in order; at least one.
    bad : dict of int to str
        The reason of every scan that is broken.

    Returns
    -------
    scans : list of K Scan
        All of the same `beams`.
    t : (K,) float array
        Their times in s, strictly increasing.
    notes : tuple of Note
        Of kind "clock", if all times are in doubt.

    Raises
    ------
    FormatError
        If there are too many broken and other scans.

    Warns
    -----
    UserWarning
        If scans were left out, or the clock is wrong.

    Examples
    --------
    A single scan keeps its time, whatever it is.

    >>> scan = Scan(Beams(1, 0.0, 1.0, 8.0), np.ones(1), (0, 0, 0), t=-3.5)
    >>> usable_scans("a.log", {1: scan}, {})[1].tolist()
    [-3.5]
    """
    beams = Counter(scan.beams for scan in scans.values()).most_common(1)[0][0]
    other = {place: scan.beams for place, scan in scans.items() if scan.beams != beams}
    odd = {place: f"{each}, where most scans have {beams}" for place, each in other.items()}
    forgive(path, bad | odd, len(scans) + len(bad))
    alike = [scan for scan in scans.values() if scan.beams == beams]
    keep, t, notes = _usable_clock(path, np.array([scan.t for scan in alike]))
    return [alike[i] for i in keep], t, notes


def doubtful(path, kind, text):
    """Warn of what puts a whole log in doubt, and note it.

    Parameters
    ----------
    path : str or Path
        The file.
    kind, text : str
        As in `dollop.checks.Note`.

    Returns
    -------
    Note
        With doubt.
    """
    warn_of(path, text)
    return Note(kind, text)


def no_return_from(path, ranges, angles, limit):
    """Smallest reading of a log that is no distance, as far as its readings tell.

    A laser that says "nothing came back" by a number says it often, from all around, and always by
    the same number or a few, with next to nothing in the metre below. Readings of a wall vary with
    noise, and more below it than they do. What is so alike but comes from one narrow direction may
    be the end of a corridor: it stays a distance, in doubt. The limits are a reconstruction.

    Parameters
    ----------
    path : str or Path
        The file, for the warning.
    ranges : (T, B) float array
        In m.
    angles : (B,) float array
        Bearings in rad.
    limit : float
        Reading in m from which on it is known that nothing came back.

    Returns
    -------
    limit : float
        In m, no larger than the one known.
    notes : tuple of Note
        Of kind "sensor", if there is such a pile.

    Examples
    --------
    >>> ranges = np.tile(np.linspace(1.0, 9.0, 100), (100, 1))
    >>> ranges[:, ::10] = 50.0
    >>> limit, notes = no_return_from("a.log", ranges, np.linspace(-1.5, 1.5, 100), 80.0)
    >>> limit, notes[0].text
    (50.0, '10.0% of the readings pile up at 50 m: taken to mean that nothing came back')
    """
    piled, wide = _pile(ranges, angles, limit)
    if not piled.size:
        return limit, ()
    low, high = float(piled.min()), float(piled.max())
    place = f"{low:g} m" if low == high else f"{low:g} to {high:g} m"
    text = f"{piled.size / ranges.size:.1%} of the readings pile up at {place}"
    if wide:
        note = Note("sensor", f"{text}: taken to mean that nothing came back", doubt=False)
        lower, further = no_return_from(path, ranges, angles, low)
        return lower, (note, *further)
    remedy = f"dataclasses.replace(log, ranges=np.where(log.ranges < {low:g}, log.ranges, np.inf))"
    return limit, (doubtful(path, "sensor", f"{text}; if that means that nothing came back: {remedy}"),)


def _pile(ranges, angles, limit):
    """Largest readings below a limit if they stand out, (N,), and whether they come from all around."""
    below = np.where(ranges < limit - 1e-9, ranges, 0.0)
    top = below.max()
    pile = below >= top - PILE
    piled = below[pile]
    beneath = (below >= top - PILE - BELOW).sum() - piled.size
    rest = (below > 0).sum() - piled.size
    alike = sum(count for _, count in Counter(piled.tolist()).most_common(2))
    often = piled.size >= OFTEN and piled.size >= STANDING_OUT * beneath and rest >= OFTEN
    if not often or alike < ALIKE * piled.size:
        return np.empty(0), False
    return piled, np.ptp(angles[pile.any(axis=0)]) >= WIDE


def forgive(path, bad, total, what="scans"):
    """Accept a few broken scans, or other messages, with one warning, or refuse the file.

    A log of at least 20 scans is read without its broken ones as long as they are no more than one
    in a hundred, or a single one. What is broken in more of them is taken to be the file's nature
    and not an accident. The limits are a reconstruction.

    Parameters
    ----------
    path : str or Path
        The file, for the message.
    bad : dict of int to str
        The reason of every broken scan, by its line.
    total : int
        Scans in the file, the broken ones included.
    what : str
        What they are.

    Raises
    ------
    FormatError
        With the first broken line, if there are too many of them.

    Warns
    -----
    UserWarning
        With their number and the first, if there are few.

    Examples
    --------
    >>> forgive("a.log", {7: "cut off"}, 19)
    Traceback (most recent call last):
    dollop.formats.files.FormatError: a.log, line 7: cut off (1 of 19 scans are broken)
    """
    if not bad:
        return
    line = min(bad)
    if total < 20 or len(bad) > max(1, total // 100):
        raise FormatError(f"{bad[line]} ({len(bad)} of {total} {what} are broken)", path, line)
    lost = f"left out {len(bad)} broken of {total} {what}, the first on line {line}"
    warn_of(path, f"{lost}: {bad[line]}")


def forgive_disorder(path, t, name):
    """Which messages are in order; the others are accepted with a warning, or the file is refused.

    Parameters
    ----------
    path : str or Path
        The file, for the message.
    t : (N,) float array
        Times of the messages in s.
    name : str
        What they are called.

    Returns
    -------
    (K,) int array
        Indices of the messages that stay.

    Raises
    ------
    FormatError
        If the clock is in order for less than half of them.

    Warns
    -----
    UserWarning
        With their number, if some are left out.
    """
    keep = longest_rise(t)
    lost = f"{len(t) - len(keep)} of {len(t)} {name} messages"
    if 2 * len(keep) < len(t):
        raise FormatError(f"the clock is useless: {lost} are out of order", path)
    if len(keep) < len(t):
        warn_of(path, f"left out {lost}, which the clock puts out of order")
    return keep


def longest_rise(values):
    """Indices of a longest strictly increasing subsequence.

    By patience sorting (M. L. Fredman, "On computing the length of longest increasing
    subsequences", 1975).

    Parameters
    ----------
    values : (N,) sequence of float
        In any unit.

    Returns
    -------
    (K,) int array
        Increasing.

    Examples
    --------
    >>> longest_rise([0.0, 0.1, 99.0, 0.2, 0.3]).tolist()  # the odd one goes, wherever it points
    [0, 1, 3, 4]
    """
    # Smallest end of a rise of each length, where it stands, and what precedes it.
    ends, places, before = [], [], []
    for i, value in enumerate(values):
        k = bisect_left(ends, value)
        before.append(places[k - 1] if k else -1)
        ends[k : k + 1], places[k : k + 1] = [value], [i]
    chosen = places[-1:]
    while chosen and before[chosen[-1]] >= 0:
        chosen.append(before[chosen[-1]])
    return np.array(chosen[::-1], dtype=int)


def _usable_clock(path, t):
    """Which of the scans at times `t` (T,) stay, (K,), their times (K,), and notes: see `usable_scans`."""
    keep = longest_rise(t)
    far = np.diff(t[keep], prepend=-np.inf, append=np.inf) > LONGEST_GAP
    stray = far[:-1] & far[1:]  # from both neighbours; the first and the last have but one
    keep = keep if stray.sum() * 20 > len(keep) else keep[~stray]
    lost = len(t) - len(keep)
    if lost * 20 > len(t):
        out = f"{lost} of {len(t)} scans are out of order"
        consequence = f"so the scans are timed at {NOMINAL_RATE:g} Hz; speeds mean nothing"
        text = f"the clock stands still or runs backwards ({out}), {consequence}"
        return np.arange(len(t)), np.arange(len(t)) / NOMINAL_RATE, (doubtful(path, "clock", text),)
    if lost:
        warn_of(path, f"left out {lost} of {len(t)} scans, which the clock puts out of order")
    gap = np.diff(t[keep]).max(initial=0)
    if gap <= LONGEST_GAP:
        return keep, t[keep], ()
    return (
        keep,
        t[keep],
        (doubtful(path, "clock", f"the clock jumps by {gap:g} s from one scan to the next"),),
    )
