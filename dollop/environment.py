"""The environment configuration, and the springs between its corners (Sec. IV).

The objects of the lab are axis-parallel boxes; the paper's environment configuration is the set of
their corners omega_1 ... omega_4N. Between any two corners of one environment there is a spring,
stronger where they are closer,

    k_mn = ||omega_m - omega_n||^-2
    f_m = sum_{n != m} k_mn (omega_n - omega_m) / ||omega_n - omega_m||

and matching corner m of environment i with corner n of environment j costs
ceil(alpha ||f_m^i - f_n^j||).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from dollop.checks import (
    FARTHEST,
    checked_array,
    checked_flags,
    checked_number,
    checked_positions,
    checked_record,
    put_in,
)
from dollop.gridmap import SIDES, flat_cells
from dollop.pose import wrapped

__all__ = [
    "Environment",
    "Seen",
    "checked_boxes",
    "corner_indices",
    "integer_costs",
    "spring_constants",
    "spring_forces",
    "standing_boxes",
]

# A corner's place in its box: 0 lower left, then counter-clockwise. The columns are those of a box.
_CORNER_COLUMNS = np.array([[0, 1], [2, 1], [2, 3], [0, 3]])
# The ceiling would make 1 of a rounding error of 1e-13: changes of force below this many units
# count as none.
_ROUNDING = 1e-6
_ONE_PLACE, _MOST_COSTS = (
    1e-12,
    2.0**53,
)  # m²: corners that coincide; and what a whole number can be
# Those of 500 objects: their springs take 250 MB.
MOST_CORNERS = 2000


LINK, SPACINGS = 0.15, 2.2
"""Cells are of one surface where they are nearer than `LINK` m or than so many beam spacings."""
FLAT = 0.10
"""m: a box seen no deeper than this shows one face only."""
ROUND = 0.22
"""Share of its extent by which the near corner of a box is empty where what stands there is
round."""
APART, ONE_OBJECT = 0.40, 1.5
"""m: two surfaces nearer than that are one where no beam passes between, and make no larger box."""
CUT_OFF = 0.08
"""m from an end that something hides within which a side of the box may lie farther out."""
MOST_ADDED, UNSURE = 0.10, 0.15
"""m that a face may go on beyond its last reading; and m between readings from which on its end is
not known."""


@dataclass(frozen=True, eq=False)
class Seen:
    """The part of the floor that the laser has seen (beyond the paper).

    Attributes
    ----------
    floor : (H, W) bool array
        Where a beam has passed or ended; indexed [row, col] = [y, x].
    origin : (float, float)
        Lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Raises
    ------
    ValueError
        A floor that is no grid of flags, an origin beyond 1e9 m, a resolution that is not a micrometre
        at least and a kilometre at most.
    """

    floor: np.ndarray
    origin: tuple
    resolution: float

    def __post_init__(self):
        put_in(
            self,
            floor=checked_flags("floor", self.floor, "H", "W"),
            origin=tuple(checked_positions("origin", self.origin, 2).tolist()),
            resolution=checked_number("resolution", self.resolution, *SIDES),
        )

    def at(self, points):
        """Whether an object that stood there would have been found.

        Parameters
        ----------
        points : (M, 2) array_like
            In m.

        Returns
        -------
        (M,) bool array
            False off the map.

        Raises
        ------
        ValueError
            For what are no positions within 1e12 m.

        Examples
        --------
        >>> Seen(np.array([[True, False]]), (0.0, 0.0), 1.0).at([[0.5, 0.5], [1.5, 0.5], [9.0, 9.0]]).tolist()
        [True, False, False]
        """
        points = checked_array("points", points, "...", 2, least=-1e12, most=1e12).reshape(-1, 2)
        cells, inside = flat_cells(points, self.origin, self.resolution, self.floor.shape)
        found = np.zeros(len(points), bool)
        found[inside] = self.floor.ravel()[cells]
        return found


@dataclass(frozen=True, eq=False)
class Environment:
    """The static objects of one lab, as boxes, and their corners (Sec. IV).

    Parameters
    ----------
    boxes : (N, 4) array
        xmin, ymin, xmax, ymax of each object in m. N may be 0: a lab with nothing in it is a fact
        to record, although nothing can be matched with it or associated with it.
    seen : Seen, optional
        Where an object would have been found; unknown when not given.
    assumed : (N, 4) bool array, optional
        Which sides of each box, in the order of its numbers, no beam has reached: they are where
        they would be if the object were as deep as it is wide. None when not given.
    directions : (N,) array, optional
        Which way each object faces, in rad; nan where nothing knows. Unknown when not given.

    Raises
    ------
    ValueError
        Where the shape is another, a number is not finite, an extent is negative, or a box lies
        beyond 1e9 m of the origin.

    Examples
    --------
    The corners of a box run counter-clockwise from its lower left.

    >>> Environment([[0, 0, 2, 1]]).corners.tolist()
    [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
    """

    boxes: np.ndarray
    seen: Seen = None
    assumed: np.ndarray = None
    directions: np.ndarray = None

    def __post_init__(self):
        boxes = checked_boxes(self.boxes)
        negative = np.flatnonzero((boxes[:, 2:] < boxes[:, :2]).any(axis=1))
        if len(negative):
            found = f"{boxes[negative[0]].tolist()} for object {negative[0]}"
            raise ValueError(f"a box must have xmin <= xmax and ymin <= ymax, got {found}")
        if self.seen is not None:
            checked_record("seen", self.seen, Seen)
        assumed = np.zeros(boxes.shape, bool) if self.assumed is None else self.assumed
        put_in(
            self,
            boxes=boxes,
            assumed=checked_flags("assumed", assumed, *boxes.shape),
            directions=checked_directions(self.directions, len(boxes)),
        )

    def __len__(self):
        return len(self.boxes)

    @cached_property
    def corners(self):
        """(4N, 2) array, m: corner k of object n in row 4n + k, as they run round the box."""
        return self.boxes[:, _CORNER_COLUMNS].reshape(-1, 2)

    @cached_property
    def centres(self):
        """(N, 2) array, m: the middle of each box."""
        return (self.boxes[:, :2] + self.boxes[:, 2:]) / 2

    @cached_property
    def corner_offsets(self):
        """(4N, 2) array, m: each corner as seen from the middle of its box."""
        return self.corners - np.repeat(self.centres, 4, axis=0)

    def __repr__(self):
        where = ", ".join(f"({x:.2f}, {y:.2f})" for x, y in self.centres[:6])
        more = f", ... {len(self) - 6} more" if len(self) > 6 else ""
        return f"Environment of {len(self)} objects" + (f" round {where}{more}" if len(self) else "")


def checked_boxes(boxes):
    """Boxes as a float array of their own; an empty list is none of them.

    Parameters
    ----------
    boxes : (N, 4) array_like
        xmin, ymin, xmax, ymax in m.

    Returns
    -------
    (N, 4) float array
        A copy, in m.

    Raises
    ------
    ValueError
        What is not four numbers each, within 1e9 m of the origin.
    """
    shape = np.shape(boxes) if isinstance(boxes, np.ndarray) else ()
    none = shape[:1] == (0,) or (isinstance(boxes, list | tuple) and not boxes)
    return checked_positions("boxes", np.empty((0, 4)) if none else boxes, "N", 4)


def checked_directions(directions, n):
    """Directions of n objects (n,) in rad, nan where unknown; ValueError for what is none."""
    if directions is None:
        return np.full(n, np.nan)
    directions = checked_array("directions", directions, n, finite=False, least=-FARTHEST, most=FARTHEST)
    return np.where(np.isnan(directions), np.nan, wrapped(np.nan_to_num(directions)))


def corner_indices(partners, turn=0.0):
    """Which corner each corner goes to, where objects are matched (reconstruction).

    Boxes stay parallel to the axes: in a layout that was turned by a right angle the lower left
    corner becomes the lower right.

    Parameters
    ----------
    partners : (N,) int array
        For each object the one that it goes to, -1 where it is left out.
    turn : float
        Of the layout, in rad; to the nearest right angle.

    Returns
    -------
    (4N,) int array
        -1 for the corners of what is left out.

    Examples
    --------
    >>> corner_indices(np.array([1, -1])).tolist()
    [4, 5, 6, 7, -1, -1, -1, -1]
    >>> corner_indices(np.array([0]), turn=np.pi / 2).tolist()
    [1, 2, 3, 0]
    """
    corners = (np.arange(4) + round(turn / (np.pi / 2))) % 4
    return np.where(partners[:, None] >= 0, 4 * partners[:, None] + corners, -1).ravel()


def spring_constants(corners):
    """The spring constants between all corners of one environment (Sec. IV-A).

    Parameters
    ----------
    corners : (C, 2) array
        Positions in m.

    Returns
    -------
    (C, C) array
        ||omega_m - omega_n||^-2 in 1/m², zero on the diagonal.

    Raises
    ------
    ValueError
        Where two corners coincide: their spring would be infinite. More than 2000 corners.

    Examples
    --------
    Twice as far, a quarter as strong.

    >>> spring_constants([[0, 0], [1, 0], [2, 0]])[0].tolist()
    [0.0, 1.0, 0.25]
    """
    return _springs(corners)[0]


def spring_forces(corners):
    """The total force of the springs on each corner (Sec. IV-A).

    Parameters
    ----------
    corners : (C, 2) array
        Positions in m.

    Returns
    -------
    (C, 2) array
        f_m in 1/m².

    Raises
    ------
    ValueError
        Where two corners coincide. More than 2000 corners.

    Examples
    --------
    Springs pull in pairs: all forces together are none.

    >>> bool(np.allclose(spring_forces([[0, 0], [1, 0], [3, 1]]).sum(axis=0), 0))
    True
    """
    springs, differences = _springs(corners)
    # k_mn / ||omega_n - omega_m|| = k_mn^(3/2)
    return np.matmul((springs * np.sqrt(springs))[:, None], differences)[:, 0]


def integer_costs(corners_i, corners_j, alpha=1e3):
    """What matching each corner of one environment with each of another costs (Sec. IV-A).

    Parameters
    ----------
    corners_i, corners_j : (C, 2) and (D, 2) arrays
        Positions in m.
    alpha : float
        The paper's large constant (Sec. IV-A), in m².

    Returns
    -------
    (C, D) int array
        c_mn = ceil(alpha ||f_m^i - f_n^j||).

    Raises
    ------
    ValueError
        Where two corners of one environment coincide, or are so near that costs exceed 2^53.

    Examples
    --------
    Only where corners stand beside each other counts, not where all of them stand.

    >>> corners = np.array([[0, 0], [1, 0], [3, 1]])
    >>> np.diag(integer_costs(corners, corners + 7.3)).tolist()
    [0, 0, 0]
    """
    alpha = checked_number("alpha", alpha, 0)
    changes = scipy.spatial.distance.cdist(spring_forces(corners_i), spring_forces(corners_j))
    costs = np.ceil(alpha * changes - _ROUNDING)
    if costs.max(initial=0) > _MOST_COSTS:
        raise ValueError(f"costs must be at most {_MOST_COSTS:g}, got {costs.max():g}: corners are too near")
    return costs.astype(np.int64)


def _springs(corners):
    """Spring constants (C, C) and differences omega_n - omega_m (C, C, 2) between corners."""
    corners = checked_positions("corners", corners)
    if len(corners) > MOST_CORNERS:
        rule = f"springs must be between at most {MOST_CORNERS} corners"
        raise ValueError(f"{rule}, got {len(corners)}")
    differences = corners - corners[:, None]
    squares = np.einsum("mnd,mnd->mn", differences, differences)
    np.fill_diagonal(squares, np.inf)
    if squares.min(initial=np.inf) < _ONE_PLACE:
        first, second = np.argwhere(squares < _ONE_PLACE)[0]
        raise ValueError(f"corners {first} and {second} must not coincide: infinite spring")
    return 1 / squares, differences


# ---- boxes of what stands


def standing_boxes(places, sensors, step, scan=None, min_area=0.01):
    """Boxes round what stands, from the readings on its near faces (Sec. IV; a reconstruction).

    Neighbouring cells are one surface; surfaces whose completed boxes overlap are one object, and
    so are near ones between which no beam passes: they fall apart at corners, where the beams
    graze, and in the shadow of something nearer. Where a face along an axis
    was seen, its two ends are sides of the box; where none was, the object is taken to be as deep
    as it is wide, and its far side is assumed.

    Parameters
    ----------
    places, sensors : (M, 2) float arrays
        Mean reading in each cell, and where it was seen from, in m.
    step : float
        Angle between beams in rad.
    scan : tuple, optional
        Pose (3,), angles (B,) and ranges (B,) of the last one, which tells what hides what.
    min_area : float
        Smallest box in m^2 (Sec. II: 100 square centimetres).

    Returns
    -------
    boxes : (N, 4) float array
        xmin, ymin, xmax, ymax in m.
    assumed : (N, 4) bool array
        Sides that no beam has reached.
    hidden : (N,) bool array
        Which of them something nearer, or the edge of the field of view, may hide in part.
    groups : list of N int arrays
        Rows of `places` in each box.

    Examples
    --------
    A wall of a box, seen from the front: as deep as wide, and that is assumed.

    >>> face = np.column_stack([np.linspace(0, 0.4, 9), np.zeros(9)])
    >>> boxes, assumed, *_ = standing_boxes(face, np.tile([0.2, -2.0], (9, 1)), 0.001)
    >>> boxes.round(2).tolist(), assumed.tolist()
    ([[0.0, 0.0, 0.4, 0.4]], [[False, False, False, True]])
    """
    groups = surfaces(places, sensors, step)
    boxes = [box_round(places[rows], sensors[rows], step) for rows in groups]
    while (pair := one_object(boxes, groups, places, scan)) is not None:
        i, j = pair
        groups[i] = np.concatenate([groups[i], groups.pop(j)])
        boxes.pop(j)
        boxes[i] = box_round(places[groups[i]], sensors[groups[i]], step)
    large = [k for k, (box, _) in enumerate(boxes) if np.prod(box[2:] - box[:2]) >= min_area and len(groups[k]) > 1]
    kept = np.array([boxes[k][0] for k in large]).reshape(-1, 4)
    assumed = np.array([boxes[k][1] for k in large], bool).reshape(-1, 4)
    ends = [hidden_ends(places[groups[k]], scan) for k in large]
    for each, box, points in zip(assumed, kept, ends, strict=True):
        each |= (np.abs(np.tile(points, 2) - box) < CUT_OFF).any(axis=0)
    return (
        kept,
        assumed,
        np.array([len(each) > 0 for each in ends], bool),
        [groups[k] for k in large],
    )


def surfaces(places, sensors, step):
    """Rows (M,) of neighbouring places (M, 2), a list of int arrays."""
    if not len(places):
        return []
    link = np.maximum(LINK, SPACINGS * step * np.linalg.norm(places - sensors, axis=1))
    pairs = scipy.spatial.cKDTree(places).query_pairs(link.max(), output_type="ndarray")
    apart = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    i, j = pairs[apart <= np.minimum(link[pairs[:, 0]], link[pairs[:, 1]])].T
    graph = scipy.sparse.coo_matrix((np.ones(len(i)), (i, j)), (len(places),) * 2)
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    return [np.flatnonzero(label == k) for k in range(count)]


def box_round(places, sensors, step):
    """Box (4,) round what was seen at places (M, 2) from sensors (M, 2), and its assumed sides (4,)."""
    low, high = places.min(axis=0), places.max(axis=0)
    sight = places - sensors
    spacing = step * np.linalg.norm(sight, axis=1).mean()
    outside = np.stack([(sensors < low).any(axis=0), (sensors > high).any(axis=0)])  # [side, axis]
    assumed = np.zeros((2, 2), bool)
    extent = high - low
    along = outside[:, ::-1].any(axis=0) & (extent >= FLAT)  # whether a face along the axis was seen
    toward = places.mean(axis=0) - sensors.mean(axis=0)
    corner = np.where(toward > 0, low, high)
    empty = np.linalg.norm(places - corner, axis=1).min()
    if along.all() and outside.sum() == 2 and empty > max(ROUND * extent.max(), 0.05):
        return round_box(places, sensors, spacing), np.array([toward < 0, toward > 0]).ravel()
    for axis in range(2):
        half = spacing / 2
        if along[axis]:
            face, other = corner[1 - axis], sensors[:, 1 - axis].mean()
            grazing = np.abs(face - other) / np.linalg.norm(toward)
            half = min(half / max(grazing, 1e-3), MOST_ADDED)
            far = int(toward[axis] > 0)
            assumed[far, axis] = 2 * half >= UNSURE and not outside[far, axis]
            (high if far else low)[axis] += half if far else -half
        elif not outside[:, axis].any():
            low[axis] -= half
            high[axis] += half
            assumed[:, axis] = 2 * half >= UNSURE
    for axis in np.flatnonzero(~along):
        if outside[:, axis].sum() == 1:
            depth = max(high[axis] - low[axis], high[1 - axis] - low[1 - axis])
            if outside[0, axis]:
                high[axis], assumed[1, axis] = low[axis] + depth, True
            else:
                low[axis], assumed[0, axis] = high[axis] - depth, True
    return np.concatenate([low, high]), assumed.ravel()


def round_box(places, sensors, spacing):
    """Box (4,) round something round: as deep along the line of sight as it is wide across it."""
    sensor = sensors.mean(axis=0)
    sight = places.mean(axis=0) - sensor
    sight = sight / np.hypot(*sight)
    aside = np.array([-sight[1], sight[0]])
    along, across = (places - sensor) @ sight, (places - sensor) @ aside
    half = (np.ptp(across) + spacing) / 2
    middle = sensor + (along.min() + half) * sight + (across.min() + across.max()) / 2 * aside
    return np.concatenate([middle - half, middle + half])


def one_object(boxes, groups, places, scan):
    """The first pair of groups that are one object, or None."""
    for i in range(len(boxes)):
        for j in range(i + 1, len(boxes)):
            (a, _), (b, _) = boxes[i], boxes[j]
            apart = np.maximum(np.maximum(a[:2] - b[2:], b[:2] - a[2:]), 0.0)
            both = np.maximum(a[2:], b[2:]) - np.minimum(a[:2], b[:2])
            if not apart.any():
                return i, j
            near = np.hypot(*apart) < APART and both.max() <= ONE_OBJECT and scan is not None
            if near and nothing_between(places[groups[i]], places[groups[j]], *scan):
                return i, j
    return None


def bearings_of(places, pose):
    """Bearings (M,) in rad and distances (M,) in m of places (M, 2) from a sensor's pose (3,)."""
    offset = places - pose[:2]
    bearing = np.arctan2(offset[:, 1], offset[:, 0]) - pose[2]
    return (bearing + np.pi) % (2 * np.pi) - np.pi, np.hypot(offset[:, 0], offset[:, 1])


def nothing_between(some, others, pose, angles, ranges):
    """Whether two surfaces (M, 2), (L, 2) are near, and no beam passes between them."""
    pairs = scipy.spatial.distance.cdist(some, others)
    i, j = np.unravel_index(pairs.argmin(), pairs.shape)
    bearing, distance = bearings_of(np.array([some[i], others[j]]), pose)
    between = (angles > bearing.min()) & (angles < bearing.max())
    return bool(pairs[i, j] < APART and (ranges[between] < distance.max() + 0.10).all())


def hidden_ends(places, scan):
    """Ends (E, 2) in m of a surface, right and left, beside which is something nearer or the edge of view."""
    ends = []
    if scan is not None:
        pose, angles, ranges = scan
        bearing, distance = bearings_of(places, pose)
        for k, side in ((bearing.argmin(), -1), (bearing.argmax(), 1)):
            beam = int(np.abs(angles - bearing[k]).argmin()) + side
            while 0 <= beam < len(ranges) and abs(ranges[beam] - distance[k]) < 0.10:
                beam += side
            if not 0 <= beam < len(ranges) or ranges[beam] < distance[k] - 0.10:
                ends.append(places[k])
    return np.reshape(ends, (-1, 2))
