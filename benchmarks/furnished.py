"""Furnished rooms drawn at random, and walks of a person through them, for `benchmarks.driving`.

Everything of a room comes from one seed: a rectangle or an L of 4 to 15 m with inner walls and doors, pillars, tables,
narrow passages and clutter on a map of 5 cm, or no map at all; objects beside it as boxes that know nothing of cells.
What is true is told by `Truth`, in its own arithmetic: exact distances to boxes and to occupied cells as squares.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from dollop import Demonstration, Environment, OccupancyGrid

SIDE, FINE = 0.05, 3
"""Side of a cell in m, and points of the fine grid along it: one each 1.7 cm."""
PERSON = 0.20
"""Radius of a person in m: nobody's middle comes nearer to anything."""
OPEN = 3.0
"""m of floor that is looked at round all that is in a world without a map."""
KINDS = "rectangle", "L", "rooms", "clutter", "passage", "open"
PERIOD = 0.1
"""s between two positions of a walk."""


class Truth:
    """How far it truly is to what stands in a room: boxes and occupied cells, whose edges are exact.

    Parameters
    ----------
    boxes : (N, 4) float array
        xmin, ymin, xmax, ymax in m.
    cells : (H, W) bool array or None
        What is occupied on the map.
    frame : (4,) sequence of float
        xmin, ymin, xmax, ymax in m of what is looked at; the map's, if there is one.
    """

    def __init__(self, boxes, cells, frame):
        self.boxes, self.frame = np.asarray(boxes, float).reshape(-1, 4), np.asarray(frame, float)
        self.shape = np.round((self.frame[[3, 2]] - self.frame[[1, 0]]) / SIDE).astype(int)
        self.cells = np.zeros(self.shape, bool) if cells is None else cells
        self.mapped = cells is not None

    @cached_property
    def _tree(self):
        """Centres (M, 2) in m of the occupied cells that a free one is beside, in a tree."""
        padded = np.pad(self.cells, 1)
        buried = padded.copy()
        for axis in (0, 1):
            for shift in (-1, 1):
                buried &= np.roll(padded, shift, axis)
        row, column = np.nonzero(padded & ~buried)
        return cKDTree(self.frame[:2] + SIDE * (np.column_stack([column, row]) - 0.5))

    def distance(self, places):
        """Distances (N,) in m from places (N, 2) to the nearest box or cell; 0 within one."""
        places = np.asarray(places, float)[:, :2]
        away = distance_to_boxes(places, self.boxes)
        if not self.mapped:
            return away
        near = self._tree.query(places, k=min(16, self._tree.n))[1].reshape(len(places), -1)
        gaps = np.abs(self._tree.data[near] - places[:, None]) - SIDE / 2
        away = np.minimum(away, np.hypot(*np.moveaxis(np.maximum(gaps, 0.0), 2, 0)).min(axis=1))
        column, row = np.floor((places - self.frame[:2]) / SIDE).astype(int).T
        inside = (row >= 0) & (column >= 0) & (row < self.shape[0]) & (column < self.shape[1])
        away[inside] = np.where(self.cells[row[inside], column[inside]], 0.0, away[inside])
        return np.where(inside, away, 0.0)

    @cached_property
    def points(self):
        """x (W,) and y (H,) in m of the fine grid's points, the corners of cells among them."""
        rows, columns = FINE * self.shape + 1
        return self.frame[0] + SIDE / FINE * np.arange(columns), self.frame[1] + SIDE / FINE * np.arange(rows)

    @cached_property
    def clear(self):
        """Distances (H, W) in m at the points of the fine grid.

        The point of a square that is nearest to one of the grid's points is one of the grid's points, so the
        distances to cells are exact, too.
        """
        x, y = self.points
        clear = np.full((len(y), len(x)), np.inf)
        for left, low, right, high in self.boxes:
            across, up = np.maximum(np.maximum(left - x, x - right), 0), np.maximum(np.maximum(low - y, y - high), 0)
            clear = np.minimum(clear, np.hypot(across, up[:, None]))
        if self.mapped:
            blocked = np.zeros(clear.shape, bool)
            wide = np.kron(self.cells, np.ones((FINE, FINE), bool))
            for down in (0, 1):
                for right in (0, 1):
                    blocked[down : down + wide.shape[0], right : right + wide.shape[1]] |= wide
            clear = np.minimum(clear, SIDE / FINE * distance_transform_edt(~blocked))
        return clear

    def parts(self, width):
        """Numbers (H, W) from 1 on of the parts of the fine grid where a disc of a radius in m can be; 0 elsewhere."""
        return label(self.clear >= width, np.ones((3, 3)))[0]

    def part_at(self, parts, place, within=0.03):
        """Numbers of the parts that come so near in m to a place."""
        x, y = self.points
        columns = np.flatnonzero(np.abs(x - place[0]) <= within)
        rows = np.flatnonzero(np.abs(y - place[1]) <= within)
        there = parts[np.ix_(rows, columns)]
        near = np.hypot(x[columns] - place[0], y[rows, None] - place[1]) <= within
        return set(there[near].tolist()) - {0}

    def random_places(self, rng, count, width):
        """Places (count, 2) in m, so far in m from everything, or as many as are found."""
        places = rng.uniform(self.frame[:2], self.frame[2:], (400 * count, 2))
        return places[self.distance(places) > width][:count]


