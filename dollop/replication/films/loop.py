"""The loop at the top of the README: somebody shows a task, and the robot does it elsewhere."""

from functools import cache

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image, ImageDraw

import dollop
from dollop import lab, plot
from dollop.pose import wrapped
from dollop.replication import recordings
from dollop.replication.films.canvas import even, font
from dollop.replication.films.reel import film_of
from dollop.replication.films.showing import legs_of, strips_of
from dollop.trajectory import arc_length

__all__ = []

WIDTH, HEIGHT, TITLE, GAP = 800, 358, 34, 8
"""Pixels of a frame: its size, the height of its titles, and what is between its halves."""
SHOWN, DONE = "shown once", "done, though a can has moved"
MOVED = (0.85, -0.75), (0.0, 0.0)
"""How far each can is moved in m along x and y: the left one alone."""
TAIL = 0.8
"""Share of the way that lies on the floor behind who goes it."""
STOOD = 1.2
"""s for which the person stands before and after the walk, of which the film shows nothing."""
RING, BARB = 0.24, 0.22
"""m: radius of the ring where the can stood, and length of the two barbs of the arrow."""


@film_of("dollop", seconds=8.0, suffix=".gif", rate=20)
def loop(width, count):
    """A person shows a task once; the robot does it, though a can has moved.

    Two pictures of one laboratory side by side. Left a person walks a figure-eight round two trash
    cans, once, while a robot with a laser stands and watches. Right one of the cans stands
    somewhere else, an arrow on the floor leads there from where it stood, and the robot drives the
    figure-eight round the cans as they stand now. A blue line on the floor follows the person, a
    pink one the robot.
    """
    unit = width / WIDTH
    half = (width - round(GAP * unit)) // 2, even(HEIGHT * unit) - even(TITLE * unit)
    for left, right in zip(walked(half, count), performed(half, count), strict=True):
        yield side_by_side(width, left, right)


def side_by_side(width, left, right):
    """A frame of the loop."""
    unit, title = width / WIDTH, even(TITLE * width / WIDTH)
    frame = Image.new("RGB", (width, title + left.height), "white")
    pen, face = ImageDraw.Draw(frame), font("DejaVuSans-Bold", 17 * unit)
    for picture, across, words in ((left, 0, SHOWN), (right, width - right.width, DONE)):
        frame.paste(picture, (across, title))
        pen.text((across + picture.width / 2, title / 2), words, "black", face, anchor="mm")
    return frame


def walked(size, count):
    """Pictures of the person: a walk that ends where it began, as the loop wants it."""
    from dollop.lab.render import Studio

    walk = round_walk(legs_of(shown_once()), count)
    strips, way = strips_of(walk.positions), arc_length(walk.positions)
    with Studio(lab.figure_eight_scene(), *size, watching=True) as studio:
        studio.lay(strips, to_rgb(plot.USER))
        for k in range(count):
            place = walk.positions[k], walk.headings[k], walk.phases[k]
            yield studio.person_at(*place, behind(way[k] / way[-1], len(strips)))


def round_walk(walk, count):
    """A walk at `count` times and once more, which is the beginning again.

    What is missing to it, some centimetres and part of a stride, is spread over the walk.
    """
    share = np.linspace(0, 1, count + 1)
    places = [walk.at(t) for t in STOOD + share * (walk.t[-1] - 2 * STOOD)]
    positions, headings, phases = (np.array(each) for each in zip(*places, strict=True))
    positions = positions - np.outer(share, positions[-1] - positions[0])
    headings = headings - share * wrapped(headings[-1] - headings[0])
    strides = (phases[-1] - phases[0]) / (2 * np.pi)
    phases = phases[0] + (phases - phases[0]) * round(strides) / strides
    return lab.Walk(share, positions, headings, phases)


def performed(size, count):
    """Pictures of the robot on its second round, which begins and ends where the first ended."""
    from dollop.lab.render import Studio

    run = second_round()
    path = run.true_poses[:, :2]
    strips, way = strips_of(path), arc_length(path)
    with Studio(moved_scene(), *size, marks=moved_marks()) as studio:
        studio.lay(strips, to_rgb(plot.RUN))
        for row in np.linspace(0, len(path) - 1, count, endpoint=False).round().astype(int):
            yield studio.robot_at(run.true_poses[row], behind(way[row] / way[-1], len(strips)))


def behind(share, pieces):
    """Which of the pieces of a closed way lie behind who has gone that share of it."""
    last = int(share * pieces)
    return [k % pieces for k in range(last - int(TAIL * pieces), last)]


@cache
def shown_once():
    """Recording of a single figure-eight."""
    return lab.record_figure_eights(recordings.SEED, laps=1, **recordings.KEPT)


def moved_scene():
    """The scene of the demonstration with one can moved."""
    return lab.moved(lab.figure_eight_scene(), MOVED)


def moved_marks():
    """Strips (K, 2, 2) on the floor: a dashed ring where the can stood, and an arrow from there."""
    start, end = lab.figure_eight_scene().positions[0], moved_scene().positions[0]
    along = (end - start) / np.linalg.norm(end - start)
    turn = np.linspace(0, 2 * np.pi, 25)
    ring = start + RING * np.column_stack([np.cos(turn), np.sin(turn)])
    tail, head = start + (RING + 0.06) * along, end - (RING + 0.08) * along
    aside = np.array([-along[1], along[0]])
    barbs = [(head, head - BARB * (along + side * aside) / np.sqrt(2)) for side in (-1, 1)]
    return [*np.stack([ring[:-1], ring[1:]], axis=1)[::2], (tail, head), *barbs]


@cache
def second_round():
    """The task, learned from a single walk and moved with the can, performed for the second time."""
    background = recordings.background_map()
    task = dollop.learn([dollop.Demonstration.of(dollop.observe(shown_once().log, background))])
    seen = lab.watch(moved_scene(), recordings.SEED)
    task = task.adapt(dollop.observe(seen.log, background).environment)
    (start,) = recordings.starts_near_the_beginning(task, 1, np.random.default_rng(recordings.SEED))
    with lab.World(moved_scene()) as world:
        robot = lab.Pioneer(world, start, background, task.environment, recordings.SEED)
        for _ in range(2):
            run = dollop.perform(task, robot, background=background)
            if not run.finished or run.collisions:
                raise RuntimeError(f"the robot must do what the loop says that it does, got {run}")
        return run
