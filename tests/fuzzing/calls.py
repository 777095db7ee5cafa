"""Hostile calls of the public names: one argument or two are what nobody should give."""

import contextlib
import dataclasses
import json
import tempfile
import warnings
from collections import namedtuple
from fractions import Fraction
from functools import cache, partial
from pathlib import Path

import numpy as np
from damage import pick
from kinds import (
    ANGLES,
    CANS,
    check_task,
    finite,
    flaser_lines,
    long_log,
    small_demonstration,
    small_map,
    small_scans,
)
from watch import Wrong

import dollop
from dollop import (
    LDS,
    Association,
    Demonstration,
    Environment,
    Frames,
    LaserLog,
    Matching,
    Motion,
    Note,
    Observer,
    OccupancyGrid,
    Route,
    SequencedLDS,
    SubgoalHMM,
    Task,
    Track,
    Tracker,
    Unicycle,
)
from dollop.lds import Statistics
from dollop.robot import Limits

Call = namedtuple("Call", "function arguments may", defaults=((),))
"""What is called, with which valid arguments by name, and what else than a finite number may come of it."""
DEEPEST, WIDEST = 6, 60
NUMBERS, RECORDS = "numbers and arrays", "in place of records"
"""Kinds of calls, by what the hostile argument takes."""
MAY = {
    "ranges": (np.inf,), "occupancy": (np.nan,), "directions": (np.nan,), "measurements": (np.nan,),
    "probability": (np.nan,), "margin": (np.inf,), "first": (np.inf, np.nan),
    "Run.clearance": (np.inf, np.nan), "Run.poses": (np.inf, np.nan), "Run.true_poses": (np.inf, np.nan),
    "Route.clearance": (np.inf,),
    "gate": (np.inf,), "gate_min": (np.inf,), "gate_max": (np.inf,), "disappear_after": (np.inf,),
}  # fmt: skip
"""Fields in which other than finite numbers mean something, by what they mean."""


# ---- what nobody should give


def masked(shape):
    """An array of which a part is masked."""
    values = np.ma.array(np.ones(shape), mask=False)
    values[..., 0] = np.ma.masked
    return values


def pandas_of(shape):
    """A table, or a column."""
    import pandas as pd

    values = np.ones(shape)
    return pd.DataFrame(values) if values.ndim == 2 else pd.Series(values.ravel())


