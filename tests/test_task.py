"""Sec. IV-B and V: tasks adapt to moved objects, are learned from several demonstrations, saved and loaded."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dollop import Demonstration, Environment, FormatError, Matching, Task, learn, match
from dollop.checks import Note
from dollop.laps import cut_laps
from dollop.learning.paper import anchors, members_along
from dollop.learning.saving import as_dict

CANS = np.array([[2.3, 3.4, 2.7, 3.8], [6.3, 3.4, 6.7, 3.8]])
THREE = np.vstack([CANS, [4.0, 1.0, 4.4, 1.4]])


def eight(shift=(0.0, 0.0), size=1.0, noise=0.0, seed=0):
    """A figure-eight round the cans, 160 points."""
    angle = np.linspace(0, 2 * np.pi, 160)
    path = np.stack([3.2 * np.sin(angle), 1.3 * np.sin(2 * angle)], axis=1)
    wave = np.sin(np.arange(1, 5)[:, None] * angle)
    path = path + noise * (np.random.default_rng(seed).standard_normal((2, 4)) @ wave).T
    return size * path + [4.5, 3.6] + np.asarray(shift)


@pytest.fixture(scope="module")
def task():
    return Task.of(Demonstration(eight(), Environment(CANS)))


def windings(path, boxes):
    """How often a path goes round each box's centre, counter-clockwise."""
    turns = []
    for centre in (boxes[:, :2] + boxes[:, 2:]) / 2:
        offset = path - centre
        angle = np.unwrap(np.arctan2(offset[:, 1], offset[:, 0]))
        turns.append((angle[-1] - angle[0]) / (2 * np.pi))
    return np.round(turns)


@settings(max_examples=25)
@given(st.floats(-3, 3), st.floats(-3, 3))
def test_objects_that_move_together_take_the_task_along(task, dx, dy):
    """All boxes shifted by the same: start, subgoals and response are shifted by it (Sec. IV-B)."""
    adapted = task.adapt(Environment(CANS + [dx, dy, dx, dy]))
    np.testing.assert_allclose(adapted.law.response(), task.law.response() + [dx, dy], atol=1e-9)


def test_objects_moved_there_and_back_move_nothing(task):
    """Adapting to a layout and back to the first gives the first task's law."""
    there = task.adapt(Environment(CANS + [[0.4, -0.3] * 2, [-0.2, 0.6] * 2]))
    back = there.adapt(Environment(CANS))
    np.testing.assert_allclose(anchors(back.law), anchors(task.law), atol=1e-12)
    assert np.abs(anchors(there.law) - anchors(task.law)).max() > 0.2


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("moves", [[[0.5, 0.6], [-0.5, -0.6]], [[-0.3, -0.5], [0.4, -0.5]], [[0.6, 0.0], [-0.4, 0.0]]])
def test_a_figure_eight_stays_one(task, moves, turned):
    """Round both cans in the demonstrated sense, wherever they stand now (Fig. 10)."""
    boxes = CANS + np.tile(moves, 2)
    adapted = task.adapt(Environment(boxes), turned=turned)
    np.testing.assert_array_equal(windings(adapted.law.response(), boxes), windings(task.law.response(), CANS))


def test_turned_laws_turn_with_the_layout():
    """A layout turned as a whole turns subgoals and response with it; the plain law keeps its old directions."""
    c, s = np.cos(0.6), np.sin(0.6)
    R = np.array([[c, -s], [s, c]])
    task = Task.of(Demonstration(eight(), Environment(THREE)))
    centres = (THREE[:, :2] + THREE[:, 2:]) / 2
    turned = (centres - 4) @ R.T + 4
    moved = Environment(np.hstack([turned - 0.2, turned + 0.2]))
    expected = (task.law.response() - 4) @ R.T + 4
    error = [
        np.abs(
            task.adapt(moved, Matching.of_partners([0, 1, 2], 0.6), turned=kind).law.response(start=expected[0])[:200]
            - expected[:200]
        ).max()
        for kind in (True, False)
    ]
    assert error[0] < 0.25 and error[1] > 3 * error[0]


def test_turned_subgoals_turn_the_response(task):
    """Start and all subgoals turned about a place: so is the response, if every LDS is turned with them."""
    R = np.array([[np.cos(2.5), -np.sin(2.5)], [np.sin(2.5), np.cos(2.5)]])
    turned = task.law.with_subgoals(task.law.subgoals @ R.T, task.law.start @ R.T, turned=True)
    np.testing.assert_allclose(turned.response(), task.law.response() @ R.T, atol=1e-9)


