"""Occupancy grid maps: built from a laser log with known poses, read and written as ROS and CARMEN maps."""

import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy import ndimage

from dollop import carmen
from dollop.files import FormatError, read_bytes, whole_file

OCCUPIED_FROM = 0.5
"""Probability from which a cell is occupied (CARMEN's `occupied_prob`)."""

MAX_CELLS = 100_000_000


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """How likely each cell of the plane is occupied.

    A cell is *occupied* from a probability of 0.5 on, *free* below, and *unknown* where no beam has been.

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
        object.__setattr__(self, "occupancy", np.asarray(self.occupancy, dtype=float))
        object.__setattr__(self, "origin", tuple(float(value) for value in self.origin))
        object.__setattr__(self, "resolution", float(self.resolution))
        if self.occupancy.ndim != 2 or self.occupancy.size == 0:
            raise ValueError(f"occupancy must be a grid of (H, W) cells, got shape {self.occupancy.shape}")
        wrong = (self.occupancy < 0) | (self.occupancy > 1)
        if wrong.any():
            raise ValueError(f"an occupancy must be in [0, 1], or NaN where unknown, got {self.occupancy[wrong][0]}")
        if not 0 < self.resolution < np.inf:
            raise ValueError(f"resolution must be positive and finite, got {self.resolution}")
        if len(self.origin) != 2 or not np.isfinite(self.origin).all():
            raise ValueError(f"origin must be a finite x, y, got {self.origin}")

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
            If the grid would have more than 100 million cells.

        Notes
        -----
        The counting model of D. Hähnel et al., "Map building with mobile robots in dynamic environments" (ICRA 2003).
        """
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
        """Read a ROS map_server map (`.yaml`, which names its `.pgm`) or a CARMEN map (`.map`).

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
        _check_is_map(path)
        content = carmen.read_map(path) if path.suffix == ".map" else _read_ros_map(path)
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
            The file; it appears whole or not at all.
        """
        path = Path(path)
        _check_is_map(path)
        if path.suffix == ".map":
            carmen.write_map(path, self.occupancy, self.origin, self.resolution)
        else:
            _write_ros_map(path, self)

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
        if not self.occupied.any():
            return np.full(self.occupancy.shape, np.inf)
        return ndimage.distance_transform_edt(~self.occupied, sampling=self.resolution)

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


def _check_is_map(path):
    if path.suffix not in (".map", ".yaml", ".yml"):
        raise FormatError("a map is named .yaml (ROS) or .map (CARMEN)", path)


def _frame(log, reach, resolution):
    """Corner and shape of a grid that holds the sensor and the ends of all beams, with a cell to spare."""
    if not (0 < resolution < np.inf):
        raise ValueError(f"resolution must be positive and finite, got {resolution}")
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


# ROS map_server (http://wiki.ros.org/map_server): a YAML of flat keys, and an image whose first row is the highest y.
# Grey v means the probability (255 - v) / 255, unless `negate`. Our own thresholds make 127 and 128 the unknown.
UNKNOWN_GREY = (127, 128)
ROS_MAP = """image: {image}
mode: trinary
resolution: {resolution!r}
origin: [{origin[0]!r}, {origin[1]!r}, 0.0]
negate: 0
occupied_thresh: 0.505
free_thresh: 0.495
"""


def _write_ros_map(path, grid):
    image = path.with_suffix(".pgm")
    grey = np.rint(255 * (1 - np.nan_to_num(grid.occupancy)))
    grey = np.where(grid.occupied, np.minimum(grey, UNKNOWN_GREY[0] - 1), np.maximum(grey, UNKNOWN_GREY[1] + 1))
    grey = np.where(grid.unknown, UNKNOWN_GREY[0], grey).astype(np.uint8)
    height, width = grey.shape
    # The picture first: a YAML that is there has its picture.
    with whole_file(image) as stream:
        stream.write(b"P5\n%d %d\n255\n" % (width, height) + grey[::-1].tobytes())
    with whole_file(path) as stream:
        text = ROS_MAP.format(image=image.name, resolution=grid.resolution, origin=grid.origin)
        stream.write(text.encode())


