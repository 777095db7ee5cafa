"""A film of a run: the robot on its way, over the picture of the task."""

from io import BytesIO

import numpy as np

from dollop.formats.kinds import GIF
from dollop.formats.writing import whole_file
from dollop.robot.tables import rows_kidnapped

__all__ = ["write_film"]

FRAMES, FASTEST = 150, 0.05
"""Frames of a film at most, and s that each is shown: not every browser is faster."""
LAST = 2.0
"""s for which the last frame is shown."""
DPI = 90


def write_film(path, run, task, background=None):
    """A film of a run as an animated GIF, whole or not at all.

    Parameters
    ----------
    path : str or Path
    run : Run
    task : Task
    background : OccupancyGrid, optional

    Notes
    -----
    What stands still is drawn once, by matplotlib; into each frame go the way so far and the robot.
    The same run gives the same bytes.
    """
    from PIL import Image

    still, to_pixels = _still(run, task, background)
    rows = np.unique(np.linspace(0, len(run.t) - 1, min(FRAMES, len(run.t))).round().astype(int))
    frames = [_frame(still, to_pixels, run, row) for row in rows]
    palette = frames[-1].quantize(colors=128, method=Image.Quantize.FASTOCTREE, dither=0)
    frames = [frame.quantize(palette=palette, dither=0) for frame in frames]
    seconds = np.diff(run.t[rows], append=run.t[-1]) * _pace(run, len(rows))
    shown = [max(20, int(10 * round(100 * each))) for each in seconds[:-1]] + [int(1000 * LAST)]
    stream = BytesIO()
    frames[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=shown,
        loop=0,
        optimize=False,
        disposal=1,
    )
    with whole_file(path, kind=GIF) as file:
        file.write(stream.getvalue())


def _pace(run, frames):
    """By how much the film is shorter than the run: a frame takes `FASTEST`, or its time."""
    return min(1.0, FASTEST * frames / max(run.t[-1], 1e-9))


def _still(run, task, background):
    """The picture of what stands still, and what turns places (N, 2) in m into its pixels."""
    from PIL import Image

    from dollop import plot

    def draw(ax):
        if background is not None:
            plot.grid_map(ax, background)
        plot.task(ax, task)
        path = run.true_poses[np.isfinite(run.true_poses).all(axis=1), :2]
        ax.plot(*path.T, alpha=0)  # so that all of it is in the picture
        plot.path(ax, path[:1], "robot", plot.RUN, linewidth=2)

    with plot.style():
        figure = plot.figure_of(draw, title=" ")
        figure.set_dpi(DPI)
        figure.canvas.draw()
        image = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
    transform, height = figure.axes[0].transData, image.height
    return image, lambda places: np.asarray(transform.transform(places)) * [1, -1] + [0, height]


def _frame(still, to_pixels, run, row):
    """The picture with the way so far, and the robot where it was in a period."""
    from PIL import ImageDraw, ImageFont

    from dollop import plot

    image = still.copy()
    pen = ImageDraw.Draw(image)
    leaps = rows_kidnapped(run)
    so_far = run.true_poses[: row + 1]
    for part in np.split(so_far[:, :2], leaps[leaps <= row]):
        part = part[np.isfinite(part).all(axis=1)]
        if len(part) > 1:
            pen.line(list(map(tuple, to_pixels(part).tolist())), fill=plot.RUN, width=3)
    x, y, theta = so_far[-1]
    if np.isfinite(so_far[-1]).all():
        radius = run.radius
        ahead = [x + radius * np.cos(theta), y + radius * np.sin(theta)]
        (left, top), (right, bottom), middle, nose = to_pixels(
            [[x - radius, y + radius], [x + radius, y - radius], [x, y], ahead]
        ).tolist()
        pen.ellipse([left, top, right, bottom], fill=plot.ROBOT, outline="black", width=2)
        pen.line([*middle, *nose], fill="black", width=2)
    kidnapped = " kidnapped" if len(leaps) and (abs(run.t[leaps] - run.t[row]) < 1.0).any() else ""
    font = ImageFont.load_default(14)
    pen.text((image.width / 2, 4), f"{run.t[row]:.1f} s{kidnapped}", "black", font, anchor="ma")
    return image
