"""Rooms: walls round a floor of any shape, furniture in it, and what is refused."""

import numpy as np
import pytest
from matplotlib.path import Path
from random_scenes import random_corners, random_part, turned

from dollop.lab.outlines import Outline, outline_distances
from dollop.lab.rooms import LABORATORY, WALL_THICKNESS, Part, Room, panel, walls

SEEDS = range(20)
SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
ELL = np.array([(0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5)], dtype=float)


def samples_of(room, step=0.01):
    """Points (N, 2) on a room's walls and in its furniture, 1 cm apart."""
    ends = zip(room.corners, np.roll(room.corners, -1, axis=0), strict=True)
    lines = [np.linspace(begin, end, int(np.linalg.norm(end - begin) / step) + 2) for begin, end in ends]
    for part in room.furniture:
        half = np.array(part.size[:2]) / 2
        x, y = (np.linspace(-each, each, int(2 * each / step) + 2) for each in half)
        grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        if part.shape == "cylinder":
            grid = grid[np.linalg.norm(grid, axis=1) <= half[0]]
        lines.append(turned(grid, part.turn) + part.centre[:2])
    return np.concatenate(lines)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_distance_is_to_the_nearest_sampled_point(seed):
    """The distance to walls and furniture equals the one to the nearest of many points on them; outside it is zero."""
    rng = np.random.default_rng(seed)
    empty = Room(random_corners(rng))
    room = Room(empty.corners, [random_part(rng, empty) for _ in range(3)])
    points = rng.uniform(room.bounds[:2] - 1.0, room.bounds[2:] + 1.0, (60, 2))
    brute = np.linalg.norm(points[:, None] - samples_of(room), axis=2).min(axis=1)
    expected = np.where(Path(room.corners).contains_points(points), brute, 0.0)
    assert np.allclose(room.distance(points), expected, atol=0.02)


def test_the_laboratory_encloses_all_furniture():
    """No furniture stands through a wall, and the room is nine metres by seven."""
    assert LABORATORY.bounds.tolist() == [0.0, 0.0, 9.0, 7.0]
    bounds = np.array([part.outline.bounds for part in LABORATORY.furniture])
    assert np.all(bounds[:, :2] >= -1e-9) and np.all(bounds[:, 2:] <= [9.0 + 1e-9, 7.0 + 1e-9])


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 4, np.pi / 2, -2.0])
@pytest.mark.parametrize("corners", [np.array(SQUARE), ELL, ELL[::-1]])
def test_walls_stand_outside_of_the_floor_and_close_it(corners, angle):
    """A step outwards from the edge of the floor or from a corner is in a wall, a step inwards in none."""
    room = Room(turned(corners, angle))
    outlines = [wall.outline for wall in walls(room)]
    along = np.roll(room.corners, -1, axis=0) - room.corners
    outwards = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    shares = np.linspace(0.0, 1.0, 50)[:, None, None]
    edge, step = room.corners + shares * along, WALL_THICKNESS / 2
    assert outline_distances(edge + step * outwards, outlines).min(axis=1).max() < 1e-9
    convex = room.corners + step * (outwards + np.roll(outwards, 1, axis=0)) * is_convex(along)[:, None]
    assert outline_distances(convex, outlines).min(axis=1).max() < 1e-9
    floor = (edge - step * outwards)[2:-2].reshape(-1, 2)
    assert outline_distances(floor, outlines).min() > step - 1e-9


def is_convex(along):
    """Whether the way round, by edges (K, 2), turns left at the corner where each begins."""
    before = np.roll(along, 1, axis=0)
    return before[:, 0] * along[:, 1] > before[:, 1] * along[:, 0]


def test_corners_are_counted_counter_clockwise():
    """Given clockwise, they are turned round; given the other way, they stay."""
    for corners in (SQUARE, SQUARE[::-1]):
        assert np.array_equal(Room(corners).corners, SQUARE)


def test_a_panel_along_an_axis_is_exactly_along_it():
    """Its outline has no turn where it runs along x or y, either way, and keeps its length; else it has."""
    for quarter, bounds in enumerate([(-1, -0.1, 1, 0.1), (-0.1, -1, 0.1, 1)] * 2):
        along = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][quarter])
        part = panel((0.0, 0.0), 2.0, along, 0.2, 1.0, (0.5, 0.5, 0.5))
        assert part.turn == 0.0 and part.outline.bounds.tolist() == pytest.approx(bounds)
    assert panel((0.0, 0.0), 2.0, (0.6, 0.8), 0.2, 1.0, (0.5, 0.5, 0.5)).turn == pytest.approx(np.arctan2(0.8, 0.6))


@pytest.mark.parametrize(("x", "y", "held"), [(0.301, 2, True), (0.299, 2, False), (2.199, 3, True), (2.201, 3, False)])
def test_a_room_holds_what_is_against_a_wall_and_not_in_it(x, y, held):
    """A disc may stand a millimetre from a wall or a cabinet, and may not a millimetre within."""
    room = Room(SQUARE, [Part("box", (3.0, 3.0, 0.5), (1.0, 1.0, 1.0))])
    assert room.holds(Outline(x, y, radius=0.3)) == held
    assert not room.holds(Outline(x + 9.0, y, radius=0.3))


