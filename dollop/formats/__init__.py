"""Files at the edge of the library: CARMEN logs and maps, ROS bags and maps, whole files."""

from dollop.formats.files import FormatError
from dollop.formats.logs import read_log, write_log

__all__ = ["FormatError", "read_log", "write_log"]
