"""How often layouts are matched right."""

import numpy as np
import pytest

from dollop.environment import corner_indices
from dollop.lab.drawn import random_layouts
from dollop.matching import match
from dollop.replication.layouts import matching_shares


def test_shares_are_what_counting_gives():
    """Every column of the study equals counting layout by layout.

    Only the robust method meets a missing object.
    """
    drawn, wanted = 40, {"noise": 0.05, "moved": 0.6}
    study = matching_shares((3,), (0.05,), ("none", "missing"), drawn, seed=9, turn=np.pi / 2, moved=0.6)
    assert study[["change", "method"]].values.tolist() == [
        ["none", "literal"],
        ["none", "robust"],
        ["missing", "robust"],
    ]
    for row in study.itertuples():
        rng, counts, told = np.random.default_rng(9), np.zeros(4), []
        for _ in range(drawn):
            before, after, partners = random_layouts(3, rng, change=row.change, turn=np.pi / 2, **wanted)
            found, truth = match(before, after, method=row.method), corner_indices(partners, np.pi / 2)
            objects = all(a // 4 == b // 4 for a, b in zip(found.indices, truth, strict=True))
            told.append(found.probability)
            counts += [list(found.indices) == list(truth), objects, found.confident, objects and found.confident]
        right, right_objects, confident, both = counts
        np.testing.assert_allclose([row.right, row.right_objects, row.confident], counts[:3] / drawn)
        if confident:
            assert row.right_if_confident == pytest.approx(both / confident)
        assert row.layouts == drawn
        assert row.probability == pytest.approx(np.mean(told), nan_ok=True)
        assert np.isnan(row.probability) == (row.method == "literal")
    assert 0 < study.right[1] < 1 and 0 < study.confident[1] < 1


def test_the_same_seed_gives_the_same_shares():
    """Shares are a function of the seed; the literal method gets worse with noise, robust not."""
    study = matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4)
    assert study.equals(matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4))
    shares = study.pivot(index="noise", columns="method", values="right")
    assert shares.literal[0.1] < shares.literal[0.0]
    assert shares.robust[0.1] == pytest.approx(shares.robust[0.0], abs=0.05)


def test_the_robust_method_is_right_on_150_layouts_each():
    """Boxes off by 5 cm, moved by 0.4 m: right in 99, 97, 90 % for 2, 3, 4 cans; the literal method in under half."""
    shares = matching_shares(noises=(0.05,), layouts=150).pivot(index="objects", columns="method", values="right")
    assert (shares["robust"] >= [0.99, 0.97, 0.90]).all()
    assert (shares["literal"] < 0.5).all()


def test_the_robust_method_is_right_where_a_can_is_missing_or_added():
    """Three cans, one missing or one added: right in 95 % of 150 layouts, in 99 % of those it is confident about."""
    shares = matching_shares(objects=(3,), noises=(0.05,), changes=("missing", "added"), layouts=150)
    assert (shares["right"] >= 0.95).all()
    assert (shares["right_if_confident"] >= 0.99).all()


def test_the_robust_method_follows_layouts_that_turned():
    """Three and four cans turned by a right angle: right in 90 % of 75, the corners turned too."""
    shares = matching_shares(objects=(3, 4), noises=(0.05,), layouts=75, turn=np.pi / 2, moved=0.15)
    assert (shares[shares.method == "robust"].right >= 0.9).all()
