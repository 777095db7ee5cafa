"""Experiments on observing the user (Sec. II): each is a function of a seed that returns its
numbers.

See `dollop.replication.claims` for what is asked of them. Experiments of one seed share its
recordings (`dollop.replication.recordings`).

Where the truth is known, an estimate is compared with the place where a centroid of the walker is
expected: the true place, moved towards the sensor by the mean distance between the walker and the
centroids of that recording. The laser sees the near side only; this constant bias is told, and
taken out of the errors.
"""

from functools import lru_cache
from math import nan

import numpy as np

from dollop.foreground import near_together, seen_free
from dollop.lab.person import smooth_path, walk
from dollop.laser import LaserLog
from dollop.observation import observe
from dollop.replication import recordings
from dollop.tracking import (
    Motion,
    Tracker,
    draw_particles,
    identify_user,
    move_particles,
    particle_moments,
    predict,
    track_objects,
    update,
)
from dollop.trajectory import distance_to_polyline


@lru_cache(maxsize=1)
def eights_seen_ideally(seed):
    """The five figure-eights of a seed, seen by a laser without noise or mixed pixels."""
    from dollop.lab import SickLMS200, record_figure_eights

    return record_figure_eights(seed, sick=SickLMS200(noise=0.0, mixed=0.0))


def true_places(t, recording):
    """Where the walker was at times t (N,) in s: (N, 2) in m."""
    return np.column_stack([np.interp(t, recording.truth.t, recording.truth[axis]) for axis in "xy"])


def lines_of_sight(places, recording):
    """Unit vectors (N, 2) from the laser to places (N, 2) in m."""
    sight = places - recording.log.poses[0, :2]
    return sight / np.linalg.norm(sight, axis=1, keepdims=True)


def near_side_bias(user, recording):
    """Mean distance in m by which the centroids of a track are nearer to the laser than the walker
    is.
    """
    true = true_places(user.t, recording)
    return np.nanmean(((true - user.measurements) * lines_of_sight(true, recording)).sum(axis=1))


def expected_centroids(user, recording):
    """Where a centroid of the walker is expected at each time of a track, (N, 2) in m."""
    true = true_places(user.t, recording)
    return true - near_side_bias(user, recording) * lines_of_sight(true, recording)


def centroid(seed):
    """Noise of the centroids per axis, with the laser as it is and with an ideal one on the same
    walk.
    """
    spreads = []
    for recording, observation in (
        (recordings.figure_eights(seed), recordings.figure_eights_observed(seed)),
        (eights_seen_ideally(seed), observe(eights_seen_ideally(seed).log, recordings.background_map())),
    ):
        off = observation.user.measurements - expected_centroids(observation.user, recording)
        spreads.append(np.sqrt(np.nanmean(off**2)))
    return {
        "noise_mm": 1e3 * spreads[0],
        "laser_sds": spreads[0] / 0.005,
        "share_without_laser_noise": (spreads[1] / spreads[0]) ** 2,
    }


def filtering(seed):
    """How much nearer to the truth the Kalman filter is than the centroids, in position and in
    velocity.
    """
    user, recording = recordings.figure_eights_observed(seed).user, recordings.figure_eights(seed)
    expected = expected_centroids(user, recording)
    true_velocity = np.gradient(true_places(user.t, recording), user.t, axis=0)
    filtered = causal_states(user.t, user.measurements, Motion())
    differences = np.diff(user.measurements, axis=0, prepend=nan) / np.diff(user.t, prepend=nan)[:, None]
    shown = np.isfinite(differences[:, 0])

    def error(estimates, truth):
        return np.linalg.norm(estimates - truth, axis=1)[shown].mean()

    place, velocity = error(filtered[:, 0], expected), error(filtered[:, 1], true_velocity)
    return {
        "filtered_m": place,
        "raw_more_m": error(user.measurements, expected) - place,
        "filtered_velocity_m_s": velocity,
        "raw_velocity_more_m_s": error(differences, true_velocity) - velocity,
        "smoothed_m": error(user.positions, expected),
    }


