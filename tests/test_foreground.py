"""Sec. II: foreground cells, the autoregressive foreground grid, blobs, foreground objects, and what stands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dollop.foreground import (
    ForegroundGrid,
    SeenFloor,
    StandingCells,
    _blob_centroids,
    _closed_up,
    bounding_boxes,
    endpoints,
    find_blobs,
    foreground_mask,
    seen_free,
    surface_points,
)
from dollop.gridmap import OccupancyGrid
from dollop.laser import LaserLog

ANGLES = np.radians(np.arange(-90.0, 91.0))


def room(side=8.0, resolution=0.05):
    """A square room with walls on its border, lower left corner at the origin."""
    n = round(side / resolution)
    occupancy = np.zeros((n, n))
    occupancy[[0, -1], :] = occupancy[:, [0, -1]] = 1.0
    return OccupancyGrid(occupancy, np.zeros(2), resolution)


def scan_of(ranges, pose=(4.0, 0.5, np.pi / 2)):
    ranges = np.atleast_2d(ranges)
    poses = np.tile(pose, (len(ranges), 1))
    return LaserLog(0.1 * np.arange(len(ranges)), ranges, ANGLES, poses, 20.0)


def hits(grid, x, y):
    """Flat cell of a point."""
    return np.array([int(y / grid.resolution) * grid.shape[1] + int(x / grid.resolution)])


def test_endpoints_lie_at_range_and_bearing():
    """Readings lie in the world by the sensor's pose; what did not come back has no place."""
    log = scan_of(np.full(181, 2.0))
    points = endpoints(log)[0]
    np.testing.assert_allclose(points[[0, 90, 180]], [[6, 0.5], [4, 2.5], [2, 0.5]], atol=1e-12)
    assert np.isnan(endpoints(scan_of(np.full(181, np.inf)))).all()


def test_foreground_is_what_the_map_does_not_explain_within_the_radius():
    """Readings within the background radius of a wall are background, others are foreground."""
    points = np.array([[[4.0, 7.95], [4.0, 7.80], [4.0, 7.70], [4.0, 4.0], [np.nan, np.nan]]])
    assert np.flatnonzero(foreground_mask(points, room())).tolist() == [2, 3]
    assert np.flatnonzero(foreground_mask(points, room(), 0.5)).tolist() == [3]


def test_a_map_that_does_not_cover_the_scans_is_refused():
    """The error says how many readings lie outside; a stray one is no error, nor foreground."""
    points = np.full((1, 20, 2), 4.0)
    points[0, 0] = 100.0
    assert foreground_mask(points, room()).sum() == 19
    points[0, :3] = 100.0
    with pytest.raises(ValueError, match="3 of 20 readings"):
        foreground_mask(points, room())


@pytest.mark.parametrize("radius", [0.0, -0.2, np.nan, np.inf])
def test_background_radius_must_be_positive(radius):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=f"background_radius must be .* finite, got {radius}"):
        foreground_mask(np.full((1, 1, 2), 4.0), room(), radius)


def test_surfaces_are_filled_between_neighbouring_beams_only():
    """Gaps up to `jump` close to less than a cell; jumps, other beams and scans stay apart."""
    points = np.zeros((2, 4, 2))
    points[..., 0] = [[0.0, 0.2, 1.0, 1.2], [5.0, 5.2, 5.4, 5.6]]
    mask = np.array([[True, True, True, True], [True, False, True, True]])
    scan, filled = surface_points(points, mask)
    assert (np.diff(scan) >= 0).all()
    assert np.diff(np.sort(filled[scan == 0, 0])).max() == pytest.approx(0.8)
    assert not ((filled[:, 0] > 0.2 + 1e-9) & (filled[:, 0] < 1.0)).any()
    assert not ((filled[:, 0] > 5.0) & (filled[:, 0] < 5.4)).any()
    assert ((filled[:, 0] > 5.4) & (filled[:, 0] < 5.6)).sum() >= 3


