"""What follows from a choice: laser, walker, laws, tasks and models as reconstructed.

Where a choice is as told, this is the library's own way, to the last digit; what it does not
offer is here, as simply as it can be.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.cdhmm.alignment import compact, numbered
from dollop.cdhmm.evidence import END, FIRST, START, chains_of, evidence_of, graph_of
from dollop.lab.scanner import SickLMS200
from dollop.lds import DECAY, LDS, STEPS, Statistics, powers_on
from dollop.learning.anchored import tied_to_corners
from dollop.learning.matchings import inverse, matchings_into, notes_of
from dollop.learning.paper import anchors, members_along, shared_law
from dollop.matching import match
from dollop.replication.reconstruction import TOLD, Reconstruction
from dollop.robot.guidance import PIONEER_FOLLOWING
from dollop.segmentation import (
    best_segments,
    fewest_cuts,
    fewest_segments,
    raw_statistics,
    retimed_statistics,
    segment_errors,
)
from dollop.sequenced_lds import SequencedLDS
from dollop.task import Demonstration, Task, learn
from dollop.tracking import Motion, Tracker
from dollop.trajectory import align, arc_length, distance_to_polyline, resample

__all__ = [
    "LAWS", "SEEN", "SHOWN_LAW", "TIES", "ShownAs", "adapted", "as_paper", "following_of", "gait_of",
    "laser_of", "law_of", "learned", "model_of", "motion_of", "response_of", "seen_by", "shown_as", "task_of",
]  # fmt: skip

LAWS = ("lds", "tolerance", "cuts", "laid")
"""Fields on which a law depends."""

SEEN = ("laser_noise", "walker")
"""Fields on which a recording depends."""

SHOWN_LAW = (*LAWS, *SEEN)
"""Fields on which a law depends that was fitted to what the laser saw."""

TIES = ("weights", "corners")
"""Fields on which it depends where subgoals go when objects move."""

MIXED = 0.1
"""Share of the beams across an edge that the usual laser mixes up."""

TWO_LEGS = 0.5
"""Two blobs up to so many m apart are one walker who is seen at the legs."""

CANDIDATES = 60
"""Places where a walk may be cut if the largest error counts: all pairs are looked at."""

KNOWN_TO = 0.05
"""m: corners are not known better, so that none has all the weight."""

DOUBT = 0.05
"""Chance at which anything that belongs together is left apart, over all pairs."""


GAITS = {"torso": {}, "swaying": {"sway": 0.04, "drift": 0.08}, "legs": {"body": "legs"}}
"""How each walker walks, and what the laser meets."""


# ---- who is seen, and how


def seen_by(scene, how=TOLD):
    """A scene with the laser that is chosen.

    Parameters
    ----------
    scene : Scene
    how : Reconstruction, optional

    Returns
    -------
    Scene
    """
    if how.laser_noise == TOLD.laser_noise:
        return scene
    return replace(scene, robot=replace(scene.robot, scanner=laser_of(how)))


def laser_of(how=TOLD):
    """The laser that is chosen.

    Parameters
    ----------
    how : Reconstruction, optional

    Returns
    -------
    SickLMS200
    """
    return SickLMS200(noise=how.laser_noise, mixed=MIXED * how.laser_noise / TOLD.laser_noise)


def gait_of(how=TOLD):
    """How the chosen walker walks, and what the laser meets.

    Parameters
    ----------
    how : Reconstruction, optional

    Returns
    -------
    dict
        Keywords of `dollop.lab.walk`; none for the usual walker.
    """
    return GAITS[how.walker]


def motion_of(how=TOLD, **more):
    """How an object is taken to move.

    Parameters
    ----------
    how : Reconstruction, optional
    **more
        Other fields of `Motion`.

    Returns
    -------
    Motion
    """
    return Motion(noise=how.motion_noise, **more)


def as_paper(how=TOLD):
    """How somebody is observed by the paper's method.

    Parameters
    ----------
    how : Reconstruction, optional

    Returns
    -------
    dict
        Keywords of `dollop.observe` with method="paper".
    """
    stride = {"stride": TWO_LEGS} if how.walker == "legs" else {}
    return {"method": "paper", "tracker": Tracker(motion=motion_of(how)), **stride}


def following_of(how=TOLD):
    """How a robot follows the plain law.

    Parameters
    ----------
    how : Reconstruction, optional

    Returns
    -------
    Following
    """
    gain = how.gain * PIONEER_FOLLOWING.turn_gain
    return replace(PIONEER_FOLLOWING, reach=how.reach, turn_gain=gain)


# ---- laws


def law_of(walks, how=TOLD, sample_period=0.1):
    """The law of several walks.

    Parameters
    ----------
    walks : sequence of (N_k, 2) array_like
        In m.
    how : Reconstruction, optional
    sample_period : float
        In s.

    Returns
    -------
    SequencedLDS

    Raises
    ------
    ValueError
        As `SequencedLDS.fit`.
    """
    if how.laid == TOLD.laid and how.cuts != "largest":
        exactly = 6 if how.cuts == "six" else None
        return SequencedLDS.fit(
            walks,
            how.tolerance,
            exactly,
            retimed=how.lds == "re-timed",
            sample_period=sample_period,
        )
    return simple_law([np.asarray(walk, float) for walk in walks], how, sample_period)


def simple_law(walks, how, sample_period):
    """A law of walks laid together and cut as chosen, not divided anew where rounding bends it."""
    count = CANDIDATES if how.cuts == "largest" else 100
    if how.laid == "even":
        aligned = np.stack([resample(walk, 2 * count - 1) for walk in walks])
        shares = np.tile(np.linspace(0, 1, 2 * count - 1), (len(walks), 1))
    else:
        aligned, shares = align(walks, 2 * count - 1)
    moments = moments_at(walks, shares[:, ::2])
    retimed = how.lds == "re-timed"
    statistics = retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)
    path = aligned.mean(axis=0)[::2]
    cuts = chosen_cuts(path, statistics, how)
    found = statistics(cuts[:-1], np.diff(cuts))
    segments, at = (
        tuple(map(LDS, map(Statistics, found.G0, found.G1), path[cuts[1:]])),
        moments[:, cuts],
    )
    law = SequencedLDS(segments, path[0], speeds_between(walks, at, sample_period))
    pauses, corners = np.zeros(len(segments) + 1), np.zeros(len(segments), bool)
    lengths = [line.way[-1] for line in law.lines()]
    return law.with_timing(walks, at, sample_period, pauses, corners, lengths)


def chosen_cuts(path, statistics, how):
    """Cuts (S + 1,) of a path (C, 2) as chosen."""
    if how.cuts == "mean":
        return fewest_cuts(path, statistics, how.tolerance)
    if how.cuts == "six":
        return best_segments(segment_errors(path, statistics), 6)
    most, total = errors_of_all(path, statistics)
    kept = np.where(most <= how.tolerance, total, np.inf)
    try:
        return fewest_segments(kept, np.inf)
    except ValueError:
        rule = f"a division at some of {len(path)} places must keep every place"
        raise ValueError(f"{rule} within {how.tolerance} m, there is none") from None


def errors_of_all(path, statistics):
    """Largest and summed distance in m of a path (C, 2) to the response of every segment, (C, C)."""
    count = len(path)
    most, total = np.full((2, count, count), np.inf)
    starts, ends = np.triu_indices(count, 2)
    responses = whole_responses(statistics(starts, ends - starts), path[starts], path[ends])
    for i, j, response in zip(starts, ends, responses, strict=True):
        off = distance_to_polyline(path[i + 1 : j], response)
        most[i, j], total[i, j] = off.max(), off.sum()
    return most, total


def whole_responses(statistics, places, goals, steps=STEPS + 8):
    """Responses (B, steps + 2, 2) from places to goals (B, 2); slow ones by every m-th state."""
    slow = -1 / np.log(np.clip(statistics.decay, 0.5, 1 - 1e-6)) * DECAY / steps
    matrices, doublings = statistics.matrix, np.ceil(np.log2(np.maximum(slow, 1))).astype(int)
    for k in range(doublings.max(initial=0)):
        matrices = np.where((k < doublings)[:, None, None], matrices @ matrices, matrices)
    states = goals[:, None] + powers_on(matrices, places - goals, steps)
    return np.concatenate([states, goals[:, None]], axis=1)


def moments_at(walks, shares):
    """When each walk is at shares (K, C) of its way: (K, C) fractional sample numbers."""
    pairs = zip(map(arc_length, walks), shares, strict=True)
    return np.array([np.interp(share * way[-1], way, np.arange(len(way))) for way, share in pairs])


def speeds_between(walks, moments, sample_period):
    """Mean speeds (S,) in m/s between fractional sample numbers (K, S + 1) of walks."""
    pairs = zip(map(arc_length, walks), moments, strict=True)
    ways = np.array([np.diff(np.interp(moment, np.arange(len(way)), way)) for way, moment in pairs])
    return ways.sum(axis=0) / (np.maximum(np.diff(moments).sum(axis=0), 1e-3) * sample_period)


# ---- tasks


@dataclass(frozen=True, eq=False)
class ShownAs(Demonstration):
    """A demonstration whose law is fitted as chosen.

    Parameters
    ----------
    how : Reconstruction
    """

    how: Reconstruction = TOLD

    @cached_property
    def law(self):
        """Sequenced LDS of the walk (Sec. III)."""
        return law_of(self.walks, replace(self.how, tolerance=self.tolerance), self.sample_period)


def shown_as(demonstration, how=TOLD):
    """A demonstration whose law is fitted as chosen.

    Parameters
    ----------
    demonstration : Demonstration
    how : Reconstruction, optional

    Returns
    -------
    Demonstration
        The same where all is as told.
    """
    if how.only(LAWS) == TOLD:
        return demonstration
    names = ("trajectory", "environment", "sample_period", "notes")
    known = {name: getattr(demonstration, name) for name in names}
    return ShownAs(**known, tolerance=how.tolerance, how=how)


def response_of(how=TOLD):
    """By which response a law is judged that was learned as chosen.

    Parameters
    ----------
    how : Reconstruction, optional

    Returns
    -------
    {"paper", "held"}
    """
    return "held" if how.learning == "anchored" else "paper"


def task_of(demonstration, how=TOLD):
    """The task that one demonstration shows.

    Parameters
    ----------
    demonstration : Demonstration
        Of `shown_as`.
    how : Reconstruction, optional

    Returns
    -------
    Task
    """
    task = Task.of(demonstration, how.learning)
    if how.learning == "anchored":
        return relaid(task, how)
    return replace(task, association=reweighed(task.association, how))


def learned(demonstrations, how=TOLD):
    """The task that several demonstrations show.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        Of `shown_as`.
    how : Reconstruction, optional

    Returns
    -------
    Task
        In the environment of the first.

    Raises
    ------
    ValueError
        As `dollop.learn`.
    """
    given = matchings_given(demonstrations, how)
    if how.learning == "anchored":
        return relaid(learn(demonstrations, matchings=given), how)
    if how.only((*TIES, "merging")) == TOLD:
        return learn(demonstrations, matchings=given, method="paper", spread=how.spread)
    return learned_as_paper(tuple(demonstrations), how, given)


def adapted(task, environment, how=TOLD):
    """A task where the objects stand now.

    Parameters
    ----------
    task : Task
        Of `task_of` or `learned`, by the same choices.
    environment : Environment
    how : Reconstruction, optional

    Returns
    -------
    Task

    Raises
    ------
    ValueError
        As `Task.adapt`.
    """
    return relaid(task.adapt(environment, matching_given(task.environment, environment, how)), how)


def matching_given(before, after, how):
    """The matching by the paper's cost if it is chosen; None leaves it to Dollop."""
    return match(before, after, method="literal") if how.matching == "literal" else None


