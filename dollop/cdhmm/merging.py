"""Best-first merging of states while the evidence grows (Sec. V), never where one is reachable from
the other.

The gain of every pair stands in a matrix, of which a merge renews only the rows that it touches.
"""

import heapq

import numpy as np
import scipy

from dollop.cdhmm.evidence import FIRST, LEAST_GAIN, emission_evidence, emission_table, graph_of

__all__ = ["merge_states", "topological_order"]


class Merging:
    """The gain of evidence of every pair of nodes, kept up to date while pairs are merged.

    A merge changes few pairs: those of the merged node, those of two of its predecessors or two of
    its successors, and those of a node that led to both. Only these are computed again. The gain of
    merging a and b is made of

        emissions  ev(a + b) - ev(a) - ev(b)
        leaving    D(K_ab, C_ab) - D(K_a, C_a) - D(K_b, C_b) + sum over v of f(c_av, c_bv),   K_ab = K_a + K_b - common
        entering   sum over p that lead to both of  D(K_p - 1, C_p) - D(K_p, C_p) + f(c_pa, c_pb)

    with D(K, C) = log G(K) - log G(K + C) and f(x, y) = log (x + y)! - log x! - log y!.
    """

    def __init__(self, labels, chains, prior):
        self.labels, self.prior = labels.copy(), prior
        graph = graph_of(labels, chains)
        self.n, self.s, self.q, self.counts = graph.n, graph.s, graph.q, graph.counts
        self.names = np.arange(len(self.n))
        self.table = emission_table(prior, 2 * len(labels))
        self.log_factorial = scipy.special.gammaln(np.arange(4 * len(labels) + 1) + 1.0)
        self.reaches = reachability(self.counts)
        self.blocked = self.reaches | self.reaches.T
        self._compute_all()

    def _compute_all(self):
        size = len(self.n)
        self.out, self.total = (self.counts > 0).sum(1), self.counts.sum(1)
        self.alone = self._dirichlet(self.out, self.total)
        self.own = emission_evidence(self.n, self.s, self.q, self.prior, self.table)
        self.emission = self._emission_gain(slice(None))
        self.common = np.zeros((size, size), int)
        self.leaving, self.entering = np.zeros((size, size)), np.zeros((size, size))
        for node in ((self.counts > 0).sum(0) > 1).nonzero()[0]:
            self._count_entries(node, 1)
        for node in (self.out > 1).nonzero()[0]:
            self._count_exits(node, 1)
        everything = slice(None)
        gain = self.emission + self.entering + self._leaving_gain(everything, everything, everything)
        self.gain = np.where(self.blocked, -np.inf, gain)

    def best(self):
        """The pair of highest gain and that gain; among equals the first, whatever the rounding."""
        highest = self.gain.max()
        pair = np.unravel_index(np.argmax(self.gain >= highest - LEAST_GAIN), self.gain.shape)
        return (*map(int, pair), highest)

    def run(self):
        """Merge best-first while the evidence grows: labels (M,)."""
        u, v, gain = self.best()
        while gain > LEAST_GAIN:
            self.merge(u, v)
            u, v, gain = self.best()
        return self.labels

    def merge(self, u, v):
        """Put node v into node u."""
        before, after = self._neighbours(u, v)
        forks = ((self.counts[:, u] > 0) & (self.counts[:, v] > 0)).nonzero()[0]
        for node in (u, v):
            self._count_entries(node, -1)
            self._count_exits(node, -1)
        relief = self._join_relief(forks)
        self._add_up(u, v, forks)
        self._block(u, v)
        self._count_entries(u, 1)
        self._count_exits(u, 1)
        for fork, change in zip(forks, self._join_relief(forks) - relief, strict=True):
            successors = self.counts[fork].nonzero()[0]
            self.entering[successors[:, None], successors] += change
            self._refresh(successors)
        self._compute_node(u)
        self._refresh(before)
        self._refresh(after)
        self._refresh_rows(np.array([u, *forks]))
        self._forget(v)

    def _neighbours(self, u, v):
        before = (self.counts[:, u] + self.counts[:, v]).nonzero()[0]
        return before, (self.counts[u] + self.counts[v]).nonzero()[0]

    def _add_up(self, u, v, forks):
        for total in (self.n, self.s, self.q, self.counts, self.counts.T):
            total[u] += total[v]
            total[v] = 0
        self.out[u], self.total[u] = np.count_nonzero(self.counts[u]), self.total[u] + self.total[v]
        self.out[v] = self.total[v] = 0
        self.own[u] += self.own[v] + self.emission[u, v]
        self.out[forks] -= 1
        self.alone = self._dirichlet(self.out, self.total)
        self.labels[self.labels == self.names[v]] = self.names[u]

    def _block(self, u, v):
        """What reaches u or v now reaches all that either reaches: those pairs can never merge
        again.
        """
        above, below = self.reaches[:, u] | self.reaches[:, v], self.reaches[u] | self.reaches[v]
        rows, columns = above.nonzero()[0], below.nonzero()[0]
        self.reaches[rows[:, None], columns] = True
        for block in ((rows[:, None], columns), (columns[:, None], rows)):
            self.blocked[block] = True
            self.gain[block] = -np.inf

    def _forget(self, v):
        self.blocked[v] = self.blocked[:, v] = True
        self.gain[v] = self.gain[:, v] = -np.inf
        self.reaches[v] = self.reaches[:, v] = False
        living = np.flatnonzero((self.n > 0) | (np.arange(len(self.n)) < FIRST))
        if 4 * len(living) < 3 * len(self.n):
            self._keep(living)

    def _keep(self, living):
        for name in ("n", "s", "q", "own", "out", "total", "alone", "names"):
            setattr(self, name, getattr(self, name)[living])
        for name in ("counts", "common", "leaving", "entering", "emission", "gain", "reaches", "blocked"):
            setattr(self, name, getattr(self, name)[living[:, None], living])

    # the parts of the gain

    def _dirichlet(self, out, total):
        return self.log_factorial[out - 1] - self.log_factorial[out + total - 1]  # without edges: blocked anyway

    def _ways(self, x, y):
        return self.log_factorial[x + y] - self.log_factorial[x] - self.log_factorial[y]

    def _join_relief(self, nodes):
        """What node p gains by one successor less: D(K_p - 1, C_p) - D(K_p, C_p)."""
        out, total = self.out[nodes], self.total[nodes]
        return self._dirichlet(out - 1, total) - self._dirichlet(out, total)

    def _emission_gain(self, rows):
        n, s, q = self.n[rows, None] + self.n, self.s[rows, None] + self.s, self.q[rows, None] + self.q
        together = emission_evidence(n, s, q, self.prior, self.table)
        return together - self.own[rows, None] - self.own

    def _leaving_gain(self, rows, columns, block):
        out = self.out[rows, None] + self.out[columns] - self.common[block]
        together = self._dirichlet(out, self.total[rows, None] + self.total[columns])
        return together - self.alone[rows, None] - self.alone[columns] + self.leaving[block]

    def _count_entries(self, node, sign):
        """Add (or take away) what the edges into a node contribute to the pairs of its
        predecessors.
        """
        before = self.counts[:, node].nonzero()[0]
        if len(before) > 1:
            block, c = (before[:, None], before), self.counts[before, node]
            self.common[block] += sign
            self.leaving[block] += sign * self._ways(c[:, None], c)

    def _count_exits(self, node, sign):
        """Add (or take away) what the edges out of a node contribute to the pairs of its
        successors.
        """
        after = self.counts[node].nonzero()[0]
        if len(after) > 1:
            c = self.counts[node, after]
            self.entering[after[:, None], after] += sign * (self._ways(c[:, None], c) + self._join_relief(node))

    def _compute_node(self, u):
        """All pairs of a node that was just merged."""
        self.emission[u] = self.emission[:, u] = self._emission_gain(np.array([u]))[0]
        after, before = self.counts[u].nonzero()[0], self.counts[:, u].nonzero()[0]
        c = self.counts[:, after]
        self.common[u] = self.common[:, u] = (c > 0).sum(1)
        self.leaving[u] = self.leaving[:, u] = self._ways(self.counts[u, after], c).sum(1)
        c = self.counts[before].T
        joined = (self._ways(self.counts[before, u], c) + self._join_relief(before)) * (c > 0)
        self.entering[u] = self.entering[:, u] = joined.sum(1)

    def _refresh(self, nodes):
        """The gains of all pairs among some nodes."""
        if len(nodes) > 1:
            block = (nodes[:, None], nodes)
            gain = self.emission[block] + self.entering[block] + self._leaving_gain(nodes, nodes, block)
            gain[self.blocked[block]] = -np.inf
            self.gain[block] = gain

    def _refresh_rows(self, nodes):
        """The gains of some nodes with all others."""
        gain = self.emission[nodes] + self.entering[nodes] + self._leaving_gain(nodes, slice(None), nodes)
        gain[self.blocked[nodes]] = -np.inf
        self.gain[nodes], self.gain[:, nodes] = gain, gain.T


def reachability(counts):
    """Which node reaches which over the edges (S, S); every node reaches itself."""
    reaches = np.eye(len(counts), dtype=bool)
    for node in reversed(topological_order(counts, np.zeros(len(counts)))):
        reaches[node] |= reaches[np.flatnonzero(counts[node])].any(0)
    return reaches


def topological_order(counts, place):
    """Nodes so that every edge leads onward; where the graph leaves it open, by place (S,), then by
    number.
    """
    successors = [[] for _ in counts]
    waiting, place = [0] * len(counts), place.tolist()
    for node, successor in zip(*(ends.tolist() for ends in np.nonzero(counts)), strict=True):
        successors[node].append(successor)
        waiting[successor] += 1
    ready = [(place[node], node) for node in range(len(counts)) if not waiting[node]]
    heapq.heapify(ready)
    order = []
    while ready:
        _, node = heapq.heappop(ready)
        order.append(node)
        for successor in successors[node]:
            waiting[successor] -= 1
            if waiting[successor] == 0:
                heapq.heappush(ready, (place[successor], successor))
    return order


def merge_states(labels, chains, prior):
    """Merge states best-first while the evidence grows: labels (M,) to labels."""
    return Merging(labels, chains, prior).run()
