"""Observing the user: from a log and a background map to people, user and environment (Fig. 4)."""

from dataclasses import dataclass

import numpy as np
import scipy

from dollop.checks import (
    FARTHEST,
    LATEST,
    Note,
    check_choice,
    check_positive,
    checked_array,
    checked_number,
    checked_positions,
    checked_record,
    checked_records,
    checked_whole,
    put_in,
    shortened,
    trusted,
)
from dollop.environment import Environment, Seen, standing_boxes
from dollop.foreground import (
    ForegroundGrid,
    SeenFloor,
    StandingCells,
    bounding_boxes,
    endpoints,
    foreground_mask,
    seen_free,
    seen_through,
    surface_points,
)
from dollop.gridmap import OccupancyGrid, flat_cells, in_cells
from dollop.laser import FULL_TURN, LaserLog
from dollop.people import (
    BRIDGED,
    MOVED,
    OVERLAP,
    REACH,
    SAME_PLACE,
    SLACK,
    Followed,
    candidates,
    joined,
    moving_speed,
    off_standing,
    person_of,
    seen_badly,
    stood,
    together,
)
from dollop.tracking import Motion, Track, Tracker, identify_user, track_objects, user_track
from dollop.trajectory import arc_length

__all__ = [
    "METHODS",
    "STATIC_EVERY",
    "Observation",
    "Observer",
    "foreground_hits",
    "observe",
    "static_boxes",
]

STATIC_EVERY = 5
"""The paper's slow grid looks at every fifth scan: what is static is still there then."""
METHODS = "people", "paper"
"""How somebody is observed: as people, or as the paper has it, every foreground object alike."""
SLIDES = 0.6
"""m/s up to which who stood before and stands afterwards may be an object that was moved."""
SHORTEST_LOOK = 1.5
"""s of scans that it takes to know what stands."""
MOVED_WITHIN = 5.0
"""s between the end of an object here and its beginning there for it to be the same."""
STANDING_REACH = 0.5
"""m from the middle of somebody within which readings are theirs."""
RESOLUTIONS = 0.005, 1.0
"""m: cells of a map that can be observed on."""
LONGEST_PAUSE = 1.0
"""s without a scan, from which on somebody may be lost."""
SAMPLE = 400
"""Cells of the map that are looked at to see whether it fits."""
MOST_THROUGH, OFF_MAP = 0.08, 0.10
"""Share of the background in view that beams may go through, and of the user's places that may be where
the map has no floor."""
MOST_MOVING, SLOWEST = 0.25, 0.35
"""Share of the readings that are of nothing that stands, and s between scans, beyond which nothing
is sure."""
FOREGROUND = 1
NOBODY_THERE = 1.5
"""m from the place named beyond which nobody is meant."""
LONG_ENOUGH = 0.4
"""Share of the longest way that the user has walked at least."""
LEFT_OUT = 0.3
"""m that somebody who may be the user has walked to be missed."""
LONGEST_BRIDGE, LEAST_SEEN, TOP_SPEED = 4.5, 0.6, 3.0
"""s, share and m/s beyond which a walk is in doubt."""
LEFT_AFTER, LEFT_SHARE, WALKS_ON = 2.0, 0.25, 0.3
"""s before the end of the scans, and share of the time in which they were followed, from which on somebody
is missed who went so fast in m/s when seen last."""
BESIDE_USER = 0.6
"""m from the user within which nobody else begins or ends."""
MAY_COME_BACK = 15.0
"""s after which nobody is taken for the same."""
ALIKE = 0.15
"""m/s by which the user must be faster than others."""


