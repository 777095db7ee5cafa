"""Scenes: what stands where, what is refused, and that a scene is data that comes back as it was."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from random_scenes import SCANNERS, random_scene

from dollop.formats.files import FormatError
from dollop.lab.outlines import outline_distances
from dollop.lab.rooms import LABORATORY, Part, Room
from dollop.lab.scanner import Scanner, SickLMS200
from dollop.lab.scenes import Scene, empty_scene, figure_eight_scene, moved, object_gaps, rearranged, slalom_scene
from dollop.lab.things import BEAM_HEIGHT, Move, Object, Person, Robot

SEEDS = range(12)
HALL = Scene(room=Room([(0, 0), (8, 0), (8, 6), (0, 6)], [Part("box", (7.5, 5.5, 0.5), (0.8, 0.8, 1.0))]))
CAN, OTHER_CAN = Object.trash_can((2.0, 3.0)), Object.trash_can((4.0, 3.0))
CANS = replace(HALL, objects=[CAN, OTHER_CAN])


# ---- what stands where


def test_the_laser_meets_cans_and_cones_as_round_as_they_are_there():
    """A can is 36 cm wide up to 66 cm, a cone narrows from 38 cm at the floor to 4 cm at 1 m; higher there is none."""
    can, cone = Object.trash_can((1.0, 2.0)), Object.cone((1.0, 2.0))
    assert [can.outline(height).radius for height in (0.1, 0.36, 0.65)] == pytest.approx([0.18] * 3)
    assert [cone.outline(height).radius for height in (1e-9, 0.5, 1 - 1e-9)] == pytest.approx([0.1912, 0.1062, 0.0212])
    assert can.outline(0.66) is None and cone.outline(1.0) is None
    assert (cone.reach, cone.footprint.radius, can.reach) == (0.28, 0.28, 0.18)


def test_a_box_reaches_to_its_corners():
    """Turned, its outline is the same at any height, and its reach half its diagonal."""
    box = Object("box", (1.0, 2.0), (0.6, 0.8), 0.5, turn=0.7)
    assert box.reach == pytest.approx(0.5)
    assert box.outline(0.1) == box.outline(0.49) == box.footprint == (1.0, 2.0, 0.3, 0.4, 0.7, 0.0)


def test_boxes_are_of_what_the_laser_meets():
    """The true bounding boxes are of the objects as high as the beam, in their order; a lower one has none."""
    low = Object("box", (2.0, 1.0), (0.4, 0.4), BEAM_HEIGHT - 0.01)
    scene = replace(HALL, objects=[Object("box", (6.0, 3.0), (0.6, 0.8), 0.5, np.pi / 2), low, Object.cone((2.0, 3.0))])
    expected = [(5.6, 2.7, 6.4, 3.3), (1.87, 2.87, 2.13, 3.13)]
    assert scene.boxes == pytest.approx(np.array(expected)) and scene.foot_radii == pytest.approx(
        [0.5, 0.2828, 0.28], abs=1e-4
    )
    assert empty_scene().boxes.shape == (0, 4)


def test_objects_may_stand_against_walls_furniture_and_each_other():
    """A millimetre of room is enough, for a turned box too."""
    cans = [Object.trash_can(place) for place in [(0.181, 3.0), (0.542, 3.0), (6.919, 5.5)]]
    carton = Object("box", (4.0, 5.999 - np.sqrt(0.5)), (1.0, 1.0), 0.5, turn=np.pi / 4)
    scene = replace(HALL, objects=[*cans, carton])
    assert object_gaps(scene)[:3] == pytest.approx([0.001] * 3, abs=1e-6)


def test_moved_and_rearranged_scenes_keep_objects_and_room():
    """Objects elsewhere are as many, and have the room asked for."""
    scene = figure_eight_scene()
    shifts = [(0.5, 0.0), (0.0, -0.5)]
    assert np.allclose(moved(scene, shifts).positions - scene.positions, shifts)
    for seed in SEEDS:
        other = rearranged(scene, np.random.default_rng(seed))
        assert [replace(each, position=(0, 0)) for each in other.objects] == [Object.trash_can((0, 0))] * 2
        assert np.all(LABORATORY.distance(other.positions) - other.foot_radii >= 1.0)
        assert np.all(object_gaps(other) >= 1.0)
        assert np.all(np.linalg.norm(other.positions - scene.robot.pose[:2], axis=1) - other.foot_radii >= 1.0)
    with pytest.raises(ValueError, match="spacing must leave room for 2 objects, found none for 5.0 m"):
        rearranged(scene, np.random.default_rng(0), spacing=5.0, attempts=10)


def test_a_slalom_stands_in_a_row():
    """Cones stand as far apart as told, in the middle of the room; a row too long for it is refused."""
    x, y = slalom_scene(3, spacing=1.2).positions.T
    assert np.diff(x) == pytest.approx(1.2) and x.mean() == pytest.approx(4.5) and np.ptp(y) == 0.0
    with pytest.raises(ValueError, match=r"object 0 must stand in the room and free, got \(-0.75, 3.6\)"):
        slalom_scene(8)


def test_the_laser_is_ahead_of_the_axle():
    """Its pose is the robot's, moved ahead in the direction that it faces."""
    robot = Robot((1.0, 2.0, np.pi / 2), laser_ahead=0.1)
    assert robot.laser_pose == pytest.approx([1.0, 2.1, np.pi / 2])


