"""What tests of the command line share: a folder with a map, and a task that was learned by a command."""

import shutil

import pytest
from places import DATA

from dollop.cli import main


@pytest.fixture(scope="session")
def learned(tmp_path_factory):
    """A folder with the lab's map and the task of the figure-eights, as `dollop learn` leaves it."""
    folder = tmp_path_factory.mktemp("learned")
    for name in ("lab.yaml", "lab.pgm"):
        shutil.copy(DATA / name, folder)
    log, out = str(DATA / "figure_eights.log.gz"), str(folder / "task.json")
    main(["learn", log, "--map", str(folder / "lab.yaml"), "--out", out])
    return folder


@pytest.fixture
def room(learned, tmp_path, monkeypatch):
    """A copy of that folder to work in."""
    shutil.copytree(learned, tmp_path / "room")
    monkeypatch.chdir(tmp_path / "room")
    return tmp_path / "room"
