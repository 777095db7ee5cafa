"""Foreground objects: from laser scans to blobs and their centroids (Sec. II).

As the paper does it after Fod et al. (ICRA 2002): a reading with no background object near it is a
foreground cell; cells are remembered autoregressively in a foreground grid; adjacent occupied
cells are a blob; a blob that is large enough is a foreground object.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dollop.checks import check_positive, checked_number
from dollop.gridmap import flat_cells, in_cells, in_metres

_PLACE, _SENSOR, _SINCE, _UNTIL, _STOOD = slice(0, 2), slice(2, 4), 4, 5, slice(0, 6)
_VALUE, _PASSED, _LOOKS, _COLUMNS = 6, 7, 8, 9
LEAST_GAIN = 1e-9
"""Of a foreground grid: less remembers for longer than anybody looks."""
LONG_MEAN = 50
"""Looks over which the mean of a cell's readings is taken."""
THROUGH = 0.25
"""m by which a beam must have gone on behind a place on the map to have gone through it."""
FLOOR_EVERY, FARTHEST_SEEN = 1.0, 20.0
"""s: the floor is looked at no more often; and m up to which a beam is believed to have seen it."""
MOST_FLOOR = 5_000_000
"""Cells of the floor, of 10 cm on a map of 200 m x 200 m; on a larger one they are larger."""
SLOT = 0.15
"""s: what stands is looked at no more often, however fast the laser is."""
LONGEST_STEP = 0.5
"""s: a pause between scans counts for no more."""
BEYOND = 0.10
"""m by which a beam must have gone on behind a cell to have passed it."""
LEAVING = 0.6
"""s without a hit after which a cell that beams pass stands no more."""
TOUCH = 0.06
"""m round a cell that stands in which a reading belongs to it."""


@dataclass(frozen=True, eq=False)
class Blobs:
    """Foreground objects of one moment: adjacent occupied cells that envelop enough area (Sec. II).

    Attributes
    ----------
    areas : (K,) float array
        Enveloped area in m^2.
    cells : (M, 2) int array
        Row and column of every cell of the K blobs.
    labels : (M,) int array
        Which blob each cell belongs to, 0..K-1.
    """

    areas: np.ndarray
    cells: np.ndarray
    labels: np.ndarray

    def __len__(self):
        return len(self.areas)


def endpoints(log):
    """World coordinates of every laser reading.

    Parameters
    ----------
    log : LaserLog
        T scans of B beams.

    Returns
    -------
    (T, B, 2) float array
        m; `nan` where nothing came back.

    Examples
    --------
    >>> from dollop.laser import LaserLog
    >>> log = LaserLog([0.0], [[1.0, np.inf]], [0.0, 1.0], [[2.0, 0.0, np.pi / 2]], max_range=8.0)
    >>> endpoints(log)
    array([[[ 2.,  1.],
            [nan, nan]]])
    """
    ranges = np.where(np.isfinite(log.ranges), log.ranges, np.nan)
    bearings = log.poses[:, 2:] + log.angles
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    return log.poses[:, None, :2] + ranges[..., None] * directions


def foreground_mask(points, background, background_radius=0.20):
    """Which readings the background map does not explain (Sec. II).

    Parameters
    ----------
    points : (..., 2) float array
        Readings in m, `nan` where nothing came back.
    background : OccupancyGrid
        The background occupancy grid map.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).

    Returns
    -------
    (...) bool array
        False where nothing came back, and outside the map.

    Raises
    ------
    ValueError
        If more than a tenth of the readings lie outside the map, or the radius is not positive and
        finite.

    Examples
    --------
    >>> from dollop.gridmap import OccupancyGrid
    >>> wall = OccupancyGrid([[1.0, 0.0, 0.0, 0.0]], origin=(0.0, 0.0), resolution=0.1)
    >>> foreground_mask(np.array([[0.25, 0.05], [0.35, 0.05], [np.nan, np.nan]]), wall)
    array([False,  True, False])
    """
    check_positive("background_radius", background_radius)
    distances = background.distance_at(points)  # nan outside the map
    returned = np.count_nonzero(np.isfinite(points[..., 0]))
    outside = returned - np.count_nonzero(~np.isnan(distances))
    if outside > 0.1 * returned:
        lie = f"{outside} of {returned} readings ({100 * outside / returned:.0f} %) lie outside it"
        raise ValueError(f"the background map must cover the scans: {lie}")
    return distances > background_radius


