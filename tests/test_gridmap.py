"""Occupancy grids: built from logs, measured, written and read."""

import gzip
import os
import tempfile
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from dollop import gridmap
from dollop.formats.files import FormatError
from dollop.formats.logs import read_log
from dollop.gridmap import OccupancyGrid, distances_to, map_inputs, map_outputs
from dollop.laser import LaserLog

ROOM = np.array([[-2.02, 3.01], [-1.51, 2.53]])  # xmin, xmax; ymin, ymax


def room_log(poses, max_range=8.0, beams=361):
    """Exact scans of an empty rectangular room."""
    poses = np.asarray(poses, dtype=float)
    angles = np.linspace(-np.pi, np.pi, beams)[:-1]
    bearings = poses[:, 2, None] + angles
    directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    walls = np.where(directions > 0, ROOM[:, 1], ROOM[:, 0]) - poses[:, None, :2]
    reach = walls / np.where(directions == 0, 1e-9, directions)
    ranges = np.min(reach, axis=-1, where=directions != 0, initial=np.inf)
    ranges = np.where(ranges > max_range, np.inf, ranges)
    return LaserLog(np.arange(len(poses)) / 10, ranges, angles, poses, max_range)


POSES = [(x, y, heading) for x in (-1.0, 0.52, 2.0) for y in (-0.5, 1.03) for heading in (0.1, 1.2)]


def distance_to_walls(points):
    """Distance of points from the outline of the room."""
    inside = np.min(np.abs(np.asarray(points)[..., None] - ROOM), axis=(-2, -1))
    beyond = np.maximum(np.maximum(ROOM[:, 0] - points, points - ROOM[:, 1]), 0)
    return np.where(beyond.any(axis=-1), np.linalg.norm(beyond, axis=-1), inside)


def test_room_is_recovered():
    """The walls, all of them and nothing else, are occupied.

    The inside is free, the outside unknown.
    """
    grid = OccupancyGrid.from_log(room_log(POSES), resolution=0.05)
    rows_cols = np.argwhere(np.ones(grid.occupancy.shape))
    distance, occupied = distance_to_walls(grid.cell_centres(rows_cols)), grid.occupied.ravel()
    assert distance[occupied].max() <= 0.05 / np.sqrt(2) + 1e-9
    along = np.linspace(0, 1, 200)[:, None]
    (left, right), (low, high) = ROOM
    corners = np.array([[left, low], [right, low], [right, high], [left, high], [left, low]])
    sides = zip(corners[:-1], corners[1:], strict=True)
    outline = np.concatenate([a + along * (b - a) for a, b in sides])
    assert grid.distance_at(outline * 0.9999).max() <= 0.1
    centres = grid.cell_centres(rows_cols)
    inside = ((centres > ROOM[:, 0] + 0.1) & (centres < ROOM[:, 1] - 0.1)).all(axis=1)
    assert grid.free.ravel()[inside].mean() > 0.999
    outside = ((centres < ROOM[:, 0] - 0.05) | (centres > ROOM[:, 1] + 0.05)).any(axis=1)
    assert grid.unknown.ravel()[outside].all()


def test_world_frame_does_not_matter():
    """Shifting all poses by whole cells shifts the grid's origin; the cells stay as they are."""
    log = room_log(POSES)
    moved = LaserLog(log.t, log.ranges, log.angles, log.poses + [64.0, -32.0, 0.0], log.max_range)
    grid, other = OccupancyGrid.from_log(log, 0.0625), OccupancyGrid.from_log(moved, 0.0625)
    np.testing.assert_allclose(np.subtract(other.origin, grid.origin), [64, -32])
    assert (grid.occupied == other.occupied).mean() > 0.999


def test_what_passes_is_swept_away():
    """Something seen for a fifth of the time leaves no occupied cell.

    If for most of it, it does.
    """
    for share, stays in ((0.2, False), (0.8, True)):
        log = room_log([(0.0, 0.0, 0.0)] * 40)
        ranges = log.ranges.copy()
        ranges[: int(40 * share), 170:190] = 1.0
        grid = OccupancyGrid.from_log(LaserLog(log.t, ranges, log.angles, log.poses, log.max_range))
        row, col = grid.world_to_cell([1.0, 0.0])
        assert grid.occupied[row - 1 : row + 2, col - 1 : col + 2].any() == stays


