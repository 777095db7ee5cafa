"""The forest plot: every criterion of every claim beside the range that is wanted."""

from math import inf

import matplotlib.pyplot as plt

from dollop.plot import style

__all__ = ["beside_range", "forest"]

COLOURS = {"yes": "#0077BB", "open": "#997700", "no": "#CC3311"}
MARKERS = {"yes": "o", "open": "s", "no": "X"}
WORDS = {"yes": "met", "open": "open", "no": "not met"}
ROW, FARTHEST = 0.17, 1000
"""Height of a row in inches; distances beyond are drawn at the rim."""


def beside_range(number):
    """Where mean and interval of a number lie, seen from the nearer end of what is wanted.

    Parameters
    ----------
    number : dict
        As `dollop.replication.report.measured` has it, with a wanted range.

    Returns
    -------
    (3,) tuple of float
        Mean and ends of the interval, in smallest differences that matter, positive inside.

    Examples
    --------
    >>> share = {"mean": 0.8, "low": 0.75, "high": 0.95, "wanted": [0.9, 1], "matters": 0.05}
    >>> [round(each, 3) for each in beside_range(share)]
    [-2.0, -3.0, 1.0]
    """
    low, high = number["wanted"]
    low = -inf if low is None or (low == 0 and high is not None) else low  # below 0 there is nothing
    high = inf if high is None or (high == 1 and low > 0) else high  # and above 1 no share
    if number["mean"] - low < high - number["mean"]:
        seen = [number[key] - low for key in ("mean", "low", "high")]
    else:
        seen = [high - number[key] for key in ("mean", "high", "low")]
    return tuple(min(max(each / number["matters"], -FARTHEST), FARTHEST) for each in seen)


def forest(found):
    """Draw every judged number of all claims with its interval, beside the range that is wanted.

    Parameters
    ----------
    found : list of dict
        From `dollop.replication.report.summaries`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    rows = [(claim, each) for claim in found for each in claim["numbers"] if each["wanted"]]
    with style():
        figure, ax = plt.subplots(figsize=(7.2, 1.0 + ROW * len(rows)))
        for place, (_, number) in enumerate(rows):
            if number["low"] is not None:
                draw_row(ax, place, number)
        band_claims(ax, [claim["id"] for claim, _ in rows])
        ax.axvline(0, color="black", linewidth=0.8)
        ax.set_xscale("symlog", linthresh=1)
        ax.set_xlim(-1.3 * FARTHEST, 1.3 * FARTHEST)
        ax.set_ylim(len(rows) - 0.4, -0.6)
        ax.set_yticks(range(len(rows)), [words(*row) for row in rows], fontsize=6)
        ax.set_xlabel(
            "← outside     inside →\nfrom the nearer end of what is wanted,\nin smallest differences that matter"
        )
        for answer, colour in COLOURS.items():
            ax.plot([], [], MARKERS[answer], color=colour, markersize=4, label=WORDS[answer])
        figure.legend(loc="outside upper right", ncols=3, frameon=False)
    return figure


def draw_row(ax, place, number):
    """One number: its interval as a line, its mean as a mark."""
    mean, low, high = beside_range(number)
    colour = COLOURS[number["met"]]
    ax.plot([low, high], [place, place], color=colour, linewidth=1.2)
    ax.plot(mean, place, MARKERS[number["met"]], color=colour, markersize=3.5)


def band_claims(ax, ids):
    """Shade every second claim, whose criteria follow each other."""
    names = list(dict.fromkeys(ids))
    for name in names[::2]:
        first = ids.index(name)
        ax.axhspan(first - 0.5, first + ids.count(name) - 0.5, color="#F0F2F4", zorder=0)


def words(claim, number):
    """What stands beside a row: the claim, and which of its numbers."""
    meaning = number["meaning"].split(" [")[0]
    return f"{claim['id']}: {meaning if len(meaning) < 62 else meaning[:60] + '…'}"
