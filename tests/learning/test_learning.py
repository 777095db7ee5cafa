"""Learning as a whole: ways kept apart, parts that take nothing away, what is named, what comes back from a file."""

import json

import numpy as np
import pytest

from dollop import Demonstration, Environment, FormatError, Matching, Task, learn
from dollop.environment import Seen
from dollop.trajectory import distance_to_polyline

BOXES = np.array([[0.0, 0.0, 0.4, 0.4], [3.0, 0.5, 3.4, 0.9], [1.5, 3.0, 1.9, 3.4]])
SAME = Matching.identity(3)


def moved(seed, by=0.4):
    """The three boxes, each moved by itself."""
    return Environment(BOXES + np.tile(np.random.default_rng(seed).uniform(-by, by, (3, 2)), 2))


def shown(environment, side=1.0, share=1.0, seed=0):
    """A walk from beside the first box, past the second on one side of it, to beside the third."""
    first, second, third = environment.centres
    via = np.array([first + [-0.6, -0.6], second + [0.0, -0.7 * side], third + [0.6, 0.3]])
    t = np.linspace(0, 1, 150)[:, None]
    a, b, c = via
    control = 2 * b - (a + c) / 2
    walk = (1 - t) ** 2 * a + 2 * t * (1 - t) * control + t**2 * c
    walk = walk + np.random.default_rng(seed).normal(0, 0.03, (3, 2))[[0]] * np.sin(np.pi * t)
    return Demonstration(walk[: round(share * 150)], environment)


def test_each_demonstration_is_what_the_task_does_in_its_environment():
    """`errors`: within the tolerance and the scatter of the walks, for every demonstration."""
    environments = [moved(k) for k in range(4)]
    task = learn([shown(each, seed=k) for k, each in enumerate(environments)], matchings=[SAME] * 4)
    assert task.notes == () and len(task.ways) == 1 and task.shown == (4,)
    assert task.errors().shape == (4,) and task.errors().max() < 0.1


def test_more_demonstrations_are_no_worse():
    """In a new layout, five demonstrations predict the walk better than one."""
    now = moved(50, by=1.0)
    truth = shown(now).walks[0]

    def error(count):
        demonstrations = [shown(moved(k, by=1.0), seed=k) for k in range(count)]
        response = learn(demonstrations, matchings=[SAME] * count).adapt(now, SAME).law.response()
        return distance_to_polyline(truth, response).mean()

    assert error(5) < min(0.1, error(1) / 2)


def test_two_ways_are_both_kept():
    """Three pass the second box on one side, two on the other: two ways, each true to its demonstrations."""
    environments = [moved(k) for k in range(5)]
    sides = [1, -1, 1, -1, 1]
    pairs = enumerate(zip(environments, sides, strict=True))
    task = learn([shown(each, side, seed=k) for k, (each, side) in pairs], matchings=[SAME] * 5)
    assert task.shown == (3, 2) and len(task.ways) == 2
    assert [way.members for way in task.learned] == [(0, 2, 4), (1, 3)]
    assert [note.kind for note in task.notes] == ["ways"] and not task.notes[0].doubt
    assert task.errors().max() < 0.1
    adapted = task.adapt(moved(9), SAME)
    assert len(adapted.ways) == 2 and adapted.law is adapted.ways[0]


@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
@pytest.mark.parametrize("which", [0, 2])
def test_a_demonstration_that_was_cut_short_takes_nothing_away(share, which):
    """Whichever of three it is, the task ends where the others end, and the part is named."""
    demonstrations = [shown(moved(k), share=share if k == which else 1.0, seed=k) for k in range(3)]
    task = learn(demonstrations, matchings=[SAME] * 3)
    end = shown(moved(0)).walks[0][-1]
    assert np.linalg.norm(task.adapt(moved(0), SAME).law.subgoals[-1] - end) < 0.15
    [note] = [each for each in task.notes if each.kind == "part"]
    assert f"demonstration {which} shows only" in note.text and not note.doubt


def test_demonstrations_of_nothing_in_common_are_ways_of_their_own():
    """Three walks in three corners of a room: three ways, and which demonstration is which is told."""
    t = np.linspace(0, 1, 60)[:, None]
    walks = [start + t * along for start, along in (((-3, -3), (2, 0)), ((3, 3), (0, -2)), ((-3, 3), (1, -1)))]
    task = learn([Demonstration(walk, Environment(BOXES)) for walk in np.array(walks, float)])
    assert task.shown == (1, 1, 1)
    assert "the demonstrations 0; 1; 2" in task.notes[-1].text
    assert task.errors().max() < 0.02


