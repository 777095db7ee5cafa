"""What a scene is made of beside its room: objects, the robot that watches, people, and moves.

Nothing here needs PyBullet.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dollop.checks import check_choice, check_positive, checked_array, checked_number, checked_positions, put_in, told
from dollop.lab.outlines import Outline
from dollop.lab.scanner import Scanner, SickLMS200
from dollop.pose import moved_pose

__all__ = ["BEAM_HEIGHT", "HIGHEST_BEAM", "Move", "Object", "Person", "Robot", "SHAPES"]

BEAM_HEIGHT = 0.36
"""Height of the laser's plane over the floor in m: a SICK LMS 200 on the deck of a Pioneer 2 DX."""
LOWEST_BEAM, HIGHEST_BEAM = 0.06, 1.4
"""m: a beam below meets the flat feet of cones, one above sees nobody over people's shoulders."""
SHAPES = ("box", "cylinder", "cone")
BODIES = ("torso", "legs")
LARGEST, FARTHEST = 20.0, 1e6
"""m: objects are no larger, and numbers no greater."""
LONGEST, MOST_LAPS, FASTEST = 3600.0, 100, 5.0
"""s, laps and m/s: nobody walks longer, and nobody runs."""


@dataclass(frozen=True)
class Object:
    """A foreground object, which can stand elsewhere next time (Sec. II).

    Attributes
    ----------
    shape : str
        "box", "cylinder" or "cone".
    position : tuple of 2 floats
        Its middle in m.
    size : tuple of 2 floats
        Width and depth in m along its own axes, at the floor; of what is round both are the
        diameter.
    height : float
        In m.
    turn : float
        Of its axes, in rad.
    top : float
        Diameter of a cone at its top in m.
    foot : float
        Diameter in m of a flat foot of a cone, no higher than 6 cm; none if it is 0.

    Raises
    ------
    ValueError
        For an unknown shape, a number that is not finite, or one that is not positive where it must
        be.

    Examples
    --------
    The laser meets a cone above its foot, where it is narrower.

    >>> cone = Object.cone((4.5, 3.5))
    >>> round(cone.outline(BEAM_HEIGHT).radius, 6), cone.outline(1.2), cone.reach
    (0.13, None, 0.28)
    """

    shape: str
    position: tuple
    size: tuple
    height: float
    turn: float = 0.0
    top: float = 0.0
    foot: float = 0.0

    def __post_init__(self):
        check_choice("shape", self.shape, SHAPES)
        for name in ("position", "size"):
            values = checked_array(name, getattr(self, name), 2, least=-FARTHEST, most=FARTHEST)
            object.__setattr__(self, name, tuple(values.tolist()))
        check_positive("size", min(self.size))
        numbers = {
            "height": (1e-3, FARTHEST),
            "turn": (-FARTHEST, FARTHEST),
            "top": (0, 100),
            "foot": (0, 100),
        }
        put_in(
            self,
            **{name: checked_number(name, getattr(self, name), *ends) for name, ends in numbers.items()},
        )
        if max(*self.size, self.height) > LARGEST:
            raise ValueError(f"an object must be at most {LARGEST:g} m large, got {self.size} and {self.height}")
        if self.shape != "box" and self.size[0] != self.size[1]:
            raise ValueError(f"a {self.shape} must be as deep as wide, got {self.size}")

    @classmethod
    def trash_can(cls, position):
        """One of the paper's trash cans (Fig. 5).

        Parameters
        ----------
        position : (2,) sequence of float
            In m.

        Returns
        -------
        Object
        """
        return cls("cylinder", position, (0.36, 0.36), 0.66)

    @classmethod
    def cone(cls, position):
        """One of the paper's slalom cones (Fig. 11).

        Parameters
        ----------
        position : (2,) sequence of float
            In m.

        Returns
        -------
        Object
        """
        return cls("cone", position, (0.3824, 0.3824), 1.0, top=0.0424, foot=0.56)

    def outline(self, height):
        """What a plane at some height cuts out of it.

        Parameters
        ----------
        height : float
            Over the floor in m.

        Returns
        -------
        Outline or None
            None where it is not as high.
        """
        if height >= self.height:
            return None
        if self.shape == "box":
            return self.footprint
        slope = (self.top - self.size[0]) / self.height if self.shape == "cone" else 0.0
        return Outline(*self.position, radius=(self.size[0] + slope * height) / 2)

    @property
    def footprint(self):
        """Outline of its widest part, which a walker or a robot must avoid."""
        if self.shape == "box":
            width, depth = self.size
            return Outline(*self.position, width / 2, depth / 2, self.turn)
        return Outline(*self.position, radius=self.reach)

    @property
    def reach(self):
        """Radius in m of the circle round its widest part."""
        if self.shape == "box":
            return float(np.hypot(*self.size)) / 2
        return max(self.size[0], self.top, self.foot) / 2

    def at(self, position):
        """The object elsewhere.

        Parameters
        ----------
        position : (2,) sequence of float
            In m.

        Returns
        -------
        Object
        """
        return replace(self, position=position)


