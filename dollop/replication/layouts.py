"""Random layouts of boxes with known truth, and how often a matching is right on them (figure x1)."""

from itertools import product

import numpy as np
import pandas as pd

from dollop.environment import Environment
from dollop.matching import match

_CHANGES = {"none": (0, 0), "missing": (0, 1), "added": (1, 0)}


def random_layouts(objects, generator, noise=0.05, moved=0.4, room=6.0, size=0.4, gap=0.4, change="none", turn=0.0):
    """Boxes that stand anywhere in a room, then moved a little, and seen inexactly before and
    after.

    Parameters
    ----------
    objects : int
        How many there are before.
    generator : numpy.random.Generator
        Source of chance.
    noise : float
        Each extent of each box is seen off by up to this much, in m, uniformly.
    moved : float
        Standard deviation of each object's move per axis, in m.
    room, size, gap : float
        Side of the room, side of a box, and the least gap between two boxes along x or y before and
        after the move, in m. With less than about 0.4 m nobody could walk between them.
    change : {"none", "missing", "added"}
        Whether afterwards one of the objects is missing, or another one has come.
    turn : float
        The layout is also turned about its middle, in rad.

    Returns
    -------
    before, after : Environment
        In random order.
    partners : (objects,) int array
        Which object of `after` each object of `before` is, -1 where it is missing.
    """
    arrivals, departures = _CHANGES[change]
    total = objects + arrivals
    old = _apart(lambda: generator.uniform(size / 2, room - size / 2, (total, 2)), size + gap)
    new = _apart(lambda: _turned(old, turn) + generator.normal(0, moved, (total, 2)), size + gap)
    old, order = old[:objects], generator.permutation(total)[departures:]
    places = np.full(total, -1)
    places[order] = np.arange(len(order))
    before, after = (_seen(centres, size, noise, generator) for centres in (old, new[order]))
    return before, after, places[:objects]


def _apart(draw, distance):
    """Positions (N, 2) drawn again until no two are nearer than `distance` in both x and y."""
    while True:
        positions = draw()
        distances = np.abs(positions - positions[:, None]).max(axis=2) + distance * np.eye(len(positions))
        if distances.min() >= distance:
            return positions


def _turned(positions, turn):
    cos, sin = np.cos(turn), np.sin(turn)
    middle = positions.mean(axis=0)
    return middle + (positions - middle) @ np.array([[cos, sin], [-sin, cos]])


def _seen(centres, size, noise, generator):
    halves = (size + generator.uniform(-noise, noise, centres.shape)) / 2
    return Environment(np.hstack([centres - halves, centres + halves]))


def right_indices(partners, turn=0.0):
    """(4N,) true indices of the corners, given the true partner of each object and the layout's
    turn in rad.
    """
    corners = (np.arange(4) + round(turn / (np.pi / 2))) % 4
    return np.where(partners[:, None] >= 0, 4 * partners[:, None] + corners, -1).ravel()


def matching_shares(
    objects=(2, 3, 4), noises=(0.0, 0.05, 0.1, 0.2), changes=("none",), layouts=300, seed=0, turn=0.0, **properties
):
    """How often the corners are matched right, by method, number of objects and box noise (figure
    x1).

    Parameters
    ----------
    objects, noises, changes : sequences
        What `random_layouts` is asked for, in all combinations.
    layouts : int
        Random layouts per combination; the two methods see the same ones.
    seed : int
        Seed of the random layouts.
    turn : float
        The layout is also turned by this much, in rad.
    **properties
        Further ones of `random_layouts`, such as moved and gap.

    Returns
    -------
    pandas.DataFrame
        One row per combination and method: change, objects, noise (m), method, right (share of
        layouts with all corners right), right_objects (with all objects right, whichever their
        corners), confident (share reported so), right_if_confident (share of these with all objects
        right), layouts. The literal method, being a bijection, has no rows where the count changes.
    """
    rows = []
    for change, n, noise in product(changes, objects, noises):
        generator = np.random.default_rng(seed)
        wanted = properties | {"noise": noise, "change": change, "turn": turn}
        drawn = [random_layouts(n, generator, **wanted) for _ in range(layouts)]
        for method in ("literal", "robust") if change == "none" else ("robust",):
            shares = _shares(drawn, method, turn)
            rows.append({"change": change, "objects": n, "noise": noise, "method": method, **shares})
    return pd.DataFrame(rows)


def _shares(layouts, method, turn):
    matchings = [match(before, after, method=method) for before, after, _ in layouts]
    truths = np.array([right_indices(partners, turn) for _, _, partners in layouts])
    found = np.array([matching.indices for matching in matchings])
    right_objects = (found // 4 == truths // 4).all(axis=1)
    confident = np.array([matching.confident for matching in matchings])
    return {
        "right": (found == truths).all(axis=1).mean(),
        "right_objects": right_objects.mean(),
        "confident": confident.mean(),
        "right_if_confident": right_objects[confident].mean() if confident.any() else np.nan,
        "layouts": len(layouts),
    }
