"""Sec. II end to end: from a laser log to people, user and environment, in both ways, and bad input."""

import os
import re
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import DATA
from rooms import (
    ANGLES,
    CANS,
    DEPTH,
    FURNITURE,
    SENSOR,
    WALLS,
    WIDTH,
    drawn_map,
    nobody,
    one_after_another,
    room_map,
    scan,
    together,
    walk,
    watched,
)

from dollop import Demonstration, OccupancyGrid, SequencedLDS, Tracker, laps, observe, read_log
from dollop.foreground import ForegroundGrid
from dollop.lab import Recording
from dollop.lab.truth import track_error
from dollop.laser import LaserLog
from dollop.observation import METHODS, Observer, completed, foreground_hits, static_boxes
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


@pytest.mark.parametrize(
    ("method", "bias", "mean", "largest"), [("people", (-0.02, 0.02), 0.03, 0.2), ("paper", (0.05, 0.20), 0.06, 0.3)]
)
def test_the_user_is_tracked_through_the_occlusions(recording, background, method, bias, mean, largest):
    """Five laps without a hole: by default the middle of the body; the paper's centroids are too near by a bias."""
    user = observe(recording.log, background, method=method).user
    found, errors = track_error(user, recording.truth, recording.log.poses[0])
    assert user.occluded.sum() > 20
    assert user.t[-1] - user.t[0] > 0.97 * np.ptp(recording.log.t)
    assert bias[0] < found < bias[1]
    assert errors.mean() < mean and errors.max() < largest


def test_both_cans_are_the_environment(recording, observation):
    """Two static objects, every side of their boxes within 5 cm of the truth."""
    found = np.array(sorted(observation.environment.boxes.tolist()))
    np.testing.assert_allclose(found, recording.scene.boxes, atol=0.05)


def test_on_good_input_there_are_no_notes(observation):
    """One walker among two cans, five laps: one person, the user, and nothing to be said about it."""
    assert observation.notes == () and observation.trusted
    assert observation.people == (observation.user,)


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
    user = observe(first, background, method="paper", tracker=tracker).user
    assert track_error(user, recording.truth, log.poses[0])[1].mean() < 0.10


@pytest.mark.parametrize("method", METHODS)
def test_nobody_there(recording, background, method):
    """A log of a standing room has no user, and no objects where nothing is foreground."""
    log = recording.log
    ranges = np.repeat(log.ranges[:1], 40, axis=0)
    still = replace(log, t=log.t[:40], ranges=ranges, poses=log.poses[:40])
    assert observe(still, background, method=method).user is None
    explained = replace(still, ranges=np.full_like(still.ranges, np.inf))
    observation = observe(explained, background, method=method)
    assert observation.tracks == () and len(observation.environment.boxes) == 0


def test_observing_leaves_the_log_as_it_was(recording, background):
    """Inputs are not changed."""
    before = recording.log.ranges.copy(), recording.log.poses.copy()
    observe(recording.log, background)
    np.testing.assert_array_equal(recording.log.ranges, before[0])
    np.testing.assert_array_equal(recording.log.poses, before[1])


@pytest.mark.parametrize(
    ("turn", "method"), [(3 * np.pi / 2, "people"), (np.pi, "people"), (-2.0, "people"), (-2.0, "paper")]
)
def test_the_way_a_laser_counts_its_bearings_does_not_matter(recording, background, turn, method):
    """From 0 to 2 pi or from anywhere: the same scans give the same tracks, user and objects.

    The robot of the recording stands on a border of cells and heads along it, so that rounding
    decides for one beam: here it heads a microradian aside.
    """
    log = replace(recording.log, poses=recording.log.poses + [0, 0, 1e-6])
    counted = replace(log, angles=log.angles + turn, poses=log.poses - [0, 0, turn])
    straight, turned = (observe(each, background, method=method) for each in (log, counted))
    assert len(turned.tracks) == len(straight.tracks)
    np.testing.assert_allclose(turned.user.positions, straight.user.positions, atol=1e-6)
    np.testing.assert_allclose(turned.environment.boxes, straight.environment.boxes, atol=1e-9)


