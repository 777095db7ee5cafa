"""What commands say at their end, and to whom."""

import io
import json
import os
import struct
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

from dollop.checks import Note
from dollop.cli import in_one_line, telling

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


def test_warnings_are_notes_of_one_line_each_once(capsys):
    """Neither the file of the library nor a line of its source is told."""

    def work():
        for _ in range(2):
            for k in range(2):
                warnings.warn(f"a scan\nis broken, {k}", stacklevel=1)

    with warnings.catch_warnings():
        warnings.simplefilter("always")
        in_one_line("dollop", work)
    assert capsys.readouterr().err == "note: a scan is broken, 0\nnote: a scan is broken, 1\n"


@pytest.mark.skipif(os.name != "posix", reason="streams as POSIX has them")
@pytest.mark.parametrize(("stream", "status"), [(">&-", 1), ("2>&-", 0), (">/dev/full", 1)])
def test_a_stream_that_is_closed_or_full_ends_cleanly(stream, status, room):
    """The work is done all the same; the status says that what it says could not be written, in a line."""
    words = f"'{sys.executable}' -m dollop show task.json --out shown.png {stream}"
    done = subprocess.run(words, shell=True, capture_output=True, text=True, timeout=60)
    assert done.returncode == status and (room / "shown.png").exists()
    assert done.stderr.startswith("dollop: ") == bool(status) and done.stderr.count("\n") == bool(status)
