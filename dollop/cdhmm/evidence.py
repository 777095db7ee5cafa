"""The evidence for a CDHMM's structure (Sec. V): Normal-inverse-Wishart emissions, Dirichlet
transitions.

====================  ==========================================================================================
n, s, q               of a state: the number of its subgoals, their sum, and the sum of their xx, xy, yy, all taken
                      from the mean of all subgoals; additive, so that merging states adds them
kappa, nu, psi        the Normal-inverse-Wishart prior of a state: mean ~ N(0, Sigma / kappa), Sigma ~ IW(nu, psi I)
c_uv, C_u, K_u        how often the edge u -> v was taken, their sum over v, and the number of edges that leave u
====================  ==========================================================================================

The structure is one number per subgoal, its state; everything else follows from these *labels*.
Their evidence is

    sum over states of   log p(subgoals of the state)                                      (Normal-inverse-Wishart)
  + sum over nodes of    log G(K_u) - log G(K_u + C_u) + sum over v of log G(c_uv + 1)     (Dirichlet, beta = 1)
"""

from dataclasses import dataclass

import numpy as np
import scipy

__all__ = [
    "END",
    "FIRST",
    "LEAST_GAIN",
    "START",
    "Graph",
    "chains_of",
    "emission_evidence",
    "emission_table",
    "evidence_of",
    "graph_of",
    "outer_products",
    "prior_over",
    "steps_of",
    "transition_evidence",
]

START, END, FIRST = 0, 1, 2  # nodes of every graph: the start, the end, then the states
LEAST_GAIN = 1e-9  # nats: a smaller gain of evidence is rounding, not a reason


@dataclass(frozen=True, eq=False)
class Chains:
    """The subgoals of all demonstrations, one after the other.

    `points` (M, 2) from their mean, `slices` where each demonstration lies, `first` (M,) where one
    begins, `place` (M,) position in the demonstration, in (0, 1).
    """

    points: np.ndarray
    slices: tuple
    first: np.ndarray
    place: np.ndarray


@dataclass(frozen=True)
class Prior:
    """Normal-inverse-Wishart prior of one state; `psi` stands for psi times the unit matrix."""

    kappa: float
    nu: float
    psi: float


@dataclass(frozen=True, eq=False)
class Graph:
    """What labels add up to: per node `n` (S,), `s` (S, 2), `q` (S, 3), and edge `counts` (S, S)."""

    n: np.ndarray
    s: np.ndarray
    q: np.ndarray
    counts: np.ndarray


def chains_of(sequences):
    """The subgoals of all demonstrations, (K, 2) each in m, as one record, about their common mean."""
    lengths = [len(sequence) for sequence in sequences]
    slices = tuple(slice(end - length, end) for end, length in zip(np.cumsum(lengths).tolist(), lengths, strict=True))
    points = np.concatenate(sequences)
    index = np.concatenate([np.arange(length) for length in lengths])
    return Chains(points - points.mean(0), slices, index == 0, (index + 1) / (np.repeat(lengths, lengths) + 1))


def prior_over(points, spread):
    """Expect states of covariance spread^2, their means as wide apart as the subgoals are, no less
    than the spread.
    """
    nu, width = 8.0, max(np.sqrt(np.mean(points**2)), spread)
    return Prior(kappa=(spread / width) ** 2, nu=nu, psi=(nu - 3) * spread**2)


def outer_products(points):
    """xx, xy, yy of each point: (..., 2) -> (..., 3)."""
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * x, x * y, y * y], axis=-1)


def emission_table(prior, n_most):
    """The part of the emission evidence that depends on n alone, for n = 0 .. n_most."""
    n = np.arange(n_most + 1)
    nu = prior.nu + np.array([0, *n])
    gammas = scipy.special.gammaln(nu / 2) + scipy.special.gammaln((nu - 1) / 2)
    return gammas[1:] - gammas[0] - n * np.log(np.pi) + prior.nu * np.log(prior.psi) - np.log1p(n / prior.kappa)


def emission_evidence(n, s, q, prior, table):
    """Evidence of n subgoals with sum s (..., 2) and sums of products q (..., 3), in nats."""
    kappa = prior.kappa + n
    xx = prior.psi + q[..., 0] - s[..., 0] * s[..., 0] / kappa
    xy = q[..., 1] - s[..., 0] * s[..., 1] / kappa
    yy = prior.psi + q[..., 2] - s[..., 1] * s[..., 1] / kappa
    determinant = np.maximum(xx * yy - xy * xy, prior.psi**2)  # never less, but for rounding
    return table[n] - 0.5 * (prior.nu + n) * np.log(determinant)


def transition_evidence(counts):
    """Evidence of the edges that leave each node (S,), in nats."""
    total, out = counts.sum(1), np.maximum((counts > 0).sum(1), 1)
    return scipy.special.gammaln(out) - scipy.special.gammaln(out + total) + scipy.special.gammaln(counts + 1).sum(1)


def graph_of(labels, chains):
    """Add up what labels say; demonstrations whose labels are START are not in it."""
    size, inside = max(labels.max() + 1, FIRST), labels >= FIRST
    before = np.where(chains.first, START, np.roll(labels, 1))
    edges = np.concatenate(
        [(before * size + labels)[inside], (labels * size + END)[inside & np.roll(chains.first, -1)]]
    )
    return Graph(
        n=np.bincount(labels[inside], minlength=size),
        s=sums_by_label(labels[inside], chains.points[inside], size),
        q=sums_by_label(labels[inside], outer_products(chains.points[inside]), size),
        counts=np.bincount(edges, minlength=size * size).reshape(size, size),
    )


def sums_by_label(labels, values, size):
    """Sums (size, d) of the values (M, d) of each label (M,)."""
    return np.stack([np.bincount(labels, column, minlength=size) for column in values.T], axis=-1)


def steps_of(chain):
    """The edges of one demonstration, START and END included: two arrays, from and to."""
    return np.concatenate([[START], chain]), np.concatenate([chain, [END]])


def evidence_of(labels, chains, prior):
    """Evidence in nats of the graph in which subgoal m belongs to node labels[m], (M,)."""
    graph = graph_of(labels, chains)
    table = emission_table(prior, len(labels))
    return float(
        emission_evidence(graph.n, graph.s, graph.q, prior, table).sum() + transition_evidence(graph.counts).sum()
    )
