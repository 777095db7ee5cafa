"""Localising a whole log: known poses are recovered, and what is not sure is said."""

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rooms import ANGLES, CANS, FURNITURE, WALLS, drawn_map, room_map, scan

from dollop import localise
from dollop.checks import Note
from dollop.formats import Odometry, read_log, read_odometry
from dollop.gridmap import OccupancyGrid
from dollop.laser import LaserLog
from dollop.pose import between, composed
from dollop.robot import localising
from dollop.robot.localising import (
    KEYS,
    _banded_step,
    _Course,
    _Scans,
    _Search,
    _Springs,
    _step_derivatives,
    _thinned,
)
from dollop.robot.localization import Localisation, MonteCarloLocalizer

RULES = Localisation()
ROOM = np.vstack([WALLS, FURNITURE])
START = np.array([1.5, 2.2, 0.2])
STEPS = np.column_stack([np.full(119, 0.05), np.zeros(119), 0.04 * np.sin(np.arange(119) / 15)])
DRIFT = np.array([1.05, 1.0, 0.92])
FRAME = np.array([40.0, -7.0, 2.0])


def followed(start, steps):
    """Poses (N + 1, 3) from a start by steps (N, 3)."""
    poses = [np.asarray(start, float)]
    for step in steps:
        poses.append(composed(poses[-1], step))
    return np.array(poses)


def recorded(poses, by_odometry, boxes=ROOM, seed=0):
    """A log of a room: scans from the true poses, and what odometry made of them."""
    rng = np.random.default_rng(seed)
    ranges = [scan(pose, boxes, rng) for pose in poses]
    t = 5.0 + np.arange(len(poses)) / 10
    return LaserLog(t, np.minimum(ranges, 20.0), ANGLES, by_odometry, 20.0)


def errors(log, truth):
    """Distances (T,) in m and angles (T,) in degrees from true poses."""
    apart = between(truth, log.poses)
    return np.hypot(*apart[:, :2].T), np.degrees(np.abs(apart[:, 2]))


def assert_found(log, truth, most=0.04):
    """All poses to a few cm and degrees, none in doubt."""
    place, turn = errors(log, truth)
    assert place.mean() < most and place.max() < 3 * most and turn.mean() < 1 and turn.max() < 3
    assert not log.notes


def crowd(scans):
    """Ranges (scans, B) in m of a laser that people stand around."""
    return np.random.default_rng(9).uniform(0.3, 1.2, (scans, len(ANGLES)))


@pytest.fixture(scope="module")
def background():
    return room_map()


TRUTH = followed(START, STEPS)
DRIFTING = followed(START, STEPS * DRIFT)


@pytest.mark.parametrize("boxes", [ROOM, np.vstack([ROOM, CANS])], ids=["as mapped", "with cans"])
def test_drifting_poses_are_put_right(background, boxes):
    """Odometry that ends half a metre off is put right to a few centimetres; scans and times stay."""
    log = recorded(TRUTH, DRIFTING, boxes)
    assert errors(log, TRUTH)[0][-1] > 0.4
    found = localise(log, None, background)
    assert_found(found, TRUTH)
    assert np.array_equal(found.ranges, log.ranges) and np.array_equal(found.t, log.t)


def test_a_large_map_is_localised_on_tile_by_tile(background, monkeypatch):
    """Made of tiles, of which a beam may end in any, the springs are the same wherever anything pulls."""
    log = recorded(TRUTH, composed(FRAME, DRIFTING))
    points = np.random.default_rng(0).uniform(-3, 12, (300, 40, 2))
    whole, (half, *pulls) = localise(log, None, background), _Springs(background, RULES).at(points)
    monkeypatch.setattr(localising, "TILE", 50)
    tiled = _Springs(background, RULES)
    assert len(tiled._made) == 20
    for one, other in zip((half, *pulls), tiled.at(points), strict=True):
        assert np.array_equal(one[half < 1.9], other[half < 1.9])
    assert np.abs(localise(log, None, background).poses - whole.poses).max() < 1e-6


