"""Kinds of files: valid ones, made by the library itself, and a step down the pipeline for what is read from one."""

import gzip
import io
import json
import struct
import tempfile
from collections import namedtuple
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from damage import BINARY, damaged, pick
from PIL import Image
from watch import Wrong, pushed

from dollop import (
    Demonstration,
    Environment,
    LaserLog,
    OccupancyGrid,
    Task,
    Unicycle,
    export,
    learn,
    localise,
    observe,
    perform,
    read_log,
    write_log,
)
from dollop.environment import Seen
from dollop.formats import read_odometry
from dollop.lab.outlines import meeting
from dollop.lab.recording import Recording
from dollop.lab.scenes import Scene, empty_scene, figure_eight_scene
from dollop.lab.things import Move, Object, Person, Robot
from dollop.robot import MonteCarloLocalizer, ObstacleMap

Kind = namedtuple("Kind", "seeds read further needs anew", defaults=(None, None))
"""Valid files, each a dict of names to contents, the one that is read first; how it is read; what is done then; what
must be installed; and what makes, by chance, files that are wrong inside only, where that takes a writer."""
ANGLES = np.deg2rad(np.arange(-90, 91, 10.0))
CANS = [[1.2, 0.8, 1.5, 1.1], [3.0, 1.7, 3.4, 2.1]]


def finite(name, values, also=()):
    """Something that was accepted is finite, or one of the values that may be there as well."""
    with np.errstate(over="ignore"):  # of what is wider than a float
        values = np.asarray(values, dtype=float)
    odd = ~np.isfinite(values)
    for allowed in also:
        odd &= ~(np.isnan(values) if np.isnan(allowed) else values == allowed)
    if odd.any():
        raise Wrong(f"{name} is not finite")


def same(name, again, before):
    """What was written and read again is what it was."""
    if np.shape(again) != np.shape(before) or not np.allclose(again, before, rtol=1e-6, atol=1e-9):
        raise Wrong(f"{name} are other ones when they are read again")


def read_again(write, path, read):
    """What was accepted, written and read again; None if it is not written, which may be refused in words."""
    path.unlink(missing_ok=True)
    pushed(write, path)
    if not path.exists():
        return None
    try:
        return read(path)
    except ValueError as error:
        raise Wrong("what the library wrote it refuses") from error


# ---- a small world


def small_scans(count=4, angles=ANGLES, moving=True):
    """Scans of a room of 4.6 m x 3.1 m from its lower side, and of somebody who walks across."""
    pose = np.array([2.3, 0.2, np.pi / 2])
    bearings = pose[2] + angles
    with np.errstate(divide="ignore"):
        across = np.where(np.cos(bearings) > 0, 4.6 - pose[0], -pose[0]) / np.cos(bearings)
        up = np.where(np.sin(bearings) > 0, 3.1 - pose[1], -pose[1]) / np.sin(bearings)
    walls = np.minimum(np.where(across > 0, across, np.inf), np.where(up > 0, up, np.inf))
    ranges = np.tile(np.clip(walls, 0.05, 7.9), (count, 1))
    for i in range(count if moving else 0):
        k = (3 + i) % (angles.size - 1)
        ranges[i, k : k + 2] = np.minimum(ranges[i, k : k + 2], 1.4)
    ranges[0, 0] = np.inf
    return LaserLog(100 + 0.1 * np.arange(count), ranges, angles, np.tile(pose, (count, 1)), 8.0)


@cache
def small_map():
    """A map of that room, cells of 10 cm."""
    cells = np.zeros((33, 48))
    cells[[0, -1]], cells[:, [0, -1]] = 1.0, 1.0
    cells[10:12, 20] = np.nan
    return OccupancyGrid(cells, (-0.1, -0.1), 0.1)


@cache
def long_log():
    """Five seconds of somebody walking round in that room."""
    angles = np.deg2rad(np.arange(-90, 91, 5.0))
    log = small_scans(50, angles, moving=False)
    ranges = log.ranges.copy()
    for i in range(len(log)):
        k = 5 + i // 2
        ranges[i, k : k + 3] = np.minimum(ranges[i, k : k + 3], 1.5)
    return LaserLog(log.t, ranges, angles, log.poses, 8.0)


def small_demonstration(shift=0.0, boxes=CANS, seen=None, directions=None):
    """A walk of 3 m between two cans."""
    x = np.linspace(0.4, 4.0, 24)
    walk = np.column_stack([x, 1.4 + 0.5 * np.sin(1.7 * x) + shift])
    return Demonstration(walk, Environment(np.array(boxes) + [0, shift, 0, shift], seen, directions=directions))


