"""The search for subgoals: exact, and its fast statistics and distances against plain ones."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dollop.lds import LDS, Statistics
from dollop.segmentation import (
    best_segments,
    candidate_responses,
    cuts_within,
    distances,
    fewest_cuts,
    fewest_segments,
    lifted_vertices,
    raw_statistics,
    retimed_statistics,
    segment_errors,
)
from dollop.sequenced_lds import cut_moments
from dollop.trajectory import align, distance_to_polyline, resample, retime


def search_input(walks, candidates, retimed=True):
    """The path and the statistics of segments that the search sees."""
    aligned, shares = align(walks, 2 * candidates - 1)
    moments = cut_moments(walks, shares[:, ::2])
    statistics = retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)
    return aligned.mean(axis=0)[::2], statistics


def test_search_is_exact(one_lap):
    """Both searches find what enumerating every set of cuts finds."""
    errors = segment_errors(*search_input([one_lap[:100]], 14))
    between = (itertools.combinations(range(1, 13), k) for k in range(6))
    divisions = [(0, *cuts, 13) for cuts in itertools.chain.from_iterable(between)]
    ends = {cuts: np.array([cuts[:-1], cuts[1:]]) for cuts in divisions}
    total = {cuts: errors[*each].sum() for cuts, each in ends.items()}
    for k in (1, 2, 3, 4, 6):
        best = min((cuts for cuts in divisions if len(cuts) == k + 1), key=total.get)
        assert tuple(best_segments(errors, k)) == best
    for tolerance in (0.5, 0.1, 0.05, 0.03, 0.02):
        mean = {cuts: errors[*each] / np.diff(cuts) for cuts, each in ends.items()}
        kept = [cuts for cuts in divisions if mean[cuts].max() <= tolerance]
        best = min(kept, key=lambda cuts: (len(cuts), total[cuts]))
        assert tuple(fewest_segments(errors, tolerance)) == best


def test_fast_errors_agree_with_one_segment_at_a_time(one_lap):
    """Errors are those of one segment at a time; only hopeless ones may look slightly worse."""
    path, statistics = search_input([one_lap], 30)
    errors = segment_errors(path, statistics)
    for i, j in [(0, 2), (3, 6), (3, 9), (10, 14), (0, 15), (20, 29)]:
        lds = LDS(statistics(i, j - i), path[j])
        response = np.vstack([lds.response(path[i], 48), path[j]])
        exact = distance_to_polyline(path[i + 1 : j], response).sum()
        assert exact - 1e-6 <= errors[i, j] <= exact * (1.02 if exact > 0.1 * (j - i) else 1 + 1e-6)


def fast_distances(points, polylines):
    """`distances` of points (B, T, 2) to one polyline (V, 2) for each B."""
    vertices = polylines.transpose(2, 1, 0)
    return distances(points.transpose(2, 0, 1), vertices, lifted_vertices(vertices), np.arange(len(points)))


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_fast_distances_are_never_too_small(seed):
    """Fast distances bound the true ones from above, and are equal for evenly drawn curves."""
    rng = np.random.default_rng(seed)
    points, polylines = rng.normal(size=(3, 8, 2)), rng.normal(size=(3, 6, 2)).cumsum(axis=1)
    exact = [distance_to_polyline(*each) for each in zip(points, polylines, strict=True)]
    assert (fast_distances(points, polylines) >= np.array(exact) - 1e-5).all()
    curve = np.linspace(0, 2, 30)
    even = np.stack([curve, np.sin(curve)], axis=1)
    near = points[:1] / 5 + even[12]
    assert np.allclose(fast_distances(near, even[None])[0], distance_to_polyline(near[0], even))


def test_raw_statistics_from_running_sums(five_laps):
    """Statistics of raw segments, from sums taken once, equal those computed from the samples."""
    shares = np.tile(np.linspace(0, 1, 20), (5, 1))
    moments = cut_moments(five_laps, shares)
    quick = raw_statistics(five_laps, moments)(np.array([2, 7]), 6)
    cuts = moments.round().astype(int)
    for which, start in enumerate([2, 7]):
        spans = zip(five_laps, cuts[:, start], cuts[:, start + 6], strict=True)
        slow = [Statistics.of(lap[first : last + 1]) for lap, first, last in spans]
        assert np.allclose(quick.G0[which], sum(each.G0 for each in slow))
        assert np.allclose(quick.G1[which], sum(each.G1 for each in slow))


def test_retimed_statistics_are_those_of_the_retimed_piece():
    """Statistics from the aligned samples are those of cutting the piece out and re-timing it."""
    piece = np.linspace([0.0, 0.0], [3.0, 4.0], 21)
    quick = retimed_statistics(piece[None])(2, 6)
    slow = Statistics.of(retime(piece[4:17], 40, 3.0))
    assert np.allclose(quick.G0, slow.G0) and np.allclose(quick.G1, slow.G1)


def test_slow_responses_are_followed_to_the_subgoal():
    """Even a slow system's response comes close to its subgoal before it is joined to it."""
    slow = Statistics(np.eye(2)[None], 0.995 * np.eye(2)[None])
    response = candidate_responses(slow, np.array([[3.0], [4.0]]))[..., 0]
    assert np.linalg.norm(response[:, -2]) < 0.05 * 5 and not response[:, -1].any()


