"""Messages of cells, nodes and other programs are recorded from the session's start on, in JupyterLab alone."""

import contextlib
from types import SimpleNamespace

import pytest
from rclpy.task import Future

from course.lab.kernel.exchange import Exchange
from course.lab.kernel.start import SERVED
from course.lab.kernel.traffic import GAVE_UP, NEVER_TAKEN, TOO_LATE, Traffic, _Asked
from tests.kernels import Kernel
from tests.lab.client import Client, page_of
from tests.lab.test_inspector import SERVERS

CALLER = """import sys
import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node


class Caller(Node):
    def __init__(self):
        super().__init__('caller')
        self.client = self.create_client(AddTwoInts, 'add_two_ints')
        self.create_timer(0.2, self.ask)

    def ask(self):
        self.client.call_async(AddTwoInts.Request(a=4, b=5))


rclpy.init()
rclpy.spin(Caller())
"""
IN_THE_KERNEL = """from example_interfaces.srv import AddTwoInts
from rclpy.node import Node

class Adder(Node):
    def __init__(self):
        super().__init__('adder')
        self.create_service(AddTwoInts, 'add_here', self.add)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

ros.start(Adder)
"""
GOALS = """from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient
client = ActionClient(ros.node, Fibonacci, 'fibonacci')
client.wait_for_server()
heard = []
def send(order):
    return ros.wait(client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=heard.append))
"""
REPEATED = "ros2 service call --rate 5 /add_two_ints example_interfaces/srv/AddTwoInts '{a: 20, b: 22}'"
COMMAND = "!ros2 service call /{name} example_interfaces/srv/AddTwoInts '{{a: 20, b: 22}}'"


@pytest.fixture(scope="module")
def kernel(kernel):
    (kernel.folder / "servers.py").write_text(SERVERS)
    (kernel.folder / "caller.py").write_text(CALLER)
    kernel.run("ros.start('servers.py')")
    return kernel


@pytest.fixture
def page(page):
    page.subscribe("inspector.exchanges")
    return page


def newest(page: Client, **wanted: object) -> dict:
    """The newest exchange like this, when the list tells it.

    `ros2` is one of the `ros2` command, which may have ended before somebody has asked for its name.
    """
    while True:
        for each in page.event()["data"]:
            if wanted.items() <= (each | {"ros2": each["by"] in ("the ros2 command", "another program")}).items():
                return each


def events(kernel: Kernel, **wanted: object) -> dict:
    """All of the newest exchange that is like this, asked for by a page of its own."""
    page = page_of(kernel)
    page.subscribe("inspector.exchanges")
    number = newest(page, **wanted)["number"]
    follow = page.subscribe("inspector.exchange", number=number)
    while (event := page.event())["id"] != follow:
        pass
    page.close()
    return event["data"]


def names(exchange: dict) -> list[str]:
    return [name for _, name, _ in exchange["events"] if name != "feedback"]


def introspected(kernel: Kernel, service: str) -> None:
    """Wait until a service tells what it is asked, and the kernel hears it."""
    topic = f"{service}/_service_event"
    both = f"ros.node.count_publishers('{topic}') and ros.node.count_subscribers('{topic}')"
    assert kernel.run(f"print(ros.until(lambda: {both}, 30))") == "True"


def test_a_goal_is_accepted_before_its_feedback_in_whatever_order_rclpy_tells_of_them():
    exchange = Exchange("action", "/fibonacci", "example_interfaces/action/Fibonacci")
    for at, event in enumerate(["goal", "feedback", "accepted", "feedback"]):
        exchange.add(event, at=float(at))
    told = [[at, event] for at, event, _ in exchange.state()["events"]]
    assert told == [[0.0, "goal"], [1000.0, "accepted"], [1000.0, "feedback"], [3000.0, "feedback"]]
    assert exchange.state()["left_out"] == 0


def test_a_call_of_another_program_is_seen_from_the_server_that_the_session_runs(kernel, page):
    introspected(kernel, "/add_two_ints")
    assert "sum=42" in kernel.run(COMMAND.format(name="add_two_ints"))
    exchange = events(kernel, name="/add_two_ints", ros2=True, state="over")
    (began, *request), (took, *response) = exchange["events"]
    assert (request, response) == (["request", "a: 20\nb: 22"], ["response", "sum: 42"])
    assert began == 0.0 < took
    assert "Seen from the server" in exchange["about"]


