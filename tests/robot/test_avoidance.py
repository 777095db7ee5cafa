"""Going round obstacles: nothing changes where nothing is near, and every trap has a way out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot import avoidance
from dollop.robot.avoidance import FREEING, PIONEER_AVOIDANCE, Geodesic, ObstacleMap

BOX = ObstacleMap.of(Environment([[-0.5, -0.5, 0.5, 0.5]]))
angles = st.floats(-np.pi, np.pi)
places = st.tuples(st.floats(-3, 3), st.floats(-3, 3))


def unit(angle):
    return float(np.cos(angle)), float(np.sin(angle))


def trap():
    """A map with a U that is open to the left, and the goal to the right of it."""
    occupancy = np.zeros((120, 160))
    occupancy[30:90, 100:104] = occupancy[30:34, 40:104] = occupancy[86:90, 40:104] = 1
    return OccupancyGrid(occupancy, (0.0, 0.0), 0.05)


def test_edge_is_distance_less_radius():
    """Straight before a side of the box, the robot's edge is as far as geometry says, to a cell."""
    for x in (0.9, 1.5, 2.5):
        assert BOX.edge(x, 0.0) == pytest.approx(x - 0.5 - 0.25, abs=0.01)


def test_edges_agree_with_edge_up_to_the_border_and_beyond():
    """Asked for one place or many, inside the map and off it, the answer is the same."""
    points = np.random.default_rng(1).uniform(-5, 5, (300, 2))
    assert BOX.edges(points) == pytest.approx([BOX.edge(x, y) for x, y in points], abs=2e-4)


def test_inside_is_negative():
    """In the middle of the box the distance is that to its side, negative."""
    assert BOX.edge(0.0, 0.0) + BOX.radius == pytest.approx(-0.5, abs=0.06)


def test_unknown_and_beyond_the_map_are_obstacles():
    """What no beam has seen is not driven on, and neither is the border of the map."""
    occupancy = np.zeros((100, 100))
    occupancy[40:60, 40:60] = np.nan
    grid = OccupancyGrid(occupancy, (0.0, 0.0), 0.05)
    obstacles = ObstacleMap.of(Environment(np.empty((0, 4))), grid)
    assert obstacles.edge(2.5, 2.5) < -0.25
    assert obstacles.edge(0.3, 2.5) < 0.05
    assert obstacles.holds(4.99, 0.01) and not obstacles.holds(5.01, 0.01)


def test_open_world_has_no_edge():
    """Without boxes and background nothing is near anywhere."""
    assert ObstacleMap.of(Environment(np.empty((0, 4)))).edge(0.0, 0.0) > 100


@given(places, angles)
def test_unchanged_where_nothing_is_near(place, angle):
    """Beyond the influence the direction comes back as it was, to the last bit."""
    if BOX.edge(*place) >= PIONEER_AVOIDANCE.influence:
        assert BOX.modulate(*place, *unit(angle)) == unit(angle)


@given(places, angles)
def test_unchanged_when_leaving(place, angle):
    """A direction away from the obstacle is not touched."""
    _, nx, ny = BOX._edge_and_slope(*place)
    ux, uy = unit(angle)
    if nx * ux + ny * uy >= 0:
        assert BOX.modulate(*place, ux, uy) == (ux, uy)


@given(places, angles)
def test_modulation_is_the_formula(place, angle):
    """Within the influence: 1 - 1/Gamma along the normal, 1 + 1/Gamma along the tangent."""
    edge, nx, ny = BOX._edge_and_slope(*place)
    n, u = np.array([nx, ny]) / max(np.hypot(nx, ny), 1e-12), np.array(unit(angle))
    if edge < PIONEER_AVOIDANCE.influence and n @ u < -1e-6 and np.hypot(nx, ny) > 0.1:
        share = (PIONEER_AVOIDANCE.influence - edge) / (PIONEER_AVOIDANCE.influence - PIONEER_AVOIDANCE.kept)
        turned = (1 - share) * (n @ u) * n + (1 + share) * (u - (n @ u) * n)
        if np.hypot(*turned) > 1e-6:
            expected = tuple(turned / np.hypot(*turned))
            assert BOX.modulate(*place, *u) == pytest.approx(expected, abs=1e-6)


