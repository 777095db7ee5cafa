"""Agent Orange performing: the Pioneer in PyBullet that knows only its odometry and what its laser sees."""

import numpy as np

from dollop.lab.pioneer import LASER_OFFSET, Pioneer, laser_pose
from dollop.lab.sick import SickLMS200
from dollop.robot.control import PIONEER_LIMITS, Limits
from dollop.robot.localization import MonteCarloLocalizer, motion_between


class LocalisedPioneer:
    """A robot for `dollop.perform`: wheels and laser of the laboratory, Monte Carlo localisation on the background.

    Parameters
    ----------
    world : World
        The laboratory it drives in.
    background : OccupancyGrid
        The map it localises itself on.
    pose : (3,) sequence of float
        Where it stands: x, y in m, theta in rad.
    environment : Environment, optional
        Boxes that it knows to stand there as well.
    seed : int
        For the errors of odometry, laser and localisation.
    knows_start : bool
        Whether it is told where it starts.
    limits : Limits
    sick : SickLMS200, optional
        The laser; a scan is one control period.

    Attributes
    ----------
    pioneer : Pioneer
    localizer : MonteCarloLocalizer
    """

    def __init__(
        self,
        world,
        background,
        pose,
        environment=None,
        seed=0,
        knows_start=True,
        limits=PIONEER_LIMITS,
        sick=None,
    ):
        driving, sensing, guessing = np.random.default_rng(seed).spawn(3)
        self.world, self.rng, self.limits, self.sick = world, sensing, Limits(*limits), sick or SickLMS200()
        self.pioneer = Pioneer(world, pose, driving, *self.limits)
        start = pose if knows_start else None
        self.localizer = MonteCarloLocalizer(background, self.sick.angles, environment, start, LASER_OFFSET, guessing)
        self.period = 1 / self.sick.rate
        self.drive(0.0, 0.0)  # a first scan

    @property
    def pose(self):
        """Estimated pose (3,)."""
        return tuple(self.localizer.pose.tolist())

    @property
    def true_pose(self):
        """True pose (3,)."""
        return tuple(self.pioneer.pose.tolist())

    @property
    def localised(self):
        """Whether the estimate is to be believed."""
        return self.localizer.localised

    @property
    def touching(self):
        """Whether the robot is in contact with anything but the floor."""
        return bool(self.pioneer.touching())

    def place(self, pose):
        """Kidnap the robot: put it at a pose without telling the localisation."""
        self.pioneer.place(pose)

    def drive(self, speed, turn):
        """Drive towards a speed in m/s and a turning rate in rad/s for one period, scan, and localise."""
        before = self.pioneer.odometry
        self.pioneer.drive(speed, turn)
        self.pioneer.advance(self.period)
        ranges = self.sick.scan(self.world, laser_pose(self.pioneer.pose), self.rng)
        self.localizer.update(motion_between(before, self.pioneer.odometry), ranges)