def test_the_ros2_command_is_named_while_it_runs(kernel, page):
    introspected(kernel, "/add_two_ints")
    start = f"command = subprocess.Popen(shlex.split({REPEATED!r}), stdout=subprocess.DEVNULL)"
    kernel.run(f"import shlex, subprocess\n{start}")
    newest(page, name="/add_two_ints", by="the ros2 command", state="over")
    kernel.run("command.kill()\ncommand.wait()")


def test_a_program_of_the_session_that_calls_is_named_and_does_not_push_out_the_others(kernel, page):
    introspected(kernel, "/add_two_ints")
    kernel.run(COMMAND.format(name="add_two_ints"))
    kernel.run("ros.start('caller.py')")
    exchange = events(kernel, name="/add_two_ints", by="/caller", state="over")
    assert [text for *_, text in exchange["events"]] == ["a: 4\nb: 5", "sum: 9"]
    called = 0
    while called < 5:
        told = [each["by"] for each in page.event()["data"]]
        called = told.count("/caller")
    assert called == 5
    assert len(told) > 5
    kernel.run("ros.stop('caller.py')")


def test_a_server_in_the_kernel_is_seen_too_and_a_cells_call_of_it_once(kernel, page):
    kernel.run(IN_THE_KERNEL)
    introspected(kernel, "/add_here")
    kernel.run(COMMAND.format(name="add_here"))
    assert names(events(kernel, name="/add_here", ros2=True, state="over")) == ["request", "response"]
    kernel.run("ros.call('/add_here', AddTwoInts, a=1, b=2)")
    exchange = events(kernel, name="/add_here", by="a cell", state="over")
    assert (names(exchange), exchange["about"]) == (["request", "response"], "")
    kernel.run("ros.stop('adder')")
    second = page_of(kernel)
    second.subscribe("inspector.exchanges")
    told = [each["by"] for each in second.event()["data"] if each["name"] == "/add_here"]
    assert len(told) == 2 and told[0] == "a cell"
    second.close()


def test_a_client_of_a_node_in_the_kernel_is_seen(kernel, page):
    (kernel.folder / "inner.py").write_text(CALLER.partition("rclpy.init")[0].replace("'caller'", "'inner'"))
    kernel.run("from inner import Caller\nros.start(Caller)")
    exchange = events(kernel, name="/add_two_ints", by="/inner", state="over")
    assert ([text for *_, text in exchange["events"]], exchange["about"]) == (["a: 4\nb: 5", "sum: 9"], "")
    kernel.run("ros.stop('inner')")


def test_a_call_that_a_cell_sends_by_a_node_of_its_own_is_the_nodes(kernel, page):
    kernel.run(
        "import rclpy\nfrom rclpy.node import Node\nfrom example_interfaces.srv import AddTwoInts\n"
        "class Asker(Node):\n"
        "    def __init__(self):\n"
        "        super().__init__('asker', namespace='/room')\n"
        "        self.client = self.create_client(AddTwoInts, '/add_two_ints')\n"
        "asker = ros.start(Asker).node\n"
        "ros.wait(asker.client.call_async(AddTwoInts.Request(a=4, b=7)))"
    )
    exchange = events(kernel, name="/add_two_ints", by="/room/asker", state="over")
    assert exchange["events"][0][2] == "a: 4\nb: 7"
    kernel.run("ros.stop('asker')")


def test_a_call_is_over_although_its_executor_and_its_node_end_at_once(kernel, page):
    """As in a cell that spins for each call, and then destroys its node: nothing runs the future's callbacks."""
    said = kernel.run(
        "from rclpy.executors import SingleThreadedExecutor\nfrom rclpy.node import Node\n"
        "from example_interfaces.srv import AddTwoInts\n"
        "for number in (1, 2):\n"
        "    own = Node(f'own_{number}', context=ros.context)\n"
        "    executor = SingleThreadedExecutor(context=ros.context)\n"
        "    client = own.create_client(AddTwoInts, '/add_two_ints')\n"
        "    executor.add_node(own)\n"
        "    client.wait_for_service()\n"
        "    future = client.call_async(AddTwoInts.Request(a=4, b=number))\n"
        "    if number == 1:\n"
        "        executor.spin_until_future_complete(future)\n"
        "    own.destroy_node()"
    )
    assert said == ""
    exchange = events(kernel, name="/add_two_ints", by="/own_1", state="over")
    assert [text for *_, text in exchange["events"]] == ["a: 4\nb: 1", "sum: 5"]
    exchange = events(kernel, name="/add_two_ints", by="/own_2", state="failed")
    assert exchange["failed"] == "the client was destroyed before it took a response"


