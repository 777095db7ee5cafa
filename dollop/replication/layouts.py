"""How often layouts of boxes are matched right (Fig. x1)."""

from itertools import product

import numpy as np
import pandas as pd

from dollop.environment import corner_indices
from dollop.lab.drawn import random_layouts
from dollop.matching import match

__all__ = ["matching_shares"]


def matching_shares(
    objects=(2, 3, 4),
    noises=(0.0, 0.05, 0.1, 0.2),
    changes=("none",),
    layouts=300,
    seed=0,
    **properties,
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
        right), probability (mean of what is told, nan of the literal method), layouts. The literal
        method, being a bijection, has no rows where the count changes.
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
    truths = np.array([corner_indices(partners, turn) for _, _, partners in layouts])
    found = np.array([matching.indices for matching in matchings])
    right_objects = (found // 4 == truths // 4).all(axis=1)
    confident = np.array([matching.confident for matching in matchings])
    told = np.array([matching.probability for matching in matchings])
    return {
        "right": (found == truths).all(axis=1).mean(),
        "right_objects": right_objects.mean(),
        "confident": confident.mean(),
        "right_if_confident": right_objects[confident].mean() if confident.any() else np.nan,
        "probability": told.mean(),
        "layouts": len(layouts),
    }
