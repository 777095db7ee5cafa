"""Driving from place to place: where the plan says that the robot is, the simulated one is near."""

import numpy as np
import pytest

from dollop.lab.driving import ARRIVED, planned_poses, pursue
from dollop.lab.scenes import Scene
from dollop.lab.things import Person, Robot

WAY = [(4.5, 2.2), (5.6, 3.2)]


@pytest.mark.parametrize("bearing", np.linspace(-3.0, 3.0, 9))
def test_pursuing_turns_towards_the_goal_and_drives_only_ahead(bearing):
    """The turn has the sign of the bearing; behind it the robot turns on the spot, ahead it is as fast as told."""
    speed, turn = pursue((1.0, 2.0, 0.5), (1.0 + np.cos(0.5 + bearing), 2.0 + np.sin(0.5 + bearing)), 0.4)
    assert turn * np.sin(bearing) >= 0 and 0.0 <= speed <= 0.4
    assert speed == pytest.approx(0.4 * max(np.cos(bearing), 0.0) ** 2)


def test_a_planned_way_passes_its_places_and_ends_there():
    """Every place is come as near to as counts as arrival, and afterwards the robot stands."""
    poses = planned_poses(Robot(way=WAY), np.arange(0.0, 40.0, 0.1))
    away = np.linalg.norm(poses[:, None, :2] - WAY, axis=2)
    assert (away.min(axis=0) <= ARRIVED + 1e-9).all()
    assert np.array_equal(poses[-1], poses[-50])


def test_a_robot_without_a_way_stands():
    """Without places to drive to, it is where it was put."""
    assert (planned_poses(Robot(), np.array([0.0, 5.0])) == Robot().pose).all()


def test_the_simulated_robot_is_near_its_plan():
    """With its errors of odometry and its inertia it is within 0.3 m of where it is meant to be."""
    pytest.importorskip("pybullet", reason="the laboratory needs PyBullet (extra `lab`)")
    from dollop.lab import record

    recording = record(Scene(robot=Robot(way=WAY), people=[Person([(2.0, 3.0)])]), seed=0, duration=12.0)
    truth = recording.truth[["laser_x", "laser_y"]].to_numpy()
    plan = planned_poses(recording.scene.robot, recording.log.t)[:, :2]
    assert np.ptp(truth, axis=0).max() > 1.5
    assert np.linalg.norm(truth - plan, axis=1).max() < 0.3
