"""dollop perform: the run is that of the library, for the robot that was asked for; the table is read back."""

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from called import call
from PIL import Image
from places import DATA

import dollop
from dollop.robot.tables import load_run

PERFORM = "perform", "task.json", "--map", "lab.yaml", "--out", "run.csv"


def by_library(**options):
    """The run of the library's own robot."""
    task, background = dollop.Task.load("task.json"), dollop.OccupancyGrid.load("lab.yaml")
    row = pd.read_csv("run.csv").iloc[0]
    robot = dollop.Unicycle((*task.law.start, row.theta), **options)
    return dollop.perform(task, robot, background=background)


def test_the_run_is_the_librarys(room, capsys):
    """To a millionth, from the task's start; finished, and the last line exports the task."""
    said = call(capsys, *PERFORM)
    run, table = by_library(), pd.read_csv("run.csv")
    assert said.status == 0 and said.out.startswith(f"finished after {run.t[-1]:.1f} s; touched nothing")
    np.testing.assert_allclose(table[["t", "x", "y", "theta"]], np.column_stack([run.t, run.poses]), atol=1e-5)
    np.testing.assert_allclose(table.clearance, run.clearance, atol=1e-5)
    assert table.event.iloc[-1].endswith("finished")
    assert said.last.startswith("wrote run.csv, run.png; next: ")
    assert said.next == ["export", "task.json", "--to", "nav2", "--out", "task.geojson"]
    with Image.open("run.png") as picture:
        assert picture.format == "PNG"


def test_a_larger_robot_has_less_room(room, capsys):
    """Clearance, limits and period are those of the robot that was asked for."""
    assert call(capsys, *PERFORM, "--radius", "0.4", "--limits", "0.3,0.5,0.4,1", "--period", "0.2").status == 0
    limits = dollop.robot.Limits(0.3, 0.5, 0.4, 1.0)
    wide, table = by_library(radius=0.4, limits=limits, period=0.2), pd.read_csv("run.csv")
    np.testing.assert_allclose(table.clearance, wide.clearance, atol=1e-5)
    assert table.t[1] == 0.2 and "radius 0.4 m" in table.event[0]


def test_the_papers_control_drives_otherwise(room, capsys):
    """--control plain: another way, the same task."""
    call(capsys, *PERFORM)
    own = pd.read_csv("run.csv")
    assert call(capsys, *PERFORM, "--control", "plain").status == 0
    plain = pd.read_csv("run.csv")
    rows = min(len(own), len(plain))
    assert np.abs(own[["x", "y"]][:rows] - plain[["x", "y"]][:rows]).to_numpy().max() > 0.02


def test_kidnappings_are_drawn_from_the_seed(room, capsys):
    """So many, each to a place with room; the same seed the same bytes, another one others."""
    call(capsys, *PERFORM, "--kidnap", "3", "--seed", "5")
    first, table = Path("run.csv").read_bytes(), pd.read_csv("run.csv")
    kidnapped = table[table.event.fillna("").str.contains("kidnapped")]
    assert len(kidnapped) == 3 and (kidnapped.clearance > 0.05).all()
    call(capsys, *PERFORM, "--kidnap", "3", "--seed", "5")
    assert Path("run.csv").read_bytes() == first
    call(capsys, *PERFORM, "--kidnap", "3", "--seed", "6")
    assert Path("run.csv").read_bytes() != first


def test_a_run_that_is_not_finished_says_so_everywhere(room, capsys):
    """Status 3; the reason is said, and stands in the last row, also for programs."""
    said = call(capsys, *PERFORM, "--timeout", "2")
    assert said.status == 3 and said.out.startswith("not finished within 2 s; ")
    assert pd.read_csv("run.csv").event.iloc[-1] == "not finished within 2 s"
    assert said.next[0] == "perform" and "--timeout=4" in said.next
    told = json.loads(call(capsys, *PERFORM, "--timeout", "2", "--json").out)
    assert told["finished"] is False and told["reason"] == "not finished within 2 s" and told["radius"] == 0.25


def test_a_robot_that_is_too_large_is_offered_a_radius_that_fits(room, capsys):
    """The next command has a smaller one, and all else that was said, and comes to its end."""
    said = call(capsys, *PERFORM, "--radius", "1.5", "--period", "0.05")
    assert said.status == 3 and said.out.startswith("not finished after 0.0 s: there is no ")
    assert "--period=0.05" in said.next and any(each.startswith("--radius=") for each in said.next)
    assert said.next[-1] == "run_2.csv" and call(capsys, *said.next).out.startswith("finished after")


