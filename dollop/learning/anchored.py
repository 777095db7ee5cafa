"""Learning in object frames: which object each place of a task follows, from all demonstrations (Sec. IV-B and V).

Alignment, association and merging decide together: `dollop.learning.ways` lays the walks onto each
other and divides them where they go different ways, `dollop.learning.places` tells what each place
follows. Only then are subgoals mapped to one environment, each by what its place follows, and
merged to a CDHMM.
"""

from dataclasses import replace

import numpy as np

from dollop.association import Association
from dollop.cdhmm import SubgoalHMM
from dollop.checks import Note
from dollop.learning.frames import frames_like, frames_of
from dollop.learning.paper import anchors
from dollop.learning.way import curve_of, way_of, which_places
from dollop.learning.ways import MISSED, divided

__all__ = ["learn_anchored", "tied_to_corners", "told_of_places"]

WHOLE = 0.05
"""Share of the way that a demonstration may lack at either end and still show all of it."""
HANGS = 0.5
"""Weight of what is not there from which on a place hangs on it."""


def learn_anchored(demonstrations, partners, environment, spread=None, merged=True):
    """The ways in which a task was shown, and the CDHMM of its subgoals (a reconstruction).

    Parameters
    ----------
    demonstrations : sequence of D Demonstration
    partners : sequence of D (int array or None)
        For each object of a demonstration, which object of the environment it is, -1 for none; None
        for a demonstration that is set aside.
    environment : Environment
        The one to learn in.
    spread : float, optional
        As for `SubgoalHMM.fit`.
    merged : bool
        Whether to estimate the CDHMM.

    Returns
    -------
    ways : tuple of Way
        The one that was shown most often first.
    model : SubgoalHMM or None
    notes : list of Note
    """
    used = np.array([k for k, each in enumerate(partners) if each is not None])
    shown, goes = [demonstrations[k] for k in used], [partners[k] for k in used]
    corners = environment.corner_offsets.reshape(-1, 4, 2)
    frames = frames_of([each.environment for each in shown], goes, corners)
    home = frames_like(frames.objects, frames.turning, environment, np.arange(len(environment)))
    curves = [curve_of(_without_pauses(each)) for each in shown]
    found = divided(np.array([curve for curve, _ in curves]), frames)
    ways, notes, mapped = [], [], [None] * len(shown)
    for members, laid in found:
        picked = [shown[k] for k in members], [curves[k] for k in members]
        ways.append(way_of(used[members], laid, frames.of(members), home, *picked))
        notes += _told(used[members], laid)
        subgoals = _at_home(laid, frames.of(members), home, *picked, used[members]) if merged else ()
        for k, each in zip(members, subgoals, strict=False):
            mapped[k] = each
    notes += _told_of_ways(ways)
    model = SubgoalHMM.fit(mapped, spread) if merged else None
    return tuple(ways), model, notes


def _without_pauses(shown):
    """The walks of a demonstration: who stands, and sways, comes no farther."""
    return [each.walk for each in shown.stands]


def _at_home(laid, frames, home, shown, curves, members):
    """The subgoals of each demonstration, mapped by what their places follow to the environment to learn in."""
    change = laid.places.among(home)[0] - laid.places.among(frames)
    found = []
    for k, row, at, each, (curve, _) in zip(members, change, laid.at, shown, curves, strict=True):
        subgoals = _law_of(each, k).subgoals
        samples = which_places(subgoals, curve)
        places = np.interp(samples, at, np.arange(len(at)))
        moved = np.stack([np.interp(places, np.arange(len(row)), column) for column in row.T], axis=1)
        found.append(subgoals + moved)
    return found


def _law_of(shown, k):
    """The law of demonstration k, at a looser tolerance where its own cannot be kept: for its subgoals it does."""
    refused = None
    for looser in (1, 2, 4):
        try:
            return shown.law if looser == 1 else replace(shown, tolerance=looser * shown.tolerance).law
        except ValueError as error:
            refused = refused or error
    raise ValueError(f"demonstration {k}: {refused}") from refused


