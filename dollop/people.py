"""People: who walks where, from the foreground readings that do not stand (Sec. II).

The paper follows every foreground object alike and calls the fastest of the moment the user. With a
second person, a box that hides the user, or a laser at the height of legs, that joins pieces of
different people. Here a person is followed in three steps:

1. In each scan, readings beside each other that do not belong to something that stands are one
   candidate; narrow ones within a stride are the two legs of one. A reading alone between a nearer
   and a farther surface is a mixed pixel, and nobody.
2. Candidates are followed by the Kalman filter of `dollop.tracking` for as long as they are in
   sight: that is a piece of a person's way.
3. Pieces are joined where only one person can have walked both. With the end (x, v) of one, the
   beginning (x', v') of another and the gap g between them,

       e = (x' - x - g v, v' - v),    S = Q(g) + P,
       log odds = log N(e; 0, S) - log N(v'; 0, 1 m/s) + log(area) + prior,

   it is the same person rather than somebody new, if the way round the walls can be walked in time.
   The best assignment of all ends to all beginnings is taken; a joint for which another assignment
   is nearly as good is not made.
"""

from array import array
from dataclasses import dataclass
from itertools import combinations
from math import hypot, log, pi, sqrt
from typing import NamedTuple

import numpy as np
import scipy

from dollop.tracking import Motion, Track, smooth
from dollop.trajectory import arc_length, at_arc_length

__all__ = [
    "BRIDGED",
    "Candidate",
    "Followed",
    "MOVED",
    "OVERLAP",
    "Person",
    "REACH",
    "SAME_PLACE",
    "SLACK",
    "candidates",
    "joined",
    "moving_speed",
    "off_standing",
    "person_of",
    "seen_badly",
    "stood",
    "together",
]

JUMP, SPREAD = 0.12, 1.5
"""Neighbouring readings farther apart than `JUMP` m plus `SPREAD` beam spacings are different
surfaces."""
EDGE = 0.10
"""m: a neighbouring beam so much nearer or farther has met something else."""
NARROW, STRIDE = 0.26, 0.65
"""m: a candidate narrower than this may be a leg; two such nearer than this are one person."""
OTHER_LEG = 0.10
"""m: where one leg is hidden, the middle is so far from the other."""
WIDEST = 0.60
"""m: nobody is wider."""
SURE, LEGS, VAGUE = 0.05, 0.07, 0.14
"""Standard deviations in m of the middle of a body seen whole; of two legs; and of one leg, or a body
half hidden."""
GATE, GATE_MIN, GATE_MAX = 3.0, 0.45, 1.0
"""Standard deviations, and bounds in m, within which a candidate is taken for who was expected."""
AT_ONCE, FASTEST = 0.35, 3.0
"""m, and m/s: nobody is farther from where they were seen last; more is another one who was
hidden."""
ONE_LEG = 0.3
"""By how much, as a share of the gate, one leg must be nearer than the pair to be the better candidate."""
PATIENCE = 1.0
"""s out of sight after which a piece ends: what comes then is for `joined` to say."""
ALONE = 0.65
"""m round somebody in which a narrow candidate is not somebody new."""
MOVED, STANDS_WITHIN = 0.5, 0.5
"""m from where it began, from which on a piece is of somebody who walks; and m within which who
walked is standing."""
OFTEN = 0.4
"""Share of the scans in which somebody is seen who is in sight."""
ROW = 8
"""Numbers kept of a measurement: scan, x, y of the near side, sight (2), width, standard deviation,
and the side that something nearer hides: 1 left, -1 right, 2 both, 0 none."""
SAME_PLACE = 0.25
"""m: what went and what stands there so near are the same, seen badly."""
STOOD_LINK, WIDE = 0.35, 0.75
"""m: cells so near to each other stood and went together; what is wider than that is nobody."""
BEGAN = 1.0
"""s: who begins to walk so soon before or after what stood there was seen last is who stood
there."""
ON, STAYS = 0.20, 0.5
"""m, and a quarter of its width, from a cell that stands within which a measurement is of what
stands; and s that it goes on to."""
LONGEST_GAP, REACH, SLACK = 6.0, 2.0, 0.5
"""s, m/s and m: a gap between pieces is bridged up to so long, where the way can be walked so fast,
and a little more."""
PRIOR = 3.0
"""Log odds, before anything is seen, that who comes into sight is who was last seen."""
DOUBTFUL = 2.0
"""Log odds over the next best assignment below which a joint is not made."""
END_SD = 1.3
"""How much worse than its measurements the place at the end of a piece is known."""
BRIEF = 0.5
"""s: a briefer piece is no rival."""
TURNS, ABRUPT = 0.1, 10.0
"""Share of the joints at which somebody turns sharply, and how much more noise that is."""
CLOSE, BESIDE = 0.8, 0.6
"""m from somebody out of sight within which another may be taken for them; and within which both
may be one candidate."""
OVERLAP = 1.2
"""s that somebody may be followed on, wrongly, after they have come into sight elsewhere."""
SHORT_GAP = 0.15
"""s: who is out of sight for less cannot be confused."""
MOMENT = 0.8
"""s over which the velocity of somebody badly seen is taken."""
BRIDGED = 0.5
"""s out of sight from which on what is between is a bridge."""
SLOW, MOST_SWING = 0.25, 4.0
"""m/s below which somebody stands; and by how much more than on a straight way a bridge may swing
out."""
STRAIGHT_ON, LOITERS = 0.7, 1.2
"""Cosine to the straight way from which on a way leads straight on, and how much longer it then may
be."""


