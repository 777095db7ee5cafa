"""The control of a robot, step by step, for a loop of anybody's own (Sec. III)."""

from itertools import chain
from math import isfinite

import numpy as np

from dollop.checks import (
    Note,
    check_choice,
    check_has,
    checked_flag,
    checked_number,
    checked_record,
    checked_records,
    checked_wholes,
    told,
)
from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot.avoidance import PIONEER_AVOIDANCE, PIONEER_RADIUS, Avoidance, ObstacleMap
from dollop.robot.control import CONTROL_LAWS
from dollop.robot.guidance import PIONEER_FOLLOWING, Following, Limits
from dollop.robot.run import run_of
from dollop.robot.ways import WayKeeper
from dollop.sequenced_lds import SequencedLDS

__all__ = ["PERIODS", "Controller", "RobotError", "checked_radius"]

SEARCH_TURN, BACK_OFF, PUSHED = 0.5, 0.1, 2.0
"""A robot that does not know where it is turns on the spot, in rad/s, and moves off what it
touches, in m/s: back, and if that has not helped within so many s, forth."""
HELD = 1.0
"""Time in s for which a robot goes on to move off what it touched."""
LONGEST_RUN, MOST_PERIODS = 1e4, 1_000_000
"""s and control periods after which any run is given up: three hours, or a million periods."""
PERIODS = 1e-3, 10.0
"""s: no motor is told more often what to do, and none is left alone for longer."""
RADII = 1e-3, 100.0
"""m: no robot is smaller, or larger."""
ACCURACY = 0.05
"""m by which the pose of a robot may be off that does not say how far: as that of a localisation."""
SOONEST = 1e-6
"""s: the shortest time-out."""


