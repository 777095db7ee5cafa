"""The drawing vocabulary: what is drawn lies where the data is, and says once what it is."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.patches import Circle, Ellipse, Polygon
from rooms import ANGLES, CANS, WALLS, room_map, scan

from dollop import Demonstration, Environment, Task, Unicycle, perform, plot
from dollop.cdhmm import SubgoalHMM
from dollop.lab import Object, Person, Scene, walks_of
from dollop.laser import LaserLog

POSE = np.array([4.5, 1.0, 1.5])
ARC = np.column_stack([np.cos(np.linspace(0, 3, 61)), np.sin(np.linspace(0, 3, 61))])


@pytest.fixture
def ax():
    """Axes of a figure that is closed afterwards."""
    figure, ax = plt.subplots()
    yield ax
    plt.close(figure)


def labels(ax):
    """What a legend would say."""
    return ax.get_legend_handles_labels()[1]


def run(kidnapped=(), clearance=None, rows=50):
    """A run along the x axis at 0.1 m a period, carried up by a metre at every kidnapping."""
    t = np.arange(rows) / 10
    ups = (t[:, None] > np.array(kidnapped) - 0.05).sum(axis=1)
    clearance = np.ones(rows) if clearance is None else clearance
    return SimpleNamespace(
        t=t,
        true_poses=np.column_stack([t, ups, np.zeros(rows)]),
        kidnapped=np.array(kidnapped, dtype=float),
        clearance=clearance,
        collisions=int((clearance < 0).any()),
    )


def test_a_path_has_the_positions(ax):
    """Of poses the heading is left out; colour and label are those asked for."""
    plot.path(ax, np.column_stack([ARC, np.ones(61)]), "a path", plot.RUN)
    (line,) = ax.lines
    np.testing.assert_array_equal(line.get_xydata(), ARC)
    assert (line.get_color(), line.get_label()) == (plot.RUN, "a path")


def test_boxes_have_their_corners_and_one_label(ax):
    """Two boxes lie where they are, and the legend names them once."""
    plot.boxes(ax, CANS, "obstacles")
    drawn = [patch.get_bbox().extents for patch in ax.patches]
    np.testing.assert_allclose(drawn, CANS)
    assert labels(ax) == ["obstacles"]


def test_a_law_has_two_arrowheads_on_its_way(ax):
    """Each points along the response, from one of its points to the next; the law is named once."""
    plot.law(ax, ARC)
    assert len(ax.texts) == 2 and labels(ax) == ["control law"]
    for arrow in ax.texts:
        (behind,) = np.flatnonzero((arrow.xyann == ARC).all(axis=1))
        np.testing.assert_array_equal(arrow.xy, ARC[behind + 1])


def test_a_law_of_two_points_has_its_arrowheads_too(ax):
    """The shortest response there is."""
    plot.law(ax, [[0, 0], [1, 2]])
    assert [tuple(arrow.xy) for arrow in ax.texts] == [(1, 2), (1, 2)]


def test_the_robot_is_a_circle_with_its_heading(ax):
    """Its radius in m, and a line from its middle to its rim along theta."""
    plot.robot(ax, POSE, radius=0.3, label="robot")
    (circle,) = ax.patches
    assert circle.center == tuple(POSE[:2]) and circle.radius == 0.3
    middle, rim = ax.lines[-1].get_xydata()
    np.testing.assert_allclose(rim - middle, [0.3 * np.cos(1.5), 0.3 * np.sin(1.5)])
    assert labels(ax) == ["robot"]


def test_a_scan_has_its_rays_and_ends(ax):
    """Rays go from the laser to what came back; a beam without return is not drawn."""
    ranges = scan(POSE, np.vstack([CANS, WALLS]))
    ranges[::4] = np.inf
    log = LaserLog(np.zeros(1), ranges[None], ANGLES, POSE[None], 81.0)
    plot.scan(ax, log, 0)
    *rays, points = ax.lines
    back = np.isfinite(ranges)
    bearings = (POSE[2] + ANGLES)[back, None]
    ends = POSE[:2] + ranges[back, None] * np.hstack([np.cos(bearings), np.sin(bearings)])
    np.testing.assert_allclose(points.get_xydata(), ends)
    np.testing.assert_allclose(
        [ray.get_xydata() for ray in rays], np.stack([np.tile(POSE[:2], (len(ends), 1)), ends], 1)
    )
    assert labels(ax) == ["laser scan"]


def test_a_map_lies_where_it_is_and_free_cells_stay_blank(ax):
    """The image covers the map, and of its cells those are shown that are occupied."""
    grid = room_map()
    plot.grid_map(ax, grid)
    (image,) = ax.images
    np.testing.assert_allclose(image.get_extent(), grid.extent)
    np.testing.assert_array_equal(~image.get_array().mask, grid.occupied)


def test_a_track_is_dotted_where_it_was_occluded(ax):
    """All positions are a line, the occluded ones dots."""
    occluded = np.arange(61) % 5 == 0
    plot.track(ax, SimpleNamespace(positions=ARC, occluded=occluded), "user's track")
    line, dots = ax.lines
    np.testing.assert_array_equal(line.get_xydata(), ARC)
    np.testing.assert_array_equal(dots.get_xydata(), ARC[occluded])
    assert labels(ax) == ["user's track", "occluded"]


def test_a_workspace_has_map_robot_and_obstacles_in_metres(ax):
    """Equal scales, units on the axes, and a legend of what is there."""
    assert plot.workspace(room_map(), POSE, CANS, ax, "room") is ax
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) == ("x [m]", "y [m]", "room")
    assert ax.get_aspect() == 1
    assert labels(ax) == ["obstacles", "robot"]


def test_a_scene_shows_what_the_laser_meets_and_who_walks(ax):
    """Outlines at the beam are where the record has them, a cone's foot is dotted round it, and each walk is there."""
    walked = Person([(1.0, 3.0), (2.0, 3.0), (2.0, 4.0)])
    scene = Scene([Object.cone((4.0, 3.0)), Object("box", (6.0, 3.0), (0.4, 0.6), 0.2)], people=[walked])
    plot.scene(ax, scene, walks_of(scene))
    outlines = [each.get_xy() for each in ax.patches if isinstance(each, Polygon)]
    extents = {tuple(np.ptp(each, axis=0).round(2)) for each in outlines}
    assert {(9.0, 7.0), (0.26, 0.26), (0.56, 0.56), (0.4, 0.6)} <= extents  # room, cone, its foot, a box too low
    assert labels(ax) == ["objects", "user, in truth", "robot"]
    np.testing.assert_allclose(ax.lines[0].get_xydata()[-1], (2.0, 4.0), atol=0.2)


