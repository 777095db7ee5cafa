"""Sec. IV-A: matching environments, literally and robustly."""

from itertools import combinations, permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from dollop import matching as module
from dollop.environment import Environment, Seen, corner_indices, integer_costs
from dollop.lab.drawn import random_layouts
from dollop.matching import SURE, Matching, match, match_surely, second_best

seeds = st.integers(0, 2**32 - 1)
shifts = st.tuples(st.floats(-50, 50), st.floats(-50, 50))
methods = pytest.mark.parametrize("method", ["literal", "robust"])
NAMES = "the one", "the other"


def _scene(seed, objects=3, **properties):
    return random_layouts(objects, np.random.default_rng(seed), **properties)


def _moved(environment, shift):
    return Environment(environment.boxes + np.tile(shift, 2))


def _squares(places, side=0.4):
    places = np.asarray(places, dtype=float)
    return Environment(np.hstack([places - side / 2, places + side / 2]))


def _world(seed, n, moved=None, sizes=None, view=0.8):
    """Two looks at n things, moved (sd in m) or anywhere new, and which is which, -1 where out of view."""
    rng = np.random.default_rng(seed)
    before, after, partners = random_layouts(n, rng, moved=moved or 0.4, noise=0.0)
    places = before.centres, after.centres[partners] if moved else random_layouts(n, rng)[0].centres
    sizes = np.full((n, 2), 0.4) if sizes is None else sizes(rng, n)
    seen = [rng.permutation(np.flatnonzero(rng.random(n) < view)) for _ in range(2)]
    looks = []
    for centres, which in zip(places, seen, strict=True):
        sides = np.tile(sizes[which] / 2, 2) * [-1, -1, 1, 1] + rng.normal(0, 0.02, (len(which), 4))
        looks.append(Environment(np.tile(centres[which], 2) + sides))
    same = np.column_stack([seen[0][:, None] == seen[1], np.ones(len(seen[0]), bool)]).argmax(axis=1)
    return *looks, np.where(same < len(seen[1]), same, -1)


def _distinct(rng, n):
    """Sides (n, 2) in m, every two different by 0.3 m along one at least."""
    steps = rng.permutation([[0.2, 0.2], [0.5, 0.2], [0.2, 0.5], [0.8, 0.5], [0.5, 0.8]])[:n]
    return steps + rng.uniform(0, 0.1)


def _any_size(rng, n):
    return rng.uniform(0.2, 0.8, (n, 2))


def _all_partial(n, m):
    """Every way to match some of n with some of m, (P, n), -1 where left out."""
    found = []
    for k in range(min(n, m) + 1):
        for rows, columns in product(combinations(range(n), k), permutations(range(m), k)):
            found.append(np.full(n, -1))
            found[-1][list(rows)] = columns
    return np.array(found)


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


# ---- all matchings are summed


def _by_enumeration(cases):
    """All partial matchings, and their probabilities, one by one."""
    _, n, m = cases.ratios.shape
    table = _all_partial(n, m)
    weights = np.zeros(len(table))
    for row, partners in enumerate(table):
        for ratios, counts in zip(cases.ratios, cases.counts, strict=True):
            pairs = [(a, b) for a, b in enumerate(partners) if b >= 0]
            weights[row] += np.exp(counts[len(pairs)] + sum(ratios[pair] for pair in pairs))
    return table, weights


@settings(max_examples=15)
@given(seeds, st.integers(1, 4), st.integers(1, 4), st.integers(1, 3))
def test_sums_over_sets_equal_those_over_all_matchings(seed, n, m, cases):
    """Sum and marginals of any weights, numbers of pairs weighted too, equal those of every partial matching."""
    rng = np.random.default_rng(seed)
    cases = module._Cases(np.ones(cases), rng.normal(0, 2, (cases, min(n, m) + 1)), rng.normal(0, 3, (cases, n, m)))
    table, weights = _by_enumeration(cases)
    sums, marginals = module._summed(cases)
    assert np.exp(sums).sum() == pytest.approx(weights.sum())
    pairs = np.tensordot(np.exp(sums), marginals, axes=1) / weights.sum()
    for a, b in product(range(n), range(m)):
        assert pairs[a, b] == pytest.approx(weights[table[:, a] == b].sum() / weights.sum())


