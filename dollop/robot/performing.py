"""Performing a task: robots, kidnapping, and what comes of it (Sec. III; Fig. 7, 10 and 12).

A robot is anything with `pose` (x, y in m, theta in rad: what it believes), `localised` (whether it
trusts its belief), `limits`, `period` in s, `radius` in m (of a circle round the place that its pose
is of, which covers all of it), and `drive(v, omega)`, which lets one period pass. It may tell by
`accuracy` how far in m its pose may be off; 0.05 if it does not. One that can feel
what it touches has `touching`; one that sees what its map does not have tells it by `noticed`, an
Environment of all that it has noticed so far; a simulated one has `true_pose`, for measuring, and
`place(pose)`, which kidnaps it. Here is a fast one for studies; `dollop.lab` has the Pioneer.
"""

from contextlib import suppress
from math import isfinite

from dollop.checks import (
    check_has,
    check_positive,
    checked_array,
    checked_flag,
    checked_number,
    checked_positions,
    checked_records,
    shortened,
    told,
)
from dollop.pose import moved_pose
from dollop.robot.avoidance import PIONEER_AVOIDANCE, PIONEER_RADIUS
from dollop.robot.controller import PERIODS, Controller, RobotError, checked_radius
from dollop.robot.guidance import PIONEER_FOLLOWING, PIONEER_LIMITS, Limits

__all__ = ["Unicycle", "perform"]


class Unicycle:
    """A robot without mass that knows its pose, and passes through what it hits (reconstruction).

    Parameters
    ----------
    pose : (3,) sequence of float
        x, y in m, theta in rad.
    limits : Limits
    period : float
        Control period in s, a millisecond to ten seconds.
    radius : float
        In m, a millimetre to 100 m.

    Raises
    ------
    ValueError
        For a pose that is not finite or beyond 1e9, limits that are none, or another period or radius.

    Examples
    --------
    From rest it cannot be fast at once.

    >>> robot = Unicycle((0.0, 0.0, 0.0))
    >>> robot.drive(0.5, 0.0)
    >>> round(robot.pose[0], 6)
    0.005
    """

    localised = True

    def __repr__(self):
        return "Unicycle at ({:.2f}, {:.2f}, {:.2f})".format(*self.pose)

    def __init__(self, pose, limits=PIONEER_LIMITS, period=0.1, radius=PIONEER_RADIUS):
        self.limits = Limits(*checked_array("limits", limits, 4, finite=False))
        self.period = checked_number("period", period, *PERIODS)
        self.radius, self.accuracy = checked_radius(radius), 0.0
        self.place(pose)

    def place(self, pose):
        """Put the robot at rest at a pose.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.

        Raises
        ------
        ValueError
            For a pose that is not finite, or beyond 1e9.
        """
        self.pose = tuple(checked_positions("the pose of a robot", pose, 3).tolist())
        self.speed = self.turn = 0.0

    def drive(self, speed, turn):
        """Move for one period, towards the speeds asked for as far as the limits allow.

        Parameters
        ----------
        speed : float
            In m/s.
        turn : float
            In rad/s, counter-clockwise.

        Raises
        ------
        ValueError
            For what are no numbers.
        """
        if not (type(speed) is type(turn) is float and isfinite(speed + turn)):
            speed, turn = checked_number("speed", speed), checked_number("turn", turn)
        fastest, sharpest, acceleration, turn_acceleration = self.limits
        step, turn_step = acceleration * self.period, turn_acceleration * self.period
        self.speed = max(-fastest, self.speed - step, min(speed, fastest, self.speed + step))
        self.turn = max(-sharpest, self.turn - turn_step, min(turn, sharpest, self.turn + turn_step))
        arc = self.speed * self.period, self.turn * self.period
        self.pose = tuple(moved_pose(self.pose, *arc).tolist())