def test_a_start_is_a_dot_where_it_is(ax):
    """Named once, over what is drawn there."""
    plot.start(ax, (1.0, 2.0))
    (dot,) = ax.lines
    np.testing.assert_array_equal(dot.get_xydata(), [(1.0, 2.0)])
    assert labels(ax) == ["start"]


def test_a_run_drawn_by_itself_has_its_own_number(ax):
    """The third of several, in axes of its own: a 3 where it was put, the look of every other run."""
    plot.runs(ax, [run(kidnapped=[2.0])], first=2)
    assert "3" in [text.get_text() for text in ax.texts]
    assert ax.lines[0].get_color() == plot.RUN and labels(ax) == ["robot's runs", "kidnapped"]


def test_runs_look_alike_unless_one_is_kidnapped(ax):
    """One colour, one label, and no number."""
    plot.runs(ax, [run(), run()])
    assert [line.get_color() for line in ax.lines] == [plot.RUN] * 2
    assert labels(ax) == ["robot's runs"] and not ax.texts and not ax.patches


def test_kidnapped_runs_are_numbered_where_they_were_put(ax):
    """The second of three is carried off twice: two leaps, dots and numbers, named once."""
    plot.runs(ax, [run(), run([2.0, 3.0]), run()])
    assert [(text.get_text(), *text.xy) for text in ax.texts] == [("2", 2.0, 1.0), ("2", 3.0, 2.0)]
    leaps = [line.get_xydata().tolist() for line in ax.lines if line.get_linestyle() == ":"]
    np.testing.assert_allclose(leaps, [[[1.9, 0], [2, 1]], [[2.9, 1], [3, 2]]])
    assert labels(ax) == ["robot's runs", "kidnapped"]
    assert len({line.get_color() for line in ax.lines if line.get_linewidth() == 1.2}) == 3


def test_the_first_contact_is_circled(ax):
    """The rim of the robot stands where the clearance first fell below zero."""
    clearance = np.ones(50)
    clearance[[20, 21, 30]] = -0.01
    plot.runs(ax, [run(), run(clearance=clearance)])
    (circle,) = ax.patches
    assert isinstance(circle, Circle) and circle.center == pytest.approx((2.0, 0.0))
    assert labels(ax) == ["robot's runs", "first contact, robot's rim"]


def test_a_run_of_one_period_is_drawn(ax):
    """It had nothing left to do where it started."""
    plot.runs(ax, [run(rows=1)])
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), [[0, 0]])


def test_a_cdhmm_has_its_states_steps_and_ends(ax):
    """A dot, an ellipse and a number per state, an arrow per step, words at the path's ends."""
    places = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    rng = np.random.default_rng(0)
    model = SubgoalHMM.fit([places + rng.normal(0, 0.05, (3, 2)) for _ in range(4)])
    plot.cdhmm(ax, model)
    np.testing.assert_array_equal(ax.lines[-1].get_xydata(), model.means)
    centres = [patch.center for patch in ax.patches if isinstance(patch, Ellipse)]
    np.testing.assert_allclose(centres, model.means)
    written = [text.get_text() for text in ax.texts if text.get_text()]
    assert sorted(written) == ["0", "1", "2", "end", "start"]
    assert len(ax.texts) - len(written) == np.count_nonzero(model.transitions)
    assert labels(ax) == ["most-likely path", "states, 2 sd"]


