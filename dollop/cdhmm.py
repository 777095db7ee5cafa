"""Sec. V: the structure of a Continuous-Density Hidden Markov Model (CDHMM) estimated from subgoals, by merging.

The user is a CDHMM that emits subgoals. Every demonstration enters as a chain of states of its own, START -> .. -> END;
states are merged best-first while the evidence of the whole grows, never when one is reachable from the other, so that
the graph stays acyclic. The paper names its merge test only by reference; this one is a reconstruction after Bayesian
model merging (Stolcke & Omohundro, NIPS 1992) and acyclic probabilistic automata (Ron, Singer & Tishby, JCSS 1998).

====================  ==========================================================================================
n, s, q               of a state: the number of its subgoals, their sum, and the sum of their xx, xy, yy, all taken
                      from the mean of all subgoals; additive, so that merging states adds them
kappa, nu, psi        the Normal-inverse-Wishart prior of a state: mean ~ N(0, Sigma / kappa), Sigma ~ IW(nu, psi I)
c_uv, C_u, K_u        how often the edge u -> v was taken, their sum over v, and the number of edges that leave u
====================  ==========================================================================================

The structure is one number per subgoal, its state; everything else follows from these *labels*. Their evidence is

    sum over states of   log p(subgoals of the state)                                      (Normal-inverse-Wishart)
  + sum over nodes of    log G(K_u) - log G(K_u + C_u) + sum over v of log G(c_uv + 1)     (Dirichlet, beta = 1)

Best-first merging alone can err early, where a path crosses itself or an odd subgoal comes near a later one, and what
it merged then keeps other pairs apart. So two moves follow, kept only if the evidence grows: all demonstrations are
taken out and aligned with the growing graph one after another, and each is aligned afresh with what the others built.
"""

import heapq
from collections import deque
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from operator import add

import numpy as np
from scipy.special import gammaln, logsumexp

START, END, FIRST = 0, 1, 2  # nodes of every graph: the start, the end, then the states
LEAST_GAIN = 1e-9  # nats: a smaller gain of evidence is rounding, not a reason
LEAST_COVERAGE = 0.5  # of the states on the most-likely path: who visits fewer does something else


@dataclass(frozen=True)
class _Chains:
    """The subgoals of all demonstrations, one after the other.

    `points` (M, 2) from their mean, `slices` where each demonstration lies, `first` (M,) where one begins, `place` (M,)
    position in the demonstration, in (0, 1).
    """

    points: np.ndarray
    slices: tuple
    first: np.ndarray
    place: np.ndarray


@dataclass(frozen=True)
class _Prior:
    """Normal-inverse-Wishart prior of one state; `psi` stands for psi times the unit matrix."""

    kappa: float
    nu: float
    psi: float


@dataclass(frozen=True)
class _Graph:
    """What labels add up to: per node `n` (S,), `s` (S, 2), `q` (S, 3), and edge `counts` (S, S)."""

    n: np.ndarray
    s: np.ndarray
    q: np.ndarray
    counts: np.ndarray


def _chains(sequences):
    lengths = [len(sequence) for sequence in sequences]
    slices = tuple(slice(end - length, end) for end, length in zip(np.cumsum(lengths).tolist(), lengths, strict=True))
    points = np.concatenate(sequences)
    index = np.concatenate([np.arange(length) for length in lengths])
    return _Chains(points - points.mean(0), slices, index == 0, (index + 1) / (np.repeat(lengths, lengths) + 1))


def _prior(points, spread):
    """Expect states of covariance spread^2, their means as wide apart as the subgoals are, no less than the spread."""
    nu, width = 8.0, max(np.sqrt(np.mean(points**2)), spread)
    return _Prior(kappa=(spread / width) ** 2, nu=nu, psi=(nu - 3) * spread**2)


# ---- evidence


def _outer(points):
    """xx, xy, yy of each point: (..., 2) -> (..., 3)."""
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * x, x * y, y * y], axis=-1)


def _emission_table(prior, n_most):
    """The part of the emission evidence that depends on n alone, for n = 0 .. n_most."""
    n = np.arange(n_most + 1)
    nu = prior.nu + np.array([0, *n])
    gammas = gammaln(nu / 2) + gammaln((nu - 1) / 2)
    return gammas[1:] - gammas[0] - n * np.log(np.pi) + prior.nu * np.log(prior.psi) - np.log1p(n / prior.kappa)