def test_beams_without_return_clear_up_to_the_maximum_range():
    """A beam that does not come back frees cells up to the maximum range, and hits none."""
    log = LaserLog([0.0, 0.1], [[np.inf, 30.0]] * 2, [0.0, 1.0], [[0, 0, 0]] * 2, 50.0)
    grid = OccupancyGrid.from_log(log, resolution=0.1, max_range=3.0)
    assert grid.free.any() and not grid.occupied.any()
    freed = grid.cell_centres(np.argwhere(grid.free))
    assert 2.8 < np.linalg.norm(freed, axis=1).max() < 3.1


def test_oversized_grid_is_refused():
    """A pose so far astray that it asks for billions of cells is an error; it tells the size."""
    log = replace(room_log([(0, 0, 0), (1, 1, 0)]), poses=[(0, 0, 0), (400, 400, 0)])
    with pytest.raises(ValueError, match=r"^80\d\d x 80\d\d cells are more than 20000000"):
        OccupancyGrid.from_log(log)


@pytest.mark.parametrize("name", ["resolution", "max_range"])
@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf])
def test_parameters_out_of_range_are_named(name, value):
    """The error names the parameter, the value and the rule."""
    with pytest.raises(ValueError, match=f"{name} must be .*, got {value}"):
        OccupancyGrid.from_log(room_log([(0, 0, 0)]), **{name: value})


def test_what_was_checked_stays():
    """The cells are a read-only copy, and so is the distance field that belongs to them."""
    cells = np.array([[0.0, 1.0]])
    grid = OccupancyGrid(cells, (0.0, 0.0), 0.05)
    cells[0, 0] = -7
    assert grid.occupancy[0, 0] == 0.0
    for array in (grid.occupancy, grid.distance_field()):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0


GRIDS = hnp.arrays(
    float,
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=7),
    elements=st.one_of(st.just(np.nan), st.sampled_from([0.0, 0.5, 1.0]), st.floats(0, 1)),
)
ORIGINS = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))


@settings(max_examples=60)
@given(GRIDS, ORIGINS, st.sampled_from([0.05, 0.1, 0.025]), st.sampled_from([".map", ".yaml"]))
def test_save_load_round_trip(occupancy, origin, resolution, suffix):
    """Occupied, free and unknown cells come back as they were.

    Probabilities to the format's precision.
    """
    grid = OccupancyGrid(occupancy, origin, resolution)
    with tempfile.TemporaryDirectory() as folder:
        grid.save(Path(folder) / f"a{suffix}")
        other = OccupancyGrid.load(Path(folder) / f"a{suffix}")
    assert other.origin == grid.origin and other.resolution == resolution
    np.testing.assert_array_equal(other.unknown, grid.unknown)
    np.testing.assert_allclose(other.occupancy, occupancy, atol=1e-7 if suffix == ".map" else 0.01)
    if suffix == ".yaml":
        np.testing.assert_array_equal(other.occupied, grid.occupied)


@given(GRIDS)
def test_distance_field_is_brute_force(occupancy):
    """The distance field is the smallest distance between cell centres.

    Inf if nothing is occupied.
    """
    grid = OccupancyGrid(occupancy, (1.0, 2.0), 0.1)
    centres = grid.cell_centres(np.argwhere(np.ones(occupancy.shape)))
    obstacles = grid.cell_centres(np.argwhere(grid.occupied))
    pairs = np.linalg.norm(centres[:, None] - obstacles, axis=-1)
    expected = pairs.min(axis=1, initial=np.inf)
    np.testing.assert_allclose(grid.distance_field().ravel(), expected, atol=1e-9)
    np.testing.assert_allclose(grid.distance_at(centres), expected, atol=1e-9)


def test_cells_and_points():
    """A cell's centre lies in that cell.

    Rows go with y, columns with x; off the map the distance is NaN.
    """
    grid = OccupancyGrid(np.zeros((3, 5)), (10.0, -20.0), 0.5)
    cells = np.argwhere(np.ones((3, 5)))
    np.testing.assert_array_equal(grid.world_to_cell(grid.cell_centres(cells)), cells)
    assert grid.world_to_cell([12.4, -20.0]).tolist() == [0, 4]
    points = [[10.0, -20.0], [12.49, -18.51], [12.5, -19.0], [9.99, -19.0], [np.nan, -19.0]]
    assert grid.covers(points).tolist() == [True, True, False, False, False]
    assert np.isnan(grid.distance_at(points)).tolist() == [False, False, True, True, True]
    assert grid.extent == (10.0, 12.5, -20.0, -18.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"occupancy": np.zeros(3)}, r"occupancy must have shape \(H, W\), got \(3,\)"),
        ({"occupancy": np.zeros((0, 3))}, r"occupancy must hold a cell, got shape \(0, 3\)"),
        ({"occupancy": [[0.0, 1.5]]}, r"must be in \[0, 1\].*got 1.5"),
        ({"occupancy": [[0.0, -1.0]]}, r"must be in \[0, 1\].*got -1.0"),
        ({"resolution": 0.0}, "resolution must be .*, got 0.0"),
        ({"resolution": np.nan}, "resolution must be .*, got nan"),
        ({"origin": (0.0, np.inf)}, "origin must be finite, got inf"),
        ({"origin": (0.0, 0.0, 0.0)}, r"origin must have shape \(2,\), got \(3,\)"),
    ],
)
def test_bad_values_are_named(change, message):
    """What is no grid of probabilities is refused with the value and the rule."""
    with pytest.raises(ValueError, match=message):
        good = {"occupancy": [[0.0, 1.0]], "origin": (0.0, 0.0), "resolution": 0.05}
        OccupancyGrid(**(good | change))