def distance_to_boxes(places, boxes):
    """Distances (N,) in m from places (N, 2) to the nearest of boxes (M, 4); 0 within one."""
    if not len(boxes):
        return np.full(len(places), np.inf)
    gaps = np.maximum(boxes[:, :2] - places[:, None], places[:, None] - boxes[:, 2:])
    return np.hypot(*np.moveaxis(np.maximum(gaps, 0.0), 2, 0)).min(axis=1)


@dataclass
class Room:
    """A room, what was shown in it, and where its objects stand when a robot performs it."""

    seed: int
    kind: str
    background: OccupancyGrid
    before: Truth
    now: Truth
    environment: Environment
    moved: Environment
    shown: list
    made: list = field(default_factory=list)


def drawn(seed):
    """The room (Room) of a seed."""
    rng = np.random.default_rng([seed, 14])
    kind = str(rng.choice(KINDS))
    while True:
        room = attempt(rng, seed, kind)
        if room:
            return room


def attempt(rng, seed, kind):
    """A room of a kind, or None where no person finds a walk in it."""
    frame, cells = floor_plan(rng, kind)
    boxes = objects(rng, Truth([], cells, frame), rng.integers(4, 15) if kind == "open" else rng.integers(2, 8))
    if len(boxes) < 2:
        return None
    before = Truth(boxes, cells, frame)
    shown, made = demonstrations(rng, before, Environment(boxes))
    if not shown:
        return None
    moved = moved_boxes(rng, before, boxes, shown, made) if rng.random() < 0.5 else boxes
    background = as_map(rng, cells, frame)
    now = Truth(moved, cells, frame if cells is not None else frame + OPEN * np.array([-1, -1, 1, 1]))
    return Room(seed, kind, background, before, now, Environment(boxes), Environment(moved), shown, made)


def floor_plan(rng, kind):
    """Frame (4,) in m and occupied cells (H, W), None where there is no map."""
    width, depth = rng.uniform(4.0, 15.0, 2)
    corner = rng.uniform(-8.0, 8.0, 2)
    shape = np.ceil(np.array([depth, width]) / SIDE).astype(int)
    frame = *corner, corner[0] + SIDE * shape[1], corner[1] + SIDE * shape[0]
    if kind == "open":
        return frame, None
    cells = np.zeros(shape, bool)
    thick = rng.integers(1, 5)
    cells[:thick], cells[-thick:], cells[:, :thick], cells[:, -thick:] = True, True, True, True
    if kind == "L" or rng.random() < 0.2:
        cut = (shape * rng.uniform(0.3, 0.6, 2)).astype(int)
        rows = slice(None, cut[0]) if rng.integers(2) else slice(-cut[0], None)
        columns = slice(None, cut[1]) if rng.integers(2) else slice(-cut[1], None)
        cells[rows, columns] = True
    for _ in range(rng.integers(1, 5) if kind == "rooms" else rng.integers(0, 2)):
        inner_wall(rng, cells)
    if kind == "passage":
        passage(rng, cells)
    area = SIDE**2 * cells.size
    for _ in range(rng.poisson(area * (0.25 if kind == "clutter" else 0.06))):
        furniture(rng, cells)
    return frame, cells


