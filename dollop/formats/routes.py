"""Routes as files that others read: a graph of Nav2, waypoints in YAML, a path as a table.

The graph is the GeoJSON of Nav2's Route Server (nav2_route: its README, `GeoJsonGraphFileLoader`),
the waypoints are those that Nav2's panel in RViz saves and loads (nav2_rviz_plugins).
"""

import json
from itertools import groupby
from operator import itemgetter

import numpy as np

from dollop.checks import shortened

__all__ = ["COLUMNS", "FRAME", "as_graph", "as_table", "as_waypoints"]

FRAME = "map"
"""The frame that places are in (REP 105): that of the map that the log was taken on."""
COLUMNS = "way", "t", "x", "y", "theta", "speed", "wait", "segment"
CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}
"""What graphs of Nav2 state, so that QGIS takes their coordinates for metres."""
LEAST_COST = 1e-3
"""m: Nav2 refuses an edge without a cost, and two nodes may be at one place."""
LONGEST_NOTE = 1000


def as_graph(route):
    """A route as the GeoJSON of Nav2's Route Server (beyond the paper).

    Nodes are features of type Point, edges of type MultiLineString, one way and straight. Their
    properties are those of nav2_route: `id`, unique among both, `frame`, `startid`, `endid`, `cost`
    (the length in m), `overridable`, `metadata` and `operations`. There is no operation, since Nav2
    ships none that waits, and refuses to track a route with one that it does not know. Metadata are
    numbers, text, truth values and rows of them, for others are refused.

    Parameters
    ----------
    route : Route

    Returns
    -------
    str
        A feature on each line. `metadata` of the whole tells `deviation`, `notes` and `ways`.
    """
    node_ids = np.arange(len(route.places))
    features = [*map(_node_feature, _nodes(route)), *_edge_features(route, len(node_ids))]
    whole = {"type": "FeatureCollection", "name": "dollop route", "crs": CRS}
    whole["metadata"] = {"frame": FRAME, **_told_of(route)}
    fields = [f"  {json.dumps(name)}: {_json(value)}" for name, value in whole.items()]
    lines = ",\n".join(f"    {_json(each)}" for each in features)
    return "{\n" + ",\n".join(fields) + ',\n  "features": [\n' + lines + "\n  ]\n}\n"


def as_waypoints(route):
    """A route as poses in YAML, as Nav2's panel in RViz loads waypoints (beyond the paper).

    Under `waypoints` each has a name, and under it `pose` x, y, z in m and `orientation`, a unit
    quaternion w, x, y, z. What the panel passes over is beside it: `class`, `number` of the
    subgoal, `wait` in s, and `t` in s. The way shown most often is under `waypoints`, the others under
    `other_ways`.

    Parameters
    ----------
    route : Route

    Returns
    -------
    str
        For `yaml.safe_load`, or any reader of YAML.
    """
    told = _told_of(route)
    lines = [
        "# Dollop route: waypoints, as Nav2's panel in RViz loads them.",
        "# pose: x, y, z in m; orientation: quaternion w, x, y, z; wait and t in s.",
        f"frame_id: {FRAME}",
        "metadata:",
        *(f"  {name}: {_yaml(told[name])}" for name in ("deviation", "clearance", "trusted")),
        *_yaml_rows("  notes", told["notes"]),
    ]
    for way, nodes in groupby(_nodes(route), key=itemgetter("way")):
        if way == 1:
            lines.append("other_ways:")
        head = [f"  - way: {way}", f"    shown: {route.shown[way]}"] if way else []
        indent = "    " if way else ""
        lines += [*head, *(indent + line for line in ["waypoints:", *_waypoints(nodes)])]
    return "\n".join(lines) + "\n"


def as_table(route):
    """A route as a table of its nodes, comma-separated (beyond the paper).

    Lines that begin with # come first: `pandas.read_csv(path, comment="#")`. The columns are

    way      the way among those of the task, the one shown most often first
    t        s from the beginning of the way to the arrival at the place
    x, y     m, in the frame `map`
    theta    rad, the direction in which the way arrives; at its start, in which it leaves
    speed    m/s, shown from here to the next place; 0 at the end of the way
    wait     s that is stood at the place
    segment  the segment of the law that leads to it

    Parameters
    ----------
    route : Route

    Returns
    -------
    str
        A row for each node.
    """
    told = _told_of(route)
    lines = [
        f"# Dollop route: {', '.join(COLUMNS)}, in m, rad, s and m/s, in the frame {FRAME}.",
        *(f"# {name}: {_json(told[name])}" for name in ("deviation", "clearance", "trusted")),
        *(f"# note: {note}" for note in told["notes"]),
        ",".join(COLUMNS),
    ]
    speeds = np.zeros(len(route.places))
    speeds[route.edges[:, 0]] = route.speeds
    columns = (
        route.ways,
        route.t,
        *route.places.T,
        route.headings,
        speeds,
        route.waits,
        route.segments,
    )
    rows = zip(*(each.tolist() for each in columns), strict=True)
    return "\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n"


