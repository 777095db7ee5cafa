"""Random layouts of boxes with known truth, and how often they are matched right (Fig. x1)."""

from itertools import product

import numpy as np
import pandas as pd

from dollop.environment import Environment
from dollop.matching import match
from dollop.pose import rotation

__all__ = ["matching_shares", "random_layouts", "right_indices"]

_CHANGES = {"none": (0, 0), "missing": (0, 1), "added": (1, 0)}


def random_layouts(objects, generator, noise=0.05, moved=0.4, room=6.0, size=0.4, gap=0.4, change="none", turn=0.0):
    """Boxes that stand anywhere in a room, then moved a little, and seen inexactly both times.

    A set-up of our own: the paper draws one layout (Fig. 8).

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
    shape, distance = (total, 2), size + gap
    old = _apart(lambda: generator.uniform(size / 2, room - size / 2, shape), distance)
    new = _apart(lambda: _turned(old, turn) + generator.normal(0, moved, shape), distance)
    old, order = old[:objects], generator.permutation(total)[departures:]
    places = np.full(total, -1)
    places[order] = np.arange(len(order))
    before, after = (_seen(centres, size, noise, generator) for centres in (old, new[order]))
    return before, after, places[:objects]


def _apart(draw, distance):
    """Positions (N, 2), drawn anew until no two are nearer than `distance` in both x and y."""
    while True:
        positions = draw()
        distances = np.abs(positions - positions[:, None]).max(axis=2)
        if (distances + distance * np.eye(len(positions))).min() >= distance:
            return positions


def _turned(positions, turn):
    middle = positions.mean(axis=0)
    return middle + (positions - middle) @ rotation(turn).T


def _seen(centres, size, noise, generator):
    halves = (size + generator.uniform(-noise, noise, centres.shape)) / 2
    return Environment(np.hstack([centres - halves, centres + halves]))


def right_indices(partners, turn=0.0):
    """The right answer of a matching, corner by corner.

    Parameters
    ----------
    partners : (N,) int array
        Which object each one truly is afterwards, -1 where it is missing.
    turn : float
        By how much the layout was turned, in rad.

    Returns
    -------
    (4N,) int array
        As `Matching.indices`.
    """
    corners = (np.arange(4) + round(turn / (np.pi / 2))) % 4
    return np.where(partners[:, None] >= 0, 4 * partners[:, None] + corners, -1).ravel()


def matching_shares(
    objects=(2, 3, 4), noises=(0.0, 0.05, 0.1, 0.2), changes=("none",), layouts=300, seed=0, **properties
):
    """How often the corners are matched right, by method, number and box noise (Fig. x1).

    Parameters
    ----------
    objects, noises, changes : sequences
        What `random_layouts` is asked for, in all combinations.
    layouts : int
        Random layouts per combination; the two methods see the same ones.
    seed : int
        Seed of the random layouts.
    **properties
        Further ones of `random_layouts`, such as moved, gap and turn.

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
        case = {"change": change, "noise": noise}
        drawn = [random_layouts(n, generator, **properties, **case) for _ in range(layouts)]
        for method in ("literal", "robust") if change == "none" else ("robust",):
            shares = _shares(drawn, method, properties.get("turn", 0.0))
            rows.append(case | {"objects": n, "method": method} | shares)
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
