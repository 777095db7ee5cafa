"""Kill every command that writes, at each of its steps and at random moments, and look at what is left.

python tests/fuzzing/kills.py --kills 500 --seed 0

Runs are forked from this process, which has loaded everything, so that a kill costs little. After each:
what was read is as it was; files that belong together are all of the old run or all of the new one, the
main one there and others missing at most; and the next run leaves everything new, and nothing else.
"""

import argparse
import itertools
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import dollop
from dollop.checks import EXTRAS
from dollop.cli import main
from dollop.formats.kinds import PNG
from dollop.formats.writing import PART, whole_file

ROOT = Path(__file__).parents[2]
DATA = ROOT / "data"
OLD, NEW = 0, 1
RENAMES = "replace", "rename", "unlink", "link"
STEPS = (*RENAMES, "open", "fsync")
"""Functions of `os` at which a run is killed: before the call, or after it."""
KILLED = 9
MEMORY = "/dev/shm" if os.path.isdir("/dev/shm") else None
"""Where files are in memory, there they are tried: processes are killed here, and not the machine."""


@dataclass(frozen=True)
class Writer:
    """A command that writes.

    Attributes
    ----------
    name : str
    run : callable
        Takes a folder and a version, OLD or NEW, and writes what differs between the two.
    groups : tuple of tuple of str
        What it writes: names of files that belong together, the main one first.
    inputs : tuple of Path
        What is copied into the folder, to be read there.
    replication : bool
        Whether it belongs to the replication.
    """

    name: str
    run: object
    groups: tuple
    inputs: tuple = ()
    replication: bool = False


# ---- the commands that write


def two_scans(version):
    """A log of two scans."""
    ranges = np.full((2, 5), 2.0 + version)
    return dollop.LaserLog([0.0, 0.1], ranges, np.linspace(-1, 1, 5), np.zeros((2, 3)), max_range=8.0)


def small_map(version):
    """A map of a few cells."""
    return dollop.OccupancyGrid(np.eye(6 + version), (0.0, 0.0), 0.05)


def small_task(version):
    """A task shown once."""
    angle = np.linspace(0, np.pi, 50)
    walk = np.stack([2 + (1 + version) * np.cos(angle), np.sin(angle)], axis=1)
    boxes = np.array([[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4]])
    return dollop.Task.of(dollop.Demonstration(walk, dollop.Environment(boxes)))


TASKS = [small_task(version) for version in (OLD, NEW)]


def exports(folder, version):
    """The route graph of a task."""
    dollop.export(TASKS[version], folder / "route.geojson", "nav2")


