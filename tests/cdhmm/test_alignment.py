"""Evidence, merging and structure of Sec. V: closed forms, and the best of all on small cases."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest
from scipy.stats import multivariate_t

from dollop.cdhmm.alignment import (
    align_chain,
    compact,
    estimate_structure,
    mean_place,
    path_through,
)
from dollop.cdhmm.evidence import (
    END,
    FIRST,
    START,
    _Prior,
    chains_of,
    emission_evidence,
    evidence_of,
    graph_of,
    outer_products,
    transition_evidence,
)
from dollop.cdhmm.merging import Merging, merge_states, reachability, topological_order


def prepared(sequences, spread=0.15):
    return chains_of([np.asarray(sequence, float) for sequence in sequences], spread)


def any_sequences(seed, n, most=5):
    """Parts of one task with something odd in between: enough likeness to merge, enough strangeness to err."""
    random = np.random.default_rng(seed)
    task = random.uniform(-1.5, 1.5, (most, 2))
    kept = [np.sort(random.choice(most, random.integers(1, most + 1), replace=False)) for _ in range(n)]
    return [task[each] + random.normal(0, 0.15, (len(each), 2)) for each in kept]


# ---- evidence


def test_chains_and_prior_are_what_they_say():
    """Places divide a demonstration evenly; the prior expects states of that spread, as wide apart as the subgoals."""
    sequences = [np.array([(0, 0), (2, 0), (4, 0)]), np.array([(0, 0)])]
    chains = prepared(sequences, spread=0.5)
    np.testing.assert_allclose(chains.place, [1 / 4, 2 / 4, 3 / 4, 1 / 2])
    np.testing.assert_allclose(chains.points[:, 0], [-1.5, 0.5, 2.5, -1.5])
    assert chains.owner.tolist() == [0, 0, 0, 1] and chains.slices == (slice(0, 3), slice(3, 4))
    kappa, psi = pytest.approx(0.5**2 / (11 / 8)), pytest.approx(5 * 0.5**2)
    assert chains.prior == _Prior(kappa=kappa, nu=8.0, psi=psi, most=8)
    assert prepared([each / 1000 for each in sequences], 0.5).prior.kappa == 1


def test_emission_evidence_is_the_product_of_predictions():
    """The closed form equals predicting subgoal after subgoal by Student's t, each from those before it."""
    points = np.random.default_rng(0).normal(0, 0.3, (6, 2))
    prior = _Prior(kappa=0.04, nu=8.0, psi=0.1, most=len(points))
    expected = 0.0
    for n, point in enumerate(points):
        seen = points[:n]
        kappa, nu, centre = prior.kappa + n, prior.nu + n, seen.sum(0) / (prior.kappa + n)
        scale = prior.psi * np.eye(2) + seen.T @ seen - kappa * np.outer(centre, centre)
        shape = scale * (kappa + 1) / (kappa * (nu - 1))
        expected += multivariate_t(centre, shape, df=nu - 1).logpdf(point)
    evidence = emission_evidence(len(points), points.sum(0), outer_products(points).sum(0), prior)
    assert evidence == pytest.approx(expected)


def test_transition_evidence_is_the_product_of_predictions():
    """The closed form equals predicting step after step with one count for every edge, in any order of the steps."""
    counts = np.array([[0, 3, 1, 2], [0, 0, 0, 0], [0, 4, 0, 0], [0, 0, 0, 0]])
    steps = np.random.default_rng(0).permutation(np.repeat([1, 2, 3], [3, 1, 2]))
    expected, seen = 0.0, dict.fromkeys([1, 2, 3], 1)
    for step in steps:
        expected += np.log(seen[step] / sum(seen.values()))
        seen[step] += 1
    assert transition_evidence(counts) == pytest.approx([expected, 0, 0, 0])


# ---- merging


@pytest.mark.parametrize("seed", range(10))
def test_reachability_is_the_transitive_closure(seed):
    """Which node reaches which equals multiplying the edges out, on random acyclic graphs in any numbering."""
    random = np.random.default_rng(seed)
    order = random.permutation(8)
    counts = np.triu(random.random((8, 8)) < 0.3, k=1).astype(int)[np.ix_(order, order)]
    closure = np.linalg.matrix_power(np.eye(8, dtype=int) + counts, 8) > 0
    np.testing.assert_array_equal(reachability(counts), closure)


