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


def pytest_make_parametrize_id(val, argname):
    """Name bytes after their argument: file content holds what changes, such as the time in a gzip's header."""
    return argname if isinstance(val, bytes) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    """One process for single files, as more of them take longer to start than they save; else all cores."""
    return 0 if all(Path(each.split("::")[0]).is_file() for each in config.args) else None


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
