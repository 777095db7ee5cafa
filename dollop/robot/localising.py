"""Localising a whole log: the laser's poses on a map, where the log was recorded by odometry.

The paper leaves this to CARMEN; what is here is a reconstruction. The particles of
`dollop.robot.localization` follow the log scan by scan. What they find is refined by all scans together:
the poses p that maximise, with that module's likelihood field and its motion model,

    share sum_i sum_b log(floor + (1 - floor) q(d_ib)) - sum_i |e_i / s_i|^2 / 2,

where d_ib is the distance from the end of beam b of scan i to the nearest thing on the map, and e_i what
differs between the step from p_i to p_i+1 and the odometry's. It is solved by Gauss and Newton's method:
a beam that fits is a spring to the surface that it hit, a step ties a scan to the next, and the normal
equations are a band. Cf. F. Lu and E. Milios, "Globally consistent range scan alignment for environment
mapping" (Autonomous Robots 4, 1997).

Where nothing tells the beginning, every pose of a lattice is weighed by one scan, and the best are
followed through the scans after it: the one that explains them all is the place.
"""

from dataclasses import replace

import numpy as np
import scipy

from dollop.checks import Note, checked_array, checked_positions, checked_record, told
from dollop.formats.carmen_map import OCCUPIED_FROM
from dollop.gridmap import OccupancyGrid, in_cells
from dollop.laser import LaserLog
from dollop.pose import between, composed, motion_between, poses_at, rotation, wrapped
from dollop.robot.localization import (
    PIONEER_LOCALISATION,
    Localisation,
    MonteCarloLocalizer,
    surface_cells,
)

__all__ = ["localise"]

ROUNDS = 10
"""Steps of Gauss and Newton."""
KEYS, KEY_WAY = 20, 0.5
"""Through how many scans a place is tried, and how far they are apart at least, in m or rad."""
CANDIDATES, BEST = 80, 3000
"""Places that are tried, each the best of its surroundings, and of how many poses of the lattice."""
APART = 0.5, 0.35
"""m and rad: nearer than this, two places are one."""
FREEDOM = 0.10
"""m and rad: standard deviation of a place that is tried."""
TOLD = 0.10
"""How much worse than the best, in mean q of the close field, a place may explain the scans that is told, or
followed so far."""
HOPELESS = 0.20
"""How much worse than one that fits, or than the best, a place may be to be tried further, in mean q."""
TRIES = 12
"""At how many places of a log the search begins anew, at most."""
LEAST_ERROR = 0.0005
"""m and rad: of a step by odometry, however short."""
BRIDGED = 0.15
"""m and rad: by how much the odometry may miss the next scan that is located, for those before it to be."""
KERNEL = np.array([[-1.0], [0.0], [1.0]]) * np.ones((1, 3))
"""Of a cell and those round it: which lie ahead and which behind."""
BORDER = 1.0
"""m round the map where beams may end."""
TILE, HALO = 1024, 10
"""Cells along a side of the parts of a large map that are made ready when a beam ends there, and how
many standard deviations of the widest field round each count, so that nothing farther pulls."""


