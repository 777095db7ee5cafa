"""The experiments behind the claims: each is a function of a seed that returns its numbers (see `dollop.claims`).

Experiments of one seed share its recordings.
"""

from functools import lru_cache
from math import nan
from time import perf_counter

import numpy as np

from dollop import experiments
from dollop.avoidance import ObstacleMap
from dollop.baseline import TASKS, draw_demonstrations, merged
from dollop.execution import Unicycle, distances_to_law, free_poses, perform, return_times
from dollop.foreground import near_together, seen_free
from dollop.lab.person import slalom, smooth_path
from dollop.lab.scenes import figure_eight_scene, rearranged, slalom_scene
from dollop.layouts import random_layouts, right_indices
from dollop.lds import LDS
from dollop.matching import match
from dollop.observation import observe
from dollop.repetition import laps
from dollop.sequenced_lds import SequencedLDS
from dollop.task import Demonstration, Task, learn, members_along
from dollop.tracking import (
    Motion,
    Tracker,
    draw_particles,
    move_particles,
    particle_moments,
    predict,
    track_objects,
    update,
)
from dollop.trajectory import distance_to_polyline, mean_trajectory

# ---- what the experiments of one seed share


@lru_cache(maxsize=1)
def eights(seed):
    """Recording of five figure-eights (Fig. 6a), of a walker of this seed."""
    from dollop.lab import record_figure_eights

    return record_figure_eights(seed)


@lru_cache(maxsize=1)
def eights_seen_ideally(seed):
    """The same walk, seen by a laser without noise or mixed pixels."""
    from dollop.lab import SickLMS200, record_figure_eights

    return record_figure_eights(seed, sick=SickLMS200(noise=0.0, mixed=0.0))


@lru_cache(maxsize=1)
def eights_observed(seed):
    """Observation of the five figure-eights."""
    return observe(eights(seed).log, experiments.background_map())


@lru_cache(maxsize=1)
def eight_task(seed):
    """The task of the five figure-eights."""
    return Task.of(Demonstration.of(eights_observed(seed)))


def expected_centroids(user, recording):
    """Where a centroid of the walker is expected at each time of a track, (N, 2) in m.

    The true place, pushed towards the sensor by the mean distance between the walker and the centroids: the laser
    sees the near side only.
    """
    true = np.column_stack([np.interp(user.t, recording.truth.t, recording.truth[axis]) for axis in "xy"])
    sight = true - recording.log.poses[0, :2]
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    return true - np.nanmean(((true - user.measurements) * sight).sum(axis=1)) * sight


# ---- Sec. II: observing the user

VELOCITY, ACCELERATION = Motion(2, noise=0.533), Motion(3, noise=0.3)
"""Each with the noise that suits it best, chosen by `chosen_noise` on seeds that the study does not use."""

NOISES = tuple(float(noise) for noise in np.round(np.geomspace(0.03, 30, 13), 3))


def chosen_noise(order, seeds=range(10_000, 10_010)):
    """The spectral density with which a motion model predicts hidden walkers best, on average over both ways to hide.

    Parameters
    ----------
    order : int
        2: velocity; 3: acceleration as well.
    seeds : iterable of int

    Returns
    -------
    float
        m^2/s^(2 order - 1), one of `NOISES`.
    """
    errors = np.zeros(len(NOISES))
    for seed in seeds:
        user, expected = eights_observed(seed).user, expected_centroids(eights_observed(seed).user, eights(seed))
        for hide in (behind_cans, now_and_then):
            shown, hidden = hide(user)
            for k, noise in enumerate(NOISES):
                guesses = causal_estimates(user.t, shown, Motion(order, noise))
                errors[k] += np.linalg.norm(guesses - expected, axis=1)[hidden].mean()
    return NOISES[int(errors.argmin())]


def behind_cans(user):
    """The centroids as they are, and where the walker was out of sight."""
    return user.measurements, user.occluded


def now_and_then(user, every=4.0, length=1.0):
    """The centroids with one second in four taken away, from the third on, and where that hides a visible walker."""
    hidden = ((user.t - user.t[0]) % every >= every - length) & ~user.occluded
    return np.where(hidden[:, None], nan, user.measurements), hidden


