"""What is asked of input, and what is said of results: errors and notes name the value and the rule."""

from dataclasses import dataclass
from importlib.util import find_spec
from reprlib import Repr

import numpy as np

__all__ = [
    "EXTRAS",
    "LONGEST",
    "Note",
    "check_choice",
    "check_positive",
    "checked_array",
    "checked_number",
    "checked_numbers",
    "checked_positions",
    "need",
    "put_in",
    "shortened",
    "told",
    "trusted",
]

FARTHEST = 1e9
"""m from the origin: coordinates beyond are no metres, and their squares would overflow."""


LONGEST = 300
"""Characters of a message, whatever it tells of."""


class _Told(Repr):
    """Values as they are told: never longer than a line, and never made longer than that either."""

    def repr_int(self, value, level):
        """A whole number; Python refuses to write one of thousands of digits."""
        digits = int(value.bit_length() * 0.30103) + 1
        return f"a whole number of some {digits} digits" if digits > 25 else repr(value)

    def repr_bytes(self, value, level):
        """The beginning of bytes."""
        return self.repr_str(value, level)


_REPR = _Told()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother = 3, 45, 60


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


def check_positive(name, value, or_zero=False):
    """Refuse a number that is negative, infinite or NaN, or zero unless that is allowed.

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
    if not (0 < value < np.inf or (or_zero and value == 0)):
        rule = "finite and not negative" if or_zero else "positive and finite"
        raise ValueError(f"{name} must be {rule}, got {value}")


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
    if value not in list(known):
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, got {value!r}")


def checked_array(name, values, *shape, finite=True):
    """Values as a float array of their own, if their shape is the one wanted and all are finite.

    Parameters
    ----------
    name : str
        What to call it in the error.
    values : array_like
    *shape : int or str
        The size wanted along each axis; a letter stands for any.
    finite : bool
        Whether infinity and NaN are refused.

    Returns
    -------
    float array
        A copy.

    Raises
    ------
    ValueError
        If the shape is another, or a value is infinite or NaN and may not be.

    Examples
    --------
    >>> checked_array("boxes", [[0, 0, 1]], "N", 4)
    Traceback (most recent call last):
    ValueError: boxes must have shape (N, 4), got (1, 3)
    """
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        rule = f"{name} must be numbers in rows of one length"
        raise ValueError(f"{rule}, got {values!r:.60} ({error!s:.80})") from None
    sizes = zip(shape, array.shape, strict=False)
    if array.ndim != len(shape) or any(n != m for n, m in sizes if not isinstance(n, str)):
        wanted = f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}")
    if finite and not np.isfinite(array).all():
        row = np.argwhere(~np.isfinite(array))[0, 0]
        raise ValueError(f"{name} must be finite, got {array[row].tolist()} in row {row}")
    return array


def checked_numbers(name, values, *shape):
    """As `checked_array`, but text is no number, nor are True and False.

    Parameters
    ----------
    name : str
        What to call it in the error.
    values : array_like
    *shape : int or str
        The size wanted along each axis; a letter stands for any.

    Returns
    -------
    float array
        A copy.

    Raises
    ------
    ValueError
        As `checked_array`.
    """
    array = checked_array(name, values, *shape)
    if any(isinstance(value, str | bool | np.bool_) for value in np.array(values, dtype=object).flat):
        raise ValueError(f"{name} must be numbers, got {values!r:.60}")
    return array


def checked_number(name, value, least=-np.inf, most=np.inf):
    """A value as a float, if it is a finite number within bounds, and neither text nor True nor False.

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
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise ValueError(f"{name} must be a finite number, got {value!r:.60}")
    if not -FARTHEST <= value <= FARTHEST:
        raise ValueError(f"{name} must be a finite number within {FARTHEST:g}, got {str(value):.60}")
    if not least <= value <= most:
        raise ValueError(f"{name} must be in {least:g} to {most:g}, got {value}")
    return float(value)


def checked_positions(name, values):
    """Positions in the plane as a float array of their own.

    Parameters
    ----------
    name : str
        What to call them in the error.
    values : (N, 2) array_like
        In m.

    Returns
    -------
    (N, 2) float array
        A copy, in m.

    Raises
    ------
    ValueError
        If the shape is another, a value not finite, or one farther than 1e9 m from the origin.
    """
    positions = checked_array(name, values, "N", 2)
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
    """

    kind: str
    text: str
    doubt: bool = True

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