class Candidate(NamedTuple):
    """Who may be a person in one scan.

    Attributes
    ----------
    x, y : float
        Mean of the readings, on the near side, in m.
    ux, uy : float
        Direction of the line of sight.
    width : float
        Across it, in m; 0 for two legs, whose middle x and y are already.
    sd : float
        Standard deviation of the middle in m.
    hidden : float
        The side that something nearer hides: 1 left, -1 right, 2 both, 0 none.
    leg_of : int
        How many candidates before it the pair is of which it may be a leg; 0 for none.
    """

    x: float
    y: float
    ux: float
    uy: float
    width: float
    sd: float
    hidden: float
    leg_of: int = 0

    @property
    def middle(self):
        """(float, float) in m: that of a disc, whose near side is pi/4 of its radius before it."""
        push = pi / 8 * self.width
        return self.x + push * self.ux, self.y + push * self.uy


def candidates(beam, x, y, ranges, pose, step):
    """Who may be a person in one scan.

    Parameters
    ----------
    beam : (n,) int array
        Beams with foreground readings that do not stand, ascending.
    x, y : (n,) float arrays
        Where they ended, m.
    ranges : (B,) float array
        The whole scan in m.
    pose : (3,) float sequence
        Of the sensor.
    step : float
        Angle between beams in rad.

    Returns
    -------
    list of Candidate
    """
    n = len(beam)
    if n == 0:
        return []
    steps = np.hypot(x[1:] - x[:-1], y[1:] - y[:-1])
    near = ranges[beam]
    apart = (beam[1:] - beam[:-1] > 2) | (steps > JUMP + SPREAD * step * near[1:])
    starts = [0, *(np.flatnonzero(apart) + 1).tolist()]
    sums = zip(np.add.reduceat(x, starts).tolist(), np.add.reduceat(y, starts).tolist(), strict=True)
    whole, narrow = [], []
    for first, last, (sum_x, sum_y) in zip(starts, [*starts[1:], n], sums, strict=True):
        count = last - first
        right, left = int(beam[first]), int(beam[last - 1])
        before = ranges[right - 1] - near[first] if right else -1.0
        after = ranges[left + 1] - near[last - 1] if left + 1 < len(ranges) else -1.0
        if count == 1 and min(before, after) < -EDGE and max(before, after) > EDGE:
            continue  # a mixed pixel
        sum_x, sum_y = sum_x / count, sum_y / count
        ux, uy = sum_x - pose[0], sum_y - pose[1]
        distance = hypot(ux, uy) or 1e-9
        angle = (left - right + 1) * step
        width = min(angle * distance / max(1 - pi / 8 * angle, 0.5), WIDEST)  # of a disc, whose edges lie deeper
        hidden = 2.0 if before < -EDGE and after < -EDGE else float(after < -EDGE) - float(before < -EDGE)
        sd = VAGUE if hidden else SURE
        found = Candidate(sum_x, sum_y, ux / distance, uy / distance, width, sd, hidden)
        (narrow if width < NARROW else whole).append(found)
    return whole + paired(narrow) if narrow else whole


def paired(narrow):
    """Candidates of narrow ones: two within a stride are one person's legs, nearest pairs first.

    The legs of a pair are candidates too, should the other be a stray reading: they come after it.
    """
    pairs = []
    for (i, leg), (j, other) in combinations(enumerate(each.middle for each in narrow), 2):
        apart = hypot(leg[0] - other[0], leg[1] - other[1])
        if apart < STRIDE:
            pairs.append((apart, i, j, ((leg[0] + other[0]) / 2, (leg[1] + other[1]) / 2)))
    single, used, found = [each._replace(sd=VAGUE) for each in narrow], set(), []
    for _, i, j, middle in sorted(pairs):
        if not {i, j} & used:
            used |= {i, j}
            legs = single[i]._replace(leg_of=1), single[j]._replace(leg_of=2)
            found += [Candidate(*middle, *single[i][2:4], 0.0, LEGS, 0.0), *legs]
    return found + [each for i, each in enumerate(single) if i not in used]


