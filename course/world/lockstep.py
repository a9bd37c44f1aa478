"""What keeps the world and the node that drives in step, when the world runs as fast as it computes."""

import re
from dataclasses import dataclass, field

import numpy as np
from rcl_interfaces.srv import GetParameters

from course.rclpy_internals import RCLError
from course.world.simulation import Collision

NAME = re.compile(r"(?!.*_UNKNOWN_)(?:/[A-Za-z_]\w*)+", re.ASCII)  # not of a node that rmw has not heard of yet


@dataclass
class Drive:
    """What a drive in lockstep came to."""

    room: str
    seconds: float = 0.0  # simulated
    answered: int = 0  # ticks for which the driver sent a command in time
    missed: int = 0  # ticks for which it did not
    distance: float = 0.0  # m
    ground_covered: float = 0.0  # m2, see Simulation.ground_covered
    collisions: list[Collision] = field(default_factory=list)
    path: np.ndarray = field(default_factory=lambda: np.empty((0, 4)), repr=False)  # time s, x m, y m, heading rad

    def __str__(self):
        touched = f"{len(self.collisions)} collisions" if len(self.collisions) != 1 else "1 collision"
        return f"{self.room}: {self.distance:.1f} m in {self.seconds:.1f} s, {touched}"


class Barrier:
    """Tells when the nodes that publish on a topic have worked off the messages sent to them before.

    Every rclpy node answers for its parameters from the executor that runs its callbacks, and an executor takes what
    is ready in the order timers, subscriptions, services.  So once a node has answered a request that was sent after a
    message, it has met that message; and the timers that the message made ready by the time of the second answer.
    """

    def __init__(self, node, topic, wait, notify):
        """Watch the publishers of `topic` other than `node`.

        `wait(condition, timeout)` lets messages in; `notify()` is called when that condition may have become true.
        """
        self._node, self._topic, self._wait, self._notify = node, topic, wait, notify
        self._clients = {}

    def find(self, timeout):
        """Look up who publishes now, and wait at most `timeout` s until all of them can be asked."""
        self._wait(self._found, timeout)

    def _found(self):
        # Who owns a publisher may become known a little later than the publisher.
        try:
            publishers = self._node.get_publishers_info_by_topic(self._topic)
        except (RCLError, UnicodeDecodeError):  # a name that there cannot be
            return False
        names = {f"{p.node_namespace.rstrip('/')}/{p.node_name}/get_parameters" for p in publishers}
        known = {name for name in names if NAME.fullmatch(name)}
        for name in set(self._clients) - known:
            self._node.destroy_client(self._clients.pop(name))
        for name in known - set(self._clients):
            self._clients[name] = self._node.create_client(GetParameters, name)
        return known == names and all(client.service_is_ready() for client in self._clients.values())

    def cross(self, timeout):
        """Wait until everyone has answered, at most `timeout` s; False when they have not, or nobody could be asked."""
        ready = [client for client in self._clients.values() if client.service_is_ready()]
        if not ready or timeout <= 0.0:
            return False
        asked = [(client, client.call_async(GetParameters.Request())) for client in ready]
        for _, future in asked:
            future.add_done_callback(lambda _: self._notify())
        done = self._wait(lambda: all(future.done() for _, future in asked), timeout)
        for client, future in asked:
            if not future.done():
                client.remove_pending_request(future)
        return done
