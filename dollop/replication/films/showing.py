"""The film of a user who shows a task, and of what the laser and Dollop make of it (Sec. II)."""

import numpy as np
from matplotlib.colors import to_rgb

import dollop
from dollop import plot
from dollop.foreground import endpoints, foreground_mask
from dollop.lab.person import walk_along
from dollop.replication import recordings
from dollop.replication.films.canvas import Plane, captioned, sizes, steps
from dollop.replication.films.reel import film_of
from dollop.trajectory import arc_length, at_arc_length

__all__ = ["legs_of", "strips_of"]

RAY, READING = "#C3CED6", "#000000"
LAPS = 5
"""Of the recording; the film shows the first."""
OUT_OF_SIGHT = 0.35
"""s without a reading on the user from which on the caption says so."""
PIECE = 0.1
"""m: length of a strip on the floor."""


@film_of("shown", seconds=11.0)
def shown(width, count):
    """The user shows the task, and the robot watches.

    Left the laboratory, where a person walks a figure-eight round two trash cans while the robot
    stands and watches. Right the map: from the robot a fan of 181 rays of its laser, black dots
    where they end on what is not background, boxes round the two cans once they are known to stand
    there, and in blue the user's track as it grows scan by scan. Behind a can the user is out of
    sight: the track stops, and goes on dotted in orange once the user is seen again.
    """
    from dollop.lab.render import Studio

    recording, background = recordings.figure_eights().recording, recordings.background_map()
    log, scene, walk = recording.log, recording.scene, legs_of(recording)
    last = int(np.searchsorted(log.t, end_of_lap(walk, scene.positions.mean(axis=0))))
    _, half = sizes(width)
    plane = Plane(half, width, lambda ax: draw_still(ax, background, scene.robot.pose))
    ends = endpoints(log)
    foreground = foreground_mask(ends, background)
    observer, taken = dollop.Observer(background, log.angles), 0
    strips = strips_of(walk.positions[: np.searchsorted(walk.t, log.t[last])])
    walked = np.interp(log.t, walk.t, arc_length(walk.positions))
    with Studio(scene, *half, watching=True) as studio:
        studio.lay(strips, to_rgb(plot.USER))
        for row in steps(last, count, hold=0.1):
            for scan in range(taken, row + 1):
                observer.step(log.t[scan], log.ranges[scan], log.poses[scan])
            taken = row + 1
            place = walk.at(log.t[row])
            so_far = range(min(len(strips), int(walked[row] / PIECE)))
            observed = observer.observation()
            plane.begin()
            draw_scan(plane, log.poses[row, :2], ends[row], foreground[row])
            draw_observed(plane, observed)
            plane.robot(scene.robot.pose, scene.robot.radius)
            caption = caption_of(observed.user, log.t[row])
            if row == last:
                caption = "one lap is shown; four more follow"
            picture = studio.person_at(*place, so_far)
            yield captioned(width, caption, f"{log.t[row]:.1f} s", picture, plane.taken())


def legs_of(recording):
    """The recorded walk with the strides that the recording does not tell.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Walk
    """
    truth = recording.truth
    return walk_along(truth.t.to_numpy(), truth[["x", "y"]].to_numpy())


def end_of_lap(walk, middle):
    """When in s the walker is back midway between the cans, (2,) in m, after the first lap."""
    share = arc_length(walk.positions) / arc_length(walk.positions)[-1]
    near = np.flatnonzero(abs(share - 1 / LAPS) < 0.03)
    return walk.t[near[np.linalg.norm(walk.positions[near] - middle, axis=1).argmin()]]


def strips_of(path):
    """A path (N, 2) in m as short pieces (K, 2, 2)."""
    places = at_arc_length(path, np.arange(0.0, arc_length(path)[-1], PIECE))
    return np.stack([places[:-1], places[1:]], axis=1)


def draw_still(ax, background, pose):
    """The map, the watching robot, and what will move in the legend."""
    plot.workspace(background, pose, (), ax)
    ax.plot([], [], color=RAY, label="rays of the laser")
    ax.plot([], [], ".", color=READING, label="foreground readings")
    plot.path(ax, np.empty((0, 2)), "user's track", linewidth=2)
    ax.plot([], [], ".", color=plot.OCCLUDED, label="occluded")
    ax.plot([], [], "s", color=plot.OBSTACLE, fillstyle="none", label="objects")


def draw_scan(plane, laser, ends, foreground):
    """The fan of a scan, and its readings on the foreground."""
    plane.rays(laser, ends[np.isfinite(ends).all(axis=1)], RAY)
    plane.dots(ends[foreground], READING, 2.2)


def draw_observed(plane, observed):
    """Objects, and the track of the user so far."""
    for box in observed.environment.boxes:
        plane.box(box, plot.OBSTACLE)
    if observed.user is not None:
        plane.line(observed.user.positions, plot.USER, 2.5)
        plane.dots(observed.user.positions[observed.user.occluded], plot.OCCLUDED, 2.2)


def caption_of(user, now):
    """What happens, in words."""
    if user is None:
        return "the robot watches: nobody has moved yet"
    if user.t[-1] < now - OUT_OF_SIGHT:
        return "out of sight behind a can"
    return "the user shows the task, the track grows"
