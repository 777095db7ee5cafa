"""Subgoals associated with objects, so that they move as the objects move (Sec. IV-B).

From one demonstration, the paper's way: a subgoal s keeps its differences to the m nearest corners,

    s' = sum_l w_l (omega'_g(l) + s - omega_l),    w_l ~ 1 / (||s - omega_l||^2 + eps),

and the weights sum to 1.

The paper says only that "closer environment objects have higher weights"; this form of the weights
is a reconstruction.

Several demonstrations among objects that stood elsewhere each time are a second source of evidence
(beyond the paper): beside the object that matters, they vary little. Here each object is a frame, a
position with a direction, and

    w_l ~ 1 / (d_l^2 + eps)  *  1 / v_l

with d_l the distance of the subgoal from frame l and v_l its variance seen from frame l, over the
demonstrations. Of one demonstration there is no variance, and between demonstrations in one and the
same environment it is equal beside all objects: in both cases closeness alone is left.
"""

from dataclasses import dataclass

import numpy as np

from dollop.checks import checked_array, checked_positions
from dollop.environment import Environment
from dollop.matching import match_surely
from dollop.pose import rotation, wrapped

__all__ = [
    "Association",
    "FrameAssociation",
    "Frames",
    "associate",
    "associate_with_frames",
    "layout_turn",
]

_EPSILON = 0.05**2  # m²: corners are not known better than to a cell of the foreground grid


@dataclass(frozen=True, eq=False)
class Association:
    """K subgoals, each tied to m corners of an environment (Sec. IV-B).

    Attributes
    ----------
    environment : Environment
        Where the subgoals were demonstrated.
    corners : (K, m) int array
        Which corners each subgoal is tied to; from `associate` the nearest first.
    weights : (K, m) array
        w_l, none negative. One row sums to 1, or to less after `carried` has cut ties to objects
        that are gone.
    differences : (K, m, 2) array
        s - omega_l in m.
    """

    environment: Environment
    corners: np.ndarray
    weights: np.ndarray
    differences: np.ndarray

    def __repr__(self):
        subgoals, corners = self.corners.shape
        return f"Association of {subgoals} subgoals with {corners} corners each; {self.environment}"

    def relocate(self, environment, matching=None, turned=False):
        """Where the subgoals are when the objects stand elsewhere (Sec. IV-B).

        Parameters
        ----------
        environment : Environment
            The objects as they stand now.
        matching : Matching, optional
            From the associated environment to this one; found by `match` when not given. Corners
            that it leaves out drop out, and the weights of a subgoal's other corners take their
            part.
        turned : bool
            Beyond the paper: turn the differences with the layout, see `layout_turn`.

        Returns
        -------
        (K, 2) array
            Subgoals in m.

        Raises
        ------
        ValueError
            Where the environments cannot be matched with confidence, where a given matching belongs
            to others, or where it leaves out all corners of a subgoal.
        """
        indices, corners, weights = self._ties(environment, matching)
        totals = weights.sum(axis=1, keepdims=True)
        lost = np.flatnonzero(totals == 0)
        if len(lost):
            gone = f"all of subgoal {lost[0]}: corners {self.corners[lost[0]].tolist()}"
            raise ValueError(f"a subgoal needs a matched corner, the matching leaves out {gone}")
        differences = self.differences
        if turned:
            matched = indices >= 0
            before, now = self.environment.corners[matched], environment.corners[indices[matched]]
            differences = differences @ rotation(layout_turn(before, now)).T
        return np.einsum("km,kmd->kd", weights / totals, environment.corners[corners] + differences)

    def carried(self, environment, matching=None):
        """The same ties with the objects where they stand now (Sec. IV-B).

        Relocating from it goes on from the demonstrated differences, so that moving objects there
        and back moves nothing. Ties to objects that are gone are cut.

        Parameters
        ----------
        environment : Environment
            The objects as they stand now.
        matching : Matching, optional
            As for `relocate`.

        Returns
        -------
        Association
            With corners of that environment.

        Raises
        ------
        ValueError
            As `relocate`, but that a subgoal may lose all its ties.
        """
        _, corners, weights = self._ties(environment, matching)
        return Association(environment, corners, weights, self.differences)

    def _ties(self, environment, matching):
        """Where all corners go (4N,), where those of each subgoal go (K, m), and their weights."""
        names = "the associated environment", "the new one"
        matching = matching or match_surely(self.environment, environment, names)[0]
        n, m, indices = len(self.environment.corners), len(environment.corners), matching.indices
        highest = indices.max(initial=-1)
        if len(indices) != n or highest >= m:
            found = f"{len(indices)} indices up to {highest}"
            rule = f"must go from the {n} associated corners to the {m} present ones"
            raise ValueError(f"the matching {rule}, got {found}")
        partners = indices[self.corners]
        return indices, np.maximum(partners, 0), self.weights * (partners >= 0)


def associate(subgoals, environment, m=4):
    """Tie each subgoal to the corners nearest to it (Sec. IV-B).

    Parameters
    ----------
    subgoals : (K, 2) array
        Positions in m.
    environment : Environment
        One object at least.
    m : int
        How many corners a subgoal is tied to.

    Returns
    -------
    Association

    Raises
    ------
    ValueError
        No objects, more corners asked for than there are, a subgoal that is not finite.

    Examples
    --------
    Objects that all move by the same take the subgoals with them.

    >>> boxes = np.array([[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4]])
    >>> association = associate([[1.0, 1.0]], Environment(boxes))
    >>> association.relocate(Environment(boxes + [0.5, 2.0, 0.5, 2.0])).round(9).tolist()
    [[1.5, 3.0]]
    """
    subgoals = checked_positions("subgoals", subgoals)
    corners = environment.corners
    if len(corners) == 0:
        raise ValueError("subgoals need an environment of at least 1 object, got 0")
    if m not in range(1, len(corners) + 1):
        raise ValueError(f"m must be a whole number between 1 and the number of corners {len(corners)}, got {m}")
    differences = subgoals[:, None] - corners
    squares = (differences**2).sum(axis=2)
    nearest = np.argsort(squares, axis=1, kind="stable")[:, :m]
    each = np.arange(len(subgoals))[:, None]
    weights = 1 / (squares[each, nearest] + _EPSILON)
    weights /= weights.sum(axis=1, keepdims=True)
    return Association(environment, nearest, weights, differences[each, nearest])


