"""Sequenced LDS: the closed form and its stability, the exact search, the tolerance, several laps, moved subgoals."""

import itertools
import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from test_trajectory import walk_figure_eights

from dollop.lds import (
    LDS,
    SequencedLDS,
    Statistics,
    best_segments,
    candidate_responses,
    cut_moments,
    distances,
    fewest_segments,
    powers_on,
    raw_statistics,
    retimed_statistics,
    segment_errors,
)
from dollop.trajectory import align, arc_length, distance_to_polyline, laps, mean_trajectory, retime

any_walk = st.integers(3, 30).flatmap(
    lambda n: arrays(float, (n, 2), elements=st.floats(-10, 10, allow_nan=False).map(lambda x: round(x, 3)))
)
any_walks = st.lists(any_walk, min_size=1, max_size=3)


def moving(walks):
    """Only walks that do move, as the fit demands."""
    assume(all((walk != walk[0]).any() for walk in walks))
    return walks


@pytest.fixture(scope="module")
def one_lap():
    """A walked figure-eight of one lap (N, 2)."""
    return walk_figure_eights(1, seed=0)[1]


@pytest.fixture(scope="module")
def five_laps():
    """Five laps cut out of one track."""
    return laps(*walk_figure_eights(6, seed=0))[:5]


@pytest.fixture(scope="module")
def law(one_lap):
    """The sequenced LDS of one lap with the default tolerance."""
    return SequencedLDS.fit(one_lap)


# One LDS


def test_fit_recovers_a_known_system():
    """Samples of a linear system that came to rest give back its matrix, up to the shrinkage of one in a thousand."""
    A, goal = np.array([[0.8, -0.15], [0.1, 0.85]]), np.array([2.0, -1.0])
    walks = [goal + powers_on(A, np.array(x0), 120) for x0 in ([3.0, 1.0], [-2.0, 2.0])]
    lds = LDS.fit(walks, retimed=False)
    assert np.allclose(lds.A, A, atol=2e-3)
    assert np.allclose(lds.goal, goal, atol=1e-6)


@settings(max_examples=50)
@given(any_walks)
def test_closed_form_is_least_squares(walks):
    """The matrix solves the normal equations of the samples, the virtual ones of the shrinkage included."""
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
    """The stability theorem: the spectral radius is below one for any trajectories, raw or re-timed."""
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
    """Along the response from any start the Lyapunov function does not grow, and it is zero at the subgoal only."""
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
    there = LDS.from_statistics(lds.statistics, lds.goal + [5, 7])
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
    """A straight segment, which leaves the matrix undetermined across it, has a straight response."""
    lds = LDS.fit(np.linspace([1.0, 1.0], [4.0, 3.0], 30))
    assert distance_to_polyline(lds.response([1.0, 1.0], 100), [[1.0, 1.0], [4.0, 3.0]]).max() < 1e-9


@pytest.mark.parametrize(("turn", "within"), [(45, 0.004), (90, 0.006), (120, 0.012)])
def test_retiming_draws_arcs_well(turn, within):
    """One re-timed LDS draws an arc of 1.3 m radius within millimetres, far better than one of the raw samples."""
    angle = np.linspace(0, np.radians(turn), 100)
    arc = 1.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    error = {r: distance_to_polyline(arc, LDS.fit(arc, r).response(arc[0], 600)).mean() for r in (True, False)}
    assert error[True] < within < error[False]


def test_no_unstable_system():
    """A matrix that does not come to rest is refused."""
    still = Statistics(np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match=r"spectral radius below one, got 1\.0"):
        LDS(np.eye(2), np.zeros(2), still)


# The search


def search_input(walks, candidates, retimed=True):
    """The path and the statistics of segments that the search sees."""
    aligned, shares = align(walks, 2 * candidates - 1)
    moments = cut_moments(walks, shares[:, ::2])
    return aligned.mean(axis=0)[::2], retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)


def test_search_is_exact(one_lap):
    """Both searches find what enumerating every set of cuts finds."""
    errors = segment_errors(*search_input([one_lap[:100]], 14))
    divisions = [(0, *cuts, 13) for k in range(6) for cuts in itertools.combinations(range(1, 13), k)]
    spans = {cuts: [(i, j, errors[i, j]) for i, j in itertools.pairwise(cuts)] for cuts in divisions}
    total = {cuts: sum(e for *_, e in each) for cuts, each in spans.items()}
    for k in (1, 2, 3, 4, 6):
        best = min((cuts for cuts in divisions if len(cuts) == k + 1), key=total.get)
        assert tuple(best_segments(errors, k)) == best
    for tolerance in (0.5, 0.1, 0.05, 0.03, 0.02):
        kept = [cuts for cuts in divisions if all(e <= tolerance * (j - i) for i, j, e in spans[cuts])]
        best = min(kept, key=lambda cuts: (len(cuts), total[cuts]))
        assert tuple(fewest_segments(errors, tolerance)) == best


