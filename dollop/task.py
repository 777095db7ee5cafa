"""Tasks: learned from demonstrations, adapted to where the objects stand now, saved and loaded (Sec. IV-B and V)."""

import json
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.environment import Environment
from dollop.formats.files import FormatError, read_bytes, whole_file
from dollop.laps import laps
from dollop.lds import LDS, Statistics
from dollop.matching import match_confidently
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import check_trajectories

__all__ = ["Demonstration", "Task", "anchors", "learn", "members_along"]

FORMAT, VERSION = "dollop task", 1


@dataclass(frozen=True, eq=False)
class Demonstration:
    """What the user showed, and where the objects stood.

    Attributes
    ----------
    trajectory : (N, 2) float array, or list of (N_k, 2) float arrays
        The walk in m; several walks of the same task in the same environment, such as laps, are one demonstration.
    environment : Environment
        The static foreground objects.
    sample_period : float
        Time between samples of the walk in s; the demonstrated speed depends on it.
    tolerance : float
        Largest mean error of a segment in m, see `SequencedLDS.fit`.

    Raises
    ------
    ValueError
        For what is no trajectory.
    """

    trajectory: np.ndarray
    environment: Environment
    sample_period: float = 0.1
    tolerance: float = 0.02

    def __post_init__(self):
        check_trajectories(self.trajectory)

    def __repr__(self):
        walks = len(check_trajectories(self.trajectory))
        return f"Demonstration of {walks} walks; {self.environment}"

    @classmethod
    def of(cls, observation, tolerance=0.02):
        """The demonstration in an Observation: the user's laps, or the whole walk if it does not repeat itself.

        Raises
        ------
        ValueError
            If nobody moved.
        """
        if observation.user is None:
            raise ValueError("a demonstration needs a user, but nobody moved")
        t, positions = observation.user.t, observation.user.positions
        return cls(laps(t, positions), observation.environment, float(np.median(np.diff(t))), tolerance)

    @cached_property
    def law(self):
        """Sequenced LDS of the walk (Sec. III)."""
        return SequencedLDS.fit(self.trajectory, self.tolerance, sample_period=self.sample_period)


@dataclass(frozen=True, eq=False)
class Task:
    """A control law whose subgoals are tied to objects.

    Attributes
    ----------
    law : SequencedLDS
        The control law in this environment.
    environment : Environment
        Where the objects stand.
    association : Association
        Ties the law's start and its K subgoals, K + 1 places, to corners of the environment.
    model : SubgoalHMM, optional
        What several demonstrations had in common, in the environment in which they were learned from. It is not saved.
    demonstrations : tuple of Demonstration
        What the task was learned from, so that more can be added.
    """

    law: SequencedLDS
    environment: Environment
    association: Association
    model: SubgoalHMM = None
    demonstrations: tuple = ()

    def __repr__(self):
        learned = f"learned from {len(self.demonstrations)} demonstrations"
        return f"Task of {len(self.law.segments)} subgoals, {learned}; {self.environment}"

    @classmethod
    def of(cls, demonstration):
        """The task as one demonstration shows it.

        Every place is tied to all corners, the near ones strongly, so that it has others to hold on to when an object
        is gone.
        """
        law, environment = demonstration.law, demonstration.environment
        association = associate(anchors(law), environment, m=len(environment.corners))
        return cls(law, environment, association, demonstrations=(demonstration,))

    def add(self, demonstration, spread=0.15):
        """The task as `learn` has it from all demonstrations so far and one more, in this task's environment."""
        return learn([*self.demonstrations, demonstration], self.environment, spread)

    def adapt(self, environment, matching=None, turned=False):
        """The task where the objects stand now: its subgoals moved, each LDS adapting by itself (Sec. IV-B).

        Parameters
        ----------
        environment : Environment
            The objects now.
        matching : Matching, optional
            From the task's environment to this one; found by `match` when not given.
        turned : bool
            Beyond the paper: turn the differences from the objects, and each LDS, with the layout.

        Returns
        -------
        Task

        Raises
        ------
        ValueError
            If the environments cannot be matched with confidence; the margin is named.
        """
        matching = matching or match_confidently(
            self.environment, environment, ("the task's environment", "the new one")
        )
        start, *subgoals = self.association.relocate(environment, matching, turned)
        law = self.law.with_subgoals(subgoals, start, turned)
        return replace(
            self, law=law, environment=environment, association=self.association.carried(environment, matching)
        )

    def save(self, path):
        """Write the task as JSON, whole or not at all."""
        with whole_file(path, "w") as stream:
            json.dump(as_dict(self), stream, indent=1)
            stream.write("\n")

    @classmethod
    def load(cls, path):
        """Read a task that `save` wrote.

        Raises
        ------
        FormatError
            For a file that is damaged, not a task, or of another version.
        """
        try:
            content = json.loads(read_bytes(path))
        except (ValueError, RecursionError) as error:
            raise FormatError(f"not a task: {error}", path) from error
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise FormatError(f"not a task: format must be {FORMAT!r}", path)
        if content.get("version") is not VERSION:
            raise FormatError(f"version must be {VERSION}, got {content.get('version')!r}", path)
        try:
            return from_dict(content)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise FormatError(f"a damaged task: {type(error).__name__} {error}", path) from error


