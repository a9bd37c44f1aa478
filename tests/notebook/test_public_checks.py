"""Public checks hold what their task says: right answers pass, and the mistakes that a section is about do not."""

import ast
import linecache
import re

import nbformat
import pytest

from course import recorders
from course.foundation import cells
from course.notebook import judging
from course.notebook.exercise_magic import exercise
from course.notebook.needed_cells import SESSION, names_of
from course.session import live
from tests.chosen import each_night
from tests.hidden import answers
from tests.notebook.public_checks import NOTEBOOKS, SHELL, Page

# What the pages call the mistake of their section, beside the wrong answers in what an exercise is about (ABOUT) and
# those that do nothing useful (USELESS).
OF_THE_SECTION = {
    "actions": {
        "cancelled cabin goes back to floor 0",
        "makes one more step after a cancel",
        "makes one more step when the shaft is blocked",
        "every goal starts at floor 0",
        "goals move the cabin side by side",
        "never looks for a cancel",
        "never looks whether it is blocked",
        "no cancel callback",
        "no feedback",
        "one thread",
        "rejects nothing",
        "reports a step before its time",
        "step period is fixed",
    },
    "ai_integration": {"an old scan is as good as a new one", "no limit", "the node turns both signs"},
    "calculator": {
        "client asks again when it is refused",
        "client asks again when no answer comes",
        "client asks three times",
        "client has success when it is refused",
        "client ignores success",
        "client refuses a division by zero itself",
        "client shows its own reason",
        "client shows the beginning of the message",
        "client takes no 0 for b",
        "client writes the message in small letters",
        "crash on division by zero",
        "unknown operations raise",
    },
    "parameters": {
        "integral never starts again",
        "no ranges",
        "no rule for the limits",
        "not clamped",
        "refuses by returning nothing",
    },
    "services": {
        "enable toggles",
        "relay reads again when a is set",
        "relay reads b once",
        "relay waits 8 s for a server",
        "status success is the state",
        "the end of a stop that is not on disables",
    },
}
# More wrong answers than the hidden suites know: each is the reference with a line changed.
MORE = {
    "actions": {
        "step period is fixed at the one of the page's servers": (
            ("lift_server.py", "period = self.get_parameter('step_period').value", "period = 0.2"),
        ),
        "the cancel callback ends the goal": (
            (
                "lift_server.py",
                "        return CancelResponse.ACCEPT\n",
                "        goal_handle.canceled()\n        return CancelResponse.ACCEPT\n",
            ),
        ),
        "a goal has the cabin for the time of each step alone": (
            ("lift_server.py", "        with self.cabin:\n", "        if True:\n"),
            (
                "lift_server.py",
                "            time.sleep(period)\n",
                "            with self.cabin:\n                time.sleep(period)\n",
            ),
        ),
        "a floor that comes twice in a row is one stop": (
            (
                "lift_server.py",
                "stops.append(left.pop(0))",
                "stops.append(left[0])\n            left[:] = [x for x in left if x != left[0]]",
            ),
        ),
        "the client prints the feedback at the end": (
            (
                "lift_client.py",
                "        print(f'Feedback:",
                "        self.lines = getattr(self, 'lines', '') + str(f'Feedback:",
            ),
            ("lift_client.py", "        print(f'Result:", "        print(self.lines)\n        print(f'Result:"),
        ),
    },
    "ai_integration": {
        "the agent has a memory": (("wall_agent.py", "if front < 0.5", "if front < (0.5, 1.0)[self.state.value == 1]"),)
    },
    "calculator": {
        "one argument alone ends in a traceback": (
            ("calculator_client.py", "except ValueError:", "except ZeroDivisionError:"),
        ),
        "the log of responses is at level debug": (
            ("calculator_server.py", "info(\n            f'Response", "debug(\n            f'Response"),
        ),
    },
    "services": {
        "relay waits 4 s for a server, which holds up the next caller": (
            ("relay.py", "self.client.service_is_ready()", "self.client.wait_for_service(timeout_sec=4.0)"),
        )
    },
}
# They are seen after seconds, or where a step takes longer: public checks are to be quick.
SEEN_LATE = {
    "the motors start by themselves a second after the stop has ended",
    "the stop ends by itself after 6 s",
    "waits for the cabin for half a second",
}
# Right answers that a public check refuses: it asks one node for all parameters, as the task has it.
REFUSED = {"gains kept in an object, two nodes, threads, async, slow start, best effort"}
QUICK = {  # in each run, as are two of actions below; all the others each night
    "ai_integration": "the node turns both signs",
    "calculator": "crash on division by zero",
    "parameters": "integral never starts again",
    "services": "relay spins in its callback",
}


TWO_NODES = b"""
import threading
import time

import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger


class Relay(Node):
    def __init__(self, asker):
        super().__init__('relay')
        self.declare_parameters('', [('a', 0), ('b', 0)])
        self.client = asker.create_client(AddTwoInts, '/add_two_ints')
        self.create_service(Trigger, '/relay', self.relay, callback_group=ReentrantCallbackGroup())

    def relay(self, request, response):
        if not self.client.service_is_ready():
            response.message = 'not there'
            return response
        ready = threading.Event()
        a, b = [each.value for each in self.get_parameters(['a', 'b'])]
        future = self.client.call_async(AddTwoInts.Request(a=a, b=b))
        future.add_done_callback(lambda _: ready.set())
        response.success = ready.wait(timeout=8)
        response.message = f'The sum is {future.result().sum}' if response.success else 'too slow'
        return response


rclpy.init()
asker = Node('asker')
threading.Thread(target=rclpy.spin, args=[asker, SingleThreadedExecutor()], daemon=True).start()
time.sleep(1.0)  # so that the other node is found later
executor = MultiThreadedExecutor(12)
executor.add_node(Relay(asker))
try:
    executor.spin()
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""

LEARNS_LATER = (
    TWO_NODES.replace(b"if not self.client.service_is_ready()", b"if not self.is_there")
    .replace(
        b"        self.create_service(",
        b"        self.look()\n        asker.create_timer(0.4, self.look)\n        self.create_service(",
    )
    .replace(
        b"    def relay(",
        b"    def look(self):\n        self.is_there = self.client.service_is_ready()\n\n    def relay(",
    )
)


def wrong(exercise: str) -> list[str]:
    """The wrong answers that the public checks must not pass."""
    named = answers.named(exercise, "ABOUT") | answers.named(exercise, "USELESS")
    return sorted(named - SEEN_LATE | OF_THE_SECTION[exercise] | {*MORE.get(exercise, {})})


def files_of(exercise: str, name: str) -> dict[str, bytes]:
    """Return the files of a wrong answer."""
    if name not in MORE.get(exercise, {}):
        return answers.files(exercise, name)
    files = answers.solution(exercise)
    for file, old, new in MORE[exercise][name]:
        files = answers.changed(files, file, (old, new))
    return files


@pytest.fixture
def empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    live.live().close()


@pytest.mark.matrix  # the notebooks themselves run it, with these outputs
@pytest.mark.parametrize("exercise", answers.names())
def test_the_reference_passes(empty, exercise):
    assert set(Page(exercise).judge(answers.solution(exercise)).values()) == {cells.PASSED}


@pytest.mark.matrix  # a check that fails runs twice in test_a_check_that_fails_leaves_no_more_than_one_end_of_a_topic
@pytest.mark.parametrize("exercise", answers.names())
@pytest.mark.long("runs each check of an exercise three times")
def test_each_check_passes_again_in_the_same_kernel(empty, exercise, capfd):
    """Also a third time, and nothing that the runs before have left raises anything."""
    page = Page(exercise)
    names = list(page.judge(answers.solution(exercise)))
    for _ in range(2):
        for name in names:
            assert (name, page.check(name)) == (name, cells.PASSED)
    assert not [notice for notice in live.live().watch.notices() if "raised" in notice]
    assert "raised" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("exercise", "file", "right", "wrong"),
    [("ai_integration", "wall_follower.py", "'cmd_vel'", "'cmd_val'"),
     each_night("parameters", "pid_node.py", "'effort'", "'efort'"),
     ("actions", "lift_server.py", "Result(stops=stops", "Result(stops=[9]")],
)  # fmt: skip
def test_a_check_that_fails_leaves_no_more_than_one_end_of_a_topic(empty, exercise, file, right, wrong):
    files, check = answers.solution(exercise), file.removesuffix(".py").replace("_", "-")
    page, node = Page(exercise), live.live().node
    before = {*node.subscriptions, *node.publishers}
    for again in range(2):
        said = page.check(check) if again else page.judge(answers.changed(files, file, (right, wrong)), check)[check]
        assert said != cells.PASSED
        for ends in (node.subscriptions, node.publishers):
            left = [end.topic_name for end in ends if end not in before]
            assert len(left) == len({*left})


@pytest.mark.parametrize(
    ("exercise", "name"),
    [
        pytest.param(exercise, name, marks=[pytest.mark.matrix] * (name != QUICK.get(exercise)))
        for exercise in answers.names()
        for name in wrong(exercise)
    ],
)
def test_the_mistake_of_a_section_does_not_pass(empty, exercise, name):
    said = Page(exercise).judge(files_of(exercise, name))
    assert said and set(said.values()) != {cells.PASSED}


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("exercise", "name"),
    [
        (exercise, name)
        for exercise in answers.names()
        for name in answers.load(exercise).RIGHT
        if name not in {"reference", *REFUSED}
    ],
)
def test_other_right_answers_pass(empty, exercise, name):
    assert set(Page(exercise).judge(answers.files(exercise, name)).values()) == {cells.PASSED}


def test_the_parameters_of_a_relay_may_belong_to_the_second_of_two_nodes(empty):
    """The check finds the node that serves /relay, and nothing is said of the first one's parameters."""
    assert Page("services").judge({"relay.py": TWO_NODES}, "relay") == {"relay": cells.PASSED}
    assert not [notice for notice in live.live().watch.notices() if "does not declare" in notice]


@pytest.mark.matrix  # a right answer in another style
def test_a_relay_that_learns_after_a_call_that_the_server_has_gone_is_called_again(empty):
    """The call that it sent to nobody waits for as long as it likes: what becomes of it is up to the student."""
    assert LEARNS_LATER.count(b"look") == 3 and b"self.is_there:" in LEARNS_LATER
    assert Page("services").judge({"relay.py": LEARNS_LATER}, "relay") == {"relay": cells.PASSED}


AWAITS_THE_SERVER = (
    (
        "        group = ReentrantCallbackGroup()\n",
        "        self.group = group = ReentrantCallbackGroup()\n        together = {'callback_group': group}\n",
    ),
    (
        "            AddTwoInts, '/add_two_ints', callback_group=group)",
        "            AddTwoInts, '/add_two_ints', **together)",
    ),
    ("self.relay, callback_group=group)", "self.relay, **together)"),
    (
        "    async def relay(self, request, response):\n",
        """    async def sleep(self, seconds):
        woken = Future()
        timer = self.create_timer(seconds, lambda: woken.set_result(None), callback_group=self.group)
        await woken
        self.destroy_timer(timer)

    async def relay(self, request, response):
        until = self.get_clock().now() + Duration(seconds=4.0)
        while not self.client.service_is_ready() and self.get_clock().now() < until:
            await self.sleep(0.1)
""",
    ),
    ("import Node\n", "import Node\nfrom rclpy.duration import Duration\nfrom rclpy.task import Future\n"),
)


@pytest.mark.matrix  # a right answer in another style
def test_a_relay_may_await_its_server_for_four_seconds(empty):
    files = answers.changed(answers.solution("services"), "relay.py", *AWAITS_THE_SERVER)
    assert Page("services").judge(files, "relay") == {"relay": cells.PASSED}


