"""Experiments on learning from several demonstrations (Sec. V): each is a function of a seed that
returns its numbers.

See `dollop.replication.claims` for what is asked of them. Some draw subgoals of a known task, for
only there the truth is known; others use slaloms that were walked, seen by the laser and segmented.
"""

from functools import lru_cache
from math import nan
from types import SimpleNamespace

import numpy as np

from dollop.cdhmm import SubgoalHMM
from dollop.lds import LDS
from dollop.replication import recordings
from dollop.replication.baseline import TASKS, draw_demonstrations, merged
from dollop.replication.claims.performing import run_plainly
from dollop.robot.performing import Unicycle, perform
from dollop.sequenced_lds import SequencedLDS
from dollop.task import Task, learn, members_along
from dollop.trajectory import distance_to_polyline

# ---- subgoals of a known task

SPREAD = 0.15
"""Standard deviation in m of a subgoal along each axis, which merging expects."""


def several(seed, numbers=(1, 2, 5, 10)):
    """Error of the merged subgoals of a slalom from one to ten demonstrations, and how fast it
    falls.

    The same where the learner's model is wrong: subgoals that scatter half or twice as far as it
    expects, or with heavy tails. And of walked slaloms the passing places that a learned law gets
    nearer to.
    """
    truth = np.array(TASKS["slalom"])
    errors = errors_by_number(truth, numbers, lambda n: drawn(truth, n, [seed, n], SPREAD))
    numbers_told = {f"error_{n}_m": error for n, error in errors.items()}
    numbers_told |= {"two_more_than_ten_m": errors[2] - errors[10], "exponent": exponent(errors)}
    for name, spread in (("half", SPREAD / 2), ("twice", 2 * SPREAD)):
        wrong = errors_by_number(truth, (2, 10), lambda n, spread=spread: drawn(truth, n, [seed, n], spread))
        numbers_told[f"{name}_two_more_than_ten_m"] = wrong[2] - wrong[10]
        numbers_told[f"{name}_right"] = float(np.isfinite(wrong[10]))
    wrong = errors_by_number(truth, (2, 10), lambda n: drawn_with_tails(truth, n, [seed, 18, n]))
    numbers_told |= {"tails_two_more_than_ten_m": wrong[2] - wrong[10], "tails_right": float(np.isfinite(wrong[10]))}
    return numbers_told | {"passing_alone_more_m": passing_alone_more(seed)}


def errors_by_number(truth, numbers, draw):
    """Error of the merged subgoals in m for each number n of demonstrations draw(n)."""
    return {n: subgoal_error(merged(draw(n)), truth) for n in numbers}


def exponent(errors):
    """Slope of the error against the number of demonstrations, both logarithmic."""
    found = [(n, error) for n, error in errors.items() if np.isfinite(error)]
    return np.polyfit(*np.log(np.array(found)).T, 1)[0] if len(found) > 1 else nan


def drawn(truth, n, seed, spread):
    """Demonstrations whose subgoals scatter normally, one too many in 30 % of them."""
    return draw_demonstrations(truth, n, spread, seed=seed)


def drawn_with_tails(truth, n, seed):
    """The same with the heavy tails of Student's t of three degrees of freedom, its scale being the
    usual spread.
    """
    rng = np.random.default_rng(seed)
    exact = draw_demonstrations(truth, n, 0.0, seed=rng)
    return [subgoals + SPREAD * rng.standard_t(3, subgoals.shape) for subgoals in exact]


def subgoal_error(found, truth):
    """Mean distance in m of the found subgoals from the true ones, nan where their number is not
    right.
    """
    return np.linalg.norm(found - truth, axis=1).mean() if len(found) == len(truth) else nan


def combined(seed, n=5):
    """Whether merging five demonstrations leaves the task's states and one for each subgoal that is
    no part of it.
    """
    truth = np.array(TASKS["slalom"])
    shown = draw_demonstrations(truth, n, SPREAD, seed=[seed, 19])
    model = SubgoalHMM.fit(shown, SPREAD)
    before, strays = sum(map(len, shown)), sum(len(each) > len(truth) for each in shown)
    return {
        "path_right": float(len(model.most_likely_path()) == len(truth)),
        "states_right": float(len(model.means) == len(truth) + strays),
        "states_more": float(len(model.means) - len(truth) - strays),
        "share_left": len(model.means) / before,
    }


