"""What the replication's figures and notebooks alone draw with, beside `dollop.plot`."""

import io

import matplotlib.pyplot as plt

from dollop.plot import STYLE

__all__ = ["FORCE", "METHODS", "SPRING", "legend_below", "picture", "png"]

SPRING = "#8296A8"  # slate: springs between corners
FORCE = "#EE3377"  # magenta: the forces that they exert

METHODS = {
    "literal": "#999933",  # olive: the paper's matching
    "robust": "#332288",  # indigo: what Dollop does by default, here ...
    "merging": "#332288",  # ... and here
    "plain mean": "#5F6B73",
    "HMM, BIC": "#661100",  # browns: the two hidden Markov models
    "left-to-right HMM, BIC": "#BF8B5E",
}
"""Colours of the methods that are compared, by their names in `dollop.match` and
`dollop.replication.baseline`.
"""


def picture(image):
    """A rendered image (H, W, 3) as a figure of exactly its pixels."""
    height, width = image.shape[:2]
    dpi = STYLE["savefig.dpi"]
    figure = plt.figure(figsize=(width / dpi, height / dpi), layout="none")
    figure.figimage(image, resize=False)
    return figure


def png(figure):
    """A figure as PNG bytes, for an `ipywidgets.Image`; the figure is closed."""
    with io.BytesIO() as stream:
        figure.savefig(stream, format="png", dpi=figure.dpi)
        plt.close(figure)
        return stream.getvalue()


def legend_below(figure, *axes, columns=6):
    """One legend for what is drawn in the axes named, under the whole figure."""
    shown = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        shown = dict(zip(labels, handles, strict=True)) | shown
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=columns, columnspacing=1.0)