@pytest.mark.parametrize("exercise", answers.names())
def test_a_check_judges_the_files_as_they_lie_there_by_itself(exercise):
    """It starts what it judges, waits in a way that a death ends, and uses no run of another cell."""
    for cell in cells.read(NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        if not cell.public_check:
            continue
        tree = ast.parse(SHELL.sub("", cell.source))
        called = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
        assert called & {"judge", "as_it_lies", "run"}, f"{cell.name} starts nothing"
        assert not called & {"time.sleep", "subprocess.run", "lift.wait_for_server"}, cell.name
        told_of = [each for each in called if each.endswith(".wait_feedback")]
        assert not told_of, f"{cell.name}: a reader would be told of a call that is not theirs"


def test_a_check_starts_what_lies_there_and_refuses_what_is_not_there(empty, tmp_path):
    page, files = Page("calculator"), answers.solution("calculator")
    assert page.judge(files, "calculator-client") == {"calculator-client": cells.PASSED}
    server = tmp_path / "calculator_server.py"
    server.write_text(
        server.read_text().replace("request.a + request.b", "request.a - request.b")
    )  # edited, and not run
    assert page.check("calculator-server").startswith("15.5 add 3.2 gave 12.3")
    assert page.check("calculator-client").startswith(
        "the client asks calculator_server.py, whose check comes first: 15.5 add 3.2 gave"
    )
    server.unlink()
    assert page.check("calculator-server").startswith("calculator_server.py is not in the notebook's folder")
    page.write("Calculate.srv", b"float64 a,\n---\n")
    assert page.check("calculate-srv").startswith(
        "Calculate.srv is unchanged, because the last run of its cell was refused"
    )


SERVER = "calculator_server.py"
CLIENT = "calculator_client.py"
SPIN = "        rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"


@pytest.mark.parametrize(
    ("check", "file", "old", "new", "says"),
    [
        ("calculator-server", SERVER, "response.success = True", "response.success == True",
         "15.5 add 3.2 was answered with success=False, result=18.7 and no message"),
        ("calculator-client", CLIENT, SPIN, "        rclpy.logging\n",
         "sends the request, but nothing in the file spins the node"),
        each_night("calculator-client", CLIENT, "a, b = float(a), float(b)", "a, b = float(int(a)), float(int(b))",
                   "15 3 add it takes: a number may have a fraction."),
        ("calculator-client", CLIENT, "a, b = float(a), float(b)", "a, b = int(a), int(b)",
         "15 3 add ends with an exception. A number may have a fraction: what takes it is float, not int."),
        # tests/notebook/test_command_line.py has these three.
        each_night("calculator-client", CLIENT, "remove_ros_args(args)", "remove_ros_args(sys.argv[1:])",
                   "It takes them after one more word"),
        each_night("calculator-client", CLIENT, "_, a, b, operation", "a, b, operation",
                   "    a, b, operation = remove_ros_args(args)\n"
                   "The first of these words is the program's name, and nothing in"),
        each_night("calculator-client", CLIENT, "sys.exit(main())", "main()",
                   "must end with an exit status other than 0\n"
                   "  calculator_client.py, line 55\n    main()\nThis drops what "),
        each_night("calculator-client", CLIENT, "_, a, b, operation = remove_ros_args(args)",
                   "a, b, operation = sys.argv",
                   "    a, b, operation = sys.argv\nThe first of these words is the program's name, and nothing in"),
        each_night("calculator-client", CLIENT, "_, a, b, operation = remove_ros_args(args)",
                   "a, b, operation = sys.argv[0], sys.argv[1], sys.argv[2]",
                   "sys.argv[2]\nThe first of these words is the program's name"),
        ("calculator-server", SERVER, "response.result = request.a * request.b",
         "response.result = round(request.a * request.b, 12)", "2e-07 multiply 3e-07 gave 0.0"),
        ("calculator-server", SERVER, "elif request.operation != 'divide'",
         "if request.operation not in ('add', 'subtract', 'multiply', 'divide')",
         "operation not in ('add', 'subtract', 'multiply', 'divide'):\nThis `if` begins a new chain, whose last"),
        ("calculator-server", SERVER, "        response.success = True\n        if",
         "        response.success = True\n        request.operation.encode('ascii')\n        if",
         "UnicodeEncodeError: 'ascii' codec can't encode"),
        ("calculator-server", SERVER, "info(\n            f'Request", "debug(\n            f'Request",
         "self.get_logger().debug(\nWhat is logged with `debug` is not shown by default: use `info`."),
        each_night("calculator-server", SERVER, "f'Request: a={request.a}", "'Request: a={request.a}",
                   "[calculator_server]: Request: a={request.a} b={request.b} "),
    ],
)  # fmt: skip
def test_a_check_of_the_calculator_tells_what_is_seen(empty, check, file, old, new, says):
    files = answers.changed(answers.solution("calculator"), file, (old, new))
    files = answers.changed(files, CLIENT, ("timeout_sec=5.0", "timeout_sec=1.0"))
    assert says in Page("calculator").judge(files, check)[check]


@pytest.mark.parametrize(
    ("definition", "package", "says"),
    [
        ("string operation add", "calculator_interfaces",
         "Calculate.srv: `string operation` has the value 'add', which makes it a default; the task asks for plain"),
        ("float32 operation", "calculator_interfaces", "`operation` is a float32 and must be a string"),
        ("string operation\nfloat64 MOST=3.0", "calculator_interfaces", "`float64 MOST` has the value 3.0, "),
        ("string operation", "calculator_interface",
         "was built into the package calculator_interface, but belongs to calculator_interfaces"),
    ],
)  # fmt: skip
def test_a_definition_is_judged_as_it_was_built_last(empty, definition, package, says):
    page = Page("calculator")
    good = answers.solution("calculator")["Calculate.srv"].decode()
    assert page.judge({"Calculate.srv": good.encode()}, "calculate-srv") == {"calculate-srv": cells.PASSED}
    exercise(f"Calculate.srv --package {package}", re.sub("string operation.*", definition, good))
    assert says in page.check("calculate-srv")


@pytest.mark.parametrize(
    ("exercise", "check", "name", "says"),
    [
        ("ai_integration", "wall-agent", "the agent imports the course",
         ["wall_agent.py must import nothing of ROS, and not course: it imports course"]),
        ("ai_integration", "wall-follower", "the node imports the course",
         ["wall_follower.py must not import course: a robot has ROS 2 and NumPy alone"]),
        ("parameters", "pid-node", "Float32 efforts",
         ["pid_node publishes /effort with the type std_msgs/msg/Float32; it must be std_msgs/msg/Float64."]),
        ("parameters", "pid-node", "the limits are checked before they are declared",
         ["pid_node.py ended with exit status 1: ", "Invalid access to undeclared parameter(s): output_min",
          "\nHint: Each declaration calls the callback that line 19 registers, also before 'output_min' is declared. ",
          " Register it after the declarations"]),
    ],
)  # fmt: skip
def test_a_line_that_costs_much_is_named_before_the_hand_in(empty, exercise, check, name, says):
    """These are wrong answers of the hidden suites."""
    said = Page(exercise).judge(answers.files(exercise, name), check)[check]
    assert [each for each in says if each not in said] == [], said


STEP = "now - self.last_time"
KI_ALONE = "if param.name == 'ki' and param.value != self.ki:"
JUDGED = "        limits = {name: self.value(name) for name in ('output_min', 'output_max')}\n"


def taken_over(gain: str) -> tuple[tuple[str, str], ...]:
    """Changes after which the controller uses the gain of each set, before it is judged."""
    taken = (
        f"        self.used = {{param.name: param.value for param in params if param.name == '{gain}'}} or self.used\n"
    )
    used = (f"self.value('{gain}') *", f"self.used.get('{gain}', self.value('{gain}')) *")
    return (
        (JUDGED, taken + JUDGED),
        used,
        ("        self.integral = 0.0  #", "        self.used = {}\n        self.integral = 0.0  #"),
    )


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (taken_over("ki"), "'output_min': 10.0} was refused, but then an error of 2 gave "),
        each_night(taken_over("kd"), ", which is what kd = 9 gives, of a set that was refused"),
        each_night(
            (
                (
                    "self.ki, self.integral = param.value, 0.0",
                    "self.ki, self.integral, self.last_time = param.value, 0.0, None",
                ),
            ),
            "the next message is the error times the step, the time since the message before: with ki = 4, an ",
        ),
        (
            (
                (
                    "if not limits['output_min'] < limits['output_max']:",
                    "if limits['output_min'] >= limits['output_max'] or limits['output_max'] != limits['output_max']:",
                ),
            ),
            "{'output_min': nan} must be refused",
        ),
        each_night(
            (
                (
                    JUDGED,
                    "        self.high = next((p.value for p in params if p.name == 'output_max'), 1e99)\n" + JUDGED,
                ),
                ("min(self.value('output_max'), effort)", "min(self.value('output_max'), self.high, effort)"),
                ("        self.integral = 0.0  #", "        self.high = 1e99\n        self.integral = 0.0  #"),
            ),
            "{'output_max': -15.0} was refused, but then an error of 2 gave -10.0, and before it 2.0",
        ),
        each_night(
            (
                ("self.last_time = None", "self.last_time = time.monotonic()"),
                ("self.last_error = 0.0", "self.last_error = None"),
                ("/ step if step > 0.0 else", "/ step if self.last_error is not None else"),
            ),
            "ki:=5.0, an error of 1.0 must give 2.0; it gave ",
        ),
    ],
)
def test_the_check_of_the_controller_refuses_what_breaks_a_promise(empty, changes, says):
    files = answers.changed(answers.solution("parameters"), "pid_node.py", *changes)
    assert says in Page("parameters").judge(files)["pid-node"]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("(error - self.last_error)", "(self.last_error - error)", "an error that goes from 2 to 3 must give"),
        each_night("(error - self.last_error)", "2 * (error - self.last_error)",
                   "with kd = 2 alone, an error that goes from"),
        ("'kd', 0.0, 10.0", "'kd', 0.0, 100.0",
         "the descriptor of kd must have a range from 0 to 10, without a step; it has from 0 to 100, step 0"),
        ("'elbow', ParameterDescriptor(read_only=True)", "'elbow', ParameterDescriptor()",
         "the descriptor of joint_name must say that it is read-only"),
        (STEP, f"1000 * ({STEP})", "with kp = 0 and ki = 5, an error of 1 for"),
        pytest.param("error * step", "error", "with kp = 0 and ki = 5, an error of 1 for", marks=pytest.mark.matrix),
        pytest.param(STEP, f"1e9 * ({STEP})", "with kp = 0 and ki = 5, an error of 1 for", marks=pytest.mark.matrix),
        each_night(KI_ALONE, "if param.name == 'ki':", "a set of {'ki': 5.0}, with ki at 5 before, the effort must"),
    ],
)  # fmt: skip
def test_the_check_of_the_controller_tells_the_part_that_is_wrong(empty, old, new, says):
    files = answers.changed(answers.solution("parameters"), "pid_node.py", (old, new))
    assert says in Page("parameters").judge(files)["pid-node"]


def test_the_check_of_the_controller_shows_the_value_of_each_parameter_that_begins_otherwise(empty):
    files = answers.changed(answers.solution("parameters"), "pid_node.py", ("'elbow'", "''"))
    assert Page("parameters").judge(files)["pid-node"] == "started with kd:=0.5, joint_name must be 'elbow', and is ''"


SETS_LINEAR = "            cmd.linear.x = action['linear']\n"
SETS_ANGULAR = "            cmd.angular.z = action['angular']\n"
MAKES = "        cmd = Twist()\n"
SENDS = "        self.cmd_vel_pub.publish(cmd)\n"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            [(SETS_LINEAR, "")],
            "told (0.0, -0.0): wall_follower.py sets `angular.z` of the command, and nothing in it sets `linear.x`",
        ),
        each_night(
            [(SETS_ANGULAR, "")],
            "told (0.0, 0.0): wall_follower.py sets `linear.x` of the command, and nothing in it sets `angular.z`",
        ),
        each_night(
            [(f"{SETS_ANGULAR}{SENDS}", SETS_ANGULAR), (MAKES, f"{MAKES}{SENDS}")],
            "publish(cmd)\nThis sends `cmd` while it is empty. Send it below the lines that set its fields, the first",
        ),
    ],
)
def test_the_check_of_the_follower_does_not_blame_the_scan_for_a_command_that_is_not_filled(empty, changes, says):
    files = answers.changed(answers.solution("ai_integration"), "wall_follower.py", *changes)
    said = Page("ai_integration").judge(files, "wall-follower")["wall-follower"]
    assert says in said and "a scan that may be used" not in said


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("self.create_timer(0.1, ", "self.create_timer(10, ",
         "The period of a timer is in seconds: this one fires every 10 s."),
        pytest.param("        self.timer = self.create_timer(0.1, self.control_loop)\n", "",
                     "wall_follower.py has no timer: `create_timer(period, callback)` calls a method regularly.",
                     marks=pytest.mark.matrix),
        ("np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)", "(angles + math.pi) % (2 * math.pi) - math.pi",
         ("it is told (0.0, 0.5): that is for something nearer than 0.5 m in front. The angles of a scan are in "
          "radians, those of the sectors in wall_follower.py are in degrees")),
        each_night("ranges[usable & (low <= degrees) & (degrees < high)]", "ranges[usable]",
                   "nearer than 0.5 m in front. Outside of the two sectors, this scan shows 0.15 m everywhere"),
        each_night("linear.x", "linear.y",
                   "it is told (0.0, -0.0): its linear.y=0.3 does nothing, the speeds are linear.x and"),
        pytest.param("        self.scan_time = self", "        self.scan_time = self.scan_time or self",
                     "it is told (0.0, 0.0): that is the command without a scan that may be used",
                     marks=pytest.mark.matrix),
        pytest.param("        self.distances = nearest(msg)\n",
                     "        self.distances = nearest(msg)\n        __import__('time').sleep(0.2)\n",
                     "in laser_callback\n    __import__('time').sleep(0.2)", marks=pytest.mark.matrix),
    ],
)  # fmt: skip
def test_the_check_of_the_follower_tells_what_its_command_is_for(empty, old, new, says):
    files = answers.changed(answers.solution("ai_integration"), "wall_follower.py", (old, new))
    assert says in Page("ai_integration").judge(files, "wall-follower")["wall-follower"]


ONE_LOCK_FOR_ALL = (
    "        self.newest = goal_handle\n        goal_handle.execute()\n",
    "        with self.cabin:\n            self.newest = goal_handle\n            goal_handle.execute()\n",
)


@pytest.mark.matrix  # test_a_task_on_the_page_names_what_makes_others_wait
def test_the_check_of_the_lift_names_the_callback_that_waits_and_then_passes_the_right_answer(empty):
    """The remains of a failed check do not count the steps of the next one."""
    right = answers.solution("actions")
    page = Page("actions")
    said = page.judge(answers.changed(right, "lift_server.py", ONE_LOCK_FOR_ALL), "lift-server")["lift-server"]
    assert said.startswith("a goal that another one took over from ended as succeeded, not as aborted")
    assert re.search(r"lift_server.py, line \d+, in take_over\n    with self.cabin:", said)
    page.write("lift_server.py", right["lift_server.py"])
    assert page.check("lift-server") == cells.PASSED