def _told(members, laid):
    """Notes of one way: which demonstrations show a part of it, and which it misses."""
    notes = []
    for k, covered, missed in zip(members, laid.covered, laid.missed, strict=True):
        inside = np.flatnonzero(covered) / (len(covered) - 1)
        if inside[0] > WHOLE or inside[-1] < 1 - WHOLE:
            part = f"{100 * inside[0]:.0f} to {100 * inside[-1]:.0f} %"
            notes.append(
                Note(
                    "part",
                    f"demonstration {k} shows only {part} of the way; the rest is from others",
                    False,
                )
            )
        if missed > MISSED:
            rule = f"more than the {MISSED} m that walks of one way differ"
            text = f"the task misses demonstration {k} by {missed:.2f} m over a stretch, {rule}"
            notes.append(Note("missed", text, False))
    return notes


def _told_of_ways(ways):
    if len(ways) < 2:
        return []
    which = "; ".join(", ".join(map(str, way.members)) for way in ways)
    return [
        Note(
            "ways",
            f"shown in {len(ways)} ways that have not all in common, by the demonstrations {which}",
            False,
        )
    ]


def tied_to_corners(way, places, law, environment, objects):
    """What start and subgoals of a law follow, as an association with the corners of the environment (Sec. IV-B).

    Parameters
    ----------
    way : Way
    places : (L, 2) float array
        Where its places are in the environment, in m.
    law : SequencedLDS
        Of K segments.
    environment : Environment
        Of N objects.
    objects : (M,) int array
        Which object of the environment each of the way's objects is, -1 where it is gone.

    Returns
    -------
    Association
        Of K + 1 places with 4 N corners. Weights of a row sum to less than 1 where it follows the
        world too.
    """
    points = anchors(law)
    at = which_places(points, places)
    weights = np.zeros((len(points), len(environment)))
    for frame in np.flatnonzero(way.objects >= 0):
        goes = objects[way.objects[frame]]
        if goes >= 0:
            weights[:, goes] += way.weights[at, frame]
    corners = np.tile(np.arange(4 * len(environment)), (len(points), 1))
    differences = points[:, None] - environment.corners
    weights = np.maximum(weights, 0)  # without those that hold it off, the others may be more than all
    weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1)
    return Association(environment, corners, np.repeat(weights / 4, 4, axis=1), differences)


def told_of_places(ways, tolerances, partners):
    """What is in doubt of ways in an environment (beyond the paper).

    Parameters
    ----------
    ways : sequence of Way
    tolerances : sequence of float
        That their laws keep, in m.
    partners : (N,) int array
        For each object of the environment, which object of the ways it is; -1 for none.

    Returns
    -------
    list of Note
        Which stretches hang on objects that are not there, and which laws are looser than was
        asked.
    """
    notes = []
    for number, (way, kept) in enumerate(zip(ways, tolerances, strict=True)):
        name = f"way {number}" if len(ways) > 1 else "the way"
        gone = (way.objects >= 0) & ~np.isin(way.objects, partners)
        share = way.weights[:, gone].sum(axis=1) > HANGS
        if share.any():
            objects = np.unique(way.objects[gone & (way.weights[share] > HANGS / 2).any(axis=0)]).tolist()
            part = _share_in_words(share)
            text = f"{part} of {name} follows objects {objects} of those learned from, which are not matched"
            notes.append(Note("objects", f"{text}: it is placed by what is left"))
        if kept > way.tolerance:
            text = f"{name} bends too sharply here for a tolerance of {way.tolerance:g} m; its law keeps {kept:g} m"
            notes.append(Note("tolerance", text, False))
    return notes


def _share_in_words(places):
    """How much of a way the places (L,) that are true are, and from where to where they lie."""
    inside = 100 * np.flatnonzero(places) / (len(places) - 1)
    return f"{100 * places.mean():.0f} % (from {inside[0]:.0f} to {inside[-1]:.0f} %)"
