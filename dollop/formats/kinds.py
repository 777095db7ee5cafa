"""What a file holds, told by its beginning: so that none is replaced by one of another kind."""

import codecs
import os
import re
import zlib
from pathlib import Path
from typing import NamedTuple

from dollop.checks import shortened

__all__ = [
    "BAG", "CARMEN_LOG", "CARMEN_MAP", "EVERYBODY", "GIF", "PATH_TABLE", "PGM", "PNG", "ROS_MAP", "ROUTE_GRAPH",
    "RUN", "SCENE", "TASK", "TRAJECTORY", "TRUTH", "WAYPOINTS", "Kind", "check_no_map_names", "check_replaceable",
    "kind_of",
]  # fmt: skip

HEAD = 1 << 16
"""Bytes of a file, packed or not, by which its kind is told: comments may be long."""


class Kind(NamedTuple):
    """A kind of file that is written here.

    Attributes
    ----------
    name : str
        With its article, as messages tell it.
    pattern : bytes
        Regular expression that is found in the first 64 kB of every file of this kind, unpacked.
    """

    name: str
    pattern: bytes


_MESSAGE = rb"(?:[FR]LASER|ROBOTLASER\d|RAWLASER\d|ODOM|PARAM) "
_MOVING = rb"(?:x|y|heading|object_x|object_y|laser_x|laser_y|laser_theta)(?:_\d+)?"
_TRUTH = rb"\A(?=.*(?:heading|object_x|laser_x))t(?:," + _MOVING + rb")+\r?\n"

CARMEN_LOG = Kind("a CARMEN log", rb"(?m)\A# CARMEN Logfile|^" + _MESSAGE)
CARMEN_MAP = Kind("a CARMEN map", rb"\A(?:(?:#.*)?\n)*CARMENMAPFILE")
_IMAGE = rb"(?m)^[{\s]*[\"']?image[\"']?\s*:\s*[\"']?([^\"'#,}\n]*)"
ROS_MAP = Kind("a ROS map", _IMAGE)
PGM = Kind("a PGM picture", rb"\AP[25]\s")
PNG = Kind("a PNG picture", rb"\A\x89PNG\r\n\x1a\n")
TASK = Kind("a task", rb'\A\s*\{(?s:.*)"format":\s*"dollop task"')
SCENE = Kind("a scene", rb'\A\s*\{(?s:.*)"format":\s*"dollop scene"')
TRAJECTORY = Kind("a trajectory", rb"\At,x,y,occluded\r?\n")
EVERYBODY = Kind("a table of everybody's trajectories", rb"\At,x,y,occluded,person\r?\n")
TRUTH = Kind("the truth of a recording", _TRUTH)
GIF = Kind("a film", rb"\AGIF8[79]a")
RUN = Kind("a run", rb"\At,x,y,theta,true_x,true_y,true_theta,way,segment,localised,clearance,event\r?\n")
_GRAPH = rb'\A\s*\{\s*"type": "FeatureCollection",\s*"name": "dollop route"'
ROUTE_GRAPH = Kind("a route graph", _GRAPH)
WAYPOINTS = Kind("waypoints", rb"\A# Dollop route: waypoints")
PATH_TABLE = Kind("a path", rb"\A# Dollop route: way, t, x")
BAG = Kind("a ROS bag", rb"\A(?:#ROSBAG|\x89MCAP|SQLite format 3)")

_KNOWN = (
    CARMEN_LOG, CARMEN_MAP, PGM, PNG, GIF, TASK, SCENE, TRAJECTORY, EVERYBODY, TRUTH, RUN, ROUTE_GRAPH, WAYPOINTS,
    PATH_TABLE, BAG, ROS_MAP,
)  # fmt: skip


def kind_of(path):
    """What a file holds, told by its first 64 kB, whatever it is called.

    Parameters
    ----------
    path : str or Path
        A file, or the folder of a ROS 2 bag.

    Returns
    -------
    Kind or None
        None for what none of the known kinds is.

    Raises
    ------
    OSError
        If there is no such file, or it cannot be read.

    Examples
    --------
    The name says nothing.

    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile(suffix=".log") as file:
    ...     file.write(b"P5 1 1 255 0"), file.flush()
    ...     kind_of(file.name).name
    (12, None)
    'a PGM picture'
    """
    if os.path.isdir(path):
        return BAG if os.path.isfile(os.path.join(path, "metadata.yaml")) else None
    head = _head(path)
    return next((each for each in _KNOWN if re.search(each.pattern, head)), None)


def check_replaceable(path, kind):
    """Refuse to replace a file that is not empty by one of another kind.

    Parameters
    ----------
    path : str or Path
        A file that is there.
    kind : Kind
        What is to be written.

    Raises
    ------
    FileExistsError
        If the file holds something else; by its first 64 kB, unpacked.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile() as file:
    ...     check_replaceable(file.name, TASK)
    ...     file.write(b"# CARMEN Logfile"), file.flush()
    ...     check_replaceable(file.name, TASK)
    Traceback (most recent call last):
    FileExistsError: it holds a CARMEN log and not a task: remove it first, or choose another name
    """
    head = _head(path)
    if head and not re.search(kind.pattern, head):
        rule = "remove it first, or choose another name"
        found = kind_of(path)
        held = "something else" if found is None else found.name
        raise FileExistsError(f"it holds {held} and not {kind.name}: {rule}")


def check_no_map_names(picture, of=None):
    """Refuse the name of a picture that another map beside it names, whether the picture is there or not.

    Parameters
    ----------
    picture : str or Path
    of : str or Path, optional
        The map whose picture it is: this one may name it.

    Raises
    ------
    FileExistsError
        If another `.yaml` or `.yml` beside it names it in its first 64 kB.
    """
    picture, own = os.path.realpath(picture), None if of is None else os.path.realpath(of)
    folder = Path(picture).parent
    for other in sorted((*folder.glob("*.yaml"), *folder.glob("*.yml"))):
        readable = other.is_file() and os.access(other, os.R_OK)
        named = re.search(_IMAGE, _head(other)) if readable and os.path.realpath(other) != own else None
        if named and os.path.realpath(folder / os.fsdecode(named[1].strip())) == picture:
            raise FileExistsError(f"it is the picture of the map {shortened(other.name, 80)}: choose another name")


def _head(path):
    """The first bytes of a file, unpacked if it is gzipped, without a byte order mark."""
    with open(path, "rb") as stream:
        head = stream.read(HEAD)
    if head.startswith(b"\x1f\x8b"):
        try:
            return zlib.decompressobj(wbits=31).decompress(head, HEAD)
        except zlib.error:
            return head
    return head.removeprefix(codecs.BOM_UTF8)
