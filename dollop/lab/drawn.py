"""Layouts of objects and demonstrations of tasks drawn at random, with known truth, for measuring.

Nothing here needs PyBullet: what the laser would have seen is drawn, not simulated.
"""

import numpy as np

from dollop.environment import Environment
from dollop.pose import rotation

__all__ = ["TASKS", "draw_demonstrations", "random_layouts"]

TASKS = {
    "slalom": ((0.0, 0.0), (1.5, 0.9), (3.0, -0.9), (4.5, 0.9), (6.0, -0.9), (7.5, 0.0)),
    "figure-eight": ((-2.0, 0.0), (0.0, 0.0), (1.5, 1.2), (3.0, 0.0), (0.0, 0.0), (-1.5, 1.2)),
    "ring": tuple((2 * np.cos(a), 2 * np.sin(a)) for a in np.arange(6) * np.pi / 3),
}
"""The true subgoals of each task in m, six each."""
DRAWS = 10_000
"""Times that objects are drawn to stand apart."""


def draw_demonstrations(task, n, spread, extra=0.3, seed=0):
    """Draw demonstrations of a task: subgoals that scatter, and in some of them one too many.

    A set-up of our own, for the paper compares its learning with nothing. The additional subgoal
    comes anywhere in the order, before the first and after the last included. Its position is
    anywhere within the task's bounding box widened by half a metre.

    Parameters
    ----------
    task : (K, 2) array_like
        The true subgoals in m.
    n : int
        Number of demonstrations.
    spread : float
        Standard deviation of a subgoal along each axis in m.
    extra : float
        Probability that a demonstration has one more subgoal.
    seed : int or numpy.random.Generator

    Returns
    -------
    list of (K, 2) or (K + 1, 2) float arrays
    """
    task, random = np.asarray(task, float), np.random.default_rng(seed)
    low, high = task.min(0) - 0.5, task.max(0) + 0.5
    demonstrations = []
    for _ in range(n):
        subgoals = task + random.normal(0, spread, task.shape)
        position, stray = random.integers(len(task) + 1), random.uniform(low, high)
        has_one = random.random() < extra
        demonstrations.append(np.insert(subgoals, position, stray, axis=0) if has_one else subgoals)
    return demonstrations


_CHANGES = {"none": (0, 0), "missing": (0, 1), "added": (1, 0)}


def random_layouts(objects, generator, noise=0.05, moved=0.4, room=6.0, size=0.4, gap=0.4, change="none", turn=0.0):
    """Boxes that stand anywhere in a room, then moved a little, and seen inexactly both times.

    A set-up of our own: the paper draws one layout (Fig. 8).

    Parameters
    ----------
    objects : int
        How many there are before.
    generator : numpy.random.Generator
        Source of chance.
    noise : float
        Each extent of each box is seen off by up to this much, in m, uniformly.
    moved : float
        Standard deviation of each object's move per axis, in m.
    room, size, gap : float
        Side of the room, side of a box, and the least gap between two boxes along x or y before and
        after the move, in m. With less than about 0.4 m nobody could walk between them.
    change : {"none", "missing", "added"}
        Whether afterwards one of the objects is missing, or another one has come.
    turn : float
        The layout is also turned about its middle, in rad.

    Returns
    -------
    before, after : Environment
        In random order.
    partners : (objects,) int array
        Which object of `after` each object of `before` is, -1 where it is missing.

    Raises
    ------
    ValueError
        If 10,000 draws do not find room for the objects.
    """
    arrivals, departures = _CHANGES[change]
    total = objects + arrivals
    shape, distance = (total, 2), size + gap
    old = _apart(lambda: generator.uniform(size / 2, room - size / 2, shape), distance)
    new = _apart(lambda: _turned(old, turn) + generator.normal(0, moved, shape), distance)
    old, order = old[:objects], generator.permutation(total)[departures:]
    places = np.full(total, -1)
    places[order] = np.arange(len(order))
    before, after = (_seen(centres, size, noise, generator) for centres in (old, new[order]))
    return before, after, places[:objects]


def _apart(draw, distance):
    """Positions (N, 2), drawn anew until no two are nearer than `distance` in both x and y."""
    for _ in range(DRAWS):
        positions = draw()
        distances = np.abs(positions - positions[:, None]).max(axis=2)
        if (distances + distance * np.eye(len(positions))).min() >= distance:
            return positions
    rule = f"objects must find places {distance:g} m apart within {DRAWS} draws"
    raise ValueError(f"{rule}, got none for {len(positions)}: the room is too small")


def _turned(positions, turn):
    middle = positions.mean(axis=0)
    return middle + (positions - middle) @ rotation(turn).T


def _seen(centres, size, noise, generator):
    halves = (size + generator.uniform(-noise, noise, centres.shape)) / 2
    return Environment(np.hstack([centres - halves, centres + halves]))