@dataclass(frozen=True)
class Observation:
    """What Dollop has seen (Sec. II).

    Attributes
    ----------
    tracks : tuple of Track
        Everything that moved, people or not; by the paper's method every foreground object.
    user : Track or None
        The user's trajectory, joined over losses and smoothed; None if nobody moved.
    environment : Environment
        Boxes of the static foreground objects.
    losses : int
        How often the user was lost and found again.
    people : tuple of Track
        Everybody who walked, in the order in which they came into sight, each as far as it is surely
        the same person.
    notes : tuple of Note
        What may be wrong, and why.

    Raises
    ------
    ValueError
        For a field that is not of its kind.
    """

    tracks: tuple
    user: Track
    environment: Environment
    losses: int
    people: tuple = ()
    notes: tuple = ()

    def __post_init__(self):
        if self.user is not None:
            checked_record("user", self.user, Track)
        put_in(
            self,
            tracks=checked_records("tracks", self.tracks, Track),
            environment=checked_record("environment", self.environment, Environment),
            losses=checked_whole("losses", self.losses),
            people=checked_records("people", self.people, Track),
            notes=checked_records("notes", self.notes, Note),
        )

    @property
    def trusted(self):
        """Bool: whether no note puts user, walk or objects in doubt."""
        return trusted(self.notes)

    def __repr__(self):
        return f"Observation of {len(self.tracks)} tracks; user: {self.user}; {self.environment}"


def observe(log, background, user="fastest", method="people", background_radius=0.20, min_area=0.01, **paper):
    """Observe a demonstration with the laser (Sec. II).

    Parameters
    ----------
    log : LaserLog
        The scans.
    background : OccupancyGrid
        The background occupancy grid map of the workspace; it must cover the scans.
    user : str, (x, y) or int
        Who shows the task: "fastest", of the whole recording; who was nearest to a place in m when
        first seen; or an index into `Observation.people`.
    method : str
        "people", or "paper": every foreground object is tracked alike, its position is the centroid
        of a blob of the foreground grid, and the user is the fastest of the moment.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).
    min_area : float
        Smallest foreground object in m^2 (Sec. II: 100 square centimetres).
    **paper
        With the paper's method more of `observe_as_paper`.

    Returns
    -------
    Observation

    Raises
    ------
    ValueError
        If the map does not cover the scans, nobody was at the place named, or a parameter is out of
        its range.
    """
    check_choice("method", method, METHODS)
    checked_record("log", log, LaserLog)
    if method == "paper":
        return observe_as_paper(log, background, background_radius, min_area=min_area, **paper)
    if paper:
        raise ValueError(f'{shortened(", ".join(paper), 99)} must come with method="paper"')
    observer = Observer(background, log.angles, user, background_radius, min_area)
    observer._take_all(log.t, log.ranges, log.poses)
    return observer.observation(log.notes)


