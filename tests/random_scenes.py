"""Scenes at random: rooms of any shape, furniture of all heights, turned objects, people, moves."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from dollop.lab.rooms import Part, Room
from dollop.lab.scanner import UTM30LX, SickLMS200, SickTiM571
from dollop.lab.scenes import Scene
from dollop.lab.things import Move, Object, Person, Robot

SCANNERS = [SickLMS200(), SickLMS200(100, 0.25, "cm", bias=-0.01), SickTiM571(missed=0.02), UTM30LX(0.03)]


def centimetres(rng, low, high):
    """A length in whole centimetres, in m: a beam at a half one is well over or under what is so high."""
    return int(rng.integers(round(100 * low), round(100 * high) + 1)) / 100


def turned(points, angle):
    """Points (N, 2) turned round the origin."""
    return points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def random_corners(rng):
    """Corners of a rectangle, of an L, or of an oblique polygon, turned and anywhere."""
    width, depth = rng.uniform(4.0, 10.0, 2)
    x, y = rng.uniform(1.5, 2.5, 2)
    kind = rng.integers(3)
    if kind == 0:
        corners = np.array([(0, 0), (width, 0), (width, depth), (0, depth)])
    elif kind == 1:
        corners = np.array([(0, 0), (width, 0), (width, y), (x, y), (x, depth), (0, depth)])
    else:
        count = rng.integers(3, 10)
        bearings = 2 * np.pi * (np.arange(count) + rng.uniform(0.0, 0.6, count)) / count
        corners = rng.uniform(2.5, 6.0, (count, 1)) * np.column_stack([np.cos(bearings), np.sin(bearings)])
    return turned(corners, rng.choice([0.0, rng.uniform(-np.pi, np.pi)])) + rng.uniform(-9.0, 9.0, 2)


def random_place(rng, room, clear=0.3):
    """A place in a room (2,) in m, so far from its walls and its furniture, or as far as one is found."""
    low, high = np.split(room.bounds, 2)
    while True:
        places = rng.uniform(low, high, (20, 2))
        for place in places[room.distance(places) > clear]:
            return place
        clear *= 0.9


def random_part(rng, room):
    """A piece of furniture that stands in a room or hangs there, high or flat, square or round."""
    height, over = centimetres(rng, 0.04, 1.6), centimetres(rng, 0.0, 0.9) * rng.integers(2)
    centre = *random_place(rng, room, 0.0), over + height / 2
    width, depth = rng.uniform(0.06, 0.8, 2)
    if rng.integers(2):
        return Part("cylinder", centre, (width, width, height))
    return Part("box", centre, (width, depth, height), turn=rng.uniform(-np.pi, np.pi) * rng.integers(2))


def random_object(rng, room):
    """A box, a cylinder or a cone, as large and as high as it may be."""
    shape, (width, depth) = rng.choice(["box", "cylinder", "cone"]), rng.uniform(0.2, 1.0, 2)
    look = {"turn": rng.uniform(-np.pi, np.pi)}
    if shape == "cone":
        look |= {"top": width * rng.uniform(0.0, 0.9), "foot": 1.3 * width * rng.integers(2)}
    size = (width, depth if shape == "box" else width)
    return Object(str(shape), random_place(rng, room, width / 2), size, centimetres(rng, 0.15, 1.5), **look)


def random_times(rng, places):
    """When somebody is at each place, nowhere faster than 4 m/s."""
    apart = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1)
    return np.cumsum(np.maximum(rng.uniform(0.1, 3.0, len(places)), apart / 4.0))


def random_person(rng, scene):
    """Who walks about, not beginning at the robot, and all that can be said of it."""
    places = [random_place(rng, scene.room) for _ in range(rng.integers(1, 5))]
    while np.linalg.norm(places[0] - scene.robot.pose[:2]) < 0.6:
        places[0] = random_place(rng, scene.room)
    return Person(
        places,
        speed=rng.uniform(0.4, 1.8),
        body=str(rng.choice(["torso", "legs"])),
        begin=rng.uniform(0.0, 5.0),
        stops=[(int(rng.integers(len(places))), rng.uniform(0.5, 4.0)) for _ in range(rng.integers(3))],
        laps=int(rng.integers(1, 4)),
        back=bool(rng.integers(2)),
        scatter=rng.uniform(0.0, 0.1),
        times=random_times(rng, places) if rng.integers(3) == 0 else (),
        seed=int(rng.integers(1000)),
    )


def random_move(rng, scene):
    """One of the objects moves to somewhere else."""
    k = int(rng.integers(len(scene.objects)))
    place = random_place(rng, scene.room, scene.objects[k].reach)
    return Move(k, rng.uniform(0.0, 5.0), place, rng.uniform(0.5, 3.0))


def with_as_many(scene, name, things):
    """The scene with all those things more that find room beside what is there."""
    for thing in things:
        with suppress(ValueError):  # something stands there
            scene = replace(scene, **{name: (*getattr(scene, name), thing)})
    return scene


def random_empty_scene(rng):
    """A robot in a room with up to 20 pieces of furniture."""
    while True:
        empty = Room(random_corners(rng))
        furniture = [random_part(rng, empty) for _ in range(rng.choice([0, 4, 8, 20]))]
        room, beam_height = Room(empty.corners, furniture), centimetres(rng, 0.15, 1.2) + 0.005
        pose, scanner = (*random_place(rng, room, 0.26), rng.uniform(-np.pi, np.pi)), SCANNERS[rng.integers(4)]
        with suppress(ValueError):  # the robot has no room
            return Scene((), room, Robot(pose, scanner, beam_height, laser_ahead=rng.uniform(-0.1, 0.1)))


def random_scene(rng):
    """A scene that can be, with up to 8 objects, 4 people and 2 moves."""
    scene = random_empty_scene(rng)
    scene = with_as_many(scene, "objects", [random_object(rng, scene.room) for _ in range(rng.integers(9))])
    scene = with_as_many(scene, "people", [random_person(rng, scene) for _ in range(rng.integers(5))])
    return with_as_many(scene, "moves", [random_move(rng, scene) for _ in range(rng.integers(3)) if scene.objects])
