"""Sec. IV-A: matching environments, literally and robustly."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from dollop import matching as module
from dollop.environment import Environment, corner_indices, integer_costs
from dollop.lab.drawn import random_layouts
from dollop.matching import match, second_best

seeds = st.integers(0, 2**32 - 1)
shifts = st.tuples(st.floats(-50, 50), st.floats(-50, 50))
methods = pytest.mark.parametrize("method", ["literal", "robust"])


def _scene(seed, objects=3, **properties):
    return random_layouts(objects, np.random.default_rng(seed), **properties)


def _moved(environment, shift):
    return Environment(environment.boxes + np.tile(shift, 2))


@settings(max_examples=8)
@given(seeds)
def test_eight_corners_are_matched_as_the_best_of_all_permutations(seed):
    """Literal: cost and margin equal those from the 40,320 permutations of eight corners, one by one."""
    before, after, _ = _scene(seed, objects=2)
    costs = integer_costs(before.corners, after.corners)
    table = np.array(list(permutations(range(8))))
    totals = np.sort(costs[np.arange(8), table].sum(axis=1))
    matching = match(before, after, method="literal")
    assert costs[np.arange(8), matching.indices].sum() == matching.cost == totals[0]
    assert matching.margin == totals[1] - totals[0]


def _cost_by_the_formula(x, y, pairs, left_out=3.0, moved=0.4, kappa=1.0, turned=4.0, shifted=6.0):
    """Robust cost of matched pairs as the module states it, the turn found by trying angles."""
    price = (left_out / moved) ** 2 / 4 * (len(x) + len(y) - 2 * len(pairs))
    rows, columns = np.array(pairs, dtype=int).reshape(-1, 2).T
    z, w = x[rows], y[columns]
    shift = abs(w.mean() - z.mean()) if pairs else 0.0
    z, w = (z - z.mean(), w - w.mean()) if pairs else (z, w)
    angles = np.linspace(-np.pi, np.pi, 20001)
    misfit = (np.abs(w - np.exp(1j * angles)[:, None] * z) ** 2).sum(axis=1) / (2 * moved**2)
    still = (np.abs(w - z) ** 2).sum() / (2 * moved**2)
    turn = (misfit + kappa * (1 - np.cos(angles))).min() + turned
    stay = len(pairs) * shift**2 / (2 * moved**2)
    nothing = np.log1p(np.exp(-turned)) + np.log1p(np.exp(-shifted))
    return -np.logaddexp(-still, -turn) - np.logaddexp(-stay, -shifted) + price + nothing


@settings(max_examples=10)
@given(seeds, st.sampled_from(["none", "missing", "added"]))
def test_the_robust_matching_is_the_best_of_all_partial_ones(seed, change):
    """Robust: cost and margin equal those of the formula tried on every partial matching of three objects."""
    before, after, _ = _scene(seed, change=change)
    x, y = before.centres @ (1, 1j), after.centres @ (1, 1j)
    costs = sorted(
        _cost_by_the_formula(x, y, list(zip(rows, columns, strict=True)))
        for k in range(min(len(x), len(y)) + 1)
        for rows in {tuple(sorted(p[:k])) for p in permutations(range(len(x)))}
        for columns in permutations(range(len(y)), k)
    )
    matching = match(before, after)
    assert matching.cost == pytest.approx(costs[0], abs=1e-3)
    assert matching.margin == pytest.approx(costs[1] - costs[0], abs=1e-3)


@methods
@settings(max_examples=30)
@given(seeds, shifts)
def test_translation_changes_nothing(method, seed, shift):
    """One environment may lie elsewhere: the same corners are matched, at the cost of the shift, at most 6 nats."""
    before, after, _ = _scene(seed)
    one, other = match(before, after, method=method), match(before, _moved(after, shift), method=method)
    if one.margin > 1e-6:
        np.testing.assert_array_equal(other.indices, one.indices)
    if method == "literal":
        assert (other.cost, other.margin) == (one.cost, one.margin)
    else:
        assert abs(other.cost - one.cost) <= 6 + 1e-6


@settings(max_examples=30)
@given(seeds, shifts)
def test_another_origin_changes_nothing_where_an_object_is_missing(seed, shift):
    """Robust, a can missing: environments that lie elsewhere together match the same."""
    before, after, _ = _scene(seed, change="missing")
    one, other = match(before, after), match(_moved(before, shift), _moved(after, shift))
    if one.margin > 1e-6:
        np.testing.assert_array_equal(other.indices, one.indices)


@methods
@settings(max_examples=30)
@given(seeds, st.permutations(range(3)), st.permutations(range(3)))
def test_the_order_of_the_objects_changes_nothing(method, seed, order_i, order_j):
    """Objects in another order: the same corners are matched, only their numbers are others."""
    before, after, _ = _scene(seed)
    one = match(before, after, method=method)
    other = match(Environment(before.boxes[order_i]), Environment(after.boxes[order_j]), method=method)
    assert other.cost == pytest.approx(one.cost)
    if one.margin > 1e-6:
        corners_i, corners_j = (4 * np.array(order)[:, None] + np.arange(4) for order in (order_i, order_j))
        np.testing.assert_array_equal(corners_j.ravel()[other.indices], one.indices[corners_i.ravel()])


@settings(max_examples=30)
@given(seeds, st.sampled_from(["none", "missing", "added"]))
def test_matching_back_is_the_inverse(seed, change):
    """Robust: from j to i the same pairs are found as from i to j, at the same cost and margin."""
    before, after, _ = _scene(seed, change=change)
    there, back = match(before, after), match(after, before)
    assert back.cost == pytest.approx(there.cost)
    assert back.margin == pytest.approx(there.margin, abs=1e-9)
    if there.margin > 1e-6:
        matched = there.indices >= 0
        np.testing.assert_array_equal(back.indices[there.indices[matched]], np.flatnonzero(matched))


@pytest.mark.parametrize("quarters", [0, 1, -1])
def test_the_turn_is_found(quarters):
    """An uneven layout of four boxes turned by right angles: the turn is told, corner by corner."""
    boxes = np.array([[0, 0, 0.4, 0.6], [3, 0, 3.4, 0.4], [0.5, 4, 1, 4.4], [6, 2, 6.3, 2.4]])
    before = Environment(boxes)
    turned = (before.corners @ (1, 1j)) * 1j**quarters
    x, y = turned.real.reshape(-1, 4), turned.imag.reshape(-1, 4)
    after = Environment(np.stack([x.min(1), y.min(1), x.max(1), y.max(1)], axis=1))
    matching = match(before, after)
    np.testing.assert_array_equal(matching.indices, corner_indices(np.arange(4), quarters * np.pi / 2))
    np.testing.assert_allclose(after.corners[matching.indices] @ (1, 1j), turned, atol=1e-12)
    assert matching.turn == pytest.approx(quarters * np.pi / 2, abs=0.05)


def test_two_boxes_turned_by_a_right_angle_are_a_tie():
    """Nobody can say which is which: the margin is 0 and the matching not confident."""
    before = Environment([[-2.2, -0.2, -1.8, 0.2], [1.8, -0.2, 2.2, 0.2]])
    after = Environment([[-0.2, -2.2, 0.2, -1.8], [-0.2, 1.8, 0.2, 2.2]])
    matching = match(before, after)
    assert matching.margin == pytest.approx(0, abs=1e-9)
    assert not matching.confident


def test_nothing_moved_costs_nothing():
    """The same environment twice, either method: cost 0, confident, every corner itself."""
    environment, _, _ = _scene(1)
    for method in ("literal", "robust"):
        matching = match(environment, environment, method=method)
        assert matching.cost == pytest.approx(0, abs=1e-12)
        assert matching.confident
        np.testing.assert_array_equal(matching.indices, np.arange(12))


def test_a_split_object_leaves_one_piece_out():
    """One of three boxes seen as two halves: the others are matched, and one half is nobody's partner."""
    boxes = np.array([[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4], [1, 4, 1.4, 4.4]])
    halves = np.vstack([boxes[:2], [1, 4, 1.15, 4.4], [1.25, 4, 1.4, 4.4]])
    matching = match(Environment(boxes), Environment(halves))
    np.testing.assert_array_equal(matching.indices[:8], np.arange(8))
    assert matching.indices[8] // 4 in (2, 3)


