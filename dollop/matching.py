"""Which corner of one environment is which corner of another (Sec. IV-A).

The literal method is the paper's: springs between all 4N corners, a bijection that changes the
forces least. Its forces are dominated by the springs within each box, so that an error of a few
centimetres in a box outweighs where the boxes stand.

The robust method, the default, is a reconstruction. It matches objects first and corners after, and
tells how probable that is, by one model for every number of objects. K objects stand in a room of
area A, K unknown, with the prior 1 / K. Some were not touched, most were shifted a little, a few
were carried off, so that object a at x and object b at y are the same with the density

    f(a, b) = (1 - c) (u N(y; h(x), blur) + (1 - u) N(y; h(x), blur + sigma^2)) + c / A
    s(a, b) = 0.98 N(size_b; size_a) + 0.02 B

with `blur` what the sides of boxes are off, B the density of any size, at most 2 per m^2, and g
that of a new object: a size of those beside it, or any. An object that is left out has gone, one in
twenty, or stands where the other environment has not seen: all it costs is q = 1 - 0.95 p, where p
says how surely its place was seen, averaged over where it may have been moved. Where nobody knows
what was seen, p is the same for all, and unknown. A matching of k pairs then has the probability

    w_k / Z  product of  A f s / sqrt(g_a g_b) * sqrt((1 - q_a) (1 - q_b))  over its pairs (a, b)
             product of  q  over all that is left out

where w_k = (N + M - k - 1)! counts in how many ways K may be made of them. Z is the sum over all
partial matchings: row by row over sets of columns, exactly, up to twelve objects; by belief
propagation for more. What nobody knows is summed over as well: sigma, half, once or one and a half
times 0.4 m; u, none or a half; c, 0.01 or 0.1; p, from a half to 1; and whether sizes tell anything
at all, in one scene of ten not. So is what h did to the layout as a whole: nothing; shift it
anywhere, 4 nats less likely beforehand; turn it by any angle, 4; both, 8; or put it up anew, 1.4,
where f = 1 / A and p may be anything. Each shift or turn counts with the room that it is uncertain
by, of all that there are (Laplace): some turn fits any two objects, and that is no evidence.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product
from math import pi

import numpy as np
import scipy

from dollop.checks import (
    Note,
    check_choice,
    checked_array,
    checked_flag,
    checked_number,
    checked_record,
    checked_whole,
    checked_wholes,
    put_in,
    shortened,
    told,
)
from dollop.environment import Environment, corner_indices, integer_costs
from dollop.gridmap import covered_cells

__all__ = ["SURE", "Matching", "match", "match_surely"]

SURE = 0.95
"""What is at least so probable is used without asking."""

# What nobody knows, each value as likely as any: how far objects were shifted, times `moved`, which
# share of them was not touched at all, and which was carried off.
_SPREADS, _STILL, _CARRIED = (0.5, 1.0, 1.5), (0.0, 0.5), (0.01, 0.1)
_FOUND = 0.95  # of all objects that stand where it was seen; the others have gone or were missed
_REACHED, _ASSUMED = 0.035, 0.3  # m, sd of a side that a beam reached, and of another
_MEASURED, _MISJUDGED = 0.98, 0.02  # so often a size is off by that, and by anything
_SIZES = 0.28  # m, sd of the sides of things: as a density 2 per m^2, for what is measured exactly
_ANY = np.sin(pi / 40 * np.arange(0.5, 20)) ** 2  # a probability, unknown (Jeffreys)
_VISIBLE = _ANY[10:]  # p, where nobody knows what was seen: most of it
_UNTOLD = 0.1  # so often sizes tell nothing at all: seen in part, or by cells
_ALIKE = np.linspace(0.05, 0.95, 10)  # share of the objects that are of the size of another
_SHIFTED, _TURNED, _ANEW = 4.0, 4.0, 1.4  # nats
_KAPPA = 1.0  # of the turns, von Mises: small ones are a little likelier
_NARROWEST = 5.0  # m, side of a room
_WHERETO = np.linspace(-2, 2, 9)  # standard deviations by which an object may have been moved

MOST_OBJECTS = 500
_EXACT = 12  # up to so many objects all matchings are summed
_STARTS = 8  # so many of the alignments that fit best are refined, in so many steps
_STEPS = 6
_NEGLIGIBLE = 7.0  # nats below the best a case no longer counts
_HOPELESS = 25.0  # nats below the best an alignment cannot count, whatever the moves
_NEVER = 1e6  # nats
_PROBES = 25  # by so many objects at most it is judged how well an alignment fits
_BELIEFS = 200  # steps of belief propagation at most
_RARE = 1e-3  # pairs less probable than this connect nothing

_MOVES = 1e-3, 1e3  # m
_MOST_OBJECTS = 10_000  # numbers of objects are below: all pairs are held at once
_CERTAIN = 1 + 1e-6  # a probability that is a sum may exceed 1 by rounding


@dataclass(frozen=True, eq=False)
class Matching:
    """Which corner of environment i is which of environment j, and how sure that is (Sec. IV-A).

    Attributes
    ----------
    indices : (4N,) int array
        Corner a of i goes to corner indices[a] of j; -1 where it is left out.
    cost : float
        Literal: the total change in force in 1/alpha 1/m². Robust: the negative logarithm of the
        matching's probability, in nats.
    margin : float
        What the best of all other matchings costs more; 0 is a tie. Literal: of all other
        bijections of the corners. Robust: of all matchings with another partner for one object at
        least, in nats of probability.
    confident : bool
        False where the scene is ambiguous: ask, do not guess. Literal: the margin exceeds what
        rounding up can do, one unit per corner. Robust: the probability is at least `SURE`.
    turn : float
        By how much the layout has turned from i to j, in rad; 0 where that need not be, and with
        the literal method.
    probability : float
        Of the whole matching among all that there are; NaN with the literal method.
    pair_probabilities : (N, M + 1) array
        How probable it is that object a of i is object b of j; in the last column, that it is none
        of them. None with the literal method.

    Raises
    ------
    ValueError
        Numbers that are none of corners, or of which one is twice, a cost or margin that is none, or
        probabilities beyond 0 and 1.
    """

    indices: np.ndarray
    cost: float
    margin: float
    confident: bool
    turn: float = 0.0
    probability: float = np.nan
    pair_probabilities: np.ndarray = None

    def __post_init__(self):
        indices = checked_wholes("indices", self.indices, "C", least=-1)
        if len(indices) % 4:
            raise ValueError(f"indices must be four for each object, got {len(indices)}")
        taken = np.sort(indices[indices >= 0])
        if (taken[1:] == taken[:-1]).any():
            raise ValueError(f"a matching must not send two corners to one, got {told(indices.tolist())}")
        put_in(self, indices=indices, confident=checked_flag("confident", self.confident))
        most = float(np.finfo(float).max)
        put_in(
            self,
            cost=checked_number("cost", self.cost, 1 - _CERTAIN, most),
            turn=checked_number("turn", self.turn),
        )
        put_in(self, margin=checked_number("margin", self.margin, 1 - _CERTAIN, np.inf))
        self._check_probabilities()

    def _check_probabilities(self):
        """Probabilities are 0 to 1; those of pairs (N, M + 1) are of all partners."""
        if not (isinstance(self.probability, float) and np.isnan(self.probability)):
            put_in(self, probability=checked_number("probability", self.probability, 0, _CERTAIN))
        if self.pair_probabilities is not None:
            n, highest = len(self.partners), self.partners.max(initial=-1)
            shares = checked_array("pair_probabilities", self.pair_probabilities, n, "M + 1", least=0, most=_CERTAIN)
            if n and highest >= shares.shape[1] - 1:
                rule = f"pair_probabilities must be of all partners, up to {highest}"
                raise ValueError(f"{rule}, got those of {shares.shape[1] - 1} objects")
            put_in(self, pair_probabilities=shares)

    def __repr__(self):
        told = ", ".join(map(self._told, range(len(self.partners)))) or "none"
        whole = "" if np.isnan(self.probability) else f", as a whole {_percent(self.probability)}"
        return f"Matching of objects {told}: {'' if self.confident else 'not '}confident{whole}"

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

        Raises
        ------
        ValueError
            For what is no number of objects, or more than 10,000.
        """
        return cls.of_partners(np.arange(checked_whole("n", n, 0, _MOST_OBJECTS)))

    @classmethod
    def of_partners(cls, partners, turn=0.0):
        """A matching that somebody who knows has given, beyond doubt (beyond the paper).

        Parameters
        ----------
        partners : (N,) array_like of int
            For each object of i the one of j that it is; -1 where it has gone.
        turn : float
            By how much the layout has turned, in rad; the corners go by the nearest right angle.

        Returns
        -------
        Matching

        Raises
        ------
        ValueError
            Where two objects are to be the same one, or a number is none of an object.

        Examples
        --------
        >>> Matching.of_partners([1, -1, 0])
        Matching of objects 0 to 1, 1 gone, 2 to 0: confident, as a whole 100 %
        """
        partners = checked_wholes("partners", partners, "N", least=-1, most=_MOST_OBJECTS)
        taken = np.sort(partners[partners >= 0])
        if (taken[1:] == taken[:-1]).any():
            raise ValueError(f"partners must be numbers of objects, none twice, or -1, got {told(partners.tolist())}")
        turn = checked_number("turn", turn)
        sure = np.zeros((len(partners), taken.max(initial=-1) + 2))
        sure[np.arange(len(partners)), partners] = 1.0  # -1 is the last column
        return cls(corner_indices(partners, turn), 0.0, np.inf, True, turn, 1.0, sure)

    @property
    def partners(self):
        """(N,) int array: object a of i goes to object partners[a] of j, -1 where left out."""
        return self.indices[::4] // 4

    @property
    def sure(self):
        """(N,) bool array: what is said of this object has a probability of `SURE` at least."""
        if self.pair_probabilities is None:
            return np.full(len(self.partners), self.confident)
        return self._shares() >= SURE

    def _shares(self):
        """(N,) how probable it is what is said of each object."""
        return np.take_along_axis(self.pair_probabilities, self.partners[:, None], axis=1)[:, 0]

    def _told(self, a):
        """What is said of object a; where that is not sure, also how probable that and a rival are."""
        said = _in_words(self.partners[a])
        if self.pair_probabilities is None or self.sure[a]:
            return f"{a} {said}"
        shares = self.pair_probabilities[a].copy()
        share, shares[self.partners[a]] = shares[self.partners[a]], -1
        rival = shares.argmax()
        other = _in_words(rival if rival < len(shares) - 1 else -1)
        return f"{a} {said} ({_percent(share)}; {other} {_percent(shares[rival])})"


