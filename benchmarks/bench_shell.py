"""From a log and a map to a robot that drives, by shell: whole processes, beside one that only imports.

python -m benchmarks shell
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.timing import row, seconds

DATA = Path(__file__).parents[1] / "data"
IMPORTS = "import dollop, matplotlib.pyplot"
COMMANDS = (  # what is run, and how many times longer than the imports alone it may take
    (f"map {DATA}/empty_lab.log.gz room.yaml", 4.0),
    (f"learn {DATA}/figure_eights.log.gz --map room.yaml --out task.json", 4.0),
    (f"adapt task.json {DATA}/moved_cans_0.log.gz --map room.yaml --out now.json", 4.0),
    ("perform now.json --map room.yaml --out run.csv", 4.0),
)


def run(repeats=5):
    """Time the four commands of a log of 93 s, each beside a process that only imports, and all of them.

    Returns
    -------
    list of dict
    """
    with TemporaryDirectory() as folder:

        def process(*words):
            subprocess.run([sys.executable, *words], cwd=folder, stdout=subprocess.DEVNULL, check=True)

        baseline, _ = seconds(lambda: process("-c", IMPORTS), repeats)
        rows = []
        for command, times in COMMANDS:
            words = command.split()
            median, _ = seconds(lambda words=words: process("-m", "dollop", *words), repeats)
            rows.append(row(f"dollop {words[0]} (beside {IMPORTS})", median, baseline, times * baseline))
        whole = sum(each["median_s"] for each in rows)
        return [*rows, row("all four", whole, baseline, 16 * baseline)]
