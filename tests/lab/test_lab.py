"""The laboratory's door: what needs PyBullet is asked for by name, and says how to get it."""

import sys

import pytest

import dollop.lab


def test_without_pybullet_the_error_says_how_to_install_it(monkeypatch):
    """Asking for the simulation where PyBullet is missing raises ImportError with the command to install it."""
    for name in [name for name in sys.modules if name.startswith("dollop.lab.") or name == "pybullet"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(ImportError, match=r'pip install "dollop\[lab\]"'):
        _ = dollop.lab.record_figure_eights
