"""People as data: speeds, stops, laps, replayed walks, ways round things, and real walks from files."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from random_scenes import random_place, random_scene

from dollop.formats.files import FormatError
from dollop.lab.outlines import outline_distances
from dollop.lab.people import find_way, read_walks, replay, walk_of, walks_of
from dollop.lab.person import SHOULDERS
from dollop.lab.rooms import Part, Room
from dollop.lab.scenes import Scene
from dollop.lab.things import Move, Object, Person, Robot
from dollop.trajectory import arc_length

HALL = Scene(room=Room([(0, 0), (24, 0), (24, 8), (0, 8)]), robot=Robot((1.0, 0.5, 0.0)))
PLACES = np.array([(3.0, 3.0), (8.0, 3.0), (8.0, 5.5), (3.0, 5.5)])
WALL = Part("box", (3.0, 1.5, 1.2), (0.1, 3.0, 2.4))
TWO_ROOMS = Scene(room=Room([(0, 0), (6, 0), (6, 4), (0, 4)], [WALL]), robot=Robot((1.0, 3.4, 0.0)))
CLOSED = Scene(
    room=Room(TWO_ROOMS.room.corners, [Part("box", (3.0, 2.0, 1.2), (0.1, 3.9, 2.4))]), robot=TWO_ROOMS.robot
)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("speed", [0.4, 0.8, 1.2, 1.8])
def test_speeds_are_kept_on_a_straight_line(speed, seed):
    """In the middle of 20 m the mean speed is the one asked for within ten per cent."""
    walk = walk_of(Person([(2.0, 4.0), (22.0, 4.0)], speed=speed, seed=seed), HALL)
    middle = np.abs(walk.positions[:, 0] - 12.0) < 4.0
    assert walk.speeds[middle].mean() == pytest.approx(speed, rel=0.1)


def standstills(walk):
    """Where and how long the person stands on the way, after the first and before the last standing."""
    still = np.flatnonzero(np.diff((walk.speeds < 0.03).astype(int)))
    for end, begin in still[1:-1].reshape(-1, 2):
        yield walk.positions[(end + begin) // 2], walk.t[begin] - walk.t[end]


@pytest.mark.parametrize("seed", range(5))
def test_stops_take_as_long_as_said_and_happen_at_their_places(seed):
    """A person stands at the two places named, for the time named within half a second, and nowhere else."""
    walk = walk_of(Person(PLACES, stops=[(1, 3.0), (2, 6.0)], seed=seed), HALL)
    places, seconds = zip(*standstills(walk), strict=True)
    assert np.linalg.norm(places - PLACES[1:3], axis=1).max() < 0.15
    assert seconds == pytest.approx((3.0, 6.0), abs=0.5)


def test_a_stop_is_made_in_every_lap():
    """In three laps a person stands three times at the same place, scattered by what it is missed by."""
    walk = walk_of(Person(PLACES, stops=[(2, 2.0)], laps=3, scatter=0.05), HALL)
    places, seconds = zip(*standstills(walk), strict=True)
    assert len(places) == 3 and np.linalg.norm(places - PLACES[2], axis=1).max() < 0.3
    assert np.linalg.norm(np.ptp(places, axis=0)) > 0.01 and seconds == pytest.approx([2.0] * 3, abs=0.5)


VISITS = [
    (1, False, [0, 1, 2, 3]),
    (1, True, [0, 1, 2, 3, 2, 1, 0]),
    (3, False, [0, 1, 2, 3] * 3 + [0]),
    (2, True, [0, 1, 2, 3, 2, 1] * 2 + [0]),
]


@pytest.mark.parametrize(("laps", "back", "order"), VISITS)
def test_places_are_visited_in_order(laps, back, order):
    """The places within 0.3 m of which a person passes, one after the other, are those of laps and ways back."""
    walk = walk_of(Person(PLACES, laps=laps, back=back, seed=2), HALL)
    away = np.linalg.norm(walk.positions[:, None] - PLACES, axis=2)
    passed = away.argmin(axis=1)[away.min(axis=1) < 0.3]
    assert passed[np.flatnonzero(np.diff(passed, prepend=-1))].tolist() == order


def test_a_closed_way_is_walked_in_laps():
    """A place that ends the way and begins it is passed once a lap, and the place before it is not missed."""
    once, twice = (walk_of(Person([*PLACES, PLACES[0]], laps=laps, seed=2), HALL) for laps in (1, 2))
    assert arc_length(twice.positions)[-1] == pytest.approx(2 * arc_length(once.positions)[-1], rel=0.05)


@pytest.mark.parametrize("back", [False, True])
def test_a_walk_stays_by_the_straight_lines_between_its_places(back):
    """Round a corner and back again a person is within half a metre of the lines, however long those are."""
    places = np.array([(2.0, 2.0), (9.0, 2.0), (9.0, 6.0)])
    lines = np.vstack([np.linspace(places[0], places[1], 100), np.linspace(places[1], places[2], 100)])
    walk = walk_of(Person(places, back=back), HALL)
    assert np.linalg.norm(walk.positions[:, None] - lines, axis=2).min(axis=1).max() < 0.5


def test_a_real_walk_can_be_had_anywhere():
    """Turned and shifted, it begins and ends where it is to, as long and as fast as it was."""
    t = np.linspace(10.0, 14.0, 40)
    track = np.column_stack([t, 3.0 + np.sin(t), t])
    person = replay(track, (2.0, 3.0), 0.5, body="legs")
    places = np.array(person.places)
    assert places[0] == pytest.approx((2.0, 3.0)) and person.times[-1] == pytest.approx(4.0)
    assert np.arctan2(*(places[-1] - places[0])[::-1]) == pytest.approx(0.5)
    assert arc_length(places)[-1] == pytest.approx(arc_length(track[:, 1:])[-1])


@pytest.mark.parametrize("body", ["torso", "legs"])
def test_a_replayed_walk_is_where_it_was_at_each_time(body):
    """At every time of the record the person is within 2 cm of its place, held before and for 1.5 s after."""
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.03, 0.4, 60)) - 0.01
    places = (6.0, 4.0) + np.cumsum(rng.normal(0.0, 0.02, (60, 2)), axis=0)
    walk = walk_of(Person(places, begin=2.5, times=times, body=body), HALL)
    since = times - times[0]
    found = np.array([walk.at(2.5 + time)[0] for time in since])
    assert np.linalg.norm(found - places, axis=1).max() < 0.02
    assert walk.at(1.0)[0] == pytest.approx(places[0]) and walk.at(1e3)[0] == pytest.approx(found[-1], abs=0.02)
    assert walk.body == body and walk.t[-1] == pytest.approx(2.5 + since[-1] + 1.5, abs=0.03)


def test_a_person_sets_off_at_its_time():
    """Until then it stands, whatever it does later; who has a single place stands there for good."""
    for person in (Person(PLACES, begin=4.0), Person(PLACES, begin=4.0, times=range(4))):
        walk = walk_of(person, HALL)
        gone = arc_length(walk.positions)
        assert gone[walk.t < 3.7].max() < 0.01 < gone[np.searchsorted(walk.t, 5.0)]
    assert walk_of(Person([(3.0, 3.0)]), HALL).at(77.0)[0].tolist() == [3.0, 3.0]


def test_the_same_seed_walks_the_same_walk():
    """A walk follows from its data alone, and another seed is another walk."""
    one, same, other = (walk_of(Person(PLACES, scatter=0.1, seed=seed), HALL) for seed in (5, 5, 6))
    assert np.array_equal(one.positions, same.positions)
    assert np.abs(one.positions[:400] - other.positions[:400]).max() > 0.02


# ---- who is in the way


GOING, COMING = Person([(3.0, 2.0), (9.0, 2.0)]), Person([(9.0, 2.1), (3.0, 2.1)])
BESIDE, DRIVES = Person([(3.0, 5.0), (9.0, 5.0)]), Robot((3.0, 2.0, 0.0), way=[(9.0, 2.0)])
CARTON = Object("box", (6.0, 2.0), (1.0, 0.6), 0.8, turn=0.3)
APART = r"people 0 and 1 must keep 0\.25 m apart, got 0\.\d\d m at \d\.\d s"
IN_THE_WAY = {
    "a wall": (replace(TWO_ROOMS, people=[Person([(1, 1), (5, 1)])]), r"0\.0 m .* background, got -0\.\d+ m at"),
    "a carton": (replace(HALL, objects=[CARTON], people=[GOING]), "not lead through an object, got object 0 at"),
    "who comes": (replace(HALL, people=[GOING, COMING]), APART),
    "who stands": (replace(HALL, people=[GOING, Person([(6.0, 2.0)])]), APART),
    "a wall, replayed": (
        replace(TWO_ROOMS, people=[Person([(1, 1), (5, 1)], times=(0, 4))]),
        r"0\.0 m .* background, got -0\.\d+ m at",
    ),
    "where one stands": (replace(HALL, objects=[CARTON], people=[Person([(6.0, 2.4)])]), "got object 0 at"),
    "what was moved": (
        replace(HALL, objects=[CARTON.at((6.0, 4.0))], people=[GOING], moves=[Move(0, 0.0, (6.0, 2.0))]),
        r"person 0 and object 0, when moved, must keep 0\.12 m apart, got -0\.\d\d m at",
    ),
    "what sweeps over who stands": (
        replace(HALL, objects=[CARTON], people=[BESIDE, Person([(8.0, 2.0)])], moves=[Move(0, 1.0, (10.0, 2.0), 2.0)]),
        r"person 1 and object 0, when moved, must keep 0\.12 m apart, got -0\.\d\d m at \d\.\d s",
    ),
    "what sweeps over who walks": (
        replace(HALL, objects=[CARTON], people=[Person([(8.0, 3.0), (8.0, 0.8)])], moves=[Move(0, 1.0, (10, 2), 4.0)]),
        r"person 0 and object 0, when moved, must keep 0\.12 m apart, got -?0\.\d\d m at \d\.\d s",
    ),
    "the robot that drives, as one comes": (
        replace(HALL, robot=DRIVES, people=[Person([(9.0, 2.0), (3.0, 2.1)])]),
        r"person 0 and the robot that drives must keep 0\.38 m apart, got 0\.\d\d m at \d\.\d s",
    ),
    "the robot that drives, as one stands": (
        replace(HALL, robot=DRIVES, people=[Person([(3.0, 6.0), (20.0, 6.0)]), Person([(6.0, 2.0)])]),
        r"person 1 and the robot that drives must keep 0\.38 m apart, got 0\.\d\d m at \d+\.\d s",
    ),
    "the robot": (
        replace(HALL, robot=Robot((6.0, 2.0, 0.0)), people=[GOING]),
        r"person 0 and the robot must keep 0\.38 m apart, got 0\.\d\d m at \d\.\d s",
    ),
}


@pytest.mark.parametrize(("scene", "rule"), IN_THE_WAY.values(), ids=IN_THE_WAY)
def test_nobody_walks_through_anything(scene, rule):
    """A wall, a carton, also when moved, somebody who comes or stands, and the robot raise ValueError that says so."""
    with pytest.raises(ValueError, match=rule):
        walks_of(scene)


ONE_WHO_STANDS = [
    (replace(HALL, robot=DRIVES, people=[Person([(6.0, 2.0)])]), "person 0 and the robot that drives must keep"),
    (
        replace(HALL, objects=[CARTON], people=[Person([(8.0, 2.0)])], moves=[Move(0, 1.0, (10.0, 2.0))]),
        "person 0 and object 0, when moved, must keep",
    ),
    (
        replace(HALL, robot=DRIVES, people=[Person([(8.5, 4.0), (8.5, 2.0)], speed=2.0, begin=0.0)]),
        "person 0 and the robot that drives must keep",
    ),
]


@pytest.mark.parametrize(("scene", "rule"), ONE_WHO_STANDS)
def test_who_stands_for_good_is_not_run_over(scene, rule):
    """When nobody walks any more, a robot or an object that comes later is in the way as well."""
    with pytest.raises(ValueError, match=rule):
        walks_of(scene)


def test_a_moved_object_and_a_driving_robot_pass_by():
    """What is moved when somebody has gone, and a robot that drives along a walk beside it, are no error."""
    gone = Person([(8.0, 2.0), (8.0, 6.0)], begin=0.0)
    late = replace(HALL, objects=[CARTON], people=[gone], moves=[Move(0, 8.0, (10.0, 2.0), 2.0)])
    assert len(walks_of(late)) == len(walks_of(replace(HALL, robot=DRIVES, people=[BESIDE]))) == 1


def test_people_pass_each_other_where_there_is_room():
    """Two who meet at an arm's length, and one who comes when the other has gone, are no error."""
    beside, later = Person([(9.0, 2.8), (3.0, 2.8)]), Person([(9.0, 2.0), (15.0, 2.0)], begin=0.0)
    for other in (beside, later):
        assert len(walks_of(replace(HALL, people=[GOING, other]))) == 2


