"""The replication's experiments: how they judge their own runs."""

from itertools import pairwise

import numpy as np
import pytest
from places import ROOT

import dollop
from dollop.replication import recordings


def test_sides_are_told_by_the_way_walked():
    """A cone to the right of the way counts +1, one to the left -1; the way back turns both."""
    path = np.column_stack([np.linspace(0, 10, 101), np.zeros(101)])
    cones = np.array([[3.0, -0.7], [6.0, 0.7]])
    assert recordings.passing_sides(path, cones).tolist() == [1, -1]
    assert recordings.passing_sides(path[::-1], cones).tolist() == [-1, 1]


@pytest.mark.parametrize("turn", [0, 30, 90, -120, 170])
def test_a_corner_is_the_angle_between_the_ways_to_and_from_a_subgoal(turn):
    """Of two straight segments it is the turn between them, but for the last centimetre."""
    away = 2 * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    ways = np.linspace([0.0, 0.0], [2.0, 0.0], 40), [2.0, 0.0] + np.linspace([0.0, 0.0], away, 40)
    shown = {"corners": np.array([True, False])}
    law = dollop.SequencedLDS(tuple(dollop.LDS.fit(way) for way in ways), ways[0][0], np.ones(2), **shown)
    assert np.degrees(recordings.largest_corner(law)) == pytest.approx(abs(turn), abs=1.0)


def test_the_largest_of_the_corners_counts_and_one_segment_has_none():
    """A square walked round: three corners of 90 degrees, of which one is flattened to 45."""
    corners = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [-1, 1]], float)
    ways = [np.linspace(*ends, 40) for ends in pairwise(corners)]
    shown = {"corners": np.ones(4, bool)}
    law = dollop.SequencedLDS(tuple(dollop.LDS.fit(way) for way in ways), corners[0], np.ones(4), **shown)
    assert np.degrees(recordings.largest_corner(law)) == pytest.approx(90, abs=1.0)
    one = dollop.SequencedLDS(law.segments[:1], corners[0], np.ones(1))
    assert recordings.largest_corner(one) == 0


def test_the_data_are_what_save_all_writes(tmp_path):
    """Made anew from the seed, every recording is the committed one, to the last digit kept."""
    pytest.importorskip("pybullet")
    folders = tmp_path / "made", ROOT / "data"
    names = recordings.save_all(folders[0])
    made, kept = ({path.name for path in folder.iterdir()} for folder in folders)
    assert made == kept - {"README.md", "runs"}  # kept runs are made with the figures
    for name in set(names) - {"lab"}:
        made, kept = (dollop.read_log(folder / f"{name}.log.gz") for folder in folders)
        np.testing.assert_allclose(made.ranges, kept.ranges, atol=0.0011)
        np.testing.assert_allclose(made.poses, kept.poses, atol=2e-6)
    made, kept = (dollop.OccupancyGrid.load(folder / "lab.yaml") for folder in folders)
    assert (made.occupied == kept.occupied).mean() > 0.999


def test_starts_lie_round_the_beginning():
    """Starts scatter by 0.15 m and 20 degrees round the law's start, heading along it."""
    pytest.importorskip("pybullet")
    task = recordings.figure_eights().task
    starts = recordings.starts_near_the_beginning(task, 500, np.random.default_rng(0))
    np.testing.assert_allclose(starts[:, :2].mean(axis=0), task.law.start, atol=0.03)
    np.testing.assert_allclose(starts.std(axis=0), [0.15, 0.15, np.radians(20)], rtol=0.15)


def test_the_laser_sees_boxes_that_only_the_robust_method_matches():
    """As the laser sees them: robust is right in nearly all layouts, literal in few."""
    pytest.importorskip("pybullet")
    shares = recordings.matchings_from_laser("cans", count=15)
    assert shares["robust"] >= 0.9 and shares["literal"] <= 0.6