class Observer:
    """Observing scan by scan, in bounded memory (Sec. II).

    Of the scans only what may be somebody's way is kept: some 60 bytes a scan for each who walks.

    Parameters
    ----------
    background : OccupancyGrid
        The background occupancy grid map of the workspace.
    angles : (B,) array_like
        Bearing of each beam in the sensor's frame in rad, increasing.
    user, background_radius, min_area
        As for `observe`.

    Raises
    ------
    ValueError
        For a map in which nothing is known, or a parameter out of its range.
    """

    def __init__(self, background, angles, user="fastest", background_radius=0.20, min_area=0.01):
        checked_record("background", background, OccupancyGrid)
        checked_number("the background's resolution", background.resolution, *RESOLUTIONS)
        check_positive("background_radius", checked_number("background_radius", background_radius))
        check_positive("min_area", checked_number("min_area", min_area), or_zero=True)
        self.background, self.user, self.min_area = background, checked_user(user), min_area
        angles = checked_array("angles", angles, "B", least=-FULL_TURN, most=FULL_TURN)
        if not angles.size or not (np.diff(angles) > 0).all() or np.ptp(angles) > FULL_TURN:
            rule = "angles must increase, from one beam on, over at most a full turn"
            ends = f"{angles[0]:g} to {angles[-1]:g} rad" if angles.size else "none"
            raise ValueError(f"{rule}, got {ends}")
        self._middle = (angles[0] + angles[-1]) / 2  # bearings are counted from the middle of view
        self.angles = angles - self._middle
        self.step_angle = float(np.median(np.diff(angles))) if len(angles) > 1 else np.radians(1.0)
        self._directions = np.cos(self.angles), np.sin(self.angles)
        self._class = reading_classes(background, background_radius)
        self.motion, self.followed = Motion(), Followed()
        self.standing, self.floor = StandingCells(background), SeenFloor(background)
        occupied = background.cell_centres(np.argwhere(background.occupied))
        self._occupied = occupied[:: 1 + len(occupied) // SAMPLE]
        self.returned = self.outside = self.later = self.moving = self.through = self.in_view = 0
        self._scan = None

    def step(self, t, ranges, pose):
        """Take one scan.

        Parameters
        ----------
        t : float
            Time in s, later than the last.
        ranges : (B,) array_like
            In m, `inf` where nothing came back.
        pose : (3,) array_like
            Sensor in the world: x, y in m, theta in rad.

        Raises
        ------
        ValueError
            For a scan that is older than the last, or numbers that are none.
        """
        ranges = checked_array("ranges", ranges, len(self.angles), finite=False)
        farthest = ranges.max(where=np.isfinite(ranges), initial=0)
        if farthest > FARTHEST:
            raise ValueError(f"a range must be within {FARTHEST:g} m, or inf, got {farthest:g}")
        if not (ranges >= 0).all():
            raise ValueError(f"a range must not be negative or NaN, got {ranges[~(ranges >= 0)][0]}")
        pose, t = checked_positions("pose", pose, 3), checked_number("t", t, -LATEST, LATEST)
        if self.followed.t and t <= self.followed.t[-1]:
            raise ValueError(f"t must be later than the last scan's {self.followed.t[-1]}, got {t}")
        self._take_all(np.array([t]), ranges[None], pose[None])

    def _take_all(self, t, ranges, poses):
        """Take several scans, as `step` takes one: times (T,), ranges (T, B), poses (T, 3)."""
        poses = np.column_stack([poses[:, :2], poses[:, 2] + self._middle])
        for some in np.array_split(np.arange(len(t)), 1 + ranges.size // 50_000):
            self._take(t[some], ranges[some], poses[some])

    def _take(self, t, ranges, poses):
        """A few scans at once: what does not depend on those before, and then one by one."""
        scan, beam, x, y, cells = self._readings(ranges, poses)
        bounds = np.searchsorted(scan, np.arange(len(t) + 1)).tolist()
        points = np.column_stack([x, y])
        count = np.isfinite(ranges).sum(axis=1).tolist()
        for i, now in enumerate(t.tolist()):
            part = slice(bounds[i], bounds[i + 1])
            if self.followed.t and now - self.followed.t[0] > SHORTEST_LOOK:
                self.later += count[i]
                self.moving += int((self.standing.known_since[cells[part]] == np.inf).sum())
            here = cells[part]
            self.followed.step(now, self._candidates(beam[part], x[part], y[part], here, ranges[i], poses[i]))
            if self.standing.due(now):
                self.standing.look(now, here, points[part], poses[i], self.angles, ranges[i])
            if self.floor.due(now):
                self.floor.look(now, poses[i], self.angles, ranges[i])
                through, in_view = seen_through(self._occupied, poses[i], self.angles, ranges[i])
                self.through, self.in_view = self.through + through, self.in_view + in_view
        self._scan = poses[-1], self.angles, ranges[-1]

    def _readings(self, ranges, poses):
        """Foreground readings: scan, beam, x, y in m and flat cell of each, all (n,)."""
        returned = np.isfinite(ranges)
        ranges = np.where(returned, ranges, np.nan)
        cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        ahead, left = self._directions
        x = poses[:, :1] + ranges * (cos * ahead - sin * left)
        y = poses[:, 1:2] + ranges * (sin * ahead + cos * left)
        column, row = in_cells(x, y, self.background.origin, self.background.resolution)
        height, width = self.background.occupancy.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)  # nan and inf are not
        column, row = (
            np.where(inside, column, 0).astype(np.intp),
            np.where(inside, row, 0).astype(np.intp),
        )
        cells = row * width + column
        kind = np.where(inside, self._class[cells], 0)
        self.returned += int(returned.sum())
        self.outside += int((returned & ~inside).sum())
        scan, beam = np.nonzero(kind == FOREGROUND)
        return scan, beam, x[scan, beam], y[scan, beam], cells[scan, beam]

    def _candidates(self, beam, x, y, cells, ranges, pose):
        """Who may be a person: readings of what does not stand, or of who came to stand there."""
        since = self.standing.known_since[cells]
        new = since == np.inf
        for piece in self.followed.standing():
            near = np.hypot(x - piece.x, y - piece.y) < STANDING_REACH
            new |= near & (since >= piece.arrived - 0.5)
        return candidates(beam[new], x[new], y[new], ranges, pose, self.step_angle)

    def observation(self, notes=()):
        """What has been seen so far.

        Parameters
        ----------
        notes : tuple of Note
            Of the log.

        Returns
        -------
        Observation

        Raises
        ------
        ValueError
            If the map does not cover the scans, or nobody was at the place that was named.
        """
        if not self.followed.t:
            raise ValueError("an observation needs a scan, got none")
        self._check_map()
        t = np.array(self.followed.t)
        area = float(np.clip(self.background.free.sum() * self.background.resolution**2, 5.0, 200.0))
        stands, gone = self.standing.standing(), self.standing.stood()
        pieces = off_standing(self.followed.pieces(), np.vstack([stands, gone]), t)
        standing = stood(gone, stands, pieces, t, self.step_angle)
        pieces = sorted(standing + pieces, key=lambda each: each[0, 0])
        persons = joined(pieces, t, area, self.background.way_length, self.motion)
        tracks = [person_of(each, t, self.motion) for each in persons]
        walked = [k for k, track in enumerate(tracks) if walks(track)]
        people = tuple(tracks[k] for k in walked)
        chosen = choose(people, self.user)
        user = None if chosen is None else people[chosen]
        who = None if chosen is None else persons[walked[chosen]]
        environment, groups, in_part = self._environment(stands, people, user)
        notes = (
            *notes,
            *self._map_notes(),
            *self._object_notes(environment, groups, stands, gone, people),
        )
        notes += tuple(map(part_note, environment.centres[in_part]))
        if user is not None:
            notes += tuple(user_notes(user, who, people, tracks, self.user, self.background, t[-1]))
        losses = 0 if who is None else len(who.gaps)
        return Observation(tuple(tracks), user, environment, losses, people, notes)

    def _check_map(self):
        """The map must cover the scans."""
        if self.outside > 0.1 * self.returned:
            share = f"{self.outside} of {self.returned} readings ({100 * self.outside / self.returned:.0f} %)"
            raise ValueError(f"the background map must cover the scans: {share} lie outside it")

    def _map_notes(self):
        """Whether the map explains the scans, and whether they are often enough."""
        yield from _clock_notes(self.followed.t)
        share = self.through / max(self.in_view, 1)
        if share > MOST_THROUGH:
            text = f"beams go through {share:.0%} of what the map has in view (at most {MOST_THROUGH:.0%})"
            yield Note("map", f"{text}: it does not fit the scans, or the poses are wrong")
        share = self.moving / max(self.later, 1)
        if share > MOST_MOVING:
            text = f"{share:.0%} of the readings are on nothing that stands or that the map knows"
            reason = "the map does not fit, or the laser moves and the poses do not say so"
            yield Note("map", f"{text} (at most {MOST_MOVING:.0%}): {reason}")

    def _environment(self, stands, people, user):
        """The objects that stand at the end, the cells (S_k, 6) of each, and which are seen in part."""
        for track in people:
            if track is user or not slides(track):
                stands = stands[~stood_by(track, stands, self.followed.t[-1])]
        found = standing_boxes(stands[:, :2], stands[:, 2:4], self.step_angle, self._scan, self.min_area)
        boxes, assumed, in_part, groups = found
        seen = Seen(self.floor.grid(), self.floor.origin, self.floor.resolution)
        return Environment(boxes, seen, assumed), [stands[rows] for rows in groups], in_part

    def _object_notes(self, environment, groups, stands, gone, people):
        """What came, went or moved meanwhile, and what was seen too shortly or in part."""
        begin, now = self.followed.t[0], self.followed.t[-1]
        if now - begin < SHORTEST_LOOK:
            text = f"the scans last {now - begin:.1f} s: what stands is known after {SHORTEST_LOOK:g} s"
            yield Note("short look", text)
        came = {k: when for k, rows in enumerate(groups) if (when := self._came(rows, gone)) > begin + SHORTEST_LOOK}
        for place, box, when in went(gone, stands, people, self.min_area):
            near = [k for k in came if abs(came[k] - when) < MOVED_WITHIN]
            to = min(near, key=lambda k: unlike(environment.boxes[k], box), default=None)
            what = f"an object at ({place[0]:.2f}, {place[1]:.2f})"
            if to is None:
                yield Note("object went", f"{what} was gone after {when - begin:.1f} s")
            else:
                x, y = environment.centres[to]
                yield Note(
                    "object moved",
                    f"{what} was moved to ({x:.2f}, {y:.2f}) {when - begin:.1f} s after the start",
                )
                del came[to]
        for k, when in came.items():
            x, y = environment.centres[k]
            yield Note(
                "object came",
                f"an object stands at ({x:.2f}, {y:.2f}) since {when - begin:.1f} s after the start",
            )

    def _came(self, cells, gone):
        """Since when an object of cells (S, 6) stands whose place had been seen free; else the beginning."""
        places, since = cells[:, :2], np.quantile(cells[:, 4], 0.1)
        before = nearest(gone[:, :2], places) < SAME_PLACE
        if np.median(self.floor.first_at(places)) < since - 0.5 and not (gone[before, 4] < since - 0.5).any():
            return float(since)
        return self.followed.t[0]


def _clock_notes(t):
    """Whether scans at times (T,) in s are often enough, and none is far from the one before."""
    period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    if period > SLOWEST:
        text = f"a scan comes every {period:.2g} s: people are followed up to {SLOWEST:g} s"
        yield Note("slow scans", text)
    pause = float(np.diff(t).max(initial=0.0))
    if pause > max(LONGEST_PAUSE, 3 * period):
        yield Note("pause", f"there is no scan for {pause:.4g} s: nobody is followed through that")


def part_note(place):
    """That an object at a place (2,) is seen in part."""
    where = f"the object at ({place[0]:.2f}, {place[1]:.2f})"
    return Note("in part", f"{where} goes on behind something, or out of view: it may be larger", False)


def stood_by(track, stands, now):
    """Which cells (S, 6) stand only because somebody stood there, and went at most a moment ago."""
    since, until = stands[:, 4], np.minimum(stands[:, 5], now)
    near = np.ones(len(stands), bool)
    for when in (since + 0.5, until):
        there = np.column_stack([np.interp(when, track.t, axis) for axis in track.positions.T])
        near &= np.linalg.norm(there - stands[:, :2], axis=1) < STANDING_REACH
    stays = track.speeds[-1] < WALKS_ON  # who stood there when seen last does so still
    return near & (since >= track.t[0] - 0.5) & ((until <= track.t[-1] + 1.0) | stays)


def slides(track):
    """Whether somebody may be an object that is moved: it stands, goes slowly straight on, and stands."""
    still = track.speeds < 0.15
    at_ends = still[track.t < track.t[0] + 1.0].mean() > 0.5 and still[track.t > track.t[-1] - 1.0].mean() > 0.5
    way, straight = (
        arc_length(track.positions)[-1],
        np.linalg.norm(track.positions[-1] - track.positions[0]),
    )
    return bool(at_ends and moving_speed(track) < SLIDES and straight > 0.8 * way)


def nearest(points, others):
    """(M,) distance in m of each point (M, 2) to the nearest of others (L, 2), `inf` if there is none."""
    if not len(others):
        return np.full(len(points), np.inf)
    return scipy.spatial.cKDTree(others).query(points)[0].reshape(-1)


def went(gone, stands, people, min_area):
    """Objects that stood and went: place (2,) in m, box (4,) in m, and when in s each was last seen."""
    found = []
    for group in together(gone):
        low, high = group[:, :2].min(axis=0), group[:, :2].max(axis=0)
        begin, end = group[:, 4].min(), float(np.median(group[:, 5]))
        wide = max(high - low)
        if end - begin < SHORTEST_LOOK or len(group) < 3 or wide**2 < min_area:
            continue
        if seen_badly(group, stands):
            continue
        place = (low + high) / 2
        if not any(was_there(track, place, begin, end) for track in people):
            found.append((place, np.concatenate([low, high]), end))
    return found


def was_there(track, place, begin, end):
    """Whether somebody stood at a place most of the time, or of its last two seconds."""
    for first in (begin, max(begin, end - 2.0)):
        when = (track.t > first) & (track.t < end)
        near = np.linalg.norm(track.positions[when] - place, axis=1) < STANDING_REACH
        if near.sum() > 0.6 * max(np.count_nonzero(when), 1):
            return True
    return False


def unlike(box, other):
    """By how much two boxes (4,) differ in size, m."""
    return float(np.abs((box[2:] - box[:2]).max() - (other[2:] - other[:2]).max()))


def reading_classes(background, radius):
    """Whether a reading in each cell of the map is foreground, (H * W,) uint8.

    It is where no background object is within the radius (Sec. II), and the map knows the floor: on
    the side of a table that the map has never seen, nobody can say what is new.
    """
    if not (background.free.any() and background.occupied.any()):
        raise ValueError("the background map must hold free and occupied cells: it knows of nothing")
    holes = scipy.ndimage.binary_opening(background.unknown, np.ones((3, 3)))
    known = ~scipy.ndimage.binary_dilation(holes, np.ones((3, 3)))
    return (known & (background.distance_field() > radius)).astype(np.uint8).ravel()


def checked_user(user):
    """Who is to be the user: "fastest", a place (x, y), or an index."""
    if isinstance(user, str):
        check_choice("user", user, ("fastest",))
        return user
    if isinstance(user, int | np.integer) and not isinstance(user, bool | np.timedelta64):
        return int(user)
    return checked_positions("user", user, 2)


def walks(track):
    """Whether somebody was seen to walk there, and is no flicker, and nothing that was put elsewhere."""
    seen = np.flatnonzero(~track.occluded)
    stretches = np.split(seen, np.flatnonzero(np.diff(track.t[seen]) > BRIDGED) + 1)
    places = [track.positions[some] for some in stretches]
    ways = [np.linalg.norm(some - some[0], axis=1).max() for some in places]
    return max(ways) > MOVED and len(seen) >= 5 and np.ptp(track.t) >= 0.8


def choose(people, user):
    """Index of the user among people, None if nobody walks."""
    if not people:
        return None
    if isinstance(user, int):
        if not 0 <= user < len(people):
            raise ValueError(f"user must be one of {len(people)} people, 0 to {len(people) - 1}, got {user}")
        return user
    if isinstance(user, str):
        return int(np.argmax(fastness(people)))
    away = [np.linalg.norm(track.positions[0] - user) for track in people]
    k = int(np.argmin(away))
    if away[k] > NOBODY_THERE:
        where = ", ".join(f"{i} at ({x:.2f}, {y:.2f})" for i, (x, y) in enumerate(each.positions[0] for each in people))
        raise ValueError(f"nobody was within {NOBODY_THERE:g} m of {tuple(user.tolist())} when first seen: {where}")
    return k


def fastness(people):
    """(K,) speeds in m/s, 0 for those whose way is short beside the longest."""
    ways = np.array([arc_length(track.positions)[-1] for track in people])
    return np.where(ways >= LONG_ENOUGH * ways.max(), [moving_speed(track) for track in people], 0.0)


def user_notes(user, person, people, tracks, choice, background, now):
    """What is in doubt about the user."""
    if isinstance(choice, str):
        mine = moving_speed(user)
        others = [who is not user and could_be(user, who) is None for who in people]
        near = [fast for fast in fastness(people)[others] if fast > mine - ALIKE]
        if near:
            speeds = f"{mine:.2f} and {max(near):.2f} m/s, less than {ALIKE:g} apart"
            yield Note("people", f"{1 + len(near)} people walk about as fast ({speeds})")
    for when in person.doubts[:1]:
        yield Note(
            "exchange",
            f"{when - user.t[0]:.1f} s after the user was first seen somebody else may have gone on",
        )
    apart = [(gap, arc_length(other.positions)[-1]) for other in tracks if (gap := could_be(user, other)) is not None]
    missed = [(gap, way) for gap, way in apart if way > LEFT_OUT]
    for gap, way in missed:
        yield Note(
            "pieces",
            f"somebody who was seen {gap:.1f} s apart and walked {way:.1f} m may be the user too",
        )
    for when in beside(user, others=[who for who in tracks if who is not user]):
        yield Note(
            "exchange",
            f"{when - user.t[0]:.1f} s after the user was first seen a track beside them begins or ends",
        )
        break
    left = now - user.t[-1]
    hides = person.went_behind and user.speeds[-1] > WALKS_ON
    if hides and not missed and left > max(LEFT_AFTER, LEFT_SHARE * np.ptp(user.t)):
        yield Note(
            "lost",
            f"the user went behind something {left:.1f} s before the end and was seen no more",
        )
    longest = np.diff(person.gaps).max(initial=0)
    if longest > LONGEST_BRIDGE:
        yield Note(
            "gap",
            f"the user was out of sight for {longest:.1f} s at a time (at most {LONGEST_BRIDGE:g})",
        )
    seen = 1 - user.occluded.mean()
    if seen < LEAST_SEEN:
        yield Note("seen", f"the user was in sight for {seen:.0%} of the time (at least {LEAST_SEEN:.0%})")
    off = 1 - on_floor(user.positions, background).mean()
    if off > OFF_MAP:
        yield Note(
            "off the map",
            f"the user was for {off:.0%} of the time where the map has no floor (at most {OFF_MAP:.0%})",
        )
    if user.speeds.max() > TOP_SPEED:
        yield Note(
            "speed",
            f"the user would have walked at {user.speeds.max():.1f} m/s (at most {TOP_SPEED:g})",
        )


def beside(user, others):
    """Times in s at which another track begins or ends where the user is in the middle of the walk."""
    for other in others:
        for when, place in ((other.t[0], other.positions[0]), (other.t[-1], other.positions[-1])):
            there = [np.interp(when, user.t, axis) for axis in user.positions.T]
            if user.t[0] + 1.0 < when < user.t[-1] - 1.0 and np.linalg.norm(there - place) < BESIDE_USER:
                yield float(when)


def on_floor(places, background):
    """Whether each place (M, 2) is where the map knows of floor, (M,) bool."""
    cells, inside = flat_cells(places, background.origin, background.resolution, background.occupancy.shape)
    found = np.zeros(len(places), bool)
    found[inside] = background.free.ravel()[cells]
    return found


def could_be(user, other):
    """Seconds between the times of two tracks of which one may go on as the other, or None."""
    first, second = (user, other) if user.t[0] < other.t[0] else (other, user)
    gap = second.t[0] - first.t[-1]
    apart = np.linalg.norm(second.positions[0] - first.positions[-1])
    return max(gap, 0.0) if -OVERLAP < gap < MAY_COME_BACK and apart < REACH * max(gap, 0) + SLACK else None


def observe_as_paper(
    log,
    background,
    background_radius=0.20,
    gain=0.6,
    static_gain=0.1,
    min_area=0.01,
    stride=0.0,
    tracker=None,
    seed=0,
):
    """Observe a demonstration as the paper does (Sec. II): `observe` with method="paper".

    Parameters
    ----------
    log : LaserLog
        The scans.
    background : OccupancyGrid
        The background occupancy grid map of the workspace; it must cover the scans.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).
    gain, static_gain : float
        Autoregressive gain of the foreground grid that is tracked, per scan, and of the slow one
        that remembers static objects, per fifth scan: a walker wants no tail, a trash can wants
        patience.
    min_area : float
        Smallest foreground object in m^2 (Sec. II: 100 square centimetres).
    stride : float
        Blobs nearer to each other than this, in m, are one object. Zero for a laser at waist
        height, as in the paper; at leg height a walker is two blobs up to half a metre apart.
    tracker : Tracker, optional
        How objects are tracked; the paper's choices by default.
    seed : int or Generator
        Only for particles.

    Returns
    -------
    Observation

    Raises
    ------
    ValueError
        If the map does not cover the scans or a parameter is out of its range.
    """
    checked_record("log", log, LaserLog)
    checked_record("background", background, OccupancyGrid)
    checked_number("the background's resolution", background.resolution, *RESOLUTIONS)
    checked_number("background_radius", background_radius, 1 / FARTHEST)
    checked_number("min_area", min_area, 0)
    checked_number("stride", stride, 0)
    tracker = Tracker() if tracker is None else checked_record("tracker", tracker, Tracker)
    moving, static = ForegroundGrid(background, gain), ForegroundGrid(background, static_gain)
    objects = []
    for i, hits in enumerate(foreground_hits(log, background, background_radius)):
        scan = hits, log.poses[i], log.angles, log.ranges[i]
        moving.update(*scan)
        if i % STATIC_EVERY == 0:
            static.update(*scan)
        objects.append(moving.objects(min_area=min_area, stride=stride))

    def visible(i, points):
        return seen_free(points, log.poses[i], log.angles, log.ranges[i])

    tracks = track_objects(log.t, objects, tracker, visible, seed)
    users = identify_user(log.t, tracks)
    user = user_track(log.t, tracks, users, tracker.motion)
    boxes = static_boxes(static, log.poses[-1, :2], user, min_area)
    losses = max(0, np.count_nonzero(np.diff(users, prepend=-1)) - 1)
    notes = (*log.notes, *_clock_notes(log.t))
    return Observation(tracks, user, Environment(boxes), losses, notes=notes)


def foreground_hits(log, background, background_radius=0.20):
    """Foreground cells of every scan (Sec. II).

    Parameters
    ----------
    log : LaserLog
        T scans.
    background : OccupancyGrid
        The background occupancy grid map; it must cover the scans.
    background_radius : float
        A reading is foreground if no background object lies within this radius, in m (Sec. II:
        20 centimetres).

    Returns
    -------
    list of T int arrays
        Flat indices into the grid of `background`.

    Raises
    ------
    ValueError
        What `dollop.foreground.foreground_mask` refuses.
    """
    points = endpoints(log)
    mask = foreground_mask(points, background, background_radius)
    scan, surface = surface_points(points, mask, spacing=background.resolution)
    grid = background.origin, background.resolution, background.occupancy.shape
    cells, inside = flat_cells(surface, *grid)
    return np.split(cells, np.searchsorted(scan[inside], np.arange(1, len(log.t))))


def static_boxes(grid, sensor, user=None, min_area=0.01, recent=1.0):
    """Boxes of the static foreground objects in the slow foreground grid (Sec. IV).

    A laser sees the near side only, and a trash can would be half as deep as it is wide. Each box
    is completed away from the sensor to be at least as deep along the line of sight as it is wide
    across it (a reconstruction).

    Parameters
    ----------
    grid : ForegroundGrid
        The slow grid after the last scan.
    sensor : (2,) float array
        Where the objects were seen from, in m.
    user : Track, optional
        Blobs where the user stood in the last `recent` seconds are the user, not objects.
    min_area : float
        m^2.
    recent : float
        s.

    Returns
    -------
    (N, 4) float array
        xmin, ymin, xmax, ymax in m.
    """
    blobs = grid.blobs(min_area=min_area)
    boxes = bounding_boxes(blobs, grid.origin, grid.resolution)
    for k in range(len(blobs)):
        cells = blobs.cells[blobs.labels == k]
        seen = grid.centres(cells @ [grid.shape[1], 1])
        boxes[k] = completed(boxes[k], seen, sensor, grid.resolution)
    if user is None:
        return boxes
    last = user.positions[user.t > user.t[-1] - recent, None]
    low, high = boxes[:, :2] - grid.resolution, boxes[:, 2:] + grid.resolution
    return boxes[~((low <= last) & (last <= high)).all(axis=2).any(axis=0)]


def completed(box, seen, sensor, resolution):
    """Extend `box` (4,) to be as deep along the line of sight as its cells are wide across it.

    `seen` (M, 2) are the centres of the cells, `sensor` (2,) is the laser's place, in m.
    """
    sight = seen.mean(axis=0) - sensor
    sight = sight / np.hypot(*sight)
    aside = np.array([-sight[1], sight[0]])
    along, across = (seen - sensor) @ sight, (seen - sensor) @ aside
    half = (np.ptp(across) + resolution) / 2
    depth = along.min() - resolution / 2 + half
    centre = sensor + depth * sight + (across.min() + across.max()) / 2 * aside
    return np.concatenate([np.minimum(box[:2], centre - half), np.maximum(box[2:], centre + half)])
