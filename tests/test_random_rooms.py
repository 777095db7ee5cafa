"""The oracle that judges robots in random rooms, against what can be seen by eye and by brute force."""

import sys

import numpy as np
import pytest
from places import ROOT

sys.path.insert(0, str(ROOT))
driving = pytest.importorskip("benchmarks.driving", reason="the benchmarks are not there")
furnished = pytest.importorskip("benchmarks.furnished", reason="the benchmarks are not there")

import dollop  # noqa: E402

FRAME = (0.0, 0.0, 4.0, 3.0)


def cells_of(*boxes):
    """Occupied cells (60, 80) of 5 cm of boxes in m, inside a wall of one cell."""
    cells = np.zeros((60, 80), bool)
    cells[[0, -1]], cells[:, [0, -1]] = True, True
    for left, low, right, high in boxes:
        cells[round(low / 0.05) : round(high / 0.05), round(left / 0.05) : round(right / 0.05)] = True
    return cells


def doorway(width):
    """A room of 4 m by 3 m with a wall across and a door of a width in m, a multiple of 5 cm."""
    return furnished.Truth([], cells_of((2.0, 0.0, 2.1, 1.5), (2.0, 1.5 + width, 2.1, 3.0)), FRAME)


def test_distances_are_those_to_squares_and_boxes():
    """From places anywhere, the distance is the least of those to every occupied cell and box, one by one."""
    rng = np.random.default_rng(0)
    cells = cells_of() | (rng.random((60, 80)) < 0.01)
    boxes = np.array([[1.013, 1.027, 1.511, 1.333], [2.2, 0.4, 2.21, 2.9]])
    truth = furnished.Truth(boxes, cells, FRAME)
    row, column = np.nonzero(cells)
    squares = 0.05 * np.column_stack([column, row, column + 1, row + 1])
    places = rng.uniform([0.05, 0.05], [3.95, 2.95], (300, 2))
    expected = furnished.distance_to_boxes(places, np.vstack([boxes, squares]))
    np.testing.assert_allclose(truth.distance(places), expected, atol=1e-9)
    x, y = truth.points
    some = rng.integers(0, (len(y), len(x)), (300, 2))
    there = np.column_stack([x[some[:, 1]], y[some[:, 0]]])
    expected = furnished.distance_to_boxes(there, np.vstack([boxes, squares]))
    np.testing.assert_allclose(truth.clear[tuple(some.T)], expected, atol=1e-9)


def test_off_the_map_is_in_a_wall():
    """Nobody is clear of anything where the map ends."""
    assert (doorway(0.5).distance([[-0.1, 1.0], [4.2, 1.0], [1.0, 3.5]]) == 0).all()


@pytest.mark.parametrize(("width", "radius", "through"), [(0.5, 0.24, True), (0.5, 0.26, False), (0.9, 0.40, True)])
def test_a_door_lets_through_who_is_narrower(width, radius, through):
    """One part of the floor where twice the radius fits into the door, two where it does not."""
    truth = doorway(width)
    parts = truth.parts(radius)
    left, right = (truth.part_at(parts, place) for place in ((1.0, 1.5), (3.0, 1.5)))
    assert left and right and bool(left & right) == through


def crossing(width, radius, kidnap=()):
    """A run from one side of a door to the other, its task and its truth."""
    truth, walk = doorway(width), np.linspace([1.0, 1.5 + width / 2], [3.0, 1.5 + width / 2], 60)
    task = dollop.learn([dollop.Demonstration(walk, dollop.Environment([[0.5, 0.4, 0.7, 0.6]]))])
    background = dollop.OccupancyGrid(truth.cells.astype(float), (0.0, 0.0), 0.05)
    robot = driving.Recorded((*walk[0], 0.0), radius=radius)
    return dollop.perform(task, robot, background=background, kidnap=kidnap), task, truth


def test_what_finished_was_at_every_subgoal():
    """A run through a wide door misses nothing; cut off before the end, or judged by another way, it does."""
    run, task, _ = crossing(0.9, 0.18)
    assert run.finished and not driving.missed(run, task)
    far = [[0.3, 2.7], *task.law.subgoals[:-1], task.law.subgoals[-1] + [0.0, 1.0]]
    another = type("Another", (), {"ways": (type("Law", (), {"subgoals": np.array(far)}),)})
    assert driving.missed(run, another).startswith("subgoal 0 missed by")


def test_a_loop_of_its_own_asks_for_the_same():
    """The commands of `perform` are those of `Controller.step`, with a kidnapping, to the last digit."""
    kidnap, places = [(2.0, (0.6, 2.0, 1.0))], [(0.6, 2.0)]
    run, task, truth = crossing(0.9, 0.18, kidnap)
    robots = [driving.Recorded((1.0, 1.95, 0.0), radius=0.18) for _ in range(2)]
    background = dollop.OccupancyGrid(truth.cells.astype(float), (0.0, 0.0), 0.05)
    dollop.perform(task, robots[0], background=background, kidnap=kidnap)
    found = driving.stepped(task, robots[1], "pursuit", background, kidnap, robots[0].commands)
    assert found["same"] and found["within_limits"] and len(run.kidnapped) == len(places)
    assert not driving.stepped(task, driving.Recorded((1.0, 1.9, 0.0)), "pursuit", background, [], [])["same"]


@pytest.mark.parametrize("seed", [0, 1, 5, 16])
def test_rooms_are_walked_through_by_a_person(seed):
    """A seed is a room; whoever showed the task was nowhere nearer to anything than a person is wide, to 3 cm."""
    room, again = furnished.drawn(seed), furnished.drawn(seed)
    assert np.array_equal(room.moved.boxes, again.moved.boxes)
    for each in room.shown:
        walks = each.walks
        assert all(room.before.distance(walk).min() > furnished.PERSON - 0.03 for walk in walks)
        assert all(np.hypot(*np.diff(walk, axis=0).T).max() < 0.2 for walk in walks)


def test_a_row_tells_what_came_of_it():
    """Of a room with a way: finished, not touched, the clearance told within a cell, and no failure."""
    (row,) = driving.rows_of(5, [0.18], steps=True)
    assert row["outcome"] == "finished" and row["margin"] >= 0.05 and not row["touched"] and row["same"]
    assert row["told_error"] < 0.05 and not driving.is_failure(row)
    assert driving.is_failure(row | {"touched": True}) and driving.is_failure(row | {"outcome": "not finished"})
