"""A hint for an empty graph: the other ROS domains in which this user has nodes, and how to join them."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

from course import registry
from course.environment import KERNEL
from course.foundation.untrusted import one_line
from course.ros.discovery import participants_here
from course.ros.graph import Graph


def tell_if_alone(graph: Graph) -> None:
    """Print a line on stderr about other domains with nodes of this user, if the graph is complete and empty."""
    if graph.complete() and not graph.nodes():
        here = graph.context.get_domain_id()
        places = dict(_places(here))
        if places:
            named = ", ".join(f"{domain} ({one_line(place)})" for domain, place in places.items())
            # In a notebook's kernel `export` would have no effect.
            how = "" if KERNEL in os.environ else f" To join: export ROS_DOMAIN_ID={next(iter(places))}"
            print(f"ROS domain {here} has no nodes. You have nodes in ROS domain {named}.{how}", file=sys.stderr)


def _places(here: int) -> Iterator[tuple[int, str]]:
    """Yield the other domains in which this user's sessions and terminals have nodes, sessions last."""
    sessions = {record.domain: record for record in registry.running() if record.domain != here}
    for shell in registry.shells():
        for domain in {shell.domain, shell.own} - {0, here, *sessions}:
            if participants_here(domain):
                yield domain, "a terminal"
    for domain, record in sessions.items():
        if any(node.alive for node in record.nodes) or participants_here(domain) > 1:  # one is the session's
            yield domain, f"the notebook in {_short(record.folder)}"


def _short(folder: str) -> str:
    path, home = Path(folder), Path.home()
    return f"~/{path.relative_to(home)}" if path.is_relative_to(home) and path != home else folder
