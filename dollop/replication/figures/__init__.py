"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...].

Each panel is one function that returns the drawing and its numbers, in the modules named after
what they show. This one writes a PNG per panel, keeps the numbers in metrics.json, and lays both
out as a gallery.
"""

import argparse
import json
import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
from tqdm import tqdm

from dollop import plot
from dollop.checks import need
from dollop.formats.files import FormatError
from dollop.formats.kinds import PNG, Kind
from dollop.formats.writing import check_writable, together, whole_file
from dollop.replication import gallery
from dollop.replication.figures import environment, learning, moved, observing, performing  # noqa: F401
from dollop.replication.figures.panel import PANELS

__all__ = ["FIGURES", "differences", "main", "make", "show"]

FIGURES = {each.id: each for each in sorted(PANELS.values(), key=lambda each: each.picture)}
"""Every panel by id, in the paper's order; the modules above register theirs when imported."""

METRICS = Kind("numbers of figures", rb'\A\s*\{\s*(?:\}|"\w+": ?\{)')
GALLERY = Kind("a gallery", rb"\A# The figures\n")

DESCRIPTION = "Make the figures named by id, or all."


def rounded(value):
    """A number to six decimals: what is beyond differs between processors."""
    return round(value, 6) if isinstance(value, float) else value


def make(id, folder):
    """Draw one panel.

    Parameters
    ----------
    id : str
        A key of `FIGURES`.
    folder : Path
        Where its picture is written.

    Returns
    -------
    dict
        Its numbers, as in metrics.json.
    """
    panel = FIGURES[id]
    with plot.style():
        figure, metrics = panel.draw()
        try:
            with whole_file(folder / panel.picture, kind=PNG) as stream:
                figure.savefig(stream, format="png", metadata={"Software": None})
        finally:
            plt.close(figure)
    return as_written(metrics)


def as_written(metrics):
    """The numbers of a panel as metrics.json has them."""
    plain = json.loads(json.dumps(metrics, default=float))
    return {name: rounded(value) for name, value in plain.items()}


def show(id):
    """Draw one panel where a notebook shows it, by the code that writes it into a file.

    Parameters
    ----------
    id : str
        A key of `FIGURES`.

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
    plt.draw_if_interactive()  # a notebook's first drawing turns it interactive: not in a style that is left again
    with plot.style():
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
        Relative difference that another processor may make: 3 % in the spread of Fig. 12a, where readings
        of the laser were rounded otherwise.

    Returns
    -------
    dict
        By name, the number here and the one in the file.
    """
    written = numbers_in(Path(folder))[id] if numbers else {}
    pairs = {name: (numbers.get(name), written.get(name)) for name in numbers.keys() | written.keys()}
    return {name: pair for name, pair in pairs.items() if not same(*pair, within)}


def same(here, there, within):
    """Whether two values of a panel's numbers agree: numbers nearly, all else exactly."""
    if isinstance(here, int | float) and isinstance(there, int | float):
        return math.isclose(here, there, rel_tol=within, abs_tol=1e-9)
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
            with together():
                numbers = make(id, folder)
                write_numbers(folder, numbers_in(folder) | {id: numbers})
    except KeyboardInterrupt:
        made.close()
        raise KeyboardInterrupt(f"{done} of {len(panels)} panels are done, with their numbers") from None
    print(f"wrote {len(panels)} panels, metrics.json and the gallery README.md into {folder}/")


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
