"""`ros2 topic hz`, `bw` and `delay`: the rate, bandwidth and delay of a topic's messages."""

from __future__ import annotations

import itertools
import math
import sys
import time
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from course.errors import RosError
from course.ros.graph import Graph
from course.ros.messages import Message
from course.ros2 import completion, grammar
from course.ros2.topic_traffic import find_message_type, make_filter

if TYPE_CHECKING:  # loaded when a verb runs, and not for its help
    from rclpy.clock import Clock

WINDOW = 10000  # messages
BANDWIDTH_WINDOW = 100
PERIOD = 1.0  # s between two lines of `bw` and `delay`
# The units: upper limit in bytes (per second), bytes of the unit, and decimals.
UNITS = (("B", 1000, 1, 0), ("KB", 1000000, 1000, 2), ("MB", math.inf, 1000000, 2))


# --- hz ---


def add_hz_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic hz`."""
    grammar.add_strategy_arguments(parser)
    grammar.complete_with(
        parser.add_argument("topic_name", help="Name of the ROS topic to listen to (e.g. '/chatter')"),
        completion.topic_names,
    )
    parser.add_argument(
        "--window",
        "-w",
        dest="window_size",
        metavar="WINDOW",
        type=grammar.positive_int,
        default=WINDOW,
        help=f"window size, in # of messages, for calculating rate (default: {WINDOW})",
    )
    parser.add_argument(
        "--filter",
        dest="filter_expr",
        metavar="EXPR",
        help="only measure messages matching the specified Python expression",
    )
    parser.add_argument(
        "--wall-time",
        dest="use_wtime",
        action="store_true",
        help="calculates rate using wall time which can be helpful when clock is not published during simulation",
    )


def hz(args: Namespace) -> None:
    """Print, about once a second, the average rate at which the messages in the window arrived."""
    from rclpy.qos import qos_profile_sensor_data

    accepts = make_filter(args.filter_expr)
    with Graph(args, talks=True) as graph:
        message_type = find_message_type(graph, args.topic_name, wait=True)
        clock = graph.node.get_clock()
        arrivals: list[int] = []  # ns
        printed: int | None = None  # ns

        def count(message: Message) -> None:
            nonlocal printed
            if not accepts(message):
                return
            now = time.time_ns() if args.use_wtime else clock.now().nanoseconds
            if now == 0 or (arrivals and now < arrivals[-1]):
                if arrivals:
                    print("time has reset, resetting counters")
                    arrivals.clear()
                return
            arrivals.append(now)
            del arrivals[: -args.window_size - 1]
            if len(arrivals) < 2:
                return
            if printed is None or now < printed:
                printed = now
            elif now >= printed + 1e9:
                printed = now
                print(rate(arrivals))

        graph.node.create_subscription(message_type, args.topic_name, count, qos_profile_sensor_data)
        graph.spin()


def rate(arrivals: list[int]) -> str:
    """Return the text that `hz` prints for two or more times of arrival (ns)."""
    steps = [(after - before) * 1e-9 for before, after in itertools.pairwise(arrivals)]
    mean = sum(steps) / len(steps)
    deviation = math.sqrt(sum((step - mean) ** 2 for step in steps) / len(steps))
    return (
        f"average rate: {1.0 / mean if mean > 0 else 0:.3f}\n"
        f"\tmin: {min(steps):.3f}s max: {max(steps):.3f}s std dev: {deviation:.5f}s window: {len(steps)}"
    )


# --- bw ---


def add_bw_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic bw`."""
    grammar.complete_with(
        parser.add_argument("topic", help="Topic name to monitor for bandwidth utilization"), completion.topic_names
    )
    parser.add_argument(
        "--window",
        "-w",
        metavar="WINDOW",
        type=grammar.positive_int,
        default=BANDWIDTH_WINDOW,
        help=f"maximum window size, in # of messages, for calculating rate (default: {BANDWIDTH_WINDOW})",
    )
    grammar.add_direct_arguments(parser)


def bw(args: Namespace) -> None:
    """Print each second the bandwidth of the messages in the window."""
    from rclpy.qos import qos_profile_sensor_data

    with Graph(args, talks=True) as graph:
        message_type = find_message_type(graph, args.topic, wait=True)
        clock = graph.node.get_clock()
        arrived: list[tuple[int, int]] = []  # time in ns, and size in bytes

        def count(serialized: bytes) -> None:
            arrived.append((clock.now().nanoseconds, len(serialized)))
            del arrived[: -args.window]

        def show() -> None:
            if len(arrived) < 2:
                return
            now = clock.now().nanoseconds
            if now <= arrived[0][0]:
                print("WARNING: time is reset!", file=sys.stderr)
                arrived.clear()
                return
            print(bandwidth([size for _, size in arrived], (now - arrived[0][0]) * 1e-9))

        graph.node.create_subscription(message_type, args.topic, count, qos_profile_sensor_data, raw=True)
        print(f"Subscribed to [{args.topic}]")
        graph.node.create_timer(PERIOD, show)
        graph.spin()


def bandwidth(sizes: list[int], seconds: float) -> str:
    """Return the text that `bw` prints for messages of these `sizes` (bytes) that came within `seconds`."""
    rate = sum(sizes) / seconds
    unit, _, factor, digits = next(each for each in UNITS if rate < each[1])
    total, mean, least, most = (
        f"{value / factor:.{digits}f} {unit}" for value in (rate, sum(sizes) / len(sizes), min(sizes), max(sizes))
    )
    return f"{total}/s from {len(sizes)} messages\n\tMessage size mean: {mean} min: {least} max: {most}"


# --- delay ---


def add_delay_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 topic delay`."""
    grammar.complete_with(
        parser.add_argument("topic", help="Topic name to calculate the delay for"), completion.topic_names
    )
    parser.add_argument(
        "--window",
        "-w",
        type=grammar.positive_int,
        default=WINDOW,
        help=f"window size, in # of messages, for calculating rate, string to (default: {WINDOW})",
    )
    grammar.add_direct_arguments(parser)