SCALARS = (
    np.nan, np.inf, -np.inf, -0.0, 0, 0.0, -1, 1, 2, 3, 0.5, 1e-9, 1e9, 1.1e9, 1e17, 1e155, 1e200, 1e308, -1e308,
    5e-324, 10**30, 10**400,
    -(10**400), 2**63, True, False, None, "abc", "", "1", "nan", "fastest", b"x", 1j, np.float16(1),
    np.float16("inf"), np.uint8(3),
    np.int64(-(2**63)), np.longdouble("1e4000"), np.datetime64("2001-01-01"), np.timedelta64(1), np.str_("x"),
    Fraction(1, 3), object, Ellipsis,
    (), [], {}, set(), {"a": 1}, (1, 2), [1, [2, 3]], [[]], "x" * 10_000, print, np.array(1.0), np.array([1.0]),
    np.array(None), 7.5, 1000, 100_000,
)  # fmt: skip
ARRAYS = (
    partial(masked, (4, 2)), partial(masked, (5,)), partial(pandas_of, (4, 2)), partial(pandas_of, (3,)),
    lambda: np.array([[1, None], [2, 3]], dtype=object), lambda: np.array([[1, 2], [3, 4]], dtype=object),
    lambda: np.array([["1", "2"], ["3", "4"]]),
    lambda: np.ones((4, 2)) * 1j, lambda: np.ones((4, 2)) * (1 + 0j), lambda: np.empty((0, 2)), lambda: np.empty((0,
    4)), lambda: np.empty((0,)), lambda: np.empty((3, 0)),
    lambda: np.ones((2, 2, 2)), lambda: np.ones(7), lambda: np.ones((5, 3)), lambda: np.ones((1, 2)),
    lambda: np.zeros((10, 2)), lambda: np.zeros((2, 4)),
    lambda: [[1, 2], [3]], lambda: [[1, 2], [3, "a"]], lambda: (x for x in [[1.0, 2.0], [2.0, 3.0]]),
    lambda: range(5), lambda: {"x": [1.0, 2.0]}, lambda: {1.0, 2.0},
    lambda: np.arange(20, dtype=np.uint8).reshape(10, 2), lambda: np.arange(20, dtype=np.float16).reshape(10, 2),
    lambda: np.ones((6, 2), bool),
    lambda: np.full((6, 2), 1e308), lambda: np.full((6, 2), 1e155) * ([[1], [-1]] * 3), lambda: np.full((6, 2),
    5e-324), lambda: np.full((6, 2), np.nan),
    lambda: np.cumsum(np.ones((6, 2)), axis=0) * 1e17, lambda: np.cumsum(np.ones((6, 2)), axis=0) * 1e8,
    lambda: np.array([[0, 0], [1e9, 1e9], [0, 1.0]]), lambda: np.cumsum(np.ones((40, 2)), axis=0) * 1e-300,
    lambda: np.broadcast_to(0.0, (10**6, 2)), lambda: np.broadcast_to(1.0, (10**9, 2)), lambda: np.broadcast_to(0.5,
    (10**5, 10**5)), lambda: np.broadcast_to(1.0, (10**10,)),
    lambda: np.random.default_rng(0).normal(size=(20_000, 2)).cumsum(axis=0), lambda: np.zeros(3, dtype=[("a",
    float), ("b", int)]), lambda: np.array(["2001-01-01"], "M8[D]"),
    lambda: np.array([10**400, 1], dtype=object), lambda: [10**400, 1], lambda: [None, None], lambda: [True, False],
    lambda: ["1", "2"], lambda: np.matrix([[1, 2], [3, 4]]),
    lambda: memoryview(b"abcdefgh"), lambda: [np.ones((5, 2)), np.ones((4, 3))], lambda: [np.ones((3, 2))] * 3,
    lambda: [[0, 0], [0, 0]], lambda: np.asfortranarray(np.ones((4, 2)))[::-1],
)  # fmt: skip


def hostile(value, rng):
    """Something in the place of a valid value: anything, or nearly that value."""
    if rng.random() < 0.3:
        return pick(rng, SCALARS)
    if rng.random() < 0.45:
        return pick(rng, ARRAYS)()
    return nearly(value, rng)


def nearly(value, rng):
    """A value that is valid but for one thing."""
    if isinstance(value, np.ndarray) or is_rows(value):
        return nearly_array(np.array(value), rng)
    if isinstance(value, bool) or value is None:
        return pick(rng, (0, 1, 2, "yes", np.bool_(True), None, [], np.nan))
    if isinstance(value, int | float):
        return pick(rng, (
            -value, value * 1e308, value * 1e17, value * 1e9, value * 1e3, value * 1e-9, value * 1e-300, str(value),
            [value], np.array([value] * 3),
            np.float16(value), bool(value), complex(value), Fraction(value), np.ma.masked, np.array(value,
            dtype=object), value + 0.5, np.float32(value),
        ))  # fmt: skip
    if isinstance(value, str):
        return pick(rng, (value.upper(), value + " ", "", value.encode(), [value], np.str_(value), {value}, None))
    if isinstance(value, list | tuple) and value:
        return pick(
            rng,
            (
                value[:-1],
                [*value, value[0]],
                value[::-1],
                [],
                dict(enumerate(value)),
                iter(value),
                value[0],
                [*value, None],
                [None] * len(value),
                (value,),
            ),
        )
    return pick(rng, (type(value), None, [value], "abc", {}, object(), 5, Empty()))


class Empty:
    """A thing that has nothing of what is asked of it."""


def is_rows(value):
    """Whether a list holds rows of numbers."""
    if not isinstance(value, list | tuple) or not value:
        return False
    try:
        return np.array(value).dtype.kind in "fiu"
    except ValueError:
        return False


