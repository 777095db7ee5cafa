"""Routes as files: the published fields of Nav2's graphs and waypoints, and numbers to the last digit."""

import csv
import io
import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from dollop import Environment, Note, SequencedLDS, export
from dollop.formats.routes import COLUMNS, as_graph, as_table, as_waypoints
from dollop.route import TARGETS, Route
from dollop.trajectory import resample

BETWEEN, ROUND = [(0, 0), (6, 0)], [(0, 0), (1, 0), (1.6, 2.6), (4.4, 2.6), (6, 0)]
UNHEARD = 'a "walk" of\nAda: [é, \u2028 \U0001f916, \x07] # {that} \\ nobody: &saw *it'


def route_of(to, *points, pauses=None, notes=()):
    """The route of straight lines through points, one way each, as it is exported."""
    laws = tuple(SequencedLDS.fit(resample(np.array(each, float), 150), tolerance=0.05) for each in points)
    if pauses is not None:
        laws = tuple(SequencedLDS(law.segments, law.start, law.speeds, pauses=pauses) for law in laws)
    task = SimpleNamespace(law=laws[0], ways=laws, shown=range(len(laws), 0, -1), notes=notes)
    task.environment = Environment([[2.7, 0.7, 3.3, 1.9]])
    target = TARGETS[to]
    return Route.of(task, target.tolerance, target.spacing)


# ---- Nav2's route graph


def loaded(text):
    """What nav2_route makes of a graph: its README's required fields, and the types that its reader takes.

    An id is a whole number that is not negative, unique among nodes and edges; a cost is positive, or the planner
    refuses the edge; metadata are numbers, text, truth values, flat rows of these, and objects of all that.
    """
    content = json.loads(text, parse_constant=lambda name: pytest.fail(f"JSON has no {name}"))
    assert content["type"] == "FeatureCollection"
    nodes, edges, ids = {}, {}, []
    for feature in content["features"]:
        assert feature["type"] == "Feature" and set(feature) == {"type", "properties", "geometry"}
        properties, geometry = feature["properties"], feature["geometry"]
        ids.append(unsigned(properties["id"]))
        assert properties["operations"] == {}  # of which none waits, and unknown ones end the tracking
        check_metadata(properties["metadata"])
        if geometry["type"] == "Point":
            x, y = geometry["coordinates"]
            assert type(x) is type(y) is float and properties["frame"] == "map"
            assert set(properties) == {"id", "frame", "metadata", "operations"}
            nodes[properties["id"]] = (x, y), properties["metadata"]
        else:
            assert geometry["type"] == "MultiLineString"
            assert set(properties) - {"metadata", "operations"} == {"id", "startid", "endid", "cost", "overridable"}
            assert type(properties["cost"]) is float and properties["cost"] > 0 and properties["overridable"] is True
            edges[properties["id"]] = properties, geometry["coordinates"]
    assert len(set(ids)) == len(ids) and nodes and edges
    return nodes, edges, content["metadata"]


def unsigned(value):
    """A value, if it is an id."""
    assert type(value) is int and 0 <= value < 2**32
    return value


def check_metadata(metadata):
    """What nav2_route's reader does not take, it refuses, and the whole graph with it."""
    for name, value in metadata.items():
        assert isinstance(name, str)
        if isinstance(value, dict):
            check_metadata(value)
        else:
            rows = value if isinstance(value, list) else [value]
            assert all(isinstance(each, bool | int | float | str) for each in rows)


@pytest.mark.parametrize("points", [[BETWEEN], [ROUND], [BETWEEN, ROUND]])
def test_a_graph_has_the_published_fields(points):
    """Every edge leads between nodes that are there, along a straight line between where they are."""
    route = route_of("nav2", *points)
    nodes, edges, _ = loaded(as_graph(route))
    assert list(nodes) == list(range(len(route.places))) and len(edges) == len(route.edges)
    for properties, coordinates in edges.values():
        start, end = unsigned(properties["startid"]), unsigned(properties["endid"])
        assert coordinates == [[list(nodes[start][0]), list(nodes[end][0])]]


