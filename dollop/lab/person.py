"""A person walking a task: via-points that differ in every lap, smooth path, human speed and gait.

The walk is made from geometry and noise, never from a dynamical system: what is later fitted to it
is not what made it. It is a reconstruction: the paper says no more than that a user walked several
figure-eights (Sec. II). Nothing here needs PyBullet.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from dollop.checks import check_choice, checked_number, checked_positions
from dollop.lab.outlines import nearest_core, outline_distances
from dollop.sequenced_lds import check_times
from dollop.trajectory import arc_length, resample

__all__ = [
    "DEPTH",
    "LEG_RADIUS",
    "SHOULDERS",
    "TIME_STEP",
    "Walk",
    "body_offsets",
    "check_room",
    "figure_eight",
    "slalom",
    "smooth_path",
    "walk",
    "walk_along",
]

SHOULDERS = 0.45
"""Width of the body across the shoulders in m."""
DEPTH = 0.25
"""Depth of the body from chest to back in m."""
CLEARANCE = 0.10
"""Least distance in m that a person keeps between shoulder and foreground object."""
STRIDE_RATE = 0.9
"""Strides (two steps) per second."""
LEG_RADIUS = 0.055
LEG_SPREAD = 0.09

TIME_STEP = 0.02
PATH_STEP = 0.02
LOBE_ANGLES = np.deg2rad([-110.0, -55.0, 0.0, 55.0, 110.0])


@dataclass(frozen=True, eq=False)
class Walk:
    """Where the person is at which time; how they walk is our own model.

    Attributes
    ----------
    t : (N,) float array
        Time in s from 0, evenly spaced.
    positions : (N, 2) float array
        Middle of the body in m.
    headings : (N,) float array
        Direction the chest points in, in rad, unwrapped.
    phases : (N,) float array
        Phase of the gait in rad: one stride is 2 pi, and the phase stands while the person stands.
    body : str
        What the laser meets: a "torso", or two "legs" that stride.

    Examples
    --------
    Between two times the person is between two places; afterwards it stays at the last.

    >>> positions, straight = np.array([[0.0, 0.0], [2.0, 0.0]]), np.zeros(2)
    >>> walk = Walk(np.array([0.0, 1.0]), positions, straight, straight)
    >>> walk.at(0.5)[0].tolist(), walk.at(9.0)[0].tolist()
    ([1.0, 0.0], [2.0, 0.0])
    """

    t: np.ndarray
    positions: np.ndarray
    headings: np.ndarray
    phases: np.ndarray
    body: str = "torso"

    def __repr__(self):
        return f"Walk of {arc_length(self.positions)[-1]:.1f} m in {self.t[-1]:.1f} s"

    @property
    def speeds(self):
        """(N,) speed in m/s."""
        return np.linalg.norm(np.gradient(self.positions, self.t, axis=0), axis=1)

    def at(self, t):
        """Where the person is at one time, held at the ends.

        Parameters
        ----------
        t : float
            In s.

        Returns
        -------
        position : (2,) float array
            In m.
        heading, phase : float
            In rad.
        """
        columns = np.column_stack([self.positions, self.headings, self.phases])
        x, y, heading, phase = (np.interp(t, self.t, column) for column in columns.T)
        return np.array([x, y]), heading, phase


def figure_eight(scene, seed, laps=5, first_turn="left", **gait):
    """A walk in figure-eights round the first two objects of a scene (Fig. 6a).

    Parameters
    ----------
    scene : Scene
        Its first two objects are walked round; all are kept clear of.
    seed : int or numpy.random.Generator
    laps : int
        Figure-eights, each begun and ended midway between the objects.
    first_turn : str
        "left": counter-clockwise round the second object, then clockwise round the first; "right":
        the other way.
    **gait
        Keywords of `walk`.

    Returns
    -------
    Walk

    Raises
    ------
    ValueError
        If the scene has fewer than two objects, `first_turn` is neither, or there is no room.

    Examples
    --------
    A lap goes once round either object, in opposite senses.

    >>> from dollop.lab.scenes import figure_eight_scene
    >>> scene = figure_eight_scene()
    >>> away = figure_eight(scene, seed=0, laps=1).positions - scene.positions[:, None]
    >>> bearings = np.unwrap(np.arctan2(away[..., 1], away[..., 0]))
    >>> ((bearings[:, -1] - bearings[:, 0]) / (2 * np.pi)).round().tolist()
    [-1.0, 1.0]
    """
    if len(scene.objects) < 2:
        raise ValueError(f"a figure-eight needs two objects, the scene has {len(scene.objects)}")
    if first_turn not in ("left", "right"):
        raise ValueError(f"first_turn must be 'left' or 'right', got {first_turn!r}")
    rng = np.random.default_rng(seed)
    turn = 1.0 if first_turn == "left" else -1.0
    laps_points = [figure_eight_points(*scene.positions[:2], turn, rng) for _ in range(laps)]
    end = scene.positions[:2].mean(axis=0) + rng.normal(0.0, 0.06, 2)
    return walk(np.vstack([*laps_points, end]), scene, rng, **gait)


def figure_eight_points(first, second, turn, rng, radius=1.22):
    """Via-points of a lap: middle, round `second`, middle, round `first`; `turn` +1: left first."""
    middle, axis = (first + second) / 2, second - first
    bearing = np.arctan2(axis[1], axis[0])

    def lobe(centre, facing, sense):
        angles = facing + sense * LOBE_ANGLES
        spread = radius + rng.normal(0.0, 0.06) + rng.normal(0.0, 0.03, len(angles))
        return centre + spread[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])

    def crossing():
        return middle + rng.normal(0.0, 0.06, 2)

    out, back = lobe(second, bearing, turn), lobe(first, bearing + np.pi, -turn)
    return np.vstack([crossing(), out, crossing(), back])


def slalom(scene, seed, sides=None, approach=1.0, swing=0.75, **gait):
    """A walk along the scene's objects in their order, past each on its given side (Fig. 11a).

    Parameters
    ----------
    scene : Scene
    seed : int or numpy.random.Generator
    sides : sequence of N values +1 or -1, optional
        +1 leaves the walker left of the object as seen along the row, -1 right of it; alternating
        when not given.
    approach : float
        Length in m walked before the first and after the last object.
    swing : float
        Distance in m at which the walker aims to pass an object's centre.
    **gait
        Keywords of `walk`.

    Returns
    -------
    Walk

    Raises
    ------
    ValueError
        If the scene has fewer than two objects, a side is neither +1 nor -1, or there is no room.

    Examples
    --------
    Left of both cones is above them, where the row goes to the right.

    >>> from dollop.lab.scenes import slalom_scene
    >>> scene = slalom_scene(2)
    >>> x, y = slalom(scene, seed=0, sides=[1, 1]).positions.T
    >>> bool((np.interp(scene.positions[:, 0], x, y) > scene.positions[:, 1]).all())
    True
    """
    objects = scene.positions
    if len(objects) < 2:
        raise ValueError(f"a slalom needs two objects or more, the scene has {len(objects)}")
    sides = (-1.0) ** np.arange(len(objects)) if sides is None else np.asarray(sides, dtype=float)
    if sides.shape != (len(objects),) or not np.all(np.abs(sides) == 1):
        raise ValueError(f"sides must be {len(objects)} values of +1 or -1, got {sides.tolist()}")
    rng = np.random.default_rng(seed)
    along = tangents(objects)
    aside = sides * (swing + rng.normal(0.0, 0.04, len(objects)))
    passing = objects + aside[:, None] * left_of(along)
    start, end = objects[0] - approach * along[0], objects[-1] + approach * along[-1]
    points = np.vstack([start, passing, end])
    return walk(points + rng.normal(0.0, 0.04, points.shape), scene, rng, **gait)


def walk(
    points, scene, seed, speed=1.05, drift=0.04, sway=0.02, stand=1.5, body="torso", stops=(), from_background=0.0
):
    """A human-like walk through via-points, clear of the scene's objects; our own model.

    Parameters
    ----------
    points : (K, 2) array
        Via-points in m, two or more.
    scene : Scene
    seed : int or numpy.random.Generator
    speed : float
        Speed in m/s on a straight line; it falls in curves.
    drift : float
        Standard deviation in m of the slow lateral drift off the smooth path.
    sway : float
        Amplitude in m of the lateral sway with every stride.
    stand : float or (float, float)
        Time in s stood still before and after.
    body : str
        "torso" or "legs".
    stops : sequence of (int, float)
        At which via-points the person stops, for how many s.
    from_background : float
        Least distance in m between shoulder and background.

    Returns
    -------
    Walk

    Raises
    ------
    ValueError
        If the walk leads through an object, or comes nearer to the background than it may.

    Examples
    --------
    Sent straight through a cone, a person keeps clear of its foot.

    >>> from dollop.lab.scenes import slalom_scene
    >>> cone = slalom_scene(1)
    >>> way = walk([(3.0, 3.55), (6.0, 3.55)], cone, seed=0).positions
    >>> gap = np.linalg.norm(way - cone.positions, axis=1).min() - cone.foot_radii[0]
    >>> bool(gap - SHOULDERS / 2 >= CLEARANCE)
    True
    """
    checked_number("speed", speed, 0.1, 3)
    checked_number("from_background", from_background, 0)
    check_choice("body", body, ("torso", "legs"))
    rng = np.random.default_rng(seed)
    points = checked_positions("the via-points of a walk", points)
    if len(points) < 2 or not np.diff(points, axis=0).any(axis=1).all():
        raise ValueError(f"a walk needs two via-points or more, none twice in a row, got {points.tolist()}")
    path = smooth_path(points)
    path = path + left_of(tangents(path)) * wander(len(path), 1.5 / PATH_STEP, drift, rng)[:, None]
    path = evenly(keep_clear(path, scene))
    before, after = np.broadcast_to(stand, 2)
    for k, seconds in [(0, before), (0, after), *stops]:
        if not (0 <= seconds < np.inf and k in range(len(points))):
            raise ValueError(f"people stand at one of {len(points)} places for 0 s or more, got {k} and {seconds}")
    pauses = [(0.0, before), *((passed(path, points, k), seconds) for k, seconds in stops)]
    distance = travelled(speed_profile(path, speed, rng, pauses), pauses, after)
    positions, headings = along_path(path, distance)
    phases = gait_phases(distance)
    fade = np.clip(np.gradient(distance, TIME_STEP) / speed, 0.0, 1.0)
    left = np.column_stack([-np.sin(headings), np.cos(headings)])
    positions = keep_clear(positions + (sway * fade * np.sin(phases))[:, None] * left, scene)
    check_room(positions, scene, from_background)
    return Walk(np.arange(len(positions)) * TIME_STEP, positions, headings, phases, body)


def walk_along(t, positions, body="torso"):
    """A walk as it was recorded, replayed.

    Parameters
    ----------
    t : (N,) float array
        In s from 0, increasing.
    positions : (N, 2) float array
        In m.
    body : str
        "torso" or "legs".

    Returns
    -------
    Walk

    Raises
    ------
    ValueError
        If it lasts longer than a million steps of 0.02 s, as where a clock has jumped.
    """
    check_times(t[-1], TIME_STEP)
    times = np.arange(0.0, t[-1] + TIME_STEP / 2, TIME_STEP)
    way = np.column_stack([np.interp(times, t, axis) for axis in positions.T])
    distance = arc_length(way)
    headings = smooth_headings(way, 0.15 / TIME_STEP)
    return Walk(times, way, headings, gait_phases(distance), body)


def body_offsets(body, phase):
    """Where torso or legs are, seen from the middle of the body.

    The legs swing with an amplitude at which a foot would stand still on the floor in mid-stance at
    1 m/s; a reconstruction.

    Parameters
    ----------
    body : str
        "torso" or "legs".
    phase : float
        Phase of the gait in rad.

    Returns
    -------
    (1, 2) or (2, 2) float array
        Ahead and to the left in m.

    Examples
    --------
    The body stays in the middle of its legs.

    >>> body_offsets("legs", phase=1.0).mean(axis=0).tolist()
    [0.0, 0.0]
    """
    if body == "torso":
        return np.zeros((1, 2))
    stride = np.sin(phase) / (2 * np.pi * STRIDE_RATE)
    return np.array([[stride, LEG_SPREAD], [-stride, -LEG_SPREAD]])


def smooth_path(points):
    """A smooth path through via-points: a centripetal cubic spline, sampled every 2 cm.

    Parameters
    ----------
    points : (K, 2) array
        In m, two or more.

    Returns
    -------
    (N, 2) float array
        In m.

    Examples
    --------
    It is evenly sampled.

    >>> path = smooth_path(np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]))
    >>> steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    >>> bool(np.allclose(steps, 0.02, rtol=0.02))
    True
    """
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps = np.sqrt(chords)  # centripetal: no loops where points crowd
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    fine = np.linspace(0.0, knots[-1], 50 * len(points))
    return evenly(CubicSpline(knots, points)(fine))


def evenly(path, step=PATH_STEP):
    """The path sampled again at even distances of about `step` m."""
    return resample(path, max(2, round(arc_length(path)[-1] / step) + 1))


def tangents(path):
    """Unit vectors along a path at each of its points (N, 2)."""
    along = np.gradient(path, axis=0)
    return along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)  # who turns back stands


def left_of(along):
    """Unit vectors to the left of unit vectors (N, 2)."""
    return np.column_stack([-along[:, 1], along[:, 0]])


def smooth_headings(path, width):
    """Directions (N,) in rad, unwrapped, of a path smoothed over `width` samples."""
    smooth = gaussian_filter1d(path, width, axis=0, mode="nearest")
    along = np.gradient(smooth, axis=0)
    return np.unwrap(np.arctan2(along[:, 1], along[:, 0]))


def wander(n, correlation, spread, rng):
    """Gaussian noise of standard deviation `spread`, correlated over `correlation` samples."""
    noise = gaussian_filter1d(rng.normal(size=n), correlation / 2, mode="reflect")
    return spread * noise * np.sqrt(correlation * np.sqrt(np.pi))


def keep_clear(points, scene, softness=0.03):
    """The points pushed out of the reach in which a shoulder would touch an object, smoothly."""
    points = np.array(points)
    for outline in (each.footprint for each in scene.objects):
        away = points - nearest_core(points, outline)
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        lack = outline.radius + SHOULDERS / 2 + CLEARANCE - distance
        points += away / np.maximum(distance, 1e-9) * softness * np.logaddexp(0.0, lack / softness)
    return points


def passed(path, points, k):
    """How far along an evenly sampled path its k-th via-point is passed, in m."""
    reached = arc_length(points)
    share = np.arange(len(path)) / (len(path) - 1) - reached[k] / reached[-1]
    off = np.linalg.norm(path - points[k], axis=1)
    return float(np.argmin(off + len(path) * PATH_STEP * np.abs(share)) * PATH_STEP)


def speed_profile(path, speed, rng, pauses, bend=0.8, acceleration=0.7):
    """Speed in m/s at every point of an evenly sampled path.

    Curves are walked slower by the two-thirds power law of human movement, v ~ curvature^(-1/3)
    (Lacquaniti et al., 1983), here speed * (1 + (curvature / bend)^2)^(-1/6) so that straight lines
    have a finite speed; fluctuations of 4 % that last metres are laid over it, and it starts and
    ends at rest, also at pauses (where in m, how long in s), within the `acceleration` in m/s^2.
    """
    step = arc_length(path)[1]
    curvature = np.gradient(smooth_headings(path, 0.2 / step)) / step
    wish = speed * (1.0 + (curvature / bend) ** 2) ** (-1 / 6)
    wish *= 1.0 + wander(len(path), 3.0 / step, 0.04, rng)
    steps = np.arange(len(path))
    rests = np.array([len(path) - 1, *(round(place / PATH_STEP) for place, _ in pauses)])
    ends = np.abs(steps - rests[:, None]).min(axis=0) * step
    possible = np.sqrt(2 * acceleration * (ends + step / 10))
    return np.minimum(gaussian_filter1d(wish, 0.3 / step), possible)


def travelled(speeds, pauses, stand):
    """Distance in m at every time step by the speeds of an even path, with pauses, standing after it."""
    speeds_between = (speeds[1:] + speeds[:-1]) / 2
    times, steps = np.concatenate([[0.0], np.cumsum(PATH_STEP / speeds_between)]), np.arange(len(speeds))
    rests = [(round(place / PATH_STEP), seconds) for place, seconds in pauses]
    times = times + sum(seconds * (steps > index) for index, seconds in rests)
    going_on = [(times[index] + seconds, index) for index, seconds in rests]
    times, steps = np.concatenate([[times, steps], np.transpose(going_on)], axis=1)
    order = times.argsort(kind="stable")
    check_times(times.max() + stand, TIME_STEP)
    t = np.arange(0.0, times.max() + stand, TIME_STEP)
    distance = np.interp(t, times[order], steps[order] * PATH_STEP)
    return gaussian_filter1d(distance, 0.15 / TIME_STEP, mode="nearest")


def along_path(path, distance):
    """Positions (N, 2) and smoothed headings (N,) at distances along an evenly sampled path."""
    arc = np.arange(len(path)) * PATH_STEP
    columns = np.column_stack([path, smooth_headings(path, 0.15 / PATH_STEP)]).T
    x, y, headings = (np.interp(distance, arc, column) for column in columns)
    return np.column_stack([x, y]), headings


def gait_phases(distance):
    """Gait phase in rad: strides come faster and grow longer, each by the square root of speed."""
    speeds = np.clip(np.gradient(distance, TIME_STEP), 0.0, None)
    return np.cumsum(2 * np.pi * STRIDE_RATE * np.sqrt(speeds) * TIME_STEP)


def check_room(positions, scene, from_background=0.0):
    """Refuse a walk that leads through an object or comes too near to the background.

    Parameters
    ----------
    positions : (N, 2) float array
        In m.
    scene : Scene
    from_background : float
        Least distance in m between shoulder and background.

    Raises
    ------
    ValueError
        With the place.
    """
    room = scene.room.distance(positions) - SHOULDERS / 2
    nearest = np.argmin(room)
    if room[nearest] < from_background:
        rule = "a walk must not lead through wall or furniture, and must keep"
        place = np.round(positions[nearest], 2).tolist()
        told = f"got {room[nearest]:.2f} m at {place}"
        raise ValueError(f"{rule} {from_background} m between shoulder and background, {told}")
    if scene.objects:
        gaps = outline_distances(positions, [each.footprint for each in scene.objects])
        when, which = np.unravel_index(gaps.argmin(), gaps.shape)
        if gaps[when, which] < DEPTH / 2:
            place = np.round(positions[when], 2).tolist()
            raise ValueError(f"a walk must not lead through an object, got object {which} at {place}")
