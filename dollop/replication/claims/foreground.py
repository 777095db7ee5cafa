"""Claims on what is foreground, and what one scan tells of it (Sec. II): likeness, radius and area.

One scan at a time: what a filter or a memory adds is judged elsewhere.
"""

from dataclasses import dataclass
from functools import cache, lru_cache
from math import inf

import numpy as np
from scipy.spatial import cKDTree

from dollop.foreground import endpoints, find_blobs, foreground_mask, surface_points
from dollop.gridmap import flat_cells, in_metres
from dollop.lab.outlines import Outline, meeting, outline_distances
from dollop.lab.person import DEPTH, SHOULDERS
from dollop.lab.scenes import figure_eight_scene, rearranged
from dollop.lab.things import Object
from dollop.laser import LaserLog
from dollop.replication import recordings
from dollop.replication.choosing import laser_of, seen_by
from dollop.replication.claims.claim import REGISTRY, Criterion, claim
from dollop.replication.draws import drawn_until_room
from dollop.replication.reconstruction import TOLD

__all__ = []

CAN = Object.trash_can((0.0, 0.0)).outline(0.36)
WAIST = Outline(0.0, 0.0, (SHOULDERS - DEPTH) / 2, 0.0, 0.0, DEPTH / 2)
SLIM = WAIST._replace(half_width=CAN.radius - DEPTH / 2)
"""A waist as wide as the can."""


# ---- a waist and a trash can


@claim(
    "II",
    "it cannot discriminate between geometrically similar objects in the view plane, such as the "
    "waist of a person and a trash can",
    Criterion("right", "share told apart by shape, one scan", (-inf, 0.6), 0.05, trials=40),
    Criterion("right_as_wide", "the same of a waist as wide as the can", trials=40),
    Criterion("right_width", "share told apart by its width alone", trials=40),
    Criterion("right_depth", "share told apart by its depth alone", trials=40),
    Criterion("right_curvature", "share told apart by its curvature alone", trials=40),
    Criterion("right_motion", "share told apart by where it is a second later", trials=40),
    choices=("laser_noise",),
)
def alike(seed, how=TOLD, count=40):
    """Whether one scan of a body tells a person's waist from a trash can.

    As many waists, the laboratory's 0.45 m by 0.25 m and rounded, as cans, 0.36 m across, 1 to 6 m
    from the laser, a wall some way behind, turned anyhow. Of the readings on each: width, depth,
    curvature and distance. A body is what most of the fifteen bodies are that are most like it, of
    two thousand that were drawn once and for all; and by one of these alone, what it is on its side
    of the threshold that parts those best. Guessing gives one half; who is right in six of ten does
    hardly better, and one of twenty more or less matters. After a second: moved by more than 0.2 m
    or not, the person walking a figure-eight.
    """
    rng, laser = np.random.default_rng([seed, 24]), laser_of(how)
    bodies, known = drawn_bodies(WAIST, count, rng, laser), bodies_known(WAIST, how)
    names, person = ("width", "depth", "curvature"), bodies[1]
    alone = {f"right_{name}": right_by_threshold(known, bodies, k) for k, name in enumerate(names)}
    slim = right_by_likeness(bodies_known(SLIM, how), drawn_bodies(SLIM, count, rng, laser))
    moved = moved_by(seed, person, rng, laser) > 0.2
    numbers = {"right": right_by_likeness(known, bodies), "right_as_wide": slim}
    return numbers | alone | {"right_motion": np.mean(moved == person)}


@cache
def bodies_known(waist, how, count=2000):
    """Bodies to learn from, the same for all seeds: shapes (N, 4), and which are persons (N,)."""
    return drawn_bodies(waist, count, np.random.default_rng(24), laser_of(how))


def drawn_bodies(waist, count, rng, laser):
    """Shapes (N, 4) of waists and cans in turn, each in its own scan, and which are waists (N,)."""
    person = np.arange(count) % 2 == 0
    places = rng.uniform([1, -1.3], [6, 1.3], (count, 2))
    outlines = (waist if each else CAN for each in person)
    bodies = zip(outlines, places, strict=True)
    return np.array([shape_of(blob_of(*body, rng, laser)) for body in bodies]), person