class Piece:
    """Somebody in sight: the state of the Kalman filter of `dollop.tracking`, and what was measured.

    Both axes share one covariance, P = [[pxx, pxv], [pxv, pvv]].
    """

    __slots__ = [
        "x",
        "y",
        "vx",
        "vy",
        "pxx",
        "pxv",
        "pvv",
        "seen",
        "rows",
        "begin",
        "far",
        "anchor",
        "arrived",
    ]

    def __init__(self, place, t):
        self.x, self.y, self.vx, self.vy = *place, 0.0, 0.0
        self.pxx, self.pxv, self.pvv = SURE**2, 0.0, 1.0
        self.seen, self.rows, self.far = t, array("d"), 0.0
        self.begin, self.anchor, self.arrived = place, place, t

    def predict(self, dt, q):
        """x <- F x, P <- F P F^T + Q over a time in s, for a noise of density q in m^2/s^3."""
        self.x += dt * self.vx
        self.y += dt * self.vy
        self.pxx += dt * (2 * self.pxv + dt * self.pvv) + q * dt**3 / 3
        self.pxv += dt * self.pvv + q * dt * dt / 2
        self.pvv += q * dt

    def update(self, x, y, variance, t):
        """Kalman update with a place in m of some variance in m^2, seen at a time in s."""
        position = self.pxx / (self.pxx + variance)
        velocity = self.pxv / (self.pxx + variance)
        dx, dy = x - self.x, y - self.y
        self.x += position * dx
        self.y += position * dy
        self.vx += velocity * dx
        self.vy += velocity * dy
        self.pvv -= velocity * self.pxv
        self.pxv *= 1 - position
        self.pxx *= 1 - position
        self.seen = t
        self.far = max(self.far, hypot(self.x - self.begin[0], self.y - self.begin[1]))
        if hypot(self.x - self.anchor[0], self.y - self.anchor[1]) > STANDS_WITHIN:
            self.anchor, self.arrived = (self.x, self.y), t


class Followed:
    """Everybody who has been in sight, piece by piece (Sec. II).

    Parameters
    ----------
    motion : Motion, optional
        How people move; position and velocity.
    """

    def __init__(self, motion=None):
        self.noise = (motion or Motion()).noise
        self.t, self.alive, self.past = array("d"), [], []

    def standing(self):
        """Those who walked and may be standing now.

        Returns
        -------
        list of Piece
        """
        return [piece for piece in self.alive if piece.far > MOVED]

    def step(self, t, found):
        """Match those in sight with the candidates of the next scan.

        Parameters
        ----------
        t : float
            Time in s, later than the last.
        found : list of Candidate
        """
        scan = len(self.t)
        dt = t - self.t[-1] if scan else 0.0
        self.t.append(t)
        if dt > PATIENCE:
            self._end(t)  # nothing is known of what happened in a pause
        for piece in self.alive:
            piece.predict(dt, self.noise)
        if found:
            self._match(t, scan, found)
        self._end(t)

    def _end(self, t):
        """End the pieces of those who have been out of sight for too long."""
        if self.alive and min(piece.seen for piece in self.alive) < t - PATIENCE:
            self.past += [piece for piece in self.alive if piece.seen < t - PATIENCE and worth_keeping(piece)]
            self.alive = [piece for piece in self.alive if piece.seen >= t - PATIENCE]

    def _match(self, t, scan, found):
        """Greedily: nearest pairs of piece and candidate first; who is left over is somebody new."""
        middles = [each.middle for each in found]
        free, pairs = set(range(len(found))), []
        for k, piece in enumerate(self.alive):
            for m, (x, y) in enumerate(middles):
                variance = piece.pxx + found[m].sd ** 2
                widest = GATE_MAX if piece.far > MOVED else GATE_MIN
                widest = min(widest, AT_ONCE + FASTEST * (t - piece.seen))
                gate = min(max(GATE * sqrt(variance), GATE_MIN), widest)
                apart = hypot(x - piece.x, y - piece.y)
                if apart < gate:
                    pairs.append((apart / gate + ONE_LEG * (found[m].leg_of > 0), k, m))
        taken = set()
        for _, k, m in sorted(pairs):
            if k not in taken and m in free:
                taken.add(k)
                free -= {m, *rivals_of(m, found)}
                self.alive[k].update(*middles[m], found[m].sd ** 2, t)
                self.alive[k].rows.extend((scan, *found[m][:-1]))
        for m in sorted(free):
            x, y = middles[m]
            if m not in free:
                continue
            leg = found[m].width < NARROW
            if leg and any(hypot(piece.x - x, piece.y - y) < ALONE and piece.seen == t for piece in self.alive):
                continue
            free -= set(rivals_of(m, found))
            piece = Piece((x, y), t)
            piece.rows.extend((scan, *found[m][:-1]))
            self.alive.append(piece)

    def pieces(self):
        """Measurements of every piece that may be of somebody's way.

        Returns
        -------
        list of (n, 8) float arrays
            In the order of their beginning; the columns are: scan, x, y of the near side in m, sight
            (2), width and standard deviation in m, and the side that something nearer hides, 1 left,
            -1 right, 2 both, 0 none.
        """
        kept = self.past + [piece for piece in self.alive if worth_keeping(piece)]
        rows = [np.frombuffer(piece.rows).reshape(-1, ROW).copy() for piece in kept]
        return sorted(rows, key=lambda each: each[0, 0])


