"""How often `dollop.observe` is right in rooms and with people that it has never met, and whether it knows when not.

What is measured is the public call, `observe(log, background, user=...)`, and nothing inside of it, on the worlds of
`benchmarks.strangers`.

python -m benchmarks.observing [--kind K ...] [--worlds N] [--first-seed S] [--jobs J] [--out FILE.csv]
python -m benchmarks.observing --kind K --show SEED --out PICTURE.png

Every world has one of three ends: *right*; *told*, where the result is wrong but is not trusted, or nobody is
found, or there is an error; and *silent*, where it is wrong and nothing says so. What is right is said at each judge.
"""

import argparse
import inspect
import sys

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from joblib import Parallel, delayed

from benchmarks.strangers import KINDS, bounds, draw_world, in_view
from dollop import observe

NEAR = 0.4
"""A position of the user counts as the person's up to this distance from the middle of the body, in m."""


# ---- the judges


def observed(log, world):
    """What `observe` makes of a log, as a user would call it; or the error."""
    asked = {"user": world.user} if world.user is not None and "user" in inspect.signature(observe).parameters else {}
    try:
        return observe(log, world.background, **asked)
    except Exception as error:
        return error


def trusted(observation):
    """Whether the observation says that it can be trusted; before it can say so, it always does."""
    return getattr(observation, "trusted", True)


def notes(observation):
    """Kinds of the notes on the observation."""
    return [note.kind for note in getattr(observation, "notes", ())]


def judge(world):
    """One row of the table: how the world ends, and what was measured.

    Parameters
    ----------
    world : World

    Returns
    -------
    dict
        `end` is right, told or silent.
    """
    observation = observed(world.log, world)
    row = {"kind": world.kind, "beams": world.laser.beams, "rate": world.laser.rate, "reach": world.laser.reach}
    if isinstance(observation, Exception):
        return row | {"end": "told", "trusted": False, "error": f"{type(observation).__name__}: {observation}"}
    row |= {"trusted": trusted(observation), "notes": " ".join(notes(observation))}
    row["people"] = len(getattr(observation, "people", ()))
    row |= JUDGES[world.kind](world, observation)
    told = row.pop("told", not row["trusted"])
    return row | {"end": "right" if row.pop("right") else "told" if told else "silent"}


def judge_walk(world, observation):
    """Right: at most 0.15 m off on average, 95 % of the walk covered, and at most 5 % of the positions wrong.

    What is hidden at the very begin and end of the walk need not be covered.
    """
    user, person, log = observation.user, world.people[world.meant], world.log
    walks = np.flatnonzero(person.walks)
    ends = np.flatnonzero(person.seen[walks])
    at_ends = 1 - (ends[-1] + 1 - ends[0]) / len(walks)
    row = {"walk": log.t[walks[-1]] - log.t[walks[0]], "seen": person.seen[walks].mean(), "at_ends": at_ends}
    if user is None:
        return row | {"found": False, "covered": 0.0, "right": False, "told": True}
    scan = np.searchsorted((log.t[1:] + log.t[:-1]) / 2, user.t)
    truth = np.column_stack([np.interp(user.t, log.t, each) for each in person.middle.T])
    off = np.hypot(*(user.positions - truth).T)
    near = off <= NEAR
    covered = np.isin(walks, scan[near]).mean()
    row |= {"found": near.mean() >= 0.5, "mean_error": off.mean(), "covered": covered, "wrong": 1 - near.mean()}
    for name, which in (("seen_error", person.seen[scan]), ("hidden_error", ~person.seen[scan])):
        row[name] = off[which].mean() if which.any() else np.nan
    right = row["found"] and off.mean() <= 0.15 and covered >= 0.95 - at_ends and 1 - near.mean() <= 0.05
    return row | {"right": right}


def judge_alike(world, observation):
    """Right: no more than 5 % of the user's positions are those of the slower one; all else does not count."""
    row = judge_walk(world, observation)
    if observation.user is None:
        return row
    other = world.people[1 - world.meant].middle
    truth = np.column_stack([np.interp(observation.user.t, world.log.t, each) for each in other.T])
    mixed = (np.hypot(*(observation.user.positions - truth).T) <= NEAR).mean()
    return row | {"mixed": mixed, "right": mixed <= 0.05}


