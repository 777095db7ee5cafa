"""What came of performing a task, and whether it was the task (Sec. III; Fig. 7, 10 and 12)."""

from dataclasses import dataclass
from math import nan

import numpy as np

from dollop.checks import (
    FARTHEST,
    Note,
    checked_array,
    checked_flag,
    checked_flags,
    checked_number,
    checked_record,
    checked_records,
    checked_whole,
    checked_wholes,
    put_in,
    trusted,
)
from dollop.robot.avoidance import PIONEER_RADIUS
from dollop.robot.guidance import STEP

__all__ = ["Run", "run_of"]

ASTRAY = 0.15
"""Distance in m by which a localisation that agrees with itself may be off."""
TOUCHED = 0.1
"""Room in m from all that is known, beyond which a robot touched something unknown."""
AT_ONCE = 1_000_000
"""Pairs of a place and a part of a line that are compared at once."""


@dataclass(frozen=True, eq=False)
class Run:
    """What came of performing a task (Sec. III).

    Attributes
    ----------
    t : (N,) float array
        In s from the start, one control period apart if the loop kept to it.
    poses : (N, 3) float array
        x, y in m, theta in rad, as the robot believed it.
    true_poses : (N, 3) float array
        As it was; the same for a robot that knows its pose. NaN where nobody knew.
    active : (N,) int array
        Index of the segment in force, within the way in force.
    localised : (N,) bool array
        Whether the robot trusted its pose.
    clearance : (N,) float array
        Distance in m between the edge of the robot, taken as a disc of its radius, and the nearest
        obstacle on its map, or that it has noticed by then; NaN where nobody knew where it was.
    finished : bool
        Whether it was the task: every segment handed over, every subgoal was reached, and the robot
        stood where the demonstrator did, as long.
    reason : str
        Why not; empty when finished.
    collisions : int
        How often the robot came to touch something: felt by a robot that can, else clearance
        falling below zero.
    kidnapped : (M,) float array
        Times in s.
    way : (N,) int array, optional
        Index of the way in force among the ways of the task; 0, the one most often shown, if not
        given.
    radius : float
        The robot's, in m.
    done : float
        Share of the way in force, by length, that lies behind the robot at the end: 1 if every
        segment handed over. NaN if nobody tells.
    reached : (K,) bool array
        Which subgoals of the way in force at the end the robot came to: within the distance at
        which a segment hands over, or as near as there is room; 0.15 m more is left to a
        localisation. Empty if nobody tells.
    farthest : float
        Largest distance in m of the robot from the way in force, once it has come to it within that
        distance after the start, and after every kidnapping or leap. NaN if it never did.
    waits : (W, 3) float array
        For each pause of the way in force: at which subgoal (k for the k-th, 0 for the start), how
        long it was shown in s, and how long the robot stood.
    notes : tuple of Note
        What has changed under the robot, and what else should be known of the run.

    Raises
    ------
    ValueError
        Arrays that are not of one length, or of no period at all; what is no number, flag or text, or
        is not finite before the last period, in which the robot may have lost its pose.
    """

    t: np.ndarray
    poses: np.ndarray
    true_poses: np.ndarray
    active: np.ndarray
    localised: np.ndarray
    clearance: np.ndarray
    finished: bool
    reason: str
    collisions: int
    kidnapped: np.ndarray
    way: np.ndarray = None
    radius: float = PIONEER_RADIUS
    done: float = nan
    reached: np.ndarray = ()
    farthest: float = nan
    waits: np.ndarray = None
    notes: tuple = ()

    def __post_init__(self):
        t = checked_array("t", self.t, "N")
        if not len(t):
            raise ValueError("a run must have a period, got none")
        way = np.zeros(len(t)) if self.way is None else self.way
        waits = np.zeros((0, 3)) if self.waits is None else self.waits
        poses = checked_array("poses", self.poses, len(t), 3, finite=False)
        localised = checked_flags("localised", self.localised, len(t))
        checked_array("poses before the last", poses[:-1][localised[:-1]], "N", 3)
        put_in(
            self,
            t=t,
            poses=poses,
            true_poses=checked_array("true_poses", self.true_poses, len(t), 3, finite=False),
            active=checked_wholes("active", self.active, len(t)),
            localised=localised,
            clearance=checked_array("clearance", self.clearance, len(t), finite=False),
            finished=checked_flag("finished", self.finished),
            reason=checked_record("reason", self.reason, str),
            collisions=checked_whole("collisions", self.collisions),
            kidnapped=checked_array("kidnapped", self.kidnapped, "M", least=0),
            way=checked_wholes("way", way, len(t)),
            radius=checked_number("radius", self.radius, 0),
            reached=checked_flags("reached", self.reached, "K"),
            waits=checked_array("waits", waits, "W", 3, least=0),
            notes=checked_records("notes", self.notes, Note),
        )
        put_in(
            self,
            done=_or_none("done", self.done, 1.0),
            farthest=_or_none("farthest", self.farthest, FARTHEST),
        )

    def __repr__(self):
        end = "finished" if self.finished else self.reason
        touched = f"{self.collisions} collisions, least clearance {self.least_clearance:.2f} m"
        return f"Run of {self.t[-1]:.1f} s{told_ways(self)}: {end}; {touched}"

    @property
    def least_clearance(self):
        """Float: the least `clearance` in m where the robot's place was known; NaN if it never was."""
        known = self.clearance[np.isfinite(self.clearance)]
        return float(known.min()) if len(known) else nan

    @property
    def trusted(self):
        """Whether no note puts the run in doubt."""
        return trusted(self.notes)

    @property
    def verdict(self):
        """dict: what came of it, in plain numbers and text, for JSON; None where nobody knows."""
        return {
            "finished": self.finished,
            "reason": self.reason,
            "seconds": float(self.t[-1]),
            "done": _plain(self.done),
            "subgoals": len(self.reached),
            "reached": int(self.reached.sum()),
            "farthest": _plain(self.farthest),
            "waits": [[int(k), shown, stood] for k, shown, stood in self.waits.tolist()],
            "radius": self.radius,
            "least_clearance": _plain(self.least_clearance),
            "collisions": self.collisions,
            "kidnapped": self.kidnapped.tolist(),
            "notes": [[note.kind, note.text, note.doubt] for note in self.notes],
        }