# ---- predicting a hidden walker

VELOCITY, ACCELERATION = Motion(2, noise=0.533), Motion(3, noise=0.3)
"""For `velocity`: each with the noise that suits it best, chosen by `chosen_noise` on seeds the
study does not use.
"""

NOISES = tuple(float(noise) for noise in np.round(np.geomspace(0.03, 30, 13), 3))


def behind_cans(user):
    """The centroids as they are, and where the walker was out of sight."""
    return user.measurements, user.occluded


def now_and_then(user, every=4.0, length=1.0):
    """The centroids with one second in four taken away, from the third on, and where that hides a
    visible walker.
    """
    hidden = ((user.t - user.t[0]) % every >= every - length) & ~user.occluded
    return np.where(hidden[:, None], nan, user.measurements), hidden


def chosen_noise(order, hides=(behind_cans, now_and_then), predictor=None, seeds=range(10_000, 10_010)):
    """The spectral density with which hidden walkers are predicted best, on average over ways to
    hide.

    Parameters
    ----------
    order : int
        2: velocity; 3: acceleration as well.
    hides : sequence of callable
        User's track to the centroids shown and where the walker is hidden.
    predictor : callable, optional
        predictor(recording, user, seed) is what predicts, as `causal_states` takes it; the Kalman
        prediction by default.
    seeds : iterable of int

    Returns
    -------
    float
        m^2/s^(2 order - 1), one of `NOISES`.
    """
    errors = np.zeros(len(NOISES))
    for seed in seeds:
        recording, user = recordings.figure_eights(seed), recordings.figure_eights_observed(seed).user
        expected = expected_centroids(user, recording)
        for hide in hides:
            shown, hidden = hide(user)
            for k, noise in enumerate(NOISES):
                carry_on = predictor and predictor(recording, user, seed)
                guesses = causal_states(user.t, shown, Motion(order, noise), carry_on)[:, 0]
                errors[k] += np.linalg.norm(guesses - expected, axis=1)[hidden].mean()
    return NOISES[int(errors.argmin())]


def causal_states(t, shown, motion, carry_on=None):
    """State (N, n, 2) at each scan from the scans so far, predicted where the centroids `shown` (N,
    2) are nan.

    Parameters
    ----------
    carry_on : callable, optional
        carry_on(i, means, covariances, F, Q) predicts over scans out of sight; the Kalman
        prediction by default.
    """
    means, covariances = motion.birth(shown[:1])
    states = [means[0]]
    for i, (dt, z) in enumerate(zip(np.diff(t), shown[1:], strict=True), start=1):
        F, Q = motion.transition(dt)
        if np.isfinite(z[0]):
            means, covariances = update(*predict(means, covariances, F, Q), z[None], motion.measurement_sd)
        else:
            means, covariances = (carry_on or ahead)(i, means, covariances, F, Q)
        states.append(means[0])
    return np.array(states)


def ahead(i, means, covariances, F, Q):
    """Kalman prediction, whichever the scan."""
    return predict(means, covariances, F, Q)


def standing_still(i, means, covariances, F, Q):
    """The walker stays where it was last seen."""
    return means * np.array([1.0, 0.0])[None, :, None], predict(means, covariances, F, Q)[1]


def velocity(seed):
    """How far predictions of a hidden walker are off, with velocity, with acceleration as well,
    with neither.
    """
    user, recording = recordings.figure_eights_observed(seed).user, recordings.figure_eights(seed)
    expected = expected_centroids(user, recording)
    numbers = {}
    for name, hide in (("cans", behind_cans), ("anywhere", now_and_then)):
        shown, hidden = hide(user)

        def error(*model, shown=shown, hidden=hidden):
            return np.linalg.norm(causal_states(user.t, shown, *model)[:, 0] - expected, axis=1)[hidden].mean()

        best = error(VELOCITY)
        numbers |= {
            f"{name}_velocity_m": best,
            f"{name}_acceleration_more_m": error(ACCELERATION) - best,
            f"{name}_standing_more_m": error(VELOCITY, standing_still) - best,
        }
    return numbers


