"""Laser scanners by their data sheets: rays through the laboratory, then noise, mixed pixels and quantisation."""

from dataclasses import dataclass

import numpy as np

from dollop.checks import check_choice, checked_number, told

__all__ = ["MODELS", "SCAN_RATES", "Scanner", "SickLMS200", "SickTiM571", "UTM30LX", "mix_pixels"]

SCAN_RATES = {(180, 1): 10.0, (180, 0.5): 5.0, (100, 1): 17.0, (100, 0.5): 9.0, (100, 0.25): 4.5}
"""Scans per second of a SICK LMS 200 at 38400 baud for each field of view and resolution in degrees
on offer (drivers of CARMEN and Player)."""

DATA_SHEETS = {
    "SICK TiM571": dict(fov=270, resolution=1 / 3, rate=15.0, max_range=25.0, min_range=0.05, step=0.001),
    "Hokuyo UTM-30LX": dict(fov=270, resolution=0.25, rate=40.0, max_range=30.0, min_range=0.1, step=0.001),
}
"""What the data sheets of scanners with a single mode say."""

MODES = {"mm": (0.001, 8.191), "cm": (0.01, 81.91)}
"""Step and farthest range in m of its measuring modes: 13 bits count 8191 steps."""


RANGES = {
    "fov": (0.1, 360), "resolution": (0.01, 90), "rate": (0.1, 1000), "max_range": (0.1, 1000), "min_range": (0, 1000),
    "step": (1e-4, 1), "noise": (0, 1), "bias": (-1, 1), "mixed": (0, 1), "jump": (1e-3, 1000), "missed": (0, 1),
}  # fmt: skip
"""What the numbers of a scanner can be."""


@dataclass(frozen=True)
class Scanner:
    """A planar laser range finder.

    A reading below `min_range` comes back as `min_range`, one beyond `max_range` as `inf`. A scan is
    a snapshot: the time that the mirror takes for it is neglected. How often pixels mix and readings
    are missed is a reconstruction.

    Parameters
    ----------
    model : str
        Its name.
    fov, resolution : float
        Field of view and angle between beams in degrees.
    rate : float
        Scans per second.
    max_range, min_range : float
        Farthest and shortest range in m that is reported.
    step : float
        Readings are whole steps, in m.
    noise : float
        Standard deviation in m of each reading.
    bias : float
        Constant error in m of a run.
    mixed : float
        Probability that the nearer of two beams across a jump in range, its spot half over the
        edge, returns something between the two ranges.
    jump : float
        Difference in m between neighbouring ranges that counts as a jump.
    missed : float
        Probability that a reading does not come back, whatever is there.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    model: str
    fov: float
    resolution: float
    rate: float
    max_range: float
    min_range: float
    step: float
    noise: float
    bias: float = 0.0
    mixed: float = 0.1
    jump: float = 0.3
    missed: float = 0.0

    def __post_init__(self):
        if not isinstance(self.model, str):
            raise ValueError(f"model must be a name, got {told(self.model)}")
        for name, (least, most) in RANGES.items():
            checked_number(name, getattr(self, name), least, most)
        if abs(1 / self.step - round(1 / self.step)) > 1e-6:
            raise ValueError(f"step must be a whole part of a metre, got {self.step:g}")
        if self.fov > 360 or abs(self.fov / self.resolution - round(self.fov / self.resolution)) > 1e-6:
            rule = "fov must be at most 360 degrees and a multiple of resolution"
            raise ValueError(f"{rule}, got {self.fov:g} and {self.resolution:g}")
        if not self.min_range < self.max_range:
            raise ValueError(f"min_range must be below max_range, got {self.min_range:g} and {self.max_range:g}")
        if self.model in MODELS:
            check_mode(self)

    @property
    def angles(self):
        """(B,) bearing of each beam in rad, the rightmost first."""
        steps = np.arange(round(self.fov / self.resolution) + 1)
        return np.deg2rad(steps * self.resolution - self.fov / 2)

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
        steps = round(1 / self.step)
        ranges = np.round(ranges * steps) / steps
        ranges = np.where(ranges > self.max_range, np.inf, ranges)
        return np.where(rng.random(len(ranges)) < self.missed, np.inf, ranges) if self.missed else ranges


def SickLMS200(fov=180, resolution=1.0, mode="mm", noise=0.005, **errors):
    """A SICK LMS 200, the paper's.

    Its data sheet gives a noise of 5 mm and allows a bias of 15 mm either way.

    Parameters
    ----------
    fov, resolution : float
        In degrees, a key of `SCAN_RATES`.
    mode : str
        "mm": steps of 1 mm to 8.191 m; "cm": steps of 1 cm to 81.91 m.
    noise : float
        In m.
    **errors
        More of `Scanner`: bias, mixed, jump, missed.

    Returns
    -------
    Scanner

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
    if (fov, resolution) not in SCAN_RATES:
        valid = ", ".join(f"{width}/{step:g}" for width, step in SCAN_RATES)
        raise ValueError(f"fov/resolution must be one of {valid} degrees, got {fov}/{resolution}")
    check_choice("mode", mode, MODES)
    step, farthest = MODES[mode]
    rate = SCAN_RATES[fov, resolution]
    return Scanner("SICK LMS 200", fov, resolution, rate, farthest, 0.2, step, noise, **errors)


