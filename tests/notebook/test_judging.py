"""The beginnings of public checks: a program that is asked, refused files, and names that others use."""

import contextlib
import json
import linecache
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
from IPython.core.error import UsageError
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from std_srvs.srv import Trigger

from course.errors import ExerciseError, InterfaceError, LiveError, NodeFailed
from course.foundation.waiting import wait_until
from course.notebook import exercise_magic, judging
from course.notebook.exercise_magic import exercise
from course.notebook.exercise_names import left_behind, not_wanted
from course.session import live

ASK = "import agent; print(agent.answer())"
STOPS = """
import os, signal, subprocess, sys
wait = f"import os, signal, time; time.sleep(1.5); os.kill({os.getpid()}, signal.SIGCONT)"
subprocess.Popen([sys.executable, "-S", "-c", wait], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
os.kill(os.getpid(), signal.SIGSTOP)
"""
SERVER = """
import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("asked")
node.create_service(Trigger, "/asked", lambda request, response: response)
rclpy.spin(node)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def session(folder):
    yield live.live()
    live.live().close()


def test_what_a_program_prints_is_returned(folder):
    (folder / "agent.py").write_text("def answer():\n    return 42\n")
    assert judging.run(ASK, file="agent.py") == "42\n"


def test_a_program_that_fails_tells_its_own_line(folder):
    (folder / "agent.py").write_text("def answer():\n    return {}['front']\n")
    with pytest.raises(NodeFailed, match=r"KeyError: 'front'\n  agent\.py, line 2, in answer\n    return"):
        judging.run(ASK, file="agent.py")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("def answer():\n    while True:\n        pass\n", r"  agent\.py, line [23], in answer\n"),
        ("while True:\n    pass\n", r"  agent\.py, line [12], in <module>\n"),
        ("import time\ndef answer():\n    time.sleep(60)\n", r"  agent\.py, line 3, in answer\n    time\.sleep\(60\)"),
    ],
)
def test_a_program_that_does_not_end_tells_where_it_is(folder, text, says):
    (folder / "agent.py").write_text(text)
    with pytest.raises(NodeFailed, match=f"agent.py had not answered after \\d s. It was here:\n{says}"):
        judging.run(ASK, file="agent.py", limit=0.5)


def test_a_program_that_does_not_end_tells_what_it_was_asked(folder):
    (folder / "agent.py").write_text("def answer(number):\n    while number == 2:\n        pass\n")
    asks = "import agent\nfor number in (1, 2):\n    print('asking', number, flush=True)\n    agent.answer(number)\n"
    with pytest.raises(
        NodeFailed, match=r"agent.py had not answered 2 after \d s. It was here:\n  agent.py, line [23], "
    ):
        judging.run(asks, file="agent.py", limit=0.5)


def test_a_loop_that_cannot_end_is_not_given_all_the_time_of_a_program(folder):
    (folder / "agent.py").write_text(
        "def answer(front=0.4):\n    while front < 0.5:\n        turn = 0.5\n    return turn\n"
    )
    with pytest.raises(
        NodeFailed, match=r"agent\.py had not answered after \d s\. It was here:\n  agent\.py, line [23], "
    ):
        judging.run(ASK, file="agent.py", limit=60.0)


def test_a_program_that_lacks_a_processor_or_is_stopped_is_given_its_time(folder, monkeypatch):
    (folder / "agent.py").write_text(f"import time\n{STOPS}\ndef answer():\n    time.sleep(0.1)\n    return 42\n")
    assert judging.run(ASK, file="agent.py", limit=0.8) == "42\n"
    monkeypatch.setattr(judging, "MOST", 0.3)
    with pytest.raises(NodeFailed, match=r"agent\.py had not answered after \d s\."):
        judging.run(ASK, file="agent.py", limit=0.8)


def test_a_file_whose_cell_was_refused_is_not_judged(folder):
    with pytest.raises(ExerciseError, match="line 1: "):
        exercise("agent.py --no-start", "first = = 1\n")
    with pytest.raises(ExerciseError, match="agent.py was not written, because the last run of its cell was refused"):
        judging.as_it_lies("agent.py")
    exercise("agent.py --no-start", "first = 1\n")
    judging.as_it_lies("agent.py")
    with pytest.raises(ExerciseError, match="line 1: "):
        exercise("agent.py --no-start", "second = = 2\n")
    with pytest.raises(ExerciseError, match="agent.py is unchanged, because the last run of its cell was refused"):
        judging.as_it_lies("agent.py")
    exercise("agent.py --no-start", "second = 2\n")
    judging.as_it_lies("agent.py")


def test_a_definition_that_was_never_built_or_is_broken_is_not_judged(folder):
    (folder / "Ask.srv").write_text("---\n")
    with pytest.raises(ExerciseError, match="Ask.srv was not built here: run its cell"):
        judging.as_it_lies("Ask.srv")
    exercise("Ask.srv --package asking_interfaces", "int32 a\n---\n")
    judging.as_it_lies("Ask.srv")
    (folder / "Ask.srv").write_text("int a\n---\n")
    with pytest.raises(InterfaceError, match="there is no type 'int'"):
        judging.as_it_lies("Ask.srv")


def test_nothing_is_judged_while_another_node_serves_its_names(folder, session):
    class Other(Node):
        def __init__(self):
            super().__init__("other")
            self.create_service(Trigger, "/asked", lambda request, response: response)

    (folder / "server.py").write_text(SERVER)
    session.start(Other)
    with pytest.raises(
        LiveError, match=r"server.py cannot be checked while other of this notebook also uses /asked.*ros.stop"
    ):
        judging.judge("server.py", names=("/asked",))
    session.stop("other")
    first = judging.judge("server.py", names=("/asked",))
    assert judging.judge("server.py", names=("/asked",)).alive and not first.alive


def test_nothing_is_judged_while_a_command_publishes_on_its_topics(folder, session):
    """The node of `ros2 topic pub` is hidden."""
    (folder / "server.py").write_text(SERVER)
    words = [Path(sys.executable).with_name("ros2"), "topic", "pub", "/told", "std_msgs/msg/Float64", "{data: 1.0}"]
    sending = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    try:
        assert session.until(lambda: session.node.count_publishers("/told") == 1, timeout=20.0)
        with pytest.raises(LiveError, match=rf"while a \w+, process {sending.pid} \(.*topic pub /told.*also uses"):
            judging.judge("server.py", names=("/asked", "/told"))
    finally:
        sending.kill()
        sending.wait()
    assert "/told" not in session.nodes()


class Asking(Node):
    """Has a client that is not of the check."""

    def __init__(self):
        super().__init__("asking")
        self.asks = self.create_client(Trigger, "/asked")


def test_who_else_calls_while_a_check_runs_is_named_and_who_only_could_is_not(folder, session):
    (folder / "server.py").write_text(SERVER)
    asking = session.start(Asking).node
    asking.asks.call_async(Trigger.Request())  # before the check
    session.begin_check("class Held(Node): ...")
    judging.judge("server.py", names=("/asked",))
    session.call("/asked", Trigger)  # as the check itself does
    assert str(session.meanwhile) == ""
    for times in ("once", "2 times"):
        asking.asks.call_async(Trigger.Request())
        told = f"asking of this notebook has called /asked {times} meanwhile, which may be why. To end it: ros.stop("
        assert str(session.meanwhile).startswith(told)
    asking.create_client(ListParameters, "/asked/list_parameters").call_async(ListParameters.Request())
    assert session.until(lambda: "has called /asked/list_parameters once" in str(session.meanwhile))
    session.end_check(passed=False)
    assert not session.meanwhile.goes_on and "asking" in str(session.meanwhile)
    session.begin_check("")
    assert str(session.meanwhile) == ""
    session.end_check(passed=True)


def test_a_file_that_could_call_while_a_check_runs_and_a_timer_of_a_cell_are_named(folder, session):
    (folder / "server.py").write_text(SERVER)
    (folder / "asker.py").write_text(
        "import rclpy\nfrom std_srvs.srv import Trigger\nrclpy.init()\nnode = rclpy.create_node('asker')\n"
        "asks = node.create_client(Trigger, '/asked')\nrclpy.spin(node)\n"
    )
    session.start("asker.py")
    look = session.node.get_publishers_info_by_topic
    assert session.until(lambda: look("rq/askedRequest", no_mangle=True), timeout=20.0)
    names: dict = {}
    exec(compile("def tick(): ...", "<ipython-input-1>", "exec"), names)
    timers = [session.node.create_timer(60.0, each) for each in (names["tick"], lambda: None)]
    session.begin_check("")
    judging.judge("server.py", names=("/asked",))
    assert str(session.meanwhile) == (
        "A timer of `ros.node` calls `tick` meanwhile, which may be why. To end all of them: "
        "`for timer in ros.node.timers: timer.cancel()`. asker.py of this notebook has a client of /asked: it may have "
        "called it meanwhile. To end it: ros.stop('asker.py')."
    )
    timers[0].cancel()
    session.stop("asker.py")
    assert session.until(lambda: str(session.meanwhile) == "")
    session.end_check(passed=True)
    for timer in timers:
        session.node.destroy_timer(timer)


def test_a_command_that_could_call_while_a_check_runs_is_named(folder, session):
    (folder / "server.py").write_text(SERVER)
    words = ["service", "call", "-r", "5", "/asked", "std_srvs/srv/Trigger"]
    asking = subprocess.Popen([Path(sys.executable).with_name("ros2"), *words], stdout=subprocess.DEVNULL)
    try:
        look = session.node.get_publishers_info_by_topic
        assert session.until(lambda: look("rq/askedRequest", no_mangle=True), timeout=20.0)
        session.begin_check("")
        judging.judge("server.py", names=("/asked",))
        others = str(session.meanwhile)
        assert f"process {asking.pid} (" in others and "has a client of /asked: it may have called it" in others
    finally:
        asking.kill()
        asking.wait()
    session.end_check(passed=True)


def test_the_node_of_a_service_may_be_known_later_than_the_service(folder, session, monkeypatch):
    (folder / "server.py").write_text(SERVER)
    process = judging.judge("server.py", names=("/asked",))
    session.wait_for_service("/asked", Trigger)
    known, looks = judging.Presence.services, []

    def late(*asked):
        looks.append(asked)
        return known(*asked) if len(looks) > 4 else set()

    monkeypatch.setattr(judging.Presence, "services", late)
    assert judging.node_of("/asked", process) == "/asked" and not looks, "a program of one node leaves no question"
    monkeypatch.setattr(judging, "makes_one_node", lambda source: False)  # the second may not be known yet
    assert judging.node_of("/asked", process) == "/asked" and len(looks) > 4


def test_of_a_program_that_makes_two_nodes_the_first_that_is_known_may_not_be_the_one(folder, session):
    (folder / "server.py").write_text(SERVER.replace("node =", "first = rclpy.create_node('first')\nnode ="))
    process = judging.judge("server.py", names=("/asked",))
    session.wait_for_service("/asked", Trigger)
    process.nodes[:] = ["/first"]
    assert judging.node_of("/asked", process) == "/asked"


def test_a_full_disk_leaves_the_file_as_it_was(folder, monkeypatch):
    exercise("agent.py --no-start", "first = 1\n")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(exercise_magic.storage, "replace", full)
    with pytest.raises(ExerciseError, match="could not be written: no space left on device"):
        exercise("agent.py --no-start", "second = 2\n")
    assert (folder / "agent.py").read_text() == "first = 1\n"


def test_another_kernel_in_the_folder_is_told(folder, monkeypatch, capsys):
    exercise("agent.py --no-start", "first = 1\n")
    (folder / "agent.py").write_text("of another = 1\n")
    other = exercise_magic.registry.SessionRecord(1, 5, str(folder), 0.0, 0)
    monkeypatch.setattr(exercise_magic.registry, "running", lambda: [other])
    exercise("agent.py --no-start", "second = 2\n")
    assert "another kernel (process 1) also works in this folder" in capsys.readouterr().err
    exercise("agent.py --no-start", "third = 3\n")
    assert capsys.readouterr().err == ""


def test_a_callback_that_sleeps_is_named_with_its_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "node.py").write_text(
        "self.create_subscription(Float64, 'error', self.answer, 10)\n"
        "def other(self):\n    time.sleep(1)\n"
        "def answer(self, msg):\n    time.sleep(2)\n"
    )
    where = "\n  node.py, line 5\n    time.sleep(2)"
    why = "\nA sleep blocks the only thread that runs callbacks: leave it out."
    assert judging.sleeps("node.py", "create_subscription") == where + why
    assert judging.sleeps("node.py", "create_timer") == ""
    with (tmp_path / "node.py").open("a") as file:
        file.write("executor = MultiThreadedExecutor()\n")
    assert judging.sleeps("node.py", "create_subscription") == where


@pytest.mark.parametrize(
    ("caught", "is_named"),
    [("", True), (" Exception as error", True), (" KeyError", False), (" (OSError, KeyError)", False)],
)
def test_an_except_that_catches_all_is_named_with_its_line(tmp_path, monkeypatch, caught, is_named):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "client.py").write_text(f"try:\n    ask()\nexcept{caught}:\n    pass\n")
    found = judging.hidden("client.py")
    assert found.startswith("\n  client.py, line 3\n    except") if is_named else found == ""


@pytest.mark.parametrize(
    ("begins", "told"), [("on = request.data\n", True), ("global on\n    on = request.data\n", False), ("", False)]
)
def test_a_callback_that_sets_a_variable_of_its_own_for_one_of_the_file_is_named(folder, begins, told):
    (folder / "server.py").write_text(
        "on = False\nnode.create_service(SetBool, 'power', power)\n"
        f"def power(request, response):\n    {begins}    response.message = str(on)\n    return response\n"
        "def status(request, response):\n    response.message = str(on)\n    return response\n"
    )
    at = "\n  server.py, line 4\n    on = request.data\nThis sets a variable of 'power' alone, not that of line 1."
    assert judging.own_variable("server.py").startswith(at) if told else judging.own_variable("server.py") == ""


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("on = request.data", "'power'. `self.on` is another one: to set that, write it with `self.`."),
        ("on = request.data; self.on = on", ""),
        ("level = request.data", ""),
        ("global on; on = request.data", ""),
        ("self.on = request.data", ""),
    ],
)
def test_a_callback_that_leaves_out_self_is_named_only_if_nothing_reads_its_variable(folder, line, told):
    (folder / "server.py").write_text(
        "class Server(Node):\n"
        "    def __init__(self):\n"
        "        self.on = False\n"
        "        self.create_service(SetBool, 'power', self.power)\n"
        "    def power(self, request, response):\n"
        f"        {line}\n"
        "        response.success = self.on\n"
        "        return response\n"
    )
    said = judging.own_variable("server.py")
    assert said.endswith(told) and bool(said) == bool(told) == ("line 6" in said)


@pytest.mark.parametrize(
    ("returned", "shared"),
    [("self.answer", True), ("response", False), ("copy(self.answer)", False), ("self.answer.copy", False),
     ("self.fill(response)", False)],
)  # fmt: skip
def test_a_response_of_all_callers_is_one_that_the_callback_returns_as_it_is(folder, returned, shared):
    (folder / "server.py").write_text(
        "class Server(Node):\n"
        "    def __init__(self):\n        self.create_service(Trigger, 'ask', self.ask)\n\n"
        f"    def ask(self, request, response):\n        return {returned}\n\n"
        "    def state(self):\n        return self.answer\n"
    )
    assert ("line 6" in judging.shared_response("server.py")) == shared


def test_a_program_beside_the_session_shows_what_it_has_printed_so_far(folder):
    (folder / "client.py").write_text("import sys, time\nprint(sys.argv[1:])\ntime.sleep(60)\n")
    client = judging.beside("client.py", "5", "6")
    try:
        assert wait_until(lambda: client.output == "['5', '6']", 10.0) and not client.ended
    finally:
        client.stop()
    assert client.ended


@pytest.mark.parametrize(("first", "raises"), [("", True), ("print('feedback', flush=True)", False)])
def test_a_program_beside_the_session_that_an_exception_ends_at_once_is_told_with_it(folder, first, raises):
    (folder / "client.py").write_text(f"{first}\nassert 1 >= '2'\n")
    client = judging.beside("client.py")
    assert wait_until(lambda: client.ended, 10.0)
    with (
        pytest.raises(NodeFailed, match=r"client.py ended with exit status 1: TypeError(.|\n)*line 2")
        if raises
        else (contextlib.nullcontext())
    ):
        client.stop()


TIMED = """rclpy.spin({spun})
self.rate = self.create_rate(10)
self.create_timer(0.1, self.tick)
def tick(self):
    {line}
