"""The book: notebooks executed, and laid out with gallery and API as HTML pages in build/book.

    python book/build.py

A page that warns or a link that leads nowhere fails the build. Nothing is fetched when building or
reading: formulas become MathML, and what moves only with a running Python becomes the picture that
it shows first.
"""

import ast
import html
import inspect
import os
import re
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from sphinx.cmd.build import main as sphinx
from tqdm import tqdm

import dollop

ROOT = Path(__file__).resolve().parents[1]
SOURCE, OUT = ROOT / "build" / "book-source", ROOT / "build" / "book"
PAGES = (
    *("README.md", "REPLICATION.md", "CLAIMS.md", "CHANGELOG.md", "CONTRIBUTING.md"),
    *("figures/README.md", "data/README.md", "book/own_log.md"),
)
PUBLIC = [name for name in dollop.__all__ if name != "__version__"]
FILE_LINK = re.compile(r'(?:\]\(|src="|href=")([\w./-]+)(?=[)"# ])')
CODE_LINK = re.compile(r"\]\((?P<up>(\.\./)*)(?P<path>dollop/[\w/]+)\.py\)")
NAME = re.compile(r"`dollop\.(?P<name>(?P<first>\w+)[\w.]*)`")
WIDGET = "application/vnd.jupyter.widget-view+json"
TIMEOUT = 300  # s for one cell
WINGS = {
    "": "The method, in the order of the paper",
    "cdhmm": "The CDHMM (Sec. V)",
    "robot": "Performing on a robot",
    "formats": "Files",
    "lab": "The laboratory",
    "replication": "The replication",
}
ORDER = (  # of the paper: what is not named here comes after, by the alphabet
    *("laser", "gridmap", "foreground", "tracking", "observation"),  # Sec. II
    *("trajectory", "laps", "lds", "segmentation", "sequenced_lds"),  # Sec. III
    *("environment", "matching", "association"),  # Sec. IV
    *("model", "alignment", "merging", "evidence", "task"),  # Sec. V
    *("control", "avoidance", "localization", "performing"),
    *("observing", "learning"),
)
QUIET = ["--IPKernelApp.log_level=ERROR"]


def main():
    """Execute, gather, lay out, check the links; the exit code is 0 if no page has a fault."""
    os.environ.pop("MPLBACKEND", None)  # so that notebooks draw inline
    gather()
    notebooks = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
    with ProcessPoolExecutor() as pool:
        done = pool.map(prepare, notebooks)
        for _ in tqdm(done, total=len(notebooks), desc="notebooks", file=sys.stderr):
            pass
    return lay_out()


def lay_out():
    """HTML of the sources; a warning of Sphinx is an error, and so is a dead link."""
    shutil.rmtree(OUT, ignore_errors=True)
    options = ["-q", "-W", "--keep-going", "-j", "auto", "-c", str(ROOT / "book")]
    if failed := sphinx([*options, "-d", str(SOURCE / ".doctrees"), str(SOURCE), str(OUT)]):
        return failed
    dead = list(dead_links(OUT))
    for link in dead:
        print(f"dead link: {link}", file=sys.stderr)
    if not dead:
        print(f"wrote the book: open {os.path.relpath(OUT)}/index.html")
    return len(dead) > 0


def gather():
    """A fresh folder of sources: pages in Markdown, every file that they link to, and the API."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    (SOURCE / "notebooks").mkdir(parents=True)
    write_api(SOURCE / "api")
    texts = {SOURCE / page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
    texts[SOURCE / "index.md"] = (ROOT / "book" / "index.md").read_text(encoding="utf-8")
    for page, text in texts.items():
        page.parent.mkdir(exist_ok=True)
        page.write_text(CODE_LINK.sub(link_to_api, text), encoding="utf-8")
    for page, text in texts.items():
        for link in FILE_LINK.findall(text):
            adopt((page.parent / link).resolve())


def adopt(path):
    """Copy a file of the project that a page links to, unless it is there already."""
    original = ROOT / os.path.relpath(path, SOURCE)
    if path.is_relative_to(SOURCE) and original.is_file() and not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(original, path)


def link_to_api(found):
    """The page of a module in place of its source.

    >>> CODE_LINK.sub(link_to_api, "[the lab](../dollop/lab/__init__.py)")
    '[the lab](../api/dollop.lab.rst)'
    >>> CODE_LINK.sub(link_to_api, "[the notation](dollop/__init__.py)")
    '[the notation](api/index.rst)'
    """
    module = found["path"].replace("/", ".").removesuffix(".__init__")
    return f"]({found['up']}api/{'index' if module == 'dollop' else module}.rst)"


def write_api(folder):
    """A page per module, and a first page: notation, public names, a table of modules per wing."""
    folder.mkdir()
    sentences = modules()
    for name in sentences:
        source = f".. automodule:: {name}\n   :members:\n"
        (folder / f"{name}.rst").write_text(heading(name, "=") + source, encoding="utf-8")
    parts = [heading("API", "="), ".. automodule:: dollop\n\n", heading("The public names", "-")]
    parts.append(table({link_in_rst(name): first_line(name) for name in PUBLIC}))
    for wing, title in WINGS.items():
        inside = sorted((name for name in sentences if belongs(name) == wing), key=place)
        parts += [heading(title, "-"), *contents(inside, sentences)]
    (folder / "index.rst").write_text("".join(parts), encoding="utf-8")


def contents(names, sentences):
    """Pages of modules for the navigation, and their table with first sentences."""
    yield ".. toctree::\n   :hidden:\n\n" + "".join(f"   {name}\n" for name in names) + "\n"
    yield table({f":doc:`{name}`": sentences[name] for name in names})


def modules():
    """First sentence of every module, read without importing it: not everybody has PyBullet."""
    sentences = {}
    for path in (ROOT / "dollop").rglob("*.py"):
        inside = path.relative_to(ROOT).with_suffix("")
        name = ".".join(inside.parts).removesuffix(".__init__")
        if name not in ("dollop", "dollop.__main__"):
            text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            sentences[name] = text.splitlines()[0]
    return sentences


def heading(title, underline):
    """A heading in reStructuredText."""
    return f"{title}\n{len(title) * underline}\n\n"


def table(sentences):
    """A table of links, each with its sentence."""
    rows = (f"   * - {link}\n     - {sentence}\n" for link, sentence in sentences.items())
    return ".. list-table::\n\n" + "".join(rows) + "\n"


def link_in_rst(name):
    """A public name as a link to its entry."""
    return f":py:obj:`dollop.{name} <{home(name)}>`"


def first_line(name):
    """First sentence of a public name's docstring."""
    return inspect.getdoc(getattr(dollop, name)).splitlines()[0]


