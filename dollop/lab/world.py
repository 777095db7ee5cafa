"""A scene in the simulator, for beams and wheels: background, objects and people."""

import numpy as np

from dollop.lab.engine import Engine, Solid
from dollop.lab.person import DEPTH, LEG_RADIUS, SHOULDERS, body_offsets
from dollop.pose import rotation

__all__ = ["World"]

AWAY = (0.0, 0.0, -10.0)
HULL = 0.24
"""m: up to here a robot's hull touches things."""
LYING = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))


class World:
    """A laboratory with floor, background, foreground objects and people (Sec. II).

    To be used in a `with` statement. People are out of the way until `at` is called.

    Parameters
    ----------
    scene : Scene
    walks : sequence of Walk
        Of the people in it.

    Attributes
    ----------
    scene : Scene
    engine : Engine
        The simulator.
    floor : int
        The body of the floor.
    """

    def __init__(self, scene, walks=()):
        self.scene, self.walks, self.engine = scene, tuple(walks), Engine()
        height = scene.robot.beam_height
        self.floor = self.engine.add_floor()
        self.engine.add([solid_of_part(part, height) for part in scene.room.parts])
        self._objects = [self._add_object(each, height) for each in scene.objects]
        self._people = [[self.engine.add([limb], AWAY) for limb in limbs(walk.body)] for walk in self.walks]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.engine.__exit__()

    def _add_object(self, each, height):
        return self.engine.add(solids_of_object(each, height), (*each.position, 0.0))

    def at(self, t):
        """Put people and moved objects where they are at a time.

        Parameters
        ----------
        t : float
            In s.
        """
        height = self.scene.robot.beam_height
        for walk, bodies in zip(self.walks, self._people, strict=True):
            position, heading, phase = walk.at(t)
            for body, offset in zip(bodies, body_offsets(walk.body, phase), strict=True):
                self.engine.place(body, (*(position + rotation(heading) @ offset), height), heading)
        for k in {move.object for move in self.scene.moves}:
            self.engine.place(self._objects[k], (*self.scene.object_at(k, t), 0.0))

    def cast(self, pose, angles, reach):
        """True distance along each beam of a laser.

        Parameters
        ----------
        pose : (3,) sequence of float
            Of the laser: x, y in m, theta in rad.
        angles : (B,) array
            Bearings in rad in the laser's frame.
        reach : float
            Length of the beams in m.

        Returns
        -------
        (B,) float array
            Metres, `inf` where a beam meets nothing.
        """
        x, y, theta = pose
        bearings = angles + theta
        directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(angles))])
        return self.engine.cast(np.array([x, y, self.scene.robot.beam_height]), directions, reach)

    def scan(self, pose, rng, scanner=None):
        """What a laser reports from a place in the laboratory.

        Parameters
        ----------
        pose : (3,) sequence of float
            Of the laser: x, y in m, theta in rad.
        rng : numpy.random.Generator
        scanner : Scanner, optional
            The robot's own when not given.

        Returns
        -------
        (B,) float array
            Ranges in m, `inf` where nothing came back.
        """
        scanner = scanner or self.scene.robot.scanner
        return scanner.report(self.cast(pose, scanner.angles, scanner.max_range), rng)


def solid_of_part(part, beam_height):
    """Furniture as beams meet it ten times faster than PyBullet's cylinder: capsules, flat ones boxes.

    A capsule adds its two round ends to its length; where the beam would meet one of them the
    cylinder stays.
    """
    width, depth, height = part.size
    half_turn = part.turn / 2
    turn = (0.0, 0.0, float(np.sin(half_turn)), float(np.cos(half_turn)))
    if part.shape == "box" or height <= width:
        flat = part.shape == "cylinder" and part.reaches(beam_height)
        return Solid("cylinder" if flat else "box", part.size, part.centre, turn)
    straight = abs(beam_height - part.centre[2]) <= (height - width) / 2
    if straight or not part.reaches(beam_height):
        return Solid("capsule", (width, depth, height - width), part.centre)
    return Solid("cylinder", part.size, part.centre)


def solids_of_object(each, beam_height):
    """A foreground object, round at its position: as it is at the beam, and as wide below as it is there.

    What is round is an upright capsule, straight from the floor to the beam, on a square foot.
    """
    outline = each.outline(beam_height)
    if each.shape == "box":
        width, depth = each.size
        half_turn = each.turn / 2
        turn = (0.0, 0.0, float(np.sin(half_turn)), float(np.cos(half_turn)))
        return [Solid("box", (width, depth, each.height), (0.0, 0.0, each.height / 2), turn)]
    below = min(HULL, each.height, 0.9 * beam_height)
    skirt = Solid("cylinder", (each.size[0], each.size[0], below), (0.0, 0.0, below / 2))
    if outline is None:
        return [skirt]
    radius = outline.radius
    length = max(each.height - radius, beam_height)
    side = np.sqrt(2) * max(each.reach, radius)
    foot = Solid("box", (side, side, 0.06), (0.0, 0.0, 0.03))
    trunk = Solid("capsule", (2 * radius, 2 * radius, length), (0.0, 0.0, length / 2))
    return [trunk, foot] if each.foot or each.shape == "cylinder" else [trunk, skirt]


def limbs(body):
    """What a person shows the laser: a stadium across the shoulders, or two upright legs."""
    if body == "torso":
        return [Solid("capsule", (DEPTH, DEPTH, SHOULDERS - DEPTH), (0.0, 0.0, 0.0), LYING)]
    return 2 * [Solid("capsule", (2 * LEG_RADIUS, 2 * LEG_RADIUS, 0.4), (0.0, 0.0, 0.0))]
