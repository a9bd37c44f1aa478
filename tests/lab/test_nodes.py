"""The panel of nodes, from the kernel's side: states, what a node offers, its log in a flood, restart and stop."""

import re
import time

import pytest
from rcl_interfaces.msg import Log
from rclpy.serialization import serialize_message

from course.foundation.waiting import wait_until
from course.ros.discovery import mark
from course.ros.names import base
from course.session.following import LogFollower
from course.session.logs import Entry, Logged, entry_of, node_of
from course.session.node_process import NodeProcess
from tests.browser.pages import SERVER, TWIN
from tests.kernels import Kernel
from tests.lab.client import WAIT, Client

FLOOD = """import rclpy
from rclpy.node import Node

rclpy.init()
node = Node('flood')


def burst():
    for number in range(LINES):
        print(f'line {number} of the flood')
    node.get_logger().warning('one of a kind')


timer = node.create_timer(PERIOD, burst)
rclpy.spin(node)
"""


EARLY = (1 << 22) + 7  # more than any process id


CHILD = """import time
import rclpy
from rclpy.node import Node

rclpy.init()
node = Node('child')
node.create_timer(0.05, lambda: node.get_logger().info(f'line {time.time_ns()}'))
rclpy.spin(node)
"""
PARENT = """import subprocess
import sys
import rclpy
from rclpy.node import Node

rclpy.init()
child = subprocess.Popen([sys.executable, 'child.py'])
rclpy.spin(Node('parent'))
"""


@pytest.fixture(autouse=True)
def nothing_runs(kernel):
    kernel.run("ros.stop()")


def start(kernel: Kernel, name: str, text: str) -> None:
    (kernel.folder / name).write_text(text)
    kernel.run(f"ros.start('{name}')")


def nodes_until(page: Client, name: str, state: str) -> dict:
    """Return what is said of a node when it has come into a state."""
    while True:
        for node in page.event()["data"]["nodes"]:
            if (node["name"], node["state"]) == (name, state):
                return node


def lines_until(page: Client, text: str) -> tuple[list, int]:
    """The log's lines up to an event with `text` in it, and how many were lost."""
    found, lost = [], 0
    while not any(text in line[2] for line in found):
        data = page.event()["data"]
        found, lost = found + data["lines"], lost + data["lost"]
    return found, lost


def test_a_file_is_seen_to_run_is_stopped_and_started_again(kernel, page):
    page.subscribe("nodes")
    start(kernel, "greeter.py", SERVER)
    while not (node := nodes_until(page, "/greeter", "running"))["key"]:
        pass  # the graph may have it a moment before the session knows whose it is
    assert node["key"] == "greeter.py"
    assert re.fullmatch(r"greeter.py, process \d+", node["where"])
    assert page.ask("nodes.stop", name="greeter.py")["result"] is None
    stopped = nodes_until(page, "/greeter", "stopped")
    assert stopped["key"] == "greeter.py"
    assert stopped["since"] < stopped["over"] < time.time()
    assert kernel.run("print(ros.nodes())") == "[]"
    assert page.ask("nodes.restart", name="greeter.py")["result"] is None
    assert nodes_until(page, "/greeter", "running")["where"] != node["where"]
    assert kernel.run("print(ros.nodes())") == "['/greeter']"


def test_a_node_that_is_started_again_keeps_its_row(kernel, page):
    page.subscribe("nodes")
    start(kernel, "greeter.py", SERVER)
    while not nodes_until(page, "/greeter", "running")["key"]:
        pass
    assert page.ask("nodes.restart", name="greeter.py")["result"] is None
    assert all([node["name"] for node in event["data"]["nodes"]] == ["/greeter"] for event in page.events)


