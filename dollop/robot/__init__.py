"""A robot under the law of a task: control, obstacles, localisation, performing (Sec. III)."""

from dollop.robot.avoidance import PIONEER_RADIUS, Avoidance, ObstacleMap
from dollop.robot.control import PIONEER_LIMITS, Following, Guidance, Limits
from dollop.robot.controller import Controller
from dollop.robot.localising import localise
from dollop.robot.localization import MonteCarloLocalizer
from dollop.robot.performing import Unicycle, perform
from dollop.robot.run import Run

__all__ = [
    "PIONEER_LIMITS", "PIONEER_RADIUS", "Avoidance", "Controller", "Following", "Guidance", "Limits",
    "MonteCarloLocalizer", "ObstacleMap", "Run", "Unicycle", "localise", "perform",
]  # fmt: skip
