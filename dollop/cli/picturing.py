"""Pictures beside results: of a task, and of a run."""

from dollop.formats.kinds import PNG
from dollop.formats.writing import together, whole_file

__all__ = ["of_run", "of_task", "write_picture", "write_task"]


def write_picture(path, draw, title=None):
    """A picture of the plane as a file, whole or not at all.

    Parameters
    ----------
    path : str or Path
    draw : callable
        Draws into axes.
    title : str, optional
    """
    from dollop import plot

    with whole_file(path, kind=PNG) as stream:
        stream.write(plot.png(draw, title))


def of_task(task, background=None):
    """What draws a task on a map, into axes.

    Parameters
    ----------
    task : Task
    background : OccupancyGrid, optional

    Returns
    -------
    callable
    """
    from dollop import plot

    def draw(ax):
        if background is not None:
            plot.grid_map(ax, background)
        plot.task(ax, task)

    return draw


def of_run(run, task=None, background=None):
    """What draws a run on a map, into axes.

    Parameters
    ----------
    run : Run
    task : Task, optional
        That was performed.
    background : OccupancyGrid, optional

    Returns
    -------
    callable
    """
    from dollop import plot

    def draw(ax):
        if background is not None:
            plot.grid_map(ax, background)
        plot.run(ax, run, task)

    return draw


def write_task(task, background, out, picture):
    """A task and its picture, both or neither.

    Parameters
    ----------
    task : Task
    background : OccupancyGrid
    out, picture : Path
    """
    with together():
        write_picture(picture, of_task(task, background))
        task.save(out)