def test_many_kidnappings_are_each_in_a_period_of_its_own(room, capsys):
    """As many as were asked for are in the run, and shown, however many those are."""
    assert call(capsys, *PERFORM, "--kidnap", "100", "--timeout", "60").out
    assert pd.read_csv("run.csv").event.fillna("").str.contains("kidnapped").sum() == 100
    assert "kidnapped 100 x" in call(capsys, "show", "run.csv", "--out", "shown.png").out


def test_a_place_that_the_map_has_not_seen_is_refused_with_what_helps(room, capsys):
    """The map must have seen start and subgoals; the line says how to look at it, and that works."""
    grid = dollop.OccupancyGrid.load("lab.yaml")
    x, y = dollop.Task.load("task.json").law.start
    row, column = ((np.array([y, x]) - grid.origin[::-1]) / grid.resolution).astype(int)
    cells = grid.occupancy.copy()
    cells[row - 3 : row + 4, column - 3 : column + 4] = np.nan
    replace(grid, occupancy=cells).save("unseen.yaml")
    said = call(capsys, *PERFORM, "--map", "unseen.yaml")
    assert said.status == 1 and "must be free, got" in said.err and "a map that has seen the floor" in said.err
    look = shlex.split(said.err.split("a look at it: ")[1])
    assert call(capsys, *look[look.index("show") :]).status == 0


def test_a_task_in_doubt_stays_in_doubt(room, capsys):
    """Whoever performs it hears what is the matter with it, and that the result is in doubt."""
    content = json.loads(Path("task.json").read_text())
    content["notes"] = [["people", "2 people walk about as fast", True]]
    Path("task.json").write_text(json.dumps(content))
    said = call(capsys, *PERFORM)
    assert said.status == 3 and said.err == "doubt: people: 2 people walk about as fast\n"
    assert "in doubt (people)" in said.last


def test_a_film_is_the_same_each_time(room, capsys):
    """A GIF of many frames that ends where the run does; the same bytes twice."""
    said = call(capsys, *PERFORM, "--film", "run.gif")
    once = Path("run.gif").read_bytes()
    assert said.last.startswith("wrote run.csv, run.png, run.gif; next: ")
    call(capsys, *PERFORM, "--film", "run.gif")
    assert Path("run.gif").read_bytes() == once
    with Image.open("run.gif") as film:
        assert film.format == "GIF" and 50 < film.n_frames <= 150


def test_a_run_is_read_back(room, capsys):
    """Poses, way, segments, kidnappings and how it ended, to a millionth."""
    call(capsys, *PERFORM, "--kidnap", "1")
    run, table = load_run("run.csv"), pd.read_csv("run.csv")
    np.testing.assert_array_equal(run.poses, table[["x", "y", "theta"]])
    np.testing.assert_array_equal(run.active, table.segment)
    assert run.finished and run.collisions == 0 and len(run.kidnapped) == 1 and run.radius == 0.25
    assert run.kidnapped[0] in run.t


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[:1], "run.csv, line 2: a run must have a period, got none"),
        (lambda lines: [*lines[:3], "1,2,3", *lines[4:]], "run.csv, line 4: a row must have 12 columns, got 3"),
        (lambda lines: [*lines[:3], lines[3].replace("0.2,", "1_0,", 1), *lines[4:]], "line 4: t must be a number"),
        (lambda lines: lines[:-1], "the last row must say that the run is finished, or why not"),
    ],
)
def test_a_damaged_run_is_refused_with_the_line(change, message, room, capsys):
    """By show, in one line."""
    call(capsys, *PERFORM)
    lines = Path("run.csv").read_text().splitlines()
    Path("run.csv").write_text("\n".join(change(lines)) + "\n")
    said = call(capsys, "show", "run.csv", "--out", "shown.png")
    assert said.status == 1 and message in said.err and said.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--radius", "30"], "radius"),
        (["--radius", "nan"], "got nan"),
        (["--radius", "-1"], "--radius must be in 0.001 to 100, got -1"),
        (["--kidnap", "-1"], "--kidnap must be a whole number, 0 to 1000, got -1"),
        (["--limits", "0,1,1,1"], "speed must be in 1e-06 to 1e+06, got 0.0"),
        (["--limits", "1,1"], "--limits must be four numbers V,W,A,B, got 1,1"),
        (["--kidnap", "1000"], "--kidnap must be at most"),
        (["--period", "0"], "period must be in 0.001 to 10, got 0.0"),
        (["--out", "run.txt"], "--out must be named .csv (a run"),
        (["--film", "run.mp4"], "--film must be named .gif (a film), got run.mp4"),
        (["--map", "task.json"], "MAP must be a CARMEN map or a ROS map"),
        (["--map", "none.yaml"], "MAP must be a file that is there, got none.yaml"),
        (["--out", "user.csv"], "user.csv cannot be written: it holds a trajectory and not a run"),
    ],
)
def test_bad_input_is_one_line(words, message, room, capsys):
    """With the value and the rule, exit status 1, and nothing is written."""
    Path("user.csv").write_text("t,x,y,occluded\n0,0,0,False\n")
    before = {path: path.read_bytes() for path in room.iterdir()}
    said = call(capsys, *PERFORM, *words)
    assert said.status == 1 and message in said.err and said.out == ""
    assert said.err.startswith("dollop: ") and said.err.count("\n") == 1
    assert {path: path.read_bytes() for path in room.iterdir()} == before


