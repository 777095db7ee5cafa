"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...].

Each panel is one function that returns the drawing and its numbers, in the modules named after
what they show. This one writes a PNG per panel for the screen and a PDF for print, keeps the
numbers in metrics.json, and lays them out as a gallery.
"""

import argparse
import json
import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
from tqdm import tqdm

from dollop.checks import need
from dollop.formats.files import FormatError
from dollop.formats.kinds import PNG, Kind
from dollop.formats.writing import check_writable, together, whole_file
from dollop.replication import drawing, gallery
from dollop.replication.figures import environment, kept, learning, moved, observing, performing  # noqa: F401
from dollop.replication.figures.panel import PANELS

__all__ = ["FIGURES", "RUNS", "differences", "kept_runs", "main", "make", "show"]

FIGURES = {each.id: each for each in sorted(PANELS.values(), key=lambda each: each.picture)}
"""Every panel by id, in the paper's order; the modules above register theirs when imported."""

RUNS = {"7a": "eight_runs", "7b": "kidnapped_runs", "10b": "runs_in_every_layout", "12b": "slalom_runs"}
"""Panels of runs, and under which name these are kept."""

METRICS = Kind("numbers of figures", rb'\A\s*\{\s*(?:\}|"\w+": ?\{)')
PDF = Kind("a PDF", rb"\A%PDF-")
GALLERY = Kind("a gallery", rb"\A# The figures\n")

UNDATED = {"CreationDate": None, "ModDate": None, "Creator": None, "Producer": None}
"""What a PDF would tell of when and by what it was made, left out."""
NEARLY = 5e-3
"""m by which a least clearance may differ from the one in metrics.json: on another processor a robot
drives a little elsewhere, and what is left to an obstacle may be less than that."""

DESCRIPTION = "Make the figures named by id, or all."


def rounded(value):
    """A number to six decimals: what is beyond differs between processors."""
    return round(value, 6) if isinstance(value, float) else value


def make(id, folder):
    """Draw one panel, as PNG and as PDF: both are written, or neither.

    The same drawing gives the same bytes: neither file has a date in it.

    Parameters
    ----------
    id : str
        A key of `FIGURES`.
    folder : Path
        Where its files are written.

    Returns
    -------
    dict
        Its numbers, as in metrics.json.
    """
    panel = FIGURES[id]
    with drawing.journal():
        figure, metrics = panel.draw()
        try:
            with together():
                if panel.printed:
                    with whole_file(folder / panel.printed, kind=PDF) as stream:
                        figure.savefig(stream, format="pdf", metadata=UNDATED)
                with whole_file(folder / panel.picture, kind=PNG) as stream:
                    figure.savefig(stream, format="png", metadata={"Software": None})
        finally:
            plt.close(figure)
    return as_written(metrics)


def as_written(metrics):
    """The numbers of a panel as metrics.json has them."""
    plain = json.loads(json.dumps(metrics, default=float))
    return {name: rounded(value) for name, value in plain.items()}


def kept_runs(id):
    """The runs of a panel that were kept when it was made.

    Parameters
    ----------
    id : str
        A key of `RUNS`.

    Returns
    -------
    dict
        Lists of Run by kind of control, "plain" and "own", those of several layouts one after the other;
        empty where none were kept by the code of today.
    """
    found = kept.read(RUNS[id]) or {}
    return {kind: list(flat(runs)) for kind, runs in found.items()}


def flat(runs):
    """Each of some runs, in lists or not."""
    for each in runs:
        yield from flat(each) if isinstance(each, list) else (each,)


def show(id, fresh=False):
    """Draw one panel where a notebook shows it, by the code that writes it into a file.

    Parameters
    ----------
    id : str
        A key of `FIGURES`.
    fresh : bool
        Drive the robot's runs here. Otherwise those are drawn that were kept when the figure was made,
        if the code that drove them is that of today; it is printed.

    Returns
    -------
    dict
        Its numbers, as in metrics.json; none where it cannot be drawn because something is not
        installed, which is then printed.
    """
    try:
        need(FIGURES[id].extra)
    except ImportError as error:
        print(f"Figure {id} is not drawn here: {error}")
        return {}
    if id in RUNS and not fresh and kept_runs(id):
        print(f"Figure {id}: runs that were driven by this very code when it was made, and kept")
    plt.draw_if_interactive()  # begins the notebook's way of showing, which the style's end would undo
    with drawing.journal(), kept.handled("driven" if fresh else "read"):
        _, metrics = FIGURES[id].draw()
    return as_written(metrics)


