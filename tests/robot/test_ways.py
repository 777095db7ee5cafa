"""Ways: the one that fits the start and is free is driven, and changed where it is blocked; and bad input."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from dollop.environment import Environment
from dollop.gridmap import OccupancyGrid
from dollop.robot.avoidance import ObstacleMap
from dollop.robot.performing import Unicycle, perform
from dollop.robot.run import Run
from dollop.robot.ways import Way, counterpart, extra_length, fitting
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline, resample

START = (0.0, 0.0, 0.3)
TABLES = [[2.7, 0.7, 3.3, 1.9], [2.7, -5.0, 3.3, -0.7]]
CLOSING = [2.7, -0.55, 3.3, 0.6]
STOOL = [1.3, 0.05, 1.6, 0.35]


def walk(*points):
    """A law of straight lines through points, in order."""
    return SequencedLDS.fit(resample(points, 150), tolerance=0.05)


BETWEEN = walk((0, 0), (6, 0))
SHARED = walk((0, 0), (0.8, 0), (0.8, 0.7), (1.4, 0), (6, 0)), walk((0, 0), (0.8, 0), (1.6, 2.6), (4.4, 2.6), (6, 0))
ROUND = walk((0, 0), (1, 0), (1.6, 2.6), (4.4, 2.6), (6, 0))


def task(*more, ways=(BETWEEN, ROUND), shown=(3, 1)):
    """Between two tables, or round one of them, with more boxes."""
    return SimpleNamespace(law=ways[0], ways=ways, shown=shown, environment=Environment([*TABLES, *more]))


def walled(*openings):
    """A map of 8 m by 8 m from (-1, -4) on, with a wall at x = 3 m but for openings (low, high) in m along y."""
    x, y = np.meshgrid(np.arange(160) * 0.05 - 0.975, np.arange(160) * 0.05 - 3.975)
    wall = np.abs(x - 3) < 0.15
    for low, high in openings:
        wall &= (y < low) | (y > high)
    return OccupancyGrid(wall.astype(float), (-1.0, -4.0), 0.05)


class Noticing(Unicycle):
    """Notices boxes from a time on."""

    def __init__(self, pose, *found):
        self.found, self.now = found, 0.0
        super().__init__(pose)

    def drive(self, speed, turn):
        self.now += self.period
        super().drive(speed, turn)

    @property
    def noticed(self):
        """All that it has noticed so far."""
        return Environment([box for since, box in self.found if self.now > since])


class Stopped(Unicycle):
    """Cannot drive within 0.35 m of a box that nobody knows of, unless it leads away."""

    def __init__(self, pose, box):
        self.unknown = ObstacleMap.of(Environment([box]), places=[[-2, -4], [8, 4]], radius=0.35)
        super().__init__(pose)

    def drive(self, speed, turn):
        x, y, theta = self.pose
        super().drive(speed, turn)
        edge = self.unknown.edge(*self.pose[:2])
        if edge < min(0.0, self.unknown.edge(x, y)):
            self.place((x, y, self.pose[2]))


class Lost(Unicycle):
    """Does not know where it is for two seconds."""

    periods = 0

    def drive(self, speed, turn):
        self.periods += 1
        super().drive(speed, turn)

    @property
    def localised(self):
        return self.periods > 20


# ---- at the start


def test_the_usual_way_is_taken_where_it_is_free():
    """Of two free ways that fit, the one shown most often; the run is that of the law alone."""
    run, alone = (perform(each, Unicycle(START)) for each in (task(), task(ways=(BETWEEN,), shown=(3,))))
    assert run.finished and (run.way == 0).all() and " way " not in repr(run)
    np.testing.assert_array_equal(run.poses, alone.poses)


def test_the_count_decides_not_the_order():
    """Told to have been shown more often, the second way is taken."""
    run = perform(task(shown=(1, 4)), Unicycle(START))
    assert run.finished and (run.way == 1).all() and "s on way 1: finished" in repr(run)


@pytest.mark.parametrize("control", ["plain", "pursuit"])
@pytest.mark.parametrize("background", [None, walled((-0.7, 0.7), (2.0, 3.6))])
def test_where_the_usual_way_is_closed_the_other_is_driven(control, background):
    """Whether boxes stand between tables or in a door of the map: from the start, and nothing is touched."""
    closed = task(CLOSING) if background is None else task([2.7, -0.7, 3.3, 0.75])
    run = perform(closed, Unicycle(START), control, background=background)
    assert run.finished and (run.way == 1).all()
    assert run.collisions == 0 and run.clearance.min() > 0
    assert distance_to_polyline(run.poses[:, :2], ROUND.response()).max() < 0.6


def test_a_stool_does_not_close_a_way():
    """It is gone round on the usual way."""
    run = perform(task(STOOL), Unicycle(START))
    assert run.finished and (run.way == 0).all() and run.clearance.min() > 0


@pytest.mark.parametrize(
    ("start", "way"), [((0.0, 0.1), 0), ((0.1, 3.0), 1), ((2.0, 2.5), 1), ((1.5, -0.2), 0)], ids=str
)
def test_the_way_that_fits_the_start_is_taken(start, way):
    """The one that begins there, or on which the robot stands, though the other was shown more often."""
    ways = walk((0, 0), (6, 0)), walk((0, 3), (4.4, 2.6), (6, 0))
    run = perform(task(ways=ways), Unicycle((*start, 0.0)))
    assert run.finished and (run.way == way).all()


def test_starts_within_reach_of_each_other_are_one():
    """A few centimetres nearer to the start of the rarer way do not outweigh how often the usual one was shown."""
    ways = walk((0, 0), (6, 0)), walk((0, 0.4), (1.6, 2.6), (4.4, 2.6), (6, 0))
    assert (perform(task(ways=ways), Unicycle((0.0, 0.25, 0.0))).way == 0).all()
    assert (perform(task(ways=ways), Unicycle((0.0, 0.4, 0.0))).way == 1).all()


def test_beginning_comes_before_standing_on_a_way():
    """Where one way begins, in the middle of another that was shown more often, the one that begins is taken."""
    ways = walk((-2, 0), (6, 0)), ROUND
    run = perform(task(ways=ways), Unicycle(START))
    assert run.finished and (run.way == 1).all()


def test_a_lost_robot_chooses_when_it_knows_where_it_is():
    """Until then the usual way is in force, which is not that of its start."""
    ways = walk((0, 0), (6, 0)), walk((0, 3), (4.4, 2.6), (6, 0))
    run = perform(task(ways=ways), Lost((0.0, 3.0, 0.0)))
    assert run.finished and (run.way == ~(run.t < 2.05)).all()


def test_the_papers_kind_has_one_way():
    """Plain and without avoiding, the law is driven, through the box."""
    run = perform(task(CLOSING), Unicycle(START), "plain", avoid=False)
    assert run.finished and run.collisions == 1 and not run.way.any()
    assert np.abs(run.poses[:, 1]).max() < 0.2


def test_what_it_notices_at_once_counts_at_the_start():
    """Boxes that it sees from its start are as good as those on its map: it never begins the usual way."""
    run = perform(task(), Noticing(START, (-1.0, CLOSING)))
    assert run.finished and (run.way == 1).all() and run.clearance.min() > 0


# ---- on the way


@pytest.mark.parametrize("control", ["plain", "pursuit"])
def test_a_box_that_is_noticed_makes_it_change(control):
    """Almost two metres on, it goes back to where the other way parts, and skips none of its subgoals."""
    run = perform(task(), Noticing(START, (4.5, CLOSING)), control)
    assert run.finished and run.collisions == 0 and run.clearance.min() > 0
    changed = np.flatnonzero(np.diff(run.way))
    assert len(changed) == 1 and run.t[changed[0]] == pytest.approx(4.5, abs=0.2)
    assert f"on way 0, from {run.t[changed[0] + 1]:.1f} s on way 1: finished" in repr(run)
    other = run.poses[run.way == 1, :2]
    for goal in ROUND.subgoals[run.active[changed[0] + 1] :]:
        assert np.hypot(*(other - goal).T).min() < 0.3
    assert run.poses[:, 1].max() == pytest.approx(2.6, abs=0.3)


def test_what_is_noticed_beside_the_way_changes_nothing():
    """A stool that appears is gone round, and counts for the clearance from then on only."""
    here = Noticing(START, (0.5, STOOL), (6.0, [-0.2, -0.2, 0.2, 0.2]))
    run = perform(task(), here)
    assert run.finished and not run.way.any() and run.collisions == 0 and run.clearance.min() > 0


def test_without_progress_it_changes():
    """Halted by what nobody knows of, it leaves the usual way after eight seconds, and finishes the other."""
    run = perform(task(), Stopped(START, CLOSING))
    assert run.finished and run.clearance.min() > 0
    changed = np.flatnonzero(np.diff(run.way))
    halted = np.flatnonzero(run.poses[:, 0] > run.poses[changed[0], 0] - 0.01)[0]
    assert len(changed) == 1 and run.t[changed[0]] - run.t[halted] == pytest.approx(8.0, abs=1.0)


def test_no_part_is_skipped_that_was_not_done():
    """The other way comes by where the robot turns, but only later: it joins before that, at its first corner."""
    ways = BETWEEN, walk((0, 0), (0, -2.5), (1.8, -2.5), (1.8, 2.6), (4.4, 2.6), (6, 0))
    run = perform(task(ways=ways), Noticing(START, (4.5, CLOSING)))
    assert run.finished and run.way[-1] == 1
    turned = run.poses[run.way == 1, :2]
    assert np.hypot(*(turned[0] - [1.8, 0.0])) < 0.3 and np.hypot(*(turned - [1.8, -2.5]).T).min() < 0.5


def test_what_halts_it_halts_it_on_ways_through_the_same_gap_too():
    """Halted in a gap, it does not try a second way through it, 0.3 m beside the first, but the third round it."""
    tables = [[2.7, 1.1, 3.3, 1.9], [2.7, -5.0, 3.3, -1.1]]
    ways = BETWEEN, walk((0, 0), (1.5, 0.3), (4.5, 0.3), (6, 0)), ROUND
    wide = SimpleNamespace(law=BETWEEN, ways=ways, shown=(3, 2, 1), environment=Environment(tables))
    run = perform(wide, Stopped(START, [2.7, -1.0, 3.3, 1.0]))
    assert run.finished and set(run.way) == {0, 2}


def test_a_detour_that_the_map_asks_for_comes_first():
    """Before a stool in the middle of its way the plain law comes to a halt; a detour round it keeps to the way."""
    stool = SimpleNamespace(**vars(task()) | {"environment": Environment([[2.6, -0.2, 2.8, 0.2]])})
    run = perform(stool, Unicycle((0.0, 0.0, 0.0)), "plain")
    halted = np.count_nonzero(np.hypot(*np.diff(run.poses[:, :2], axis=0).T) < 0.001) * 0.1
    assert run.finished and not run.way.any() and halted > 4


def test_kidnapped_it_keeps_its_way():
    """Put beside the other way, it goes on to the subgoal of the usual one."""
    run = perform(task(), Unicycle(START), kidnap=[(4.0, (2.0, 2.6, 0.0))])
    assert run.finished and not run.way.any()


# ---- where every way is closed


def test_a_single_way_is_driven_by_detours():
    """With one way, closed, the run is that of a task that knows of no ways, noticed boxes or not."""
    one = task(CLOSING, ways=(BETWEEN,), shown=(3,))
    plain = SimpleNamespace(law=BETWEEN, environment=one.environment)
    runs = [perform(each, Unicycle(START)) for each in (one, plain)]
    np.testing.assert_array_equal(runs[0].poses, runs[1].poses)
    assert runs[0].finished and runs[0].clearance.min() > 0
    noticed = perform(task(ways=(BETWEEN,), shown=(3,)), Noticing(START, (2.5, CLOSING)))
    assert noticed.finished and noticed.clearance.min() > 0


def test_where_all_ways_are_closed_a_detour_is_driven():
    """Through a third opening, by the way for which that is the shorter one."""
    background = walled((-3.6, -2.4))
    bare = SimpleNamespace(law=BETWEEN, ways=(BETWEEN, ROUND), shown=(3, 1), environment=Environment([]))
    run = perform(bare, Unicycle(START), background=background)
    assert run.finished and run.collisions == 0 and run.poses[:, 1].min() < -2
    assert (run.way == 0).all()


@pytest.mark.parametrize("found", [(), ((2.5, [2.9, -4.0, 3.1, 4.0]),)], ids=["known", "noticed"])
def test_where_no_way_leads_through_it_gives_up_and_names_all(found):
    """Behind a wall without an opening, or with one that is closed while it drives."""
    background = walled((-0.7, 0.7), (2.0, 3.6)) if found else walled()
    bare = SimpleNamespace(law=BETWEEN, ways=(BETWEEN, ROUND), shown=(3, 1), environment=Environment([]))
    run = perform(bare, Noticing(START, *found), background=background)
    assert not run.finished and run.collisions == 0
    assert run.reason.startswith("there is no way to subgoal 1 for a robot of 0.25 m radius that keeps 0.02 m: none")
    assert ", on way 0 (way 1 is closed) at " in run.reason if found else run.reason.endswith("(1 more are closed)")


def test_held_fast_it_tries_every_way_and_names_all():
    """With its wheels in the air, it tries the other way, and tells where it left the first."""
    held = Unicycle(START, period=0.4)
    held.drive = lambda speed, turn: None
    run = perform(task(), held)
    assert run.way[-1] == 1 and "of way 1 (way 0 was left at (0.00, 0.00)) at " in run.reason


# ---- its parts, and bad input


def test_a_way_is_free_or_longer_or_closed():
    """Nothing, a stool, boxes between tables, and a box on a subgoal: 0, 0, some metres, and no end."""
    way = Way(0, BETWEEN)
    boxes = {"nothing": [], "stool": [STOOL], "tables": [*TABLES, CLOSING], "subgoal": [[5.8, -0.2, 6.3, 0.2]]}
    maps = {name: ObstacleMap.of(Environment(each), places=[[0, -4], [6, 4]]) for name, each in boxes.items()}
    extra = {name: extra_length(way, each, 0, 0.0, 0.0) for name, each in maps.items()}
    assert extra["nothing"] == extra["stool"] == extra_length(way, None, 0, 0.0, 0.0) == 0
    assert 1 < extra["tables"] < 10 and extra["subgoal"] == np.inf


def test_ways_have_come_equally_far():
    """Along what they share by length, between by share, never back, and from end to end."""
    one, other = Way(0, BETWEEN), Way(1, ROUND)
    end, end_other = len(one.places) - 1, len(other.places) - 1
    there = [counterpart(one, other, at) for at in (0, 15, end // 4, end // 2, 3 * end // 4, end)]
    assert (np.diff(there) > 0).all() and there[:2] == [0, 15] and there[-1] == end_other
    assert abs(there[3] - end_other / 2) < 15


@pytest.mark.parametrize(
    ("options", "best"),
    [
        ([(0, 9, 0.0, 0.0), (1, 1, 0.0, 0.0)], 0),
        ([(0, 1, 0.0, 0.0), (1, 9, 0.0, 0.2)], 1),
        ([(0, 9, 0.0, 0.3), (1, 1, 0.0, 0.0)], 1),
        ([(0, 9, 2.0, 0.0), (1, 1, 0.0, 9.0)], 1),
        ([(0, 9, 5.0, 0.0), (1, 1, 4.0, 9.0)], 1),
        ([(0, 1, np.inf, 0.0), (1, 1, np.inf, 0.0)], 0),
    ],
)
def test_free_comes_before_fit_and_fit_before_count(options, best):
    """(way, shown, extra length in m, distance in m): which is driven; of equal ones the first."""
    options = [
        SimpleNamespace(way=Way(index, None, shown), extra=extra, misfit=off) for index, shown, extra, off in options
    ]
    assert fitting(options).way.index == best


def test_a_run_of_old_is_on_the_usual_way():
    """Without telling its way, it was on way 0 all the time."""
    n = 3
    run = Run(np.arange(n), *np.zeros((2, n, 3)), *np.zeros((3, n)), True, "", 0, np.empty(0))
    assert run.way.tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ways": ()}, "must have a way, .* got 0 ways"),
        ({"shown": (3,)}, r"shown must count each, got 2 ways and \[3\]"),
        ({"environment": Environment([[5.7, -0.3, 6.3, 0.3]])}, "subgoal 1 must be free"),
    ],
)
def test_bad_ways(change, message):
    """Ways that nobody counted, and a subgoal that is taken in every way, are refused."""
    with pytest.raises(ValueError, match=message):
        perform(SimpleNamespace(**vars(task()) | change), Unicycle(START))


def test_a_way_with_a_taken_subgoal_is_left_out():
    """The other is driven, whichever of the two it is."""
    ends = walk((0, 0), (6, 0)), walk((0, 0), (4.4, 2.6), (6, 1.5))
    for box, way in (([5.8, -0.2, 6.2, 0.2], 1), ([5.8, 1.3, 6.2, 1.7], 0)):
        run = perform(task(box, ways=ends), Unicycle(START))
        assert run.finished and (run.way == way).all()


def test_a_pause_that_was_kept_on_the_way_before_counts():
    """Who waited, and changed ways then, is not told that it did not wait on the other way."""
    pausing = [replace(way, pauses=np.r_[0.0, 2.0, np.zeros(len(way.segments) - 1)]) for way in SHARED]
    both = task(ways=tuple(pausing))
    run = perform(both, Noticing(START, (7.0, CLOSING)))
    assert run.finished and run.way[-1] == 1 and 0 in run.way
    assert [note.kind for note in run.notes if note.kind == "aside"] == []