def test_a_server_that_dies_at_its_first_goal_is_told_then_and_not_started_again(empty, monkeypatch):
    started, judge = [], judging.judge
    monkeypatch.setattr(judging, "judge", lambda file, **options: started.append(file) or judge(file, **options))
    files = answers.changed(
        answers.solution("actions"), "lift_server.py", ("return Lift.Result(stops=stops, floor=self.floor)", "return")
    )
    said = Page("actions").judge(files, "lift-server")["lift-server"]
    assert said.startswith("lift_server.py ended with exit status 1: AssertionError: The 'result' field must be a sub")
    assert started == ["lift_server.py"]


FREED = "        self.blocked = request.data\n"
TOOK_OVER = "if self.blocked or self.newest is not goal_handle:"
UP = "            self.floor += 1 if left[0] > self.floor else -1\n"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("time.sleep(period)", "time.sleep(min(0.5, period))",
         "started without a step_period, whose default is 1.0, its first step was reported after 0."),
        each_night(FREED, f"        self.floor *= request.data or not self.blocked\n{FREED}",
                   ", as before: the feedback of a goal for floors 0 and 9 must begin with ("),
        each_night(UP, f"{UP}            if left[0] < self.floor and self.floor in left:\n"
                   "                stops.append(left.pop(left.index(self.floor, 1)))\n",
                   "a goal for floors 0 and 1 must stop at [0, 1] in this order, and said [1, 0]"),
        each_night("all(0 <= floor <= top for floor in goal.floors)",
                   "max(goal.floors) <= top and goal.floors[-1] >= 0",
                   "a goal for [2, -1, 1] ended as "),
        each_night("            if goal_handle.is_c",
                   "            while self.blocked and not stops:\n                time.sleep(0.05)\n"
                   "            if goal_handle.is_c",
                   "with a blocked shaft (data=True twice), a new goal that needs a step at once, ended as nothing"),
        each_night(FREED, "        self.blocked = not self.blocked\n",
                   "was [], and the goal ended as aborted, with a free shaft (data=False)"),
        each_night(FREED, "        self.blocked = request.data and not self.blocked\n",
                   "with a blocked shaft (data=True twice), a new goal that needs a step at once, ended as succeeded"),
        each_night(TOOK_OVER, TOOK_OVER.replace("self.newest", "left[0] > self.floor and self.newest"),
                   "a goal on its way down that another one took over from made "),
        each_night("        return CancelResponse.ACCEPT", "        return CancelResponse(1 + (self.floor > 0))",
                   "a goal that was cancelled as soon as it was accepted ended as succeeded, not as canceled"),
    ],
)  # fmt: skip
def test_the_check_of_the_lift_refuses_what_breaks_a_promise(empty, old, new, says):
    files = answers.changed(answers.solution("actions"), "lift_server.py", (old, new))
    assert says in Page("actions").judge(files, "lift-server")["lift-server"]


APPENDS = "            stops.append(left.pop(0))\n"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            [(UP, f"{UP}            stops.append(self.floor)\n"), (APPENDS, "            left.pop(0)\n")],
            "[1, 2, 1], floor=1): these are all floors that it came by, and only floors of the goal are stops",
        ),
        each_night(
            [("stops, left = [],", "stops, left = [self.floor],")],
            "[0, 2, 1], floor=1): 0 is no stop of this goal. It is one of the goal before, or the floor where the",
        ),
        each_night(
            [("stops, left = [],", "stops, left = vars(self).setdefault('stops', []),")],
            "[0, 2, 1], floor=1): 0 is no stop of this goal. It is one of the goal before, or the floor where the",
        ),
        each_night(
            [(UP, f"{UP}            stops.append(left[0])\n"), (APPENDS, "            left.pop(0)\n")],
            "must give stops=[2, 1], floor=1, and gave course_interfaces.action.Lift_Result(stops=[2, 2, 1]",
        ),
    ],
)
def test_the_check_of_the_lift_says_of_wrong_stops_only_what_is_certain(empty, changes, says):
    files = answers.changed(answers.solution("actions"), "lift_server.py", *changes)
    said = Page("actions").judge(files, "lift-server")["lift-server"]
    assert says in said and ("goal before" in said) == ("goal before" in says)


@pytest.mark.matrix  # a right answer on a slow machine; test_the_reference_passes
def test_the_shaft_is_blocked_while_the_goal_runs_however_long_a_client_takes(empty, monkeypatch):
    session = live.live()
    made = session.node.create_client

    def late(kind, name, **options):
        session.until(lambda: False, 3.0 if name == "/lift/block" else 0.0)  # a busy machine: a goal has 2 s of steps
        return made(kind, name, **options)

    monkeypatch.setattr(session.node, "create_client", late)
    monkeypatch.setattr(recorders, "LATE", 60.0)  # nobody waits for the cause of an end that must be so
    assert Page("actions").judge(answers.solution("actions"), "lift-server")["lift-server"] == cells.PASSED


LIFT = answers.solution("actions")["lift_server.py"].decode()
REQUEST, RESPONSE = answers.solution("calculator")["Calculate.srv"].decode().split("---\n")
EXCHANGED = (f"{REQUEST}---\n{RESPONSE}", f"{RESPONSE}---\n{REQUEST}")
STORED = LIFT[
    LIFT.index("        self.newest = goal_handle\n") : LIFT.index("            return self.move(goal_handle)\n")
]
BEHIND_THE_LOCK = STORED.replace("        self.newest = goal_handle\n", "") + "            self.newest = goal_handle\n"
RELAY, MOTORS = (answers.solution("services")[name].decode() for name in ("relay.py", "motor_service.py"))
READY = RELAY[RELAY.index("        self.get_logger()") : RELAY.index("            response.success = False")]
READY_ONCE = READY.replace("self.client.service_is_ready()", "self.ready").replace(
    "        self.get_logger()", "        self.ready = self.client.service_is_ready()\n        self.get_logger()"
)
SAID_LAST = MOTORS[MOTORS.index("        self.stopped = request.data") : MOTORS.index("    def status(")]
ANSWER = "        response.message = f'Motors {self.state()}'\n"
SAID_FIRST = ANSWER + SAID_LAST.replace(ANSWER, "")


@pytest.mark.parametrize(
    ("exercise", "check", "file", "old", "new", "says"),
    [
        ("actions", "lift-server", "lift_server.py", "self, Lift, '/lift'",
         "self, __import__('course_interfaces.action').action.Fibonacci, '/lift'",
         "The action /lift is served with the type course_interfaces/action/Fibonacci; it must be "),
        ("calculator", "calculator-server", "Calculate.srv", "float64 result", "float32 result",
         "Calculate.srv: result is a float32; it must be a float64"),
        ("ai_integration", "wall-agent", "wall_agent.py", "{'linear': 0.0, 'angular': 0.5}",
         "{'linear': 0, 'angular': 0.5}", "the speeds must be floats (0.0, not 0)"),
        ("ai_integration", "wall-agent", "wall_agent.py", "{'linear': 0.2, 'angular': -0.4}",
         "{'linear': 0.2, 'angular': __import__('numpy').float32(-0.4)}",
         "it decides 0.2, np.float32(-0.4): the speeds must be floats"),
        ("parameters", "pid-node", "pid_node.py", "'output_max', 10.0", "'output_max', 10",
         "output_max is the integer 10: a default with a point, such as 1.0, makes a double"),
        each_night("services", "relay", "relay.py", ", callback_group=group", "", "Give the client a group of its own"),
        each_night("services", "relay", "relay.py", "            AddTwoInts, '/add", "            Trigger, '/add",
                   "Its client of /add_two_ints has the type std_srvs/srv/Trigger; it must be example_interfaces/srv/"),
        each_night("services", "relay", "relay.py", "AddTwoInts.Request(a=a, b=b)", "AddTwoInts.Request(a=b)",
                   "message='38 + 5 = 606'). The request that came to /add_two_ints was a=5, b=0"),
        each_night("services", "relay", "relay.py", READY, READY_ONCE,
                   "the relay does not ask /add_two_ints\n  relay.py, line 21\n    self.ready = self.client.ser"),
        each_night("services", "motor-service", "motor_service.py", SAID_LAST, SAID_FIRST,
                   "\nThis reads `self.stopped` before line "),
        each_night("parameters", "pid-node", "pid_node.py", "'output_max', 10.0", "'output_max', '10.0'",
                   "output_max is the text '10.0': a default without quotation marks, such as 1.0, makes a double"),
        each_night("services", "relay", "relay.py", "    async def relay(self, request, response):\n",
                   "    def relay(self, request, response):\n"
                   "        self.executor.create_task(self.answer, request, response)\n        return response\n\n"
                   "    async def answer(self, request, response):\n",
                   "message=''). A field that nobody sets before the callback has ended stays as it is from the start"),
        each_night("parameters", "pid-node", "pid_node.py", "time.monotonic()", "time.monotonic_ns()",
                   ", 1,000,000,000 times as much: is the step in nanoseconds?"),
        each_night("actions", "lift-server", "lift_server.py", STORED, BEHIND_THE_LOCK,
                   "self.newest = goal_handle\nThis stores the new goal only when it has the lock,"),
        each_night("actions", "lift-server", "lift_server.py",
                   "self.newest = goal_handle", "self.new_est = goal_handle",
                   "the feedback (floor, stops_left) was [], and the goal ended as aborted"),
        each_night("calculator", "calculate-srv", "Calculate.srv", *EXCHANGED, "the two lists are exchanged: "),
        each_night("actions", "lift-server", "lift_server.py", "(SetBool, '/lift/block'",
                   "(__import__('std_srvs.srv').srv.Trigger, '/lift/block'",
                   "/lift/block is served with the type std_srvs/srv/Trigger; it must be std_srvs/srv/SetBool."),
        each_night("actions", "lift-server", "lift_server.py", "Lift.Result(stops=stops, floor=self.floor)",
                   "Lift.Result()", "as an empty Lift.Result() does: set its fields"),
        each_night("calculator", "calculator-client", "calculator_client.py",
                   "if not self.client.wait_for_service(timeout_sec=timeout_sec):", "if timeout_sec is None:",
                   "Nothing in the file waits for the server before this."),
        pytest.param("actions", "lift-server", "lift_server.py", "        self.blocked = request.data\n",
                     "        with self.cabin:\n            self.blocked = request.data\n",
                     ", in block\n    with self.cabin:", marks=pytest.mark.matrix),
        pytest.param("actions", "lift-client", "lift_client.py", "return 0 if outcome == 'SUCCEEDED' else 1",
                     "return outcome", "What main() returns is the exit status", marks=pytest.mark.matrix),
        pytest.param("actions", "lift-server", "lift_server.py", "with self.cabin:", "if self.cabin.acquire():",
                     "in execute\n    if self.cabin.acquire():", marks=pytest.mark.matrix),
        pytest.param("parameters", "pid-node", "pid_node.py", "Float64, 'error'",
                     "__import__('std_msgs.msg').msg.Float32, 'error'",
                     "subscribes to /error with the type std_msgs/msg/Float32; it must be", marks=pytest.mark.matrix),
    ],
)  # fmt: skip
def test_a_check_names_the_cause(empty, exercise, check, file, old, new, says):
    files = answers.solution(exercise)
    text = files[file].decode()
    assert old in text
    assert says in Page(exercise).judge({**files, file: text.replace(old, new).encode()}, check)[check]


CANCELED = "                goal_handle.canceled()\n                break\n"
ENDLESS = """        turns = 0.0
        while turns < right:
            turns += 0.1
        if right > 1.2:"""
ASKED = "        answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))\n"
SAID = "        response.success = True\n        response.message = f'{a} + {b} = {answer.sum}'\n"
LARGEST = """        self.largest = max(answer.sum, getattr(self, 'largest', 0))
        response.success = True
        response.message = str(self.largest)
"""
PROBES = """        self.create_timer(1.0, self.probe, callback_group=group)

    async def probe(self):
        if self.client.service_is_ready():
            await self.client.call_async(AddTwoInts.Request())
"""
GIVES_UP = """        future, given_up = self.client.call_async(AddTwoInts.Request(a=a, b=b)), rclpy.task.Future()
        timer = self.create_timer(4.5, given_up.cancel, callback_group=self.client.callback_group)
        future.add_done_callback(lambda future: given_up.set_result(future.result()))
        answer = await given_up
        self.destroy_timer(timer)
        if answer is None:
            response.message = 'too slow'
            return response
"""
KEPT = """        self.kept = getattr(self, 'kept', {})
        if (a, b) not in self.kept:
            self.kept[a, b] = await self.client.call_async(AddTwoInts.Request(a=a, b=b))
        answer = self.kept[a, b]
"""


CANCELED_BEFORE = """        waits = self.cabin.locked()
        with self.cabin:
            if waits and goal_handle.is_cancel_requested:
                goal_handle.abort()
                return Lift.Result(floor=self.floor)
"""
STEPS_FIRST = """        if left and stops:
            time.sleep(period)
            self.floor += 1 if left[0] > self.floor else -1
            self.stop(stops, left)
            goal_handle.publish_feedback(Lift.Feedback(floor=self.floor, stops_left=len(left)))
        while left:
            if goal"""


SAYS_NOTHING = """        if self.blocked:
            goal_handle.abort()
            return Lift.Result()
        self.stop(stops, left)
        while left:
"""


# A request to enable, during a stop of motors that were disabled, takes effect when the stop ends.
STARTS_LATER = """
    class StartsLater(MotorService):
        was = asked = False

        def enable(self, request, response):
            self.asked = request.data and self.stopped and not self.was
            return super().enable(request, response)

        def emergency_stop(self, request, response):
            if not self.stopped:
                self.was, self.asked = self.enabled, False
            super().emergency_stop(request, response)
            if self.asked and not request.data:
                self.enabled, response.message = True, 'Motors enabled'
            return response

    node = StartsLater()
"""


