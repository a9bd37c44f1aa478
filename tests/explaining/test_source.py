"""Causes that the text of a program shows, and how a session tells them."""

import contextlib
import linecache
import threading
from collections.abc import Iterator

import pytest
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future

from course.errors import CallTimeout
from course.explaining.doubts import doubts
from course.explaining.failure_report import of_program
from course.explaining.source import (
    blocked,
    empty_executor,
    idle,
    never_begins,
    second_check,
    swapped_callbacks,
    wrong_cancel,
    wrong_guard,
    wrong_result,
)
from course.session.guards import for_a_file
from course.session.live import Session

NODE = """import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node


class Careful(Node):
    def __init__(self):
        super().__init__('careful')
        self.declare_parameter('speed', 1.0)
        self.add_on_set_parameters_callback(self.check)

    def check(self, params):
        {body}


rclpy.init()
rclpy.spin(Careful())
"""
RESULT = "return SetParametersResult(successful=True)"
SERVER = """
class Lift(Node):
    def __init__(self):
        self.server = ActionServer(self, Kind, '/lift', self.execute, handle_accepted_callback=self.take)

    def take(self, goal_handle):
        {body}

    def execute(self, goal_handle):
        return Kind.Result()
"""


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("body", "wrong"),
    [
        ("return True", ("check", 13, "True")),
        ("return", ("check", 13, "")),
        ("return not params", ("check", 13, "not params")),
        ("pass", ("check", 12, "")),
        (f"if params: {RESULT}", ("check", 12, "")),
        ("for each in params: pass", ("check", 12, "")),
        (RESULT, None),
        (f"if params: {RESULT}\n        else: {RESULT}", None),
        (f"try: {RESULT}\n        finally: pass", None),
        ("return self.answer(params)", None),
        ("raise ValueError", None),
        ("while True: pass", None),
    ],
)
def test_what_a_callback_for_parameters_returns(body, wrong):
    assert wrong_result(NODE.format(body=body)) == wrong


@pytest.mark.parametrize(("body", "returned"), [("return True", "`True` in line 13"), ("pass", "nothing in line 12")])
def test_a_call_tells_what_a_callback_for_parameters_returned(session, tmp_path, body, returned):
    file = tmp_path / "careful.py"
    file.write_text(NODE.format(body=body))
    session.start(file)
    new = [Parameter("speed", value=2.0).to_parameter_msg()]
    answer = session.call("/careful/set_parameters_atomically", SetParametersAtomically, parameters=new)
    assert not answer.result.successful
    (told,) = session.watch.notices()
    assert told.startswith(f"careful.py: the callback 'check' returns {returned}. It must return `SetParametersResult(")


SWAPPED = """
        self.add_on_set_parameters_callback(self.act)
        self.add_post_set_parameters_callback(self.check)

    def check(self, params):
        return SetParametersResult(successful=params[0].value > 0.0)

    def act(self, params):
        self.speed = params[0].value
"""


def test_callbacks_for_parameters_that_are_registered_the_wrong_way_round():
    registered, _, rest = SWAPPED.partition("\n\n")
    assert swapped_callbacks(f"class A(Node):\n    def __init__(self):{SWAPPED}") == ("act", 3, "check", 4)
    right = registered.replace("_on_", "_x_").replace("_post_", "_on_").replace("_x_", "_post_")
    assert swapped_callbacks(f"class A(Node):\n    def __init__(self):{right}\n\n{rest}") is None
    for old, new in (("return Set", "Set"), ("self.speed = ", "return "), ("self.add_post", "add = self.post")):
        assert swapped_callbacks(f"class A(Node):\n    def __init__(self):{SWAPPED.replace(old, new)}") is None


def test_a_second_on_set_callback_that_acts_is_meant_as_a_post_set_callback():
    registered, _, rest = SWAPPED.partition("\n\n")
    twice = SWAPPED.replace("_post_", "_on_")
    assert second_check(f"class A(Node):\n    def __init__(self):{twice}") == ("act", 3, "check")
    one = registered.partition("\n        self.add_post")[0]
    for text in (SWAPPED, f"{one}\n\n{rest}", twice.replace("self.speed = ", "return ")):
        assert second_check(f"class A(Node):\n    def __init__(self):{text}") is None