def particles_of(recording, user, seed):
    """Prediction by particles that die where the laser would have seen them, as `causal_states`
    takes it.
    """
    log, scans = recording.log, np.searchsorted(recording.log.t, user.t)

    def visible(i, points):
        return seen_free(points, log.poses[scans[i]], log.angles, log.ranges[scans[i]])

    return particles(np.random.default_rng([seed, 2]), visible)


def blind_particles_of(recording, user, seed):
    """Prediction by particles that know nothing of where the laser sees free space, as
    `causal_states` takes it.
    """
    return particles(np.random.default_rng([seed, 2]))


def particles(rng, visible=None):
    """Prediction by particles; with visible(i, points), those that would have been seen in scan i
    die.
    """
    clouds = {}

    def carry_on(i, means, covariances, F, Q):
        cloud = clouds.pop(i, None)
        if cloud is None:
            cloud = draw_particles(means[0], covariances[0], rng)
        cloud = move_particles(cloud, F, Q, rng, visible and (lambda points: visible(i, points)))
        clouds[i + 1] = cloud
        mean, covariance = particle_moments(cloud)
        return mean[None], covariance[None]

    return carry_on


PREDICTORS = {
    "kalman": (Motion(2, noise=0.3), None),
    "particles": (Motion(2, noise=0.3), particles_of),
    "blind": (Motion(2, noise=0.3), blind_particles_of),
}
"""For `prediction`: motion model and what predicts, each with the noise that suits it best behind
the cans, chosen by `chosen_noise(2, (behind_cans,), predictor)`."""


def prediction(seed, missed=0.5):
    """Predictions of the walker behind the cans by the Kalman filter and by particles; a miss is
    0.5 m or more.
    """
    user, recording = recordings.figure_eights_observed(seed).user, recordings.figure_eights(seed)
    expected = expected_centroids(user, recording)
    shown, hidden = behind_cans(user)
    last = hidden & ~np.append(hidden[1:], False)
    errors = {}
    for name, (motion, predictor) in PREDICTORS.items():
        guesses = causal_states(user.t, shown, motion, predictor and predictor(recording, user, seed))[:, 0]
        errors[name] = np.linalg.norm(guesses - expected, axis=1)
    kalman = errors["kalman"]
    return {
        "kalman_m": kalman[hidden].mean(),
        "particles_more_m": (errors["particles"] - kalman)[hidden].mean(),
        "blind_more_m": (errors["blind"] - kalman)[hidden].mean(),
        "kalman_missed": (kalman[last] >= missed).mean(),
        "particles_missed_more": (errors["particles"][last] >= missed).mean() - (kalman[last] >= missed).mean(),
        "blind_missed_more": (errors["blind"][last] >= missed).mean() - (kalman[last] >= missed).mean(),
    }


def straight(seed):
    """How far Kalman predictions of a walker behind the cans are from a straight line, and the
    walker's own way.
    """
    user, recording = recordings.figure_eights_observed(seed).user, recordings.figure_eights(seed)
    predicted, true = causal_states(user.t, user.measurements, Motion())[:, 0], true_places(user.t, recording)
    spans = [rows for rows in spans_of(user.occluded) if len(rows) >= 3]
    return {
        "bend_mm": 1e3 * max(bend(predicted[rows]) for rows in spans),
        "walked_bend_mm": 1e3 * np.mean([bend(true[rows]) for rows in spans]),
    }


def spans_of(rows):
    """Index arrays of the runs of True in a (N,) bool array."""
    found = np.flatnonzero(rows)
    return np.split(found, np.flatnonzero(np.diff(found) > 1) + 1)


def bend(path):
    """Largest distance in m of a path (N, 2) from the line between its ends."""
    return distance_to_polyline(path, path[[0, -1]]).max()


# ---- matching predictions to objects


