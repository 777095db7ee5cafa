"""Claims on what the paper takes for granted: subgoals that come again, many layouts, room to walk.

It says none of it in numbers. Each is measured on the nearest sentence that presupposes it.
"""

from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from math import inf, nan
from operator import attrgetter

import numpy as np

from dollop import lab
from dollop.observation import observe
from dollop.replication import recordings
from dollop.replication.choosing import (
    adapted,
    as_paper,
    law_of,
    learned,
    response_of,
    task_of,
)
from dollop.replication.claims.claim import MOSTLY, Criterion, claim, unknown
from dollop.replication.claims.measures import error_of, headings
from dollop.replication.claims.walked import (
    LEARNED,
    NEARER,
    WALKS,
    acceptance,
    eight_near,
    exponent,
    laws_of,
    straight_near,
    walks_again,
)
from dollop.replication.reconstruction import TOLD
from dollop.trajectory import mean_trajectory

__all__ = []

EXPECTED = (0.0, TOLD.spread)
"""How far, in m along each axis, merging expects a subgoal to lie from its mean."""

CELL = 0.05
"""Side of a cell in m of the grid in which the walker is seen."""

LAYOUTS = 6
"""Layouts of which a task is learned at most."""

FOLLOWED = 0.40
"""A track is the walker's within so many m of his middle, as for the random worlds."""

MOVING = 0.1
"""Faster than so many m/s the walker moves."""


# ---- are subgoals repeatable?


@claim(
    "III",
    "The endpoints of each segment specify important points in the trajectory and, in many ways, "
    "these points can be considered subgoals",
    Criterion("same_number", "share of pairs of walks with as many LDS", MOSTLY, 0.05),
    Criterion("along_m", "sd of a cut along the way [m]", EXPECTED, CELL),
    Criterion("across_m", "sd of a cut across the way [m]", EXPECTED, CELL),
    Criterion("end_m", "sd of the end of a walk, along each axis [m]"),
    Criterion("same_number_unseen", "without the laser: share of pairs with as many LDS"),
    Criterion("along_unseen_m", "without the laser: sd of a cut along the way [m]"),
    Criterion("across_unseen_m", "without the laser: across it [m]"),
    Criterion("same_number_laps", "laps of the figure-eight: share of pairs with as many LDS"),
    Criterion("along_laps_m", "laps: sd of a cut along the way [m]"),
    Criterion("across_laps_m", "laps: across it [m]"),
    choices=WALKS,
)
def repeatable(seed, how=TOLD):
    """Whether a walk is cut at the same places when the same person walks it again.

    Six slaloms in one layout, seen by the laser, each segmented alone. Cuts are compared among the
    walks of the most frequent number of LDS: root mean square over the cuts, which the end of the
    walk is none of. Wanted is what merging expects, 0.15 m along each axis, and as many LDS in nine
    pairs of ten. One in twenty matters, and a cell of the grid, 0.05 m. Beside it the same walks as
    they were, without the laser, and the laps of the figure-eight.
    """
    again = walks_again(seed, how.only(WALKS))
    seen, unseen = (
        [each.demonstration for each in again],
        [each.walk.positions[::5] for each in again],
    )
    laps = recordings.figure_eights(seed, how.only(WALKS)).laps
    numbers = cuts_apart([each.walks[0] for each in seen], laws_of(seen, attrgetter("law")))
    for name, walks in (("_unseen", unseen), ("_laps", laps)):
        laws = laws_of(walks, lambda walk: law_of([walk], how.only(WALKS)))
        numbers |= cuts_apart(walks, laws, name)
    return numbers


def cuts_apart(walks, laws, name=""):
    """How many pairs of laws have as many LDS, and how far cuts are apart; names end in name.

    Without laws nan.
    """
    counts = [len(law.segments) for law in laws]
    alike = [a == b for a, b in combinations(counts, 2)]
    along, across, end = scatter([law.subgoals for law in laws], walks)
    return {
        f"same_number{name}": np.mean(alike) if alike else nan,
        f"along{name}_m": along,
        f"across{name}_m": across,
        f"end{name}_m": end,
    }


