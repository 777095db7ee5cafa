"""Tasks among objects, drawn at random by a generator that knows nothing of the model that is learned.

A task is a few via-points, each at a fixed offset from one of some objects; other objects play no part. In a layout,
the person walks a spline through the via-points where they are there, each missed by a scatter, with a sway along the
way and noise on each sample, so that no two walks are alike. What the person would do without scatter, sway and noise
is the truth in that layout.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dollop.environment import Environment

ROOM, APART, BOX = 6.0, 0.9, (0.25, 0.6)
"""m: side of the room, least distance between centres of objects, and range of their sides."""
PERIOD = 0.1


@dataclass(frozen=True, eq=False)
class DrawnTask:
    """V via-points beside objects.

    `objects` (V,) int the object of each, `offsets` (V, 2) in m from its centre, `sizes` (N, 2) in m of all objects,
    `knots` the power of the distance between via-points that spaces the spline's knots, `ends` its end condition.
    """

    objects: np.ndarray
    offsets: np.ndarray
    sizes: np.ndarray
    knots: float
    ends: str

    def via(self, centres):
        """(V, 2): where the via-points are among objects at `centres` (N, 2)."""
        return centres[self.objects] + self.offsets

    def way(self, centres, scatter=0.0, samples=120):
        """(samples, 2): what the person means to walk there, each via-point missed by `scatter` (V, 2) in m."""
        return way_through(self.via(centres) + scatter, self.knots, self.ends, samples)

    def environment(self, centres):
        """The objects as boxes."""
        return Environment(np.hstack([centres - self.sizes / 2, centres + self.sizes / 2]))


def draw_task(n_objects, rng, followed=None):
    """A task of 4 to 7 via-points beside two objects at least, neighbours mostly beside different ones."""
    count = int(rng.integers(4, 8))
    followed = min(n_objects, int(rng.integers(2, 5))) if followed is None else followed
    chosen = rng.choice(n_objects, followed, replace=False)
    objects = rng.choice(chosen, count)
    again = np.flatnonzero(objects[1:] == objects[:-1]) + 1
    objects[again] = rng.choice(chosen, len(again))
    angle, distance = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.45, 0.9, count)
    offsets = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    knots, ends = rng.choice([0.0, 0.5, 1.0]), str(rng.choice(["natural", "not-a-knot"]))
    return DrawnTask(objects, offsets, rng.uniform(*BOX, (n_objects, 2)), knots, ends)


def draw_layout(n_objects, rng):
    """(N, 2): centres anywhere in the room, no two nearer than `APART`."""
    centres = []
    while len(centres) < n_objects:
        place = rng.uniform(-ROOM / 2, ROOM / 2, 2)
        if all(np.hypot(*(place - other)) > APART for other in centres):
            centres.append(place)
    return np.array(centres)


def draw_layouts(n_objects, count, rng, kind="anywhere"):
    """So many layouts: "anywhere", "moved" by 0.5 m each from the first in any direction, or "still"."""
    first = draw_layout(n_objects, rng)
    if kind == "anywhere":
        return [first, *(draw_layout(n_objects, rng) for _ in range(count - 1))]
    turns = rng.uniform(-np.pi, np.pi, (count, n_objects)) if kind == "moved" else None
    if kind == "still":
        return [first] * count
    return list(first + 0.5 * np.stack([np.cos(turns), np.sin(turns)], axis=2))


def way_through(via, knots=0.5, ends="natural", samples=120):
    """(samples, 2): a spline through via-points, at even steps of its length."""
    at = np.r_[0, np.maximum(np.hypot(*np.diff(via, axis=0).T), 1e-3) ** knots].cumsum()
    way = scipy.interpolate.CubicSpline(at, via, bc_type=ends)(np.linspace(0, at[-1], 20 * samples))
    length = np.r_[0, np.hypot(*np.diff(way, axis=0).T).cumsum()]
    return np.stack([np.interp(np.linspace(0, length[-1], samples), length, c) for c in way.T], axis=1)


def walked(task, centres, rng, scatter=0.05, sway=0.03, noise=0.01):
    """One walk of the task among objects at `centres`: (N, 2) in m."""
    shape = task.offsets.shape
    way = task.way(centres, rng.normal(0, scatter, shape), samples=25 * len(task.offsets))
    length = np.r_[0, np.hypot(*np.diff(way, axis=0).T).cumsum()]
    direction = np.gradient(way, axis=0)
    direction /= np.maximum(np.hypot(*direction.T), 1e-9)[:, None]
    aside = direction[:, ::-1] * [-1, 1]
    swaying = sway * np.sin(2 * np.pi * length / rng.uniform(1.5, 3.0) + rng.uniform(0, 2 * np.pi))
    return way + swaying[:, None] * aside + rng.normal(0, noise, way.shape)


def size_of(way):
    """Diagonal in m of the box round a way."""
    return float(np.hypot(*np.ptp(way, axis=0)))


def other_way(task, rng):
    """The same task done in another way: same beginning and end, between them beside other objects or on other sides."""
    offsets, objects = task.offsets.copy(), task.objects.copy()
    middle = np.arange(1, len(objects) - 1)
    changed = rng.choice(middle, max(1, len(middle) - int(rng.integers(0, 2))), replace=False)
    offsets[changed] = -offsets[changed]
    for k in changed[rng.random(len(changed)) < 0.5]:
        objects[k] = rng.integers(len(task.sizes))
    return DrawnTask(objects, offsets, task.sizes, task.knots, task.ends)
