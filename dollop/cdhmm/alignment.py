"""The structure of a CDHMM (Sec. V): merging, and two moves that put right what merging errs in.

Best-first merging alone can err early, where a path crosses itself or an odd subgoal comes near a
later one, and what it merged then keeps other pairs apart. So two moves follow, kept only if the
evidence grows: all demonstrations are taken out and aligned with the growing graph one after
another, and each is aligned afresh with what the others built.

Throughout, *labels* (M,) are the nodes of all subgoals, and *chains* are those subgoals, as
`dollop.cdhmm.evidence.chains_of` has them.
"""

from fractions import Fraction
from itertools import cycle

import numpy as np

from dollop.cdhmm.evidence import (
    END,
    FIRST,
    LEAST_GAIN,
    START,
    Graph,
    emission_evidence,
    evidence_of,
    graph_of,
    outer_products,
    transition_evidence,
)
from dollop.cdhmm.merging import merge_states, topological_order

LEAST_COVERAGE = 0.5  # of the states on the most-likely path: who visits fewer does something else


def _emission_gains(graph, points, prior):
    """What subgoals add to the evidence in each state (L, S), and in states of their own (L,)."""
    q, one = outer_products(points), np.ones(len(points), int)
    before = emission_evidence(graph.n, graph.s, graph.q, prior)
    n, s, q_with = graph.n + 1, graph.s + points[:, None], graph.q + q[:, None]
    return emission_evidence(n, s, q_with, prior) - before, emission_evidence(one, points, q, prior)


def edge_gains(into):
    """What one more step adds to the evidence, along each edge and along a new one (Sec. V).

    Parameters
    ----------
    into : (S, S) int array
        How often each edge was taken, to row from column.

    Returns
    -------
    after, before : (E,) int arrays
        The nodes of each edge, those to one node together.
    along : (E,) float array
        In nats.
    anew : (S,) float array
        Along a new edge from each node, in nats.
    """
    out, total = np.maximum(np.count_nonzero(into, axis=0), 1), into.sum(0)
    anew = np.where(total > 0, np.log(out) - np.log(out + total) - np.log(out + total + 1), 0.0)
    after, before = into.nonzero()
    along = np.log(into[after, before] + 1) - np.log(out + total)[before]
    return after, before, along, anew


def align_chain(points, graph, labels, chains):
    """The states of a new demonstration that raise the evidence most (Sec. V; reconstruction).

    Exact over all alignments that follow one topological order of the graph (so that it stays
    acyclic), because a demonstration visits a state at most once: each step of it adds its own
    term. With M_i(v) the best gain when subgoal i went to node v, and N_i(u) when it has a state of
    its own and u was the last node shared,

        M_i(v) = emission_i(v) + max over u before v of { M_{i-1}(u) + edge(u, v),  N_{i-1}(u) }
        N_i(u) = emission_i(own) + max { M_{i-1}(u) + new edge(u),  N_{i-1}(u) }

    Parameters
    ----------
    points : (L, 2) float array
        The new subgoals in m, from the centre of the chains.
    graph : Graph
        Of S nodes, without the new demonstration.
    labels, chains : (M,) int array and record
        What the graph was made of.

    Returns
    -------
    nodes : (L,) int array
        -1 for a state of its own.
    gain : float
        Of evidence, in nats.
    """
    order = np.array(topological_order(graph.counts, mean_place(labels, chains, len(graph.n))))
    order = order[(graph.n[order] > 0) | (order < FIRST)]
    shared, own = _emission_gains(graph, points, chains.prior)
    shared[:, [START, END]] = -np.inf
    edges = edge_gains(graph.counts.T[order[:, None], order])
    places, gain = best_alignment(shared[:, order], own, *edges)
    return np.where(places < 0, -1, order[places]), gain


def best_alignment(shared, own, after, before, along, anew):
    """The recursion of `align_chain` (Sec. V).

    Nodes are in topological order, START first, END last. An edge that there is gains more than a
    new one, so that of the nodes before v only the best needs to be known, and the edges into v.

    Parameters
    ----------
    shared, own : (L, S) and (L,) float arrays
        What subgoals gain in each node, and in a state of their own, in nats.
    after, before, along, anew : arrays
        The `edge_gains` of the nodes.

    Returns
    -------
    places : (L,) int array
        -1 for a state of its own.
    gain : float
        In nats.
    """
    groups = np.flatnonzero(np.diff(after, prepend=-1))
    heads, into = after[groups], np.full(len(anew), -np.inf)
    matched, apart = np.full((2, len(own) + 1, len(anew)), -np.inf)
    matched[0, 0] = 0.0
    for i in range(len(own)):
        left = matched[i] + anew
        into[heads] = np.maximum.reduceat(matched[i][before] + along, groups)
        np.maximum(left, apart[i], out=left)
        arrived = np.maximum.accumulate(left)[:-1]
        np.maximum(arrived, into[1:], out=arrived)
        np.add(shared[i, 1:], arrived, out=matched[i + 1, 1:])
        np.add(own[i], left, out=apart[i + 1])
    return _traced_back(matched, apart, after, before, along, anew)


