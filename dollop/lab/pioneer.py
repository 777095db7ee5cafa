"""An ActivMedia Pioneer 2 DX in a laboratory: commands in, wheels turned by motors, pose and odometry out."""

from pathlib import Path

import numpy as np

from dollop.lab.world import PHYSICS_RATE, pybullet
from dollop.robot.control import wrap

URDF = Path(__file__).with_name("pioneer2dx.urdf")
WHEEL_RADIUS = 0.0825
WHEEL_BASE = 0.317
"""Distance in m between the wheels' middles (Stage, pioneer.inc)."""
LASER_OFFSET = 0.017
"""Laser ahead of the middle of the axle in m (ARIA p2dx.p, LaserX)."""
MOTOR_TORQUE = 8.0
ODOMETRY_STEPS = 12
"""Physics steps between two readings of the wheel encoders."""


class Pioneer:
    """A Pioneer 2 DX that obeys speed commands within its limits.

    Parameters
    ----------
    world : World
    pose : tuple of 3 floats
        Where it is put: x, y in m, theta in rad.
    seed : int or numpy.random.Generator
        For the calibration errors of its odometry: each wheel's radius is believed with an error of 0.5 %, the wheel
        base with one of 1 % (standard deviations), the same for the robot's life.
    max_speed, max_turn : float
        Limits in m/s and rad/s (0.5 and 100 deg/s in Player's p2os).
    acceleration, turn_acceleration : float
        Limits in m/s^2 and rad/s^2 (Stage, pioneer.inc).

    Attributes
    ----------
    body : int
        PyBullet body.
    odometry : (3,) array
        Pose that the wheel encoders make the robot believe, starting from the true one.
    """

    def __init__(self, world, pose, seed=0, max_speed=0.5, max_turn=1.75, acceleration=0.5, turn_acceleration=1.57):
        rng = np.random.default_rng(seed)
        self.world = world
        self.limits = np.array([max_speed, max_turn])
        self.ramps = np.array([acceleration, turn_acceleration]) / PHYSICS_RATE
        self.believed_radii = WHEEL_RADIUS * (1 + rng.normal(0.0, 0.005, 2))
        self.believed_base = WHEEL_BASE * (1 + rng.normal(0.0, 0.01))
        self.body = world.call("loadURDF", str(URDF))
        self.centre_of_mass = np.array(world.call("getDynamicsInfo", self.body, -1)[3])
        self.wheels, castor = [0, 1], 2  # in the order of the URDF
        self.set_friction(castor)
        self.place(pose)

    def set_friction(self, castor):
        """Tyres grip, the castor slides, so that it need not swivel."""
        for link, friction in ((castor, 0.0), *((wheel, 1.2) for wheel in self.wheels)):
            self.world.call("changeDynamics", self.body, link, lateralFriction=friction)
        # with friction in the same call PyBullet would give it to the hull, whichever link is named
        self.world.call("changeDynamics", self.body, -1, linearDamping=0.0, angularDamping=0.0)

    def place(self, pose):
        """Put the robot at rest at a pose (x, y in m, theta in rad), where its odometry starts anew; a kidnapping."""
        x, y, theta = pose
        upright = pybullet.getQuaternionFromEuler((0.0, 0.0, theta))
        lift = self.centre_of_mass
        centre = np.array([x + lift[0] * np.cos(theta), y + lift[0] * np.sin(theta), lift[2]])
        self.world.call("resetBasePositionAndOrientation", self.body, centre, upright)
        for wheel in self.wheels:
            self.world.call("resetJointState", self.body, wheel, 0.0, 0.0)
        self.odometry = np.array([x, y, theta], dtype=float)
        self.command = self.speeds = np.zeros(2)
        self.turned = np.zeros(2)

    def drive(self, speed, turn):
        """Command a speed in m/s and a turning rate in rad/s, each cut to its limit."""
        self.command = np.clip([speed, turn], -self.limits, self.limits)

    def advance(self, duration):
        """Let `duration` s of physics pass, the speeds moving to the command within the acceleration limits."""
        for step in range(round(duration * PHYSICS_RATE)):
            if step % ODOMETRY_STEPS == 0:
                self.update_odometry()
            self.speeds = self.speeds + np.clip(self.command - self.speeds, -self.ramps, self.ramps)
            speed, turn = self.speeds
            rates = (np.array([-0.5, 0.5]) * WHEEL_BASE * turn + speed) / WHEEL_RADIUS
            self.world.call(
                "setJointMotorControlArray",
                self.body,
                self.wheels,
                pybullet.VELOCITY_CONTROL,
                targetVelocities=rates,
                forces=[MOTOR_TORQUE, MOTOR_TORQUE],
            )
            self.world.call("stepSimulation")
        self.update_odometry()

    def update_odometry(self):
        """Add what the wheels turned since the last time to the believed pose."""
        turned = np.array([state[0] for state in self.world.call("getJointStates", self.body, self.wheels)])
        left, right = (turned - self.turned) * self.believed_radii
        self.turned = turned
        self.odometry = moved_pose(self.odometry, (left + right) / 2, (right - left) / self.believed_base)

    @property
    def pose(self):
        """True pose (3,): x, y in m, theta in rad in (-pi, pi]."""
        centre, orientation = self.world.call("getBasePositionAndOrientation", self.body)
        theta = pybullet.getEulerFromQuaternion(orientation)[2]
        turn = np.array(pybullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        return np.array([*(centre - turn @ self.centre_of_mass)[:2], theta])

    @property
    def velocity(self):
        """True forward speed in m/s and turning rate in rad/s, (2,), of the middle of the axle."""
        (vx, vy, _), (_, _, turn) = self.world.call("getBaseVelocity", self.body)
        theta = self.pose[2]
        return np.array([vx * np.cos(theta) + vy * np.sin(theta), turn])

    def touching(self):
        """PyBullet bodies other than the floor that the robot is in contact with, a set of int."""
        contacts = self.world.call("getContactPoints", self.body)
        return {contact[2] for contact in contacts if contact[8] < 0.001} - {self.world.floor, self.body}


def moved_pose(pose, distance, turn):
    """The pose after a short arc of `distance` m that turns by `turn` rad.

    Examples
    --------
    >>> moved_pose(np.zeros(3), 1.0, 0.0).tolist()
    [1.0, 0.0, 0.0]
    """
    x, y, theta = pose
    middle = theta + turn / 2
    return np.array([x + distance * np.cos(middle), y + distance * np.sin(middle), wrap(theta + turn)])


def laser_pose(pose):
    """Pose (3,) of the laser when the robot's pose is `pose`: x, y in m, theta in rad."""
    return moved_pose(pose, LASER_OFFSET, 0.0)