def localise(log, odometry, background, laser=(0.0, 0.0, 0.0), seed=0, rules=PIONEER_LOCALISATION):
    """The log with the laser's poses on a map, found by Monte Carlo localisation.

    The first pose by odometry is where the robot starts, if the first scans fit the map there; else it
    is searched for on the whole map, and so it is where the robot gets lost.

    Parameters
    ----------
    log : LaserLog
        Its scans; its poses too, if `odometry` is None.
    odometry : Odometry or None
        What the wheels reported meanwhile (`dollop.formats.read_odometry`), in a frame of its own. With
        None the poses of the log are taken for it: those of the laser, drifting.
    background : OccupancyGrid
        The map. People and objects that are not on it do no harm, as long as most beams end on it.
    laser : (3,) sequence of float
        Pose of the laser on the robot whose odometry it is: m, m and rad.
    seed : int or numpy.random.Generator
        Of the particles.
    rules : Localisation
        What the laser and the odometry are like, and what is believed.

    Returns
    -------
    LaserLog
        The same scans, with poses in the frame of the map. Its notes of kind "poses" are new: with
        doubt, if some scans could not be localised, if another place explains them as well, or if the
        scans do not hold the laser along some direction, as in a corridor.

    Raises
    ------
    ValueError
        If no place on the map explains the scans, the odometry is of another time than the log, the
        map has no free cell, or what is given is not of its kind.

    Examples
    --------
    >>> from dollop.gridmap import OccupancyGrid
    >>> from dollop.laser import LaserLog
    >>> angles = np.linspace(-3, 3, 60)
    >>> walls = np.minimum(2 / np.abs(np.cos(angles)), np.where(angles > 0, 1.5, 1) / np.abs(np.sin(angles)))
    >>> log = LaserLog([0.0, 0.1], [walls, walls], angles, np.zeros((2, 3)), max_range=8.0)
    >>> drifting = replace(log, poses=log.poses + [0.1, -0.05, 0.05])
    >>> bool(np.abs(localise(drifting, None, OccupancyGrid.from_log(log)).poses).max() < 0.05)
    True
    """
    checked_record("log", log, LaserLog)
    checked_record("background", background, OccupancyGrid)
    checked_record("rules", rules, Localisation)
    by_odometry = _laser_odometry(log, odometry, laser)
    scans = _Scans(log, background, rules)
    follower = MonteCarloLocalizer(background, _thinned(log, rules)[1], seed=seed, rules=rules)
    search = _Search(scans, by_odometry, follower)
    course = _followed(log, search, by_odometry, follower)
    if not course.located.any():
        rule = f"a scan fits if its beams do by {rules.fits:.2f} in the mean"
        raise ValueError(f"the robot is nowhere on the map, of {len(log)} scans none could be localised: {rule}")
    poses, located = course.bridged()
    poses = scans.smoothed(poses, by_odometry, located)
    notes = [note for note in log.notes if note.kind != "poses"]
    loose = np.median(scans.looseness(poses)[course.located])
    return replace(log, poses=poses, notes=(*notes, *_doubts(located, course.margin, loose, rules)))


def _laser_odometry(log, odometry, laser):
    """(T, 3) poses of the laser at the scans, by odometry."""
    mount = checked_positions("laser", laser, 3)
    if odometry is None:
        return log.poses
    t, poses = (getattr(odometry, name, ()) for name in ("t", "poses"))
    if not np.size(t):
        raise ValueError(f"odometry must be an Odometry with a message, or None, got {told(odometry)}")
    t = checked_array("the times of the odometry", t, "N")
    poses = checked_positions("the poses of the odometry", poses, len(t), 3)
    if not ((log.t >= t[0] - 1) & (log.t <= t[-1] + 1)).any():
        times = f"{t[0]:.10g} to {t[-1]:.10g} s for scans from {log.t[0]:.10g} to {log.t[-1]:.10g} s"
        raise ValueError(f"odometry must be of the time of the log, got {times}")
    return composed(poses_at(log.t, t, poses), mount)


def _doubts(located, margin, loose, rules):
    """Notes on scans that are not located (T,), on a place hardly better than another, and on a loose hold in m."""
    if not located.all():
        text = f"{1 - located.mean():.1%} of the scans could not be localised: the map does not explain them"
        yield Note("poses", text)
    if margin < rules.rival:
        text = f"the map looks alike from another place: it explains the scans worse by {max(margin, 0):.2f} only"
        yield Note("poses", f"{text}, of a fit between 0 and 1")
    if loose > rules.loose:
        text = f"a scan holds the laser to {loose:.2g} m only along one direction, as in a corridor"
        yield Note("poses", f"{text}: along it the poses are the odometry's")


# ---- following


