"""`ros2 doctor`: checks the ROS setup and reports on it, without the internet look-ups that ros2doctor makes."""

import os
import platform
import sys
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

from course.ros.graph import Graph

INTERFACES = Path("/sys/class/net")
# Flags of a network interface (linux/if.h).
LOOPBACK, MULTICAST = 0x8, 0x1000
FLAGS = {0x1: "UP", 0x2: "BROADCAST", LOOPBACK: "LOOPBACK", 0x40: "RUNNING", MULTICAST: "MULTICAST"}
# Every node publishes these topics, and few nodes subscribe to them.
EXPECTED = ("/parameter_events", "/rosout")
NEEDED = ("rclpy", "rcl_interfaces", "rmw_implementation", "std_msgs", "std_srvs", "example_interfaces")


def add_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 doctor`."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--report", "-r", action="store_true", help="Print all reports.")
    group.add_argument("--report-failed", "-rf", action="store_true", help="Print reports of failed checks only.")
    parser.add_argument("--exclude-packages", "-ep", action="store_true", help="Exclude package checks or report.")
    parser.add_argument(
        "--include-warnings",
        "-iw",
        action="store_true",
        help="Include warnings as failed checks. Warnings are ignored by default.",
    )
    parser.set_defaults(main=main)


Report = list[tuple[str, object]]  # lines of a report: name and value


class Result:
    """Counts errors and warnings of the checks, and prints each to stderr with file and line, as ros2doctor does."""

    def __init__(self) -> None:
        self.errors = self.warnings = 0

    def warn(self, text: str) -> None:
        """Print a warning."""
        self.warnings += 1
        self._print(text)

    def error(self, text: str) -> None:
        """Print an error."""
        self.errors += 1
        self._print(f"ERROR: {text}")

    @staticmethod
    def _print(text: str) -> None:
        usual = warnings.formatwarning

        def one_line(
            message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
        ) -> str:
            return f"{filename}: {lineno}: {category.__name__}: {message}\n"

        warnings.formatwarning = one_line
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn(text, stacklevel=3)
        warnings.formatwarning = usual


# --- facts ---


def distribution() -> str | None:
    """Return the ROS distribution: the sourced one, else that of the installed wheels (`ros-jazzy-rclpy`)."""
    if sourced := os.environ.get("ROS_DISTRO"):
        return sourced.lower()
    names = (found.metadata["Name"] or "" for found in metadata.distributions())
    wheels = (name.replace("_", "-").split("-") for name in names if name.lower().endswith("rclpy"))
    return next((words[1] for words in wheels if len(words) == 3 and words[0] == "ros"), None)


def interface_flags() -> dict[str, int]:
    """Return the flags of each network interface, by name."""
    return {
        path.name: int((path / "flags").read_text(), 16)
        for path in sorted(INTERFACES.glob("*"))
        if (path / "flags").exists()
    }


def topics(graph: Graph) -> list[str]:
    """Return the topics, without those that every node has."""
    return [name for name, _ in graph.topics() if name not in EXPECTED]


def pairs(graph: Graph) -> Iterator[tuple[str, Any, Any, Any, str]]:
    """Yield every pair of publisher and subscription: topic, publisher, subscription, compatibility and reason.

    The compatibility is rclpy's QoSCompatibility, the reason its explanation.
    """
    from rclpy.qos import qos_check_compatible

    for topic in topics(graph):
        for publisher in graph.node.get_publishers_info_by_topic(topic):
            for subscription in graph.node.get_subscriptions_info_by_topic(topic):
                fits, reason = qos_check_compatible(publisher.qos_profile, subscription.qos_profile)
                yield topic, publisher, subscription, fits, reason


# --- checks ---


def check_middleware(graph: Graph, result: Result) -> None:
    """Check that publishers and subscriptions have compatible quality of service."""
    from rclpy.qos import QoSCompatibility

    for topic, _, _, fits, explanation in pairs(graph):
        reason = explanation.partition(": ")[2] or explanation  # rclpy's reason begins with `ERROR: `
        if fits == QoSCompatibility.WARNING:
            result.warn(f"QoS compatibility warning found on topic '{topic}': {reason}")
        elif fits == QoSCompatibility.ERROR:
            result.error(f"QoS compatibility error found on topic '{topic}': {reason}")


def check_network(graph: Graph, result: Result) -> None:
    """Check that there is a loopback interface; warn without multicast."""
    flags = interface_flags().values()
    if not any(each & LOOPBACK for each in flags):
        result.error("No loopback IP address is found.")
    if all(each & LOOPBACK for each in flags):
        result.warn("Only loopback IP address is found.")
    if not any(each & MULTICAST for each in flags):
        result.warn("No multicast IP address is found.")


def check_package(graph: Graph, result: Result) -> None:
    """Check that the packages that the course needs are in the package index."""
    from ament_index_python import get_packages_with_prefixes

    installed = get_packages_with_prefixes()
    for name in NEEDED:
        if name not in installed:
            result.error(f"{name} is not installed.")


def check_platform(graph: Graph, result: Result) -> None:
    """Check that the ROS distribution is known."""
    if distribution() is None:
        result.error("ROS_DISTRO is not set.")


def check_topic(graph: Graph, result: Result) -> None:
    """Warn of topics without a publisher or a subscriber."""
    for topic in topics(graph):
        publishers, subscribers = graph.counts(topic)
        if publishers > subscribers == 0:
            result.warn(f"Publisher without subscriber detected on {topic}.")
        elif subscribers > publishers == 0:
            result.warn(f"Subscriber without publisher detected on {topic}.")


# --- reports ---


def report_middleware(graph: Graph) -> Report:
    """Report the middleware, and for each publisher and subscription whether they are compatible."""
    from rclpy.qos import QoSCompatibility
    from rclpy.utilities import get_rmw_implementation_identifier

    items: Report = [("middleware name", get_rmw_implementation_identifier())]
    for topic, publisher, subscription, fits, reason in pairs(graph):
        items += [
            ("topic [type]", f"{topic} [{publisher.topic_type}]"),
            ("publisher node", publisher.node_name),
            ("subscriber node", subscription.node_name),
            ("compatibility status", "OK" if fits == QoSCompatibility.OK else reason),
        ]
    return items


def report_network(graph: Graph) -> Report:
    """Report the network interfaces."""
    items: Report = []
    for name, flags in interface_flags().items():
        items += [
            ("device", name),
            ("flags", ",".join(word for bit, word in FLAGS.items() if flags & bit)),
            ("mtu", (INTERFACES / name / "mtu").read_text().strip()),
        ]
    return items


def report_package(graph: Graph) -> Report:
    """Report the version of every ROS package that pip installed."""
    versions = {found.metadata["Name"]: found.version for found in metadata.distributions()}
    return sorted((name, version) for name, version in versions.items() if name and name.startswith("ros-"))


def report_platform(graph: Graph) -> Report:
    """Report the operating system, Python and the ROS distribution."""
    return [
        ("system", platform.system()),
        ("platform info", platform.platform()),
        ("release", platform.release()),
        ("processor", platform.processor() or platform.machine()),
        ("python version", platform.python_version()),
        ("distribution name", distribution()),
    ]


def report_topic(graph: Graph) -> Report:
    """Report how many publishers and subscribers each topic has."""
    items: Report = []
    for topic in topics(graph):
        publishers, subscribers = graph.counts(topic)
        items += [("topic", topic), ("publisher count", publishers), ("subscriber count", subscribers)]
    return items or [("topic", "none"), ("publisher count", 0), ("subscriber count", 0)]


# For each module of ros2doctor: its check, the title of its report, and the report.
MODULES: dict[str, tuple[Callable[[Graph, Result], None], str, Callable[[Graph], Report]]] = {
    "middleware": (check_middleware, "RMW MIDDLEWARE", report_middleware),
    "network": (check_network, "NETWORK CONFIGURATION", report_network),
    "package": (check_package, "PACKAGE VERSIONS", report_package),
    "platform": (check_platform, "PLATFORM INFORMATION", report_platform),
    "topic": (check_topic, "TOPIC LIST", report_topic),
}


def print_report(graph: Graph, name: str) -> None:
    """Print the report of a module, with its values in a column."""
    _, title, report = MODULES[name]
    items = report(graph)
    widest = max((len(key) for key, _ in items), default=0)
    print(f"\n   {title}")
    for key, value in items:
        print(f"{key:{widest + 4 if widest >= 8 else 8}}: {value}")


def main(args: Namespace) -> None:
    """Run the checks, or print the reports; as in ros2cli, a failed check leaves the exit status 0."""
    names = [name for name in MODULES if not (name == "package" and args.exclude_packages)]
    with Graph(args, talks=True) as graph:
        graph.settle()
        if args.report:
            for name in names:
                print_report(graph, name)
            return
        failed = []
        for name in names:
            result = Result()
            MODULES[name][0](graph, result)
            if result.errors or (args.include_warnings and result.warnings):
                failed.append(name)
        if failed:
            print(f"\n{len(failed)}/{len(names)} check(s) failed\n")
            print("Failed modules:", *failed)
        else:
            print(f"\nAll {len(names)} checks passed\n")
        sys.stdout.flush()
        for name in failed if args.report_failed else []:
            print_report(graph, name)
