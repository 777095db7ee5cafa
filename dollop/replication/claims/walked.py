"""Slaloms that several claims on learning share, and how much of what is drawn is thrown away.

Walks of one person in one layout, told apart by nothing but how people walk, and walks in many
layouts; all of them seen by the laser. The walker is ours (`dollop.lab.person`): how he aims, sways
and drifts is what makes his walks differ.
"""

from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from math import inf, nan

import numpy as np

from dollop import lab
from dollop.environment import Environment
from dollop.lab.person import SHOULDERS, figure_eight, walk
from dollop.lab.scenes import Scene, figure_eight_scene, object_gaps, rearranged, slalom_scene
from dollop.replication import recordings
from dollop.replication.choosing import gait_of, seen_by
from dollop.replication.reconstruction import TOLD
from dollop.replication.runs import free_poses
from dollop.robot.avoidance import ObstacleMap

__all__ = [
    "LEARNED", "NEARER", "WALKS", "acceptance", "eight_near", "exponent", "intended_places",
    "intended_way", "laws_of", "straight_near", "walks_again",
]  # fmt: skip

NEARER = (0.01, inf)
"""Nearer by a centimetre or more, half of the tolerance: less nobody sees in what a robot does."""

WALKS = ("lds", "tolerance", "cuts", "laser_noise", "walker")
"""Choices on which the subgoals of one walk depend."""

LEARNED = (*WALKS, "weights", "corners", "matching", "merging", "spread", "learning")
"""Choices on which a task depends that is learned from slaloms in several layouts."""

NEAR = recordings.KEPT["from_background"]
"""Nearer than so many m, shoulder to wall, nobody walks in the other claims."""


@lru_cache(maxsize=2)
def walks_again(seed, how=TOLD):
    """The first slalom of a seed, and the same person walking it five times more.

    Parameters
    ----------
    seed : int
    how : Reconstruction, optional

    Returns
    -------
    list of 6 ChosenSlalom
        As `recordings.slalom` has them.
    """
    first = recordings.slalom(0, seed, how)
    return [
        first,
        *(replace(first, seen=each) for each in seen_again(seed, how.only(recordings.SEEN))),
    ]


@lru_cache(maxsize=2)
def seen_again(seed, how, count=5):
    """The further walks, whatever is made of them."""
    first, rng = recordings.slalom(0, seed, how).seen, np.random.default_rng([seed, 21])

    def again():
        return lab.slalom(first.scene, rng, **recordings.KEPT, **gait_of(how))

    return [replace(first, walk=drawn(again), noise=[seed, 21, k]) for k in range(count)]


def laws_of(walks, law):
    """The law of each walk alone.

    Parameters
    ----------
    walks : sequence
        Of whatever a law can be made of.
    law : callable
        From one of them to its SequencedLDS.

    Returns
    -------
    list of SequencedLDS
        Empty where a walk cannot be cut within the tolerance.
    """
    try:
        return [law(each) for each in walks]
    except ValueError:
        return []


def exponent(errors):
    """Exponent of errors in a number: the slope, both logarithmic.

    Parameters
    ----------
    errors : dict of float
        By number; those that are not finite are left out.

    Returns
    -------
    float
        nan for fewer than two.

    Examples
    --------
    >>> round(float(exponent({1: 0.2, 4: 0.1, 9: np.nan})), 6)
    -0.5
    """
    found = [(n, error) for n, error in errors.items() if np.isfinite(error)]
    return np.polyfit(*np.log(np.array(found)).T, 1)[0] if len(found) > 1 else nan


def drawn(draw, right=lambda found: True, most=10_000):
    """The first that is right of what is drawn; there is no room where a draw raises ValueError."""
    for _ in range(most):
        try:
            found = draw()
        except ValueError:
            continue
        if right(found):
            return found
    raise RuntimeError(f"nothing with room in {most} draws")


# ---- what the walker means to do


def intended_places(cones, swing=0.75):
    """Where a walker aims to pass cones, left and right of them in turn: as in `dollop.lab.slalom`.

    Parameters
    ----------
    cones : (N, 2) float array
        In m.
    swing : float
        Distance in m from their centres.

    Returns
    -------
    (N, 2) float array
        In m.
    """
    left = np.column_stack([-tangents(cones)[:, 1], tangents(cones)[:, 0]])
    return cones + swing * ((-1.0) ** np.arange(len(cones)))[:, None] * left


def tangents(cones):
    """Unit vectors (N, 2) along a row of cones."""
    along = np.gradient(cones, axis=0)
    return along / np.linalg.norm(along, axis=1, keepdims=True)


