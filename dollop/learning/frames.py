"""The frames from which a place can be seen: each object, and the world (beyond the paper).

A frame has an origin and a direction. An object whose direction is known is two frames, one that
turns with it and one that does not; the world is the last frame, at the map's origin.
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["Frames", "frames_like", "frames_of"]


@dataclass(frozen=True, eq=False)
class Frames:
    """F frames as they stood in each of D demonstrations.

    Attributes
    ----------
    origins : (D, F, 2) float array
        In m; 0 where the object was not there.
    turns : (D, F) float array
        Direction of each frame in rad.
    present : (D, F) bool array
        Whether the object was there.
    objects : (F,) int array
        The object of each frame; -1 for the world.
    turning : (F,) bool array
        Whether the frame turns with its object.
    corners : (F, 4, 2) float array
        Corners of the object as seen from its middle, in m; nan for the world.
    """

    origins: np.ndarray
    turns: np.ndarray
    present: np.ndarray
    objects: np.ndarray
    turning: np.ndarray
    corners: np.ndarray

    def __len__(self):
        return len(self.objects)

    def of(self, rows):
        """The same frames in some of the demonstrations.

        Parameters
        ----------
        rows : (E,) int or bool array

        Returns
        -------
        Frames
        """
        stood = self.origins[rows], self.turns[rows], self.present[rows]
        return Frames(*stood, self.objects, self.turning, self.corners)

    def seen(self, points):
        """Places as seen from every frame.

        Parameters
        ----------
        points : (D, L, 2) float array
            In m.

        Returns
        -------
        (D, L, F, 2) float array
            In m.
        """
        return _turned(points[:, :, None] - self.origins[:, None], -self.turns[:, None])

    def back(self, local):
        """Where what is seen from every frame lies in each demonstration.

        Parameters
        ----------
        local : (L, F, 2) or (D, L, F, 2) float array
            In m.

        Returns
        -------
        (D, L, F, 2) float array
            In m.
        """
        return self.origins[:, None] + _turned(local, self.turns[:, None])


def _turned(vectors, angles):
    """Vectors (..., 2) turned by angles (...) in rad."""
    z = vectors @ np.array([1, 1j]) * np.exp(1j * angles)
    return np.stack([z.real, z.imag], axis=-1)


def frames_of(environments, partners, corners):
    """The frames of N objects in D environments (beyond the paper).

    Parameters
    ----------
    environments : sequence of D Environment
    partners : sequence of D int arrays
        For each object of environment d, which of the N it is; -1 where it is none of them.
    corners : (N, 4, 2) float array
        Of each object from its middle, in m.

    Returns
    -------
    Frames
        Of N objects, of those among them whose direction is known wherever they stand, and of the
        world.
    """
    n = len(corners)
    stood = [_stood(environment, goes, n) for environment, goes in zip(environments, partners, strict=True)]
    centres, turns, present = map(np.array, zip(*stood, strict=True))
    turning = np.flatnonzero((np.isfinite(turns) | ~present).all(axis=0) & present.any(axis=0))
    objects, kinds = (
        np.concatenate([np.arange(n), turning, [-1]]),
        np.repeat([False, True, False], [n, len(turning), 1]),
    )
    outlines = np.concatenate([corners, corners[turning], np.full((1, 4, 2), np.nan)])
    return _frames(centres, turns, present, objects, kinds, outlines)


def frames_like(objects, turning, environment, partners):
    """Frames that are known already, in another environment (beyond the paper).

    Parameters
    ----------
    objects, turning : (F,) int and bool arrays
        As of `Frames`.
    environment : Environment
    partners : (M,) int array
        For each object of the environment, which of the frames' objects it is; -1 for none.

    Returns
    -------
    Frames
        In one environment; a frame that turns is absent where the direction is not known.
    """
    n = max(objects.max(initial=-1), partners.max(initial=-1)) + 1  # of which some may have no frame
    centres, turns, present = (each[None] for each in _stood(environment, partners, n))
    found = _frames(centres, turns, present, objects, turning, np.full((len(objects), 4, 2), np.nan))
    known = np.isfinite(turns[:, objects[turning]]) if turning.any() else np.ones((1, 0), bool)
    found.present[:, turning] &= known
    return found


def _stood(environment, partners, n):
    """Centres (n, 2), directions (n,) and presence (n,) of n objects in an environment."""
    centres, turns, present = np.zeros((n, 2)), np.full(n, np.nan), np.zeros(n, bool)
    known = np.flatnonzero(partners >= 0)
    centres[partners[known]] = environment.centres[known]
    turns[partners[known]] = environment.directions[known]
    present[partners[known]] = True
    return centres, turns, present


def _frames(centres, turns, present, objects, turning, corners):
    """Frames of objects that stood at centres (D, N, 2); the last one is the world."""
    count, inside = len(centres), objects[:-1]
    origins = np.concatenate([centres[:, inside], np.zeros((count, 1, 2))], axis=1)
    angles = np.where(turning[:-1], np.nan_to_num(turns[:, inside]), 0.0)
    there = np.concatenate([present[:, inside], np.ones((count, 1), bool)], axis=1)
    angles = np.concatenate([angles, np.zeros((count, 1))], axis=1)
    return Frames(origins, angles, there, objects, turning, corners)
