"""What a claim of the paper is, and how one is registered beside its experiment.

A claim has one criterion or more: the mean of a number over the seeds, the range in which the claim
wants it, and the smallest difference that matters; some numbers have none of these and are only
told. What makes a verdict of them is told in `dollop.replication.judging`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, nan

__all__ = ["MORE", "MOSTLY", "NONE", "REGISTRY", "Claim", "Criterion", "claim", "unknown"]

MORE, MOSTLY, NONE = (0.0, inf), (0.9, 1), (-inf, 1e-6)
"""What many claims want: more than something else, nine times of ten, nothing but rounding."""

REGISTRY = {}
"""Every claim by its id, file by file; `dollop.replication.claims.CLAIMS` is in order."""


@dataclass(frozen=True)
class Criterion:
    """What a claim says of one number.

    Parameters
    ----------
    number : str
        Key of the experiment's result.
    meaning : str
        What it is, with its unit.
    wanted : (float, float), optional
        The claim wants the mean over the seeds in here, the upper end included; without it the
        number is only told.
    matters : float, optional
        The smallest difference in this number that matters to anybody, in its unit; of what is
        judged it must be told. Of a difference that is wanted, the range begins there.
    trials : int
        The number of a seed is the share of so many trials, 0 if it is no share. The interval of a
        share of one trial is Wilson's.
    timed : bool
        Whether it is a time that something took, which no two runs have in common.
    """

    number: str
    meaning: str
    wanted: tuple | None = None
    matters: float | None = None
    trials: int = 0
    timed: bool = False


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper that an experiment can test.

    Parameters
    ----------
    id : str
        A word that names it.
    section : str
        Of the paper.
    quote : str
        Its words.
    criteria : tuple of Criterion
        At least one with a wanted range.
    experiment : callable
        seed -> dict of numbers; nan where the seed gives none. Its docstring says what is measured,
        on what.
    constructed : bool
        Whether the method as reconstructed makes it true or false whatever the data: then the
        experiment checks the program, and says nothing of the world.
    choices : tuple of str
        Fields of `Reconstruction` that its numbers may depend on. An experiment with choices is a
        function of (seed, how).
    """

    id: str
    section: str
    quote: str
    criteria: tuple
    experiment: Callable
    constructed: bool = False
    choices: tuple = ()


def claim(section, quote, *criteria, constructed=False, choices=()):
    """Register the decorated experiment as that of a claim, which has its name.

    Parameters
    ----------
    section, quote, criteria, constructed, choices
        As `Claim` has them.

    Returns
    -------
    callable
        Decorator that leaves the experiment as it is. An underscore behind a name that is Python's
        own, `filter_`, is no part of the claim's.

    Raises
    ------
    ValueError
        There are no words, or no smallest difference that matters of a number that is judged.
    """
    if not quote.strip():
        raise ValueError("a claim needs the paper's words")
    for each in criteria:
        if each.wanted and not (each.matters and 0 < each.matters < inf):
            raise ValueError(f"of {each.number}, which is judged, it must be told what matters, got {each.matters}")

    def register(experiment):
        id = experiment.__name__.rstrip("_")
        REGISTRY[id] = Claim(id, section, quote, criteria, experiment, constructed, tuple(choices))
        return experiment

    return register


def unknown(id):
    """The result of an experiment whose seed gives no number.

    Parameters
    ----------
    id : str
        Of the claim.

    Returns
    -------
    dict
        nan for each number that the claim names.
    """
    return {criterion.number: nan for criterion in REGISTRY[id].criteria}
