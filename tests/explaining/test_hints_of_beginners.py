"""Hints on errors that a class of beginners makes often: each is told what to write, and nothing right is."""

import pytest

from course.explaining.hints import hint

PRE = """class A(Node):
    def __init__(self):
        self.create_timer(0.1, lambda event: self.tick())
        self.create_subscription(Scan, 'scan', lambda: self.tick(), 10)
        self.create_service(Add, 'add', lambda request, response: response)
"""
SCAN = """def nearest(scan):
    return min(scan.ranges)
class WallFollower(Node):
    def laser_callback(self, msg):
        self.distances = self.nearest(msg)
"""
CLIENT = """class Client(Node):
    def __init__(self):
        self.{} = self.create_client(Add, 'add')
    def call(self, a):
        pass
def main():
    node = Client()
    node.destroy_node()
    node.call(1)
"""
DESTROYS = "self.destroy_client(self.client)\nnode.destroy_node()\n"
ADD = "from example_interfaces.srv import AddTwoInts"
FIBONACCI = "from example_interfaces.action import Fibonacci"
TIMES = "TypeError: unsupported operand type(s) for -: 'Time' and 'Time'"
VALUE = "TypeError: unsupported operand type(s) for *: 'ParameterValue' and 'float'"
NO_SUCCESS = "AttributeError: 'Trigger_Request' object has no attribute 'success'"
UNDECLARED = "rclpy.exceptions.ParameterNotDeclaredException: ('Invalid access to undeclared parameter(s)', []): Kp"
REQUEST_MADE = """from std_srvs.srv import Trigger
class A(Node):
    def __init__(self):
        self.create_service(Trigger, 'a', self.answer)
    def answer(self, request, response):
        response = Trigger.Request()
"""
NOTHING = "TypeError: 'NoneType' object is not subscriptable"
FIRST = "class A(Node):\n    def __init__(self):\n        self.far = None"
UNNAMED = "TypeError: Node.__init__() missing 1 required positional argument: 'node_name'"
STRING = "AssertionError: The 'message' field must be of type 'str'"
NOT_A_METHOD = "AttributeError: 'WallFollower' object has no attribute 'nearest'"
DESTROYED = "rclpy._rclpy_pybind11.InvalidHandle: cannot use Destroyable because destruction was requested"