PARAMETERS = {"people": ["min_area", "background_radius"]}
PARAMETERS["paper"] = [*PARAMETERS["people"], "stride", "gain", "static_gain"]


@pytest.mark.parametrize(("method", "name"), [(method, name) for method in METHODS for name in PARAMETERS[method]])
@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_parameters_out_of_range_are_named(recording, background, method, name, value):
    """The error names the parameter, or the gain that it is, and the value."""
    with pytest.raises(ValueError, match=f"{name.replace('static_', '')} must .*, got {value}"):
        observe(recording.log, background, method=method, **{name: value})


def test_methods_and_their_parameters_are_named(recording, background):
    """Another method is refused with those there are; what is only the paper's, with the method it belongs to."""
    with pytest.raises(ValueError, match="method must be .*people.*paper.*, got 'legs'"):
        observe(recording.log, background, method="legs")
    with pytest.raises(ValueError, match='stride, gain must come with method="paper"'):
        observe(recording.log, background, stride=0.6, gain=0.5)


@pytest.mark.parametrize("method", METHODS)
def test_a_map_elsewhere_is_refused(recording, background, method):
    """A map that does not cover the scans is an error with the share of readings outside."""
    elsewhere = OccupancyGrid(background.occupancy, np.array([50.0, 50.0]), background.resolution)
    with pytest.raises(ValueError, match="must cover the scans: .* readings .100 %"):
        observe(recording.log, elsewhere, method=method)


def test_a_map_that_knows_nothing_is_refused(recording, background):
    """Neither free nor occupied anywhere: the error says so, before a scan is taken."""
    unknown = OccupancyGrid(np.full_like(background.occupancy, 0.5), background.origin, background.resolution)
    with pytest.raises(ValueError, match="must hold free and occupied cells: it knows of nothing"):
        observe(recording.log, unknown)


def test_boxes_are_completed_away_from_the_sensor():
    """Of a round can only the near arc is seen; its box is made as deep as wide, never smaller."""
    angle = np.linspace(np.pi, 2 * np.pi, 50)
    near = np.array([2.0, 3.0]) + 0.2 * np.column_stack([np.cos(angle), np.sin(angle)])
    seen = np.concatenate([near.min(axis=0), near.max(axis=0)])
    box = completed(seen, near, np.array([2.0, 0.0]), 0.0)
    np.testing.assert_allclose(box, [1.8, 2.8, 2.2, 3.2], atol=0.01)


# ---- the paper's way


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

    def observed(walk):
        return observe(seen_from_the_sensor(walk), room_map(), method="paper")

    found = {k: observed(walk) for k, walk in walks.items()}
    assert found[60].losses == 1 and found[60].user.t[-1] == pytest.approx(13.4)
    assert observed(one).losses == 0
    assert observed(away(20)).losses == 0


@pytest.mark.parametrize("method", METHODS)
def test_a_user_who_stops_is_no_object(method):
    """However long the user stands in the end, the can alone is the environment."""
    walk = np.concatenate([np.linspace([3.5, 2.5], [6.0, 2.5], 25), np.tile([6.0, 2.5], (100, 1))])
    observation = observe(seen_from_the_sensor(walk, CAN), room_map(), method=method)
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
    observation = observe(seen_from_the_sensor(away(scans), CAN), room_map(), method="paper")
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


# ---- people, and what stands


TO_AND_FRO = walk([2, 2], [7, 2], [2, 2])
MEETING = together(walk([2, 4.5], [7, 2]), np.concatenate([nobody(0.5), walk([7, 4.5], [2, 2], speed=0.9)]))
LONG = [2.6, 2.5, 4.0, 3.0]
MOVED = [4.8, 4.8, 5.2, 5.2]
STREAMS = {
    "crossing": watched(MEETING),
    "hidden": watched(walk([7.5, 4.2], [0.5, 4.2], speed=0.7), LONG),
    "fast": watched(walk([2, 2], [7, 2], rate=40.0), CANS, rate=40.0),
    "moved": one_after_another(watched(TO_AND_FRO[:50], CANS), watched(TO_AND_FRO[50:], [CANS[0], MOVED])),
    "nobody": watched(nobody(4.0)),
}


