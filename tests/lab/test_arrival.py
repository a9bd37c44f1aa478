"""A robot that comes into a notebook's session is told to JupyterLab, once in a kernel's life; pages may come later."""

import pytest
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

from course.lab.kernel.arrival import TARGET, Arrival
from course.session.live import Session
from tests.lab.client import WAIT

SIMULATION = """import rclpy
from course.world.node import World

rclpy.init()
rclpy.spin(World())
"""


@pytest.mark.parametrize("start", ["ros.start(World)", "ros.start('simulation.py')"])
def test_a_world_of_a_cell_or_of_a_program_is_told_to_the_pages(kernel, start):
    (kernel.folder / "simulation.py").write_text(SIMULATION)
    kernel.run("from course.lab.kernel import traffic\ntraffic._arrival = traffic.Arrival()")  # as in a new kernel
    kernel.client.execute(f"from course.world.node import World\n{start}")
    while (message := kernel.client.get_iopub_msg(timeout=WAIT))["msg_type"] != "comm_open":
        pass
    assert message["content"]["target_name"] == TARGET
    news = message["content"]["comm_id"]

    def waiting() -> dict:
        """The news that no page has taken yet, as a page that comes later asks for it."""
        return kernel.client.comm_info(TARGET, reply=True, timeout=WAIT)["content"]["comms"]

    assert news in waiting()
    closing = kernel.client.session.msg("comm_close", {"comm_id": news, "data": {}})
    kernel.client.shell_channel.send(closing)
    assert news not in waiting()
    kernel.run("ros.stop()")


def test_it_is_told_once_and_of_nobody_who_is_hidden():
    told = []
    arrival = Arrival(lambda: told.append("a robot"))
    session = Session()

    def look(name: str) -> list[str]:
        node = Node(name, context=session.context)
        node.create_publisher(LaserScan, "scan", 10)
        assert session.until(lambda: session.node.count_publishers("/scan") == 1, WAIT)
        arrival.look(session)
        node.destroy_node()
        assert session.until(lambda: session.node.count_publishers("/scan") == 0, WAIT)
        return told

    try:
        arrival.look(None)
        assert look("_hidden") == []
        assert look("scanner") == ["a robot"]
        assert look("scanner") == ["a robot"]
    finally:
        session.close()