def test_a_program_started_elsewhere_is_stopped(kernel, page):
    (kernel.folder / "elsewhere.py").write_text(SERVER.replace("'greeter'", "'stranger'"))
    page.subscribe("nodes")
    kernel.run(
        "import subprocess, sys\nelsewhere = subprocess.Popen([sys.executable, 'elsewhere.py'], start_new_session=True)"
    )
    node = nodes_until(page, "/stranger", "running")
    while not node["process"]:
        node = nodes_until(page, "/stranger", "running")
    assert node["key"] == ""
    process, born = node["process"]
    assert "must not be stopped" in page.ask("nodes.end", process=process, born=born + 1)["error"]
    assert page.ask("nodes.end", process=process, born=born)["result"] is None
    assert kernel.run("print(elsewhere.wait(10) is not None)") == "True"


def test_a_node_of_a_cell_is_started_again_as_it_was(kernel, page):
    page.subscribe("nodes")
    kernel.run(
        "from rclpy.node import Node\n"
        "class Keeper(Node):\n"
        "    def __init__(self, word):\n"
        "        super().__init__('keeper')\n"
        "        self.declare_parameter('word', word)\n"
        "first = ros.start(Keeper, 'as given', parameters={'word': 'overridden'})"
    )
    nodes_until(page, "/keeper", "running")
    assert page.ask("nodes.restart", name="keeper")["result"] is None
    assert kernel.run("print(first.alive, ros.nodes())") == "False ['/keeper']"
    details = page.subscribe("nodes.node", name="/keeper")
    while (event := page.event())["id"] != details or event["data"]["silent"]:
        pass
    assert ["word", "'overridden'"] in event["data"]["parameters"]


def test_a_dead_program_tells_how_and_the_next_cell_still_says_so(kernel, page):
    page.subscribe("nodes")
    look = "self.create_timer(0.05, lambda: 1 / (not os.path.exists('die')))"
    begin = "self.create_service"
    start(kernel, "dying.py", "import os\n" + SERVER.replace(begin, f"{look}\n        {begin}"))
    nodes_until(page, "/greeter", "running")
    (kernel.folder / "die").touch()
    node = nodes_until(page, "/greeter", "dead")
    assert "ZeroDivisionError" in node["line"]
    assert "dying.py, line" in node["stories"][-1]
    assert "ZeroDivisionError" in kernel.run("pass")
    (kernel.folder / "dying.py").write_text("syntax error")
    assert "ended with exit status 1: SyntaxError" in page.ask("nodes.restart", name="dying.py")["error"]


def test_a_death_has_the_time_at_which_it_died_whoever_looks_later(kernel, page):
    began = time.time()
    (kernel.folder / "brief.py").write_text("import time\nprint('here')\ntime.sleep(0.3)\nraise SystemExit(4)\n")
    kernel.run("try:\n    ros.start('brief.py')\nexcept Exception:\n    pass")
    seen = page.subscribe("nodes")
    node = nodes_until(page, "brief.py", "dead")
    died = node["over"]
    assert began < node["since"] < died < time.time()
    page.ask("unsubscribe", id=seen)
    for _ in range(2):  # as after a reload
        page.subscribe("log", nodes=["brief.py"])
        lines, _ = lines_until(page, "exit status 4")
        stamps = {line[0]: float(line[3]) for line in lines}
        assert stamps["PRINT"] < stamps["ENDED"] == pytest.approx(died, abs=1e-3)
    assert re.search(
        r"brief.py +ended with exit status 4: .* [\d:]{8} to [\d:]{8}", kernel.run("print(repr(ros.nodes()))")
    )


def test_what_is_not_there_is_told_in_a_sentence(page):
    assert "no node or file called unknown" in page.ask("nodes.restart", name="unknown")["error"]
    assert page.ask("nodes.stop", name="unknown")["result"] is None


def test_a_node_tells_what_it_offers_and_its_parameters_as_they_change(kernel, page):
    start(kernel, "greeter.py", SERVER)
    page.subscribe("nodes.node", name="/greeter")
    found = page.event()["data"]
    assert found["serves"] == [["/greet", "std_srvs/srv/Trigger"]]
    assert found["publishes"] == found["calls"] == found["offers the actions"] == []
    while ["word", "'hello'"] not in found["parameters"]:
        found = page.event()["data"]
    assert [name for name, _ in found["parameters"]] == ["word", "start_type_description_service", "use_sim_time"]
    kernel.run("!ros2 param set /greeter word goodbye")
    while ["word", "'goodbye'"] not in found["parameters"]:
        found = page.event()["data"]
    kernel.run("ros.stop()")
    while not found["silent"]:
        found = page.event()["data"]
    assert found["serves"] == []


