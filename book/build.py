"""The book: notebooks executed, and laid out with the gallery as HTML pages in build/book.

    python book/build.py

Nothing is fetched when building or reading: formulas become MathML, and what moves only with a running Python becomes
the picture that it shows first.
"""

import html
import os
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from sphinx.cmd.build import main as sphinx
from tqdm import tqdm

ROOT = Path(__file__).resolve().parents[1]
SOURCE, OUT = ROOT / "build" / "book-source", ROOT / "build" / "book"
PAGES = ("REPLICATION.md", "claims.json", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE")
FOLDERS = ("figures", "study")
WIDGET = "application/vnd.jupyter.widget-view+json"
TIMEOUT = 300  # s for one cell
QUIET = ["--IPKernelApp.log_level=ERROR"]


def main():
    """Execute, gather, lay out; the exit code is Sphinx's."""
    os.environ.pop("MPLBACKEND", None)  # so that notebooks draw inline
    gather()
    notebooks = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
    with ProcessPoolExecutor() as pool:
        for _ in tqdm(pool.map(prepare, notebooks), total=len(notebooks), desc="notebooks", file=sys.stderr):
            pass
    shutil.rmtree(OUT, ignore_errors=True)
    failed = sphinx(
        ["-q", "-j", "auto", "-c", str(ROOT / "book"), "-d", str(SOURCE / ".doctrees"), str(SOURCE), str(OUT)]
    )
    if not failed:
        print(f"wrote the book: open {OUT.relative_to(ROOT)}/index.html")
    return failed


def gather():
    """A fresh folder of sources: the pages in Markdown, the gallery with its pictures, the results they link to."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    (SOURCE / "notebooks").mkdir(parents=True)
    shutil.copy(ROOT / "book" / "index.md", SOURCE)
    for page in filter(Path.exists, (ROOT / page for page in PAGES)):
        shutil.copy(page, SOURCE)
    for folder in filter(Path.exists, (ROOT / folder for folder in FOLDERS)):
        shutil.copytree(folder, SOURCE / folder.name)


def prepare(path):
    """Execute one notebook where it lies, and keep the result among the sources."""
    notebook = nbformat.read(path, as_version=4)
    place = {"metadata": {"path": str(path.parent)}}
    client = NotebookClient(notebook, timeout=TIMEOUT, resources=place, extra_arguments=QUIET)
    client.on_cell_executed = lambda cell, **_: freeze_widgets(cell, client)
    try:
        client.execute()
    except CellExecutionError as error:
        if error.ename != "ImportError":
            raise
        print(f"{path.name} is not executed: {error.evalue}", file=sys.stderr)
    notebook.metadata.pop("widgets", None)
    nbformat.write(notebook, SOURCE / "notebooks" / path.name)


def freeze_widgets(cell, client):
    """Replace a widget by a still while it shows what the cell made: later cells may move its controls."""
    for output in cell.get("outputs", []):
        view = output.get("data", {}).get(WIDGET)
        if view and "image/png" in output.data:  # a figure that can be clicked into brings its own still
            output.data = {"image/png": output.data["image/png"]}
        elif view:
            output.data = {"text/html": still(client.widget_state, client.widget_buffers, view["model_id"])}


def still(states, buffers, root):
    """HTML of a widget: where its controls stand, and the picture that belongs to it."""
    parts = list(descendants(states, root))
    settings = html.escape(", ".join(filter(None, (setting(states[part]) for part in parts))))
    pictures = [buffers[part]["value",]["data"].strip() for part in parts if ("value",) in buffers.get(part, {})]
    images = "".join(f'<img alt="{settings}" src="data:image/png;base64,{picture}">' for picture in pictures)
    return f'<p class="still">In the live notebook, controls move this. Here: {settings}.</p>{images}'


def descendants(states, name):
    """Names of a widget and of everything inside it, in order."""
    yield name
    for child in states[name].get("children", []):
        yield from descendants(states, child.removeprefix("IPY_MODEL_"))


def setting(state):
    """What a control is called and where it stands; nothing for widgets that stand nowhere, such as buttons.

    >>> setting({"description": "x [m]", "value": 1.3})
    'x [m] = 1.3'
    """
    value = state["_options_labels"][state["index"]] if "_options_labels" in state else state.get("value")
    return f"{state['description']} = {value}" if state.get("description") and value is not None else None


if __name__ == "__main__":
    sys.exit(main())
