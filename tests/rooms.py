"""A room without PyBullet for tests: its map, its laser scans, and a figure-eight that was learned in it."""

from types import SimpleNamespace

import numpy as np

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot.avoidance import Geodesic
from dollop.sequenced_lds import SequencedLDS

WIDTH, DEPTH, SIDE = 9.0, 7.0, 0.05
FURNITURE = np.array([[0.0, 5.0, 0.6, 6.2], [2.0, 6.3, 4.0, 7.0], [6.8, 0.0, 8.4, 0.7], [8.5, 4.2, 9.0, 5.0]])
WALLS = np.array([[-0.1, 0, 0, 7], [9, 0, 9.1, 7], [-0.1, -0.1, 9.1, 0], [-0.1, 7, 9.1, 7.1]])
CANS = np.array([[2.3, 3.4, 2.7, 3.8], [6.3, 3.4, 6.7, 3.8]])
ANGLES = np.deg2rad(np.arange(-90.0, 91.0))


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


def scan(pose, boxes, rng=None, noise=0.005):
    """Ranges (B,) in m from a pose (3,) to boxes (N, 4), by the slab method."""
    bearings = pose[2] + ANGLES
    direction = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)[:, None]
    with np.errstate(divide="ignore"):
        low, high = ((boxes[:, side] - pose[:2]) / direction for side in ((0, 1), (2, 3)))
    near, far = np.minimum(low, high).max(axis=2), np.maximum(low, high).min(axis=2)
    ranges = np.where((near <= far) & (near > 0), near, np.inf).min(axis=1)
    return ranges if rng is None else np.maximum(ranges + noise * rng.standard_normal(len(ranges)), 0.2)


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
