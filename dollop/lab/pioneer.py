"""An ActivMedia Pioneer 2 DX: wheels turned by motors, odometry, and a laser to find itself by."""

from pathlib import Path

import numpy as np
import pybullet

from dollop.lab.sick import SickLMS200
from dollop.lab.world import PHYSICS_RATE
from dollop.pose import motion_between, moved_pose
from dollop.robot.control import PIONEER_LIMITS, Limits
from dollop.robot.localization import MonteCarloLocalizer

__all__ = ["Pioneer", "laser_pose"]

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
    sick : SickLMS200, optional
        The laser, in its default mode when not given; a scan is one control period.

    Attributes
    ----------
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
    laser_offset : float
        Laser ahead of the middle of the axle in m (ARIA p2dx.p, LaserX).
    motor_torque : float
        The most that a motor gives, in Nm.

    Raises
    ------
    ValueError
        With a background: if the pose is not finite, or the map has no free cell.
    """

    wheel_radius, wheel_base = 0.0825, 0.317
    laser_offset = 0.017
    motor_torque = 8.0

    def __init__(
        self,
        world,
        pose,
        background=None,
        environment=None,
        seed=0,
        knows_start=True,
        limits=PIONEER_LIMITS,
        sick=None,
    ):
        driving, self._sensing, guessing = np.random.default_rng(seed).spawn(3)
        self.world, self.limits, self.sick = world, Limits(*limits), sick or SickLMS200()
        self.period = 1 / self.sick.rate
        self._believed_radii = self.wheel_radius * (1 + driving.normal(0.0, 0.005, 2))
        self._believed_base = self.wheel_base * (1 + driving.normal(0.0, 0.01))
        self.body = world.call("loadURDF", str(URDF))
        self._centre_of_mass = np.array(world.call("getDynamicsInfo", self.body, -1)[3])
        self._set_friction()
        self.place(pose)
        self.localizer = None
        if background is not None:
            beams, offset = self.sick.angles, self.laser_offset
            start = pose if knows_start else None
            told = background, beams, environment, start, offset
            self.localizer = MonteCarloLocalizer(*told, guessing)
            self.drive(0.0, 0.0)  # a first scan

    def _set_friction(self):
        """Tyres grip, the castor slides, so that it need not swivel."""
        for link, friction in ((CASTOR, 0.0), *((wheel, 1.2) for wheel in WHEELS)):
            self.world.call("changeDynamics", self.body, link, lateralFriction=friction)
        # with friction in the same call PyBullet would give it to the hull, whichever link is named
        self.world.call("changeDynamics", self.body, -1, linearDamping=0.0, angularDamping=0.0)

    @property
    def pose(self):
        """What the robot believes, (3,): x, y in m, theta in rad in (-pi, pi]."""
        return self.true_pose if self.localizer is None else tuple(self.localizer.pose.tolist())

    @property
    def true_pose(self):
        """Where the robot is, (3,): x, y in m, theta in rad in (-pi, pi]."""
        centre, orientation = self.world.call("getBasePositionAndOrientation", self.body)
        theta = pybullet.getEulerFromQuaternion(orientation)[2]
        turn = np.array(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        x, y, _ = (centre - turn @ self._centre_of_mass).tolist()
        return x, y, theta

    @property
    def localised(self):
        """Whether the robot trusts what it believes."""
        return self.localizer is None or self.localizer.localised

    @property
    def touching(self):
        """Whether the robot is in contact with anything but the floor."""
        contacts = self.world.call("getContactPoints", self.body)
        touched = {contact[2] for contact in contacts if contact[8] < 0.001}
        return bool(touched - {self.world.floor, self.body})

    def place(self, pose):
        """Put the robot at rest somewhere, where its odometry starts anew; a kidnapping (Sec. III).

        The localisation is not told.

        Parameters
        ----------
        pose : (3,) sequence of float
            x, y in m, theta in rad.
        """
        x, y, theta = pose
        upright = pybullet.getQuaternionFromEuler((0.0, 0.0, theta))
        lift = self._centre_of_mass
        centre = np.array([x + lift[0] * np.cos(theta), y + lift[0] * np.sin(theta), lift[2]])
        self.world.call("resetBasePositionAndOrientation", self.body, centre, upright)
        for wheel in WHEELS:
            self.world.call("resetJointState", self.body, wheel, 0.0, 0.0)
        self.odometry = np.array([x, y, theta], dtype=float)
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
            ranges = self.sick.scan(self.world, laser_pose(self.true_pose), self._sensing)
            self.localizer.update(motion_between(before, self.odometry), ranges)

    def _advance(self, speed, turn):
        """Let one period of physics pass."""
        limits = np.array(self.limits)
        most, ramps = limits[:2], limits[2:] / PHYSICS_RATE
        command = np.clip([speed, turn], -most, most)
        for step in range(round(self.period * PHYSICS_RATE)):
            if step % ODOMETRY_STEPS == 0:
                self._update_odometry()
            self._speeds = self._speeds + np.clip(command - self._speeds, -ramps, ramps)
            self._turn_wheels(*self._speeds)
            self.world.call("stepSimulation")
        self._update_odometry()

    def _turn_wheels(self, speed, turn):
        """Let the motors turn the wheels for a speed in m/s and a turning rate in rad/s."""
        rates = (np.array([-0.5, 0.5]) * self.wheel_base * turn + speed) / self.wheel_radius
        wanted = {"targetVelocities": rates, "forces": [self.motor_torque] * 2}
        mode = pybullet.VELOCITY_CONTROL
        self.world.call("setJointMotorControlArray", self.body, WHEELS, mode, **wanted)

    def _update_odometry(self):
        """Add what the wheels turned since the last time to the believed pose."""
        states = self.world.call("getJointStates", self.body, WHEELS)
        turned = np.array([state[0] for state in states])
        left, right = (turned - self._turned) * self._believed_radii
        self._turned = turned
        turn = (right - left) / self._believed_base
        self.odometry = moved_pose(self.odometry, (left + right) / 2, turn)


def laser_pose(pose):
    """Where the laser is on a Pioneer 2 DX (ARIA p2dx.p).

    Parameters
    ----------
    pose : (3,) sequence of float
        Of the robot: x, y in m, theta in rad.

    Returns
    -------
    (3,) float array
        Of the laser.
    """
    return moved_pose(pose, Pioneer.laser_offset, 0.0)
