"""Performing: the robots' limits, runs that finish or say why not, kidnappings, and bad input."""

import weakref
from inspect import ismodule
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from places import DATA
from rooms import CANS, figure_eight_task, free_poses, room_map

from dollop import Demonstration, Task, robot
from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot import avoidance, controller
from dollop.robot.avoidance import PIONEER_AVOIDANCE, ObstacleMap
from dollop.robot.controller import Search
from dollop.robot.guidance import PIONEER_LIMITS, Limits
from dollop.robot.performing import Unicycle, perform
from dollop.trajectory import distance_to_polyline

START = (4.5, 3.6, -0.7)


def distances_to(law, run):
    """Distance in m of a run's true places to the response from where it started."""
    places = run.true_poses[:, :2]
    return distance_to_polyline(places, law.response(places[0]))


@pytest.fixture(scope="module")
def background():
    return room_map()


@pytest.fixture(scope="module")
def task():
    return figure_eight_task()


@pytest.fixture(scope="module")
def kidnappings(task, background):
    """Fifty, anywhere free at any time."""
    obstacles = ObstacleMap.of(task.environment, background)
    poses = free_poses(50, obstacles, task.law.subgoals[0], seed=1)
    return list(zip(np.random.default_rng(2).uniform(1, 33, 50), poses, strict=True))


class Recorded(Unicycle):
    """Remembers its commands; astray, lost or touching something at the periods it is told."""

    def __init__(self, pose, astray=(0.0, 0.0), lost=(), felt=None):
        self.commands, self.astray, self.lost, self.felt = [], astray, lost, felt
        super().__init__(pose)

    def drive(self, speed, turn):
        self.commands.append((speed, turn))
        super().drive(speed, turn)

    @property
    def true_pose(self):
        return self.pose[0] + self.astray[0], self.pose[1] + self.astray[1], self.pose[2]

    @property
    def localised(self):
        return len(self.commands) not in self.lost

    @property
    def touching(self):
        return None if self.felt is None else len(self.commands) in self.felt


class Stuck(Unicycle):
    """Has its wheels in the air."""

    def drive(self, speed, turn):
        pass


class Dreamer(Unicycle):
    """Loses its pose after two seconds."""

    periods = 0

    def drive(self, speed, turn):
        super().drive(speed, turn)
        self.periods += 1
        if self.periods == 20:
            self.pose = (np.nan, *self.pose[1:])


def test_the_wing_has_one_door_that_hides_no_module():
    """What a user needs of a robot comes from dollop.robot, where modules stay modules."""
    assert all(hasattr(robot, name) for name in robot.__all__)
    assert robot.perform is perform and robot.Unicycle is Unicycle
    assert all(ismodule(module) for module in (robot.avoidance, robot.control, robot.performing))


def test_unicycle_keeps_its_limits():
    """Whatever is commanded, speeds and accelerations stay within the limits."""
    robot, rng = Unicycle((0.0, 0.0, 0.0)), np.random.default_rng(0)
    before = robot.speed, robot.turn
    for _ in range(300):
        robot.drive(*rng.normal(0, 3, 2))
        assert abs(robot.speed) <= 0.5 and abs(robot.turn) <= 0.8
        assert abs(robot.speed - before[0]) <= 0.05 + 1e-12
        assert abs(robot.turn - before[1]) <= 0.157 + 1e-12
        before = robot.speed, robot.turn


def test_unicycle_drives_circles():
    """At constant v and omega it comes back after 2 pi / omega on a circle of radius v / omega."""
    robot = Unicycle((0.0, 0.0, 0.0), Limits(1.0, 1.0, 1e3, 1e3), period=2 * np.pi / 100)
    ys = []
    for _ in range(100):
        robot.drive(0.5, 1.0)
        ys.append(robot.pose[1])
    assert robot.pose == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert max(ys) == pytest.approx(1.0, abs=1e-3)


def test_run_has_the_shapes_it_says(task, background):
    """Every record has one row per control period, and the run is over when it is finished."""
    run = perform(task, Unicycle(START), background=background)
    n = len(run.t)
    assert run.finished and run.reason == "" and run.collisions == 0
    assert run.poses.shape == run.true_poses.shape == (n, 3)
    assert run.active.shape == run.localised.shape == run.clearance.shape == (n,)
    assert np.diff(run.t) == pytest.approx(np.full(n - 1, 0.1))
    with pytest.raises(AttributeError):
        run.finished = False