def picture(path, version):
    """A picture, drawn."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(1, 1))
    ax.plot([0, 1 + version])
    with whole_file(path, kind=PNG) as stream:
        figure.savefig(stream, format="png")
    plt.close(figure)


def maps(name):
    """The command dollop map, to a name."""

    def run(folder, version):
        main(["map", f"{folder}/slalom_0.log.gz", f"{folder}/{name}", "--resolution", ("0.05", "0.1")[version]])

    return run


def observes(folder, version):
    """The command dollop observe, with everything that it can write."""
    log, out, tracks = f"{folder}/slalom_{version}.log.gz", f"{folder}/user.csv", f"{folder}/all.csv"
    main(["observe", log, f"{folder}/lab.yaml", "--out", out, "--tracks", tracks])


@cache
def seen(version):
    """What dollop observe finds."""
    log, background = dollop.read_log(DATA / f"slalom_{version}.log.gz"), dollop.OccupancyGrid.load(DATA / "lab.yaml")
    return dollop.observe(log, background)


def quickly_observes(folder, version):
    """The same, with what was found before, and a picture that takes no time to draw."""
    from dollop.cli import observing

    dollop.observe = lambda *_, **__: seen(version)

    def draw(found, background, path):
        with whole_file(path, kind=PNG) as stream:
            stream.write(b"\x89PNG\r\n\x1a\n%d" % version)

    observing._draw_observation = draw
    observes(folder, version)


def library(observes=observes):
    """Writers of the library."""
    logs, lab = (DATA / "slalom_0.log.gz", DATA / "slalom_1.log.gz"), (DATA / "lab.yaml", DATA / "lab.pgm")
    yield Writer("map .yaml", maps("room.yaml"), (("room.yaml", "room.pgm"),), logs[:1])
    yield Writer("map .map", maps("room.map"), (("room.map",),), logs[:1])
    yield Writer("map .map.gz", maps("room.map.gz"), (("room.map.gz",),), logs[:1])
    yield Writer("observe", observes, (("user.csv", "user.png", "all.csv"),), (*logs, *lab))
    yield Writer("task", lambda folder, version: TASKS[version].save(folder / "task.json"), (("task.json",),))
    yield Writer(
        "log", lambda folder, version: dollop.write_log(folder / "a.log.gz", two_scans(version)), (("a.log.gz",),)
    )
    yield Writer("route", exports, (("route.geojson",),))
    if find_spec(EXTRAS["lab"]):
        from dollop.lab import Recording

        shown = [Recording.load(path) for path in (DATA / "moved_cans_0.log.gz", DATA / "slalom_0.log.gz")]
        names = "a.log.gz", "a_truth.csv", "a_scene.json"
        yield Writer("scene", lambda folder, version: shown[version].scene.save(folder / "s.json"), (("s.json",),))
        yield Writer("recording", lambda folder, version: shown[version].save(folder / "a.log.gz"), (names,))


def figure(folder, version):
    """A figure whose drawing is small, with no type in it: to put a font into a PDF takes a second."""
    import matplotlib.pyplot as plt

    from dollop import figures as door
    from dollop.replication.figures import FIGURES

    def draw():
        drawn, ax = plt.subplots(figsize=(1, 1))
        ax.plot([0, 1 + version])
        ax.set_axis_off()
        return drawn, {"runs": version}

    FIGURES["8"] = replace(FIGURES["8"], draw=draw)
    door.main(["8", "--folder", str(folder)])


def data(folder, version):
    """The recordings of the notebooks, fewer and small ones in their place."""
    from dollop.lab import Recording
    from dollop.replication import recordings

    scene = Recording.load(DATA / "slalom_0.log.gz").scene
    truth = Recording.load(DATA / "moved_cans_0.log.gz").truth
    small = Recording(two_scans(version), truth, scene)
    recordings.LAYOUTS = ()
    recordings.empty_lab = lambda: two_scans(version)
    recordings.background_map = lambda: small_map(version)
    recordings.figure_eights = recordings.slalom = lambda *_: SimpleNamespace(recording=small)
    recordings.moved_cones = recordings.moved_cans = lambda *_: small
    recordings.save_all(folder)


def worlds(folder, version):
    """What follows from a study of worlds, with a small picture."""
    from dollop.replication.worlds import survey

    survey.draw_sheet = lambda seeds, path: picture(path, version)
    (folder / "study").mkdir(exist_ok=True)
    survey.publish(survey.read_table(ROOT / "study" / ("worlds.csv", "worlds_first.csv")[version]), folder / "study")


def replication():
    """Writers of the replication."""
    if not find_spec(EXTRAS["lab"]):
        return
    import matplotlib.backends.backend_agg
    import matplotlib.backends.backend_pdf  # noqa: F401

    import dollop.replication.figures
    import dollop.replication.worlds.survey  # noqa: F401, all of them before the first fork

    names = "figure_eights", "moved_cones", "slalom_0", "slalom_1"
    shown = [(f"{name}.log.gz", f"{name}_truth.csv", f"{name}_scene.json") for name in names]
    yield Writer("figures", figure, (("metrics.json", "README.md", "fig_08.png", "fig_08.pdf"),), (), True)
    yield Writer("data", data, (("empty_lab.log.gz", "lab.yaml", "lab.pgm"), *shown), (), True)
    written = "REPLICATION.md", "study/worlds.json", "study/worlds_worst.png"
    yield Writer("worlds", worlds, (written,), (ROOT / "REPLICATION.md",), True)


# ---- a run in a process of its own


def forked(work, *arguments):
    """The id of a process that does some work, and says nothing."""
    child = os.fork()
    if child:
        return child
    try:
        quiet = os.open(os.devnull, os.O_RDWR)
        os.dup2(quiet, 1), os.dup2(quiet, 2)
        work(*arguments)
        os._exit(0)
    except SystemExit as end:
        os._exit(end.code if isinstance(end.code, int) else 1)
    finally:
        os._exit(1)


def status_of(child):
    """The exit status of a process, negative if it was killed."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def killed_at(writer, folder, step, late, steps=STEPS):
    """Run a writer's new version, and end it hard before its k-th step, or after; whether it got there."""

    def work():
        left = itertools.count()

        def counted(call):
            def at_a_step(*arguments, **options):
                ours = call is not OPEN or str(arguments[0]).endswith(".part")
                here = ours and next(left) == step
                if here and not late:
                    os._exit(KILLED)
                try:
                    return call(*arguments, **options)
                finally:
                    if here:
                        os._exit(KILLED)

            return at_a_step

        for name in steps:
            setattr(os, name, counted(getattr(os, name)))
        writer.run(folder, NEW)

    return status_of(forked(work)) == KILLED


OPEN = os.open


def killed_after(writer, folder, seconds):
    """Run a writer's new version, and kill it after so many seconds; whether that came before its end."""
    child = forked(writer.run, folder, NEW)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    return status_of(child) == -signal.SIGKILL


# ---- what is left