def test_by_default_no_law_is_turned(task):
    """Adapted as the paper does it, every LDS keeps its matrix, however the cans moved; turned ones do not."""
    boxes = Environment(CANS + np.tile([[0.0, 0.5], [0.0, -0.5]], 2))
    task = Task.of(task.demonstrations[0], method="paper")
    plain, turned = task.adapt(boxes), task.adapt(boxes, turned=True)
    assert all((a.A == b.A).all() for a, b in zip(plain.law.segments, task.law.segments, strict=True))
    assert max(np.abs(a.A - b.A).max() for a, b in zip(turned.law.segments, task.law.segments, strict=True)) > 0.01


def test_a_can_that_is_gone_does_not_stop_the_task():
    """With one of three objects missing, the subgoals follow those that are left."""
    task = Task.of(Demonstration(eight(), Environment(THREE)))
    adapted = task.adapt(Environment(THREE[[0, 2]] + 0.2))
    assert np.isfinite(adapted.law.response()).all()
    near_first = np.linalg.norm(task.law.subgoals - [2.5, 3.6], axis=1).argmin()
    np.testing.assert_allclose(adapted.law.subgoals[near_first], task.law.subgoals[near_first] + 0.2, atol=0.05)


def test_an_ambiguous_scene_is_reported(task):
    """Two cans turned by a right angle could be either: an error with the probabilities, not a guess."""
    turned = Environment([[4.3, 1.4, 4.7, 1.8], [4.3, 5.4, 4.7, 5.8]])
    with pytest.raises(ValueError, match=r"cannot be matched with confidence: 0 to . .(49|50) %; to . (49|50) %"):
        task.adapt(turned)


def test_objects_that_stand_where_they_stood_are_the_same():
    """Two boxes so near together that each could be the other: where none has moved, nothing is in doubt."""
    near = Environment([[2.3, 3.4, 2.4, 3.5], [2.5, 3.4, 2.6, 3.5]])
    task = Task.of(Demonstration(eight(), near))
    assert not match(near, Environment(near.boxes + [0.1, 0, 0.1, 0])).confident
    np.testing.assert_allclose(anchors(task.adapt(near).law), anchors(task.law), atol=1e-12)


def test_saved_and_loaded_it_is_the_same_task(task, tmp_path):
    """A task comes back from JSON with the same law, and adapts the same."""
    task.save(tmp_path / "eight.json")
    loaded = Task.load(tmp_path / "eight.json")
    np.testing.assert_allclose(loaded.law.response(), task.law.response(), rtol=1e-12)
    moved = Environment(CANS + 0.3)
    np.testing.assert_allclose(loaded.adapt(moved).law.subgoals, task.adapt(moved).law.subgoals, rtol=1e-12)