def test_runs_are_repeatable(task, background):
    """The same robot performs the same run."""
    first, second = (perform(task, Unicycle(START), background=background) for _ in range(2))
    assert (first.poses == second.poses).all()


@pytest.mark.parametrize(("control", "bound"), [("plain", 0.080), ("pursuit", 0.040)])
def test_distance_to_the_law(task, background, control, bound):
    """The mean distance to the response is at most 80 mm, and 40 mm when it is pursued."""
    starts = np.array(START) + np.random.default_rng(0).normal(0, 0.15, (10, 3))
    runs = [perform(task, Unicycle(start), control, background=background) for start in starts]
    assert all(run.finished and run.collisions == 0 for run in runs)
    assert np.mean([distances_to(task.law, run).mean() for run in runs]) <= bound


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_avoidance_leaves_a_free_run_as_it_is(task, control):
    """Where nothing is near, the run with avoidance is the run without."""
    runs = [perform(task, Unicycle(START), control, avoid) for avoid in (False, True)]
    assert runs[0].clearance.min() > PIONEER_AVOIDANCE.influence
    assert (runs[0].poses == runs[1].poses).all()


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_kidnapped_anywhere_it_finishes_without_collision(task, background, kidnappings, control):
    """Fifty kidnappings anywhere free: all runs finish, and none touches anything."""
    for kidnapping in kidnappings:
        run = perform(task, Unicycle(START), control, background=background, kidnap=[kidnapping])
        assert run.finished, (kidnapping, run.reason)
        assert run.collisions == 0 and run.clearance.min() > 0


def test_without_avoidance_it_finishes_and_some_runs_hit(task, background, kidnappings):
    """The paper's law gets there through what stands in its way: no hit was a coincidence."""
    runs = [perform(task, Unicycle(START), "plain", False, background, [k]) for k in kidnappings]
    assert all(run.finished for run in runs)
    assert 0 < sum(run.collisions > 0 for run in runs) < 50


def test_collisions_are_counted_once_each(task):
    """Crossing a box on the way counts as one collision, however long it lasts."""
    law = task.law
    box = np.concatenate([law.subgoals[0] - 0.3, law.subgoals[0] - 0.1])
    there = SimpleNamespace(law=law, environment=Environment([box]))
    run = perform(there, Unicycle(START), "plain", avoid=False)
    assert run.finished and run.collisions == 1 and run.clearance.min() < 0


def test_it_goes_round_what_stands_on_its_way(task):
    """A box on the middle of a segment is gone round, and the segments hand over as before."""
    middle = np.array([5.8, 2.8])
    assert distance_to_polyline(middle[None], task.law.response()) < 0.1
    environment = Environment(np.vstack([CANS, [*(middle - 0.15), *(middle + 0.15)]]))
    for control in ("plain", "pursuit"):
        there = SimpleNamespace(law=task.law, environment=environment)
        run = perform(there, Unicycle(START), control)
        assert run.finished and run.collisions == 0
        handed_over = run.poses[1:][np.diff(run.active) > 0, :2]
        assert np.hypot(*(handed_over - task.law.subgoals[:-1]).T).max() < 0.4


def test_it_comes_out_of_a_trap(task, background):
    """Kidnapped into a niche between two boxes against the wall, it takes the way out."""
    niche = np.array([[2.0, 6.3, 4.0, 7.0], [4.9, 5.2, 5.1, 7.0], [3.2, 5.2, 4.1, 5.4]])
    there = SimpleNamespace(law=task.law, environment=Environment(np.vstack([CANS, niche])))
    for control in ("plain", "pursuit"):
        kidnap = [(5.0, (4.5, 6.4, 1.0))]
        run = perform(there, Unicycle(START), control, background=background, kidnap=kidnap)
        assert run.finished and run.collisions == 0, (control, run.reason)


def test_a_stuck_robot_gives_up(task, background):
    """A robot that does not move gives up and says at which subgoal."""
    for control in ("plain", "pursuit"):
        run = perform(task, Stuck(START), control, background=background)
        assert not run.finished and "no progress towards subgoal 1" in run.reason
        assert run.t[-1] < 120


