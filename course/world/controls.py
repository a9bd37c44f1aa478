"""Controls of a running world through ROS: pause, speed, room and scanner, the robot's place, obstacles.

Only a world in real time has them.  In fast mode, where a drive must be repeatable, nothing can be changed.
"""

import dataclasses
import math
from pathlib import Path
from typing import Protocol

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PointStamped, PoseWithCovarianceStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Empty
from visualization_msgs.msg import Marker

from course.world.geometry import Pose
from course.world.laser import Laser
from course.world.rooms import Room
from course.world.simulation import Simulation

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LAST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # who joins late is given only the last one
SPEEDS = (0.1, 4.0)


class Controlled(Protocol):
    """The part of the world that its controls use."""

    simulation: Simulation
    laser: Laser
    began: Time

    def reset(self, room: str | Path | Room | None = None) -> None:
        """Put the robot at the start of `room`."""

    def check_room(self, room: str | Path | Room) -> None:
        """Raise the errors of `reset` for this room."""

    def place(self, pose: Pose) -> None:
        """Put the robot at `pose`; raises WorldError if it cannot stand there."""

    def drop(self, x: float, y: float) -> None:
        """Put an obstacle at x, y (m); raises WorldError if the robot stands there."""


class Controls:
    """The controls of a world that runs in real time.

    Parameters, which may be set while it runs: `paused`, `speed` (1 is real time), `room` (the robot starts again
    there), and `beams`, `angle_min` (rad) and `noise` (m) of the scanner.  Service `~/reset` (std_srvs/Empty): puts the
    robot at its start and removes dropped obstacles.  Topics, which RViz's tools publish: `initialpose`
    (geometry_msgs/PoseWithCovarianceStamped) puts the robot somewhere else, `clicked_point`
    (geometry_msgs/PointStamped) drops an obstacle; an impossible place is refused with a warning.  `walls`
    (visualization_msgs/Marker, a list of lines, the newest kept for late subscribers) has the walls and obstacles,
    stamped with the time at which the robot was put at its start; `text` is the name of the room.  Its namespace and
    number stay the same, so that RViz draws each in the place of the one before.
    """

    def __init__(self, node: Node, world: Controlled) -> None:
        """Add the controls to `node`, usually the `world` itself."""
        self._node, self._world = node, world
        limits = [FloatingPointRange(from_value=SPEEDS[0], to_value=SPEEDS[1])]
        self.paused: bool = node.declare_parameter("paused", False).value
        self.speed: float = node.declare_parameter(
            "speed", 1.0, ParameterDescriptor(floating_point_range=limits, description="1 is real time")
        ).value
        laser = world.laser
        for name, value in (
            ("room", world.simulation.room.name),
            ("beams", laser.beams),
            ("angle_min", laser.angle_min),
            ("noise", laser.noise),
        ):
            if not node.has_parameter(name):
                node.declare_parameter(name, value)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._change)
        node.create_service(Empty, "~/reset", self._reset)
        node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._place, 10)
        node.create_subscription(PointStamped, "clicked_point", self._drop, 10)
        self._walls = node.create_publisher(Marker, "walls", LAST)
        self.show_walls()

    def show_walls(self) -> None:
        """Publish the walls and obstacles as they are now."""
        room = self._world.simulation.room
        marker = Marker(ns="walls", type=Marker.LINE_LIST, action=Marker.ADD, text=room.name)
        marker.header.stamp, marker.header.frame_id = self._world.began, "odom"
        marker.scale.x, marker.color.a, marker.pose.orientation.w = 0.03, 1.0, 1.0
        marker.points = [Point(x=float(x), y=float(y)) for x, y in room.segments.reshape(-1, 2)]
        self._walls.publish(marker)

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        wanted = {parameter.name: parameter.value for parameter in parameters}
        try:
            self._scanner(wanted)
            if "room" in wanted:
                self._world.check_room(wanted["room"])
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _change(self, parameters: list[Parameter]) -> None:
        wanted = {parameter.name: parameter.value for parameter in parameters}
        self.paused = wanted.get("paused", self.paused)
        self.speed = wanted.get("speed", self.speed)
        if (laser := self._scanner(wanted)) != self._world.laser:
            self._world.laser = laser
        if "room" in wanted:
            self._world.reset(wanted["room"])

    def _scanner(self, wanted: dict[str, object]) -> Laser:
        """Return the scanner with these changes; raises WorldError for impossible ones."""
        changes = {name: wanted[name] for name in ("beams", "angle_min", "noise") if name in wanted}
        laser = dataclasses.replace(self._world.laser, **changes)  # type: ignore[arg-type]
        if "beams" in changes:
            turn = math.copysign(2.0 * math.pi, laser.angle_increment)
            laser = dataclasses.replace(laser, angle_increment=turn / laser.beams)
        return laser

    def _reset(self, _: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._world.reset()
        return response

    def _place(self, message: PoseWithCovarianceStamped) -> None:
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        heading = 2.0 * math.atan2(turn.z, turn.w)
        try:
            self._world.place((position.x, position.y, heading))
        except ValueError as error:
            self._node.get_logger().warning(str(error))

    def _drop(self, message: PointStamped) -> None:
        try:
            self._world.drop(message.point.x, message.point.y)
        except ValueError as error:
            self._node.get_logger().warning(str(error))