def home(name):
    """Where a public name is defined, and its API entry found.

    >>> home("SequencedLDS.fit")
    'dollop.sequenced_lds.SequencedLDS.fit'
    """
    first, *rest = name.split(".")
    thing = getattr(dollop, first)
    return ".".join([thing.__module__, first, *rest])


def belongs(module):
    """The wing of a module: dollop.cdhmm.model belongs to cdhmm, dollop.lds to none.

    >>> belongs("dollop.cdhmm.model"), belongs("dollop.cdhmm"), belongs("dollop.lds")
    ('cdhmm', 'cdhmm', '')
    """
    wing = module.split(".")[1]
    return wing if wing in WINGS else ""


def place(module):
    """Sorting key of a module: a wing before its rooms, the paper's order, then the alphabet."""
    path = module.split(".")[1:]
    return [(ORDER.index(name) if name in ORDER else len(ORDER), name) for name in path]


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
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = NAME.sub(link_to_name, cell.source)
    nbformat.write(notebook, SOURCE / "notebooks" / path.name)


def link_to_name(found):
    """A public name in the prose as a link to its entry in the API; other code stays as it is.

    >>> NAME.sub(link_to_name, "`dollop.observe` of `dollop.plot`")
    '{py:obj}`dollop.observe <dollop.observation.observe>` of `dollop.plot`'
    """
    if found["first"] not in PUBLIC:
        return found[0]
    return f"{{py:obj}}`dollop.{found['name']} <{home(found['name'])}>`"


def freeze_widgets(cell, client):
    """Replace a widget by a still while it shows what the cell made: later cells may move it."""
    for output in cell.get("outputs", []):
        view = output.get("data", {}).get(WIDGET)
        if view and "image/png" in output.data:  # a clickable figure brings its own still
            output.data = {"image/png": output.data["image/png"]}
        elif view:
            picture = still(client.widget_state, client.widget_buffers, view["model_id"])
            output.data = {"text/html": picture}


def still(states, buffers, root):
    """HTML of a widget: where its controls stand, and the picture that belongs to it."""
    parts = list(descendants(states, root))
    settings = html.escape(", ".join(filter(None, (setting(states[part]) for part in parts))))
    values = [buffers[part]["value",] for part in parts if ("value",) in buffers.get(part, {})]
    sources = (f"data:image/png;base64,{value['data'].strip()}" for value in values)
    images = "".join(f'<img alt="{settings}" src="{source}">' for source in sources)
    words = f"In the live notebook, controls move this. Here: {settings}."
    return f'<p class="still">{words}</p>{images}'


def descendants(states, name):
    """Names of a widget and of everything inside it, in order."""
    yield name
    for child in states[name].get("children", []):
        yield from descendants(states, child.removeprefix("IPY_MODEL_"))


def setting(state):
    """What a control is called and where it stands; nothing for what stands nowhere (a button).

    >>> setting({"description": "x [m]", "value": 1.3})
    'x [m] = 1.3'
    """
    value = state.get("value")
    if "_options_labels" in state:
        value = state["_options_labels"][state["index"]]
    if not state.get("description") or value is None:
        return None
    return f"{state['description']} = {value}"


class Page(HTMLParser):
    """What a page of HTML links to, and the anchors that it offers."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        """Note the links and the anchors of one tag."""
        values = dict(attrs)
        self.links += [values[key] for key in ("href", "src") if values.get(key)]
        self.anchors |= {values.get("id"), values.get("name")}


def dead_links(folder):
    """Links that lead nowhere, each after its page; of addresses elsewhere the form is judged."""
    pages = {path: Page(path) for path in sorted(folder.resolve().rglob("*.html"))}
    for path, page in pages.items():
        for link in page.links:
            if not leads_somewhere(link, path, pages):
                yield f"{path.relative_to(folder.resolve())}: {link}"


def leads_somewhere(link, path, pages):
    """Whether the file of a link exists and has its anchor."""
    address = urlsplit(link)
    if address.scheme in ("http", "https"):
        return "." in address.netloc
    if address.scheme:
        return address.scheme in ("data", "mailto")
    target = (path.parent / unquote(address.path)).resolve() if address.path else path
    if not address.fragment:
        return target.is_file()
    return target in pages and unquote(address.fragment) in pages[target].anchors


if __name__ == "__main__":
    sys.exit(main())
