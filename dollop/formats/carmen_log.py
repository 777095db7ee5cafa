"""CARMEN's log files, those of the paper's toolkit [6]: laser scans and odometry.

The format follows CARMEN's sources (`writelog.c`, `readlog.c`, `laser_messages.h` of CARMEN 0.7).
A log is text, one message per line: name, contents, time of the message in s, host, time since the
log began.
"""

import os
from functools import lru_cache, partial

import numpy as np

from dollop.checks import FARTHEST, check_positive, checked_number, told
from dollop.formats.files import MAX_LINES, FormatError, from_file, read_lines
from dollop.formats.kinds import CARMEN_LOG
from dollop.formats.odometry import Odometry
from dollop.formats.scans import (
    MAX_READINGS,
    Beams,
    Scan,
    check_beams,
    doubtful,
    forgive,
    forgive_disorder,
    no_return_from,
    usable_scans,
)
from dollop.formats.writing import packed, whole_file
from dollop.laser import LaserLog
from dollop.pose import wrapped

__all__ = ["read_log", "read_odometry", "write_log"]

FULL_SCALES = ((8.183, 8.191), (16.375, 16.383), (32.759, 32.767), (51.14, 51.16), (80.0, np.inf))
"""Readings in m that are a code and no distance: the last nine values of 13, 14 and 15 bits of 1 mm
(the error codes of the SICK LMS 200), 10 bits of 5 cm, and all from 80 m on, which CARMEN takes for
the maximum range of a FLASER line (`readlog.c`; 13 bits of 1 cm end at 81.91 m)."""

PER_DEGREE = {180: 1, 181: 1, 360: 2, 361: 2, 400: 4, 401: 4}
"""Beams per degree by the numbers of beams that CARMEN's reader knows."""

LARGEST = 1e10
"""No number of a message is larger: seconds since 1970 are as many in the year 2286."""

MOST_PACKED, UNPACKED = 100, 1 << 20
"""How many times the size of a file the lines may be, unpacked, that are passed over, and bytes from
which on that counts: what is read has a bound of its own."""

SICK_TYPES, UNKNOWN_TYPE = (0, 1), 99
"""`laser_type` of the SICK LMS and PLS, and of a laser CARMEN has no name for."""


def read_log(path, max_range=None, fov=None):
    """Laser scans of a CARMEN log, plain or gzipped.

    ROBOTLASER1 messages are read where there are any, since they state their own geometry, and
    FLASER messages otherwise, as in CARMEN (`readlog.c`); all other messages are passed over. The
    pose is the laser's. A reading at or beyond the maximum range, a reading that is an error code
    of a SICK (`FULL_SCALES`), and a reading of zero become `inf`: nothing came back.

    Parameters
    ----------
    path : str or Path
        The log.
    max_range : float, optional
        Range in m from which on a reading means that nothing came back; by default what the message
        states, or for FLASER, which states nothing, the full scale that the largest reading of the
        log belongs to; or less, where readings pile up (`dollop.formats.scans.no_return_from`).
    fov : float, optional
        Field of view in rad of a log of FLASER messages, which do not state it: the beams are spread
        evenly over it, the first at -fov/2 and the last at +fov/2. By default that of CARMEN's
        reader, which goes by the number of beams; of a number that CARMEN does not know it is a
        guess.

    Returns
    -------
    LaserLog
        `inf` where nothing came back; notes on sensor and clock where there is something to say.

    Raises
    ------
    FormatError
        If the file is no CARMEN log, holds no scan, more than a few scans are broken
        (`dollop.formats.scans.forgive`), or there is more of it than is read: 100 million
        readings, 36,000 beams in a scan, and what `dollop.formats.files.read_lines` says.
    ValueError
        If `max_range` is not positive and finite, if `fov` is not an angle up to a full turn, or is
        told of messages that state their own.

    Warns
    -----
    UserWarning
        If broken scans were left out, or a note puts the log in doubt: if the clock is wrong
        (`dollop.formats.scans.usable_scans`), if the field of view is a guess, or if readings pile
        up that may be distances.
    """
    if max_range is not None:
        check_positive("max_range", max_range)
    if fov is not None:
        checked_number("fov", fov, 1e-6, 2 * np.pi)
    scans, t, notes = usable_scans(path, *_scans(path, fov))
    beams, ranges = scans[0].beams, np.array([scan.ranges for scan in scans])
    if fov is None:
        notes += _field_notes(path, beams, ranges)
    limit = max_range
    if limit is None:
        limit, further = no_return_from(path, ranges, beams.angles, _known_limit(ranges, beams))
        notes += further
    ranges = np.where((ranges >= limit - 1e-9) | (ranges == 0), np.inf, ranges)
    poses = [scan.pose for scan in scans]
    return from_file(path, LaserLog, t, ranges, beams.angles, poses, limit, notes)


