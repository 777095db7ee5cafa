"""How often objects are matched right, wrong or not at all, and whether a probability told is one.

python -m benchmarks.matching [scenes per cell and number of objects] [first seed]

Scenes are drawn by rules that know nothing of the library's model: things of a room of 6 m by 6 m (8 m for more than
five), sides off by 2 cm (standard deviation) whenever they are looked at, each in view or not.

moved       By a distance of 0.2 to 0.6 m that is the same for all of a scene, each in a direction of its own.
spread      By that as a standard deviation along each axis.
random      Where they stand afterwards has nothing to do with before.
alike       0.4 m by 0.4 m, all of them; else from 0.2 to 0.8 m; distinct: every two differ by 0.3 m along a side.
seen        unknown; holes: round what was not in view 0.3 m of the floor are unseen; shadow: beyond a straight line
            a fifth of the room is unseen, and whatever stands there.

Of each cell: scenes; of all of them the best matching right; as a whole told with 95 % or more: right and wrong; the
rest is refused. Of single pairs told with 95 % or more: right and wrong. The literal method where it can be asked: all
objects right, and confident and wrong. At the end how often what was told with a probability is right, in bins.
"""

import sys
from itertools import product

import numpy as np

from dollop import Environment, match
from dollop.environment import Seen
from dollop.gridmap import covered_cells

GAP, NOISE, CELL, SHADOW, HOLE = 0.3, 0.02, 0.1, 0.2, 0.3
BINS = 0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.001


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
    """Places (n, 2) one by one, each drawn anew while it is nearer than GAP to an earlier one; None if stuck."""
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


# ---- what is counted


def cells():
    """Keywords of `drawn` for each line of the table, and the numbers of objects."""
    for view, layout in product((0.8, 1.0), ("moved", "spread", "random")):
        kinds = ("alike", "any", "distinct") if layout == "random" else ("alike", "any")
        for sizes, seen in product(kinds, ("unknown", "holes", "shadow")):
            if seen != "shadow" or view < 1:
                numbers = (2, 3, 4) if sizes == "distinct" else (2, 3, 4, 6) if layout == "random" else range(2, 11)
                yield dict(layout=layout, sizes=sizes, view=view, seen=seen), numbers


def judged(seed, n, cell):
    """Counts (8,) of one scene, and what was told and was so of the whole (2,) and of pairs (K, 2); None if empty."""
    before, after, truth = drawn(seed, n, **cell)
    if not len(before) or not len(after):
        return None
    found = match(before, after)
    right, used = np.array_equal(found.partners, truth), found.sure & (found.partners >= 0)
    is_so = np.arange(len(after) + 1) == (truth % (len(after) + 1))[:, None]
    literal = [0, 0]
    if len(before) == len(after) > 1:
        springs = match(before, after, method="literal")
        whole = np.array_equal(springs.indices // 4, np.repeat(truth, 4))
        literal = [whole, springs.confident and not whole]
    pairs = [np.sum(used & (found.partners == truth)), np.sum(used & (found.partners != truth))]
    counts = [1, right, found.confident and right, found.confident and not right, *pairs, *literal]
    return np.array(counts, int), (found.probability, right), np.stack([found.pair_probabilities, is_so], -1)


def calibration(told):
    """One line: mean told > share right (how many), by bin, of rows (K, 2)."""
    words = []
    for low, high in zip(BINS, BINS[1:], strict=False):
        within = told[(told[:, 0] >= low) & (told[:, 0] < high)]
        if len(within):
            words.append("{:.2f}>{:.2f} ({})".format(*within.mean(axis=0), len(within)))
    return "  ".join(words)


def main(scenes=30, first=0):
    """Print the table."""
    print(f"{'view layout sizes    seen':28} scenes best | whole right wrong | pairs right wrong | literal right wrong")
    wholes, singles = {}, {}
    for cell, numbers in cells():
        results = [judged(seed, n, cell) for n, seed in product(numbers, range(first, first + scenes))]
        counts, whole, pairs = zip(*filter(None, results), strict=True)
        total, name = np.sum(counts, axis=0), "{view} {layout:6} {sizes:8} {seen:7}".format(**cell)
        print("{:28} {:6} {:4} | {:11} {:5} | {:11} {:5} | {:13} {:5}".format(name, *total), flush=True)
        kind = "moved" if cell["layout"] != "random" else "random"
        wholes.setdefault((kind, cell["seen"]), []).extend(whole)
        singles.setdefault((kind, cell["seen"]), []).extend(each.reshape(-1, 2) for each in pairs)
    for kind, whole in wholes.items():
        print(*kind, "\n  whole", calibration(np.array(whole, float)))
        print("  pairs", calibration(np.vstack(singles[kind])))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