def rivals_of(m, found):
    """Candidates that are no more if candidate m is somebody: its legs, or the pair that it is a leg of."""
    if found[m].leg_of:
        return [m - found[m].leg_of]
    return [k for k in (m + 1, m + 2) if k < len(found) and found[k].leg_of == k - m]


def worth_keeping(piece):
    """Whether a piece may be of somebody's way: seen often enough."""
    n, scans = len(piece.rows) // ROW, piece.rows[-ROW] - piece.rows[0] + 1
    return n >= 4 and n >= OFTEN * scans


# ---- what stood, and who walked from there


def stood(gone, stands, pieces, t, step):
    """Pieces of those who stood before they walked.

    Parameters
    ----------
    gone, stands : (G, 6) and (S, 6) float arrays
        Cells where something stood and is no more, and where something stands: place and sensor in
        m, since and until in s.
    pieces : list of (n, 8) float arrays
        From `Followed.pieces`.
    t : (T,) float array
        Time of each scan in s.
    step : float
        Angle between beams in rad.

    Returns
    -------
    list of (n, 8) float arrays
        One for each thing that a person may be.
    """
    groups = [group for group in together(gone) if len(group) > 1 and not seen_badly(group, stands)]
    found = [standing_rows(group, pieces, t, step) for group in groups]
    return [rows for parts in found for rows in parts]


def seen_badly(group, stands):
    """Whether a group of cells went of which most still stands.

    Parameters
    ----------
    group, stands : (G, 6) and (S, 6) float arrays
        Cells, as for `stood`.

    Returns
    -------
    bool
    """
    then = stands[stands[:, 4] < np.median(group[:, 5]), :2]
    if not len(then):
        return False
    near = scipy.spatial.cKDTree(group[:, :2]).query(then)[0] < SAME_PLACE
    return bool(np.count_nonzero(near) > len(group) / 2)


def together(gone):
    """Cells that stood and went together.

    Parameters
    ----------
    gone : (G, 6) float array
        Cells where something stood and is no more: place and sensor in m, since and until in s.

    Returns
    -------
    list of (G_k, 6) float arrays
    """
    if not len(gone):
        return []
    pairs = scipy.spatial.cKDTree(gone[:, :2]).query_pairs(STOOD_LINK, output_type="ndarray")
    pairs = pairs[np.minimum(*gone[pairs, 5].T) > np.maximum(*gone[pairs, 4].T)]
    graph = scipy.sparse.coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (len(gone),) * 2)
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    return [gone[label == k] for k in range(count)]


def standing_rows(group, pieces, t, step):
    """Measurements of somebody who stood where a group of cells (G, 6) was, as far as no piece has them.

    A list of (n, 8) arrays, empty where what stood is wider than anybody.
    """
    place, sensor = group[:, :2].mean(axis=0), group[:, 2:4].mean(axis=0)
    distance = np.linalg.norm(place - sensor)
    sight = (place - sensor) / distance
    width = np.ptp(group[:, :2] @ [-sight[1], sight[0]]) + step * distance
    if width > WIDE:
        return []
    begin, end = group[:, 4].min(), np.median(group[:, 5])
    alone = (t >= begin) & (t <= end)
    for rows in pieces:
        when = t[rows[:, 0].astype(int)]
        here = (when >= begin) & (when <= end + BEGAN) & (np.linalg.norm(rows[:, 1:3] - place, axis=1) < ALONE)
        if here.any():
            alone &= (t < when[here][0]) | (t > when[here][-1])
            alone &= (t < when[0]) | (when[0] < end - BEGAN)  # who begins to walk as it goes
    scans = np.flatnonzero(alone)
    parts = np.split(scans, np.flatnonzero(np.diff(scans) > 1) + 1)
    row = np.array([0.0, *place, *sight, min(width, WIDEST), SURE, 0.0])
    found = [np.tile(row, (len(part), 1)) for part in parts if len(part) >= 3]
    for rows, part in zip(found, [part for part in parts if len(part) >= 3], strict=True):
        rows[:, 0] = part
    return found


def off_standing(pieces, stood, t):
    """Pieces without the measurements at their beginning that are of something that stands.

    Parameters
    ----------
    pieces : list of (n, 8) float arrays
    stood : (S, 6) float array
        Cells where something stands or stood: place and sensor in m, since and until in s.
    t : (T,) float array
        Time of each scan in s.

    Returns
    -------
    list of (n, 8) float arrays
    """
    if not len(stood):
        return pieces
    tree, kept = scipy.spatial.cKDTree(stood[:, :2]), []
    for rows in pieces:
        when = t[rows[:, 0].astype(int)]
        first, until = 0, -np.inf
        for place, now, width in zip(rows[:, 1:3], when, rows[:, 5], strict=True):
            cells = stood[tree.query_ball_point(place, ON + width / 4)]
            cells = cells[(cells[:, 4] <= now + 0.1) & (cells[:, 5] >= now + STAYS)]
            if not len(cells):
                break
            first, until = first + 1, max(until, np.median(cells[:, 5]))
        if 0 < first < len(rows) and until < when[first] + BEGAN:
            first = 0  # what stood there left as the piece went on: it is who walks
        if len(rows) - first >= 3 and not flickers(rows, when, stood, tree):
            kept.append(rows[first:])
    return kept


