"""What is forgiven of scans: few broken ones, few out of order."""

import gzip
import os
import warnings
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.formats.files import FormatError
from dollop.formats.scans import Beams, Scan, _usable_clock, forgive, longest_rise, no_return_from, usable_scans


@given(st.lists(st.integers(0, 5), max_size=8))
def test_longest_rise_is_as_long_as_brute_force(values):
    """The chosen values increase, and no longer choice does."""
    chosen = longest_rise(values)
    picked = [values[i] for i in chosen]
    assert all(a < b for a, b in zip(picked, picked[1:], strict=False))
    rises = (
        len(c)
        for n in range(len(values) + 1)
        for c in combinations(values, n)
        if all(a < b for a, b in zip(c, c[1:], strict=False))
    )
    assert len(chosen) == max(rises)


def test_one_broken_scan_in_a_long_log_is_forgiven():
    """One of 20, or three of 300, are left out.

    A single warning counts them and names the first line.
    """
    text = "left out 1 broken of 20 scans, the first on line 3: odd"
    with pytest.warns(UserWarning, match=text) as record:
        forgive("a.log", {3: "odd"}, 20)
    assert len(record) == 1
    with pytest.warns(UserWarning, match="left out 3 broken of 300"):
        forgive("a.log", {5: "odd", 3: "odd", 9: "odd"}, 300)


@pytest.mark.parametrize(("bad", "total"), [(1, 19), (2, 100), (4, 300), (50, 100)])
def test_many_broken_scans_are_not_forgiven(bad, total):
    """More than one scan in a hundred, or any in a short log, is an error.

    It names the first line.
    """
    with pytest.raises(FormatError, match=rf"a.log, line 3: odd \({bad} of {total}"):
        forgive("a.log", {3 + i: "odd" for i in range(bad)}, total)


def test_a_good_clock_is_left_alone():
    """An increasing clock loses nothing, changes nothing and warns of nothing."""
    t = np.array([5.0, 5.1, 5.3])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        keep, kept, notes = _usable_clock("a.log", t)
    assert keep.tolist() == [0, 1, 2] and np.array_equal(kept, t) and not notes


def test_a_stray_time_costs_one_scan():
    """One time far in the future near the beginning takes only itself away."""
    t = np.arange(100) * 0.1
    t[3] = 1e9
    with pytest.warns(UserWarning, match="left out 1 of 100 scans"):
        keep, kept, notes = _usable_clock("a.log", t)
    assert len(keep) == 99 and 3 not in keep and np.all(np.diff(kept) > 0) and not notes


@pytest.mark.parametrize(("stray", "time"), [(99, 1e300), (0, -1e6), (50, 1e6), (50, -1e6)])
def test_a_scan_far_from_both_neighbours_is_left_out(stray, time):
    """Forwards or backwards, within the log or at its end: one such scan takes only itself away."""
    t = np.arange(100) * 0.1
    t[stray] = time
    text = "left out 1 of 100 scans, which the clock puts out of order"
    with pytest.warns(UserWarning, match=text) as record:
        keep, kept, notes = _usable_clock("a.log", t)
    assert keep.tolist() == [i for i in range(100) if i != stray] and np.array_equal(kept, t[keep])
    assert len(record) == 1 and not notes


def test_a_lasting_jump_is_told():
    """A clock that is set forwards for good leaves every scan in order.

    A warning tells the jump.
    """
    t = np.arange(100) * 0.1 + 1e6 * (np.arange(100) >= 50)
    with pytest.warns(UserWarning, match="the clock jumps by 1e.06 s") as record:
        keep, kept, notes = _usable_clock("a.log", t)
    assert len(keep) == 100 and np.array_equal(kept, t) and len(record) == 1
    assert [(note.kind, note.doubt) for note in notes] == [("clock", True)] and "jumps by 1e+06 s" in notes[0].text


@pytest.mark.parametrize("t", [np.zeros(50), -np.arange(50.0), np.tile(np.arange(25.0), 2)])
def test_a_useless_clock_is_replaced_and_said_so(t):
    """All zero, running backwards or reset in the middle.

    Every scan is kept, at the nominal rate, with a warning.
    """
    with pytest.warns(UserWarning, match="timed at 10 Hz; speeds mean nothing"):
        keep, kept, notes = _usable_clock("a.log", t)
    assert len(keep) == 50
    assert [(note.kind, note.doubt) for note in notes] == [("clock", True)] and "mean nothing" in notes[0].text
    np.testing.assert_allclose(kept, np.arange(50) * 0.1)


@pytest.mark.parametrize(("scans", "kept"), [(20, 19), (19, 19)])
def test_one_scan_in_twenty_may_be_out_of_order(scans, kept):
    """Exactly one in twenty is left out and the times stay.

    One in nineteen makes the clock worthless.
    """
    t = 5 + np.arange(scans) * 0.5
    t[3] = 1e9
    with pytest.warns(UserWarning):
        keep, times, _ = _usable_clock("a.log", t)
    assert len(keep) == kept and times[-1] == (t[-1] if scans == 20 else 1.8)


def scans_of(counts):
    """Scans of so many beams each, a tenth of a second apart, by the lines 1, 3, 5, ..."""
    beams = [Beams(count, -1.5, 0.1, 8.0) for count in counts]
    scans = [Scan(each, np.ones(each.count), (0, 0, 0), i / 10) for i, each in enumerate(beams)]
    return dict(zip(range(1, 2 * len(scans), 2), scans, strict=True))


