"""How often objects are matched right, wrong or not at all, and whether a probability told is one.

python -m benchmarks.matching [scenes] [first seed] [method ...]

Scenes are drawn by rules that know nothing of the library's model: things of a room of 6 m by 6 m (8 m for more than
five), sides off by 2 cm (standard deviation) whenever they are looked at, each in view or not.

moved       By a distance of 0.2 to 0.6 m that is the same for all of a scene, each in a direction of its own.
spread      By that as a standard deviation along each axis.
random      Where they stand afterwards has nothing to do with before.
alike       0.4 m by 0.4 m, all of them; else from 0.2 to 0.8 m; distinct: every two differ by 0.3 m along a side.
seen        unknown; holes: round what was not in view 0.3 m of the floor are unseen; shadow: beyond a straight line
            a fifth of the room is unseen, and whatever stands there.
"""

import sys
from itertools import product

import numpy as np

from dollop import Environment, match
from dollop.environment import Seen
from dollop.gridmap import covered_cells

GAP, NOISE, CELL, SHADOW, HOLE = 0.3, 0.02, 0.1, 0.2, 0.3
ALL = "moved", "spread", "random"


def room_for(n):
    """Side in m."""
    return 6.0 if n <= 5 else 8.0


def sizes_of(kind, n, rng):
    """Sides (n, 2) in m of things that are alike, of any size, or distinct."""
    if kind == "alike":
        return np.full((n, 2), 0.4)
    while True:
        sizes = rng.uniform(0.2, 0.8, (n, 2))
        apart = np.abs(sizes - sizes[:, None]).max(axis=2) + np.eye(n)
        if kind == "any" or apart.min() >= 0.3:
            return sizes


def placed(sizes, draw):
    """Places (n, 2) one after the other, each drawn anew while it is nearer than GAP to an earlier one; None if stuck."""
    places = np.empty_like(sizes)
    for k, size in enumerate(sizes):
        for _ in range(100):
            places[k] = draw(k)
            gaps = np.abs(places[:k] - places[k]) - (sizes[:k] + size) / 2
            if gaps.max(axis=1).min(initial=np.inf) >= GAP:
                break
        else:
            return None
    return places


def drawn_places(sizes, layout, rng):
    """Before and after (n, 2) each, in m."""
    room, distance = room_for(len(sizes)), rng.uniform(0.2, 0.6)

    def anywhere(k):
        return rng.uniform(sizes[k] / 2, room - sizes[k] / 2)

    def moved(k):
        angle = rng.uniform(-np.pi, np.pi)
        step = distance * np.array([np.cos(angle), np.sin(angle)])
        return before[k] + (step if layout == "moved" else rng.normal(0, distance, 2))

    while True:
        before = placed(sizes, anywhere)
        after = None if before is None else placed(sizes, anywhere if layout == "random" else moved)
        if after is not None:
            return before, after


def looked_at(places, sizes, view, seen, rng):
    """What is found (Environment) and which it is (M,), each in view with probability `view`."""
    room, n = room_for(len(sizes)), len(sizes)
    side = int(room / CELL) + 20
    origin = (-10 * CELL, -10 * CELL)
    floor, boxes = np.ones((side, side), bool), np.hstack([places - sizes / 2, places + sizes / 2])
    if seen == "shadow" and view < 1:
        angle = rng.uniform(-np.pi, np.pi)
        row, column = np.indices(floor.shape)
        along = np.cos(angle) * column + np.sin(angle) * row
        floor = along <= np.quantile(along, 1 - SHADOW)
        found = np.flatnonzero(Seen(floor, origin, CELL).at(places))
    else:
        found = np.flatnonzero(rng.random(n) < view)
        hidden = np.setdiff1d(np.arange(n), found)
        grown = boxes[hidden] + HOLE * np.array([-1, -1, 1, 1])
        floor = ~covered_cells(grown, origin, CELL, floor.shape)
    found = rng.permutation(found)
    noisy = np.sort((boxes[found] + rng.normal(0, NOISE, (len(found), 4))).reshape(-1, 2, 2), axis=1).reshape(-1, 4)
    return Environment(noisy, None if seen == "unknown" else Seen(floor, origin, CELL)), found


def drawn(seed, n, layout="moved", sizes="alike", view=0.8, seen="unknown"):
    """Two environments and which object of the second each of the first is (N,), -1 where it is not there."""
    rng = np.random.default_rng([seed, n])
    sides = sizes_of(sizes, n, rng)
    before, after = drawn_places(sides, layout, rng)
    one, first = looked_at(before, sides, view, seen, rng)
    other, second = looked_at(after, sides, view, seen, rng)
    same = first[:, None] == second
    return one, other, np.where(same.any(axis=1), same.argmax(axis=1) if len(second) else -1, -1)
