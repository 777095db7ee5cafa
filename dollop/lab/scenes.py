"""Scenes: a room, the movable objects in it, the robot that watches, and who walks where.

A scene is data: it can be written, read and drawn (`dollop.plot.scene`), and what is recorded of it
follows from it and a seed. Nothing here needs PyBullet.
"""

import json
from dataclasses import dataclass, field, fields, replace
from functools import partial

import numpy as np

from dollop.checks import checked_array, put_in, told
from dollop.formats.files import check_fields, from_file, read_json
from dollop.formats.kinds import SCENE
from dollop.formats.writing import whole_file
from dollop.lab.outlines import Outline, gaps
from dollop.lab.person import SHOULDERS
from dollop.lab.rooms import LABORATORY, Part, Room
from dollop.lab.scanner import Scanner
from dollop.lab.things import Move, Object, Person, Robot

__all__ = [
    "Scene",
    "empty_scene",
    "figure_eight_scene",
    "moved",
    "object_gaps",
    "rearranged",
    "slalom_scene",
]

FORMAT, VERSION = "dollop scene", 1
MOST = 1000
"""Objects, people, moves and parts of furniture in a file: each is set against each other."""
LONGEST_WAY = 1000.0
"""m that a robot drives at most: an hour at its usual speed."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A room and all that is in it; the paper's laboratory by default (Fig. 5).

    Attributes
    ----------
    objects : tuple of N Object
        The movable foreground objects.
    room : Room
        The background.
    robot : Robot
        Who watches.
    people : tuple of Person
        Who walks where; the first one shows the task.
    moves : tuple of Move
        Objects that are moved meanwhile.

    Raises
    ------
    ValueError
        If an object, the robot or somebody's place is outside the room, in a wall, in furniture or
        in something else, or two people begin in one place.

    Examples
    --------
    >>> Scene([Object.trash_can((2.5, 3.6)), Object.trash_can((2.7, 3.6))])
    Traceback (most recent call last):
    ValueError: objects must not stand in each other, got object 0 at (2.5, 3.6) and object 1 at (2.7, 3.6)
    """

    objects: tuple = ()
    room: Room = LABORATORY
    robot: Robot = field(default_factory=Robot)
    people: tuple = ()
    moves: tuple = ()

    def __post_init__(self):
        put_in(self, objects=tuple(self.objects), people=tuple(self.people), moves=tuple(self.moves))
        check_objects(self)
        check_robot(self)
        check_people(self)
        check_moves(self)

    def __repr__(self):
        placed = [(each.shape, *each.position) for each in self.objects]
        objects = ", ".join(f"{shape} ({x:.2f}, {y:.2f})" for shape, x, y in placed)
        people = f", {len(self.people)} people" if self.people else ""
        return f"Scene of {objects or 'nothing'}{people}"

    @property
    def positions(self):
        """(N, 2) middles of the objects in m."""
        return np.array([each.position for each in self.objects]).reshape(-1, 2)

    @property
    def foot_radii(self):
        """(N,) radius in m of the circle round each object's widest part."""
        return np.array([each.reach for each in self.objects])

    @property
    def boxes(self):
        """(M, 4) true bounding boxes in m, at the height of the laser, of the objects that it can meet."""
        outlines = [each.outline(self.robot.beam_height) for each in self.objects]
        return np.array([each.bounds for each in outlines if each is not None]).reshape(-1, 4)

    @property
    def section(self):
        """Outlines of walls, furniture and objects at the height of the laser, a tuple."""
        height = self.robot.beam_height
        parts = [part.outline for part in self.room.parts if part.reaches(height)]
        objects = [each.outline(height) for each in self.objects]
        return tuple(parts + [each for each in objects if each is not None])

    def object_at(self, k, t):
        """Where an object stands at a time, moved or not.

        Parameters
        ----------
        k : int
            Which object.
        t : float
            In s.

        Returns
        -------
        (2,) float array
            In m.
        """
        place = np.array(self.objects[k].position)
        for move in sorted(self.moves, key=lambda each: each.begin):
            if move.object == k:
                place = place + np.clip((t - move.begin) / move.seconds, 0.0, 1.0) * (np.array(move.to) - place)
        return place

    def with_objects_at(self, positions):
        """The scene with its objects elsewhere.

        Parameters
        ----------
        positions : (N, 2) array_like
            In m.

        Returns
        -------
        Scene

        Raises
        ------
        ValueError
            If an object does not stand free there.
        """
        places = checked_array("positions", positions, len(self.objects), 2)
        return replace(self, objects=tuple(map(Object.at, self.objects, places)))

    def save(self, path):
        """Write the scene as JSON, whole or not at all.

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        OSError
            Where the file cannot be written, or what is there is not a scene.
        """
        with whole_file(path, "w", SCENE) as stream:
            json.dump(self.to_dict(), stream)

    @classmethod
    def load(cls, path):
        """Read what `save` wrote.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Scene

        Raises
        ------
        FormatError
            If the file is no scene, damaged, of another version, or has more than 1000 of anything.
        """
        return from_file(path, cls.from_dict, read_json(path, "a scene"))

    def to_dict(self):
        """The scene as plain lists and numbers, for JSON.

        Returns
        -------
        dict
        """
        content = {"format": FORMAT, "version": VERSION}
        content |= {each.name: plain(getattr(self, each.name)) for each in fields(self)}
        return content

    @classmethod
    def from_dict(cls, content):
        """The scene that `to_dict` told of.

        Parameters
        ----------
        content : dict

        Returns
        -------
        Scene

        Raises
        ------
        ValueError
            If it is of another format or version, a part is missing or unknown, or it is no scene.
        """
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise ValueError(f"not a scene: format must be {FORMAT!r}")
        if content.get("version") is not VERSION:
            raise ValueError(f"the version of a scene must be {VERSION}, got {told(content.get('version'))}")
        content = {name: value for name, value in content.items() if name not in ("format", "version")}
        check_fields("a scene", content, {each.name for each in fields(cls)})
        lists = {"objects": Object, "people": Person, "moves": Move}
        lists = {name: all_made(name, kind, content[name]) for name, kind in lists.items()}
        furniture = partial(all_made, "furniture", Part)
        room = made("the room", Room, content["room"], furniture=furniture)
        robot = made("the robot", Robot, content["robot"], scanner=partial(made, "the scanner", Scanner))
        return cls(room=room, robot=robot, **lists)