def test_a_task_among_no_objects_stays_where_it_is():
    """Shown twice in an empty room: the mean of both, in the world."""
    t = np.linspace(0, 1, 80)[:, None]
    line = np.hstack([4 * t, np.sin(2 * t)])
    task = learn([Demonstration(line, Environment([])), Demonstration(line + 0.1, Environment([]))])
    assert distance_to_polyline(line + 0.05, task.adapt(Environment([])).law.response()).mean() < 0.02
    one = Task.of(Demonstration(line, Environment([])))
    assert one.association.weights.shape[1] == 0 and one.errors()[0] < 0.02


def test_what_hangs_on_an_object_that_is_gone_is_named():
    """Adapted to a room without the third box: placed by what is left, and in doubt."""
    task = learn([shown(moved(k), seed=k) for k in range(3)], matchings=[SAME] * 3)
    now = Environment(moved(5).boxes[:2])
    adapted = task.adapt(now, Matching.of_partners([0, 1, -1]))
    [note] = adapted.notes
    assert note.kind == "objects" and note.doubt and "[2]" in note.text
    assert np.isfinite(adapted.law.response()).all()


def test_all_of_a_task_comes_back_from_its_file(tmp_path):
    """Ways, directions, what was seen, matchings and notes: the loaded task does what the saved one does."""
    floor = Seen(np.ones((4, 3), bool), (-1.0, -1.0), 2.0)
    first = Environment(BOXES, floor, directions=[0.3, np.nan, -1.0])
    environments = [first, Environment(moved(1).boxes, directions=[0.5, np.nan, -0.8]), moved(2)]
    sides = zip(environments, (1, 1, -1), strict=True)
    task = learn([shown(each, side) for each, side in sides], matchings=[None, SAME, SAME])
    task.save(tmp_path / "task.json")
    loaded = Task.load(tmp_path / "task.json")
    for one, other in zip(task.ways, loaded.ways, strict=True):
        np.testing.assert_allclose(one.response(), other.response(), atol=1e-9)
    np.testing.assert_allclose(loaded.errors(), task.errors(), atol=1e-9)
    np.testing.assert_array_equal(loaded.environment.directions, first.directions)
    assert loaded.environment.seen.at([[0.0, 0.0]]).all() and not loaded.environment.seen.at([[9.0, 0.0]]).any()
    assert loaded.notes == task.notes and loaded.shown == task.shown
    now = moved(7)
    np.testing.assert_allclose(loaded.adapt(now, SAME).law.response(), task.adapt(now, SAME).law.response(), atol=1e-9)


def test_numbers_that_contradict_each_other_are_refused(tmp_path):
    """A goal far from where the association has it, in a file of version 1."""
    task = Task.of(shown(Environment(BOXES)), method="paper")
    task.save(tmp_path / "two.json")
    content = json.loads((tmp_path / "two.json").read_text())
    old = {name: content[name] for name in ("format", "start", "speeds", "segments", "association")}
    boxes = content["environment"]["boxes"]
    demonstrations = [
        {"walks": each["walks"], "boxes": boxes, "sample_period": 0.1, "tolerance": 0.02}
        for each in content["demonstrations"]
    ]
    old |= {"version": 1, "boxes": boxes, "demonstrations": demonstrations}
    (tmp_path / "one.json").write_text(json.dumps(old))
    np.testing.assert_allclose(Task.load(tmp_path / "one.json").law.response(), task.law.response(), atol=1e-9)
    old["segments"][-1]["goal"] = [900.0, 0.0]
    (tmp_path / "one.json").write_text(json.dumps(old))
    with pytest.raises(FormatError, match=r"place . of the law is at \[900.0, 0.0\], but its association puts it at"):
        Task.load(tmp_path / "one.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda way: way["weights"][0].__setitem__(0, 0.7), "must sum to 1"),
        (lambda way: way["weights"][0].__setitem__(0, 1e308), r"ways\[0\]: weights must be in -1 to 2"),
        (lambda way: way.update(members=[0, 9]), "members must be below 2, the number of demonstrations, got"),
        (lambda way: way.update(objects=way["objects"][:-1] + [0]), "must be the world"),
        (lambda way: way["shares"][0].__setitem__(3, 78.0), "shares must rise"),
        (lambda way: way.update(tolerance=-1), "tolerance must be in 1e-06"),
        (lambda way: way["home"].pop(), "shares must be in 0 to 78"),
        (lambda way: way.pop("home"), r"ways\[0\]: a way lacks home$"),
        (lambda way: way.update(shares=3), "shares must be several, got 3"),
        (lambda way: way["shares"][0].pop(), "shares must have shape"),
        (lambda way: way.update(turning=2), "turning must have shape"),
    ],
)
def test_a_damaged_way_is_a_format_error(tmp_path, change, message):
    """Each number of a way is held against the others."""
    learn([shown(moved(k)) for k in range(2)], matchings=[SAME] * 2).save(tmp_path / "task.json")
    content = json.loads((tmp_path / "task.json").read_text())
    change(content["ways"][0])
    (tmp_path / "task.json").write_text(json.dumps(content))
    with pytest.raises(FormatError, match=message):
        Task.load(tmp_path / "task.json")
