"""Laying walks onto a way: the cheapest monotone way through a matrix of costs, ends left out at a price."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dollop.learning.warping import warped

costs = st.tuples(st.integers(1, 4), st.integers(1, 4)).flatmap(
    lambda shape: arrays(float, shape, elements=st.floats(0, 8))
)


def cheapest(cost, skipped, beyond):
    """By trying every way: total cost of the best."""
    places, samples = cost.shape
    best = min(skipped * places + beyond * samples, np.inf)

    def go(place, sample, total):
        nonlocal best
        total += cost[place, sample]
        at_end = skipped * (places - 1 - place) if sample == samples - 1 else np.inf
        if place == places - 1:
            at_end = min(at_end, beyond * (samples - 1 - sample))
        best = min(best, total + at_end)
        for i, j in ((1, 0), (0, 1), (1, 1)):
            if place + i < places and sample + j < samples:
                go(place + i, sample + j, total)

    for place in range(places):
        go(place, 0, skipped * place)
    for sample in range(1, samples):
        go(0, sample, beyond * sample)
    return best


@settings(max_examples=60, deadline=None)
@given(costs)
def test_no_way_is_cheaper(cost):
    """Against all ways through small matrices."""
    at, covered, total, _ = warped(cost[None], 3.0, 8.0)
    assert total[0] == pytest.approx(cheapest(cost, 3.0, 8.0))
    assert at.shape == covered.shape == (1, len(cost))


def test_a_walk_that_ends_early_covers_no_more():
    """Of ten places a walk has the first six: the others are not covered, at the price of four."""
    line = np.arange(10.0)
    cost = np.minimum((line[:, None] - line[:6]) ** 2, 8.0) * 10
    at, covered, total, beyond = warped(cost[None], 3.0, 8.0)
    assert covered[0].tolist() == [True] * 6 + [False] * 4
    np.testing.assert_allclose(at[0, :6], np.arange(6))
    assert total[0] == pytest.approx(12.0) and beyond[0] == 0
