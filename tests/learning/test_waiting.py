"""Pauses of a demonstrator are part of the task: learned, moved with their objects, kept to the last digit, saved."""

import json

import numpy as np
import pytest
from rooms import CANS, room_map, walk, watched

from dollop import Demonstration, Environment, FormatError, Matching, SequencedLDS, Task, learn, observe
from dollop.lab.tasks import way_through
from dollop.learning.saving import as_dict
from dollop.trajectory import arc_length

BOXES = np.array([[0.0, 0.0, 0.4, 0.4], [3.0, 0.5, 3.4, 0.9], [1.5, 3.0, 1.9, 3.4]])
SAME = Matching.identity(3)
OFFSETS = np.array([[-0.6, -0.6], [0.0, -0.7], [0.7, 0.3], [0.6, 0.3]])
FOLLOWED = np.array([0, 1, 1, 2])
"""Beside which box each of four via-points is, and how far from its middle in m."""
PERIOD, SPEED, SWAY = 0.1, 0.8, 0.01


def moved(seed, by=0.4):
    """The three boxes, each moved by itself."""
    return Environment(BOXES + np.tile(np.random.default_rng(seed).uniform(-by, by, (3, 2)), 2))


def via(environment):
    """Where the via-points are (4, 2)."""
    return environment.centres[FOLLOWED] + OFFSETS


def walked(environment, stops=(), ends=(0.0, 0.0), seed=0):
    """A walk past the boxes that stands at some via-points, (number, seconds), and sways by 1 cm."""
    way, t = way_through(via(environment), samples=600), [0.0]
    reached = [int(np.argmin(np.hypot(*(way - place).T))) for place in via(environment)]
    step = arc_length(way)[-1] / 599 / SPEED
    for k in range(1, 600):
        t.append(t[-1] + step + sum(seconds for number, seconds in stops if reached[number] == k - 1))
    for number, seconds in stops:  # the end of the pause is there as well
        t.append(t[reached[number]] + seconds)
        way = np.vstack([way, way[reached[number]]])
    order = np.argsort(t, kind="stable")
    times = np.arange(-ends[0], max(t) + ends[1], PERIOD)
    walk = np.stack([np.interp(times, np.array(t)[order], column[order]) for column in way.T], axis=1)
    return walk + np.random.default_rng(seed).normal(0, SWAY, walk.shape)


def shown(environment, stops=(), **more):
    return Demonstration(walked(environment, stops, **more), environment)


def waits(law):
    """Where a law waits (P, 2), and how long (P,)."""
    places = np.vstack([law.start, law.subgoals])
    return places[law.pauses > 0], law.pauses[law.pauses > 0]


def test_one_demonstration_waits_where_it_stood():
    """Two pauses, each a subgoal within 3 cm of its place, as long as it was to 0.3 s; no other."""
    places, seconds = waits(learn([shown(moved(0), [(1, 3.0), (2, 8.0)])]).law)
    assert seconds == pytest.approx([3.0, 8.0], abs=0.3)
    assert np.hypot(*(places - via(moved(0))[1:3]).T).max() < 0.03


def test_who_never_stands_has_no_pause_and_no_more_subgoals():
    """A pause adds a subgoal where there was none; the law without it is as it was."""
    passed, paused = (learn([shown(moved(0), stops)]) for stops in ((), [(1, 4.0)]))
    assert not passed.law.pauses.any()
    assert len(passed.law.segments) <= len(paused.law.segments) <= len(passed.law.segments) + 1
    assert paused.errors().max() < 0.02


