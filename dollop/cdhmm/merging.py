"""Best-first merging of states while the evidence grows, so that the graph stays acyclic (Sec. V).

No state is merged with one that it reaches. The gain of every pair stands in a matrix, of which a
merge renews only the rows that it touches.
"""

import heapq

import numpy as np
import scipy

from dollop.cdhmm.evidence import FIRST, LEAST_GAIN, emission_evidence, graph_of

__all__ = ["merge_states", "topological_order"]


class Merging:
    """The gain of evidence of every pair of nodes, kept up to date while pairs are merged.

    A merge changes few pairs: those of the merged node, those of two of its predecessors or two of
    its successors, and those of a node that led to both. Only these are computed again. The gain of
    merging a and b is made of

        emissions  ev(a + b) - ev(a) - ev(b)
        leaving    D(K_ab, C_ab) - D(K_a, C_a) - D(K_b, C_b) + sum over v of f(c_av, c_bv)
        entering   sum over p that lead to both of  D(K_p - 1, C_p) - D(K_p, C_p) + f(c_pa, c_pb)

    with D(K, C) = log G(K) - log G(K + C), f(x, y) = log (x + y)! - log x! - log y!, and
    K_ab = K_a + K_b - the number of nodes to which both lead.
    """

    def __init__(self, labels, chains):
        self.labels, self.prior = labels.copy(), chains.prior
        graph = graph_of(labels, chains)
        self.n, self.s, self.q, self.counts = graph.n, graph.s, graph.q, graph.counts
        self.names = np.arange(len(self.n))
        self.log_factorial = scipy.special.gammaln(np.arange(4 * len(labels) + 1) + 1.0)
        self.reaches = reachability(self.counts)
        self.blocked = self.reaches | self.reaches.T
        self._compute_all()

    def _compute_all(self):
        everything, shape = slice(None), self.counts.shape
        self.out, self.total = (self.counts > 0).sum(1), self.counts.sum(1)
        self.alone = self._dirichlet(self.out, self.total)
        self.own = emission_evidence(self.n, self.s, self.q, self.prior)
        self.emission = self._emission_gain(everything)
        self.common = np.zeros(shape, int)
        self.leaving, self.entering = np.zeros(shape), np.zeros(shape)
        for node in range(len(self.n)):
            self._count(node, 1)
        self.gain = self._gain_of(everything, everything, everything)

    def best(self):
        """The pair of highest gain and that gain; among equals the first, whatever the rounding."""
        highest = self.gain.max()
        pair = np.unravel_index(np.argmax(self.gain >= highest - LEAST_GAIN), self.gain.shape)
        return (*map(int, pair), highest)

    def merge(self, u, v):
        """Put node v into node u."""
        before = (self.counts[:, u] + self.counts[:, v]).nonzero()[0]
        after = (self.counts[u] + self.counts[v]).nonzero()[0]
        forks = (self.counts[:, u] * self.counts[:, v]).nonzero()[0]
        self._count(u, -1)
        self._count(v, -1)
        relief = self._join_relief(forks)
        self._add_up(u, v, forks)
        self._block(u, v)
        self._count(u, 1)
        for fork, change in zip(forks, self._join_relief(forks) - relief, strict=True):
            successors = self.counts[fork].nonzero()[0]
            self.entering[successors[:, None], successors] += change
            self._refresh(successors)
        self._compute_node(u)
        self._refresh(before)
        self._refresh(after)
        self._refresh_rows(np.array([u, *forks]))
        self._forget(v)

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
        """What reaches u or v now reaches all that either reaches: such pairs never merge again."""
        above, below = self.reaches[:, u] | self.reaches[:, v], self.reaches[u] | self.reaches[v]
        rows, columns = above.nonzero()[0], below.nonzero()[0]
        self.reaches[rows[:, None], columns] = True
        for block in ((rows[:, None], columns), (columns[:, None], rows)):
            self.blocked[block] = True
            self.gain[block] = -np.inf

    def _forget(self, v):
        """Node v is gone; once there are many such, leave them out of all arrays."""
        self.blocked[v] = self.blocked[:, v] = True
        self.gain[v] = self.gain[:, v] = -np.inf
        self.reaches[v] = self.reaches[:, v] = False
        living = np.flatnonzero((self.n > 0) | (np.arange(len(self.n)) < FIRST))
        if 4 * len(living) >= 3 * len(self.n):
            return
        for name in ("n", "s", "q", "own", "out", "total", "alone", "names"):
            setattr(self, name, getattr(self, name)[living])
        pairs = "counts", "common", "leaving", "entering", "emission", "gain", "reaches", "blocked"
        for name in pairs:
            setattr(self, name, getattr(self, name)[living[:, None], living])

    # the parts of the gain

    def _dirichlet(self, out, total):
        # Of a node without edges this is nonsense, but its pairs are blocked anyway.
        return self.log_factorial[out - 1] - self.log_factorial[out + total - 1]

    def _ways(self, x, y):
        return self.log_factorial[x + y] - self.log_factorial[x] - self.log_factorial[y]

    def _join_relief(self, nodes):
        """What node p gains by one successor less: D(K_p - 1, C_p) - D(K_p, C_p)."""
        out, total = self.out[nodes], self.total[nodes]
        return self._dirichlet(out - 1, total) - self._dirichlet(out, total)

    def _emission_gain(self, rows):
        n, s, q = (each[rows, None] + each for each in (self.n, self.s, self.q))
        return emission_evidence(n, s, q, self.prior) - self.own[rows, None] - self.own

    def _gain_of(self, rows, columns, block):
        """The gains of pairs of nodes, which stand in a block of each matrix."""
        out = self.out[rows, None] + self.out[columns] - self.common[block]
        together = self._dirichlet(out, self.total[rows, None] + self.total[columns])
        leaving = together - self.alone[rows, None] - self.alone[columns] + self.leaving[block]
        gain = self.emission[block] + self.entering[block] + leaving
        gain[self.blocked[block]] = -np.inf
        return gain

    def _count(self, node, sign):
        """Add (or take away) what a node's edges give the pairs of those before and after it."""
        before, after = self.counts[:, node].nonzero()[0], self.counts[node].nonzero()[0]
        if len(before) > 1:
            block, c = (before[:, None], before), self.counts[before, node]
            self.common[block] += sign
            self.leaving[block] += sign * self._ways(c[:, None], c)
        if len(after) > 1:
            block, c = (after[:, None], after), self.counts[node, after]
            self.entering[block] += sign * (self._ways(c[:, None], c) + self._join_relief(node))

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
        block = nodes[:, None], nodes
        if len(nodes) > 1:
            self.gain[block] = self._gain_of(nodes, nodes, block)

    def _refresh_rows(self, nodes):
        """The gains of some nodes with all others."""
        gain = self._gain_of(nodes, slice(None), nodes)
        self.gain[nodes], self.gain[:, nodes] = gain, gain.T


