"""Sec. II end to end: from a laser log to the user and the environment, and bad input."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import DATA
from rooms import FURNITURE, WALLS, room_map, scan

from dollop import OccupancyGrid, SequencedLDS, Tracker, laps, observe, read_log
from dollop.foreground import ForegroundGrid
from dollop.lab import Recording
from dollop.lab.truth import track_error
from dollop.laser import LaserLog
from dollop.observation import completed, foreground_hits, static_boxes
from dollop.tracking import Track
from dollop.trajectory import distance_to_polyline, mean_trajectory


@pytest.fixture(scope="module")
def recording():
    return Recording.load(DATA / "figure_eights.log.gz")


@pytest.fixture(scope="module")
def background():
    return OccupancyGrid.load(DATA / "lab.yaml")


@pytest.fixture(scope="module")
def observation(recording, background):
    return observe(recording.log, background)


def test_the_user_is_tracked_through_the_occlusions(recording, observation):
    """Five laps: within 60 mm of the walker on average, without the bias; always within 0.3 m."""
    user = observation.user
    bias, errors = track_error(user, recording.truth, recording.log.poses[0])
    assert user.occluded.sum() > 20
    assert user.t[-1] - user.t[0] > 0.97 * np.ptp(recording.log.t)
    assert 0.05 < bias < 0.20
    assert errors.mean() < 0.060 and errors.max() < 0.3


def test_both_cans_are_the_environment(recording, observation):
    """Two static objects, every side of their boxes within 10 cm of the truth."""
    found = np.array(sorted(observation.environment.boxes.tolist()))
    np.testing.assert_allclose(found, recording.scene.boxes, atol=0.10)


def test_the_law_has_about_six_segments_within_twenty_millimetres(observation):
    """Fig. 6b at the default tolerance (the paper: 6 LDS, 20 mm)."""
    walked = laps(observation.user.t, observation.user.positions)
    law = SequencedLDS.fit(walked)
    assert len(walked) == 5
    assert 5 <= len(law.segments) <= 7
    assert distance_to_polyline(mean_trajectory(walked), law.response()).mean() <= 0.020


def test_the_stored_map_is_what_the_stored_drive_builds(background):
    """data/lab.yaml follows from data/empty_lab.log.gz."""
    built = OccupancyGrid.from_log(read_log(DATA / "empty_lab.log.gz"))
    assert (built.occupied == background.occupied).mean() > 0.999


@pytest.mark.parametrize(
    "tracker",
    [
        Tracker(matching="joint"),
        Tracker(occlusion="particles"),
        Tracker(motion=replace(Tracker().motion, order=3)),
    ],
    ids=["joint", "particles", "acceleration"],
)
def test_the_other_choices_track_the_user_as_well(recording, background, tracker):
    """Beside the paper's choices, each selectable one follows the user for one lap."""
    log = recording.log
    first = replace(log, t=log.t[:250], ranges=log.ranges[:250], poses=log.poses[:250])
    user = observe(first, background, tracker=tracker).user
    assert track_error(user, recording.truth, log.poses[0])[1].mean() < 0.10


def test_nobody_there(recording, background):
    """A log of a standing room has no user, and no objects where nothing is foreground."""
    log = recording.log
    ranges = np.repeat(log.ranges[:1], 40, axis=0)
    still = replace(log, t=log.t[:40], ranges=ranges, poses=log.poses[:40])
    assert observe(still, background).user is None
    explained = replace(still, ranges=np.full_like(still.ranges, np.inf))
    observation = observe(explained, background)
    assert observation.tracks == () and len(observation.environment.boxes) == 0


def test_observing_leaves_the_log_as_it_was(recording, background):
    """Inputs are not changed."""
    before = recording.log.ranges.copy(), recording.log.poses.copy()
    observe(recording.log, background)
    np.testing.assert_array_equal(recording.log.ranges, before[0])
    np.testing.assert_array_equal(recording.log.poses, before[1])


@pytest.mark.parametrize("turn", [3 * np.pi / 2, np.pi, -2.0])
def test_the_way_a_laser_counts_its_bearings_does_not_matter(recording, background, turn):
    """From 0 to 2 pi or from anywhere: the same scans give the same tracks, user and objects.

    The robot of the recording stands on a border of cells and heads along it, so that rounding
    decides for one beam: here it heads a microradian aside.
    """
    log = replace(recording.log, poses=recording.log.poses + [0, 0, 1e-6])
    counted = replace(log, angles=log.angles + turn, poses=log.poses - [0, 0, turn])
    straight, turned = observe(log, background), observe(counted, background)
    assert len(turned.tracks) == len(straight.tracks)
    np.testing.assert_allclose(turned.user.positions, straight.user.positions, atol=1e-6)
    np.testing.assert_allclose(turned.environment.boxes, straight.environment.boxes, atol=1e-9)


@pytest.mark.parametrize("name", ["min_area", "stride", "background_radius", "gain", "static_gain"])
@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_parameters_out_of_range_are_named(recording, background, name, value):
    """The error names the parameter, or the gain that it is, and the value."""
    with pytest.raises(ValueError, match=f"{name.replace('static_', '')} must .*, got {value}"):
        observe(recording.log, background, **{name: value})


def test_a_map_elsewhere_is_refused(recording, background):
    """A map that does not cover the scans is an error with the share of readings outside."""
    elsewhere = OccupancyGrid(background.occupancy, np.array([50.0, 50.0]), background.resolution)
    with pytest.raises(ValueError, match="must cover the scans: .* readings .100 %"):
        observe(recording.log, elsewhere)


