"""The nodes that the command is tried on: one of each thing that a verb can show, call, set or listen to."""

import sys
import threading
import time
from functools import partial

import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_services_default
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger

from course.foundation.waiting import wait_until

STEP = 0.05  # s a Fibonacci number takes
FOUND = 10.0  # s until who sends a goal is known


def add(request, response):
    """Answer /add_two_ints."""
    response.sum = request.a + request.b
    return response


def fibonacci(node, goal):
    """Count up to the goal's order, with feedback, until cancelled."""
    # Who has sent the goal may not be known as a listener yet, and would miss the first feedback.
    wait_until(lambda: node.count_subscribers("/fibonacci/_action/feedback"), FOUND)
    feedback = Fibonacci.Feedback(sequence=[0, 1])
    for _ in range(1, goal.request.order):
        if goal.is_cancel_requested:
            goal.canceled()
            return Fibonacci.Result()
        feedback.sequence.append(feedback.sequence[-1] + feedback.sequence[-2])
        goal.publish_feedback(feedback)
        time.sleep(STEP)
    goal.succeed()
    return Fibonacci.Result(sequence=feedback.sequence)


def refuse_negative(parameters):
    """Refuse a negative threshold with a reason, and a robot called 'nobody' without one."""
    for parameter in parameters:
        if parameter.name == "threshold" and parameter.value < 0:
            return SetParametersResult(successful=False, reason="must not be negative")
        if parameter.name == "robot_name" and parameter.value == "nobody":
            return SetParametersResult(successful=False)
    return SetParametersResult(successful=True)


def make_parameters(node):
    """Declare a parameter of each kind that the tests read or set."""
    node.declare_parameter("robot_name", "atlas")
    speed = FloatingPointRange(from_value=0.0, to_value=5.0, step=0.5)
    node.declare_parameter(
        "max_speed", 1.5, ParameterDescriptor(description="Top speed in m/s", floating_point_range=[speed])
    )
    node.declare_parameter("debug_mode", False)
    node.declare_parameter("serial", 42, ParameterDescriptor(read_only=True))
    node.declare_parameter("gains", [1.0, 2.5])
    node.declare_parameter("joints", ["hip", "knee"])
    node.declare_parameter("threshold", 50.0)
    node.declare_parameter("pid.p", 1.0)
    node.declare_parameter("pid.i", 0.1)
    node.add_on_set_parameters_callback(refuse_negative)


def main():
    """Run until the standard input is closed."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    names = ("add_two_ints_server", "fibonacci_action_server", "parameter_node", "talker", "listener", "_hidden")
    nodes = {name: rclpy.create_node(name) for name in names}
    # A service that never answers, for its node is not spun, and whose parameter services do not answer either.
    nodes["silent"] = rclpy.create_node("silent", start_parameter_services=False)
    nodes["silent"].create_service(Trigger, "never", lambda request, response: response)

    service = nodes["add_two_ints_server"].create_service(AddTwoInts, "add_two_ints", add)
    clock = nodes["add_two_ints_server"].get_clock()
    service.configure_introspection(clock, qos_profile_services_default, ServiceIntrospectionState.CONTENTS)
    ActionServer(
        nodes["fibonacci_action_server"],
        Fibonacci,
        "fibonacci",
        partial(fibonacci, nodes["fibonacci_action_server"]),
        goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
        cancel_callback=lambda goal: CancelResponse.ACCEPT,
    )
    make_parameters(nodes["parameter_node"])

    talker, listener = nodes["talker"], nodes["listener"]
    talker.declare_parameter("spare", "part", ParameterDescriptor(dynamic_typing=True))
    chatter = talker.create_publisher(String, "chatter", 10)
    numbers = talker.create_publisher(Float64MultiArray, "numbers", 10)
    values = Float64MultiArray(data=[0.5] * 200)
    talker.create_timer(0.05, lambda: (chatter.publish(String(data="Hello")), numbers.publish(values)))
    listener.create_subscription(String, "chatter", lambda message: None, 10)
    # What `topic pub` sends comes back word for word.
    reliable = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
    heard = listener.create_publisher(String, "heard", reliable)
    listener.create_subscription(
        Twist, "cmd_vel", lambda twist: heard.publish(String(data=f"{twist.linear.x} {twist.angular.z}")), reliable
    )

    others = MultiThreadedExecutor(num_threads=4)
    # Each message wakes its executor, which then looks at all of its nodes.
    executors = {"talker": SingleThreadedExecutor(), "listener": SingleThreadedExecutor()}
    for name, node in nodes.items():
        if name != "silent":
            executors.get(name, others).add_node(node)
    for executor in (others, *executors.values()):
        threading.Thread(target=executor.spin, daemon=True).start()
    print("ready", flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main()