def _in_words(partner):
    return f"to {partner}" if partner >= 0 else "gone"


def _percent(share):
    """A probability that is not rounded up to certainty."""
    if share < 0.995 or share == 1:
        return f"{100 * share:.0f} %"
    return f"{np.floor(1e3 * share) / 10:.1f} %"


def match(environment_i, environment_j, method="robust", moved=0.4):
    """Match the corners of two environments (Sec. IV-A).

    Parameters
    ----------
    environment_i, environment_j : Environment
        At most 500 objects each: matching them takes some seconds and 700 MB. With "literal" at
        least two each.
    method : {"robust", "literal"}
        "robust" compares the layouts and the sizes of the objects, knows what could be seen, and
        takes the corners from that; objects may be missing, added or split. "literal" is the
        paper's: a bijection of the corners with the least change in spring forces.
    moved : float
        Robust only. How far objects are moved by themselves: sigma, standard deviation per axis in
        m.

    Returns
    -------
    Matching
        Look at `.confident` before use, or at `.sure` of each object.

    Raises
    ------
    ValueError
        What is no Environment, more than 500 objects; moves below a millimetre or beyond a kilometre.
        With "literal": fewer than two objects, different counts, or corners that coincide.

    Examples
    --------
    The order of the objects does not matter.

    >>> from dollop.environment import Environment
    >>> boxes = np.array([[0, 0, 0.4, 0.4], [3, 1, 3.4, 1.4], [1, 4, 1.4, 4.4]])
    >>> match(Environment(boxes), Environment(boxes[[2, 0, 1]])).indices.tolist()
    [4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3]

    One object against another one far away, of another size: these are two.

    >>> match(Environment([[0, 0, 0.3, 0.3]]), Environment([[4, 0, 4.8, 0.5]])).partners.tolist()
    [-1]
    """
    check_choice("method", method, ("robust", "literal"))
    moved = checked_number("moved", moved, *_MOVES)
    checked_record("environment_i", environment_i, Environment)
    checked_record("environment_j", environment_j, Environment)
    most = max(len(environment_i), len(environment_j))
    if most > MOST_OBJECTS:
        rule = f"environments to match must have at most {MOST_OBJECTS} objects"
        raise ValueError(f"{rule}, got {most}")
    if method == "robust":
        return _match_robustly(environment_i, environment_j, moved)
    counts = f"{len(environment_i)} and {len(environment_j)}"
    if min(len(environment_i), len(environment_j)) < 2:
        raise ValueError(f"the literal method needs at least 2 objects in each, got {counts}")
    if len(environment_i) != len(environment_j):
        raise ValueError(f"the literal method needs the same number of objects, got {counts}")
    return _match_literally(environment_i, environment_j)


