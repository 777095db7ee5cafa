"""One linear dynamical system (LDS) for a segment of the user's trajectory (Sec. III).

Within a segment the offset x = p - g from its subgoal g obeys x[n+1] = A x[n]; A comes from
closed-form least squares. The companion work that the paper cites for the fit could not be found:
this one is a reconstruction.

Symbols: A (2, 2) matrix of an LDS, G0 = sum x[n] x[n]^T and G1 = sum x[n+1] x[n]^T its statistics,
d = 2 dimensions.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot

import numpy as np

from dollop.checks import (
    checked_array,
    checked_flag,
    checked_number,
    checked_positions,
    checked_record,
    checked_whole,
    put_in,
    told,
)
from dollop.pose import rotation
from dollop.trajectory import check_trajectories, retime

__all__ = ["DECAY", "LDS", "MOST_STEPS", "NOTHING", "STEPS", "Statistics", "dot", "powers_on"]

SHRINKAGE = 1e-3  # share of the mean variance that is added to every direction of G0
STEPS, DECAY = 40, 3.0
"""A re-timed segment: its steps, and the time constants over which it decays."""

MOST_STEPS = 100_000
"""Steps of a response: one that keeps 0.9997 of its offset at each comes from 1e9 m to a micrometre
in so many, and what is shown decays within some forty by e^3."""

NOTHING = 1e-18
"""m^2: a squared length that counts as zero."""
_MOST, _ROUNDING = 1e30, 1e-4
"""m^2 that squared offsets within 1e9 m can sum up to; and share of them that rounding may have made, a
fifth of what shrinkage adds."""


@dataclass(frozen=True, eq=False)
class Statistics:
    """All that the fit needs to know of a segment; those of merged segments are the sum.

    Attributes
    ----------
    G0, G1 : (..., d, d) float arrays
        Sums of x[n] x[n]^T and of x[n+1] x[n]^T over all samples but the last, in m^2, x being the
        offset from the end.

    Raises
    ------
    ValueError
        Where they are not finite, not square, not of one shape, or larger than 1e30 m^2.

    Examples
    --------
    The fit to two walks is that of their statistics' sum, so that walks need not be kept:

    >>> walks = np.random.default_rng(0).normal(size=(2, 50, 2)).cumsum(axis=1)
    >>> one, other = (Statistics.of(walk) for walk in walks)
    >>> np.allclose((one + other).matrix, LDS.fit(list(walks), retimed=False).A)
    True
    """

    G0: np.ndarray
    G1: np.ndarray

    def __post_init__(self):
        G0 = checked_array("G0", self.G0, "...", "d", "d", least=-_MOST, most=_MOST)
        if G0.shape[-2] != G0.shape[-1]:
            raise ValueError(f"G0 must be square, got shape {G0.shape}")
        put_in(self, G0=G0, G1=checked_array("G1", self.G1, *G0.shape, least=-_MOST, most=_MOST))

    def __add__(self, other):
        return Statistics(self.G0 + other.G0, self.G1 + other.G1)

    @classmethod
    def of(cls, samples):
        """Statistics of trajectories of one length, each shifted by its own last sample.

        Parameters
        ----------
        samples : (..., N, d) float array
            Positions in m.

        Returns
        -------
        Statistics
            (..., d, d), m^2.

        Raises
        ------
        ValueError
            For what are no positions within 1e9 m, or none at all.
        """
        samples = checked_positions("samples", samples, "...", "N", "d")
        if not samples.shape[-2]:
            raise ValueError(f"samples must hold one at least, got shape {samples.shape}")
        offsets = samples - samples[..., -1:, :]
        before = np.swapaxes(offsets[..., :-1, :], -1, -2)
        return cls(before @ offsets[..., :-1, :], np.swapaxes(before @ offsets[..., 1:, :], -1, -2))

    @property
    def regular(self):
        """G0 and G1, (..., d, d) in m^2, shrunk towards a uniform decay: nothing is undetermined.

        As if further demonstrations came straight in along each axis with the segment's own
        `decay`, so the fit stays stable also for a straight segment. (Shrinking A to zero instead
        would have every error beside the path undone in one step.) A reconstruction.
        """
        size = np.maximum(np.trace(self.G0, axis1=-2, axis2=-1), NOTHING)
        d = self.G0.shape[-1]
        weight = (SHRINKAGE * size / d)[..., None, None] * np.eye(d)
        return self.G0 + weight, self.G1 + self.decay[..., None, None] * weight

    @property
    def decay(self):
        """The one number a (...) that fits x[n+1] = a x[n] best: tr G1 / tr G0, from -1 to 1."""
        size = np.maximum(np.trace(self.G0, axis1=-2, axis2=-1), NOTHING)
        return np.trace(self.G1, axis1=-2, axis2=-1) / size

    @property
    def matrix(self):
        """A = G1 G0^-1 (..., d, d) after shrinkage: least squares, spectral radius below one."""
        G0, G1 = self.regular
        return np.swapaxes(np.linalg.solve(G0, np.swapaxes(G1, -1, -2)), -1, -2)


@dataclass(frozen=True, eq=False)
class LDS:
    """A linear dynamical system that comes to rest at its subgoal, from anywhere (Sec. III).

    Attributes
    ----------
    statistics : Statistics
        G0 and G1 (2, 2). Those of two segments add up to the LDS that describes both, if both are
        re-timed or neither is.
    goal : (2,) float array
        The subgoal, m.

    Raises
    ------
    ValueError
        Statistics or a goal that are not finite or not of two dimensions, a goal beyond 1e9 m, or
        statistics that no trajectory has.
    """

    statistics: Statistics
    goal: np.ndarray

    def __post_init__(self):
        put_in(self, goal=checked_positions("goal", self.goal, 2))
        checked_record("statistics", self.statistics, Statistics)
        (a, b), (c, d) = checked_array("G0", self.statistics.G0, 2, 2).tolist()
        size = max(a + d, NOTHING)
        least = (a + d) / 2 - hypot((a - d) / 2, b)
        if abs(b - c) > _ROUNDING * size or least < -_ROUNDING * size:
            raise ValueError(f"G0 must be a sum of x x^T, got {told([[a, b], [c, d]])}")
        radius = np.abs(np.linalg.eigvals(self.A)).max()
        if not radius < 1:
            raise ValueError(f"A must have a spectral radius below one, got {radius}")

    def __repr__(self):
        (x, y), radius = self.goal, np.abs(np.linalg.eigvals(self.A)).max()
        return f"LDS to ({x:.2f}, {y:.2f}), spectral radius {radius:.3f}"

    @cached_property
    def A(self):
        """(2, 2) float array: the matrix per step, of spectral radius below one."""
        return self.statistics.matrix

    @classmethod
    def fit(cls, trajectories, retimed=True):
        """Fit one LDS to one or several trajectories by least squares in closed form (Sec. III).

        Each trajectory is shifted by its own end, which makes the estimate stable whatever the
        data.

        Parameters
        ----------
        trajectories : (N, 2) array_like or sequence of K (N_k, 2) array_like
            Positions in m.
        retimed : bool
            Fit to the re-timed curves (see `dollop.trajectory.retime`), every trajectory counting
            the same; or to the samples as they are, every sample counting the same and A being per
            sample.

        Returns
        -------
        LDS
            With its goal at the mean of the ends.

        Raises
        ------
        ValueError
            A trajectory of fewer than three points, without movement, or not finite.

        Examples
        --------
        >>> line = np.linspace([2.0, 1.0], [0.0, 0.0], 20)
        >>> lds = LDS.fit(line)
        >>> bool(abs(np.linalg.eigvals(lds.A)).max() < 1)
        True
        """
        walks, retimed = check_trajectories(trajectories), checked_flag("retimed", retimed)
        samples = [retime(walk, STEPS, DECAY) if retimed else walk for walk in walks]
        first, *others = map(Statistics.of, samples)
        return cls(sum(others, first), np.mean([walk[-1] for walk in walks], axis=0))

    def turned(self, angle):
        """The LDS turned about its subgoal: A becomes R A R^T.

        Parameters
        ----------
        angle : float
            rad.

        Returns
        -------
        LDS
            With the same subgoal.

        Raises
        ------
        ValueError
            For what is no angle.

        Examples
        --------
        >>> lds = LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]])
        >>> np.allclose(lds.turned(0.7).turned(-0.7).A, lds.A)
        True
        """
        R = rotation(checked_number("angle", angle))
        G0, G1 = self.statistics.G0, self.statistics.G1
        return replace(self, statistics=Statistics(R @ G0 @ R.T, R @ G1 @ R.T))

    def step(self, x):
        """The next state, x[n+1] = A x[n] about the subgoal (Sec. III).

        Parameters
        ----------
        x : (..., 2) array_like
            States in m.

        Returns
        -------
        (..., 2) float array
            g + A (x - g) in m.

        Raises
        ------
        ValueError
            Not two finite numbers each, within 1e9 m.

        Examples
        --------
        The subgoal is where it rests:

        >>> lds = LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]])
        >>> lds.step([2.0, 0.0])
        array([2., 0.])
        """
        return self.goal + (checked_positions("a state", x, "...", 2) - self.goal) @ self.A.T

    def response(self, x0, n):
        """The states from a start on (Sec. III).

        Parameters
        ----------
        x0 : (2,) array_like
            Start in m.
        n : int
            Number of steps, at most 100,000.

        Returns
        -------
        (n + 1, 2) float array
            m, x0 included.

        Raises
        ------
        ValueError
            A start that is not two finite numbers within 1e9 m, or a number of steps that is none or
            too many.

        Examples
        --------
        It comes to rest at the subgoal:

        >>> lds = LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]])
        >>> np.allclose(lds.response([-5.0, 7.0], 500)[-1], lds.goal)
        True
        """
        n, start = checked_whole("n", n, 0, MOST_STEPS), checked_positions("a state", x0, 2)
        return self.goal + powers_on(self.A, start - self.goal, n)

    def lyapunov(self, x):
        """Lyapunov function (x - g)^T G0^-1 (x - g), which never grows along a response.

        Parameters
        ----------
        x : (..., 2) array_like
            States in m.

        Returns
        -------
        (...) float array
            Without unit.

        Raises
        ------
        ValueError
            Not two finite numbers each, within 1e9 m.

        Examples
        --------
        >>> lds = LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]])
        >>> bool((np.diff(lds.lyapunov(lds.response([-5.0, 7.0], 30))) <= 0).all())
        True
        """
        offset = checked_positions("a state", x, "...", 2) - self.goal
        return dot(offset, np.linalg.solve(self.statistics.regular[0], offset[..., None])[..., 0])


def powers_on(A, x, n):
    """A^0 x, A^1 x, ..., A^n x, by doubling.

    Parameters
    ----------
    A : (..., d, d) float array
        Matrices.
    x : (..., d) float array
        Vectors.
    n : int
        From 0 on.

    Returns
    -------
    (..., n + 1, d) float array
        In the unit of x.

    Examples
    --------
    >>> powers_on(np.array([[0.5]]), np.array([8.0]), 3)[:, 0]
    array([8., 4., 2., 1.])
    """
    states, step = x[..., None, :], np.swapaxes(A, -1, -2)
    while states.shape[-2] <= n:
        states = np.concatenate([states, states @ step], axis=-2)
        step = step @ step
    return states[..., : n + 1, :]


def dot(a, b):
    """Inner products of vectors.

    Parameters
    ----------
    a, b : (..., d) float arrays
        Vectors.

    Returns
    -------
    (...) float array
        In the units' product.

    Examples
    --------
    >>> dot(np.array([[3.0, 4.0], [1.0, 0.0]]), np.array([3.0, 4.0]))
    array([25.,  3.])
    """
    return np.einsum("...d,...d->...", a, b)