def causal_estimates(t, shown, motion, carry_on=None):
    """Position (N, 2) in m at each scan from the scans so far, predicted where the centroids `shown` (N, 2) are nan.

    Parameters
    ----------
    carry_on : callable, optional
        carry_on(i, means, covariances, F, Q) predicts over scans out of sight; the Kalman prediction by default.
    """
    means, covariances = motion.birth(shown[:1])
    estimates = [means[0, 0]]
    for i, (dt, z) in enumerate(zip(np.diff(t), shown[1:], strict=True), start=1):
        F, Q = motion.transition(dt)
        if np.isfinite(z[0]):
            means, covariances = update(*predict(means, covariances, F, Q), z[None], motion.measurement_sd)
        else:
            means, covariances = (carry_on or ahead)(i, means, covariances, F, Q)
        estimates.append(means[0, 0])
    return np.array(estimates)


def ahead(i, means, covariances, F, Q):
    """Kalman prediction, whichever the scan."""
    return predict(means, covariances, F, Q)


def standing_still(i, means, covariances, F, Q):
    """The walker stays where it was last seen."""
    return means * np.array([1.0, 0.0])[None, :, None], predict(means, covariances, F, Q)[1]


def velocity(seed):
    """How far predictions of a hidden walker are off, with velocity, with acceleration as well, with neither."""
    user, recording = eights_observed(seed).user, eights(seed)
    expected = expected_centroids(user, recording)
    numbers = {}
    for name, hide in (("cans", behind_cans), ("anywhere", now_and_then)):
        shown, hidden = hide(user)

        def error(*model, shown=shown, hidden=hidden):
            return np.linalg.norm(causal_estimates(user.t, shown, *model) - expected, axis=1)[hidden].mean()

        best = error(VELOCITY)
        numbers |= {
            f"{name}_velocity_m": best,
            f"{name}_acceleration_more_m": error(ACCELERATION) - best,
            f"{name}_standing_more_m": error(VELOCITY, standing_still) - best,
        }
    return numbers


def particles_of(recording, user, seed):
    """Prediction by particles that die where the laser would have seen them, as `causal_estimates` takes it."""
    rng, log = np.random.default_rng([seed, 2]), recording.log
    scans, clouds = np.searchsorted(log.t, user.t), {}

    def carry_on(i, means, covariances, F, Q):
        scan = scans[i]
        cloud = clouds.pop(i, None)
        if cloud is None:
            cloud = draw_particles(means[0], covariances[0], rng)
        cloud = move_particles(
            cloud, F, Q, rng, lambda points: seen_free(points, log.poses[scan], log.angles, log.ranges[scan])
        )
        clouds[i + 1] = cloud
        mean, covariance = particle_moments(cloud)
        return mean[None], covariance[None]

    return carry_on


def prediction(seed, missed=0.5):
    """Predictions of the walker behind the cans by the Kalman filter and by particles; a miss is 0.5 m or more."""
    user, recording = eights_observed(seed).user, eights(seed)
    expected = expected_centroids(user, recording)
    shown, hidden = behind_cans(user)
    last = hidden & ~np.append(hidden[1:], False)
    kalman, particles = (
        np.linalg.norm(causal_estimates(user.t, shown, Motion(), carry_on) - expected, axis=1)
        for carry_on in (None, particles_of(recording, user, seed))
    )
    return {
        "kalman_m": kalman[hidden].mean(),
        "particles_more_m": (particles - kalman)[hidden].mean(),
        "kalman_missed": (kalman[last] >= missed).mean(),
        "particles_missed_more": (particles[last] >= missed).mean() - (kalman[last] >= missed).mean(),
    }


def centroid(seed):
    """Noise of the centroids per axis, with the laser as it is and with an ideal one on the same walk."""
    spreads = []
    for recording, observation in (
        (eights(seed), eights_observed(seed)),
        (eights_seen_ideally(seed), observe(eights_seen_ideally(seed).log, experiments.background_map())),
    ):
        off = observation.user.measurements - expected_centroids(observation.user, recording)
        spreads.append(np.sqrt(np.nanmean(off**2)))
    return {
        "noise_mm": 1e3 * spreads[0],
        "laser_sds": spreads[0] / 0.005,
        "share_without_laser_noise": (spreads[1] / spreads[0]) ** 2,
    }


