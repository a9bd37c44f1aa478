"""Finding out why endpoints of a topic or an action do not match: name, type or quality of service (QoS)."""

import contextlib
import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, cast

from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.explaining.failure_report import Frame, place_of, text_of
from course.explaining.source import cells_run, made_at
from course.ros.names import OF_EVERY_NODE, SEND, is_hidden, type_name
from course.ros.qos import words
from course.ros.rclpy_internals import NodeNameNonExistentError, action_name, action_type
from course.session.node_process import NodeProcess
from course.session.watch import Handle

LISTED = 8  # names in a message
ALIKE = 0.8  # least similarity of two topics' names of which one may be meant for the other
NUMBER = re.compile(r"\d+")


def misfit(node: Node, end: Publisher | Subscription, handles: Mapping[str, Handle]) -> str:
    """Return why another node's end of the topic does not fit `end` of `node`: its type or QoS; '' if one fits."""
    publishes, verb, kind, topic = _asked(end)
    found = []
    for each in _others(node, topic, publishes):
        if each.topic_type != kind:
            found.append(f"{each.node_name} {verb} {topic} with the type {each.topic_type}; it must be {kind}.")
            continue
        offered, asked = (end.qos_profile, each.qos_profile) if publishes else (each.qos_profile, end.qos_profile)
        if qos_check_compatible(offered, asked)[0] == QoSCompatibility.ERROR:
            maker = "create_subscription" if publishes else "create_publisher"
            at = "".join(f"\n{line}" for line in _lines(node, handles, each, maker, topic))
            found.append(f"{each.node_name} {verb} {topic}, but {_unfit(offered, asked)}{at}")
            continue
        return ""
    return found[0] if found else ""


def unmatched(node: Node, end: Publisher | Subscription, handles: Mapping[str, Handle]) -> str:
    """Return why `node`'s publisher or subscription `end` is not matched by another node."""
    if why := misfit(node, end, handles):
        return why
    publishes, verb, kind, topic = _asked(end)
    others = _others(node, topic, publishes)
    if others:
        return (
            f"{others[0].node_name} {verb} {topic} ({kind}), but the connection was not made in time: is the computer "
            "busy?"
        )
    same = [name for name, kinds in node.get_topic_names_and_types() if kind in kinds]
    offers = sorted(f"{each.node_name} {verb} {name}" for name in same for each in _others(node, name, publishes))
    return f"No node {verb} {topic} ({kind})." + (f" Of this type, {listing(offers, topic)}." if offers else "")


def _asked(end: Publisher | Subscription) -> tuple[bool, str, str, str]:
    """Return whether `end` publishes, what the other end does, the type and the topic."""
    publishes = isinstance(end, Publisher)
    verb = "subscribes to" if publishes else "publishes"
    return publishes, verb, type_name(cast(type, end.msg_type)), end.topic_name


def listing(names: Iterable[str], wanted: str) -> str:
    """Return names as a list, of more than LISTED those that are most like the `wanted` one."""
    known = sorted(names)
    alike = sorted(known, key=lambda name: -difflib.SequenceMatcher(None, name, wanted).ratio())[:LISTED]
    more = f" and {len(known) - LISTED} more" if len(known) > LISTED else ""
    return ", ".join(sorted(alike)) + more


def unserved(node: Node, client: ActionClient) -> str:
    """Return why an action client of `node` finds no server, and which actions exist instead."""
    name, kind = action_name(client), type_name(cast(type, action_type(client)))
    served = served_actions(node)
    if others := [each for each in served.get(name, []) if each != kind]:
        return f"The action {name} is served with the type {others[0]}; it must be {kind}."
    listed = ", ".join(f"{each} ({' and '.join(kinds)})" for each, kinds in sorted(served.items()))
    return f"No node serves the action {name} ({kind})." + (f" Served here: {listed}." if listed else "")


def served_actions(node: Node) -> dict[str, list[str]]:
    """Return the actions that nodes serve, with their types."""
    return {each: kinds for each, kinds in get_action_names_and_types(node) if node.count_services(f"{each}{SEND}")}


def served_services(node: Node) -> dict[str, list[str]]:
    """Return the services that nodes serve, with their types, without those of every node and of actions."""
    return {
        name: types
        for name, types in node.get_service_names_and_types()
        if not types[0].startswith(OF_EVERY_NODE) and "/_action/" not in name and node.count_services(name)
    }


def unfit_topics(node: Node, handles: Mapping[str, Handle]) -> list[str]:
    """Return a text for each publisher and subscription in the graph with incompatible QoS, with both lines of code."""
    found = []
    for topic, kinds in node.get_topic_names_and_types():
        if _of_no_interest(topic, kinds):
            continue
        for publisher in node.get_publishers_info_by_topic(topic):
            for subscription in node.get_subscriptions_info_by_topic(topic):
                offered, asked = publisher.qos_profile, subscription.qos_profile
                if qos_check_compatible(offered, asked)[0] != QoSCompatibility.ERROR:
                    continue
                first, second = (_who(node, each) for each in (publisher, subscription))
                lines = [
                    *_lines(node, handles, publisher, "create_publisher", topic),
                    *_lines(node, handles, subscription, "create_subscription", topic),
                ]
                text = f"{first} publishes {topic} and {second} subscribes to it, but {_unfit(offered, asked)}"
                found.append("\n".join([text, *map(str, lines)]))
    return list(dict.fromkeys(found))


