"""The replication's experiments, from seeds: each is simulated once and shared by what shows it.

The set-ups are the paper's where it tells them; numbers, seeds and layouts are our own.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache, partial
from itertools import chain
from pathlib import Path

import numpy as np

from dollop import lab
from dollop.checks import need
from dollop.environment import corner_indices
from dollop.formats.kinds import CARMEN_LOG
from dollop.formats.logs import write_log
from dollop.formats.writing import Output, check_outputs, together
from dollop.gridmap import OccupancyGrid, map_outputs
from dollop.lab.recording import outputs as recording_outputs
from dollop.matching import match
from dollop.observation import observe
from dollop.replication.choosing import (
    LAWS,
    SEEN,
    TIES,
    as_paper,
    gait_of,
    seen_by,
    shown_as,
    task_of,
)
from dollop.replication.reconstruction import TOLD, Reconstruction
from dollop.replication.runs import free_poses
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.performing import perform
from dollop.task import Demonstration, learn
from dollop.trajectory import arc_length, at_arc_length

__all__ = [
    "KEPT", "LAYOUTS", "SEED", "adapted_task", "background_map", "eight_runs", "empty_lab",
    "figure_eights", "hand_over_turns",
    "kidnapped_runs", "largest_corner", "matched_right", "matchings_from_laser",
    "moved_environment", "moved_runs", "moved_scene", "nearest", "new_slalom_task",
    "passing_sides", "same_sides", "save_all", "slalom", "slalom_runs", "slalom_task",
    "starts_near_the_beginning",
]  # fmt: skip

SEED = 2004
"""Every experiment draws from this seed, the year of the paper."""

LAYOUTS = ((0.1, 0.4), (0.0, -0.7)), ((0.9, -0.4), (-0.7, -0.4)), ((-0.4, -0.6), (0.4, 0.3))
"""How far each can is moved in m along x and y, in three ways (Fig. 10)."""

KEPT = {"from_background": 0.30}
"""Walks of the figures and claims keep so far from the background, in m, shoulder to wall: the radius
of Sec. II swallows what is nearer. A layout without room for that is drawn anew."""


def save_all(folder):
    """Simulate and save every recording that the notebooks read.

    A recording and its truth and scene are written together, and so are the map and the log that it
    is made from: after a kill each is of the old run or of the new one.

    Parameters
    ----------
    folder : str or Path
        Made if it is not there.

    Returns
    -------
    list of str
        The names of what was written, without endings.

    Raises
    ------
    OSError
        The folder cannot be written to, or holds something else by one of these names; told before
        anything is made.
    ImportError
        PyBullet is missing; told before anything is made.
    """
    need("lab")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    recordings = {"figure_eights": lambda: figure_eights().recording, "moved_cones": moved_cones}
    recordings |= {f"slalom_{k}": lambda k=k: slalom(k).recording for k in (0, 1)}
    recordings |= {f"moved_cans_{k}": partial(moved_cans, k) for k in range(len(LAYOUTS))}
    logs = {name: folder / f"{name}.log.gz" for name in recordings}
    outputs = [*map_outputs(folder / "lab.yaml"), Output(folder / "empty_lab.log.gz", CARMEN_LOG)]
    check_outputs([*outputs, *chain.from_iterable(map(recording_outputs, logs.values()))])
    log, background = empty_lab(), background_map()
    with together():
        background.save(folder / "lab.yaml")
        write_log(folder / "empty_lab.log.gz", log)
    for name, recording in recordings.items():
        recording().save(logs[name])
    return ["empty_lab", "lab", *recordings]


@cache
def empty_lab():
    """Record a drive through the laboratory while it is empty.

    Returns
    -------
    LaserLog
    """
    return lab.record_background(SEED)


@cache
def background_map():
    """The background map of the laboratory, built from the drive through it (Sec. II).

    Returns
    -------
    OccupancyGrid
    """
    return OccupancyGrid.from_log(empty_lab())


# ---- the figure-eight (Figs 6 and 7)


@dataclass(frozen=True, eq=False)
class FigureEights:
    """Five figure-eights round two trash cans, from the laser to the task: each stage made when asked for.

    Attributes
    ----------
    recording : Recording
        What the laser saw, and the truth.
    observation : Observation
        What Dollop made of it (Sec. II).
    observed_as_paper : Observation
        The same by the paper's method, for what the paper says of it.
    demonstration : Demonstration
        The laps among the two cans.
    laps : list of (N_k, 2) float arrays
        The laps in m, cut out of the user's trajectory: five, unless one is left out.
    task : Task
        The control law (Sec. III), tied to the two cans (Sec. IV).
    task_as_paper : Task
        The same by the paper's method, for what the paper says of it.
    """

    seed: int
    how: Reconstruction = TOLD

    @property
    def recording(self):
        return _eights_recorded(self.seed, self.how.only(SEEN))

    @property
    def observation(self):
        return _eights_observed(self.seed, self.how.only(SEEN))

    @property
    def observed_as_paper(self):
        return _eights_observed_as_paper(self.seed, self.how.only((*SEEN, "motion_noise")))

    @cached_property
    def demonstration(self):
        return shown_as(Demonstration.of(self.observation), self.how)

    @cached_property
    def laps(self):
        return self.demonstration.walks

    @cached_property
    def task(self):
        return task_of(self.demonstration, replace(self.how, learning="anchored"))

    @cached_property
    def task_as_paper(self):
        return task_of(self.demonstration, self.how)


def figure_eights(seed=SEED, how=TOLD):
    """Simulate the five figure-eights of Fig. 6 (Sec. II).

    Parameters
    ----------
    seed : int
    how : Reconstruction, optional

    Returns
    -------
    FigureEights
    """
    return _figure_eights(seed, how.only((*SEEN, "motion_noise", *LAWS, *TIES, "learning")))


# A study asks for many seeds, one after the other: it keeps a few, and the figures' own. What is chosen
# later does not make it begin anew.
@lru_cache(maxsize=4)
def _figure_eights(seed, how):
    return FigureEights(seed, how)


@lru_cache(maxsize=4)
def _eights_recorded(seed, how):
    scene = seen_by(lab.figure_eight_scene(), how)
    return lab.record_figure_eights(seed, scene=scene, **KEPT, **gait_of(how))


@lru_cache(maxsize=4)
def _eights_observed(seed, how):
    return observe(_eights_recorded(seed, how).log, background_map())


@lru_cache(maxsize=4)
def _eights_observed_as_paper(seed, how):
    log = _eights_recorded(seed, how.only(SEEN)).log
    return observe(log, background_map(), **as_paper(how))


@cache
def eight_runs(control="pursuit", avoid=True, count=10):
    """Perform the figure-eight in the laboratory (Fig. 7a).

    Parameters
    ----------
    control : {"pursuit", "plain"}
        See `dollop.perform`.
    avoid : bool
        Whether to go round obstacles.
    count : int

    Returns
    -------
    list of count Run
    """
    return _runs(figure_eights().task, figure_eights().recording.scene, SEED, control, avoid, count)


@cache
def kidnapped_runs(control="pursuit", avoid=True, count=5):
    """Perform the figure-eight, the robot being kidnapped once in each run (Fig. 7b).

    Parameters
    ----------
    control : {"pursuit", "plain"}
        See `dollop.perform`.
    avoid : bool
        Whether to go round obstacles.
    count : int

    Returns
    -------
    list of count Run
    """
    task, rng = figure_eights().task, np.random.default_rng([SEED, 7])
    starts = starts_near_the_beginning(task, count, rng)
    obstacles = ObstacleMap.of(task.environment, background_map())
    poses = free_poses(count, obstacles, task.law.subgoals[0], rng)
    kidnaps = [[each] for each in zip(rng.uniform(5.0, 25.0, count), poses, strict=True)]
    return _perform_all(task, figure_eights().recording.scene, starts, kidnaps, control, avoid)


def _runs(task, scene, seed, control, avoid, count):
    """Runs of a task in a scene, from starts that are drawn from a seed."""
    starts = starts_near_the_beginning(task, count, np.random.default_rng(seed))
    return _perform_all(task, scene, starts, [()] * count, control, avoid)


def _perform_all(task, scene, starts, kidnaps, control, avoid):
    """Runs of the simulated Pioneer, which localises itself with its laser, the k-th with seed k."""
    runs, grid = [], background_map()
    for k, (start, kidnap) in enumerate(zip(starts, kidnaps, strict=True)):
        with lab.World(scene) as world:
            robot = lab.Pioneer(world, start, grid, task.environment, k)
            runs.append(perform(task, robot, control, avoid, grid, kidnap))
    return runs


def starts_near_the_beginning(task, count, rng):
    """Draw poses round the start of a law: 0.15 m and 20 degrees off (standard deviations).

    Parameters
    ----------
    task : Task
    count : int
    rng : numpy.random.Generator

    Returns
    -------
    (count, 3) float array
        x, y in m, theta in rad.
    """
    way = task.law.response()[5] - task.law.start
    poses = np.tile([*task.law.start, np.arctan2(way[1], way[0])], (count, 1))
    return poses + rng.normal(0, [0.15, 0.15, np.radians(20)], (count, 3))


# ---- moved cans (Figs 8 to 10 and x1)


def moved_scene(k):
    """The figure-eight scene with the cans moved in one of the `LAYOUTS`.

    Parameters
    ----------
    k : int

    Returns
    -------
    Scene
    """
    return lab.moved(lab.figure_eight_scene(), LAYOUTS[k])


@cache
def moved_cans(k):
    """Recording of the moved cans, nobody walking: the robot looks from where it stood before."""
    return lab.watch(moved_scene(k), [SEED, k])


@cache
def moved_environment(k):
    """The moved cans as the robot sees them with its own laser (Sec. IV).

    Parameters
    ----------
    k : int
        Which of the `LAYOUTS`.

    Returns
    -------
    Environment
    """
    return observe(moved_cans(k).log, background_map()).environment


@cache
def adapted_task(k):
    """The figure-eight task among the moved cans (Sec. IV-B).

    Parameters
    ----------
    k : int
        Which of the `LAYOUTS`.

    Returns
    -------
    Task
    """
    return figure_eights().task.adapt(moved_environment(k))


@cache
def moved_runs(k, control="pursuit", avoid=True, count=10):
    """Perform the adapted task among the moved cans (Fig. 10b).

    Parameters
    ----------
    k : int
        Which of the `LAYOUTS`.
    control : {"pursuit", "plain"}
        See `dollop.perform`.
    avoid : bool
        Whether to go round obstacles.
    count : int

    Returns
    -------
    list of count Run
    """
    return _runs(adapted_task(k), moved_scene(k), [SEED, 10, k], control, avoid, count)


def matched_right(k):
    """Whether the cans were matched as they were moved, first to first and second to second.

    Parameters
    ----------
    k : int
        Which of the `LAYOUTS`.

    Returns
    -------
    bool
    """
    before, after = figure_eights().task.environment, moved_environment(k)
    truth = _true_indices(before, figure_eights().recording.scene, after, moved_scene(k))
    return bool(np.array_equal(match(before, after).indices, truth))


def _true_indices(before, old_scene, after, new_scene):
    """The right indices of a matching between what was seen of two scenes with the same objects."""
    old = nearest(before.centres, old_scene.positions)
    new = nearest(after.centres, new_scene.positions)
    return corner_indices(new[old.argsort()])


@cache
def matchings_from_laser(kind, count=50):
    """How often boxes are matched right as the laser saw them, moved by 0.3 m (sd) (Fig. x1).

    Parameters
    ----------
    kind : {"cans", "cones"}
        Two cans or four cones.
    count : int
        Random layouts; where the robot sees another number of objects, neither method is right.

    Returns
    -------
    dict
        Shares, by method.
    """
    first = {"cans": lab.figure_eight_scene, "cones": lab.slalom_scene}[kind]()
    rng = np.random.default_rng([SEED, 1])
    scenes = [first, *(lab.rearranged(first, rng, reach=0.3, spacing=0.5) for _ in range(count))]
    logs = (lab.watch(scene, k).log for k, scene in enumerate(scenes))
    before, *seen = (observe(log, background_map()).environment for log in logs)
    right = {"literal": 0, "robust": 0}
    for scene, after in zip(scenes[1:], seen, strict=True):
        if len(after) == len(before):
            truth = _true_indices(before, first, after, scene)
            for method in right:
                right[method] += np.array_equal(match(before, after, method).indices, truth)
    return {method: number / count for method, number in right.items()}


def nearest(points, places):
    """For each place the nearest of some points.

    Parameters
    ----------
    points : (M, 2) array_like
        In m.
    places : (N, 2) array_like
        In m.

    Returns
    -------
    (N,) int array
        Indices into the points.
    """
    return np.linalg.norm(points[None] - np.asarray(places)[:, None], axis=2).argmin(axis=1)


# ---- the slalom (Figs 11 and 12)


@dataclass(frozen=True, eq=False)
class Slalom:
    """A slalom past four cones that stand somewhere else each time (Fig. 11), made when asked for.

    Attributes
    ----------
    scene : Scene
    walk : Walk
    noise : list of int
        Seed of the laser's noise.
    recording : Recording
        What the laser saw, and the truth.
    observed : Demonstration
        What Dollop made of it.
    """

    scene: lab.Scene
    walk: lab.Walk
    noise: list

    @cached_property
    def recording(self):
        return lab.record(self.scene, self.noise, [self.walk])

    @cached_property
    def observed(self):
        return Demonstration.of(observe(self.recording.log, background_map()))


@dataclass(frozen=True, eq=False)
class ChosenSlalom:
    """The same with what is chosen of its law.

    Attributes
    ----------
    seen : Slalom
    how : Reconstruction
    scene, walk, recording
        As of `seen`.
    demonstration : Demonstration
    """

    seen: Slalom
    how: Reconstruction

    @property
    def scene(self):
        return self.seen.scene

    @property
    def walk(self):
        return self.seen.walk

    @property
    def recording(self):
        return self.seen.recording

    @cached_property
    def demonstration(self):
        return shown_as(self.seen.observed, self.how)


def slalom(k, seed=SEED, how=TOLD):
    """Draw a row of cones, each moved somewhere else, and a walk past them.

    Parameters
    ----------
    k : int
        Which layout of those that have room for a walk.
    seed : int
    how : Reconstruction, optional

    Returns
    -------
    ChosenSlalom

    Raises
    ------
    RuntimeError
        No such layout in a hundred draws.
    """
    return _slalom(k, seed, how.only((*SEEN, *LAWS)))


@lru_cache(maxsize=8)
def _slalom(k, seed, how):
    return ChosenSlalom(_slalom_walked(k, seed, how.only(SEEN)), how)


@lru_cache(maxsize=8)
def _slalom_walked(k, seed, how):
    rng = np.random.default_rng([seed, 11, k])
    for _ in range(100):
        try:
            scene = seen_by(lab.rearranged(lab.slalom_scene(), rng, reach=0.25, spacing=0.6), how)
            return Slalom(scene, lab.slalom(scene, rng, **KEPT, **gait_of(how)), [seed, 11, k])
        except ValueError:  # no room to walk among these
            continue
    raise RuntimeError("no layout with room for a slalom in 100 draws")


@cache
def slalom_task():
    """The task learned from two slaloms, in the environment of the first (Fig. 12a).

    Returns
    -------
    Task
    """
    return learn([slalom(k).demonstration for k in (0, 1)])


@cache
def moved_cones():
    """Recording of the cones in a third layout, nobody walking."""
    return lab.watch(slalom(2).scene, [SEED, 12])


@cache
def new_slalom_task():
    """The learned task in a third layout, as the robot sees it with its own laser (Fig. 12b).

    Returns
    -------
    Task
    """
    return slalom_task().adapt(observe(moved_cones().log, background_map()).environment)


@cache
def slalom_runs(control="pursuit", avoid=True, count=10):
    """Perform the learned task in the third layout (Fig. 12b).

    Parameters
    ----------
    control : {"pursuit", "plain"}
        See `dollop.perform`.
    avoid : bool
        Whether to go round obstacles.
    count : int

    Returns
    -------
    list of count Run
    """
    return _runs(new_slalom_task(), slalom(2).scene, [SEED, 12], control, avoid, count)


# ---- what laws and runs are judged by


def largest_corner(law, over=0.1, method="held"):
    """The largest angle by which a law's response turns where a segment hands over to the next.

    Parameters
    ----------
    law : SequencedLDS
    over : float
        In m.
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    float
        In rad; 0 for a single segment.
    """
    return float(hand_over_turns(law, over, method).max(initial=0))


def hand_over_turns(law, over=0.1, method="held"):
    """The angles by which a law's response turns where a segment hands over to the next.

    Each is the angle between the ways to the place of the handing over and on from it, each so many
    metres of the response: in its last centimetres the response of an LDS alone curls into its
    subgoal, which no robot can follow and no eye sees.

    Parameters
    ----------
    law : SequencedLDS
        Of K segments.
    over : float
        In m.
    method : {"held", "paper"}
        Which response.

    Returns
    -------
    (K - 1,) float array
        In rad.
    """
    response = law.response(method=method)
    place = arc_length(response)[_hand_overs(law, response)]
    before, here, after = (at_arc_length(response, place + shift) for shift in (-over, 0, over))
    arriving, going_on = (here - before) @ (1, 1j), (after - here) @ (1, 1j)
    return np.abs(np.angle(going_on * arriving.conj()))


def _hand_overs(law, response, reach=0.01):
    """Where in a response (M, 2) it first is within reach (m) of each subgoal but the last."""
    found = [0]
    for subgoal in law.subgoals[:-1]:
        near = np.linalg.norm(response[found[-1] :] - subgoal, axis=1) <= reach
        found.append(found[-1] + int(near.argmax()))
    return found[1:]


def passing_sides(path, centres):
    """On which side a path passes each of some places.

    Parameters
    ----------
    path : (M, 2) float array
        In m.
    centres : (N, 2) float array
        In m.

    Returns
    -------
    (N,) float array
        +1 where it leaves the place to the right, -1 to the left.
    """
    place = nearest(path, centres).clip(1, len(path) - 2)
    way, across = path[place + 1] - path[place - 1], centres - path[place]
    return -np.sign(way[:, 0] * across[:, 1] - way[:, 1] * across[:, 0])


def same_sides(run, task, sides):
    """Whether a run of the slalom task passes every cone that was matched on the demonstrated side.

    Parameters
    ----------
    run : Run
    task : Task
        What was performed; learned in the first layout.
    sides : (N,) array_like
        Demonstrated sides of the first layout's cones, as `passing_sides` has them.

    Returns
    -------
    bool
    """
    found = task.objects >= 0
    cones = task.environment.centres[task.objects[found]]
    return bool((passing_sides(run.true_poses[:, :2], cones) == np.asarray(sides)[found]).all())
