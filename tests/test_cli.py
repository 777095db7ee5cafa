"""The command line: what it writes, and what it says of bad input."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from places import DATA

import dollop
from dollop.cli import main

EIGHTS, LAB = str(DATA / "figure_eights.log.gz"), str(DATA / "lab.yaml")


def test_map_and_observe_write_what_they_say(tmp_path, capsys):
    """From two logs to a map, a trajectory and its picture."""
    main(["map", str(DATA / "empty_lab.log.gz"), str(tmp_path / "room.yaml")])
    main(["observe", str(DATA / "figure_eights.log.gz"), str(tmp_path / "room.yaml"), "--out", str(tmp_path / "u.csv")])
    said = capsys.readouterr().out
    assert "room.yaml" in said and "u.csv" in said and "2 static objects" in said
    user = pd.read_csv(tmp_path / "u.csv")
    assert list(user.columns) == ["t", "x", "y", "occluded"] and len(user) > 800
    assert (tmp_path / "u.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["observe", "nowhere.log", str(DATA / "lab.yaml")], "nowhere.log"),
        (["observe", str(DATA / "lab.pgm"), str(DATA / "lab.yaml")], "lab.pgm"),
        (["map", "nowhere.log", "room.docx"], "room.docx"),
        (["map", "nowhere.log", "none/room.yaml"], "none/room.yaml cannot be written: No such file"),
        (["observe", "nowhere.log", "room.yaml", "--out", "none/u.csv"], "none/u.csv cannot be written: No such file"),
        (["observe", "nowhere.log", "room.yaml", "--out", "u.png"], "--out must be named .csv"),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--topic", "/scan"], "no topics, got topic='/scan'"),
        (["observe", str(DATA / "empty_lab.log.gz"), "a.map", "--topic", "/scan"], "no topics, got topic='/scan'"),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--fov", "180"], "state their field of view, got fov=3.14"),
        (["observe", str(DATA / "empty_lab.log.gz"), "a.map", "--fov", "360"], "state their field of view, got fov="),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--resolution", "nan"], "resolution must be a finite number"),
        (["observe", str(DATA / "moved_cans_0.log.gz"), LAB, "--min-area", "nan"], "got nan"),
        (["observe", str(DATA / "moved_cans_0.log.gz"), LAB], "nobody walks in"),
        (["observe", EIGHTS, LAB, "--user", "8.5,1.5"], "when first seen: 0 at ("),
        (["observe", EIGHTS, LAB, "--user", "1"], "user must be one of 1 people, 0 to 0, got 1"),
        (["observe", EIGHTS, LAB, "--user=-1"], "user must be one of 1 people, 0 to 0, got -1"),
        (["observe", EIGHTS, LAB, "--user", "nan,2"], "user must be finite, got nan"),
        (["observe", "nowhere.log", LAB, "--tracks", "t.txt"], "--tracks must be named .csv"),
        (["observe", "nowhere.log", LAB, "--tracks", "user.csv"], "not as --out, got user.csv"),
        (["observe", "nowhere.log", LAB, "--tracks", "none/t.csv"], "none/t.csv cannot be written: No such file"),
    ],
)
def test_bad_input_ends_with_one_line(arguments, message, tmp_path, monkeypatch):
    """The message names file, value or option before the work begins; no traceback is shown, nothing is written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert message in str(end.value) and str(end.value).startswith("dollop: ")
    assert list(tmp_path.iterdir()) == []


