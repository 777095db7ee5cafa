"""Random worlds: a seed gives a room, what stands in it, who walks where, and what else happens.

The distribution, in the order in which it is drawn (U: uniform, N: normal):

- kind: `KINDS[seed % len(KINDS)]`, so that any run of seeds has as many of each.
- room: a rectangle (0.45) of U(4, 15) m by U(4, 12) m, an L of one (0.2), a corridor (0.15) of
  U(8, 15) m by U(2.4, 3.4) m, or two rooms with a door of U(0.9, 1.3) m (0.2); turned by U(0, 2 pi) in
  half of the cases; anywhere within 20 m of the origin.
- furniture: up to one piece in 8 m^2, six at most: cabinets and shelves at a wall, tables, columns; all
  of it cut by the laser.
- laser: an LMS 200 in mm (0.35) or cm (0.15) or over 100 degrees (0.1), a TiM571 (0.3), a UTM-30LX
  (0.1), each with its data sheet's noise and a bias of N(0, 5 mm); 0.3 to 1.1 m over the floor.
- objects: 2 to 5, boxes, cylinders and cones, U(0.2, 1) m wide at the beam and higher than it, anywhere
  free, a quarter of them pushed to a wall. A cone is up to 3 cm wider all round at the floor.
- task: 3 to 5 places; each is beside an object, U(0.35, 1) m from the circle round it, and follows it, or (0.25)
  a place of the room. It is walked once (0.6), there and back (0.2) or in 2 to 4 laps (0.2), at
  U(0.4, 1.8) m/s, in three of ten cases with a stop of U(1, 4) s at one of the places.
- robot: anywhere free, facing the middle of the walk within N(0, 10 degrees); of two objects or more
  more than half are in view (three beams of a scan or more, and half of the object) in demonstrations
  and afterwards; where few are meant to be, half of them or fewer in the first.
- what is hard, by kind. Noise: 30 mm, twice the mixed pixels, 2 % of the readings missing. Second
  person: 2 to 4 places anywhere at U(0.4, 1.8) m/s, once through the room, standing there before
  and afterwards, or to and fro all the time; often faster than the user, whom nothing but the
  first place tells. Legs: the laser 0.2 to 0.5 m over the floor. Moving robot: to two places,
  each U(1, 2) m ahead within N(0, 40 degrees), at U(0.1, 0.4) m/s, its odometry drifting. Object
  moved: one, by N(0, 0.8 m) an axis at 0.4 m/s, in the second or third quarter of the walk;
  nobody is seen to do it. Slow scanner: an LMS 200 at half a degree and 5 Hz, or at a quarter and
  4.5 Hz.
- demonstrations: one or two; for half of the second ones every object has moved by N(0, 0.3 m) an axis.
- afterwards every object moves by N(0, 0.4 m) an axis, and the robot looks for six seconds.

What has no room is drawn anew: an object, a person's way, the robot's place, or all of it.
A world is fair if the middle of the walker is in the laser's field of view and reach, and nothing
stands between, for 92 % of the walk, also where the robot drives as it is meant to. Nothing here knows
what an observer needs beyond that.
"""

from dataclasses import dataclass, replace

import numpy as np

from dollop.lab.outlines import meeting
from dollop.lab.people import find_way, free_places, walk_of, walks_of
from dollop.lab.person import SHOULDERS
from dollop.lab.scanner import UTM30LX, SickLMS200, SickTiM571
from dollop.lab.scenes import Scene
from dollop.lab.things import Move, Object, Person, Robot
from dollop.pose import wrapped
from dollop.replication.worlds.rooms import NoRoom, anew, draw_room, somewhere
from dollop.replication.worlds.view import in_view, objects_in_view
from dollop.trajectory import arc_length, resample

__all__ = ["FAIR", "KINDS", "RandomWorld", "draw", "moved_objects"]