def test_a_flood_is_shown_in_part_and_every_line_is_accounted_for(kernel, page):
    page.subscribe("log", nodes=["flood.py", "flood"])
    start(kernel, "flood.py", FLOOD.replace("LINES", "5000").replace("PERIOD", "1e9").replace(
        "rclpy.spin(node)", "burst()\nrclpy.spin(node)"))  # fmt: skip
    lines, lost = lines_until(page, "one of a kind")
    assert len(lines) + lost == 5001
    assert lost > 0
    assert lines[-1][:3] == ["WARN", "flood", "one of a kind"]


def test_a_line_that_comes_by_rosout_before_its_program_is_known_is_told_once():
    message = Logged(serialize_message(Log(level=30, name="early", msg="one of a kind")))
    message.process = mark(EARLY)

    class Book:
        def since(self, count):
            return 1, [message][count:]

    class Starting(NodeProcess):
        def __init__(self, pid):
            self.name, self.nodes, self.over, self.lines = "early.py", [], False, []
            self.number, self._children = pid, set()

        pid = property(lambda self: self.number)
        names = property(lambda self: {base(node) for node in self.nodes})
        alive = property(lambda self: not self.over)
        ended = property(lambda self: self.over)

        def printed_since(self, count):
            return len(self.lines), [(0, line) for line in self.lines[count:]]

    program, stranger = Starting(EARLY), Starting(EARLY + 1)
    follower = LogFollower(Book(), lambda: [program])
    assert follower.read(10) == ([], 0)
    program.nodes, program.lines = ["/early"], ["[WARN] [early]: one of a kind"]
    assert follower.read(10) == ([Entry("WARN", "early", "one of a kind")], 0)
    assert follower.read(10) == ([], 0)
    # What another process has logged is told, whatever starts meanwhile or has a node of that name.
    for nodes in ([], ["/early"]):
        stranger.nodes = nodes
        assert LogFollower(Book(), lambda: [stranger]).read(10) == ([Entry("WARN", "early", "one of a kind")], 0)
    # Where the middleware does not tell the process, the name decides.
    message.process = 0
    assert LogFollower(Book(), lambda: [stranger]).read(10) == ([], 0)


def test_two_nodes_of_one_name_each_have_their_lines(kernel, page):
    page.subscribe("nodes")
    start(kernel, "twin.py", TWIN)
    kernel.run(
        "import subprocess, sys\n"
        "outside = subprocess.Popen([sys.executable, 'twin.py', 'outside'], start_new_session=True)"
    )
    rows = []
    while len(rows) < 2 or not all(row["pid"] for row in rows):
        rows = [node for node in page.event()["data"]["nodes"] if node["name"] == "/twin"]
    inside, outside = sorted(rows, key=lambda row: row["key"], reverse=True)
    assert (inside["key"], outside["key"]) == ("twin.py", "")
    assert {row["at"] for row in rows} == {f"process {row['pid']}" for row in rows}
    page.subscribe("log", nodes=["twin"])
    told = {}
    while len(told) < 2:
        told |= {line[2]: line[4] for line in of_log(page)}
    assert told == {"inside": inside["pid"] & 0xFFFF, "outside": outside["pid"] & 0xFFFF}
    for row, said in ((inside, "inside"), (outside, "outside")):
        number = page.subscribe("log", nodes=["twin"], pid=row["pid"])
        lines = []
        while len(lines) < 5:
            lines += [line for line in of_log(page, number) if line[2].endswith("side")]
        assert {line[2] for line in lines} == {said}
    page.ask("nodes.stop", name="twin.py")  # what goes on outside is told as before
    before = time.time()
    number = page.subscribe("log", nodes=["twin"])
    while not any(float(line[3]) > before + 0.5 for line in of_log(page, number)):
        pass
    assert "outside" in kernel.run("print({entry.text for entry in ros.logs('twin')})")
    kernel.run("outside.terminate()\noutside.wait()")


