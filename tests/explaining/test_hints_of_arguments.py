"""Hints on arguments that are right in kind elsewhere, and on fields and values of another name."""

import pytest

from course.explaining.hints import hint
from course.session.live import live

CHECKS = """from std_msgs.msg import Float64
from sensor_msgs.msg import LaserScan
class A(Node):
    def __init__(self):
        self.add_on_set_parameters_callback(self.check)
    def check(self, parameters):
        low = parameters["low"]
        {}
    def other(self, parameters):
        high = parameters["high"]
"""
NO_LIST = "TypeError: list indices must be integers or slices, not str"
COUNT = "TypeError: Node.__init__() takes 2 positional arguments but 3 were given"
LOG = "TypeError: rclpy_logging_rcutils_log(): incompatible function arguments."
NO_RESULT = (
    "rclpy.exceptions.InvalidParameterValueException: Invalid parameter value (50.0) for parameter. Reason: Callback "
    "returned an invalid type: threshold"
)
OF_FLOAT = "AttributeError: 'Float64' object has no attribute '{}'"
OF_SCAN = "AttributeError: 'LaserScan' object has no attribute '{}'. Did you mean: 'angle_min'?"
A_DICT = "TypeError: 'dict' object is not callable"
LOOKS = """class A(Node):
    def __init__(self, agent, look=nearest):
        self.agent, self.look = agent, look
    def hear(self, msg):
        self.seen = self.look(msg)
"""
NO_FUTURE = "AttributeError: 'function' object has no attribute 'add_done_callback'"
NO_ORDER = "TypeError: '<=' not supported between instances of 'float' and 'Duration'"
OF_TEXT = (
    "rclpy.exceptions.InvalidParameterTypeException: Trying to set parameter 'beams' to '{}' of type 'STRING', "
    "expecting type '{}': beams"
)
KEYWORD = "TypeError: Node.declare_parameter() got an unexpected keyword argument '{}'"


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (COUNT, "", "super().__init__(self, 'motors')",
         "`super()` passes `self` already: write `super().__init__('motors')`."),
        (COUNT, "", "super().__init__('motors', 'b')", ""),
        (A_DICT, LOOKS, "self.seen = self.look(msg)",
         "It is the argument `look` of `__init__`: if a function is meant, pass the function itself there, by its"),
        (A_DICT, LOOKS.replace("agent, look\n", "agent, {}\n"), "self.seen = self.look(msg)",
         "`self.look` is a dict here, not a function: leave out the brackets after it."),
        (A_DICT, LOOKS.replace("(msg)\n", "(msg)\n        self.look = {}\n"), "self.seen = self.look(msg)",
         "`self.look` is a dict here, not a function: leave out the brackets after it."),
        (LOG, "", "self.get_logger().info(request.data)",
         "A logger takes a text, but `request.data` is not one: write `info(str(request.data))`."),
        (LOG, "", "self.log(request.data)", ""),
        (NO_LIST, CHECKS, 'low = parameters["low"]',
         "`parameters` is a list of Parameters, each with `.name` and `.value`. A dict of them is `{each.name: each"),
        (NO_LIST, CHECKS, 'high = parameters["high"]', ""),
        (NO_RESULT, CHECKS.format("return True"), "self.declare_parameter('threshold', 50.0)",
         "The on-set callback 'check' returns `True` in line 8. It must return `SetParametersResult(successful=...)`"),
        (NO_RESULT, CHECKS.format("pass"), "", "The on-set callback 'check' returns nothing on some path through it."),
        (NO_RESULT, "", "", "An on-set callback must return `SetParametersResult(successful=...)`, on every path"),
        (OF_FLOAT.format("error"), CHECKS, "msg.error", "The message Float64 has the one field data."),
        (OF_FLOAT.format("error"), "", "msg.error", ""),
        (OF_FLOAT.format("data"), CHECKS, "msg.data", ""),
        (OF_SCAN.format("angle_inc"), CHECKS, "scan.angle_inc", "Did you mean `angle_increment`?"),
        (OF_SCAN.format("angle"), CHECKS, "scan.angle", "The message LaserScan has the fields header, angle_min, "),
        (OF_SCAN.format("rnages"), CHECKS, "scan.rnages", "Did you mean `ranges`?"),
        (KEYWORD.format("read_only"), "", "",
         "`read_only` is a field of the descriptor, the third argument: `ParameterDescriptor(read_only=...)`."),
        (KEYWORD.format("descriptio"), "", "", "Did you mean `descriptor=`?"),
        (KEYWORD.format("unit"), "", "", ""),
        ("KeyError: 'front'", "", "front = distances.pop('front')",
         "`pop` takes a value out of the dict, which has it no more the next time. Read it with square brackets: `d"),
        ("KeyError: 'front'", "", "front = distances.pop(name)", ""),
        (NO_FUTURE, "", "print(ros.wait(asker.send_request))",
         "is not called. Call it, and wait for the future that it returns: `ros.wait(asker.send_request(...))`."),
        (NO_FUTURE, "import course\nros = course.live()\nros.nodes()", "look = ros.wait(sends[0])",
         "`ros.wait(...)` takes a future"),
        (OF_TEXT.format("180", "INTEGER"), "", "", "as an integer, and '180' is text: write 180 without quotation"),
        (OF_TEXT.format("2", "DOUBLE"), "", "", "as a double, and '2' is text: write 2.0 without quotation marks."),
        (OF_TEXT.format("2.5", "INTEGER"), "", "", "as an integer, and '2.5' is text: write a whole number."),
        (OF_TEXT.format("True", "BOOL"), "", "", "as a bool, and 'True' is text: write True without quotation marks."),
        (OF_TEXT.format("yes", "BOOL"), "", "", "as a bool, and 'yes' is text: write True or False."),
        (NO_ORDER, "", "return time.time() - self.came <= FRESH",
         "`time.time()` is a number of seconds, and this is compared with a Duration. Write `self.get_clock().now()`"),
        (NO_ORDER, "self.age = time.monotonic() - came", "return self.age <= FRESH", "`time.monotonic()` is a number"),
        (NO_ORDER, "", "return age.nanoseconds / 1e9 <= FRESH", "compared with a Duration: leave it out, and what "),
        (NO_ORDER, "start = time.time()", "return 0.5 >= self.get_clock().now() - self.came", "as in `age <= Duration"),
    ],
)  # fmt: skip
def test_an_argument_or_a_field_is_named(error, text, code, says):
    said = hint(error, text, code)
    assert says in said and bool(says) == bool(said), said


