"""Hints on what is of ROS 1, as many texts and answers on the web show it, with its counterpart in ROS 2."""

import re

LIBRARIES = {
    "rospy": "In ROS 2 it is `rclpy`, and a node is a class: `class MyNode(Node)`, with `from rclpy.node import Node`.",
    "roslib": "ROS 2 needs nothing in its place: `import rclpy` is enough.",
    "actionlib": "In ROS 2: `from rclpy.action import ActionServer`, or `ActionClient`.",
    "dynamic_reconfigure": "In ROS 2 every node has parameters: `self.declare_parameter('name', default)`.",
}
USED = {  # names of rospy, and what a node of ROS 2 writes
    "get_param": "`self.declare_parameter('name', default)`, then `self.get_parameter('name').value`",
    "set_param": "`self.set_parameters([Parameter('name', value=...)])`",
    "Service": "`self.create_service(TheType, 'name', self.callback)`",
    "ServiceProxy": "`self.create_client(TheType, 'name')`",
    "wait_for_service": "`client.wait_for_service(timeout_sec=...)`",
    "Publisher": "`self.create_publisher(TheType, 'topic', 10)`",
    "Subscriber": "`self.create_subscription(TheType, 'topic', self.callback, 10)`",
    "Timer": "`self.create_timer(period, self.callback)`",
    "Rate": "a timer, `self.create_timer(period, self.callback)`",
    "init_node": "`rclpy.init()`, and the name in `super().__init__('name')`",
    "spin": "`rclpy.spin(node)`",
    "is_shutdown": "`rclpy.ok()`",
    "sleep": "`time.sleep(seconds)`",
    "get_time": "`self.get_clock().now()`",
    "Time": "`self.get_clock().now()`",
    "logdebug": "`self.get_logger().debug(...)`",
    "loginfo": "`self.get_logger().info(...)`",
    "logwarn": "`self.get_logger().warning(...)`",
    "logerr": "`self.get_logger().error(...)`",
    "ROSInterruptException": "`KeyboardInterrupt` and `rclpy.executors.ExternalShutdownException`",
}
COMMANDS = {
    "rosservice": "ros2 service",
    "rostopic": "ros2 topic",
    "rosnode": "ros2 node",
    "rosparam": "ros2 param",
    "rosrun": "ros2 run",
    "rosmsg": "ros2 interface show",
    "rossrv": "ros2 interface show",
    "roscore": "",
}


def library(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on an import of a library of ROS 1, or on a name of it that is used without one; '' if neither.

    A library that is needed for a name is not missing: `rospy.get_param(...)` has a counterpart of its own.
    """
    name = found[1].split(".")[0]
    if name not in LIBRARIES:
        return ""
    used = re.search(rf"\b{name}\.(\w+)", code)
    if used and used[1] in USED:
        return f"`{used[0]}` is from ROS 1. In ROS 2: {USED[used[1]]}."
    return f"`{name}` is a library from ROS 1. {LIBRARIES[name]}"


def command(line: str) -> str:
    """Return the hint on a command line of ROS 1, `rosservice list`; '' for another one."""
    words = line.split()
    name = words[0] if words else ""
    if name not in COMMANDS:
        return ""
    if not (now := COMMANDS[name]):
        return f"`{name}` is from ROS 1. ROS 2 needs nothing in its place: nodes find each other."
    return f"`{name}` is from ROS 1. In ROS 2: `{' '.join([now, *words[1:]])}`."