def crossing_walkers(n, rng, side=6.0, duration=30.0, blob=0.4, noise=0.03):
    """Walkers at 1 m/s on smooth ways through a square, as centroids; nearer to each other than `blob` they are one.

    Returns
    -------
    t : (T,) float array
        s, ten scans a second.
    objects : list of T (M, 2) float arrays
        Centroids in m.
    alone : (T, n) int array
        Which of them is walker w, -1 where it is one with another.
    """
    t = np.arange(0.0, duration, 0.1)
    ways = [smooth_path(rng.uniform(0, side, (int(duration / side * 3) + 4, 2)))[::5][: len(t)] for _ in range(n)]
    objects, alone = [], []
    for places in np.stack(ways, axis=1) + rng.normal(0, noise, (len(t), n, 2)):
        labels = near_together(places, blob)
        sizes = np.bincount(labels)
        objects.append(np.column_stack([np.bincount(labels, column) for column in places.T]) / sizes[:, None])
        alone.append(np.where(sizes[labels] == 1, labels, -1))
    return t, objects, np.array(alone)


def switches(t, objects, alone, matching):
    """How often a walker that stands alone goes on under another track, per walker and minute."""
    tracks = track_objects(t, objects, Tracker(matching=matching))
    names = np.full(alone.shape, -1)
    for k, track in enumerate(tracks):
        for i, z in zip(np.searchsorted(t, track.t), track.measurements, strict=True):
            mine = np.flatnonzero((objects[i] == z).all(axis=1)) if len(objects[i]) else []
            names[i, np.isin(alone[i], mine) & (alone[i] >= 0)] = k
    changes = [np.count_nonzero(np.diff(column[column >= 0])) for column in names.T]
    return np.mean(changes) / (t[-1] - t[0]) * 60


def greedy(seed):
    """Identity switches with greedy and with joint matching, among two walkers and among twelve."""
    numbers = {}
    for name, n in (("sparse", 2), ("dense", 12)):
        scene = crossing_walkers(n, np.random.default_rng([seed, n]))
        by_greedy, by_joint = (switches(*scene, matching) for matching in ("greedy", "joint"))
        numbers |= {f"{name}_greedy_per_min": by_greedy, f"{name}_greedy_more_per_min": by_greedy - by_joint}
    return numbers


def interpolation(seed):
    """Error of the user's track where the user was out of sight, and how often the user was lost."""
    observation = eights_observed(seed)
    user = observation.user
    errors = np.linalg.norm(user.positions - expected_centroids(user, eights(seed)), axis=1)
    return {
        "occluded_error_m": errors[user.occluded].mean(),
        "visible_error_m": errors[~user.occluded].mean(),
        "occluded_s": np.diff(user.t, prepend=user.t[0])[user.occluded].sum(),
        "lost": float(observation.losses > 0),
        "followed": (errors < 0.5).mean(),
    }


# ---- Sec. III: describing user trajectories


def eight_laps(seed):
    """The laps of the five figure-eights."""
    user = eights_observed(seed).user
    return laps(user.t, user.positions)


def segments(seed):
    """Number of LDS and mean error at a tolerance of 20 mm."""
    walks, law = eight_laps(seed), eight_task(seed).law
    return {
        "n_segments": float(len(law.segments)),
        "error_m": distance_to_polyline(mean_trajectory(walks), law.response()).mean(),
        "error_laps_m": np.mean([law.error(walk) for walk in walks]),
    }


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
    law, scene = eight_task(seed).law, eights(seed).scene
    return {"eight": is_eight(law, scene), "clearance_m": clear_of(law, scene)}


def generalise(seed):
    """Error on the last lap of a law from the first lap alone, and of one from all laps but the last."""
    *shown, kept = eight_laps(seed)
    alone, several = (SequencedLDS.fit(walks).error(kept) for walks in (shown[:1], shown))
    return {"several_m": several, "alone_more_m": alone - several}


def stable(seed):
    """Largest spectral radius of LDS fitted to random walks, and from how far away the response still arrives."""
    rng = np.random.default_rng([seed, 3])
    walks = [rng.normal(size=(rng.integers(3, 60), 2)).cumsum(axis=0) for _ in range(20)]
    fits = [LDS.fit(walk, retimed=retimed) for walk in walks for retimed in (True, False)]
    law = eight_task(seed).law
    ends = [law.response(place)[-1] for place in rng.uniform([0, 0], [9, 7], (20, 2))]
    return {
        "largest_radius": max(np.abs(np.linalg.eigvals(fit.A)).max() for fit in fits),
        "end_off_m": np.linalg.norm(np.array(ends) - law.subgoals[-1], axis=1).max(),
    }