def written(name, write, *others):
    """What a function writes to a file of this name, and to others beside it: {name: content}."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder, name))
        return {each: Path(folder, each).read_bytes() for each in (name, *others)}


# ---- CARMEN logs


def flaser_lines():
    """FLASER and ODOM messages, as CARMEN's logger writes them."""
    log, lines = small_scans(), ["# CARMEN Logfile", "PARAM robot_length 0.5 100.0 host 0.0"]
    for t, ranges, pose in zip(log.t, np.minimum(log.ranges, 81.9), log.poses, strict=True):
        place, stamp = " ".join(f"{value:.6f}" for value in pose), f"{t:.6f} host {t - 100:.6f}"
        lines.append(f"ODOM {place} 0.100000 0.000000 0.000000 {stamp}")
        lines.append(f"FLASER {ranges.size} {' '.join(f'{r:.2f}' for r in ranges)} {place} {place} {stamp}")
    return ("\n".join(lines) + "\n").encode()


def carmen_logs(suffix):
    """Logs of each message."""
    robot = partial(write_log, log=small_scans(3))
    contents = [written("a.log", robot)["a.log"], flaser_lines()]
    odometry = b"\n".join(line for line in contents[1].split(b"\n") if line.startswith(b"ODOM"))
    contents.append(contents[0] + odometry + b"\n")
    pack = partial(gzip.compress, mtime=0) if suffix.endswith(".gz") else bytes
    return [{f"a{suffix}": pack(each)} for each in contents]


def check_log(log):
    """What a log promises."""
    for name in ("t", "angles", "poses", "max_range"):
        finite(name, getattr(log, name))
    finite("ranges", log.ranges, [np.inf])


def read_any_log(path):
    """A log, checked."""
    log = read_log(path)
    check_log(log)
    return log


def check_odometry(odometry):
    """What odometry promises."""
    if odometry is not None:
        finite("odometry", np.column_stack([odometry.t, odometry.poses, odometry.velocities]))


def check_observation(found):
    """What was observed is finite."""
    if found is not None:
        finite("boxes", found.environment.boxes)
        for track in (*found.tracks, *found.people, *([found.user] if found.user else [])):
            finite("a track's times", track.t)
            finite("a track", track.positions)


def check_map(grid):
    """A map is finite where it is known."""
    if grid is not None:
        finite("occupancy", grid.occupancy, [np.nan])
        finite("the map's place", [*grid.origin, grid.resolution, *grid.extent])


def use_log(log, path, rng):
    """Make a map of a log, observe it, write it, and now and then localise it."""
    grid = pushed(OccupancyGrid.from_log, log, 0.1)
    check_map(grid)
    check_observation(pushed(observe, log, small_map() if grid is None or rng.random() < 0.7 else grid))
    odometry = pushed(read_odometry, path) if str(path).endswith((".log", ".gz")) else None
    check_odometry(odometry)
    again = read_again(partial(write_log, log=log), Path(path).with_name("again.log"), read_log)
    if again is not None:
        check_log(again)
        same("the scans", np.shape(again.ranges), np.shape(log.ranges))
    if rng.random() < 0.03:
        placed = pushed(localise, log, odometry, small_map())
        if placed is not None:
            check_log(placed)
            pushed(observe, log, small_map(), method="paper")


# ---- maps


def carmen_maps(suffix):
    """Maps with and without their place; the name of the chunk is there or not."""
    grid = small_map()
    tiny = OccupancyGrid([[0.0, 1.0, np.nan], [0.5, 0.25, 0.0]], (0.0, 0.0), 0.1)
    contents = [written("a.map", each.save)["a.map"] for each in (grid, tiny)]
    named = contents[1].partition(b"CARMENMAPFILEv020")
    rest = named[2]
    body = rest[:1] and bytes([rest[0] | 128]) + struct.pack("<i", len(rest) - 5 + 2) + rest[5:15] + b"m\0" + rest[15:]
    contents.append(named[1] + body)
    pack = partial(gzip.compress, mtime=0) if suffix.endswith(".gz") else bytes
    return [{f"a{suffix}": pack(each)} for each in contents]


def ros_maps(suffix):
    """YAML with a PGM or a PNG."""
    found = written("a.yaml", small_map().save, "a.pgm")
    tiny = written("a.yaml", OccupancyGrid([[0.0, 1.0, np.nan], [0.5, 0.25, 0.0]], (0.0, 0.0), 0.1).save, "a.pgm")
    if suffix == ".pgm":
        return [found, tiny]
    return [as_png(found, mode) for mode in ("L", "RGB", "RGBA", "P", "1", "I;16")] + [as_png(tiny, "L")]


