"""Laser logs by file name: CARMEN or ROS."""

from pathlib import Path

from dollop.formats import carmen_log, ros_bag
from dollop.formats.files import FormatError

__all__ = ["read_log", "write_log"]

CARMEN_SUFFIXES = (".log", ".log.gz", ".clf", ".clf.gz")
ROS_SUFFIXES = (".bag", ".mcap", ".db3")


def read_log(path, topic=None, fov=None):
    """Read a laser log, in the format that its name says.

    Parameters
    ----------
    path : str or Path
        `.log`, `.clf`, packed (`.gz`) or not: a CARMEN log (`dollop.formats.carmen_log.read_log`);
        `.bag`, `.mcap`, `.db3` or the folder of a ROS 2 bag: a ROS bag
        (`dollop.formats.ros_bag.read_log`, which needs the extra `ros`). A bag's poses are all
        (0, 0, 0): if the sensor moved, give the log its poses in the map with
        `dataclasses.replace(log, poses=poses)`.
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
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"no such file: {path}")
    if path.is_dir() or path.name.endswith(ROS_SUFFIXES):
        if fov is not None:
            raise ValueError(f"{path}: a ROS bag states its field of view, got fov={fov!r}")
        return ros_bag.read_log(path, topic)
    _check_is_carmen(path)
    if topic is not None:
        raise ValueError(f"a CARMEN log has no topics, got topic={topic!r}")
    return carmen_log.read_log(path, fov=fov)


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
        If the beams are not evenly spaced.
    """
    _check_is_carmen(Path(path))
    carmen_log.write_log(path, log)


def _check_is_carmen(path):
    if not path.name.endswith(CARMEN_SUFFIXES):
        carmen, ros = ", ".join(CARMEN_SUFFIXES), ", ".join(ROS_SUFFIXES)
        raise FormatError(f"a CARMEN log is named {carmen}, a ROS bag {ros}", path)