NO_GAIN = "AttributeError: 'Pid' object has no attribute 'kp'. Did you mean: 'ki'?"
SET_LATER = """class Pid(Node):
    def __init__(self):
        self.add_post_set_parameters_callback(self.changed)
    def changed(self, params):
        self.kp = params[0].value
"""
NO_WORD = "NameError: name 'ON' is not defined"
OF_A_CLASS = """class Motor(Node):
    ON = 'enabled'
    def state(self):
        return ON
"""
NO_PART = "ModuleNotFoundError: No module named 'rclpy.node.Node'; 'rclpy.node' is not a package"


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (
            "TypeError: AddTwoInts_Request.__init__() takes 1 positional argument but 3 were given",
            ADD,
            "",
            "A message takes its fields by name: `AddTwoInts.Request(a=..., b=...)`.",
        ),
        (
            "TypeError: Fibonacci_Goal.__init__() takes 1 positional argument but 2 were given",
            FIBONACCI,
            "",
            "by name: `Fibonacci.Goal(order=...)`.",
        ),
        (
            "TypeError: Mine_Feedback.__init__() takes 1 positional argument but 2 were given",
            "",
            "",
            "by name, `Mine.Feedback(field=...)`: `ros2 interface show`",
        ),
        ("TypeError: Wall_Agent.__init__() takes 1 positional argument but 2 were given", "", "", ""),
        (
            "TypeError: <lambda>() takes 0 positional arguments but 1 was given",
            "",
            "",
            "called with 1 argument but takes none: write a name before its colon, as in `lambda goal_handle: ...`.",
        ),
        (
            "TypeError: <lambda>() missing 1 required positional argument: 'event'",
            PRE.replace("lambda: self", "lambda msg: self"),
            "",
            "Line 3: the `lambda` of `create_timer` must be `lambda: ...`.",
        ),
        (
            "TypeError: <lambda>() takes 0 positional arguments but 1 was given",
            PRE.replace("lambda event", "lambda"),
            "",
            "Line 4: the `lambda` of `create_subscription` must be `lambda msg: ...`.",
        ),
        (
            "TypeError: <lambda>() takes 0 positional arguments but 1 was given",
            "ros.start(A, cancel_callback=lambda: CancelResponse.ACCEPT)",
            "",
            "Line 1: the `lambda` of `cancel_callback` must be `lambda goal_handle: ...`.",
        ),
        ("TypeError: <lambda>() missing 1 required positional argument: 'a'", "sorted(x, key=lambda a: a)", "", ""),
        (
            VALUE,
            "kp = self.get_parameter('kp').get_parameter_value()",
            "",
            "such as `.double_value`. Shorter: `self.get",
        ),
        (VALUE, "", "", "the value is in `.double_value`"),
        (
            "AssertionError: The 'data' field must be of type 'float'",
            "",
            "Float64(data=self.get_parameter('kp').get_parameter_value())",
            "such as `.double_value`",
        ),
        (
            "AssertionError: The 'data' field must be of type 'float'",
            "",
            "Float64(data=self.get_parameter('kp').get_parameter_value().integer_value)",
            "takes a float",
        ),
        (STRING, "def state(self):\n    return ''", "response.message = self.state", "Call it: `self.state()`."),
        (
            NOTHING,
            f"{FIRST}\n    def hear(self, msg):\n        self.far = msg",
            "self.far['front']",
            "until a callback",
        ),
        (
            NOTHING,
            f"{FIRST}\n    def hear(self, msg):\n        far = msg",
            "self.far['front']",
            "nothing in this text sets",
        ),
        (
            NOTHING,
            f"{FIRST}\n    def hear(self, msg):\n        setattr(self, 'far', 1)",
            "self.far['front']",
            "until a",
        ),
        ("TypeError: 'bool' object is not callable", "", "if request.data():", "leave out the brackets after it."),
        (
            NO_SUCCESS,
            REQUEST_MADE,
            "",
            "`response = Trigger.Request()` makes a request. Set the fields of the response that",
        ),
        (
            NO_SUCCESS,
            REQUEST_MADE.replace("Request", "Response"),
            "",
            "The request of Trigger has no fields: `success` is a field of its response.",
        ),
        (UNDECLARED, "self.declare_parameter('kp', 1.0)", "", "No parameter 'Kp' is declared. Did you mean 'kp'?"),
        ("TypeError: 'NoneType' object is not callable", "", "a = self.client()", "check where it gets its value"),
        ("TypeError: 'list' object is not callable", "", "return max(ranges())", "check where it gets its value"),
        (UNNAMED, "class A(Node):\n    def init(self):\n        super().__init__('a')", "", "you have `init`."),
        (
            UNNAMED,
            "class A(Node):\n    def init(self):\n        pass\n    def __init__(self):\n        super()",
            "",
            "Give",
        ),
        (STRING, "@property\ndef state(self):\n    return 1", "response.message = self.state", "takes a string"),
        (STRING, "def state(self):\n    return ''", "response.message = self.status", "takes a string"),
        (TIMES, "", "", "Make it a time of rclpy first: `Time.from_msg(msg.header.stamp)`"),
        ("TypeError: '<' not supported between instances of 'Time' and 'Time'", "", "", "`Time.from_msg("),
        (
            "AttributeError: 'Duration' object has no attribute 'total_seconds'",
            "",
            "",
            "A Duration of rclpy has `.nanoseconds`: its seconds are `.nanoseconds / 1e9`.",
        ),
        ("AttributeError: 'Time' object has no attribute 'sec'", "msg.header.stamp", "", "its seconds are `.nanosec"),
        ("AttributeError: 'Time' object has no attribute 'to_sec'", "msg.header.stamp.to_sec()", "", ""),
        ("AttributeError: 'Time' object has no attribute 'nanoseconds'", "", "", "message, not a Time of rclpy. Make"),
        ("AttributeError: 'Duration' object has no attribute 'speed'", "", "", ""),
        (NOT_A_METHOD, SCAN, "", "(line 1), not a method: call it without `self.`, `nearest(...)`."),
        (NOT_A_METHOD, SCAN.replace("self.nearest", "self.agent.nearest"), "", ""),
        (
            "AttributeError: 'Time' object has no attribute 'handle'",
            "class A(Node):\n    def __init__(self):\n        self._clock = self.get_clock().now()\n",
            "self.create_timer(0.1, self.tick)",
            "Line 3, `self._clock = ...`, overwrites an attribute of rclpy's node",
        ),
        ("AttributeError: 'A' object has no attribute 'handle'", "class A(Node):\n    _clock = 1", "", ""),
        (
            "TypeError: 'Client' object is not callable",
            CLIENT.format("call"),
            "response = node.call(a, b, operation)",
            "`self.call = ...` in line 3 replaces the method `call`: rename one of the two.",
        ),
        ("TypeError: 'Client' object is not callable", CLIENT.format("client"), "node.call(1)", ""),
        (
            DESTROYED,
            CLIENT.format("client"),
            "self.client.call_async()",
            "`node.destroy_node()` in line 8 has already destroyed",
        ),
        (DESTROYED, "", "", ""),
        (DESTROYED, DESTROYS, "self.client.call_async()", "`self.destroy_client(self.client)` in line 1 has already"),
        (DESTROYED, DESTROYS, "self.timer.reset()", ""),
        (
            "TypeError: <lambda>() missing 1 required positional argument: 'event'",
            "self.create_subscription(Scan, 'scan', lambda msg, info: msg, 10)",
            "",
            "",
        ),
        ("TypeError: unsupported operand type(s) for +: 'Time' and 'Time'", "", "", ""),
        (NOT_A_METHOD, f"{SCAN}        self.nearest = nearest(msg)\n", "", "Line 6 sets `self.nearest`, and has not"),
        (NO_GAIN, SET_LATER, "", "Line 5 sets `self.kp` in a callback that is called when a parameter is set, not at"),
        (NO_GAIN, SET_LATER.replace("_post_", "_on_"), "", "Line 5 sets `self.kp`, and has not run yet: give it a fir"),
        (NO_GAIN, SET_LATER.replace("self.kp =", "self.ki ="), "", ""),
        (NO_WORD, OF_A_CLASS, "return ON", "`ON` is set in the class Motor, outside of its methods: write `Motor.ON`."),
        (NO_WORD, OF_A_CLASS.replace("ON =", "ON: str ="), "return ON", "outside of its methods: write `Motor.ON`."),
        (NO_WORD, OF_A_CLASS.replace("    ON", "    OFF"), "return ON", ""),
        ("NameError: name 'this' is not defined", "", "this.on = True", "In Python this is written `self`."),
        (NO_PART, "import rclpy.node.Node\n", "", "of the module rclpy.node: write `from rclpy.node import Node`."),
        (NO_PART.replace("rclpy.node", "time"), "import time.Node\n", "", ""),
        (
            "ModuleNotFoundError: No module named 'time.sleep'; 'time' is not a package",
            "import time.sleep\n",
            "",
            "`sleep` is a part of the module time: write `from time import sleep`.",
        ),
        (
            "ModuleNotFoundError: No module named 'std_msgs.msg.Float64'",
            "import std_msgs.msg.Float64\n",
            "",
            "`Float64` is a part of the module std_msgs.msg: write `from std_msgs.msg import Float64`.",
        ),
    ],
)
def test_a_mistake_of_beginners_is_told_only_where_it_is_certain(error, text, code, says):
    said = hint(error, text, code)
    assert says in said and bool(says) == bool(said), said
