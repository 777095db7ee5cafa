"""Other people's methods beside ours: where does a task go when its objects stand elsewhere?

TP-GMM is told where the objects are, ProMP and DMP where the way begins and ends; each is set up as
its own advocate would. All of them get the same walks, and say what they would walk in a layout in
which nobody has walked. What the person would have done there is known: the tasks are drawn
(`dollop.lab.tasks`).
"""

from dataclasses import dataclass, replace
from itertools import chain, product

import joblib
import numpy as np
import pandas as pd
from tqdm import tqdm

from dollop.checks import need
from dollop.environment import Environment
from dollop.lab.tasks import draw_layouts, draw_task, size_of, walked
from dollop.matching import Matching
from dollop.pose import rotation
from dollop.task import Demonstration, learn
from dollop.trajectory import distance_to_polyline, resample

__all__ = [
    "DRAWN", "METHODS", "Trial", "dmp", "drawn_trial", "learned", "mean_walk", "median_interval",
    "off_way", "off_way_in_order", "promp", "regression", "study", "summary", "tp_gmm", "warped_distance",
]  # fmt: skip

SAMPLES = 100
"""Of each walk, evenly in time, as the peers are given them, and of what they answer."""
COMPONENTS = (5, 10, 16, 25)
"""Numbers of components that TP-GMM chooses from."""
FLOOR = 0.002
"""Standard deviation that regularises the components of TP-GMM, as a share of the task's size."""
UNITS = 300.0
"""gmr takes determinants below 2e-16 for 2e-16: so walks are 300 units large for it, and as long."""
ITERATIONS, ENOUGH = 60, 1e-4
"""Of expectation-maximisation at most, and the gain in log-likelihood per sample to go on for."""
WEIGHTS, BASIS = 50, 20
"""Of a DMP, and of a ProMP, along each axis."""
DOUBT = 0.03
"""Standard deviation of a ProMP's weights beside what walks show, as a share of the task's size."""


@dataclass(frozen=True, eq=False)
class Trial:
    """What the methods are given, and the truth to judge them by.

    Attributes
    ----------
    demonstrations : list of N Demonstration
        Of one walk each, samples evenly in time, among M objects in the same order.
    environment : Environment
        Where these objects stand now.
    way : (L, 2) float array
        What the person would walk there, in m. Methods are told its ends at most.
    again : (L, 2) float array, optional
        Another walk of the same person there, in m.
    """

    demonstrations: list
    environment: Environment
    way: np.ndarray
    again: np.ndarray = None

    @property
    def walks(self):
        """List of (L_k, 2) float arrays: what was walked, in m."""
        return [shown.trajectory for shown in self.demonstrations]

    @property
    def environments(self):
        """List of Environment: where the objects stood."""
        return [shown.environment for shown in self.demonstrations]

    @property
    def ends(self):
        """(2, 2) float array: where the way truly begins and ends, in m."""
        return self.way[[0, -1]]


# ---- the methods


def learned(demonstrations, environment, method="anchored"):
    """Where the task goes that `dollop.learn` makes of demonstrations, adapted to the objects now.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        Among M objects in the same order.
    environment : Environment
        Of the same M objects.
    method : {"anchored", "paper"}

    Returns
    -------
    (L, 2) float array
        In m.
    """
    same = Matching.identity(len(environment))
    task = learn(demonstrations, matchings=[same] * len(demonstrations), method=method)
    return task.adapt(environment, same).law.response()


def mean_walk(walks):
    """The mean of the walks, whatever the objects.

    Parameters
    ----------
    walks : sequence of (L_k, 2) float arrays
        In m.

    Returns
    -------
    (SAMPLES, 2) float array
        In m.

    Examples
    --------
    >>> mean_walk([np.zeros((5, 2)), np.ones((9, 2))])[0].tolist()
    [0.5, 0.5]
    """
    return np.mean([_in_time(walk) for walk in walks], axis=0)


def _in_time(walk):
    """(SAMPLES, 2): a walk at even steps of time."""
    walk = np.asarray(walk, float)
    at = np.linspace(0, len(walk) - 1, SAMPLES)
    return np.stack([np.interp(at, np.arange(len(walk)), axis) for axis in walk.T], axis=1)