def _traced_back(matched, apart, after, before, along, anew):
    """Which node each subgoal went to, back from END, and the whole gain."""
    node, alone, chain, gain = len(anew) - 1, False, [], None
    for i in range(len(matched) - 1, -1, -1):
        if alone:
            alone = matched[i, node] + anew[node] < apart[i, node]
        else:
            node, alone, best = _came_from(node, matched[i], apart[i], after, before, along, anew)
            gain = best if gain is None else gain
        chain.append(-1 if alone else node)
    return np.array(chain[-2::-1], int), float(gain)


def _came_from(node, matched, apart, after, before, along, anew):
    """The last node shared before a node, whether a subgoal lies in between, and the gain there.

    Of equals an edge or a new one goes before a subgoal apart; then the first node, or the last.
    """
    direct = matched[:node] + anew[:node]
    edges = slice(*np.searchsorted(after, [node, node + 1]))
    direct[before[edges]] = matched[before[edges]] + along[edges]
    came, last = int(direct.argmax()), node - 1 - int(apart[node - 1 :: -1].argmax())
    if direct[came] >= apart[last]:
        return came, False, direct[came]
    return last, True, apart[last]


def _taken_out(k, labels, chains, graph):
    """The graph without demonstration k, and what that adds to the evidence where it lies."""
    part, prior = chains.slices[k], chains.prior
    chain, points = labels[part], chains.points[part]
    n, s, q, counts = graph.n.copy(), graph.s.copy(), graph.q.copy(), graph.counts.copy()
    n[chain] -= 1  # a demonstration visits no state twice
    s[chain] -= points
    q[chain] -= outer_products(points)
    left = np.append(START, chain)
    counts[left, np.append(chain, END)] -= 1
    rest = Graph(n, s, q, counts)
    both = rest, graph
    emissions = [emission_evidence(g.n[chain], g.s[chain], g.q[chain], prior).sum() for g in both]
    transitions = [transition_evidence(g.counts[left]).sum() for g in both]
    return rest, emissions[1] - emissions[0] + transitions[1] - transitions[0]


def _aligned(k, labels, chains, graph):
    """Labels with demonstration k aligned with a graph without it, and what that gains."""
    part, size = chains.slices[k], len(graph.n)
    renewed = labels.copy()
    renewed[part] = START
    nodes, gain = align_chain(chains.points[part], graph, renewed, chains)
    renewed[part] = np.where(nodes < 0, size + np.arange(len(nodes)), nodes)
    return renewed, gain


def mean_place(labels, chains, size):
    """Where in their demonstrations the subgoals of each node come on average (Sec. V).

    Parameters
    ----------
    labels, chains : (M,) int array and record
    size : int
        The number S of nodes.

    Returns
    -------
    (S,) float array
        Between 0, the start, and 1, the end.
    """
    number = np.bincount(labels, minlength=size)
    place = np.bincount(labels, chains.place, size) / np.maximum(number, 1)
    place[[START, END]] = 0, 1
    return place


def compact(labels):
    """The same partition, its labels numbered without gaps from FIRST (Sec. V).

    Parameters
    ----------
    labels : (M,) int array

    Returns
    -------
    (M,) int array

    Examples
    --------
    >>> compact(np.array([7, 9, 7, 3])).tolist()
    [3, 4, 3, 2]
    """
    return np.unique(labels, return_inverse=True)[1].reshape(-1) + FIRST


def _worst_explained_first(labels, chains):
    """Demonstrations by what each adds to the evidence per subgoal: an order by content."""
    graph = graph_of(labels, chains)
    added = [_taken_out(k, labels, chains, graph)[1] for k in range(len(chains.slices))]
    return np.argsort(added / np.bincount(chains.owner), kind="stable")


def _realign(labels, chains):
    """Align every demonstration afresh, in turn, until none gains any more."""
    graph, idle = graph_of(labels, chains), 0
    order = _worst_explained_first(labels, chains)
    for k in cycle(order):
        rest, before = _taken_out(k, labels, chains, graph)
        renewed, after = _aligned(k, labels, chains, rest)
        idle += 1
        if after - before > LEAST_GAIN:
            labels, idle = compact(renewed), 0
            graph = graph_of(labels, chains)
        if idle == len(order):
            return labels