def surface_points(points, mask, spacing=0.05, jump=0.30):
    """Foreground readings, and the surface between those of neighbouring beams (a reconstruction).

    Beams fan out: 5 m away one degree is 9 cm, more than a cell, and a torso would fall apart into
    separate blobs. Two neighbouring foreground readings closer than `jump` lie on one surface,
    which is filled in between.

    Parameters
    ----------
    points : (T, B, 2) float array
        Readings in m.
    mask : (T, B) bool array
        Foreground readings.
    spacing : float
        Largest gap left on a surface, in m.
    jump : float
        Neighbouring readings farther apart than this, in m, are different surfaces.

    Returns
    -------
    scan : (M,) int array
        Scan of each point, ascending.
    points : (M, 2) float array
        m.

    Examples
    --------
    >>> beams = np.array([[[1.0, 0.0], [1.0, 0.12], [1.0, 2.0]]])
    >>> surface_points(beams, np.ones((1, 3), bool), spacing=0.1)[1][:, 1].round(2)
    array([0.  , 0.12, 2.  , 0.04, 0.08])
    """
    scan, beam = np.nonzero(mask)
    readings = points[scan, beam]
    step = np.diff(readings, axis=0)
    gap = np.hypot(step[:, 0], step[:, 1])
    joined = (np.diff(scan) == 0) & (np.diff(beam) == 1) & (gap < jump) & (gap > spacing)
    pieces = int(np.ceil(jump / spacing))
    fractions = np.arange(1, pieces) / pieces
    between = readings[:-1][joined][:, None] + fractions[:, None] * step[joined][:, None]
    scans = np.concatenate([scan, np.repeat(scan[:-1][joined], pieces - 1)])
    order = np.argsort(scans, kind="stable")
    return scans[order], np.concatenate([readings, between.reshape(-1, 2)])[order]


def seen_free(points, pose, angles, ranges, margin=0.0):
    """Whether the beam nearest in bearing to each point went on beyond it (Sec. II).

    A beam stands for half a step to either side, so that a laser that looks all round has no gap
    where it begins.

    Parameters
    ----------
    points : (M, 2) float array
        m.
    pose : (3,) float array
        Sensor x, y in m, theta in rad.
    angles, ranges : (B,) float arrays
        One scan: bearings in rad, ranges in m, `inf` where nothing came back.
    margin : float
        By how much the beam must have gone on, in m.

    Returns
    -------
    (M,) bool array
        False outside the field of view.

    Examples
    --------
    What stands behind a reading is in its shadow, not free:

    >>> points = np.array([[1.0, 0.0], [3.0, 0.0], [-1.0, 0.0]])
    >>> seen_free(points, np.zeros(3), np.array([-0.1, 0.0, 0.1]), np.full(3, 2.0))
    array([ True, False, False])
    """
    offset = points - pose[:2]
    # From the right edge of the field of view on, a bearing is the same wherever the sensor's
    # frame has its zero.
    step = (angles[-1] - angles[0]) / max(len(angles) - 1, 1)
    right = angles[0] - step / 2
    bearing = (np.arctan2(offset[:, 1], offset[:, 0]) - (pose[2] + right)) % (2 * np.pi)
    inside = bearing <= len(angles) * step
    beam = np.rint(np.interp(bearing, angles - right, np.arange(len(angles)))).astype(np.intp)
    return inside & (ranges[beam] > np.hypot(offset[:, 0], offset[:, 1]) + margin)