def _known_limit(ranges, beams):
    """Smallest reading that is no distance, by what the file states and by the full scales."""
    reach = beams.max_range or ranges.max()
    code = next(low for low, high in FULL_SCALES if reach <= high + 1e-9)
    if beams.max_range is None:
        return code
    return min(beams.max_range, code) if beams.is_sick else beams.max_range


def _field_notes(path, beams, ranges):
    """Notes on a field of view that the file does not state, if it is in doubt."""
    if beams.max_range is not None:  # a message that states one states both
        return ()
    field = f"{np.degrees(beams.angles[-1] - beams.angles[0]):.4g} degrees"
    remedy = "say it if they do not: read_log(path, fov=...) in rad, --fov in degrees"
    if beams.count not in PER_DEGREE:
        text = f"{beams.count} beams are taken to spread over {field}, which the file does not state; {remedy}"
        return (doubtful(path, "sensor", text),)
    if beams.count in (360, 361) and _closes(ranges):
        text = f"{beams.count} beams are taken to spread over {field}, but the first and the last see the same"
        return (doubtful(path, "sensor", f"{text}, as those of a full turn do; {remedy}"),)
    return ()


def _closes(ranges):
    """Whether the first beam and the last one read alike, as beams beside each other do."""
    steps = np.abs(np.diff(ranges, axis=1, append=ranges[:, :1]))
    return np.median(steps[:, -1]) <= 2 * np.median(steps[:, :-1])


def _scans(path, fov):
    """All good scans of the preferred message by their line, and the reason of the broken ones."""
    flaser = partial(_parse_flaser, fov=fov)
    robot, plain = _messages(path, {b"ROBOTLASER1": _parse_robotlaser, b"FLASER": flaser})
    if robot[0] and fov is not None:
        raise ValueError(f"{path}: ROBOTLASER1 messages state their field of view, got fov={fov:g}")
    for good, bad in (robot, plain):
        if good:
            return good, bad
        forgive(path, bad, len(bad))  # which it refuses, if there is any
    raise FormatError("no FLASER or ROBOTLASER1 message in the file", path)


def _messages(path, parsers):
    """What each good message holds, by its line, and the reason of each broken one, for each name.

    Of several names the first that a good message has is read from there on, and no other.
    """
    found = {name: ({}, {}) for name in parsers}
    names, room, other = tuple(found), MAX_READINGS, UNPACKED + MOST_PACKED * os.path.getsize(path)
    for number, line in enumerate(read_lines(path), 1):
        if not line.lstrip().startswith(names):
            other -= len(line)
            if other < 0:
                rule = f"{MOST_PACKED} times the size of the file is the most that is read"
                raise FormatError(f"lines that are passed over: {rule}", path, number)
            continue
        fields = line.replace(b"_", b"__").split()  # of one within a number Python is tolerant
        name = fields[0]
        if name not in names:
            continue
        good, bad = found[name]
        try:
            good[number] = parsers[name](fields)
            names, room = names[: names.index(name) + 1], room - len(fields)
        except ValueError as error:
            bad[number] = str(error)[:200].replace("__", "_")  # as long as what it repeats
        if len(bad) > MAX_LINES // 100:  # more than are forgiven, however many follow
            break
        if room < 0:
            rule = f"more than {MAX_READINGS} readings, the most that is read"
            raise FormatError(rule, path, number)
    return found.values()


