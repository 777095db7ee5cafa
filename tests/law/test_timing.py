"""When a demonstrator was where: pauses are found and kept, and the speed along each segment."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.law.timing import PARTS, Stands, turns_at
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline

PERIOD = 0.1


def walk_with_pause(at=1.5, pause=3.0, length=4.0, speed=0.6, noise=0.0, seed=0):
    """A bent walk (N, 2) of so many m, which stands after `at` m for so many s."""
    step = speed * PERIOD
    s = np.concatenate([np.arange(0, at, step), np.full(round(pause / PERIOD), at), np.arange(at, length, step)])
    walk = np.stack([s, 0.2 * s**2], axis=1)
    return walk + np.random.default_rng(seed).normal(0, noise, walk.shape)


def timed_rms(law, walk):
    """Root mean square distance in m at equal times; who has arrived stays there."""
    timed = law.timed(PERIOD)[1]
    n = np.arange(max(len(timed), len(walk)))
    one, other = (each[np.minimum(n, len(each) - 1)] for each in (timed, walk))
    return np.sqrt(((one - other) ** 2).sum(axis=1).mean())


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("pause", [1.5, 3.0, 20.0])
def test_a_pause_is_found_where_it_was(pause, noise):
    """One stand, as long as it was to 0.3 s, within 5 cm of its place; the rest is the walk."""
    walk = walk_with_pause(pause=pause, noise=noise)
    stands = Stands.of(walk, PERIOD)
    assert stands.seconds == pytest.approx([pause], abs=0.3)
    assert np.linalg.norm(stands.walk[stands.rows[0]] - [1.5, 0.45]) < 0.05
    assert distance_to_polyline(stands.walk, walk).max() < 0.05
    assert len(stands.walk) + np.sum(stands.seconds) / PERIOD == pytest.approx(len(walk))


@pytest.mark.parametrize("noise", [0.02, 0.03])
@pytest.mark.parametrize("pause", [1.5, 5.0, 20.0])
def test_swaying_hides_no_pause(pause, noise):
    """Samples that scatter by 2 or 3 cm along each axis: one stand, to 0.5 s, within 5 cm of its place."""
    for seed in range(5):
        stands = Stands.of(walk_with_pause(pause=pause, noise=noise, seed=seed), PERIOD)
        assert stands.seconds == pytest.approx([pause], abs=0.5)
        assert np.linalg.norm(stands.walk[stands.rows[0]] - [1.5, 0.45]) < 0.05


def test_noise_makes_no_pause_of_a_slow_walk():
    """At 0.3 m/s, with samples that scatter by 3 cm, nobody stands."""
    for seed in range(5):
        walk = walk_with_pause(pause=0.0, speed=0.3, noise=0.03, seed=seed)
        assert not len(Stands.of(walk, PERIOD).rows)


def test_who_brakes_stands_from_when_they_stand():
    """Half a metre of braking and of speeding up at 0.7 m/s^2, and 4 s between: 4 s, to a third of a second."""
    t = np.arange(0, 14, PERIOD)
    braking = 0.8 / 0.7
    begin, end = 4.0, 8.0
    left = np.clip(begin - t, 0, None)
    gone = np.clip(t - end, 0, None)
    way = [0.35 * np.minimum(each, braking) ** 2 + 0.8 * np.maximum(each - braking, 0) for each in (left, gone)]
    walk = np.column_stack([way[1] - way[0], 0 * t]) + np.random.default_rng(0).normal(0, 0.004, (len(t), 2))
    assert Stands.of(walk, PERIOD).seconds == pytest.approx([4.0], abs=0.35)


def test_ends_are_told_from_the_way():
    """2 s before the first step, 3 s on the way, 4 s after the last: the way has one stand, its ends two."""
    walk = walk_with_pause()
    walk = np.vstack([[walk[0]] * 20, walk, [walk[-1]] * 40])
    whole, inner, ends = (Stands.of(walk, PERIOD, which) for which in ("all", "inner", "ends"))
    assert whole.inner.tolist() == [False, True, False]
    assert inner.seconds == pytest.approx([3.0], abs=0.3) and inner.inner.all()
    assert ends.seconds == pytest.approx([2.0, 4.0], abs=0.3) and not ends.inner.any()
    assert np.array_equal(
        inner.of_walk(walk)[~np.isin(np.arange(len(inner.walk)), inner.rows)], np.delete(inner.walk, inner.rows, axis=0)
    )


@pytest.mark.parametrize("length", [4.0, 20.0, 60.0])
def test_the_subgoal_of_a_pause_is_where_it_was(length):
    """However long the walk is, and far apart its candidate cuts are: to 1 cm."""
    for at in (0.31 * length, 0.5 * length, 0.77 * length):
        s = np.concatenate([np.arange(0, at, 0.08), np.full(40, at), np.arange(at, length, 0.08)])
        walk = np.column_stack([s, np.sin(s)])
        law = SequencedLDS.fit(walk)
        subgoal = law.subgoals[np.argmax(law.pauses[1:])]
        assert np.hypot(*(subgoal - [at, np.sin(at)])) < 0.01


@pytest.mark.parametrize("period", [0.02, 0.1, 0.25, 0.3])
def test_the_rule_is_one_of_seconds(period):
    """However often it is sampled, standing for 2 s is a pause and standing for half a second none."""
    for pause, found in ((2.0, 1), (0.5, 0)):
        t = np.arange(0, 4.0 + pause, period)
        x = 0.8 * (np.minimum(t, 2.0) + np.maximum(t - 2.0 - pause, 0))
        stands = Stands.of(np.column_stack([x, 0 * x]), period)
        assert len(stands.rows) == found
        assert stands.seconds == pytest.approx([pause] * found, abs=2 * period + 0.15)


@given(st.integers(0, 999), st.floats(-3, 3))
def test_stands_turn_with_the_lab(seed, angle):
    """Whichever way the lab is turned, the same samples are a stand."""
    walk = walk_with_pause(noise=0.01, seed=seed)
    c, s = np.cos(angle), np.sin(angle)
    here, there = Stands.of(walk, PERIOD), Stands.of(walk @ [[c, s], [-s, c]], PERIOD)
    assert np.array_equal(here.rows, there.rows) and np.array_equal(here.seconds, there.seconds)


def test_a_path_without_times_has_no_pauses():
    """Ten thousand places on a curve, taken for 0.1 s each, are slow and still no stand."""
    angle = np.linspace(0, np.pi, 10_000)
    assert not len(Stands.of(np.stack([np.cos(angle), np.sin(angle)], axis=1), PERIOD).rows)


def test_a_walk_that_is_one_pause_stays_as_it_is():
    """What would be no trajectory without its pauses keeps them."""
    walk = np.vstack([np.zeros((30, 2)), [[0.0, 0.02]]])
    stands = Stands.of(walk, PERIOD)
    assert np.array_equal(stands.walk, walk) and not len(stands.rows)


def test_a_pause_is_a_subgoal_and_part_of_the_task():
    """The law is cut there, holds the seconds, and stands there at the right time."""
    walk = walk_with_pause()
    law = SequencedLDS.fit(walk)
    k = np.argmin(np.hypot(*(law.subgoals - [1.5, 0.45]).T))
    assert np.linalg.norm(law.subgoals[k] - [1.5, 0.45]) < 0.05
    assert law.pauses[k + 1] == pytest.approx(3.0, abs=0.3) and law.corners[k]
    assert law.pauses.sum() == law.pauses[k + 1] and len(law.pauses) == len(law.segments) + 1
    t, positions = law.timed(PERIOD)
    assert np.hypot(*(positions[(t > 2.8) & (t < 5.2)] - [1.5, 0.45]).T).max() < 0.05
    assert timed_rms(law, walk) < 0.04


def test_standing_changes_neither_way_nor_speeds():
    """With and without the pause: the same speeds, and the same response within the tolerance."""
    paused, passed = (SequencedLDS.fit(walk_with_pause(pause=pause)) for pause in (5.0, 0.0))
    assert paused.speeds == pytest.approx(np.full(len(paused.speeds), passed.speeds.mean()), rel=0.25)
    assert distance_to_polyline(paused.response(), passed.response()).mean() < 0.02


def test_pauses_are_pooled_over_the_walks():
    """Those who stand make the mean with those who do not; who stands alone is not followed."""
    pauses = 2.0, 4.0, 0.0
    law = SequencedLDS.fit([walk_with_pause(pause=each) for each in pauses])
    assert law.pauses[1:-1].sum() == pytest.approx(2.0, abs=0.3)
    alone = SequencedLDS.fit([walk_with_pause(pause=each) for each in (0.0, 4.0, 0.0)])
    assert not alone.pauses.any()


def test_pauses_at_both_ends_are_kept():
    """Before the first step and after the last somebody stands: pauses[0] and pauses[-1]."""
    walk = walk_with_pause(pause=0.0)
    law = SequencedLDS.fit(np.vstack([[walk[0]] * 20, walk, [walk[-1]] * 30]))
    assert law.pauses[[0, -1]] == pytest.approx([2.0, 3.0], abs=0.3)
    assert np.allclose(law.start, walk[0], atol=0.05)


def test_the_time_is_right_all_along():
    """Ever faster, and slow again: at equal times the law is where the walk was, to 1 % of 4 m."""
    t = np.arange(0, 12, PERIOD)
    s = 4 * (t / 12 - 0.8 * np.sin(2 * np.pi * t / 12) / (2 * np.pi))
    walk = np.stack([s, 0.5 * np.sin(s)], axis=1)
    law = SequencedLDS.fit(walk, sample_period=PERIOD)
    assert timed_rms(law, walk) < 0.04
    even = SequencedLDS(law.segments, law.start, law.speeds)
    assert timed_rms(even, walk) > 2 * timed_rms(law, walk)
    assert law.timed(PERIOD)[0][-1] == pytest.approx(t[-1], abs=0.3)


def test_a_profile_has_the_parts_of_every_segment(one_lap):
    """Sixteen speeds a segment, all positive, of the mean that `speeds` tells, to a tenth."""
    law = SequencedLDS.fit(one_lap)
    assert law.profile.shape == (len(law.segments), PARTS) and (law.profile > 0).all()
    means = PARTS / (1 / law.profile).sum(axis=1)
    assert means == pytest.approx(law.speeds, rel=0.1)


def test_timing_goes_with_moved_subgoals(one_lap):
    """with_subgoals keeps profile, pauses and corners: twice as far takes twice as long."""
    law = SequencedLDS.fit(one_lap)
    moved = law.with_subgoals(2 * law.subgoals, 2 * law.start)
    for name in ("profile", "pauses", "corners"):
        assert np.array_equal(getattr(moved, name), getattr(law, name))
    assert moved.timed()[0][-1] == pytest.approx(2 * law.timed()[0][-1], rel=0.01)


def test_a_law_without_timing_drives_evenly():
    """As before: three fields, constant speeds and no pause."""
    law = SequencedLDS.fit(np.linspace([0, 0], [3, 0], 60))
    old = SequencedLDS(law.segments, law.start, np.full(len(law.segments), 0.5))
    t, positions = old.timed(0.5)
    assert np.allclose(np.linalg.norm(np.diff(positions[:-1], axis=0), axis=1), 0.25)
    assert t[-1] == pytest.approx(6.0, abs=0.5)


@pytest.mark.parametrize("period", [0, -1.0, np.nan])
def test_bad_periods_are_refused(period):
    """The error names the value and the rule."""
    law = SequencedLDS.fit(np.linspace([0, 0], [3, 0], 60))
    with pytest.raises(ValueError, match="period must be "):
        law.timed(period)


def test_turns_are_those_of_a_corner():
    """A right angle turns by 90 degrees, a circle of 1 m radius by 0.1 rad, an end not at all."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert np.degrees(turns_at(corner, np.array([0.5, 1.0, 2.0]))) == pytest.approx([0, 90, 0])
    angle = np.linspace(0, 2, 2000)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert turns_at(circle, np.array([1.0])) == pytest.approx([0.1], rel=0.01)


def test_a_pause_of_the_clock_is_refused(one_lap):
    """Who stood from 1970 until now did not: at ten times a second that would be 127 GiB."""
    law = SequencedLDS.fit(one_lap)
    stood = replace(law, pauses=np.append(np.zeros(len(law.segments)), 1.7e9))
    with pytest.raises(ValueError, match=r"at most 1000000 periods, got 1.7e\+09 s at a period of 0.1 s"):
        stood.timed()
    with pytest.raises(ValueError, match="at most 1000000 periods"):
        law.timed(1e-6)