def test_a_person_keeps_clear_of_what_is_round():
    """Sent straight through a can, a person goes round it."""
    can = Object.trash_can((6.0, 2.0))
    walk = walk_of(Person([(3.0, 2.05), (9.0, 2.05)]), replace(HALL, objects=[can]))
    assert outline_distances(walk.positions, [can.footprint]).min() > SHOULDERS / 2 + 0.1 - 1e-9


# ---- ways


def free_distance(scene, points):
    """Distance (N,) from points to the nearest of walls, furniture and objects."""
    distances = [scene.room.distance(points)]
    distances += [outline_distances(points, [each.footprint])[:, 0] for each in scene.objects]
    return np.min(distances, axis=0)


def test_a_way_leads_through_the_door():
    """From one room to the other and on to a third place: all are on the way, and it keeps to the door."""
    places = [(1.0, 1.0), (5.0, 1.0), (5.0, 3.4)]
    way = find_way(TWO_ROOMS, places)
    assert way[0].tolist() == [1.0, 1.0] and all((way == place).all(axis=1).any() for place in places)
    line = drawn(way)
    at_the_wall = line[np.abs(line[:, 0] - 3.0) < 0.05]
    assert len(at_the_wall) and at_the_wall[:, 1].min() > 3.0 + SHOULDERS / 2 + 0.1
    assert arc_length(way[:-1])[-1] < 1.15 * 2 * np.hypot(2.0, 2.4)


