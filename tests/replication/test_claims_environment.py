"""What the claims on objects and on one scan are measured with: known truth comes back."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from dollop.environment import Environment
from dollop.lab.outlines import outline_distances
from dollop.lab.scanner import SickLMS200
from dollop.replication import peers
from dollop.replication.claims import environment, foreground
from dollop.replication.draws import drawn_until_room
from dollop.replication.reconstruction import TOLD
from dollop.task import Demonstration, Task

BOXES = np.array([[0.0, 0.0, 0.4, 0.4], [3.0, 0.2, 3.4, 0.6], [1.0, 3.0, 1.4, 3.4]])


def shown_among(boxes, shift=(0.0, 0.0)):
    """A walk of two bends past three boxes."""
    t = np.linspace(0, 2 * np.pi, 150)
    return Demonstration(np.stack([1 + t / 2, 1.5 + np.sin(t)], axis=1) + shift, Environment(boxes))


def there(shift):
    """All objects and the walk moved by the same."""
    boxes, moved = BOXES, BOXES + np.tile(shift, 2)
    again = shown_among(moved, shift)
    return environment.Elsewhere(shown_among(boxes), Environment(moved), again, again.walks, 1)


# ---- drawing anew


@pytest.mark.parametrize("room_at", [0, 3])
def test_draws_are_counted_until_there_is_room(room_at):
    """The first for which there is room, and how many it took; other errors are told."""

    def draw(k):
        if k < room_at:
            raise ValueError("no room")
        return k

    assert drawn_until_room(draw) == (room_at, room_at + 1)


def test_no_room_at_all_is_told():
    """After so many draws; an error that is no lack of room comes through at once."""
    with pytest.raises(RuntimeError, match="none in 7 draws"):
        drawn_until_room(lambda k: int("no room"), 7)
    with pytest.raises(ZeroDivisionError):
        drawn_until_room(lambda k: 1 / k)


# ---- matching


def test_rounding_up_changes_an_assignment_where_costs_are_near():
    """Of [[1.2, 1.4], [1.3, 1.6]] the other diagonal is cheaper by 0.1; rounded up to whole numbers all are 2."""
    costs = np.array([[1.2, 1.4], [1.3, 1.6]])
    assert environment.rounding_changes(costs, 1) and not environment.rounding_changes(costs, 1e3)
    assert environment.rounding_costs(costs, 1) == pytest.approx(2.8 / 2.7 - 1)
    assert environment.rounding_costs(costs, 1e3) == 0


def test_unrounded_costs_are_those_that_are_rounded():
    """Times alpha and rounded up they are the integer costs of the matching."""
    before, after = Environment(BOXES), Environment(BOXES + [[0.1, 0.3] * 2, [0.0] * 4, [0.2, 0.0] * 2])
    unrounded = environment.unrounded_costs(before, after)
    expected = environment.integer_costs(before.corners, after.corners)
    np.testing.assert_array_equal(np.ceil(1e3 * unrounded - 1e-6), expected)


def test_an_object_is_mismatched_by_most_of_its_corners():
    """One or two corners astray are no other object, three are; corners mixed up within a box are none astray."""
    true = np.arange(8)
    for astray, wrong in ((1, False), (2, False), (3, True), (4, True)):
        indices = true.copy()
        indices[:astray], indices[4 : 4 + astray] = true[4 : 4 + astray], true[:astray]
        assert environment.object_mismatched(indices, true) == wrong
        assert environment.rightly(indices) != wrong
    assert not environment.object_mismatched(np.array([1, 0, 3, 2, 6, 7, 4, 5]), true)
    assert not environment.rightly(None)


def test_matchings_of_other_numbers_are_never_alike():
    """What cannot be matched is not consistent."""
    two, three = Environment(BOXES[:2]), Environment(BOXES)
    assert environment.matched_as(two, three, "literal") is None
    same = environment.matched_as(three, three, "literal")
    assert environment.alike(same, same) == 1 and environment.alike(same, same[::-1]) == 0
    assert environment.alike(None, None) == 0 and environment.alike(same, None) == 0


def test_right_is_ahead_where_nothing_moved_and_behind_where_boxes_changed_places():
    """By the whole boxes' costs: exchanged, the right one is dearer than the exchange by the same."""
    before, other = Environment(BOXES), Environment(BOXES[[1, 0, 2]])
    ahead = environment.right_ahead(before, before)
    assert ahead > 0 > environment.right_ahead(before, other)