def _told_of(route):
    """What is told of the whole, of JSON's kinds."""
    ends = np.flatnonzero(np.diff(route.ways, append=-1))
    starts = np.concatenate([[0], ends[:-1] + 1])
    spans = zip(starts.tolist(), ends.tolist(), route.shown, route.shared, strict=True)
    return {
        "deviation": route.deviation,
        "clearance": None if np.isinf(route.clearance) else route.clearance,
        "trusted": route.trusted,
        "notes": [shortened(str(note), LONGEST_NOTE) for note in route.notes],
        "ways": [_way_told(route, way, *span) for way, span in enumerate(spans)],
    }


def _way_told(route, way, first, last, shown, shared):
    """One way, by the ids of its nodes."""
    numbers = route.subgoals[first : last + 1]
    return {
        "way": way,
        "shown": shown,
        "startid": first,
        "endid": last,
        "subgoals": (first + np.flatnonzero(numbers > 0)).tolist(),
        "length": float(route.lengths[first - way : last - way].sum()),
        "seconds": float(route.t[last] + route.waits[last]),
        "shared": shared,
    }


def _nodes(route):
    """The nodes, each a dict of plain values."""
    columns = route.ways, route.subgoals, route.places, route.headings, route.waits, route.t
    rows = zip(*(each.tolist() for each in columns), strict=True)
    for index, (way, number, place, heading, wait, t) in enumerate(rows):
        kind = "between" if number < 0 else "subgoal" if number else "start"
        numbered = {} if number < 0 else {"number": number}
        timed = {"heading": heading, "wait": wait, "t": t}
        yield {"id": index, "place": place, "way": way, "class": kind, **numbered, **timed}


def _node_feature(node):
    """A node as nav2_route reads it."""
    metadata = {name: value for name, value in node.items() if name not in ("id", "place")}
    properties = {"id": node["id"], "frame": FRAME, "metadata": metadata, "operations": {}}
    return _feature(properties, "Point", node["place"])


def _edge_features(route, first_id):
    """The edges as nav2_route reads them."""
    numbers = zip(route.edges.tolist(), route.lengths.tolist(), route.speeds.tolist(), strict=True)
    for index, ((start, end), length, speed) in enumerate(numbers, first_id):
        metadata = {"way": int(route.ways[end]), "segment": int(route.segments[end])}
        metadata |= {"length": length, "abs_speed_limit": speed}
        properties = {"id": index, "startid": start, "endid": end, "cost": max(length, LEAST_COST)}
        properties |= {"overridable": True, "metadata": metadata, "operations": {}}
        yield _feature(properties, "MultiLineString", [route.places[[start, end]].tolist()])


def _feature(properties, kind, coordinates):
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _waypoints(nodes):
    """The lines of the waypoints of one way."""
    for index, node in enumerate(nodes):
        half, wait, t = node["heading"] / 2, node["wait"], node["t"]
        yield f"  waypoint{index}:"
        yield f"    pose: {_yaml([*node['place'], 0.0])}"
        yield f"    orientation: {_yaml([float(np.cos(half)), 0.0, 0.0, float(np.sin(half))])}"
        yield f"    class: {node['class']}"
        if "number" in node:
            yield f"    number: {node['number']}"
        yield f"    wait: {_yaml(wait)}"
        yield f"    t: {_yaml(t)}"


def _yaml_rows(name, texts):
    """A sequence of texts, on lines of their own."""
    if not texts:
        return [f"{name}: []"]
    return [f"{name}:", *(f"    - {json.dumps(text, ensure_ascii=False)}" for text in texts)]


def _yaml(value):
    """Numbers, rows of them, truth values and None: without a dot YAML takes a float for text."""
    if isinstance(value, list):
        return f"[{', '.join(map(_yaml, value))}]"
    text = _json(value)
    return text.replace("e", ".0e") if isinstance(value, float) and "." not in text else text


def _json(value):
    """JSON, which knows neither infinity nor NaN."""
    return json.dumps(value, allow_nan=False)