def test_a_pause_is_as_long_as_the_demonstrations_mean():
    """Of three among boxes that stand elsewhere, 2, 5 and 11 s: 6 s, beside the box that it follows."""
    layouts = [moved(k, by=1.0) for k in range(4)]
    each = zip(layouts, (2.0, 5.0, 11.0), strict=False)
    task = learn([shown(now, [(2, seconds)], seed=k) for k, (now, seconds) in enumerate(each)], matchings=[SAME] * 3)
    for now in layouts:
        places, seconds = waits(task.adapt(now, SAME).law)
        assert seconds == pytest.approx([6.0], abs=0.3)
        assert np.hypot(*(places[0] - via(now)[2])) < 0.1


@pytest.mark.parametrize(("stand", "expected"), [((True, True, False), [4.0]), ((True, False, False), [])])
def test_most_have_the_say_whether_there_is_a_pause(stand, expected):
    """Who does not stand counts as 0 s where half of them do; who stands alone of three is not followed."""
    stops = [[(1, 6.0)] if each else () for each in stand]
    task = learn([shown(moved(0), each, seed=k) for k, each in enumerate(stops)], matchings=[SAME] * 3)
    assert waits(task.law)[1] == pytest.approx(expected, abs=0.3)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("method", ["anchored", "paper"])
@pytest.mark.parametrize("count", [1, 3])
def test_adaptation_keeps_pauses_to_the_last_digit(count, method, turned):
    """Wherever the objects stand then, and back again: the same seconds, in the same order."""
    stops = [[(1, 2.0 + k), (2, 9.0 - k)] for k in range(count)]
    task = learn([shown(moved(k), each, seed=k) for k, each in enumerate(stops)], None, [SAME] * count, method)
    assert len(waits(task.law)[1]) == 2
    for seed in range(5, 8):
        adapted = task.adapt(moved(seed, by=0.8), SAME, turned=turned)
        assert np.array_equal(waits(adapted.law)[1], waits(task.law)[1])


@pytest.mark.parametrize("method", ["anchored", "paper"])
def test_the_papers_method_waits_as_well(method):
    """Three demonstrations, a mean of 4 s, within 10 cm of the place."""
    each = enumerate((3.0, 4.0, 5.0))
    task = learn([shown(moved(0), [(2, s)], seed=k) for k, s in each], None, [SAME] * 3, method)
    places, seconds = waits(task.law)
    assert seconds == pytest.approx([4.0], abs=0.3)
    assert np.hypot(*(places[0] - via(moved(0))[2])) < 0.1


def test_one_way_may_pause_where_the_other_does_not():
    """Three go past the second box and stand there; two go another way and do not."""
    here = moved(0)
    round_it = via(here)
    round_it[1:3] += [[0.0, 2.2], [-0.7, 0.9]]
    other = [way_through(round_it, samples=90) + np.random.default_rng(k).normal(0, SWAY, (90, 2)) for k in range(2)]
    ways = [shown(here, [(1, 4.0)], seed=k) for k in range(3)] + [Demonstration(walk, here) for walk in other]
    task = learn(ways, matchings=[SAME] * 5)
    assert task.shown == (3, 2)
    assert waits(task.ways[0])[1] == pytest.approx([4.0], abs=0.3) and not task.ways[1].pauses.any()


@pytest.mark.parametrize("method", ["anchored", "paper"])
@pytest.mark.parametrize("count", [1, 2])
def test_who_stands_before_and_after_waits_for_the_recording(count, method):
    """5 s before the first step and 9 s after the last are none of the task; 3 s on the way are."""
    here = moved(0)
    both = [shown(here, [(1, 3.0)], ends=(5.0, 9.0), seed=k) for k in range(count)]
    law = learn(both, None, [SAME] * count, method).law
    assert law.pauses[0] == law.pauses[-1] == 0
    assert waits(law)[1] == pytest.approx([3.0], abs=0.3)
    assert SequencedLDS.fit(both[0].trajectory).pauses[[0, -1]] == pytest.approx([5.0, 9.0], abs=0.3)


def test_standing_and_swaying_is_no_way():
    """20 s of swaying by centimetres do not draw the places of the way together: they lie as without it."""
    home = [learn([shown(moved(0), stops)]).learned[0].home for stops in ((), [(1, 20.0)])]
    assert np.hypot(*(home[1] - home[0]).T).max() < 0.1


