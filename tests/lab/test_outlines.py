"""Outlines in the plane: distances and beams against dense sampling, polygons against other ways to reckon."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.path import Path

from dollop.lab.outlines import (
    Outline,
    crosses_itself,
    gaps,
    inside,
    meeting,
    nearest_core,
    outline_distances,
    wall_distances,
)

STEP = 0.002
places = st.floats(-3.0, 3.0)
halves = st.one_of(st.just(0.0), st.floats(0.01, 1.5))
any_outline = st.builds(Outline, places, places, halves, halves, st.floats(-7.0, 7.0), halves).filter(
    lambda outline: max(outline.half_width, outline.half_depth, outline.radius) > 0
)
any_disc = st.builds(Outline, places, places, radius=st.floats(0.05, 1.0))
any_box = st.builds(Outline, places, places, st.floats(0.05, 1.5), st.floats(0.05, 1.5), st.floats(-7.0, 7.0))
any_point = st.tuples(places, places)


def drawn(outline):
    """Its edge (N, 2), walked once round with a step of 2 mm: a quarter of a circle at every corner of the core."""
    x, y, half_width, half_depth, turn, radius = outline
    corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * (half_width, half_depth)
    arc = np.linspace(0.0, np.pi / 2, 3 + int(2 * radius / STEP))
    bearings = arc + np.arange(4)[:, None] * np.pi / 2
    rounded = corners[:, None] + radius * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    edge = line_through(rounded.reshape(-1, 2))
    cos, sin = np.cos(turn), np.sin(turn)
    return edge @ [[cos, sin], [-sin, cos]] + (x, y)


def line_through(corners):
    """Points (N, 2) on the closed line through some, at most 2 mm apart."""
    steps = np.roll(corners, -1, axis=0) - corners
    counts = 1 + (np.linalg.norm(steps, axis=1) / STEP).astype(int)
    edge = np.repeat(np.arange(len(corners)), counts)
    along = (np.arange(len(edge)) - (np.cumsum(counts) - counts)[edge]) / counts[edge]
    return corners[edge] + along[:, None] * steps[edge]


def distance_to(points, samples):
    """From each point (N, 2) to the nearest sample, (N,) in m."""
    return np.linalg.norm(np.reshape(points, (-1, 1, 2)) - samples, axis=-1).min(axis=1)


@given(any_outline, any_point)
def test_the_distance_is_to_the_nearest_point_of_the_edge(outline, point):
    """Its size is the distance to the drawn edge, and it is negative within that."""
    found, edge = outline_distances([point], [outline])[0, 0], drawn(outline)
    assert abs(found) == pytest.approx(distance_to(point, edge)[0], abs=1.5 * STEP)
    if abs(found) > STEP:
        assert (found < 0) == Path(edge).contains_point(point)


@given(any_outline)
def test_bounds_are_the_farthest_points_of_the_edge(outline):
    """No drawn point is outside, and some are on every side."""
    edge = drawn(outline)
    assert outline.bounds == pytest.approx([*edge.min(axis=0), *edge.max(axis=0)], abs=STEP / 4)


@given(any_outline, any_point)
def test_the_nearest_place_of_the_core_is_nearer_than_all_others(outline, point):
    """It lies in the core, and no sample of the core's edge is nearer to a point outside."""
    core = outline._replace(radius=0.0)
    nearest = nearest_core(np.array([point]), outline)
    assert outline_distances(nearest, [core])[0, 0] < 1e-9
    outside = max(outline_distances([point], [core])[0, 0], 0.0)
    assert np.linalg.norm(nearest - point) == pytest.approx(outside, abs=1e-9)


def traced(start, bearings, outlines, steps=400):
    """How far beams go, by steps as long as nothing can be nearer; and their least distance to each outline."""
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    gone, least = np.zeros((len(bearings), len(outlines))), np.inf
    for _ in range(steps):
        ends = start + gone[..., None] * directions[:, None]
        near = np.hstack([outline_distances(ends[:, k], [outlines[k]]) for k in range(len(outlines))])
        least = np.minimum(least, near)
        gone = gone + np.maximum(near, 0.0)
    return np.where(gone > 50.0, np.inf, gone), least


@pytest.mark.parametrize("seed", range(4))
def test_beams_end_where_steps_as_long_as_the_distance_lead(seed):
    """Beams to outlines anywhere, also from within, are as long as sphere tracing has them, unless they graze."""
    rng = np.random.default_rng(seed)
    half, radius = rng.uniform(0.0, 1.5, (12, 2)), rng.uniform(0.05, 0.5, 12)
    half[:4], radius[4:8] = 0.0, 0.0  # discs, and boxes
    outlines = [
        Outline(*rng.uniform(-5.0, 5.0, 2), *half[k], rng.uniform(-np.pi, np.pi), radius[k]) for k in range(len(half))
    ]
    start, bearings = rng.uniform(-2.0, 2.0, 2), rng.uniform(-np.pi, np.pi, 60)
    found, (expected, least) = meeting(start, bearings, outlines), traced(start, bearings, outlines)
    hit = least < 1e-7
    assert hit.any() and not hit.all()
    assert found[hit] == pytest.approx(expected[hit], abs=1e-4)
    assert np.isinf(found[least > 1e-4]).all()


