"""The supervisory control law that a sequenced LDS induces (end of Sec. III).

In segment k the law maps the current state to a direction, whatever brought the robot there:

    u(p) = (A_k - I)(p - g_k) / |(A_k - I)(p - g_k)|.

A segment stays in force until the robot has come to its subgoal g_k; then the next one takes over.
So a robot that is kidnapped keeps its segment: it goes on to the subgoal it was heading for, as the
user would have done from there. Two control laws make v and omega of it:

- `Plain` turns towards u and drives at the demonstrated speed; it knows nothing of what the robot
  can do. A segment hands over within 0.25 m of its subgoal.
- `Pursuit` rolls the response out from the current state and pursues a point ahead on it, slower
  where it bends. It is the response that comes back to the shown way after a push, and does not turn
  sharply at a subgoal (`dollop.law.line`). A segment hands over where the place on the response that
  is nearest to the robot belongs to the next.

Both drive at the speed that was shown there, and wait at a subgoal as long as the demonstrator did.

The paper gives neither the rule of handing over nor a controller: both are reconstructions.
"""

from bisect import bisect_right
from math import atan2, copysign, cos, dist, inf, pi, sin, sqrt

import numpy as np

from dollop.pose import towards, wrapped
from dollop.robot.avoidance import CREEPING
from dollop.robot.guidance import PIONEER_FOLLOWING, STEP

__all__ = ["CONTROL_LAWS"]

SOONEST = 1e-6
"""Time in s that is none."""
FACING = 0.1
"""Angle in rad within which a robot that stands looks where it should."""