def same(one, other):
    """Whether two observations are equal, numbers to 1e-9."""
    pairs = list(zip(one.tracks, other.tracks, strict=True))
    for name in ("t", "positions", "velocities", "occluded", "measurements"):
        for a, b in pairs:
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.environment.boxes, other.environment.boxes, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(one.environment.assumed, other.environment.assumed)
    np.testing.assert_array_equal(one.environment.seen.floor, other.environment.seen.floor)
    return (one.losses, one.notes, len(one.people)) == (other.losses, other.notes, len(other.people))


@pytest.mark.parametrize("name", STREAMS)
def test_scan_by_scan_is_the_same_as_the_whole_log(name):
    """An observer that takes one scan at a time, asked now and then, has seen what `observe` makes of all."""
    log = STREAMS[name]
    observer = Observer(room_map(), log.angles)
    for i in range(len(log)):
        observer.step(log.t[i], log.ranges[i], log.poses[i])
        if i % 30 == 20:
            observer.observation()
    assert same(observer.observation(), observe(log, room_map()))


@pytest.mark.parametrize("begin", [1.7e9, -5.0])
def test_when_a_clock_began_does_not_matter(begin):
    """Seconds since 1970 or since whatever: the same people and objects, the same notes but for the clock."""
    log = STREAMS["moved"]
    one, other = observe(log, room_map()), observe(replace(log, t=log.t + begin), room_map())
    assert one.notes == other.notes
    np.testing.assert_allclose(other.user.positions, one.user.positions, atol=1e-5)
    np.testing.assert_allclose(other.environment.boxes, one.environment.boxes, atol=1e-9)


OTHERS = {
    "moved": ([CANS[0], CANS[1]], [CANS[0], MOVED], r"at \(6.\d\d, 3.\d\d\) was moved to \((\S+), (\S+)\) (\S+) s"),
    "came": ([CANS[0]], [CANS[0], MOVED], r"stands at \((\S+), (\S+)\) since (\S+) s"),
    "went": ([CANS[0], MOVED], [CANS[0]], r"at \((\S+), (\S+)\) was gone after (\S+) s"),
}


@pytest.mark.parametrize("kind", OTHERS)
@pytest.mark.parametrize("there", [TO_AND_FRO, nobody(10.0)], ids=["walker", "nobody"])
def test_what_moved_came_or_went_is_noted_with_when(kind, there):
    """Half a log with some boxes, half with others: one note that says what, where and when, and the last boxes."""
    before, after, text = OTHERS[kind]
    log = one_after_another(watched(there[:50], before), watched(there[50:], after, seed=1))
    observation = observe(log, room_map())
    (note,) = observation.notes
    assert note.kind == f"object {kind}" and not observation.trusted
    x, y, when = map(float, re.search(text, note.text).groups())
    assert np.hypot(x - 5.0, y - 5.0) < 0.25 and when == pytest.approx(5.0, abs=0.5)
    found = np.array(sorted(observation.environment.boxes.tolist()))
    np.testing.assert_allclose(found, after, atol=0.06)


def test_an_object_that_goes_on_behind_another_is_noted():
    """It may be larger than what is seen of it: that is said of this one alone, and puts nothing in doubt."""
    observation = observe(watched(nobody(3.0), [[4.3, 2.0, 4.7, 2.4], [4.5, 4.0, 5.5, 4.5]]), room_map())
    (note,) = observation.notes
    assert note.kind == "in part" and "object at (5.25, 4.2" in note.text and observation.trusted
    assert len(observation.environment) == 2


