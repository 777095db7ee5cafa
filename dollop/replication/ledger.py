"""A table that is only added to: a line for every job that is done, with its checksum.

Several studies may add to one table at a time. What keeps them apart are locks of the system on a
file beside it, which are gone with the process that held them, however it ended; they need a system
that has them (Linux, macOS). Reading needs nothing.
"""

import csv
import io
import os
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from dollop.checks import shortened
from dollop.formats.files import FormatError
from dollop.formats.writing import whole_file

__all__ = ["NOT_DONE", "Ledger", "Shared"]

MOST_BYTES = 1 << 28
"""The most that a table may hold: sixty times the largest that a study writes."""
MOST_DAMAGED = 100
"""Lines: a run that is killed leaves one in pieces. What damages more of them is no accident of a
study, and must not end in numbers being thrown away.
"""
DIGITS = 12
"""Of a line's checksum, hexadecimal."""
NOT_DONE = "not done: "
"""How the text of a job begins that has been set aside; what follows is the reason."""
WRITING, PRESENT, SEEDS = 0, 1, 2
"""Bytes of the lock file: who writes, who takes part, and from there on a byte for each seed."""


@dataclass(frozen=True)
class Ledger:
    """What stands in a table of jobs, and where.

    A line holds the values of its columns as in any CSV file, and the first digits of the SHA-256
    of that in the last column, `check`. A line that was cut short or altered is not believed.

    Parameters
    ----------
    path : Path
    columns : tuple of str
        Without `check`.
    keys : int
        How many columns, from the first on, name a job; the last of them is the seed.
    why : str
        The column that tells of a job that has been set aside why.
    sound : callable
        Whether a line's values {column: text} are ones that a study writes.
    """

    path: Path
    columns: tuple
    keys: int
    why: str
    sound: Callable = bool

    def job(self, row):
        """The job that a line is about.

        Parameters
        ----------
        row : dict of str

        Returns
        -------
        tuple of str
        """
        return tuple(row[name] for name in self.columns[: self.keys])

    def read(self):
        """The lines that can be believed, in the order in which they were added.

        Returns
        -------
        rows : list of dict of str
            By column, without `check`; none if there is no file.
        damaged : int
            The number of lines that cannot be.

        Raises
        ------
        FormatError
            If the file is no such table, or more than 100 of its lines are damaged.
        """
        if not self.path.exists():
            return [], 0
        header, *lines = self._content().split(b"\n")
        if header.rstrip(b"\r") != self._header().encode():
            told = shortened(header.decode(errors="replace"), 60)
            rule = f"a table of this study begins with the line {shortened(self._header(), 80)}"
            raise FormatError(f"{rule}, got {told!r}; move the file away to begin anew", self.path)
        rows = [self._row(line.rstrip(b"\r")) for line in lines if line]
        good = [row for row in rows if row]
        damaged = len(rows) - len(good)
        if damaged > MOST_DAMAGED:
            told = f"{damaged} of {len(rows)} lines are not as a study wrote them, at most {MOST_DAMAGED} may be"
            raise FormatError(f"{told}; bring it back from where you keep it, or move it away", self.path)
        return good, damaged

    def latest(self, rows, answers):
        """Of each job the line that counts: the last that answers it, or else the last.

        Parameters
        ----------
        rows : list of dict of str
        answers : callable
            Whether a line, {column: text}, is what is asked for.

        Returns
        -------
        list of dict of str
            In the order of the jobs.
        """
        found = {}
        for row in rows:
            before = found.get(self.job(row))
            if before is None or answers(row) or not answers(before):
                found[self.job(row)] = row
        return sorted(found.values(), key=self._place)

    def shared(self):
        """The table to be added to, as a context: others may be adding to it as well.

        Returns
        -------
        Shared
        """
        return Shared(self)

    def _place(self, row):
        """What orders the jobs."""
        *words, seed = self.job(row)
        return *words, int(seed)

    def _content(self):
        """The file's bytes."""
        if not self.path.is_file() or self.path.stat().st_size > MOST_BYTES:
            raise FormatError(f"a table is an ordinary file of at most {MOST_BYTES} bytes", self.path)
        content = self.path.read_bytes()
        if not content:
            raise FormatError("the file is empty; remove it to begin anew", self.path)
        return content

    def _header(self):
        """The first line."""
        return ",".join([*self.columns, "check"])

    def _row(self, line):
        """The values of a line, None if it cannot be believed."""
        text, _, check = line.rpartition(b",")
        if check != _check(text):
            return None
        try:
            row = dict(zip(self.columns, next(csv.reader([text.decode()])), strict=True))
        except (ValueError, csv.Error):
            return None
        seed = self.job(row)[-1]
        return row if seed.isdecimal() and seed.isascii() and len(seed) < 11 and self.sound(row) else None

    def _line(self, row):
        """A line for a job's values."""
        stream = io.StringIO()
        csv.writer(stream, lineterminator="").writerow(" ".join(row[name].splitlines()) for name in self.columns)
        text = stream.getvalue().encode()
        return text + b"," + _check(text) + b"\n"