KINDS = (
    "plain", "noise", "second person", "legs", "moving robot", "object moved", "few in view", "no object",
    "one object", "ten objects", "slow scanner",
)  # fmt: skip
"""What is hard about a world; plain is nothing in particular."""
FAIR, MARGIN = 0.92, 0.04
"""Least share of the walk that is in view; and how much more of it where the robot drives, never quite as planned."""
SHORTEST, LONGEST = 3.0, 30.0
"""Bounds in m on the length of a walk."""
STRETCH = 0.7
"""Distance in m between the via-points of a person's way."""
FLARE = 0.03
"""m by which a cone is wider all round at the floor than at the beam, at most."""
PUSHED = 0.4
"""Speed in m/s at which an object is moved, at most."""
CLEAR = 0.15
"""Distance in m between a shoulder and everything that a person's way keeps where it is planned."""


@dataclass(frozen=True, eq=False)
class RandomWorld:
    """A world as drawn.

    Attributes
    ----------
    seed : int
    kind : str
        One of `KINDS`.
    shape : str
        Of the room.
    empty : Scene
        The room without objects and people, the robot where it watches from.
    tour : (K, 2) float array
        Places in m that a drive for the map visits.
    demonstrations : tuple of Scene
        What is recorded; the first person shows the task.
    later : Scene
        The objects as they stand when the task is performed, with the way that the person would walk
        then.
    draws : int
        How many worlds were drawn until one was fair.
    """

    seed: int
    kind: str
    shape: str
    empty: Scene
    tour: np.ndarray
    demonstrations: tuple
    later: Scene
    draws: int


def draw(seed):
    """The world of a seed.

    Parameters
    ----------
    seed : int

    Returns
    -------
    RandomWorld

    Raises
    ------
    RuntimeError
        If none of a thousand worlds was fair.
    """
    kind = KINDS[seed % len(KINDS)]
    for draws in range(1, 1001):
        rng = np.random.default_rng([seed, 10, draws])
        try:
            return RandomWorld(seed, kind, *draw_once(kind, rng), draws)
        except ValueError:  # something has no room
            continue
    raise RuntimeError(f"no fair world of seed {seed} in 1000 draws")


def draw_once(kind, rng):
    """What a world consists of, or NoRoom."""
    beam = float(rng.uniform(*(0.2, 0.5) if kind == "legs" else (0.3, 1.1)))
    shape, room = draw_room(beam, rng)
    robot = Robot((*somewhere(room, rng, 0.3), 0.0), draw_scanner(kind, rng), beam)
    empty = Scene(room=room, robot=robot)
    objects = draw_objects(empty, number_of_objects(kind, rng), rng)
    return shape, *anew(lambda rng: draw_walks(empty, objects, kind, rng), rng, 10)


def draw_walks(empty, objects, kind, rng):
    """What happens among some objects in a room: empty scene, tour, demonstrations, and later."""
    task = draw_task(empty, objects, kind, rng)
    scene = anew(lambda rng: shown(empty, objects, task, rng), rng, 5)
    scene = watched(scene, kind, rng)
    scenes = [with_events(scene, kind, rng)]
    if rng.random() < 0.5:
        again = replace(empty, robot=scene.robot)
        spread = 0.3 * (rng.random() < 0.5)
        again = anew(lambda rng: seen_by(scene.robot, again, objects, spread, task, kind, rng), rng)
        scenes.append(with_events(again, kind, rng))
    if not all(in_view(each, walks_of(each)) >= FAIR for each in scenes):
        raise NoRoom
    standing = replace(scene.robot, way=())
    stood, before = moved_objects(scenes[0]), replace(empty, robot=standing)
    later = anew(lambda rng: seen_by(standing, before, stood, 0.4, task, kind, rng), rng)
    return replace(empty, robot=standing), draw_tour(empty, rng), tuple(scenes), later


def seen_by(robot, scene, objects, spread, task, kind, rng):
    """The task among the objects moved by N(0, spread) an axis, which the robot still sees well enough."""
    there = replace(shown(scene, shifted(scene, objects, spread, rng), task, rng), robot=robot)
    if kind != "few in view" and few_in_view(there):
        raise NoRoom
    return there


def few_in_view(scene):
    """Whether of two objects or more only half or fewer are in view."""
    return len(scene.objects) > 1 and objects_in_view(scene).sum() <= len(scene.objects) / 2


# ---- laser and objects


