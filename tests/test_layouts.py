"""Random layouts: what they promise."""

import numpy as np
import pytest

from dollop.layouts import matching_shares, random_layouts


@pytest.mark.parametrize(("change", "counts"), [("none", (3, 3)), ("missing", (3, 2)), ("added", (3, 4))])
def test_the_truth_says_which_object_is_which(change, counts):
    """Objects that do not move at all stand where their partners stand; one is without where one is missing."""
    before, after, partners = random_layouts(3, np.random.default_rng(2), noise=0, moved=0, change=change)
    assert (len(before), len(after)) == counts
    kept = partners >= 0
    np.testing.assert_allclose(before.boxes[kept], after.boxes[partners[kept]])
    assert kept.sum() == min(counts)


def test_boxes_keep_their_gap():
    """No two boxes are nearer than the gap in both x and y."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        centres = random_layouts(4, rng, gap=0.4)[1].centres
        distances = np.abs(centres - centres[:, None]).max(axis=2)[np.triu_indices(4, 1)]
        assert distances.min() >= 0.8


def test_the_same_seed_gives_the_same_shares():
    """The study is a function of its seed, and the literal method gets worse with box noise, the robust one not."""
    study = matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4)
    assert study.equals(matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4))
    shares = study.pivot(index="noise", columns="method", values="right")
    assert shares.literal[0.1] < shares.literal[0.0]
    assert shares.robust[0.1] == pytest.approx(shares.robust[0.0], abs=0.05)
