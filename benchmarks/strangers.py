"""Worlds of strangers: rooms, lasers, things and people drawn at random, and what the laser records in them.

The ray caster here is its own, and knows nothing of the laboratory. Everything of a world comes from one generator,
of its seed and its kind. `benchmarks.observing` measures the library on them.

one         One torso walks among up to three objects that are not on the map.
legs        The same, with two legs; the truth is the middle between them.
two_place   Two torsos at the same time; the user is named by the place where the walk begins.
two_fast    Two torsos; the user is the one that walks faster, by 0.3 m/s or more.
two_alike   The same, but faster by less than 0.3 m/s.
objects     Nobody walks; the laser looks at one to five objects for three seconds.
rates       The same, at four scan rates.
moved       One torso walks, and an object is suddenly somewhere else.
nobody      Nobody walks; of a third of the worlds the laser itself is carried through.
"""

from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from dollop import LaserLog, OccupancyGrid

KINDS = ("one", "legs", "two_place", "two_fast", "two_alike", "objects", "rates", "moved", "nobody")
RATES = 4.5, 10.0, 20.0, 40.0
FREE = 0.35
"""Nobody walks nearer to walls and things than this with the middle of the body, in m."""


@dataclass(frozen=True)
class Laser:
    """What a laser scanner can do: degrees of view, beams, Hz, bounds of its standard deviation and reach in m."""

    view: float
    beams: int
    rate: float
    noise: tuple
    reach: float

    @property
    def angles(self):
        """(B,) float array: bearings in rad."""
        return np.radians(np.linspace(-self.view / 2, self.view / 2, self.beams))


LASERS = (
    Laser(180, 181, 10, (0.005, 0.010), 8.0),
    Laser(270, 361, 20, (0.010, 0.010), 10.0),
    Laser(270, 1081, 40, (0.010, 0.010), 30.0),
    Laser(180, 361, 5, (0.010, 0.010), 8.0),
    Laser(190, 512, 10, (0.010, 0.010), 10.0),
    Laser(240, 683, 10, (0.020, 0.020), 5.6),
)


@dataclass
class Person:
    """Who walks: at each scan the discs of the body (T, K, 5), its middle (T, 2) and its speed (T,)."""

    bodies: np.ndarray
    middle: np.ndarray
    speed: np.ndarray
    end: float
    radius: float
    seen: np.ndarray = None
    in_range: np.ndarray = None

    @property
    def walks(self):
        """(T,) bool array: where the person does not stand."""
        return self.speed > 0.05

    @property
    def pace(self):
        """Mean speed while walking, in m/s."""
        return self.speed[self.walks].mean() if self.walks.any() else 0.0

    @property
    def length(self):
        """How far the person walks, in m."""
        return np.hypot(*np.diff(self.middle, axis=0).T).sum()


@dataclass
class World:
    """A drawn world, what the laser recorded in it, and the truth."""

    kind: str
    laser: Laser
    pose: np.ndarray
    fixed: list  # polygons on the map: the room, then its furniture
    objects: list  # polygons that are not on the map, as they stand at the end
    background: OccupancyGrid
    log: LaserLog = None
    people: list = field(default_factory=list)
    meant: int = 0  # who of the people is the user
    user: object = None  # what to pass as `user`
    before: list = None  # the objects as they stood at first
    again: dict = None  # more looks at the same world, by scan rate


# ---- the ray caster


def cast(pose, angles, polygons):
    """Range of each beam to the nearest edge of the polygons, which edge, and whose: three (B,) arrays."""
    starts = np.vstack(polygons)
    along = np.vstack([np.roll(polygon, -1, axis=0) for polygon in polygons]) - starts
    owner = np.repeat(np.arange(len(polygons)), [len(polygon) for polygon in polygons])
    beams = np.column_stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)])[:, None]
    gap = starts - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = _cross(beams, along)
        ranges, share = _cross(gap, along) / cross, _cross(gap, beams) / cross
    ranges[~((ranges > 0) & (share >= 0) & (share <= 1))] = np.inf
    edge = ranges.argmin(axis=1)
    return ranges[np.arange(len(angles)), edge], edge, owner[edge]


def _cross(one, other):
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