def test_a_graph_holds_the_route_to_the_last_digit():
    """Places, headings, waits, times, subgoals and speeds; lengths and speeds as floats, which plugins ask for."""
    route = route_of("nav2", ROUND, BETWEEN)
    nodes, edges, told = loaded(as_graph(route))
    np.testing.assert_array_equal([place for place, _ in nodes.values()], route.places)
    for name, known in (("heading", route.headings), ("wait", route.waits), ("t", route.t), ("way", route.ways)):
        np.testing.assert_array_equal([metadata[name] for _, metadata in nodes.values()], known)
    numbers = [metadata.get("number", -1) for _, metadata in nodes.values()]
    np.testing.assert_array_equal(numbers, route.subgoals)
    kinds = {"start": route.subgoals == 0, "subgoal": route.subgoals > 0, "between": route.subgoals < 0}
    for kind, known in kinds.items():
        np.testing.assert_array_equal([metadata["class"] == kind for _, metadata in nodes.values()], known)
    speeds = [properties["metadata"]["abs_speed_limit"] for properties, _ in edges.values()]
    np.testing.assert_array_equal(speeds, route.speeds)
    assert all(isinstance(speed, float) for speed in speeds)
    np.testing.assert_array_equal([properties["cost"] for properties, _ in edges.values()], route.lengths)
    assert told["deviation"] == route.deviation and told["clearance"] == route.clearance and told["trusted"] is True


def test_a_graph_tells_of_its_ways():
    """Where each begins and ends, its subgoals, how often it was shown and how far it shares another's beginning."""
    route = route_of("nav2", BETWEEN, ROUND)
    nodes, _, told = loaded(as_graph(route))
    first, second = told["ways"]
    assert first["startid"] == 0 and second["startid"] == first["endid"] + 1 and second["endid"] == len(nodes) - 1
    assert (first["shown"], second["shown"]) == (2, 1) and first["shared"] == 0 < second["shared"] < 2
    for way in (first, second):
        assert nodes[way["startid"]][1]["class"] == "start" and nodes[way["endid"]][1]["class"] == "subgoal"
        kinds = [metadata["class"] for _, metadata in list(nodes.values())[way["startid"] : way["endid"] + 1]]
        assert [way["startid"] + k for k, kind in enumerate(kinds) if kind == "subgoal"] == way["subgoals"]
    assert first["length"] == pytest.approx(6.0) and second["length"] > 9.0


def test_nodes_at_one_place_have_an_edge_with_a_cost():
    """Nav2 refuses an edge that costs nothing."""
    law = SequencedLDS.fit(resample(np.array(ROUND, float), 150), tolerance=0.05)
    subgoals = law.subgoals.copy()
    subgoals[1] = subgoals[0]
    route = Route.of(SimpleNamespace(law=law.with_subgoals(subgoals), environment=Environment(np.empty((0, 4)))))
    _, edges, told = loaded(as_graph(route))
    assert min(properties["cost"] for properties, _ in edges.values()) == 1e-3
    assert told["clearance"] is None  # there is no object


# ---- waypoints


def panel(waypoints):
    """What Nav2's panel in RViz makes of waypoints: poses (N, 3), as x, y in m and theta in rad, in their order."""
    poses = []
    for waypoint in waypoints.values():
        (x, y, z), quaternion = waypoint["pose"], waypoint["orientation"]
        assert all(isinstance(each, float) for each in (x, y, z, *quaternion)) and z == 0
        w, qx, qy, qz = quaternion
        assert qx == qy == 0 and np.hypot(w, qz) == pytest.approx(1)
        poses.append((x, y, np.arctan2(2 * w * qz, 1 - 2 * qz * qz)))
    return np.array(poses)


@pytest.mark.parametrize("points", [[BETWEEN], [ROUND], [ROUND, BETWEEN]])
def test_waypoints_are_what_the_panel_loads(points):
    """Named waypoints with pose and orientation; other ways are beside them, where the panel does not look."""
    route = route_of("waypoints", *points)
    content = yaml.safe_load(as_waypoints(route))
    assert content["frame_id"] == "map" and content["metadata"]["deviation"] == route.deviation
    ways = [content["waypoints"], *(each["waypoints"] for each in content.get("other_ways", ()))]
    assert len(ways) == len(points)
    for way, waypoints in enumerate(ways):
        mine = route.ways == way
        poses = panel(waypoints)
        np.testing.assert_array_equal(poses[:, :2], route.places[mine])
        np.testing.assert_allclose(poses[:, 2], route.headings[mine], atol=1e-9)
        assert list(waypoints) == [f"waypoint{k}" for k in range(mine.sum())]
        np.testing.assert_array_equal([each["t"] for each in waypoints.values()], route.t[mine])
        np.testing.assert_array_equal([each.get("number", -1) for each in waypoints.values()], route.subgoals[mine])


