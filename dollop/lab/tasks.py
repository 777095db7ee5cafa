"""Tasks among objects, drawn at random by a generator that knows nothing of what is learned.

A task is a few via-points, each at a fixed offset from one of some objects; other objects play no
part. In a layout, the person walks a spline through the via-points where they are there, each missed
by a scatter, with a sway along the way and noise on each sample, so that no two walks are alike.
What the person would do without scatter, sway and noise is the truth in that layout.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dollop.checks import check_choice, checked_number
from dollop.environment import Environment

__all__ = [
    "DrawnTask", "draw_layout", "draw_layouts", "draw_task", "other_way", "size_of", "walked", "way_through",
]  # fmt: skip

ROOM, APART, BOX = 6.0, 0.9, (0.25, 0.6)
"""m: side of the room, least distance between centres of objects, and range of their sides."""
MOST = 20
"""Objects that a room of that size surely holds that far apart."""
MOVED = 0.5
"""m by which each object of a layout that is "moved" stands off one and the same place."""
KINDS = ("anywhere", "moved", "still")


@dataclass(frozen=True, eq=False)
class DrawnTask:
    """V via-points beside some of N objects (a set-up of our own).

    Attributes
    ----------
    objects : (V,) int array
        The object that each via-point follows.
    offsets : (V, 2) float array
        Each via-point from the middle of its object, in m.
    sizes : (N, 2) float array
        Of all objects along x and y, in m.
    knots : float
        The power of the distance between via-points by which the spline's knots are spaced.
    ends : str
        The spline's end condition, as scipy's `CubicSpline` names it.
    """

    objects: np.ndarray
    offsets: np.ndarray
    sizes: np.ndarray
    knots: float
    ends: str

    def via(self, centres):
        """Where the via-points are.

        Parameters
        ----------
        centres : (N, 2) float array
            Of the objects, in m.

        Returns
        -------
        (V, 2) float array
            In m.
        """
        return centres[self.objects] + self.offsets

    def way(self, centres, scatter=0.0, samples=120):
        """What the person means to walk.

        Parameters
        ----------
        centres : (N, 2) float array
            Of the objects, in m.
        scatter : (V, 2) float array or float
            By which each via-point is missed, in m.
        samples : int

        Returns
        -------
        (samples, 2) float array
            At equal distances, in m.

        Examples
        --------
        Where all objects have moved by the same, the way has.

        >>> task, rng = draw_task(3, np.random.default_rng(0)), np.random.default_rng(1)
        >>> centres = draw_layout(3, rng)
        >>> bool(np.allclose(task.way(centres + [1.0, 2.0]), task.way(centres) + [1.0, 2.0]))
        True
        """
        return way_through(self.via(centres) + scatter, self.knots, self.ends, samples)

    def environment(self, centres):
        """The objects as boxes.

        Parameters
        ----------
        centres : (N, 2) float array
            Of the objects, in m.

        Returns
        -------
        Environment
        """
        return Environment(np.hstack([centres - self.sizes / 2, centres + self.sizes / 2]))


def draw_task(n_objects, rng, followed=None):
    """Draw a task of 4 to 7 via-points beside two objects at least.

    Via-points that follow each other are mostly beside different objects.

    Parameters
    ----------
    n_objects : int
        N.
    rng : numpy.random.Generator
        Source of chance.
    followed : int, optional
        How many of the objects play a part; 2 to 4 by chance when not given.

    Returns
    -------
    DrawnTask
    """
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
    """Draw where objects stand, anywhere in the room, no two nearer than `APART`.

    Parameters
    ----------
    n_objects : int
        N, at most `MOST`.
    rng : numpy.random.Generator
        Source of chance.

    Returns
    -------
    (N, 2) float array
        Their middles in m.

    Raises
    ------
    ValueError
        For more objects than the room holds.
    """
    checked_number("n_objects", n_objects, 0, MOST)
    centres = []
    while len(centres) < n_objects:
        place = rng.uniform(-ROOM / 2, ROOM / 2, 2)
        if all(np.hypot(*(place - other)) > APART for other in centres):
            centres.append(place)
    return np.array(centres)


def draw_layouts(n_objects, count, rng, kind="anywhere"):
    """Draw so many layouts of the same objects.

    Parameters
    ----------
    n_objects : int
        N.
    count : int
        How many layouts.
    rng : numpy.random.Generator
        Source of chance.
    kind : {"anywhere", "moved", "still"}
        Each drawn anew; in each every object 0.5 m, in any direction, from one and the same place;
        or all the same.

    Returns
    -------
    list of (N, 2) float arrays
        Middles of the objects, in m.

    Raises
    ------
    ValueError
        For another kind, or more objects than the room holds.
    """
    check_choice("kind", kind, KINDS)
    first = draw_layout(n_objects, rng)
    if kind == "anywhere":
        return [first, *(draw_layout(n_objects, rng) for _ in range(count - 1))]
    if kind == "still":
        return [first] * count
    turns = rng.uniform(-np.pi, np.pi, (count, n_objects))
    return list(first + MOVED * np.stack([np.cos(turns), np.sin(turns)], axis=2))


def way_through(via, knots=0.5, ends="natural", samples=120):
    """A spline through via-points.

    Parameters
    ----------
    via : (V, 2) float array
        In m.
    knots : float
        The power of the distance between via-points by which the knots are spaced.
    ends : str
        End condition, as scipy's `CubicSpline` names it.
    samples : int

    Returns
    -------
    (samples, 2) float array
        At equal distances, in m.

    Examples
    --------
    >>> via = np.array([[0.0, 0.0], [3.0, 0.0], [4.0, 0.0]])
    >>> way_through(via, knots=1.0, samples=5).round(6).tolist()
    [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]]
    """
    at = np.r_[0, np.maximum(np.hypot(*np.diff(via, axis=0).T), 1e-3) ** knots].cumsum()
    way = scipy.interpolate.CubicSpline(at, via, bc_type=ends)(np.linspace(0, at[-1], 20 * samples))
    length = np.r_[0, np.hypot(*np.diff(way, axis=0).T).cumsum()]
    even = np.linspace(0, length[-1], samples)
    return np.stack([np.interp(even, length, axis) for axis in way.T], axis=1)


def walked(task, centres, rng, scatter=0.05, sway=0.03, noise=0.01):
    """One walk of a task, as a person would walk it who never does so twice alike.

    Parameters
    ----------
    task : DrawnTask
        Of V via-points.
    centres : (N, 2) float array
        Of the objects, in m.
    rng : numpy.random.Generator
        Source of chance.
    scatter : float
        Standard deviation in m by which a via-point is missed along each axis.
    sway : float
        In m to either side, once in 1.5 to 3 m of the way.
    noise : float
        Standard deviation in m of each sample along each axis.

    Returns
    -------
    (25 V, 2) float array
        In m.
    """
    shape = task.offsets.shape
    way = task.way(centres, rng.normal(0, scatter, shape), samples=25 * len(task.offsets))
    length = np.r_[0, np.hypot(*np.diff(way, axis=0).T).cumsum()]
    direction = np.gradient(way, axis=0)
    direction /= np.maximum(np.hypot(*direction.T), 1e-9)[:, None]
    aside = direction[:, ::-1] * [-1, 1]
    swaying = sway * np.sin(2 * np.pi * length / rng.uniform(1.5, 3.0) + rng.uniform(0, 2 * np.pi))
    return way + swaying[:, None] * aside + rng.normal(0, noise, way.shape)


def size_of(way):
    """Diagonal of the box round a way.

    Parameters
    ----------
    way : (N, 2) float array
        In m.

    Returns
    -------
    float
        In m.

    Examples
    --------
    >>> size_of(np.array([[0.0, 0.0], [3.0, 4.0], [1.0, 1.0]]))
    5.0
    """
    return float(np.hypot(*np.ptp(way, axis=0)))


def other_way(task, rng):
    """The same task in another way, from the same beginning to the same end.

    Between them, most via-points are on the other side of their object, and half of those beside
    any object.

    Parameters
    ----------
    task : DrawnTask
    rng : numpy.random.Generator
        Source of chance.

    Returns
    -------
    DrawnTask
    """
    offsets, objects = task.offsets.copy(), task.objects.copy()
    middle = np.arange(1, len(objects) - 1)
    changed = rng.choice(middle, max(1, len(middle) - int(rng.integers(0, 2))), replace=False)
    offsets[changed] = -offsets[changed]
    for k in changed[rng.random(len(changed)) < 0.5]:
        objects[k] = rng.integers(len(task.sizes))
    return DrawnTask(objects, offsets, task.sizes, task.knots, task.ends)