def test_scans_of_another_geometry_are_left_out():
    """Those of most stay, with their times; what is broken otherwise counts with them."""
    text = "left out 1 broken of 30 scans, the first on line 5: 4 beams .*have 3 beams"
    with pytest.warns(UserWarning, match=text):
        scans, t, notes = usable_scans("a.log", scans_of([3, 3, 4, *[3] * 27]), {})
    assert {scan.beams.count for scan in scans} == {3} and not notes
    assert t.tolist() == [i / 10 for i in range(30) if i != 2]
    with pytest.raises(FormatError, match=r"a\.log, line 2: cut off \(2 of 31 scans are broken\)"):
        usable_scans("a.log", scans_of([3, 3, 4, *[3] * 27]), {2: "cut off"})


def test_bearings_follow_from_start_and_step():
    """One per beam, whichever way the laser turns."""
    assert Beams(3, 1.0, -0.5, None).angles.tolist() == [1.0, 0.5, 0.0]
    assert str(Beams(3, 1.0, -0.5, None)) == "3 beams from 1 rad, -0.5 rad apart"


# ---- what is no distance

ANGLES = np.linspace(-np.pi / 2, np.pi / 2, 181)


def hall(places, angles=ANGLES, size=(25.0, 15.0), noise=0.01, quantum=0.01, seed=0):
    """Ranges (T, B) in m from poses in an empty hall: its far wall is hit often."""
    x, y, theta = np.transpose(places)[..., None]
    bearings = theta + angles
    with np.errstate(divide="ignore"):
        to_x = np.where(np.cos(bearings) > 0, size[0] - x, -x) / np.cos(bearings)
        to_y = np.where(np.sin(bearings) > 0, size[1] - y, -y) / np.sin(bearings)
    ranges = np.minimum(np.abs(to_x), np.abs(to_y))
    ranges += noise * np.random.default_rng(seed).standard_normal(ranges.shape)
    return np.rint(ranges / quantum) * quantum


STANDING = np.tile([1.0, 7.5, 0.0], (300, 1))
DRIVING = np.column_stack([np.linspace(1, 20, 300), np.full(300, 7.5), np.linspace(0, 3, 300)])


@pytest.mark.parametrize("places", [STANDING, DRIVING], ids=["standing", "driving"])
@pytest.mark.parametrize("noise", [0.0, 0.005, 0.02])
@pytest.mark.parametrize("quantum", [0.001, 0.01, 0.05])
@pytest.mark.parametrize("size", [(25.0, 15.0), (40.0, 15.0), (9.0, 60.0)])
def test_a_far_wall_is_no_full_scale(places, noise, quantum, size):
    """However often it is hit, with whatever noise and steps, no reading of a hall is taken away."""
    ranges = hall(places, size=size, noise=noise, quantum=quantum)
    assert no_return_from("a.log", ranges, ANGLES, 80.0) == (80.0, ())


@pytest.mark.parametrize("codes", [[50.0], [51.1, 51.15], [51.05, 51.1, 51.1, 51.1, 51.15, 51.15, 51.15]])
@pytest.mark.parametrize("share", [0.005, 0.3])
def test_a_number_for_no_return_is_found(codes, share):
    """Whatever the number, and although it varies by a step or two: the lowest of them is the limit."""
    ranges, rng = hall(DRIVING), np.random.default_rng(1)
    lost = rng.random(ranges.shape) < share
    ranges[lost] = rng.choice(codes, lost.sum())
    limit, notes = no_return_from("a.log", ranges, ANGLES, 80.0)
    assert limit == min(codes)
    assert [(note.kind, note.doubt) for note in notes] == [("sensor", False)]
    assert f"{lost.mean():.1%} of the readings pile up at {min(codes):g}" in notes[0].text


def test_two_numbers_for_no_return():
    """Below the one that is known, or the one that was found, there may be another."""
    ranges = hall(DRIVING)
    ranges[:, ::7], ranges[:, 1::7], ranges[:, 2::7] = 81.91, 50.0, 45.0
    limit, notes = no_return_from("a.log", ranges, ANGLES, 80.0)
    assert limit == 45.0 and len(notes) == 2


def test_the_end_of_a_corridor_stays_in_doubt():
    """A number that comes from one narrow direction only stays a distance, and is warned of."""
    ranges = hall(STANDING)
    ranges[:, 89:92] = 40.0
    with pytest.warns(UserWarning, match=r"1\.7% of the readings pile up at 40 m; if .*log.ranges < 40,"):
        limit, notes = no_return_from("a.log", ranges, ANGLES, 80.0)
    assert limit == 80.0 and [(note.kind, note.doubt) for note in notes] == [("sensor", True)]


def test_where_everything_is_alike_nothing_is_taken_away():
    """Readings that stand out from nothing are distances, and so is all of a short log."""
    for ranges in (np.full((300, 181), 2.5), np.array([[1.0, 2.0, 50.0]])):
        angles = ANGLES[: ranges.shape[1]]
        assert no_return_from("a.log", ranges, angles, 80.0) == (80.0, ())


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
@pytest.mark.parametrize(("name", "low"), [("intel", 81.83), ("edmonton", 51.09), ("csail", 81.91), ("orebro", 32.759)])
def test_full_scales_come_out_of_the_data(name, low):
    """Of four real logs the readings alone tell what the sources of laser and logger tell."""
    path = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / f"carmen_logs/{name}-corrected.log.gz"
    lines = gzip.decompress(path.read_bytes()).decode().splitlines()
    scans = [line.split() for line in lines if line.startswith("FLASER")]
    ranges = np.array([scan[2 : 2 + int(scan[1])] for scan in scans], float)
    limit, notes = no_return_from(path, ranges, np.linspace(-1.5, 1.5, ranges.shape[1]), np.inf)
    assert limit == low and [note.doubt for note in notes] == [False]
