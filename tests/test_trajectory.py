"""Trajectories: arc length, re-timing, alignment, distances, and what is no trajectory."""

import itertools

import numpy as np
import pytest
from walks import walk_figure_eights

from dollop.trajectory import (
    _monotone_warp,
    align,
    arc_length,
    at_arc_length,
    check_one_way,
    check_trajectories,
    check_trajectory,
    distance_to_polyline,
    mean_trajectory,
    resample,
    retime,
    ways_apart,
)


def eight(turns, n):
    """Exact figure-eights (n, 2)."""
    angle = np.linspace(0, 2 * np.pi * turns, n)
    return np.stack([2 * np.sin(angle), np.sin(2 * angle)], axis=1)


def test_resampling_keeps_curve_and_spacing():
    """Samples of a resampled circle lie at equal distances on the circle."""
    angle = np.linspace(0, 3, 500) ** 2 / 9 * 2 * np.pi
    points = resample(np.stack([np.cos(angle), np.sin(angle)], axis=1), 50)
    assert np.allclose(np.linalg.norm(points, axis=1), 1, atol=1e-3)
    assert np.ptp(np.linalg.norm(np.diff(points, axis=0), axis=1)) < 1e-4


def test_resampling_passes_over_standing_still():
    """Repeated positions have no length and change nothing."""
    walk = eight(1, 60)
    assert np.allclose(resample(np.repeat(walk, 3, axis=0), 40), resample(walk, 40))


def test_retiming_leaves_the_stated_way_to_go():
    """After j of n steps L exp(-c j / n) remains, and nothing after the last."""
    points = retime(np.array([[0.0, 0.0], [3.0, 0.0], [10.0, 0.0]]), 20, 3.0)
    assert np.allclose(10 - points[:-1, 0], 10 * np.exp(-3 * np.arange(20) / 20))
    assert points[-1, 0] == 10


def test_distance_to_polyline_agrees_with_a_plain_loop():
    """Distances equal the least over the edges, one by one, zero-length edges included."""
    rng = np.random.default_rng(0)
    points, polyline = rng.normal(size=(30, 2)), rng.normal(size=(9, 2))
    polyline[4] = polyline[3]

    def to_edge(point, a, b):
        share = np.clip((point - a) @ (b - a) / max((b - a) @ (b - a), 1e-300), 0, 1)
        return np.linalg.norm(point - a - share * (b - a))

    edges = list(itertools.pairwise(polyline))
    plain = [min(to_edge(point, *edge) for edge in edges) for point in points]
    assert np.allclose(distance_to_polyline(points, polyline), plain)


@pytest.mark.parametrize("smooth", [True, False])
def test_many_distances_are_those_of_one_point_at_a_time(smooth):
    """What is divided because it is much is as exact as what is not, for walks and for scattered points."""
    points, polyline = np.random.default_rng(4).normal(size=(2, 500, 2))
    if smooth:
        points, polyline = points.cumsum(axis=0), polyline.cumsum(axis=0)
    alone = [distance_to_polyline(point[None], polyline)[0] for point in points]
    assert distance_to_polyline(points, polyline).tolist() == alone


def test_distance_to_a_single_point():
    """A polyline of one vertex is a point."""
    assert distance_to_polyline([[3.0, 4.0]], [[0.0, 0.0]]) == pytest.approx(5)


@pytest.mark.parametrize("seed", range(1, 6))
def test_warp_is_the_best_of_all_monotone_ones(seed):
    """On a tiny case the warp costs as little as the best of all enumerated ones."""
    rng = np.random.default_rng(seed)
    n = 5
    reference, walk = rng.normal(size=(n, 2)), rng.normal(size=(2 * n - 1, 2))
    step = np.linalg.norm(np.diff(walk, axis=0), axis=1).mean()

    def cost(at):
        apart = ((walk[at[1:]] - reference[1:]) ** 2).sum()
        return apart + (step**2 * (np.diff(at) - 2.0) ** 2).sum()

    whole = (moves for moves in np.ndindex(*(5,) * (n - 1)) if sum(moves) == 2 * n - 2)
    every = [np.cumsum([0, *moves]) for moves in whole]
    found = np.round(_monotone_warp(reference, walk[None])[0] * (2 * n - 2)).astype(int)
    assert cost(found) == pytest.approx(min(map(cost, every)))


def test_alignment_undoes_uneven_detours():
    """Walks that swing wide at different places come much closer than by equal shares of length."""
    _, track = walk_figure_eights(5, seed=3, drift=0.12)
    walks = [track[start : start + 170] for start in range(0, 680, 170)]
    equal_shares = np.stack([resample(walk, 199) for walk in walks])
    ways = equal_shares, align(walks, 199)[0]
    apart = [np.linalg.norm(each - each.mean(axis=0), axis=2).mean() for each in ways]
    assert apart[1] < 0.75 * apart[0]


