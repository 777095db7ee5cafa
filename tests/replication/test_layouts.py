"""Random layouts: what they promise."""

import numpy as np
import pytest

from dollop.matching import match
from dollop.replication.layouts import matching_shares, random_layouts, right_indices


@pytest.mark.parametrize(("change", "counts"), [("none", (3, 3)), ("missing", (3, 2)), ("added", (3, 4))])
def test_the_truth_says_which_object_is_which(change, counts):
    """Objects that do not move at all stand where their partners stand.

    One is without where one is missing.
    """
    before, after, partners = random_layouts(3, np.random.default_rng(2), noise=0, moved=0, change=change)
    assert (len(before), len(after)) == counts
    kept = partners >= 0
    np.testing.assert_allclose(before.boxes[kept], after.boxes[partners[kept]])
    assert kept.sum() == min(counts)


def test_both_layouts_keep_room_size_and_gap():
    """Before and after, boxes are as large as stated but for the noise, and apart.

    Before, they lie in the room.
    """
    rng = np.random.default_rng(1)
    extents = []
    for _ in range(60):
        layouts = random_layouts(4, rng, noise=0.1, room=3.0, size=0.5, gap=0.3)[:2]
        assert layouts[0].boxes.min() >= -0.05 and layouts[0].boxes.max() <= 3.05
        for layout in layouts:
            distances = np.abs(layout.centres - layout.centres[:, None]).max(axis=2)[np.triu_indices(4, 1)]
            assert distances.min() >= 0.8
            extents.append(layout.boxes[:, 2:] - layout.boxes[:, :2])
    assert 0.4 <= np.min(extents) < 0.42 and 0.58 < np.max(extents) <= 0.6
    assert abs(np.corrcoef(np.concatenate(extents).T)[0, 1]) < 0.2  # each extent has its own noise


def test_objects_move_by_the_stated_standard_deviation():
    """Moves have the standard deviation asked for and no bias; either object may come first."""
    rng, moves, first = np.random.default_rng(5), [], []
    for _ in range(300):
        before, after, partners = random_layouts(2, rng, noise=0, moved=0.4, room=20.0)
        moves.append(after.centres[partners] - before.centres)
        first.append(partners[0])
    assert np.std(moves) == pytest.approx(0.4, rel=0.1)
    assert np.mean(moves) == pytest.approx(0.0, abs=0.05)
    assert np.mean(first) == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("quarters", [0, 1, 2, -1])
def test_a_turned_layout_is_turned_corner_by_corner(quarters):
    """Turned about its middle, each corner lands on the one that the true indices name."""
    turn = quarters * np.pi / 2
    before, after, partners = random_layouts(4, np.random.default_rng(3), noise=0, moved=0, turn=turn)
    z = before.corners @ (1, 1j)
    expected = z.mean() + (z - z.mean()) * 1j**quarters
    np.testing.assert_allclose(after.corners[right_indices(partners, turn)] @ (1, 1j), expected, atol=1e-12)


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
        rng, counts = np.random.default_rng(9), np.zeros(4)
        for _ in range(drawn):
            before, after, partners = random_layouts(3, rng, change=row.change, turn=np.pi / 2, **wanted)
            found, truth = match(before, after, method=row.method), right_indices(partners, np.pi / 2)
            objects = all(a // 4 == b // 4 for a, b in zip(found.indices, truth, strict=True))
            counts += [list(found.indices) == list(truth), objects, found.confident, objects and found.confident]
        right, right_objects, confident, both = counts
        np.testing.assert_allclose([row.right, row.right_objects, row.confident], counts[:3] / drawn)
        if confident:
            assert row.right_if_confident == pytest.approx(both / confident)
        assert row.layouts == drawn
    assert 0 < study.right[1] < 1 and 0 < study.confident[1] < 1


def test_the_same_seed_gives_the_same_shares():
    """Shares are a function of the seed; the literal method gets worse with noise, robust not."""
    study = matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4)
    assert study.equals(matching_shares(objects=(2,), noises=(0.0, 0.1), layouts=40, seed=4))
    shares = study.pivot(index="noise", columns="method", values="right")
    assert shares.literal[0.1] < shares.literal[0.0]
    assert shares.robust[0.1] == pytest.approx(shares.robust[0.0], abs=0.05)