CABINET, SUNK = Part("box", (5.0, 1.0, 0.5), (1.0, 1.0, 1.0)), Part("box", (2.0, 1.0, 0.4), (1.0, 1.0, 1.0))
ROUND = [(10 * np.cos(bearing), 10 * np.sin(bearing)) for bearing in np.linspace(0, 2 * np.pi, 101, endpoint=False)]
NEARLY_IN_TOUCH = [(0, 0), (0, 5), (3.0, 5), (3.0, 1), (3.05, 0.89), (3.05, 5), (6, 5), (6, 0)]
BAD_ROOMS = [
    ({"corners": [(0, 0), (4, 4), (4, 0), (0, 4)]}, "must not cross, got walls 0 and 2"),
    ({"corners": [(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)]}, "must not cross, got walls 0 and 2"),
    ({"corners": [(0, 0), (4, 0), (2, 0)]}, "must not cross|floor of a room must be positive"),
    (
        {"corners": [(0, 0), (4, 0), (4, 4), (2, 0.5), (0, 4)]},
        r"must not stand in the floor, got one from \(4.0, 4.0\)",
    ),
    ({"corners": NEARLY_IN_TOUCH}, r"0.1 m thick and must not stand in the floor, got one from \(3.05, 5.0\)"),
    ({"corners": [(0, 0), (1e300, 0), (0, 4)]}, "within 1e\\+09 m of the origin"),
    ({"corners": [(0, 0), (1000, 0), (1000, 4), (0, 4)]}, "100 corners and be 200 m long at most, got 4 and 1000 m"),
    ({"corners": ROUND}, "at most 100 corners and be 200 m long at most, got 101 and"),
    ({"corners": SQUARE, "height": "2.4"}, "height of a room must be a finite number, got '2.4'"),
    ({"corners": SQUARE, "height": True}, "height of a room must be a finite number, got True"),
    (
        {"corners": SQUARE, "height": 10**400},
        r"height of a room must be a finite number within 1e\+09, got .* 401 digits",
    ),
    ({"corners": SQUARE, "height": 21.0}, "height of a room must be in 0.1 to 20, got 21.0"),
    ({"corners": [(0, 0), (4, "far"), (4, 4)]}, "corners of a room must be numbers in rows of one length, got .*'far'"),
    ({"corners": [(0, 0), (4, 10**400), (4, 4)]}, "corners of a room must be numbers in rows of one length, got"),
    ({"corners": SQUARE, "furniture": [SUNK]}, r"must stand in the room, got a box at \(2.0, 1.0\)"),
    ({"corners": [(0, 0), (4, 0)]}, "needs three corners or more, got 2"),
    ({"corners": [(0, 0), (4, 0), (4, 0.05), (0, 4)]}, r"at least 0.1 m long, got 0.050 m at corner 1"),
    ({"corners": [(0, 0), (4, 0), (np.nan, 4)]}, "corners of a room must be finite, got .*nan"),
    ({"corners": [(0, 0, 0), (4, 0, 0), (4, 4, 0)]}, r"shape \(N, 2\), got \(3, 3\)"),
    ({"corners": SQUARE, "height": 0.0}, "height of a room must be in 0.1 to 20, got 0.0"),
    ({"corners": SQUARE, "furniture": [CABINET]}, r"must stand in the room, got a box at \(5.0, 1.0\)"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_ROOMS)
def test_rooms_that_cannot_be_are_refused(parts, rule):
    """Walls that cross, touch or are too short, too few corners and furniture outside raise ValueError that says so."""
    with pytest.raises(ValueError, match=rule):
        Room(**parts)


BAD_PARTS = [
    ({"shape": "ball"}, "shape must be one of 'box', 'cylinder', got 'ball'"),
    ({"centre": (1.0, np.nan, 0.5)}, "centre must be finite, got nan"),
    ({"size": (1.0, 0.0, 1.0)}, "size must be positive and finite, got 0.0"),
    ({"shape": "cylinder", "size": (1.0, 2.0, 1.0)}, "as deep as wide"),
    ({"turn": np.nan}, r"turn must be a finite number within 1e\+09, got nan"),
    ({"turn": "0.4"}, "turn must be a finite number, got '0.4'"),
    ({"turn": False}, "turn must be a finite number, got False"),
    ({"turn": 10**400}, r"turn must be a finite number within 1e\+09, got .* 401 digits"),
    ({"size": (1.0, "wide", 1.0)}, "size must be numbers in rows of one length, got .*'wide'"),
    ({"centre": (1.0, 10**400, 0.5)}, "centre must be numbers in rows of one length, got"),
    ({"colour": (1.0, 1.0)}, r"colour must have shape \(3,\), got \(2,\)"),
]


@pytest.mark.parametrize(("parts", "rule"), BAD_PARTS)
def test_furniture_that_cannot_be_is_refused(parts, rule):
    """An unknown shape, and a number that is not finite or not positive, raise ValueError that names it."""
    with pytest.raises(ValueError, match=rule):
        Part(**({"shape": "box", "centre": (1.0, 1.0, 0.5), "size": (1.0, 1.0, 1.0)} | parts))
