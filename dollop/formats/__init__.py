"""Files at the edge of the library: CARMEN logs and maps, ROS bags and maps, whole files."""
