"""The book: widgets become stills, every module has its page, and no link is dead."""

import re
import runpy
from types import SimpleNamespace

import pytest
from places import ROOT

import dollop

pytest.importorskip("sphinx", reason='the book needs the extra "book"')
build = SimpleNamespace(**runpy.run_path(str(ROOT / "book" / "build.py")))

NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
STATES = {
    "box": {"children": ["IPY_MODEL_slider", "IPY_MODEL_image"]},
    "slider": {"description": "x < y", "_options_labels": ["5 mm", "20 mm"], "index": 1},
    "image": {"format": "png"},
}
VALUE = {"data": "cGljdHVyZQ==\n", "encoding": "base64", "path": ["value"]}
BUFFERS = {"image": {("value",): VALUE}}


def test_a_widget_becomes_a_picture_with_its_settings():
    """What a slider stands at is said, escaped, and its picture is embedded."""
    still = build.still(STATES, BUFFERS, "box")
    assert "Here: x &lt; y = 20 mm." in still
    assert 'src="data:image/png;base64,cGljdHVyZQ=="' in still


def test_a_figure_that_can_be_clicked_into_is_its_own_still():
    """Of a live figure the picture stays, and nothing that would need a kernel."""
    data = {build.WIDGET: {"model_id": "canvas"}, "image/png": "cGlj", "text/html": "<img>"}
    output = SimpleNamespace(data=data, get=lambda key, default: data)
    build.freeze_widgets({"outputs": [output]}, client=None)
    assert output.data == {"image/png": "cGlj"}


def test_everything_inside_a_widget_is_found_in_order():
    """Children come after their parent."""
    assert list(build.descendants(STATES, "box")) == ["box", "slider", "image"]


def test_what_is_no_control_has_no_setting():
    """A picture, a box or a button is not named among the settings."""
    assert build.setting(STATES["image"]) is None
    assert build.setting({"description": "kidnap the robot"}) is None
    assert build.setting({"description": "x [m]", "value": 1.3}) == "x [m] = 1.3"


def test_every_formula_of_the_notebooks_can_be_drawn():
    """The converter to MathML knows every command that the notebooks use."""
    tex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    for path in NOTEBOOKS:
        for formula in re.findall(r"\$\$([^$]+)\$\$", prose_of(path)):
            assert "<math" in tex2mathml(formula, as_block=True), (path.name, formula)


def prose_of(path):
    """The Markdown of a notebook."""
    cells = build.nbformat.read(path, 4).cells
    return "\n".join(cell.source for cell in cells if cell.cell_type == "markdown")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_notebook_names_what_the_api_explains(path):
    """The prose of each notebook has a public name at least once, and none that does not exist."""
    names = [found["first"] for found in build.NAME.finditer(prose_of(path))]
    assert set(names) & set(build.PUBLIC)
    assert all(hasattr(dollop, name) or f"dollop.{name}" in build.modules() for name in names)


def test_a_public_name_becomes_a_link_and_other_code_stays():
    """Links go to the module where a name is defined; a keyword or a module is no public name."""
    text = build.NAME.sub(build.link_to_name, "`dollop.LDS.fit`, `tolerance` and `dollop.plot`")
    linked = "{py:obj}`dollop.LDS.fit <dollop.lds.LDS.fit>`"
    assert text == f"{linked}, `tolerance` and `dollop.plot`"


def test_the_api_has_a_page_for_every_module_and_a_row_for_every_public_name(tmp_path):
    """Modules stand in the order of the paper, each with its first sentence."""
    build.write_api(tmp_path / "api")
    first = (tmp_path / "api" / "index.rst").read_text(encoding="utf-8")
    assert all(f"`dollop.{name} <" in first for name in build.PUBLIC)
    assert {path.stem for path in (tmp_path / "api").iterdir()} == {"index", *build.modules()}
    rows = re.findall(r"- :doc:`(\S+)`\n +- (.+)", first)
    assert dict(rows) == build.modules()
    order = [name for name, _ in rows]
    assert order.index("dollop.laser") < order.index("dollop.lds") < order.index("dollop.matching")
    assert order.index("dollop.matching") < order.index("dollop.cdhmm") < order.index("dollop.lab")


PAGES = {
    "index.html": """<a href="room/one.html#here">one</a> <a href="#top" id="top">up</a>
        <img src="data:image/png;base64,"> <img src="picture.png">""",
    "room/one.html": """<p id="here"><a href="../index.html?v=1">back</a>
        <a href="https://example.org/a#b">away</a></p>""",
}
DEAD = (
    *("room/two.html", "room/one.html#there", "#nowhere", "room", "picture.png#a"),
    *("https://", "ftp://example.org"),
)


@pytest.fixture
def small_book(tmp_path):
    """Two pages whose links all lead somewhere."""
    (tmp_path / "room").mkdir()
    (tmp_path / "picture.png").touch()
    for name, body in PAGES.items():
        (tmp_path / name).write_text(f"<html><body>{body}</body></html>")
    return tmp_path


def test_links_that_lead_somewhere_pass(small_book):
    """Files, anchors here and on other pages, embedded pictures and addresses elsewhere."""
    assert list(build.dead_links(small_book)) == []


@pytest.mark.parametrize("link", DEAD)
def test_a_link_that_leads_nowhere_is_told_with_its_page(small_book, link):
    """A missing file or anchor, a folder, and an address that cannot be one."""
    (small_book / "bad.html").write_text(f'<a href="{link}">')
    assert list(build.dead_links(small_book)) == [f"bad.html: {link}"]


def test_the_source_of_a_module_becomes_its_page():
    """A reader of the book is led to the API, not to a file of code."""
    text = "[a](../dollop/lab/__init__.py) [b](dollop/lds.py)"
    linked = "[a](../api/dollop.lab.rst) [b](api/dollop.lds.rst)"
    assert build.CODE_LINK.sub(build.link_to_api, text) == linked
