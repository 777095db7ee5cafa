"""A task as a route of straight edges, and its export to what other robots run (beyond the paper).

Of the way that a robot follows, so many places become nodes that the straight edges between them
are nowhere farther from it than a centimetre. Where the segments of the law hand over, and where is
waited, there is always a node. A span of the way from p_i to p_j becomes an edge if

    max_n d(p_n, [p_i, p_j]) <= tolerance,    i <= n <= j,

and is divided at its farthest place otherwise (U. Ramer 1972; D. Douglas and T. Peucker 1973). That
bounds the distance in both directions: d(., edge) is convex, so no place of the span is farther
from the edge than the farthest vertex; and the span goes without a gap from one end of the edge to
the other, so every place of the edge is the one that is nearest to some place of the span.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from dollop.checks import (
    Note,
    check_choice,
    check_has,
    checked_array,
    checked_number,
    checked_positions,
    checked_record,
    checked_records,
    checked_wholes,
    put_in,
    trusted,
)
from dollop.environment import Environment
from dollop.formats.files import FormatError
from dollop.formats.kinds import PATH_TABLE, ROUTE_GRAPH, WAYPOINTS, Kind
from dollop.formats.routes import as_graph, as_table, as_waypoints
from dollop.formats.writing import Output, checked_path, whole_file
from dollop.law.timing import times_along
from dollop.learning.ways import MISSED
from dollop.pose import wrapped
from dollop.sequenced_lds import SequencedLDS, check_times
from dollop.trajectory import arc_length, at_arc_length, distance_to_polyline

__all__ = ["TARGETS", "TOLERANCE", "Route", "Target", "export", "export_outputs"]

TOLERANCE = 0.01
"""m: how far an edge may be from the way: a laser's own error, and a fifth of a map's cell."""
SMALLEST = 1e-6
"""m: a tolerance below that asks for more than coordinates can tell."""
PERIOD = 0.1
"""s: control period by which a task may take too long, as in `SequencedLDS.timed`."""
MOST_PLACES = 1_000_000
"""Places of a way that are gone through: 50 km, five centimetres apart."""
OVER = 0.1
"""m of way over which a direction is measured: less is noise of what was shown."""
SINGLE = 1e-3
"""m: by how much coordinates may change in single precision, in which Nav2 keeps them."""


@dataclass(frozen=True, eq=False)
class Route:
    """The ways of a task as nodes, and straight edges from each to the next (beyond the paper).

    Attributes
    ----------
    places : (N, 2) float array
        Of the nodes, m: way after way, each in the order in which it is driven.
    headings : (N,) float array
        Direction of the way there, over a decimetre, rad: at a subgoal that in which it arrives, at
        its start that in which it leaves.
    waits : (N,) float array
        How long is stood there, s.
    t : (N,) float array
        When it is arrived at, s from the start of its way, at the shown speeds and with the waits.
    subgoals : (N,) int array
        0 for the start of a way, k for its k-th subgoal, -1 for a node between.
    segments : (N,) int array
        The segment of the law that leads to it; 0 for a start.
    ways : (N,) int array
        The way that it belongs to: 0 for the one shown most often.
    shown : tuple of W int
        How often each way was shown.
    shared : tuple of W float
        How far, in m, each way begins along an earlier one, within 0.35 m of it as walks of one way
        are (`dollop.learning.ways.MISSED`).
    deviation : float
        Largest distance in m, both ways, between an edge and what it stands for of the law's way as
        a robot follows it (`SequencedLDS.response`).
    clearance : float
        Least distance in m between the edges and the task's objects, `inf` if there are none; zero
        where a way leads through one, which is noted. Walls are not known here.
    notes : tuple of Note
        Those of the task, and what else whoever drives it must know.

    Raises
    ------
    ValueError
        What are no such arrays, or of other lengths.

    Examples
    --------
    Along a quarter of a circle, which leaves upwards and arrives to the left:

    >>> from dollop import Demonstration, Environment, Task
    >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
    >>> walk = np.hstack([np.cos(turn), np.sin(turn)])
    >>> route = Route.of(Task.of(Demonstration(walk, Environment([[3, 0, 4, 1]]))))
    >>> bool(route.deviation <= 0.01), bool(np.abs(np.hypot(*route.places.T) - 1).max() < 0.02)
    (True, True)
    >>> route.edges[:2].tolist(), np.degrees(route.headings[[0, -1]]).round(-1)
    ([[0, 1], [1, 2]], array([ 90., 180.]))
    >>> route
    Route of 9 nodes and 8 edges in 1 way, at most 0.0069 m from the law
    """

    places: np.ndarray
    headings: np.ndarray
    waits: np.ndarray
    t: np.ndarray
    subgoals: np.ndarray
    segments: np.ndarray
    ways: np.ndarray
    shown: tuple
    shared: tuple
    deviation: float
    clearance: float = np.inf
    notes: tuple = ()

    def __post_init__(self):
        places = checked_positions("places", self.places, "N", 2)
        ways = checked_wholes("ways", self.ways, len(places))
        count = int(ways.max(initial=-1)) + 1
        if not count or np.unique(ways).size != count or (np.diff(ways) < 0).any():
            raise ValueError("the nodes of a route must be in the order of its ways, from 0 on")
        for name in ("headings", "waits", "t"):
            put_in(self, **{name: checked_array(name, getattr(self, name), len(places))})
        put_in(
            self,
            places=places,
            ways=ways,
            subgoals=checked_wholes("subgoals", self.subgoals, len(places), least=-1),
            segments=checked_wholes("segments", self.segments, len(places)),
            shown=tuple(checked_wholes("shown", self.shown, count).tolist()),
            shared=tuple(checked_array("shared", self.shared, count, least=0).tolist()),
            deviation=checked_number("deviation", self.deviation, 0),
            clearance=checked_number("clearance", self.clearance, 0, np.inf),
            notes=checked_records("notes", self.notes, Note),
        )

    def __repr__(self):
        ways = f"{len(self.shown)} way{'s' if len(self.shown) > 1 else ''}"
        nodes = f"{len(self.places)} nodes and {len(self.edges)} edges in {ways}"
        return f"Route of {nodes}, at most {self.deviation:.4f} m from the law"

    @classmethod
    def of(cls, task, tolerance=TOLERANCE, spacing=np.inf):
        """The route of a task: all its ways.

        Parameters
        ----------
        task : Task
            Anything with a `law` and an `environment`; with its `ways`, how often each was `shown`,
            and `notes`, if it has such.
        tolerance : float
            Largest deviation in m.
        spacing : float
            Most way from a node to the next, in m.

        Returns
        -------
        Route

        Raises
        ------
        ValueError
            A task that lacks something, a tolerance or spacing below a micrometre, or a law that
            takes longer than a million periods of 0.1 s, or has more places than that.
        """
        tolerance = checked_number("tolerance", tolerance, SMALLEST)
        spacing = checked_number("spacing", spacing, SMALLEST, np.inf)
        laws, shown = _laws_of(task)
        followed = [Followed.of(law, spacing) for law in laws]
        nodes = [each.nodes(tolerance, spacing) for each in followed]
        columns = map(np.concatenate, zip(*map(Followed.at, followed, nodes), strict=True))
        ways = np.repeat(np.arange(len(laws)), list(map(len, nodes)))
        deviation = max(map(Followed.deviation, followed, nodes))
        route = cls(*columns, ways, shown, _shared(followed), deviation)
        notes = checked_records("the task's notes", getattr(task, "notes", ()), Note)
        return replace(route, **_cleared(route, task.environment, notes))

    @property
    def edges(self):
        """(E, 2) int array: the nodes from which and to which each edge leads."""
        first = np.flatnonzero(np.diff(self.ways) == 0)
        return np.column_stack([first, first + 1])

    @property
    def lengths(self):
        """(E,) float array: of the edges, m."""
        return np.hypot(*np.diff(self.places[self.edges], axis=1)[:, 0].T)

    @property
    def speeds(self):
        """(E,) float array: shown along each edge on average, m/s; 0 for one without a length."""
        first, last = self.edges.T
        taken = self.t[last] - self.t[first] - self.waits[first]
        return np.divide(self.lengths, taken, out=np.zeros(len(first)), where=taken > 0)

    @property
    def trusted(self):
        """Whether no note puts the route in doubt."""
        return trusted(self.notes)


@dataclass(frozen=True, eq=False)
class Followed:
    """A way as a robot follows it.

    Attributes
    ----------
    law : SequencedLDS
    places : (M, 2) float array
        The response from the law's start, m.
    t : (M,) float array
        When each is arrived at, s.
    ends : (K + 1,) int array
        Which of them are the start and the subgoals.
    """

    law: SequencedLDS
    places: np.ndarray
    t: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(cls, law, spacing):
        """The way of a law, its places at most so far apart.

        Parameters
        ----------
        law : SequencedLDS
        spacing : float
            m.

        Returns
        -------
        Followed

        Raises
        ------
        ValueError
            For one that takes longer than a million periods of 0.1 s, or a million such places.
        """
        lines = law.lines()
        length = sum(line.way[-1] for line in lines)
        if not length <= MOST_PLACES * spacing:
            rule = f"the way of a route must have at most {MOST_PLACES} places"
            raise ValueError(f"{rule}, got {length:.6g} m, {spacing:g} m apart")
        lines = [_filled(line.places, spacing) for line in lines]
        speeds = law.speeds[:, None] if law.profile is None else law.profile
        when, _ = times_along(lines, speeds, waits_of(law))
        check_times(when[-1], PERIOD)
        # Of each line the first place is the last of the one before, and only waits are between.
        begins = 1 + np.cumsum([0, *map(len, lines)])[:-1]
        t = np.delete(when, [*begins, len(when) - 1])
        ends = np.cumsum([0, *(len(line) - 1 for line in lines)])
        places = np.vstack([lines[0][:1], *(line[1:] for line in lines)])
        places[ends] = [law.start, *law.subgoals]
        return cls(law, places, t, ends)

    def nodes(self, tolerance, spacing):
        """Which places become nodes.

        Parameters
        ----------
        tolerance, spacing : float
            m.

        Returns
        -------
        (N,) int array
            Rising; the start and all subgoals are among them.
        """
        spans = zip(self.ends[:-1].tolist(), self.ends[1:].tolist(), strict=True)
        found = [i + chosen(self.places[i : j + 1], tolerance, spacing)[:-1] for i, j in spans]
        return np.concatenate([*found, self.ends[-1:]])

    def deviation(self, nodes):
        """Largest distance between the way and the edges between nodes.

        Parameters
        ----------
        nodes : (N,) int array

        Returns
        -------
        float
            m.
        """
        spans = zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True)
        return max(aside(self.places[i : j + 1]).max() for i, j in spans)

    def at(self, nodes):
        """What a route holds of some nodes.

        Parameters
        ----------
        nodes : (N,) int array

        Returns
        -------
        places, headings, waits, t, subgoals, segments : tuple of (N, 2) and (N,) arrays
            As of `Route`.
        """
        numbers, waits = np.full(len(self.t), -1), np.zeros(len(self.t))
        numbers[self.ends] = np.arange(len(self.ends))
        waits[self.ends] = waits_of(self.law)
        segments = np.searchsorted(self.ends[1:], np.arange(len(self.t)))
        columns = self.places, self.headings(), waits, self.t, numbers, segments
        return tuple(column[nodes] for column in columns)

    def headings(self):
        """Direction of the way at each place, within its segment, over a decimetre.

        Returns
        -------
        (M,) float array
            rad: at the first place that in which the way leaves, at a subgoal that in which it
            arrives; where it stays at one place, that in which it came.
        """
        spans = zip(self.ends[:-1].tolist(), self.ends[1:].tolist(), strict=True)
        steps = [_directions(self.places[i : j + 1])[bool(i) :] for i, j in spans]
        x, y = np.vstack(steps).T
        moved = np.hypot(x, y) > SMALLEST
        known = np.maximum.accumulate(np.where(moved, np.arange(len(x)), 0))
        return wrapped(np.arctan2(y, x))[known]


def _directions(places):
    """Steps (N, 2) in m over a decimetre about each place (N, 2) of a segment, or up to its end."""
    way = arc_length(places)
    begins, ends = way - OVER / 2, way + OVER / 2
    ends[0], begins[-1] = OVER, way[-1] - OVER
    return at_arc_length(places, ends) - at_arc_length(places, begins)


def waits_of(law):
    """How long is stood at the start and at each subgoal.

    Parameters
    ----------
    law : SequencedLDS

    Returns
    -------
    (K + 1,) float array
        s.
    """
    return np.zeros(len(law.segments) + 1) if law.pauses is None else law.pauses


def aside(places):
    """Distance of each place from the straight line from the first to the last.

    Parameters
    ----------
    places : (N, 2) float array
        m.

    Returns
    -------
    (N,) float array
        m.
    """
    return distance_to_polyline(places, places[[0, -1]])


def chosen(places, tolerance, spacing=np.inf):
    """The places of a way between which straight lines are as good (Ramer, Douglas and Peucker).

    Parameters
    ----------
    places : (N, 2) float array
        m.
    tolerance : float
        How far the way may be from a straight line, m.
    spacing : float
        Way from one to the next, m; more where the places themselves are farther apart.

    Returns
    -------
    (K,) int array
        Rising, the first and the last among them.

    Examples
    --------
    >>> corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    >>> chosen(corner, 0.01).tolist(), chosen(corner, 0.01, spacing=1.5).tolist()
    ([0, 2, 3], [0, 1, 2, 3])
    """
    way, kept, spans = arc_length(places), {0, len(places) - 1}, [(0, len(places) - 1)]
    while spans:
        i, j = spans.pop()
        if j - i < 2:
            continue
        off = aside(places[i : j + 1])
        if off.max() > tolerance:
            cut = i + int(off.argmax())
        elif way[j] - way[i] > spacing:
            cut = int(np.searchsorted(way, (way[i] + way[j]) / 2).clip(i + 1, j - 1))
        else:
            continue
        kept.add(cut)
        spans += [(i, cut), (cut, j)]
    return np.array(sorted(kept))


def _filled(places, spacing):
    """Places (N, 2) with others between them, at most so far apart."""
    counts = np.ceil(np.hypot(*np.diff(places, axis=0).T) / spacing).astype(int).clip(1)
    at = np.concatenate([[0], np.cumsum(counts)])
    return np.stack([np.interp(np.arange(at[-1] + 1), at, column) for column in places.T], axis=1)


def _laws_of(task):
    """The laws of a task, one for each way, and how often each was shown."""
    check_has("task", task, "law", "environment")
    checked_record("the task's environment", task.environment, Environment)
    law = checked_record("the task's law", task.law, SequencedLDS)
    laws = checked_records("the task's ways", getattr(task, "ways", (law,)), SequencedLDS) or (law,)
    return laws, getattr(task, "shown", (1,) * len(laws))


def _shared(followed):
    """How far, in m, each way begins along one of those before it."""
    shared = []
    for k, way in enumerate(followed):
        shared.append(max((_common(way, other) for other in followed[:k]), default=0.0))
    return shared


def _common(way, other):
    """How far, in m, a way begins along another."""
    if np.hypot(*(way.places[0] - other.places[0])) > MISSED:
        return 0.0
    apart = distance_to_polyline(way.places, other.places) > MISSED
    last = int(apart.argmax()) - 1 if apart.any() else len(apart) - 1
    return float(arc_length(way.places)[last])


def _cleared(route, environment, notes):
    """Clearance of a route from objects, and notes with one on those that it leads through."""
    ways = np.split(route.places, np.flatnonzero(np.diff(route.ways)) + 1)
    clearance, through = np.inf, {}
    for number, box in enumerate(environment.boxes):
        for way in ways:
            clearance = min(clearance, _box_distance(way, box))
            for place in _entrances(way, box):
                through.setdefault(number, f"object {number} at ({place[0]:.2f}, {place[1]:.2f})")
    if through:
        where = ", ".join(through.values())
        text = f"a way leads through {where}: what drives along it must go round"
        return {"clearance": 0.0, "notes": (*notes, Note("objects", text))}
    return {"clearance": clearance, "notes": notes}


def _box_distance(way, box):
    """Distance in m of a way (N, 2), edges included, from a box (4,) that no edge enters."""
    corners = box[[[0, 1], [2, 1], [2, 3], [0, 3]]]
    outside = np.maximum(box[:2] - way, way - box[2:]).clip(0)
    return float(min(np.hypot(*outside.T).min(), distance_to_polyline(corners, way).min()))


def _entrances(way, box):
    """The places (P, 2) in m where edges of a way (N, 2) enter a box (4,), or touch it."""
    steps, borders = np.diff(way, axis=0), box.reshape(2, 1, 2) - way[:-1]
    within = (borders[0] <= 0) & (borders[1] >= 0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        shares = np.sort(borders / steps, axis=0)
    # An edge along a side passes no border: it is between them all along, or nowhere.
    shares[:, steps == 0] = np.where(within, [[[-np.inf]], [[np.inf]]], np.inf)[:, steps == 0]
    enters, leaves = shares[0].max(axis=1).clip(min=0), shares[1].min(axis=1).clip(max=1)
    through = enters <= leaves
    return way[:-1][through] + enters[through, None] * steps[through]


class Target(NamedTuple):
    """What a route can be exported to.

    Attributes
    ----------
    suffixes : tuple of str
        Names of its files end in one of them.
    kind : Kind
        What they hold.
    text : callable
        Route -> str.
    tolerance, spacing : float
        m, as for `Route.of`.
    """

    suffixes: tuple
    kind: Kind
    text: Callable
    tolerance: float = TOLERANCE
    spacing: float = np.inf


TARGETS = {
    "nav2": Target((".geojson", ".json"), ROUTE_GRAPH, as_graph),
    "waypoints": Target((".yaml", ".yml"), WAYPOINTS, as_waypoints),
    "csv": Target((".csv",), PATH_TABLE, as_table, TOLERANCE / 10, 0.05),
}
"""By name. The table is a path to be driven as it is, every few centimetres."""


def export_outputs(path, to):
    """Files that `export` writes.

    Parameters
    ----------
    path : str or Path
    to : {"nav2", "waypoints", "csv"}

    Returns
    -------
    list of Output

    Raises
    ------
    ValueError
        For another target, or a name that is not one of it.

    Examples
    --------
    >>> export_outputs("route.txt", "nav2")
    Traceback (most recent call last):
    dollop.formats.files.FormatError: route.txt: a route for nav2 is named .geojson or .json
    """
    check_choice("to", to, TARGETS)
    target = TARGETS[to]
    if not checked_path(path).name.endswith(target.suffixes):
        raise FormatError(f"a route for {to} is named {' or '.join(target.suffixes)}", path)
    return [Output(path, target.kind)]


def export(task, path, to):
    """Write the ways of a task as a route that other robots' software drives (beyond the paper).

    "nav2": the route graph of Nav2's Route Server, GeoJSON (`dollop.formats.routes.as_graph`);
    "waypoints": poses in YAML, as Nav2's panel in RViz loads them (`as_waypoints`); "csv": the path
    every few centimetres, with its times, speeds and waits (`as_table`). What it stands for is
    nowhere farther from it than a centimetre, of the table a millimetre; each file tells how far,
    and the notes of the task.

    Parameters
    ----------
    task : Task
    path : str or Path
        `.geojson` or `.json` for nav2, `.yaml` or `.yml` for waypoints, `.csv` for csv. It appears
        whole or not at all.
    to : {"nav2", "waypoints", "csv"}

    Returns
    -------
    Route
        What was written. `notes` are those of the task, and what the file cannot express.

    Raises
    ------
    ValueError
        For another target, another name of the file, or a task that has no route (`Route.of`).
    OSError
        If it cannot be written, or what is there is something else.

    Examples
    --------
    >>> import json, tempfile
    >>> from dollop import Demonstration, Environment, Task
    >>> walk = np.linspace([0.0, 0.0], [3.0, 0.0], 50)
    >>> task = Task.of(Demonstration(walk, Environment([[1, 1, 2, 2]])))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     route = export(task, f"{folder}/route.geojson", to="nav2")
    ...     graph = json.load(open(f"{folder}/route.geojson"))
    >>> route.deviation < 0.01, [each["geometry"]["type"] for each in graph["features"]]
    (True, ['Point', 'Point', 'MultiLineString'])
    """
    ((_, kind, _),) = export_outputs(path, to)
    target = TARGETS[to]
    route = Route.of(task, target.tolerance, target.spacing)
    route = replace(route, notes=(*route.notes, *_not_told(route, to)))
    text = target.text(route)
    with whole_file(path, "w", kind) as stream:
        stream.write(text)
    return route


def _not_told(route, to):
    """Notes on what the readers of a target do not take from it."""
    if to == "csv":
        return
    waits = int((route.waits > 0).sum())
    if waits:
        rule = "for what drives the robot to keep"
        text = f"Nav2 does not wait by itself: the {waits} waits are in the file, {rule}"
        yield Note("waits", text, doubt=False)
    if to == "waypoints" and len(route.shown) > 1:
        others = f"the other {len(route.shown) - 1} are in the file"
        text = f"Nav2 loads the way shown most often; {others}"
        yield Note("ways", text, doubt=False)
    lost = np.abs(route.places - route.places.astype(np.float32)).max()
    if to == "nav2" and lost > SINGLE:
        text = f"Nav2 keeps coordinates in single precision: that moves nodes by up to {lost:.3g} m"
        yield Note("precision", text)
