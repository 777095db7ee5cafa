"""A controller for a loop of one's own: the same as performing, within the limits, for a robot of any size."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rooms import figure_eight_task, room_map

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot import Avoidance, Controller, Following, Limits, Unicycle, perform
from dollop.robot.avoidance import ObstacleMap
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import resample

START = (4.5, 3.6, -0.7)
GAP = [[2.9, -6.0, 3.1, -0.45], [2.9, 0.45, 3.1, 6.0]]
HALL = OccupancyGrid(np.zeros((160, 160)), (-1.0, -4.0), 0.05)


def walk(*points, pauses=None):
    """A task along straight lines through points, with pauses at the start and subgoals, among boxes."""
    law = SequencedLDS.fit(resample(points, 150), tolerance=0.05)
    return law if pauses is None else replace(law, pauses=np.array(pauses, float))


def task(law, *boxes):
    return SimpleNamespace(law=law, environment=Environment(boxes))


class Recorded(Unicycle):
    """Remembers what it was asked for."""

    def __init__(self, *arguments, **known):
        self.commands = []
        super().__init__(*arguments, **known)

    def drive(self, speed, turn):
        self.commands.append((speed, turn))
        super().drive(speed, turn)


class Waking(Recorded):
    """Does not know where it is for three seconds."""

    @property
    def localised(self):
        return len(self.commands) >= 30


@pytest.fixture(scope="module")
def background():
    return room_map()


@pytest.mark.parametrize("make", [Recorded, Waking])
@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_a_loop_of_ones_own_asks_for_the_same_to_the_last_digit(background, control, make):
    """Kidnapped on the way, lost at the beginning: perform is the controller in a loop."""
    eight, kidnap = figure_eight_task(), (5.0, (5.0, 5.5, -1.0))
    robot = make(START)
    run = perform(eight, robot, control, background=background, kidnap=[kidnap])
    own = make(START)
    controller = Controller(eight, own, control, background=background, places=[kidnap[1]])
    while not controller.over:
        if len(own.commands) == 50:
            own.place(kidnap[1])
        own.drive(*controller.step(own.pose))
    assert run.finished and own.commands == robot.commands
    assert controller.run([5.0]).verdict == run.verdict
    assert controller.step(own.pose) == (0.0, 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_it_never_asks_for_more_than_the_limits(background, seed):
    """Neither for speeds nor, from period to period, for accelerations; and the robot stands at the end."""
    rng = np.random.default_rng(seed)
    limits = Limits(*rng.uniform([0.2, 0.5, 0.2, 0.5], [1.0, 2.0, 2.0, 4.0]))
    robot = Recorded(START, limits, float(rng.choice([0.02, 0.05, 0.2])), radius=0.2)
    run = perform(figure_eight_task(), robot, background=background)
    speeds = np.array([(0.0, 0.0), *robot.commands])
    assert run.finished and robot.commands[-1] == (0.0, 0.0) and robot.speed == 0.0
    assert (np.abs(speeds) <= limits[:2]).all()
    most = np.array(limits[2:]) * robot.period
    assert (np.abs(np.diff(speeds, axis=0)) <= most + 1e-9).all()


def test_a_lost_robot_turns_on_the_spot_and_gives_up():
    """None as a pose means that the robot does not know where it is."""
    robot = SimpleNamespace(limits=Limits(0.5, 0.8, 0.5, 1.57), period=0.1, radius=0.25)
    controller = Controller(task(walk((0, 0), (3, 0))), robot, localise_within=5.0)
    asked = [controller.step(None) for _ in range(60)]
    assert asked[20] == (0.0, 0.5) and asked[-1] == (0.0, 0.0)
    assert controller.over and controller.reason == "the robot has not known where it is for 5 s"
    assert not controller.run().finished


def test_waits_are_those_of_the_clock():
    """A loop that is late by a factor of two stands half as many steps."""
    law, stood = walk((0, 0), (2, 0), (2, 2), pauses=[0, 4, 0]), []
    assert len(law.segments) == 2
    for late in (1, 2):
        robot = Recorded((0.0, 0.0, 0.0))
        controller = Controller(task(law), robot)
        while not controller.over:
            robot.drive(*controller.step(robot.pose, elapsed=late * robot.period))
        run = controller.run()
        assert run.finished and run.waits[0, 2] == pytest.approx(4.0, abs=0.2)
        stood.append(np.count_nonzero(np.array(robot.commands)[5:-3, 0] == 0.0))
    assert stood[0] == pytest.approx(2 * stood[1], abs=5)


def test_a_pose_that_leaps_at_every_step_is_told():
    """Kidnapped again and again, or broken: it says so after the time-out, and does not go on for ever."""
    robot, rng = Recorded((0.0, 0.0, 0.0)), np.random.default_rng(0)
    controller = Controller(task(walk((0, 0), (3, 0))), robot, localise_within=6.0)
    while not controller.over:
        controller.step((*rng.uniform(-2, 2, 2), 0.0))
    assert "the pose has leapt by more than 0.3 m" in controller.reason and "broken" in controller.reason
    assert 5.0 < controller.run().t[-1] < 30.0


class Failing(Unicycle):
    """Falls to pieces after a second."""

    periods = 0

    def drive(self, speed, turn):
        self.periods += 1
        if self.periods > 10:
            raise RuntimeError("a wheel came off")
        super().drive(speed, turn)


def test_a_robot_that_fails_leaves_the_run_so_far():
    """The reason tells when and how."""
    run = perform(task(walk((0, 0), (3, 0))), Failing((0.0, 0.0, 0.0)))
    assert not run.finished and len(run.t) == 11 and 0 < run.done < 0.3
    assert run.reason.startswith("the robot failed at 1.1 s with RuntimeError: a wheel came off")


def test_what_a_robot_lacks_is_named():
    """No AttributeError half-way."""
    with pytest.raises(ValueError, match="robot must have period and drive"):
        perform(task(walk((0, 0), (3, 0))), SimpleNamespace(pose=(0, 0, 0), localised=True, limits=Limits(1, 1, 1, 1)))
    with pytest.raises(ValueError, match="robot must have limits"):
        Controller(task(walk((0, 0), (3, 0))), SimpleNamespace(period=0.1, radius=0.2))


def test_a_robot_without_a_radius_is_taken_for_a_pioneer_and_it_is_said():
    """The note puts the run in doubt."""
    robot = Unicycle((0.0, 0.0, 0.0))
    del robot.radius
    run = perform(task(walk((0, 0), (3, 0))), robot)
    assert run.finished and not run.trusted and run.radius == 0.25
    assert [note.kind for note in run.notes] == ["radius"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": "wide"}, "radius must be a finite number, got 'wide'"),
        ({"radius": 0.0}, "radius must be in 0.001 to 100, got 0.0"),
        ({"radius": np.nan}, "radius must be a finite number .*, got nan"),
        ({"radius": 4.5}, "there must be room for the robot on the map, .* got a radius of 4.5 m"),
        ({"accuracy": -1.0}, "accuracy must be in 0 to 100"),
        ({"limits": SimpleNamespace(speed=0, turn=1, acceleration=1, turn_acceleration=1)}, "speed must be in 1e-06"),
        ({"period": 0.0}, "period must be in 0.001 to 10"),
    ],
)
def test_bad_robots(background, change, message):
    """The value and the rule are named."""
    robot = Unicycle(START)
    for name, value in change.items():
        setattr(robot, name, value)
    with pytest.raises(ValueError, match=message):
        Controller(figure_eight_task(), robot, background=background)


@pytest.mark.parametrize("pose", [(1.0, 2.0), "here", 3.0, (1.0, "x", 0.0)])
def test_a_pose_is_three_numbers(pose):
    """Or None."""
    with pytest.raises(ValueError, match="the pose must be three numbers or None, got"):
        Controller(task(walk((0, 0), (3, 0))), Unicycle((0.0, 0.0, 0.0))).step(pose)


@pytest.mark.parametrize(("radius", "fits"), [(0.2, True), (0.4, True), (0.415, True), (0.44, False), (0.6, False)])
@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_a_gap_lets_robots_through_that_fit(radius, fits, control):
    """Of 0.9 m: those of up to 0.42 m radius, touching nothing; for the others, that is the reason given."""
    law = walk((0, 0.1), (6, 0))
    run = perform(task(law, *GAP), Unicycle((0.0, 0.1, 0.3), radius=radius), control, background=HALL)
    assert run.finished == fits and run.collisions == 0 and run.radius == radius
    if fits:
        assert 0 < run.clearance.min() < 0.46 - radius
    else:
        assert "there is no way to subgoal" in run.reason and "the largest that gets there has 0.4" in run.reason


def test_what_a_robot_knows_badly_it_keeps_farther_off():
    """A robot that may be 5 cm off does not go where one that knows its pose does."""
    robot = Unicycle((0.0, 0.1, 0.3), radius=0.42)
    robot.accuracy = 0.05
    run = perform(task(walk((0, 0.1), (6, 0)), *GAP), robot, background=HALL)
    assert not run.finished and "keeps 0.07 m" in run.reason


def test_clearance_is_that_of_the_boxes():
    """To a centimetre, for a robot of any size, in a world without a map and in one of cells."""
    boxes = np.array([[2.03, 0.31, 2.44, 0.77], [3.61, -1.2, 3.64, -0.41]])
    for background in (None, OccupancyGrid(np.zeros((80, 140)), (-0.5, -2.0), 0.05)):
        run = perform(task(walk((0, 0), (5, 0)), *boxes), Unicycle((0.0, 0.0, 0.0), radius=0.13), background=background)
        places = run.poses[:, None, :2]
        away = np.maximum(np.maximum(boxes[:, :2] - places, places - boxes[:, 2:]), 0)
        exact = np.hypot(*np.moveaxis(away, -1, 0)).min(axis=1) - 0.13
        near = exact < 0.5
        assert run.finished and near.any()
        np.testing.assert_allclose(run.clearance[near], exact[near], atol=0.01)


def test_constants_are_handed_in():
    """Kept farther off, it drives a way with more room; looking less far ahead, nearer to the way."""
    law = walk((0, 0.1), (6, 0))
    near, far = (
        perform(task(law, [2.5, -0.6, 3.5, -0.35]), Unicycle((0.0, 0.1, 0.0)), avoidance=Avoidance(kept, kept + 0.4))
        for kept in (0.2, 0.5)
    )
    assert near.clearance.min() + 0.1 < far.clearance.min()
    corner = walk((0, 0), (3, 0), (3, 3))
    loose, close = (
        perform(task(corner), Unicycle((0.0, 0.0, 0.0)), following=Following(look_ahead=ahead)) for ahead in (0.6, 0.15)
    )
    assert close.farthest < loose.farthest


@pytest.mark.parametrize("rules", [{"following": 3}, {"avoidance": Following()}])
def test_constants_are_records(rules):
    """Of their own kind."""
    with pytest.raises(ValueError, match="must be an? (Following|Avoidance), got"):
        perform(task(walk((0, 0), (3, 0))), Unicycle((0.0, 0.0, 0.0)), **rules)


def test_a_slow_and_clumsy_robot_is_given_the_time_that_it_needs(background):
    """One that takes twenty seconds to turn round is not taken for one that makes no progress."""
    limits = Limits(0.1, 0.3, 0.05, 0.1)
    run = perform(figure_eight_task(), Unicycle((*START[:2], 2.4), limits), background=background)
    assert run.finished and run.collisions == 0


def test_room_is_looked_for_by_the_centimetre():
    """A gap six centimetres wider than the robot lies between the cells of the map, and is found between finer ones."""
    edges, radius = (0.48, -0.05), 0.235
    boxes = [[2.9, -6.0, 3.1, edges[1]], [2.9, edges[0], 3.1, 6.0]]
    coarse, fine = (ObstacleMap.of(Environment(boxes), HALL, radius=radius, finer=finer) for finer in (1, 3))
    assert coarse.no_way((0, 0.2), (6, 0.2), 0.25) and not fine.no_way((0, 0.2), (6, 0.2), 0.25)
    robot = Unicycle((0.0, 0.2, 0.0), radius=radius)
    run = perform(task(walk((0, 0.2), (6, 0.2)), *boxes), robot, background=HALL)
    assert run.finished and run.collisions == 0 and run.clearance.min() < 0.031
