"""The command line: what it writes, and what it says of bad input."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from places import DATA

import dollop
from dollop.cli import LEG_HEIGHT, main


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
        (["observe", "nowhere.log", "room.yaml", "--out", "./room.csv"], "must have another name than the map"),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--topic", "/scan"], "no topics, got topic='/scan'"),
        (["observe", str(DATA / "empty_lab.log.gz"), "a.map", "--topic", "/scan"], "no topics, got topic='/scan'"),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--fov", "180"], "state their field of view, got fov=3.14"),
        (["observe", str(DATA / "empty_lab.log.gz"), "a.map", "--fov", "360"], "state their field of view, got fov="),
        (["map", str(DATA / "empty_lab.log.gz"), "a.map", "--resolution", "nan"], "resolution must be positive"),
        (["observe", str(DATA / "moved_cans_0.log.gz"), str(DATA / "lab.yaml"), "--stride", "-1"], "got -1.0"),
        (["observe", str(DATA / "moved_cans_0.log.gz"), str(DATA / "lab.yaml"), "--min-area", "nan"], "got nan"),
        (["observe", str(DATA / "moved_cans_0.log.gz"), str(DATA / "lab.yaml")], "try --min-area 0.0025 --stride 0.6"),
    ],
)
def test_bad_input_ends_with_one_line(arguments, message, tmp_path, monkeypatch):
    """The message names file, value or option before the work begins; no traceback is shown, nothing is written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert message in str(end.value) and str(end.value).startswith("dollop: ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="DOLLOP_EXTERNAL_DATA is not set")
def test_walkers_seen_at_leg_height(tmp_path):
    """What the message says to try at leg height finds the walker whom the defaults miss."""
    pytest.importorskip("rosbags")
    bag = str(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "people/demo_stationary_simple_environment.bag")
    room, out = str(tmp_path / "room.yaml"), tmp_path / "walker.csv"
    main(["map", bag, room, "--topic", "/scan"])
    with pytest.raises(SystemExit, match="nobody moves.*at leg height"):
        main(["observe", bag, room, "--out", str(out)])
    main(["observe", bag, room, "--out", str(out), *re.search("--min-area.*", LEG_HEIGHT)[0].split()])
    assert pd.read_csv(out).t.iloc[-1] > 100


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
    assert told == "dollop: no command 'obsevre'; known: map, observe, data, study\n"


def test_an_interrupt_ends_with_one_line(monkeypatch, capsys):
    """Ctrl-C while a command works: exit status 130, and no traceback."""

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(dollop, "read_log", interrupted)
    with pytest.raises(SystemExit) as end:
        main(["observe", "a.log", "b.map", "--out", "c.csv"])
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