@pytest.mark.parametrize(
    ("changed", "begins", "ends"),
    [
        (
            "_post_",
            "careful.py: the callbacks are registered the wrong way round (lines 11 and 12). The on-set ",
            " and `add_post_set_parameters_callback(self.act)`.",
        ),
        (
            "_on_",
            "careful.py: 'act' is registered as an on-set callback in line 11, and returns nothing. 'check' checks ",
            " post-set callback: write `add_post_set_parameters_callback(self.act)`.",
        ),
    ],
)
def test_a_call_tells_of_callbacks_for_parameters_that_are_registered_the_wrong_way_round(
    session, tmp_path, changed, begins, ends
):
    file = tmp_path / "careful.py"
    before, _, _ = NODE.format(body="").partition("        self.add_on_set")
    main = NODE.format(body="").partition("\nrclpy.init()")[2]
    file.write_text(f"{before}{SWAPPED.replace('_post_', changed)}\n\nrclpy.init(){main}")
    session.start(file)
    new = [Parameter("speed", value=2.0).to_parameter_msg()]
    session.call("/careful/set_parameters_atomically", SetParametersAtomically, parameters=new)
    (told,) = session.watch.notices()
    assert told.startswith(begins) and told.endswith(ends)


def test_who_asks_for_the_parameters_of_a_node_of_another_name_reads_which_nodes_there_are(session, tmp_path):
    file = tmp_path / "careful.py"
    file.write_text(NODE.format(body=RESULT))
    session.start(file, parameters={"sped": 2.0})
    (told,) = session.watch.notices()
    assert told == "careful.py does not declare a parameter 'sped', so the value has no effect. Did you mean 'speed'?"
    session.start(file, "--ros-args", "-p", "sped:=2.0", "-p", "speed:=2.0")
    assert session.watch.notices() == [told]
    with pytest.raises(CallTimeout, match="No node is called /Careful. Nodes here: /careful."):
        session.call("/Careful/set_parameters_atomically", SetParametersAtomically, timeout=0.5)


def test_a_class_that_has_not_declared_a_parameter_is_told(session):
    class Slow(Node):
        def __init__(self):
            super().__init__("slow")
            self.declare_parameter("max_speed", 1.5)

    session.start(Slow, parameters={"use_sim_time": False, "max_speed": 2.0})
    assert session.watch.notices() == []
    session.start(Slow, parameters={"debug": True})
    (told,) = session.watch.notices()
    assert told == "slow does not declare a parameter 'debug', so the value has no effect. It declares: max_speed."


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ("self.newest = goal_handle", ("take", 6)),
        ("goal_handle.execute", ("take", 6)),
        ("goal_handle.execute()", None),
        ("threading.Thread(target=goal_handle.execute).start()", None),
    ],
)
def test_accepted_goals_that_nobody_begins(body, found):
    assert never_begins(SERVER.format(body=body)) == found


@pytest.mark.parametrize(("body", "told"), [("self.execute(goal_handle)", True), ("self.newest = goal_handle", False)])
def test_a_program_that_runs_its_execute_callback_itself_is_told_what_starts_a_goal(body, told):
    says = f"so no goal starts. `{body}` only runs your function: write `goal_handle.execute()`, which starts the goal."
    assert (says in idle("a.py", SERVER.format(body=body))) == told


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        ("executor = MultiThreadedExecutor(4)\nexecutor.spin()", 2),
        ("executor = MultiThreadedExecutor(4)\nexecutor.add_node(node)\nexecutor.spin()", 0),
        ("executor = MultiThreadedExecutor(4)\nrclpy.spin(node, executor)\nexecutor.spin()", 0),
        ("executor = MultiThreadedExecutor(4)\nnode.executor = executor\nexecutor.spin()", 0),
        ("executor = make(node)\nexecutor.spin()", 0),
        ("rclpy.spin(node)", 0),
    ],
)
def test_an_executor_that_spins_no_node(lines, line):
    assert empty_executor(lines) == (("executor.spin()", line) if line else None)
    assert ("`executor.spin()` spins an executor to which no node" in idle("a.py", lines)) == bool(line)