def scatter(subgoals, walks):
    """Standard deviations of subgoals along and across the way, and of the last one.

    Parameters
    ----------
    subgoals : sequence of (K, 2) array_like
        Of each walk, in m; those count whose number K is the most frequent, the least of several.
    walks : sequence of (N_k, 2) float arrays
        In m; the way's direction is that of their mean at the nearest place.

    Returns
    -------
    along, across : float
        In m: root mean square over all subgoals but the last; nan without such.
    end : float
        In m: root mean square of both axes; nan if no two walks have as many subgoals.
    """
    usual = np.bincount([len(each) for each in subgoals], minlength=1).argmax()
    alike = np.array([each for each in subgoals if len(each) == usual])
    if len(alike) < 2:
        return nan, nan, nan
    places, way = alike.mean(axis=0), mean_trajectory(walks)
    angles = headings(way)[recordings.nearest(way, places)]
    off = ((alike - places) @ (1, 1j)) * np.exp(-1j * angles)
    variances = (np.abs(np.stack([off.real, off.imag])) ** 2).sum(axis=1) / (len(alike) - 1)
    end = np.sqrt(variances[:, -1].mean())
    along, across = np.sqrt(variances[:, :-1].mean(axis=1)) if usual > 1 else (nan, nan)
    return along, across, end


# ---- does it help to show more layouts?


@claim(
    "V",
    "essentially, giving Dollop a better idea of how the user would perform in varying conditions",
    Criterion("one_more_than_six_m", "error from one layout minus from six [m]", NEARER, 0.01),
    Criterion("exponent", "exponent in the number of layouts", (-inf, -0.1), 0.05),
    *(Criterion(f"error_{n}_m", f"error from {n} [m]") for n in range(1, LAYOUTS + 1)),
    Criterion("refused", "share of seventh layouts refused as ambiguous", trials=1),
    Criterion("set_aside", "share of six demonstrations set aside as ambiguous"),
    Criterion("exponent_ours", "exponent in the number of layouts, ours"),
    *(Criterion(f"error_{n}_ours_m", f"error from {n}, ours [m]") for n in (1, 2, LAYOUTS)),
    choices=LEARNED,
)
def layouts(seed, how=TOLD):
    """Error where nobody has shown anything, by the number of layouts that were shown.

    Slaloms in six layouts and a seventh, seen by the laser: mean distance of what was walked there
    to the law learned from the first n and adapted; for one layout, the mean over all six. A
    centimetre matters, half of the tolerance. Falling means by a sixth or more from one to six, as
    an exponent of -0.1 has it; half as much matters. Objects are matched as ever: what is ambiguous
    is set aside or refused.
    """
    slaloms = [recordings.slalom(k, seed, how.only(WALKS)) for k in range(LAYOUTS + 1)]
    *shown, kept = [each.demonstration for each in slaloms]
    if not laws_of(shown, attrgetter("law")):
        return unknown("layouts")
    numbers, judged, ours = {}, ("", how, range(1, LAYOUTS + 1)), replace(how, learning="anchored")
    told = [("_ours", ours, (1, 2, LAYOUTS))] * (how == TOLD)  # beside the judged ones, not in every universe
    for name, chosen, counts in (*told, judged):
        tasks = tasks_by_number(shown, chosen, counts)
        errors = {n: error_in(kept, each, chosen) for n, each in tasks.items()}
        numbers |= {f"error_{n}{name}_m": error for n, error in errors.items()}
        numbers[f"exponent{name}"] = exponent(errors)
    error, together = numbers[f"error_{LAYOUTS}_m"], tasks[LAYOUTS]
    return (
        unknown("layouts")
        | numbers
        | {
            "one_more_than_six_m": numbers["error_1_m"] - error,
            "refused": float(np.isnan(error)),
            "set_aside": set_aside(together[0]) if together else 1.0,
        }
    )


