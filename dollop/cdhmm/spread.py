"""How far subgoals scatter, told by the demonstrations themselves (beyond the paper).

The spread is a parameter like any other: what scatter makes the demonstrations most evident? Two
of them merge as `dollop.cdhmm.alignment` aligns a chain with a graph, here with the chain of the
other, so that for each pair and each spread the best of all alignments is found exactly. The gains
of evidence over leaving them apart are averaged over pairs, and count once per demonstration beyond
the first; a log-normal prior says what is usual. One demonstration, or several with nothing in
common, say nothing, and the usual spread is left.
"""

from dataclasses import dataclass, replace

import numpy as np

from dollop.cdhmm.evidence import emission_evidence, outer_products, prior_over

__all__ = ["Expected", "by_content", "estimate_spread", "spaced"]

FEW = 8  # demonstrations compared: of six subgoals each, their pairs tell a spread within 8 %
MOST_CELLS = 30_000  # pairs of subgoals compared, for time and memory, unless two have more
N_SPREADS = 12  # from the least to the most in steps of a third, among which is interpolated
PARTING = -np.log(6.0)  # nats: a step of one demonstration that leaves the chain of another


@dataclass(frozen=True)
class Expected:
    """What spreads to expect before any demonstration, standard deviations along each axis.

    Attributes
    ----------
    usual : float
        In m: what is taken where the demonstrations say nothing.
    least, most : float
        In m. Below a few centimetres it is the laser that scatters; walked subgoals scatter by 0.07
        to 0.54 m, and beyond 0.6 m different places would be taken for one.
    deviation : float
        Standard deviation of the logarithm: half the logarithm of 0.54 / 0.15, so that the widest
        scatter measured lies two deviations off.
    """

    usual: float = 0.15
    least: float = 0.03
    most: float = 0.6
    deviation: float = 0.64

    def log_density(self, spread):
        """How probable spreads are, up to a constant.

        Parameters
        ----------
        spread : (G,) float array
            In m.

        Returns
        -------
        (G,) float array
            In nats.
        """
        return -0.5 * (np.log(spread / self.usual) / self.deviation) ** 2


def by_content(sequences):
    """Demonstrations in an order that depends on what they show, not on when (beyond the paper).

    Parameters
    ----------
    sequences : sequence of (K, 2) float arrays
        Subgoals in m.

    Returns
    -------
    (D,) int array
        By the length of the way through all subgoals; among equals as given.
    """
    lengths = [np.linalg.norm(np.diff(sequence, axis=0), axis=1).sum() for sequence in sequences]
    return np.argsort(lengths, kind="stable")


def spaced(total, number):
    """Places evenly spaced among some: a cross-section of things in order (beyond the paper).

    Parameters
    ----------
    total : int
        How many there are.
    number : int
        How many to take, at least one.

    Returns
    -------
    (number,) int array
        All where there are no more.

    Examples
    --------
    >>> spaced(9, 3), spaced(2, 3)
    (array([1, 4, 7]), array([0, 1]))
    """
    number = min(number, total)
    return (2 * np.arange(number) + 1) * total // (2 * number)


def estimate_spread(sequences, expected=None):
    """The spread that makes demonstrations most evident (beyond the paper).

    Parameters
    ----------
    sequences : sequence of (K, 2) float arrays
        Subgoals of each demonstration in m, one at least.
    expected : Expected, optional
        What spreads to expect.

    Returns
    -------
    float
        Standard deviation along each axis in m: `expected.usual` where the demonstrations say
        nothing, and within `expected.least` and `expected.most`.

    Examples
    --------
    Subgoals that scatter by 0.3 m, five times, and once, which says nothing:

    >>> shown = np.random.default_rng(2).normal([(0, 0), (3, 0), (3, 3), (0, 3)], 0.3, (5, 4, 2))
    >>> round(estimate_spread(shown), 2), estimate_spread(shown[:1])
    (0.29, 0.15)
    """
    expected = Expected() if expected is None else expected
    spreads = np.geomspace(expected.least, expected.most, N_SPREADS)
    gains = _mean_gains(sequences, spreads) * (len(sequences) - 1)
    if not gains.any():
        return expected.usual
    return _highest(spreads, gains + expected.log_density(spreads))


