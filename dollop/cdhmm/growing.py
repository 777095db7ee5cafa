"""The structure of a CDHMM from many demonstrations: a core merged, the others added (Sec. V).

Best-first merging compares all pairs of subgoals, so it takes time and memory with the square of
their number. Where there are many, only a core of the demonstrations is merged so. The others are
aligned with its graph one after another, the best explained first. After that the states are
merged and all demonstrations aligned afresh, in turn, until nothing gains any more. A graph has few
states, so that every step takes as long for the thousandth demonstration as for the hundredth.
"""

import numpy as np

from dollop.cdhmm.alignment import (
    best_alignment,
    compact,
    edge_gains,
    estimate_structure,
    mean_place,
)
from dollop.cdhmm.evidence import (
    END,
    FIRST,
    LEAST_GAIN,
    START,
    chains_within,
    emission_evidence,
    graph_of,
    outer_products,
    subgoals_of,
    transition_evidence,
)
from dollop.cdhmm.merging import merge_states, topological_order
from dollop.cdhmm.spread import by_content, spaced

__all__ = ["structure_of"]

CORE = 512  # subgoals merged best-first: all pairs of them take a fraction of a second


class _GrowingGraph:
    """A graph of demonstrations, kept up to date while they are taken out and aligned again.

    `nodes` (M,) is the node of each subgoal, START while its demonstration is not in the graph. The
    nodes stand in one topological `order`; a demonstration that is aligned keeps to it, and its new
    states take their places in it.
    """

    def __init__(self, labels, chains):
        self.nodes, self.chains = labels.copy(), chains
        self.q_points = outer_products(chains.points)
        self.alone = emission_evidence(1, chains.points, self.q_points, chains.prior)
        graph = graph_of(labels, chains)
        self.n, self.s, self.q, self.into = graph.n, graph.s, graph.q, graph.counts.T.copy()
        self.own = emission_evidence(self.n, self.s, self.q, chains.prior)
        order = topological_order(graph.counts, mean_place(labels, chains, len(self.n)))
        self.order = np.array([v for v in order if v < FIRST or self.n[v]], int)

    def gain(self, k):
        """What a demonstration that is not in the graph would add per subgoal, in nats."""
        part = self.chains.slices[k]
        return self._best(part)[1] / (part.stop - part.start)

    def add(self, k):
        """Align a demonstration that is not in the graph, and put it in."""
        part = self.chains.slices[k]
        self._put_in(part, self._best(part)[0])

    def align_afresh(self, k):
        """Take a demonstration out, align it and put it in again; True if that was of use."""
        part, order = self.chains.slices[k], self.order
        nodes = self.nodes[part].copy()
        worth = self._evidence_at(nodes)
        self._count(part, -1)
        worth -= self._evidence_at(nodes)
        self.order = order[(self.n[order] > 0) | (order < FIRST)]
        renewed, gain = self._best(part)
        if gain - worth > LEAST_GAIN:
            self._put_in(part, renewed)
            return True
        self.order = order
        self._count(part, 1)
        return False

    # how

    def _evidence_at(self, nodes):
        """The evidence of some nodes, and of the steps from there and from the start."""
        steps = transition_evidence(self.into[:, np.append(START, nodes)].T)
        return self.own[nodes].sum() + steps.sum()

    def _best(self, part):
        """The alignment that gains most, -1 for states of their own, and its gain."""
        points, order = self.chains.points[part], self.order
        n, s = self.n[order] + 1, self.s[order] + points[:, None]
        q = self.q[order] + self.q_points[part, None]
        shared = emission_evidence(n, s, q, self.chains.prior) - self.own[order]
        shared[:, [0, -1]] = -np.inf  # START and END
        edges = edge_gains(self.into[order[:, None], order])
        places, gain = best_alignment(shared, self.alone[part], *edges)
        return np.where(places < 0, -1, order[places]), gain

    def _put_in(self, part, nodes):
        """Add a demonstration; its new states come right after the last shared before them."""
        rank = np.zeros(len(self.n) + 1, int)  # the last for -1
        rank[self.order] = np.arange(len(self.order))
        own = nodes < 0
        after = np.maximum.accumulate(rank[nodes])[own] + 1
        nodes[own] = self._unused(own.sum())
        self.order = np.insert(self.order, after, nodes[own])
        self.nodes[part] = nodes
        self._count(part, 1)

    def _count(self, part, sign):
        """Add what a demonstration gives to its nodes and their edges, or take it away."""
        nodes, prior = self.nodes[part], self.chains.prior  # none of the nodes twice
        self.n[nodes] += sign
        self.s[nodes] += sign * self.chains.points[part]
        self.q[nodes] += sign * self.q_points[part]
        empty = nodes[self.n[nodes] == 0]
        self.s[empty], self.q[empty] = 0.0, 0.0  # exactly
        self.into[np.append(nodes, END), np.append(START, nodes)] += sign
        self.own[nodes] = emission_evidence(self.n[nodes], self.s[nodes], self.q[nodes], prior)

    def _unused(self, number):
        """Nodes without subgoals; there are made more of them where there are too few."""
        size = len(self.n)
        if np.count_nonzero(self.n == 0) < number + FIRST:
            more = size + number
            self.n, self.own = np.pad(self.n, (0, more)), np.pad(self.own, (0, more))
            self.s, self.q = (np.pad(each, ((0, more), (0, 0))) for each in (self.s, self.q))
            self.into = np.pad(self.into, (0, more))
        return np.flatnonzero(self.n[FIRST:] == 0)[:number] + FIRST


def structure_of(chains):
    """The structure that all demonstrations make most evident, as far as it is found (Sec. V).

    Up to some hundred subgoals it is that of `dollop.cdhmm.alignment.estimate_structure`. Beyond,
    it does not depend on the order in which demonstrations are given: their order by content rules.

    Parameters
    ----------
    chains : record
        Of M subgoals.

    Returns
    -------
    (M,) int array
        Labels, numbered without gaps.
    """
    if len(chains.points) <= CORE:
        return estimate_structure(chains)
    order = by_content([chains.points[part] for part in chains.slices])
    subgoals = subgoals_of(chains, order)
    labels = np.empty(len(subgoals), int)
    labels[subgoals] = _grown(chains_within(chains, order))
    return labels


def _grown(chains):
    """Labels from a core of the demonstrations, which are in their order by content."""
    total, labels = len(chains.slices), np.full(len(chains.points), START)
    core = spaced(total, max(CORE * total // len(labels), 1))
    labels[subgoals_of(chains, core)] = estimate_structure(chains_within(chains, core))
    graph, rest = _GrowingGraph(labels, chains), np.setdiff1d(np.arange(total), core)
    gains = [graph.gain(k) for k in rest]
    for k in rest[np.argsort(gains, kind="stable")[::-1]]:
        graph.add(k)
    return _improved(graph.nodes, chains)


def _improved(labels, chains):
    """Labels that neither merging two states nor aligning one demonstration afresh can improve."""
    moved = True
    while moved:
        graph = _GrowingGraph(compact(merge_states(compact(labels), chains)), chains)
        moved = sum([graph.align_afresh(k) for k in range(len(chains.slices))])
        labels = graph.nodes
    return compact(labels)
