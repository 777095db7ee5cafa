"""How robots of any size perform tasks in rooms drawn at random: python -m benchmarks.driving

    python -m benchmarks.driving [--radius 0.18 0.25 0.40] [--first 0] [--count 100] [--control pursuit|plain]
        [--workers 2] [--out TABLE.csv] [--pictures FOLDER] [--kidnappings 2] [--steps] [--pybullet]

A room, a walk of a person through it, the task that `dollop.learn` makes of it, at times adapted to moved objects, and
a robot of each radius with limits and a control period of its own that begins near the start at any heading, and is
kidnapped twice to places that are free for it (`benchmarks.furnished`). `dollop.perform` drives it.

What came of it is judged by an oracle that knows nothing of how Dollop measures: exact distances to boxes and to
occupied cells as squares, and a flood fill on a grid of 1.7 cm. A robot is *at* a subgoal within 0.25 m, which is where
a segment hands over. A *way of that width exists* where the start, all kidnapping poses and a place at each subgoal of
one of the task's ways lie in one part of the floor that is nowhere nearer to anything than radius + margin; for the
margins 0, 2, 5 and 6.7 cm.

touched      the exact clearance was below zero somewhere
told_error   the largest difference in m between the clearance told and the exact one, where one of both is below 0.5 m
wrong        finished, but was not at each of the last way's subgoals, to 5 cm, one after the other, nor ended there
no_way       what came of the runs where no way of the robot's own width exists, and how many of the unfinished said so
waits        of the pauses that were shown in runs that finished, how many the robot truly stood for, to a second

With more `--kidnappings` than two they come every four seconds on average, to places from which there is a way that is
6.7 cm wider than the robot: none of these runs may touch anything, or end unfinished. With `--steps` each run is driven
once more, by `dollop.Controller` in a loop of its own, and the commands are compared to the last digit.
"""

import argparse
import time
from contextlib import suppress
from pathlib import Path

import joblib
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import dollop
from benchmarks.furnished import drawn

RADII = 0.18, 0.25, 0.40
MARGINS = 0.0, 0.02, 0.05, 0.067
"""m."""
REACH, SLACK = 0.25, 0.05
"""m: within which a robot is at a subgoal, and how much farther off it may seem between two periods."""
USUAL, PAUSE = 2, 4.0
"""Kidnappings in a run; and, where there are more, s between two of them on average."""
STILL, BRIEF = 1e-4, 1.0
"""m in a period of a robot that stands; s by which a wait may be shorter than the one that was shown."""
SLOW = 20.0
"""ms: a step that takes longer is slow."""
GROUPS = ("radius",)
"""Columns by which runs are told apart."""
NO_WAY = "no way|no room|must be free|must lie"
"""What reasons say that a robot of this size cannot do the task here."""
FAR = 0.5
"""m: beyond it a clearance tells nothing."""


def task_of(room):
    """The task that was shown in a room, adapted to its objects as they stand now."""
    task = dollop.learn(room.shown)
    if "moved" in room.made:
        count = 4 * len(room.moved.boxes)
        task = task.adapt(room.moved, dollop.Matching(np.arange(count), 0.0, np.inf, True))
    return task


def robot_in(room, task, radius, kidnappings=USUAL):
    """A robot near the start of the task, and kidnappings (time, pose); None where it has no place to stand."""
    rng = np.random.default_rng([room.seed, round(1000 * radius), 15])
    limits = rng.uniform(0.2, 1.0), rng.uniform(0.5, 2.0), rng.uniform(0.2, 2.0), rng.uniform(0.5, 4.0)
    period = float(rng.choice([0.02, 0.05, 0.1, 0.2]))
    start = place_near(rng, room.now, task.law.start, radius)
    if start is None:
        return None
    length = np.hypot(*np.diff(task.law.response(), axis=0).T).sum()
    lasting = 3.0 + length / min(limits[0], 0.8)
    if kidnappings <= USUAL:
        places = room.now.random_places(rng, kidnappings, radius + 0.005)
        times = np.sort(rng.uniform(0.0, lasting, kidnappings))
    else:
        places = places_with_a_way(rng, room.now, task, start, radius, kidnappings)
        times = np.cumsum(rng.exponential(PAUSE, kidnappings))
    if len(places) < kidnappings:
        return None
    headings = rng.uniform(-np.pi, np.pi, 1 + kidnappings).tolist()
    poses = [(*place, heading) for place, heading in zip(places.tolist(), headings[1:], strict=True)]
    robot = Recorded((*start.tolist(), headings[0]), limits, period, radius=radius)
    return robot, list(zip(times.tolist(), poses, strict=True))


