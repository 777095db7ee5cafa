"""Sec. V with many demonstrations: as if all had been merged best-first, and sums that stay right."""

import numpy as np
import pytest

from dollop.cdhmm import SubgoalHMM, growing
from dollop.cdhmm.alignment import estimate_structure
from dollop.cdhmm.evidence import END, START, chains_of, evidence_of, graph_of
from dollop.cdhmm.growing import _GrowingGraph, structure_of
from dollop.lab.drawn import TASKS, draw_demonstrations

SLALOM = np.array(TASKS["slalom"])


@pytest.fixture
def small_core(monkeypatch):
    """Fifty subgoals are a core already, so that few demonstrations are many."""
    monkeypatch.setattr(growing, "CORE", 50)


def partition(model):
    """Which subgoals share a state, whatever the states are called."""
    members = {}
    for k, states in enumerate(model.states):
        for place, state in enumerate(states.tolist()):
            members.setdefault(state, set()).add((k, place))
    return set(map(frozenset, members.values()))


def found_by(model):
    return model.means[model.most_likely_path()]


# ---- the structure


@pytest.mark.parametrize("task", TASKS)
def test_a_core_and_the_others_lead_where_merging_all_leads(task, monkeypatch):
    """Twenty-five demonstrations, eight of which are merged best-first, share states as if all were."""
    shown = draw_demonstrations(TASKS[task], 25, 0.05, seed=1)
    everything = SubgoalHMM.fit(shown)
    monkeypatch.setattr(growing, "CORE", 50)
    assert partition(SubgoalHMM.fit(shown)) == partition(everything)


@pytest.mark.parametrize("seed", range(6))
def test_the_evidence_is_nearly_that_of_merging_all(seed, small_core):
    """Where subgoals scatter widely, 30 demonstrations lose at most half a nat each, if any."""
    chains = chains_of(draw_demonstrations(TASKS["figure-eight"], 30, 0.2, seed=seed), 0.2)
    best = evidence_of(estimate_structure(chains), chains)
    assert evidence_of(structure_of(chains), chains) >= best - 15


def test_two_hundred_demonstrations_have_the_subgoals_of_their_first_thirty():
    """As many subgoals in the same places, only more exactly: those of the mean of 200 scattered points."""
    shown = draw_demonstrations(SLALOM, 200, 0.1, seed=2)
    few, many = SubgoalHMM.fit(shown[:30]), SubgoalHMM.fit(shown)
    assert len(few.most_likely_path()) == len(many.most_likely_path()) == 6
    assert np.linalg.norm(found_by(few) - found_by(many), axis=1).max() < 0.1
    error = np.linalg.norm(found_by(many) - SLALOM, axis=1).mean()
    assert error < 1.5 * 0.1 * np.sqrt(np.pi / 2 / 200)


def test_the_order_of_many_demonstrations_does_not_matter(small_core):
    """Shuffled, they share states as before."""
    shown = draw_demonstrations(TASKS["ring"], 40, 0.2, seed=7)
    expected = partition(SubgoalHMM.fit(shown))
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(40)
        found = partition(SubgoalHMM.fit([shown[k] for k in order]))
        assert {frozenset((order[k], place) for k, place in members) for members in found} == expected


def test_frame_and_unit_do_not_matter(small_core):
    """Turned, moved and scaled demonstrations share states as before (the spread scaled too)."""
    shown = draw_demonstrations(SLALOM, 40, 0.15, seed=3)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = [100 * each @ [[c, s], [-s, c]] + (4e3, -7e3) for each in shown]
    assert partition(SubgoalHMM.fit(shown, 0.15)) == partition(SubgoalHMM.fit(turned, 15.0))


def test_the_rarer_of_two_tasks_is_set_apart_and_moves_nothing(small_core):
    """Ten of forty do something else: they are named, share states with each other and draw no subgoal aside."""
    shown = draw_demonstrations(SLALOM, 30, 0.1, extra=0, seed=5)
    other = draw_demonstrations(SLALOM[::-1] + (0, 0.5), 10, 0.1, extra=0, seed=6)
    mixed = [*shown[:10], *other, *shown[10:]]
    model = SubgoalHMM.fit(mixed)
    assert model.outliers() == tuple(range(10, 20))
    assert np.allclose(found_by(model), np.mean(shown, axis=0))
    assert len(set(map(tuple, model.states[10:20]))) == 1


def test_many_of_nothing_in_common_stay_apart(small_core):
    """Twenty demonstrations at twenty places share no state."""
    shown = [SLALOM[:4] + (0, 30 * k) for k in range(20)]
    assert len(SubgoalHMM.fit(shown).means) == 80


# ---- the graph that grows


@pytest.mark.parametrize("seed", range(4))
def test_sums_stay_those_of_the_labels(seed):
    """After adding and aligning afresh, the graph is what its labels add up to, and its order leads onward."""
    chains = chains_of(draw_demonstrations(TASKS["figure-eight"], 8, 0.3, extra=0.7, seed=seed), 0.15)
    graph = _GrowingGraph(np.full(len(chains.points), START), chains)
    for k in range(8):
        graph.add(k)
    for k in (3, 0, 7, 3):
        before = evidence_of(graph.nodes, chains)
        moved = graph.align_afresh(k)
        gained = evidence_of(graph.nodes, chains) - before
        assert gained > 0 if moved else gained == pytest.approx(0, abs=1e-9)
        expected, size = graph_of(graph.nodes, chains), graph.nodes.max() + 1
        assert np.array_equal(graph.n[:size], expected.n)
        assert np.array_equal(graph.into[:size, :size].T, expected.counts)
        assert np.allclose(graph.s[:size], expected.s, atol=1e-12)
        assert np.allclose(graph.q[:size], expected.q, atol=1e-12)
        rank = np.full(len(graph.n), -1)
        rank[graph.order] = np.arange(len(graph.order))
        edges = np.argwhere(expected.counts)
        assert (rank[edges[:, 0]] < rank[edges[:, 1]]).all()
        assert rank[START] == 0 and rank[END] == len(graph.order) - 1


@pytest.mark.parametrize("seed", range(4))
def test_what_a_demonstration_gains_is_what_the_evidence_grows_by(seed):
    """The gain told per subgoal, times their number, is the evidence with it minus the evidence without."""
    shown = draw_demonstrations(SLALOM, 4, 0.2, seed=seed)
    chains = chains_of(shown, 0.15)
    graph = _GrowingGraph(np.full(len(chains.points), START), chains)
    for k in range(4):
        gain, before = graph.gain(k) * len(shown[k]), evidence_of(graph.nodes, chains)
        graph.add(k)
        assert evidence_of(graph.nodes, chains) - before == pytest.approx(gain)
