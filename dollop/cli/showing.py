"""dollop show: what a file holds, told by its content, as a picture and in five lines."""

import csv
from functools import partial
from pathlib import Path

import numpy as np

import dollop
from dollop.checks import checked_array
from dollop.cli.learning import as_data, as_lines, performing
from dollop.cli.naming import check_written, named, unused
from dollop.cli.performing import ended, verdict_of
from dollop.cli.picturing import of_run, of_task, write_picture
from dollop.cli.telling import Result, busy, command, tell
from dollop.cli.watching import check_kind, load_map, map_files
from dollop.formats import kinds
from dollop.formats.files import FormatError, from_file, read_bytes, read_json, read_lines
from dollop.trajectory import arc_length

__all__ = ["run"]

MOST_POINTS = 60_000
"""Readings of a log that are drawn, of scans at equal distances: more look the same."""
MOST_YAML, MOST_VALUES = 8 << 20, 1_000_000
"""Bytes and values of waypoints that are read."""
TABLES = kinds.TRAJECTORY, kinds.EVERYBODY, kinds.TRUTH
PAIRS = ("x", "y"), ("object_x", "object_y"), ("laser_x", "laser_y")
"""Columns of tables that are positions."""


def run(options):
    """Show, dollop show ANYTHING --out PICTURE.png.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        For a file that holds nothing that is known, or a picture.
    """
    out = named(options.out, ".png", holds="a picture")
    maps = [] if options.map is None else map_files(options.map, "FILE", options.file)
    check_written([], [options.file, *maps], out, options.file)
    shown = _shower(options.file)
    background = None if options.map is None else load_map(options.map)
    with busy(f"reading {options.file}"):
        draw, lines, notes, data, then = shown(options.file, options, background)
    write_picture(out, draw)
    tell(Result(lines, (out,), then, notes, {"file": options.file, **data}), options.json)


def _shower(path):
    """What shows a file."""
    known = {
        kinds.CARMEN_LOG: _log,
        kinds.BAG: _log,
        kinds.CARMEN_MAP: _map,
        kinds.ROS_MAP: _map,
        kinds.TASK: _task,
        kinds.RUN: _run,
        kinds.SCENE: _scene,
        **dict.fromkeys(TABLES, _table),
    }
    routes = {"ROUTE_GRAPH": _graph, "WAYPOINTS": _waypoints, "PATH_TABLE": _path}
    known |= {getattr(kinds, name): show for name, show in routes.items() if hasattr(kinds, name)}
    check_kind("what is shown", path, list(known))
    found = kinds.kind_of(path)
    if found is None:
        names = ", ".join(each.name for each in known)
        raise FormatError(f"what is shown must be one of {names}; it is none of them", path)
    return known[found]


# ---- each kind: what draws it, five lines less the last, notes, data, what is next


def _log(path, options, background):
    log = dollop.read_log(path, options.topic, options.fov)
    scans, beams = log.ranges.shape
    seconds, returned = log.t[-1] - log.t[0], np.isfinite(log.ranges)
    walked = arc_length(log.poses[:, :2])[-1]
    (x0, y0), (x1, y1) = log.poses[[0, -1], :2]
    rate = (scans - 1) / seconds if seconds else 0.0
    fov = np.degrees(log.angles[-1] - log.angles[0])
    lines = (
        f"{path}: a log of {scans} scans in {seconds:.1f} s, {rate:.1f} a second",
        f"{beams} beams over {fov:.0f} degrees, {returned.mean():.0%} return within {log.max_range:g} m",
        f"the laser moved {walked:.1f} m, from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) m",
        f"time stamps from {_stamp(log.t[0])} to {_stamp(log.t[-1])} s",
    )
    data = {"kind": "log", "scans": scans, "beams": beams, "seconds": seconds, "fov": fov}
    data |= {"max_range": log.max_range, "moved": walked, "begin": log.t[0], "end": log.t[-1]}
    if options.map is None:
        then = command("map", path, unused("room.yaml", ".pgm", ".png"))
    else:
        then = command("observe", path, options.map, "--out", unused("user.csv", ".png"))
    return partial(_draw_log, log=log, background=background), lines, log.notes, data, then