def layout_turn(corners_i, corners_j):
    """By how much a layout has turned: the least-squares angle (beyond the paper).

    Parameters
    ----------
    corners_i, corners_j : (C, 2) arrays
        Positions in m, row by row the same corner.

    Returns
    -------
    float
        Angle in (-pi, pi], counter-clockwise from i to j; 0 where there is nothing to tell it from.

    Examples
    --------
    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> round(np.degrees(layout_turn(square, square[[1, 2, 3, 0]])))
    90
    """
    z, w = (np.asarray(corners, dtype=float) @ (1, 1j) for corners in (corners_i, corners_j))
    return float(np.angle((z - z.mean()).conj() @ (w - w.mean())))


@dataclass(frozen=True, eq=False)
class Frames:
    """Objects that have a direction as well as a position (beyond the paper).

    Parameters
    ----------
    positions : (M, 2) array
        In m.
    directions : (M,) array
        In rad, counter-clockwise from +x.

    Raises
    ------
    ValueError
        Where the shapes do not belong together or a number is not finite.
    """

    positions: np.ndarray
    directions: np.ndarray

    def __post_init__(self):
        positions = checked_positions("positions", self.positions)
        directions = checked_array("directions", self.directions, len(positions))
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "directions", wrapped(directions))

    def __repr__(self):
        return f"Frames of {len(self)} objects"

    def __len__(self):
        return len(self.positions)


@dataclass(frozen=True, eq=False)
class FrameAssociation:
    """K subgoals tied to M frames (beyond the paper).

    Attributes
    ----------
    local : (M, K, 2) array
        Each subgoal as seen from each frame, in m.
    weights : (M, K) array
        How much each frame counts for each subgoal, one column sums to 1.
    """

    local: np.ndarray
    weights: np.ndarray

    def __repr__(self):
        frames, subgoals = self.weights.shape
        return f"FrameAssociation of {subgoals} subgoals with {frames} frames"

    def relocate(self, frames):
        """Where the subgoals are when the frames stand elsewhere (beyond the paper).

        Parameters
        ----------
        frames : Frames
            The same M objects in the same order, as they stand now.

        Returns
        -------
        (K, 2) array
            Subgoals in m.

        Raises
        ------
        ValueError
            Another number of frames.
        """
        if len(frames) != len(self.local):
            raise ValueError(f"the number of frames must stay {len(self.local)}, got {len(frames)}")
        moved = self.local @ rotation(frames.directions).swapaxes(1, 2) + frames.positions[:, None]
        return np.einsum("mk,mkd->kd", self.weights, moved)


def associate_with_frames(subgoals, frames):
    """Tie subgoals to frames, by closeness and by how little they vary (beyond the paper).

    How little they vary is told from several demonstrations only.

    Parameters
    ----------
    subgoals : (D, K, 2) array
        Of D demonstrations, in m; subgoal k means the same in each.
    frames : sequence of D Frames
        How the M objects stood in each demonstration, in the same order.

    Returns
    -------
    FrameAssociation

    Raises
    ------
    ValueError
        No demonstration, no frame, counts that differ, a number that is not finite.

    Examples
    --------
    A goal between two objects, as near to one as to the other, that moved with the second: that is
    the one to follow.

    >>> still, moved = Frames([[0, 0], [2, 0]], [0, 0]), Frames([[0, 0], [2, 2]], [0, 0])
    >>> associate_with_frames([[[1, 0]]], [still]).weights.ravel().round(2).tolist()
    [0.5, 0.5]
    >>> bool(associate_with_frames([[[1, 0]], [[1, 2]]], [still, moved]).weights[1, 0] > 0.8)
    True
    """
    subgoals = checked_array("subgoals", subgoals, "D", "K", 2)
    counts = [len(f) for f in frames]
    if len(counts) != len(subgoals) or len(set(counts)) != 1 or counts[0] == 0:
        rule = "one demonstration at least, and for each the same frames, at least 1, are needed"
        raise ValueError(f"{rule}, got {len(subgoals)} demonstrations and frames {counts}")
    pairs = zip(subgoals, frames, strict=True)
    local = np.stack([(s - f.positions[:, None]) @ rotation(f.directions) for s, f in pairs])
    weights = 1 / ((local**2).sum(axis=3).mean(axis=0) + _EPSILON) / _variances(local)
    return FrameAssociation(local.mean(axis=0), weights / weights.sum(axis=0))


def _variances(local):
    """Variance (M, K) of D demonstrations (D, M, K, 2), up to a factor.

    Of one alone it is the same for all frames.
    """
    squares = ((local - local.mean(axis=0)) ** 2).sum(axis=(0, 3))
    # A handful of demonstrations may agree by chance: one virtual one, of mean variance, keeps the
    # weights finite. Less variance than corners are known to tells nothing: it may be mere
    # rounding.
    return squares + max(squares.mean() / max(len(local) - 1, 1), _EPSILON)
