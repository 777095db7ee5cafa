"""dollop map: a background map from a log with known poses."""

import dollop
from dollop.formats.writing import check_outputs
from dollop.gridmap import map_outputs

__all__ = ["run"]


def run(options):
    """Make the map, dollop map LOG MAP.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.
    """
    check_outputs(map_outputs(options.map), [options.log])
    log = dollop.read_log(options.log, options.topic, options.fov)
    dollop.OccupancyGrid.from_log(log, options.resolution).save(options.map)
    print(f"wrote {options.map}")
