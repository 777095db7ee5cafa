"""Sec. IV timed: matching 8 and 1,000 corners, associating and relocating, beside plain Python in the same run.

python -m benchmarks environment
"""

from itertools import permutations
from math import ceil, hypot

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.timing import row, seconds
from dollop.association import associate
from dollop.environment import Environment
from dollop.matching import match


def scene(objects, seed=0):
    """Two environments: boxes on a loose grid, each moved by 0.1 m, their sizes off by 5 cm, in another order."""
    rng = np.random.default_rng(seed)
    side = ceil(objects**0.5)
    centres = 2.0 * np.stack(np.divmod(np.arange(objects), side), axis=1) + rng.uniform(-0.6, 0.6, (objects, 2))
    moved = rng.permutation(centres + rng.normal(0, 0.1, centres.shape))
    halves = (0.4 + rng.uniform(-0.05, 0.05, (2, objects, 2))) / 2
    return [Environment(np.hstack([c - h, c + h])) for c, h in zip((centres, moved), halves, strict=True)]


def plain_forces(corners):
    forces = []
    for m, (x, y) in enumerate(corners):
        fx = fy = 0.0
        for n, (u, v) in enumerate(corners):
            if n != m:
                distance = hypot(u - x, v - y)
                fx, fy = fx + (u - x) / distance**3, fy + (v - y) / distance**3
        forces.append((fx, fy))
    return forces


def plain_costs(before, after):
    forces_i, forces_j = (plain_forces(environment.corners.tolist()) for environment in (before, after))
    return [[ceil(1e3 * hypot(fx - gx, fy - gy)) for gx, gy in forces_j] for fx, fy in forces_i]


def plain_permutations(before, after):
    """The best of all bijections, one by one: 40,320 for eight corners."""
    costs = plain_costs(before, after)
    return min(permutations(range(len(costs))), key=lambda p: sum(row[n] for row, n in zip(costs, p, strict=True)))


def plain_assignment(before, after):
    """Forces and costs in plain loops, the assignment (without margin) by scipy."""
    return linear_sum_assignment(plain_costs(before, after))[1]


def plain_relocate(subgoals, before, after, m=4):
    """Associate and relocate in plain loops."""
    corners, moved, found = before.corners.tolist(), after.corners.tolist(), []
    for x, y in subgoals.tolist():
        near = sorted(((x - u) ** 2 + (y - v) ** 2, k) for k, (u, v) in enumerate(corners))[:m]
        weights = [1 / (square + 0.05**2) for square, _ in near]
        sums = [
            sum(w * (moved[k][axis] + (x, y)[axis] - corners[k][axis]) for w, (_, k) in zip(weights, near, strict=True))
            for axis in (0, 1)
        ]
        found.append([total / sum(weights) for total in sums])
    return found


def run():
    """Time matching and association.

    Returns
    -------
    list of dict
    """
    two, many = scene(2), scene(250)
    subgoals = np.random.default_rng(0).uniform(0, 30, (200, 2))
    brute, _ = seconds(lambda: plain_permutations(*two), 3)
    loops, _ = seconds(lambda: plain_assignment(*many), 1)
    rows = []
    for method, bound in (("literal", 2e-4), ("robust", 1e-2)):
        few = seconds(lambda method=method: match(*two, method=method), 100)[0]
        lots = seconds(lambda method=method: match(*many, method=method), 5)[0]
        rows.append(row(f"match 8 corners, {method}", few, brute, bound))
        rows.append(row(f"match 1000 corners, {method}", lots, loops, 0.5))
    tied = seconds(lambda: associate(subgoals, many[0]).relocate(many[1]), 20)[0]
    plain = seconds(lambda: plain_relocate(subgoals, *many), 3)[0]
    return [*rows, row("associate and relocate 200 subgoals, 1000 corners", tied, plain, 0.5)]
