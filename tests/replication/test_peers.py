"""Other people's methods: each does what it is known for; the trials, the yardstick and the study keep their word."""

import numpy as np
import pytest

from dollop.environment import Environment
from dollop.lab.tasks import size_of
from dollop.pose import rotation
from dollop.replication import peers
from dollop.trajectory import distance_to_polyline

QUICK = {name: peers.DRAWN[name] for name in ("mean", "walked again")}


@pytest.fixture
def installed():
    """Skip where gmr and movement_primitives are missing."""
    for module in ("gmr", "movement_primitives", "pytransform3d"):
        pytest.importorskip(module, reason="the methods of others need the extra peers")


def between_two_frames(rng):
    """A walk that leaves from one object and comes to another, which it sees from both in the same way each time."""
    places, angles = rng.uniform(-2, 2, (2, 2)) + [[-4, 0], [4, 0]], rng.uniform(-1, 1, 2)
    u = np.linspace(0, 1, 150)[:, None]
    leaving, coming = np.hstack([1.5 * u, u**2]), np.hstack([1.5 * (u - 1), (1 - u) ** 2])
    seen = [place + path @ rotation(a).T for place, path, a in zip(places, (leaving, coming), angles, strict=True)]
    walk = np.concatenate([seen[0], seen[1]])  # the hand-over is a leap: half of the time belongs to each frame
    return walk, Environment(np.hstack([places - 0.1, places + 0.1]), directions=angles)


@pytest.mark.usefixtures("installed")
def test_tp_gmm_recovers_a_task_that_follows_two_frames():
    """Each half is the same as seen from its own frame, which moves and turns: found within 1 % of the size."""
    rng = np.random.default_rng(0)
    shown = [between_two_frames(rng) for _ in range(5)]
    walk, now = between_two_frames(rng)
    found = peers.tp_gmm(*zip(*shown, strict=True), now)
    for half in (walk[:140], walk[160:]):
        assert distance_to_polyline(half, found).mean() < 0.01 * size_of(walk)
    assert distance_to_polyline(walk, peers.mean_walk([walk for walk, _ in shown])).mean() > 0.03 * size_of(walk)


@pytest.mark.usefixtures("installed")
def test_tp_gmm_moves_with_its_frames():
    """Where all objects have moved and turned by the same, so has what it finds."""
    rng = np.random.default_rng(1)
    shown, (_, now) = [between_two_frames(rng) for _ in range(3)], between_two_frames(rng)
    turn, move = rotation(0.7), np.array([3.0, -1.0])
    centres = now.centres @ turn.T + move
    moved = Environment(np.hstack([centres - 0.1, centres + 0.1]), directions=now.directions + 0.7)
    here, there = (peers.tp_gmm(*zip(*shown, strict=True), place, components=(6,)) for place in (now, moved))
    np.testing.assert_allclose(there, here @ turn.T + move, atol=1e-6)


@pytest.mark.usefixtures("installed")
def test_regression_is_that_of_gmr():
    """Means and covariances for all times at once are those that gmr finds for each."""
    from gmr import GMM

    rng = np.random.default_rng(2)
    spread = rng.normal(size=(4, 3, 3))
    mixture = GMM(4, rng.dirichlet(np.ones(4)), rng.normal(size=(4, 3)), spread @ spread.transpose(0, 2, 1) + np.eye(3))
    times = np.linspace(-2, 2, 7)
    means, covariances = peers.regression(mixture, slice(0, 3), times)
    for t, mean, covariance in zip(times, means, covariances, strict=True):
        expected = mixture.condition([0], np.array([t])).to_mvn()
        np.testing.assert_allclose(mean, expected.mean)
        np.testing.assert_allclose(covariance, expected.covariance)


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize(("method", "within"), [(peers.dmp, 0.03), (peers.promp, 1e-6)])
def test_primitives_reach_the_ends_that_they_are_told(method, within, count):
    """A ProMP exactly, a DMP, which comes to rest there, within 3 % of the size; told those shown, along the walk."""
    trial = peers.drawn_trial(3, count=count)
    ends = trial.ends
    found = method(trial.walks, ends)
    np.testing.assert_allclose(found[[0, -1]], ends, atol=within * size_of(trial.way))
    walk = trial.walks[0]
    assert peers.off_way(method([walk], walk[[0, -1]]), walk) < 1.5


