"""Outlines in the plane: how far points are from them, and where beams meet them.

Every outline is a box with its edges rounded off: a disc is one without extent, a box one without
rounding, a torso is in between. With (x, y) a point in the box's own frame, half extents (a, b) and
radius r, the signed distance is

    d = |max(q, 0)| + min(max(q_x, q_y), 0) - r,    q = (|x| - a, |y| - b).

Nothing here needs PyBullet.
"""

from collections import namedtuple

import numpy as np

from dollop.pose import rotation

__all__ = [
    "Outline",
    "crosses_itself",
    "gaps",
    "inside",
    "meeting",
    "nearest_core",
    "outline_distances",
    "wall_distances",
]


class Outline(namedtuple("Outline", "x y half_width half_depth turn radius", defaults=[0.0, 0.0, 0.0, 0.0])):
    """A rounded box in the plane.

    Attributes
    ----------
    x, y : float
        Its middle in m.
    half_width, half_depth : float
        Half its extent in m along its own axes, without the rounding.
    turn : float
        Of its axes, in rad.
    radius : float
        Of the rounding, in m.
    """

    __slots__ = ()

    @property
    def bounds(self):
        """xmin, ymin, xmax, ymax in m."""
        cos, sin = abs(np.cos(self.turn)), abs(np.sin(self.turn))
        half = np.array([self.half_width * cos + self.half_depth * sin, self.half_width * sin + self.half_depth * cos])
        half += self.radius
        middle = np.array([self.x, self.y])
        return np.concatenate([middle - half, middle + half])

    def shrunk(self, by):
        """The outline, smaller all round.

        Parameters
        ----------
        by : float
            In m.

        Returns
        -------
        Outline
        """
        sizes = [max(size - by, 0.0) for size in self[2:4]] if self.half_width or self.half_depth else self[2:4]
        radius = self.radius if self.half_width or self.half_depth else max(self.radius - by, 0.0)
        return Outline(*self[:2], *sizes, self.turn, radius)

    @property
    def border(self):
        """(N, 2) points all round it in m, to draw it."""
        around = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        ring = np.column_stack([np.cos(around), np.sin(around)])
        own = np.where(ring >= 0, 1, -1) * (self.half_width, self.half_depth) + self.radius * ring
        return own @ rotation(self.turn).T + (self.x, self.y)


def _in_own_frame(points, outlines):
    """Points (N, 2) as seen from each outline (M, 6), and that points' directions: (N, M, 2)."""
    away = points[:, None] - outlines[:, :2]
    cos, sin = np.cos(outlines[:, 4]), np.sin(outlines[:, 4])
    return np.stack([cos * away[..., 0] + sin * away[..., 1], cos * away[..., 1] - sin * away[..., 0]], axis=-1)


def outline_distances(points, outlines):
    """Signed distance from points to outlines.

    Parameters
    ----------
    points : (N, 2) array_like
        In m.
    outlines : sequence of M Outline

    Returns
    -------
    (N, M) float array
        In m, negative inside.

    Examples
    --------
    >>> box, disc = Outline(0.0, 0.0, 1.0, 1.0), Outline(0.0, 0.0, radius=2.0)
    >>> outline_distances([(4.0, 5.0), (0.0, 0.5)], [box, disc]).round(2).tolist()
    [[5.0, 4.4], [-0.5, -1.5]]
    """
    points, outlines = np.asarray(points, dtype=float).reshape(-1, 2), np.reshape(outlines, (-1, 6))
    q = np.abs(_in_own_frame(points, outlines)) - outlines[:, 2:4]
    outside = np.hypot(*np.moveaxis(np.maximum(q, 0.0), -1, 0))
    return outside + np.minimum(q.max(axis=-1), 0.0) - outlines[:, 5]


def nearest_core(points, outline):
    """For each point the nearest place of an outline's box, before that is rounded off.

    Parameters
    ----------
    points : (N, 2) float array
        In m.
    outline : Outline

    Returns
    -------
    (N, 2) float array
        In m.
    """
    middle, half, turn = np.array(outline[:2]), np.array(outline[2:4]), rotation(outline.turn)
    if not half.any():
        return np.broadcast_to(middle, points.shape)
    return middle + np.clip((points - middle) @ turn, -half, half) @ turn.T


def meeting(start, bearings, outlines):
    """How far beams go until they meet each outline.

    Parameters
    ----------
    start : (2,) array_like
        In m.
    bearings : (B,) array_like
        In the world, in rad.
    outlines : sequence of M Outline

    Returns
    -------
    (B, M) float array
        In m, `inf` where a beam passes, 0 where it starts inside.

    Examples
    --------
    >>> meeting((0.0, 0.0), [0.0, np.pi], [Outline(3.0, 0.0, radius=1.0)]).tolist()
    [[2.0], [inf]]
    """
    bearings, outlines = np.asarray(bearings, dtype=float), np.reshape(outlines, (-1, 6))
    origin = _in_own_frame(np.reshape(start, (1, 2)), outlines)[0]
    own = bearings[:, None] - outlines[:, 4]
    beams = np.stack([np.cos(own), np.sin(own)], axis=-1)
    half, radius = outlines[:, 2:4], outlines[:, 5]
    found = [_meet_box(origin, beams, half + radius[:, None] * axis) for axis in np.eye(2)]
    corners = np.stack(np.meshgrid((-1, 1), (-1, 1)), axis=-1).reshape(-1, 2)
    found += [_meet_disc(origin - corner * half, beams, radius) for corner in corners]
    return np.min(found, axis=0)


