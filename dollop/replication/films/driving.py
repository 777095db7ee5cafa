"""Films of the robot that performs a task, among the objects of the demonstration and others."""

from itertools import pairwise

import numpy as np
from matplotlib.colors import to_rgb

from dollop import lab, plot
from dollop.replication import recordings
from dollop.replication.films.canvas import Plane, captioned, sizes, steps
from dollop.replication.films.reel import film_of
from dollop.replication.films.showing import strips_of

__all__ = []

KIDNAPPED_RUN = 3
"""Which of the runs of Fig. 7b is filmed: the robot is carried far, across the room."""
MOVED = 1
"""Which of the layouts of Fig. 10 is filmed: the cans come closer to each other."""
CARRIED = 0.15
"""Share of a film for which somebody carries the robot."""
HELD_UP = 0.9
"""m above the floor, at most, meanwhile."""
BEFORE = 0.13
"""Share of a film for which the objects are seen where they stood when the task was shown."""


@film_of("performed", seconds=10.0)
def performed(width, count):
    """The robot performs the task that it was shown.

    Left the laboratory: a Pioneer with a laser drives the figure-eight round two trash cans. Right
    the map: the boxes of the cans, the green control law with its six numbered subgoals, the yellow
    robot, and behind it in pink the way that it has driven. It ends where the walk ended.
    """
    (run,) = recordings.eight_runs(count=1)
    task, scene = recordings.figure_eights().task, lab.figure_eight_scene()
    yield from driven(width, count, run, task, scene)


@film_of("kidnapped", seconds=12.0)
def kidnapped(width, count):
    """The robot is kidnapped, finds itself again, and goes on.

    The robot performs the figure-eight, left in the laboratory and right on the map. On its way it
    is lifted and set down somewhere else, and is not told; a dotted line on the map leads from
    where to where. While it does not know where it is, a question mark stands over it, and it turns
    on the spot. Then it goes on to its next subgoal, and ends the figure-eight.
    """
    run = recordings.kidnapped_runs()[KIDNAPPED_RUN]
    task, scene = recordings.figure_eights().task, lab.figure_eight_scene()
    yield from driven(width, count, run, task, scene)


@film_of("moved_cans", seconds=11.0)
def moved_cans(width, count):
    """The cans have been moved, and the robot performs the task round where they stand now.

    First the two trash cans as they stood when the figure-eight was shown, then as they stand now.
    Right the map: dashed grey the old boxes and the old control law, vermilion the boxes and green
    the law as they are now, its subgoals moved with the cans. The robot drives the new figure-eight
    and touches nothing.
    """
    (run,) = recordings.moved_runs(MOVED, count=1)
    before, now = lab.figure_eight_scene(), recordings.moved_scene(MOVED)
    shown = recordings.figure_eights().task
    first = before, "so the cans stood when the task was shown"
    yield from driven(width, count, run, recordings.adapted_task(MOVED), now, first, shown)


@film_of("slalom", seconds=11.0)
def slalom(width, count):
    """The robot performs a slalom among cones that stand as nobody has ever walked round them.

    First four cones as they stood in the first of two demonstrations, then in a third layout. Right
    the map: dashed grey the boxes and the law as they were in the first demonstration, vermilion
    the boxes of the cones as they stand now, green the control law that two demonstrations together
    give here. The robot passes every cone on the side that was shown, and touches none.
    """
    (run,) = recordings.slalom_runs(count=1)
    before, now = recordings.slalom(0).scene, recordings.slalom(2).scene
    shown = recordings.slalom_task()
    first = before, "so the cones stood in the first demonstration"
    yield from driven(width, count, run, recordings.new_slalom_task(), now, first, shown)


def driven(width, count, run, task, scene, before=None, shown=None):
    """The frames of a run in a scene; before them, if it was another, that of the demonstration."""
    _, half = sizes(width)
    first = round(BEFORE * count) if before else 0
    plane = Plane(half, width, lambda ax: draw_still(ax, task, shown))
    if first:
        yield from [frame_before(width, half, shown, *before)] * first
    yield from performing(width, count - first, half, plane, run, task, scene)


def frame_before(width, half, shown, scene, words):
    """How things stood when the task was shown, and what was learned then."""
    from dollop.lab.render import Studio

    with Studio(scene, *half) as studio:
        picture = studio.empty()
    plane = Plane(half, width, lambda ax: draw_still(ax, shown))
    return captioned(width, words, "", picture, plane.taken())


