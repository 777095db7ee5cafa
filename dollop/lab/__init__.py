"""The laboratory, simulated: any room, what stands in it, people who walk, and a robot with a laser that watches.

    from dollop.lab import Object, Person, Robot, Room, Scene, record, record_background, record_figure_eights
    recording = record_figure_eights(seed=0)  # the paper's: five laps: .log, .truth (t, x, y, heading), .scene
    background = record_background(seed=0)    # LaserLog of a drive through the paper's empty laboratory
    recording.save("data/eights.log.gz")      # Recording.load reads it back, without PyBullet

    room = Room([(0, 0), (8, 0), (8, 5), (0, 5)])  # or one of your own; Scene.save and Scene.load write and read
    user = Person([(1, 4), (4, 2), (7, 4)], speed=0.8, stops=[(1, 2.0)])
    scene = Scene([Object.trash_can((4, 3))], room, Robot((4, 0.5, 1.57)), [user])
    recording = record(scene, seed=0)

Scenes, walks, saved recordings and what is only drawn need no PyBullet; what simulates does (extra `lab`), and says so
when it is missing. A module is imported when one of its names is first asked for.
"""

from importlib import import_module

from dollop.checks import need

HOMES = {
    "drawn": ["TASKS", "draw_demonstrations", "random_layouts"],
    "engine": ["Engine"],
    "people": ["find_way", "read_walks", "replay", "walk_of", "walks_of"],
    "person": ["Walk", "figure_eight", "slalom", "walk"],
    "pioneer": ["Pioneer"],
    "recording": ["Recording"],
    "render": ["render_lab", "render_robot"],
    "rooms": ["LABORATORY", "Part", "Room"],
    "scanner": ["Scanner", "SickLMS200", "SickTiM571", "UTM30LX"],
    "scenes": ["Scene", "empty_scene", "figure_eight_scene", "moved", "rearranged", "slalom_scene"],
    "simulate": ["record", "record_background", "record_figure_eights", "record_tour", "watch"],
    "tasks": ["DrawnTask", "draw_layouts", "draw_task", "walked"],
    "things": ["Move", "Object", "Person", "Robot"],
    "world": ["World"],
}  # fmt: skip
MODULES = {name: module for module, names in HOMES.items() for name in names}
NEED_PYBULLET = {"engine", "pioneer", "render", "simulate", "world"}

__all__ = sorted(MODULES)


def __getattr__(name):
    """Import what is asked for."""
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if MODULES[name] in NEED_PYBULLET:
        need("lab")
    return getattr(import_module(f"{__name__}.{MODULES[name]}"), name)