def match_surely(environment_i, environment_j, names):
    """The robust matching of two environments, as far as it is sure (reconstruction).

    Where all boxes are the same, none has moved.

    Parameters
    ----------
    environment_i, environment_j : Environment
    names : (str, str)
        What to call the two in errors and notes.

    Returns
    -------
    matching : Matching
        Objects of which it is not sure what became of them are left out.
    notes : tuple of Note
        Which these are, and how probable what is.

    Raises
    ------
    ValueError
        What is no Environment; or where nothing is sure of any object: then ask the user, do not guess.

    Examples
    --------
    Two objects that turned by a right angle could be either way round.

    >>> from dollop.environment import Environment
    >>> before = Environment([[0, 0, 1, 1], [3, 0, 4, 1]])
    >>> match_surely(before, before, ("before", "after"))[0].partners.tolist()
    [0, 1]
    >>> after = Environment([[1.5, -1.5, 2.5, -0.5], [1.5, 1.5, 2.5, 2.5]])
    >>> match_surely(before, after, ("before", "after"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ValueError: before and after cannot be matched with confidence: ...
    """
    for name, environment in zip(names, (environment_i, environment_j), strict=True):
        checked_record(name, environment, Environment)
    if np.array_equal(environment_i.boxes, environment_j.boxes):
        return Matching.identity(len(environment_i)), ()
    matching = match(environment_i, environment_j)
    doubtful = np.flatnonzero(~matching.sure)
    pair, found = " and ".join(names), ", ".join(map(matching._told, range(len(environment_i))))
    nothing = not (matching.sure & (matching.partners >= 0)).any()
    if nothing and min(len(environment_i), len(environment_j)):
        rule = f"no pair reaches the {_percent(SURE)} that it takes"
        advice = "give matching= or matchings=, see Matching.of_partners, or move the objects apart"
        found = shortened(found, 80)
        raise ValueError(f"{pair} cannot be matched with confidence: {found}; {rule}; {advice}")
    if not len(doubtful):
        return matching, ()
    found = ", ".join(map(matching._told, doubtful))
    indices = np.where(np.repeat(matching.sure, 4), matching.indices, -1)
    text = f"{pair}: not sure which object is which, and left out: {found}"
    return replace(matching, indices=indices), (Note("matching", text, doubt=False),)


