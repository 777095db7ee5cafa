"""dollop learn and adapt: what they write is what the library finds, and nothing is destroyed."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from called import call
from PIL import Image
from places import DATA

import dollop
from dollop.cli.adapting import how_to_say

LAB, EIGHTS = DATA / "lab.yaml", DATA / "figure_eights.log.gz"
SLALOMS = DATA / "slalom_0.log.gz", DATA / "slalom_1.log.gz"
STRANGERS = Path(os.environ.get("DOLLOP_EXTERNAL_DATA", "")) / "strangers"


def observed(path):
    """What the library finds in a log."""
    return dollop.observe(dollop.read_log(path), dollop.OccupancyGrid.load(LAB))


def test_what_is_learned_is_what_the_library_learns(room):
    """The same law, from the same observation; the picture beside it is one."""
    task = dollop.learn([dollop.Demonstration.of(observed(EIGHTS))])
    saved = dollop.Task.load("task.json")
    np.testing.assert_allclose(saved.law.subgoals, task.law.subgoals, atol=1e-9)
    assert saved.notes == task.notes and len(saved.demonstrations[0].walks) == 5
    with Image.open("task.png") as picture:
        assert picture.format == "PNG" and min(picture.size) > 400


def test_several_logs_are_several_demonstrations(room, capsys):
    """Each is a line of what is said, with its walk and how far the task is from it."""
    said = call(capsys, "learn", *SLALOMS, "--map", "lab.yaml", "--out", "slalom.json")
    assert said.status == 0 and [str(each) in line for each, line in zip(SLALOMS, said.out.splitlines(), strict=False)]
    assert "9.8 m walked" in said.out and "among 4 objects" in said.out
    assert len(dollop.Task.load("slalom.json").demonstrations) == 2


def test_json_is_one_object_and_nothing_else(room, capsys):
    """For programs: subgoals, errors, notes, what was written and what is next."""
    said = call(capsys, "learn", *SLALOMS, "--map", "lab.yaml", "--out", "slalom.json", "--json")
    told = json.loads(said.out)
    task = dollop.Task.load("slalom.json")
    np.testing.assert_allclose(told["subgoals"], task.law.subgoals)
    np.testing.assert_allclose(told["errors"], task.errors(), atol=1e-6)
    assert told["written"] == ["slalom.json", "slalom.png"] and told["trusted"] is True and told["notes"] == []
    assert told["next"].endswith("dollop perform slalom.json --map lab.yaml --out slalom_run.csv")


def test_the_users_of_several_logs_are_named_once_or_each(room, capsys):
    """Two users for one log are refused with both counts."""
    words = ["learn", EIGHTS, "--map", "lab.yaml", "--out", "a.json", "--user", "0", "--user", "1"]
    said = call(capsys, *words)
    assert said.status == 1 and "--user must be given once, or once for each of 1 logs, got 2" in said.err


def test_adapt_follows_the_objects(room, capsys):
    """The task among moved cans is that of the library's adapt, and says how far they went."""
    said = call(capsys, "adapt", "task.json", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "now.json")
    found = observed(DATA / "moved_cans_0.log.gz").environment
    task = dollop.Task.load("task.json").adapt(found)
    np.testing.assert_allclose(dollop.Task.load("now.json").law.subgoals, task.law.subgoals, atol=1e-6)
    assert said.status == 0 and "2 of 2 objects found again, by up to 0.71 m" in said.out
    assert said.next[:2] == ["perform", "now.json"]


def test_a_task_is_adapted_in_place(room, capsys):
    """--out may be the task itself: it holds the adapted one afterwards."""
    before = dollop.Task.load("task.json").law.subgoals
    words = ["adapt", "task.json", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "task.json"]
    assert call(capsys, *words).status == 0
    after = dollop.Task.load("task.json").law.subgoals
    assert before.shape != after.shape or np.abs(before - after).max() > 0.3