def test_alignment_keeps_ends_and_order():
    """Every walk is sampled from its start to its end and never backwards."""
    walks = [walk_figure_eights(1, seed)[1] for seed in range(3)]
    aligned, share = align(walks, 100)
    assert np.allclose(aligned[:, 0], [walk[0] for walk in walks])
    assert np.allclose(share[:, [0, -1]], [0, 1])
    assert (np.diff(share, axis=1) >= 0).all()


def test_mean_of_mirrored_walks_is_the_line_between():
    """Two walks that mirror each other have the mirror as their mean."""
    walk = np.stack([np.linspace(0, 4, 80), np.sin(np.linspace(0, np.pi, 80))], axis=1)
    mean = mean_trajectory([walk, walk * [1, -1]])
    assert np.allclose(mean[:, 1], 0, atol=1e-12) and np.allclose(mean[[0, -1], 0], [0, 4])


def test_mean_of_one_walk_is_the_walk():
    """The mean of a single trajectory is its resampling."""
    walk = eight(1, 100)
    assert np.allclose(mean_trajectory(walk, 50), resample(resample(walk, 50), 50))


def mirrored(walk):
    """The walk on the other side of the line along which it reaches farthest."""
    along = np.linalg.svd(walk - walk.mean(axis=0))[2][0]
    offset = walk - walk[0]
    return walk[0] + 2 * np.outer(offset @ along, along) - offset


def truncated(walk, share=0.7):
    """The first part of the walk."""
    return at_arc_length(walk, np.linspace(0, share * arc_length(walk)[-1], len(walk)))


def with_detour(walk, aside=1.5):
    """The walk with a bulge to one side, about as long as it is wide."""
    way, step = arc_length(walk), np.gradient(walk[len(walk) // 2 :], axis=0)[0]
    bulge = np.exp(-(((way - way[len(walk) // 2]) / (aside / 2)) ** 2))
    return walk + aside * np.outer(bulge, np.array([-step[1], step[0]]) / np.linalg.norm(step))


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("seed", range(4))
def test_laps_of_one_way_are_one_way(seed, count):
    """Laps that sway, at offsets of 10 cm, are of one way."""
    rng = np.random.default_rng(seed)
    walks = [walk_figure_eights(1, seed=100 * seed + k)[1] + rng.normal(0, 0.1, 2) for k in range(count)]
    way, allowed, apart = ways_apart(walks)
    assert not way.any() and 0 < apart.max() < 2 * allowed


@pytest.mark.parametrize("others", [1, 2, 4])
@pytest.mark.parametrize("changed", [mirrored, truncated, with_detour, lambda walk: walk[::-1]])
def test_what_is_not_the_same_way_is_told(changed, others):
    """A mirrored, truncated or reversed walk and one with a detour are of another way, even among two walks."""
    walks = [walk_figure_eights(1, seed)[1][:70] for seed in range(others + 1)]
    walks[-1] = changed(walks[-1])
    assert ways_apart(walks)[0].tolist() == [0] * others + [1]
    with pytest.raises(ValueError, match=rf"got trajectory {others} .* m away from traject"):
        check_one_way(walks, align(walks)[0])


def test_ways_are_told_apart_in_any_order():
    """Way 0 is the commonest; where a walk stands in the list plays no part."""
    walks = [walk_figure_eights(1, seed)[1] for seed in range(5)]
    walks[1], walks[3] = walks[1][::-1], walks[3][::-1]
    assert ways_apart(walks)[0].tolist() == [0, 1, 0, 1, 0]
    assert ways_apart(walks[1:] + walks[:1])[0].tolist() == [1, 0, 1, 0, 0]


def test_one_walk_and_copies_are_one_way():
    """There is nothing to tell apart in one walk, nor in a walk and its copies."""
    walk = walk_figure_eights(1, 0)[1]
    for walks in ([walk], [walk] * 4):
        check_one_way(walks, align(walks)[0])


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ([[0, 0], [1, 1]], "at least three points, got 2"),
        ([[1, 2]] * 4, "must move"),
        ([[0, 0], [1, np.nan], [2, 0]], "finite.*row 1"),
        ([[0, 0], [np.inf, 0], [2, 0]], "finite.*row 1"),
        ([[0, 0, 0]] * 4, r"shape \(N, 2\)"),
        ([1, 2, 3], r"shape \(N, 2\)"),
    ],
)
def test_what_is_no_trajectory(bad, says):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=says):
        check_trajectory(bad)


def test_the_bad_one_of_several_is_named():
    """Of several trajectories the error says which; none at all is an error too."""
    with pytest.raises(ValueError, match="trajectory 1 must have at least three"):
        check_trajectories([[[0, 0], [1, 0], [2, 0]], [[0, 0], [1, 0]]])
    with pytest.raises(ValueError, match="at least one"):
        check_trajectories([])
