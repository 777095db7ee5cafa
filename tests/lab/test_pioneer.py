"""The Pioneer: it obeys, finds itself by odometry and laser, performs, and is kidnapped."""

from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("pybullet", reason="the laboratory needs PyBullet (extra `lab`)")

from rooms import figure_eight

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.lab.pioneer import URDF, Pioneer
from dollop.lab.rooms import LABORATORY
from dollop.lab.scenes import empty_scene, figure_eight_scene
from dollop.lab.things import BEAM_HEIGHT
from dollop.lab.world import World
from dollop.pose import moved_pose
from dollop.robot.guidance import PIONEER_LIMITS
from dollop.robot.performing import perform
from dollop.sequenced_lds import SequencedLDS

START = (4.5, 3.6, -0.7)


@pytest.fixture(scope="module")
def empty():
    """The laboratory without foreground objects."""
    with World(empty_scene()) as world:
        yield world


@pytest.fixture
def robot(empty):
    """A Pioneer at rest in the middle of the room."""
    robot = Pioneer(empty, (4.5, 3.0, 0.0), limits=PIONEER_LIMITS._replace(turn=1.75))
    yield robot
    empty.engine.remove(robot.body)


def drive(robot, speed, turn, duration):
    """Drive with the same command for `duration` s."""
    for _ in range(round(duration / robot.period)):
        robot.drive(speed, turn)


def velocity(robot):
    """True forward speed in m/s and turning rate in rad/s of the middle of the axle."""
    (vx, vy, _), (_, _, turn) = robot.world.engine.velocity(robot.body)
    theta = robot.true_pose[2]
    return vx * np.cos(theta) + vy * np.sin(theta), turn


def numbers(texts):
    """Texts of numbers with blanks between, as lists of floats."""
    return [list(map(float, each.split())) for each in texts]


COMMANDS = [(0.4, 0.0), (0.0, 1.0), (0.4, 0.5), (0.3, -0.8), (-0.3, 0.2)]


@pytest.mark.parametrize(("speed", "turn"), COMMANDS)
def test_the_pioneer_drives_the_commanded_arc(robot, speed, turn):
    """Once up to speed, two seconds are the commanded arc within two per cent and a centimetre."""
    drive(robot, speed, turn, 1.5)
    start = robot.pose
    drive(robot, speed, turn, 2.0)
    expected = start
    for _ in range(200):  # an arc of many short chords
        expected = moved_pose(expected, speed * 0.01, turn * 0.01)
    off = robot.pose - expected
    assert np.linalg.norm(off[:2]) < 0.01 + 0.02 * abs(speed) * 2.0
    assert abs(np.angle(np.exp(1j * off[2]))) < 0.01 + 0.02 * abs(turn) * 2.0


def test_the_pioneer_respects_its_limits(robot):
    """From rest to full speed takes speed / acceleration, and no command exceeds the limits."""
    drive(robot, 10.0, 10.0, 0.5)
    speed, turn = velocity(robot)
    assert speed == pytest.approx(0.25, abs=0.02) and turn == pytest.approx(0.785, abs=0.08)
    robot.place((4.5, 3.0, 0.0))
    drive(robot, 10.0, 0.0, 2.0)
    assert velocity(robot)[0] == pytest.approx(0.5, abs=0.01)


def test_odometry_is_near_the_truth_but_not_equal(robot):
    """After a drive the odometry is off by under five per cent of the way, and not by nothing."""
    drive(robot, 0.4, 0.3, 5.0)
    off = np.linalg.norm(robot.odometry[:2] - robot.true_pose[:2])
    assert 1e-4 < off < 0.05 * 2.0


def test_without_a_map_the_pioneer_believes_the_truth(robot):
    """What it believes is where it is, at rest and after a drive, and it trusts that."""
    drive(robot, 0.4, 0.3, 1.0)
    assert robot.pose == robot.true_pose != tuple(robot.odometry) and robot.localised


