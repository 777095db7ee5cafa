"""Experiments on the environment configuration (Sec. IV): each is a function of a seed that returns
its numbers.

See `dollop.replication.claims` for what is asked of them.
"""

from functools import cache, lru_cache
from itertools import permutations
from math import nan
from time import perf_counter

import numpy as np
from scipy.optimize import linprog

from dollop.environment import integer_costs
from dollop.lab.person import figure_eight
from dollop.lab.scenes import Scene, figure_eight_scene, rearranged
from dollop.matching import match
from dollop.observation import observe
from dollop.replication import recordings
from dollop.replication.claims.performing import clear_of, is_eight, run_plainly
from dollop.replication.layouts import random_layouts, right_indices
from dollop.task import anchors

# ---- matching


def least_time(do, times=3):
    """Time in s that something takes, the best of three."""
    taken = []
    for _ in range(times):
        start = perf_counter()
        do()
        taken.append(perf_counter() - start)
    return min(taken)


def matching_time(seed, objects=50):
    """Time in s that the paper's matching takes for fifty objects, two hundred corners."""
    before, after, _ = random_layouts(objects, np.random.default_rng(seed), room=40.0)
    return {"seconds": least_time(lambda: match(before, after, method="literal"))}


def optimal(seed):
    """The Hungarian method beside linear programming (ten objects) and beside every bijection (two
    objects).
    """
    rng = np.random.default_rng([seed, 16])
    ten, two = (random_layouts(objects, rng, room=room)[:2] for objects, room in ((10, 12.0), (2, 6.0)))
    costs = integer_costs(ten[0].corners, ten[1].corners)
    by_program = assignment_program(costs)
    few = integer_costs(two[0].corners, two[1].corners)
    best = few[np.arange(8), bijections(8)].sum(axis=1).min()
    return {
        "program_off": abs(by_program.fun - match(*ten, method="literal").cost),
        "fractional": np.abs(by_program.x - by_program.x.round()).max(),
        "brute_force_off": abs(best - match(*two, method="literal").cost),
    }


def assignment_program(costs):
    """The assignment of least cost (N, N) as a linear program: shares in [0, 1], each row and each
    column sums to 1.
    """
    n = len(costs)
    rows, columns = np.kron(np.eye(n), np.ones(n)), np.kron(np.ones(n), np.eye(n))
    return linprog(costs.ravel(), A_eq=np.vstack([rows, columns]), b_eq=np.ones(2 * n), bounds=(0, 1))


@cache
def bijections(n):
    """Every bijection of n with n, (n!, n)."""
    return np.array(list(permutations(range(n))))


def counterintuitive(seed, layouts=10):
    """How often a matching of three boxes that each moved a little is not the obvious one, and
    whether in ten once.
    """
    rng = np.random.default_rng([seed, 7])
    numbers = {}
    for name, noise in (("exact", 0.0), ("seen", 0.05)):
        drawn = [random_layouts(3, rng, noise=noise) for _ in range(layouts)]
        for method in ("literal", "robust"):
            wrong = [
                (match(before, after, method=method).indices != right_indices(partners)).any()
                for before, after, partners in drawn
            ]
            numbers |= {f"{method}_{name}": np.mean(wrong), f"{method}_{name}_once": float(any(wrong))}
    return numbers


@lru_cache(maxsize=1)
def moved_eight(seed):
    """Scene with the cans moved by some 0.4 m, and twice what the laser sees of it."""
    from dollop.lab import watch

    scene = rearranged(figure_eight_scene(), np.random.default_rng([seed, 8]), reach=0.4, spacing=1.0)
    seen = [observe(watch(scene, [seed, 8, k]).log, recordings.background_map()).environment for k in range(2)]
    return scene, *seen


def consistent(seed):
    """Whether two looks at the same moved cans give the same matching, and how long one takes."""
    before, looks = recordings.figure_eight_task(seed).environment, in_one_order(moved_eight(seed)[1:])
    numbers = {"seconds": least_time(lambda: match(before, looks[0], method="literal"))}
    for method in ("literal", "robust"):
        first, second = (match(before, now, method=method).indices for now in looks)
        numbers[method] = float(np.array_equal(first, second))
    return numbers