def seen_through(places, pose, angles, ranges):
    """How much of the background is in view of a scan, and how much of that the beams go through.

    On a map that fits, hardly anything: what stands in the way of the background is nearer. Beams
    beside the one at a place must go on as well, or the edges of furniture would count.

    Parameters
    ----------
    places : (M, 2) float array
        Where the map has something, in m.
    pose : (3,) float array
        Sensor x, y in m, theta in rad.
    angles, ranges : (B,) float arrays
        The scan; a beam that does not come back tells nothing.

    Returns
    -------
    through, in_view : int
        Numbers of places.

    Examples
    --------
    The wall that the map has at 1 m is not there:

    >>> angles = np.radians([-2.0, -1.0, 0.0, 1.0, 2.0])
    >>> seen_through(np.array([[1.0, 0.0], [2.0, 0.0]]), np.zeros(3), angles, np.full(5, 2.0))
    (1, 2)
    """
    believed = np.where(np.isfinite(ranges), ranges, 0.0)
    in_view = seen_free(places, pose, angles, believed, -THROUGH)
    aside = np.radians(1.0) * np.array([[0, 0, -1], [0, 0, 0], [0, 0, 1]])
    through = [seen_free(places[in_view], pose + turn, angles, believed, THROUGH) for turn in aside]
    return int(np.logical_and.reduce(through).sum()), int(in_view.sum())


class ForegroundGrid:
    """The foreground occupancy grid: a cell follows what the laser sees there (Sec. II).

        g <- (1 - gain) g + gain * hit        for cells that were hit or that a beam passed through

    Cells that no beam reached keep their value: what stands in the shadow of the user is not
    erased. That the memory is autoregressive is the paper's; what it does in the shadow is a
    reconstruction.

    Parameters
    ----------
    background : OccupancyGrid
        Gives origin, resolution and shape.
    gain : float
        Weight of the newest scan, in (0, 1]. A high gain follows a walker without dragging a tail;
        a low one remembers what is static.

    Raises
    ------
    ValueError
        A gain below a billionth or above 1.

    Examples
    --------
    A cell that was hit twice keeps its value while something nearer casts a shadow on it:

    >>> from dollop.gridmap import OccupancyGrid
    >>> grid = ForegroundGrid(OccupancyGrid(np.zeros((1, 9)), (0.0, 0.0), 0.1), gain=0.6)
    >>> pose, angles = np.array([0.0, 0.05, 0.0]), np.array([-0.1, 0.0, 0.1])
    >>> for _ in range(2):
    ...     grid.update(np.array([8]), pose, angles, np.full(3, 0.85))
    >>> grid.update(np.array([4]), pose, angles, np.full(3, 0.45))
    >>> grid.value[[4, 8]]
    array([0.6 , 0.84])
    """

    def __init__(self, background, gain):
        self.gain = checked_number("gain", gain, LEAST_GAIN, 1)
        self.shape = background.occupancy.shape
        self.origin = np.asarray(background.origin[:2], dtype=float)
        self.resolution = background.resolution
        self.value = np.zeros(self.shape).ravel()
        self.sensed = np.zeros(self.value.size, dtype=bool)
        self._active = np.zeros(0, dtype=np.intp)

    def update(self, hits, pose, angles, ranges):
        """Take in one scan (Sec. II).

        Parameters
        ----------
        hits : (M,) int array
            Flat indices of the cells that hold a foreground reading; repeats allowed.
        pose : (3,) float array
            Sensor x, y in m, theta in rad.
        angles, ranges : (B,) float arrays
            The scan: bearings in rad, ranges in m, `inf` where nothing came back.
        """
        self.sensed[self._active] = False
        self.sensed[hits] = True
        fresh = hits[self.value[hits] == 0]
        if len(fresh):
            self._active = np.concatenate([self._active, np.unique(fresh)])
        cells = self._active
        hit = self.sensed[cells]
        passed = ~hit & seen_free(self.centres(cells), pose, angles, ranges, self.resolution)
        value = self.value[cells]
        value = np.where(hit | passed, (1 - self.gain) * value + self.gain * hit, value)
        value[value < 0.5 * self.gain] = 0.0
        self.value[cells] = value
        self._active = cells[value > 0]

    def centres(self, cells):
        """Centres of cells.

        Parameters
        ----------
        cells : (M,) int array
            Flat indices.

        Returns
        -------
        (M, 2) float array
            m.
        """
        row, column = np.divmod(cells, self.shape[1])
        return np.column_stack(in_metres(column + 0.5, row + 0.5, self.origin, self.resolution))

    def blobs(self, threshold=0.5, min_area=0.01):
        """Blobs of occupied cells, remembered ones included (Sec. II).

        Parameters
        ----------
        threshold : float
            A cell above it is occupied.
        min_area : float
            A blob must envelop at least this area, in m^2 (Sec. II: 100 square centimetres).

        Returns
        -------
        Blobs
        """
        occupied = self._active[self.value[self._active] > threshold]
        return find_blobs(np.column_stack(np.divmod(occupied, self.shape[1])), self.resolution, min_area)

    def objects(self, threshold=0.5, min_area=0.01, stride=0.0):
        """Centroids of the foreground objects that the last scan met (Sec. II).

        Memory holds cells together that are one object; what it holds in the shadow is not where
        the object is now. So the centroid is that of a blob's cells that were hit, and a blob with
        none is not sensed.

        Parameters
        ----------
        threshold, min_area : float
            As for `blobs`.
        stride : float
            Blobs nearer to each other than this, in m, are one object: the legs of a walker, to a
            laser that sees no more of them.

        Returns
        -------
        (K, 2) float array
            m.
        """
        blobs = self.blobs(threshold, min_area)
        hit = self.sensed[blobs.cells @ [self.shape[1], 1]]
        cells, labels = blobs.cells[hit], blobs.labels[hit]
        if stride > 0 and len(blobs) > 1:
            centroids = _blob_centroids(blobs.cells, blobs.labels, self.origin, self.resolution)
            labels = near_together(centroids, stride)[labels]
        return _blob_centroids(cells, labels, self.origin, self.resolution)