def _match_literally(environment_i, environment_j):
    costs = integer_costs(environment_i.corners, environment_j.corners)
    rows, indices = scipy.optimize.linear_sum_assignment(costs)
    margin = second_best(costs, indices)
    return Matching(indices, float(costs[rows, indices].sum()), margin, margin > len(indices))


def _match_robustly(environment_i, environment_j, moved):
    n, m = len(environment_i), len(environment_j)
    if not (n and m):
        told = np.eye(m + 1)[np.full(n, m)]
        return replace(Matching.of_partners(np.full(n, -1)), pair_probabilities=told)
    scene = _Scene((environment_i, environment_j), moved)
    cases = _that_count(_cases(scene, *_alignments(scene)))
    sums, marginals = (_summed if min(n, m) <= _EXACT else _summed_in_parts)(cases)
    total = np.logaddexp.reduce(sums)
    pairs = np.tensordot(np.exp(sums - total), marginals, axes=1)
    partners, likely, margin = _best(cases, pairs)
    told = np.column_stack([pairs, np.maximum(1 - pairs.sum(axis=1), 0)])
    said = np.take_along_axis(told, partners[:, None], axis=1)
    probability = float(min(np.exp(np.logaddexp.reduce(likely) - total), said.min()))
    turn = float(np.angle(cases.turns[likely.argmax()]))
    indices, confident = corner_indices(partners, turn), probability >= SURE
    return Matching(indices, -float(np.log(probability)), margin, confident, turn, probability, told)


# ---- how probable a pair is, and that an object is left out


@dataclass(frozen=True, eq=False)
class _Scene:
    """Two environments, and how far objects are moved: sigma in m, the unit of x, y and area."""

    environments: tuple
    moved: float

    @cached_property
    def x(self):
        """(N,) complex array: middles of the objects of i."""
        return self.environments[0].centres @ (1, 1j) / self.moved

    @cached_property
    def y(self):
        """(M,) complex array: middles of the objects of j."""
        return self.environments[1].centres @ (1, 1j) / self.moved

    @cached_property
    def area(self):
        """Of the room: of the floor that was seen, else as far as objects are spread."""
        seen = [each.seen for each in self.environments if each.seen is not None]
        areas = [np.count_nonzero(each.floor) * each.resolution**2 for each in seen]
        spreads = [_spread(each.centres).prod() for each in self.environments]
        return max(_NARROWEST**2, *(areas or spreads)) / self.moved**2

    @cached_property
    def blur(self):
        """(N, M) array: variance per axis of the difference between two middles, as measured."""
        # The middle is the mean of two sides: a quarter of their variances, that of the extent.
        i, j = (_extents(each)[1].mean(axis=1) / (2 * self.moved) ** 2 for each in self.environments)
        return i[:, None] + j

    @cached_property
    def sizes(self):
        """(2, N, M) array: log s / sqrt(g g), as the boxes lie and turned by a right angle."""
        return _size_ratios(*self.environments)


def _spread(centres):
    """Width and depth in m of a room in which objects stand that far apart."""
    n = len(centres)
    # n places anywhere along a line of 1 are (n - 1) / (n + 1) apart, in the mean.
    return np.maximum(np.ptp(centres, axis=0) * (n + 1) / max(n - 1, 1), _NARROWEST)


def _extents(environment):
    """Sizes (N, 2) in m of the boxes, and their variances in m^2."""
    sides = np.where(environment.assumed, _ASSUMED, _REACHED) ** 2
    return environment.boxes[:, 2:] - environment.boxes[:, :2], sides[:, :2] + sides[:, 2:]


def _size_ratios(environment_i, environment_j):
    extents, variances = zip(_extents(environment_i), _extents(environment_j), strict=True)
    new_i, new_j = _as_new(extents, variances)
    any_i, any_j = map(_any_size, variances)
    any_size = _MISJUDGED * np.sqrt(any_i[:, None] * any_j)
    ratios = []
    for axes in ([0, 1], [1, 0]):
        same = _normal(extents[0][:, axes], extents[1], variances[0][:, axes], variances[1])
        ratios.append(np.log(_MEASURED * same + any_size) - (new_i[:, None] + new_j) / 2)
    return np.array(ratios)


def _normal(one, other, variances_one, variances_other):
    """(N, M) density in 1/m^2 of one size (M, 2), if its thing is that of another one (N, 2)."""
    # What is measured worse than things differ says no more of the other than that they are things.
    both = [(each + each * _SIZES**2 / (each + _SIZES**2)) / 2 for each in (variances_one, variances_other)]
    variances = both[0][:, None] + both[1]
    squares = (one[:, None] - other) ** 2 / variances
    return np.exp(-squares.sum(axis=2) / 2) / (2 * pi * np.sqrt(variances.prod(axis=2)))


