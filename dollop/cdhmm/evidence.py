"""The evidence for a CDHMM's structure (Sec. V): Normal-inverse-Wishart emissions, Dirichlet steps.

================  ================================================================================
n, s, q           of a state: the number of its subgoals, their sum, and the sum of their xx, xy,
                  yy, all taken from the mean of all subgoals; merging states adds them
kappa, nu, psi    the Normal-inverse-Wishart prior of a state: mean ~ N(0, Sigma / kappa),
                  Sigma ~ IW(nu, psi I)
c_uv, C_u, K_u    how often the edge u -> v was taken, their sum over v, and the number of edges
                  that leave u
================  ================================================================================

The structure is one number per subgoal, its node; everything else follows from these *labels* (M,).
Their evidence is, for the Normal-inverse-Wishart and for the Dirichlet of beta = 1,

    sum over states of   log p(subgoals of the state)
  + sum over nodes of    log G(K_u) - log G(K_u + C_u) + sum over v of log G(c_uv + 1)

The paper names its merge test only by reference: these formulas are a reconstruction.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

START, END, FIRST = 0, 1, 2  # nodes of every graph: the start, the end, then the states
LEAST_GAIN = 1e-9  # nats: a smaller gain of evidence is rounding, not a reason


@dataclass(frozen=True)
class _Prior:
    """Normal-inverse-Wishart prior of one state of `most` subgoals at most.

    `psi`, in m^2, stands for psi times the unit matrix.
    """

    kappa: float
    nu: float
    psi: float
    most: int

    @cached_property
    def table(self):
        """(most + 1,) array: the part of the emission evidence that depends on n alone, in nats."""
        n = np.arange(self.most + 1)
        nu = self.nu + np.array([0, *n])
        gammas = scipy.special.gammaln(nu / 2) + scipy.special.gammaln((nu - 1) / 2)
        start = gammas[1:] - gammas[0] - n * np.log(np.pi) + self.nu * np.log(self.psi)
        return start - np.log1p(n / self.kappa)


@dataclass(frozen=True, eq=False)
class _Chains:
    """The subgoals of all demonstrations, one after the other, and what is expected of a state.

    `points` (M, 2) in m from their mean `centre` (2,), `slices` where each demonstration lies,
    `owner` (M,) its number, `place` (M,) position in the demonstration, in (0, 1).
    """

    points: np.ndarray
    centre: np.ndarray
    slices: tuple
    owner: np.ndarray
    place: np.ndarray
    prior: _Prior


@dataclass(frozen=True, eq=False)
class Graph:
    """What labels add up to (Sec. V).

    Attributes
    ----------
    n : (S,) int array
        How many subgoals each node has.
    s, q : (S, 2) and (S, 3) float arrays
        Sums over them, in m and m^2.
    counts : (S, S) int array
        How often each edge was taken, from row to column.
    """

    n: np.ndarray
    s: np.ndarray
    q: np.ndarray
    counts: np.ndarray


def chains_of(sequences, spread):
    """The subgoals of all demonstrations as one record (Sec. V).

    Parameters
    ----------
    sequences : sequence of (K, 2) float arrays
        Subgoals of each demonstration in m, one at least.
    spread : float
        Standard deviation expected of the subgoals of a state, in m.

    Returns
    -------
    record
        With `points`, `centre`, `slices`, `owner`, `place` and `prior`.
    """
    lengths = [len(sequence) for sequence in sequences]
    owner, slices = np.repeat(np.arange(len(lengths)), lengths), _slices_of(lengths)
    place = np.concatenate([np.arange(1, length + 1) / (length + 1) for length in lengths])
    points = np.concatenate(sequences)
    centre = points.mean(0)
    points = points - centre
    return _Chains(points, centre, slices, owner, place, prior_over(points, spread))


def subgoals_of(chains, chosen):
    """Where the subgoals of some demonstrations stand among all (Sec. V).

    Parameters
    ----------
    chains : record
        That of `chains_of`.
    chosen : (C,) int array
        Numbers of demonstrations, in any order.

    Returns
    -------
    (m,) int array
    """
    every = np.arange(len(chains.points))
    return np.concatenate([every[chains.slices[k]] for k in chosen])


def chains_within(chains, chosen):
    """Some of the demonstrations as a record of their own, of the same centre and prior (Sec. V).

    Parameters
    ----------
    chains : record
        That of `chains_of`.
    chosen : (C,) int array
        Their numbers, in the order wanted.

    Returns
    -------
    record
        As `chains_of` makes.
    """
    subgoals, lengths = subgoals_of(chains, chosen), np.bincount(chains.owner)[chosen]
    return replace(
        chains,
        points=chains.points[subgoals],
        slices=_slices_of(lengths),
        owner=np.repeat(np.arange(len(chosen)), lengths),
        place=chains.place[subgoals],
    )


def _slices_of(lengths):
    """Where things of these lengths (D,) lie, one after the other."""
    ends = np.cumsum(lengths)
    return tuple(map(slice, (ends - lengths).tolist(), ends.tolist()))


def prior_over(points, spread):
    """Expect states of covariance spread^2, their means as wide apart as the subgoals are (Sec. V).

    No less than the spread, though (reconstruction).

    Parameters
    ----------
    points : (M, 2) float array
        In m, from their mean.
    spread : float
        Standard deviation in m.

    Returns
    -------
    record
        With `kappa`, `nu`, `psi` and `most`.
    """
    nu, width = 8.0, max(np.sqrt(np.mean(points**2)), spread)
    return _Prior((spread / width) ** 2, nu, (nu - 3) * spread**2, 2 * len(points))


def outer_products(points):
    """The products of the coordinates of each point (reconstruction).

    Parameters
    ----------
    points : (..., 2) float array
        In m.

    Returns
    -------
    (..., 3) float array
        xx, xy and yy in m^2.
    """
    x, y = points[..., 0], points[..., 1]
    return np.stack([x * x, x * y, y * y], axis=-1)


def emission_evidence(n, s, q, prior):
    """Evidence of subgoals that share a state: the Normal-inverse-Wishart's (reconstruction).

    Parameters
    ----------
    n : (...) int array
        How many there are.
    s, q : (..., 2) and (..., 3) float arrays
        Their sum and that of their `outer_products`, in m and m^2.
    prior : record
        That of `chains_of`.

    Returns
    -------
    (...) float array
        In nats.
    """
    kappa = prior.kappa + n
    xx = prior.psi + q[..., 0] - s[..., 0] * s[..., 0] / kappa
    xy = q[..., 1] - s[..., 0] * s[..., 1] / kappa
    yy = prior.psi + q[..., 2] - s[..., 1] * s[..., 1] / kappa
    determinant = np.maximum(xx * yy - xy * xy, prior.psi**2)  # never less, but for rounding
    return prior.table[n] - 0.5 * (prior.nu + n) * np.log(determinant)


def transition_evidence(counts):
    """Evidence of the edges that leave each node: the Dirichlet's of beta = 1 (reconstruction).

    Parameters
    ----------
    counts : (..., S) int array
        How often the edges to each of S nodes were taken, by node that they leave.

    Returns
    -------
    (...) float array
        In nats.
    """
    log_gamma = scipy.special.gammaln
    total, out = counts.sum(1), np.maximum((counts > 0).sum(1), 1)
    return log_gamma(out) - log_gamma(out + total) + log_gamma(counts + 1).sum(1)


def graph_of(labels, chains):
    """Add up what labels say (Sec. V).

    Parameters
    ----------
    labels : (M,) int array
        The node of each subgoal; START for those of demonstrations that are not in the graph.
    chains : record
        That of `chains_of`.

    Returns
    -------
    Graph
        Of as many nodes as the labels need.
    """
    size, inside = max(labels.max() + 1, FIRST), labels >= FIRST
    first = np.diff(chains.owner, prepend=-1) > 0
    before = np.where(first, START, np.roll(labels, 1))
    into, last = before * size + labels, labels * size + END
    edges = np.concatenate([into[inside], last[inside & np.roll(first, -1)]])
    counts = np.bincount(edges, minlength=size * size).reshape(size, size)
    labels, points = labels[inside], chains.points[inside]
    s, q = (_sums(labels, values, size) for values in (points, outer_products(points)))
    return Graph(np.bincount(labels, minlength=size), s, q, counts)


def _sums(labels, values, size):
    """Sums (size, d) of the values (M, d) of each label (M,)."""
    columns = [np.bincount(labels, column, size) for column in values.T]
    return np.stack(columns, axis=-1).astype(float)  # whole numbers where there are none


def evidence_of(labels, chains):
    """Evidence of a structure (reconstruction).

    Parameters
    ----------
    labels : (M,) int array
        The node of each subgoal.
    chains : record
        That of `chains_of`.

    Returns
    -------
    float
        In nats.

    Examples
    --------
    Two subgoals in one place are better explained by one state than by two, and two far apart are
    not.

    >>> one, two = np.array([FIRST, FIRST]), np.array([FIRST, FIRST + 1])
    >>> for apart in (0.0, 2.0):
    ...     chains = chains_of([np.zeros((1, 2)), np.full((1, 2), apart)], spread=0.15)
    ...     print(evidence_of(one, chains) > evidence_of(two, chains))
    True
    False
    """
    graph = graph_of(labels, chains)
    emissions = emission_evidence(graph.n, graph.s, graph.q, chains.prior)
    return float(emissions.sum() + transition_evidence(graph.counts).sum())