def near_together(points, distance):
    """Group points: chains of points nearer to each other than a distance are one group.

    Parameters
    ----------
    points : (M, 2) float array
        m.
    distance : float
        m.

    Returns
    -------
    (M,) int array
        Numbers of the groups, from 0.

    Examples
    --------
    >>> near_together(np.array([[0.0, 0.0], [5.0, 0.0], [0.8, 0.0], [1.6, 0.0]]), 1.0)
    array([0, 1, 0, 0], dtype=int32)
    """
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    return scipy.sparse.csgraph.connected_components(apart < distance, directed=False)[1]


def _blob_centroids(cells, labels, origin, resolution):
    """Mean (K, 2) in m of the cells (M, 2) of each blob that has any; labels (M,) from 0."""
    size = np.bincount(labels)
    row, column = (np.bincount(labels, each)[size > 0] / size[size > 0] for each in cells.T)
    return np.column_stack(in_metres(column + 0.5, row + 0.5, origin, resolution))


def find_blobs(cells, resolution, min_area=0.01):
    """Group occupied cells into blobs and keep the large ones (Sec. II).

    Parameters
    ----------
    cells : (M, 2) int array
        Row and column of each occupied cell.
    resolution : float
        m per cell.
    min_area : float
        Smallest area of a foreground object in m^2 (Sec. II).

    Returns
    -------
    Blobs

    Examples
    --------
    Cells that touch at a corner are one blob:

    >>> find_blobs(np.array([[0, 0], [1, 1], [8, 8]]), 0.1).labels
    array([0, 0, 1])
    """
    if len(cells) == 0:
        return Blobs(np.zeros(0), np.zeros((0, 2), int), np.zeros(0, int))
    rows, columns = _closed_up(cells[:, 0]), _closed_up(cells[:, 1])
    window = np.zeros((rows.max() + 1, columns.max() + 1), dtype=bool)
    window[rows, columns] = True
    labelled, count = scipy.ndimage.label(window, np.ones((3, 3)))  # adjacent also at corners
    labels = labelled[rows, columns] - 1
    areas = resolution**2 * np.bincount(labels, minlength=count)
    large = areas >= min_area - 1e-12
    kept = large[labels]
    return Blobs(areas[large], cells[kept], (np.cumsum(large) - 1)[labels[kept]])