def test_accepted_goals_that_a_subclass_in_a_cell_never_begins():
    cell = "class Own(Lift):\n    def __init__(self):\n        super().__init__(handle_accepted_callback=self.take)\n\n"
    assert never_begins(f"{cell}    def take(self, handle):\n        self.newest = handle\n") == ("take", 5)
    assert never_begins(f"{cell}    def take(self, handle):\n        super().take(handle)\n") is None


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("lambda goal: print('accepted', goal)", True),
        ("lambda goal: None", True),
        ("lambda goal: goal.execute()", False),
        ("lambda goal: waiting.append(goal)", False),
        ("lambda goal: goal.execute", True),
    ],
)
def test_accepted_goals_that_a_lambda_never_begins(given, told):
    cell = f"ros.start(Lift, handle_accepted_callback={given})"
    assert never_begins(cell) == ((given, 1) if told else None)
    named_alone = (
        "`goal.execute` is the method itself, and nothing calls it, so no goal starts. Write `lambda goal: goal."
    )
    assert (named_alone in idle("the cell", cell)) == given.endswith(".execute")


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("executor.add_node(node)\nrclpy.spin(node)", True),
        ("executor.add_node(node)\nrclpy.spin(node)\nexecutor.shutdown()", True),
        ("executor.add_node(node)\nrclpy.spin(node, executor)", False),
        ("executor.add_node(node)\nrclpy.spin(node, executor=executor)", False),
        ("executor.add_node(node)\nThread(target=executor.spin).start()\nrclpy.spin(node)", False),
        ("executor.add_node(node)\nexecutor.spin()", False),
        ("rclpy.spin(node)", False),
    ],
)
def test_an_executor_that_nothing_spins(lines, told):
    text = f"{ASKS}executor = MultiThreadedExecutor(4)\n{lines}\n"
    why = (
        "othing spins `executor` of line 6, and `rclpy.spin(node)` has one thread: write `executor.spin()` in its place"
    )
    assert doubts("relay.py", text) == [f"relay.py: n{why}."] * told
    said = blocked(text, "/relay")
    assert (f"the executor is busy with this callback. N{why}" in said) == told


ASKS = """class Relay(Node):
    def __init__(self):
        self.create_service(Trigger, '/relay', self.relay)
    def relay(self, request, response):
        return self.client.call(request)
"""


@pytest.mark.parametrize(("guard", "told"), [("if __name__ == '__main__':", True), ("if True:", False)])
def test_a_cell_that_is_to_write_a_file_and_spins(monkeypatch, guard, told):
    name, text = "<ipython-input-1-spins>", f"said = asked()\n{guard}\n    pass\n"
    monkeypatch.setitem(linecache.cache, name, (len(text), None, text.splitlines(keepends=True), name))
    names = {"asked": for_a_file}
    exec(compile(text, name, "exec"), names)
    assert bool(names["said"]) == told


class Waiting(Node):
    """A node whose timer waits for what its own thread would bring."""

    def __init__(self, session):
        super().__init__("waiting")
        self.session, self.over = session, False
        self.timer = self.create_timer(0.01, self.wait)

    def wait(self):
        self.timer.cancel()
        with contextlib.suppress(CallTimeout):
            self.session.wait(Future(), timeout=0.1)
        self.over = True


def test_a_callback_that_waits_as_a_cell_may_is_told(session):
    node = session.start(Waiting, session).node
    assert session.until(lambda: node.over)
    (told,) = session.watch.notices()
    assert told.startswith("ros.wait inside a callback of 'waiting' blocks the only thread that runs its callbacks")


def test_a_node_spins_only_once_the_session_has_its_handle(session, monkeypatch):
    had, start = [], threading.Thread.start

    def recorded(thread):
        if thread.name == "spin waiting":
            had.extend(session._handles)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", recorded)
    session.start(Waiting, session)
    assert had == ["waiting"]