def damaged(change):
    def damage(content):
        content = json.loads(json.dumps(content))
        change(content)
        return json.dumps(content)

    return damage


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda content: json.dumps(content)[:500], "not a task"),
        (lambda content: "[]", "format must be"),
        (lambda content: "", "empty"),
        (damaged(lambda c: c.update(version=99)), "version must be 1 or 2, got 99"),
        (damaged(lambda c: c.pop("segments")), "bad.json: a task lacks segments$"),
        (damaged(lambda c: c.update(colour=1)), "bad.json: a task cannot have colour$"),
        (damaged(lambda c: c["association"].pop("weights")), "association: an association lacks weights$"),
        (damaged(lambda c: c["demonstrations"][0].pop("tolerance")), r"demonstrations\[0\]: a demonstration lacks tol"),
        (
            damaged(lambda c: c["demonstrations"][0].update(tolerance=[])),
            r"tolerance must be a finite number, got \[\]",
        ),
        (
            damaged(lambda c: c["demonstrations"][0].update(walks=7)),
            r"demonstrations\[0\]: walks must be a list, got 7",
        ),
        (damaged(lambda c: c["demonstrations"][0].update(notes=[["a", "b", 1]])), r"notes\[0\]: a note must be kind"),
        (damaged(lambda c: c["association"]["weights"][0].__setitem__(0, 1e308)), "weights must be in 0 to 1, got .1e"),
        (damaged(lambda c: c["association"]["weights"][0].__setitem__(0, 0.999)), "weights .* sum to 1 at most, got"),
        (
            damaged(lambda c: c["association"]["corners"][0].__setitem__(0, 1.9)),
            "corners must be whole numbers, got 1.9",
        ),
        (damaged(lambda c: c["association"]["corners"][0].__setitem__(0, True)), "corners must be numbers in rows"),
        (damaged(lambda c: c["start"].__setitem__(0, 10**400)), "a number must be finite, .*, got 1000"),
        (
            lambda content: json.dumps(content | {"version": 0}).replace(": 0,", ": 1" + "0" * 5000 + ",", 1),
            "a number must be finite, .*, got 1000",
        ),
        (damaged(lambda c: c["start"].__setitem__(0, float("nan"))), "a number must be finite, .*, got NaN"),
        (
            lambda content: json.dumps(content)[:-1] + ', "start": [0, 0]}',
            "a name must be given once, got 'start' again",
        ),
        (damaged(lambda c: c.update(notes=[["a", "b"]])), "a note must be kind, text and doubt"),
        (damaged(lambda c: c.update(notes=[["a", "b", True]] * 10_001)), "notes must be at most 10000, got 10001"),
        (
            damaged(lambda c: c["environment"].update(seen=1)),
            "environment: seen: what was seen must have floor, .*, got int",
        ),
        (damaged(lambda c: c.update(segments=[])), "number of segments must be positive and finite, got 0"),
        (damaged(lambda c: c["segments"].pop()), r"speeds must have shape \(\d,\), got"),
        (damaged(lambda c: c["segments"][0].update(G0=[[1, 0], [0, 1]], G1=[[2, 0], [0, 2]])), "spectral radius"),
        (
            damaged(lambda c: c.update(environment={"boxes": c["environment"]["boxes"][:1]})),
            "objects must be in -1 to 0, got 1",
        ),
        (damaged(lambda c: c.update(version=True)), "version must be 1 or 2, got True"),
        (damaged(lambda c: c["segments"][0].update(G0=[[1, None], [0, 1]])), "must be numbers"),
        (damaged(lambda c: c["speeds"].__setitem__(0, -1.0)), "speeds must be in .*, got -1"),
        (
            damaged(lambda c: c["association"]["weights"][0].__setitem__(0, -3.0)),
            "association: weights must be in 0 to 1, got .-3",
        ),
        (lambda content: "[" * 100_000, "not a task"),
        (damaged(lambda c: c["association"]["weights"].pop()), r"weights must have shape \(\d, 8\), got"),
        (damaged(lambda c: c.update(start=[None, 1.0])), "must be numbers"),
    ],
)
def test_a_damaged_file_is_a_format_error(task, tmp_path, damage, message):
    """The error names the file and what is wrong with it."""
    Task.of(task.demonstrations[0], method="paper").save(tmp_path / "good.json")
    bad = tmp_path / "bad.json"
    bad.write_text(damage(json.loads((tmp_path / "good.json").read_text())))
    with pytest.raises(FormatError, match=message) as error:
        Task.load(bad)
    assert "bad.json" in str(error.value)


def test_one_demonstration_is_the_task():
    """Learned from one demonstration, the task is that demonstration's law."""
    shown = Demonstration(eight(), Environment(CANS))
    np.testing.assert_allclose(learn([shown]).law.response(), shown.law.response(), atol=1e-9)


def moved_cans(k):
    return CANS + np.tile(np.random.default_rng(100 + k).normal(0, 0.25, (2, 2)), 2)


def demonstrations(n, noise=0.02):
    """The same task shown n times while the cans stand elsewhere: the walk moves with them, never twice the same."""
    shown = Task.of(Demonstration(eight(), Environment(CANS)))
    walks = []
    for k in range(n):
        law = shown.adapt(Environment(moved_cans(k))).law
        wave = np.sin(np.arange(1, 4)[:, None] * np.linspace(0, 2 * np.pi, 160))
        path = np.stack([np.interp(np.linspace(0, 1, 160), *column) for column in by_length(law.response())], axis=1)
        path += noise * (np.random.default_rng(k).standard_normal((2, 3)) @ wave).T
        walks.append(Demonstration(path, Environment(moved_cans(k))))
    return walks


def by_length(path):
    walked = np.append(0.0, np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum())
    return [(walked / walked[-1], column) for column in path.T]


