"""The book: notebooks executed, and laid out with gallery and API as HTML pages in build/book.

    python book/build.py

A page that warns, a link that leads nowhere, a picture without words and too many bytes fail the build.
Nothing is fetched when building or reading: formulas become MathML, films are files of the book.
"""

import ast
import inspect
import os
import re
import shutil
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import nbformat
from executed import execute, make_readable
from faults import Page, faults, size
from sphinx.cmd.build import main as sphinx
from tqdm import tqdm

import dollop

ROOT = Path(__file__).resolve().parents[1]
SOURCE, OUT = ROOT / "build" / "book-source", ROOT / "build" / "book"
LARGEST = 40  # MB of the whole book
PAGES = (
    *("README.md", "REPLICATION.md", "CLAIMS.md", "CHANGELOG.md", "CONTRIBUTING.md"),
    *("figures/README.md", "data/README.md"),
    *(path.relative_to(ROOT).as_posix() for path in sorted(ROOT.glob("films/*.md"))),
    *(f"book/{path.name}" for path in sorted(ROOT.glob("book/*.md")) if path.stem not in ("index", "package")),
)
PUBLIC = [name for name in dollop.__all__ if name != "__version__"]
FILE_LINK = re.compile(r'(?:\]\(|src="|href=")([\w./-]+)(?=[)"# ])')
CODE_LINK = re.compile(r"\]\((?P<up>(\.\./)*)(?P<path>dollop/[\w/]+)\.py\)")
NAME = re.compile(r"(?<![`\[])`dollop\.(?P<name>(?P<first>\w+)[\w.]*)`(?![`\]])")
GLOB = re.compile(r"(?m)^([\w/]+\*)\n")
"""Pages of the first one's contents that may be missing, as the films are before `make films`."""
FILMS = (".mp4", ".webm", ".webp", ".gif", ".png", ".jpg")
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
    """HTML of the sources; a warning of Sphinx is an error, and so is what is wrong with a page."""
    shutil.rmtree(OUT, ignore_errors=True)
    options = ["-q", "-W", "--keep-going", "-j", "auto", "-c", str(ROOT / "book")]
    if failed := sphinx([*options, "-d", str(SOURCE / ".doctrees"), str(SOURCE), str(OUT)]):
        return failed
    bring_films(OUT)
    found = list(faults(OUT, LARGEST))
    for fault in found:
        print(fault, file=sys.stderr)
    if not found:
        print(f"wrote the book, {size(OUT):.1f} MB: open {os.path.relpath(OUT)}/index.html")
    return len(found) > 0


def bring_films(folder, project=ROOT):
    """Copy the films and pictures that tags of HTML ask for: Sphinx follows links of Markdown alone."""
    for path in sorted(folder.rglob("*.html")):
        for link in Page(path).links:
            wanted = Path(os.path.normpath(path.parent / unquote(urlsplit(link).path)))
            if wanted.suffix in FILMS and wanted.is_relative_to(folder) and not wanted.exists():
                original = project / wanted.relative_to(folder)
                if original.is_file():
                    wanted.parent.mkdir(parents=True, exist_ok=True)
                    shutil.copy(original, wanted)


def gather():
    """A fresh folder of sources: pages in Markdown, every file that they link to, and the API."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    (SOURCE / "notebooks").mkdir(parents=True)
    write_api(SOURCE / "api")
    texts = {SOURCE / page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
    first = (ROOT / "book" / "index.md").read_text(encoding="utf-8")
    texts[SOURCE / "index.md"] = GLOB.sub(lambda found: found[0] if any(ROOT.glob(found[1])) else "", first)
    for page, text in texts.items():
        page.parent.mkdir(exist_ok=True)
        page.write_text(linked(text), encoding="utf-8")
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


@cache
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
    """Execute one notebook, and keep the result among the sources, fit to be read."""
    notebook = execute(path)
    make_readable(notebook, linked)
    nbformat.write(notebook, SOURCE / "notebooks" / path.name)


def linked(text):
    """Markdown with links to the API: for sources of modules, and for names that begin with dollop."""
    return NAME.sub(link_to_name, CODE_LINK.sub(link_to_api, text))


def link_to_name(found):
    """A name in the prose as a link to its entry in the API; other code stays as it is.

    >>> NAME.sub(link_to_name, "`dollop.observe` of `dollop.lab` by `dollop.plot`")
    '{py:obj}`dollop.observe <dollop.observation.observe>` of {py:mod}`dollop.lab` by {py:mod}`dollop.plot`'
    >>> NAME.sub(link_to_name, "`dollop.lab.Pioneer`, `dollop.json`")
    '{py:obj}`dollop.lab.Pioneer`, `dollop.json`'
    """
    name = f"dollop.{found['name']}"
    if found["first"] in PUBLIC:
        return f"{{py:obj}}`{name} <{home(found['name'])}>`"
    if name in modules():
        return f"{{py:mod}}`{name}`"
    return f"{{py:obj}}`{name}`" if f"dollop.{found['first']}" in modules() else found[0]


if __name__ == "__main__":
    sys.exit(main())
