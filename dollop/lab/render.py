"""Pictures of the laboratory, or of any scene: what there is to look at, in place of what beams meet.

A picture is taken in a simulator of its own that holds nothing else.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.image import imsave
from PIL import Image, ImageChops, ImageDraw

from dollop.checks import checked_number
from dollop.lab.engine import Engine
from dollop.lab.person import body_offsets
from dollop.lab.pioneer import put_pioneer
from dollop.lab.rooms import LABORATORY, panel, walls
from dollop.lab.scenes import figure_eight_scene
from dollop.pose import rotation

__all__ = ["Studio", "camera", "render_lab", "render_robot"]

VIEW_ANGLE = 50.0
"""Degrees from top to bottom that a picture of a room takes in."""
AWAY = (0.0, 0.0, -30.0)
"""Where nothing is seen."""
PERSON_REACH, ROBOT_REACH = 1.35, 0.55
"""Radius in m of a ball round a person, or the robot, and what shadow falls."""
FILM_ANGLE, LOWER = 45.0, (-0.15, -0.15, -0.2)
"""A film looks closer than a picture of a room, in degrees, and by so many m beside where that looks."""
STRIP, FINER = 0.06, 1.1
"""Width of a strip on the floor in m, and pixels of a part for one of the picture."""
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
CLOTH, JEANS = (0.16, 0.38, 0.55), (0.17, 0.20, 0.30)
SKIN, HAIR = (0.80, 0.60, 0.47), (0.20, 0.13, 0.08)
ORANGE, PALE = (0.93, 0.36, 0.06), (0.95, 0.94, 0.90)
BIN, BAG, OAK = (0.33, 0.35, 0.37), (0.10, 0.10, 0.11), (0.72, 0.53, 0.33)
CHEST = [(0.20, 0.42), (0.205, 0.54), (0.15, 0.60), (0.05, 0.63)]
TORSO = [(0.10, 0.0), (0.165, 0.02), (0.16, 0.15), *CHEST]
TYRE, METAL = (0.10, 0.10, 0.10), (0.66, 0.67, 0.70)
TREAD = [(0.050, -0.020), (0.074, -0.020), (0.081, -0.014), (0.0835, -0.007)]
RIM = [(0.050, 0.012), (0.046, 0.014), (0.040, 0.008), (0.020, 0.010), (0.017, 0.022), (0.0, 0.022)]
"""Radius and height in m of half a tyre, and of a wheel's outer side, over the wheel's middle."""
SHOWN_WALLS = 4.3
"""m, to which walls are raised in a picture of the laboratory: nothing is seen above them."""
LAMP = np.array([-0.35, -0.45, 0.82])
"""Where the light comes from: the same as in a single picture."""
SOFT = 0.12
"""How far round its middle the light reaches where pictures are averaged, by its distance."""


class Darkroom(Engine):
    """An engine whose pictures can be averaged: edges are smooth then, and shadows soft."""

    def photograph(self, eye, target, view_angle, width, height, passes=1):
        """As of `Engine`, or the mean of so many, each with light and pixels a little aside.

        Parameters
        ----------
        eye, target : (3,) sequence of float
            From where and whereto, in m.
        view_angle : float
            From top to bottom, in degrees.
        width, height : int
            Pixels.
        passes : int

        Returns
        -------
        (height, width, 3) uint8 array
        """
        if passes == 1:
            return super().photograph(eye, target, view_angle, width, height)
        eye, target = self._recentred(eye, target)
        view = self._call("computeViewMatrix", eye, target, (0.0, 0.0, 1.0))
        seen_by = view_angle, width / height, 0.1, 20.0
        lens = np.array(self._call("computeProjectionMatrixFOV", *seen_by))
        total = np.zeros((height, width, 3))
        for aside, light in zip(scattered(passes), scattered(passes, 7), strict=True):
            seen = lens.copy()
            seen[8:10] += 2 * aside / (width, height)  # by a fraction of a pixel
            towards = LAMP + SOFT * np.array([*(2 * light), 0.0])
            told = {"viewMatrix": view, "projectionMatrix": seen.tolist()}
            told["lightDirection"] = towards.tolist()
            pixels = self._call("getCameraImage", width, height, **told, **LAMPS)[2]
            total += np.reshape(pixels, (height, width, 4))[..., :3]
        return np.round(total / passes).astype(np.uint8)


LAMPS = {
    "lightDistance": 12,
    "lightAmbientCoeff": 0.60,
    "lightDiffuseCoeff": 0.45,
    "lightSpecularCoeff": 0.12,
    "shadow": 1,
}
"""Softer than in a single picture."""


def scattered(count, skipped=0):
    """Places spread evenly over the square from -0.5 to 0.5 (Roberts' sequence).

    Parameters
    ----------
    count : int
    skipped : int
        How many of the sequence are left out before.

    Returns
    -------
    (count, 2) float array
    """
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    return np.arange(1 + skipped, 1 + skipped + count)[:, None] * steps % 1.0 - 0.5


def render_robot(width=1200, height=900, passes=1):
    """Agent Orange in the laboratory, three quarters from the front (Fig. 1).

    Parameters
    ----------
    width, height : int
        Pixels.
    passes : int
        Pictures that are averaged, for smooth edges and soft shadows.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    with Darkroom() as studio:
        furnish(studio, LABORATORY)
        show_robot(studio, (4.5, 3.2, -2.0))
        return studio.photograph((4.72, 2.02, 0.56), (4.51, 3.2, 0.24), 31.0, width, height, passes)


def render_lab(scene=None, walkers=(), width=1200, height=900, passes=1):
    """A room with robot and objects, from above the wall at its lower end (Fig. 5).

    Parameters
    ----------
    scene : Scene, optional
        `figure_eight_scene()` when not given.
    walkers : sequence of tuples
        Position (2,) in m, heading in rad and gait phase in rad of each person to show, as
        `Walk.at` gives them.
    width, height : int
        Pixels.
    passes : int
        Pictures that are averaged, for smooth edges and soft shadows.

    Returns
    -------
    (height, width, 3) uint8 array
    """
    scene = scene or figure_eight_scene()
    for name, pixels in (("width", width), ("height", height)):
        checked_number(name, pixels, 1, 10_000)
    with Darkroom() as studio:
        furnish(studio, scene.room)
        for each in scene.objects:
            show_object(studio, each)
        show_robot(studio, scene.robot.pose)
        for walker in walkers:
            show_person(studio, *walker)
        return studio.photograph(*viewpoint(scene.room), VIEW_ANGLE, width, height, passes)


def viewpoint(room):
    """From where and whereto a picture of a room is taken, (3,) and (3,) in m: higher up for larger rooms."""
    left, low, right, high = room.bounds
    scale = scale_of(room)
    middle = (left + right) / 2
    eye = middle - 2.3 * scale, low - 3.6 * scale, 4.3 * scale
    return eye, (middle - 0.05, low + 3.4 / 7.0 * (high - low), 0.25)


def scale_of(room):
    """How much larger a room is than the laboratory."""
    left, low, right, high = room.bounds
    return max((right - left) / 9.0, (high - low) / 7.0)


def furnish(studio, room):
    """Floor, furniture and the walls that do not stand before the camera, those opposite with skirtings."""
    show_floor(studio, room.bounds)
    eye, target = (np.array(place[:2]) for place in viewpoint(room))
    raised = walls(replace(room, height=max(room.height, SHOWN_WALLS * scale_of(room))))
    ends = np.roll(room.corners, -1, axis=0)
    for corner, end, wall in zip(room.corners, ends, raised, strict=True):
        along = (end - corner) / np.linalg.norm(end - corner)
        inwards = np.array([-along[1], along[0]])
        if (eye - corner) @ inwards > 0:
            show_part(studio, wall)
        if (target - eye) @ inwards < 0:
            middle, length = (corner + end) / 2 + 0.01 * inwards, np.linalg.norm(end - corner)
            show_part(studio, panel(middle, length, along, 0.02, 0.1, BIN))
    for part in room.furniture:
        show_part(studio, part)


def show_part(studio, part):
    """A box, or a cylinder rounder than PyBullet's own."""
    x, y, z = part.centre
    if part.shape == "box":
        studio.show(part.centre, part.colour, part.size, orientation=about_vertical(part.turn))
    else:
        radius, height = part.size[0] / 2, part.size[2]
        profile = [(0, 0), (radius, 0), (radius, height), (0, height)]
        show_lathed(studio, (x, y, z - height / 2), profile, part.colour)


def about_vertical(turn):
    """Quaternion of a turn in rad."""
    return 0.0, 0.0, float(np.sin(turn / 2)), float(np.cos(turn / 2))


def show_lathed(studio, position, profile, colour, squash=1.0, orientation=UPRIGHT):
    """A body of revolution as of `lathe`, standing at a place (3,) in m, turned by a quaternion."""
    vertices, indices, normals = lathe(np.asarray(profile, dtype=float), squash)
    mesh = {"vertices": vertices, "indices": indices, "normals": normals}
    mesh = {name: part.tolist() for name, part in mesh.items()}
    uvs = [[0.0, 0.0]] * len(vertices)
    return studio.show(position, colour, mesh={**mesh, "uvs": uvs}, orientation=orientation)


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


def show_floor(studio, bounds, tile=0.5, margin=4.0):
    """Linoleum tiles of `tile` m reaching `margin` m beyond the room."""
    (low, front), (right, top) = bounds[:2] - margin, bounds[2:] + margin
    tiles = np.array([(low, front), (right, front), (right, top), (low, top)]) - (low, front)
    mesh = {
        "vertices": [(low, front, 0.0), (right, front, 0.0), (right, top, 0.0), (low, top, 0.0)],
        "indices": [0, 1, 2, 0, 2, 3],
        "normals": [(0.0, 0.0, 1.0)] * 4,
        "uvs": (tiles / (2 * tile)).tolist(),
    }
    floor = studio.show((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), mesh=mesh)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tiles.png"
        imsave(path, tile_texture())
        studio.paper(floor, path)


def tile_texture(size=256):
    """Two by two speckled tiles, (size, size, 3) in 0 to 1."""
    rng = np.random.default_rng(0)
    half = np.arange(size) < size // 2
    shade = np.where(half[:, None] ^ half, 0.80, 0.74)
    shade = shade + 0.012 * rng.standard_normal((size, size))
    joint = np.arange(size) % (size // 2) < 2
    shade = np.where(joint[:, None] | joint, 0.62, shade)
    return np.clip(shade[..., None] * np.array([1.0, 0.985, 0.95]), 0.0, 1.0)


def show_object(studio, each):
    """A trash can, a cone, or a carton."""
    if each.shape == "box":
        (x, y), (width, depth), turn = each.position, each.size, about_vertical(each.turn)
        studio.show((x, y, each.height / 2), OAK, (width, depth, each.height), orientation=turn)
        return
    look = show_can if each.shape == "cylinder" else show_cone
    look(studio, each)


def show_can(studio, each):
    """A trash can: tapered wall, rim, and the bag inside."""
    r, h = each.size[0] / 2, each.height
    foot = (*each.position, 0.0)
    show_lathed(studio, foot, [(0, 0), (0.92 * r, 0), (1.04 * r, h)], BIN)
    rim = [(1.10 * r, h - 0.05), (1.10 * r, h), (0.98 * r, h), (0.94 * r, max(h - 0.2, h / 2))]
    show_lathed(studio, foot, rim, BAG)
    show_lathed(studio, foot, [(0.95 * r, h - 0.12), (0, h - 0.12)], BAG)


def show_cone(studio, each):
    """A slalom cone: square foot, orange cone, white band."""

    def radius(height):
        return each.outline(min(height, each.height * 0.999)).radius

    half = each.reach / np.sqrt(2)
    studio.show((*each.position, 0.02), BAG, (2 * half, 2 * half, 0.04))
    bands = (0.04, 0.45, ORANGE), (0.45, 0.70, PALE), (0.70, 1.0, ORANGE)
    for low, high, colour in bands:
        low, high = low * each.height, high * each.height
        show_lathed(studio, (*each.position, 0.0), [(radius(low), low), (radius(high), high)], colour)


def show_robot(studio, pose):
    """The Pioneer at a pose (3,) in m and rad, over its wheels rounder ones than PyBullet draws."""
    put_pioneer(studio, pose)
    x, y, theta = pose
    for side in (1, -1):
        axle = rotation(theta) @ (0.0, 0.1585 * side)
        outwards = np.array([*(rotation(theta) @ (0.0, side)), 0.0])
        centre, turn = np.array([x, y, 0.0825]) + (*axle, 0.0), from_vertical(outwards)
        tyre = TREAD + [(radius, -height) for radius, height in TREAD[::-1]]
        show_lathed(studio, centre, tyre, TYRE, orientation=turn)
        show_lathed(studio, centre, [(0.052, 0.020), (0.050, 0.012)], TYRE, orientation=turn)
        show_lathed(studio, centre, RIM, METAL, orientation=turn)


def from_vertical(along):
    """The quaternion that turns the vertical to a direction (3,), which is not straight down."""
    turn = np.array([-along[1], along[0], 0.0, np.linalg.norm(along) + along[2]])
    return turn / np.linalg.norm(turn)


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

    for (ahead, left), side in zip(body_offsets("legs", phase), (1, -1), strict=True):
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
    profile = [(0.0, -radii[0]), (radii[0], 0.0), (radii[1], length), (0.0, length + radii[1])]
    show_lathed(studio, start, profile, colour, orientation=from_vertical(along))


def ellipse(radius, half_height, steps=12):
    """Profile of an ellipsoid standing on the floor."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, steps)
    return np.column_stack([radius * np.cos(angle), half_height * (1 + np.sin(angle))])


# ---- pictures of a film


class Studio(Engine):
    """A room that stays furnished while a robot or a person moves in it: for the pictures of a film.

    To be used in a `with` statement. What stands is photographed once, finely; of what moves each
    picture takes a part alone, from the same place, which is laid over the still one where it and
    the part without differ. All places are those of the room, in m.

    Parameters
    ----------
    scene : Scene
        What stands there.
    width, height : int
        Pixels of the pictures.
    watching : bool
        Whether the scene's robot stands where it watches; otherwise it is there when it is moved.
    marks : sequence of ((2,), (2,)) arrays
        Grey strips that always lie on the floor: begin and end of each.
    """

    def __init__(self, scene, width, height, watching=False, marks=()):
        super().__init__()
        self._shown, self._lying, self._pieces = [], {}, ()
        self._size, self._centre = (width, height), np.zeros(3)
        self._eye, self._target = (np.array(place) for place in viewpoint(scene.room))
        self._target = self._target + LOWER
        self._camera = camera(self._eye, self._target, FILM_ANGLE, width, height)
        furnish(self, scene.room)
        for each in scene.objects:
            show_object(self, each)
        for each in marks:
            self._lay(each, BIN)
        self._robot = put_pioneer(self, scene.robot.pose if watching else AWAY)
        self._lift = self.centre_of_mass(self._robot)
        self._still = self._marked = self._photograph_still()

    def show(self, *what, **look):
        """Something to look at; the studio remembers the body.

        Parameters
        ----------
        *what, **look : object
            As `Engine.show` has them.

        Returns
        -------
        int
            The body.
        """
        body = super().show(*what, **look)
        self._shown.append(body)
        return body

    def lay(self, pieces, colour):
        """Lay out strips on the floor, none of which is in the pictures until it is asked for.

        Parameters
        ----------
        pieces : (K, 2, 2) array
            Begin and end of each.
        colour : tuple of 3 floats
            Red, green, blue in 0 to 1.
        """
        self._pieces, self._colour = np.asarray(pieces, dtype=float), colour
        self._strew(range(len(self._pieces)))
        self._marked = self._photograph_still()

    def empty(self):
        """A picture of what stands.

        Returns
        -------
        PIL.Image.Image
        """
        return self._still.copy()

    def pixels(self, places):
        """Where places on the floor are in a picture.

        Parameters
        ----------
        places : (N, 2) array_like
            In m.

        Returns
        -------
        (N, 2) float array
            Pixels across and down.
        """
        across, down, scale = self._camera @ (np.pad(places, ((0, 0), (0, 1))) - self._eye).T
        return np.column_stack([across / scale, down / scale])

    def person_at(self, position, heading, phase, strips=()):
        """A picture with a person in it.

        Parameters
        ----------
        position : (2,) array
        heading, phase : float
            In rad, of the chest and of the gait.
        strips : sequence of int
            Which strips lie on the floor.

        Returns
        -------
        PIL.Image.Image
        """
        self._strew(strips)
        middle = np.array([*position, 0.0]) + (0.30, 0.38, 0.75)  # of body and shadow
        without = self._photograph_part(middle, PERSON_REACH)
        begun = len(self._shown)
        show_person(self, position - self._centre[:2], heading, phase)
        part = self._photograph_part(middle, PERSON_REACH)
        for body in self._shown[begun:]:
            self.remove(body)
        return self._laid_over(part, without, middle, PERSON_REACH)

    def robot_at(self, pose, strips=(), lifted=0.0):
        """A picture with the robot in it.

        Parameters
        ----------
        pose : (3,) array
            x, y in m, theta in rad.
        strips : sequence of int
            Which strips lie on the floor.
        lifted : float
            How far above the floor, in m: somebody carries it.

        Returns
        -------
        PIL.Image.Image
        """
        self._strew(strips)
        x, y, theta = pose
        reach, middle = ROBOT_REACH + lifted, np.array([x + 0.1, y + 0.1, 0.15 + lifted / 2])
        self.place(self._robot, AWAY)
        without = self._photograph_part(middle, reach)
        ahead, _, up = self._lift
        place = np.array([x + ahead * np.cos(theta), y + ahead * np.sin(theta), up + lifted])
        self.place(self._robot, place - self._centre, theta)
        return self._laid_over(self._photograph_part(middle, reach), without, middle, reach)

    def _strew(self, strips):
        """Put those strips on the floor, and no others."""
        for k in self._lying.keys() - set(strips):
            self.remove(self._lying.pop(k))
        for k in sorted(set(strips) - self._lying.keys()):
            self._lying[k] = self._lay(self._pieces[k], self._colour)

    def _lay(self, piece, colour):
        """A strip on the floor from one place (2,) to another; its body."""
        start, end = piece - self._centre[:2]
        (along, aside), middle = end - start, (start + end) / 2
        size = np.hypot(along, aside) + STRIP / 2, STRIP, 0.012
        turn = about_vertical(np.arctan2(aside, along))
        return self.show((*middle, 0.006), colour, size, orientation=turn)

    def _photograph(self, target, angle, width, height):
        """A picture from where all are taken, wherever the last one has moved everything to."""
        eye, target = self._eye - self._centre, target - self._centre
        image = self.photograph(eye, target, angle, width, height)
        self._centre = self._centre + (*target[:2], 0.0)
        return Image.fromarray(image)

    def _photograph_still(self):
        """What stands, finely."""
        width, height = self._size
        return self._photograph(self._target, FILM_ANGLE, 2 * width, 2 * height).reduce(2)

    def _photograph_part(self, middle, reach):
        """What is within so many m of a place (3,), a little finer than the picture."""
        angle = angle_of(reach, middle - self._eye)
        fine = FINER * self._size[1] / np.tan(np.radians(FILM_ANGLE) / 2)
        pixels = int(np.ceil(fine * np.tan(np.radians(angle) / 2)))
        return self._photograph(middle, angle, pixels, pixels)

    def _laid_over(self, part, without, middle, reach):
        """The still picture with its strips, and over it a part where it is not as without."""
        picture = self._still.copy()
        if self._lying:
            picture.paste(self._marked, mask=self._mask_of_strips())
        angle = angle_of(reach, middle - self._eye)
        to_part = camera(self._eye, middle, angle, *part.size) @ np.linalg.inv(self._camera)
        corners = [(0, 0, 1), (part.width, 0, 1), (0, part.height, 1), (*part.size, 1)]
        across, down, scale = np.linalg.inv(to_part) @ np.transpose(corners)
        ends = np.sort([across / scale, down / scale])[:, [0, -1]]
        (left, right), (high, low) = np.clip(ends.T, 0, self._size).astype(int).T.tolist()
        if left == right or high == low:
            return picture
        to_part = to_part @ [[1, 0, left], [0, 1, high], [0, 0, 1]]
        how = {
            "size": (right - left, low - high),
            "method": Image.Transform.PERSPECTIVE,
            "data": (to_part / to_part[2, 2]).ravel()[:8].tolist(),
            "resample": Image.Resampling.BICUBIC,
        }
        changed = ImageChops.difference(part, without).convert("L").point(sharply)
        picture.paste(part.transform(**how), (left, high), changed.transform(**how))
        return picture

    def _mask_of_strips(self):
        """Where the strips that lie there are in the picture, generously."""
        mask = Image.new("L", self._size)
        pen = ImageDraw.Draw(mask)
        for k in self._lying:
            start, end = self._pieces[k]
            along = STRIP * (end - start) / np.linalg.norm(end - start)
            aside, begin = np.array([-along[1], along[0]]), start - along
            corners = [begin + aside, end + aside, end - aside, begin - aside]
            pen.polygon(self.pixels(corners).ravel().tolist(), fill=255)
        return mask


def angle_of(radius, away):
    """The angle in degrees that a ball of a radius in m takes in, so far away (3,) in m."""
    return np.degrees(2 * np.arcsin(radius / np.linalg.norm(away)))


def sharply(change):
    """How much of a picture is laid over another, 0 to 255, where it is changed by so much."""
    return min(255, 24 * max(0, change - 2))


def camera(eye, target, angle, width, height):
    """What turns directions into pixels times their depth, as `Engine.photograph` sees them.

    Parameters
    ----------
    eye, target : (3,) array
        In m.
    angle : float
        From top to bottom, in degrees.
    width, height : int
        Pixels.

    Returns
    -------
    (3, 3) array
    """
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    focus = height / 2 / np.tan(np.radians(angle) / 2)
    lens = np.array([[focus, 0, width / 2], [0, -focus, height / 2], [0, 0, 1]])
    return lens @ [right, np.cross(right, ahead), ahead]