"""


@pytest.mark.parametrize(
    ("told", "spun", "line", "says"),
    [
        (judging.rate_in_a_timer, "node", "self.rate.sleep()", "line 5\n    self.rate.sleep()\nA rate needs a thread"),
        (judging.rate_in_a_timer, "MultiThreadedExecutor()", "self.rate.sleep()", ""),
        (judging.rate_in_a_timer, "node", "time.sleep(0.1)", ""),
        (judging.more_timers, "node", "self.create_timer(1.0, self.tick)", "'tick' makes one more timer each time"),
        (judging.more_timers, "node", "self.timer.reset()", ""),
        (
            judging.more_timers,
            "node",
            "while True: self.pub.publish(cmd)",
            "This loop publishes without a pause. A timer",
        ),
        (judging.more_timers, "node", "while True: self.pub.publish(cmd); time.sleep(0.1)", ""),
        (judging.more_timers, "node", "while self.waits: self.pub.publish(cmd)", ""),
        (judging.one_thread, "node", "pass", "line 1\n    rclpy.spin(node)\nThis spins the node with one thread"),
        (judging.one_thread, "node, executor", "pass", ""),
        (judging.one_thread, "node", "ActionServer(self, Lift, 'lift', self.run)\nasync def run(self): pass", ""),
        (lambda file: judging.slow_timer(file, 0.05), "node", "pass", "    self.create_timer(0.1, self.tick)\n"),
        (lambda file: judging.slow_timer(file, 0.05), "node", "self.create_timer(0.02, self.tick)", ""),
        (lambda file: judging.slow_timer(file, 0.05), "node", "self.create_timer(period, self.tick)", ""),
        (lambda file: judging.slow_timer(file, 0.05), "node", "self.create_timer(1 / 100, self.tick)", ""),
        (lambda file: judging.slow_timer(file, 0.05), "node", "self.create_timer(0 / 0, self.tick)", ""),
        (lambda file: judging.slow_timer(file, 0.05), "node", "self.create_timer(0x" + "f" * 4000 + ", f)", ""),
        (
            lambda file: judging.slow_timer(file, 0.05),
            "node",
            "self.create_timer(1.0 / 0.1, f)",
            "self.create_timer(0.1",
        ),
    ],
)
def test_why_callbacks_come_too_often_or_not_at_all(tmp_path, monkeypatch, told, spun, line, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "node.py").write_text(TIMED.format(spun=spun, line=line))
    assert says in told("node.py") and bool(told("node.py")) == bool(says)


TRIGGER = "from std_srvs.srv import Trigger\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (f"{TRIGGER}self.create_client(Trigger, '/asked')", (2, "std_srvs/srv/Trigger")),
        (f"{TRIGGER}self.create_client(srv_name='asked', srv_type=Trigger)", (2, "std_srvs/srv/Trigger")),
        ("from std_srvs.srv import SetBool as T\nself.create_client(T, 'asked')", (2, "std_srvs/srv/SetBool")),
        (f"{TRIGGER}self.create_client(Trigger, name)", (0, "")),
        (f"{TRIGGER}self.create_client(Trigger, '/other')", (0, "")),
        (f"{TRIGGER}self.create_client(kind, '/asked')", (0, "")),
        (
            f"{TRIGGER}for _ in 1, 2: self.create_client(Trigger, 'asked'), self.create_client(SetBool, 'asked')",
            (0, ""),
        ),
        (f"{TRIGGER}from mine.srv import Trigger\nself.create_client(Trigger, 'asked')", (0, "")),
        ("from std_srvs.srv._trigger import Trigger\nself.create_client(Trigger, 'asked')", (0, "")),
        ("from mine import Trigger\nself.create_client(Trigger, 'asked')", (0, "")),
    ],
)
def test_the_type_of_a_client_by_its_text(text, found):
    assert judging.written_type(text, "/asked") == found


def test_a_program_that_does_nothing_by_its_text_is_not_started(folder):
    (folder / "server.py").write_text("executor = SingleThreadedExecutor()\nexecutor.spin()\n")
    with pytest.raises(ExerciseError, match="server.py, line 2: `executor.spin"):
        judging.judge("server.py")


def test_a_byte_order_mark_is_not_part_of_a_file(folder):
    exercise("agent.py --no-start", "\ufeffpass\r\n")
    assert (folder / "agent.py").read_bytes() == b"pass\r\n"


CHECK = {
    "cell_type": "code",
    "source": "judge('relay.py')\nas_it_lies('Ask.srv')",
    "outputs": [],
    "execution_count": None,
}
CHECK |= {"id": "check", "metadata": {"nbgrader": {"grade": True, "grade_id": "relay", "locked": True, "points": 0}}}


@pytest.fixture
def page(folder):
    """A notebook whose only check uses relay.py and Ask.srv."""
    text = json.dumps({"cells": [CHECK], "metadata": {}, "nbformat": 4, "nbformat_minor": 5})
    (folder / "services.ipynb").write_text(text)


@pytest.mark.usefixtures("page")
def test_a_file_that_no_check_uses_is_told_with_the_name_that_is_meant(folder, capsys):
    exercise("relays.py --no-start", "pass\n")
    meant = "If it should be relay.py, begin the cell with `%%exercise relay.py`."
    assert f"relays.py is not a file that the checks of this exercise use (Ask.srv, relay.py). {meant}" in (
        capsys.readouterr().err
    )
    exercise("relay.py --no-start", "pass\n")
    assert capsys.readouterr().err == ""
    assert not_wanted("ask.srv", " --package mine").endswith("begin the cell with `%%exercise Ask.srv --package mine`.")
    with pytest.raises(UsageError, match=r"The checks of this exercise use Ask\.srv, relay\.py"):
        exercise("relay2", "pass\n")


@pytest.mark.usefixtures("page")
def test_a_module_that_is_not_handed_in_is_told_with_its_line(folder):
    (folder / "motor_state.py").touch()
    (folder / "relay.py").write_text("import os, json\nfrom motor_state import State\nimport rclpy, relay, missing\n")
    assert [*left_behind("relay.py")] == [(2, "motor_state")]
    (folder / "services.ipynb").unlink()  # as in the folder of a hand-in's checks: what is handed in is not known
    assert [*left_behind("relay.py")] == []


@pytest.mark.usefixtures("page")
def test_a_missing_file_is_told_with_the_one_that_may_be_meant(folder):
    (folder / "relay_2.py").touch()
    with pytest.raises(ExerciseError, match=r"There is relay_2\.py: if that is meant, .* `%%exercise relay\.py`"):
        judging.as_it_lies("relay.py")
    (folder / "services.ipynb").unlink()  # as in the folder of a hand-in's checks: it may be another task's file
    with pytest.raises(ExerciseError) as failed:
        judging.as_it_lies("relay.py")
    assert "relay_2.py" not in str(failed.value)


def test_a_file_that_is_missing_because_the_kernel_is_elsewhere(folder, session, monkeypatch):
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    with pytest.raises(ExerciseError, match=r"relay\.py is not in the kernel's folder: os\.chdir moved this kernel to"):
        judging.as_it_lies("relay.py")
    with pytest.raises(LiveError, match=r"there is no file relay\.py: os\.chdir moved this kernel to"):
        session.start("relay.py")


def test_a_client_that_asks_for_another_name_is_told_before_it_runs(folder):
    (folder / "client.py").write_text("import rclpy\n\nclient = node.create_client(Ask, '/asks')\n")
    told = r"  client\.py, line 3\n    client = .*\nThe name must be /ask, but here it is /asks\."
    with pytest.raises(ExerciseError, match=told):
        judging.meant("client.py", "create_client", "/ask")
    judging.meant("client.py", "create_client", "/asks")


class Silent:
    """A session that waits for the whole of each limit."""

    def __init__(self):
        self.waited = 0.0

    def until(self, condition, timeout):
        self.waited += timeout
        return condition()


@pytest.mark.parametrize(
    ("body", "waited"),
    [("client.call(request)", judging.BLOCKED), ("pass", 5.0), ("time.sleep(1)", 5.0),
     ("client.call(request); spare = SingleThreadedExecutor()", 5.0)],
)  # fmt: skip
def test_a_callback_that_never_answers_by_its_text_is_not_waited_for(monkeypatch, body, waited):
    silent = Silent()
    monkeypatch.setattr(judging, "wait_until", silent.until)
    monkeypatch.setattr(judging, "NodeProcess", SimpleNamespace)
    text = f"def ask(request, response):\n    {body}\n\nnode.create_service(Ask, '/ask', ask)\n"
    assert not judging.within(5.0, lambda: False, SimpleNamespace(source=text), "/ask")
    assert silent.waited == waited


HOLDS = """
class Holds(Node):
    def __init__(self):
        super().__init__("holds")
        self.begun, self.let_go = threading.Event(), threading.Event()
        self.create_service(Trigger, "/holds", self.answer)

    def answer(self, request, response):
        self.begun.set()
        self.let_go.wait(20.0)
        return response
"""


def test_a_server_of_a_check_that_holds_its_answers_back_is_not_told_of(session, monkeypatch):
    cell = "/tmp/ipykernel_1/1.py"
    monkeypatch.setitem(linecache.cache, cell, (len(HOLDS), None, HOLDS.splitlines(keepends=True), cell))
    given = {"Node": Node, "Trigger": Trigger, "threading": threading, "__name__": "__main__"}
    exec(compile(HOLDS, cell, "exec"), given)
    node = session.start(given["Holds"]).node
    session.node.create_client(Trigger, "/holds").call_async(Trigger.Request())
    assert node.begun.wait(10.0)
    assert not judging.within(judging.BLOCKED + 4.0, lambda: False, SimpleNamespace(source=""), "/relay")
    assert not session.watch.notices()
    node.let_go.set()
