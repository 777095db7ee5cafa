"""Going round obstacles: a control law's direction turned along what is near, and shortest ways.

Where nothing is near, the direction u of the law stays as it is, to the last bit. Elsewhere it is
turned along the surface (Khansari-Zadeh and Billard, "A dynamical system approach to realtime
obstacle avoidance", Autonomous Robots 32, 2012): with n the unit normal away from the obstacle and
t the tangent,

    u' = (1 - 1/Gamma) (n.u) n + (1 + 1/Gamma) (t.u) t     where n.u < 0,    u' = u elsewhere.

Gamma is 1 at the distance that is kept and grows to infinity where the influence ends; below the
kept distance the factor of n is negative and the robot is led out. The normal comes from the
distance field of the map, so that desks and walls need no shape of their own. In a concave corner
this comes to a halt; the way out is then a `Geodesic`. The paper's robot knows of no obstacles: all
of this is Dollop's own.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, sin, sqrt

import numpy as np
import scipy

from dollop.checks import FARTHEST, checked_number, put_in
from dollop.gridmap import distances_to, in_cells, in_metres
from dollop.pose import towards

__all__ = [
    "CREEPING", "FREE_BELOW", "PIONEER_AVOIDANCE", "PIONEER_RADIUS", "Avoidance", "ObstacleMap",
]  # fmt: skip

PIONEER_RADIUS = 0.25
"""Radius of a Pioneer 2 DX in m (ARIA, p2dx.p)."""
FREE_BELOW = 0.2
"""Occupancy below which a cell is free: most beams miss a stool's thin column in its cell."""
OPEN_BORDER = 3.0
"""Border in m of a world without a map round all that is in it, beside the robot's diameter."""
CREEPING = 0.05
"""Speed in m/s of a robot that has next to no room, or comes to a place where it is to stand."""
FREEING = 0.01
"""Speed in m/s of a robot that frees itself from what it touches."""
MOST_CELLS, COARSEST = 3_000_000, 0.5
"""Cells of a map at most, of 300 bytes each where a shortest way is looked for; and their side in m
at most."""
DIPS = 0.01
"""Distance in m by which there is less room half-way to a place round a corner than at both ends."""


@dataclass(frozen=True)
class Avoidance:
    """How far a robot keeps off what stands there, all from its edge (beyond the paper).

    Attributes
    ----------
    kept : float
        Distance in m that the modulation keeps.
    influence : float
        Distance in m at which it sets in.
    tight : float
        Distance in m that the shortest ways keep, beside what a robot's pose may be off. What is
        narrower is no way.
    crowding : float
        How many times longer, less one, a metre counts for the shortest ways where the robot would
        touch something.

    Raises
    ------
    ValueError
        For what is no number, or not in the order 0 < tight <= kept < influence.

    Examples
    --------
    >>> Avoidance(kept=0.6)
    Traceback (most recent call last):
    ValueError: distances must be 0 < tight <= kept < influence, got 0.02, 0.6 and 0.5
    """

    kept: float = 0.20
    influence: float = 0.50
    tight: float = 0.02
    crowding: float = 4.0

    def __post_init__(self):
        put_in(
            self,
            **{name: checked_number(name, getattr(self, name), 0, FARTHEST) for name in self.__match_args__},
        )
        if not 0 < self.tight <= self.kept < self.influence:
            got = f"got {self.tight:g}, {self.kept:g} and {self.influence:g}"
            raise ValueError(f"distances must be 0 < tight <= kept < influence, {got}")

    def beside(self, accuracy):
        """The same for a robot whose pose may be off.

        Parameters
        ----------
        accuracy : float
            By so much, in m.

        Returns
        -------
        Avoidance
            That keeps so much more on the shortest ways, and elsewhere at least as much as there.

        Examples
        --------
        >>> Avoidance().beside(0.05)
        Avoidance(kept=0.2, influence=0.5, tight=0.07, crowding=4.0)
        """
        tight = round(self.tight + accuracy, 9)
        kept = max(self.kept, tight)
        return Avoidance(kept, max(self.influence, kept + self.influence - self.kept), tight, self.crowding)