def test_several_demonstrations_share_their_subgoals():
    """Four demonstrations in four environments merge into one chain that adapts to a fifth."""
    task = learn(demonstrations(4))
    path = task.model.most_likely_path()
    assert task.model.outliers() == ()
    assert 5 <= len(path) <= 7
    assert len(task.model.means) < sum(len(s) for s in task.model.sequences) / 2
    boxes = CANS + np.tile([[0.3, -0.3], [-0.2, 0.3]], 2)
    law = task.adapt(Environment(boxes)).law
    np.testing.assert_array_equal(windings(law.response(), boxes), windings(eight(), CANS))


def test_a_demonstration_elsewhere_is_mapped_to_the_first_environment():
    """The same walk round the same cans three metres away teaches the same, and merges with the first (Sec. V)."""
    shift = np.array([3.0, 2.0])
    here = Demonstration(eight(), Environment(CANS))
    task = learn([here, Demonstration(eight(shift), Environment(CANS + [*shift] * 2))])
    first, second = task.model.sequences
    np.testing.assert_allclose(second, first, atol=1e-6)
    assert task.model.outliers() == () and len(task.model.means) == len(first)
    assert here.law.error(task.law.response()) < 0.001


def test_learned_start_speeds_and_laws_are_means_over_the_demonstrations():
    """In one environment: start and speeds are means, and each LDS is that of the added statistics of its edge."""
    walks = [eight(noise=0.02, seed=1), eight((0.12, -0.06), noise=0.02, seed=2)]
    walks[1] = walks[1][::2]  # twice as fast
    demonstrations = [Demonstration(walk, Environment(CANS)) for walk in walks]
    task, laws = learn(demonstrations, method="paper"), [shown.law for shown in demonstrations]
    members = members_along(task.model)
    assert max(len(shared) for shared in members) == 2
    np.testing.assert_allclose(task.law.start, np.mean([walk[0] for walk in walks], axis=0), atol=1e-6)
    for segment, speed, shared in zip(task.law.segments, task.law.speeds, members, strict=True):
        assert speed == pytest.approx(np.mean([laws[d].speeds[i] for d, i in shared]))
        G0, G1 = (sum(getattr(laws[d].segments[i].statistics, name) for d, i in shared) for name in ("G0", "G1"))
        np.testing.assert_allclose(segment.statistics.G0, G0)
        np.testing.assert_allclose(segment.statistics.G1, G1)
    ends = [np.mean([laws[d].subgoals[i] for d, i in shared], axis=0) for shared in members]
    np.testing.assert_allclose(task.law.subgoals, ends, atol=0.01)


def test_a_demonstration_without_one_of_the_cans_still_teaches():
    """Of three cans the second demonstration lacks one: the task learned from both still goes along with all three."""
    shown = Task.of(Demonstration(eight(), Environment(THREE)))
    boxes = THREE[:2] + np.tile([[0.3, 0.1], [-0.1, 0.2]], 2)
    walk = shown.adapt(Environment(boxes)).law.response()
    task = learn([Demonstration(eight(), Environment(THREE)), Demonstration(walk, Environment(boxes))])
    assert task.model.outliers() == () and len(task.environment) == 3
    assert np.isfinite(task.association.weights).all()
    np.testing.assert_allclose(task.association.weights.sum(axis=1), 1, atol=1e-4)
    assert np.linalg.norm(task.law.subgoals[-1] - eight()[-1]) < 0.1
    moved = task.adapt(Environment(THREE + 0.2))
    np.testing.assert_allclose(moved.law.subgoals, task.law.subgoals + 0.2, atol=1e-6)


def test_a_wrong_demonstration_does_not_drag_the_others():
    """Something else among three demonstrations keeps its own branch and is reported (Sec. V)."""
    right = demonstrations(3)
    angle = np.linspace(0, 2 * np.pi, 120)
    wrong = Demonstration(np.stack([4.5 + 3 * np.cos(angle), 1.0 + 0.6 * np.sin(angle)], axis=1), Environment(CANS))
    alone, task = learn(right), learn([*right, wrong])
    assert task.model.outliers() == (3,)
    np.testing.assert_allclose(task.law.subgoals, alone.law.subgoals, atol=0.02)


