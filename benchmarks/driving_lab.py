"""The Pioneer in PyBullet, which finds itself by its laser, in rooms drawn at random: `benchmarks.driving --pybullet`.

The rooms are those of `dollop.replication.worlds`, one for each seed: the map is recorded by a drive through the empty
room, the task is learned from the true walks and adapted to where the objects stand afterwards, so that driving alone
is judged. Each is performed never kidnapped and once, to a place that is free and from which there is a way.

The way exists by the true outlines of all that stands there, at the floor and at the height of the laser, and by the
boxes round the objects, for the robot knows no other shape; the margin is the largest in m with which it does. Touching
is what the physics feel.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
from scipy.ndimage import label

import dollop
from benchmarks.furnished import distance_to_boxes
from dollop.lab import Pioneer, World, record_tour, walk_of
from dollop.lab.outlines import outline_distances
from dollop.replication.worlds.draw import draw

GROUPS = ("radius", "kidnappings")
MARGINS = 0.0, 0.02, 0.05, 0.067
STEP, REACH, TIMEOUT = 0.03, 0.25, 400.0
"""m between the points of the flood fill, m within which a segment hands over, s."""
WRONG = 0.5
"""m: a pose that is believed is wrong from so far off on; after a kidnapping it takes some scans to notice."""
FLOOR = 0.01
"""Height in m at which a cone is widest."""


class Ground:
    """True distances to all that stands in a scene."""

    def __init__(self, scene):
        self.outlines = list(scene.section)
        feet = (each.outline(FLOOR) for each in scene.objects)
        self.outlines += [each for each in feet if each is not None]
        self.scene = scene
        low, high = np.split(np.asarray(scene.room.bounds, float), 2)
        self.x, self.y = (np.arange(a, b, STEP) for a, b in zip(low, high, strict=True))
        places = np.stack(np.meshgrid(self.x, self.y), axis=-1)
        places = places.reshape(-1, 2)
        clear = np.minimum(self.distance(places), distance_to_boxes(places, scene.boxes))
        self.clear = clear.reshape(len(self.y), len(self.x))

    def distance(self, places):
        """Distances (N,) in m from places (N, 2) to walls, furniture and objects; 0 within them and outside."""
        away = outline_distances(places, self.outlines).min(axis=1)
        return np.where(self.scene.room.distance(places) > -1e-9, np.maximum(away, 0.0), 0.0)

    def part_at(self, parts, place, within):
        """Numbers of the parts that come so near in m to a place."""
        near = np.hypot(self.x - place[0], (self.y - place[1])[:, None]) <= within
        return set(parts[near].tolist()) - {0}

    def margin(self, poses, subgoals, radius):
        """The largest margin with which a way of that width exists; -1 where none does."""
        held = -1.0
        for margin in MARGINS:
            parts = label(self.clear >= radius + margin, np.ones((3, 3)))[0]
            common = [self.part_at(parts, pose, 1.5 * STEP) for pose in poses]
            common += [self.part_at(parts, subgoal, REACH) for subgoal in subgoals]
            if not set.intersection(*common):
                break
            held = margin
        return held


def task_of(world):
    """The task that the true walks show, where the objects stand afterwards."""
    task = dollop.learn([demonstration(scene) for scene in world.demonstrations])
    boxes = world.later.boxes
    if not len(boxes):
        return task
    return task.adapt(dollop.Environment(boxes), dollop.Matching(np.arange(4 * len(boxes)), 0.0, np.inf, True))


def demonstration(scene):
    """What the first person of a scene truly walks, ten positions a second."""
    walk = walk_of(scene.people[0], scene)
    step = max(1, round(0.1 / float(np.median(np.diff(walk.t)))))
    t, positions = walk.t[::step], walk.positions[::step]
    laps = dollop.laps(t, positions)
    period = float(np.median(np.diff(t)))
    return dollop.Demonstration(laps if len(laps) > 1 else positions, dollop.Environment(scene.boxes), period)


def poses_in(ground, task, seed, radius):
    """A start near that of the task, and a kidnapping (time, pose) to a place that is free and reached from there."""
    rng = np.random.default_rng([seed, 16])
    way = task.law.response()
    ahead = way[min(5, len(way) - 1)] - way[0]
    starts = [*way[0], np.arctan2(ahead[1], ahead[0])] + rng.normal(0, [0.15, 0.15, np.radians(20)], (50, 3))
    start = starts[(ground.distance(starts[:, :2]) > radius + 0.05).argmax()]
    parts = label(ground.clear >= radius + 0.07, np.ones((3, 3)))[0]
    here = ground.part_at(parts, start, REACH)
    rows, columns = np.nonzero(np.isin(parts, list(here)) if here else ground.clear > radius + 0.07)
    k = rng.integers(len(rows))
    lasting = np.hypot(*np.diff(way, axis=0).T).sum() / 0.4
    pose = ground.x[columns[k]], ground.y[rows[k]], rng.uniform(-np.pi, np.pi)
    return start, (float(rng.uniform(2.0, max(0.8 * lasting, 4.0))), tuple(map(float, pose)))


def rows_of(seed, radii, kidnappings=(0, 1)):
    """A row for each radius that the Pioneer is taken to have, and number of kidnappings, in the room of a seed."""
    world = draw(seed)
    head, cases = {"seed": seed, "kind": world.kind, "room": world.shape}, list(product(radii, kidnappings))
    try:
        task = task_of(world)
    except ValueError as error:
        why = {"margin": np.nan, "outcome": "not learned", "reason": str(error)}
        return [head | {"radius": radius, "kidnappings": n} | why for radius, n in cases]
    background = dollop.OccupancyGrid.from_log(record_tour(world.empty, world.tour, [seed, 20]))
    ground = Ground(world.later)
    return [head | driven(world, task, background, ground, *case) for case in cases]


def driven(world, task, background, ground, radius, kidnappings):
    """What came of one run."""
    start, kidnapping = poses_in(ground, task, world.seed, radius)
    kidnap = [kidnapping][:kidnappings]
    places = [start[:2], *(pose[:2] for _, pose in kidnap)]
    row = {"radius": radius, "kidnappings": kidnappings}
    row |= {"margin": ground.margin(places, task.law.subgoals, radius)}
    scanner = world.later.robot.scanner
    scanner = replace(scanner, model=f"{scanner.model}, thinned", rate=min(10.0, scanner.rate))
    with World(replace(world.later, people=(), moves=())) as room:
        robot = Pioneer(room, start, background, task.environment, [world.seed, 50], scanner=scanner)
        robot.radius = radius
        try:
            run = dollop.perform(task, robot, background=background, kidnap=kidnap, timeout=TIMEOUT)
        except ValueError as error:
            return row | {"outcome": "refused", "reason": str(error)}
    return row | measures(run, ground, task)


def measures(run, ground, task):
    """What the truth says of a run, and the run of itself."""
    exact = ground.distance(run.true_poses[:, :2]) - run.radius
    off, period = np.hypot(*(run.poses - run.true_poses)[run.localised, :2].T), run.t[-1] / max(len(run.t) - 1, 1)
    end = np.hypot(*(run.true_poses[-1, :2] - task.ways[int(run.way[-1])].subgoals[-1]))
    return {
        "outcome": "finished" if run.finished else "not finished",
        "reason": run.reason,
        "touched": run.collisions,
        "clearance": exact.min(),
        "told_clearance": run.clearance.min(),
        "end": end,
        "pose_error": off.mean(),
        "wrong_s": period * np.count_nonzero(off > WRONG),
        "lost_s": period * np.count_nonzero(~run.localised),
        "kidnapped": len(run.kidnapped),
        "seconds": run.t[-1],
    }


def summary(table):
    """One row per radius and number of kidnappings."""
    rows = []
    for (radius, kidnappings), part in table.groupby(["radius", "kidnappings"]):
        row = {"radius": radius, "kidnappings": kidnappings, "runs": len(part)}
        row["finished"] = int((part.outcome == "finished").sum())
        for margin in MARGINS:
            some = part[part.margin >= margin]
            row[f"way_{100 * margin:g}cm"] = f"{(some.outcome == 'finished').sum()}/{len(some)}"
        row |= {"touched": int((part.touched > 0).sum()), "least_clearance": part.clearance.min()}
        row |= {"farthest_end": part[part.outcome == "finished"].end.max(), "pose_error": part.pose_error.mean()}
        rows.append(row | {"longest_wrong_s": part.wrong_s.max()})
    return pd.DataFrame(rows)
