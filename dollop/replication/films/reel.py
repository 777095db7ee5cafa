"""Films: each drawing under its name, with title and what it shows in words as its docstring."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["REEL", "Film", "film_of"]

REEL = {}
"""What has been registered, Film by name, in no order to rely on."""


@dataclass(frozen=True)
class Film:
    """A film: how its frames are drawn, how long it takes, and what it shows in words.

    Attributes
    ----------
    name : str
    draw : callable
        Takes the width of a frame in pixels and the number of frames, and yields so many pictures
        (PIL.Image.Image), all of one size, width and height even.
    suffix : str
        ".mp4" or ".gif".
    seconds : float
        How long it is when nobody says otherwise.
    rate : float
        Frames per second.
    title : str
        The first paragraph of the drawing's docstring.
    words : str
        For those who cannot see it: the rest of the docstring.
    """

    name: str
    draw: Callable
    suffix: str
    seconds: float
    rate: float
    title: str
    words: str

    @property
    def file(self):
        """Its file's name."""
        return self.name + self.suffix


def film_of(name, seconds=10.0, suffix=".mp4", rate=20):
    """Register the drawing that follows as a film.

    Parameters
    ----------
    name : str
    seconds : float
        How long it is when nobody says otherwise.
    suffix : {".mp4", ".gif"}
    rate : float
        Frames per second.

    Returns
    -------
    callable
        The decorator; the drawing stays what it is.
    """

    def register(draw):
        title, words = inspect.getdoc(draw).split("\n\n", 1)
        title, words = (" ".join(each.split()) for each in (title, words))
        REEL[name] = Film(name, draw, suffix, seconds, rate, title.rstrip("."), words)
        return draw

    return register
