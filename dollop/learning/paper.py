"""Learning as the paper has it: map every demonstration to one environment first, then merge (Sec. IV-B and V)."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.lds import LDS
from dollop.sequenced_lds import SequencedLDS

__all__ = ["anchors", "learn_as_paper", "members_along", "shared_law"]


def learn_as_paper(demonstrations, matchings, environment, spread=None):
    """Law, association and model of demonstrations (Sec. V).

    Each is mapped to the environment by closeness in that one demonstration; a CDHMM is estimated
    from all subgoals by merging; its most-likely path is the task, and segments merged along an
    edge share one LDS.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
    matchings : sequence of Matching
        From the environment of each to that one.
    environment : Environment
        The one to learn in, one object at least.
    spread : float, optional
        As for `SubgoalHMM.fit`.

    Returns
    -------
    law : SequencedLDS
    association : Association
    model : SubgoalHMM

    Raises
    ------
    ValueError
        An environment without objects, or a demonstration that cannot be segmented at its
        tolerance.
    """
    pairs = zip(demonstrations, matchings, strict=True)
    laws, centres = zip(*(mapped_to(environment, shown, matching) for shown, matching in pairs), strict=True)
    model = SubgoalHMM.fit([law.subgoals for law in laws], spread)
    members = members_along(model)
    association = tie_to_objects(environment, demonstrations, centres, members)
    return shared_law(laws, members, association.relocate(environment)), association, model


def anchors(law):
    """The places of a law that move with objects: its start and its subgoals (Sec. IV-B).

    Parameters
    ----------
    law : SequencedLDS
        Of K segments.

    Returns
    -------
    (K + 1, 2) float array
        In m.
    """
    return np.vstack([law.start, law.subgoals])


def mapped_to(environment, demonstration, matching):
    """The law of a demonstration in the environment to learn in, and where its objects stood.

    That is (N, 2) centres in m in the order of the environment, nan for an object that was not
    there.
    """
    law, there = demonstration.law, demonstration.environment
    association = associate(anchors(law), there, m=len(there.corners))
    start, *subgoals = association.relocate(environment, matching)
    centres, partners = np.full((len(environment), 2), np.nan), matching.partners
    centres[partners[partners >= 0]] = there.centres[partners >= 0]
    return law.with_subgoals(subgoals, start), centres


def members_along(model):
    """Which segments of which demonstrations run along each edge of the most-likely path (Sec. V).

    Parameters
    ----------
    model : SubgoalHMM

    Returns
    -------
    list of K lists of (demonstration, segment)
        From the start on.
    """
    path, segments = model.most_likely_path().tolist(), model.segments()
    return [segments[edge] for edge in pairwise([-1, *path])]


def shared_law(laws, members, places):
    """One LDS for all segments that run along the same edge of the most-likely path (Sec. V).

    Parameters
    ----------
    laws : sequence of SequencedLDS
        Of each demonstration.
    members : list of K lists of (demonstration, segment)
    places : (K + 1, 2) float array
        Where the law is to start, and its subgoals, m.

    Returns
    -------
    SequencedLDS
        Of K segments. It waits at a subgoal for the mean of the times that were waited there, if half
        of the demonstrations did.
    """
    segments, speeds = [], []
    for shared, goal in zip(members, places[1:], strict=True):
        first, *others = [laws[d].segments[i].statistics for d, i in shared]
        segments.append(LDS(sum(others, first), goal))
        speeds.append(np.mean([laws[d].speeds[i] for d, i in shared]))
    law, pauses = (
        SequencedLDS(tuple(segments), places[0], np.array(speeds)),
        shared_pauses(laws, members),
    )
    return replace(law, pauses=pauses, corners=pauses[1:] > 0) if pauses.any() else law


def shared_pauses(laws, members):
    """How long a law waits at its start and at each of its subgoals (beyond the paper).

    Parameters
    ----------
    laws : sequence of SequencedLDS
        Of each demonstration.
    members : list of K lists of (demonstration, segment)

    Returns
    -------
    (K + 1,) float array
        In s: the mean over the demonstrations that have the subgoal, where at least half of them
        waited there; 0 at both ends.
    """
    pauses = [each.without_waits_at_ends().pauses for each in laws]
    shared = np.zeros(len(members) + 1)
    for k, along in enumerate(members[:-1], start=1):
        waited = np.array([pauses[d][i + 1] for d, i in along])
        shared[k] = waited.mean() if np.mean(waited > 0) >= 0.5 else 0.0
    return shared


def tie_to_objects(environment, demonstrations, centres, members):
    """Association of start and subgoals with objects, by closeness and by how little they vary.

    Each place is seen from the objects as they stood in every demonstration that went there.

    Parameters
    ----------
    environment : Environment
        N objects, the one to learn in.
    demonstrations : sequence of Demonstration
    centres : sequence of (N, 2) float arrays
        Where these objects stood in each demonstration, in m.
    members : list of K lists of (demonstration, segment)
        Which segments end in each subgoal.

    Returns
    -------
    Association
        Of K + 1 places.
    """
    demonstrated = [anchors(shown.law) for shown in demonstrations]
    starts = [(d, -1) for d, i in members[0] if i == 0] or [(0, -1)]
    ties = [tie(environment, demonstrated, centres, seen) for seen in (starts, *members)]
    corners = np.tile(np.arange(4 * len(environment)), (len(ties), 1))
    return Association(environment, corners, *map(np.stack, zip(*ties, strict=True)))


def tie(environment, demonstrated, centres, seen):
    """Weights (4N,) and differences (4N, 2) to all corners of one place.

    It is where `seen`, segments as (demonstration, segment), end; the start is where segment -1
    does.
    """
    places = [[demonstrated[d][i + 1]] for d, i in seen]
    stood = np.array([centres[d] for d, _ in seen])
    common = np.isfinite(stood[..., 0]).all(axis=0)
    frames = [Frames(each[common], np.zeros(common.sum())) for each in stood]
    found = associate_with_frames(places, frames)
    weights, local = np.zeros(len(environment)), np.zeros((len(environment), 2))
    weights[common], local[common] = found.weights[:, 0], found.local[:, 0]
    return np.repeat(weights / 4, 4), np.repeat(local, 4, axis=0) - environment.corner_offsets
