"""What the wheels of a robot report: a record that the readers of CARMEN logs and ROS bags share."""

from dataclasses import dataclass

import numpy as np

from dollop.checks import LATEST, checked_array, checked_positions, put_in

__all__ = ["Odometry"]


@dataclass(frozen=True, eq=False)
class Odometry:
    """What the wheels report.

    Attributes
    ----------
    t : (N,) float array
        Time in s, increasing.
    poses : (N, 3) float array
        Robot in the odometry's own frame: x, y in m, theta in rad, wrapped to (-pi, pi].
    velocities : (N, 2) float array
        Forward in m/s, turning in rad/s.

    Raises
    ------
    ValueError
        Arrays that are not of one length, times that fall, or what is not finite.
    """

    t: np.ndarray
    poses: np.ndarray
    velocities: np.ndarray

    def __post_init__(self):
        t = checked_array("t", self.t, "N", least=-LATEST, most=LATEST)
        if (np.diff(t) < 0).any():
            raise ValueError("the times of odometry must rise, got some that fall")
        put_in(
            self,
            t=t,
            poses=checked_positions("poses", self.poses, len(t), 3),
            velocities=checked_positions("velocities", self.velocities, len(t), 2),
        )

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        span = np.ptp(self.t) if len(self) else 0.0
        return f"Odometry of {len(self)} messages in {span:.1f} s"
