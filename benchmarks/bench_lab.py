"""The lab's laser: scans per second, beside one ray after the other.

python -m benchmarks lab
"""

import statistics
from dataclasses import replace

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lab import Person, SickLMS200, figure_eight_scene, walks_of
from dollop.replication.worlds.draw import KINDS, draw

SCANS = 200
BOUND = 1000
"""Scans per second."""
WORLDS = range(200_000, 200_000 + 2 * len(KINDS))
"""Seeds of random worlds: two of every kind."""


def plain_scan(world, pose, sick):
    """True distances by one ray test per beam, each answer taken apart in Python."""
    x, y, theta = pose
    height, reach, distances = world.scene.robot.beam_height, sick.max_range, []
    for angle in sick.angles:
        end = [x + reach * np.cos(theta + angle), y + reach * np.sin(theta + angle), height]
        body, _, fraction, *_ = world.engine._call("rayTest", [x, y, height], end)[0]
        distances.append(reach * fraction if body >= 0 else np.inf)
    return np.array(distances)


def durations(scene, sick, repeats):
    """Seconds for `SCANS` scans of a scene and its people, by `World.scan` and plainly."""
    from dollop.lab import World

    pose, rng, times = scene.robot.laser_pose, np.random.default_rng(0), np.arange(SCANS) / 10
    with World(scene, walks_of(scene)) as world:

        def scan_all(scan):
            for time in times:
                world.at(time)
                scan()

        fast, _ = seconds(lambda: scan_all(lambda: world.scan(pose, rng, sick)), repeats)
        plain, _ = seconds(lambda: scan_all(lambda: plain_scan(world, pose, sick)), 1)
    return fast, plain


def run(repeats=3):
    """Time `World.scan` with 181 beams in the paper's room and in random worlds; the bound is 1,000 scans/s.

    Returns
    -------
    list of dict
    """
    eights = replace(figure_eight_scene(), people=[Person([(4.5, 3.6)])])
    fast, plain = durations(eights, eights.robot.scanner, repeats)
    rows = [row(f"SICK, {SCANS} scans of 181 beams ({SCANS / fast:.0f} scans/s)", fast, plain, SCANS / BOUND)]
    sick = SickLMS200(mode="cm")
    found = np.array([durations(draw(seed).demonstrations[0], sick, repeats) for seed in WORLDS])
    fast, plain = (statistics.median(each) for each in found.T)
    slowest = SCANS / found[:, 0].max()
    name = f"the same, median of {len(found)} worlds ({SCANS / fast:.0f} scans/s, slowest {slowest:.0f})"
    return [*rows, row(name, fast, plain, SCANS / BOUND)]
