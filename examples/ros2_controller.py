"""A ROS 2 node that steers one robot by a policy of teamsight, to be run on the robot: it needs rclpy, not a simulator.

It reads odometry, and poses of targets and teammates in the frame of the robot's base. It writes velocities.
"""

from __future__ import annotations

import cmath
import math
from typing import Any

import rclpy  # type: ignore[import-not-found]
from geometry_msgs.msg import PoseArray, Twist  # type: ignore[import-not-found]
from nav_msgs.msg import Odometry  # type: ignore[import-not-found]
from rclpy.node import Node  # type: ignore[import-not-found]

from teamsight import Controller, Detections

PERIOD = 0.1  # s, from one decision to the next
SIGHT: dict[str, Any] = {"sensing_range": 2.5, "awareness_range": 4.0}
LIMITS: dict[str, Any] = {"speed": 0.3 * PERIOD, "turn_limit": 2.0 * PERIOD}


class Steering(Node):  # type: ignore[misc]
    """Decides at each tick on what has arrived since the last one."""

    def __init__(self) -> None:
        super().__init__("teamsight")
        team: Any = self.declare_parameter("team", [1, 2, 3]).value
        identity: Any = self.declare_parameter("identity", 1).value
        # A degree that needs no identities of teammates: a camera does not say which they are.
        self.controller = Controller("a-cmommt", "nearest", identity=identity, team=team, **SIGHT, **LIMITS)
        self.seen: dict[str, Any] = {}
        self.places: list[complex] = []  # at the last decision, and now
        self.heading, self.began = 0.0, self.now()
        for name in ("targets", "teammates"):
            self.create_subscription(PoseArray, name, lambda message, name=name: self.see(name, message), 10)
        self.create_subscription(Odometry, "odom", self.locate, 10)
        self.velocity = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_timer(PERIOD, self.decide)

    def now(self) -> float:
        """Return the present time [s]."""
        return float(1e-9 * self.get_clock().now().nanoseconds)

    def tick_of(self, time: float) -> int:
        """Return the nearest tick, since timers are never exact."""
        return round((time - self.began) / PERIOD)

    def see(self, name: str, message: Any) -> None:
        """Keep the bodies that a detector has found, unless newer ones have arrived."""
        ways = [complex(pose.position.x, pose.position.y) for pose in message.poses]
        stamp = message.header.stamp
        # The clock of a camera may be ahead.
        tick = max(self.tick_of(min(stamp.sec + 1e-9 * stamp.nanosec, self.now())), 0)
        if name not in self.seen or tick > (self.seen[name].tick or 0):
            self.seen[name] = Detections([abs(one) for one in ways], [cmath.phase(one) for one in ways], tick=tick)

    def locate(self, message: Any) -> None:
        """Keep the place and the heading that odometry says."""
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        self.places[1:] = [complex(place.x, place.y)]
        self.heading = 2.0 * math.atan2(turn.z, turn.w)

    def decide(self) -> None:
        """Decide, and drive: turn and go at once, so that both end with the period."""
        tick = self.tick_of(self.now())
        if tick <= self.controller.tick or not self.places:
            return
        gone = self.places[-1] - self.places[0]
        pose: dict[str, Any] = {"tick": tick, "heading": self.heading, "moved": (gone.real, gone.imag)}
        self.places, (seen, self.seen) = self.places[-1:], (self.seen, {})
        try:
            command = self.controller.decide(**seen, **pose)
        except ValueError as error:
            self.get_logger().warning(f"readings are ignored: {error}")
            command = self.controller.decide(**pose)
        twist = Twist()
        twist.linear.x, twist.angular.z = command.distance / PERIOD, command.turn / PERIOD
        self.velocity.publish(twist)


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(Steering())