def test_leaving_out_has_a_price():
    """One of three boxes far away: matched while leaving out costs 30 m, left out where it costs 1 m."""
    boxes = np.array([[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4], [1, 4, 1.4, 4.4]])
    before, after = Environment(boxes), Environment(boxes + [[0], [0], [6.0]])
    assert (match(before, after, left_out=30.0).indices >= 0).all()
    assert (match(before, after, left_out=1.0).indices[8:] == -1).all()


@pytest.mark.parametrize("change", ["none", "missing", "added"])
def test_many_objects_are_searched_as_well_as_they_are_enumerated(change, monkeypatch):
    """Four objects or five, the limit of the table set to 0: the search finds what enumeration finds."""
    scenes = [_scene(seed, objects=4, change=change) for seed in range(40)]
    enumerated = [match(before, after) for before, after, _ in scenes]
    monkeypatch.setattr(module, "_ENUMERATED", 0)
    searched = [match(before, after) for before, after, _ in scenes]
    same = [(a.indices == b.indices).all() for a, b in zip(enumerated, searched, strict=True)]
    assert np.mean(same) >= 0.95
    assert all(b.cost >= a.cost - 1e-9 for a, b in zip(enumerated, searched, strict=True))


def test_thirty_objects_some_gone_are_matched():
    """Of 30 boxes on a loose grid three are gone and all have moved and shifted: the rest finds its partners."""
    rng = np.random.default_rng(3)
    centres = 2.0 * np.stack(np.divmod(np.arange(30), 6), axis=1) + rng.uniform(-0.7, 0.7, (30, 2))
    order = rng.permutation(30)[3:]
    new = centres[order] + rng.normal(0, 0.1, (27, 2)) + [15.0, -4.0]
    partners = np.full(30, -1)
    partners[order] = np.arange(27)
    before, after = (Environment(np.hstack([c - 0.2, c + 0.2])) for c in (centres, new))
    np.testing.assert_array_equal(match(before, after).indices, corner_indices(partners))