@pytest.mark.parametrize("name", ["room.map", "room.map.gz"])
def test_a_map_comes_back_packed_or_not(tmp_path, name):
    """CARMEN's maps keep cells, corner and resolution; what a command reads and writes is the file of that name."""
    grid = OccupancyGrid([[0.0, 1.0, np.nan], [0.25, 0.5, 0.75]], (1.5, -2.0), 0.05)
    grid.save(tmp_path / name)
    read = OccupancyGrid.load(tmp_path / name)
    np.testing.assert_array_equal(read.occupancy, grid.occupancy)
    assert (read.origin, read.resolution) == (grid.origin, grid.resolution)
    assert map_inputs(tmp_path / name) == [each.path for each in map_outputs(tmp_path / name)] == [tmp_path / name]


def test_a_packed_map_replaces_maps_only(tmp_path):
    """It may take the place of a map, packed or not; of a log that is packed as well it may not."""
    grid = OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05)
    grid.save(tmp_path / "a.map")
    (tmp_path / "a.map").rename(tmp_path / "a.map.gz")
    grid.save(tmp_path / "a.map.gz")
    assert (tmp_path / "a.map.gz").read_bytes()[:2] == b"\x1f\x8b"
    (tmp_path / "b.map.gz").write_bytes(gzip.compress(b"# CARMEN Logfile\n"))
    with pytest.raises(FileExistsError, match="it holds a CARMEN log and not a CARMEN map"):
        grid.save(tmp_path / "b.map.gz")


@pytest.mark.parametrize("name", ["a.gz", "a.yaml.gz", "a.map.GZ", "a.MAP.gz", "a.map.bz2", "a.log.gz"])
def test_only_carmen_maps_are_packed(tmp_path, name):
    """Any other name is refused, as it is for logs: `.log.gz` is a log, `.MAP.GZ` nothing."""
    with pytest.raises(FormatError, match=r"a map is named \.yaml \(ROS\), \.map or \.map\.gz \(CARMEN\)"):
        OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05).save(tmp_path / name)


def test_maps_by_suffix(tmp_path):
    """Other names are refused, on reading and on writing; a picture that is missing is named."""
    grid = OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05)
    with pytest.raises(FormatError, match="a map is named .yaml"):
        grid.save(tmp_path / "a.png")
    with pytest.raises(FormatError, match="a map is named .yaml"):
        OccupancyGrid.load(tmp_path / "a.png")
    grid.save(tmp_path / "a.yaml")
    (tmp_path / "a.pgm").unlink()
    with pytest.raises(FormatError, match=r"a\.yaml: its picture 'a\.pgm' is missing"):
        OccupancyGrid.load(tmp_path / "a.yaml")


EDITS = st.tuples(st.integers(0, 10**6), st.integers(0, 2), st.binary(max_size=6))


@settings(max_examples=200)
@given(
    name=st.sampled_from(["a.map", "a.map.gz", "a.yaml", "a.pgm"]),
    edits=st.lists(EDITS, min_size=1, max_size=4),
)
def test_damaged_maps_never_fail_in_the_depth(name, edits):
    """Whatever is overwritten, inserted or cut off in a map's files.

    A grid or a FormatError, and nothing else.
    """
    with tempfile.TemporaryDirectory() as folder:
        main = Path(folder) / name.replace(".pgm", ".yaml")
        OccupancyGrid([[0.0, 1.0, np.nan], [0.3, 0.7, 0.1]], (1.5, -2.0), 0.05).save(main)
        content = (Path(folder) / name).read_bytes()
        for place, action, piece in edits:
            place %= len(content) + 1
            end = {0: place + len(piece), 1: place, 2: len(content)}[action]
            content = content[:place] + piece + content[end:]
        (Path(folder) / name).write_bytes(content)
        try:
            assert OccupancyGrid.load(main).occupancy.size > 0
        except FormatError as error:
            assert folder in str(error)


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
@pytest.mark.filterwarnings("ignore:.*clock")
def test_real_building():
    """The grid of the Intel lab explains its own scans.

    Nearly all readings lie within 10 cm of an occupied cell.
    """
    log = read_log(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "carmen_logs/intel-corrected.log.gz")
    grid = OccupancyGrid.from_log(log)
    scan, beam = np.nonzero(log.ranges < 20)
    bearing = log.poses[scan, 2] + log.angles[beam]
    reach = log.ranges[scan, beam, None]
    points = log.poses[scan, :2] + reach * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    assert grid.covers(points).all()
    assert (grid.distance_at(points) <= 0.1).mean() > 0.9
    assert 5_000 < grid.occupied.sum() < 20_000