@settings(max_examples=50)
@given(st.floats(0.05, 1.0), st.lists(st.booleans(), min_size=1, max_size=12))
def test_grid_follows_the_autoregression(gain, seen):
    """A cell's value is g <- (1 - gain) g + gain hit, written out."""
    grid = ForegroundGrid(room(), gain)
    cell, expected = hits(grid, 4.0, 3.0), 0.0
    for hit in seen:
        ranges = np.full(181, 2.5 if hit else 6.0)
        grid.update(cell if hit else cell[:0], np.array([4.0, 0.5, np.pi / 2]), ANGLES, ranges)
        expected = (1 - gain) * expected + gain * hit
        expected = 0.0 if expected < 0.5 * gain else expected
        assert grid.value[cell[0]] == pytest.approx(expected)


def test_the_shadow_is_not_erased():
    """A can behind the user keeps its cells; what a beam passes through fades."""
    grid, pose = ForegroundGrid(room(), 0.6), np.array([4.0, 0.5, np.pi / 2])
    can = hits(grid, 4.0, 3.0)
    grid.update(can, pose, ANGLES, np.full(181, 2.5))
    for _ in range(20):
        grid.update(can[:0], pose, ANGLES, np.full(181, 1.0))
    assert grid.value[can[0]] == pytest.approx(0.6)
    for _ in range(3):
        grid.update(can[:0], pose, ANGLES, np.full(181, 6.0))
    assert grid.value[can[0]] == 0.0


def test_an_object_in_the_shadow_is_not_sensed():
    """Remembered blobs that the scan did not meet are not offered to the tracker."""
    grid, pose = ForegroundGrid(room(), 0.6), np.array([4.0, 0.5, np.pi / 2])
    can = np.concatenate([hits(grid, 3.91 + 0.05 * k, 3.0) for k in range(4)])
    grid.update(can, pose, ANGLES, np.full(181, 2.5))
    np.testing.assert_allclose(grid.objects(), [[4.0, 3.025]])
    grid.update(can[:0], pose, ANGLES, np.full(181, 1.0))
    assert len(grid.blobs()) == 1 and len(grid.objects()) == 0


def test_seen_free_knows_beam_range_and_field_of_view():
    """Before the reading is free; behind it, or behind the sensor, is not."""
    points = np.array([[4.0, 2.0], [4.0, 3.2], [4.0, 0.1], [5.0, 0.6]])
    free = seen_free(points, np.array([4.0, 0.5, np.pi / 2]), ANGLES, np.full(181, 2.5))
    np.testing.assert_array_equal(free, [True, False, False, True])


@given(st.floats(-10, 10), st.booleans())
def test_the_sensors_frame_has_no_favourite_zero(turn, all_round):
    """Bearings counted from elsewhere, the pose turned back as much, change nothing."""
    angles = np.radians(np.arange(0.0, 360.0)) if all_round else ANGLES
    rng, pose = np.random.default_rng(0), np.array([4.0, 4.0, 0.3])
    points, ranges = rng.uniform(0, 8, (200, 2)), rng.uniform(0, 6, len(angles))
    expected = seen_free(points, pose, angles, ranges)
    found = seen_free(points, pose - [0, 0, turn], angles + turn, ranges)
    np.testing.assert_array_equal(found, expected)
    assert 20 < expected.sum() < 180


def test_a_laser_that_looks_all_round_has_no_gap():
    """Between its last beam and its first, each stands for its half."""
    bearings = np.linspace(-np.pi, np.pi, 1000)
    points = np.column_stack([np.cos(bearings), np.sin(bearings)])
    angles = np.radians(np.arange(0.0, 360.0, 4.0))
    assert seen_free(points, np.zeros(3), angles, np.full(90, 2.0)).all()


cells = st.sets(st.tuples(st.integers(0, 11), st.integers(0, 11)), max_size=40)


