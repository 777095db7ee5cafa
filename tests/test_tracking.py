"""Sec. II: tracking foreground objects and choosing the user."""

import itertools

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter, rts_smoother
from hypothesis import given
from hypothesis import strategies as st

from dollop.tracking import (
    Motion,
    Track,
    Tracker,
    draw_particles,
    identify_user,
    kalman_filter,
    match_greedily,
    match_jointly,
    move_particles,
    particle_moments,
    predict,
    smooth,
    track_objects,
    update,
    user_track,
)

T = np.arange(0, 10, 0.1)


def straight(start, velocity):
    return np.asarray(start) + T[:, None] * np.asarray(velocity)


def seen(*paths, hide=(), noise=0.0, seed=0):
    """Objects per scan of the given paths (T, 2); `hide` holds (path, first scan, last scan)."""
    rng = np.random.default_rng(seed)
    hidden = {(p, i) for p, first, last in hide for i in range(first, last)}
    return [
        np.array([path[i] for p, path in enumerate(paths) if (p, i) not in hidden]).reshape(-1, 2)
        + noise * rng.standard_normal((sum((p, i) not in hidden for p in range(len(paths))), 2))
        for i in range(len(T))
    ]


def oracle(motion, z, dt):
    """The same filter by filterpy, one axis."""
    n = motion.order
    F, _ = motion.transition(dt)
    kalman = KalmanFilter(n, 1)
    kalman.F, kalman.H = F, np.eye(1, n)
    kalman.Q = Q_continuous_white_noise(n, dt, spectral_density=motion.noise)
    kalman.R = np.array([[motion.measurement_sd**2]])
    kalman.x = np.array([[z[0]]] + [[0.0]] * (n - 1))
    kalman.P = np.diag([motion.measurement_sd**2, 1.0, 1.0][:n])
    return kalman


@pytest.mark.parametrize("order", [2, 3])
def test_kalman_filter_agrees_with_filterpy(order):
    """Prediction, update and process noise are those of an independent implementation."""
    motion, rng = Motion(order=order), np.random.default_rng(1)
    z = rng.standard_normal((30, 2)).cumsum(axis=0)
    reference = oracle(motion, z[:, 0], 0.1)
    means, covariances = motion.birth(z[:1])
    for measured in z[1:]:
        means, covariances = predict(means, covariances, *motion.transition(0.1))
        means, covariances = update(means, covariances, measured[None], motion.measurement_sd)
        reference.predict()
        reference.update(measured[0])
    np.testing.assert_allclose(means[0, :, 0], reference.x[:, 0], rtol=1e-9)
    np.testing.assert_allclose(covariances[0], reference.P, rtol=1e-6, atol=1e-12)


def test_smoother_agrees_with_filterpy():
    """The Rauch-Tung-Striebel pass is that of an independent implementation."""
    motion, rng = Motion(), np.random.default_rng(2)
    z = rng.standard_normal((40, 2)).cumsum(axis=0)
    reference = oracle(motion, z[:, 0], 0.1)
    means, covariances = [reference.x.copy()], [reference.P.copy()]
    for measured in z[1:]:
        reference.predict()
        reference.update(measured[0])
        means.append(reference.x.copy())
        covariances.append(reference.P.copy())
    n = len(z)
    models = [reference.F] * n, [reference.Q] * n
    smoothed = rts_smoother(np.array(means), np.array(covariances), *models)[0]
    positions, velocities = smooth(0.1 * np.arange(n), z, motion)
    np.testing.assert_allclose(positions[:, 0], smoothed[:, 0, 0], atol=1e-8)
    np.testing.assert_allclose(velocities[:, 0], smoothed[:, 1, 0], atol=1e-8)