def test_an_object_on_top_of_the_way_is_refused_or_told(room, capsys):
    """A subgoal in an obstacle: refused with the place, or a run that says why it did not finish."""
    task = dollop.Task.load("task.json")
    x, y = task.law.subgoals[2]
    moved = dollop.Environment([*task.environment.boxes[:1], [x - 0.5, y - 0.5, x + 0.5, y + 0.5]])
    method = dollop.learn([dollop.Demonstration(task.law.response(), moved)])
    method.save("task.json")
    said = call(capsys, *PERFORM)
    assert said.status in (1, 3) and ("must be free" in said.err or "not finished" in said.out or "doubt" in said.err)


def test_task_and_map_swapped(room, capsys):
    """One line says so."""
    said = call(capsys, "perform", "lab.yaml", "--map", "task.json", "--out", "run.csv")
    assert said.status == 1 and "are MAP and TASK swapped?" in said.err


def test_a_task_of_moved_objects_is_performed_as_it_is(room, capsys):
    """The environment of the task counts, wherever the map was made."""
    call(capsys, "adapt", "task.json", DATA / "moved_cans_1.log.gz", "--map", "lab.yaml", "--out", "task.json")
    said = call(capsys, *PERFORM)
    assert said.status == 0 and "touched nothing" in said.out


@pytest.mark.parametrize(("to", "suffix"), [("nav2", ".geojson"), ("waypoints", ".yaml"), ("csv", ".csv")])
def test_a_task_is_exported_and_shown(to, suffix, room, capsys):
    """Within a centimetre of the law; the last line shows what was written, which is its way."""
    pytest.importorskip("dollop.route")
    said = call(capsys, "export", "task.json", "--to", to, "--out", f"route{suffix}")
    assert said.status == 0 and "mm from the way of the law" in said.out
    told = json.loads(call(capsys, "export", "task.json", "--to", to, "--out", f"route{suffix}", "--json").out)
    assert told["deviation"] <= 0.01 and told["written"] == [f"route{suffix}"]
    shown = call(capsys, *said.next)
    assert shown.status == 0 and "ways of 17.1 m" in shown.out


def test_an_unknown_target_lists_the_known_ones(room, capsys):
    """In one line; and a file that is named otherwise is refused too."""
    pytest.importorskip("dollop.route")
    said = call(capsys, "export", "task.json", "--to", "moveit", "--out", "route.json")
    assert said.status == 1 and all(each in said.err for each in ("nav2", "waypoints", "csv", "moveit"))
    said = call(capsys, "export", "task.json", "--to", "nav2", "--out", "route.txt")
    assert said.status == 1 and ".geojson" in said.err and not Path("route.txt").exists()


@pytest.mark.parametrize(
    ("suffix", "change"),
    [
        (".geojson", ('"metadata"', '"data"')),
        (".geojson", ('"Point", "coordinates": [', '"Point", "coordinates": ["x", ')),
        (".yaml", ("wait:", "weight:")),
        (".yaml", ("waypoints:", "waypoints: &all")),
        (".csv", ("wait", "weight")),
        (".csv", (".", "x")),
    ],
)
def test_a_damaged_route_is_refused_in_one_line(suffix, change, room, capsys):
    """What is no route as it is written here says what is the matter; no picture is written."""
    to = {".geojson": "nav2", ".yaml": "waypoints", ".csv": "csv"}[suffix]
    call(capsys, "export", "task.json", "--to", to, "--out", f"route{suffix}")
    head, *rest = Path(f"route{suffix}").read_text().split("\n", 1)
    Path(f"route{suffix}").write_text("\n".join([head, *(each.replace(*change) for each in rest)]))
    said = call(capsys, "show", f"route{suffix}", "--out", "shown.png")
    assert said.status == 1 and said.err.startswith(f"dollop: route{suffix}") and said.err.count("\n") == 1
    assert not Path("shown.png").exists()
