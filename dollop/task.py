"""Tasks: learned from demonstrations, adapted to moved objects, saved (Sec. IV-B and V)."""

import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import chain, pairwise

import numpy as np

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.checks import check_positive, checked_array
from dollop.environment import Environment
from dollop.formats.files import FormatError, read_bytes, whole_file
from dollop.laps import cut_laps
from dollop.lds import LDS, Statistics
from dollop.matching import match_surely
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import check_trajectories

__all__ = ["Demonstration", "Task", "anchors", "learn", "members_along"]

FORMAT, VERSION = "dollop task", 1


@dataclass(frozen=True, eq=False)
class Demonstration:
    """What the user showed, and where the objects stood (Sec. V).

    Attributes
    ----------
    trajectory : (N, 2) float array, or list of (N_k, 2) float arrays
        The walk in m; several walks of the same task in the same environment, such as laps, are one
        demonstration.
    environment : Environment
        The static foreground objects.
    sample_period : float
        Time between samples of the walk in s; the demonstrated speed depends on it.
    tolerance : float
        Largest mean error of a segment in m, see `SequencedLDS.fit`.
    notes : tuple of Note
        What somebody who learns from it must know. They are not saved.

    Raises
    ------
    ValueError
        For what is no trajectory.
    """

    trajectory: np.ndarray
    environment: Environment
    sample_period: float = 0.1
    tolerance: float = 0.02
    notes: tuple = ()

    def __post_init__(self):
        check_trajectories(self.trajectory)

    def __repr__(self):
        return f"Demonstration, walked {len(check_trajectories(self.trajectory))} x; {self.environment}"

    @classmethod
    def of(cls, observation, tolerance=0.02):
        """The demonstration that was observed (Sec. II).

        Parameters
        ----------
        observation : Observation
            Of one user.
        tolerance : float
            Largest mean error of a segment in m, see `SequencedLDS.fit`.

        Returns
        -------
        Demonstration
            Of the user's laps, or of the whole walk if it holds less than two (see `cut_laps`). It
            carries the observation's notes, and one more where much of the way is in no lap.

        Raises
        ------
        ValueError
            If nobody moved.
        """
        if observation.user is None:
            raise ValueError("a demonstration needs a user, but nobody moved")
        t, positions = observation.user.t, observation.user.positions
        cut, period = cut_laps(t, positions), float(np.median(np.diff(t)))
        notes = (*getattr(observation, "notes", ()), *cut.notes)
        return cls(cut.laps, observation.environment, period, tolerance, notes)

    @cached_property
    def law(self):
        """Sequenced LDS of the walk (Sec. III)."""
        return SequencedLDS.fit(self.trajectory, self.tolerance, sample_period=self.sample_period)