def test_a_response_that_its_client_does_not_take_is_told(kernel, page):
    """The server has done its part: nobody spins the client's node."""
    introspected(kernel, "/add_two_ints")
    kernel.run(
        "from rclpy.node import Node\nfrom example_interfaces.srv import AddTwoInts\n"
        "idle = Node('idle', context=ros.context)\n"
        "client = idle.create_client(AddTwoInts, '/add_two_ints')\n"
        "client.wait_for_service()\n"
        "future = client.call_async(AddTwoInts.Request(a=4, b=5))"
    )
    follow = page_of(kernel)
    follow.subscribe("inspector.exchange", number=newest(page, name="/add_two_ints", by="/idle")["number"])
    while (
        "The server has sent its response, and /idle has not taken it" not in (told := follow.event()["data"])["note"]
    ):
        assert told["state"] == "running"
    kernel.run("client.remove_pending_request(future)  # as `call` does after its time limit")
    while (told := follow.event()["data"])["state"] == "running":
        pass
    assert told["failed"] == NEVER_TAKEN.format("/idle")
    follow.close()
    kernel.run("idle.destroy_node()")


@pytest.mark.parametrize(
    ("answered", "said"), [(0.0, GAVE_UP), (0.2, TOO_LATE), (2.0, NEVER_TAKEN)], ids=["never", "late", "untaken"]
)
def test_a_call_that_its_caller_has_given_up_ends(monkeypatch, answered, said):
    """A server that has answered, at different times before, and one that has not."""
    now = 100.0
    monkeypatch.setattr("course.lab.kernel.traffic.time.monotonic", lambda: now)
    pending = {7: Future()}
    client = SimpleNamespace(get_pending_request=pending.__getitem__, handle=contextlib.nullcontext())
    exchange = Exchange("service", "/add", "example_interfaces/srv/AddTwoInts", "/doubler")
    traffic = Traffic.__new__(Traffic)
    traffic._asked = {pending[7]: _Asked(exchange, client, 7, answered and now - answered)}
    traffic._look_after_requests()
    assert (exchange.state()["note"] != "") == (said is NEVER_TAKEN)
    assert not exchange.over
    pending.clear()
    traffic._look_after_requests()
    assert (exchange.state()["note"], exchange.over) == (said.format("/doubler"), False)
    now += 1.5
    traffic._look_after_requests()
    assert exchange.state()["failed"] == said.format("/doubler")
    assert traffic._asked == {}


def test_a_call_without_an_answer_says_why(kernel, page):
    kernel.run("from std_srvs.srv import Trigger\nros.call('/stuck', Trigger, timeout=0.3)")
    assert "/stuck did not answer within 0.3 s" in events(kernel, name="/stuck", state="failed")["failed"]
    kernel.run("ros.restart('servers.py')")


def test_a_goal_of_a_cell_shows_each_step_and_its_feedback_still_arrives(kernel, page):
    kernel.run(GOALS)
    kernel.run("handle = send(4)\nresult = ros.wait(handle.get_result_async())")
    assert kernel.run("print(list(result.result.sequence), len(heard))") == "[0, 1, 1, 2, 3] 3"
    exchange = events(kernel, name="/fibonacci", by="a cell", state="over")
    assert names(exchange) == ["goal", "accepted", "succeeded"]
    assert (exchange["events"][0][2], exchange["type"]) == ("order: 4", "example_interfaces/action/Fibonacci")
    assert [name for _, name, _ in exchange["events"]].count("feedback") == 3
    kernel.run("handle = send(40)\nros.wait(handle.cancel_goal_async())\nros.wait(handle.get_result_async())")
    exchange = events(kernel, name="/fibonacci", by="a cell", state="over")
    assert [each for each in names(exchange) if each != "feedback"] == [
        "goal", "accepted", "cancel", "cancel accepted", "canceled"
    ]  # fmt: skip


