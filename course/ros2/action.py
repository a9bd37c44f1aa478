"""`ros2 action`: list the actions, show their servers and clients, and send a goal."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from course.errors import RosError
from course.ros import messages
from course.ros.elsewhere import tell_if_alone
from course.ros.graph import COMMAND_PREFIX, Graph, uninterrupted
from course.ros.messages import Message, Stamp
from course.ros.server_status import LATE, ServerStatus, wait_for_answer, wait_for_server
from course.ros2 import completion, grammar, printing, service
from course.ros2.grammar import Verb

if TYPE_CHECKING:  # loaded when the verb runs, and not for its help
    from rclpy.action import ActionClient
    from rclpy.action.client import ClientGoalHandle

# The topics of `echo`: name, the part of the action's class with its type, and quality of service.
INTERFACES = {
    "GOAL_SERVICE": ("send_goal/_service_event", "SendGoalService", "service"),
    "CANCEL_SERVICE": ("cancel_goal/_service_event", "CancelGoalService", "service"),
    "RESULT_SERVICE": ("get_result/_service_event", "GetResultService", "service"),
    "FEEDBACK_TOPIC": ("feedback", "FeedbackMessage", "topic"),
    "STATUS_TOPIC": ("status", "GoalStatusMessage", "status"),
}
CANCEL_TIMEOUT = 5.0  # s that Ctrl-C waits for the server to accept the cancel request


def add_list_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 action list`."""
    grammar.add_strategy_arguments(parser)
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action type")
    parser.add_argument(
        "-c", "--count-actions", action="store_true", help="Only display the number of actions discovered"
    )


def list_actions(args: Namespace) -> None:
    """Print the names of the actions."""
    with Graph(args) as graph:
        graph.settle()
        tell_if_alone(graph)
        found = graph.actions()
    service.print_names(found, count=args.count_actions, types=args.show_types)


def add_info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 action info`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("action_name", help="Name of the ROS action to get info (e.g. '/fibonacci')"),
        completion.action_names,
    )
    parser.add_argument("-t", "--show-types", action="store_true", help="Additionally show the action type")
    parser.add_argument(
        "-c", "--count", action="store_true", help="Only display the number of action clients and action servers"
    )


def info(args: Namespace) -> None:
    """Print the nodes that call an action, and those that serve it."""
    from rclpy.expand_topic_name import expand_topic_name
    from rclpy.validate_full_topic_name import validate_full_topic_name

    name = expand_topic_name(args.action_name, "_", "/")
    validate_full_topic_name(name)
    with Graph(args) as graph:
        graph.settle()
        nodes = list(dict.fromkeys(graph.nodes(hidden=True)))

        def having(kind: str) -> list[tuple[str, list[str]]]:
            found = ((node, dict(graph.of_node(kind, node.full_name, hidden=True)).get(name)) for node in nodes)
            return [(node.full_name, types) for node, types in found if types]

        clients, servers = having("action_client"), having("action_server")
    print(f"Action: {args.action_name}")
    for title, found in (("clients", clients), ("servers", servers)):
        print(f"Action {title}: {len(found)}")
        for node, types in [] if args.count else found:
            print(f"    {node} [{', '.join(types)}]" if args.show_types else f"    {node}")


def add_type_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 action type`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("action_name", help="Name of the ROS action to get type (e.g. '/fibonacci')"),
        completion.action_names,
    )


def show_type(args: Namespace) -> int:
    """Print the type of an action; return 1 if there is no such action."""
    with Graph(args) as graph:
        types = graph.types_of(args.action_name, graph.actions)
    print("\n".join(types), end="\n" if types else "")
    return 0 if types else 1


