"""Occupancy grid maps: built from a laser log with known poses, read and written as ROS and CARMEN maps."""

import io
import json
import os
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy import ndimage

from dollop import carmen
from dollop.files import FormatError, read_bytes, whole_file
from dollop.laser import check_positive

OCCUPIED_FROM = 0.5
"""Probability from which a cell is occupied (CARMEN's `occupied_prob`)."""

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
            The file; it appears whole or not at all, and the picture with it.
        """
        path = Path(path)
        check_is_map(path)
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
    # A name that could mean something else to YAML goes in quotes, in which YAML reads what JSON writes.
    name = image.name if re.fullmatch(r"\w[\w.-]*", image.name) else json.dumps(image.name, ensure_ascii=False)
    text = ROS_MAP.format(image=name, resolution=grid.resolution, origin=grid.origin)
    with whole_file(path) as stream, whole_file(image) as picture:
        stream.write(text.encode("utf-8", "surrogateescape"))
        stream.flush()  # so that nothing is left to fail once the picture has its name
        picture.write(b"P5\n%d %d\n255\n" % (width, height) + grey[::-1].tobytes())


def _read_ros_map(path):
    keys = _flat_yaml(path)
    for key in ("image", "resolution", "origin"):
        if key not in keys:
            raise FormatError(f"the key {key!r} is missing", path)
    resolution = _number(path, keys, "resolution")
    origin = [_as_number(path, "origin", text) for text in _items(keys["origin"])]
    # A millionth of a radian is a tenth of a millimetre in a hundred metres: the rounding of some other program.
    if len(origin) != 3 or not abs(origin[2]) <= 1e-6:
        raise FormatError(f"origin must be [x, y, 0] (a turned map is not supported), got {keys['origin']!r}", path)
    # os.path and not pathlib, which lets names that are too long or hold a zero byte through as other errors.
    if not os.path.isfile(path.parent / keys["image"]):
        raise FormatError(f"its picture {keys['image']!r} is missing", path)
    grey = _read_picture(path.parent / keys["image"])[::-1]
    return _ros_occupancy(path, keys, grey), origin[:2], resolution


def _ros_occupancy(path, keys, grey):
    """Probabilities by the map's `mode`, set so that occupied and free cells are what the file's thresholds say."""
    mode, negate = keys.get("mode", "trinary"), keys.get("negate", "0")
    if mode not in ("trinary", "scale", "raw"):
        raise FormatError(f"mode must be trinary, scale or raw, got {mode!r}", path)
    if negate.lower() not in ("0", "false", "1", "true"):
        raise FormatError(f"negate must be 0, 1, false or true, got {negate!r}", path)
    above, below = _number(path, keys, "occupied_thresh", 0.65), _number(path, keys, "free_thresh", 0.196)
    if not 0 <= below <= above <= 1:
        rule = "thresholds must be 0 <= free_thresh <= occupied_thresh <= 1"
        raise FormatError(f"{rule}, got free_thresh {below:g} and occupied_thresh {above:g}", path)
    if mode == "raw":
        return np.where(grey <= 100, grey / 100, np.nan)
    probability = (grey if negate.lower() in ("1", "true") else 255 - grey) / 255
    occupied, free = probability > above, probability < below
    between = np.nan if mode == "trinary" else probability
    just_free = np.nextafter(OCCUPIED_FROM, 0)
    certain = np.where(occupied, np.maximum(probability, OCCUPIED_FROM), np.minimum(probability, just_free))
    return np.where(occupied | free, certain, between)


def _flat_yaml(path):
    """Keys and values of a YAML file that has no nesting but lists, which is all that maps need; a value is text."""
    keys, key = {}, None
    lines = read_bytes(path).decode("utf-8", "surrogateescape").split("\n")
    for number, line in enumerate(lines, 1):
        entry = re.match(r"\s*(\w+)\s*:(?:\s+(.*))?$", line)
        if entry:
            key, keys[entry[1]] = entry[1], _scalar(path, number, entry[2] or "")
            continue
        text = _scalar(path, number, line)
        if not text or text in ("---", "..."):
            continue
        if key is None or not (line[0] in " \t-" or keys[key].startswith("[")):
            raise FormatError(f"expected 'key: value', got {text[:40]!r}", path, number)
        keys[key] = f"{keys[key]} {text}".strip()
    return keys


def _scalar(path, number, text):
    """A value of YAML without its comment and its quotes."""
    text = text.strip()
    quoted = re.match(r"""("(?:\\.|[^"\\])*"|'(?:''|[^'])*')\s*(?:#.*)?$""", text)
    if not quoted:
        return re.sub(r"(^|\s)#.*", "", text).strip()
    if text.startswith("'"):
        return quoted[1][1:-1].replace("''", "'")
    # JSON reads what stands in double quotes, but for YAML's \xE9, which is its \u00E9.
    text = re.sub(r"\\(x?)(.)", lambda m: rf"\u00{m[2]}" if m[1] else m[0], quoted[1])
    try:
        return json.loads(text, strict=False)
    except ValueError:
        raise FormatError(f"quotes that cannot be read: {quoted[1][:40]!r}", path, number) from None


def _items(text):
    """The items of a list of numbers, written in brackets or with a dash before each."""
    return re.split(r"(?:^|\s)-\s", text)[1:] if text.startswith("- ") else text.strip("[]").split(",")


def _number(path, keys, key, default=None):
    return default if key not in keys else _as_number(path, key, keys[key])


def _as_number(path, key, text):
    try:
        return float(text)
    except ValueError:
        raise FormatError(f"{key} must be a number, got {text!r}", path) from None


def _read_picture(path):
    """Grey values (H, W) from 0 to 255 of a PGM or PNG picture, told by its content."""
    content = read_bytes(path)
    return _png(path, content) if content.startswith(b"\x89PNG") else _pgm(path, content)


def _png(path, content):
    """The mean of the colours, as in map_server; a transparent pixel has no meaning in a map."""
    from matplotlib.image import imread  # not needed, and slow to import, for any other map

    try:
        pixels = np.atleast_3d(imread(io.BytesIO(content), format="png"))
    except Exception as error:  # Pillow meets a broken picture with whatever its parsers happen to raise
        raise FormatError(f"not a readable PNG picture ({error})", path) from None
    colours = 1 if pixels.shape[2] < 3 else 3
    if (pixels[..., colours:] < 1).any():
        raise FormatError("a map must have no transparent pixels", path)
    return np.rint(255 * pixels[..., :colours].mean(axis=2))


def _pgm(path, content):
    """Grey values (H, W) of a binary (P5) or plain (P2) PGM of at most 255 steps, scaled to 255."""
    head = re.match(rb"(P[25])(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)\s", content)
    if not head:
        raise FormatError("neither a PNG nor a PGM picture (P5 or P2)", path)
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
