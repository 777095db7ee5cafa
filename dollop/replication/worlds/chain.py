"""The whole chain on a random world, judged by its truth: map, observe, learn, adapt, perform.

Every step is a public call with its defaults, as somebody would make it who has a log and a robot. A
world ends as *right*; as *refused*, where a call raises an error, nobody is found, or a run says that it
did not finish; as *doubtful*, where a result carries a note; or as *silently wrong*, where a result is
wrong by the criteria below and nothing says so. What was silently wrong stays so, whatever is refused
later on.
"""

import warnings
from dataclasses import dataclass, field, replace

import numpy as np

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.lab.outlines import outline_distances
from dollop.lab.people import walk_of
from dollop.observation import observe
from dollop.replication.worlds.draw import moved_objects
from dollop.replication.worlds.view import objects_in_view
from dollop.robot.performing import perform
from dollop.task import Demonstration, learn
from dollop.trajectory import arc_length, resample

__all__ = ["CAUSES", "COLUMNS", "Judgement", "OUTCOMES", "judge"]

NEAR = 0.40
"""m: a position is right if it is so near to where the user's middle was at that time. The near side of
a body, which a laser sees, is up to 0.2 m before it."""
WRONG_USER = 0.5
"""The user is wrong if less than this share of the trajectory is right."""
IN_PART = 0.95
"""The user is right in part if less than this share of the trajectory is right."""
COVERED = 0.85
"""Part of the walk is missing if less than this share of the way, in metres, has a right position, or the
law's response beside it."""
ASTRAY = 0.05
"""The law leads where nobody walked if more than this share of its response, in metres, is farther than
`NEAR` from the walk."""
FOUND = 0.40
"""m: an object is found if the middle of a box is so near to its own, or within half of its longer side."""
STRANGE = 0.20
"""m: a box is of no object if it is farther than this from all of them."""
BESIDE = 1.0
"""m: the side on which an object is passed counts if it is passed so near, each time."""
START = 0.15, np.radians(20)
"""Standard deviations, m and rad, of where the robot starts from where the law begins; it starts free."""
TIMEOUT = 180.0
"""s after which a run is given up."""

OUTCOMES = "right", "refused", "doubtful", "silently wrong"
CAUSES = (
    "user wrong", "user in part", "part of the walk missing", "object missed", "false object",
    "law where nobody walked", "matching wrong", "wrong side", "collision",
)  # fmt: skip
"""What can be wrong."""
COLUMNS = (
    "seed", "kind", "outcome", "cause", "causes", "stage", "told", "room", "scanner", "objects", "shown", "draws",
    "user_right", "covered", "in_view", "found", "false", "law_astray", "law_covered", "later_in_view", "later_found",
    "finished", "collisions",
)  # fmt: skip
"""Of the table: a row for each world."""


@dataclass
class Judgement:
    """What became of a world, step by step.

    Attributes
    ----------
    numbers : dict
        As in `COLUMNS`.
    causes : list of str
        What is silently wrong, of `CAUSES`, in the order in which it came up.
    doubts : list of str
        What notes say.
    refused : tuple
        Stage and error, or None.
    results : dict
        Results of the steps by name, to draw them.
    """

    numbers: dict = field(default_factory=dict)
    causes: list = field(default_factory=list)
    doubts: list = field(default_factory=list)
    refused: tuple = None
    results: dict = field(default_factory=dict)

    def blame(self, cause, wrong):
        """Something is wrong, and unless a note says so, silently."""
        if wrong and cause not in self.causes and not self.doubts:
            self.causes.append(cause)

    def listen(self, caught, results):
        """Take down the warnings that were given, and the notes with doubt that results carry."""
        self.doubts += [str(each.message) for each in caught if issubclass(each.category, UserWarning)]
        for result in results.values():
            for each in result if isinstance(result, list) else [result]:
                self.doubts += [str(note) for note in getattr(each, "notes", ()) if note.doubt]
        self.doubts = list(dict.fromkeys(self.doubts))  # a task carries the notes of what it was learned from

    @property
    def outcome(self):
        """One of `OUTCOMES`."""
        if self.causes:
            return "silently wrong"
        if self.refused:
            return "refused"
        return "doubtful" if self.doubts else "right"

    def row(self, world):
        """The world's line in the table, dict by `COLUMNS`."""
        stage, told = self.refused or ("", "; ".join(self.doubts))
        scanner = world.demonstrations[0].robot.scanner
        mode = f"{scanner.model}, {scanner.fov:g}/{scanner.resolution:.3g} degrees, {1000 * scanner.noise:g} mm"
        facts = {
            "seed": world.seed,
            "kind": world.kind,
            "outcome": self.outcome,
            "cause": next(iter(self.causes), ""),
            "causes": "; ".join(self.causes),
            "stage": stage,
            "told": " ".join(told.split())[:300],
            "room": world.shape,
            "scanner": mode,
            "objects": len(world.later.objects),
            "shown": len(world.demonstrations),
            "draws": world.draws,
        }
        return {name: facts.get(name, self.numbers.get(name, np.nan)) for name in COLUMNS}