def add_send_goal_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 action send_goal`."""
    grammar.complete_with(
        parser.add_argument("action_name", help="Name of the ROS action (e.g. '/fibonacci')"), completion.action_names
    )
    grammar.complete_with(
        parser.add_argument("action_type", help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')"),
        completion.action_type,
    )
    group = parser.add_mutually_exclusive_group()
    grammar.complete_with(
        group.add_argument(
            "goal", nargs="?", default="{}", help="Goal request values in YAML format (e.g. '{order: 10}')"
        ),
        completion.goal_prototype,
    )
    group.add_argument("--stdin", action="store_true", help="Read goal from standard input")
    parser.add_argument("-f", "--feedback", action="store_true", help="Echo feedback messages for the goal")
    parser.add_argument(
        "-t",
        "--timeout",
        metavar="N",
        type=grammar.nonnegative_int,
        help="Wait for N seconds until the goal is done (default: wait indefinitely)",
    )


def send_goal(args: Namespace) -> int | str | None:
    """Send a goal, print its feedback and result; Ctrl-C cancels it."""
    import yaml

    try:
        action = messages.get_action(args.action_type)
    except messages.INVALID_TYPE:
        grammar.tell_near(args.action_type, messages.all_types("action"))
        raise RosError("The passed action type is invalid") from None
    goal = action.Goal()
    stamps: list[Stamp] = []
    try:
        messages.fill(goal, yaml.safe_load(grammar.read_stdin() if args.stdin else args.goal), stamps)
    except yaml.YAMLError as error:
        return f"Failed to populate message fields: {error}"
    except Exception as error:
        return f"Failed to populate message fields: {error!r}"
    with Graph(talks=True, node_name=f"{COMMAND_PREFIX}_send_goal_{args.action_type.replace('/', '_')}") as graph:
        from rclpy.action import ActionClient

        client = ActionClient(graph.node, action, args.action_name)
        try:
            return _follow(graph, client, goal, stamps, args)
        finally:
            client.destroy()


def _follow(
    graph: Graph, client: ActionClient, goal: Message, stamps: list[Stamp], args: Namespace
) -> int | str | None:
    """Send the goal and print its progress; return 1 if `--timeout` ends first, or why there will be no result."""

    accepted = False
    early: list[Message] = []  # feedback that arrives before the goal is accepted; printed afterwards

    def show(feedback: Message) -> None:
        if accepted:
            print(f"Feedback:\n    {messages.to_yaml(feedback.feedback)}")
        else:
            early.append(feedback)

    status = ServerStatus(f"{args.action_name}/_action/send_goal")
    print("Waiting for an action server to become available...")
    if report := wait_for_server(graph, status, client.server_is_ready, graph.actions, "action", args.action_type):
        return report
    for stamp in stamps:
        stamp(graph.node.get_clock().now().to_msg())
    print(f"Sending goal:\n     {messages.to_yaml(goal)}")
    sent = client.send_goal_async(goal, show if args.feedback else None)
    wait_for_answer(graph, lambda: sent.done() or status.report())
    if not graph.spin(sent.done, LATE):  # the goal's end may be known before its answer has arrived
        return f"The goal got no answer. {status.report()}"
    handle = sent.result()
    if handle is None:
        raise RosError(f"Exception while sending goal: {sent.exception()!r}")
    if not handle.accepted:
        print("Goal was rejected.")
        return None
    try:
        with uninterrupted():
            print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n")
            accepted = True
            for feedback in early:
                show(feedback)
            finished = handle.get_result_async()
        in_time = graph.spin(lambda: finished.done() or status.ending(), args.timeout)
    except KeyboardInterrupt:
        _cancel(graph, handle)
        raise
    if not in_time:
        print(f"Timeout is reached after {args.timeout} seconds.")
        _cancel(graph, handle)
        return 1
    if not finished.done():
        return f"The goal has no result. {status.ending()}"
    if finished.result() is None:
        raise RosError(f"Exception while getting result: {finished.exception()!r}")
    print(f"Result:\n    {messages.to_yaml(finished.result().result)}")
    print(f"Goal finished with status: {_status(finished.result().status)}")
    if _status(finished.result().status) == "ABORTED" and graph.wait_until(status.report, LATE):
        print(status.report(), file=sys.stderr)
    return None


def _cancel(graph: Graph, handle: ClientGoalHandle) -> None:
    print("Canceling goal...")
    cancelled = handle.cancel_goal_async()
    if not graph.spin(cancelled.done, CANCEL_TIMEOUT) or not cancelled.result().goals_canceling:
        raise RosError("Failed to cancel goal")
    print("Goal canceled.")


def _status(status: int) -> str:
    """Return the name that action_msgs/msg/GoalStatus has for a status."""
    from action_msgs.msg import GoalStatus

    names = ("ACCEPTED", "EXECUTING", "CANCELING", "SUCCEEDED", "CANCELED", "ABORTED")
    return next((name for name in names if getattr(GoalStatus, f"STATUS_{name}") == status), "UNKNOWN")


def add_echo_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 action echo`."""
    grammar.complete_with(
        parser.add_argument("action_name", help="Name of the ROS action to echo (e.g. '/fibonacci')"),
        completion.action_names,
    )
    grammar.complete_with(
        parser.add_argument(
            "action_type", nargs="?", help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')"
        ),
        completion.action_type,
    )
    parser.add_argument(
        "--interfaces",
        "-i",
        metavar="interfaces_name_list",
        help='Specify a action interfaces list are output. "|" is used as a delimiter for multiple action interfaces. '
        'Action interfaces include "GOAL_SERVICE", "CANCEL_SERVICE", "RESULT_SERVICE", "FEEDBACK_TOPIC" and '
        '"STATUS_TOPIC". If this option is not set, output messages from all interfaces of the action.',
    )
    printing.add_event_arguments(parser)


def echo(args: Namespace) -> str | None:
    """Print the goals, feedback, results and states of an action until Ctrl-C (a verb of releases after Jazzy).

    Goals, results and cancel requests are published only where introspection is on, which Jazzy's actions cannot do.
    """
    chosen = list(INTERFACES) if args.interfaces is None else [each.strip() for each in args.interfaces.split("|")]
    if args.interfaces == "":
        return "Input action interface name is empty."
    if wrong := [each for each in chosen if each.upper() not in INTERFACES]:
        return f'"{wrong[0]}" is incorrect interface name.'
    with Graph(talks=True) as graph:
        action = _find_type(graph, args)
        for interface in dict.fromkeys(each.upper() for each in chosen):
            _listen(graph, action, interface, args)
        graph.spin()
    return None


def _find_type(graph: Graph, args: Namespace) -> Any:
    """Return the class of the action; raises RosError if it is not there or cannot be loaded."""
    if args.action_type is not None:
        try:
            return messages.get_action(args.action_type)
        except messages.INVALID_TYPE:
            raise RosError(f"The action type '{args.action_type}' is invalid") from None
    types = graph.types_of(args.action_name, graph.actions)
    if not types:
        raise RosError(f"Cannot find type for '{args.action_name}'")
    if len(types) > 1:
        raise RosError(f"More than one type associated with action '{args.action_name}'")
    try:
        return messages.get_action(types[0])
    except messages.INVALID_TYPE:
        raise RosError(f"The action type '{types[0]}' is invalid") from None


def _listen(graph: Graph, action: Any, interface: str, args: Namespace) -> None:
    """Subscribe to one of the topics and events of an action, and print its messages under the interface's name."""
    from rclpy import qos

    def show(message: Message) -> None:
        print(f"interface: {interface}\n{printing.event_text(message, args)}")

    topic, part, kind = INTERFACES[interface]
    message_type = getattr(action.Impl, part)
    if kind == "service":
        message_type, profile = message_type.Event, qos.qos_profile_services_default
    else:
        profile = qos.qos_profile_action_status_default if kind == "status" else qos.QoSProfile(depth=10)
    graph.node.create_subscription(message_type, f"{args.action_name}/_action/{topic}", show, profile)


VERBS = {
    "echo": Verb("Echo a action", add_echo_arguments, echo),
    "info": Verb("Print information about an action", add_info_arguments, info),
    "list": Verb("Output a list of action names", add_list_arguments, list_actions),
    "send_goal": Verb("Send an action goal", add_send_goal_arguments, send_goal),
    "type": Verb("Print a action's type", add_type_arguments, show_type),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 action`."""
    grammar.add_verbs(parser, "ros2 action", VERBS)