def _any_size(variances):
    """(N,) density B in 1/m^2 of a size, measured with variances (N, 2), of no thing in particular."""
    return 1 / (2 * pi * np.sqrt((variances + _SIZES**2).prod(axis=1)))


def _as_new(extents, variances):
    """Logarithmic densities g (N,), (M,) of the sizes, were each that of a new object.

    It is like one of the others beside it, or any; how often which, the two environments tell.
    """
    like = [_like_others(*each) for each in zip(extents, variances, strict=True)]
    other = [_any_size(each) for each in variances]
    beside = [np.stack(each) for each in zip(like, other, strict=True) if len(each[0]) > 1]
    like_any = np.concatenate([np.empty((2, 0)), *beside], axis=1)
    evidence = np.log(_ALIKE[:, None] * like_any[0] + (1 - _ALIKE[:, None]) * like_any[1]).sum(axis=1)
    alike = np.average(_ALIKE, weights=np.exp(evidence - evidence.max()))
    across = _normal(*extents, *variances)
    for k, each in enumerate(like):
        if len(each) == 1:  # there are no others beside it
            like[k] = across.mean(axis=1 - k)
    return [np.log(alike * each + (1 - alike) * any_size) for each, any_size in zip(like, other, strict=True)]


def _like_others(extents, variances):
    same = _normal(extents, extents, variances, variances)
    return (same.sum(axis=1) - np.diag(same)) / max(len(extents) - 1, 1)


def _count_weights(n, m, unseen_i=True, unseen_j=True, p=_VISIBLE):
    """(K + 1,) log w_k for k = 0 ... K = min(N, M) pairs, with the mean over p where it is unknown."""
    k = np.arange(min(n, m) + 1)
    p = p[:, None]
    chances = ((n - k) * unseen_j + (m - k) * unseen_i) * np.log(1 - p)
    chances = chances + (n * unseen_i + m * unseen_j) * np.log(p)
    if unseen_i and unseen_j:
        chances = chances - (n + m - k) * np.log(p * (2 - p))  # to be seen at all
    return scipy.special.gammaln(n + m - k) + np.logaddexp.reduce(chances, axis=0) - np.log(len(p))


@dataclass(frozen=True, eq=False)
class _Cases:
    """H ways in which the one scene may have become the other; all but the turns logarithmic.

    turns (H,), complex; counts (H, K + 1): the prior and w_k for k pairs; ratios (H, N, M): what a
    pair has over leaving out both.
    """

    turns: np.ndarray
    counts: np.ndarray
    ratios: np.ndarray

    def __getitem__(self, rows):
        return _Cases(self.turns[rows], self.counts[rows], self.ratios[rows])


def _cases(scene, turns, shifts, priors, free):
    """The layouts (H,), each with small and large moves, few and many carried off; or put up anew."""
    n, m = len(scene.x), len(scene.y)
    images = turns[:, None] * scene.x + shifts[:, None]
    origins = (scene.y - shifts[:, None]) / turns[:, None]
    i, j = scene.environments
    lost_i, over_i = _found(i, j, images * scene.moved, scene.moved)
    lost_j, over_j = _found(j, i, origins * scene.moved, scene.moved)
    counts = _count_weights(n, m, i.seen is None, j.seen is None)
    counts = counts + (priors + lost_i + lost_j)[:, None]
    others, sizes = over_i[:, :, None] + over_j[:, None], scene.sizes[_quarters(turns)]
    told = [(sizes, np.log(1 - _UNTOLD)), (0.0, np.log(_UNTOLD))]
    squares = np.abs(scene.y - images[:, :, None]) ** 2
    variances = {spread: scene.blur + spread**2 for spread in (0.0, *_SPREADS)}
    near = {spread: _normal_at(squares, each) * scene.area for spread, each in variances.items()}
    ratios, known = [], []
    for spread, still, carried in product(_SPREADS, _STILL, _CARRIED):
        shifted = (1 - still) * near[spread] + still * near[0.0]
        ratio = np.log((1 - carried) * shifted + carried) + others
        # The less was moved, the better shift and turn are known.
        room = free * np.log(np.sqrt(scene.blur.min()) if still else spread)
        # Untouched though turned about its own middle: no frame of reference does that to a layout.
        room = np.where(still * (free == 1), -_NEVER, room)
        for size, prior in told:
            ratios.append(ratio + size)
            known.append(room + prior)
    # Of what was put up anew nobody knows how many are still the same, nor whether all were seen.
    anew, turns = _count_weights(n, m, p=_ANY) - _ANEW, np.append(1, np.tile(turns, len(known)))
    counts = np.vstack([anew, *(counts + each[:, None] - np.log(len(known) / len(told)) for each in known)])
    return _Cases(turns, counts, np.concatenate([scene.sizes[:1], *ratios]))