def as_png(found, mode):
    """The same map with a PNG of some mode."""
    picture, stream = Image.open(io.BytesIO(found["a.pgm"])), io.BytesIO()
    grey = np.asarray(picture)
    picture = Image.fromarray(grey.astype(np.uint16) * 257) if mode == "I;16" else picture.convert(mode)
    picture.save(stream, "PNG")
    return {"a.yaml": found["a.yaml"].replace(b"a.pgm", b"a.png"), "a.png": stream.getvalue()}


def read_any_map(path):
    """A map, checked."""
    grid = OccupancyGrid.load(path)
    check_map(grid)
    return grid


def use_map(grid, path, rng):
    """Observe before a map, drive on it, be lost on it, write it."""
    check_observation(pushed(observe, small_scans(), grid))
    obstacles = pushed(ObstacleMap.of, Environment(CANS), grid)
    if obstacles is not None:
        finite("the obstacles' distances", [obstacles.edge(2.0, 1.0), obstacles.edge(-1e3, 5.0)])
    localiser = pushed(MonteCarloLocalizer, grid, ANGLES)
    if localiser is not None:
        pushed(localiser.update, (0.0, 0.0, 0.0), small_scans().ranges[0])
        finite("a pose", localiser.pose, [np.nan])
    suffix = pick(rng, (".map", ".map.gz", ".yaml"))
    again = read_again(grid.save, Path(path).with_name("again" + suffix), OccupancyGrid.load)
    if again is not None:
        check_map(again)
        same("the cells", np.isnan(again.occupancy), np.isnan(grid.occupancy))
        same("the map's place", [*again.origin, again.resolution], [*grid.origin, grid.resolution])


# ---- tasks


def tasks(kind):
    """Tasks of each version and method, as they are saved."""
    if kind == "anchored":
        seen = Seen(np.ones((8, 10), bool), (0.0, 0.0), 0.5)
        one, other = small_demonstration(seen=seen, directions=[0.1, np.nan]), small_demonstration(0.2)
        return [written("a.json", each.save) for each in (Task.of(one), learn([one, other]))]
    task = Task.of(small_demonstration(), method="paper")
    found = written("a.json", task.save)
    if kind == "paper":
        return [found, written("a.json", learn([small_demonstration(k) for k in (0.0, 0.1)], method="paper").save)]
    content = json.loads(found["a.json"])
    boxes = content.pop("environment")["boxes"]
    shown = [each | {"boxes": each["environment"]["boxes"]} for each in content["demonstrations"]]
    for each in shown:
        del each["environment"], each["notes"]
    old = ("format", "start", "speeds", "segments", "association")
    content = {name: content[name] for name in old} | {"version": 1, "boxes": boxes, "demonstrations": shown}
    return [{"a.json": json.dumps(content).encode()}]


def check_task(task):
    """A law is finite wherever it leads."""
    if task is not None:
        finite("subgoals", task.law.subgoals)
        finite("the start", task.law.start)
        finite("boxes", task.environment.boxes)
        for law in task.ways:
            response = pushed(law.response)
            if response is not None:
                finite("the response", response)


def read_any_task(path):
    """A task, checked."""
    task = Task.load(path)
    check_task(task)
    return task


def use_task(task, path, rng):
    """Adapt a task, perform it, save it and read it again."""
    boxes = task.environment.boxes
    moved = pushed(Environment, boxes + 0.1 * rng.standard_normal((len(boxes), 2))[:, [0, 1, 0, 1]])
    if moved is not None:
        check_task(pushed(task.adapt, moved))
    errors = pushed(task.errors)
    if errors is not None:
        finite("the task's errors", errors, [np.nan])
    again = read_again(task.save, Path(path).with_name("again.json"), Task.load)
    if again is not None:
        check_task(again)
        same("the subgoals", again.law.subgoals, task.law.subgoals)
    route = pushed(export, task, Path(path).with_name("route.geojson"), "nav2")
    if route is not None:
        json.loads(Path(path).with_name("route.geojson").read_text(), parse_constant=float)
        finite("the route", np.column_stack([route.places, route.headings, route.waits, route.t]))
        if not route.deviation <= 0.01:
            raise Wrong(f"a route is {route.deviation} m from the law")
    if rng.random() < 0.1:
        run = pushed(perform, task, Unicycle((*task.law.start, 0.0)), timeout=5.0)
        if run is not None:
            finite("the run", np.column_stack([run.t, run.poses, run.clearance]))
    if rng.random() < 0.1:
        check_task(pushed(task.add, small_demonstration(0.1)))


# ---- scenes and recordings


