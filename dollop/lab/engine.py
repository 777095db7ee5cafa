"""The one door to PyBullet: build a scene, cast beams, step, contacts, a picture.

Nothing else imports it. An engine that offers the methods of `Engine` could take its place.
"""

from collections import namedtuple

import numpy as np
import pybullet

__all__ = ["STEPS_PER_SECOND", "Engine", "Solid"]

STEPS_PER_SECOND = 240
"""Steps of physics per second, as PyBullet recommends."""
COMPOUND = 16
"""Parts of a compound shape: PyBullet silently leaves out what is beyond that."""
STANDING = 2
"""Collision group in which PyBullet puts what never moves by itself: all that beams meet."""
TOUCH = 0.001
"""Distance in m from which two bodies touch."""
SUPERSAMPLING = 2
SHAPES = {"box": pybullet.GEOM_BOX, "capsule": pybullet.GEOM_CAPSULE, "cylinder": pybullet.GEOM_CYLINDER}
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LIGHT = np.array([-0.35, -0.45, 0.82])


class Solid(namedtuple("Solid", "shape size centre orientation", defaults=[UPRIGHT])):
    """What a body is made of: one convex shape.

    Attributes
    ----------
    shape : str
        "box", "capsule" or "cylinder"; the last is ten times slower for beams.
    size : tuple of 3 floats
        Extent in m along x, y and z before it is turned. Of what is round the first is the
        diameter, and the last of a capsule is its length without its two round ends.
    centre : tuple of 3 floats
        In the body's frame, in m.
    orientation : tuple of 4 floats
        Quaternion x, y, z, w.
    """

    __slots__ = ()


