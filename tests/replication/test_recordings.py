"""The replication's experiments: how they judge their own runs."""

import numpy as np
import pytest

from dollop.replication import recordings


def test_sides_are_told_by_the_way_walked():
    """A cone to the right of the way counts +1, one to the left -1; the way back turns both."""
    path = np.column_stack([np.linspace(0, 10, 101), np.zeros(101)])
    cones = np.array([[3.0, -0.7], [6.0, 0.7]])
    assert recordings.passing_sides(path, cones).tolist() == [1, -1]
    assert recordings.passing_sides(path[::-1], cones).tolist() == [-1, 1]


def test_starts_lie_round_the_beginning():
    """Starts scatter by 0.15 m and 20 degrees round the law's start, heading along it."""
    pytest.importorskip("pybullet")
    task = recordings.figure_eight_task()
    starts = recordings.starts_near_the_beginning(task, 500, np.random.default_rng(0))
    np.testing.assert_allclose(starts[:, :2].mean(axis=0), task.law.start, atol=0.03)
    np.testing.assert_allclose(starts.std(axis=0), [0.15, 0.15, np.radians(20)], rtol=0.15)


def test_the_laser_sees_boxes_that_only_the_robust_method_matches():
    """Boxes as the laser sees them: the robust matching right in nearly all layouts, the literal one in few."""
    pytest.importorskip("pybullet")
    shares = recordings.matchings_from_laser("cans", count=15)
    assert shares["robust"] >= 0.9 and shares["literal"] <= 0.6