def scaled(seed):
    """How far the response to scaled and shifted subgoals is from the scaled and shifted response, in % of its size."""
    rng, law = np.random.default_rng([seed, 4]), eight_task(seed).law
    factor, shift = rng.uniform(0.5, 2.0), rng.uniform(-3, 3, 2)
    wanted = factor * law.response() + shift
    given = law.with_subgoals(factor * law.subgoals + shift, factor * law.start + shift).response()
    return {"off_percent": 100 * distance_to_polyline(wanted, given).max() / np.linalg.norm(np.ptp(wanted, axis=0))}


def follow(seed):
    """A run of the robot under the paper's law, from near the start."""
    task = eight_task(seed)
    (start,) = experiments.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 5]))
    run = run_plainly(task, start)
    away = distances_to_law(run, task.law)
    return {"mean_m": away.mean(), "max_m": away.max(), "finished": float(run.finished)}


def run_plainly(task, start, **choices):
    """A run under the paper's law, which knows no obstacles, of a robot that knows where it is."""
    robot, grid = Unicycle(start), experiments.background_map()
    return perform(task, robot, control="plain", avoid=False, background=grid, **choices)


@lru_cache(maxsize=1)
def kidnapped_runs(seed, count=5):
    """Five runs, each kidnapped once to anywhere in the laboratory."""
    task, rng = eight_task(seed), np.random.default_rng([seed, 6])
    starts = experiments.starts_near_the_beginning(task, count, rng)
    obstacles = ObstacleMap.of(task.environment, experiments.background_map())
    places = free_poses(count, obstacles, task.law.subgoals[0], rng)
    kidnaps = zip(starts, rng.uniform(5.0, 25.0, count), places, strict=True)
    return [run_plainly(task, start, kidnap=[(time, place)]) for start, time, place in kidnaps]


def kidnap(seed):
    """Whether the robot goes on to finish after being kidnapped, and comes back to the response, and how soon."""
    runs, law = kidnapped_runs(seed), eight_task(seed).law
    times = np.concatenate([return_times(run, law) for run in runs])
    back = np.isfinite(times)
    return {
        "finished": np.mean([run.finished for run in runs]),
        "returned": back.mean(),
        "return_s": times[back].mean() if back.any() else nan,
    }


def luck(seed):
    """How often kidnapped robots hit something, and whether five in a row do not."""
    hits = [run.collisions > 0 for run in kidnapped_runs(seed)]
    return {"hit": np.mean(hits), "five_missed": float(not any(hits))}


# ---- Sec. IV: the environment


def matching_time(seed, objects=50):
    """Time in s that the paper's matching takes for fifty objects, two hundred corners; the best of three."""
    before, after, _ = random_layouts(objects, np.random.default_rng(seed), room=40.0)
    times = []
    for _ in range(3):
        start = perf_counter()
        match(before, after, method="literal")
        times.append(perf_counter() - start)
    return {"seconds": min(times)}


def counterintuitive(seed, layouts=10):
    """How often a matching of three boxes that each moved a little is not the obvious one."""
    rng = np.random.default_rng([seed, 7])
    numbers = {}
    for name, noise in (("exact", 0.0), ("seen", 0.05)):
        drawn = [random_layouts(3, rng, noise=noise) for _ in range(layouts)]
        for method in ("literal", "robust"):
            wrong = [
                (match(before, after, method=method).indices != right_indices(partners)).any()
                for before, after, partners in drawn
            ]
            numbers[f"{method}_{name}"] = np.mean(wrong)
    return numbers


@lru_cache(maxsize=1)
def moved_eight(seed):
    """Scene with the cans moved by some 0.4 m, and twice what the laser sees of it."""
    from dollop.lab import watch

    scene = rearranged(figure_eight_scene(), np.random.default_rng([seed, 8]), reach=0.4, spacing=1.0)
    seen = [observe(watch(scene, [seed, 8, k]).log, experiments.background_map()).environment for k in range(2)]
    return scene, *seen


def consistent(seed):
    """Whether two looks at the same moved cans give the same matching."""
    before = eight_task(seed).environment
    same = {}
    for method in ("literal", "robust"):
        first, second = (match(before, now, method=method).indices for now in in_one_order(moved_eight(seed)[1:]))
        same[method] = float(np.array_equal(first, second))
    return same


def in_one_order(environments):
    """Environments with their boxes from left to right, so that indices mean the same."""
    return [type(each)(each.boxes[np.argsort(each.boxes[:, 0])]) for each in environments]


