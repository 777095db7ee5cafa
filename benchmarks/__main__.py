"""Run every benchmark and print one table: python -m benchmarks [name ...]."""

import importlib
import pkgutil
import sys

import pandas as pd

import benchmarks


def main(names):
    known = [m.name.removeprefix("bench_") for m in pkgutil.iter_modules(benchmarks.__path__) if "bench_" in m.name]
    unknown = set(names) - set(known)
    if unknown:
        sys.exit(f"no benchmark {', '.join(sorted(unknown))}; known: {', '.join(known)}")
    rows = []
    for name in names or known:
        print(f"{name} ...", file=sys.stderr)
        rows += importlib.import_module(f"benchmarks.bench_{name}").run()
    print(pd.DataFrame(rows).to_string(index=False, float_format=lambda value: f"{value:.3g}"))


if __name__ == "__main__":
    main(sys.argv[1:])