def _highest(at, values):
    """Where the values are highest, by a parabola in log(at) through the best three."""
    best = int(np.argmax(values))
    if best in (0, len(at) - 1):
        return float(at[best])
    before, top, after = values[best - 1 : best + 2]
    shift = 0.5 * (before - after) / (before - 2 * top + after)
    return float(at[best] * (at[1] / at[0]) ** shift)


def _mean_gains(sequences, spreads):
    """Evidence won by merging two demonstrations, on average over pairs, for each spread: (G,)."""
    if len(sequences) < 2:
        return np.zeros(len(spreads))
    longest = max(map(len, sequences))
    few = [n for n in range(2, FEW + 1) if n * (n - 1) // 2 * longest**2 <= MOST_CELLS]
    order = by_content(sequences)
    chosen = [sequences[k] for k in order[spaced(len(order), max(few, default=2))]]
    one, other = np.triu_indices(len(chosen), 1)
    lengths, merging = np.array(list(map(len, chosen))), _merging_gains(sequences, chosen, spreads)
    return _best_of_pairs(merging, lengths[one], lengths[other]).mean(1)


def _merging_gains(sequences, chosen, spreads):
    """What each subgoal of one demonstration gains in one state with each of another: (G, P, L, L).

    For P pairs of those chosen, of L subgoals at most; minus infinity beyond the end of one.
    """
    everything = np.concatenate(sequences)
    centre, longest = everything.mean(0), max(map(len, chosen))
    points = np.full((len(chosen), longest, 2), np.nan)
    for row, sequence in zip(points, chosen, strict=True):
        row[: len(sequence)] = sequence - centre
    q = outer_products(points)
    a, b = np.triu_indices(len(chosen), 1)
    s_two, q_two = points[a, :, None] + points[b, None], q[a, :, None] + q[b, None]
    gains = np.empty((len(spreads), len(a), longest, longest))
    for gain, spread in zip(gains, spreads, strict=True):
        prior = replace(prior_over(everything - centre, spread), most=2)
        alone = emission_evidence(1, points, q, prior)
        gain[:] = emission_evidence(2, s_two, q_two, prior) - alone[a, :, None] - alone[b, None]
    return np.nan_to_num(gains, copy=False, nan=-np.inf)


def _best_of_pairs(merging, lengths, others):
    """The highest gain of all alignments of pairs: (G, P), zero where they are better left apart.

    The recursion of `dollop.cdhmm.alignment.align_chain` for a graph that is one chain, whose steps
    cost nothing and whose other steps cost log 6; nodes are START and the subgoals of the one.

    Parameters
    ----------
    merging : (G, P, L, L) float array
        What subgoals gain in one state.
    lengths, others : (P,) int arrays
        Of both demonstrations of each pair.
    """
    n_spreads, n_pairs, longest, _ = merging.shape
    matched = np.full((n_spreads, n_pairs, longest + 1), -np.inf)
    apart, pairs = matched.copy(), np.arange(n_pairs)
    matched[..., 0] = 0.0
    gains = np.zeros((n_spreads, n_pairs))
    for i in range(longest + 1):
        left = np.maximum(matched + PARTING, apart)
        arrived = np.maximum(matched[:, pairs, lengths], left.max(-1))
        gains = np.where(others == i, arrived, gains)
        if i < longest:
            onward = np.maximum(matched, np.maximum.accumulate(left, axis=-1))[..., :-1]
            matched[..., 1:] = merging[..., i] + onward
            matched[..., 0] = -np.inf
            apart = left
    return gains - PARTING
