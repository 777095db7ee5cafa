"""What the wheels of a robot report: a record that the readers of CARMEN logs and ROS bags share."""

from dataclasses import dataclass

import numpy as np

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
    """

    t: np.ndarray
    poses: np.ndarray
    velocities: np.ndarray

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        span = np.ptp(self.t) if len(self) else 0.0
        return f"Odometry of {len(self)} messages in {span:.1f} s"
