"""What stands where in the laboratory: background furniture, and the movable objects of a scene.

A reconstruction: the paper shows its laboratory in one photograph (Fig. 5). The room is 9 m by 7 m,
its lower left corner the origin of the world. Nothing here needs PyBullet.
"""

from dataclasses import dataclass

import numpy as np

__all__ = [
    "BACKGROUND",
    "BEAM_HEIGHT",
    "FURNITURE",
    "KINDS",
    "Part",
    "ROOM",
    "Scene",
    "WHITE",
    "background_distance",
    "empty_scene",
    "figure_eight_scene",
    "moved",
    "rearranged",
    "slalom_scene",
]

ROOM = (9.0, 7.0)
WALL_HEIGHT = 2.4
WALL_THICKNESS = 0.10
SPACING = 0.45
"""Least free distance in m round an object: the radius of Sec. II swallows what is nearer."""
BEAM_HEIGHT = 0.36
"""Height of the laser's plane over the floor in m: a SICK LMS 200 on the deck of a Pioneer 2 DX."""

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
    """

    shape: str
    centre: tuple
    size: tuple
    colour: tuple

    @property
    def bounds(self):
        """Footprint xmin, ymin, xmax, ymax in m."""
        (x, y, _), (width, depth, _) = self.centre, self.size
        return x - width / 2, y - depth / 2, x + width / 2, y + depth / 2


@dataclass(frozen=True)
class Kind:
    """A sort of foreground object.

    Attributes
    ----------
    beam_radius : float
        Radius in m where the laser meets it.
    foot_radius : float
        Radius in m of the circle round its widest part, which a walker or a robot must avoid.
    height : float
        Height in m.
    """

    beam_radius: float
    foot_radius: float
    height: float


KINDS = {"trash can": Kind(0.18, 0.18, 0.66), "cone": Kind(0.13, 0.28, 1.0)}


@dataclass(frozen=True, eq=False)
class Scene:
    """The movable half of the laboratory: foreground objects, and where the robot stands (Fig. 5).

    Attributes
    ----------
    kinds : tuple of N str
        The kind of each foreground object, a key of `KINDS`.
    positions : (N, 2) float array
        Their centres in m.
    robot : tuple of 3 floats
        Pose of the robot: x, y in m, theta in rad.

    Raises
    ------
    ValueError
        If an object is of no known kind, stands outside the room, or nearer than 0.45 m to the
        background or to another object: nearer than that the background radius of Sec. II would
        swallow part of it.

    Examples
    --------
    The laser meets a cone above its foot, where it is narrower.

    >>> scene = Scene(("cone",), [(4.5, 3.5)])
    >>> xmin, ymin, xmax, ymax = scene.boxes[0]
    >>> bool(xmax - xmin < 2 * scene.foot_radii[0])
    True
    """

    kinds: tuple
    positions: np.ndarray
    robot: tuple = (4.5, 0.6, np.pi / 2)

    def __post_init__(self):
        object.__setattr__(self, "kinds", tuple(self.kinds))
        object.__setattr__(self, "positions", np.array(self.positions, dtype=float).reshape(-1, 2))
        object.__setattr__(self, "robot", tuple(float(value) for value in self.robot))
        check_objects(self.kinds, self.positions)

    def __repr__(self):
        objects = ", ".join(f"{kind} ({x:.2f}, {y:.2f})" for kind, (x, y) in self._placed())
        return f"Scene of {objects or 'nothing'}"

    def _placed(self):
        return zip(self.kinds, self.positions, strict=True)

    @property
    def beam_radii(self):
        """(N,) radius of each object in m at the height of the laser."""
        return np.array([KINDS[kind].beam_radius for kind in self.kinds])

    @property
    def foot_radii(self):
        """(N,) radius in m of the circle round each object's foot."""
        return np.array([KINDS[kind].foot_radius for kind in self.kinds])

    @property
    def boxes(self):
        """(N, 4) true bounding boxes xmin, ymin, xmax, ymax in m at the height of the laser."""
        radii = self.beam_radii[:, None]
        return np.hstack([self.positions - radii, self.positions + radii])

    def to_dict(self):
        """The scene as plain lists, for JSON.

        Returns
        -------
        dict
            The arguments that make the scene again.
        """
        positions = self.positions.tolist()
        return {"kinds": list(self.kinds), "positions": positions, "robot": list(self.robot)}


def check_objects(kinds, positions):
    """Raise ValueError unless the objects are of known kinds and stand clear of everything."""
    if len(kinds) != len(positions):
        got = f"{len(kinds)} kinds and {len(positions)} positions"
        raise ValueError(f"a scene needs one position per kind, got {got}")
    for kind in kinds:
        if kind not in KINDS:
            raise ValueError(f"kind must be one of {sorted(KINDS)}, got {kind!r}")
    radii = np.array([KINDS[kind].beam_radius for kind in kinds])
    for index, gap in enumerate(free_gaps(positions, radii)):
        if not gap >= SPACING:
            rule, place = f"{SPACING} m clear of everything", positions[index].tolist()
            raise ValueError(f"a {kinds[index]} must stand {rule}, got {gap:.2f} m at {place}")


def free_gaps(positions, radii):
    """(N,) free distance in m from each disc to the nearest other disc or piece of background."""
    between = np.linalg.norm(positions[:, None] - positions, axis=2) - radii[:, None] - radii
    np.fill_diagonal(between, np.inf)
    return np.minimum(background_distance(positions) - radii, between.min(axis=1, initial=np.inf))