def blob_of(outline, place, rng, laser, turn=None):
    """Readings (N, 2) in m on a body at a place (distance, bearing), as seen from the laser.

    Those by which the body is parted from the wall behind it by more than the 20 cm of Sec. II.
    """
    distance, bearing = place
    x, y = distance * np.cos(bearing), distance * np.sin(bearing)
    body = outline._replace(x=x, y=y, turn=rng.uniform(-np.pi, np.pi) if turn is None else turn)
    wall = distance + rng.uniform(0.7, 3.0)
    ranges = laser.report(np.minimum(meeting((0, 0), laser.angles, [body])[:, 0], wall), rng)
    on = (ranges < wall - 0.2) & (np.abs(laser.angles - bearing) < 0.5 / distance)
    beams = np.column_stack([np.cos(laser.angles), np.sin(laser.angles)])
    return ranges[on, None] * beams[on]


def shape_of(blob):
    """Width, depth, curvature and distance of readings (N, 2), in m and 1/m; 0 for too few.

    Depth is along the line of sight; the curvature is that of the parabola through the readings.
    """
    if len(blob) < 3:
        return np.array([0.0, 0.0, 0.0, np.linalg.norm(blob, axis=1).mean() if len(blob) else 0.0])
    middle = blob.mean(axis=0)
    distance = np.linalg.norm(middle)
    along = middle / distance
    deep, wide = blob @ along, blob @ (-along[1], along[0])
    return np.array([np.ptp(wide), np.ptp(deep), 2 * np.polyfit(wide, deep, 2)[0], distance])


def right_by_likeness(known, bodies, count=15):
    """Share of bodies that are what most of the known ones most like them are."""
    (shapes, was), (seen, person) = known, bodies
    scale = shapes.std(axis=0)
    _, like = cKDTree(shapes / scale).query(seen / scale, count)
    return np.mean((was[like].mean(axis=1) > 0.5) == person)


def right_by_threshold(known, bodies, k):
    """Share of bodies on their side of the threshold of number k that parts the known ones best."""
    (shapes, was), (seen, person) = known, bodies
    at = np.quantile(shapes[:, k], np.linspace(0, 1, 101))
    above = ((shapes[:, k] > at[:, None]) == was).mean(axis=1)
    best = np.maximum(above, 1 - above).argmax()
    return np.mean((seen[:, k] > at[best]) == (person == (above[best] > 0.5)))


def moved_by(seed, person, rng, laser):
    """How far (N,) in m the middle of each body's readings is from where it was a second before."""
    truth = recordings.figure_eights(seed).recording.truth
    t, places = truth.t.to_numpy(), truth[["x", "y"]].to_numpy() @ (1, 1j)
    moves = []
    for each in person:
        begin, heading = rng.uniform(t[0], t[-1] - 1), rng.uniform(-np.pi, np.pi)
        way = np.diff(np.interp([begin, begin + 1], t, places)).item() if each else 0.0
        place = 4.0 * np.exp(1j * rng.uniform(-1.3, 1.3)) + np.array([0.0, way])
        before, after = (middle_of(WAIST if each else CAN, z, rng, laser, heading) for z in place)
        moves.append(np.linalg.norm(after - before))
    return np.array(moves)


def middle_of(outline, place, rng, laser, turn):
    """Middle (2,) in m of the readings on a body at a complex place; far away if there are none."""
    blob = blob_of(outline, (abs(place), np.angle(place)), rng, laser, turn)
    return blob.mean(axis=0) if len(blob) else np.full(2, 1e3)


# ---- twenty centimetres, and a hundred square centimetres