class Recorded(dollop.Unicycle):
    """A Unicycle that remembers what it was asked for."""

    def place(self, pose):
        """Put the robot somewhere."""
        super().place(pose)
        self.commands = getattr(self, "commands", [])

    def drive(self, speed, turn):
        """Drive for one period."""
        self.commands.append((speed, turn))
        super().drive(speed, turn)


def places_with_a_way(rng, truth, task, start, radius, count):
    """Places (count, 2) in m with a way that is wider than the robot; none where there is none from its start."""
    parts = truth.parts(radius + MARGINS[-1])
    there = truth.part_at(parts, start, REACH)
    good = [k for k in there if any(connected(truth, parts, {k}, way.subgoals) for way in task.ways)]
    rows, columns = np.nonzero(np.isin(parts, good))
    if not good:
        return np.empty((0, 2))
    chosen = rng.integers(len(rows), size=count)
    return np.column_stack([truth.points[0][columns[chosen]], truth.points[1][rows[chosen]]])


def place_near(rng, truth, place, radius):
    """A place (2,) free for a radius within half a metre of another, or as near as is found."""
    for spread in (0.15, 0.3, 0.5, 1.0, 2.0):
        places = place + rng.normal(0, spread, (100, 2))
        places = places[truth.distance(places) > radius + 0.005]
        if len(places):
            return places[0]
    return None


# ---- the oracle


def margin_of(room, task, radius, poses):
    """The largest margin with which a way of that width exists; -1 where none does."""
    held = -1.0
    for margin in MARGINS:
        parts = room.now.parts(radius + margin)
        common = set.intersection(*(room.now.part_at(parts, pose[:2]) for pose in poses))
        if not any(connected(room.now, parts, common, way.subgoals) for way in task.ways):
            break
        held = margin
    return held


def connected(truth, parts, common, subgoals):
    """Whether in one of some parts of the floor a robot can be at each subgoal (K, 2)."""
    for subgoal in subgoals:
        common = common & truth.part_at(parts, subgoal, REACH)
    return bool(common)


def missed(run, task):
    """Why a run that says it finished did not, or nothing; what it had done on another way counts as done."""
    way, within = int(run.way[-1]), REACH + SLACK
    subgoals, first, now = task.ways[way].subgoals, int(np.append(np.flatnonzero(run.way != way), -1).max()) + 1, 0
    places = run.true_poses[first:, :2]
    for k in range(int(run.active[first]) if first else 0, len(subgoals)):
        away = np.hypot(*(places[now:] - subgoals[k]).T)
        if not (away <= within).any():
            return f"subgoal {k} missed by {away.min():.2f} m"
        now += int(np.argmax(away <= within))
    end = np.hypot(*(places[-1] - subgoals[-1]))
    return "" if end <= within else f"ended {end:.2f} m from the last subgoal"