def intended_way(scene, approach=1.0):
    """The way that a walker means to go past the cones of a scene, without any error of his own.

    Parameters
    ----------
    scene : Scene
    approach : float
        Length in m before the first and after the last cone.

    Returns
    -------
    (N, 2) float array
        In m.
    """
    cones = scene.positions
    along = tangents(cones)
    ends = cones[0] - approach * along[0], cones[-1] + approach * along[-1]
    points = np.vstack([ends[0], intended_places(cones), ends[1]])
    return walk(points, scene, 0, drift=0.0, sway=0.0).positions


# ---- near the background


def eight_near(rng, how=TOLD):
    """A figure-eight that comes near to the background, one of the two cans being moved.

    Parameters
    ----------
    rng : numpy.random.Generator
    how : Reconstruction, optional

    Returns
    -------
    scene : Scene
    walk : Walk
    """

    def eight():
        scene = one_can_elsewhere(rng)
        return seen_by(scene, how), figure_eight(scene, rng, laps=1, **gait_of(how))

    return drawn(eight, lambda found: room_beside(*found).min() < NEAR)


def straight_near(rng, how=TOLD, length=2.5):
    """A straight walk along wall or furniture before the laser, near to them all the way.

    Parameters
    ----------
    rng : numpy.random.Generator
    how : Reconstruction, optional
    length : float
        In m.

    Returns
    -------
    scene : Scene
    walk : Walk
    """
    scene = seen_by(Scene(), how)
    (low, high), pose = np.split(scene.room.bounds, 2), scene.robot.laser_pose

    def ends():
        begin, angle = rng.uniform(low, high), rng.integers(4) * np.pi / 2
        return begin + length * np.array([[0.0], [0.5], [1.0]]) * (np.cos(angle), np.sin(angle))

    def near(places):
        room = scene.room.distance(places) - SHOULDERS / 2
        before = (places - pose[:2]) @ (np.cos(pose[2]), np.sin(pose[2]))
        return room.min() > 0 and room.max() < NEAR and before.min() > 0.5

    def straight():
        return scene, walk(drawn(ends, near), scene, rng, **gait_of(how))

    return drawn(straight, lambda found: room_beside(*found).max() < NEAR)


def room_beside(scene, walk):
    """Distance (N,) in m between shoulder and background along a walk."""
    return scene.room.distance(walk.positions[::5]) - SHOULDERS / 2


# ---- what is drawn and thrown away


def acceptance(seed, draws=10):
    """Of everything that claims draw until there is room, the share of draws that have room.

    Parameters
    ----------
    seed : int
    draws : int
        Of each kind.

    Returns
    -------
    dict of float
        `cones_apart`: four cones with 0.6 m round each; `slaloms_kept`: of these, a slalom that
        keeps 0.30 m from the background. `cans_apart`: two cans with 1 m round each. `eights_kept`:
        one can moved, and room for three figure-eights that keep 0.30 m. `poses_free`: a robot can
        stand there and go to the middle.
    """
    rng, can, cones = np.random.default_rng([seed, 22]), figure_eight_scene(), slalom_scene()

    def cones_apart():
        return rearranged(cones, rng, reach=0.25, spacing=0.6, attempts=1)

    def slalom_kept():
        return lab.slalom(drawn(cones_apart), rng, **recordings.KEPT)

    def eights_kept():
        scene = one_can_elsewhere(rng)
        return [figure_eight(scene, rng, laps=1, **recordings.KEPT) for _ in range(3)]

    kinds = {
        "cones_apart": cones_apart,
        "slaloms_kept": slalom_kept,
        "cans_apart": lambda: rearranged(can, rng, reach=0.4, spacing=1.0, attempts=1),
        "eights_kept": eights_kept,
    }
    shares = {name: share_with_room(draw, draws) for name, draw in kinds.items()}
    return shares | {"poses_free": poses_free(rng, draws)}


def share_with_room(draw, draws):
    """In which share of draws there is room, and no ValueError is raised."""
    right = 0
    for _ in range(draws):
        with suppress(ValueError):
            draw()
            right += 1
    return right / draws


def one_can_elsewhere(rng):
    """The figure-eight's scene with one can moved by 0.4 m (sd), and room to walk round it."""
    scene, positions = figure_eight_scene(), figure_eight_scene().positions.copy()
    positions[rng.integers(2)] += rng.normal(0, 0.4, 2)
    moved = scene.with_objects_at(positions)
    if object_gaps(moved).min() < 0.45:
        raise ValueError("a can must have 0.45 m round it")
    return moved


class Counting(np.random.Generator):
    """Counts how often places are drawn of it."""

    draws = 0

    def uniform(self, *inputs, **more):
        """As numpy's."""
        self.draws += 1
        return super().uniform(*inputs, **more)


def poses_free(rng, count):
    """Share of poses anywhere from which a robot can go to the middle of the laboratory."""
    counting, scene = Counting(rng.bit_generator), figure_eight_scene()
    obstacles = ObstacleMap.of(Environment(scene.boxes), recordings.background_map())
    free_poses(count, obstacles, scene.positions.mean(axis=0), counting)
    return count / counting.draws
