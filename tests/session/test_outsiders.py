"""Programs outside of a session: who answers is told, with the process, and `nodes` has each of them."""

import subprocess
import sys
from collections.abc import Iterator

import pytest
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node

from course.foundation.waiting import wait_until
from course.session.live import Session

SERVER = """
import sys
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node


def add(request, response):
    response.sum = request.a + request.b
    return response


rclpy.init()
node = Node("adder")
if "--silent" not in sys.argv:
    node.create_service(AddTwoInts, "add_two_ints", add)
rclpy.spin(node)
"""


class Adder(Node):
    def __init__(self, name="adder"):
        super().__init__(name)
        self.create_service(AddTwoInts, "add_two_ints", self.add)

    def add(self, request, response):
        response.sum = -1
        return response


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.fixture
def server(tmp_path):
    path = tmp_path / "adder.py"
    path.write_text(SERVER)
    return path


@pytest.fixture
def outsider(session, server) -> Iterator[subprocess.Popen]:
    """The server, started in a terminal as it were."""
    with subprocess.Popen([sys.executable, server.name], cwd=server.parent, start_new_session=True) as process:
        wait_until(lambda: "/adder" in session.nodes(), 20.0)
        yield process
        process.kill()


def test_who_answers_is_told_when_the_session_has_not_started_it(session, outsider):
    assert session.call("add_two_ints", AddTwoInts, a=40, b=2).sum == 42
    (notice,) = session.watch.notices()
    assert notice == (
        f"/add_two_ints is answered by /adder, process {outsider.pid} (python adder.py), which this session has not "
        f"started. To end it: Ctrl-C in its terminal, or `!kill {outsider.pid}`."
    )
    session.call("add_two_ints", AddTwoInts, a=40, b=2)
    assert session.watch.notices() == []


def test_a_server_beside_that_of_the_session_is_told_and_is_in_the_table(session, outsider, server):
    stub = session.start(server, "--silent")
    (notice,) = session.watch.notices()
    assert "outside this session also has a node of this name" in notice and f"process {outsider.pid} " in notice
    outside = f"not started by this session: process {outsider.pid} (python adder.py)"
    assert [row.where for row in session.rows()] == [f"adder.py, process {stub.pid}", outside]
    session.call("add_two_ints", AddTwoInts)
    assert "is answered by /adder, process" in "".join(session.watch.notices())

    session.start(server)
    session.watch.notices()
    assert session.until(lambda: session.node.count_services("add_two_ints") == 2)
    session.wait_for_service("add_two_ints", AddTwoInts)
    assert "a node of this session and by /adder" in "".join(session.watch.notices())
    assert session.until(lambda: len(session.others("/add_two_ints")) == 2)
    (_, ending), own = session.others("/add_two_ints")
    assert f"`!kill {outsider.pid}`" in ending and own == ("adder.py of this notebook", "ros.stop('adder.py')")


def test_what_the_session_has_started_or_what_has_ended_is_no_outsider(session, server, outsider):
    outsider.kill()
    outsider.wait()
    session.start(Adder, "another")
    session.start(server)
    expected = ["adder.py of this notebook", "another of this notebook"]
    assert session.until(lambda: sorted(who for who, _ in session.others("/add_two_ints")) == expected)
    assert not [row for row in session.rows() if not row.started_as]


def test_a_file_that_takes_the_place_of_another_is_told(session, server):
    session.start(server)
    other = server.with_name("other.py")
    other.write_text(SERVER)
    session.start(other)
    (notice,) = session.watch.notices()
    assert notice == (
        "other.py replaces adder.py: both name their node 'adder'. To run both, give one of them another name in "
        "`super().__init__(...)`."
    )
    session.start(other)
    assert session.watch.notices() == []
