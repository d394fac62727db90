"""A ROS 2 node that steers one robot by a policy of teamsight, to be run on the robot: it needs rclpy, not a simulator.

It reads odometry, and poses of targets and teammates in the frame of the robot's base; it writes velocities.
"""

from __future__ import annotations

import math
from typing import Any

import rclpy
from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node

from teamsight import Controller, Detections

PERIOD = 0.1  # s, from one decision to the next
LIMITS = {"sensing_range": 2.5, "awareness_range": 4.0, "speed": 0.3 * PERIOD, "turn_limit": 2.0 * PERIOD}


class Steering(Node):  # type: ignore[misc]
    """Decides at each tick on what has arrived since the last one."""

    def __init__(self) -> None:
        super().__init__("teamsight")
        team = self.declare_parameter("team", [1, 2, 3]).value
        identity = self.declare_parameter("identity", 1).value
        # A policy that needs no identities of teammates: a camera does not tell them apart.
        self.controller = Controller("a-cmommt", "nearest", identity=identity, team=team, **LIMITS)
        self.seen: dict[str, Detections] = {}
        self.pose, self.last, self.first = (0.0, 0.0, 0.0), (0.0, 0.0), 0
        for name in ("targets", "teammates"):
            self.create_subscription(PoseArray, name, lambda message, name=name: self.see(name, message), 10)
        self.create_subscription(Odometry, "odom", self.locate, 10)
        self.velocity = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_timer(PERIOD, self.decide)

    def tick_of(self, stamp: Any) -> int:
        """Return the tick of a time, counted from the first one."""
        tick = int((stamp.sec + 1e-9 * stamp.nanosec) / PERIOD)
        self.first = self.first or tick
        return tick - self.first

    def see(self, name: str, message: Any) -> None:
        """Keep the bodies that a detector has found."""
        offsets = [(pose.position.x, pose.position.y) for pose in message.poses]
        distance, bearing = [math.hypot(*one) for one in offsets], [math.atan2(y, x) for x, y in offsets]
        self.seen[name] = Detections(distance, bearing, tick=self.tick_of(message.header.stamp))

    def locate(self, message: Any) -> None:
        """Keep the place and the heading that odometry says."""
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        self.pose = place.x, place.y, 2.0 * math.atan2(turn.z, turn.w)

    def decide(self) -> None:
        """Decide, and drive: turn and go at once, so that both end with the period."""
        tick = self.tick_of(self.get_clock().now().to_msg())
        if tick <= self.controller.tick:
            return  # the clock has not reached the next tick
        x, y, heading = self.pose
        moved, self.last = (x - self.last[0], y - self.last[1]), (x, y)
        seen, self.seen = self.seen, {}
        command = self.controller.decide(**seen, heading=heading, moved=moved, tick=tick)
        velocity = Twist()
        velocity.linear.x, velocity.angular.z = command.distance / PERIOD, command.turn / PERIOD
        self.velocity.publish(velocity)


def main() -> None:
    rclpy.init()
    rclpy.spin(Steering())


if __name__ == "__main__":
    main()
