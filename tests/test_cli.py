"""The command line: what it writes, and what it says of bad input."""

from pathlib import Path

import pandas as pd
import pytest

from dollop.cli import main

DATA = Path(__file__).parents[1] / "data"


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
        (["map", str(DATA / "empty_lab.log.gz"), "room.docx"], "room.docx"),
    ],
)
def test_bad_input_ends_with_one_line(arguments, message, tmp_path, monkeypatch):
    """The message names the file, and no traceback is shown."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert message in str(end.value) and str(end.value).startswith("dollop: ")
    assert list(tmp_path.iterdir()) == []
