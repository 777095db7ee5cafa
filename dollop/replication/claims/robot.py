"""Claims on the robot that performs the control law (Sec. III).

The robot is a `Unicycle` that knows its pose and passes through what it hits: where that matters, a
run counts until it first touches something.
"""

from dataclasses import replace
from functools import lru_cache
from math import inf, nan

import numpy as np

from dollop.environment import Environment
from dollop.pose import wrapped
from dollop.replication import recordings
from dollop.replication.claims.claim import MOSTLY, NONE, Criterion, claim
from dollop.replication.claims.measures import SHARES, headings, plain_run, segments_along, windings
from dollop.replication.runs import distances_to_law, free_poses, return_times
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.guidance import Guidance
from dollop.trajectory import resample

__all__ = []

KIDNAPPINGS = 5


@claim(
    "III",
    "While it does not exactly follow the idealized trajectory in Figure 6(b), the robot does come "
    "fairly close to the predicted path.",
    Criterion("mean_m", "mean distance of the robot from the response [m]", (0.01, 0.1)),
    Criterion("max_m", "largest distance [m]", (0, 0.25)),
    Criterion("finished", "share of runs that finished", MOSTLY, trials=1),
)
def follow(seed):
    """How far from the response a run of the robot is.

    One run under the plain law by a unicycle with the Pioneer's limits, from a start 0.15 m and 20
    degrees (standard deviations) off. Fairly close: 0.1 m on average, the robot's radius of 0.25 m
    at most.
    """
    task = recordings.figure_eights(seed).task
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 5]))
    run = plain_run(task, start)
    away = distances_to_law(run, task.law, "paper")
    return {"mean_m": away.mean(), "max_m": away.max(), "finished": float(run.finished)}


@claim(
    "III",
    "It is coincidental that none of the responses to the kidnapping resulting in Agent Orange "
    "hitting the obstacles, or laboratory walls",
    Criterion("hit", "share of kidnapped runs that hit something", (0.05, 1), trials=KIDNAPPINGS),
    Criterion("five_missed", "share of five runs in which none does", (-inf, 0.5), trials=1),
    Criterion("hit_before_back", "share that hit something on the way back", trials=KIDNAPPINGS),
)
def luck(seed):
    """How often kidnapped robots hit something, and whether five in a row do not.

    Five runs under the plain law, each kidnapped once to anywhere in the laboratory: obstacles,
    furniture and walls. Back: within 0.1 m of the response for a second.
    """
    shown, runs = kidnapped_runs(seed)
    law = shown.task.law
    hits = [run.collisions > 0 for run in runs]
    before = [run.collisions > 0 and return_time(run, law) == inf for run in runs]
    return {
        "hit": np.mean(hits),
        "hit_before_back": np.mean(before),
        "five_missed": float(not any(hits)),
    }


@claim(
    "III",
    "the response of the control laws only depends on the current state of the robot and is "
    "independent of objects in the environment",
    Criterion("objects_m", "change of a run when all objects are taken away [m]", NONE),
    Criterion("segments_deg", "angle between two segments' ways at one place [degrees]", (-inf, 1)),
    constructed=True,
)
def state(seed):
    """How a run changes without the objects, and the law's direction with the segment in force.

    A run under the plain law with and without the cans, its subgoals being where they were;
    directions of all pairs of segments at fifty places.
    """
    task = recordings.figure_eights(seed).task
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 5]))
    gone = np.full(len(task.objects), -1)
    bare = replace(task, environment=Environment(np.empty((0, 4))), objects=gone)
    runs = [plain_run(each, start) for each in (task, bare)]
    common = min(len(run.t) for run in runs)
    apart = np.linalg.norm(runs[0].poses[:common, :2] - runs[1].poses[:common, :2], axis=1)
    places = np.random.default_rng([seed, 15]).uniform([0, 0], [9, 7], (50, 2))
    between = between_segments(task.law, places)
    return {"objects_m": apart.max(), "segments_deg": np.degrees(between)}


def between_segments(law, places):
    """Mean angle in rad between the directions of two segments at one of places (N, 2)."""
    guidance, count = Guidance(law), len(law.segments)
    pairs = [(k, *place) for place in places for k in range(count)]
    ways = np.array([guidance.direction(*pair) for pair in pairs]) @ (1, 1j)
    ways = ways.reshape(len(places), count)
    between = np.abs(np.angle(ways[:, :, None] / ways[:, None]))
    return between[:, ~np.eye(count, dtype=bool)].mean()