@pytest.mark.parametrize("method", ["anchored", "paper"])
@pytest.mark.parametrize("count", [1, 3])
def test_pauses_come_back_from_a_file(count, method, tmp_path):
    """The loaded task waits as the saved one does, and so does what is adapted from it."""
    stops = [[(1, 2.0 + k), (2, 9.0 - k)] for k in range(count)]
    task = learn([shown(moved(k), each, seed=k) for k, each in enumerate(stops)], None, [SAME] * count, method)
    task.save(tmp_path / "task.json")
    loaded = Task.load(tmp_path / "task.json")
    assert np.array_equal(loaded.law.pauses, task.law.pauses) and task.law.pauses.any()
    np.testing.assert_allclose(loaded.law.response(), task.law.response(), atol=1e-9)
    now = moved(9)
    assert np.array_equal(loaded.adapt(now, SAME).law.pauses, task.adapt(now, SAME).law.pauses)


@pytest.mark.parametrize("method", ["anchored", "paper"])
def test_without_pauses_files_are_as_they_were(method):
    """No field is new in the file of a task without pauses, so that versions before can read it."""
    content = as_dict(learn([shown(moved(0))], method=method))
    assert not {"pauses", "corners", "profile"} & set(content)
    assert all("pauses" not in way for way in content.get("ways", ()))


def test_a_file_of_a_way_with_its_pauses_in_the_walk_still_loads(tmp_path):
    """As versions before saved it: the walk with all of its samples. Its pause is found."""
    here = moved(0)
    task, walk = learn([shown(here, [(1, 4.0)])]), walked(here, [(1, 4.0)])
    content = json.loads(json.dumps(as_dict(task), default=np.ndarray.tolist))
    [way] = content["ways"]
    del way["pauses"]
    way["walks"], way["shares"] = [walk.tolist()], [np.linspace(0, 79, len(walk)).tolist()]
    (tmp_path / "old.json").write_text(json.dumps(content))
    assert waits(Task.load(tmp_path / "old.json").law)[1] == pytest.approx([4.0], abs=0.3)


def test_who_stands_before_a_laser_is_no_object_and_waits():
    """Watched by a laser for 8 s at one place: a task that waits there, to a second and 10 cm, among the cans alone."""
    there, on = walk([7.0, 2.5], [4.5, 3.5]), walk([4.5, 3.5], [2.0, 2.0])
    way = np.concatenate([there, np.repeat(there[-1:], 80, axis=0), on])
    shown = Demonstration.of(observe(watched(way, CANS), room_map()))
    places, seconds = waits(learn([shown]).law)
    assert seconds == pytest.approx([8.0], abs=1.0) and np.hypot(*(places[0] - [4.5, 3.5])) < 0.1
    assert len(shown.environment) == len(CANS) and shown.notes == ()


@pytest.mark.parametrize(
    ("pauses", "message"),
    [
        ([[10.0, -1.0]], "pauses must be in 0 to"),
        ([[10.0, 2.0], [5.0, 2.0]], "pauses must be in order, at places 0 to 79"),
        ([[90.0, 2.0]], "pauses must be in order, at places 0 to 79"),
        ([[1.0, 2.0, 3.0]], "pauses"),
        ("soon", "pauses"),
    ],
)
def test_pauses_that_cannot_be_are_refused(pauses, message, tmp_path):
    """A file's pauses must be seconds, at places of the way, in order."""
    content = json.loads(json.dumps(as_dict(learn([shown(moved(0))])), default=np.ndarray.tolist))
    content["ways"][0]["pauses"] = pauses
    (tmp_path / "task.json").write_text(json.dumps(content))
    with pytest.raises(FormatError, match=message):
        Task.load(tmp_path / "task.json")