def anchors(law):
    """The places of a law that move with objects: its start and its subgoals, (K + 1, 2) in m."""
    return np.vstack([law.start, law.subgoals])


def as_dict(task):
    """The task as plain lists, for JSON."""
    law, association = task.law, task.association
    segments = [
        {"goal": segment.goal.tolist()} | {name: getattr(segment.statistics, name).tolist() for name in ("G0", "G1")}
        for segment in law.segments
    ]
    tied = {name: getattr(association, name).tolist() for name in ("corners", "weights", "differences")}
    return {
        "format": FORMAT,
        "version": VERSION,
        "boxes": task.environment.boxes.tolist(),
        "start": law.start.tolist(),
        "speeds": law.speeds.tolist(),
        "segments": segments,
        "association": tied,
        "demonstrations": [
            {
                "walks": [walk.tolist() for walk in check_trajectories(shown.trajectory)],
                "boxes": shown.environment.boxes.tolist(),
                "sample_period": shown.sample_period,
                "tolerance": shown.tolerance,
            }
            for shown in task.demonstrations
        ],
    }


def from_dict(content):
    """A task from what `as_dict` made."""
    environment = Environment(np.array(content["boxes"], float))
    segments = tuple(
        LDS(Statistics(np.array(segment["G0"], float), np.array(segment["G1"], float)), segment["goal"])
        for segment in content["segments"]
    )
    tied = content["association"]
    association = Association(
        environment,
        np.array(tied["corners"], int),
        np.array(tied["weights"], float),
        np.array(tied["differences"], float),
    )
    law = SequencedLDS(segments, np.array(content["start"], float), np.array(content["speeds"], float))
    check_shapes(law, association)
    shown = tuple(
        Demonstration(
            [np.array(walk, float) for walk in each["walks"]],
            Environment(np.array(each["boxes"], float)),
            each["sample_period"],
            each["tolerance"],
        )
        for each in content["demonstrations"]
    )
    return Task(law, environment, association, demonstrations=shown)


def check_shapes(law, association):
    """Raise ValueError where the parts of a loaded task do not fit together."""
    places, ties = len(law.segments) + 1, association.corners.shape
    if law.speeds.shape != (places - 1,) or law.start.shape != (2,) or not law.segments:
        raise ValueError(
            f"one speed per segment and one start are needed, got {law.speeds.shape} and {law.start.shape}"
        )
    if ties[0] != places or association.weights.shape != ties or association.differences.shape != (*ties, 2):
        raise ValueError(f"the association must tie {places} places, got shapes {ties} and {association.weights.shape}")
    if not 0 <= association.corners.min() <= association.corners.max() < len(association.environment.corners):
        raise ValueError(f"corners must be 0 to {len(association.environment.corners) - 1}")
    numbers = [law.start, law.speeds, law.subgoals, association.weights, association.differences]
    if not all(np.isfinite(number).all() for number in numbers):
        raise ValueError("every number must be finite")
    if not (law.speeds > 0).all():
        raise ValueError(f"speeds must be positive, got {law.speeds.min()}")
    if (association.weights < 0).any():
        raise ValueError(f"weights must not be negative, got {association.weights.min()}")