def test_tiles_are_made_when_a_beam_ends_there(background, monkeypatch):
    """A robot in one corner of a hall needs but that."""
    monkeypatch.setattr(localising, "TILE", 50)
    springs = _Springs(background, RULES)
    springs.at(np.array([[0.2, 0.2], [0.3, 0.1]]))
    assert springs._made.sum() == 1


def test_odometry_of_a_frame_of_its_own(background):
    """A start that nothing tells is searched for."""
    assert_found(localise(recorded(TRUTH, composed(FRAME, DRIFTING)), None, background), TRUTH)


def test_odometry_of_its_own_rate_and_of_a_robot(background):
    """It is taken at the scans' times, and the laser is where it is mounted."""
    mount = np.array([0.3, 0.1, -0.4])
    log = recorded(TRUTH, 0 * TRUTH)
    robot = composed(TRUTH, between(mount, np.zeros(3)))
    driven = composed(FRAME, followed(robot[0], between(robot[:-1], robot[1:]) * DRIFT))
    times = np.append(log.t - 0.05, log.t[-1] + 0.05)
    poses = np.vstack([driven, driven[-1]])
    poses[1:-1, :2] = (driven[:-1, :2] + driven[1:, :2]) / 2
    odometry = Odometry(times, poses, np.zeros((len(times), 2)))
    assert_found(localise(log, odometry, background, laser=mount), TRUTH)


def test_a_robot_that_is_carried_is_found_again(background):
    """Odometry that misses a jump is no tie across it: both sides are right, and nothing is in doubt."""
    other = followed([7.5, 5.0, -2.8], STEPS[:60])
    truth = np.vstack([TRUTH[:60], other])
    by_odometry = followed(START, np.vstack([STEPS[:59], np.zeros((1, 3)), STEPS[:60]]) * DRIFT)
    found = localise(recorded(truth, by_odometry), None, background)
    place, _ = errors(found, truth)
    assert np.delete(place, [60, 61, 62]).max() < 0.12
    assert place.mean() < 0.1


def test_a_stretch_that_the_map_does_not_explain(background):
    """In a crowd round the laser the odometry leads on, and no doubt remains where the map takes over again."""
    log = recorded(TRUTH, DRIFTING)
    ranges = log.ranges.copy()
    ranges[50:60] = crowd(10)
    assert_found(localise(replace(log, ranges=ranges), None, background), TRUTH)


def test_an_end_that_the_map_does_not_explain(background):
    """What comes after the last scan that fits is a guess by odometry, and a note says how much that is."""
    log = recorded(TRUTH, DRIFTING)
    ranges = log.ranges.copy()
    ranges[90:] = crowd(30)
    found = localise(replace(log, ranges=ranges), None, background)
    assert [(note.kind, note.doubt) for note in found.notes] == [("poses", True)]
    assert found.notes[0].text.startswith("25.0% of the scans could not be localised")
    assert errors(found, TRUTH)[0][:90].max() < 0.12
    np.testing.assert_allclose(between(found.poses[89], found.poses[-1]), between(DRIFTING[89], DRIFTING[-1]), atol=0.1)


def test_a_beginning_that_the_map_does_not_explain(background):
    """What comes before the first scan that fits is found backwards from there."""
    log = recorded(TRUTH, composed(FRAME, DRIFTING))
    ranges = log.ranges.copy()
    ranges[:5] = crowd(5)
    found = localise(replace(log, ranges=ranges), None, background)
    assert errors(found, TRUTH)[0][5:].max() < 0.12
    assert [note.kind for note in found.notes] == ["poses"] and "4.2% of the scans" in found.notes[0].text


HALL = np.array([[-0.1, 0, 0, 5], [8, 0, 8.1, 5], [-0.1, -0.1, 8.1, 0], [-0.1, 5, 8.1, 5.1]])


