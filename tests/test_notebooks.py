"""The notebooks: exercises with tested solutions, the paper's panels each once, and one style of cells."""

import ast
import base64
import io
import json
import re
from collections import Counter
from itertools import pairwise
from statistics import median
from symtable import symtable

import pytest
from places import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
EACH = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
PAPER = ("1", "2", "3", "4", "5", "6a", "6b", "7a", "7b", "8", "9", "10a", "10b", "11a", "11b", "12a", "12b")
"""The paper's panels."""

SOLUTION = re.compile(r"# Solution of ((\d\d)\.(\d+)): \w")
LONGEST = 12
"""Lines of code in a cell, blank ones aside."""

LONGER = {"06_environment_matching.ipynb": 14, "08_learning_the_task.ipynb": 13}
"""What was longer before, and may not grow."""

WORDS = 8, 14
"""Of prose for each line of code, in a notebook."""

WORDS_OF_OVERVIEW = 8, 17
"""It is the book's front page, and introduces all the others."""


def cells_of(path):
    """The cells of a notebook."""
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def text_of(cell):
    """What stands in a cell."""
    return "".join(cell["source"])


def code_of(path):
    """Text of every cell of code; of what is no Python (a % command), nothing."""
    texts = (text_of(cell) for cell in cells_of(path) if cell["cell_type"] == "code")
    return ["\n".join(line for line in text.splitlines() if not line.startswith("%")) for text in texts]


def lines_of(text):
    """How many lines of a text are not blank."""
    return sum(bool(line.strip()) for line in text.splitlines())


def solutions_of(path):
    """(cell before, cell) of every solution of a notebook."""
    return [(before, cell) for before, cell in pairwise(cells_of(path)) if SOLUTION.match(text_of(cell))]


# ---- exercises


@EACH
def test_every_notebook_has_three_exercises_at_least(path):
    """They stand under a heading, are numbered from 1, and right below each is its solution."""
    numbers = [SOLUTION.match(text_of(cell)) for _, cell in solutions_of(path)]
    assert [int(number[3]) for number in numbers] == list(range(1, len(numbers) + 1)) and len(numbers) >= 3
    assert {number[2] for number in numbers} == {path.name[:2]}
    for number, (question, _) in zip(numbers, solutions_of(path), strict=True):
        assert question["cell_type"] == "markdown" and f"**{number[1]}**" in text_of(question)
    texts = "\n\n".join(text_of(cell) for cell in cells_of(path) if cell["cell_type"] == "markdown")
    before, *asked = re.split(r"(?m)^\*\*\d\d\.\d+\*\*", texts)
    assert len(asked) == len(numbers) and before.count("## Exercises\n") == 1


@EACH
def test_a_solution_is_folded_and_ends_in_what_it_claims(path):
    """Whoever wants to think first does not see it; Run All tests it, for it ends in an assert."""
    for _, cell in solutions_of(path):
        assert "hide-cell" in cell["metadata"]["tags"] and cell["metadata"]["jupyter"] == {"source_hidden": True}
        *_, last = ast.parse(text_of(cell)).body
        inside = last.body[-1] if isinstance(last, ast.For) else last
        assert isinstance(inside, ast.Assert), text_of(cell)


def bound_by(text):
    """Names that a cell gives a value to at its top level: what runs after it may find them changed."""
    return {name.get_name() for name in symtable(text, "cell", "exec").get_symbols() if name.is_assigned()}


@EACH
def test_a_solution_changes_no_name_of_the_notebook(path):
    """A picture, a toy or a check is what it would be without the exercises."""
    solutions = [text_of(cell) for _, cell in solutions_of(path)]
    others = set().union(*(bound_by(text) for text in code_of(path) if text not in solutions))
    for text in solutions:
        assert not bound_by(text) & others, text


def test_there_are_three_exercises_for_each_of_eleven_notebooks():
    """33 in all, at least."""
    assert sum(len(solutions_of(path)) for path in NOTEBOOKS) >= 33


# ---- the paper's panels


def shown_by(text):
    """Ids of the panels that a cell shows: by name, or in a loop over names that stand in the cell."""
    tree = list(ast.walk(ast.parse(text)))
    calls = [node for node in tree if isinstance(node, ast.Call) and ast.unparse(node.func) == "figures.show"]
    names = [node.args[0].value for node in calls if isinstance(node.args[0], ast.Constant)]
    if len(names) < len(calls):
        return [each.value for each in tree if isinstance(each, ast.Constant) and each.value in PAPER]
    return names


def test_a_shown_panel_is_found_by_name_or_in_a_loop():
    """What a test looks for it must be able to see."""
    assert shown_by('panels = {"6a": figures.show("6a")}') == ["6a"]
    assert shown_by('panels = {id: figures.show(id) for id in ("8", "9")}') == ["8", "9"]
    assert shown_by('figures.differences("8", {}, "../figures")') == []


