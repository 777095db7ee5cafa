"""People: candidates, pieces and who goes on as whom (Sec. II, beyond the paper)."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rooms import ANGLES, CANS, disc_scans, drawn_map, legs, nobody, room_map, scan, together, walk, watched

from dollop.laser import LaserLog
from dollop.observation import observe
from dollop.people import (
    DOUBTFUL,
    SURE,
    VAGUE,
    Candidate,
    Followed,
    best_assignment,
    bridge,
    candidates,
    smooth_in_sight,
)
from dollop.tracking import Motion
from dollop.trajectory import arc_length

LONG = [2.6, 2.5, 4.0, 3.0]
STEP = np.radians(1.0)


def errors(track, log, places):
    """Distance in m of a track from places (T, 2), for each scan that it lived."""
    return np.linalg.norm(track.positions - places[np.searchsorted(log.t, track.t)], axis=1)


# ---- who may be a person in one scan


def candidates_of(ranges):
    """Candidates of a scan of which every reading below 5 m is foreground, seen from the origin along x."""
    beam = np.flatnonzero(ranges < 5.0)
    bearings = STEP * (np.arange(len(ranges)) - len(ranges) // 2)
    x, y = ranges * np.cos(bearings), ranges * np.sin(bearings)
    return candidates(beam, x[beam], y[beam], ranges, (0.0, 0.0, 0.0), STEP)


def seen(*bodies, width=61):
    """A scan (width,) of a wall at 8 m, and bodies before it: first beam, number of beams, distance in m."""
    ranges = np.full(width, 8.0)
    for first, count, distance in bodies:
        ranges[first : first + count] = distance
    return ranges


def test_readings_beside_each_other_are_one_candidate():
    """Two bodies a jump apart are two, each as wide as its beams are, and seen whole."""
    found = candidates_of(seen((5, 8, 3.0), (40, 10, 2.5)))
    assert len(found) == 2
    for each, (count, distance) in zip(found, [(8, 3.0), (10, 2.5)], strict=True):
        assert each.width == pytest.approx(count * STEP * distance, rel=0.1) and each.hidden == 0


def test_a_mixed_pixel_is_nobody():
    """One reading between a nearer and a farther surface is of neither; alone before what is far, it may be a leg."""
    edge = seen((30, 31, 1.0), (29, 1, 4.0))
    edge[30:] = 1.0
    beam = np.array([29])
    place = edge[beam] * np.cos(-STEP), edge[beam] * np.sin(-STEP)
    assert candidates(beam, *place, edge, (0.0, 0.0, 0.0), STEP) == []
    assert len(candidates_of(seen((29, 1, 4.0)))) == 1


def test_two_narrow_ones_within_a_stride_are_one_person():
    """Legs 0.4 m apart are one candidate between them, or else one of both; a metre apart they are two."""
    near, far = candidates_of(seen((20, 3, 3.0), (28, 3, 3.0))), candidates_of(seen((10, 3, 3.0), (30, 3, 3.0)))
    assert [each.leg_of for each in near] == [0, 1, 2] and [each.leg_of for each in far] == [0, 0]
    assert near[0].y == pytest.approx(3.0 * np.sin(-5 * STEP), abs=0.02)


def test_a_leg_and_a_stray_reading_are_not_taken_for_two_legs():
    """Who was followed by one leg stays there, though something narrow shows up within a stride."""
    followed, leg = Followed(), Candidate(3.0, 0.0, 1.0, 0.0, 0.1, 0.14, 0.0)
    for k in range(10):
        followed.step(0.1 * k, [leg])
    stray, pair = leg._replace(y=0.6, leg_of=2), Candidate(3.0, 0.3, 1.0, 0.0, 0.0, 0.07, 0.0)
    followed.step(1.0, [pair, leg._replace(leg_of=1), stray])
    assert abs(followed.alive[0].y) < 0.02 and len(followed.alive) == 1


@pytest.mark.parametrize(("nearer", "hidden"), [(34, 1), (26, -1)])
def test_which_side_is_hidden_is_told(nearer, hidden):
    """A body beside something nearer is hidden there, and its middle is less sure."""
    ranges = seen((27, 7, 4.0))
    ranges[slice(nearer, None) if nearer > 30 else slice(0, nearer + 1)] = 1.0
    beam = np.arange(27, 34)
    bearings = STEP * (beam - 30)
    x, y = 4.0 * np.cos(bearings), 4.0 * np.sin(bearings)
    (cut,) = candidates(beam, x, y, ranges, (0.0, 0.0, 0.0), STEP)
    (whole,) = candidates(beam, x, y, seen((27, 7, 4.0)), (0.0, 0.0, 0.0), STEP)
    assert cut.hidden == hidden and cut.sd > whole.sd


def test_a_pause_ends_every_piece():
    """Who was in sight before a pause of seconds and stands there after it is followed anew."""
    followed, distance = Followed(), [3.0, 3.2, 3.4, *[3.5] * 20]
    for begin, way in ((0.0, distance), (9.0, distance[::-1])):
        for k, x in enumerate(way):
            followed.step(begin + 0.1 * k, [Candidate(x, 0.0, 1.0, 0.0, 0.4, 0.05, 0.0)])
    assert [each[:, 0].tolist() for each in followed.pieces()] == [[*range(23)], [*range(23, 46)]]


# ---- where the middle of somebody is

OPEN = drawn_map([[-10, -10, -9.9, 10], [9.9, -10, 10, 10], [-10, -10, 10, -9.9], [-10, 9.9, 10, 10]], 10, 10, 10.2)
WALL = np.array([[-10, -10, -9.9, 10], [9.9, -10, 10, 10], [-10, -10, 10, -9.9], [-10, 9.9, 10, 10.0]])
ALL_ROUND = np.linspace(-np.pi, np.pi, 720, endpoint=False)


def seen_all_round(places, radius=0.2, seed=0):
    """A log from the middle of a large hall, of a disc at places (T, 1, 2)."""
    pose, rng = np.array([0.0, 0.0, 0.3]), np.random.default_rng(seed)
    ranges = np.minimum(scan(pose, WALL, angles=ALL_ROUND), disc_scans(pose, places, radius, ALL_ROUND))
    ranges = ranges + 0.005 * rng.standard_normal(ranges.shape)
    return LaserLog(0.1 * np.arange(len(ranges)), ranges, ALL_ROUND, np.tile(pose, (len(ranges), 1)), 30.0)


@pytest.mark.parametrize("distance", [1.5, 2.0, 3.0, 5.0])
def test_the_middle_of_a_disc_is_known_from_any_side(distance):
    """Once round the laser: in every octant the mean error of the middle is below 2 cm, along the sight and across."""
    angle = 0.4 + np.arange(0, 2 * np.pi, 0.1 / distance)
    circle = distance * np.column_stack([np.cos(angle), np.sin(angle)])
    user = observe(seen_all_round(circle[:, None]), OPEN).user
    assert len(user) == len(circle)
    off, octant = user.positions - circle, (angle // (np.pi / 4)) % 8
    for k in range(8):
        assert np.linalg.norm(off[octant == k].mean(axis=0)) < 0.02


@pytest.mark.parametrize("radius", [0.15, 0.2, 0.25])
def test_the_middle_is_known_whether_somebody_comes_or_goes(radius):
    """Straight to the laser and away from it, thin or stout: within 2 cm on average."""
    way = walk([1.0, 5.0], [0.5, 1.0], [5.0, 2.0])
    user = observe(seen_all_round(way, radius), OPEN).user
    assert np.linalg.norm((user.positions - way[:, 0]).mean(axis=0)) < 0.02


def test_legs_are_followed_without_options():
    """Two legs in stride are one person, whose way is within 4 cm of their middle on average."""
    feet = legs(walk([2, 4.5], [6.5, 4.5], [7, 2], [3, 2]))
    log = watched(feet, radius=0.06)
    observation = observe(log, room_map())
    assert observation.people == (observation.user,) and observation.trusted
    assert len(observation.user) == len(log)
    assert errors(observation.user, log, feet.mean(axis=1)).mean() < 0.04


# ---- out of sight


@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0])
def test_who_was_behind_a_box_for_three_seconds_is_the_same_person(rate):
    """One person, no note, never farther than 0.3 m from the truth though unseen for 3 s."""
    way = walk([7.5, 4.2], [0.5, 4.2], speed=0.7, rate=rate)
    log = watched(way, LONG, rate=rate)
    observation = observe(log, room_map())
    user = observation.user
    assert observation.people == (user,) and observation.notes == () and observation.losses == 1
    assert user.occluded.sum() / rate > 3.0
    assert len(user) == len(log) and errors(user, log, way[:, 0]).max() < 0.3


def test_who_turns_back_behind_a_box_is_not_sent_through_it():
    """Seen again where they went out of sight, they have been on within, and no faster than they walk."""
    way = walk([7.5, 4.2], [2.6, 4.2], [7.5, 4.2])
    log = watched(way, LONG)
    user = observe(log, room_map()).user
    assert user.t[-1] == log.t[-1] and user.speeds.max() < 1.5
    assert errors(user, log, way[:, 0]).max() < 0.4


CROSSING = walk([2, 4.5], [7, 2]), walk([7, 4.5], [2, 2], speed=0.9)
PASSING = walk([7, 3], [2, 3]), walk([2, 3.6], [7, 3.6])


@pytest.mark.parametrize("pair", [CROSSING, PASSING], ids=["crossing", "passing"])
@pytest.mark.parametrize("who", [0, 1])
def test_two_who_cross_keep_their_identity(pair, who):
    """Named by the place where the walk began, each is followed to its end, though the other hid them."""
    log = watched(together(*pair))
    observation = observe(log, room_map(), user=pair[who][0, 0])
    assert len(observation.people) == 2 and observation.trusted
    user, way = observation.user, pair[who][:, 0]
    assert any(each.occluded.any() for each in observation.people)
    assert len(user) == len(way)
    assert errors(user, log, way).max() < 0.15


def behind_the_box(one_turns, other_turns, pace):
    """Two who go behind a box from either side, where one cannot tell who comes out, and turn back there."""
    one = walk([7, 4.2], [one_turns, 4.2], [7, 4.2])
    return one, walk([0.5, 4.2], [other_turns, 4.2], [0.5, 4.2], speed=pace)


def test_where_two_may_be_exchanged_a_note_says_so():
    """Both come out as either might have: the user is followed as far as it is surely the same, and a note says so."""
    pair = behind_the_box(2.9, 2.5, 0.6)
    log = watched(together(*pair), LONG)
    for way in pair:
        observation = observe(log, room_map(), user=way[0, 0])
        assert "exchange" in [note.kind for note in observation.notes] and not observation.trusted
        assert len(observation.user) < 0.5 * len(way)
        assert errors(observation.user, log, way[:, 0]).max() < 0.15


@pytest.mark.parametrize("one_turns", [2.9, 3.2])
@pytest.mark.parametrize("other_turns", [2.3, 2.5])
@pytest.mark.parametrize("pace", [0.5, 0.7, 0.9])
def test_behind_a_box_two_are_told_apart_or_a_note_says_that_they_are_not(one_turns, other_turns, pace):
    """However they walk there: who is named is followed to the end, or the result is not trusted."""
    pair = behind_the_box(one_turns, other_turns, pace)
    log = watched(together(*pair), LONG)
    for way in pair:
        observation = observe(log, room_map(), user=way[0, 0])
        whole = len(observation.user) == len(way) and errors(observation.user, log, way[:, 0]).max() < 0.3
        assert whole or not observation.trusted


def test_somebody_who_stands_among_boxes_is_no_box_once_they_walked():
    """Who walks, stands for six seconds, and walks on is one person all the time, and no object."""
    there, on = walk([7.0, 2.5], [4.5, 3.5]), walk([4.5, 3.5], [2.0, 2.0])
    way = np.concatenate([there, np.repeat(there[-1:], 60, axis=0), on])
    log = watched(way, CANS)
    observation = observe(log, room_map())
    assert observation.people == (observation.user,) and len(observation.environment) == 2
    assert len(observation.user) == len(log) and errors(observation.user, log, way[:, 0]).max() < 0.3


def half_hidden(seconds, speed=0.8):
    """Times, middles (n, 2), deviations, truth: out of sight for 0.8 s, vaguely seen to stand, and gone on."""
    x = np.concatenate(
        [np.arange(-2.0, 0.0, speed / 10), np.zeros(8 + round(10 * seconds)), np.arange(0.0, 2.0, speed / 10)]
    )
    measured = np.column_stack([x, 0 * x]) + np.random.default_rng(0).normal(0, 0.01, (len(x), 2))
    sd = np.where((x == 0) | (x > 1.7), VAGUE, SURE)
    measured[np.flatnonzero(x == 0)[:8]] = np.nan
    return np.arange(len(x)) / 10, measured, sd, x


@pytest.mark.parametrize("seconds", [2.0, 12.0])
def test_who_stands_half_hidden_stands(seconds):
    """Seen vaguely all the while, at the edge of something: the way does not leave the place."""
    t, measured, sd, x = half_hidden(seconds)
    places, _ = smooth_in_sight(t, measured, Motion(), sd)
    assert np.hypot(*places[(x == 0)][8:].T).max() < 0.25
    assert np.median(np.hypot(*places[x == 0].T)) < 0.03


def test_mixed_pixels_at_the_edges_of_boxes_are_nobody():
    """Ten seconds of readings between a box and the wall behind it, at both edges, make no person."""
    log, rng = watched(nobody(10.0), CANS), np.random.default_rng(0)
    ranges = log.ranges.copy()
    jumps = np.abs(np.diff(ranges, axis=1)) > 0.5
    share = rng.random(jumps.shape)
    mixed = share * ranges[:, 1:] + (1 - share) * ranges[:, :-1]
    ranges[:, 1:] = np.where(jumps & (rng.random(jumps.shape) < 0.5), mixed, ranges[:, 1:])
    observation = observe(LaserLog(log.t, ranges, ANGLES, log.poses, log.max_range), room_map())
    assert observation.people == () and len(observation.environment) == 2


# ---- the way of somebody out of sight

metres, paces = st.floats(-2.0, 2.0), st.floats(0.4, 1.5)
headings = st.floats(-np.pi, np.pi)


@given(metres, metres, headings, headings, paces, st.floats(0.6, 5.0))
def test_a_bridge_begins_and_ends_where_somebody_was_seen(x, y, leaving, coming, pace, seconds):
    """At both ends it is there, goes on as seen, and everywhere at one speed; it is never shorter than straight."""
    places, t = np.array([[0.0, 0.0], [x, y]]), np.array([0.0, seconds])
    assume(np.hypot(x, y) > 0.05)
    ways = pace * np.array([[np.cos(each), np.sin(each)] for each in (leaving, coming)])
    positions, velocities = bridge(t, places, ways, np.linspace(0, seconds, 400), pace)
    np.testing.assert_allclose(positions[[0, -1]], places, atol=1e-9)
    walked = arc_length(positions)[-1]
    assert walked >= np.hypot(x, y) - 1e-6
    speeds = np.hypot(*velocities.T)
    np.testing.assert_allclose(speeds, speeds[0], rtol=1e-6)
    assert speeds[0] * seconds == pytest.approx(walked, rel=0.02)


@given(metres, metres, headings, headings, st.floats(0.6, 1.5), st.floats(0.6, 5.0))
def test_a_bridge_is_as_long_as_somebody_walks_in_the_time(x, y, leaving, coming, pace, seconds):
    """Who does not simply go straight on has walked at their pace, or a little faster where that is not enough."""
    places, t, straight = np.array([[0.0, 0.0], [x, y]]), np.array([0.0, seconds]), np.hypot(x, y)
    ways = pace * np.array([[np.cos(each), np.sin(each)] for each in (leaving, coming)])
    assume(0.05 < straight < pace * seconds and (ways @ places[1]).min() < 0.5 * pace * straight)
    positions, _ = bridge(t, places, ways, np.linspace(0, seconds, 400), pace)
    walked = arc_length(positions)[-1]
    assert 0.98 * pace * seconds < walked < 1.3 * pace * seconds
    assert walked < 1.02 * pace * seconds or straight > 0.8 * pace * seconds


def test_a_bridge_of_somebody_who_stands_is_straight():
    """Seen standing before and after, they went straight from here to there."""
    places = np.array([[1.0, 1.0], [2.0, 3.0]])
    positions, _ = bridge(np.array([0.0, 2.0]), places, np.zeros((2, 2)), np.linspace(0, 2, 21), 0.0)
    np.testing.assert_allclose(positions, np.linspace(*places, 21), atol=1e-6)


# ---- who goes on as whom


def by_all_permutations(odds):
    """The best matching's pairs, and those for which another matching is nearly as good."""
    n, rows = len(odds), np.arange(len(odds))

    def best(values):
        return max((values[rows, list(order)].sum(), order) for order in permutations(range(n)))

    total, order = best(odds)
    pairs = {(i, j) for i, j in enumerate(order) if odds[i, j] > 0}
    doubtful = set()
    for i, j in pairs:
        without = odds.copy()
        without[i, j] = 0.0
        other, _ = best(without)
        if other > total - odds[i, j] + 1e-9 and total - other < DOUBTFUL:
            doubtful.add((i, j))
    return pairs, doubtful


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
def test_the_assignment_is_the_best_of_all_and_doubts_are_those_of_all(n):
    """Of every matching of tiny cases: what is surely joined is in the best, the rest of the best is in doubt."""
    rng, joined, doubted = np.random.default_rng(n), 0, 0
    for _ in range(60):
        odds = np.where(rng.random((n, n)) < 0.6, rng.uniform(0.1, 8.0, (n, n)), 0.0)
        pairs, doubtful = by_all_permutations(odds)
        after, (ends, begins) = best_assignment(odds)
        assert set(after.items()) == pairs - doubtful
        assert ends == {i for i, _ in doubtful} and begins == {j for _, j in doubtful}
        joined, doubted = joined + len(after), doubted + len(ends)
    assert joined > 20 and (doubted > 20 or n == 1)


@given(st.permutations(range(4)), st.integers(0, 1000))
def test_the_order_of_pieces_does_not_matter(order, seed):
    """Pieces numbered otherwise are joined alike, and doubted alike."""
    rng = np.random.default_rng(seed)
    odds = np.where(rng.random((4, 4)) < 0.6, rng.uniform(0.1, 8.0, (4, 4)), 0.0)
    after, doubts = best_assignment(odds)
    again, doubts_again = best_assignment(odds[np.ix_(order, order)])
    assert {(order[i], order[j]) for i, j in again.items()} == set(after.items())
    assert [{order[i] for i in each} for each in doubts_again] == list(doubts)