class _Course:
    """Where the particles have the laser, as far as they have followed it.

    `poses` (T, 3) and `located` (T,), in order of the scans; `margin` is how much better than any other the
    places were that it began at, the least.
    """

    def __init__(self, log, by_odometry, follower):
        self._ranges, self._by_odometry, self._follower = (
            _thinned(log, follower.rules)[0],
            by_odometry,
            follower,
        )
        self._last = None  # the last scan that a place was found for
        self.poses, self.located, self.margin = by_odometry.copy(), np.zeros(len(log), bool), np.inf

    def follow(self, scans, start):
        """Follow scans from a pose, until one is located already or the robot is lost; that scan or None."""
        follower, before = self._follower, scans[0]
        follower.start(start)
        for count, i in enumerate(scans):
            if count and self.located[i]:
                return i
            follower.update(motion_between(self._by_odometry[before], self._by_odometry[i]), self._ranges[i])
            if not follower.converged:
                self.located[scans[max(0, count - follower.rules.doubts + 1) : count]] = False
                return i
            self.poses[i], self.located[i], before = follower.pose, True, i
        return None

    def follow_both_ways(self, scan, start, margin):
        """Follow the scans from one on, and those before it; where the robot is lost ahead, or None."""
        before, self.poses[scan], self._last = self.located.sum(), start, scan
        end = self.follow(range(scan, len(self.located)), start)
        if scan:
            self.follow(range(scan, -1, -1), start)
        if self.located.sum() > before:
            self.margin = min(self.margin, margin)
        return end

    @property
    def begun(self):
        """Bool: whether the robot was anywhere yet."""
        return self._last is not None

    def guess(self, scan):
        """Where the odometry has the laser at a scan, from the last one before it that is located; or None."""
        if self._last is None:
            return None
        known = np.append(self._last, np.flatnonzero(self.located[:scan])).max()
        return self._by_odometry_from(known, scan)

    def bridged(self):
        """Poses (T, 3) and which are located (T,), by odometry from the last scan that is, or the first.

        Where that leads to the next one that is located, those between are, though many of their beams end
        on what the map does not have.
        """
        places = np.arange(len(self.located))
        known = np.maximum.accumulate(np.where(self.located, places, -1))
        known = np.where(known < 0, np.argmax(self.located), known)
        poses, located = self._by_odometry_from(known, places), self.located.copy()
        for end in np.flatnonzero(np.diff(self.located, prepend=True) & self.located):
            begin = known[end - 1]
            missed = np.abs(between(self._by_odometry_from(begin, end), self.poses[end]))
            located[begin:end] |= (missed < BRIDGED).all() and begin < end
        return poses, located

    def _by_odometry_from(self, known, scan):
        step = between(self._by_odometry[known], self._by_odometry[scan])
        return composed(self.poses[known], step)


def _thinned(log, rules):
    """Ranges (T, M) and bearings (M,) of a log, of which the particles use one beam in `beam_step`."""
    thin = max(1, round(len(log.angles) / (rules.beams * rules.beam_step)))
    return log.ranges[:, ::thin], log.angles[::thin]


