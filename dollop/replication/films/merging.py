"""The film of states that are merged one by one while the evidence grows (Sec. V)."""

from dataclasses import dataclass
from itertools import chain, combinations, pairwise

import numpy as np

from dollop import plot
from dollop.cdhmm.evidence import FIRST, LEAST_GAIN, chains_of, evidence_of, graph_of
from dollop.cdhmm.merging import topological_order
from dollop.replication import recordings
from dollop.replication.films.canvas import Plane, captioned, even, sizes
from dollop.replication.films.reel import film_of

__all__ = ["Merge", "merges"]

ORDINALS = "first", "second", "third", "fourth", "fifth"
MAP = 0.62
"""Share of a frame's width that the map takes."""
APPEARING, ENDING = 0.22, 0.16
"""Shares of the film for the subgoals to appear, and for the end."""
SEEN = (1.2, 8.4), (1.6, 5.6)
"""m: the part of the map that is shown, along x and y."""
SECOND, WALK, EVIDENCE, PAIR = plot.TRUTH, plot.USER, plot.LAW, "#B0003A"


@dataclass(frozen=True, eq=False)
class Merge:
    """One merging of two states.

    Attributes
    ----------
    before, after : (M,) int arrays
        For each subgoal the number of its state; the merged state keeps the lower one.
    pair : (int, int)
        The two states.
    evidence : float
        Afterwards, in nats.
    gain : float
        By how much that is more than before.
    """

    before: np.ndarray
    after: np.ndarray
    pair: tuple
    evidence: float
    gain: float


def merges(model):
    """How the states of a model come about: best first, while the evidence grows without a circle.

    Parameters
    ----------
    model : SubgoalHMM

    Returns
    -------
    start : float
        The evidence while each subgoal is a state of its own, in nats.
    list of Merge
    """
    chains = chains_of(model.sequences, model.spread)
    labels = np.arange(len(chains.points)) + FIRST
    start = evidence = evidence_of(labels, chains)
    found = []
    while True:
        pairs = combinations(np.unique(labels).tolist(), 2)
        tried = (tried_merge(labels, pair, evidence, chains) for pair in pairs)
        best = max(tried, key=lambda each: each.gain, default=None)
        if best is None or best.gain <= LEAST_GAIN:
            return start, found
        found.append(best)
        labels, evidence = best.after, best.evidence


def tried_merge(labels, pair, evidence, chains):
    """What a merge would bring; of a circle the evidence is none."""
    after = np.where(labels == pair[1], pair[0], labels)
    compact = np.unique(after, return_inverse=True)[1] + FIRST
    counts = graph_of(compact, chains).counts
    acyclic = len(topological_order(counts, np.zeros(len(counts)))) == len(counts)
    now = evidence_of(compact, chains) if acyclic else -np.inf
    return Merge(labels, after, pair, now, now - evidence)


@film_of("merging", seconds=14.0)
def merging(width, count):
    """The states of two demonstrations are merged one by one, while the evidence grows.

    Left the map of the slalom: four boxes of cones, and the subgoals of two demonstrations, mapped
    to one environment, each a state of its own. In each step the two states whose merging makes the
    demonstrations most evident are ringed in crimson, and become one between them. Right the
    evidence, which rises with every merge. When no merge raises it any more, the states that are
    left, in order, are the task.
    """
    task = recordings.slalom_task()
    model = task.model
    start, steps = merges(model)
    _, (_, high) = sizes(width)
    left = even(MAP * width)
    plane = Plane((left, high), width, lambda ax: draw_map(ax, task))
    levels = [start, *(step.evidence for step in steps)]
    chart = Plane((width - left, high), width, lambda ax: draw_chart(ax, levels))
    for scene in scenes(model, start, steps, count):
        plane.begin()
        chart.begin()
        draw_states(plane, model, scene)
        draw_evidence(chart, levels, scene.merged + (1.0 if scene.share > 0.5 else 0.0))
        yield captioned(width, scene.caption, scene.note, plane.taken(), chart.taken())


@dataclass(frozen=True, eq=False)
class Scene:
    """What a frame shows: so many subgoals, merges that are done, and one in hand, how far."""

    shown: int
    labels: np.ndarray
    merged: int
    step: Merge
    share: float
    caption: str
    note: str


