"""The laboratory as a PyBullet world: background, objects and a person, for rays and wheels."""

import numpy as np
import pybullet

from dollop.lab.person import DEPTH, SHOULDERS, STRIDE_RATE
from dollop.lab.scenes import BACKGROUND, BEAM_HEIGHT, KINDS
from dollop.pose import rotation

__all__ = ["PHYSICS_RATE", "Server", "World", "body_offsets"]

PHYSICS_RATE = 240
"""Steps of physics per second, as PyBullet recommends."""
COMPOUND = 16
"""Parts of a compound shape: PyBullet silently leaves out what is beyond that."""
LEG_RADIUS = 0.055
LEG_SPREAD = 0.09
AWAY = (0.0, 0.0, -10.0)


class Server:
    """A PyBullet server of its own, without a window; to be used in a `with` statement.

    Attributes
    ----------
    client : int
        By which PyBullet knows it.
    """

    def __init__(self):
        self.client = pybullet.connect(pybullet.DIRECT)

    def call(self, function, *arguments, **keywords):
        """Call a function of PyBullet on this server.

        Parameters
        ----------
        function : str
            Its name.
        *arguments, **keywords
            What it takes.

        Returns
        -------
        object
            What it returns.
        """
        return getattr(pybullet, function)(*arguments, physicsClientId=self.client, **keywords)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pybullet.disconnect(self.client)


class World(Server):
    """A laboratory with floor, background, foreground objects and a person (Sec. II).

    To be used in a `with` statement. The person is out of the way until it is placed.

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
    """

    def __init__(self, scene, legs=False):
        super().__init__()
        self.legs = legs
        self.call("setGravity", 0, 0, -9.81)
        self.call("setTimeStep", 1 / PHYSICS_RATE)
        self.floor = self.fixed_body(self.call("createCollisionShape", pybullet.GEOM_PLANE))
        for start in range(0, len(BACKGROUND), COMPOUND):
            self.fixed_body(compound(self, BACKGROUND[start : start + COMPOUND]))
        for kind, position in zip(scene.kinds, scene.positions, strict=True):
            add_object(self, KINDS[kind], position)
        self.person = (leg(self), leg(self)) if legs else (torso(self),)
        self.remove_person()

    def fixed_body(self, shape, position=(0.0, 0.0, 0.0)):
        """Make a body that never moves by itself.

        Parameters
        ----------
        shape : int
            Collision shape of PyBullet's.
        position : (3,) sequence of float
            x, y, z in m.

        Returns
        -------
        int
            PyBullet body.
        """
        return self.call("createMultiBody", 0, shape, -1, position)

    def place_person(self, position, heading, phase=0.0):
        """Put the person somewhere.

        Parameters
        ----------
        position : (2,) float array
            Middle of the body in m.
        heading : float
            Direction the chest points in, in rad.
        phase : float
            Phase of the gait in rad.
        """
        upright = (0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))
        for body, offset in zip(self.person, body_offsets(self.legs, phase), strict=True):
            x, y = position + rotation(heading) @ offset
            self.call("resetBasePositionAndOrientation", body, (x, y, BEAM_HEIGHT), upright)

    def remove_person(self):
        """Take the person out of the laser's way."""
        for body in self.person:
            self.call("resetBasePositionAndOrientation", body, AWAY, (0.0, 0.0, 0.0, 1.0))


def compound(world, parts):
    """One collision shape of up to 16 parts: rays are faster than through a body for each.

    Upright cylinders become capsules, flat ones boxes: a ray meets either ten times faster than
    PyBullet's cylinder. A capsule adds its two round ends to its length.
    """
    sizes = np.array([part.size for part in parts])
    round_ones = np.array([part.shape == "cylinder" for part in parts])
    capsules = round_ones & (sizes[:, 2] > sizes[:, 0])
    return world.call(
        "createCollisionShapeArray",
        shapeTypes=np.where(capsules, pybullet.GEOM_CAPSULE, pybullet.GEOM_BOX).tolist(),
        halfExtents=(sizes / 2).tolist(),
        radii=(sizes[:, 0] / 2).tolist(),
        lengths=(sizes[:, 2] - sizes[:, 0]).tolist(),
        collisionFramePositions=[part.centre for part in parts],
    )


def add_object(world, kind, position):
    """A foreground object: an upright capsule, as round as it is at the beam, on a square foot."""
    foot = max(kind.foot_radius, kind.beam_radius) / np.sqrt(2)
    length = kind.height - kind.beam_radius
    shape = world.call(
        "createCollisionShapeArray",
        shapeTypes=[pybullet.GEOM_CAPSULE, pybullet.GEOM_BOX],
        radii=[kind.beam_radius, 0.0],
        lengths=[length, 0.0],
        halfExtents=[[0.0, 0.0, 0.0], [foot, foot, 0.03]],
        collisionFramePositions=[[0.0, 0.0, length / 2], [0.0, 0.0, 0.03]],
    )
    return world.fixed_body(shape, (*position, 0.0))


def torso(world):
    """A capsule lying across the shoulders at the height of the laser, which sees a stadium."""
    lying = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    size = {"radius": DEPTH / 2, "height": SHOULDERS - DEPTH, "collisionFrameOrientation": lying}
    return world.fixed_body(world.call("createCollisionShape", pybullet.GEOM_CAPSULE, **size))


def leg(world):
    """An upright capsule as thick as a leg is at the height of the laser."""
    size = {"radius": LEG_RADIUS, "height": 0.4}
    return world.fixed_body(world.call("createCollisionShape", pybullet.GEOM_CAPSULE, **size))


def body_offsets(legs, phase):
    """Where torso or legs are, seen from the middle of the body.

    The legs swing with an amplitude at which a foot would stand still on the floor in mid-stance at
    1 m/s; a reconstruction.

    Parameters
    ----------
    legs : bool
        Whether there are two legs instead of a torso.
    phase : float
        Phase of the gait in rad.

    Returns
    -------
    (1, 2) or (2, 2) float array
        Ahead and to the left in m.

    Examples
    --------
    The body stays in the middle of its legs.

    >>> body_offsets(True, phase=1.0).mean(axis=0).tolist()
    [0.0, 0.0]
    """
    if not legs:
        return np.zeros((1, 2))
    stride = np.sin(phase) / (2 * np.pi * STRIDE_RATE)
    return np.array([[stride, LEG_SPREAD], [-stride, -LEG_SPREAD]])
