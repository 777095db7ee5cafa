"""The line between subgoals: stable for any data, back to it after a push, round where segments meet."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import any_walks, moving

from dollop.law.line import FADE, Line, lines_of
from dollop.law.timing import turns_at
from dollop.lds import LDS
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import arc_length, distance_to_polyline, resample

places = st.tuples(st.floats(-20, 20), st.floats(-20, 20))


def arc(turn=np.pi / 2, radius=1.3, n=80):
    """A walked arc (n, 2) round the origin, from (radius, 0) on."""
    angle = np.linspace(0, turn, n)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def alone(lds, place, reach=0.01):
    """The response of an LDS alone, by the formula."""
    states = [np.asarray(place, float)]
    while np.linalg.norm(states[-1] - lds.goal) > reach:
        states.append(lds.step(states[-1]))
    return np.array(states)


@settings(max_examples=150, deadline=None)
@given(any_walks, st.booleans(), places, places)
def test_no_offset_grows_whatever_the_data(walks, retimed, origin, start):
    """The theorem: in the Lyapunov norm no step lets the offset grow, and the response arrives."""
    lds = LDS.fit(moving(walks), retimed)
    line = Line.of(lds, np.array(origin), 0.01)
    whole = np.flatnonzero(line.steps == np.round(line.steps))
    at = whole[np.abs(whole - line.nearest(start)).argmin()]
    shown, offsets = line.follow(start, at, 0.01)
    values = lds.lyapunov(lds.goal + offsets)
    rows = np.append(whole[whole >= at], np.arange(len(line.steps), at + len(values))) - at
    assert (np.diff(values[rows]) <= 1e-9 * values[0]).all()
    since = np.searchsorted(rows, np.arange(len(values)), side="right") - 1
    assert (values <= values[rows[since]] + 1e-9 * values[0]).all()
    assert np.array_equal(shown[: len(line.places) - at], line.places[at:])
    assert np.linalg.norm(shown[-1] + offsets[-1] - lds.goal) <= 0.01


@settings(max_examples=60, deadline=None)
@given(any_walks, st.booleans(), places)
def test_every_segment_hands_over_from_any_start(walks, retimed, start):
    """However wild the walks, every segment ends at its subgoal, in finitely many steps."""
    law = SequencedLDS.fit(moving(walks)[0], n_segments=3, retimed=retimed, candidates=14)
    parts = law.responses(start)
    assert len(parts) == 3
    for part, goal in zip(parts, law.subgoals, strict=True):
        assert np.linalg.norm(part[-1] - goal) <= 0.01


def test_far_from_the_line_the_lds_is_alone():
    """Kidnapped by ten times the segment's length, the states are those of the LDS, step by step."""
    lds = LDS.fit(arc())
    line = Line.of(lds, arc()[0], 1e-3)
    start = np.array([25.0, -8.0])
    shown, offsets = line.follow(start, 0, 1e-3)
    whole = line.steps == np.round(line.steps)
    response, expected = (shown + offsets)[: len(line.steps)][whole], lds.response(start, 20)
    np.testing.assert_allclose(response[:20], expected[:20], atol=1e-6)


def test_on_the_line_it_stays():
    """Started where the segment sets out, the response is that of the LDS."""
    lds = LDS.fit(arc())
    line = Line.of(lds, arc()[0], 0.01)
    assert distance_to_polyline(alone(lds, arc()[0]), line.places).max() < 2e-3
    assert not line.follow(arc()[0], 0, 0.01)[1].any()


@pytest.mark.parametrize("push", [0.1, 0.3, -0.3])
def test_an_offset_fades_within_decimetres(push):
    """After a metre of way it is less than a fiftieth, as exp(-1 m / 0.15 m) and a little more."""
    lds = LDS.fit(np.linspace([0.0, 0.0], [4.0, 0.0], 60))
    line = Line.of(lds, np.zeros(2), 0.01)
    at = line.nearest([1.0, push])
    shown, offsets = line.follow([1.0, push], at, 0.01)
    gone = shown[:, 0] - line.places[at, 0]
    assert np.abs(offsets[gone > 1.0]).max() < abs(push) / 50
    held = np.abs(offsets[:, 1]) / abs(push)
    assert (held[gone < 1.0] >= np.exp(-gone[gone < 1.0] / FADE) - 1e-9).all()