@pytest.mark.parametrize(
    ("body", "wrong"),
    [
        ("return CancelResponse.ACCEPT", None),
        ("return self.answer", None),
        ("return True", ("allow", 7, "True")),
        ("return handle.is_active and not self.blocked", ("allow", 7, "handle.is_active and (not self.blocked)")),
        ("return handle and CancelResponse.ACCEPT or CancelResponse.REJECT", None),
        ("is_this = lambda goal: goal == handle; return CancelResponse.ACCEPT", None),
        ("def is_this(goal):\n            return goal == handle\n        return CancelResponse.ACCEPT", None),
        ("for each in self.goals:\n            pass\n        else:\n            return CancelResponse.ACCEPT", None),
        ("self.get_logger().info('cancel')", ("allow", 6, "")),
    ],
)
def test_a_cancel_callback_that_returns_no_response(body, wrong):
    source = SERVER.replace("handle_accepted_callback=self.take", "cancel_callback=self.allow")
    source = source.replace("def take(", "def allow(").format(body=body)
    assert wrong_cancel(source) == wrong
    of_another_class = "\n\nclass Ride:\n    def allow(self):\n        return True\n"
    assert wrong_cancel(source + of_another_class) is None


@pytest.mark.parametrize(
    ("value", "descriptor", "told"),
    [
        ("1.0", "ParameterDescriptor(integer_range=[IntegerRange()])", "`integer_range` has no effect"),
        ("1", "ParameterDescriptor(floating_point_range=[FloatingPointRange()])", "Use `integer_range`."),
        ("1", "kept", "type integer, on which `floating_point_range`"),
        ("1.0", "kept", ""),
        ("1", "ParameterDescriptor(integer_range=[IntegerRange()])", ""),
        ("limit", "ParameterDescriptor(integer_range=[IntegerRange()])", ""),
    ],
)
def test_a_range_of_another_type_than_the_default(value, descriptor, told):
    text = "kept = ParameterDescriptor(floating_point_range=[FloatingPointRange()])\n"
    found = doubts("the cell", f"{text}node.declare_parameter('speed', {value}, {descriptor})")
    assert ("".join(found) == "") == (told == "") and told in "".join(found)
    assert not told or found[0].startswith("the cell, line 2: the default of 'speed' is of the type ")


@pytest.mark.parametrize("guard", ["== 'main'", "== '__main_'", '== "_main_"', "!= '__main__'"])
def test_a_guard_that_is_false_when_the_file_is_run(tmp_path, guard):
    file = tmp_path / "server.py"
    file.write_text(f"def main():\n    pass\n\n\nif __name__ {guard}:\n    main()\n")
    told = str(of_program(file, "", 0, before_its_node=True))
    assert told.startswith(f"server.py ended with exit status 0.\n  server.py, line 5\n    if __name__ {guard}:\n")
    assert told.endswith("so main() does not run: write `if __name__ == '__main__':`.")


@pytest.mark.parametrize(
    "condition, is_false",
    [
        ("False", True),
        ("not __name__ == '__main__'", True),
        ("'__main__' == __name__", False),
        ("__name__ == '__main__' and ready()", False),
        ("DEBUG", False),
        (f"__name__ == {hex(1 << 16_000)}", True),  # has more digits than Python writes
    ],
)
def test_what_keeps_main_from_running_is_known_only_of_conditions_that_have_one_value(condition, is_false):
    found = wrong_guard(f"def main():\n    pass\n\n\nif {condition}:\n    main()\n")
    assert found == ((condition, 5) if is_false else None)
    assert wrong_guard(f"if {condition}:\n    debug()\n") is None


def test_what_a_cell_sets_in_vain_is_told(session):
    class Driver(Node):
        def __init__(self):
            super().__init__("driver")
            self.declare_parameter("speed", 1.0)

    node = session.start(Driver).node
    node.set_parameters([Parameter("speed", value=2.0)])
    assert session.watch.notices() == []
    node.set_parameters([Parameter("speed", value=3)])
    assert session.watch.notices() == [
        "driver refused speed = 3: Wrong parameter type, expected 'Type.DOUBLE' got 'Type.INTEGER'"
    ]
