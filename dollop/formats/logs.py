"""Laser logs and odometry by file name: CARMEN or ROS."""

from pathlib import Path

from dollop.checks import checked_record, told
from dollop.formats import carmen_log, ros_bag
from dollop.formats.files import FormatError
from dollop.formats.writing import checked_path
from dollop.laser import LaserLog

__all__ = ["read_log", "read_odometry", "write_log"]

CARMEN_SUFFIXES = (".log", ".log.gz", ".clf", ".clf.gz")


def read_log(path, topic=None, fov=None):
    """Read a laser log, in the format that its name says.

    Parameters
    ----------
    path : str or Path
        `.log`, `.clf`, packed (`.gz`) or not: a CARMEN log (`dollop.formats.carmen_log.read_log`);
        `.bag`, `.mcap`, `.db3` or the folder of a ROS 2 bag: a ROS bag
        (`dollop.formats.ros_bag.read_log`, which needs the extra `ros`). A bag's poses are those of
        its transforms or its odometry; if they drift, `dollop.localise` finds those on a map.
    topic : str, optional
        Which topic of a ROS bag; needed only if several carry laser scans.
    fov : float, optional
        Field of view in rad, for files that do not state it: those with FLASER lines of CARMEN. The
        first beam is at -fov/2, the last at +fov/2. By default what CARMEN takes it for.

    Returns
    -------
    LaserLog
        `inf` where nothing came back, beam 0 rightmost; its notes say what had to be guessed.

    Raises
    ------
    FormatError
        If the file is not what its name says, or the name says nothing.
    ValueError
        If a topic is asked of a CARMEN log, which has none, or a field of view is told of a file that
        states it.
    FileNotFoundError
        If there is no such file.
    """
    if not _is_carmen(path, topic):
        if fov is not None:
            raise ValueError(f"{path}: a ROS bag states its field of view, got fov={fov!r}")
        return ros_bag.read_log(path, topic)
    return carmen_log.read_log(path, fov=fov)


def read_odometry(path, topic=None):
    """Read what the wheels of a robot report, in the format that the name says.

    Parameters
    ----------
    path : str or Path
        As in `read_log`: a CARMEN log, of which the ODOM messages are read
        (`dollop.formats.carmen_log.read_odometry`), or a ROS bag with nav_msgs/Odometry
        (`dollop.formats.ros_bag.read_odometry`).
    topic : str, optional
        Which topic of a ROS bag; by default `/odom`, or the only one.

    Returns
    -------
    Odometry
        Times, poses of the robot in the odometry's own frame, and velocities.

    Raises
    ------
    FormatError
        If the file is not what its name says, holds no odometry, or none with a usable clock.
    ValueError
        If a topic is asked of a CARMEN log, which has none.
    FileNotFoundError
        If there is no such file.
    """
    if not _is_carmen(path, topic):
        return ros_bag.read_odometry(path, topic)
    return carmen_log.read_odometry(path)


def _is_carmen(path, topic):
    """Whether a file that is there is a CARMEN log, which has no topics, and not a bag."""
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"no such file: {path}")
    if ros_bag.is_bag(path):
        return False
    _check_is_carmen(path)
    if topic is not None:
        raise ValueError(f"a CARMEN log has no topics, got topic={told(topic)}")
    return True


def write_log(path, log):
    """Write a laser log as CARMEN text.

    Parameters
    ----------
    path : str or Path
        `.log` or `.clf`, with `.gz` to have it packed; the file appears whole or not at all.
    log : LaserLog
        The scans, with evenly spaced beams.

    Raises
    ------
    FormatError
        If the name is not one of a CARMEN log.
    ValueError
        If the beams are not evenly spaced, or it is no LaserLog.
    """
    checked_record("log", log, LaserLog)
    _check_is_carmen(checked_path(path))
    carmen_log.write_log(path, log)


def _check_is_carmen(path):
    if not path.name.endswith(CARMEN_SUFFIXES):
        carmen, ros = ", ".join(CARMEN_SUFFIXES), ", ".join(ros_bag.SUFFIXES)
        raise FormatError(f"a CARMEN log is named {carmen}, a ROS bag {ros}", path)