def judged(room, task, radius, control="pursuit", kidnappings=USUAL, steps=False):
    """One row of the table, and the run; the run is None where there is none."""
    row = {"seed": room.seed, "radius": radius, "kind": room.kind, "made": ", ".join(room.made)}
    ready = robot_in(room, task, radius, kidnappings)
    if ready is None:
        return row | {"outcome": "no way from the start" if kidnappings > USUAL else "no place to stand"}, None
    robot, kidnap = ready
    poses = [robot.pose, *(pose for _, pose in kidnap)]
    row |= {"margin": margin_of(room, task, radius, poses), "subgoals": len(task.law.subgoals), "period": robot.period}
    began = time.perf_counter()
    try:
        run = dollop.perform(task, robot, control, background=room.background, kidnap=kidnap)
    except Exception as error:
        outcome = "refused" if isinstance(error, ValueError) else "crashed"
        return row | {"outcome": outcome, "reason": f"{type(error).__name__}: {error}"}, None
    row |= {"step_ms": 1e3 * (time.perf_counter() - began) / len(run.t)} | measures(room, task, radius, run)
    if steps:
        again, _ = robot_in(room, task, radius, kidnappings)
        row |= stepped(task, again, control, room.background, kidnap, robot.commands)
    return row, run


def stepped(task, robot, control, background, kidnap, commands):
    """The same run by `Controller.step` in a loop of its own: whether it asks for the same, how long steps take."""
    places, kidnap, took = [pose for _, pose in kidnap], list(kidnap), []
    controller = dollop.Controller(task, robot, control, background=background, places=[robot.pose, *places])
    while not controller.over:
        if kidnap and len(took) * robot.period > kidnap[0][0] - robot.period / 2:
            robot.place(kidnap.pop(0)[1])
        began = time.perf_counter()
        command = controller.step(robot.pose)
        took.append(1e3 * (time.perf_counter() - began))
        robot.drive(*command)
    if controller.reason:
        robot.drive(0.0, 0.0)
    speed, turn = np.abs(np.array(robot.commands).reshape(-1, 2)).max(axis=0)
    return {
        "same": robot.commands == commands,
        "within_limits": bool(speed <= robot.limits.speed and turn <= robot.limits.turn),
        "median_step_ms": float(np.median(took)),
        "slow_steps": float(np.mean(np.array(took) > SLOW)),
        "slowest_step_ms": max(took),
    }


def measures(room, task, radius, run):
    """What the oracle says of a run, and the run of itself."""
    exact = room.now.distance(run.true_poses) - radius
    near = (exact < FAR) | (run.clearance < FAR)
    away = np.abs(run.clearance - exact)[near]
    wrong = missed(run, task) if run.finished else ""
    found = {
        "outcome": "wrong" if wrong else "finished" if run.finished else "not finished",
        "reason": wrong or run.reason,
        "touched": bool(exact.min() < 0),
        "clearance": exact.min(),
        "told_clearance": run.clearance.min(),
        "told_error": away.max(initial=0.0),
        "collisions": run.collisions,
        "kidnapped": len(run.kidnapped),
        "seconds": run.t[-1],
        "periods": len(run.t),
        "waits": len(run.waits),
        "kept": sum(stood_at(run, task, int(k)) > shown - BRIEF for k, shown, _ in run.waits),
    }
    with suppress(AttributeError):  # a run may tell more than it must
        found |= {"done": run.done, "reached": int(np.sum(run.reached)), "farthest": run.farthest}
        found["notes"] = "; ".join(note.kind for note in run.notes)
    return found


def stood_at(run, task, k):
    """How long in s a robot truly stood within 0.5 m of the start of its last way (k = 0) or of its k-th subgoal."""
    way, places = task.ways[int(run.way[-1])], run.true_poses[:, :2]
    there = np.hypot(*(places - [way.start, *way.subgoals][k]).T) < 2 * REACH
    still = np.hypot(*np.diff(places, axis=0).T) < STILL
    return float(np.diff(run.t)[still & there[1:]].sum())


# ---- rows, tables, pictures


