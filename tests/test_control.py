"""The supervisory control law: the direction of the LDS, handing over in order and in finite time, for real robots."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import figure_eight_task

from dollop.control import CONTROL_LAWS, PIONEER_LIMITS, REACH, STEP, Guidance, Limits, bend_speeds, clip, wrap
from dollop.execution import Unicycle
from dollop.lds import LDS
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline

seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def law():
    return figure_eight_task().law


def random_law(seed):
    """Two to four segments, each fitted to a random walk: nothing like what a person would do."""
    rng = np.random.default_rng(seed)
    walks = [rng.normal(0, 0.4, (rng.integers(4, 30), 2)).cumsum(axis=0) for _ in range(rng.integers(2, 5))]
    segments = [LDS.fit(walk - walk[-1] + rng.uniform(-2, 2, 2), retimed=bool(rng.random() < 0.5)) for walk in walks]
    return SequencedLDS(tuple(segments), rng.uniform(-2, 2, 2), rng.uniform(0.1, 1.5, len(segments)))


def drive(law, control, pose, limit=4000):
    """Periods until the law is done, and the segments in force; None if it gives up or takes too long."""
    robot = Unicycle(pose)
    supervisor, active = CONTROL_LAWS[control](Guidance(law), law.speeds, robot), []
    while not supervisor.done:
        command = supervisor.command(*robot.pose)
        active.append(supervisor.active)
        if supervisor.hopeless or len(active) > limit:
            return None
        robot.drive(*command)
    return active


def test_wrap_and_clip():
    """Angles come into (-pi, pi], values into their limits."""
    assert wrap(np.pi) == np.pi and wrap(-np.pi) == np.pi
    assert wrap(7.0) == pytest.approx(7.0 - 2 * np.pi)
    assert (clip(3.0, 2.0), clip(-3.0, 2.0), clip(1.0, 2.0)) == (2.0, -2.0, 1.0)


def test_direction_is_that_of_the_lds(law):
    """Without obstacles the direction is that of the step that the LDS would take."""
    guidance = Guidance(law)
    for k, segment in enumerate(law.segments):
        place = segment.goal + [1.0, -0.3]
        step = segment.step(place) - place
        assert guidance.direction(k, *place) == pytest.approx(tuple(step / np.linalg.norm(step)))


@given(seeds, st.floats(-5, 5), st.floats(-5, 5))
def test_remaining_falls_along_the_direction(seed, x, y):
    """A small step along the law lessens the Lyapunov measure, for any fitted segment and from anywhere."""
    guidance = Guidance(random_law(seed))
    here = guidance.remaining(0, x, y)
    ux, uy = guidance.direction(0, x, y)
    step = 1e-6 * here
    assert guidance.remaining(0, x + step * ux, y + step * uy) < here or here < 1e-6


@settings(max_examples=60)
@given(seeds, st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_no_start_and_no_sequence_makes_the_response_diverge(seed, start):
    """Whatever was fitted and wherever it starts, the response stays within the bound of its Lyapunov functions."""
    law = random_law(seed)
    state, steps = np.array(start), 0
    for segment in law.segments:
        best = segment.lyapunov(state)
        while np.linalg.norm(state - segment.goal) > REACH:
            state, steps = segment.step(state), steps + 1
            assert segment.lyapunov(state) <= best * (1 + 1e-9)
            best = segment.lyapunov(state)
            assert steps < 200_000


@pytest.mark.parametrize("control", sorted(CONTROL_LAWS))
def test_every_segment_hands_over_in_finite_time(control):
    """Whatever was fitted, from any pose: the robot, with its limits, gets through all segments in order."""
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
        assert np.hypot(*(robot.pose[:2] - goal)) < REACH + 0.1
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
    assert np.hypot(*(robot.pose[:2] - law.subgoals[1])) < REACH + 0.06


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
    assert bend_speeds(places, np.full(100, 2.0), limits)[20:80] == pytest.approx(np.full(60, 0.64 * 0.4), rel=0.01)


@given(seeds)
def test_bend_speeds_can_be_braked_for(seed):
    """Whatever the path, the speed never falls faster than the robot can brake, nor exceeds the demonstrated one."""
    rng = np.random.default_rng(seed)
    headings = rng.normal(0, 0.5, 60).cumsum()
    places = STEP * np.column_stack([np.cos(headings), np.sin(headings)]).cumsum(axis=0)
    speeds = bend_speeds(places, np.full(60, 0.5), PIONEER_LIMITS)
    assert (speeds <= 0.5 + 1e-12).all() and (speeds > 0).all()
    assert (speeds[:-1] ** 2 - speeds[1:] ** 2 <= 2 * PIONEER_LIMITS.acceleration * STEP + 1e-9).all()
