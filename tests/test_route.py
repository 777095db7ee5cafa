"""Routes: within a centimetre of the law's way in both directions, all its subgoals and waits, and nothing silently."""

import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from walks import any_walk

import dollop
from dollop import Demonstration, Environment, Matching, Note, Route, SequencedLDS, Task, export, learn
from dollop.formats.files import FormatError
from dollop.route import TARGETS, TOLERANCE, chosen, export_outputs
from dollop.trajectory import arc_length, distance_to_polyline, resample

TABLES = [[2.7, 0.7, 3.3, 1.9], [2.7, -5.0, 3.3, -0.7]]
BETWEEN, ROUND = [(0, 0), (6, 0)], [(0, 0), (1, 0), (1.6, 2.6), (4.4, 2.6), (6, 0)]


def walk(points, samples=150):
    """A law of straight lines through points, in order."""
    return SequencedLDS.fit(resample(np.array(points, float), samples), tolerance=0.05)


def task(*ways, shown=None, **more):
    """What a route is made of, by hand: laws among two tables."""
    known = {"law": ways[0], "ways": ways, "environment": Environment(TABLES)}
    return SimpleNamespace(**known | {"shown": shown or (1,) * len(ways)} | more)


def stopped_task():
    """Learned: two metres at a metre per second, three seconds there, and a metre on at half of it."""
    x = np.concatenate([np.arange(0, 2, 0.1), np.full(31, 2.0), np.arange(2.05, 3.01, 0.05)])
    corner = np.column_stack([x.clip(max=2.0), (x - 2).clip(0)])
    return Task.of(Demonstration(corner, Environment([[3, 0, 4, 1]])))


def drawn(seed):
    """A task drawn at random, learned from two walks, in two ways for every third; adapted to another layout if odd."""
    tasks = pytest.importorskip("dollop.lab.tasks")
    rng, count = np.random.default_rng(seed), 5
    meant, layouts = tasks.draw_task(count, rng), tasks.draw_layouts(count, 3, rng)
    walks = [(meant, centres) for centres in layouts[:2]]
    walks += [(tasks.other_way(meant, rng), layouts[0])] if seed % 3 == 0 else []
    shown = [Demonstration(tasks.walked(each, where, rng), meant.environment(where)) for each, where in walks]
    same = Matching.of_partners(np.arange(count))
    learned = learn(shown, matchings=[same] * len(shown))
    return learned.adapt(meant.environment(layouts[2]), same) if seed % 2 else learned


def dense(places, step=0.001):
    """Places of a polyline, so far apart at most."""
    counts = np.ceil(np.hypot(*np.diff(places, axis=0).T) / step).astype(int).clip(1)
    at = np.concatenate([[0], np.cumsum(counts)])
    return np.column_stack([np.interp(np.arange(at[-1] + 1), at, column) for column in places.T])


def both_ways(one, other):
    """Largest distance from a place of each of two sets (N, 2), (M, 2) to the nearest of the other."""
    return max(cKDTree(one).query(other)[0].max(), cKDTree(other).query(one)[0].max())


# ---- how near it is


@pytest.mark.parametrize("seed", range(6))
def test_no_place_is_farther_than_told(seed):
    """Both the edges and the held response, densely sampled: neither leaves the other by more, nor by a centimetre."""
    done = drawn(seed)
    route = Route.of(done)
    found = []
    for way, law in enumerate(done.ways):
        response, nodes = law.response(), route.places[route.ways == way]
        spans = cdist(nodes, response).argmin(axis=1)
        assert (np.diff(spans) > 0).all() and not cdist(nodes, response)[range(len(nodes)), spans].max() > 1e-9
        for k, (i, j) in enumerate(zip(spans[:-1], spans[1:], strict=True)):
            found.append(both_ways(dense(nodes[k : k + 2]), dense(response[i : j + 1])))
        assert both_ways(dense(nodes, 0.005), dense(response, 0.005)) <= route.deviation + 0.005
    assert max(found) == pytest.approx(route.deviation, abs=1e-3) and 0 < route.deviation <= TOLERANCE