def inner_wall(rng, cells):
    """Draw a wall across with a door or two of 0.5 to 1.2 m into cells (H, W)."""
    view = cells if rng.integers(2) else cells.T
    at, thick = rng.integers(25, view.shape[0] - 25), rng.integers(1, 4)
    wall = np.ones(view.shape[1], bool)
    for _ in range(rng.integers(1, 3)):
        door = round(rng.uniform(0.5, 1.2) / SIDE)
        first = rng.integers(4, view.shape[1] - door - 4)
        wall[first : first + door] = False
    if rng.random() < 0.4:
        wall[: rng.integers(1, len(wall) // 2)] = False
    view[at : at + thick] |= wall


def passage(rng, cells):
    """Draw two blocks with 0.4 to 1.2 m between them into cells (H, W)."""
    view = cells if rng.integers(2) else cells.T
    gap, length = round(rng.uniform(0.4, 1.2) / SIDE), round(rng.uniform(0.3, 2.5) / SIDE)
    low = rng.integers(20, view.shape[1] - gap - 20)
    first = rng.integers(20, max(view.shape[0] - length - 20, 21))
    view[first : first + length, :low] = True
    view[first : first + length, low + gap :] = True


def furniture(rng, cells):
    """Draw a pillar, a table, a shelf or an oblique thing into cells (H, W)."""
    rows, columns = np.indices(cells.shape)
    centre = rng.uniform((0, 0), cells.shape)
    half = {0: (0.05, 0.2), 1: (0.3, 0.9), 2: (0.1, 0.4)}[int(rng.integers(3))]
    length, breadth = rng.uniform(*half, 2) / SIDE
    turn = rng.choice([0.0, rng.uniform(0, np.pi)])
    down, right = rows + 0.5 - centre[0], columns + 0.5 - centre[1]
    along, across = np.cos(turn) * right + np.sin(turn) * down, np.cos(turn) * down - np.sin(turn) * right
    if rng.random() < 0.3:
        cells |= np.hypot(along, across) <= length
    else:
        cells |= (np.abs(along) <= length) & (np.abs(across) <= breadth)


def objects(rng, truth, count):
    """Boxes (N, 4) in m, not in one another nor in what is on the map."""
    boxes = np.empty((0, 4))
    for _ in range(30 * count):
        if len(boxes) == count:
            break
        box = box_at(rng.uniform(truth.frame[:2], truth.frame[2:]), rng.uniform(0.15, 0.9, 2))
        if is_free(Truth(boxes, truth.cells if truth.mapped else None, truth.frame), box):
            boxes = np.vstack([boxes, box])
    return boxes


def box_at(centre, size):
    """A box (4,) in m round a centre (2,)."""
    return np.concatenate([centre - size / 2, centre + size / 2])


def is_free(truth, box):
    """Whether a box (4,) in m touches nothing of a room and stands in it."""
    sides = (np.linspace(low, high, 12) for low, high in (box[[0, 2]], box[[1, 3]]))
    return truth.distance(np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)).min() > 0.02


def as_map(rng, cells, frame):
    """The OccupancyGrid of cells (H, W), as sharp as a drawing or as blurred as a recorded one; None of None."""
    if cells is None:
        return None
    occupancy = cells.astype(float)
    if rng.random() < 0.5:
        occupancy = np.where(cells, rng.uniform(0.55, 1.0, cells.shape), rng.uniform(0.0, 0.15, cells.shape))
    if rng.random() < 0.3:
        buried = distance_transform_edt(np.pad(cells, 1, constant_values=True))[1:-1, 1:-1] > 3
        buried[[0, -1]], buried[:, [0, -1]] = False, False
        occupancy[buried] = np.nan
    return OccupancyGrid(occupancy, frame[:2], SIDE)


# ---- walks


def demonstrations(rng, truth, environment):
    """Demonstrations, and words for how they were made; none where no walk is found."""
    keep = rng.choice([0.0, 0.1, 0.3])
    graph = Floor(truth, keep)
    if not graph.fits:
        return [], []
    stops = graph.random_stops(rng, rng.integers(2, 5))
    path = graph.path(stops)
    if path is None or arc(path)[-1] < 1.5:
        return [], []
    laps = int(rng.choice([1, 1, 2, 3]))
    pause = rng.random() < 0.3
    made = [f"{laps} laps"] * (laps > 1) + ["pause"] * pause
    shown = [demonstration(rng, truth, environment, path, laps, pause)]
    if rng.random() < 0.25:
        other = graph.path(stops, avoid=path)
        if other is not None and cKDTree(path).query(other)[0].max() > 0.6:
            made.append("two ways")
            shown.append(demonstration(rng, truth, environment, other, 1, False))
    return shown, made


def arc(path):
    """Length along a path (N, 2), (N,) in m."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])


class Floor:
    """Where a person's middle can be, on a grid of 5 cm, and ways on it, kept off things by `keep` in m if they can."""

    def __init__(self, truth, keep):
        self.truth, step = truth, FINE
        self.clear = truth.clear[step // 2 :: step, step // 2 :: step]
        self.x, self.y = (points[step // 2 :: step] for points in truth.points)
        free = self.clear >= PERSON + 0.02
        parts = label(free, np.ones((3, 3)))[0]
        sizes = np.bincount(parts.ravel())[1:]
        self.fits = len(sizes) > 0 and sizes.max() * SIDE**2 > 2.0
        self.free = parts == 1 + sizes.argmax() if self.fits else free
        self.cost = 1 + 8 * np.clip((PERSON + keep - self.clear) / max(keep, 0.01), 0, 1) * (keep > 0)

    def random_stops(self, rng, count):
        """Flat numbers (count,) of cells to be passed, far from each other."""
        cells = rng.choice(np.flatnonzero(self.free), 40)
        places = self.places(cells)
        chosen = [0]
        while len(chosen) < count:
            away = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
            chosen.append(int(np.argsort(away)[-rng.integers(1, 20)]))
        return cells[chosen]

    def places(self, cells):
        """(N, 2) in m of flat numbers (N,)."""
        row, column = np.unravel_index(cells, self.free.shape)
        return np.column_stack([self.x[column], self.y[row]])

    def path(self, stops, avoid=None):
        """A way (N, 2) in m through cells, by preference not along another; None where there is none."""
        cost = self.cost
        if avoid is not None:
            at = np.stack(np.meshgrid(self.x, self.y), axis=-1).reshape(-1, 2)
            cost = cost * (1 + 5 * (cKDTree(avoid).query(at)[0] < 0.7)).reshape(cost.shape)
        costs, before = dijkstra(self.graph(cost), indices=stops[:-1], return_predecessors=True)
        cells = []
        for k, stop in enumerate(stops[1:]):
            if not np.isfinite(costs[k, stop]):
                return None
            leg = [stop]
            while leg[-1] != stops[k]:
                leg.append(before[k, leg[-1]])
            cells += leg[::-1] if not cells else leg[-2::-1]
        return self.places(np.array(cells)) if len(cells) > 1 else None

    def graph(self, cost):
        """Costs in m between free cells side by side or corner to corner, sparse."""
        index, heads, tails, costs = np.arange(cost.size).reshape(cost.shape), [], [], []
        rows, columns = cost.shape
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = np.s_[: rows - down, max(-right, 0) : columns - max(right, 0)]
            there = np.s_[down:, max(right, 0) : columns + min(right, 0)]
            both = self.free[here] & self.free[there]
            step = SIDE * np.hypot(down, right) * (cost[here] + cost[there])[both] / 2
            heads += [index[here][both], index[there][both]]
            tails += [index[there][both], index[here][both]]
            costs += [step, step]
        entries = np.concatenate(costs), (np.concatenate(heads), np.concatenate(tails))
        return coo_array(entries, shape=(cost.size, cost.size)).tocsr()


def smooth(truth, path):
    """A path (N, 2) with a place each 2 cm, as smooth as leaves a person room."""
    places = resampled(path, 0.02)
    for sigma in (20, 14, 10, 7, 5, 3, 2):
        smoothed = gaussian_filter1d(places, sigma, axis=0, mode="nearest")
        if truth.distance(smoothed).min() >= PERSON:
            return smoothed
    return places


def resampled(path, step):
    """Places (M, 2) along a path, about `step` in m from each other."""
    along = arc(path)
    return at(path, along, np.linspace(0, along[-1], max(int(along[-1] / step), 2)))


def at(path, along, where):
    """Places (M, 2) of a path (N, 2) at lengths (M,) along it."""
    return np.column_stack([np.interp(where, along, axis) for axis in path.T])


def demonstration(rng, truth, environment, path, laps, pause):
    """A person's walks along a path (N, 2), each time a little otherwise."""
    path, speed = smooth(truth, path), rng.uniform(0.5, 1.3)
    stand = (rng.uniform(0.2, 0.8), rng.uniform(1.0, 6.0)) if pause else None
    walks = [walk(rng, truth, path, speed, stand) for _ in range(laps)]
    return Demonstration(walks if laps > 1 else walks[0], environment)


def walk(rng, truth, path, speed, stand):
    """One walk (N, 2) at 10 Hz: swaying, slower in bends, standing where and as long as told."""
    along = arc(path)
    step = np.gradient(path, axis=0)
    normal = np.column_stack([-step[:, 1], step[:, 0]]) / np.maximum(np.hypot(*step.T), 1e-9)[:, None]
    sway = rng.uniform(0, 0.04) * np.sin(2 * np.pi * along / rng.uniform(0.7, 1.6) + rng.uniform(0, 6))
    swaying = path + sway[:, None] * normal
    path = swaying if truth.distance(swaying).min() >= PERSON - 0.02 else path
    heading = gaussian_filter1d(np.unwrap(np.arctan2(step[:, 1], step[:, 0])), 8)
    bend = np.abs(np.gradient(heading, np.maximum(along, 1e-9) + 1e-6 * np.arange(len(along))))
    pace = speed / (1 + 0.5 * np.minimum(bend, 4))
    ease = np.minimum(along, along[-1] - along)
    pace = gaussian_filter1d(np.minimum(pace, np.sqrt(0.05 + 2 * ease)), 10)
    when = np.concatenate([[0.0], np.cumsum(np.diff(along) * 2 / (pace[1:] + pace[:-1]))])
    if stand:
        k = int(stand[0] * len(path))
        path, when = np.insert(path, k, path[k], axis=0), np.insert(when, k, when[k])
        when[k + 1 :] += stand[1]
    times = np.arange(0, when[-1], PERIOD)
    return at(path, when, times) + rng.normal(0, 0.003, (len(times), 2))


# ---- moved objects


def moved_boxes(rng, truth, boxes, shown, made):
    """Boxes (N, 4): some moved by up to a metre, one at times onto the way or where it ends."""
    boxes, frame, cells = boxes.copy(), truth.frame, truth.cells if truth.mapped else None
    made.append("moved")
    for k in range(len(boxes)):
        others = Truth(np.delete(boxes, k, axis=0), cells, frame)
        shifted = boxes[k] + np.tile(rng.normal(0, 0.5, 2).clip(-1, 1), 2)
        if rng.random() < 0.7 and is_free(others, shifted):
            boxes[k] = shifted
    if rng.random() < 0.35:
        walked = shown[0].trajectory[0] if isinstance(shown[0].trajectory, list) else shown[0].trajectory
        k, share = rng.integers(len(boxes)), rng.choice([1.0, rng.uniform(0.2, 0.9)], p=[0.3, 0.7])
        place = walked[int(share * (len(walked) - 1))] + rng.normal(0, 0.1, 2)
        blocking = box_at(place, boxes[k, 2:] - boxes[k, :2])
        if is_free(Truth(np.delete(boxes, k, axis=0), cells, frame), blocking):
            boxes[k] = blocking
            made.append("box on the end" if share == 1 else "box on the way")
    return boxes
