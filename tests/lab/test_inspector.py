"""The inspector, from the kernel's side: forms made from types, calls, goals, messages, parameters; their programs."""

import pytest

from course.errors import LiveError
from course.lab.kernel import forms, programs
from tests.lab.client import Client, page_of

SERVERS = """import time
import rclpy
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger


class Servers(Node):
    def __init__(self):
        super().__init__('servers')
        limits = FloatingPointRange(from_value=0.1, to_value=2.0)
        self.declare_parameter('offset', 0.5)
        self.declare_parameter('open', None, ParameterDescriptor(dynamic_typing=True))
        self.declare_parameter('raw', [b'a', b'b'])
        self.declare_parameter('label', 'a')
        self.declare_parameter('lines', 'a\\nb')
        self.declare_parameter('steps', [1, 2])
        self.declare_parameter('names', ['a'])
        self.declare_parameter('serial', 'A7', ParameterDescriptor(read_only=True))
        self.declare_parameter('speed', 1.0, ParameterDescriptor(description='m/s', floating_point_range=[limits]))
        self.create_service(AddTwoInts, 'add_two_ints', self.add)
        self.create_service(Trigger, 'stuck', self.stuck)
        self.other = self.create_client(AddTwoInts, 'add_two_ints')
        self.create_subscription(Twist, 'cmd_vel', lambda message: self.get_logger().info(f'got {message}'), 10)
        self.action = ActionServer(self, Fibonacci, 'fibonacci', self.execute,
                                   cancel_callback=lambda _: CancelResponse.ACCEPT)

    def add(self, request, response):
        response.sum = request.a + request.b
        return response

    def stuck(self, request, response):
        self.other.call(AddTwoInts.Request())  # of the same group: it never answers
        return response

    def execute(self, goal_handle):
        steps = [0, 1]
        for _ in range(goal_handle.request.order - 1):
            if goal_handle.is_cancel_requested:
                goal_handle.canceled()
                return Fibonacci.Result(sequence=steps)
            steps.append(steps[-1] + steps[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=steps))
            time.sleep(0.05)
        goal_handle.succeed()
        return Fibonacci.Result(sequence=steps)


rclpy.init()
executor = MultiThreadedExecutor(num_threads=3)
executor.add_node(Servers())
executor.spin()
"""
ADD = {"kind": "service", "name": "/add_two_ints", "type_name": "example_interfaces/srv/AddTwoInts"}
FIBONACCI = {"kind": "action", "name": "/fibonacci", "type_name": "example_interfaces/action/Fibonacci"}
TWIST = {"kind": "topic", "name": "/cmd_vel", "type_name": "geometry_msgs/msg/Twist"}
SPEED = {"kind": "parameter", "name": "/servers", "type_name": "double"}


@pytest.fixture(scope="module")
def kernel(kernel):
    (kernel.folder / "servers.py").write_text(SERVERS)
    kernel.run("ros.start('servers.py')")
    return kernel


def follow(page: Client, until: str, **sent: object) -> dict:
    """Send something, and what is said of it when `until` is among its events, or it is over."""
    number = page.ask("inspector.send", **sent)["result"]
    subscription = page.subscribe("inspector.exchange", number=number)
    while True:
        event = page.event()
        assert event["id"] == subscription
        state = event["data"]
        if until in [name for _, name, _ in state["events"]] or state["state"] != "running":
            return state


def ended(page: Client) -> dict:
    while (state := page.event()["data"]).get("state", "running") == "running":  # or an event of another topic
        pass
    return state


def filled(name: str, given: dict) -> forms.Filled:
    return forms.fill(forms.interface("topic", name).message, given)


def test_a_form_has_the_fields_of_the_type_with_their_defaults_and_constants():
    fields = forms.fields_of(forms.interface("topic", "geometry_msgs/msg/PoseStamped").message)
    assert [field["name"] for field in fields] == ["header", "pose"]
    orientation = fields[1]["fields"][1]
    assert orientation["type"] == "geometry_msgs/Quaternion"
    assert [field["default"] for field in orientation["fields"]] == ["0.0", "0.0", "0.0", "1.0"]
    level = forms.fields_of(forms.interface("topic", "diagnostic_msgs/msg/DiagnosticStatus").message)[0]
    assert level["choices"] == {"OK": "0", "WARN": "1", "ERROR": "2", "STALE": "3"}
    kind = forms.fields_of(forms.interface("topic", "rcl_interfaces/msg/ParameterValue").message)[0]
    assert kind["choices"] == {}  # they belong to another message
    with pytest.raises(LiveError, match="build its package"):
        forms.interface("service", "no_such_interfaces/srv/Nothing")