def _normal_at(squares, variances):
    return np.exp(-squares / (2 * variances)) / (2 * pi * variances)


def _found(environment, other, places, moved):
    """If objects stood at places (H, N) in the other one, in m: would they be found?

    log q of all together (H,), and log sqrt(1 - q) / q of each (H, N); 0 where that is unknown.
    """
    if other.seen is None:
        return np.zeros(len(places)), np.zeros(places.shape)
    seen = other.seen
    own = covered_cells(other.boxes, seen.origin, seen.resolution, seen.floor.shape)
    seen = replace(seen, floor=seen.floor | own)
    offsets = np.stack(np.meshgrid(_WHERETO, _WHERETO), axis=-1).reshape(-1, 2)
    # A point of the box after the move is about normal.
    extents = environment.boxes[:, 2:] - environment.boxes[:, :2]
    spread = np.sqrt(moved**2 + extents**2 / 12)
    middles = np.stack([places.real, places.imag], axis=-1)
    found = seen.at(middles[:, :, None] + spread[:, None] * offsets).reshape(*places.shape, -1)
    p = _FOUND * np.average(found, axis=2, weights=np.exp(-(offsets**2).sum(axis=1) / 2))
    p = np.maximum(p, 1 - _FOUND)
    return np.log(1 - p).sum(axis=1), np.log(p) / 2 - np.log(1 - p)


# ---- how the layout lies as a whole


def _alignments(scene):
    """In place, and what fits best of all that were moved as a whole: x at turns * x + shifts.

    Turns, shifts, complex, their logarithmic priors with the room that they are uncertain by, and
    how many of their numbers are free, each (H,).
    """
    turns, shifts, priors, free = (
        np.ones(1, complex),
        np.zeros(1, complex),
        np.zeros(1),
        np.zeros(1),
    )
    if min(len(scene.x), len(scene.y)) > 1:
        found = _refined(scene, *_starts(scene))
        placed = zip((turns, shifts, priors, free), found, strict=True)
        turns, shifts, priors, free = (np.append(*each) for each in placed)
    near = _near(scene, _central(scene.x), turns, shifts)
    fits = np.log1p(near.sum(axis=2)).sum(axis=1) + priors
    kept = fits > fits.max() - _HOPELESS
    return turns[kept], shifts[kept], priors[kept], free[kept]


def _starts(scene):
    """Turns and shifts (H,) that bring objects near others, pivots, and whether they may turn."""
    circle = np.exp(1j * np.arange(8) * pi / 4)
    shifted, turned = _fitting(scene, circle[:1]), _fitting(scene, circle)
    free = np.full(len(shifted[0]) + len(turned[0]), np.nan)
    pivots = np.repeat([scene.x.mean(), scene.y.mean()], 8)
    about = np.tile(circle, 2), pivots * (1 - np.tile(circle, 2))
    turns, shifts = (np.concatenate(each) for each in zip(shifted, turned, about, strict=True))
    return turns, shifts, np.append(free, pivots), np.arange(len(turns)) >= len(shifted[0])


