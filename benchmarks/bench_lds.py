"""Sequenced LDS: how long the exact search takes, beside the same search with one segment after the other.

Where movement_primitives is installed, beside its DMP of 50 weights as well, which is trained in the same run; and
the errors of a walk of 100,000 samples.

python -m benchmarks lds
"""

import numpy as np

from benchmarks.timing import row, seconds
from dollop.lds import DECAY, LDS, STEPS, Statistics
from dollop.segmentation import HORIZON, fewest_segments
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import align, distance_to_polyline, resample, retime

SAMPLES, CANDIDATES = 200, 100
BOUNDS = {1: 0.1, 5: 0.5}  # s
MOST_DMPS = 15  # times as long as a DMP may a fit of one walk take
LONG, LONG_BOUND = 100_000, 10.0  # samples, s


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


def beside_a_dmp(walk, repeats=50):
    """The row that compares a fit with a DMP of the same walk, or none where movement_primitives is not installed."""
    try:
        from movement_primitives.dmp import DMP
    except ImportError:
        return []
    t = 0.1 * np.arange(len(walk))
    dmp, _ = seconds(lambda: DMP(2, execution_time=t[-1], dt=0.1, n_weights_per_dim=50).imitate(t, walk), repeats)
    fit, _ = seconds(lambda: SequencedLDS.fit(walk), repeats)
    return [row(f"SequencedLDS.fit, beside a DMP, bound {MOST_DMPS} of them", fit, dmp, MOST_DMPS * dmp)]


def errors_of_a_long_walk():
    """The row for `SequencedLDS.errors` of very many samples."""
    walk = laps(1)[0]
    law, long = SequencedLDS.fit(walk), resample(walk, LONG)
    return row(f"SequencedLDS.errors, {LONG} samples", seconds(lambda: law.errors(long), 1)[0], None, LONG_BOUND)


def run(repeats=15):
    """Time `SequencedLDS.fit` on one lap and on five, beside a DMP, and the errors of a long walk.

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
    return [*rows, *beside_a_dmp(laps(1)[0]), errors_of_a_long_walk()]