def test_fast_errors_agree_with_one_segment_at_a_time(one_lap):
    """Errors equal those of fitting, responding and measuring one by one; hopeless segments may look slightly worse."""
    path, statistics = search_input([one_lap], 30)
    errors = segment_errors(path, statistics)
    for i, j in [(0, 2), (3, 6), (3, 9), (10, 14), (0, 15), (20, 29)]:
        lds = LDS.from_statistics(statistics(i, j - i), path[j])
        response = np.vstack([lds.response(path[i], 48), path[j]])
        exact = distance_to_polyline(path[i + 1 : j], response).sum()
        assert exact - 1e-6 <= errors[i, j] <= exact * (1.02 if exact > 0.1 * (j - i) else 1 + 1e-6)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_fast_distances_are_never_too_small(seed):
    """Distances near the nearest vertex bound the true distances from above, and are equal for evenly drawn curves."""
    rng = np.random.default_rng(seed)
    points, polylines = rng.normal(size=(3, 8, 2)), rng.normal(size=(3, 6, 2)).cumsum(axis=1)
    exact = [distance_to_polyline(*each) for each in zip(points, polylines, strict=True)]
    assert (distances(points, polylines) >= np.array(exact) - 1e-5).all()
    curve = np.linspace(0, 2, 30)
    even = np.stack([curve, np.sin(curve)], axis=1)
    assert np.allclose(
        distances(points[:1] / 5 + even[12], even[None])[0], distance_to_polyline(points[0] / 5 + even[12], even)
    )


def test_raw_statistics_from_running_sums(five_laps):
    """Statistics of raw segments, from sums taken once, equal those computed from the samples."""
    shares = np.tile(np.linspace(0, 1, 20), (5, 1))
    moments = cut_moments(five_laps, shares)
    quick, cuts = raw_statistics(five_laps, moments)(np.array([2, 7]), 6), moments.round().astype(int)
    for which, start in enumerate([2, 7]):
        slow = [Statistics.of(lap[cut[start] : cut[start + 6] + 1]) for lap, cut in zip(five_laps, cuts, strict=True)]
        assert np.allclose(quick.G0[which], sum(each.G0 for each in slow))
        assert np.allclose(quick.G1[which], sum(each.G1 for each in slow))


def test_retimed_statistics_are_those_of_the_retimed_piece():
    """Statistics from the aligned samples are those of cutting the piece out and re-timing it."""
    piece = np.linspace([0.0, 0.0], [3.0, 4.0], 21)
    quick = retimed_statistics(piece[None])(2, 6)
    slow = Statistics.of(retime(piece[4:17], 40, 3.0))
    assert np.allclose(quick.G0, slow.G0) and np.allclose(quick.G1, slow.G1)


def test_slow_responses_are_followed_to_the_subgoal():
    """The search sees even a slow system's response come close to its subgoal before it is joined to it."""
    slow = Statistics(np.eye(2)[None], 0.995 * np.eye(2)[None])
    responses = candidate_responses(slow, np.array([[3.0, 4.0]]))
    assert np.linalg.norm(responses[0, -2]) < 0.05 * 5 and not responses[0, -1].any()


# A sequence of LDS


def test_one_lap_needs_five_to_seven_segments(law, one_lap):
    """A walked figure-eight comes out as in the paper: 5 to 7 LDS, at most 20 mm mean error."""
    assert 5 <= len(law.segments) <= 7
    assert law.error(one_lap) <= 0.02
    assert np.allclose(law.start, one_lap[0]) and np.allclose(law.subgoals[-1], one_lap[-1])


@pytest.mark.parametrize("seed", range(4))
def test_five_laps_need_five_to_seven_segments(seed):
    """Five laps fitted together: 5 to 7 LDS, at most 20 mm mean error to their mean."""
    walks = laps(*walk_figure_eights(6, seed))[:5]
    law = SequencedLDS.fit(walks)
    assert 5 <= len(law.segments) <= 7
    assert law.error(mean_trajectory(walks)) <= 0.02


def test_retimed_is_better_than_raw(one_lap):
    """With the same number of segments the re-timed fit is at least 1.5 times nearer to the walk."""
    for k in (5, 6, 7):
        retimed, raw = (SequencedLDS.fit(one_lap, n_segments=k, retimed=r).error(one_lap) for r in (True, False))
        assert 1.5 * retimed < raw


def test_more_tolerance_never_needs_more_segments(one_lap):
    """The number of segments falls with the tolerance."""
    numbers = [len(SequencedLDS.fit(one_lap, tol, candidates=60).segments) for tol in (0.006, 0.01, 0.02, 0.05, 0.1, 1)]
    assert numbers == sorted(numbers, reverse=True) and numbers[-1] < 5 < numbers[0]


