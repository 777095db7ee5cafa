"""Reading files at the edge: errors that name file and line, and no more than there is room for."""

import codecs
import gzip
import io
import json
import math
import os
import re
import sys
import warnings
import zlib
from collections import Counter
from contextlib import contextmanager
from functools import partial

from dollop.checks import FARTHEST, LONGEST, shortened, told

__all__ = [
    "MAX_CELLS",
    "MAX_LINES",
    "FormatError",
    "check_cells",
    "check_fields",
    "check_json",
    "from_file",
    "of_file",
    "read_bytes",
    "read_json",
    "read_lines",
    "warn_of",
    "written_number",
]

MAX_BYTES = 1 << 30
"""The most that is read of one file, unpacked: a small gzip can hold anything."""
PIECE = 1 << 18
"""Bytes that are read at once, so that no more room is taken than the file needs."""
MAX_LINES, MAX_LINE = 2_000_000, 1 << 20
"""Lines of a log, and bytes of one: five hours of a hundred messages a second, of many readings."""
MAX_CELLS = 20_000_000
"""Cells of a map, or pixels of its picture: 220 m x 220 m at 5 cm; making one takes 0.9 GB."""
MAX_JSON, MAX_VALUES = 64 << 20, 4_000_000
"""Bytes and values of a JSON file: a task of an hour's walks in a hall, many times over."""
NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
"""A number as C, YAML and ROS write it."""


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


@contextmanager
def _opened(path):
    """The file as it is unpacked, for reading, and its size in bytes as it lies there."""
    path = os.fspath(path)  # a number would be taken for a file that is open already
    if os.path.exists(path) and not os.path.isfile(path):
        kind = "a folder" if os.path.isdir(path) else "a device or a pipe"
        raise FormatError(f"must be an ordinary file, and is {kind}", path)
    with open(path, "rb") as stream:
        try:
            zipped = stream.read(2) == b"\x1f\x8b"
            stream.seek(0)
            yield (
                io.BufferedReader(gzip.GzipFile(fileobj=stream), PIECE) if zipped else stream,
                os.fstat(stream.fileno()).st_size,
            )
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise FormatError(f"gzip data cut short or damaged ({error})", path) from None
        except OSError as error:
            raise FormatError(f"cannot be read to its end ({error.strerror})", path) from None


def read_bytes(path, most=MAX_BYTES):
    """Whole content of a file, unpacked if it is gzipped (told by its first bytes, not its name).

    A byte order mark, which some editors put before UTF-8 text, is left out.

    Parameters
    ----------
    path : str or Path
        The file.
    most : int
        Bytes that it may hold, unpacked.

    Returns
    -------
    bytes
        At least one.

    Raises
    ------
    FormatError
        If the file is empty, no ordinary file (a folder, a device, a pipe), its gzip stream is cut
        short or damaged, or it holds more than so many bytes, of which no more are read.
    """
    with _opened(path) as (stream, size):
        content = io.BytesIO()
        while size <= most and content.tell() <= most and (piece := stream.read(PIECE)):
            content.write(piece)
    if size > most or content.tell() > most:
        raise FormatError(f"holds more than {most} bytes, the most that is read", path)
    if not content.tell():
        raise FormatError("the file is empty", path)
    return content.getvalue().removeprefix(codecs.BOM_UTF8)


def read_lines(path):
    """Lines of a text, unpacked as by `read_bytes`; never more than one is in memory.

    Parameters
    ----------
    path : str or Path
        The file.

    Yields
    ------
    bytes
        With what ends the line.

    Raises
    ------
    FormatError
        As `read_bytes`, and if it is no text, has more than 2 million lines or one of more than a
        mebibyte, or holds more than a gibibyte.
    """
    total = 0
    with _opened(path) as (stream, _):
        for number, line in enumerate(iter(partial(stream.readline, MAX_LINE + 1), b""), 1):
            if total < 4096 and b"\0" in line[: 4096 - total]:
                raise FormatError("binary data, where text is expected", path)
            total += len(line)
            if total > MAX_BYTES:
                raise FormatError(f"holds more than {MAX_BYTES} bytes, the most that is read", path)
            if len(line) > MAX_LINE:
                rule = f"longer than {MAX_LINE} bytes, the most that is read of a line"
                raise FormatError(rule, path, number)
            if number > MAX_LINES:
                raise FormatError(f"holds more than {MAX_LINES} lines, the most that is read", path)
            yield line if number > 1 else line.removeprefix(codecs.BOM_UTF8)
    if not total:
        raise FormatError("the file is empty", path)