@pytest.mark.parametrize("size", [2, 3, 5, 6])
def test_second_best_equals_all_permutations(size):
    """The margin equals the gap between best and second best of all permutations, ties included."""
    rng = np.random.default_rng(size)
    table = np.array(list(permutations(range(size))))
    for _ in range(60):
        costs = rng.integers(0, 8, (size, size))
        totals = np.sort(costs[np.arange(size), table].sum(axis=1))
        assert second_best(costs, linear_sum_assignment(costs)[1]) == totals[1] - totals[0]


def test_second_best_of_many_equals_forbidding_each_pair():
    """Forty by forty, where another way is taken: the margin equals the best with one of the pairs forbidden."""
    rng = np.random.default_rng(5)
    for top in (20, 1000, 10**6):
        costs = rng.integers(0, top, (40, 40)).astype(float)
        rows, columns = linear_sum_assignment(costs)
        others = []
        for row in range(40):
            forbidden = costs.copy()
            forbidden[row, columns[row]] = 1e9
            others.append(forbidden[linear_sum_assignment(forbidden)].sum())
        assert second_best(costs, columns) == pytest.approx(min(others) - costs[rows, columns].sum())


def test_second_best_with_some_left_out_equals_all_partial_matchings():
    """Where rows and columns may be left out at a price, every partial matching is the oracle."""
    rng = np.random.default_rng(6)
    for _ in range(40):
        costs, price = rng.uniform(0, 4, (3, 4)), rng.uniform(0.5, 2)
        table = module._all_partial(3, 4)
        pairs = np.where(table >= 0, costs[np.arange(3), table] - 2 * price, 0).sum(axis=1)
        best, second = np.argsort(pairs)[:2]
        assert second_best(costs, table[best], price) == pytest.approx(pairs[second] - pairs[best])


def test_bad_input_is_refused():
    """No object, one object, different counts or coinciding corners (literal), unknown method, free leaving out."""
    none, one, two = Environment([]), Environment([[0, 0, 1, 1]]), Environment([[0, 0, 1, 1], [3, 0, 4, 1]])
    three, touching = Environment([*two.boxes, [6, 6, 7, 7]]), Environment([[0, 0, 1, 1], [1, 0, 2, 1]])
    for few in (none, one):
        for method in ("literal", "robust"):
            with pytest.raises(ValueError, match=f"at least 2 objects, got {len(few)} and 2"):
                match(few, two, method=method)
    with pytest.raises(ValueError, match="same number of objects, got 2 and 3"):
        match(two, three, method="literal")
    with pytest.raises(ValueError, match="must not coincide"):
        match(two, touching, method="literal")
    with pytest.raises(ValueError, match="method must be .* got 'hungarian'"):
        match(two, two, method="hungarian")
    with pytest.raises(ValueError, match="left_out must be positive and finite, got 0"):
        match(two, three, left_out=0)


def test_moves_are_judged_by_their_usual_size():
    """Layouts, moves and all twice as large cost the same if objects usually move twice as far."""
    rng = np.random.default_rng(5)
    before, after, _ = random_layouts(3, rng)
    twice = [Environment(2 * each.boxes) for each in (before, after)]
    one, two = match(before, after, moved=0.4), match(*twice, left_out=6.0, moved=0.8)
    assert (one.indices == two.indices).all()
    np.testing.assert_allclose([two.cost, two.margin, two.turn], [one.cost, one.margin, one.turn])
    with pytest.raises(ValueError, match="moved must be positive and finite, got -1"):
        match(before, after, moved=-1)