# ---- walked slaloms


@lru_cache(maxsize=1)
def slaloms(seed):
    """Two slaloms in different layouts, learned, and a third in whose layout they are tried.

    Returns
    -------
    SimpleNamespace or None
        `shown` and `kept` (Demonstration), `both` and `alone` (Task, adapted to the third layout),
        `scene` of the third; None where the layouts cannot be matched with confidence.
    """
    *shown, kept = (recordings.slalom_demonstration(k, seed) for k in range(3))
    try:
        both = learn(shown).adapt(kept.environment)
        alone = [Task.of(each).adapt(kept.environment) for each in shown]
    except ValueError:  # an ambiguous matching: it asks instead of guessing
        return None
    scene, _ = recordings.slalom_layout(2, seed)
    return SimpleNamespace(shown=shown, kept=kept, both=both, alone=alone, scene=scene)


def shared(seed):
    """A slalom learned from two demonstrations, in the layout of a third: how far from what was
    walked there.

    Beside it a task from each demonstration alone; and the same subgoals with LDS of one
    demonstration, not shared.
    """
    found = slaloms(seed)
    if found is None:
        return {"both_m": nan, "alone_more_m": nan, "own_lds_more_m": nan}
    error = walked_error(found.both.law, found.kept)
    own = [walked_error(with_own_lds(found.both, found.shown, d), found.kept) for d in range(len(found.shown))]
    return {
        "both_m": error,
        "alone_more_m": np.mean([walked_error(task.law, found.kept) for task in found.alone]) - error,
        "own_lds_more_m": np.mean(own) - error,
    }


def generalize(seed):
    """Whether law and robot pass every cone of a third layout on the user's side, and whether the
    robot touches one.
    """
    found = slaloms(seed)
    if found is None:
        return {"refused": 1.0, "sides_right": nan, "plain_clear": nan, "aware_clear": nan}
    task, grid = found.both, recordings.background_map()
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 20]))
    runs = {"plain": run_plainly(task, start), "aware": perform(task, Unicycle(start), background=grid)}
    clear = {f"{name}_clear": float(run.finished and not run.collisions) for name, run in runs.items()}
    return {"refused": 0.0, "sides_right": sides_right(task, found.kept), **clear}


def walked_error(law, demonstration):
    """Mean distance in m from what was walked to a law's response."""
    return np.mean([law.error(walk) for walk in demonstration.trajectory])


def with_own_lds(task, shown, d):
    """The task's law with the LDS of demonstration d alone wherever it has a part in a shared one."""
    own = []
    for segment, members in zip(task.law.segments, members_along(task.model), strict=True):
        mine = [shown[each].law.segments[i].statistics for each, i in members if each == d]
        own.append(LDS(mine[0], segment.goal) if mine else segment)
    return SequencedLDS(tuple(own), task.law.start, task.law.speeds)


def sides_right(task, kept):
    """Whether the law passes every cone on the side on which the user passed it."""
    (walk,) = kept.trajectory
    law, user = (recordings.passing_sides(path, kept.environment.centres) for path in (task.law.response(), walk))
    return float(np.array_equal(law, user))


def passing_alone_more(seed):
    """How much nearer a law of two slaloms is to where the user intends to pass the cones than laws
    of one, in m.
    """
    found = slaloms(seed)
    if found is None:
        return nan
    places = intended_places(found.scene.positions)
    both, *alone = (distance_to_polyline(places, task.law.response()).mean() for task in (found.both, *found.alone))
    return np.mean(alone) - both


def intended_places(cones, swing=0.75):
    """Where a walker aims to pass cones (N, 2), in turn left and right of them:
    `dollop.lab.person.slalom`'s places.
    """
    along = np.gradient(cones, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    left = np.column_stack([-along[:, 1], along[:, 0]])
    return cones + swing * ((-1.0) ** np.arange(len(cones)))[:, None] * left