def _meet_box(origin, beams, half):
    """Where beams (B, M, 2) from (M, 2) meet boxes round their own origin with half extents (M, 2)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-half - origin) / beams, (half - origin) / beams
        enter, leave = np.fmin(low, high).max(axis=-1), np.fmax(low, high).min(axis=-1)
    return np.where((leave >= enter) & (leave >= 0), np.maximum(enter, 0.0), np.inf)


def _meet_disc(away, beams, radius):
    """Where beams (B, M, 2) meet discs from whose middles they start (M, 2) away."""
    along = -(away * beams).sum(axis=-1)
    depth = radius**2 - (away**2).sum(axis=-1) + along**2
    reach = np.sqrt(np.maximum(depth, 0.0))
    return np.where((depth > 0) & (along + reach >= 0), np.maximum(along - reach, 0.0), np.inf)


def gaps(outlines, outline):
    """Free distances between outlines, discs or boxes, and one more.

    Two boxes overlap if they do as seen along the sides of either; else a corner of one is what is
    nearest to the other.

    Parameters
    ----------
    outlines : sequence of M Outline
    outline : Outline

    Returns
    -------
    (M,) float array
        In m, negative where they overlap.

    Examples
    --------
    >>> square = Outline(0.0, 0.0, 1.0, 1.0)
    >>> gaps([square, Outline(3.0, 0.0, radius=2.5)], Outline(3.0, 3.0, 1.0, 1.0)).round(6).tolist()
    [1.414214, -0.5]
    """
    outlines, outline = np.reshape(outlines, (-1, 6)), Outline(*outline)
    if not outline.half_width and not outline.half_depth:
        return outline_distances([outline[:2]], outlines)[0] - outline.radius
    middles = outline_distances(outlines[:, :2], [outline])[:, 0] - outlines[:, 5]
    boxes = outlines[:, 2:4].any(axis=1)
    if not boxes.any():
        return middles
    corners, others = _corners(np.array([outline])), _corners(outlines)
    seen, seeing = _in_own_frame(corners[0], outlines), _in_own_frame(others.reshape(-1, 2), np.array([outline]))
    apart = np.maximum(
        _beside(seen.swapaxes(0, 1), outlines[:, 2:4]), _beside(seeing.reshape(-1, 4, 2), np.array(outline[2:4]))
    )
    nearest = np.minimum(
        outline_distances(corners[0], outlines).min(axis=0),
        outline_distances(others.reshape(-1, 2), [outline]).reshape(-1, 4).min(axis=1),
    )
    return np.where(boxes, np.where(apart < 0, apart, nearest), middles)


def _corners(outlines):
    """The four corners (M, 4, 2) of boxes (M, 6) in m."""
    own = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * outlines[:, None, 2:4]
    return own @ rotation(outlines[:, 4]).swapaxes(-1, -2) + outlines[:, None, :2]


def _beside(corners, half):
    """The wider gap between boxes and corners (M, 4, 2) in their frames along x or y; negative if there is none."""
    return np.maximum(corners.min(axis=1) - half, -half - corners.max(axis=1)).max(axis=-1)


# ---- rooms


def _edges(corners):
    """Where the edges (K, 2) of a closed polygon begin and end."""
    return corners, np.roll(corners, -1, axis=0)


def inside(points, corners):
    """Whether points lie in a polygon, by how often a line from them crosses its edges.

    Parameters
    ----------
    points : (N, 2) float array
        In m.
    corners : (K, 2) float array
        In m.

    Returns
    -------
    (N,) bool array

    Examples
    --------
    >>> inside(np.array([(0.5, 0.5), (1.5, 0.5)]), np.array([(0, 0), (1, 0), (1, 1), (0, 1)])).tolist()
    [True, False]
    """
    begin, end = _edges(corners)
    x, y = points[:, 0, None], points[:, 1, None]
    spans = (begin[:, 1] > y) != (end[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = begin[:, 0] + (y - begin[:, 1]) / (end[:, 1] - begin[:, 1]) * (end[:, 0] - begin[:, 0])
    return np.count_nonzero(spans & (x < at), axis=1) % 2 == 1


def wall_distances(points, corners):
    """How far points are from the edges of a polygon.

    Parameters
    ----------
    points : (N, 2) float array
        In m.
    corners : (K, 2) float array
        In m.

    Returns
    -------
    (N,) float array
        In m, zero outside.
    """
    begin, end = _edges(corners)
    along = end - begin
    away = points[:, None] - begin
    share = np.clip((away * along).sum(axis=-1) / (along**2).sum(axis=-1), 0.0, 1.0)
    off = away - share[..., None] * along
    distances = np.sqrt((off**2).sum(axis=-1)).min(axis=1)
    return np.where(inside(points, corners), distances, 0.0)


def crosses_itself(corners):
    """Two edges of a polygon that cross or touch, though they are no neighbours.

    Parameters
    ----------
    corners : (K, 2) float array
        In m.

    Returns
    -------
    tuple of 2 ints, or None
        Numbers of the edges.

    Examples
    --------
    >>> crosses_itself(np.array([(0, 0), (1, 1), (1, 0), (0, 1)]))
    (0, 2)
    """
    begin, end = _edges(corners)
    count = len(corners)
    for i in range(count):
        for j in range(i + 2, count - (i == 0)):
            if _segments_meet(begin[i], end[i], begin[j], end[j]):
                return i, j
    return None


def _segments_meet(a, b, c, d):
    """Whether the segments a to b and c to d have a point in common."""

    def side(p, q, r):
        return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    def on(p, q, r):
        return side(p, q, r) == 0 and (np.minimum(p, q) <= r).all() and (r <= np.maximum(p, q)).all()

    if side(a, b, c) != side(a, b, d) and side(c, d, a) != side(c, d, b):
        return True
    return on(a, b, c) or on(a, b, d) or on(c, d, a) or on(c, d, b)