def test_a_room_that_looks_alike_from_two_sides():
    """Told where it starts, the robot is right; not told, it may be at either of two places, and says so."""
    hall = drawn_map(HALL, 8.0, 5.0)
    truth = followed([2.0, 1.5, 0.4], STEPS[:60])
    drifting = followed(truth[0], STEPS[:60] * DRIFT)
    assert_found(localise(recorded(truth, drifting, HALL), None, hall), truth)
    found = localise(recorded(truth, composed(FRAME, drifting), HALL), None, hall)
    other = composed([8.0, 5.0, np.pi], truth)
    assert min(errors(found, each)[0].max() for each in (truth, other)) < 0.12
    assert [(note.kind, note.doubt) for note in found.notes] == [("poses", True)]
    assert "looks alike from another place" in found.notes[0].text


def test_a_corridor_whose_ends_are_out_of_sight():
    """Across it the poses are right; along it nothing tells, and a note says so."""
    walls = np.array([[0, -0.1, 60, 0], [0, 2.0, 60, 2.1]])
    truth = followed([30.0, 1.2, 0.0], np.tile([0.05, 0.0, 0.0], (60, 1)))
    drifting = followed(truth[0], np.tile([0.055, 0.0, 0.001], (60, 1)))
    log = recorded(truth, drifting, walls)
    log = replace(log, ranges=np.where(log.ranges < 12, log.ranges, np.inf))
    found = localise(log, None, drawn_map(walls, 60.0, 2.0))
    assert np.abs(found.poses - truth)[:, 1].max() < 0.03
    assert [(note.kind, note.doubt) for note in found.notes] == [("poses", True)]
    assert "along one direction, as in a corridor" in found.notes[0].text


def test_a_strange_room_is_refused(background):
    """Where the map explains nothing, no pose is told."""
    circle = np.column_stack([3 * np.cos(np.arange(40) / 6), 3 * np.sin(np.arange(40) / 6), np.arange(40) / 6])
    pillars = np.random.default_rng(1).uniform(-6, 6, (60, 2))
    pillars = np.hstack([pillars, pillars + 0.2])
    with pytest.raises(ValueError, match="nowhere on the map, of 40 scans none could be localised: .* 0.52"):
        localise(recorded(circle, circle, np.vstack([pillars, [[-9, -9, 9, -8.9]]])), None, background)


def test_a_single_scan(background):
    """One scan is enough where it fits one place only."""
    found = localise(recorded(TRUTH[:1], FRAME[None]), None, background)
    assert errors(found, TRUTH[:1])[0][0] < 0.06


def test_a_robot_that_stands(background):
    """Every scan has nearly the same pose, near the true one."""
    truth = np.tile(START, (40, 1))
    found = localise(recorded(truth, truth + [0.1, -0.1, 0.05]), None, background)
    assert_found(found, truth)
    assert np.ptp(found.poses, axis=0).max() < 0.005


def test_scans_without_returns(background):
    """A few scans in which nothing came back are bridged; a log of them is refused."""
    log = recorded(TRUTH, DRIFTING)
    ranges = log.ranges.copy()
    ranges[30:33] = np.inf
    assert_found(localise(replace(log, ranges=ranges), None, background), TRUTH)
    with pytest.raises(ValueError, match="nowhere on the map"):
        localise(replace(log, ranges=np.full_like(ranges, np.inf)), None, background)


def test_notes_of_the_reader_stay_but_for_those_on_poses(background):
    """That a bag's poses drift is no longer true; that its clock is wrong is."""
    notes = (Note("clock", "the clock jumps"), Note("poses", "by odometry", doubt=False))
    log = replace(recorded(TRUTH[:20], DRIFTING[:20]), notes=notes)
    assert localise(log, None, background).notes == notes[:1]


def test_the_same_seed_gives_the_same_poses(background):
    """To the last bit; another seed gives nearly the same."""
    log = recorded(TRUTH, DRIFTING)
    runs = [localise(log, None, background, seed=seed).poses for seed in (3, 3, 4)]
    assert np.array_equal(runs[0], runs[1])
    assert np.abs(between(runs[0], runs[2])).max() < 0.02


