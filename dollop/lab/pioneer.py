"""An ActivMedia Pioneer 2 DX: wheels turned by motors, odometry, and a laser to find itself by."""

from pathlib import Path

import numpy as np

from dollop.lab.engine import STEPS_PER_SECOND
from dollop.pose import motion_between, moved_pose
from dollop.robot.guidance import PIONEER_LIMITS, Limits
from dollop.robot.localization import PIONEER_LOCALISATION, MonteCarloLocalizer

__all__ = ["Pioneer", "put_pioneer"]

URDF = Path(__file__).with_name("pioneer2dx.urdf")
WHEELS, CASTOR = (0, 1), 2
"""Links and joints of the body, in the order of the URDF: left and right wheel, castor."""
ODOMETRY_STEPS = 12
"""Physics steps between two readings of the wheel encoders."""


class Pioneer:
    """Agent Orange: a Pioneer 2 DX with a SICK LMS 200, a robot for `dollop.perform` (Fig. 1).

    With a background map it believes what Monte Carlo localisation makes of its odometry and its
    scans (CARMEN's part, Sec. I); without one it knows its true pose.

    Parameters
    ----------
    world : World
        The laboratory it drives in.
    pose : (3,) sequence of float
        Where it is put: x, y in m, theta in rad.
    background : OccupancyGrid, optional
        The map it localises itself on.
    environment : Environment, optional
        Boxes that it knows to stand there as well.
    seed : int or numpy.random.Generator
        For the errors of odometry, laser and localisation. Of the odometry: each wheel's radius is
        believed with an error of 0.5 %, the wheel base with one of 1 % (standard deviations), the
        same for the robot's life.
    knows_start : bool
        Whether the localisation is told where the robot starts.
    limits : Limits
        In m/s, rad/s, m/s^2, rad/s^2.
    scanner : Scanner, optional
        The laser, that of the scene's robot when not given; a scan is one control period.
    rules : Localisation
        By what it finds itself on the map.

    Attributes
    ----------
    radius : float
        In m, of the circle round the middle of its axle, where its pose is, that covers it: the corners
        of its tail are 0.26 m behind and 0.18 m aside. ARIA's 0.25 m (p2dx.p) are round its own middle.
    limits : Limits
    period : float
        Control period in s.
    odometry : (3,) float array
        Pose that the wheel encoders make the robot believe, the true one where it was put.
    body : int
        PyBullet body.
    localizer : MonteCarloLocalizer or None
    wheel_radius, wheel_base : float
        Radius of a wheel, and distance between the wheels' middles, in m (Stage, pioneer.inc).
    motor_torque : float
        The most that a motor gives, in Nm.

    Raises
    ------
    ValueError
        With a background: if the pose is not finite, or the map has no free cell.
    """

    wheel_radius, wheel_base = 0.0825, 0.317
    motor_torque = 8.0
    radius = 0.32

    def __init__(
        self,
        world,
        pose,
        background=None,
        environment=None,
        seed=0,
        knows_start=True,
        limits=PIONEER_LIMITS,
        scanner=None,
        rules=PIONEER_LOCALISATION,
    ):
        driving, self._sensing, guessing = np.random.default_rng(seed).spawn(3)
        self.world, self.limits = world, Limits(*limits)
        self.scanner = scanner or world.scene.robot.scanner
        self.period = 1 / self.scanner.rate
        self._believed_radii = self.wheel_radius * (1 + driving.normal(0.0, 0.005, 2))
        self._believed_base = self.wheel_base * (1 + driving.normal(0.0, 0.01))
        self.body = put_pioneer(world.engine, pose)
        self._centre_of_mass = world.engine.centre_of_mass(self.body)
        self.place(pose)
        self.localizer = None
        if background is not None:
            beams, offset = self.scanner.angles, world.scene.robot.laser_ahead
            start = pose if knows_start else None
            told = background, beams, environment, start, offset
            self.localizer = MonteCarloLocalizer(*told, guessing, rules)
            self.drive(0.0, 0.0)  # a first scan

    @property
    def pose(self):
        """What the robot believes, (3,): x, y in m, theta in rad in (-pi, pi]."""
        return self.true_pose if self.localizer is None else tuple(self.localizer.pose.tolist())

    @property
    def true_pose(self):
        """Where the robot is, (3,): x, y in m, theta in rad in (-pi, pi]."""
        centre, turn, theta = self.world.engine.pose(self.body)
        x, y, _ = (centre - turn @ self._centre_of_mass).tolist()
        return x, y, theta

    @property
    def laser_pose(self):
        """(3,) true pose of the laser: x, y in m, theta in rad."""
        return moved_pose(self.true_pose, self.world.scene.robot.laser_ahead, 0.0)

    @property
    def localised(self):
        """Whether the robot trusts what it believes."""
        return self.localizer is None or self.localizer.localised

    @property
    def accuracy(self):
        """How far its pose may be off, in m: what localisation is accurate to, in a room of the lab."""
        return 0.0 if self.localizer is None else 0.02

    @property
    def touching(self):
        """Whether the robot is in contact with anything but the floor."""
        return bool(self.world.engine.touched(self.body) - {self.world.floor})

    def place(self, pose):
        """Put the robot at rest somewhere, where its odometry starts anew; a kidnapping (Sec. III).

        The localisation is not told.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.
        """
        place_at(self.world.engine, self.body, pose)
        self.world.engine.stop_wheels(self.body, WHEELS)
        self.odometry = np.array(pose, dtype=float)
        self._speeds = self._turned = np.zeros(2)

    def drive(self, speed, turn):
        """Drive for one control period; with a background, then scan and localise.

        Parameters
        ----------
        speed : float
            Commanded speed in m/s, cut to the limit; it is reached within the acceleration limit.
        turn : float
            Commanded turning rate in rad/s, likewise.
        """
        before = self.odometry
        self._advance(speed, turn)
        if self.localizer is not None:
            ranges = self.world.scan(self.laser_pose, self._sensing, self.scanner)
            self.localizer.update(motion_between(before, self.odometry), ranges)

    def _advance(self, speed, turn):
        """Let one period of physics pass."""
        limits = np.array(self.limits)
        most, ramps = limits[:2], limits[2:] / STEPS_PER_SECOND
        command = np.clip([speed, turn], -most, most)
        for step in range(round(self.period * STEPS_PER_SECOND)):
            if step % ODOMETRY_STEPS == 0:
                self._update_odometry()
            self._speeds = self._speeds + np.clip(command - self._speeds, -ramps, ramps)
            self._turn_wheels(*self._speeds)
            self.world.engine.step()
        self._update_odometry()

    def _turn_wheels(self, speed, turn):
        """Let the motors turn the wheels for a speed in m/s and a turning rate in rad/s."""
        rates = (np.array([-0.5, 0.5]) * self.wheel_base * turn + speed) / self.wheel_radius
        self.world.engine.turn_wheels(self.body, WHEELS, rates, self.motor_torque)

    def _update_odometry(self):
        """Add what the wheels turned since the last time to the believed pose."""
        turned = self.world.engine.wheel_angles(self.body, WHEELS)
        left, right = (turned - self._turned) * self._believed_radii
        self._turned = turned
        turn = (right - left) / self._believed_base
        self.odometry = moved_pose(self.odometry, (left + right) / 2, turn)


def put_pioneer(engine, pose):
    """Put a Pioneer 2 DX into a simulator.

    Parameters
    ----------
    engine : Engine
    pose : (3,) sequence of float
        x, y in m, theta in rad.

    Returns
    -------
    int
        Its body.
    """
    body = engine.add_robot(URDF, WHEELS, CASTOR)
    place_at(engine, body, pose)
    return body


def place_at(engine, body, pose):
    """Put the body of a Pioneer at a pose (3,), upright on the floor."""
    x, y, theta = pose
    lift = engine.centre_of_mass(body)
    engine.place(body, (x + lift[0] * np.cos(theta), y + lift[0] * np.sin(theta), lift[2]), theta)