def rows_of(seed, radii, pictures=None, **how):
    """The rows of a seed, one for each radius."""
    room = drawn(seed)
    try:
        task = task_of(room)
    except ValueError as error:
        told = {"kind": room.kind, "made": ", ".join(room.made), "outcome": "not learned", "reason": str(error)}
        return [{"seed": seed, "radius": radius} | told for radius in radii]
    rows = []
    for radius in radii:
        row, run = judged(room, task, radius, **how)
        rows.append(row)
        if pictures and is_failure(row):
            picture(room, task, row, run, radius, Path(pictures) / f"{seed}_{radius:g}.png")
    return rows


def is_failure(row):
    """Whether a row is no success: wrong, touched, crashed, or given up or refused where a way exists."""
    gave_up = row["outcome"] in ("not finished", "refused") and row["margin"] >= 0
    gave_up |= row.get("same") is False
    return gave_up or row["outcome"] in ("wrong", "crashed", "not learned") or row.get("touched") is True


def summary(table):
    """One row per radius."""
    return pd.DataFrame([of_radius(radius, part) for radius, part in table.groupby("radius")])


def of_radius(radius, part):
    """What came of the runs of one radius."""
    ran = part[part.outcome.isin(["finished", "wrong", "not finished"])]
    line = {"radius": radius, "runs": len(part), "driven": len(ran)}
    for margin in MARGINS:
        some = part[part.margin >= margin]
        line[f"way_{100 * margin:g}cm"] = f"{(some.outcome == 'finished').sum()}/{len(some)}"
    none = part[part.margin < 0]
    line["no_way"] = ", ".join(f"{n} {name}" for name, n in none.outcome.value_counts().items())
    unfinished = none[none.outcome != "finished"]
    line["said_so"] = f"{unfinished.reason.fillna('').str.contains(NO_WAY).sum()}/{len(unfinished)}"
    line |= {"touched": int(ran.touched.sum()), "told_touched": int((ran.collisions > 0).sum())}
    line |= {"wrong": int((part.outcome == "wrong").sum()), "crashed": int((part.outcome == "crashed").sum())}
    line |= {"told_error": ran.told_error.max(), "step_ms": ran.step_ms.median(), "step_ms_max": ran.step_ms.max()}
    done = part[part.outcome == "finished"]
    line["waits"] = f"{done.kept.sum():.0f}/{done.waits.sum():.0f}"
    line |= {"kidnappings": int(ran.kidnapped.sum()), "periods": int(ran.periods.sum())}
    if "same" in ran:
        line |= {"same": f"{(ran.same == True).sum()}/{len(ran)}", "beyond": int((ran.within_limits == False).sum())}  # noqa: E712
        line |= {"median_step_ms": ran.median_step_ms.median(), "slowest_step_ms": ran.slowest_step_ms.max()}
    return line


def reasons(table, groups=GROUPS):
    """How often each reason was given, by some columns and whether a way exists."""
    told = table[table.outcome != "finished"].copy()
    told["reason"] = told.reason.fillna("").str.replace(r"-?\d+(\.\d+)?", "#", regex=True)
    told["way"] = told.margin >= 0
    return told.groupby([*groups, "way", "outcome", "reason"]).size()


def picture(room, task, row, run, radius, path):
    """Draw what happened."""
    figure, axes = plt.subplots(figsize=(8, 7))
    truth = room.now
    x, y = truth.points
    shown = np.where(truth.clear <= 0, 2, np.where(truth.clear < radius, 1, 0))
    axes.imshow(shown, origin="lower", extent=(x[0], x[-1], y[0], y[-1]), cmap="Greys", vmin=0, vmax=2.5)
    for walks in (each.walks for each in room.shown):
        axes.plot(*walks[0].T, "-", color="tab:blue", lw=0.8, label="shown")
    for way in task.ways:
        axes.plot(*way.subgoals.T, "*", color="tab:orange", ms=10, label="subgoals")
        axes.plot(*way.start, "s", color="tab:orange", ms=6)
    if run is not None:
        places = run.true_poses[:, :2]
        jumps = np.flatnonzero(np.hypot(*np.diff(places, axis=0).T) > 0.3) + 1
        for part in np.split(places, jumps):
            axes.plot(*part.T, "-", color="tab:red", lw=1, label="robot")
            axes.plot(*part[0], "o", color="tab:green", ms=5)
        axes.add_patch(plt.Circle(places[-1], radius, fill=False, color="tab:red"))
        worst = places[truth.distance(places).argmin()]
        axes.plot(*worst, "x", color="tab:purple", ms=9)
    axes.set_title("\n".join(words(row)), fontsize=8, wrap=True)
    figure.savefig(path, dpi=80)
    plt.close(figure)