BAD = {
    "odometry must be an Odometry with a message, or None, got 'odom'": {"odometry": "odom"},
    "odometry must be an Odometry with a message": {
        "odometry": Odometry(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 2)))
    },
    "odometry must be of the time of the log, got 900 to 901 s for scans from 5 to 16.9 s": {
        "odometry": Odometry(np.array([900.0, 901.0]), np.zeros((2, 3)), np.zeros((2, 2)))
    },
    r"laser must have shape \(3,\), got \(2,\)": {"laser": (1, 2)},
    "laser must be finite": {"laser": (1, 2, np.nan)},
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input(background, message):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=message):
        localise(
            recorded(TRUTH, DRIFTING),
            **({"odometry": None, "background": background} | BAD[message]),
        )


def test_a_map_without_a_free_cell():
    """There is nowhere to search."""
    with pytest.raises(ValueError, match="must have a free cell"):
        localise(recorded(TRUTH, DRIFTING), None, OccupancyGrid(np.ones((9, 9)), (0.0, 0.0), 0.05))


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
def test_a_real_drive_of_half_a_kilometre():
    """Odometry that strays by more than 2 m is put on a map that others made: 5 cm from where they have it."""
    path = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "carmen_logs/intel-corrected.log.gz"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        log, odometry = read_log(path), read_odometry(path)
    found = localise(log, odometry, OccupancyGrid.from_log(log))
    place, turn = errors(found, log.poses)
    assert place.mean() < 0.06 and np.median(turn) < 1
    assert not found.notes


# ---- the parts


def test_springs_pull_to_the_surface():
    """Beside a wall: half the squared distance, a slope across it, and a normal that does not lean."""
    wall = drawn_map([[2.0, 0.0, 2.0, 4.0]], 4.0, 4.0)
    points = np.array([[1.8, 2.0], [2.0, 2.0], [2.15, 1.0]])
    half, slope, normal = _Springs(wall, RULES).at(points)
    away = points[:, 0] - 2.0
    np.testing.assert_allclose(half, away**2 / 2, atol=2e-3)
    np.testing.assert_allclose(slope, np.column_stack([away, 0 * away]), atol=0.01)
    np.testing.assert_allclose(normal, np.tile([1.0, 0.0, 0.0], (3, 1)), atol=0.05)
    far = _Springs(wall, RULES).at(np.array([[1e6, -1e6]]))[0]
    assert np.exp(-far / RULES.sigma**2) < 1e-9


@pytest.mark.parametrize("beside", [0.0, 0.3, 1.0])
def test_a_surface_lies_between_the_cells_that_are_hit(beside):
    """A wall along a border of cells is hit in both: what pulls least is where the hits have their middle."""
    occupancy = np.zeros((40, 40))
    occupancy[:, 20], occupancy[:, 21] = 1.0, beside
    x = np.linspace(0.9, 1.15, 251)
    half = _Springs(OccupancyGrid(occupancy, (0.0, 0.0), 0.05), RULES).at(np.column_stack([x, np.ones(251)]))[0]
    middle = 0.05 * (20.5 + beside / (1 + beside))
    assert x[half <= half.min() + 2e-5].mean() == pytest.approx(middle, abs=0.0125)  # a quarter of a cell


def test_what_is_solid_ends_where_its_outer_cells_are():
    """The inside of a filled box draws nothing inwards."""
    occupancy = np.zeros((40, 40))
    occupancy[:, 20:30] = 1.0
    half = _Springs(OccupancyGrid(occupancy, (0.0, 0.0), 0.05), RULES).at(np.array([[20.5 * 0.05, 1.0], [0.8, 1.0]]))[0]
    np.testing.assert_allclose(np.sqrt(2 * half), [0.0, 0.225], atol=0.005)


def test_derivatives_of_steps_against_differences():
    """How the steps change with the poses, by moving each of them a little."""
    poses, small = np.random.default_rng(0).normal(size=(5, 3)), 1e-6
    before, after = _step_derivatives(poses)
    for axis in range(3):
        moved = poses + small * np.eye(3)[axis]
        forward = (between(poses[:-1], moved[1:]) - between(poses[:-1], poses[1:])) / small
        back = (between(moved[:-1], poses[1:]) - between(poses[:-1], poses[1:])) / small
        np.testing.assert_allclose(after[:, :, axis], forward, atol=1e-4)
        np.testing.assert_allclose(before[:, :, axis], back, atol=1e-4)


