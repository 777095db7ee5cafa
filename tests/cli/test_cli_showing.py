"""dollop show, map and observe: every kind of file is told by its content; tables have the log's own time stamps."""

import json
import shutil
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from called import call
from PIL import Image
from places import DATA

import dollop
from dollop.cli import main

FILES = {
    "log": (DATA / "slalom_0.log.gz", "149 scans in 14.8 s"),
    "map": ("lab.yaml", "cells of 0.05 m"),
    "task": ("task.json", "a task of 6 subgoals over 17.1 m"),
    "run": ("run.csv", "finished"),
    "scene": (DATA / "slalom_0_scene.json", "4 objects"),
    "trajectory": ("user.csv", "walked: trajectory"),
    "everybody": ("all.csv", "walked: person 0"),
    "truth": (DATA / "slalom_0_truth.csv", "149 rows"),
    "carmen map": ("room.map", "a map of"),
}


@pytest.fixture(scope="module")
def of_all_kinds(learned, tmp_path_factory):
    """The folder with a run, trajectories and a CARMEN map."""
    folder = tmp_path_factory.mktemp("kinds") / "all"
    shutil.copytree(learned, folder)
    task, lab, run, user, everybody = (
        str(folder / name) for name in ("task.json", "lab.yaml", "run.csv", "user.csv", "all.csv")
    )
    main(["perform", task, "--map", lab, "--out", run])
    main(["observe", str(DATA / "slalom_0.log.gz"), lab, "--out", user, "--tracks", everybody])
    dollop.OccupancyGrid.load(lab).save(folder / "room.map")
    return folder


@pytest.fixture
def all_kinds(of_all_kinds, monkeypatch):
    """To be in that folder."""
    monkeypatch.chdir(of_all_kinds)


@pytest.mark.parametrize("kind", FILES)
def test_whatever_it_is_it_is_shown(kind, all_kinds, capsys):
    """A picture, and five lines of text, the last of which says what was written."""
    file, told = FILES[kind]
    said = call(capsys, "show", file, "--out", "shown.png")
    assert said.status == 0 and len(said.out.splitlines()) == 5 and told in said.out
    assert said.last.startswith("wrote shown.png; next: ")
    with Image.open("shown.png") as picture:
        assert picture.format == "PNG" and min(picture.size) > 400
    as_json = json.loads(call(capsys, "show", file, "--out", "shown.png", "--json").out)
    assert as_json["written"] == ["shown.png"] and as_json["file"] == str(file)


def test_the_kind_is_told_by_content_not_by_name(room, capsys):
    """A task that is called a table is a task; nothing but what is read must be named as its readers have it."""
    shutil.copy("task.json", "walk.csv")
    said = call(capsys, "show", "walk.csv", "--out", "shown.png", "--json")
    assert json.loads(said.out)["kind"] == "task"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"Dear diary,\n", "it is none of them"),
        (b"", "it is none of them"),
        (b"P5 1 1 255 0", "got thing, which is a PGM picture"),
        (b"\x89PNG\r\n\x1a\n", "got thing, which is a PNG picture"),
        (b"t,x,y,occluded\n", "columns x and y, and a row"),
        (b"t,x,y,occluded\n1,2,three,False\n", "a row must have a number for each of t,x,y,occluded"),
        (b"t,x,y,occluded\n1,2\n", "a row must have a number for each of t,x,y,occluded"),
    ],
)
def test_what_nothing_is_known_of_is_refused(content, message, room, capsys):
    """In one line, with what would be shown, or what it is."""
    Path("thing").write_bytes(content)
    said = call(capsys, "show", "thing", "--out", "shown.png")
    assert said.status == 1 and message in said.err and said.err.count("\n") == 1
    assert not Path("shown.png").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["none.csv", "--out", "a.png"], "must be a file that is there, got none.csv"),
        (["task.json", "--out", "a.jpg"], "--out must be named .png (a picture), got a.jpg"),
        (["lab.yaml", "--out", "task.png", "--map", "task.json"], "which is a task"),
    ],
)
def test_bad_input_is_one_line(words, message, room, capsys):
    """With the value and the rule."""
    said = call(capsys, "show", *words)
    assert said.status == 1 and message in said.err and said.err.count("\n") == 1


def test_a_map_has_a_picture_and_its_next_command_works(room, capsys):
    """The last line shows the log on the map; the line before says how to go on with a walk."""
    said = call(capsys, "map", DATA / "empty_lab.log.gz", "new.yaml")
    assert said.status == 0 and said.last.startswith("wrote new.yaml, new.pgm, new.png; next: ")
    assert "dollop learn WALK.log --map new.yaml --out task_2.json" in said.out
    assert call(capsys, *said.next).status == 0 and Path("new_log.png").exists()


def test_observe_goes_on_with_its_own_options(room, capsys):
    """The next command learns from the same log, with the same user, and works when pasted."""
    said = call(capsys, "observe", DATA / "slalom_0.log.gz", "lab.yaml", "--user", "0", "--min-area", "0.02")
    assert "--user=0" in said.next and said.next[-4:] == ["--min-area", "0.02", "--out", "task_2.json"]
    assert call(capsys, *said.next).status == 0


def test_time_stamps_are_those_of_the_log(room, capsys):
    """Unix time to the microsecond and beyond: to the last digit in every table."""
    log = dollop.read_log(DATA / "slalom_0.log.gz")
    stamps = 1.7e9 + log.t + 0.000123
    late = dollop.LaserLog(stamps, log.ranges, log.angles, log.poses, log.max_range)
    dollop.write_log("late.log.gz", late)
    read = dollop.read_log("late.log.gz").t
    call(capsys, "observe", "late.log.gz", "lab.yaml", "--out", "user.csv", "--tracks", "all.csv")
    for name in ("user.csv", "all.csv"):
        t = [float(line.split(",")[0]) for line in Path(name).read_text().splitlines()[1:]]
        assert np.isin(t, read).all() and len(t) > 100, name
    shown = call(capsys, "show", "late.log.gz", "--out", "late.png").out
    assert repr(float(read[0])) in shown


# ---- in a notebook


def test_a_task_is_a_picture_in_a_notebook(room):
    """A PNG, made without pyplot's state; the text says what it is, where it waits and what is in doubt."""
    task = dollop.Task.load("task.json")
    before = plt.get_fignums()
    assert task._repr_png_()[:4] == b"\x89PNG" and plt.get_fignums() == before
    assert repr(task).startswith("Task of 6 subgoals, shown 1 x") and "doubt" not in repr(task)
