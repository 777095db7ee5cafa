"""Angles, rotations and poses in the plane."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.pose import between, composed, motion_between, moved_pose, poses_at, rotation, wrapped

ANGLES = st.floats(-1e3, 1e3)
POSES = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3.1, 3.1))


@given(ANGLES)
def test_a_wrapped_angle_is_the_same_direction(angle):
    """In (-pi, pi], and wrapping again changes nothing."""
    once = wrapped(angle)
    assert -np.pi < once <= np.pi
    assert np.exp(1j * once) == pytest.approx(np.exp(1j * angle), abs=1e-9)
    assert wrapped(once) == once


@given(st.floats(-np.pi, np.pi, exclude_min=True))
def test_what_is_in_the_range_keeps_its_last_bit(angle):
    """Alone and in an array."""
    assert wrapped(angle) == angle and wrapped(np.array([angle]))[0] == angle


def test_the_ends_of_the_range():
    """Half a turn is positive, whichever way it was made."""
    assert wrapped(-np.pi) == wrapped(np.pi) == wrapped(3 * np.pi) == np.pi


@given(ANGLES, ANGLES)
def test_rotations_are_those_of_complex_numbers(angle, other):
    """Multiplying by exp(i angle).

    One after the other is their sum, and the inverse the transpose.
    """
    turned = rotation(angle) @ [3.0, 4.0]
    assert turned @ [1, 1j] == pytest.approx((3 + 4j) * np.exp(1j * angle))
    both = rotation(angle) @ rotation(other)
    np.testing.assert_allclose(both, rotation(angle + other), atol=1e-9)
    np.testing.assert_allclose(rotation(angle) @ rotation(angle).T, np.eye(2), atol=1e-12)


def test_many_rotations_at_once():
    """Angles of any shape give as many matrices."""
    angles = np.arange(6.0).reshape(2, 3)
    assert rotation(angles).shape == (2, 3, 2, 2)
    np.testing.assert_array_equal(rotation(angles)[1, 2], rotation(5.0))


@given(POSES, st.floats(0, 10), st.floats(-3.1, 3.1))
def test_a_motion_is_read_off_again(pose, distance, turn):
    """What a pose was moved by is what lies between before and after."""
    ahead, left, turned = motion_between(pose, moved_pose(pose, distance, turn))
    assert ahead == pytest.approx(distance, abs=1e-9)
    assert left == pytest.approx(0, abs=1e-9) and turned == pytest.approx(turn, abs=1e-9)


@given(POSES, POSES, POSES)
def test_the_frame_does_not_matter(before, after, frame):
    """Seen from elsewhere, the same motion lies between two poses."""
    x, y, theta = frame

    def seen(pose):
        return [*(rotation(theta) @ pose[:2] + (x, y)), pose[2] + theta]

    here, there = motion_between(before, after), motion_between(seen(before), seen(after))
    if abs(here[2]) < 3.1:  # beyond, rounding decides which way it turned
        np.testing.assert_allclose(there, here, atol=1e-6)


def test_a_full_circle_in_small_arcs_comes_back():
    """A thousand arcs along the unit circle end where they began, heading included."""
    pose = np.array([1.0, 0.0, np.pi / 2])
    for _ in range(1000):
        pose = moved_pose(pose, 2 * np.pi / 1000, 2 * np.pi / 1000)
    np.testing.assert_allclose(pose, [1.0, 0.0, np.pi / 2], atol=1e-9)


@given(POSES, POSES)
def test_what_lies_between_leads_from_one_to_the_other(before, after):
    """Between and composed undo each other, and composing is multiplying by a matrix."""
    np.testing.assert_allclose(composed(before, between(before, after))[:2], after[:2], atol=1e-6)
    assert np.exp(1j * composed(before, between(before, after))[2]) == pytest.approx(np.exp(1j * after[2]))
    x, y, theta = before
    matrix = np.block([[rotation(theta), np.array([[x], [y]])], [0, 0, 1]])
    np.testing.assert_allclose(composed(before, after)[:2], (matrix @ [*after[:2], 1])[:2], atol=1e-6)


def test_many_poses_are_composed_with_one():
    """Leading axes are broadcast, whichever of the two has them."""
    many = np.random.default_rng(0).normal(size=(4, 5, 3))
    one = np.array([0.3, -0.2, 3.0])
    for outer, inner in ((many, one), (one, many)):
        found = composed(outer, inner)
        assert found.shape == (4, 5, 3)
        pair = [np.broadcast_to(each, (4, 5, 3))[2, 3] for each in (outer, inner)]
        np.testing.assert_allclose(found[2, 3], composed(*pair))


def test_poses_between_two_times():
    """Half-way in time is half-way in place and heading, over the seam too; outside nothing changes."""
    poses = np.array([[0.0, 0.0, 3.0], [1.0, 2.0, -3.0], [1.0, 2.0, -2.0]])
    found = poses_at([-5.0, 0.0, 0.5, 1.5, 2.0, 9.0], np.arange(3.0), poses)
    middle = [0.5, 1.0, np.pi]
    np.testing.assert_allclose(found, [poses[0], poses[0], middle, [1, 2, -2.5], poses[2], poses[2]])
