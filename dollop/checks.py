"""What is asked of input, and what is said of results: errors and notes name the value and the rule."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import chain, islice
from reprlib import Repr

import numpy as np

__all__ = [
    "EXTRAS",
    "FARTHEST",
    "LATEST",
    "LONGEST",
    "Note",
    "check_choice",
    "check_has",
    "check_positive",
    "checked_array",
    "checked_flag",
    "checked_flags",
    "checked_generator",
    "checked_number",
    "checked_positions",
    "checked_record",
    "checked_records",
    "checked_whole",
    "checked_wholes",
    "need",
    "put_in",
    "shortened",
    "told",
    "trusted",
]

FARTHEST = 1e9
"""m from the origin, or rad: coordinates beyond are no metres, and lose the millimetre that tells."""
LATEST = 1e11
"""s: three thousand years. What counts milliseconds since 1970 lies beyond, and is refused."""

LONGEST = 300
"""Characters of a message, whatever it tells of."""


class _Told(Repr):
    """Values as they are told: never longer than a line, and never made longer than that either."""

    def repr1(self, value, level):
        """A number of numpy is told as a number."""
        plain = isinstance(value, np.number) and not isinstance(value, np.timedelta64)
        return super().repr1(value.item() if plain else value, level)

    def repr_int(self, value, level):
        """A whole number; Python refuses to write one of thousands of digits."""
        digits = int(value.bit_length() * 0.30103) + 1
        return f"a whole number of some {digits} digits" if digits > 25 else repr(value)

    def repr_bytes(self, value, level):
        """The beginning of bytes."""
        return self.repr_str(value, level)


_REPR = _Told()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother = 3, 45, 60
_LARGEST, _MOST_SEED = float(np.finfo(float).max), 2**128


def told(value, most=60):
    """A value as a message tells it: its repr, or so much of that as there is room for.

    Parameters
    ----------
    value : object
        Anything: no more of it is written out than is told.
    most : int
        Characters.

    Returns
    -------
    str
        One line.

    Examples
    --------
    >>> told([1.5, "a"]), told(10**400), told("x" * 10**7)
    ("[1.5, 'a']", 'a whole number of some 401 digits', "'xxxxxxxxxxxxxxxxxxxx...xxxxxxxxxxxxxxxxxxxx'")
    """
    return shortened(_REPR.repr(value), most)


def shortened(text, most=LONGEST):
    """A text as one line of at most so many characters, its middle left out if it has more.

    Parameters
    ----------
    text : str
    most : int

    Returns
    -------
    str

    Examples
    --------
    >>> shortened("a rule that nobody will ever read to its very end", 20)
    'a rule th ... ry end'
    """
    if len(text) > 4 * most:  # whatever came in, no more of it is gone through
        text = text[: 2 * most] + text[-2 * most :]
    line = " ".join(text.split())
    line = line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)
    if len(line) <= most:
        return line
    tail = (most - 5) * 2 // 5
    return f"{line[: most - 5 - tail]} ... {line[-tail:]}"


_REAL = int, float, np.integer, np.floating
_NO_NUMBER = bool, np.timedelta64  # which Python and numpy count among the whole numbers
_PLAIN = frozenset([int, float, *(np.dtype(code).type for code in "bBhHiIlLqQefdg")])
_BUFFERS = str, bytes, bytearray, memoryview, np.ma.MaskedArray
_MOST_RECORDS = 100_000
_DEEPEST = 32  # axes: lists deeper than that hold themselves


def _is_number(value):
    """Whether a value is a real number: no text, no truth value, no span of time."""
    return type(value) in _PLAIN or (isinstance(value, _REAL) and not isinstance(value, _NO_NUMBER))


def _own(value):
    """A number as one of Python's: half precision is not compared with what it does not hold."""
    with np.errstate(over="ignore"):
        return int(value) if isinstance(value, int | np.integer) else float(value)