PIONEER_AVOIDANCE = Avoidance()
"""As measured with a Pioneer."""


@dataclass(frozen=True, eq=False)
class ObstacleMap:
    """Distances to what the robot must not touch, to look up one by one (beyond the paper).

    A place is anywhere in the plane; off the map, distances are those at its border.

    Attributes
    ----------
    distances : (H, W) float array
        From each cell's centre to the nearest obstacle's edge in m, negative inside.
    origin : (float, float)
        Lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.
    radius : float
        The robot's in m.
    rules : Avoidance
        How far the robot keeps off.

    Examples
    --------
    A box of 2 m by 2 m, and the robot's edge 0.75 m from it.

    >>> from dollop.environment import Environment
    >>> obstacles = ObstacleMap.of(Environment([[0, 0, 2, 2]]))
    >>> round(obstacles.edge(3.0, 1.0), 2)
    0.75
    """

    distances: np.ndarray
    origin: tuple
    resolution: float
    radius: float = PIONEER_RADIUS
    rules: Avoidance = PIONEER_AVOIDANCE

    def __post_init__(self):
        if min(np.shape(self.distances), default=0) < 2 or np.ndim(self.distances) != 2:
            shape = np.shape(self.distances)
            raise ValueError(f"distances must have two rows and columns, got shape {shape}")

    @cached_property
    def _lookup(self):
        """The distances one by one, which answers single questions faster than an array."""
        return memoryview(np.ascontiguousarray(self.distances, float).ravel())

    def __repr__(self):
        rows, columns = self.distances.shape
        return f"ObstacleMap of {columns} x {rows} cells for a robot of {self.radius:g} m"

    @classmethod
    def of(
        cls,
        environment,
        background=None,
        places=(),
        radius=PIONEER_RADIUS,
        resolution=0.05,
        rules=PIONEER_AVOIDANCE,
        finer=1,
    ):
        """The obstacles of an environment before a background (reconstruction).

        Distances to boxes are exact, those to a background are to the squares of its cells.

        A map of more than three million cells, 86 m x 86 m at 5 cm, is made of larger ones: without
        a background of about so many, with one of squares of its cells. What reaches into a square
        fills it, and half a square more is taken off every distance, so that there is never less room
        than there seems to be. Along a square of 200 m cells have 12 cm.

        Parameters
        ----------
        environment : Environment
            Its boxes are obstacles.
        background : OccupancyGrid, optional
            All that is not free is an obstacle, and so is all around the map. Without it the world
            is open.
        places : (N, 2) array_like, optional
            Without a background: places in m that the map must hold as well.
        radius : float
            The robot's in m.
        resolution : float
            Without a background: side of a cell in m.
        rules : Avoidance
        finer : int
            Into how many cells along each side those are divided, if there are not too many then.

        Returns
        -------
        ObstacleMap

        Raises
        ------
        ValueError
            If cells would have to be larger than 0.5 m: beyond 866 m x 866 m.

        Examples
        --------
        A world without anything in it has room everywhere.

        >>> from dollop.environment import Environment
        >>> ObstacleMap.of(Environment([])).edge(12.0, -7.0) > 100
        True
        """
        if background is None:
            origin, side, shape = open_frame(
                environment.boxes,
                places,
                resolution,
                OPEN_BORDER + max(2 * (radius - PIONEER_RADIUS), 0.0),
            )
            blocked = np.zeros(shape, dtype=bool)
        else:
            blocked, side = coarser(blocked_by(background), background.resolution)
            origin, resolution = background.origin, background.resolution
        if blocked.size * finer**2 <= MOST_CELLS:
            blocked, side = blocked.repeat(finer, axis=0).repeat(finer, axis=1), side / finer
        distances = signed_distance(blocked, side)
        columns, rows = (np.arange(size) + 0.5 for size in blocked.shape[::-1])
        np.minimum(
            distances,
            box_distances(environment.boxes, *in_metres(columns, rows, origin, side)),
            out=distances,
        )
        if side > resolution:
            distances -= side / 2
        return cls(distances, origin, side, radius, rules)

    def edge(self, x, y):
        """Distance between the edge of the robot and the nearest obstacle.

        Parameters
        ----------
        x, y : float
            Where the robot's centre is, in m.

        Returns
        -------
        float
            In m, negative in contact; bilinear between the centres of cells.
        """
        return self._edge_and_slope(x, y)[0]

    def _edge_and_slope(self, x, y):
        """`edge` in m, and how much it grows per m along x and along y."""
        rows, columns = self.distances.shape
        across, up = in_cells(x, y, self.origin, self.resolution)
        across = min(max(across - 0.5, 0.0), columns - 1.001)
        up = min(max(up - 0.5, 0.0), rows - 1.001)
        column, row = int(across), int(up)
        right, top = across - column, up - row
        corner, lookup = row * columns + column, self._lookup
        a, b = lookup[corner], lookup[corner + 1]
        c, d = lookup[corner + columns], lookup[corner + columns + 1]
        lower, upper = a + right * (b - a), c + right * (d - c)
        slope_x = ((b - a) * (1 - top) + (d - c) * top) / self.resolution
        return (
            lower + top * (upper - lower) - self.radius,
            slope_x,
            (upper - lower) / self.resolution,
        )

    def cuts_corner(self, x, y, ahead_x, ahead_y):
        """Whether half-way to another place, straight on, the robot has next to no room.

        Or little, and less than here and there.

        Parameters
        ----------
        x, y, ahead_x, ahead_y : float
            Both places in m.

        Returns
        -------
        bool
        """
        rules, between = self.rules, self.edge((x + ahead_x) / 2, (y + ahead_y) / 2)
        if between <= rules.tight or between > rules.kept / 3:
            return between <= rules.tight
        return between < min(self.edge(x, y), self.edge(ahead_x, ahead_y)) - DIPS

    def edges(self, positions):
        """`edge` for many places at once.

        Parameters
        ----------
        positions : (N, 2) array_like
            In m.

        Returns
        -------
        (N,) float array
            In m.

        Examples
        --------
        A metre farther from the side of a box is a metre more room.

        >>> from dollop.environment import Environment
        >>> obstacles = ObstacleMap.of(Environment([[0, 0, 2, 2]]))
        >>> obstacles.edges([[2.2, 1.0], [3.0, 1.0], [4.0, 1.0]]).round(2).tolist()
        [-0.05, 0.75, 1.75]
        """
        across, up = in_cells(*np.asarray(positions).T, self.origin, self.resolution)
        at = np.stack([up, across]) - 0.5
        between = scipy.ndimage.map_coordinates(self.distances, at, order=1, mode="nearest")
        return between - self.radius

    def tighter(self, places, others):
        """Which places clearly have less room than others, and little.

        Parameters
        ----------
        places, others : (N, 2) float arrays
            In m.

        Returns
        -------
        (N,) bool array
        """
        return self.edges(places) < np.minimum(self.edges(others) - DIPS, self.rules.kept)

    def holds(self, x, y):
        """Whether a place lies on the map.

        Parameters
        ----------
        x, y : float
            In m.

        Returns
        -------
        bool
        """
        rows, columns = self.distances.shape
        across, up = in_cells(x, y, self.origin, self.resolution)
        return 0 <= across < columns and 0 <= up < rows

    def modulate(self, x, y, ux, uy):
        """The direction of a law, turned along what is near (Khansari-Zadeh and Billard, 2012).

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.
        ux, uy : float
            Unit vector in which the law sends it.

        Returns
        -------
        (float, float)
            Unit vector; the law's own where nothing is near, or where it leads away from it.
        """
        edge, nx, ny = self._edge_and_slope(x, y)
        outwards = nx * ux + ny * uy
        length = nx * nx + ny * ny
        kept, influence = self.rules.kept, self.rules.influence
        if edge >= influence or outwards >= 0 or length < 1e-6:  # no slope half-way between two
            return ux, uy
        along = outwards / length
        normal_x, normal_y = along * nx, along * ny
        share = (influence - edge) / (influence - kept)  # 1 / Gamma
        turned_x = (1 - share) * normal_x + (1 + share) * (ux - normal_x)
        turned_y = (1 - share) * normal_y + (1 + share) * (uy - normal_y)
        size = hypot(turned_x, turned_y)
        return (turned_x / size, turned_y / size) if size > 1e-9 else (ux, uy)

    def speed_limit(self, x, y, theta, deceleration, period):
        """Speed from which a robot still stops before it touches, wherever what is near may be.

        Outwards or along it may always creep, and brake within half the room that there is; with next
        to no room left, only so; and in contact, hardly, and straight out (reconstruction).

        Parameters
        ----------
        x, y, theta : float
            Pose in m and rad.
        deceleration : float
            That of braking in m/s^2.
        period : float
            Time in s that passes before the robot brakes.

        Returns
        -------
        float
            In m/s.
        """
        return self.edge_and_limit(x, y, theta, deceleration, period)[1]

    def edge_and_limit(self, x, y, theta, deceleration, period):
        """`edge` and `speed_limit` in one.

        Parameters
        ----------
        x, y, theta, deceleration, period : float
            See there.

        Returns
        -------
        (float, float)
            In m and m/s.
        """
        edge, nx, ny = self._edge_and_slope(x, y)
        left = min(self.rules.tight / 2, 0.02)
        outwards = nx * cos(theta) + ny * sin(theta)
        speed = braked_within(edge - left, deceleration, period)
        if edge <= 0:
            return edge, FREEING if outwards > 0.5 else 0.0
        if outwards > (0.05 if edge < left / 2 else -0.05):
            speed = max(speed, min(braked_within(edge / 2, deceleration, period), CREEPING))
        return edge, speed

    def outwards(self, x, y, ux, uy):
        """A direction, led off what is near where there is next to no room (reconstruction).

        Parameters
        ----------
        x, y : float
            Where the robot is, in m.
        ux, uy : float
            Unit vector.

        Returns
        -------
        (float, float)
            Unit vector; the same one where there is room.
        """
        edge, nx, ny = self._edge_and_slope(x, y)
        if edge > self.rules.tight:
            return ux, uy
        nx, ny = towards(nx, ny)
        more = 1 - edge / self.rules.tight - min(nx * ux + ny * uy, 0.0)
        return towards(ux + more * nx, uy + more * ny)

    @cached_property
    def _passable(self):
        """(H, W) bool array: cells where the robot touches nothing, with some room to spare."""
        return self.distances - self.radius > self.rules.tight

    @cached_property
    def _nearest_passable(self):
        """Flat index of the passable cell nearest to each cell, one by one."""
        nearest = {"return_distances": False, "return_indices": True}
        row, column = scipy.ndimage.distance_transform_edt(~self._passable, **nearest)
        return memoryview((row * self.distances.shape[1] + column).ravel())

    @cached_property
    def _regions(self):
        """(H, W) int array: which passable cells hang together; else 0."""
        return _regions(self._passable)

    def no_way(self, place, goal, reach):
        """Why a robot cannot go from a place to within reach of a goal (reconstruction).

        Parameters
        ----------
        place, goal : (2,) sequences of float
            In m.
        reach : float
            In m.

        Returns
        -------
        str
            With {} for the name of the goal; empty if there is a way.

        Examples
        --------
        >>> from dollop.environment import Environment
        >>> walls = Environment([[0, 0, 0.2, 3], [0, 3.7, 0.2, 9]])
        >>> print(ObstacleMap.of(walls, places=[[-1, 3], [1, 3]], radius=0.2).no_way((-1, 3), (1, 3), 0.25))
        <BLANKLINE>
        """
        here = self._regions.ravel()[self._cell(*place)] if self._passable.any() else 0
        there = self._near(goal, reach)
        if here and (self._regions[there] == here).any():
            return ""
        robot = f"a robot of {self.radius:g} m radius that keeps {self.rules.tight:g} m"
        if not self._passable[there].any():
            return f"there is no room for {robot} within {reach:g} m of {{}}"
        widest = self._widest(place, there)
        fits = f"the largest that gets there has {widest:.2f} m" if widest >= 0.01 else "none gets there, however small"
        return f"there is no way to {{}} for {robot}: {fits}"

    def check_free(self, places):
        """Refuse a place that is off the map, or in an obstacle.

        Parameters
        ----------
        places : sequence of (str, sequence of float)
            Names, and x and y in m, whatever comes after.

        Raises
        ------
        ValueError
            With its name.
        """
        for name, (x, y, *_) in places:
            there = f"got ({x:.2f}, {y:.2f}), which is"
            if not self.holds(x, y):
                raise ValueError(f"{name} must lie in the lab, {there} off the map")
            if self.edge(x, y) <= -self.radius:
                raise ValueError(f"{name} must be free, {there} in an obstacle or unknown")

    def has_room(self, x, y, reach):
        """Whether there may be room for the robot near a place on the map, to a cell.

        Parameters
        ----------
        x, y : float
            The place in m.
        reach : float
            How near, in m; 0: nowhere.

        Returns
        -------
        bool
        """
        if reach <= 0 or not self.holds(x, y):
            return False
        room = self.distances[self._near((x, y), reach + self.resolution)] - self.radius
        return bool((room > self.rules.tight - self.resolution).any())

    def nearest_room(self, x, y):
        """Distance to the nearest place where the robot has room.

        Parameters
        ----------
        x, y : float
            In m.

        Returns
        -------
        float
            In m, 0 where it has room.
        """
        cell = self._cell(x, y)
        return 0.0 if cell == self._cell_at(x, y) else hypot(*np.subtract(self._centre(cell), (x, y)).tolist())

    def check_room(self):
        """Refuse a map on which there is no room for the robot anywhere.

        Raises
        ------
        ValueError
            With its radius.
        """
        if not self._passable.any():
            most = max(float(self.distances.max()) - self.rules.tight, 0.0)
            rule = f"there must be room for the robot on the map, which has some for a radius of {most:.2f} m"
            raise ValueError(f"{rule} that keeps {self.rules.tight:g} m, got a radius of {self.radius:g} m")

    def _near(self, place, reach):
        """Rows and columns of the cells within reach in m of a place; at least its own."""
        rows, columns = self.distances.shape
        across, up = in_cells(*place, self.origin, self.resolution)
        column, row = (min(max(int(at), 0), size - 1) for at, size in ((across, columns), (up, rows)))
        far = int(reach / self.resolution) + 1
        y, x = np.ogrid[max(row - far, 0) : row + far + 1, max(column - far, 0) : column + far + 1]
        y, x = y[y[:, 0] < rows], x[:, x[0] < columns]
        near = np.hypot(x + 0.5 - across, y + 0.5 - up) * self.resolution <= reach
        near |= (y == row) & (x == column)
        found_y, found_x = np.nonzero(near)
        return found_y + y[0, 0], found_x + x[0, 0]

    def _widest(self, place, there):
        """Radius in m, to a centimetre, of the largest robot that gets from a place to one of some cells."""
        across, up = in_cells(*place, self.origin, self.resolution)
        rows, columns = self.distances.shape
        here = min(max(int(up), 0), rows - 1), min(max(int(across), 0), columns - 1)
        low, high = 0.0, self.radius
        while high - low > 0.005:
            middle = (low + high) / 2
            regions = _regions(self.distances - self.rules.tight > middle)
            through = regions[here] and (regions[there] == regions[here]).any()
            low, high = (middle, high) if through else (low, middle)
        return low

    @cached_property
    def _neighbours(self):
        """Sparse (H W, H W) costs in m between passable cells side by side or corner to corner."""
        rows, columns = self.distances.shape
        index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
        room = np.clip((self.distances - self.radius) / self.rules.influence, 0.0, 1.0)
        cost = self.resolution * (1 + self.rules.crowding * (1 - room))
        steps = []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = np.s_[: rows - down, max(-right, 0) : columns - max(right, 0)]
            there = np.s_[down:, max(right, 0) : columns + min(right, 0)]
            both = self._passable[here] & self._passable[there]
            costs = hypot(down, right) * (cost[here] + cost[there])[both] / 2
            steps.append((costs, index[here][both], index[there][both]))
        costs, heads, tails = map(np.concatenate, zip(*steps, strict=True))
        return scipy.sparse.csr_array((costs, (heads, tails)), shape=(index.size, index.size))

    def _cell(self, x, y):
        """Flat index of the passable cell nearest to x, y in m."""
        cell = self._cell_at(x, y)
        return cell if self._passable.flat[cell] else self._nearest_passable[cell]

    def _cell_at(self, x, y):
        """Flat index of the cell of x, y in m, or of the one nearest to it on the border."""
        rows, columns = self.distances.shape
        across, up = in_cells(x, y, self.origin, self.resolution)
        column, row = min(max(int(across), 0), columns - 1), min(max(int(up), 0), rows - 1)
        return row * columns + column

    def _centre(self, cell):
        """x, y in m of the centre of the cell with flat index `cell`."""
        row, column = divmod(cell, self.distances.shape[1])
        return in_metres(column + 0.5, row + 0.5, self.origin, self.resolution)


