"""Tracking foreground objects through time, and which of them is the user (Sec. II).

The state of a track is its position and velocity (and, selectable, acceleration) in the plane,
moved by white noise on the highest derivative. Both axes share one covariance, so a track of order
n carries n x 2 means and one n x n covariance:

    x <- F x,          P <- F P F^T + Q              (prediction over dt)
    K = P h / (h^T P h + r)                          (Kalman update, h picks the position)
    x <- x + K (z - h^T x),      P <- P - K h^T P
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from dollop.checks import (
    LATEST,
    check_choice,
    checked_array,
    checked_flags,
    checked_generator,
    checked_number,
    checked_record,
    checked_whole,
    put_in,
)

FASTEST = 1e12
"""m/s that an estimate may have: a leap over 1e9 m within a millisecond."""
MOST_NUMBER = 1e6
"""Of noise, standard deviations, gates in m and times in s."""


@dataclass(frozen=True, eq=False)
class Track:
    """The path of one foreground object (Sec. II).

    Attributes
    ----------
    t : (N,) float array
        Time of each scan it lived through, in s.
    positions : (N, 2) float array
        Kalman estimate of its position in m.
    velocities : (N, 2) float array
        Kalman estimate of its velocity in m/s.
    occluded : (N,) bool array
        Where no foreground object was matched and the estimate is a prediction.
    measurements : (N, 2) float array
        The matched centroid in m, `nan` where occluded.

    Raises
    ------
    ValueError
        No scan, arrays that are not of one length, times that fall, or what is not finite.
    """

    t: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    occluded: np.ndarray
    measurements: np.ndarray

    def __post_init__(self):
        t = checked_array("t", self.t, "N", least=-LATEST, most=LATEST)
        if not len(t) or (np.diff(t) < 0).any():
            raise ValueError(f"the times of a track must rise, from one on, got {len(t)} that do not")
        ends = {"least": -FASTEST, "most": FASTEST}
        put_in(
            self,
            t=t,
            positions=checked_array("positions", self.positions, len(t), 2, **ends),
            velocities=checked_array("velocities", self.velocities, len(t), 2, **ends),
            occluded=checked_flags("occluded", self.occluded, len(t)),
            measurements=checked_array("measurements", self.measurements, len(t), 2, finite=False, **ends),
        )

    def __repr__(self):
        seconds, hidden = np.ptp(self.t), self.occluded.mean()
        return f"Track of {len(self)} scans in {seconds:.1f} s, {hidden:.0%} occluded"

    def __len__(self):
        return len(self.t)

    @property
    def speeds(self):
        """(N,) float array: speed in m/s."""
        return np.hypot(self.velocities[:, 0], self.velocities[:, 1])


@dataclass(frozen=True)
class Motion:
    """How a foreground object is assumed to move, and how well its centroid is measured (Sec. II).

    Attributes
    ----------
    order : int
        2: position and velocity (Sec. II, the paper's choice); 3: acceleration as well.
    noise : float
        Spectral density of the white noise on the highest derivative, m^2/s^(2 order - 1).
    measurement_sd : float
        Standard deviation of a centroid per axis in m. It is the body's near side that is measured,
        so this is centimetres, not the laser's millimetres.

    Raises
    ------
    ValueError
        Another order, or a noise or standard deviation that is not positive and finite.
    """

    order: int = 2
    noise: float = 0.5
    measurement_sd: float = 0.06

    def __post_init__(self):
        put_in(self, order=checked_whole("order, velocity or acceleration,", self.order, 2, 3))
        for name in ("noise", "measurement_sd"):
            checked_number(name, getattr(self, name), 1 / MOST_NUMBER, MOST_NUMBER)

    def transition(self, dt):
        """F and Q over a time: integrated white noise (Bar-Shalom et al. 2001, Sec. 6.2).

        Parameters
        ----------
        dt : float
            s.

        Returns
        -------
        F, Q : (n, n) float arrays
            Transition of the state (m, m/s, m/s^2) and the covariance of its noise.

        Raises
        ------
        ValueError
            For what is no time.

        Examples
        --------
        Two steps are one long step:

        >>> (F, Q), (F2, Q2) = Motion().transition(0.1), Motion().transition(0.2)
        >>> np.allclose(F @ F, F2), np.allclose(F @ Q @ F.T + Q, Q2)
        (True, True)
        """
        F, Q = self.transitions(np.array([checked_number("dt", dt, -LATEST, LATEST)]))
        return F[0].copy(), Q[0].copy()  # views would be multiplied more slowly

    def transitions(self, dt):
        """F and Q over several times at once, see `transition`.

        Parameters
        ----------
        dt : (N,) float array
            s.

        Returns
        -------
        F, Q : (N, n, n) float arrays
        """
        n, one, none = self.order, np.ones_like(dt), np.zeros_like(dt)
        F = np.array([[one, dt, dt**2 / 2], [none, one, dt], [none, none, one]])
        position = dt**5 / 20, dt**4 / 8, dt**3 / 6
        velocity = dt**4 / 8, dt**3 / 3, dt**2 / 2
        acceleration = dt**3 / 6, dt**2 / 2, dt
        Q = self.noise * np.array([position, velocity, acceleration])
        return np.moveaxis(F[:n, :n], -1, 0), np.moveaxis(Q[-n:, -n:], -1, 0)

    def birth(self, positions):
        """States of objects at first sight, their velocity unknown (a reconstruction).

        Parameters
        ----------
        positions : (K, 2) float array
            m.

        Returns
        -------
        means : (K, n, 2) float array
            Position in m, the rest zero.
        covariances : (K, n, n) float array
            Diagonal: a metre per second, and per second squared, is the standard deviation of what
            is unknown.
        """
        means = np.zeros((len(positions), self.order, 2))
        means[:, 0] = positions
        variances = [self.measurement_sd**2, 1.0, 1.0][: self.order]
        return means, np.tile(np.diag(variances), (len(positions), 1, 1))


def predict(means, covariances, F, Q):
    """Kalman prediction of K tracks (Sec. II).

    Parameters
    ----------
    means : (K, n, 2) float array
        In m, m/s, m/s^2.
    covariances : (K, n, n) float array
        Shared by both axes.
    F, Q : (n, n) float arrays
        From `Motion.transition`.

    Returns
    -------
    means : (K, n, 2) float array
    covariances : (K, n, n) float array

    Examples
    --------
    What is not measured gets less sure:

    >>> F, Q = Motion().transition(1.0)
    >>> _, covariances = predict(np.zeros((1, 2, 2)), np.eye(2)[None], F, Q)
    >>> bool(covariances[0, 0, 0] > 1)
    True
    """
    return F @ means, F @ covariances @ F.T + Q


def update(means, covariances, measurements, measurement_sd):
    """Kalman update of K tracks with one position each (Sec. II).

    Parameters
    ----------
    means : (K, n, 2) float array
        In m, m/s, m/s^2.
    covariances : (K, n, n) float array
        Shared by both axes.
    measurements : (K, 2) float array
        m.
    measurement_sd : float
        m.

    Returns
    -------
    means : (K, n, 2) float array
    covariances : (K, n, n) float array

    Examples
    --------
    A measurement as good as the prediction takes the estimate half way and halves its variance:

    >>> state = np.zeros((1, 2, 2)), np.eye(2)[None]
    >>> means, covariances = update(*state, np.array([[4.0, 2.0]]), 1.0)
    >>> means[0, 0], float(covariances[0, 0, 0])
    (array([2., 1.]), 0.5)
    """
    gain = covariances[:, :, 0] / (covariances[:, 0, 0] + measurement_sd**2)[:, None]
    innovation = measurements - means[:, 0]
    means = means + gain[:, :, None] * innovation[:, None]
    return means, covariances - gain[:, :, None] * covariances[:, None, 0, :]


def match_greedily(cost, gate):
    """Match tracks to objects, nearest pair first (Sec. II: "a greedy search").

    Parameters
    ----------
    cost : (K, M) float array
        Cost of giving object m to track k.
    gate : float
        Pairs that cost more are not matched.

    Returns
    -------
    tracks, objects : (L,) int arrays
        The matched pairs.

    Examples
    --------
    The nearest pair can leave the others far apart (compare `match_jointly`):

    >>> match_greedily(np.array([[1.0, 2.0], [3.0, 9.0]]), 10)
    (array([0, 1]), array([0, 1]))
    """
    pairs = []
    open_cost = np.where(cost <= gate, cost, np.inf)
    while open_cost.min(initial=np.inf) < np.inf:
        k, m = divmod(int(open_cost.argmin()), cost.shape[1])
        open_cost[k, :] = open_cost[:, m] = np.inf
        pairs.append((k, m))
    return tuple(np.array(pairs, int).reshape(-1, 2).T)


def match_jointly(cost, gate):
    """Match with the least total cost (Sec. II: the "joint optimization procedure").

    As many pairs within the gate as possible would be wrong: leaving a track unmatched costs
    `gate`. Kuhn's Hungarian method (1955) by `scipy.optimize.linear_sum_assignment`.

    Parameters
    ----------
    cost : (K, M) float array
        Cost of giving object m to track k.
    gate : float
        Pairs that cost more are not matched.

    Returns
    -------
    tracks, objects : (L,) int arrays
        The matched pairs.

    Examples
    --------
    >>> match_jointly(np.array([[1.0, 2.0], [3.0, 9.0]]), 10)
    (array([0, 1]), array([1, 0]))
    """
    tracks, objects = scipy.optimize.linear_sum_assignment(np.minimum(cost, gate))
    within = cost[tracks, objects] <= gate
    return tracks[within], objects[within]


MATCHERS = {"greedy": match_greedily, "joint": match_jointly}
"""What a `Tracker.matching` stands for."""


@dataclass(frozen=True)
class Tracker:
    """How objects are tracked: the choices of Sec. II, the paper's as defaults.

    Attributes
    ----------
    motion : Motion
        Position and velocity by default.
    matching : str
        "greedy" (the paper) or "joint" (Hungarian).
    occlusion : str
        How an occluded object moves on: "kalman" (the paper: in a straight line) or "particles".
    gate : float
        Largest distance between prediction and object in standard deviations of their difference;
        it therefore grows while an object is occluded.
    gate_min, gate_max : float
        The gate is never narrower or wider than this, in m: a walker may turn while out of sight,
        but nobody comes back at the other end of the room.
    disappear_after : float
        Occluded for longer than this, in s, is disappeared (Sec. II: 5 seconds).

    Raises
    ------
    ValueError
        A choice that is not known, or a number that is not positive.
    """

    motion: Motion = Motion()
    matching: str = "greedy"
    occlusion: str = "kalman"
    gate: float = 3.0
    gate_min: float = 0.5
    gate_max: float = 1.5
    disappear_after: float = 5.0

    def __post_init__(self):
        checked_record("motion", self.motion, Motion)
        check_choice("matching", self.matching, MATCHERS)
        check_choice("occlusion", self.occlusion, ("kalman", "particles"))
        for name in ("gate", "gate_min"):
            checked_number(name, getattr(self, name), 1 / MOST_NUMBER, MOST_NUMBER)
        for name in ("gate_max", "disappear_after"):  # infinity is no limit
            checked_number(name, getattr(self, name), 1 / MOST_NUMBER, np.inf)


def track_objects(t, objects, tracker=None, visible=None, seed=0):
    """Follow foreground objects from scan to scan (Sec. II).

    Parameters
    ----------
    t : (T,) float array
        Time of each scan in s, increasing.
    objects : sequence of T (M_i, 2) float arrays
        Centroids of the foreground objects in each scan, in m.
    tracker : Tracker, optional
        The choices of Sec. II.
    visible : callable, optional
        visible(i, points (M, 2)) -> (M,) bool: could the laser have seen an object there in scan i?
        Used by particles.
    seed : int or Generator
        For the particles.

    Returns
    -------
    tuple of Track
        In the order of their birth, each from its first sight until its last.

    Examples
    --------
    Out of sight for longer than 5 s, an object is a new one:

    >>> t, can, nothing = np.arange(10.0), np.array([[1.0, 2.0]]), np.zeros((0, 2))
    >>> len(track_objects(t, [can] * 3 + [nothing] * 4 + [can] * 3))
    1
    >>> len(track_objects(t, [can] * 2 + [nothing] * 6 + [can] * 2))
    2
    """
    tracker = tracker or Tracker()
    state = _Tracks(tracker, checked_generator("seed", seed))
    intervals = np.diff(t, prepend=t[0])
    models = {dt: tracker.motion.transition(dt) for dt in np.unique(intervals)}
    for i, dt in enumerate(intervals):
        state.predict(*models[dt], visible and partial(visible, i))
        state.match(objects[i], t[i])
    return state.tracks()


class _Tracks:
    """The tracks alive now, as arrays over K tracks, and the diary of all that have lived."""

    COLUMNS = "means", "covariances", "measured", "seen", "name"

    def __init__(self, tracker, rng):
        self.tracker, self.rng = tracker, rng
        self.means, self.covariances = tracker.motion.birth(np.zeros((0, 2)))
        self.measured, self.seen, self.name = np.zeros((0, 2)), np.zeros(0), np.zeros(0, int)
        self.born, self.particles, self.diary = 0, {}, []

    def predict(self, F, Q, visible):
        """Kalman prediction; occluded tracks by particles where that was chosen."""
        before = self.means, self.covariances
        self.means, self.covariances = predict(*before, F, Q)
        if self.tracker.occlusion == "particles":
            for k in np.flatnonzero(np.isnan(self.measured[:, 0])):
                cloud = self.particles.get(self.name[k])
                if cloud is None:
                    cloud = draw_particles(before[0][k], before[1][k], self.rng)
                cloud = move_particles(cloud, F, Q, self.rng, visible)
                self.means[k], self.covariances[k] = particle_moments(cloud)
                self.particles[self.name[k]] = cloud

    def match(self, objects, now):
        """Match predictions to `objects` (M, 2), update, and let the unmatched go or be born."""
        tracker, noise = self.tracker, self.tracker.motion.measurement_sd
        offset = self.means[:, None, 0] - objects[None]
        sd = np.sqrt(self.covariances[:, 0, 0] + noise**2)
        scale = np.clip(sd, tracker.gate_min / tracker.gate, tracker.gate_max / tracker.gate)
        cost = np.hypot(offset[..., 0], offset[..., 1]) / scale[:, None]
        matched, found = MATCHERS[tracker.matching](cost, tracker.gate)
        self.measured = np.full((len(self.means), 2), np.nan)
        self.measured[matched] = objects[found]
        predicted = self.means[matched], self.covariances[matched]
        corrected = update(*predicted, objects[found], noise)
        self.means[matched], self.covariances[matched] = corrected
        self.seen[matched] = now
        for name in self.name[matched]:
            self.particles.pop(name, None)
        alive = now - self.seen <= tracker.disappear_after
        if not alive.all() or len(found) < len(objects):
            self._renew(alive, np.delete(objects, found, axis=0), now)
        times = np.full(len(self.name), now)
        self.diary.append((self.name, times, self.means[:, :2], self.measured))

    def _renew(self, alive, objects, now):
        """Let go of the tracks that are not alive, and let one be born for each object (M, 2)."""
        names = self.born + np.arange(len(objects))
        newborn = *self.tracker.motion.birth(objects), objects, np.full(len(objects), now), names
        for column, values in zip(self.COLUMNS, newborn, strict=True):
            setattr(self, column, np.concatenate([getattr(self, column)[alive], values]))
        self.born += len(objects)

    def tracks(self):
        """Every track that lived, cut after it was last seen."""
        name, t, means, measured = map(np.concatenate, zip(*self.diary, strict=True))
        order = np.argsort(name, kind="stable")
        starts = np.searchsorted(name[order], np.arange(self.born))
        seen = np.isfinite(measured[:, 0])
        tracks = []
        for rows in np.split(order, starts)[1:]:
            rows = rows[: np.flatnonzero(seen[rows])[-1] + 1]
            state = means[rows, 0], means[rows, 1]
            tracks.append(Track(t[rows], *state, ~seen[rows], measured[rows]))
        return tuple(tracks)


def draw_particles(mean, covariance, rng, count=200):
    """Particles of one occluded track, from its normal distribution (a reconstruction).

    Parameters
    ----------
    mean : (n, 2) float array
        In m, m/s, m/s^2.
    covariance : (n, n) float array
        Shared by both axes.
    rng : Generator
    count : int
        P.

    Returns
    -------
    (P, n, 2) float array
    """
    return mean + np.linalg.cholesky(covariance) @ rng.standard_normal((count, *mean.shape))


def move_particles(particles, F, Q, rng, visible=None):
    """Move particles by the motion model; those that the laser would see die (a reconstruction).

    Those that have died are drawn anew from the others, unless all would have been seen.

    Parameters
    ----------
    particles : (P, n, 2) float array
        In m, m/s, m/s^2.
    F, Q : (n, n) float arrays
        From `Motion.transition`.
    rng : Generator
    visible : callable, optional
        visible(points (P, 2)) -> (P,) bool: would the laser have seen an object there?

    Returns
    -------
    (P, n, 2) float array
    """
    moved = F @ particles + np.linalg.cholesky(Q) @ rng.standard_normal(particles.shape)
    if visible is not None:
        hidden = np.flatnonzero(~visible(moved[:, 0]))
        if len(hidden):
            moved = moved[rng.choice(hidden, len(moved))]
    return moved


def particle_moments(particles):
    """Mean of particles, and the covariance that both axes share (a reconstruction).

    Parameters
    ----------
    particles : (P, n, 2) float array
        In m, m/s, m/s^2.

    Returns
    -------
    mean : (n, 2) float array
    covariance : (n, n) float array
        A little more than measured, so that it is never singular.

    Examples
    --------
    Those of many particles are those that they were drawn from:

    >>> mean, covariance = np.zeros((2, 2)), np.array([[2.0, 1.0], [1.0, 3.0]])
    >>> cloud = draw_particles(mean, covariance, np.random.default_rng(0), 100_000)
    >>> np.allclose(particle_moments(cloud)[1], covariance, atol=0.05)
    True
    """
    mean = particles.mean(axis=0)
    spread = particles - mean
    covariance = np.einsum("pia,pja->ij", spread, spread) / (2 * len(particles))
    return mean, covariance + 1e-9 * np.eye(len(mean))


def smooth(t, measurements, motion=None, sd=None):
    r"""Positions and velocities given all measurements, those before and after (Sec. II).

    What a Kalman filter and a smoother after it give (Rauch, Tung and Striebel 1965), in one step:
    the states x_n that minimise

        sum |z_n - h^T x_n|^2 / r_n + sum (x_{n+1} - F x_n)^T Q^-1 (x_{n+1} - F x_n) + prior

    solve a linear system whose matrix is a narrow band.

    Parameters
    ----------
    t : (N,) float array
        s, increasing.
    measurements : (N, 2) float array
        Centroids in m, `nan` where the object was occluded; the first must be finite.
    motion : Motion, optional
        The motion model.
    sd : (N,) float array, optional
        Standard deviation of each measurement in m; that of the motion model when not given.

    Returns
    -------
    positions, velocities : (N, 2) float arrays
        m and m/s.

    Examples
    --------
    Through a gap goes a smooth curve; a filter would go straight on, by the last velocity:

    >>> t = np.arange(0.0, 3.0, 0.1)
    >>> circle = np.column_stack([np.cos(t), np.sin(t)])
    >>> seen = np.where((np.abs(t - 1.5) < 0.5)[:, None], np.nan, circle)
    >>> bool(np.abs(smooth(t, seen)[0] - circle).max() < 0.05)
    True
    """
    motion = motion or Motion()
    n, count = motion.order, len(t)
    seen = np.isfinite(measurements[:, 0])
    variance = np.full(count, motion.measurement_sd**2) if sd is None else np.square(sd)
    weights = np.where(seen, 1 / variance, 0.0)
    blocks = np.zeros((count, n, n))
    blocks[:, 0, 0] = weights
    blocks[0] += np.diag([0.0, 1.0, 1.0][:n])  # what is unknown at first sight, as in `Motion.birth`
    F, Q = motion.transitions(np.diff(t))
    information = np.linalg.inv(Q)
    ahead = -np.transpose(F, (0, 2, 1)) @ information
    blocks[:-1] -= ahead @ F
    blocks[1:] += information
    band = np.zeros((2 * n, count * n))  # band[d, m] is row m + d, column m of the matrix
    for i in range(n):
        for j in range(n):
            if i >= j:
                band[i - j, j::n] = blocks[:, i, j]
            band[n + j - i, i : (count - 1) * n : n] = ahead[:, i, j]
    known = np.zeros((count * n, 2))
    known[::n] = weights[:, None] * np.where(seen[:, None], measurements, 0.0)
    states = scipy.linalg.solveh_banded(band, known, lower=True).reshape(count, n, 2)
    return states[:, 0], states[:, 1]


def kalman_filter(t, measurements, motion, carry_on=None):
    """The Kalman filter of one object, from the measurements so far only (Sec. II).

    Parameters
    ----------
    t : (N,) float array
        s, increasing.
    measurements : (N, 2) float array
        Centroids in m, `nan` where the object was occluded; the first must be finite.
    motion : Motion
        The motion model.
    carry_on : callable, optional
        carry_on(i, means, covariances, F, Q) predicts to scan i where the object was occluded; by
        default as the motion model does.

    Returns
    -------
    filtered, predicted : lists of N and N - 1 (means (1, n, 2), covariances (1, n, n))
        After each scan, and before all but the first.
    transitions : list of N - 1 (n, n) float arrays
        F between each scan and the next.

    Examples
    --------
    What comes later changes nothing (it does in `smooth`):

    >>> t, z = np.arange(5.0), np.random.default_rng(0).normal(size=(5, 2))
    >>> whole, part = (kalman_filter(t[:n], z[:n], Motion())[0] for n in (5, 3))
    >>> np.array_equal(whole[2][0], part[2][0])
    True
    """
    state = motion.birth(measurements[:1])
    models = {dt: motion.transition(dt) for dt in np.unique(np.diff(t))}
    filtered, predicted, transitions = [state], [], []
    for i, (dt, z) in enumerate(zip(np.diff(t), measurements[1:], strict=True), start=1):
        F, Q = models[dt]
        seen = np.isfinite(z[0])
        state = predict(*state, F, Q) if seen or not carry_on else carry_on(i, *state, F, Q)
        predicted.append(state)
        transitions.append(F)
        if seen:
            state = update(*state, z[None], motion.measurement_sd)
        filtered.append(state)
    return filtered, predicted, transitions


def identify_user(t, tracks, faster=0.3, patience=0.5, min_age=0.5):
    """Which track is the user at each moment: the fastest foreground object (Sec. II).

    With a hysteresis, a reconstruction: occluded objects keep their velocity, so only visible ones
    can become the user; who is the user already stays as fast while out of sight. Another one takes
    over only after it has been faster by `faster` m/s for `patience` s, or the choice would
    flicker.

    Parameters
    ----------
    t : (T,) float array
        Time of each scan in s.
    tracks : sequence of K Track
        Every track.
    faster : float
        m/s.
    patience : float
        s.
    min_age : float
        A track's velocity means nothing before it has lived this long, in s.

    Returns
    -------
    (T,) int array
        Index into `tracks`, -1 while nobody has moved yet.

    Examples
    --------
    Nobody's velocity counts in the first half second; then the fastest must lead for half a second:

    >>> t, still = np.arange(6) / 4, np.zeros((6, 2))
    >>> slow, fast = (Track(t, still, still + v, np.zeros(6, bool), still) for v in (0.2, 1.0))
    >>> identify_user(t, [slow, fast])
    array([-1, -1, -1, -1,  1,  1])
    """
    fastest, first, speeds = np.zeros(len(t)), np.zeros(len(t), int), []
    for k, track in enumerate(tracks):
        rows = np.searchsorted(t, track.t)
        speed = np.where(track.t - track.t[0] < min_age, 0.0, track.speeds)
        seen = np.where(track.occluded, 0.0, speed)
        ahead = seen > fastest[rows]
        fastest[rows[ahead]], first[rows[ahead]] = seen[ahead], k
        speeds.append(dict(zip(rows.tolist(), speed.tolist(), strict=True)))
    user, since, rival = -1, np.inf, -1
    users = np.empty(len(t), int)
    for i, best in enumerate(first):
        now = speeds[user].get(i, 0.0) if user >= 0 else 0.0
        leads = best != user and fastest[i] > faster + now
        if not leads or best != rival:
            since, rival = (t[i], best) if leads else (np.inf, -1)
        elif t[i] - since >= patience:
            user, since, rival = best, np.inf, -1
        users[i] = user
    return users


def user_track(t, tracks, users, motion=None):
    """The user's whole trajectory: the tracks that were the user, joined and smoothed (Sec. II).

    Each takes over right after the one before it was last seen, so what a new track saw before it
    was recognised as the user counts too.

    Parameters
    ----------
    t : (T,) float array
        Time of each scan in s.
    tracks : sequence of Track
        Every track.
    users : (T,) int array
        From `identify_user`.
    motion : Motion, optional
        For the smoother.

    Returns
    -------
    Track or None
        None if nobody moved.
    """
    changes = np.flatnonzero(np.diff(users, prepend=-1))
    measurements = np.full((len(t), 2), np.nan)
    for start, k in zip(changes, users[changes], strict=True):
        seen = np.flatnonzero(np.isfinite(measurements[:start, 0]))
        join = seen[-1] + 1 if len(seen) else 0
        rows = np.searchsorted(t, tracks[k].t)
        measurements[join:] = np.nan
        measurements[rows[rows >= join]] = tracks[k].measurements[rows >= join]
    seen = np.flatnonzero(np.isfinite(measurements[:, 0]))
    if not len(seen):
        return None
    lived = slice(seen[0], seen[-1] + 1)
    t, measurements = t[lived], measurements[lived]
    return Track(t, *smooth(t, measurements, motion), np.isnan(measurements[:, 0]), measurements)
