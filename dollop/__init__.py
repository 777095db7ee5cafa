"""Dollop: learning by observation with a mobile robot (Dixon & Khosla, ICRA 2004).

A person shows a task by walking it; the robot watches with its laser, extracts subgoals, ties them to the objects in
the room, learns one model from several demonstrations and performs the task.

The paper's notation, and where it lives:

=====================  ======================================================================  ====================
symbol                 meaning                                                                 name
=====================  ======================================================================  ====================
x_n                    position on a trajectory relative to the segment's subgoal (Sec. III)   `LDS.step`
A                      matrix of one LDS, x_{n+1} = A x_n (Sec. III)                           `LDS.A`
g                      subgoal: where a segment ends (Sec. III)                                `LDS.goal`
Omega^i                environment configuration of demonstration i: 4N corners (Sec. IV)      `Environment.corners`
omega_m^i              corner m of Omega^i (Sec. IV-A)                                         row m of it
k_{m,n}^i              spring constant between two corners (Sec. IV-A)                         `spring_constants`
f_m^i                  force on a corner (Sec. IV-A)                                           `spring_forces`
c(omega_m, omega_n)    cost of matching two corners, an integer (Sec. IV-A)                    `integer_costs`
alpha                  scale of the cost before rounding up (Sec. IV-A)                        `alpha`
g(.)                   the matching of two environment configurations (Sec. IV-A)              `Matching.indices`
m                      how many of the closest corners a subgoal is tied to (Sec. IV-B)        `m` of `associate`
=====================  ======================================================================  ====================

SI units throughout; a pose is (x, y, theta); time comes first in every array.
"""

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.environment import Environment
from dollop.formats.files import FormatError
from dollop.formats.logs import read_log, write_log
from dollop.gridmap import OccupancyGrid
from dollop.laps import laps
from dollop.laser import LaserLog
from dollop.lds import LDS
from dollop.matching import Matching, match
from dollop.observation import Observation, observe
from dollop.robot.performing import Run, Unicycle, perform
from dollop.sequenced_lds import SequencedLDS
from dollop.task import Demonstration, Task, learn
from dollop.tracking import Motion, Track, Tracker

__all__ = [
    "LDS",
    "Association",
    "Demonstration",
    "Environment",
    "FormatError",
    "Frames",
    "LaserLog",
    "Matching",
    "Motion",
    "Observation",
    "OccupancyGrid",
    "Run",
    "SequencedLDS",
    "SubgoalHMM",
    "Task",
    "Track",
    "Tracker",
    "Unicycle",
    "associate",
    "associate_with_frames",
    "laps",
    "learn",
    "match",
    "observe",
    "perform",
    "read_log",
    "write_log",
]