def _or_none(name, value, most):
    """A number from 0 to `most`, or NaN."""
    return nan if isinstance(value, float) and value != value else checked_number(name, value, 0, most)


def _plain(number):
    """A number, or None for one that is none."""
    return number if np.isfinite(number) else None


def told_ways(run):
    """Which ways a run was on and from when in s, where it was not the usual one all the time."""
    if not run.way.any():
        return ""
    changes = np.flatnonzero(np.diff(run.way)) + 1
    later = (f", from {run.t[i]:.1f} s on way {run.way[i]}" for i in changes)
    return f" on way {run.way[0]}{''.join(later)}"


def run_of(rows, t, clearance, keeper, robot, reason, kidnapped, notes):
    """The run that came of the rows that a controller kept.

    Parameters
    ----------
    rows : sequence of N tuples
        Of 10 numbers: pose (3) and true pose (3) in m and rad, segment, way, whether localised, and
        whether touching something (None: it cannot feel).
    t, clearance : (N,) float arrays
        In s and m.
    keeper : WayKeeper
        As it was at the end.
    robot : object
        With `radius`.
    reason : str
        Why it gave up; empty if every segment handed over.
    kidnapped : sequence of float
        In s.
    notes : sequence of Note
        What the controller has to say.

    Returns
    -------
    Run
    """
    table = np.array(rows, dtype=float)
    poses, true_poses, touching = table[:, :3], table[:, 3:6], table[:, 9]
    active, way = table[:, 6:8].astype(int).T
    contact = np.where(np.isnan(touching), clearance < 0, touching > 0)
    starts = np.flatnonzero(contact & ~np.append(False, contact[:-1]))
    believed = np.where(table[:, 8:9] > 0, poses, nan)
    places = np.where(np.isfinite(true_poses), true_poses, believed)[:, :2]
    driven = Driven.of(places, active, way, t, keeper)
    waits = np.reshape(keeper.waits(), (-1, 3))
    slack = 0.0 if np.array_equal(poses, true_poses, equal_nan=True) else ASTRAY
    apart = driven.to_subgoals()
    reached = apart <= keeper.needs() + slack
    reason = reason or driven.missed(reached, apart) or _cut_short(waits, robot.period)
    farthest = driven.farthest(keeper.rules.reach)
    notes = (
        *notes,
        *_aside(farthest, keeper.known),
        *_unknown(table, starts, clearance),
        *_lost(table[:, 8] > 0, t),
        *driven.notes(t, kidnapped),
    )
    return Run(
        t, poses, true_poses, active, table[:, 8] > 0, clearance, not reason, reason, len(starts), kidnapped, way,
        robot.radius, driven.done(keeper.done), reached, farthest, waits, notes,
    )  # fmt: skip


