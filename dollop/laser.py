"""A laser log in memory: what every reader returns and every stage of Sec. II takes."""

from dataclasses import dataclass

import numpy as np

from dollop.checks import (
    LATEST,
    Note,
    checked_array,
    checked_number,
    checked_positions,
    checked_records,
    put_in,
)
from dollop.pose import wrapped

__all__ = ["FULL_TURN", "LaserLog"]

FULL_TURN = 2 * np.pi + 1e-6  # rad, and what rounding adds
LEAST_RANGE = 1e-6  # m


@dataclass(frozen=True, eq=False)
class LaserLog:
    """Scans of one planar laser, with the sensor's pose at each (Sec. II).

    The arrays are copies, and read-only: what has been checked stays as it is.

    Attributes
    ----------
    t : (T,) float array
        Time of each scan in s, increasing.
    ranges : (T, B) float array
        Metres; `inf` where nothing came back.
    angles : (B,) float array
        Bearing of each beam in the sensor's frame in rad, beam 0 rightmost.
    poses : (T, 3) float array
        Sensor in the world: x, y in m, theta in rad, wrapped to (-pi, pi].
    max_range : float
        The farthest range the sensor can report, in m.
    notes : tuple of Note
        What a reader had to guess, or found wrong and could not mend.

    Raises
    ------
    ValueError
        If shapes do not fit, a range is NaN, negative or finite beyond `max_range`, times or angles do
        not increase, angles span more than a full turn, or a pose is beyond 1e9 m.

    Examples
    --------
    >>> log = LaserLog([0.0], [[1.0, np.inf]], [0.0, 1.5], [[2.0, 0.0, -np.pi]], max_range=8.0)
    >>> log, log.poses[0, 2] == np.pi
    (LaserLog of 1 scans in 0.0 s, 2 beams over 86 degrees, np.True_)
    """

    t: np.ndarray
    ranges: np.ndarray
    angles: np.ndarray
    poses: np.ndarray
    max_range: float
    notes: tuple = ()

    def __post_init__(self):
        t = checked_array("t", self.t, "T", least=-LATEST, most=LATEST)
        angles = checked_array("angles", self.angles, "B", least=-FULL_TURN, most=FULL_TURN)
        if 0 in (t.size, angles.size):
            raise ValueError(f"a log must hold a scan and a beam, got {t.size} and {angles.size}")
        ranges = checked_array("ranges", self.ranges, t.size, angles.size, finite=False)
        poses = checked_positions("poses", self.poses, t.size, 3)
        poses[:, 2] = wrapped(poses[:, 2])
        max_range = checked_number("max_range", self.max_range, LEAST_RANGE)
        _check_increasing("t", t)
        _check_increasing("angles", angles)
        if angles[-1] - angles[0] > FULL_TURN:
            raise ValueError(f"angles must span a full turn at most, got {angles[-1] - angles[0]:g} rad")
        _check_ranges(ranges, max_range)
        put_in(self, t=t, ranges=ranges, angles=angles, poses=poses, max_range=max_range)
        put_in(self, notes=checked_records("notes", self.notes, Note))

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        scans, beams = self.ranges.shape
        span, fov = self.t[-1] - self.t[0], np.degrees(self.angles[-1] - self.angles[0])
        return f"LaserLog of {scans} scans in {span:.1f} s, {beams} beams over {fov:.0f} degrees"


def _check_ranges(ranges, max_range):
    """Every range must be a distance that the sensor can report, or `inf`."""
    wrong = ~((ranges >= 0) & ((ranges <= max_range) | np.isposinf(ranges)))
    if wrong.any():
        scan, beam = np.argwhere(wrong)[0]
        rule = f"a range must be in [0, max_range = {max_range:g}], or inf where nothing came back"
        raise ValueError(f"{rule}; got {ranges[scan, beam]} in scan {scan}, beam {beam}")


def _check_increasing(name, values):
    """Each value must be greater than the one before."""
    falls = np.flatnonzero(np.diff(values) <= 0)
    if falls.size:
        before, after = values[falls[0] : falls[0] + 2]
        raise ValueError(f"{name} must increase, got {before} and then {after} at index {falls[0] + 1}")
