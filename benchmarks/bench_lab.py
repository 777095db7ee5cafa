"""The lab's SICK: scans per second, beside one ray after the other.

python -m benchmarks lab
"""

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lab import SickLMS200, figure_eight_scene
from dollop.lab.scenes import BEAM_HEIGHT

SCANS = 200


def plain_scan(world, pose, sick):
    """True distances by one ray test per beam, each answer taken apart in Python."""
    x, y, theta = pose
    reach, distances = sick.max_range, []
    for angle in sick.angles:
        end = [x + reach * np.cos(theta + angle), y + reach * np.sin(theta + angle), BEAM_HEIGHT]
        body, _, fraction, *_ = world.call("rayTest", [x, y, BEAM_HEIGHT], end)[0]
        distances.append(reach * fraction if body >= 0 else np.inf)
    return np.array(distances)


def run(repeats=7):
    """Time `SickLMS200.scan` in the figure-eight scene with a person; the bound is 500 scans/s.

    Returns
    -------
    list of dict
    """
    from dollop.lab import World, laser_pose

    scene, sick, rng = figure_eight_scene(), SickLMS200(), np.random.default_rng(0)
    pose = laser_pose(scene.robot)
    with World(scene) as world:
        world.place_person(np.array([4.5, 3.6]), 0.0, 0.0)
        fast, _ = seconds(lambda: [sick.scan(world, pose, rng) for _ in range(SCANS)], repeats)
        plain, _ = seconds(lambda: [plain_scan(world, pose, sick) for _ in range(SCANS)], 3)
    name = f"SICK, {SCANS} scans of 181 beams ({SCANS / fast:.0f} scans/s)"
    return [row(name, fast, plain, SCANS / 500)]
