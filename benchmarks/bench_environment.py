"""Sec. IV timed: matching 8 and 1,000 corners, associating and relocating, beside plain Python in the same run."""

from itertools import permutations
from math import ceil, hypot
from statistics import median
from time import perf_counter

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from dollop.association import associate
from dollop.environment import Environment
from dollop.matching import match


def seconds(function, repeats):
    """Median time of a call, after one that does not count."""
    function()
    times = []
    for _ in range(repeats):
        start = perf_counter()
        function()
        times.append(perf_counter() - start)
    return median(times)


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
    """Rows of name, median_s, baseline_s, ratio, bound (s)."""
    rows = []

    def row(name, ours, plain, bound, repeats, plain_repeats):
        time, baseline = seconds(ours, repeats), seconds(plain, plain_repeats)
        rows.append({"name": name, "median_s": time, "baseline_s": baseline, "ratio": baseline / time, "bound": bound})

    two, many = scene(2), scene(250)
    subgoals = np.random.default_rng(0).uniform(0, 30, (200, 2))
    for method in ("literal", "robust"):
        ours = {"method": method}
        row(
            f"match 8 corners, {method}",
            lambda k=ours: match(*two, **k),
            lambda: plain_permutations(*two),
            2e-4,
            300,
            3,
        )
        row(
            f"match 1000 corners, {method}",
            lambda k=ours: match(*many, **k),
            lambda: plain_assignment(*many),
            0.5,
            5,
            1,
        )
    row(
        "associate and relocate 200 subgoals, 1000 corners",
        lambda: associate(subgoals, many[0]).relocate(many[1]),
        lambda: plain_relocate(subgoals, *many),
        0.1,
        20,
        3,
    )
    return rows


if __name__ == "__main__":
    print(pd.DataFrame(run()).to_string(index=False, float_format="{:.3g}".format))
