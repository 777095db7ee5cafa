"""Sec. IV: boxes, corners, and the springs between them; boxes round what stands, as the laser sees it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rooms import CANS, SENSOR, nobody, room_map, watched

from dollop.environment import (
    Environment,
    Seen,
    integer_costs,
    spring_constants,
    spring_forces,
    standing_boxes,
)
from dollop.observation import observe

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


def test_assumed_sides_are_four_for_each_box():
    """None where not given; another number of them is refused."""
    assert not Environment(BOXES).assumed.any()
    assert Environment(BOXES, assumed=[[0, 0, 0, 1], [1, 0, 0, 0]]).assumed.sum() == 2
    with pytest.raises(ValueError, match=r"assumed must have shape \(2, 4\), got \(1, 4\)"):
        Environment(BOXES, assumed=np.zeros((1, 4), bool))


def test_seen_is_false_off_the_map_and_where_no_beam_was():
    """Cell by cell, lower left corner first; a place beyond the floor was not seen."""
    seen = Seen(np.array([[True, False], [False, True]]), (10.0, -1.0), 0.5)
    places = [[10.2, -0.8], [10.7, -0.8], [10.2, -0.3], [10.7, -0.3], [9.9, -0.8], [11.1, -0.3]]
    assert seen.at(places).tolist() == [True, False, False, True, False, False]


# ---- boxes round what stands


def looked(box, sensor, degrees=0.25):
    """Where beams (M, 2) from a sensor meet a box, and the scan, in a room of 8 m."""
    angles = np.arange(-np.pi, np.pi, np.radians(degrees))
    way = np.column_stack([np.cos(angles), np.sin(angles)])
    with np.errstate(divide="ignore"):
        low, high = ((box[side] - sensor) / way for side in (slice(0, 2), slice(2, 4)))
    near, far = np.minimum(low, high).max(axis=1), np.maximum(low, high).min(axis=1)
    hit = (near <= far) & (near > 0)
    return sensor + near[hit, None] * way[hit], (np.array([*sensor, 0.0]), angles, np.where(hit, near, 8.0))


sides, turns = st.floats(0.3, 1.0), st.sampled_from([-1.0, 1.0])


@given(sides, sides, st.floats(0.6, 3.0), st.floats(0.6, 3.0), turns, turns)
def test_a_box_of_which_two_faces_are_seen_is_known(width, depth, aside, before, left, below):
    """From 0.6 m or more beside both faces: every side within 7 cm, and none of them assumed."""
    box = np.array([3.0, 1.0, 3.0 + width, 1.0 + depth])
    sensor = (box[:2] + box[2:]) / 2 - [left * (width / 2 + aside), below * (depth / 2 + before)]
    seen, scan = looked(box, sensor)
    boxes, assumed, _, groups = standing_boxes(seen, np.tile(sensor, (len(seen), 1)), np.radians(0.25), scan)
    np.testing.assert_allclose(boxes, [box], atol=0.07)
    assert not assumed.any() and len(groups[0]) == len(seen)


def test_where_beams_graze_too_far_apart_the_far_side_is_assumed():
    """Nearly along a side, one degree between beams: its end is not known, and that is told; the others are."""
    box, sensor = np.array([3.0, 1.0, 3.6, 1.8]), np.array([2.9, -2.0])
    seen, scan = looked(box, sensor, degrees=1.0)
    boxes, assumed, *_ = standing_boxes(seen, np.tile(sensor, (len(seen), 1)), np.radians(1.0), scan)
    assert assumed.tolist() == [[False, False, False, True]]
    np.testing.assert_allclose(boxes[0, :3], box[:3], atol=0.05)


@pytest.mark.parametrize("quarters", range(4))
def test_the_far_side_of_a_box_seen_from_one_side_is_assumed(quarters):
    """Of a single face its ends are sides, the box is as deep as it is wide, and only the far side is assumed."""
    turn = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), quarters)
    face = np.column_stack([np.linspace(-0.25, 0.25, 80), np.full(80, 2.0)]) @ turn.T
    boxes, assumed, *_ = standing_boxes(face, np.zeros((80, 2)), np.radians(0.25))
    corners = np.array([[-0.25, 2.0], [0.25, 2.5]]) @ turn.T
    np.testing.assert_allclose(boxes, [[*corners.min(axis=0), *corners.max(axis=0)]], atol=0.02)
    assert assumed.tolist() == [[k == (3, 0, 1, 2)[quarters] for k in range(4)]]


def test_two_boxes_with_a_beam_between_them_are_two():
    """Two faces 0.3 m apart are one object where the beam between ends on neither's far side, else two."""
    sensor = np.zeros(2)
    left, right = (looked(np.array(box), sensor)[0] for box in ([-0.6, 2, -0.15, 2.4], [0.15, 2, 0.6, 2.4]))
    places, angles = np.vstack([left, right]), np.radians(np.arange(-90, 90.25, 0.25))
    for between, count in ((6.0, 2), (1.0, 1)):
        ranges = np.full(len(angles), 6.0)
        ranges[np.abs(angles) < np.arctan2(0.15, 2.0)] = between
        pose = np.array([0.0, 0.0, np.pi / 2])
        boxes, *_ = standing_boxes(places, np.zeros((len(places), 2)), np.radians(0.25), (pose, angles, ranges))
        assert len(boxes) == count


def test_nothing_stands_nothing_is_boxed():
    """No cells, no boxes; nor of a lone cell, however small boxes may be."""
    for places in (np.empty((0, 2)), np.array([[1.0, 2.0]])):
        boxes, assumed, hidden, groups = standing_boxes(places, np.zeros_like(places), 0.01, min_area=0.0)
        assert boxes.shape == assumed.shape == (0, 4) and len(hidden) == len(groups) == 0


@pytest.mark.parametrize("rate", [4.5, 5.0, 10.0, 20.0, 40.0])
@pytest.mark.parametrize("seed", range(3))
def test_boxes_are_found_in_three_seconds_whatever_the_rate(rate, seed):
    """Two boxes, every side within 6 cm, and nothing else, by lasers from 4.5 to 40 scans a second."""
    observation = observe(watched(nobody(3.0, rate), CANS, rate=rate, seed=seed), room_map())
    np.testing.assert_allclose(sorted(observation.environment.boxes.tolist()), CANS, atol=0.06)
    assert observation.notes == () and not observation.environment.assumed.any()


@pytest.mark.parametrize("rate", [4.5, 40.0])
def test_a_look_of_half_a_second_finds_nothing_and_says_so(rate):
    """What stands is known after a while; before that a note tells that the look was too short."""
    observation = observe(watched(nobody(0.5, rate), CANS, rate=rate), room_map())
    assert len(observation.environment) == 0
    assert [note.kind for note in observation.notes] == ["short look"] and not observation.trusted


def test_where_an_object_would_have_been_found_is_seen():
    """The floor in front of a box is seen, what lies in its shadow and behind a wall is not."""
    seen = observe(watched(nobody(3.0), CANS), room_map()).environment.seen
    assert seen.at([[4.5, 3.0], [2.5, 3.3], [4.5, 6.5], [8.0, 2.0]]).all()
    beyond = SENSOR[:2] + 1.3 * (CANS[:, :2] + 0.2 - SENSOR[:2])
    assert not seen.at([*beyond, [4.5, 7.4], [-0.3, 3.0]]).any()


def test_springs_between_thousands_of_corners_are_refused():
    """All pairs are looked at, so there is a bound, and it is named."""
    with pytest.raises(ValueError, match="between at most 2000 corners, got 2001"):
        spring_forces(np.arange(4002.0).reshape(-1, 2))
