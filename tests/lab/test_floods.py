"""A program that nobody of this session started floods its ROS domain, or publishes bytes that are no messages.

The kernel keeps a bounded part, goes on running cells and telling its pages, and says which node floods.
"""

import os
import re
import subprocess
import sys
import threading
from collections import deque
from contextlib import contextmanager

import pytest
from rcl_interfaces.msg import ListParametersResult, Log, ParameterDescriptor, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.serialization import serialize_message
from std_msgs.msg import String
from visualization_msgs.msg import Marker

from course import environment
from course.foundation.untrusted import all_visible
from course.foundation.waiting import wait_until
from course.lab import protocol
from course.lab.kernel import inspector, knobs, log, nodes
from course.lab.kernel.exchange import LARGEST, Exchange
from course.lab.kernel.robot_listener import TOLD, RobotListener
from course.session import logs
from course.session.following import LogFollower
from course.session.logs import Entry, LogBook, Logs, entry_of, node_of, short
from course.session.node_process import NodeProcess
from tests import chosen
from tests.attacks import test_middleware
from tests.kernels import Kernel
from tests.lab.client import page_of

STRANGER = """
import array, math, sys, threading, time
import rclpy
from course_interfaces.action import Fibonacci
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log, Parameter, ParameterEvent, ParameterValue
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from visualization_msgs.msg import Marker

rclpy.init()
node = rclpy.create_node('stranger')
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

def publisher(kind, topic, qos=10):
    made = node.create_publisher(kind, topic, qos)
    while not made.get_subscription_count():
        time.sleep(0.01)
    return made
"""
LINES = """
log = publisher(Log, '/rosout', QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL))
long, line = (serialize_message(Log(level=20, name='stranger', msg=size * 'x')) for size in (1_000_000, 60))
for _ in range(400):
    log.publish(long)
    time.sleep(0.005)
while True:
    for _ in range(100):
        log.publish(line)
    time.sleep(0.005)
"""
# Nine kinds of bytes that are no message: cut off, or with lengths that are longer than all, and negative as int32.
BROKEN = """
FEW, MANY = bytes([0, 1, 0, 0]) + bytes(7), bytes([0, 1, 0, 0]) + bytes(12) + bytes([255] * 4) + b'abc'
made = [publisher(kind, topic, qos) for kind, topic, qos in (
    (Log, '/rosout', LATCHED), (ParameterEvent, '/parameter_events', 10), (String, '/collision', LATCHED),
    (Marker, '/walls', LATCHED), (LaserScan, '/scan', 10), (Odometry, '/odom', 10), (Twist, '/cmd_vel', 10),
    (Fibonacci.Impl.FeedbackMessage, '/f/_action/feedback', 10))]
for _ in range(20):
    for each in made:
        each.publish(FEW)
        each.publish(MANY)
    time.sleep(0.02)
"""
LARGE = """
scan = publisher(LaserScan, '/scan')
events = publisher(ParameterEvent, '/parameter_events')
strings = [Parameter(name=f'p{n}', value=ParameterValue(type=4, string_value=90 * 'x')) for n in range(50_000)]
event = serialize_message(ParameterEvent(node='/stranger', new_parameters=strings))
for _ in range(10):
    events.publish(event)
events.wait_for_all_acked()
ranges = array.array('f', [1.0, math.inf, math.nan, -math.inf]) * 60_000
seen = serialize_message(LaserScan(angle_increment=1e-6, range_max=9.0, ranges=ranges))
while True:
    scan.publish(seen)
    time.sleep(0.1)
"""
# Its own goals: a panel that listens to all feedback hears theirs too.
FEEDBACK = """
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import MultiThreadedExecutor
def execute(goal):
    feedback = Fibonacci.Feedback(partial_sequence=array.array('i', [1]) * SIZE)
    print('floods', flush=True)
    while True:
        goal.publish_feedback(feedback)
        time.sleep(PAUSE)
other = rclpy.create_node('other')
server, client = ActionServer(other, Fibonacci, '/stranger', execute), ActionClient(node, Fibonacci, '/stranger')
client.wait_for_server()
client.send_goal_async(Fibonacci.Goal(order=3))
executor = MultiThreadedExecutor()
executor.add_node(other)
executor.spin()
"""
EVENTS = """
events = publisher(ParameterEvent, '/parameter_events')
event = ParameterEvent(node='/stranger', changed_parameters=[
    Parameter(name='p', value=ParameterValue(type=4, string_value='y'))])
event = serialize_message(event)
print('floods', flush=True)
while True:
    for _ in range(200):
        events.publish(event)
    time.sleep(0.002)
"""
REQUESTS = """
from rcl_interfaces.srv import SetParameters
value = ParameterValue(type=4, string_value=100_000_000 * 'x')
clients, names = [], set()
while True:
    for name, types in node.get_service_names_and_types():
        if types == ['rcl_interfaces/srv/SetParameters'] and name not in names and 'stranger' not in name:
            names.add(name)
            clients.append(node.create_client(SetParameters, name))
    for client in clients:
        client.call_async(SetParameters.Request(parameters=[Parameter(name='p', value=value)]))
        print('floods', flush=True)
    time.sleep(1)
"""