def _parse_flaser(fields, fov=None):
    """`FLASER count [ranges] laser_x laser_y laser_theta robot_x robot_y robot_theta time host
    logger_time`.
    """
    count = _count(fields, 1)
    _check_ending(fields, 9 + count)
    beams = _flaser_beams(count, fov)
    return _scan(beams, fields[2 : 2 + count], _numbers(fields[2 + count : 9 + count]))


@lru_cache(maxsize=16)
def _flaser_beams(count, fov=None):
    """Beams of a FLASER line, which does not state their bearings, over `fov` in rad if it is told.

    CARMEN's reader guesses them from their number: 180 or 181 are 1 degree apart, 360 or 361 half a
    degree, 400 or 401 a quarter (100 degrees in all); the even counts lack the last beam; any other
    number spreads over 180 degrees (`carmen_laser_guess_fov`, `carmen_laser_guess_angle_increment`
    in `readlog.c`). The first beam is at -90 degrees. In a scan of 100 degrees it is at -50 here,
    where CARMEN leaves it at -90 too, which no such laser does.
    """
    per_degree = PER_DEGREE.get(count)
    if fov is not None:
        step = fov / max(count - 1, 1)
        beams = Beams(count, -step * (count - 1) / 2, step, None, is_sick=True)
    else:
        step = np.deg2rad(1 / per_degree if per_degree else 180 / max(count - 1, 1))
        beams = Beams(count, np.deg2rad(-50 if per_degree == 4 else -90), step, None, is_sick=True)
    check_beams(beams)
    return beams


def _parse_robotlaser(fields):
    """`ROBOTLASER1 type start fov step max_range accuracy remission_mode count [ranges] count
    [remissions]`, then laser pose (3), robot pose (3), speeds (2), safety distances (2), turn axis,
    time, host, logger_time.
    """
    count = _count(fields, 8)
    rest = 10 + count + _count(fields, 9 + count, least=0)
    _check_ending(fields, rest + 12)
    kind, start, _, step, limit, *ending = _numbers(fields[1:6] + fields[rest : rest + 12])
    return _scan(_robotlaser_beams(count, start, step, limit, kind), fields[9 : 9 + count], ending)


@lru_cache(maxsize=16)
def _robotlaser_beams(count, start, step, limit, kind):
    """Beams of a ROBOTLASER1 line, which are those of the line before."""
    check_positive("an angular resolution", step)
    check_positive("a maximum range", limit)
    beams = Beams(count, start, step, limit, kind in SICK_TYPES)
    check_beams(beams)
    return beams


def _scan(beams, ranges, ending):
    """The scan of a message that ends with the laser's pose, what does not matter, and the time."""
    ranges = np.array(list(map(float, ranges)))
    if not (np.minimum.reduce(ranges) >= 0 and np.maximum.reduce(ranges) <= FARTHEST):
        wrong = next(each for each in ranges if not 0 <= each <= FARTHEST)
        rule = f"a range must be finite, not negative and within {FARTHEST:g} m"
        raise ValueError(f"{rule}, got {wrong:g}")
    if max(map(abs, ending[:3])) > FARTHEST:
        raise ValueError(f"a pose must be within {FARTHEST:g} m, got {ending[:3]}")
    return Scan(beams, ranges, ending[:3], ending[-1])


def _parse_odometry(fields):
    """`ODOM x y theta tv rv accel time host logger_time`."""
    _check_ending(fields, 8)
    return _numbers(fields[1:8])


def _count(fields, place, least=1):
    """The number of readings that follow; 0 if the line ends before."""
    text = fields[place] if place < len(fields) else b"0"
    if len(text) > 9:
        raise ValueError(f"a number of readings must have at most nine digits, got {told(text)}")
    count = int(text)
    if count < least:
        raise ValueError(f"a number of readings must be at least {least}, got {count}")
    return count


def _check_ending(fields, used):
    """After the time come the host and, in all but the oldest logs, the logger's own time."""
    if len(fields) - used not in (1, 2):
        raise ValueError(f"{len(fields)} fields in the line, expected {used + 1} or {used + 2}")