def _regions(passable):
    """Which of cells (H, W) hang together, if only at corners: a number from 1 on, else 0."""
    return scipy.ndimage.label(passable, np.ones((3, 3)))[0]


def braked_within(room, deceleration, period):
    """Speed in m/s that ends within room in m, if the robot brakes, in m/s^2, after a period in s."""
    return deceleration * (sqrt(period * period + 2 * max(room, 0.0) / deceleration) - period)


def open_frame(boxes, places, resolution, border):
    """Lower left corner, cells' side and shape of a map of boxes (N, 4), places (M, 2), border in m."""
    points = np.vstack([boxes.reshape(-1, 2), np.reshape(places, (-1, 2))])
    if not len(points):
        points = np.zeros((1, 2))
    low, high = points.min(axis=0) - border, points.max(axis=0) + border
    side = max(resolution, float(np.sqrt(np.prod(high - low) / MOST_CELLS)))
    if not side <= max(COARSEST, resolution):
        rule = f"{MOST_CELLS} cells of {COARSEST:g} m must hold all places and objects"
        raise ValueError("without a map {}, got {:.4g} m x {:.4g} m".format(rule, *(high - low)))
    columns, rows = np.ceil((high - low) / side).astype(int)
    return tuple(low.tolist()), side, (rows, columns)


