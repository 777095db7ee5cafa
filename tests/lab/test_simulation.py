"""The laboratory in PyBullet: laser, robot, people, recordings and pictures against geometry."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from places import DATA
from scipy.spatial import cKDTree

pytest.importorskip("pybullet", reason="the laboratory needs PyBullet (extra `lab`)")

from dollop import OccupancyGrid, localise
from dollop.lab.driving import ARRIVED
from dollop.lab.engine import Engine, Solid
from dollop.lab.outlines import outline_distances
from dollop.lab.person import DEPTH, SHOULDERS, Walk, figure_eight
from dollop.lab.pioneer import Pioneer
from dollop.lab.recording import Recording
from dollop.lab.rooms import LABORATORY, Room
from dollop.lab.scanner import SickLMS200, SickTiM571
from dollop.lab.scenes import Scene, empty_scene, figure_eight_scene
from dollop.lab.simulate import record, record_background, record_figure_eights, record_tour, watch
from dollop.lab.things import Move, Object, Person, Robot
from dollop.lab.world import World
from dollop.pose import between, composed

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
    empty.engine.remove(robot.body)


def standing(position, heading, body="torso", phase=0.0):
    """Somebody who stands somewhere, in mid-stride."""
    return Walk(np.array([0.0, 1.0]), np.tile(position, (2, 1)), np.full(2, heading), np.full(2, phase), body)


def directions(pose, angles):
    """Unit vectors (B, 2) of beams from a pose."""
    return np.column_stack([np.cos(angles + pose[2]), np.sin(angles + pose[2])])


def disc_distance(start, direction, centre, radius):
    """Distance from `start` along a unit vector to a disc, `inf` beside it."""
    away = np.asarray(centre) - start
    along = away @ direction
    height = np.linalg.norm(away - along * direction)
    return along - np.sqrt(radius**2 - height**2) if height < radius and along > 0 else np.inf


@pytest.mark.parametrize("theta", [0.0, 0.9, np.pi])
def test_rays_measure_a_bare_room_exactly(theta):
    """In a box room of 6 m by 4 m every beam equals the analytic distance to the wall."""
    with Engine() as engine:
        sides = [(3.5, 0, (1, 6, 2)), (-3.5, 0, (1, 6, 2)), (0, 2.5, (8, 1, 2)), (0, -2.5, (8, 1, 2))]
        for x, y, size in sides:
            engine.add([Solid("box", size, (0.0, 0.0, 0.0))], (x, y, 0.5))
        bearings = CLEAN.angles + theta
        with np.errstate(divide="ignore"):
            walls = [
                (3 * np.sign(np.cos(bearings)) - 1.0) / np.cos(bearings),
                (2 * np.sign(np.sin(bearings)) - 0.5) / np.sin(bearings),
            ]
        expected = np.min([np.where(wall > 0, wall, np.inf) for wall in walls], axis=0)
        beams = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))])
        assert np.allclose(engine.cast(np.array([1.0, 0.5, 0.36]), beams, 8.0), expected, atol=1e-6)


def test_a_body_of_many_solids_is_met_in_all_its_parts():
    """Of forty posts in a row none is left out, though PyBullet takes sixteen at a time."""
    with Engine() as engine:
        engine.add([Solid("box", (0.1, 0.1, 1.0), (3.0, 0.5 * k, 0.5)) for k in range(40)])
        ahead = np.array([[1.0, 0.0, 0.0]])
        seen = [engine.cast(np.array([0.0, 0.5 * k, 0.5]), ahead, 8.0)[0] for k in range(40)]
        between = engine.cast(np.array([0.0, 0.25, 0.5]), ahead, 8.0)[0]
    assert seen == pytest.approx([2.95] * 40, abs=1e-6) and between == np.inf


def test_all_background_and_objects_stand_in_the_world(empty):
    """The laser meets walls, the last furniture in the list, and a can as the disc that it is."""
    eye = np.array([4.5, 3.0])
    ahead = empty.cast((*eye, np.pi / 2), np.zeros(1), 8.0)[0]
    assert ahead == pytest.approx(LABORATORY.bounds[3] - 3.0, abs=1e-6)
    stool = np.array([7.2, 1.10]) - eye
    bearing = np.arctan2(stool[1], stool[0])
    to_stool = empty.cast((*eye, bearing), np.zeros(1), 8.0)[0]
    assert to_stool == pytest.approx(np.linalg.norm(stool) - 0.06, abs=1e-6)
    with World(figure_eight_scene()) as world:
        angles = np.deg2rad([-5.0, -3.0, 0.0, 2.0, 4.5])
        ranges = world.cast((2.5, 2.1, np.pi / 2), angles, 8.0)
    beams = directions((2.5, 2.1, np.pi / 2), angles)
    expected = [disc_distance((2.5, 2.1), beam, (2.5, 3.6), 0.18) for beam in beams]
    assert ranges == pytest.approx(expected, abs=1e-3)


def test_a_torso_is_a_stadium_to_the_laser():
    """A person facing the laser shows half a depth before the middle, as wide as shoulders."""
    angles = np.deg2rad(np.arange(-20, 20.01, 0.1))
    with World(empty_scene(), [standing((4.5, 4.0), -np.pi / 2)]) as world:
        world.at(0.0)
        ranges = world.cast((4.5, 2.0, np.pi / 2), angles, 8.0)
    seen = ranges < 2.1
    assert ranges.min() == pytest.approx(2.0 - DEPTH / 2, abs=1e-3)
    assert np.ptp(angles[seen]) == pytest.approx(2 * np.arctan(SHOULDERS / 2 / 2.0), abs=0.01)


def test_two_legs_show_as_two():
    """With legs asked for, a gap lies between two returns of a person's width."""
    angles = np.deg2rad(np.arange(-10, 10.01, 0.25))
    with World(empty_scene(), [standing((4.5, 4.0), -np.pi / 2, "legs", np.pi / 2)]) as world:
        world.at(0.0)
        seen = world.cast((4.5, 2.0, np.pi / 2), angles, 8.0) < 2.5
    assert np.count_nonzero(np.diff(seen.astype(int)) == 1) == 2


