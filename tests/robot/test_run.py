"""Whether a run was the task: share driven, subgoals reached, distance, waits, what has changed; and bad input."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from dollop.environment import Environment
from dollop.robot import Controller, Following, Limits, Run, Unicycle, perform
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline, resample

CORNER = SequencedLDS.fit(resample([(0, 0), (3, 0), (3, 3)], 150), tolerance=0.05)


def task(*boxes, pauses=None):
    law = CORNER if pauses is None else replace(CORNER, pauses=np.array(pauses, float))
    return SimpleNamespace(law=law, environment=Environment(boxes))


def test_the_law_has_two_segments():
    """What the other tests count on."""
    assert len(CORNER.segments) == 2


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_a_run_that_was_the_task_says_so(control):
    """All of the way, every subgoal, and how far it was from the way at most."""
    run = perform(task(), Unicycle((0.0, 0.0, 0.0)), control)
    apart = distance_to_polyline(run.poses[:, :2], np.vstack([line.places for line in CORNER.lines()]))
    assert run.finished and run.done == 1.0 and run.reached.all() and len(run.reached) == 2
    assert run.farthest == pytest.approx(apart.max(), abs=0.03) and run.trusted


def test_a_run_that_is_cut_short_says_how_far_it_came():
    """Its share of the way is what it drove, by length."""
    whole = perform(task(), Unicycle((0.0, 0.0, 0.0)))
    for share in (0.25, 0.4, 0.75):
        run = perform(task(), Unicycle((0.0, 0.0, 0.0)), timeout=share * whole.t[-1])
        driven = np.hypot(*np.diff(run.poses[:, :2], axis=0).T).sum()
        assert not run.finished and run.done == pytest.approx(driven / 6.0, abs=0.05)
        assert run.reached.tolist() == [share == 0.75, False]


def test_before_its_end_a_run_is_not_over():
    """What a loop of one's own asks for on the way."""
    robot = Unicycle((0.0, 0.0, 0.0))
    controller = Controller(task(), robot)
    with pytest.raises(ValueError, match="no step was taken"):
        controller.run()
    robot.drive(*controller.step(robot.pose))
    assert controller.run().reason == "it is not over yet" and controller.run().done < 0.05


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_waits_are_kept_where_and_as_the_demonstrator_looked(control):
    """Two seconds at the start, four at the corner, one at the end: it stands there, and looks along the way."""
    run = perform(task(pauses=[2.0, 4.0, 1.0]), Unicycle((0.0, 0.1, 1.0)), control)
    assert run.finished and run.waits[:, 0].tolist() == [0, 1, 2]
    np.testing.assert_allclose(run.waits[:, 1:], [[2, 2], [4, 4], [1, 1]], atol=0.11)
    still = np.hypot(*np.diff(run.poses[:, :2], axis=0).T) < 1e-3
    near = np.hypot(*(run.poses[1:, :2] - CORNER.subgoals[0]).T) < 0.3
    assert 0.1 * np.count_nonzero(still & near) >= 3.9
    heading = np.median(run.poses[1:, 2][still & near])
    assert heading == pytest.approx(CORNER.headings[1], abs=0.15)


def test_carried_off_while_it_waits_it_comes_back_and_waits_on():
    """The rest of the wait belongs to the subgoal, not to the place where the robot was put."""
    run = perform(task(pauses=[0.0, 6.0, 0.0]), Unicycle((0.0, 0.0, 0.0)), kidnap=[(11.0, (1.0, 1.5, 2.0))])
    assert run.kidnapped.tolist() == [11.0] and run.finished
    assert run.waits[0].tolist() == pytest.approx([1, 6, 6], abs=0.2)
    near = np.hypot(*(run.poses[:, :2] - CORNER.subgoals[0]).T) < 0.3
    assert near[run.t < 11].any() and near[run.t > 12].any()


def test_what_kidnapping_spared_the_robot_is_told():
    """Put two metres farther along its segment, it goes on from there: two metres were not driven."""
    run = perform(task(), Unicycle((0.0, 0.0, 0.0)), kidnap=[(2.0, (2.6, 0.1, 0.0))])
    (note,) = run.notes
    assert run.finished and note.kind == "skipped" and not note.doubt
    assert float(note.text.split()[0]) == pytest.approx(2.6 - run.poses[19, 0], abs=0.15)