def content(folder):
    """Every file in a folder, by its name."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.fixture
def room(tmp_path, monkeypatch):
    """A folder to work in, with a log, and a map whose picture is a PNG."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "slalom_0.log.gz", "walk.log.gz")
    with Image.open(DATA / "lab.pgm") as picture:
        picture.save("scan.png")
    Path("room.yaml").write_text((DATA / "lab.yaml").read_text().replace("lab.pgm", "scan.png"))
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["observe", "walk.log.gz", "room.yaml", "--out", "scan.csv"],
            "scan.png cannot be written: it is scan.png, which",
        ),
        (
            ["observe", "walk.log.gz", "here.yaml", "--out", "scan.csv"],
            "scan.png cannot be written: it is scan.png, which",
        ),
        (["observe", "walk.log.gz", "lab.yaml", "--out", "scan.csv"], "it is the picture of the map here.yaml"),
        (
            ["observe", "table.csv", "room.yaml", "--out", "table.csv"],
            "table.csv cannot be written: it is table.csv, which",
        ),
        (
            ["observe", "walk.log.gz", "room.yaml", "--tracks", "table.csv"],
            "holds something else and not a table of every",
        ),
        (
            ["observe", "walk.log.gz", "room.yaml", "--out", "a.csv", "--tracks", "./b/../a.csv"],
            "which is written as well",
        ),
        (["map", "walk.log.gz", "lab.yml"], "lab.pgm cannot be written: it is the picture of the map lab.yaml"),
        (["map", "walk.log.gz", "log.map"], "log.map cannot be written: it is walk.log.gz, which is read"),
        (["map", "walk.log.gz", "task.map"], "task.map cannot be written: it holds a task and not a CARMEN map"),
        (["map", "walk.log.gz", "fifo.map"], "fifo.map cannot be written: it is no ordinary file"),
    ],
)
def test_no_command_destroys_a_file(arguments, message, room):
    """What is read, what belongs to another map and what is something else stays as it is: told before the work."""
    for name in ("lab.yaml", "lab.pgm"):
        shutil.copy(DATA / name, name)
    shutil.copy("room.yaml", "here.yaml")
    Path("table.csv").write_text("mine\n")
    Path("b").mkdir()
    Path("log.map").symlink_to("walk.log.gz")
    Path("task.map").write_text('{"format": "dollop task"}')
    os.mkfifo("fifo.map")
    files = [path for path in room.iterdir() if path.is_file()]
    before = {path: path.read_bytes() for path in files}
    with pytest.raises(SystemExit, match=f"^dollop: .*{re.escape(message)}"):
        main(arguments)
    assert {path: path.read_bytes() for path in room.iterdir() if path.is_file()} == before


def test_what_a_command_wrote_it_writes_again(room):
    """The same command twice replaces its own files, with the same."""
    command = ["observe", "walk.log.gz", "room.yaml", "--out", "user.csv", "--tracks", "all.csv"]
    main(command)
    once = content(room)
    main(command)
    assert content(room) == once and {"user.csv", "user.png", "all.csv"} <= once.keys()


def test_an_interrupt_while_drawing_leaves_the_old_files(room, monkeypatch):
    """Ctrl-C before the last of the files is written: none is replaced, and nothing is left beside them."""
    main(["observe", "walk.log.gz", "room.yaml", "--tracks", "all.csv"])
    before = content(room)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("dollop.cli.observing._write_track", interrupted)
    with pytest.raises(SystemExit) as end:
        main(["observe", "walk.log.gz", "room.yaml", "--tracks", "all.csv", "--min-area", "0.02"])
    assert end.value.code == 130 and content(room) == before


@pytest.mark.skipif(os.name != "posix", reason="pipes as POSIX has them")
def test_a_closed_pipe_ends_a_command_without_a_traceback(room):
    """Nobody reads what is said: the files are there, whole, and the status says that something went wrong."""
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "dollop", "observe", "walk.log.gz", "room.yaml"]
    ended = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (1, "")
    assert len(pd.read_csv("user.csv")) > 100 and (room / "user.png").stat().st_size > 10_000


NO_USAGE = [
    ["--user", "bob"],
    ["--user", "1;2"],
    ["--user", "1_0"],
    ["--min-area", "0_1"],
    ["--fov", "1_8"],
    ["--a", "b"],
]


@pytest.mark.parametrize("arguments", NO_USAGE)
def test_what_is_no_usage_ends_with_status_2(arguments, tmp_path, monkeypatch, capsys):
    """A user that is neither word, place nor number; numbers as only Python writes them; no such option."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["observe", EIGHTS, LAB, *arguments])
    assert end.value.code == 2 and arguments[0] in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def with_somebody_else(log, places, radius=0.2):
    """The log with a disc at places (T, 2) in m: a beam ends at the nearer of two things."""
    x, y = (places - log.poses[:, :2]).T[..., None]
    bearing = log.poses[:, 2:] + log.angles
    ahead, aside = x * np.cos(bearing) + y * np.sin(bearing), y * np.cos(bearing) - x * np.sin(bearing)
    met = (np.abs(aside) < radius) & (ahead > 0)
    near_side = ahead - np.sqrt(np.maximum(radius**2 - aside**2, 0))
    return replace(log, ranges=np.where(met, np.minimum(log.ranges, near_side), log.ranges))


@pytest.fixture(scope="module")
def two_people(tmp_path_factory):
    """A log in which somebody walks round and round before the robot, as fast as the user."""
    log = dollop.read_log(EIGHTS)
    angle = 2 * np.pi * log.t / 8
    round_and_round = np.column_stack([4.5 + 1.6 * np.cos(angle), 1.8 + 0.35 * np.sin(angle)])
    path = str(tmp_path_factory.mktemp("two") / "two.log.gz")
    dollop.write_log(path, with_somebody_else(log, round_and_round))
    return path


def test_a_result_in_doubt_is_written_and_ends_with_status_3(two_people, tmp_path, monkeypatch, capsys):
    """Which of two people shows the task no speed can tell: the note says so, and who walked where."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["observe", two_people, LAB])
    told = capsys.readouterr()
    assert end.value.code == 3
    assert "doubt: people: 2 people walk about as fast" in told.err
    assert "--user X,Y" in told.err and "  0: from (" in told.err and "  1: from (" in told.err
    assert told.out.splitlines()[-1].startswith("wrote user.csv, user.png, in doubt (people); next: ")
    assert len(pd.read_csv("user.csv")) > 800