def draw_scanner(kind, rng):
    """The laser: slow ones only where they are what is hard, and noise likewise."""
    errors = {"bias": float(rng.normal(0, 0.005))}
    if kind == "noise":
        errors |= {"noise": 0.030, "mixed": 0.2, "missed": 0.02}
    choice = rng.choice(5, p=[0.35, 0.15, 0.1, 0.3, 0.1])
    if kind == "slow scanner":
        return SickLMS200(180, 0.5, "cm", **errors) if choice < 3 else SickLMS200(100, 0.25, "cm", **errors)
    settings = (180, 1, "mm"), (180, 1, "cm"), (100, 1, "cm")
    if choice < len(settings):
        return SickLMS200(*settings[choice], **errors)
    return SickTiM571(**errors) if choice == 3 else UTM30LX(**errors)


def number_of_objects(kind, rng):
    """How many objects there are."""
    fixed = {"no object": 0, "one object": 1, "ten objects": 10, "few in view": 6}
    return fixed.get(kind, int(rng.integers(2, 6)))


def draw_objects(empty, count, rng):
    """Objects that stand free, a tuple."""
    objects = ()
    for _ in range(count):
        objects = anew(lambda rng, there=objects: (*there, one_more(empty, there, rng)), rng)
    return objects


def one_more(empty, there, rng):
    """An object that stands free of those that are there."""
    shape = str(rng.choice(["box", "cylinder", "cone"]))
    beam = empty.robot.beam_height
    height = float(rng.uniform(beam + 0.1, max(1.5, beam + 0.3)))
    width, depth = rng.uniform(0.2, 1.0, 2)
    turn = float(rng.uniform(0, np.pi))
    if shape == "cone":  # so wide at the beam, and hardly wider at the floor: no laser at the beam sees that
        flare = min(rng.uniform(0.05, 0.3) * width, FLARE) * 2
        slope = flare / beam
        each = Object(shape, (0, 0), (width + flare,) * 2, height, top=max(0.0, width + flare - slope * height))
    else:
        each = Object(shape, (0, 0), (width, depth if shape == "box" else width), height, turn if shape == "box" else 0)
    place = somewhere(empty.room, rng, 0.0)
    if rng.random() < 0.25:
        place = pushed_to_wall(empty.room, each, place)
    each = each.at(place)
    Scene((*there, each), empty.room, aside(empty.robot, empty.room, (*there, each)))
    return each


def pushed_to_wall(room, each, place):
    """The place moved away from the middle until the object nearly touches something."""
    middle = room.corners.mean(axis=0)
    way = (place - middle) / np.linalg.norm(place - middle)
    best = place
    for step in np.arange(0.0, 8.0, 0.05):
        there = place + step * way
        if room.distance(there)[0] <= each.reach + 0.03:
            break
        best = there
    return best


def aside(robot, room, objects):
    """The robot anywhere where it is not in the way, for a check of everything else."""
    low, high = np.split(room.bounds, 2)
    points = low + np.stack(np.meshgrid(*2 * [np.linspace(0, 1, 40)]), axis=-1).reshape(-1, 2) * (high - low)
    free = room.distance(points)
    for each in objects:
        free = np.minimum(free, np.linalg.norm(points - each.position, axis=1) - each.reach)
    return replace(robot, pose=(*points[free.argmax()], 0.0), way=())


def shifted(scene, objects, spread, rng):
    """The objects elsewhere, each moved by N(0, spread) an axis; what has no room is drawn anew."""
    there = ()
    for each in objects:

        def one_moved(rng, each=each, there=there):
            new = each.at(each.position + rng.normal(0, spread, 2))
            Scene((*there, new), scene.room, scene.robot)
            return (*there, new)

        there = anew(one_moved, rng)
    return there


def moved_objects(scene):
    """A scene's objects as they stand after everything that happens in it."""
    objects = list(scene.objects)
    for move in scene.moves:
        objects[move.object] = objects[move.object].at(move.to)
    return tuple(objects)


# ---- the task and the walk


@dataclass(frozen=True)
class Task:
    """What the person does, wherever the objects stand.

    Attributes
    ----------
    anchors : tuple of (int or None, tuple of 2 floats)
        The places: the object that each follows and the offset from it, or None and a place, in m.
    gait : dict
        More of the Person's fields.
    """

    anchors: tuple
    gait: dict

    def places(self, objects):
        """Where the places are among the objects, (K, 2) in m."""
        return np.array([offset if k is None else np.add(objects[k].position, offset) for k, offset in self.anchors])


