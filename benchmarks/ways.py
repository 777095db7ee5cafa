"""Whether a robot takes the way that is free, and changes when it is blocked: python -m benchmarks.ways

Arguments, all optional: the first seed, how many, and of which kinds (by default 20 seeds from 0, every kind).

A random room has a row of objects across it, or a wall of its map, with two openings. The task was shown through one
of them three times, and once through the other. Then boxes close the usual opening: no slit between them is as wide
as the robot. Where there is a third opening beside the objects, nobody went through it.

The robot, a unicycle of 0.25 m, starts within some 0.1 m of where the user did, in any direction. It finds the boxes
    known      on its map from the start,
    noticed    when it comes within 2.5 m of one,
    stopped    never: at 5 cm from one it comes to a halt, and can only turn or be driven away from it.
A run counts as `other` if it finished and its last passage of the row went through the opening of the other way,
whatever the robot says of itself; `touched` counts runs whose edge came to 0 m from anything that truly stands there.

Beside it,
    law alone  the robot knows the usual way only; where a subgoal is in a box, it refuses to begin,
    stool      nothing is closed, but a box no wider than the robot stands on the usual way, where there is room
               beside it and no subgoal in it; here `other` counts runs that left the usual way all the same,
and with nothing in the way, `open` counts runs that took the usual way and kept to it, `start` those that took the way
that begins where they do, where the two begin 0.8 to 2.5 m apart, each as often as the other.

Layouts are drawn again where a walk would come to less than 10 cm from something. The seeds are the layouts'.
"""

import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.performing import Unicycle, perform
from dollop.sequenced_lds import SequencedLDS

FIRST, COUNT = 0, 20
SIDE, WALL = 0.05, 0.1  # m: of a cell, and how thick the walls are
RADIUS, ROOM, SLIT = 0.25, 0.1, 0.45  # m: of the robot, beside a walk, and the widest slit that is left
NOTICED, STOPPED = 2.5, 0.05  # m: from where boxes are noticed, and where the robot halts
SPREAD = 0.2  # m: how far from where the user did the robot starts at most, along x and along y
WAYS = ("usual", "other")
KINDS = [(kind, "pursuit") for kind in ("known", "noticed", "stopped", "law alone", "stool")]
KINDS += [(kind, "plain") for kind in ("known", "noticed", "stopped", "stool")]


@dataclass(frozen=True)
class Layout:
    """A room (width, depth) in m with boxes of its map and objects, two openings in a row at x, and what closes one.

    `openings` are (low, high) in m along y: the usual one, the other. `walks` are (N, 2) in m, one per way.
    """

    size: tuple
    row: float
    walls: np.ndarray
    objects: np.ndarray
    closing: np.ndarray
    openings: tuple
    walks: tuple

    def background(self):
        """Walls as a map."""
        width, depth = self.size
        x, y = (np.arange(-WALL, size + WALL, SIDE) + SIDE / 2 for size in (width, depth))
        blocked = (x < 0) | (x > width) | ((y < 0) | (y > depth))[:, None]
        for left, low, right, high in self.walls:
            blocked |= (x > left) & (x < right) & ((y > low) & (y < high))[:, None]
        return OccupancyGrid(blocked.astype(float), (-WALL, -WALL), SIDE)

    def task(self, closed):
        """The task with both ways, in the environment with the boxes that close the usual one, or without."""
        ways = tuple(map(SequencedLDS.fit, self.walks))
        objects = np.vstack([self.objects, self.closing]) if closed else self.objects
        return SimpleNamespace(law=ways[0], ways=ways, shown=(3, 1), environment=Environment(objects))

    def passed(self, places):
        """Through which opening places (N, 2) pass the row for the last time, or None."""
        crossing = np.flatnonzero(np.diff(places[:, 0] > self.row))
        y = places[crossing[-1], 1] if len(crossing) else np.nan
        found = [name for name, (low, high) in zip(WAYS, self.openings, strict=True) if low < y < high]
        return found[0] if found else None


def drawn(seed, apart=False):
    """A random layout, and how many were drawn for it; `apart`: its ways begin at different places."""
    rng = np.random.default_rng([seed, apart])
    for count in range(1, 1000):
        layout = (_among_objects, _behind_a_wall)[seed % 2](rng, apart)
        if layout is not None and _walkable(layout):
            return layout, count
    raise ValueError(f"no layout in 1000 tries for seed {seed}")


def _walkable(layout):
    obstacles = ObstacleMap.of(Environment(layout.objects), layout.background(), radius=RADIUS)
    return all(obstacles.edges(walk).min() > ROOM for walk in layout.walks)


