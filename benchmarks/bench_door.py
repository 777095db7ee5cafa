"""How quick the door is: whole processes that import the library or ask for help, beside a bare `import numpy`.

python -m benchmarks door
"""

import subprocess
import sys

from benchmarks.timing import row, seconds

NUMPY = "import numpy"
LIBRARY = "import dollop"
CASES = (  # what is timed, what it is measured by, and how many times longer it may take
    ("import dollop.cli", LIBRARY, 1.5),
    ("from dollop.cli import main; main(['--help'])", NUMPY, 3.0),
    (LIBRARY, NUMPY, 3.0),
)


def process(code):
    """Run a Python that does this and nothing else."""
    subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=True)


def run(repeats=15):
    """Time each process and what it is measured by; the bound is a multiple of the latter.

    Returns
    -------
    list of dict
    """
    rows = []
    for code, measure, times in CASES:
        baseline, _ = seconds(lambda code=measure: process(code), repeats)
        median, _ = seconds(lambda code=code: process(code), repeats)
        rows.append(row(f"{code} (beside {measure})", median, baseline, times * baseline))
    return rows
