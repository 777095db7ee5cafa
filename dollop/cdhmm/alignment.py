"""The structure of a CDHMM (Sec. V): merging, and two moves that put right what merging errs in.

Best-first merging alone can err early, where a path crosses itself or an odd subgoal comes near a
later one, and what it merged then keeps other pairs apart. So two moves follow, kept only if the
evidence grows: all demonstrations are taken out and aligned with the growing graph one after
another, and each is aligned afresh with what the others built.
"""

from collections import deque
from fractions import Fraction

import numpy as np

from dollop.cdhmm.evidence import (
    END,
    FIRST,
    LEAST_GAIN,
    START,
    Graph,
    emission_evidence,
    emission_table,
    evidence_of,
    graph_of,
    outer_products,
    steps_of,
    transition_evidence,
)
from dollop.cdhmm.merging import merge_states, topological_order

__all__ = [
    "LEAST_COVERAGE",
    "align_chain",
    "coverage_of",
    "earliest",
    "estimate_structure",
    "mean_place",
    "numbered",
    "path_through",
    "set_apart",
]

LEAST_COVERAGE = 0.5  # of the states on the most-likely path: who visits fewer does something else


def graph_without(graph, chain, points):
    """The graph as it is without one demonstration, whose states are `chain` (L,) and subgoals
    `points` (L, 2).
    """
    n, s, q, counts = graph.n.copy(), graph.s.copy(), graph.q.copy(), graph.counts.copy()
    n[chain] -= 1  # a demonstration visits no state twice
    s[chain] -= points
    q[chain] -= outer_products(points)
    counts[steps_of(chain)] -= 1
    return Graph(n, s, q, counts)


def emission_gains(graph, points, prior, table):
    """What each subgoal adds to the evidence in each state (L, S), and in a state of its own (L,)."""
    q, one = outer_products(points), np.ones(len(points), int)
    before = emission_evidence(graph.n, graph.s, graph.q, prior, table)
    after = emission_evidence(graph.n + 1, graph.s + points[:, None], graph.q + q[:, None], prior, table)
    return after - before, emission_evidence(one, points, q, prior, table)


def edge_gains(counts):
    """What one more step adds to the evidence: along each edge u -> v (S, S), and along a new edge
    from u (S,).
    """
    out, total = np.maximum((counts > 0).sum(1), 1), counts.sum(1)
    new = np.where(total > 0, np.log(out) - np.log(out + total) - np.log(out + total + 1), 0.0)
    return np.where(counts > 0, np.log(counts + 1) - np.log(out + total)[:, None], new[:, None]), new


def align_chain(points, place, graph, prior, table):
    """The states of a new demonstration that raise the evidence most: nodes (L,), -1 for a state of
    its own; the gain.

    Exact over all alignments that follow one topological order of the graph (so that it stays
    acyclic), because a demonstration visits a state at most once: each step of it adds its own
    term. With M_i(v) the best gain when subgoal i went to node v, and N_i(u) when it has a state of
    its own and u was the last node shared,

        M_i(v) = emission_i(v) + max over u before v of { M_{i-1}(u) + edge(u, v),  N_{i-1}(u) }
        N_i(u) = emission_i(own) + max { M_{i-1}(u) + new edge(u),  N_{i-1}(u) }
    """
    order = np.array(topological_order(graph.counts, place))
    order = order[(graph.n[order] > 0) | (order < FIRST)]
    edge, new = edge_gains(graph.counts[order[:, None], order])
    onward = np.arange(len(order))[:, None] > np.arange(len(order))
    shared, own = emission_gains(graph, points, prior, table)
    shared[:, [START, END]] = -np.inf
    chain, gain = best_alignment(shared[:, order], own, np.where(onward, edge.T, -np.inf), new)
    return np.where(chain < 0, -1, order[chain]), gain


