"""Hints on values in the place of callbacks, and on calls of rclpy with the name of a similar one in mind."""

import pytest

from course.explaining.failure_report import of_program
from course.explaining.hints import hint

GIVES = """class Lift(Node):
    floors = 0
    def __init__(self, top):
        self.blocked = {value}
        self.create_service(SetBool, 'lift/block', self.{given})
        ActionServer(self, Lift, 'lift', self.execute, goal_callback={goal})
    def block(self, request, response):
        self.blocked = request.data
        return response
def main():
    executor = MultiThreadedExecutor()
    {spins}
main()
"""
ACCEPTS = "lambda goal: GoalResponse.ACCEPT"
TRACEBACK = """Traceback (most recent call last):
  File "{path}", line 13, in <module>
    main()
  File "{path}", line 12, in main
    {spins}
  File "/usr/lib/python3/dist-packages/rclpy/executors.py", line 320, in spin
    self.spin_once()
TypeError: '{kind}' object is not callable
"""
NO_BLAME = "What is called here is not a function. Pass a callback by its name, without brackets: `self.add`."


@pytest.mark.parametrize("spins", ["executor.spin()", "rclpy.spin(node)", "while rclpy.ok(): rclpy.spin_once(node)"])
@pytest.mark.parametrize(
    ("kind", "value", "given", "goal", "line", "says"),
    [
        ("bool", "False", "blocked", ACCEPTS, 5,
         "Line 5 gives `self.blocked`, a bool, as a callback, which must be a function. Is `self.block` meant?"),
        ("int", "False", "floors", ACCEPTS, 5, "`self.floors`, an int, as a callback, which must be a function. Give"),
        ("int", "top", "blocked", ACCEPTS, 0, NO_BLAME),
        ("int", "False", "blocked", ACCEPTS, 0, NO_BLAME),
        ("GoalResponse", "False", "block", "GoalResponse.ACCEPT", 6,
         "`goal_callback` takes a function that returns the GoalResponse: `goal_callback=lambda goal: GoalResponse"),
    ],
)  # fmt: skip
def test_a_value_for_a_callback_is_told_with_its_line(tmp_path, spins, kind, value, given, goal, line, says):
    path, text = tmp_path / "lift.py", GIVES.format(value=value, given=given, goal=goal, spins=spins)
    path.write_text(text)
    report = of_program(path, TRACEBACK.format(path=path, spins=spins, kind=kind), 1)
    assert says in report.hint
    assert [each.line for each in report.frames if "spin" not in each.code] == [line] * bool(line)
    assert says in hint(f"TypeError: '{kind}' object is not callable", text)


def test_a_value_for_a_callback_is_not_told_of_an_error_elsewhere():
    text = GIVES.format(value="False", given="blocked", goal=ACCEPTS, spins="executor.spin()")
    told = hint("TypeError: 'bool' object is not callable", text, "if self.open():")
    assert told == "`self.open` is a bool here, not a function: leave out the brackets after it."
    told = hint("TypeError: 'GoalResponse' object is not callable", text, "return GoalResponse.ACCEPT()")
    assert (
        told == "`GoalResponse.ACCEPT` and `GoalResponse.REJECT` are not functions: leave out the brackets after them."
    )


A_RANGE = (
    "AssertionError: The 'floating_point_range' field must be a set or sequence with length <= 1 and each value of "
    "type 'FloatingPointRange'"
)
UNDECLARED = "rclpy.exceptions.ParameterNotDeclaredException: Invalid access to undeclared parameter(s): k"
OF_A_LIST = "AttributeError: 'list' object has no attribute 'value'"
TAKES_A_LIST = "`get_parameters` takes a list of names and returns a list. For one parameter, write `{}`."
PUBLISHES = (
    "class A(Node):\n    def __init__(self):\n        self.create_publisher(Float64, 'a', {}, 10)\n    def hear(self):"
)
MISSING = "TypeError: Executor.add_node() missing 1 required positional argument: 'node'"
AS_ONE = "`floating_point_range=[FloatingPointRange(from_value=..., to_value=...)]`."


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (A_RANGE, "D(floating_point_range=[0.0, most])", "", AS_ONE),
        (A_RANGE, "D(floating_point_range=(0.0, most))", "", AS_ONE),
        (A_RANGE, "D(\n    floating_point_range=[FloatingPointRange])", "D(", AS_ONE),
        (A_RANGE, "d.floating_point_range = [R(to_value=1.0), R()]", "", AS_ONE),
        (A_RANGE, "D(floating_point_range=limits)", "", "`floating_point_range=[...]`."),
        ("AssertionError: The 'floors' field must be a set or sequence and each value of type 'int'",
         "Goal(floors=['a'])", "", ""),
        (UNDECLARED, "self.declare_parameter('kp', 1.0)", "self.kp = self.get_parameters('kp').value",
         TAKES_A_LIST.format("self.get_parameter('kp').value")),
        (OF_A_LIST, "", "a = self.get_parameters('a').value", TAKES_A_LIST.format("self.get_parameter('a').value")),
        (OF_A_LIST, "", "a = self.get_parameters(['a']).value", TAKES_A_LIST.format("self.get_parameter('a').value")),
        (OF_A_LIST, "", "a = self.get_parameters(['a', 'b'])[0].value", ""),
        (UNDECLARED, "", "a = self.get_parameter('k').value", "self.declare_parameter('k', default)"),
        ("TypeError: Node.create_publisher() takes 4 positional arguments but 5 were given",
         f"{PUBLISHES.format('self.hear')} pass", "", "A publisher has no callback: `create_publisher("),
        ("TypeError: Node.create_publisher() takes 4 positional arguments but 5 were given",
         f"{PUBLISHES.format('10')} pass", "", "`create_publisher` takes its further arguments by name"),
        ("TypeError: Node.create_publisher() got an unexpected keyword argument 'callback'", "", "",
         "A publisher has no callback"),
        ("ValueError: Logger severity cannot be changed between calls.", "", "log('done')",
         "A logging call must keep the severity of its first message, and this one has changed it."),
        ("TypeError: Node.get_logger() takes 1 positional argument but 2 were given", "", "self.get_logger(f'{a}')",
         "`get_logger()` takes no text. A method of the logger logs one: `self.get_logger().info('...')`."),
        (MISSING, "executor = MultiThreadedExecutor\nexecutor.add_node(node)", "executor.add_node(node)",
         "Line 1, `executor = MultiThreadedExecutor`, keeps the class itself. Create one with brackets: `Multi"),
        (MISSING, "executor = MultiThreadedExecutor()\nexecutor.add_node()", "executor.add_node()", ""),
        ("AttributeError: 'str' object has no attribute '_executor_event'", "class A(Node):\n    timers = ['a']\n", "",
         "Line 2: `timers` hides rclpy's own `timers` of a node"),
    ],
)  # fmt: skip
def test_a_call_with_another_one_in_mind_is_told(error, text, code, says):
    told = hint(error, text, code)
    assert says in told and bool(says) == bool(told), told
