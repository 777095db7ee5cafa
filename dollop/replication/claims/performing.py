"""Experiments on the control law and its performance (Sec. III): each is a function of a seed that
returns its numbers.

See `dollop.replication.claims` for what is asked of them. The robot is a `Unicycle` that knows its
pose and passes through what it hits: where that matters, a run counts until it first touches
something.
"""

from dataclasses import replace
from functools import lru_cache
from math import inf, nan

import numpy as np

from dollop.environment import Environment
from dollop.lds import LDS
from dollop.replication import recordings
from dollop.replication.runs import distances_to_law, free_poses, return_times
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.control import Guidance
from dollop.robot.performing import Unicycle, perform
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import arc_length, distance_to_polyline, mean_trajectory, resample

SAMPLES = 200
"""At so many equal shares of the way the law is compared with the laps."""
KIDNAPPINGS = 5

# ---- the law


def generalise(seed):
    """Error on the last lap of a law from the first lap alone, and of one from all laps but the
    last.
    """
    *shown, kept = recordings.figure_eight_laps(seed)
    alone, several = (SequencedLDS.fit(walks).error(kept) for walks in (shown[:1], shown))
    return {"several_m": several, "alone_more_m": alone - several}


def segments(seed):
    """Number of LDS at a tolerance of 20 mm, and at half and twice as much; mean errors at 20 mm."""
    walks, law = recordings.figure_eight_laps(seed), recordings.figure_eight_task(seed).law
    return {
        "n_segments": float(len(law.segments)),
        "n_at_10_mm": float(len(SequencedLDS.fit(walks, tolerance=0.010).segments)),
        "n_at_40_mm": float(len(SequencedLDS.fit(walks, tolerance=0.040).segments)),
        "error_m": distance_to_polyline(mean_trajectory(walks), law.response()).mean(),
        "error_laps_m": np.mean([law.error(walk) for walk in walks]),
    }


def parameters(seed):
    """How many numbers the law has beside one lap's samples, and beside the coarsest polyline that
    is no worse.
    """
    walks, law = recordings.figure_eight_laps(seed), recordings.figure_eight_task(seed).law
    mean = mean_trajectory(walks)
    error = distance_to_polyline(mean, law.response()).mean()
    corners = next(n for n in range(2, SAMPLES) if distance_to_polyline(mean, resample(mean, n)).mean() <= error)
    count = 7 * len(law.segments) + 2  # A, subgoal and speed of each segment; the start
    return {
        "share_of_lap": count / np.mean([walk.size for walk in walks]),
        "share_of_polyline": count / (2 * corners),
        "numbers": float(count),
    }


def salient(seed):
    """How far direction, curvature and speed along the law are from those of the laps, at equal
    shares of the way.

    The speed of the law is that of the segment. An LDS fitted to the samples as they are has a
    speed of its own.
    """
    walks, law = recordings.figure_eight_laps(seed), recordings.figure_eight_task(seed).law
    walked, planned = mean_trajectory(walks, SAMPLES), resample(law.response(), SAMPLES)
    turns, planned_turns = headings(walked), headings(planned)
    bends, planned_bends = np.gradient(turns), np.gradient(planned_turns)
    speeds = np.mean([speeds_along(walk) for walk in walks], axis=0)
    own = speeds_along(SequencedLDS.fit(walks, retimed=False).response())
    return {
        "direction_deg": np.degrees(np.abs(angle_between(turns, planned_turns)).mean()),
        "curvature_correlation": np.corrcoef(bends, planned_bends)[0, 1],
        "speed_off_share": np.abs(law.speeds[segments_along(law)] - speeds).mean() / speeds.mean(),
        "own_speed_off_share": np.abs(own - speeds).mean() / speeds.mean(),
    }


def headings(path, width=5):
    """Directions (N,) in rad along a path (N, 2), unwrapped, each over `width` samples to either
    side.
    """
    rows = np.arange(len(path))
    way = path[np.minimum(rows + width, len(path) - 1)] - path[np.maximum(rows - width, 0)]
    return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))


def angle_between(a, b):
    """Angles a - b in rad, in [-pi, pi)."""
    return (a - b + np.pi) % (2 * np.pi) - np.pi


def speeds_along(walk, period=0.1):
    """Speeds (SAMPLES,) in m/s at equal shares of the way, of a walk (N, 2) with a sample every 0.1
    s.
    """
    walked = arc_length(walk)
    shares = np.linspace(0, 1, SAMPLES)
    moments = np.interp(shares * walked[-1], walked, period * np.arange(len(walk)))
    return walked[-1] * np.gradient(shares) / np.maximum(np.gradient(moments), 1e-9)


