"""Which object is which, from each demonstration's environment to the one to learn in (Sec. IV-A)."""

from itertools import chain

import numpy as np

from dollop.checks import Note, checked_record, checked_records, shortened
from dollop.environment import Environment
from dollop.matching import Matching, match_surely

__all__ = ["composed", "inverse", "matched_to", "matchings_into", "notes_of"]


def composed(first, then):
    """Where objects go by two steps.

    Parameters
    ----------
    first, then : (N,) and (M,) int arrays
        To which of M, and to which of others; -1 for none.

    Returns
    -------
    (N,) int array

    Examples
    --------
    >>> composed(np.array([1, -1, 0]), np.array([5, -1])).tolist()
    [-1, -1, 5]
    """
    return np.where(first >= 0, np.append(then, -1)[first], -1)


def inverse(partners, n):
    """Where objects come from.

    Parameters
    ----------
    partners : (N,) int array
        To which of n each goes, -1 for none.
    n : int

    Returns
    -------
    (n,) int array
        -1 where nothing comes from.

    Examples
    --------
    >>> inverse(np.array([2, -1]), 3).tolist()
    [-1, -1, 0]
    """
    found = np.full(n, -1)
    gone = np.flatnonzero(partners >= 0)
    found[partners[gone]] = gone
    return found


def notes_of(demonstrations):
    """The notes of all demonstrations, none twice.

    Parameters
    ----------
    demonstrations : sequence of Demonstration

    Returns
    -------
    tuple of Note
        In order.
    """
    return tuple(dict.fromkeys(chain.from_iterable(shown.notes for shown in demonstrations)))


def matched_to(before, after, matching, names):
    """The matching between two environments: the one that is given, or what is sure of one that is found.

    Parameters
    ----------
    before, after : Environment
    matching : Matching, optional
        A given one.
    names : (str, str)
        What to call the two in an error.

    Returns
    -------
    matching : Matching
    notes : tuple of Note
        What is not sure.

    Raises
    ------
    ValueError
        A given matching that belongs to other environments, or none that is sure.
    """
    for name, each in zip(names, (before, after), strict=True):
        checked_record(name, each, Environment)
    if matching is None:
        return match_surely(before, after, names)
    checked_record("a matching, see `match` and `Matching.of_partners`,", matching, Matching)
    n, m, indices = len(before.corners), len(after.corners), matching.indices
    highest = indices.max(initial=-1)
    taken = indices[indices >= 0]
    if len(indices) != n or highest >= m:
        rule = f"must go from the {n} corners of {names[0]} to the {m} of {names[1]}"
        raise ValueError(f"the matching {rule}, got {len(indices)} indices up to {highest}")
    if len(np.unique(taken)) < len(taken):
        raise ValueError(f"the matching of {' and '.join(names)} must not send two corners to one")
    return matching, ()


def matchings_into(environment, demonstrations, given=None):
    """The matching of each demonstration's environment with the one to learn in.

    Parameters
    ----------
    environment : Environment
    demonstrations : sequence of D Demonstration
    given : sequence of D (Matching or None), optional

    Returns
    -------
    matchings : list of D (Matching or None)
        None for a demonstration that is set aside.
    notes : list of Note
        Which are set aside, and why; and what is not sure of others.

    Raises
    ------
    ValueError
        Another number of matchings than of demonstrations, one that belongs to others, or none
        left.
    """
    given = [None] * len(demonstrations) if given is None else checked_records("matchings", given, object)
    if len(given) != len(demonstrations):
        raise ValueError(f"matchings must be one for each of {len(demonstrations)} demonstrations, got {len(given)}")
    found, notes, refused = [], [], []
    for k, (shown, matching) in enumerate(zip(demonstrations, given, strict=True)):
        names = f"demonstration {k}", "the environment to learn in"
        try:
            each, told = _common(
                matched_to(shown.environment, environment, matching, names),
                shown,
                environment,
                names,
            )
        except ValueError as error:
            if matching is not None:
                raise
            each, told = (
                None,
                [Note("set aside", f"demonstration {k} was set aside: {error}", False)],
            )
            refused.append(str(error))
        found.append(each)
        notes += told
    if len(refused) == len(found):
        raise ValueError("no demonstration can be learned from: " + shortened("; ".join(refused), 250))
    return found, notes


def _common(matching_and_notes, shown, environment, names):
    """A matching and its notes, if there is an object in common or there are none at all."""
    matching, _ = matching_and_notes
    counts = len(shown.environment), len(environment)
    if any(counts) and not (matching.indices >= 0).any():
        rule = "must have an object in common, or have none"
        raise ValueError(
            f"{' and '.join(names)} {rule}, got {counts[0]} and {counts[1]} objects of which none is the same"
        )
    return matching_and_notes