def rtps(name: str) -> str:
    """A stranger that speaks RTPS itself, as `tests/attacks/test_middleware.py` does to a judge; it goes on."""
    attack, how = test_middleware.ATTACKS[name]
    begin = "rclpy.init()\nnode = rclpy.create_node('attacker')\nprint('floods', flush=True)"
    return f"{attack}\n{begin}\nwhile True:\n    attack(node, {how})\n"


# Fast DDS takes the memory of a sample of which one fragment has come, and has no bound for all of them: a kernel does
# not outlive "takes memory for a sample", which a program sends that is on this computer and speaks RTPS itself.
CRAFTED = [name for name in test_middleware.ATTACKS if name != "takes memory for a sample"]
FLOODS = {
    "small feedback": FEEDBACK.replace("SIZE", "5").replace("PAUSE", "0.0001"),
    "huge feedback": FEEDBACK.replace("SIZE", "20_000_000").replace("PAUSE", "0.3"),
    "parameter events": EVENTS,
    "huge requests": REQUESTS,
    **{name: rtps(name) for name in CRAFTED},
}
# In each run: one flood of valid messages, and the crafted ones that bring down judges.
NIGHTLY = set(FLOODS) - {"small feedback", "writes beyond a sample"}


def memory(kernel: Kernel) -> int:
    """Return what the kernel takes, in MiB."""
    return int(kernel.run("import psutil\nprint(psutil.Process().memory_info().rss >> 20)").splitlines()[0])


@contextmanager
def stranger(kernel: Kernel, text: str):
    """A program in the kernel's ROS domain that its session has not started."""
    domain = int(kernel.run("print(ros.domain_id)").splitlines()[0])
    program = subprocess.Popen(
        [sys.executable, "-c", text if "rclpy.init()" in text else STRANGER + text],
        env=os.environ | environment.session_variables(domain),
        stdout=subprocess.PIPE,
    )
    try:
        yield program
    finally:
        program.kill()
        program.communicate()


def test_a_flood_of_lines_is_cut_and_its_node_is_named(kernel):
    page = page_of(kernel)
    page.subscribe("log")
    before = memory(kernel)
    with stranger(kernel, LINES):
        lost, longest = 0, 0
        while lost < 5000:
            data = page.event()["data"]
            lost += data["lost"]
            longest = max([longest, *(len(line[2]) for line in data["lines"])])
        assert longest < 2100
        # A cell that runs is still interrupted.
        begun = threading.Event()

        def interrupt(text: str) -> None:
            if "begun" in text and not begun.is_set():
                begun.set()
                kernel.interrupt()

        said = kernel.run("print('begun')\nwhile True:\n    pass", seen=interrupt)
        assert re.search(
            r"KeyboardInterrupt: the cell was interrupted in line [23], `(while True:|pass)`\.$", said.strip()
        ), said
        assert "Traceback" not in said
        said += kernel.run("pass")
        assert "The node 'stranger' logs more than 1,000 lines a second" in said
        assert "This session has not started it" in said
        assert int(kernel.run("print(len(repr(ros.logs())))")) < 1_100_000
    assert memory(kernel) < before + 350
    page.close()


@pytest.mark.long("each reader must be seen to go on")
def test_bytes_that_are_no_messages_end_no_panel(kernel):
    page = page_of(kernel)
    for topic in ("log", "robot", "robot.knobs", "inspector.exchanges"):
        page.subscribe(topic)
    with stranger(kernel, BROKEN) as program:
        while not wait_until(lambda: program.poll() is not None, 0.1, alert=False):
            page.ask("nothing")  # answered, also while nothing changes
            while page.events:
                assert "error" not in page.event()
    page.close()


def test_scans_and_events_of_any_size_are_told(kernel):
    before = memory(kernel)
    page = page_of(kernel)
    page.subscribe("robot")
    page.subscribe("robot.knobs")
    scan = None
    with stranger(kernel, LARGE):
        while not scan:  # which comes after all events
            event = page.event()
            assert "error" not in event
            scan = event["data"].get("scan")
    assert scan["beams"] == 240_000
    assert len(scan["ranges"]) <= 1000
    assert memory(kernel) < before + 250
    page.close()