def _unknown(table, starts, clearance):
    """A note of where the robot touched what its map does not have, if it did."""
    there = [i for i in starts if clearance[i] > TOUCHED]
    if there:
        x, y = table[there[0], 3:5]
        text = f"it touched something at ({x:.2f}, {y:.2f}), where its map has {clearance[there[0]]:.2f} m of room"
        yield Note("unknown", text)


def _aside(farthest, obstacles):
    """A note of how far off the way it was led, if by more than a thing as wide as itself needs."""
    most = 2 * obstacles.radius + obstacles.rules.influence
    if farthest > most:
        rule = f"a thing to go round leads no more than {most:.2f} m off"
        yield Note("aside", f"it was up to {farthest:.2f} m off the way, which is closed there: {rule}")


def _lost(localised, t):
    """A note of how long the robot did not know where it was, if it did not."""
    lost = np.flatnonzero(~localised)
    if len(lost):
        seconds = np.diff(t, append=t[-1])[lost].sum()
        told = f"it did not know where it was for {seconds:.1f} s, first at {t[lost[0]]:.1f} s"
        yield Note("lost", told, doubt=False)


def _cut_short(waits, period):
    """Why the waits (W, 3) were not those that were shown; empty if they were."""
    for place, shown, stood in waits:
        if stood < shown - period and (place or stood):
            where = f"subgoal {place:.0f}" if place else "the start"
            return f"it stood {stood:.1f} s at {where} where {shown:.1f} s were shown"
    return ""