@given(cells)
def test_blobs_are_the_connected_components(occupied):
    """Blobs equal those of a plain flood fill over eight neighbours, small ones left out."""
    blobs = find_blobs(np.array(sorted(occupied), int).reshape(-1, 2), 0.05)
    expected, left = [], set(occupied)
    while left:
        blob, front = set(), [left.pop()]
        while front:
            r, c = front.pop()
            blob.add((r, c))
            near = {(r + i, c + j) for i in (-1, 0, 1) for j in (-1, 0, 1)} & left
            left -= near
            front += near
        if len(blob) >= 4:
            expected.append(frozenset(blob))
    cells = (blobs.cells[blobs.labels == k].tolist() for k in range(len(blobs)))
    found = {frozenset(map(tuple, each)) for each in cells}
    assert found == set(expected)
    for k in range(len(blobs)):
        inside = blobs.cells[blobs.labels == k]
        centroid = _blob_centroids(blobs.cells, blobs.labels, np.zeros(2), 0.05)[k]
        np.testing.assert_allclose(centroid, 0.05 * (inside.mean(axis=0)[::-1] + 0.5))
        assert blobs.areas[k] == pytest.approx(len(inside) * 0.0025)


@given(st.lists(st.integers(0, 60), min_size=1, max_size=30))
def test_closed_up_keeps_who_is_beside_whom(index):
    """Lines stay equal, neighbouring or apart as they were, and at most one in two is empty."""
    index = np.array(index)
    closed = _closed_up(index)
    np.testing.assert_array_equal(
        np.minimum(np.abs(closed[:, None] - closed), 2), np.minimum(np.abs(index[:, None] - index), 2)
    )
    assert closed.min() == 0 and np.diff(np.sort(closed)).max(initial=0) <= 2


def test_min_area_is_a_hundred_square_centimetres():
    """Four cells of 5 cm make a foreground object, three do not (Sec. II)."""
    row = np.column_stack([np.zeros(4, int), np.arange(4)])
    assert len(find_blobs(row, 0.05)) == 1
    assert len(find_blobs(row[:3], 0.05)) == 0


def test_boxes_envelop_their_blobs():
    """A box reaches from the outer edge of the first cell to that of the last."""
    blobs = find_blobs(np.array([[2, 3], [2, 4], [3, 4], [4, 5]]), 0.1)
    boxes = bounding_boxes(blobs, np.array([1.0, 2.0]), 0.1)
    np.testing.assert_allclose(boxes, [[1.3, 2.2, 1.6, 2.5]])


def test_legs_within_a_stride_are_one_object():
    """Two blobs are two objects, or one where the stride says so, its centroid between them."""
    grid, pose = ForegroundGrid(room(), 0.6), np.array([4.0, 0.5, np.pi / 2])
    legs = np.concatenate([hits(grid, x + 0.05 * k, 3.0) for x in (3.51, 4.01) for k in range(4)])
    grid.update(legs, pose, ANGLES, np.full(181, 2.5))
    assert len(grid.objects()) == 2 and len(grid.objects(stride=0.4)) == 2
    np.testing.assert_allclose(grid.objects(stride=0.6), [[3.85, 3.025]])


@pytest.mark.parametrize("gain", [0.0, -1.0, 1.5, np.nan])
def test_gain_out_of_range_is_named(gain):
    """The error names the value and the rule."""
    with pytest.raises(ValueError, match=r"gain must be "):
        ForegroundGrid(room(), gain)


def test_a_cell_just_before_its_hit_is_not_swept():
    """A beam sweeps a remembered cell only if it went on for a cell's side beyond it."""
    pose = np.array([4.0, 0.5, np.pi / 2])
    for beyond, value in ((0.04, 0.6), (0.06, 0.6 * 0.4)):
        grid = ForegroundGrid(room(), 0.6)
        can = hits(grid, 4.01, 3.01)
        grid.update(can, pose, ANGLES, np.full(181, 2.525))
        assert grid.value[can[0]] == pytest.approx(0.6)
        reach = np.hypot(*(grid.centres(can)[0] - pose[:2])) + beyond
        grid.update(can[:0], pose, ANGLES, np.full(181, reach))
        assert grid.value[can[0]] == pytest.approx(value if value > 0.3 else 0.0)