@given(places, angles)
def test_never_towards_what_is_at_the_kept_distance(place, angle):
    """At the kept distance or nearer, the direction has unit length and leads out, or along."""
    edge, nx, ny = BOX._edge_and_slope(*place)
    if edge <= PIONEER_AVOIDANCE.kept and nx * nx + ny * ny > 0.5:
        ux, uy = BOX.modulate(*place, *unit(angle))
        assert np.hypot(ux, uy) == pytest.approx(1)
        assert nx * ux + ny * uy >= -1e-9


@given(angles, angles)
def test_flow_keeps_clear_of_a_convex_obstacle(bearing, offset):
    """Straight flows towards a place behind the box go round it, at about the kept distance."""
    x, y = 2.5 * np.cos(bearing), 2.5 * np.sin(bearing)
    goal = (-2.5 * np.cos(bearing + offset / 4), -2.5 * np.sin(bearing + offset / 4))
    for _ in range(300):
        way = np.hypot(goal[0] - x, goal[1] - y)
        if way < 0.05:
            break
        ux, uy = BOX.modulate(x, y, (goal[0] - x) / way, (goal[1] - y) / way)
        x, y = x + 0.03 * ux, y + 0.03 * uy
        assert BOX.edge(x, y) > PIONEER_AVOIDANCE.kept - 0.05


@given(places, angles, st.floats(0.3, 3.0))
def test_speed_limit_uses_the_room_there_is(place, theta, deceleration):
    """A period at the limit and then braking takes less than the room, and nearly all of it where there is some."""
    limit = BOX.speed_limit(*place, theta, deceleration, 0.1)
    edge, nx, ny = BOX._edge_and_slope(*place)
    way = limit * 0.1 + limit**2 / (2 * deceleration)
    if edge > 0:
        assert way <= max(edge - 0.01, edge / 2) + 1e-9
        assert way >= edge - 0.01 - 1e-9
    else:
        assert limit == (FREEING if nx * np.cos(theta) + ny * np.sin(theta) > 0.5 else 0.0)


def test_geodesic_is_the_distance_in_the_open():
    """Where nothing is near, the way is straight, but for the eight directions of a grid (8 %)."""
    far = ObstacleMap.of(Environment([[-9, -9, -8, -8]]), places=[[0, 0], [4, 3]])
    way = Geodesic(far, (0.0, 0.0))
    for place in ((3.0, 0.0), (2.0, 2.0), (4.0, 1.5)):
        assert np.hypot(*place) - 0.08 <= way.distance(*place) <= 1.09 * np.hypot(*place)


def test_geodesic_against_brute_force():
    """The distances are those of relaxing all neighbours until nothing changes."""
    small = OccupancyGrid(np.pad(np.zeros((26, 30)), 1, constant_values=1), (0.0, 0.0), 0.05)
    way = Geodesic(ObstacleMap.of(Environment([[0.5, 0.6, 0.6, 0.7]]), small), (1.1, 0.4))
    costs = way.obstacles._neighbours.toarray()
    costs = np.where(costs + costs.T > 0, costs + costs.T, np.inf)
    distances = np.full(len(costs), np.inf)
    distances[way._goal_cell] = 0.0
    for _ in range(200):
        distances = np.minimum(distances, (costs + distances).min(axis=1))
    assert np.array(way._distances) == pytest.approx(distances)


def test_geodesic_leads_out_of_a_trap():
    """From inside a U, where turning along the wall comes to a halt, it leads round to the goal."""
    obstacles = ObstacleMap.of(Environment(np.empty((0, 4))), trap())
    way, (x, y) = Geodesic(obstacles, (7.0, 3.0)), (4.0, 3.0)
    for _ in range(600):
        ux, uy = way.direction(x, y)
        x, y = x + 0.03 * ux, y + 0.03 * uy
        assert obstacles.edge(x, y) > 0
    assert np.hypot(x - 7.0, y - 3.0) < 0.1


def test_the_way_keeps_off_what_may_be_occupied():
    """Cells from an occupancy of 0.2 on and the border are obstacles, wherever the map begins."""
    occupancy = np.zeros((60, 120))
    occupancy[28:32, 20:100] = 0.25
    grid = OccupancyGrid(occupancy, (1.0, -2.0), 0.05)
    obstacles = ObstacleMap.of(Environment(np.empty((0, 4))), grid)
    way, (x, y), nearest = Geodesic(obstacles, (6.5, 0.5)), (1.5, -1.5), np.inf
    for _ in range(400):
        ux, uy = way.direction(x, y)
        x, y = x + 0.02 * ux, y + 0.02 * uy
        nearest = min(nearest, obstacles.edge(x, y))
    assert np.hypot(x - 6.5, y - 0.5) < 0.1 and nearest > 0.06
    assert obstacles.edge(4.0, -0.5) < -0.25
    assert obstacles.edge(1.3, -1.5) == pytest.approx(0.0, abs=0.01)


