"""Rooms: an outline of any shape, and the furniture that always stands there, the background of Sec. II.

The paper's laboratory is one of them, a reconstruction: the paper shows it in one photograph
(Fig. 5). It is 9 m by 7 m, its lower left corner the origin of the world. Nothing here needs
PyBullet.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dollop.checks import (
    FARTHEST,
    check_choice,
    check_positive,
    checked_array,
    checked_number,
    checked_positions,
    put_in,
)
from dollop.lab.outlines import (
    Outline,
    crosses_itself,
    gaps,
    inside,
    outline_distances,
    wall_distances,
)

__all__ = [
    "GREY",
    "LABORATORY",
    "OAK",
    "Part",
    "Room",
    "STEEL",
    "WALL_THICKNESS",
    "WHITE",
    "panel",
    "walls",
]

WALL_THICKNESS = 0.10
MOST_CORNERS, LARGEST = 100, 200.0
"""Corners, and m: rooms are no larger."""
OAK, STEEL, WHITE = (0.72, 0.53, 0.33), (0.55, 0.58, 0.62), (0.90, 0.89, 0.85)
DARK, GREY, BLUE = (0.13, 0.14, 0.16), (0.42, 0.44, 0.47), (0.30, 0.48, 0.66)


@dataclass(frozen=True)
class Part:
    """One upright box or cylinder of a thing.

    Attributes
    ----------
    shape : str
        "box" or "cylinder".
    centre : tuple of 3 floats
        x, y, z in m.
    size : tuple of 3 floats
        Full extent along x, y, z in m; of a cylinder the first two are its diameter.
    colour : tuple of 3 floats
        Red, green, blue in 0 to 1.
    turn : float
        About the vertical, in rad.

    Raises
    ------
    ValueError
        If the shape is neither, or a number is not finite or not positive where it must be.
    """

    shape: str
    centre: tuple
    size: tuple
    colour: tuple = GREY
    turn: float = 0.0

    def __post_init__(self):
        check_choice("shape", self.shape, ("box", "cylinder"))
        for name in ("centre", "size", "colour"):
            values = checked_array(name, getattr(self, name), 3, least=-FARTHEST, most=FARTHEST)
            object.__setattr__(self, name, tuple(values.tolist()))
        check_positive("size", min(self.size))
        if max(self.size) > LARGEST:
            raise ValueError(f"a part must be at most {LARGEST:g} m large, got {self.size}")
        if self.shape == "cylinder" and self.size[0] != self.size[1]:
            raise ValueError(f"a cylinder must be as deep as wide, got {self.size[:2]}")
        put_in(self, turn=checked_number("turn", self.turn))

    @property
    def outline(self):
        """Outline of its footprint."""
        (x, y, _), (width, depth, _) = self.centre, self.size
        if self.shape == "cylinder":
            return Outline(x, y, radius=width / 2)
        return Outline(x, y, width / 2, depth / 2, self.turn)

    def reaches(self, height):
        """Whether a plane at some height cuts it.

        Parameters
        ----------
        height : float
            Over the floor in m.

        Returns
        -------
        bool
        """
        return abs(height - self.centre[2]) < self.size[2] / 2


@dataclass(frozen=True, eq=False)
class Room:
    """What is always there: walls and furniture (the background of Sec. II).

    Attributes
    ----------
    corners : (K, 2) float array
        Of the floor in m, counter-clockwise; walls stand outside of it.
    furniture : tuple of Part
        Inner walls included.
    height : float
        Of the walls in m.

    Raises
    ------
    ValueError
        If there are fewer than three corners or too many, walls cross or stand in the floor, or the middle of
        a piece of furniture is outside, or its foot below the floor.

    Examples
    --------
    Clockwise corners are turned round.

    >>> Room([(0, 0), (0, 4), (5, 4), (5, 0)]).corners.tolist()
    [[5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]]
    """

    corners: np.ndarray
    furniture: tuple = ()
    height: float = 2.4

    def __post_init__(self):
        corners = checked_array("the corners of a room", self.corners, "N", 2)
        corners = checked_positions("the corners of a room", corners)
        if len(corners) < 3:
            raise ValueError(f"a room needs three corners or more, got {len(corners)}")
        if len(corners) > MOST_CORNERS or np.ptp(corners, axis=0).max() > LARGEST:
            rule = f"a room must have at most {MOST_CORNERS} corners and be {LARGEST:g} m long at most"
            raise ValueError(f"{rule}, got {len(corners)} and {np.ptp(corners, axis=0).max():g} m")
        checked_number("the height of a room", self.height, 0.1, 20)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        if lengths.min() < WALL_THICKNESS:
            rule = f"a wall must be at least {WALL_THICKNESS} m long"
            raise ValueError(f"{rule}, got {lengths.min():.3f} m at corner {lengths.argmin()}")
        crossing = crosses_itself(corners)
        if crossing:
            raise ValueError(f"the walls of a room must not cross, got walls {crossing[0]} and {crossing[1]}")
        area = twice_the_area(corners)
        if area < 0:
            corners = corners[::-1].copy()
        check_positive("the floor of a room", abs(area) / 2)
        check_walls(corners)
        put_in(self, corners=corners, furniture=tuple(self.furniture), height=float(self.height))
        for part in self.furniture:
            if not inside(np.array([part.centre[:2]]), corners)[0] or part.centre[2] < part.size[2] / 2 - 0.01:
                place = tuple(round(value, 2) for value in part.centre[:2])
                raise ValueError(f"furniture must stand in the room, got a {part.shape} at {place}")

    def __repr__(self):
        width, depth = np.ptp(self.corners, axis=0)
        return f"Room of {len(self.corners)} walls, {width:.1f} m by {depth:.1f} m, {len(self.furniture)} parts in it"

    @cached_property
    def parts(self):
        """Walls and furniture, tuple of Part."""
        return (*walls(self), *self.furniture)

    @cached_property
    def outlines(self):
        """Outlines of all of them, (M, 6) array."""
        return np.array([part.outline for part in self.parts])

    @property
    def bounds(self):
        """xmin, ymin, xmax, ymax of the floor in m."""
        return np.concatenate([self.corners.min(axis=0), self.corners.max(axis=0)])

    def holds(self, outline):
        """Whether an outline lies in the room, clear of walls and furniture.

        Parameters
        ----------
        outline : Outline

        Returns
        -------
        bool
        """
        within = inside(np.array([outline[:2]]), self.corners)[0]
        return bool(within and gaps(self.outlines, outline).min() >= 0)

    def distance(self, points):
        """How far points are from the nearest wall or piece of furniture.

        Parameters
        ----------
        points : (N, 2) array_like
            In m.

        Returns
        -------
        (N,) float array
            In m, zero in furniture and outside the room.

        Examples
        --------
        >>> LABORATORY.distance([(4.5, 3.5), (4.5, 0.4), (4.5, -0.4)]).round(6).tolist()
        [2.346444, 0.4, 0.0]
        """
        points = np.asarray(points, dtype=float).reshape(-1, 2)
        to_walls = wall_distances(points, self.corners)
        if not self.furniture:
            return to_walls
        furniture = self.outlines[len(self.corners) :]
        return np.clip(outline_distances(points, furniture).min(axis=1), 0.0, to_walls)


def twice_the_area(corners):
    """Twice the area of a polygon (K, 2) in m^2, negative if its corners go round clockwise."""
    x, y = corners.T
    return x @ np.roll(y, -1) - y @ np.roll(x, -1)


def directions(corners):
    """Lengths (K,) in m of the walls from each corner to the next, their directions (K, 2), and those before."""
    along = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(along, axis=1)
    along = along / lengths[:, None]
    return lengths, along, np.roll(along, 1, axis=0)


def check_walls(corners):
    """No wall stands in the floor, as it would beside a sharp corner or where two arms are nearly in touch."""
    for k, outline in enumerate(wall.outline for wall in walls_round(corners, 1.0)):
        if inside(outline.shrunk(0.01).border, corners).any():
            place = tuple(corners[k].round(2).tolist())
            raise ValueError(
                f"a wall is {WALL_THICKNESS} m thick and must not stand in the floor, got one from {place}"
            )


def walls(room):
    """The walls of a room, standing outside of its floor.

    Parameters
    ----------
    room : Room

    Returns
    -------
    list of Part
        One for each corner, from it to the next.
    """
    return walls_round(room.corners, room.height)


def walls_round(corners, height):
    """Walls of some height (m) outside of a floor; round a corner reaches the one that runs more along x."""
    lengths, along, arriving = directions(corners)
    flat = np.abs(along[:, 0])
    convex = arriving[:, 0] * along[:, 1] > arriving[:, 1] * along[:, 0]
    begins, ends = (
        convex & (flat >= np.roll(flat, 1)),
        np.roll(convex, -1) & (flat > np.roll(flat, -1)),
    )
    parts = []
    for k, corner in enumerate(corners):
        first, last = -WALL_THICKNESS * begins[k], lengths[k] + WALL_THICKNESS * ends[k]
        outwards = np.array([along[k, 1], -along[k, 0]])
        x, y = corner + along[k] * (first + last) / 2 + outwards * WALL_THICKNESS / 2
        parts.append(panel((x, y), last - first, along[k], WALL_THICKNESS, height, WHITE))
    return parts


def panel(middle, length, along, thickness, height, colour):
    """A panel that stands on the floor.

    Parameters
    ----------
    middle : (2,) sequence of float
        In m.
    length, thickness, height : float
        In m.
    along : (2,) sequence of float
        Unit vector in the direction of its length.
    colour : tuple of 3 floats
        Red, green, blue in 0 to 1.

    Returns
    -------
    Part
        A panel along an axis is exactly along it.
    """
    size, turn = (length, thickness), float(np.arctan2(along[1], along[0]))
    quarters = round(turn / (np.pi / 2))
    if abs(turn - quarters * np.pi / 2) < 1e-9:
        size, turn = size[:: -1 if quarters % 2 else 1], 0.0
    return Part("box", (*middle, height / 2), (*size, height), colour, turn)


# ---- the paper's laboratory


def desk(x, y, width, facing, computer=True):
    """A desk, its back edge's middle at (x, y), people sitting on the `facing` side (+1: +y)."""
    depth, top = 0.75, 0.72
    middle = y + facing * depth / 2
    left, right = x - width / 2, x + width / 2
    parts = [
        Part("box", (x, middle, top + 0.015), (width, depth, 0.03), OAK),
        Part("box", (left + 0.02, middle, top / 2), (0.04, depth - 0.04, top), OAK),
        Part("box", (right - 0.02, middle, top / 2), (0.04, depth - 0.04, top), OAK),
        Part("box", (x, y + facing * 0.06, 0.45), (width - 0.08, 0.03, 0.5), OAK),
        Part("box", (right - 0.26, middle, 0.31), (0.40, depth - 0.10, 0.60), STEEL),
    ]
    return parts + (computer_parts(left + 0.25, y, facing, top + 0.03) if computer else [])