@claim(
    "II",
    "if there is no background object within some radius, e.g., 20 centimeters, of the measurement",
    Criterion("lost_20", "walker found by 5 cm, not by 20 cm [share]", (-inf, 0.05), 0.02),
    Criterion("false_20", "20 cm: false foreground objects in a scan", (-inf, 0.05), 0.02),
    Criterion("found_20", "20 cm: share of scans in which the walker is found"),
    Criterion("found_5", "5 cm: share of scans in which the walker is found"),
    Criterion("false_5", "5 cm: false foreground objects in a scan"),
    Criterion("found_10", "10 cm: share of scans in which the walker is found"),
    Criterion("false_10", "10 cm: false foreground objects in a scan"),
    Criterion("found_40", "40 cm: share of scans in which the walker is found"),
    Criterion("false_40", "40 cm: false foreground objects in a scan"),
    Criterion("kept_20", "20 cm: share of the readings on the walker that are foreground"),
    Criterion("kept_40", "40 cm: the same"),
    Criterion("taken_5", "5 cm: share of the background's readings that are foreground"),
    Criterion("taken_20", "20 cm: the same"),
    Criterion("draws", "places drawn until somebody has room to stand there"),
    choices=("laser_noise",),
)
def radius(seed, how=TOLD):
    """What a radius of 20 cm keeps of the walker, and of the background.

    Sixty scans of somebody who stands anywhere in the laboratory, turned anyhow, as near to two
    cans, to furniture and walls as their shoulders let them. Foreground readings of one scan are
    blobs on the map's cells, those above 100 cm² foreground objects. Found: one has its middle
    within 0.35 m of a walker of whom half can be seen. False: one that is beside neither walker nor
    can. Twenty centimetres will do where they cost one scan in twenty of those in which five find
    the walker, and fewer than one in twenty holds anything false; one of fifty matters.
    """
    room = room_stood_in(seed, how.only(("laser_noise",)))
    numbers = {"draws": room.draws}
    for name, far in (("5", 0.05), ("10", 0.1), ("20", 0.2), ("40", 0.4)):
        mask = foreground_mask(room.points, recordings.background_map(), far)
        objects = objects_of_scans(room, mask)
        numbers |= {
            f"found_{name}": found_share(room, objects, slice(0, 1)),
            f"false_{name}": false_share(room, objects),
        }
        numbers |= {
            f"kept_{name}": mask[room.on_walker].mean(),
            f"taken_{name}": mask[room.on_background].mean(),
        }
    numbers["lost_20"] = numbers["found_5"] - numbers["found_20"]
    return {each.number: numbers[each.number] for each in REGISTRY["radius"].criteria}


@claim(
    "II",
    "A foreground object is a blob that envelops more than a required area, e.g., 100 square centimeters",
    Criterion("found_100", "100 cm²: share of walkers and cans found", (0.95, 1), 0.05),
    Criterion("spared_100", "false objects in a scan, 25 cm² minus 100 cm²", (0.05, inf), 0.05),
    Criterion("found_25", "25 cm², a single cell: share of walkers and cans found"),
    Criterion("found_50", "50 cm²: the same"),
    Criterion("found_200", "200 cm²: the same"),
    Criterion("found_400", "400 cm²: the same"),
    Criterion("false_25", "25 cm²: false objects in a scan"),
    Criterion("false_50", "50 cm²: the same"),
    Criterion("false_100", "100 cm²: the same"),
    Criterion("false_200", "200 cm²: the same"),
    Criterion("false_400", "400 cm²: the same"),
    choices=("laser_noise",),
)
def area(seed, how=TOLD):
    """What it costs and spares that a foreground object must have an area of 100 cm².

    The scans of `radius`, foreground by 20 cm, with an area of 25 to 400 cm², one to sixteen cells
    of the map. Found: some object has its middle within 0.35 m of a walker or can of which half can
    be seen. The area does what it is there for where nineteen of twenty are still found, and where
    it spares a false object in one scan of twenty at least.
    """
    room = room_stood_in(seed, how.only(("laser_noise",)))
    mask = foreground_mask(room.points, recordings.background_map(), 0.2)
    numbers = {}
    for each in (25, 50, 100, 200, 400):
        objects = objects_of_scans(room, mask, each * 1e-4)
        numbers |= {
            f"found_{each}": found_share(room, objects),
            f"false_{each}": false_share(room, objects),
        }
    return numbers | {"spared_100": numbers["false_25"] - numbers["false_100"]}


NEAR = 0.35
"""m from the middle of a body within which an object is that body: the laser sees its near side."""


@dataclass(frozen=True, eq=False)
class RoomStoodIn:
    """T scans of B beams of a room in which somebody stands, and what each beam truly meets.

    Attributes
    ----------
    points : (T, B, 2) float array
        Readings in m, nan where nothing came back.
    on_walker, on_background : (T, B) bool arrays
        What beams with a reading truly meet.
    bodies : (T, 3, 2) float array
        Middle of the walker and of either can in m.
    in_sight : (T, 3) bool array
        Of which of them at least half of all beams that would meet it do.
    draws : float
        Places drawn until one had room to stand, on average.
    """

    points: np.ndarray
    on_walker: np.ndarray
    on_background: np.ndarray
    bodies: np.ndarray
    in_sight: np.ndarray
    draws: int


