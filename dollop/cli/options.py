"""What stands on a command line, as numbers and names."""

import argparse

import numpy as np

__all__ = ["PERFORMED", "degrees", "number", "numbers", "user", "whole", "wholes"]

PERFORMED = {
    "radius": 0.25,
    "limits": (0.5, 0.8, 0.5, 1.57),
    "period": 0.1,
    "control": "pursuit",
    "kidnap": 0,
    "seed": 0,
    "timeout": 600.0,
}
"""How a robot performs a task where nothing else is said: options and their values."""


def number(text):
    """A number as people write it: to Python 1_0 is ten.

    Parameters
    ----------
    text : str

    Returns
    -------
    float

    Raises
    ------
    ValueError
        For what is none.
    """
    return float(text if text.isascii() and "_" not in text else "no number")


def whole(text):
    """A whole number, likewise.

    Parameters
    ----------
    text : str

    Returns
    -------
    int

    Raises
    ------
    ValueError
        For what is none.
    """
    return int(text if text.isascii() and "_" not in text else "no number")


def numbers(text):
    """Numbers with commas between them.

    Parameters
    ----------
    text : str

    Returns
    -------
    tuple of float

    Raises
    ------
    ValueError
        For what is none.
    """
    return tuple(map(number, text.split(",")))


def wholes(text):
    """Whole numbers with commas between them.

    Parameters
    ----------
    text : str

    Returns
    -------
    tuple of int

    Raises
    ------
    ValueError
        For what is none.
    """
    return tuple(map(whole, text.split(",")))


def degrees(text):
    """The angle in rad that so many degrees are.

    Parameters
    ----------
    text : str

    Returns
    -------
    float

    Raises
    ------
    ValueError
        For what is no number.
    """
    return float(np.radians(number(text)))


def user(text):
    """Who the user is, as `dollop.observe` takes it: fastest, a place X,Y, or a number.

    Parameters
    ----------
    text : str

    Returns
    -------
    str, tuple or int

    Raises
    ------
    argparse.ArgumentTypeError
        For what is none of them.
    """
    if text == "fastest":
        return text
    try:
        return tuple(map(number, text.split(","))) if text.count(",") == 1 else whole(text)
    except ValueError:
        rule = "fastest, a place X,Y in m, or a number"
        raise argparse.ArgumentTypeError(f"WHO must be {rule}, got {text!r:.60}") from None
