"""Pictures of the laboratory, by PyBullet's software renderer: no display or graphics card needed.

The renderer draws collision shapes where it finds no others, so a picture is taken in a server of
its own that holds only things to look at.
"""

import tempfile
from pathlib import Path

import numpy as np
import pybullet
from matplotlib.image import imsave

from dollop.lab.pioneer import Pioneer
from dollop.lab.scenes import FURNITURE, KINDS, ROOM, WHITE, Part, figure_eight_scene
from dollop.lab.world import Server, body_offsets
from dollop.pose import rotation

__all__ = ["render_lab", "render_robot"]

SUPERSAMPLING = 2
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LIGHT = np.array([-0.35, -0.45, 0.82])
CLOTH, JEANS = (0.16, 0.38, 0.55), (0.17, 0.20, 0.30)
SKIN, HAIR = (0.80, 0.60, 0.47), (0.20, 0.13, 0.08)
ORANGE, PALE = (0.93, 0.36, 0.06), (0.95, 0.94, 0.90)
BIN, BAG = (0.33, 0.35, 0.37), (0.10, 0.10, 0.11)
CHEST = [(0.20, 0.42), (0.205, 0.54), (0.15, 0.60), (0.05, 0.63)]
TORSO = [(0.10, 0.0), (0.165, 0.02), (0.16, 0.15), *CHEST]


def render_robot(width=1200, height=900):
    """Agent Orange in the laboratory, three quarters from the front (Fig. 1).

    Parameters
    ----------
    width, height : int
        Pixels.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    with Server() as studio:
        furnish(studio)
        Pioneer(studio, (4.5, 3.2, -2.0))
        return photograph(studio, (4.72, 2.02, 0.56), (4.51, 3.2, 0.24), 31.0, width, height)


def render_lab(scene=None, walker=None, width=1200, height=900):
    """The laboratory with robot and objects, from above the wall behind the robot (Fig. 5).

    Parameters
    ----------
    scene : Scene, optional
        `figure_eight_scene()` when not given.
    walker : tuple, optional
        Position (2,) in m, heading in rad and gait phase in rad of a person to show, as `Walk.at`
        gives them.
    width, height : int
        Pixels.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    scene = scene or figure_eight_scene()
    with Server() as studio:
        furnish(studio)
        for kind, position in zip(scene.kinds, scene.positions, strict=True):
            LOOKS[kind](studio, KINDS[kind], position)
        Pioneer(studio, scene.robot)
        if walker is not None:
            show_person(studio, *walker)
        return photograph(studio, (2.2, -3.6, 4.3), (4.45, 3.4, 0.25), 50.0, width, height)


