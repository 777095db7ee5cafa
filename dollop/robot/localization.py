"""Monte Carlo localisation: where the robot is, from odometry and laser on the background map.

The paper leaves this to CARMEN; what is here is a reconstruction. Particles move by the odometry
and its error, and are weighed by a likelihood field: a beam that ends at distance d from the
nearest thing on the map has

    q(d) = exp(-d^2 / (2 sigma^2)),    likelihood = floor + (1 - floor) q(d),

so that what is not on the map costs no more than the floor: a person, a trash can, a mixed pixel.

A kidnapping is noticed by the fit of a scan, the mean q of its beams at the pose: it falls below
its long average, as in augmented Monte Carlo localisation (Thrun, Burgard and Fox, "Probabilistic
Robotics", 2005, sec. 8.3.5). The particles are then drawn anew from the scan itself (Lenser and
Veloso, "Sensor resetting localization for poorly modelled mobile robots", ICRA 2000): every pose of
a lattice over the free cells is weighed. A room may look alike from two sides to a laser that sees
half of it, so a pose that was searched for is believed only when it has explained every scan of
half a turn.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
import scipy

from dollop.checks import (
    checked_array,
    checked_generator,
    checked_number,
    checked_record,
    checked_whole,
    put_in,
)
from dollop.gridmap import covered_cells, distances_to, in_cells, in_metres
from dollop.pose import rotation
from dollop.robot.avoidance import FREE_BELOW

__all__ = ["PIONEER_LOCALISATION", "Localisation", "MonteCarloLocalizer", "surface_cells"]

MOST_POSES = 2_000_000
"""Poses of the lattice that are weighed, the most promising: as many as there are on 600 m^2 of
floor. In a hall of 200 m there are a hundred million, of 50 bytes for a moment each."""
SQUARE = 4
"""Places of the lattice along the side of a square that is judged as a whole if there are many."""
BLOCK = 1 << 18
"""Numbers that are looked up at once for the lattice."""
SHORTEST, LONGEST = 1e-3, 1e3
"""m and rad: bounds of all lengths and angles of a `Localisation`."""
LENGTHS = (
    "sigma", "wide_sigma", "close_sigma", "lattice", "starting", "narrow", "believed_after",
    "given_up_after", "carried", "loose",
)  # fmt: skip
MOST = 1_000_000
COUNTS = {
    "beam_step": MOST,
    "beams": MOST,
    "headings": 3600,
    "tracking": MOST,
    "searching": MOST,
    "doubts": MOST,
}
"""Fields of a `Localisation`: the lengths and angles, and the most of what is counted."""


@dataclass(frozen=True)
class Localisation:
    """By what a robot finds itself with odometry and laser, and when it is sure (reconstruction).

    The defaults are those of a Pioneer 2 DX with a SICK LMS 200 in rooms. A laser that is less
    exact wants a larger `sigma`, wheels that slip larger errors of the odometry.

    Attributes
    ----------
    sigma, wide_sigma, close_sigma : float
        Standard deviations in m of the likelihood field: for particles; for a lattice, which misses
        the true pose; and to choose among places for a whole log.
    floor : float
        Likelihood, above 0 and below 1, of a beam that the map does not explain.
    independent : float
        Share of the beams that count: neighbours err together, where the map is wrong.
    beam_step, beams : int
        Every which beam of a scan is used (CARMEN: one in 3 degrees), and about how many of a log's.
    lattice, headings : float, int
        Distance in m between the places that are searched, and how many headings at each.
    tracking, searching : int
        Numbers of particles: while they agree (CARMEN's), and while they do not.
    starting, narrow : float
        Standard deviations in m and rad: of particles round a pose that is told, and below which
        they agree.
    believed_after, given_up_after : float
        Angles in rad to turn until a pose that explains every scan is believed, and until the
        search starts anew.
    lost, doubts : float, int
        Share of its long average below which the fit of a scan is in doubt, and how many such
        scans, one after the other, make a kidnapping.
    usual_fit, forgetting : float
        Long average of the fit to begin with, and its gain per scan.
    along, aside, turned, twisted : float
        Standard deviations of a step by odometry: shares of its way, along it and across; share of
        its turn; and rad per m of its way.
    least_error : float
        m and rad that are added to each of them for every control period.
    carried : float
        m and rad: a step in a log that differs so much from the odometry's was none: somebody
        carried the robot.
    rival : float
        How much worse, in mean q, a second place must explain a log's scans, or there is a note.
    loose : float
        Standard deviation in m along the weakest direction, of half of all scans of a log, from
        which on there is a note.

    Raises
    ------
    ValueError
        For what is no number of its kind, or a search given up before anything is believed.

    Examples
    --------
    One that never believes anything is refused.

    >>> Localisation(believed_after=7.0)
    Traceback (most recent call last):
    ValueError: given_up_after must be at least believed_after, 7 rad, got 6.28319
    """

    sigma: float = 0.10
    wide_sigma: float = 0.20
    close_sigma: float = 0.05
    floor: float = 0.10
    independent: float = 0.3
    beam_step: int = 3
    beams: int = 60
    lattice: float = 0.15
    headings: int = 72
    tracking: int = 250
    searching: int = 3000
    starting: float = 0.05
    narrow: float = 0.15
    believed_after: float = pi
    given_up_after: float = 2 * pi
    lost: float = 0.65
    doubts: int = 3
    usual_fit: float = 0.8
    forgetting: float = 0.01
    along: float = 0.10
    aside: float = 0.05
    turned: float = 0.10
    twisted: float = 0.05
    least_error: float = 0.002
    carried: float = 0.3
    rival: float = 0.05
    loose: float = 0.20

    def __post_init__(self):
        self._check_numbers(SHORTEST, LONGEST, *LENGTHS)
        self._check_numbers(SHORTEST, 1 - SHORTEST, "floor", "lost", "usual_fit")
        self._check_numbers(0, 1, "independent", "forgetting", "rival")
        self._check_numbers(0, LONGEST, "along", "aside", "turned", "twisted", "least_error")
        for name, most in COUNTS.items():
            put_in(self, **{name: checked_whole(name, getattr(self, name), 1, most)})
        if self.given_up_after < self.believed_after:
            rule = f"given_up_after must be at least believed_after, {self.believed_after:g} rad"
            raise ValueError(f"{rule}, got {self.given_up_after:g}")

    def _check_numbers(self, least, most, *names):
        for name in names:
            put_in(self, **{name: checked_number(name, getattr(self, name), least, most)})

    @property
    def fits(self):
        """Float: mean q of a scan's beams from which on the map explains it."""
        return self.lost * self.usual_fit

    def errors(self, way, turn):
        """Standard deviations of a step by odometry, without the least error.

        Parameters
        ----------
        way, turn : float or (N,) float array
            How far it goes in m and turns in rad, both positive.

        Returns
        -------
        tuple of float or (N,) float array
            Along it and across in m, and of the turn in rad.

        Examples
        --------
        >>> tuple(round(error, 3) for error in Localisation().errors(1.0, 0.5))
        (0.1, 0.05, 0.1)
        """
        return self.along * way, self.aside * way, self.turned * turn + self.twisted * way


PIONEER_LOCALISATION = Localisation()
"""Of a Pioneer 2 DX with a SICK LMS 200."""


class MonteCarloLocalizer:
    """Particles that follow a robot, notice when it has been moved, and find it again.

    From "Probabilistic Robotics" (2005) and Lenser and Veloso (2000), see the top of this module.

    Memory: 16 bytes a cell of the map to follow a robot, and 40 to begin; 70 to search for one, and
    no more than 140 however long its beams are. Of the lattice 2 million poses are weighed.
    So 200 m x 200 m at 5 cm take less than 1 GiB, and a search some seconds.

    Parameters
    ----------
    background : OccupancyGrid
        The map.
    angles : (B,) array_like
        Bearing of each beam in rad.
    environment : Environment, optional
        Boxes that are known to stand there as well.
    pose : (3,) sequence of float, optional
        Where the robot starts: x, y in m, theta in rad. Without it, it has to find itself first.
    laser_offset : float
        Laser ahead of the robot's centre of rotation in m.
    seed : int or numpy.random.Generator
    rules : Localisation
        What the laser and the odometry are like, and what is believed.

    Attributes
    ----------
    rules : Localisation
    pose : (3,) float array
        Mean of the particles; NaN before the first scan if none was given.
    spread : (2,) float array
        Standard deviation of the particles in m, in the plane, and in rad.
    fit : float
        Mean q of the last scan at the pose: how well the map explains it, from 0 to 1.
    particles : (N, 3) float array or None
        Guesses of the pose; None until the scan that a search begins with.
    converged : bool
        Whether the pose is followed, and not searched for.

    Raises
    ------
    ValueError
        If the pose is not finite, the map has no free cell to search, or the rules are none.
    """

    def __init__(
        self,
        background,
        angles,
        environment=None,
        pose=None,
        laser_offset=0.0,
        seed=0,
        rules=PIONEER_LOCALISATION,
    ):
        self._rng, self.rules = (
            checked_generator("seed", seed),
            checked_record("rules", rules, Localisation),
        )
        self._bearings = np.asarray(angles, dtype=float)[:: rules.beam_step]
        self._laser_offset = laser_offset
        blocked, frame = background.occupied, (background.origin, background.resolution)
        if environment is not None:
            blocked = blocked | covered_cells(environment.boxes, *frame, blocked.shape)
        free = (background.occupancy < FREE_BELOW) & ~blocked
        if not free.any():
            raise ValueError("the background must have a free cell to search, got none")
        self._surface, self._frame = surface_cells(blocked), frame
        self._field, self._lattice = self._field_of(rules.sigma), lattice(free, background, rules)
        self._usual_fit = rules.usual_fit
        self.pose, self.spread, self.fit = np.full(3, np.nan), np.full(2, np.inf), 0.0
        if pose is None:
            self.search()
        else:
            self.start(pose)

    def _field_of(self, sigma):
        distances = distances_to(self._surface, self._frame[1])
        return LikelihoodField(distances, sigma, *self._frame, self.rules.floor)

    @property
    def localised(self):
        """Bool: whether the pose is to be believed: converged, and the last scan not in doubt."""
        return self.converged and self._doubts == 0

    def start(self, pose):
        """Believe a pose, to a few centimetres and degrees.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.

        Raises
        ------
        ValueError
            If the pose is not finite.
        """
        self.pose = checked_array("pose", pose, 3)
        self.spread, self.fit = np.full(2, self.rules.starting), self._usual_fit
        off = self._rng.standard_normal((self.rules.tracking, 3))
        self.particles = self.pose + self.rules.starting * off
        self.converged, self._doubts = True, 0

    def search(self):
        """Believe nothing; the next scan draws the particles."""
        self.particles, self.converged, self._doubts = None, False, 0
        self._turned = self._agreed = 0.0

    def update(self, motion, ranges):
        """Take in what happened in one control period.

        Parameters
        ----------
        motion : (3,) sequence of float
            By odometry, as `dollop.pose.motion_between` has it.
        ranges : (B,) array_like
            The scan after it in m, `inf` where nothing came back.
        """
        ends = self._beam_ends(np.asarray(ranges, dtype=float))
        moved = bool(np.abs(motion).max() > 1e-4)
        if self.particles is None:
            self.particles = self._draw(ends)
        elif moved:
            self.particles = moved_particles(self.particles, motion, self._rng, self.rules)
        scores = self._field.log_likelihoods(self.particles, ends)
        weights = softmax(self.rules.independent * scores)
        self.pose, self.spread = mean_pose(self.particles, weights)
        self.fit = float(self._field.values(self.pose[None], ends).mean()) if len(ends) else 0.0
        if moved:  # the same view again would be no new evidence
            self.particles = self._resampled(weights)
        self._judge(abs(motion[2]))

    def _judge(self, turn):
        """Doubt a pose that was believed, or believe one searched for, after a turn in rad."""
        rules = self.rules
        fits = self.fit >= rules.lost * self._usual_fit
        if self.converged:
            self._doubts = 0 if fits else self._doubts + 1
            self._usual_fit += rules.forgetting * (self.fit - self._usual_fit) if fits else 0.0
            in_vain = self._doubts >= rules.doubts
        else:
            self._turned += turn
            self._agreed = self._agreed + turn if fits and self.spread.max() < rules.narrow else 0.0
            self.converged = self._agreed >= rules.believed_after
            in_vain = not self.converged and self._turned > rules.given_up_after
        if in_vain:
            self.search()

    def _beam_ends(self, ranges):
        """Where the used beams end in the robot's frame: (M, 2) in m."""
        ranges = ranges[:: self.rules.beam_step]
        back = np.isfinite(ranges)
        directions = np.column_stack([np.cos(self._bearings[back]), np.sin(self._bearings[back])])
        return ranges[back, None] * directions + [self._laser_offset, 0.0]

    def lattice_scores(self, ends):
        """Log likelihood of every pose of the lattice, by the wide field, or of 2 million.

        Of a larger lattice these are the most promising: all places of a square of 60 cm have at
        most the sum of what each beam could find if it ended anywhere in such a square. If the best
        of them is better than what the next square promises, it is the best of all.

        Parameters
        ----------
        ends : (M, 2) float array
            Beam ends in the robot's frame in m.

        Returns
        -------
        chosen : (N,) int array
            Which poses, ascending.
        scores : (N,) float array
        """
        places, count = self._lattice, self.rules.headings
        headings = np.arange(count) * (2 * pi / count)
        field = self._field_of(self.rules.wide_sigma)  # not kept: it is for the lost
        some = [np.arange(len(places))] * count
        if len(places) * count > MOST_POSES:
            some = self._promising(field, headings, ends)
        scores = np.concatenate([*field.lattice_log_likelihoods(places, headings, ends, some)])
        return np.concatenate([k * len(places) + each for k, each in enumerate(some)]), scores

    def _promising(self, field, headings, ends):
        """Places (N_k,) of the lattice for each heading, those of the squares that promise most."""
        origin, resolution = self._frame
        side = SQUARE * max(1, round(self.rules.lattice / resolution))
        column, row = in_cells(*self._lattice.T, origin, resolution)
        squares = np.floor(np.column_stack([column, row])).astype(int) // side
        corners, square = np.unique(squares, axis=0, return_inverse=True)
        corners = np.column_stack(in_metres(*(corners.T * side + 0.5), origin, resolution))
        promised = np.array([*field.lattice_log_likelihoods(corners, headings, ends, reach=side)])
        few = MOST_POSES // SQUARE**2
        best = np.argpartition(-promised.ravel(), few)[:few]
        chosen = np.zeros(promised.shape, bool)
        chosen.ravel()[best] = True
        return [np.flatnonzero(each[square.ravel()]) for each in chosen]

    def lattice_poses(self, chosen):
        """Poses of the lattice.

        Parameters
        ----------
        chosen : (N,) int array
            Which, of `lattice_scores`.

        Returns
        -------
        (N, 3) float array
            x, y in m, theta in rad.
        """
        heading, place = np.divmod(chosen, len(self._lattice))
        return np.column_stack([self._lattice[place], heading * (2 * pi / self.rules.headings)])

    def _draw(self, ends):
        """Particles (N, 3) from a scan: lattice poses by their likelihood, spread over meshes."""
        rules = self.rules
        chosen, scores = self.lattice_scores(ends[::2])
        weights = softmax(2 * rules.independent * scores)
        chosen = chosen[self._rng.choice(len(scores), rules.searching, p=weights)]
        mesh = [rules.lattice, rules.lattice, 2 * pi / rules.headings]
        off = self._rng.uniform(-0.5, 0.5, (rules.searching, 3)) * mesh
        return self.lattice_poses(chosen) + off

    def _resampled(self, weights):
        """Particles (N, 3) drawn with the weights by one comb, few if they agree."""
        rules = self.rules
        count = rules.tracking if self.spread.max() < rules.narrow else rules.searching
        comb = (np.arange(count) + self._rng.random()) / count
        return self.particles[np.searchsorted(np.cumsum(weights), comb).clip(max=len(weights) - 1)]


class LikelihoodField:
    """q of beam ends anywhere, by looking it up.

    Parameters
    ----------
    distances : (H, W) float array
        From each cell to the nearest thing on the map in m.
    sigma : float
        m.
    origin : (float, float)
        Lower left corner of the map in m.
    resolution : float
        Side of a cell in m.
    floor : float
        Likelihood of a beam that nothing explains.
    """

    def __init__(self, distances, sigma, origin, resolution, floor=PIONEER_LOCALISATION.floor):
        self.reach = resolution * np.hypot(*distances.shape)  # no longer beam ends on the map
        # Cells are counted from where no beam ends; of that border, all alike, one cell is kept.
        self._border = int(np.ceil(self.reach / resolution)) + 2
        table = np.zeros(np.add(distances.shape, 2), np.float32)
        for row, away in zip(table[1:-1], distances, strict=True):
            row[1:-1] = np.exp(-0.5 * (away / sigma) ** 2)
        self.shape, self.table = table.shape, table.ravel()
        self.log_table = (1 - floor) * self.table
        self.log_table += floor
        np.log(self.log_table, out=self.log_table)
        self.origin, self.resolution = np.array(origin) - self._border * resolution, resolution
        self.low = np.array(origin)
        self.high = self.low + resolution * (np.array(distances.shape)[::-1] - 1)

    def values(self, poses, ends):
        """q (N, M) of beams that end at (M, 2) in the frame of each of (N, 3) poses."""
        return self.table[self.cells(poses, ends)]

    def log_likelihoods(self, poses, ends):
        """Sum over the beams (M, 2) of log(floor + (1 - floor) q), for (N, 3) poses: (N,)."""
        return self.log_table[self.cells(poses, ends)].sum(axis=1)

    def lattice_log_likelihoods(self, places, headings, ends, some=None, reach=1):
        """The same for places (N, 2) of each heading (K,) in rad, beams moved by whole cells: fast.

        An iterator over (N,) float arrays; or only over some of the places, (N_k,) for each
        heading. The border is as wide as the beams are long. With a reach in cells a beam counts as
        if it had ended where it is likeliest in the square of that side to the right and above.
        """
        ends, most = self.within_reach(ends), np.array(self.shape) - 1
        longest = np.ceil(np.hypot(*ends.T).max(initial=0) / self.resolution) + 1
        border = np.minimum(longest, most).astype(int)
        beyond = {"mode": "constant", "constant_values": self.log_table[0]}
        table = np.pad(self.log_table.reshape(self.shape), border[:, None], **beyond)
        for axis in (0, 1) if reach > 1 else ():
            ahead = {"mode": "nearest", "origin": -(reach // 2), "output": table}
            scipy.ndimage.maximum_filter1d(table, reach, axis, **ahead)
        columns, table = table.shape[1], table.ravel()
        poses = np.column_stack([places, np.zeros(len(places))])
        row, column = self._rows_and_columns(poses, np.zeros((1, 2)))
        here = (row + border[0]) * columns + column + border[1]
        for k, heading in enumerate(headings):
            there = np.rint(ends @ rotation(heading).T / self.resolution)
            column, row = there.astype(np.int32).T
            apart = row.clip(-border[0], border[0]) * columns + column.clip(-border[1], border[1])
            mine = here if some is None else here[some[k]]
            blocks = np.array_split(mine, 1 + len(mine) * len(ends) // BLOCK)
            yield np.concatenate([table[block + apart].sum(axis=1) for block in blocks])

    def cells(self, poses, ends):
        """Flat index (N, M) of the cell where each beam ends."""
        rows, columns = self._rows_and_columns(poses, ends)
        return rows * self.shape[1] + columns

    def _rows_and_columns(self, poses, ends):
        places = poses[:, :2].clip(self.low, self.high)
        column, row = in_cells(places[:, :1], places[:, 1:], self.origin, self.resolution)
        cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        ahead, left = self.within_reach(ends).T / self.resolution
        columns = (column + cos * ahead - sin * left).astype(np.int32) - (self._border - 1)
        rows = (row + sin * ahead + cos * left).astype(np.int32) - (self._border - 1)
        return rows.clip(0, self.shape[0] - 1), columns.clip(0, self.shape[1] - 1)

    def within_reach(self, ends):
        """Beam ends (M, 2), those that are farther than the map is wide drawn in."""
        return ends * np.minimum(1.0, self.reach / np.maximum(np.hypot(*ends.T), 1e-9))[:, None]


def surface_cells(blocked):
    """Blocked cells at which beams may end.

    Parameters
    ----------
    blocked : (H, W) bool array

    Returns
    -------
    (H, W) bool array
        Without those inside of something.
    """
    return blocked & ~scipy.ndimage.binary_erosion(blocked, border_value=1)


def lattice(free, background, rules):
    """Places (N, 2) in m, as far apart as the rules have it, in the free cells (H, W) of a map."""
    stride = max(1, round(min(rules.lattice / background.resolution, max(free.shape))))
    cells = np.argwhere(free[::stride, ::stride]) * stride
    return background.cell_centres(cells if len(cells) else np.argwhere(free))


def moved_particles(particles, motion, rng, rules):
    """Particles (N, 3) after a motion (3,) by odometry, each with an error by the rules."""
    way, turn = np.hypot(*motion[:2]), motion[2]
    errors = [error + rules.least_error for error in rules.errors(way, abs(turn))]
    ahead, left, turned = (rng.standard_normal((len(particles), 3)) * errors + motion).T
    x, y, theta = particles.T
    c, s = np.cos(theta + turn / 2), np.sin(theta + turn / 2)
    return np.column_stack([x + c * ahead - s * left, y + s * ahead + c * left, theta + turned])


def softmax(scores):
    """exp(scores), divided by its sum."""
    shares = np.exp(scores - scores.max())
    return shares / shares.sum(dtype=float)


def mean_pose(particles, weights):
    """Weighted mean pose (3,) of particles (N, 3), and their spread (2,) in m and rad."""
    place = weights @ particles[:, :2]
    resultant = weights @ np.exp(1j * particles[:, 2])
    plane = np.sqrt(weights @ ((particles[:, :2] - place) ** 2).sum(axis=1))
    turn = np.sqrt(max(0.0, -2 * np.log(max(abs(resultant), 1e-12))))  # circular standard deviation
    return np.array([*place, np.angle(resultant)]), np.array([plane, turn])
