"""Commands as tests call them: in this process, with what they say and how they end."""

import shlex
from typing import NamedTuple

from dollop.cli import main


class Said(NamedTuple):
    """What a command said, on both streams, and its exit status."""

    out: str
    err: str
    status: int

    @property
    def last(self):
        """The last line on stdout."""
        return self.out.splitlines()[-1]

    @property
    def next(self):
        """The words of the command that the last line names, without the program."""
        program, *words = shlex.split(self.last.split("; next: ")[1])
        return words[2:] if program == "python" else words


def call(capsys, *words):
    """Run a command: what it says of what it refuses is on stderr."""
    capsys.readouterr()
    status, message = 0, ""
    try:
        main(list(map(str, words)))
    except SystemExit as end:
        status, message = (end.code, "") if isinstance(end.code, int) else (1, f"{end.code}\n")
    told = capsys.readouterr()
    return Said(told.out, told.err + message, status)