def dmp(walks, ends, scale=1.0, stiffness=25.0):
    """A dynamic movement primitive (movement_primitives), told where the way begins and ends.

    It has 50 weights and scales smoothly with its goal (Pastor et al. 2009). It imitates one path:
    the mean of the walks, or the walk whose ends are nearest to the wanted ones, whichever foretells
    walks that are left out better. A scale multiplies its weights: with ends that are scaled alike
    the whole way is, also where it ends where it begins and its ends alone tell no scale.

    Parameters
    ----------
    walks : sequence of (L_k, 2) float arrays
        In m.
    ends : (2, 2) array_like
        First and last place in m.
    scale : float
        Of the way between them.
    stiffness : float
        Of its spring and, critically, its damper: alpha_y. A path that begins at full speed it
        follows late, the later the softer it is.

    Returns
    -------
    (SAMPLES, 2) float array
        In m.

    Raises
    ------
    ImportError
        If movement_primitives is not installed.
    """
    need("peers")
    walks, ends = [_in_time(walk) for walk in walks], np.asarray(ends, float)
    choices = (_mean, _nearest)
    if len(walks) > 2:
        choices = sorted(choices, key=lambda choice: _left_out(walks, choice, stiffness))
    return _imitated(choices[0](walks, ends), ends, scale, stiffness)


def _mean(walks, ends):
    return np.mean(walks, axis=0)


def _nearest(walks, ends):
    return min(walks, key=lambda walk: np.linalg.norm(walk[[0, -1]] - ends))


def _left_out(walks, choice, stiffness):
    """Mean distance of each walk, left out, to what is made of the others, in m."""
    errors = []
    for k, walk in enumerate(walks):
        ends = walk[[0, -1]]
        made = _imitated(choice(walks[:k] + walks[k + 1 :], ends), ends, stiffness=stiffness)
        errors.append(np.linalg.norm(made - walk, axis=1).mean())
    return np.mean(errors)


def _imitated(path, ends, scale=1.0, stiffness=25.0):
    from movement_primitives.dmp import DMP

    springs = {"alpha_y": stiffness, "beta_y": stiffness / 4}
    primitive = DMP(2, 1.0, 1 / (SAMPLES - 1), WEIGHTS, smooth_scaling=True, **springs)
    primitive.imitate(np.linspace(0, 1, SAMPLES), path)
    primitive.set_weights(scale * primitive.get_weights())
    primitive.configure(start_y=ends[0], goal_y=ends[1])
    return primitive.open_loop(step_function="rk4")[1]  # not in Cython: it may be built without


def promp(walks, ends):
    """A probabilistic movement primitive (movement_primitives), conditioned on where the way ends.

    On its beginning, too. It has 20 basis functions, and some variance beside what few walks show,
    so that it bends where it has to.

    Parameters
    ----------
    walks : sequence of (L_k, 2) float arrays
        In m.
    ends : (2, 2) array_like
        First and last place in m.

    Returns
    -------
    (SAMPLES, 2) float array
        In m.

    Raises
    ------
    ImportError
        If movement_primitives is not installed.
    """
    need("peers")
    from movement_primitives.promp import ProMP

    walks, ends, t = (
        [_in_time(walk) for walk in walks],
        np.asarray(ends, float),
        np.linspace(0, 1, SAMPLES),
    )
    primitive = ProMP(2, BASIS)
    primitive.imitate([t] * len(walks), walks)
    doubt = (DOUBT * _size(walks)) ** 2 * np.eye(2 * BASIS)
    primitive.from_weight_distribution(primitive.weight_mean, primitive.weight_cov + doubt)
    bound = primitive.condition_position(ends[0], t=0).condition_position(ends[1], t=1)
    return bound.mean_trajectory(t)


def _size(walks):
    return np.mean([size_of(walk) for walk in walks])


# ---- TP-GMM