def rich_scene():
    """A scene with one of each."""
    people = [Person([(1.0, 2.0), (4.5, 2.0)]), Person([(6.0, 5.0)])]
    objects = figure_eight_scene().objects + (Object.cone((7.5, 3.0)),)
    return Scene(objects, people=people, moves=[Move(1, 0.0, (6.0, 3.0))], robot=Robot(way=[(4.5, 1.0)]))


def scenes():
    """Scenes as they are saved."""
    return [written("a.json", each.save) for each in (rich_scene(), figure_eight_scene(), empty_scene())]


def read_scene(path):
    """A scene, checked."""
    scene = Scene.load(path)
    finite("boxes", scene.boxes)
    finite("the robot", scene.robot.pose)
    finite("positions", scene.positions)
    return scene


def use_scene(scene, path, rng):
    """Look at a scene with its laser, as far as that goes without a simulator; write it and read it again."""
    section = pushed(lambda: scene.section)
    pose, angles = pushed(lambda: scene.robot.laser_pose), pushed(lambda: scene.robot.scanner.angles)
    if section and pose is not None and angles is not None:
        distances = pushed(meeting, np.array(pose[:2], float), pose[2] + angles[:50], section[:50])
        if distances is not None:
            distances = distances.min(axis=1)
            finite("distances", distances, [np.inf])
            ranges = pushed(scene.robot.scanner.report, distances, np.random.default_rng(0))
            if ranges is not None:
                finite("ranges", ranges, [np.inf])
    for k in range(min(3, len(scene.objects))):
        finite("an object's place", pushed(scene.object_at, k, 1.0))
    repr(scene)
    again = read_again(scene.save, Path(path).with_name("again.json"), Scene.load)
    same("the objects", again.positions, scene.positions)


def recordings():
    """A recording: its table of the truth, its scene and its log."""
    import pandas as pd

    log, names = (
        small_scans(2),
        [
            "x",
            "y",
            "heading",
            "x_1",
            "y_1",
            "heading_1",
            "object_x_1",
            "object_y_1",
            "laser_x",
            "laser_y",
            "laser_theta",
        ],
    )
    truth = pd.DataFrame({"t": log.t, **{name: [k + 0.25, k + 0.5] for k, name in enumerate(names)}})
    save = Recording(log, truth, rich_scene()).save
    return [written("a.log", save, "a_truth.csv", "a_truth.csv", "a_scene.json")]


def read_recording(path):
    """A recording, checked."""
    found = Recording.load(path)
    check_log(found.log)
    if len(found.truth):
        finite("the truth", found.truth.to_numpy(float))
    return found


def use_recording(found, path, rng):
    """Tell of it, and write it again."""
    repr(found)
    read_again(found.save, Path(path).with_name("again.log"), Recording.load)


# ---- bags


def bags(version):
    """ROS bags of scans, odometry, transforms and a map, written by rosbags."""
    from bags import map_bag, scan_bag

    log, grid = small_scans(3), OccupancyGrid(small_map().occupancy[:6, :8], (0.0, 0.0), 0.1)
    return [scan_bag(version, log), scan_bag(version, log, turned=True), map_bag(version, grid)]


def spoiled_bag(version, rng):
    """A bag that is in order, with messages that are not."""
    from bags import map_bag, scan_bag

    log, grid = small_scans(3), OccupancyGrid(small_map().occupancy[:6, :8], (0.0, 0.0), 0.1)
    often = pick(rng, (1.0, 0.3))

    def spoiled(message):
        return pick(rng, BINARY)(message, rng) if rng.random() < often else message

    if rng.random() < 0.3:
        return map_bag(version, grid, spoiled)
    return scan_bag(version, log, bool(rng.integers(2)), spoiled)


def read_bag(path):
    """The log of a bag, or its map where it holds no scan."""
    if path.is_dir() and len(list(path.iterdir())) == 1 and not (path / "metadata.yaml").exists():
        path = next(path.iterdir())
    log = pushed(read_any_log, path)
    grid = None if log is not None else pushed(read_any_map, path)
    if log is None and grid is None:
        read_log(path)  # which refuses it
    return log or grid


def use_bag(found, path, rng):
    """As a log or as a map."""
    if isinstance(found, OccupancyGrid):
        use_map(found, path, rng)
    else:
        use_log(found, path, rng)
        check_odometry(pushed(read_odometry, path))


# ---- tables of the study


def lines_of_study(name):
    """The lines of a table in the checkout."""
    import dollop.replication

    return (Path(dollop.replication.__file__).parents[2] / "study" / name).read_bytes().split(b"\n")


