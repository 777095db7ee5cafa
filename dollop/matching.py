"""Which corner of one environment is which corner of another (Sec. IV-A).

The literal method is the paper's: springs between all 4N corners, a bijection that changes the
forces least. Its forces are dominated by the springs within each box, so that an error of a few
centimetres in a box outweighs where the boxes stand. The robust method, the default, matches
objects first and corners after. It takes it that every object was moved by itself, and that the
layout may have been turned and shifted as a whole before. With z_a and w_a the n matched positions
of the two environments about their means, as complex numbers, and with
s = sum_a conj(z_a) w_a / sigma^2, a matching costs, in nats (negative log probability, but for a
constant),

    sum_a (|z_a|^2 + |w_a|^2) / (2 sigma^2)                   objects moved by themselves
    - log(exp(Re s) + exp(|s + kappa| - kappa - L_turn))      no turn, or any, for L_turn
    - log(exp(-n |shift|^2 / (2 sigma^2)) + exp(-L_shift))    no shift, or any, for L_shift
    + c (N + M - 2n)                                          each object left out

with sigma the standard deviation of the moves per axis, and the shift that of the mean. All this is
a reconstruction.
The second line is the closed form of the best turn: a turn by theta takes Re(e^{-i theta} s) off
the first line and costs kappa (1 - cos theta), least at theta = arg(s + kappa). While no object is
left out the shift is the same for all matchings, so that only relative positions count. Where some
are missing, the rest may fit in several places; then staying in place counts, by L_shift at most.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, permutations, product
from math import comb, perm, pi

import numpy as np
import scipy

from dollop.checks import check_choice, check_positive
from dollop.environment import corner_indices, integer_costs

__all__ = ["Matching", "match", "match_confidently"]

_KAPPA = 1.0  # of a layout that was turned, small turns are a little likelier
_TURNED = 4.0  # L_turn, nats
_SHIFTED = 6.0  # L_shift, nats
# What makes a matching cost 0 if nothing moved:
_UNMOVED = np.log1p(np.exp(-_TURNED)) + np.log1p(np.exp(-_SHIFTED))
_ODDS = 20.0  # a matching is confident where it is this much more probable than the second best

_ENUMERATED = 2000  # up to so many partial matchings all are tried
_STARTS = 8  # beyond, so many of the alignments that fit best are refined
_REFINEMENTS = 100  # never reached but where costs tie
_PROBES = 50  # by so many objects at most it is judged how well an alignment fits


@dataclass(frozen=True, eq=False)
class Matching:
    """Which corner of environment i is which of environment j, and how sure that is (Sec. IV-A).

    Attributes
    ----------
    indices : (4N,) int array
        Corner a of i goes to corner indices[a] of j; -1 where it is left out.
    cost : float
        Literal: the total change in force in 1/alpha 1/m². Robust: nats, see the module.
    margin : float
        What the best of all other matchings costs more; 0 is a tie. Literal: of all other
        bijections of the corners. Robust: of all matchings with another partner for one object at
        least.
    confident : bool
        False where the scene is ambiguous: ask, do not guess. Literal: the margin exceeds what
        rounding up can do, one unit per corner. Robust: the matching is at least 20 times as
        probable as the second best.
    turn : float
        By how much the layout has turned from i to j, in rad; 0 where that need not be, and with
        the literal method.
    """

    indices: np.ndarray
    cost: float
    margin: float
    confident: bool
    turn: float = 0.0

    def __repr__(self):
        pairs = ", ".join(f"{a} to {b}" for a, b in enumerate(self.partners) if b >= 0)
        sure = "confident" if self.confident else "not confident"
        return f"Matching of objects {pairs or 'none'}: {sure}, margin {self.margin:.3g}"

    @classmethod
    def identity(cls, n):
        """The matching of n objects with themselves, beyond doubt (Sec. IV-A).

        Parameters
        ----------
        n : int
            From 0 on.

        Returns
        -------
        Matching
        """
        return cls(corner_indices(np.arange(n)), 0.0, np.inf, True)

    @property
    def partners(self):
        """(N,) int array: object a of i goes to object partners[a] of j, -1 where left out."""
        return self.indices[::4] // 4


def match(environment_i, environment_j, method="robust", left_out=3.0, moved=0.4):
    """Match the corners of two environments (Sec. IV-A).

    Parameters
    ----------
    environment_i, environment_j : Environment
        At least two objects each.
    method : {"robust", "literal"}
        "robust" compares the layouts of the objects and takes the corners from that; objects may be
        missing, added or split. "literal" is the paper's: a bijection of the corners with the least
        change in spring forces.
    left_out : float
        Robust only. Leaving out an object of each environment costs as much as if one had been
        moved by this many metres, beside the others.
    moved : float
        Robust only. How far objects are moved by themselves: sigma, standard deviation per axis in
        m. Where they move farther than this, matchings are called confident too easily.

    Returns
    -------
    Matching
        With the margin to the second best. Look at `.confident` before use.

    Raises
    ------
    ValueError
        Fewer than two objects; with "literal" also different counts, or corners that coincide.

    Examples
    --------
    The order of the objects does not matter.

    >>> from dollop.environment import Environment
    >>> boxes = np.array([[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4], [1, 4, 1.4, 4.4]])
    >>> match(Environment(boxes), Environment(boxes[[2, 0, 1]])).indices.tolist()
    [4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3]
    """
    check_choice("method", method, ("robust", "literal"))
    check_positive("left_out", left_out)
    check_positive("moved", moved)
    counts = f"{len(environment_i)} and {len(environment_j)}"
    if min(len(environment_i), len(environment_j)) < 2:
        raise ValueError(f"matching compares layouts: each environment needs at least 2 objects, got {counts}")
    if method == "literal" and len(environment_i) != len(environment_j):
        raise ValueError(f"the literal method is a bijection and needs the same number of objects, got {counts}")
    if method == "literal":
        return _match_literally(environment_i, environment_j)
    return _match_robustly(environment_i, environment_j, left_out, moved)


def match_confidently(environment_i, environment_j, names):
    """The robust matching of two environments, if it is sure (reconstruction).

    Of one object in each there is only one; and where all boxes are the same, none has moved.

    Parameters
    ----------
    environment_i, environment_j : Environment
        At least two objects each, or one each, or the same ones.
    names : (str, str)
        What to call the two in the error.

    Returns
    -------
    Matching
        A confident one.

    Raises
    ------
    ValueError
        As `match`, and if a second matching is nearly as good: then ask the user, do not guess.

    Examples
    --------
    Two objects that turned by a right angle could be either way round.

    >>> from dollop.environment import Environment
    >>> before = Environment([[0, 0, 1, 1], [3, 0, 4, 1]])
    >>> match_confidently(before, before, ("before", "after")).partners.tolist()
    [0, 1]
    >>> after = Environment([[0, 0, 1, 1], [0, 3, 1, 4]])
    >>> match_confidently(before, after, ("before", "after"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: before and after cannot be matched with confidence: ... only 0.00 more...
    """
    unmoved = np.array_equal(environment_i.boxes, environment_j.boxes)
    if unmoved or len(environment_i) == len(environment_j) == 1:
        return Matching.identity(len(environment_i))
    try:
        matching = match(environment_i, environment_j)
    except ValueError as error:
        raise ValueError(f"{' and '.join(names)}: {error}") from error
    if not matching.confident:
        found = f"the second-best matching costs only {matching.margin:.2f} more"
        pair, advice = " and ".join(names), "give the matching, or move the objects apart"
        raise ValueError(f"{pair} cannot be matched with confidence: {found}; {advice}")
    return matching


def _match_literally(environment_i, environment_j):
    costs = integer_costs(environment_i.corners, environment_j.corners)
    rows, indices = scipy.optimize.linear_sum_assignment(costs)
    margin = second_best(costs, indices)
    return Matching(indices, float(costs[rows, indices].sum()), margin, margin > len(indices))


def _match_robustly(environment_i, environment_j, left_out, moved):
    x, y = (each.centres @ (1, 1j) / moved for each in (environment_i, environment_j))  # sigma is 1
    # One object of each left out costs as a move by left_out: 2 c = left_out^2 / (2 sigma^2).
    price = (left_out / moved) ** 2 / 4
    ways = sum(comb(len(x), k) * perm(len(y), k) for k in range(len(x) + 1))
    partners, cost, margin, turn = (_enumerate if ways <= _ENUMERATED else _search)(x, y, price)
    indices, confident = corner_indices(partners, turn), bool(margin >= np.log(_ODDS))
    return Matching(indices, float(cost), float(margin), confident, float(turn))


def _costs_of(x, y, partners, price):
    """Cost (P,) and turn (P,) of each row of `partners` (P, N), by the formula of the module."""
    matched = partners >= 0
    n = matched.sum(axis=1)
    z, mean_z = _centred(x * matched, matched)
    w, mean_w = _centred(y[partners] * matched, matched)
    likeness = (z.conj() * w).sum(axis=1)
    turned = np.abs(likeness + _KAPPA) - _KAPPA - _TURNED
    spread = (np.abs(z) ** 2 + np.abs(w) ** 2).sum(axis=1) / 2
    stays = np.exp(-n * np.abs(mean_w - mean_z) ** 2 / 2)
    costs = spread - np.logaddexp(likeness.real, turned) - np.log(stays + np.exp(-_SHIFTED))
    costs += price * (len(x) + len(y) - 2 * n)
    return costs + _UNMOVED, np.where(likeness.real >= turned, 0.0, np.angle(likeness + _KAPPA))


def _centred(positions, matched):
    means = positions.sum(axis=1) / np.maximum(matched.sum(axis=1), 1)
    return (positions - means[:, None]) * matched, means


def _enumerate(x, y, price):
    """The best of all partial matchings, exactly, and what the second best costs more."""
    partners = _all_partial(len(x), len(y))
    costs, turns = _costs_of(x, y, partners, price)
    best, second = np.argsort(costs, kind="stable")[:2]
    return partners[best], costs[best], costs[second] - costs[best], turns[best]


@lru_cache(maxsize=32)
def _all_partial(n, m):
    """Every way to match some of n with some of m, (P, n), -1 where left out."""
    found = []
    for k in range(min(n, m) + 1):
        for rows, columns in product(combinations(range(n), k), permutations(range(m), k)):
            found.append(np.full(n, -1))
            found[-1][list(rows)] = columns
    return np.array(found)


def _search(x, y, price):
    """A good partial matching of many objects: of the alignments that fit best, each refined.

    The margin is the exact one with turn and shift held at their best, or that to another alignment
    where it is less.
    """
    found = {}
    for alignment in _alignments(x, y, price):
        partners, cost, turn = _refine(x, y, price, *alignment)
        found[partners.tobytes()] = (cost, partners, turn)
    (cost, partners, turn), *others = sorted(found.values(), key=lambda result: result[0])
    held = second_best(_moves(x, y, *_alignment(x, y, partners, turn)), partners, price)
    return partners, cost, min([held, *(other[0] - cost for other in others)]), turn


def _alignments(x, y, price):
    """Turns (by 45 degrees), pivots and shifts to start from: those that fit most objects."""
    central = np.argsort(np.abs(x - x.mean()), kind="stable")
    anchors, probes = x[central[: max(1, 100 // len(y))]], x[central[:_PROBES]]
    turns = np.repeat(np.arange(-3, 5) * pi / 4, len(anchors) * len(y) + 1)
    # Under a turn either the means coincide, or a central object falls on one of the others.
    shifts = np.tile(np.r_[y.mean() - x.mean(), np.subtract.outer(y, anchors).ravel()], 8)
    pivots = np.tile(np.r_[x.mean(), np.tile(anchors, len(y))], 8)
    images = np.exp(1j * turns)[:, None] * (probes - pivots[:, None]) + (pivots + shifts)[:, None]
    tree = scipy.spatial.cKDTree(np.c_[y.real, y.imag])
    distances, _ = tree.query(np.stack([images.real, images.imag], axis=-1))
    fits = np.minimum(distances**2 / 2, 2 * price).sum(axis=1)
    chosen = np.argsort(fits, kind="stable")[:_STARTS]
    best = zip(turns[chosen], pivots[chosen], shifts[chosen], strict=True)
    return [(0.0, 0.0, 0.0), *best]  # in place, and those


def _refine(x, y, price, *alignment):
    """Assignment and alignment by turns until neither changes.

    Each step lowers the cost at the given shift.
    """
    previous = None
    for _ in range(_REFINEMENTS):
        partners = _assign(_moves(x, y, *alignment), price)
        costs, turns = _costs_of(x, y, partners[None], price)
        if np.array_equal(partners, previous):
            break
        previous, alignment = partners, _alignment(x, y, partners, turns[0])
    return partners, costs[0], turns[0]


def _assign(moves, price):
    # A pair that costs more than leaving out both is assigned at that price, and dropped after.
    rows, columns = scipy.optimize.linear_sum_assignment(np.minimum(moves, 2 * price))
    near = moves[rows, columns] < 2 * price
    partners = np.full(len(moves), -1)
    partners[rows[near]] = columns[near]
    return partners


def _alignment(x, y, partners, turn):
    matched = partners >= 0
    if not matched.any():
        return turn, 0, 0
    pivot = x[matched].mean()
    return turn, pivot, y[partners[matched]].mean() - pivot


def _moves(x, y, turn, pivot, shift):
    """(N, M) cost of the move that each pair would need beside turn and shift, in nats."""
    images = np.exp(1j * turn) * (x - pivot) + pivot + shift
    return np.abs(y - images[:, None]) ** 2 / 2


def second_best(costs, partners, left_out=np.inf):
    """What the best of all other assignments costs more.

    Two assignments differ by alternating cycles and paths; if the first is optimal, the best other
    one differs by a single of them. So it is the cheapest cycle of a graph whose edge a -> b has
    row a take the column of row b, with one more node for what is left out.

    Parameters
    ----------
    costs : (N, M) array
        Of assigning row to column.
    partners : (N,) int array
        An optimal assignment: the column of each row, -1 where left out.
    left_out : float
        Cost of leaving out a row or a column; infinite where all of an (N, N) must be assigned.

    Returns
    -------
    float
        At least 0; 0 is a tie, `inf` where there is no other.

    Examples
    --------
    >>> second_best([[0, 2], [1, 0]], np.array([0, 1]))
    3.0
    """
    costs = np.asarray(costs, dtype=float)
    rows = np.flatnonzero(partners >= 0)
    columns = partners[rows]
    own = costs[rows, columns]
    edges = costs[rows[:, None], columns] - own[:, None]
    added = np.inf
    if np.isfinite(left_out):
        free_rows = np.flatnonzero(partners < 0)
        free_columns = np.setdiff1d(np.arange(costs.shape[1]), columns)
        away = _cheapest(costs[rows][:, free_columns], left_out, axis=1) - own
        back = _cheapest(costs[free_rows][:, columns], left_out, axis=0)
        edges = np.block([[edges, away[:, None]], [back, np.inf]])
        added = costs[free_rows][:, free_columns].min(initial=np.inf) - 2 * left_out
    return float(max(0.0, min(added, _cheapest_cycle(edges))))


def _cheapest(costs, left_out, axis):
    """What each row (or column) pays without its partner: for one left out, or to be left out."""
    return np.minimum(costs.min(axis=axis, initial=np.inf) - left_out, left_out)


def _cheapest_cycle(edges):
    """Weight of the cheapest cycle through two nodes or more, where no cycle is negative."""
    edges = edges.copy()
    np.fill_diagonal(edges, np.inf)
    if len(edges) > 32:
        return _cheapest_cycle_of_many(edges)
    for node in range(len(edges)):  # Floyd and Warshall
        np.minimum(edges, edges[:, node, None] + edges[node], out=edges)
    return edges.diagonal().min(initial=np.inf)


def _cheapest_cycle_of_many(edges):
    # The cheapest swap of two bounds the cheapest cycle, so that, once node potentials have made
    # all edges non-negative (Johnson), most edges are too dear to be part of it.
    swap = (edges + edges.T).min()
    if not 0 < swap < np.inf:
        return swap
    potentials = _potentials(edges)
    reduced = np.maximum(edges + potentials[:, None] - potentials, 0)
    starts, ends = np.nonzero(reduced < swap)
    # A stored zero is an edge without weight, as wanted.
    graph = scipy.sparse.csr_array((reduced[starts, ends], (starts, ends)), shape=edges.shape)
    back = scipy.sparse.csgraph.dijkstra(graph, limit=swap)
    return min(swap, (reduced[starts, ends] + back[ends, starts]).min(initial=np.inf))


def _potentials(edges):
    """Length of the shortest path to each node from anywhere (Bellman and Ford)."""
    incoming, paths = edges.T.copy(), np.empty_like(edges)
    potentials = np.zeros(len(edges))
    for _ in range(len(edges)):
        shorter = np.minimum(potentials, np.add(incoming, potentials, out=paths).min(axis=1))
        if np.abs(shorter - potentials).max() < 1e-12:
            break
        potentials = shorter
    return potentials