def judge(world):
    """Go through the whole chain in a world, and judge every step by the truth.

    Parameters
    ----------
    world : RandomWorld

    Returns
    -------
    Judgement
    """
    judgement = Judgement()
    for stage, (call, judge_it) in STEPS.items():
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", UserWarning)
                results = call(world, judgement.results)
        except Exception as error:  # an error that is none of the library's own is told by its name
            name = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
            judgement.refused = stage, f"{name}{error}"
            break
        judgement.results |= results
        judgement.listen(caught, results)
        judge_it(world, judgement)
        if judgement.refused:
            break
    return judgement


# ---- what is called


def call_map(world, _):
    """A map from a log of the empty room."""
    from dollop.lab.simulate import record_tour

    return {"map": OccupancyGrid.from_log(record_tour(world.empty, world.tour, [world.seed, 20]))}


def call_observe(world, results):
    """The demonstrations recorded and observed."""
    from dollop.lab import record

    recordings = [record(scene, [world.seed, 30, k]) for k, scene in enumerate(world.demonstrations)]
    found = [observe(recording.log, results["map"]) for recording in recordings]
    return {"recordings": recordings, "observations": found}


def call_learn(_, results):
    """A task from all demonstrations."""
    return {"task": learn([Demonstration.of(each) for each in results["observations"]])}


def call_look(world, results):
    """The objects as they stand now."""
    from dollop.lab import watch

    look = watch(replace(world.later, people=()), [world.seed, 40])
    return {"look": look, "now": observe(look.log, results["map"])}


def call_adapt(_, results):
    """The task among them."""
    return {"adapted": results["task"].adapt(results["now"].environment)}


def call_perform(world, results):
    """The task performed by the simulated Pioneer, which localises itself."""
    from dollop.lab import Pioneer, World

    task, rng = results["adapted"], np.random.default_rng([world.seed, 50])
    way = task.law.response()
    ahead = way[min(5, len(way) - 1)] - way[0]
    aim = np.array([*way[0], np.arctan2(ahead[1], ahead[0])])
    starts = aim + rng.normal(0, [START[0], START[0], START[1]], (20, 3))
    free = outline_distances(starts[:, :2], world.later.section).min(axis=1) > world.later.robot.radius
    start = starts[free.argmax()]
    scanner = world.later.robot.scanner
    scanner = replace(scanner, model=f"{scanner.model}, thinned", rate=min(10.0, scanner.rate))
    with World(world.later) as room:
        robot = Pioneer(room, start, results["map"], task.environment, rng, scanner=scanner)
        return {"run": perform(task, robot, background=results["map"], timeout=TIMEOUT)}


# ---- what is right


def judge_nothing(world, judgement):
    """What can only be judged by what follows from it."""


