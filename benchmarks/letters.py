"""How well a law follows letters and shapes in space and time: python -m benchmarks.letters [first last]

Every demonstration is scaled so that the diagonal of its bounding box is 3 m, and lasts as long as its samples say,
0.1 s each. A law with the default tolerance and a DMP (movement_primitives, 50 weights per dimension) learn from that
one demonstration. The letters G, S, Z were written by others (folder `letters` in DOLLOP_EXTERNAL_DATA); the shapes are
our own: arc, line, angle, spiral, J, sine, loop, turned, drawn by a hand that slows down in bends, sways by a few
millimetres and starts and stops softly, from the seeds first to last - 1.

All errors in % of the 3 m:

- rms: the root mean square distance at equal times between what is generated and the demonstration.
- late, all: pushed aside by 20 % of the size, to either side, at 30 % and 50 % of the way; the mean distance to the
  undisturbed path, by the way, over the last 70 % of what is left, and from the push on.
- corner: the largest turn at a hand-over, in degrees, between 10 cm before and 10 cm behind; shown: the demonstration's
  own there (of several subgoals the one with the largest excess).
- passed: the largest distance from a subgoal to the response.
"""

import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.io

from dollop.replication.recordings import hand_over_turns
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import arc_length, at_arc_length, distance_to_polyline, resample

SIZE, PERIOD, PUSH = 3.0, 0.1, 0.2
PUSHED_AT, LATE = (0.3, 0.5), 0.7


def read_letters(folder):
    """Name and demonstration (N, 2) in m of every G, S and Z."""
    for letter in "GSZ":
        demos = scipy.io.loadmat(folder / f"{letter}.mat")["demos"][0]
        yield from ((letter, scaled(demo["pos"][0, 0].T.astype(float))) for demo in demos)


def scaled(path):
    """A path (N, 2) with a bounding box of 3 m across."""
    return SIZE * (path - path[0]) / np.hypot(*np.ptp(path, axis=0))


def draw_shapes(seeds):
    """Name and demonstration (N, 2) in m of every shape, for every seed."""
    u = np.linspace(0, 1, 400)
    turn = np.pi * u
    shapes = {
        "arc": 1j * np.exp(-1j * turn),
        "line": 3 * u + 0j,
        "angle": np.where(u < 0.5, u + 1.6j * u, u + 1.6j * (1 - u)),
        "spiral": (1 - 0.7 * u) * np.exp(3j * turn),
        "J": np.where(u < 0.6, -5j * u, -3j - 1 + np.exp(-1j * np.pi * (u - 0.6) / 0.4)),
        "sine": 3 * u + 0.6j * np.sin(2 * np.pi * u),
        "loop": 3 * u - 0.9 * np.sin(2 * turn) + 0.9j * (1 - np.cos(2 * turn)),
    }
    for seed in seeds:
        for k, (name, shape) in enumerate(shapes.items()):
            rng = np.random.default_rng([seed, k])
            yield name, drawn(np.stack([shape.real, shape.imag], axis=1), rng)


def drawn(shape, rng):
    """A shape (M, 2) as a hand draws it, turned by any angle: (N, 2) in m, 0.1 s apart."""
    angle = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(angle), np.sin(angle)
    path = resample(scaled(shape) @ [[c, s], [-s, c]], 600)
    share = np.linspace(0, 1, len(path))[:, None]
    waves = np.sin(np.pi * np.arange(1, 5) * share + rng.uniform(0, 2 * np.pi, 4))
    path = path + 0.012 * waves @ rng.normal(size=(4, 2))
    ways = np.gradient(path, axis=0)
    headings = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
    bends = np.abs(np.convolve(np.gradient(headings), np.ones(15) / 15, "same")) / np.hypot(*ways.T)
    ends = np.sqrt(np.minimum(1, (np.minimum(share, 1 - share)[:, 0] + 0.002) / 0.08))
    speeds = rng.uniform(0.4, 0.8) * ends / (1 + bends / 1.5) ** (1 / 3)
    t = np.append(0, np.cumsum(np.hypot(*np.diff(path, axis=0).T) / speeds[1:]))
    samples = np.arange(0, t[-1], PERIOD)
    return scaled(np.stack([np.interp(samples, t, column) for column in path.T], axis=1))


def judge(path):
    """All measures of the law and of the DMP for one demonstration (N, 2)."""
    law = SequencedLDS.fit(path, sample_period=PERIOD)
    dmp = learned_dmp(path)
    late, whole = pushed_law(law, "held")
    late_paper, whole_paper = pushed_law(law, "paper")
    late_dmp, whole_dmp = np.mean([pushed_dmp(*dmp, k, s) for k, s in pushes()], axis=0)
    corner, shown = worst_corner(law, path)
    passed = distance_to_polyline(law.subgoals, law.response()).max()
    return {
        "segments": len(law.segments),
        "rms": rms(law.timed(PERIOD)[1], path), "rms_dmp": rms(dmp[1], path),
        "mean": 100 * law.error(path) / SIZE,
        "late": late, "late_dmp": late_dmp, "late_paper": late_paper,
        "all": whole, "all_dmp": whole_dmp, "all_paper": whole_paper,
        "corner": corner, "shown": shown, "passed": 100 * passed / SIZE,
    }  # fmt: skip


