"""The pictures and the numbers of the page on one's own log: `python book/pictures.py` remakes them.

It needs the simulated laboratory, and takes about a minute.
"""

import json
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from tqdm import tqdm

import dollop
from dollop import plot
from dollop.laps import cut_laps
from dollop.trajectory import arc_length, at_arc_length

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "book" / "own_log"
NUMBERS = FOLDER / "numbers.json"
SECONDS = (1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0)
"""s for which a laser looks."""
ROOMS = range(100, 133)
"""Seeds of the random rooms in which it does."""
SEED = 2004


def main():
    """Draw all of them, and write the numbers beside them."""
    FOLDER.mkdir(exist_ok=True)
    warnings.simplefilter("ignore", UserWarning)
    background = dollop.OccupancyGrid.load(ROOT / "data" / "lab.yaml")
    walk = dollop.observe(recording("figure_eights"), background).user
    numbers = {"look": looked(), "place": draw_places(background)}
    draw_looks(numbers["look"])
    numbers["walk"] = draw_walks(background, walk)
    numbers["wrong"] = draw_wrong(background)
    NUMBERS.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {NUMBERS.parent.relative_to(ROOT)}/: four pictures and numbers.json")


def recording(name):
    """One of the logs in data/."""
    return dollop.read_log(ROOT / "data" / f"{name}.log.gz")


def save(figure, name):
    """A small picture, without what the house's figures have of resolution."""
    figure.savefig(FOLDER / f"{name}.png", dpi=80, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def begin_of(log, seconds):
    """The scans of the first seconds of a log."""
    rows = log.t <= log.t[0] + seconds
    return replace(log, t=log.t[rows], ranges=log.ranges[rows], poses=log.poses[rows])


# ---- how long to look


def looked():
    """For each time in s, which share of the objects in view is found, and boxes that are none."""
    from dollop.replication.worlds.draw import draw

    rooms = [draw(seed) for seed in ROOMS]
    rooms = [room for room in rooms if room.later.objects and not room.later.robot.way]
    counts = np.array([counted(room) for room in tqdm(rooms, desc="rooms")])
    in_view, found, strange = counts.sum(axis=0).T
    return {
        "rooms": len(rooms),
        "objects": int(in_view[0]),
        "seconds": list(SECONDS),
        "found": found.tolist(),
        "strange": strange.tolist(),
    }


def counted(world):
    """For each time, how many objects of a random room are in view, are found, and are none."""
    from dollop.lab import watch
    from dollop.replication.worlds import chain
    from dollop.replication.worlds.view import objects_in_view

    background = chain.call_map(world, None)["map"]
    scene = replace(world.later, people=())
    log = watch(scene, [world.seed, 40], SECONDS[-1] + 0.5).log
    truth, rows = chain.true_boxes(scene, scene.objects), []
    in_view = np.flatnonzero(objects_in_view(scene))
    for seconds in SECONDS:
        boxes = dollop.observe(begin_of(log, seconds), background).environment.boxes
        found = chain.partners(boxes, truth)
        strange = [chain.distance_to_boxes(box, truth) > chain.STRANGE for box in boxes]
        rows.append((len(in_view), np.isin(in_view, found).sum(), sum(strange)))
    return rows


def draw_looks(look):
    """Objects found against seconds looked at."""
    with plot.style():
        figure, ax = plt.subplots(figsize=(6, 2.6))
        ax.plot(look["seconds"], 100 * np.array(look["found"]) / look["objects"], "o-", color=plot.OBSTACLE)
        ax.set(xlabel="looked for [s]", ylabel="objects in view that are found [%]", ylim=(-4, 104))
        ax.set_xlim(0, SECONDS[-1] + 0.2)
        save(figure, "look")


# ---- where to put the laser


def scene_from(pose):
    """Five cans in the laboratory, two of them behind others as seen from the lower wall; the robot at a pose."""
    from dollop.lab import Scene
    from dollop.lab.things import Object, Robot

    places = (2.5, 2.6), (1.95, 3.9), (4.5, 4.4), (6.3, 2.5), (6.95, 3.7)
    return Scene([Object.trash_can(place) for place in places], robot=Robot(pose))


PLACES = {"before the wall": (4.5, 0.6, np.pi / 2), "in a corner": (0.75, 1.3, 0.6)}


def draw_places(background):
    """What is seen of one room from two places."""
    from dollop.lab import watch

    numbers = {}
    with plot.style():
        figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True)
        for ax, (name, pose) in zip(axes, PLACES.items(), strict=True):
            scene = scene_from(pose)
            found = dollop.observe(watch(scene, SEED).log, background).environment
            numbers[name] = {"found": len(found), "of": len(scene.objects)}
            draw_seen(ax, found, background, scene, name)
        plot.legend(axes[0])
        save(figure, "place")
    return numbers


def draw_seen(ax, found, background, scene, name):
    """The floor that was seen, the boxes that were found, and the objects that stand there."""
    plot.workspace(background, scene.robot.pose, found.boxes, ax, f"{name}: {len(found)} of {len(scene.objects)} found")
    rows, columns = np.nonzero(found.seen.floor)
    (x0, y0), side = found.seen.origin, found.seen.resolution
    ax.scatter(
        x0 + side * (columns + 0.5), y0 + side * (rows + 0.5), 4, "0.9", marker="s", zorder=0, label="seen floor"
    )
    ax.plot(*scene.positions.T, "o", color=plot.TRUTH, zorder=5, label="objects that stand there")


