"""The extras of the package: what each brings, and how to install one that is missing."""

from importlib.util import find_spec

__all__ = ["EXTRAS", "need"]

EXTRAS = {
    "lab": "pybullet",
    "ros": "rosbags",
    "notebooks": "jupyterlab",
    "baseline": "hmmlearn",
    "book": "sphinx",
    "cluster": "distributed",
    "dev": "pytest",
}
"""The module by which each extra of pyproject.toml is known to be there."""


def need(extra):
    """Raise ImportError, with the line that installs it, if an extra is missing; to be asked before the work begins.

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
    ValueError: no extra 'laboratory'; known: lab, ros, notebooks, baseline, book, cluster, dev
    """
    if extra not in EXTRAS:
        raise ValueError(f"no extra {extra!r}; known: {', '.join(EXTRAS)}")
    if find_spec(EXTRAS[extra]) is None:
        wheels = " (wheels only for Linux x86-64 and CPython up to 3.11)" if extra == "lab" else ""
        raise ImportError(f'this needs {EXTRAS[extra]}: pip install "dollop[{extra}]"{wheels}')