@pytest.mark.parametrize("name", chosen.cases(FLOODS, NIGHTLY))
def test_a_kernel_and_its_panels_outlive_it(kernel, name):
    """The panels are answered, cells run, and what runs later is shown."""
    page = page_of(kernel)
    for topic in ("nodes", "graph", "log", "inspector.exchanges", "robot.knobs"):
        page.subscribe(topic)
    kernel.run("from rclpy.node import Node\nclass Friend(Node): pass\nros.start(Friend, 'first')")
    before = memory(kernel)
    with stranger(kernel, FLOODS[name]) as program:
        assert program.stdout.readline() == b"floods\n"
        for number in range(5):
            kernel.run(f"ros.start(Friend, 'friend{number}')")
            told = set()
            while told != {"nodes", "graph"}:
                event = page.event()
                assert "error" not in event
                if f"/friend{number}" in str(event["data"]):
                    told.add(event["topic"])
            assert kernel.run("print(6 * 7)") == "42"
        assert program.poll() is None
    assert memory(kernel) < before + 1000
    kernel.run("ros.stop()")
    page.close()


def test_a_long_line_keeps_its_beginning_its_node_and_its_time():
    message = serialize_message(Log(level=40, name="größe", msg="wörter" * 100_000, file="f.py", line=7))
    kept = short(message)
    assert len(kept) < 2 * logs.LONGEST
    assert node_of(kept) == "größe"
    entry = entry_of(kept)
    assert (entry.level, entry.node) == ("ERROR", "größe")
    assert entry.text.startswith("wörterwörter")
    assert entry.text.endswith(f"… (a message of {len(message):,} bytes)")
    assert short(kept) is kept


@pytest.mark.parametrize(
    "message", [b"", b"\0", bytes(4), bytes([0, 1, 0, 0]) + bytes(12) + b"\xff" * 40, bytes(20_000)]
)
def test_what_is_no_log_message_is_an_entry(message):
    assert entry_of(short(message)).level in ("WARN", "0")


def test_a_book_tells_of_a_flood_and_forgets_only_what_it_is_asked_to():
    told = []

    class Node:
        def create_subscription(self, kind, topic, hear, *_, **__):
            self.hear = hear

    node = Node()
    book = LogBook(node, told.append)
    node.hear(b"no message", {})
    for number in range(3 * logs.SAMPLE):
        node.hear(serialize_message(Log(name="one" if number % 4 else "other", msg="text")), {})
    assert set(told) == {"one"}
    book.forget("one")
    assert {entry.node for entry in book.read()} == {"other"}


def test_lines_that_the_book_has_lost_before_the_first_read_are_older_ones():
    class Node:
        def create_subscription(self, kind, topic, hear, *_, **__):
            self.hear = hear

    node = Node()
    book = LogBook(node)
    for number in range(logs.KEPT + 7):
        node.hear(serialize_message(Log(name="one", level=40 if number == 0 else 20, msg=f"{number}")), {})
    errors = LogFollower(book, list, lambda entry: entry.level == "ERROR")
    assert errors.read(100) == ([], 0) and errors.older == 7
    everything = LogFollower(book, list)
    entries, lost = everything.read(100)
    assert (entries[0].text, len(entries), lost, everything.older) == (f"{logs.KEPT - 93}", 100, 0, logs.KEPT - 93)


def test_many_long_lines_are_shown_in_part():
    entries = Logs([Entry("INFO", "node", f"{number} " + 9000 * "x") for number in range(1000)])
    shown = str(entries)
    assert len(shown) < 1.1 * logs.SHOWN
    assert shown.startswith("(889 earlier lines are not shown")
    assert "999 xxx" in shown
    assert len(entries._repr_html_()) < 1.1 * logs.SHOWN
    assert str(Logs(entries[:2])) == f"{entries[0]}\n{entries[1]}"


@pytest.mark.parametrize("letters", [1990 * "\N{GRINNING FACE}", 1990 * "\x01", "short"])
def test_lines_that_do_not_fit_in_one_event_come_in_several(letters, monkeypatch):
    entries = [Entry("INFO", "node", f"{number} {letters}") for number in range(1100)]

    class Follower:
        older = 7

        def read(self, limit):
            told, entries[:] = entries.copy(), []
            return told, 3 * bool(told)

    class Live:
        def follow_logs(self, wanted):
            return Follower()

    live = Live()
    monkeypatch.setattr(log, "session", lambda: live)
    feed, events = log.LogFeed(), []
    while event := feed.read():
        events.append(event)
        assert len(protocol.encoded(all_visible(event["lines"]))) < 2 * log.EVENT
    assert [line[2].split()[0] for event in events for line in event["lines"]] == [str(each) for each in range(1100)]
    assert [sum(event[name] for event in events) for name in ("lost", "older")] == [3, 7]