def _holds_numbers(values, depth=0):
    """Whether a value is a number, or an array or rows of nothing else."""
    if isinstance(values, np.ndarray) and not isinstance(values, np.ma.MaskedArray):
        return values.dtype.kind in "iuf"
    if isinstance(values, _BUFFERS) or depth > _DEEPEST:
        return False
    if hasattr(values, "dtypes"):  # a table of pandas: without rows its columns have no kind yet
        return not len(values) or all(kind.kind in "iuf" for kind in np.atleast_1d(values.dtypes))
    if not isinstance(values, Sequence):
        return _is_number(values) or np.asarray(values).dtype.kind in "iuf"
    kinds = set(map(type, values))
    if kinds <= _PLAIN:
        return True
    if kinds <= {list, tuple}:
        return _holds_numbers(list(chain.from_iterable(values)), depth + 1)
    return all(_holds_numbers(each, depth + 1) for each in values)


def _check_shape(name, found, wanted):
    """Refuse another shape than the one wanted."""
    axes = found[max(len(found) - len(wanted) + 1, 0) :] if wanted[:1] == ("...",) else found
    sizes = wanted[1:] if wanted[:1] == ("...",) else wanted
    named = [isinstance(n, str) or n == m for n, m in zip(sizes, axes, strict=False)]
    if len(axes) != len(sizes) or not all(named):
        told_of = f"({wanted[0]},)" if len(wanted) == 1 else f"({', '.join(map(str, wanted))})"
        raise ValueError(f"{name} must have shape {told_of}, got {told(found)}")


def check_positive(name, value, or_zero=False):
    """Refuse what is no number, or is negative, infinite or NaN, or zero unless that is allowed.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : float
        In any unit.
    or_zero : bool
        Whether zero passes.

    Raises
    ------
    ValueError
        With name, rule and value.

    Examples
    --------
    >>> check_positive("tolerance", float("nan"))
    Traceback (most recent call last):
    ValueError: tolerance must be positive and finite, got nan
    """
    if not (_is_number(value) and (0 < _own(value) <= _LARGEST or (or_zero and value == 0))):
        rule = "finite and not negative" if or_zero else "positive and finite"
        raise ValueError(f"{name} must be {rule}, got {told(value)}")


def check_choice(name, value, known):
    """Refuse a choice that is none of the known ones.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object
        What was chosen.
    known : container of str
        What can be.

    Raises
    ------
    ValueError
        With name, value and what is known.

    Examples
    --------
    >>> check_choice("control", "plane", ["plain", "pursuit"])
    Traceback (most recent call last):
    ValueError: control must be one of 'plain', 'pursuit', got 'plane'
    """
    if not any(isinstance(value, type(each)) and value == each for each in known):
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, got {told(value)}")


def checked_array(name, values, *shape, finite=True, least=-np.inf, most=np.inf):
    """Values as a float array of their own, if they are numbers, finite and of the shape wanted.

    Numbers are whole or real ones, of Python, numpy or pandas. Text, truth values, dates, None,
    complex and masked arrays and arrays of objects are none, nor is a list that holds one of them.

    Parameters
    ----------
    name : str
        What to call it in the error.
    values : array_like
    *shape : int or str
        The size wanted along each axis; a letter stands for any, "..." in front for any axes.
    finite : bool
        Whether infinity and NaN are refused.
    least, most : float
        Bounds, both of them allowed; where NaN may be, it passes.

    Returns
    -------
    float array
        A copy.

    Raises
    ------
    ValueError
        If something is no number, the shape is another, or a value is out of bounds, or infinite or
        NaN and may not be.

    Examples
    --------
    >>> checked_array("boxes", [[0, 0, 1]], "N", 4)
    Traceback (most recent call last):
    ValueError: boxes must have shape (N, 4), got (1, 3)
    >>> checked_array("speeds", [0.5, True], "K")
    Traceback (most recent call last):
    ValueError: speeds must be numbers in rows of one length, got [0.5, True]
    """
    if (
        type(values) is np.ndarray and values.dtype.kind in "iuf"
    ):  # before it is copied: it may be one number, many times
        _check_shape(name, values.shape, shape)
    array = _as_floats(name, values)
    _check_shape(name, array.shape, shape)
    bounded = least > -np.inf or most < np.inf
    if not (finite or bounded):
        return array
    good = (array >= least) & (array <= most) if bounded else np.isfinite(array)
    good = good if finite else good | np.isnan(array)
    if good.all():
        return array
    row = np.argwhere(~np.atleast_1d(good))[0, 0]
    found = np.atleast_1d(array)[row]
    rule = "finite" if finite and not np.isfinite(found).all() else f"in {least:g} to {most:g}"
    raise ValueError(f"{name} must be {rule}, got {told(found.tolist())} in row {row}")