@given(any_outline, any_point, st.floats(-7.0, 7.0))
@example(Outline(3.0, 0.0, radius=1.0), (0.0, 0.0), 0.0)  # a beam exactly at a disc's middle
@example(Outline(3.0, 0.0, 1.0, 1.0), (0.0, 1.0), 0.0)  # a beam exactly along an edge
def test_a_beam_ends_on_the_edge_and_not_before(outline, start, bearing):
    """Its end lies on the outline, nothing of it lies within; one without end keeps out."""
    reach = meeting(start, [bearing], [outline])[0, 0]
    if outline_distances([start], [outline])[0, 0] < -1e-9:
        assert reach == 0.0
        return
    beam = np.array([np.cos(bearing), np.sin(bearing)])
    on_the_way = np.array(start) + np.linspace(0.0, min(reach, 20.0), 500)[:, None] * beam
    distances = outline_distances(on_the_way, [outline])[:, 0]
    assert distances.min() > -1e-6
    if np.isfinite(reach):
        assert abs(distances[-1]) < 1e-6


def farther_apart(first, second):
    """Least distance in m between two drawn outlines, negative if a point of one is in the other."""
    edges = drawn(first)[::5], drawn(second)[::5]
    within = max(Path(edge).contains_points(other).any() for edge, other in (edges, edges[::-1]))
    return -1.0 if within else distance_to(*edges).min()


any_standing = st.one_of(any_box, any_disc)


@settings(max_examples=50)
@given(st.lists(any_standing, min_size=1, max_size=3), any_standing)
def test_gaps_are_the_least_distances_of_two_edges(outlines, outline):
    """They are what the drawn edges leave free, and negative where one reaches into the other, seen from either."""
    found = gaps(outlines, outline)
    assert found == pytest.approx([gaps([outline], other)[0] for other in outlines], abs=1e-9)
    for gap, other in zip(found, outlines, strict=True):
        expected = farther_apart(outline, other)
        if abs(gap) > 10 * STEP:
            assert (gap < 0) == (expected < 0)
            assert gap < 0 or gap == pytest.approx(expected, abs=10 * STEP)


def test_among_nothing_there_is_no_gap():
    """Of no outlines there are none."""
    assert gaps([], Outline(0.0, 0.0, radius=1.0)).shape == gaps([], Outline(0.0, 0.0, 1.0, 1.0)).shape == (0,)


# ---- rooms

star = st.lists(st.tuples(st.floats(0.5, 1.0), st.floats(0.5, 4.0)), min_size=3, max_size=9)
millimetres = st.integers(-4000, 4000).map(lambda value: value / 1000)
any_corners = st.integers(3, 9).flatmap(lambda k: arrays(float, (k, 2), elements=millimetres))
whole_corners = st.integers(4, 8).flatmap(lambda k: arrays(int, (k, 2), elements=st.integers(-4, 4)))
points_near = st.lists(any_point, min_size=1, max_size=20).map(np.array)


def star_corners(steps):
    """Corners of a polygon that does not cross itself: once round the origin, by steps of bearing and distances."""
    shares, distances = np.transpose(steps)
    bearings = 2 * np.pi * np.cumsum(shares) / shares.sum()
    return distances[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])


@given(star.map(star_corners), points_near)
def test_inside_is_as_matplotlib_has_it(corners, points):
    """Points off the edge are in a polygon, in either sense, if they are in matplotlib's path."""
    points = points[distance_to(points, line_through(corners)) > 2 * STEP]
    expected = Path(corners).contains_points(points).tolist()
    assert inside(points, corners).tolist() == inside(points, corners[::-1]).tolist() == expected


@given(any_corners, points_near)
def test_inside_counts_crossings_whichever_way_one_looks(corners, points):
    """Turned by a right angle, and so counted another way, the same points are in it, even if it crosses itself."""
    points = points[distance_to(points, line_through(corners)) > 2 * STEP]
    turn = np.array([(0.0, 1.0), (-1.0, 0.0)])
    assert inside(points, corners).tolist() == inside(points @ turn, corners @ turn).tolist()


@given(star.map(star_corners), points_near)
def test_walls_are_as_far_as_the_nearest_point_on_them(corners, points):
    """Inside, the distance is that to the drawn edges; outside, it is zero."""
    points = points[distance_to(points, line_through(corners)) > 2 * STEP]
    expected = distance_to(points, line_through(corners)) * Path(corners).contains_points(points)
    assert wall_distances(points, corners) == pytest.approx(expected, abs=STEP)


def common_point(a, b, c, d):
    """Whether the segments a to b and c to d have a point in common, in whole numbers and their fractions."""
    along, other, between = b - a, d - c, c - a
    determinant = cross(along, other)
    if determinant:
        shares = Fraction(cross(between, other), determinant), Fraction(cross(between, along), determinant)
        return all(0 <= share <= 1 for share in shares)
    ends = sorted([along @ along * 0, along @ along]), sorted([between @ along, (d - a) @ along])
    return cross(between, along) == 0 and ends[0][0] <= ends[1][1] and ends[1][0] <= ends[0][1]


def cross(first, second):
    """Area that two vectors (2,) of whole numbers span."""
    return int(first[0]) * int(second[1]) - int(first[1]) * int(second[0])


@given(whole_corners)
def test_a_polygon_crosses_itself_if_two_edges_have_a_common_point(corners):
    """Edges that are no neighbours cross or touch, by exact fractions, if and only if it is said, and of those two."""
    ends = np.roll(corners, -1, axis=0)
    assume((corners != ends).any(axis=1).all())
    count = len(corners)
    pairs = [(i, j) for i in range(count) for j in range(i + 2, count - (i == 0))]
    meeting_ones = [pair for pair in pairs if common_point(*(each[k] for k in pair for each in (corners, ends)))]
    assert crosses_itself(corners.astype(float)) == (meeting_ones[0] if meeting_ones else None)