@pytest.mark.parametrize(
    ("name", "given", "field", "told"),
    [
        ("std_msgs/msg/UInt8", {"data": "300"}, "data", "0 to 255"),
        ("std_msgs/msg/Int64", {"data": "1.5"}, "data", "a whole number"),
        ("geometry_msgs/msg/Twist", {"linear": {"x": "0,5"}}, "linear.x", "a point, not a comma"),
        ("std_msgs/msg/Float32", {"data": "1e39"}, "data", "float32"),
        ("geometry_msgs/msg/PoseWithCovariance", {"covariance": "1, 2"}, "covariance", "exactly 36"),
        ("sensor_msgs/msg/LaserScan", {"ranges": "1, inf, x"}, "ranges", "value 3"),
        ("diagnostic_msgs/msg/DiagnosticArray", {"status": [{"level": "x"}]}, "status.0.level", "a whole number"),
        ("sensor_msgs/msg/JointState", {"name": "a, {b"}, "name", "in quotes"),
    ],
)
def test_wrong_input_is_told_beside_its_field(name, given, field, told):
    assert told in filled(name, given).wrong[field]


def test_what_is_written_arrives_to_the_last_digit():
    message = forms.interface("topic", "std_msgs/msg/Int64").message
    assert forms.message_of(message, forms.fill(message, {"data": "-9223372036854775807"})).data == -(2**63) + 1
    message = forms.interface("topic", "sensor_msgs/msg/JointState").message
    made = forms.message_of(message, forms.fill(message, {"name": '"a, b", 12', "position": "[1, -inf]"}))
    assert (made.name, list(made.position)) == (["a, b", "12"], [1.0, float("-inf")])
    message = forms.interface("topic", "diagnostic_msgs/msg/DiagnosticArray").message
    made = forms.message_of(message, forms.fill(message, {"status": [{"level": "2", "name": "it's"}]}))
    assert (made.status[0].level, made.status[0].name) == (b"\x02", "it's")


def test_a_program_of_nested_messages_makes_the_same_message():
    interface = forms.interface("topic", "diagnostic_msgs/msg/DiagnosticArray")
    given = {"header": {"frame_id": "map"}, "status": [{"level": "2", "name": 'a "b"', "values": [{"key": "k" * 60}]}]}
    filled = forms.fill(interface.message, given)
    text = programs.python(interface, "/diagnostics", filled.values)
    imports = "\n".join(line for line in text.splitlines() if line.startswith("from") and ".msg import" in line)
    made = text.partition("message = ")[2].partition("\n        self.publisher.publish")[0]
    scope: dict = {}
    exec(f"{imports}\nmade = {made}", scope)
    assert scope["made"] == forms.message_of(interface.message, filled)


def test_what_can_be_sent_to_is_offered_without_what_every_node_has(kernel, page):
    """Nor what has only a client."""
    kernel.run(
        "from rclpy.action import ActionClient\nfrom example_interfaces.action import Fibonacci\n"
        "lonely = ActionClient(ros.node, Fibonacci, '/lonely')"
    )
    page.subscribe("inspector")
    offered = page.event()["data"]
    assert [ADD["name"], ADD["type_name"]] in offered["service"]
    assert offered["action"] == [[FIBONACCI["name"], FIBONACCI["type_name"]]]
    assert offered["topic"] == [[TWIST["name"], TWIST["type_name"]]]
    assert offered["parameter"] == [["/servers", ""]]
    assert [name for name, _ in offered["service"] if name.startswith("/servers/")] == []


TWO_NODES = """from rclpy.node import Node
from std_srvs.srv import Trigger
class Greeter(Node):
    def __init__(self, name):
        super().__init__(name)
        self.create_service(Trigger, '/greet', lambda request, response: response)
for name in ('one', 'two'):
    ros.start(Greeter, name)"""


def wait_for_several(page: Client, wanted: dict[str, str]) -> None:
    """Wait until the page is told this of names with several servers: the middleware hears of one after the other."""
    told = []
    try:
        while not told or told[-1] != wanted:
            told.append(page.event()["data"]["several"])
    except TimeoutError:
        assert told[-1:] == [wanted]
        raise


