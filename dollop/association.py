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

from dollop.checks import (
    FARTHEST,
    checked_array,
    checked_flag,
    checked_positions,
    checked_record,
    checked_records,
    checked_whole,
    checked_wholes,
    put_in,
)
from dollop.environment import Environment
from dollop.matching import Matching, match_surely
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
_ROUNDING = 1e-6  # by which weights that sum to 1 may miss it


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

    Raises
    ------
    ValueError
        Corners that the environment does not have, weights that are negative or sum to more than 1,
        or differences larger than any within 1e9 m of the origin.
    """

    environment: Environment
    corners: np.ndarray
    weights: np.ndarray
    differences: np.ndarray

    def __post_init__(self):
        known = len(checked_record("environment", self.environment, Environment).corners)
        corners = checked_wholes("corners", self.corners, "K", "m", most=max(known - 1, 0))
        if corners.size and not known:
            raise ValueError("corners must be those of the environment, which has no objects")
        most = 1 + _ROUNDING
        weights = checked_array("weights", self.weights, *corners.shape, least=0, most=most)
        heaviest = weights.sum(axis=1).max(initial=0)
        if heaviest > most:
            raise ValueError(f"the weights of a subgoal must sum to 1 at most, got {heaviest:g}")
        differences = checked_array(
            "differences",
            self.differences,
            *corners.shape,
            2,
            least=-2 * FARTHEST,
            most=2 * FARTHEST,
        )
        put_in(self, corners=corners, weights=weights, differences=differences)

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
        differences = self._differences(environment, indices, turned)
        return np.einsum("km,kmd->kd", weights / totals, environment.corners[corners] + differences)

    def carried(self, environment, matching=None, turned=False):
        """The same ties with the objects where they stand now (Sec. IV-B).

        Relocating from it goes on from the demonstrated differences, so that moving objects there
        and back moves nothing. Ties to objects that are gone are cut.

        Parameters
        ----------
        environment : Environment
            The objects as they stand now.
        matching : Matching, optional
            As for `relocate`.
        turned : bool
            Beyond the paper: with differences that are turned with the layout.

        Returns
        -------
        Association
            With corners of that environment.

        Raises
        ------
        ValueError
            As `relocate`, but that a subgoal may lose all its ties.
        """
        indices, corners, weights = self._ties(environment, matching)
        return Association(environment, corners, weights, self._differences(environment, indices, turned))

    def _differences(self, environment, indices, turned):
        """The differences (K, m, 2) in m, turned with the layout if that is wanted."""
        if not checked_flag("turned", turned):
            return self.differences
        matched = indices >= 0
        before, now = self.environment.corners[matched], environment.corners[indices[matched]]
        return self.differences @ rotation(layout_turn(before, now)).T

    def _ties(self, environment, matching):
        """Where all corners go (4N,), where those of each subgoal go (K, m), and their weights."""
        names = "the associated environment", "the new one"
        checked_record("environment", environment, Environment)
        if matching is None:
            matching, _ = match_surely(self.environment, environment, names)
        checked_record("matching", matching, Matching)
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
    corners = checked_record("environment", environment, Environment).corners
    if len(corners) == 0:
        raise ValueError("subgoals need an environment of at least 1 object, got 0")
    m = checked_whole("m, of the corners,", m, 1, len(corners))
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
    given = checked_positions("corners_i", corners_i)
    z, w = given @ (1, 1j), checked_positions("corners_j", corners_j, len(given), 2) @ (1, 1j)
    if not len(given):
        return 0.0
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
        directions = checked_positions("directions", self.directions, len(positions))
        put_in(self, positions=positions, directions=wrapped(directions))

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

    Raises
    ------
    ValueError
        Shapes that do not belong together, or weights that are negative or sum to more than 1.
    """

    local: np.ndarray
    weights: np.ndarray

    def __post_init__(self):
        weights = checked_array("weights", self.weights, "M", "K", least=0, most=1 + _ROUNDING)
        heaviest = weights.sum(axis=0).max(initial=0)
        if heaviest > 1 + _ROUNDING:
            raise ValueError(f"the weights of a subgoal must sum to 1 at most, got {heaviest:g}")
        local = checked_array("local", self.local, *weights.shape, 2, least=-2 * FARTHEST, most=2 * FARTHEST)
        put_in(self, local=local, weights=weights)

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
        if len(checked_record("frames", frames, Frames)) != len(self.local):
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
    subgoals = checked_positions("subgoals", subgoals, "D", "K", 2)
    frames = checked_records("frames", frames, Frames)
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
