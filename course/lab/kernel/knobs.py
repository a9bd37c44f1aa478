"""The robot view's knobs: the parameters of the nodes that simulate and drive the robot, as they change."""

import copy
import math
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterEvent, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from course.errors import LiveError
from course.foundation.waiting import wait_until
from course.lab import protocol
from course.lab.kernel.nodes import answer, of_usual_length
from course.lab.kernel.panels import Panels, Topic
from course.lab.kernel.robot_listener import RobotListener, Source, close_listener, listener_in_use, open_listener
from course.ros.names import PARAMETERS_OF_EVERY_NODE, is_valid
from course.session.logs import decoded

FOUND = 1.0  # s that discovering a node's services may take
EVENTS = QoSProfile(depth=100)  # for /parameter_events, which a node may flood
SHOWN = 200  # parameters of a node
MOST = protocol.LINE // 8  # bytes of all nodes' parameters: what does not fit is left out
TOLD = 1000  # characters of a string parameter; longer ones are not shown
LONGEST = 1 << 16  # bytes of an event that is parsed; after a longer one, all parameters are read again
KINDS = {
    ParameterType.PARAMETER_BOOL: "bool",
    ParameterType.PARAMETER_INTEGER: "integer",
    ParameterType.PARAMETER_DOUBLE: "double",
    ParameterType.PARAMETER_STRING: "string",
}
SERVICES = {
    ListParameters: "list_parameters",
    DescribeParameters: "describe_parameters",
    GetParameters: "get_parameters",
    SetParametersAtomically: "set_parameters_atomically",
}


def add(panels: Panels) -> None:
    """Add the knobs."""
    panels.methods |= {"robot.set": set_parameters}
    panels.topics |= {"robot.knobs": Topic(KnobsFeed, 0.1)}


class KnobsFeed:
    """A feed of parameters, whoever sets them."""

    def __init__(self) -> None:
        self._listener: RobotListener | None = None
        self._events: Subscription | None = None
        self._known: dict[Source, dict[str, Any]] = {}
        self._last: Any = None

    def read(self) -> dict[str, Any] | None:
        """Return {"nodes": each with its name and its parameters, or None without an answer} if anything is new."""
        listener = open_listener(self)
        if listener is not self._listener:
            self._follow(listener)
        listener.look()
        wanted = dict.fromkeys([*listener.publishers["/scan"], *listener.publishers["/cmd_vel"]])
        nodes = {name: publisher for publisher in wanted for name in publisher[:1]}
        for publisher in set(self._known) - set(nodes.values()):
            del self._known[publisher]
            listener.forget(publisher[0])
        for name, publisher in nodes.items():
            if publisher not in self._known and (found := _read_or_none(listener, name)) is not None:
                self._known[publisher] = _within(found, MOST - len(protocol.encoded([*self._known.values()])))
        told = [
            {"name": name, "parameters": list(self._known[publisher].values()) if publisher in self._known else None}
            for name, publisher in nodes.items()
        ]
        if told == self._last:
            return None
        self._last = copy.deepcopy(told)
        return {"nodes": told}

    def close(self) -> None:
        """Stop following the parameters."""
        if self._listener is not None and self._events is not None and self._listener.live.ok:
            self._listener.live.node.destroy_subscription(self._events)
        close_listener(self)

    def _follow(self, listener: RobotListener) -> None:
        self._listener, self._last = listener, None
        self._known.clear()
        self._events = listener.live.node.create_subscription(
            ParameterEvent, "/parameter_events", self._hear, EVENTS, raw=True
        )

    def _hear(self, message: bytes) -> None:
        """Note a node's parameter event; the name of the node is in the first bytes, after a time stamp."""
        known = [source for source in list(self._known) if source[0].encode() in message[: 20 + len(source[0])]]
        if not known:
            return
        event = decoded(message, ParameterEvent) if len(message) <= LONGEST else None
        if event is None:
            for source in known:
                self._known.pop(source, None)
            return
        for (name, _), parameters in list(self._known.items()):
            if name == event.node:
                for changed in [*event.new_parameters, *event.changed_parameters]:
                    shown = parameters.get(changed.name)
                    if shown and _is_shown(changed.value) and shown["kind"] == KINDS[changed.value.type]:
                        shown["value"] = _said(changed.value)
                    else:  # newly declared, or of another type now: read all again
                        self._known.pop((name, _), None)


