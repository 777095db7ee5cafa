"""Sec. IV: boxes, corners, and the springs between them."""

import numpy as np
import pytest

from dollop.environment import Environment, integer_costs, spring_constants, spring_forces

BOXES = np.array([[0.0, 0.0, 0.4, 0.5], [4.0, 1.0, 4.4, 1.3]])


def test_corners_run_counter_clockwise_from_the_lower_left():
    """Corner k of object n is row 4n + k, and the shoelace area of each object's four corners is that of its box."""
    corners = Environment(BOXES).corners.reshape(2, 4, 2)
    x, y = corners[..., 0], corners[..., 1]
    area = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2
    np.testing.assert_allclose(area, [0.2, 0.12])
    np.testing.assert_array_equal(corners[:, 0], BOXES[:, :2])


def test_centres_are_the_means_of_the_corners():
    """The centre of a box is the mean of its four corners, and so it is where the box is flat or a point."""
    environment = Environment([*BOXES, [1, 2, 1, 3], [4, 4, 4, 4]])
    np.testing.assert_allclose(environment.centres, environment.corners.reshape(-1, 4, 2).mean(axis=1))


def test_an_empty_environment_is_a_record():
    """No objects: no corners, and no error."""
    environment = Environment([])
    assert len(environment) == 0
    assert environment.corners.shape == (0, 2)


def test_boxes_are_neither_shared_nor_writable():
    """What the caller does to his array afterwards does not reach the environment."""
    boxes = BOXES.copy()
    environment = Environment(boxes)
    boxes[0] = 7
    np.testing.assert_array_equal(environment.boxes, BOXES)
    with pytest.raises(ValueError, match="read-only"):
        environment.boxes[0] = 7


@pytest.mark.parametrize(
    ("boxes", "rule"),
    [
        ([[0, 0, -1, 1]], r"xmin <= xmax .* got \[0.0, 0.0, -1.0, 1.0\] for object 0"),
        ([[0, 0, 1, 1], [0, 1, 1, 0]], "for object 1"),
        ([[0, 0, np.nan, 1]], "finite, got .*nan"),
        ([[0, 0, np.inf, 1]], "finite, got .*inf"),
        ([0, 0, 1, 1], r"shape \(N, 4\), got \(4,\)"),
        ([[0, 0, 1]], r"shape \(N, 4\), got \(1, 3\)"),
    ],
)
def test_bad_boxes_are_refused_by_name(boxes, rule):
    """Negative extent, NaN, infinity and another shape: an error with the value and the rule."""
    with pytest.raises(ValueError, match=rule):
        Environment(boxes)


def _forces_by_the_book(corners):
    forces = np.zeros_like(corners)
    for m, here in enumerate(corners):
        for n, there in enumerate(corners):
            if n != m:
                distance = np.linalg.norm(there - here)
                forces[m] += distance**-2 * (there - here) / distance
    return forces


def test_forces_and_costs_are_the_papers():
    """Forces and costs equal the formulas of Sec. IV-A written out as loops."""
    rng = np.random.default_rng(0)
    one, other = rng.uniform(0, 5, (2, 8, 2))
    np.testing.assert_allclose(spring_forces(one), _forces_by_the_book(one))
    costs = [
        [np.ceil(1e3 * np.linalg.norm(f - g)) for g in _forces_by_the_book(other)] for f in _forces_by_the_book(one)
    ]
    np.testing.assert_array_equal(integer_costs(one, other), costs)


def test_equal_forces_cost_nothing_in_spite_of_rounding():
    """A shift by an odd number of metres changes forces in the last bits only, and no cost becomes 1 for that."""
    corners = Environment(BOXES).corners
    assert np.diag(integer_costs(corners, corners + [1234.567, -0.1])).max() == 0


def test_coinciding_corners_are_refused():
    """Two corners in one place have an infinite spring: an error that says which."""
    touching = Environment([[0, 0, 1, 1], [1, 0, 2, 1]]).corners
    for function in (spring_constants, spring_forces):
        with pytest.raises(ValueError, match="corners 1 and 4 must not coincide"):
            function(touching)
