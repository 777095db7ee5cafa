"""The scanners without a laboratory: noise, steps, modes, missed readings and mixed pixels."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest

from dollop.checks import told
from dollop.lab.scanner import MODELS, SCAN_RATES, UTM30LX, Scanner, SickLMS200, SickTiM571, mix_pixels

CLEAN = SickLMS200(noise=0.0, mixed=0.0)


def test_no_return_is_infinite():
    """A beam that meets nothing within 8.191 m is reported as inf, one just within is not."""
    distances = np.array([np.inf, 8.25, 8.191, 3.0])
    ranges = CLEAN.report(distances, np.random.default_rng(0))
    assert ranges.tolist() == [np.inf, np.inf, 8.191, 3.0]


def test_noise_has_the_data_sheets_statistics():
    """Ten thousand readings of 4 m have a mean of 4 m plus the bias, and an sd of 5 mm."""
    ranges = SickLMS200(bias=0.01).report(np.full(10_000, 4.0), np.random.default_rng(1))
    assert ranges.mean() == pytest.approx(4.01, abs=2e-4)
    assert ranges.std() == pytest.approx(0.005, rel=0.05)


@pytest.mark.parametrize("noise", [0.005, 0.010, 0.020, 0.030])
@pytest.mark.parametrize("scanner", MODELS.values(), ids=MODELS)
def test_noise_is_as_large_as_asked_for(scanner, noise):
    """Of twenty thousand readings of 5 m the mean is off by half a step at most, the sd is the one asked for."""
    ranges = scanner(noise=noise).report(np.full(20_000, 5.0), np.random.default_rng(2))
    assert ranges.mean() == pytest.approx(5.0, abs=0.001)
    assert ranges.std() == pytest.approx(noise, rel=0.02)


@pytest.mark.parametrize("missed", [0.0, 0.01, 0.3, 1.0])
def test_readings_are_missed_at_the_stated_rate(missed):
    """So many of forty thousand readings come back as inf, whatever is there, and the others as they are."""
    near, far = np.full(20_000, 0.1), np.full(20_000, 4.0)
    ranges = replace(CLEAN, missed=missed).report(np.append(near, far), np.random.default_rng(3)).reshape(2, -1)
    assert np.isinf(ranges).mean(axis=1) == pytest.approx(missed, abs=0.012 * (0 < missed < 1))
    assert set(ranges[np.isfinite(ranges)]) <= {0.2, 4.0}


@pytest.mark.parametrize(("mode", "step", "far"), [("mm", 0.001, 8.191), ("cm", 0.01, 81.91)])
def test_readings_are_whole_steps(mode, step, far):
    """Readings are whole mm or cm, never shorter than 0.2 m nor farther than the mode allows."""
    sick = SickLMS200(mode=mode)
    ranges = sick.report(np.linspace(0.01, far + 0.1, 5000), np.random.default_rng(2))
    finite = ranges[np.isfinite(ranges)]
    assert np.allclose(finite / step, np.round(finite / step), atol=1e-6)
    assert finite.min() == 0.2 and finite.max() <= far == sick.max_range


@pytest.mark.parametrize("mode", ["mm", "cm"])
@pytest.mark.parametrize(("fov", "resolution"), SCAN_RATES)
def test_every_mode_spans_its_field_of_view(fov, resolution, mode):
    """Beams run from the right edge to the left one in even steps."""
    angles = SickLMS200(fov=fov, resolution=resolution, mode=mode).angles
    half = np.deg2rad(fov) / 2
    assert angles[0] == pytest.approx(-half) and angles[-1] == pytest.approx(half)
    assert np.allclose(np.diff(angles), np.deg2rad(resolution))


DATA_SHEETS = [  # beams, scans per second, degrees, farthest and nearest reading in m
    (SickLMS200(), 181, 10.0, 180, 8.191, 0.2),
    (SickLMS200(180, 0.5), 361, 5.0, 180, 8.191, 0.2),
    (SickLMS200(100, 1), 101, 17.0, 100, 8.191, 0.2),
    (SickLMS200(100, 0.5, "cm"), 201, 9.0, 100, 81.91, 0.2),
    (SickLMS200(100, 0.25), 401, 4.5, 100, 8.191, 0.2),
    (SickTiM571(), 811, 15.0, 270, 25.0, 0.05),
    (UTM30LX(), 1081, 40.0, 270, 30.0, 0.1),
]


@pytest.mark.parametrize(("scanner", "beams", "rate", "fov", "far", "near"), DATA_SHEETS)
def test_scanners_are_those_of_the_data_sheets(scanner, beams, rate, fov, far, near):
    """Beams, scans per second, field of view and the ranges that come back are those of each model's mode."""
    ranges = replace(scanner, noise=0.0, mixed=0.0).report(np.array([0.0, far, far + 0.01]), np.random.default_rng(0))
    assert (len(scanner.angles), scanner.rate) == (beams, rate)
    assert np.rad2deg(np.ptp(scanner.angles)) == pytest.approx(fov) and scanner.angles.sum() == pytest.approx(0.0)
    assert ranges.tolist() == [near, far, np.inf]