def pushed_law(law, method):
    """Mean over all pushes of what `pushed` tells of a law."""
    path = law.response(method=method)
    each = [pushed(path, lambda moved: law_from(law, moved, method), *push) for push in pushes()]
    return np.mean(each, axis=0)


def pushes():
    """Where along the way, and to which side."""
    return [(share, side) for share in PUSHED_AT for side in (-1, 1)]


def rms(positions, path):
    """Root mean square distance at equal times; who has arrived stays there."""
    n = max(len(positions), len(path))
    one, other = (each[np.minimum(np.arange(n), len(each) - 1)] for each in (positions, path))
    return 100 * np.sqrt(((one - other) ** 2).sum(axis=1).mean()) / SIZE


def pushed(path, follow, share, side):
    """Mean distance of the way after a push to the path, over its last 70 % and in all."""
    way = arc_length(path)[-1]
    before, place, after = at_arc_length(path, way * share + np.array([-0.02, 0, 0.02]))
    across = (after - before) @ [[0, 1], [-1, 0]] / np.hypot(*(after - before))
    return distances(follow((place, place + side * PUSH * SIZE * across)), path)


def distances(back, path):
    """Mean distance in % to a path of the way back to it, over its last 70 % and in all."""
    beside = 100 * distance_to_polyline(resample(back, 300), path) / SIZE
    return beside[int(300 * (1 - LATE)) :].mean(), beside.mean()


def law_from(law, moved, method):
    """The response from where it was pushed to, in the segment that was in force before."""
    place, start = moved
    parts = law.responses(method=method)
    beside = [distance_to_polyline(place[None], part)[0] if len(part) else np.inf for part in parts]
    return law.response(start, method=method, segment=int(np.argmin(beside)))


def worst_corner(law, path):
    """The law's turn in degrees at the hand-over where it exceeds the demonstration's most, and that one's."""
    turns = np.degrees(hand_over_turns(law))
    if not len(turns):
        return 0.0, 0.0
    way, goals = arc_length(path), law.subgoals[:-1]
    shown = np.degrees([turn_at(path, way[np.hypot(*(path - goal).T).argmin()]) for goal in goals])
    k = (turns - shown).argmax()
    return turns[k], shown[k]


def turn_at(path, way):
    """How far in rad a path turns within 10 cm before and behind; of three places 3 cm apart the most."""
    places = [at_arc_length(path, way + np.array([-0.03, 0.0, 0.03]) + shift) for shift in (-0.1, 0.0, 0.1)]
    arriving, going_on = np.diff(places, axis=0) @ (1, 1j)
    return np.abs(np.angle(going_on * arriving.conj())).max()


def learned_dmp(path):
    """A DMP (movement_primitives) of a demonstration, and what it generates."""
    try:
        from movement_primitives.dmp import DMP
    except ImportError as error:
        raise SystemExit("the benchmark needs movement_primitives: pip install movement_primitives") from error
    t = PERIOD * np.arange(len(path))
    dmp = DMP(2, execution_time=t[-1], dt=PERIOD, n_weights_per_dim=50)
    dmp.imitate(t, path)
    dmp.configure(start_y=path[0], goal_y=path[-1])
    return dmp, dmp.open_loop()[1]


def pushed_dmp(dmp, path, share, side):
    """As `pushed`, of a DMP: its phase goes on with time."""
    way = arc_length(path)
    n = int(np.searchsorted(way, share * way[-1]))
    before, place, after = at_arc_length(path, way[n] + np.array([-0.02, 0, 0.02]))
    across = (after - before) @ [[0, 1], [-1, 0]] / np.hypot(*(after - before))
    dmp.reset()
    y, yd = path[0].copy(), np.zeros(2)
    steps = []
    for i in range(len(path)):
        if i == n:
            dmp.current_y += side * PUSH * SIZE * across
        y, yd = dmp.step(y, yd)
        steps.append(y.copy())
    dmp.reset()
    return distances(np.array(steps[n:]), path)


def main(first=0, last=3):
    """One line per shape, and the medians."""
    shown = list(draw_shapes(range(first, last)))
    if "DOLLOP_EXTERNAL_DATA" in os.environ:
        shown += read_letters(Path(os.environ["DOLLOP_EXTERNAL_DATA"], "letters"))
    else:
        print("DOLLOP_EXTERNAL_DATA does not name the folder with the letters: only our own shapes", file=sys.stderr)
    table = pd.DataFrame([{"shape": name, **judge(path)} for name, path in shown])
    by_shape = table.groupby("shape", sort=False)
    print(by_shape.median().to_string(float_format="%.2f"))
    print("\nmedian and largest of all", len(table))
    print(table.drop(columns="shape").agg(["median", "max"]).T.to_string(float_format="%.2f"))
    return table


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
