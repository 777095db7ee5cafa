"""The gallery page: complete, in step with the numbers, and readable."""

import json
import re
from dataclasses import replace

import pytest
from places import ROOT

from dollop.replication import figures, gallery
from dollop.replication.figures import FIGURES

FOLDER = ROOT / "figures"
METRICS = json.loads((FOLDER / "metrics.json").read_text())


def test_every_panel_has_a_caption_and_a_look_in_the_papers_order():
    """No panel is without a caption or a look; they are in the order of metrics.json."""
    assert list(FIGURES) == list(METRICS)
    for panel in FIGURES.values():
        assert panel.caption.endswith(".") and panel.look.endswith("."), panel.id


def test_the_committed_page_carries_the_committed_numbers():
    """figures/README.md is what metrics.json and the captions make: numbers never drift."""
    assert (FOLDER / "README.md").read_text() == gallery.page(FIGURES.values(), METRICS)


def test_every_picture_on_the_page_exists():
    """No link of the gallery is broken."""
    page = gallery.page(FIGURES.values(), METRICS)
    for panel in FIGURES.values():
        assert f"]({panel.picture})" in page
        assert (FOLDER / panel.picture).exists()


def test_every_drawing_has_its_pdf_on_the_page():
    """Linked below the picture; what is nothing but pixels has none."""
    page = gallery.page(FIGURES.values(), METRICS)
    printed = {panel.printed for panel in FIGURES.values() if panel.printed}
    assert set(re.findall(r"\((fig_\w+\.pdf)\)", page)) == printed == {path.name for path in FOLDER.glob("*.pdf")}


def test_captions_carry_no_measured_numbers():
    """Millimetres beside a panel come from metrics.json, save for what the paper reports."""
    for panel in FIGURES.values():
        text = panel.caption + panel.look.replace("The paper: 6 LDS, 20 mm on average.", "")
        assert " mm" not in text, panel.id


def test_the_page_opens_with_a_table_that_has_a_row_and_a_link_for_every_panel():
    """Before the first picture, in the order of the paper, each linked to its section."""
    page = gallery.page(FIGURES.values(), METRICS)
    table = page[: page.index("\n## ")]
    linked = re.findall(r"^\| \[(\w+)\]\(#figure-(\w+)\) \|", table, re.MULTILINE)
    assert linked == [(id, id) for id in METRICS]
    assert all(f"\n## Figure {id}\n" in page for id in METRICS)


def test_the_table_has_its_numbers_from_the_file():
    """Every number that a line names is in metrics.json, and is written as on the rest of the page."""
    for id, (_, _, here) in gallery.IN_ONE_LINE.items():
        assert {name for name, _ in gallery.NUMBER.findall(here)} <= METRICS[id].keys(), id
    numbers = {"n_segments": 7, "mean_error_m": 0.0304, "mean_error_laps_m": 1.2}
    numbers |= {"paper_mean_error_m": 0.001, "paper_mean_error_laps_m": 0.002}
    row = gallery.row(FIGURES["6b"], numbers)
    assert "| 7 LDS, 30 mm to the laps' mean, 1.20 m to the single laps; 1 mm and 2 mm with" in row
    assert gallery.NUMBER.sub(lambda found: gallery.amount(found, {"a": 0.456}, {}), "{a%}") == "46 %"


def test_the_tables_own_words_carry_no_measured_numbers():
    """Digits in them are those of names, of what the paper reports, and of settings."""
    said = ("Pioneer 2 DX", "LMS 200", "6 LDS, 20 mm", "by 5 cm", "8 to 15 subgoals")
    for id, words in gallery.IN_ONE_LINE.items():
        text = gallery.NUMBER.sub("", " ".join(words))
        for setting in said:
            text = text.replace(setting, "")
        assert not re.search("[0-9]", text), id


def test_a_panel_that_is_in_no_line_has_its_caption_there():
    """A figure that somebody adds is on the page before it has words, and one without its numbers says none."""
    panel = replace(FIGURES["6b"], id="x99")
    assert gallery.row(panel, {}) == f"| [x99](#figure-x99) | {panel.caption.rstrip('.')} | – | – |"
    assert gallery.row(FIGURES["6b"], {}).endswith("| 6 LDS, 20 mm | – |")


def test_panels_without_numbers_are_left_out():
    """Made alone, one figure gives a gallery of one."""
    page = gallery.page(FIGURES.values(), {"6b": {"mean_error_m": 0.013}})
    assert page.count("## Figure") == 1
    assert "| mean error of the law | 13 mm |" in page


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (0.010436, "m", "10 mm"),
        (-0.02, "m", "-20 mm"),
        (0.1469, "°", "0.1 °"),
        (28268.0, "", "28268"),
        (0.0, "", "0"),
        (-0.50875, "", "-0.509"),
        (10, "", "10"),
        ([4, 5], "", "4 5"),
        (None, "s", "none"),
    ],
)
def test_a_number_is_written_with_its_unit(value, unit, expected):
    """Metres below one become millimetres, the rest keeps its unit; counts stay whole.

    What never happened is none.
    """
    assert gallery.quantity(value, unit) == expected


def test_every_number_has_words_and_the_unit_that_its_name_ends_in():
    """No key of metrics.json is without words, or in a unit that is not what it says."""
    units = {"m": "m", "s": "s", "deg": "°", "percent": "%"}
    for panel, numbers in METRICS.items():
        for key in numbers:
            name = gallery.name_of(key, FIGURES[panel].columns)
            said = [units[word] for word in name.split("_")[1:] if word in units]
            assert said == [unit for unit in [gallery.NAMES[name][1]] if unit], key


def test_no_words_are_for_nothing():
    """Every name is that of a number, every column has numbers, and no two names read alike."""
    used = set()
    for panel in FIGURES.values():
        keys = METRICS[panel.id]
        used |= {gallery.name_of(key, panel.columns) for key in keys}
        for column in panel.columns.keys() - {"robust", "people", "held"}:  # the default's have no beginning
            assert any(key.startswith(f"{column}_") for key in keys), (panel.id, column)
    assert used == set(gallery.NAMES)
    assert len({words for words, _ in gallery.NAMES.values()}) == len(gallery.NAMES)


def test_a_number_without_words_is_refused():
    """The page is not made with a bare key in it."""
    with pytest.raises(KeyError, match="no words for the number 'bumps'"):
        gallery.page(FIGURES.values(), {"7a": {"bumps": 3}})


def test_main_writes_the_gallery_beside_the_pictures(tmp_path, monkeypatch):
    """The figure script leaves a page with the figures it made, in the order of the paper."""
    monkeypatch.setattr(figures, "make", lambda panel, folder: {})
    figures.main(["x1", "7a", "--folder", str(tmp_path)])
    page = (tmp_path / "README.md").read_text()
    assert page.index("## Figure 7a") < page.index("## Figure x1")