def _fitting(scene, turns):
    """Of turns (T,) about any place to any other those that bring most objects near others."""
    x, y = scene.x, scene.y
    anchors, probes = x[_central(x)[: max(3, 50 // len(y))]], x[_central(x)]
    # Either the means coincide, or a central object falls on one of the others.
    shifts = y[:, None, None] - np.multiply.outer(anchors, turns)
    shifts = np.vstack([y.mean() - turns * x.mean(), shifts.reshape(-1, len(turns))])
    images = np.multiply.outer(probes, turns)[:, None] + shifts
    tree = scipy.spatial.cKDTree(np.c_[y.real, y.imag])
    distances, _ = tree.query(np.stack([images.real, images.imag], axis=-1))
    fits = np.exp(-(distances**2) / 2).sum(axis=0).ravel()
    chosen = np.argsort(-fits, kind="stable")[:_STARTS]
    return turns[chosen % len(turns)], shifts.ravel()[chosen]


def _central(places):
    """Some of the places, the central ones first."""
    return np.argsort(np.abs(places - places.mean()), kind="stable")[:_PROBES]


def _refined(scene, turns, shifts, pivots, turning):
    """As `_alignments`, those that fit best near the given ones, each once."""
    chosen, fixed = _central(scene.x), ~np.isnan(pivots)
    x = scene.x[chosen]
    for _ in range(_STEPS):
        same = _same(_near(scene, chosen, turns, shifts))
        middle_x = np.where(fixed, pivots, _means(x, same.sum(axis=2)))
        middle_y = np.where(fixed, pivots, _means(scene.y, same.sum(axis=1)))
        z, w = x - middle_x[:, None], scene.y - middle_y[:, None]
        likeness = (z.conj() * np.matmul(same, w[..., None])[..., 0]).sum(axis=1)
        turns = np.where(turning, np.exp(1j * np.angle(likeness)), turns)
        shifts = middle_y - turns * middle_x
    # How well shift and turn are known (Laplace), as shares of all that there are.
    information = (same.sum(axis=2) * np.abs(z) ** 2).sum(axis=1)
    turn_room = np.log(2 * pi * np.maximum(information, 1 / (2 * pi))) / 2
    shift_room = np.log(np.maximum(same.sum(axis=(1, 2)) * scene.area / (2 * pi), 1.0))
    turn_prior, shift_prior = (
        -_TURNED - turn_room,
        np.where(fixed, -np.log(2), -_SHIFTED - shift_room),
    )  # of two pivots
    free = turning + 2.0 * ~fixed
    kept = _distinct(turns[:, None] * x + shifts[:, None], free + 4 * (pivots == pivots[-1]))
    return (
        turns[kept],
        shifts[kept],
        (np.where(turning, turn_prior, 0.0) + shift_prior)[kept],
        free[kept],
    )


def _near(scene, chosen, turns, shifts):
    """(H, n, M) what it is worth that chosen objects are those near which they lie."""
    images = turns[:, None] * scene.x[chosen] + shifts[:, None]
    squares = np.abs(scene.y - images[:, :, None]) ** 2
    return np.exp(scene.sizes[:, chosen][_quarters(turns)] - squares / 2) * scene.area / (2 * pi)


def _same(near):
    """(H, n, M) how surely each is the same as each, roughly."""
    return near / np.sqrt((1 + near.sum(axis=2))[:, :, None] * (1 + near.sum(axis=1))[:, None])


def _means(places, weights):
    return weights @ places / np.maximum(weights.sum(axis=1), 1e-9)


def _quarters(turns):
    """Whether boxes lie turned by a right angle (1) or not (0)."""
    return np.round(np.angle(turns) / (pi / 2)).astype(int) % 2


def _distinct(images, families):
    """Rows of images (H, N) that are not near an earlier one of the same family."""
    kept = []
    for row, (image, family) in enumerate(zip(images, families, strict=True)):
        rivals = [other for other in kept if families[other] == family]
        if not rivals or np.abs(images[rivals] - image).max(axis=1).min() > 0.5:
            kept.append(row)
    return kept


def _that_count(cases):
    """Those alone that may hold a share of the probability worth telling."""
    step = np.diff(cases.counts[:, [0, -1]])[:, :, None] / (cases.counts.shape[1] - 1)
    every = 1 + cases.ratios.shape[1] // (2 * _PROBES)  # of a crowd some speak for the others
    pairs = np.exp(cases.ratios[:, ::every] + step)
    bounds = [np.log1p(pairs.sum(axis=axis)).sum(axis=1) for axis in (1, 2)]
    bound = cases.counts[:, 0] + every * np.minimum(*bounds)
    return cases[bound > bound.max() - _NEGLIGIBLE]


# ---- all matchings


def _summed(cases):
    """Logarithmic sum (H,) over all partial matchings, and the share (H, N, M) with each pair.

    Row by row, over the sets of columns that are taken; a set is a number, a bit for each column.
    """
    if cases.ratios.shape[2] > cases.ratios.shape[1]:
        sums, marginals = _summed(replace(cases, ratios=cases.ratios.swapaxes(1, 2)))
        return sums, marginals.swapaxes(1, 2)
    pairs = np.moveaxis(np.exp(cases.ratios), 0, 2).copy()
    n, m, h = pairs.shape
    before = np.zeros((n + 1, 2**m, h))
    before[0, 0] = 1
    for row in range(n):
        before[row + 1] = before[row]
        for column in range(m):
            free, taken = _by_column(before[row], column)[0], _by_column(before[row + 1], column)[1]
            taken += pairs[row, column] * free
    scale = cases.counts.max(axis=1)
    after = np.exp(cases.counts - scale[:, None]).T[_bits(m)]
    marginals = np.empty_like(pairs)
    for row in reversed(range(n)):
        later = after.copy()
        for column in range(m):
            taken = _by_column(later, column)[1] * pairs[row, column]
            free = _by_column(before[row], column)[0]
            marginals[row, column] = np.einsum("abh,abh->h", free, taken)
            after_free = _by_column(after, column)[0]
            after_free += taken
    return np.log(after[0]) + scale, np.moveaxis(marginals / after[0], 2, 0)


def _by_column(sets, column):
    """Views of (2^M, H) values: of the sets without a column, and of the same ones with it."""
    view = sets.reshape(-1, 2, 2**column, sets.shape[1])
    return view[:, 0], view[:, 1]


def _bits(m):
    """(2^m,) int array: how many bits are set."""
    sizes = np.zeros(1, int)
    for _ in range(m):
        sizes = np.append(sizes, sizes + 1)
    return sizes


def _best(cases, pairs):
    """The most probable matching (N,), its logarithmic weight (H,) in each case, and the margin."""
    steps, found = np.diff(cases.counts), [_assigned(pairs, -0.5)]
    for ratios, step in zip(cases.ratios, steps, strict=True):
        found.extend(_assigned(ratios, each) for each in {step[0], step[len(step) // 2], step[-1]})
    found = np.unique(found, axis=0)
    likely = _likelihoods(cases, found)
    partners = found[np.logaddexp.reduce(likely, axis=1).argmax()]
    if len(partners) <= _EXACT:
        found = np.unique(np.vstack([found, _neighbours(partners, cases.ratios.shape[2])]), axis=0)
        likely = _likelihoods(cases, found)
    totals = np.logaddexp.reduce(likely, axis=1)
    best, *others = np.argsort(-totals, kind="stable")
    partners, h = found[best], likely[best].argmax()
    margin = np.min(totals[best] - totals[others], initial=np.inf)
    if len(partners) > _EXACT:
        last = min(max(np.count_nonzero(partners >= 0) - 1, 0), steps.shape[1] - 1)
        margin = min(margin, second_best(-cases.ratios[h] - steps[h, last], partners, 0.0))
    return partners, likely[best], float(margin)


def _neighbours(partners, m):
    """Matchings (P, N) with another partner or none for one object, or two that changed theirs."""
    n, free = len(partners), np.setdiff1d(np.arange(m), partners)
    others = []
    for a, b in product(range(n), [-1, *free]):
        others.append(partners.copy())
        others[-1][a] = b
    for pair in combinations(range(n), 2):
        others.append(partners.copy())
        others[-1][list(pair)] = partners[list(pair)][::-1]
    return others


def _assigned(ratios, step):
    """The matching (N,) that has most, if each pair has its ratio and a step."""
    costs = np.minimum(-ratios - step, 0.0)
    rows, columns = scipy.optimize.linear_sum_assignment(costs)
    partners = np.full(len(costs), -1)
    used = costs[rows, columns] < 0
    partners[rows[used]] = columns[used]
    return partners


def _likelihoods(cases, found):
    """Logarithmic weights (P, H) of matchings (P, N) in each case."""
    ratios = np.pad(cases.ratios, ((0, 0), (0, 0), (0, 1)))  # -1 is the last column
    pairs = ratios[:, np.arange(found.shape[1]), found].sum(axis=2)
    return (cases.counts[:, np.count_nonzero(found >= 0, axis=1)] + pairs).T


# ---- crowds


def _summed_in_parts(cases):
    """As `_summed`, for many objects: by belief propagation, and exactly where few hang together.

    One pair more changes the weight as it does about the number of pairs of the best matching.
    """
    sums, marginals = np.empty(len(cases.ratios)), np.empty_like(cases.ratios)
    for row, (ratios, counts) in enumerate(zip(cases.ratios, cases.counts, strict=True)):
        k = np.count_nonzero(_assigned(ratios, counts[-1] - counts[-2]) >= 0)
        step = counts[max(k, 1)] - counts[max(k, 1) - 1]
        sums[row], marginals[row] = _in_parts(np.exp(ratios + step))
        sums[row] += counts[k] - k * step
    return sums, marginals


def _in_parts(pairs):
    """Logarithmic sum over all matchings of weights (N, M), and the marginals (N, M)."""
    marginals = _believed(pairs)
    near = marginals > _RARE
    far = np.where(near, 0.0, marginals).sum(axis=1)
    total = -np.log1p(-np.minimum(far, 0.999)).sum()
    for rows, columns in _parts(near):
        part = np.ix_(rows, columns)
        weights = np.log(np.where(near[part], pairs[part], 1e-300))
        if min(weights.shape) <= _EXACT:
            counts = np.zeros((1, min(weights.shape) + 1))
            sums, shares = _summed(_Cases(np.ones(1), counts, weights[None]))
            total, marginals[part] = total + sums[0], shares[0] * (1 - far[rows])[:, None]
        else:
            total += _at_least(weights, marginals[part])
    return total, marginals


def _at_least(weights, marginals):
    """Logarithmic sum of a part, where the best matching is as probable as its marginals together.

    Taken for independent they underrate what hangs together: so it is not sure too easily.
    """
    partners = _assigned(weights, 0.0)
    told = np.column_stack([marginals, 1 - marginals.sum(axis=1)])
    said = told[np.arange(len(partners)), partners]
    used = partners >= 0
    return weights[used, partners[used]].sum() - np.log(np.maximum(said, 1e-12)).sum()


def _parts(near):
    """Rows and columns (N, M) that pairs hold together, a list of two int arrays each."""
    n, m = near.shape
    rows, columns = np.nonzero(near)
    graph = scipy.sparse.coo_array((np.ones(len(rows)), (rows, columns + n)), shape=(n + m, n + m))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    held = np.unique(label[rows])
    return [(np.flatnonzero(label[:n] == each), np.flatnonzero(label[n:] == each)) for each in held]


def _believed(pairs):
    """Marginals (N, M) by belief propagation for matchings (Williams and Lau 2014).

    It always converges, but what hangs together in circles comes out surer than it is.
    """
    back = np.ones_like(pairs)
    for _ in range(_BELIEFS):
        sent = pairs * back
        there = pairs / (1 + sent.sum(axis=1, keepdims=True) - sent)
        previous, back = back, 1 / (1 + there.sum(axis=0) - there)
        if np.abs(back - previous).max() < 1e-6:
            break
    sent = pairs * back
    return sent / (1 + sent.sum(axis=1, keepdims=True))


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