def handing_over(law):
    """Shares (K,) of the way along the response at which each segment hands over, the last being 1."""
    response, parts = law.response(), range(1, len(law.segments) + 1)
    vertices = [len(replace(law, segments=law.segments[:k]).response()) - 1 for k in parts]
    walked = arc_length(response)
    return walked[vertices] / walked[-1]


def segments_along(law):
    """Index of the segment in force at SAMPLES equal shares of the way: (SAMPLES,)."""
    return np.searchsorted(handing_over(law)[:-1], np.linspace(0, 1, SAMPLES))


def windings(path, centres):
    """How often a path (M, 2), closed, goes round each centre (N, 2), counter-clockwise."""
    z = np.append(path, path[:1], axis=0) @ (1, 1j)
    around = z - (np.asarray(centres) @ (1, 1j))[:, None]
    return np.round(np.angle(around[:, 1:] / around[:, :-1]).sum(axis=1) / (2 * np.pi)).astype(int)


def is_eight(law, scene):
    """Whether the law's response goes once round the first two objects, in opposite directions."""
    return float(sorted(windings(law.response(), scene.positions[:2])) == [-1, 1])


def clear_of(law, scene):
    """Least distance in m between the law's response and the foot of any object."""
    path = law.response()
    apart = np.linalg.norm(path[:, None] - scene.positions, axis=2) - scene.foot_radii
    return apart.min()


def figure(seed):
    """Whether the law is a figure-eight, and how far from the obstacles it keeps."""
    law, scene = recordings.figure_eight_task(seed).law, recordings.figure_eights(seed).scene
    return {"eight": is_eight(law, scene), "clearance_m": clear_of(law, scene)}


def stable(seed):
    """How far below one the spectral radius of LDS fitted to random walks is, and whence the
    response still arrives.
    """
    rng = np.random.default_rng([seed, 3])
    walks = [rng.normal(size=(rng.integers(3, 60), 2)).cumsum(axis=0) for _ in range(20)]
    fits = [LDS.fit(walk, retimed=retimed) for walk in walks for retimed in (True, False)]
    law = recordings.figure_eight_task(seed).law
    ends = [law.response(place)[-1] for place in rng.uniform([0, 0], [9, 7], (20, 2))]
    return {
        "margin": 1 - max(np.abs(np.linalg.eigvals(fit.A)).max() for fit in fits),
        "end_off_m": np.linalg.norm(np.array(ends) - law.subgoals[-1], axis=1).max(),
    }


def scaled(seed):
    """How far the response to scaled and shifted subgoals is from the scaled and shifted response,
    in % of its size.
    """
    rng, law = np.random.default_rng([seed, 4]), recordings.figure_eight_task(seed).law
    factor, shift = rng.uniform(0.5, 2.0), rng.uniform(-3, 3, 2)
    wanted = factor * law.response() + shift
    given = law.with_subgoals(factor * law.subgoals + shift, factor * law.start + shift).response()
    return {"off_percent": 100 * distance_to_polyline(wanted, given).max() / np.linalg.norm(np.ptp(wanted, axis=0))}


# ---- the robot


def run_plainly(task, start, **choices):
    """A run under the paper's law, which knows no obstacles, of a robot that knows where it is."""
    robot, grid = Unicycle(start), recordings.background_map()
    return perform(task, robot, control="plain", avoid=False, background=grid, **choices)


def follow(seed):
    """A run of the robot under the paper's law, from near the start."""
    task = recordings.figure_eight_task(seed)
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 5]))
    run = run_plainly(task, start)
    away = distances_to_law(run, task.law)
    return {"mean_m": away.mean(), "max_m": away.max(), "finished": float(run.finished)}


def state(seed):
    """By how much a run changes when the objects are taken away, and the law's direction with the
    segment in force.
    """
    task = recordings.figure_eight_task(seed)
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 5]))
    runs = [run_plainly(each, start) for each in (task, replace(task, environment=Environment(np.empty((0, 4)))))]
    common = min(len(run.t) for run in runs)
    apart = np.linalg.norm(runs[0].poses[:common, :2] - runs[1].poses[:common, :2], axis=1)
    guidance, places = Guidance(task.law), np.random.default_rng([seed, 15]).uniform([0, 0], [9, 7], (50, 2))
    count = len(task.law.segments)
    ways = np.array([[guidance.direction(k, x, y) for k in range(count)] for x, y in places]) @ (1, 1j)
    between = np.abs(np.angle(ways[:, :, None] / ways[:, None]))[:, ~np.eye(count, dtype=bool)]
    return {"objects_m": apart.max(), "segments_deg": np.degrees(between.mean())}


