"""A Continuous-Density Hidden Markov Model (CDHMM) of the user, estimated from subgoals (Sec. V).

The user is a CDHMM that emits subgoals. Every demonstration enters as a chain of states of its own,
START -> .. -> END; states are merged best-first while the evidence of the whole grows, never when
one is reachable from the other, so that the graph stays acyclic. The paper names its merge test
only by reference; this one is a reconstruction after Bayesian model merging (Stolcke & Omohundro,
NIPS 1992) and acyclic probabilistic automata (Ron, Singer & Tishby, JCSS 1998).
`dollop.cdhmm.evidence` has the formulas, `dollop.cdhmm.merging` and `dollop.cdhmm.alignment` the
search.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from dollop.cdhmm import alignment
from dollop.cdhmm.evidence import (
    END,
    FIRST,
    START,
    chains_of,
    evidence_of,
    graph_of,
    outer_products,
)
from dollop.cdhmm.growing import structure_of
from dollop.cdhmm.spread import estimate_spread
from dollop.checks import (
    checked_array,
    checked_flag,
    checked_number,
    checked_positions,
    checked_records,
    checked_wholes,
    put_in,
    told,
)

__all__ = ["SubgoalHMM"]

LEAST_SPREAD, MOST_SPREAD = 1e-6, 1e6  # m: beyond, the evidence drowns in rounding
ROUNDING = 1e-6  # by which sums may miss 1
MOST_EVIDENCE, MOST_VARIANCE = 1e18, 1e20  # nats; m^2, of 1e9 m
MOST_SUBGOALS = 1000
"""Of a demonstration: all pairs of two are compared, in seconds and half a gigabyte."""


@dataclass(frozen=True, eq=False)
class SubgoalHMM:
    """What several demonstrations have in common: an acyclic CDHMM over subgoals (Sec. V).

    Its structure is estimated. States are numbered so that every edge leads from a
    lower to a higher one.

    Attributes
    ----------
    means : (S, 2) float array
        The subgoal each state stands for, in m: the mean of the subgoals merged into it.
    covariances : (S, 2, 2) float array
        How the subgoal of a state spreads, in m^2: the posterior mean, well defined from one
        subgoal on.
    transitions : (S, S) float array
        Probability of going from a state to another. Each row and its entry of `end` sum to one.
    start, end : (S,) float arrays
        Probability of beginning in a state (sums to one), and of ending after it.
    sequences : tuple of (K, 2) float arrays
        The subgoals of each demonstration, as given.
    states : tuple of (K,) int arrays
        The state of each of these subgoals. A demonstration visits no state twice.
    spread : float
        How far one subgoal is expected to lie from its mean along each axis, standard deviation in
        m: as named to `fit`, or its estimate.
    evidence : float
        Logarithm of the probability of all subgoals and of their order, in nats, with the
        parameters integrated out.
    estimated : bool
        Whether nobody named the spread.

    Raises
    ------
    ValueError
        Arrays that are not of one number of states, what is no probability or no covariance, and
        states that are not one for each subgoal, do not rise, or have no subgoal.

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
    estimated: bool = False

    def __post_init__(self):
        means, most = checked_positions("means", self.means), 1 + ROUNDING
        n = len(means)
        sequences = checked_records("sequences", self.sequences, object)
        states = checked_records("states", self.states, object)
        if not (n and sequences) or len(sequences) != len(states):
            raise ValueError(f"a model needs states for each of its sequences, got {told(states)}")
        sequences = tuple(checked_sequence(each, f"demonstration {k}") for k, each in enumerate(sequences))
        pairs = zip(states, sequences, strict=True)
        states = tuple(checked_wholes("states", each, len(shown), most=n - 1) for each, shown in pairs)
        rising = all((np.diff(each) > 0).all() for each in states)
        if not rising or len(np.unique(np.concatenate(states))) < n:
            raise ValueError(f"states must rise in each sequence, and all be there, got {told(states)}")
        for each in (*sequences, *states):
            each.flags.writeable = False
        put_in(
            self,
            means=means,
            covariances=checked_covariances(self.covariances, n),
            transitions=checked_array("transitions", self.transitions, n, n, least=0, most=most),
            start=checked_array("start", self.start, n, least=0, most=most),
            end=checked_array("end", self.end, n, least=0, most=most),
            sequences=sequences,
            states=states,
            spread=checked_number("spread", self.spread, LEAST_SPREAD, MOST_SPREAD),
            evidence=checked_number("evidence", self.evidence, -MOST_EVIDENCE, MOST_EVIDENCE),
            estimated=checked_flag("estimated", self.estimated),
        )

    def __repr__(self):
        path = " ".join(map(str, self.most_likely_path()))
        shown = f"{len(self.means)} states, shown {len(self.sequences)} x"
        return f"SubgoalHMM of {shown}, most-likely path {path}"

    @classmethod
    def fit(cls, sequences, spread=None):
        """Estimate structure and parameters from the subgoals of each demonstration (Sec. V).

        Parameters
        ----------
        sequences : sequence of (K, 2) array_like
            The subgoals of each demonstration in order, in m, all in one environment. Lengths may
            differ.
        spread : float, optional
            How far one subgoal is expected to lie from its mean along each axis, standard deviation
            in m. Two single subgoals are merged up to about four times this apart, less or more by
            what their neighbours say. By default the one that makes the demonstrations most
            evident, and 0.15 m where they say nothing (`dollop.cdhmm.spread`).

        Returns
        -------
        SubgoalHMM

        Raises
        ------
        ValueError
            No demonstration, one that is empty, of more than 1000 subgoals, not (K, 2) or not finite,
            or a spread that is not positive.

        Examples
        --------
        A user who is sloppier than others is understood as well:

        >>> task, random = [(0, 0), (2, 0), (2, 2), (0, 2)], np.random.default_rng(1)
        >>> model = SubgoalHMM.fit([task + random.normal(0, 0.3, (4, 2)) for _ in range(4)])
        >>> len(model.most_likely_path()), round(model.spread, 1)
        (4, 0.3)
        """
        sequences = checked_records("sequences", sequences, object)
        sequences = tuple(checked_sequence(s, f"demonstration {k}") for k, s in enumerate(sequences))
        if not sequences:
            raise ValueError("sequences must hold at least one demonstration, got none")
        estimated = spread is None
        spread = estimate_spread(sequences) if estimated else spread
        spread = checked_number("spread", spread, LEAST_SPREAD, MOST_SPREAD)
        chains = chains_of(sequences, spread)
        labels = alignment.set_apart(structure_of(chains), chains)
        labels = alignment.numbered(labels, chains)
        return cls._of(labels, chains, sequences, spread, estimated)

    @classmethod
    def _of(cls, labels, chains, sequences, spread, estimated):
        graph = graph_of(labels, chains)
        probability = graph.counts / np.maximum(graph.counts.sum(1), 1)[:, None]
        means, covariances = parameters_of(graph, chains.prior)
        return cls(
            means=means + chains.centre,
            covariances=covariances,
            transitions=probability[FIRST:, FIRST:],
            start=probability[START, FIRST:],
            end=probability[FIRST:, END],
            sequences=sequences,
            states=tuple(labels[part] - FIRST for part in chains.slices),
            spread=float(spread),
            evidence=evidence_of(labels, chains),
            estimated=estimated,
        )

    def add(self, sequence):
        """The model of all demonstrations so far and one more: as fitting all at once (Sec. V).

        A spread that nobody named is estimated anew.

        Parameters
        ----------
        sequence : (K, 2) array_like
            The subgoals of the new demonstration in m, in the same environment.

        Returns
        -------
        SubgoalHMM

        Raises
        ------
        ValueError
            A sequence that is empty, not (K, 2) or not finite.
        """
        return SubgoalHMM.fit([*self.sequences, sequence], None if self.estimated else self.spread)

    def most_likely_path(self):
        """States of the most probable way from start to end: the task (Sec. V).

        Among equally probable ways the one of fewer states, then the one whose states hold more
        subgoals, then the one that was demonstrated earlier.

        Returns
        -------
        (L,) int array
            In order, so that they grow.
        """
        return alignment.path_through(*self._grown()) - FIRST

    def coverage(self):
        """The share of the most-likely path that each demonstration visits (beyond the paper).

        Returns
        -------
        (D,) float array
            Of D demonstrations, between 0 and 1.
        """
        return alignment.coverage_of(self.states, self.most_likely_path())

    def outliers(self):
        """Demonstrations that do something else: they visit less than half of the most-likely path.

        Beyond the paper, which takes it that all demonstrations are of one task.

        Returns
        -------
        tuple of int
            Their places in `sequences`. They share no state with the other demonstrations.
        """
        return tuple(np.flatnonzero(self.coverage() < alignment.LEAST_COVERAGE).tolist())

    def segments(self):
        """Which segments of which demonstrations run along each edge (Sec. V).

        Their statistics add up (`dollop.lds.Statistics`), so that one LDS describes all of an edge.

        Returns
        -------
        dict
            (from state, to state) to a list of (demonstration, segment). Segment i of a
            demonstration ends in its subgoal i; the first comes from the start, -1.
        """
        edges = {}
        for demonstration, states in enumerate(self.states):
            for segment, edge in enumerate(pairwise([-1, *states.tolist()])):
                edges.setdefault(edge, []).append((demonstration, segment))
        return edges

    def states_of(self, sequence):
        """The states of another demonstration's subgoals: those that raise the evidence most.

        Found by dynamic programming, as Viterbi's (reconstruction).

        Parameters
        ----------
        sequence : (K, 2) array_like
            Subgoals in m, in the same environment.

        Returns
        -------
        (K,) int array
            -1 for a subgoal that is better explained by a state of its own. Steps that no
            demonstration has taken are possible, at the price of a new edge; only the order of the
            states is kept.

        Raises
        ------
        ValueError
            A sequence that is empty, not (K, 2) or not finite.
        """
        sequence = checked_sequence(sequence, "sequence")
        labels, chains = self._grown()
        nodes, _ = alignment.align_chain(sequence - chains.centre, graph_of(labels, chains), labels, chains)
        return np.where(nodes < 0, -1, nodes - FIRST)

    def log_likelihood(self, sequence):
        """How probable it is that the model emits these subgoals, over all its paths (Sec. V).

        The logarithm of a density, by the forward recursion of hidden Markov models.

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
        emissions = log_normal(checked_sequence(sequence, "sequence"), self.means, self.covariances)
        with np.errstate(divide="ignore"):
            start, steps, end = np.log(self.start), np.log(self.transitions), np.log(self.end)
        forward = start + emissions[0]
        for emission in emissions[1:]:
            forward = scipy.special.logsumexp(forward[:, None] + steps, axis=0) + emission
        return float(scipy.special.logsumexp(forward + end))

    def _grown(self):
        """The labels of all subgoals, and the chains, from which the graph is made again."""
        return np.concatenate(self.states) + FIRST, chains_of(self.sequences, self.spread)


def parameters_of(graph, prior):
    """Mean of each state's subgoals (S, 2), posterior mean of its covariance (S, 2, 2)."""
    n, s, q = graph.n[FIRST:, None], graph.s[FIRST:], graph.q[FIRST:]
    scatter = q - outer_products(s) / (prior.kappa + n) + prior.psi * np.array([1, 0, 1])
    covariances = scatter / (prior.nu + n - 3)
    return s / n, covariances[:, [0, 1, 1, 2]].reshape(-1, 2, 2)