def draw_task(empty, objects, kind, rng):
    """A task among the objects, its places where a person has room."""
    scene = Scene(objects, empty.room, aside(empty.robot, empty.room, objects))
    anchors = [anew(lambda rng: draw_anchor(scene, rng), rng) for _ in range(rng.integers(3, 6))]
    gait = {"speed": float(rng.uniform(0.4, 1.8)), "body": "legs" if kind == "legs" else "torso", "scatter": 0.03}
    manner = rng.choice(["once", "back", "laps"], p=[0.6, 0.2, 0.2])
    if manner == "back":
        gait["back"] = True
    if manner == "laps":
        gait["laps"] = int(rng.integers(2, 5))
    if rng.random() < 0.3:
        gait["stop"] = int(rng.integers(len(anchors))), float(rng.uniform(1, 4))
    return Task(tuple(anchors), gait)


def draw_anchor(scene, rng):
    """A place of a task: (object, offset from it in m), or (None, place in m)."""
    if not scene.objects or rng.random() < 0.25:
        k, start, offset = None, np.zeros(2), somewhere(scene.room, rng, 0.0)
    else:
        k = int(rng.integers(len(scene.objects)))
        each, bearing = scene.objects[k], rng.uniform(0, 2 * np.pi)
        start, distance = np.array(each.position), each.reach + rng.uniform(0.35, 1.0)
        offset = distance * np.array([np.cos(bearing), np.sin(bearing)])
    if not free_places(scene, [start + offset], CLEAR)[0]:
        raise NoRoom
    return k, tuple(offset.tolist())