def judge_boxes(world, observation):
    """Right: one box for each object in view, and no box where nothing is. Sides are measured, but do not count."""
    boxes = observation.environment.boxes
    seen, reached = in_view(world)
    owner, gap = nearest_objects(boxes, world.objects)
    false = np.count_nonzero(gap > 0.2)
    number = np.array([np.count_nonzero((owner == k) & (gap <= 0.2)) for k in range(len(world.objects))])
    row = {"in_view": seen.sum(), "recall": (number[seen] > 0).mean() if seen.any() else np.nan, "false": false}
    assumed = getattr(observation.environment, "assumed", np.zeros((len(boxes), 4), dtype=bool))
    sides, marks = [], []
    for k in np.flatnonzero(seen & (number == 1)):
        mine = np.flatnonzero((owner == k) & (gap <= 0.2))[0]
        sides += (np.abs(boxes[mine] - bounds(world.objects[k])) <= 0.1)[reached[k]].tolist()
        marks += assumed[mine][~reached[k]].tolist()
    sides += [False] * int(reached[seen & (number != 1)].sum())
    row |= {"sides": np.mean(sides) if sides else np.nan, "assumed": np.mean(marks) if marks else np.nan}
    wrong_notes = [note for note in getattr(observation, "notes", ()) if note.doubt and note.kind not in NO_USER]
    told = bool(wrong_notes) if hasattr(observation, "notes") else not trusted(observation)
    return row | {"right": bool((number[seen] == 1).all() and false == 0), "told": told}


NO_USER = "user", "nobody", "people"
"""Notes of these kinds say nothing about the objects."""


def nearest_objects(boxes, objects):
    """For each box the object that it is nearest to (N,), and the gap between them in m, 0 where they overlap."""
    if not len(boxes) or not objects:
        return np.full(len(boxes), -1), np.full(len(boxes), np.inf)
    truth = np.array([bounds(thing) for thing in objects])
    apart = np.maximum(boxes[:, None, :2] - truth[:, 2:], truth[:, :2] - boxes[:, None, 2:]).clip(0)
    gap = np.hypot(*np.moveaxis(apart, 2, 0))
    middle = (boxes[:, None, :2] + boxes[:, None, 2:] - truth[:, :2] - truth[:, 2:]) / 2
    owner = (gap + 1e-3 * np.hypot(*np.moveaxis(middle, 2, 0))).argmin(axis=1)
    return owner, gap[np.arange(len(boxes)), owner]


def judge_rates(world, observation):
    """Right: each object in view has a box at every scan rate."""
    seen = {rate: observed(log, world) for rate, log in world.again.items()}
    failed = {"recall": 0.0, "told": True}
    rows = [failed if isinstance(each, Exception) else judge_boxes(world, each) for each in seen.values()]
    recalls = {f"recall_{rate:g}": row["recall"] for rate, row in zip(seen, rows, strict=True)}
    told = all(row["told"] for row in rows if row["recall"] < 1)
    return recalls | {"right": min(recalls.values()) == 1, "told": told}


def judge_moved(world, observation):
    """Right: the boxes at the end are right, and a note mentions an object; told: a note does."""
    boxes = judge_boxes(world, observation)
    note = any("object" in kind for kind in notes(observation))
    walk = judge_walk(world, observation)
    row = walk | {"note": note, "walk_right": walk["right"], "boxes_right": boxes["right"], "false": boxes["false"]}
    return row | {"right": boxes["right"] and note, "told": note}


def judge_nobody(world, observation):
    """Right: no user. The boxes do not count."""
    return {"right": observation.user is None, "moves": bool(np.ptp(world.log.poses[:, 0]) > 0)}


JUDGES = dict.fromkeys(KINDS, judge_walk)
JUDGES |= {"two_alike": judge_alike, "objects": judge_boxes, "rates": judge_rates}
JUDGES |= {"moved": judge_moved, "nobody": judge_nobody}


# ---- tables and pictures


def table(rows):
    """The ends of all worlds in %, kind by kind, and medians and 95 % of what was measured.

    Parameters
    ----------
    rows : DataFrame
        A row per world, as `judge` returns them.

    Returns
    -------
    DataFrame
    """
    lines = {}
    for kind, some in rows.groupby("kind", sort=False):
        right = some["end"] == "right"
        line = {"worlds": len(some)} | {end: 100 * (some["end"] == end).mean() for end in ("right", "told", "silent")}
        line["untrusted/right"] = 100 * (~some["trusted"][right].astype(bool)).mean()
        line["told/wrong"] = 100 * (some["end"][~right] == "told").mean()
        for name, share in (("mean_error", 0.95), ("covered", 0.05)):
            values = some.get(name, pd.Series(dtype=float)).astype(float)
            line |= {name: values.median(), f"{name} {share:.0%}": values.quantile(share)}
        others = (
            "found",
            "wrong",
            "seen_error",
            "hidden_error",
            "recall",
            "sides",
            "assumed",
            "false",
            "walk_right",
            "boxes_right",
        )
        for name in (*others, "note", *(each for each in some if each.startswith("recall_"))):
            if name in some:
                line[name] = some[name].astype(float).mean()
        lines[kind] = line
    return pd.DataFrame(lines)


