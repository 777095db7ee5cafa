"""A recording: what the laser saw, and beside it the truth that only the error is measured with.

On disk: a CARMEN log, the truth as CSV, the scene as JSON. Nothing here needs PyBullet.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from dollop.formats.files import FormatError, read_bytes, written_number
from dollop.formats.kinds import CARMEN_LOG, SCENE, TRUTH
from dollop.formats.logs import read_log, write_log
from dollop.formats.writing import Output, together, whole_file
from dollop.lab.scenes import Scene
from dollop.laser import LaserLog

__all__ = ["MOVED_COLUMNS", "ROBOT_COLUMNS", "Recording", "TRUTH_COLUMNS", "outputs"]

TRUTH_COLUMNS = ["t", "x", "y", "heading"]
"""Of the first person; the others' end in their number: x_1, y_1, heading_1."""
MOVED_COLUMNS = ["object_x", "object_y"]
"""Of an object that is moved, which end in its number: object_x_0, object_y_0."""
ROBOT_COLUMNS = ["laser_x", "laser_y", "laser_theta"]
"""True pose of the laser, where its robot drives."""
MAX_TRUTH, LARGEST = 64 << 20, 1e10
"""Bytes of the truth, and the largest number in it: times may be seconds since 1970."""


@dataclass(frozen=True)
class Recording:
    """A demonstration as recorded in the laboratory (Sec. II).

    Attributes
    ----------
    log : LaserLog
        T scans from the robot.
    truth : pandas.DataFrame
        Whoever and whatever moves, at each scan, in s, m and rad: `TRUTH_COLUMNS` of the person who
        shows the task, the others', moved objects', and the laser's own where its robot drives. No
        rows if nothing moves.
    scene : Scene
        What stood where at the beginning, and who was to walk where.
    """

    log: LaserLog
    truth: pd.DataFrame
    scene: Scene

    def __repr__(self):
        return f"Recording: {self.log}; {self.scene}"

    def save(self, path):
        """Write the log, and beside it the truth and the scene: all of them, or none.

        Parameters
        ----------
        path : str or Path
            Of a CARMEN log, .log or .log.gz. For `walk.log.gz` the others are `walk_truth.csv` and
            `walk_scene.json`.

        Raises
        ------
        OSError
            Where a file cannot be written, or what is there is of another kind.
        """
        truth, scene = companions(path)
        with together():
            with whole_file(truth, "w", TRUTH) as stream:
                self.truth.to_csv(stream, index=False, float_format="%.4f")
            self.scene.save(scene)
            write_log(path, self.log)

    @classmethod
    def load(cls, path):
        """Read what `save` wrote.

        Parameters
        ----------
        path : str or Path
            Of the log.

        Returns
        -------
        Recording

        Raises
        ------
        FormatError
            If a file is missing or not what it should be, or the truth is larger than 64 MiB or has
            not one line for each scan.
        """
        log = read_log(path)
        truth_path, scene_path = companions(path)
        for each in (truth_path, scene_path):
            if not each.exists():
                rule = "a recording has its truth and its scene beside its log"
                raise FormatError(f"{rule}, this is missing", each)
        return cls(log, load_truth(truth_path, len(log)), Scene.load(scene_path))


def outputs(path):
    """What `Recording.save` writes.

    Parameters
    ----------
    path : str or Path
        Of the log.

    Returns
    -------
    list of Output
        Log, truth and scene.
    """
    truth, scene = companions(path)
    return [Output(path, CARMEN_LOG), Output(truth, TRUTH), Output(scene, SCENE)]


def load_truth(path, n_scans):
    """Read the walker's true states, one line for each of `n_scans` scans."""
    names, *lines = read_bytes(path, MAX_TRUTH).decode(errors="replace").splitlines()
    names = names.split(",")
    kinds = {re.sub(r"_\d+$", "", name) for name in names}
    known = {*TRUTH_COLUMNS, *MOVED_COLUMNS, *ROBOT_COLUMNS}
    good = "t" in names and kinds <= known and len(set(names)) == len(names)
    if not good or len(lines) not in (0, n_scans):
        others = ", ".join(sorted(known - {"t"}))
        rule = f"columns must be t and of {others}, and rows {n_scans}, one for each scan"
        found = f"{', '.join(names)} and {len(lines)}"
        raise FormatError(f"{rule}, or none if nothing moves, got {found}", path)
    rows = [_row(path, names, line, number) for number, line in enumerate(lines, 2)]
    return pd.DataFrame(np.reshape(rows, (-1, len(names))).astype(float), columns=names)


def _row(path, names, line, number):
    """The numbers of a line of the truth."""
    values = line.split(",")
    if len(values) != len(names):
        rule = f"not a table of numbers: a line must hold one for each of {len(names)} columns"
        raise FormatError(f"{rule}, got {len(values)}", path, number)
    try:
        pairs = zip(names, values, strict=True)
        return [written_number(name, value.strip(), LARGEST) for name, value in pairs]
    except ValueError as error:
        raise FormatError(f"not a table of numbers: {error}", path, number) from None


def companions(path):
    """Where the truth and the scene of the log at `path` lie."""
    path = Path(path)
    stem = Path(path.name.removesuffix(".gz")).stem
    return path.with_name(f"{stem}_truth.csv"), path.with_name(f"{stem}_scene.json")