class Noticing(Unicycle):
    """Notices a box after three seconds."""

    now = 0.0

    def drive(self, speed, turn):
        self.now += self.period
        super().drive(speed, turn)

    @property
    def noticed(self):
        return Environment([[1.9, 0.3, 2.2, 0.6]] if self.now > 3 else [])


def test_what_has_changed_under_the_robot_is_told():
    """An object that the task's environment does not have puts the run in doubt: look and adapt."""
    run = perform(task(), Noticing((0.0, 0.0, 0.0)))
    assert run.finished and not run.trusted
    assert [note.kind for note in run.notes] == ["changed"] and "(2.05, 0.45)" in run.notes[0].text


class Feeling(Unicycle):
    """Bumps into something that nobody knows of."""

    @property
    def touching(self):
        return 1.0 < self.pose[0] < 1.1 and self.pose[1] < 0.5


def test_touching_what_is_not_known_is_told():
    """Where the map has room."""
    run = perform(task([1.0, 2.0, 1.2, 2.2]), Feeling((0.0, 0.0, 0.0)))
    assert run.collisions == 1 and [note.kind for note in run.notes] == ["unknown"]


class Dreaming(Unicycle):
    """Believes to be a metre farther along than it is."""

    @property
    def true_pose(self):
        x, y, theta = self.pose
        return x, y - 1.0, theta


def test_a_robot_that_believes_to_have_done_it_has_not():
    """Where it truly was decides."""
    run = perform(task(), Dreaming((0.0, 0.0, 0.0)))
    assert not run.finished and run.reason.startswith("subgoal 2 was not reached: ")
    assert run.reached.tolist() == [True, False]


def test_a_verdict_is_plain():
    """For JSON, also where nothing is known."""
    run = perform(task(pauses=[0, 1, 0]), Unicycle((0.0, 0.0, 0.0)), kidnap=[(2.0, (1.0, 1.0, 0.0))])
    told = json.loads(json.dumps(run.verdict))
    assert told["finished"] and told["subgoals"] == told["reached"] == 2 and told["kidnapped"] == [2.0]
    nothing = np.full((1, 3), np.nan)
    lost = Run([0.0], nothing, nothing, [0], [False], [np.nan], False, "lost", 0, [])
    assert json.loads(json.dumps(lost.verdict, allow_nan=False))["least_clearance"] is None
    assert "least clearance nan" in repr(lost)


def test_slow_brakes_end_at_the_last_subgoal():
    """A robot that brakes within two metres begins in time."""
    limits = Limits(0.9, 1.0, 0.2, 2.0)
    law = replace(CORNER, speeds=np.array([0.9, 0.9]))
    run = perform(SimpleNamespace(law=law, environment=Environment([])), Unicycle((0.0, 0.0, 0.0), limits))
    assert run.finished and np.hypot(*(run.poses[-1, :2] - law.subgoals[-1])) < 0.1


class Corrected(Unicycle):
    """Does not know where it is for a second, and then finds itself half a metre farther on."""

    periods = 0

    def drive(self, speed, turn):
        self.periods += 1
        super().drive(speed, turn)
        if self.periods == 40:
            x, y, theta = self.pose
            self.pose = x, y + 0.6, theta

    @property
    def localised(self):
        return not 30 <= self.periods < 40


def test_being_lost_and_leaping_is_told():
    """It is good to know, and no doubt."""
    run = perform(task(), Corrected((0.0, 0.0, 0.0)))
    assert run.finished and run.trusted and [note.kind for note in run.notes] == ["lost", "leap"]
    assert "for 1.0 s, first at 3.0 s" in run.notes[0].text and "leapt by 0.6" in run.notes[1].text


def test_a_way_that_is_closed_and_gone_round_puts_the_run_in_doubt():
    """It finishes, but two metres beside what was shown."""
    run = perform(task([1.0, -2.0, 1.3, 2.0]), Unicycle((0.0, 0.0, 0.0)))
    assert run.finished and run.farthest > 1.5 and not run.trusted
    assert [note.kind for note in run.notes] == ["aside"]