def test_number_of_segments_is_obeyed(one_lap):
    """n_segments fixes the number, raw and re-timed."""
    for k, retimed in itertools.product((1, 3, 8), (True, False)):
        assert len(SequencedLDS.fit(one_lap, n_segments=k, retimed=retimed, candidates=40).segments) == k


def test_straight_walk_is_one_segment():
    """A straight line needs one LDS."""
    assert len(SequencedLDS.fit(np.linspace([0, 0], [6, 2], 70)).segments) == 1


def test_corners_become_subgoals():
    """The corners of a square walked round are the subgoals."""
    corners = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0.0, 0.0]])
    walk = np.concatenate(
        [np.linspace(a, b, 25, endpoint=False) for a, b in itertools.pairwise(corners)] + [corners[-1:]]
    )
    law = SequencedLDS.fit(walk, tolerance=0.005, candidates=81)
    assert np.allclose(law.subgoals, corners[1:], atol=0.06)


@pytest.mark.parametrize("retimed", [True, False])
def test_fit_moves_with_the_lab(one_lap, retimed):
    """Turning, shifting and mirroring the lab does the same to the subgoals."""
    turn = np.array([[0.6, 0.8], [0.8, -0.6]])
    here = SequencedLDS.fit(one_lap, retimed=retimed, candidates=50)
    there = SequencedLDS.fit(one_lap @ turn.T + [30, -7], retimed=retimed, candidates=50)
    assert np.allclose(there.subgoals, here.subgoals @ turn.T + [30, -7], atol=1e-6)


def test_several_laps_are_one_task(five_laps):
    """A joint fit has its subgoals among the laps' own places, and is nearer to their mean than any lap is."""
    law, mean = SequencedLDS.fit(five_laps), mean_trajectory(five_laps)
    beside = [distance_to_polyline(law.subgoals, lap).max() for lap in five_laps]
    assert max(beside) < 0.3
    assert law.error(mean) < min(distance_to_polyline(lap, mean).mean() for lap in five_laps)


def test_the_same_lap_twice_is_that_lap(one_lap, law):
    """Fitting two copies changes nothing but the weight of the statistics."""
    twice = SequencedLDS.fit([one_lap, one_lap])
    assert np.allclose(twice.subgoals, law.subgoals, atol=0.02)
    assert np.allclose(twice.speeds, law.speeds, rtol=0.05)


def test_speeds_are_those_walked():
    """Speeds are way over time; halving the sample period doubles them."""
    walk = np.concatenate([np.linspace([0, 0], [3, 0], 31), np.linspace([3, 0.05], [3, 3], 60)])
    slow, fast = (SequencedLDS.fit(walk, 0.005, sample_period=period) for period in (0.1, 0.05))
    assert slow.speeds[0] == pytest.approx(1.0, rel=0.02) and slow.speeds[-1] == pytest.approx(0.5, rel=0.02)
    assert np.allclose(fast.speeds, 2 * slow.speeds)


@settings(max_examples=60)
@given(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), st.sampled_from([0.3, 0.05, 0.01, 1e-4]))
def test_response_arrives_from_anywhere(law, start, reach):
    """Kidnapped anywhere, the response passes within reach of every subgoal in order and ends at the last."""
    response = law.response(start, reach)
    assert np.allclose(response[0], start)
    assert np.linalg.norm(response[-1] - law.subgoals[-1]) <= reach
    at = 0
    for goal in law.subgoals:
        near = np.flatnonzero(np.linalg.norm(response[at:] - goal, axis=1) <= reach)
        assert len(near)
        at += near[0]


def test_response_starts_where_the_walk_did(law, one_lap):
    """By default the response starts at the demonstrations' start and never jumps."""
    response = law.response()
    assert np.allclose(response[0], one_lap[0])
    assert np.linalg.norm(np.diff(response, axis=0), axis=1).max() < 0.5


def test_errors_agree_with_distances(law, one_lap):
    """The reported errors are the mean and the largest distance, and the mean the other way round."""
    errors, there = law.errors(one_lap), distance_to_polyline(one_lap, law.response())
    assert errors["mean"] == law.error(one_lap) == pytest.approx(there.mean())
    assert errors["max"] == pytest.approx(there.max())
    assert 0 < errors["reverse"] < 0.02


def test_moved_subgoals_move_the_response(law):
    """Shifting or scaling all subgoals and the start shifts or scales the response; no LDS changes its matrix."""
    moved = law.with_subgoals(2 * law.subgoals + [5, 5], start=2 * law.start + [5, 5])
    assert np.allclose(moved.response(reach=0.02), 2 * law.response(reach=0.01) + [5, 5])
    assert all(a.A is b.A for a, b in zip(law.segments, moved.segments, strict=True))