def tp_gmm(walks, environments, environment, components=COMPONENTS):
    """A task-parameterised Gaussian mixture (Calinon 2016) on gmr, told where the objects stand.

    Time and place as seen from all objects are one mixture; its number of components is chosen by
    BIC. Regression over time tells from each object where the way goes, and how sure that is; their
    product is the way. Objects whose direction is known are frames that turn.

    Parameters
    ----------
    walks : sequence of N (L_k, 2) float arrays
        In m.
    environments : sequence of N Environment
        Of M objects in the same order.
    environment : Environment
        Of the same M objects.
    components : sequence of int
        Numbers of components to choose from.

    Returns
    -------
    (SAMPLES, 2) float array
        In m.

    Raises
    ------
    ImportError
        If gmr or movement_primitives is not installed.
    """
    need("peers")
    walks = [_in_time(walk) for walk in walks]
    unit, t = _size(walks) / UNITS, np.linspace(0, UNITS, SAMPLES)
    pairs = zip(walks, environments, strict=True)
    seen = np.concatenate([_stacked(t, _seen(walk, stood) / unit) for walk, stood in pairs])
    mixtures = [_mixture(seen, count) for count in components]
    mixture = min(mixtures, key=lambda found: _bic(found, seen))
    precision, pull = np.zeros((SAMPLES, 2, 2)), np.zeros((SAMPLES, 2))
    for m, (origin, turn) in enumerate(zip(environment.centres, _turns(environment), strict=True)):
        means, covariances = regression(mixture, slice(3 * m, 3 * m + 3), t)
        sure = np.linalg.inv(turn @ covariances @ turn.T)
        precision += sure
        pull += np.einsum("tij,tj->ti", sure, means @ turn.T + origin / unit)
    return unit * np.linalg.solve(precision, pull[..., None])[..., 0]


def _turns(environment):
    """(M, 2, 2): the rotation of each frame; none where no direction is known."""
    return np.array([rotation(angle) for angle in np.nan_to_num(environment.directions)])


def _seen(walk, environment):
    """(L, M, 2): a walk as seen from every object, in m."""
    return np.einsum("mji,lmj->lmi", _turns(environment), walk[:, None] - environment.centres)


def _stacked(t, seen):
    """(L, 3M): time and place as seen from the first object, then from the second, and so on."""
    times = np.broadcast_to(t[:, None, None], (*seen.shape[:2], 1))
    return np.concatenate([times, seen], axis=2).reshape(len(t), -1)


