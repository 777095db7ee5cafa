"""What a command says at its end, to people or to programs."""

import json
import os
import shlex
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dollop.checks import trusted

__all__ = ["IN_DOUBT", "Result", "busy", "command", "tell", "tell_notes"]

IN_DOUBT = 3
"""Exit status of a command that is done, with notes that put its result in doubt."""
PATIENCE = 1.0
"""s after which a terminal is told what is being done."""


@dataclass(frozen=True)
class Result:
    """What came of a command.

    Attributes
    ----------
    lines : sequence of str
        For people, before the last line.
    written : sequence of str or Path
        Files, the main one first.
    next : str
        A command that goes on from here, as a shell takes it; empty for none.
    notes : tuple of Note
    data : dict
        For programs: names to plain values.
    failed : str
        Why what was written is not what was wanted; empty if it is.
    """

    lines: tuple
    written: tuple
    next: str = ""
    notes: tuple = ()
    data: dict = field(default_factory=dict)
    failed: str = ""


def tell(result, as_json=False):
    """Say what came of a command: notes on the error stream, the rest on the other.

    Parameters
    ----------
    result : Result
    as_json : bool
        As one JSON object, for programs.

    Raises
    ------
    SystemExit
        With 3 where a note puts the result in doubt, or it is not what was wanted.
    """
    sys.stdout.flush()
    tell_notes(result.notes)
    doubts = list(dict.fromkeys(note.kind for note in result.notes if note.doubt))
    if as_json:
        print(json.dumps(_plain(_content(result)), allow_nan=False))
    else:
        for line in result.lines:
            print(line)
        wrote = f"wrote {', '.join(map(str, result.written))}"
        doubt = f", in doubt ({', '.join(doubts)})" if doubts else ""
        print(f"{wrote}{doubt}{f'; next: {result.next}' if result.next else ''}")
    if doubts or result.failed:
        sys.exit(IN_DOUBT)


def _content(result):
    """What programs are told of a result."""
    notes = [{"kind": note.kind, "text": note.text, "doubt": note.doubt} for note in result.notes]
    told = {
        "written": list(map(str, result.written)),
        "next": result.next,
        "trusted": trusted(result.notes),
    }
    return {**result.data, "notes": notes, **told}


def _plain(value):
    """A value as JSON has it: what is no number, or infinite, is null."""
    if isinstance(value, dict):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return list(map(_plain, value))
    return None if isinstance(value, float) and not np.isfinite(value) else value


def tell_notes(notes, of=None):
    """Notes on the error stream, a line each: a doubt, or good to know.

    Parameters
    ----------
    notes : sequence of Note
    of : str, optional
        What they are of.
    """
    for note in notes:
        where = f"{of}: " if of else ""
        print(f"{'doubt' if note.doubt else 'note'}: {where}{note}", file=sys.stderr)


def command(*words):
    """A command of this program as a shell takes it.

    Parameters
    ----------
    *words : str or Path

    Returns
    -------
    str

    Examples
    --------
    >>> print(command("show", "my room.yaml").removeprefix("python -m "))
    dollop show 'my room.yaml'
    """
    program = ["python", "-m", "dollop"] if Path(sys.argv[0]).name == "__main__.py" else ["dollop"]
    return shlex.join([*program, *map(str, words)])


@contextmanager
def busy(what):
    """Tell a terminal what is being done, and for how long already, if it takes more than a second.

    Parameters
    ----------
    what : str

    Yields
    ------
    None
    """
    if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
        yield
        return
    from threading import Event, Thread

    from tqdm import tqdm

    done = Event()

    def tick():
        if done.wait(PATIENCE):
            return
        with tqdm(desc=what, bar_format="{desc}: {elapsed}", leave=False) as bar:
            while not done.wait(0.2):
                bar.refresh()

    thread = Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
