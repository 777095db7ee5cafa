"""Names of what a command writes: as they should end, of its own, and for what comes next unused."""

from itertools import chain, count
from pathlib import Path

from dollop.formats import kinds
from dollop.formats.writing import Output, check_outputs

__all__ = ["check_written", "named", "outputs_of", "unused"]

PICTURED = {
    ".json": (kinds.TASK,),
    ".yaml": (kinds.ROS_MAP,),
    ".yml": (kinds.ROS_MAP,),
    ".map": (kinds.CARMEN_MAP,),
    ".map.gz": (kinds.CARMEN_MAP,),
    ".csv": (kinds.RUN, kinds.TRAJECTORY),
}
"""Endings and kinds of results beside which a command leaves a picture of the same stem."""


def named(path, suffix, option="--out", holds="what it writes"):
    """A path, if its name says what it holds.

    Parameters
    ----------
    path : str
    suffix : str
    option : str
        How it is called on the command line.
    holds : str
        What it holds, for the error.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If it is named otherwise.

    Examples
    --------
    >>> named("task.txt", ".json", holds="a task")
    Traceback (most recent call last):
    ValueError: --out must be named .json (a task), got task.txt
    """
    if Path(path).suffix != suffix:
        raise ValueError(f"{option} must be named {suffix} ({holds}), got {path}")
    return Path(path)


def outputs_of(options, suffix, holds):
    """The file that --out names, and the picture that lands beside it.

    Parameters
    ----------
    options : argparse.Namespace
    suffix, holds : str
        As for `named`.

    Returns
    -------
    out : Path
    picture : Path

    Raises
    ------
    ValueError
        If it is named otherwise.
    """
    out = named(options.out, suffix, holds=f"{holds}; its picture, .png, lands beside it")
    return out, out.with_suffix(".png")


def unused(path, *endings):
    """A name that no file has yet, for what a next command writes: it must never replace what is there.

    Parameters
    ----------
    path : str or Path
        The name that is meant; with a number, from 2 on, where it is taken.
    *endings : str
        Of what is written beside it, such as its picture, whose names must be free as well.

    Returns
    -------
    Path

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "room.png").touch()
    ...     unused(f"{folder}/room.yaml").name, unused(f"{folder}/room.yaml", ".png").name
    ('room.yaml', 'room_2.yaml')
    """
    path = Path(path)
    numbered = (path.with_stem(f"{path.stem}_{k}") for k in count(2))
    for each in chain([path], numbered):
        beside = (each, *map(each.with_suffix, endings))
        if not any(name.exists() or name.is_symlink() for name in beside):
            return each
    raise AssertionError("numbers do not end")


def check_written(outputs, read, picture, own):
    """Refuse before the work what could not be written, or would replace what belongs to something else.

    Parameters
    ----------
    outputs : sequence of Output
        All but the picture.
    read : sequence of str or Path
        As for `dollop.formats.writing.check_outputs`.
    picture : Path
    own : str or Path
        The result of which it is a picture.

    Raises
    ------
    ValueError, OSError
        As `check_outputs`.
    FileExistsError
        If the picture is there, and beside it another result whose picture it is.
    """
    is_map = any(each.kind in (kinds.ROS_MAP, kinds.CARMEN_MAP) for each in outputs)
    check_outputs([*outputs, Output(picture, kinds.PNG, own if is_map else None)], read)
    beside = _pictured(picture) if picture.exists() else []
    if beside and Path(own).resolve() not in map(Path.resolve, beside):
        why = f"it is the picture of {beside[0]}: choose another --out"
        raise FileExistsError(f"{picture} cannot be written: {why}")


def _pictured(picture):
    """Results beside a picture, of its stem, of which it may be one."""
    beside = ((picture.with_suffix(suffix), known) for suffix, known in PICTURED.items())
    return [path for path, known in beside if path.is_file() and kinds.kind_of(path) in known]
