"""Claims on learning and its premises, where the truth is made by hand: no laser, no study."""

from dataclasses import replace
from math import inf, nan
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dollop import lab
from dollop.cdhmm import SubgoalHMM
from dollop.environment import Environment
from dollop.lab.scenes import Scene, rearranged, slalom_scene
from dollop.pose import rotation
from dollop.replication import recordings
from dollop.replication.claims import CLAIMS, environment, learning, premises, walked
from dollop.replication.reconstruction import TOLD, Reconstruction
from dollop.task import Demonstration

MINE = ("combined", "subgoals", "shared", "generalize", "layouts", "repeatable", "kept")
LINE = np.column_stack([np.linspace(0, 9, 91), np.zeros(91)])
"""A walk along x."""

pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")


def walk_past(scene, seed=0):
    """A slalom as if it had been walked: scene, walk, and what a laser without error makes of it."""
    way = lab.slalom(scene, seed)
    shown = Demonstration(way.positions[::5], Environment(scene.boxes))
    return SimpleNamespace(scene=scene, walk=way, demonstration=shown)


# ---- how far cuts are apart


def test_cuts_of_the_same_places_are_nothing_apart():
    """k equal subgoals have no scatter, whatever the way."""
    places = np.array([[1.0, 0.0], [4.0, 0.0], [9.0, 0.0]])
    assert premises.scatter([places] * 4, [LINE] * 4) == (0, 0, 0)


def test_scatter_is_told_along_and_across_the_way():
    """Two walks that differ by d have a standard deviation of d / sqrt(2), each way apart."""
    places = np.array([[2.0, 0.0], [5.0, 0.0], [9.0, 0.0]])
    moved = places + np.array([[0.4, 0.1], [0.4, -0.1], [0.0, 0.2]])
    along, across, end = premises.scatter([places, moved], [LINE, LINE])
    assert (along, across) == pytest.approx((0.4 / np.sqrt(2), 0.1 / np.sqrt(2)))
    assert end == pytest.approx(0.2 / 2)


@pytest.mark.parametrize("angle", [0.7, 2.0, -3.0])
def test_scatter_turns_with_the_way(angle):
    """Along and across are the way's own: the same wherever it leads."""
    rng, turn = np.random.default_rng(4), rotation(angle).T
    subgoals = [LINE[[20, 50, 90]] + rng.normal(0, [0.3, 0.05], (3, 2)) for _ in range(5)]
    there = premises.scatter(subgoals, [LINE] * 5)
    turned = premises.scatter([each @ turn for each in subgoals], [LINE @ turn] * 5)
    assert turned == pytest.approx(there) and there[0] > 2 * there[1]


def test_walks_of_another_number_of_lds_are_not_compared():
    """The most frequent number counts, of several as frequent the least; alone there is no scatter."""
    two, three = np.array([[1.0, 0.0], [9.0, 0.0]]), np.array([[1.0, 0.0], [4.0, 0.0], [9.0, 0.0]])
    assert premises.scatter([three, two + 0.5, three], [LINE] * 3) == (0, 0, 0)
    assert premises.scatter([three, two, three + 1, two], [LINE] * 4) == (0, 0, 0)
    assert np.isnan(premises.scatter([three, two], [LINE] * 2)).all()
    along, across, end = premises.scatter([two[1:], two[1:]], [LINE] * 2)
    assert np.isnan([along, across]).all() and end == 0


def test_pairs_with_as_many_lds_are_counted():
    """Of two, two and three segments one pair of three has as many."""
    laws = [SimpleNamespace(segments=range(k), subgoals=LINE[1 : 1 + k]) for k in (2, 2, 3)]
    assert premises.cuts_apart([LINE] * 3, laws, "_x")["same_number_x"] == pytest.approx(1 / 3)


def test_where_a_walk_cannot_be_cut_there_is_no_number():
    """One walk that cannot be cut leaves no law, and all that is told of them is nan."""

    def law(walk):
        if walk == "jagged":
            raise ValueError("tolerance cannot be kept")
        return walk

    assert walked.laws_of(["smooth", "even"], law) == ["smooth", "even"]
    assert walked.laws_of(["smooth", "jagged"], law) == []
    assert all(np.isnan(value) for value in premises.cuts_apart([LINE], []).values())


# ---- the same walk again and again