class Engine:
    """A PyBullet server of its own, without a window; to be used in a `with` statement."""

    def __init__(self):
        self._client = pybullet.connect(pybullet.DIRECT)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pybullet.disconnect(self._client)

    def _call(self, function, *arguments, **keywords):
        """Call a function of PyBullet, given by its name, on this server."""
        return getattr(pybullet, function)(*arguments, physicsClientId=self._client, **keywords)

    # ---- build

    def add_floor(self):
        """A floor for things to stand on, and gravity.

        Returns
        -------
        int
            The body.
        """
        self._call("setGravity", 0, 0, -9.81)
        self._call("setTimeStep", 1 / STEPS_PER_SECOND)
        return self._call("createMultiBody", 0, self._call("createCollisionShape", pybullet.GEOM_PLANE))

    def add(self, solids, position=(0.0, 0.0, 0.0)):
        """A body that never moves by itself.

        Parameters
        ----------
        solids : sequence of Solid
        position : (3,) sequence of float
            x, y, z in m.

        Returns
        -------
        int
            The body. Of more than 16 solids it is the last one.
        """
        for start in range(0, len(solids), COMPOUND):
            shape = self._shape(solids[start : start + COMPOUND])
            body = self._call("createMultiBody", 0, shape, -1, position)
        return body

    def _shape(self, solids):
        """One collision shape: rays are faster than through a body for each."""
        shapes, sizes, centres, turns = zip(*solids, strict=True)
        if len(solids) == 1 and not np.any(centres):
            (width, depth, length), kind = sizes[0], SHAPES[shapes[0]]
            size = {"halfExtents": [width / 2, depth / 2, length / 2], "radius": width / 2, "height": length}
            return self._call("createCollisionShape", kind, collisionFrameOrientation=turns[0], **size)
        sizes = np.array(sizes, dtype=float)
        turned = (
            {"collisionFrameOrientations": [list(turn) for turn in turns]}
            if any(turn != UPRIGHT for turn in turns)
            else {}
        )
        return self._call(
            "createCollisionShapeArray",
            shapeTypes=[SHAPES[shape] for shape in shapes],
            halfExtents=(sizes / 2).tolist(),
            radii=(sizes[:, 0] / 2).tolist(),
            lengths=sizes[:, 2].tolist(),
            collisionFramePositions=[list(centre) for centre in centres],
            **turned,
        )

    def add_robot(self, path, tyres, sliding):
        """A robot that drives on wheels; beams pass through it, for they are its own.

        Parameters
        ----------
        path : Path
            URDF file.
        tyres : sequence of int
            Links that grip.
        sliding : int
            Link that slides, so that it need not swivel.

        Returns
        -------
        int
            The body.
        """
        body = self._call("loadURDF", str(path))
        for link, friction in ((sliding, 0.0), *((tyre, 1.2) for tyre in tyres)):
            self._call("changeDynamics", body, link, lateralFriction=friction)
        # with friction in the same call PyBullet would give it to the hull, whichever link is named
        self._call("changeDynamics", body, -1, linearDamping=0.0, angularDamping=0.0)
        return body

    def remove(self, body):
        """Take a body out of the world.

        Parameters
        ----------
        body : int
        """
        self._call("removeBody", body)

    def place(self, body, position, heading=0.0):
        """Put a body somewhere, upright.

        Parameters
        ----------
        body : int
        position : (3,) sequence of float
            In m; of a robot, of its centre of mass.
        heading : float
            In rad.
        """
        upright = (0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))
        self._call("resetBasePositionAndOrientation", body, position, upright)

    # ---- cast beams

    def cast(self, start, directions, reach):
        """How far beams go until they meet a body.

        Parameters
        ----------
        start : (3,) float array
            In m.
        directions : (B, 3) float array
            Unit vectors.
        reach : float
            Length of the beams in m.

        Returns
        -------
        (B,) float array
            Metres, `inf` where a beam meets nothing.
        """
        starts = np.tile(start, (len(directions), 1))
        told = {"numThreads": 1, "collisionFilterMask": STANDING}
        hits = self._call("rayTestBatch", starts, start + reach * directions, **told)
        fractions = np.array([hit[2] for hit in hits])
        return np.where(fractions < 1.0, reach * fractions, np.inf)

    # ---- step

    def step(self):
        """Let one step of physics pass."""
        self._call("stepSimulation")

    def centre_of_mass(self, body):
        """Where a body's mass has its centre, in its own frame.

        Parameters
        ----------
        body : int

        Returns
        -------
        (3,) float array
            In m.
        """
        return np.array(self._call("getDynamicsInfo", body, -1)[3])

    def pose(self, body):
        """Where a body is.

        Parameters
        ----------
        body : int

        Returns
        -------
        centre : tuple of 3 floats
            Of its mass, in m.
        turn : (3, 3) float array
            Rotation matrix.
        theta : float
            Angle about the vertical in rad.
        """
        centre, orientation = self._call("getBasePositionAndOrientation", body)
        turn = np.array(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        return centre, turn, pybullet.getEulerFromQuaternion(orientation)[2]

    def velocity(self, body):
        """How a body moves.

        Parameters
        ----------
        body : int

        Returns
        -------
        linear, angular : tuples of 3 floats
            In m/s and rad/s.
        """
        return self._call("getBaseVelocity", body)

    def turn_wheels(self, body, wheels, rates, torque):
        """Tell the motors of wheels how fast to turn.

        Parameters
        ----------
        body : int
        wheels : sequence of int
            Joints.
        rates : sequence of float
            In rad/s.
        torque : float
            The most that each gives, in Nm.
        """
        wanted = {"targetVelocities": rates, "forces": [torque] * len(wheels)}
        self._call("setJointMotorControlArray", body, wheels, pybullet.VELOCITY_CONTROL, **wanted)

    def wheel_angles(self, body, wheels):
        """How far wheels have turned.

        Parameters
        ----------
        body : int
        wheels : sequence of int
            Joints.

        Returns
        -------
        (W,) float array
            In rad.
        """
        return np.array([state[0] for state in self._call("getJointStates", body, wheels)])

    def stop_wheels(self, body, wheels):
        """Put wheels at rest, turned by nothing.

        Parameters
        ----------
        body : int
        wheels : sequence of int
            Joints.
        """
        for wheel in wheels:
            self._call("resetJointState", body, wheel, 0.0, 0.0)

    # ---- contacts

    def touched(self, body):
        """Which bodies a body touches, as of the last step.

        Parameters
        ----------
        body : int

        Returns
        -------
        set of int
        """
        contacts = self._call("getContactPoints", body)
        return {contact[2] for contact in contacts if contact[8] < TOUCH} - {body}

    # ---- a picture

    def show(self, position, colour, size=None, mesh=None, orientation=UPRIGHT):
        """Something to look at, without weight and not in the way.

        Parameters
        ----------
        position : (3,) sequence of float
            In m.
        colour : tuple of 3 floats
            Red, green, blue in 0 to 1.
        size : (3,) sequence of float, optional
            Of a box, in m.
        mesh : dict, optional
            Otherwise `vertices` (V, 3), `indices` (I,), three for each triangle, `normals` (V, 3)
            and `uvs` (V, 2), as lists.
        orientation : tuple of 4 floats
            Quaternion x, y, z, w.

        Returns
        -------
        int
            The body.
        """
        kind = pybullet.GEOM_BOX if mesh is None else pybullet.GEOM_MESH
        shape = {"halfExtents": [extent / 2 for extent in size]} if mesh is None else mesh
        paint = {"rgbaColor": (*colour, 1.0), "specularColor": (0.2, 0.2, 0.2)}
        seen = self._call("createVisualShape", kind, **paint, **shape)
        return self._call("createMultiBody", 0, -1, seen, position, orientation)

    def paper(self, body, picture):
        """Cover something to look at with a picture.

        Parameters
        ----------
        body : int
        picture : Path
            A PNG file.
        """
        texture = self._call("loadTexture", str(picture))
        self._call("changeVisualShape", body, -1, textureUniqueId=texture)

    def photograph(self, eye, target, view_angle, width, height):
        """A picture of all there is to look at, after which it stands round the target.

        The renderer is PyBullet's own, in software: no display or graphics card needed. It draws
        collision shapes where it finds no others.

        Parameters
        ----------
        eye, target : (3,) sequence of float
            From where and whereto, in m.
        view_angle : float
            From top to bottom, in degrees.
        width, height : int
            Pixels.

        Returns
        -------
        (height, width, 3) uint8 array
        """
        eye, target = self._recentred(eye, target)
        farthest = max(20.0, 2 * np.linalg.norm(np.subtract(eye, target)))
        lens = pybullet.computeProjectionMatrixFOV(view_angle, width / height, 0.1, farthest)
        pixels = self._call(
            "getCameraImage",
            SUPERSAMPLING * width,
            SUPERSAMPLING * height,
            viewMatrix=pybullet.computeViewMatrix(eye, target, (0.0, 0.0, 1.0)),
            projectionMatrix=lens,
            lightDirection=LIGHT.tolist(),
            lightDistance=12,
            lightAmbientCoeff=0.58,
            lightDiffuseCoeff=0.46,
            lightSpecularCoeff=0.15,
            shadow=1,
            renderer=pybullet.ER_TINY_RENDERER,
        )[2]
        pixels = np.asarray(pixels, dtype=float)
        image = pixels.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 4).mean(axis=(1, 3))
        return np.round(image[..., :3]).astype(np.uint8)

    def _recentred(self, eye, target):
        """Move the target to the origin, round which alone the renderer casts good shadows."""
        centre = np.array([*target[:2], 0.0])
        for index in range(self._call("getNumBodies")):
            body = self._call("getBodyUniqueId", index)
            position, orientation = self._call("getBasePositionAndOrientation", body)
            self._call("resetBasePositionAndOrientation", body, position - centre, orientation)
        return eye - centre, target - centre