def test_the_radius_covers_the_robot(robot):
    """No corner of the shapes that can touch something is farther from the pose, and one is as far to a centimetre."""
    shapes = ElementTree.parse(URDF).iter("collision")
    shapes = [(each.find("origin"), each.find("geometry/box")) for each in shapes]
    boxes = [(origin.get("xyz"), box.get("size")) for origin, box in shapes if box is not None]
    reach = [np.hypot(abs(x) + length / 2, abs(y) + width / 2) for (x, y, _), (length, width, _) in map(numbers, boxes)]
    assert robot.radius - 0.01 < max(reach) <= robot.radius


def test_a_collision_is_felt(robot):
    """Driving against the wall the robot touches it and stops before it; driving free, nothing."""
    drive(robot, 0.4, 0.0, 1.0)
    assert robot.touching is False
    robot.place((4.5, 0.8, -np.pi / 2))
    drive(robot, 0.4, 0.0, 4.0)
    assert robot.touching is True
    assert 0.1 < robot.pose[1] < 0.3


@pytest.fixture(scope="module")
def background():
    """The laboratory's map as drawn, at the height of the laser."""
    x, y = (np.arange(-0.1, size + 0.1 - 1e-9, 0.05) + 0.025 for size in LABORATORY.bounds[2:])
    x, y = np.meshgrid(x, y)
    parts = [part.outline.bounds for part in LABORATORY.parts if part.reaches(BEAM_HEIGHT)]
    blocked = np.zeros(x.shape, dtype=bool)
    for a, b, c, d in parts:
        blocked |= (x > a - 0.02) & (x < c + 0.02) & (y > b - 0.02) & (y < d + 0.02)
    return OccupancyGrid(blocked.astype(float), (-0.1, -0.1), 0.05)


@pytest.fixture(scope="module")
def task():
    environment = Environment(figure_eight_scene().boxes)
    return SimpleNamespace(law=SequencedLDS.fit(figure_eight()), environment=environment)


def run_in_lab(task, background, **keywords):
    with World(figure_eight_scene()) as world:
        robot = Pioneer(world, START, background, task.environment, seed=0)
        return perform(task, robot, background=background, **keywords)


def pose_errors(run):
    """Distance in m and angle in degrees from truth to estimate, where that was believed."""
    difference = (run.poses - run.true_poses)[run.localised]
    turn = np.angle(np.exp(1j * difference[:, 2]))
    return np.hypot(*difference[:, :2].T), np.degrees(np.abs(turn))


def test_it_performs_on_its_estimated_pose(task, background):
    """A lap: finished without contact, localised within 5 cm and 3 degrees on average."""
    run = run_in_lab(task, background)
    assert run.finished and run.collisions == 0, run.reason
    place, turn = pose_errors(run)
    assert place.mean() < 0.05 and turn.mean() < 3
    assert (run.poses != run.true_poses).any()


def test_kidnapped_it_stops_finds_itself_and_goes_on(task, background):
    """Carried away, it stays where it was put until it knows where that is, and then finishes."""
    run = run_in_lab(task, background, kidnap=[(6.0, (1.0, 3.5, 2.0))])
    assert run.finished and run.collisions == 0, run.reason
    lost = ~run.localised
    assert 2.0 < lost.sum() * 0.1 < 20.0
    assert np.ptp(run.true_poses[lost, :2], axis=0).max() < 0.15
    assert np.median(pose_errors(run)[0]) < 0.05


def test_a_start_it_is_not_told(task, background):
    """Not told where it starts, it turns until it knows."""
    with World(figure_eight_scene()) as world:
        robot = Pioneer(world, START, background, task.environment, seed=1, knows_start=False)
        assert np.isfinite(robot.pose).all() and not robot.localised
        for _ in range(100):
            robot.drive(0.0, 0.5)
        assert robot.localised
        assert np.hypot(*np.subtract(robot.pose, robot.true_pose)[:2]) < 0.05


def test_it_feels_what_it_touches(background):
    """Driven against a can, it touches; standing free, it does not."""
    with World(figure_eight_scene()) as world:
        robot = Pioneer(world, (3.3, 3.6, np.pi), background, seed=0)
        assert not robot.touching
        for _ in range(30):
            robot.drive(0.3, 0.0)
        assert robot.touching
