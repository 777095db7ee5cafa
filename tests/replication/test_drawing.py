"""What only figures and notebooks draw with: pictures to the pixel, one legend for many axes."""

import io

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from dollop import plot
from dollop.replication.drawing import JOURNAL, legend_below, lettered, order, outside, picture, png


def test_a_picture_has_exactly_its_pixels():
    """Saved as the figures are and read back, every pixel has the value it had."""
    image = np.random.default_rng(0).integers(0, 256, (30, 50, 3), dtype=np.uint8)
    figure = picture(image)
    with io.BytesIO() as stream:
        figure.savefig(stream, format="png", dpi=JOURNAL["savefig.dpi"])
        saved = np.asarray(Image.open(stream).convert("RGB"))
    plt.close(figure)
    np.testing.assert_array_equal(saved, image)


def test_png_is_a_picture_and_closes_the_figure():
    """A widget that is moved a hundred times leaves no figure open."""
    figure = plt.figure(figsize=(2, 1), dpi=50)
    assert Image.open(io.BytesIO(png(figure))).size == (100, 50)
    assert not plt.fignum_exists(figure.number)


def test_a_label_of_several_axes_stands_once():
    """The legend has all labels of the axes named, and none of the others."""
    figure, axes = plt.subplots(1, 3, layout="constrained")
    for ax, names in zip(axes, (["law", "user"], ["law", "robot"], ["truth"]), strict=True):
        for name in names:
            ax.plot([0, 1], [0, 1], label=name)
    legend_below(figure, *axes[:2])
    (legend,) = figure.legends
    assert sorted(text.get_text() for text in legend.get_texts()) == ["law", "robot", "user"]
    plt.close(figure)


def test_a_legend_is_no_wider_than_its_figure():
    """Of labels that do not fit into a row it has more rows, and all of them."""
    figure, ax = plt.subplots(figsize=(3.4, 2), layout="constrained")
    for k in range(6):
        ax.plot([0, 1], [0, k], label=f"one of a few long labels, {k}")
    legend_below(figure, ax)
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 6
    assert legend.get_window_extent().width <= figure.bbox.width
    plt.close(figure)


def test_axes_are_lettered_in_their_order():
    """(a), (b), ... each before its title."""
    figure, axes = plt.subplots(1, 3)
    lettered(axes, ("one", "two", "three"))
    assert [ax.get_title(loc="left") for ax in axes] == ["(a) one", "(b) two", "(c) three"]
    plt.close(figure)


def test_subgoals_are_numbered_from_one_where_they_are():
    """The start is marked, and every subgoal has its number beside it, on the outside of the bend."""
    figure, ax = plt.subplots()
    start, subgoals = (0.0, 0.0), np.array([(1.0, 1.0), (2.0, 0.0), (3.0, 0.0)])
    order(ax, start, subgoals)
    assert [text.get_text() for text in ax.texts] == ["1", "2", "3"]
    np.testing.assert_array_equal([text.xy for text in ax.texts], subgoals)
    assert ax.texts[0].xyann[1] > 0 > ax.texts[1].xyann[1]
    assert ax.get_legend_handles_labels()[1] == ["start", "subgoals, in order"]
    plt.close(figure)


def test_numbers_stand_a_unit_away_even_on_a_straight_way():
    """Subgoals in a row, and one alone, have a side as well."""
    for subgoals in ([(1.0, 0.0), (2.0, 0.0)], [(1.0, 0.0)], [(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)]):
        away = outside((0.0, 0.0), np.array(subgoals))
        assert np.isfinite(away).all() and (np.linalg.norm(away, axis=1) <= 1 + 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(outside((0, 0), np.array([(1.0, 0.0), (2.0, 0.0)])), axis=1), 1)


def test_lines_and_markers_are_thinner_with_the_style():
    """What is drawn for a column is as wide against its type as what is drawn for the screen."""
    widths = {}
    for name, style in (("screen", plot.STYLE), ("journal", JOURNAL)):
        with plt.rc_context(style):
            figure, ax = plt.subplots()
            plot.law(ax, [[0, 0], [1, 2]])
            plot.subgoals(ax, [[1, 2]])
            widths[name] = [ax.lines[0].get_linewidth(), ax.lines[1].get_markersize()]
            plt.close(figure)
    assert widths["screen"] == [2, 9]
    np.testing.assert_allclose(widths["journal"], np.multiply(widths["screen"], 0.6))


def test_a_notebook_shows_all_of_a_picture():
    """Drawn with the figure's own resolution, as a notebook does, nothing is cut off."""
    image = np.random.default_rng(0).integers(0, 256, (30, 50, 3), dtype=np.uint8)
    with plt.rc_context(JOURNAL), io.BytesIO() as stream:
        figure = picture(image)
        figure.savefig(stream, format="png", dpi=figure.dpi)
        saved = np.asarray(Image.open(stream).convert("RGB"))
        plt.close(figure)
    np.testing.assert_array_equal(saved, image)