@pytest.mark.parametrize("heading", [0.3, 2.0, -2.5])
def test_counts_are_those_of_one_beam_at_a_time(heading):
    """A laser that sees half of a plane.

    Every cell holds hits / (hits + passes), beam by beam and step by step.
    """
    rng, golden, resolution = np.random.default_rng(1), (np.sqrt(5) - 1) / 2, 0.1
    ranges = rng.uniform(0.05, 4.0, (5, 31))
    ranges[rng.random(ranges.shape) < 0.2] = np.inf
    ranges[0, :2] = 3.0, 3.001
    poses = np.column_stack([rng.uniform(-1, 1, (5, 2)), np.full(5, heading)])
    log = LaserLog(np.arange(5.0), ranges, np.linspace(-1.2, 1.2, 31), poses, 4.0)
    grid = OccupancyGrid.from_log(log, resolution, max_range=3.0)
    counts = np.zeros((*grid.occupancy.shape, 2))
    for scan, (x, y, theta) in enumerate(poses):
        for beam, reach in enumerate(ranges[scan]):
            bearing, hit = theta + log.angles[beam], reach <= 3.0
            way = np.array([np.cos(bearing), np.sin(bearing)])
            if hit:
                counts[(*grid.world_to_cell([x, y] + reach * way), 0)] += 1
            for step in range(int(min(reach, 3.0) / resolution - np.sqrt(2) * hit)):
                along = (step + scan * golden % 1) * resolution
                counts[(*grid.world_to_cell([x, y] + along * way), 1)] += 1
    with np.errstate(invalid="ignore"):
        np.testing.assert_allclose(grid.occupancy, counts[..., 0] / counts.sum(axis=-1))
    seen = grid.cell_centres(np.argwhere(~grid.unknown))
    size = np.multiply(grid.occupancy.shape, resolution).max()
    assert np.ptp(seen, axis=0).max() + 6 * resolution > size


@pytest.mark.parametrize("shape", [(1, 9), (9, 1), (13, 17)])
def test_distances_are_those_of_all_pairs(shape):
    """To the nearest of all cells, by trying each."""
    cells = np.random.default_rng(1).random(shape) < 0.1
    cells[0, 0] = True
    every = np.argwhere(np.ones(shape))
    apart = np.linalg.norm(every[:, None] - np.argwhere(cells), axis=2).min(axis=1)
    assert distances_to(cells, 0.1) == pytest.approx(0.1 * apart.reshape(shape))


@pytest.mark.parametrize("resolution", [1e300, 1001.0, 1e-4, "0.05", True])
def test_a_resolution_that_no_map_has_is_named(resolution):
    """From a millimetre, which no laser tells, to a kilometre."""
    with pytest.raises(ValueError, match="resolution must be (in 0.001 to 1000|a finite number)"):
        OccupancyGrid.from_log(room_log([(0, 0, 0)]), resolution)


def test_a_map_is_refused_before_there_is_room_for_it():
    """A log of two scans 600 m apart, whose map had 100 million cells, costs next to nothing."""
    log = replace(room_log([(0, 0, 0), (1, 1, 0)]), poses=[(0, 0, 0), (490, 490, 0)])
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="cells are more than 20000000, the most that a map has"):
            OccupancyGrid.from_log(log)
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()


def test_a_map_is_the_same_in_whatever_parts_it_is_counted(monkeypatch):
    """Beam by beam, or all at once."""
    log = room_log([(0, 0, 0), (0.3, 0.2, 1.0), (-0.5, 0.1, 2.0)])
    whole = OccupancyGrid.from_log(log)
    monkeypatch.setattr(gridmap, "POINTS", 7)
    monkeypatch.setattr(gridmap, "READINGS", 100)
    np.testing.assert_array_equal(OccupancyGrid.from_log(log).occupancy, whole.occupancy)
