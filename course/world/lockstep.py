"""Lockstep: the world and the driving node wait for each other, so that simulated time can run at any speed."""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.node import Node

from course.foundation.waiting import tell_reader, tellers
from course.ros.rclpy_internals import RCLError, unwatched
from course.world.geometry import Floats
from course.world.simulation import Collision

MISSED = 3  # ticks without a command, after which the reader learns that the drive takes long
FIRST = 20  # ticks after which it is known whether a drive takes about as long as in reality:
REAL, MUCH_MORE = 0.9, 2.0  # at least this part of the real time, and at most so many times that
# A valid service name; rmw calls a node `_NODE_NAME_UNKNOWN_` until it has discovered the node's name.
NAME = re.compile(r"(?!.*_UNKNOWN_)(?:/[A-Za-z_]\w*)+", re.ASCII)


@dataclass
class Drive:
    """The outcome of a drive in lockstep."""

    room: str
    seconds: float = 0.0  # s of simulated time
    answered: int = 0  # ticks for which the driver sent a command in time
    missed: int = 0  # ticks for which it did not
    distance: float = 0.0  # m
    ground_covered: float = 0.0  # m², see Simulation.ground_covered
    collisions: list[Collision] = field(default_factory=list)
    # Shape (n, 4), rows of time (s), x (m), y (m), heading (rad).
    path: Floats = field(default_factory=lambda: np.empty((0, 4)), repr=False)

    def __str__(self) -> str:
        touched = f"{len(self.collisions)} collisions" if len(self.collisions) != 1 else "1 collision"
        return f"{self.room}: {self.distance:.1f} m in {self.seconds:.1f} s, {touched}"


class Barrier:
    """Waits until the nodes that publish on a topic have handled all messages sent to them before.

    Every rclpy node answers parameter requests in the executor that runs its callbacks, and an executor takes what is
    ready in the order timers, subscriptions, services.  So a node that has answered a request has handled the messages
    sent before it; with its second answer it has also run the timers that those messages made ready.
    """

    def __init__(
        self, node: Node, topic: str, wait: Callable[[Callable[[], bool], float], bool], notify: Callable[[], None]
    ) -> None:
        """Watch the publishers of `topic` other than `node`.

        `wait(condition, timeout)` waits while messages are received, and returns the condition's last value; `notify()`
        is called when the condition may have become true.
        """
        self._node, self._topic, self._wait, self._notify = node, topic, wait, notify
        self._clients: dict[str, Client] = {}

    def find(self, timeout: float) -> None:
        """Find the publishers, and wait at most `timeout` s for their parameter services."""
        self._wait(self._found, timeout)

    def _found(self) -> bool:
        # A publisher may be discovered a little earlier than the name of its node.
        try:
            publishers = self._node.get_publishers_info_by_topic(self._topic)
        except (RCLError, UnicodeDecodeError):  # a publisher's node has an invalid name
            return False
        names = {f"{p.node_namespace.rstrip('/')}/{p.node_name}/get_parameters" for p in publishers}
        known = {name for name in names if NAME.fullmatch(name)}
        for name in set(self._clients) - known:
            self._node.destroy_client(self._clients.pop(name))
        for name in known - set(self._clients):
            self._clients[name] = self._node.create_client(GetParameters, name)
        return known == names and all(client.service_is_ready() for client in self._clients.values())

    @property
    def names(self) -> list[str]:
        """Return the names of the publishers that were found."""
        return [name.removesuffix("/get_parameters") for name in self._clients]

    @property
    def deserted(self) -> bool:
        """True if no publisher of the topic is there any more."""
        return not any(client.service_is_ready() for client in self._clients.values())

    def cross(self, timeout: float) -> bool:
        """Wait at most `timeout` s until all have answered; return False if one has not, or there is none to ask."""
        ready = [client for client in self._clients.values() if client.service_is_ready()]
        if not ready or timeout <= 0.0:
            return False
        with unwatched():
            asked = [(client, client.call_async(GetParameters.Request())) for client in ready]
        for _, future in asked:
            future.add_done_callback(lambda _: self._notify())
        done = self._wait(lambda: all(future.done() for _, future in asked), timeout)
        for client, future in asked:
            if not future.done():
                client.remove_pending_request(future)
        return done

    def in_real_time(self, timeout: float) -> list[str]:
        """Return the publishers, if all answer, within `timeout` s, that they do not use simulated time; else []."""
        ready = [client for client in self._clients.values() if client.service_is_ready()]
        with unwatched():
            asked = [(each, each.call_async(GetParameters.Request(names=["use_sim_time"]))) for each in ready]
        for _, future in asked:
            future.add_done_callback(lambda _: self._notify())
        self._wait(lambda: all(future.done() for _, future in asked), timeout)
        found = []
        for client, future in asked:
            if not future.done():
                client.remove_pending_request(future)
            elif not any(value.bool_value for value in future.result().values):
                found.append(client.service_name.removesuffix("/get_parameters").rpartition("/")[2])
        return found if len(found) == len(asked) else []  # one that uses it sets the pace


class Pace:
    """Tells the reader of a cell, once, that a drive takes longer than usual, and why."""

    def __init__(self, barrier: Barrier, answer_within: float, period: float) -> None:
        """Begin; a tick lasts `period` s of simulated time, and waits for a command at most `answer_within` s."""
        self._barrier, self._limit, self._period = barrier, answer_within, period
        self._began, self._told = time.monotonic(), False

    def look(self, drive: Drive) -> None:
        """Look after each tick of the drive."""
        ticks, ran = drive.answered + drive.missed, time.monotonic() - self._began
        if self._told or not tellers:
            return
        if drive.missed >= MISSED and ran >= MISSED * self._limit:
            why = "A driver must answer sooner: its callback must not sleep or compute for so long."
            if self._barrier.deserted:
                why = "The node that drove has ended, or was stopped."
            self._tell(
                f"{drive.missed} scans had no command within {self._limit:g} s: this drive goes on without one. {why}"
            )
        elif (
            ticks == FIRST
            and REAL <= ran / (ticks * self._period) <= MUCH_MORE
            and (late := self._barrier.in_real_time(self._limit))
        ):
            self._tell(
                f"{' and '.join(late)} does not use simulated time, so this drive takes as long as in reality: start "
                "it with parameters={'use_sim_time': True}."
            )

    def _tell(self, text: str) -> None:
        self._told = True
        tell_reader(text)