SENDS = """class Client(Node):
    def send(self, a):
        {}self.client.call_async(a)
future = asker.send(5)
"""


@pytest.mark.parametrize(
    ("source", "code", "says"),
    [
        (
            SENDS.format(""),
            "print(ros.wait(future).sum)",
            "`send` returns nothing, so `future` is None. End `send` with a",
        ),
        (SENDS.format(""), "ros.wait(asker.send(5))", "`send` returns nothing, so `asker.send(5)` is None."),
        (SENDS.format("return "), "print(ros.wait(future).sum)", "A future is needed"),
    ],
)
def test_a_method_that_gives_no_future_to_wait_for_is_named(source, code, says):
    assert says in hint("AttributeError: 'NoneType' object has no attribute 'add_done_callback'", source, code)


def test_the_name_of_a_node_without_its_quotation_marks():
    session = live()
    try:
        name = session.node.get_name()
        error, code = f"NameError: name '{name}' is not defined", f"set_parameters({name}, max_speed=2.5)"
        assert hint(error, "", code) == f"The name of a node is a text, in quotation marks: `'{name}'`."
        assert hint(error, "rclpy.init()", code) == hint(error, "", f"print({name}.value)") == ""
        assert hint("NameError: name 'other_node' is not defined", "", "set_parameters(other_node, a=2.5)") == ""
    finally:
        session.close()
