"""The lab's laser: scans per second, beside one ray after the other.

python -m benchmarks lab
"""

from dataclasses import replace

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lab import Person, figure_eight_scene, walks_of

SCANS = 200
BOUND = 1000
"""Scans per second."""


def plain_scan(world, pose, sick):
    """True distances by one ray test per beam, each answer taken apart in Python."""
    x, y, theta = pose
    height, reach, distances = world.scene.robot.beam_height, sick.max_range, []
    for angle in sick.angles:
        end = [x + reach * np.cos(theta + angle), y + reach * np.sin(theta + angle), height]
        body, _, fraction, *_ = world.engine._call("rayTest", [x, y, height], end)[0]
        distances.append(reach * fraction if body >= 0 else np.inf)
    return np.array(distances)


def run(repeats=7):
    """Time `World.scan` in the figure-eight scene with a person; the bound is 1,000 scans/s.

    Returns
    -------
    list of dict
    """
    from dollop.lab import World

    scene, rng = replace(figure_eight_scene(), people=[Person([(4.5, 3.6)])]), np.random.default_rng(0)
    pose, sick = scene.robot.laser_pose, scene.robot.scanner
    with World(scene, walks_of(scene)) as world:
        world.at(0.0)
        fast, _ = seconds(lambda: [world.scan(pose, rng) for _ in range(SCANS)], repeats)
        plain, _ = seconds(lambda: [plain_scan(world, pose, sick) for _ in range(SCANS)], 3)
    name = f"SICK, {SCANS} scans of 181 beams ({SCANS / fast:.0f} scans/s)"
    return [row(name, fast, plain, SCANS / BOUND)]
