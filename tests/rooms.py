"""A room without PyBullet for tests: its map, its laser scans, and a figure-eight that was learned in it."""

from types import SimpleNamespace

import numpy as np

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.laser import LaserLog
from dollop.robot.geodesic import Geodesic
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import arc_length, at_arc_length

WIDTH, DEPTH, SIDE = 9.0, 7.0, 0.05
FURNITURE = np.array([[0.0, 5.0, 0.6, 6.2], [2.0, 6.3, 4.0, 7.0], [6.8, 0.0, 8.4, 0.7], [8.5, 4.2, 9.0, 5.0]])
WALLS = np.array([[-0.1, 0, 0, 7], [9, 0, 9.1, 7], [-0.1, -0.1, 9.1, 0], [-0.1, 7, 9.1, 7.1]])
CANS = np.array([[2.3, 3.4, 2.7, 3.8], [6.3, 3.4, 6.7, 3.8]])
ANGLES = np.deg2rad(np.arange(-90.0, 91.0))
SENSOR = np.array([4.5, 0.4, np.pi / 2])


def room_map():
    """Walls and furniture; as in a recorded map, surfaces run through the middle of cells."""
    return drawn_map([*FURNITURE, *WALLS], WIDTH, DEPTH)


def drawn_map(boxes, width, depth, border=0.1):
    """A map of boxes (N, 4) in m, the cells' middles at multiples of their side."""
    x, y = np.meshgrid(*(np.arange(-border, size + border + 1e-9, SIDE) for size in (width, depth)))
    blocked = np.zeros(x.shape, dtype=bool)
    for left, low, right, high in boxes:
        blocked |= (x > left - 1e-6) & (x < right + 1e-6) & (y > low - 1e-6) & (y < high + 1e-6)
    return OccupancyGrid(blocked.astype(float), (-border - SIDE / 2, -border - SIDE / 2), SIDE)


def scan(pose, boxes, rng=None, noise=0.005, angles=ANGLES):
    """Ranges (B,) in m from a pose (3,) to boxes (N, 4), by the slab method."""
    bearings = pose[2] + angles
    direction = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)[:, None]
    with np.errstate(divide="ignore"):
        low, high = ((boxes[:, side] - pose[:2]) / direction for side in ((0, 1), (2, 3)))
    near, far = np.minimum(low, high).max(axis=2), np.maximum(low, high).min(axis=2)
    ranges = np.where((near <= far) & (near > 0), near, np.inf).min(axis=1)
    return ranges if rng is None else np.maximum(ranges + noise * rng.standard_normal(len(ranges)), 0.2)


def disc_scans(pose, discs, radius, angles=ANGLES):
    """Ranges (T, B) in m from a pose (3,) to discs (T, K, 2), nan where there is none."""
    away = discs - pose[:2]
    along = away @ np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)])
    aside = (away**2).sum(axis=2, keepdims=True) - along**2
    hit = (aside < radius**2) & (along > 0)
    return np.where(hit, along - np.sqrt(np.where(hit, radius**2 - aside, 0.0)), np.inf).min(axis=1)


def watched(people, boxes=(), rate=10.0, radius=0.2, pose=SENSOR, angles=ANGLES, seed=0, noise=0.005):
    """A log of the room from one place, of bodies (T, K, 2) as discs, nan where there is none, and boxes (N, 4)."""
    rng, people = np.random.default_rng(seed), np.asarray(people, float)
    room = scan(pose, np.vstack([WALLS, FURNITURE, *(np.reshape(boxes, (-1, 4)))]), angles=angles)
    ranges = np.minimum(room, disc_scans(pose, people, radius, angles))
    ranges = np.maximum(ranges + noise * rng.standard_normal(ranges.shape), 0.05)
    t = np.arange(len(people)) / rate
    return LaserLog(t, ranges, angles, np.tile(pose, (len(t), 1)), 30.0)


def one_after_another(*logs):
    """Logs of one laser, one continuing where the other ends."""
    ends = np.cumsum([0.0, *(log.t[-1] + log.t[1] - log.t[0] for log in logs)])
    t = np.concatenate([log.t + end for log, end in zip(logs, ends, strict=False)])
    ranges, poses = (np.concatenate([getattr(log, name) for log in logs]) for name in ("ranges", "poses"))
    return LaserLog(t, ranges, logs[0].angles, poses, logs[0].max_range)


def nobody(seconds, rate=10.0):
    """As many scans without a person: (T, 1, 2)."""
    return np.full((round(seconds * rate), 1, 2), np.nan)


def walk(*points, speed=1.0, rate=10.0):
    """Places (T, 1, 2) of who walks through points at a speed in m/s, seen at a rate in 1/s."""
    return at_arc_length(points, np.arange(0, arc_length(points)[-1], speed / rate))[:, None]


def legs(places, apart=0.18, stride=0.6):
    """Two legs (T, 2, 2) of who walks through places (T, 1, 2): in turn one is ahead and the other behind."""
    middle = places[:, 0]
    way = np.gradient(middle, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    across = np.column_stack([-way[:, 1], way[:, 0]])
    swing = stride / 2 * np.sin(2 * np.pi * arc_length(middle) / (2 * stride))
    left = apart / 2 * across + swing[:, None] * way
    return np.stack([middle + left, middle - left], axis=1)


def together(*people):
    """People (T, K, 2) at the same time, those who have gone nan: (T, sum of K, 2)."""
    longest = max(map(len, people))
    gone = (np.full((longest - len(each), *each.shape[1:]), np.nan) for each in people)
    return np.concatenate([np.concatenate(each) for each in zip(people, gone, strict=True)], axis=1)


def figure_eight(samples=240):
    """One lap round the two cans, about 17 m: (N, 2)."""
    phase = np.linspace(0, 2 * np.pi, samples)
    x = 4.5 + 3.3 * np.sin(phase)
    y = 3.6 - 1.35 * np.sin(2 * phase) * (1 - 0.12 * np.cos(phase) ** 2)
    return np.column_stack([x, y])


def figure_eight_task():
    """The figure-eight as a task: its law, and the two cans as its environment."""
    return SimpleNamespace(law=SequencedLDS.fit(figure_eight()), environment=Environment(CANS))


def free_poses(count, obstacles, goal, seed, room=0.05):
    """Poses (count, 3) anywhere on a map with that much room in m, from which the goal is reached."""
    rng, reachable, poses = np.random.default_rng(seed), Geodesic(obstacles, goal), []
    while len(poses) < count:
        x, y, theta = rng.uniform([0.0, 0.0, -np.pi], [WIDTH, DEPTH, np.pi])
        if obstacles.edge(x, y) > room and np.isfinite(reachable.distance(x, y)):
            poses.append((x, y, theta))
    return np.array(poses)