@pytest.mark.parametrize("along", [0, 1])
def test_a_way_leads_through_a_corridor_one_cell_wide(along):
    """Where a person just fits, along x or along y, the way is the straight one."""
    corners, places = np.array([(0, 0), (6, 0), (6, 0.88), (0, 0.88)]), np.array([(1.0, 0.45), (5.0, 0.45)])
    swapped = [along, 1 - along]
    scene = Scene(room=Room(corners[:, swapped]), robot=Robot((*np.array([5.6, 0.44])[swapped], 0.0)))
    assert find_way(scene, places[:, swapped]).tolist() == places[:, swapped].tolist()


def drawn(way):
    """Points (N, 2) on a way."""
    return np.concatenate([np.linspace(*ends, 300) for ends in zip(way[:-1], way[1:], strict=True)])


@pytest.mark.parametrize("block", range(4))
def test_no_way_comes_nearer_than_it_should(block):
    """In random scenes a shoulder on the way keeps four fifths of what it is to keep clear, or no way is found."""
    found = 0
    for seed in range(block, 60, 4):
        rng = np.random.default_rng(seed)
        scene, clear = random_scene(rng), rng.uniform(0.05, 0.3)
        places = np.array([random_place(rng, scene.room, SHOULDERS / 2 + clear) for _ in range(3)])
        try:
            way = find_way(scene, places, clear)
        except ValueError:
            continue
        found += 1
        assert free_distance(scene, drawn(way)).min() > SHOULDERS / 2 + 0.8 * clear - 0.001
        assert np.array_equal(way[[0, -1]], places[[0, -1]]) and (way == places[1]).all(axis=1).any()
    assert found >= 4


