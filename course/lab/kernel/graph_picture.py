"""The graph as a picture has it: nodes, and what passes between them by topics, services and actions."""

from typing import Any

from course.lab.kernel.nodes import endpoints
from course.lab.kernel.panels import Changes, Panels, Topic
from course.ros.names import base
from course.session.live import Session, current

PERIOD = 0.5  # s
NODES, THINGS = 100, 300  # that a page draws: with more it stands still, and nobody finds anything
# What a node does with a thing: its kind, and whether messages, requests and goals go from the node to it.
ROLES = {
    "publishes": ("topic", True),
    "subscribes to": ("topic", False),
    "calls": ("service", True),
    "serves": ("service", False),
    "sends goals to": ("action", True),
    "offers the actions": ("action", False),
}


def add(panels: Panels) -> None:
    """Offer the graph."""
    panels.topics |= {"graph": Topic(lambda everything=False: Changes(lambda: state(everything)), PERIOD)}


def state(everything: bool) -> dict[str, Any]:
    """{"nodes": names, "things": [[kind, name, type], ...], "edges": [[node, role, kind, name], ...]}.

    Of very many nodes and things the first are told, and how many there are more: "left_out".

    Left out are hidden nodes, as those of the course itself, and what every node has, unless `everything` is wanted.
    Nodes is None without a session.
    """
    if (live := current()) is None:
        return {"nodes": None, "things": [], "edges": []}
    things: dict[tuple[str, str], str] = {}
    edges = []
    names = _names(live, everything)
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
    return told | ({"left_out": left_out} if left_out else {})


def _names(live: Session, everything: bool) -> list[str]:
    """The full names of the nodes that run, each once."""
    names = {row.name for row in live.rows() if row.alive and row.name.startswith("/")}
    if everything:
        spaces = live.node.get_node_names_and_namespaces()
        names |= {f"{space.rstrip('/')}/{name}" for name, space in spaces if name.startswith("_")}
    return sorted(names, key=lambda name: (base(name), name))