def _check(text):
    """The checksum of a line's bytes."""
    return sha256(text).hexdigest()[:DIGITS].encode()


class Shared:
    """A table that several studies may be adding to.

    Parameters
    ----------
    ledger : Ledger
    """

    def __init__(self, ledger):
        self.ledger = ledger
        path = ledger.path.resolve()
        self._lock_path = path.with_name(f"{path.name}.lock")
        self._lock = None

    def __enter__(self):
        self._lock = self._opened()
        return self

    def __exit__(self, *_):
        """Leave; the last one takes the lock file along.

        The kernel lets go of the locks of a process when it closes the file.
        """
        try:
            self._hold(WRITING)
            if self._hold(0, length=0, wait=False):
                os.unlink(self._lock_path)
        finally:
            os.close(self._lock)

    def claim(self, seed):
        """Take a seed, so that no other study works at it.

        Parameters
        ----------
        seed : int or str

        Returns
        -------
        bool
            False if another study has it.
        """
        return self._hold(SEEDS + int(seed), wait=False)

    def release(self, seed):
        """Let go of a seed.

        Parameters
        ----------
        seed : int or str
        """
        self._let_go(SEEDS + int(seed))

    def read(self):
        """As `Ledger.read`, while nobody is writing.

        Returns
        -------
        rows : list of dict of str
        damaged : int
        """
        with self._writing():
            return self.ledger.read()

    def append(self, *rows):
        """Add lines; they are on the disk when this returns.

        Parameters
        ----------
        *rows : dict of str

        Raises
        ------
        OSError
            If they cannot be written.
        FormatError
            If there is something else now where the table was.
        """
        lines = b"".join(map(self.ledger._line, rows))
        header = self.ledger._header().encode()
        with self._writing():
            if not self.ledger.path.exists():
                with whole_file(self.ledger.path) as stream:
                    stream.write(header + b"\n")
            table = os.open(self.ledger.path, os.O_RDWR | os.O_APPEND)
            try:
                _append(table, header, lines)
            except ValueError as error:
                raise FormatError(str(error), self.ledger.path) from None
            except OSError as error:
                raise OSError(error.errno, error.strerror, str(self.ledger.path)) from None
            finally:
                os.close(table)

    def tidy(self, answers, before):
        """Put the table in order, a line for each job, whole or not at all.

        Lines that answer nothing stay if others have added them meanwhile.

        Parameters
        ----------
        answers : callable
            As in `Ledger.latest`.
        before : list of dict of str
            The lines that were there when the study began.

        Returns
        -------
        list of dict of str
            Of each job the line that counts.
        """
        ledger, known = self.ledger, {tuple(row.values()) for row in before}
        with self._writing():
            rows, damaged = ledger.read()
            latest = ledger.latest(rows, answers)
            known |= {tuple(row.values()) for row in latest}
            theirs = [row for row in rows if tuple(row.values()) not in known and not answers(row)]
            kept = sorted([*latest, *theirs], key=ledger._place)
            if rows != kept or damaged:
                with whole_file(ledger.path) as stream:
                    stream.write(ledger._header().encode() + b"\n" + b"".join(map(ledger._line, kept)))
        return latest

    def _opened(self):
        """The lock file, held: one that is still there, which nobody has just taken along."""
        while True:
            self._lock = os.open(self._lock_path, os.O_RDWR | os.O_CREAT, 0o666)
            self._hold(PRESENT, shared=True)
            try:
                if os.path.samestat(os.fstat(self._lock), os.stat(self._lock_path)):
                    return self._lock
            except FileNotFoundError:
                pass
            os.close(self._lock)

    @contextmanager
    def _writing(self):
        """Nobody else writes to the table."""
        self._hold(WRITING)
        try:
            yield
        finally:
            self._let_go(WRITING)

    def _hold(self, byte, length=1, shared=False, wait=True):
        """Lock bytes of the lock file; whether that was possible."""
        import fcntl

        kind = (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | (0 if wait else fcntl.LOCK_NB)
        try:
            fcntl.lockf(self._lock, kind, length, byte)
        except (BlockingIOError, PermissionError):
            return False
        return True

    def _let_go(self, byte):
        """Unlock a byte of the lock file."""
        import fcntl

        fcntl.lockf(self._lock, fcntl.LOCK_UN, 1, byte)


def _append(table, header, lines):
    """Add lines to an open table, beginning a line whatever a killed run has left before them."""
    if os.pread(table, len(header), 0) != header:
        raise ValueError("is no longer the table that it was; what was found is not written over it")
    if os.pread(table, 1, os.fstat(table).st_size - 1) != b"\n":
        lines = b"\n" + lines
    while lines:
        lines = lines[os.write(table, lines) :]
    os.fsync(table)
