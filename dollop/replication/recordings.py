"""The replication's experiments, from seeds: each is simulated once and shared by the figures that
show it.
"""

from functools import cache, lru_cache

import numpy as np

from dollop.gridmap import OccupancyGrid
from dollop.laps import laps
from dollop.matching import match
from dollop.observation import observe
from dollop.replication.runs import free_poses
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.performing import perform
from dollop.task import Demonstration, Task, learn
from dollop.trajectory import arc_length, at_arc_length

SEED = 2004
"""Every experiment draws from this seed, the year of the paper."""


@cache
def empty_lab():
    """Laser log of a drive through the laboratory while it is empty."""
    from dollop.lab import record_background

    return record_background(SEED)


@cache
def background_map():
    """Background map of the laboratory, built from the drive through it."""
    return OccupancyGrid.from_log(empty_lab())


# A study asks for many seeds, one after the other: it keeps a few, and the figures' own.
some = lru_cache(maxsize=4)


@some
def figure_eights(seed=SEED):
    """Recording of five figure-eights round two trash cans (Sec. II)."""
    from dollop.lab import record_figure_eights

    return record_figure_eights(seed)


@some
def figure_eights_observed(seed=SEED):
    """Observation of the five figure-eights."""
    return observe(figure_eights(seed).log, background_map())


@some
def figure_eight_laps(seed=SEED):
    """The five laps, cut out of the user's trajectory."""
    user = figure_eights_observed(seed).user
    return laps(user.t, user.positions)


@some
def figure_eight_task(seed=SEED):
    """The task of the five figure-eights (Sec. III), tied to the two cans (Sec. IV)."""
    return Task.of(Demonstration.of(figure_eights_observed(seed)))


LAYOUTS = (
    ((0.1, 0.4), (0.0, -0.7)),
    ((0.9, -0.4), (-0.7, -0.4)),
    ((-0.4, -0.6), (0.4, 0.3)),
)
"""How far each can is moved in m along x and y, in three ways (Fig. 10)."""


def moved_scene(k):
    """The figure-eight scene with the cans moved in the k-th way."""
    from dollop.lab import figure_eight_scene, moved

    return moved(figure_eight_scene(), LAYOUTS[k])


@cache
def moved_cans(k):
    """Recording of the moved cans, nobody walking: the robot looks from where it stood before."""
    from dollop.lab import watch

    return watch(moved_scene(k), [SEED, k])


@cache
def moved_environment(k):
    """The moved cans as the robot sees them with its own laser."""
    return observe(moved_cans(k).log, background_map()).environment


@cache
def adapted_task(k):
    """The figure-eight task among the moved cans."""
    return figure_eight_task().adapt(moved_environment(k))


def matched_right(k):
    """Whether the cans were matched as they were moved, first to first and second to second."""
    before, after = figure_eight_task().environment, moved_environment(k)
    order = nearest(before.centres, figure_eights().scene.positions), nearest(after.centres, moved_scene(k).positions)
    truth = 4 * order[1][order[0].argsort()][:, None] + np.arange(4)
    return bool(np.array_equal(match(before, after).indices, truth.ravel()))


@cache
def matchings_from_laser(kind, count=50):
    """Shares of layouts matched right between boxes as the laser saw them, cans or cones moved by
    0.3 m (sd).

    Parameters
    ----------
    kind : str
        "cans" (two) or "cones" (four).
    count : int
        Random layouts; where the robot sees another number of objects, neither method is right.

    Returns
    -------
    dict
        By method.
    """
    from dollop.lab import figure_eight_scene, rearranged, slalom_scene, watch

    first = {"cans": figure_eight_scene, "cones": slalom_scene}[kind]()
    rng = np.random.default_rng([SEED, 1])
    scenes = [first, *(rearranged(first, rng, reach=0.3, spacing=0.5) for _ in range(count))]
    seen = [observe(watch(scene, k).log, background_map()).environment for k, scene in enumerate(scenes)]
    order = [nearest(environment.centres, scene.positions) for environment, scene in zip(seen, scenes, strict=True)]
    whole = [k for k in range(1, count + 1) if len(seen[k]) == len(seen[0])]
    right = {method: 0 for method in ("literal", "robust")}
    for k in whole:
        truth = 4 * order[k][order[0].argsort()][:, None] + np.arange(4)
        for method in right:
            right[method] += np.array_equal(match(seen[0], seen[k], method).indices, truth.ravel())
    return {method: number / count for method, number in right.items()}


def nearest(points, places):
    """For each of places (N, 2) the index of the nearest of points (M, 2)."""
    return np.linalg.norm(points[None] - np.asarray(places)[:, None], axis=2).argmin(axis=1)


def slalom_layout(k, seed=SEED):
    """A row of four cones, each moved somewhere else, and a walk past them: the k-th that has room
    for one.
    """
    from dollop.lab import rearranged, slalom, slalom_scene

    rng = np.random.default_rng([seed, 11, k])
    for _ in range(100):
        try:
            scene = rearranged(slalom_scene(), rng, reach=0.25, spacing=0.6)
            return scene, slalom(scene, rng)
        except ValueError:  # no room to walk among these
            continue
    raise RuntimeError("no layout with room for a slalom in 100 draws")


@some
def slalom_recording(k, seed=SEED):
    """Recording of a slalom, in an environment of its own (Fig. 11)."""
    from dollop.lab import record

    return record(*slalom_layout(k, seed), [seed, 11, k])


@some
def slalom_demonstration(k, seed=SEED):
    """The k-th slalom as the laser saw it."""
    return Demonstration.of(observe(slalom_recording(k, seed).log, background_map()))