def differences(id, numbers, folder, within=0.05):
    """Where the numbers of a panel are not those of metrics.json.

    Parameters
    ----------
    id : str
        A key of `FIGURES`.
    numbers : dict
        As `show` returns them; where there are none, nothing differs.
    folder : str or Path
        Of metrics.json.
    within : float
        Relative difference that another processor may make: 3 % in the spread of Fig. 12a, where
        readings of the laser were rounded otherwise. What is counted must be the same.

    Returns
    -------
    dict
        By name, the number here and the one in the file.
    """
    written = numbers_in(Path(folder))[id] if numbers else {}
    pairs = {name: (numbers.get(name), written.get(name)) for name in numbers.keys() | written.keys()}
    close = {name: NEARLY if name.endswith("clearance_m") else 1e-9 for name in pairs}
    return {name: pair for name, pair in pairs.items() if not same(*pair, within, close[name])}


def same(here, there, within, nearly):
    """Whether two values of a panel's numbers agree: what was measured nearly, all else exactly."""
    if isinstance(here, float) and isinstance(there, float):
        return math.isclose(here, there, rel_tol=within, abs_tol=nearly)
    return here == there


def main(arguments=None):
    """Make the figures named by id, or all; the command line of `python -m dollop.figures`.

    A panel is written together with its numbers and the gallery: after an interrupt, or a kill, those
    that are done are there with theirs, and the others are as they were.

    Parameters
    ----------
    arguments : list of str, optional
        By default those that the program was called with.

    Raises
    ------
    SystemExit
        An unknown id, or a folder that cannot be written to: told before the work.
    FormatError
        A metrics.json that is not JSON: told before the work.
    KeyboardInterrupt
        When interrupted, with how many panels are done.
    ImportError
        What a panel needs is missing: told before the work as well.
    """
    parser = argparse.ArgumentParser(prog="python -m dollop.figures", description=DESCRIPTION)
    known = ", ".join(FIGURES)
    parser.add_argument("ids", nargs="*", metavar="id", help=f"any of {known}; default: all")
    parser.add_argument("--folder", type=Path, default=Path("figures"), help="default: figures")
    options = parser.parse_args(arguments)
    folder, panels = options.folder, options.ids or list(FIGURES)
    unknown = [id for id in panels if id not in FIGURES]
    if unknown:
        parser.error(f"no figure {', '.join(unknown)}; known: {known}")
    for id in panels:
        need(FIGURES[id].extra)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        numbers_in(folder)
        check_writable(folder / "metrics.json", METRICS)
        check_writable(folder / "README.md", GALLERY)
    except OSError as error:
        parser.error(f"the folder {folder} cannot be written to: {error}")
    made, done = tqdm(panels, desc="figures", unit="panel", file=sys.stderr), 0
    try:
        for done, id in enumerate(made):  # noqa: B007
            with together(), kept.handled("kept" if is_committed(folder) else "driven"):
                numbers = make(id, folder)
                write_numbers(folder, numbers_in(folder) | {id: numbers})
    except KeyboardInterrupt:
        made.close()
        raise KeyboardInterrupt(f"{done} of {len(panels)} panels are done, with their numbers") from None
    print(f"wrote {len(panels)} panels, metrics.json and the gallery README.md into {folder}/")


def is_committed(folder):
    """Whether a folder is the one that is committed, beside which runs are kept."""
    return folder.resolve() == kept.FOLDER.parents[1] / "figures"


def numbers_in(folder):
    """What metrics.json holds so far, by panel; read before the work, lest it be done in vain."""
    written = folder / "metrics.json"
    try:
        return json.loads(written.read_text()) if written.exists() else {}
    except ValueError as error:
        raise FormatError(f"not JSON ({error}); remove it, and run again", written) from None


def write_numbers(folder, numbers):
    """Write the gallery and metrics.json, both or neither, panels in the paper's order."""
    numbers = {id: numbers[id] for id in FIGURES if id in numbers}
    with together():
        with whole_file(folder / "README.md", "w", GALLERY) as stream:
            stream.write(gallery.page(FIGURES.values(), numbers))
        with whole_file(folder / "metrics.json", "w", METRICS) as stream:
            stream.write(json.dumps(numbers, indent=1) + "\n")