def learn(demonstrations, environment=None, spread=0.15):
    """Learn a task from demonstrations in different environments (Sec. V).

    Every demonstration is segmented and mapped to one environment by matching and association; a CDHMM is estimated
    from all subgoals by merging; its most-likely path is the task, and segments merged along an edge share one LDS.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        One at least; one alone is the task.
    environment : Environment, optional
        The environment to learn in; that of the first demonstration by default.
    spread : float
        How far the subgoal of one demonstration is expected to lie from its mean, standard deviation in m.

    Returns
    -------
    Task
        In that environment; `.model` is the CDHMM, whose `.outliers()` are demonstrations of something else.

    Raises
    ------
    ValueError
        No demonstration; one whose environment cannot be matched with confidence, named with the margin; or one that
        cannot be segmented at its tolerance.
    """
    demonstrations = tuple(demonstrations)
    if not demonstrations:
        raise ValueError("learning needs at least one demonstration, got none")
    check_laws(demonstrations)
    environment = demonstrations[0].environment if environment is None else environment
    matchings = [matching_to(environment, demonstration, k) for k, demonstration in enumerate(demonstrations)]
    pairs = list(zip(demonstrations, matchings, strict=True))
    mapped = [Task.of(shown).adapt(environment, matching).law for shown, matching in pairs]
    model = SubgoalHMM.fit([law.subgoals for law in mapped], spread)
    members = members_along(model)
    association = tie_to_objects(environment, pairs, members)
    law = shared_law(model, mapped, members, association.relocate(environment))
    return Task(law, environment, association, model, demonstrations)


def check_laws(demonstrations):
    """Raise ValueError that names the demonstration that cannot be segmented."""
    for number, demonstration in enumerate(demonstrations):
        try:
            demonstration.law  # noqa: B018
        except ValueError as error:
            raise ValueError(f"demonstration {number}: {error}") from error


def matching_to(environment, demonstration, number):
    """The matching from demonstration `number` to the environment to learn in."""
    return match_confidently(demonstration.environment, environment, (f"demonstration {number}", "the one to learn in"))


def members_along(model):
    """Which segments of which demonstrations run along each edge of the most-likely path, from the start on."""
    path, segments = model.most_likely_path().tolist(), model.segments()
    return [segments[edge] for edge in pairwise([-1, *path])]


def shared_law(model, laws, members, places):
    """One LDS for all segments that run along the same edge of the most-likely path (Sec. V).

    Parameters
    ----------
    model : SubgoalHMM
    laws : list of SequencedLDS
        Of each demonstration.
    members : list of K lists of (demonstration, segment)
    places : (K + 1, 2) float array
        Where the law is to start, and its subgoals, m.
    """
    pooled = model.pooled([[segment.statistics for segment in law.segments] for law in laws])
    edges = pairwise([-1, *model.most_likely_path().tolist()])
    segments = tuple(LDS(pooled[edge], goal) for edge, goal in zip(edges, places[1:], strict=True))
    speeds = np.array([np.mean([laws[d].speeds[i] for d, i in shared]) for shared in members])
    return SequencedLDS(segments, places[0], speeds)


def tie_to_objects(environment, pairs, members):
    """Association of the learned start and subgoals with the objects, by closeness and by how little they vary.

    Each place is seen from the objects as they stood in every demonstration that went there.

    Parameters
    ----------
    environment : Environment
        N objects, the one to learn in.
    pairs : list of (Demonstration, Matching)
        With the matching into `environment`.
    members : list of K lists of (demonstration, segment)
        Which segments end in each subgoal.

    Returns
    -------
    Association
        Of K + 1 places.
    """
    demonstrated = [anchors(shown.law) for shown, _ in pairs]
    centres = [centres_in(environment, shown.environment, matching) for shown, matching in pairs]
    places = [[(d, 0) for d, i in members[0] if i == 0] or [(0, 0)], *([(d, i + 1) for d, i in m] for m in members)]
    ties = [tie(environment, [(demonstrated[d][i], centres[d]) for d, i in seen]) for seen in places]
    corners = np.tile(np.arange(4 * len(environment)), (len(ties), 1))
    weights, differences = (np.stack(column) for column in zip(*ties, strict=True))
    return Association(environment, corners, weights, differences)


def centres_in(environment, shown, matching):
    """Centres (N, 2) of the objects of another environment in this one's order, `nan` where there is none."""
    centres = np.full((len(environment), 2), np.nan)
    partners = matching.partners
    centres[partners[partners >= 0]] = shown.centres[partners >= 0]
    return centres


def tie(environment, seen):
    """Weights (4N,) and differences (4N, 2) to all corners of one place, `seen` several times as (place, centres)."""
    common = np.isfinite([centres[:, 0] for _, centres in seen]).all(axis=0)
    frames = [Frames(centres[common], np.zeros(common.sum())) for _, centres in seen]
    found = associate_with_frames([[place] for place, _ in seen], frames)
    weights, local = np.zeros(len(environment)), np.zeros((len(environment), 2))
    weights[common], local[common] = found.weights[:, 0], found.local[:, 0]
    return np.repeat(weights / 4, 4), np.repeat(local, 4, axis=0) - environment.corner_offsets