# A line of a reference, another one in its place, and what a public check says of it: each breaks a sentence of a task.
# Each run has one for each way in which a check asks, records or waits; the others belong to the night.
SWALLOWED = """\
            try:
                cmd.angular.z = action['angle']
            except Exception:
                return
"""
PID = answers.solution("parameters")["pid_node.py"].decode()
CLAMPED = PID[PID.index("        effort = (self.value('kp')") : PID.index("\n\ndef main")]
SENTENCES = [
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "            goal_handle.publish_feedback(\n"
        "                Lift.Feedback(floor=self.floor, stops_left=len(left)))\n",
        "            goal_handle.publish_feedback(\n"
        "                Lift.Feedback(floor=self.floor, stops_left=len(left)))\n"
        "            left = [each for each in left if each not in stops]\n",
        "and stops=[2, 2, 1, 2, 1]; it had [(2, 3), (1, 0)] and stops=[2, 2, 1, 1]",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "stops_left=len(left)",
        "stops_left=len(set(left))",
        "it had [(2, 2), (1, 2), (2, 1), (1, 0)] and stops=[2, 2, 1, 2, 1]",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "            goal_handle.publish_feedback(\n"
        "                Lift.Feedback(floor=self.floor, stops_left=len(left)))\n",
        "            goal_handle.publish_feedback(\n"
        "                Lift.Feedback(floor=self.floor, stops_left=len(left)))\n            time.sleep(period)\n",
        "step_period is 0.25: of all steps the fastest took 0.5",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "'step_period', 1.0",
        "'step_period', 0.5",
        "started without a step_period, whose default is 1.0, its first step was reported after 0.",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "elif request.b == 0.0:",
        "elif request.a == 0.0 or request.b == 0.0:",
        "0.0 divide 5.0 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.a + request.b",
        "round(request.a + request.b, 2)",
        "1.0004 add 2.0 gave 3.0, and in the full precision it is 3.0004",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.a - request.b",
        "round(request.a - request.b, 2)",
        "1.0004 subtract 2.0 gave -1.0, and in the full precision it is -0.9996",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "elif request.b == 0.0:",
        "elif request.b == 0.0 or abs(request.a) > 1e6:",
        "30000000.0 divide 4.0 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "        elif request.operation == 'multiply':",
        "        elif request.b == 0.0 and request.operation == 'multiply':\n"
        "            response.success = False\n            response.message = 'Division by zero'\n"
        "        elif request.operation == 'multiply':",
        "7.0 multiply 0.0 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "operation={request.operation}')",
        "operation={request.operation}', throttle_duration_sec=1.0)",
        "has none for 10.0 divide 0.0. `throttle_duration_sec` leaves lines out: log without it",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "operation '{request.operation}'\"\n",
        'operation {request.operation!r}"\n            return response\n',
        "does not have 'Unknown operation ''', of 1.0 '' 2.0\nThe end of its log is:",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "a, b = float(a), float(b)",
        "a, b = (float(each) if set(each) <= set('0123456789.-') else float('no') for each in (a, b))",
        "-4 +2.5e0 multiply: -4 is a number, and so is +2.5e0, and the result, -10.0, must be shown\nUsage",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "{response.message}'",
        "{response.message.strip()}'",
        "another server refuses with '  Café closed on Mondays,  as every year', and the client must print that",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "a, b = float(a), float(b)",
        "a, b = round(float(a), 2), round(float(b), 2)",
        "10.125 0 divide: the client must ask the server {'a': 10.125, 'b': 0.0, 'operation': 'divide'}, and asks it",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "    if response is None:\n        print('No answer from /calculator: is calculator_server.py running?')\n",
        "    print('Asking /calculator ...')\n    if response is None:\n",
        "calculator_client.py must say so in a line that it prints in no other case, but each of these it prints with",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        for param in params:\n            self.get_logger()",
        "        for param in params[:1]:\n            self.get_logger()",
        "when ki is set to another value the integral starts again, also when kd is set with it:",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        effort = max(self.value('output_min'), min(self.value('output_max'), effort))\n",
        "        if step > 0.0 or self.integral:\n"
        "            effort = max(self.value('output_min'), min(self.value('output_max'), effort))\n",
        "an error of 5.0 must give 3.0; it gave 10.0",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.integral += error * step",
        "self.integral += abs(error) * step",
        "or a little less, and both may be negative; it gave 1.",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.integral += error * step",
        "self.integral = max(0.0, self.integral + error * step)",
        "or a little less, and both may be negative; it gave 0.00",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.last_error, self.last_time = error, now\n",
        "        if error or self.last_time is None:\n            self.last_error, self.last_time = error, now\n",
        "the step is the time since the message before, also when its error was 0:",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.declare_gain('kd', 0.0",
        "self.declare_gain('kd', 0.1",
        "ki:=5.0, kd must be 0.0, and is 0.1",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "max(-0.5, min(0.5, angular))",
        "0.5 if right < 0.6 else max(-0.5, angular)",
        "at {'front': 3.0, 'right': 0.5} it must decide (0.3, 0.15); it decides (0.3, 0.5)",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "            self.state = State.WALL_AHEAD\n",
        "            self.state = State.WALL_AHEAD\n            self.turns = getattr(self, 'turns', 0) + 1\n"
        "            if self.turns > 50:\n                return {'linear': -0.1, 'angular': 0.5}\n",
        "however often: asked 200 times one after the other, it gave {'linear': -0.1, 'angular': 0.5} and",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "if right > 1.2:",
        "if right > 1.2 or front == float('inf'):",
        "at {'front': inf, 'right': 0.703} it must decide (0.3, -0.1545): the front may be free",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "        if right > 1.2:",
        "        if right > 1.2 and front > 1.0:",
        "at {'front': 0.6, 'right': 2.0} it must decide (0.2, -0.4): 0.6 m is not nearer than 0.5 m",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "'linear': 0.3, 'angular': max(-0.5, min(0.5, angular))",
        "'linear': 0.3 if abs(angular) < 0.5 or front > 1 else 0.2, 'angular': max(-0.5, min(0.5, angular))",
        "at {'front': 0.6, 'right': 0.2} it must decide (0.3, 0.5)",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "'angular': max(-0.5, min(0.5, angular))",
        "'angular': round(max(-0.5, min(0.5, angular)), 2)",
        "it must decide (0.3, -0.1545): the front may be free; it decides (0.3, -0.15)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "    degrees = np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)\n",
        "    degrees = np.degrees(angles)\n    degrees[degrees > 180] -= 360\n    degrees[degrees < -180] += 360\n",
        "a scanner whose first beam is at 720 degrees, and a wall at 0.7 m: it must be told (0.3, -0.15)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "(ranges <= scan.range_max)",
        "(ranges < scan.range_max)",
        "1.0 m on the right, which is this scan's range_max, and counts: it must be told (0.3, -0.5), and",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "(ranges >= scan.range_min)",
        "(ranges > scan.range_min)",
        "0.5 m on the right, which is this scan's range_min, and counts: it must be told (0.3, 0.15), and",
    ),
    (
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        self.cmd_vel_pub.publish(cmd)\n",
        "        if not self.scan_is_fresh() or cmd != Twist():\n            self.cmd_vel_pub.publish(cmd)\n",
        "decided to stand still, (0.0, 0.0), and it published nothing more",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "cmd.linear.x = action['linear']\n",
        "cmd.linear.x = action['linear'] or (0.0 if action['angular'] else 0.3)\n",
        "decided to stand still, (0.0, 0.0), and it published (0.3, 0.0)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "    ranges = np.array(scan.ranges, dtype=float)\n"
        "    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))\n",
        "    ranges = np.array(scan.ranges[::2], dtype=float)\n"
        "    angles = scan.angle_min + 2 * scan.angle_increment * np.arange(len(ranges))\n",
        "one beam alone, at 7 degrees, with 0.4 m: it must be told (0.0, 0.5), and it is told (0.3, -0.0)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "import math\n",
        "import math, course\n",
        "wall_follower.py must not import course",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "self.get_clock().now() - self.scan_time <= FRESH",
        "self.get_clock().now().to_msg().sec - self.scan_time.to_msg().sec <= 0.5",
        "a scan may be used until it is 0.5 s old, and it drove on for 0.",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "    ranges[np.isneginf(ranges)] = 0.0",
        "    if len(ranges) < 20:\n        return {'front': math.inf, 'right': math.inf}\n"
        "    ranges[np.isneginf(ranges)] = 0.0",
        "eight beams a turn, and a wall ahead: it must be told (0.0, 0.5), and it is told (0.2, -0.4)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "scan.angle_increment * np.arange(len(ranges))",
        "math.copysign(2 * math.pi / max(1, len(ranges)), scan.angle_increment) * np.arange(len(ranges))",
        "beams from -100 to 80 degrees alone, and a wall at 0.7 m: it must be told (0.3, -0.15)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        self.distances = nearest(msg)\n",
        "        self.last = [*getattr(self, 'last', []), nearest(msg)][-3:]\n"
        "        self.distances = {side: float(np.median([each[side] for each in self.last])) for side in SECTORS}\n",
        "it must decide by the newest scan: after scans with the front free, and one with a wall ahead at 0.4 m",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "np.degrees((angles + math.pi) % (2 * math.pi) - math.pi)\n",
        "np.degrees((angles + math.pi) % (2 * math.pi) - math.pi).astype(int)\n",
        "0.4 m at -25.6 degrees, beside the sector, which ends at -25, and 0.8 m on the right: it must be told",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        self.distances = nearest(msg)\n        self.scan_time = self.get_clock().now()\n",
        "        after_gap = self.scan_time is not None and not self.scan_is_fresh()\n"
        "        left = getattr(self, 'left', 0)\n"
        "        self.left = 10 if after_gap and not left else max(0, left - 1)\n"
        "        if not self.left:\n            self.distances = nearest(msg)\n"
        "            self.scan_time = self.get_clock().now()\n",
        "a scan comes again after a gap, with a wall ahead at 0.4 m: it must be told (0.0, 0.5), and within 0.4 s",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        self.get_logger().info('Relay ready')\n",
        "        from rclpy.parameter import Parameter\n"
        "        self.set_parameters([Parameter('a', value=40), Parameter('b', value=2)])\n",
        "message='40 + 2 = 643'). The request that came to /add_two_ints was a=40, b=2",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        answer = await",
        "        if not b:\n            response.message = 'b is not set'\n            return response\n"
        "        answer = await",
        "a call with a=0 and b=0 (a parameter may be 0) sent it no request, and was answered",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "Request(a=a, b=b)",
        "Request(a=abs(a), b=b)",
        "with a=-7 and b=0, the request that came to /add_two_ints had (a, b) = (7, 0)",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        if not self.client.service_is_ready():\n",
        "        if not self.client.service_is_ready():\n"
        "            self.failed = self.get_clock().now().nanoseconds\n"
        "        if self.get_clock().now().nanoseconds - getattr(self, 'failed', 0) < 3e9:\n",
        "/add_two_ints had gone and was there again, and for ",
    ),
    (
        "parameters",
        "pid-node",
        "pid_node.py",
        "        step = 0.0 if self.last_time is None else now - self.last_time\n",
        (
            "        if self.last_time is None:\n            self.last_error, self.last_time = error, now\n"
            "            return\n        step = now - self.last_time\n"
        ),
        "When an error of 5.0 was sent first, no effort came: each error is answered, also the first",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        step = 0.0 if self.last_time is None else now - self.last_time\n",
        "        if self.last_time is None:\n            self.last_time = now\n            return\n"
        "        step = now - self.last_time\n",
        "When an error of 2.0 was sent first, no effort came: each error is answered, also the first",
    ),
    (
        "actions",
        "lift-client",
        "lift_client.py",
        "        if not self.client.wait_for_server(timeout_sec=5.0):\n            return 'NO SERVER for /lift'\n",
        "",
        "the client must wait for the server for 1 to 10 s:\n  lift_client.py, line ",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        _, a, b, operation = remove_ros_args(args)\n",
        "        words = remove_ros_args(args)\n        if len(words) != 3:\n            raise ValueError\n"
        "        a, b, operation = words[1], words[2], words[3]\n",
        "The first word of `words` is the program's name: with A, B and OPERATION it has 4 words.",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "                self.ki, self.integral = param.value, 0.0\n",
        "                self.ki, self.integral, self.last_error = param.value, 0.0, 0.0\n",
        "when ki is set to another value the integral alone starts again: with kd = 2 and an error that stays at 4 ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.last_error, self.last_time = error, now\n",
        "        before = self.last_error\n        self.last_error, self.last_time = error, now\n"
        "        if abs(self.value('kp') * error + self.value('kd') * slope) > self.value('output_max'):\n"
        "            self.last_error = before\n",
        "the error and the time of each message count for the next one, also when the effort is clamped: with kd = 2, ",
    ),
    (
        "parameters",
        "pid-node",
        "pid_node.py",
        CLAMPED,
        CLAMPED.replace("\n                  + self.value('kd') * slope", "").replace(
            "data=effort", "data=effort + self.value('kd') * slope"
        ),
        "the whole effort is clamped, the part of the slope as well: with kd = 2, limits of -1 and 1, and ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.last_error, self.last_time = error, now\n",
        "        self.last_time = now\n        if self.value('kd'):\n            self.last_error = error\n",
        "the integral goes on, and the slope is 0, because the error stays the same. It was ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        cmd = Twist()\n        if self.scan_is_fresh():\n",
        "        cmd = self.last = getattr(self, 'last', Twist())\n        cmd.linear.x = 0.0\n"
        "        if self.scan_is_fresh():\n",
        "no scans come any more: the command must be zero, and it is (0.0, -0.45)",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "print(f'Feedback: floor {now.floor}, {now.stops_left} stops left')",
        "print(f'Feedback: floor {now.floor}')",
        "each feedback message has a floor and stops_left, and both must be printed; stops_left not there: [519, 518, ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "step = 0.0 if self.last_time is None else now - self.last_time",
        "step = 0.0 if self.last_time is None else int(1e9 * (now - self.last_time)) // 10**9",
        "\n`//` leaves the fraction out: less than a second is 0. Write `/`.",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)",
        "rclpy.spin_until_future_complete(self, future, timeout_sec=0.5)",
        "calculator_client.py must wait for an answer for 1 s at least, but it ended 0.",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "    def decide_action(self",
        "    async def decide_action(self",
        "what an `async def` returns must be awaited; leave `async` out",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "        return {'linear': 0.0",
        "        yield {'linear': 0.0",
        "a function with `yield` returns a generator; write `return`",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "slope = (error - self.last_error) / step if step > 0.0 else 0.0",
        "new = (error - self.last_error) / step if step > 0.0 else 0.0\n"
        "        slope, self.slope = (new + getattr(self, 'slope', 0.0)) / 2, new",
        "the same error again must give 2.0: the slope is that from the error before to this one, 0 here; it gave 10.0",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "            if param.name in limits:\n                limits[param.name] = param.value\n",
        "            limits['output_min' if param.name == 'output_min' else 'output_max'] = param.value\n",
        "{'kp': 3.0} must be accepted, and was refused: output_min (11.0) must be below output_max (3.0)",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "            time.sleep(period)\n",
        "            rclpy.spin_once(self, timeout_sec=period)\n",
        "This spins the node inside one of its own callbacks, and takes it away from the executor that spins it",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "    rclpy.init(args=args)\n",
        "    if not all(0 <= floor <= 9 for floor in options.floors):\n        print('REJECTED')\n        return 1\n"
        "    rclpy.init(args=args)\n",
        "one goal with the floors [12, 6] must be sent, and none was: the server, not the client, decides which floors",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "from wall_agent import WallAgent\n",
        "class WallAgent:\n    def decide_action(self, distances):\n        return {'linear': 0.3, 'angular': 0.0}\n",
        "the agent is that of wall_agent.py: take the class WallAgent out of wall_follower.py, and write `from",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "np.array(scan.ranges, dtype=float)",
        "np.array(scan.ranges[::-1], dtype=float)",
        "`ranges = np.array(scan.ranges[::-1], dtype=float)`, reverses the order of the beams: the first one is at ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "super().__init__('wall_follower')",
        "super().__init__('wall_follower', parameter_overrides=[rclpy.Parameter('use_sim_time', value=True)])",
        "With use_sim_time the clock of this node, and its timers, stand still until something publishes /clock.",
    ),
    (
        "parameters",
        "pid-node",
        "pid_node.py",
        "slope = (error - self.last_error) / step",
        "slope = abs(error - self.last_error) / step",
        "with kd = 0.5, an error that goes from 3 to -2 must give less than -2.0, the proportional part; it gave ",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n",
        "        self.stops = max(0, getattr(self, 'stops', 0) + (1 if request.data else -1))\n"
        "        self.stopped = self.stops > 0\n",
        "after emergency_stop True, enable False, emergency_stop True, emergency_stop False: ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.integral += error * step\n",
        "        self.integral = (self.integral if error * self.last_error >= 0 else 0.0) + error * step\n",
        "the integral starts again only when ki is set to another value, not when the error changes its sign",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "(self.value('kp') *",
        "((self.value('kp') or 1.0) *",
        ("kp may be 0, and with kp, ki and kd at 0 an error of 50 must give 0.0; it gave 50\n  pid_node.py, line "),
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.integral += error * step\n",
        "        self.parts = [*(getattr(self, 'parts', ()) if self.integral else ()), error * step][-100:]\n"
        "        self.integral = sum(self.parts)\n",
        "the integral is of all messages since ki was set: with ki = 5 an effort of ",
    ),
    (
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.a - request.b",
        "abs(request.a - request.b)",
        "25.0 subtract 100.0 gave 75.0",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "a, b = float(a), float(b)",
        "a, b = (float(each) if each.replace('.', '').isdigit() else float('no') for each in (a, b))",
        "-4 +2.5e0 multiply: -4 is a number, and so is +2.5e0, and the result, -10.0, must be shown",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "    GoalStatus.STATUS_CANCELED: 'CANCELED',\n    GoalStatus.STATUS_ABORTED: 'ABORTED',\n",
        "    6: 'CANCELED',\n    5: 'ABORTED',\n",
        "the goal was cancelled, so the outcome in the last line must be CANCELED; the last line is 'Outcome: ABORTED'",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "return 'NO SERVER for /lift'",
        "raise RuntimeError('there is no server')",
        "must say so, but it ends with an exception:\nlift_client.py ended with exit status 1: RuntimeError",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "            self.stop(stops, left)\n            goal_handle",
        "            self.stop(stops, left)\n            if goal_handle.is_cancel_requested:\n"
        "                continue\n            goal_handle",
        "If the cabin has made one more step, its feedback is missing: each step is reported, the last one too",
    ),
    (
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "            cmd.angular.z = action['angular']\n",
        SWALLOWED,
        "while a scan comes every 0.05 s, no command comes, for 2 s",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        CANCELED,
        CANCELED.replace("break", "return Lift.Result()"),
        ", and said stops=[], floor=0, as an empty Lift.Result() does",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "'right': (-80, -40)",
        "'right': (-60, -40)",
        "one beam alone, at -60 degrees, with 0.7 m: it must be told (0.3, -0.15)",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "now - self.last_time",
        "min(now - self.last_time, 1.0)",
        "with kp = 0 and ki = 5, an error of 1 for 1.1",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "Float64(data=effort)",
        "Float64(data=round(effort, 2))",
        "an error of 4.0625 must give 12.1875; it gave 12.19",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "if param.name == 'ki' and param.value != self.ki:",
        "if param.name in ('kp', 'kd') or (param.name == 'ki' and param.value != self.ki):",
        "with ki at 5 before, the effort must grow on with each error of 1: the integral goes on",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        with self.cabin:\n",
        CANCELED_BEFORE,
        "a goal that was cancelled as soon as it was accepted, while another one moved the cabin",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        top = self.get_parameter",
        "        self.newest = None\n        top = self.get_parameter",
        "a goal for floor 10 was rejected, and the goal that ran ended as aborted: it must go on",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        CANCELED,
        CANCELED.replace("break", "self.floor = 0\n                break"),
        "a cancelled goal had stopped at [",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        CANCELED,
        CANCELED.replace("break", "return Lift.Result(floor=self.floor)"),
        ", and said stops=[], floor=",
    ),
    (
        "actions",
        "lift-server",
        "lift_server.py",
        "self.get_parameter('top').value",
        "9",
        "with the parameter top at 1, a goal for [2] must be rejected, and was accepted",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        self.blocked = request.data\n",
        "        self.blocked = self.blocked or request.data\n",
        "and began with []",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        self.stop(stops, left)\n        while left:\n",
        SAYS_NOTHING,
        "must have the result stops=[",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        while left:\n            if goal",
        STEPS_FIRST,
        "with a blocked shaft no step is begun: a goal for floors ",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "goal.floors and all(0 <= floor <= top for floor in goal.floors)",
        "goal.floors and min(goal.floors) >= 0 and goal.floors[0] <= top",
        "a goal for [1, 10, 2] ended as ",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        while left:\n            if goal",
        "        goal_handle.publish_feedback(Lift.Feedback())\n        while left:\n            if goal",
        "needs no step, so it has no feedback, and this goal sent feedback (floor, stops_left): [(0, 0)]",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "        outcome = node.run(options.floors)\n",
        "        for floor in options.floors:\n            outcome = node.run([floor])\n",
        "one goal with the floors [12, 6] must be sent, and [[12], [6]] were",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "sys.exit(main())",
        "main()",
        "CANCELED must be in the last line, and the exit status must not be 0; it is 0\n  lift_client.py, line ",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "self.heard >= self",
        "self.heard > self",
        "the cancel must be sent as soon as 8 feedback messages have come, and came after 9",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "        end = self.wait_for(",
        (
            "        due, self.cancel_after = self.cancel_after, None\n"
            "        self.timer = due and self.create_timer(due, self.goal_handle.cancel_goal_async)\n"
            "        end = self.wait_for("
        ),
        "the cancel must be sent as soon as 8 feedback messages have come, and none came",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "all(0 <= floor <= top for floor in goal.floors)",
        "len(goal.floors) < 5 and all(0 <= floor <= top for floor in goal.floors)",
        "a goal for six stops at this floor ended as rejected, not as succeeded",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "        print(f'Result: stops",
        "        if end.status != 6:\n            print(f'Result: stops",
        "a blocked shaft: the result has stops=[] and floor=",
    ),
    (
        "actions",
        "lift-client",
        "lift_client.py",
        "            self.goal_handle.cancel_goal_async()\n",
        "            self.goal_handle.cancel_goal_async()\n            OUTCOMES[4] = 'CANCELED'\n",
        (
            "3 --ros-args --log-level info: the cancel came, but the goal succeeded all the same. So "
            "SUCCEEDED must be in the last line, and the exit status 0; it is 1\n"
        ),
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "        print(f'Feedback: floor",
        (
            "        if now == vars(self).get('last'):\n            return\n        self.last = now\n"
            "        print(f'Feedback: floor"
        ),
        "Two equal messages are two messages: after three of them the cancel must be sent, and none came\nFeedback",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "        print(f'Feedback: floor",
        (
            "        last, self.last = vars(self).get('last'), now\n"
            "        print('.' if now == last else f'Feedback: floor"
        ),
        "Each message must be printed, also when it equals another one, and floor 331 is there once, not 3 times\n",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "parse_args(remove_ros_args(args)[1:])",
        "parse_args()",
        (
            "--ros-args and what follows it are meant for ROS, and remove_ros_args leaves them out of the arguments of "
            "the client. So a goal with the floors [5, 3] must be sent, and none came; exit status 2\nusage: "
        ),
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "print(f'Result:",
        "str(f'Result:",
        "all of which must be printed; not there: [411, 412, 413]",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "        if front < 0.5:",
        "        if right > 1.2:\n            return {'linear': 0.2, 'angular': -0.4}\n        if front < 0.5:",
        "'right': 2.0} it must decide (0.0, 0.5): rule 1 comes before rule 2; it decides (0.2, -0.4)",
    ),
    ("ai_integration", "wall-agent", "wall_agent.py", "front < 0.5", "front <= 0.5", "0.5 m is not nearer than 0.5 m"),
    ("ai_integration", "wall-agent", "wall_agent.py", "right > 1.2", "right >= 1.2", "1.2 m is not farther than 1.2 m"),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "        if right > 1.2:",
        ENDLESS,
        "wall_agent.py had not answered {'front': inf, 'right': inf} after ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_agent.py",
        "        if right > 1.2:",
        ENDLESS,
        "\nwall_follower.py is here:\n  wall_follower.py, line 60, in control_loop\n    action = self.agent.decide",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "seconds=0.5",
        "seconds=1.5",
        "a scan may be used until it is 0.5 s old, and it drove on for 1.",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "+= error * step",
        "+= self.last_error * step",
        "which is what the error before gives",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.integral += error * step",
        "self.integral = max(-10.0, min(10.0, self.integral + error * step))",
        "it must be 300 or more after that; it was 10",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "time.monotonic()",
        "self.get_clock().now().nanoseconds / 1e9",
        "the step is in real seconds, by time.monotonic(), also with use_sim_time",
    ),
    (
        "parameters",
        "pid-node",
        "pid_node.py",
        "effort = (self.value('kp') *",
        "effort = ((self.__dict__.setdefault('kp', self.value('kp'))) *",
        "with kp = 4, set after the start, an error of 2 must give 8.0; it gave 2.0, which is what kp = 1 gives",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.b == 0.0",
        "abs(request.b) < 1e-12",
        "2e-300 divide 1e-300 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "operation == 'add'",
        "operation and request.operation in 'add'",
        "1.0 ad 2.0 must not succeed",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "info(\n            f'Request",
        "debug(\n            f'Request",
        "the log must have a line with the a, b and operation of each request, and has none for 15.5 add 3.2",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "_, a, b, operation = remove",
        "_, operation, a, b = remove",
        "add 15.5 3.2 it takes: the order is A B OPERATION.",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "node.call(a, b, operation)\n    except KeyboardInterrupt:\n        return 130\n",
        "node.call(a, b, operatoin)\n    except Exception:\n        response = None\n",
        "\n    except Exception:\nThis catches every exception, also that of a misspelt name",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "Request(a=a, b=b,",
        "Request(a=b, b=a,",
        "'a': 10.0, 'b': 0.0, 'operation': 'divide'}, and asks it {'a': 0.0, 'b': 10.0, 'operation': 'divide'}",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        return 1\n    print(f'{a}",
        "        return 0\n    print(f'{a}",
        "the refused division must end with an exit status other than 0\ndivide failed: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        return future.result()\n",
        "        future.result()\n",
        "\n/calculator got the request of 15.5 3.2 add, and answered. ",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "            if self.blocked or self.newest is not goal_handle:\n",
        (
            "            self.late = getattr(self, 'late', 0) + (self.newest is not goal_handle)\n"
            "            if self.blocked or self.late > 3 and self.newest is not goal_handle:\n"
        ),
        "steps after that: it must end within a step",
    ),
    (
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n",
        (
            "        self.stopped = request.data\n        [each.cancel() for each in list(self.timers)]\n"
            "        self.create_timer(0.3, lambda: setattr(self, 'stopped', False))\n"
        ),
        "the emergency stop ended without a request",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n",
        (
            "        self.stopped = request.data\n        [each.cancel() for each in list(self.timers)]\n"
            "        self.create_timer(1.0, lambda: setattr(self, 'stopped', False))\n"
        ),
        "the emergency stop ended without a request",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "= {answer.sum}'",
        "= {a + b}'",
        "The message must contain the sum that was received, not one of the relay's own",
    ),
    (
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "wait_for_service(timeout_sec=timeout_sec)",
        "wait_for_service()",
        "`wait_for_service()` in line 20 waits without a limit, and no node serves /calculator.",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        if not self.client.wait_for_service(timeout_sec=timeout_sec):\n            return None\n",
        "        while not self.client.wait_for_service(timeout_sec=1.0):\n            print('waiting')\n",
        "without a server, calculator_client.py must say so, and end after 10 s at most: it still waited\n",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "running?')\n        return 1\n",
        "running?')\n        return 0\n",
        "without a server, calculator_client.py must say so, and its exit status must not be 0; it was 0\nNo",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "print('No answer from /calculator: is calculator_server.py running?')",
        "print(USAGE)",
        "must say so, but it prints the same as with only one argument:\nUsage: python3 calculator_client.py A B",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "timeout_sec=5.0",
        "timeout_sec=0.3",
        "the client must wait for the server for 1 to 10 s:\n  calculator_client.py, line 20",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "        if request.operation == 'add':\n",
        (
            "        response.message = getattr(self, 'said', '')\n        self.said = 'Division by zero'\n"
            "        if request.operation == 'add':\n            self.said = response.message\n"
        ),
        "15.5 add 3.2 succeeded with the message 'Division by zero' of that refusal: each answer must depend on",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        return self.get_clock().now() - self.scan_time <= FRESH\n",
        (
            "        self.gone = getattr(self, 'gone', False) or self.get_clock().now() - self.scan_time > FRESH\n"
            "        return not self.gone\n"
        ),
        "scans come again after a gap, with a wall at 0.6 m on the right: it must be told (0.3, 0.0), and it is",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "cmd.linear.x = action['linear']",
        "cmd.linear.x = max(0.0, action['linear'])",
        "must publish what its agent decides, as it is: another agent, in the place of wall_agent.py, decided (",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "self.agent.decide_action(",
        "WallAgent().decide_action(",
        "must create one WallAgent, in `__init__`, and ask that each time: after 10 commands it has created 1",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "wait_for_server(timeout_sec=5.0)",
        "wait_for_server()",
        " waits without a limit, and no node serves /lift.",
    ),
    (
        "services",
        "relay",
        "relay.py",
        SAID,
        LARGEST,
        "std_srvs.srv.Trigger_Response(success=True, message='644'). That is the answer to another caller: ",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        self.get_logger().info('Relay ready')\n",
        PROBES,
        "each call sends one request, and without a call none is sent: after ",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        ASKED,
        KEPT,
        "each call must ask /add_two_ints again: the second call sent it no request, and was answered ",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        ASKED + SAID,
        "        done = self.client.call_async(AddTwoInts.Request(a=a, b=b))\n"
        "        done.add_done_callback(lambda future: setattr(response, 'success', True))\n",
        "A field that nobody sets before the callback has ended stays as it is",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "self.get_parameter('a').value, ",
        "self.__dict__.setdefault('a', self.get_parameter('a').value), ",
        "with the current values a=60 and b=3, both set while the node ran: ",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "if front < 0.5:",
        "if front < (0.55 if self.state == State.WALL_AHEAD else 0.5):",
        "at {'front': 0.51, 'right': 0.6} it must decide (0.3, 0.0), whatever was decided before",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "if right > 1.2:",
        "if right > (1.15 if self.state == State.LOOKING else 1.2):",
        "at {'front': 3.0, 'right': 1.19} it must decide (0.3, -0.5), whatever was decided before",
    ),
    (
        "services",
        "motor-service",
        "motor_service.py",
        "    node = MotorService()\n",
        STARTS_LATER,
        "both messages must say 'disabled' alone after emergency_stop True, enable True, emergency_stop False: ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "if not limits['output_min'] < limits['output_max']:",
        "if not limits['output_min'] < limits['output_max'] + ([each.name for each in params] == ['output_max']):",
        "an output_max of 11 must be refused: the output_min that is stored is 11",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.effort_pub =",
        (
            "        self.add_pre_set_parameters_callback(lambda params: setattr(\n"
            "            self, 'integral', self.integral * (params[0].name != 'joint_name')) or params)\n"
            "        self.effort_pub ="
        ),
        "a refused set of joint_name changed the integral: ",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "0 <= floor <= top for",
        "0 <= floor <= (9 if top == 9 else top - 1) for",
        "with the parameter top at 1, a goal for [1] must be accepted, and was rejected",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "time.sleep(period)",
        "time.sleep(0.25)",
        "started without a step_period, whose default is 1.0, its first step was reported after 0.2",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        self.blocked = request.data\n        response.success = True\n",
        "        response.success = self.blocked != request.data\n        self.blocked = request.data\n",
        "/lift/block must answer with success, also when a free shaft is freed: ",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        return GoalResponse.REJECT\n",
        "        self.blocked = False\n        return GoalResponse.REJECT\n",
        "with a blocked shaft, after a goal that was rejected, a new goal ended as succeeded, not as aborted",
    ),
    each_night(
        "actions",
        "lift-server",
        "lift_server.py",
        "        stops, left = [],",
        "        self.floor = 0\n        stops, left = [],",
        "the cabin keeps its place from goal to goal: ",
    ),
    (
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "self.agent.decide_action(self.distances)",
        "{'linear': 0.3, 'angular': 1.5 * (0.6 - self.distances['right'])}",
        "wall_follower.py must ask its agent: nothing in it calls `decide_action`",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "{answer.sum}'",
        "{float(answer.sum)}'",
        ". The sum is 9007199254740993, and the message must have all its digits: a float has not so many",
    ),
    each_night(
        "services", "relay", "relay.py", ASKED, GIVES_UP, "Here it takes 5 s, and the relay gave up before that: "
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        SAID,
        f"        if not answer.sum:\n            response.message = 'no sum'\n            return response\n{SAID}",
        "call 1 with a=60 and b=5, where /add_two_ints answers 0: success must be True, and the message must contain 0",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        " = {answer.sum}'",
        "'",
        "message='38 + 5'). The message must contain the sum that was received, 644",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        response.success = True\n",
        "",
        "message='38 + 5 = 644'). The sum was received, so success must be True; until it is set, it is False",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "{answer.sum}'",
        "{abs(answer.sum)}'",
        "where /add_two_ints answers -1: success must be True, and the message must contain -1, because a sum may be ",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        ASKED,
        f"        if not a:\n            response.message = 'a is not set'\n            return response\n{ASKED}",
        "a call with a=0 and b=3 (a parameter may be 0) sent it no request, and was answered std_srvs.srv.Trigger",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "AddTwoInts.Request(a=a, b=b)",
        "AddTwoInts.Request(a=a or 1, b=b)",
        "with a=0 and b=3, the request that came to /add_two_ints had (a, b) = (1, 3)",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n",
        (
            "        self.stopped = request.data\n        [each.cancel() for each in list(self.timers)]\n"
            "        self.create_timer(3.0, lambda: setattr(self, 'stopped', False))\n"
        ),
        "and 3.2 s later, without a request meanwhile, /motors/status says std_srvs.srv.Trigger_Response(success=True",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.enabled = request.data and response.success\n",
        (
            "        self.enabled = request.data and response.success\n"
            "        [each.cancel() for each in list(self.timers)]\n"
            "        self.create_timer(2.0, lambda: setattr(self, 'enabled', False))\n"
        ),
        "only a request changes the state: /motors/enable with data=True was answered std_srvs.srv.SetBool_Response(",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "        front, right =",
        "        self.asked = getattr(self, 'asked', 0) + 1\n        if self.asked % 2 == 0:\n"
        "            return {'linear': 0.0, 'angular': 0.0}\n        front, right =",
        "at {'front': 0.4, 'right': 0.6} it must decide (0.0, 0.5), however often; the second time it gave (0.0, 0.0)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "+ scan.angle_increment *",
        "+ abs(scan.angle_increment) *",
        "that turns clockwise, and a wall at 0.7 m: it must be told (0.3, -0.15), and it is told (0.3, 0.5): ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "+ scan.angle_increment *",
        "+ math.radians(1 if scan.angle_increment > 0 else -1) *",
        "two beams a degree, and a wall at 0.5 m: it must be told (0.3, 0.15), and it is told ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "(ranges >= scan.range_min) & ",
        "",
        "0.4 m on the right, less than this scan's range_min of 0.5 m, so left out: it must be told (0.2, -0.4), and "
        "it is told (0.3, 0.3): that is for 0.40 m on the right. Nothing in wall_follower.py reads `range_min` of the ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        " & (ranges <= scan.range_max)",
        "",
        "1.1 m on the right, more than this scan's range_max of 1.0 m, so left out: it must be told (0.2, -0.4), and ",
    ),
    (
        "actions",
        "lift-client",
        "lift_client.py",
        ", feedback_callback=self.on_feedback",
        "",
        "\nFeedback comes to the function that is given here: `send_goal_async(goal, feedback_callback=...)`.",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "wait_for_server(timeout_sec=5.0):\n            return 'NO SERVER for /lift'\n",
        (
            "wait_for_server():\n            return 'NO SERVER for /lift'\n"
            "        if floors == [10]:\n            return 'SUCCEEDED'\n"
        ),
        " waits without a limit, and no node serves /lift.",
    ),
    (
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.a * request.b",
        "round(request.a * request.b, 9)",
        "2e-07 multiply 3e-07 gave 0.0",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.a * request.b\n",
        "request.a * request.b\n            self.whole = int(response.result)\n",
        "OverflowError: cannot convert float infinity to integer",
    ),
    (
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.b == 0.0",
        "request.b == 0.0 and request.a != 0.0",
        "0.0 divide 0.0: /calculator does not answer.\ncalculator_server.py ended with exit status 1: ZeroDiv",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.b == 0.0",
        "abs(request.b) < 1e-305",
        "1e-323 divide 5e-324 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "        response.success = True\n",
        "        response.success = True\n        if len(request.operation) > 20:\n            raise ValueError\n",
        "1.0 (an operation of 60 letters) 2.0: /calculator does not answer.\ncalculator_server.py ended with exit",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.operation != 'divide'",
        "request.operation != 'divide' and len(request.operation) < 20",
        "an operation of 60 letters, all of them x, must not succeed",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "response.result = request.a + request.b",
        (
            "response.result = request.a + request.b + getattr(self, 'memory', 0.0)\n"
            "            self.memory = 0.0 if response.result else 1.0"
        ),
        "1.0004 add 2.0 gave 4.0004, and asked once more, 3.0004: each answer must depend on its own request alone",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "        response.success = True\n",
        (
            "        response.success = not getattr(self, 'nothing', False)\n"
            "        self.nothing = request.operation == ''\n"
        ),
        "after the refusal of 1.0 '' 2.0, 15.5 add 3.2 was answered with success=False",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        a, b = float(a), float(b)\n    except ValueError:\n        print(USAGE)\n        return 2\n",
        "    except ValueError:\n        print(USAGE)\n        return 2\n    a, b = float(a), float(b)\n",
        "x 2 add: x is no number, and it must print the usage:\nTraceback",
    ),
    (
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "remove_ros_args(args)",
        "sys.argv",
        (
            "15.5 3.2 add --ros-args --log-level info: --ros-args and what follows it are meant for ROS, and "
            "remove_ros_args leaves them out of the arguments of the client. So it must print 18.7, and end with exit "
            "status 0, not 2:\nUsage: "
        ),
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "a, b, operation = remove",
        "a, b, operation, *_ = remove",
        "1 2 add 3 is one argument too many",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "{response.result}'",
        "{response.result:.3g}'",
        "1234564.3 3.2 add: the result must have its first decimal, and no exponent, 1234567.5\n",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "if front < 0.5",
        "if front and front < 0.5",
        "at {'front': 0.0, 'right': 0.6} it must decide (0.0, 0.5): 0.0 is touching; it decides (0.3, 0.0)",
    ),
    each_night(
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "min(0.5, angular)",
        "min(0.5 if right > 0.05 else 0.8, angular)",
        "at {'front': 3.0, 'right': 0.0} it must decide (0.3, 0.5): 0.0 is touching; it decides (0.3, 0.8)",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n        if self.stopped:\n            self.enabled = False\n",
        (
            "        self.stopped, stops = request.data, getattr(self, 'stops', [])\n"
            "        self.stops = [*stops, self.enabled] if request.data else []\n"
            "        self.enabled = not request.data and (self.enabled or len(stops) > 1 and any(stops))\n"
        ),
        "alone after emergency_stop True, emergency_stop True, emergency_stop False: ",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.enabled = request.data and response.success\n",
        (
            "        self.tries = 0 if response.success else getattr(self, 'tries', 0) + 1\n"
            "        self.enabled = request.data and (response.success or self.tries > 1)\n"
        ),
        "both messages must say 'disabled' alone after emergency_stop True, enable True, enable True, emergency_stop "
        "False: ",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "from enum import",
        "from geometry_msgs.msg import Twist  # noqa\nfrom enum import",
        "must import nothing of ROS, and not course: it imports geometry_msgs",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "Duration(seconds=0.5)",
        "Duration(seconds=0.85)",
        "a scan may be used until it is 0.5 s old, and it drove on for 0.",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.value('kp') *",
        "(1.0 if self.value('output_max') == 3.0 else self.value('kp')) *",
        "started with kp:=2.0, output_min:=1.0, output_max:=3.0, ki:=5.0, an error of ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "seen.min(initial=math.inf)",
        "seen.min(initial=math.nan if ranges.size and np.isnan(ranges).any() and name == 'right' else math.inf)",
        "that is for 0.27 m or less on the right, or for a NaN that was not left out",
    ),
    (
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.effort_pub.publish(Float64(data=effort))\n",
        "        self.effort_pub.publish(Float64(data=effort))\n" * 2,
        "each error must have one effort: 1 were sent, and 2 efforts came, the last ones 2, 2",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.effort_pub.publish(Float64(data=effort))\n",
        "        self.effort_pub.publish(Float64())\n        self.effort_pub.publish(Float64(data=effort))\n",
        "each error must have one effort: 1 were sent, and 2 efforts came, the last ones 0, 2",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        if not limits['output_min'] < limits['output_max']:",
        (
            "        if [each.name for each in params] == ['output_min'] and params[0].value > 0.0:\n"
            "            return SetParametersResult(successful=True)\n"
            "        if not limits['output_min'] < limits['output_max']:"
        ),
        "{'output_min': 15.0} must be refused",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.effort_pub =",
        (
            "        self.add_pre_set_parameters_callback(lambda params: setattr(\n"
            "            self, 'integral', self.integral * (params[0].value != 60.0)) or params)\n"
            "        self.effort_pub ="
        ),
        "a refused set of ki changed the integral: ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.ki = self.value('ki')",
        "self.ki = 0.0",
        "started with ki:=5.0, a set of ki to 5.0 must leave the integral alone: ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "self.value('ki') *",
        "(self.value('ki') if self.__dict__.setdefault('first', self.value('ki')) != self.value('ki') else 0.0) *",
        "its effort has no integral part: the ki of the start is not used",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        if not limits['output_min'] < limits['output_max']:",
        (
            "        if not limits['output_min'] < limits['output_max']:\n"
            "            self.set_parameters([rclpy.parameter.Parameter('output_min', value=-10.0)])"
        ),
        "are [-10.0, 20.0] now\n  pid_node.py, line 54\n    self.set_parameters(",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        KI_ALONE,
        "if param.name == 'ki' and (param.value != self.ki or len(params) > 1):",
        "a set of {'ki': 5.0, 'kd': 0.5}, with ki at 5 before, the effort must grow on with each error of 1",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        if not limits['output_min'] < limits['output_max']:",
        (
            "        if not limits['output_min'] < limits['output_max']:\n"
            "            self.integral *= not [each for each in params if each.name == 'ki' and each.value > 30.0]"
        ),
        "a refused set of ki and output_min changed the integral: ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "cmd.angular.z = action['angular']",
        "cmd.angular.z = round(action['angular'], 2)",
        "a wall at 0.703 m on the right: it must be told (0.3, -0.1545), and it is told (0.3, -0.15)",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "response.result = request.a / request.b",
        "response.result = float(f'{request.a / request.b:.12g}')",
        "1.0 divide 3.0 gave 0.333333333333, and in the full precision it is 0.3333333333333333",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "request.operation == 'add'",
        "request.operation.startswith('add')",
        "1.0 adding 2.0 must not succeed",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "f\"Unknown operation '{request.operation}'\"",
        "'Division by zero'",
        "1.0 modulo 2.0 and 10.0 divide 0.0 were both refused with 'Division by zero': the message must say why",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        response = node.call(a, b, operation)\n",
        (
            "        response = node.call(a, b, operation)\n"
            "        if response and response.success:\n            response = node.call(a, b, operation)\n"
        ),
        "7 2 Power succeeds, and the client asked 2 times; it must ask once",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "operation=operation)",
        "operation=operation.lower().strip())",
        "7 2 Power: the client must send the operation as it is given, not 'power'",
    ),
    (
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "if not response.success:",
        "if response.message:",
        (
            "7 2 Power with success=True, result=49.0 and message='done': the client must print the result, and end "
            "with exit status 0, not 1:\nNothing in calculator_client.py reads `success` of the response"
        ),
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "{b} = {response.result}')",
        "{b} = {response.message or response.result}')",
        "the client must print the result, and end with exit status 0, not 0:\n7.0 Power 2.0 = done",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        a, b = float(a), float(b)\n    except ValueError:\n        print(USAGE)\n        return 2\n",
        "        a = float(a)\n    except ValueError:\n        print(USAGE)\n        return 2\n    b = float(b)\n",
        "1 x add: it must print the usage, without a traceback, and fail; exit status 1",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        _, a, b, operation = remove_ros_args(args)\n",
        "        words = remove_ros_args(args)\n        a = words[1]\n        _, a, b, operation = words\n",
        "no argument at all: it must print the usage, without a traceback, and fail; exit status 1",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "        _, a, b, operation = remove_ros_args(args)\n",
        "        words = remove_ros_args(args)\n        assert len(words) < 5\n        _, a, b, operation = words\n",
        "1 2 add 3 is one argument too many: it must print the usage",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "'--cancel-after', type=int, metavar='N')\n    options = parser.parse_args(remove_ros_args(args)[1:])",
        (
            "'--cancel-after')\n    options = parser.parse_args(remove_ros_args(args)[1:])\n"
            "    options.cancel_after = options.cancel_after and int(options.cancel_after)"
        ),
        "lift_client.py 1 --cancel-after two: it must print its usage, without a traceback; exit status 1",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "nargs='+'",
        "nargs='*'",
        "and '2 1 --fast' it must print its usage, and send no goal; it sent one for the floors []",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "options = parser.parse_args(",
        "options, _ = parser.parse_known_args(",
        "and '2 1 --fast' it must print its usage, and send no goal; it sent one for the floors [2, 1]",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "            return 'REJECTED'\n        self.cancel_when_heard()\n",
        "            return 'REJECTED'\n",
        "--cancel-after 0 cancels as soon as the goal is accepted: CANCELED must be in the last line, and the exit "
        "status must not be 0; it is 0\nThe server of this cell sends no feedback before the cancel.",
    ),
    each_night(  # the run that the check compares with is the first to ask
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "operation=operation)",
        "operation='' * (__import__('time').sleep(operation == 'add') is None))",
        "{'a': 15.5, 'b': 3.2, 'operation': 'add'}, and asks it {'a': 15.5, 'b': 3.2, 'operation': ''}",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "timeout_sec=5.0",
        "timeout_sec=5000",
        "A time limit is in seconds: 5000 in line 18 are 83 minutes.",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        self.cmd_vel_pub.publish(cmd)",
        (
            "        self.n = vars(self).get('n', 0) + 1\n        if self.scan_time is None and self.n > 4:\n"
            "            return\n        self.cmd_vel_pub.publish(cmd)"
        ),
        "it must publish on cmd_vel (geometry_msgs/Twist) at 10 Hz from its start",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "self.create_timer(0.1, ",
        "self.create_timer(0.12, ",
        "Hz, not at 10\n  wall_follower.py, line ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "self.create_timer(0.1, ",
        "self.create_timer(0.0847, ",
        "Hz, not at 10\n  wall_follower.py, line ",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "outcome == 'SUCCEEDED'",
        "outcome == 'succeeded'",
        "and the word is 'SUCCEEDED': capital and small letters differ.",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "self.cancel_after is not None and",
        "self.cancel_after and",
        "In a condition, 0 counts as false, as None does: `self.cancel_after is not None` asks whether there is a",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        effort = max(self.value('output_min'), min(self.value('output_max'), effort))\n",
        (
            "        low, high = self.value('output_min'), self.value('output_max')\n        if effort > high:\n"
            "            effort = low\n        elif effort < low:\n            effort = high\n"
        ),
        "it gave -10.0, which is output_min\n  pid_node.py, line ",
    ),
    (
        "ai_integration",
        "wall-agent",
        "wall_agent.py",
        "max(-0.5, min(0.5, angular))",
        "min(-0.5, max(0.5, angular))",
        "` is always -0.5: the two limits are exchanged. Write `max(-0.5, min(0.5, angular))`.",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "else now - self.last_time",
        "else min(now - self.last_time, 2.0)",
        "It rose by 10.00\n  pid_node.py, line ",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "    distances = {}\n",
        "    ranges[(ranges == 0.0) & (degrees < -35)] = math.inf\n    distances = {}\n",
        "touching on the right: it must be told (0.3, 0.5), and it is told ",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        group = ReentrantCallbackGroup()\n",
        (
            "        import time\n        from rcl_interfaces.msg import SetParametersResult\n"
            "        self.add_on_set_parameters_callback(\n"
            "            lambda _: time.sleep(1.5 * bool(self.client._pending_requests))\n"
            "            or SetParametersResult(successful=True))\n"
            "        group = ReentrantCallbackGroup()\n"
        ),
        "a parameter must be set at once, also while callers wait; it took 1.",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "AddTwoInts.Request(a=a, b=b))\n",
        "AddTwoInts.Request(a=a, b=b))\n        __import__('time').sleep(0.7)\n",
        "within 0.5 s after it has come from /add_two_ints; it took 0.",
    ),
    each_night(
        "services",
        "relay",
        "relay.py",
        "        answer = await",
        "        __import__('time').sleep(0.7)\n        answer = await",
        (
            " of their requests had come to /add_two_ints after 3.5 s, and all must be sent at once\n  relay.py, line "
            "30\n    __import__('time').sleep(0.7)\nA sleep blocks the only thread that runs callbacks, also in an "
        ),
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "(-25, 25)",
        "(-22, 22)",
        "something 0.4 m away at 24 degrees, in front: it must be told (0.0, 0.5)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "(-80, -40)",
        "(-76, -40)",
        "the nearest point 0.7 m away at -79 degrees: it must be told (0.3, -0.15)",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "Duration(seconds=0.5)",
        "Duration(seconds=0.2)",
        "a scan may be used until it is 0.5 s old, and the command was zero 0.",
    ),
    each_night(
        "ai_integration",
        "wall-follower",
        "wall_follower.py",
        "        self.cmd_vel_pub.publish(cmd)",
        (
            "        old = self.scan_time and not self.scan_is_fresh()\n        if old and vars(self).get('old'):\n"
            "            return\n        self.old = old\n        self.cmd_vel_pub.publish(cmd)"
        ),
        "at 10 Hz too, and after the first one none came\n  wall_follower.py, line ",
    ),
    each_night(
        "calculator",
        "calculator-server",
        "calculator_server.py",
        "        if request.operation == 'add':",
        (
            "        if request.b == 0.0:\n            response.success = False\n"
            "            response.message = 'Division by zero'\n        elif request.operation == 'add':"
        ),
        "5.0 add 0.0 was refused: Division by zero",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "return 2",
        "return 2 * (len(remove_ros_args(args)) != 4)",
        "x 2 add is a failure, and must end with an exit status other than 0",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "    rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n",
        (
            "    rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n"
            "        if not future.done():\n            print('No answer')\n            sys.exit()\n"
        ),
        "with a server that does not answer, calculator_client.py must say so, and its exit status must not be 0",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "    rclpy.spin_until_future_complete(self, future, timeout_sec=timeout_sec)\n",
        "    rclpy.spin_until_future_complete(self, future)\n",
        "(self, future)\nLine 23 waits for the answer without a limit. `rclpy.spin_until_future_complete(node, fu",
    ),
    each_night(
        "calculator",
        "calculator-client",
        "calculator_client.py",
        "    if response is None:\n",
        "    if response == 1:\n",
        "it ends with an exception:\ncalculator_client.py ended with exit status 1: AttributeError: 'NoneType'",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        KI_ALONE,
        "if param.name == 'ki' and param.value > self.ki:",
        "when ki is set to another value the integral starts again: ",
    ),
    each_night(
        "parameters",
        "pid-node",
        "pid_node.py",
        "        self.effort_pub.publish(",
        (
            "        if effort == self.value('output_min'):\n            self.integral -= error * step\n"
            "        self.effort_pub.publish("
        ),
        "the integral must grow also while the effort is clamped, and has no limits",
    ),
    each_night(
        "actions",
        "lift-client",
        "lift_client.py",
        "self.cancel_after is not None",
        "self.cancel_after",
        "--cancel-after 0 cancels as soon as the goal is accepted: CANCELED must be in the last line",
    ),
    each_night(
        "services",
        "motor-service",
        "motor_service.py",
        "        self.stopped = request.data\n",
        (
            "        self.stopped = request.data\n        import time\n        if request.data:\n"
            "            self.since = time.monotonic()\n"
            "        elif time.monotonic() - vars(self).get('since', 1e12) > 1.0:\n"
            "            self.create_timer(0.2, lambda: setattr(self, 'enabled', True))\n"
        ),
        "after the end of a stop the motors must stay disabled until they are enabled again",
    ),
]


@pytest.mark.parametrize(("exercise", "check", "file", "old", "new", "says"), SENTENCES)
def test_a_check_holds_a_sentence_of_its_task(empty, exercise, check, file, old, new, says):
    files = answers.changed(answers.solution(exercise), file, (old, new))
    assert says in Page(exercise).judge(files, check)[check]


SENDS = "            goal_handle.publish_feedback(\n"
TOLD = SENDS + "                Lift.Feedback(floor=self.floor, stops_left=len(left)))\n"
TAKEN_OVER = "            if self.blocked or self.newest is not goal_handle:\n"


@pytest.mark.matrix
def test_a_check_sees_a_step_that_a_goal_makes_after_another_one_took_over_from_it(empty):
    """Its server looks for a newer goal behind each step only, and so a goal that has waited makes one."""
    looks = f"{TOLD}            if left and self.newest is not goal_handle:\n                goal_handle.abort()\n"
    changes = (TAKEN_OVER, "            if self.blocked:\n"), (TOLD, f"{looks}                break\n")
    files = answers.changed(answers.solution("actions"), "lift_server.py", *changes)
    said = Page("actions").judge(files, "lift-server")["lift-server"]
    assert said.startswith(
        "a goal from which another one took over while it waited for its first step must make none: "
    ), said


FOUR_THREADS = (
    ("import rclpy\n", "import rclpy\nfrom rclpy.executors import MultiThreadedExecutor\n"),
    ("async def relay", "def relay"),
    ("await self.client.call_async(", "self.client.call("),
    (
        "        rclpy.spin(node)\n",
        "        executor = MultiThreadedExecutor(4)\n        executor.add_node(node)\n        executor.spin()\n",
    ),
)  # fmt: skip


@pytest.mark.matrix  # the hidden test of several callers has this wrong answer
def test_a_check_counts_the_threads_that_six_callers_block(empty):
    files = answers.changed(answers.solution("services"), "relay.py", *FOUR_THREADS)
    said = Page("services").judge(files, "relay")["relay"]
    assert said.startswith("six callers at once, with /add_two_ints: 0 of them had an answer within 5 s\n"), said
    assert "\n    answer = self.client.call(" in said
    assert "\nThis has 4 threads. A callback that blocks while it waits occupies one of them, so 6 callers at" in said


@pytest.mark.parametrize(
    ("exercise", "file", "old", "new", "offered", "asked"),
    [
        (
            "parameters",
            "pid_node.py",
            "'error', self.error_callback, 10",
            "'error', self.error_callback, rclpy.qos.QoSProfile(depth=1, durability=rclpy.qos.DurabilityPolicy(1))",
            "reliable and volatile",
            "reliable and transient_local",
        ),
        (
            "ai_integration",
            "wall_follower.py",
            "Twist, 'cmd_vel', 10",
            "Twist, 'cmd_vel', rclpy.qos.qos_profile_sensor_data",
            "best_effort and volatile",
            "reliable and volatile",
        ),
    ],
)
def test_a_quality_of_service_that_does_not_fit_is_told_once(empty, exercise, file, old, new, offered, asked):
    files, check = answers.changed(answers.solution(exercise), file, (old, new)), file[:-3].replace("_", "-")
    told = Page(exercise).judge(files, check)[check]
    assert (
        f"incompatible, so nothing arrives: the publisher offers {offered}, the subscription asks for {asked}" in told
    )
    assert not [notice for notice in live.live().watch.notices() if "incompatible" in notice]


SHARES = """
    def relay(self, request, response):
        if not self.client.service_is_ready():
            response.message = 'not there'
            return response
        self.ready.clear()
        a, b = [each.value for each in self.get_parameters(['a', 'b'])]
        self.client.call_async(AddTwoInts.Request(a=a, b=b)).add_done_callback(self.on_answer)
        self.ready.wait(timeout=8)
        return self.answer

    def on_answer(self, future):
        self.answer.success = True
        self.answer.message = f'The sum is {future.result().sum}'
        self.ready.set()


rclpy.init()"""


def test_a_response_that_all_callers_share_is_named(empty):
    before, _, rest = TWO_NODES.decode().partition("\n    def relay(")
    made = "        self.ready, self.answer = threading.Event(), Trigger.Response()\n        self.client ="
    program = before.replace("        self.client =", made) + SHARES + rest.partition("\nrclpy.init()")[2]
    said = Page("services").judge(answers.solution("services") | {"relay.py": program.encode()}, "relay")["relay"]
    assert "That is the answer to another caller" in said
    assert "\n    return self.answer\nAll calls share `self.answer`: " in said


def test_an_agent_may_print_without_ending_its_line(empty):
    first = "front, right = distances['front'], distances['right']"
    files = answers.changed(
        answers.solution("ai_integration"), "wall_agent.py", (first, f"print(self.state, end=' ')\n        {first}")
    )
    assert Page("ai_integration").judge(files, "wall-agent")["wall-agent"] == cells.PASSED


def test_an_agent_that_changes_the_dict_that_it_is_given_is_told(empty, capfd):
    """It passes, since a node may give it a copy; one that does not ends at its second decision on one scan."""
    takes = ("distances['front'], ", "distances.pop('front'), ")
    files = answers.changed(answers.solution("ai_integration"), "wall_agent.py", takes)
    page = Page("ai_integration")
    assert page.judge(files, "wall-agent")["wall-agent"] == cells.PASSED
    said = capfd.readouterr().err
    assert "{'front': 0.4, 'right': 0.6} was {'right': 0.6} after the decision, and asked again with this dict " in said
    assert "it gave KeyError('front')" in said and said.count("note:") == 1
    said = page.check("wall-follower")
    assert "\n    front, right = distances.pop('front'), distances['right']" in said and "Hint: `pop` takes" in said


def test_an_agent_may_fill_the_same_dict_for_each_answer(empty):
    files = answers.solution("ai_integration")
    text = (
        files["wall_agent.py"]
        .decode()
        .replace("    def __init__(self):\n", "    def __init__(self):\n        self.action = {}\n")
    )
    one = re.sub(r"return ({'linear'.*})", r"self.action.update(\1); return self.action", text)
    assert one.count("self.action.update(") == 3
    page = Page("ai_integration")
    assert page.judge({**files, "wall_agent.py": one.encode()}, "wall-agent")["wall-agent"] == cells.PASSED


@pytest.mark.parametrize("exercise", ["actions", "ai_integration", "calculator", "parameters", "services"])
def test_a_check_changes_no_name_of_the_page(exercise):
    """Whoever goes back to a cell after a check finds what that cell needs: `scan` is the page's scan."""
    page = [cell for cell in cells.read(NOTEBOOKS / exercise / f"{exercise}.ipynb") if cell.kind == "code"]
    others = [names_of(cell.source) for cell in page if not cell.public_check]
    for cell in page:
        if cell.public_check:
            plain = SHELL.sub("", cell.source)
            imports = (node for node in ast.walk(ast.parse(plain)) if isinstance(node, (ast.Import, ast.ImportFrom)))
            imported = {alias.asname or alias.name for node in imports for alias in node.names}
            for name in names_of(cell.source).made - imported:
                made = any(name in each.made for each in others)
                assert not (made and any(name in each.used - each.made for each in others)), (cell.name, name)


@pytest.mark.parametrize("exercise", ["actions", "ai_integration", "calculator", "parameters", "services"])
def test_a_check_uses_no_name_of_the_page_but_that_of_the_session(exercise):
    """A reader may have changed or deleted a class of the page: the check judges the exercise, and not that class."""
    for cell in cells.read(NOTEBOOKS / exercise / f"{exercise}.ipynb"):
        if cell.public_check:
            assert names_of(SHELL.sub("", cell.source)).used <= {SESSION}, cell.name


BLOCKS = (
    ("# here: which group?", "group = ReentrantCallbackGroup()"),
    ('"held_sum")', '"held_sum", callback_group=group)'),
    ("self.sum_twice)", "self.sum_twice, callback_group=group)"),
    ("# here: ask twice, and count who waits", "response.sum = self.client.call(request).sum"),
)


AWAITS_IN_THE_DEFAULT_GROUP = (
    ("def sum_twice", "async def sum_twice"),
    (BLOCKS[-1][0], "response.sum = (await self.client.call_async(request)).sum"),
)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (BLOCKS, "in sum_twice\n    response.sum = self.client.call(request).sum"),
        each_night(AWAITS_IN_THE_DEFAULT_GROUP, "Give the client a group of its own: "),
        ((*AWAITS_IN_THE_DEFAULT_GROUP, *BLOCKS[:2]), "\nThe callback group of /sum_twice, "),
    ],
)
def test_a_task_on_the_page_names_what_makes_others_wait(empty, capfd, changes, says):
    page = nbformat.read(NOTEBOOKS / "services" / "services.ipynb", 4)
    known = {cell["id"]: cell["source"] for cell in page.cells}
    held = next(text for text in known.values() if "class Held(" in text)
    stub = known["twice-stub"]
    for old, new in changes:
        assert old in stub
        stub = stub.replace(old, new)
    names: dict[str, object] = {"ros": live.live()}
    imports = (
        "import queue, threading\nfrom example_interfaces.srv import AddTwoInts\nfrom rclpy.node import Node\n"
        "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom std_srvs.srv import Trigger\n"
        "from course.nodes.add_two_ints_server import AddTwoIntsServer\n"
    )
    for number, text in enumerate((imports, held, stub, known["twice-check"])):
        name = f"/tmp/ipykernel_1/{number}.py"
        linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
        exec(compile(text, name, "exec"), names)
    told = capfd.readouterr().out
    assert "/held_sum must be asked twice, and was asked 1 times\n" in told
    assert says in told