BOXES = np.array([[2.0, 1.0, 2.4, 1.4], [6.0, 1.0, 6.4, 1.4]])


def learned(pauses=None):
    """A task of one walk along the x axis and up, which waits where it is told to."""
    x = np.r_[np.linspace(0, 6, 60), np.full(40, 6.0)]
    walk = np.column_stack([x, np.r_[np.zeros(60), np.linspace(0.1, 4, 40)]])
    task = Task.of(Demonstration(walk, Environment(BOXES)))
    if pauses is None:
        return task
    law = replace(task.law, pauses=np.resize(pauses, len(task.law.segments) + 1))
    return replace(task, law=law, ways=(law,))


def written(ax):
    """What is written into the plane."""
    return [text.get_text() for text in ax.texts if text.get_text()]


def test_a_task_shows_its_way_its_subgoals_and_what_it_follows(ax):
    """The response as the law has it, a number for each subgoal and object, lines to the objects that weigh most."""
    task = learned()
    plot.task(ax, task)
    (way,) = [line for line in ax.lines if line.get_label() == "way of the task"]
    np.testing.assert_allclose(way.get_xydata(), task.law.response())
    count = len(task.law.segments)
    assert sorted(written(ax)) == sorted(["0", "1", *map(str, range(1, count + 1))])
    ends = [line.get_xydata()[1] for line in ax.lines if line.get_linestyle() == ":"]
    centres = BOXES.reshape(-1, 2, 2).mean(axis=1)
    assert len(ends) >= count and all(np.abs(centres - end).sum(axis=1).min() < 1e-9 for end in ends)
    assert labels(ax) == ["objects, by number", "walks shown", "follows", "way of the task", "subgoals", "start"]


def test_waits_are_told_in_seconds(ax):
    """A ring where the law waits, and how long; none elsewhere."""
    plot.task(ax, learned([0.0, 2.5, 0.0, 0.0]))
    (ring,) = [line for line in ax.lines if line.get_label() == "waits"]
    np.testing.assert_allclose(ring.get_xydata()[0], learned().law.subgoals[0])
    assert [text for text in written(ax) if text.endswith(" s")] == ["2.5 s"]


def test_a_run_shows_what_it_reached_and_where_it_was_carried(ax):
    """Subgoals have numbers, and are grey if not reached; kidnappings are lettered leaps; the robot has its size."""
    task = learned([0.0, 2.0, 0.0, 0.0])
    background = room_map()
    robot = Unicycle((*task.law.start, 0.0), radius=0.3)
    done = perform(task, robot, kidnap=[(2.0, (3.0, 3.0, 0.0))], timeout=20.0)
    plot.grid_map(ax, background)
    plot.run(ax, done, task)
    crosses = {line.get_label(): line.get_xydata() for line in ax.lines if line.get_label().startswith("subgoals")}
    assert len(crosses["subgoals, reached"]) == done.reached.sum()
    assert len(crosses["subgoals, not reached"]) == (~done.reached).sum() > 0
    (leap,) = [line.get_xydata() for line in ax.lines if line.get_linestyle() == ":"]
    np.testing.assert_allclose(leap[1], (3.0, 3.0), atol=1e-9)
    assert {"a", "1", "2"} <= set(written(ax)) and "b" not in written(ax)
    (rim,) = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert rim.radius == 0.3 and rim.center == pytest.approx(tuple(done.true_poses[-1, :2]))


def test_a_picture_is_the_same_each_time_and_its_plane_is_true():
    """The same bytes; equal aspect, units, and a legend that lies outside of the axes."""
    task = learned()
    assert plot.png(partial(plot.task, task=task)) == plot.png(partial(plot.task, task=task))
    figure = plot.figure_of(partial(plot.task, task=task), "a task")
    figure.canvas.draw()
    (ax,), (legend,) = figure.axes, figure.legends
    assert ax.get_aspect() == 1 and (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")
    assert not ax.get_window_extent().overlaps(legend.get_window_extent())


def test_a_long_legend_is_as_narrow_as_its_picture():
    """Names that are too long for four columns are in fewer; all of it is in the picture."""

    def draw(ax):
        for k in range(6):
            plot.path(ax, [[0, k], [1, k]], f"a way with a long name, {k}")

    figure = plot.figure_of(draw)
    figure.canvas.draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert len(legend.get_texts()) == 6 and 0 <= box.x0 < box.x1 <= figure.bbox.width


def test_a_whole_map_has_floor_and_walls(ax):
    """Free cells are pale, occupied ones grey, and both are in the legend."""
    plot.whole_map(ax, room_map())
    assert labels(ax) == ["occupied", "free"] and len(ax.images) == 2


def test_the_style_ends_with_its_block():
    """What is drawn afterwards looks as before."""
    before = plt.rcParams["legend.frameon"]
    with plot.style():
        assert not plt.rcParams["legend.frameon"]
    assert plt.rcParams["legend.frameon"] == before