def matchings_given(demonstrations, how):
    """The same of each demonstration's environment with that of the first, as `dollop.learn` takes them."""
    first = demonstrations[0].environment
    return [matching_given(shown.environment, first, how) for shown in demonstrations]


def relaid(task, how):
    """A task learned by Dollop's way, its laws fitted as chosen; another as it is."""
    if not task.learned or how.only(("lds", "cuts", "laid")) == TOLD:
        return task
    partners = inverse(task.objects, len(task.environment))
    placed = [way.among(task.environment, partners, task.turn) for way in task.learned]
    laws = []
    for way, now in zip(task.learned, placed, strict=True):
        walks = [stands.walk for stands in way.walked(now)]
        laws.append(law_of(walks, how, way.sample_period).without_waits_at_ends())
    tied = tied_to_corners(task.learned[0], placed[0], laws[0], task.environment, task.objects)
    return replace(task, law=laws[0], ways=tuple(laws), association=tied)


def reweighed(association, how):
    """An association with weights of the chosen power of the distance, to so many corners."""
    if how.only(TIES) == TOLD:
        return association
    squares = (association.differences**2).sum(axis=2)
    weights = association.weights * (squares + KNOWN_TO**2) ** (1 - how.weights / 2)
    order = np.where(weights > 0, squares, np.inf).argsort(axis=1, kind="stable")
    far = order.argsort(axis=1, kind="stable") >= how.corners
    weights = np.where(far, 0.0, weights)
    return replace(association, weights=weights / weights.sum(axis=1, keepdims=True))


