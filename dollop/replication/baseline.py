"""Learners of a task's structure compared: merging, hidden Markov models and the plain mean.

Demonstrations of known tasks are drawn with subgoals that scatter and, now and then, one subgoal
that is no part of the task. Every method gets the same demonstrations and says what it takes for
the task: subgoals in order, (L, 2).
"""

import logging
from collections import Counter
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby, product
from time import process_time

import joblib
import numpy as np
import pandas as pd
from tqdm import tqdm

from dollop.cdhmm import SubgoalHMM
from dollop.checks import check_choice, check_positive, checked_positions, checked_whole, need
from dollop.lab.drawn import TASKS, draw_demonstrations

__all__ = [
    "ERGODIC", "Form", "LEFT_TO_RIGHT", "METHODS", "STARTS", "gaussian_hmm", "judge", "merged",
    "plain_mean", "study",
    "summary", "task_of",
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


# ---- hidden Markov models


def _mean_start(shown, size, random):
    return np.mean([_stretch(sequence, size) for sequence in shown], axis=0)


def _clusters(shown, size, random, weight=0.0):
    """Middles of clusters by place, and by when they come if that has a weight, in order."""
    from sklearn.cluster import KMeans

    points, when = np.concatenate(shown), _when(shown)
    extent = weight * np.ptp(points, axis=0).max()
    clusters = KMeans(size, n_init=4, random_state=random)
    labels = clusters.fit_predict(np.column_stack([points, extent * when]))
    order = np.argsort([when[labels == k].mean() for k in range(size)], kind="stable")
    return np.array([points[labels == k].mean(axis=0) for k in order])


def _random_start(shown, size, random):
    points, when = np.concatenate(shown), _when(shown)
    drawn = random.choice(len(points), size, replace=False)
    return points[drawn[np.argsort(when[drawn], kind="stable")]]


def _when(shown):
    """When in its demonstration each subgoal comes, from 0 to 1."""
    return np.concatenate([np.linspace(0, 1, len(sequence)) for sequence in shown])


STARTS = {
    "mean": _mean_start,
    "k-means": _clusters,
    "k-means in order": partial(_clusters, weight=1.0),
    "random": _random_start,
}


@dataclass(frozen=True)
class Form:
    """How a hidden Markov model of hmmlearn is set up.

    Parameters
    ----------
    passed : int, optional
        A step leads to the same state or to a later one, and passes over so many at most: the
        left-to-right form. Without it a step may lead anywhere: the ergodic form.
    covariance : {"told", "diag", "spherical", "tied"}
        Each state has the spread that is told along each axis, or hmmlearn estimates it.
    starts : tuple of {"mean", "k-means", "k-means in order", "random"}
        From which means expectation-maximisation starts: the demonstrations' own mean, each
        stretched to as many subgoals as there are states; clusters of subgoals by where they lie,
        or also by when they come; or some subgoals. All are numbered by when they come.
    criterion : {"BIC", "AIC", "ICL"}
        What the number of states is chosen by.

    Raises
    ------
    ValueError
        For a choice that there is not.
    """

    passed: int | None = None
    covariance: str = "told"
    starts: tuple = ("mean", "k-means in order")
    criterion: str = "BIC"

    def __post_init__(self):
        if self.passed is not None:
            checked_whole("passed", self.passed)
        check_choice("covariance", self.covariance, COVARIANCES)
        check_choice("criterion", self.criterion, CRITERIA)
        for start in self.starts:
            check_choice("start", start, STARTS)

    def steps(self, size):
        """Which steps a model may take.

        Parameters
        ----------
        size : int
            Its number of states k.

        Returns
        -------
        (k, k) bool array
            From row to column. A demonstration begins where a step from the first state may lead.
        """
        if self.passed is None:
            return np.ones((size, size), bool)
        ahead = np.arange(size) - np.arange(size)[:, None]
        return (ahead >= 0) & (ahead <= self.passed + 1)

    def free_parameters(self, size):
        """How many numbers a model of k states is free to choose.

        Where it may begin, and along which steps it goes: of probabilities that add up to one the
        last is not free, and what is fixed at zero never is. Then two coordinates of each mean, and
        what it has of covariances. hmmlearn's own count takes every step for free.

        Parameters
        ----------
        size : int
            k.

        Returns
        -------
        int
        """
        choices = self.steps(size).sum(axis=1) - 1
        return int(choices[0] + choices.sum() + 2 * size + COVARIANCES[self.covariance](size))


COVARIANCES = {
    "told": lambda k: 0,
    "diag": lambda k: 2 * k,
    "spherical": lambda k: k,
    "tied": lambda k: 3,
}
"""How many free numbers the covariances of k states have."""
CRITERIA = ("BIC", "AIC", "ICL")
ERGODIC, LEFT_TO_RIGHT = Form(criterion="AIC"), Form(passed=1)
"""The two forms at their best: those that do best of all in `benchmarks/structure.py`."""
PSEUDO = 5
"""How many subgoals the expected spread counts as where covariances are estimated, as in merging."""
PATIENCE = 2
"""The search for the number of states ends after so many that are no better."""


def gaussian_hmm(sequences, form=ERGODIC, seed=0, spread=0.15):
    """Subgoals by hidden Markov models of hmmlearn, set up as their own advocate would.

    They are told the spread that merging is told. The number of states is sought from the median
    number of subgoals up and down, as long as the criterion gets better; expectation-maximisation
    runs from each start, and the best counts. The task is the sequence of states that the most
    demonstrations follow (Viterbi, repetitions dropped; states that no more than half of them visit
    left out), the shorter where several do.

    Parameters
    ----------
    sequences : sequence of (K, 2) array_like
        Subgoals of each demonstration in m; one demonstration at least, of one subgoal at least.
    form : Form
    seed : int
        Of what is drawn for the starts.
    spread : float
        Expected standard deviation of a subgoal along each axis in m.

    Returns
    -------
    (L, 2) float array
        In m; none where every model broke down.

    Raises
    ------
    ImportError
        If hmmlearn is not installed.
    ValueError
        For no demonstrations, or a spread that is not positive.
    """
    need("baseline")
    check_positive("spread", spread)
    if not len(sequences) or not all(map(len, sequences)):
        raise ValueError("sequences must hold a demonstration at least, each of one subgoal at least")
    from threadpoolctl import threadpool_limits

    shown = [checked_positions(f"demonstration {k}", each) for k, each in enumerate(sequences)]
    middle, most = int(np.median([len(each) for each in shown])), sum(map(len, shown))
    # Matrices this small are slower with several BLAS threads, many times so where these wait for a
    # busy processor. Only what is loaded is limited: hmmlearn is, by now.
    with threadpool_limits(1):
        _, model = _least(lambda size: _best(shown, form, size, seed, spread), middle, most)
        return model.means_[list(_common_path(model, shown))] if model else np.zeros((0, 2))


def _least(found, middle, most):
    """The least of found(size), (score, model), from the middle size up and down while it falls."""
    tried = {middle: found(middle)}
    for step in (1, -1):
        size, idle, least = middle, 0, tried[middle][0]
        while idle < PATIENCE and 1 <= size + step <= most:
            size += step
            tried[size] = found(size)
            idle = 0 if tried[size][0] < least else idle + 1
            least = min(least, tried[size][0])
    return min(tried.values(), key=lambda each: each[0])


def _best(shown, form, size, seed, spread):
    """The best score over all starts, inf where all broke down, and its model."""
    random, points = np.random.RandomState(seed), np.concatenate(shown)
    best, lengths = (np.inf, None), [len(each) for each in shown]
    for start in form.starts:
        model = _blank(STARTS[start](shown, size, random), form, spread)
        try:
            with np.errstate(all="ignore"):
                score = _score(model.fit(points, lengths), points, lengths, form)
        except ValueError:  # hmmlearn's word for an expectation-maximisation that broke down
            continue
        if score < best[0]:
            best = score, model
    return best


def _blank(means, form, spread):
    """A model before it learns: narrow, and every step that it may take as likely."""
    from hmmlearn.hmm import GaussianHMM

    logging.getLogger("hmmlearn").setLevel(logging.ERROR)  # it warns of every run that stops early
    size, steps = len(means), form.steps(len(means)).astype(float)
    prior, covariances = _narrow(form.covariance, size, spread)
    fitted = "stm" if form.covariance == "told" else "stmc"
    expected = prior | {"transmat_prior": 1 + 1e-3 * steps}
    model = GaussianHMM(size, n_iter=100, init_params="", params=fitted, **expected)
    model.transmat_ = steps / steps.sum(axis=1, keepdims=True)
    model.startprob_, model.means_ = model.transmat_[0], np.array(means)
    model.covars_ = covariances
    return model


def _narrow(covariance, size, spread):
    """What hmmlearn is to expect of covariances, as options, and those of the told spread."""
    kind = "spherical" if covariance == "told" else covariance
    # A covariance is (prior + sum of squares) / (weight - 1 + n), a tied one with 2 in place of 1.
    one, shape = {
        "diag": (1, np.ones((size, 2))),
        "spherical": (1, np.ones(size)),
        "tied": (2, np.eye(2)),
    }[kind]
    prior = PSEUDO * spread**2 * (np.eye(2) if kind == "tied" else 1)
    return {
        "covariance_type": kind,
        "covars_weight": PSEUDO + one,
        "covars_prior": prior,
    }, spread**2 * shape


def _score(model, points, lengths, form):
    """The criterion of a fitted model, the less the better; inf where it is no number."""
    price = 2 if form.criterion == "AIC" else np.log(len(points))
    score = price * form.free_parameters(len(model.means_)) - 2 * model.score(points, lengths)
    if form.criterion == "ICL":
        share = model.predict_proba(points, lengths)
        score -= 2 * np.sum(share * np.log(np.maximum(share, 1e-300)))
    return score if np.isfinite(score) else np.inf


def _common_path(model, shown):
    """The states of the task in order, as most of the demonstrations go through them."""
    paths = [_path(model, sequence) for sequence in shown]
    visits = Counter(chain.from_iterable(map(set, paths)))
    task = {state for state, number in visits.items() if 2 * number > len(paths)}
    common = Counter(tuple(filter(task.__contains__, path)) for path in paths)
    return min(common, key=lambda path: (-common[path], len(path), path))


def _path(model, sequence):
    return [state for state, _ in groupby(model.predict(sequence))]


# ---- the comparison


METHODS = {
    "merging": merged,
    "ergodic HMM": gaussian_hmm,
    "left-to-right HMM": partial(gaussian_hmm, form=LEFT_TO_RIGHT),
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


def task_of(task, seed):
    """The true subgoals of a task, by its name or by their number.

    Parameters
    ----------
    task : str or int
        A name in `TASKS`; or the number K of subgoals of one that is drawn: each 1 to 2 m from the
        one before, turning by up to 135 degrees, and no two nearer than 0.75 m, five times the
        spread that methods expect.
    seed : int
        Of the draw.

    Returns
    -------
    (K, 2) float array
        In m.
    """
    if isinstance(task, str):
        return np.array(TASKS[task])
    random = np.random.default_rng([seed, task, 15])
    places = np.zeros((0, 2))
    while len(places) < task:
        places = _next_place(places, random)
    return places


def _next_place(places, random):
    """Places (M, 2) and one more; if it comes too near to one, it and the last are taken back."""
    if not len(places):
        return np.zeros((1, 2))
    way = places[-1] - places[-2] if len(places) > 1 else np.ones(2)
    angle = np.arctan2(way[1], way[0]) + random.uniform(-0.75, 0.75) * np.pi
    drawn = places[-1] + random.uniform(1, 2) * np.array([np.cos(angle), np.sin(angle)])
    if np.linalg.norm(places - drawn, axis=1).min() < APART:
        return places[: max(len(places) - 1, 1)]
    return np.vstack([places, drawn])


APART = 0.75
"""m between any two subgoals of a task that is drawn."""


def study(tasks=TASKS, numbers=(2, 5, 10), spreads=(0.05, 0.15), seeds=range(100), methods=METHODS, jobs=1):
    """Let every method find every task from the same demonstrations, 30 % with a subgoal too many.

    Parameters
    ----------
    tasks : iterable of str or int
        Names in `TASKS`, or numbers of subgoals, as for `task_of`.
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
    truth = task_of(task, seed)
    demonstrations = draw_demonstrations(truth, n, spread, seed=seed)
    begin = process_time()
    found = find(demonstrations)
    taken = process_time() - begin
    case = {"task": task, "n": n, "spread": spread, "seed": seed, "method": method}
    return case | {"length": len(found)} | judge(found, truth) | {"seconds": taken}


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