def study_tables():
    """A few rows of the study."""
    lines = lines_of_study("results.csv")
    wanted = [line for line in lines if line.split(b",")[1:2] in ([b"1000"], [b"1001"], [b"1002"])]
    rows = [line for line in wanted if line.split(b",")[0] in (b"loss", b"scaled", b"figure", b"kidnap")]
    return [{"results.csv": b"\n".join([lines[0], *rows, b""])}, {"results.csv": b"\n".join([lines[0], rows[0], b""])}]


def read_results(path):
    """The table of the study."""
    from dollop.replication import study

    return study.read_table(path)


def use_results(table, path, rng):
    """Sum up."""
    from dollop.replication import report

    found = pushed(report.summaries, table)
    if found is not None:
        pushed(report.verdicts_table, found)
        pushed(report.claims_page, found)
        json.dumps(found, allow_nan=False)


def world_tables():
    """A few rows of the study of worlds."""
    return [{"worlds.csv": b"\n".join([*lines_of_study("worlds.csv")[:12], b""])}]


def read_worlds(path):
    """The table of worlds."""
    from dollop.replication.worlds import survey

    return survey.read_table(path)


def use_worlds(table, path, rng):
    """Sum up."""
    from dollop.replication.worlds import survey

    found = pushed(survey.summary, table)
    if found is not None:
        json.dumps(found, allow_nan=False)
        survey.tables(found)
        survey.worst_seeds(table)


KINDS = {
    "carmen log": Kind(partial(carmen_logs, ".log"), read_any_log, use_log),
    "carmen log, packed": Kind(partial(carmen_logs, ".log.gz"), read_any_log, use_log),
    "carmen map": Kind(partial(carmen_maps, ".map"), read_any_map, use_map),
    "carmen map, packed": Kind(partial(carmen_maps, ".map.gz"), read_any_map, use_map),
    "ros map, pgm": Kind(partial(ros_maps, ".pgm"), read_any_map, use_map),
    "ros map, png": Kind(partial(ros_maps, ".png"), read_any_map, use_map),
    "task 2, anchored": Kind(partial(tasks, "anchored"), read_any_task, use_task),
    "task 2, paper": Kind(partial(tasks, "paper"), read_any_task, use_task),
    "task 1": Kind(partial(tasks, "1"), read_any_task, use_task),
    "scene": Kind(scenes, read_scene, use_scene),
    "recording": Kind(recordings, read_recording, use_recording),
    "ros 1 bag": Kind(partial(bags, "1"), read_bag, use_bag, "rosbags", partial(spoiled_bag, "1")),
    "ros 2 bag": Kind(partial(bags, "2"), read_bag, use_bag, "rosbags", partial(spoiled_bag, "2")),
    "mcap": Kind(partial(bags, "mcap"), read_bag, use_bag, "rosbags", partial(spoiled_bag, "mcap")),
    "study": Kind(study_tables, read_results, use_results, "dollop.replication"),
    "worlds": Kind(world_tables, read_worlds, use_worlds, "dollop.replication"),
}


def there():
    """The kinds that can be read here."""
    return [name for name, kind in KINDS.items() if kind.needs is None or find_spec(kind.needs)]


@cache
def seeds_of(name):
    """The valid files of a kind."""
    return KINDS[name].seeds()


def chance(name, seed, index, *more):
    """The generator of one piece of work."""
    return np.random.default_rng([seed, list(KINDS).index(name), index, *more])


def damaged_files(name, seed, index):
    """File `index` of a kind from a seed, {name: content}."""
    rng = chance(name, seed, index)
    if KINDS[name].anew and rng.random() < 0.3:
        return KINDS[name].anew(rng)
    seeds = seeds_of(name)
    files = dict(pick(rng, seeds))
    which = pick(rng, list(files))
    other = pick(rng, seeds).get(which)
    files[which] = damaged(which, files[which], rng, other)
    if len(files) > 1 and rng.random() < 0.02:
        del files[which]
    return files


def put(files, folder):
    """Write files into an empty folder; the path of the one to read, which for a bag of many files is their folder."""
    for name, content in files.items():
        place = Path(folder, name)
        place.parent.mkdir(exist_ok=True, parents=True)
        place.write_bytes(content)
    return Path(folder, next(iter(files), "gone").partition("/")[0])


def read_and_use(name, path, rng):
    """Read a file, and go on with what is accepted."""
    kind = KINDS[name]
    found = kind.read(path)
    kind.further(found, path, rng)


def one(piece, files=None):
    """Do one piece of work: (kind, seed, index); with other files if they are given."""
    files = files or damaged_files(*piece)
    with tempfile.TemporaryDirectory() as folder:
        read_and_use(piece[0], put(files, folder), chance(*piece, 1))