def test_people_are_out_of_the_way_until_they_are_placed(empty):
    """Before the first call of `at` nobody is seen, and afterwards somebody is."""
    pose = empty.scene.robot.laser_pose
    without = empty.cast(pose, CLEAN.angles, 8.0)
    with World(empty_scene(), [standing((4.5, 3.0), 0.0), standing((5.5, 3.0), 0.0, "legs")]) as world:
        assert np.array_equal(world.cast(pose, CLEAN.angles, 8.0), without)
        world.at(0.0)
        assert np.count_nonzero(world.cast(pose, CLEAN.angles, 8.0) != without) > 5


def test_a_can_hides_the_person_behind_it():
    """Sideways on and straight behind a can the person is invisible, and beside it is not."""
    scene = figure_eight_scene()
    pose, can = scene.robot.laser_pose, scene.positions[0]
    away = (can - pose[:2]) / np.linalg.norm(can - pose[:2])
    aside, heading = np.array([-away[1], away[0]]), np.arctan2(away[0], -away[1])
    ranges = []
    for people in ([], [standing(can + away, heading)], [standing(can + away + 0.4 * aside, heading)]):
        with World(scene, people) as world:
            world.at(0.0)
            ranges.append(world.scan(pose, np.random.default_rng(0), CLEAN))
    without, behind, beside = ranges
    assert np.array_equal(behind, without)
    assert np.count_nonzero(beside != without) >= 2


def test_the_robot_does_not_see_itself(empty, robot):
    """With the robot in the world the scan is the same as without."""
    pose = robot.laser_pose
    with_robot = empty.scan(pose, np.random.default_rng(0), CLEAN)
    robot.place((2.0, 5.0, 0.0))
    assert np.array_equal(with_robot, empty.scan(pose, np.random.default_rng(0), CLEAN))


