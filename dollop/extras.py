"""The extras of the package: what each brings, and how to install one that is missing."""

from importlib.util import find_spec

from dollop.checks import check_choice

__all__ = ["EXTRAS", "need"]

EXTRAS = {"lab": "pybullet", "ros": "rosbags", "baseline": "hmmlearn", "cluster": "distributed"}
"""The module by which each extra of pyproject.toml that the code asks for is known to be there."""


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
    ValueError: extra must be one of 'lab', 'ros', 'baseline', 'cluster', got 'laboratory'
    """
    check_choice("extra", extra, EXTRAS)
    if find_spec(EXTRAS[extra]) is None:
        wheels = " (wheels only for Linux x86-64 and CPython up to 3.11)" if extra == "lab" else ""
        raise ImportError(f'this needs {EXTRAS[extra]}: pip install "dollop[{extra}]"{wheels}')
