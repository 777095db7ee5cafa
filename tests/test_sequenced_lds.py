"""Sequenced LDS: the tolerance, several laps, responses, moved subgoals."""

import itertools
import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import any_walk, moving, walk_figure_eights

from dollop.laps import laps
from dollop.law.timing import turns_at
from dollop.lds import LDS, Statistics
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import arc_length, distance_to_polyline, mean_trajectory, resample


@pytest.fixture(scope="module")
def law(one_lap):
    """The sequenced LDS of one lap with the default tolerance."""
    return SequencedLDS.fit(one_lap)


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
    """With as many segments the re-timed fit is at least 1.5 times nearer to the walk."""
    for k in (5, 6, 7):
        fits = (SequencedLDS.fit(one_lap, n_segments=k, retimed=r) for r in (True, False))
        retimed, raw = (law.error(one_lap) for law in fits)
        assert 1.5 * retimed < raw


def test_more_tolerance_never_needs_more_segments(one_lap):
    """The number of segments falls with the tolerance."""
    tolerances = (0.006, 0.01, 0.02, 0.05, 0.1, 1)
    laws = [SequencedLDS.fit(one_lap, each, candidates=60) for each in tolerances]
    numbers = [len(law.segments) for law in laws]
    assert numbers == sorted(numbers, reverse=True) and numbers[-1] < 5 < numbers[0]


def test_number_of_segments_is_obeyed(one_lap):
    """n_segments fixes the number, raw and re-timed."""
    for k, retimed in itertools.product((1, 3, 8), (True, False)):
        law = SequencedLDS.fit(one_lap, n_segments=k, retimed=retimed, candidates=40)
        assert len(law.segments) == k


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
    """A joint fit has its subgoals amid the laps, and is nearer to their mean than any lap is."""
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
    assert slow.speeds[0] == pytest.approx(1.0, rel=0.02)
    assert slow.speeds[-1] == pytest.approx(0.5, rel=0.02)
    assert np.allclose(fast.speeds, 2 * slow.speeds)


@settings(max_examples=60)
@given(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), st.sampled_from([0.3, 0.05, 0.01, 1e-4]))
def test_response_arrives_from_anywhere(law, start, reach):
    """Kidnapped anywhere, the response passes every subgoal in order and ends at the last."""
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
    """The errors are the mean and the largest distance, and the mean the other way round."""
    errors, there = law.errors(one_lap), distance_to_polyline(one_lap, law.response())
    assert errors["mean"] == law.error(one_lap) == pytest.approx(there.mean())
    assert errors["max"] == pytest.approx(there.max())
    assert 0 < errors["reverse"] < 0.02


def test_moved_subgoals_move_the_response(law):
    """Shifting or scaling subgoals and start does so to the response; matrices stay the same."""
    moved = law.with_subgoals(2 * law.subgoals + [5, 5], start=2 * law.start + [5, 5])
    assert np.allclose(moved.response(reach=0.02), 2 * law.response(reach=0.01) + [5, 5])
    assert all((a.A == b.A).all() for a, b in zip(law.segments, moved.segments, strict=True))


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
    """Of all handwritten samples of a letter the mean is drawn within 1 % of its diagonal."""
    file = Path(os.environ["DOLLOP_EXTERNAL_DATA"], "letters", f"{letter}.mat")
    demos = [demo["pos"][0, 0].T.astype(float) for demo in scipy.io.loadmat(file)["demos"][0]]
    diagonal = np.linalg.norm(np.ptp(np.concatenate(demos), axis=0))
    walks = [demo / diagonal for demo in demos]
    law = SequencedLDS.fit(walks, tolerance=0.01)
    assert 2 <= len(law.segments) <= 4
    assert law.error(mean_trajectory(walks)) < 0.01


# Headings