NO_WAY = [
    (CLOSED, [(1.0, 1.0), (5.0, 1.0)], r"found none from \[1\.0, 1\.0\] to \[5\.0, 1\.0\]"),
    (TWO_ROOMS, [(1.0, 1.0), (3.0, 1.0)], r"needs room at every place, found none at \[3\.0, 1\.0\]"),
    (TWO_ROOMS, [(1.0, 1.0), (9.0, 1.0)], r"needs room at every place, found none at \[9\.0, 1\.0\]"),
]


@pytest.mark.parametrize(("scene", "places", "rule"), NO_WAY)
def test_where_there_is_no_way_it_is_said(scene, places, rule):
    """A closed wall, a place in a wall and one outside raise ValueError that names the places."""
    with pytest.raises(ValueError, match=rule):
        find_way(scene, places)


# ---- people that cannot be

BAD_PEOPLE = [
    ({"places": []}, "needs a place to be, got none"),
    ({"places": [(1.0, np.nan), (2.0, 2.0)]}, "a person's places must be finite, got .*nan"),
    ({"places": [(1.0, 2.0, 3.0)]}, r"a person's places must have shape \(N, 2\), got \(1, 3\)"),
    ({"speed": 0.05}, "a person's speed must be in 0.1 to 3, got 0.05"),
    ({"speed": np.nan}, r"a person's speed must be a finite number within 1e\+09, got nan"),
    ({"body": "head"}, "body must be one of 'torso', 'legs', got 'head'"),
    ({"body": "robot"}, "body must be one of 'torso', 'legs', got 'robot'"),
    ({"begin": -1.0}, "begin must be in 0 to 3600, got -1.0"),
    ({"begin": 1e9}, "begin must be in 0 to 3600, got 1000000000.0"),
    ({"begin": 1e10}, r"begin must be a finite number within 1e\+09, got 10000000000.0"),
    ({"stops": [(2, 1.0)]}, "a stop must be at one of 2 places, got place 2"),
    ({"stops": [(-1, 1.0)]}, "a stop must be at one of 2 places, got place -1"),
    ({"stops": [(0.5, 1.0)]}, "a stop must be at one of 2 places, got place 0.5"),
    ({"stops": [(np.nan, 1.0)]}, "a stop must be at one of 2 places, got place nan"),
    ({"stops": [(0, 0.0)]}, "the time of a stop must be in 0.01 to 3600, got 0.0"),
    ({"stops": [(99, 1.0)]}, "a stop must be at one of 2 places, got place 99"),
    ({"stops": [(0, 3601.0)]}, "the time of a stop must be in 0.01 to 3600, got 3601.0"),
    ({"laps": 0}, "laps must be a whole number, 1 to 100, got 0"),
    ({"laps": 10**9}, "laps must be a whole number, 1 to 100, got 1000000000"),
    ({"laps": 1.5}, "laps must be a whole number, 1 to 100, got 1.5"),
    ({"laps": np.inf}, "laps must be a whole number, 1 to 100, got inf"),
    ({"scatter": -0.1}, "scatter must be in 0 to 1, got -0.1"),
    ({"scatter": 1.1}, "scatter must be in 0 to 1, got 1.1"),
    ({"back": 2}, "back must be one of False, True, got 2"),
    ({"places": [(1, 1), (1, 1), (2, 2)]}, r"must differ from one to the next, got \(1.0, 1.0\) twice"),
    ({"times": [0.0, 0.2]}, "at most 5 m/s fast and 3600 s long, got 7.1 and 0.2"),
    ({"times": [0.0, 3601.0]}, "at most 5 m/s fast and 3600 s long, got 0.0 and 3601.0"),
    ({"times": [1.0]}, "times must increase, one for each of 2 places, got 1"),
    ({"times": [1.0, 1.0]}, "times must increase, one for each of 2 places"),
    ({"times": [1.0, np.nan]}, "times must be finite, got nan"),
    ({"seed": -1}, "seed must be a whole number, 0 to 9223372036854775808, got -1"),
]


