"""Every numbered figure of the paper, regenerated: python -m dollop.figures [id ...].

Each figure is one function that returns the drawing and its numbers, in the modules named after
what they show. This one writes a PNG per panel, keeps the numbers in metrics.json, and lays both
out as a gallery.
"""

import argparse
import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt
from tqdm import tqdm

from dollop import plot
from dollop.formats.files import check_writable, whole_file
from dollop.replication import gallery
from dollop.replication.figures import environment, learning, observing, performing  # noqa: F401, they register
from dollop.replication.figures.panel import PANELS

__all__ = ["FIGURES", "main", "make"]

FIGURES = {each.id: each for each in sorted(PANELS.values(), key=lambda each: each.picture)}
"""Every panel by id, in the paper's order."""


def rounded(metrics):
    """Numbers to six decimals: what is beyond differs between processors."""
    return {key: round(value, 6) if isinstance(value, float) else value for key, value in metrics.items()}


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
        with whole_file(folder / panel.picture) as stream:
            figure.savefig(stream, format="png", metadata={"Software": None})
        plt.close(figure)
    return rounded(json.loads(json.dumps(metrics, default=float)))


def main(arguments=None):
    """Command line: make the figures named by id, or all."""
    parser = argparse.ArgumentParser(prog="python -m dollop.figures", description=main.__doc__)
    parser.add_argument("ids", nargs="*", metavar="id", help=f"any of {', '.join(FIGURES)}; all when none is given")
    parser.add_argument("--folder", type=Path, default=Path("figures"), help="where to write (default: figures)")
    options = parser.parse_args(arguments)
    unknown = [panel for panel in options.ids if panel not in FIGURES]
    if unknown:
        parser.error(f"no figure {', '.join(unknown)}; known: {', '.join(FIGURES)}")
    written = options.folder / "metrics.json"
    try:
        options.folder.mkdir(parents=True, exist_ok=True)
        check_writable(written)
    except OSError as error:
        parser.error(f"the folder {options.folder} cannot be written to: {error}")
    metrics = json.loads(written.read_text()) if written.exists() else {}
    panels = options.ids or list(FIGURES)
    try:
        for panel in tqdm(panels, desc="figures", unit="panel", file=sys.stderr):
            metrics[panel] = make(panel, options.folder)
    except ImportError as error:
        sys.exit(f"figures: {error}")
    metrics = {panel: metrics[panel] for panel in FIGURES if panel in metrics}
    with whole_file(written, "w") as stream:
        json.dump(metrics, stream, indent=1)
        stream.write("\n")
    with whole_file(options.folder / "README.md", "w") as stream:
        stream.write(gallery.page(FIGURES.values(), metrics))
    print(f"wrote {len(panels)} panels, metrics.json and the gallery README.md into {options.folder}/")


if __name__ == "__main__":
    main()