def test_several_servers_of_one_name_are_named_until_one_is_left(kernel, page):
    kernel.run(
        "import subprocess, sys\noutside = subprocess.Popen([sys.executable, 'servers.py'], start_new_session=True)"
    )
    page.subscribe("inspector")
    process = kernel.run("print(outside.pid)")
    nodes = "Nodes shows where each runs: stop"
    both = f"/servers, process {process} (python servers.py) and by servers.py of this notebook"
    served = f"It is served by {both}: either may answer. {nodes} all but one."
    names = "service /add_two_ints", "service /stuck", "action /fibonacci"
    twins = f"2 nodes have this name: either may answer. {nodes} one, or give it another name."
    wait_for_several(page, dict.fromkeys(names, served) | {"parameter /servers": twins})
    kernel.run("outside.terminate()")
    wait_for_several(page, {})
    kernel.run(TWO_NODES)
    served = (
        f"It is served by one of this notebook and by two of this notebook: either may answer. {nodes} all but one."
    )
    wait_for_several(page, {"service /greet": served})
    kernel.run("ros.stop('one')\nros.stop('two')")


def test_a_service_is_called_and_its_program_and_line_do_the_same(kernel, page):
    state = follow(page, "response", **ADD, given={"a": "2", "b": "40"})
    assert [event for _, event, _ in state["events"]] == ["request", "response"]
    assert state["events"][0][0] == 0.0 < state["events"][1][0]
    assert state["events"][1][2] == "sum: 42"
    told = page.ask("inspector.look", **ADD, given={"a": "2", "b": "40"})["result"]
    (kernel.folder / "client.py").write_text(told["python"])
    assert "sum=42" in kernel.run("!python client.py")
    assert "sum=42" in kernel.run("!" + told["ros2"])
    wrong = page.ask("inspector.send", **ADD, given={"a": "two"})["error"]
    assert wrong == "a: write a whole number: int64 does not accept 'two'"
    assert page.ask("inspector.send", **ADD, given={"a": " "})["error"] == "a: write a whole number: the field is empty"


def test_a_goal_shows_its_feedback_and_result_and_its_program_does_the_same(kernel, page):
    state = follow(page, "succeeded", **FIBONACCI, given={"order": "4"})
    names = [event for _, event, _ in state["events"] if event != "feedback"]
    assert names == ["goal", "accepted", "succeeded"]
    assert state["events"][0] == [0.0, "goal", "order: 4"]
    assert "- 3" in state["events"][-1][2]
    told = page.ask("inspector.look", **FIBONACCI, given={"order": "4"})["result"]
    (kernel.folder / "client.py").write_text(told["python"])
    for printed in (kernel.run("!python client.py"), kernel.run("!" + told["ros2"])):
        assert "Feedback" in printed and "3" in printed.partition("Result")[2]


def test_a_goal_is_canceled_and_each_step_of_that_is_told(kernel, page):
    state = follow(page, "feedback", **FIBONACCI, given={"order": "40"})
    assert state["cancellable"]
    assert page.ask("inspector.cancel", number=state["number"])["result"] is None
    names = [event for _, event, _ in ended(page)["events"] if event != "feedback"]
    assert names[:3] == ["goal", "accepted", "cancel"]
    assert "canceled" in names[3:] and {*names[3:]} <= {"cancel accepted", "canceled"}  # they come in either order
    following = page.subscribe("inspector.exchanges")
    listed = next(each for each in page.event()["data"] if each["number"] == state["number"])
    assert (listed["state"], listed["end"]) == ("over", "canceled")
    page.ask("unsubscribe", id=following)
    assert "it has ended" in page.ask("inspector.cancel", number=state["number"])["error"]


def test_a_goal_that_is_aborted_by_an_exception_shows_it(kernel, page):
    """The 48th number is too large for an int32."""
    state = follow(page, "aborted", **FIBONACCI, given={"order": "60"})
    note = (state if state["state"] == "over" else ended(page))["note"]
    assert note.startswith("Its callback has raised an exception.\n") and "servers.py, line" in note


LATE = """import pathlib, time, rclpy
while not pathlib.Path('go').exists():
    time.sleep(0.05)
rclpy.init()
rclpy.spin(rclpy.create_node('late'))
"""