def _numbers(fields):
    """Numbers that are none too large for metres or seconds, a list."""
    numbers = list(map(float, fields))
    if not all(map(LARGEST.__ge__, map(abs, numbers))):
        wrong = next(each for each in numbers if not abs(each) <= LARGEST)
        rule = f"the numbers of a message must be finite, and within {LARGEST:g}"
        raise ValueError(f"{rule}, got {wrong:g}")
    return numbers


def write_log(path, log):
    """Write scans as a CARMEN log of ROBOTLASER1 messages, which state the laser's geometry.

    Ranges are written to 1 mm and times to 1 us, as CARMEN does (`writelog.c`), but a time that is
    finer, as those of ROS are, in full: it is read back to the last digit. So are poses, for a
    microradian takes a beam along a cell's border to its other side. `inf` becomes the maximum
    range. The log holds the laser only: its pose stands for the robot's too.

    Parameters
    ----------
    path : str or Path
        The file, gzipped if named `.gz`; it appears whole or not at all.
    log : LaserLog
        The scans; their beams must be evenly spaced.

    Raises
    ------
    ValueError
        If the beams are not evenly spaced, which CARMEN cannot express.

    Examples
    --------
    What is read back is what was written, to the format's precision.

    >>> import tempfile
    >>> log = LaserLog([7.5], [[1.2345, np.inf]], [-0.5, 0.5], [[1.0, 2.0, 3.0]], max_range=8.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_log(f"{folder}/a.log.gz", log)
    ...     read_log(f"{folder}/a.log.gz").ranges.tolist()
    [[1.234, inf]]
    """
    count = log.angles.size
    fov = log.angles[-1] - log.angles[0]
    step = fov / (count - 1) if count > 1 else np.pi
    uneven = np.abs(log.angles - log.angles[0] - step * np.arange(count)).max()
    if uneven > 1e-3 * step:
        raise ValueError(f"the beams of a CARMEN log must be evenly spaced, these are up to {uneven:.3g} rad off")
    laser = " ".join(repr(float(value)) for value in (log.angles[0], fov, step, log.max_range))
    head = f"ROBOTLASER1 {UNKNOWN_TYPE} {laser} 0.001 0 {count}"
    with whole_file(path, kind=CARMEN_LOG) as stream, packed(stream, path) as text:
        text.write(b"# CARMEN Logfile\n# distances in m, angles in rad, times in s\n")
        for t, ranges, pose in zip(log.t.tolist(), _written_ranges(log), log.poses, strict=True):
            numbers = " ".join([f"{value:.3f}" for value in ranges.tolist()])
            place = " ".join(map(repr, pose.tolist()))
            ending = f"{place} {place} 0 0 0 0 0 {_written_time(t)} dollop {t - log.t[0]:.6f}"
            text.write(f"{head} {numbers} 0 {ending}\n".encode())


def _written_time(t):
    """A time in s as CARMEN writes it, or with as many digits as it takes to be read back."""
    text = f"{t:.6f}"
    return text if float(text) == t else repr(t)


def _written_ranges(log):
    """Ranges that keep their meaning: distances stay in (0, max_range), nothing else reaches it."""
    below = (np.ceil(log.max_range * 1000 - 1e-6) - 1) / 1000
    return np.where(np.isinf(log.ranges), below + 0.001, np.clip(log.ranges, 0.001, below))


def read_odometry(path):
    """ODOM messages of a CARMEN log, plain or gzipped (`writelog.c`).

    Messages that the clock puts out of order, as loggers write them now and then, are left out with
    a warning.

    Parameters
    ----------
    path : str or Path
        The log.

    Returns
    -------
    Odometry
        Of the messages in order.

    Raises
    ------
    FormatError
        If there is no ODOM message, more than a few are broken, or the clock is in order for less
        than half of them: odometry without a time cannot be set against anything.

    Warns
    -----
    UserWarning
        If messages were left out.
    """
    ((good, bad),) = _messages(path, {b"ODOM": _parse_odometry})
    forgive(path, bad, len(good) + len(bad))
    if not good:
        raise FormatError("no readable ODOM message in the file", path)
    rows = np.array(list(good.values()))
    rows = rows[forgive_disorder(path, rows[:, 6], "ODOM")]
    rows[:, 2] = wrapped(rows[:, 2])
    return Odometry(rows[:, 6], rows[:, :3], rows[:, 3:5])
