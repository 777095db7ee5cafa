"""A robot under the law of a task: control, obstacles, localisation, performing (Sec. III)."""

from dollop.robot.avoidance import ObstacleMap
from dollop.robot.control import PIONEER_LIMITS, Guidance, Limits
from dollop.robot.localising import localise
from dollop.robot.localization import PIONEER_LOCALISATION, Localisation, MonteCarloLocalizer
from dollop.robot.performing import Run, Unicycle, perform

__all__ = [
    "PIONEER_LIMITS", "PIONEER_LOCALISATION", "Guidance", "Limits", "Localisation", "MonteCarloLocalizer",
    "ObstacleMap", "Run", "Unicycle", "localise", "perform",
]  # fmt: skip