@cache
def slalom_task():
    """The task learned from two slaloms in different environments, in that of the first (Fig.

    12a).
    """
    return learn([slalom_demonstration(0), slalom_demonstration(1)])


@cache
def moved_cones():
    """Recording of the cones in a third layout, nobody walking."""
    from dollop.lab import watch

    return watch(slalom_layout(2)[0], [SEED, 12])


@cache
def new_slalom_environment():
    """The cones of the third layout, as the robot sees them with its own laser (Fig. 12b)."""
    return observe(moved_cones().log, background_map()).environment


@cache
def new_slalom_task():
    """The learned task in the third layout."""
    return slalom_task().adapt(new_slalom_environment())


@cache
def slalom_runs(control="pursuit", avoid=True, count=10):
    """Runs of the learned task in the third layout (Fig. 12b)."""
    task, scene = new_slalom_task(), slalom_layout(2)[0]
    starts = starts_near_the_beginning(task, count, np.random.default_rng([SEED, 12]))
    return [run_in_lab(task, scene, start, k, control=control, avoid=avoid) for k, start in enumerate(starts)]


def run_in_lab(task, scene, start, seed, **choices):
    """One run of the simulated Pioneer, which localises itself with its laser, in a scene of the
    laboratory.
    """
    from dollop.lab import Pioneer, World

    with World(scene) as world:
        robot = Pioneer(world, start, background_map(), task.environment, seed)
        return perform(task, robot, background=background_map(), **choices)


def starts_near_the_beginning(task, count, rng):
    """Poses (count, 3) round the law's start: 0.15 m and 20 degrees off (standard deviations)."""
    way = task.law.response()[5] - task.law.start
    poses = np.tile([*task.law.start, np.arctan2(way[1], way[0])], (count, 1))
    return poses + rng.normal(0, [0.15, 0.15, np.radians(20)], (count, 3))


@cache
def eight_runs(control="pursuit", avoid=True, count=10):
    """Runs of the figure-eight in the laboratory (Fig. 7a)."""
    task, scene = figure_eight_task(), figure_eights().scene
    starts = starts_near_the_beginning(task, count, np.random.default_rng(SEED))
    return [run_in_lab(task, scene, start, k, control=control, avoid=avoid) for k, start in enumerate(starts)]


@cache
def kidnappings(count=5):
    """Starts (count, 3), times (count,) and poses (count, 3) of kidnappings anywhere in the
    laboratory.
    """
    task, rng = figure_eight_task(), np.random.default_rng([SEED, 7])
    starts = starts_near_the_beginning(task, count, rng)
    obstacles = ObstacleMap.of(task.environment, background_map())
    poses = free_poses(count, obstacles, task.law.subgoals[0], rng)
    return starts, rng.uniform(5.0, 25.0, count), poses


@cache
def kidnapped_runs(control="pursuit", avoid=True, count=5):
    """Runs of the figure-eight, each kidnapped once (Fig. 7b)."""
    task, scene = figure_eight_task(), figure_eights().scene
    return [
        run_in_lab(task, scene, start, k, control=control, avoid=avoid, kidnap=[(time, pose)])
        for k, (start, time, pose) in enumerate(zip(*kidnappings(count), strict=True))
    ]


@cache
def moved_runs(k, control="pursuit", avoid=True, count=10):
    """Runs of the adapted task among the cans moved in the k-th way (Fig. 10b)."""
    task, scene = adapted_task(k), moved_scene(k)
    starts = starts_near_the_beginning(task, count, np.random.default_rng([SEED, 10, k]))
    return [run_in_lab(task, scene, start, seed, control=control, avoid=avoid) for seed, start in enumerate(starts)]


def largest_corner(law, over=0.1):
    """The largest angle by which a law's response turns where one segment hands over to the next.

    It is the angle between the ways to the place of the handing over and on from it, each so many
    metres of the response: in its last centimetres a response curls into its subgoal, which no robot
    can follow and no eye sees.

    Parameters
    ----------
    law : SequencedLDS
    over : float
        In m.

    Returns
    -------
    float
        In rad; 0 for a single segment.
    """
    response = law.response()
    walked, places = arc_length(response), hand_overs(law, response)
    before, here, after = (at_arc_length(response, walked[places] + shift) for shift in (-over, 0, over))
    arriving, going_on = (here - before) @ (1, 1j), (after - here) @ (1, 1j)
    return float(np.abs(np.angle(going_on * arriving.conj())).max(initial=0))


def hand_overs(law, response, reach=0.01):
    """Indices into a response (M, 2) at which it first is within reach (m) of each subgoal but the last."""
    found = [0]
    for subgoal in law.subgoals[:-1]:
        near = np.linalg.norm(response[found[-1] :] - subgoal, axis=1) <= reach
        found.append(found[-1] + int(near.argmax()))
    return found[1:]


def passing_sides(path, centres):
    """On which side a path (M, 2) passes each centre (N, 2): +1 leaves it to the right, -1 to the
    left.
    """
    nearest_place = nearest(path, centres).clip(1, len(path) - 2)
    way, across = path[nearest_place + 1] - path[nearest_place - 1], centres - path[nearest_place]
    return -np.sign(way[:, 0] * across[:, 1] - way[:, 1] * across[:, 0])


def same_sides(run, task, sides):
    """Whether a run of the slalom task passes every cone on the demonstrated side, `sides` in the
    first layout.
    """
    partners = match(slalom_demonstration(0).environment, task.environment).indices[::4] // 4
    return bool((passing_sides(run.true_poses[:, :2], task.environment.centres[partners]) == sides).all())