@pytest.fixture
def unmoved(monkeypatch):
    """The same slalom six times; returns with what choices it was asked for."""
    shown, asked = walk_past(slalom_scene()), []

    def again(seed, how):
        asked.append(how)
        return [shown] * 6

    for module in (premises, learning):
        monkeypatch.setattr(module, "walks_again", again)
    laps = SimpleNamespace(laps=shown.demonstration.walks * 2)
    monkeypatch.setattr(recordings, "figure_eights", lambda seed, how: laps)
    return SimpleNamespace(shown=shown, asked=asked)


def test_who_walks_exactly_alike_is_cut_alike(unmoved):
    """Every pair has as many LDS, and no cut is elsewhere, with the laser and without."""
    found = premises.repeatable(0)
    assert {found[name] for name in found if name.startswith("same_number")} == {1.0}
    apart = [found[name] for name in found if name.endswith("_m")]
    assert len(apart) == 9 and np.allclose(apart, 0, atol=1e-9)


def test_who_walks_exactly_alike_shows_one_task(unmoved):
    """Five equal walks, and each pair of them, merge into the subgoals of one."""
    found = learning.combined(0)
    for name in (
        "path_right",
        "states_right",
        "pairs_right",
        "path_right_ours",
        "states_right_ours",
    ):
        assert found[name] == 1, name
    assert found["states_more"] == found["pairs_more"] == 0
    assert found["share_left"] == pytest.approx(1 / 5)


def test_a_task_of_which_a_walk_cannot_be_cut_is_told_as_nan(unmoved):
    """At a tolerance that no walk keeps nothing is judged; what was drawn is told all the same."""
    unmoved.shown.demonstration = replace(unmoved.shown.demonstration, tolerance=1e-5)
    for experiment in (learning.combined, learning.subgoals):
        found = experiment(0)
        for criterion in CLAIMS[experiment.__name__].criteria:
            told = criterion.number.startswith(("drawn", "half", "twice", "tails"))
            assert np.isfinite(found[criterion.number]) == told, criterion.number


def test_no_other_choice_reaches_the_walks(unmoved):
    """What a walk does not depend on is taken as told, so that recordings are shared."""
    learning.combined(0, Reconstruction(gain=2.0, weights=1.0, learning="anchored"))
    assert set(unmoved.asked) == {TOLD}


def test_states_beyond_those_needed():
    """Needed are as many as the longest demonstration has; the path is that of the one in the middle."""
    task = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])
    longer, elsewhere = (
        np.insert(task, 2, (5.0, 1.5), axis=0),
        np.insert(task, 1, (1.5, -3.0), axis=0),
    )
    model = SubgoalHMM.fit([task, task, longer], 0.15)
    assert learning.states_more(model) == 0 and learning.path_right(model) == 1
    model = SubgoalHMM.fit([task, longer, elsewhere], 0.15)
    assert learning.states_more(model) == 1
    assert learning.path_right(model) == 0  # the middle one has five, the path the four of all


# ---- where the walker means to be


def test_the_intended_way_passes_every_cone_where_it_is_meant_to():
    """0.75 m from each, left and right in turn, from 1 m before the first to 1 m behind the last."""
    scene = slalom_scene()
    way = walked.intended_way(scene)
    off = np.linalg.norm(way[:, None] - walked.intended_places(scene.positions), axis=2).min(axis=0)
    assert off.max() < 0.02
    assert way[0] == pytest.approx(scene.positions[0] - [1.0, 0.0], abs=0.01)
    assert way[-1] == pytest.approx(scene.positions[-1] + [1.0, 0.0], abs=0.01)


def test_subgoals_on_the_intended_way_are_nowhere_off(monkeypatch):
    """Whoever makes no error has none; errors across it are averaged out by five walks."""
    first = SimpleNamespace(scene=slalom_scene())
    way, rng = walked.intended_way(first.scene), np.random.default_rng(2)
    exact = way[np.linspace(0, len(way) - 1, 7).astype(int)][1:]
    monkeypatch.setattr(learning, "walks_again", lambda seed, how: [first])
    monkeypatch.setattr(learning, "subgoals_again", lambda seed, how: [exact] * 6)
    assert max(learning.off_the_intended_way(0, TOLD).values()) < 1e-9
    shown = [exact + rng.normal(0, 0.1, exact.shape) for _ in range(6)]
    monkeypatch.setattr(learning, "subgoals_again", lambda seed, how: shown)
    found = learning.off_the_intended_way(0, TOLD)
    assert found["off_1_m"] > found["off_2_m"] > found["off_5_m"]


def test_an_error_that_falls_by_the_root_has_that_exponent():
    """What is not finite is left out; of one number there is no slope."""
    errors = {n: 0.3 / np.sqrt(n) for n in (1, 2, 5)} | {7: nan}
    assert walked.exponent(errors) == pytest.approx(-0.5)
    assert np.isnan(walked.exponent({3: 0.1, 4: inf}))


