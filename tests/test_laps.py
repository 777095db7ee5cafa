"""Laps: what repeats itself is cut where it does, and what does not is one walk."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import walk_figure_eights

from dollop.laps import DROPPED, cut_laps, laps
from dollop.law.timing import Stands
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
        with pytest.raises(ValueError, match="^t"):
            laps(t, track)


def circle(turns, n=300, radius=1.5):
    """A circle (n, 2) through the origin, counter-clockwise."""
    angle = np.linspace(0, 2 * np.pi * turns, n)
    return radius * np.stack([np.cos(angle) - 1, np.sin(angle)], axis=1)


@pytest.mark.parametrize("rate", [10, 100])
@pytest.mark.parametrize("jitter", [0.0, 0.01])
@pytest.mark.parametrize("seed", range(3))
def test_jitter_costs_no_lap(rate, jitter, seed):
    """Five laps are five when every sample jitters by 10 mm, also at 100 Hz, where that is as long as the way."""
    t, positions = walk_figure_eights(6, seed, period=1 / rate)
    walked = slice(int(0.3 * rate * 16), int(5.4 * len(t) / 6))
    shaken = positions + np.random.default_rng(seed).normal(0, jitter, positions.shape)
    cut = cut_laps(t[walked], shaken[walked])
    assert len(cut.laps) == 5
    assert cut.way == pytest.approx(arc_length(positions[walked][:: rate // 10])[-1], rel=0.15)


def test_laps_are_samples_and_not_smoothed():
    """What jitter does to the way it does not do to the laps: they are samples of the track, and times say which."""
    track = eight(3.5, 3501) + np.random.default_rng(0).normal(0, 0.01, (3501, 2))
    cut = cut_laps(0.01 * np.arange(3501), track)
    samples = np.round(cut.times / 0.01).astype(int)
    for lap, first, last in zip(cut.laps, samples[:-1], samples[1:], strict=True):
        np.testing.assert_allclose(lap, track[first : last + 1])


@pytest.mark.parametrize("turns", [1.0, 1.25, 1.5, 1.9])
@pytest.mark.parametrize("shape", [eight, circle])
def test_less_than_two_laps_are_one_walk(shape, turns):
    """One lap and a half are kept whole: nothing is dropped, and nothing is in doubt."""
    track = shape(turns, 400)
    cut = cut_laps(np.arange(400), track)
    np.testing.assert_allclose(*cut.laps, track)
    assert cut.dropped == 0 and not any(note.doubt for note in cut.notes)


@pytest.mark.parametrize("turns", [2.5, 3.4, 5.7])
def test_what_is_dropped_is_told(turns):
    """Ways before, in and after the laps add up to the whole, and a note says so beyond a tenth."""
    cut = cut_laps(np.arange(1000), eight(turns, 1000))
    kept = sum(arc_length(lap)[-1] for lap in cut.laps)
    assert len(cut.laps) == int(turns)
    assert cut.before + kept + cut.after == pytest.approx(cut.way, rel=0.01)
    assert cut.dropped == pytest.approx(1 - int(turns) / turns, abs=0.02)
    (note,) = cut.notes
    numbers = f"{cut.dropped:.0%}", f"{cut.before:.1f} m before", f"{cut.after:.1f} m after", f"{DROPPED:.0%}"
    assert note.kind == "laps" and note.doubt and all(number in note.text for number in numbers)


def test_good_laps_have_no_notes():
    """Five laps and hardly more leave nothing to tell."""
    assert cut_laps(np.arange(1000), eight(5.1, 1000)).notes == ()


def spiral(turns, pitch):
    """A spiral (600, 2) from 0.5 m outwards."""
    angle = np.linspace(0, 2 * np.pi * turns, 600)
    return ((0.5 + pitch * angle / (2 * np.pi)) * np.stack([np.cos(angle), np.sin(angle)])).T


def slalom(side):
    """Once along a slalom (160, 2) of 6 m, and back beside it; the first cone is passed on a side, 1 or -1."""
    there, back = np.linspace(-3, 3, 100), np.linspace(3, -3, 60)
    along = np.stack([there, 0.5 * side * np.sin(np.pi * there / 3)], axis=1)
    return np.vstack([along, np.stack([back, np.full(60, -1.6)], axis=1)])


UNLIKE = {
    "cones passed on the other side": np.vstack([slalom(1), slalom(1), slalom(-1), slalom(-1)]),
    "two circles": np.vstack([circle(1), circle(1, radius=2.0)]),
    "circles left, then right": np.vstack([circle(2), -circle(2)]),
    "circles, then figure-eights": np.vstack([circle(2, radius=2.0), eight(2, 600)]),
    "there and back again": np.vstack([circle(3), circle(3)[::-1]]),
    "spiral": spiral(4, 0.5),
    "narrow spiral": spiral(8, 0.15),
}


@pytest.mark.parametrize("track", UNLIKE.values(), ids=UNLIKE)
def test_other_tasks_are_no_laps(track):
    """Two tasks one after the other, and the turns of a spiral, are one walk, of which nothing is dropped."""
    cut = cut_laps(np.arange(len(track)), track + np.random.default_rng(1).normal(0, 0.005, track.shape))
    assert len(cut.laps) == 1 and len(cut.laps[0]) == len(track)
    assert cut.dropped == 0 and not any(note.doubt for note in cut.notes)


def test_a_walk_kept_whole_says_why():
    """Laps that lie apart are named with their distance and the rule."""
    (note,) = cut_laps(np.arange(640), UNLIKE["cones passed on the other side"]).notes
    assert note.kind == "laps" and not note.doubt
    assert "kept whole" in note.text and "apart" in note.text and "12%" in note.text


@pytest.mark.parametrize("pause", [100, 1000])
def test_standing_within_a_lap_opens_and_costs_none(pause):
    """Who stands still, jittering, in the midst of a lap has walked as many laps."""
    track, rng = eight(3.3, 1000), np.random.default_rng(3)
    stood = np.vstack([track[:450], np.repeat(track[450:451], pause, axis=0), track[450:]])
    cut = cut_laps(np.arange(len(stood)), stood + rng.normal(0, 0.01, stood.shape))
    assert len(cut.laps) == 3
    assert cut.way == pytest.approx(arc_length(track)[-1], rel=0.15)


@settings(max_examples=20)
@given(st.floats(1e-3, 1e3))
def test_laps_have_no_unit(scale):
    """The same walk in other units has the same laps."""
    assert len(laps(np.arange(500), scale * eight(3.4, 500))) == 3


@pytest.mark.parametrize("n", [3, 4, 7, 20])
def test_a_short_track_is_one_walk(n):
    """Three samples are enough to be a walk, and too few to repeat it."""
    cut = cut_laps(np.arange(n), eight(0.9, n))
    assert len(cut.laps) == 1 and len(cut.laps[0]) == n


@pytest.mark.parametrize("turns", [100, 400])
def test_a_long_walk_keeps_all_its_laps(turns):
    """A hundred laps are a hundred: the length of a lap is found however small a share of the walk it is."""
    for more in (0.2, 0.5):
        assert len(laps(np.arange(20001), eight(turns + more, 20001))) == turns


def test_a_clock_of_gaps_is_refused():
    """Times that leave most of the walk to be filled in are refused, as are those that are no numbers."""
    track, clock = eight(2, 50), np.arange(50.0)
    with pytest.raises(ValueError, match="t must not consist of gaps, got 50 times for 1e\\+09 s"):
        laps(np.append(clock[:-1], 1e9), track)
    with pytest.raises(ValueError, match="^t"):
        laps(np.append(clock[:-1], np.inf), track)


def stood_in_laps(place, n=4, seconds=6.0):
    """Times and positions of n figure-eights of 200 samples each, which stand at a place of every lap but the first."""
    track = eight(n, 200 * n)
    rows = [row for row in range(place, 200 * n, 200) if row]
    repeats = np.ones(len(track), int)
    repeats[rows] = round(seconds / 0.1)
    walk = np.repeat(track, repeats, axis=0)
    return 0.1 * np.arange(len(walk)), walk + np.random.default_rng(0).normal(0, 0.005, walk.shape)


@pytest.mark.parametrize("place", [30, 77, 120, 170])
def test_a_pause_in_every_lap_is_within_the_laps(place):
    """Wherever it is, no lap begins there: each stands once, on its way."""
    cut = cut_laps(*stood_in_laps(place))
    assert len(cut.laps) >= 3 and cut.stood == 0 and not [note for note in cut.notes if "stands" in note.text]
    assert [Stands.of(lap, 0.1, "inner").seconds.round() for lap in cut.laps] == [[6.0]] * len(cut.laps)


def test_a_pause_where_all_laps_begin_is_told():
    """Who stands only where every full lap begins stands between laps: a note tells how long, and doubts nothing."""
    cut = cut_laps(*stood_in_laps(0))
    assert len(cut.laps) == 4 and cut.stood == pytest.approx(6.0, abs=0.3)
    [note] = cut.notes
    assert note.kind == "laps" and "stands for" in note.text and not note.doubt