@dataclass(frozen=True)
class Robot:
    """The robot that watches, a Pioneer 2 DX: where it stands or drives, and the laser on it.

    Attributes
    ----------
    pose : tuple of 3 floats
        x, y in m, theta in rad, at the beginning.
    scanner : Scanner
    beam_height : float
        At which the laser cuts, over the floor in m.
    laser_ahead : float
        Laser ahead of the middle of the axle in m (ARIA p2dx.p, LaserX).
    way : (K, 2) tuple
        Places in m that it drives to while it observes; it stands if there are none.
    speed : float
        On that way, in m/s.
    radius : float
        Of the disc that it covers, in m (ARIA p2dx.p).

    Raises
    ------
    ValueError
        For a number out of its range; of the beam height, above everything.
    """

    pose: tuple = (4.5, 0.6, np.pi / 2)
    scanner: Scanner = field(default_factory=SickLMS200)
    beam_height: float = BEAM_HEIGHT
    laser_ahead: float = 0.017
    way: tuple = ()
    speed: float = 0.3
    radius: float = 0.25

    def __post_init__(self):
        object.__setattr__(self, "pose", as_pose("the robot's pose", self.pose))
        object.__setattr__(self, "way", as_places("the robot's way", self.way))
        put_in(self, speed=checked_number("the robot's speed", self.speed, 0.01, 2))
        put_in(self, radius=checked_number("the robot's radius", self.radius, 0.05, 2))
        put_in(
            self,
            laser_ahead=checked_number("laser_ahead", self.laser_ahead, -self.radius, self.radius),
        )
        if not isinstance(self.scanner, Scanner):
            raise ValueError(f"the robot's scanner must be a Scanner, got {told(self.scanner)}")
        checked_number("the beam height", self.beam_height)
        if not LOWEST_BEAM < self.beam_height < HIGHEST_BEAM:
            rule = f"the beam height must be over feet, {LOWEST_BEAM} m, and below shoulders, {HIGHEST_BEAM} m"
            raise ValueError(f"{rule}, got {self.beam_height} m")

    @property
    def laser_pose(self):
        """(3,) pose of the laser at the beginning, x, y in m, theta in rad."""
        return moved_pose(self.pose, self.laser_ahead, 0.0)


