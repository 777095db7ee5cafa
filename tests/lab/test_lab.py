"""The laboratory's door: what needs PyBullet is asked for by name, and says how to get it."""

import subprocess
import sys

import pytest

import dollop.lab


def test_without_pybullet_the_error_says_how_to_install_it(monkeypatch):
    """Without PyBullet, asking for the simulation raises ImportError that says how to get it."""
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(ImportError, match=r'pip install "dollop\[lab\]"'):
        _ = dollop.lab.record_figure_eights


def test_what_is_data_needs_no_pybullet(monkeypatch):
    """Without PyBullet scenes, walks, ways, scanners and recordings are there, and what simulates is not."""
    monkeypatch.setitem(sys.modules, "pybullet", None)
    for name in ("Scene", "Person", "walks_of", "find_way", "read_walks", "Recording", "SickTiM571", "LABORATORY"):
        assert getattr(dollop.lab, name) is not None
    for name in ("Engine", "World", "Pioneer", "record", "watch", "render_lab"):
        with pytest.raises(ImportError, match="this needs pybullet"):
            getattr(dollop.lab, name)


def test_a_scene_is_made_and_walked_in_where_pybullet_is_not_installed():
    """In a fresh process that refuses PyBullet, a scene is made, walked in, and comes back from its dictionary."""
    code = """
import sys
sys.modules["pybullet"] = None
from dollop.lab import Person, Scene, walks_of
scene = Scene(people=[Person([(2, 3), (6, 3)])])
assert walks_of(Scene.from_dict(scene.to_dict()))[0].positions[-1][0] > 5.8
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_is_not_there_is_said():
    """A name that the laboratory does not have raises AttributeError that names it."""
    with pytest.raises(AttributeError, match="'dollop.lab' has no attribute 'laser_pose'"):
        _ = dollop.lab.laser_pose
