"""The cause that keeps the ends of a topic, or an action, apart: its name, type or quality of service (QoS)."""

from typing import cast

from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.ros.names import is_hidden, type_name
from course.ros.rclpy_internals import action_name, action_type

SEND = "/_action/send_goal"  # the service of an action's server
LISTED = 6  # topics that a message names


def unmatched(node: Node, end: Publisher | Subscription) -> str:
    """Return why no other node has the other end of a topic of which `node` has this one."""
    publishes = isinstance(end, Publisher)
    verb, kind, topic = "subscribes" if publishes else "publishes", type_name(cast(type, end.msg_type)), end.topic_name
    others = _others(node, topic, publishes)
    for each in others:
        if each.topic_type != kind:
            return f"{each.node_name} {verb} {topic} with the type {each.topic_type}; it must be {kind}."
        offered, asked = (end.qos_profile, each.qos_profile) if publishes else (each.qos_profile, end.qos_profile)
        if qos_check_compatible(offered, asked)[0] == QoSCompatibility.ERROR:
            return (
                f"{each.node_name} {verb} {topic}, but the qualities of service (QoS) do not fit, so that nothing "
                f"arrives: the publisher offers {_words(offered)}, the subscription asks for {_words(asked)}."
            )
    if others:
        return f"{others[0].node_name} {verb} {topic} ({kind}), and was not connected in time: is the computer busy?"
    same = [name for name, kinds in node.get_topic_names_and_types() if kind in kinds]
    offers = sorted(f"{each.node_name} {verb} {name}" for name in same for each in _others(node, name, publishes))
    return f"No node {verb} {topic} ({kind})." + (f" Of this type, {', '.join(offers[:LISTED])}." if offers else "")


def unserved(node: Node, client: ActionClient) -> str:
    """Return why an action client of `node` finds no server, and what is served instead."""
    name, kind = action_name(client), type_name(cast(type, action_type(client)))
    served = {each: kinds for each, kinds in get_action_names_and_types(node) if node.count_services(f"{each}{SEND}")}
    if others := [each for each in served.get(name, []) if each != kind]:
        return f"The action {name} is served with the type {others[0]}; it must be {kind}."
    listed = ", ".join(f"{each} ({' and '.join(kinds)})" for each, kinds in sorted(served.items()))
    return f"No node serves the action {name} ({kind})." + (f" Served here: {listed}." if listed else "")


def _others(node: Node, topic: str, publishes: bool) -> list[TopicEndpointInfo]:
    """The ends of a topic that lie opposite to a publisher, or a subscription, without those of hidden nodes."""
    look = node.get_subscriptions_info_by_topic if publishes else node.get_publishers_info_by_topic
    return [each for each in look(topic) if not is_hidden(each.node_name)]


def _words(qos: QoSProfile) -> str:
    return f"{qos.reliability.name.lower()} and {qos.durability.name.lower()}"
