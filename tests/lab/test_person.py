"""The walks round cans and along cones: geometry, human speed, gait, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dollop.lab import Object, Scene, figure_eight, figure_eight_scene, moved, slalom, slalom_scene, walk
from dollop.lab.person import CLEARANCE, SHOULDERS, STRIDE_RATE, body_offsets, walk_along
from dollop.trajectory import arc_length

SEEDS = range(12)
FROM_BACKGROUND = 0.3


def turns(walk, centre):
    """Signed number of times that a walk goes round a point."""
    away = walk.positions - centre
    return np.diff(np.unwrap(np.arctan2(away[:, 1], away[:, 0]))).sum() / (2 * np.pi)


def shoulder_room(walk, scene):
    """Least distance between shoulder and foreground object."""
    gaps = np.linalg.norm(walk.positions[:, None] - scene.positions, axis=2) - scene.foot_radii
    return gaps.min() - SHOULDERS / 2


@pytest.mark.parametrize("seed", SEEDS)
def test_a_figure_eight_keeps_clear_of_objects_and_background(seed):
    """The shoulder never comes nearer than 0.10 m to a can and, where that is asked for, 0.30 m to the background."""
    scene = figure_eight_scene()
    walk = figure_eight(scene, seed, laps=2, from_background=FROM_BACKGROUND)
    assert shoulder_room(walk, scene) > CLEARANCE - 1e-9
    assert scene.room.distance(walk.positions).min() - SHOULDERS / 2 >= FROM_BACKGROUND


@pytest.mark.parametrize(("first_turn", "sense"), [("left", 1), ("right", -1)])
def test_a_figure_eight_goes_round_both_cans_in_the_sense_asked_for(first_turn, sense):
    """Two laps wind twice round each can, in opposite senses."""
    scene = figure_eight_scene()
    walk = figure_eight(scene, 3, laps=2, first_turn=first_turn)
    first, second = (turns(walk, centre) for centre in scene.positions)
    assert second == pytest.approx(2 * sense, abs=0.3)
    assert first == pytest.approx(-2 * sense, abs=0.3)


def test_figure_eights_are_about_17_metres_long_and_never_the_same():
    """A lap is near 17.5 m long, and points of two laps differ by centimetres, not metres."""
    walk = figure_eight(figure_eight_scene(), 0, laps=5)
    arc = arc_length(walk.positions)
    assert arc[-1] / 5 == pytest.approx(17.5, abs=0.7)
    moving = walk.positions[(arc > 1) & (arc < arc[-1] - 1)]
    first, third = moving[: len(moving) // 5], moving[2 * len(moving) // 5 : 3 * len(moving) // 5]
    nearest = np.linalg.norm(first[::10, None] - third, axis=2).min(axis=1)
    assert 0.02 < nearest.mean() < 0.2


@pytest.mark.parametrize("seed", SEEDS)
def test_speed_is_human(seed):
    """A walk starts and ends at rest, and goes at about a metre per second on the way."""
    walk = figure_eight(figure_eight_scene(), seed, laps=2)
    speeds = walk.speeds
    assert speeds[0] < 0.02 and speeds[-1] < 0.02
    on_the_way = speeds[(walk.t > 4) & (walk.t < walk.t[-1] - 4)]
    assert on_the_way.min() > 0.6 and on_the_way.max() < 1.4
    acceleration = np.abs(np.gradient(speeds, walk.t))
    assert acceleration.max() < 1.5


def test_curves_are_walked_slower():
    """Over many walks the speed in the lobes is at least 5 % below the one at the crossing."""
    middle, lobes = [], []
    for seed in SEEDS:
        walk = figure_eight(figure_eight_scene(), seed, laps=2)
        moving = (walk.t > 4) & (walk.t < walk.t[-1] - 4)
        aside = np.abs(walk.positions[:, 0] - 4.5)
        middle.append(walk.speeds[moving & (aside < 0.8)].mean())
        lobes.append(walk.speeds[moving & (aside > 2.5)].mean())
    assert np.mean(lobes) < 0.95 * np.mean(middle)


def test_the_same_seed_walks_the_same_walk():
    """A walk is determined by its seed, and another seed walks differently."""
    scene = figure_eight_scene()
    one, same, other = (figure_eight(scene, seed, laps=1) for seed in (5, 5, 6))
    assert np.array_equal(one.positions, same.positions)
    assert np.array_equal(one.headings, same.headings)
    assert not np.allclose(one.positions[:200], other.positions[:200])


@settings(max_examples=15)
@given(seed=st.integers(0, 2**16), sides=st.lists(st.sampled_from([-1, 1]), min_size=4, max_size=4))
def test_a_slalom_passes_every_cone_on_its_side(seed, sides):
    """Where the walker is abreast of a cone it is on the side asked for, and clear of it."""
    scene = slalom_scene(4)
    walk = slalom(scene, seed, sides)
    assert shoulder_room(walk, scene) > CLEARANCE - 1e-9
    for (x, y), side in zip(scene.positions, sides, strict=True):
        abreast = np.argmin(np.abs(walk.positions[:, 0] - x))
        assert np.sign(walk.positions[abreast, 1] - y) == side


def test_walks_round_moved_objects_keep_clear():
    """A figure-eight follows its cans wherever there is room for it."""
    scene = moved(figure_eight_scene(), [(0.3, 0.4), (-0.2, -0.4)])
    walk = figure_eight(scene, 1, laps=1)
    assert shoulder_room(walk, scene) > CLEARANCE - 1e-9
    assert turns(walk, scene.positions[1]) == pytest.approx(1, abs=0.3)


def test_impossible_walks_are_refused():
    """Too few objects, an unknown sense or side, and a path into the furniture or a carton raise ValueError."""
    scene = figure_eight_scene()
    with pytest.raises(ValueError, match="needs two objects or more, the scene has 1"):
        slalom(slalom_scene(1), 0)
    with pytest.raises(ValueError, match="needs two objects, the scene has 1"):
        figure_eight(slalom_scene(1), 0)
    with pytest.raises(ValueError, match="first_turn must be .*, got 'up'"):
        figure_eight(scene, 0, first_turn="up")
    with pytest.raises(ValueError, match=r"sides must be .*, got \[1.0, 0.0, 1.0, 1.0\]"):
        slalom(slalom_scene(4), 0, [1, 0, 1, 1])
    with pytest.raises(ValueError, match=r"must keep 0\.0 m .*, got -0\.\d\d m at"):
        walk([(4.5, 3.0), (5.9, 6.5)], scene, 0)
    carton = Scene([Object("box", (4.5, 3.0), (0.8, 0.5), 0.6)])
    with pytest.raises(ValueError, match=r"must not lead through an object, got object 0 at \[4\.\d+, [23]\.\d+\]"):
        walk([(2.0, 3.0), (7.0, 3.0)], carton, 0)


BAD_WALKS = [
    ({"speed": -1}, "speed must be in 0.1 to 3, got -1"),
    ({"speed": "1"}, "speed must be a finite number, got '1'"),
    ({"speed": 10**400}, r"speed must be a finite number within 1e\+09, got .* 401 digits"),
    ({"stops": [(99, 1.0)]}, "at one of 2 places for 0 s or more, got 99 and 1.0"),
    ({"stops": [(-1, 1.0)]}, "at one of 2 places for 0 s or more, got -1 and 1.0"),
    ({"stops": [(1, -1.0)]}, "at one of 2 places for 0 s or more, got 1 and -1.0"),
    ({"stand": -1.0}, "at one of 2 places for 0 s or more, got 0 and -1.0"),
    ({"stand": (0.0, np.inf)}, "at one of 2 places for 0 s or more, got 0 and inf"),
    ({"body": "robot"}, "body must be one of 'torso', 'legs', got 'robot'"),
    ({"from_background": -0.1}, "from_background must be in 0 to 1e.09, got -0.1"),
    ({"points": [(3.0, 3.0)]}, r"two via-points or more, none twice in a row, got \[\[3.0, 3.0\]\]"),
    ({"points": [(3, 3), (3, 3), (6, 3)]}, "two via-points or more, none twice in a row, got"),
    ({"points": [(3.0, np.nan), (6.0, 3.0)]}, "via-points of a walk must be finite"),
]


@pytest.mark.parametrize(("said", "rule"), BAD_WALKS)
def test_a_walk_that_cannot_be_is_refused(said, rule):
    """A number out of its range, a stop nowhere, an unknown body, and too few via-points raise ValueError."""
    with pytest.raises(ValueError, match=rule):
        walk(**({"points": [(3.0, 3.0), (6.0, 3.0)], "scene": Scene(), "seed": 0} | said))


def test_a_walk_keeps_as_far_from_the_background_as_it_is_told():
    """A way 0.4 m before a wall leaves a shoulder some room: enough if none is asked for, too little for 0.3 m."""
    scene, points = Scene(), [(3.0, 0.4), (6.0, 0.4)]
    assert 0.0 < scene.room.distance(walk(points, scene, 0).positions).min() - SHOULDERS / 2 < FROM_BACKGROUND
    with pytest.raises(ValueError, match=r"must keep 0\.3 m between shoulder and background, got 0\.\d\d m"):
        walk(points, scene, 0, from_background=FROM_BACKGROUND)


def test_walk_at_holds_its_ends():
    """Before and after the walk the person stands at its ends."""
    walk = figure_eight(figure_eight_scene(), 0, laps=1)
    assert np.array_equal(walk.at(-1.0)[0], walk.positions[0])
    assert np.array_equal(walk.at(1e3)[0], walk.positions[-1])


def test_legs_alternate():
    """Each leg leads as often as the other and in turn, once in every stride; a foot stands still in mid-stance."""
    t = np.linspace(0.0, 10.0, 501)
    walk = walk_along(t, np.column_stack([t, np.zeros(len(t))]), "legs")
    offsets = np.array([body_offsets(walk.body, phase) for phase in walk.phases])
    left_leads = offsets[:, 0, 0] > offsets[:, 1, 0]
    changes = np.count_nonzero(np.diff(left_leads.astype(int)))
    assert changes == pytest.approx(2 * STRIDE_RATE * 10.0, abs=1)
    assert left_leads.mean() == pytest.approx(0.5, abs=0.05)
    assert (offsets[:, 0, 1] > 0).all() and (offsets[:, 1, 1] < 0).all()
    feet = np.gradient(walk.positions[:, :1] + offsets[..., 0], walk.t, axis=0)[5:-5]
    assert feet.min() == pytest.approx(0.0, abs=0.05) and feet.max() == pytest.approx(2.0, abs=0.05)


def test_legs_stand_while_the_person_stands():
    """The gait does not go on at a place where nobody walks, and the body stays in the middle of its legs."""
    walk = walk_along(np.array([0.0, 5.0]), np.array([[1.0, 1.0], [1.0, 1.0]]), "legs")
    assert np.ptp(walk.phases) == 0.0
    assert np.array_equal(body_offsets("legs", walk.phases[0]), [[0.0, 0.09], [0.0, -0.09]])


def test_a_walk_whose_clock_jumps_is_not_replayed():
    """At fifty steps a second, from 1970 until now, it would be 633 GiB."""
    t = np.array([0.0, 1.0, 1.7e9])
    with pytest.raises(ValueError, match="at most 1000000 periods"):
        walk_along(t, np.zeros((3, 2)))