def tasks_by_number(shown, how, counts):
    """For each of counts the tasks learned from so many demonstrations, the first; one: of each.

    None where nothing can be matched.
    """
    tasks = {n: [] for n in counts}
    for n in counts:
        with suppress(ValueError):
            tasks[n] = [learned(shown[:n], how)] if n > 1 else [task_of(each, how) for each in shown]
    return tasks


def set_aside(task):
    """Share of its demonstrations that a task set aside."""
    return np.mean([each is None for each in task.partners])


def error_in(kept, tasks, how):
    """Mean distance in m of a demonstration's walks to tasks adapted to its layout.

    Those are left out whose layout cannot be matched with it; nan if that is none.
    """
    errors = []
    for task in tasks:
        try:
            law = adapted(task, kept.environment, how).law
        except ValueError:  # an ambiguous matching: it asks instead of guessing
            continue
        errors.append(error_of(law, kept.walks, response_of(how)))
    return np.mean(errors) if errors else nan


# ---- is there room to walk in?


@claim(
    "II",
    "if there is no background object within some radius, e.g., 20 centimeters, of the measurement",
    Criterion("near_followed", "near the background: share followed", MOSTLY, 0.05, trials=1),
    Criterion("along_followed", "along it: share followed", MOSTLY, 0.05, trials=1),
    Criterion("kept_followed", "0.30 m kept: share followed", trials=1),
    Criterion("near_off_m", "near it: mean distance of the track from his middle [m]"),
    Criterion("along_off_m", "along it: mean distance from his middle [m]"),
    Criterion("kept_off_m", "0.30 m kept: mean distance from his middle [m]"),
    Criterion("cones_apart", "share of drawn rows of cones with room between them"),
    Criterion("slaloms_kept", "share of such rows with a slalom that keeps 0.30 m"),
    Criterion("cans_apart", "share of two cans drawn with room between them"),
    Criterion("eights_kept", "one can drawn: share with figure-eights that keep 0.30 m"),
    Criterion("poses_free", "share of drawn poses from which a robot can start"),
    choices=("laser_noise", "walker", "motion_noise"),
)
def kept(seed, how=TOLD):
    """Whether a user is lost who does not keep 0.30 m from the background, as all others here do.

    A figure-eight, one can being moved, on which a shoulder comes within 0.30 m of wall or
    furniture; and 2.5 m straight on before the laser, all of it within 0.30 m of them. Followed: in
    95 % of the scans in which the walker moves the user's track, by the paper's method, is within
    0.40 m of his middle. One in twenty matters. Where 0.30 m are kept: the first slalom. Beside it
    what is drawn anew elsewhere until there is room: of ten draws of each kind the share with room.
    """
    rng, first = (
        np.random.default_rng([seed, 23]),
        recordings.slalom(0, seed, how.only(recordings.SEEN)),
    )
    walks = {"near": eight_near(rng, how), "along": straight_near(rng, how)}
    seen = {name: lab.record(scene, rng, [walk]) for name, (scene, walk) in walks.items()}
    numbers = acceptance(seed)
    for name, recording in (seen | {"kept": first.recording}).items():
        off = off_the_walker(recording, how)
        tracked = off[np.isfinite(off)]
        numbers[f"{name}_followed"] = float(np.mean(off < FOLLOWED) >= 0.95)
        numbers[f"{name}_off_m"] = tracked.mean() if len(tracked) else nan
    return numbers


def off_the_walker(recording, how):
    """How far in m the user's track, as the paper has it, is from who moves (N,); inf without."""
    user = observe(recording.log, recordings.background_map(), **as_paper(how)).user
    t, *places = recording.truth[["t", "x", "y"]].to_numpy().T
    speeds = np.hypot(*np.gradient(places, t, axis=1))
    t, places = t[speeds > MOVING], np.array(places)[:, speeds > MOVING]
    if user is None:
        return np.full(len(t), inf)
    seen = [np.interp(t, user.t, axis, left=inf, right=inf) for axis in user.positions.T]
    return np.hypot(*np.subtract(seen, places))
