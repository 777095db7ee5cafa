"""A robot under the law of a task: control, obstacles, localisation, performing (Sec. III)."""

from dollop.robot.avoidance import PIONEER_AVOIDANCE, PIONEER_RADIUS, Avoidance, ObstacleMap
from dollop.robot.controller import Controller
from dollop.robot.guidance import PIONEER_FOLLOWING, PIONEER_LIMITS, Following, Guidance, Limits
from dollop.robot.localising import localise
from dollop.robot.localization import PIONEER_LOCALISATION, Localisation, MonteCarloLocalizer
from dollop.robot.performing import Unicycle, perform
from dollop.robot.run import Run

__all__ = [
    "PIONEER_AVOIDANCE", "PIONEER_FOLLOWING", "PIONEER_LIMITS", "PIONEER_LOCALISATION", "PIONEER_RADIUS",
    "Avoidance", "Controller", "Following", "Guidance", "Limits", "Localisation", "MonteCarloLocalizer",
    "ObstacleMap", "Run", "Unicycle", "localise", "perform",
]  # fmt: skip
