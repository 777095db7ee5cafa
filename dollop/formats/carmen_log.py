"""CARMEN's log files, those of the paper's toolkit [6]: laser scans and odometry.

The format follows CARMEN's sources (`writelog.c`, `readlog.c`, `laser_messages.h` of CARMEN 0.7). A
log is text, one message per line: name, contents, time of the message in s, host, time since the log
began.
"""

import gzip
import io
import math
import warnings
from collections import Counter
from contextlib import nullcontext
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dollop.checks import check_positive
from dollop.formats.files import FormatError, read_bytes, whole_file
from dollop.formats.scans import forgive, longest_rise, usable_clock
from dollop.laser import LaserLog
from dollop.pose import wrapped

__all__ = ["Odometry", "flaser_angles", "read_log", "read_odometry", "write_log"]

NOMINAL_MAX_RANGE = 80.0
"""What CARMEN takes for the maximum range of a laser in a FLASER line, in m (`readlog.c`)."""

FULL_SCALES = ((8.183, 8.191), (16.375, 16.383), (32.759, 32.767), (51.14, 51.16), (NOMINAL_MAX_RANGE, np.inf))
"""Readings in m that are a code and no distance: the last nine values of 13, 14 and 15 bits of 1 mm
(the error codes of the SICK LMS 200), 10 bits of 5 cm, and all from CARMEN's nominal maximum on (13
bits of 1 cm end at 81.91 m)."""

SICK_TYPES, UNKNOWN_TYPE = (0, 1), 99
"""`laser_type` of the SICK LMS and PLS, and of a laser CARMEN has no name for."""


class _Beams(NamedTuple):
    """What must not change within a log: beam count, first bearing and step in rad, stated maximum
    range, maker.
    """

    count: int
    start: float
    step: float
    max_range: float | None
    is_sick: bool

    def __str__(self):
        reach = "" if self.max_range is None else f" up to {self.max_range:g} m"
        return f"{self.count} beams from {self.start:.4g} rad, {self.step:.4g} rad apart{reach}"


class _Scan(NamedTuple):
    line: int
    beams: _Beams
    ranges: np.ndarray
    pose: list
    t: float


@dataclass(frozen=True, eq=False)
class Odometry:
    """What the wheels report.

    Attributes
    ----------
    t : (N,) float array
        Time in s, increasing.
    poses : (N, 3) float array
        Robot in the odometry's own frame: x, y in m, theta in rad, wrapped to (-pi, pi].
    velocities : (N, 2) float array
        Forward in m/s, turning in rad/s.
    """

    t: np.ndarray
    poses: np.ndarray
    velocities: np.ndarray

    def __repr__(self):
        return f"Odometry of {len(self)} messages in {np.ptp(self.t):.1f} s"

    def __len__(self):
        return len(self.t)


def flaser_angles(count):
    """Bearings of the beams of a FLASER line, which does not state them.

    CARMEN's reader guesses them from their number: 180 or 181 are 1 degree apart, 360 or 361 half a
    degree, 400 or 401 a quarter (100 degrees in all); the even counts lack the last beam; any other
    number spreads over 180 degrees (`carmen_laser_guess_fov`, `carmen_laser_guess_angle_increment`
    in `readlog.c`). The first beam is at -90 degrees. In a scan of 100 degrees it is at -50 here,
    where CARMEN leaves it at -90 too, which no such laser does.

    Parameters
    ----------
    count : int
        Readings in the line.

    Returns
    -------
    (count,) float array
        Radians, increasing.

    Examples
    --------
    >>> np.rad2deg(flaser_angles(180)[[0, -1]]).round(6).tolist(), np.rad2deg(flaser_angles(361)[[0, -1]]).tolist()
    ([-90.0, 89.0], [-90.0, 90.0])
    """
    beams = _flaser_beams(count)
    return beams.start + beams.step * np.arange(count)


def _flaser_beams(count):
    per_degree = {180: 1, 181: 1, 360: 2, 361: 2, 400: 4, 401: 4}.get(count)
    step = np.deg2rad(1 / per_degree if per_degree else 180 / max(count - 1, 1))
    return _Beams(count, np.deg2rad(-50 if per_degree == 4 else -90), step, None, True)


