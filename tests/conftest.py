"""What all tests share: the same examples on every machine, however slow, and names without file content."""

from pathlib import Path

import pytest
from hypothesis import settings
from places import ROOT
from walks import walk_figure_eights

from dollop.laps import laps

settings.register_profile("repeatable", max_examples=50, derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None)  # pytest --hypothesis-profile=fresh: a hundred new ones every time
settings.load_profile("repeatable")

TOGETHER = (
    "test_claims.py",
    "test_worlds.py",
    "test_study.py",
    "test_readme.py",
    "test_package.py",
    "test_cli_naming.py",
)
"""Files with a fixture that takes seconds: one worker runs all of each, so that no other makes it again."""


def pytest_make_parametrize_id(val, argname):
    """Name bytes after their argument: file content holds what changes, such as the time in a gzip's header."""
    return argname if isinstance(val, bytes) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One process for single files, as more of them take longer to start than they save; else all cores."""
    return 0 if all(Path(each.split("::")[0]).is_file() for each in config.args) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Tests go to whichever worker is free, one by one; the files named above as a whole, and first."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            file = nodeid.split("::")[0]
            return file if file.endswith(TOGETHER) else nodeid

    return Scheduling(config, log)


def pytest_collection_modifyitems(items):
    """Mark what proves the paper, so that who works on the method can leave it out: pytest -m "not replication"."""
    for item in items:
        inside = item.path.is_relative_to(ROOT)  # examples of an installed package are not
        if inside and "replication" in item.path.relative_to(ROOT).parts:
            item.add_marker(pytest.mark.replication)


@pytest.fixture(scope="session")
def one_lap():
    """A walked figure-eight of one lap (N, 2)."""
    return walk_figure_eights(1, seed=0)[1]


@pytest.fixture(scope="session")
def five_laps():
    """Five laps cut out of one track."""
    return laps(*walk_figure_eights(6, seed=0))[:5]
