"""Whatever is killed while it writes leaves nothing half old and half new; the long run is `make fuzz`."""

import os

import pytest

if not hasattr(os, "fork"):
    pytest.skip("processes are forked here", allow_module_level=True)

import kills
from kills import Writer

from dollop.formats import writing

MAP = Writer("a map", lambda folder, version: kills.small_map(version).save(folder / "a.yaml"), (("a.yaml", "a.pgm"),))
BEFORE_RENAMES = {"steps": kills.RENAMES, "moments": [False]}
QUICK = {writer.name: writer for writer in (MAP, *kills.library(kills.quickly_observes)) if "map ." not in writer.name}


@pytest.fixture(scope="module")
def found():
    """What is observed, before any process is forked."""
    return kills.seen(kills.OLD), kills.seen(kills.NEW)


@pytest.mark.usefixtures("found")
@pytest.mark.parametrize("name", QUICK)
def test_a_run_killed_before_any_rename_leaves_no_mixture(name):
    """Inputs as they were, outputs of one run, and after the next run all of them new and nothing else."""
    count, wrong = kills.at_every_step(QUICK[name], **BEFORE_RENAMES)
    assert wrong == [] and count >= 2


def test_a_run_that_replaces_nothing_leaves_all_or_no_main_file():
    """The same where there is no map before, killed before and after each step."""
    count, wrong = kills.at_every_step(MAP, fresh=True)
    assert wrong == [] and count >= 20


@pytest.mark.replication
@pytest.mark.parametrize("name", ["figures", "worlds"])
def test_a_figure_or_study_killed_before_any_rename_leaves_no_mixture(name):
    """Pictures, numbers and pages of one run."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    writer = next(each for each in kills.replication() if each.name == name)
    count, wrong = kills.at_every_step(writer, **BEFORE_RENAMES)
    assert wrong == [] and count >= 6


def test_kills_at_random_moments_leave_no_mixture():
    """A few of those that the long run has hundreds of."""
    done, wrong = kills.at_random_moments([MAP, QUICK["task"]], 10, seed=0)
    assert wrong == [] and done.total() == 10


def test_what_mixes_or_litters_is_found(monkeypatch):
    """Without the removal of the old picture, or the sweeping, the same kills tell of it."""

    def in_order(parts, aside, to_disk):
        for part in parts:
            os.replace(part.name, part.target)

    with monkeypatch.context() as patched:
        patched.setattr(writing, "_rename", in_order)
        assert any("mixed: a.yaml old, a.pgm new" in said for said in kills.at_every_step(MAP, **BEFORE_RENAMES)[1])
    monkeypatch.setattr(writing, "_sweep", lambda folder: None)
    assert any("litter after the next run" in said for said in kills.at_every_step(MAP, **BEFORE_RENAMES)[1])