class Controller:
    """The supervisory control law of a task, its avoidance and its patience, one pose after the other.

    For a loop of one's own, such as a node that is called back; `dollop.perform` is this in a loop,
    and asks for the same speeds to the last digit. What such a loop must know is told by `step`.

    Parameters
    ----------
    task : Task
        As for `dollop.perform`.
    robot : object
        With `limits` (Limits), `period` in s and `radius` in m: that of a circle round the place that
        its poses are of, which covers all of it; and with `accuracy`, in m, by which its pose may be
        off (0.05 if it does not tell). Where it has `localised`, `touching`, `noticed` or `true_pose`,
        they are read at every step.
    control : {"pursuit", "plain"}
        Dollop's own law, or the paper's kind.
    avoid : bool
        Go round obstacles; the paper's law does not.
    background : OccupancyGrid, optional
        Walls and furniture. Without it only the environment's boxes are known.
    timeout : float
        Give up after this time in s, and in any case after 10,000 s or a million steps.
    localise_within : float
        Give up when the robot has not known where it is for this time in s.
    following : Following
        Constants of the control law.
    avoidance : Avoidance
        How far the robot keeps off what stands there.
    places : sequence of (2,) sequences of float
        Without a background: where else in m the robot may come to.

    Attributes
    ----------
    over, reason : bool and str
        Whether the task is finished or given up, and why it was given up.

    Raises
    ------
    ValueError
        For an unknown control law, a subgoal that is off the map or in an obstacle (if every way has
        such a one), a radius for which there is no room anywhere, a time-out that is not positive,
        no ways, or not as many as `shown` counts; for a task or robot that lacks something, and
        what is not of its kind.

    Examples
    --------
    A loop of one's own does what `perform` does.

    >>> from dollop import Demonstration, Task, Unicycle, perform
    >>> walk = np.linspace([0.0, 0.0], [3.0, 1.0], 50)
    >>> task = Task.of(Demonstration(walk, Environment([[1.5, 2.0, 2.0, 2.5]])))
    >>> robot = Unicycle((0.0, 0.0, 0.3))
    >>> controller = Controller(task, robot)
    >>> while not controller.over:
    ...     robot.drive(*controller.step(robot.pose))
    >>> run = perform(task, Unicycle((0.0, 0.0, 0.3)))
    >>> controller.run().finished, bool((controller.run().poses == run.poses).all())
    (True, True)
    """

    def __init__(
        self,
        task,
        robot,
        control="pursuit",
        avoid=True,
        background=None,
        timeout=600.0,
        localise_within=120.0,
        following=PIONEER_FOLLOWING,
        avoidance=PIONEER_AVOIDANCE,
        places=(),
    ):
        check_choice("control", control, CONTROL_LAWS)
        avoid = checked_flag("avoid", avoid)
        self._timeout = min(checked_number("timeout", timeout, SOONEST, np.inf), LONGEST_RUN)
        self._patience = checked_number("localise_within", localise_within, SOONEST, np.inf)
        if background is not None:
            checked_record("background", background, OccupancyGrid)
        checked_record("following", following, Following)
        checked_record("avoidance", avoidance, Avoidance)
        self._robot = _Body(robot)
        check_has("task", task, "law", "environment")
        checked_record("the task's environment", task.environment, Environment)
        laws, shown = ways_of(task, only=control == "plain" and not avoid)
        subgoals = list(map(named_subgoals, laws))
        held = [place for _, place in chain.from_iterable(subgoals)]
        held += [law.start for law in laws] + [place[:2] for place in places]

        rules = avoidance.beside(self._robot.accuracy)

        def chart(boxes, finer=1):
            environment = Environment(np.vstack([task.environment.boxes, boxes]))
            return ObstacleMap.of(environment, background, held, self._robot.radius, rules=rules, finer=finer)

        self._keeper = WayKeeper(laws, shown, self._robot, control, chart, avoid, following)
        if avoid:
            self.known.check_room()
        check_some_way(subgoals, self.known, following.reach if avoid else 0.0)
        self.reason, self.over = "", False
        self._notes, self._rows, self._times = self._robot.notes, [], []
        self._late = self._blind = self._leaping = 0.0
        limits, period = self._robot.limits, self._robot.period
        self._most = *limits[:2], limits.acceleration * period, limits.turn_acceleration * period
        self._last = 0.0, 0.0
        self._search, self._clearance = Search(self._robot.period), Clearance()

    def __repr__(self):
        end = "driving" if not self.over else self.reason or "over"
        return f"Controller of {self._robot}: {end}"

    @property
    def active(self):
        """Int: the segment in force."""
        return self._keeper.active

    @property
    def way(self):
        """Int: index of the way in force among those of the task."""
        return self._keeper.way

    @property
    def known(self):
        """ObstacleMap: what is known to stand there."""
        return self._keeper.known

    @property
    def time(self):
        """Float: time in s of the next step, if it is not late; the first is at 0."""
        return len(self._rows) * self._robot.period + self._late

    def step(self, pose, elapsed=None):
        """Speed and turning rate for the next period.

        It never waits for anything. Most steps take less than 0.1 ms, those that roll out the response
        anew some 5 ms, those that look for a way round what is in the way, or take in what the robot
        has noticed, some 0.05 s on a map of 10 m x 10 m; and before it gives up there is one that looks
        closer, for up to a second.

        - **Limits**: the speeds are within the robot's, and change from step to step by no more than
          its accelerations allow in a period, but for braking before what is suddenly near.
        - **Lost**: a robot whose `localised` is false, or whose pose is None, turns on the spot, and
          first moves off what it touches, if it has `touching`. After `localise_within` s the task is
          given up.
        - **Late**: without `elapsed`, every step counts as a period. With it, waits and patience are
          those of the clock. What was asked for last is what a robot does until it is told
          otherwise: one whose loop may stop must stop by itself.
        - **Pushed or carried off**: nothing need be said. The task goes on from where the robot is, to
          the subgoal that it was heading for. A pose that leaps at more steps than not for
          `localise_within` s is broken, and the task is given up.
        - **What the robot sees** that its map does not have: `noticed`, an Environment of all of it.

        Parameters
        ----------
        pose : (3,) sequence of float, or None
            x, y in m, theta in rad: where the robot believes that it is; None if it does not know.
        elapsed : float, optional
            Time in s since the last step; the robot's period if not given.

        Returns
        -------
        (float, float)
            v in m/s and omega in rad/s, counter-clockwise, within the limits; both 0 once it is over.

        Raises
        ------
        ValueError
            For a pose that is no three numbers, or an elapsed time that is none or negative.
        RobotError
            Where the robot raises when it is asked for what it tells.
        """
        if self.over:
            return 0.0, 0.0
        period = self._robot.period
        if elapsed is not None:
            elapsed = checked_number("elapsed", elapsed, 0.0, LONGEST_RUN) if self._rows else period
            self._late += elapsed - period if self._rows else 0.0
        elapsed, now = period if elapsed is None else elapsed, self.time
        lost = pose is None
        x, y, theta = pose = _as_pose("the pose", pose)
        finite = isfinite(x + y + theta)
        localised = not lost and self._robot.localised
        touching = self._robot.touching
        if localised and finite:
            self._keeper.begin(x, y)
        true_pose = self._robot.true_pose(pose)
        self._rows.append((*pose, *true_pose, self.active, self.way, localised, touching))
        self._times.append(now)
        self._clearance.add(true_pose[0], true_pose[1], self.known)
        if localised and not finite:
            return self._stop(f"the pose must be finite, got {x, y, theta} at {now:.1f} s")
        if localised and self._keeper.refused:
            return self._stop(self._keeper.refused)
        if localised:
            self._blind = 0.0
            wish, most = self._keeper.command(x, y, theta, elapsed, self._last[0] == 0.0)
            leapt = self._keeper.supervisor.leapt
            self._leaping = max(self._leaping + (elapsed if leapt else -elapsed), 0.0)
        else:
            self._blind += elapsed
            wish, most = self._search.command(touching), np.inf
        return self._given_up(x, y, now) or self._ramped(*wish, most)

    def _given_up(self, x, y, now):
        """Stop where it is time to, and say why; None otherwise."""
        if self._keeper.hopeless:
            return self._stop(f"{self._keeper.reason(x, y)} at {now:.1f} s")
        if self._blind > self._patience:
            return self._stop(f"the robot has not known where it is for {self._patience:g} s")
        if self._leaping > self._patience:
            rule = f"by more than {self._keeper.supervisor.jump:g} m from step to step"
            return self._stop(
                f"the pose has leapt {rule} for {self._patience:g} s: kidnapped again and again, or broken"
            )
        if now >= self._timeout:
            leaping = ", and the pose leaps" if self._leaping > 1.0 else ""
            return self._stop(f"not finished within {self._timeout:g} s{leaping}")
        if len(self._rows) > MOST_PERIODS:
            return self._stop(f"not finished within {MOST_PERIODS} periods of {self._robot.period:g} s")
        return None

    def _ramped(self, speed, turn, most):
        """What is wished for within the limits, no faster than is safe; over where it stands at the end."""
        (last_speed, last_turn), (fastest, sharpest, step, turn_step) = self._last, self._most
        speed = max(-fastest, last_speed - step, min(speed, fastest, last_speed + step))
        turn = max(-sharpest, last_turn - turn_step, min(turn, sharpest, last_turn + turn_step))
        self._last = min(speed, most), turn
        if self._keeper.done and self._last == (0.0, 0.0):
            self.over = True
        return self._last

    def _stop(self, reason):
        """Give up, and stand."""
        self.reason, self.over = reason, True
        return 0.0, 0.0

    def give_up(self, reason):
        """End the task from outside, as when the robot fails.

        Parameters
        ----------
        reason : str

        Raises
        ------
        ValueError
            For what is no text, or empty.
        """
        if not checked_record("reason", reason, str):
            raise ValueError("a task that is given up needs a reason, got ''")
        if not self.over:
            self._stop(reason)

    def run(self, kidnapped=()):
        """What has come of the task so far, and whether it was the task.

        Parameters
        ----------
        kidnapped : sequence of float
            Times in s at which somebody put the robot elsewhere.

        Returns
        -------
        Run

        Raises
        ------
        ValueError
            Before the first step.
        """
        if not self._rows:
            raise ValueError("a run must have a period, got none: no step was taken")
        reason = self.reason or ("" if self._keeper.done else "it is not over yet")
        notes = (*self._notes, *self._keeper.notes())
        clearance = self._clearance.all()
        return run_of(
            self._rows,
            np.array(self._times),
            clearance,
            self._keeper,
            self._robot,
            reason,
            kidnapped,
            notes,
        )