def test_geodesic_to_a_walled_place():
    """Where there is no way, its length is infinite and it has no direction."""
    occupancy = np.zeros((100, 100))
    occupancy[:, 48:52] = 1
    grid = OccupancyGrid(occupancy, (0.0, 0.0), 0.05)
    way = Geodesic(ObstacleMap.of(Environment(np.empty((0, 4))), grid), (1.0, 2.5))
    assert way.distance(4.0, 2.5) == np.inf
    assert way.direction(4.0, 2.5) == (0.0, 0.0)


def test_geodesic_to_a_place_too_near_to_something():
    """The way to a place where the robot has no room ends at the nearest place where it has."""
    way = Geodesic(BOX, (0.6, 0.0))
    assert BOX.edge(*way.goal) > 0
    assert np.hypot(way.goal[0] - 0.6, way.goal[1]) < 0.35


@pytest.mark.parametrize("cells", [4_000, 40_000])
def test_larger_cells_never_promise_more_room(cells, monkeypatch):
    """Of a world for which there are too few cells of 5 cm, every distance is true or less, by two cells at most."""
    monkeypatch.setattr(avoidance, "MOST_CELLS", cells)
    rng = np.random.default_rng(0)
    low = rng.uniform(-9, 9, (12, 2))
    boxes = np.hstack([low, low + rng.uniform(0.1, 2.0, (12, 2))])
    coarse = ObstacleMap.of(Environment(boxes), places=[[-12, -12], [12, 12]])
    assert coarse.resolution > 0.1 and coarse.distances.size < 1.05 * cells
    points = rng.uniform(-12, 12, (5000, 2))
    outside = np.maximum(boxes[:, None, :2] - points, points - boxes[:, None, 2:])
    true = np.where((outside < 0).all(axis=2), outside.max(axis=2), np.hypot(*outside.clip(0).T).T).min(axis=0)
    told = coarse.edges(points) + coarse.radius
    assert (told[true > 0] <= true[true > 0]).all() and (told[true < 0] <= 0).all()
    assert (told >= true - 2.5 * coarse.resolution)[true > 0].all()


def test_larger_cells_of_a_map_keep_what_is_not_free(monkeypatch):
    """Of a map of too many cells too: one cell that is occupied or unknown blocks a whole square of them."""
    rng = np.random.default_rng(1)
    occupancy = np.where(rng.random((201, 302)) < 0.002, rng.choice([1.0, np.nan], (201, 302)), 0.0)
    grid, nothing = OccupancyGrid(occupancy, (1.0, -2.0), 0.05), Environment(np.empty((0, 4)))
    fine = ObstacleMap.of(nothing, grid)
    monkeypatch.setattr(avoidance, "MOST_CELLS", 15_000)
    coarse = ObstacleMap.of(nothing, grid)
    assert coarse.resolution == pytest.approx(0.15) and coarse.distances.shape == (67, 101)
    points = rng.uniform([1.1, -1.9], [16.0, 8.0], (3000, 2))
    assert (coarse.edges(points) <= fine.edges(points) + 1e-9).all()


def test_a_world_that_is_too_large_is_refused():
    """Cells would be coarser than a robot: the message says how large a world may be."""
    with pytest.raises(ValueError, match=r"3000000 cells of 0.5 m must hold all places and objects, got 1006 m x"):
        ObstacleMap.of(Environment([]), places=[[0, 0], [1000, 1000]])
    with pytest.raises(ValueError, match="got 1e"):
        ObstacleMap.of(Environment([[1e9, 0, 1e9 + 1, 1]]), places=[[0, 0]])


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1), (2, 2)])
def test_a_map_of_one_row_has_no_room(shape):
    """Its border is all of it."""
    grid = OccupancyGrid(np.zeros(shape), (0.0, 0.0), 0.05)
    assert ObstacleMap.of(Environment([]), grid).edge(0.02, 0.02) <= -0.25