def test_a_line_of_a_program_is_not_told_again_when_the_program_is_stopped(kernel, page):
    page.subscribe("log", nodes=["greeter", "greeter.py"])
    began = time.time()
    # Its end takes a moment, in which the log is read.
    start(kernel, "greeter.py", SERVER.replace("rclpy.spin(Greeter())", "try:\n        rclpy.spin(Greeter())\n"
          "    except KeyboardInterrupt:\n        __import__('time').sleep(1.5)\n        print('ends')"))  # fmt: skip
    kernel.run("from std_srvs.srv import Trigger\nros.call('/greet', Trigger)\nros.restart('greeter.py')")
    kernel.run("ros.stop()")
    lines = []
    while [line[2] for line in lines].count("ends") < 2:
        lines += [line for line in of_log(page) if float(line[3]) > began]
    assert [line[2] for line in lines].count("greeted") == 1


def test_what_a_program_starts_logs_on_its_terminal_and_is_told_once(kernel, page):
    (kernel.folder / "child.py").write_text(CHILD)
    page.subscribe("log", nodes=["child"])
    start(kernel, "parent.py", PARENT)
    lines = []
    while len(lines) < 20:
        lines += of_log(page)
    texts = [line[2] for line in lines if line[2].startswith("line ")]
    assert len(texts) == len(set(texts)) > 10


def of_log(page: Client, number: int | None = None) -> list:
    """The lines of the log's next event, that of a subscription if one is named."""
    while True:
        event = page.event()
        if "lines" in event["data"] and number in (None, event["id"]):
            return event["data"]["lines"]


def test_what_a_node_logged_before_it_was_started_again_stays_for_a_page_that_is_loaded_again(kernel, page):
    start(kernel, "greeter.py", SERVER)
    call = "from std_srvs.srv import Trigger\nros.call('/greet', Trigger)"
    kernel.run(f"{call}\nros.logs('greeter', until='greeted')\nros.restart('greeter.py')")
    kernel.run(f"{call}\nros.logs('greeter', until='greeted')")
    kernel.run(
        "from rclpy.node import Node\n"
        "class Again(Node): pass\n"
        "for number in range(2):\n"
        "    ros.start(Again, 'again').node.get_logger().info(f'run {number}')\n"
        "    ros.logs('again', until=f'run {number}')"
    )
    assert kernel.run("print(len(ros.logs('greeter')), [each.text for each in ros.logs('again')])") == "1 ['run 1']"
    page.subscribe("log", nodes=["greeter", "greeter.py", "again"])
    lines = of_log(page)
    stamps = [float(line[3]) for line in lines]
    assert [line[2] for line in lines if line[2] == "greeted" or "run" in line[2]][-4:] == [
        "greeted",
        "greeted",
        "run 0",
        "run 1",
    ]
    assert stamps == sorted(stamps)


def test_lines_that_no_choice_matches_are_counted_until_one_matches(kernel, page):
    kernel.run(
        "from rclpy.node import Node\nclass Said(Node): pass\nsaid = ros.start(Said, 'chosen').node\n"
        "said.get_logger().info('one')\nros.logs('chosen', until='one')"
    )
    page.subscribe("log", text="[nothing")
    before = page.event()["data"]
    assert before["lines"] == [] and before["hidden"] > 0
    kernel.run("said.get_logger().info('two')\nros.logs('chosen', until='two')")
    data = page.event()["data"]
    assert (data["lines"], data["hidden"]) == ([], before["hidden"] + 1)
    kernel.run("said.get_logger().info('a [nothing')\nros.logs('chosen', until='nothing')")
    assert [line[2] for line in page.event()["data"]["lines"]] == ["a [nothing"]