def test_headings_are_those_of_the_walk():
    """On a circle, to 5 degrees: ahead at the start, and along it at every subgoal."""
    turn = np.linspace(0, 1.5 * np.pi, 200)
    law = SequencedLDS.fit(2 * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    places = np.vstack([law.start, law.subgoals])
    along = np.arctan2(places[:, 1], places[:, 0]) + np.pi / 2
    assert law.headings.shape == (len(law.segments) + 1,)
    assert np.abs(np.exp(1j * law.headings) - np.exp(1j * along)).max() < np.radians(5)
    assert (law.headings > -np.pi).all() and (law.headings <= np.pi).all()


@settings(max_examples=20)
@given(st.floats(-10, 10))
def test_headings_turn_with_the_lab(law, angle):
    """And stay in (-pi, pi]; straight back is pi."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    moved = law.with_subgoals(law.subgoals @ turn.T, turn @ law.start, turned=True)
    away = np.exp(1j * (moved.headings - law.headings - angle))
    assert np.abs(np.angle(away)).max() < 1e-3
    assert (moved.headings > -np.pi).all() and (moved.headings <= np.pi).all()
    back = SequencedLDS.fit(np.linspace([3.0, 0.0], [0.0, 0.0], 40))
    assert back.headings.tolist() == pytest.approx([np.pi, np.pi])


def test_a_segment_that_leads_nowhere_keeps_the_heading():
    """A subgoal where the one before is: whoever is there has come as before."""
    straight = SequencedLDS.fit(np.linspace([0.0, 0.0], [0.0, 3.0], 40))
    twice = SequencedLDS(straight.segments * 2, straight.start, np.ones(2))
    assert twice.headings == pytest.approx(np.full(3, np.pi / 2))


# Bad input


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"tolerance": 0}, "tolerance must be in 1e-06 to 1e.09, got 0"),
        ({"tolerance": np.nan}, "tolerance must be a finite number .*, got nan"),
        ({"n_segments": 0}, "n_segments must be a whole number, 1 to 49, got 0"),
        ({"n_segments": 50}, "n_segments must be a whole number, 1 to 49, got 50"),
        ({"n_segments": 2.5}, "n_segments must be a whole number"),
        ({"n_segments": np.nan}, "n_segments must be a whole number.*got nan"),
        ({"candidates": 10**6}, "candidates must be a whole number, 3 to 400, got 1000000"),
        ({"sample_period": -0.1}, "sample_period must be in 1e-06 to 1e.06, got -0.1"),
        ({"candidates": 2}, "candidates must be a whole number, 3 to 400, got 2"),
        ({"tolerance": 1e-6}, r"tolerance 1e-06 m cannot be kept with 100 candidate cuts, 0\.\d+ "),
    ],
)
def test_bad_parameters(one_lap, options, says):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=says):
        SequencedLDS.fit(one_lap, **options)


@pytest.mark.parametrize("others", [0, 3])
def test_walks_of_another_way_are_never_averaged(five_laps, others):
    """A walk backwards is named, with how far it is away and what to do, whether or not it is outnumbered."""
    walks = [*five_laps[:others], five_laps[3], five_laps[4][::-1]]
    with pytest.raises(
        ValueError,
        match=rf"got trajectory {others + 1} .* m away from .*dollop.learn keeps ways apart",
    ):
        SequencedLDS.fit(walks)


def test_the_tolerance_that_can_be_kept_is_kept(one_lap):
    """The tolerance named in the error does work, and nothing below it."""
    with pytest.raises(ValueError) as refusal:
        SequencedLDS.fit(one_lap, tolerance=1e-6, candidates=50)
    least = float(str(refusal.value).split("cuts, ")[1].split(" m can")[0])
    SequencedLDS.fit(one_lap, tolerance=1.01 * least, candidates=50)
    with pytest.raises(ValueError, match="cannot be kept"):
        SequencedLDS.fit(one_lap, tolerance=0.98 * least, candidates=50)


@pytest.mark.parametrize("seed", [3, 22])
def test_a_division_that_never_ends_keeps_the_tolerance_and_is_always_the_same(seed):
    """Loops of decimetres turn too far at a hand-over, whatever the cuts; the law is within the tolerance."""
    smooth = np.hanning(23)[1:-1] / np.hanning(23).sum()
    steps = np.random.default_rng(seed).normal(size=(2, 160))
    velocity = np.stack([np.convolve(each, smooth, "same") for each in steps], axis=1)
    walk = (0.06 * velocity / np.linalg.norm(velocity, axis=1).mean()).cumsum(axis=0)
    one, other = (SequencedLDS.fit(walk) for _ in range(2))
    ends = np.cumsum([line.way[-1] for line in one.lines()])
    turns = turns_at(np.vstack([line.places for line in one.lines()]), ends)
    assert np.degrees(turns[~one.corners].max()) > 45  # who turns so far where he walks has a corner
    assert np.array_equal(one.response(), other.response())
    assert one.error(resample(walk, 100)) <= 0.02


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
    """Wrong numbers of subgoals, a start that is no position and no reach are refused."""
    with pytest.raises(ValueError, match=rf"subgoals must have shape \({len(law.segments)}, 2\)"):
        law.with_subgoals(law.subgoals[:-1])
    with pytest.raises(ValueError, match="start must be finite"):
        law.response([np.nan, 0])
    with pytest.raises(ValueError, match="reach must be in 1e-06 to 1e.09, got 0"):
        law.response(reach=0)


@settings(max_examples=40)
@given(any_walk, st.integers(1, 3), st.booleans())
def test_any_walk_can_be_fitted(walk, count, retimed):
    """However wild a walk, alone or repeated, stable segments lead from its mean start to its mean end."""
    moving([walk])
    walks = [walk[0] + (1 + 0.03 * k) * (walk - walk[0]) for k in range(count)]
    law = SequencedLDS.fit(walks, n_segments=2, retimed=retimed, candidates=12)
    assert np.allclose(law.start, np.mean([walk[0] for walk in walks], axis=0))
    assert np.allclose(law.subgoals[-1], np.mean([walk[-1] for walk in walks], axis=0))
    assert np.linalg.norm(law.response()[-1] - law.subgoals[-1]) <= 0.01
    fastest = max(np.diff(arc_length(walk)).max() for walk in walks) / 0.1
    assert (law.speeds >= 0).all() and (law.speeds <= fastest * (1 + 1e-9)).all()


@pytest.mark.parametrize("method", ["held", "paper"])
def test_a_response_that_takes_too_long_is_refused(method):
    """An LDS that keeps all but a billionth of its offset would need ten thousand million steps."""
    slow = LDS(Statistics(np.eye(2), (1 - 1e-9) * np.eye(2)), np.zeros(2))
    law = SequencedLDS((slow,), np.array([3.0, 1.0]), np.ones(1))
    with pytest.raises(ValueError, match="must come within 0.01 m of its subgoal in 100000 steps"):
        law.response(method=method)


def test_a_subgoal_beyond_all_precision_is_refused(law):
    """At 1e17 m neighbouring numbers are 16 m apart: no robot drives there."""
    with pytest.raises(ValueError, match=r"subgoals must lie within 1e\+09 m of the origin, got 1e\+17 m"):
        law.with_subgoals(law.subgoals + [1e17, 0.0])


@pytest.mark.parametrize("goal", [1e6, -0.9e9])
def test_as_far_as_places_may_be_every_response_arrives(law, goal):
    """Nine hundred million metres off, to a tenth of a millimetre; a micrometre is eight steps of such numbers."""
    far = law.with_subgoals(law.subgoals + goal)
    for method in ("held", "paper"):
        end = far.response(reach=1e-4, method=method)[-1]
        assert np.linalg.norm(end - far.subgoals[-1]) <= 1e-4