def _mixture(seen, count):
    """gmr's mixture of so many components of stacked samples (L, 3M).

    Within a component, frames are independent. It begins from equal parts of the time, as TP-GMM
    does, and is regularised after each step.
    """
    from gmr import GMM

    part = np.minimum((seen[:, 0] / UNITS * count).astype(int), count - 1)
    blocks = np.kron(np.eye(seen.shape[1] // 3), np.ones((3, 3)))
    floor = (FLOOR * UNITS) ** 2 * np.eye(seen.shape[1])
    members = [seen[part == k] for k in range(count)]
    covariances = np.array([np.cov(each.T, bias=True) for each in members])
    priors, means = np.full(count, 1 / count), np.array([each.mean(axis=0) for each in members])
    before = -np.inf
    for _ in range(ITERATIONS):
        mixture = GMM(count, priors, means, blocks * covariances + floor, random_state=0)
        likelihood = _log_likelihood(mixture, seen)
        if likelihood - before < ENOUGH * len(seen):
            break
        before = likelihood
        after = GMM(count, priors, means, mixture.covariances.copy(), random_state=0)
        after.from_samples(seen, n_iter=1)
        priors, means, covariances = after.priors, after.means, after.covariances
    return mixture


def _log_likelihood(mixture, seen):
    return np.log(np.maximum(mixture.to_probability_density(seen), 1e-300)).sum()


def _bic(mixture, seen):
    """Bayesian information criterion: nine numbers for each frame of a component, and its share."""
    count = mixture.n_components
    numbers = count * (3 * seen.shape[1] + 1) - 1
    return numbers * np.log(len(seen)) - 2 * _log_likelihood(mixture, seen)


def regression(mixture, block, t):
    """Gaussian mixture regression: place over time, from one frame.

    As gmr's `condition` and `to_mvn`, for all times at once.

    Parameters
    ----------
    mixture : gmr.GMM
        Of stacked samples.
    block : slice
        Of the frame's time and place.
    t : (L,) float array
        In units of time.

    Returns
    -------
    means : (L, 2) float array
        In units of length.
    covariances : (L, 2, 2) float array
    """
    centre, spread = mixture.means[:, block], mixture.covariances[:, block, block]
    late, variance = t[:, None] - centre[:, 0], spread[:, 0, 0]
    log = np.log(mixture.priors) - late**2 / variance / 2 - np.log(variance) / 2
    weights = np.exp(log - log.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    slope = spread[:, 1:, 0] / variance[:, None]
    each = centre[:, 1:] + late[..., None] * slope
    left = spread[:, 1:, 1:] - slope[:, :, None] * spread[:, None, 0, 1:]
    means = np.einsum("lk,lki->li", weights, each)
    apart = each - means[:, None]
    between = np.einsum("lk,lki,lkj->lij", weights, apart, apart)
    return means, np.einsum("lk,kij->lij", weights, left) + between


# ---- the comparison


METHODS = {
    "anchored": lambda trial: learned(trial.demonstrations, trial.environment),
    "paper": lambda trial: learned(trial.demonstrations, trial.environment, "paper"),
    "TP-GMM": lambda trial: tp_gmm(trial.walks, trial.environments, trial.environment),
    "ProMP": lambda trial: promp(trial.walks, trial.ends),
    "DMP": lambda trial: dmp(trial.walks, trial.ends),
    "mean": lambda trial: mean_walk(trial.walks),
}
"""From a `Trial` to what each method would walk, (L, 2) in m."""
DRAWN = METHODS | {"walked again": lambda trial: trial.again}
"""The same, and the floor: the same person, walking it again."""

MOST = 10
"""Walks drawn of each task: fewer demonstrations are the first of them."""


def drawn_trial(seed, objects=4, count=MOST, kind="anywhere"):
    """Draw a task, so many walks of it, each in its own layout, and a layout that is new.

    With one demonstration more it is the same task, and the same demonstrations and one.

    Parameters
    ----------
    seed : int
    objects : int
        M.
    count : int
        Number of demonstrations, at most `MOST`.
    kind : {"anywhere", "moved", "still"}
        Of the layouts, see `draw_layouts`.

    Returns
    -------
    Trial
    """
    rng = np.random.default_rng((seed, objects))
    task = draw_task(objects, rng)
    *shown, now = draw_layouts(objects, MOST + 1, rng, kind)
    walks = [(walked(task, centres, rng), task.environment(centres)) for centres in shown]
    given = [Demonstration(*pair) for pair in walks[:count]]
    return Trial(given, task.environment(now), task.way(now), walked(task, now, rng))


def off_way(found, way):
    """How far what a method would walk is from what the person would.

    Parameters
    ----------
    found : (L, 2) array_like
        In m.
    way : (K, 2) float array
        At equal distances, in m.

    Returns
    -------
    float
        Mean distance of the way's samples from the nearest places on the line that was found, in %
        of the way's size.

    Examples
    --------
    >>> way = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    >>> round(off_way(way + [0.0, 0.1], way), 9)
    5.0
    """
    return float(100 * distance_to_polyline(way, found).mean() / size_of(way))


def off_way_in_order(found, way):
    """How far off, place by place in their order: `off_way` for what may swing far between places.

    Parameters
    ----------
    found : (L, 2) array_like
        In m.
    way : (K, 2) float array
        At equal distances, in m.

    Returns
    -------
    float
        `warped_distance` of the two, both at equal distances, in % of the way's size.

    Examples
    --------
    Out and back once more is near every place, and yet another way.

    >>> way = np.linspace([0.0, 0.0], [3.0, 0.0], 31)
    >>> longer = np.array([[0.0, 0.0], [0.0, 2.0], [0.0, 0.0], [3.0, 0.0]])
    >>> round(off_way(longer, way), 6), off_way_in_order(longer, way) > 10
    (0.0, True)
    """
    return float(100 * warped_distance(resample(found, len(way)), way) / size_of(way))


def warped_distance(one, other):
    """Mean distance of two paths along their dynamic-time-warping path, the one of least total.

    Parameters
    ----------
    one, other : (L, 2) and (K, 2) float array
        In m.

    Returns
    -------
    float
        In m.
    """
    distances = np.linalg.norm(one[:, None] - other, axis=2)
    before = [(0.0, 0)] + [(np.inf, 0)] * len(other)
    for row in distances.tolist():
        now = [(np.inf, 0)]
        for j, distance in enumerate(row):
            total, length = min(before[j], before[j + 1], now[j], key=lambda end: end[0])
            now.append((total + distance, length + 1))
        before = now
    total, length = before[-1]
    return total / length


def study(
    objects=(4,),
    numbers=(1, 2, 3, 5, 10),
    seeds=range(40),
    kinds=("anywhere",),
    methods=DRAWN,
    jobs=1,
    measure=off_way,
):
    """Let every method say where drawn tasks go, from the same demonstrations.

    Parameters
    ----------
    objects : iterable of int
        Numbers of objects.
    numbers : iterable of int
        Numbers of demonstrations.
    seeds : iterable of int
        One for each task.
    kinds : iterable of str
        Of layouts, see `draw_layouts`.
    methods : dict
        Functions like those in `METHODS`, by name.
    jobs : int
        How many tasks are worked on at once; the numbers stay the same.
    measure : callable
        `off_way` or `off_way_in_order`.

    Returns
    -------
    pandas.DataFrame
        One row per number of `objects`, `kind`, number `n`, `seed` and `method`: its `error` by the
        measure, infinite where the method refused, and why it did as `refused`.
    """
    cases = tqdm(list(product(objects, kinds, seeds)), desc="drawn tasks")
    calls = (joblib.delayed(_tried)(*case, tuple(numbers), methods, measure) for case in cases)
    return pd.DataFrame(chain.from_iterable(joblib.Parallel(n_jobs=jobs)(calls)))


def _tried(objects, kind, seed, numbers, methods, measure):
    """The rows of one task. Its demonstrations are shared, so that each is segmented once."""
    whole, rows = drawn_trial(seed, objects, max(numbers), kind), []
    for n, (method, answer) in product(numbers, methods.items()):
        row = {"objects": objects, "kind": kind, "n": n, "seed": seed, "method": method}
        few = replace(whole, demonstrations=whole.demonstrations[:n])
        rows.append(row | _judged(answer, few, measure))
    return rows


def _judged(answer, trial, measure):
    """How far off a method's answer is, and why there is none where it refuses."""
    try:
        return {"error": measure(answer(trial), trial.way), "refused": ""}
    except ValueError as error:
        return {"error": np.inf, "refused": str(error)}


def median_interval(values, level=0.95, draws=2000):
    """Median of values and its interval, by bootstrap.

    Parameters
    ----------
    values : (N,) array_like
    level : float
    draws : int
        Samples with replacement, always the same.

    Returns
    -------
    median, low, high : float

    Examples
    --------
    One refusal, of infinite error, among ten moves the upper end at most.

    >>> median_interval([1, 2, 2, 2, 2, 3, 3, 3, 4, np.inf])
    (2.5, 2.0, 3.5)
    """
    values = np.asarray(values, float)
    again = np.random.default_rng(0).integers(len(values), size=(draws, len(values)))
    ends = (1 - level) / 2, (1 + level) / 2
    low, high = np.quantile(np.median(values[again], axis=1), ends, method="nearest")
    return float(np.median(values)), float(low), float(high)


def summary(table):
    """Median error and its interval.

    Parameters
    ----------
    table : pandas.DataFrame
        From `study`.

    Returns
    -------
    pandas.DataFrame
        Columns median, low and high in % of the task's size, how many `tasks`, and how many of them
        were `refused`, by kind, objects, method and n.
    """
    rows = []
    for case, cell in table.groupby(["kind", "objects", "method", "n"], sort=False):
        found = dict(zip(("median", "low", "high"), median_interval(cell.error), strict=True))
        case = dict(zip(("kind", "objects", "method", "n"), case, strict=True))
        rows.append(case | found | {"tasks": len(cell), "refused": int(np.isinf(cell.error).sum())})
    return pd.DataFrame(rows).set_index(["kind", "objects", "method", "n"])