def test_a_goal_whose_result_nobody_asks_for_ends_by_its_status(kernel, page):
    kernel.run(GOALS + "handle = send(3)")
    while (exchange := events(kernel, name="/fibonacci", by="a cell", state="over"))["events"][0][2] != "order: 3":
        pass
    assert names(exchange) == ["goal", "accepted", "succeeded"]


def test_a_goal_of_another_program_is_drawn_from_status_and_feedback(kernel, page):
    kernel.run("print(ros.until(lambda: ros.node.count_subscribers('/fibonacci/_action/feedback'), 30))")
    kernel.run("!ros2 action send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 5}' --feedback")
    exchange = events(kernel, kind="action", name="/fibonacci", ros2=True, state="over")
    assert names(exchange) == ["accepted", "succeeded"]
    feedback = [text for _, name, text in exchange["events"] if name == "feedback"]
    assert len(feedback) == 4 and feedback[-1].endswith("- 5")
    assert "are not shown" in exchange["about"]
    assert exchange["type"] == "example_interfaces/action/Fibonacci"


def test_a_client_is_known_before_its_node_on_a_busy_machine():
    """Seen with rmw_fastrtps 8.4: the middleware calls its node _NODE_NAME_UNKNOWN_ until it hears of it.

    A `ros2 action send_goal` is then known by its process.
    """
    commands = []
    unknown = SimpleNamespace(
        endpoint_gid=bytes(16), node_name="_NODE_NAME_UNKNOWN_", node_namespace="_NODE_NAMESPACE_UNKNOWN_"
    )
    node = SimpleNamespace(
        get_subscriptions_info_by_topic=lambda topic, no_mangle: [unknown], get_topic_names_and_types=list
    )
    traffic = Traffic.__new__(Traffic)
    outsiders = SimpleNamespace(is_command=lambda endpoint_gid, name: name in commands)
    traffic.live, traffic._own = SimpleNamespace(node=node, outsiders=outsiders), set()
    assert traffic._outside("/fibonacci").by == "another program"
    commands.append("ros2")
    assert traffic._outside("/fibonacci").by == "the ros2 command"


def test_an_answer_that_can_no_more_come_is_told(kernel, page):
    kernel.run(GOALS + "handle = send(1000)")
    newest(page, name="/fibonacci", by="a cell", state="running")
    kernel.run("ros.stop('servers.py')")
    assert "has gone" in events(kernel, name="/fibonacci", by="a cell", state="failed")["failed"]
    kernel.run("ros.start('servers.py')")


def test_what_is_introspected_loses_nothing(kernel, page):
    """Seen in rclpy 7.1.6: without the clock that it was given, the server crashes or loses requests."""
    introspected(kernel, "/add_two_ints")
    calls = "for a in range(250): last = ros.call('/add_two_ints', AddTwoInts, a=a)\nprint(last.sum)"
    assert kernel.run(f"from example_interfaces.srv import AddTwoInts\n{calls}") == "249"


def test_a_program_sees_nothing_of_it(kernel):
    (kernel.folder / "look.py").write_text(
        "import os, sys, threading\nimport rclpy\nfrom rclpy.node import Node\n"
        "print('sees', threading.active_count(), os.environ.get('PYTHONPATH'), 'COURSE_INTROSPECTION' in os.environ,"
        " [p for p in sys.path if 'started' in p], sys.argv)\nrclpy.init()\nrclpy.spin(Node('looking'))\n"
    )
    kernel.run("import os\nos.environ['PYTHONPATH'] = '/nowhere'\nros.start('look.py')\ndel os.environ['PYTHONPATH']")
    assert "sees 1 /nowhere False [] ['look.py']" in kernel.run("print(ros.logs('look.py', until='sees'))")
    kernel.run("ros.stop('look.py')")


def test_calls_before_any_page_are_recorded(tmp_path):
    """Also that of a program which calls as soon as the server is there."""
    kernel = Kernel(tmp_path, {SERVED: "early.ipynb"})
    (tmp_path / "servers.py").write_text(SERVERS)
    kernel.run("import course\nros = course.live()\nros.start('servers.py')")
    kernel.run(COMMAND.format(name="add_two_ints"))
    assert [text for *_, text in events(kernel, name="/add_two_ints", ros2=True)["events"]] == [
        "a: 20\nb: 22",
        "sum: 42",
    ]
    kernel.run("ros.close()\nros = course.live()\nros.start('servers.py')")
    kernel.run(COMMAND.format(name="add_two_ints").replace("22", "23"))
    assert [text for *_, text in events(kernel, name="/add_two_ints", ros2=True)["events"]][-1] == "sum: 43"
    kernel.stop()