def learned_as_paper(demonstrations, how, given):
    """`dollop.learn` by the paper's method, with other weights, corners or merging."""
    environment = demonstrations[0].environment
    matchings, aside = matchings_into(environment, demonstrations, given)
    partners = tuple(None if each is None else each.partners for each in matchings)
    pairs = zip(demonstrations, matchings, strict=True)
    used = [(shown, each) for shown, each in pairs if each is not None]
    laws = [mapped(shown, matching, environment, how) for shown, matching in used]
    model = model_of([law.subgoals for law in laws], how)
    members = members_along(model)
    tied = reweighed(tied_to_all(used, environment, members), how)
    law, notes = (
        shared_law(laws, members, tied.relocate(environment)),
        (*notes_of(demonstrations), *aside),
    )
    return Task(law, environment, tied, model, demonstrations, notes, partners=partners)


def mapped(shown, matching, environment, how):
    """The law of a demonstration in the environment to learn in."""
    there = shown.environment
    tied = reweighed(associate(anchors(shown.law), there, m=len(there.corners)), how)
    start, *subgoals = tied.relocate(environment, matching)
    return shown.law.with_subgoals(subgoals, start)


def tied_to_all(used, environment, members):
    """Start and subgoals tied to all corners, by closeness and by how little they vary."""
    centres = [centres_of(shown, matching, len(environment)) for shown, matching in used]
    places = [anchors(shown.law) for shown, _ in used]
    starts = [(d, -1) for d, i in members[0] if i == 0] or [(0, -1)]
    weights, offsets = [], []
    for seen in (starts, *members):
        stood = np.array([centres[d] for d, _ in seen])
        common = np.isfinite(stood[..., 0]).all(axis=0)
        frames = [Frames(each[common], np.zeros(common.sum())) for each in stood]
        found = associate_with_frames([[places[d][i + 1]] for d, i in seen], frames)
        weight, offset = np.zeros(len(environment)), np.zeros((len(environment), 2))
        weight[common], offset[common] = found.weights[:, 0], found.local[:, 0]
        weights.append(np.repeat(weight / 4, 4))
        offsets.append(np.repeat(offset, 4, axis=0) - environment.corner_offsets)
    corners = np.tile(np.arange(4 * len(environment)), (len(weights), 1))
    return Association(environment, corners, np.array(weights), np.array(offsets))