def test_every_panel_of_the_paper_is_shown_by_one_notebook():
    """All seventeen, none twice."""
    shown = Counter(id for path in NOTEBOOKS for text in code_of(path) for id in shown_by(text))
    assert {id: shown[id] for id in PAPER} == dict.fromkeys(PAPER, 1)


@EACH
def test_what_a_notebook_shows_it_compares_with_the_committed_numbers(path):
    """Each panel's numbers go into `panels`; a later cell asserts that all of them are those of metrics.json."""
    cells = code_of(path)
    showing = [k for k, text in enumerate(cells) if shown_by(text)]
    assert all("panels" in bound_by(cells[k]) or re.search(r"(?m)^\s*panels\[", cells[k]) for k in showing)
    comparing = [k for k, text in enumerate(cells) if compares_all(text)]
    assert not showing or max(showing) < max(comparing, default=-1)


def compares_all(text):
    """Whether a cell asserts, for all in `panels`, that their numbers do not differ."""
    loops = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.For)]
    inside = [each for loop in loops if ast.unparse(loop.iter) == "panels.items()" for each in loop.body]
    return any(ast.unparse(each).startswith("assert not figures.differences(") for each in inside)


# ---- how a panel comes into a notebook


def pictures_of(*cells):
    """What a notebook of these cells of code shows: for each the sizes in pixels of its pictures."""
    nbformat = pytest.importorskip("nbformat", reason='running a notebook needs the extra "dev"')
    nbclient = pytest.importorskip("nbclient", reason='running a notebook needs the extra "dev"')
    image = pytest.importorskip("PIL.Image")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in cells])
    nbclient.NotebookClient(notebook, resources={"metadata": {"path": str(ROOT)}}).execute()
    data = [[output.get("data", {}) for output in cell.outputs] for cell in notebook.cells]
    pngs = [[each["image/png"] for each in outputs if "image/png" in each] for outputs in data]
    return [[image.open(io.BytesIO(base64.b64decode(png))).size for png in shown] for shown in pngs]


@pytest.fixture(scope="module")
def inline():
    """Pictures of a notebook that draws inline, where nothing else is asked for: a panel, a line, a rendering.

    The panel comes first; before the last, which is rendered, a figure was drawn into.
    """
    pytest.importorskip("pybullet", reason="figures.show needs the extra lab")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MPLBACKEND", raising=False)
        patch.setenv("PYTHONPATH", str(ROOT))
        return pictures_of(
            'from dollop.replication import figures\nnumbers = figures.show("2")',
            "import matplotlib.pyplot as plt\nplt.plot([1, 2])",
            "import numpy as np\nplt.figure()\nplt.close()\n"
            "from dollop.replication import drawing\nfigure = drawing.picture(np.zeros((300, 400, 3), np.uint8))",
        )


@pytest.mark.replication
def test_a_panel_is_seen_where_nothing_was_drawn_before(inline):
    """And so is what a reader draws after it."""
    panel, line, _ = inline
    assert len(panel) == len(line) == 1


@pytest.mark.replication
def test_a_rendered_picture_is_seen_whole(inline):
    """It has no axes that anybody drew into, and is not taken for empty; nothing of it is cut off."""
    *_, (size,) = inline
    assert size[0] >= 400 and size[1] >= 300


@pytest.mark.replication
def test_what_is_drawn_after_the_room_is_seen(monkeypatch):
    """The room of notebook 11 shows itself as a picture, and a picture that a reader draws after it is shown."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    pytest.importorskip("ipympl", reason="a room that hears the mouse needs the extra notebooks")
    monkeypatch.delenv("MPLBACKEND", raising=False)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    room, line = pictures_of(
        "import dollop\nfrom dollop.replication.teaching.classroom import Classroom\n"
        'room = Classroom(dollop.OccupancyGrid.load("data/lab.yaml"))\nroom.figure.canvas',
        "import matplotlib.pyplot as plt\nplt.plot([1, 2])",
    )
    assert len(room) == len(line) == 1


# ---- style


@EACH
def test_cells_have_names_of_their_own(path):
    """An id is not used twice, which would mix up what is kept of two cells."""
    ids = Counter(cell["id"] for cell in cells_of(path))
    assert max(ids.values()) == 1


@EACH
def test_cells_are_short(path):
    """A dozen lines at most, three to five in the median: what is longer is in the package."""
    lengths = [lines_of(text) for text in code_of(path)]
    assert max(lengths) <= LONGER.get(path.name, LONGEST)
    assert 3 <= median(lengths) <= 5


@EACH
def test_there_is_a_sentence_for_a_line(path):
    """Words of prose for each line of code; tables, headings and formulas are neither."""
    text = "\n".join(text_of(cell) for cell in cells_of(path) if cell["cell_type"] == "markdown")
    text = re.sub(r"(?s)\$\$.*?\$\$", "", text)
    words = sum(len(line.split()) for line in text.splitlines() if not line.startswith(("|", "#")))
    least, most = WORDS_OF_OVERVIEW if path.name.startswith("00") else WORDS
    assert least <= words / sum(map(lines_of, code_of(path))) <= most