ADDER = """import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState

class Adder(Node):
    def __init__(self):
        super().__init__('apart')
        self.service = self.create_service(AddTwoInts, 'add_apart', self.add)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

rclpy.init()
node = Adder()
"""
OWN_INTROSPECTION = (
    "node.service.configure_introspection(node.get_clock(), QoSProfile(depth=10), ServiceIntrospectionState.CONTENTS)\n"
)


def start_apart(kernel: Kernel, command: str) -> None:
    """Start a program in the kernel's ROS domain that its session knows nothing of."""
    kernel.run(f"import subprocess, sys\napart = subprocess.Popen([sys.executable, {command}])")
    assert kernel.run("print(ros.until(lambda: ros.node.count_services('/add_apart'), 30))") == "True"


def until_told(page: Client, service: str) -> dict | None:
    """Return the next event on a service whose calls are not recorded."""
    return next((each for each in page.event()["data"] if each["service"] == service), None)


def test_a_server_of_another_program_is_told_and_can_be_started_in_the_notebook(kernel, page):
    (kernel.folder / "adder.py").write_text(f"{ADDER}rclpy.spin(node)")
    start_apart(kernel, "'adder.py'")
    unseen = page_of(kernel)
    unseen.subscribe("inspector.unseen")
    while not (told := until_told(unseen, "/add_apart")):
        pass
    assert told["restart"] and "/apart, process " in told["server"] and "adder.py" in told["server"]
    assert unseen.ask("inspector.restart_server", service="/add_apart")["result"] is None
    while until_told(unseen, "/add_apart"):
        pass
    unseen.close()
    assert kernel.run("print(apart.poll() is not None)") == "True"
    kernel.run(COMMAND.format(name="add_apart"))
    assert events(kernel, name="/add_apart", ros2=True, state="over")["events"][-1][2] == "sum: 42"
    kernel.run("ros.stop('adder.py')")


def test_a_server_that_is_no_file_is_told_and_left_alone(kernel, page):
    start_apart(kernel, f"'-c', {ADDER + 'rclpy.spin(node)'!r}")
    page.subscribe("inspector.unseen")
    while (event := page.event()["data"]) == [] or "by" in event[0]:
        pass
    assert event == [{"service": "/add_apart", "server": event[0]["server"], "restart": False}]
    refused = page.ask("inspector.restart_server", service="/add_apart")["error"]
    assert refused == "no running server of /add_apart can be restarted in this notebook"
    kernel.run("apart.kill(); apart.wait()")


def test_a_program_with_an_introspection_of_its_own_is_heard(kernel, page):
    """It keeps no events for who comes later, as in rclpy's example."""
    (kernel.folder / "own.py").write_text(f"{ADDER}{OWN_INTROSPECTION}rclpy.spin(node)")
    start_apart(kernel, "'own.py'")
    introspected(kernel, "/add_apart")
    kernel.run(COMMAND.format(name="add_apart"))
    assert events(kernel, name="/add_apart", ros2=True, state="over")["events"][-1][2] == "sum: 42"
    kernel.run("apart.kill(); apart.wait()")


def test_a_notebook_that_is_executed_records_nothing(tmp_path):
    kernel = Kernel(tmp_path, {SERVED: ""})
    (tmp_path / "servers.py").write_text(SERVERS)
    kernel.run("import course\nros = course.live()")
    kernel.run("ros.start('servers.py')")
    kernel.run(f"{IN_THE_KERNEL}\nros.call('/add_here', AddTwoInts, a=1)\nros.call('/add_two_ints', AddTwoInts, a=1)")
    replaced = "from rclpy.client import Client\nprint(hasattr(Client.call_async, '__wrapped__'))"
    assert kernel.run(replaced) == "False"
    assert kernel.run("print(ros.node.count_publishers('/add_two_ints/_service_event'))") == "0"
    assert kernel.run("print(ros.node.count_publishers('/add_here/_service_event'))") == "0"
    assert kernel.run("print([each.topic_name for each in ros.node.subscriptions])") == "['/rosout']"
    kernel.stop()
