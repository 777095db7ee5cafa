"""Where a bag has its laser: the frames of ROS in the plane (REP 105), from transforms and odometry."""

from dataclasses import dataclass

import numpy as np

from dollop.checks import FARTHEST, Note
from dollop.formats.files import from_file
from dollop.formats.scans import check_metres, doubtful
from dollop.pose import composed, poses_at

__all__ = ["Link", "laser_poses", "planar"]

MAP, ODOMETRY = "map", "odom"
"""Frames whose poses do not drift, and those that do (https://www.ros.org/reps/rep-0105.html)."""
LATE = 1.0
"""s: farther from every message of a link, a scan's pose is a guess."""
TILTED = np.radians(10)
"""Angle in rad from which on a laser does not scan the plane."""


@dataclass(frozen=True, eq=False)
class Link:
    """Where a frame is in its parent frame, over time.

    Attributes
    ----------
    parent : str
        Name of the parent frame.
    t : (N,) float array
        In s, increasing.
    poses : (N, 3) float array
        x, y in m, theta in rad.
    up : (N,) float array
        Cosine of the angle between both frames' axes upwards: -1 upside down.
    """

    parent: str
    t: np.ndarray
    poses: np.ndarray
    up: np.ndarray

    @classmethod
    def of(cls, parent, t, places):
        """A link of messages in any order.

        Parameters
        ----------
        parent : str
        t : (N,) sequence of float
            In s; of several at one time one is taken.
        places : (N, 4) sequence
            As `planar` has them.

        Returns
        -------
        Link
        """
        t, first = np.unique(t, return_index=True)
        places = np.asarray(places)[first]
        return cls(parent, t, places[:, :3], places[:, 3])

    @property
    def fixed(self):
        """Bool: whether nothing moves."""
        return bool((np.ptp(self.poses, axis=0) < 1e-9).all())

    def late(self, t):
        """Which times are far from every message; none where nothing moves.

        Parameters
        ----------
        t : (T,) float array
            In s.

        Returns
        -------
        (T,) bool array
        """
        if self.fixed:
            return np.zeros(len(t), bool)
        after = np.searchsorted(self.t, t).clip(1, len(self.t) - 1)
        return np.minimum(abs(t - self.t[after - 1]), abs(t - self.t[after])) > LATE


def planar(place, turn):
    """A transform of ROS as seen from above.

    Parameters
    ----------
    place : Vector3 or Point
        With x and y in m.
    turn : Quaternion

    Returns
    -------
    x, y, theta, up : float
        In m and rad, and the cosine of the angle between both axes upwards.

        NaN where a number is NaN or beyond 1e9: who uses it refuses it.
    """
    told_ = np.array([place.x, place.y, turn.x, turn.y, turn.z, turn.w], float)
    across, along, *q = np.where(np.abs(told_) <= FARTHEST, told_, np.nan)
    x, y, z, w = q / np.maximum(np.linalg.norm(q), 1e-12)
    return (
        across,
        along,
        np.arctan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z)),
        1 - 2 * (x * x + y * y),
    )


def laser_poses(path, links, odometry, frame, t):
    """Poses of the laser at its scans, in the frame of the map if there is one, else by odometry.

    Parameters
    ----------
    path : str or Path
        The bag, for warnings.
    links : dict of str to Link
        The tree of transforms: each frame's link to its parent.
    odometry : (str, Link) or None
        The robot's frame, and its link to the odometry's, from messages of odometry. They are needed
        only if the transforms do not tell.
    frame : str
        The laser's frame.
    t : (T,) float array
        Times of the scans in s.

    Returns
    -------
    poses : (T, 3) float array
        Zero where nothing is known.
    upside_down : bool
        Whether the laser hangs: its bearings run clockwise as seen from above.
    notes : tuple of Note
        Of kind "poses", unless they are known in a frame called map.
    """
    notes = ()
    if odometry is not None and not _told(links, frame):
        links, notes = _with_odometry(path, links, *odometry, frame)
    chain = _chain(links, frame)
    root = links[chain[-1]].parent if chain else frame
    for name in chain:
        from_file(path, check_metres, f"the transforms of {name!r}", links[name].poses)
    if odometry is None and not _told(links, frame):
        text = f"the bag tells no motion of {frame!r}: the laser is taken to stand still at (0, 0, 0)"
        return np.zeros((len(t), 3)), False, (Note("poses", text, doubt=False),)
    late = np.any([links[name].late(t) for name in chain], axis=0)
    if 2 * late.sum() > len(t):
        text = f"{late.sum()} of {len(t)} scans are more than {LATE:g} s from every transform or odometry"
        return (
            np.zeros((len(t), 3)),
            False,
            (doubtful(path, "poses", f"{text}: every pose is (0, 0, 0)"),),
        )
    if late.any():
        text = f"{late.sum()} of {len(t)} poses are a guess: no transform or odometry within {LATE:g} s"
        notes = (*notes, doubtful(path, "poses", text))
    if _name(root) != MAP:
        text = f"the poses are those of the bag's frame {root!r}, by odometry, which drifts"
        notes = (
            *notes,
            Note("poses", f"{text}; dollop.localise finds those on a map", doubt=False),
        )
    poses, sides, tilt = _along(links, chain, t)
    if tilt > TILTED:
        text = f"the laser is tilted by {np.degrees(tilt):.0f} degrees and taken to be level"
        notes = (*notes, doubtful(path, "poses", text))
    return poses, sides < 0, notes


def _told(links, frame):
    """Whether the transforms tell where a frame moves, or that it stands."""
    chain = _chain(links, frame)
    root = links[chain[-1]].parent if chain else frame
    return _name(root) in (MAP, ODOMETRY) or not all(links[name].fixed for name in chain)


def _with_odometry(path, links, robot, link, frame):
    """Links with the odometry's of a robot, and notes on where it is tied to."""
    chain = _chain(links, frame)
    ends = [frame, *(links[name].parent for name in chain)]
    if robot in ends:
        return links | {robot: link}, ()
    text = f"no transform leads from {frame!r} to {robot!r}, whose odometry it is: {ends[-1]!r} is taken for it"
    return links | {ends[-1]: link}, (doubtful(path, "poses", text),)


def _chain(links, frame):
    """Frames from one up to the last that has a parent, or to the one below the map."""
    chain = []
    while frame in links and frame not in chain and _name(frame) != MAP:
        chain.append(frame)
        frame = links[frame].parent
    return chain


def _name(frame):
    """The name of a frame without the robot's."""
    return frame.rsplit("/", 1)[-1]


def _along(links, chain, t):
    """Poses (T, 3) of the first frame of a chain in the last one's parent, side up, and largest tilt in rad.

    Within a frame that hangs, y points to the other side and angles run the other way.
    """
    poses, side, tilt = np.zeros((len(t), 3)), 1, 0.0
    for name in chain:
        link = links[name]
        turned = -1 if link.up[0] < 0 else 1
        poses = composed(poses_at(t, link.t, link.poses), poses * [1, turned, turned])
        side, tilt = side * turned, max(tilt, float(np.arccos(np.abs(link.up).min().clip(0, 1))))
    return poses, side, tilt
