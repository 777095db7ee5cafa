"""The frames from which a place can be seen: each object, and the world (beyond the paper).

A frame has an origin and a direction. An object whose direction is known is two frames, one that turns with it and one
that does not; the world is the last frame, at the map's origin.
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["Frames", "frames_of"]


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


def frames_of(environments, partners, n_objects, corners):
    """The frames of N objects in D environments (beyond the paper).

    Parameters
    ----------
    environments : sequence of D Environment
    partners : sequence of D int arrays
        For each object of environment d, which of the N it is; -1 where it is none of them.
    n_objects : int
        N.
    corners : (N, 4, 2) float array
        Of each object from its middle, in m.

    Returns
    -------
    Frames
        Of N objects, of those among them whose direction is known wherever they stand, and of the world.
    """
    shape = len(environments), n_objects
    centres, turns, present = np.zeros((*shape, 2)), np.full(shape, np.nan), np.zeros(shape, bool)
    for d, (environment, goes) in enumerate(zip(environments, partners, strict=True)):
        known = np.flatnonzero(goes >= 0)
        centres[d, goes[known]] = environment.centres[known]
        turns[d, goes[known]] = environment.directions[known]
        present[d, goes[known]] = True
    turning = np.flatnonzero((np.isfinite(turns) | ~present).all(axis=0) & present.any(axis=0))
    objects = np.concatenate([np.arange(n_objects), turning, [-1]])
    still = np.zeros(shape)
    world = np.zeros((len(environments), 1))
    return Frames(
        np.concatenate([centres, centres[:, turning], np.zeros((len(environments), 1, 2))], axis=1),
        np.concatenate([still, np.nan_to_num(turns[:, turning]), world], axis=1),
        np.concatenate([present, present[:, turning], world == 0], axis=1),
        objects,
        _turning(n_objects, len(turning)),
        np.concatenate([corners, corners[turning], np.full((1, 4, 2), np.nan)]),
    )


def _turning(still, turning):
    """(F,) bool: so many frames that do not turn, so many that do, and the world."""
    return np.repeat([False, True, False], [still, turning, 1])
