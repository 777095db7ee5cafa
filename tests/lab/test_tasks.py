"""Tasks among objects drawn at random: what they promise."""

import numpy as np
import pytest
import scipy

from dollop.lab.tasks import APART, KINDS, draw_layouts, draw_task, other_way, size_of, walked
from dollop.trajectory import distance_to_polyline


@pytest.mark.parametrize("seed", range(8))
def test_the_way_passes_its_via_points_wherever_the_objects_stand(seed):
    """Each via-point keeps its offset from its object, and the way goes through all of them."""
    rng = np.random.default_rng(seed)
    task = draw_task(5, rng)
    for centres in draw_layouts(5, 3, rng):
        via = task.via(centres)
        np.testing.assert_allclose(via - centres[task.objects], task.offsets)
        assert distance_to_polyline(via, task.way(centres, samples=600)).max() < 0.03
        assert np.hypot(*task.offsets.T).min() >= 0.45 and np.hypot(*task.offsets.T).max() <= 0.9


@pytest.mark.parametrize("kind", KINDS)
def test_layouts_are_of_the_kind_that_was_asked_for(kind):
    """Still ones are all the same; moved ones have each object 0.5 m off one place; others are drawn anew."""
    layouts = np.array(draw_layouts(4, 30, np.random.default_rng(3), kind))
    assert layouts.shape == (30, 4, 2)
    if kind == "still":
        assert (layouts == layouts[0]).all()
    elif kind == "moved":
        middle = scipy.optimize.least_squares(lambda c: np.hypot(*(layouts[:, 0] - c).T) - 0.5, layouts[0, 0]).x
        np.testing.assert_allclose(np.hypot(*(layouts[:, 0] - middle).T), 0.5, atol=1e-6)
    else:
        assert np.abs(layouts - layouts[0]).max() > 3
        apart = [scipy.spatial.distance.pdist(layout).min() for layout in layouts]
        assert min(apart) > APART


def test_a_person_walks_it_again_within_a_few_percent():
    """Scatter, sway and noise put a walk off by some 1 % of the task's size, and never twice alike."""
    rng = np.random.default_rng(4)
    errors = []
    for _ in range(30):
        task, (centres,) = draw_task(4, rng), draw_layouts(4, 1, rng)
        way, walks = task.way(centres), [walked(task, centres, rng) for _ in range(2)]
        assert len(walks[0]) == 25 * len(task.offsets) and not np.allclose(*walks)
        errors.append(distance_to_polyline(way, walks[0]).mean() / size_of(way))
    assert 0.005 < np.median(errors) < 0.015


def test_another_way_has_the_same_ends():
    """Between them it goes elsewhere."""
    rng = np.random.default_rng(5)
    task, (centres,) = draw_task(3, rng), draw_layouts(3, 1, rng)
    one, other = task.way(centres), other_way(task, rng).way(centres)
    np.testing.assert_allclose(one[[0, -1]], other[[0, -1]])
    assert distance_to_polyline(one, other).max() > 0.3


def test_the_same_seed_draws_the_same():
    """A walk depends on its seed and on nothing else."""

    def drawn(seed):
        rng = np.random.default_rng(seed)
        return walked(draw_task(3, rng), draw_layouts(3, 1, rng)[0], rng)

    assert np.array_equal(drawn(6), drawn(6)) and not np.array_equal(drawn(6)[:90], drawn(7)[:90])


def test_a_room_that_is_too_small_and_an_unknown_kind_are_refused():
    """The errors name the value and the rule."""
    with pytest.raises(ValueError, match="n_objects must be in 0 to 20, got 21"):
        draw_layouts(21, 1, np.random.default_rng(0))
    with pytest.raises(ValueError, match="kind must be one of 'anywhere', 'moved', 'still', got 'far'"):
        draw_layouts(2, 1, np.random.default_rng(0), "far")
