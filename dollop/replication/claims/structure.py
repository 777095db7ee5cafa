"""A claim on the structure of a task, which is to be had from the demonstrations alone (Sec. V).

Beside merging stand hidden Markov models of hmmlearn, set up as their advocate would
(`dollop.replication.baseline`). Where hmmlearn is missing, what is theirs is nan.
"""

from functools import partial
from importlib.util import find_spec
from math import nan
from operator import attrgetter

import numpy as np

from dollop.lab.drawn import draw_demonstrations
from dollop.replication.baseline import METHODS, judge, task_of
from dollop.replication.choosing import model_of
from dollop.replication.claims.claim import MOSTLY, Criterion, claim
from dollop.replication.claims.walked import laws_of, walks_again
from dollop.replication.reconstruction import TOLD

__all__ = ["typical"]

NAMES = {"merging": "merging", "ergodic HMM": "hmm", "left-to-right HMM": "left_to_right"}
"""How the numbers of each method begin."""

SUBGOALS = range(4, 16)
"""How many subgoals a task may have."""

WALKS = 3
"""Of one slalom in one layout."""


@claim(
    "V",
    "we must estimate the structure of the CDHMM from the demonstrations alone",
    Criterion("merging_right", "share of tasks that are found", MOSTLY, 0.05, trials=1),
    Criterion("merging_right_2", "the same from two demonstrations", trials=1),
    Criterion("hmm_right", "ergodic HMM, five demonstrations: share right", trials=1),
    Criterion("hmm_right_2", "from two", trials=1),
    Criterion("left_to_right_right", "left-to-right HMM, five: share right", trials=1),
    Criterion("left_to_right_right_2", "from two", trials=1),
    Criterion("merging_error_m", "error of a subgoal from five, where the number is right [m]"),
    Criterion("hmm_error_m", "of the ergodic HMM [m]"),
    Criterion("left_to_right_error_m", "of the left-to-right HMM [m]"),
    Criterion("merging_typical", "walked: share with as many as the median walk", trials=1),
    Criterion("hmm_typical", "of the ergodic HMM", trials=1),
    Criterion("left_to_right_typical", "of the left-to-right HMM", trials=1),
    Criterion("merging_off_m", "walked: subgoals found to the walks' own, mean distance [m]"),
    Criterion("hmm_off_m", "of the ergodic HMM [m]"),
    Criterion("left_to_right_off_m", "of the left-to-right HMM [m]"),
    choices=("merging", "spread"),
)
def structure(seed, how=TOLD):
    """Whether the number of subgoals and their order are found, nothing but the spread being told.

    A task of 4 to 15 subgoals, drawn: 1 to 2 m from one to the next, no two nearer than 0.75 m. Five
    demonstrations that scatter by 0.15 m along each axis, one more subgoal that is no part of the
    task in 30 % of them; two of the five told beside it. Right is as many, each nearer to its own
    true subgoal than to another; one in twenty matters. Walked: three slaloms in one layout, seen by
    the laser and segmented each. They have no true subgoals: told is how often as many are found as
    the median walk has, and how far those found lie from the nearest of each walk's own; nothing where
    a walk cannot be cut within the tolerance. The hidden
    Markov models get the same demonstrations, and are told the same spread.
    """
    truth = task_of(int(np.random.default_rng([seed, 15]).choice(SUBGOALS)), seed)
    drawn = draw_demonstrations(truth, 5, TOLD.spread, seed=[seed, 22])
    walks = [each.demonstration for each in walks_again(seed)[:WALKS]]
    walked = [law.subgoals for law in laws_of(walks, attrgetter("law"))]
    return {
        number: value for method in NAMES for number, value in numbers_of(method, truth, drawn, walked, how).items()
    }


def numbers_of(method, truth, drawn, walked, how):
    """What a method makes of demonstrations that were drawn and walked."""
    name = NAMES[method]
    if method != "merging" and not find_spec("hmmlearn"):
        ends = ("right", "right_2", "error_m", "typical", "off_m")
        return {f"{name}_{end}": nan for end in ends}
    find = partial(merged_as, how=how) if method == "merging" else partial(METHODS[method], spread=how.spread)
    five, two = find(drawn), find(drawn[:2])
    is_typical, off = typical(find(walked), walked) if walked else (nan, nan)
    return {
        f"{name}_right": float(judge(five, truth)["right_order"]),
        f"{name}_right_2": float(judge(two, truth)["right_order"]),
        f"{name}_error_m": judge(five, truth)["error"],
        f"{name}_typical": is_typical,
        f"{name}_off_m": off,
    }


def merged_as(sequences, how):
    """What merging takes for the task, (L, 2) in m."""
    model = model_of(sequences, how)
    return model.means[model.most_likely_path()]


def typical(found, walked):
    """How well subgoals agree with those of walks whose true ones nobody knows.

    Parameters
    ----------
    found : (L, 2) float array
        In m.
    walked : sequence of (K, 2) float arrays
        Subgoals of each walk in m.

    Returns
    -------
    number : float
        1 if there are as many as the median walk has, rounded down or up; else 0.
    off : float
        Mean distance in m of those found to the nearest of each walk's; nan if there are none.
    """
    middle = np.median([len(each) for each in walked])
    number = float(np.floor(middle) <= len(found) <= np.ceil(middle))
    if not len(found):
        return number, nan
    gaps = [np.linalg.norm(found[:, None] - each, axis=-1).min(axis=1).mean() for each in walked]
    return number, float(np.mean(gaps))