def _rebuild(labels, chains):
    """Take every demonstration out, and align them again in turn, the best explained first."""
    rebuilt = np.full(len(labels), START)
    for k in _worst_explained_first(labels, chains)[::-1]:
        rebuilt, _ = _aligned(k, rebuilt, chains, graph_of(rebuilt, chains))
    return compact(rebuilt)


def _improve(labels, chains):
    """Labels that neither aligning one demonstration afresh nor merging two states can improve."""
    improved = None
    while not np.array_equal(labels, improved):
        improved = _realign(compact(labels), chains)
        labels = merge_states(improved, chains)
    return improved


def estimate_structure(chains):
    """Best-first merging, built anew from what it has taught as often as that helps (Sec. V).

    The moves beyond merging are a reconstruction.

    Parameters
    ----------
    chains : record
        Of M subgoals.

    Returns
    -------
    (M,) int array
        Labels, numbered without gaps.
    """
    labels = compact(merge_states(np.arange(len(chains.points)) + FIRST, chains))
    while True:
        rebuilt = _improve(_rebuild(labels, chains), chains)
        gain = evidence_of(rebuilt, chains) - evidence_of(labels, chains)
        if gain <= LEAST_GAIN:
            return rebuilt if gain > -LEAST_GAIN else _improve(labels, chains)
        labels = rebuilt


def set_apart(labels, chains):
    """Give demonstrations that do something else states of their own (beyond the paper).

    So they draw nobody's subgoals aside. They may share states with each other. Taking them out can
    change the most-likely path, hence the repetition.

    Parameters
    ----------
    labels, chains : (M,) int array and record

    Returns
    -------
    (M,) int array
        Labels.
    """
    apart = np.zeros(len(chains.slices), bool)
    while True:
        path = path_through(labels, chains)
        coverage = coverage_of([labels[part] for part in chains.slices], path)
        strangers = apart | (coverage < LEAST_COVERAGE)
        if np.array_equal(strangers, apart):
            return labels
        apart = strangers
        labels = compact(labels + apart[chains.owner] * labels.max())


def coverage_of(states, path):
    """The share of the states of a path that each demonstration visits (beyond the paper).

    Parameters
    ----------
    states : sequence of (K,) int arrays
        Those of D demonstrations.
    path : (L,) int array

    Returns
    -------
    (D,) float array
        Between 0 and 1.
    """
    return np.array([np.isin(path, visited).mean() for visited in states])


def numbered(labels, chains):
    """Labels numbered so that every edge leads from a lower to a higher state (Sec. V).

    Where that leaves the order open, it is by the mean place in the demonstrations.

    Parameters
    ----------
    labels, chains : (M,) int array and record
        Numbered without gaps.

    Returns
    -------
    (M,) int array
        Labels.
    """
    counts = graph_of(labels, chains).counts
    order = topological_order(counts, mean_place(labels, chains, len(counts)))
    return np.argsort(order)[labels] - 1 + FIRST  # the order begins with START and ends with END


def path_through(labels, chains):
    """The nodes between START and END on the most probable way through the graph (Sec. V).

    Probabilities are multiplied as exact fractions, so that a tie is a tie. (What the states emit
    stays out: a density has units, and would reward or punish long paths by the choice of metres.)
    Ties go to the way of fewer states, then to that with more subgoals in them, then to that of the
    demonstration given earlier.

    Parameters
    ----------
    labels, chains : (M,) int array and record
        Numbered without gaps.

    Returns
    -------
    (L,) int array
        In order.
    """
    graph = graph_of(labels, chains)
    totals, n = graph.counts.sum(1).tolist(), graph.n.tolist()
    first = np.full(len(n), len(chains.slices))
    np.minimum.at(first, labels, chains.owner)
    late = np.append([0, 0], first[FIRST:]).tolist()
    reach, came = {START: (Fraction(1), 0, 0, 0)}, {}
    for node in topological_order(graph.counts, np.zeros(len(n))):
        probability, length, visits, earliness = reach[node]
        for after in np.flatnonzero(graph.counts[node]).tolist():
            share = Fraction(int(graph.counts[node, after]), totals[node])
            value = probability * share, length - 1, visits + n[after], earliness - late[after]
            if after not in reach or value > reach[after]:
                reach[after], came[after] = value, node
    path = [came[END]]
    while path[-1] != START:
        path.append(came[path[-1]])
    return np.array(path[-2::-1])
