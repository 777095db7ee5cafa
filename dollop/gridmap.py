"""Occupancy grid maps (Sec. II): built from a laser log with known poses, read and written.

The cell arithmetic of the library lives here, once: `in_cells` and what is made of it.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy

from dollop.checks import (
    FARTHEST,
    checked_array,
    checked_number,
    checked_positions,
    checked_record,
    checked_wholes,
    put_in,
)
from dollop.formats import carmen_map, ros_bag
from dollop.formats.carmen_map import OCCUPIED_FROM
from dollop.formats.files import FormatError, check_cells, from_file
from dollop.formats.writing import checked_path
from dollop.laser import LaserLog

__all__ = [
    "SIDES", "OccupancyGrid", "check_is_map", "covered_cells", "distances_to", "flat_cells", "in_cells", "in_metres",
    "map_inputs", "map_outputs",
]  # fmt: skip

FINEST = 1e-3
"""m: no laser tells more, and a beam passes so many cells."""
READINGS, POINTS = 100_000, 1_000_000
"""Beams, and cells along them, that are counted at once: some 100 MB."""
MOST_ALONG = 1_000_000
SIDES = 1e-6, 1e3
"""m: cells of a map are neither smaller nor larger."""
AT_ONCE = 1 << 13
"""Cells whose distances are taken at once: they stay in a processor's cache."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """How likely each cell of the plane is occupied: the paper's background map (Sec. II).

    A cell is *occupied* from a probability of 0.5 on, *free* below, and *unknown* where no beam has
    been. The array is a copy, and read-only: what has been checked stays as it is.

    Attributes
    ----------
    occupancy : (H, W) float array
        Probabilities in [0, 1], NaN where unknown; indexed [row, col] = [y, x].
    origin : (float, float)
        Lower left cell's lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Raises
    ------
    ValueError
        If the occupancy is not a grid of probabilities, a side of a cell is below a micrometre or
        beyond a kilometre, or the origin beyond 1e9 m.

    Examples
    --------
    Where the map ends, nothing is known: that is neither near nor far.

    >>> grid = OccupancyGrid([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]], (0.0, 0.0), resolution=0.1)
    >>> grid.distance_at([[0.05, 0.05], [0.25, 0.15], [0.35, 0.0]]).round(3).tolist()
    [0.2, 0.0, nan]
    """

    occupancy: np.ndarray
    origin: tuple
    resolution: float

    def __post_init__(self):
        cells = checked_array("occupancy", self.occupancy, "H", "W", finite=False)
        if cells.size == 0:
            raise ValueError(f"occupancy must hold a cell, got shape {cells.shape}")
        wrong = (cells < 0) | (cells > 1)
        if wrong.any():
            raise ValueError(f"occupancy must be in [0, 1] or NaN, got {cells[wrong][0]}")
        origin = tuple(checked_positions("origin", self.origin, 2).tolist())
        put_in(
            self,
            occupancy=cells,
            origin=origin,
            resolution=checked_number("resolution", self.resolution, *SIDES),
        )

    def __repr__(self):
        height, width = self.occupancy.shape
        size = f"{width} x {height} cells of {self.resolution:g} m"
        return f"OccupancyGrid of {size}, {self.occupied.mean():.0%} occupied"

    @classmethod
    def from_log(cls, log, resolution=0.05, max_range=20.0):
        """Count hits and passes of every beam; a cell's occupancy is hits / (hits + passes).

        Where a beam ends, its cell is hit; the cells before are passed, each as long as the beam
        runs in it. A beam that does not come back passes all cells up to the maximum range. What
        moves through the scene is thus swept away by the beams that pass there later; what stands
        still for most of the log stays.

        Parameters
        ----------
        log : LaserLog
            Scans with the sensor's poses.
        resolution : float, optional
            Side of a cell in m.
        max_range : float, optional
            Up to which distance from the sensor to believe a beam, in m: 20 m as in CARMEN's scan
            matcher (`vasco`).

        Returns
        -------
        OccupancyGrid
            Large enough for all that is hit or passed.

        Raises
        ------
        ValueError
            If the grid would have more than 20 million cells or not lie within 1e9 m of the origin,
            if `max_range` is no length, or `resolution` is not from 1 mm to 1 km.

        Notes
        -----
        The counting model of D. Hähnel et al., "Map building with mobile robots in dynamic
        environments" (ICRA 2003); the paper (Sec. II) takes its map from CARMEN.

        Examples
        --------
        One beam of 1 m: what it passes is free, what it hits is occupied.

        >>> from dollop.laser import LaserLog
        >>> log = LaserLog([0.0], [[1.0]], [0.0], [[0.0, 0.0, 0.0]], max_range=8.0)
        >>> grid = OccupancyGrid.from_log(log, resolution=0.25)
        >>> grid.occupied[tuple(grid.world_to_cell([1.0, 0.0]))].item()
        True
        >>> grid.free[tuple(grid.world_to_cell([0.3, 0.0]))].item()
        True
        """
        checked_record("log", log, LaserLog)
        resolution = checked_number("resolution", resolution, FINEST, SIDES[1])
        max_range = checked_number("max_range", max_range, SIDES[0])
        reach = np.minimum(log.ranges, min(max_range, log.max_range))
        some = np.array_split(np.arange(len(log)), min(len(log), 1 + reach.size // READINGS))
        frame = _frame(np.vstack([_bounds(log, scans, reach) for scans in some]), resolution)
        return cls(_occupancy(log, some, reach, log.ranges <= max_range, *frame), *frame[:2])

    @classmethod
    def load(cls, path):
        """Read a map of ROS map_server, of CARMEN or of a ROS bag, as its name says.

        Parameters
        ----------
        path : str or Path
            `.yaml` or `.yml`, which names its picture, PGM or PNG: ROS
            (http://wiki.ros.org/map_server); `.map` or `.map.gz`: CARMEN (`map_io.h`); `.bag`,
            `.mcap`, `.db3` or the folder of a ROS 2 bag: the map that was sent on `/map`, or on the
            only topic of nav_msgs/OccupancyGrid.

        Returns
        -------
        OccupancyGrid

        Raises
        ------
        FormatError
            If the file is not what its name says.
        """
        form = ros_bag if ros_bag.is_bag(path) else _format_of(path)
        return from_file(path, cls, *form.read_map(path))

    def save(self, path):
        """Write a map of ROS map_server or of CARMEN, as its name says.

        A CARMEN map keeps the occupancy as float32, a ROS map in 256 steps of grey.

        Parameters
        ----------
        path : str or Path
            `.yaml` or `.yml`: ROS, and beside it a `.pgm` of the same name; `.map`, or `.map.gz` to
            have it packed: CARMEN. The file appears whole or not at all, and the picture with it.

        Raises
        ------
        FormatError
            If the name says neither.
        OSError
            If it cannot be written, or what is there is no such map or the picture of another.
        """
        _format_of(path).write_map(path, self.occupancy, self.origin, self.resolution)

    @property
    def occupied(self):
        """(H, W) bool array: probability at least 0.5."""
        return self.occupancy >= OCCUPIED_FROM

    @property
    def free(self):
        """(H, W) bool array: probability below 0.5."""
        return self.occupancy < OCCUPIED_FROM

    @property
    def unknown(self):
        """(H, W) bool array: never seen."""
        return np.isnan(self.occupancy)

    @property
    def extent(self):
        """xmin, xmax, ymin, ymax in m, as `imshow` takes them (with `origin="lower"`)."""
        height, width = self.occupancy.shape
        right, top = in_metres(width, height, self.origin, self.resolution)
        return self.origin[0], right, self.origin[1], top

    def world_to_cell(self, points):
        """Cells that hold the points, on the map or off it.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m, within 1e9 m.

        Returns
        -------
        (..., 2) int array
            Row and column.

        Raises
        ------
        ValueError
            For what are no positions.
        """
        x, y = np.moveaxis(checked_positions("points", points, "...", 2), -1, 0)
        column, row = in_cells(x, y, self.origin, self.resolution)
        return np.floor(np.stack([row, column], axis=-1)).astype(int)

    def cell_centres(self, cells):
        """Centres of cells.

        Parameters
        ----------
        cells : (..., 2) array_like of int
            Row and column.

        Returns
        -------
        (..., 2) float array
            x, y in m.

        Raises
        ------
        ValueError
            For what are no numbers of cells.
        """
        row, column = np.moveaxis(checked_wholes("cells", cells, "...", 2, least=-FARTHEST), -1, 0)
        return np.stack(in_metres(column + 0.5, row + 0.5, self.origin, self.resolution), axis=-1)

    def covers(self, points):
        """Which points lie on the map.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m; NaN lies nowhere.

        Returns
        -------
        (...,) bool array

        Raises
        ------
        ValueError
            For what are not two numbers each.
        """
        xmin, xmax, ymin, ymax = self.extent
        x, y = np.moveaxis(checked_array("points", points, "...", 2, finite=False), -1, 0)
        return (x >= xmin) & (x < xmax) & (y >= ymin) & (y < ymax)

    def distance_field(self):
        """Distance from every cell to the nearest occupied one, centre to centre; computed once.

        Returns
        -------
        (H, W) float array
            Metres; 0 in occupied cells, `inf` everywhere if none is occupied.
        """
        return self._distances

    @cached_property
    def _distances(self):
        distances = distances_to(self.occupied, self.resolution)
        if not self.occupied.any():
            distances[:] = np.inf
        distances.flags.writeable = False
        return distances

    def way_length(self, place, other, radius=0.15, most=np.inf):
        """Length of the shortest way on foot from a place to another, round what is occupied.

        Parameters
        ----------
        place, other : (2,) sequences of float
            In m.
        radius : float
            Kept from what is occupied, in m.
        most : float
            In m: a longer way is not looked for.

        Returns
        -------
        float
            In m; `inf` where there is no way, or only a longer one.

        Raises
        ------
        ValueError
            What is no place, a negative radius or length, places a million cells apart.

        Examples
        --------
        Round a wall of 1 m that ends at the border of the map there is no way.

        >>> grid = OccupancyGrid(np.pad(np.ones((20, 1)), ((0, 0), (20, 20))), (0.0, 0.0), 0.05)
        >>> grid.way_length((0.2, 0.5), (0.2, 0.9)), grid.way_length((0.2, 0.5), (1.8, 0.5))
        (0.4, inf)
        """
        place, other = checked_positions("place", place, 2), checked_positions("other", other, 2)
        radius, most = checked_number("radius", radius, 0), checked_number("most", most, 0, np.inf)
        straight = float(np.linalg.norm(other - place))
        if straight > MOST_ALONG * self.resolution:
            raise ValueError(f"a way must be at most {MOST_ALONG} cells long, got {straight:g} m")
        line = place + np.linspace(0, 1, 2 + int(straight / self.resolution))[:, None] * (other - place)
        near = self.distance_at(line)
        if not (near <= self.resolution).any():
            return straight
        free, origin, side, graph = self._walkable(radius)
        if not len(free):
            return np.inf
        start, goal = (self._nearest_free(each, free, origin, side) for each in (place, other))
        length = scipy.sparse.csgraph.dijkstra(graph, directed=False, indices=start, limit=most)[goal]
        return max(straight, float(length))

    def _walkable(self, radius):
        """Free cells (N, 2) of about 15 cm, lower left corner, their side, and a graph of neighbours."""
        if self._ways is None:
            stride = max(1, round(0.15 / self.resolution))
            free = (self.distance_field() > radius)[::stride, ::stride]
            number = np.full(free.shape, -1)
            number[free] = np.arange(free.sum())
            side, links = stride * self.resolution, []
            for rows, columns, far in (
                (0, 1, 1.0),
                (1, 0, 1.0),
                (1, 1, np.sqrt(2)),
                (1, -1, np.sqrt(2)),
            ):
                a = number[: number.shape[0] - rows, max(0, -columns) : number.shape[1] - max(0, columns)]
                b = number[rows:, max(0, columns) : number.shape[1] - max(0, -columns)]
                both = (a >= 0) & (b >= 0)
                links.append((a[both], b[both], np.full(both.sum(), far * side)))
            i, j, far = map(np.concatenate, zip(*links, strict=True))
            graph = scipy.sparse.coo_matrix((far, (i, j)), (free.sum(),) * 2).tocsr()
            self.__dict__["_ways"] = np.argwhere(free), self.origin, side, graph
        return self._ways

    def _nearest_free(self, place, free, origin, side):
        """Row of the free cell nearest to a place."""
        return int(np.linalg.norm(free[:, ::-1] * side + origin - place, axis=1).argmin())

    _ways = None

    def distance_at(self, points):
        """Distance from the cell of each point to the nearest occupied one.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m.

        Returns
        -------
        (...,) float array
            Metres; NaN off the map, where nothing is known (see `covers`), so that it is neither
            near nor far.

        Raises
        ------
        ValueError
            For what are not two numbers each.
        """
        points = checked_array("points", points, "...", 2, finite=False)
        inside = self.covers(points)
        rows, cols = self.world_to_cell(points[inside]).T
        distances = np.full(inside.shape, np.nan)
        distances[inside] = self.distance_field()[rows, cols]
        return distances


def check_is_map(path):
    """Refuse a name that is not one of a map.

    Parameters
    ----------
    path : str or Path
        The file, there or not.

    Raises
    ------
    FormatError
        If it ends neither in `.yaml` or `.yml` (ROS) nor in `.map` or `.map.gz` (CARMEN).
    """
    if not checked_path(path).name.endswith((*carmen_map.SUFFIXES, ".yaml", ".yml")):
        raise FormatError("a map is named .yaml (ROS), .map or .map.gz (CARMEN)", path)


def map_outputs(path):
    """Files that `OccupancyGrid.save` writes.

    Parameters
    ----------
    path : str or Path
        Of the map.

    Returns
    -------
    list of Output

    Raises
    ------
    FormatError
        If the name is not one of a map.
    """
    return _format_of(path).outputs(path)


def map_inputs(path):
    """Files that `OccupancyGrid.load` reads, as far as they are known before.

    Parameters
    ----------
    path : str or Path
        Of the map.

    Returns
    -------
    list of str or Path
    """
    is_ros = Path(path).suffix in (".yaml", ".yml") and not ros_bag.is_bag(path)
    picture = _format_of(path).picture_of(path) if is_ros else None
    return [path] if picture is None else [path, picture]


def _format_of(path):
    """The module that reads and writes maps of this name."""
    check_is_map(path)
    if Path(path).name.endswith(carmen_map.SUFFIXES):
        return carmen_map
    from dollop.formats import ros_map  # only now: PyYAML and Pillow take long to load

    return ros_map


def _rays(log, scans, reach):
    """Beams of some scans: where they begin, their directions and where they end, (N, 2) each."""
    bearings = log.poses[scans, 2, None] + log.angles
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    begins = np.broadcast_to(log.poses[scans, None, :2], directions.shape)
    ends = begins + reach[scans, :, None] * directions
    return tuple(each.reshape(-1, 2) for each in (begins, directions, ends))


def _bounds(log, scans, reach):
    """Corners (2, 2) of the box round all beams of some scans."""
    begins, _, ends = _rays(log, scans, reach)
    both = np.vstack([ends, begins])
    return np.array([both.min(axis=0), both.max(axis=0)])


def _frame(points, resolution):
    """Corner, resolution and shape of a grid that holds the points (M, 2), with a cell to spare."""
    farthest = np.abs(points).max()
    if not farthest <= FARTHEST:
        raise ValueError(f"a map must lie within {FARTHEST:g} m of the origin, got {farthest:g} m")
    left, low = np.floor(points.min(axis=0) / resolution) - 1
    right, high = np.floor(points.max(axis=0) / resolution) + 2
    columns, rows = right - left, high - low
    check_cells(columns, rows)
    return (left * resolution, low * resolution), resolution, (int(rows), int(columns))


def _occupancy(log, some, reach, is_hit, origin, resolution, shape):
    """Hits by hits and passes (H, W), NaN where there is neither, some scans after others."""
    hits, passes = (np.zeros(shape, dtype=int) for _ in range(2))
    for scans in some:
        begins, directions, ends = _rays(log, scans, reach)
        hits += _counts(ends[is_hit[scans].ravel()], origin, resolution, shape)
        # A cell's diagonal before its hit a beam has left no trace yet in the cell that it hits.
        steps = (reach[scans] / resolution - np.sqrt(2) * is_hit[scans]).astype(int).clip(0).ravel()
        # A laser that stands still must not step over the same corners in every scan: the golden
        # ratio spreads the phases.
        phases = np.repeat(scans * ((np.sqrt(5) - 1) / 2) % 1, reach.shape[1])
        for few in np.split(np.arange(len(steps)), _cuts(steps)):
            points = _passed(begins[few], directions[few], steps[few], phases[few], resolution)
            passes += _counts(points, origin, resolution, shape)
    passes += hits
    return np.divide(hits, passes, out=np.full(shape, np.nan), where=passes > 0)


def _cuts(steps):
    """Where to cut beams of so many steps (N,) into parts of not many more than `POINTS` in all."""
    return 1 + np.flatnonzero(np.diff(np.cumsum(steps) // POINTS))


def _counts(points, origin, resolution, shape):
    """How many points (M, 2) lie in each cell of a grid, (H, W)."""
    cells, _ = flat_cells(points, origin, resolution, shape)
    return np.bincount(cells, minlength=shape[0] * shape[1]).reshape(shape)


def _passed(begins, directions, steps, phases, resolution):
    """Points a cell apart along beams (N, 2), as many as there are `steps` (N,)."""
    along = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)
    along = along + np.repeat(phases, steps)
    starts, ways = np.repeat(begins, steps, axis=0), np.repeat(directions, steps, axis=0)
    return starts + ways * (along * resolution)[:, None]


def in_cells(x, y, origin, resolution):
    """Places in units of cells, from the grid's lower left corner: cell k reaches from k to k + 1.

    Parameters
    ----------
    x, y : float or (...) float array
        In m.
    origin : (float, float)
        Lower left cell's lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Returns
    -------
    column, row : float or (...) float array
        In units of cells.
    """
    return (x - origin[0]) / resolution, (y - origin[1]) / resolution


def in_metres(column, row, origin, resolution):
    """The inverse of `in_cells`: the centre of a cell lies at its column + 0.5, its row + 0.5.

    Parameters
    ----------
    column, row : float or (...) float array
        In units of cells.
    origin : (float, float)
        Lower left cell's lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Returns
    -------
    x, y : float or (...) float array
        In m.

    Examples
    --------
    >>> in_metres(*in_cells(1.23, -0.5, (0.5, -2.0), 0.05), (0.5, -2.0), 0.05)
    (1.23, -0.5)
    """
    return column * resolution + origin[0], row * resolution + origin[1]


def flat_cells(points, origin, resolution, shape):
    """Which cell each point lies in, counted row by row.

    Parameters
    ----------
    points : (M, 2) float array
        x, y in m.
    origin : (float, float)
        Lower left cell's lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.
    shape : (int, int)
        Rows and columns of the grid.

    Returns
    -------
    cells : (K,) int array
        Flat indices of the cells of the points that lie on the grid.
    inside : (M,) bool array
        Which of the points do.

    Examples
    --------
    A point on a border belongs to the cell above it or to its right.

    >>> points = np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 0.5]])
    >>> [each.tolist() for each in flat_cells(points, (0.0, 0.0), 1.0, (2, 3))]
    [[0, 4], [True, True, False]]
    """
    places = in_cells(*points.T, origin, resolution)
    column, row = (np.floor(each).astype(np.intp) for each in places)
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    return (row * shape[1] + column)[inside], inside


def covered_cells(boxes, origin, resolution, shape):
    """Cells that one of several boxes reaches into.

    Parameters
    ----------
    boxes : (N, 4) float array
        xmin, ymin, xmax, ymax in m.
    origin : (float, float)
        Lower left cell's lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.
    shape : (int, int)
        Rows and columns of the grid.

    Returns
    -------
    (H, W) bool array
        What only touches a cell does not reach into it.

    Examples
    --------
    >>> covered_cells(np.array([[0.5, 0.0, 2.0, 1.0]]), (0.0, 0.0), 1.0, (2, 3)).tolist()
    [[True, True, False], [False, False, False]]
    """
    covered = np.zeros(shape, dtype=bool)
    corners = np.reshape(boxes, (-1, 2, 2)).T
    low, high = np.moveaxis(in_cells(*corners, origin, resolution), 1, 0)
    low = np.floor(low + 1e-9).astype(int).clip(0)
    high = np.ceil(high - 1e-9).astype(int).clip(0)
    for left, bottom, right, top in zip(*low, *high, strict=True):
        covered[bottom:top, left:right] = True
    return covered


def distances_to(cells, side=1.0, reach=0.0):
    """Distance of the centre of every cell of a grid to the nearest of some cells, their centres or their edges.

    Some rows at once, so that next to the result it takes 9 bytes a cell for a moment (SciPy's own 48).

    Parameters
    ----------
    cells : (H, W) bool array
        Where some are; if there are none, the distances are no numbers to be used.
    side : float
        Of a cell in m.
    reach : float
        How far each of those cells reaches from its centre along x and y, in m: to its edges half a side.

    Returns
    -------
    (H, W) float array
        In m, 0 at the cells themselves.

    Examples
    --------
    >>> distances_to(np.array([[True, False, False], [False, False, False]]), 0.5).round(3).tolist()
    [[0.0, 0.5, 1.0], [0.5, 0.707, 1.118]]
    """
    asked = {"return_distances": False, "return_indices": True}
    nearest = scipy.ndimage.distance_transform_edt(~cells, side, **asked)
    distances, columns = np.empty(cells.shape), np.arange(cells.shape[1])
    some = max(AT_ONCE // max(cells.shape[1], 1), 1)
    for row in range(0, len(cells), some):
        near_row, near_column = nearest[:, row : row + some]
        rows = np.arange(row, row + len(near_row))[:, None]
        down, right = (near_row - rows) * side, (near_column - columns) * side
        if reach:
            down, right = (np.maximum(np.abs(each) - reach, 0) for each in (down, right))
        np.sqrt(down * down + right * right, out=distances[row : row + some])
    return distances
