"""The supervisory control law: the direction of the LDS, and segments that hand over in order."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import figure_eight_task

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.lds import LDS, Statistics
from dollop.pose import wrapped
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.control import CONTROL_LAWS, bend_speeds
from dollop.robot.guidance import PIONEER_FOLLOWING, PIONEER_LIMITS, STEP, Guidance, Limits
from dollop.robot.performing import Unicycle
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def law():
    return figure_eight_task().law


def random_law(seed):
    """Two to four segments, each fitted to a random walk: nothing like what a person would do."""
    rng = np.random.default_rng(seed)
    count = rng.integers(2, 5)
    walks = [rng.normal(0, 0.4, (rng.integers(4, 30), 2)).cumsum(axis=0) for _ in range(count)]
    segments = []
    for walk in walks:
        there = walk - walk[-1] + rng.uniform(-2, 2, 2)
        segments.append(LDS.fit(there, retimed=bool(rng.random() < 0.5)))
    start, speeds = rng.uniform(-2, 2, 2), rng.uniform(0.1, 1.5, len(segments))
    return SequencedLDS(tuple(segments), start, speeds)


def straight_law(*goals, speed=0.3, start=(0.0, 0.0)):
    """One LDS per goal that heads straight for it from anywhere."""
    still = Statistics(np.eye(2), 0.9 * np.eye(2))
    segments = tuple(LDS(still, goal) for goal in goals)
    return SequencedLDS(segments, np.array(start), np.full(len(goals), speed))


def trap():
    """Obstacles: a U that is open to the left, 8 m by 6 m around it."""
    occupancy = np.zeros((120, 160))
    occupancy[30:90, 100:104] = occupancy[30:34, 40:104] = occupancy[86:90, 40:104] = 1
    return ObstacleMap.of(Environment([]), OccupancyGrid(occupancy, (0.0, 0.0), 0.05))


def drive(law, control, pose, limit=4000):
    """The segments in force until the law is done; None if it gives up or takes too long."""
    robot = Unicycle(pose)
    supervisor, active = CONTROL_LAWS[control](Guidance(law), law.speeds, robot), []
    while not supervisor.done:
        command = supervisor.command(*robot.pose)
        active.append(supervisor.active)
        if supervisor.hopeless or len(active) > limit:
            return None
        robot.drive(*command)
    return active


def test_wrap():
    """Angles come into (-pi, pi], values into their limits."""
    assert wrapped(np.pi) == np.pi and wrapped(-np.pi) == np.pi
    assert wrapped(7.0) == pytest.approx(7.0 - 2 * np.pi)


def test_direction_is_that_of_the_lds(law):
    """Without obstacles the direction is that of the step that the LDS would take."""
    guidance = Guidance(law)
    for k, segment in enumerate(law.segments):
        place = segment.goal + [1.0, -0.3]
        step = segment.step(place) - place
        assert guidance.direction(k, *place) == pytest.approx(tuple(step / np.linalg.norm(step)))


@given(seeds, st.floats(-5, 5), st.floats(-5, 5))
def test_remaining_falls_along_the_direction(seed, x, y):
    """A small step along the law lessens the Lyapunov measure, from anywhere."""
    guidance = Guidance(random_law(seed))
    here = guidance.remaining(0, x, y)
    ux, uy = guidance.direction(0, x, y)
    step = 1e-6 * here
    assert guidance.remaining(0, x + step * ux, y + step * uy) < here or here < 1e-6


@settings(max_examples=60)
@given(seeds, st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_no_start_and_no_sequence_makes_the_response_diverge(seed, start):
    """Whatever was fitted, the response stays within the bound of its Lyapunov functions."""
    law = random_law(seed)
    state, steps = np.array(start), 0
    for segment in law.segments:
        best = segment.lyapunov(state)
        while np.linalg.norm(state - segment.goal) > PIONEER_FOLLOWING.reach:
            state, steps = segment.step(state), steps + 1
            assert segment.lyapunov(state) <= best * (1 + 1e-9)
            best = segment.lyapunov(state)
            assert steps < 200_000


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_every_segment_hands_over_in_finite_time(control):
    """Whatever was fitted, from any pose, the robot gets through all segments in order."""
    rng = np.random.default_rng(0)
    for seed in range(40):
        law = random_law(seed)
        active = drive(law, control, (*rng.uniform(-4, 4, 2), rng.uniform(-np.pi, np.pi)))
        assert active is not None, seed
        assert (np.diff(active) >= 0).all() and active[-1] == len(law.segments) - 1


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_segments_hand_over_in_order_at_their_subgoals(law, control):
    """No segment is skipped, and each hands over near its subgoal."""
    robot = Unicycle((*law.start, 0.0))
    supervisor = CONTROL_LAWS[control](Guidance(law), law.speeds, robot)
    for k, goal in enumerate(law.subgoals):
        assert supervisor.active == k
        while supervisor.active == k and not supervisor.done:
            robot.drive(*supervisor.command(*robot.pose))
        assert np.hypot(*(robot.pose[:2] - goal)) < PIONEER_FOLLOWING.reach + 0.1
    assert supervisor.done


def test_kidnapping_keeps_the_segment(law):
    """Put elsewhere in the second segment, the robot goes on to the second subgoal."""
    robot = Unicycle((*law.start, 0.0))
    supervisor = CONTROL_LAWS["plain"](Guidance(law), law.speeds, robot)
    while supervisor.active == 0:
        robot.drive(*supervisor.command(*robot.pose))
    robot.place((*law.subgoals[3] + 0.5, 1.0))
    while supervisor.active == 1:
        robot.drive(*supervisor.command(*robot.pose))
    assert np.hypot(*(robot.pose[:2] - law.subgoals[1])) < PIONEER_FOLLOWING.reach + 0.06


def test_rolled_out_response_is_that_of_the_sequence(law):
    """The places that are pursued lie on the response of the sequenced LDS, to 2 cm."""
    places, segments = Guidance(law).way(0, *law.start)
    assert distance_to_polyline(np.array(places), law.response()).max() < 0.02
    assert sorted(set(segments)) == list(range(len(law.segments)))


def test_bend_speeds_on_a_straight_line():
    """Straight on, the speed is the demonstrated one."""
    places = np.column_stack([np.arange(40) * STEP, np.zeros(40)])
    assert bend_speeds(places, np.full(40, 0.5), PIONEER_LIMITS) == pytest.approx(np.full(40, 0.5))


def test_bend_speeds_on_a_circle():
    """On a circle the turning rate is four fifths of the limit."""
    angle = np.arange(100) * STEP / 0.4
    places = 0.4 * np.column_stack([np.cos(angle), np.sin(angle)])
    limits = Limits(2.0, 0.8, 0.5, 1.5)
    speeds = bend_speeds(places, np.full(100, 2.0), limits)[20:80]
    assert speeds == pytest.approx(np.full(60, 0.64 * 0.4), rel=0.01)


@given(seeds)
def test_bend_speeds_can_be_braked_for(seed):
    """Whatever the path, the speed falls no faster than the robot can brake."""
    rng = np.random.default_rng(seed)
    headings = rng.normal(0, 0.5, 60).cumsum()
    places = STEP * np.column_stack([np.cos(headings), np.sin(headings)]).cumsum(axis=0)
    speeds = bend_speeds(places, np.full(60, 0.5), PIONEER_LIMITS)
    assert (speeds <= 0.5 + 1e-12).all() and (speeds > 0).all()
    falls = speeds[:-1] ** 2 - speeds[1:] ** 2
    assert (falls <= 2 * PIONEER_LIMITS.acceleration * STEP + 1e-9).all()


@pytest.mark.parametrize("error", [-2.0, -1.21, -1.19, -0.2, 0.0, 0.2, 1.0, 1.19, 1.21, 2.0])
def test_commands_are_the_formulas(error):
    """Plain: s cos e and 3 e; pursuit: the circle through the point ahead; sharp: turn first."""
    pose = (1.0, 2.0, np.arctan2(2, 4) - error)
    commands = {
        name: kind(Guidance(straight_law((5, 4), start=pose[:2])), [0.3], Unicycle(pose)).command(*pose)
        for name, kind in CONTROL_LAWS.items()
    }
    turn = np.clip(3 * error, -0.8, 0.8)
    if abs(error) > 1.2:
        assert commands["plain"] == commands["pursuit"] == pytest.approx((0.0, turn))
    else:
        assert commands["plain"] == pytest.approx((0.3 * np.cos(error), turn))
        curvature = 2 * np.sin(error) / 0.35
        speed = min(0.3, 0.8 / max(abs(curvature), 1e-9))
        assert commands["pursuit"] == pytest.approx((speed, curvature * speed))


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
@pytest.mark.parametrize(("demonstrated", "driven"), [(0.01, 0.1), (0.3, 0.3), (2.0, 0.5)])
def test_speeds_are_brought_into_the_robots_range(control, demonstrated, driven):
    """Straight on, it drives as the user did, but not below 0.1 m/s nor above its limit."""
    pose = (0.0, 0.0, 0.0)
    guidance = Guidance(straight_law((5, 0)))
    supervisor = CONTROL_LAWS[control](guidance, [demonstrated], Unicycle(pose))
    assert supervisor.command(*pose) == pytest.approx((driven, 0.0))


def test_near_an_obstacle_it_can_still_brake():
    """The speed is the wanted one, or what the obstacle map allows there if that is less."""
    obstacles = ObstacleMap.of(Environment([[2.0, -3.0, 2.2, 3.0]]), places=[[5, 0]])
    guidance = Guidance(straight_law((5, 0)), obstacles)
    supervisor = CONTROL_LAWS["plain"](guidance, [0.5], Unicycle((0.0, 0.0, 0.0)))
    places = np.linspace(0, 2, 41)
    limits = np.array([obstacles.speed_limit(x, 0.0, 0.0, 0.5, 0.1) for x in places])
    supervisor.rules = replace(PIONEER_FOLLOWING, reach=0.01)
    safe = [supervisor.command(x, 0.0, 0.0)[0] for x in places]
    np.testing.assert_array_less(safe, np.minimum(limits, 0.5) + 1e-9)
    assert limits.max() > 0.6 and limits.min() == 0


def test_the_way_leads_out_of_a_trap_and_to_every_subgoal():
    """Where the response comes to a halt in a U, a detour takes its place, and skips nothing."""
    guidance = Guidance(straight_law((4, 3), (7, 3), (7, 5)), trap())
    places, segments = guidance.way(0, 1.0, 3.0)
    places, segments = np.array(places), np.array(segments)
    assert guidance.obstacles.edges(places).min() > 0
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < STEP + 1e-9
    assert list(guidance.detours) == [1] and sorted(set(segments.tolist())) == [0, 1, 2]
    for k, goal in enumerate(guidance.goals):
        assert np.hypot(*(places[segments == k][-1] - goal)) < 0.1


def test_the_way_ends_where_there_is_none():
    """Before a subgoal behind a wall it ends, and does not wander on for 100 m."""
    wall = np.zeros((120, 160))
    wall[:, 100:104] = 1
    obstacles = ObstacleMap.of(Environment([]), OccupancyGrid(wall, (0.0, 0.0), 0.05))
    places, segments = Guidance(straight_law((3, 3), (7, 3), (3, 1)), obstacles).way(0, 1.0, 3.0)
    assert set(segments) == {0} and len(places) < 60
    assert np.hypot(*np.subtract(places[-1], (3, 3))) < STEP + 1e-9


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_without_progress_it_slows_down_and_gives_up(control):
    """Held fast, the pace is halved every eight seconds; below a sixteenth it is hopeless."""
    pose = (0.0, 0.0, 0.0)
    guidance, paces = Guidance(straight_law((5, 0))), []
    supervisor = CONTROL_LAWS[control](guidance, [0.3], Unicycle(pose))
    while not supervisor.hopeless and len(paces) < 1000:
        supervisor.command(*pose)
        paces.append(supervisor.pace)
    halved = 0.1 * np.flatnonzero(np.diff(paces))
    assert sorted(set(paces)) == [1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1]
    np.testing.assert_allclose(np.diff(halved, prepend=0.0), 8.0, atol=0.25)


def test_first_a_detour_and_only_then_slower():
    """Among obstacles first the way is changed, then the pace; a new segment begins afresh."""
    guidance = Guidance(straight_law((7, 3), (7, 5)), trap())
    supervisor = CONTROL_LAWS["plain"](guidance, [0.3, 0.3], Unicycle((4, 3, 0)))
    supervisor.insist()
    assert supervisor.pace == 1.0 and list(supervisor.guidance.detours) == [0]
    supervisor.insist()
    assert supervisor.pace == 0.5
    supervisor.hand_over(1)
    assert (supervisor.active, supervisor.pace, supervisor.done) == (1, 1.0, False)


@pytest.mark.parametrize(("jump", "pace"), [(0.28, 0.5), (0.32, 1.0)])
def test_a_kidnapped_robot_begins_its_segment_afresh(jump, pace):
    """Farther than any robot drives in a period it was carried: full pace and no detour again."""
    guidance = Guidance(straight_law((7, 3)), trap())
    supervisor = CONTROL_LAWS["plain"](guidance, [0.3], Unicycle((4, 3, 0)))
    supervisor.command(4.0, 3.0, 0.0)
    supervisor.insist()
    supervisor.insist()
    supervisor.command(4.0 - jump, 3.0, 0.0)
    assert supervisor.pace == pace and (0 in supervisor.guidance.detours) == (pace < 1)


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_the_robot_waits_where_the_demonstrator_did(control):
    """Three seconds at the first subgoal: so long it stands there, and then goes on."""
    law = replace(straight_law((2, 0), (4, 0)), pauses=np.array([0.0, 3.0, 0.0]))
    robot, rows = Unicycle((0.0, 0.0, 0.0)), []
    supervisor = CONTROL_LAWS[control](Guidance(law), law.speeds, robot)
    while not supervisor.done:
        robot.drive(*supervisor.command(*robot.pose))
        rows.append((supervisor.active, robot.speed))
    active, speeds = np.array(rows).T
    assert 0.1 * np.count_nonzero(speeds[5:] == 0) == pytest.approx(3.0, abs=0.8)
    assert set(active[speeds == 0]) == {1} and not supervisor.hopeless


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_the_robot_drives_at_the_speed_shown_there(control):
    """Slow in the first half and fast in the second, within what the robot can."""
    profile = np.array([[0.2, 0.2, 0.4, 0.4]])
    law = replace(straight_law((4, 0)), profile=profile, speeds=np.array([0.8 / 3]))
    for x, speed in ((0.5, 0.2), (3.0, 0.4)):
        supervisor = CONTROL_LAWS[control](Guidance(law), law.speeds, Unicycle((x, 0.0, 0.0)))
        assert supervisor.command(x, 0.0, 0.0) == pytest.approx((speed, 0.0), abs=1e-6)


def test_pursuit_comes_back_to_the_shown_way(law):
    """Put half a metre aside, it is back within 5 cm after two metres, and stays there."""
    shown = law.response()
    k = len(shown) // 3
    across = (shown[k + 1] - shown[k - 1]) @ [[0, 1], [-1, 0]]
    place = shown[k] + 0.5 * across / np.hypot(*across)
    segment = int(np.searchsorted(np.cumsum([len(part) for part in law.responses()]), k, side="right"))
    back = np.array(Guidance(law).way(segment, *place)[0])
    assert distance_to_polyline(back[40:], shown).max() < 0.05
