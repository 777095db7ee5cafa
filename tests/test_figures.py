"""The figure script: fresh numbers agree with the committed ones, and bad calls end with a message."""

import json
from pathlib import Path

import pytest

from dollop import figures

COMMITTED = json.loads((Path(__file__).parents[1] / "figures" / "metrics.json").read_text())


def test_every_panel_is_committed():
    """Each figure has its picture and its entry in metrics.json."""
    folder = Path(figures.__file__).parents[1] / "figures"
    for panel in figures.FIGURES:
        assert panel in COMMITTED
        assert (folder / figures.name_of(panel)).stat().st_size > 5_000


@pytest.mark.parametrize("panel", ["3", "6a", "6b"])
def test_fresh_numbers_equal_the_committed_ones(panel, tmp_path):
    """Simulated anew from the seed, a panel's numbers are those of metrics.json."""
    pytest.importorskip("pybullet")
    assert figures.make(panel, tmp_path) == pytest.approx(COMMITTED[panel], rel=0.02)
    assert (tmp_path / figures.name_of(panel)).exists()


def test_the_same_figure_twice_is_the_same_file(tmp_path):
    """PNGs are byte-identical on one machine."""
    pytest.importorskip("pybullet")
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        folder.mkdir()
        figures.make("6b", folder)
    assert (first / "fig_06b.png").read_bytes() == (second / "fig_06b.png").read_bytes()


def test_the_headline_numbers_are_in_their_bands():
    """Fig. 6: the track within 60 mm, 5 to 7 segments, at most 20 mm."""
    assert COMMITTED["6a"]["track_error_mean_m"] < 0.060
    assert 5 <= COMMITTED["6b"]["n_segments"] <= 7
    assert COMMITTED["6b"]["mean_error_m"] <= 0.020


def test_unknown_figures_are_named_with_the_known_ones(capsys):
    """An unknown id lists what there is."""
    with pytest.raises(SystemExit):
        figures.main(["99"])
    assert "no figure 99; known: 1, 2" in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_said_before_the_work(tmp_path, capsys):
    """A file in the folder's place ends the call with a message, not a traceback."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(SystemExit):
        figures.main(["6b", "--folder", str(tmp_path / "taken")])
    assert "taken" in capsys.readouterr().err