@pytest.mark.parametrize("seed", range(8))
def test_gains_kept_up_to_date_are_the_gains_of_evidence(seed):
    """After every merge the gain of each pair equals the evidence computed anew with that pair merged."""
    chains = prepared(any_sequences(seed, 4))
    merging = Merging(np.arange(len(chains.points)) + FIRST, chains)
    gain = np.inf
    while gain > 0:
        before = evidence_of(merging.labels, chains)
        for a, b in np.argwhere(~merging.blocked):
            merged = np.where(merging.labels == merging.names[b], merging.names[a], merging.labels)
            assert merging.gain[a, b] == pytest.approx(evidence_of(merged, chains) - before, abs=1e-9)
        u, v, gain = merging.best()
        if gain > 0:
            merging.merge(u, v)


# ---- structure


def alignments(length, nodes):
    """Every way to send subgoals in order to some of `nodes` in order, the others (-1) to states of their own."""
    for shared in range(min(length, len(nodes)) + 1):
        for subgoals in combinations(range(length), shared):
            for chosen in combinations(nodes, shared):
                chain = np.full(length, -1)
                chain[list(subgoals)] = chosen
                yield chain


@pytest.mark.parametrize("seed", range(8))
def test_alignment_is_the_best_of_all(seed):
    """The alignment of one demonstration with the graph of others gains the most evidence of all that keep an order."""
    sequences = any_sequences(seed, 3, most=4)
    chains = prepared(sequences)
    rest = chains.slices[0].stop
    labels = compact(merge_states(np.arange(len(chains.points)) + FIRST, chains))
    labels[:rest] = START
    labels[rest:] = compact(labels[rest:])
    graph = graph_of(labels, chains)
    place = mean_place(labels, chains, len(graph.n))
    aligned, gain = align_chain(chains.points[:rest], graph, labels, chains)
    order = [node for node in topological_order(graph.counts, place) if node >= FIRST]

    def evidence(chain):
        own = len(graph.n) + np.arange(rest)
        return evidence_of(np.concatenate([np.where(chain < 0, own, chain), labels[rest:]]), chains)

    emissions = emission_evidence(graph.n, graph.s, graph.q, chains.prior)
    without = emissions.sum() + transition_evidence(graph.counts).sum()
    best = max(evidence(chain) for chain in alignments(rest, order))
    assert evidence(aligned) == pytest.approx(best)
    assert gain == pytest.approx(best - without)


def partitions(size):
    """Every set partition of `size` things, as labels from zero."""
    for labels in product(*(range(i + 1) for i in range(size))):
        if all(label <= max(labels[:i], default=-1) + 1 for i, label in enumerate(labels)):
            yield np.array(labels)


def is_acyclic(counts):
    return len(topological_order(counts, np.zeros(len(counts)))) == len(counts)


def test_structure_has_nearly_always_the_highest_evidence_of_all():
    """Of all acyclic structures of three short demonstrations, the most evident one is found in 24 of 25 cases."""
    every = list(partitions(7))
    hits = 0
    for seed in range(25):
        random = np.random.default_rng(seed)
        task = random.uniform(-0.5, 0.5, (3, 2))
        sequences = [task[rows] + random.normal(0, 0.15, (len(rows), 2)) for rows in ([0, 1, 2], [0, 2], [0, 1])]
        chains = prepared(sequences)
        graphs = [(labels + FIRST, graph_of(labels + FIRST, chains).counts) for labels in every]
        best = max(evidence_of(labels, chains) for labels, counts in graphs if is_acyclic(counts))
        hits += evidence_of(estimate_structure(chains), chains) >= best - 1e-9
    assert hits >= 24


# ---- the most-likely path


def all_paths(counts, node=START):
    if node == END:
        yield (END,)
    for successor in np.flatnonzero(counts[node]):
        for path in all_paths(counts, int(successor)):
            yield (node, *path)


@pytest.mark.parametrize("seed", range(30))
def test_most_likely_path_is_the_best_of_all(seed):
    """On random acyclic graphs no path is more probable, nor as probable with fewer states or with more subgoals."""
    random = np.random.default_rng(seed)
    visited = [np.flatnonzero(random.random(6) < 0.5) for _ in range(5)]
    visited = [states for states in visited if len(states)]
    labels = compact(np.concatenate(visited))
    chains = prepared([np.zeros((len(states), 2)) for states in visited])
    counts, n = np.zeros((8, 8), int), np.bincount(labels, minlength=8)
    for part in chains.slices:
        for u, v in pairwise([START, *labels[part], END]):
            counts[u, v] += 1

    def merit(path):
        shares = [counts[u, v] / counts[u].sum() for u, v in pairwise(path)]
        return round(float(np.prod(shares)), 12), -len(path), n[list(path)].sum()

    path = (START, *path_through(labels, chains).tolist(), END)
    assert merit(path) == max(merit(each) for each in all_paths(counts))