def test_who_contrives_keeps_to_the_rules():
    """More tries find no less, and the first ten are the same; no shift is longer than allowed."""
    tries = [environment.tries_to_contrive(np.random.default_rng(seed), 30, both=0.3) for seed in range(12)]
    few = [environment.tries_to_contrive(np.random.default_rng(seed), 10, both=0.3) for seed in range(12)]
    assert [each if each <= 10 else inf for each in tries] == few and min(tries) < inf
    shifts = environment.within(np.array([[3.0, 4.0], [0.1, 0.0], [0.0, 0.0]]), 0.5)
    np.testing.assert_allclose(shifts, [[0.3, 0.4], [0.1, 0.0], [0.0, 0.0]])
    assert environment.nearest_of(np.array([[0, 0], [1.0, 3.0], [2.0, 0.5]])) == 2.0


# ---- where objects have moved


def test_where_everything_moved_by_the_same_nobody_needs_training():
    """Adapted, retrained and the DMP are as near to the walk there, whatever m is."""
    pytest.importorskip("movement_primitives", reason="the DMP needs the extra peers")
    found = environment.errors_there(there((0.7, -1.2)))
    assert found["adapted_more"] == pytest.approx(0, abs=1e-3)
    assert -0.02 < found["dmp_more"] < 0.005  # the law has its tolerance
    assert found["left_more"] > 0.3 and found["retrained"] < 0.02
    errors = [environment.error_with(there((0.7, -1.2)), replace(TOLD, corners=m)) for m in (1, 2, 4, 8)]
    assert np.ptp(errors) < 1e-6


def test_a_dmp_is_scaled_and_shifted_as_a_whole():
    """Also where it ends where it begins, as a figure-eight does; stiff, it follows to a few millimetres."""
    pytest.importorskip("movement_primitives", reason="the DMP needs the extra peers")
    t = np.linspace(0, 2 * np.pi, 200)
    eight = np.stack([2 * np.sin(t), np.sin(2 * t)], axis=1) + [4.5, 3.6]
    ends = eight[[0, -1]]
    whole = peers.dmp([eight], ends, stiffness=environment.STIFF)
    assert environment.walks_off([eight], whole) < 0.005 < environment.walks_off([eight], peers.dmp([eight], ends))
    twice = peers.dmp([eight], 2 * ends + [1, 2], scale=2.0, stiffness=environment.STIFF)
    np.testing.assert_allclose(twice, 2 * whole + [1, 2], atol=1e-9)