@pytest.mark.parametrize(("said", "rule"), BAD_PEOPLE)
def test_a_person_that_cannot_be_is_refused(said, rule):
    """A number out of its range, no place, an unknown body and a stop nowhere raise ValueError that names it."""
    with pytest.raises(ValueError, match=rule):
        Person(**({"places": [(1.0, 1.0), (2.0, 2.0)]} | said))


def test_who_is_replayed_may_stay_and_run_and_who_runs_faster_is_none():
    """The same place at two times is a pause; 4.9 m in a second can be replayed and 5.1 m cannot."""
    assert Person([(1.0, 1.0), (1.0, 1.0)], times=(0.0, 1.0)).times == (0.0, 1.0)
    assert replay([(0.0, 0.0, 0.0), (1.0, 4.9, 0.0)], (1.0, 2.0), 0.0).times == (0.0, 1.0)
    with pytest.raises(ValueError, match="a replayed walk must be at most 5 m/s fast .*, got 5.1 and 1.0"):
        replay([(0.0, 0.0, 0.0), (1.0, 5.1, 0.0)], (1.0, 2.0), 0.0)


BAD_MOVES = [
    ({"begin": -1.0}, "begin must be in 0 to 3600, got -1.0"),
    ({"begin": 1e9}, "begin must be in 0 to 3600, got 1000000000.0"),
    ({"seconds": 0.0}, "seconds must be in 0.01 to 3600, got 0.0"),
    ({"to": (np.nan, 1.0)}, "to must be finite, got nan"),
    ({"to": (1.0,)}, r"to must have shape \(2,\), got \(1,\)"),
]