def flickers(rows, when, stood, tree):
    """Whether a piece hardly moves, by something that stood there before it came."""
    if np.linalg.norm(rows[:, 1:3] - rows[0, 1:3], axis=1).max() > MOVED:
        return False
    old = (stood[:, 4] < when[0] - STAYS) & (stood[:, 5] > when[-1])
    near = tree.query_ball_point(rows[:, 1:3], ON)
    return bool(np.mean([old[cells].any() for cells in near]) > 0.5)


# ---- pieces of one person's way


@dataclass(frozen=True, eq=False)
class Person:
    """One person's way, piece by piece.

    Attributes
    ----------
    rows : (n, 8) float array
        Measurements, see `Followed.pieces`.
    gaps : (G, 2) float array
        When each bridged gap begins and ends, in s.
    doubts : tuple of float
        When, in s, somebody else may have gone on as this person.
    """

    rows: np.ndarray
    gaps: np.ndarray
    doubts: tuple

    @property
    def went_behind(self):
        """Bool: whether something hid a part of them when they were seen last."""
        return bool((self.rows[-3:, 7] != 0).any())


def middles_of(rows, behind=None):
    """(n, 2) middles in m: the near side moved along the sight by pi/4 of the body's depth there.

    `behind` (n,) is half of that depth in m, half of the width when not given.
    """
    behind = rows[:, 5] / 2 if behind is None else np.where(rows[:, 5] > 0, behind, 0.0)
    return rows[:, 1:3] + (pi / 4 * behind)[:, None] * rows[:, 3:5]


def joined(pieces, t, area, way=None, motion=None):
    """Join pieces that only one person can have walked.

    Parameters
    ----------
    pieces : list of (n, 8) float arrays
        From `Followed.pieces`.
    t : (T,) float array
        Time of each scan in s.
    area : float
        Of the floor where somebody new may come into sight, in m^2.
    way : callable, optional
        way(place, other, most) is the length in m of the way between two places round the walls,
        `inf` if it is longer than `most`.
    motion : Motion, optional
        How people move.

    Returns
    -------
    list of Person
        In the order in which they came into sight.
    """
    motion = motion or Motion()
    pieces = apart_where_confused(pieces, t)
    ends = [ends_of(rows, t, motion) for rows in pieces]
    odds = np.zeros((len(pieces), len(pieces)))
    begins, stops = (np.array([each[k][0] for each in ends]) for k in (0, 1))
    gaps = begins - stops[:, None]
    for i, j in np.argwhere((gaps > -OVERLAP) & (gaps <= LONGEST_GAP) & (begins > begins[:, None])):
        last = ends[i][1] if gaps[i, j] > 0 else end_before(pieces[i], pieces[j], t, motion)
        if last is not None:
            odds[i, j] = log_odds(last, ends[j][0], area, way, motion)
    brief = np.array([np.ptp(t[rows[[0, -1], 0].astype(int)]) < BRIEF for rows in pieces])
    after, doubts = best_assignment(odds, brief)
    persons, begun = [], set(after.values())
    for i in range(len(pieces)):
        if i in begun:
            continue
        chain = [i]
        while chain[-1] in after:
            chain.append(after[chain[-1]])
        gaps = [(ends[a][1][0], ends[b][0][0]) for a, b in zip(chain[:-1], chain[1:], strict=True)]
        gaps = [gap for gap in gaps if gap[1] - gap[0] > PATIENCE]
        when = [ends[a][1][0] for a in chain if a in doubts[0]] + [ends[b][0][0] for b in chain if b in doubts[1]]
        parts = [before(pieces[a], pieces[b]) for a, b in zip(chain[:-1], chain[1:], strict=True)]
        rows = np.concatenate([*parts, pieces[chain[-1]]])
        persons.append(Person(rows, np.array(gaps).reshape(-1, 2), tuple(sorted(when))))
    return persons


def before(rows, later):
    """What of a piece is before another begins."""
    return rows[rows[:, 0] < later[0, 0]]


def end_before(rows, later, t, motion):
    """The end of a piece where another begins, see `ends_of`; None if there is hardly any before."""
    rows = before(rows, later)
    return ends_of(rows, t, motion)[1] if len(rows) >= 3 else None


def ends_of(rows, t, motion):
    """Time in s, place and velocity (2,) in m and m/s, covariance (2, 2), at both ends of a piece."""
    scans = rows[:, 0].astype(int)
    states = []
    for part in (slice(0, 12), slice(-12, None)):
        place, velocity = smooth(t[scans[part]], middles_of(rows[part]), motion, rows[part, 6])
        k = 0 if part.start == 0 else -1
        states.append(
            (
                t[scans[part]][k],
                place[k],
                velocity[k],
                end_covariance(rows[part, 6], t[scans[part]], motion),
            )
        )
    return states


