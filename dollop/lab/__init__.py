"""The laboratory, simulated: a room, a Pioneer 2 DX with a SICK LMS 200, and a person who walks a task.

    from dollop.lab import record_background, record_figure_eights
    recording = record_figure_eights(seed=0)     # five laps: .log (LaserLog), .truth (t, x, y, heading), .scene
    background = record_background(seed=0)       # LaserLog of a drive through the empty laboratory
    recording.save("data/eights.log.gz")         # Recording.load reads it back, without PyBullet

Scenes, walks and saved recordings need no PyBullet; what simulates does (extra `lab`), and says so when it is missing.
"""

from dollop.lab.person import Walk, figure_eight, slalom, walk
from dollop.lab.recording import Recording
from dollop.lab.scenes import Scene, empty_scene, figure_eight_scene, moved, rearranged, slalom_scene

NEEDS_PYBULLET = {
    "World": "world",
    "SickLMS200": "sick",
    "Pioneer": "pioneer",
    "record": "simulate",
    "record_figure_eights": "simulate",
    "record_background": "simulate",
    "watch": "simulate",
    "render_lab": "render",
    "render_robot": "render",
}

__all__ = [
    "Recording",
    "Scene",
    "Walk",
    "empty_scene",
    "figure_eight",
    "figure_eight_scene",
    "moved",
    "rearranged",
    "slalom",
    "slalom_scene",
    "walk",
    *NEEDS_PYBULLET,
]


def __getattr__(name):
    """Import what needs PyBullet only when it is asked for."""
    if name not in NEEDS_PYBULLET:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{NEEDS_PYBULLET[name]}"), name)
