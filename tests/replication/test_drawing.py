"""What only figures and notebooks draw with: pictures to the pixel, one legend for many axes."""

import io

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from dollop.plot import STYLE
from dollop.replication.drawing import legend_below, picture, png


def test_a_picture_has_exactly_its_pixels():
    """Saved as the figures are and read back, every pixel has the value it had."""
    image = np.random.default_rng(0).integers(0, 256, (30, 50, 3), dtype=np.uint8)
    figure = picture(image)
    with io.BytesIO() as stream:
        figure.savefig(stream, format="png", dpi=STYLE["savefig.dpi"])
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