@lru_cache(maxsize=2)
def room_stood_in(seed, how=TOLD, count=60):
    """Somebody stands anywhere in a room with two cans, once in each of so many scans."""
    rng = np.random.default_rng([seed, 25])
    scene = seen_by(rearranged(figure_eight_scene(), rng), how)
    drawn = [drawn_until_room(lambda _: place_to_stand(scene, rng), 1000) for _ in range(count)]
    stood, draws = zip(*drawn, strict=True)
    beams = np.array([beams_to(scene, torso) for torso in stood])
    points, met = endpoints(as_seen(scene, beams.min(axis=2), rng)), beams.argmin(axis=2)
    back = np.isfinite(points[..., 0])
    bodies = np.array([[torso[:2], *scene.positions] for torso in stood])
    on = back & (met == 0), back & (met == 3)
    return RoomStoodIn(points, *on, bodies, half_seen(beams), np.mean(draws))


def beams_to(scene, torso):
    """How far in m (B, 4) the laser's beams go to a torso, to either can and to the background."""
    pose, scanner = scene.robot.laser_pose, scene.robot.scanner
    far = meeting(pose[:2], scanner.angles + pose[2], [torso, *scene.section])
    return np.column_stack([far[:, 0], far[:, -2:], far[:, 1:-2].min(axis=1)])


def as_seen(scene, distances, rng):
    """The laser's log of true distances (T, B) in m."""
    pose, scanner = scene.robot.laser_pose, scene.robot.scanner
    ranges = [scanner.report(each, rng) for each in distances]
    times, poses = np.arange(len(ranges)) / scanner.rate, np.tile(pose, (len(ranges), 1))
    return LaserLog(times, ranges, scanner.angles, poses, scanner.max_range)


def half_seen(beams):
    """Of which bodies (T, 3) at least half of the beams that would meet them do, by beams (T, B, 4)."""
    would = np.isfinite(beams[..., :3])
    seen = (would & (beams[..., :3] <= beams.min(axis=2, keepdims=True))).sum(axis=1)
    return (seen >= would.sum(axis=1) / 2) & (seen > 0)


def place_to_stand(scene, rng):
    """Outline of a torso somewhere in a scene; ValueError where shoulders would touch anything."""
    low, high = np.reshape(scene.room.bounds, (2, 2))
    place, turn = rng.uniform(low, high), rng.uniform(-np.pi, np.pi)
    around = [
        scene.room.distance(place[None]).min(),
        outline_distances(place[None], scene.section).min(),
    ]
    if min(*around, np.linalg.norm(place - scene.robot.pose[:2]) - 0.25) < SHOULDERS / 2:
        raise ValueError("shoulders must not touch anything")
    return WAIST._replace(x=place[0], y=place[1], turn=turn)


def objects_of_scans(room, mask, min_area=0.01):
    """Middles (K, 2) in m of the foreground objects of each scan by itself, a list."""
    background, found = recordings.background_map(), []
    for points, foreground in zip(room.points, mask, strict=True):
        _, surface = surface_points(points[None], foreground[None])
        cells = np.column_stack(np.divmod(*cells_of(surface, background)))
        blobs = find_blobs(cells, background.resolution, min_area)
        middles = [blobs.cells[blobs.labels == k].mean(axis=0) + 0.5 for k in range(len(blobs))]
        rows, columns = np.reshape(middles, (-1, 2)).T
        places = in_metres(columns, rows, background.origin, background.resolution)
        found.append(np.column_stack(places))
    return found


def cells_of(points, background):
    """Flat numbers of the map's cells that hold points (N, 2) in m, and how long a row is."""
    shape = background.occupancy.shape
    cells, _ = flat_cells(points, background.origin, background.resolution, shape)
    return np.unique(cells), shape[1]


def found_share(room, objects, which=slice(0, 3)):
    """Share of the bodies in sight, walker first, that have an object near them."""
    pairs = zip(room.bodies, objects, strict=True)
    found = np.array([near_any(bodies, each) for bodies, each in pairs])
    sight = room.in_sight[:, which]
    return found[:, which][sight].mean() if sight.any() else np.nan


def false_share(room, objects):
    """Number of objects in a scan, on average, that are near no body."""
    pairs = zip(room.bodies, objects, strict=True)
    return np.mean([(~near_any(each, bodies)).sum() for bodies, each in pairs])


def near_any(points, others):
    """Which points (N, 2) have another one (M, 2) within `NEAR`."""
    return (np.linalg.norm(points[:, None] - others, axis=2) < NEAR).any(axis=1)