def _closed_up(index):
    """Close gaps along one axis to at most one empty line: fewer cells, the same blobs."""
    order = np.argsort(index)
    closed = np.zeros_like(index)
    closed[order[1:]] = np.cumsum(np.minimum(np.diff(index[order]), 2))
    return closed


def bounding_boxes(blobs, origin, resolution):
    """Boxes enveloping each blob's cells.

    Parameters
    ----------
    blobs : Blobs
        K foreground objects.
    origin : (2,) float array
        Lower left corner of the grid in m.
    resolution : float
        m per cell.

    Returns
    -------
    (K, 4) float array
        xmin, ymin, xmax, ymax in m.

    Examples
    --------
    >>> bounding_boxes(find_blobs(np.array([[0, 0], [1, 2], [1, 1]]), 0.5), np.zeros(2), 0.5)
    array([[0. , 0. , 1.5, 1. ]])
    """
    boxes = np.empty((len(blobs), 4))
    for k in range(len(blobs)):
        cells = blobs.cells[blobs.labels == k]
        (bottom, left), (top, right) = cells.min(axis=0), cells.max(axis=0) + 1
        boxes[k, :2] = in_metres(left, bottom, origin, resolution)
        boxes[k, 2:] = in_metres(right, top, origin, resolution)
    return boxes


# ---- what stands, remembered in seconds (beyond the paper)


