"""What several claims measure: directions along a way, windings, clearance, plain runs.

The paper's claims are judged by the paper's response, every LDS alone; what Dollop does by default is
told beside it, in numbers that end in "ours".
"""

import numpy as np

from dollop.replication import recordings
from dollop.replication.choosing import following_of
from dollop.replication.reconstruction import TOLD
from dollop.robot.guidance import PIONEER_LIMITS
from dollop.robot.performing import Unicycle, perform
from dollop.trajectory import arc_length, distance_to_polyline

__all__ = [
    "SHARES", "clear_of", "error_of", "headings", "is_eight", "plain_run", "segments_along", "windings",
]  # fmt: skip

SHARES = 200
"""At so many equal shares of the way the law is compared with the laps."""


def headings(path, width=5):
    """Directions along a path.

    Parameters
    ----------
    path : (M, 2) float array
        Positions in m.
    width : int
        A direction is that from so many samples before to so many behind.

    Returns
    -------
    (M,) float array
        In rad, unwrapped.
    """
    rows = np.arange(len(path))
    way = path[np.minimum(rows + width, len(path) - 1)] - path[np.maximum(rows - width, 0)]
    return np.unwrap(np.arctan2(way[:, 1], way[:, 0]))


def handing_over(law, method="paper"):
    """Shares (K,) of the response's way at which each segment hands over, the last being 1."""
    responses = law.responses(method=method)
    way = arc_length(np.vstack(responses))
    return way[np.cumsum([len(each) for each in responses]) - 1] / way[-1]


def segments_along(law, method="paper"):
    """Which segment is in force along the response of a law.

    Parameters
    ----------
    law : SequencedLDS
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    (SHARES,) int array
        Its index at equal shares of the way.
    """
    return np.searchsorted(handing_over(law, method)[:-1], np.linspace(0, 1, SHARES))


def error_of(law, walks, method="paper"):
    """Mean distance of walks to a law's response.

    Parameters
    ----------
    law : SequencedLDS
    walks : sequence of (N_k, 2) float arrays
        In m; each counts as much as another.
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    float
        In m.
    """
    response = law.response(method=method)
    return np.mean([distance_to_polyline(walk, response).mean() for walk in walks])


def windings(path, centres):
    """How often a path, closed, goes round each of several centres.

    Parameters
    ----------
    path : (M, 2) float array
        Positions in m.
    centres : (N, 2) array_like
        In m.

    Returns
    -------
    (N,) int array
        Counter-clockwise is positive.

    Examples
    --------
    >>> square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> windings(square, [[0.5, 0.5], [2, 2]]).tolist()
    [1, 0]
    """
    z = np.append(path, path[:1], axis=0) @ (1, 1j)
    around = z - (np.asarray(centres) @ (1, 1j))[:, None]
    return np.round(np.angle(around[:, 1:] / around[:, :-1]).sum(axis=1) / (2 * np.pi)).astype(int)


def is_eight(law, scene, method="paper"):
    """Whether the law's response goes once round the first two objects, in opposite directions.

    Parameters
    ----------
    law : SequencedLDS
        Its response is what is measured.
    scene : Scene
        Where the objects really stand.
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    float
        1 if it does, 0 if not.
    """
    turns = windings(law.response(method=method), scene.positions[:2])
    return float(sorted(turns) == [-1, 1])


def clear_of(law, scene, method="paper"):
    """Least distance between the law's response and the foot of any object.

    Parameters
    ----------
    law : SequencedLDS
        Its response is what is measured.
    scene : Scene
        Where the objects really stand.
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    float
        In m, negative where the response runs over one.
    """
    path = law.response(method=method)
    apart = np.linalg.norm(path[:, None] - scene.positions, axis=2) - scene.foot_radii
    return apart.min()


def plain_run(task, start, how=TOLD, limits=PIONEER_LIMITS, **choices):
    """A run under the paper's law, which knows no obstacles, of a robot that knows where it is.

    Parameters
    ----------
    task : Task
    start : (3,) sequence of float
        Pose in m and rad.
    how : Reconstruction, optional
    limits : Limits
        What the robot can do.
    **choices
        More of what `dollop.perform` takes.

    Returns
    -------
    Run
    """
    robot, grid = Unicycle(start, limits), recordings.background_map()
    choices = {"following": following_of(how), **choices}
    return perform(task, robot, control="plain", avoid=False, background=grid, **choices)