def read_json(path, what):
    """What a JSON file holds, by the letter of the format (RFC 8259).

    Parameters
    ----------
    path : str or Path
        The file.
    what : str
        What it should be, for the error.

    Returns
    -------
    dict, list, str, int, float, bool or None
        Numbers are finite.

    Raises
    ------
    FormatError
        As `read_bytes`, and if it is no JSON, holds more than 64 MiB or more than 4 million values,
        NaN or a number that no float holds, or names something twice.
    """
    content = read_bytes(path, MAX_JSON)
    from_file(path, check_json, what, content)
    numbers = {"parse_constant": _finite, "parse_float": _finite, "parse_int": _whole}
    try:
        return json.loads(content.decode(), object_pairs_hook=_named_once, **numbers)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"not {what}: {error}", path) from None


def check_json(what, content):
    """Refuse a JSON text that is too long to be read.

    Parameters
    ----------
    what : str
        What it should be, for the error.
    content : bytes

    Raises
    ------
    ValueError
        If it holds more than 64 MiB, or more than 4 million values.
    """
    values = sum(map(content.count, (b",", b"[", b"{")))
    if len(content) > MAX_JSON or values > MAX_VALUES:
        rule = f"{MAX_JSON} bytes and {MAX_VALUES} values are the most that is read"
        raise ValueError(f"not {what}: {rule}, got {len(content)} and {values}")


def _finite(text):
    number = float(text)
    if not math.isfinite(number):
        rule = "a number must be finite, and no more than a float holds"
        raise ValueError(f"{rule}, got {shortened(text, 60)}")
    return number


def _whole(text):
    if len(text) > 300:  # more digits than a float holds, and perhaps than Python reads
        _finite(text)
    return int(text)


def _named_once(pairs):
    content = dict(pairs)
    if len(content) < len(pairs):
        twice = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"a name must be given once, got {told(twice)} again")
    return content


def check_fields(where, content, names, optional=()):
    """Refuse what is not told by its names, all of them and no others.

    Parameters
    ----------
    where : str
        What to call it in the error.
    content : object
        What was read.
    names : iterable of str
        What there must be.
    optional : iterable of str
        What there can be.

    Raises
    ------
    ValueError
        If it is no dict, or with the names that are missing or unknown.

    Examples
    --------
    >>> check_fields("a box", {"width": 1.0, "colour": "red"}, ["width"])
    Traceback (most recent call last):
    ValueError: a box cannot have colour
    """
    names, optional = set(names), set(optional)
    if not isinstance(content, dict):
        needed = ", ".join(sorted(names))
        raise ValueError(f"{where} must have {needed}, got {type(content).__name__}")
    for said, wrong in (
        ("lacks", names - set(content)),
        ("cannot have", set(content) - names - optional),
    ):
        if wrong:
            raise ValueError(f"{where} {said} {shortened(', '.join(sorted(map(str, wrong))), 100)}")


def written_number(name, text, most=FARTHEST):
    """A number as C, YAML and ROS write it: decimal digits, without underscores.

    Parameters
    ----------
    name : str
        What to call it in the error.
    text : str
    most : float
        How far from zero it may be.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        With name, rule and text.

    Examples
    --------
    >>> written_number("resolution", "5e-2")
    0.05
    >>> written_number("resolution", "1_0")
    Traceback (most recent call last):
    ValueError: resolution must be a number, got '1_0'
    """
    if not NUMBER.fullmatch(text):
        raise ValueError(f"{name} must be a number, got {told(text)}")
    if not abs(float(text)) <= most:
        raise ValueError(f"{name} must be a number within {most:g}, got {told(text)}")
    return float(text)


def check_cells(columns, rows):
    """Refuse a map that needs more room than there is, before there is any of it.

    Parameters
    ----------
    columns, rows : int or float
        Cells along x and y, or pixels.

    Raises
    ------
    ValueError
        If they are more than 20 million in all.
    """
    if not columns * rows <= MAX_CELLS:
        cells = f"{columns:.12g} x {rows:.12g} cells"
        raise ValueError(f"{cells} are more than {MAX_CELLS}, the most that a map has")