def end_covariance(sd, t, motion):
    """Covariance (2, 2), in m and m/s, of the state at the end of a piece.

    That of a Kalman filter that has settled, of noise q with measurements of variance r every dt:
    the velocity has sqrt(2) q^(3/4) (r dt)^(1/4).
    """
    r, dt = np.mean(sd) ** 2, max(float(np.median(np.diff(t))), 1e-3)
    return np.diag([END_SD**2 * r, np.sqrt(2) * motion.noise**0.75 * (r * dt) ** 0.25])


def log_odds(last, first, area, way, motion):
    """Log odds that who was last seen is who comes into sight, 0 where it cannot be."""
    gap, offset = first[0] - last[0], first[1] - last[1]
    reach = REACH * gap + SLACK
    if hypot(*offset) > reach:
        return 0.0
    F, Q = motion.transition(gap)
    error = np.array([offset - gap * last[2], first[2] - last[2]])
    steady, abrupt = (normal(error, more * Q + F @ last[3] @ F.T + first[3]) for more in (1.0, ABRUPT))
    fit = np.logaddexp(log(1 - TURNS) + steady, log(TURNS) + abrupt)
    anew = -log(area) - 0.5 * np.sum(first[2] ** 2) - log(2 * pi)
    odds = fit - anew + PRIOR
    if odds <= 0 or (way is not None and way(last[1], first[1], most=reach) > reach):
        return 0.0
    return float(odds)


def normal(error, covariance):
    """Log density of an error (2, 2) of place and velocity whose axes share a covariance (2, 2)."""
    fit = np.sum(error * np.linalg.solve(covariance, error))
    return -0.5 * fit - log(np.linalg.det(covariance)) - 2 * log(2 * pi)


def best_assignment(odds, brief=None):
    """Which piece goes on as which, and where that is in doubt.

    Parameters
    ----------
    odds : (N, N) float array
        Log odds that piece i goes on as piece j, 0 where it cannot.
    brief : (N,) bool array, optional
        Pieces too brief to be a rival to another: none when not given.

    Returns
    -------
    after : dict of int to int
    doubts : (set, set) of int
        Pieces whose end, and whose beginning, may belong to another as well.

    Examples
    --------
    Two go in and two come out, and it may be either way round:

    >>> best_assignment(np.array([[0, 0, 5.0, 4.5], [0, 0, 4.5, 5.0], [0, 0, 0, 0], [0, 0, 0, 0]]))
    ({}, ({0, 1}, {2, 3}))
    """
    after, doubts = {}, (set(), set())
    n = len(odds)
    brief = np.zeros(n, bool) if brief is None else brief
    ends, begins = np.nonzero(odds)
    graph = scipy.sparse.coo_matrix((np.ones(len(ends)), (ends, n + begins)), (2 * n, 2 * n))
    _, part = scipy.sparse.csgraph.connected_components(graph, directed=False)
    for label in np.unique(part[ends]):
        rows, columns = np.flatnonzero(part[:n] == label), np.flatnonzero(part[n:] == label)
        values = odds[np.ix_(rows, columns)]
        chosen = scipy.optimize.linear_sum_assignment(values, maximize=True)
        total = values[chosen].sum()
        rivals_only = np.where(brief[rows][:, None] | brief[columns], 0.0, values)
        rivals_only[chosen] = values[chosen]
        for i, j in zip(*chosen, strict=True):
            if values[i, j] == 0:
                continue
            without = rivals_only.copy()
            without[i, j] = 0.0
            other = scipy.optimize.linear_sum_assignment(without, maximize=True)
            rivals = without[other].sum() > total - values[i, j] + 1e-9
            if rivals and total - without[other].sum() < DOUBTFUL:
                doubts[0].add(int(rows[i]))
                doubts[1].add(int(columns[j]))
            else:
                after[int(rows[i])] = int(columns[j])
    return after, doubts


def apart_where_confused(pieces, t):
    """Cut pieces where somebody is out of sight so near to another that the two may be confused."""
    cuts = [[] for _ in pieces]
    times = [t[rows[:, 0].astype(int)] for rows in pieces]
    places = [middles_of(rows) for rows in pieces]
    for a, when in enumerate(times):
        holes = np.flatnonzero(np.diff(when) > SHORT_GAP + np.median(np.diff(t)))
        for begin, end in zip(when[holes], when[holes + 1], strict=True):
            between = np.array([np.interp((begin + end) / 2, when, column) for column in places[a].T])
            for b, other in enumerate(times):
                if other[0] > end or other[-1] < begin:
                    continue
                there = (other >= begin) & (other <= end)
                if b == a or not there.any():
                    continue
                nearest = np.linalg.norm(places[b][there] - between, axis=1).min()
                if nearest < CLOSE:
                    cuts[a].append((begin, end))
                if nearest < BESIDE:
                    cuts[b].append((begin, end))
    parts = []
    for rows, when, holes in zip(pieces, times, cuts, strict=True):
        kept = np.ones(len(rows), bool)
        part = np.zeros(len(rows), int)
        for begin, end in holes:
            kept &= ~((when > begin) & (when < end))
            part += when >= end
        parts += [rows[kept & (part == k)] for k in np.unique(part)]
    return sorted((rows for rows in parts if len(rows) >= 3), key=lambda rows: rows[0, 0])