def _draw_log(ax, log, background):
    """Readings in the world, early ones pale and late ones dark, and where the laser was."""
    from dollop import plot
    from dollop.foreground import endpoints

    if background is not None:
        plot.grid_map(ax, background)
    every = max(1, np.isfinite(log.ranges).sum() // MOST_POINTS)
    rows, beams = np.nonzero(np.isfinite(log.ranges[::every]))
    points, since = endpoints(log)[::every][rows, beams], log.t[::every][rows] - log.t[0]
    drawn = ax.scatter(*points.T, s=2, c=since, cmap=plot.LATER, vmin=0, linewidths=0)
    ax.figure.colorbar(drawn, ax=ax, label="time in the log [s]", shrink=0.6)
    ax.plot([], [], "o", color=plot.USER, markersize=3, label="readings")
    plot.path(ax, log.poses, "way of the laser", plot.RUN, marker=".", markersize=3)
    plot.robot(ax, log.poses[0], label="laser at the beginning")


def _map(path, options, background):
    grid = dollop.OccupancyGrid.load(path)
    (rows, columns), side = grid.occupancy.shape, grid.resolution
    x, y = grid.origin
    lines = (
        f"{path}: a map of {columns} x {rows} cells of {side:g} m",
        f"{columns * side:.1f} m x {rows * side:.1f} m, from ({x:.2f}, {y:.2f}) m at the lower left",
        f"{grid.free.mean():.0%} free, {grid.occupied.mean():.0%} occupied, the rest unknown",
        f"{grid.free.sum() * side**2:.1f} m^2 of free floor",
    )
    data = {
        "kind": "map",
        "columns": columns,
        "rows": rows,
        "resolution": side,
        "origin": grid.origin,
    }

    def draw(ax):
        from dollop import plot

        plot.whole_map(ax, grid)

    return draw, lines, (), data, command("learn", "--help")


def _task(path, options, background):
    task = dollop.Task.load(path)
    shown, law = task.demonstrations, task.law
    ways = f", in {len(task.ways)} ways" if len(task.ways) > 1 else ""
    (x0, y0), (x1, y1) = law.start, law.subgoals[-1]
    doubts = sum(note.doubt for note in task.notes)
    lines = (
        f"{path}: a task, shown {len(shown)} x{ways}",
        *as_lines(task),
        f"from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) m, in {law.timed()[0][-1]:.1f} s",
        f"{len(task.notes)} notes, {doubts} of them put it in doubt",
    )
    if options.map is None:
        new = unused(Path(path).with_name(f"{Path(path).stem}_path.csv"))
        then = command("export", path, "--to", "csv", "--out", new)
    else:
        then = performing(path, options.map)
    return of_task(task, background), lines, task.notes, {"kind": "task", **as_data(task)}, then


def _run(path, options, background):
    from dollop.robot.tables import load_run

    done = load_run(path)
    known = done.clearance[np.isfinite(done.clearance)]
    least = f"{known.min():.2f} m" if len(known) else "not known"
    lines = (
        f"{path}: a run of {len(done.t)} periods, {done.t[-1]:.1f} s",
        ended(done),
        f"{done.collisions} contacts by the map, least clearance {least}",
        f"kidnapped {len(done.kidnapped)} x; localised {done.localised.mean():.0%} of the time",
    )
    data = {"kind": "run", **verdict_of(done)}
    return of_run(done, None, background), lines, (), data, command("perform", "--help")


def _scene(path, options, background):
    from dollop import plot
    from dollop.lab import Scene, walks_of

    scene = Scene.load(path)
    walks = walks_of(scene)
    (x0, y0), (x1, y1) = np.min(scene.room.corners, axis=0), np.max(scene.room.corners, axis=0)
    walked = f", the first walks {arc_length(walks[0].positions)[-1]:.1f} m" if walks else ""
    x, y, theta = scene.robot.pose
    lines = (
        f"{path}: a scene of the laboratory",
        f"a room of {x1 - x0:.1f} m x {y1 - y0:.1f} m, {len(scene.room.furniture)} parts of furniture",
        f"{len(scene.objects)} objects, {len(scene.moves)} of them moved; {len(walks)} people{walked}",
        f"the robot watches from ({x:.2f}, {y:.2f}) m, {np.degrees(theta):.0f} degrees",
    )
    data = {"kind": "scene", "objects": len(scene.objects), "people": len(walks)}
    return (
        partial(plot.scene, scene=scene, walks=walks),
        lines,
        (),
        data,
        command("learn", "--help"),
    )


def _table(path, options, background):
    columns = _columns(path)
    t = columns["t"]
    pairs = [(x[: -len("x")].rstrip("_"), x, y) for x, y in PAIRS if x in columns and y in columns]
    walks = {name or "trajectory": np.stack([columns[x], columns[y]], 1) for name, x, y in pairs}
    if "person" in columns:
        whole, who = walks["trajectory"], columns["person"]
        walks = {f"person {k:.0f}": whole[who == k] for k in np.unique(who)}
    told = (f"{name} {arc_length(places)[-1]:.1f} m" for name, places in walks.items())
    first = next(iter(walks.values()), np.empty((0, 2)))
    if not len(first):
        raise FormatError("a trajectory must have columns x and y, and a row", path)
    (x0, y0), (x1, y1) = first[0], first[-1]
    lines = (
        f"{path}: a table of {len(t)} rows with {', '.join(columns)}",
        f"from {_stamp(t[0])} to {_stamp(t[-1])} s, {t[-1] - t[0]:.1f} s",
        f"walked: {', '.join(told)}",
        f"the first from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) m",
    )
    data = {"kind": "trajectory", "rows": len(t), "begin": t[0], "end": t[-1]}
    draw = partial(_draw_walks, walks=walks, background=background)
    return draw, lines, (), data, command("learn", "--help")


def _stamp(t):
    """A time stamp with all of its digits."""
    return repr(float(t))


def _columns(path):
    """The columns of a table of numbers, by name."""
    lines = (line.decode("utf-8", "replace") for line in read_lines(path))
    names, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    try:
        numbers = [list(map(_number, row)) for row in rows]
        return dict(zip(names, np.array(numbers, float).reshape(-1, len(names)).T, strict=True))
    except ValueError:
        raise FormatError(f"a row must have a number for each of {','.join(names)}", path) from None


def _number(text):
    """A number or a truth value of a table."""
    return float({"True": "1", "False": "0", "": "nan"}.get(text, text))


def _draw_walks(ax, walks, background):
    """Trajectories by name, and where each begins."""
    from dollop import plot

    if background is not None:
        plot.grid_map(ax, background)
    colours = plot.USER, plot.OBSTACLE, plot.RUN, plot.LAW, plot.OCCLUDED, plot.TRUTH
    for k, (name, places) in enumerate(walks.items()):
        colour = colours[k % len(colours)]
        plot.path(ax, places, name, colour)
        ax.plot(*places[0], "o", color=colour, markersize=6, label="begin" if k == 0 else None)


# ---- routes


def _graph(path, options, background):
    nodes = from_file(path, _of_written, _graph_nodes, read_json(path, "a route graph"))
    return _route(path, nodes, background)


def _graph_nodes(content):
    """Places and metadata of a route graph's points."""
    points = [each for each in content["features"] if each["geometry"]["type"] == "Point"]
    return [(each["geometry"]["coordinates"], each["properties"]["metadata"]) for each in points]


def _waypoints(path, options, background):
    import yaml

    content = read_bytes(path, MOST_YAML)
    from_file(path, _check_yaml, content)
    nodes = from_file(path, _of_written, _waypoint_nodes, yaml.safe_load(content))
    return _route(path, nodes, background)


def _check_yaml(content):
    """Refuse a YAML that grows as it is read, before it is."""
    from dollop.formats.plain_yaml import plain_nodes

    for _ in plain_nodes(content, MOST_VALUES):
        pass


def _waypoint_nodes(content):
    """Places and what else is told of the waypoints of all ways."""
    ways = [content["waypoints"], *(each["waypoints"] for each in content.get("other_ways", []))]
    for k, way in enumerate(ways):
        for node in way.values():
            yield node["pose"][:2], {"wait": node["wait"], "way": k}


def _path(path, options, background):
    return _route(path, from_file(path, _of_written, _path_nodes, _columns(path)), background)


def _path_nodes(columns):
    """Places, waits and ways of a path."""
    rows = zip(columns["x"], columns["y"], columns["wait"], columns["way"], strict=True)
    return [((x, y), {"wait": wait, "way": way}) for x, y, wait, way in rows]


def _of_written(read, content):
    """What is read of a route that was written by `dollop.export`: places (N, 2), waits and ways (N,)."""
    try:
        nodes = list(read(content))
        columns = [(*place[:2], told["wait"], told["way"]) for place, told in nodes]
    except (AttributeError, IndexError, KeyError, TypeError) as error:
        raise ValueError(f"no route as dollop export writes it: {type(error).__name__} {error}") from None
    columns = checked_array("the nodes of a route", columns, "N", 4)
    if not len(columns):
        raise ValueError("a route must have a node, got none")
    return columns[:, :2], columns[:, 2], columns[:, 3].astype(int)


def _route(path, nodes, background):
    """A route by the places (N, 2) of its nodes in m, their waits in s and their ways."""
    places, waits, ways = nodes
    waits = waits[waits > 0].tolist()
    parts = {f"way {k}": places[ways == k] for k in np.unique(ways)}
    (x0, y0), (x1, y1) = next(iter(parts.values()))[[0, -1]]
    lengths = [f"{arc_length(part)[-1]:.1f} m" for part in parts.values()]
    lines = (
        f"{path}: a route of {len(places)} places",
        f"ways of {', '.join(lengths)}, the one most often shown first",
        f"from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) m",
        f"waits: {', '.join(f'{wait:.1f} s' for wait in waits) or 'none'}",
    )
    data = {"kind": "route", "places": len(places), "waits": waits}
    return (
        partial(_draw_route, parts=parts, background=background),
        lines,
        (),
        data,
        command("export", "--help"),
    )


def _draw_route(ax, parts, background):
    """Ways with their nodes."""
    from dollop import plot

    if background is not None:
        plot.grid_map(ax, background)
    for k, (name, places) in enumerate(parts.items()):
        look = {"linestyle": "--"} if k else {}
        look |= {"marker": ".", "markersize": 5, "markerfacecolor": "black"}
        plot.path(ax, places, name, plot.LAW, **look)
        label = None if k else "begin"
        ax.plot(*places[0], "o", color=plot.LAW, markeredgecolor="black", label=label)
