"""Writing files at the edge: whole or not at all, and never over what is not theirs to replace.

A file is written into a neighbour, `.dollop-0123456789abcdef.part`, which takes its name once
everything is on the disk. The neighbour is locked while somebody writes it: what a killed run left
is removed by the next that writes into the folder.
"""

import gzip
import os
import re
import secrets
import stat
import time
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from contextvars import ContextVar
from functools import partial
from pathlib import Path
from typing import NamedTuple

from dollop.checks import shortened, told
from dollop.formats.kinds import PGM, PNG, Kind, check_no_map_names, check_replaceable

try:
    import fcntl
except ImportError:  # a system without, such as Windows
    fcntl = None

__all__ = [
    "Output", "check_outputs", "check_writable", "checked_path", "packed", "together", "whole_file",
]  # fmt: skip

PART = re.compile(r"\.dollop-[0-9a-f]{16}\.part")
PATIENCE = 10.0
"""s that a writer waits for another one in the same folder, who holds it for a few milliseconds."""
STALE = 86_400.0
"""s after which a neighbour counts as left behind where files cannot be locked: none takes a day."""


class Output(NamedTuple):
    """A file that a command is going to write.

    Attributes
    ----------
    path : str or Path
    kind : Kind, optional
        What it will hold; without it, it may replace a file of any kind.
    of : str or Path, optional
        The map whose picture it is.
    """

    path: object
    kind: Kind = None
    of: object = None


def checked_path(path):
    """A path, if that is what it is: to `open` a number is a file that is open already.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If it is neither, or holds a zero byte.
    """
    if not isinstance(path, str | os.PathLike) or "\0" in os.fsdecode(path):
        raise ValueError(f"a path must be a str or Path without zero bytes, got {told(path)}")
    return Path(path)


def check_outputs(outputs, inputs=()):
    """Refuse before the work what could not be written after it, or would destroy what is read.

    Parameters
    ----------
    outputs : sequence of Output
    inputs : sequence of str or Path
        Files that the same command reads; of a folder those in it.

    Raises
    ------
    ValueError
        If an output is one of the inputs or another output, by whatever name.
    OSError
        As `check_writable`.
    """
    for k, output in enumerate(outputs):
        read = [(path, "read") for each in inputs for path in _files(each)]
        written = [(other.path, "written as well") for other in outputs[:k]]
        for path, why in (*read, *written):
            if _same_file(output.path, path):
                raise ValueError(_refused(output.path, f"it is {path}, which is {why}"))
    for output in outputs:
        check_writable(*output)


def _files(path):
    """The file itself, or those of a folder."""
    return sorted(Path(path).iterdir()) if os.path.isdir(path) else [path]


def _same_file(path, other):
    """Whether two names are those of one file, there or not."""
    with suppress(OSError):
        return os.path.samefile(path, other)
    return os.path.normcase(os.path.realpath(path)) == os.path.normcase(os.path.realpath(other))


def check_writable(path, kind=None, of=None):
    """Refuse now, with the file's name, what could not be written later.

    Parameters
    ----------
    path : str or Path
        The file that is to be written.
    kind, of : optional
        As for `Output`.

    Raises
    ------
    ValueError, OSError
        As `whole_file`.
    """
    part, stream = _begin(path, "wb", kind, of)
    stream.close()
    _end(part)


@contextmanager
def together():
    """Files that belong together: all that are written within take their names at its end, or none.

    The last one is the main file. The others are removed before it is replaced, and take their
    names after it: a run that is killed in between leaves the old main file or the new one, and
    beside it files of the same run or none, never of another run. One `together` within another is
    part of it.

    Yields
    ------
    None

    Raises
    ------
    OSError
        If a file cannot take its name; the error names it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     try:
    ...         with together():
    ...             with whole_file(f"{folder}/plot.png") as stream:
    ...                 stream.write(b"plot")
    ...             raise KeyboardInterrupt("before the table is written")
    ...     except KeyboardInterrupt:
    ...         os.listdir(folder)
    4
    []
    """
    if _GROUP.get() is not None:
        yield
        return
    parts = []
    token = _GROUP.set(parts)
    try:
        yield
        _take_names(parts)
    finally:
        _GROUP.reset(token)
        for part in parts:
            _end(part)