def _followed(log, search, by_odometry, follower):
    """The course of the particles, which begin anew where they are lost."""
    course = _Course(log, by_odometry, follower)
    begin, guess, stride = 0, by_odometry[0], max(1, len(log) // TRIES)
    while begin < len(log):
        (start, margin), end = search.place(begin, guess, course.begun), begin
        if start is not None:
            end = course.follow_both_ways(begin, start, margin)
        begin = len(log) if end is None else max(end, begin + stride)
        guess = course.guess(begin) if begin < len(log) else None
    return course


# ---- searching


class _Search:
    """Places on the map that explain a scan and those after it."""

    def __init__(self, scans, by_odometry, follower):
        self._scans, self._by_odometry, self._follower = scans, by_odometry, follower
        self._rules = follower.rules

    def place(self, scan, guess=None, followed=False):
        """Pose (3,) at a scan: near the guess if it explains the scans, else the best; None if none does.

        And how much better it is than any other, in mean q; `inf` if it was guessed. A robot that was followed
        so far is believed to be carried elsewhere only if the scans fit there as usual, and nowhere else.
        """
        keys, rules = self._keys(scan), self._rules
        told = self._tried(np.reshape([] if guess is None else guess, (-1, 3)), keys)
        if guess is not None and told[1][0] >= rules.usual_fit:
            return told[0][0], np.inf
        poses, fits, close = map(np.concatenate, zip(told, self._tried(self._drawn(scan), keys), strict=True))
        best = close.argmax()
        if guess is not None and fits[0] >= rules.fits - HOPELESS and close[0] >= close[best] - TOLD:
            return poses[0], np.inf
        margin = close[best] - close[_differ(poses, poses[best])].max(initial=0.0)
        sure = fits[best] >= rules.usual_fit and margin >= rules.rival
        if fits[best] < rules.fits or (followed and not sure):
            return None, np.inf
        return poses[best], margin

    def _keys(self, scan):
        """Indices of scans from one on, with some way or turn between them."""
        moved = np.abs(between(self._by_odometry[scan:-1], self._by_odometry[scan + 1 :]))
        gone = np.append(0.0, np.cumsum(np.hypot(*moved[:, :2].T) + moved[:, 2]))
        wanted = KEY_WAY * np.arange(min(KEYS, 1 + int(gone[-1] / KEY_WAY)))
        return scan + np.searchsorted(gone, wanted)

    def _drawn(self, scan):
        """Poses (N, 3) of the lattice that explain a scan best, one of each surroundings."""
        ends = self._scans.ends[scan][self._scans.back[scan]]
        chosen, scores = self._follower.lattice_scores(ends[::2])
        best = np.argpartition(-scores, min(BEST, len(scores)) - 1)[:BEST]
        best = best[np.lexsort([best, -scores[best]])]
        poses, candidates = self._follower.lattice_poses(chosen[best]), []
        while len(poses) and len(candidates) < CANDIDATES:
            candidates.append(poses[0])
            poses = poses[_differ(poses, poses[0])]
        return np.array(candidates)

    def _tried(self, poses, keys):
        """Poses (N, 3) at the first of some scans that were tried, refined, and how well and closely they fit all."""
        poses = self._scans.refined(poses, keys[0])
        first, fits, alive = poses, self._fits(poses, keys[0]), np.arange(len(poses))
        for tried, (before, key) in enumerate(zip(keys[:-1], keys[1:], strict=True), 1):
            hopeless = tried * np.array([self._rules.fits - HOPELESS, fits[1].max(initial=0.0) / tried - HOPELESS])
            alive = alive[(fits[:, alive] > hopeless[:, None]).all(axis=0)]
            told = composed(poses[alive], between(self._by_odometry[before], self._by_odometry[key]))
            poses = poses.copy()
            poses[alive] = self._scans.refined(told, key)
            kept = (np.abs(between(told, poses[alive])) < self._rules.carried).all(axis=1)
            fits[:, alive] += np.where(kept, self._fits(poses[alive], key), 0.0)
        return first, *fits / len(keys)

    def _fits(self, poses, scan):
        """Mean q of a scan's beams at poses (N, 3), as it is and for a narrow field, (2, N)."""
        sigmas = self._rules.sigma, self._rules.close_sigma
        return np.array([self._scans.fits(poses, scan, sigma) for sigma in sigmas])


def _differ(poses, pose):
    """Which poses (N, 3) are of another place than one."""
    apart = np.abs(between(pose, poses))
    return (np.hypot(*apart[:, :2].T) > APART[0]) | (apart[:, 2] > APART[1])


# ---- refining


class _Scans:
    """Beam ends of a log, and the map as springs: `ends` (T, M, 2) in m, `back` (T, M) which there are."""

    def __init__(self, log, background, rules):
        self._rules = rules
        thin = max(1, round(len(log.angles) / rules.beams))
        ranges, angles = log.ranges[:, ::thin], log.angles[::thin]
        self.back = np.isfinite(ranges)
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        self.ends = np.where(self.back, ranges, 0.0)[..., None] * directions
        self._springs = _Springs(background, rules)

    def fits(self, poses, scan, sigma):
        """Mean q (N,) of a scan's beams at poses (N, 3)."""
        back = self.back[scan]
        half, *_ = self._springs.at(_placed(poses, self.ends[scan][back])[0])
        return np.exp(-half / sigma**2).mean(axis=1) if back.any() else np.zeros(len(poses))

    def refined(self, poses, scan):
        """Poses (N, 3), each moved to where it explains one scan best, not far from where it was told."""
        told, back = poses, self.back[scan][None]
        for sigma in np.repeat([self._rules.wide_sigma, self._rules.sigma], ROUNDS // 2):
            gradient, matrix = self._pulls(poses, self.ends[scan], back, sigma)
            gradient[:, 2] += wrapped(poses - told)[:, 2] / FREEDOM**2
            gradient[:, :2] += (poses - told)[:, :2] / FREEDOM**2
            matrix += np.eye(3) / FREEDOM**2
            poses = self._moved(poses, -np.linalg.solve(matrix, gradient[..., None])[..., 0])
        return poses

    def smoothed(self, poses, by_odometry, located):
        """Poses (T, 3) that explain all scans that are located and the steps between them best."""
        steps = between(by_odometry[:-1], by_odometry[1:])
        spans = _step_errors(steps, self._rules)
        spans[(np.abs(between(poses[:-1], poses[1:]) - steps) > self._rules.carried).any(axis=1)] = np.inf
        back = self.back & located[:, None]
        for sigma in np.repeat([self._rules.sigma, self._rules.close_sigma], ROUNDS):
            gradient, matrix = self._pulls(poses, self.ends, back, sigma)
            poses = self._moved(poses, _banded_step(poses, gradient, matrix, steps, 1 / spans**2))
        return poses

    def looseness(self, poses):
        """Standard deviation (T,) in m to which each scan alone holds its pose (T, 3) along the weakest direction."""
        _, matrix = self._pulls(poses, self.ends, self.back, self._rules.sigma)
        turn = matrix[:, :2, 2:]
        places = matrix[:, :2, :2] - turn @ np.swapaxes(turn, 1, 2) / (matrix[:, 2:, 2:] + 1e-9)
        return 1 / np.sqrt(np.linalg.eigvalsh(places)[:, 0].clip(1e-9))

    def _pulls(self, poses, ends, back, sigma):
        """Gradient (N, 3) and matrix (N, 3, 3) of the springs at beam ends (N, M, 2) in the poses' frames."""
        points, arms = _placed(poses, ends)
        half, pull, normals = self._springs.at(points)
        q = np.exp(-half / sigma**2)
        share, floor = self._rules.independent, self._rules.floor
        weights = share / sigma**2 * back * (1 - floor) * q / (floor + (1 - floor) * q)
        turns = np.stack([-arms[..., 1], arms[..., 0]], axis=-1)
        leaned = _times(normals, turns)
        gradient = np.concatenate([pull, (pull * turns).sum(axis=-1, keepdims=True)], axis=-1)
        matrix = np.empty((len(poses), 3, 3))
        xx, xy, yy = np.einsum("nm,nmk->kn", weights, normals)
        matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1] = xx, xy, yy
        matrix[:, :2, 2] = np.einsum("nm,nmk->nk", weights, leaned)
        matrix[:, 2, 2] = np.einsum("nm,nmk,nmk->n", weights, leaned, turns)
        matrix[:, 1, 0], matrix[:, 2, :2] = matrix[:, 0, 1], matrix[:, :2, 2]
        return np.einsum("nm,nmk->nk", weights, gradient), matrix

    def _moved(self, poses, step):
        """Poses (N, 3) after steps, none longer than the wide field's standard deviation in m and rad."""
        most = self._rules.wide_sigma
        poses = poses + step.clip(-most, most)
        poses[:, 2] = wrapped(poses[:, 2])
        return poses


def _placed(poses, ends):
    """Beam ends (N, M, 2) of scans at poses (N, 3), and as seen from there along the axes of the map."""
    arms = ends @ np.swapaxes(rotation(poses[:, 2]), -1, -2)
    return poses[:, None, :2] + arms, arms


def _times(normals, vectors):
    """Symmetric matrices (..., 3) xx, xy, yy times vectors (..., 2)."""
    (xx, xy, yy), (x, y) = np.moveaxis(normals, -1, 0), np.moveaxis(vectors, -1, 0)
    return np.stack([xx * x + xy * y, xy * x + yy * y], axis=-1)


def _step_errors(steps, rules):
    """Standard deviations (N, 3) in m and rad of steps by odometry, as `moved_particles` has them."""
    way, turn = np.hypot(*steps[:, :2].T), np.abs(steps[:, 2])
    return np.stack(rules.errors(way, turn), axis=-1) + LEAST_ERROR


def _banded_step(poses, gradient, matrix, steps, trust):
    """Step (T, 3) of Gauss and Newton, from the springs' parts of each scan and the steps between scans."""
    errors = between(poses[:-1], poses[1:]) - steps
    errors[:, 2] = wrapped(errors[:, 2])
    before, after = _step_derivatives(poses)
    weighted = np.swapaxes(after, 1, 2) * trust[:, None], np.swapaxes(before, 1, 2) * trust[:, None]
    gradient, matrix = (
        gradient.copy(),
        matrix + 1e-3 * np.eye(3),
    )  # a scan without a beam has no place
    gradient[1:] += (weighted[0] @ errors[..., None])[..., 0]
    gradient[:-1] += (weighted[1] @ errors[..., None])[..., 0]
    matrix[1:] += weighted[0] @ after
    matrix[:-1] += weighted[1] @ before
    band = np.zeros((6, len(poses), 3))
    for row in range(3):
        for column in range(3):
            if row >= column:
                band[row - column, :, column] = matrix[:, row, column]
            band[3 + row - column, :-1, column] = (weighted[0] @ before)[:, row, column]
    return -scipy.linalg.solveh_banded(band.reshape(6, -1), gradient.ravel(), lower=True).reshape(-1, 3)


def _step_derivatives(poses):
    """How the steps between poses (T, 3) change with the pose before them and after, (T - 1, 3, 3) each."""
    back = rotation(-poses[:-1, 2])
    after = np.zeros((len(back), 3, 3))
    after[:, :2, :2], after[:, 2, 2] = back, 1
    before = -after
    ahead, left = (back @ np.diff(poses[:, :2], axis=0)[..., None])[..., 0].T
    before[:, 0, 2], before[:, 1, 2] = left, -ahead
    return before, after


def _half_squared_distances(occupancy, resolution):
    """Of each cell (H, W) to the nearest surface, in m^2; within its cell a surface lies where those beside it say.

    Where a wall runs along the border of two cells, both are hit, one of them more.
    """
    blocked = occupancy >= OCCUPIED_FROM
    surface = surface_cells(blocked)
    if not surface.any():
        return np.full(occupancy.shape, (resolution * np.hypot(*occupancy.shape)) ** 2 / 2)
    nearest = scipy.ndimage.distance_transform_edt(~surface, return_distances=False, return_indices=True)
    hit = np.where(blocked & ~surface, 0.0, occupancy)
    weight = scipy.ndimage.uniform_filter(hit, 3, mode="constant")
    places = np.indices(occupancy.shape).astype(float)
    shifts = []
    for axis, kernel in enumerate((KERNEL, KERNEL.T)):
        lean = scipy.ndimage.correlate(hit, kernel, mode="constant") / np.maximum(9 * weight, 0.5)
        shifts.append((places[axis] + lean)[tuple(nearest)] - places[axis])
    return (shifts[0] ** 2 + shifts[1] ** 2) * resolution**2 / 2


class _Springs:
    """Of each place on the map: half the squared distance to the nearest surface, its slope, and the normal.

    The normal is smoothed, as the outer product of the slopes of q with itself, so that there is one on
    the surface too. Of a map that is larger than a tile only those tiles are made in which a beam
    ends: 24 bytes a cell.
    """

    def __init__(self, background, rules):
        self._rules = rules
        self._border = int(np.ceil(BORDER / background.resolution))
        self._occupancy, self._frame = (
            background.occupancy,
            (background.origin, background.resolution),
        )
        self._shape = np.add(self._occupancy.shape, 2 * self._border)
        self._tiles = -(-(self._shape - 1) // TILE)  # each has a row and column of the next
        self._sides = np.minimum(self._shape, TILE + 1)
        self._made = np.zeros(np.prod(self._tiles), bool)
        self._table = np.empty((len(self._made) * np.prod(self._sides), 6), np.float32)

    def at(self, points):
        """(...) in m^2, (..., 2) in m and (..., 3) xx, xy, yy at points (..., 2), between the centres of cells."""
        x, y = in_cells(points[..., 0], points[..., 1], *self._frame)
        x = (x + self._border - 0.5).clip(0, self._shape[1] - 1.001)
        y = (y + self._border - 0.5).clip(0, self._shape[0] - 1.001)
        column, row = x.astype(np.intp), y.astype(np.intp)
        right, up = (x - column)[..., None], (y - row)[..., None]
        corner = self._corner(row, column)
        low = self._table[corner] * (1 - right) + self._table[corner + 1] * right
        corner = corner + self._sides[1]
        high = self._table[corner] * (1 - right) + self._table[corner + 1] * right
        found = low * (1 - up) + high * up
        return found[..., 0], found[..., 1:3], found[..., 3:]

    def _corner(self, row, column):
        """Where in the table a cell is, made if it is not there yet."""
        (down, row), (right, column) = np.divmod(row, TILE), np.divmod(column, TILE)
        tile = down * self._tiles[1] + right
        if not self._made.all():
            for number in np.unique(tile[~self._made[tile]]):
                self._make(number)
        return (tile * self._sides[0] + row) * self._sides[1] + column

    def _make(self, number):
        """Fill in a tile."""
        begin = np.array(divmod(number, self._tiles[1])) * TILE
        end = np.minimum(begin + self._sides, self._shape)
        halo = max(int(np.ceil(HALO * self._rules.wide_sigma / self._frame[1])), 8)
        low, high = np.maximum(begin - halo, 0), np.minimum(end + halo, self._shape)
        springs = _springs_of(self._window(low, high), self._frame[1], self._rules.sigma)
        (top, left), (bottom, right) = begin - low, end - low
        tile = self._table.reshape(-1, *self._sides, 6)[number]
        tile[: bottom - top, : right - left] = springs[top:bottom, left:right]
        self._made[number] = True

    def _window(self, low, high):
        """Occupancy from one row and column up to others, 0 round the map and where unknown."""
        low, high = low - self._border, high - self._border
        first, last = (each.clip(0, self._occupancy.shape) for each in (low, high))
        inside = np.nan_to_num(self._occupancy[first[0] : last[0], first[1] : last[1]])
        return np.pad(inside, np.column_stack([first - low, high - last]))


def _springs_of(occupancy, resolution, sigma):
    """The springs' numbers (H, W, 6) at the centres of cells (H, W)."""
    half = _half_squared_distances(occupancy, resolution).astype(np.float32)
    down, right = np.gradient(half, resolution)
    q_down, q_right = np.gradient(np.exp(-half / sigma**2))
    products = q_right * q_right, q_right * q_down, q_down * q_down
    xx, xy, yy = (scipy.ndimage.gaussian_filter(product, 1.0) for product in products)
    size = np.maximum(xx + yy, 1e-12)
    return np.stack([half, right, down, xx / size, xy / size, yy / size], axis=-1)