def _among_objects(rng, apart):
    """Two objects with an opening between them; the other way leads past one of them."""
    width, depth = rng.uniform([7.0, 6.5], [10.0, 9.5])
    row, middle, gap = width * rng.uniform(0.42, 0.58), depth * rng.uniform(0.4, 0.6), rng.uniform(1.3, 1.9)
    sizes, offsets = rng.uniform([0.4, 0.5], [1.0, 1.3], (2, 2)), rng.uniform(-0.15, 0.15, 2)
    low, high = middle - gap / 2, middle + gap / 2
    lefts = row + offsets - sizes[:, 0] / 2
    rights, bottom, top = lefts + sizes[:, 0], low - sizes[0, 1], high + sizes[1, 1]
    objects = np.array([[lefts[0], bottom, rights[0], low], [lefts[1], high, rights[1], top]])
    below, above = (0.0, bottom), (top, depth)
    other = below if rng.random() < 0.5 else above
    if other[1] - other[0] < 1.2:
        return None
    return _layout(rng, (width, depth), row, np.empty((0, 4)), objects, ((low, high), other), apart)


def _behind_a_wall(rng, apart):
    """A wall of the map with two doors."""
    width, depth = rng.uniform([7.0, 6.5], [10.0, 9.5])
    row, thick = width * rng.uniform(0.42, 0.58), rng.uniform(0.1, 0.3)
    doors = rng.uniform(1.1, 1.6, 2)
    first = rng.uniform(0.5, depth - 0.9 - doors.sum())
    second = rng.uniform(first + doors[0] + 0.3, depth - 0.2 - doors[1])
    left, right = row - thick / 2, row + thick / 2
    openings = [(first, first + doors[0]), (second, second + doors[1])]
    ends = np.array([0.0, *np.ravel(openings), depth]).reshape(3, 2)
    walls = np.array([[left, low, right, high] for low, high in ends])
    objects = rng.uniform([[0.5, 0.5]] * 2, [[width - 1, depth - 1]] * 2)
    objects = np.hstack([objects, objects + rng.uniform(0.3, 0.6, (2, 2))])
    return _layout(rng, (width, depth), row, walls, objects, tuple(rng.permutation(openings).tolist()), apart)


def _layout(rng, size, row, walls, objects, openings, apart):
    """The layout with its walks and with boxes that close the first opening."""
    width, depth = size
    start, goal = rng.uniform([[0.8, 1.2], [width - 1.6, 1.2]], [[1.6, depth - 1.2], [width - 0.8, depth - 1.2]])
    starts = np.array([start, start])
    if apart:
        starts[1, 1] = rng.uniform(1.0, depth - 1.0)
        if not 0.8 < abs(starts[1, 1] - start[1]) < 2.5:
            return None
    vias = [_via(rng, opening, size, row) for opening in openings]
    walks = tuple(_walk(rng, [begin, *via, goal]) for begin, via in zip(starts, vias, strict=True))
    return Layout(size, row, walls, objects, _closing(rng, row, *openings[0]), openings, walks)


def _via(rng, opening, size, row):
    """Two places in an opening, before the row and behind it; in a wide one, some 0.7 m from the object."""
    low, high = opening
    y = (low + high) / 2
    if low == 0.0:
        y = max(y, high - rng.uniform(0.6, 0.9))
    elif high == size[1]:
        y = min(y, low + rng.uniform(0.6, 0.9))
    return [[row - 0.35, y], [row + 0.35, y]]


def _walk(rng, points):
    """A smooth walk (200, 2) through points, with sway of some cm, at 0.1 s per sample."""
    points = np.array(points)
    at = np.r_[0, np.hypot(*np.diff(points, axis=0).T).cumsum()]
    along = np.linspace(0, at[-1], 200)
    sway = 0.03 * np.sin(2 * np.pi * (along / rng.uniform(1.2, 1.6) + rng.random()))
    return CubicSpline(at, points)(along) + np.outer(sway * np.sin(np.pi * along / at[-1]), [0.3, 1.0])


def _closing(rng, row, low, high):
    """One to three boxes in an opening that leave no slit as wide as `SLIT`."""
    count = rng.integers(1, 4)
    slits = rng.uniform(0.0, min(SLIT, (high - low) / 2 / (count + 1)), count + 1)
    steps = np.column_stack([slits[:-1], _shares(rng, count, high - low - slits.sum())])
    bottoms, tops = (low + np.cumsum(steps)).reshape(count, 2).T
    middle, depth = row + rng.uniform(-0.1, 0.1), rng.uniform(0.3, 0.6)
    sides = np.full((2, count), [[middle - depth / 2], [middle + depth / 2]])
    return np.column_stack([sides[0], bottoms, sides[1], tops])


def _shares(rng, count, total):
    shares = rng.uniform(1, 2, count)
    return total * shares / shares.sum()


class Noticing(Unicycle):
    """Notices boxes (N, 4) from near."""

    def __init__(self, pose, boxes):
        self.boxes, self.seen = boxes, np.zeros(len(boxes), bool)
        super().__init__(pose)

    @property
    def noticed(self):
        """The boxes that it has come near to."""
        here = np.array(self.pose[:2])
        gaps = np.maximum(np.maximum(self.boxes[:, :2] - here, here - self.boxes[:, 2:]), 0.0)
        self.seen |= np.hypot(*gaps.T) < NOTICED
        return Environment(self.boxes[self.seen])


