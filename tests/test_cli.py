"""The command line: what it writes, and what it says of bad input."""

import os
import re
from pathlib import Path

import pandas as pd
import pytest
from places import DATA

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
