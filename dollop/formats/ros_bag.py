"""Laser scans from ROS 1 and ROS 2 bags, through rosbags (the extra `ros`)."""

from pathlib import Path

import numpy as np

from dollop.checks import need
from dollop.formats.files import FormatError, from_file, warn_of
from dollop.formats.scans import Beams, Scan, no_return_from, usable_scans
from dollop.laser import LaserLog

__all__ = ["read_log"]

SCAN_TYPE = "sensor_msgs/msg/LaserScan"
MOVING = {"nav_msgs/msg/Odometry", "tf"}
"""A type of messages and a topic that tell of a robot's motion."""


def read_log(path, topic=None):
    """Laser scans of one topic of a ROS bag.

    The poses are all (0, 0, 0): a bag says where the laser is by a tree of transforms, of which
    only a localisation can make a pose in the world, so the laser is taken to stand still at the
    origin. If it moved, give the log the poses that your localisation found:
    `dataclasses.replace(log, poses=poses)`. Ranges outside of the message's [range_min, range_max]
    and NaN become `inf`, as REP 117 (https://www.ros.org/reps/rep-0117.html) has it that they are
    no measurements, and so do readings that pile up (`dollop.formats.scans.no_return_from`).
    The time is that of the message's header.

    Parameters
    ----------
    path : str or Path
        The bag: of ROS 1 (`.bag`), of ROS 2 (its folder), or a single `.mcap` or `.db3` file.
    topic : str, optional
        Which LaserScan topic; needed only if there are several.

    Returns
    -------
    LaserLog
        Beam 0 rightmost, whichever way the laser turns.

    Raises
    ------
    ImportError
        If rosbags is not installed.
    FormatError
        If the file is no bag, holds no such topic or several to choose from, or more than a few
        scans are broken.

    Warns
    -----
    UserWarning
        If broken scans were left out, if the clock is wrong (`dollop.formats.scans.usable_scans`),
        or if the bag holds odometry or moving transforms (`/tf`), so that the robot may have moved.
    """
    need("ros")
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as bag:
            scans = _scans(path, bag, topic)
            moving = {c.topic for c in bag.connections if MOVING & {c.msgtype, c.topic.strip("/")}}
    except FormatError:
        raise
    except Exception as error:  # whatever rosbags' parsers happen to raise
        raise FormatError(f"not a readable ROS bag ({error or type(error).__name__})", path) from None
    if moving:
        unread = f"{', '.join(sorted(moving))} of the bag is not read and every pose is (0, 0, 0)"
        remedy = "if the robot moved, set the poses with dataclasses.replace(log, poses=poses)"
        warn_of(path, f"{unread}; {remedy}")
    if not scans:
        raise FormatError("the topic holds no scan", path)
    scans, t, notes = usable_scans(path, dict(enumerate(scans, 1)), {})
    beams, ranges = scans[0].beams, np.array([scan.ranges for scan in scans])
    order = slice(None, None, 1 if beams.step > 0 else -1)
    ranges, angles, poses = ranges[:, order], beams.angles[order], [scan.pose for scan in scans]
    limit, further = no_return_from(path, ranges, angles, np.inf)
    ranges, limit = np.where(ranges < limit, ranges, np.inf), min(limit, beams.max_range)
    return from_file(path, LaserLog, t, ranges, angles, poses, limit, notes + further)


def _scans(path, bag, topic):
    """All scans of the topic, or of the only one there is."""
    connections = [c for c in bag.connections if c.msgtype == SCAN_TYPE]
    topics = sorted({c.topic for c in connections})
    if topic not in topics and (topic is not None or len(topics) != 1):
        problem = "name one LaserScan topic" if topic is None else f"no LaserScan topic {topic!r}"
        raise FormatError(f"{problem}; the bag has {', '.join(topics) or 'none'}", path)
    connections = [c for c in connections if topic in (None, c.topic)]
    messages = (bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages(connections))
    return [_scan(message) for message in messages]


def _scan(message):
    """A message as a scan, what is no measurement as `inf`."""
    ranges = np.array(message.ranges, dtype=float)
    measured = (ranges >= message.range_min) & (ranges <= message.range_max)
    beams = Beams(ranges.size, message.angle_min, message.angle_increment, message.range_max)
    t = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    return Scan(beams, np.where(measured, ranges, np.inf), (0, 0, 0), t)
