"""Measures of runs: how far from the law, when back on it, and starts anywhere that is free."""

from types import SimpleNamespace

import numpy as np
import pytest
from rooms import figure_eight_task, room_map

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.replication import runs
from dollop.replication.runs import distances_to_law, free_poses, return_times
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.performing import Unicycle, perform

START = (4.5, 3.6, -0.7)


@pytest.fixture(scope="module")
def task():
    return figure_eight_task()


def test_return_times(task):
    """Until the robot keeps to its response again: at once where it would be anyway, else later."""
    undisturbed = perform(task, Unicycle(START))
    places = undisturbed.poses[80], (4.5, 5.8, 0.0)
    runs = [perform(task, Unicycle(START), kidnap=[(8.0, place)]) for place in places]
    assert return_times(runs[0], task.law) == pytest.approx([0.0], abs=1e-9)
    assert 0.5 < return_times(runs[1], task.law)[0] < 20
    assert runs[0].kidnapped == pytest.approx([8.0])


def test_return_times_by_hand(task):
    """Back after 1 s; kidnapped before; back after 2 s, half of one not counting; ended before."""
    response, t = task.law.response(), np.arange(110) / 10
    across = (response[41] - response[39]) @ [[0, 1], [-1, 0]]
    beside = response[40] + 0.15 * across / np.hypot(*across)
    places = np.tile(response[40], (110, 1))
    places[0] = task.law.start
    places[(t >= 2) & (t < 3) | (t >= 4) & (t < 6) | (t >= 10) & (t < 10.5)] += [0.0, 5.0]
    places[(t >= 6) & (t < 7) | (t >= 7.5) & (t < 8)] = beside
    kidnapped = np.array([2.0, 4.0, 6.0, 10.0])
    run = SimpleNamespace(true_poses=np.c_[places, 0 * t], t=t, kidnapped=kidnapped)
    np.testing.assert_allclose(return_times(run, task.law), [1.0, np.inf, 2.0, np.inf])


def test_crossing_the_response_is_not_coming_back(task):
    """A robot put across its response leaves it at once, and is not back yet."""
    response = task.law.response(START[:2])
    run = perform(task, Unicycle(START), kidnap=[(8.0, (*response[len(response) // 2], 0.0))])
    (time,) = return_times(run, task.law)
    assert distances_to_law(run, task.law)[80] < 0.01
    assert 2 < time < 20


def test_each_control_is_measured_by_the_response_that_it_follows(task):
    """A plain run started beside the law keeps to every LDS alone, one that comes back to what was shown."""
    start = (4.5, 4.0, -0.7)
    plain = perform(task, Unicycle(start), control="plain", avoid=False)
    own = perform(task, Unicycle(start))
    for run, mine, other in ((plain, "paper", "held"), (own, "held", "paper")):
        away = [distances_to_law(run, task.law, method).mean() for method in (mine, other)]
        assert away[0] < away[1]
    assert (distances_to_law(own, task.law) == distances_to_law(own, task.law, "held")).all()


def test_free_poses_are_free_and_everywhere(task):
    """They have the room asked for, lie wherever the robot can get, and head anywhere."""
    background = room_map()
    obstacles = ObstacleMap.of(task.environment, background)
    poses = free_poses(300, obstacles, task.law.subgoals[0], seed=0, room=0.3)
    assert obstacles.edges(poses[:, :2]).min() > 0.3 - 1e-6
    assert np.histogram(poses[:, 2], 4, (-np.pi, np.pi))[0].min() > 40
    assert np.ptp(poses[:, 0]) > 6.5 and np.ptp(poses[:, 1]) > 4.5
    divided = ObstacleMap.of(Environment([[5.4, 0.0, 5.6, 7.0]]), background)
    assert free_poses(50, divided, (2.0, 2.0), seed=0)[:, 0].max() < 5.4


def test_a_run_without_a_kidnapping_has_no_time_of_return(task):
    """Nobody carried it off: there is nothing to come back from."""
    assert return_times(perform(task, Unicycle(START)), task.law).shape == (0,)


def test_where_there_is_no_room_no_pose_is_drawn(monkeypatch):
    """A map that is an obstacle all over has none, and nobody looks for ever."""
    monkeypatch.setattr(runs, "DRAWS", 50)
    full = ObstacleMap.of(Environment([]), OccupancyGrid(np.ones((20, 20)), (0.0, 0.0), 0.05))
    with pytest.raises(ValueError, match="must have room for a robot, got none in 50 draws"):
        free_poses(2, full, (0.5, 0.5), seed=0)
