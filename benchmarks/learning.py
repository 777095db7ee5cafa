"""What learning keeps: parts and ways, python -m benchmarks.learning [--tasks 40] [--first-seed 0] [--jobs 2]

Tasks drawn at random (`dollop.lab.tasks`) among 3, 4 and 8 objects that are still, were moved by 0.5 m, or stand
anywhere; matchings are given. Measured through `learn`, `adapt` and `errors`.

`cut short`: of three to five demonstrations one is cut to 30 to 90 % of its way. *named* is the share of tasks whose
notes name it; *shorter* the share whose way, where the objects stand in a new layout, ends farther from where the
person would end than that learned from the others, by more than 5 % of the task's size.

`two ways`: three demonstrations one way and two another, which differ by 0.7 m somewhere. *both kept* is the share of
tasks in which the ways are those two; *error* is the largest of the demonstrations' (`Task.errors`), in % of the size.
"""

import argparse

import joblib
import numpy as np
import pandas as pd

from dollop import Demonstration, Matching, learn
from dollop.lab.tasks import draw_layouts, draw_task, other_way, size_of, walked
from dollop.trajectory import distance_to_polyline

LONGER, APART = 5.0, 0.7  # % of the size; m


def shown(task, centres, rng, share=1.0):
    """A demonstration, of the first part of the way if a share is given."""
    walk = walked(task, centres, rng)
    return Demonstration(walk[: round(share * len(walk))], task.environment(centres))


def cut_short(objects, kind, seed):
    """named, and how much farther from the end (% of the size) a task ends that has a part among its demonstrations."""
    rng = np.random.default_rng([seed, objects, 1])
    task, count = draw_task(objects, rng), int(rng.integers(3, 6))
    *layouts, new = draw_layouts(objects, count + 1, rng, kind)
    part, share, same = int(rng.integers(count)), rng.uniform(0.3, 0.9), Matching.identity(objects)
    each = [shown(task, centres, rng, share if k == part else 1.0) for k, centres in enumerate(layouts)]
    whole = [one for k, one in enumerate(each) if k != part]
    ends = []
    for demonstrations in (each, whole):
        learned = learn(demonstrations, matchings=[same] * len(demonstrations))
        now = learned.adapt(task.environment(new), same).law.subgoals[-1]
        ends.append(100 * np.linalg.norm(now - task.way(new)[-1]) / size_of(task.way(new)))
        if demonstrations is each:
            named = any(f"demonstration {part} " in note.text or note.kind == "ways" for note in learned.notes)
    return {"named": float(named), "shorter": float(ends[0] - ends[1] > LONGER)}


def two_ways(objects, kind, seed):
    """both kept, and the largest error of a demonstration; nothing where the two ways are hardly two."""
    rng = np.random.default_rng([seed, objects, 2])
    task = draw_task(objects, rng)
    other, layouts = other_way(task, rng), draw_layouts(objects, 5, rng, kind)
    if min(distance_to_polyline(other.way(c), task.way(c)).max() for c in layouts) < APART:
        return {}
    each = [shown(task if k < 3 else other, centres, rng) for k, centres in enumerate(layouts)]
    learned = learn(each, matchings=[Matching.identity(objects)] * 5)
    kept = sorted(way.members for way in learned.learned) == [(0, 1, 2), (3, 4)]
    return {"both kept": float(kept), "error": 100 * learned.errors().max() / size_of(task.way(layouts[0]))}


def run(tasks=40, first_seed=0, jobs=2):
    """One row for each experiment, number of objects and kind of layout."""
    rows = []
    for experiment in (cut_short, two_ways):
        for kind in ("still", "moved", "anywhere"):
            for objects in (3, 4, 8):
                seeds = range(first_seed, first_seed + tasks)
                found = joblib.Parallel(jobs)(joblib.delayed(experiment)(objects, kind, seed) for seed in seeds)
                numbers = pd.DataFrame([each for each in found if each])
                row = {"experiment": experiment.__name__, "kind": kind, "objects": objects, "tasks": len(numbers)}
                rows.append(row | numbers.mean().round(3).to_dict())
                print(rows[-1], flush=True)
    return pd.DataFrame(rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    print(run(**vars(parser.parse_args())).to_string(index=False))