def test_trials_grow_by_one_demonstration():
    """More demonstrations are the same ones and more; the layout to come and the truth stay."""
    few, many = peers.drawn_trial(5, count=2), peers.drawn_trial(5, count=7)
    assert len(few.demonstrations) == 2 and len(many.demonstrations) == 7
    assert all(np.array_equal(one, other) for one, other in zip(few.walks, many.walks, strict=False))
    assert np.array_equal(few.way, many.way) and np.array_equal(few.again, many.again)
    assert peers.off_way(few.again, few.way) < 3 < peers.off_way(peers.mean_walk(few.walks), few.way)


def test_learning_by_the_public_calls_is_right_where_nothing_moved():
    """The walk itself, within its tolerance, by either method."""
    trial = peers.drawn_trial(6, count=2, kind="still")
    for method in ("anchored", "paper"):
        found = peers.learned(trial.demonstrations, trial.environment, method)
        assert peers.off_way(found, trial.way) < 3


def test_a_study_is_the_same_with_two_at_once_and_tells_refusals():
    """Every method answers every trial; what refuses counts as infinitely far off, and says why."""

    def refusing(trial):
        raise ValueError("no way")

    asked = {"numbers": (1, 2), "seeds": range(3), "methods": QUICK}
    one, two = (peers.study(**asked, jobs=jobs) for jobs in (1, 2))
    assert one.equals(two) and len(one) == 12
    told = peers.summary(one)
    assert told.loc[("anywhere", 4, "walked again", 2), "median"] < told.loc[("anywhere", 4, "mean", 2), "median"]
    refused = peers.study(numbers=(1,), seeds=range(3), methods={"refusing": refusing})
    assert np.isinf(refused.error).all() and set(refused.refused) == {"no way"}
    assert peers.summary(refused).refused.tolist() == [3]


def test_warping_finds_the_best_of_all_alignments():
    """Of two short paths, by trying all of them: least total distance, told per step."""

    def totals(i, j):
        """(total, steps) of every alignment that ends at places i and j."""
        here = np.linalg.norm(one[i] - other[j])
        before = [(i - a, j - b) for a, b in ((1, 0), (0, 1), (1, 1)) if i >= a and j >= b]
        return [(t + here, n + 1) for pair in before for t, n in totals(*pair)] or [(here, 1)]

    rng = np.random.default_rng(9)
    one, other = rng.normal(size=(5, 2)), rng.normal(size=(4, 2))
    total, steps = min(totals(4, 3))
    assert peers.warped_distance(one, other) == pytest.approx(total / steps)


def test_an_interval_holds_the_median_and_narrows_with_more_values():
    """A bootstrap interval of 400 values is less than half as wide as that of 25."""
    values = np.random.default_rng(7).normal(5, 1, 400)
    (few, low, high), (many, lower, higher) = peers.median_interval(values[:25]), peers.median_interval(values)
    assert low < few < high and lower < many < higher
    assert higher - lower < 0.5 * (high - low)


def test_without_the_extra_the_methods_say_how_to_get_it(monkeypatch):
    """Each names it before anything is worked on."""
    monkeypatch.setattr("dollop.checks.find_spec", lambda name: None)
    trial = peers.drawn_trial(8, count=1)
    for method in ("TP-GMM", "ProMP", "DMP"):
        with pytest.raises(ImportError, match=r"dollop\[peers\]"):
            peers.METHODS[method](trial)
