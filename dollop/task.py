"""Tasks: learned from demonstrations, adapted to moved objects, saved (Sec. IV-B and V)."""

import json
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from dollop.association import Association, associate, layout_turn
from dollop.cdhmm import SubgoalHMM
from dollop.checks import (
    Note,
    check_choice,
    check_has,
    checked_flag,
    checked_number,
    checked_record,
    checked_records,
    checked_wholes,
    put_in,
    trusted,
)
from dollop.environment import Environment
from dollop.formats.files import check_json
from dollop.formats.kinds import TASK
from dollop.formats.writing import whole_file
from dollop.laps import cut_laps
from dollop.law.timing import Stands
from dollop.learning.anchored import learn_anchored, tied_to_corners, told_of_places
from dollop.learning.matchings import composed, inverse, matched_to, matchings_into, notes_of
from dollop.learning.paper import anchors, learn_as_paper
from dollop.learning.saving import as_dict, read_task
from dollop.learning.way import Way
from dollop.matching import Matching
from dollop.sequenced_lds import LEAST_REACH, PERIODS, SequencedLDS
from dollop.trajectory import check_trajectories, is_one, ways_apart

__all__ = ["Demonstration", "Task", "learn"]


@dataclass(frozen=True, eq=False)
class Demonstration:
    """What the user showed, and where the objects stood (Sec. V).

    Attributes
    ----------
    trajectory : (N, 2) float array, or list of (N_k, 2) float arrays
        The walk in m; several walks of the same task in the same environment, such as laps, are one
        demonstration. Kept as read-only copies.
    environment : Environment
        The static foreground objects.
    sample_period : float
        Time between samples of the walk in s; the demonstrated speed depends on it.
    tolerance : float
        Largest mean error of a segment in m, see `SequencedLDS.fit`.
    notes : tuple of Note
        What somebody who learns from it must know.

    Raises
    ------
    ValueError
        For what is no trajectory, no Environment, a sample period or tolerance out of its range (a
        microsecond to a million seconds; from a micrometre on), or what is no Note.
    """

    trajectory: np.ndarray
    environment: Environment
    sample_period: float = 0.1
    tolerance: float = 0.02
    notes: tuple = ()

    def __post_init__(self):
        one, walks = is_one(self.trajectory), check_trajectories(self.trajectory)
        for walk in walks:
            walk.flags.writeable = False
        put_in(
            self,
            trajectory=walks[0] if one else walks,
            environment=checked_record("environment", self.environment, Environment),
            sample_period=checked_number("sample_period", self.sample_period, *PERIODS),
            tolerance=checked_number("tolerance", self.tolerance, LEAST_REACH),
            notes=checked_records("notes", self.notes, Note),
        )

    def __repr__(self):
        return f"Demonstration, walked {len(self.walks)} x; {self.environment}"

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
            Of the user's laps, or of the whole walk if it holds less than two (see `cut_laps`). Laps
            that are not of the way of most are left out. It carries the observation's notes, and
            more where much of the way is in no lap, or a lap is left out.

        Raises
        ------
        ValueError
            If nobody moved.
        """
        check_has("observation", observation, "user", "environment")
        if observation.user is None:
            raise ValueError("a demonstration needs a user, but nobody moved")
        check_has("the user of an observation", observation.user, "t", "positions")
        t, positions = observation.user.t, observation.user.positions
        cut, period = cut_laps(t, positions), float(np.median(np.diff(t)))
        walks, told = _of_one_way(cut.laps)
        notes = (*getattr(observation, "notes", ()), *cut.notes, *told)
        return cls(walks, observation.environment, period, tolerance, notes)

    @cached_property
    def walks(self):
        """The walks as a list of (N_k, 2) float arrays, in m."""
        return check_trajectories(self.trajectory)

    @cached_property
    def stands(self):
        """The walks without their pauses, and where those were: a list of `dollop.law.timing.Stands`.

        Who stands at an end of a walk waits for the recording; that is no pause of the task.
        """
        return [Stands.of(walk, self.sample_period, "inner") for walk in self.walks]

    @cached_property
    def law(self):
        """Sequenced LDS of the walk (Sec. III)."""
        return SequencedLDS.fit(self.trajectory, self.tolerance, sample_period=self.sample_period)


def _of_one_way(laps):
    """The laps of the way that most of them go, and a note of those that do not: a last one may end early."""
    way, allowed, apart = ways_apart(laps)
    strays = np.flatnonzero(way)
    if not len(strays):
        return laps, ()
    gap = apart[strays][:, way == 0].min(axis=1).max()
    rule = f"{gap:.2f} m from the nearest of the others, more than {allowed:.2f} m"
    text = f"of {len(laps)} laps, counted from 0, {strays.tolist()} are left out: up to {rule}"
    note = Note("laps", text, doubt=2 * len(strays) >= len(laps))
    return [lap for lap, k in zip(laps, way, strict=True) if k == 0], (note,)


@dataclass(frozen=True, eq=False)
class Task:
    """A control law whose subgoals are tied to objects (Sec. IV-B and V).

    Where the demonstrators paused on their way, the law waits (beyond the paper): a pause is a
    subgoal, and lasts as long as the mean over the walks that go there, if half of them pause. Its
    place moves with the objects that it follows, its length stays. Who stands before the first step
    or after the last waits for the recording: that is none of the task.

    Attributes
    ----------
    law : SequencedLDS
        The control law in this environment: the way that was shown most often.
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
        What is in doubt: of the demonstrations, of what they had in common, and of where the
        objects went; none twice.
    ways : tuple of SequencedLDS
        The laws of all ways in which the task was shown, that of `law` first.
    shown : tuple of int
        How often each way was shown.
    partners : tuple of (int array or None)
        For each demonstration which of the N objects that were learned from each of its objects is,
        -1 for none; None for a demonstration that was set aside.
    objects : (N,) int array
        Which object of the environment each of those is, -1 where it is gone.
    learned : tuple of Way
        The ways as they were learned; none where the task was learned by method "paper".
    turn : float
        By how much the offsets from the objects are turned with the layout, in rad, since the ways
        were learned.

    Raises
    ------
    ValueError
        A field that is not of its kind, or counts of places, ways or objects that contradict each other.
    """

    law: SequencedLDS
    environment: Environment
    association: Association
    model: object = None
    demonstrations: tuple = ()
    notes: tuple = ()
    ways: tuple = ()
    shown: tuple = ()
    partners: tuple = ()
    objects: np.ndarray = None
    learned: tuple = ()
    turn: float = 0.0

    def __post_init__(self):
        law = checked_record("law", self.law, SequencedLDS)
        count = len(checked_record("environment", self.environment, Environment))
        places = len(checked_record("association", self.association, Association).corners)
        if places != len(law.segments) + 1:
            rule = f"the association must be of the start and {len(law.segments)} subgoals"
            raise ValueError(f"{rule}, got {places} places")
        if self.model is not None:
            checked_record("model", self.model, SubgoalHMM)
        shown = checked_records("demonstrations", self.demonstrations, Demonstration)
        ways = checked_records("ways", self.ways, SequencedLDS) or (law,)
        objects = np.arange(count) if self.objects is None else self.objects
        objects = checked_wholes("objects", objects, "N", least=-1, most=count - 1)
        counts = self.shown if np.size(self.shown) else (len(shown),)
        put_in(
            self,
            demonstrations=shown,
            notes=checked_records("notes", self.notes, Note),
            ways=ways,
            shown=tuple(checked_wholes("shown", counts, len(ways)).tolist()),
            partners=checked_partners(self.partners, shown, len(objects)),
            objects=objects,
            learned=checked_records("learned", self.learned, Way),
            turn=checked_number("turn", self.turn),
        )
        gone = {k for way in self.learned for k in way.members}
        lost = [k for k, each in enumerate(self.partners) if each is not None and k not in gone]
        if self.learned and lost:
            raise ValueError(f"a demonstration must go one of the ways or be set aside, got number {lost[0]}")

    def __repr__(self):
        shown, subgoals = len(self.demonstrations), len(self.law.segments)
        ways = f" in {len(self.ways)} ways" if len(self.ways) > 1 else ""
        pauses = () if self.law.pauses is None else self.law.pauses[self.law.pauses > 0]
        waits = f", waits {len(pauses)} x, {sum(pauses):.1f} s in all" if len(pauses) else ""
        doubts = ", ".join(dict.fromkeys(note.kind for note in self.notes if note.doubt))
        told = f"Task of {subgoals} subgoals, shown {shown} x{ways}{waits}; {self.environment}"
        return f"{told}; in doubt: {doubts}" if doubts else told

    def _repr_png_(self):
        """The task as a picture, which notebooks show."""
        from dollop import plot

        return plot.png(partial(plot.task, task=self))

    @property
    def trusted(self):
        """Whether no note puts the task in doubt."""
        return trusted(self.notes)

    @classmethod
    def of(cls, demonstration, method="anchored"):
        """The task as one demonstration shows it (Sec. IV-B).

        Every place is tied to all objects, the near ones strongly, so that it has others to hold on
        to when an object is gone.

        Parameters
        ----------
        demonstration : Demonstration
        method : {"anchored", "paper"}
            As for `learn`.

        Returns
        -------
        Task
            In the environment of the demonstration, without a model.

        Raises
        ------
        ValueError
            A walk that cannot be segmented at its tolerance; by the paper's method an environment
            without objects.

        Examples
        --------
        Objects that all move by the same take the task with them.

        >>> boxes = np.array([[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4]])
        >>> angle = np.linspace(0, np.pi, 50)
        >>> walk = np.stack([2 + np.cos(angle), np.sin(angle)], axis=1)
        >>> task = Task.of(Demonstration(walk, Environment(boxes)))
        >>> moved = task.adapt(Environment(boxes + [0.5, 2.0, 0.5, 2.0]))
        >>> bool(np.allclose(moved.law.response(), task.law.response() + [0.5, 2.0], atol=1e-6))
        True
        """
        check_choice("method", method, METHODS)
        checked_record("demonstration", demonstration, Demonstration)
        environment, shown = demonstration.environment, (demonstration,)
        partners = (np.arange(len(environment)),)
        if method == "paper":
            law = demonstration.law.without_waits_at_ends()
            tied = associate(anchors(law), environment, m=max(1, len(environment.corners)))
            return cls(law, environment, tied, None, shown, notes_of(shown), partners=partners)
        ways, _, notes = learn_anchored(shown, partners, environment, merged=False)
        known = {"demonstrations": shown, "notes": (*notes_of(shown), *notes), "partners": partners}
        return _laid_out(known | {"learned": ways}, environment, np.arange(len(environment)))

    def add(self, demonstration, spread=None, matching=None):
        """The task learned from all demonstrations so far and one more (Sec. V).

        Parameters
        ----------
        demonstration : Demonstration
        spread : float, optional
            As for `learn`.
        matching : Matching, optional
            From its environment to this task's; found when not given.

        Returns
        -------
        Task
            In this task's environment, by the same method.

        Raises
        ------
        ValueError
            As `learn`.
        """
        checked_record("demonstration", demonstration, Demonstration)
        known = [None if goes is None else Matching.of_partners(composed(goes, self.objects)) for goes in self.partners]
        known += [None] * (len(self.demonstrations) - len(known))
        shown, method = (
            [*self.demonstrations, demonstration],
            "anchored" if self.learned else "paper",
        )
        return learn(shown, self.environment, [*known, matching], method, spread)

    def adapt(self, environment, matching=None, turned=False):
        """The task where the objects stand now (Sec. IV-B).

        Its places move with the objects that they follow, and the law is what is fitted to them;
        by the paper's method its subgoals move, and each LDS adapts by itself.

        Parameters
        ----------
        environment : Environment
            The objects now.
        matching : Matching, optional
            From the task's environment to this one; found by `match` when not given. Pairs of which
            `match` is not sure are not used, and named in the notes.
        turned : bool
            Beyond the paper: turn the differences from the objects with the layout.

        Returns
        -------
        Task

        Raises
        ------
        ValueError
            If no object can be matched with confidence, if a given matching belongs to others, or
            if a place follows nothing that is left.
        """
        names, turned = ("the task's environment", "the new one"), checked_flag("turned", turned)
        matching, notes = matched_to(self.environment, environment, matching, names)
        objects = composed(self.objects, matching.partners)
        notes = tuple(dict.fromkeys((*self.notes, *notes)))
        if not self.learned:
            start, *subgoals = self.association.relocate(environment, matching, turned)
            law = self.law.with_subgoals(subgoals, start, turned)
            tied = self.association.carried(environment, matching, turned)
            return replace(
                self,
                law=law,
                environment=environment,
                association=tied,
                notes=notes,
                ways=(law,),
                objects=objects,
            )
        turn = self.turn + layout_turn_of(self.environment, environment, matching) if turned else 0.0
        known = {name: getattr(self, name) for name in ("model", "demonstrations", "partners", "learned")}
        return _laid_out(known | {"notes": notes, "turn": turn}, environment, objects)

    def errors(self):
        """How far the task is from what each demonstration showed, in its own environment.

        Returns
        -------
        (D,) float array
            Mean distance in m from the walks of each demonstration to the response of the task,
            adapted to where the objects stood for it, along the way that it was found to go; nan for
            one that was set aside.
        """
        return np.array([self._error(k) for k in range(len(self.demonstrations))])

    def _error(self, k):
        shown, partners = (
            self.demonstrations[k],
            self.partners[k] if k < len(self.partners) else None,
        )
        if not self.learned:
            names, given = ("the task's environment", f"that of demonstration {k}"), None
            if partners is not None:
                given = Matching.of_partners(inverse(composed(partners, self.objects), len(self.environment)))
            matching, _ = matched_to(self.environment, shown.environment, given, names)
            law = self.adapt(shown.environment, matching).law
        elif partners is None:
            return np.nan
        else:
            way = next(each for each in self.learned if k in each.members)
            law, _ = way.law(way.among(shown.environment, partners))
        return float(np.mean([law.error(walk) for walk in shown.walks]))

    def save(self, path):
        """Write the task as JSON, whole or not at all (a format of this library's own).

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        OSError
            Where the file cannot be written, or what is there is not a task.
        ValueError
            If it is more than `load` would read: 64 MiB, or 4 million numbers.
        """
        with whole_file(path, "w", TASK) as stream:
            text = json.dumps(as_dict(self), indent=1, default=np.ndarray.tolist) + "\n"
            check_json("a task that can be read again", text.encode())
            stream.write(text)

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
            For a file that is damaged, not a task, of another version, or whose numbers contradict
            each other.
        """
        return read_task(path, cls, Demonstration, _laid_out)


def _laid_out(known, environment, objects):
    """The task of ways that were learned, and of what else is known, where objects stand in an environment."""
    ways, partners = known["learned"], inverse(objects, len(environment))
    placed = [way.among(environment, partners, known.get("turn", 0.0)) for way in ways]
    laws, kept = zip(*(way.law(now) for way, now in zip(ways, placed, strict=True)), strict=True)
    tied = tied_to_corners(ways[0], placed[0], laws[0], environment, objects)
    notes = tuple(dict.fromkeys((*known["notes"], *told_of_places(ways, kept, partners))))
    shown = tuple(len(way.members) for way in ways)
    return Task(
        laws[0],
        environment,
        tied,
        ways=laws,
        shown=shown,
        **known | {"objects": objects, "notes": notes},
    )


def checked_partners(partners, demonstrations, n):
    """For each demonstration which of n objects its own are, (N_k,) int array or None, a tuple; or none.

    Raises
    ------
    ValueError
        Another number of demonstrations or of objects, or what is no number of an object.
    """
    partners = checked_records("partners", partners, object)
    if len(partners) not in (0, len(demonstrations)):
        rule = f"partners must be given for each of {len(demonstrations)} demonstrations"
        raise ValueError(f"{rule}, got {len(partners)}")
    found = []
    for each, shown in zip(partners, demonstrations, strict=False):
        if each is not None:
            each = checked_wholes("partners", each, len(shown.environment), least=-1, most=n - 1)
            each.flags.writeable = False
        found.append(each)
    return tuple(found)


def layout_turn_of(before, after, matching):
    """By how much a layout has turned, in rad."""
    matched = matching.indices >= 0
    return layout_turn(before.corners[matched], after.corners[matching.indices[matched]])


METHODS = ("anchored", "paper")


def learn(demonstrations, environment=None, matchings=None, method="anchored", spread=None):
    """Learn a task from demonstrations in different environments (Sec. V).

    "anchored": which object each place of the task follows is told from all demonstrations
    together, from closeness and from the evidence that the place has the same offset from that
    object in each; demonstrations that go other ways are kept as other ways, and what one lacks at
    its beginning or end is learned from the others. "paper": every demonstration is mapped to one
    environment by closeness, a CDHMM is estimated from all subgoals by merging, and its
    most-likely path is the task.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        One at least; one alone is the task. Where half of those of a way paused, it pauses for the
        mean (see `Task`).
    environment : Environment, optional
        The environment to learn in; that of the first demonstration by default.
    matchings : sequence of (Matching or None), optional
        One for each demonstration, from its environment to the one to learn in; None where it is to
        be found.
    method : {"anchored", "paper"}
    spread : float, optional
        How far the subgoal of one demonstration is expected to lie from its mean, standard
        deviation in m; estimated when not given.

    Returns
    -------
    Task
        In that environment; `.model` is the CDHMM. `.notes` names every demonstration that was set
        aside because its environment cannot be matched, that shows only a part, that goes another
        way, or that the task misses.

    Raises
    ------
    ValueError
        No demonstration; matchings that do not belong; none whose environment can be matched with
        confidence; one that cannot be segmented at its tolerance; or, by the paper's method, an
        environment without objects.
    """
    check_choice("method", method, METHODS)
    demonstrations = checked_records("demonstrations", demonstrations, Demonstration)
    if not demonstrations:
        raise ValueError("learning needs at least one demonstration, got none")
    environment = demonstrations[0].environment if environment is None else environment
    checked_record("environment", environment, Environment)
    found, aside = matchings_into(environment, demonstrations, matchings)
    partners = tuple(None if each is None else each.partners for each in found)
    used = [k for k, each in enumerate(found) if each is not None]
    notes = (*notes_of(demonstrations), *aside)
    if method == "paper":
        shown = [demonstrations[k] for k in used]
        law, tied, model = learn_as_paper(shown, [found[k] for k in used], environment, spread)
        return Task(law, environment, tied, model, demonstrations, notes, partners=partners)
    ways, model, told = learn_anchored(demonstrations, partners, environment, spread=spread)
    known = {
        "model": model,
        "demonstrations": demonstrations,
        "notes": (*notes, *told),
        "partners": partners,
    }
    return _laid_out(known | {"learned": ways}, environment, np.arange(len(environment)))
