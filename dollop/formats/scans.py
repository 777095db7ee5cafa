"""What the readers of laser scans share: how much is forgiven, and a clock that can be used."""

import warnings
from bisect import bisect_left

import numpy as np

from dollop.formats.files import FormatError

__all__ = ["forgive", "longest_rise", "usable_clock"]

NOMINAL_RATE = 10.0
"""Scans per second of a SICK LMS 200 at 1 degree and 38400 baud: what a log without a usable clock
is given.
"""
LONGEST_GAP = 3600.0
"""Seconds without a scan from which on it is the clock that jumped: no log of a demonstration rests
for an hour.
"""


def forgive(path, bad, total):
    """Accept a few broken scans with one warning, or refuse the file.

    A log of at least 20 scans is read without its broken ones as long as they are no more than one
    in a hundred, or a single one. What is broken in more of them is taken to be the file's nature
    and not an accident.

    Parameters
    ----------
    path : str or Path
        The file, for the message.
    bad : list of (int, str)
        Line and reason of every broken scan, in the order of the file.
    total : int
        Scans in the file, the broken ones included.

    Raises
    ------
    FormatError
        With the first broken line, if there are too many of them.
    """
    if not bad:
        return
    line, reason = bad[0]
    if total < 20 or len(bad) > max(1, total // 100):
        raise FormatError(f"{reason} ({len(bad)} of {total} scans are broken)", path, line)
    message = f"{path}: left out {len(bad)} broken of {total} scans, the first on line {line}: {reason}"
    warnings.warn(message, stacklevel=4)


def longest_rise(values):
    """Indices of a longest strictly increasing subsequence.

    Parameters
    ----------
    values : (N,) sequence of float

    Returns
    -------
    (K,) int array
        Increasing.

    Examples
    --------
    >>> longest_rise([0.0, 0.1, 99.0, 0.2, 0.3]).tolist()  # the odd one goes, wherever it points
    [0, 1, 3, 4]
    """
    # Patience sorting (Fredman 1975): smallest end of a rise of each length, where it stands, and
    # what precedes it.
    ends, places, before = [], [], []
    for i, value in enumerate(values):
        k = bisect_left(ends, value)
        before.append(places[k - 1] if k else -1)
        ends[k : k + 1], places[k : k + 1] = [value], [i]
    chosen = [places[-1]] if places else []
    while chosen and before[chosen[-1]] >= 0:
        chosen.append(before[chosen[-1]])
    return np.array(chosen[::-1], dtype=int)


def usable_clock(path, t):
    """Decide what to do about a clock that stands still, runs backwards or jumps, and warn of it.

    A scan is out of order where the clock runs backwards, and where it is farther than
    `LONGEST_GAP` from the scan before and the scan after. Where at most one scan in twenty is out
    of order those are left out. Otherwise the clock is worthless: all scans are kept, in the order
    of the file, and numbered at `NOMINAL_RATE`; speeds then mean nothing. A jump forwards that
    lasts is only warned of: either side of it is in order.

    Parameters
    ----------
    path : str or Path
        The file, for the warning.
    t : (T,) float array
        Times as recorded, in s.

    Returns
    -------
    keep : (K,) int array
        Which scans stay.
    t : (K,) float array
        Their times in s, strictly increasing.
    """
    keep = _without_strays(t, longest_rise(t))
    lost = len(t) - len(keep)
    if lost * 20 <= len(t):
        if lost:
            text = f"left out {lost} of {len(t)} scans, which the clock puts out of order"
            warnings.warn(f"{path}: {text}", stacklevel=4)
        gap = np.diff(t[keep]).max(initial=0)
        if gap > LONGEST_GAP:
            warnings.warn(f"{path}: the clock jumps by {gap:g} s from one scan to the next", stacklevel=4)
        return keep, t[keep]
    text = f"the clock stands still or runs backwards ({lost} of {len(t)} scans are out of order), so the scans are"
    warnings.warn(f"{path}: {text} timed at {NOMINAL_RATE:g} Hz; speeds mean nothing", stacklevel=4)
    return np.arange(len(t)), np.arange(len(t)) / NOMINAL_RATE


def _without_strays(t, keep):
    """`keep` (K,), increasing in `t`, without the few scans that are far from both neighbours; an
    end has but one.
    """
    far = np.diff(t[keep], prepend=-np.inf, append=np.inf) > LONGEST_GAP
    stray = far[:-1] & far[1:]
    return keep if stray.sum() * 20 > len(keep) else keep[~stray]