def person_of(person, t, motion=None):
    """A person's track: the middle of the body at every scan, smoothed.

    How deep a body is behind its near side depends on which way it faces. With half axes a across
    and b along the way it goes, at an angle phi to the sight,

        (w/2)^2 = a^2 cos^2 phi + b^2 sin^2 phi,       d^2 = a^2 sin^2 phi + b^2 cos^2 phi,

    a and b come from the widths w of all scans, and the middle is pi/4 d behind the near side.

    Parameters
    ----------
    person : Person
    t : (T,) float array
        Time of each scan in s.
    motion : Motion, optional
        How people move.

    Returns
    -------
    Track
    """
    rows = person.rows
    scans = rows[:, 0].astype(int)
    lived = t[scans[0] : scans[-1] + 1]
    seen = scans - scans[0]

    def smoothed(middles, sd):
        measurements, sds = np.full((len(lived), 2), np.nan), np.full(len(lived), SURE)
        measurements[seen], sds[seen] = middles, sd
        return measurements, *smooth_in_sight(lived, measurements, motion, sds)

    _, _, velocities = smoothed(middles_of(rows), rows[:, 6])
    measurements, positions, velocities = smoothed(*fitted_middles(rows, velocities[seen]))
    return Track(lived, positions, velocities, np.isnan(measurements[:, 0]), measurements)


def smooth_in_sight(t, measurements, motion, sd):
    """Positions and velocities (N, 2): smoothed while in sight, and between as `bridge` has it."""
    seen = np.flatnonzero(np.isfinite(measurements[:, 0]))
    parts = np.split(seen, np.flatnonzero(np.diff(t[seen]) > BRIDGED) + 1)
    positions, velocities = np.empty((2, len(t), 2))

    def lay(part):
        lived = slice(part[0], part[-1] + 1)
        positions[lived], velocities[lived] = smooth(t[lived], measurements[lived], motion, sd[lived])
        return t[lived], positions[lived].copy(), velocities[lived].copy()

    ends = []
    for k, part in enumerate(parts):
        sure = surely(part, t, sd, k > 0, k + 1 < len(parts), measurements)
        when, places, seen_so = lay(sure)
        slow = [np.hypot(*way_at(when, places, edge)) < SLOW for edge in (0, -1)]  # seen surely, they only stand
        begin, end = part[0] if slow[0] else sure[0], part[-1] if slow[1] else sure[-1]
        parts[k] = part[(part >= begin) & (part <= end)]
        when, places, _ = lay(parts[k])
        ends.append([way_at(when, places, edge) if slow[edge] else seen_so[edge] for edge in (0, -1)])
    speeds = np.concatenate([np.hypot(*velocities[part[0] : part[-1] + 1].T) for part in parts])
    pace = np.median(speeds[speeds > SLOW]) if (speeds > SLOW).any() else 0.0
    for k in range(len(parts) - 1):
        edge, hidden = [parts[k][-1], parts[k + 1][0]], slice(parts[k][-1] + 1, parts[k + 1][0])
        ways = np.array([ends[k][1], ends[k + 1][0]])
        positions[hidden], velocities[hidden] = bridge(t[edge], positions[edge], ways, t[hidden], pace)
    return positions, velocities


def way_at(t, places, end):
    """Velocity (2,) in m/s over the last moments of a stretch (n,), or the first for an end of 0."""
    there = np.abs(t - t[end]) <= MOMENT
    first, last = np.flatnonzero(there)[[0, -1]]
    return (places[last] - places[first]) / max(t[last] - t[first], 1e-9)


def surely(part, t, sd, first, last, places):
    """A stretch in sight (n,) without what is vague at its first or last moments, if much is left.

    Who stands there, half hidden, is seen vaguely for more than moments: that stays.
    """
    good = part[sd[part] < VAGUE]
    if not len(good) or t[good[-1]] - t[good[0]] < BRIDGED:
        return part
    before, after = part[part < good[0]], part[part > good[-1]]
    begin = good[0] if first and not stays(t[before], places[before]) else part[0]
    end = good[-1] if last and not stays(t[after], places[after]) else part[-1]
    return part[(part >= begin) & (part <= end)]


def stays(t, places):
    """Whether somebody was for more than a moment, and most of the time (n,), at one of the places (n, 2)."""
    seen = np.isfinite(places[:, 0])
    if not seen.any() or t[-1] - t[0] < PATIENCE:
        return False
    away = np.linalg.norm(places[seen] - np.median(places[seen], axis=0), axis=1)
    return bool(np.median(away) < SAME_PLACE / 2)