def test_waypoints_wait():
    """The seconds that were stood at the start and at the end."""
    content = yaml.safe_load(as_waypoints(route_of("waypoints", BETWEEN, pauses=[1.5, 2.0])))
    assert [each["wait"] for each in content["waypoints"].values()] == [1.5, 2.0]


@pytest.mark.parametrize("number", [1e-7, 1e16, -1.5e-300, 123456789.125, 0.1, -0.0])
def test_numbers_of_yaml_are_numbers(number):
    """YAML takes 1e-07 for text: it has no dot."""
    places = np.array([[0.0, 0.0], [1.0, 0.0]])
    given = {"headings": [0, 0], "waits": [abs(number), 0], "t": [0, 1], "subgoals": [0, 1], "segments": [0, 0]}
    route = Route(places, **given, ways=[0, 0], shown=(1,), shared=(0,), deviation=0)
    read = yaml.safe_load(as_waypoints(route))["waypoints"]["waypoint0"]["wait"]
    assert isinstance(read, float) and read == abs(number)


# ---- the table


def test_a_table_is_the_path_every_few_centimetres():
    """Its columns, in the order in which it is driven, at most five centimetres apart and a millimetre off."""
    route = route_of("csv", ROUND, BETWEEN)
    table = pd.read_csv(io.StringIO(as_table(route)), comment="#", dtype=str)
    assert tuple(table.columns) == COLUMNS
    table = table.astype(dict.fromkeys(COLUMNS, float) | {"way": int, "segment": int})
    np.testing.assert_array_equal(table[["x", "y"]], route.places)
    np.testing.assert_array_equal(table[["t", "theta", "wait"]].T, [route.t, route.headings, route.waits])
    np.testing.assert_array_equal(table[["way", "segment"]].T, [route.ways, route.segments])
    for _, way in table.groupby("way"):
        steps = np.hypot(*np.diff(way[["x", "y"]], axis=0).T)
        assert steps.max() <= 0.05 and (np.diff(way["t"]) > 0).all() and way["speed"].iloc[-1] == 0
        np.testing.assert_allclose(steps / way["speed"][:-1], np.diff(way["t"]), rtol=1e-6)
    assert route.deviation <= 1e-3


def test_a_table_is_read_without_pandas():
    """Lines that begin with # come first; what follows is a table of the plainest kind."""
    lines = as_table(route_of("csv", BETWEEN)).splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert float(rows[-1]["x"]) == pytest.approx(6.0) and all(len(row) == len(COLUMNS) for row in rows)
    assert all(line.startswith("#") for line in lines[: lines.index(",".join(COLUMNS))])


def test_waits_are_in_the_table():
    """The times after a wait are later by it: the row tells when it is arrived at, and how long is stood."""
    rows = pd.read_csv(io.StringIO(as_table(route_of("csv", BETWEEN, pauses=[1.5, 2.0]))), comment="#")
    assert rows["wait"].iloc[[0, -1]].tolist() == [1.5, 2.0] and rows["t"].iloc[0] == 0 and rows["t"].iloc[1] > 1.5


# ---- notes


@pytest.mark.parametrize("to", TARGETS)
def test_notes_of_any_text_are_read_back(tmp_path, to):
    """Quotes, brackets, line ends and what cannot be printed: in one line of each format, as text."""
    path = tmp_path / f"a{TARGETS[to].suffixes[0]}"
    law = SequencedLDS.fit(resample(np.array(BETWEEN, float), 150))
    environment = Environment(np.empty((0, 4)))
    export(SimpleNamespace(law=law, environment=environment, notes=(Note("part", UNHEARD),)), path, to)
    text = path.read_text(encoding="utf-8")
    if to == "csv":
        assert len(pd.read_csv(path, comment="#")) > 100
        (told,) = [line.removeprefix("# note: ") for line in text.splitlines() if line.startswith("# note: ")]
    else:
        content = {"nav2": json.loads, "waypoints": yaml.safe_load}[to](text)["metadata"]
        assert content["trusted"] is False
        (told,) = content["notes"]
    assert told.startswith('part: a "walk" of Ada: [é, ') and told.endswith("# {that} \\ nobody: &saw *it")