@pytest.mark.parametrize(("user", "begin"), [("4.6,3.6", (4.6, 3.65)), ("6,1.8", (6.1, 1.8))])
def test_who_is_named_is_the_user_and_nothing_is_in_doubt(user, begin, two_people, tmp_path, capsys):
    """--user with a place: the trajectory begins there, and the command ends with status 0."""
    main(["observe", two_people, LAB, "--user", user, "--out", str(tmp_path / "u.csv")])
    track = pd.read_csv(tmp_path / "u.csv")
    assert np.hypot(*(track[["x", "y"]].to_numpy()[0] - begin)) < 0.15
    assert capsys.readouterr().err == ""


def test_a_number_names_who_is_told_by_it(two_people, tmp_path):
    """--user N and the rows of person N in --tracks are one trajectory; everybody is in the table."""
    out, tracks = tmp_path / "u.csv", tmp_path / "everybody.csv"
    main(["observe", two_people, LAB, "--user", "1", "--out", str(out), "--tracks", str(tracks)])
    everybody = pd.read_csv(tracks)
    assert list(everybody.columns) == ["t", "x", "y", "occluded", "person"]
    assert sorted(set(everybody.person)) == [0, 1]
    second = everybody[everybody.person == 1].drop(columns="person").reset_index(drop=True)
    pd.testing.assert_frame_equal(second, pd.read_csv(out))


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="DOLLOP_EXTERNAL_DATA is not set")
def test_walkers_seen_at_leg_height(tmp_path):
    """Legs need no options: the walker of a real log at leg height is found, in doubt or not."""
    pytest.importorskip("rosbags")
    bag = str(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "people/demo_stationary_simple_environment.bag")
    room, out = str(tmp_path / "room.yaml"), tmp_path / "walker.csv"
    main(["map", bag, room, "--topic", "/scan"])
    try:
        main(["observe", bag, room, "--out", str(out)])
    except SystemExit as end:
        assert end.code == 3
    assert np.ptp(pd.read_csv(out).t) > 10


def test_the_version_is_told(capsys):
    """--version names the program and the version that the package has."""
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"dollop {dollop.__version__}\n"


def test_python_m_dollop_is_the_command_line():
    """python -m dollop says the same as dollop."""
    told = subprocess.run([sys.executable, "-m", "dollop", "--version"], capture_output=True, text=True, check=True)
    assert told.stdout == f"dollop {dollop.__version__}\n"


def test_an_unknown_command_lists_the_known_ones_in_one_line(capsys):
    """Exit status 2, one line, every command."""
    with pytest.raises(SystemExit) as end:
        main(["obsevre", "a.log"])
    assert end.value.code == 2
    told = capsys.readouterr().err
    known = "map, observe, learn, adapt, perform, show, export, data, study"
    assert told == f"dollop: no command 'obsevre'; known: {known}\n"


def test_an_interrupt_ends_with_one_line(monkeypatch, capsys, tmp_path):
    """Ctrl-C while a command works: exit status 130, and no traceback."""

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(dollop, "read_log", interrupted)
    with pytest.raises(SystemExit) as end:
        main(["observe", EIGHTS, "b.map", "--out", str(tmp_path / "c.csv")])
    assert end.value.code == 130
    assert capsys.readouterr().err.strip() == "dollop: stopped"


@pytest.mark.replication
@pytest.mark.parametrize("command", [["study"], ["study", "velocity", "--quick"], ["data"]])
def test_a_missing_extra_is_named_before_the_work(command, monkeypatch, tmp_path):
    """Without PyBullet the replication says at once how to install it, and writes nothing."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dollop.checks.find_spec", lambda name: None)
    with pytest.raises(SystemExit, match=r'^dollop: .*pip install "dollop\[lab\]"'):
        main(command)
    assert list(tmp_path.iterdir()) == []


def test_a_library_without_the_replication_says_so(monkeypatch):
    """What was installed without dollop.replication has no study: one line says that."""
    for name in [name for name in sys.modules if name.startswith("dollop.replication")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "dollop.replication", None)
    with pytest.raises(SystemExit, match="^dollop: the replication is not part of this installation$"):
        main(["study"])
