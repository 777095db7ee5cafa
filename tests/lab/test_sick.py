"""The SICK without a laboratory: noise, steps, modes and mixed pixels."""

import numpy as np
import pytest

from dollop.lab.sick import SCAN_RATES, SickLMS200, mix_pixels

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


@pytest.mark.parametrize(("mode", "step", "far"), [("mm", 0.001, 8.191), ("cm", 0.01, 81.91)])
def test_readings_are_whole_steps(mode, step, far):
    """Readings are whole mm or cm, never shorter than 0.2 m nor farther than the mode allows."""
    sick = SickLMS200(mode=mode)
    ranges = sick.report(np.linspace(0.01, far + 0.1, 5000), np.random.default_rng(2))
    finite = ranges[np.isfinite(ranges)]
    assert np.allclose(finite / step, np.round(finite / step), atol=1e-6)
    assert finite.min() == 0.2 and finite.max() <= far == sick.max_range


@pytest.mark.parametrize(("fov", "resolution"), SCAN_RATES)
def test_every_mode_spans_its_field_of_view(fov, resolution):
    """Beams run from the right edge to the left one in even steps."""
    angles = SickLMS200(fov=fov, resolution=resolution).angles
    half = np.deg2rad(fov) / 2
    assert angles[0] == pytest.approx(-half) and angles[-1] == pytest.approx(half)
    assert np.allclose(np.diff(angles), np.deg2rad(resolution))


LACKING = [{"fov": 180, "resolution": 0.25}, {"fov": 270}, {"mode": "inch"}]


@pytest.mark.parametrize("setting", LACKING)
def test_modes_that_the_sensor_lacks_are_refused(setting):
    """An invalid mode raises ValueError that lists the valid ones."""
    with pytest.raises(ValueError, match="must be one of"):
        SickLMS200(**setting)


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