def nearly_array(array, rng):
    """An array that is valid but for one thing."""
    changed = array.astype(float) if array.dtype.kind in "fiub" else array.copy()
    if array.size and rng.random() < 0.45:
        changed.flat[int(rng.integers(array.size))] = pick(
            rng, (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e155, 1e17, 1e9, 1e6, -1, 0, 0.5, 5e-324, 1e-9)
        )
        return changed
    return pick(rng, (
        lambda: changed * 1e308, lambda: changed * 1e155, lambda: changed * 1e17, lambda: changed * 1e9,
        lambda: changed * 1e5, lambda: changed * 1e-200, lambda: changed + 1e9, lambda: changed + 1e17,
        lambda: -changed, lambda: changed * 0, lambda: changed[::-1], lambda: changed.T, lambda: changed[None],
        lambda: changed[..., None], lambda: changed[:1],
        lambda: changed[:0], lambda: changed[:2], lambda: changed[:-1], lambda: changed.ravel(),
        lambda: np.concatenate([changed] * 2), lambda: changed.astype(complex),
        lambda: changed.astype(object), lambda: changed.astype(str), lambda: np.ma.masked_array(changed,
        changed > np.median(changed) if changed.size else False), lambda: changed.astype(np.float16),
        lambda: changed.astype(bool), lambda: changed.tolist(), lambda: iter(changed.tolist()),
        lambda: array.astype(np.float32), lambda: np.repeat(changed, 2, axis=0), lambda: np.round(changed),
        lambda: changed.astype(np.longdouble), lambda: np.insert(changed, 0, np.nan, axis=0),
        lambda: changed.astype(bytes), lambda: {"values": changed}, lambda: Lazy(changed),
    ))()  # fmt: skip