@given(walk=any_walk, tolerance=st.floats(1e-3, 5.0), spacing=st.floats(0.1, 100.0))
def test_the_rule_keeps_any_tolerance(walk, tolerance, spacing):
    """Of any walk, however it turns back: every vertex is within the tolerance of its own edge, and the ends stay."""
    nodes = chosen(walk, tolerance, spacing)
    assert nodes[0] == 0 and nodes[-1] == len(walk) - 1 and (np.diff(nodes) > 0).all()
    way = arc_length(walk)
    for i, j in zip(nodes[:-1], nodes[1:], strict=True):
        assert distance_to_polyline(walk[i : j + 1], walk[[i, j]]).max() <= tolerance
        assert way[j] - way[i] <= spacing or j == i + 1


def test_a_straight_line_is_one_edge():
    """Nothing is divided that is straight, and a bend is divided finer for a smaller tolerance."""
    assert chosen(np.linspace([0, 0], [6.0, 2.0], 100), 1e-6).tolist() == [0, 99]
    turn = np.linspace(0, np.pi, 500)
    arc = np.column_stack([np.cos(turn), np.sin(turn)])
    fine, coarse = (len(chosen(arc, tolerance)) - 1 for tolerance in (0.0025, 0.01))
    assert coarse >= np.pi / np.sqrt(8 * 0.01) and fine == 2 * coarse  # a sagitta is c^2 / 8


# ---- what it holds


@pytest.mark.parametrize("seed", range(4))
def test_every_subgoal_is_a_node(seed):
    """The start and all subgoals of each way, to the last digit and in order, and each segment leads to its own."""
    done = drawn(seed)
    route = Route.of(done)
    for way, law in enumerate(done.ways):
        mine = (route.ways == way) & (route.subgoals >= 0)
        np.testing.assert_array_equal(route.places[mine], [law.start, *law.subgoals])
        np.testing.assert_array_equal(route.subgoals[mine], np.arange(len(law.segments) + 1))
        np.testing.assert_array_equal(route.segments[mine], [0, *range(len(law.segments))])
    assert (np.diff(route.ways[route.edges]) == 0).all() and len(route.edges) == len(route.places) - len(done.ways)


def test_waits_and_times_are_those_of_the_law():
    """Who stood three seconds makes a node that waits so long; places come when `SequencedLDS.timed` has them."""
    done = stopped_task()
    route, (t, positions) = Route.of(done), done.law.timed(0.01)
    np.testing.assert_allclose(route.waits[route.subgoals >= 0], done.law.pauses)
    assert 2.5 < route.waits.sum() < 3.5 and not route.waits[route.subgoals < 0].any()
    there = np.column_stack([np.interp(route.t, t, column) for column in positions.T])
    assert np.abs(there - route.places).max() < 0.02
    assert route.t[-1] + route.waits[-1] == pytest.approx(t[-1], abs=0.01)
    stop = int(route.waits.argmax())
    before, after = (route.edges[:, 1] <= stop), (route.edges[:, 0] >= stop)
    took = route.lengths / route.speeds
    assert route.lengths[before].sum() / took[before].sum() == pytest.approx(1.0, abs=0.1)
    assert route.lengths[after].sum() / took[after].sum() == pytest.approx(0.5, abs=0.05)


