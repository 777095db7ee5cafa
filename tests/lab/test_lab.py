"""The laboratory's door: what needs PyBullet is asked for by name, and says how to get it."""

import sys

import pytest

import dollop.lab


def test_without_pybullet_the_error_says_how_to_install_it(monkeypatch):
    """Without PyBullet, asking for the simulation raises ImportError that says how to get it."""
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(ImportError, match=r'pip install "dollop\[lab\]"'):
        _ = dollop.lab.record_figure_eights