class Supervisor:
    """Which segment is in force, and whether the robot gets on with it (Sec. III; reconstruction).

    Parameters
    ----------
    guidance : Guidance
    speeds : (K,) sequence of float
        At which each segment was demonstrated, in m/s.
    robot : Unicycle, or another
        Its limits, period and pose.

    rules : Following

    Attributes
    ----------
    active : int
        The segment in force.
    done : bool
        Whether the last one has handed over, and the robot has waited there.
    hopeless : bool
        Whether there is no progress, however slow the robot.
    waits : list of [int, float]
        Where the robot is still to stand, 0 being the start and k the k-th subgoal, and for how
        long in s, as the demonstrator did.
    stood : dict of int to float
        How long in s it has stood there.
    pace : float
        Share of the demonstrated speed. It is halved when there is no progress: the slower a robot,
        the more exactly it can follow the direction of the law, whose Lyapunov measure falls
        everywhere, and so every segment hands over.
    elapsed : float
        Time in s since the last command.
    standing : bool
        Whether the robot has been told to stand.
    leapt : bool
        Whether the last pose was one that no robot drives to in a period.
    edge, most : float
        How far in m it is from what is nearest, and the speed in m/s from which it can still brake in
        time.
    """

    def __init__(self, guidance, speeds, robot, rules=PIONEER_FOLLOWING):
        self.guidance, self.limits, self.rules = guidance, robot.limits, rules
        self.period = self.elapsed = robot.period
        self.speeds = [float(speed) for speed in speeds]
        self.active, self.handed_over, self.hopeless, self.standing = 0, False, False, True
        self.waits, self.stood = [], {}
        self.fastest = min(self.limits.speed, rules.look_ahead / (2 * self.period))
        self.gain = min(rules.turn_gain, 1 / self.period)
        self.patience = max(rules.patience, 2 * pi / self.limits.turn, 4 * STEP / self.limits.speed)
        self.jump = max(rules.jump, 2 * self.limits.speed * self.period)
        self.last, self.leapt, self.edge, self.most = None, False, inf, inf
        self.tight = guidance.obstacles.rules.tight if guidance.obstacles else 0.0
        self.expect_to_wait(0)
        self.restart()

    @property
    def done(self):
        """Bool: see the attributes."""
        return self.handed_over and not self.waits

    def restart(self):
        """Begin the segment in force: at its full pace, without a detour, and with new patience."""
        self.pace, self.best, self.waited = 1.0, inf, 0.0
        self.guidance.detours.pop(self.active, None)

    def notice_kidnapping(self, x, y):
        """Begin the segment in force afresh where the robot finds itself elsewhere."""
        if self.last is None and self.waits and dist(self.guidance.law.start, (x, y)) > self.rules.reach:
            self.waits, self.stood = [], {}  # whoever does not begin at the start does not wait there
        jump = max(self.jump, 2 * self.limits.speed * self.elapsed)
        self.leapt = self.last is not None and dist(self.last, (x, y)) > jump
        if self.leapt:
            if self.waits and self.waits[0][0]:  # carried off while it stood: back there
                self.active = self.waits[0][0] - 1
            self.waits = []
            self.handed_over = False  # nor has it done the task before it stands at the end
            self.restart()
        self.last, self.most = (x, y), inf

    def expect_progress(self, remaining, least):
        """Insist where `remaining` has not fallen by more than `least` for some time."""
        self.waited += self.elapsed
        if remaining < self.best - least:
            self.best, self.waited = remaining, 0.0
        elif self.waited > self.patience:
            self.insist()

    def insist(self):
        """Take a detour; where there is one already, halve the pace, and in the end give up."""
        self.best, self.waited = inf, 0.0
        if self.guidance.obstacles and self.active not in self.guidance.detours:
            self.guidance.detour(self.active)
        else:
            self.pace /= 2
            self.hopeless = self.pace < self.rules.slowest

    def hand_over(self, segment):
        """Put `segment` in force, once the robot has stood as long as was shown."""
        for place in range(self.active + 1, segment + 1):
            self.expect_to_wait(place)
        self.handed_over = segment == len(self.speeds)
        if not self.handed_over:
            self.active = segment
            self.restart()

    def remap(self, guidance):
        """Go on by another map, in the same segment and with the patience that is left."""
        detoured = self.active in self.guidance.detours
        self.guidance = guidance
        if detoured:
            guidance.detour(self.active)

    def begin(self, segment, waits, stood):
        """Put `segment` in force, where the robot is still to wait, and has waited, as told."""
        self.active, self.waits, self.stood = segment, waits, stood
        self.restart()

    def expect_to_wait(self, place):
        """Remember to stand at the start (0) or a subgoal, if that was shown and is not done yet."""
        left = self.guidance.pauses[place] - self.stood.get(place, 0.0)
        if left >= self.period / 2:
            self.waits.append([place, left])
            self.stood.setdefault(place, 0.0)

    def wait(self, theta):
        """Brake, stand as long as was shown, and turn to where the demonstrator came from or went to."""
        place, left = self.waits[0]
        if self.standing:
            self.waits[0][1] = left - self.elapsed
            self.stood[place] += self.elapsed
        if self.waits[0][1] < SOONEST:
            self.waits.pop(0)
        error = wrapped(self.guidance.headings[place] - theta)
        return 0.0, self.turning(error) if self.standing and abs(error) > FACING else 0.0

    def turning(self, error):
        """Turning rate in rad/s by which an error in rad fades, and no faster than it can be ended."""
        most = min(self.gain * abs(error), sqrt(2 * self.limits.turn_acceleration * abs(error)))
        return copysign(min(most, self.limits.turn), error)

    def shown_speeds(self, k, places):
        """Speeds (N,) in m/s shown at places (N, 2) of segment k, within what the robot can."""
        speeds = self.speeds[k] * self.guidance.shown_pace(k, places)
        return np.clip(speeds, self.rules.least_speed, self.fastest)

    def arriving(self, x, y):
        """The speed in m/s from which the robot comes to rest where it is to stand, if that is next."""
        last = self.active + 1 == len(self.speeds)
        if not last and self.guidance.pauses[self.active + 1] < self.period / 2:
            return inf
        return max(
            sqrt(2 * self.limits.acceleration * dist(self.guidance.goals[self.active], (x, y))),
            CREEPING,
        )

    def look(self, x, y, theta):
        """See how near things are, and from which speed the robot can still brake in time."""
        if self.guidance.obstacles:
            braking = self.limits.acceleration, self.period
            self.edge, self.most = self.guidance.obstacles.edge_and_limit(x, y, theta, *braking)