# ---- recordings


def test_a_recording_is_what_laser_and_walker_did():
    """Scans come at 10 Hz from the laser's pose, the truth is the walk's, returns lie on it."""
    scene = figure_eight_scene()
    walk = figure_eight(scene, 1, laps=1)
    recording = record(scene, 2, [walk])
    log, truth = recording.log, recording.truth
    assert log.ranges.shape == (len(truth), 181) and np.allclose(np.diff(log.t), 0.1)
    assert np.allclose(log.poses, scene.robot.laser_pose)
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


@pytest.mark.parametrize("scanner", [SickTiM571(noise=0.0, mixed=0.0), SickLMS200(180, 0.5, noise=0.0, mixed=0.0)])
def test_a_recording_is_as_its_scanner_scans(scanner):
    """Times, bearings and reach of the log are those of the scanner on the robot, and so is what the beams meet."""
    scene = replace(figure_eight_scene(), robot=Robot(scanner=scanner))
    log = watch(scene, 0, duration=1.0).log
    assert np.diff(log.t) == pytest.approx(1 / scanner.rate) and len(log) == round(scanner.rate)
    assert np.array_equal(log.angles, scanner.angles) and log.max_range == scanner.max_range
    ends = log.poses[0, :2] + log.ranges[0][:, None] * directions(log.poses[0], log.angles)
    ends = ends[np.isfinite(log.ranges[0]) & (log.ranges[0] > scanner.min_range)]
    assert np.abs(outline_distances(ends, scene.section)).min(axis=1).max() < 0.002


def test_nobody_and_no_duration_is_no_recording():
    """A scene in which nobody walks needs a duration; watched, its truth has no rows."""
    with pytest.raises(ValueError, match="needs a first person who walks, or a duration, got neither"):
        record(empty_scene(), 0)
    with pytest.raises(ValueError, match="needs a first person who walks, or a duration, got neither"):
        record(Scene(people=[Person([(3.0, 3.0)]), Person([(2.0, 5.0), (6.0, 5.0)])]), 0)
    for duration, rule in [("5", "finite number, got '5'"), (1e6, "in 0 to 86400, got 1000000.0"), (-1.0, "in 0 to")]:
        with pytest.raises(ValueError, match=f"duration must be .*{rule}"):
            watch(empty_scene(), 0, duration)
    recording = watch(empty_scene(), 0, duration=0.5)
    assert len(recording.log) == 5 and recording.truth.empty


WAY = [(4.5, 1.2), (6.5, 2.0), (7.0, 4.0), (4.5, 5.0), (2.5, 4.5)]
PEOPLE = [Person([(2.0, 2.0), (3.0, 5.0), (6.0, 5.0)]), Person([(1.5, 4.0)], body="legs"), Person([(8.0, 3.0)])]


@pytest.fixture(scope="module")
def busy():
    """A recording without noise: one walks, two stand, a box is moved, and the robot drives about."""
    robot = Robot(scanner=SickLMS200(noise=0.0, mixed=0.0), way=WAY, speed=0.4)
    box = Object("box", (5.0, 3.5), (0.4, 0.6), 0.8, turn=0.5)
    move = Move(1, 3.0, (4.0, 3.5), 2.0)
    scene = Scene([Object.trash_can((2.5, 3.3)), box], robot=robot, people=PEOPLE, moves=[move])
    return record(scene, 3, duration=32.0)