@settings(max_examples=20)
@given(seeds, st.sampled_from(["none", "missing", "added"]))
def test_the_matching_is_the_most_probable_of_all_partial_ones(seed, change):
    """Robust: partners, probability, margin and those of every pair equal what enumeration gives."""
    before, after, _ = _scene(seed, change=change)
    scene = module._Scene((before, after), 0.4)
    table, weights = _by_enumeration(module._that_count(module._cases(scene, *module._alignments(scene))))
    first, second = np.sort(weights)[::-1][:2]
    matching = match(before, after)
    assert matching.probability == pytest.approx(first / weights.sum())
    assert matching.cost == pytest.approx(-np.log(first / weights.sum()), abs=1e-9)
    assert matching.margin == pytest.approx(np.log(first / second), abs=1e-6)
    shares = [weights[table[:, 0] == b].sum() / weights.sum() for b in [*range(len(after)), -1]]
    np.testing.assert_allclose(matching.pair_probabilities[0], shares, atol=1e-9)
    if first > 1.01 * second:
        np.testing.assert_array_equal(matching.partners, table[weights.argmax()])


def test_beliefs_equal_the_exact_sums_where_few_hang_together():
    """As if twenty were many: marginals and sum of weights near a diagonal equal the exact ones."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        ratios = np.full((8, 8), -20.0)
        for start in range(0, 8, 2):
            ratios[start : start + 2, start : start + 2] = rng.normal(2, 2, (2, 2))
        sums, marginals = module._in_parts(np.exp(ratios))
        exact, shares = module._summed(module._Cases(np.ones(1), np.zeros((1, 9)), ratios[None]))
        assert sums == pytest.approx(exact[0], abs=0.05)
        np.testing.assert_allclose(marginals, shares[0], atol=0.02)


def test_what_is_told_with_a_probability_is_right_as_often():
    """Of pairs told with p in 320 scenes a share p is right, within 5 points and chance; of what is accepted 98 %."""
    told, right, wrong, accepted = [], [], 0, 0
    for seed, n, sizes in product(range(40), (2, 3, 5, 7), (None, _any_size)):
        before, after, partners = _world([seed, n], n, 0.2 + seed / 100, sizes)
        matching = match(before, after)
        told.append(matching.pair_probabilities.ravel())
        right.append((np.arange(len(after) + 1) == (partners % (len(after) + 1))[:, None]).ravel())
        accepted += matching.confident
        wrong += matching.confident and not np.array_equal(matching.partners, partners)
    told, right = np.concatenate(told), np.concatenate(right)
    for low, high in ((0, 0.1), (0.1, 0.5), (0.5, 0.9), (0.9, 1.01)):
        within = (told >= low) & (told < high)
        p, n = told[within].mean(), np.count_nonzero(within)
        assert abs(right[within].mean() - p) < 0.05 + 2 * np.sqrt(p * (1 - p) / n)
    assert accepted > 150 and wrong <= 0.02 * accepted + 2 * np.sqrt(0.02 * accepted)


def test_random_layouts_are_matched_by_size_or_not_at_all():
    """Nothing stands where it stood: boxes alike are refused; of distinct ones four in five are right, none wrong."""
    kinds = {None: [], _distinct: []}
    for sizes, seed, n in product(kinds, range(20), (2, 3, 4)):
        before, after, partners = _world([seed, n], n, None, sizes, view=1.0)
        matching = match(before, after)
        kinds[sizes].append((matching.confident, np.array_equal(matching.partners, partners)))
    alike, distinct = (np.array(each).T for each in kinds.values())
    assert (alike[0] & ~alike[1]).mean() <= 0.02
    assert (distinct[0] & ~distinct[1]).sum() == 0 and (distinct[0] & distinct[1]).mean() >= 0.8


# ---- what could be seen


def _hall(floor):
    return Seen(floor, (-2.0, -2.0), 0.1)


def test_what_was_not_seen_is_not_missing():
    """One box against another one 3 m off: one that was carried while both places are seen, two where they are not."""
    seen = np.ones((100, 100), bool)
    left, right = seen.copy(), seen.copy()
    left[:, 40:], right[:, :40] = False, False  # below and above x = 2 m
    boxes = [[0, 1, 0.4, 1.4]], [[3, 1, 3.4, 1.4]]
    one = match(*(Environment(each, _hall(seen)) for each in boxes))
    two = match(*(Environment(each, _hall(floor)) for each, floor in zip(boxes, (left, right), strict=True)))
    assert one.pair_probabilities[0, 0] > 0.9 > 0.5 > two.pair_probabilities[0, 0]
    assert two.partners.tolist() == [-1]


def test_one_against_one_is_not_always_the_same():
    """The farther and the less alike, the less probable; far and unlike it is another object."""
    before = Environment([[0, 0, 0.4, 0.4]])
    near, far, other = ([[0.2, 0, 0.6, 0.4]], [[4, 0, 4.4, 0.4]], [[4, 0, 4.8, 1.2]])
    shares = [match(before, Environment(after)).pair_probabilities[0, 0] for after in (near, far, other)]
    assert shares[0] > SURE > shares[1] > shares[2]
    assert match(before, Environment(other)).partners.tolist() == [-1]


def test_a_side_that_no_beam_has_reached_tells_nothing():
    """A box of twice the depth, as assumed: the same one; as measured: hardly."""
    before = Environment([[0, 0, 0.4, 0.4]])
    measured = Environment([[0, 0, 0.4, 0.9]])
    assumed = Environment(measured.boxes, assumed=[[False, False, False, True]])
    assert match(before, assumed).probability > match(before, measured).pair_probabilities[0, 0]
    assert match(before, assumed).confident


def test_an_environment_may_not_have_seen_its_own_objects():
    """A floor that leaves out what stands on it, or all: whatever was found has been seen, and nothing breaks."""
    boxes = [[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4]]
    blind = Environment(boxes, _hall(np.zeros((100, 100), bool)))
    away = Environment(boxes, Seen(np.ones((5, 5), bool), (90.0, 90.0), 0.1))
    for one, other in product((blind, away, Environment(boxes)), repeat=2):
        matching = match(one, other)
        assert matching.partners.tolist() == [0, 1] and 0 < matching.probability <= 1


@pytest.mark.parametrize("n", [0, 2])
def test_with_nothing_everything_has_gone(n):
    """No object on a side: all are left out, beyond doubt."""
    some, none = Environment(_squares([[0, 0], [3, 1]][:n]).boxes if n else []), Environment([])
    matching = match(some, none)
    assert matching.partners.tolist() == [-1] * n and matching.sure.all()
    assert matching.confident and matching.probability == 1
    assert match(none, some).indices.tolist() == []


# ---- symmetries


@methods
@settings(max_examples=30)
@given(seeds, shifts)
def test_translation_changes_nothing(method, seed, shift):
    """One environment may lie elsewhere: where either matching is confident the same corners are matched."""
    before, after, _ = _scene(seed)
    one, other = match(before, after, method=method), match(before, _moved(after, shift), method=method)
    if one.confident and other.confident:
        np.testing.assert_array_equal(other.indices, one.indices)
    if method == "literal":
        assert (other.cost, other.margin) == (one.cost, one.margin)


@settings(max_examples=30)
@given(seeds, shifts)
def test_another_origin_changes_nothing(seed, shift):
    """Robust, a can missing: environments that lie elsewhere together match the same, as probably."""
    before, after, _ = _scene(seed, change="missing")
    one, other = match(before, after), match(_moved(before, shift), _moved(after, shift))
    assert other.probability == pytest.approx(one.probability, abs=1e-3)
    if one.margin > 1e-3:
        np.testing.assert_array_equal(other.indices, one.indices)


@methods
@settings(max_examples=30)
@given(seeds, st.permutations(range(3)), st.permutations(range(3)))
def test_the_order_of_the_objects_changes_nothing(method, seed, order_i, order_j):
    """Objects in another order: the same corners are matched, only their numbers are others."""
    before, after, _ = _scene(seed)
    one = match(before, after, method=method)
    other = match(Environment(before.boxes[order_i]), Environment(after.boxes[order_j]), method=method)
    assert other.cost == pytest.approx(one.cost, abs=1e-3)
    if one.margin > 1e-3:
        corners_i, corners_j = (4 * np.array(order)[:, None] + np.arange(4) for order in (order_i, order_j))
        np.testing.assert_array_equal(corners_j.ravel()[other.indices], one.indices[corners_i.ravel()])


@settings(max_examples=30)
@given(seeds, st.sampled_from(["none", "missing", "added"]))
def test_matching_back_is_the_inverse(seed, change):
    """Robust: where it is sure, from j to i the same pairs are found as from i to j."""
    before, after, _ = _scene(seed, change=change)
    there, back = match(before, after), match(after, before)
    assert back.probability == pytest.approx(there.probability, abs=0.05)
    if there.margin > 0.5:
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
    """Nobody can say which is which: the margin is 0, the matching not confident, and nothing sure of either."""
    before, after = _squares([[-2, 0], [2, 0]]), _squares([[0, -2], [0, 2]])
    matching = match(before, after)
    assert matching.margin == pytest.approx(0, abs=0.05)
    assert not matching.confident and not matching.sure.any()
    with pytest.raises(ValueError, match=r"the one and the other cannot .* (49|50) %.*95 % .*matching=.*matchings="):
        match_surely(before, after, NAMES)


def test_a_turn_that_always_fits_is_no_evidence():
    """Two boxes as far apart as before but elsewhere and turned: some turn fits any two, so nothing is sure."""
    before, after = _squares([[0, 0], [3, 0]]), _squares([[7, 4], [9.1, 6.1]])
    assert not match(before, after).sure.any()


# ---- one by one


def test_nothing_moved_costs_nothing():
    """The same environment twice, either method: cost 0, confident, every corner itself."""
    environment, _, _ = _scene(1)
    for method in ("literal", "robust"):
        matching = match(environment, environment, method=method)
        assert matching.cost == pytest.approx(0, abs=0.01)
        assert matching.confident
        np.testing.assert_array_equal(matching.indices, np.arange(12))


def test_a_split_object_leaves_one_piece_out():
    """One of three boxes seen as two halves: the others are matched, and of the halves one at most."""
    boxes = np.array([[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4], [1, 4, 1.4, 4.4]])
    halves = np.vstack([boxes[:2], [1, 4, 1.15, 4.4], [1.25, 4, 1.4, 4.4]])
    matching = match(Environment(boxes), Environment(halves))
    np.testing.assert_array_equal(matching.indices[:8], np.arange(8))
    assert matching.partners[2] in (-1, 2, 3) and not matching.sure[2]


def test_moves_are_judged_by_their_usual_size():
    """A box that moved by 1.2 m is the more surely the same one, the farther things are usually moved."""
    before, after = _squares([[0, 0], [3, 1]]), _squares([[0, 1.2], [3, 1.1]])
    shares = [match(before, after, moved=moved).pair_probabilities[0, 0] for moved in (0.2, 0.4, 0.8)]
    assert shares == sorted(shares)
    with pytest.raises(ValueError, match="moved must be in 0.001 to 1000, got -1"):
        match(before, after, moved=-1)


def test_what_is_sure_is_used_and_what_is_not_is_named():
    """Two alike change places or not, nobody knows; the third one stands: it alone is used, and a note tells why."""
    before, after = _squares([[0, 0], [0.9, 0], [5, 4]]), _squares([[0.45, 0.45], [0.45, -0.45], [5, 4.1]])
    matching, (note,) = match_surely(before, after, NAMES)
    assert matching.partners.tolist() == [-1, -1, 2] and not note.doubt
    assert note.kind == "matching" and "0 to " in note.text and "1 to " in note.text and "%" in note.text
    same, none = match_surely(before, before, NAMES)
    assert same.confident and none == () and same.partners.tolist() == [0, 1, 2]


def test_a_matching_can_be_given():
    """Partners and a turn are all it takes, beyond doubt; nonsense is refused."""
    given = Matching.of_partners([1, -1, 0], turn=np.pi / 2)
    np.testing.assert_array_equal(given.indices, corner_indices(np.array([1, -1, 0]), np.pi / 2))
    assert given.probability == 1 and given.sure.all() and given.pair_probabilities.shape == (3, 3)
    assert Matching.identity(2).partners.tolist() == [0, 1]
    assert "1 gone" in repr(given) and "100 %" in repr(given)
    for wrong in ([0, 0], [0.5], [-2]):
        with pytest.raises(ValueError, match="partners must be "):
            Matching.of_partners(wrong)


def test_a_matching_without_probabilities_is_as_sure_as_it_is_confident():
    """Literal, or made from four numbers as before there were probabilities: sure of all or of none."""
    environment, _, _ = _scene(1)
    literal = match(environment, environment, method="literal")
    assert np.isnan(literal.probability) and literal.sure.all()
    assert not Matching(np.arange(8), 0.0, 0.0, False).sure.any()


@pytest.mark.parametrize("change", ["none", "missing", "added"])
def test_many_objects_are_matched_as_by_all_matchings(change, monkeypatch):
    """Four objects or five, as if they were many: the same partners as by the exact sums."""
    scenes = [_scene(seed, objects=4, change=change) for seed in range(40)]
    exact = [match(before, after) for before, after, _ in scenes]
    monkeypatch.setattr(module, "_EXACT", 0)
    believed = [match(before, after) for before, after, _ in scenes]
    same = [np.array_equal(a.indices, b.indices) for a, b in zip(exact, believed, strict=True)]
    assert np.mean(same) >= 0.9


def test_thirty_objects_some_gone_are_matched():
    """Of 30 boxes on a loose grid three are gone and all have moved and shifted: the rest finds its partners."""
    rng = np.random.default_rng(3)
    centres = 2.0 * np.stack(np.divmod(np.arange(30), 6), axis=1) + rng.uniform(-0.7, 0.7, (30, 2))
    order = rng.permutation(30)[3:]
    new = centres[order] + rng.normal(0, 0.1, (27, 2)) + [15.0, -4.0]
    partners = np.full(30, -1)
    partners[order] = np.arange(27)
    np.testing.assert_array_equal(match(_squares(centres), _squares(new)).indices, corner_indices(partners))


# ---- the second best


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
        table = _all_partial(3, 4)
        pairs = np.where(table >= 0, costs[np.arange(3), table] - 2 * price, 0).sum(axis=1)
        best, second = np.argsort(pairs)[:2]
        assert second_best(costs, table[best], price) == pytest.approx(pairs[second] - pairs[best])


def test_bad_input_is_refused():
    """Literal: no object, one, different counts, coinciding corners. Both: an unknown method, moves of no size."""
    none, one, two = Environment([]), Environment([[0, 0, 1, 1]]), Environment([[0, 0, 1, 1], [3, 0, 4, 1]])
    three, touching = Environment([*two.boxes, [6, 6, 7, 7]]), Environment([[0, 0, 1, 1], [1, 0, 2, 1]])
    for few in (none, one):
        with pytest.raises(ValueError, match=f"at least 2 objects in each, got {len(few)} and 2"):
            match(few, two, method="literal")
    with pytest.raises(ValueError, match="same number of objects, got 2 and 3"):
        match(two, three, method="literal")
    with pytest.raises(ValueError, match="must not coincide"):
        match(two, touching, method="literal")
    with pytest.raises(ValueError, match="method must be .* got 'hungarian'"):
        match(two, two, method="hungarian")
    with pytest.raises(ValueError, match="moved must be in 0.001 to 1000, got 0"):
        match(two, three, moved=0)


@pytest.mark.parametrize("method", ["robust", "literal"])
def test_thousands_of_objects_are_refused(method):
    """A rule that is named, and no memory of gigabytes."""
    low = np.stack(np.meshgrid(np.arange(30), np.arange(30)), axis=-1).reshape(-1, 2)
    many = Environment(np.hstack([low, low + 0.5]))
    with pytest.raises(ValueError, match="must have at most 500 objects, got 900"):
        match(many, many, method=method)