@pytest.mark.parametrize("order", [2, 3])
def test_smoothing_is_the_posterior_mean_through_gaps_and_an_uneven_clock(order):
    """Filter and backward pass equal solving for all states at once, with scans missing too."""
    rng, n = np.random.default_rng(3), 12
    motion = Motion(order=order, noise=0.3, measurement_sd=0.1)
    t = np.cumsum(rng.choice([0.1, 0.2, 0.35], n))
    z = rng.normal(size=(n, 2)).cumsum(axis=0)
    z[[3, 4, 8]] = np.nan
    rows, values, first = [], [], np.zeros((order, n * order))
    first[:, :order] = np.diag([1 / motion.measurement_sd, 1, 1][:order])
    rows.append(first)
    values.append(first[:, :order] @ np.vstack([z[:1], np.zeros((order - 1, 2))]))
    for i in range(1, n):
        F, Q = motion.transition(t[i] - t[i - 1])
        step = np.zeros((order, n * order))
        step[:, (i - 1) * order : (i + 1) * order] = np.hstack([-F, np.eye(order)])
        rows.append(np.linalg.solve(np.linalg.cholesky(Q), step))
        values.append(np.zeros((order, 2)))
        if np.isfinite(z[i, 0]):
            rows.append(np.eye(1, n * order, i * order) / motion.measurement_sd)
            values.append(z[i : i + 1] / motion.measurement_sd)
    states = np.linalg.lstsq(np.vstack(rows), np.vstack(values), rcond=None)[0].reshape(n, order, 2)
    positions, velocities = smooth(t, z, motion)
    np.testing.assert_allclose(positions, states[:, 0], atol=1e-6)
    np.testing.assert_allclose(velocities, states[:, 1], atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_smoothing_weighs_every_measurement_by_its_own_standard_deviation(seed):
    """The states of least squares, dense and written out, where some places are known better than others."""
    rng, n, motion = np.random.default_rng(seed), 6, Motion(noise=0.3)
    t, z = np.cumsum(rng.uniform(0.1, 0.4, n)), rng.normal(size=(n, 2))
    sd = rng.uniform(0.02, 0.5, n)
    z[3] = np.nan
    rows, values = [np.eye(1, 2 * n, 1)], [np.zeros((1, 2))]  # unknown velocity at first: 0 +- 1 m/s
    for i in range(n):
        if np.isfinite(z[i, 0]):
            rows.append(np.eye(1, 2 * n, 2 * i) / sd[i])
            values.append(z[i : i + 1] / sd[i])
        if i:
            F, Q = motion.transition(t[i] - t[i - 1])
            step = np.hstack([np.zeros((2, 2 * i - 2)), -F, np.eye(2), np.zeros((2, 2 * (n - 1 - i)))])
            rows.append(np.linalg.solve(np.linalg.cholesky(Q), step))
            values.append(np.zeros((2, 2)))
    states = np.linalg.lstsq(np.vstack(rows), np.vstack(values), rcond=None)[0].reshape(n, 2, 2)
    positions, velocities = smooth(t, z, motion, sd)
    np.testing.assert_allclose(positions, states[:, 0], atol=1e-8)
    np.testing.assert_allclose(velocities, states[:, 1], atol=1e-8)


def test_out_of_sight_another_prediction_may_carry_on():
    """What carries on predicts to the hidden scans only, and the filter goes on from there."""
    t, z = np.arange(6.0), np.column_stack([np.arange(6.0), np.zeros(6)])
    z[3:5] = np.nan
    asked = []

    def stand(i, means, covariances, F, Q):
        asked.append(i)
        return means * [[1.0], [0.0]], predict(means, covariances, F, Q)[1]

    filtered, predicted, _ = kalman_filter(t, z, Motion(), stand)
    places = np.array([means[0, 0] for means, _ in filtered])
    assert asked == [3, 4] and (len(filtered), len(predicted)) == (6, 5)
    np.testing.assert_array_equal(places[3:5], places[[2, 2]])
    assert places[2, 0] < places[5, 0] < z[5, 0]


costs = st.integers(0, 5).flatmap(
    lambda k: st.integers(0, 5).flatmap(
        lambda m: st.lists(st.lists(st.floats(0, 10), min_size=m, max_size=m), min_size=k, max_size=k).map(
            lambda rows: np.array(rows).reshape(k, m)
        )
    )
)


@given(costs)
def test_joint_matching_is_the_cheapest_of_all(cost):
    """The Hungarian matching is the best of all permutations, unmatched tracks costing the gate."""
    tracks, objects = match_jointly(cost, 4.0)
    k, m = cost.shape
    padded = np.full((k, m + k), 4.0)
    padded[:, :m] = cost
    chosen = itertools.permutations(range(m + k), k)
    best = min((padded[range(k), columns].sum() for columns in chosen), default=0.0)
    assert cost[tracks, objects].sum() + 4.0 * (k - len(tracks)) == pytest.approx(best)


@given(costs)
def test_greedy_matching_takes_the_nearest_pair_and_stays_one_to_one(cost):
    """Nothing is used twice, the nearest pair is in, none left over is within the gate."""
    tracks, objects = match_greedily(cost, 4.0)
    assert len(set(tracks)) == len(tracks) and len(set(objects)) == len(objects)
    if cost.size and cost.min() <= 4.0:
        assert cost[tracks[0], objects[0]] == cost.min()
    left = np.delete(np.delete(cost, tracks, axis=0), objects, axis=1)
    assert left.size == 0 or left.min() > 4.0


def test_an_occluded_walker_keeps_its_track_and_moves_on_in_a_straight_line():
    """Velocity carries a walker through one second without sight (Sec. II)."""
    path = straight([0, 0], [1.0, 0.5])
    (track,) = track_objects(T, seen(path, hide=[(0, 50, 60)], noise=0.02))
    assert track.occluded[50:60].all() and track.occluded.sum() == 10
    np.testing.assert_allclose(track.positions[50:60], path[50:60], atol=0.25)
    steps = np.diff(track.positions[50:60], axis=0)
    np.testing.assert_allclose(steps, steps[:1].repeat(9, axis=0), atol=1e-9)


def test_the_gate_grows_with_the_occlusion():
    """A walker that turned out of sight is taken back, though beyond the smallest gate."""
    path = straight([0, 0], [1.0, 0.0])
    path[50:] = path[50] + (T[50:, None] - T[50]) * [0.35, 0.8]
    objects = seen(path, hide=[(0, 50, 62)], noise=0.02)
    tracks = track_objects(T, objects)
    assert len(tracks) == 1
    assert np.hypot(*(tracks[0].positions[61] - path[61])) > 0.8
    assert len(track_objects(T, objects, Tracker(gate_max=0.8))) == 2


@pytest.mark.parametrize(
    ("first", "jump", "tracks"),
    [(60, 0.47, 1), (60, 0.53, 2), (20, 1.45, 1), (20, 1.55, 2)],
    ids=["seen all along", "beyond 0.5 m", "four seconds out of sight", "beyond 1.5 m"],
)
def test_the_gate_is_half_a_metre_at_least_and_a_metre_and_a_half_at_most(first, jump, tracks):
    """An object may be 0.5 m off a sure prediction; after four seconds out of sight, 1.5 m."""
    still = straight([2, 2], [0, 0])
    still[60:] += [0.6 * jump, 0.8 * jump]
    assert len(track_objects(T, seen(still, hide=[(0, first, 60)]))) == tracks


def test_an_object_out_of_sight_for_too_long_has_disappeared():
    """After `disappear_after` the same place bears a new track; the old one ends when last seen."""
    still = straight([2, 2], [0, 0])
    objects = seen(still, hide=[(0, 20, 60)])
    assert len(track_objects(T, objects, Tracker(disappear_after=5.0))) == 1
    tracks = track_objects(T, objects, Tracker(disappear_after=3.0))
    assert [track.t[-1] for track in tracks] == pytest.approx([T[19], T[-1]])


def test_one_disappears_while_others_stay():
    """What is out of sight for too long is forgotten also while another object is seen."""
    there, gone = straight([5, 5], [0, 0]), straight([2, 2], [0, 0])
    tracks = track_objects(T, seen(there, gone, hide=[(1, 20, 60)]), Tracker(disappear_after=3.0))
    lives = [(track.t[0], track.t[-1]) for track in tracks]
    assert lives == [(T[0], T[-1]), (T[0], T[19]), (T[60], T[-1])]


@pytest.mark.parametrize("matching", ["greedy", "joint"])
@pytest.mark.parametrize("occlusion", ["kalman", "particles"])
def test_crossing_objects_keep_their_identity(matching, occlusion):
    """A walker that passes in front of a can does not take the can's track along."""
    walker, can = straight([0, 0], [1, 0]), straight([5, 0.5], [0, 0])
    tracks = track_objects(
        T, seen(walker, can, hide=[(0, 70, 75)], noise=0.02), Tracker(matching=matching, occlusion=occlusion)
    )
    assert len(tracks) == 2
    for track, truth in zip(tracks, (walker, can), strict=True):
        assert np.abs(track.positions - truth).max() < 0.35


def test_particles_without_a_laser_are_the_kalman_prediction():
    """Drawn and moved particles have the mean and covariance that the Kalman filter predicts."""
    rng, motion = np.random.default_rng(0), Motion(noise=2.0)
    mean, P = np.array([[1.0, -2.0], [0.5, 0.3]]), np.array([[0.04, 0.03], [0.03, 0.5]])
    F, Q = motion.transition(0.4)
    cloud = draw_particles(mean, P, rng, count=20_000)
    moved = move_particles(cloud, F, Q, rng)
    for particles, truth in ((cloud, (mean, P)), (moved, (F @ mean, F @ P @ F.T + Q))):
        moments = particle_moments(particles)
        np.testing.assert_allclose(moments[0], truth[0], atol=0.03)
        np.testing.assert_allclose(moments[1], truth[1], atol=0.03)
        spread = particles - moments[0]
        across = np.einsum("pi,pj->ij", spread[..., 0], spread[..., 1]) / 20_000
        np.testing.assert_allclose(across, 0, atol=0.03)


def test_particles_do_not_wait_where_the_laser_sees_nobody():
    """A particle where a beam went on is not the occluded object: it stays in the shadow."""
    path = straight([0, 0], [1.0, 0.0])
    objects = seen(path, hide=[(0, 50, 64)], noise=0.02)
    shadow = lambda i, points: points[:, 0] > 5.5  # noqa: E731 beyond x = 5.5 m all is in sight
    (track, *_) = track_objects(T, objects, Tracker(occlusion="particles"), shadow)
    assert track.positions[58:64, 0].max() < 5.6


def test_the_user_is_the_fastest_and_survives_a_loss():
    """The user's trajectory is joined over two tracks, and no static object is chosen (Sec. II)."""
    walker, can = straight([0, 0], [1, 0]), straight([5, 2], [0, 0])
    walker[50:, 1] += 4.0
    tracks = track_objects(T, seen(walker, can, hide=[(0, 45, 50)], noise=0.03))
    assert len(tracks) == 3
    user = user_track(T, tracks, identify_user(T, tracks))
    np.testing.assert_allclose(user.positions[[5, 40, 60, 95]], walker[[5, 40, 60, 95]], atol=0.1)
    assert user.occluded.sum() == 5


EIGHTHS = np.arange(80) / 8  # exact in binary, so that times can be compared


def moved_at(speeds, occluded=False):
    """A track of the given speeds (80,) at EIGHTHS."""
    speeds = np.broadcast_to(speeds, EIGHTHS.shape)
    still = np.zeros((len(EIGHTHS), 2))
    velocities = np.column_stack([speeds, 0 * speeds])
    hidden = np.broadcast_to(occluded, EIGHTHS.shape)
    return Track(EIGHTHS, still, velocities, hidden, still)


@pytest.mark.parametrize(
    ("rival", "taken_over"),
    [
        (np.where(EIGHTHS >= 5, 1.35, 0.0), 5.5),
        (np.where(EIGHTHS >= 5, 1.25, 0.0), np.inf),
        (np.where((EIGHTHS >= 5) & (EIGHTHS < 5.5), 1.35, 0.0), np.inf),
    ],
    ids=["faster", "hardly faster", "soon slower"],
)
def test_another_takes_over_when_it_has_been_clearly_faster_for_a_while(rival, taken_over):
    """First to move for half a second is the user; 0.3 m/s faster for as long takes over."""
    users = identify_user(EIGHTHS, [moved_at(1.0), moved_at(rival)])
    expected = np.where(EIGHTHS >= 1.0, 0, -1)
    expected[np.greater_equal(EIGHTHS, taken_over)] = 1
    np.testing.assert_array_equal(users, expected)


def test_out_of_sight_the_user_stays_the_user():
    """The user stays so while occluded, though a slower one is seen; who is never seen never is."""
    slow = moved_at(1.0)
    assert (identify_user(EIGHTHS, [moved_at(2.0, EIGHTHS >= 4), slow])[EIGHTHS > 2] == 0).all()
    assert (identify_user(EIGHTHS, [moved_at(2.0, EIGHTHS >= 0), slow])[EIGHTHS > 2] == 1).all()


def test_nobody_moves_nobody_is_the_user():
    """Noise on static objects does not make a user of one."""
    cans = straight([1, 1], [0, 0]), straight([3, 3], [0, 0])
    tracks = track_objects(T, seen(*cans, noise=0.03))
    users = identify_user(T, tracks)
    assert (users == -1).all() and user_track(T, tracks, users) is None


def test_no_objects_no_tracks():
    """An empty room has no tracks and no user."""
    assert track_objects(T, [np.zeros((0, 2))] * len(T)) == ()
    assert (identify_user(T, ()) == -1).all()


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        ({"matching": "best"}, r"matching must be one of 'greedy', 'joint', got 'best'"),
        ({"occlusion": "hope"}, "occlusion must be one of 'kalman', 'particles', got 'hope'"),
        ({"gate": 0}, "gate must be .*, got 0"),
        ({"gate_min": -1}, "gate_min must be .*, got -1"),
        ({"gate_max": -0.5}, "gate_max must be .*, got -0.5"),
        ({"disappear_after": np.nan}, "disappear_after must be .*, got nan"),
    ],
)
def test_choices_out_of_range_are_named(choice, says):
    """An error names the parameter, its value and the rule."""
    with pytest.raises(ValueError, match=says):
        Tracker(**choice)


