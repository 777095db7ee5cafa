"""The claim on structure: what is told of walks whose true subgoals nobody knows."""

import numpy as np
import pytest

from dollop.replication.claims.structure import typical

WALKS = [np.array([[0.0, 0], [1, 0], [2, 0]]), np.array([[0.0, 0.1], [1, 0.1], [2, 0.1], [3, 0.1]])]


def test_typical_is_the_median_number_and_distances_are_those_to_the_nearest():
    """Between two lengths either is typical."""
    assert typical(WALKS[0], WALKS) == (1.0, pytest.approx(0.05))
    assert typical(WALKS[1], WALKS)[0] == 1.0
    assert typical(WALKS[0][:2], WALKS)[0] == 0.0
    number, off = typical(np.zeros((0, 2)), WALKS)
    assert number == 0.0 and np.isnan(off)