class StandingCells:
    """Cells of the map where something stands, and since when (Sec. II, in seconds).

        v <- v + (1 - exp(-dt / tau)) (hit - v),      tau = after / log 2

    for a cell that was hit or that a beam passed, dt the time in s since the last look, so that
    what is hit stands `after` seconds, whatever the rate of the scans. Cells in the shadow keep v.

    Parameters
    ----------
    background : OccupancyGrid
        Gives origin, resolution and shape.
    after : float
        s.

    Attributes
    ----------
    known_since : (H * W,) float array
        At each cell, and `TOUCH` m round it, since when in s something stands there, else `inf`.
    gone : dict of int to (6,) tuple
        By cell where something stood and is no more: place (2) and sensor (2) in m, since, until.

    Examples
    --------
    What is hit for longer than 1.2 s stands there, whether it is looked at five or fifty times:

    >>> from dollop.gridmap import OccupancyGrid
    >>> background = OccupancyGrid(np.zeros((1, 30)), (0.0, 0.0), 0.1)
    >>> pose, angles = np.array([0.0, 0.05, 0.0]), np.array([-0.1, 0.0, 0.1])
    >>> for looks in (5, 50):
    ...     stands = StandingCells(background)
    ...     for t in np.linspace(0, 1.6, looks):
    ...         if stands.due(t):
    ...             stands.look(t, np.array([8]), np.array([[0.85, 0.05]]), pose, angles, np.full(3, 0.85))
    ...     stands.standing()
    array([[0.85, 0.05, 0.  , 0.05, 0.  ,  inf]])
    array([[0.85, 0.05, 0.  , 0.05, 0.  ,  inf]])
    """

    def __init__(self, background, after=1.2):
        check_positive("after", after)
        self.tau = after / np.log(2)
        size = background.occupancy.size
        self._row = np.full(size, -1, np.int32)  # of the table, for each cell of the map
        self._cells, self._table = np.zeros(256, np.intp), np.zeros((256, _COLUMNS))
        self._count, self.last = 0, None
        reach = max(1, round(TOUCH / background.resolution))
        near = np.arange(-reach, reach + 1)
        self._round = (near[:, None] * background.occupancy.shape[1] + near).ravel()
        self.known_since, self._marked, self._known = (
            np.full(size, np.inf),
            None,
            np.zeros(0, np.intp),
        )
        self.gone = {}

    def due(self, t):
        """Whether it is time for another look.

        Parameters
        ----------
        t : float
            s.

        Returns
        -------
        bool
        """
        return self.last is None or t - self.last >= SLOT

    def look(self, t, cells, points, pose, angles, ranges):
        """Take in one scan.

        Parameters
        ----------
        t : float
            s.
        cells : (M,) int array
            Flat indices of the cells that hold a foreground reading; repeats allowed.
        points : (M, 2) float array
            The readings in m.
        pose : (3,) float array
            Sensor x, y in m, theta in rad.
        angles, ranges : (B,) float arrays
            The scan.
        """
        dt = SLOT if self.last is None else min(t - self.last, LONGEST_STEP)
        self.last, gain = t, 1 - np.exp(-dt / self.tau)
        rows = self._row[cells]
        if (fresh := rows < 0).any():
            self._remember(np.unique(cells[fresh]), t)
            rows = self._row[cells]
        table = self._table[: self._count]
        anew = rows[(table[rows, _VALUE] <= 0.5) & (table[rows, _PASSED] > table[rows, _UNTIL])]
        table[anew, _SINCE], table[anew, _LOOKS] = t, 0.0  # it had gone, and is another
        table[rows, _LOOKS] += 1
        weight = 1 / np.minimum(table[rows, _LOOKS], LONG_MEAN)
        table[rows, _PLACE] += (points - table[rows, _PLACE]) * weight[:, None]
        table[rows, _SENSOR], table[rows, _UNTIL] = pose[:2], t
        free = seen_free(table[:, _PLACE], pose, angles, ranges, BEYOND)
        free[rows] = False
        before = table[:, _VALUE].copy()
        table[free, _VALUE] *= 1 - gain
        table[free, _PASSED] = t
        table[rows, _VALUE] = before[rows] + gain * (1 - before[rows])
        for k in np.flatnonzero((before > 0.5) & (table[:, _VALUE] <= 0.5)).tolist():
            self.gone[int(self._cells[k])] = tuple(table[k, _STOOD].tolist())
        self._forget(free & (table[:, _VALUE] < 0.5 * gain))
        self._mark()

    def _remember(self, cells, t):
        """Add cells (M,), seen for the first time at `t` s."""
        count = self._count + len(cells)
        if count > len(self._cells):
            self._cells = np.resize(self._cells, 2 * count)
            self._table = np.resize(self._table, (2 * count, _COLUMNS))
        new = slice(self._count, count)
        self._cells[new], self._table[new] = cells, 0.0
        self._table[new, _SINCE], self._table[new, _PASSED] = t, -np.inf
        self._row[cells] = np.arange(self._count, count)
        self._count = count

    def _forget(self, rows):
        """Forget cells (A,) bool, once they are many."""
        if 4 * np.count_nonzero(rows) <= self._count:
            return
        self._row[self._cells[: self._count][rows]] = -1
        kept = np.flatnonzero(~rows)
        self._count = len(kept)
        self._cells[: self._count], self._table[: self._count] = (
            self._cells[kept],
            self._table[kept],
        )
        self._row[self._cells[: self._count]] = np.arange(self._count)

    def _mark(self):
        """Write down at each cell round one that stands since when."""
        standing = np.flatnonzero(self._table[: self._count, _VALUE] > 0.5)
        cells, since = self._cells[standing], self._table[standing, _SINCE]
        now_standing = np.column_stack([cells, since])
        if self._marked is not None and np.array_equal(now_standing, self._marked):
            return
        self.known_since[self._known] = np.inf
        order = np.argsort(-since, kind="stable")  # the earliest is written last
        near = (cells[order, None] + self._round).clip(0, self.known_since.size - 1)
        self._marked, self._known = now_standing, near.ravel()
        self.known_since[self._known] = np.repeat(since[order], len(self._round))

    def standing(self):
        """Where something stands, and has not just gone.

        Returns
        -------
        (S, 6) float array
            Of each cell: mean of its readings and where it was seen from, x, y in m; since when in s;
            and `inf`, as it has no end.
        """
        table = self._table[: self._count]
        leaving = (table[:, _PASSED] > table[:, _UNTIL]) & (table[:, _UNTIL] < self.last - LEAVING)
        found = table[(table[:, _VALUE] > 0.5) & ~leaving][:, _STOOD]
        found[:, -1] = np.inf
        return found

    def stood(self):
        """Where something stood, and is no more.

        Returns
        -------
        (G, 6) float array
            As `standing`, and until when in s.
        """
        return np.array(list(self.gone.values())).reshape(-1, 6)