def misspelt_topics(node: Node) -> list[str]:
    """Return a text for each topic that is only subscribed to, if one of nearly the same name is published."""
    topics = [name for name, kinds in node.get_topic_names_and_types() if not _of_no_interest(name, kinds)]
    published = {name: who for name in topics if (who := node.get_publishers_info_by_topic(name))}
    found = []
    for topic in topics:
        heard = [] if topic in published else node.get_subscriptions_info_by_topic(topic)
        hearers = {(each.node_name, each.node_namespace) for each in heard}  # a node does not mean its own topic,
        hearers -= {(node.get_name(), node.get_namespace())}  # but a cell may mean another cell's, by the same node
        others = [name for name, who in published.items()
                  if not hearers.issuperset((each.node_name, each.node_namespace) for each in who)]  # fmt: skip
        near = difflib.get_close_matches(topic, others, 1, ALIKE) if heard else []
        if near and NUMBER.sub("", near[0]) != NUMBER.sub("", topic):  # of two robots, one may not be there yet
            found.append(
                f"{_who(node, heard[0])} subscribes to {topic}, which no node publishes. Did you mean {near[0]}, which "
                f"{_who(node, published[near[0]][0])} publishes?"
            )
    return found


def unlike_clients(node: Node) -> list[str]:
    """Return a text for each client of a service that another node serves with another type."""

    def called(name: str) -> str:
        return "this notebook" if name == node.get_name() else name

    serving: dict[str, tuple[str, str]] = {}
    clients: list[tuple[str, str, str]] = []
    for name, space in node.get_node_names_and_namespaces():
        with contextlib.suppress(NodeNameNonExistentError):  # it has ended meanwhile
            for service, (kind, *_) in node.get_service_names_and_types_by_node(name, space):
                serving[service] = name, kind
            for service, (kind, *_) in node.get_client_names_and_types_by_node(name, space):
                clients.append((name, service, kind))
    return [
        f"{called(name)} has a client of {service} with the type {kind}, and {called(serving[service][0])} serves it "
        f"with the type {serving[service][1]}. Both sides must use the same type."
        for name, service, kind in clients
        if service in serving and serving[service][1] != kind
    ]


def _of_no_interest(topic: str, kinds: Sequence[str]) -> bool:
    return is_hidden(topic) or any(kind.startswith(OF_EVERY_NODE) for kind in kinds)


def unfit_service(node: Node, service: str, handles: Mapping[str, Handle]) -> str:
    """Return why `node`'s client and the server of `service` do not match, or ''.

    Both are compared as the graph has them: a profile that a program asks for leaves durations unspecified, which
    `qos_check_compatible` takes for a difference.
    """
    clients = node.get_publishers_info_by_topic(f"rq{service}Request", no_mangle=True)
    asked = next((cast(QoSProfile, each.qos_profile) for each in clients if each.node_name == node.get_name()), None)
    if asked is None:
        return ""
    for each in node.get_publishers_info_by_topic(f"rr{service}Reply", no_mangle=True):
        offered = cast(QoSProfile, each.qos_profile)
        if QoSCompatibility.ERROR in (qos_check_compatible(offered, asked)[0], qos_check_compatible(asked, offered)[0]):
            at = "".join(f"\n{line}" for line in _lines(node, handles, each, "create_service", service))
            return (
                f"It is served, but the quality of service (QoS) settings are incompatible: the server has "
                f"{words(offered)}, the client {words(asked)}. Leave out the QoS of the service.{at}"
            )
    return ""


def _unfit(offered: QoSProfile, asked: QoSProfile) -> str:
    same = words(offered) == words(asked)  # then deadline or liveliness differ
    reason = f" ({qos_check_compatible(offered, asked)[1].strip().rstrip(';')})" if same else ""
    return (
        "the quality of service (QoS) settings are incompatible, so nothing arrives: "
        f"the publisher offers {words(offered)}, the subscription asks for {words(asked)}{reason}."
    )


def _who(node: Node, end: TopicEndpointInfo) -> str:
    return "this notebook" if end.node_name == node.get_name() else end.node_name


def _lines(node: Node, handles: Mapping[str, Handle], end: TopicEndpointInfo, maker: str, name: str) -> Iterator[Frame]:
    """Yield the line of code that makes this endpoint, if the texts show it: of several lines it may be any."""
    found: dict[str, Frame] = {}
    for place, source in _texts(node, handles, end):
        if line := made_at(source, maker, name):
            frame = Frame(place, line, "", source.splitlines()[line - 1].strip())
            found.setdefault(frame.code, frame)
    if len(found) == 1:
        yield from found.values()


def _texts(node: Node, handles: Mapping[str, Handle], end: TopicEndpointInfo) -> Iterator[tuple[str, str]]:
    """Yield the programs and cells that may have made this endpoint, the newest first, each with its place."""
    if end.node_name == node.get_name():
        yield from (("the cell", text) for text in cells_run())
    for handle in list(handles.values()):
        if not any(each.rpartition("/")[2] == end.node_name for each in handle.nodes):
            continue
        if isinstance(handle, NodeProcess):
            yield handle.name, handle.source
        else:
            own: Any = type(handle.node).__mro__[1].__init__  # type: ignore[misc]  # that of the reader's class
            code = getattr(own, "__code__", None)
            yield place_of(code.co_filename) if code else "the cell", text_of(own)


def _others(node: Node, topic: str, publishes: bool) -> list[TopicEndpointInfo]:
    """Return the subscriptions for a publisher, or the publishers for a subscription, without hidden nodes."""
    look = node.get_subscriptions_info_by_topic if publishes else node.get_publishers_info_by_topic
    return [each for each in look(topic) if not is_hidden(each.node_name)]