def best_alignment(shared, own, into, new):
    """The recursion of `align_chain` over nodes in topological order, START first; edges `into` v
    from u (S, S).
    """
    nodes, steps = np.arange(len(new)), []
    matched, apart = np.where(nodes == 0, 0.0, -np.inf), np.full(len(new), -np.inf)
    for i in range(len(own) + 1):
        by_edge, anew = into + matched, best_before(apart)
        came = by_edge.argmax(1)
        direct, left = by_edge[nodes, came], matched + new
        steps.append((came, anew, direct >= apart[anew], left >= apart))
        arrived = np.maximum(direct, apart[anew])
        if i < len(own):
            matched, apart = shared[i] + arrived, own[i] + np.maximum(left, apart)
    return trace_back(steps), float(arrived[-1])


def best_before(values):
    """For each place, where among those before it the highest value is (the first place gets
    itself).
    """
    highest = np.where(values == np.maximum.accumulate(values), np.arange(len(values)), 0)
    return np.concatenate([[0], np.maximum.accumulate(highest)[:-1]])


def trace_back(steps):
    """Follow the choices back from END: the node of each subgoal, -1 for a state of its own."""
    node, alone, chain = -1, False, []
    for came, anew, is_direct, just_left in reversed(steps):
        if alone:
            alone = not just_left[node]
        else:
            node, alone = (came[node], False) if is_direct[node] else (anew[node], True)
        chain.append(-1 if alone else node)
    return np.array(chain[-2::-1], int)


def realigned(k, labels, chains, graph, prior, table):
    """Labels with demonstration k aligned afresh, and what that gains."""
    part = chains.slices[k]
    rest = graph_without(graph, labels[part], chains.points[part])
    place = mean_place(labels, chains, len(graph.n), leave_out=part)
    aligned, gain = align_chain(chains.points[part], place, rest, prior, table)
    renewed = labels.copy()
    renewed[part] = np.where(aligned < 0, len(graph.n) + np.arange(len(aligned)), aligned)
    return compact(renewed), gain - shared_evidence(labels[part], rest, graph, prior, table)


def shared_evidence(chain, rest, graph, prior, table):
    """What a demonstration adds to the evidence of the graph without it, `rest`, where it lies now."""
    touched = np.array([START, *chain])
    emissions = [emission_evidence(g.n[chain], g.s[chain], g.q[chain], prior, table).sum() for g in (rest, graph)]
    transitions = [transition_evidence(g.counts[touched]).sum() for g in (rest, graph)]
    return emissions[1] - emissions[0] + transitions[1] - transitions[0]


def mean_place(labels, chains, size, leave_out=slice(0, 0)):
    """Where in their demonstrations the subgoals of each node come on average: (S,), in (0, 1)."""
    weight = np.ones(len(labels))
    weight[leave_out] = 0
    place = np.bincount(labels, weight * chains.place, size) / np.maximum(np.bincount(labels, weight, size), 1)
    place[[START, END]] = 0, 1
    return place


def compact(labels):
    """The same partition, its labels numbered without gaps from FIRST."""
    return np.unique(labels, return_inverse=True)[1].reshape(-1) + FIRST


def worst_explained_first(labels, chains, graph, prior, table):
    """Demonstrations in the order of what each adds to the evidence, per subgoal: an order that
    hangs on content.
    """
    shares = []
    for part in chains.slices:
        rest = graph_without(graph, labels[part], chains.points[part])
        shares.append(shared_evidence(labels[part], rest, graph, prior, table) / len(labels[part]))
    return np.argsort(shares, kind="stable")


def realign(labels, chains, prior):
    """Align every demonstration afresh, in turn, until none gains any more."""
    table, graph = emission_table(prior, len(labels) + 1), graph_of(labels, chains)
    turn, idle = deque(worst_explained_first(labels, chains, graph, prior, table)), 0
    while idle < len(turn):
        renewed, gain = realigned(turn[0], labels, chains, graph, prior, table)
        if gain > LEAST_GAIN:
            labels, graph = renewed, graph_of(renewed, chains)
        idle = 0 if gain > LEAST_GAIN else idle + 1
        turn.rotate(-1)
    return labels