LACKING = [{"fov": 180, "resolution": 0.25}, {"fov": 270}, {"mode": "inch"}, {"fov": np.nan}]


@pytest.mark.parametrize("setting", LACKING)
def test_modes_that_the_sensor_lacks_are_refused(setting):
    """An invalid mode raises ValueError that lists the valid ones and names the value."""
    with pytest.raises(ValueError, match=rf"must be one of .*, got .*{next(reversed(setting.values()))}"):
        SickLMS200(**setting)


BAD = [
    ("fov", 361.0, "fov must be in 0.1 to 360, got 361.0"),
    ("fov", 0.0, "fov must be in 0.1 to 360, got 0.0"),
    ("resolution", 0.7, "a multiple of resolution"),
    ("rate", 0.0, "rate must be in 0.1 to 1000, got 0.0"),
    ("rate", 9.0, "rate of a SICK LMS 200 must be 10 in this mode, got 9"),
    ("step", 0.3, "step must be a whole part of a metre, got 0.3"),
    ("step", 2.0, "step must be in 0.0001 to 1, got 2.0"),
    ("jump", 0.0, "jump must be in 0.001 to 1000, got 0.0"),
    ("model", 200, "model must be a name, got 200"),
    ("min_range", 9.0, "min_range must be below max_range"),
    ("noise", -0.001, "noise must be in 0 to 1, got -0.001"),
    ("bias", np.inf, r"bias must be a finite number within 1e\+09, got inf"),
    ("mixed", 1.5, "mixed must be in 0 to 1, got 1.5"),
    ("missed", 1.01, "missed must be in 0 to 1, got 1.01"),
]


@pytest.mark.parametrize(("name", "value", "rule"), BAD)
def test_a_scanner_that_cannot_be_is_refused(name, value, rule):
    """A number out of its range raises ValueError that names it and the rule."""
    with pytest.raises(ValueError, match=rule):
        replace(CLEAN, **{name: value})


@pytest.mark.parametrize("value", [np.nan, "1", True, None, [1.0], 10**400], ids=lambda value: f"{value!r:.5}")
@pytest.mark.parametrize("name", [each.name for each in fields(Scanner) if each.name != "model"])
def test_no_number_of_a_scanner_is_anything_else(name, value):
    """NaN, text, a bool, nothing, a list and what no float holds raise ValueError that names field and value."""
    with pytest.raises(ValueError, match=rf"^{name} must be a finite number.*, got {re.escape(told(value))}"):
        replace(CLEAN, **{name: value})


def test_somebodys_own_scanner_counts_a_metre_in_whole_steps():
    """A step of 1/3 m or 2.5 mm is one, of 0.3 m it is none, whatever the model."""
    own = Scanner("my own", 90, 0.1, 12.5, 4.0, 0.1, 0.0025, 0.02)
    assert replace(own, step=1 / 3).report(np.array([1.1]), np.random.default_rng(0))[0] in (2 / 3, 1.0, 4 / 3)
    with pytest.raises(ValueError, match="step must be a whole part of a metre, got 0.3"):
        replace(own, step=0.3)


def test_mixed_pixels_fall_between_the_two_ranges_of_a_jump_and_nowhere_else():
    """Only the nearer beam at a jump changes, to something between, in about one of ten scans."""
    distances = np.array([5.0, 5.05, 2.0, 2.0, 6.0, np.inf])
    rng = np.random.default_rng(3)
    scans = np.array([mix_pixels(distances, 0.1, 0.3, rng) for _ in range(5000)])
    changed = scans != distances
    assert not changed[:, [0, 1, 4, 5]].any()
    assert changed[:, [2, 3]].mean() == pytest.approx(0.1, abs=0.02)
    assert np.all(scans[:, 2:4] >= 2.0)
    assert np.all(scans[:, 2:4] <= [5.05, 6.0])