def _as_floats(name, values):
    """Values as a float array of their own; ValueError where they are no numbers."""
    try:
        if type(values) is np.ndarray and values.dtype.kind in "iuf" and values.dtype.itemsize <= 8:
            return np.array(values, dtype=float)
        if _holds_numbers(values):
            with np.errstate(over="ignore"):
                return np.array(values, dtype=float)
    except Exception:  # whatever is raised by what is no array: its kind is no more to be known
        pass
    raise ValueError(f"{name} must be numbers in rows of one length, got {told(values)}")


def checked_wholes(name, values, *shape, least=0, most=FARTHEST):
    """Values as an int array of their own, if they are whole numbers within bounds.

    Parameters
    ----------
    name : str
        What to call it in the error.
    values : array_like
    *shape : int or str
        As for `checked_array`.
    least, most : int
        Bounds, both of them allowed.

    Returns
    -------
    int array
        A copy.

    Raises
    ------
    ValueError
        As `checked_array`, and for a number that is not whole: 1.0 is, 1.9 is not.

    Examples
    --------
    >>> checked_wholes("corners", [0, 1.9], "m")
    Traceback (most recent call last):
    ValueError: corners must be whole numbers, got 1.9
    """
    array = checked_array(name, values, *shape, least=least, most=most)
    found = array.astype(int)
    if (found != array).any():
        raise ValueError(f"{name} must be whole numbers, got {array[found != array][0]}")
    return found


def checked_flags(name, values, *shape):
    """Values as a bool array of their own, if each is true or false, or 1 or 0.

    Parameters
    ----------
    name : str
        What to call it in the error.
    values : array_like
    *shape : int or str
        As for `checked_array`.

    Returns
    -------
    bool array
        A copy.

    Raises
    ------
    ValueError
        For another shape, or what is neither.

    Examples
    --------
    >>> checked_flags("occluded", [True, False], "N"), checked_flags("assumed", [0, 1], "N")
    (array([ True, False]), array([False,  True]))
    """
    try:
        array = np.array(values)
    except Exception:  # as in `_as_floats`, which says so
        array = np.empty(0)
    if array.dtype.kind != "b" or isinstance(values, np.ma.MaskedArray):
        return checked_wholes(name, values, *shape, least=0, most=1) == 1
    _check_shape(name, array.shape, shape)
    return array


def checked_number(name, value, least=-FARTHEST, most=FARTHEST):
    """A value as a float, if it is a finite number within bounds, and no text, True or False.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object
    least, most : float
        Bounds, both of them allowed.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        With name, rule and value.

    Examples
    --------
    >>> checked_number("turn", "0.4")
    Traceback (most recent call last):
    ValueError: turn must be a finite number, got '0.4'
    """
    if type(value) is not float:
        if not _is_number(value):
            raise ValueError(f"{name} must be a finite number, got {told(value)}")
        value = _own(value)
    if not (least <= value <= most and (type(value) is float or abs(value) <= _LARGEST)):
        lost = max(-least, most) <= FARTHEST and not -FARTHEST <= value <= FARTHEST
        rule = f"a finite number within {FARTHEST:g}" if lost else f"in {least:g} to {most:g}"
        raise ValueError(f"{name} must be {rule}, got {told(value)}")
    return float(value)