def test_the_truth_names_everything_that_moves(busy):
    """A column of its own for everybody's place and heading, for the moved object's place and the laser's pose."""
    people = ["x", "y", "heading", "x_1", "y_1", "heading_1", "x_2", "y_2", "heading_2"]
    names = ["t", *people, "object_x_1", "object_y_1", "laser_x", "laser_y", "laser_theta"]
    assert busy.truth.columns.tolist() == names and np.array_equal(busy.truth["t"], busy.log.t)
    assert np.ptp(busy.truth[people[3:]], axis=0).tolist() == [0.0] * 6
    assert busy.truth[["x_1", "y_1", "x_2", "y_2"]].iloc[0].tolist() == [1.5, 4.0, 8.0, 3.0]
    assert np.ptp(busy.truth["x"]) > 3.5
    share = np.clip((busy.log.t - 3.0) / 2.0, 0.0, 1.0)
    assert np.allclose(busy.truth[["object_x_1", "object_y_1"]], np.column_stack([5.0 - share, 0 * share + 3.5]))


def test_a_recording_survives_saving(busy, tmp_path):
    """Log, truth and scene are the same after they were written and read, to a tenth of a millimetre."""
    busy.save(tmp_path / "busy.log.gz")
    back = Recording.load(tmp_path / "busy.log.gz")
    assert np.allclose(back.log.ranges, busy.log.ranges, atol=1e-9)
    assert np.allclose(back.log.poses, busy.log.poses, atol=1e-4)
    pd.testing.assert_frame_equal(back.truth, busy.truth, atol=1e-4, rtol=0)
    assert back.scene.to_dict() == busy.scene.to_dict()


def test_a_log_by_odometry_is_localised(busy):
    """Among people and things that the map does not have, drifting poses are put right to 5 cm and 2 degrees."""
    background = OccupancyGrid.load(DATA / "lab.yaml")
    truth = busy.truth[["laser_x", "laser_y", "laser_theta"]].to_numpy()
    for start in (np.zeros(3), np.array([30.0, 5.0, 2.0])):  # told, and searched for
        log = replace(busy.log, poses=composed(start, busy.log.poses))
        found = localise(log, None, background)
        apart = between(truth, found.poses)
        assert np.hypot(*apart[:, :2].T).mean() < 0.05 and np.degrees(np.abs(apart[:, 2])).mean() < 2
        assert not found.notes


def test_odometry_drifts_from_the_truth(busy):
    """What the log has of its poses begins at the true one, and is off by some of the way at its end."""
    true = busy.truth[["laser_x", "laser_y", "laser_theta"]].to_numpy()
    off = np.linalg.norm(busy.log.poses[:, :2] - true[:, :2], axis=1)
    way = np.linalg.norm(np.diff(true[:, :2], axis=0), axis=1).sum()
    assert off[0] < 1e-6 and way > 8.0
    assert 0.01 * way < off[-1] < 0.1 * way


def off_the_record(recording, poses):
    """From the end of every beam, taken to begin at given poses, the distance (T, B) to the nearest of what stands."""
    scene, log = recording.scene, recording.log
    walls = [part.outline for part in scene.room.parts if part.reaches(scene.robot.beam_height)]
    result = np.full(log.ranges.shape, np.nan)
    for k, row in enumerate(recording.truth.itertuples()):
        box = scene.objects[1].at((row.object_x_1, row.object_y_1))
        objects = [each.outline(scene.robot.beam_height) for each in (scene.objects[0], box)]
        ends = poses[k, :2] + log.ranges[k][:, None] * directions(poses[k], log.angles)
        people = np.linalg.norm(ends[:, None] - [(row.x, row.y), (row.x_1, row.y_1), (row.x_2, row.y_2)], axis=2)
        counted = np.isfinite(log.ranges[k]) & (log.ranges[k] > 0.2) & (people.min(axis=1) > 0.5)
        result[k, counted] = np.abs(outline_distances(ends[counted], walls + objects)).min(axis=1)
    return result


def test_scans_are_taken_from_the_true_pose(busy):
    """From the laser's true poses beams end on walls, furniture, can and box to 2 mm; from the odometry they do not."""
    true = off_the_record(busy, busy.truth[["laser_x", "laser_y", "laser_theta"]].to_numpy())
    believed = off_the_record(busy, busy.log.poses)
    assert np.isfinite(true).mean() > 0.8 and np.nanmax(true) < 0.002
    assert np.nanmedian(believed[-20:]) > 0.01


