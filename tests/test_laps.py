"""Laps: what repeats itself is cut where it does, and what does not is one walk."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import walk_figure_eights

from dollop.laps import laps
from dollop.trajectory import arc_length


def eight(turns, n):
    """Exact figure-eights (n, 2)."""
    angle = np.linspace(0, 2 * np.pi * turns, n)
    return np.stack([2 * np.sin(angle), np.sin(2 * angle)], axis=1)


@pytest.mark.parametrize("n_laps", [2, 3, 5, 7])
@pytest.mark.parametrize("seed", range(3))
def test_laps_of_a_walked_figure_eight(n_laps, seed):
    """As many laps are cut as were walked, all as long, though each passes the crossing twice."""
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
    starts = np.array([lap[0] for lap in found])
    ahead = np.array([lap[3] - lap[0] for lap in found])
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
    t = np.arange(400)
    assert len(laps(t, track @ turn.T + [x, y])) == len(laps(t, track)) == 3


def test_a_clock_that_runs_backwards():
    """Laps need increasing times, one per position; one step back or a pause is refused."""
    track, once = eight(2, 50), np.arange(50) == 20
    clock = np.arange(50)
    for t in (clock[::-1], np.zeros(50), clock[:-1], clock - once, clock - 1.3 * once):
        with pytest.raises(ValueError, match="t must increase"):
            laps(t, track)


def test_a_clock_that_jumps_by_years_is_refused():
    """Nothing is laid out per second of a time in which nobody was seen."""
    t = np.arange(200) / 10 + 1e9 * (np.arange(200) >= 100)
    with pytest.raises(ValueError, match=r"t must not jump, got 1e\+09 s for 200 positions, most of them 0.1 s apart"):
        laps(t, eight(3, 200))