def test_pushed_it_comes_back_where_the_paper_does_not():
    """0.5 m aside on straight and curved ways: five times nearer than with the LDS alone."""
    for walk in (np.linspace([0, 0], [3.0, 0], 60), arc(), arc(np.pi / 4, 3.0)):
        law = SequencedLDS.fit(walk)
        middle = walk[len(walk) // 3]
        across = (walk[len(walk) // 3 + 1] - middle) @ [[0, 1], [-1, 0]]
        start = middle + 0.5 * across / np.linalg.norm(across)
        late = [resample(law.response(start, method=each), 100)[30:] for each in ("held", "paper")]
        held, paper = (distance_to_polyline(each, law.response()).mean() for each in late)
        assert held < paper / 5 and held < 0.02


def test_the_papers_response_is_every_lds_alone(one_lap):
    """method="paper" is the old loop, to the last digit."""
    law = SequencedLDS.fit(one_lap)
    states = law.start[None]
    for segment in law.segments:
        states = np.vstack([states, alone(segment, states[-1])[1:]])
    assert np.array_equal(law.response(method="paper"), states)


def test_direction_is_continuous_and_subgoals_are_passed(one_lap):
    """No hand-over turns by more than 10 degrees within 2 dm; the response passes every subgoal."""
    law = SequencedLDS.fit(one_lap)
    lines = law.lines()
    whole, ends = np.vstack([line.places for line in lines]), np.cumsum([line.way[-1] for line in lines])
    assert np.degrees(turns_at(whole, ends[:-1]).max()) < 10
    assert distance_to_polyline(law.subgoals, law.response()).max() < 1e-9
    ways = np.diff(resample(law.response(), 400), axis=0) @ (1, 1j)
    assert np.degrees(np.abs(np.angle(ways[1:-2] / ways[:-3])).max()) < 8


@given(st.floats(-150, 150), st.floats(0.5, 4.0))
def test_two_ways_meet_in_one_direction(turn, length):
    """Two straight segments at any angle: both pass the subgoal in the direction between theirs."""
    away = length * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    ways = np.linspace([-length, 0.0], [0.0, 0.0], 40), np.linspace([0.0, 0.0], away, 40)
    segments = [LDS.fit(way) for way in ways]
    before, after = lines_of(segments, ways[0][0], np.zeros(2, bool), 1e-4)
    assert np.allclose(before.places[-1], 0) and np.allclose(after.places[0], 0)
    assert np.allclose(before.places[0], ways[0][0]) and np.allclose(after.places[-1], away)
    middle = np.radians(turn) / 2
    for step in (before.places[-1] - before.places[-3], after.places[1] - after.places[0]):
        off = np.angle(step @ (1, 1j) * np.exp(-1j * middle))
        assert abs(off) < 0.1 + 0.1 * abs(middle)


def test_a_shown_corner_is_kept():
    """Where a corner was shown the lines are the responses themselves."""
    corner = np.vstack([np.linspace([0, 0], [2, 0], 40), np.linspace([2, 0], [2, 2], 40)[1:]])
    law = SequencedLDS.fit(corner, tolerance=0.01, candidates=81)
    turns = turns_at(law.response(), arc_length(law.response())[[np.argmin(np.hypot(*(law.response() - [2, 0]).T))]])
    assert law.corners.any() and np.degrees(turns.max()) > 60


def test_the_line_scales_and_turns_with_its_segments():
    """Twice as far and turned by a right angle, the lines are so as well."""
    one, other = arc(), arc(-np.pi / 2) + [0.0, 1.3] - [1.3, 0.0]
    segments = [LDS.fit(one), LDS.fit(other)]
    R = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = [LDS(each.turned(np.pi / 2).statistics, 2 * R @ each.goal + 3) for each in segments]
    corners = np.zeros(2, bool)
    here, there = lines_of(segments, one[0], corners, 0.01), lines_of(turned, 2 * R @ one[0] + 3, corners, 0.02)
    for a, b in zip(here, there, strict=True):
        np.testing.assert_allclose(b.places, 2 * a.places @ R.T + 3, atol=1e-9)


def test_a_segment_of_no_way_is_left_alone():
    """A start at the first subgoal leaves nothing to round, and nothing to follow."""
    lds = LDS.fit(arc())
    lines = lines_of([lds, LDS.fit(arc(np.pi))], lds.goal, np.zeros(2, bool), 0.01)
    assert np.isfinite(np.vstack([line.places for line in lines])).all()
    assert lines[0].way[-1] == 0


def test_what_is_no_method_or_segment_is_refused(one_lap):
    """The error names the value and the rule."""
    law = SequencedLDS.fit(one_lap)
    with pytest.raises(ValueError, match="method must be .*got 'held on'"):
        law.response(method="held on")
    with pytest.raises(ValueError, match="segment must be a whole number, 0 to 5, got 6"):
        law.response(segment=6)
