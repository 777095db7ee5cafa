"""How the benchmarks time: medians of repeated calls in one process."""

import statistics
import time


def seconds(call, repeats):
    """Median duration of a call in s over `repeats` after one that does not count, and its last result."""
    durations, result = [], call()
    for _ in range(repeats):
        begin = time.perf_counter()
        result = call()
        durations.append(time.perf_counter() - begin)
    return statistics.median(durations), result


def row(name, median, baseline, bound):
    """One line of the table: seconds, the plain baseline's seconds, how many times faster, and the bound in s."""
    ratio = None if baseline is None else baseline / median
    within = "yes" if median <= bound else "NO"
    return dict(name=name, median_s=median, baseline_s=baseline, ratio=ratio, bound_s=bound, within=within)
