"""Poses (x, y, theta) in the plane: angles wrapped, rotations, what lies between two poses.

Plane geometry as in S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics" (2005), ch. 5.
"""

from math import cos, hypot, nextafter, pi, sin

import numpy as np

__all__ = ["between", "composed", "motion_between", "moved_pose", "poses_at", "rotation", "towards", "wrapped"]

_LEAST = nextafter(-pi, 0)  # the least angle above -pi


def wrapped(angle):
    """An angle, or an array of them, in (-pi, pi].

    Parameters
    ----------
    angle : float or (...) float array
        In rad.

    Returns
    -------
    float or (...) float array
        In rad. What lies in the range already keeps its last bit.

    Examples
    --------
    >>> wrapped(-np.pi) == np.pi, wrapped(np.array([0.1, 7.0])).round(3).tolist()
    (True, [0.1, 0.717])
    """
    turned = angle + 2 * pi * ((pi - angle) // (2 * pi))
    inside = (angle > -pi) & (angle <= pi)
    if isinstance(angle, np.ndarray):
        return np.where(inside, angle, turned.clip(_LEAST, pi))
    return angle if inside else min(max(turned, _LEAST), pi)


def rotation(angle):
    """Matrices that turn a column vector counter-clockwise.

    Parameters
    ----------
    angle : (...) array_like
        In rad.

    Returns
    -------
    (..., 2, 2) float array
        [[cos, -sin], [sin, cos]] of each.

    Examples
    --------
    Turning twice is turning by the sum.

    >>> bool(np.allclose(rotation(0.3) @ rotation(0.4), rotation(0.7)))
    True
    """
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def moved_pose(pose, distance, turn):
    """The pose after a short arc, driven in the direction half-way through its turn.

    The inverse of `motion_between`, and the motion that the localisation takes odometry for.

    Parameters
    ----------
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    distance : float
        Length of the arc in m.
    turn : float
        In rad.

    Returns
    -------
    (3,) float array
        x, y in m, theta in rad, wrapped.

    Examples
    --------
    What was driven is what lies between the poses.

    >>> pose = (1.0, 2.0, 3.0)
    >>> motion_between(pose, moved_pose(pose, 0.5, 0.4)).round(6).tolist()
    [0.5, 0.0, 0.4]
    """
    x, y, theta = pose
    middle = theta + turn / 2
    return np.array([x + distance * cos(middle), y + distance * sin(middle), wrapped(theta + turn)])


def motion_between(before, after):
    """What happened between two poses of the odometry, seen from half the turn.

    Parameters
    ----------
    before, after : (3,) sequence of float
        x, y in m, theta in rad.

    Returns
    -------
    (3,) float array
        m ahead, m to the left, and the turn in rad.

    Examples
    --------
    >>> motion_between((1.0, 1.0, np.pi / 2), (1.0, 3.0, np.pi / 2)).round(6).tolist()
    [2.0, 0.0, 0.0]
    """
    dx, dy, turn = np.subtract(after, before)
    turn = wrapped(turn)
    return np.array([*(rotation(-before[2] - turn / 2) @ (dx, dy)), turn])


def composed(outer, inner):
    """Poses that are told in the frame of other poses, in the frame that those are told in.

    Parameters
    ----------
    outer, inner : (..., 3) array_like
        x, y in m, theta in rad.

    Returns
    -------
    (..., 3) float array
        x, y in m, theta in rad, wrapped.

    Examples
    --------
    A laser 0.2 m ahead of a robot that looks to the left.

    >>> composed([1.0, 2.0, np.pi / 2], [0.2, 0.0, 0.0]).round(6).tolist()
    [1.0, 2.2, 1.570796]
    """
    outer, inner = np.broadcast_arrays(np.asarray(outer, float), np.asarray(inner, float))
    turned = (rotation(outer[..., 2]) @ inner[..., :2, None])[..., 0]
    return np.concatenate([outer[..., :2] + turned, wrapped(outer[..., 2:] + inner[..., 2:])], axis=-1)


def between(before, after):
    """Poses in the frame of other poses: `composed(before, between(before, after))` is `after`.

    Parameters
    ----------
    before, after : (..., 3) array_like
        x, y in m, theta in rad.

    Returns
    -------
    (..., 3) float array
        x, y in m, theta in rad, wrapped.

    Examples
    --------
    >>> between([1.0, 2.0, np.pi / 2], [1.0, 2.2, np.pi / 2]).round(6).tolist()
    [0.2, 0.0, 0.0]
    """
    before, after = np.broadcast_arrays(np.asarray(before, float), np.asarray(after, float))
    way = (rotation(-before[..., 2]) @ (after - before)[..., :2, None])[..., 0]
    return np.concatenate([way, wrapped((after - before)[..., 2:])], axis=-1)


def poses_at(t, times, poses):
    """Poses at other times, interpolated: the place along a straight line, the heading the shorter way.

    Parameters
    ----------
    t : (T,) array_like
        When in s.
    times : (N,) float array
        When the poses were, in s, increasing.
    poses : (N, 3) float array
        x, y in m, theta in rad.

    Returns
    -------
    (T, 3) float array
        Before the first time and after the last as there; theta wrapped.

    Examples
    --------
    >>> poses_at([0.5, 9.0], np.array([0.0, 1.0]), np.array([[0, 0, 3.0], [2, 0, -3.0]])).round(3).tolist()
    [[1.0, 0.0, 3.142], [2.0, 0.0, -3.0]]
    """
    columns = *poses.T[:2], np.unwrap(poses[:, 2])
    found = np.stack([np.interp(t, times, column) for column in columns], axis=-1)
    found[:, 2] = wrapped(found[:, 2])
    return found


def towards(x, y, from_x=0.0, from_y=0.0):
    """Unit vector that points to a place from another.

    Parameters
    ----------
    x, y, from_x, from_y : float
        Both places in m.

    Returns
    -------
    (float, float)
        Zero where they are the same.

    Examples
    --------
    >>> towards(4.0, 6.0, 1.0, 2.0), towards(0.0, 0.0)
    ((0.6, 0.8), (0.0, 0.0))
    """
    x, y = x - from_x, y - from_y
    size = hypot(x, y)
    return (x / size, y / size) if size > 1e-12 else (0.0, 0.0)