def test_headings_are_directions_of_the_way():
    """At a corner the way arrives along x and goes on along y; at the start it leaves. A full turn meets itself."""
    route = Route.of(stopped_task())
    stop = int(route.waits.argmax())
    assert np.degrees(route.headings[[0, stop, -1]]) == pytest.approx([0, 0, 90], abs=3)
    turn = np.linspace(0, 2 * np.pi, 200)
    circle = Route.of(task(SequencedLDS.fit(np.column_stack([np.cos(turn), np.sin(turn)]))))
    radial = np.arctan2(circle.places[1:-1, 1], circle.places[1:-1, 0])
    off = (circle.headings[1:-1] - radial - np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    assert np.degrees(np.abs(off)).max() < 12 and (np.abs(circle.headings) <= np.pi).all()


@pytest.mark.skipif(not hasattr(SequencedLDS, "headings"), reason="laws do not tell their headings")
@pytest.mark.parametrize("seed", range(4))
def test_headings_are_those_that_the_law_tells(seed):
    """At the start and at every subgoal of each way."""
    done = drawn(seed)
    route = Route.of(done)
    told = np.concatenate([law.headings for law in done.ways])
    off = np.angle(np.exp(1j * (route.headings[route.subgoals >= 0] - told)))
    assert np.abs(off).max() < 1e-6


def test_ways_that_begin_together_say_how_far():
    """Two ways: nodes of each, no edge between them, and the metre that they share with what walks may differ."""
    route = Route.of(task(walk(BETWEEN), walk(ROUND), shown=(3, 1)))
    assert route.shown == (3, 1) and np.unique(route.ways).tolist() == [0, 1]
    assert route.shared[0] == 0 and 1.0 < route.shared[1] < 1.6
    apart = Route.of(task(walk(BETWEEN), walk([(0, 2), (6, 2)])))
    assert apart.shared == (0.0, 0.0)


def test_a_cycle_is_not_closed():
    """A lap ends where it ends: the task does not say that it is done again, and no edge leads back."""
    turn = np.linspace(0, 2 * np.pi, 200)
    route = Route.of(task(SequencedLDS.fit(np.column_stack([np.cos(turn), np.sin(turn)]))))
    assert (route.edges[:, 1] == route.edges[:, 0] + 1).all() and route.edges[-1, 1] == len(route.places) - 1


def test_a_segment_without_a_length_keeps_its_node():
    """Subgoals may have moved onto each other: both stay, and the edge between them has no length and no speed."""
    law = walk(ROUND)
    subgoals = law.subgoals.copy()
    subgoals[1] = subgoals[0]
    route = Route.of(task(law.with_subgoals(subgoals)))
    assert (route.subgoals >= 0).sum() == len(subgoals) + 1
    assert route.lengths.min() == 0 and (route.speeds[route.lengths == 0] == 0).all()


# ---- objects on the way


@pytest.mark.parametrize(
    ("box", "clearance"),
    [
        ([2.0, 1.0, 4.0, 2.0], 1.0),
        ([7.0, -0.5, 8.0, 0.5], 1.0),
        ([6.3, 0.4, 7.0, 2.0], 0.5),
        ([-3, -4, 2, -0.25], 0.25),
    ],
)
def test_clearance_is_that_of_the_edges(box, clearance):
    """From the edges to the nearest object, beside them, before their end and past a corner."""
    route = Route.of(task(walk(BETWEEN), environment=Environment([box])))
    assert route.clearance == pytest.approx(clearance, abs=1e-6) and route.trusted
    assert Route.of(task(walk(BETWEEN), environment=Environment(np.empty((0, 4))))).clearance == np.inf


@pytest.mark.parametrize(
    "box", [[2.9, -0.1, 3.1, 0.1], [2.0, -3.0, 2.01, 3.0], [5.9, -0.1, 7.0, 0.1], [1.0, 0.0, 2.0, 1.0]]
)
def test_a_way_through_an_object_is_in_doubt(box):
    """Objects on the way, at its end, thinner than the way's own steps, or touched along their side: all are named."""
    route = Route.of(task(walk(BETWEEN), environment=Environment([*TABLES, box])))
    (note,) = route.notes
    assert route.clearance == 0 and not route.trusted
    assert note.kind == "objects" and "through object 2 at" in note.text and "object 0" not in note.text


@pytest.mark.parametrize("seed", range(20))
def test_clearance_by_brute_force(seed):
    """What no edge enters is as far as the nearest of dense places; what holds one of them is entered."""
    rng = np.random.default_rng(seed)
    law = walk(rng.uniform(-3, 3, (3, 2)).round(seed % 2))
    middle, half = rng.uniform(-2, 2, 2), rng.uniform(0.05, 1.0, 2)
    box = np.concatenate([middle - half, middle + half])
    route = Route.of(task(law, environment=Environment([box])))
    along = dense(route.places)
    outside = np.maximum(box[:2] - along, along - box[2:])
    nearest = np.hypot(*outside.clip(0).T).min()
    assert nearest - 0.001 <= route.clearance <= nearest + 1e-12
    assert bool(route.notes) == (route.clearance == 0)


# ---- what must be told


@pytest.mark.parametrize("to", TARGETS)
def test_what_is_in_doubt_is_exported_with_its_notes(tmp_path, to):
    """The notes of a task that is not trusted go along, into the record and into the file."""
    doubt = Note("part", "demonstration 1 shows only half of the way")
    route = export(task(walk(BETWEEN), notes=(doubt,)), tmp_path / f"r{TARGETS[to].suffixes[0]}", to)
    assert route.notes == (doubt,) and not route.trusted
    text = (tmp_path / f"r{TARGETS[to].suffixes[0]}").read_text()
    assert str(doubt) in text and "false" in text


def test_on_good_input_there_is_no_note(tmp_path):
    """A walk that does not stop, beside objects that it keeps clear of."""
    for to, target in TARGETS.items():
        assert export(task(walk(BETWEEN)), tmp_path / f"r{target.suffixes[0]}", to).notes == ()


def test_what_nav2_does_not_take_is_told(tmp_path):
    """Waits, which none of its operations keeps, ways beside the first, and places that single precision moves."""
    waiting = export(stopped_task(), tmp_path / "a.geojson", "nav2")
    assert [note.kind for note in waiting.notes] == ["waits"] and waiting.trusted
    ways = task(walk(BETWEEN), walk(ROUND))
    assert [note.kind for note in export(ways, tmp_path / "a.yaml", "waypoints").notes] == ["ways"]
    assert export(ways, tmp_path / "b.geojson", "nav2").notes == ()
    far = walk(np.array(BETWEEN) + 1e6 + 0.3)
    (note,) = export(task(far), tmp_path / "c.geojson", "nav2").notes
    assert note.kind == "precision" and note.doubt
    assert export(stopped_task(), tmp_path / "a.csv", "csv").notes == ()


# ---- bad input


@pytest.mark.parametrize("to", ["ros", "", None, "NAV2", 3])
def test_an_unknown_target_is_refused_with_the_known_ones(tmp_path, to):
    """What can be exported is listed, and nothing is written."""
    with pytest.raises(ValueError, match="to must be one of 'nav2', 'waypoints', 'csv', got"):
        export(task(walk(BETWEEN)), tmp_path / "a.geojson", to)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("to", "name", "message"),
    [
        ("nav2", "a.yaml", "a.yaml: a route for nav2 is named .geojson or .json"),
        ("waypoints", "a.json", "a.json: a route for waypoints is named .yaml or .yml"),
        ("csv", "a.CSV", "a.CSV: a route for csv is named .csv"),
        ("csv", "a.csv.gz", "a.csv.gz: a route for csv is named .csv"),
    ],
)
def test_another_name_is_refused_in_a_line(tmp_path, to, name, message):
    """The file's name and those that would do."""
    with pytest.raises(FormatError, match=message) as error:
        export(task(walk(BETWEEN)), tmp_path / name, to)
    assert "\n" not in str(error.value) and not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", [3, None, "a\0.csv"])