def _emission(n, s, q, prior, table):
    """Evidence of n subgoals with sum s (..., 2) and sums of products q (..., 3), in nats."""
    kappa = prior.kappa + n
    xx = prior.psi + q[..., 0] - s[..., 0] * s[..., 0] / kappa
    xy = q[..., 1] - s[..., 0] * s[..., 1] / kappa
    yy = prior.psi + q[..., 2] - s[..., 1] * s[..., 1] / kappa
    determinant = np.maximum(xx * yy - xy * xy, prior.psi**2)  # never less, but for rounding
    return table[n] - 0.5 * (prior.nu + n) * np.log(determinant)


def _transition(counts):
    """Evidence of the edges that leave each node (S,), in nats."""
    total, out = counts.sum(1), np.maximum((counts > 0).sum(1), 1)
    return gammaln(out) - gammaln(out + total) + gammaln(counts + 1).sum(1)


def _graph(labels, chains):
    """Add up what labels say; demonstrations whose labels are START are not in it."""
    size, inside = max(labels.max() + 1, FIRST), labels >= FIRST
    before = np.where(chains.first, START, np.roll(labels, 1))
    edges = np.concatenate(
        [(before * size + labels)[inside], (labels * size + END)[inside & np.roll(chains.first, -1)]]
    )
    return _Graph(
        n=np.bincount(labels[inside], minlength=size),
        s=_sums(labels[inside], chains.points[inside], size),
        q=_sums(labels[inside], _outer(chains.points[inside]), size),
        counts=np.bincount(edges, minlength=size * size).reshape(size, size),
    )


def _sums(labels, values, size):
    return np.stack([np.bincount(labels, column, minlength=size) for column in values.T], axis=-1)


def _steps(chain):
    """The edges of one demonstration, START and END included: two arrays, from and to."""
    return np.concatenate([[START], chain]), np.concatenate([chain, [END]])


def _evidence(labels, chains, prior):
    graph = _graph(labels, chains)
    table = _emission_table(prior, len(labels))
    return float(_emission(graph.n, graph.s, graph.q, prior, table).sum() + _transition(graph.counts).sum())


# ---- best-first merging


class _Merging:
    """The gain of evidence of every pair of nodes, kept up to date while pairs are merged.

    A merge changes few pairs: those of the merged node, those of two of its predecessors or two of its successors, and
    those of a node that led to both. Only these are computed again. The gain of merging a and b is made of

        emissions  ev(a + b) - ev(a) - ev(b)
        leaving    D(K_ab, C_ab) - D(K_a, C_a) - D(K_b, C_b) + sum over v of f(c_av, c_bv),   K_ab = K_a + K_b - common
        entering   sum over p that lead to both of  D(K_p - 1, C_p) - D(K_p, C_p) + f(c_pa, c_pb)

    with D(K, C) = log G(K) - log G(K + C) and f(x, y) = log (x + y)! - log x! - log y!.
    """

    def __init__(self, labels, chains, prior):
        self.labels, self.prior = labels.copy(), prior
        graph = _graph(labels, chains)
        self.n, self.s, self.q, self.counts = graph.n, graph.s, graph.q, graph.counts
        self.names = np.arange(len(self.n))
        self.table = _emission_table(prior, 2 * len(labels))
        self.log_factorial = gammaln(np.arange(4 * len(labels) + 1) + 1.0)
        self.reaches = _reachability(self.counts)
        self.blocked = self.reaches | self.reaches.T
        self._compute_all()

    def _compute_all(self):
        size = len(self.n)
        self.out, self.total = (self.counts > 0).sum(1), self.counts.sum(1)
        self.alone = self._dirichlet(self.out, self.total)
        self.own = _emission(self.n, self.s, self.q, self.prior, self.table)
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
        """What reaches u or v now reaches all that either reaches: those pairs can never merge again."""
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
        together = _emission(n, s, q, self.prior, self.table)
        return together - self.own[rows, None] - self.own

    def _leaving_gain(self, rows, columns, block):
        out = self.out[rows, None] + self.out[columns] - self.common[block]
        together = self._dirichlet(out, self.total[rows, None] + self.total[columns])
        return together - self.alone[rows, None] - self.alone[columns] + self.leaving[block]

    def _count_entries(self, node, sign):
        """Add (or take away) what the edges into a node contribute to the pairs of its predecessors."""
        before = self.counts[:, node].nonzero()[0]
        if len(before) > 1:
            block, c = (before[:, None], before), self.counts[before, node]
            self.common[block] += sign
            self.leaving[block] += sign * self._ways(c[:, None], c)

    def _count_exits(self, node, sign):
        """Add (or take away) what the edges out of a node contribute to the pairs of its successors."""
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


