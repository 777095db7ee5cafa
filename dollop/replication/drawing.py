"""What the replication's figures and notebooks alone draw with, beside `dollop.plot`."""

import io
from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np

from dollop import plot
from dollop.plot import STYLE

__all__ = [
    "FORCE", "JOURNAL", "METHODS", "RESPONSES", "SPRING", "WIDTH", "journal", "legend_below",
    "lettered", "order", "outside", "picture", "png", "write",
]  # fmt: skip

WIDTH = 3.4
"""Inches: a column of a journal, in which every figure is printed."""

JOURNAL = STYLE | {
    "figure.dpi": 200,  # where a notebook shows them
    "savefig.dpi": 300,
    "figure.constrained_layout.w_pad": 0.03,
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.wspace": 0.03,
    "figure.constrained_layout.hspace": 0.03,
    "font.size": 7,
    "axes.titlesize": 7,
    "axes.labelsize": 7,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "axes.titlepad": 3,
    "axes.labelpad": 2,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.5,
    "patch.linewidth": 0.6,
    "legend.handlelength": 1.6,
    "legend.handletextpad": 0.5,
    "legend.borderaxespad": 0.2,
    "legend.labelspacing": 0.3,
    "pdf.fonttype": 42,  # whole outlines, which journals ask for
}
"""Style of the figures, as matplotlib's settings: as wide as printed, in type of 6.2 points and more."""

RESPONSES = {
    "held": "law, rounded at subgoals",
    "paper": "law, every LDS alone: corners",
}
"""What is drawn of a control law, by the method of its response."""

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


def journal():
    """The figures' style for everything that is drawn inside a `with` block.

    Returns
    -------
    context manager
    """
    return plt.rc_context(JOURNAL)


def lettered(axes, titles=None, side="left"):
    """Letters (a), (b), ... over axes, each with its title.

    Parameters
    ----------
    axes : sequence of matplotlib.axes.Axes
    titles : sequence of str, optional
    side : {"left", "center", "right"}
    """
    titles = titles or [""] * len(axes)
    for letter, ax, title in zip(ascii_lowercase, axes, titles, strict=False):
        ax.set_title(f"({letter}) {title}".rstrip(), loc=side)


def write(ax, text, place, away=(0, 0), **look):
    """Write at a place, or so many points away from it, legibly over lines.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    text : str
    place : (2,) sequence of float
        In m.
    away : (2,) sequence of float
        Points to the right and up.
    **look
        Options of `Axes.annotate`.
    """
    look = {"ha": "center", "va": "center", "path_effects": [plot.HALO], "zorder": 8} | look
    ax.annotate(text, place, away, textcoords="offset points", **look)


def order(ax, start, subgoals, label="subgoals, in order", away=7.0):
    """Where a way starts, and its subgoals with their numbers from 1, outside of its bends.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    start : (2,) array_like
        In m.
    subgoals : (K, 2) array_like
        In m.
    label : str, optional
        Of the subgoals.
    away : float
        Points from a subgoal to its number.
    """
    plot.start(ax, start, "start" if label else None)
    plot.subgoals(ax, subgoals, label)
    for k, (place, aside) in enumerate(zip(subgoals, outside(start, subgoals), strict=True), 1):
        write(ax, str(k), place, away * aside, weight="bold")


def outside(start, subgoals):
    """Unit vectors (K, 2) from each subgoal away from the middle of those before and after it."""
    places = np.vstack([start, subgoals, subgoals[-1:]])
    before, here, after = places[:-2], places[1:-1], places[2:]
    along, away = after - before, here - (before + after) / 2
    straight = np.linalg.norm(away, axis=1) < 0.1 * np.linalg.norm(along, axis=1)
    straight[-1] = True  # it has nothing behind it
    away[straight] = along[straight][:, ::-1] * [1, -1]
    return away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)


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
    dpi = JOURNAL["savefig.dpi"]
    figure = plt.figure(figsize=(width / dpi, height / dpi), dpi=dpi, layout="none")
    ax = figure.add_axes((0, 0, 1, 1))  # an image without axes is shown by no notebook
    ax.imshow(image, aspect="auto", interpolation="none")
    ax.set_axis_off()
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
        At most so many in a row; fewer where the figure is not wide enough for them.
    """
    shown = {}
    for ax in axes:
        handles, labels = ax.get_legend_handles_labels()
        shown = dict(zip(labels, handles, strict=True)) | shown
    look = {"loc": "outside lower center", "columnspacing": 1.0}
    for ncols in range(min(columns, len(shown)), 0, -1):
        legend = figure.legend(shown.values(), shown.keys(), ncols=ncols, **look)
        if ncols == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()
