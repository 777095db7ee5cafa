"""What is timed, against whom: each bench_*.py has run(), which returns rows made by `benchmarks.timing.row`."""