def _reachability(counts):
    """Which node reaches which over the edges (S, S); every node reaches itself."""
    reaches = np.eye(len(counts), dtype=bool)
    for node in reversed(_topological_order(counts, np.zeros(len(counts)))):
        reaches[node] |= reaches[np.flatnonzero(counts[node])].any(0)
    return reaches


def _topological_order(counts, place):
    """Nodes so that every edge leads onward; where the graph leaves it open, by place (S,), then by number."""
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


def _merge(labels, chains, prior):
    """Merge states best-first while the evidence grows: labels (M,) to labels."""
    return _Merging(labels, chains, prior).run()


# ---- aligning one demonstration with a graph


def _without(graph, chain, points):
    """The graph as it is without one demonstration, whose states are `chain` (L,) and subgoals `points` (L, 2)."""
    n, s, q, counts = graph.n.copy(), graph.s.copy(), graph.q.copy(), graph.counts.copy()
    n[chain] -= 1  # a demonstration visits no state twice
    s[chain] -= points
    q[chain] -= _outer(points)
    counts[_steps(chain)] -= 1
    return _Graph(n, s, q, counts)


def _emission_gains(graph, points, prior, table):
    """What each subgoal adds to the evidence in each state (L, S), and in a state of its own (L,)."""
    q, one = _outer(points), np.ones(len(points), int)
    before = _emission(graph.n, graph.s, graph.q, prior, table)
    after = _emission(graph.n + 1, graph.s + points[:, None], graph.q + q[:, None], prior, table)
    return after - before, _emission(one, points, q, prior, table)


def _edge_gains(counts):
    """What one more step adds to the evidence: along each edge u -> v (S, S), and along a new edge from u (S,)."""
    out, total = np.maximum((counts > 0).sum(1), 1), counts.sum(1)
    new = np.where(total > 0, np.log(out) - np.log(out + total) - np.log(out + total + 1), 0.0)
    return np.where(counts > 0, np.log(counts + 1) - np.log(out + total)[:, None], new[:, None]), new


def _align(points, place, graph, prior, table):
    """The states of a new demonstration that raise the evidence most: nodes (L,), -1 for a state of its own; the gain.

    Exact over all alignments that follow one topological order of the graph (so that it stays acyclic), because a
    demonstration visits a state at most once: each step of it adds its own term. With M_i(v) the best gain when
    subgoal i went to node v, and N_i(u) when it has a state of its own and u was the last node shared,

        M_i(v) = emission_i(v) + max over u before v of { M_{i-1}(u) + edge(u, v),  N_{i-1}(u) }
        N_i(u) = emission_i(own) + max { M_{i-1}(u) + new edge(u),  N_{i-1}(u) }
    """
    order = np.array(_topological_order(graph.counts, place))
    order = order[(graph.n[order] > 0) | (order < FIRST)]
    edge, new = _edge_gains(graph.counts[order[:, None], order])
    onward = np.arange(len(order))[:, None] > np.arange(len(order))
    shared, own = _emission_gains(graph, points, prior, table)
    shared[:, [START, END]] = -np.inf
    chain, gain = _best_alignment(shared[:, order], own, np.where(onward, edge.T, -np.inf), new)
    return np.where(chain < 0, -1, order[chain]), gain


