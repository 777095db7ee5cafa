"""What a command writes replaces nothing of anybody else's, and neither does what it says comes next."""

import shutil
from pathlib import Path

import pytest
from called import call
from places import DATA

from dollop import plot
from dollop.cli import main

LAB, EIGHTS, SLALOM = DATA / "lab.yaml", DATA / "figure_eights.log.gz", DATA / "slalom_0.log.gz"
EMPTY, LOOK = DATA / "empty_lab.log.gz", DATA / "moved_cans_0.log.gz"


def held(folder):
    """What the files of a folder hold."""
    return {path: path.read_bytes() for path in folder.iterdir()}


COMMANDS = {
    "map": ["map", EMPTY, "room.yaml"],
    "learn": ["learn", SLALOM, "--map", "lab.yaml", "--out", "slalom.json"],
    "adapt": ["adapt", "task.json", LOOK, "--map", "lab.yaml", "--out", "now.json"],
    "perform": ["perform", "task.json", "--map", "lab.yaml", "--out", "run.csv"],
    "not finished": ["perform", "task.json", "--map", "lab.yaml", "--out", "run.csv", "--timeout", "2"],
    "observe": ["observe", SLALOM, "lab.yaml"],
    "export": ["export", "task.json", "--to", "csv", "--out", "path.csv"],
    "show a log": ["show", EMPTY, "--out", "shown.png"],
    "show a log on a map": ["show", SLALOM, "--map", "lab.yaml", "--out", "shown.png"],
    "show a task": ["show", "task.json", "--out", "shown.png"],
    "show a task on a map": ["show", "task.json", "--map", "lab.yaml", "--out", "shown.png"],
}


@pytest.fixture
def blank(monkeypatch):
    """Pictures that nobody looks at take no time to draw."""
    picture = plot.png(lambda ax: None)
    monkeypatch.setattr(plot, "png", lambda draw, title=None: picture)


@pytest.fixture(scope="module")
def occupied(learned, tmp_path_factory):
    """That folder with a map and a run more, as commands leave them."""
    folder = tmp_path_factory.mktemp("occupied") / "room"
    shutil.copytree(learned, folder)
    main(["map", str(EMPTY), str(folder / "room.yaml")])
    task, background = str(folder / "task.json"), str(folder / "lab.yaml")
    main(["perform", task, "--map", background, "--out", str(folder / "run.csv")])
    return folder


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("command", COMMANDS)
def test_what_comes_next_replaces_nothing(command, room, capsys):
    """Said twice, and done each time: what was there is as it was, and so is what was written in between."""
    for _ in range(2):
        said = call(capsys, *COMMANDS[command])
        before = held(room)
        assert call(capsys, *said.next).status in (0, 3)
        assert before.items() <= held(room).items() and len(held(room)) > len(before)


def test_names_of_what_comes_next_are_those_of_the_file(room, capsys):
    """A task's run and path are named after it, and a number is in the name of what is there already."""
    shutil.copy("task.json", "eights.json")
    shown = call(capsys, "show", "eights.json", "--map", "lab.yaml", "--out", "shown.png")
    assert shown.next[-1] == "eights_run.csv"
    Path("eights_run.png").touch()
    shown = call(capsys, "show", "eights.json", "--map", "lab.yaml", "--out", "shown.png")
    assert shown.next[-1] == "eights_run_2.csv"
    assert call(capsys, "show", "eights.json", "--out", "shown.png").next[-1] == "eights_path.csv"


@pytest.mark.parametrize(
    ("words", "owner"),
    [
        (["learn", SLALOM, "--map", "lab.yaml", "--out", "room.json"], "room.yaml"),
        (["observe", SLALOM, "lab.yaml", "--out", "room.csv"], "room.yaml"),
        (["show", "task.json", "--map", "room.yaml", "--out", "room.png"], "room.yaml"),
        (["perform", "task.json", "--map", "lab.yaml", "--out", "task.csv"], "task.json"),
        (["map", EMPTY, "task.yaml"], "task.json"),
        (["map", EMPTY, "task.map.gz"], "task.json"),
        (["show", "run.csv", "--out", "task.png"], "task.json"),
        (["show", "task.json", "--out", "run.png"], "run.csv"),
    ],
)
def test_the_picture_of_something_else_is_not_replaced(words, owner, occupied, monkeypatch, capsys):
    """One line names the file that it belongs to, before the work, and nothing is written."""
    monkeypatch.chdir(occupied)
    before = held(occupied)
    said = call(capsys, *words)
    assert said.status == 1 and f"it is the picture of {owner}: choose another --out" in said.err
    assert said.err.count("\n") == 1 and held(occupied) == before


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("command", ["map", "learn", "perform", "observe", "show a task"])
def test_the_same_command_works_again(command, room, capsys):
    """Over its own files, also where an exported route bears the same name."""
    for to, name in (("nav2", "task.geojson"), ("waypoints", "task.yaml")):
        assert call(capsys, "export", "task.json", "--to", to, "--out", name).status == 0
    assert call(capsys, *COMMANDS[command]).status == 0
    first = held(room)
    assert call(capsys, *COMMANDS[command]).status == 0 and held(room) == first


@pytest.mark.usefixtures("blank")
def test_a_task_is_adapted_in_its_place(room, capsys):
    """Its own file is the one that may be replaced, also where an exported route bears the same name."""
    assert call(capsys, "export", "task.json", "--to", "nav2", "--out", "task.geojson").status == 0
    before = held(room)
    assert call(capsys, "adapt", "task.json", LOOK, "--map", "lab.yaml", "--out", "task.json").status == 0
    assert held(room)[room / "task.json"] != before[room / "task.json"]