def test_a_driving_robot_goes_its_way_and_stops(busy):
    """It believes to pass 0.3 m or less from every place of its way in turn, no faster than told, and then stands."""
    nearest = np.linalg.norm(busy.log.poses[:, None, :2] - WAY, axis=2)
    assert nearest.min(axis=0).max() < 0.3 and (np.diff(nearest.argmin(axis=0)) > 0).all()
    steps = np.linalg.norm(np.diff(busy.truth[["laser_x", "laser_y"]], axis=0), axis=1)
    speeds = steps / np.diff(busy.log.t)
    assert 0.38 < speeds.max() < 0.42 and speeds[-5:].max() < 0.01


def test_the_background_drive_sees_what_the_watching_robot_sees():
    """Every return of the watching robot has one of the tour's within 10 cm; drives are alike."""
    tour, again = record_background(0), record_background(0)
    assert np.array_equal(tour.ranges, again.ranges) and np.array_equal(tour.poses, again.poses)
    bearings = tour.angles + tour.poses[:, 2:]
    beams = np.stack([np.cos(bearings), np.sin(bearings)], -1)
    points = tour.poses[:, None, :2] + tour.ranges[..., None] * beams
    pose = empty_scene().robot.laser_pose
    with World(empty_scene()) as world:
        ranges = world.scan(pose, np.random.default_rng(0), CLEAN)
    seen = pose[:2] + ranges[:, None] * directions(pose, CLEAN.angles)
    assert cKDTree(points[np.isfinite(tour.ranges)]).query(seen)[0].max() < 0.10


def test_a_tour_looks_all_round_at_every_place():
    """It scans in straight lines from place to place, turns once round at each, and its beams end on the record."""
    places = np.array([(3.0, 3.0), (6.0, 3.0), (6.0, 4.5)])
    scene = Scene(robot=Robot(scanner=replace(CLEAN, model="my own", max_range=20.0)))
    log = record_tour(scene, places, 0, stride=0.2, turns=8)
    there = np.abs(log.poses[:, None, :2] - places).max(axis=2) < 1e-9
    assert there.sum(axis=0).tolist() == [8, 8, 8] and len(log) == 3 * 8 + 14 + 7
    for at in there.T:
        turns = np.diff(np.unwrap(log.poses[at, 2]))
        assert turns == pytest.approx(np.pi / 4)
    on_the_way = log.poses[~there.any(axis=1), :2]
    assert np.minimum(np.abs(on_the_way[:, 1] - 3.0), np.abs(on_the_way[:, 0] - 6.0)).max() < 1e-9
    for pose, ranges in zip(log.poses, log.ranges, strict=True):
        ends = pose[:2] + ranges[:, None] * directions(pose, log.angles)
        assert np.abs(outline_distances(ends, scene.section)).min(axis=1).max() < 0.002


BAD_TOURS = [
    ({"places": [(3.0, 3.0), (3.0, 7.5)]}, r"must be in the room and free, got \[\[3.0, 3.0\], \[3.0, 7.5\]\]"),
    ({"places": [(3.0, 3.0), (8.8, 5.95)]}, "must be in the room and free"),
    ({"places": []}, "places must have shape|must be in the room and free"),
    ({"places": [(3.0, np.nan)]}, r"places must be finite, got \[3.0, nan\] in row 0"),
    ({"stride": 0.0}, "stride must be in 0.01 to 1e.09, got 0.0"),
    ({"stride": "1"}, "stride must be a finite number, got '1'"),
    ({"turns": 0}, "turns must be in 1 to 1e.09, got 0"),
]


@pytest.mark.parametrize(("said", "rule"), BAD_TOURS)
def test_a_tour_that_cannot_be_is_refused(said, rule):
    """A place outside the room or in furniture, none at all, and a number out of its range raise ValueError."""
    with pytest.raises(ValueError, match=rule):
        record_tour(**({"scene": empty_scene(), "places": [(3.0, 3.0), (6.0, 3.0)], "seed": 0} | said))


