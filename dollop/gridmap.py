"""Occupancy grid maps: built from a laser log with known poses, read and written as ROS and CARMEN maps."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy import ndimage

from dollop.formats import carmen, ros_map
from dollop.formats.carmen import OCCUPIED_FROM
from dollop.formats.files import FormatError
from dollop.laser import check_positive

MAX_CELLS = 100_000_000


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """How likely each cell of the plane is occupied.

    A cell is *occupied* from a probability of 0.5 on, *free* below, and *unknown* where no beam has been.

    The array is a copy, and read-only: what has been checked stays as it is.

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
        If the occupancy is not a grid of probabilities, or resolution or origin are not usable.

    Examples
    --------
    >>> grid = OccupancyGrid([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]], origin=(0.0, 0.0), resolution=0.1)
    >>> grid.distance_at([[0.05, 0.05], [0.25, 0.15], [0.35, 0.0]]).round(3).tolist()
    [0.2, 0.0, nan]
    """

    occupancy: np.ndarray
    origin: tuple
    resolution: float

    def __post_init__(self):
        object.__setattr__(self, "occupancy", np.array(self.occupancy, dtype=float))
        object.__setattr__(self, "origin", tuple(float(value) for value in self.origin))
        object.__setattr__(self, "resolution", float(self.resolution))
        if self.occupancy.ndim != 2 or self.occupancy.size == 0:
            raise ValueError(f"occupancy must be a grid of (H, W) cells, got shape {self.occupancy.shape}")
        wrong = (self.occupancy < 0) | (self.occupancy > 1)
        if wrong.any():
            raise ValueError(f"an occupancy must be in [0, 1], or NaN where unknown, got {self.occupancy[wrong][0]}")
        check_positive("resolution", self.resolution)
        if len(self.origin) != 2 or not np.isfinite(self.origin).all():
            raise ValueError(f"origin must be a finite x, y, got {self.origin}")
        self.occupancy.flags.writeable = False

    @classmethod
    def from_log(cls, log, resolution=0.05, max_range=20.0):
        """Count hits and passes of every beam; a cell's occupancy is hits / (hits + passes).

        Where a beam ends, its cell is hit; the cells before are passed, each as long as the beam runs in it. A beam
        that does not come back passes all cells up to the maximum range. What moves through the scene is thus swept
        away by the beams that pass there later; what stands still for most of the log stays.

        Parameters
        ----------
        log : LaserLog
            Scans with the sensor's poses.
        resolution : float, optional
            Side of a cell in m.
        max_range : float, optional
            Up to which distance from the sensor to believe a beam, in m: 20 m as in CARMEN's scan matcher (`vasco`).

        Returns
        -------
        OccupancyGrid
            Large enough for all that is hit or passed.

        Raises
        ------
        ValueError
            If the grid would have more than 100 million cells, or a parameter is not positive and finite.

        Notes
        -----
        The counting model of D. Hähnel et al., "Map building with mobile robots in dynamic environments" (ICRA 2003).
        """
        check_positive("resolution", resolution)
        check_positive("max_range", max_range)
        reach = np.minimum(log.ranges, min(max_range, log.max_range))
        origin, shape = _frame(log, reach, resolution)
        hits, passes = np.zeros(np.prod(shape)), np.zeros(np.prod(shape))
        for scans in np.array_split(np.arange(len(log)), 1 + len(log) * log.angles.size // 10_000):
            ends, samples = _beam_samples(log, scans, reach[scans], log.ranges[scans] <= max_range, resolution)
            hits += np.bincount(_flat(ends, origin, resolution, shape), minlength=hits.size)
            passes += np.bincount(_flat(samples, origin, resolution, shape), minlength=hits.size)
        seen = hits + passes
        occupancy = np.divide(hits, seen, out=np.full(hits.size, np.nan), where=seen > 0)
        return cls(occupancy.reshape(shape), origin, resolution)

    @classmethod
    def load(cls, path):
        """Read a ROS map_server map (`.yaml`, which names its picture, PGM or PNG) or a CARMEN map (`.map`).

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        OccupancyGrid

        Raises
        ------
        FormatError
            If the file is not what its name says.
        """
        path = Path(path)
        check_is_map(path)
        content = carmen.read_map(path) if path.suffix == ".map" else ros_map.read_map(path)
        try:
            return cls(*content)
        except ValueError as error:
            raise FormatError(str(error), path) from None

    def save(self, path):
        """Write a ROS map_server map (`.yaml`, and beside it a `.pgm` of the same name) or a CARMEN map (`.map`).

        A CARMEN map keeps the occupancy as float32, a ROS map in 256 steps of grey.

        Parameters
        ----------
        path : str or Path
            The file; it appears whole or not at all, and the picture with it.
        """
        path = Path(path)
        check_is_map(path)
        write_map = carmen.write_map if path.suffix == ".map" else ros_map.write_map
        write_map(path, self.occupancy, self.origin, self.resolution)

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
        """xmin, xmax, ymin, ymax in m, as matplotlib's `imshow` takes them (with `origin="lower"`)."""
        height, width = self.occupancy.shape
        (x, y), side = self.origin, self.resolution
        return x, x + width * side, y, y + height * side

    def world_to_cell(self, points):
        """Cells that hold the points, on the map or off it.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m, finite.

        Returns
        -------
        (..., 2) int array
            Row and column.
        """
        offsets = np.asarray(points, dtype=float) - self.origin
        return np.floor(offsets[..., ::-1] / self.resolution).astype(int)

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
        """
        return (np.asarray(cells)[..., ::-1] + 0.5) * self.resolution + self.origin

    def covers(self, points):
        """Which points lie on the map.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m; NaN lies nowhere.

        Returns
        -------
        (...,) bool array
        """
        xmin, xmax, ymin, ymax = self.extent
        x, y = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
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
        if self.occupied.any():
            distances = ndimage.distance_transform_edt(~self.occupied, sampling=self.resolution)
        else:
            distances = np.full(self.occupancy.shape, np.inf)
        distances.flags.writeable = False
        return distances

    def distance_at(self, points):
        """Distance from the cell of each point to the nearest occupied one.

        Parameters
        ----------
        points : (..., 2) array_like
            x, y in m.

        Returns
        -------
        (...,) float array
            Metres; NaN off the map, where nothing is known (see `covers`), so that it is neither near nor far.
        """
        points = np.asarray(points, dtype=float)
        inside = self.covers(points)
        rows, cols = self.world_to_cell(points[inside]).T
        distances = np.full(inside.shape, np.nan)
        distances[inside] = self.distance_field()[rows, cols]
        return distances


def check_is_map(path):
    """Raise FormatError if the name is not one of a map."""
    if Path(path).suffix not in (".map", ".yaml", ".yml"):
        raise FormatError("a map is named .yaml (ROS) or .map (CARMEN)", path)


def _frame(log, reach, resolution):
    """Corner and shape of a grid that holds the sensor and the ends of all beams, with a cell to spare."""
    bearings = log.poses[:, 2, None] + log.angles
    x = log.poses[:, 0, None] + reach * np.cos(bearings)
    y = log.poses[:, 1, None] + reach * np.sin(bearings)
    corners = [(min(v.min(), s.min()), max(v.max(), s.max())) for v, s in ((x, log.poses[:, 0]), (y, log.poses[:, 1]))]
    (left, right), (low, high) = [(np.floor(a / resolution) - 1, np.floor(b / resolution) + 2) for a, b in corners]
    if (right - left) * (high - low) > MAX_CELLS:
        raise ValueError(f"{right - left:.0f} x {high - low:.0f} cells of {resolution} m are more than {MAX_CELLS}")
    return (left * resolution, low * resolution), (int(high - low), int(right - left))


def _beam_samples(log, scans, reach, is_hit, resolution):
    """Ends of the beams that hit something, and points one cell apart along all beams, up to a cell before the end."""
    bearings = log.poses[scans, 2, None] + log.angles
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    starts = np.broadcast_to(log.poses[scans, None, :2], directions.shape)
    ends = (starts + reach[..., None] * directions)[is_hit]
    # A cell's diagonal before its hit a beam has left no trace yet in the cell that it hits.
    counts = np.maximum((reach / resolution - np.sqrt(2) * is_hit).astype(int), 0).ravel()
    along = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    # A laser that stands still must not step over the same corners in every scan: the golden ratio spreads the phases.
    phases = np.repeat(scans * ((np.sqrt(5) - 1) / 2) % 1, log.angles.size)
    along = along + np.repeat(phases, counts)
    samples = np.repeat(starts.reshape(-1, 2), counts, axis=0)
    samples += np.repeat(directions.reshape(-1, 2), counts, axis=0) * (along * resolution)[:, None]
    return ends, samples


def _flat(points, origin, resolution, shape):
    cols, rows = np.floor((points - origin) / resolution).astype(int).T
    return rows * shape[1] + cols