def shown(scene, objects, task, rng):
    """The scene with the objects, and a person who shows the task among them."""
    scene = Scene(objects, scene.room, aside(scene.robot, scene.room, objects))
    places = task.places(objects)
    stop = places[task.gait["stop"][0]] if "stop" in task.gait else None
    gait = {name: value for name, value in task.gait.items() if name != "stop"}
    closed = np.vstack([places, places[:1]]) if "laps" in gait else places
    way = find_way(scene, closed, CLEAR)
    if "laps" in gait:
        gait["laps"] = int(np.clip(LONGEST // arc_length(way)[-1], 1, gait["laps"]))
    way = resample(way, 2 + int(arc_length(way)[-1] / STRETCH))
    way = way[:-1] if "laps" in gait else way
    if stop is not None:
        gait["stops"] = [(int(np.linalg.norm(way - stop, axis=1).argmin()), task.gait["stop"][1])]

    def walking(rng):
        person = Person(tuple(map(tuple, way)), seed=int(rng.integers(2**31)), **gait)
        if not SHORTEST <= arc_length(walk_of(person, scene).positions)[-1] <= LONGEST:
            raise NoRoom
        return replace(scene, people=(person,))

    return anew(walking, rng, attempts=5)


def watched(scene, kind, rng):
    """The scene with the robot somewhere from where the walk is in view, and half of the objects, or not."""
    walks = [walk_of(person, scene) for person in scene.people]
    middle, least = walks[0].positions.mean(axis=0), scene.robot.radius + SHOULDERS / 2

    def standing(rng):
        place = somewhere(scene.room, rng, scene.robot.radius)
        if np.linalg.norm(walks[0].positions - place, axis=1).min() < least:
            raise NoRoom
        facing = np.arctan2(*(middle - place)[::-1]) + rng.normal(0, np.radians(10))
        there = replace(scene, robot=replace(scene.robot, pose=(*place, float(wrapped(facing)))))
        if few_in_view(there) != (kind == "few in view") or in_view(there, walks) < FAIR:
            raise NoRoom
        return there

    there = anew(standing, rng)
    return anew(lambda rng: driving(there, rng), rng) if kind == "moving robot" else there


def driving(scene, rng):
    """The scene with its robot driving to two places ahead, a metre or more from each other."""
    x, y, theta = scene.robot.pose
    goals = [np.array([x, y])]
    for _ in range(2):
        bearing, distance = theta + rng.normal(0, np.radians(40)), rng.uniform(1.0, 2.0)
        goals.append(goals[-1] + distance * np.array([np.cos(bearing), np.sin(bearing)]))
    way = find_way(replace(scene, people=()), np.array(goals), CLEAR)
    walked = walk_of(scene.people[0], scene).positions
    if min(np.linalg.norm(walked - each, axis=1).min() for each in resample(way, 30)) < 0.5:
        raise NoRoom
    robot = replace(scene.robot, way=tuple(map(tuple, way[1:])), speed=float(rng.uniform(0.1, 0.4)))
    there = replace(scene, robot=robot)
    if in_view(there, walks_of(there)) < FAIR + MARGIN:
        raise NoRoom
    return there


def with_events(scene, kind, rng):
    """The scene with the robot where it watches from, and what else happens in worlds of this kind."""
    if kind == "second person":
        return anew(lambda rng: with_second(scene, rng), rng)
    if kind == "object moved":
        return anew(lambda rng: with_move(scene, rng), rng)
    walks_of(scene)
    return scene


def with_second(scene, rng):
    """The scene with somebody else who crosses it, or walks about in it all the time."""
    first = walks_of(scene)[0]
    places = [somewhere(scene.room, rng, 0.35) for _ in range(rng.integers(2, 5))]
    alone = replace(scene, people=())
    way = find_way(alone, places)
    duration, speed = first.t[-1], float(rng.uniform(0.4, 1.8))
    about = bool(rng.random() < 0.5)
    rounds = 1 + int(duration * speed / max(1.0, 2 * arc_length(way)[-1])) if about else 1
    begin = float(rng.uniform(0.5, 0.5 + 0.5 * duration * (not about)))
    manner = {"begin": begin, "back": about, "laps": rounds, "seed": int(rng.integers(2**31))}
    second = Person(tuple(map(tuple, way)), speed, **manner)
    both = replace(scene, people=(*scene.people, second))
    walks_of(both)
    return both


def with_move(scene, rng):
    """The scene with one of its objects moved meanwhile, out of the way of who walks."""
    walk = walks_of(scene)[0]
    k = int(rng.integers(len(scene.objects)))
    to = np.add(scene.objects[k].position, rng.normal(0, 0.8, 2))
    if np.linalg.norm(walk.positions - to, axis=1).min() < scene.objects[k].reach + 0.35:
        raise ValueError
    for place in np.linspace(scene.objects[k].position, to, 12):  # nothing is in its way
        replace(scene, objects=tuple(each.at(place) if i == k else each for i, each in enumerate(scene.objects)))
    when = float(rng.uniform(0.25, 0.75) * walk.t[-1])
    seconds = float(np.linalg.norm(np.subtract(to, scene.objects[k].position)) / PUSHED)
    there = replace(scene, moves=(Move(k, when, tuple(to), seconds),))
    walks_of(there)
    return there


def draw_tour(empty, rng):
    """Places from which, taken together, a laser sees the floor of a room, up to all that stands on it."""
    low, high = np.split(empty.room.bounds, 2)
    points = rng.uniform(low, high, (600, 2))
    free = empty.room.distance(points)
    points, places = points[free > 0.03], points[free > 0.45]
    if not len(places):
        raise NoRoom
    unseen, tour = np.ones(len(points), bool), [places[0]]
    while len(tour) < 3 or (unseen.any() and len(tour) < 16):
        away = points - tour[-1]
        distances = np.linalg.norm(away, axis=1)
        blocked = meeting(tour[-1], np.arctan2(away[:, 1], away[:, 0]), empty.section).min(axis=1) < distances
        unseen &= blocked | (distances > 5.0)
        aim = points[unseen][rng.integers(unseen.sum())] if unseen.any() else points[distances.argmax()]
        tour.append(best_view(empty, places, aim))
    return find_way(empty, np.array(tour), clear=0.1)


def best_view(empty, places, aim):
    """The nearest of some places from which a point of the floor can be seen, or else the nearest."""
    away = aim - places
    distances = np.linalg.norm(away, axis=1)
    for k in distances.argsort()[:30]:
        bearing = np.arctan2(*away[k, ::-1])
        if meeting(places[k], [bearing], empty.section).min() >= distances[k]:
            return places[k]
    return places[distances.argmin()]
