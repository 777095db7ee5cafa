"""The laser log in memory and what it refuses."""

import numpy as np
import pytest

from dollop.laser import LaserLog

GOOD = {
    "t": [0.0, 0.1],
    "ranges": [[1.0, np.inf, 0.0], [2.0, 8.0, 3.0]],
    "angles": [-1.0, 0.0, 1.0],
    "poses": [[0.0, 0.0, 0.0], [1.0, 0.0, 3.0]],
    "max_range": 8.0,
}


def test_lists_become_float_arrays():
    """Lists are taken as arrays of floats, and the length is the number of scans."""
    log = LaserLog(**GOOD)
    assert len(log) == 2
    assert all(getattr(log, name).dtype == float for name in ("t", "ranges", "angles", "poses"))


def test_what_was_checked_stays():
    """The arrays are read-only copies.

    Neither the log's nor the caller's own can change the log afterwards.
    """
    ranges = np.array(GOOD["ranges"])
    log = LaserLog(**(GOOD | {"ranges": ranges}))
    ranges[0, 0] = -7
    assert log.ranges[0, 0] == 1.0
    for name in ("t", "ranges", "angles", "poses"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(log, name)[0] = 0


def test_headings_are_wrapped():
    """Theta is in (-pi, pi] whatever the file counted; what was there before keeps its last bit."""
    theta = np.array([-3 * np.pi, -np.pi, -1.1, 0.3, np.pi, 4.0, 100.0])
    poses = np.column_stack([theta, theta, theta])
    log = LaserLog(np.arange(7), np.ones((7, 1)), [0.0], poses, 8.0)
    wrapped = log.poses[:, 2]
    assert ((wrapped > -np.pi) & (wrapped <= np.pi)).all()
    assert np.array_equal(wrapped[2:5], theta[2:5])
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * theta), atol=1e-12)
    np.testing.assert_array_equal(log.poses[:, :2], poses[:, :2])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("t", [0.1, 0.1], r"t must increase, got 0.1 and then 0.1 at index 1"),
        ("t", [0.1, 0.0], r"t must increase, got 0.1 and then 0.0 at index 1"),
        ("t", [0.0, np.nan], r"t must be finite, got nan"),
        ("t", [], r"a log must hold a scan and a beam, got 0 and 3"),
        ("angles", [1.0, 0.0, -1.0], r"angles must increase, got 1.0 and then 0.0"),
        ("angles", [[-1.0, 0.0, 1.0]], r"angles must have shape \(B,\), got \(1, 3\)"),
        ("ranges", [[1.0, 2.0], [1.0, 2.0]], r"ranges must have shape \(2, 3\), got \(2, 2\)"),
        ("ranges", [[1.0, np.nan, 1.0], [1.0, 1.0, 1.0]], r"got nan in scan 0, beam 1"),
        ("ranges", [[1.0, 1.0, 1.0], [1.0, 1.0, -0.5]], r"got -0.5 in scan 1, beam 2"),
        ("ranges", [[1.0, 1.0, 8.5], [1.0, 1.0, 1.0]], r"\[0, max_range = 8\].*got 8.5 in scan 0"),
        ("ranges", [[1.0, 1.0, -np.inf], [1.0, 1.0, 1.0]], r"got -inf in scan 0, beam 2"),
        ("poses", [[0.0, 0.0], [0.0, 0.0]], r"poses must have shape \(2, 3\), got \(2, 2\)"),
        ("poses", [[0.0, 0.0, 0.0], [0.0, np.inf, 0.0]], r"poses must be finite, .*inf.* in row 1"),
        ("max_range", 0.0, r"max_range must be .*, got 0.0"),
        ("max_range", np.inf, r"max_range must be .*, got inf"),
        ("max_range", np.nan, r"max_range must be .*, got nan"),
    ],
)
def test_bad_values_are_named(name, value, message):
    """What does not fit is refused with the value and the rule."""
    with pytest.raises(ValueError, match=message):
        LaserLog(**(GOOD | {name: value}))
