"""How much faster than real time a task is performed: python -m benchmarks execution."""

from time import perf_counter
from types import SimpleNamespace

import numpy as np

from benchmarks.timing import row, seconds
from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.lab import figure_eight, figure_eight_scene, record_background
from dollop.robot import Controller, Unicycle, perform
from dollop.sequenced_lds import SequencedLDS

START = (4.5, 3.5, -0.7)


def run():
    """Time performing the figure-eight; the baseline is the time that the robot itself takes.

    Returns
    -------
    list of dict
    """
    background = OccupancyGrid.from_log(record_background(0))
    scene = figure_eight_scene()
    task = SimpleNamespace(law=learned_law(scene), environment=Environment(scene.boxes))
    rows = [
        timed(f"unicycle, {control}", 1000, lambda: Unicycle(START), task, control, background)
        for control in ("plain", "pursuit")
    ]
    return [*rows, *timed_steps(task, background), timed_in_lab(scene, task, background)]


def learned_law(scene):
    """The law of five walked figure-eights."""
    walks = [figure_eight(scene, seed, laps=1) for seed in range(5)]
    return SequencedLDS.fit([walk.positions[walk.speeds > 0.3][::5] for walk in walks])


def timed(name, times_real, make_robot, task, control, background, repeats=5):
    """One row of the table: a run must be `times_real` times faster than the robot."""
    median, performed = seconds(lambda: perform(task, make_robot(), control, background=background), repeats)
    assert performed.finished, performed.reason
    real = float(performed.t[-1])
    return row(name, median, real, real / times_real)


def timed_steps(task, background):
    """Rows for one step of a loop of one's own, in the median, and for planning a response anew.

    The baseline is the control period. A step is to take 0.2 ms at most, and planning 20 ms.
    """
    robot = Unicycle(START)
    controller, taken = Controller(task, robot, background=background), []
    while not controller.over:
        begun = perf_counter()
        command = controller.step(robot.pose)
        taken.append(perf_counter() - begun)
        robot.drive(*command)
    planning, _ = seconds(lambda: planned(task, background).step(START), 11)
    making, _ = seconds(lambda: planned(task, background), 11)
    steps = row("one step, median", float(np.median(taken)), robot.period, 0.2e-3)
    return steps, row("planning a response anew", planning - making, robot.period, 20e-3)


def planned(task, background):
    """A controller whose first step plans."""
    return Controller(task, Unicycle(START), background=background)


def timed_in_lab(scene, task, background):
    """A row for the Pioneer in PyBullet with its laser and its localisation."""
    from dollop.lab import Pioneer, World

    with World(scene) as world:
        robot = Pioneer(world, START, background, task.environment, seed=0)

        def back_at_start():
            robot.place(START)
            robot.localizer.start(START)
            return robot

        name = "Pioneer in PyBullet, localised, pursuit"
        return timed(name, 10, back_at_start, task, "pursuit", background, repeats=3)
