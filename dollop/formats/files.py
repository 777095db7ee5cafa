"""Files at the edge: errors that name file and line, writing that is whole or not at all."""

import codecs
import gzip
import os
import tempfile
import zlib
from contextlib import contextmanager
from pathlib import Path

__all__ = ["FormatError", "check_writable", "read_bytes", "whole_file"]

MAX_BYTES = 1 << 30


class FormatError(ValueError):
    """A file that cannot be read as what it claims to be.

    Parameters
    ----------
    message : str
        What is wrong: the value and the rule.
    path : str or Path
        The file.
    line : int, optional
        Line number, counted from 1.
    """

    def __init__(self, message, path, line=None):
        self.path, self.line = str(path), line
        place = self.path if line is None else f"{self.path}, line {line}"
        super().__init__(f"{place}: {message}")


def read_bytes(path):
    """Whole content of a file, unpacked where it is gzipped (told by its first two bytes, not by
    its name).

    A byte order mark, which some editors put before UTF-8 text, is left out.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    bytes

    Raises
    ------
    FormatError
        If the file is empty, its gzip stream is cut short or damaged, or it holds more than
        `MAX_BYTES` (1 GiB).
    """
    with open(path, "rb") as stream:
        zipped = stream.read(2) == b"\x1f\x8b"
        stream.seek(0)
        try:
            content = (gzip.GzipFile(fileobj=stream) if zipped else stream).read(MAX_BYTES + 1)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            raise FormatError(f"gzip data cut short or damaged ({error})", path) from None
    if not content:
        raise FormatError("the file is empty", path)
    if len(content) > MAX_BYTES:
        raise FormatError(f"holds more than {MAX_BYTES} bytes, the most that is read", path)
    return content.removeprefix(codecs.BOM_UTF8)


def check_writable(path):
    """Raise OSError now, with the file's name, if a file `path` could not be written later."""
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path} cannot be written: it is a folder")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise _naming(path, error) from None


@contextmanager
def whole_file(path, mode="wb"):
    """Open a temporary neighbour of `path` for writing; it takes the name `path` only when all went
    well.

    Of two such files, one within the other, none takes its name before both are written.
    """
    path = Path(path)
    check_writable(path)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, mode) as stream:
            yield stream
            stream.flush()
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException as error:
        os.unlink(temporary)
        if isinstance(error, OSError) and error.filename in (None, temporary):
            raise _naming(path, error) from None
        raise


def _naming(path, error):
    """The same error about the file that was to be written; the temporary one is nobody's concern."""
    return type(error)(f"{path} cannot be written: {error.strerror or error}")