def computer_parts(x, y, facing, top):
    """A computer under a desk, its screen and keyboard on the desk's top at height `top`."""
    return [
        Part("box", (x, y + facing * 0.40, 0.23), (0.20, 0.46, 0.44), DARK),
        Part("box", (x + 0.45, y + facing * 0.20, top + 0.02), (0.26, 0.18, 0.03), DARK),
        Part("box", (x + 0.45, y + facing * 0.18, top + 0.10), (0.05, 0.04, 0.16), DARK),
        Part("box", (x + 0.45, y + facing * 0.20, top + 0.31), (0.48, 0.05, 0.32), DARK),
        Part("box", (x + 0.45, y + facing * 0.228, top + 0.315), (0.44, 0.01, 0.27), BLUE),
        Part("box", (x + 0.45, y + facing * 0.52, top + 0.012), (0.44, 0.15, 0.02), WHITE),
    ]


def stool(x, y):
    """A laboratory stool: foot, thick column, round seat."""
    return [
        Part("box", (x, y, 0.025), (0.34, 0.34, 0.05), DARK),
        Part("cylinder", (x, y, 0.26), (0.12, 0.12, 0.44), STEEL),
        Part("cylinder", (x, y, 0.51), (0.36, 0.36, 0.06), (0.16, 0.20, 0.30)),
    ]


