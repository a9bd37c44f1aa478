"""The nodes that drive a world, and those that do so by half: what the reader of a cell is told of them."""

from collections.abc import Callable

from rclpy.node import Node

from course.foundation.waiting import tell_reader
from course.ros.names import full
from course.ros.rclpy_internals import RCLError

SCAN, COMMAND = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/Twist"
SILENT_CAUSE = (
    "It answers otherwise, so no callback of it waits or loops: look whether its callback for the scan keeps what it "
    "gets in the attribute that its control loop reads, and whether that publishes a command."
)


def endpoints(world: Node) -> tuple[set[tuple[str, str]], set[tuple[str, str]]]:
    """Return name and namespace of the nodes that publish commands, and of those that subscribe to the scan.

    Raises RCLError or UnicodeDecodeError while a node has an invalid name.
    """
    drivers = {(each.node_name, each.node_namespace) for each in world.get_publishers_info_by_topic("cmd_vel")}
    seers = {(each.node_name, each.node_namespace) for each in world.get_subscriptions_info_by_topic("scan")}
    return drivers, seers


def half_a_driver(world: Node) -> str:
    """Return words on a node that publishes commands or sees the scan, and the other under another name; or ''."""
    try:
        drivers, seers = endpoints(world)
        scan, command = world.resolve_topic_name("scan"), world.resolve_topic_name("cmd_vel")
        for each in sorted(drivers - seers):
            if other := _topics(world.get_subscriber_names_and_types_by_node, each, SCAN):
                return f"{full(*each)} publishes {command}, but subscribes to {other}, not to {scan}"
        for each in sorted(seers - drivers):
            if other := _topics(world.get_publisher_names_and_types_by_node, each, COMMAND):
                return f"{full(*each)} subscribes to {scan}, but publishes {other}, not {command}"
    except (RCLError, UnicodeDecodeError, RuntimeError):  # a node has an invalid name, or has ended meanwhile
        return ""
    return ""


def _topics(of_node: Callable[[str, str], list[tuple[str, list[str]]]], node: tuple[str, str], interface: str) -> str:
    """Return the topics of a node that have this type, as text."""
    return " and ".join(topic for topic, types in of_node(*node) if interface in types)


def tell_of_no_driver(world: Node, limit: float) -> None:
    """Tell the reader of a cell that a drive waits for its driver, at most `limit` s more."""
    known = half_a_driver(world)
    tell_reader(
        "This drive waits for its driver, a node that publishes cmd_vel and subscribes to scan, for at most "
        f"{limit:.0f} s more: start one before it.{known and f' {known}.'}"
    )


def tell_of_silence(names: list[str], seconds: float, *, answers: bool) -> None:
    """Tell the reader of a cell that drivers have been shown scans for so many s, and sent no command.

    One that `answers` other requests meanwhile is not busy.
    """
    who = " and ".join(names) or "The driver"
    why = SILENT_CAUSE if answers else "Its callback must not sleep, or compute or loop for so long."
    line = "" if answers else ", and `ros.stop()` then names the line"
    tell_reader(
        f"{who} has sent no command for {seconds:.0f} s, though scans come. {why} The ■ button ends this drive{line}."
    )