class Plain(Supervisor):
    """Turn towards the law's direction, and drive at the demonstrated speed s.

    With e the heading error in rad, v = s cos e and omega = 3 e; where e is sharp, v = 0.
    """

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose in m and rad."""
        self.notice_kidnapping(x, y)
        if not self.waits and self.guidance.reached(self.active, x, y, self.rules.reach):
            self.hand_over(self.active + 1)
        if self.waits:
            return self.wait(theta)
        if self.handed_over:
            return 0.0, 0.0
        remaining = self.guidance.remaining(self.active, x, y)
        self.expect_progress(remaining, 0.02 * min(remaining, 1.0))
        ux, uy = self.guidance.direction(self.active, x, y)
        if ux == uy == 0.0:
            return 0.0, 0.0
        error = wrapped(atan2(uy, ux) - theta)
        shown = min(float(self.shown_speeds(self.active, [(x, y)])[0]), self.arriving(x, y))
        speed = 0.0 if abs(error) > self.rules.sharp else shown * self.pace * cos(error)
        self.look(x, y, theta)
        return min(speed, self.most), self.turning(error)


class Pursuit(Supervisor):
    """Pursue a point 0.35 m ahead on the response, no faster than the robot can turn there.

    The circle through robot and point has the curvature 2 sin(e) / distance (Coulter,
    "Implementation of the pure pursuit path tracking algorithm", CMU-RI-TR-92-01).
    """

    places = ((inf, inf),)  # no response yet: any pose is astray
    at = 0

    def __init__(self, guidance, speeds, robot, rules=PIONEER_FOLLOWING):
        super().__init__(guidance, speeds, robot, rules)
        self.ahead = max(round(rules.look_ahead / STEP), 1)

    def plan(self, x, y):
        """Roll the response out from x, y in m, and straight on beyond its end, to be pursued."""
        while self.came and self.active + 1 < len(self.speeds):  # it need not come there again
            self.hand_over(self.active + 1)
            self.came = self.guidance.reached(self.active, x, y, self.rules.reach)
        self.places, self.segments = self.guidance.way(self.active, x, y)
        self.at, self.end = 0, len(self.places) - 1
        last = len(self.speeds) - 1
        end_x, end_y = self.places[-1]
        ux, uy = towards(end_x, end_y, *self.places[max(self.end - 2, 0)])
        if ux == uy == 0.0:
            ux, uy = self.guidance.direction(last, end_x, end_y)
        on = range(1, self.ahead + 1)
        self.places += [(end_x + i * STEP * ux, end_y + i * STEP * uy) for i in on]
        places, segments = np.array(self.places), np.array(self.segments + [last] * self.ahead)
        speeds = np.empty(len(segments))
        for k in set(self.segments) | {last}:
            mine = segments == k
            speeds[mine] = self.shown_speeds(k, places[mine])
        speeds[self.stops(segments)] = CREEPING
        self.planned = bend_speeds(places, speeds, self.limits).tolist()

    def stops(self, segments):
        """Where among the places of segments (M,) the robot comes to rest: its waits and the end."""
        waits = np.array(self.guidance.pauses[1:]) >= self.period / 2
        ends = np.flatnonzero(np.diff(segments[: self.end + 1]) > 0)
        return [*ends[waits[segments[ends]]], self.end]

    def command(self, x, y, theta):
        """v in m/s and omega in rad/s for a pose in m and rad."""
        self.notice_kidnapping(x, y)
        if dist(self.places[self.at], (x, y)) > self.rules.stray:
            self.plan(x, y)
        if not self.waits:
            self.came = self.came or self.guidance.reached(self.active, x, y, self.rules.reach)
            self.advance(x, y)
        if self.waits:
            return self.wait(theta)
        if self.handed_over:
            return 0.0, 0.0
        ahead = self.pursued(x, y)
        ux, uy = towards(*ahead, x, y)
        self.look(x, y, theta)
        if self.edge <= self.tight:
            ux, uy = self.guidance.obstacles.outwards(x, y, ux, uy)
        error = wrapped(atan2(uy, ux) - theta)
        curvature = 2 * sin(error) / max(dist(ahead, (x, y)), STEP)
        speed = self.pace * min(self.planned[self.at], self.limits.turn / max(abs(curvature), 1e-9))
        speed = min(speed, self.most)
        self.expect_progress(self.end - self.at, 0)
        off = abs(error)
        if off > self.rules.sharp or speed == 0.0 or (self.most < CREEPING and off > FACING):
            return 0.0, self.turning(error)
        return speed, curvature * speed

    def pursued(self, x, y):
        """The place 0.35 m ahead, or a nearer one where going straight there would cut a corner."""
        obstacles, farthest = self.guidance.obstacles, self.at + self.ahead
        if self.active in self.guidance.detours and not self.handed_over:  # a detour is driven to its end
            farthest = min(farthest, max(self.last_of(self.active), self.at + 1))
        for place in self.places[farthest : self.at + 1 : -1]:
            if not obstacles or not obstacles.cuts_corner(x, y, *place):
                return place
        return self.places[self.at + 1]

    def last_of(self, k):
        """Index of the last place of a segment that is in force."""
        return bisect_right(self.segments, k) - 1

    def restart(self):
        """As any supervisor does, and come to the subgoal anew."""
        super().restart()
        self.came = False

    def remap(self, guidance):
        """As any supervisor does, and roll the response out anew."""
        super().remap(guidance)
        self.places, self.at = Pursuit.places, 0

    def insist(self):
        """As any supervisor does, and roll the response out anew."""
        super().insist()
        self.places, self.at = Pursuit.places, 0

    def advance(self, x, y):
        """Move on to the nearest place in the look-ahead, and hand over where the response does.

        The whole look-ahead counts: before a sharp turn at a subgoal the next place may be farther
        off, and those after the turn nearer. No segment hands over before the robot has come within
        reach of its subgoal.
        """
        window = range(min(self.at + self.ahead, self.end), self.at - 1, -1)
        nearest = min(window, key=lambda i: dist(self.places[i], (x, y)))
        while self.segments[nearest] > self.active and self.came:
            self.hand_over(self.active + 1)
            self.came = self.guidance.reached(self.active, x, y, self.rules.reach)
        if self.segments[nearest] > self.active:
            nearest = self.last_of(self.active)
        self.at = nearest
        if self.at == self.end and self.guidance.reached(self.active, x, y, self.rules.reach):
            self.hand_over(self.active + 1)


def bend_speeds(places, speeds, limits):
    """Speeds (N,) in m/s at which to pass places (N, 2): as demonstrated, but slower in bends.

    A fifth of the turning rate stays in hand for corrections. Before a bend the speed falls no
    faster than it can.
    """
    steps = np.diff(places, axis=0)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    headings = np.pad(headings, (3, 4), mode="edge")  # a corner at a subgoal is turned within 0.3 m
    bends = np.abs(headings[6:] - headings[:-6]) / (6 * STEP)
    speeds = np.minimum(speeds, 0.8 * limits.turn / np.maximum(bends, 1e-9))
    braked = 2 * limits.acceleration * STEP * np.arange(len(places))  # v^2 falls by 2 a s over s
    return np.sqrt(np.minimum.accumulate((speeds**2 + braked)[::-1])[::-1] - braked)


CONTROL_LAWS = {"plain": Plain, "pursuit": Pursuit}
"""By name: classes whose `command` takes a pose and returns v in m/s and omega in rad/s."""