@pytest.mark.parametrize("boxes", [[], CANS], ids=["empty", "cans"])
@pytest.mark.parametrize("seed", range(3))
def test_nobody_is_nobody(boxes, seed):
    """In a room without people there are none, however noisy the laser and however much does not come back."""
    log, rng = watched(nobody(20.0), boxes, noise=0.015, seed=seed), np.random.default_rng(seed)
    gaps = replace(log, ranges=np.where(rng.random(log.ranges.shape) < 0.02, np.inf, log.ranges))
    observation = observe(gaps, room_map())
    assert observation.people == () and observation.user is None and observation.notes == ()
    assert len(observation.environment) == len(boxes)


@pytest.mark.parametrize("boxes", [[], CANS], ids=["empty", "cans"])
@pytest.mark.parametrize("begin", range(3))
def test_a_laser_that_moves_sees_nobody_in_what_stands(boxes, begin):
    """A drive round an ellipse with true poses: nobody, and the objects where they stand."""
    angle, rng = np.linspace(0, 2 * np.pi, 200) + begin, np.random.default_rng(begin)
    poses = np.column_stack([4.5 + 1.5 * np.cos(angle), 2.5 + np.sin(angle), angle + np.pi / 2])
    world = np.vstack([WALLS, FURNITURE, *np.reshape(boxes, (-1, 4))])
    ranges = np.array([scan(pose, world, rng) for pose in poses])
    observation = observe(LaserLog(0.1 * np.arange(200), ranges, ANGLES, poses, 30.0), room_map())
    assert observation.people == () and observation.user is None and observation.trusted
    found = np.array(sorted(observation.environment.boxes.tolist())).reshape(-1, 4)
    np.testing.assert_allclose(found, np.reshape(boxes, (-1, 4)), atol=0.06)


def test_losses_are_the_times_out_of_sight():
    """Twice behind a box, of which a walker comes out again, is two losses of one person; in sight is none."""
    to_and_fro = walk([7.5, 4.2], [0.5, 4.2], [7.5, 4.2], speed=0.8)
    hidden = observe(watched(to_and_fro, LONG), room_map())
    assert hidden.losses == 2 and len(hidden.people) == 1
    assert observe(watched(to_and_fro), room_map()).losses == 0


GOING, COMING = walk([7.5, 4.2], [3.0, 4.2]), walk([3.0, 4.2], [7.5, 4.2])


@pytest.mark.parametrize(("seconds", "kind"), [(2.0, None), (3.5, "gap"), (5.5, "pieces")])
def test_a_long_time_out_of_sight_is_noted(seconds, kind):
    """Who waits behind a box is bridged; for longer a note says so, and then it is left open whether it is the same."""
    waiting = np.repeat(GOING[-1:], round(10 * seconds), axis=0)
    observation = observe(watched(np.concatenate([GOING, waiting, COMING]), LONG), room_map(), user=(7.5, 4.2))
    assert [note.kind for note in observation.notes] == ([kind] if kind else [])
    assert len(observation.people) == (2 if kind == "pieces" else 1)


def test_a_user_who_is_mostly_out_of_sight_is_noted():
    """Behind a box for two thirds of the time: a note tells the share that was seen."""
    way = walk([0.5, 4.2], [2.4, 4.2], [0.5, 4.2], speed=0.6)
    (note,) = observe(watched(way, LONG), room_map()).notes
    assert note.kind == "seen" and "in sight for 33% of the time" in note.text


def test_scans_too_far_apart_are_noted():
    """Twice a second nobody can be followed: that is said, and not that nobody was there."""
    way = walk([2, 2], [7, 2], [2, 2], rate=2.0)
    observation = observe(watched(way, rate=2.0), room_map())
    assert [note.kind for note in observation.notes] == ["slow scans"] and not observation.trusted


