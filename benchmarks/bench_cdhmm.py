"""How long merging demonstrations takes, beside a plain loop: python -m benchmarks cdhmm."""

import tracemalloc
from math import inf, lgamma, log, pi

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lab.drawn import draw_demonstrations
from dollop.replication.baseline import merged

TASK = np.random.default_rng(0).uniform(-4, 4, (10, 2))  # ten subgoals in a room of 8 m
CASES = ((10, 0.04, 15), (100, 1.0, 3), (1000, 10.0, 1))  # demonstrations, bound in s, repetitions
SPREADS = {"named": 0.15, "estimated": None}  # m


def run():
    """Time merging with the most-likely path, as the comparison of learners calls it.

    Returns
    -------
    list of dict
        The plain loop only where it ends in reasonable time; the peak of memory of the largest case.
    """
    rows = []
    for n, bound, repeats in CASES:
        demonstrations = draw_demonstrations(TASK, n, 0.1, seed=1)
        baseline = seconds(lambda shown=demonstrations: plain_loop(shown), 1)[0] if n <= 10 else None
        for how, spread in SPREADS.items():
            median, _ = seconds(lambda shown=demonstrations, told=spread: merged(shown, told), repeats)
            name = f"merge {n} demonstrations of 10 subgoals, spread {how}"
            if n == 1000:
                name += f", peak {peak_memory(demonstrations, spread):.0f} MiB"
            rows.append(row(name, median, baseline, bound))
    return rows


def peak_memory(demonstrations, spread):
    """The most memory that merging held at once, beyond what was held before, in MiB."""
    tracemalloc.start()
    try:
        merged(demonstrations, spread)
        return tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()


def plain_loop(demonstrations, spread=0.15):
    """Best-first merging as it is written down: the gain of every pair, computed anew for every merge.

    Only the merging: `SubgoalHMM.fit` also aligns demonstrations afresh.
    """
    centre = np.concatenate(demonstrations).mean(0)
    kappa = spread**2 / np.mean((np.concatenate(demonstrations) - centre) ** 2)
    states, steps = chains([(demonstration - centre).tolist() for demonstration in demonstrations])
    while True:
        gain, pair = best_pair(states, steps, kappa, spread)
        if gain <= 0:
            return states
        join(states, steps, *pair)


def chains(demonstrations):
    """State number to its subgoals; node to its successors and their counts. The start is -1, the end -2."""
    states, steps = {}, {-1: {}, -2: {}}
    for demonstration in demonstrations:
        before = -1
        for subgoal in demonstration:
            state = len(states)
            states[state], steps[state], steps[before][state] = [subgoal], {}, 1
            before = state
        steps[before][-2] = 1
    return states, steps


def best_pair(states, steps, kappa, spread):
    below = {state: reached(state, steps) for state in states}
    alone = {state: emission(subgoals, kappa, spread) for state, subgoals in states.items()}
    best = (-inf, None)
    for u in states:
        for v in states:
            if u < v and v not in below[u] and u not in below[v]:
                gain = emission(states[u] + states[v], kappa, spread) - alone[u] - alone[v]
                best = max(best, (gain + transition_gain(u, v, steps), (u, v)))
    return best


def reached(node, steps):
    found, waiting = set(), [node]
    while waiting:
        for successor in steps[waiting.pop()]:
            if successor not in found:
                found.add(successor)
                waiting.append(successor)
    return found


def emission(subgoals, kappa, spread):
    n, nu, psi = len(subgoals), 8.0, 5 * spread**2
    x, y = sum(p[0] for p in subgoals), sum(p[1] for p in subgoals)
    xx = psi + sum(p[0] * p[0] for p in subgoals) - x * x / (kappa + n)
    xy = sum(p[0] * p[1] for p in subgoals) - x * y / (kappa + n)
    yy = psi + sum(p[1] * p[1] for p in subgoals) - y * y / (kappa + n)
    gammas = lgamma((nu + n) / 2) + lgamma((nu + n - 1) / 2) - lgamma(nu / 2) - lgamma((nu - 1) / 2)
    prior = nu * log(psi) + log(kappa / (kappa + n))
    return gammas + prior - n * log(pi) - (nu + n) / 2 * log(xx * yy - xy * xy)


def transition_gain(u, v, steps):
    gain = dirichlet(added(steps[u], steps[v])) - dirichlet(steps[u]) - dirichlet(steps[v])
    for successors in steps.values():
        if u in successors and v in successors:
            gain += dirichlet(joined(successors, u, v)) - dirichlet(successors)
    return gain


def dirichlet(counts):
    if not counts:
        return 0.0
    return (
        lgamma(len(counts)) - lgamma(len(counts) + sum(counts.values())) + sum(lgamma(c + 1) for c in counts.values())
    )


def added(one, other):
    return {node: one.get(node, 0) + other.get(node, 0) for node in one | other}


def joined(successors, u, v):
    return added({node: c for node, c in successors.items() if node != v}, {u: successors[v]})


def join(states, steps, u, v):
    states[u] += states.pop(v)
    steps[u] = added(steps[u], steps.pop(v))
    for node, successors in steps.items():
        if v in successors:
            steps[node] = joined(successors, u, v)
