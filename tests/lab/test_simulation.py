"""The laboratory in PyBullet: laser, robot, person, recordings and pictures against geometry."""

import numpy as np
import pytest

from dollop.lab.scenes import ROOM, Scene, empty_scene, figure_eight_scene
from dollop.lab.sick import SickLMS200

pytest.importorskip("pybullet", reason="the laboratory needs PyBullet (extra `lab`)")

from dollop.lab.person import DEPTH, SHOULDERS, figure_eight
from dollop.lab.pioneer import Pioneer, laser_pose
from dollop.lab.sick import cast
from dollop.lab.simulate import record, record_background, record_figure_eights
from dollop.lab.world import Server, World

CLEAN = SickLMS200(noise=0.0, mixed=0.0)


@pytest.fixture(scope="module")
def empty():
    """The laboratory without foreground objects."""
    with World(empty_scene()) as world:
        yield world


@pytest.fixture
def robot(empty):
    """A Pioneer at rest in the middle of the room."""
    robot = Pioneer(empty, (4.5, 3.0, 0.0))
    yield robot
    empty.call("removeBody", robot.body)


def disc_distance(start, direction, centre, radius):
    """Distance from `start` along a unit vector to a disc, `inf` beside it."""
    away = np.asarray(centre) - start
    along = away @ direction
    height = np.linalg.norm(away - along * direction)
    return along - np.sqrt(radius**2 - height**2) if height < radius and along > 0 else np.inf


@pytest.mark.parametrize("theta", [0.0, 0.9, np.pi])
def test_rays_measure_a_bare_room_exactly(theta):
    """In a box room of 6 m by 4 m every beam equals the analytic distance to the wall."""
    with Server() as room:
        for x, y, half in (
            (3.5, 0, [0.5, 3, 1]),
            (-3.5, 0, [0.5, 3, 1]),
            (0, 2.5, [4, 0.5, 1]),
            (0, -2.5, [4, 0.5, 1]),
        ):
            shape = room.call("createCollisionShape", 3, halfExtents=half)  # 3: GEOM_BOX
            room.call("createMultiBody", 0, shape, -1, (x, y, 0.5))
        bearings = CLEAN.angles + theta
        with np.errstate(divide="ignore"):
            walls = [
                (3 * np.sign(np.cos(bearings)) - 1.0) / np.cos(bearings),
                (2 * np.sign(np.sin(bearings)) - 0.5) / np.sin(bearings),
            ]
        expected = np.min([np.where(wall > 0, wall, np.inf) for wall in walls], axis=0)
        assert np.allclose(cast(room, (1.0, 0.5, theta), CLEAN.angles, 8.0), expected, atol=1e-6)


def test_all_background_and_objects_stand_in_the_world(empty):
    """The laser meets walls, the last furniture in the list, and a can as the disc that it is."""
    eye = np.array([4.5, 3.0])
    ahead = cast(empty, (*eye, np.pi / 2), np.zeros(1), 8.0)[0]
    assert ahead == pytest.approx(ROOM[1] - 3.0, abs=1e-6)
    stool = np.array([7.2, 1.10]) - eye
    bearing = np.arctan2(stool[1], stool[0])
    to_stool = cast(empty, (*eye, bearing), np.zeros(1), 8.0)[0]
    assert to_stool == pytest.approx(np.linalg.norm(stool) - 0.06, abs=1e-6)
    with World(figure_eight_scene()) as world:
        angles = np.deg2rad([-5.0, -3.0, 0.0, 2.0, 4.5])
        ranges = cast(world, (2.5, 2.1, np.pi / 2), angles, 8.0)
        beams = np.column_stack([-np.sin(angles), np.cos(angles)])
        expected = [disc_distance((2.5, 2.1), beam, (2.5, 3.6), 0.18) for beam in beams]
        assert ranges == pytest.approx(expected, abs=1e-3)


def test_a_torso_is_a_stadium_to_the_laser(empty):
    """A person facing the laser shows half a depth before the middle, as wide as shoulders."""
    empty.place_person(np.array([4.5, 4.0]), -np.pi / 2)
    angles = np.deg2rad(np.arange(-20, 20.01, 0.1))
    ranges = cast(empty, (4.5, 2.0, np.pi / 2), angles, 8.0)
    seen = ranges < 2.1
    empty.remove_person()
    assert ranges.min() == pytest.approx(2.0 - DEPTH / 2, abs=1e-3)
    assert np.ptp(angles[seen]) == pytest.approx(2 * np.arctan(SHOULDERS / 2 / 2.0), abs=0.01)


def test_two_legs_show_as_two():
    """With legs asked for, a gap lies between two returns of a person's width."""
    with World(empty_scene(), legs=True) as world:
        world.place_person(np.array([4.5, 4.0]), -np.pi / 2, phase=np.pi / 2)
        angles = np.deg2rad(np.arange(-10, 10.01, 0.25))
        seen = cast(world, (4.5, 2.0, np.pi / 2), angles, 8.0) < 2.5
    assert np.count_nonzero(np.diff(seen.astype(int)) == 1) == 2


