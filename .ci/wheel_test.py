"""The method's tests on the installed wheel, away from the checkout, by the Python that runs this.

    python .ci/wheel_test.py [argument of pytest ...]

Builds the wheel, installs it with the extra `test` into a fresh venv (the lock's versions, never
PyBullet), takes the replication out of the installed package, and runs what tests the method: its
tests and the examples in its docstrings. Needs nothing but Python and pip, on any system.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ("dollop", "book/package.md", "pyproject.toml", "LICENSE", "MANIFEST.in")
TESTS = ("tests", "data", "benchmarks", "pyproject.toml")
OF_THE_CHECKOUT = (
    "replication",
    *("test_book.py", "test_house.py", "test_own_log.py", "test_package.py", "test_project_files.py"),
    "test_readme.py",
)
PYTEST = ("-m", "pytest", "-m", "not replication", "-p", "no:cacheprovider", "-n", "2", "-q")
WHERE = "import dollop, os; print(os.path.dirname(dollop.__file__))"


def main(arguments):
    """Build, install, test; the exit code is pytest's."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        place = Path(folder).resolve()
        copy(PACKAGE, place / "sources")
        copy(TESTS, place / "away", OF_THE_CHECKOUT)
        python = install(place)
        found = run([python, "-c", WHERE], place, stdout=subprocess.PIPE, check=True)
        shutil.rmtree(Path(found.stdout.strip()) / "replication")
        tests = [python, *PYTEST, *arguments, "tests", "--pyargs", "dollop"]
        return run(tests, place / "away").returncode


def copy(names, place, left_out=()):
    """Copy files and folders of the checkout to another place."""
    ignore = shutil.ignore_patterns("__pycache__", *left_out)
    for name in names:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, place / name, ignore=ignore)
        else:
            shutil.copy(ROOT / name, place / name)


def install(place):
    """A venv with the wheel and what its tests need; its Python."""
    venv.create(place / "venv", with_pip=True)
    python = place / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip = [python, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    run([*pip, "wheel", "--no-deps", "--wheel-dir", place, place / "sources"], place, check=True)
    wanted = [f"{next(place.glob('*.whl'))}[test]", "--constraint", ROOT / "environment.txt"]
    run([*pip, "install", "--only-binary", ":all:", *wanted], place, check=True)
    return python


def run(command, folder, **options):
    """Run a command without a screen, and without a path to another copy of the package."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    kept |= {"MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(command, cwd=folder, env=kept, text=True, **options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