def test_surfaces_end_at_a_jump_of_thirty_centimetres():
    """Neighbouring readings 0.29 m apart are one closed surface, 0.31 m apart they are two."""
    for gap, added in ((0.29, 5), (0.31, 0), (0.04, 0)):
        points = np.array([[[0.0, 0.0], [0.6 * gap, 0.8 * gap]]])
        scan, filled = surface_points(points, np.ones((1, 2), bool))
        assert len(scan) == 2 + added
        if added:
            steps = np.diff(filled[np.argsort(filled[:, 0])], axis=0)
            np.testing.assert_allclose(np.hypot(*steps.T), gap / 6)


def test_occupied_is_above_one_half():
    """Blobs and objects begin above 0.5: hit twice at a gain of 0.3 is occupied, once is not."""
    grid, pose = ForegroundGrid(room(), 0.3), np.array([4.0, 0.5, np.pi / 2])
    can = np.concatenate([hits(grid, 3.91 + 0.05 * k, 3.0) for k in range(4)])
    for value, count in ((0.3, 0), (0.51, 1)):
        grid.update(can, pose, ANGLES, np.full(181, 2.5))
        np.testing.assert_allclose(grid.value[can], value)
        assert len(grid.blobs()) == len(grid.objects()) == count


# ---- what stands, remembered in seconds

POSE = np.array([4.0, 0.5, np.pi / 2])
RATES = [4.5, 5.0, 10.0, 20.0, 40.0]
CAN = np.array([[4.01, 3.01]])
CELL = hits(ForegroundGrid(room(), 1.0), *CAN[0])


def look(cells, t, hit=True, ranges=None):
    """One scan, in which a beam hits the can, or in its place goes on for 6 m or as far as it does."""
    where = (CELL, CAN) if hit else (CELL[:0], CAN[:0])
    cells.look(t, *where, POSE, ANGLES, np.full(181, ranges or (2.5 if hit else 6.0)))


def looked(cells, seconds, rate, begin=0.0, **scan):
    """Let a memory look, whenever it is due, at scans that come at a rate."""
    for t in begin + np.arange(0, seconds, 1 / rate):
        if cells.due(t):
            look(cells, t, **scan)
    return cells


@pytest.mark.parametrize("rate", RATES)
def test_what_is_hit_stands_after_a_time_whatever_the_rate(rate):
    """Not yet after 0.8 s, and surely after 1.6 s, by lasers from 4.5 to 40 scans a second."""
    for seconds, count in ((0.8, 0), (1.6, 1)):
        cells = looked(StandingCells(room()), seconds, rate)
        assert len(cells.standing()) == count
    np.testing.assert_allclose(cells.standing(), [[4.01, 3.01, 4.0, 0.5, 0.0, np.inf]])
    known = np.argwhere(np.isfinite(cells.known_since.reshape(160, 160)))
    assert (cells.known_since[CELL] == 0.0).all()
    np.testing.assert_array_equal(known, [(r, c) for r in (59, 60, 61) for c in (79, 80, 81)])  # 6 cm round it


@given(st.lists(st.tuples(st.floats(0.15, 0.5), st.booleans()), min_size=1, max_size=15))
def test_standing_follows_its_autoregression(steps):
    """It stands where v <- v + (1 - exp(-dt / tau)) (hit - v), written out, exceeds a half, unless it is just going."""
    cells, now, until, tau = StandingCells(room(), after=1.2), 0.0, 0.0, 1.2 / np.log(2)
    look(cells, now)
    value = 1 - np.exp(-0.15 / tau)
    for dt, hit in steps:
        now += dt
        look(cells, now, hit)
        gain = 1 - np.exp(-dt / tau)
        value += gain * (hit - value)
        value = 0.0 if not hit and value < 0.5 * gain else value  # is forgotten
        until = now if hit else until
        if abs(value - 0.5) > 1e-6 and abs(now - until - 0.6) > 1e-6:
            assert len(cells.standing()) == (value > 0.5 and (hit or now - until < 0.6))