def test_a_can_hides_the_person_behind_it():
    """Sideways on and straight behind a can the person is invisible, and beside it is not."""
    scene = figure_eight_scene()
    pose = laser_pose(scene.robot)
    can = scene.positions[0]
    away = (can - pose[:2]) / np.linalg.norm(can - pose[:2])
    heading = np.arctan2(away[0], -away[1])
    with World(scene) as world:
        without = CLEAN.scan(world, pose, np.random.default_rng(0))
        world.place_person(can + 1.0 * away, heading)
        assert np.array_equal(CLEAN.scan(world, pose, np.random.default_rng(0)), without)
        world.place_person(can + 1.0 * away + 0.4 * np.array([-away[1], away[0]]), heading)
        assert np.count_nonzero(CLEAN.scan(world, pose, np.random.default_rng(0)) != without) >= 2


def test_the_robot_does_not_see_itself(empty, robot):
    """With the robot in the world the scan is the same as without."""
    with_robot = CLEAN.scan(empty, laser_pose(robot.pose), np.random.default_rng(0))
    pose = laser_pose(robot.pose)
    robot.place((2.0, 5.0, 0.0))
    assert np.array_equal(with_robot, CLEAN.scan(empty, pose, np.random.default_rng(0)))


def test_a_recording_is_what_laser_and_walker_did():
    """Scans come at 10 Hz from the laser's pose, the truth is the walk's, returns lie on it."""
    scene = figure_eight_scene()
    walk = figure_eight(scene, 1, laps=1)
    recording = record(scene, walk, 2)
    log, truth = recording.log, recording.truth
    assert log.ranges.shape == (len(truth), 181) and np.allclose(np.diff(log.t), 0.1)
    assert np.allclose(log.poses, laser_pose(scene.robot))
    assert np.allclose(truth[["x", "y"]].iloc[50], walk.at(log.t[50])[0])
    assert truth["heading"].abs().max() <= np.pi
    bearing = np.arctan2(truth["y"] - log.poses[0, 1], truth["x"] - log.poses[0, 0]) - np.pi / 2
    distance = np.hypot(truth["x"] - log.poses[0, 0], truth["y"] - log.poses[0, 1])
    beam = np.round(np.rad2deg(bearing) + 90).astype(int)
    short = distance - log.ranges[np.arange(len(log)), beam]
    on_body = (short > 0.05) & (short < 0.3)
    assert on_body.mean() > 0.9


def test_the_same_seed_records_the_same_recording():
    """Recordings are determined by their seed, in a fresh world each."""
    one, same, other = (record_figure_eights(seed, laps=1) for seed in (4, 4, 5))
    assert np.array_equal(one.log.ranges, same.log.ranges)
    assert one.truth.equals(same.truth)
    assert len(one.log) != len(other.log) or not np.array_equal(one.log.ranges, other.log.ranges)


def test_the_background_drive_sees_what_the_watching_robot_sees():
    """Every return of the watching robot has one of the tour's within 10 cm; drives are alike."""
    tour, again = record_background(0), record_background(0)
    assert np.array_equal(tour.ranges, again.ranges) and np.array_equal(tour.poses, again.poses)
    bearings = tour.angles + tour.poses[:, 2:]
    directions = np.stack([np.cos(bearings), np.sin(bearings)], -1)
    points = tour.poses[:, None, :2] + tour.ranges[..., None] * directions
    pose = laser_pose(empty_scene().robot)
    with World(empty_scene()) as world:
        ranges = CLEAN.scan(world, pose, np.random.default_rng(0))
    seen = pose[:2] + ranges[:, None] * np.column_stack(
        [np.cos(CLEAN.angles + pose[2]), np.sin(CLEAN.angles + pose[2])]
    )
    from scipy.spatial import cKDTree

    assert cKDTree(points[np.isfinite(tour.ranges)]).query(seen)[0].max() < 0.10


def test_pictures_show_a_red_robot_and_come_out_the_same():
    """The robot's picture is reproducible and has red hull, black deck and blue laser in it."""
    from dollop.lab.render import render_robot

    picture = render_robot(160, 120)
    assert picture.shape == (120, 160, 3) and np.array_equal(picture, render_robot(160, 120))
    red, green, blue = picture.reshape(-1, 3).astype(int).T
    assert np.mean((red > 90) & (green < 50) & (blue < 50)) > 0.03
    assert np.mean((blue > red + 25) & (blue > 90)) > 0.03


def test_a_walker_shows_in_the_picture_of_the_lab():
    """A person and cones in the picture change it where they stand."""
    from dollop.lab.render import render_lab

    scene = Scene(("cone",), [(4.5, 3.6)])
    bare = render_lab(empty_scene(), width=120, height=90).astype(int)
    walker = np.array([3.0, 3.0]), 0.0, 1.0
    full = render_lab(scene, walker, width=120, height=90).astype(int)
    assert 0.002 < np.mean(np.abs(full - bare).max(axis=2) > 30) < 0.2
