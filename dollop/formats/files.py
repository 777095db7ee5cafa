"""Files at the edge: errors that name file and line, what a reader forgives, writing that is whole
or not at all.
"""

import codecs
import gzip
import os
import tempfile
import warnings
import zlib
from bisect import bisect_left
from contextlib import contextmanager
from pathlib import Path

import numpy as np

__all__ = ["FormatError", "check_writable", "forgive", "longest_rise", "read_bytes", "usable_clock", "whole_file"]

MAX_BYTES = 1 << 30
NOMINAL_RATE = 10.0
"""Scans per second of a SICK LMS 200 at 1 degree and 38400 baud: what a log without a usable clock
is given.
"""
LONGEST_GAP = 3600.0
"""Seconds without a scan from which on it is the clock that jumped: no log of a demonstration rests
for an hour.
"""


class FormatError(ValueError):
    """A file that cannot be read as what it claims to be.

    Parameters
    ----------
    message : str
        What is wrong: the value and the rule.
    path : str or Path
        The file.
    line : int, optional
        Line number, counted from 1.
    """

    def __init__(self, message, path, line=None):
        self.path, self.line = str(path), line
        place = self.path if line is None else f"{self.path}, line {line}"
        super().__init__(f"{place}: {message}")


def read_bytes(path):
    """Whole content of a file, unpacked where it is gzipped (told by its first two bytes, not by
    its name).

    A byte order mark, which some editors put before UTF-8 text, is left out.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    bytes

    Raises
    ------
    FormatError
        If the file is empty, its gzip stream is cut short or damaged, or it holds more than
        `MAX_BYTES` (1 GiB).
    """
    with open(path, "rb") as stream:
        zipped = stream.read(2) == b"\x1f\x8b"
        stream.seek(0)
        try:
            content = (gzip.GzipFile(fileobj=stream) if zipped else stream).read(MAX_BYTES + 1)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise FormatError(f"gzip data cut short or damaged ({error})", path) from None
    if not content:
        raise FormatError("the file is empty", path)
    if len(content) > MAX_BYTES:
        raise FormatError(f"holds more than {MAX_BYTES} bytes, the most that is read", path)
    return content.removeprefix(codecs.BOM_UTF8)


def check_writable(path):
    """Raise OSError now, with the file's name, if a file `path` could not be written later."""
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path} cannot be written: it is a folder")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise _naming(path, error) from None


@contextmanager
def whole_file(path, mode="wb"):
    """Open a temporary neighbour of `path` for writing; it takes the name `path` only when all went
    well.

    Of two such files, one within the other, none takes its name before both are written.
    """
    path = Path(path)
    check_writable(path)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, mode) as stream:
            yield stream
            stream.flush()
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException as error:
        os.unlink(temporary)
        if isinstance(error, OSError) and error.filename in (None, temporary):
            raise _naming(path, error) from None
        raise


def _naming(path, error):
    """The same error about the file that was to be written; the temporary one is nobody's concern."""
    return type(error)(f"{path} cannot be written: {error.strerror or error}")


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