HALL = Scene(room=Room([(0, 0), (4, 0), (4, 3), (0, 3)]), robot=Robot((1.0, 1.0, 0.0)))


def test_another_room_needs_a_tour_of_its_own():
    """Without one ValueError says so; with one the robot drives to its places, and there are walls all round."""
    with pytest.raises(ValueError, match="another room needs a tour of its own, got none"):
        record_background(0, scene=HALL)
    log = record_background(0, SickLMS200(mode="cm", noise=0.0, mixed=0.0), HALL, [(2.5, 1.0), (2.5, 2.0)])
    nearest = np.linalg.norm(log.poses[:, None, :2] - [(2.5, 1.0), (2.5, 2.0)], axis=2).min(axis=0)
    assert nearest.max() < ARRIVED + 0.05 and np.isfinite(log.ranges).all()


@pytest.mark.parametrize("goal", [(9.0, 1.0), (2.0, -0.5)])
def test_a_tour_to_a_place_that_is_not_reached_ends(monkeypatch, goal):
    """A place behind a wall raises ValueError that names it, when the robot has had time enough."""
    monkeypatch.setattr("dollop.lab.simulate.PATIENCE", 2.0)
    with pytest.raises(ValueError, match=rf"must be free .*, got \[{goal[0]}, {goal[1]}\], not reached within 2 s"):
        record_background(0, scene=HALL, tour=[goal])


def test_a_tour_of_no_places_is_refused():
    """Numbers that are none, and places of three coordinates, raise ValueError that names the tour."""
    for tour, rule in [([(1.0, np.nan)], "tour must be finite"), ([(1.0, 1.0, 0.0)], r"tour must have shape \(N, 2\)")]:
        with pytest.raises(ValueError, match=rule):
            record_background(0, scene=HALL, tour=tour)


# ---- pictures


BAD_PIXELS = [(0, "in 1 to 10000, got 0"), (-10, "in 1 to 10000, got -10"), ("90", "a finite number, got '90'")]


@pytest.mark.parametrize(("pixels", "rule"), BAD_PIXELS)
@pytest.mark.parametrize("name", ["width", "height"])
def test_a_picture_has_pixels(name, pixels, rule):
    """None, fewer than none and text for a number of pixels raise ValueError that names which."""
    from dollop.lab.render import render_lab

    with pytest.raises(ValueError, match=f"{name} must be {rule}"):
        render_lab(**({"width": 120, "height": 90} | {name: pixels}))


def test_pictures_show_a_red_robot_and_come_out_the_same():
    """The robot's picture is reproducible and has red hull, black deck and blue laser in it."""
    from dollop.lab.render import render_robot

    picture = render_robot(160, 120)
    assert picture.shape == (120, 160, 3) and np.array_equal(picture, render_robot(160, 120))
    red, green, blue = picture.reshape(-1, 3).astype(int).T
    assert np.mean((red > 90) & (green < 50) & (blue < 50)) > 0.03
    assert np.mean((blue > red + 25) & (blue > 90)) > 0.03


def test_walkers_show_in_the_picture_of_the_lab():
    """A cone and people in the picture change it where they stand, each for itself."""
    from dollop.lab.render import render_lab

    scene, small = Scene([Object.cone((4.5, 3.6))]), {"width": 120, "height": 90}
    bare = render_lab(empty_scene(), **small).astype(int)
    people = [(np.array([3.0, 3.0]), 0.0, 1.0), (np.array([6.0, 3.0]), 1.0, 2.0)]
    changed = [
        np.mean(np.abs(render_lab(scene, people[:count], **small) - bare).max(axis=2) > 30) for count in (0, 1, 2)
    ]
    assert 0.0005 < changed[0] < changed[1] - 0.002 < changed[2] - 0.004 and changed[2] < 0.2
