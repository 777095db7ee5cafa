"""Writing files at the edge: whole or not at all."""

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

__all__ = ["check_writable", "whole_file"]


def check_writable(path):
    """Refuse now, with the file's name, what could not be written later.

    Parameters
    ----------
    path : str or Path
        The file that is to be written.

    Raises
    ------
    OSError
        If there is a folder of this name, or none to put the file into.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path} cannot be written: it is a folder")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise _naming(path, error) from None


@contextmanager
def whole_file(path, mode="wb"):
    """A temporary neighbour of a file, open for writing; it takes its name only if all goes well.

    Of two such files, one within the other, none takes its name before both are written.

    Parameters
    ----------
    path : str or Path
        The file that is to be written, or replaced.
    mode : str
        As in `open`.

    Yields
    ------
    file object
        To write into.

    Raises
    ------
    OSError
        If it cannot be written; the error names the file, not its neighbour.

    Examples
    --------
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
    """The same error about the file that was to be written: the temporary one concerns nobody."""
    return type(error)(f"{path} cannot be written: {error.strerror or error}")
