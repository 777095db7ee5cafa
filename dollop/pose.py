"""Poses (x, y, theta) in the plane: angles wrapped, rotations, what lies between two poses.

Plane geometry as in S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics" (2005), ch. 5.
"""

from math import cos, nextafter, pi, sin

import numpy as np

__all__ = ["motion_between", "moved_pose", "rotation", "wrapped"]

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