def read_log(path, max_range=None):
    """Laser scans of a CARMEN log, plain or gzipped.

    ROBOTLASER1 messages are read where there are any, since they state their own geometry, and
    FLASER messages otherwise; all other messages are passed over. The pose is the laser's. A
    reading at or beyond the maximum range, a reading that is an error code of a SICK
    (`FULL_SCALES`), and a reading of zero become `inf`: nothing came back.

    Parameters
    ----------
    path : str or Path
        The log.
    max_range : float, optional
        Range in m from which on a reading means that nothing came back; by default what the message
        states, or for FLASER, which states nothing, the full scale that the largest reading of the
        log belongs to.

    Returns
    -------
    LaserLog

    Raises
    ------
    FormatError
        If the file is no CARMEN log, holds no scan, or more than a few scans are broken
        (`dollop.formats.scans.forgive`).
    ValueError
        If `max_range` is not positive and finite.

    Warns
    -----
    UserWarning
        If broken scans were left out, if the clock is wrong (`dollop.formats.scans.usable_clock`),
        or if so many readings of FLASER messages equal the largest one that it may be a full scale
        that is not known here.
    """
    if max_range is not None:
        check_positive("max_range", max_range)
    scans, bad = _parse_scans(path)
    beams = Counter(scan.beams for scan in scans).most_common(1)[0][0]
    odd = [(s.line, f"{s.beams}, which differs from most scans' {beams}") for s in scans if s.beams != beams]
    forgive(path, sorted(bad + odd), len(scans) + len(bad))
    scans = [scan for scan in scans if scan.beams == beams]
    keep, t = usable_clock(path, np.array([scan.t for scan in scans]))
    ranges = np.array([scans[i].ranges for i in keep])
    limit = _no_return_from(path, ranges, beams) if max_range is None else max_range
    ranges = np.where((ranges >= limit - 1e-9) | (ranges == 0), np.inf, ranges)
    angles, poses = beams.start + beams.step * np.arange(beams.count), [scans[i].pose for i in keep]
    try:
        return LaserLog(t, ranges, angles, poses, limit)
    except ValueError as error:
        raise FormatError(str(error), path) from None


def _no_return_from(path, ranges, beams):
    """Smallest reading that is no distance."""
    largest = ranges.max() if beams.max_range is None else beams.max_range
    code = next(low for low, high in FULL_SCALES if largest <= high + 1e-9)
    if beams.max_range is not None:
        return min(beams.max_range, code) if beams.is_sick else beams.max_range
    share = (ranges == largest).mean()
    if largest < code and ranges.size > 1000 and share > 0.02:
        text = f"{share:.0%} of the readings are exactly {largest} m, the largest; if that means that nothing came back"
        warnings.warn(
            f"{path}: {text}, read it with dollop.formats.carmen_log.read_log(path, max_range={largest})", stacklevel=4
        )
    return code


def _parse_scans(path):
    """All good scans of the preferred message, and line and reason of the broken ones."""
    found = {b"ROBOTLASER1": ([], []), b"FLASER": ([], [])}
    content = read_bytes(path)
    if b"\0" in content[:4096]:
        raise FormatError("binary data, where a CARMEN log is text", path)
    for number, line in enumerate(io.BytesIO(content), 1):
        name = line.split(None, 1)[:1]
        if name and name[0] in found:
            good, bad = found[name[0]]
            try:
                good.append(_PARSERS[name[0]](number, line.split()))
            except ValueError as error:
                bad.append((number, str(error)))
    for good, bad in found.values():
        if good:
            return good, bad
        if bad:
            raise FormatError(f"{bad[0][1]} (no scan of {len(bad)} can be read)", path, bad[0][0])
    raise FormatError("no FLASER or ROBOTLASER1 message in the file", path)


def _parse_flaser(number, fields):
    """`FLASER count [ranges] laser_x laser_y laser_theta robot_x robot_y robot_theta time host
    logger_time`.
    """
    count = _count(fields, 1)
    values = _numbers(fields, 2, count + 7)
    _check_ending(fields, 2 + count + 7)
    return _Scan(number, _flaser_beams(count), _distances(values[:count]), values[count : count + 3], values[-1])


def _parse_robotlaser(number, fields):
    """`ROBOTLASER1 type start fov step max_range accuracy remission_mode count [ranges] count
    [remissions]`, then laser pose (3), robot pose (3), speeds (2), safety distances (2), turn axis,
    time, host, logger_time."""
    kind, start, _, step, limit = _numbers(fields, 1, 5)
    count = _count(fields, 8)
    rest = 10 + count + _count(fields, 9 + count, least=0)
    ranges, tail = _numbers(fields, 9, count), _numbers(fields, rest, 12)
    _check_ending(fields, rest + 12)
    if not (step > 0 and limit > 0):
        raise ValueError(f"angular resolution and maximum range must be positive, got {step} and {limit}")
    return _Scan(number, _Beams(count, start, step, limit, kind in SICK_TYPES), _distances(ranges), tail[:3], tail[-1])


_PARSERS = {b"FLASER": _parse_flaser, b"ROBOTLASER1": _parse_robotlaser}


def _count(fields, place, least=1):
    if place >= len(fields):
        raise ValueError(f"too few numbers: {len(fields)} fields in the line, at least {place + 1} needed")
    try:
        count = int(fields[place])
    except ValueError:
        raise ValueError(f"a number of readings must be a whole number, got {_shown(fields[place])}") from None
    if count < least:
        raise ValueError(f"a number of readings must be at least {least}, got {count}")
    return count


