"""Learners of a task's structure compared: merging, hidden Markov models and the plain mean.

Demonstrations of known tasks are drawn with subgoals that scatter and, now and then, one subgoal
that is no part of the task. Every method gets the same demonstrations and says what it takes for
the task: subgoals in order, (L, 2).
"""

import logging
from collections import Counter
from functools import partial
from itertools import groupby, product
from time import process_time

import joblib
import numpy as np
import pandas as pd
from tqdm import tqdm

from dollop.cdhmm import SubgoalHMM
from dollop.checks import need
from dollop.lab.drawn import TASKS, draw_demonstrations

__all__ = [
    "METHODS", "judge", "merged", "plain_mean", "study", "summary",
]  # fmt: skip

# ---- what each method takes for the task


def merged(sequences, spread=0.15):
    """What merging takes for the task: the subgoals on a CDHMM's most-likely path (Sec. V).

    Parameters
    ----------
    sequences : sequence of (K, 2) array_like
        Subgoals of each demonstration in m.
    spread : float
        Expected standard deviation of a subgoal along each axis in m.

    Returns
    -------
    (L, 2) float array
        In m.
    """
    model = SubgoalHMM.fit(sequences, spread)
    return model.means[model.most_likely_path()]


def plain_mean(sequences):
    """Mean of the demonstrations, subgoal by subgoal, each stretched to their median length.

    Parameters
    ----------
    sequences : sequence of (K, 2) array_like
        Subgoals of each demonstration in m.

    Returns
    -------
    (L, 2) float array
        In m.
    """
    length = int(np.median([len(sequence) for sequence in sequences]))
    return np.mean([_stretch(sequence, length) for sequence in sequences], axis=0)


def _stretch(sequence, length):
    at, given = np.linspace(0, 1, length), np.linspace(0, 1, len(sequence))
    columns = np.asarray(sequence, float).T
    return np.stack([np.interp(at, given, column) for column in columns], axis=-1)


def gaussian_hmm(sequences, left_to_right=False, n_states=range(2, 11), restarts=5, seed=0, spread=0.15):
    """Subgoals by hidden Markov models of hmmlearn, the number of states chosen by BIC.

    A general method, set up as its own advocate would: it is told the spread that merging is told.
    Expectation-maximisation from several random starts for each number of states; the best of each
    is compared by BIC. The task is the sequence of states that the most demonstrations follow
    (Viterbi, repetitions dropped), the shorter where several do.

    Parameters
    ----------
    sequences : sequence of (K, 2) array_like
        Subgoals of each demonstration in m.
    left_to_right : bool
        Allow only steps to the same state or a later one, from the first state on.
    n_states : iterable of int
        Numbers of states to compare; never more than there are subgoals.
    restarts : int
        Random starts for each number of states.
    seed : int
    spread : float
        Expected standard deviation of a state in m, its covariance's prior: the same that merging
        is given.

    Returns
    -------
    (L, 2) float array
        In m.

    Raises
    ------
    ImportError
        If hmmlearn is not installed.
    """
    need("baseline")
    from threadpoolctl import threadpool_limits

    points, lengths = np.concatenate(sequences), [len(sequence) for sequence in sequences]
    random = np.random.RandomState(seed)
    sizes = [size for size in n_states if size <= len(points)]
    blank = [_blank(size, left_to_right, random, spread) for size in sizes for _ in range(restarts)]
    # Matrices this small are slower with several BLAS threads, many times so where these wait for a
    # busy processor. Only what is loaded is limited: hmmlearn is, by now.
    with threadpool_limits(1):
        models = [_fitted(model, points, lengths) for model in blank]
        scores = [np.inf if model is None else model.bic(points, lengths) for model in models]
        model = models[int(np.nanargmin(scores))]
        return model.means_[list(_common_path(model, sequences))]