def box_distance(points, boxes):
    """Distance of each point to the nearest of the boxes.

    Parameters
    ----------
    points : (N, 2) array in m
    boxes : (M, 4) array of xmin, ymin, xmax, ymax in m

    Returns
    -------
    (N,) array in m, zero inside a box.

    Examples
    --------
    >>> box_distance([[3.0, 4.0], [-1.0, -1.0]], [[-2.0, -2.0, 0.0, 0.0]])
    array([5., 0.])
    """
    points, boxes = np.asarray(points)[:, None], np.asarray(boxes)
    outside = np.maximum(np.maximum(boxes[:, :2] - points, points - boxes[:, 2:]), 0.0)
    return np.hypot(outside[..., 0], outside[..., 1]).min(axis=1)


def background_distance(points):
    """How far points are from the nearest wall or piece of furniture.

    Parameters
    ----------
    points : (N, 2) array_like
        In m.

    Returns
    -------
    (N,) float array
        In m, zero outside the room.

    Examples
    --------
    >>> background_distance([(4.5, 3.5), (4.5, 0.4), (4.5, -0.4)]).round(6).tolist()
    [2.333838, 0.4, 0.0]
    """
    points = np.asarray(points)
    inside = np.all((points >= 0.0) & (points <= ROOM), axis=1)
    return np.where(inside, box_distance(points, BACKGROUND_BOXES), 0.0)


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


def walls():
    """The four walls, standing outside the room's 9 m by 7 m."""
    (width, depth), thick, up = ROOM, WALL_THICKNESS, WALL_HEIGHT
    return [
        Part("box", (width / 2, -thick / 2, up / 2), (width + 2 * thick, thick, up), WHITE),
        Part("box", (width / 2, depth + thick / 2, up / 2), (width + 2 * thick, thick, up), WHITE),
        Part("box", (-thick / 2, depth / 2, up / 2), (thick, depth, up), WHITE),
        Part("box", (width + thick / 2, depth / 2, up / 2), (thick, depth, up), WHITE),
    ]


WALLS = walls()
FURNITURE = [
    *desk(1.5, ROOM[1], 1.6, -1),
    *desk(3.3, ROOM[1], 1.6, -1),
    *desk(5.9, ROOM[1], 1.7, -1),
    *cabinet(7.3, ROOM[1] - 0.24, 0.80, 0.46, 1.90, STEEL),
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
]
BACKGROUND = (*WALLS, *FURNITURE)
BACKGROUND_BOXES = np.array([part.bounds for part in BACKGROUND])


def empty_scene():
    """The laboratory without foreground objects, as the background map is made in (Sec. II).

    Returns
    -------
    Scene
    """
    return Scene((), np.empty((0, 2)))


def figure_eight_scene():
    """Two trash cans four metres apart, the robot watching from the lower wall (Fig. 5).

    Returns
    -------
    Scene
    """
    return Scene(("trash can", "trash can"), [(2.5, 3.6), (6.5, 3.6)])


def slalom_scene(n_cones=4, spacing=1.5):
    """A row of slalom cones across the middle of the laboratory (Fig. 11; its size is ours).

    Parameters
    ----------
    n_cones : int
    spacing : float
        Between the middles of neighbouring cones in m.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If a cone would not stand clear of the others and of the background.

    Examples
    --------
    >>> np.diff(slalom_scene(3, spacing=1.5).positions, axis=0).tolist()
    [[1.5, 0.0], [1.5, 0.0]]
    """
    offsets = (np.arange(n_cones) - (n_cones - 1) / 2) * spacing
    positions = np.column_stack([ROOM[0] / 2 + offsets, np.full(n_cones, 3.6)])
    return Scene(("cone",) * n_cones, positions)


def moved(scene, shifts):
    """The scene with its foreground objects elsewhere, each by a shift of its own (Fig. 10).

    Parameters
    ----------
    scene : Scene
    shifts : (N, 2) array_like
        In m.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If an object does not stand clear there, as for `Scene`.

    Examples
    --------
    >>> scene = figure_eight_scene()
    >>> (moved(scene, [(0.5, 0.0), (0.0, -0.5)]).boxes - scene.boxes).round(6).tolist()
    [[0.5, 0.0, 0.5, 0.0], [0.0, -0.5, 0.0, -0.5]]
    """
    return Scene(scene.kinds, scene.positions + np.asarray(shifts), scene.robot)


def rearranged(scene, rng, reach=0.6, spacing=1.0, attempts=10_000):
    """The scene with every foreground object moved somewhere else, at random (Sec. IV).

    Parameters
    ----------
    scene : Scene
    rng : numpy.random.Generator
    reach : float
        Standard deviation in m of the move along x and along y.
    spacing : float
        Free room in m asked for round every object, so that a person can walk round it.
    attempts : int
        Draws after which to give up.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        If no such layout is found.

    Examples
    --------
    >>> scene = rearranged(figure_eight_scene(), np.random.default_rng(0), spacing=1.2)
    >>> bool((background_distance(scene.positions) - scene.foot_radii >= 1.2).all())
    True
    """
    for _ in range(attempts):
        positions = scene.positions + rng.normal(0.0, reach, scene.positions.shape)
        if free_room(scene, positions) >= spacing:
            return Scene(scene.kinds, positions, scene.robot)
    n_objects = len(scene.kinds)
    raise ValueError(f"spacing must leave room for {n_objects} objects, found none for {spacing} m")


def free_room(scene, positions):
    """Least free distance in m round the scene's objects if they stood at (N, 2) `positions`."""
    gaps = free_gaps(positions, scene.foot_radii)
    to_robot = np.linalg.norm(positions - scene.robot[:2], axis=1) - scene.foot_radii
    return min(gaps.min(initial=np.inf), to_robot.min(initial=np.inf))
