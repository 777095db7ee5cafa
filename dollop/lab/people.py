"""People as data: the walks of a scene's people, ways round what stands between, and real walks replayed.

Nothing here needs PyBullet.
"""

import io
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from dollop.checks import checked_array, checked_positions
from dollop.formats.files import FormatError, from_file, read_bytes
from dollop.lab.driving import planned_poses
from dollop.lab.outlines import outline_distances
from dollop.lab.person import DEPTH, SHOULDERS, TIME_STEP, Walk, check_room, walk, walk_along
from dollop.lab.things import Person
from dollop.pose import rotation
from dollop.trajectory import arc_length

__all__ = ["find_way", "free_places", "read_walks", "replay", "walk_of", "walks_of"]

STRETCH = 0.7
"""Longest distance in m between the via-points of a way."""
AFTERWARDS = 1.5
"""Time in s that people stand at the end of their way."""
CELL = 0.10
"""Side in m of the cells in which a way is sought."""
FRAMES_PER_SECOND = 29.97
"""Of the recordings that `read_walks` reads."""
MAX_WALKS = 1 << 28
"""Bytes of one of them, unpacked."""
WALK_COLUMNS = ["id", "frame", "label", "x_est", "y_est"]


def walk_of(person, scene):
    """The walk that a person's data tell of.

    Parameters
    ----------
    person : Person
    scene : Scene
        Its objects are kept clear of.

    Returns
    -------
    Walk

    Raises
    ------
    ValueError
        If the way leads through a wall, through furniture or through an object.

    Examples
    --------
    A stop takes the time that it is said to take.

    >>> from dollop.lab.scenes import empty_scene
    >>> from dollop.lab.things import Person
    >>> straight = [(2.0, 3.0), (4.0, 3.0), (6.0, 3.0)]
    >>> going, stopping = Person(straight), Person(straight, stops=[(1, 4.0)])
    >>> longer = walk_of(stopping, empty_scene()).t[-1] - walk_of(going, empty_scene()).t[-1]
    >>> bool(4.0 < longer < 6.0)
    True
    """
    places = np.array(person.places)
    if len(places) == 1:
        check_room(places, scene)
        here = np.repeat(places, 2, axis=0)
        return Walk(np.array([0.0, TIME_STEP]), here, np.zeros(2), np.zeros(2), person.body)
    if person.times:
        moving = walk_along(np.array(person.times) - person.times[0], places, person.body)
        check_room(moving.positions, scene)
        return standing_before(moving, person.begin)
    rng = np.random.default_rng(person.seed)
    visited = np.array(visits(places, person.laps, person.back))
    points, numbers = closely(places[visited])
    points = points + rng.normal(0.0, person.scatter, points.shape) * (person.scatter > 0)
    stops = [(int(numbers[i]), seconds) for k, seconds in person.stops for i in np.flatnonzero(visited == k)]
    gait = {
        "speed": person.speed,
        "stand": (person.begin, AFTERWARDS),
        "body": person.body,
        "stops": stops,
    }
    return walk(points, scene, rng, **gait)


def visits(places, laps, back):
    """The order in which places (K, 2) are visited, their numbers; one after another are not in one place."""
    count = len(places)
    once = [*range(count), *range(count - 2, -1, -1)] if back else [*range(count)]
    order = once if laps == 1 else once * laps + [0]
    return [k for i, k in enumerate(order) if i == 0 or not np.array_equal(places[k], places[order[i - 1]])]


def closely(points):
    """Points (M, 2) on the straight lines between points (K, 2), so close that no spline swings; where those are."""
    stretches = np.maximum(1, np.ceil(np.linalg.norm(np.diff(points, axis=0), axis=1) / STRETCH - 1e-6)).astype(int)
    numbers = np.concatenate([[0], np.cumsum(stretches)])
    filled = [np.interp(np.arange(numbers[-1] + 1), numbers, axis) for axis in points.T]
    return np.column_stack(filled), numbers


def standing_before(moving, seconds):
    """A walk that begins so many s later, and ends with standing."""
    before, after = round(seconds / TIME_STEP), round(AFTERWARDS / TIME_STEP)
    padded = [np.pad(each, [(before, after)] + [(0, 0)] * (each.ndim - 1), mode="edge") for each in columns(moving)]
    return Walk(np.arange(len(padded[0])) * TIME_STEP, *padded, moving.body)


def columns(walk):
    """Positions, headings and phases of a walk."""
    return walk.positions, walk.headings, walk.phases