def perform(
    task,
    robot,
    control="pursuit",
    avoid=True,
    background=None,
    kidnap=(),
    timeout=600.0,
    localise_within=120.0,
    following=PIONEER_FOLLOWING,
    avoidance=PIONEER_AVOIDANCE,
):
    """Let a robot perform a task (Sec. III; Fig. 7, 10, 12).

    Parameters
    ----------
    task : Task
        Anything with a `law` (SequencedLDS) and an `environment` (Environment). If it has several
        `ways` (tuple of SequencedLDS, the law first) and tells how often each was `shown` (tuple of
        int), the robot takes the one that fits its start and is free, the one shown most often of
        several, and changes to another that is free when it is blocked. The paper's kind, control
        "plain" without avoiding, has one way only: the law.
    robot : Unicycle, dollop.lab.Pioneer, or one of your own
        See the top of `dollop.robot.performing`. Where it stands is where it starts. It drives
        until the task is finished or given up.
    control : str
        "plain", the paper's kind, or "pursuit", the better one.
    avoid : bool
        Go round obstacles; the paper's law does not.
    background : OccupancyGrid, optional
        Walls and furniture. Without it only the environment's boxes are known.
    kidnap : sequence of (float, (3,) sequence)
        At which times in s the robot is put at which poses.
    timeout : float
        Give up after this time in s, and in any case after 10,000 s or a million control periods.
    localise_within : float
        Give up when the robot has not known where it is for this time in s. Until it knows, it
        turns on the spot, and moves off what it touches.
    following : Following
        Constants of the control law.
    avoidance : Avoidance
        How far the robot keeps off what stands there.

    Returns
    -------
    Run
        Up to where the task was finished or given up, or where the robot failed; it tells which.

    Raises
    ------
    ValueError
        For an unknown control law, a start, subgoal or kidnapping that is not finite, off the map
        or in an obstacle (a subgoal: if every way has such a one), a time-out that is not positive,
        a kidnapping before the start, no ways, or not as many as `shown` counts; for a task or
        robot that lacks something, and what is not of its kind.

    Examples
    --------
    Kidnapped on its way, the robot goes on to the subgoal all the same.

    >>> import numpy as np
    >>> from dollop import Demonstration, Environment, Task
    >>> walk = np.linspace([0.0, 0.0], [3.0, 1.0], 50)
    >>> task = Task.of(Demonstration(walk, Environment([[1.5, 2.0, 2.0, 2.5]])))
    >>> run = perform(task, Unicycle((0.0, 0.0, 0.3)), kidnap=[(3.0, (0.0, 2.0, 1.0))])
    >>> run.finished, run.collisions, bool(np.hypot(*(run.poses[-1, :2] - walk[-1])) < 0.3)
    (True, 0, True)
    """
    kidnap = sorted(checked_kidnappings(kidnap))
    check_robot(robot, kidnap)
    places = named_places(robot, kidnap)
    rules = timeout, localise_within, following, avoidance, [place for _, place in places]
    controller = Controller(task, robot, control, avoid, background, *rules)
    controller.known.check_free(places)
    kidnapped = []
    try:
        while not controller.over:
            if kidnap and controller.time > kidnap[0][0] - robot.period / 2:
                time, pose = kidnap.pop(0)
                robot.place(pose)
                kidnapped.append(time)
            try:
                pose = robot.pose
            except Exception as error:
                controller.give_up(_failed(controller, error))
                break
            try:
                command = controller.step(pose)
            except RobotError as error:
                controller.give_up(_failed(controller, error.__cause__))
                break
            try:
                robot.drive(*command)
            except Exception as error:
                controller.give_up(_failed(controller, error))
    finally:
        if not controller.over or controller.reason:  # nobody leaves a robot that may still drive
            with suppress(Exception):
                robot.drive(0.0, 0.0)
    return controller.run(kidnapped)


def _failed(controller, error):
    """How the robot failed, as the reason of a run."""
    what = shortened(f"{type(error).__name__}: {error}", 200)
    return f"the robot failed at {controller.time:.1f} s with {what}"


def check_robot(robot, kidnap):
    """Refuse what cannot perform a task, or be kidnapped if that is wanted; see the module's top.

    Raises
    ------
    ValueError
        With what is missing, or no number or flag.
    """
    check_has("robot", robot, "pose", "localised", "limits", "period", "drive")
    if kidnap:
        check_has("a robot to be kidnapped", robot, "place")
    checked_number("the robot's period", robot.period, *PERIODS)
    checked_flag("whether the robot is localised", robot.localised)
    if robot.localised or robot.pose is not None:  # one that is lost may have none
        checked_array("the robot's pose", robot.pose, 3, finite=False)
    check_has("the robot's limits", robot.limits, *Limits._fields)
    Limits(*(getattr(robot.limits, name) for name in Limits._fields))


def checked_kidnappings(kidnap):
    """Kidnappings as a list of (time in s, pose (3,) as a tuple).

    Raises
    ------
    ValueError
        For what is no pair of a time from the start on and a pose that is finite.
    """
    found = []
    for each in checked_records("kidnap", kidnap, object):
        pair = checked_records("a kidnapping", each, object)
        if len(pair) != 2:
            raise ValueError(f"a kidnapping must be a time and a pose, got {told(each)}")
        time, pose = pair
        check_positive("the time of a kidnapping", time, or_zero=True)
        pose = checked_positions(f"the pose of the kidnapping at {time:g} s", pose, 3)
        found.append((float(time), tuple(pose.tolist())))
    return found


def named_places(robot, kidnap):
    """The other places that a run needs, each with its name: start, kidnappings.

    Raises
    ------
    ValueError
        One that is not finite.
    """
    places = [("the start", robot.pose)] if robot.localised else []
    places += [(f"the pose of the kidnapping at {time:g} s", pose) for time, pose in kidnap]
    for name, place in places:
        checked_positions(name, place, 3)
    return places
