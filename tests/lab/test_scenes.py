"""The scenes, the walks and the recordings on disk: what of the laboratory needs no PyBullet."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dollop.formats.files import FormatError
from dollop.lab import (
    Recording,
    Scene,
    figure_eight,
    figure_eight_scene,
    moved,
    rearranged,
    slalom,
    slalom_scene,
    walk,
)
from dollop.lab.person import BACKGROUND_CLEARANCE, CLEARANCE, SHOULDERS, arc_length
from dollop.lab.scenes import BACKGROUND_BOXES, ROOM, background_distance, box_distance
from dollop.laser import LaserLog

SEEDS = range(12)


def turns(walk, centre):
    """Signed number of times that a walk goes round a point."""
    away = walk.positions - centre
    return np.diff(np.unwrap(np.arctan2(away[:, 1], away[:, 0]))).sum() / (2 * np.pi)


def shoulder_room(walk, scene):
    """Least distance between shoulder and foreground object."""
    gaps = np.linalg.norm(walk.positions[:, None] - scene.positions, axis=2) - scene.foot_radii
    return gaps.min() - SHOULDERS / 2


def test_box_distance_is_the_distance_to_the_nearest_sampled_point():
    """The distance to boxes equals the one to the nearest of many points on them."""
    rng = np.random.default_rng(0)
    boxes = np.array([[0.0, 0.0, 1.0, 2.0], [3.0, 1.0, 3.5, 4.0]])
    points = rng.uniform(-1, 5, (50, 2))
    grid = []
    for a, b, c, d in boxes:
        x, y = np.meshgrid(np.linspace(a, c, 200), np.linspace(b, d, 200))
        grid.append(np.column_stack([x.ravel(), y.ravel()]))
    grid = np.concatenate(grid)
    brute = np.linalg.norm(points[:, None] - grid, axis=2).min(axis=1)
    assert np.allclose(box_distance(points, boxes), brute, atol=0.02)


def test_the_room_encloses_all_furniture():
    """No furniture stands through a wall, and the room is nine metres by seven."""
    furniture = BACKGROUND_BOXES[4:]
    assert ROOM == (9.0, 7.0)
    assert np.all(furniture[:, :2] >= 0) and np.all(furniture[:, 2:] <= ROOM)


@pytest.mark.parametrize(
    ("kinds", "positions", "message"),
    [
        (("bucket",), [(4.0, 3.0)], "kind must be one of"),
        (("cone",), [(0.3, 3.0)], "clear of everything"),
        (("cone", "cone"), [(4.0, 3.0), (4.3, 3.0)], "clear of everything"),
        (("cone",), [(20.0, 20.0)], "clear of everything"),
        (("cone",), [(np.nan, 3.0)], "clear of everything"),
        (("cone", "cone"), [(4.0, 3.0)], "one position per kind"),
    ],
)
def test_a_scene_that_cannot_stand_is_refused(kinds, positions, message):
    """Unknown kinds, objects too near to anything, outside or without position raise ValueError."""
    with pytest.raises(ValueError, match=message):
        Scene(kinds, positions)


def test_moved_and_rearranged_scenes_keep_objects_and_room():
    """Objects elsewhere are as many, and have the room asked for."""
    scene = figure_eight_scene()
    shifts = [(0.5, 0.0), (0.0, -0.5)]
    assert np.allclose(moved(scene, shifts).positions - scene.positions, shifts)
    for seed in SEEDS:
        other = rearranged(scene, np.random.default_rng(seed))
        assert other.kinds == scene.kinds
        assert np.all(background_distance(other.positions) - other.foot_radii >= 1.0)
    with pytest.raises(ValueError, match="spacing must leave room"):
        rearranged(scene, np.random.default_rng(0), spacing=5.0, attempts=10)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_figure_eight_keeps_clear_of_objects_and_background(seed):
    """The shoulder never comes nearer than 0.10 m to a can and 0.30 m to the background."""
    scene = figure_eight_scene()
    walk = figure_eight(scene, seed, laps=2)
    assert shoulder_room(walk, scene) > CLEARANCE - 1e-9
    assert background_distance(walk.positions).min() - SHOULDERS / 2 >= BACKGROUND_CLEARANCE


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
    """Too few objects, an unknown sense or side, and a path into the furniture raise ValueError."""
    scene = figure_eight_scene()
    with pytest.raises(ValueError, match="needs two objects"):
        figure_eight(slalom_scene(1), 0)
    with pytest.raises(ValueError, match="first_turn must be"):
        figure_eight(scene, 0, first_turn="up")
    with pytest.raises(ValueError, match="sides must be"):
        slalom(slalom_scene(4), 0, [1, 0, 1, 1])
    with pytest.raises(ValueError, match=r"must keep 0\.3 m"):
        walk([(4.5, 3.0), (4.5, 6.5)], scene, 0)


def test_walk_at_holds_its_ends():
    """Before and after the walk the person stands at its ends."""
    walk = figure_eight(figure_eight_scene(), 0, laps=1)
    assert np.array_equal(walk.at(-1.0)[0], walk.positions[0])
    assert np.array_equal(walk.at(1e3)[0], walk.positions[-1])


def small_recording():
    """Two scans of three beams."""
    ranges = np.array([[1.0, 2.5, np.inf], [1.001, 2.5, 3.0]])
    t, poses = np.array([0.0, 0.1]), np.tile([4.5, 0.617, 1.5], (2, 1))
    log = LaserLog(t, ranges, np.deg2rad([-90.0, 0.0, 90.0]), poses, 8.191)
    way = {"x": [1.0, 1.1], "y": [2.0, 2.0], "heading": [0.0, 0.25]}
    truth = pd.DataFrame({"t": t, **way})
    return Recording(log, truth, figure_eight_scene())


@pytest.mark.parametrize("name", ["eights.log", "eights.log.gz"])
def test_a_recording_reads_back_what_it_wrote(tmp_path, name):
    """Log, truth and scene come back equal."""
    recording = small_recording()
    recording.save(tmp_path / name)
    assert (tmp_path / "eights_truth.csv").exists() and (tmp_path / "eights_scene.json").exists()
    back = Recording.load(tmp_path / name)
    assert np.array_equal(back.log.ranges, recording.log.ranges)
    assert np.allclose(back.log.poses, recording.log.poses, atol=1e-3)
    pd.testing.assert_frame_equal(back.truth, recording.truth)
    assert back.scene.to_dict() == recording.scene.to_dict()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("eights_truth.csv", "t,x,y,heading\n0.0,1.0,2.0,0.0\n"),
        ("eights_truth.csv", "t,x,y,heading\n0.0,1.0,2.0,0.0\n0.1,one,2.0,0.0\n"),
        ("eights_truth.csv", ""),
        ("eights_scene.json", "{"),
        ("eights_scene.json", '{"kinds": ["bucket"], "positions": [[4, 3]], "robot": [4, 1, 0]}'),
    ],
)
def test_damaged_companions_are_named(tmp_path, name, text):
    """A truth of wrong length or content and a broken scene raise FormatError and are named."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError, match=name):
        Recording.load(tmp_path / "eights.log")
