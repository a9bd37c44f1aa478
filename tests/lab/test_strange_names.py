"""A program without rclpy can give its node any bytes as a name: panels, `ros.nodes()` and `ros2` go on."""

import os
import subprocess
import sys

import pytest

from course import environment
from tests.attacks.test_every_file import NO_NAME
from tests.lab.client import Client

TOPICS = ("nodes", "graph", "log", "robot", "robot.knobs", "inspector.exchanges")
MARKUP = "a<img src=x onerror=owned=1>"
# The bare name has no endpoints; with one, the middleware also gives it as the name of a publisher's node.
WITH_ENDPOINTS = """
from rmw_dds_common.msg import Gid
from sensor_msgs.msg import LaserScan
scan = node.create_publisher(LaserScan, '/scan', 1)
for topic in ('/parameter_events', '/scan'):
    mine = next(each for each in node.get_publishers_info_by_topic(topic) if each.node_name == 'n')
    message.node_entities_info_seq[0].writer_gid_seq.append(Gid(data=list(mine.endpoint_gid)))
data = """
MARKED = NO_NAME.replace("aZZZZ", MARKUP)
STRANGERS = {
    "no text": NO_NAME,
    "no text, with endpoints": NO_NAME.replace("\ndata = ", WITH_ENDPOINTS, 1),
    "markup": MARKED,
    "markup, with endpoints": MARKED.replace("\ndata = ", WITH_ENDPOINTS, 1),
}
# In the cell: whether rclpy's own list of names has the stranger's.
ARRIVED = f"""
from rclpy.node import Node
from course.foundation.waiting import wait_until
def arrived():
    try:
        return any(name == {MARKUP!r} for name, _ in Node.get_node_names_and_namespaces(ros.node))
    except UnicodeDecodeError:
        return True
print(bool(wait_until(arrived, 30)))
"""


def told(page: Client, name: str) -> None:
    """Wait until the panels have told of a node; none of the topics ends meanwhile."""
    topics = {"nodes", "graph"}
    while topics:
        event = page.event()
        assert "error" not in event
        if name in str(event["data"]):
            topics -= {event["topic"]}


@pytest.mark.parametrize("name", STRANGERS)
def test_a_node_with_an_invalid_name_ends_nothing(kernel, page, name):
    domain = int(kernel.run("print(ros.domain_id)"))
    for topic in TOPICS:
        page.subscribe(topic)
    stranger = subprocess.Popen(
        [sys.executable, "-c", STRANGERS[name]], env=os.environ | environment.session_variables(domain)
    )
    try:
        assert kernel.run(ARRIVED) == "True"
        kernel.run("class Friend(Node): pass\nros.start(Friend, 'friend')")
        told(page, "/friend")
        if name == "markup, with endpoints":
            told(page, f"/{MARKUP}")
        shown = kernel.run("print(repr(ros.nodes()))")
        assert "/friend" in shown and "Traceback" not in shown
        if name == "no text":
            assert "(a name that is not text)" in shown
        if name == "markup, with endpoints":
            assert "result" in page.answer(page.begin("subscribe", topic="nodes.node", options={"name": f"/{MARKUP}"}))
        for seconds in (2, 20):  # a busy machine may need longer to find them
            listed = kernel.run(f"!ros2 node list --spin-time {seconds}")
            if "/friend" in listed and (r"\xff" in listed or not name.startswith("no text")):
                break
        assert "/friend" in listed and "Traceback" not in listed
        assert (r"/a\xff\xfe" in listed) == name.startswith("no text")
    finally:
        stranger.kill()
        stranger.wait()
    kernel.run("ros.stop('friend')\nros.start(Friend, 'other')")
    told(page, "/other")
    assert "/other" in kernel.run("print(repr(ros.nodes()))")
    kernel.run("ros.stop()")