def crossing_walkers(n, rng, side=6.0, duration=30.0, blob=0.4, noise=0.03):
    """Walkers at 1 m/s on smooth ways through a square, as centroids; nearer to each other than
    `blob` they are one.

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


# ---- the user's track


def interpolation(seed):
    """Error of the user's track where the user was out of sight, with and without the bias, and how
    often it was lost.

    Losses are told per lap, of which there are five.
    """
    observation, recording = recordings.figure_eights_observed(seed), recordings.figure_eights(seed)
    user = observation.user
    expected = expected_centroids(user, recording)
    errors = np.linalg.norm(user.positions - expected, axis=1)
    raw = np.linalg.norm(user.positions - true_places(user.t, recording), axis=1)
    return {
        "occluded_error_m": errors[user.occluded].mean(),
        "visible_error_m": errors[~user.occluded].mean(),
        "occluded_raw_m": raw[user.occluded].mean(),
        "bias_m": near_side_bias(user, recording),
        "occluded_s": np.diff(user.t, prepend=user.t[0])[user.occluded].sum(),
        "lost_per_lap": min(observation.losses, 5) / 5,
    }


def fastest(seed):
    """How often the user is who walks faster: alone, and while another one strolls between the
    robot and the user.

    As the paper has it, the track with the highest velocity from scan to scan; and as
    `identify_user` does, for which only visible ones can become the user, and only after some time.
    """
    recording, alone = recordings.figure_eights(seed), recordings.figure_eights_observed(seed)
    both = observe(with_stroller(recording, seed).log, recordings.background_map())
    t = recording.log.t
    true = true_places(t, recording)
    expected = true - near_side_bias(alone.user, recording) * lines_of_sight(true, recording)
    walking = np.linalg.norm(np.gradient(true, t, axis=0), axis=1) > BRISK
    numbers = {"changes": float(both.losses)}
    for name, tracks in (("alone", alone.tracks), ("both", both.tracks)):
        for rule, choose in (("", fastest_tracks), ("_ours", identify_user)):
            numbers[f"{name}{rule}"] = named_right(choose(t, tracks), tracks, t, expected)[walking].mean()
    return numbers


BRISK = 0.6
"""Speed in m/s that the user has while walking and the stroller never has."""


def fastest_tracks(t, tracks):
    """Index of the track with the highest estimated velocity at each time (T,), hidden ones
    included.
    """
    speeds = np.zeros((len(t), len(tracks)))
    for k, track in enumerate(tracks):
        speeds[np.searchsorted(t, track.t), k] = track.speeds
    return speeds.argmax(axis=1)


def named_right(users, tracks, t, expected, within=0.5):
    """Whether the track that is taken for the user at each time (T,) is within 0.5 m of `expected`
    (T, 2).
    """
    right = np.zeros(len(t), bool)
    for k, track in enumerate(tracks):
        rows = np.searchsorted(t, track.t)
        near = np.linalg.norm(track.positions - expected[rows], axis=1) < within
        right[rows] |= near & (users[rows] == k)
    return right


def with_stroller(recording, seed):
    """The recording with a second, slower walker, who strolls to and fro between the robot and the
    user.

    Both were seen by the same laser in the same scene, one at a time: a beam ends at the nearer of
    the two.
    """
    from dollop.lab import record

    rng = np.random.default_rng([seed, 14])
    second = record(recording.scene, stroll(recording.scene, rng), rng).log
    first, n = recording.log, len(recording.log.t)
    nearer = second.ranges[:n] < first.ranges - 0.1  # less is noise
    ranges = np.where(nearer, second.ranges[:n], first.ranges)
    log = LaserLog(first.t, ranges, first.angles, first.poses, first.max_range)
    return type(recording)(log, recording.truth, recording.scene)


def stroll(scene, rng, rounds=16, speed=0.5):
    """A walk at half the user's speed, to and fro in a narrow ellipse in front of the robot."""
    angle = np.arange(0, 2 * np.pi * rounds, np.pi / 3)
    points = np.column_stack([4.5 + 1.6 * np.cos(angle), 1.6 + 0.25 * np.sin(angle)])
    return walk(points + rng.normal(0, 0.04, points.shape), scene, rng, speed=speed)