def walks_of(scene):
    """The walks of all people of a scene, who do not walk through each other.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    tuple of Walk

    Raises
    ------
    ValueError
        As `walk_of`, and if two people, or a person and a robot that stands or an object that has been
        moved, are in one place at one time.
    """
    walks = tuple(walk_of(person, scene) for person in scene.people)
    if not walks:
        return walks
    t = np.arange(0.0, settled(scene, walks), 0.1)
    ways = [np.column_stack([np.interp(t, each.t, axis) for axis in each.positions.T]) for each in walks]
    for i, way in enumerate(ways):
        for j in range(i):
            check_apart(np.linalg.norm(way - ways[j], axis=1), DEPTH, t, f"people {j} and {i}")
        if not scene.robot.way:
            away = np.linalg.norm(way - scene.robot.pose[:2], axis=1)
            check_apart(away, DEPTH / 2 + scene.robot.radius, t, f"person {i} and the robot")
        else:
            away = np.linalg.norm(way - planned_poses(scene.robot, t)[:, :2], axis=1)
            check_apart(away, DEPTH / 2 + scene.robot.radius, t, f"person {i} and the robot that drives")
        for k in {move.object for move in scene.moves}:
            moving = t >= min(move.begin for move in scene.moves if move.object == k)
            there = [scene.objects[k].at(scene.object_at(k, time)).footprint for time in t[moving]]
            away = np.full(len(t), np.inf)
            away[moving] = [outline_distances([at], [each])[0, 0] for at, each in zip(way[moving], there, strict=True)]
            check_apart(away, DEPTH / 2, t, f"person {i} and object {k}, when moved,")
    return walks


def settled(scene, walks):
    """Time in s after which nothing moves any more; a robot that drives is given twice the time that it needs."""
    ends = [each.t[-1] for each in walks] + [move.begin + move.seconds for move in scene.moves]
    driven = arc_length(np.array([scene.robot.pose[:2], *scene.robot.way]))[-1] if scene.robot.way else 0.0
    return max([*ends, 2 * driven / scene.robot.speed]) + 0.2


def check_apart(distances, least, t, who):
    """Raise ValueError at the time at which two are nearer to each other than they can be."""
    nearest = distances.argmin()
    if distances[nearest] < least:
        told = f"{distances[nearest]:.2f} m at {t[nearest]:.1f} s"
        raise ValueError(f"{who} must keep {least:.2f} m apart, got {told}")


def find_way(scene, places, clear=0.15):
    """Places to pass from one place to the next, round what stands between them.

    Parameters
    ----------
    scene : Scene
    places : (K, 2) array_like
        In m.
    clear : float
        Distance in m that a shoulder is to keep from everything; a short cut may come a fifth nearer.

    Returns
    -------
    (M, 2) float array
        Straight lines between them are free; the K places are among them.

    Raises
    ------
    ValueError
        If there is no way, or no room at a place.

    Examples
    --------
    Through the door of a wall between two rooms.

    >>> from dollop.lab.rooms import Part, Room
    >>> from dollop.lab.scenes import Scene
    >>> from dollop.lab.things import Robot
    >>> wall = Part("box", (3.0, 1.5, 1.2), (0.1, 3.0, 2.4))
    >>> rooms = Scene(room=Room([(0, 0), (6, 0), (6, 4), (0, 4)], [wall]), robot=Robot((1.0, 3.4, 0.0)))
    >>> find_way(rooms, [(1.0, 1.0), (5.0, 1.0)])[1:-1, 1].min() > 3.0
    np.True_
    """
    places = np.asarray(places, dtype=float)
    low, high = np.split(scene.room.bounds, 2)
    shape = np.ceil((high - low) / CELL).astype(int)
    cells = low + (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) + 0.5) * CELL
    free = free_places(scene, cells.reshape(-1, 2), clear)
    for place in places[~free_places(scene, places, clear)]:
        raise ValueError(f"a person needs room at every place, found none at {np.round(place, 2).tolist()}")
    graph = neighbours(free.reshape(shape))
    flat = np.flatnonzero(free)
    if not len(flat):
        raise ValueError(f"a person needs room to walk, found none in {scene.room}")
    numbers = flat[[np.linalg.norm(cells.reshape(-1, 2)[flat] - place, axis=1).argmin() for place in places]]
    way = [places[0]]
    for k, (begin, end) in enumerate(zip(numbers[:-1], numbers[1:], strict=True)):
        _, before = dijkstra(graph, indices=begin, return_predecessors=True)
        steps = [end]
        while steps[-1] != begin:
            steps.append(before[steps[-1]])
            if steps[-1] < 0:
                here, there = (np.round(place, 2).tolist() for place in places[k : k + 2])
                raise ValueError(f"a person needs a way from place to place, found none from {here} to {there}")
        inner = cells.reshape(-1, 2)[steps[-2:0:-1]]
        way += straightened(scene, np.vstack([places[k], inner, places[k + 1]]), clear)
    return np.array(way)


