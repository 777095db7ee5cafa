"""One LDS: the closed form, its stability, its response, merging by addition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import any_walks, moving

from dollop.lds import LDS, MOST_STEPS, Statistics, powers_on
from dollop.trajectory import distance_to_polyline


def test_fit_recovers_a_known_system():
    """Samples of a linear system that came to rest give back its matrix, up to the shrinkage."""
    A, goal = np.array([[0.8, -0.15], [0.1, 0.85]]), np.array([2.0, -1.0])
    walks = [goal + powers_on(A, np.array(x0), 120) for x0 in ([3.0, 1.0], [-2.0, 2.0])]
    lds = LDS.fit(walks, retimed=False)
    assert np.allclose(lds.A, A, atol=2e-3)
    assert np.allclose(lds.goal, goal, atol=1e-6)


@settings(max_examples=50)
@given(any_walks)
def test_closed_form_is_least_squares(walks):
    """The matrix solves the normal equations of samples and of the shrinkage's virtual ones."""
    statistics = LDS.fit(moving(walks), retimed=False).statistics
    offsets = [walk - walk[-1] for walk in walks]
    weight = np.sqrt(1e-3 * np.trace(statistics.G0) / 2)
    now = np.concatenate([*(x[:-1] for x in offsets), weight * np.eye(2)])
    after = np.concatenate([*(x[1:] for x in offsets), statistics.decay * weight * np.eye(2)])
    expected = np.linalg.lstsq(now, after, rcond=None)[0].T
    assert np.allclose(statistics.matrix, expected, atol=1e-6)


@settings(max_examples=300)
@given(any_walks, st.booleans())
def test_stable_whatever_the_data(walks, retimed):
    """Stability: the spectral radius is below one for any trajectories, raw or re-timed."""
    assert np.abs(np.linalg.eigvals(LDS.fit(moving(walks), retimed).A)).max() < 1


@settings(max_examples=300)
@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_stable_in_any_dimension(d, seed):
    """The theorem holds for walks in one to four dimensions and for sums of their statistics."""
    rng = np.random.default_rng(seed)
    walks = [rng.normal(size=(rng.integers(3, 20), d)) * rng.lognormal(0, 3, d) for _ in range(3)]
    first, second, third = map(Statistics.of, walks)
    assert np.abs(np.linalg.eigvals((first + second + third).matrix)).max() < 1


@settings(max_examples=100)
@given(any_walks, st.booleans(), st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_lyapunov_function_never_grows(walks, retimed, start):
    """Along any response the Lyapunov function does not grow; it is zero at the subgoal only."""
    lds = LDS.fit(moving(walks), retimed)
    values = lds.lyapunov(lds.response(start, 40))
    assert (np.diff(values) <= 1e-9 * values[0]).all()
    assert lds.lyapunov(lds.goal) == 0 and (values >= 0).all()


@settings(max_examples=50)
@given(any_walks, any_walks)
def test_merging_is_adding(some, others):
    """The statistics of two segments add up to those of a fit to both."""
    a, b = LDS.fit(moving(some)), LDS.fit(moving(others))
    both, added = LDS.fit([*some, *others]).statistics, a.statistics + b.statistics
    assert np.allclose(added.G0, both.G0) and np.allclose(added.G1, both.G1)


def test_moving_goal_and_start_moves_the_response():
    """A response is shifted with its subgoal and scaled with its distance from it."""
    lds = LDS.fit(np.array([[0.0, 0.0], [1.0, 0.4], [2.0, 0.5]]))
    there = LDS(lds.statistics, lds.goal + [5, 7])
    assert np.allclose(there.response([5, 7], 30), lds.response([0, 0], 30) + [5, 7])
    far = lds.response(lds.goal + 2 * (np.zeros(2) - lds.goal), 30) - lds.goal
    assert np.allclose(far, 2 * (lds.response([0, 0], 30) - lds.goal))


def test_response_is_steps():
    """The n-th state of a response is n steps away; a step takes any number of states."""
    lds = LDS.fit(np.array([[0.0, 0.0], [1.0, 0.4], [2.0, 0.5]]))
    states = lds.response([1.0, -1.0], 11)
    assert states.shape == (12, 2)
    assert np.allclose(lds.step(states[:-1]), states[1:])


def test_straight_lines_are_followed():
    """A straight segment, which says nothing of what is across it, has a straight response."""
    lds = LDS.fit(np.linspace([1.0, 1.0], [4.0, 3.0], 30))
    response = lds.response([1.0, 1.0], 100)
    assert distance_to_polyline(response, [[1.0, 1.0], [4.0, 3.0]]).max() < 1e-9


@pytest.mark.parametrize(("turn", "within"), [(45, 0.004), (90, 0.006), (120, 0.012)])
def test_retiming_draws_arcs_well(turn, within):
    """One re-timed LDS draws an arc of 1.3 m radius within millimetres, a raw one does not."""
    angle = np.linspace(0, np.radians(turn), 100)
    arc = 1.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    responses = (LDS.fit(arc, retimed).response(arc[0], 600) for retimed in (True, False))
    retimed, raw = (distance_to_polyline(arc, response).mean() for response in responses)
    assert retimed < within < raw


def test_no_unstable_system():
    """Statistics that no trajectory has, not finite or of another dimension are refused."""
    with pytest.raises(ValueError, match=r"spectral radius below one, got 1\.0"):
        LDS(Statistics(np.eye(2), np.eye(2)), np.zeros(2))
    with pytest.raises(ValueError, match="G0 must be finite"):
        LDS(Statistics(np.diag([1.0, np.nan]), np.eye(2)), np.zeros(2))
    with pytest.raises(ValueError, match=r"G0 must have shape \(2, 2\), got \(3, 3\)"):
        LDS(Statistics(np.eye(3), np.zeros((3, 3))), np.zeros(2))


@pytest.mark.parametrize("state", [[1.0], 5, [np.nan, 0], [1.0, 2.0, 3.0]])
def test_what_is_no_state_is_refused(state):
    """A state is two finite numbers: nothing is stretched to fit."""
    lds = LDS.fit([[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]])
    for ask in (lds.step, lds.lyapunov, lambda x: lds.response(x, 3)):
        with pytest.raises(ValueError, match="^a state must "):
            ask(state)
    with pytest.raises(ValueError, match="n must be a whole number, 0 to 100000, got -1"):
        lds.response([0, 0], -1)


def test_turning_turns_the_matrix():
    """The LDS turned by an angle has the matrix R A R^T, and the same subgoal."""
    lds, c, s = LDS.fit([[0.0, 0.0], [1.0, 0.4], [2.0, 0.1]]), np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s], [s, c]])
    assert np.allclose(lds.turned(0.7).A, R @ lds.A @ R.T)
    assert (lds.turned(0.7).goal == lds.goal).all()


def test_steps_are_bounded():
    """A hundred thousand steps are taken, and no more are asked for in vain."""
    lds = LDS.fit([[0.0, 1.0], [1.0, 0.5], [2.0, 0.0]])
    assert lds.response([0.0, 1.0], MOST_STEPS).shape == (MOST_STEPS + 1, 2)
    for n in (MOST_STEPS + 1, 10**9, 10**400, np.inf, np.nan):
        with pytest.raises(ValueError, match="n must be a whole number, 0 to 100000, got"):
            lds.response([0.0, 1.0], n)