@dataclass(frozen=True, eq=False)
class Task:
    """A control law whose subgoals are tied to objects (Sec. IV-B and V).

    Attributes
    ----------
    law : SequencedLDS
        The control law in this environment.
    environment : Environment
        Where the objects stand.
    association : Association
        Ties the law's start and its K subgoals, K + 1 places, to corners of the environment.
    model : SubgoalHMM, optional
        What several demonstrations had in common, in the environment in which they were learned
        from. It is not saved.
    demonstrations : tuple of Demonstration
        What the task was learned from, so that more can be added.
    notes : tuple of Note
        Those of its demonstrations, none twice. They are not saved.
    """

    law: SequencedLDS
    environment: Environment
    association: Association
    model: SubgoalHMM = None
    demonstrations: tuple = ()
    notes: tuple = ()

    def __repr__(self):
        shown, subgoals = len(self.demonstrations), len(self.law.segments)
        return f"Task of {subgoals} subgoals, shown {shown} x; {self.environment}"

    @classmethod
    def of(cls, demonstration):
        """The task as one demonstration shows it (Sec. IV-B).

        Every place is tied to all corners, the near ones strongly, so that it has others to hold on
        to when an object is gone.

        Parameters
        ----------
        demonstration : Demonstration

        Returns
        -------
        Task
            In the environment of the demonstration.

        Raises
        ------
        ValueError
            An environment without objects, or a walk that cannot be segmented at its tolerance.

        Examples
        --------
        Objects that all move by the same take the task with them.

        >>> boxes = np.array([[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4]])
        >>> angle = np.linspace(0, np.pi, 50)
        >>> walk = np.stack([2 + np.cos(angle), np.sin(angle)], axis=1)
        >>> task = Task.of(Demonstration(walk, Environment(boxes)))
        >>> moved = task.adapt(Environment(boxes + [0.5, 2.0, 0.5, 2.0]))
        >>> bool(np.allclose(moved.law.response(), task.law.response() + [0.5, 2.0]))
        True
        """
        law, environment = demonstration.law, demonstration.environment
        association = associate(anchors(law), environment, m=len(environment.corners))
        shown = (demonstration,)
        return cls(law, environment, association, demonstrations=shown, notes=notes_of(shown))

    def add(self, demonstration, spread=0.15):
        """The task learned from all demonstrations so far and one more (Sec. V).

        Parameters
        ----------
        demonstration : Demonstration
        spread : float
            As for `learn`.

        Returns
        -------
        Task
            In this task's environment.

        Raises
        ------
        ValueError
            As `learn`.
        """
        return learn([*self.demonstrations, demonstration], self.environment, spread)

    def adapt(self, environment, matching=None, turned=False):
        """The task where the objects stand now (Sec. IV-B).

        Its subgoals move, and each LDS adapts by itself.

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
        names = "the task's environment", "the new one"
        matching = matching or match_surely(self.environment, environment, names)[0]
        start, *subgoals = self.association.relocate(environment, matching, turned)
        law = self.law.with_subgoals(subgoals, start, turned)
        tied = self.association.carried(environment, matching)
        return replace(self, law=law, environment=environment, association=tied)

    def save(self, path):
        """Write the task as JSON, whole or not at all (a format of this library's own).

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        OSError
            Where the file cannot be written.
        """
        with whole_file(path, "w") as stream:
            json.dump(as_dict(self), stream, indent=1, default=np.ndarray.tolist)
            stream.write("\n")

    @classmethod
    def load(cls, path):
        """Read a task that `save` wrote.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Task
            Without its `model`.

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
        except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            raise FormatError(f"a damaged task: {type(error).__name__} {error}", path) from error


def anchors(law):
    """The places of a law that move with objects: its start and its subgoals (Sec. IV-B).

    Parameters
    ----------
    law : SequencedLDS
        Of K segments.

    Returns
    -------
    (K + 1, 2) float array
        In m.
    """
    return np.vstack([law.start, law.subgoals])


def as_dict(task):
    """What is saved of a task: names to numbers, lists and arrays, of which JSON makes lists."""
    law, tied = task.law, task.association
    return {
        "format": FORMAT,
        "version": VERSION,
        "boxes": task.environment.boxes,
        "start": law.start,
        "speeds": law.speeds,
        "segments": [{"goal": each.goal, **asdict(each.statistics)} for each in law.segments],
        "association": {name: getattr(tied, name) for name in ("corners", "weights", "differences")},
        "demonstrations": [
            {
                "walks": check_trajectories(each.trajectory),
                "boxes": each.environment.boxes,
                "sample_period": each.sample_period,
                "tolerance": each.tolerance,
            }
            for each in task.demonstrations
        ],
    }


def from_dict(content):
    """A task from what JSON makes of `as_dict`; ValueError where its parts do not fit together."""
    environment, segments = Environment(content["boxes"]), content["segments"]
    check_positive("the number of segments", len(segments))
    start = checked_array("start", content["start"], 2)
    speeds = checked_array("speeds", content["speeds"], len(segments))
    check_positive("speeds", speeds.min())
    law = SequencedLDS(tuple(map(segment_from, segments)), start, speeds)
    association = association_from(content["association"], environment, len(segments) + 1)
    shown = tuple(map(demonstration_from, content["demonstrations"]))
    return Task(law, environment, association, demonstrations=shown)


def segment_from(content):
    """A saved LDS."""
    G0, G1 = (checked_array(name, content[name], 2, 2) for name in ("G0", "G1"))
    return LDS(Statistics(G0, G1), content["goal"])


def association_from(content, environment, places):
    """The saved association of so many places with the corners of an environment."""
    corners = checked_array("corners", content["corners"], places, "m").astype(int)
    weights = checked_array("weights", content["weights"], *corners.shape)
    differences = checked_array("differences", content["differences"], *corners.shape, 2)
    if not 0 <= corners.min() <= corners.max() < len(environment.corners):
        raise ValueError(f"corners must be 0 to {len(environment.corners) - 1}")
    check_positive("weights", weights.min(), or_zero=True)
    return Association(environment, corners, weights, differences)


def demonstration_from(content):
    """A saved demonstration."""
    walks, environment = check_trajectories(content["walks"]), Environment(content["boxes"])
    return Demonstration(walks, environment, content["sample_period"], content["tolerance"])


def learn(demonstrations, environment=None, spread=0.15):
    """Learn a task from demonstrations in different environments (Sec. V).

    Every demonstration is segmented and mapped to one environment by matching and association; a
    CDHMM is estimated from all subgoals by merging; its most-likely path is the task, and segments
    merged along an edge share one LDS.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        One at least; one alone is the task.
    environment : Environment, optional
        The environment to learn in; that of the first demonstration by default.
    spread : float
        How far the subgoal of one demonstration is expected to lie from its mean, standard
        deviation in m.

    Returns
    -------
    Task
        In that environment; `.model` is the CDHMM, whose `.outliers()` are demonstrations of
        something else.

    Raises
    ------
    ValueError
        No demonstration; one whose environment cannot be matched with confidence, named with the
        margin; or one that cannot be segmented at its tolerance.
    """
    demonstrations = tuple(demonstrations)
    if not demonstrations:
        raise ValueError("learning needs at least one demonstration, got none")
    environment = demonstrations[0].environment if environment is None else environment
    mapped = [mapped_to(environment, shown, k) for k, shown in enumerate(demonstrations)]
    laws, centres = zip(*mapped, strict=True)
    model = SubgoalHMM.fit([law.subgoals for law in laws], spread)
    members = members_along(model)
    association = tie_to_objects(environment, demonstrations, centres, members)
    law = shared_law(laws, members, association.relocate(environment))
    return Task(law, environment, association, model, demonstrations, notes_of(demonstrations))


def notes_of(demonstrations):
    """The notes of all demonstrations in order, none twice, as a tuple."""
    return tuple(dict.fromkeys(chain.from_iterable(shown.notes for shown in demonstrations)))


def mapped_to(environment, demonstration, number):
    """The law of a demonstration in the environment to learn in, and where its objects stood.

    That is (N, 2) centres in m in the order of the environment, nan for an object that was not
    there.
    """
    names = f"demonstration {number}", "the one to learn in"
    try:
        task = Task.of(demonstration)
    except ValueError as error:
        raise ValueError(f"{names[0]}: {error}") from error
    matching = match_surely(task.environment, environment, names)[0]
    centres, partners = np.full((len(environment), 2), np.nan), matching.partners
    centres[partners[partners >= 0]] = task.environment.centres[partners >= 0]
    return task.adapt(environment, matching).law, centres


def members_along(model):
    """Which segments of which demonstrations run along each edge of the most-likely path (Sec. V).

    Parameters
    ----------
    model : SubgoalHMM

    Returns
    -------
    list of K lists of (demonstration, segment)
        From the start on.
    """
    path, segments = model.most_likely_path().tolist(), model.segments()
    return [segments[edge] for edge in pairwise([-1, *path])]


def shared_law(laws, members, places):
    """One LDS for all segments that run along the same edge of the most-likely path (Sec. V).

    Parameters
    ----------
    laws : sequence of SequencedLDS
        Of each demonstration.
    members : list of K lists of (demonstration, segment)
    places : (K + 1, 2) float array
        Where the law is to start, and its subgoals, m.

    Returns
    -------
    SequencedLDS
        Of K segments.
    """
    segments, speeds = [], []
    for shared, goal in zip(members, places[1:], strict=True):
        first, *others = [laws[d].segments[i].statistics for d, i in shared]
        segments.append(LDS(sum(others, first), goal))
        speeds.append(np.mean([laws[d].speeds[i] for d, i in shared]))
    return SequencedLDS(tuple(segments), places[0], np.array(speeds))


def tie_to_objects(environment, demonstrations, centres, members):
    """Association of start and subgoals with objects, by closeness and by how little they vary.

    Each place is seen from the objects as they stood in every demonstration that went there.

    Parameters
    ----------
    environment : Environment
        N objects, the one to learn in.
    demonstrations : sequence of Demonstration
    centres : sequence of (N, 2) float arrays
        Where these objects stood in each demonstration, in m.
    members : list of K lists of (demonstration, segment)
        Which segments end in each subgoal.

    Returns
    -------
    Association
        Of K + 1 places.
    """
    demonstrated = [anchors(shown.law) for shown in demonstrations]
    starts = [(d, -1) for d, i in members[0] if i == 0] or [(0, -1)]
    ties = [tie(environment, demonstrated, centres, seen) for seen in (starts, *members)]
    corners = np.tile(np.arange(4 * len(environment)), (len(ties), 1))
    return Association(environment, corners, *map(np.stack, zip(*ties, strict=True)))


def tie(environment, demonstrated, centres, seen):
    """Weights (4N,) and differences (4N, 2) to all corners of one place.

    It is where `seen`, segments as (demonstration, segment), end; the start is where segment -1
    does.
    """
    places = [[demonstrated[d][i + 1]] for d, i in seen]
    stood = np.array([centres[d] for d, _ in seen])
    common = np.isfinite(stood[..., 0]).all(axis=0)
    frames = [Frames(each[common], np.zeros(common.sum())) for each in stood]
    found = associate_with_frames(places, frames)
    weights, local = np.zeros(len(environment)), np.zeros((len(environment), 2))
    weights[common], local[common] = found.weights[:, 0], found.local[:, 0]
    return np.repeat(weights / 4, 4), np.repeat(local, 4, axis=0) - environment.corner_offsets
