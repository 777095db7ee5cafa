"""From a log and a map to a robot that drives, by shell alone, in random rooms of the laboratory.

python -m benchmarks.shell FIRST_SEED COUNT [FOLDER]

Each seed is a random world (`dollop.replication.worlds`): its logs are saved, and `dollop map`, `learn`,
`adapt` and `perform` are run as commands, with the options of the README and no others. A world ends as
*performed* (status 0 all the way, and a run that finished), *in doubt* (status 3 somewhere, its notes
told), *not finished* (by the run, its reason told), *refused* (status 1, its reason told) or *silently
wrong*: performed, but by the truth of the world the law leads where nobody walked, misses a part of the
walk, takes an object for another one, passes one on the other side than the person would, or the robot's
rim was in something that stands there.
"""

import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import dollop
from dollop.lab.outlines import outline_distances
from dollop.robot.tables import load_run

SLACK = 0.05
"""m: a cell of the map, by which the true outline may differ from it."""


def main(first, count, folder):
    """Run the worlds and print a line for each, then how they ended."""
    ends = Counter()
    for seed in range(first, first + count):
        place = Path(folder) / str(seed)
        place.mkdir(parents=True, exist_ok=True)
        end, told = by_shell(seed, place)
        ends[end] += 1
        print(f"{seed}: {end}{f': {told}' if told else ''}", flush=True)
    print(", ".join(f"{count} {end}" for end, count in ends.most_common()))


def by_shell(seed, folder):
    """How the world of a seed ends, and what was told of it."""
    from dollop.replication.worlds.draw import draw

    world = draw(seed)
    demonstrations = save_logs(world, folder)
    doubts = []
    for words in commands(len(world.demonstrations)):
        done = subprocess.run([sys.executable, "-m", "dollop", *words], cwd=folder, capture_output=True, text=True)
        said = done.stderr.strip().splitlines()
        if done.returncode == 1:
            return "refused", f"{words[0]}: {said[-1]}"
        if done.returncode == 3:
            last = done.stdout.splitlines()[0]
            doubts += [f"{words[0]}: {line}" for line in said if line.startswith("doubt")] or [f"{words[0]}: {last}"]
        if done.stdout.startswith("not finished"):
            return "not finished", done.stdout.splitlines()[0]
        if done.returncode not in (0, 3):
            return f"status {done.returncode}", f"{words[0]}: {said[-1:]}"
    if doubts:
        return "in doubt", doubts[0]
    wrong = what_is_wrong(world, demonstrations, folder)
    return ("silently wrong", wrong) if wrong else ("performed", done.stdout.splitlines()[0])


def save_logs(world, folder):
    """Save what the robot records, and return the recordings of the demonstrations."""
    from dollop.lab import record, watch
    from dollop.lab.simulate import record_tour

    dollop.write_log(folder / "empty.log.gz", record_tour(world.empty, world.tour, [world.seed, 20]))
    shown = [record(scene, [world.seed, 30, k]) for k, scene in enumerate(world.demonstrations)]
    for k, recording in enumerate(shown):
        dollop.write_log(folder / f"walk_{k}.log.gz", recording.log)
    look = watch(replace(world.later, people=()), [world.seed, 40])
    dollop.write_log(folder / "look.log.gz", look.log)
    return shown


def commands(count):
    """The four commands, for so many demonstrations."""
    walks = [f"walk_{k}.log.gz" for k in range(count)]
    yield ["map", "empty.log.gz", "room.yaml"]
    yield ["learn", *walks, "--map", "room.yaml", "--out", "task.json"]
    yield ["adapt", "task.json", "look.log.gz", "--map", "room.yaml", "--out", "now.json"]
    yield ["perform", "now.json", "--map", "room.yaml", "--out", "run.csv"]


def what_is_wrong(world, demonstrations, folder):
    """What is wrong by the truth of the world; empty if nothing is."""
    from dollop.replication.worlds import chain

    task, adapted = (dollop.Task.load(folder / name) for name in ("task.json", "now.json"))
    run = load_run(folder / "run.csv")
    judgement = chain.Judgement(results={"task": task, "adapted": adapted, "run": run, "recordings": demonstrations})
    judgement.results["now"] = type("Seen", (), {"environment": adapted.environment})
    chain.judge_learned(world, judgement)
    chain.judge_adapted(world, judgement)
    chain.judge_run(world, judgement)
    nearest = outline_distances(run.true_poses[:, :2], world.later.section).min(axis=1) - run.radius
    touched = [f"touched what stands there by {-nearest.min():.2f} m"] if nearest.min() < -SLACK else []
    return "; ".join([*judgement.causes, *touched])


if __name__ == "__main__":
    first, count, *rest = sys.argv[1:]
    with tempfile.TemporaryDirectory() as anywhere:
        main(int(first), int(count), rest[0] if rest else anywhere)