def cast_discs(pose, angles, discs):
    """Ranges (T, B) to ellipses (T, K, 5) that move: x, y, half axes along and across, heading."""
    nearest = np.full((len(discs), len(angles)), np.inf)
    for x, y, a, b, heading in np.moveaxis(discs, 0, 2):
        turn = pose[2] + angles - heading[:, None]
        beam = np.cos(turn) / a[:, None], np.sin(turn) / b[:, None]
        gap = np.stack([pose[0] - x, pose[1] - y])
        start = [(gap[0] * np.cos(heading) + gap[1] * np.sin(heading)) / a]
        start += [(gap[1] * np.cos(heading) - gap[0] * np.sin(heading)) / b]
        square, half = beam[0] ** 2 + beam[1] ** 2, start[0][:, None] * beam[0] + start[1][:, None] * beam[1]
        root = half**2 - square * (start[0] ** 2 + start[1] ** 2 - 1)[:, None]
        ranges = (-half - np.sqrt(np.maximum(root, 0))) / square
        hit = (root > 0) & (ranges > 0)
        nearest[hit] = np.minimum(nearest[hit], ranges[hit])
    return nearest


def measured(rng, laser, ranges, surface):
    """What the laser reports (T, B): mixed pixels at jumps, noise, gaps, and `inf` beyond its reach."""
    ranges = ranges.copy()
    jump = (surface[:, 1:] != surface[:, :-1]) & (np.abs(np.diff(ranges)) > 0.1)
    mixed = jump & (rng.random(jump.shape) < 0.1)
    share = rng.random(np.count_nonzero(mixed))
    ranges[:, 1:][mixed] = share * ranges[:, 1:][mixed] + (1 - share) * ranges[:, :-1][mixed]
    ranges += rng.normal(0, rng.uniform(*laser.noise), ranges.shape)
    ranges[(ranges > laser.reach) | (rng.random(ranges.shape) < 0.002)] = np.inf
    return ranges.clip(0.01)


def times(rng, rate, seconds):
    """Times of the scans from 0, in s: 2 % jitter."""
    steps = (1 + 0.02 * rng.normal(size=int(np.ceil(seconds * rate)))) / rate
    return np.append(0, np.cumsum(steps))


def look(rng, world, t, scenes=None, which=0):
    """A log of the laser that stands; each person learns where the laser saw them.

    `scenes` are lists of polygons, and `which` (T,) of them stood there at each scan.
    """
    laser, pose = world.laser, world.pose
    scenes = scenes or [world.fixed + world.objects]
    which = np.broadcast_to(which, t.shape)
    ranges, surface, _ = (
        np.array(each)[which] for each in zip(*(cast(pose, laser.angles, s) for s in scenes), strict=True)
    )
    alone = [cast_discs(pose, laser.angles, person.bodies) for person in world.people]
    for k, body in enumerate(alone):
        nearer = body < ranges
        ranges, surface = np.where(nearer, body, ranges), np.where(nearer, -1 - k, surface)
    for k, (person, body) in enumerate(zip(world.people, alone, strict=True)):
        could = np.count_nonzero(body < laser.reach, axis=1)
        does = np.count_nonzero((surface == -1 - k) & (ranges < laser.reach), axis=1)
        person.in_range, person.seen = could >= 2, (does >= 2) & (does >= 0.5 * could)
    clock = rng.choice([0.0, 1.7e9])
    poses = np.tile(pose, (len(t), 1))
    return LaserLog(clock + t, measured(rng, laser, ranges, surface), laser.angles, poses, laser.reach)


def drive(rng, laser, poses, t, polygons):
    """A log of the laser that is carried through the poses (T, 3), which are known."""
    ranges, surface, _ = map(np.array, zip(*(cast(pose, laser.angles, polygons) for pose in poses), strict=True))
    return LaserLog(t, measured(rng, laser, ranges, surface), laser.angles, poses, laser.reach)


# ---- rooms and things


def turned(points, angle):
    """Points (..., 2) turned about the origin."""
    return points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def box(centre, sides, angle=0.0):
    """Corners of a box, counter-clockwise."""
    return centre + turned(np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(sides) / 2, angle)


