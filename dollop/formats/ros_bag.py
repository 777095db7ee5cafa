"""Laser scans from ROS 1 and ROS 2 bags, through rosbags (the extra `ros`)."""

import warnings
from collections import Counter
from pathlib import Path

import numpy as np

from dollop.formats.files import FormatError
from dollop.formats.scans import forgive, usable_clock
from dollop.laser import LaserLog

__all__ = ["read_log"]

SCAN_TYPE = "sensor_msgs/msg/LaserScan"
MOTION_TYPE = "nav_msgs/msg/Odometry"


def read_log(path, topic=None):
    """Laser scans of one topic of a ROS 1 bag (`.bag`), a ROS 2 bag (its folder), or a single
    `.mcap` or `.db3` file.

    The poses are all (0, 0, 0): a bag says where the laser is by a tree of transforms, of which
    only a localisation can make a pose in the world, so the laser is taken to stand still at the
    origin. If it moved, give the log the poses that your localisation found:
    `dataclasses.replace(log, poses=poses)`. Ranges outside [range_min, range_max] and NaN become
    `inf`, as REP 117 (https://www.ros.org/reps/rep-0117.html) has it that they are no measurements.
    The time is that of the message's header.

    Parameters
    ----------
    path : str or Path
        The bag.
    topic : str, optional
        Which LaserScan topic; needed only if there are several.

    Returns
    -------
    LaserLog

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
        If broken scans were left out, if the clock is wrong (`dollop.formats.scans.usable_clock`),
        or if the bag holds odometry or moving transforms (`/tf`), so that the robot may have moved.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ImportError('reading a ROS bag needs rosbags: pip install "dollop[ros]"') from None
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as bag:
            scans = _messages(path, bag, topic)
            moving = sorted(
                {c.topic for c in bag.connections if c.msgtype == MOTION_TYPE or c.topic.strip("/") == "tf"}
            )
    except FormatError:
        raise
    except Exception as error:  # rosbags meets a broken file with whatever its parsers happen to raise
        raise FormatError(f"not a readable ROS bag ({error or type(error).__name__})", path) from None
    if moving:
        text = (
            f"{', '.join(moving)} of the bag is not read and every pose is (0, 0, 0); if the robot moved, set the poses"
        )
        warnings.warn(f"{path}: {text} with dataclasses.replace(log, poses=poses)", stacklevel=3)
    return _log(path, scans)


def _messages(path, bag, topic):
    """All LaserScan messages of the topic, or of the only one there is."""
    connections = [c for c in bag.connections if c.msgtype == SCAN_TYPE]
    topics = sorted({c.topic for c in connections})
    if topic not in topics and (topic is not None or len(topics) != 1):
        problem = "name one LaserScan topic" if topic is None else f"no LaserScan topic {topic!r}"
        raise FormatError(f"{problem}; the bag has {', '.join(topics) or 'none'}", path)
    connections = [c for c in connections if topic in (None, c.topic)]
    return [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages(connections)]


def _log(path, scans):
    if not scans:
        raise FormatError("the topic holds no scan", path)
    kinds = [(len(s.ranges), s.angle_min, s.angle_increment, s.range_min, s.range_max) for s in scans]
    kind = Counter(kinds).most_common(1)[0][0]
    text = "beams (count, angle_min, angle_increment, range_min, range_max) are {}, most scans' are {}"
    odd = [(i, text.format(k, kind)) for i, k in enumerate(kinds, 1) if k != kind]
    forgive(path, odd, len(scans))
    scans = [scan for scan, k in zip(scans, kinds, strict=True) if k == kind]
    keep, t = usable_clock(path, np.array([s.header.stamp.sec + 1e-9 * s.header.stamp.nanosec for s in scans]))
    try:
        return _laser_log(t, np.array([scans[i].ranges for i in keep], dtype=float), *kind[1:])
    except ValueError as error:
        raise FormatError(str(error), path) from None


def _laser_log(t, ranges, start, step, range_min, range_max):
    """Beam 0 rightmost, whichever way the laser turns."""
    angles = start + step * np.arange(ranges.shape[1])
    ranges = np.where((ranges >= range_min) & (ranges <= range_max), ranges, np.inf)
    order = slice(None) if step > 0 else slice(None, None, -1)
    return LaserLog(t, ranges[:, order], angles[order], np.zeros((len(t), 3)), range_max)