class Trial:
    """A writer in a folder: what is there before and after a run, and how to get back to it.

    Parameters
    ----------
    writer : Writer
    place : Path
        An empty folder.
    fresh : bool
        Whether there is nothing to be replaced.
    """

    def __init__(self, writer, place, fresh=False):
        self.writer, self.folder, self.kept = writer, place / "now", place / "kept"
        self.names = [name for group in writer.groups for name in group]
        self.kept.mkdir()
        for path in writer.inputs:
            shutil.copy(path, self.kept)
        if not fresh:
            self.finish(self.kept, OLD)
        self.old = content(self.kept)
        self.reset()
        begin = time.perf_counter()
        self.finish(self.folder, NEW)
        self.seconds, self.new = time.perf_counter() - begin, content(self.folder)

    def finish(self, folder, version):
        """Run to the end."""
        status = status_of(forked(self.writer.run, folder, version))
        if status not in (0, 3):
            raise RuntimeError(f"{self.writer.name} ended with status {status}")

    def reset(self):
        """What was there before."""
        shutil.rmtree(self.folder, ignore_errors=True)
        shutil.copytree(self.kept, self.folder)

    def wrong(self):
        """What is wrong after a kill and after the next run: a list of words."""
        found = [*self.wrong_now()]
        try:
            self.finish(self.folder, NEW)
        except RuntimeError as error:
            return [*found, f"the next run: {error}"]
        now = content(self.folder)
        found += [f"after the next run {name} is not new" for name in self.new if now.get(name) != self.new[name]]
        return found + [f"litter after the next run: {name}" for name in now.keys() - self.new.keys()]

    def wrong_now(self):
        """What is wrong after a kill."""
        now = content(self.folder)
        for name in self.old.keys() - set(self.names):
            if now.get(name) != self.old[name]:
                yield f"the input {name} is destroyed"
        for name in now.keys() - self.old.keys() - set(self.names):
            if not PART.fullmatch(Path(name).name):
                yield f"{name} is neither input nor output"
        for group in self.writer.groups:
            if not any(self.of_one_run(now, run, *group) for run in (self.old, self.new)):
                yield f"mixed: {', '.join(f'{name} {self.state(now, name)}' for name in group)}"

    def of_one_run(self, now, run, main_file, *others):
        """Whether files are those of a run, some of the others missing at most."""
        right = (now.get(name) in (None, run.get(name)) for name in others)
        return now.get(main_file) == run.get(main_file) and all(right)

    def state(self, now, name):
        """Of which run a file is, in a word."""
        words = {id(self.new): "new", id(self.old): "old"}
        return next((words[id(run)] for run in (self.new, self.old) if now.get(name) == run.get(name)), "neither")


def content(folder):
    """Every file in a folder and those below, by its name."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


# ---- kills


def at_every_step(writer, fresh=False, steps=STEPS, moments=(False, True)):
    """Kill a writer before and after each of its steps.

    Parameters
    ----------
    writer : Writer
    fresh : bool
        Whether there is nothing to be replaced.
    steps : sequence of str
        Functions of `os`.
    moments : sequence of bool
        Before the call (False), or after it.

    Returns
    -------
    count : int
        How many kills.
    wrong : list of str
    """
    found, count = [], 0
    with tempfile.TemporaryDirectory(dir=MEMORY) as place:
        trial = Trial(writer, Path(place), fresh)
        for k in itertools.count():
            step, late = k // len(moments), moments[k % len(moments)]
            trial.reset()
            if not killed_at(writer, trial.folder, step, late, steps):
                break
            count += 1
            found += [f"{writer.name}, {'after' if late else 'before'} step {step}: {said}" for said in trial.wrong()]
    return count, found


def at_random_moments(writers, kills, seed):
    """Kill writers, each in turn, at random moments of their runs; what came too late does not count.

    Returns
    -------
    Counter
        How many kills of each writer.
    wrong : list of str
    """
    rng, done, found = random.Random(seed), Counter(), []
    with tempfile.TemporaryDirectory(dir=MEMORY) as place:
        trials = []
        for k, writer in enumerate(writers):
            (Path(place) / str(k)).mkdir()
            trials.append(Trial(writer, Path(place) / str(k)))
        for trial in itertools.cycle(trials):
            if done.total() >= kills:
                return done, found
            trial.reset()
            seconds = rng.uniform(0, trial.seconds)
            if killed_after(trial.writer, trial.folder, seconds):
                done[trial.writer.name] += 1
                found += [f"{trial.writer.name}, after {seconds:.4f} s: {said}" for said in trial.wrong()]


def command():
    """The long run; exit status 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description="Kill what writes, and look at what is left.")
    parser.add_argument("--kills", type=int, default=500, help="at random moments (default: 500)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    writers, wrong = [*library(), *replication()], []
    for writer, fresh in itertools.product(writers, (False, True)):
        count, found = at_every_step(writer, fresh, moments=(False,) if fresh else (False, True))
        print(f"{writer.name}{', nothing there before' if fresh else ''}: {count} kills at its steps", flush=True)
        wrong += found
    done, found = at_random_moments(writers, options.kills, options.seed)
    print(f"{done.total()} kills at random moments: {', '.join(f'{name} {n}' for name, n in done.items())}")
    for said in (*wrong, *found):
        print(said)
    print(f"{len(wrong) + len(found)} things are wrong")
    sys.exit(bool(wrong or found))


if __name__ == "__main__":
    command()