def reachability(counts):
    """Which node reaches which over the edges (S, S); every node reaches itself."""
    reaches = np.eye(len(counts), dtype=bool)
    for node in reversed(topological_order(counts, np.zeros(len(counts)))):
        reaches[node] |= reaches[np.flatnonzero(counts[node])].any(0)
    return reaches


def topological_order(counts, place):
    """Nodes so that every edge leads onward (Kahn's algorithm).

    Parameters
    ----------
    counts : (S, S) int array
        Where not zero there is an edge, from row to column.
    place : (S,) float array
        Where the edges leave the order open, it is by place, then by number.

    Returns
    -------
    list of int
        Without the nodes of a cycle and those after it.

    Examples
    --------
    >>> topological_order(np.array([[0, 0, 1], [1, 0, 1], [0, 0, 0]]), np.zeros(3))
    [1, 0, 2]
    """
    place, waiting = place.tolist(), np.count_nonzero(counts, axis=0).tolist()
    successors = [[] for _ in counts]
    for node, successor in np.argwhere(counts).tolist():
        successors[node].append(successor)
    ready, order = [(place[node], node) for node, n in enumerate(waiting) if not n], []
    heapq.heapify(ready)
    while ready:
        _, node = heapq.heappop(ready)
        order.append(node)
        for successor in successors[node]:
            waiting[successor] -= 1
            if not waiting[successor]:
                heapq.heappush(ready, (place[successor], successor))
    return order


def merge_states(labels, chains):
    """Merge states best-first while the evidence grows (Sec. V; reconstruction).

    Parameters
    ----------
    labels : (M,) int array
        The node of each subgoal, numbered without gaps.
    chains : record
        That of `dollop.cdhmm.evidence.chains_of`.

    Returns
    -------
    (M,) int array
        The labels of the states that are left.
    """
    merging = Merging(labels, chains)
    u, v, gain = merging.best()
    while gain > LEAST_GAIN:
        merging.merge(u, v)
        u, v, gain = merging.best()
    return merging.labels