def test_what_was_logged_before_a_page_listens_is_older_and_did_not_come_too_fast(kernel, page):
    """A quiet node's lines are among the first, and what is left out is counted apart."""
    kernel.run(
        "from rclpy.node import Node\nclass Said(Node): pass\nsaid = ros.start(Said, 'said').node\n"
        "said.get_logger().warning('the first of them')\n"
        "for number in range(600):\n    said.get_logger().info(f'line {number}')\n"
        "ros.logs('said', until='line 599')"
    )
    page.subscribe("log", nodes=["said"])
    data = page.event()["data"]
    before = data["older"]  # of the other nodes and programs of this session
    assert (data["lines"][0][2], len(data["lines"]), data["lost"]) == ("the first of them", 601, 0)
    kernel.run(
        "for number in range(600):\n    said.get_logger().info(f'more {number}')\nros.logs('said', until='more 599')"
    )
    later = page.subscribe("log", nodes=["said"], level="INFO")
    data = next(event["data"] for event in iter(page.event, None) if event["id"] == later)
    assert (len(data["lines"]), data["lost"], data["older"] - before) == (1000, 0, 201)


def test_a_filter_finds_its_lines_in_a_flood_that_never_ends(kernel, page):
    began = time.time()
    flood = FLOOD.replace("one of a kind", "one of another")
    start(kernel, "flood.py", flood.replace("LINES", "1000").replace("PERIOD", "0.1"))  # 10,000 lines a second
    page.subscribe("log", level="WARN")
    for _ in range(3):
        lines, _ = lines_until(page, "one of another")
        told = {tuple(line[:3]) for line in lines if float(line[3]) > began}  # without those of other tests
        assert told == {("WARN", "flood", "one of another")}
    page.subscribe("log", text="LINE 999 of")
    assert page.ask("nodes.stop", name="flood.py")["result"] is None
    lines, _ = lines_until(page, "line 999 of")
    assert {line[2] for line in lines if line[0] == "PRINT"} == {"line 999 of the flood"}


def test_a_log_line_comes_once_and_with_its_time_from_a_program_and_from_a_node_of_the_kernel(kernel, page):
    page.subscribe("log")
    began = time.time()
    start(kernel, "greeter.py", SERVER)
    kernel.run("from std_srvs.srv import Trigger\nros.call('/greet', Trigger)")
    lines, _ = lines_until(page, "greeted")
    kernel.run(
        "from rclpy.node import Node\n"
        "class Talker(Node): pass\n"
        "ros.start(Talker, 'talker').node.get_logger().error('it spoke')"
    )
    more, _ = lines_until(page, "it spoke")
    logged = [line for line in lines + more if line[0] in ("INFO", "ERROR") and float(line[3]) > began]
    assert [line[:3] for line in logged] == [["INFO", "greeter", "greeted"], ["ERROR", "talker", "it spoke"]]
    stamps = [line[3] for line in logged]
    assert all(re.fullmatch(r"\d+\.\d{9}", stamp) for stamp in stamps)
    assert began < float(stamps[0]) < float(stamps[1]) < time.time()


@pytest.mark.parametrize("name", ["a", "four", "room.of.robots", "größe"])
def test_the_node_is_read_from_a_message_without_decoding_it(name):
    message = serialize_message(Log(level=30, name=name, msg="text"))
    assert node_of(message) == entry_of(message).node == name


def test_after_the_session_has_ended_the_panel_is_empty_until_there_is_a_new_one(kernel, page):
    start(kernel, "greeter.py", SERVER)
    page.subscribe("nodes")
    nodes_until(page, "/greeter", "running")
    kernel.run("ros.close()")
    while page.event()["data"] != {"domain": None, "nodes": []}:
        pass
    assert "ros = course.live()" in page.ask("nodes.stop", name="greeter.py")["error"]
    kernel.run("ros = course.live()\nros.start('greeter.py')")
    nodes_until(page, "/greeter", "running")
    assert wait_until(lambda: "greeter" in kernel.run("print(ros.nodes())"), WAIT)
