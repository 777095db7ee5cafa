"""The laboratory as a PyBullet world: background, foreground objects and a person for rays and wheels to meet."""

import numpy as np

from dollop.lab.person import DEPTH, SHOULDERS, STRIDE_RATE
from dollop.lab.scenes import BACKGROUND, BEAM_HEIGHT, KINDS

try:
    import pybullet
except ImportError as error:
    raise ImportError(
        'the laboratory needs PyBullet: pip install "dollop[lab]" (it has wheels only for Linux x86-64 and '
        "CPython 3.11 or older); recordings made in the laboratory can be read without it"
    ) from error

PHYSICS_RATE = 240
LEG_RADIUS = 0.055
LEG_SPREAD = 0.09
AWAY = (0.0, 0.0, -10.0)


class Server:
    """A PyBullet server of its own, without a window; to be used in a `with` statement."""

    def __init__(self):
        self.client = pybullet.connect(pybullet.DIRECT)

    def call(self, function, *arguments, **keywords):
        """Call a function of PyBullet, by name, on this server."""
        return getattr(pybullet, function)(*arguments, physicsClientId=self.client, **keywords)

    def close(self):
        """Shut the server down."""
        pybullet.disconnect(self.client)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class World(Server):
    """A laboratory with floor, background, foreground objects and a person, for rays and wheels.

    Parameters
    ----------
    scene : Scene
        The movable foreground objects.
    legs : bool
        Whether a person shows the laser two striding legs instead of a torso.

    Attributes
    ----------
    floor : int
        PyBullet body of the floor.
    background : tuple of int
        PyBullet bodies of all walls and furniture.
    objects : tuple of int
        PyBullet body of each foreground object.
    """

    def __init__(self, scene, legs=False):
        super().__init__()
        self.scene, self.legs = scene, legs
        self.call("setGravity", 0, 0, -9.81)
        self.call("setTimeStep", 1 / PHYSICS_RATE)
        self.floor = self.fixed_body(self.call("createCollisionShape", pybullet.GEOM_PLANE))
        self.background = tuple(self.fixed_body(compound(self, parts)) for parts in batches(BACKGROUND))
        self.objects = tuple(
            add_object(self, KINDS[kind], position) for kind, position in zip(scene.kinds, scene.positions, strict=True)
        )
        self.person = (leg(self), leg(self)) if legs else (torso(self),)
        self.remove_person()

    def fixed_body(self, shape, position=(0.0, 0.0, 0.0)):
        """A body that never moves by itself, with the given collision shape."""
        return self.call("createMultiBody", 0, shape, -1, position)

    def place_person(self, position, heading, phase=0.0):
        """Put the person at `position` (2,) in m, facing `heading` in rad, at a `phase` of the gait in rad."""
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        upright = (0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))
        for body, offset in zip(self.person, body_offsets(self.legs, phase), strict=True):
            x, y = position + turn @ offset
            self.call("resetBasePositionAndOrientation", body, (x, y, BEAM_HEIGHT), upright)

    def remove_person(self):
        """Take the person out of the laser's way."""
        for body in self.person:
            self.call("resetBasePositionAndOrientation", body, AWAY, (0.0, 0.0, 0.0, 1.0))


def batches(parts):
    """The parts in the portions of 16 beyond which PyBullet silently leaves out the rest of a compound shape."""
    return [parts[start : start + 16] for start in range(0, len(parts), 16)]


def compound(world, parts):
    """One collision shape of up to 16 parts, through which rays are faster than through a body for each.

    Upright cylinders become capsules, flat ones boxes: a ray meets either ten times faster than PyBullet's cylinder.
    """
    capsules = [part.shape == "cylinder" and part.size[2] > part.size[0] for part in parts]
    return world.call(
        "createCollisionShapeArray",
        shapeTypes=[pybullet.GEOM_CAPSULE if capsule else pybullet.GEOM_BOX for capsule in capsules],
        halfExtents=[[extent / 2 for extent in part.size] for part in parts],
        radii=[part.size[0] / 2 for part in parts],
        lengths=[part.size[2] - part.size[0] for part in parts],  # a capsule adds its two round ends
        collisionFramePositions=[part.centre for part in parts],
    )


def add_object(world, kind, position):
    """A foreground object: an upright capsule, round at the beam as the object is, on a square foot."""
    foot = kind.foot_radius / np.sqrt(2) if kind.foot_radius > kind.beam_radius else kind.beam_radius / np.sqrt(2)
    shape = world.call(
        "createCollisionShapeArray",
        shapeTypes=[pybullet.GEOM_CAPSULE, pybullet.GEOM_BOX],
        radii=[kind.beam_radius, 0.0],
        lengths=[kind.height - kind.beam_radius, 0.0],
        halfExtents=[[0.0, 0.0, 0.0], [foot, foot, 0.03]],
        collisionFramePositions=[[0.0, 0.0, (kind.height - kind.beam_radius) / 2], [0.0, 0.0, 0.03]],
    )
    return world.fixed_body(shape, (*position, 0.0))


def torso(world):
    """A capsule lying across the shoulders at the height of the laser, which cuts it as a stadium."""
    shape = world.call(
        "createCollisionShapeArray",
        shapeTypes=[pybullet.GEOM_CAPSULE],
        radii=[DEPTH / 2],
        lengths=[SHOULDERS - DEPTH],
        collisionFramePositions=[[0.0, 0.0, 0.0]],
        collisionFrameOrientations=[[np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]],
    )
    return world.fixed_body(shape)


def leg(world):
    """An upright capsule as thick as a leg is at the height of the laser."""
    return world.fixed_body(world.call("createCollisionShape", pybullet.GEOM_CAPSULE, radius=LEG_RADIUS, height=0.4))


def body_offsets(legs, phase):
    """Where torso or legs are, (1, 2) or (2, 2) in m, ahead and to the left of the middle of the body.

    The legs swing with an amplitude at which a foot would stand still on the floor in mid-stance at 1 m/s.
    """
    if not legs:
        return np.zeros((1, 2))
    stride = np.sin(phase) / (2 * np.pi * STRIDE_RATE)
    return np.array([[stride, LEG_SPREAD], [-stride, -LEG_SPREAD]])