def words(row):
    """A failure in words."""
    way = "no way exists" if row.get("margin", -1) < 0 else f"a way exists, {row['margin']:g} m wider than the robot"
    head = f"seed {row['seed']}, radius {row['radius']:g} m, {row['kind']} ({row['made']}): {row['outcome']}"
    if "clearance" not in row or pd.isna(row["clearance"]):
        return head, str(row.get("reason", "")), way
    told = f"clearance {row['clearance']:.3f} m, told {row['told_clearance']:.3f} m and {row['collisions']} collisions"
    return head, str(row["reason"]), way, told, f"{row['seconds']:.0f} s"


def write_failures(table, folder):
    """All failures as Markdown beside their pictures."""
    lines = ["# Failures", "", "```", summary(table).to_string(index=False), "", reasons(table).to_string(), "```", ""]
    for row in table.sort_values(["outcome", "margin"], ascending=False).to_dict("records"):
        if is_failure(row):
            head, *rest = words(row)
            lines += [f"- **{head}** {'; '.join(rest)} ![]({row['seed']}_{row['radius']:g}.png)"]
    (Path(folder) / "failures.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def parsed(arguments=None):
    """What the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.driving", description=__doc__.split("\n")[0])
    parser.add_argument("--radius", type=float, nargs="+", help="in m, default: 0.18 0.25 0.4; the Pioneer's own")
    parser.add_argument("--first", type=int, default=0, help="seed")
    parser.add_argument("--count", type=int, help="of seeds, default: 100, and 30 with --pybullet")
    parser.add_argument("--control", default="pursuit", choices=["pursuit", "plain"])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", help="table as CSV")
    parser.add_argument("--pictures", help="folder for pictures of the failures")
    parser.add_argument("--kidnappings", type=int, default=USUAL, help="in each run")
    parser.add_argument("--steps", action="store_true", help="once more by Controller.step, and compare")
    parser.add_argument("--pybullet", action="store_true", help="the Pioneer, see benchmarks.driving_lab; 30 rooms")
    return parser.parse_args(arguments)


def main(arguments=None):
    options = parsed(arguments)
    if options.pybullet:
        from benchmarks import driving_lab as course

        radii = options.radius or [course.Pioneer.radius]
        jobs = [joblib.delayed(course.rows_of)(seed, radii) for seed in seeds_of(options, 30)]
    else:
        from benchmarks import driving as course

        how = {name: getattr(options, name) for name in ("control", "kidnappings", "steps", "pictures")}
        radii = options.radius or RADII
        jobs = [joblib.delayed(course.rows_of)(seed, radii, **how) for seed in seeds_of(options, 100)]
    if options.pictures:
        Path(options.pictures).mkdir(parents=True, exist_ok=True)
    parts = joblib.Parallel(options.workers)(jobs)
    table = pd.DataFrame([row for part in parts for row in part])
    if options.out:
        table.to_csv(options.out, index=False)
    if options.pictures and not options.pybullet:
        write_failures(table, options.pictures)
    print(course.summary(table).to_string(index=False))
    print(reasons(table, course.GROUPS).to_string())


def seeds_of(options, count):
    """The seeds that are asked for."""
    return range(options.first, options.first + (options.count or count))


if __name__ == "__main__":
    main()