def performing(width, count, half, plane, run, task, scene):
    """Frames of the robot on its way, and of its kidnappings."""
    from dollop.lab.render import Studio

    leaps = rows_of_leaps(run)
    strips, ends = laid(run.true_poses[:, :2], leaps)
    with Studio(scene, *half) as studio:
        studio.lay(strips, to_rgb(plot.RUN))
        for row, carried in rows_shown(run, leaps, count):
            pose, lifted = pose_at(run, row, carried)
            picture = studio.robot_at(pose, np.flatnonzero(ends <= row), lifted)
            plane.begin()
            draw_run(plane, run, leaps, row, pose)
            lost = carried is None and not run.localised[row]
            if lost:
                plane.text(pose[:2], "?", size=20, bold=True, offset=(0, -22))
            caption = caption_of(run, task, row, carried, leaps)
            yield captioned(width, caption, f"{run.t[row]:.1f} s", picture, plane.taken())


def rows_of_leaps(run):
    """Rows of a run in which the robot stands where it was put."""
    return np.searchsorted(run.t, run.kidnapped - 0.5 * run.t[1:2].sum()).tolist()


def laid(path, leaps):
    """The strips of a path without its leaps, and the row by which the robot is past each."""
    strips, ends = [], []
    for begin, end in pairwise([0, *leaps, len(path)]):
        pieces = strips_of(path[begin:end])
        walked = np.linalg.norm(np.diff(path[begin:end], axis=0), axis=1).cumsum()
        total = np.arange(1, len(pieces) + 1) * walked[-1] / max(1, len(pieces))
        strips.append(pieces)
        ends.append(begin + 1 + np.searchsorted(walked, total - 1e-9))
    return np.concatenate(strips), np.concatenate(ends)


def rows_shown(run, leaps, count):
    """For each frame the row of the run, and where the robot is carried the share of that way."""
    lift = round(CARRIED * count)
    rows = steps(len(run.t) - 1, count - lift * len(leaps))
    for k, row in enumerate(rows.tolist()):
        for leap in leaps:
            if row >= leap > (rows[k - 1] if k else -1):
                yield from ((leap, share) for share in np.linspace(0, 1, lift))
        yield row, None


def pose_at(run, row, carried):
    """The pose of the robot, and how far it is above the floor in m."""
    if carried is None:
        return run.true_poses[row], 0.0
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip(1.5 * carried - 0.25, 0, 1))
    before, after = run.true_poses[row - 1], run.true_poses[row]
    return before + share * (after - before), HELD_UP * min(1.0, 4 * carried, 4 * (1 - carried))


def draw_still(ax, task, shown=None):
    """The map, the task, and as it was shown if that was otherwise."""
    plot.workspace(recordings.background_map(), None, (), ax)
    if shown is not None:
        look = {"colour": plot.BACKGROUND, "linestyle": "--", "linewidth": 1.2}
        plot.boxes(ax, shown.environment.boxes, **look)
        plot.path(ax, shown.law.response(), "as it was shown", **look)
    plot.boxes(ax, task.environment.boxes, "objects")
    plot.law(ax, task.law.response())
    plot.subgoals(ax, task.law.subgoals)
    look = {"textcoords": "offset points", "path_effects": [plot.HALO], "zorder": 8}
    for k, place in enumerate(task.law.subgoals, 1):
        ax.annotate(str(k), place, xytext=(5, 4), weight="bold", **look)
    plot.path(ax, np.empty((0, 2)), "robot's way", plot.RUN, linewidth=2)
    ax.plot([], [], "o", color=plot.ROBOT, markeredgecolor="black", markersize=8, label="robot")


def draw_run(plane, run, leaps, row, pose):
    """The robot's way so far, its leaps, and the robot."""
    places = run.true_poses[: row + 1, :2]
    past = [leap for leap in leaps if leap <= row]
    for begin, end in pairwise([0, *past, len(places)]):
        plane.line(places[begin:end], plot.RUN, 3)
    for leap in past:
        plane.dotted(places[leap - 1], pose[:2] if leap == row else places[leap], width=1.6)
    plane.robot(pose, run.radius)


def caption_of(run, task, row, carried, leaps):
    """What happens, in words."""
    if carried is not None:
        return "kidnapped: carried off, and not told"
    if not run.localised[row]:
        return "lost: it turns until it knows where it is"
    if row == len(run.t) - 1:
        touched = f"touched something {run.collisions} times" if run.collisions else "nothing touched"
        return f"finished, {touched}" if run.finished else run.reason
    on = "goes on" if any(row >= leap for leap in leaps) else "performs the task"
    return f"the robot {on}: to subgoal {run.active[row] + 1} of {len(task.law.subgoals)}"
