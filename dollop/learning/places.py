"""Which object does each place of a task follow? (Sec. IV-B, from the evidence of several demonstrations.)

A way is L places, one after the other. A place that follows object j has the same offset from j in
every demonstration, and offsets metres apart from all others. So for each place l there are
candidates c, sets of weights w over the frames (`dollop.learning.frames`): one frame alone, or a
place between two objects. With X[d, l] the place in demonstration d,

    local[l, F]     = mean over d of X[d, l] as seen from frame F
    error[d, l, F]  = local[l, F], back in demonstration d, - X[d, l]
    P(c | l)       ~ closeness(c) * evidence of sum_F w[c, F] error[d, l, F]

The evidence is that of Normal-inverse-Wishart offsets whose mean is anywhere in the room;
closeness, the paper's kind of weight, is the prior: of one demonstration nothing else is left. What
a place follows changes seldom along the way: the candidates are the states of a hidden Markov
chain, and P is its posterior. The weights of the frames are then

    w[l] = argmin  sum_d |sum_F w_F error[d, l, F]|^2 / sigma^2 + |w - sum_c P(c | l) w[c]|^2 /
    tau^2,   sum_F w_F = 1,

which learns what lies between the candidates from many demonstrations, and leaves them alone where
there are few; and in a new environment the place is at sum_F w[l, F] (local[l, F], back there). All
this is a reconstruction.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

__all__ = ["Places", "candidates", "tied_places"]

SPREAD, WIDTH, NU = 0.15, 3.0, 8.0
"""m: how far walks miss a place that they follow, and how far places lie from objects; degrees of freedom of that."""
CELL = 0.05
"""m: objects are not known better than to a cell of the foreground grid."""
BETWEEN, MIXED = (0.25, 0.5, 0.75), 1 / 3
"""Places between two objects that are candidates, and how likely each is beside one object alone."""
MOST_PAIRS = 500
"""Pairs of objects between which a place may lie. Candidates are compared with each other, which
takes time with the square of the pairs: of 32 objects some seconds."""
STAY, STEP, JUMP = 0.5, 0.25, 0.02
"""Of the chain: what the next place follows is the same, a neighbour between the same two objects, or anything."""
SIGMA, TAU, LEAST = 0.3, 0.1, 0.03
"""m and shares: how far a weighted place may miss, how far weights move from the candidates' for it, and of how much
of the way a frame is followed at least to be among them."""


@dataclass(frozen=True, eq=False)
class Places:
    """L places of a way and the frames that they follow.

    Attributes
    ----------
    weights : (L, F) float array
        How much each place follows each frame; each row sums to 1.
    local : (L, F, 2) float array
        Each place as seen from each frame, in m.
    posterior : (L, C) float array
        How probable it is that each place follows each of the candidates.
    candidates : (C, F) float array
        Their weights.
    """

    weights: np.ndarray
    local: np.ndarray
    posterior: np.ndarray
    candidates: np.ndarray

    def among(self, frames):
        """Where the places are among the frames as they stand.

        Parameters
        ----------
        frames : Frames
            The same F frames in D environments. The weights of those that are not there go to the
            others.

        Returns
        -------
        (D, L, 2) float array
            In m; nan where none of a place's frames is there.
        """
        weights = self.weights * frames.present[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            weights = weights / weights.sum(axis=2, keepdims=True)
        return np.einsum("dlf,dlfk->dlk", weights, frames.back(self.local))


def candidates(frames, told_apart, shown=None):
    """What a place may follow (a reconstruction).

    Parameters
    ----------
    frames : Frames
    told_apart : bool
        Whether several demonstrations tell objects, world and places between them apart; else
        single objects only.
    shown : sequence of D (M, 2) float arrays, optional
        Places of a way in m. Of more than 500 pairs, those of 32 objects, only so many are taken,
        which are nearest to it; without a way the first.

    Returns
    -------
    (C, F) float array
        Weights; each row sums to 1.
    """
    n, world = len(frames), len(frames) - 1
    alone = np.eye(n)
    if not told_apart:
        return alone[:world] if world else alone
    pairs = [pair for pair in combinations(range(world), 2) if frames.turning[pair[0]] == frames.turning[pair[1]]]
    if len(pairs) > MOST_PAIRS:
        away = np.zeros(world) if shown is None else _ways_off(frames, shown)
        nearest = np.argsort(away[np.array(pairs)].sum(axis=1), kind="stable")[:MOST_PAIRS]
        pairs = [pairs[k] for k in np.sort(nearest)]
    shares = np.array(BETWEEN)[:, None]
    mixed = [(1 - shares) * alone[a] + shares * alone[b] for a, b in pairs]
    return np.concatenate([alone, *mixed])


def _ways_off(frames, shown):
    """How far (F - 1,) in m objects are from D ways (M, 2), where they are nearest to one."""
    both = zip(frames.origins[:, :-1], shown, strict=True)
    away = [cKDTree(walk).query(origins)[0] for origins, walk in both]
    return np.where(frames.present[:, :-1], away, np.inf).min(axis=0)


def tied_places(points, valid, frames, chained=True):
    """The places of a way, from where demonstrations had them, and what each candidate is worth (a reconstruction).

    Parameters
    ----------
    points : (D, L, 2) float array
        In m.
    valid : (D, L) bool array
        Which places demonstration d has shown.
    frames : Frames
        Of the D demonstrations.
    chained : bool
        Whether neighbours follow alike.

    Returns
    -------
    Places
    """
    apart = told_apart(frames)
    shown = [walk[each] for walk, each in zip(points, valid, strict=True)]
    weights = candidates(frames, apart, shown)
    local, error, counted = seen_from(points, valid, frames)
    logarithms = log_prior(weights, points, valid, local, frames)
    if apart:
        logarithms = logarithms + log_evidence(weights, local, error, counted)
    posterior = chain(logarithms, weights) if chained and apart else scipy.special.softmax(logarithms, axis=1)
    followed = posterior @ weights
    return Places(refined(followed, error) if apart else followed, local, posterior, weights)


def told_apart(frames):
    """Whether something stood elsewhere in one demonstration than in another."""
    both = frames.present[:, None] & frames.present
    moved = np.linalg.norm(frames.origins[:, None] - frames.origins, axis=3)
    turned = np.abs(np.exp(1j * frames.turns[:, None]) - np.exp(1j * frames.turns))
    return len(frames.origins) > 1 and bool((both & ((moved > CELL) | (turned > CELL))).any())


def seen_from(points, valid, frames):
    """Mean offsets (L, F, 2), their errors (D, L, F, 2) and which of them count (D, L, F)."""
    counted = valid[:, :, None] & frames.present[:, None]
    offsets = frames.seen(points)
    number = np.maximum(counted.sum(axis=0), 1)[..., None]
    local = (offsets * counted[..., None]).sum(axis=0) / number
    error = (frames.back(local) - points[:, :, None]) * counted[..., None]
    return local, error, counted


def log_prior(weights, points, valid, local, frames):
    """(L, C): closeness of the candidates, the paper's kind of weight; the world is as close as `WIDTH`."""
    squares = ((local[:, :, None] - frames.corners) ** 2).sum(axis=3)
    near = (1 / (squares + CELL**2)).mean(axis=2)
    near[:, -1] = 1 / WIDTH**2
    near[:, frames.turning] /= 2
    near[:, np.isin(np.arange(len(frames)), _doubled(frames))] /= 2
    alone = len(frames) if len(weights) >= len(frames) else len(weights)
    middle = np.einsum("cf,lfk->lck", weights[alone:], local)
    mixed = MIXED / ((middle**2).sum(axis=2) + CELL**2)
    return np.log(np.concatenate([near[:, :alone], mixed], axis=1))


