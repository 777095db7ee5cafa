"""Kept runs: as they were driven, and only for the code that drove them."""

import numpy as np
import pytest

from dollop.checks import Note
from dollop.replication import figures
from dollop.replication.figures import controls, kept
from dollop.robot.run import Run


def run(n=5, **more):
    """A run of n periods."""
    t = 0.1 * np.arange(n)
    poses = np.linspace((0.0, 0.0, 0.0), (1.0, 2.0, 0.5), n)
    told = {"active": np.zeros(n, int), "localised": np.ones(n, bool), "clearance": np.full(n, 0.3)}
    return Run(t, poses, poses, **told, finished=True, reason="", collisions=0, kidnapped=np.array([0.2]), **more)


RUNS = {"plain": [run(), run(7)], "own": [[run(done=0.5, notes=(Note("late", "a second", False),))], [run(3)]]}


def both(one, other):
    """Pairs of runs at the same place of nested lists."""
    if isinstance(one, list):
        assert len(one) == len(other)
        for pair in zip(one, other, strict=True):
            yield from both(*pair)
    else:
        yield one, other


def test_what_was_kept_is_what_was_driven(tmp_path):
    """Every field comes back, in lists and in lists of lists, to seven digits; the same runs give the same bytes."""
    kept.write("runs", RUNS, tmp_path)
    first = (tmp_path / "runs.npz").read_bytes()
    again = kept.read("runs", tmp_path)
    assert again.keys() == RUNS.keys()
    for kind, runs in RUNS.items():
        for here, there in both(runs, again[kind]):
            assert np.allclose(here.true_poses, there.true_poses, rtol=1e-6)
            assert np.array_equal(here.t, there.t) and np.array_equal(here.kidnapped, there.kidnapped)
            assert (here.finished, here.notes, here.radius) == (there.finished, there.notes, there.radius)
            assert here.done == there.done or np.isnan(here.done) and np.isnan(there.done)
    kept.write("runs", RUNS, tmp_path)
    assert (tmp_path / "runs.npz").read_bytes() == first


def test_runs_of_other_code_are_driven_anew(tmp_path, monkeypatch):
    """What another program drove is not believed, nor what is not there."""
    kept.write("runs", RUNS, tmp_path)
    monkeypatch.setattr(kept, "fingerprint", lambda name: "another code")
    assert kept.read("runs", tmp_path) is None and kept.read("none", tmp_path) is None


@pytest.mark.parametrize(("how", "driven"), [("read", 0), ("driven", 1), ("kept", 1)])
def test_runs_are_driven_unless_they_may_be_read(tmp_path, monkeypatch, how, driven):
    """Read where a notebook shows them, driven where a figure is made; it alone keeps them."""
    monkeypatch.setattr(kept, "read", lambda name: RUNS)
    written, calls = [], []
    monkeypatch.setattr(kept, "write", lambda name, runs: written.append(name))
    with kept.handled(how):
        kept.keep("runs", lambda: calls.append(1) or RUNS)
    assert len(calls) == driven and written == ["runs"] * (how == "kept")


@pytest.mark.parametrize("id", figures.RUNS)
def test_the_committed_runs_are_of_todays_code(id):
    """As many of each kind as metrics.json counts; else the notebooks would drive for minutes."""
    runs, numbers = figures.kept_runs(id), figures.numbers_in(kept.FOLDER.parents[1] / "figures")[id]
    assert {kind: len(each) for kind, each in runs.items()} == dict.fromkeys(controls.CONTROLS, numbers["runs"])
    assert sum(each.finished for each in runs["own"]) == numbers["own_finished"]
