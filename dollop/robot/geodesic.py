"""Shortest ways on a map of obstacles (Dijkstra's algorithm; beyond the paper)."""

from math import ceil, inf

import numpy as np
import scipy

from dollop.pose import towards
from dollop.trajectory import arc_length, at_arc_length

__all__ = ["Geodesic"]

AHEAD = 0.3
"""Way in m over which the direction of a shortest way is taken: one cell alone knows eight directions."""


class Geodesic:
    """Shortest ways on an ObstacleMap to one place (Dijkstra's algorithm; reconstruction).

    Parameters
    ----------
    obstacles : ObstacleMap
    goal : (2,) sequence of float
        In m.

    Attributes
    ----------
    goal : (float, float)
        Where the ways end, in m: the centre of the cell nearest to it in which the robot has room.
    """

    def __init__(self, obstacles, goal):
        self.obstacles = obstacles
        self._goal_cell = obstacles._cell(*goal)
        self.goal = obstacles._centre(self._goal_cell)
        asked = {"directed": False, "indices": self._goal_cell, "return_predecessors": True}
        found = scipy.sparse.csgraph.dijkstra(obstacles._neighbours, **asked)
        self._distances, self._before = map(memoryview, found)
        self._before[self._goal_cell] = self._goal_cell

    def distance(self, x, y):
        """Length of the way from a place.

        Parameters
        ----------
        x, y : float
            In m.

        Returns
        -------
        float
            In m, up to five times as long where it is narrow; `inf` where there is no way.
        """
        return self._distances[self.obstacles._cell(x, y)]

    def direction(self, x, y):
        """Direction of the way from a place.

        Parameters
        ----------
        x, y : float
            In m.

        Returns
        -------
        (float, float)
            Unit vector; zero where there is no way, and at its end.
        """
        cell = self.obstacles._cell(x, y)
        if self._distances[cell] == inf:
            return 0.0, 0.0
        if self.obstacles.edge(x, y) <= self.obstacles.rules.tight:  # first to where there is room
            return self.obstacles.outwards(x, y, *towards(*self.obstacles._centre(cell), x, y))
        cell = self._before[cell]
        for _ in range(max(round(AHEAD / self.obstacles.resolution), 2) - 1):
            farther = self._before[cell]
            if self.obstacles.cuts_corner(x, y, *self.obstacles._centre(farther)):
                break
            cell = farther
        return towards(*self.obstacles._centre(cell), x, y)

    def path(self, x, y, step):
        """The way from a place, smoothed where there is room for it.

        Parameters
        ----------
        x, y : float
            In m.
        step : float
            Distance in m between its places.

        Returns
        -------
        (M, 2) float array
            In m, after the place itself, up to `goal`; none where there is no way.

        Examples
        --------
        >>> from dollop.environment import Environment
        >>> from dollop.robot.avoidance import ObstacleMap
        >>> obstacles = ObstacleMap.of(Environment([]), places=[[0, 0], [1, 0]])
        >>> geodesic = Geodesic(obstacles, (1.0, 0.0))
        >>> path = geodesic.path(0.0, 0.0, 0.25)
        >>> len(path), bool(np.allclose(path[-1], geodesic.goal))
        (5, True)
        """
        cell = self.obstacles._cell(x, y)
        if self._distances[cell] == inf:
            return np.empty((0, 2))
        cells = [cell]
        while cells[-1] != self._goal_cell:
            cells.append(self._before[cells[-1]])
        raw = np.array(list(map(self.obstacles._centre, cells)))
        if self.obstacles._passable.flat[self.obstacles._cell_at(x, y)]:
            raw[0] = x, y
        else:
            raw = np.vstack([[x, y], raw])
        width = 2 * round(AHEAD / self.obstacles.resolution / 2) + 1
        even = scipy.ndimage.uniform_filter1d(raw, width, axis=0, mode="nearest")
        even[[0, -1]] = raw[[0, -1]]
        even = np.where(self.obstacles.tighter(even, raw)[:, None], raw, even)
        way = arc_length(even)
        at = np.append(step * np.arange(1, ceil(way[-1] / step - 1e-6)), way[-1])
        return at_arc_length(even, at)
