"""The ROS graph as data for a picture: nodes, and the topics, services and actions between them."""

from collections import Counter
from typing import Any

from course.lab.kernel.nodes import endpoints
from course.lab.kernel.panels import Changes, Panels, Topic
from course.ros.names import base
from course.session.live import Session, current

PERIOD = 0.5  # s
NODES, THINGS = 100, 300  # drawn at most: more would block the page, and nobody could read the picture
# The roles of a node: the kind of thing, and whether messages, requests or goals go from the node to it.
ROLES = {
    "publishes": ("topic", True),
    "subscribes to": ("topic", False),
    "calls": ("service", True),
    "serves": ("service", False),
    "sends goals to": ("action", True),
    "offers the actions": ("action", False),
}


def add(panels: Panels) -> None:
    """Add the graph's topic."""
    panels.topics |= {"graph": Topic(lambda everything=False: Changes(lambda: state(everything)), PERIOD)}


def state(everything: bool) -> dict[str, Any]:
    """Return {"nodes": names, "things": [[kind, name, type], ...], "edges": [[node, role, kind, name], ...]}.

    Of too many nodes and things, only the first are returned, with the number of the others as "left_out".  Nodes of
    one name are one: "twins" has their number, by name, if there are any.

    Hidden nodes, such as the course's own, and the topics and services of every node are left out unless `everything`.
    Without a session, "nodes" is None.
    """
    if (live := current()) is None:
        return {"nodes": None, "things": [], "edges": []}
    things: dict[tuple[str, str], str] = {}
    edges = []
    running = _names(live, everything)
    names = sorted(running, key=lambda name: (base(name), name))
    names, left_out = names[:NODES], len(names[NODES:])
    for node in names:
        for role, found in endpoints(live, node, everything=everything).items():
            kind, _ = ROLES[role]
            for name, kind_of_it in found:
                things[kind, name] = kind_of_it
                edges.append([node, role, kind, name])
    if len(things) > THINGS:
        left_out += len(things) - THINGS
        things = dict(sorted(things.items())[:THINGS])
        edges = [edge for edge in edges if (edge[2], edge[3]) in things]
    told = {"nodes": names, "things": [[*key, kind] for key, kind in sorted(things.items())], "edges": edges}
    twins = {name: count for name in names if (count := running[name]) > 1}
    return told | ({"left_out": left_out} if left_out else {}) | ({"twins": twins} if twins else {})


def _names(live: Session, everything: bool) -> Counter[str]:
    """Return the full names of the running nodes, and how many have each."""
    names = Counter(row.name for row in live.rows() if row.alive and row.name.startswith("/"))
    if everything:
        spaces = live.node.get_node_names_and_namespaces()
        names |= Counter({f"{space.rstrip('/')}/{name}" for name, space in spaces if name.startswith("_")})
    return names
