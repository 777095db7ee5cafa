"""A SICK LMS 200: rays through the laboratory, then noise, mixed pixels and quantisation."""

from dataclasses import dataclass

import numpy as np

from dollop.lab.scenes import BEAM_HEIGHT

__all__ = ["SickLMS200", "cast"]

SCAN_RATES = {(180, 1): 10.0, (180, 0.5): 5.0, (100, 1): 17.0, (100, 0.5): 9.0, (100, 0.25): 4.5}
"""Scans per second at 38400 baud for each field of view and resolution in degrees on offer."""

RESOLUTIONS = {"mm": (1000, 8.191), "cm": (100, 81.91)}
"""Steps per metre and farthest range in m of the measuring modes: 13 bits count 8191 steps."""


@dataclass(frozen=True)
class SickLMS200:
    """A SICK LMS 200 laser range finder.

    Modes and rates are those of CARMEN's and Player's drivers. A reading below `min_range` comes
    back as `min_range`, one beyond the mode's farthest range as `inf`. A scan is a snapshot: the
    13 ms that the mirror takes for it are neglected. How often pixels mix is a reconstruction.

    Parameters
    ----------
    fov, resolution : float
        Field of view and angle between beams in degrees, a key of `SCAN_RATES`.
    mode : str
        "mm": steps of 1 mm to 8.191 m; "cm": steps of 1 cm to 81.91 m.
    noise : float
        Standard deviation in m of each reading; the data sheet gives 5 mm.
    bias : float
        Constant error in m of a run; the data sheet allows 15 mm either way.
    mixed : float
        Probability that the nearer of two beams across a jump in range, its spot half over the
        edge, returns something between the two ranges.
    jump : float
        Difference in m between neighbouring ranges that counts as a jump.
    min_range : float
        Shortest range in m that is reported.

    Raises
    ------
    ValueError
        For a field of view, resolution or mode that the sensor does not offer.

    Examples
    --------
    >>> sick = SickLMS200()
    >>> len(sick.angles), sick.rate, sick.max_range
    (181, 10.0, 8.191)
    """

    fov: float = 180
    resolution: float = 1.0
    mode: str = "mm"
    noise: float = 0.005
    bias: float = 0.0
    mixed: float = 0.1
    jump: float = 0.3
    min_range: float = 0.2

    def __post_init__(self):
        if (self.fov, self.resolution) not in SCAN_RATES:
            valid = ", ".join(f"{fov}/{resolution:g}" for fov, resolution in SCAN_RATES)
            got = f"{self.fov}/{self.resolution:g}"
            raise ValueError(f"fov/resolution must be one of {valid} degrees, got {got}")
        if self.mode not in RESOLUTIONS:
            raise ValueError(f"mode must be one of {sorted(RESOLUTIONS)}, got {self.mode!r}")

    @property
    def angles(self):
        """(B,) bearing of each beam in rad, the rightmost first."""
        steps = np.arange(round(self.fov / self.resolution) + 1)
        return np.deg2rad(steps * self.resolution - self.fov / 2)

    @property
    def rate(self):
        """Scans per second."""
        return SCAN_RATES[self.fov, self.resolution]

    @property
    def max_range(self):
        """Farthest range in m."""
        return RESOLUTIONS[self.mode][1]

    def scan(self, world, pose, rng):
        """What the sensor reports from a place in the laboratory.

        Parameters
        ----------
        world : World
        pose : (3,) sequence of float
            Of the sensor: x, y in m, theta in rad.
        rng : numpy.random.Generator

        Returns
        -------
        (B,) float array
            Ranges in m, `inf` where nothing came back.
        """
        return self.report(cast(world, pose, self.angles, self.max_range), rng)

    def report(self, distances, rng):
        """What the sensor makes of true distances.

        Parameters
        ----------
        distances : (B,) array
            True distance along each beam in m, `inf` where there is nothing.
        rng : numpy.random.Generator

        Returns
        -------
        (B,) array
            Reported ranges in m, `inf` where nothing came back.

        Examples
        --------
        Without noise, whole millimetres within its range are left.

        >>> sick = SickLMS200(noise=0.0, mixed=0.0)
        >>> sick.report(np.array([0.05, 1.23456, 9.0]), np.random.default_rng(0)).tolist()
        [0.2, 1.235, inf]
        """
        ranges = mix_pixels(distances, self.mixed, self.jump, rng)
        ranges = ranges + self.bias + self.noise * rng.standard_normal(len(ranges))
        ranges = np.maximum(ranges, self.min_range)
        steps = RESOLUTIONS[self.mode][0]
        ranges = np.round(ranges * steps) / steps
        return np.where(ranges > self.max_range, np.inf, ranges)


def cast(world, pose, angles, reach):
    """True distance along each beam, by PyBullet's rays.

    Parameters
    ----------
    world : Server
        Usually a `World`.
    pose : (3,) array
        Sensor: x, y in m, theta in rad.
    angles : (B,) array
        Bearings in rad in the sensor's frame.
    reach : float
        Length of the rays in m.

    Returns
    -------
    (B,) array
        Metres, `inf` where the ray meets nothing.
    """
    x, y, theta = pose
    start = np.array([x, y, BEAM_HEIGHT])
    bearings = angles + theta
    directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(angles))])
    starts = np.tile(start, (len(angles), 1))
    hits = world.call("rayTestBatch", starts, start + reach * directions, numThreads=1)
    fractions = np.array([hit[2] for hit in hits])
    return np.where(fractions < 1.0, reach * fractions, np.inf)


def mix_pixels(distances, probability, jump, rng):
    """Distances in which some beams at a jump in range fall between the two ranges."""
    steps = np.diff(np.where(np.isfinite(distances), distances, np.nan))
    chance, share = rng.random((2, len(steps)))
    mixed = np.flatnonzero((np.abs(steps) > jump) & (chance < probability))
    result = distances.copy()
    result[mixed + (steps[mixed] < 0)] += share[mixed] * np.abs(steps[mixed])
    return result
