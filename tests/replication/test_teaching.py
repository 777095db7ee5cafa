"""Teaching: what is drawn is walked, seen, learned and driven; what cannot be is refused where it was tried."""

import numpy as np
import pytest
from matplotlib.backend_bases import MouseEvent
from places import ROOT

import dollop
from dollop.environment import Environment
from dollop.replication.teaching import classroom, lesson
from dollop.replication.teaching.classroom import INVITATION, Classroom
from dollop.replication.teaching.lesson import Lesson, Refused

TURN = np.linspace(-np.pi / 2, 3 * np.pi / 2, 40)
LOOP = np.column_stack([4.5 + 3.2 * np.cos(TURN), 3.5 + 1.2 * np.sin(TURN)])
ROUND = np.column_stack([6.5 + 1.3 * np.cos(TURN), 3.5 + 1.1 * np.sin(TURN)])
"""Round the right can alone, which is sooner walked."""
BACKGROUND = dollop.OccupancyGrid.load(ROOT / "data" / "lab.yaml")
WRONG = {
    "the walk leads over an object": [(1.5, 3.6), (4.5, 3.6)],
    "the walk leads through a wall or furniture": [(1.5, 4.0), (1.5, 6.6)],
    "the walk leaves the room": [(4.5, 3.0), (4.5, 8.0)],
    "the walk leads through the robot": [(4.5, 3.6), (4.5, 0.6)],
    "too near to a wall or furniture": [(8.6, 3.0), (6.5, 2.6)],
    "too short": [(4.5, 3.0), (4.6, 3.0)],
}