_GROUP = ContextVar("the neighbours that take their names together", default=None)


@contextmanager
def whole_file(path, mode="wb", kind=None, of=None):
    """A temporary neighbour of a file, open for writing; it takes its name only if all goes well.

    It is flushed to the disk before, and the folder after. A file that is replaced keeps its
    rights, and its owner where that is allowed; through a symbolic link the file that it points to
    is replaced. Text is UTF-8.

    Parameters
    ----------
    path : str or Path
        The file that is to be written, or replaced.
    mode : {"wb", "w"}
        As in `open`.
    kind, of : optional
        As for `Output`.

    Yields
    ------
    file object
        To write into.

    Raises
    ------
    ValueError
        If the path is none.
    OSError
        If it cannot be written: there is no such folder or no room, or what bears the name is no
        ordinary file, may not be written, has other names (hard links, of which one would be cut
        off), is something of another kind, or the picture of another map. The error names the file,
        not its neighbour.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     try:
    ...         with whole_file(f"{folder}/a.txt") as stream:
    ...             stream.write(b"half of it, th")
    ...             raise KeyboardInterrupt
    ...     except KeyboardInterrupt:
    ...         os.listdir(folder)
    14
    []
    """
    with together():
        part, stream = _begin(path, mode, kind, of)
        try:
            with stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
        except BaseException as error:
            _end(part)
            if isinstance(error, OSError) and error.filename in (None, part.name):
                raise _naming(path, error) from None
            raise
        _GROUP.get().append(part)


def packed(stream, path):
    """A stream that packs what is written into it, if the file is named so.

    Parameters
    ----------
    stream : file object
        Of bytes.
    path : str or Path
        The name that the file will have.

    Returns
    -------
    context manager
        Of the stream itself, or, where the name ends in `.gz`, of one that packs it as gzip without
        name and time: the same content gives the same bytes.

    Examples
    --------
    >>> import io
    >>> files = io.BytesIO(), io.BytesIO()
    >>> for file in files:
    ...     with packed(file, "room.map.gz") as stream:
    ...         _ = stream.write(b"a room")
    >>> files[0].getvalue() == files[1].getvalue(), gzip.decompress(files[0].getvalue())
    (True, b'a room')
    """
    if str(path).endswith(".gz"):
        return gzip.GzipFile(filename="", fileobj=stream, mode="wb", mtime=0)
    return nullcontext(stream)


# ---- neighbours


class _Part(NamedTuple):
    """A neighbour: the path that was asked for, the file that it will be, its name now, and a lock."""

    path: object
    target: str
    name: str
    lock: int


def _begin(path, mode, kind, of):
    """A neighbour of a file that may be written, and its stream."""
    try:
        target = os.path.realpath(checked_path(path))
        before = _replaced(target, kind)
        if kind in (PGM, PNG):
            check_no_map_names(target, of)
        folder, name = os.path.dirname(target), _neighbour(target)
        with _alone_in([folder]):
            _sweep(folder)
            stream = _made(name, mode, before)
            return _Part(path, target, name, _locked(stream)), stream
    except OSError as error:
        raise _naming(path, error) from None