def photograph(studio, eye, target, view_angle, width, height):
    """What is seen from `eye` (3,) to `target` (3,) in m, under a vertical `view_angle` in deg."""
    eye, target = recentred(studio, eye, target)
    fine = SUPERSAMPLING * width, SUPERSAMPLING * height
    lens = pybullet.computeProjectionMatrixFOV(view_angle, width / height, 0.1, 20.0)
    pixels = studio.call(
        "getCameraImage",
        *fine,
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


def recentred(studio, eye, target):
    """Move the target to the origin, round which alone the renderer casts good shadows."""
    centre = np.array([*target[:2], 0.0])
    for index in range(studio.call("getNumBodies")):
        body = studio.call("getBodyUniqueId", index)
        position, orientation = studio.call("getBasePositionAndOrientation", body)
        studio.call("resetBasePositionAndOrientation", body, position - centre, orientation)
    return eye - centre, target - centre


def furnish(studio):
    """Floor, furniture and the two walls that do not stand before the camera."""
    show_floor(studio)
    width, depth = ROOM
    panels = [
        Part("box", (width / 2, depth + 0.05, 1.2), (width + 0.2, 0.1, 2.4), WHITE),
        Part("box", (width + 0.05, depth / 2, 1.2), (0.1, depth, 2.4), WHITE),
        Part("box", (-0.05, depth / 2, 1.2), (0.1, depth, 2.4), WHITE),
        Part("box", (width / 2, depth - 0.01, 0.05), (width, 0.02, 0.1), BIN),
        Part("box", (width - 0.01, depth / 2, 0.05), (0.02, depth, 0.1), BIN),
    ]
    for part in (*panels, *FURNITURE):
        show_part(studio, part)


def show_part(studio, part):
    """A box, or a cylinder rounder than PyBullet's own."""
    x, y, z = part.centre
    half = [extent / 2 for extent in part.size]
    if part.shape == "box":
        show(studio, part.centre, part.colour, pybullet.GEOM_BOX, halfExtents=half)
    else:
        radius, height = half[0], 2 * half[2]
        profile = [(0, 0), (radius, 0), (radius, height), (0, height)]
        show_lathed(studio, (x, y, z - half[2]), profile, part.colour)


def show(studio, position, colour, kind, orientation=UPRIGHT, **size):
    """A coloured thing without weight; the orientation is a quaternion x, y, z, w."""
    paint = {"rgbaColor": (*colour, 1.0), "specularColor": (0.2, 0.2, 0.2)}
    shape = studio.call("createVisualShape", kind, **paint, **size)
    return studio.call("createMultiBody", 0, -1, shape, position, orientation)


def show_lathed(studio, position, profile, colour, squash=1.0, orientation=UPRIGHT):
    """A body of revolution as of `lathe`, standing at a place (3,) in m, turned by a quaternion."""
    vertices, indices, normals = lathe(np.asarray(profile, dtype=float), squash)
    mesh = {"vertices": vertices, "indices": indices, "normals": normals}
    mesh = {name: part.tolist() for name, part in mesh.items()}
    uvs = [[0.0, 0.0]] * len(vertices)
    return show(studio, position, colour, pybullet.GEOM_MESH, orientation, **mesh, uvs=uvs)


def lathe(profile, squash, sides=48):
    """A mesh of revolution about the vertical.

    Parameters
    ----------
    profile : (K, 2) array
        Radius and height in m, from the bottom upwards.
    squash : float
        Extent along x over extent along y.
    sides : int

    Returns
    -------
    vertices : (V, 3) array
    indices : (I,) int array
        Three for each triangle.
    normals : (V, 3) array
    """
    turn = np.linspace(0.0, 2 * np.pi, sides + 1)
    rings = zip(profile[:-1], profile[1:], strict=True)
    bands = [band(*pair, turn, squash) for pair in rings]
    vertices, normals = (np.concatenate(parts) for parts in zip(*bands, strict=True))
    low = (np.arange(len(bands))[:, None] * 2 * len(turn) + np.arange(sides)).ravel()
    high = low + len(turn)
    indices = np.column_stack([low, low + 1, high + 1, low, high + 1, high])
    return vertices, indices.ravel(), normals


def band(low, high, turn, squash):
    """Vertices and normals, (2 S, 3) each, between two rings (radius, height); edges stay sharp."""
    (r0, h0), (r1, h1) = low, high
    cos, sin, level = np.cos(turn), np.sin(turn), np.zeros(len(turn))
    lower = np.column_stack([r0 * squash * cos, r0 * sin, level + h0])
    upper = np.column_stack([r1 * squash * cos, r1 * sin, level + h1])
    normal = np.column_stack([(h1 - h0) * cos / squash, (h1 - h0) * sin, level + r0 - r1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.concatenate([lower, upper]), np.tile(normal, (2, 1))


def show_floor(studio, tile=0.5, margin=4.0):
    """Linoleum tiles of `tile` m reaching `margin` m beyond the room."""
    low, high = -margin, np.array(ROOM) + margin
    right, top = high
    mesh = {
        "vertices": [(low, low, 0.0), (right, low, 0.0), (right, top, 0.0), (low, top, 0.0)],
        "indices": [0, 1, 2, 0, 2, 3],
        "normals": [(0.0, 0.0, 1.0)] * 4,
        "uvs": (np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * (high - low) / (2 * tile)).tolist(),
    }
    floor = show(studio, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), pybullet.GEOM_MESH, **mesh)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tiles.png"
        imsave(path, tile_texture())
        texture = studio.call("loadTexture", str(path))
        studio.call("changeVisualShape", floor, -1, textureUniqueId=texture)


def tile_texture(size=256):
    """Two by two speckled tiles, (size, size, 3) in 0 to 1."""
    rng = np.random.default_rng(0)
    half = np.arange(size) < size // 2
    shade = np.where(half[:, None] ^ half, 0.80, 0.74)
    shade = shade + 0.012 * rng.standard_normal((size, size))
    joint = np.arange(size) % (size // 2) < 2
    shade = np.where(joint[:, None] | joint, 0.62, shade)
    return np.clip(shade[..., None] * np.array([1.0, 0.985, 0.95]), 0.0, 1.0)


def show_can(studio, kind, position):
    """A trash can: tapered wall, rim, and the bag inside."""
    r, h = kind.beam_radius, kind.height
    foot = (*position, 0.0)
    show_lathed(studio, foot, [(0, 0), (0.92 * r, 0), (1.04 * r, h)], BIN)
    rim = [(1.10 * r, h - 0.05), (1.10 * r, h), (0.98 * r, h), (0.94 * r, h - 0.2)]
    show_lathed(studio, foot, rim, BAG)
    show_lathed(studio, foot, [(0.95 * r, h - 0.12), (0, h - 0.12)], BAG)


def show_cone(studio, kind, position):
    """A slalom cone: square foot, orange cone, white band."""
    slope = 0.17 / kind.height

    def radius(height):
        return kind.beam_radius + slope * (0.36 - height)

    half = kind.foot_radius / np.sqrt(2)
    show(studio, (*position, 0.02), BAG, pybullet.GEOM_BOX, halfExtents=[half, half, 0.02])
    bands = (0.04, 0.45, ORANGE), (0.45, 0.70, PALE), (0.70, kind.height, ORANGE)
    for low, high, colour in bands:
        show_lathed(studio, (*position, 0.0), [(radius(low), low), (radius(high), high)], colour)


LOOKS = {"trash can": show_can, "cone": show_cone}


def show_person(studio, position, heading, phase):
    """A person in mid-step, for the eye only: the laser meets the simpler body of `World`."""
    turn = np.eye(3)
    turn[:2, :2] = rotation(heading)
    facing = (0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))

    def put(offset, profile, colour, squash=1.0):
        place = (*position, 0.0) + turn @ np.asarray(offset)
        show_lathed(studio, place, profile, colour, squash, facing)

    def limb(start, end, radii, colour):
        ends = [(*position, 0.0) + turn @ np.asarray(point) for point in (start, end)]
        show_limb(studio, *ends, radii, colour)

    for (ahead, left), side in zip(body_offsets(True, phase), (1, -1), strict=True):
        knee, elbow, hand = 0.3 * ahead + 0.03, -0.5 * ahead - 0.02, -1.1 * ahead + 0.04
        out = 0.255 * side
        put((ahead + 0.04, left, 0.0), [(0.045, 0), (0.05, 0.05), (0.02, 0.09)], BAG, 2.4)
        limb((ahead, left, 0.06), (knee, left, 0.48), (0.045, 0.06), JEANS)
        limb((knee, left, 0.46), (0.0, 0.9 * left, 0.90), (0.06, 0.085), JEANS)
        limb((0.0, 0.21 * side, 1.40), (elbow, out, 1.12), (0.055, 0.045), CLOTH)
        limb((elbow, out, 1.14), (hand, 0.25 * side, 0.90), (0.045, 0.035), CLOTH)
        put((-1.15 * ahead + 0.05, 0.25 * side, 0.79), ellipse(0.04, 0.06), SKIN)
    put((0, 0, 0.84), TORSO, CLOTH, 0.6)
    put((0, 0, 1.43), [(0.052, 0), (0.052, 0.10)], SKIN)
    put((0.015, 0, 1.50), ellipse(0.08, 0.12), SKIN, 1.15)
    put((-0.01, 0, 1.55), ellipse(0.085, 0.105), HAIR, 1.1)


def show_limb(studio, start, end, radii, colour):
    """A tapered limb from start (3,) to end (3,) in m, round at both."""
    along = end - start
    length = np.linalg.norm(along)
    turn = np.array([-along[1], along[0], 0.0, length + along[2]])
    turn /= np.linalg.norm(turn)  # the quaternion from the vertical to `along`
    profile = [(0.0, -radii[0]), (radii[0], 0.0), (radii[1], length), (0.0, length + radii[1])]
    show_lathed(studio, start, profile, colour, orientation=turn)


def ellipse(radius, half_height, steps=12):
    """Profile of an ellipsoid standing on the floor."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, steps)
    return np.column_stack([radius * np.cos(angle), half_height * (1 + np.sin(angle))])
