"""Pictures that answer the mouse: what is dragged or clicked, and words for what came of it.

A toy is a figure on a live canvas (`live_figure`). It works on any other canvas too, where
`click` and `drag` play the mouse: so a test, or the check at the end of a notebook, tries the
same toy in a figure of its own, and the one that the reader plays with stays as it is.
"""

from textwrap import wrap
from time import perf_counter

import numpy as np
from matplotlib.backend_bases import MouseButton, MouseEvent
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dollop import plot
from dollop.checks import checked_positions
from dollop.environment import checked_boxes
from dollop.gridmap import covered_cells

__all__ = ["Dragged", "Layer", "check_standing", "click", "drag", "live_figure", "tell"]

LINES = 2
"""So many lines of words over a picture, always: it must not jump when there is more to say."""
REST = 0.05
"""s for which moves of the mouse are passed over when one has been drawn: they have queued up meanwhile."""


def live_figure(width, height):
    """A figure that hears the mouse where a notebook shows it: end a cell with its `canvas`.

    Pyplot does not know it: no later cell draws into it by mistake, and pictures stay still
    elsewhere without `%matplotlib widget` and back.

    Parameters
    ----------
    width, height : float
        In inches.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from ipympl.backend_nbagg import Canvas, FigureManager  # of the extra notebooks

    figure = Figure(figsize=(width, height))
    canvas = Canvas(figure)
    FigureManager(canvas, 0)
    canvas.header_visible = canvas.toolbar_visible = False
    return figure


class Dragged:
    """Things in a picture that the mouse drags, with all that depends on them.

    Press the mouse near the middle of a thing, move it, let go. While it moves, `on_move` is
    called with the places of all things, and `on_drop` when it is let go. They draw what depends
    on the places (see `Layer`), and what they return is written over the picture. Where they
    raise a ValueError its words are written there; the last good picture stays, and a thing that
    is let go there goes back to where it was taken from. Of moves that come faster than they can
    be drawn the newest is drawn.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    places : (N, 2) array_like
        Of the things' middles, in m.
    on_move : callable
        Takes places (N, 2), returns words or None. It must raise before it draws.
    on_drop : callable, optional
        The same for what takes too long to be done at every move; `on_move` by default. It is
        called at once, with the places as they are.
    reach : float
        How near to its middle a thing is taken hold of, in m.
    clock : callable
        Returns s.

    Attributes
    ----------
    places : (N, 2) float array
        The last good ones.
    said : str
        What was written last.
    held : int or None
        Which thing the mouse holds.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = Figure().subplots()  # as it is, from 0 to 1
    >>> def far_from_the_wall(places):
    ...     if places[0, 0] > 0.9:
    ...         raise ValueError("that is in the wall")
    ...     return f"moved to {places[0, 0]:.1f}"
    >>> can = Dragged(ax, [[0.2, 0.5]], far_from_the_wall)
    >>> drag(ax, (0.2, 0.5), (0.3, 0.5), (0.6, 0.5))
    >>> can.said
    'moved to 0.6'
    >>> drag(ax, (0.6, 0.5), (0.95, 0.5))
    >>> can.said, can.places.round(1).tolist()
    ('that is in the wall; it is back where it was', [[0.6, 0.5]])
    """

    def __init__(self, ax, places, on_move, on_drop=None, reach=0.3, clock=perf_counter):
        self.ax, self.reach, self.clock = ax, reach, clock
        self.places = checked_positions("places", places, "N", 2)
        self.on_move, self.on_drop = on_move, on_drop or on_move
        self.held, self.said, self._from, self._newest, self._resting = None, "", None, None, 0.0
        look = {"color": plot.OBSTACLE, "marker": "o", "markersize": 14, "alpha": 0.3, "zorder": 8}
        # Not by Axes.plot: what can be seen of the plane is not for a handle to change.
        self._grips = ax.add_artist(Line2D(*self.places.T, linestyle="none", label="to drag", **look))
        self._call(self.on_drop, self.places)
        self._later = ax.figure.canvas.new_timer(1000 * REST, [(self._catch_up, (), {})])
        self._later.single_shot = True
        self._hear("button_press_event", self._take)
        self._hear("motion_notify_event", self._move)
        self._hear("button_release_event", self._drop)

    def put(self, places):
        """Put the things somewhere, as if they had been dragged there.

        Parameters
        ----------
        places : (N, 2) array_like
            In m, of as many things as one likes.

        Returns
        -------
        bool
            Whether they can be there; otherwise nothing has changed, and `said` tells why.
        """
        return self._call(self.on_drop, checked_positions("places", places, "N", 2))

    def _hear(self, name, handler):
        """Have an event handled; a canvas forgets methods of what nobody keeps, but no functions."""
        self.ax.figure.canvas.mpl_connect(name, lambda event: handler(event))

    def _take(self, event):
        """Take hold of the thing that is nearest to the mouse, if there is one within reach."""
        if event.button == MouseButton.LEFT and event.inaxes is self.ax and len(self.places):
            away = np.linalg.norm(self.places - self._place(event), axis=1)
            if away.min() <= self.reach:
                self.held, self._from = int(away.argmin()), self.places
                self.ax.figure.set_layout_engine("none")  # no axes must move under the mouse

    def _move(self, event):
        if self.held is None:
            return
        if event.buttons is not None and not event.buttons:  # let go beyond the picture
            self._drop(event)
            return
        self._newest = event
        if self.clock() >= self._resting:
            self._catch_up()
        else:
            self._later.start()

    def _catch_up(self):
        """Draw the newest move, unless the thing has been let go meanwhile."""
        if self.held is not None:
            self._call(self.on_move, self._dragged(self._newest))
            self._resting = self.clock() + REST

    def _drop(self, event):
        if self.held is None:
            return
        places, before = self._dragged(event), self._from
        self.held = None
        if not self._call(self.on_drop, places):
            words = f"{self.said}; it is back where it was"
            self._call(self.on_drop, before)
            self._tell(words, wrong=True)

    def _dragged(self, event):
        """The places (N, 2) with the held thing where the mouse is."""
        places = self.places.copy()
        places[self.held] = self._place(event)
        return places

    def _place(self, event):
        """Where the mouse is in m, be it beyond the axes."""
        return self.ax.transData.inverted().transform((event.x, event.y))

    def _call(self, what, places):
        """Draw what depends on the places, and say what came of it: whether they will do."""
        try:
            words = what(places.copy())
        except ValueError as error:
            good, words = False, str(error)
        else:
            good, self.places = True, places
        self._grips.set_data(*(places if good or self.held is not None else self.places).T)
        self._tell(words or "", wrong=not good)
        return good

    def _tell(self, words, wrong=False):
        self.said = words
        tell(self.ax, words, wrong)


class Layer:
    """The part of a picture that is drawn anew at every move, over what stays.

    Whatever is drawn into the axes inside a `with` block takes the place of what was drawn in the
    one before.

    Parameters
    ----------
    ax : matplotlib.axes.Axes

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> ax = Figure().subplots()
    >>> layer, _ = Layer(ax), ax.plot([0, 1], [0, 1])
    >>> for k in range(3):
    ...     with layer:
    ...         _ = ax.plot([0, 1], [k, k])
    >>> [line.get_ydata().tolist() for line in ax.lines]
    [[0, 1], [2, 2]]
    """

    def __init__(self, ax):
        self.ax, self._drawn, self._others = ax, [], set()

    def __enter__(self):
        for artist in self._drawn:
            artist.remove()
        self._others = set(self.ax.get_children())
        return self.ax

    def __exit__(self, *_):
        self._drawn = [each for each in self.ax.get_children() if each not in self._others]


def tell(ax, words, wrong=False):
    """Write over a picture what was done and what came of it, and have it drawn.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    words : str
        Of which so many are shown as go into two lines.
    wrong : bool
        Whether it is something that could not be done: then in vermilion.
    """
    title = ax.title
    across = ax.get_window_extent().width / ax.figure.dpi * 72 / (0.52 * title.get_fontsize())
    lines = wrap(words, max(int(across), 20), max_lines=LINES, placeholder=" …")
    lines += [" "] * (LINES - len(lines))
    title.set(text="\n".join(lines), color=plot.OBSTACLE if wrong else "black")
    ax.figure.canvas.draw_idle()


def check_standing(boxes, background):
    """Refuse objects that cannot stand where they are: in each other, in a wall, out of the room.

    Parameters
    ----------
    boxes : (N, 4) array_like
        xmin, ymin, xmax, ymax in m.
    background : OccupancyGrid
        The map of the empty room.

    Raises
    ------
    ValueError
        Words for whoever put it there.
    """
    boxes, shape = checked_boxes(boxes), background.occupancy.shape
    for k, box in enumerate(boxes):
        place = "({:.1f}, {:.1f})".format(*box.reshape(2, 2).mean(axis=0))
        cells = covered_cells(box[None], background.origin, background.resolution, shape)
        if background.occupied[cells].any():
            raise ValueError(f"at {place} it would stand in a wall or in furniture")
        if not cells.any() or background.free[cells].mean() < 0.5:
            raise ValueError(f"at {place} it would stand where the map knows no floor, out of the room")
        apart = (box[:2] >= boxes[:k, 2:]) | (box[2:] <= boxes[:k, :2])
        if not apart.any(axis=1).all():
            raise ValueError(f"at {place} two objects would stand in each other")


def click(ax, place):
    """Click into a picture, as the reader would.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    place : (2,) sequence of float
        In m.
    """
    drag(ax, place)


def drag(ax, *places):
    """Press the mouse at the first of some places, move it over the others, and let go at the last.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    *places : (2,) sequence of float
        In m.
    """
    first, last = places[0], places[-1]
    _send(ax, "button_press", first, button=MouseButton.LEFT)
    for place in places[1:]:
        _send(ax, "motion_notify", place, buttons={MouseButton.LEFT})
    _send(ax, "button_release", last, button=MouseButton.LEFT)


def _send(ax, name, place, **pressed):
    """One event of the mouse."""
    event = MouseEvent(f"{name}_event", ax.figure.canvas, *ax.transData.transform(place), **pressed)
    ax.figure.canvas.callbacks.process(event.name, event)