@claim(
    "III",
    "the response of Agent Orange to being kidnapped seems to be a reasonable estimate of user intent",
    Criterion("returned", "share that come back, touching nothing before", MOSTLY, trials=KIDNAPPINGS),
    Criterion("finished", "share that finish, touching nothing", MOSTLY, trials=KIDNAPPINGS),
    Criterion("goes_on", "share of these that go on as the user did", MOSTLY),
    Criterion("heading_deg", "angle to the user's direction until back [degrees]", (-inf, 45)),
    Criterion("return_s", "time until it is back [s]"),
)
def kidnap(seed):
    """Whether a kidnapped robot comes back, finishes, goes on as the user did, and how soon.

    The runs of `luck`; a collision ends a run. Going on as the user did: from the next subgoal to
    the end round the cans as the law of the demonstrations. The user's direction: at the nearest
    place of the laps that belongs to the segment in force.
    """
    shown, runs = kidnapped_runs(seed)
    task, scene = shown.task, shown.recording.scene
    times = np.array([return_time(run, task.law) for run in runs])
    back = np.isfinite(times)
    unhurt = [run for run in runs if run.finished and not run.collisions]
    goes_on = [winds_as_demonstrated(run, task.law, scene) for run in unhurt]
    user = user_directions(shown.laps, task.law)
    off = [heading_off(run, min(time, 60.0), *user) for run, time in zip(runs, times, strict=True)]
    return {
        "returned": back.mean(),
        "finished": len(unhurt) / len(runs),
        "goes_on": np.mean(goes_on) if goes_on else nan,
        "heading_deg": np.degrees(np.nanmean(off)),
        "return_s": times[back].mean() if back.any() else nan,
    }


@lru_cache(maxsize=1)
def kidnapped_runs(seed, count=KIDNAPPINGS):
    """What was shown, and five runs, each kidnapped once to anywhere in the laboratory."""
    shown, rng = recordings.figure_eights(seed), np.random.default_rng([seed, 6])
    task = shown.task
    starts = recordings.starts_near_the_beginning(task, count, rng)
    obstacles = ObstacleMap.of(task.environment, recordings.background_map())
    places = free_poses(count, obstacles, task.law.subgoals[0], rng)
    kidnaps = zip(starts, rng.uniform(5.0, 25.0, count), places, strict=True)
    runs = [plain_run(task, start, kidnap=[(time, place)]) for start, time, place in kidnaps]
    return shown, runs


def first_hit(run):
    """Time in s at which a run first touches something, infinite if it does not."""
    return run.t[(run.clearance < 0).argmax()] if run.collisions else inf


def return_time(run, law):
    """Time in s from the kidnapping until it is back on the response, infinite if it hits first."""
    (time,) = return_times(run, law, method="paper")
    return time if run.kidnapped[0] + time < first_hit(run) else inf


def winds_as_demonstrated(run, law, scene):
    """Whether, from the first subgoal after a kidnapping, a run rounds the cans as the law does."""
    rows = np.flatnonzero(run.t >= run.kidnapped[0])
    segment = run.active[rows[0]]
    later = rows[run.active[rows] > segment]
    if not len(later):
        return True
    responses = law.responses(method="paper")
    handed_over = responses[segment][-1:]
    on_from_there = np.vstack([handed_over, *responses[segment + 1 :]])
    there_and_back = np.vstack([run.true_poses[later, :2], on_from_there[::-1]])
    return not windings(there_and_back, scene.positions[:2]).any()


def user_directions(walks, law):
    """Places (M, 2) in m of all laps, the user's direction (M,) in rad, the law's segment (M,)."""
    paths = [resample(walk, SHARES) for walk in walks]
    directions = np.concatenate([headings(path) for path in paths])
    return np.vstack(paths), directions, np.tile(segments_along(law), len(paths))


def heading_off(run, lasting, places, directions, segments):
    """Mean angle in rad between a robot's way and the user's at the nearest place of its segment.

    From the kidnapping on, for at most `lasting` s or one, while the robot moves; nan if it only
    turns.
    """
    (kidnapped,) = run.kidnapped
    steps = np.diff(run.true_poses[:, :2], axis=0)
    moving = (np.hypot(*steps.T) > 0.005) & (np.hypot(*steps.T) < 0.1)
    since = run.t[:-1] - kidnapped
    rows = np.flatnonzero(moving & (since >= 0) & (since <= max(lasting, 1.0)))
    angles = []
    for row in rows:
        mine = np.flatnonzero(segments == run.active[row])
        nearest = mine[np.linalg.norm(places[mine] - run.true_poses[row, :2], axis=1).argmin()]
        angles.append(abs(wrapped(np.arctan2(*steps[row, ::-1]) - directions[nearest])))
    return np.mean(angles) if angles else nan
