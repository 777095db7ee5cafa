"""The book: widgets become stills, and every page of the project is in it."""

import re
import runpy
from types import SimpleNamespace

import pytest
from places import ROOT

pytest.importorskip("sphinx", reason='the book needs the extra "book"')
build = SimpleNamespace(**runpy.run_path(str(ROOT / "book" / "build.py")))

STATES = {
    "box": {"children": ["IPY_MODEL_slider", "IPY_MODEL_image"]},
    "slider": {"description": "x < y", "_options_labels": ["5 mm", "20 mm"], "index": 1},
    "image": {"format": "png"},
}
BUFFERS = {"image": {("value",): {"data": "cGljdHVyZQ==\n", "encoding": "base64", "path": ["value"]}}}


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
    nbformat = pytest.importorskip("nbformat")
    tex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    for path in sorted((ROOT / "notebooks").glob("[0-9]*.ipynb")):
        prose = "\n".join(c.source for c in nbformat.read(path, 4).cells if c.cell_type == "markdown")
        for formula in re.findall(r"\$\$([^$]+)\$\$", prose):
            assert "<math" in tex2mathml(formula, as_block=True), (path.name, formula)