def judge_observed(world, judgement):
    """Whether the user, all of the walk, and the objects are found in every demonstration."""
    found = zip(judgement.results["observations"], judgement.results["recordings"], strict=True)
    for each, recording in found:
        if each.user is None:
            judgement.refused = (
                "observe",
                f"nobody moved: {len(each.tracks)} tracks, none is the user",
            )
            return
        judge_user(each.user, recording.truth, judgement)
        judge_objects(each.environment, recording, judgement)


def judge_user(user, truth, judgement):
    """Whether the trajectory is the user's, and all of it."""
    walk = truth[["x", "y"]].to_numpy()
    rows = np.searchsorted(truth.t, user.t).clip(0, len(walk) - 1)
    near = np.linalg.norm(user.positions - walk[rows], axis=1) <= NEAR
    steps = np.linalg.norm(np.diff(walk, axis=0), axis=1)
    has = np.zeros(len(walk), bool)
    has[rows[near]] = True
    covered = float(steps[has[1:] & has[:-1]].sum() / steps.sum())
    worst(judgement.numbers, "user_right", float(near.mean()))
    worst(judgement.numbers, "covered", covered)
    judgement.blame("user wrong", near.mean() < WRONG_USER)
    judgement.blame("user in part", WRONG_USER <= near.mean() < IN_PART)
    judgement.blame("part of the walk missing", covered < COVERED)


def worst(numbers, name, value, pick=min):
    """Keep the worst of the demonstrations' numbers."""
    value = round(value, 4)
    numbers[name] = pick(numbers.get(name, value), value)