@pytest.mark.parametrize("fails", ["write_picture", "saving"])
def test_what_fails_leaves_the_task_as_it_was(fails, room, capsys, monkeypatch):
    """A disk that is full while the picture or the task is written: both are as before."""
    before = Path("task.json").read_bytes(), Path("task.png").read_bytes()

    def full(*_, **__):
        raise OSError("no space left")

    what = "dollop.cli.picturing.write_picture" if fails == "write_picture" else "dollop.Task.save"
    monkeypatch.setattr(what, full)
    words = ["adapt", "task.json", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "task.json"]
    said = call(capsys, *words)
    assert said.status == 1 and "no space left" in said.err
    assert (Path("task.json").read_bytes(), Path("task.png").read_bytes()) == before
    assert sorted(path.name for path in room.iterdir()) == ["lab.pgm", "lab.yaml", "task.json", "task.png"]


def test_a_task_of_version_1_is_adapted_and_performed(room, capsys):
    """What an older Dollop saved goes the whole way."""
    observation = observed(EIGHTS)
    task = dollop.learn([dollop.Demonstration.of(observation)], method="paper")
    task.save("new.json")
    content = json.loads(Path("new.json").read_text())
    boxes = content["environment"]["boxes"]
    names = "walks", "sample_period", "tolerance"
    shown = [{name: each[name] for name in names} | {"boxes": boxes} for each in content["demonstrations"]]
    kept = {name: content[name] for name in ("format", "start", "speeds", "segments", "association")}
    Path("old.json").write_text(json.dumps(kept | {"version": 1, "boxes": boxes, "demonstrations": shown}))
    look = DATA / "moved_cans_0.log.gz"
    assert call(capsys, "adapt", "old.json", look, "--map", "lab.yaml", "--out", "now.json").status == 0
    said = call(capsys, "perform", "now.json", "--map", "lab.yaml", "--out", "run.csv")
    assert said.status == 0 and said.out.startswith("finished after")


def test_who_passes_by_puts_no_adaptation_in_doubt(room, capsys, monkeypatch):
    """Notes on a user are none on where the objects stand; others are passed on, and saved."""
    found = observed(DATA / "moved_cans_0.log.gz")
    notes = dollop.Note("people", "2 people walk about as fast"), dollop.Note("map", "it does not fit")
    look = ["adapt", "task.json", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "now.json"]
    monkeypatch.setattr(dollop, "observe", lambda *_, **__: replace(found, notes=notes[:1]))
    assert call(capsys, *look).status == 0
    monkeypatch.setattr(dollop, "observe", lambda *_, **__: replace(found, notes=notes))
    said = call(capsys, *look)
    assert said.status == 3 and "doubt: map: it does not fit" in said.err and ", in doubt (map); next" in said.last
    assert dollop.Task.load("now.json").notes == notes[1:]


def test_where_nothing_is_found_no_matching_is_advised(room, capsys, monkeypatch):
    """A look without objects says so; one with others advises nothing that would be refused."""
    words = ["adapt", "task.json", DATA / "empty_lab.log.gz", "--map", "lab.yaml", "--out", "now.json"]
    said = call(capsys, *words)
    assert said.status == 1 and "none of the task's objects was found: then 0 at" in said.err
    assert "--matching" not in said.err
    none = dollop.Matching.of_partners([-1, -1])
    monkeypatch.setattr(dollop, "match", lambda *_, **__: none)
    task, seen = dollop.Task.load("task.json"), observed(LOOK[2]).environment
    told = how_to_say(task, seen, False, "why")
    assert told.startswith("none of the task's objects was found again; say where") and "=-1" not in told


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="DOLLOP_EXTERNAL_DATA is not set")
def test_what_cannot_be_matched_is_asked_for(room, capsys):
    """Two boxes that may have changed places: one line says how to say it, and with that it works."""
    assert call(capsys, "map", STRANGERS / "empty.log.gz", "stranger.yaml").status == 0
    walk, look = STRANGERS / "slalom_disc_0.log.gz", STRANGERS / "moved.log.gz"
    call(capsys, "learn", walk, "--map", "stranger.yaml", "--out", "walk.json")
    words = ["adapt", "walk.json", look, "--map", "stranger.yaml", "--out", "now.json"]
    said = call(capsys, *words)
    assert said.status == 1 and said.err.count("dollop: ") == 1 and "--matching=1,0" in said.err
    assert not Path("now.json").exists()
    assert call(capsys, *words, "--matching=1,0").status == 0
    said = call(capsys, "perform", "now.json", "--map", "stranger.yaml", "--out", "run.csv")
    assert said.status == 0 and said.out.startswith("finished")