def rebuild(labels, chains, prior):
    """Take every demonstration out, and align them again one after another, the best explained
    first.
    """
    table = emission_table(prior, len(labels) + 1)
    order = worst_explained_first(labels, chains, graph_of(labels, chains), prior, table)[::-1]
    rebuilt = np.full(len(labels), START)
    for k in order:
        part, graph = chains.slices[k], graph_of(rebuilt, chains)
        place = mean_place(rebuilt, chains, len(graph.n))
        aligned, _ = align_chain(chains.points[part], place, graph, prior, table)
        rebuilt[part] = np.where(aligned < 0, len(graph.n) + np.arange(len(aligned)), aligned)
    return compact(rebuilt)


def improve(labels, chains, prior):
    """Labels (M,) that neither aligning one demonstration afresh nor merging two states can
    improve.
    """
    improved = None
    while not np.array_equal(labels, improved):
        improved = compact(realign(compact(labels), chains, prior))
        labels = merge_states(improved, chains, prior)
    return improved


def estimate_structure(chains, prior):
    """Labels (M,) by best-first merging, built anew from what that has taught as often as it helps,
    and improved.
    """
    labels = compact(merge_states(np.arange(len(chains.points)) + FIRST, chains, prior))
    while True:
        rebuilt = improve(rebuild(labels, chains, prior), chains, prior)
        gain = evidence_of(rebuilt, chains, prior) - evidence_of(labels, chains, prior)
        if gain <= LEAST_GAIN:
            return rebuilt if gain > -LEAST_GAIN else improve(labels, chains, prior)
        labels = rebuilt


def set_apart(labels, chains):
    """Give demonstrations that do something else states of their own, so that they draw nobody's
    subgoals aside.

    They may share those with each other. Taking them out can change the most-likely path, hence the
    repetition.
    """
    owner = np.repeat(np.arange(len(chains.slices)), [part.stop - part.start for part in chains.slices])
    apart = np.zeros(len(chains.slices), bool)
    while True:
        chain_of = [labels[part] for part in chains.slices]
        path = path_through(graph_of(labels, chains), earliest(labels, chains))
        strangers = apart | (coverage_of(chain_of, path) < LEAST_COVERAGE)
        if np.array_equal(strangers, apart):
            return labels
        apart = strangers
        labels = compact(labels + apart[owner] * labels.max())


def coverage_of(chains, path):
    """The share of the states of a path that each chain of states visits: (number of chains,)."""
    return np.array([np.isin(path, chain).mean() for chain in chains])


def numbered(labels, chains):
    """Labels numbered so that every edge leads from a lower to a higher state; where that leaves it
    open, by place.
    """
    order = topological_order(graph_of(labels, chains).counts, mean_place(labels, chains, labels.max() + 1))
    states = [node for node in order if node >= FIRST]
    rank = np.zeros(labels.max() + 1, int)
    rank[states] = np.arange(len(states))
    return rank[labels] + FIRST


def earliest(labels, chains):
    """The first demonstration that visits each node: (number of nodes,) for labels (M,)."""
    first = np.full(labels.max() + 1, len(chains.slices))
    for k, part in reversed(list(enumerate(chains.slices))):
        first[labels[part]] = k
    return first


def path_through(graph, first):
    """The nodes between START and END on the most probable way through.

    Probabilities are multiplied as exact fractions, so that a tie is a tie. (What the states emit
    stays out: a density has units, and would reward or punish long paths by the choice of metres.)
    Ties go to the way of fewer states, then to that with more subgoals in them, then to that of the
    demonstration given earlier, `first` (S,) per node.
    """
    totals, reach = graph.counts.sum(1), {START: (Fraction(1), 0, 0, 0)}
    came = {}
    for node in topological_order(graph.counts, np.zeros(len(totals))):
        if node not in reach:
            continue
        probability, length, visits, lateness = reach[node]
        for successor in np.flatnonzero(graph.counts[node]).tolist():
            share = Fraction(int(graph.counts[node, successor]), int(totals[node]))
            late = 0 if successor == END else int(first[successor])
            value = (probability * share, length - 1, visits + int(graph.n[successor]), lateness - late)
            if successor not in reach or value > reach[successor]:
                reach[successor], came[successor] = value, node
    path = [came[END]]
    while path[-1] != START:
        path.append(came[path[-1]])
    return np.array(path[-2::-1])