def scenes(model, start, steps, count):
    """A Scene for each frame."""
    owner = owners(model)
    total = len(owner)
    alone = np.arange(total) + FIRST
    appearing, ending = round(APPEARING * count), round(ENDING * count)
    ends = np.linspace(appearing, count - ending, len(steps) + 1).round().astype(int)
    for k in range(appearing):
        shown = min(total, 1 + int(1.25 * total * k / appearing))
        walk = ORDINALS[owner[shown - 1]]
        yield Scene(shown, alone, 0, None, 0.0, f"subgoals of the {walk} demonstration", told(shown))
    for k, (step, (begin, end)) in enumerate(zip(steps, pairwise(ends), strict=True)):
        caption = f"merge {k + 1} of {len(steps)}: {named(step, model)}, evidence {step.gain:+.1f}"
        for frame in range(begin, end):
            share = (frame - begin) / max(1, end - begin - 1)
            note = told(total - k, step.evidence - step.gain)
            if share > 0.5:
                note = told(total - k - 1, step.evidence)
            yield Scene(total, step.before, k, step, share, caption, note)
    labels, left = np.concatenate(model.states), len(model.means)
    caption = f"no merge raises it any more: {left} states, in order, are the task"
    last = Scene(total, labels, len(steps), None, 0.0, caption, told(left, model.evidence))
    yield from [last] * (count - max(ends[-1], appearing))


def told(states, evidence=None):
    """How many states, and how evident all is once all are there, in words."""
    how = "" if evidence is None else f", evidence {evidence:.1f} nats"
    return f"{states} state{'s' * (states != 1)}{how}"


def named(step, model):
    """The two states of a merge by the subgoals that they are made of."""
    owner, numbers = owners(model), [range(1, len(each) + 1) for each in model.sequences]
    names = [f"{n} of the {ORDINALS[k]}" for k, n in zip(owner, chain(*numbers), strict=True)]
    first, second = (named_state(names, step.before == state) for state in step.pair)
    return f"subgoal {first} walk with {second}"


def named_state(names, members):
    """A state by the names of its subgoals, of which `members` (M,) tells."""
    return " and ".join(names[m] for m in np.flatnonzero(members))


def owners(model):
    """Which demonstration each subgoal is of, (M,)."""
    return np.repeat(np.arange(len(model.sequences)), list(map(len, model.sequences)))


def draw_map(ax, task):
    """The map, the cones, and the legend of what will move."""
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax)
    ax.set(xlim=SEEN[0], ylim=SEEN[1])
    for k, colour in enumerate((WALK, SECOND)):
        label = f"subgoals of the {ORDINALS[k]} demonstration"
        ax.plot([], [], "o-", color=colour, markersize=5, label=label)
    ax.plot([], [], "o", color=plot.SUBGOAL, markersize=7, label="merged states, numbered in order")
    ax.plot([], [], "o", color=PAIR, fillstyle="none", markersize=9, label="merged now")


def draw_chart(ax, levels):
    """Axes for the evidence."""
    margin = 0.08 * np.ptp(levels) + 1
    ax.set(xlim=(-0.3, len(levels) - 0.7), ylim=(min(levels) - margin, max(levels) + margin))
    ax.set(xlabel="merges", ylabel="evidence [nats]", xticks=range(len(levels)))
    ax.plot([], [], "o-", color=EVIDENCE, label="evidence of the demonstrations")


def draw_evidence(chart, levels, merged):
    """The evidence so far."""
    places = [(k, level) for k, level in enumerate(levels) if k <= merged]
    chart.line(places, EVIDENCE, 2.5)
    chart.dots(places, EVIDENCE, 4)


def draw_states(plane, model, scene):
    """States at the mean of their subgoals, the demonstrations' ways through them, and the pair."""
    points = np.concatenate(model.sequences)
    places = np.array([points[scene.labels == label].mean(axis=0) for label in scene.labels])
    sizes_of = np.array([(scene.labels == label).sum() for label in scene.labels])
    if scene.step is not None:
        moving = np.isin(scene.labels, scene.step.pair)
        share = np.clip(3 * scene.share - 1, 0, 1)
        places[moving] += share * (points[moving].mean(axis=0) - places[moving])
        sizes_of[moving] = moving.sum() if share == 1 else sizes_of[moving]
    owner = owners(model)
    for k, colour in enumerate((WALK, SECOND)):
        mine = np.flatnonzero(owner[: scene.shown] == k)
        plane.line(places[mine], colour, 1.6)
        plane.dots(places[mine][sizes_of[mine] == 1], colour, 4.5)
    draw_merged(plane, scene, places, sizes_of)
    if scene.step is not None and scene.share < 0.9:
        for place in places[moving]:
            plane.ring(place, PAIR, 9)


def draw_merged(plane, scene, places, sizes_of):
    """Merged states as black dots, numbered once no other is to come."""
    final = scene.step is None and scene.merged
    order = {label: k for k, label in enumerate(np.unique(scene.labels))}
    for label in order:
        members = np.flatnonzero(scene.labels == label)
        if sizes_of[members[0]] > 1 or final:
            plane.dots(places[members[:1]], plot.SUBGOAL, 5.5)
            if final:
                plane.text(places[members[0]], str(order[label] + 1), bold=True, offset=(11, -11))