@dataclass(frozen=True, eq=False)
class Driven:
    """Where along its ways a robot was.

    Attributes
    ----------
    places : (N, 2) float array
        Of the robot, in m.
    active, way : (N,) int arrays
        Segment and way in force.
    along, apart : (N,) float arrays
        Way in m from the start to the nearest place on the segment in force, and the distance from it or
        from the segment before.
    leaps : (N,) bool array
        Whether the robot was put there: at the start, and wherever it could not have driven.
    lines : dict of int to list of Line
        Of the segments of each way that was in force.
    """

    places: np.ndarray
    active: np.ndarray
    way: np.ndarray
    along: np.ndarray
    apart: np.ndarray
    leaps: np.ndarray
    lines: dict

    @classmethod
    def of(cls, places, active, way, t, keeper):
        """From places (N, 2) in m, and segments and ways (N,) in force at times (N,) in s."""
        lines = keeper.lines
        along, apart = np.full((2, len(places)), nan)
        for w, k in set(zip(way.tolist(), active.tolist(), strict=True)):
            rows = np.flatnonzero((way == w) & (active == k) & np.isfinite(places[:, 0]))
            begun = sum(line.way[-1] for line in lines[w][:k])
            along[rows], apart[rows] = _beside(places[rows], lines[w][k])
            along[rows] += begun
            rows = rows[apart[rows] > STEP]
            if k and len(rows):  # it may have handed over before its subgoal
                apart[rows] = np.minimum(apart[rows], _beside(places[rows], lines[w][k - 1])[1])
        steps = np.hypot(*np.diff(places, axis=0).T)
        farthest = np.maximum(keeper.supervisor.jump, 2 * keeper.supervisor.limits.speed * np.diff(t))
        return cls(
            places,
            active,
            way,
            along,
            apart,
            np.append(True, ~(steps <= farthest)),
            lines,
        )

    def length(self, w):
        """Of a way, in m."""
        return sum(line.way[-1] for line in self.lines[w])

    def done(self, finished):
        """Share of the way in force that lies behind the robot at the end."""
        if finished:
            return 1.0
        known = np.flatnonzero(np.isfinite(self.along) & (self.way == self.way[-1]))
        return min(self.along[known[-1]] / max(self.length(self.way[-1]), STEP), 1.0) if len(known) else 0.0

    def farthest(self, enough):
        """Largest distance in m from the way, from where the robot came within `enough` of it on."""
        stretch = np.cumsum(self.leaps | (np.diff(self.way, prepend=self.way[0]) != 0))
        came = np.where(self.apart <= enough, np.arange(len(stretch)), len(stretch))
        first = np.full(stretch[-1] + 1, len(stretch))
        np.minimum.at(first, stretch, came)
        on = self.apart[np.arange(len(stretch)) >= first[stretch]]
        return float(np.nanmax(on)) if np.isfinite(on).any() else nan

    def to_subgoals(self):
        """Least distance (K,) in m to each subgoal of the last way, while it led there or just had."""
        w = self.way[-1]
        least = np.full(len(self.lines[w]), np.inf)
        for k, line in enumerate(self.lines[w]):
            rows = (self.way == w) & ((self.active == k) | (self.active == k + 1))
            away = np.hypot(*(self.places[rows] - line.places[-1]).T)
            least[k] = np.nanmin(away, initial=np.inf)
        return least

    def missed(self, reached, least):
        """Which subgoal of the way at the end was handed over without being reached, if one was."""
        w = self.way[-1]
        since = np.flatnonzero(self.way != w)
        first = self.active[since[-1] + 1] if len(since) else 0
        for k in range(first, len(reached)):
            if not reached[k]:
                return f"subgoal {k + 1} was not reached: {least[k]:.2f} m at the nearest"
        return ""

    def notes(self, t, kidnapped):
        """Where the robot changed ways or leapt, and what it did not drive, put farther along."""
        steps = np.append(0.0, np.hypot(*np.diff(self.places, axis=0).T))
        told = (np.abs(np.subtract.outer(t, kidnapped)) <= 1.5 * np.diff(t[:2]).sum()).any(axis=1)
        leaps = np.flatnonzero(self.leaps & (steps > 0) & ~told)
        if len(leaps):
            first = f"by {steps[leaps[0]]:.2f} m at {t[leaps[0]]:.1f} s"
            rule = "carried off, or localised anew"
            times = f", and {len(leaps) - 1} times more" if len(leaps) > 1 else ""
            yield Note("leap", f"its pose leapt {first}{times}: {rule}", doubt=False)
        for i in np.flatnonzero(np.diff(self.way)) + 1:
            x, y = self.places[i]
            yield Note(
                "way",
                f"it went on along way {self.way[i]} at ({x:.2f}, {y:.2f}), {t[i]:.1f} s",
                doubt=False,
            )
        same = np.diff(self.way, prepend=-1) == 0
        skipped = np.diff(self.along, prepend=nan)[self.leaps & same]
        skipped = skipped[skipped > STEP].sum()
        if skipped > 0:
            yield Note(
                "skipped",
                f"{skipped:.1f} m of the way were not driven: it was put farther along",
                doubt=False,
            )


def _beside(places, line):
    """Way in m to the nearest place of a line, for places (N, 2) in m, and the distances (N,) from it.

    On the edges that meet in the nearest of its own places: these lie closely.
    """
    (x, y), last = line.places.T, len(line.places) - 1
    along, apart = [], []
    for part in np.array_split(places, 1 + len(places) * len(x) // AT_ONCE):
        nearest = ((part[:, :1] - x) ** 2 + (part[:, 1:] - y) ** 2).argmin(axis=1)
        sides = [_on_edge(part, line, np.clip(nearest + side, 0, last - 1)) for side in (-1, 0)]
        closer = sides[1][1] < sides[0][1]
        along.append(np.where(closer, sides[1][0], sides[0][0]))
        apart.append(np.where(closer, sides[1][1], sides[0][1]))
    return np.concatenate(along), np.concatenate(apart)


def _on_edge(places, line, at):
    """Way in m to the place nearest to each of some (N, 2), on an edge each (N,), and the distances."""
    tails, steps = line.places[at], line.places[at + 1] - line.places[at]
    offsets = places - tails
    share = np.clip((offsets * steps).sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-18), 0, 1)
    away = offsets - share[:, None] * steps
    return line.way[at] + share * (line.way[at + 1] - line.way[at]), np.hypot(*away.T)