class Stopped(Unicycle):
    """Halts before what its map does not have, and drives on only where that leads away."""

    def __init__(self, pose, obstacles):
        self.obstacles = obstacles
        super().__init__(pose)

    def drive(self, speed, turn):
        """Move for one period, unless that would lead nearer than `STOPPED`."""
        x, y, theta = self.pose
        super().drive(speed, turn)
        edge = self.obstacles.edge(*self.pose[:2])
        if edge < STOPPED and edge < self.obstacles.edge(x, y):
            self.place((x, y, self.pose[2]))


def pose_near(rng, start):
    """Within some 0.1 m of a start, in any direction."""
    return (*(start + rng.normal(0, 0.1, 2).clip(-SPREAD, SPREAD)), rng.uniform(-np.pi, np.pi))


def stool_on(layout, rng):
    """The layout with a box on its usual way, no wider than the robot, in place of those that close it; or None."""
    law, obstacles = SequencedLDS.fit(layout.walks[0]), ObstacleMap.of(Environment(layout.objects), layout.background())
    for _ in range(200):
        size, centre = rng.uniform(0.2, 2 * RADIUS, 2), rng.permutation(layout.walks[0])[0] + rng.normal(0, 0.1, 2)
        free = obstacles.edge(*centre) + RADIUS - np.hypot(*size) / 2 > 2 * RADIUS + 2 * ROOM
        away = np.abs(np.array([layout.walks[0][0], *law.subgoals]) - centre) - size / 2 - RADIUS - ROOM
        away[0] -= SPREAD  # the robot does not start in contact
        if free and (away > 0).any(axis=1).all():
            return replace(layout, closing=np.hstack([centre - size / 2, centre + size / 2])[None])
    return None


def blocked_run(layout, seed, kind, control="pursuit"):
    """A run with boxes in the usual way, and how near it came to what truly stands there."""
    rng, background = np.random.default_rng([seed, 1]), layout.background()
    pose = pose_near(rng, layout.walks[0][0])
    truth = ObstacleMap.of(Environment(np.vstack([layout.objects, layout.closing])), background, radius=RADIUS)
    robot = {"noticed": lambda: Noticing(pose, layout.closing), "stopped": lambda: Stopped(pose, truth)}
    task = layout.task(kind not in robot)
    if kind == "law alone":
        task = SimpleNamespace(law=task.law, environment=task.environment)
    make = robot.get(kind, lambda: Unicycle(pose))
    run = perform(task, make(), control, background=background, timeout=300.0)
    return run, truth.edges(run.true_poses[:, :2]).min()


def measured(seeds, kind, control="pursuit"):
    """One row of the table for a kind of finding the boxes."""
    rows = []
    for seed in seeds:
        layout, drawings = drawn(seed)
        layout = stool_on(layout, np.random.default_rng([seed, 3])) if kind == "stool" else layout
        if layout is None:
            continue
        try:
            run, clearance = blocked_run(layout, seed, kind, control)
        except ValueError as error:
            rows.append((seed, False, False, False, np.nan, np.nan, drawings, str(error)))
            continue
        other = run.finished and layout.passed(run.true_poses[:, :2]) == "other"
        rows.append((seed, run.finished, other, clearance <= 0, clearance, run.t[-1], drawings, run.reason))
    names = ["seed", "finished", "other", "touched", "clearance", "time", "drawn", "reason"]
    return pd.DataFrame(rows, columns=names)


def open_runs(seeds):
    """Nothing in the way: which runs keep to the usual way, and which to the one that begins where they do."""
    rows = []
    for seed in seeds:
        layout, apart = drawn(seed)[0], drawn(seed, apart=True)[0]
        wanted, rng = seed // 2 % 2, np.random.default_rng([seed, 2])
        pose = pose_near(rng, layout.walks[0][0])
        usual = perform(layout.task(False), Unicycle(pose), background=layout.background())
        pose = pose_near(rng, apart.walks[wanted][0])
        fits = perform(apart.task(False), Unicycle(pose), background=apart.background())
        rows.append((seed, *(r.finished for r in (usual, fits)), (usual.way == 0).all(), (fits.way == wanted).all()))
    return pd.DataFrame(rows, columns=["seed", "finished_open", "finished_start", "open", "start"])


def main(first=FIRST, count=COUNT, *kinds):
    """Print one row for each kind, or each that is named, counts of layouts."""
    seeds, rows = range(int(first), int(first) + int(count)), []
    for kind, control in (each for each in KINDS if not kinds or each[0] in kinds):
        found = measured(seeds, kind, control)
        rows.append({"kind": f"{kind}, {control}", "layouts": len(found)})
        rows[-1] |= dict(found[["finished", "other", "touched"]].sum())
        rows[-1] |= {"least_clearance_m": found.clearance.min(), "median_time_s": found.time.median()}
        missed = found.other if kind in ("stool", "law alone") else ~found.other
        print(kind, found[missed | found.touched].to_string(index=False), file=sys.stderr)
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.2f}".format))
    print(f"layouts drawn per layout kept: {found.drawn.mean():.1f}")
    nothing = open_runs(seeds)
    print(nothing.drop(columns="seed").sum().to_string())
    print(nothing[~nothing.open | ~nothing.start].to_string(index=False), file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