def _best_alignment(shared, own, into, new):
    """The recursion of `_align`, nodes in topological order: edges `into` v from u (S, S), START first and END last."""
    nodes, steps = np.arange(len(new)), []
    matched, apart = np.where(nodes == 0, 0.0, -np.inf), np.full(len(new), -np.inf)
    for i in range(len(own) + 1):
        by_edge, anew = into + matched, _best_before(apart)
        came = by_edge.argmax(1)
        direct, left = by_edge[nodes, came], matched + new
        steps.append((came, anew, direct >= apart[anew], left >= apart))
        arrived = np.maximum(direct, apart[anew])
        if i < len(own):
            matched, apart = shared[i] + arrived, own[i] + np.maximum(left, apart)
    return _trace(steps), float(arrived[-1])


def _best_before(values):
    """For each place, where among those before it the highest value is (the first place gets itself)."""
    highest = np.where(values == np.maximum.accumulate(values), np.arange(len(values)), 0)
    return np.concatenate([[0], np.maximum.accumulate(highest)[:-1]])


def _trace(steps):
    """Follow the choices back from END: the node of each subgoal, -1 for a state of its own."""
    node, alone, chain = -1, False, []
    for came, anew, is_direct, just_left in reversed(steps):
        if alone:
            alone = not just_left[node]
        else:
            node, alone = (came[node], False) if is_direct[node] else (anew[node], True)
        chain.append(-1 if alone else node)
    return np.array(chain[-2::-1], int)


def _realigned(k, labels, chains, graph, prior, table):
    """Labels with demonstration k aligned afresh, and what that gains."""
    part = chains.slices[k]
    rest = _without(graph, labels[part], chains.points[part])
    place = _mean_place(labels, chains, len(graph.n), leave_out=part)
    aligned, gain = _align(chains.points[part], place, rest, prior, table)
    renewed = labels.copy()
    renewed[part] = np.where(aligned < 0, len(graph.n) + np.arange(len(aligned)), aligned)
    return _compact(renewed), gain - _share(labels[part], rest, graph, prior, table)


def _share(chain, rest, graph, prior, table):
    """What a demonstration adds to the evidence of the graph without it, `rest`, where it lies now."""
    touched = np.array([START, *chain])
    emissions = [_emission(g.n[chain], g.s[chain], g.q[chain], prior, table).sum() for g in (rest, graph)]
    transitions = [_transition(g.counts[touched]).sum() for g in (rest, graph)]
    return emissions[1] - emissions[0] + transitions[1] - transitions[0]


def _mean_place(labels, chains, size, leave_out=slice(0, 0)):
    """Where in their demonstrations the subgoals of each node come on average: (S,), in (0, 1)."""
    weight = np.ones(len(labels))
    weight[leave_out] = 0
    place = np.bincount(labels, weight * chains.place, size) / np.maximum(np.bincount(labels, weight, size), 1)
    place[[START, END]] = 0, 1
    return place


def _compact(labels):
    """The same partition, its labels numbered without gaps from FIRST."""
    return np.unique(labels, return_inverse=True)[1].reshape(-1) + FIRST


def _worst_explained_first(labels, chains, graph, prior, table):
    """Demonstrations in the order of what each adds to the evidence, per subgoal: an order that hangs on content."""
    shares = []
    for part in chains.slices:
        rest = _without(graph, labels[part], chains.points[part])
        shares.append(_share(labels[part], rest, graph, prior, table) / len(labels[part]))
    return np.argsort(shares, kind="stable")


def _realign(labels, chains, prior):
    """Align every demonstration afresh, in turn, until none gains any more."""
    table, graph = _emission_table(prior, len(labels) + 1), _graph(labels, chains)
    turn, idle = deque(_worst_explained_first(labels, chains, graph, prior, table)), 0
    while idle < len(turn):
        renewed, gain = _realigned(turn[0], labels, chains, graph, prior, table)
        if gain > LEAST_GAIN:
            labels, graph = renewed, _graph(renewed, chains)
        idle = 0 if gain > LEAST_GAIN else idle + 1
        turn.rotate(-1)
    return labels


def _rebuild(labels, chains, prior):
    """Take every demonstration out, and align them again one after another, the best explained first."""
    table = _emission_table(prior, len(labels) + 1)
    order = _worst_explained_first(labels, chains, _graph(labels, chains), prior, table)[::-1]
    rebuilt = np.full(len(labels), START)
    for k in order:
        part, graph = chains.slices[k], _graph(rebuilt, chains)
        place = _mean_place(rebuilt, chains, len(graph.n))
        aligned, _ = _align(chains.points[part], place, graph, prior, table)
        rebuilt[part] = np.where(aligned < 0, len(graph.n) + np.arange(len(aligned)), aligned)
    return _compact(rebuilt)