def free_places(scene, points, clear):
    """Whether a person has room at points.

    Parameters
    ----------
    scene : Scene
    points : (N, 2) array_like
        In m.
    clear : float
        Distance in m that a shoulder is to keep from everything.

    Returns
    -------
    (N,) bool array
    """
    lack = SHOULDERS / 2 + clear
    free = scene.room.distance(points) > lack
    if scene.objects:
        free &= outline_distances(points, [each.footprint for each in scene.objects]).min(axis=1) > lack
    return free


def neighbours(free):
    """Graph of the free cells (X, Y): each with its eight neighbours, weighted by distance."""
    numbers = np.arange(free.size).reshape(free.shape)
    width, depth = free.shape
    parts = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = np.s_[: width - dx, max(0, -dy) : depth - max(0, dy)]
        there = np.s_[dx:, max(0, dy) : depth + min(0, dy)]
        both = free[here] & free[there]
        parts.append((numbers[here][both], numbers[there][both], np.full(both.sum(), np.hypot(dx, dy))))
    begins, ends, lengths = map(np.concatenate, zip(*parts, strict=True))
    graph = sparse.coo_array((lengths, (begins, ends)), (free.size, free.size)).tocsr()
    return graph + graph.T


def straightened(scene, path, clear):
    """The places of a path after its first that are left when every free short cut is taken."""
    kept, here = [], 0
    while here < len(path) - 1:
        there = len(path) - 1
        while there > here + 1 and not free_line(scene, path[here], path[there], clear):
            there -= 1
        kept.append(path[there])
        here = there
    return kept


def free_line(scene, begin, end, clear, step=0.05):
    """Whether a person has room all along a straight line."""
    count = max(2, round(np.linalg.norm(end - begin) / step))
    return bool(free_places(scene, np.linspace(begin, end, count), clear * 0.8).all())


def replay(track, start, heading, **more):
    """A person who walks as somebody really did, elsewhere.

    Parameters
    ----------
    track : (N, 3) array_like
        t in s, x and y in m: one of `read_walks`.
    start : (2,) sequence of float
        Where the walk is to begin, in m.
    heading : float
        Direction from its beginning to its end, in rad.
    **more
        More fields of `Person`: body, begin.

    Returns
    -------
    Person

    Raises
    ------
    ValueError
        As `Person`.

    Examples
    --------
    >>> person = replay([(0.0, 5.0, 5.0), (1.0, 5.0, 6.0)], start=(1.0, 2.0), heading=0.0)
    >>> np.round(person.places, 6).tolist(), person.times
    ([[1.0, 2.0], [2.0, 2.0]], (0.0, 1.0))
    """
    t, *way = checked_array("track", track, "N", 3).T
    away = np.transpose(way) - np.array(way)[:, 0]
    turn = heading - np.arctan2(*away[-1, ::-1])
    places = start + away @ rotation(turn).T
    return Person(tuple(map(tuple, places.tolist())), times=tuple((t - t[0]).tolist()), **more)


def read_walks(folder):
    """Real human walks, tracked from above by a drone (Yang et al., arXiv 1902.00487).

    Parameters
    ----------
    folder : str or Path
        With the data set's files, .csv or .csv.gz: columns id, frame, label, x_est and y_est in m
        among others, 29.97 frames per second.

    Returns
    -------
    list of (N, 3) float arrays
        t in s from 0, x and y in m; one for each person, in the order of the files' names.

    Raises
    ------
    FormatError
        If there is no such file, or one is something else or holds more than 256 MiB.
    """
    paths = sorted(Path(folder).glob("*.csv*"))
    if not paths:
        raise FormatError("a folder of walks must hold .csv or .csv.gz files", folder)
    walks = []
    for path in paths:
        try:
            numbers = dict.fromkeys(["frame", "x_est", "y_est"], float)
            content = io.BytesIO(read_bytes(path, MAX_WALKS))
            table = pd.read_csv(content, usecols=WALK_COLUMNS, dtype=numbers, low_memory=False)
        except ValueError as error:
            raise FormatError(f"not a table of walks with {', '.join(WALK_COLUMNS)}: {error}", path) from None
        walked = table[table.label == "ped"]
        from_file(path, checked_positions, "x_est and y_est", walked[["x_est", "y_est"]])
        from_file(path, checked_array, "frame", walked.frame, "N")
        people = walked.groupby("id")
        for _, rows in people:
            t = (rows.frame - rows.frame.iloc[0]) / FRAMES_PER_SECOND
            walks.append(np.column_stack([t, rows.x_est, rows.y_est]).astype(float))
    return walks
