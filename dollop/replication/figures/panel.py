"""Panels: each drawing under its id, with the caption and what to look at as its docstring."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["PANELS", "Panel", "panel"]

PANELS = {}
"""What has been registered, Panel by id, in no order to rely on."""


@dataclass(frozen=True)
class Panel:
    """A panel of a figure: how it is drawn, and what is written beside it.

    Attributes
    ----------
    id : str
        The paper's name for it, such as "6a"; x1, x2, ... are not in the paper.
    draw : callable
        Takes nothing and returns the matplotlib figure and a dict of its numbers.
    columns : dict
        Where the numbers are of several things: how their names begin in metrics.json, and what
        each thing is. A number without such a beginning is of all that have none of their own.
    caption : str
        What it shows, after the paper's caption: the first paragraph of the drawing's docstring.
    look : str
        What to look at, and what to make of it: the rest of the docstring.
    extra : str
        What must be installed to draw it: a key of `dollop.checks.EXTRAS`.
    rendered : bool
        Whether it is nothing but pixels, which a PDF would not make sharper.
    """

    id: str
    draw: Callable
    columns: dict
    caption: str
    look: str
    extra: str
    rendered: bool = False

    @property
    def picture(self):
        """File name of the PNG: "6a" -> "fig_06a.png", which sorts as the paper has it."""
        number = self.id.rstrip("ab")
        return f"fig_{number.zfill(2)}{self.id[len(number) :]}.png"

    @property
    def printed(self):
        """File name of the PDF beside it, None for what is nothing but pixels."""
        return None if self.rendered else self.picture.replace(".png", ".pdf")


def panel(id, extra="lab", rendered=False, **columns):
    """Register the drawing that follows as a panel.

    Parameters
    ----------
    id : str
        The paper's name for it.
    extra : str
        What must be installed to draw it.
    rendered : bool
        Whether it is nothing but pixels.
    **columns : str
        What its numbers are of, where they are of several things.

    Returns
    -------
    callable
        The decorator; the drawing stays what it is.
    """

    def register(draw):
        caption, look = inspect.getdoc(draw).split("\n\n", 1)
        caption, look = (" ".join(each.split()) for each in (caption, look))
        PANELS[id] = Panel(id, draw, columns, caption, look, extra, rendered)
        return draw

    return register