@dataclass(frozen=True)
class Person:
    """Who walks where, as data; `dollop.lab.people` makes a `Walk` of it.

    Attributes
    ----------
    places : (K, 2) tuple
        Places to pass in m, as they are met; a single one for somebody who only stands there.
    speed : float
        On a straight line in m/s; it falls in curves.
    body : str
        "torso": what a laser at waist height meets; "legs": two, striding.
    begin : float
        Time in s at which the person sets off.
    stops : tuple of (int, float)
        At which places the person stops for how many s.
    laps : int
        How often the places are walked round.
    back : bool
        Whether the same way is walked back.
    scatter : float
        Standard deviation in m by which a place is missed, anew in every lap.
    times : tuple of K floats
        When the person is at each place, in s, the first at `begin`: a walk that is replayed. `speed`,
        `stops`, `laps`, `back` and `scatter` then say nothing.
    seed : int
        What chance there is in the walk comes from it.

    Raises
    ------
    ValueError
        For a number out of its range, a body that there is not, a stop at no place.
    """

    places: tuple
    speed: float = 1.05
    body: str = "torso"
    begin: float = 1.5
    stops: tuple = ()
    laps: int = 1
    back: bool = False
    scatter: float = 0.0
    times: tuple = ()
    seed: int = 0

    def __post_init__(self):
        object.__setattr__(self, "places", as_places("a person's places", self.places))
        object.__setattr__(self, "times", tuple(checked_array("times", self.times, "K").tolist()))
        if not self.places:
            raise ValueError("a person needs a place to be, got none")
        check_choice("body", self.body, BODIES)
        put_in(self, speed=checked_number("a person's speed", self.speed, 0.1, 3))
        put_in(self, begin=checked_number("begin", self.begin, 0, LONGEST))
        put_in(self, scatter=checked_number("scatter", self.scatter, 0, 1))
        if not isinstance(self.back, bool | np.bool_):
            raise ValueError(f"back must be one of False, True, got {told(self.back)}")
        put_in(
            self,
            laps=whole("laps", self.laps, 1, MOST_LAPS),
            seed=whole("seed", self.seed, 0, 2**63),
        )
        check_pairs("stops", self.stops)
        for k, seconds in self.stops:
            checked_number("the time of a stop", seconds, 0.01, LONGEST)
            if isinstance(k, bool) or k not in range(len(self.places)):
                raise ValueError(f"a stop must be at one of {len(self.places)} places, got place {told(k)}")
        put_in(self, stops=tuple((int(k), float(seconds)) for k, seconds in self.stops))
        if self.times and (len(self.times) != len(self.places) or min(np.diff(self.times), default=1) <= 0):
            rule = f"times must increase, one for each of {len(self.places)} places"
            raise ValueError(f"{rule}, got {len(self.times)}")
        steps = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        if self.times:
            checked_number("the last of the times", max(self.times, key=abs), -FARTHEST, FARTHEST)
            fastest = (steps / np.diff(self.times)).max(initial=0)
            if fastest > FASTEST or np.ptp(self.times) > LONGEST:
                rule = f"a replayed walk must be at most {FASTEST:g} m/s fast and {LONGEST:g} s long"
                raise ValueError(f"{rule}, got {fastest:.1f} and {np.ptp(self.times):.1f}")
        elif not steps.all():
            raise ValueError(
                f"a person's places must differ from one to the next, got {self.places[steps.argmin()]} twice"
            )


@dataclass(frozen=True)
class Move:
    """Somebody moves an object while the laser watches.

    Attributes
    ----------
    object : int
        Which one.
    begin, seconds : float
        When, and how long it takes, in s.
    to : tuple of 2 floats
        Where it stands afterwards, in m.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    object: int
    begin: float
    to: tuple
    seconds: float = 1.0

    def __post_init__(self):
        to = checked_array("to", self.to, 2, least=-FARTHEST, most=FARTHEST)
        object.__setattr__(self, "to", tuple(to.tolist()))
        put_in(self, begin=checked_number("begin", self.begin, 0, LONGEST))
        put_in(self, seconds=checked_number("seconds", self.seconds, 0.01, LONGEST))


def check_pairs(name, values):
    """Refuse what is no sequence of pairs."""
    pairs = isinstance(values, tuple | list) and all(isinstance(each, tuple | list) for each in values)
    if not pairs or any(len(each) != 2 for each in values):
        raise ValueError(f"{name} must be a sequence of pairs, got {told(values)}")


def whole(name, value, least, most):
    """A whole number within bounds as an int."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer) or not least <= value <= most:
        raise ValueError(f"{name} must be a whole number, {least} to {most}, got {told(value)}")
    if value != int(value):
        raise ValueError(f"{name} must be a whole number, {least} to {most}, got {told(value)}")
    return int(value)


def as_pose(name, values):
    """A pose (3,) as a tuple."""
    return tuple(checked_array(name, values, 3, least=-FARTHEST, most=FARTHEST).tolist())


def as_places(name, values):
    """Places (K, 2) as a tuple of tuples."""
    if isinstance(values, tuple | list) and not values:
        return ()
    return tuple(map(tuple, checked_positions(name, checked_array(name, values, "N", 2)).tolist()))
