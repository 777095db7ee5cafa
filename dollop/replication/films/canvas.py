"""What the frames of films are laid out of: a caption, a picture, and a plane on which things move.

What stands still is drawn once, by matplotlib in house style; what moves is drawn over it by
Pillow.
"""

from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from dollop import plot

__all__ = ["Plane", "captioned", "even", "font", "sizes", "steps"]

WIDTH = 960
"""Pixels of a frame for which sizes of type and lines are told."""
FINE = 2
"""Times finer than a frame that its plane is drawn."""
INCH = 100
"""Pixels of such a frame for one of matplotlib's inches."""
STRIP, HEIGHT = 40, 448
"""Pixels of such a frame: height of the caption, and of all."""
TYPE, NOTE = 16, 14
"""Pixels of such a frame: height of the caption's type."""
GREY = "#555555"


def even(pixels):
    """The nearest even number of pixels: H.264 takes no others.

    Parameters
    ----------
    pixels : float

    Returns
    -------
    int
    """
    return 2 * round(pixels / 2)


def sizes(width):
    """Of a frame that is so wide: its size, and that of each half below its caption.

    Parameters
    ----------
    width : int
        Pixels.

    Returns
    -------
    frame, half : (int, int)
        Width and height in pixels.
    """
    height, strip = even(width * HEIGHT / WIDTH), even(width * STRIP / WIDTH)
    return (width, height), (width // 2, height - strip)


def steps(last, count, hold=0.08):
    """Which of some rows each frame shows: evenly from the first to the last, which stays a while.

    Parameters
    ----------
    last : int
        The last row.
    count : int
        How many frames.
    hold : float
        Share of the frames that show the last row.

    Returns
    -------
    (count,) int array
    """
    moving = max(1, count - round(hold * count))
    rows = np.linspace(0, last, moving).round().astype(int)
    return np.append(rows, np.full(count - moving, last))


def captioned(width, text, note, *halves):
    """A frame: what happens, and the time or the like at the right, above one or two pictures.

    Parameters
    ----------
    width : int
        Pixels.
    text, note : str
    *halves : PIL.Image.Image
        From left to right.

    Returns
    -------
    PIL.Image.Image
    """
    size, (_, high) = sizes(width)
    frame = Image.new("RGB", size, "white")
    unit, middle, across = width / WIDTH, (size[1] - high) / 2, 0
    pen = ImageDraw.Draw(frame)
    pen.text((10 * unit, middle), text, "black", font("DejaVuSans-Bold", TYPE * unit), anchor="lm")
    pen.text((width - 10 * unit, middle), note, GREY, font("DejaVuSans", NOTE * unit), anchor="rm")
    for half in halves:
        frame.paste(half, (across, size[1] - high))
        across += half.width
    return frame


@cache
def font(name, size):
    """A font of matplotlib's.

    Parameters
    ----------
    name : str
        Of its file.
    size : float
        Pixels.

    Returns
    -------
    PIL.ImageFont.FreeTypeFont
    """
    return ImageFont.truetype(Path(matplotlib.get_data_path(), "fonts", "ttf", f"{name}.ttf"), size)


class Plane:
    """A plane of which what stands still is drawn once, and what moves into a copy for each frame.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels.
    width : int
        Of the whole frame in pixels.
    draw : callable
        Draws what stands still into axes, with labels.
    columns : int
        Of the legend.
    """

    def __init__(self, size, width, draw, columns=3):
        self.size, self.unit = size, FINE * width / WIDTH
        with plot.style():
            inches = np.array(size) * WIDTH / width / INCH
            figure = Figure(figsize=inches, dpi=INCH * self.unit)
            FigureCanvasAgg(figure)
            ax = figure.add_subplot()
            draw(ax)
            look = {"fontsize": 8, "columnspacing": 1.0, "handlelength": 1.5, "ncols": columns}
            figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", **look)
            figure.canvas.draw()
            self._still = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
        self._still = self._still.resize(FINE * np.array(size))
        self._transform = ax.transData
        self.begin()

    def begin(self):
        """Begin a frame: what was drawn into the last one is gone."""
        self._image = self._still.copy()
        self._pen = ImageDraw.Draw(self._image)

    def taken(self):
        """The frame as it is, a PIL.Image.Image."""
        return self._image.reduce(FINE)

    def pixels(self, places):
        """Places (..., 2) in pixels of the finer picture."""
        shown = self._transform.transform(np.reshape(places, (-1, 2)))
        return (shown * [1, -1] + [0, self._image.height]).reshape(np.shape(places))

    def line(self, places, colour, width=2.0):
        """A line through places (N, 2), `width` pixels wide where a frame is 960."""
        if len(places) > 1:
            flat = self.pixels(places).ravel().tolist()
            self._pen.line(flat, fill=colour, width=self._wide(width), joint="curve")

    def rays(self, start, ends, colour, width=0.6):
        """Straight lines from one place (2,) to many (N, 2)."""
        begin = self.pixels(start).tolist()
        for end in self.pixels(ends).tolist():
            self._pen.line([*begin, *end], fill=colour, width=self._wide(width))

    def dots(self, places, colour, radius=1.8):
        """A dot at each place (N, 2)."""
        for x, y in self.pixels(places).tolist():
            r = radius * self.unit
            self._pen.ellipse([x - r, y - r, x + r, y + r], fill=colour)

    def dotted(self, start, end, colour="black", width=2.0):
        """A dotted line from one place (2,) to another."""
        apart = np.hypot(*np.subtract(*self.pixels([start, end]))) / self.unit
        share = np.linspace(0, 1, max(2, int(apart / 7)))[:, None]
        self.dots(np.asarray(start) + share * np.subtract(end, start), colour, width)

    def box(self, box, colour, width=2.0):
        """A box: xmin, ymin, xmax, ymax in m."""
        x0, y0, x1, y1 = box
        self.line([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)], colour, width)

    def circle(self, place, radius, colour, edge="black"):
        """A disc round a place (2,), its radius in m."""
        x, y = place
        corners = self.pixels([(x - radius, y + radius), (x + radius, y - radius)])
        look = {"fill": colour, "outline": edge, "width": self._wide(1.2)}
        self._pen.ellipse(corners.ravel().tolist(), **look)

    def ring(self, place, colour, radius, width=2.0):
        """A ring round a place (2,), its radius in pixels of a frame of 960."""
        (x, y), r = self.pixels(place), radius * self.unit
        self._pen.ellipse([x - r, y - r, x + r, y + r], outline=colour, width=self._wide(width))

    def robot(self, pose, radius, colour=plot.ROBOT):
        """The robot as a circle with its heading."""
        x, y, theta = pose
        self.circle((x, y), radius, colour)
        self.line([(x, y), (x + radius * np.cos(theta), y + radius * np.sin(theta))], "black", 1.6)

    def text(self, place, text, colour="black", size=12, bold=False, offset=(0, 0), anchor="mm"):
        """Words at a place (2,), moved by pixels of a frame of 960."""
        x, y = self.pixels(place) + self.unit * np.array(offset)
        face = font("DejaVuSans-Bold" if bold else "DejaVuSans", size * self.unit)
        look = {"anchor": anchor, "stroke_width": self._wide(1.5), "stroke_fill": "white"}
        self._pen.text((x, y), text, colour, face, **look)

    def _wide(self, width):
        return max(1, round(width * self.unit))
