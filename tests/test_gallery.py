"""The gallery page: complete, in step with the numbers, and readable."""

import json
from pathlib import Path

import pytest

from dollop import figures, gallery

FOLDER = Path(figures.__file__).parents[1] / "figures"
METRICS = json.loads((FOLDER / "metrics.json").read_text())


def test_every_figure_is_in_the_gallery_in_the_same_order():
    """A figure without a caption cannot be added."""
    assert list(gallery.PANELS) == list(figures.FIGURES)


def test_the_committed_page_carries_the_committed_numbers():
    """figures/README.md is what metrics.json and the captions make: numbers never drift."""
    assert (FOLDER / "README.md").read_text() == gallery.page(METRICS, figures.name_of)


def test_every_picture_on_the_page_exists():
    """No link of the gallery is broken."""
    page = gallery.page(METRICS, figures.name_of)
    for panel in METRICS:
        assert f"]({figures.name_of(panel)})" in page
        assert (FOLDER / figures.name_of(panel)).exists()


def test_captions_carry_no_measured_numbers():
    """A length in millimetres beside a panel comes from metrics.json, save for what the paper itself reports."""
    for panel, words in gallery.PANELS.items():
        text = words.caption + words.look.replace("The paper: 6 LDS, 20 mm on average.", "")
        assert " mm" not in text, panel


def test_panels_without_numbers_are_left_out():
    """Made alone, one figure gives a gallery of one."""
    page = gallery.page({"6b": {"mean_error_m": 0.013}}, figures.name_of)
    assert page.count("## Figure") == 1
    assert "| mean error | 13 mm |" in page


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("mean_distance_m_pursuit", 0.010436, "10 mm"),
        ("min_clearance_m", -0.02, "-20 mm"),
        ("localisation_error_deg", 0.1469, "0.1 °"),
        ("cost_literal", 28268.0, "28268"),
        ("share", 0.0, "0"),
        ("exponent_merging", -0.50875, "-0.509"),
        ("finished", 10, "10"),
        ("indices", [4, 5], "4 5"),
        ("return_time_s", None, "none"),
    ],
)
def test_a_number_is_written_with_the_unit_of_its_key(key, value, expected):
    """Metres below one become millimetres, the rest keeps its unit; counts stay whole; what never happened is none."""
    assert gallery.quantity(key, value) == expected


def test_main_writes_the_gallery_beside_the_pictures(tmp_path, monkeypatch):
    """The figure script leaves a page with the figures it made, in the order of the paper."""
    monkeypatch.setattr(figures, "make", lambda panel, folder: {"runs": len(panel)})
    figures.main(["x1", "7a", "--folder", str(tmp_path)])
    page = (tmp_path / "README.md").read_text()
    assert page.index("## Figure 7a") < page.index("## Figure x1")