def column(centre, radius):
    """A round thing, as a polygon of 36 corners."""
    angles = np.radians(np.arange(0, 360, 10))
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def outline(polygon, step=0.05):
    """Points along the edges of a polygon, at most a step apart."""
    sides = zip(polygon, np.roll(polygon, -1, axis=0), strict=True)
    return np.vstack([np.linspace(a, b, 1 + int(np.hypot(*(b - a)) / step), endpoint=False) for a, b in sides])


def clearance(points, room, things=()):
    """Distance of points (M, 2) to the nearest edge in m; negative outside of the room or within a thing."""
    polygons = [room, *things]
    starts = np.vstack(polygons)
    along = np.vstack([np.roll(polygon, -1, axis=0) for polygon in polygons]) - starts
    gap = points[:, None] - starts
    share = ((gap * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0, 1)
    nearest = np.sqrt(((gap - share[..., None] * along) ** 2).sum(axis=2).min(axis=1))
    free = _within(points, room)
    for thing in things:
        free &= ~_within(points, thing)
    return np.where(free, nearest, -nearest)


def _within(points, polygon):
    """Which points a polygon holds: a ray to the right crosses its edges an odd number of times."""
    (x, y), (u, v) = polygon.T, np.roll(polygon, -1, axis=0).T
    rise = np.where(v == y, 1.0, v - y)
    above = (y > points[:, 1:]) != (v > points[:, 1:])
    return (above & (points[:, :1] < x + (points[:, 1:] - y) / rise * (u - x))).sum(axis=1) % 2 == 1


def draw_room(rng):
    """A rectangle or an L, half of them small, anywhere in the plane; and the angle that it is turned by."""
    w, h = rng.uniform(*([3.5, 6.0] if rng.random() < 0.5 else [6.0, 12.0]), 2)
    room = np.array([[0, 0], [w, 0], [w, h], [0, h]])
    if rng.random() < 0.5:
        c, d = rng.uniform(0.3, 0.55, 2) * [w, h]
        room = np.array([[0, 0], [w, 0], [w, h - d], [w - c, h - d], [w - c, h], [0, h]])
    angle = rng.uniform(-np.pi, np.pi) if rng.random() < 0.5 else rng.integers(4) * np.pi / 2
    return turned(room, angle) + rng.uniform(-30, 30, 2), angle


def draw_points(rng, room, count):
    """Points (count, 2) in the box around the room."""
    return rng.uniform(room.min(axis=0), room.max(axis=0), (count, 2))


def draw_furniture(rng, room, angle):
    """Up to four boxes and columns that are on the map."""
    furniture, span = [], np.sqrt(np.ptp(room, axis=0).min())
    for _ in range(rng.integers(5)):
        for centre in draw_points(rng, room, 20):
            sides = rng.uniform(0.1, [0.6 * span, 0.3 * span])
            turn = angle if rng.random() < 0.7 else rng.uniform(0, np.pi)
            piece = box(centre, sides, turn) if rng.random() < 0.7 else column(centre, rng.uniform(0.1, 0.3))
            if fits(piece, room, furniture, 0.02):
                furniture.append(piece)
                break
    return furniture


def fits(thing, room, things, margin, most=np.inf):
    """Whether a thing stands free by a margin, and not by more than `most`."""
    around = clearance(outline(thing), room, things).min()
    held = any(_within(each[:1], thing).any() for each in things)
    return margin <= around <= most and not held


def draw_pose(rng, room, furniture):
    """Where the laser stands: near a wall or in a corner, looking inwards; None if there is no place."""
    along = np.roll(room, -1, axis=0) - room
    along = along / np.hypot(*along.T)[:, None]
    inward = np.column_stack([-along[:, 1], along[:, 0]])
    for _ in range(50):
        k = rng.integers(len(room))
        if rng.random() < 0.5:
            place = room[k] + rng.uniform(0.1, 0.9) * (room[(k + 1) % len(room)] - room[k])
            place, facing, spread = place + rng.uniform(0.1, 0.4) * inward[k], inward[k], 15
        else:
            facing, spread = inward[k] + inward[k - 1], 10
            place = room[k] + rng.uniform(0.15, 0.5) * facing
        heading = np.arctan2(*facing[::-1]) + np.radians(spread) * rng.uniform(-1, 1)
        apart = clearance(place[None], room, furniture) >= 0.1
        if apart and all(clearance(place[None], each) < -0.6 for each in furniture):
            return np.array([*place, heading])
    return None


def draw_objects(rng, world, count, shares=(1 / 3, 1 / 3, 1 / 3), at_wall=0.0):
    """Things of 0.2 to 1 m that are not on the map, half a metre apart: boxes, turned boxes and round ones."""
    objects, (room, *furniture) = [], world.fixed
    for _ in range(count):
        shape, sides = rng.choice(3, p=shares), rng.uniform(0.2, 1.0, 2)
        margins = (0.05, 0.4) if rng.random() < at_wall else (0.4, np.inf)
        for centre in in_sight(world, draw_points(rng, room, 1500), 0.1)[:150]:
            angle = rng.uniform(0, np.pi) if shape == 1 else 0.0
            thing = column(centre, sides[0] / 2) if shape == 2 else box(centre, sides, angle)
            if fits(thing, room, furniture, *margins) and not too_near(thing, world, objects):
                objects.append(thing)
                break
    return objects


def too_near(thing, world, others):
    """Whether a thing is within half a metre of another one or of the laser."""
    points = np.vstack([world.pose[None, :2], *map(outline, others)])
    return clearance(points, thing).max() > -0.5


def in_sight(world, points, margin=FREE):
    """Those of the points that are free by a margin, and that the laser can see past walls and furniture."""
    points = points[clearance(points, world.fixed[0], world.fixed[1:] + world.objects) >= margin]
    gap = points - world.pose[:2]
    far = np.hypot(*gap.T)
    bearing = np.arctan2(gap[:, 1], gap[:, 0]) - world.pose[2]
    bearing = (bearing + np.pi) % (2 * np.pi) - np.pi
    angles = world.laser.angles
    ranges = cast(world.pose, angles, world.fixed)[0]
    inside = np.abs(bearing) < angles[-1] - np.radians(3)
    return points[
        inside & (far > 0.6) & (far < np.minimum(np.interp(bearing, angles, ranges), world.laser.reach - 0.3))
    ]


def draw_map(rng, laser, fixed):
    """The background map: a drive through the empty room, stopping at a dozen places all over it."""
    room, *furniture = fixed
    free = draw_points(rng, room, 400)
    free = free[clearance(free, room, furniture) > 0.3]
    stops = free[:1]
    while len(stops) < 12:
        some = rng.choice(free, 5)
        stops = np.vstack([stops, some[np.hypot(*(some[:, None] - stops).T).min(axis=0).argmax()]])
    poses = np.repeat(np.column_stack([stops, rng.uniform(-np.pi, np.pi, 12)]), 5, axis=0)
    return OccupancyGrid.from_log(drive(rng, laser, poses, np.arange(60.0), fixed))


# ---- people


class Ground:
    """Where people can walk: how far from walls and things each place is, and the places that the laser sees."""

    def __init__(self, rng, world):
        room, things = world.fixed[0], world.fixed[1:] + world.objects + (world.before or [])
        self.low, high = room.min(axis=0), room.max(axis=0) + 0.1
        x, y = (np.arange(*each, 0.1) for each in zip(self.low, high, strict=True))
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        self.clearances = clearance(places.reshape(-1, 2), room, things).reshape(places.shape[:2])
        seen = in_sight(world, draw_points(rng, room, 1500))
        self.places = seen[self(seen) >= FREE]

    def __call__(self, points):
        """Clearance of points (..., 2) in m, between those that are known on a grid."""
        return map_coordinates(self.clearances, np.moveaxis(points - self.low, -1, 0) / 0.1, order=1, cval=-1.0)


def draw_ways(rng, ground, count):
    """Up to as many ways (M, 2), a point every 2 cm; a third of them are two to four laps of a closed one."""
    ways = []
    for _ in range(count if len(ground.places) > 20 else 0):
        laps = rng.integers(2, 5) if rng.random() < 1 / 3 else 0
        for _ in range(30):
            way = spline(draw_via(rng, ground, laps > 0), laps > 0, ground)
            if way is not None and laps * 0.02 * len(way) < 25:
                ways.append(np.vstack([way] + max(laps - 1, 0) * [way[1:]]))
                break
    return ways


def draw_via(rng, ground, closed):
    """Four to eight places, each of them seen from the one before."""
    via = [rng.choice(ground.places)]
    for _ in range(rng.integers(3, 8)):
        options = rng.choice(ground.places, 40)
        ahead = options - via[-1]
        good = (np.hypot(*ahead.T) > 0.8) & (np.hypot(*ahead.T) < 5)
        if len(via) > 1:
            turn = np.arctan2(_cross(via[-1] - via[-2], ahead), ahead @ (via[-1] - via[-2]))
            good &= np.abs(turn) < np.radians(115)
        line = via[-1] + np.linspace(0.1, 1, 12)[:, None, None] * ahead
        good &= ground(line).min(axis=0) >= FREE
        if not good.any():
            break
        via.append(options[good][0])
    return np.array([*via, via[0]] if closed else via)


def spline(via, closed, ground):
    """The way through the points if it is free, from 5 to 25 m long and nowhere too narrow a turn; else None."""
    at = np.append(0, np.cumsum(np.hypot(*np.diff(via, axis=0).T)))
    if len(via) < 4 or np.diff(at).min() < 0.5:
        return None
    curve = CubicSpline(at, via, bc_type="periodic" if closed else "natural")
    fine = curve(np.linspace(0, at[-1], 2000))
    length = np.append(0, np.cumsum(np.hypot(*np.diff(fine, axis=0).T)))
    if not 5 <= length[-1] <= 25:
        return None
    steps = np.linspace(0, length[-1], int(length[-1] / 0.02))
    way = np.column_stack([np.interp(steps, length, each) for each in fine.T])
    if ground(way[::4]).min() < FREE or np.abs(curvature(way)).max() > 4:
        return None
    return way


def curvature(way):
    """Curvature (M,) of a way of points 2 cm apart, over 20 cm, in 1/m."""
    heading = np.unwrap(np.arctan2(*np.diff(way, axis=0).T[::-1]))
    smooth = np.convolve(np.gradient(heading) / 0.02, np.ones(11) / 11, mode="same")
    return np.append(smooth, smooth[-1])


def paced(rng, way, cruise, stop):
    """When a walker is at each point of the way, in s; a stop is a jump in time.

    Starting and braking with 1 m/s^2 at most, in curves 1.2 m/s^2.
    """
    at = 0.02 * np.arange(len(way))
    top = np.minimum(cruise**2, 1.2 / np.maximum(np.abs(curvature(way)), 1e-3))
    top[[0, -1]] = 0
    halt = rng.integers(len(way) // 5, 4 * len(way) // 5)
    if stop:
        top[halt] = 0
    speed = np.sqrt((top + 2 * np.abs(at[:, None] - at)).min(axis=1)).clip(0.05)
    when = np.append(0, np.cumsum(0.02 / ((speed[1:] + speed[:-1]) / 2)))
    if stop:
        when[halt + 1 :] += rng.uniform(1, 5)
    return when


def draw_walk(rng, way, body, cruise=None):
    """A person's bodies over time as a function of the times, and when the walk ends."""
    stop, wait, shape = rng.random() < 1 / 3, rng.uniform(0.5, 3), draw_shape(rng, body)
    cruise = cruise or rng.uniform(0.4, 1.8)
    when = wait + paced(rng, way, cruise, stop)
    return lambda t: person_at(t, way, when, shape, cruise), when[-1]


def draw_shape(rng, body):
    """Half axes along and across of a torso, or radius and half the distance of two legs."""
    if body == "legs":
        return "legs", rng.uniform(0.05, 0.08), rng.uniform(0.10, 0.15)
    if rng.random() < 0.5:
        return "torso", *2 * [rng.uniform(0.15, 0.25)]
    return "torso", rng.uniform(0.12, 0.16), rng.uniform(0.22, 0.26)


def person_at(t, way, when, shape, cruise):
    """The person at the times t: of legs one foot stands while the other swings; the body is midway."""
    heading = np.unwrap(np.arctan2(*np.gradient(way, axis=0).T[::-1]))
    at = 0.02 * np.arange(len(way))

    def place(s, aside=0.0):
        x, y, turn = (np.interp(s, at, each) for each in (*way.T, heading))
        return np.column_stack([x - aside * np.sin(turn), y + aside * np.cos(turn)]), turn

    s = np.interp(t, when, at)
    speed = np.gradient(np.interp(t + np.array([[-0.05], [0.05]]), when, at), axis=0)[0] / 0.1
    kind, a, b = shape
    if kind == "torso":
        middle, turn = place(s)
        bodies = np.column_stack([middle, np.full((len(t), 2), [a, b]), turn])[:, None]
        return Person(bodies, middle, speed, when[-1], max(a, b))
    step = np.clip(0.2 + 0.3 * cruise, 0.3, 0.7)
    swing = (np.abs((s / step) % 2 - 1) - 0.5) * step * np.minimum(1, speed / 0.3)
    feet = [place((s + side * swing).clip(0, at[-1]), side * b)[0] for side in (-1, 1)]
    discs = [np.column_stack([foot, np.full((len(t), 2), a), np.zeros(len(t))]) for foot in feet]
    return Person(np.stack(discs, axis=1), np.mean(feet, axis=0), speed, when[-1], a + b)


def fair(person, t):
    """Whether a person can be followed: out of view 8 % of the time at most, hidden for 4 s and 25 % at most."""
    bounds = np.flatnonzero(np.diff(np.concatenate([[1], person.seen, [1]])))
    stretches = [t[min(end, len(t) - 1)] - t[begin] for begin, end in bounds.reshape(-1, 2)]
    return person.in_range.mean() >= 0.92 and person.seen.mean() >= 0.75 and max(stretches, default=0) <= 4


# ---- worlds


def draw_world(kind, seed):
    """The world of a kind and a seed.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    seed : int

    Returns
    -------
    World
    """
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    for _ in range(300):
        room, angle = draw_room(rng)
        furniture = draw_furniture(rng, room, angle)
        pose = draw_pose(rng, room, furniture)
        if pose is None:
            continue
        world = World(kind, LASERS[rng.integers(len(LASERS))], pose, [room, *furniture], [], None)
        if FILL[kind](rng, world):
            world.background = draw_map(rng, world.laser, world.fixed)
            return world
    raise RuntimeError(f"no world of kind {kind} for seed {seed}")


def fill_walk(rng, world):
    """One person and up to three objects."""
    world.objects = draw_objects(rng, world, rng.integers(4))
    body = "legs" if world.kind == "legs" else "torso"
    return any(walked(rng, world, [draw_walk(rng, way, body)]) for way in draw_ways(rng, Ground(rng, world), 3))


def fill_two(rng, world):
    """Two people at the same time, half a metre apart or more from body to body."""
    world.objects = draw_objects(rng, world, rng.integers(4))
    ways = draw_ways(rng, Ground(rng, world), 6)
    for one, other in permutations(range(len(ways)), 2):
        paces = rng.uniform(0.4, 1.8, 2)
        if world.kind == "two_fast":
            paces = np.array([0.8, 0.4]) + rng.uniform(0, 1) * np.array([1.0, 0.9])
        if world.kind == "two_alike":
            paces = paces[0] * np.array([1, rng.uniform(0.85, 1.15)])
        walks = [draw_walk(rng, ways[k], "torso", pace) for k, pace in zip((one, other), paces, strict=True)]
        if walked(rng, world, walks if rng.random() < 0.5 else walks[::-1]):
            return True
    return False


def walked(rng, world, walks):
    """Let the people walk, record them until the user has arrived; whether all is as it should be."""
    world.meant = rng.integers(len(walks))
    if world.kind in ("two_fast", "two_alike"):
        world.user = "fastest"
        world.meant = int(np.argmax([walk(np.arange(0, end, 0.1)).pace for walk, end in walks]))
    t = times(rng, world.laser.rate, walks[world.meant][1] + rng.uniform(0.3, 2))
    world.people = [walk(t) for walk, _ in walks]
    if world.kind == "two_place":
        world.user = tuple(world.people[world.meant].middle[0].tolist())
    if len(walks) == 2 and not well_apart(world):
        return False
    world.log = look(rng, world, t)
    return all(fair(person, t) for person in world.people) and world.people[world.meant].seen[0]


def well_apart(world):
    """Whether two people keep off each other, and walk as differently as the kind of world says."""
    one, other = world.people
    gap = np.hypot(*(one.middle - other.middle).T).min() - one.radius - other.radius
    if gap < 0.5 or min(one.length, other.length) < 3:
        return False
    faster = world.people[world.meant].pace - world.people[1 - world.meant].pace
    return {"two_fast": faster >= 0.3, "two_alike": 0 < faster < 0.3}.get(world.kind, True)


def fill_objects(rng, world):
    """One to five objects that the laser looks at for three seconds, at other rates too."""
    world.objects = draw_objects(rng, world, rng.integers(1, 6), (0.6, 0.15, 0.25), at_wall=0.25)
    if not world.objects or not in_view(world)[0].any():
        return False
    world.log = look(rng, world, times(rng, world.laser.rate, 3))
    if world.kind == "rates":
        world.again = {rate: look(rng, world, times(rng, rate, 3)) for rate in RATES}
    return True


def fill_moved(rng, world):
    """One person; an object goes, and stands somewhere else up to two seconds later."""
    world.objects = draw_objects(rng, world, rng.integers(1, 4))
    if not world.objects or not in_view(world)[0][0]:
        return False
    first, *rest = world.before = world.objects
    for angle in rng.uniform(-np.pi, np.pi, 30):
        there = first + turned(np.array([rng.uniform(0.6, 2), 0]), angle)
        if fits(there, world.fixed[0], world.fixed[1:], 0.4) and not too_near(there, world, rest):
            break
    else:
        return False
    world.objects = [there, *rest]
    ways = draw_ways(rng, Ground(rng, world), 1)
    if not ways or not in_view(world)[0][0]:
        return False
    walk, end = draw_walk(rng, ways[0], "torso")
    t = times(rng, world.laser.rate, end + rng.uniform(0.3, 2))
    world.people = [walk(t)]
    gone = rng.uniform(0.25, 0.65) * t[-1]
    which = (t > gone).astype(int) + (t > gone + rng.uniform(0, 2))
    world.log = look(rng, world, t, [world.fixed + each for each in (world.before, rest, world.objects)], which)
    return fair(world.people[0], t)


def fill_nobody(rng, world):
    """Nothing that moves but the laser: an empty room, objects, or a drive between them."""
    world.objects = draw_objects(rng, world, rng.integers(1, 4)) if rng.random() < 0.6 else []
    if rng.random() < 2 / 3:
        world.log = look(rng, world, times(rng, world.laser.rate, rng.uniform(3, 15)))
        return True
    ways = draw_ways(rng, Ground(rng, world), 1)
    if not ways:
        return False
    walk, end = draw_walk(rng, ways[0], "torso", rng.uniform(0.3, 0.6))
    t = times(rng, world.laser.rate, min(end, 30))
    poses = walk(t).bodies[:, 0, [0, 1, 4]]
    world.log = drive(rng, world.laser, poses, t, world.fixed + world.objects)
    return True


FILL = dict.fromkeys(KINDS, fill_two)
FILL |= {"one": fill_walk, "legs": fill_walk, "objects": fill_objects, "rates": fill_objects}
FILL |= {"moved": fill_moved, "nobody": fill_nobody}


def in_view(world):
    """Which objects (N,) the laser sees well, and which sides (N, 4) of the boxes around them beams reach.

    In view is what at least 4 beams hit, and 60 % of those that would if it stood alone. A beam reaches a side of
    the box within 5 cm of it.
    """
    ranges, _, owner = cast(world.pose, world.laser.angles, world.fixed + world.objects)
    bearings = world.pose[2] + world.laser.angles
    ends = world.pose[:2] + ranges[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    seen, reached = [], []
    for k, thing in enumerate(world.objects):
        mine = (owner == len(world.fixed) + k) & (ranges < world.laser.reach)
        alone = np.count_nonzero(cast(world.pose, world.laser.angles, [thing])[0] < world.laser.reach)
        seen.append(mine.sum() >= max(4, 0.6 * alone))
        reached.append((np.abs(np.tile(ends[mine], 2) - bounds(thing)) < 0.05).any(axis=0))
    return np.array(seen, dtype=bool), np.reshape(reached, (-1, 4))


def bounds(thing):
    """xmin, ymin, xmax, ymax of a polygon."""
    return np.concatenate([thing.min(axis=0), thing.max(axis=0)])