LOOK = ["adapt", "task.json", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "now.json"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["learn", LAB, "--map", EIGHTS, "--out", "a.json"], "which is a CARMEN log: are MAP and LOG swapped?"),
        (
            ["learn", "none.log", "--map", "lab.yaml", "--out", "a.json"],
            "LOG must be a file that is there, got none.log",
        ),
        (["learn", EIGHTS, "--map", "none.yaml", "--out", "a.json"], "MAP must be a file that is there, got none.yaml"),
        (["learn", EIGHTS, "--map", "lab.yaml", "--out", "a.txt"], "--out must be named .json (a task; its picture"),
        (["learn", EIGHTS, "--map", "lab.yaml", "--out", "no/a.json"], "no/a.json cannot be written: No such file"),
        (["learn", DATA / "moved_cans_0.log.gz", "--map", "lab.yaml", "--out", "a.json"], "nobody walks in"),
        (["learn", "task.json", "--map", "lab.yaml", "--out", "a.json"], "got task.json, which is a task"),
        (["learn", EIGHTS, "--map", "lab.yaml", "--out", "lab.json", "--fov", "360"], "state their field of view"),
        (["adapt", EIGHTS, "task.json", "--map", "lab.yaml", "--out", "a.json"], "are TASK and LOG swapped?"),
        (["adapt", "no.json", EIGHTS, "--map", "lab.yaml", "--out", "a.json"], "TASK must be a file that is there"),
        ([*LOOK, "--matching", "0"], "--matching must have a number for each of the task's 2 objects, got 1"),
        ([*LOOK, "--matching", "1,1"], "--matching must name no object twice, got 1,1"),
        ([*LOOK, "--matching", "0,7"], "--matching must be of the 2 objects seen now, 0 to 1, got 7"),
        ([*LOOK[:-1], "lab.yaml"], "--out must be named .json"),
    ],
)
def test_bad_input_is_one_line(words, message, room, capsys):
    """With the value and the rule, exit status 1, and nothing is written."""
    before = {path: path.read_bytes() for path in room.iterdir()}
    said = call(capsys, *words)
    assert said.status == 1 and message in said.err and said.out == ""
    assert said.err.startswith("dollop: ") and said.err.count("\n") == 1
    assert {path: path.read_bytes() for path in room.iterdir()} == before


@pytest.mark.parametrize("option", [["--method", "mine"], ["--user", "bob"], ["--min-area", "1_0"]])
def test_no_usage_is_status_2(option, room, capsys):
    """An unknown method, no user, no number as others write it."""
    said = call(capsys, "learn", EIGHTS, "--map", "lab.yaml", "--out", "a.json", *option)
    assert said.status == 2 and option[0] in said.err


def test_a_walk_that_cannot_be_kept_to_two_centimetres_is_kept_to_ten(room, capsys):
    """--tolerance is that of the demonstrations: a looser law has fewer segments."""
    said = call(capsys, "learn", EIGHTS, "--map", "lab.yaml", "--tolerance", "0.1", "--out", "loose.json")
    loose, exact = (dollop.Task.load(name) for name in ("loose.json", "task.json"))
    assert said.status == 0 and len(loose.law.segments) < len(exact.law.segments)
    assert loose.demonstrations[0].tolerance == 0.1