def centres_of(shown, matching, n):
    """Where the n objects to learn with stood in a demonstration: (n, 2) in m, nan for none."""
    centres, partners = np.full((n, 2), np.nan), matching.partners
    centres[partners[partners >= 0]] = shown.environment.centres[partners >= 0]
    return centres


# ---- models


def model_of(sequences, how=TOLD):
    """What the subgoals of several demonstrations have in common.

    Parameters
    ----------
    sequences : sequence of (K, 2) array_like
        In m.
    how : Reconstruction, optional

    Returns
    -------
    SubgoalHMM
    """
    if how.merging == TOLD.merging:
        return SubgoalHMM.fit(sequences, how.spread)
    sequences = [np.asarray(each, float) for each in sequences]
    chains = chains_of(sequences, how.spread)
    labels = numbered(near_together(chains, how.spread), chains)
    graph = graph_of(labels, chains)
    probability = graph.counts / np.maximum(graph.counts.sum(1), 1)[:, None]
    means = graph.s[FIRST:] / graph.n[FIRST:, None] + chains.centre
    return SubgoalHMM(
        means=means,
        covariances=np.tile(how.spread**2 * np.eye(2), (len(means), 1, 1)),
        transitions=probability[FIRST:, FIRST:],
        start=probability[START, FIRST:],
        end=probability[FIRST:, END],
        sequences=sequences,
        states=tuple(labels[part] - FIRST for part in chains.slices),
        spread=how.spread,
        evidence=evidence_of(labels, chains),
    )


def near_together(chains, spread):
    """Labels (M,) of subgoals merged, the nearest first, as long as their distance may be chance.

    Two states of n and m subgoals are as near as the spread has it where the squared distance of
    their means is within what one in twenty tasks exceeds. No state is merged with one that it
    reaches.
    """
    labels, owner = np.arange(len(chains.points)) + FIRST, chains.owner
    pairs = (owner[:, None] < owner).sum()
    most = 2 * np.log(max(pairs, 1) / DOUBT) * spread**2
    while True:
        labels = compact(labels)
        graph = graph_of(labels, chains)
        means, n = graph.s[FIRST:] / graph.n[FIRST:, None], graph.n[FIRST:]
        apart = ((means[:, None] - means) ** 2).sum(axis=2) / (1 / n[:, None] + 1 / n)
        apart[connected(graph.counts[FIRST:, FIRST:] > 0)] = np.inf
        u, v = np.unravel_index(apart.argmin(), apart.shape)
        if not apart[u, v] < most:
            return labels
        labels[labels == v + FIRST] = u + FIRST


def connected(steps):
    """Whether of two states one reaches the other or is it, by steps (S, S) from state to state."""
    reach = steps | np.eye(len(steps), dtype=bool)
    for _ in range(len(steps).bit_length()):
        reach = reach @ reach
    return reach | reach.T