def test_a_program_is_offered_once_its_node_is_there(kernel, page):
    """Before that its row has the name of the file, of which no parameter could be set."""
    (kernel.folder / "late.py").write_text(LATE)
    nodes, offers = page.subscribe("nodes"), page.subscribe("inspector")
    kernel.client.execute("ros.start('late.py')")
    offered: set[str] = set()

    def follow(condition):
        while True:
            event = page.event()
            if event["id"] == offers:
                offered.update(name for name, _ in event["data"]["parameter"])
            if condition(event["id"], event["data"]):
                return

    follow(lambda number, data: number == nodes and "late.py" in [node["name"] for node in data["nodes"]])
    (kernel.folder / "go").touch()
    follow(lambda *_: "/late" in offered)
    assert "late.py" not in offered
    kernel.run("ros.stop('late.py')")


def test_a_page_that_is_loaded_again_finds_the_running_goal_and_cancels_it(kernel, page):
    fibonacci = {"kind": "action", "name": "/fibonacci"}
    assert page.ask("inspector.latest")["result"] is None  # nothing runs
    number = page.ask("inspector.send", **FIBONACCI, given={"order": "45"})["result"]
    again = page_of(kernel)
    found = again.ask("inspector.latest")["result"]
    assert found == {**fibonacci, "number": number, "type": FIBONACCI["type_name"]}
    assert again.ask("inspector.latest", **fibonacci)["result"] == found
    assert again.ask("inspector.latest", kind="action", name="/other")["result"] is None
    again.subscribe("inspector.exchange", number=number)
    state = again.event()["data"]
    while "feedback" not in [name for _, name, _ in state["events"]]:
        state = again.event()["data"]
    assert state["cancellable"]
    assert again.ask("inspector.cancel", number=number)["result"] is None
    assert ended(again)["end"] == "canceled"
    assert again.ask("inspector.latest")["result"] is None
    assert again.ask("inspector.latest", **fibonacci)["result"] == found  # its end is still shown
    again.close()


def test_a_message_is_published_and_its_program_and_line_do_the_same(kernel, page):
    given = {"linear": {"x": "0.25"}}
    assert follow(page, "received", **TWIST, given=given)["events"][-1][2] == "by 1 subscription"
    told = page.ask("inspector.look", **TWIST, given=given)["result"]
    (kernel.folder / "client.py").write_text(told["python"])
    kernel.run("!python client.py")
    kernel.run("!" + told["ros2"])
    assert "3" in kernel.run("ros.until(lambda: str(ros.logs('servers')).count('x=0.25') == 3, 30)\n"
                             "print(str(ros.logs('servers')).count('x=0.25'))")  # fmt: skip
    alone = follow(page, "over", **TWIST | {"name": "/nowhere"}, given=given)
    assert "no node subscribes to /nowhere" in alone["failed"]


def test_a_message_is_published_at_a_rate_until_it_is_stopped_and_its_program_and_line_go_on_too(kernel, page):
    given = {"linear": {"x": "0.125"}}
    count = "str(ros.logs('servers')).count('x=0.125')"
    number = page.ask("inspector.send", **TWIST, given=given, rate="20")["result"]
    page.subscribe("inspector.exchange", number=number)
    while "Published" not in (state := page.event()["data"])["note"]:
        pass
    assert "20 a second, to 1 subscription." in state["note"] and state["cancellable"]
    plot = page.subscribe("plot", name="/cmd_vel", field="linear.x")  # the course's own subscription
    while page.event()["id"] != plot:
        pass
    note = None
    while note == state["note"] or not note:
        event = page.event()
        note = event["data"].get("note")
    assert "20 a second, to 1 subscription." in note
    assert page.ask("unsubscribe", id=plot)["result"] is None
    assert kernel.run(f"print(ros.until(lambda: {count} > 30, 30))") == "True"
    assert page.ask("inspector.cancel", number=number)["result"] is None
    state = ended(page)
    (_, first, _), (took, last, told) = state["events"]
    sent = int(told.removeprefix("number "))
    assert (first, last) == ("message", "last message") and sent > 30
    assert (state["about"], state["note"]) == ("", ""), "it does not go on, and the reader has stopped it"
    assert took >= (sent - 1) / 20 * 1e3 * 0.9  # ms: not faster than asked for
    assert kernel.run(f"ros.until(lambda: {count} == {sent}, 30)\nprint({count})") == str(sent)
    assert "nothing to stop" in page.ask("inspector.cancel", number=number)["error"]
    told = page.ask("inspector.look", **TWIST, given=given, rate="20")["result"]
    assert told["ros2"].startswith("ros2 topic pub --rate 20 /cmd_vel")
    assert state["line"] == told["ros2"]  # by which the page sees that its form has not changed
    (kernel.folder / "again.py").write_text(told["python"])
    for run, end in (
        ("ros.start('again.py')", "ros.stop('again.py')"),
        (
            f"p = __import__('subprocess').Popen({told['ros2']!r}, shell=True, start_new_session=True)",
            "__import__('os').killpg(p.pid, 2)",
        ),
    ):
        kernel.run(f"before = {count}\n{run}")
        assert kernel.run(f"print(ros.until(lambda: {count} > before + 20, 30))") == "True"
        kernel.run(end)