def test_boxes_are_completed_away_from_the_sensor():
    """Of a round can only the near arc is seen; its box is made as deep as wide, never smaller."""
    angle = np.linspace(np.pi, 2 * np.pi, 50)
    near = np.array([2.0, 3.0]) + 0.2 * np.column_stack([np.cos(angle), np.sin(angle)])
    seen = np.concatenate([near.min(axis=0), near.max(axis=0)])
    box = completed(seen, near, np.array([2.0, 0.0]), 0.0)
    np.testing.assert_allclose(box, [1.8, 2.8, 2.2, 3.2], atol=0.01)


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="DOLLOP_EXTERNAL_DATA names no folder")
def test_walkers_seen_at_leg_height():
    """In a real log of three people, with legs joined within a stride, one is followed."""
    pytest.importorskip("rosbags")
    folder = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "people"
    log = read_log(folder / "demo_stationary_simple_environment.bag")
    observation = observe(log, OccupancyGrid.from_log(log), min_area=0.0025, stride=0.6)
    user = observation.user
    assert user.t[-1] - user.t[0] > 100 and user.occluded.mean() < 0.15
    assert np.ptp(user.positions[:, 1]) > 4.0 and np.quantile(user.speeds, 0.9) < 2.5


SENSOR = np.array([4.5, 0.4, np.pi / 2])
CAN = np.array([2.3, 3.4, 2.7, 3.8])


def seen_from_the_sensor(walk, *boxes):
    """Scans at 10 Hz from one place: a walker 0.4 m wide at each of (N, 2), nan away, and boxes."""
    room = np.vstack([WALLS, FURNITURE, *boxes])
    walkers = ([[*(place - 0.2), *(place + 0.2)]] for place in np.asarray(walk))
    places = [np.vstack([room, each]) if np.isfinite(each).all() else room for each in walkers]
    ranges = np.array([scan(SENSOR, each) for each in places])
    angles = np.deg2rad(np.arange(-90.0, 91.0))
    poses = np.tile(SENSOR, (len(ranges), 1))
    return LaserLog(0.1 * np.arange(len(ranges)), ranges, angles, poses, 20.0)


def away(count):
    return np.full((count, 2), np.nan)


def test_losses_are_counted():
    """Hidden for six seconds and seen again elsewhere is lost once; never hidden, never lost."""
    one, other = np.linspace([2.0, 3.0], [6.0, 3.0], 40), np.linspace([6.5, 4.5], [3.0, 4.5], 35)
    walks = {k: np.concatenate([one, away(k), other]) for k in (60, 0)}
    found = {k: observe(seen_from_the_sensor(walk), room_map()) for k, walk in walks.items()}
    assert found[60].losses == 1 and found[60].user.t[-1] == pytest.approx(13.4)
    assert observe(seen_from_the_sensor(one), room_map()).losses == 0
    assert observe(seen_from_the_sensor(away(20)), room_map()).losses == 0


def test_a_user_who_stops_is_no_object():
    """However long the user stands in the end, the can alone is the environment."""
    walk = np.concatenate([np.linspace([3.5, 2.5], [6.0, 2.5], 25), np.tile([6.0, 2.5], (100, 1))])
    observation = observe(seen_from_the_sensor(walk, CAN), room_map())
    np.testing.assert_allclose(observation.environment.boxes, [CAN], atol=0.12)


@pytest.mark.parametrize(("there", "objects"), [(slice(0, 30), 1), (slice(35, 40), 0)], ids=["before", "at last"])
def test_where_the_user_stood_last_is_no_object(there, objects):
    """A blob where the user was in the last second is the user; one left before is an object."""
    log, grid = seen_from_the_sensor(away(1), CAN), ForegroundGrid(room_map(), 0.6)
    grid.update(foreground_hits(log, room_map())[0], SENSOR, log.angles, log.ranges[0])
    places = np.tile([7.0, 2.0], (40, 1))
    places[there] = 2.5, 3.6
    user = Track(0.1 * np.arange(40), places, np.zeros((40, 2)), np.zeros(40, bool), places)
    assert len(static_boxes(grid, SENSOR[:2], user)) == objects


@pytest.mark.parametrize(("scans", "objects"), [(30, 0), (31, 1)])
def test_what_stands_for_three_seconds_is_static(scans, objects):
    """1 - 0.9^n exceeds a half at the seventh look of the slow grid, every fifth scan."""
    observation = observe(seen_from_the_sensor(away(scans), CAN), room_map())
    assert len(observation.environment) == objects and observation.user is None


@pytest.mark.parametrize("quarters", range(4))
def test_cells_become_a_square_away_from_the_sensor(quarters):
    """Four cells, two behind the third, from any of four sides: as deep as wide, edge to edge."""
    turn = np.linalg.matrix_power(np.array([[0, -1], [1, 0]]), quarters)
    seen = np.array([[1.85, 3.0], [2.05, 3.0], [2.05, 3.05], [2.05, 3.1]]) @ turn.T
    tight = np.concatenate([seen.min(axis=0) - 0.025, seen.max(axis=0) + 0.025])
    corners = np.array([[1.825, 2.975], [2.075, 3.225]]) @ turn.T
    expected = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
    np.testing.assert_allclose(completed(tight, seen, turn @ [2.0, 0.0], 0.05), expected, atol=1e-9)
