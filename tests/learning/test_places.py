"""Places tied to objects: what each follows is told from the evidence of several demonstrations."""

from itertools import product

import numpy as np
import pytest

from dollop.environment import Environment
from dollop.learning import places
from dollop.learning.frames import frames_like, frames_of
from dollop.learning.places import candidates, chain, steps, tied_places

CORNERS = np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]])


def environment(centres, directions=None):
    """Boxes of 0.4 m at centres (N, 2)."""
    return Environment(np.hstack([centres - 0.2, centres + 0.2]), directions=directions)


def frames_at(centres, directions=None):
    """The frames of N objects in D layouts (D, N, 2)."""
    count, n = centres.shape[:2]
    directions = [None] * count if directions is None else directions
    stood = [environment(*each) for each in zip(centres, directions, strict=True)]
    return frames_of(stood, [np.arange(n)] * count, np.tile(CORNERS, (n, 1, 1)))


def layouts(count, n, seed):
    return np.random.default_rng(seed).uniform(-3, 3, (count, n, 2))


def test_what_is_seen_from_a_frame_lies_where_it_was_seen():
    """Seen from every frame, turning ones and the world included, and put back: the same points."""
    rng = np.random.default_rng(0)
    frames = frames_at(layouts(3, 2, 0), rng.uniform(-3, 3, (3, 2)))
    points = rng.normal(size=(3, 5, 2))
    assert len(frames) == 2 + 2 + 1
    again = frames.back(frames.seen(points))
    np.testing.assert_allclose(again, np.broadcast_to(points[:, :, None], again.shape), atol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 8])
@pytest.mark.parametrize("count", [2, 3, 5])
def test_the_object_that_is_followed_is_found(n, count):
    """Places at a fixed offset from one of n objects anywhere: from two demonstrations on, that one has the weight."""
    centres = layouts(count, n, seed=n)
    rng = np.random.default_rng(1)
    offsets = rng.uniform(-0.6, 0.6, (1, 12, 2))
    points = centres[:, -1:] + offsets + rng.normal(0, 0.03, (count, 12, 2))
    places = tied_places(points, np.ones((count, 12), bool), frames_at(centres))
    assert places.weights[:, n - 1].min() > 0.8
    new = layouts(1, n, seed=99)
    found = places.among(frames_at(new))[0]
    assert np.linalg.norm(found - new[0, -1] - offsets[0], axis=1).max() < 0.5


def test_what_follows_the_world_does_not_follow_the_objects():
    """The walk stays where it is although all objects have moved: so does the task."""
    centres = layouts(3, 3, 4)
    points = np.tile(np.linspace([-2.0, 0.0], [2.0, 1.0], 20), (3, 1, 1))
    places = tied_places(points, np.ones((3, 20), bool), frames_at(centres))
    np.testing.assert_allclose(places.among(frames_at(layouts(1, 3, 7)))[0], points[0], atol=0.1)


def test_one_demonstration_tells_closeness_alone():
    """Near one object, a place follows that one; of equally near ones, both alike (the paper's weights)."""
    centres = np.array([[[-2.0, 0.0], [2.0, 0.0]]])
    points = np.array([[[-2.0, 0.5], [0.0, 0.0]]])
    weights = tied_places(points, np.ones((1, 2), bool), frames_at(centres)).weights
    assert weights[0, 0] > 0.9
    np.testing.assert_allclose(weights[1], [0.5, 0.5, 0.0], atol=1e-9)


def test_an_object_that_faces_elsewhere_takes_its_places_round():
    """Where directions are known, places turn with the object that they follow."""
    rng = np.random.default_rng(3)
    centres, directions = layouts(4, 2, 3), rng.uniform(-3, 3, (4, 2))
    local = rng.uniform(0.3, 0.8, (10, 2))
    c, s = np.cos(directions[:, 0]), np.sin(directions[:, 0])
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    points = centres[:, :1] + np.einsum("dij,lj->dli", turn, local)
    places = tied_places(points[:3], np.ones((3, 10), bool), frames_at(centres[:3], directions[:3]))
    found = places.among(frames_at(centres[3:], directions[3:]))[0]
    np.testing.assert_allclose(found, points[3], atol=0.15)


def test_the_chain_is_what_summing_over_all_sequences_gives():
    """Posterior of every place, against brute force over all sequences of candidates."""
    frames = frames_at(layouts(2, 2, 5))
    weights = candidates(frames, True)
    logarithms = np.random.default_rng(0).normal(0, 2, (3, len(weights)))
    step, total = steps(weights), np.zeros(logarithms.shape)
    for sequence in product(range(len(weights)), repeat=3):
        share = np.exp(logarithms[range(3), sequence].sum()) * step[sequence[0], sequence[1]] * step[sequence[1:]]
        total[range(3), sequence] += share
    np.testing.assert_allclose(chain(logarithms, weights), total / total.sum(axis=1, keepdims=True), rtol=1e-9)


def test_what_is_gone_leaves_its_weight_to_the_others():
    """Of two objects that both tell a place, one is enough; where neither is there, it is nowhere."""
    centres = layouts(1, 2, 6)
    places = tied_places(np.zeros((1, 4, 2)), np.ones((1, 4), bool), frames_at(centres))
    frames = frames_at(centres)
    alone = frames_like(frames.objects, frames.turning, environment(centres[0, :1]), np.array([0]))
    np.testing.assert_allclose(places.among(alone)[0], 0, atol=1e-9)


def test_of_many_objects_only_pairs_near_the_way_are_candidates(monkeypatch):
    """What lies far from all that was shown is left out, and nothing else; every object alone remains."""
    low = np.array([[0.0, 1.0], [40.0, 40.0], [2.0, 1.0], [4.0, 1.0], [-50.0, 3.0]])
    environments = [Environment(np.hstack([low + shift, low + shift + 0.4])) for shift in (0.0, 0.3)]
    corners = environments[0].corners.reshape(-1, 4, 2) - environments[0].centres[:, None]
    frames = frames_of(environments, [np.arange(5)] * 2, corners)
    ways = [np.linspace([0.0, 0.0], [4.0, 0.0], 20)] * 2
    every = candidates(frames, True, ways)
    alone = len(frames)
    monkeypatch.setattr(places, "MOST_PAIRS", 3)
    few = candidates(frames, True, ways)
    assert len(every) == alone + 3 * 10 and len(few) == alone + 3 * 3
    assert np.array_equal(few[:alone], every[:alone])
    assert set(np.flatnonzero(few[alone:].any(axis=0))) == {0, 2, 3}


def test_objects_without_a_frame_are_passed_over():
    """A way that follows fewer objects than stand there asks nothing of the others."""
    environment = Environment([[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4], [2, 3, 2.4, 3.4]])
    found = frames_like(np.array([0, -1]), np.zeros(2, bool), environment, np.array([1, 0, 2]))
    np.testing.assert_allclose(found.origins[0], [[4.2, 0.2], [0.0, 0.0]])
