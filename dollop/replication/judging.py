"""The rule by which numbers over many seeds become a verdict; it is frozen with the criteria.

An interval lies in what a claim wants, or wholly beside it, or neither. All intervals hold together
with 95 %, which one in twenty of them alone would not: the error is shared among a hundred, as many
as there may be criteria (Bonferroni). What would be answered otherwise if an end of the range were
moved by the smallest difference that matters is answered as it is, and told to be at the edge.
"""

from itertools import product
from math import inf, isfinite, nan

import numpy as np
from scipy import stats

__all__ = ["FAMILY", "LEVEL", "at_edge", "interval", "met", "verdict"]

LEVEL, FAMILY = 0.95, 100
"""All intervals of up to so many criteria hold their true means together with this probability."""


def interval(values, share=False, level=1 - (1 - LEVEL) / FAMILY):
    """Mean of values (N,) and its interval: Student's, or for a share of single trials Wilson's.

    Parameters
    ----------
    values : (N,) array_like
        One of each seed.
    share : bool
        Whether each is a 0 or a 1.
    level : float
        Of this interval alone.

    Returns
    -------
    tuple of float
        Mean, lower and upper end; nan without values, an infinite interval of a single one.

    Raises
    ------
    ValueError
        A share is below 0 or above 1.

    Examples
    --------
    >>> mean, low, high = interval([0, 1, 1, 1, 1, 1, 1, 1, 1, 1], share=True, level=0.95)
    >>> f"{mean:.2f} [{low:.2f}, {high:.2f}]"
    '0.90 [0.60, 0.98]'
    """
    values, n = np.asarray(values, float), len(values)
    if not n:
        return nan, nan, nan
    mean = values.mean()
    if share:
        if not 0 <= values.min() <= values.max() <= 1:
            raise ValueError(f"a share must be in 0 to 1, got {values.min():g} to {values.max():g}")
        ends = stats.binomtest(round(values.sum()), n).proportion_ci(level, "wilson")
        return mean, ends.low, ends.high
    reach = stats.sem(values) * stats.t.ppf((1 + level) / 2, n - 1) if n > 1 else inf
    return mean, mean - reach, mean + reach


def met(low, high, wanted):
    """Whether an interval lies in a range.

    Parameters
    ----------
    low, high : float
        Ends of the interval.
    wanted : (float, float)
        Ends of the range, the upper one included; nothing is above a share's upper end of 1.

    Returns
    -------
    {"yes", "no", "open"}
        "no" if it lies wholly beside it.
    """
    if wanted[1] == 1 and 0 < wanted[0] < low <= 1:  # a share, which is not above 1 whatever the interval
        return "yes"
    if wanted[0] < low and high <= wanted[1]:
        return "yes"
    return "no" if high <= wanted[0] or low > wanted[1] else "open"


def at_edge(low, high, wanted, matters):
    """Whether the answer would be another if an end of the range were moved by what matters.

    Parameters
    ----------
    low, high : float
        Ends of the interval.
    wanted : (float, float)
        Ends of the range.
    matters : float
        The smallest difference that matters.

    Returns
    -------
    bool

    Examples
    --------
    >>> at_edge(0.91, 0.93, (0.9, 1), 0.05), at_edge(0.97, 0.99, (0.9, 1), 0.05)
    (True, False)
    """
    bounded = isfinite(wanted[1])
    low_ends, high_ends = {wanted[0]}, {wanted[1]}
    if not (bounded and wanted[0] == 0):  # below 0 there is nothing ...
        low_ends |= {wanted[0] - matters, wanted[0] + matters}
    if bounded and not (wanted[1] == 1 and wanted[0] > 0):  # ... and above 1 no share
        high_ends |= {wanted[1] - matters, wanted[1] + matters}
    return len({met(low, high, ends) for ends in product(low_ends, high_ends)}) > 1


def verdict(answers):
    """The verdict on a claim from the answers to its criteria.

    Parameters
    ----------
    answers : sequence of {"yes", "no", "open"}

    Returns
    -------
    {"holds", "holds in part", "does not hold"}
        It holds if all are met, not if none is and one clearly is not, else in part.
    """
    if all(answer == "yes" for answer in answers):
        return "holds"
    return "does not hold" if "no" in answers and "yes" not in answers else "holds in part"