def test_a_rate_has_bounds_and_ends_with_the_page_and_with_the_next_message(kernel, page):
    for wrong in ("1000", "0", "fast", "nan"):
        assert page.ask("inspector.look", **TWIST, given={}, rate=wrong)["result"]["wrong"].keys() == {"(rate)"}
        assert "rate: write" in page.ask("inspector.send", **TWIST, given={}, rate=wrong)["error"]
    seen = page_of(kernel)
    number = seen.ask("inspector.send", **TWIST, given={}, rate="50")["result"]
    subscription = seen.subscribe("inspector.exchange", number=number)
    seen.event()
    follow(page, "received", **TWIST, given={})  # on the same topic
    while (event := seen.event())["id"] != subscription or event["data"]["state"] == "running":
        pass
    number = seen.ask("inspector.send", **TWIST, given={}, rate="50")["result"]
    page.subscribe("inspector.exchange", number=number, onlooker=True)  # a graph, which does not keep it
    seen.close()  # as when the browser's tab is closed
    kernel.run(f"from course.lab.kernel.exchange import find\nstopped = ros.until(lambda: find({number!r}).over, 30)")
    assert kernel.run("print(stopped)") == "True"
    subscription = page.subscribe("inspector.exchange", number=number)
    state = next(event["data"] for event in iter(page.event, None) if event["id"] == subscription)
    assert state["about"] == "" and state["note"].startswith("Publishing stopped, because the Inspector")


def test_a_parameter_is_set_or_refused_with_the_reason_and_its_program_and_line_do_the_same(kernel, page):
    fields = page.ask("inspector.form", kind="parameter", name="/servers", type_name="")["result"]
    assert [field["name"] for field in fields[-2:]] == ["start_type_description_service", "use_sim_time"]
    speed = next(field for field in fields if field["name"] == "speed")
    assert (speed["default"], speed["type"], speed["about"]) == ("1.0", "double", "m/s; 0.1 to 2.0")
    serial = next(field for field in fields if field["name"] == "serial")
    assert (serial["about"], serial["fixed"], serial["read_only"]) == ("read-only", False, True)
    fixed = [(field["name"], field["type"]) for field in fields if field["fixed"]]
    assert fixed == [("open", "not set"), ("raw", "byte array")]  # which the page names
    given = {"type_name": "string", "given": {"serial": "B8"}}
    assert "read-only" in follow(page, "rejected", **SPEED | given)["events"][-1][2]
    accepted = follow(page, "accepted", **SPEED, given={"speed": "0.5"})
    assert (accepted["failed"], accepted["about"]) == ("", "It sets the parameter speed.")
    refused = follow(page, "rejected", **SPEED, given={"speed": "5"})["events"][-1]
    assert "range" in refused[2]
    told = page.ask("inspector.look", **SPEED, given={"speed": "0.75"})["result"]
    (kernel.folder / "client.py").write_text(told["python"])
    assert "successful=True" in kernel.run("!python client.py")
    assert "0.75" in kernel.run("!ros2 param get /servers speed")
    assert "successful" in kernel.run("!" + page.ask("inspector.look", **SPEED, given={"speed": "1"})["result"]["ros2"])
    assert "1.0" in kernel.run("!ros2 param get /servers speed")
    wrong = page.ask("inspector.look", **SPEED, given={"speed": "fast"})["result"]["wrong"]
    assert wrong == {"speed": "write a number: double does not accept 'fast'"}


