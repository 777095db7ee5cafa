"""Runs of the simulated robot, kept with the fingerprint of the code that drove them.

A hundred runs take minutes to drive and a moment to read. `make figures` drives them, and keeps them
in data/runs; a notebook may then draw a figure of runs that were kept, but only where the code that
drove them is that of today: otherwise they are driven anew.
"""

import json
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields
from pathlib import Path

import numpy as np

from dollop.checks import Note
from dollop.formats.kinds import Kind
from dollop.formats.writing import whole_file
from dollop.replication.fingerprint import fingerprint
from dollop.robot.run import Run

__all__ = ["FOLDER", "handled", "keep", "read", "write"]

FOLDER = Path(__file__).resolve().parents[3] / "data" / "runs"
"""Where runs are kept: in the checkout; an installed package has none, and drives."""
KEPT = Kind("kept runs", rb"\APK")
CODE = "dollop.replication.recordings"
"""The module that drives: its fingerprint is that of all that a run depends on."""
SHORT = "poses", "true_poses", "clearance"
"""Columns of which seven digits are kept."""

_handled = ContextVar("handled", default="driven")


@contextmanager
def handled(how):
    """What becomes of runs within a `with` statement.

    Parameters
    ----------
    how : {"driven", "read", "kept"}
        Driven; read where they were kept by the code of today, and driven elsewhere; or driven and
        kept.
    """
    token = _handled.set(how)
    try:
        yield
    finally:
        _handled.reset(token)


def keep(name, drive):
    """The runs of a name, by kind of control: read, driven, or driven and kept.

    Parameters
    ----------
    name : str
    drive : callable
        Takes nothing and returns a dict of lists of Run, or of lists of such lists.

    Returns
    -------
    dict
        As what `drive` returns.
    """
    how = _handled.get()
    runs = read(name) if how == "read" else None
    if runs is None:
        runs = drive()
        if how == "kept":
            write(name, runs)
    return runs


def read(name, folder=FOLDER):
    """Runs that were kept by the code of today.

    Parameters
    ----------
    name : str
    folder : Path

    Returns
    -------
    dict or None
        By kind of control; None where there are none, or other code drove them.
    """
    path = Path(folder) / f"{name}.npz"
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as columns:
        told = json.loads(str(columns["told"]))
        if told["code"] != fingerprint(CODE):
            return None
        return {kind: unpacked(columns, kind, runs) for kind, runs in told["runs"].items()}


def unpacked(columns, key, told):
    """A Run of the columns (name: array) under a key and what is told of it; or a list of such."""
    if isinstance(told, list):
        return [unpacked(columns, f"{key}/{k}", each) for k, each in enumerate(told)]
    arrays = {each: columns[f"{key}/{each}"] for each in told.pop("columns")}
    notes = tuple(Note(*each) for each in told.pop("notes"))
    for name in set(arrays) & set(SHORT):
        arrays[name] = arrays[name].astype(float)
    return Run(**arrays, **told, notes=notes)


def write(name, runs, folder=FOLDER):
    """Keep runs, whole or not at all.

    Parameters
    ----------
    name : str
    runs : dict
        By kind of control: lists of Run, or of lists of such.
    folder : Path
        Made if it is not there.
    """
    columns = {}
    told = {kind: packed(columns, kind, each) for kind, each in runs.items()}
    columns["told"] = np.array(json.dumps({"code": fingerprint(CODE), "runs": told}))
    Path(folder).mkdir(parents=True, exist_ok=True)
    with whole_file(Path(folder) / f"{name}.npz", kind=KEPT) as stream:
        np.savez_compressed(stream, **columns)


def packed(columns, key, run):
    """Put the arrays of a Run into columns under a key; what else there is to tell of it."""
    if isinstance(run, list):
        return [packed(columns, f"{key}/{k}", each) for k, each in enumerate(run)]
    told = {each.name: getattr(run, each.name) for each in fields(Run)}
    arrays = {name: value for name, value in told.items() if isinstance(value, np.ndarray)}
    for name, value in arrays.items():
        columns[f"{key}/{name}"] = value.astype(np.float32) if name in SHORT else value
    plain = {name: value for name, value in told.items() if name not in arrays}
    plain["notes"] = [(note.kind, note.text, note.doubt) for note in run.notes]
    return plain | {"columns": sorted(arrays)}
