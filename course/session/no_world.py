"""Says that scans are waited for although no world runs, and which cell starts one."""

import re
from pathlib import Path
from typing import cast

from rclpy.node import Node

from course.foundation import cells
from course.ros.names import type_name

SCAN = "sensor_msgs/msg/LaserScan"
STARTS = re.compile(r"\bros\.start\(World\b")


def no_world(node: Node, folder: Path) -> str:
    """Return a text if `node` subscribes to scans on a topic that nobody publishes; '' otherwise."""
    for subscription in node.subscriptions:
        topic = subscription.topic_name
        if type_name(cast(type, subscription.msg_type)) == SCAN and not node.count_publishers(topic):
            return f"No node publishes {topic}, because no world is running. {_cell(folder)}"
    return ""


def _cell(folder: Path) -> str:
    """Return a sentence that names the cell of the folder's notebooks that starts a world."""
    for path, known in cells.readable(cells.notebooks(folder)):
        for cell in known:
            if cell.kind == "code" and not cell.public_check and STARTS.search(cell.source):
                first = next(line for line in cell.source.splitlines() if line.strip())
                return f"Run the cell of {path.name} that begins with `{first[:60]}`."
    return "Start one: `ros.start(World)`, with `from course.world.node import World`."