def test_motion_out_of_range_is_named():
    """An error names the parameter, its value and the rule."""
    with pytest.raises(ValueError, match="order.* must be a whole number, 2 to 3"):
        Motion(order=1)
    with pytest.raises(ValueError, match="noise must be in 1e-06 to 1e.06, got -1"):
        Motion(noise=-1)


def test_the_user_of_many_tracks_is_the_fastest_of_each_moment():
    """As a table of all speeds at all times would have it, which would take gigabytes."""
    rng, t = np.random.default_rng(0), np.arange(60) / 10
    tracks = []
    for _ in range(40):
        begin, end = np.sort(rng.choice(60, 2, replace=False))
        part = slice(begin, end + 1)
        n = end + 1 - begin
        still, velocities = np.zeros((n, 2)), rng.normal(0, 1, (n, 2)).cumsum(axis=0) / 4
        tracks.append(Track(t[part], still, velocities, rng.random(n) < 0.2, still))
    for some in (tracks, tracks[:3], []):
        assert np.array_equal(identify_user(t, some), of_all_speeds(t, some))


def of_all_speeds(t, tracks, faster=0.3, patience=0.5, min_age=0.5):
    """The user by the rule of `identify_user`, from all speeds at all times."""
    speed, seen = np.zeros((2, len(t), len(tracks) + 1))
    for k, track in enumerate(tracks):
        rows = np.searchsorted(t, track.t)
        speed[rows, k] = np.where(track.t - track.t[0] < min_age, 0.0, track.speeds)
        seen[rows, k] = np.where(track.occluded, 0.0, speed[rows, k])
    user, since, rival, users = -1, np.inf, -1, []
    for i, best in enumerate(seen.argmax(axis=1)):
        leads = best != user and seen[i, best] > faster + speed[i, user]
        if not leads or best != rival:
            since, rival = (t[i], best) if leads else (np.inf, -1)
        elif t[i] - since >= patience:
            user, since, rival = best, np.inf, -1
        users.append(user)
    return users
