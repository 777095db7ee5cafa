"""dollop map: a background map from a log with known poses."""

from pathlib import Path

import dollop
from dollop.cli.naming import check_written, unused
from dollop.cli.telling import Result, busy, command, tell
from dollop.cli.watching import read_log
from dollop.formats.kinds import PNG
from dollop.formats.writing import together, whole_file
from dollop.gridmap import map_outputs

__all__ = ["run"]


def run(options):
    """Make the map, dollop map LOG MAP.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.
    """
    outputs, picture = map_outputs(options.map), _beside(options.map, ".png")
    check_written(outputs, [options.log], picture, options.map)
    log = read_log(options.log, options)
    with busy("building the map"):
        grid = dollop.OccupancyGrid.from_log(log, options.resolution)
    with together():
        _draw(grid, log, picture, options.map)
        grid.save(options.map)
    written = [
        options.map,
        *(each.path for each in outputs if str(each.path) != options.map),
        picture,
    ]
    look = unused(_beside(options.map, "_log.png"))
    look = command("show", options.log, "--map", options.map, "--out", look)
    tell(Result(_lines(grid, options.map), written, look, log.notes, _data(grid)), options.json)


def _beside(path, ending):
    """A name beside a map's, in place of its suffixes."""
    path = Path(path)
    name = path.name.removesuffix(".gz")
    return path.with_name(Path(name).stem + ending)


def _lines(grid, path):
    """What the map is, and what to do with it, for people."""
    rows, columns = grid.occupancy.shape
    size = f"{columns * grid.resolution:.1f} m x {rows * grid.resolution:.1f} m"
    then = command("learn", "WALK.log", "--map", path, "--out", unused("task.json", ".png"))
    return (
        f"a map of {size}, {grid.free.mean():.0%} of it free, at {grid.resolution:g} m per cell",
        f"with a log in which somebody walks: {then}",
    )


def _data(grid):
    """What the map is, for programs."""
    rows, columns = grid.occupancy.shape
    size = {"rows": rows, "columns": columns, "resolution": grid.resolution, "origin": grid.origin}
    return {**size, "free": grid.free.mean(), "occupied": grid.occupied.mean()}


def _draw(grid, log, picture, path):
    """The map, and where the laser was, as a picture."""
    from dollop import plot

    def draw(ax):
        plot.whole_map(ax, grid)
        plot.path(ax, log.poses, "way of the laser", plot.RUN, marker=".", markersize=2)

    with whole_file(picture, kind=PNG, of=path) as stream:
        stream.write(plot.png(draw))