def _blank(size, left_to_right, random, spread):
    """A hidden Markov model that has seen nothing yet."""
    from hmmlearn.hmm import GaussianHMM

    logging.getLogger("hmmlearn").setLevel(logging.ERROR)  # it warns of every run that stops early
    allowed = np.triu(np.ones((size, size))) if left_to_right else np.ones((size, size))
    expected = {"covars_prior": spread**2, "transmat_prior": 1 + 1e-3 * allowed}
    fitted = {"params": "mct", "init_params": "mc"} if left_to_right else {}
    model = GaussianHMM(size, n_iter=100, random_state=random, **expected, **fitted)
    if left_to_right:
        model.startprob_ = np.eye(size)[0]
        model.transmat_ = allowed / allowed.sum(1, keepdims=True)
    return model


def _fitted(model, points, lengths):
    """The model after one run of expectation-maximisation, or None where that broke down."""
    try:
        with np.errstate(all="ignore"):
            return model.fit(points, lengths)
    except ValueError:
        return None


def _common_path(model, sequences):
    paths = Counter()
    for sequence in sequences:
        paths[tuple(state for state, _ in groupby(model.predict(sequence)))] += 1
    return min(paths, key=lambda path: (-paths[path], len(path), path))


# ---- the comparison


METHODS = {
    "merging": merged,
    "HMM, BIC": gaussian_hmm,
    "left-to-right HMM, BIC": partial(gaussian_hmm, left_to_right=True),
    "plain mean": plain_mean,
}
"""From sequences of subgoals in m to what each method takes for the task, (L, 2) in m."""


def judge(found, task):
    """Compare subgoals found with the true ones.

    Parameters
    ----------
    found : (L, 2) array_like
        In m.
    task : (K, 2) array_like
        In m.

    Returns
    -------
    dict
        `right_number`; `right_order`: as many, and each nearer to its own true subgoal than to any
        that lies elsewhere; `error`: mean distance to the true subgoals in m, nan where the number
        is wrong.
    """
    found, task = np.asarray(found, float), np.asarray(task, float)
    if len(found) != len(task):
        return {"right_number": False, "right_order": False, "error": np.nan}
    distances = np.linalg.norm(found[:, None] - task, axis=-1)
    own = np.diagonal(distances)
    in_order = bool((own <= distances.min(1)).all())
    return {"right_number": True, "right_order": in_order, "error": own.mean()}


def study(tasks=TASKS, numbers=(2, 5, 10), spreads=(0.05, 0.15), seeds=range(100), methods=METHODS, jobs=1):
    """Let every method find every task from the same demonstrations, 30 % with a subgoal too many.

    Parameters
    ----------
    tasks : iterable of str
        Names in `TASKS`.
    numbers : sequence of int
        Numbers of demonstrations.
    spreads : sequence of float
        Standard deviation of a subgoal along each axis in m. The methods are not told; they expect
        their default.
    seeds : sequence of int
    methods : dict
        Functions like those in `METHODS`, by name.
    jobs : int
        How many cases are worked on at once; the numbers but for the times stay the same.

    Returns
    -------
    pandas.DataFrame
        One row per task, number `n`, `spread`, `seed` and `method`: what `judge` says, `length` of
        the path found, and `seconds` of processor time it took.
    """
    cases = tqdm(list(product(tasks, numbers, spreads, seeds, methods)), desc="structure study")
    calls = (joblib.delayed(_trial)(*case, methods[case[-1]]) for case in cases)
    return pd.DataFrame(joblib.Parallel(n_jobs=jobs)(calls))


def _trial(task, n, spread, seed, method, find):
    """A row of the study: what one method makes of one set of demonstrations."""
    demonstrations = draw_demonstrations(TASKS[task], n, spread, seed=seed)
    begin = process_time()
    found = find(demonstrations)
    taken = process_time() - begin
    case = {"task": task, "n": n, "spread": spread, "seed": seed, "method": method}
    return case | {"length": len(found)} | judge(found, TASKS[task]) | {"seconds": taken}


def summary(table):
    """Shares of right number and order, mean error in m and median seconds.

    Parameters
    ----------
    table : pandas.DataFrame
        From `study`.

    Returns
    -------
    pandas.DataFrame
        Columns right_number, right_order, error and seconds, by task, spread, n and method.
    """
    groups = table.groupby(["task", "spread", "n", "method"], sort=False)
    return groups.agg(
        right_number=("right_number", "mean"),
        right_order=("right_order", "mean"),
        error=("error", "mean"),
        seconds=("seconds", "median"),
    )