# ---- what cannot be

BAD_OBJECTS = [
    ({"shape": "bucket"}, "shape must be one of 'box', 'cylinder', 'cone', got 'bucket'"),
    ({"position": (np.nan, 3.0)}, "position must be finite, got nan"),
    ({"position": (1.0, 2.0, 3.0)}, r"position must have shape \(2,\), got \(3,\)"),
    ({"size": (0.0, 1.0)}, "size must be positive and finite, got 0.0"),
    ({"height": -1.0}, r"height must be in 0.001 to 1e\+06, got -1.0"),
    ({"height": 21.0}, r"at most 20 m large, got \(1.0, 1.0\) and 21.0"),
    ({"height": "1.0"}, "height must be a finite number, got '1.0'"),
    ({"foot": True}, "foot must be a finite number, got True"),
    ({"turn": 10**400}, r"turn must be a finite number within 1e\+09, got .* 401 digits"),
    ({"position": ("left", 3.0)}, "position must be numbers in rows of one length, got .*'left'"),
    ({"size": (10**400, 1.0)}, "size must be numbers in rows of one length, got"),
    ({"turn": np.nan}, r"turn must be a finite number within 1e\+09, got nan"),
    ({"top": -0.1}, "top must be in 0 to 100, got -0.1"),
    ({"shape": "cone", "size": (0.2, 0.3)}, r"a cone must be as deep as wide, got \(0.2, 0.3\)"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_OBJECTS)
def test_an_object_that_cannot_be_is_refused(parts, rule):
    """An unknown shape, and numbers that are none or out of range, raise ValueError that names them."""
    with pytest.raises(ValueError, match=rule):
        Object(**({"shape": "box", "position": (1.0, 1.0), "size": (1.0, 1.0), "height": 1.0} | parts))


BAD_ROBOTS = [
    ({"pose": (1.0, 1.0)}, r"the robot's pose must have shape \(3,\), got \(2,\)"),
    ({"pose": (1.0, np.nan, 0.0)}, "the robot's pose must be finite, got nan"),
    ({"way": [(1.0, np.inf)]}, "the robot's way must be finite, got .*inf"),
    ({"speed": 0.0}, "the robot's speed must be in 0.01 to 2, got 0.0"),
    ({"speed": "0.3"}, "the robot's speed must be a finite number, got '0.3'"),
    ({"radius": True}, "the robot's radius must be a finite number, got True"),
    ({"beam_height": 10**400}, r"the beam height must be a finite number within 1e\+09, got .* 401 digits"),
    ({"laser_ahead": 0.26}, "laser_ahead must be in -0.25 to 0.25, got 0.26"),
    ({"laser_ahead": -0.2, "radius": 0.1}, "laser_ahead must be in -0.1 to 0.1, got -0.2"),
    ({"scanner": "SICK LMS 200"}, "the robot's scanner must be a Scanner, got 'SICK LMS 200'"),
    ({"way": [(1.0, 10**400)]}, "the robot's way must be numbers in rows of one length, got"),
    ({"radius": np.nan}, r"the robot's radius must be a finite number within 1e\+09, got nan"),
    ({"laser_ahead": np.nan}, r"laser_ahead must be a finite number within 1e\+09, got nan"),
    ({"beam_height": 1.4}, "below shoulders, 1.4 m, got 1.4 m"),
    ({"beam_height": 0.0}, "over feet, .*, got 0.0 m"),
    ({"beam_height": np.nan}, r"the beam height must be a finite number within 1e\+09, got nan"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_ROBOTS)
def test_a_robot_that_cannot_be_is_refused(parts, rule):
    """A beam over everything or in the floor, and numbers that are none, raise ValueError that names them."""
    with pytest.raises(ValueError, match=rule):
        Robot(**parts)


LOW = Room([(0, 0), (8, 0), (8, 6), (0, 6)], height=1.0)
DIVIDED = Room(HALL.room.corners, [Part("box", (3.05, 1.5, 1.2), (0.1, 3.0, 2.4))])
ACROSS = Robot((1.0, 1.0, 0.0), way=[(5.0, 1.0)])
MOVED_FIRST = [Move(1, 0.0, (6.0, 3.0)), Move(0, 2.0, (4.0, 3.0))]
BAD_SCENES = [
    ({"objects": [Object.cone((20.0, 20.0))]}, r"object 0 must stand in the room and free, got \(20.0, 20.0\)"),
    ({"objects": [Object.cone((0.2, 3.0))]}, r"object 0 must stand in the room and free, got \(0.2, 3.0\)"),
    ({"objects": [CAN, Object.cone((7.5, 5.5))]}, r"object 1 must stand in the room and free, got \(7.5, 5.5\)"),
    ({"objects": [CAN, Object.cone((2.3, 3.0))]}, r"object 0 at \(2.0, 3.0\) and object 1 at \(2.3, 3.0\)"),
    ({"objects": [Object("box", (4.5, 1.0), (2, 2), 1)]}, r"the robot must not be in an object, got \(4.5, 0.6\)"),
    ({"robot": Robot((4.0, 0.1, 0.0))}, r"the robot must stand in the room and free, got \(4.0, 0.1\)"),
    ({"robot": Robot(way=[(2.0, 3.1)])}, r"the robot's way must not be in an object, got \(2.35, 2.75\) and object 0"),
    ({"robot": Robot(way=[(4.0, 5.0)])}, r"the robot's way must not be in an object, got \(4.26, 2.75\) and object 1"),
    ({"robot": Robot(way=[(9.0, 3.0)])}, r"the robot's way must stand in the room and free, got \(7.76, 2.34\)"),
    (
        {"objects": [], "room": DIVIDED, "robot": ACROSS},
        r"the robot's way must stand in the room .*, got \(2.76, 1.0\)",
    ),
    (
        {"people": [Person([(2.1, 3.1), (6, 5)])]},
        r"person 0 must not begin in an object, got \(2.1, 3.1\) and object 0",
    ),
    ({"room": LOW, "robot": Robot(beam_height=1.1)}, r"below the top of the walls, 1.0 m, got 1.1 m"),
    ({"people": [Person([(1, 1), (9, 1)])]}, r"person 0 must walk in the room, got \(9.0, 1.0\)"),
    ({"people": [Person([(1, 1)]), Person([(7.5, 5.5)])]}, r"person 1 must walk in the room, got \(7.5, 5.5\)"),
    (
        {"people": [Person([(1, 1), (3, 1)]), Person([(1.3, 1), (1, 3)])]},
        "people must begin 0.45 m apart or more, got 0.30 m between person 0 and person 1",
    ),
    ({"moves": [Move(2, 0.0, (6, 3))]}, "a move must be of one of 2 objects, got 2"),
    ({"moves": [Move(-1, 0.0, (6, 3))]}, "a move must be of one of 2 objects, got -1"),
    ({"moves": [Move(0.5, 0.0, (6, 3))]}, "a move must be of one of 2 objects, got 0.5"),
    ({"moves": [Move("1", 0.0, (6, 3))]}, "a move must be of one of 2 objects, got '1'"),
    ({"moves": [Move(0, 0.0, (9, 3))]}, r"object 0, when moved, must stand in the room and free, got \(9.0, 3.0\)"),
    ({"moves": [Move(0, 0.0, (7.5, 5.5))]}, r"object 0, when moved, must stand in the room and free"),
    ({"moves": [Move(0, 0.0, (4.2, 3.0))]}, r"not stand in anything, got \(4.2, 3.0\), in what is at \(4.0, 3.0\)"),
    ({"moves": [Move(0, 0.0, (4.6, 0.7))]}, r"not stand in anything, got \(4.6, 0.7\), in what is at \(4.5, 0.6\)"),
    ({"moves": [*MOVED_FIRST, Move(1, 3.0, (4, 3.2))]}, r"object 1, when moved, .* in what is at \(4.0, 3.0\)"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_SCENES)
def test_a_scene_that_cannot_be_is_refused(parts, rule):
    """What is outside, in something else, over the walls, or none of what is there raises ValueError that says so."""
    with pytest.raises(ValueError, match=rule):
        replace(CANS, **parts)


def test_an_object_may_be_moved_to_where_another_has_left():
    """What counts is what stands there when the move is done, in whatever order the moves are told."""
    assert replace(CANS, moves=MOVED_FIRST).moves == tuple(MOVED_FIRST)
    assert replace(CANS, moves=MOVED_FIRST[::-1]).moves == tuple(MOVED_FIRST[::-1])


# ---- a scene is data


def through_json(content):
    """What is left of plain lists and numbers when they were written down and read again."""
    return json.loads(json.dumps(content))


@pytest.mark.parametrize("block", range(4))
def test_a_scene_comes_back_from_json_as_it_was(block):
    """In random scenes every number is the same, and so are the records that are made of them."""
    for seed in range(block, 60, 4):
        scene = random_scene(np.random.default_rng(seed))
        back = Scene.from_dict(through_json(scene.to_dict()))
        assert back.to_dict() == scene.to_dict()
        for name in ("objects", "robot", "people", "moves"):
            assert getattr(back, name) == getattr(scene, name)
        assert np.array_equal(back.room.corners, scene.room.corners) and back.room.furniture == scene.room.furniture
        assert back.section == scene.section


@pytest.mark.parametrize("seed", range(5))
def test_a_scene_comes_back_from_its_file(tmp_path, seed):
    """Saved and loaded, it is the same; a file of its own is JSON that anybody can read."""
    scene, path = random_scene(np.random.default_rng(seed)), tmp_path / "room.json"
    scene.save(path)
    assert Scene.load(path).to_dict() == scene.to_dict() == json.loads(path.read_text())


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[1, 2]", b"[" * 100_000, b'{"format": "dollop scene"}'])
def test_a_damaged_file_is_named(tmp_path, content):
    """What is no JSON, or no scene, raises FormatError that names the file."""
    (tmp_path / "room.json").write_bytes(content)
    with pytest.raises(FormatError, match="room.json: "):
        Scene.load(tmp_path / "room.json")


def full_scene():
    """A scene with something in every part, as plain lists and numbers."""
    people = [Person([(1.0, 1.0), (3.0, 1.0)], stops=[(1, 2.0)]), Person([(6.0, 5.0), (5.0, 5.0)], times=[0.0, 1.5])]
    robot = Robot(scanner=SickLMS200(100, 0.5, "cm"), way=[(5.0, 1.0)])
    scene = replace(CANS, robot=robot, people=people, moves=[Move(0, 1.0, (3.0, 4.0))])
    return through_json(scene.to_dict())


def numbers(content, path=()):
    """The way to each number in nested lists and dictionaries."""
    parts = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    for key, part in parts:
        if isinstance(part, int | float) and not isinstance(part, bool):
            yield (*path, key)
        yield from numbers(part, (*path, key))


def with_part(content, path, value):
    """The same with another value at the end of a way."""
    content = copy.deepcopy(content)
    inner = content
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return content


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_no_number_is_nan_or_infinite(value):
    """Wherever in a scene one is put in place of a number, ValueError tells of it."""
    content, paths = full_scene(), list(numbers(full_scene()))
    assert len(paths) > 80
    for path in paths:
        with pytest.raises(ValueError, match=str(value)):
            Scene.from_dict(with_part(content, path, value))


@pytest.mark.parametrize("value", ["x", None, [], [1.0], {}, {"a": 1}])
def test_what_is_no_number_is_refused(value):
    """Wherever something else is put in place of a number, ValueError is raised and no other error."""
    content = full_scene()
    for path in numbers(content):
        if path == ("robot", "scanner", "bias") and value == [1.0]:
            continue
        with pytest.raises(ValueError):
            Scene.from_dict(with_part(content, path, value))


TOLD = [  # where, what and how the field is called in the message
    (("room", "height"), "the room: the height of a room"),
    (("room", "furniture", 0, "turn"), r"furniture\[0\]: turn"),
    (("robot", "speed"), "the robot: the robot's speed"),
    (("robot", "scanner", "bias"), "the scanner: bias"),
    (("objects", 1, "height"), r"objects\[1\]: height"),
    (("people", 0, "scatter"), r"people\[0\]: scatter"),
    (("people", 0, "stops", 0, 1), r"people\[0\]: the time of a stop"),
    (("moves", 0, "seconds"), r"moves\[0\]: seconds"),
]


@pytest.mark.parametrize("value", ["1", True, 10**400], ids=["text", "true", "too large"])
@pytest.mark.parametrize(("path", "name"), TOLD, ids=[name for _, name in TOLD])
def test_text_true_and_what_no_float_holds_are_no_numbers_on_file(tmp_path, path, name, value):
    """In a scene's file they raise FormatError that names the file, the field and the value."""
    file = tmp_path / "room.json"
    file.write_text(json.dumps(with_part(full_scene(), path, value)))
    rule = f"{name} must be a finite number" if value != 10**400 else "not a scene: a number must be finite"
    with pytest.raises(FormatError, match=f"room.json: {rule}.*, got {repr(value)[:20]}"):
        Scene.load(file)


@pytest.mark.parametrize("value", ["1", True], ids=["text", "true"])
def test_text_and_true_are_no_numbers_wherever_they_are(value):
    """In coordinates, sizes, colours, times and places of stops as well, ValueError is raised."""
    taken = []
    for path in numbers(full_scene()):
        try:
            Scene.from_dict(with_part(full_scene(), path, value))
        except ValueError:
            continue
        taken.append(path)
    assert not taken


def test_no_number_is_larger_than_a_float():
    """Wherever in a scene 10**400 is put in place of a number, ValueError tells of it."""
    content = full_scene()
    for path in numbers(content):
        with pytest.raises(ValueError, match="must "):
            Scene.from_dict(with_part(content, path, 10**400))


PLAIN_PERSON = full_scene()["people"][0]
DAMAGED = [
    ({"format": "other scene"}, "not a scene: format must be 'dollop scene'"),
    ({"format": None}, "not a scene: format must be 'dollop scene'"),
    ({"version": 2}, "the version of a scene must be 1, got 2"),
    ({"version": None}, "the version of a scene must be 1, got None"),
    ({"version": "1"}, "the version of a scene must be 1, got '1'"),
    ({"room": None}, "^a scene lacks room$"),
    ({"robot": None}, "^a scene lacks robot$"),
    ({"objects": None}, "^a scene lacks objects$"),
    ({"people": None}, "^a scene lacks people$"),
    ({"moves": None}, "^a scene lacks moves$"),
    ({"ghosts": []}, "^a scene cannot have ghosts$"),
    ({"objects": [{"shape": "box"}]}, r"^objects\[0\] lacks foot, height, position, size, top, turn$"),
    ({"objects": ["box"]}, r"^objects\[0\] must have foot, height, position, shape, size, top, turn, got str$"),
    ({"objects": {}}, "^objects must be a list, got dict$"),
    ({"robot": []}, "^the robot must have beam_height, .*, got list$"),
    (
        {"people": [{"places": [[1, 1]], "age": 30}]},
        r"^people\[0\] lacks back, begin, body, laps, scatter, seed, .*, times$",
    ),
    ({"people": [PLAIN_PERSON | {"age": 30}]}, r"^people\[0\] cannot have age$"),
    (
        {"people": [PLAIN_PERSON | {"body": "robot"}]},
        r"^people\[0\]: body must be one of 'torso', 'legs', got 'robot'$",
    ),
    ({"moves": [{"object": 0, "begin": 1.0}]}, r"^moves\[0\] lacks seconds, to$"),
]


@pytest.mark.parametrize(("parts", "rule"), DAMAGED)
def test_what_is_no_scene_is_refused(parts, rule):
    """Another format or version, a part that is missing (None here) or unknown raise ValueError that names it."""
    content = full_scene() | parts
    content = {name: value for name, value in content.items() if value is not None}
    with pytest.raises(ValueError, match=rule):
        Scene.from_dict(content)


@pytest.mark.parametrize("content", [None, [], "scene", 3.0, {}, {"kinds": ["cone"], "positions": [[4, 3]]}])
def test_anything_else_is_no_scene(content):
    """What is no dictionary, or is one of an older time, is not a scene."""
    with pytest.raises(ValueError, match="not a scene"):
        Scene.from_dict(content)


BAD_SCANNERS = [
    ({"fov": 170}, "fov/resolution must be one of .* degrees, got 170/0.5"),
    ({"resolution": 0.125}, "fov/resolution must be one of .* degrees, got 100/0.125"),
    ({"rate": 10.0}, "rate of a SICK LMS 200 must be 9 in this mode, got 10"),
    ({"step": 0.002}, "mode must be one of 'mm', 'cm', got '0.002 m'"),
    ({"max_range": 8.191}, "max_range of a SICK LMS 200 must be 81.91 in this mode, got 8.191"),
    ({"min_range": 0.1}, "min_range of a SICK LMS 200 must be 0.2 in this mode, got 0.1"),
    ({"model": "SICK TiM571"}, "fov of a SICK TiM571 must be 270 in this mode, got 100"),
    ({"missed": 2.0}, "^the scanner: missed must be in 0 to 1, got 2.0$"),
    ({"step": 0.3}, "^the scanner: step must be a whole part of a metre, got 0.3$"),
    ({"colour": "blue"}, "^the scanner cannot have colour$"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_SCANNERS)
def test_a_scanner_on_file_has_one_of_its_own_modes(parts, rule):
    """A model on offer with a field of view, rate or range that it does not have raises ValueError that names it."""
    content = full_scene()
    content["robot"]["scanner"] |= parts
    with pytest.raises(ValueError, match=rule):
        Scene.from_dict(content)


@pytest.mark.parametrize("scanner", [*SCANNERS, Scanner("my own", 90, 0.1, 12.5, 4.0, 0.1, 0.01, 0.02, missed=0.1)])
def test_every_scanner_comes_back(scanner):
    """Those on offer with any errors, and one of somebody's own, are the same after JSON."""
    scene = Scene(robot=Robot(scanner=scanner))
    assert Scene.from_dict(through_json(scene.to_dict())).robot.scanner == scanner


def test_the_section_is_what_a_plane_cuts():
    """Cut higher, a desk's top is in it and a stool is not; a point in the section is in something as high as that."""
    low, high = (Scene(robot=Robot(beam_height=height)).section for height in (0.51, 0.735))
    on_the_desk, on_the_stool = [(1.5, 6.6)], [(1.2, 5.98)]
    assert outline_distances(on_the_desk, low).min() > 0 > outline_distances(on_the_desk, high).min()
    assert outline_distances(on_the_stool, low).min() < 0 < outline_distances(on_the_stool, high).min()


def test_a_way_out_of_the_world_is_refused_at_once():
    """A robot that is to drive a billion metres leaves the room; no point of a way is asked for every 10 cm of it."""
    with pytest.raises(ValueError, match="the robot's way must stand in the room and free"):
        replace(HALL, robot=Robot(way=[(1e9, 1e9)]))
    there_and_back = [(1.0, 1.0), (7.0, 1.0)] * 90
    with pytest.raises(ValueError, match="the robot's way must be at most 1000 m long, got 10"):
        replace(HALL, robot=Robot((4.0, 1.0, 0.0), way=there_and_back))


@pytest.mark.parametrize("name", ["objects", "people", "moves"])
def test_a_scene_has_no_more_than_a_thousand_of_anything(name):
    """Each is set against each of the others."""
    content = full_scene()
    with pytest.raises(ValueError, match=f"{name} must be at most 1000, got 1001"):
        Scene.from_dict(content | {name: content[name][:1] * 1001})


@pytest.mark.parametrize("stops", [3, [3], ["ab"], [[1]], [[1, 2.0, 3]], None])
def test_stops_are_pairs(stops):
    """Of a place and a time, whatever a file has there."""
    with pytest.raises(ValueError, match="stops must be a sequence of pairs, got"):
        Person([(1, 1), (3, 1)], stops=stops)


def test_a_scene_is_read_by_its_letter(tmp_path):
    """A name given twice, NaN, and more values than are read are refused with the file's name."""
    text = json.dumps(full_scene())
    for content, message in (
        (text[:-1] + ', "room": 1}', "a name must be given once, got 'room' again"),
        (text.replace("0.36", "NaN"), "a number must be finite, .*, got NaN"),
        ("[" + "[]," * 2_000_001 + "[]]", ".*4000000 values are the most that is read"),
    ):
        (tmp_path / "room.json").write_text(content)
        with pytest.raises(FormatError, match=f"room.json: not a scene: {message}"):
            Scene.load(tmp_path / "room.json")