def test_the_band_against_the_whole_matrix():
    """The step of Gauss and Newton is that of the dense normal equations."""
    rng = np.random.default_rng(1)
    poses, count = rng.normal(size=(6, 3)), 6
    steps, trust = (
        between(poses[:-1], poses[1:]) + 0.1 * rng.normal(size=(5, 3)),
        rng.uniform(1, 9, (5, 3)),
    )
    gradient, root = rng.normal(size=(6, 3)), rng.normal(size=(6, 3, 3))
    matrix = root @ np.swapaxes(root, 1, 2)
    found = _banded_step(poses, gradient, matrix, steps, trust)
    before, after = _step_derivatives(poses)
    jacobian = np.zeros((5, 3, count, 3))
    for i in range(5):
        jacobian[i, :, i], jacobian[i, :, i + 1] = before[i], after[i]
    jacobian, weights = jacobian.reshape(15, 18), np.diag(trust.ravel())
    whole = jacobian.T @ weights @ jacobian + 1e-3 * np.eye(18)
    for i in range(count):
        whole[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += matrix[i]
    errors_ = (between(poses[:-1], poses[1:]) - steps).ravel()
    pull = gradient.ravel() + jacobian.T @ weights @ errors_
    np.testing.assert_allclose(found.ravel(), -np.linalg.solve(whole, pull), atol=1e-9)


def test_smoothing_alone_finds_the_poses(background):
    """From poses 5 cm and 3 degrees off, each its own way, all scans together lead back."""
    log = recorded(TRUTH, DRIFTING)
    rough = TRUTH + np.random.default_rng(2).normal(0, [0.05, 0.05, 0.05], TRUTH.shape)
    smooth = _Scans(log, background, RULES).smoothed(rough, DRIFTING, np.ones(len(log), bool))
    place, _ = errors(replace(log, poses=smooth), TRUTH)
    assert place.mean() < 0.02 and place.max() < 0.08


def test_keys_are_some_way_or_turn_apart(background):
    """Driving or turning, the scans through which a place is tried are spread; standing there is one."""
    log = recorded(TRUTH, DRIFTING)
    scans = _Scans(log, background, RULES)
    follower = MonteCarloLocalizer(background, _thinned(log, RULES)[1], seed=0)
    keys = _Search(scans, TRUTH, follower)._keys(10)
    assert keys[0] == 10 and 10 <= len(keys) <= KEYS
    way = np.cumsum(np.hypot(*STEPS[:, :2].T) + np.abs(STEPS[:, 2]))
    assert (np.diff(way[keys - 1]) > 0.5 - 0.1).all()
    assert _Search(scans, np.tile(START, (120, 1)), follower)._keys(10).tolist() == [10]


def test_bridges(background):
    """Between two located scans that the odometry joins all are located; across a jump they are not."""
    log = recorded(TRUTH[:30], TRUTH[:30])
    course = _Course(log, TRUTH[:30], MonteCarloLocalizer(background, _thinned(log, RULES)[1], seed=0))
    course.poses[:], course.located[:] = TRUTH[:30], True
    course.located[[0, 1, 10, 11, 12, 20, 21, 29]] = False
    course.poses[22:] = composed([2 * RULES.carried, 0, 0], course.poses[22:])
    poses, located = course.bridged()
    assert np.flatnonzero(~located).tolist() == [0, 1, 20, 21, 29]
    np.testing.assert_allclose(poses[:22], TRUTH[:22], atol=1e-12)


def test_what_a_log_is_doubted_for_is_a_rule(background):
    """Who asks that every scan alone holds the laser to 2 mm is told that it does not; the poses are the same."""
    log = recorded(TRUTH[:30], DRIFTING[:30])
    usual, strict = (localise(log, None, background, rules=Localisation(loose=loose)) for loose in (0.2, 0.002))
    assert not usual.notes and "only along one direction" in strict.notes[0].text
    assert np.array_equal(usual.poses, strict.poses)
    with pytest.raises(ValueError, match="rules must be a Localisation, got 3"):
        localise(log, None, background, rules=3)