def test_without_the_extra_the_claim_says_what_to_install(monkeypatch):
    """As other extras do."""
    monkeypatch.setattr("dollop.checks.find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"dollop\[peers\]"):
        environment.errors_there(there((0.5, 0.5)))


# ---- what must be set


def test_settings_are_counted_in_signatures():
    """Data are no settings; what has no default must be set, a number that has one may."""

    def call(log, task, tolerance, laps, user="fastest", radius=0.2, count=3, avoid=True, **more):
        """Never called."""

    assert environment.settings_counted([call]) == {"must_set": 2, "may_set": 2}
    assert environment.settings_counted([Task.adapt]) == {"must_set": 0, "may_set": 0}


# ---- one scan


@pytest.mark.parametrize("radius", [0.18, 0.4])
def test_the_shape_of_an_arc_is_that_of_its_circle(radius):
    """Seen from any side; a straight face has no curvature, and two readings no shape."""
    angle = np.linspace(-0.5, 0.5, 21)
    arc = np.array([3 * np.cos(0.8), 3 * np.sin(0.8)]) + radius * np.exp(1j * (angle + 0.8 + np.pi)).view(
        float
    ).reshape(-1, 2)
    width, depth, curvature, distance = foreground.shape_of(arc)
    assert width == pytest.approx(2 * radius * np.sin(0.5)) and depth == pytest.approx(radius * (1 - np.cos(0.5)))
    assert curvature == pytest.approx(1 / radius, rel=0.1) and distance == pytest.approx(3 - radius, abs=0.05)
    face = np.column_stack([np.full(9, 2.0), np.linspace(-0.2, 0.2, 9)])
    np.testing.assert_allclose(foreground.shape_of(face)[:3], [0.4, 0, 0], atol=1e-9)
    assert foreground.shape_of(face[:2])[:3].tolist() == [0, 0, 0] and foreground.shape_of(face[:0])[3] == 0


def test_bodies_that_differ_are_told_apart_and_equal_ones_are_not():
    """Wholly, on either side of a threshold; of equal ones guessing gets half."""
    rng = np.random.default_rng(0)
    person = np.arange(400) % 2 == 0
    shapes = rng.normal(size=(400, 4))
    assert foreground.right_by_likeness((shapes, person), (rng.normal(size=(400, 4)), person)) == pytest.approx(
        0.5, abs=0.1
    )
    for sign in (1, -1):
        apart = shapes + sign * 20 * person[:, None]
        known = apart, person
        assert foreground.right_by_likeness(known, known) == foreground.right_by_threshold(known, known, 2) == 1


def test_readings_on_a_body_are_on_it():
    """Within the laser's noise, apart from the few mixed ones at its edges."""
    rng = np.random.default_rng(1)
    for outline in (foreground.WAIST, foreground.CAN, foreground.SLIM):
        blob = foreground.blob_of(outline, (2.0, 0.3), rng, SickLMS200(), turn=0.5)
        placed = outline._replace(x=2 * np.cos(0.3), y=2 * np.sin(0.3), turn=0.5)
        off = np.abs(outline_distances(blob, [placed]))
        assert len(blob) > 6 and (off < 0.025).sum() >= len(blob) - 2


def test_found_and_false_objects_are_counted():
    """Two scans: the walker found once of once in sight, a can missed, one object where nobody is."""
    bodies = np.array([[[0.0, 0.0], [3.0, 0.0], [6.0, 0.0]]] * 2)
    in_sight = np.array([[True, True, False], [False, True, True]])
    objects = [np.array([[0.1, 0.1], [3.0, 0.2]]), np.array([[6.1, 0.0], [8.0, 8.0]])]
    room = foreground.RoomStoodIn(None, None, None, bodies, in_sight, 1)
    assert foreground.found_share(room, objects) == 0.75
    assert foreground.found_share(room, objects, slice(0, 1)) == 1
    assert foreground.false_share(room, objects) == 0.5
    assert np.isnan(foreground.found_share(room, [np.zeros((0, 2))] * 2, slice(0, 0)))


def test_people_stand_where_there_is_room_and_beams_meet_what_they_meet():
    """Readings on the walker are on their torso, those on the background are not; shoulders are clear of cans."""
    room = foreground.room_stood_in(2000, count=8)
    assert room.points.shape[:2] == room.on_walker.shape and room.draws >= 1
    assert not (room.on_walker & room.on_background).any()
    for points, on, away, bodies in zip(room.points, room.on_walker, room.on_background, room.bodies, strict=True):
        apart = np.linalg.norm(points - bodies[0], axis=1)
        assert (apart[on] < 0.3).mean() > 0.7 or not on.any()  # but for mixed readings
        assert np.quantile(apart[away], 0.05) > 0.2
        assert np.linalg.norm(bodies[1:] - bodies[0], axis=1).min() > foreground.CAN.radius + foreground.SHOULDERS / 2


def test_a_body_is_in_sight_by_half_of_its_beams():
    """Of four beams that would meet the walker two must; a can that no beam would meet is not."""
    beams = np.full((1, 6, 4), inf)
    beams[0, :, 3] = 5.0
    beams[0, :4, 0] = [2.0, 2.0, 2.0, 6.0]
    beams[0, 2:4, 1] = 1.0
    assert foreground.half_seen(beams).tolist() == [[True, True, False]]
    beams[0, 1, 1] = 1.0
    assert foreground.half_seen(beams).tolist() == [[False, True, False]]