@pytest.mark.parametrize(("said", "rule"), BAD_MOVES)
def test_a_move_that_cannot_be_is_refused(said, rule):
    """A time or a place that is none raises ValueError that names it."""
    with pytest.raises(ValueError, match=rule):
        Move(**({"object": 0, "begin": 1.0, "to": (1.0, 1.0)} | said))


# ---- real walks


def write_walks(path, ids, label="ped"):
    """A file as of the data set: each of those people goes a metre in a second, and somebody drives."""
    frames = np.arange(31)
    rows = [(k, frame + 100 * k, label, frame / 30.0, float(k)) for k in ids for frame in frames]
    rows += [(99, 0, "veh", 0.0, 0.0)]
    pd.DataFrame(rows, columns=["id", "frame", "label", "x_est", "y_est"]).to_csv(path, index=False)


def test_walks_are_read_from_files(tmp_path):
    """People of both files come in the order of the names, times in s from 0, packed or not, and no vehicle."""
    write_walks(tmp_path / "b.csv", [5])
    write_walks(tmp_path / "a.csv.gz", [1, 2])
    walks = read_walks(tmp_path)
    assert [walk[0, 2] for walk in walks] == [1.0, 2.0, 5.0]
    for walk in walks:
        assert walk.shape == (31, 3) and walk[0, :2].tolist() == [0.0, 0.0]
        assert walk[-1, :2] == pytest.approx([30 / 29.97, 1.0])


HEAD = b"id,frame,label,x_est,y_est\n"
DAMAGE = {
    "empty.csv": b"",
    "other.csv": b"a,b\n1,2\n",
    "cut.csv.gz": b"\x1f\x8b\x08\x00",
    "noise.csv.gz": b"id,frame",
    "text_as_a_frame.csv": HEAD + b"1,first,ped,0.0,0.0\n1,second,ped,0.0,0.1\n",
    "text_as_a_place.csv": HEAD + b"1,0,ped,here,0.0\n1,1,ped,0.0,0.1\n",
}


@pytest.mark.parametrize("name", DAMAGE)
def test_what_is_no_table_of_walks_is_named(tmp_path, name):
    """An empty, foreign or damaged file, and text in place of a number, raise FormatError that names it."""
    (tmp_path / name).write_bytes(DAMAGE[name])
    with pytest.raises(FormatError, match=name):
        read_walks(tmp_path)


def test_a_folder_without_walks_is_named(tmp_path):
    """A folder that holds no such file, or is none, raises FormatError that names it."""
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(FormatError, match=f"{folder.name}: .*must hold .csv"):
            read_walks(folder)


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="DOLLOP_EXTERNAL_DATA names no folder")
def test_real_walks_are_read_and_replayed():
    """110 people walked 13 m at 1.4 m/s (medians); one of them, replayed, is where that one was."""
    walks = read_walks(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "walks")
    lengths = np.array([arc_length(walk[:, 1:])[-1] for walk in walks])
    assert len(walks) == 110 and np.median(lengths) == pytest.approx(13.0, abs=0.5)
    assert np.median(lengths / [walk[-1, 0] for walk in walks]) == pytest.approx(1.4, abs=0.05)
    person = replay(walks[7], (2.0, 4.0), 0.0, begin=0.0)
    replayed = walk_of(person, HALL)
    assert np.abs([replayed.at(time)[0] for time in person.times] - np.array(person.places)).max() < 0.02