def _as_pose(name, pose):
    """A pose as three floats, NaN for one that nobody knows."""
    if pose is None:
        return np.nan, np.nan, np.nan
    try:
        x, y, theta = map(float, pose)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be three numbers or None, got {told(pose)}") from None
    return x, y, theta


class _Body:
    """A robot as a controller knows it: size, limits, period, and what it tells at every step."""

    def __init__(self, robot):
        check_has("robot", robot, "limits", "period")
        check_has("the robot's limits", robot.limits, *Limits._fields)
        self.limits = Limits(*(getattr(robot.limits, name) for name in Limits._fields))
        self.period = checked_number("the robot's period", robot.period, *PERIODS)
        self.notes, self._robot = (), robot
        if not hasattr(robot, "radius"):
            text = f"the robot tells no radius: that of a Pioneer, {PIONEER_RADIUS:g} m, is taken"
            self.notes = (Note("radius", text),)
        self.radius = checked_radius(getattr(robot, "radius", PIONEER_RADIUS))
        accuracy = getattr(robot, "accuracy", ACCURACY)
        self.accuracy = checked_number("the robot's accuracy", accuracy, 0.0, RADII[1])
        told = ("localised", "touching", "noticed", "true_pose")
        self._doubts, self._feels, self._sees, self._measured = (hasattr(robot, name) for name in told)
        if self._doubts:
            checked_flag("whether the robot is localised", robot.localised)

    def __repr__(self):
        return f"a robot of {self.radius:g} m radius"

    @property
    def localised(self):
        """Whether the robot trusts its pose."""
        return self._read("localised") if self._doubts else True

    @property
    def touching(self):
        """Whether it touches something, None if it cannot feel."""
        return self._read("touching") if self._feels else None

    @property
    def noticed(self):
        """All that it has noticed so far."""
        return self._read("noticed") if self._sees else None

    def true_pose(self, pose):
        """Where it is, if it tells; else what it believes."""
        return _as_pose("true_pose", self._read("true_pose")) if self._measured else pose

    def _read(self, name):
        """What the robot tells."""
        try:
            return getattr(self._robot, name)
        except Exception as error:
            raise RobotError(f"the robot failed in {name} with {type(error).__name__}: {error}") from error