def test_poses_that_do_not_say_that_the_laser_moves_are_noted():
    """Walls that seem to move are not on the map and do not stand: the note says so, whoever seems to walk."""
    y, rng = 3.0 - 2.0 * np.cos(np.linspace(0, 2 * np.pi, 200)), np.random.default_rng(0)
    world = np.vstack([WALLS, FURNITURE, CANS])
    ranges = np.array([scan(np.array([4.5, each, np.pi / 2]), world, rng) for each in y])
    log = LaserLog(0.1 * np.arange(200), ranges, ANGLES, np.tile([4.5, 5.0, np.pi / 2], (200, 1)), 30.0)
    observation = observe(log, drawn_map([*FURNITURE, *WALLS], WIDTH, DEPTH, border=4.0))
    assert "map" in [note.kind for note in observation.notes] and not observation.trusted


@pytest.mark.parametrize("user", [0, 1, (2.0, 4.5), (7.1, 4.3)])
def test_the_user_is_who_is_named(user):
    """By an index into the people, who are in the order in which they came, or by the place where they were first."""
    observation = observe(watched(MEETING), room_map(), user=user)
    k = user if isinstance(user, int) else int(user[0] > 4)
    assert observation.user is observation.people[k]
    np.testing.assert_allclose(observation.user.positions[0], MEETING[5 * k, k], atol=0.15)


def test_the_fastest_is_the_user_and_a_tie_is_noted():
    """Who walks faster; where two walk about as fast, a note says so, and the result is not trusted."""
    for slower, trusted in ((0.5, True), (0.95, False)):
        log = watched(together(walk([2, 4.5], [7, 4.5]), walk([7, 2], [2, 2], speed=slower)))
        observation = observe(log, room_map())
        assert observation.trusted == trusted == (not observation.notes)
        if trusted:
            np.testing.assert_allclose(observation.user.positions[0], [2, 4.5], atol=0.1)
        else:
            assert [note.kind for note in observation.notes] == ["people"]


def test_who_darts_past_is_not_the_user():
    """Twice as fast for a metre and a half: one of the people, but the user is who walked the long way."""
    log = watched(together(walk([2, 4.5], [7, 4.5], speed=0.8), walk([3, 2], [4.6, 2], speed=1.6)))
    observation = observe(log, room_map())
    assert len(observation.people) == 2 and observation.trusted
    np.testing.assert_allclose(observation.user.positions[0], [2, 4.5], atol=0.1)


def test_what_is_pushed_slowly_is_an_object_again_where_it_stands():
    """It stood, slid on and stands, while somebody else walks: in the end it is an object there, and that is noted."""
    standing, pushed = np.tile([[[6.0, 2.0]]], (30, 1, 1)), walk([6.0, 2.0], [7.2, 2.6], speed=0.4)
    thing = np.concatenate([standing, pushed, standing + [1.2, 0.6]])
    log = watched(together(walk([2, 4.5], [7, 4.5], [2, 4.5], speed=1.1), thing))
    observation = observe(log, room_map())
    np.testing.assert_allclose(observation.user.positions[0], [2, 4.5], atol=0.1)
    np.testing.assert_allclose(observation.environment.boxes, [[7.0, 2.4, 7.4, 2.8]], atol=0.06)
    assert [note.kind for note in observation.notes] == ["object came"]


def test_a_place_where_nobody_was_is_refused_with_who_was_where():
    """The error tells the place, and of everybody where they were first seen."""
    with pytest.raises(ValueError, match=r"nobody .* \(8.0, 6.0\) when .*: 0 at \(2.\d\d, 4.\d\d\), 1 at \((6.9|7.0)"):
        observe(watched(MEETING), room_map(), user=(8.0, 6.0))


@pytest.mark.parametrize("user", [2, -1, "slowest", (1.0, np.nan), (1.0, 2.0, 3.0), True])
def test_a_user_that_is_none_is_refused(user):
    """An index beyond the people, another word, and what is no place: an error that names it."""
    with pytest.raises(ValueError, match="user must"):
        observe(watched(MEETING), room_map(), user=user)