@pytest.fixture(scope="module")
def begun():
    """A lesson in the paper's room, before anything was shown."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    return Lesson.begin(BACKGROUND)


@pytest.fixture(scope="module")
def taught(begun):
    """The same after a loop round both cans."""
    return begun.taught(LOOP)


# ---- lessons


def test_a_loop_that_was_drawn_is_learned_and_driven(taught):
    """Four to eight subgoals, a law within a decimetre of the line, and a robot that finishes without a touch."""
    assert 4 <= len(taught.task.law.subgoals) <= 8 and not taught.doubts
    assert dollop.trajectory.distance_to_polyline(LOOP, taught.task.law.response()).mean() < 0.10
    run = taught.performed()
    assert run.finished and run.collisions == 0


def test_a_can_that_is_moved_takes_its_end_of_the_loop_along(taught):
    """Seen by the laser alone: the right end goes with its can, the left one stays; the lesson before is unaltered."""
    before = taught.task.law.response()
    after = taught.moved(1, (5.9, 3.2)).task.law.response()
    assert after[:, 0].max() - before[:, 0].max() == pytest.approx(-0.6, abs=0.1)
    assert after[:, 0].min() == pytest.approx(before[:, 0].min(), abs=0.1)
    assert np.array_equal(taught.task.law.response(), before) and len(taught.scene.objects) == 2


def test_the_same_walk_among_cans_that_stand_elsewhere_makes_the_task_better(begun):
    """A can that plays no part bends the first guess; the second walk tells, and the third is foretold."""
    told = begun.put("can", (4.5, 3.9)).taught(LOOP)
    for place in ((4.5, 3.1), (3.9, 3.6)):
        told = told.moved(2, place).taught(LOOP)
    assert told.foretold[0] > 0.15 > 0.08 > told.foretold[1]
    assert len(told.demonstrations) == 3


@pytest.mark.parametrize("words", WRONG)
def test_a_walk_that_cannot_be_is_refused_where_it_cannot(begun, words):
    """The message names the rule; the place lies on the line, and is where the rule is broken."""
    with pytest.raises(Refused, match=words) as told:
        begun.walk(WRONG[words])
    line = np.linspace(*np.array(WRONG[words]), 200)
    assert np.linalg.norm(line - told.value.place, axis=1).min() < 0.05
    assert not begun.demonstrations


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (lambda given: given.moved(0, (6.4, 3.6)), "must not stand in each other"),
        (lambda given: given.moved(0, (9.5, 3.6)), "must stand in the room"),
        (lambda given: given.put("cone", (1.2, 6.6)), "must stand in the room and free"),
        (lambda given: given.put("can", (4.5, 0.7)), "must not be in an object"),
    ],
)
def test_objects_that_cannot_stand_there_are_refused(begun, what, words):
    """Into each other, into furniture, out of the room, onto the robot."""
    with pytest.raises(Refused, match=words):
        what(begun)


def test_a_can_that_is_taken_away_leaves_a_doubt(taught):
    """What hung on it is kept as well as can be, and said."""
    assert any("object" in doubt for doubt in taught.without(1).doubts)


def test_without_a_laboratory_the_robot_is_told_and_a_unicycle_drives(monkeypatch):
    """Nothing is simulated: boxes are the true ones, the trajectory is the walk itself."""
    monkeypatch.setattr(lesson, "find_spec", lambda name: None)
    told = Lesson.begin(BACKGROUND).taught(LOOP)
    assert np.array_equal(told.seen.boxes, Environment(told.scene.boxes).boxes)
    assert told.performed().finished


# ---- the room


@pytest.fixture
def room(begun, monkeypatch):
    """A room that begins with what another has seen."""
    monkeypatch.setattr(classroom.Lesson, "begin", lambda *_: begun)
    return Classroom(BACKGROUND, live=False)


def mouse(room, *places):
    """Press at the first place, move over the others, let go at the last: events as a browser sends them."""
    pixels = room.figure.axes[0].transData.transform(np.array(places, dtype=float))
    names = ["button_press_event", *["motion_notify_event"] * (len(places) - 1), "button_release_event"]
    for name, (x, y) in zip(names, [*pixels, pixels[-1]], strict=True):
        event = MouseEvent(name, room.figure.canvas, x, y, button=1)
        room.figure.canvas.callbacks.process(name, event)


def words_in(room):
    """All that is written in the plan."""
    return " ".join(each.get_text().replace("\n", " ") for each in room.figure.axes[0].texts)


def test_a_walk_is_drawn_a_can_dragged_and_the_robot_kidnapped_by_the_mouse(room):
    """Each ends with a run, whose end stands over the plan; numbers stand at the subgoals."""
    mouse(room, *ROUND)
    assert room.said.startswith("Finished") and room.run.collisions == 0
    assert str(len(room.lesson.task.law.subgoals)) in words_in(room).split()
    mouse(room, (6.5, 3.6), (6.3, 3.4), (6.1, 3.1))
    assert room.lesson.scene.positions[1] == pytest.approx((6.1, 3.1), abs=0.02) and room.run.finished
    mouse(room, (4.4, 5.2))
    assert room.run.true_poses[0, :2] == pytest.approx((4.4, 5.2), abs=0.03) and room.said.startswith("Finished")


def test_what_cannot_be_is_said_at_the_place_and_changes_nothing(room):
    """A walk through a desk, one out of the room, and a can dropped into the other."""
    before = room.lesson
    for places, words in (
        (WRONG["the walk leads through a wall or furniture"], "through a wall or furniture"),
        ([(4.5, 3.0), (7.0, 3.0), (9.3, 3.0)], "leaves the room"),
        ([(6.5, 3.6), (4.0, 3.6), (2.6, 3.6)], "must not stand in each other"),
        ([(4.5, 3.0), (4.9, 3.0)], "too short"),
    ):
        mouse(room, *places)
        assert words in room.said and words in words_in(room), room.said
        assert room.lesson is before


def test_a_click_before_anything_is_learned_invites(room):
    """There is nothing to drive yet; that is said, and no run is begun."""
    mouse(room, (4.4, 5.2))
    room.drive()
    assert INVITATION in room.said and room.run is None


def test_buttons_put_objects_and_take_them_away(room):
    """The next click is where; then the mouse draws again."""
    pytest.importorskip("ipywidgets", reason="buttons need the extra notebooks")
    desk = room.desk()
    buttons = {each.description: each for each in desk.children[0].children}
    for name, count in (("put a can", 3), ("put a cone", 4), ("take away", 3)):
        buttons[name].click()
        mouse(room, (4.5, 2.2 if name == "put a can" else 4.4))
        assert len(room.lesson.scene.objects) == count, room.said
    assert room.tool == "" and room.said in desk.children[1].value
    buttons["start over"].click()
    assert len(room.lesson.scene.objects) == 2 and room.said == INVITATION


def test_a_run_that_another_takes_the_place_of_ends(room):
    """Whoever draws while somebody walks begins anew; nothing of the walk before is learned."""
    steps = room._shown(room.lesson.walk(ROUND))
    next(steps)
    room._going = steps
    room.show_walk(ROUND[:20])
    assert len(room.lesson.demonstrations) == 1 and not room.busy
    assert steps.gi_frame is None
