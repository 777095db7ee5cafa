"""Dollop: learning by observation with a mobile robot (Dixon & Khosla, ICRA 2004).

A person shows a task by walking it; the robot watches with its laser, extracts subgoals, ties them
to the objects in the room, learns one model from several demonstrations and performs the task.

The paper's notation, and where it lives (names in `dollop`):

====  ==========  ============================================  ===============================
Sec.  symbol      meaning                                       name
====  ==========  ============================================  ===============================
II                background occupancy grid map                 `OccupancyGrid`
II                laser scan; no return is inf                  `LaserLog.ranges`
II                where the laser is on the map                 `localise`
II                foreground cell: no background near it        `foreground.foreground_mask`
II    g           value of a cell of the foreground grid        `foreground.ForegroundGrid`
II                blob: adjacent occupied foreground cells      `foreground.Blobs`
II    x, P        state of a track and its covariance           `tracking.predict`
II    F, Q        motion model of the Kalman filter, its noise  `Motion.transition`
II    z           measured centroid of a foreground object      `Track.measurements`
II                greedy search of tracks for objects           `tracking.match_greedily`
II                occluded; disappeared after 5 seconds         `Tracker.disappear_after`
II                user: the fastest foreground object           `tracking.identify_user`
II                people, each as far as it is surely the same  `people`
II                what stands, and since when                   `foreground.StandingCells`
II                people, user, environment of a log            `observe`, `Observer`
                  what may be wrong with a result, and why      `Note`
III   p_n         position on a trajectory                      `trajectory`
III               laps: walks along one trajectory              `laps`
III   x_n         position relative to a segment's subgoal      `LDS.step`
III   A           matrix of one LDS, x_{n+1} = A x_n            `LDS.A`
III   g           subgoal: where a segment ends                 `LDS.goal`
III   G0, G1      statistics of a segment; they add up          `lds.Statistics`
III               response of the control law from a start      `SequencedLDS.response`
III               supervisory control law: segments hand over   `robot.control`
III   u           its direction in the segment in force         `robot.control.Guidance`
III   v, omega    speed and turning rate that it asks for       `robot.control.CONTROL_LAWS`
III               performing a task; kidnapping the robot       `perform`
III               the same, pose by pose, in another's loop     `Controller`
                  the user's pauses, and the directions there   `SequencedLDS.pauses`
                  the task as a route for other software        `export`, `Route`
IV    Omega^i     environment configuration i: 4N corners       `Environment.corners`
IV-A  omega_m^i   corner m of Omega^i                           row m of it
IV-A  k_{m,n}^i   spring constant between two corners           `environment.spring_constants`
IV-A  f_m^i       total force of the springs on a corner        `environment.spring_forces`
IV-A  c           cost of matching two corners, an integer      `environment.integer_costs`
IV-A  alpha       scale of the cost before rounding up          `alpha` of it
IV-A  g(.)        matching of two environments                  `Matching.indices`
IV-B  m           closest corners that a subgoal is tied to     `m` of `associate`
IV-B  w_l         weight of a corner: closer, heavier           `Association.weights`
IV-B              subgoals updated as objects move              `Association.relocate`
IV-B              the task where the objects stand now          `Task.adapt`
V                 CDHMM: states that emit subgoals              `SubgoalHMM`
V     n, s, q     statistics of a state; they add up            `cdhmm.evidence`
V     a_{uv}      probability of a step between states          `SubgoalHMM.transitions`
V                 most-likely path: the task's subgoals         `SubgoalHMM.most_likely_path`
V                 task, learned from demonstrations             `learn`
====  ==========  ============================================  ===============================

SI units throughout; a pose is (x, y, theta); time comes first in every array.
"""

from dollop.association import Association, Frames, associate, associate_with_frames
from dollop.cdhmm import SubgoalHMM
from dollop.checks import Note
from dollop.environment import Environment
from dollop.formats import FormatError, read_log, write_log
from dollop.gridmap import OccupancyGrid
from dollop.laps import laps
from dollop.laser import LaserLog
from dollop.lds import LDS
from dollop.matching import Matching, match
from dollop.observation import Observation, Observer, observe
from dollop.robot import Controller, Run, Unicycle, localise, perform
from dollop.route import Route, export
from dollop.sequenced_lds import SequencedLDS
from dollop.task import Demonstration, Task, learn
from dollop.tracking import Motion, Track, Tracker

__version__ = "0.1.0"

__all__ = [
    "LDS", "Association", "Controller", "Demonstration", "Environment", "FormatError", "Frames", "LaserLog",
    "Matching", "Motion", "Note", "Observation", "Observer", "OccupancyGrid", "Route", "Run", "SequencedLDS",
    "SubgoalHMM", "Task", "Track", "Tracker", "Unicycle", "__version__", "associate", "associate_with_frames",
    "export", "laps", "learn", "localise", "match", "observe", "perform", "read_log", "write_log",
]  # fmt: skip
