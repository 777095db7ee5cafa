"""Reading files at the edge: errors that name file and line, and no more than there is room for."""

import codecs
import gzip
import sys
import warnings
import zlib

from dollop.checks import LONGEST, shortened

__all__ = ["FormatError", "from_file", "of_file", "read_bytes", "warn_of"]

MAX_BYTES = 1 << 30
"""The most that is read of one file, unpacked: a small gzip can hold anything."""


class FormatError(ValueError):
    """A file that cannot be read as what its name says, by the sources of CARMEN and ROS.

    What it says is one line of at most 300 characters, whatever came in.

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
        super().__init__(message, str(path), line)  # all of them, or it could not be pickled

    def __str__(self):
        message, path, line = self.args
        place = path if line is None else f"{path}, line {line}"
        return of_file(place, message)


def of_file(place, message):
    """A message of a file, no longer than any: what is wrong keeps more of its room than the name.

    Parameters
    ----------
    place : str or Path
        The file, with the line if it is known.
    message : str
        What is wrong.

    Returns
    -------
    str
    """
    message = shortened(message, LONGEST * 3 // 5)
    return f"{shortened(str(place), LONGEST - 2 - len(message))}: {message}"


def from_file(path, make, *content):
    """What is made of a file's content; what is refused in making it is the file's fault.

    Parameters
    ----------
    path : str or Path
        The file.
    make : callable
        A record, or a check.
    *content : object
        What it takes.

    Returns
    -------
    object
        What it makes.

    Raises
    ------
    FormatError
        If it raises ValueError: the same message, after the name of the file.

    Examples
    --------
    >>> from_file("walk.txt", float, "12 m")
    Traceback (most recent call last):
    dollop.formats.files.FormatError: walk.txt: could not convert string to float: '12 m'
    """
    try:
        return make(*content)
    except ValueError as error:
        raise FormatError(str(error), path) from None


def warn_of(path, text):
    """Warn of a file, at the line outside of this library that asked for it.

    Parameters
    ----------
    path : str or Path
        The file.
    text : str
        What is wrong with it.
    """
    frame, depth = sys._getframe(), 1
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("dollop."):
        frame, depth = frame.f_back, depth + 1
    warnings.warn(of_file(path, text), stacklevel=depth)


def read_bytes(path):
    """Whole content of a file, unpacked if it is gzipped (told by its first bytes, not its name).

    A byte order mark, which some editors put before UTF-8 text, is left out.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    bytes
        At least one.

    Raises
    ------
    FormatError
        If the file is empty, its gzip stream is cut short or damaged, or it holds more than 1 GiB.
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