def _numbers(fields, first, count):
    """`count` finite numbers, from field `first` on."""
    values = []
    try:
        # extend and not a list: what it has taken before an error says which field is wrong.
        values.extend(map(float, fields[first : first + count]))
    except ValueError:
        raise ValueError(f"expected a number, got {_shown(fields[first + len(values)])}") from None
    if len(values) < count:
        raise ValueError(f"too few numbers: {len(fields)} fields in the line, at least {first + count} needed")
    if not all(map(math.isfinite, values)):
        raise ValueError(f"every number must be finite, got {next(v for v in values if not math.isfinite(v))}")
    return values


def _shown(field):
    """The beginning of a field of a line, for a message."""
    return repr(field[:20].decode("utf-8", "replace"))


def _check_ending(fields, used):
    """After the time come the host and, in all but the oldest logs, the logger's own time."""
    if len(fields) - used not in (1, 2):
        raise ValueError(f"{len(fields)} fields in the line, expected {used + 1} or {used + 2}")


def _distances(values):
    ranges = np.array(values)
    if ranges.min() < 0:
        raise ValueError(f"a range must not be negative, got {ranges.min()}")
    return ranges


def write_log(path, log):
    """Write scans as a CARMEN log of ROBOTLASER1 messages, which state the laser's geometry;
    gzipped if named `.gz`.

    Ranges are written to 1 mm, poses and times to six decimals, as CARMEN does; `inf` becomes the
    maximum range. The log holds the laser only: its pose stands for the robot's too.

    Parameters
    ----------
    path : str or Path
        The file; it appears whole or not at all.
    log : LaserLog
        The scans; their beams must be evenly spaced.

    Raises
    ------
    ValueError
        If the beams are not evenly spaced, which CARMEN cannot express.
    """
    count = log.angles.size
    fov = log.angles[-1] - log.angles[0]
    step = fov / (count - 1) if count > 1 else np.pi
    uneven = np.abs(log.angles - log.angles[0] - step * np.arange(count)).max()
    if uneven > 1e-3 * step:
        raise ValueError(f"the beams of a CARMEN log must be evenly spaced, these are up to {uneven:.3g} rad off")
    laser = " ".join(repr(float(value)) for value in (log.angles[0], fov, step, log.max_range))
    head = f"ROBOTLASER1 {UNKNOWN_TYPE} {laser} 0.001 0 {count} "
    with whole_file(path) as stream, _packed(stream, path) as text:
        text.write(b"# CARMEN Logfile\n# distances in m, angles in rad, times in s\n")
        for t, ranges, pose in zip(log.t, _written_ranges(log), log.poses, strict=True):
            place = "".join([f"{value:.6f} " for value in pose.tolist()])
            numbers = " ".join([f"{value:.3f}" for value in ranges.tolist()])
            text.write(f"{head}{numbers} 0 {place * 2}0 0 0 0 0 {t:.6f} dollop {t - log.t[0]:.6f}\n".encode())


def _written_ranges(log):
    """Ranges that keep their meaning when read back: a distance stays in (0, max_range), nothing
    else reaches it.
    """
    below = (np.ceil(log.max_range * 1000 - 1e-6) - 1) / 1000
    return np.where(np.isinf(log.ranges), below + 0.001, np.clip(log.ranges, 0.001, below))


def _packed(stream, path):
    """The stream itself, or a gzip stream without name and time, so that the same log gives the
    same bytes.
    """
    if str(path).endswith(".gz"):
        return gzip.GzipFile(filename="", fileobj=stream, mode="wb", mtime=0)
    return nullcontext(stream)


def read_odometry(path):
    """ODOM messages of a CARMEN log, plain or gzipped.

    Messages that the clock puts out of order, as loggers write them now and then, are left out with
    a warning.

    Parameters
    ----------
    path : str or Path
        The log.

    Returns
    -------
    Odometry

    Raises
    ------
    FormatError
        If there is no ODOM message, more than a few are broken, or the clock is in order for less
        than half of them: odometry without a time cannot be set against anything.
    """
    rows, bad = [], []
    for number, line in enumerate(io.BytesIO(read_bytes(path)), 1):
        if line.startswith(b"ODOM "):
            try:
                rows.append(_parse_odometry(line.split()))
            except ValueError as error:
                bad.append((number, str(error)))
    if not rows:
        raise FormatError("no readable ODOM message in the file", path)
    forgive(path, bad, len(rows) + len(bad))
    rows = np.array(rows)
    keep = longest_rise(rows[:, 6])
    if 2 * len(keep) < len(rows):
        raise FormatError(f"the clock is useless: {len(rows) - len(keep)} of {len(rows)} ODOM out of order", path)
    if len(keep) < len(rows):
        text = f"left out {len(rows) - len(keep)} of {len(rows)} ODOM messages, which the clock puts out of order"
        warnings.warn(f"{path}: {text}", stacklevel=2)
    rows[:, 2] = wrapped(rows[:, 2])
    return Odometry(rows[keep, 6], rows[keep, :3], rows[keep, 3:5])


def _parse_odometry(fields):
    """`ODOM x y theta tv rv accel time host logger_time`."""
    _check_ending(fields, 8)
    return _numbers(fields, 1, 7)
