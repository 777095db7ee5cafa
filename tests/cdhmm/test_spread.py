"""Sec. V without a spread: known scatter recovered, and what must hold of any estimate."""

from itertools import combinations, permutations

import numpy as np
import pytest

from dollop.cdhmm import SubgoalHMM
from dollop.cdhmm.evidence import FIRST, chains_of, evidence_of
from dollop.cdhmm.spread import Expected, _mean_gains, by_content, estimate_spread, spaced
from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.replication.baseline import judge

SLALOM = np.array(TASKS["slalom"])


def shared_in_order(length, other):
    """Every way to send some subgoals of one demonstration to subgoals of another, in order."""
    for number in range(min(length, other) + 1):
        for chosen in combinations(range(length), number):
            for partners in combinations(range(other), number):
                yield list(chosen), list(partners)


@pytest.mark.parametrize("seed", range(6))
def test_the_gain_of_a_pair_is_that_of_the_best_alignment(seed):
    """For each spread no way to merge two demonstrations in order has more evidence, over leaving them apart."""
    random = np.random.default_rng(seed)
    lengths = random.integers(1, 5, 2)
    pair = [random.uniform(-0.6, 0.6, (length, 2)) for length in lengths]
    spreads = np.array([0.05, 0.15, 0.5])
    gains = _mean_gains(pair, spreads)
    for gain, spread in zip(gains, spreads, strict=True):
        chains = chains_of(pair, spread)
        apart, merged = np.arange(lengths.sum()) + FIRST, []
        for chosen, partners in shared_in_order(*lengths):
            labels = apart.copy()
            labels[lengths[0] + np.array(partners, int)] = labels[chosen]
            merged.append(evidence_of(np.unique(labels, return_inverse=True)[1] + FIRST, chains))
        assert gain == pytest.approx(max(merged) - evidence_of(apart, chains), abs=1e-9)


@pytest.mark.parametrize("spread", [0.04, 0.08, 0.15, 0.3, 0.5])
@pytest.mark.parametrize("task", TASKS)
def test_five_demonstrations_tell_their_spread(task, spread):
    """The estimate is right within a factor of two, odd subgoals or not."""
    for seed in range(20):
        told = estimate_spread(draw_demonstrations(TASKS[task], 5, spread, seed=seed))
        assert spread / 2 <= told <= spread * 2


def test_what_scatters_more_one_way_lies_in_between():
    """Subgoals that scatter by 0.4 m along and 0.07 m across are told to scatter by something in between."""
    random = np.random.default_rng(0)
    for _ in range(10):
        shown = [SLALOM + random.normal(0, (0.4, 0.07), SLALOM.shape) for _ in range(5)]
        assert 0.07 < estimate_spread(shown) < 0.4


@pytest.mark.parametrize(("spread", "share"), [(0.05, 0.95), (0.15, 0.95), (0.3, 0.85)])
def test_two_demonstrations_of_a_spread_that_nobody_names(spread, share):
    """The right subgoals in the right order, odd ones or not: in 95 % of cases, at 30 cm in 85 %."""
    right = []
    for task in TASKS:
        for seed in range(100, 120):
            model = SubgoalHMM.fit(draw_demonstrations(TASKS[task], 2, spread, seed=seed))
            right.append(judge(model.means[model.most_likely_path()], TASKS[task])["right_order"])
    assert np.mean(right) >= share


def test_what_says_nothing_leaves_the_usual():
    """One demonstration, or two with nothing in common, leave 0.15 m."""
    assert SubgoalHMM.fit([SLALOM]).spread == 0.15
    apart = SubgoalHMM.fit([SLALOM, SLALOM + (0, 20)])
    assert apart.spread == 0.15 and apart.outliers() == (1,)


def test_the_estimate_stays_within_what_is_expected():
    """Demonstrations without any scatter get the least spread, those that scatter by 2 m no more than the most."""
    expected = Expected()
    assert estimate_spread([SLALOM] * 3) == expected.least
    wide = draw_demonstrations(3 * SLALOM, 5, 2.0, extra=0, seed=0)
    assert expected.usual < estimate_spread(wide) <= expected.most


def test_an_estimated_spread_acts_as_a_named_one():
    """Fitting again with the spread that was estimated gives the same model; only one of them says it was estimated."""
    shown = draw_demonstrations(SLALOM, 4, 0.25, seed=3)
    estimated = SubgoalHMM.fit(shown)
    named = SubgoalHMM.fit(shown, estimated.spread)
    assert estimated.estimated and not named.estimated
    assert estimated.evidence == named.evidence
    assert all(map(np.array_equal, estimated.states, named.states))


def test_one_more_demonstration_tells_more_of_the_spread():
    """Adding estimates a spread anew that nobody named, and keeps one that was."""
    shown = draw_demonstrations(SLALOM, 3, 0.3, seed=1)
    assert SubgoalHMM.fit(shown[:2]).add(shown[2]).spread == SubgoalHMM.fit(shown).spread
    assert SubgoalHMM.fit(shown[:2], 0.2).add(shown[2]).spread == 0.2


@pytest.mark.parametrize("n", [3, 12])
def test_frame_and_unit_make_no_difference(n):
    """Turned, moved and scaled, what is expected too, the estimate is scaled; the order given makes no difference."""
    shown = draw_demonstrations(TASKS["ring"], n, 0.2, seed=4)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = [100 * each @ [[c, s], [-s, c]] + (40, -70) for each in shown]
    expected = Expected(usual=15.0, least=3.0, most=60.0)
    plain = estimate_spread(shown)
    assert estimate_spread(turned, expected) == pytest.approx(100 * plain)
    assert estimate_spread(shown[::-1]) == pytest.approx(plain)


def test_the_order_by_content_is_that_of_no_list():
    """However demonstrations are listed, they stand in the same order by content."""
    shown = draw_demonstrations(SLALOM, 4, 0.2, seed=0)
    first = [shown[k] for k in by_content(shown)]
    for order in permutations(range(4)):
        listed = [shown[k] for k in order]
        assert all(a is b for a, b in zip(first, [listed[k] for k in by_content(listed)], strict=True))


@pytest.mark.parametrize("total", [1, 2, 7, 100])
def test_a_cross_section_takes_from_everywhere(total):
    """Places are distinct and within range, no two gaps differ by more than one, and all are taken where few."""
    for number in (1, 2, 3, 8, 200):
        places = spaced(total, number)
        assert len(places) == min(number, total) and min(places) >= 0 and max(places) < total
        assert len(places) < 2 or (np.diff(places) > 0).all() and np.ptp(np.diff(places)) <= 1