def plain(value):
    """A record of this module as plain lists and numbers."""
    if isinstance(value, tuple):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if hasattr(value, "__dataclass_fields__"):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    return value


def made(where, kind, content, **parts):
    """A record from what `plain` told of it; parts of it are made by functions; errors say where."""
    names = {each.name for each in fields(kind)}
    check_fields(where, content, names)
    values = {name: parts[name](value) if name in parts else value for name, value in content.items()}
    try:
        return kind(**values)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error


def all_made(name, kind, content):
    """A record of each in a list."""
    if not isinstance(content, list):
        raise ValueError(f"{name} must be a list, got {type(content).__name__}")
    if len(content) > MOST:
        raise ValueError(f"{name} must be at most {MOST}, got {len(content)}")
    return tuple(made(f"{name}[{k}]", kind, each) for k, each in enumerate(content))


# ---- what cannot be


def rounded(place):
    """A place as it is told in a message."""
    return tuple(round(float(value), 2) for value in place[:2])


def check_objects(scene):
    """Every object stands in the room, and in nothing else."""
    for k, each in enumerate(scene.objects):
        check_free(scene, f"object {k}", each.footprint)
    outlines = [each.footprint for each in scene.objects]
    for i, outline in enumerate(outlines):
        for j in np.flatnonzero(gaps(outlines[:i], outline) < 0):
            both = f"object {j} at {rounded(outlines[j])} and object {i} at {rounded(outline)}"
            raise ValueError(f"objects must not stand in each other, got {both}")


def check_free(scene, name, outline):
    """An outline lies in the room, clear of walls and furniture."""
    if not scene.room.holds(outline):
        raise ValueError(f"{name} must stand in the room and free, got {rounded(outline)}")


def check_robot(scene):
    """The robot stands in the room, and in nothing else, and so do the places that it drives to."""
    robot = scene.robot
    if robot.beam_height >= scene.room.height:
        rule = f"the beam must be below the top of the walls, {scene.room.height} m"
        raise ValueError(f"{rule}, got {robot.beam_height} m")
    longest = np.hypot(*np.ptp(scene.room.corners, axis=0))  # what is longer leaves the room
    lengths = [min(np.hypot(*np.subtract(b, a)), longest) for a, b in robot_lines(robot)]
    if sum(lengths) > LONGEST_WAY:
        raise ValueError(f"the robot's way must be at most {LONGEST_WAY:g} m long, got {sum(lengths):g} m")
    ends = zip(robot_lines(robot), lengths, strict=True)
    stretches = [np.linspace(a, b, 2 + int(length / 0.1)) for (a, b), length in ends]
    for name, place in (
        ("the robot", robot.pose),
        *(("the robot's way", place) for each in stretches for place in each),
    ):
        disc = Outline(*place[:2], radius=robot.radius)
        check_free(scene, name, disc)
        for k in np.flatnonzero(gaps([each.footprint for each in scene.objects], disc) < 0):
            raise ValueError(f"{name} must not be in an object, got {rounded(place)} and object {k}")


def robot_lines(robot):
    """Where the straight lines of a robot's way begin and end, in m."""
    places = [robot.pose[:2], *robot.way]
    return zip(places[:-1], places[1:], strict=True)


def check_people(scene):
    """People's places are in the room, and no two people begin in one."""
    for k, person in enumerate(scene.people):
        for place, free in zip(person.places, scene.room.distance(person.places) > 0, strict=True):
            if not free:
                raise ValueError(f"person {k} must walk in the room, got {rounded(place)}")
        in_what = gaps([each.footprint for each in scene.objects], Outline(*person.places[0], radius=0.0))
        for j in np.flatnonzero(in_what < 0):
            raise ValueError(f"person {k} must not begin in an object, got {rounded(person.places[0])} and object {j}")
        for j in range(k):
            apart = np.linalg.norm(np.subtract(person.places[0], scene.people[j].places[0]))
            if apart < SHOULDERS:
                rule = f"people must begin {SHOULDERS} m apart or more"
                raise ValueError(f"{rule}, got {apart:.2f} m between person {j} and person {k}")


