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

from dollop.checks import checked_array

__all__ = ["Environment", "corner_indices", "integer_costs", "spring_constants", "spring_forces"]

# A corner's place in its box: 0 lower left, then counter-clockwise. The columns are those of a box.
_CORNER_COLUMNS = np.array([[0, 1], [2, 1], [2, 3], [0, 3]])
# The ceiling would make 1 of a rounding error of 1e-13: changes of force below this many units
# count as none.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Environment:
    """The static objects of one lab, as boxes, and their corners (Sec. IV).

    Parameters
    ----------
    boxes : (N, 4) array
        xmin, ymin, xmax, ymax of each object in m. N may be 0: a lab with nothing in it is a fact
        to record, although nothing can be matched with it or associated with it.

    Raises
    ------
    ValueError
        Where the shape is another, a number is not finite, or an extent is negative.

    Examples
    --------
    The corners of a box run counter-clockwise from its lower left.

    >>> Environment([[0, 0, 2, 1]]).corners.tolist()
    [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
    """

    boxes: np.ndarray

    def __post_init__(self):
        boxes = checked_array("boxes", self.boxes if np.size(self.boxes) else np.empty((0, 4)), "N", 4)
        negative = np.flatnonzero((boxes[:, 2:] < boxes[:, :2]).any(axis=1))
        if len(negative):
            found = f"{boxes[negative[0]].tolist()} for object {negative[0]}"
            raise ValueError(f"a box must have xmin <= xmax and ymin <= ymax, got {found}")
        boxes.flags.writeable = False
        object.__setattr__(self, "boxes", boxes)

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
        Where two corners coincide: their spring would be infinite.

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
        Where two corners coincide.

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
        Where two corners of one environment coincide.

    Examples
    --------
    Only where corners stand beside each other counts, not where all of them stand.

    >>> corners = np.array([[0, 0], [1, 0], [3, 1]])
    >>> np.diag(integer_costs(corners, corners + 7.3)).tolist()
    [0, 0, 0]
    """
    changes = scipy.spatial.distance.cdist(spring_forces(corners_i), spring_forces(corners_j))
    return np.ceil(alpha * changes - _ROUNDING).astype(np.int64)


def _springs(corners):
    """Spring constants (C, C) and differences omega_n - omega_m (C, C, 2) between corners."""
    corners = np.asarray(corners, dtype=float)
    differences = corners - corners[:, None]
    squares = np.einsum("mnd,mnd->mn", differences, differences)
    np.fill_diagonal(squares, np.inf)
    if squares.min(initial=np.inf) == 0:
        first, second = np.argwhere(squares == 0)[0]
        raise ValueError(f"corners {first} and {second} must not coincide: infinite spring")
    return 1 / squares, differences