BAD = {
    "pose": ((9.0, np.ones(181), [np.nan, 0, 0]), "pose must be finite, got nan"),
    "older": ((0.5, np.ones(181), SENSOR), r"t must be later than the last scan's 1.0, got 0.5"),
    "as old": ((1.0, np.ones(181), SENSOR), r"t must be later than the last scan's 1.0, got 1.0"),
    "no time": ((np.nan, np.ones(181), SENSOR), "t must be in -1e.11 to 1e.11, got nan"),
    "negative": ((9.0, np.full(181, -0.5), SENSOR), "must not be negative or NaN, got -0.5"),
    "none": ((9.0, np.full(181, np.nan), SENSOR), "must not be negative or NaN, got nan"),
    "beams": ((9.0, np.ones(180), SENSOR), r"ranges must have shape \(181,\), got \(180,\)"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scan_is_refused_and_changes_nothing(case):
    """The error names value and rule, and what comes after it is observed as if it had not been."""
    log, (scan_, rule) = STREAMS["crossing"], BAD[case]
    observer = Observer(room_map(), log.angles)
    for i in range(len(log)):
        observer.step(log.t[i], log.ranges[i], log.poses[i])
        if log.t[i] == 1.0:
            with pytest.raises(ValueError, match=rule):
                observer.step(*scan_)
    assert same(observer.observation(), observe(log, room_map()))


def test_an_observer_without_a_scan_has_nothing_to_say():
    """An error, and no empty observation."""
    with pytest.raises(ValueError, match="needs a scan"):
        Observer(room_map(), ANGLES).observation()


def allocated(observer, begin, log):
    """Bytes held more after an observer has taken a log from a time on, and the most meanwhile."""
    before, _ = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    for t, ranges, pose in zip(log.t, log.ranges, log.poses, strict=True):
        observer.step(begin + t, ranges, pose)
    after, peak = tracemalloc.get_traced_memory()
    return after - before, peak - before


@pytest.fixture
def traced():
    tracemalloc.start()
    yield
    tracemalloc.stop()


@pytest.mark.usefixtures("traced")
def test_an_observer_of_an_empty_room_does_not_grow():
    """Of a scan in which nobody walks no more than its time is kept, though cans stand and beams are noisy."""
    log = watched(nobody(60.0), CANS, noise=0.015)
    observer = Observer(room_map(), log.angles)
    grown = [allocated(observer, 60.0 * k, log)[0] for k in range(4)]
    assert sum(grown[1:]) < 3 * len(log) * 16 + 20_000


@pytest.mark.usefixtures("traced")
def test_a_clock_that_jumps_by_years_costs_no_memory():
    """Who walks before and after the jump are two people; what lies between is not filled with scans."""
    log = watched(TO_AND_FRO, CANS)
    late = replace(log, t=np.where(np.arange(len(log)) < 50, log.t, log.t + 3e8))
    observer = Observer(room_map(), log.angles)
    _, peak = allocated(observer, 0.0, late)
    tracemalloc.reset_peak()
    observation = observer.observation()
    assert max(peak, tracemalloc.get_traced_memory()[1]) < 50e6
    assert [round(np.ptp(each.t)) for each in observation.people] == [5, 5]


@pytest.mark.parametrize("method", ["people", "paper"])
@pytest.mark.parametrize("jump", [86_400.0, 1.7e9])
def test_a_clock_that_jumps_is_noted(method, jump):
    """By a day or from 1970 until now, forwards: whoever looks at the result is told. Backwards there is no log."""
    log = watched(TO_AND_FRO, CANS)
    late = np.arange(len(log)) >= 50
    assert not observe(log, room_map(), method=method).notes
    notes = observe(replace(log, t=log.t + jump * late), room_map(), method=method).notes
    (note,) = (note for note in notes if note.kind == "pause")
    assert note.doubt and f"no scan for {jump:.4g} s" in note.text
    with pytest.raises(ValueError, match="t must increase"):
        replace(log, t=log.t - jump * late)


def test_a_clock_that_jumps_is_no_demonstration():
    """Not by the paper's method either, by which who walks on is the same: the gap is named."""
    log = watched(TO_AND_FRO)
    late = replace(log, t=np.where(np.arange(len(log)) < 50, log.t, log.t + 1.7e9))
    with pytest.raises(ValueError, match="t must not consist of gaps"):
        Demonstration.of(observe(late, room_map(), method="paper"))


# ---- recordings that nobody here made


OTHERS_DATA = os.environ.get("DOLLOP_EXTERNAL_DATA")
external = pytest.mark.skipif(OTHERS_DATA is None, reason="DOLLOP_EXTERNAL_DATA names no folder")
BOXES = np.array([[-9.0, 6.0, -8.5, 6.6], [-6.6, 7.6, -6.1, 8.0]])
LATER = np.array([[-9.6, 7.0, -9.0, 7.5], [-6.4, 6.3, -6.0, 6.8]])


def strangers(name):
    return Path(OTHERS_DATA) / "strangers" / name


@pytest.fixture(scope="module")
def strangers_map():
    return OccupancyGrid.from_log(read_log(strangers("empty.log.gz")))


@external
@pytest.mark.parametrize(
    ("name", "mean"),
    [("L_disc_0", 0.04), ("L_disc_1", 0.04), ("slalom_disc_0", 0.1), ("slalom_legs_0", 0.12), ("loop_legs_0", 0.1)],
)
def test_strangers_walks_are_found_whole(strangers_map, name, mean):
    """By the defaults: one person, near the truth on average, 95 % of the walk within 0.4 m, both boxes."""
    observation = observe(read_log(strangers(f"{name}.log.gz")), strangers_map)
    when, *truth = np.loadtxt(strangers(f"{name}_truth.csv"), delimiter=",").T
    user = observation.user
    found = [np.interp(when, user.t, column, left=np.nan, right=np.nan) for column in user.positions.T]
    away = np.hypot(*(np.array(found) - truth))
    assert len(observation.people) == 1 and observation.trusted
    assert np.nanmean(away) < mean and (away < 0.4).mean() >= 0.95
    np.testing.assert_allclose(sorted(observation.environment.boxes.tolist()), BOXES, atol=0.1)


@external
@pytest.mark.parametrize(("name", "boxes"), [("same", BOXES), ("moved", LATER)])
def test_strangers_boxes_are_found_in_three_seconds(strangers_map, name, boxes):
    """Both of them, every side within 0.1 m, and nobody; that one is partly behind the other is noted, no more."""
    observation = observe(read_log(strangers(f"{name}.log.gz")), strangers_map)
    np.testing.assert_allclose(sorted(observation.environment.boxes.tolist()), boxes, atol=0.1)
    assert observation.people == () and observation.trusted
    assert {note.kind for note in observation.notes} <= {"in part"}


@pytest.fixture(scope="module")
def three_people():
    pytest.importorskip("rosbags")
    return read_log(Path(OTHERS_DATA) / "people" / "demo_stationary_simple_environment.bag")


@external
def test_three_people_at_leg_height_stay_who_they_are(three_people):
    """Two walk to and fro in sight all the time, one comes after 7 s and stays; none ever leaps."""
    log = three_people
    people = observe(log, OccupancyGrid.from_log(log)).people
    assert len(people) == 3
    assert sorted(round(each.t[0] - log.t[0]) for each in people) == [0, 0, 7]
    for each in people:
        assert each.t[-1] == log.t[-1] and each.occluded.mean() < 0.1
        steps = np.linalg.norm(np.diff(each.positions, axis=0), axis=1) / np.diff(each.t)
        assert steps.max() < 3.0


@external
def test_walkers_seen_at_leg_height_as_the_paper_does(three_people):
    """With legs joined within a stride, the paper's method follows one of the three as the user."""
    log = three_people
    user = observe(log, OccupancyGrid.from_log(log), method="paper", min_area=0.0025, stride=0.6).user
    assert user.t[-1] - user.t[0] > 100 and user.occluded.mean() < 0.15
    assert np.ptp(user.positions[:, 1]) > 4.0 and np.quantile(user.speeds, 0.9) < 2.5
