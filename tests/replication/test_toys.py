"""Toys answer the mouse: what is dragged follows it, what cannot be is said in words, and nothing good is lost."""

import gc

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backend_bases import MouseEvent
from matplotlib.figure import Figure
from places import DATA

from dollop import Environment, OccupancyGrid
from dollop.replication import toys

CANS = np.array([[2.5, 3.6], [6.5, 3.6]])
LAB = OccupancyGrid.load(DATA / "lab.yaml")
TWO_LINES = 2
PIXEL = 0.03
"""m: of whole pixels is what the mouse tells."""


def boxes_at(places):
    """Boxes of 36 cm about some places."""
    return np.hstack([places - 0.18, places + 0.18])


def assert_near(found, told):
    """Places are the same to a pixel."""
    np.testing.assert_allclose(found, told, atol=PIXEL)


class Seen:
    """What a toy asks for, and with which places."""

    def __init__(self):
        self.moves, self.drops, self.now = [], [], 0.0

    def on_move(self, places):
        """Note the places, if cans can stand there."""
        toys.check_standing(boxes_at(places), LAB)
        self.moves.append(places)
        return "moving"

    def on_drop(self, places):
        """The same when one is let go."""
        toys.check_standing(boxes_at(places), LAB)
        self.drops.append(places)
        return "let go"

    def clock(self):
        """A second after another: never is a move passed over."""
        self.now += 1.0
        return self.now


@pytest.fixture
def seen():
    """What has been asked for."""
    return Seen()


@pytest.fixture
def ax():
    """The plane of the lab, on a canvas that only draws."""
    ax = Figure(figsize=(8, 5)).subplots()
    ax.set(xlim=(-1, 10), ylim=(-1, 8), aspect="equal")
    return ax


@pytest.fixture
def cans(ax, seen):
    """Two cans that can be dragged."""
    return toys.Dragged(ax, CANS, seen.on_move, seen.on_drop, clock=seen.clock)


def test_a_thing_follows_the_mouse_and_the_others_stay(ax, cans, seen):
    """Each move and the drop are told, with the places of all."""
    toys.drag(ax, CANS[1], (6.0, 3.0), (5.5, 2.5))
    assert_near([each[1] for each in seen.moves], [(6.0, 3.0), (5.5, 2.5)])
    assert_near(seen.drops[-1], [CANS[0], (5.5, 2.5)])
    assert_near(cans.places, seen.drops[-1])
    assert cans.held is None and cans.said == ax.get_title().strip() == "let go"


def test_a_toy_that_nobody_keeps_still_works(ax, seen):
    """The picture keeps it, as long as it is shown."""
    toys.Dragged(ax, CANS, seen.on_move, seen.on_drop)
    gc.collect()
    toys.drag(ax, CANS[1], (6.0, 3.0))
    assert_near(seen.drops[-1][1], (6.0, 3.0))


def test_who_presses_beside_everything_moves_nothing(ax, cans, seen):
    """Only what is within reach is taken hold of, and only by the left button."""
    toys.drag(ax, (4.5, 3.6), (5.5, 2.5))
    x, y = ax.transData.transform(CANS[1])
    ax.figure.canvas.callbacks.process(
        "button_press_event", MouseEvent("button_press_event", ax.figure.canvas, x, y, 3)
    )
    assert cans.held is None and not seen.moves and len(seen.drops) == 1


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((2.6, 3.7), "two objects would stand in each other"),
        ((9.0, 3.6), "in a wall or in furniture"),
        ((9.7, 7.7), "where the map knows no floor, out of the room"),
        ((-3.0, 3.6), "out of the room"),
    ],
)
def test_what_cannot_be_is_said_and_the_last_good_state_stays(ax, cans, seen, place, words):
    """Into the other can, into a wall, out of the room and even out of the axes: the can goes back."""
    toys.drag(ax, CANS[1], (6.0, 3.0), place)
    assert words in cans.said and cans.said.endswith("it is back where it was")
    assert ax.title.get_color() != "black"
    assert_near(cans.places, CANS)
    assert_near(seen.drops[-1], CANS)  # what is drawn is that of these places again
    toys.drag(ax, CANS[1], (6.0, 3.0))
    assert cans.said == "let go" and ax.title.get_color() == "black"