# ---- more layouts


def test_one_to_six_layouts_are_learned_from_in_order(monkeypatch):
    """One layout is each of them alone, n are the first n together."""
    monkeypatch.setattr(premises, "task_of", lambda each, how: [each])
    monkeypatch.setattr(premises, "learned", lambda shown, how: list(shown))
    found = premises.tasks_by_number("abc", TOLD, (1, 2, 3))
    assert found == {1: [["a"], ["b"], ["c"]], 2: [["a", "b"]], 3: [["a", "b", "c"]]}


def test_layouts_that_cannot_be_matched_are_left_out(monkeypatch):
    """The mean is of the others; nan, and no number made up, if there is none."""
    kept = SimpleNamespace(environment=None, walks=None)

    def adapted(task, environment, how):
        if task is None:
            raise ValueError("ambiguous")
        return SimpleNamespace(law=task)

    monkeypatch.setattr(premises, "adapted", adapted)
    monkeypatch.setattr(premises, "error_of", lambda law, walks, method: law)
    assert premises.error_in(kept, [0.1, None, 0.3], TOLD) == pytest.approx(0.2)
    assert np.isnan(premises.error_in(kept, [None], TOLD))


@pytest.fixture
def four_layouts(monkeypatch):
    """Slaloms of a seed as if they had been seen without error, of cones that were moved."""

    def slalom(k, seed, how=TOLD):
        rng = np.random.default_rng([seed, k])
        shown = walk_past(rearranged(slalom_scene(), rng, reach=0.1, spacing=0.6), rng)
        shown.demonstration = replace(shown.demonstration, tolerance=how.tolerance)
        return shown

    monkeypatch.setattr(recordings, "slalom", slalom)
    monkeypatch.setattr(premises, "LAYOUTS", 3)


def test_what_is_learned_is_tried_where_nobody_has_shown_anything(four_layouts, monkeypatch):
    """The last layout is in no task; the gain is the error of one layout minus that of all."""
    errors, asked = premises.error_in, []

    def error_in(kept, tasks, how):
        asked.extend((kept, each) for each in tasks)
        return errors(kept, tasks, how)

    monkeypatch.setattr(premises, "error_in", error_in)
    found = premises.layouts(1)
    assert len(asked) == 3 + 1 + 1 + 3 + 1 + 1  # of one, two and three layouts, the paper's and ours
    assert all(kept is not shown for kept, task in asked for shown in task.demonstrations)
    assert found["one_more_than_six_m"] == found["error_1_m"] - found["error_3_m"]
    assert found["refused"] == found["set_aside"] == 0


def test_a_layout_that_is_refused_has_no_error(four_layouts, monkeypatch):
    """It is told as refused; no error is made up, and none of the exponents."""
    monkeypatch.setattr(premises, "error_in", lambda kept, tasks, how: nan)
    found = premises.layouts(1)
    assert found["refused"] == 1
    assert np.isnan([found[name] for name in ("one_more_than_six_m", "exponent", "error_1_m")]).all()


# ---- near the background


def test_the_same_person_walks_six_times_in_one_layout():
    """The first is that of the other claims; no two are alike, and all keep 0.30 m."""
    walks = walked.walks_again(3)
    assert walks[0] is recordings.slalom(0, 3) and len(walks) == 6
    assert len({each.walk.positions.tobytes() for each in walks}) == 6
    assert len({tuple(each.seen.noise) for each in walks}) == 6
    for each in walks:
        assert each.scene is walks[0].scene
        assert walked.room_beside(each.scene, each.walk).min() >= walked.NEAR


def test_walks_near_the_background_are_near_it():
    """A figure-eight for a moment, a straight walk all the way, before the laser and not behind it."""
    scene, walk = walked.eight_near(np.random.default_rng(5))
    assert 0 <= walked.room_beside(scene, walk).min() < walked.NEAR
    scene, walk = walked.straight_near(np.random.default_rng(5))
    room, pose = walked.room_beside(scene, walk), scene.robot.laser_pose
    assert room.min() >= 0 and room.max() < walked.NEAR
    assert (walk.positions[:, 1] > pose[1]).all() and len(scene.objects) == 0