def cabinet(x, y, width, depth, height, colour):
    """A closed cabinet round the point (x, y)."""
    return [Part("box", (x, y, height / 2), (width, depth, height), colour)]


LAB_WIDTH, LAB_DEPTH = 9.0, 7.0
FURNITURE = (
    *desk(1.5, LAB_DEPTH, 1.6, -1),
    *desk(3.3, LAB_DEPTH, 1.6, -1),
    *desk(5.9, LAB_DEPTH, 1.7, -1),
    *cabinet(7.3, LAB_DEPTH - 0.24, 0.80, 0.46, 1.90, STEEL),
    *desk(1.3, 0.0, 1.6, 1),
    *desk(7.4, 0.0, 1.8, 1),
    *cabinet(8.80, 5.95, 0.40, 0.90, 1.30, OAK),
    *cabinet(0.18, 4.95, 0.34, 1.00, 1.10, OAK),
    *cabinet(8.84, 1.55, 0.30, 0.60, 0.90, GREY),
    *stool(1.2, 5.98),
    *stool(3.6, 5.90),
    *stool(6.3, 5.95),
    *stool(1.6, 1.08),
    *stool(7.2, 1.10),
)
LABORATORY = Room([(0.0, 0.0), (LAB_WIDTH, 0.0), (LAB_WIDTH, LAB_DEPTH), (0.0, LAB_DEPTH)], FURNITURE)
"""The paper's laboratory."""