def check_moves(scene):
    """Moves are of objects that there are, to places that are free when it is done."""
    objects = list(scene.objects)
    for move in sorted(scene.moves, key=lambda each: each.begin):
        known = isinstance(move.object, int | np.integer) and not isinstance(move.object, bool)
        if not (known and 0 <= move.object < len(scene.objects)):
            raise ValueError(f"a move must be of one of {len(scene.objects)} objects, got {told(move.object)}")
        name, each = f"object {move.object}, when moved,", objects[move.object].at(move.to)
        check_free(scene, name, each.footprint)
        objects[move.object] = each
        others = [other.footprint for k, other in enumerate(objects) if k != move.object]
        if not scene.robot.way:
            others.append(Outline(*scene.robot.pose[:2], radius=scene.robot.radius))
        for k in np.flatnonzero(gaps(others, each.footprint) < 0):
            both = f"{rounded(move.to)}, in what is at {rounded(others[k])}"
            raise ValueError(f"{name} must not stand in anything, got {both}")


def object_gaps(scene):
    """Free distance round every object, to the next one or to the background.

    Distances are from the circle round an object's widest part.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (N,) float array
        In m.
    """
    return free_gaps(scene, scene.positions)


def free_gaps(scene, positions):
    """The same if the objects stood at (N, 2) `positions`."""
    radii = scene.foot_radii
    between = np.linalg.norm(positions[:, None] - positions, axis=2) - radii[:, None] - radii
    np.fill_diagonal(between, np.inf)
    return np.minimum(scene.room.distance(positions) - radii, between.min(axis=1, initial=np.inf))


def free_room(scene, positions):
    """Least free distance in m round the scene's objects if they stood at (N, 2) `positions`."""
    gaps = free_gaps(scene, positions)
    to_robot = np.linalg.norm(positions - scene.robot.pose[:2], axis=1) - scene.foot_radii
    return min(gaps.min(initial=np.inf), to_robot.min(initial=np.inf))


# ---- the paper's scenes


def empty_scene():
    """The laboratory without foreground objects, as the background map is made in (Sec. II).

    Returns
    -------
    Scene
    """
    return Scene()


def figure_eight_scene():
    """Two trash cans four metres apart, the robot watching from the lower wall (Fig. 5).

    Returns
    -------
    Scene
    """
    return Scene([Object.trash_can((2.5, 3.6)), Object.trash_can((6.5, 3.6))])


def slalom_scene(n_cones=4, spacing=1.5):
    """A row of slalom cones across the middle of the laboratory (Fig. 11; its size is ours).

    Parameters
    ----------
    n_cones : int
    spacing : float
        Between the middles of neighbouring cones in m.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If a cone would not stand free of the others and of the background.

    Examples
    --------
    >>> np.diff(slalom_scene(3, spacing=1.5).positions, axis=0).tolist()
    [[1.5, 0.0], [1.5, 0.0]]
    """
    left, _, right, _ = LABORATORY.bounds
    offsets = (np.arange(n_cones) - (n_cones - 1) / 2) * spacing
    return Scene([Object.cone(((left + right) / 2 + offset, 3.6)) for offset in offsets])


def moved(scene, shifts):
    """The scene with its foreground objects elsewhere, each by a shift of its own (Fig. 10).

    Parameters
    ----------
    scene : Scene
    shifts : (N, 2) array_like
        In m.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If an object does not stand free there.

    Examples
    --------
    >>> scene = figure_eight_scene()
    >>> (moved(scene, [(0.5, 0.0), (0.0, -0.5)]).boxes - scene.boxes).round(6).tolist()
    [[0.5, 0.0, 0.5, 0.0], [0.0, -0.5, 0.0, -0.5]]
    """
    return scene.with_objects_at(scene.positions + np.asarray(shifts))


def rearranged(scene, rng, reach=0.6, spacing=1.0, attempts=10_000):
    """The scene with every foreground object moved somewhere else, at random (Sec. IV).

    Parameters
    ----------
    scene : Scene
    rng : numpy.random.Generator
    reach : float
        Standard deviation in m of the move along x and along y.
    spacing : float
        Free room in m asked for round every object, so that a person can walk round it.
    attempts : int
        Draws after which to give up.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If no such layout is found.

    Examples
    --------
    >>> scene = rearranged(figure_eight_scene(), np.random.default_rng(0), spacing=1.2)
    >>> bool((object_gaps(scene) >= 1.2).all())
    True
    """
    for _ in range(attempts):
        positions = scene.positions + rng.normal(0.0, reach, scene.positions.shape)
        if free_room(scene, positions) >= spacing:
            return scene.with_objects_at(positions)
    n_objects = len(scene.objects)
    raise ValueError(f"spacing must leave room for {n_objects} objects, found none for {spacing} m")