def test_a_walled_subgoal_is_given_up(task, background):
    """A subgoal behind a wall cannot be reached: the robot says so, and hits nothing."""
    wall = Environment([[5.4, 0.0, 5.6, 7.0]])
    for control in ("plain", "pursuit"):
        there = SimpleNamespace(law=task.law, environment=wall)
        run = perform(there, Unicycle(START), control, background=background)
        assert not run.finished and run.collisions == 0 and len(run.t) == 1
        assert run.reason.startswith("there is no way to subgoal 1 for a robot of 0.25 m radius") and run.done < 0.3


def test_time_is_limited(task):
    """What takes longer than the time-out is not finished, and says so."""
    run = perform(task, Unicycle(START), timeout=5.0)
    assert not run.finished and run.reason == "not finished within 5 s"
    assert run.t[-1] == pytest.approx(5.0)


def test_until_it_knows_where_it_is_it_looks_round(task):
    """It turns on the spot; what counts is how long it has been lost at a stretch."""
    lost = [*range(0, 80), *range(81, 160)]
    robot = Recorded(START, lost=lost)
    run = perform(task, robot, localise_within=10.0)
    assert run.finished and not run.localised[lost].any()
    assert run.localised[80] and run.localised[160:].all()
    commands = np.array(robot.commands)
    assert (commands[5:79] == (0.0, 0.5)).all() and (commands[100:159] == (0.0, 0.5)).all()
    assert robot.commands[-1] == (0.0, 0.0) and len(robot.commands) == len(run.t)


def test_a_robot_that_never_knows_where_it_is_gives_up(task):
    """Having turned on the spot for the time it is given, it is told to stop where it was."""
    robot = Recorded(START, lost=range(1000))
    run = perform(task, robot, localise_within=10.0)
    assert not run.finished and run.reason == "the robot has not known where it is for 10 s"
    assert run.t[-1] == pytest.approx(10.0) and not run.localised.any()
    assert set(robot.commands[4:-2]) == {(0.0, 0.5)} and robot.commands[-1] == (0.0, 0.0)
    assert run.true_poses[:, :2] == pytest.approx(np.tile(START[:2], (len(run.t), 1)))


def test_what_happened_is_told_from_the_true_pose(task):
    """Of a robot that is 0.4 m astray, clearance is that of the truth."""
    run = perform(task, Recorded(START, astray=(0.3, -0.4)), control="plain", avoid=False)
    places = run.true_poses[:, :2]
    off = places - run.poses[:, :2]
    np.testing.assert_allclose(off, np.tile([0.3, -0.4], (len(off), 1)))
    away = np.maximum(CANS[:, :2] - places[:, None], places[:, None] - CANS[:, 2:]).clip(0)
    clearance = np.hypot(*away.T).min(axis=0) - 0.25
    np.testing.assert_allclose(run.clearance, clearance, atol=0.06)


def test_collisions_are_what_is_felt(task):
    """Touching from period 5 to 8 and again at 12 is two collisions, however near things are."""
    assert perform(task, Recorded(START, felt=(5, 6, 7, 8, 12))).collisions == 2
    assert perform(task, Recorded(START, felt=())).collisions == 0


def test_it_is_kidnapped_when_and_where_it_is_told(task):
    """Whatever the order of the schedule, at 3 s and 6 s the robot is at those poses."""
    kidnap = [(6.0, (2.0, 2.0, 1.0)), (3.0, (5.0, 5.5, -1.0))]
    run = perform(task, Unicycle(START), kidnap=kidnap)
    np.testing.assert_allclose(run.poses[[30, 60]], [kidnap[1][1], kidnap[0][1]])
    assert run.kidnapped.tolist() == [3.0, 6.0]
    assert (np.hypot(*np.diff(run.poses[:, :2], axis=0).T) > 0.06).sum() == 2


def test_a_pose_that_is_lost_ends_the_run(task):
    """A pose that is not a number ends the run with a reason, and the robot is told to stop."""
    run = perform(task, Dreamer(START))
    assert not run.finished and "pose must be finite" in run.reason
    assert run.t[-1] == pytest.approx(2.0)


