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
    "ergodic HMM": "#661100",  # browns: the two hidden Markov models
    "left-to-right HMM": "#BF8B5E",
    "anchored": "#332288",  # ways of learning: Dollop's default, the paper's ...
    "paper": "#999933",
    "TP-GMM": "#661100",  # ... and other people's
    "ProMP": "#BF8B5E",
    "DMP": "#5F6B73",
}
"""Colours of the methods that are compared, by their names in `dollop.match`,
`dollop.learn`, `dollop.replication.baseline` and `dollop.replication.peers`.
"""


def picture(image):
    """A rendered image as a figure of exactly its pixels.

    Parameters
    ----------
    image : (H, W, 3) array

    Returns
    -------
    matplotlib.figure.Figure
    """
    height, width = image.shape[:2]
    dpi = STYLE["savefig.dpi"]
    figure = plt.figure(figsize=(width / dpi, height / dpi), dpi=dpi, layout="none")
    figure.figimage(image, resize=False)
    figure.add_axes((0, 0, 1, 1)).set_axis_off()  # a notebook takes what has no axes for empty
    return figure


def png(figure):
    """A figure as PNG, for an `ipywidgets.Image`; the figure is closed.

    Parameters
    ----------
    figure : matplotlib.figure.Figure

    Returns
    -------
    bytes
    """
    with io.BytesIO() as stream:
        figure.savefig(stream, format="png", dpi=figure.dpi)
        plt.close(figure)
        return stream.getvalue()


def legend_below(figure, *axes, columns=6):
    """One legend under a whole figure, where a label that several axes have stands once.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    *axes : matplotlib.axes.Axes
        Those whose labels it has.
    columns : int
        At most so many in a row.
    """
    shown = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        shown = dict(zip(labels, handles, strict=True)) | shown
    look = {"loc": "outside lower center", "ncols": columns, "columnspacing": 1.0}
    figure.legend(shown.values(), shown.keys(), **look)