def _doubled(frames):
    """The still frames of objects that also have a turning one."""
    turning = frames.objects[frames.turning]
    return np.flatnonzero(np.isin(frames.objects, turning) & ~frames.turning & (frames.objects >= 0))


def log_evidence(weights, local, error, counted):
    """(L, C) in nats: of the errors of each candidate's place over the demonstrations."""
    used = (weights > 0).astype(float)
    seen = np.einsum("dlf,cf->dlc", (~counted).astype(float), used) == 0
    missed = np.einsum("dlfk,cf->dlck", error, weights) * seen[..., None]
    mean = np.einsum("lfk,cf->lck", local, weights)
    shown = counted.any(axis=2).sum(axis=0)[:, None]
    number = seen.sum(axis=0)
    kappa, psi = (SPREAD / WIDTH) ** 2, (NU - 3) * SPREAD**2
    x, y = missed[..., 0], missed[..., 1]
    share = kappa * number / (kappa + number)
    xx = psi + (x * x).sum(axis=0) + share * mean[..., 0] ** 2
    yy = psi + (y * y).sum(axis=0) + share * mean[..., 1] ** 2
    xy = (x * y).sum(axis=0) + share * mean[..., 0] * mean[..., 1]
    gammas = scipy.special.gammaln((NU + number) / 2) + scipy.special.gammaln((NU + number - 1) / 2)
    logarithm = gammas - number * np.log(np.pi) - np.log1p(number / kappa) + 0 * mean[..., 0]
    logarithm += NU * np.log(psi) - 0.5 * (NU + number) * np.log(xx * yy - xy * xy)
    return logarithm - (shown - number) * np.log(2 * np.pi * WIDTH**2)


def chain(logarithms, weights):
    """Posterior (L, C) of a chain of candidates: forward and backward."""
    step = steps(weights)
    values = np.exp(logarithms - logarithms.max(axis=1, keepdims=True)) + 1e-300
    forward, backward = values.copy(), np.ones_like(values)
    forward[0] /= forward[0].sum()
    for place in range(1, len(values)):
        forward[place] *= forward[place - 1] @ step
        forward[place] /= forward[place].sum()
    for place in range(len(values) - 2, -1, -1):
        backward[place] = step @ (values[place + 1] * backward[place + 1])
        backward[place] /= backward[place].sum()
    posterior = forward * backward
    return posterior / posterior.sum(axis=1, keepdims=True)


def steps(weights):
    """(C, C): how probable it is that the next place follows another candidate."""
    apart = cdist(weights, weights, "cityblock") / 2
    nearest = BETWEEN[0] * 1.01
    step = np.where(apart <= nearest, STEP, 0.0)
    step[apart < 1e-9] = STAY
    step += JUMP / len(weights)
    step /= step.sum(axis=1, keepdims=True)
    return step


def refined(followed, error):
    """Weights (L, F) after the errors (D, L, F, 2) of several demonstrations; each row sums to 1."""
    used = np.flatnonzero(followed.mean(axis=0) > LEAST)
    chosen = error[:, :, used]
    scatter = np.einsum("dlfk,dlgk->lfg", chosen, chosen) / SIGMA**2
    start = followed[:, used]
    system = scatter + np.eye(len(used)) / TAU**2
    change = -np.linalg.solve(system, (scatter @ start[..., None]))[..., 0]
    ones = np.linalg.solve(system, np.ones((*start.shape, 1)))[..., 0]
    change -= ones * (change.sum(axis=1) / ones.sum(axis=1))[:, None]
    weights = followed.copy()
    weights[:, used] += change
    return weights
