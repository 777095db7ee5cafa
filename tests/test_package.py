"""The package: built without a network, and used elsewhere without the replication."""

import email
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

import pytest
from places import DATA, ROOT

import dollop

pytest.importorskip("setuptools", reason="building needs setuptools")
FOLDERS = ("dollop", "book", "tests", "data")
FILES = ("pyproject.toml", "LICENSE", "README.md", "MANIFEST.in")
BUILD = "from setuptools import build_meta as by; print(by.build_{}('..'))"
USE = """
import sys, dollop
log = dollop.LaserLog([0.0], [[1.0, 2.0]], [-0.1, 0.1], [[0.0, 0.0, 0.0]], 8.0)
room = dollop.OccupancyGrid.load(sys.argv[1])
print(dollop.__file__, dollop.__version__, log.ranges.shape, room.occupancy.ndim)
"""


def build(kind, checkout):
    """Build an sdist or a wheel beside a checkout; its path."""
    command = [sys.executable, "-c", BUILD.format(kind)]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True, check=True)
    return checkout.parent / done.stdout.splitlines()[-1]


def content(wheel):
    """Bytes of each file of a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built from a copy of the checkout."""
    checkout = tmp_path_factory.mktemp("wheel") / "checkout"
    for name in FOLDERS:
        shutil.copytree(ROOT / name, checkout / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copy(ROOT / name, checkout)
    return build("wheel", checkout)


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A folder into which the wheel was installed, the replication taken out."""
    folder = tmp_path_factory.mktemp("installed")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--target", str(folder), str(wheel)], check=True)
    shutil.rmtree(folder / "dollop" / "replication")
    return folder


def python(installed, *arguments):
    """Run Python outside of the checkout; -S leaves out the hook that finds an editable one."""
    path = os.pathsep.join([str(installed), sysconfig.get_path("purelib")])
    surroundings = os.environ | {"PYTHONPATH": path}
    command = [sys.executable, "-S", *arguments]
    return subprocess.run(command, cwd=installed, env=surroundings, capture_output=True, text=True)


def test_the_wheel_holds_the_package_and_its_data_and_no_tests(wheel):
    """Code, robot model and licence are in it; nothing of tests, notebooks or recordings."""
    names = set(content(wheel))
    folders = {name.split("/")[0] for name in names}
    assert folders == {"dollop", f"dollop-{dollop.__version__}.dist-info"}
    assert "dollop/lab/pioneer2dx.urdf" in names
    wanted = [path for kind in ("py", "urdf", "json") for path in (ROOT / "dollop").rglob(f"*.{kind}")]
    assert {path.relative_to(ROOT).as_posix() for path in wanted} <= names
    assert not any("test_" in name or name.endswith(".gz") for name in names)


def test_the_metadata_says_what_an_index_shows(wheel):
    """Version, licence, Pythons; the long text has no picture and no link."""
    files = content(wheel)
    metadata = next(text for name, text in files.items() if name.endswith("/METADATA"))
    fields = email.message_from_bytes(metadata)
    assert fields["Version"] == dollop.__version__
    assert fields["License-Expression"] == "BSD-3-Clause"
    pythons = {f"Programming Language :: Python :: 3.{minor}" for minor in (11, 12, 13)}
    assert pythons <= set(fields.get_all("Classifier"))
    assert fields["Description-Content-Type"] == "text/markdown"
    assert fields.get_payload().startswith("# Dollop")
    assert "](" not in fields.get_payload() and "<img" not in fields.get_payload()


def test_the_sdist_builds_the_same_wheel(wheel, tmp_path):
    """Who builds from the source distribution gets our wheel, byte for byte."""
    sdist = build("sdist", wheel.parent / "checkout")
    with tarfile.open(sdist) as archive:
        assert not any("/tests/" in name for name in archive.getnames())
        archive.extractall(tmp_path, filter="data")
    again = build("wheel", tmp_path / sdist.name.removesuffix(".tar.gz"))
    assert content(again) == content(wheel)


def test_the_installed_package_works_without_the_replication(installed):
    """Outside of the checkout it says its version, makes a log and loads a map."""
    used = python(installed, "-c", USE, str(DATA / "lab.yaml"))
    assert used.returncode == 0, used.stderr
    place, *said = used.stdout.split(maxsplit=1)
    assert Path(place).is_relative_to(installed)
    assert said == [f"{dollop.__version__} (1, 2) 2\n"]


def test_the_installed_command_says_its_version(installed):
    """`python -m dollop --version`"""
    told = python(installed, "-m", "dollop", "--version")
    assert told.returncode == 0, told.stderr
    assert told.stdout.split()[-1] == dollop.__version__


def test_without_the_replication_the_figures_say_so_in_one_line(installed):
    """No traceback, and a status that a script notices."""
    refused = python(installed, "-m", "dollop.figures")
    assert refused.returncode != 0
    assert len(refused.stderr.strip().splitlines()) == 1 and "replication" in refused.stderr