def _improve(labels, chains, prior):
    """Labels (M,) that neither aligning one demonstration afresh nor merging two states can improve."""
    improved = None
    while not np.array_equal(labels, improved):
        improved = _compact(_realign(_compact(labels), chains, prior))
        labels = _merge(improved, chains, prior)
    return improved


def _structure(chains, prior):
    """Labels (M,) by best-first merging, built anew from what that has taught as often as it helps, and improved."""
    labels = _compact(_merge(np.arange(len(chains.points)) + FIRST, chains, prior))
    while True:
        rebuilt = _improve(_rebuild(labels, chains, prior), chains, prior)
        gain = _evidence(rebuilt, chains, prior) - _evidence(labels, chains, prior)
        if gain <= LEAST_GAIN:
            return rebuilt if gain > -LEAST_GAIN else _improve(labels, chains, prior)
        labels = rebuilt


def _set_apart(labels, chains):
    """Give demonstrations that do something else states of their own, so that they draw nobody's subgoals aside.

    They may share those with each other. Taking them out can change the most-likely path, hence the repetition.
    """
    owner = np.repeat(np.arange(len(chains.slices)), [part.stop - part.start for part in chains.slices])
    apart = np.zeros(len(chains.slices), bool)
    while True:
        chain_of = [labels[part] for part in chains.slices]
        strangers = apart | (_coverage(chain_of, _path(_graph(labels, chains))) < LEAST_COVERAGE)
        if np.array_equal(strangers, apart):
            return labels
        apart = strangers
        labels = _compact(labels + apart[owner] * labels.max())


def _coverage(chains, path):
    """The share of the states of a path that each chain of states visits: (number of chains,)."""
    return np.array([np.isin(path, chain).mean() for chain in chains])


def _numbered(labels, chains):
    """Labels numbered so that every edge leads from a lower to a higher state; where that leaves it open, by place."""
    order = _topological_order(_graph(labels, chains).counts, _mean_place(labels, chains, labels.max() + 1))
    states = [node for node in order if node >= FIRST]
    rank = np.zeros(labels.max() + 1, int)
    rank[states] = np.arange(len(states))
    return rank[labels] + FIRST


# ---- the most-likely path


def _path(graph):
    """The nodes between START and END on the most probable way through; ties: fewer states, then more subgoals in them.

    Probabilities are multiplied as exact fractions, so that a tie is a tie. (What the states emit stays out: a density
    has units, and would reward or punish long paths by the choice of metres.)
    """
    totals, reach = graph.counts.sum(1), {START: (Fraction(1), 0, 0)}
    came = {}
    for node in _topological_order(graph.counts, np.zeros(len(totals))):
        if node not in reach:
            continue
        probability, length, visits = reach[node]
        for successor in np.flatnonzero(graph.counts[node]).tolist():
            share = Fraction(int(graph.counts[node, successor]), int(totals[node]))
            value = (probability * share, length - 1, visits + int(graph.n[successor]))
            if successor not in reach or value > reach[successor]:
                reach[successor], came[successor] = value, node
    path = [came[END]]
    while path[-1] != START:
        path.append(came[path[-1]])
    return np.array(path[-2::-1])


# ---- the public face