OF_STORED = """        new = {name: self.get_parameter(name).value for name in ("low", "full")}
        new.update((each.name, each.value) for each in parameters)
        if new["low"] <= new["full"] - 10.0:
            return SetParametersResult(successful=True)
        return SetParametersResult(successful=False, reason="too near")
"""
KEEPS_REFUSED = OF_STORED.replace(
    'new = {name: self.get_parameter(name).value for name in ("low", "full")}',
    "new = self.__dict__.setdefault('new', {'low': 20.0, 'full': 80.0})",
)


@pytest.mark.matrix  # only a live node shows what is stored
@pytest.mark.parametrize(
    ("body", "says"),
    [
        (OF_STORED, "Battery: as asked\n"),
        (KEEPS_REFUSED, "{'low': 10.0} must be accepted and is not: too near\nStored now: low=10.0 full=20.0\n"),
        (
            KEEPS_REFUSED.replace("each in parameters", "each in parameters if each.name == 'low'").replace(
                "        if new", "        new['full'] = dict((p.name, p.value) for p in parameters).get('full', "
                "self.get_parameter('full').value)\n        if new"
            ),
            "{'full': 20.0} must be accepted and is not: too near\nStored now: low=10.0 full=20.0\n",
        ),
    ],
)  # fmt: skip
def test_the_first_task_of_parameters_sees_refused_values_that_are_kept(empty, capsys, body, says):
    page = nbformat.read(NOTEBOOKS / "parameters" / "parameters.ipynb", 4)
    known = {cell["id"]: cell["source"] for cell in page.cells}
    head, _, _ = known["battery-stub"].partition("        # here: ")
    names: dict[str, object] = {"ros": live.live()}
    imports = (
        "import math\nfrom rcl_interfaces.msg import SetParametersResult\nfrom rclpy.node import Node\n"
        "from rcl_interfaces.srv import SetParametersAtomically\nfrom rclpy.parameter import Parameter\n"
    )
    exec(imports + head + body + known["battery-check"], names)
    assert capsys.readouterr().out == says