def _replaced(target, kind):
    """The status of the file that is to be replaced, None if there is none."""
    try:
        status = os.lstat(target)
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError("it is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise FileExistsError("it is no ordinary file")
    if status.st_nlink > 1:
        rule = "of which this one would be cut off"
        raise FileExistsError(f"it has {status.st_nlink} names (hard links), {rule}")
    if not status.st_mode & 0o222 or not os.access(target, os.W_OK):
        raise PermissionError("it may not be written")
    if kind is not None and status.st_size:
        check_replaceable(target, kind)
    return status


def _made(name, mode, before):
    """A new file, with the rights, and if that is allowed the owner, of the one that was before."""
    rights = 0o666 if before is None else stat.S_IMODE(before.st_mode)
    text, opener = {} if "b" in mode else {"encoding": "utf-8"}, partial(os.open, mode=rights)
    stream = open(name, mode.replace("w", "x"), opener=opener, **text)  # noqa: SIM115
    if before is not None:
        for owner in (-1, before.st_uid) if hasattr(os, "chown") else ():
            with suppress(OSError):
                os.chown(name, owner, before.st_gid)
        with suppress(OSError):
            os.chmod(name, rights)  # those that the umask took
    return stream


def _end(part):
    """Remove a neighbour that has not taken its name, and let its lock go."""
    with suppress(OSError):
        os.unlink(part.name)
    if part.lock is not None:
        os.close(part.lock)


def _take_names(parts):
    """Give all neighbours their names, the last one's first; an interrupt waits until all have."""
    aside = {}
    with _alone_in({os.path.dirname(part.target) for part in parts}) as to_disk:
        try:
            try:
                _rename(parts, aside, to_disk)
            except KeyboardInterrupt:
                _rename(parts, aside, to_disk)
                raise
        finally:
            _put_away(parts[-1], aside)


def _rename(parts, aside, to_disk):
    """Give their names to the neighbours that have not got them yet; old companions stand aside meanwhile."""
    left = [part for part in parts if os.path.lexists(part.name)]
    for part in left[:-1]:
        if os.path.lexists(part.target):
            name = _neighbour(part.target)
            _do(part, os.replace, part.target, name)
            aside[part.target] = name
    to_disk()
    for part in reversed(left):
        _do(part, os.replace, part.name, part.target)
        to_disk()


def _put_away(main, aside):
    """Remove the old companions, or put them back where the main file could not take its name."""
    done = not os.path.lexists(main.name)
    for target, name in aside.items():
        with suppress(OSError):
            os.unlink(name) if done else os.replace(name, target)


def _neighbour(target):
    """The name of a new neighbour of a file."""
    return os.path.join(os.path.dirname(target), f".dollop-{secrets.token_hex(8)}.part")


def _do(part, change, *names):
    """Change a folder; an error names the file that was asked for."""
    try:
        change(*names)
    except OSError as error:
        raise _naming(part.path, error) from None


# ---- locks


@contextmanager
def _alone_in(folders):
    """No other writer makes or renames neighbours in these folders; yields what flushes them to disk.

    Where folders cannot be opened or locked, as on Windows, nothing is locked and flushed.
    """
    with ExitStack() as opened:
        handles = {}
        for folder in sorted(folders):
            with suppress(OSError):
                handles[folder] = os.open(folder, os.O_RDONLY)
                opened.callback(os.close, handles[folder])
        for folder, handle in handles.items():
            _wait_for(folder, handle)
        yield partial(_to_disk, handles.values())


def _wait_for(folder, handle):
    """Lock a folder once nobody else holds it; refuse to wait for ever."""
    patient = time.monotonic() + PATIENCE
    while _is_held(handle):
        if time.monotonic() > patient:
            raise TimeoutError(f"another process has held the folder {folder} for {PATIENCE:g} s")
        time.sleep(0.002)


def _is_held(handle):
    """Whether somebody else has locked a file; if not, it is locked now. None if there are no locks."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system that has none
        return None
    return False


def _to_disk(handles):
    for handle in handles:
        with suppress(OSError):  # some file systems know no such thing
            os.fsync(handle)


def _locked(stream):
    """A second handle of a file, locked until it is closed; None where there are no locks."""
    if fcntl is None:
        return None
    handle = os.dup(stream.fileno())
    _is_held(handle)
    return handle


def _sweep(folder):
    """Remove the neighbours that killed runs left in a folder."""
    with suppress(OSError):
        for name in filter(PART.fullmatch, os.listdir(folder)):
            part = os.path.join(folder, name)
            with suppress(OSError):
                if stat.S_ISREG(os.lstat(part).st_mode) and _is_left(part):
                    os.unlink(part)


def _is_left(part):
    """Whether nobody writes a neighbour any more."""
    with open(part, "rb") as stream:
        held = _is_held(stream.fileno())
    return not held if held is not None else time.time() - os.lstat(part).st_mtime > STALE


# ---- messages


def _refused(path, why):
    return f"{shortened(str(path), 120)} cannot be written: {shortened(why, 160)}"


def _naming(path, error):
    """The same error about the file that was to be written: the temporary one concerns nobody."""
    return type(error)(_refused(path, error.strerror or str(error)))