@pytest.mark.parametrize("angle", [0.3, 1.1, 2.9])
@pytest.mark.parametrize("corners", [[[0, 0], [6, 0]], [[0, 0], [4, 0], [4, 4], [0, 4]]])
def test_ties_do_not_hang_on_rounding(corners, angle):
    """On straight parts, where many divisions are as good, moving the lab changes no cut."""
    walk = resample(np.array(corners, float), 120)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    inputs = (search_input([each], 40) for each in (walk, walk @ turn + [3.1, -2.7]))
    np.testing.assert_array_equal(*(best_segments(segment_errors(*each), 6) for each in inputs))


def test_a_candidate_is_judged_by_itself():
    """How closely a response is looked at does not depend on other candidates of its length."""
    rng = np.random.default_rng(0)
    decays = np.array([0.5, 0.9, 0.99, 0.999])
    each = [Statistics(np.eye(2)[None], decay * np.eye(2)[None]) for decay in decays]
    together = Statistics(np.tile(np.eye(2), (4, 1, 1)), decays[:, None, None] * np.eye(2))
    x0 = rng.normal(size=(2, 4))
    alone = [candidate_responses(s, x0[:, k : k + 1]) for k, s in enumerate(each)]
    np.testing.assert_allclose(candidate_responses(together, x0), np.concatenate(alone, axis=2))


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_looking_only_at_what_matters_changes_no_cut(seed, retimed):
    """The fewest cuts, or the refusal, are those from the errors of all segments."""
    rng = np.random.default_rng(seed)
    walks = [
        rng.normal(size=(30, 2)).cumsum(axis=0) + 0.3 * rng.normal(size=(30, 2)) for _ in range(rng.integers(1, 3))
    ]
    tolerance, candidates = np.exp(rng.uniform(-4, 1)), int(rng.integers(5, 40))
    path, statistics = search_input(walks, candidates, retimed)
    found = []
    for search in (fewest_cuts, lambda *each: fewest_segments(segment_errors(*each[:2]), each[2])):
        try:
            found.append(search(path, statistics, tolerance).tolist())
        except ValueError as refusal:
            found.append(str(refusal))
    assert found[0] == found[1]


@pytest.mark.parametrize("seed", range(8))
def test_what_is_refused_one_after_the_other_is_done_without(seed):
    """From what earlier searches knew, the cuts are those of all errors without the segments refused since."""
    rng = np.random.default_rng(seed)
    path, statistics = search_input([rng.normal(size=(40, 2)).cumsum(axis=0)], 30)
    every, known = segment_errors(path, statistics), np.full((30, 30), np.nan)
    for _ in range(6):
        cuts = cuts_within(path, statistics, 1.5, known)
        assert cuts.tolist() == fewest_segments(every, 1.5).tolist()
        k = rng.integers(len(cuts) - 1)
        every[cuts[k], cuts[k + 1]] = known[cuts[k], cuts[k + 1]] = np.inf