@pytest.mark.parametrize("rate", RATES)
def test_what_stands_in_the_shadow_stands_on(rate):
    """However long somebody stands before it: neither does it fade, nor is it gone."""
    cells = looked(StandingCells(room()), 2.0, rate)
    looked(cells, 60.0, rate, begin=2.0, hit=False, ranges=1.0)
    assert len(cells.standing()) == 1 and len(cells.stood()) == 0


@pytest.mark.parametrize("rate", RATES)
def test_what_goes_is_gone_with_when_and_where(rate):
    """Where beams pass that hit before: from when until when it stood is known, to the time of a scan or two."""
    cells = looked(StandingCells(room()), 3.0, rate, begin=1.0)
    looked(cells, 3.0, rate, begin=4.0, hit=False)
    assert len(cells.standing()) == 0 and np.isinf(cells.known_since).all()
    ((*where, since, until),) = cells.stood()
    assert where == pytest.approx([4.01, 3.01, 4.0, 0.5])
    assert since == pytest.approx(1.0) and until == pytest.approx(4.0, abs=0.15 + 1 / rate)


def test_a_pause_counts_for_no_more_than_half_a_second():
    """Hit twice an hour apart does not stand; nor does what stands fade from one look after a pause."""
    cells = StandingCells(room())
    look(cells, 0.0)
    look(cells, 3600.0)
    assert len(cells.standing()) == 0
    cells = looked(StandingCells(room()), 6.0, 10.0)
    look(cells, 3600.0, hit=False)
    assert len(cells.stood()) == 0


def test_single_hits_never_stand():
    """Once here and once there all over the room, for hours: nothing stands, and nothing stood."""
    cells, rng, grid = StandingCells(room()), np.random.default_rng(0), ForegroundGrid(room(), 1.0)
    for k in range(2000):
        place = rng.uniform(1.0, 7.0, (1, 2))
        cells.look(5.0 * k, hits(grid, *place[0]), place, POSE, ANGLES, np.full(181, 9.0))
    assert len(cells.standing()) == len(cells.stood()) == 0 and np.isinf(cells.known_since).all()


def test_the_floor_is_seen_where_beams_pass_and_end():
    """Up to the reading, not behind it; what does not come back counts as far as any did, unless it is alone."""
    floor, ranges = SeenFloor(room()), np.full(181, 3.0)
    ranges[100:] = 0.5
    ranges[[130, 134, 138, 142]] = np.inf
    floor.look(7.0, POSE, ANGLES, ranges)
    places = np.array([[4.0, 2.0], [5.0, 2.0], [4.0, 3.35], [4.0, 4.0], [2.0, 2.0], [4.0, -3.0]])
    assert floor.first_at(places).tolist() == [7.0, 7.0, 7.0, np.inf, np.inf, np.inf]
    assert floor.grid().sum() == pytest.approx(np.pi * 3**2 / 4 / 0.01, rel=0.2)
    ranges[100:] = np.inf
    floor.look(8.0, POSE, ANGLES, ranges)
    assert floor.first_at(places).tolist() == [7.0, 7.0, 7.0, np.inf, 8.0, np.inf]


def test_the_floor_of_a_large_map_has_larger_cells():
    """Five kilometres of cells of a metre are no fifty thousand of ten centimetres along each side."""
    floor = SeenFloor(OccupancyGrid(np.zeros((4000, 5000)), (0.0, 0.0), 1.0))
    assert floor.first.size < 5_100_000 and floor.resolution == pytest.approx(2.0)
    assert SeenFloor(room()).resolution == 0.10


def test_the_floor_keeps_when_it_was_seen_first():
    """A second look adds what is new, and changes no time; looks come no more often than once a second."""
    floor, near, far = SeenFloor(room()), np.array([[4.0, 2.0]]), np.array([[4.0, 5.0]])
    floor.look(1.0, POSE, ANGLES, np.full(181, 3.0))
    assert not floor.due(1.5) and floor.due(2.0)
    floor.look(2.0, POSE, ANGLES, np.full(181, 6.0))
    assert floor.first_at(near) == 1.0 and floor.first_at(far) == 2.0