def checked_whole(name, value, least=0, most=FARTHEST):
    """A value as an int, if it is a whole number within bounds: 3 or 3.0, not 1.9 or True.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object
    least, most : int
        Bounds, both of them allowed.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        With name, rule and value.

    Examples
    --------
    >>> checked_whole("m", 1.9, 1, 8)
    Traceback (most recent call last):
    ValueError: m must be a whole number, 1 to 8, got 1.9
    """
    if not (_is_number(value) and least <= _own(value) <= most and value == int(value)):
        raise ValueError(f"{name} must be a whole number, {least:.12g} to {most:.12g}, got {told(value)}")
    return int(value)


def checked_flag(name, value):
    """A value as a bool, if it is True or False.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        For anything else, 1 and "no" among it.

    Examples
    --------
    >>> checked_flag("avoid", "no")
    Traceback (most recent call last):
    ValueError: avoid must be True or False, got 'no'
    """
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False, got {told(value)}")
    return bool(value)


def checked_record(name, value, kind):
    """A value, if it is a record of the kind wanted.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object
    kind : type

    Returns
    -------
    object
        The value itself.

    Raises
    ------
    ValueError
        With name, kind and value.

    Examples
    --------
    >>> checked_record("note", "all is well", Note)
    Traceback (most recent call last):
    ValueError: note must be a Note, got 'all is well'
    """
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIO" or kind.__name__ == "LDS" else "a"
        raise ValueError(f"{name} must be {article} {kind.__name__}, got {told(value)}")
    return value


def checked_records(name, values, kind):
    """Values in order as a tuple, if all are records of the kind wanted, at most a hundred thousand.

    Parameters
    ----------
    name : str
        What to call them in the error.
    values : iterable
    kind : type

    Returns
    -------
    tuple

    Raises
    ------
    ValueError
        With name, kind and value.

    Examples
    --------
    >>> checked_records("notes", [Note("pause", "there is no scan for 3 s"), None], Note)
    Traceback (most recent call last):
    ValueError: notes[1] must be a Note, got None
    """
    try:
        found = tuple(islice(None if isinstance(values, Mapping | Set) else values, _MOST_RECORDS + 1))
    except TypeError:
        several = "several" if kind is object else f"several of {kind.__name__}"
        raise ValueError(f"{name} must be {several}, got {told(values)}") from None
    if len(found) > _MOST_RECORDS:
        raise ValueError(f"{name} must be at most {_MOST_RECORDS}, got {told(values)}")
    values = found
    for k, value in enumerate(values):
        checked_record(f"{name}[{k}]", value, kind)
    return values


def check_has(name, value, *attributes):
    """Refuse a value that lacks something, where anything will do that has all of it.

    Parameters
    ----------
    name : str
        What to call it in the error.
    value : object
    *attributes : str
        What it must have.

    Raises
    ------
    ValueError
        With name, value, and what is missing.

    Examples
    --------
    >>> check_has("robot", "R2D2", "pose", "drive")
    Traceback (most recent call last):
    ValueError: robot must have pose and drive, got 'R2D2'
    """
    missing = [each for each in attributes if not hasattr(value, each)]
    if missing:
        raise ValueError(f"{name} must have {' and '.join(missing)}, got {told(value)}")