def test_one_moved_subgoal_changes_only_its_neighbours(law):
    """Moving one subgoal leaves the response of the others' segments where it was."""
    goals = law.subgoals
    goals[1] += [0.5, 0.2]
    moved = law.with_subgoals(goals)
    tail = law.response()[-40:]
    assert distance_to_polyline(tail, moved.response()).max() < 0.02
    assert distance_to_polyline(goals[1:2], moved.response()).max() <= 0.01


@pytest.mark.skipif(
    "DOLLOP_EXTERNAL_DATA" not in os.environ,
    reason="DOLLOP_EXTERNAL_DATA does not name the folder with external recordings",
)
@pytest.mark.parametrize("letter", "GSZ")
def test_handwritten_letters_are_drawn(letter):
    """A sequenced LDS of all handwritten samples of a letter draws their mean within 1 % of its diagonal."""
    file = Path(os.environ["DOLLOP_EXTERNAL_DATA"], "letters", f"{letter}.mat")
    demos = [demo["pos"][0, 0].T.astype(float) for demo in scipy.io.loadmat(file)["demos"][0]]
    diagonal = np.linalg.norm(np.ptp(np.concatenate(demos), axis=0))
    walks = [demo / diagonal for demo in demos]
    law = SequencedLDS.fit(walks, tolerance=0.01)
    assert 2 <= len(law.segments) <= 4
    assert law.error(mean_trajectory(walks)) < 0.01


# Bad input


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"tolerance": 0}, "tolerance must be positive, got 0"),
        ({"tolerance": np.nan}, "tolerance must be positive, got nan"),
        ({"n_segments": 0}, "n_segments must be a whole number from 1 to 49.*got 0"),
        ({"n_segments": 50}, "n_segments must be a whole number from 1 to 49.*got 50"),
        ({"n_segments": 2.5}, "n_segments must be a whole number"),
        ({"sample_period": -0.1}, "sample_period must be positive, got -0.1"),
        ({"candidates": 2}, "candidates must be at least 3, got 2"),
        ({"tolerance": 1e-6}, r"tolerance 1e-06 m cannot be kept with 100 candidate cuts, 0\.\d+ m can"),
    ],
)
def test_bad_parameters(one_lap, options, says):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=says):
        SequencedLDS.fit(one_lap, **options)


def test_the_tolerance_that_can_be_kept_is_kept(one_lap):
    """The tolerance named in the error does work, and nothing below it."""
    with pytest.raises(ValueError) as refusal:
        SequencedLDS.fit(one_lap, tolerance=1e-6, candidates=50)
    least = float(str(refusal.value).split("cuts, ")[1].split(" m can")[0])
    SequencedLDS.fit(one_lap, tolerance=1.01 * least, candidates=50)
    with pytest.raises(ValueError, match="cannot be kept"):
        SequencedLDS.fit(one_lap, tolerance=0.98 * least, candidates=50)


@pytest.mark.parametrize("fit", [LDS.fit, SequencedLDS.fit])
@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ([[0, 0], [1, 1]], "at least three points, got 2"),
        ([[1, 2]] * 5, "must move"),
        ([[0, 0], [np.nan, 1], [2, 2]], "finite"),
        ([], "at least one trajectory"),
    ],
)
def test_bad_trajectories(fit, bad, says):
    """What is no trajectory is fitted by neither."""
    with pytest.raises(ValueError, match=says):
        fit(bad)


def test_bad_subgoals_and_starts(law):
    """Wrong numbers of subgoals, a start that is no position, and a reach of nothing are refused."""
    with pytest.raises(ValueError, match=f"subgoals must be {len(law.segments)} finite positions"):
        law.with_subgoals(law.subgoals[:-1])
    with pytest.raises(ValueError, match="start must be two finite numbers"):
        law.response([np.nan, 0])
    with pytest.raises(ValueError, match="reach must be positive, got 0"):
        law.response(reach=0)


@settings(max_examples=40)
@given(any_walks, st.booleans())
def test_any_walks_can_be_fitted(walks, retimed):
    """However wild the walks, the fit yields stable segments that lead from the mean start to the mean end."""
    law = SequencedLDS.fit(moving(walks), n_segments=2, retimed=retimed, candidates=12)
    assert np.allclose(law.start, np.mean([walk[0] for walk in walks], axis=0))
    assert np.allclose(law.subgoals[-1], np.mean([walk[-1] for walk in walks], axis=0))
    assert np.linalg.norm(law.response()[-1] - law.subgoals[-1]) <= 0.01
    assert (law.speeds >= 0).all() and arc_length(law.response())[-1] < np.inf
