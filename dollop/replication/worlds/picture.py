"""A world and what became of it as one picture: the truth in pale blue, what Dollop made of it over it."""

import textwrap

from dollop import plot
from dollop.lab.people import walk_of

__all__ = ["draw_judged"]


def draw_judged(ax, world, judgement, k=0):
    """Draw a demonstration of a world and what was made of it, or the run among the moved objects.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    world : RandomWorld
    judgement : Judgement
    k : int
        Which demonstration; -1 for the objects as they stood later, with the run.
    """
    results, row = judgement.results, judgement.row(world)
    scene = world.later if k < 0 else world.demonstrations[k]
    plot.scene(ax, scene, [walk_of(person, scene) for person in scene.people])
    if "map" in results:
        plot.grid_map(ax, results["map"])
    if k < 0:
        _draw_later(ax, results)
    elif len(results.get("observations", ())) > k:
        _draw_observed(ax, results, k)
    told = row["causes"] or f"{row['stage']} {row['told']}".strip()
    ending = textwrap.shorten(f"{row['outcome']}: {told}" if told else row["outcome"], 130, placeholder=" ...")
    title = "\n".join([f"{world.seed}: {row['kind']}, {row['room']}", *textwrap.wrap(ending, 55)])
    plot.plane(ax, title).title.set_fontsize(7)
    ax.tick_params(labelsize=6)
    left, low, right, high = scene.room.bounds
    ax.set(xlabel="", ylabel="", xlim=(left - 0.5, right + 0.5), ylim=(low - 0.5, high + 0.5))


def _draw_observed(ax, results, k):
    found = results["observations"][k]
    plot.boxes(ax, found.environment.boxes, "boxes found", plot.SUBGOAL, linewidth=1)
    if found.user is not None:
        plot.path(ax, found.user.positions, "trajectory", linewidth=1.2)
    if "task" in results and k == 0:
        plot.path(ax, results["task"].law.response(), "law", plot.LAW, linewidth=1, linestyle="--")


def _draw_later(ax, results):
    if "now" in results:
        plot.boxes(ax, results["now"].environment.boxes, "boxes found", plot.SUBGOAL, linewidth=1)
    if "adapted" in results:
        plot.path(ax, results["adapted"].law.response(), "law", plot.LAW, linewidth=1, linestyle="--")
    if "run" in results:
        plot.path(ax, results["run"].true_poses, "run", plot.RUN, linewidth=1.2)