class RobotError(RuntimeError):
    """A robot that cannot tell what it is asked for."""


def checked_radius(radius):
    """The radius of a robot, if it is one.

    Parameters
    ----------
    radius : float
        In m.

    Returns
    -------
    float
        From a millimetre to 100 m.

    Raises
    ------
    ValueError
        For what is none.
    """
    return checked_number("the robot's radius", radius, *RADII)


class Search:
    """What a lost robot does: turn on the spot, and before that move off what it touches."""

    def __init__(self, period):
        self.period, self.speed, self.pushed, self.off = period, -BACK_OFF, 0.0, HELD

    def command(self, touching):
        """v in m/s and omega in rad/s, by whether the robot touches something."""
        if self.off >= HELD and not touching:
            self.speed, self.pushed = -BACK_OFF, 0.0
            return 0.0, SEARCH_TURN
        self.off = 0.0 if touching else self.off + self.period
        self.pushed += self.period if touching else 0.0
        if self.pushed > PUSHED:
            self.speed, self.pushed = -self.speed, 0.0
        return self.speed, 0.0


class Clearance:
    """Distances in m from the robot's edge, each on the map of its period, which is not kept."""

    def __init__(self):
        self.known, self.places, self.told = None, [], []

    def add(self, x, y, known):
        """One more place in m, on a map."""
        if known is not self.known and self.places:
            self.all()
        self.known = known
        self.places.append((x, y))

    def all(self):
        """(N,) float array: of all places so far."""
        if self.places:
            self.told.append(self.known.edges(self.places))
            self.places = []
        return np.concatenate(self.told)


def ways_of(task, only=False):
    """The laws of a task, one for each way, and how often each was shown; or of the first only.

    Raises
    ------
    ValueError
        No ways, or not as many as are counted.
    """
    checked_record("the task's law", task.law, SequencedLDS)
    if only:
        return (task.law,), (1,)
    laws = checked_records("the task's ways", getattr(task, "ways", (task.law,)), SequencedLDS)
    shown = checked_wholes("shown", getattr(task, "shown", (1,) * len(laws)), "W").tolist()
    if not 0 < len(laws) == len(shown):
        got = f"got {len(laws)} ways and {told(shown)}"
        raise ValueError(f"a task must have a way, and shown must count each, {got}")
    return laws, tuple(shown)


def named_subgoals(law):
    """The subgoals of a law, each with its name."""
    return [(f"subgoal {k}", place) for k, place in enumerate(law.subgoals, 1)]


def check_some_way(ways, obstacles, enough):
    """Raise ValueError, that of the first, if every way has a subgoal off the map or blocked.

    It may lie in an obstacle if there is room for the robot within `enough` m of it.
    """
    errors = []
    for subgoals in ways:
        try:
            return obstacles.check_free([each for each in subgoals if not obstacles.has_room(*each[1], enough)])
        except ValueError as error:
            errors.append(error)
    raise errors[0]
