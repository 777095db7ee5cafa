"""How long cutting laps takes, beside the plain way of finding their length: python -m benchmarks laps."""

import numpy as np

from benchmarks.timing import row, seconds
from dollop.laps import cut_laps
from dollop.trajectory import resample

RATE = 100  # Hz
CASES = ((10_000, 0.5, 5), (100_000, 5.0, 3))  # samples, bound in s, repetitions


def walk(n, laps=10, jitter=0.01, seed=0):
    """Times (n,) in s and positions (n, 2) in m of figure-eights, each sample with jitter."""
    angle = np.linspace(0, 2 * np.pi * (laps + 0.05), n)
    eight = np.stack([3.2 * np.sin(angle), 1.3 * np.sin(2 * angle)], axis=1)
    return np.arange(n) / RATE, eight + np.random.default_rng(seed).normal(0, jitter, eight.shape)


def plain_lag(track):
    """After how many samples a track is nearest to itself, by its distance at every lag beyond a twentieth."""
    lags = range(len(track) // 20, 2 * len(track) // 3)
    return lags[np.argmin([np.median(np.linalg.norm(track[lag:] - track[:-lag], axis=1)) for lag in lags])]


def run():
    """Time ten laps of ten thousand samples and of ten times as many; the plain way of the short walk only.

    Returns
    -------
    list of dict
    """
    rows = []
    for n, bound, repeats in CASES:
        t, positions = walk(n)
        median, cut = seconds(lambda t=t, positions=positions: cut_laps(t, positions), repeats)
        assert len(cut.laps) == 10, f"ten laps were walked, got {len(cut.laps)}"
        track = resample(positions, n)
        plain = seconds(lambda track=track: plain_lag(track), 1)[0] if n <= 10_000 else None
        rows.append(row(f"cut_laps, {n} samples", median, plain, bound))
    return rows
