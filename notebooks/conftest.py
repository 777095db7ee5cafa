"""Notebooks 01 and 10 simulate; where PyBullet is missing they are skipped, and the reason says how to get it."""

from importlib.util import find_spec

import pytest

NEEDS_PYBULLET = ("01_lab_and_laser.ipynb", "10_other_rooms.ipynb")


def pytest_collection_modifyitems(items):
    """Skip what cannot run here."""
    if find_spec("pybullet"):
        return
    skip = pytest.mark.skip(reason='simulates the lab, and PyBullet is missing: pip install "dollop[lab]"')
    for item in items:
        if item.path.name in NEEDS_PYBULLET:
            item.add_marker(skip)
