"""What is timed, against whom: each bench_*.py has run() -> rows of name, median_s, baseline_s, ratio, bound."""