@lru_cache(maxsize=1)
def kidnapped_runs(seed, count=KIDNAPPINGS):
    """Five runs, each kidnapped once to anywhere in the laboratory."""
    task, rng = recordings.figure_eight_task(seed), np.random.default_rng([seed, 6])
    starts = recordings.starts_near_the_beginning(task, count, rng)
    obstacles = ObstacleMap.of(task.environment, recordings.background_map())
    places = free_poses(count, obstacles, task.law.subgoals[0], rng)
    kidnaps = zip(starts, rng.uniform(5.0, 25.0, count), places, strict=True)
    return [run_plainly(task, start, kidnap=[(time, place)]) for start, time, place in kidnaps]


def kidnap(seed):
    """Whether a kidnapped robot comes back, finishes, goes on as the user did, and how soon; a
    collision ends a run.
    """
    task, scene = recordings.figure_eight_task(seed), recordings.figure_eights(seed).scene
    runs = kidnapped_runs(seed)
    times = np.array([return_time(run, task.law) for run in runs])
    back = np.isfinite(times)
    free = [run.finished and not run.collisions for run in runs]
    goes_on = [winds_as_demonstrated(run, task.law, scene) for clear, run in zip(free, runs, strict=True) if clear]
    user = user_directions(recordings.figure_eight_laps(seed), task.law)
    off = [heading_off(run, min(time, 60.0), *user) for run, time in zip(runs, times, strict=True)]
    return {
        "returned": back.mean(),
        "finished": np.mean(free),
        "goes_on": np.mean(goes_on) if goes_on else nan,
        "heading_deg": np.degrees(np.nanmean(off)),
        "return_s": times[back].mean() if back.any() else nan,
    }


def first_hit(run):
    """Time in s at which a run first touches something, infinite if it does not."""
    return run.t[(run.clearance < 0).argmax()] if run.collisions else inf


def return_time(run, law):
    """Time in s from the kidnapping until the robot is back on the response, infinite if it hits
    something before.
    """
    (time,) = return_times(run, law)
    return time if run.kidnapped[0] + time < first_hit(run) else inf


def winds_as_demonstrated(run, law, scene):
    """Whether, from the next subgoal after its kidnapping on, a run goes round the cans as the law
    does to its end.
    """
    rows = np.flatnonzero(run.t >= run.kidnapped[0])
    segment = run.active[rows[0]]
    later = rows[run.active[rows] > segment]
    if not len(later):
        return True
    response = law.response()
    handed_over = len(replace(law, segments=law.segments[: segment + 1]).response()) - 1
    there_and_back = np.vstack([run.true_poses[later, :2], response[handed_over:][::-1]])
    return not windings(there_and_back, scene.positions[:2]).any()


def user_directions(walks, law):
    """Places (M, 2) in m of all laps, there the user's direction (M,) in rad, and the law's segment
    (M,).
    """
    paths = [resample(walk, SAMPLES) for walk in walks]
    return (
        np.vstack(paths),
        np.concatenate([headings(path) for path in paths]),
        np.tile(segments_along(law), len(paths)),
    )


def heading_off(run, lasting, places, directions, segments):
    """Mean angle in rad between a robot's way and the user's at the nearest place of the same
    segment of the laps.

    From the kidnapping on, for at most `lasting` s or one, while the robot moves; nan if it only
    turns.
    """
    (kidnapped,) = run.kidnapped
    steps = np.diff(run.true_poses[:, :2], axis=0)
    moving = (np.hypot(*steps.T) > 0.005) & (np.hypot(*steps.T) < 0.1)
    rows = np.flatnonzero(moving & (run.t[:-1] >= kidnapped) & (run.t[:-1] <= kidnapped + max(lasting, 1.0)))
    angles = []
    for row in rows:
        mine = np.flatnonzero(segments == run.active[row])
        nearest = mine[np.linalg.norm(places[mine] - run.true_poses[row, :2], axis=1).argmin()]
        angles.append(abs(angle_between(np.arctan2(*steps[row, ::-1]), directions[nearest])))
    return np.mean(angles) if angles else nan


def luck(seed):
    """How often kidnapped robots hit something, before they are back and at all, and whether five
    in a row do not.
    """
    law, runs = recordings.figure_eight_task(seed).law, kidnapped_runs(seed)
    hits = [run.collisions > 0 for run in runs]
    before = [run.collisions > 0 and return_time(run, law) == inf for run in runs]
    return {"hit": np.mean(hits), "hit_before_back": np.mean(before), "five_missed": float(not any(hits))}