def _read_ros_map(path):
    keys = _flat_yaml(path)
    for key in ("image", "resolution", "origin"):
        if key not in keys:
            raise FormatError(f"the key {key!r} is missing", path)
    resolution = _number(path, keys, "resolution")
    origin = [_as_number(path, "origin", text) for text in keys["origin"].strip("[]").split(",")]
    if len(origin) != 3 or origin[2] != 0:
        raise FormatError(f"origin must be [x, y, 0] (a turned map is not supported), got {keys['origin']}", path)
    # os.path and not pathlib, which lets names that are too long or hold a zero byte through as other errors.
    if not os.path.isfile(path.parent / keys["image"]):
        raise FormatError(f"its picture {keys['image']!r} is missing", path)
    grey = _read_pgm(path.parent / keys["image"])[::-1]
    return _ros_occupancy(path, keys, grey), origin[:2], resolution


def _ros_occupancy(path, keys, grey):
    """Probabilities by the map's `mode`, set so that occupied and free cells are what the file's thresholds say."""
    mode = keys.get("mode", "trinary")
    if mode == "raw":
        return np.where(grey <= 100, grey / 100, np.nan)
    if mode not in ("trinary", "scale"):
        raise FormatError(f"mode must be trinary, scale or raw, got {mode!r}", path)
    probability = grey / 255 if keys.get("negate", "0") in ("1", "true") else (255 - grey) / 255
    occupied = probability > _number(path, keys, "occupied_thresh", 0.65)
    free = probability < _number(path, keys, "free_thresh", 0.196)
    between = np.nan if mode == "trinary" else probability
    below = np.nextafter(OCCUPIED_FROM, 0)
    certain = np.where(occupied, np.maximum(probability, OCCUPIED_FROM), np.minimum(probability, below))
    return np.where(occupied | free, certain, between)


def _flat_yaml(path):
    """The keys of a YAML file that has no nesting but a list in one line, which is all that map_server writes."""
    keys = {}
    for number, line in enumerate(read_bytes(path).decode("utf-8", "replace").splitlines(), 1):
        line = re.sub(r"(^|\s)#.*", "", line).strip()
        if not line or line == "---":
            continue
        key, colon, value = line.partition(":")
        if not colon:
            raise FormatError(f"expected 'key: value', got {line[:40]!r}", path, number)
        keys[key.strip()] = value.strip().strip("\"'")
    return keys


def _number(path, keys, key, default=None):
    return default if key not in keys else _as_number(path, key, keys[key])


def _as_number(path, key, text):
    try:
        return float(text)
    except ValueError:
        raise FormatError(f"{key} must be a number, got {text!r}", path) from None


def _read_pgm(path):
    """Grey values (H, W) of a binary (P5) or plain (P2) PGM of at most 255 steps, scaled to 255."""
    content = read_bytes(path)
    head = re.match(rb"(P[25])(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)\s", content)
    if not head:
        raise FormatError("not a PGM picture (P5 or P2)", path)
    width, height, steps = (int(number) for number in head.groups()[1:])
    if not (width > 0 and height > 0 and 0 < steps <= 255):
        raise FormatError(f"a PGM of {width} x {height} pixels and {steps} steps, expected up to 255 steps", path)
    body = content[head.end() :]
    try:
        pixels = np.frombuffer(body, np.uint8) if head[1] == b"P5" else np.array(body.split(), dtype=int)
    except ValueError:
        raise FormatError("a pixel that is no number", path) from None
    if pixels.size < width * height:
        raise FormatError(f"{pixels.size} pixels, expected {width} x {height}", path)
    if pixels.min() < 0 or pixels.max() > steps:
        raise FormatError(f"pixels from {pixels.min()} to {pixels.max()}, expected 0 to {steps}", path)
    return pixels[: width * height].reshape(height, width) * (255 / steps)