def in_one_order(environments):
    """Environments with their boxes from left to right, so that indices mean the same."""
    return [type(each)(each.boxes[np.argsort(each.boxes[:, 0])]) for each in environments]


def counted(seed):
    """Share of demonstrations, a figure-eight and three slaloms, in which the robot sees another
    number of objects.
    """
    eight = len(recordings.figure_eight_task(seed).environment)
    slaloms = [len(recordings.slalom_demonstration(k, seed).environment) for k in range(3)]
    return {"other_number": np.mean([eight != 2, *(number != 4 for number in slaloms)])}


# ---- subgoals that move with the objects


def moved(seed):
    """Whether the task adapted to moved cans is still a figure-eight, and whether law and robot
    keep clear of them.
    """
    scene, now, _ = moved_eight(seed)
    shown = recordings.figure_eight_task(seed)
    try:
        task = shown.adapt(now)
    except ValueError:  # an ambiguous matching: it asks instead of guessing
        return {"refused": 1.0, "eight": nan, "law_clear": nan, "robot_clear": nan, "subgoals_moved_m": nan}
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 9]))
    run = run_plainly(task, start)
    return {
        "refused": 0.0,
        "eight": is_eight(task.law, scene),
        "law_clear": float(clear_of(task.law, scene) > 0),
        "robot_clear": float(run.finished and not run.collisions),
        "subgoals_moved_m": np.linalg.norm(task.law.subgoals - shown.law.subgoals, axis=1).mean(),
    }


def single(seed):
    """How far laws are from what a user walks when one can has moved: subgoals tied to objects, and
    moved as a whole.

    As a whole: by one scaling and one shift of the trajectory, those that carry the cans best to
    where they are now; or by a turn as well. Beside them the law that nobody adapted.
    """
    walks, scene, now = one_can_moved(seed)
    task = recordings.figure_eight_task(seed)
    matching = match(task.environment, now)
    law, partners = task.law, matching.indices[::4] // 4
    before, after = task.environment.centres[partners >= 0], now.centres[partners[partners >= 0]]

    def error(law):
        return np.mean([law.error(walk) for walk in walks])

    adapted = error(task.adapt(now, matching).law)
    return {
        "adapted_m": adapted,
        "scaled_more_m": error(moved_as_a_whole(law, *scaling(before, after))) - adapted,
        "turned_more_m": error(moved_as_a_whole(law, *similarity(before, after))) - adapted,
        "left_more_m": error(law) - adapted,
    }


def one_can_moved(seed):
    """Three figure-eights (N, 2) as a user walks them when one can has moved by some 0.4 m, the
    scene, and its look.
    """
    from dollop.lab import watch

    for k in range(100):
        rng = np.random.default_rng([seed, 17, k])
        positions = figure_eight_scene().positions.copy()
        positions[rng.integers(2)] += rng.normal(0, 0.4, 2)
        try:
            scene = Scene(figure_eight_scene().kinds, positions)
            walks = [figure_eight(scene, rng, laps=1).positions[::5] for _ in range(3)]
        except ValueError:  # no room to walk round this one
            continue
        return walks, scene, observe(watch(scene, [seed, 17]).log, recordings.background_map()).environment
    raise RuntimeError("no layout with room for a figure-eight in 100 draws")


def scaling(before, after):
    """The factor and the shift, as complex numbers, with which before * factor + shift is nearest
    to after.
    """
    x, y = (points @ (1, 1j) for points in (before, after))
    factor = ((x - x.mean()).conj() @ (y - y.mean())).real / (np.abs(x - x.mean()) ** 2).sum()
    return factor, y.mean() - factor * x.mean()


def similarity(before, after):
    """As `scaling`, with a turn: the factor is complex."""
    x, y = (points @ (1, 1j) for points in (before, after))
    factor = (x - x.mean()).conj() @ (y - y.mean()) / (np.abs(x - x.mean()) ** 2).sum()
    return factor, y.mean() - factor * x.mean()


def moved_as_a_whole(law, factor, shift):
    """The law with all its places scaled, turned and shifted together."""
    z = anchors(law) @ (1, 1j) * factor + shift
    start, *subgoals = np.column_stack([z.real, z.imag])
    return law.with_subgoals(subgoals, start, turned=True)
