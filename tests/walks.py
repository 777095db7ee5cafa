"""Walks to test with: a person's figure-eights, and any walks at all."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import CubicSpline

from dollop.trajectory import arc_length

ROUND_TWO_CANS = np.array(  # a figure-eight round cans at (-2, 0) and (2, 0), one lap
    [[-1.2, -0.9], [0, 0], [1.2, 0.95], [2.3, 1.05], [3.2, 0.1], [2.4, -1.0]]
    + [[1.2, -0.9], [0, 0], [-1.2, 0.95], [-2.3, 1.05], [-3.2, 0.1], [-2.4, -1.0]]
)


def walk_figure_eights(n_laps, seed, drift=0.08, noise=0.015, period=0.1):
    """A person's way, no linear system: a spline through drifting way-points, slower in curves, correlated noise.

    Returns times in s (N,) and positions in m (N, 2) of the given number of laps, starting at a lap's first way-point.
    """
    rng = np.random.default_rng(seed)
    way = np.concatenate([ROUND_TWO_CANS + rng.normal(0, drift, ROUND_TWO_CANS.shape) for _ in range(n_laps + 1)])
    knots = arc_length(way)
    spline = CubicSpline(knots, way)
    places = np.linspace(0, knots[len(ROUND_TWO_CANS) * n_laps], 4000 * n_laps)
    first, second = spline(places, 1), spline(places, 2)
    curvature = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.linalg.norm(first, axis=1) ** 3
    speed = 1.1 * (1 + (curvature / 0.6) ** 2) ** (-1 / 6)
    times = np.cumsum(np.append(0, np.diff(arc_length(spline(places)))) / speed)
    t = np.arange(0, times[-1], period)
    shocks = rng.normal(0, noise * 0.6, (len(t), 2))
    correlated = np.array([np.convolve(column, 0.8 ** np.arange(30))[: len(t)] for column in shocks.T]).T
    return t, spline(np.interp(t, times, places)) + correlated


any_walk = st.integers(3, 30).flatmap(
    lambda n: arrays(float, (n, 2), elements=st.floats(-10, 10, allow_nan=False).map(lambda x: round(x, 3)))
)
any_walks = st.lists(any_walk, min_size=1, max_size=3)


def moving(walks):
    """Only walks that do move, as the fit demands."""
    assume(all((walk != walk[0]).any() for walk in walks))
    return walks