def test_only_kidnappings_that_happened_are_told(task):
    """A kidnapping after the end of the run is none."""
    run = perform(task, Unicycle(START), kidnap=[(8.0, (4.5, 5.8, 0.0)), (1e9, (4.5, 5.8, 0.0))])
    assert run.finished and run.kidnapped == pytest.approx([8.0])


class Own:
    """A robot with nothing but what `perform` needs: it does at once what it is told."""

    localised, limits, period = True, PIONEER_LIMITS, 0.1

    def __init__(self, pose):
        self.pose = pose

    def drive(self, speed, turn):
        """Move for one period."""
        x, y, theta = self.pose
        step = speed * self.period
        self.pose = x + step * np.cos(theta), y + step * np.sin(theta), theta + turn * self.period


def test_a_robot_of_ones_own_performs(task):
    """Pose, localised, limits, period and drive are enough; what it believes is all there is."""
    run = perform(task, Own(START))
    assert run.finished
    np.testing.assert_array_equal(run.poses, run.true_poses)


class Scraping(Own):
    """It touches something and is lost, until it has backed off by 5 cm."""

    localised = False

    @property
    def touching(self):
        """Whether it is still near what it hit."""
        self.localised = self.localised or self.pose[0] < START[0] - 0.05
        return not self.localised


def test_a_lost_robot_backs_away_from_what_it_touches(task):
    """It does not turn on the spot against an obstacle: straight back first."""
    run = perform(task, Scraping((*START[:2], 0.0)))
    assert run.finished and run.collisions == 1
    lost = ~run.localised
    assert lost[:5].all() and np.ptp(run.poses[lost, 2]) == 0


def test_a_lost_robot_tries_the_other_way():
    """Backing off that does not help turns into going forth; after contact it goes on for 1 s."""
    search = Search(0.1)
    pressed = [search.command(True)[0] for _ in range(50)]
    assert pressed[:18] == [-0.1] * 18 and pressed[22:38] == [0.1] * 16
    freed = [search.command(False) for _ in range(12)]
    assert [v for v, _ in freed[:10]] == [pressed[-1]] * 10 and freed[-1] == (0.0, 0.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"control": "fancy"}, "control must be one of .*'fancy'"),
        ({"timeout": 0.0}, "timeout must be in 1e-06 to inf, got 0.0"),
        ({"kidnap": [(3.0, (3.0, 6.6, 0.0))]}, "kidnapping at 3 s must be free"),
        ({"kidnap": [(3.0, (np.nan, 2.0, 0.0))]}, "kidnapping at 3 s must be finite"),
        ({"kidnap": [(3.0, (20.0, 2.0, 0.0))]}, "kidnapping at 3 s must lie in the lab"),
        ({"kidnap": [(np.nan, (3.0, 2.0, 0.0))]}, "kidnapping must be finite and not .*, got nan"),
        ({"kidnap": [(-1.0, (3.0, 2.0, 0.0))]}, "kidnapping must be .* not negative, got -1"),
        ({"robot": Unicycle((7.5, 0.3, 0.0))}, "the start must be free"),
        ({"robot": Own((4.0, np.nan, 0.0))}, "the start must be finite"),
        ({"robot": Unicycle((4.0, -5.0, 0.0))}, "the start must lie in the lab"),
    ],
)
def test_bad_input(task, background, change, message):
    """What cannot be performed is refused, naming the value and the rule."""
    arguments = {"robot": Unicycle(START), "background": background} | change
    with pytest.raises(ValueError, match=message):
        perform(task, **arguments)


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ((7.5, 0.3), "subgoal 2 must be free"),
        ((2.5, 3.6), "subgoal 2 must be free"),
        ((12.0, 3.0), "subgoal 2 must lie"),
    ],
)
def test_subgoals_must_be_free(task, background, place, message):
    """A subgoal outside the lab, in the furniture or in an object is refused."""
    subgoals = task.law.subgoals.copy()
    subgoals[1] = place
    moved = SimpleNamespace(law=task.law.with_subgoals(subgoals), environment=task.environment)
    with pytest.raises(ValueError, match=message):
        perform(moved, Unicycle(START), background=background)