def in_a_row(flags):
    """Which flags are set together with two on either side, as far as there are.

    Parameters
    ----------
    flags : (B,) bool array

    Returns
    -------
    (B,) bool array

    Examples
    --------
    >>> in_a_row(np.array([True, True, True, False, True, False])).tolist()
    [True, False, False, False, False, False]
    """
    padded = np.pad(flags, 2, constant_values=True)
    return np.logical_and.reduce([padded[k : k + len(flags)] for k in range(5)])


class SeenFloor:
    """The floor that has been seen, up to what stands on it, and when first (beyond the paper).

    Parameters
    ----------
    background : OccupancyGrid
        Of its extent.
    resolution : float
        m per cell; larger where the floor would have more than five million cells.

    Attributes
    ----------
    origin : (float, float)
        Lower left corner in m.
    shape : (int, int)
        Rows and columns.
    first : (H * W,) float array
        When each cell was seen first, in s; `inf` where it never was.
    """

    def __init__(self, background, resolution=0.10):
        extent = np.multiply(background.occupancy.shape, background.resolution)
        self.origin, self.resolution = background.origin, max(resolution, np.sqrt(extent.prod() / MOST_FLOOR))
        size = np.multiply(background.occupancy.shape, background.resolution / self.resolution)
        self.shape = tuple(np.ceil(size).astype(int))
        row, column = np.indices(self.shape).reshape(2, -1)
        self._centres = np.column_stack(in_metres(column + 0.5, row + 0.5, self.origin, self.resolution))
        self._numbers = np.arange(len(self._centres)).reshape(self.shape)
        self.first = np.full(len(self._centres), np.inf)
        self.last, self._farthest = None, 0.0

    def due(self, t):
        """Whether it is time for another look.

        Parameters
        ----------
        t : float
            s.

        Returns
        -------
        bool
        """
        return self.last is None or t - self.last >= FLOOR_EVERY

    def look(self, t, pose, angles, ranges):
        """Take in one scan.

        A beam that does not come back is believed, as far as any has come back, if its neighbours
        do not either; alone it is a reading that was missed.

        Parameters
        ----------
        t : float
            s.
        pose : (3,) float array
            Sensor x, y in m, theta in rad.
        angles, ranges : (B,) float arrays
            The scan.
        """
        self.last = t
        believed = np.where(ranges < FARTHEST_SEEN, ranges, 0.0)
        self._farthest = max(self._farthest, believed.max())
        believed[in_a_row(np.isinf(ranges))] = self._farthest
        reach = believed.max() + self.resolution
        low = in_cells(pose[0] - reach, pose[1] - reach, self.origin, self.resolution)
        high = in_cells(pose[0] + reach, pose[1] + reach, self.origin, self.resolution)
        columns, rows = (slice(max(0, int(a)), max(0, int(b) + 1)) for a, b in zip(low, high, strict=True))
        cells = self._numbers[rows, columns].ravel()
        cells = cells[self.first[cells] == np.inf]
        seen = seen_free(self._centres[cells], pose, angles, believed, -self.resolution / 2)
        self.first[cells[seen]] = t

    def first_at(self, places):
        """When a place was seen first.

        Parameters
        ----------
        places : (M, 2) float array
            m.

        Returns
        -------
        (M,) float array
            s; `inf` where it never was.
        """
        found = np.full(len(places), np.inf)
        cells, inside = flat_cells(places, self.origin, self.resolution, self.shape)
        found[inside] = self.first[cells]
        return found

    def grid(self):
        """What has been seen by now.

        Returns
        -------
        (H, W) bool array
        """
        return np.isfinite(self.first).reshape(self.shape)