def judge_objects(environment, recording, judgement, later=False):
    """Whether every object that was in view is found, and nothing else."""
    scene, truth = recording.scene, recording.truth
    objects = moved_objects(scene)
    poses = recording.log.poses[[-1]]
    if scene.robot.way:
        poses = truth[["laser_x", "laser_y", "laser_theta"]].to_numpy()[:: max(1, len(truth) // 10)]
    in_view = np.mean([objects_in_view(scene, pose, objects) for pose in poses], axis=0) >= 0.5
    boxes = true_boxes(scene, objects)
    found = partners(environment.boxes, boxes)
    known = np.vstack([boxes, bystanders(truth)])
    strange = [distance_to_boxes(box, known) > STRANGE for box in environment.boxes]
    prefix = "later_" if later else ""
    worst(judgement.numbers, f"{prefix}in_view", int(in_view.sum()))
    worst(judgement.numbers, f"{prefix}found", int(np.isin(np.flatnonzero(in_view), found).sum()))
    worst(judgement.numbers, "false", int(sum(strange)), max)
    judgement.blame("object missed", not np.isin(np.flatnonzero(in_view), found).all())
    judgement.blame("false object", any(strange))


def bystanders(truth):
    """(P, 4) boxes in m, a point each, where other people than the user are at the end.

    Nothing tells somebody who stands there from an object that was moved: a box round one is neither
    right nor wrong.
    """
    others = [column for column in truth.columns if column.startswith("x_")]
    places = np.array([truth[[column, column.replace("x_", "y_")]].iloc[-1] for column in others]).reshape(-1, 2)
    return np.hstack([places, places])


def true_boxes(scene, objects):
    """(N, 4) bounding boxes of objects at the height of the laser, in m."""
    height = scene.robot.beam_height
    return np.array([each.outline(height).bounds for each in objects]).reshape(-1, 4)


def partners(boxes, true):
    """For each box (M, 4) the true one (N, 4) whose middle is nearest and near enough, (M,), else -1."""
    if not len(boxes) or not len(true):
        return np.full(len(boxes), -1)
    middles, places = Environment(boxes).centres, Environment(true).centres
    reach = np.maximum(FOUND, (true[:, 2:] - true[:, :2]).max(axis=1) / 2)
    apart = np.linalg.norm(middles[:, None] - places, axis=2) / reach
    return np.where(apart.min(axis=1) <= 1, apart.argmin(axis=1), -1)


def distance_to_boxes(box, boxes):
    """Free distance in m from a box to the nearest of others, `inf` if there are none."""
    apart = np.maximum(np.maximum(boxes[:, :2] - box[2:], box[:2] - boxes[:, 2:]), 0.0)
    return np.hypot(*apart.T).min(initial=np.inf)


def judge_learned(world, judgement):
    """Whether the law of its way is what the first demonstration showed, and all of it."""
    truth, task = judgement.results["recordings"][0].truth, judgement.results["task"]
    (law,) = [law for law, way in zip(task.ways, task.learned, strict=True) if 0 in way.members]
    walk, response = evenly(truth[["x", "y"]].to_numpy()), evenly(law.response())
    astray = float(np.mean(nearest(response, walk) > NEAR))
    covered = float(np.mean(nearest(walk, response) <= NEAR))
    judgement.numbers |= {"law_astray": round(astray, 4), "law_covered": round(covered, 4)}
    judgement.blame("law where nobody walked", astray > ASTRAY)
    judgement.blame("part of the walk missing", covered < COVERED)


def evenly(path, step=0.05):
    """A path (N, 2) sampled every so many m."""
    return resample(path, 2 + int(arc_length(path)[-1] / step))


def nearest(points, path):
    """(N,) distance in m from points (N, 2) to the nearest of a path (M, 2)."""
    return np.array([np.linalg.norm(path - point, axis=1).min() for point in points])


def judge_look(world, judgement):
    """Whether the objects are found where they stand now."""
    judge_objects(judgement.results["now"].environment, judgement.results["look"], judgement, later=True)


def judge_adapted(world, judgement):
    """Whether no object is taken for another one, as far as both are found.

    One of which it is not sure where it went is left out, which is no mistake.
    """
    results, scene = judgement.results, world.demonstrations[0]
    old = partners(results["task"].environment.boxes, true_boxes(scene, moved_objects(scene)))
    new = partners(results["now"].environment.boxes, true_boxes(world.later, world.later.objects))
    pairs = [(old[i], new[j]) for i, j in enumerate(results["adapted"].objects) if j >= 0]
    judgement.blame("matching wrong", any(a >= 0 and b >= 0 and a != b for a, b in pairs))


def judge_run(world, judgement):
    """Whether the robot touched nothing and passed the objects as the user does."""
    run = judgement.results["run"]
    judgement.numbers |= {"finished": int(run.finished), "collisions": run.collisions}
    if not run.finished:
        judgement.refused = "perform", f"the run did not finish: {run.reason}"
        return
    judgement.blame("wrong side", wrong_side(world, run.true_poses[:, :2]))
    judgement.blame("collision", run.collisions > 0)


def wrong_side(world, driven):
    """Whether the run passes an object on the other side than the user did, and would again.

    Only objects count that all three pass within `BESIDE` of their middle, once, and the user on the
    same side both times.
    """
    first = world.demonstrations[0]
    ways = [evenly(walk_of(scene.people[0], scene).positions) for scene in (first, world.later)] + [evenly(driven)]
    objects = [moved_objects(first), world.later.objects, world.later.objects]
    for trio in zip(*objects, strict=True):
        sides = [side(way, np.array(each.position)) for way, each in zip(ways, trio, strict=True)]
        if 0 not in sides and sides[0] == sides[1] != sides[2]:
            return True
    return False


def side(path, place):
    """+1 where a path leaves a place to its left, -1 to its right, 0 if it does not go past it just once.

    Going past is to come near, and to turn round the place by a right angle or more before it is left.
    """
    near = np.linalg.norm(path - place, axis=1) < BESIDE
    inside = np.flatnonzero(near)
    if not len(inside) or np.ptp(inside) >= len(inside):
        return 0
    away = path[near] - place
    bearings = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    swept = bearings[-1] - bearings[0]
    return int(np.sign(swept)) if abs(swept) >= np.pi / 2 else 0


STEPS = {
    "map": (call_map, judge_nothing),
    "observe": (call_observe, judge_observed),
    "learn": (call_learn, judge_learned),
    "look": (call_look, judge_look),
    "adapt": (call_adapt, judge_adapted),
    "perform": (call_perform, judge_run),
}
"""The chain: for each step what is called, and how its results are judged."""