def test_what_is_no_path_is_refused(path):
    """A number would be an open file."""
    with pytest.raises(ValueError, match="a path must be a str or Path"):
        export(task(walk(BETWEEN)), path, "csv")


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (3, "task must have"),
        (SimpleNamespace(law=1, environment=Environment([])), "the task's law must be a SequencedLDS"),
        (SimpleNamespace(law=walk(BETWEEN), environment=1), "the task's environment must be an Environment"),
        (task(walk(BETWEEN), shown=(1, 2)), r"shown must have shape \(1,\)"),
        (task(walk(BETWEEN), notes=("a",)), r"the task's notes\[0\] must be a Note"),
        (task(replace(walk(BETWEEN), pauses=[0, 1e9])), "what is driven must last at most 1000000 periods, got 1e"),
        (task(replace(walk(BETWEEN), speeds=[1e-7], profile=None)), "what is driven must last at most"),
    ],
)
def test_what_is_no_task_is_refused(tmp_path, bad, message):
    """What is lacking, contradicts itself or lasts too long is named, and nothing is written."""
    with pytest.raises(ValueError, match=message):
        export(bad, tmp_path / "a.geojson", "nav2")
    assert not list(tmp_path.iterdir())


def test_a_table_of_too_many_places_is_refused(tmp_path):
    """A hundred kilometres every five centimetres: before there is room for them. As a graph it is one edge."""
    far = walk([(0, 0), (1e5, 0)])
    far = replace(far, speeds=np.array([1e3]), profile=None)
    with pytest.raises(ValueError, match=r"must have at most 1000000 places, got 100000 m, 0\.05 m apart"):
        export(task(far), tmp_path / "a.csv", "csv")
    assert export(task(far), tmp_path / "a.geojson", "nav2").deviation <= TOLERANCE


