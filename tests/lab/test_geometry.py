"""What the laser sees is what the record says: beams in PyBullet against plane geometry reckoned here."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pybullet", reason="the laboratory needs PyBullet (extra `lab`)")

from random_scenes import random_scene

from dollop.lab.people import walks_of
from dollop.lab.person import DEPTH, LEG_RADIUS, SHOULDERS, Walk
from dollop.lab.rooms import Part, Room
from dollop.lab.scenes import Scene
from dollop.lab.things import Move, Object, Person, Robot
from dollop.lab.world import World

SCENES, BLOCKS = 200, 8
NEAR = 1.0e-3 + 1e-6
"""m: the tolerance of Bullet's rays, and of floats."""
DEEP = 1.5e-3
"""m: how far within an outline a beam may be before it is said to pass through it."""
REACH = 30.0
ROUND = np.linspace(-np.pi, np.pi, 240, endpoint=False)
HALL = Room([(0, 0), (8, 0), (8, 6), (0, 6)])
STANDS = Robot((4.0, 0.5, np.pi / 2))


def directions(pose, angles):
    """Unit vectors (B, 2) of beams from a pose."""
    return np.column_stack([np.cos(angles + pose[2]), np.sin(angles + pose[2])])


def depths(points, outlines):
    """Signed distance of points (..., 1, 2) to rounded boxes (M, 6): (..., M) in m, negative inside."""
    x, y, half_width, half_depth, turn, radius = np.transpose(outlines)
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy = points[..., 0] - x, points[..., 1] - y
    aside = np.abs(cos * dx + sin * dy) - half_width
    ahead = np.abs(cos * dy - sin * dx) - half_depth
    outside = np.hypot(np.maximum(aside, 0.0), np.maximum(ahead, 0.0))
    return outside + np.minimum(np.maximum(aside, ahead), 0.0) - radius


def deepest(start, ends, outlines, steps=32):
    """Least signed distance (B, M) on the ways to ends (B, 2): along a line, that to a convex outline is convex."""
    along = (ends - start)[:, None]
    low, high = np.zeros((2, len(ends), len(outlines)))
    high = high + 1.0
    for _ in range(steps):
        third = (high - low) / 3
        first, second = (depths(start + each[..., None] * along, outlines) for each in (low + third, high - third))
        low, high = np.where(first > second, low + third, low), np.where(first > second, high, high - third)
    return depths(start + low[..., None] * along, outlines)


def bodies(walk, t):
    """Outlines of what a person shows: a stadium across the shoulders, or two legs as far ahead as behind."""
    (x, y), heading, phase = walk.at(t)
    if walk.body == "torso":
        return [(x, y, 0.0, (SHOULDERS - DEPTH) / 2, heading, DEPTH / 2)]
    ahead, left = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    stride = np.sin(phase) / (2 * np.pi * 0.9) * ahead + 0.09 * left
    return [(x + sign * stride[0], y + sign * stride[1], 0.0, 0.0, 0.0, LEG_RADIUS) for sign in (1, -1)]


def object_outline(each, height):
    """Outline of an object in the plane of the laser, none where it is lower."""
    (x, y), (width, depth) = each.position, each.size
    if each.height < height:
        return []
    if each.shape == "box":
        return [(x, y, width / 2, depth / 2, each.turn, 0.0)]
    share = height / each.height if each.shape == "cone" else 0.0
    return [(x, y, 0.0, 0.0, 0.0, (width + share * (each.top - width)) / 2)]


def part_outline(part, height):
    """Outline of furniture or a wall in the plane of the laser, none where that passes over or under it."""
    (x, y, z), (width, depth, tall) = part.centre, part.size
    if not z - tall / 2 < height < z + tall / 2:
        return []
    if part.shape == "cylinder":
        return [(x, y, 0.0, 0.0, 0.0, width / 2)]
    return [(x, y, width / 2, depth / 2, part.turn, 0.0)]


def whereabouts(scene, t):
    """The objects where they are at a time: a move leads straight from where one stood, at an even speed."""
    objects = list(scene.objects)
    for move in sorted(scene.moves, key=lambda move: move.begin):
        share = min(max((t - move.begin) / move.seconds, 0.0), 1.0)
        begin = np.array(objects[move.object].position)
        objects[move.object] = objects[move.object].at(begin + share * (np.array(move.to) - begin))
    return objects


def record_at(scene, walks, t):
    """All that the record says stands in the plane of the laser: outlines (M, 6)."""
    height = scene.robot.beam_height
    found = [outline for part in scene.room.parts for outline in part_outline(part, height)]
    found += [outline for each in whereabouts(scene, t) for outline in object_outline(each, height)]
    return np.array(found + [outline for walk in walks for outline in bodies(walk, t)])


def standing(person, rng):
    """Somebody at the first place of a person, in mid-stride, facing anywhere."""
    heading, phase = rng.uniform(-9.0, 9.0, (2, 1)).repeat(2, axis=1)
    return Walk(np.array([0.0, 1.0]), np.array(person.places[:1] * 2), heading, phase, person.body)