def seen_at(offset, found=True):
    """A recording of who walks along x for 10 s, and an observer whose user is off by so much."""
    t = np.arange(0, 10, 0.1)
    truth = pd.DataFrame({"t": t, "x": t, "y": np.zeros(len(t))})
    truth.loc[:9, "x"] = truth.x[10]  # for a second nobody moves
    user = SimpleNamespace(t=t[: len(t) // 2], positions=truth[["x", "y"]].to_numpy()[: len(t) // 2] + offset)
    observation = SimpleNamespace(user=user if found else None)
    return SimpleNamespace(log=None, truth=truth), lambda *inputs, **choices: observation


@pytest.mark.parametrize(("offset", "found"), [((0.0, 0.3), True), ((0.0, 0.0), True), ((0, 0), False)])
def test_a_user_who_is_not_tracked_is_infinitely_far(offset, found, monkeypatch):
    """Where there is a track its distance counts, elsewhere none; who stands is not asked for."""
    recording, observe = seen_at(np.array(offset), found=found)
    monkeypatch.setattr(premises, "observe", observe)
    monkeypatch.setattr(recordings, "background_map", lambda: None)
    off = premises.off_the_walker(recording, TOLD)
    assert 88 <= len(off) <= 91
    tracked = np.isfinite(off)
    assert np.allclose(off[tracked], offset[1], atol=1e-9)
    assert tracked.sum() == (len(off) - 50 if found else 0)


# ---- what is drawn and thrown away


def test_what_is_counted_is_what_the_slaloms_are_drawn_by():
    """A draw after the other gives the very layouts that the claims use."""
    for k in range(3):
        rng = np.random.default_rng([8, 11, k])

        def slalom(rng=rng):
            def cones():
                return rearranged(slalom_scene(), rng, reach=0.25, spacing=0.6, attempts=1)

            scene = walked.drawn(cones)
            return scene, lab.slalom(scene, rng, **recordings.KEPT)

        scene, walk = walked.drawn(slalom)
        assert np.array_equal(scene.positions, recordings.slalom(k, 8).scene.positions)
        assert np.array_equal(walk.positions, recordings.slalom(k, 8).walk.positions)


def test_one_can_is_moved_as_where_laws_are_compared(monkeypatch):
    """The layouts with a can elsewhere are those of `single`."""
    monkeypatch.setattr(environment, "seen_there", lambda drawn, *_: drawn[0])
    scene = environment.can_moved_seen.__wrapped__(4, TOLD)
    layouts = [tried for k in range(10) if (tried := can_elsewhere([4, 17, k])) is not None]
    assert any(np.array_equal(scene.positions, each) for each in layouts)


def can_elsewhere(seed):
    """Where the cans stand by one draw, None without room."""
    try:
        return walked.one_can_elsewhere(np.random.default_rng(seed)).positions
    except ValueError:
        return None


def test_the_share_of_draws_with_room_is_counted():
    """Every other draw has room: one half; an error of another kind is none of the count's."""
    turns = iter(range(10))

    def every_other():
        if next(turns) % 2:
            raise ValueError("no room")

    assert walked.share_with_room(every_other, 10) == 0.5
    with pytest.raises(StopIteration):
        walked.share_with_room(every_other, 1)


def test_draws_without_end_are_told():
    """Where there is never room, it is said and not waited for."""
    with pytest.raises(RuntimeError, match="nothing with room in 7 draws"):
        walked.drawn(lambda: 1, lambda found: False, most=7)


def test_counting_changes_no_draw():
    """A source of chance that counts gives what numpy's gives."""
    counting = walked.Counting(np.random.default_rng(1).bit_generator)
    there = np.random.default_rng(1)
    for _ in range(3):
        assert np.array_equal(counting.uniform([0, 0], [1, 2]), there.uniform([0, 0], [1, 2]))
    assert counting.draws == 3 and np.random.default_rng(counting) is counting


# ---- the claims themselves


@pytest.mark.parametrize("id", MINE)
def test_what_is_judged_matters_and_what_is_left_open_is_named(id):
    """Every judged number has a smallest difference that matters, where a range begins at it too."""
    claim = CLAIMS[id]
    judged = [each for each in claim.criteria if each.wanted]
    assert 1 <= len(judged) <= 3 and all(each.matters > 0 for each in judged)
    for each in judged:
        assert each.wanted[0] != 0 or each.wanted[1] < inf  # nothing wants "more than nothing"
    assert claim.choices and set(claim.choices) <= set(Reconstruction.__dataclass_fields__)


def test_an_empty_laboratory_holds_a_straight_walk_for_any_laser():
    """The scene is the one whose laser is chosen."""
    noisy = Reconstruction(laser_noise=0.02)
    scene, _ = walked.straight_near(np.random.default_rng(1), noisy)
    assert scene.robot.scanner != Scene().robot.scanner