def test_one_more_demonstration_can_be_added(tmp_path):
    """Adding one by one is learning from all, also after saving and loading, and where the objects have moved."""
    shown = [Demonstration(eight(0.05 * k), Environment(CANS)) for k in range(3)]
    task = Task.of(shown[0]).add(shown[1])
    task.save(tmp_path / "task.json")
    added, learned = Task.load(tmp_path / "task.json").add(shown[2]), learn(shown)
    np.testing.assert_allclose(added.law.subgoals, learned.law.subgoals, atol=1e-9)
    assert len(added.demonstrations) == 3
    moved = Environment(CANS + [0.3, 0.1, 0.3, 0.1])
    np.testing.assert_allclose(
        task.adapt(moved).add(shown[2]).law.subgoals, learned.law.subgoals + [0.3, 0.1], atol=1e-6
    )


def observed(turns, notes=None):
    """What an observation holds of a user who walked so many figure-eights, and what it notes, if it can."""
    path, n = np.tile(eight()[:-1], (4, 1))[: int(159 * turns)], int(159 * turns)
    user = SimpleNamespace(t=0.1 * np.arange(n), positions=path)
    told = {} if notes is None else {"notes": notes}
    return SimpleNamespace(user=user, environment=Environment(CANS), **told)


@pytest.mark.parametrize("notes", [None, (), (Note("map", "the map may be another room's"),)])
def test_a_demonstration_tells_what_was_dropped(notes):
    """It carries the notes of its observation, and one more where half a lap of two and a half is in no lap."""
    carried = notes or ()
    assert Demonstration.of(observed(2.02, notes)).notes == carried
    *before, last = Demonstration.of(observed(2.5, notes)).notes
    assert tuple(before) == carried
    assert (last.kind, last.doubt) == ("laps", True) and "20%" in last.text


def test_a_last_lap_that_ends_early_is_left_out_and_named():
    """As long as the others, but wider, it ends before them: the law is that of the others alone."""
    lap = eight()
    wider = lap[0] + 1.07 * (lap - lap[0])
    path = np.vstack([np.tile(lap[:-1], (4, 1)), wider])[:-6]
    user = SimpleNamespace(t=0.1 * np.arange(len(path)), positions=path)
    shown = Demonstration.of(SimpleNamespace(user=user, environment=Environment(CANS)))
    (note,) = shown.notes
    assert len(shown.walks) == 4 and len(cut_laps(user.t, path).laps) == 5
    assert (note.kind, note.doubt) == ("laps", False) and "[4] are left out" in note.text
    np.testing.assert_allclose(shown.law.subgoals[-1], shown.walks[0][0], atol=0.05)


def test_a_task_tells_what_its_demonstrations_told(tmp_path):
    """Once each, adapted or added to, saved and loaded."""
    one, other = Demonstration.of(observed(2.5)), Demonstration.of(observed(3.5))
    task = learn([one, other, one])
    doubts = tuple(note for note in task.notes if note.doubt)
    assert doubts == (*one.notes, *other.notes) and len(doubts) == 2
    assert Task.of(one).notes == task.adapt(Environment(CANS + 0.3)).notes[:1] == one.notes
    assert Task.of(one).add(other).notes[:2] == task.notes[:2]
    task.save(tmp_path / "task.json")
    assert Task.load(tmp_path / "task.json").notes == task.notes
    assert Task.of(Demonstration(eight(), Environment(CANS))).notes == ()


def test_speeds_are_those_of_the_clock():
    """A laser of half the rate sees the same speed: every second sample, twice the period."""
    speeds = [Demonstration(eight()[::step], Environment(CANS), 0.1 * step).law.speeds.mean() for step in (1, 2)]
    assert speeds[1] == pytest.approx(speeds[0], rel=0.03)


def test_what_cannot_be_segmented_is_named():
    """The error says which demonstration cannot keep its tolerance; with a larger one it can."""
    rough = eight() + np.random.default_rng(0).normal(0, 0.3, eight().shape)
    with pytest.raises(ValueError, match="demonstration 1: tolerance 0.02 m cannot be kept"):
        learn([Demonstration(eight(), Environment(CANS)), Demonstration(rough, Environment(CANS))])
    assert Demonstration(rough, Environment(CANS), tolerance=0.5).law.segments
    with pytest.raises(ValueError, match="must be finite"):
        Demonstration(eight() * np.nan, Environment(CANS))


def test_no_objects_are_no_place_to_learn_in():
    """An environment without the demonstration's objects is refused, not replaced by the demonstration's."""
    with pytest.raises(ValueError, match="must have an object in common, or have none, got 2 and 0"):
        learn([Demonstration(eight(), Environment(CANS))], Environment([]))