def SickTiM571(noise=0.020, **errors):
    """A SICK TiM571: 270 degrees, a third of a degree, 15 scans/s, to 25 m.

    Its data sheet gives a statistical error of 20 mm and a systematic one of 60 mm either way.

    Parameters
    ----------
    noise : float
        In m.
    **errors
        More of `Scanner`: bias, mixed, jump, missed.

    Returns
    -------
    Scanner

    Examples
    --------
    >>> len(SickTiM571().angles)
    811
    """
    return Scanner("SICK TiM571", **DATA_SHEETS["SICK TiM571"], noise=noise, **errors)


def UTM30LX(noise=0.010, **errors):
    """A Hokuyo UTM-30LX: 270 degrees, a quarter of a degree, 40 scans/s, to 30 m.

    Its data sheet gives an accuracy of 30 mm, and 10 mm from reading to reading, both up to 10 m.

    Parameters
    ----------
    noise : float
        In m.
    **errors
        More of `Scanner`: bias, mixed, jump, missed.

    Returns
    -------
    Scanner

    Examples
    --------
    >>> len(UTM30LX().angles)
    1081
    """
    return Scanner("Hokuyo UTM-30LX", **DATA_SHEETS["Hokuyo UTM-30LX"], noise=noise, **errors)


MODELS = {"SICK LMS 200": SickLMS200, "SICK TiM571": SickTiM571, "Hokuyo UTM-30LX": UTM30LX}
"""The scanners on offer, by name."""


def check_mode(scanner):
    """Refuse a scanner of a model on offer in a mode that the model does not have."""
    if scanner.model == "SICK LMS 200":
        key, steps = (scanner.fov, scanner.resolution), {step: mode for mode, (step, _) in MODES.items()}
        if key not in SCAN_RATES or scanner.step not in steps:
            SickLMS200(*key, steps.get(scanner.step, f"{scanner.step:g} m"))  # it says what there is
        farthest = MODES[steps[scanner.step]][1]
        wanted = {"rate": SCAN_RATES[key], "max_range": farthest, "min_range": 0.2}
    else:
        wanted = DATA_SHEETS[scanner.model]
    for name, value in wanted.items():
        if abs(getattr(scanner, name) - value) > 1e-9:
            rule = f"{name} of a {scanner.model} must be {value:g} in this mode"
            raise ValueError(f"{rule}, got {getattr(scanner, name):g}")


def mix_pixels(distances, probability, jump, rng):
    """Distances in which some beams at a jump in range fall between the two ranges.

    Parameters
    ----------
    distances : (B,) float array
        In m, `inf` where there is nothing.
    probability, jump : float
        As `mixed` and `jump` of a `Scanner`.
    rng : numpy.random.Generator

    Returns
    -------
    (B,) float array
        In m.
    """
    steps = np.diff(np.where(np.isfinite(distances), distances, np.nan))
    chance, share = rng.random((2, len(steps)))
    mixed = np.flatnonzero((np.abs(steps) > jump) & (chance < probability))
    result = distances.copy()
    result[mixed + (steps[mixed] < 0)] += share[mixed] * np.abs(steps[mixed])
    return result