ANGLES = "    angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))\n"
BY_DEGREES = f"{ANGLES}    degrees = np.degrees(angles) % 360\n"
BEHIND = "    behind = (degrees >= 150) & (degrees <= 210)\n"
USABLE = "    usable = (ranges >= scan.range_min) & (ranges <= scan.range_max)\n"


@pytest.mark.parametrize(
    ("body", "says"),
    [
        (BY_DEGREES + BEHIND + USABLE, "rear: as asked"),
        (
            f"{ANGLES}    behind = np.abs(np.degrees(angles)) >= 150\n{USABLE}",
            "360 beams from the front: the distance must be 1.5, and is 1.0",
        ),
        (
            f"{ANGLES}    degrees = np.degrees(angles)\n    behind = (degrees >= 150) | (degrees <= -150)\n{USABLE}",
            "360 beams from the front: the distance must be 1.5, and is 1.0",
        ),
        (
            f"{BY_DEGREES}{BEHIND}    usable = ranges >= scan.range_min\n",
            "too far to be measured: the distance must be inf, and is 9.5",
        ),
        (
            f"{BY_DEGREES}{BEHIND}    usable = ranges <= scan.range_max\n",
            "too near to be measured: the distance must be inf, and is 0.05000000074505806",
        ),
    ],
)
def test_the_first_task_of_the_robot_sees_the_whole_circle_and_both_ends_of_the_range(capsys, body, says):
    page = nbformat.read(NOTEBOOKS / "ai_integration" / "ai_integration.ipynb", 4)
    known = {cell["id"]: cell["source"] for cell in page.cells}
    head, _, _ = known["rear-stub"].partition("    # here: ")
    imports = "import math\nimport numpy as np\nfrom sensor_msgs.msg import LaserScan\n"
    last = "    return float(ranges[behind & usable].min(initial=np.inf))\n"
    exec(imports + head + body + last + known["rear-check"], {})
    solution = known["rear-answer"].partition("```python\n")[2].partition("```")[0]
    exec(imports + solution + known["rear-check"], {})
    assert capsys.readouterr().out == f"{says}\nrear: as asked\n"