def test_inputs_are_not_changed(task, background):
    """Performing leaves law, map, environment and schedule as they were."""
    subgoals, occupancy = task.law.subgoals.copy(), background.occupancy.copy()
    kidnap = [(3.0, (2.0, 2.0, 0.0))]
    perform(task, Unicycle(START), background=background, kidnap=kidnap)
    assert (task.law.subgoals == subgoals).all() and (background.occupancy == occupancy).all()
    assert (task.environment.boxes == CANS).all() and kidnap == [(3.0, (2.0, 2.0, 0.0))]


@pytest.mark.parametrize("control", ["plain", "pursuit"])
@pytest.mark.parametrize(
    "place",
    [(7.31, 0.55, -0.79), (7.19, 0.57, -2.81), (7.49, 0.5, 1.15), (7.25, 0.68, 1.61)],
)
def test_the_way_out_of_a_niche_is_found(task, control, place):
    """Put between desks and a stool, with 8 cm to spare, it gets out and touches nothing."""
    lab = OccupancyGrid.load(DATA / "lab.yaml")
    run = perform(task, Unicycle(START), control, background=lab, kidnap=[(28.0, place)])
    assert run.finished and not run.collisions


def test_a_robot_whose_time_hardly_passes_is_given_up(task, monkeypatch):
    """Whatever the time-out, there is a last control period."""
    monkeypatch.setattr(controller, "MOST_PERIODS", 50)
    robot = Stuck(START)
    robot.period = 1e-3
    run = perform(task, robot, timeout=np.inf)
    assert run.reason == "not finished within 50 periods of 0.001 s" and len(run.t) == 51


def test_half_a_kilometre_without_a_map(monkeypatch):
    """Legs of 125 m each, an object on the first: larger cells, and nothing is touched."""
    monkeypatch.setattr(avoidance, "MOST_CELLS", 300_000)
    corners = np.array([[0, 0], [125, 0], [125, 125], [0, 125], [0, 3.0]])
    walk = np.vstack([np.linspace(a, b, 1250, endpoint=False) for a, b in pairwise(corners)])
    task = Task.of(Demonstration(walk, Environment([[60.0, -0.4, 60.5, 0.2], [122.0, 60.0, 122.5, 60.5]])))
    run = perform(task, Unicycle((0.0, 0.0, 0.3)), timeout=1500)
    assert run.finished and run.collisions == 0 and run.clearance.min() > 0
    away = np.maximum(np.abs(run.poses[:, :2] - [60.25, -0.1]) - [0.25, 0.3], 0)
    assert np.hypot(*away.T).min() > 0.25
    assert np.hypot(*(run.poses[-1, :2] - walk[-1])) < 0.3


def test_a_world_of_many_kilometres_is_refused(task):
    """Not performed on for ever, and not on a map of a terabyte: the error says how large it may be."""
    with pytest.raises(ValueError, match="must hold all places and objects, got 1e"):
        perform(task, Unicycle((1e6, 1e6, 0.0)))


def test_clearance_is_that_of_each_periods_map():
    """A map that is no longer in force is not kept."""
    clearance, near = controller.Clearance(), ObstacleMap.of(Environment([[0, 0, 1, 1]]))
    gone = weakref.ref(near)
    expected = [near.edge(1.5, 0.5), near.edge(2.0, 0.5)]
    clearance.add(1.5, 0.5, near)
    clearance.add(2.0, 0.5, near)
    del near
    empty = ObstacleMap.of(Environment([]))
    clearance.add(2.0, 0.5, empty)
    assert clearance.all() == pytest.approx([*expected, empty.edge(2.0, 0.5)], abs=1e-4) and gone() is None


class Unseen(Unicycle):
    """A robot that nobody sees for a while: its own pose goes on, the measured one is NaN."""

    @property
    def true_pose(self):
        return (np.nan,) * 3 if self.pose[0] < 4.0 else self.pose


def test_a_run_that_was_not_seen_all_the_time_is_kept(task):
    """Where nobody knew the pose its clearance is NaN too, and the run is what it was."""
    run = perform(task, Unseen(START))
    unknown = np.isnan(run.true_poses[:, 0])
    assert run.finished and 0 < unknown.sum() < len(run.t) / 2
    np.testing.assert_array_equal(np.isnan(run.clearance), unknown)