def checked_generator(name, seed):
    """The generator of random numbers that a seed stands for.

    Parameters
    ----------
    name : str
        What to call it in the error.
    seed : int, sequence of int, SeedSequence or Generator

    Returns
    -------
    Generator
        The same, if it is one.

    Raises
    ------
    ValueError
        For what is no seed, None among it: numbers must come out again.

    Examples
    --------
    >>> checked_generator("seed", "luck")
    Traceback (most recent call last):
    ValueError: seed, if no Generator, must be a whole number, 0 to 3.40282366921e+38, got 'luck'
    """
    if isinstance(seed, np.random.Generator | np.random.SeedSequence):
        return np.random.default_rng(seed)
    if isinstance(seed, list | tuple):
        return np.random.default_rng(checked_wholes(name, seed, "N").tolist())
    return np.random.default_rng(checked_whole(f"{name}, if no Generator,", seed, 0, _MOST_SEED))


def checked_positions(name, values, *shape):
    """Positions in the plane as a float array of their own.

    Parameters
    ----------
    name : str
        What to call them in the error.
    values : (N, 2) array_like
        In m.
    *shape : int or str
        Another one than (N, 2), as for `checked_array`.

    Returns
    -------
    (N, 2) float array
        A copy, in m.

    Raises
    ------
    ValueError
        If the shape is another, a value not finite, or one farther than 1e9 m from the origin.
    """
    positions = checked_array(name, values, *(shape or ("N", 2)))
    farthest = np.abs(positions).max(initial=0)
    if farthest > FARTHEST:
        raise ValueError(f"{name} must lie within {FARTHEST:g} m of the origin, got {farthest:g} m")
    return positions


def put_in(record, **fields):
    """Give a frozen record the values that were checked, its arrays read-only.

    Parameters
    ----------
    record : object
        A frozen dataclass that is being made: to be called in its `__post_init__`.
    **fields : object
        Values by the names of its fields; arrays must be its own.
    """
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        object.__setattr__(record, name, value)


EXTRAS = {
    "lab": "pybullet",
    "ros": "rosbags",
    "baseline": "hmmlearn",
    "peers": "movement_primitives",
    "cluster": "distributed",
}
"""The module by which each extra of pyproject.toml that the code asks for is known to be there."""
_HINTS = {
    "lab": " (wheels only for Linux x86-64 and CPython up to 3.11)",
    "peers": " (built from source, with a C compiler)",
}


def need(extra):
    """Refuse to begin where an extra is missing, with the line that installs it.

    Parameters
    ----------
    extra : str
        A key of `EXTRAS`.

    Raises
    ------
    ImportError
        If it is not installed.
    ValueError
        If there is no such extra.

    Examples
    --------
    >>> need("laboratory")
    Traceback (most recent call last):
    ValueError: extra must be one of 'lab', 'ros', 'baseline', 'peers', 'cluster', got 'laboratory'
    """
    check_choice("extra", extra, EXTRAS)
    if find_spec(EXTRAS[extra]) is None:
        raise ImportError(f'this needs {EXTRAS[extra]}: pip install "dollop[{extra}]"{_HINTS.get(extra, "")}')


@dataclass(frozen=True)
class Note:
    """What somebody who uses a result must know of it (beyond the paper).

    On good input there are none.

    Attributes
    ----------
    kind : str
        One word or two for programs: what is noted.
    text : str
        One sentence for people, with the number that was found and the rule that it breaks.
    doubt : bool
        Whether it puts the result in doubt; otherwise it is only good to know.

    Raises
    ------
    ValueError
        For a kind or text that is no text, or a doubt that is neither True nor False.
    """

    kind: str
    text: str
    doubt: bool = True

    def __post_init__(self):
        checked_record("kind", self.kind, str)
        checked_record("text", self.text, str)
        checked_flag("doubt", self.doubt)

    def __str__(self):
        return f"{self.kind}: {self.text}"


def trusted(notes):
    """Whether no note puts the result in doubt.

    Parameters
    ----------
    notes : iterable of Note

    Returns
    -------
    bool

    Examples
    --------
    >>> trusted([Note("sensor", "180 beams are taken to be 1 degree apart", doubt=False)])
    True
    """
    return not any(note.doubt for note in notes)