class Delays:
    """The times (ns) between a message's stamp and its arrival; the first message only starts the count."""

    def __init__(self, clock: Clock, window: int) -> None:
        self.clock = clock
        self.window = window
        self.delays: list[int] = []
        self.began = self.latest = -1  # ns
        self.printed = 0  # ns

    def add(self, message: Message) -> None:
        """Count a message; raises RosError if it has no header."""
        if not hasattr(message, "header"):
            raise RosError("msg does not have header")
        now = self.clock.now().nanoseconds
        if now == 0:
            if self.delays:
                print("time has reset, resetting counters")
                self.delays.clear()
            return
        if self.began < 0 or self.began > now:
            self.began = now
            self.delays.clear()
        else:
            stamp = message.header.stamp
            self.delays.append(now - (stamp.sec * 10**9 + stamp.nanosec))
        self.latest = now
        del self.delays[: -self.window]

    def show(self) -> None:
        """Print the statistics, or that nothing has arrived since they were printed last."""
        if not self.delays:
            return
        if self.latest == self.printed:
            print("no new messages")
            return
        self.printed = self.latest
        mean = sum(self.delays) / len(self.delays)
        deviation = math.sqrt(sum((delay - mean) ** 2 for delay in self.delays) / len(self.delays))
        print(
            f"average delay: {mean * 1e-9:.3f}\n\tmin: {min(self.delays) * 1e-9:.3f}s "
            f"max: {max(self.delays) * 1e-9:.3f}s std dev: {deviation * 1e-9:.5f}s window: {len(self.delays)}"
        )


def delay(args: Namespace) -> None:
    """Print each second the delay between the time in a message's header and its arrival, over the window."""
    from rclpy.qos import qos_profile_sensor_data

    with Graph(args, talks=True) as graph:
        message_type = find_message_type(graph, args.topic, wait=True)
        delays = Delays(graph.node.get_clock(), args.window)
        graph.node.create_subscription(message_type, args.topic, delays.add, qos_profile_sensor_data)
        graph.node.create_timer(PERIOD, delays.show)
        graph.spin()
