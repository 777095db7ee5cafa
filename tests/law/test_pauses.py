"""What walks pause at in common: pooled one by one, each with a cut of its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.law.pauses import Pause, Stood, in_common, on_cuts, shown_pauses
from dollop.law.timing import Stands

WAY = 12.0
"""m, and as many places."""


def common(found, walks):
    """The pauses in common of so many walks along 12 m."""
    return in_common(found, lambda at: walks, WAY, WAY)


def test_who_does_not_stand_counts_as_zero_seconds():
    """Two of three stand for 6 and 3 s: the task pauses for 3 s, where they stood on the mean."""
    [pause] = common([Stood(4.0, 6.0, 0), Stood(4.4, 3.0, 2)], 3)
    assert pause.at == pytest.approx(4.2) and pause.seconds == pytest.approx(3.0)


def test_what_less_than_half_of_the_walks_do_is_no_pause():
    """One of two is half of them; one of three is not."""
    found = [Stood(4.0, 6.0, 0)]
    assert len(common(found, 2)) == 1 and not common(found, 3)


def test_two_stands_of_one_walk_are_two_unless_they_are_a_step_apart():
    """1 m apart they stay two, however many walks; 0.4 m apart they are one, and last together."""
    found = [Stood(at + 0.1 * k, 3.0, k) for k in range(3) for at in (4.0, 5.0)]
    assert [round(pause.at, 6) for pause in common(found, 3)] == [4.1, 5.1]
    [pause] = common([Stood(4.0, 3.0, 0), Stood(4.4, 2.0, 0)], 1)
    assert pause.seconds == 5.0


def test_walks_may_slip_along_each_other():
    """By a metre of 12 two walks' stands are one pause; by two metres they are two."""
    assert len(common([Stood(4.0, 3.0, 0), Stood(5.0, 3.0, 1)], 2)) == 1
    assert len(common([Stood(4.0, 3.0, 0), Stood(6.0, 3.0, 1)], 2)) == 2


@given(st.lists(st.tuples(st.floats(0, WAY), st.floats(1, 20), st.integers(0, 4)), max_size=15), st.randoms())
def test_the_order_of_stands_does_not_matter(stands, random):
    """To the last digit; no pause has two stands of one walk, and none lasts longer than all of its stands."""
    found = [Stood(*each) for each in stands]
    shuffled = random.sample(found, len(found))
    pauses = common(found, 5)
    assert pauses == common(shuffled, 5)
    for pause in pauses:
        walks = [each.walk for each in pause.stood]
        assert len(set(walks)) == len(walks)
        assert pause.seconds <= sum(each.seconds for each in pause.stood)
    assert sum(pause.seconds for pause in pauses) <= sum(each.seconds for each in found) / 3 + 1e-9


@given(st.lists(st.floats(0.001, 98.999), max_size=12, unique=True))
def test_every_pause_has_a_cut_of_its_own(places):
    """In order, with room for a segment on either side, and there the candidate is moved to the pause itself."""
    pauses = [Pause(at, 1.0, []) for at in sorted(places)]
    seconds, moved = on_cuts(pauses, 100)
    cuts = sorted(seconds)
    assert len(cuts) == len(places) and (np.diff([0, *cuts, 99]) >= 2).all()
    assert moved[cuts] == pytest.approx(sorted(places))
    assert (np.diff(moved) >= 0).all() and moved[0] == 0 and moved[-1] == 99


def test_without_pauses_no_candidate_moves():
    """And a pause at an end moves none either."""
    seconds, moved = on_cuts([Pause(0.0, 2.0, []), Pause(8.0, 3.0, [])], 9)
    assert seconds == {0: 2.0, 8: 3.0} and (moved == np.arange(9)).all()


def test_more_pauses_than_there_is_room_for_lose_no_second():
    """Five pauses between nine candidates share cuts, and no candidate moves."""
    seconds, moved = on_cuts([Pause(at, 2.0, []) for at in (1.0, 2.0, 3.0, 4.0, 5.0)], 9)
    assert sum(seconds.values()) == 10.0 and (moved == np.arange(9)).all()


def test_known_pauses_stay_apart_however_near():
    """Objects have moved two pauses to 0.2 m of each other: they are two, in each of two walks."""
    walk = np.linspace([0.0, 0.0], [6.0, 0.0], 61)
    stands = [Stands.known(walk, 0.1, [30, 32], np.array([2.0, 5.0]))] * 2
    pauses = shown_pauses(stands, np.tile(np.linspace(0, 1, 61), (2, 1)), 6.0)
    assert [pause.seconds for pause in pauses] == [2.0, 5.0]
    assert [pause.at for pause in pauses] == pytest.approx([30, 32])