def show(kind, seed, path):
    """Draw a world with the ways that were walked and those that were found.

    Parameters
    ----------
    kind : str
    seed : int
    path : str
        The picture.

    Returns
    -------
    dict
        As `judge` returns it.
    """
    world = draw_world(kind, seed)
    row, observation = judge(world), observed(world.log, world)
    figure, axes = plt.subplots(figsize=(9, 9))
    axes.imshow(world.background.occupied, extent=world.background.extent, origin="lower", cmap="Greys", alpha=0.4)
    for things, style in ((world.fixed, "k-"), (world.before or [], "g:"), (world.objects, "g-")):
        for thing in things:
            axes.plot(*np.vstack([thing, thing[:1]]).T, style, lw=1)
    axes.plot(*world.log.poses[:, :2].T, "k.")
    x, y, heading = world.log.poses[0]
    axes.plot([x, x + 0.5 * np.cos(heading)], [y, y + 0.5 * np.sin(heading)], "k-", lw=2)
    for k, person in enumerate(world.people):
        who = "who is meant" if k == world.meant else "another one"
        axes.plot(*person.middle.T, "-", color=f"C{k}", lw=4, alpha=0.3, label=f"{who} ({person.pace:.2f} m/s)")
        axes.plot(*person.middle[~person.seen].T, "x", color=f"C{k}", ms=4)
    if not isinstance(observation, Exception):
        draw_found(axes, observation)
    axes.set_title(", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), wrap=True)
    (left, low), (right, high) = world.fixed[0].min(axis=0) - 0.5, world.fixed[0].max(axis=0) + 0.5
    axes.set(aspect="equal", xlim=(left, right), ylim=(low, high))
    if axes.get_legend_handles_labels()[0]:
        axes.legend()
    figure.savefig(path, dpi=80)
    plt.close(figure)
    return row


def draw_found(axes, observation):
    """Tracks, the user, and the boxes."""
    for track in observation.tracks:
        axes.plot(*track.positions.T, "-", color="0.5", lw=0.7)
    if observation.user is not None:
        axes.plot(*observation.user.positions.T, "r.-", lw=0.7, ms=2, label="user")
    for left, low, right, high in observation.environment.boxes:
        axes.plot([left, right, right, left, left], [low, low, high, high, low], "r--")


def measure(kind, seed):
    """Draw a world and judge what `observe` makes of it: one row."""
    return {"seed": seed} | judge(draw_world(kind, seed))


def main(arguments=None):
    """Run the bench from the command line.

    Parameters
    ----------
    arguments : list of str, optional
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks.observing", description=__doc__.split("\n")[0])
    parser.add_argument("--kind", nargs="+", choices=KINDS, default=KINDS, help="kinds of worlds; all by default")
    parser.add_argument("--worlds", type=int, default=60, help="of each kind")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--show", type=int, metavar="SEED", help="draw one world into --out")
    parser.add_argument("--out", help="a csv of one row per world, or the picture (observing.png by default)")
    asked = parser.parse_args(arguments)
    if asked.show is not None:
        print(show(asked.kind[0], asked.show, asked.out or "observing.png"))
        return
    seeds = range(asked.first_seed, asked.first_seed + asked.worlds)
    tasks = (delayed(measure)(kind, seed) for kind in asked.kind for seed in seeds)
    rows = pd.DataFrame(Parallel(n_jobs=asked.jobs)(tasks))
    if asked.out:
        rows.to_csv(asked.out, index=False)
    print(table(rows).to_string(float_format=lambda value: f"{value:.3g}", na_rep=""))
    for kind, some in rows.groupby("kind", sort=False):
        print(f"{kind}: silent {some.seed[some.end == 'silent'].tolist()}")
        print(f"{kind}: right, not trusted {some.seed[(some.end == 'right') & ~some.trusted.astype(bool)].tolist()}")


if __name__ == "__main__":
    main(sys.argv[1:])