# ---- how to walk


def walks_of(walk):
    """Three ways to show one lap: well, with a way there and back, and too little of it; t and positions of each."""
    t, positions = walk.t, walk.positions
    step = float(np.median(np.diff(t)))
    way = [(8.2, 5.5), (8.2, 1.2), positions[0]]
    there = at_arc_length(way, np.arange(0, arc_length(way)[-1], step))
    long = np.vstack([there, positions[: round(3.25 * len(t) / 5)], there[::-1]])
    some = slice(0, round(1.9 * len(t) / 5))
    return {
        "five laps": (t, positions),
        "laps, and a way there and back": (step * np.arange(len(long)), long),
        "less than two laps": (t[some], positions[some]),
    }


def draw_walks(background, walk):
    """What is kept of three walks."""
    numbers = {}
    with plot.style():
        figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), sharey=True)
        for ax, (name, (t, positions)) in zip(axes, walks_of(walk).items(), strict=True):
            cut = cut_laps(t, positions)
            numbers[name] = {
                "laps": len(cut.laps),
                "dropped": round(float(cut.dropped), 3),
                "notes": [[note.kind, note.text, note.doubt] for note in cut.notes],
            }
            plot.workspace(background, None, (), ax, f"{name}\n{kept(cut)}")
            plot.path(ax, positions, "walked", plot.OCCLUDED, linewidth=2.5)
            for k, lap in enumerate(cut.laps):
                plot.path(ax, lap, None if k else "kept as laps", plot.USER, linewidth=1)
        plot.legend(axes[1])
        save(figure, "walk")
    return numbers


def kept(cut):
    """What is kept of a walk, in words."""
    return "kept whole" if len(cut.laps) == 1 else f"{len(cut.laps)} laps kept, {cut.dropped:.0%} dropped"


# ---- what goes wrong


def draw_wrong(background):
    """Four recordings that say by notes what is wrong with them."""
    cases = {
        "the poses are 30 cm off": (shifted(begin_of(recording("figure_eights"), 40.0), -0.3), background),
        "two people walk": (two_people(), background),
        "an object is moved meanwhile": (after(recording("moved_cans_0"), recording("moved_cans_1")), background),
        "the user goes out of sight": (gone(), background),
    }
    numbers = {}
    with plot.style():
        figure, axes = plt.subplots(2, 2, figsize=(10, 8), sharex=True, sharey=True)
        for ax, (name, (log, grid)) in zip(axes.flat, cases.items(), strict=True):
            found = dollop.observe(log, grid)
            numbers[name] = [[note.kind, note.text, note.doubt] for note in found.notes]
            kinds = ", ".join(dict.fromkeys(note.kind for note in found.notes if note.doubt))
            plot.workspace(grid, log.poses[0], found.environment.boxes, ax, f"{name}\nin doubt: {kinds}")
            for track in found.people:
                user = track is found.user
                plot.path(ax, track.positions, "user" if user else "somebody else", plot.USER if user else plot.TRUTH)
        before = dollop.observe(recording("moved_cans_0"), background).environment.boxes
        plot.boxes(axes[1, 0], before, "where they stood before", plot.BACKGROUND)
        axes[1, 1].plot([], [], color=plot.TRUTH, label="somebody else")
        plot.legend(axes[1, 0])
        look = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.13), "ncols": 2}
        axes[1, 1].legend(*zip(*lines_of(axes[1, 1]), strict=True), **look)
        save(figure, "wrong")
    return numbers


def lines_of(ax):
    """Handle and label of each line that has one."""
    pairs = zip(*ax.get_legend_handles_labels(), strict=True)
    return [pair for pair in pairs if pair[1] in ("user", "somebody else")]


def shifted(log, by):
    """The same log from a place so many m farther up."""
    return replace(log, poses=log.poses + [0.0, by, 0.0])


def after(first, second):
    """One log after another."""
    t = np.append(first.t, second.t - second.t[0] + first.t[-1] + 0.1)
    ranges, poses = (np.concatenate([getattr(log, name) for log in (first, second)]) for name in ("ranges", "poses"))
    return replace(first, t=t, ranges=ranges, poses=poses)


def two_people():
    """Two people who walk about as fast."""
    from dollop.lab import Scene, record
    from dollop.lab.things import Person

    first = Person(((2.0, 2.0), (4.5, 2.2), (7.0, 2.0)), back=True, seed=1)
    second = Person(((2.2, 4.6), (4.5, 4.9), (7.0, 4.6)), back=True, seed=2)
    return record(Scene(people=(first, second)), SEED).log


def gone():
    """Somebody who walks behind a long box, and stays there."""
    from dollop.lab import Scene, record
    from dollop.lab.things import Object, Person

    box = Object("box", (6.0, 2.6), (1.6, 0.4), 1.2)
    way = (2.0, 2.2), (3.2, 3.6), (4.4, 3.8), (6.1, 3.6)
    return record(Scene([box], people=(Person(way, stops=((3, 8.0),), seed=3),)), SEED).log


if __name__ == "__main__":
    sys.exit(main())
