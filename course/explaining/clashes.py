"""The hint on a topic, a service or an action that already has another type in this kernel.  rclpy names neither."""

import ast
import re
import sys
from types import TracebackType
from typing import Any, cast

from rclpy.node import Node

from course.explaining.source import argument, calls, parse
from course.ros.names import type_name
from course.ros.rclpy_internals import RCLError

OF_ACTIONS = "action_type"  # an argument of ActionClient and ActionServer
VERBS = {"create_subscription": "subscribes to", "create_publisher": "publishes"}


def other_type(error: BaseException) -> str:
    """Return the hint on an endpoint that the middleware refuses because its name has another type here, or ''.

    Seen in rclpy 7.1.6: the error of a topic is 'invalid allocator'; the one that it replaces is only printed.
    """
    refused = isinstance(error, RCLError) or "with incompatible type" in str(error)
    module: Any = sys.modules.get("course.session.live")
    if not refused or not module or not (session := module.current()):
        return ""
    trace: TracebackType | None = error.__traceback__
    while trace:
        function, values = trace.tb_frame.f_code.co_name, trace.tb_frame.f_locals
        if function in VERBS and "topic" in values and "msg_type" in values:
            # The node that failed may be destroyed by now.
            return _clash(session.node, str(values["topic"]), type_name(values["msg_type"]))
        if function in ("create_client", "create_service") and "srv_type" in values and "srv_name" in values:
            return _of_a_server(session, str(values["srv_name"]), type_name(values["srv_type"]))
        if function == "__init__" and OF_ACTIONS in values and "action_name" in values:
            return _of_a_server(session, str(values["action_name"]), type_name(values[OF_ACTIONS]))
        trace = trace.tb_next
    return ""


def _of_a_server(session: Any, given: str, kind: str) -> str:
    name = session.node.resolve_service_name(given)
    other = next((each for each in session.served().get(name, ()) if each != kind), "")
    if not other:
        return ""
    return (
        f"{name} is served with the type {other}, and your line uses {kind}. Both sides must use the same: take the "
        "type of the server, or another name."
    )


def _clash(node: Node, topic: str, kind: str) -> str:
    name = node.resolve_topic_name(topic)
    ends: list[Any] = [
        *((each, VERBS["create_publisher"]) for each in node.get_publishers_info_by_topic(name)),
        *((each, VERBS["create_subscription"]) for each in node.get_subscriptions_info_by_topic(name)),
    ]
    for end, verb in ends:
        if end.topic_type != kind:
            who = "this notebook" if end.node_name.startswith("_") else cast(str, end.node_name)
            return (
                f"{who} {verb} {name} with the type {end.topic_type}, and your line uses {kind}. A topic has one type: "
                "use the same on both sides, or another name."
            )
    return ""


KINDS = (  # makers of two ends of the same name, with the places of the type and the name
    {"create_publisher": ("msg_type", "topic"), "create_subscription": ("msg_type", "topic")},
    {"create_client": ("srv_type", "srv_name"), "create_service": ("srv_type", "srv_name")},
)


def two_types(found: re.Match[str], source: str) -> str:
    """Return the hint on a program that gives one name two types, which the middleware refuses."""
    tree = parse(source)
    for makers in KINDS:
        made: dict[str, tuple[str, int]] = {}
        for maker, (of_type, of_name) in makers.items():
            for call in calls(tree, maker):
                kind, name = argument(call, 0, of_type), argument(call, 1, of_name)
                if kind is None or not isinstance(name, ast.Constant) or not isinstance(name.value, str):
                    continue
                text = ast.unparse(kind)
                other, line = made.setdefault(name.value.lstrip("/"), (text, call.lineno))
                if other != text:
                    return (
                        f"Line {line} gives '{name.value}' the type {other}, and line {call.lineno} the type {text}. "
                        "One name can have only one type: is another name meant in one of the two lines?"
                    )
    return ""