def set_parameters(node: str, values: dict[str, Any]) -> None:
    """Set parameters of a node, all or none; raises LiveError with the node's reason when it refuses."""
    listener = listener_in_use()
    names = list(values)
    got = _ask(listener, node, GetParameters, names=names)
    if got is None:
        raise LiveError(f"{node} does not answer: it is busy, blocked, or has ended.")
    parameters = [
        Parameter(name, value=_converted(value, old)).to_parameter_msg()
        for (name, value), old in zip(values.items(), got.values, strict=True)
    ]
    done = _ask(listener, node, SetParametersAtomically, parameters=parameters)
    if done is None:
        raise LiveError(f"{node} does not answer: it is busy, blocked, or has ended.")
    if not done.result.successful:
        raise LiveError(f"{node} rejected the change: {done.result.reason or 'it gives no reason'}")


def _converted(value: Any, old: ParameterValue) -> Any:
    """Convert a value from a page to the parameter's type, because JavaScript has one type for all numbers."""
    match KINDS.get(old.type):
        case "double":
            return float(value)
        case "integer":
            return int(value)
        case "bool":
            return bool(value)
    return value


def _within(found: dict[str, Any], room: int) -> dict[str, Any]:
    """Return the first of these parameters, as many as have `room` (bytes)."""
    kept = {}
    for name, shown in found.items():
        room -= len(protocol.encoded({name: shown}))
        if room < 0:
            break
        kept[name] = shown
    return kept


def _read_or_none(listener: RobotListener, node: str) -> dict[str, Any] | None:
    """Return what `_read` does; None also for an answer that cannot be read: it must not hide the other nodes'."""
    try:
        return _read(listener, node)
    except Exception:
        if not listener.live.ok:
            raise  # the session has ended
        return None


def _read(listener: RobotListener, node: str) -> dict[str, Any] | None:
    """Return the parameters of a node that are a single number, boolean or string; None if it does not answer."""
    listed = _ask(listener, node, ListParameters)
    if listed is None:
        return None
    names = sorted(set(of_usual_length(listed.result.names)) - set(PARAMETERS_OF_EVERY_NODE))[:SHOWN]
    described = _ask(listener, node, DescribeParameters, names=names)
    got = _ask(listener, node, GetParameters, names=names)
    if described is None or got is None:
        return None
    return {
        each.name: _shown(each, value)
        for each, value in zip(described.descriptors, got.values, strict=False)
        if _is_shown(value)
    }


def _shown(descriptor: ParameterDescriptor, value: ParameterValue) -> dict[str, Any]:
    limits = [*descriptor.floating_point_range, *descriptor.integer_range][:1]
    return {
        "name": descriptor.name,
        "kind": KINDS[value.type],
        "value": _said(value),
        "from": _finite(limits[0].from_value) if limits else None,
        "to": _finite(limits[0].to_value) if limits else None,
        "step": (_finite(limits[0].step) or None) if limits else None,
        "fixed": descriptor.read_only,
        "about": descriptor.description[:TOLD],
    }


def _is_shown(value: ParameterValue) -> bool:
    return value.type in KINDS and len(value.string_value) <= TOLD


def _said(value: ParameterValue) -> Any:
    """Return the value in a form for JSON."""
    found = parameter_value_to_python(value)
    return _finite(found) if isinstance(found, float) else found


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _ask(listener: RobotListener, node: str, kind: Any, **fields: Any) -> Any:
    """Return the response of a node's parameter service, or None if there is none."""
    if not is_valid(node):
        return None
    client = listener.client(kind, node, SERVICES[kind])
    wait_until(client.service_is_ready, FOUND, alert=False)
    return answer(client, kind.Request(**fields))
