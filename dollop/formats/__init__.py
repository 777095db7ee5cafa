"""Files at the edge of the library: CARMEN logs and maps, ROS bags and maps, whole files."""

from dollop.formats.files import FormatError
from dollop.formats.logs import read_log, read_odometry, write_log
from dollop.formats.odometry import Odometry

__all__ = ["FormatError", "Odometry", "read_log", "read_odometry", "write_log"]
