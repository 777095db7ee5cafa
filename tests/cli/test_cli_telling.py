"""What commands say at their end, and to whom."""

import io
import json
import os
import struct
import sys
import time

import numpy as np
import pytest

from dollop.checks import Note
from dollop.cli import telling

DOUBT, KNOWN = Note("map", "it does not fit"), Note("in part", "it may be larger", doubt=False)


def test_notes_go_to_one_stream_and_results_to_the_other(capsys):
    """What is only good to know leaves the status 0; the last line names files and the next command."""
    telling.tell(telling.Result(("a line",), ("a.json", "a.png"), "dollop show a.json", (KNOWN,)))
    told = capsys.readouterr()
    assert told.err == "note: in part: it may be larger\n"
    assert told.out == "a line\nwrote a.json, a.png; next: dollop show a.json\n"


@pytest.mark.parametrize(("notes", "failed"), [((DOUBT, KNOWN), ""), ((), "no way")])
def test_doubt_and_failure_are_status_3(notes, failed, capsys):
    """And a doubt is named in the last line, the only one that somebody may read."""
    with pytest.raises(SystemExit) as end:
        telling.tell(telling.Result((), ("a.json",), "", notes, {}, failed))
    assert end.value.code == 3
    assert capsys.readouterr().out == f"wrote a.json{', in doubt (map)' if notes else ''}\n"


def test_json_has_no_numbers_that_are_none(capsys):
    """Arrays are lists, NaN and infinity null: any program can read it."""
    data = {"places": np.array([[1.0, np.nan]]), "count": np.int64(3), "clearance": float("inf"), "sure": np.True_}
    telling.tell(telling.Result((), (), "", (KNOWN,), data), as_json=True)
    told = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert (told["places"], told["count"], told["clearance"], told["sure"]) == ([[1.0, None]], 3, None, True)
    assert told["notes"] == [{"kind": "in part", "text": "it may be larger", "doubt": False}] and told["trusted"]


@pytest.mark.skipif(os.name != "posix", reason="terminals as POSIX has them")
def test_only_a_terminal_is_told_of_what_takes_long(monkeypatch):
    """What takes longer than the patience is named on a terminal; a pipe is left alone."""
    import fcntl
    import pty
    import termios

    monkeypatch.setattr(telling, "PATIENCE", 0.05)
    monkeypatch.setenv("TERM", "xterm")
    reading, writing = pty.openpty()
    fcntl.ioctl(writing, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    with os.fdopen(writing, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with telling.busy("thinking hard"):
            time.sleep(0.6)
        told = os.read(reading, 4096).decode()
    os.close(reading)
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stderr", pipe)
    with telling.busy("thinking hard"):
        time.sleep(0.2)
    assert "thinking hard: 00:00" in told and pipe.getvalue() == ""