def bridge(t, places, velocities, when, pace):
    """The way of somebody out of sight, who goes on as fast as before.

    A cubic curve that leaves one place and reaches the other in the directions seen there, and
    swings out so far that its length is what somebody walks in the time.

    Parameters
    ----------
    t : (2,) float array
        When they were seen last and again, s.
    places, velocities : (2, 2) float arrays
        There and then, m and m/s.
    when : (M,) float array
        Times between, s.
    pace : float
        How fast they walk, m/s.

    Returns
    -------
    positions, velocities : (M, 2) float arrays
        m and m/s.

    Examples
    --------
    Who goes behind a box and comes back on the other side of it has walked round it:

    >>> there, ways = np.array([[0.0, 0.0], [0.0, 0.5]]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    >>> bridge(np.array([0.0, 3.0]), there, ways, [1.5], pace=1.0)[0].round(1)
    array([[1.4, 0.2]])
    """
    seconds, chord = t[1] - t[0], places[1] - places[0]
    speeds = np.hypot(*velocities.T)
    moving = speeds > SLOW
    straight = np.hypot(*chord)
    length = max(pace * seconds, straight) if moving.any() else straight
    directions = np.where(moving[:, None], velocities, chord)
    if moving.sum() == 1:  # who stands has no direction: straight from where the other one leads
        halfway = (0.4 * length / speeds[moving]) * velocities[moving]
        directions = np.where(moving[:, None], velocities, chord - halfway if moving[0] else chord + halfway)
    directions = directions / np.maximum(np.hypot(*directions.T), 1e-9)[:, None]
    if (directions @ chord > STRAIGHT_ON * straight).all():
        length = min(length, LOITERS * straight)  # who is late on a straight way has stood still
    share = np.linspace(0, 1, 101)[:, None]

    def curve(swing):
        leave, reach = (
            share * (1 - share) ** 2 * directions[0],
            share**2 * (share - 1) * directions[1],
        )
        return places[0] + (3 - 2 * share) * share**2 * chord + swing * (leave + reach)

    low, high = straight, MOST_SWING * length
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (middle, high) if arc_length(curve(middle))[-1] < length else (low, middle)
    points = curve(low)
    walked = arc_length(points)
    along = (np.asarray(when) - t[0]) / seconds * walked[-1]
    positions = at_arc_length(points, along)
    ahead = at_arc_length(points, along + 0.01) - at_arc_length(points, along - 0.01)
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    return positions, walked[-1] / seconds * ahead


def fitted_middles(rows, velocities):
    """Middles (n, 2) in m of one body in all scans, and their standard deviations (n,) in m."""
    across, depth = half_axes(rows, velocities)
    width, side = rows[:, 5] / 2, rows[:, 7]
    body = width >= NARROW / 2
    cut = (np.abs(side) == 1) & (across > width) & (np.median(rows[:, 5]) >= NARROW)
    # What is in sight of a disc, from its edge inwards, lies so deep before its middle on average.
    inner = np.clip(1 - 2 * width / np.maximum(across, 1e-3), -1, 1)
    arc = (pi / 2 - np.arcsin(inner) - inner * np.sqrt(1 - inner**2)) / (2 * (1 - inner).clip(1e-6))
    behind = np.where(cut, arc * depth, np.where(body, pi / 4 * depth, pi / 4 * width))
    leg = (np.abs(side) == 1) & ~body & (rows[:, 5] > 0) & (np.median(rows[:, 5]) < NARROW)
    hidden = np.where(cut, across - width, np.where(leg, OTHER_LEG, 0.0))
    aside = (side * hidden)[:, None] * np.column_stack([-rows[:, 4], rows[:, 3]])
    middles = rows[:, 1:3] + behind[:, None] * rows[:, 3:5] + aside
    return middles, np.where(cut, (SURE + rows[:, 6]) / 2, rows[:, 6])


def half_axes(rows, velocities):
    """(n,) half of the width across the sight, and of the depth along it, from the widths of all."""
    speed = np.maximum(np.hypot(*velocities.T), 1e-9)
    along = ((velocities * rows[:, 3:5]).sum(axis=1) / speed) ** 2  # cos^2 phi
    whole = (rows[:, 5] >= NARROW) & (rows[:, 7] == 0)
    if not whole.any():
        return rows[:, 5] / 2, rows[:, 5] / 2
    square = (rows[whole, 5] / 2) ** 2
    typical = np.median(square)
    moving = speed[whole] > 0.3
    forms = np.column_stack([along[whole], 1 - along[whole]])[moving]
    pull = 10.0  # as many widths of a round body
    a2, b2 = np.linalg.solve(forms.T @ forms + pull * np.eye(2), forms.T @ square[moving] + pull * typical)
    along = np.where(speed > 0.3, along, 0.5)
    depth, across = a2 * (1 - along) + b2 * along, a2 * along + b2 * (1 - along)
    return tuple(np.sqrt(np.clip(each, 0.05**2, (WIDEST / 2) ** 2)) for each in (across, depth))


def moving_speed(track):
    """How fast somebody walks.

    Parameters
    ----------
    track : Track

    Returns
    -------
    float
        Median speed in m/s while they move and are in sight, 0 for who never does.
    """
    moving = track.speeds[~track.occluded & (track.speeds > 0.25)]
    return float(np.median(moving)) if len(moving) else 0.0