@pytest.mark.parametrize(("tolerance", "spacing"), [(0, 1), (-1, 1), (np.nan, 1), (0.01, 0), (0.01, "a")])
def test_a_tolerance_must_be_one(tolerance, spacing):
    """At least a micrometre, which is what coordinates can tell."""
    with pytest.raises(ValueError, match="must be"):
        Route.of(task(walk(BETWEEN)), tolerance, spacing)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"waits": [0.0]}, r"waits must have shape \(2,\)"),
        ({"ways": [0, 2]}, "must be in the order of its ways"),
        ({"ways": [1, 0]}, "must be in the order of its ways"),
        ({"places": np.empty((0, 2)), "ways": []}, "must be in the order of its ways"),
        ({"deviation": -1.0}, "deviation must be"),
        ({"notes": "doubt"}, r"notes\[0\] must be a Note"),
        ({"shared": [np.nan]}, "shared must be"),
    ],
)
def test_a_route_is_a_record_of_its_kind(change, message):
    """Numbers of nodes and ways that contradict each other are refused."""
    good = {"places": [[0, 0], [1, 0]], "headings": [0, 0], "waits": [0, 0], "t": [0, 1], "subgoals": [0, 1]}
    good |= {"segments": [0, 0], "ways": [0, 0], "shown": [1], "shared": [0], "deviation": 0}
    assert Route(**good).edges.tolist() == [[0, 1]]
    with pytest.raises(ValueError, match=message):
        Route(**(good | change))


# ---- whole files, and only its own


@pytest.mark.parametrize("to", TARGETS)
def test_only_a_route_of_its_kind_is_replaced(tmp_path, to):
    """An export may be done again; what somebody else's file holds stays, and a failure leaves what was there."""
    path = tmp_path / f"r{TARGETS[to].suffixes[0]}"
    export(task(walk(BETWEEN)), path, to)
    before = path.read_bytes()
    export(task(walk(ROUND)), path, to)
    assert path.read_bytes() != before
    with pytest.raises(ValueError, match="what is driven must last"):
        export(task(replace(walk(BETWEEN), pauses=[0, 1e9])), path, to)
    for others in (
        b'{"type": "FeatureCollection", "features": []}',
        b"waypoints: {}\n",
        b"way,t,x\n",
        b"# a comment\n",
    ):
        path.write_bytes(others)
        with pytest.raises(FileExistsError, match="it holds something else and not"):
            export(task(walk(BETWEEN)), path, to)
        assert path.read_bytes() == others
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize("to", TARGETS)
def test_routes_are_told_apart(tmp_path, to):
    """Where a route of another kind bears the name it is named, and kept."""
    path = tmp_path / f"r{TARGETS[to].suffixes[0]}"
    for other in set(TARGETS) - {to}:
        there = tmp_path / f"o{TARGETS[other].suffixes[0]}"
        export(task(walk(BETWEEN)), there, other)
        there.rename(path)
        with pytest.raises(
            FileExistsError, match=f"it holds {TARGETS[other].kind.name} and not {TARGETS[to].kind.name}"
        ):
            export(task(walk(BETWEEN)), path, to)


def test_outputs_are_known_before():
    """A command refuses before its work what could not be written after it."""
    (output,) = export_outputs("a.geojson", "nav2")
    assert output.path == "a.geojson" and output.kind.name == "a route graph"


def test_a_task_that_was_saved_gives_the_same_route(tmp_path):
    """Loaded again, to the last digits of its numbers."""
    done = stopped_task()
    done.save(tmp_path / "task.json")
    route, again = Route.of(done), Route.of(Task.load(tmp_path / "task.json"))
    np.testing.assert_allclose(route.places, again.places, atol=1e-9)
    np.testing.assert_allclose(route.waits, again.waits, atol=1e-9)


def test_a_task_by_the_papers_method_has_a_route(tmp_path):
    """A law without corners, waits or profile: as a robot that is Dollop's follows it, and as it is loaded again."""
    done = stopped_task()
    paper = Task.of(done.demonstrations[0], method="paper")
    paper.save(tmp_path / "task.json")
    for each in (paper, Task.load(tmp_path / "task.json")):
        route = Route.of(each)
        np.testing.assert_allclose(route.places[route.subgoals > 0], each.law.subgoals, atol=1e-12)
        assert both_ways(dense(route.places), dense(each.law.response())) <= route.deviation + 1e-3 <= TOLERANCE + 1e-3


def test_it_is_offered_by_the_library():
    """`dollop.export` and `dollop.Route`."""
    assert dollop.export is export and dollop.Route is Route and {"export", "Route"} <= set(dollop.__all__)