def test_a_type_that_is_none_is_no_parameter_of_the_form(monkeypatch):
    """A program that does not use rclpy may answer so."""
    known = {"strange": ParameterValue(type=77), "plain": ParameterValue(type=3, double_value=0.5)}
    answers = {
        ListParameters: ListParameters.Response(result=ListParametersResult(names=["strange", "plain", "plain"])),
        GetParameters: GetParameters.Response(values=[known["plain"], known["strange"]]),
        DescribeParameters: DescribeParameters.Response(descriptors=[ParameterDescriptor(), ParameterDescriptor()]),
    }

    class Node:
        def call(self, service, kind, **_):
            return answers[kind]

    monkeypatch.setattr(inspector, "session", Node)
    form = inspector.form("parameter", "/node", "")
    assert [(field["name"], field["default"], field["fixed"]) for field in form] == [
        ("plain", "0.5", False),
        ("strange", "None", True),
    ]


def test_names_and_values_without_end_leave_room_for_the_other_parameters(monkeypatch):
    """In the robot view, in the Inspector's form and among a node's details."""
    long, short = [f"{number:03}{60_000 * 'é'}" for number in range(120)], [f"z{number:03}" for number in range(120)]
    value = ParameterValue(type=4, string_value=90_000 * "é")
    numbers = {name: ParameterValue(type=3, double_value=1.0) for name in (*long, *short[:50], "last")}
    known = numbers | dict.fromkeys(short[50:], value)

    class Node:
        def call(self, service, kind, *, timeout, names=()):
            return self.answer(kind, names)

        def answer(self, kind, names):
            if kind is ListParameters:
                return ListParameters.Response(result=ListParametersResult(names=[*known]))
            if kind is GetParameters:
                return GetParameters.Response(values=[known[name] for name in names])
            about = [ParameterDescriptor(name=name, description=90_000 * "é") for name in names]
            return DescribeParameters.Response(descriptors=about)

    node = Node()
    monkeypatch.setattr(inspector, "session", lambda: node)
    monkeypatch.setattr(knobs, "_ask", lambda listener, name, kind, names=(): node.answer(kind, names))
    monkeypatch.setattr(nodes, "answer", lambda client, request: node.answer(client, getattr(request, "names", ())))
    form = inspector.form("parameter", "/node", "")
    assert len(protocol.encoded(all_visible(form))) <= inspector.FORM + 1000
    assert {field["name"] for field in form} > {"last", *short[:20]}
    shown = knobs._read(None, "/node")
    assert len(protocol.encoded(shown)) < log.EVENT
    assert {*shown} == {"last", *short[:50]}
    details = nodes.Details("/node")
    details._clients = [ListParameters, GetParameters]
    told = details._parameters()["parameters"]
    assert len(protocol.encoded(told)) < log.EVENT
    assert len(told) == len(known)


def test_a_line_without_end_is_cut_where_it_comes_from(tmp_path):
    (tmp_path / "endless.py").write_text(
        "print('first')\nprint(30_000_000 * 'x')\nprint(10_000 * 'y')\nprint('last', end='')"
    )
    program = NodeProcess(tmp_path / "endless.py", [])
    assert wait_until(lambda: program.ended, 20)
    first, endless, whole, last = program.output.splitlines()
    assert (first, whole, last) == ("first", 10_000 * "y", "last")
    assert endless == f"{logs.LONGEST * 'x'}…"


def test_a_large_message_of_an_exchange_is_kept_as_it_is_shown():
    exchange = Exchange("topic", "/t", "rcl_interfaces/msg/Log")
    for _ in range(300):
        exchange.add("message", Log(msg=(LARGEST + 1) * "x"))
    assert sum(len(row[2]._bytes) for row in (*exchange._first, *exchange._last)) == 0
    assert exchange.state()["events"][0][2].splitlines()[-1]


def test_walls_and_places_that_are_no_numbers_are_left_out():
    listener = object.__new__(RobotListener)
    marker = Marker(text="room")
    for x in (0.0, 1.0, float("nan"), 2.0, float("inf"), 3.0, 4.0, 5.0):
        marker.points.append(type(marker.pose.position)(x=x, y=1.0))
    listener._fast = None
    listener._last, listener.fast_world = {"/walls": serialize_message(marker)}, lambda: None
    assert listener.walls()[1:] == ("room", [0.0, 1.0, 1.0, 1.0, 4.0, 1.0, 5.0, 1.0])
    listener._hits = deque()
    for text in ("at x=1.2.3 m, y=1 m", f"x={400 * '9'} m, y=1 m", "x=9999999 m, y=1 m", "x=1.5 m, y=-2 m"):
        listener.count, hear = {"/collision": 0}, listener._hear("/collision")
        hear(serialize_message(String(data=text)), {"source_timestamp": 1})
    assert listener.collisions()["places"] == [[1.5, -2.0]]
    assert TOLD < 10_000
