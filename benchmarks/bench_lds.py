"""Sequenced LDS: how long the exact search takes, beside the same search with one segment after the other.

python -m benchmarks lds
"""

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lds import DECAY, LDS, STEPS, Statistics
from dollop.segmentation import HORIZON, fewest_segments
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import align, distance_to_polyline, retime

SAMPLES, CANDIDATES = 200, 100
BOUNDS = {1: 0.1, 5: 0.5}  # s


def laps(n, seed=0):
    """n laps of a wobbling figure-eight, about 17 m and 200 samples each, no two alike."""
    rng, angle = np.random.default_rng(seed), np.linspace(0, 2 * np.pi, SAMPLES)
    eight = np.stack([3.2 * np.sin(angle), 1.3 * np.sin(2 * angle)], axis=1)
    waves = np.sin(np.arange(1, 6)[:, None] * angle)
    return [eight + (0.05 * rng.normal(size=(2, 5)) @ waves).T for _ in range(n)]


def plain_fit(walks, tolerance=0.02):
    """The number of segments by the plain way: every candidate segment cut out, re-timed, fitted and measured alone."""
    aligned, _ = align(walks, 2 * CANDIDATES - 1)
    path = aligned.mean(axis=0)[::2]
    errors = np.full((CANDIDATES, CANDIDATES), np.inf)
    for i in range(CANDIDATES):
        for j in range(i + 2, CANDIDATES):
            first, *others = (Statistics.of(retime(walk[2 * i : 2 * j + 1], STEPS, DECAY)) for walk in aligned)
            response = LDS(sum(others, first), path[j]).response(path[i], HORIZON)
            errors[i, j] = distance_to_polyline(path[i + 1 : j], np.vstack([response, path[j]])).sum()
    return len(fewest_segments(errors, tolerance)) - 1


def run(repeats=15):
    """Time `SequencedLDS.fit` on one lap and on five.

    Returns
    -------
    list of dict
    """
    rows = []
    for n, bound in BOUNDS.items():
        walks = laps(n)
        median, law = seconds(lambda walks=walks: SequencedLDS.fit(walks), repeats)
        baseline, segments = seconds(lambda walks=walks: plain_fit(walks), 1)
        assert segments == len(law.segments), f"both must find the same, got {len(law.segments)} and {segments}"
        rows.append(row(f"SequencedLDS.fit, {n} x {SAMPLES} samples", median, baseline, bound))
    return rows