def moved(seed):
    """Whether the task adapted to moved cans is still a figure-eight, and whether law and robot keep clear of them."""
    scene, now, _ = moved_eight(seed)
    try:
        task = eight_task(seed).adapt(now)
    except ValueError:  # an ambiguous matching: it asks instead of guessing
        return {"refused": 1.0, "eight": nan, "law_clear": nan, "robot_clear": nan, "subgoals_moved_m": nan}
    shift = np.linalg.norm(task.law.subgoals - eight_task(seed).law.subgoals, axis=1)
    (start,) = experiments.starts_near_the_beginning(task, 1, np.random.default_rng([seed, 9]))
    run = run_plainly(task, start)
    return {
        "refused": 0.0,
        "eight": is_eight(task.law, scene),
        "law_clear": float(clear_of(task.law, scene) > 0),
        "robot_clear": float(run.finished and not run.collisions),
        "subgoals_moved_m": shift.mean(),
    }


# ---- Sec. V: learning


def several(seed, numbers=(1, 2, 5, 10)):
    """Error of the merged subgoals of a slalom from one to ten demonstrations, and how fast it falls."""
    truth = np.array(TASKS["slalom"])
    errors = {n: subgoal_error(merged(draw_demonstrations(truth, n, 0.15, seed=[seed, n])), truth) for n in numbers}
    found = [(n, error) for n, error in errors.items() if np.isfinite(error)]
    slope = np.polyfit(*np.log(np.array(found)).T, 1)[0] if len(found) > 1 else nan
    return {f"error_{n}_m": error for n, error in errors.items()} | {
        "two_more_than_ten_m": errors[2] - errors[10],
        "exponent": slope,
    }


def subgoal_error(found, truth):
    """Mean distance in m of the found subgoals from the true ones, nan where their number is not right."""
    return np.linalg.norm(found - truth, axis=1).mean() if len(found) == len(truth) else nan


@lru_cache(maxsize=4)
def slalom_shown(seed, k):
    """The k-th slalom of a seed among four cones of its own layout, as the laser saw it."""
    from dollop.lab import record

    rng = np.random.default_rng([seed, 10, k])
    for _ in range(100):
        try:
            scene = rearranged(slalom_scene(), rng, reach=0.25, spacing=0.6)
            walk = slalom(scene, rng)
        except ValueError:  # no room to walk among these
            continue
        recording = record(scene, walk, [seed, 10, k])
        return Demonstration.of(observe(recording.log, experiments.background_map()))
    raise RuntimeError("no layout with room for a slalom in 100 draws")


NO_SLALOM = {"refused": 1.0, "both_m": nan, "alone_more_m": nan, "own_lds_more_m": nan, "sides_right": nan}


def shared(seed):
    """A slalom learned from two demonstrations, in the layout of a third: how far from what was walked there.

    Beside it a task from each demonstration alone; and the same subgoals with LDS of one demonstration, not shared.
    """
    *shown, kept = (slalom_shown(seed, k) for k in range(3))
    try:
        both = learn(shown).adapt(kept.environment)
        alone = [Task.of(each).adapt(kept.environment) for each in shown]
    except ValueError:  # an ambiguous matching: it asks instead of guessing
        return NO_SLALOM
    error = walked_error(both.law, kept)
    own = [walked_error(with_own_lds(both, shown, d), kept) for d in range(len(shown))]
    return {
        "refused": 0.0,
        "both_m": error,
        "alone_more_m": np.mean([walked_error(task.law, kept) for task in alone]) - error,
        "own_lds_more_m": np.mean(own) - error,
        "sides_right": sides_right(both, kept),
    }


def walked_error(law, demonstration):
    """Mean distance in m from what was walked to a law's response."""
    return np.mean([law.error(walk) for walk in demonstration.trajectory])


def with_own_lds(task, shown, d):
    """The task's law with the LDS of demonstration d alone wherever it has a part in a shared one."""
    own = []
    for segment, members in zip(task.law.segments, members_along(task.model), strict=True):
        mine = [shown[each].law.segments[i].statistics for each, i in members if each == d]
        own.append(LDS.from_statistics(mine[0], segment.goal) if mine else segment)
    return SequencedLDS(tuple(own), task.law.start, task.law.speeds)


def sides_right(task, kept):
    """Whether the law passes every cone on the side on which the user passed it."""
    (walk,) = kept.trajectory
    law, user = (experiments.passing_sides(path, kept.environment.centres) for path in (task.law.response(), walk))
    return float(np.array_equal(law, user))