def blocked_by(background):
    """Cells (H, W) of a map that are not free, at least (2, 2); its border never is."""
    blocked = ~(background.occupancy < FREE_BELOW)
    blocked[[0, -1]], blocked[:, [0, -1]] = True, True
    lacking = np.maximum(2 - np.array(blocked.shape), 0)
    return np.pad(blocked, [(0, more) for more in lacking], constant_values=True)


def coarser(blocked, side):
    """Blocked cells (H, W) and their side in m, of larger ones if there are too many."""
    times = int(np.ceil(np.sqrt(blocked.size / MOST_CELLS)))
    if times == 1:
        return blocked, side
    whole = np.pad(blocked, [(0, -size % times) for size in blocked.shape], constant_values=True)
    rows, columns = np.array(whole.shape) // times
    return whole.reshape(rows, times, columns, times).any(axis=(1, 3)), times * side


def box_distances(boxes, x, y):
    """Distances (H, W) in m from places, columns at x (W,) and rows at y (H,) in m, to the nearest of boxes (N, 4).

    Negative inside.
    """
    squared, depth = np.full((len(y), len(x)), np.inf), np.zeros((len(y), len(x)))
    for left, low, right, high in boxes:
        across, up = np.maximum(left - x, x - right), np.maximum(low - y, y - high)
        np.minimum(squared, np.add.outer(np.maximum(up, 0) ** 2, np.maximum(across, 0) ** 2), out=squared)
        inside = np.ix_(up < 0, across < 0)
        depth[inside] = np.minimum(depth[inside], np.maximum.outer(up[up < 0], across[across < 0]))
    return np.where(depth < 0, depth, np.sqrt(squared))


def signed_distance(blocked, resolution):
    """Distances (H, W) in m from cells' centres to the edge of what is blocked, negative inside."""
    if not blocked.any():
        return np.full(blocked.shape, 1e3)
    outside, inside = (distances_to(each, resolution, resolution / 2) for each in (blocked, ~blocked))
    return outside - inside