def log_normal(points, means, covariances):
    """Logarithm of the normal density of each point (L, 2) in each state: (L, S)."""
    offsets = points[:, None] - means
    distance = np.einsum("lsi,sij,lsj->ls", offsets, np.linalg.inv(covariances), offsets)
    return -0.5 * (distance + np.linalg.slogdet(covariances)[1]) - np.log(2 * np.pi)


def checked_covariances(covariances, n):
    """Covariances (n, 2, 2) in m^2; ValueError for what is not symmetric and positive definite."""
    covariances = checked_array("covariances", covariances, n, 2, 2, least=-MOST_VARIANCE, most=MOST_VARIANCE)
    (a, b), (c, d) = np.moveaxis(covariances, 0, -1)
    sound = (a > 0) & (d > 0) & (np.abs(b - c) <= ROUNDING * (a + d)) & (a * d > b * c)
    if not sound.all():
        found = covariances[np.flatnonzero(~sound)[0]].tolist()
        raise ValueError(f"covariances must be symmetric and positive definite, got {told(found)}")
    return covariances


def checked_sequence(sequence, name):
    """Subgoals as a float array (K, 2) in m; ValueError that calls them `name` if they are none."""
    sequence = checked_positions(name, sequence)
    if not len(sequence):
        raise ValueError(f"{name} must hold at least one subgoal, as (K, 2), got none")
    if len(sequence) > MOST_SUBGOALS:
        raise ValueError(f"{name} must hold at most {MOST_SUBGOALS} subgoals, got {len(sequence)}")
    return sequence
