"""A robot of one's own performs a task, by `dollop.perform` and by a loop of one's own."""

import dollop
from dollop.pose import moved_pose


class Cart:  # a real one tells its motors, waits until the period is over, and asks its localisation
    limits = dollop.robot.Limits(speed=0.4, turn=1.0, acceleration=0.5, turn_acceleration=2.0)
    period, radius, accuracy, localised = 0.05, 0.30, 0.0, True  # s, m, m

    def __init__(self, pose):
        self.pose = pose

    def drive(self, v, omega):
        self.pose = moved_pose(self.pose, v * self.period, omega * self.period)


task, background = dollop.Task.load("task.json"), dollop.OccupancyGrid.load("room.yaml")
start = (*task.law.start, task.law.headings[0])
run = dollop.perform(task, Cart(start), background=background)
robot = Cart(start)
controller = dollop.Controller(task, robot, background=background)
while not controller.over:
    robot.drive(*controller.step(robot.pose))
print(run, controller.run(), sep="\n")
