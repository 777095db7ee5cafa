"""Rooms drawn at random: four shapes, turned or not, anywhere, with furniture."""

from dataclasses import replace

import numpy as np

from dollop.lab.outlines import inside
from dollop.lab.rooms import GREY, OAK, STEEL, Part, Room, panel
from dollop.pose import rotation

__all__ = ["NoRoom", "anew", "draw_room", "somewhere"]

ATTEMPTS = 60
"""How often a part of a world is drawn anew before all of it is."""
TABLE = 0.70
"""Height in m of the lower side of a table's top."""


class NoRoom(ValueError):
    """A world in which something has no room."""


def anew(make, rng, attempts=ATTEMPTS):
    """What `make` draws the first time that there is room for it."""
    for _ in range(attempts):
        try:
            return make(rng)
        except ValueError:
            continue
    raise NoRoom


def draw_room(beam, rng):
    """Its kind, and a Room with furniture."""
    shape = str(rng.choice(["rectangle", "L", "corridor", "two rooms"], p=[0.45, 0.2, 0.15, 0.2]))
    width, depth = rng.uniform(4, 15), rng.uniform(4, 12)
    if shape == "corridor":
        width, depth = rng.uniform(8, 15), rng.uniform(2.4, 3.4)
    corners = np.array([(0, 0), (width, 0), (width, depth), (0, depth)], dtype=float)
    if shape == "L":
        x, y = rng.uniform(0.4, 0.7, 2) * (width, depth)
        corners = np.array([(0, 0), (width, 0), (width, y), (x, y), (x, depth), (0, depth)], dtype=float)
    wall = []
    if shape == "two rooms":
        at, door = rng.uniform(0.35, 0.65) * width, rng.uniform(0.9, 1.3)
        low = rng.uniform(0.2, depth - door - 0.2)
        for begin, end in ((0.0, low), (low + door, depth)):
            wall.append(((at, (begin + end) / 2), end - begin))
    turn = rng.uniform(0, 2 * np.pi) if rng.random() < 0.5 else 0.0
    place, turned = rng.uniform(-20, 20, 2), rotation(turn)
    inner = [panel(place + turned @ middle, length, turned @ (0.0, 1.0), 0.1, 2.4, GREY) for middle, length in wall]
    room = Room(place + corners @ turned.T, inner)
    area = width * depth
    for _ in range(rng.integers(0, min(6, int(area / 8)) + 1)):
        room = anew(lambda rng, room=room: furnished(room, turn, beam, rng), rng)
    return shape, room


def furnished(room, turn, beam, rng):
    """The room with one more piece of furniture, which touches no other."""
    kind = rng.choice(["cabinet", "shelf", "table", "column"])
    if kind == "table" and beam > TABLE:  # a robot would bump into legs that its laser does not see
        kind = "column"
    if kind in ("cabinet", "shelf"):
        pieces = cabinet_at_wall(room, rng, 0.5 if kind == "cabinet" else 0.3)
    else:
        x, y = somewhere(room, rng, 0.5)
        pieces = table(x, y, turn, rng) if kind == "table" else column(x, y, rng)
    if not room.holds(pieces[-1].outline):
        raise NoRoom
    return replace(room, furniture=(*room.furniture, *pieces))


def cabinet_at_wall(room, rng, depth):
    """A cabinet with its back to a wall."""
    k = rng.integers(len(room.corners))
    begin, end = room.corners[k], room.corners[(k + 1) % len(room.corners)]
    along = (end - begin) / np.linalg.norm(end - begin)
    inwards = np.array([-along[1], along[0]])
    width, height = rng.uniform(0.5, 1.4), rng.uniform(1.2, 2.0)
    middle = begin + (end - begin) * rng.random() + inwards * (depth / 2 + 0.02)
    return [panel(middle, width, along, depth, height, STEEL)]


def table(x, y, turn, rng):
    """A table: four legs, and a top that only somebody as high as it bumps into."""
    width, depth = rng.uniform(0.7, 1.6), rng.uniform(0.6, 0.9)
    parts = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            leg = np.array([x, y]) + rotation(turn) @ (sx * (width / 2 - 0.05), sy * (depth / 2 - 0.05))
            parts.append(Part("box", (*leg, TABLE / 2), (0.05, 0.05, TABLE), OAK, turn))
    return [*parts, Part("box", (x, y, TABLE + 0.02), (width, depth, 0.04), OAK, turn)]


def column(x, y, rng):
    """A round column up to the ceiling."""
    size = rng.uniform(0.2, 0.5)
    return [Part("cylinder", (x, y, 1.2), (size, size, 2.4), GREY)]


def somewhere(room, rng, free):
    """A place (2,) in a room with so much free room round it, in m."""
    low, high = np.split(room.bounds, 2)
    points = rng.uniform(low, high, (100, 2))
    found = points[inside(points, room.corners) & (room.distance(points) >= free)]
    if not len(found):
        raise NoRoom
    return found[0]