@dataclass(frozen=True)
class SubgoalHMM:
    """What several demonstrations have in common: a CDHMM over subgoals, acyclic, its structure estimated (Sec. V).

    States are numbered so that every edge leads from a lower to a higher one.

    Attributes
    ----------
    means : (S, 2) float array
        The subgoal each state stands for, in m: the mean of the subgoals merged into it.
    covariances : (S, 2, 2) float array
        How the subgoal of a state spreads, in m^2: the posterior mean, well defined from one subgoal on.
    transitions : (S, S) float array
        Probability of going from a state to another. Each row and its entry of `end` sum to one.
    start, end : (S,) float arrays
        Probability of beginning in a state (sums to one), and of ending after it.
    sequences : tuple of (K, 2) float arrays
        The subgoals of each demonstration, as given.
    states : tuple of (K,) int arrays
        The state of each of these subgoals. A demonstration visits no state twice.
    spread : float
        How far one subgoal is expected to lie from its mean along each axis, standard deviation in m.
    evidence : float
        Logarithm of the probability of all subgoals and of their order, in nats, with the parameters integrated out.

    Examples
    --------
    The second demonstration has one subgoal more, which is no part of the task:

    >>> task = [(0, 0), (2, 0), (2, 2), (0, 2)]
    >>> model = SubgoalHMM.fit([task, [(0.1, 0), (2, 0.1), (3, 1), (2.1, 2), (0, 2.1)]])
    >>> model.means[model.most_likely_path()].round(2).tolist()
    [[0.05, 0.0], [2.0, 0.05], [2.05, 2.0], [0.0, 2.05]]
    """

    means: np.ndarray
    covariances: np.ndarray
    transitions: np.ndarray
    start: np.ndarray
    end: np.ndarray
    sequences: tuple
    states: tuple
    spread: float
    evidence: float

    @classmethod
    def fit(cls, sequences, spread=0.15):
        """Estimate structure and parameters from the subgoals of each demonstration.

        Parameters
        ----------
        sequences : sequence of (K, 2) array_like
            The subgoals of each demonstration in order, in m, all in one environment. Lengths may differ.
        spread : float
            How far one subgoal is expected to lie from its mean along each axis, standard deviation in m. Two single
            subgoals are merged up to about four times this apart, less or more by what their neighbours say.

        Returns
        -------
        SubgoalHMM

        Raises
        ------
        ValueError
            No demonstration, one that is empty, not (K, 2) or not finite, or a spread that is not positive.
        """
        sequences = tuple(_checked(sequence, f"demonstration {k}") for k, sequence in enumerate(sequences))
        if not sequences:
            raise ValueError("sequences must hold at least one demonstration, got none")
        if not (np.isfinite(spread) and spread > 0):
            raise ValueError(f"spread must be positive and finite, got {spread}")
        chains = _chains(sequences)
        prior = _prior(chains.points, spread)
        labels = _numbered(_set_apart(_structure(chains, prior), chains), chains)
        return cls._of(labels, chains, prior, sequences, spread)

    @classmethod
    def _of(cls, labels, chains, prior, sequences, spread):
        graph = _graph(labels, chains)
        probability = graph.counts[:, FIRST:] / np.maximum(graph.counts.sum(1), 1)[:, None]
        means, covariances = _parameters(graph, prior)
        return cls(
            means=means + np.mean(np.concatenate(sequences), axis=0),
            covariances=covariances,
            transitions=probability[FIRST:],
            start=probability[START],
            end=graph.counts[FIRST:, END] / graph.counts[FIRST:].sum(1),
            sequences=sequences,
            states=tuple(labels[part] - FIRST for part in chains.slices),
            spread=float(spread),
            evidence=_evidence(labels, chains, prior),
        )

    def add(self, sequence):
        """The model of all demonstrations so far and one more, (K, 2) in m: the same as fitting all of them at once."""
        return SubgoalHMM.fit([*self.sequences, sequence], self.spread)

    def most_likely_path(self):
        """States of the most probable way from start to end, in order (L,): the task (Sec. V).

        Among equally probable ways the one of fewer states, then the one whose states hold more subgoals.
        """
        return _path(self._grown()[1]) - FIRST

    def coverage(self):
        """The share of the states on the most-likely path that each demonstration visits, (demonstrations,)."""
        return _coverage(self.states, self.most_likely_path())

    def outliers(self):
        """Demonstrations that do something else: they visit fewer than half of the states of the most-likely path.

        Returns
        -------
        tuple of int
            Their places in `sequences`. They share no state with the other demonstrations.
        """
        return tuple(np.flatnonzero(self.coverage() < LEAST_COVERAGE).tolist())

    def segments(self):
        """Which segments of which demonstrations run along each edge.

        Returns
        -------
        dict
            (from state, to state) to a list of (demonstration, segment). Segment i of a demonstration ends in its
            subgoal i; the first comes from the start, -1.
        """
        edges = {}
        for demonstration, states in enumerate(self.states):
            for segment, edge in enumerate(pairwise([-1, *states.tolist()])):
                edges.setdefault(edge, []).append((demonstration, segment))
        return edges

    def pooled(self, statistics):
        """Add up along each edge what segments have in common, so that one LDS describes all that were merged (Sec. V).

        Parameters
        ----------
        statistics : sequence of sequences
            `statistics[demonstration][segment]`, anything additive, for instance `dollop.lds.Statistics`.

        Returns
        -------
        dict
            (from state, to state) to the sum over the segments along that edge; from -1 is from the start.

        Raises
        ------
        ValueError
            Other numbers of demonstrations or segments than those of `sequences`.
        """
        given, held = [len(each) for each in statistics], [len(each) for each in self.sequences]
        if given != held:
            raise ValueError(f"statistics must have one entry per segment, {held} by demonstration, got {given}")
        return {
            edge: reduce(add, (statistics[demonstration][segment] for demonstration, segment in members))
            for edge, members in self.segments().items()
        }

    def states_of(self, sequence):
        """The states of another demonstration's subgoals, those that raise the evidence most (Viterbi).

        Parameters
        ----------
        sequence : (K, 2) array_like
            Subgoals in m, in the same environment.

        Returns
        -------
        (K,) int array
            -1 for a subgoal that is better explained by a state of its own. Steps that no demonstration has taken are
            possible, at the price of a new edge; only the order of the states is kept.

        Raises
        ------
        ValueError
            A sequence that is empty, not (K, 2) or not finite.
        """
        sequence = _checked(sequence, "sequence")
        chains, graph, place = self._grown()
        prior = _prior(chains.points, self.spread)
        table = _emission_table(prior, len(chains.points) + 1)
        centre = np.mean(np.concatenate(self.sequences), axis=0)
        nodes, _ = _align(sequence - centre, place, graph, prior, table)
        return np.where(nodes < 0, -1, nodes - FIRST)

    def log_likelihood(self, sequence):
        """Logarithm of the probability density that the model emits these subgoals, summed over all its paths.

        Parameters
        ----------
        sequence : (K, 2) array_like
            Subgoals in m, in the same environment.

        Returns
        -------
        float
            In nats; minus infinity where no path has that many states.

        Raises
        ------
        ValueError
            A sequence that is empty, not (K, 2) or not finite.
        """
        emissions = _log_normal(_checked(sequence, "sequence"), self.means, self.covariances)
        with np.errstate(divide="ignore"):
            start, steps, end = np.log(self.start), np.log(self.transitions), np.log(self.end)
        forward = start + emissions[0]
        for emission in emissions[1:]:
            forward = logsumexp(forward[:, None] + steps, axis=0) + emission
        return float(logsumexp(forward + end))

    def _grown(self):
        """The chains again, the graph of their states, and the mean place of its nodes."""
        chains, labels = _chains(self.sequences), np.concatenate(self.states) + FIRST
        return chains, _graph(labels, chains), _mean_place(labels, chains, labels.max() + 1)


