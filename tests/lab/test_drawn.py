"""Layouts and demonstrations drawn at random: what they promise."""

import numpy as np
import pytest

from dollop.environment import corner_indices
from dollop.lab.drawn import TASKS, draw_demonstrations, random_layouts

SLALOM = np.array(TASKS["slalom"])


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
    np.testing.assert_allclose(after.corners[corner_indices(partners, turn)] @ (1, 1j), expected, atol=1e-12)


def test_demonstrations_scatter_as_told():
    """Without odd subgoals, the drawn ones have the task as mean, the spread as deviation."""
    drawn = np.array(draw_demonstrations(SLALOM, 2000, 0.15, extra=0))
    assert np.allclose(drawn.mean(0), SLALOM, atol=0.02)
    assert np.allclose(drawn.std(0), 0.15, atol=0.01)


def test_odd_subgoals_come_as_often_as_told():
    """Three in ten demonstrations have one subgoal more, anywhere in the order."""
    drawn = draw_demonstrations(SLALOM, 2000, 1e-6)
    longer = [sequence for sequence in drawn if len(sequence) == 7]
    places = [int(np.argmax(np.linalg.norm(sequence[:6] - SLALOM, axis=1) > 1e-4)) for sequence in longer]
    assert {len(sequence) for sequence in drawn} == {6, 7}
    assert len(longer) == pytest.approx(600, abs=70)
    assert set(places) >= {0, 1, 2, 3, 4, 5}


def test_the_same_seed_draws_the_same():
    """A seed fixes the demonstrations, and further ones do not change the first."""
    few, more = draw_demonstrations(SLALOM, 3, 0.1, seed=8), draw_demonstrations(SLALOM, 5, 0.1, seed=8)
    assert all(np.array_equal(a, b) for a, b in zip(few, more, strict=False))


def test_a_room_without_room_is_refused():
    """Drawn anew ten thousand times, not for ever."""
    with pytest.raises(ValueError, match="the room is too small"):
        random_layouts(9, np.random.default_rng(0), room=1.0)