@pytest.mark.parametrize(
    ("kind", "name", "value", "stored"),
    [
        ("double", "offset", "-0.5", "-0.5"),
        ("double", "offset", "-1e-7", "-1e-07"),
        ("double", "offset", "-inf", "-inf"),
        ("string", "label", "--all", "--all"),
        ("integer array", "steps", "", "[]"),
        ("string array", "names", "", "[]"),
        ("string array", "names", '"p,q", "", -a', "['p,q', '', '-a']"),
    ],
)
def test_the_line_and_the_program_set_what_the_form_sets(kernel, page, kind, name, value, stored):
    asked = {"kind": "parameter", "name": "/servers", "type_name": kind}
    told = page.ask("inspector.look", **asked, given={name: value})["result"]
    defaults = {"offset": "0.5", "label": "a", "steps": "1, 2", "names": "a"}
    (kernel.folder / "client.py").write_text(told["python"])
    for line in (told["ros2"], "python client.py"):
        assert follow(page, "accepted", **asked, given={name: defaults[name]})["failed"] == ""
        kernel.run(f"!{line}")
        assert f": {stored}" in kernel.run(f"!ros2 param get /servers {name}")


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        (["a b", "12", "no"], "a b, 12, no"),
        (["p,q", "r"], '"p,q", r'),
        (["a", "b,c", ""], 'a, "b,c", ""'),
        ([""], '""'),
        ([], ""),
        (["[a]", " b", "c: d", "e\nf", "'g'", 'h"', "{", "# i", "-"], None),
    ],
)
def test_a_list_of_texts_is_shown_as_it_is_read(values, shown):
    text = forms.listed(values)
    assert shown in (text, None) and forms.scalars("string", text) == values


def test_calls_of_cells_are_kept_with_their_times(kernel, page):
    call = "from example_interfaces.srv import AddTwoInts\nros.call('/add_two_ints', AddTwoInts, a=A, b=40)"
    following = page.subscribe("inspector.exchanges")
    before = {each["number"] for each in page.event()["data"]}
    kernel.run(call.replace("A, b", "3, b"))
    while (newest := page.event()["data"][0])["number"] in before or newest["state"] == "running":
        pass
    assert (newest["kind"], newest["name"], newest["state"]) == ("service", "/add_two_ints", "over")
    assert page.ask("unsubscribe", id=following)["result"] is None
    page.events.clear()
    page.subscribe("inspector.exchange", number=newest["number"])
    sent, answered = page.event()["data"]["events"]
    assert sent == [0.0, "request", "a: 3\nb: 40"]
    assert answered[0] > 0.0 and answered[1:] == ["response", "sum: 43"]


@pytest.mark.parametrize("sent", [ADD | {"given": {}}, FIBONACCI | {"given": {}}, SPEED | {"given": {"speed": "1.0"}}])
def test_a_wrong_time_limit_is_told_and_nothing_is_sent(page, sent):
    latest = {"kind": sent["kind"], "name": sent["name"]}
    before = page.ask("inspector.latest", **latest)["result"]
    for wrong in ("x", "", "0", "-1", "nan", "1e9", "3600.5"):
        looked = page.ask("inspector.look", **sent, timeout=wrong)["result"]
        assert looked["wrong"].keys() == {"(limit)"} and looked["wrong"]["(limit)"].startswith("write a number"), wrong
        assert looked["ros2"], "which does not depend on the limit"
        assert "Wait at most: write a number" in page.ask("inspector.send", **sent, timeout=wrong)["error"], wrong
    assert page.ask("inspector.latest", **latest)["result"] == before
    for right in ("3600", "0.5"):
        assert page.ask("inspector.look", **sent, timeout=right)["result"]["wrong"] == {}


def test_a_server_that_never_answers_is_told_after_the_time_limit_and_holds_up_nothing(kernel, page):
    stuck = {"kind": "service", "name": "/stuck", "type_name": "std_srvs/srv/Trigger"}
    state = follow(page, "response", **stuck, given={}, timeout=0.5)
    assert [event for _, event, _ in state["events"]] == ["request"]
    assert "/stuck did not answer within 0.5 s" in state["failed"]
    kernel.run("ros.restart('servers.py')")
    nobody = follow(page, "over", **ADD | {"name": "/nobody"}, given={}, timeout=0.2)
    assert "no server for /nobody within 0.2 s" in nobody["failed"]
    begun = follow(page, "accepted", **FIBONACCI, given={"order": "40"})
    assert begun["state"] == "running"
    kernel.run("ros.restart('servers.py')")
    assert "/fibonacci was started again and does not know this goal" in ended(page)["failed"]
    gone = follow(page, "accepted", **FIBONACCI, given={"order": "40"})
    assert gone["state"] == "running"
    kernel.run("ros.stop()")
    assert "the action server of /fibonacci has gone" in ended(page)["failed"]