def _parameters(graph, prior):
    """Mean of the subgoals of each state (S, 2), and the posterior mean of its covariance (S, 2, 2)."""
    n, s, q = graph.n[FIRST:, None], graph.s[FIRST:], graph.q[FIRST:]
    scatter = q - _outer(s) / (prior.kappa + n) + prior.psi * np.array([1, 0, 1])
    covariances = scatter / (prior.nu + n - 3)
    return s / n, covariances[:, [0, 1, 1, 2]].reshape(-1, 2, 2)


def _log_normal(points, means, covariances):
    """Logarithm of the normal density of each point (L, 2) in each state: (L, S)."""
    offsets = points[:, None] - means
    distance = np.einsum("lsi,sij,lsj->ls", offsets, np.linalg.inv(covariances), offsets)
    return -0.5 * (distance + np.linalg.slogdet(covariances)[1]) - np.log(2 * np.pi)


def _checked(sequence, name):
    sequence = np.array(sequence, float)
    if sequence.ndim != 2 or sequence.shape[1] != 2 or not len(sequence):
        raise ValueError(f"{name} must hold at least one subgoal, as (K, 2), got shape {sequence.shape}")
    if not np.isfinite(sequence).all():
        raise ValueError(f"{name} must be finite, got {sequence[~np.isfinite(sequence).all(1)][0]}")
    return sequence