class Lazy:
    """What numpy makes an array of by itself."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return np.array(self.values, dtype=dtype)


# ---- what is called


@cache
def valid():
    """Records that are right, to call and to give."""
    shown = [small_demonstration(), small_demonstration(0.2)]
    task, environment = dollop.learn(shown), shown[0].environment
    law = task.law
    log = small_scans()
    found = dollop.observe(long_log(), small_map())
    track = Track(np.arange(5.0), np.ones((5, 2)), np.ones((5, 2)), np.zeros(5, bool), np.ones((5, 2)))
    walk = shown[0].walks[0]
    angle = np.linspace(0, 5 * np.pi, 200)
    return {
        "shown": shown, "task": task, "paper": Task.of(shown[0], method="paper"), "environment": environment,
        "law": law, "log": log,
        "found": found, "track": track, "walk": walk, "map": small_map(), "lds": LDS.fit([walk]),
        "model": SubgoalHMM.fit([[(0, 0), (2, 0), (2, 2)], [(0.1, 0), (2, 0.1), (2, 2.1)]]),
        "moved": Environment(environment.boxes + 0.1), "eights": np.column_stack([np.cos(angle),
        np.sin(2 * angle)]), "times": angle,
        "matching": dollop.match(environment, environment), "tied": dollop.associate(walk[::8], environment),
        "odometry": dollop.formats.Odometry(log.t, log.poses, np.zeros((len(log), 2))),
        "frames": Frames([(0.0, 0.0), (1.0, 1.0)], [0.0, 1.0]), "run": dollop.perform(task, Unicycle((0.4, 1.7,
        0.0)), timeout=3.0),
    }  # fmt: skip


def observed(t, ranges, pose):
    """An observer that has taken a scan, and then takes another."""
    log, observer = small_scans(), Observer(small_map(), ANGLES)
    observer.step(log.t[0], log.ranges[0], log.poses[0])
    observer.step(t, ranges, pose)
    observer.step(log.t[3], log.ranges[3], log.poses[3])
    return observer.observation()


def driven(pose, speed, turn, limits, period):
    """A robot that drives for two periods."""
    robot = Unicycle(pose, limits, period)
    robot.drive(speed, turn)
    robot.drive(speed, turn)
    return robot.pose


def performed(task, pose, limits, period, **more):
    """A task performed by a robot."""
    return dollop.perform(task, Unicycle(pose, limits, period), **({"timeout": 3.0} | more))


@cache
def calls():
    """All calls, by name."""
    v = valid()
    log, grid, environment, task, law, walk = (v[name] for name in ("log", "map", "environment", "task", "law", "walk"))
    scans = {"t": log.t, "ranges": log.ranges, "angles": log.angles, "poses": log.poses, "max_range": 8.0}
    G = np.array([[2.0, 0.1], [0.1, 1.0]])
    nan, inf = (np.nan,), (np.inf,)
    statistics = v["lds"].statistics
    return {
        "LaserLog": Call(LaserLog, scans | {"notes": ()}),
        "OccupancyGrid": Call(OccupancyGrid, {"occupancy": grid.occupancy, "origin": (0.0, 0.0), "resolution": 0.1}),
        "OccupancyGrid.from_log": Call(OccupancyGrid.from_log, {"log": log, "resolution": 0.1, "max_range": 20.0}),
        "OccupancyGrid.world_to_cell": Call(grid.world_to_cell, {"points": walk}),
        "OccupancyGrid.cell_centres": Call(grid.cell_centres, {"cells": np.array([[1, 2], [3, 4]])}),
        "OccupancyGrid.covers": Call(grid.covers, {"points": walk}),
        "OccupancyGrid.distance_at": Call(grid.distance_at, {"points": walk}, nan),
        "OccupancyGrid.way_length": Call(grid.way_length, {"place": (1.0, 1.0), "other": (2.0, 2.0), "radius": 0.15,
            "most": 50.0}, inf),
        "OccupancyGrid.save": Call(grid.save, {"path": "nowhere/a.yaml"}),
        "write_log": Call(partial(dollop.write_log, "a.log"), {"log": log}),
        "read_log": Call(dollop.read_log, {"path": "nowhere.log", "topic": None, "fov": 3.0}),
        "read_log of a log": Call(read_back, {"topic": None, "fov": None}),
        "OccupancyGrid.load": Call(OccupancyGrid.load, {"path": "nowhere.yaml"}),
        "Task.load": Call(Task.load, {"path": "nowhere.json"}),
        "observe": Call(dollop.observe, {"log": log, "background": grid, "user": "fastest", "method": "people",
            "background_radius": 0.2, "min_area": 0.01}),
        "observe, paper": Call(dollop.observe, {"log": log, "background": grid, "method": "paper",
            "background_radius": 0.2, "min_area": 0.01, "user": "fastest"}),
        "Observer": Call(Observer, {"background": grid, "angles": ANGLES, "user": (1.0, 1.0),
            "background_radius": 0.2, "min_area": 0.01}),
        "Observer.step": Call(observed, {"t": 100.05, "ranges": log.ranges[1], "pose": log.poses[1]}),
        "localise": Call(dollop.localise, {"log": log, "odometry": v["odometry"], "background": grid, "laser": (0.0,
            0.0, 0.0), "seed": 0}),
        "Odometry": Call(dollop.formats.Odometry, {"t": log.t, "poses": log.poses, "velocities": np.zeros((4, 2))}),
        "laps": Call(dollop.laps, {"t": v["times"], "positions": v["eights"]}),
        "LDS.fit": Call(LDS.fit, {"trajectories": [walk], "retimed": True}),
        "LDS": Call(LDS, {"statistics": statistics, "goal": (1.0, 2.0)}),
        "Statistics": Call(Statistics, {"G0": G, "G1": G * 0.9}),
        "LDS of statistics": Call(lambda G0, G1, goal: LDS(Statistics(G0, G1), goal).A, {"G0": G, "G1": G * 0.9,
            "goal": (1.0, 2.0)}),
        "Statistics.of": Call(Statistics.of, {"samples": walk}),
        "LDS.step": Call(v["lds"].step, {"x": walk[:3]}),
        "LDS.response": Call(v["lds"].response, {"x0": (0.0, 0.0), "n": 20}),
        "LDS.lyapunov": Call(v["lds"].lyapunov, {"x": walk[:3]}),
        "LDS.turned": Call(v["lds"].turned, {"angle": 0.3}),
        "SequencedLDS.fit": Call(SequencedLDS.fit, {"trajectories": walk, "tolerance": 0.05, "n_segments": None,
            "retimed": True, "sample_period": 0.1, "candidates": 12}),
        "SequencedLDS.fit, segments": Call(SequencedLDS.fit, {"trajectories": walk, "n_segments": 2,
            "candidates": 12}),
        "SequencedLDS": Call(SequencedLDS, {"segments": law.segments, "start": law.start, "speeds": law.speeds}),
        "SequencedLDS.response": Call(law.response, {"start": (0.4, 1.4), "reach": 0.01, "method": "held",
            "segment": 0}),
        "SequencedLDS.responses": Call(law.responses, {"start": (0.4, 1.4), "reach": 0.01, "method": "held",
            "segment": 0}),
        "SequencedLDS.timed": Call(law.timed, {"period": 0.1}),
        "SequencedLDS.error": Call(law.error, {"trajectory": walk}),
        "SequencedLDS.errors": Call(law.errors, {"trajectory": walk}),
        "SequencedLDS.with_subgoals": Call(law.with_subgoals, {"subgoals": law.subgoals, "start": law.start,
            "turned": False}),
        "SequencedLDS.lines": Call(law.lines, {"reach": 0.01}),
        "moved law's response": Call(lambda subgoals, start: law.with_subgoals(subgoals, start).response(),
            {"subgoals": law.subgoals, "start": law.start}),
        "Environment": Call(lambda **a: corners_of(Environment(**a)), {"boxes": np.array(CANS),
            "assumed": np.zeros((2, 4), bool), "directions": [0.1, 0.2], "seen": None}),
        "match": Call(dollop.match, {"environment_i": environment, "environment_j": v["moved"], "method": "robust",
            "moved": 0.4}),
        "match of boxes": Call(lambda i, j, method: dollop.match(Environment(i), Environment(j), method),
            {"i": np.array(CANS), "j": np.array(CANS) + 0.1, "method": "robust"}),
        "match, literal": Call(dollop.match, {"environment_i": environment, "environment_j": v["moved"],
            "method": "literal"}),
        "Matching": Call(Matching, {"indices": np.arange(8), "cost": 1.0, "margin": 1.0, "confident": True,
            "turn": 0.0, "probability": 0.9}),
        "Matching.identity": Call(Matching.identity, {"n": 3}),
        "Matching.of_partners": Call(Matching.of_partners, {"partners": [0, 1], "turn": 0.0}),
        "associate": Call(dollop.associate, {"subgoals": law.subgoals, "environment": environment, "m": 4}),
        "Association": Call(Association, {name: getattr(v["tied"], name) for name in ("environment", "corners",
            "weights", "differences")}),
        "Association.relocate": Call(v["tied"].relocate, {"environment": v["moved"], "matching": v["matching"],
            "turned": False}),
        "Association made and moved": Call(lambda **a: Association(environment, **a).relocate(environment),
            {name: getattr(v["tied"], name) for name in ("corners", "weights", "differences")}),
        "Association.carried": Call(v["tied"].carried, {"environment": v["moved"], "matching": v["matching"]}),
        "Frames": Call(Frames, {"positions": [(0.0, 0.0), (1.0, 1.0)], "directions": [0.0, 1.0]}),
        "associate_with_frames": Call(dollop.associate_with_frames, {"subgoals": [law.subgoals, law.subgoals + 0.1],
            "frames": [v["frames"], v["frames"]]}),
        "SubgoalHMM.fit": Call(SubgoalHMM.fit, {"sequences": [walk[::6], walk[::6] + 0.05], "spread": 0.15}),
        "SubgoalHMM.fit, spread": Call(SubgoalHMM.fit, {"sequences": [walk[::6], walk[::6] + 0.05], "spread": None}),
        "SubgoalHMM.add": Call(v["model"].add, {"sequence": walk[::6]}),
        "SubgoalHMM.states_of": Call(v["model"].states_of, {"sequence": walk[::6]}),
        "SubgoalHMM.log_likelihood": Call(v["model"].log_likelihood, {"sequence": walk[::6]}, (-np.inf,)),
        "Demonstration": Call(Demonstration, {"trajectory": walk, "environment": environment, "sample_period": 0.1,
            "tolerance": 0.02, "notes": ()}),
        "Demonstration of several": Call(Demonstration, {"trajectory": [walk, walk + 0.01],
            "environment": environment}),
        "Demonstration.of": Call(Demonstration.of, {"observation": v["found"], "tolerance": 0.02}),
        "learn": Call(dollop.learn, {"demonstrations": v["shown"], "environment": environment, "matchings": None,
            "method": "anchored", "spread": 0.15}),
        "learn, paper": Call(dollop.learn, {"demonstrations": v["shown"], "environment": environment,
            "method": "paper", "spread": 0.15}),
        "learn from walks": Call(learned, {"walk": walk, "boxes": np.array(CANS), "sample_period": 0.1,
            "tolerance": 0.05}),
        "Task": Call(Task, {"law": law, "environment": environment, "association": v["tied"],
            "demonstrations": tuple(v["shown"]), "notes": ()}),
        "Task.of": Call(Task.of, {"demonstration": v["shown"][0], "method": "anchored"}),
        "Task.adapt": Call(task.adapt, {"environment": v["moved"], "matching": v["matching"], "turned": False}),
        "Task.adapt, paper": Call(v["paper"].adapt, {"environment": v["moved"], "matching": v["matching"],
            "turned": True}),
        "Task.adapt to boxes": Call(lambda boxes, turned: task.adapt(Environment(boxes), turned=turned),
            {"boxes": np.array(CANS) + 0.1, "turned": False}),
        "Task.add": Call(task.add, {"demonstration": v["shown"][1], "spread": 0.15, "matching": v["matching"]}),
        "Task.save": Call(task.save, {"path": "nowhere/a.json"}),
        "Route.of": Call(Route.of, {"task": task, "tolerance": 0.01, "spacing": 0.5}),
        "Route": Call(Route, {field.name: getattr(Route.of(task), field.name) for field in dataclasses.fields(Route)}),
        "export": Call(exported, {"task": task, "path": "a.geojson", "to": "nav2"}),
        "export of what was moved": Call(lambda subgoals, start, pauses: exported(dataclasses.replace(task, ways=(
            dataclasses.replace(law.with_subgoals(subgoals, start), pauses=pauses),)), "a.yaml", "waypoints"),
            {"subgoals": law.subgoals, "start": law.start, "pauses": law.pauses}),
        "Unicycle": Call(driven, {"pose": (0.4, 1.7, 0.0), "speed": 0.3, "turn": 0.1, "limits": Limits(0.5, 0.8,
            0.5, 1.57), "period": 0.1}),
        "Limits": Call(Limits, {"speed": 0.5, "turn": 0.8, "acceleration": 0.5, "turn_acceleration": 1.57}),
        "perform": Call(performed, {"task": task, "pose": (0.4, 1.7, 0.0), "limits": Limits(0.5, 0.8, 0.5, 1.57),
            "period": 0.1, "control": "pursuit", "avoid": True, "background": grid, "kidnap": [(1.0, (2.0, 2.0,
            0.0))], "timeout": 3.0, "localise_within": 2.0}),
        "perform without a map": Call(performed, {"task": task, "pose": (0.4, 1.7, 0.0), "limits": Limits(0.5, 0.8,
            0.5, 1.57), "period": 0.1, "control": "plain", "avoid": False, "kidnap": (), "timeout": 3.0}),
        "Run": Call(dollop.Run, {field.name: getattr(v["run"],
            field.name) for field in dataclasses.fields(v["run"])}),
        "Motion": Call(Motion, {"order": 2, "noise": 0.5, "measurement_sd": 0.06}),
        "Motion.transition": Call(Motion().transition, {"dt": 0.1}),
        "Tracker": Call(Tracker, {"motion": Motion(), "matching": "greedy", "occlusion": "kalman", "gate": 3.0,
            "gate_min": 0.5, "gate_max": 1.5, "disappear_after": 5.0}),
        "Track": Call(Track, {field.name: getattr(v["track"],
            field.name) for field in dataclasses.fields(v["track"])}),
        "Note": Call(Note, {"kind": "a", "text": "b", "doubt": True}),
    }  # fmt: skip


def corners_of(environment):
    """All that an environment tells."""
    return environment.corners, environment.centres, environment.corner_offsets, environment


def learned(walk, boxes, sample_period, tolerance):
    """A task from one walk, adapted."""
    environment = Environment(boxes)
    task = dollop.learn([Demonstration(walk, environment, sample_period, tolerance)])
    return task.law.response(), task.law.timed(), task.adapt(environment).law.response(), task


def exported(task, path, to):
    """A route that is written, of which nothing but a whole file is left."""
    route = dollop.export(task, path, to)
    if Path(path).name.endswith("json"):
        json.loads(Path(path).read_text(), parse_constant=no_number)
    return route


def no_number(name):
    """What JSON has not."""
    raise Wrong(f"JSON has no {name}")


def read_back(topic, fov):
    """A log of FLASER messages that is read."""
    Path("a.log").write_bytes(flaser_lines())
    return dollop.read_log("a.log", topic, fov)


# ---- what comes of it


def check_result(value, may=(), name="the result", depth=0):
    """Every number of a result is finite, but for what may be otherwise."""
    if depth > DEEPEST or value is None or isinstance(value, str | bytes):
        return
    if isinstance(value, np.ndarray | complex | np.complexfloating) and np.asarray(value).dtype.kind not in "fiub":
        raise Wrong(f"{name} is of {np.asarray(value).dtype.name}")
    if isinstance(value, np.ma.MaskedArray | np.matrix):
        raise Wrong(f"{name} is a {type(value).__name__}")
    if isinstance(value, np.ndarray) and value.size > 10**7:
        raise Wrong(f"{name} is huge")
    if isinstance(value, np.ndarray | float | np.floating):
        finite(name, value, may)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            inner = f"{type(value).__name__}.{field.name}"
            allowed = MAY.get(inner, MAY.get(field.name, may))
            check_result(getattr(value, field.name), allowed, inner, depth + 1)
    elif isinstance(value, dict):
        check_result(list(value.values()), may, name, depth)
    elif isinstance(value, list | tuple):
        for each in value[:WIDEST]:
            check_result(each, may, name, depth + 1)


def is_record(value):
    """Whether a valid argument is a record, or a list of some, and not numbers, text or nothing."""
    first = value[0] if isinstance(value, list | tuple) and value else value
    return not isinstance(first, int | float | str | list | tuple | np.ndarray | np.generic | None)


@cache
def positions(kind):
    """Arguments by call, (call, name), of a kind: those that take numbers and arrays, or those that take records."""
    found = [(name, each, value) for name, call in calls().items() for each, value in call.arguments.items()]
    return [(name, each) for name, each, value in found if is_record(value) == (kind == RECORDS)]


def hostile_call(kind, seed, index):
    """Call `index` of a kind from a seed: its name, and its arguments."""
    rng = np.random.default_rng([seed, 1000 + (kind == RECORDS), index])
    name, each = pick(rng, positions(kind))
    arguments = dict(calls()[name].arguments)
    with warnings.catch_warnings(action="ignore"):
        arguments[each] = hostile(arguments[each], rng)
        others = [other for call, other in positions(NUMBERS) if call == name and other != each]
        if others and rng.random() < 0.25:
            each = pick(rng, others)
            arguments[each] = hostile(arguments[each], rng)
    return name, arguments


def one_call(piece):
    """Do one piece of work: (kind, seed, index)."""
    call_and_check(*hostile_call(*piece))


def call_and_check(name, arguments):
    """Call, in a folder that is gone afterwards, and look at what comes of it."""
    call = calls()[name]
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        try:
            found = call.function(**arguments)
        except (OSError, TypeError, ValueError):
            if arguments.get("path") is not call.arguments.get("path"):
                return  # what the system says of a name that is none is as good as words
            raise
    check_result(found, call.may)
    if isinstance(found, Task):
        check_task(found)
    repr(found)
