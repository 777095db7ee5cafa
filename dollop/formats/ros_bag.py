"""Laser scans, odometry and maps from ROS 1 and ROS 2 bags, through rosbags (the extra `ros`)."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dollop.checks import FARTHEST, need
from dollop.formats.files import FormatError, check_cells, from_file
from dollop.formats.odometry import Odometry
from dollop.formats.ros_bag_bounds import bound_chunks, check_bag
from dollop.formats.ros_frames import Link, laser_poses, planar
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
from dollop.laser import LaserLog

__all__ = ["SUFFIXES", "is_bag", "read_log", "read_map", "read_odometry"]

SUFFIXES = (".bag", ".mcap", ".db3")
SCAN, ODOMETRY, GRID = (
    "sensor_msgs/msg/LaserScan",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/OccupancyGrid",
)
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
USUAL = {SCAN: None, ODOMETRY: "odom", GRID: "map"}
"""Which topic of a type is meant if there are several and none is named."""


def is_bag(path):
    """Whether a path is that of a bag, by its name.

    Parameters
    ----------
    path : str or Path
        A file, or the folder of a ROS 2 bag.

    Returns
    -------
    bool
    """
    path = Path(path)
    return path.is_dir() or path.name.endswith(SUFFIXES)


def read_log(path, topic=None):
    """Laser scans of one topic of a ROS bag.

    The poses are the laser's in the frame `map`, where `/tf` leads there; else by odometry, from
    `/tf` or from the messages of `/odom` and the fixed transform from the robot to its laser, at
    each scan's time; else all (0, 0, 0), the laser standing still. What is not in the frame `map`
    has a note. Ranges outside of the message's [range_min, range_max] and NaN become `inf`, as
    REP 117 (https://www.ros.org/reps/rep-0117.html) has it that they are no measurements, and so do
    readings that pile up (`dollop.formats.scans.no_return_from`). The time is that of the message's
    header.

    Parameters
    ----------
    path : str or Path
        The bag: of ROS 1 (`.bag`), of ROS 2 (its folder), or a single `.mcap` or `.db3` file.
    topic : str, optional
        Which LaserScan topic; needed only if there are several.

    Returns
    -------
    LaserLog
        Beam 0 rightmost, whichever way the laser turns or hangs; notes on poses, sensor and clock
        where there is something to say.

    Raises
    ------
    ImportError
        If rosbags is not installed.
    FormatError
        If the file is no bag, holds no such topic or several to choose from, more than a few scans
        are broken, or one has beams or ranges that no laser has; or if there are more than 100
        million readings, or what `dollop.formats.ros_bag_bounds` refuses.

    Warns
    -----
    UserWarning
        If broken scans were left out, or a note puts the log in doubt: if the clock is wrong
        (`dollop.formats.scans.usable_scans`), or the poses are guesses.
    """
    with _opened(path) as bag:
        scans, bad, frame = _scans(path, _messages(path, bag, SCAN, topic))
        links, odometry = _links(bag), _driven(bag)
    if not scans:
        raise FormatError(next(iter(bad.values()), "the topic holds no scan"), path)
    scans, t, notes = usable_scans(path, scans, bad)
    beams, ranges = scans[0].beams, np.array([scan.ranges for scan in scans])
    if np.array_equal(t, [scan.t for scan in scans]):
        poses, hangs, further = laser_poses(path, links, odometry, frame, t)
    else:
        text = "without a clock the scans have no place in the odometry: every pose is (0, 0, 0)"
        poses, hangs, further = np.zeros((len(t), 3)), False, (doubtful(path, "poses", text),)
    angles = -beams.angles if hangs else beams.angles
    order = slice(None, None, 1 if angles[-1] >= angles[0] else -1)
    ranges, angles, notes = ranges[:, order], angles[order], notes + further
    limit, further = no_return_from(path, ranges, angles, np.inf)
    ranges, limit = np.where(ranges < limit, ranges, np.inf), min(limit, beams.max_range)
    return from_file(path, LaserLog, t, ranges, angles, poses, limit, notes + further)


def read_odometry(path, topic=None):
    """Odometry of a robot, from one topic of a ROS bag (nav_msgs/Odometry).

    Parameters
    ----------
    path : str or Path
        The bag.
    topic : str, optional
        Which Odometry topic; by default `/odom`, or the only one.

    Returns
    -------
    Odometry
        Of the messages in order; the time is that of their headers.

    Raises
    ------
    ImportError
        If rosbags is not installed.
    FormatError
        If the file is no bag, holds no such topic or several to choose from, no message, or the
        clock is in order for less than half of them.

    Warns
    -----
    UserWarning
        If messages were left out.
    """
    with _opened(path) as bag:
        rows = [_odometry(message) for message in _messages(path, bag, ODOMETRY, topic)]
    if not rows:
        raise FormatError("the topic holds no odometry", path)
    rows = np.array(rows)
    broken = {row + 1: "a number that is none" for row in np.flatnonzero(np.isnan(rows).any(axis=1))}
    forgive(path, broken, len(rows), "messages of odometry")
    rows = rows[~np.isnan(rows).any(axis=1)]
    rows = rows[forgive_disorder(path, rows[:, 0], "Odometry")]
    return Odometry(rows[:, 0], rows[:, 1:4], rows[:, 5:7])


def read_map(path, topic=None):
    """Map of a ROS bag (nav_msgs/OccupancyGrid), the last one if it was sent several times.

    Parameters
    ----------
    path : str or Path
        The bag.
    topic : str, optional
        Which OccupancyGrid topic; by default `/map`, or the only one.

    Returns
    -------
    occupancy : (H, W) float array
        Probabilities, NaN where unknown; row 0 has the lowest y.
    origin : (float, float)
        Lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Raises
    ------
    ImportError
        If rosbags is not installed.
    FormatError
        If the file is no bag, holds no such topic or several to choose from, no message, or a map
        that is turned.
    """
    with _opened(path) as bag:
        grids = list(_messages(path, bag, GRID, topic))
    if not grids:
        raise FormatError("the topic holds no map", path)
    frame = grids[-1].info
    from_file(path, check_cells, frame.width, frame.height)
    if len(grids[-1].data) != frame.width * frame.height:
        rule = f"a map of {frame.width} x {frame.height} cells must hold as many"
        raise FormatError(f"{rule}, got {len(grids[-1].data)}", path)
    percent = np.array(grids[-1].data, float).reshape(frame.height, frame.width)
    x, y, turn, _ = planar(frame.origin.position, frame.origin.orientation)
    if not abs(turn) <= 1e-6:
        raise FormatError(f"a turned map is not supported, got {turn:g} rad", path)
    return np.where(percent < 0, np.nan, percent / 100), (x, y), float(frame.resolution)


@contextmanager
def _opened(path):
    """The bag, open; whatever rosbags' parsers happen to raise is the file's fault."""
    need("ros")
    check_bag(path)
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as bag:
            bound_chunks(bag.readers)
            yield bag
    except FormatError:
        raise
    except Exception as error:
        reason = str(error) or type(error).__name__
        raise FormatError(f"not a readable ROS bag ({reason})", path) from None


def _messages(path, bag, kind, topic):
    """Messages of the topic, or of the one that is meant."""
    topics = sorted({c.topic for c in bag.connections if c.msgtype == kind})
    chosen = _meant(topics, kind) if topic is None else topic
    if chosen not in topics:
        name = kind.rsplit("/", 1)[-1]
        problem = f"name one {name} topic" if topic is None else f"no {name} topic {topic!r}"
        raise FormatError(f"{problem}; the bag has {', '.join(topics) or 'none'}", path)
    return _all_of(bag, lambda c: c.msgtype == kind and c.topic == chosen)


def _meant(topics, kind):
    """The only topic of a kind, or the one with the usual name; None if that is not clear."""
    usual = [topic for topic in topics if topic.strip("/") == USUAL[kind]]
    return topics[0] if len(topics) == 1 else next(iter(usual), None)


def _all_of(bag, wanted):
    """All messages of the connections that are wanted; rosbags takes none for all."""
    connections = [c for c in bag.connections if wanted(c)]
    raw = bag.messages(connections) if connections else ()
    return (bag.deserialize(data, c.msgtype) for c, _, data in raw)


def _scans(path, messages):
    """Scans by their number, the reason of each that is broken, and the laser's frame."""
    scans, bad, frame, room = {}, {}, "", MAX_READINGS
    for number, message in enumerate(messages, 1):
        try:
            scans[number] = _scan(message)
        except ValueError as error:
            bad[number] = str(error)
        frame, room = message.header.frame_id if number == 1 else frame, room - len(message.ranges)
        if room < 0:
            raise FormatError(f"more than {MAX_READINGS} readings, the most that is read", path)
    return scans, bad, frame.strip("/")


def _scan(message):
    """A message as a scan, what is no measurement as `inf`."""
    with np.errstate(invalid="ignore"):  # a NaN that signals is no measurement either
        ranges = np.array(message.ranges, dtype=float)
    start, step, reach = map(float, (message.angle_min, message.angle_increment, message.range_max))
    reach = min(reach, FARTHEST)  # some drivers say as much as a float holds
    measured = (ranges >= message.range_min) & (ranges <= reach)
    beams = Beams(ranges.size, start, step, reach)
    check_beams(beams)
    return Scan(beams, np.where(measured, ranges, np.inf), (0, 0, 0), _seconds(message.header.stamp))


def _seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def _odometry(message):
    """Time, x, y, theta, up, forward and turning speed of a message, in s, m and rad."""
    pose, twist = message.pose.pose, message.twist.twist
    place = planar(pose.position, pose.orientation)
    return _seconds(message.header.stamp), *place, twist.linear.x, twist.angular.z


def _links(bag):
    """All transforms of the bag: each frame's link to its parent."""
    found = {}
    for message in _all_of(bag, lambda c: c.msgtype in TRANSFORMS):
        for each in message.transforms:
            names = each.child_frame_id.strip("/"), each.header.frame_id.strip("/")
            place = planar(each.transform.translation, each.transform.rotation)
            found.setdefault(names, []).append((_seconds(each.header.stamp), place))
    return {child: Link.of(parent, *zip(*rows, strict=True)) for (child, parent), rows in found.items()}


def _driven(bag):
    """The robot's frame and its link to the odometry's by the messages of odometry, None without."""
    topic = _meant(sorted({c.topic for c in bag.connections if c.msgtype == ODOMETRY}), ODOMETRY)
    messages = list(_all_of(bag, lambda c: c.msgtype == ODOMETRY and c.topic == topic))
    if not messages:
        return None
    rows = [_odometry(message) for message in messages]
    names = messages[0].child_frame_id.strip("/"), messages[0].header.frame_id.strip("/")
    return names[0], Link.of(names[1] or "odom", [row[0] for row in rows], [row[1:5] for row in rows])