@pytest.mark.parametrize("control", ["plain", "pursuit"])
@pytest.mark.parametrize("before", [0.05, 0.15, 0.25, 0.45])
def test_carried_off_at_the_very_end_it_comes_back(control, before):
    """It has done the task when it stands at the end, not when the last segment hands over."""
    end = perform(task(), Unicycle((0.0, 0.0, 0.0)), control).t[-1]
    run = perform(task(), Unicycle((0.0, 0.0, 0.0)), control, kidnap=[(end - before, (0.5, 2.0, 1.0))])
    assert run.finished and np.hypot(*(run.poses[-1, :2] - CORNER.subgoals[-1])) < 0.3


class Trembling(Unicycle):
    """Notices something far off, a millimetre elsewhere in every period."""

    periods = 0

    def drive(self, speed, turn):
        self.periods += 1
        super().drive(speed, turn)

    @property
    def noticed(self):
        return Environment([[5.0, 5.0, 5.1 + 1e-3 * self.periods, 5.2]])


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_what_is_noticed_anew_in_every_period_keeps_nobody_from_the_task(control):
    """The map is another one each time, the segment and the patience are not."""
    run = perform(task(pauses=[0.0, 2.0, 0.0]), Trembling((0.0, 0.0, 0.0)), control, timeout=60.0)
    assert run.finished and run.waits[0, 2] == pytest.approx(2.0, abs=0.11)


class Held(Trembling):
    """Cannot move, and notices something else in every period."""

    def drive(self, speed, turn):
        self.periods += 1


def test_patience_ends_whatever_is_noticed():
    """A robot that is held fast gives up before the time-out."""
    robot = Held((0.0, 0.0, 0.0), Limits(0.5, 8.0, 0.5, 20.0), period=0.5)
    run = perform(task(), robot, timeout=100.0, following=Following(patience=0.8))
    assert not run.finished and "no progress" in run.reason and run.t[-1] < 20


def test_who_begins_elsewhere_does_not_wait_for_the_start():
    """The wait belongs to the start, and there the robot has not been."""
    run = perform(task(pauses=[3.0, 0.0, 0.0]), Unicycle((-1.0, 1.0, 0.0)))
    assert run.finished and run.waits.tolist() == [[0.0, 3.0, 0.0]]


def test_a_late_loop_keeps_its_waits():
    """Four periods late at every step."""
    robot = Unicycle((0.0, 0.0, 0.0), period=0.05)
    controller = Controller(task(pauses=[0.0, 3.1, 0.0]), robot)
    while not controller.over:
        speed, turn = controller.step(robot.pose, elapsed=0.2)
        for _ in range(4):
            robot.drive(speed, turn)
    run = controller.run()
    assert run.finished and 3.1 <= run.waits[0, 2] < 3.35 and run.trusted


class Breaking(Unicycle):
    """Its bumper falls off after two seconds."""

    periods = 0

    def drive(self, speed, turn):
        self.periods += 1
        super().drive(speed, turn)

    @property
    def touching(self):
        if self.periods > 20:
            raise OSError("bus")
        return self.periods == 10 or None


def test_a_robot_that_fails_to_tell_leaves_the_run_so_far():
    """Whatever it is asked for; what it touched when it could tell is counted."""
    run = perform(task(), Breaking((0.0, 0.0, 0.0)))
    assert run.reason == "the robot failed at 2.1 s with OSError: bus" and len(run.t) == 21 and run.collisions == 1


class Unmeasured(Unicycle):
    """Nobody measures where it is but now and then."""

    @property
    def true_pose(self):
        return self.pose if self.pose[0] < 1.0 else None


def test_true_poses_that_nobody_has_are_none():
    """What it believes is all there is."""
    run = perform(task(), Unmeasured((0.0, 0.0, 0.0)))
    assert run.finished and np.isnan(run.true_poses[-1]).all()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("true_pose", (1.0, 2.0), "true_pose must be three numbers or None"),
        ("noticed", [[0, 0, 1, 1]], "what the robot noticed must have boxes"),
    ],
)
def test_what_a_robot_tells_is_checked(name, value, message):
    """At once, not after the drive."""
    robot = Unicycle((0.0, 0.0, 0.0))
    setattr(robot, name, value)
    with pytest.raises(ValueError, match=message):
        perform(task(), robot)