def test_what_is_on_the_way_through_a_wall_waits_for_the_other_side(ax, cans, seen):
    """Over a bad place the mouse keeps its hold, and the last good places stay."""
    toys.drag(ax, CANS[1], (2.6, 3.7), (2.5, 2.5))
    assert_near(cans.places, [CANS[0], (2.5, 2.5)])


def test_of_moves_that_come_too_fast_the_newest_is_drawn(ax, seen, monkeypatch):
    """Those that have queued up while one was drawn are passed over; the last one is caught up with."""
    later = []
    monkeypatch.setattr(ax.figure.canvas, "new_timer", lambda _, calls: later.append(calls[0][0]) or Stub())
    cans = toys.Dragged(ax, CANS, seen.on_move, seen.on_drop, clock=lambda: 1.0)
    cans._take(at(ax, "button_press", CANS[1], button=1))
    for place in ((6.4, 3.6), (6.3, 3.6), (6.2, 3.6)):
        cans._move(at(ax, "motion_notify", place, buttons={1}))
    assert_near([each[1] for each in seen.moves], [(6.4, 3.6)])
    later[0]()
    assert_near([each[1] for each in seen.moves], [(6.4, 3.6), (6.2, 3.6)])


class Stub:
    """A timer that nobody winds."""

    def start(self):
        """Later is told by the test."""


def at(ax, name, place, **pressed):
    """An event of the mouse at a place."""
    return MouseEvent(f"{name}_event", ax.figure.canvas, *ax.transData.transform(place), **pressed)


def test_who_lets_go_beyond_the_picture_has_let_go(ax, cans, seen):
    """The next move without a button down says so."""
    cans._take(at(ax, "button_press", CANS[1], button=1))
    cans._move(at(ax, "motion_notify", (6.0, 3.0), buttons={1}))
    cans._move(at(ax, "motion_notify", (6.0, 2.8), buttons=set()))
    assert cans.held is None and cans.said == "let go"
    assert_near(cans.places[1], (6.0, 2.8))


def test_things_can_be_put_somewhere_by_a_program(cans):
    """As many as one likes; where they cannot be, nothing changes."""
    three = np.vstack([CANS, [4.0, 2.0]])
    assert cans.put(three) and len(cans.places) == len(three)
    assert not cans.put([[2.5, 3.6], [2.6, 3.6]])
    assert_near(cans.places, three)
    assert "each other" in cans.said


def test_words_take_two_lines_however_many_there_are(ax):
    """The picture does not jump, and of too many words the first are shown."""
    for words in ("", "short", "many words " * 60):
        toys.tell(ax, words)
        assert len(ax.get_title().split("\n")) == TWO_LINES
    assert ax.get_title().endswith("…")


def test_cans_may_stand_on_free_floor_only():
    """The cans of the demonstration stand well; an environment's boxes are asked as they are."""
    toys.check_standing(Environment(boxes_at(CANS)).boxes, LAB)
    toys.check_standing([], LAB)
    with pytest.raises(ValueError, match="at \\(2.6, 3.6\\) two objects"):
        toys.check_standing(boxes_at(np.array([[2.5, 3.6], [2.6, 3.6]])), LAB)


def test_a_click_is_where_it_was_made(ax):
    """`click` is what the reader does."""
    found = []
    ax.figure.canvas.mpl_connect("button_press_event", lambda event: found.append((event.xdata, event.ydata)))
    toys.click(ax, (3.0, 4.0))
    assert_near(found, [(3.0, 4.0)])


def test_a_live_figure_is_none_of_pyplots():
    """What is drawn by pyplot afterwards is drawn elsewhere, and the mouse is heard."""
    pytest.importorskip("ipympl", reason="live figures need the extra notebooks")
    live = toys.live_figure(8, 5)
    ax = live.subplots()
    ax.set(xlim=(0, 9), ylim=(0, 7))
    cans = toys.Dragged(ax, CANS, lambda places: None)
    assert plt.gca() is not ax
    toys.drag(ax, CANS[0], (3.0, 3.0))
    assert_near(cans.places[0], (3.0, 3.0))
    plt.close("all")
