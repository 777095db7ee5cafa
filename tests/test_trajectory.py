"""Trajectories: arc length, re-timing, alignment, laps, distances, and what is no trajectory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import walk_figure_eights

from dollop.trajectory import (
    align,
    arc_length,
    check_trajectories,
    check_trajectory,
    distance_to_polyline,
    laps,
    mean_trajectory,
    monotone_warp,
    resample,
    retime,
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

    plain = [min(to_edge(point, a, b) for a, b in zip(polyline[:-1], polyline[1:], strict=True)) for point in points]
    assert np.allclose(distance_to_polyline(points, polyline), plain)


def test_distance_to_a_single_point():
    """A polyline of one vertex is a point."""
    assert distance_to_polyline([[3.0, 4.0]], [[0.0, 0.0]]) == pytest.approx(5)


def test_warp_is_the_best_of_all_monotone_ones():
    """On a tiny case the warp costs as little as the best of all enumerated ones."""
    rng = np.random.default_rng(1)
    n = 5
    reference, walk = rng.normal(size=(n, 2)), rng.normal(size=(2 * n - 1, 2))
    step = np.linalg.norm(np.diff(walk, axis=0), axis=1).mean()

    def cost(at):
        apart = ((walk[at[1:]] - reference[1:]) ** 2).sum()
        return apart + (step**2 * (np.diff(at) - 2.0) ** 2).sum()

    every = [np.cumsum([0, *moves]) for moves in np.ndindex(*(5,) * (n - 1)) if sum(moves) == 2 * n - 2]
    found = np.round(monotone_warp(reference, walk[None])[0] * (2 * n - 2)).astype(int)
    assert cost(found) == pytest.approx(min(map(cost, every)))


def test_alignment_undoes_uneven_detours():
    """Walks that differ in where they swing wide are brought much closer than by equal shares of arc length."""
    _, track = walk_figure_eights(5, seed=3, drift=0.12)
    walks = [track[start : start + 170] for start in range(0, 680, 170)]
    apart = [
        np.linalg.norm(each - each.mean(axis=0), axis=2).mean() for each in (align(walks, 199, r)[0] for r in (0, 3))
    ]
    assert apart[1] < 0.75 * apart[0]


def test_alignment_keeps_ends_and_order():
    """Every walk is sampled from its start to its end and never backwards."""
    walks = [walk_figure_eights(1, seed)[1] for seed in range(3)]
    aligned, share = align(walks, 100)
    assert np.allclose(aligned[:, 0], [walk[0] for walk in walks]) and np.allclose(share[:, [0, -1]], [0, 1])
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


@pytest.mark.parametrize("n_laps", [2, 3, 5, 7])
@pytest.mark.parametrize("seed", range(3))
def test_laps_of_a_walked_figure_eight(n_laps, seed):
    """As many laps are cut as were walked, each about as long as one, although the crossing is passed twice in each."""
    t, positions = walk_figure_eights(n_laps + 1, seed)
    one = len(t) / (n_laps + 1)
    walked = slice(int(0.3 * one), int((n_laps + 0.5) * one))
    found = laps(t[walked], positions[walked])
    lengths = np.array([arc_length(lap)[-1] for lap in found])
    assert len(found) == n_laps
    assert np.ptp(lengths) < 0.1 * lengths.mean()


@pytest.mark.parametrize("seed", range(5))
def test_ways_to_and_from_the_laps_are_dropped(seed):
    """Walking in from a door and back to it adds no lap and lengthens none."""
    t, positions = walk_figure_eights(4, seed)
    walked = positions[20 : int(len(t) * 3.5 / 4)]
    door = np.array([-4.0, -3.0])
    there, back = np.linspace(door, walked[0], 30)[:-1], np.linspace(walked[-1], door, 30)[1:]
    track = np.concatenate([there, walked, back])
    found = laps(0.1 * np.arange(len(track)), track)
    assert len(found) == 3
    assert max(np.linalg.norm(lap - door, axis=1).min() for lap in found) > 1.5
    assert np.ptp([arc_length(lap)[-1] for lap in found]) < 1.5


def test_exactly_five_laps_are_five():
    """A track that starts and ends on the gate loses no lap."""
    assert len(laps(np.arange(1001.0), eight(5, 1001))) == 5


def test_laps_start_together_and_head_the_same_way():
    """Laps of a figure-eight start at one place in one direction."""
    found = laps(*walk_figure_eights(6, seed=8))
    starts, ahead = np.array([lap[0] for lap in found]), np.array([lap[3] - lap[0] for lap in found])
    assert np.linalg.norm(starts - starts.mean(axis=0), axis=1).max() < 0.35
    assert ((ahead @ ahead.mean(axis=0)) > 0).all()


def test_standing_before_walking_is_no_lap():
    """Noise of a user who stands first opens no gate."""
    rng = np.random.default_rng(0)
    track = np.concatenate([rng.normal(0, 0.02, (100, 2)), eight(3.5, 1001)])
    assert [len(lap) for lap in laps(np.arange(1101.0), track)] == pytest.approx([287] * 3, abs=2)


@pytest.mark.parametrize(
    "track",
    [
        np.linspace([0, 0], [5, 1], 80),
        eight(1, 150),
        eight(0.5, 80),
        np.random.default_rng(4).normal(size=(90, 2)).cumsum(0),
    ],
    ids=["line", "one lap", "half a lap", "random walk"],
)
def test_no_repetition_is_one_lap(track):
    """A track that does not repeat itself is returned whole."""
    (only,) = laps(np.arange(len(track)), track)
    assert np.allclose(only, track)


def test_laps_have_an_even_clock():
    """Dropped scans are filled in, so that every lap is sampled at the median period."""
    t, positions = walk_figure_eights(4, seed=2)
    keep = np.random.default_rng(0).random(len(t)) > 0.2
    whole, gappy = laps(t, positions), laps(t[keep], positions[keep])
    assert [len(lap) for lap in gappy] == pytest.approx([len(lap) for lap in whole], rel=0.05)


@settings(max_examples=20)
@given(st.floats(-5, 5), st.floats(-50, 50), st.floats(-50, 50))
def test_laps_do_not_depend_on_where_the_lab_lies(angle, x, y):
    """Turning and shifting the track turns and shifts its laps."""
    track = eight(3.4, 400)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert len(laps(np.arange(400), track @ turn.T + [x, y])) == len(laps(np.arange(400), track)) == 3


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        ([[0, 0], [1, 1]], "at least three points, got 2"),
        ([[1, 2]] * 4, "must move"),
        ([[0, 0], [1, np.nan], [2, 0]], "finite.*sample 1"),
        ([[0, 0], [np.inf, 0], [2, 0]], "finite.*sample 1"),
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


def test_a_clock_that_runs_backwards():
    """Laps need increasing times, one for each position."""
    track = eight(2, 50)
    for t in (np.arange(50)[::-1], np.zeros(50), np.arange(49)):
        with pytest.raises(ValueError, match="t must increase"):
            laps(t, track)
