"""A laser log in memory: what every reader returns and every stage of Sec. II takes."""

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, eq=False)
class LaserLog:
    """Scans of one planar laser, with the sensor's pose at each.

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

    Raises
    ------
    ValueError
        If shapes do not fit, a range is NaN, negative or finite beyond `max_range`, or an order is not increasing.

    Examples
    --------
    >>> LaserLog(t=[0.0], ranges=[[1.0, -1.0]], angles=[0.0, 1.5], poses=[[2.0, 0.0, np.pi]], max_range=8.0)
    Traceback (most recent call last):
    ValueError: a range must be in [0, max_range = 8], or inf where nothing came back; got -1.0 in scan 0, beam 1
    """

    t: np.ndarray
    ranges: np.ndarray
    angles: np.ndarray
    poses: np.ndarray
    max_range: float

    def __post_init__(self):
        for field in fields(self)[:-1]:
            object.__setattr__(self, field.name, np.array(getattr(self, field.name), dtype=float))
        object.__setattr__(self, "max_range", float(self.max_range))
        self._check_shapes()
        _check_increasing("t", self.t)
        _check_increasing("angles", self.angles)
        check_positive("max_range", self.max_range)
        self._check_values()
        self.poses[:, 2] = wrapped(self.poses[:, 2])
        for field in fields(self)[:-1]:
            getattr(self, field.name).flags.writeable = False

    def __len__(self):
        return len(self.t)

    def _check_shapes(self):
        if self.t.ndim != 1 or self.angles.ndim != 1 or 0 in (self.t.size, self.angles.size):
            raise ValueError(f"t and angles must have shape (T,) and (B,), got {self.t.shape} and {self.angles.shape}")
        expected = {"ranges": (self.t.size, self.angles.size), "poses": (self.t.size, 3)}
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} must have shape {shape}, got {getattr(self, name).shape}")

    def _check_values(self):
        if not np.isfinite(self.poses).all():
            raise ValueError(f"poses must be finite, got {self.poses[~np.isfinite(self.poses)][0]}")
        wrong = ~((self.ranges >= 0) & ((self.ranges <= self.max_range) | np.isposinf(self.ranges)))
        if wrong.any():
            scan, beam = np.argwhere(wrong)[0]
            rule = f"a range must be in [0, max_range = {self.max_range:g}], or inf where nothing came back"
            raise ValueError(f"{rule}; got {self.ranges[scan, beam]} in scan {scan}, beam {beam}")


def check_positive(name, value, or_zero=False):
    """Raise ValueError for a number that is negative, infinite or NaN, or zero unless that is allowed."""
    if not (0 < value < np.inf or (or_zero and value == 0)):
        raise ValueError(
            f"{name} must be {'finite and not negative' if or_zero else 'positive and finite'}, got {value}"
        )


def wrapped(angles):
    """Angles in rad, an array, in (-pi, pi]; those that are there already keep their last bit."""
    return np.where((angles > -np.pi) & (angles <= np.pi), angles, np.pi - (np.pi - angles) % (2 * np.pi))


def _check_increasing(name, values):
    """Values must be finite and each greater than the one before."""
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite, got {values[~np.isfinite(values)][0]}")
    falls = np.flatnonzero(np.diff(values) <= 0)
    if falls.size:
        i = falls[0]
        raise ValueError(f"{name} must increase, got {values[i]} and then {values[i + 1]} at index {i + 1}")
