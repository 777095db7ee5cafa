"""Figure x3: tasks among objects that stand somewhere new each time (Sec. IV-B and V)."""

import matplotlib.pyplot as plt
import numpy as np

from dollop.replication import drawing, peers
from dollop.replication.figures.panel import panel

__all__ = []

FIRST, TASKS = 540_000, 12
"""Seeds of the tasks: none on which a method was developed."""
NUMBERS, OBJECTS = (1, 2, 3, 5, 10), 4
LINES = {  # method: name in metrics.json, what it is, marker, dashes
    "anchored": ("anchored", "ours, told the objects", "o", "-"),
    "paper": ("paper", "the paper's, told the objects", "D", "--"),
    "TP-GMM": ("tp_gmm", "TP-GMM, told the objects", "s", "-."),
    "ProMP": ("promp", "ProMP, told start and goal", "^", (0, (5, 1, 1, 1))),
    "DMP": ("dmp", "DMP, told start and goal", "v", (0, (1, 1))),
}
FLOOR = "walked again"


@panel(
    "x3",
    extra="peers",
    walked_again="the same person again",
    **{name: words for name, words, *_ in LINES.values()},
)
def figure_x3():
    """Beyond the paper: tasks among objects that stand somewhere else each time, shown more and more often.

    Each task is drawn: via-points beside some of four objects, of which others play no part; a
    person walks it in layouts that have nothing in common, and is to be foretold in one more. Told
    is how far the person's way is from what a method would walk, in the median of the tasks, with
    the 95 % interval of that median. Dotted is the same person, walking it again: nobody can do
    better. From one demonstration, what a place follows can only be guessed from what is near it;
    the second tells, and further ones make the place sure. The methods of others are set up as
    their advocates would, and two of them are told where the way truly begins and ends, which ours
    is not.
    """
    methods = {name: peers.DRAWN[name] for name in (*LINES, FLOOR)}
    seeds = range(FIRST, FIRST + TASKS)
    table = peers.summary(peers.study((OBJECTS,), NUMBERS, seeds, methods=methods, jobs=2))
    medians = table.droplevel(["kind", "objects"])
    figure, ax = plt.subplots(figsize=(drawing.WIDTH, 3.0))
    for k, method in enumerate(LINES):
        draw_line(ax, method, medians.loc[method], 1.03 ** (k - 2))
    ax.axhline(
        medians.loc[FLOOR, "median"].iloc[0],
        linestyle=":",
        color="black",
        label="the same person, again",
    )
    ax.set(
        xlabel="demonstrations",
        ylabel="median error [% of the task's size]",
        xscale="log",
        yscale="log",
    )
    ax.set_xticks(NUMBERS, map(str, NUMBERS))
    ax.set_yticks((1, 2, 5, 10, 20, 40), ("1", "2", "5", "10", "20", "40"))
    ax.minorticks_off()
    drawing.legend_below(figure, ax, columns=2)
    return figure, measured(medians)


def draw_line(ax, method, cells, shift):
    """Medians of one method over the number of demonstrations, with their intervals."""
    _, words, marker, dashes = LINES[method]
    reach = np.array([cells["median"] - cells.low, cells.high - cells["median"]])
    look = {"color": drawing.METHODS[method], "marker": marker, "label": words, "linestyle": dashes}
    ax.errorbar(cells.index * shift, cells["median"], reach, **look)


def measured(medians):
    """The medians by method and number of demonstrations, the floor, and of how many tasks."""
    metrics = {"tasks": TASKS, "walked_again_error_percent": medians.loc[FLOOR, "median"].iloc[0]}
    for method, (name, *_) in LINES.items():
        for n, median in medians.loc[method, "median"].items():
            metrics[f"{name}_error_percent_{n}"] = median
    return metrics