def test_nothing_to_learn_from():
    """No demonstration is an error; so is one that could be either way round, where it is the only one."""
    with pytest.raises(ValueError, match="at least one demonstration"):
        learn([])
    turned = Environment([[4.3, 1.4, 4.7, 1.8], [4.3, 5.4, 4.7, 5.8]])
    with pytest.raises(ValueError, match="no demonstration can be learned from: demonstration 0 and .* confidence"):
        learn([Demonstration(eight(), turned)], Environment(CANS))


def test_what_is_saved_can_be_loaded(tmp_path):
    """Also a walk at a hundred samples a second; more than is read is refused before it is written."""
    long = np.column_stack([np.linspace(0, 4, 25_000), np.sin(np.linspace(0, 3, 25_000))])
    task = learn([Demonstration(long, Environment(CANS), sample_period=0.01)])
    task.save(tmp_path / "a.json")
    assert len(Task.load(tmp_path / "a.json").demonstrations[0].walks[0]) == 25_000
    with pytest.raises(ValueError, match="demonstrations must be at most 10000, got 10001"):
        as_dict(SimpleNamespace(demonstrations=range(10_001), ways=(), notes=()))


@pytest.mark.parametrize("method", ["anchored", "paper"])
def test_a_turned_task_is_saved_as_it_is(method, tmp_path):
    """With its turn; and a layout that turns there and back turns nothing."""
    boxes = np.array([[0, 0, 0.4, 0.4], [4, 0, 4.8, 0.4]])
    angle = np.linspace(0, np.pi, 50)
    walk = np.column_stack([2 + np.cos(angle), 1 + np.sin(angle)])
    task = learn([Demonstration(walk, Environment(boxes))], method=method)
    there = Environment([[0, 0, 0.4, 0.4], [0, 4, 0.4, 4.8]])
    turned = task.adapt(there, Matching.of_partners([0, 1]), turned=True)
    assert np.abs(turned.law.subgoals - task.adapt(there, Matching.of_partners([0, 1])).law.subgoals).max() > 0.1
    turned.save(tmp_path / "a.json")
    again = Task.load(tmp_path / "a.json")
    np.testing.assert_allclose(again.law.subgoals, turned.law.subgoals, atol=1e-9)
    for each in (turned, again):
        back = each.adapt(Environment(boxes), Matching.of_partners([0, 1]), turned=True)
        np.testing.assert_allclose(back.law.subgoals, task.law.subgoals, atol=1e-6)


def test_every_demonstration_goes_a_way_or_is_set_aside():
    """A task whose ways are not those of one of its demonstrations contradicts itself."""
    task = learn([Demonstration(eight(), Environment(CANS))])
    with pytest.raises(ValueError, match="must go one of the ways or be set aside, got number 1"):
        replace(task, demonstrations=2 * task.demonstrations, partners=2 * task.partners)


@pytest.mark.parametrize("method", ["anchored", "paper"])
def test_a_demonstration_that_cannot_be_matched_is_set_aside(method):
    """It is named, with the threshold and how to give the matching; the others teach as if it were not there."""
    turned = Environment([[4.3, 1.4, 4.7, 1.8], [4.3, 5.4, 4.7, 5.8]])
    right, lost = Demonstration(eight(), Environment(CANS)), Demonstration(eight(), turned)
    task = learn([right, lost], method=method)
    np.testing.assert_allclose(task.law.response(), learn([right], method=method).law.response(), atol=1e-9)
    [note] = task.notes
    assert note.kind == "set aside" and "demonstration 1" in note.text
    assert "95 %" in note.text and "matchings=" in note.text
    given = learn([right, lost], matchings=[None, Matching.of_partners([0, 1])], method=method)
    assert not [each for each in given.notes if each.kind == "set aside"]


@pytest.mark.parametrize(
    ("matchings", "message"),
    [
        ([None], "one for each of 2 demonstrations, got 1"),
        ([None, "mine"], "must be a Matching, got 'mine'"),
        ([None, Matching.identity(3)], "must go from the 8 corners of demonstration 1 .* got 12 indices"),
    ],
)
def test_matchings_that_do_not_belong_are_refused(matchings, message):
    """Their number, what they are, and where they go."""
    with pytest.raises(ValueError, match=message):
        learn([Demonstration(eight(), Environment(CANS))] * 2, matchings=matchings)