def casts(seed):
    """A random scene at a random time: where its laser is, where beams all round end, and what stands there."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    walks, t = [standing(person, rng) for person in scene.people], rng.uniform(0.0, 8.0)
    pose = scene.robot.laser_pose
    with World(scene, walks) as world:
        world.at(t)
        ranges = world.cast(pose, ROUND, REACH)
    return pose[:2], pose[:2] + ranges[:, None] * directions(pose, ROUND), record_at(scene, walks, t)


@pytest.mark.parametrize("block", range(BLOCKS))
def test_beams_end_where_the_record_says_and_pass_through_nothing(block):
    """In 200 random scenes every beam ends within a millimetre of an outline of the record, and crosses none before."""
    for seed in range(block, SCENES, BLOCKS):
        start, ends, record = casts(seed)
        assert np.isfinite(ends).all(), f"a beam left the room of seed {seed}"
        off = np.abs(depths(ends[:, None], record)).min(axis=1)
        assert off.max() <= NEAR, f"a beam ends {1000 * off.max():.3f} mm off in the scene of seed {seed}"
        passed = deepest(start, ends, record)
        assert passed.min() >= -DEEP, f"a beam passes {-1000 * passed.min():.3f} mm deep in the scene of seed {seed}"


def test_the_section_of_a_scene_is_its_record():
    """The outlines that a scene tells of are those that are reckoned here from its parts, in 20 random scenes."""
    for seed in range(20):
        scene = random_scene(np.random.default_rng(seed))
        assert np.allclose(np.reshape(scene.section, (-1, 6)), record_at(replace(scene, moves=()), [], 0.0))


SHAPES = {"box": {"turn": 0.4}, "cylinder": {}, "cone": {"top": 0.1, "foot": 0.4}}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("beam_height", [0.2, 0.36, 0.9])
def test_beams_pass_over_what_is_lower(shape, beam_height):
    """An object 5 mm lower than the beam changes no range, one 5 mm higher does."""
    robot = replace(STANDS, beam_height=beam_height)
    ranges = []
    for height in (None, beam_height - 0.005, beam_height + 0.005):
        objects = [Object(shape, (4.0, 3.0), (0.3, 0.3), height, **SHAPES[shape])] if height else []
        with World(Scene(objects, HALL, robot)) as world:
            ranges.append(world.cast(robot.laser_pose, ROUND, REACH))
    without, lower, higher = ranges
    assert np.array_equal(lower, without)
    assert (higher <= without + NEAR).all() and (higher < without - 1.0).any()


@pytest.mark.parametrize("shape", ["box", "cylinder"])
def test_beams_pass_under_what_hangs_and_over_what_is_flat(shape):
    """A shelf over the beam and a plate under it change no range; between them a column does."""
    robot, sizes = STANDS, {"shelf": (1.0, 0.3), "plate": (0.1, 0.2), "column": (0.36, 0.6)}
    ranges = []
    for name in (None, *sizes):
        height, tall = sizes.get(name, (0, 0))
        furniture = [Part(shape, (4.0, 3.0, height), (0.5, 0.5, tall))] if name else []
        with World(Scene(room=Room(HALL.corners, furniture), robot=robot)) as world:
            ranges.append(world.cast(robot.laser_pose, ROUND, REACH))
    without, shelf, plate, column = ranges
    assert np.array_equal(shelf, without) and np.array_equal(plate, without)
    assert column[len(ROUND) // 2] == pytest.approx(3.0 - 0.25 - robot.laser_pose[1], abs=NEAR)


def beams_on(ends, outlines):
    """How many beams end at the surface of one of the outlines."""
    return np.count_nonzero(np.abs(depths(ends[:, None], np.array(outlines))).min(axis=1) <= NEAR)


def test_two_walkers_hide_each_other():
    """Where both are in one line the farther one is not seen at all, and each of them is that once."""
    lanes = [(1.5, 2.0), (6.5, 2.0), (6.5, 4.5), (1.5, 4.5)]
    scene = Scene(room=HALL, robot=STANDS, people=[Person(lanes), Person(lanes[2:] + lanes[:2])])
    walks, pose, hidden = walks_of(scene), scene.robot.laser_pose, set()
    with World(scene, walks) as world:
        for t in np.arange(0.0, walks[0].t[-1], 0.01):
            away = [walk.at(t)[0] - pose[:2] for walk in walks]
            near, far = np.argsort(np.linalg.norm(away, axis=1))
            if abs(np.diff(np.arctan2(*np.transpose(away)))[0]) < 0.02:
                world.at(t)
                ends = pose[:2] + world.cast(pose, ROUND, REACH)[:, None] * directions(pose, ROUND)
                assert beams_on(ends, bodies(walks[near], t)) > 0
                assert beams_on(ends, bodies(walks[far], t)) == 0
                hidden.add(far)
    assert hidden == {0, 1}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("t", "place"), [(0.0, (2, 2)), (3.0, (2, 2)), (4.5, (5, 3.5)), (5.0, (6, 4)), (9.0, (6, 4))])
def test_a_moved_object_is_seen_where_it_is(shape, t, place):
    """Before, during and after a move of two seconds, beams end on the object where it is then, and none elsewhere."""
    thing = Object(shape, (2.0, 2.0), (0.5, 0.5), 0.9, **SHAPES[shape])
    scene, pose = Scene([thing], HALL, STANDS, moves=[Move(0, 3.0, (6.0, 4.0), 2.0)]), STANDS.laser_pose
    with World(scene) as world:
        world.at(t)
        ends = pose[:2] + world.cast(pose, ROUND, REACH)[:, None] * directions(pose, ROUND)
    indoors = np.count_nonzero(depths(ends[:, None], [(4.0, 3.0, 4.0, 3.0, 0.0, 0.0)]) < -0.1)
    assert beams_on(ends, object_outline(thing.at(place), STANDS.beam_height)) == indoors > 2
