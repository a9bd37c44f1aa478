"""Explanations of mistakes, from texts alone: the hints, and reasons why a program may not answer."""

import importlib
import json
import linecache
import os
import subprocess
import sys
import textwrap
from pathlib import Path
from types import SimpleNamespace

import pytest
from rclpy.node import Node

from course.explaining import failure_report, source
from course.explaining.hints import hint
from course.foundation.waiting import wait_until
from course.ros.names import is_hidden
from course.ros.rclpy_internals import NoResult
from course.session.logs import program_logs

SERVER = """
class Server(Node):
    def __init__(self):
        super().__init__('server')
        self.client = self.create_client(AddTwoInts, '/add')
        self.create_service(Trigger, '/ask', self.ask{options})

    {define} ask(self, request, response):
        {body}
        return response
"""


METHOD_ASKED = """class A:
    def ready(self):
        return self.scan
    def go(self):
        self.scan = None
        if self.ready:
            return self.scan['front']
"""
HIDES = "class A:\n    def __init__(self):\n        self.go = True\n    def go(self): pass"
WITH_A_PROPERTY = """class A:
    @property
    def word(self):
        return 'free'
    def message(self):
        response.message = self.word()
"""
MAKES_A_CALLBACK = """class A(Node):
    def __init__(self):
        self.create_service(SetBool, 'enable', self.answer(None))
    def answer(self, change):
        def callback(request, response):
            change(request)
            return response
        return callback
"""
CALLS_ALONE = "class A(Node):\n    def call(self): pass\ndef main():\n    node = A()\n    call(1)"
ENDS_EARLY = "rclpy.init()\nnode = A()\nrclpy.shutdown()\nnode.call()"
READS_EARLY = """def __init__(self):
    self.add_on_set_parameters_callback(self.check)
    self.ki = self.get_parameter('ki').value
    self.declare_parameter('ki', 0.0)
"""
HIDES_TIMERS = "class A(Node):\n    def timers(self): pass"
DECLARES = "self.declare_parameter('output_max', 1.0)"
STATIC = "class P(Node):\n    @staticmethod\n    def clamp(self, value, high): pass"
TWISTS = "from geometry_msgs.msg import Twist, Vector3"
LATER = """def on_scan(self, msg):
    seen = nearest(msg)
    self.latest = seen
def __init__(self):
    self.latest = None
def loop(self):
    seen = self.latest
    print(seen['front'])
"""
UNBOUND = "UnboundLocalError: cannot access local variable"
MARK = "Traceback (most recent call last):"
SETS_AGAIN = """self.add_post_set_parameters_callback(self.after)
def after(self, params):
    self.set_parameters(params)
"""


PUBLISHERS = "AttributeError: 'Pid' object has no attribute 'publisher'. Did you mean: 'publishers'?"


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (
            "TypeError",
            "self.create_service(Add, '/add', self.a)\ndef a(self, request, response):\n    response = Add.Response\n",
            "",
            "`Add.Response` is the class of the response. Create one with brackets: `Add.Response()`.",
        ),
        (
            "AttributeError: 'function' object has no attribute 'accepted'",
            "future = self.client.send_goal_async(goal)\nself.handle = future.result\n",
            "if not self.handle.accepted:",
            "Line 2: `future.result` is the method itself. Call it: `future.result()`.",
        ),
        (
            "AttributeError: 'method' object has no attribute 'sequence'",
            "end = handle.get_result_async()\nprint(end.result.sequence)\nros.stop()\n",
            "print(end.result.sequence)",
            "`handle.get_result_async(...)` returns a future, not the answer: wait for it, as in `ros.wait(...)`.",
        ),
        ("AttributeError: 'function' object has no attribute 'x'", "self.f = f\n", "self.f.x", ""),
        (
            "TypeError",
            "node.create_service(Add, '/add', lambda request, response: self.add)\n",
            "",
            "The callback `lambda request, response: self.add` calls nothing: pass the method itself, `self.add`.",
        ),
        (
            "AttributeError: 'NoneType' object has no attribute 'accepted'",
            "print(client.send_goal_async(goal).result().accepted)\n",
            "print(client.send_goal_async(goal).result().accepted)",
            "The future is not done yet, so its result is None. `ros.wait(future)` waits for it",
        ),
        (
            "AttributeError: 'GoalRecorder' object has no attribute 'add_done_callback'",
            "ros.wait(goal)",
            "",
            "A recorder is not a future: its `wait_end()` waits for the end of its goal.",
        ),
        ("NameError: name 'ros' is not defined", "class Robot(Node):\n    x = ros\n", "", ""),
        (
            "RuntimeError: asyncio.run() cannot be called from a running event loop",
            "asyncio.run(ask())",
            "asyncio.run(ask())",
            "In a notebook, write `await` itself in the cell.",
        ),
        (
            "TypeError: 'NoneType' object is not subscriptable",
            "def nearest(scan):\n    found = {}\nself.distances = None\nself.distances = nearest(msg)\n",
            "self.agent.decide(self.distances)",
            "Line 4: `nearest` returns nothing, so `self.distances` is None. End `nearest` with a `return`.",
        ),
        (
            "AttributeError: 'Add_Response' object has no attribute 'add_done_callback'",
            "ros.wait(ros.call('/add', Add))",
            "",
            "`ros.wait(...)` takes a future, such as that of `client.call_async(...)`, and gets the response of Add.",
        ),
        (
            "TypeError: Agent.decide() missing 1 required positional argument: 'seen'",
            "class Agent:\n    def decide(self, seen):\n        return seen\nself.agent = Agent\n",
            "self.agent.decide(1)",
            "an object: line 4 has `Agent` without brackets. Write `Agent()` there.",
        ),
        (
            "TypeError: 'float' object is not callable",
            "min = 0.5\ndef f(x):\n    return min(x)\n",
            "return min(x)",
            "Line 1, `min = 0.5`, overwrites `min`, a function of Python itself: choose another name there.",
        ),
        (
            "TypeError: 'CancelResponse' object is not callable",
            "",
            "",
            "`cancel_callback` takes a function that returns the CancelResponse: `cancel_callback=lambda goal_handle: ",
        ),
        (
            "TypeError: 'GoalResponse' object is not callable",
            "",
            "",
            "`goal_callback` takes a function that returns the GoalResponse: `goal_callback=lambda goal: ",
        ),
        (
            "TypeError: 'GoalResponse' object is not callable",
            "",
            "return GoalResponse.ACCEPT()",
            "`GoalResponse.ACCEPT` and `GoalResponse.REJECT` are not functions: leave out the brackets",
        ),
        ("TypeError: 'int' object is not callable", "", "a = turn(sorted(b))", "`turn` is an int here, not a function"),
        (
            "TypeError: 'int' object is not callable",
            "",
            "",
            "Pass a callback by its name, without brackets: `self.add`.",
        ),
        ("TypeError:", "", "handle.publish_feedback(numbers)", "`publish_feedback` takes a message"),
        (
            "TypeError",
            "",
            "goal_handle.publish_feedback(Lift.Feedback)",
            "`Lift.Feedback` is the class itself. Create one with brackets: `Lift.Feedback(...)`.",
        ),
        (
            "TypeError",
            "request = Add.Request\nfuture = client.call_async(request)",
            "future = client.call_async(request)",
            "`Add.Request` is the class itself.",
        ),
        (
            "AssertionError: The 'result' field must be a sub message of type 'Lift_Result'",
            "def execute(self, handle):\n    return Lift.Result",
            "",
            "Line 2, `return Lift.Result`, returns the class itself. Create a result with brackets: `Lift.Result(...)`",
        ),
        ("TypeError:", "", "client.call_async(5)", "A client sends a request of its own type"),
        ("TypeError:", "", "future = client.send_goal_async(goal)", "A client sends a goal of its own type"),
        ("TypeError:", "", "client.send_goal_async(F2.Goal(order=3))", "`F2.Goal` is not of this client's type"),
        (
            "AssertionError: The 'stops_left' field must be of type 'int'",
            "",
            "Lift.Feedback(floor=1, stops_left=left)",
            "with `int(...)`, and count a list with `len(...)`",
        ),
        (
            "TypeError: '<=' not supported between instances of 'Duration' and 'float'",
            "",
            "return age <= 0.5",
            "`age <= Duration(seconds=0.5)`",
        ),
        (
            "ParameterNotDeclaredException: ('Invalid access to undeclared parameter(s)', [...]): top",
            "self.add_on_set_parameters_callback(self.check)\nself.declare_parameter('top', 1.0)\n",
            "top = self.get_parameter('top').value",
            "Each declaration calls the callback that line 1 registers, also before 'top' is declared.",
        ),
        ("TypeError: The given value is not one of the allowed types '2.0'.", "", "", "convert the value"),
        (
            "RCLError: goal_handle attempted invalid transition from state CANCELED with event SUCCEED",
            "",
            "goal_handle.succeed()",
            "This goal has already ended, as canceled. After `succeed()`",
        ),
        (
            "AttributeError: 'NoneType' object has no attribute 'accepted'",
            "",
            "if not future.result().accepted:",
            "The response is not there yet",
        ),
        ("IndexError: array index out of range", "", "msg.ranges[350]", "Find a beam by its angle"),
        (
            "AssertionError: Invalid arguments passed to constructor: success",
            "from rcl_interfaces.msg import SetParametersResult",
            "return SetParametersResult(success=True)",
            "SetParametersResult has the fields successful, reason. Did you mean `successful`?",
        ),
        (
            "AttributeError: 'Trigger_Response' object has no attribute 'succes'",
            "from std_srvs.srv import SetBool, Trigger",
            "",
            "The response of Trigger has the fields success, message. Did you mean `success`?",
        ),
        (
            "AttributeError: 'AddTwoInts_Response' object has no attribute 'x'",
            "from example_interfaces.srv import (\n    AddTwoInts,\n)",
            "",
            "The response of AddTwoInts has the one field sum.",
        ),
        ("TypeError: 'NoneType' object is not subscriptable", "self.scan = None", "self.scan['front']", "`self.scan`"),
        ("TypeError: 'NoneType' object is not subscriptable", "", "answer['front']", ""),
        (
            "TypeError: 'NoneType' object is not subscriptable",
            METHOD_ASKED,
            "return self.scan['front']",
            "Line 6: `self.ready` is the method itself, which is always true. Call it: `self.ready()`.",
        ),
        (
            "TypeError: Agent.decide() missing 1 required positional argument: 'scan'",
            "class Agent:\n    def decide(self, scan):\n        pass\n",
            "self.agent.decide(self.scan)",
            "`decide` is called on the class Agent, not on an object",
        ),
        (
            "TypeError: Agent.decide() missing 1 required positional argument: 'scan'",
            "class Agent:\n    def decide(self, scan):\n        pass\n",
            "self.agent.decide()",
            "",
        ),
        (
            "rclpy.exceptions.ParameterNotDeclaredException: ('Invalid access to undeclared parameter(s)', []): ki",
            "self.declare_parameter('ki', 1.0)\nself._parameters = {}\n",
            "",
            "Line 2, `self._parameters = ...`, overwrites an attribute of rclpy's node",
        ),
        (
            "RecursionError: maximum recursion depth exceeded",
            SETS_AGAIN,
            "self.set_parameters(params)",
            "Setting a parameter in 'after' calls the parameter callbacks again",
        ),
        ("RecursionError: maximum recursion depth exceeded", "def f():\n    f()\n", "f()", ""),
        (
            "TypeError: type must be an instance of '<enum 'Type'>'",
            "",
            "Parameter('speed', 2.0)",
            "Pass the value by name: `Parameter('x', value=2.0)`.",
        ),
        ("ZeroDivisionError: division by zero", "", "", "Check the divisor before you divide."),
        ("ZeroDivisionError: division by zero", "self.create_service(", "", "`success=False`"),
        ("NameError: name 'count' is not defined", "self.count = 0", "", "`self.count`"),
        ("NameError: name 'cuont' is not defined", "self.count = 0", "", ""),
        (
            "TypeError: A.go() missing 1 required positional argument: 'x'",
            "self.create_timer(1, self.go())",
            "",
            "This line calls `go()`",
        ),
        (
            "TypeError: A.go() takes 1 positional argument but 2 were given",
            "self.create_service(A, '/a', self.go)",
            "",
            "resp",
        ),
        ("TypeError: A.go() takes 1 positional argument but 2 were given", "self.go(1)", "", ""),
        ("TypeError: 'bool' object is not callable", HIDES, "", "the method `go`"),
        ("TypeError: 'str' object is not callable", WITH_A_PROPERTY, "self.word()", "`word` is a property: leave"),
        ("TypeError: 'NoneType' object is not callable", MAKES_A_CALLBACK, "change(request)", "`change` is None here"),
        ("NameError: name 'call' is not defined", CALLS_ALONE, "", "`call` is a method of the node: write `node.call`"),
        ("RCLError: rcl node's context is invalid", ENDS_EARLY, "", "`rclpy.shutdown()` in line 3 has already"),
        ("RCLError: rcl node's context is invalid", "Node('a')", "", "`rclpy.init()` must be called"),
        ("ParameterNotDeclaredException: ('Invalid', []): ki", READS_EARLY, "", "Declare it in `__init__`, before"),
        ("ParameterNotDeclaredException: ('', []): ouput_max", DECLARES, "", "Did you mean 'output_max'?"),
        ("TypeError: P.clamp() missing 1 required positional argument: 'q'", STATIC, "", "`clamp` is static"),
        ("AssertionError: Invalid arguments passed to constructor: w", TWISTS, "Vector3(w=1)", "Vector3 has"),
        (
            "AssertionError: The 'parameters' field must be a set or sequence and each value of type 'Parameter'",
            "",
            "",
            "Each must be the message of a parameter",
        ),
        ("TypeError: 'NoneType' object is not subscriptable", LATER, "print(seen['front'])", "`self.latest` is None"),
        ("IndexError: list index out of range", "ranges = [1.0]", "most = ranges[i]", ""),
        (
            "TypeError: The given value is not one of the allowed types 'rcl_interfaces.msg.ParameterDescriptor()'",
            "",
            "",
            "The default comes before the descriptor",
        ),
        ("TypeError: 'Parameter' object is not subscriptable", "", "p[0]", "A Parameter is an object: its name is"),
        ("TypeError: cannot unpack non-iterable Parameter object", "", "", "A Parameter is an object: its name is"),
        ("TypeError: 'str' object cannot be interpreted as an integer", "", "time.sleep(s)", "Seconds are a number"),
        ("TypeError: 'method' object is not iterable", HIDES_TIMERS, "", "The method `timers`"),
        (f"{UNBOUND} 'x' where", "x = 1\ndef say():\n    if x: x = 2", "if x: x = 2", "begins with `global x`"),
        (f"{UNBOUND} 'x' where", "def f():\n    x = 1\n    def g():\n        x += 1", "x += 1", "with `nonlocal x`"),
        ("TypeError: 'str' object is not callable", "", "sectors = look(scan)", "`look` is a str here, not a fun"),
        ("TypeError: 'NoneType' object is not callable", "", "self.ask(1)", "`self.ask` is None here"),
        ("TypeError: 'bool' object is not callable", HIDES, "self.go()", "the method `go`"),
        ("TypeError: 'int' object is not callable", "", "a(b(1))", "Something that is called in this line is an int"),
        (
            "TypeError: Expected <class 'std_msgs.msg._float64.Float64'>, got <class 'float'>",
            "",
            "",
            "Create a Float64: `Float64(data=...)`",
        ),
        (
            "TypeError: Expected <class 'std_msgs.msg._float64.Float64'>, got <class 'NoneType'>",
            "",
            "",
            "`publish` takes a message of the topic's type, and got None. Create a Float64",
        ),
        ("ImportError: cannot import name 'Triger' from 'std_srvs.srv'", "", "", "Did you mean `Trigger`?"),
        (
            "NotImplementedError: Service classes can not be instantiated",
            "",
            "a = SetBool()",
            "`SetBool.Request()` or `SetBool.Response()`",
        ),
        ("KeyError: 'front'", "", "", ""),
        (
            "TypeError: First element 1.5 at index 0 in parameters list is not a str.",
            "",
            "self.declare_parameter(1.5, 'max_speed')",
            "The name of the parameter comes first, then its default",
        ),
        (
            "TypeError: 'Parameter' object is not iterable",
            "node.set_parameters(Parameter('low', value=2.0))\n",
            "node.set_parameters(Parameter('low', value=2.0))",
            "`set_parameters` takes a list: `set_parameters([Parameter(...)])`.",
        ),
        (
            "TypeError: Parameter.__init__() takes 1 positional argument but 2 were given",
            "from rclpy.parameter import Parameter\nfrom rcl_interfaces.msg import *\n",
            "Parameter('low', value=2.0)",
            "`Parameter` is the message of rcl_interfaces.msg here",
        ),
        (
            "NameError: name 'calculator' is not defined",
            "course.check(calculator-server)\n",
            "course.check(calculator-server)",
            "in quotation marks: `course.check('calculator-server')`.",
        ),
        ("NameError: name 'calculator' is not defined", "", "course.check(name, calculator)", ""),
        ("KeyError: 'full'", "new = {'ful': 1}\nnew['full']", "new['full']", "Compare the spelling with the line"),
        (
            "KeyError: 'full'",
            (
                "self.add_on_set_parameters_callback(self.check)\ndef check(self, params):\n"
                "    new = {each.name: each.value for each in params}\n    if new['full'] < new['low']:\n        pass\n"
            ),
            "if new['full'] < new['low']:",
            "`new` has only the parameters of this request, and 'full' is not among them",
        ),
        (
            "ValueError: zero-size array to reduction operation minimum which has no identity",
            "def nearest(scan):",
            "float(seen.min())",
            "`values.min(initial=np.inf)`",
        ),
        ("ValueError: zero-size array to reduction operation maximum which", "msg.ranges", "", "max(initial=-np.inf)`"),
        ("ValueError: max() iterable argument is empty", "ranges", "max(seen)", "`max(values, default=-math.inf)`"),
        (
            "ValueError: min() arg is an empty sequence",
            "import math\nok = min(goal.floors) >= 0",
            "ok = min(goal.floors) >= 0",
            "The sequence is empty. Check that before you call `min`: what should happen then?",
        ),
        (
            "AssertionError: The 'result' field must be of type 'float'",
            "",
            "response.result = None",
            "None is not a value of a field. A field that nobody sets is `0.0`: leave this out.",
        ),
        (
            "AssertionError: The 'result' field must be of type 'float'",
            "",
            "response.result = value",
            "not a text, an int, a NumPy number or None: convert a number with `float(...)`",
        ),
        (
            "AttributeError: 'method' object has no attribute 'sequence'",
            "end = handle.get_result_async()\nprint(end.result.sequence)\n",
            "print(end.result.sequence)",
            "wait for it, as in `ros.wait(...)`.",
        ),
        (
            "AttributeError: 'method' object has no attribute 'sequence'",
            "import rclpy\nrclpy.init()\nend = handle.get_result_async()\nprint(end.result.sequence)\n",
            "print(end.result.sequence)",
            "spin until it is done",
        ),
        (
            "RuntimeError: Subscription.__init__(): callback should be either be callable with one argument",
            "ros.node.create_subscription(LaserScan, 'scan', scans.append(1), 10)\n",
            "ros.node.create_subscription(LaserScan, 'scan', scans.append(1), 10)",
            (
                "`scans.append(1)` is called at once, and the subscription gets what it returns. Pass the function "
                "itself, `scans.append`, or `lambda msg: scans.append(1)`."
            ),
        ),
        (
            "RuntimeError: Subscription.__init__(): callback should be either be callable with one argument",
            "self.create_subscription(LaserScan, 'scan', self.look, 10)\n",
            "",
            "The callback of a subscription must take the message: `(self, msg)`.",
        ),
        (
            "ModuleNotFoundError: No module named 'example_interfaces.srvs'",
            "from example_interfaces.srvs import AddTwoInts",
            "",
            "write `from example_interfaces.srv import AddTwoInts`",
        ),
        (
            "ImportError: cannot import name 'AddTwoInts' from 'example_interfaces.msg'",
            "",
            "",
            "write `from example_interfaces.srv import AddTwoInts`",
        ),
        (
            "ImportError: cannot import name 'AddTwoInts' from 'example_interfaces'",
            "",
            "",
            "write `from example_interfaces.srv import AddTwoInts`",
        ),
        (
            "ImportError: cannot import name 'Twist' from 'std_msgs.msg'",
            "",
            "",
            "std_msgs has no Twist. It is in geometry_msgs.msg: write `from geometry_msgs.msg import Twist`.",
        ),
        (
            "ModuleNotFoundError: No module named 'std_msgs.srv'",
            "from std_msgs.srv import Trigger",
            "",
            "std_msgs has no Trigger. It is in std_srvs.srv: write `from std_srvs.srv import Trigger`.",
        ),
        (
            "ModuleNotFoundError: No module named 'std_srvs.msg'",
            "import std_srvs.msg",
            "",
            "std_srvs has srv, but no msg",
        ),
        ("ModuleNotFoundError: No module named 'geometry_msg'", "", "", "Did you mean the package geometry_msgs?"),
        ("ModuleNotFoundError: No module named 'other_interfaces'", "", "", "other_interfaces is not built here"),
        (
            "ModuleNotFoundError: No module named 'std_interfaces'",
            "from std_interfaces.srv import SetBool",
            "",
            "There is no package std_interfaces: did you mean `std_srvs` or `std_msgs`?",
        ),
        (
            "ModuleNotFoundError: No module named 'geometry_interfaces'",
            "",
            "",
            "There is no package geometry_interfaces: did you mean `geometry_msgs`?",
        ),
        ("ModuleNotFoundError: No module named 'numpi'", "import numpi", "", ""),
        ("EOFError: EOF when reading a line", "", "", "not with `input()`"),
        (
            "AttributeError: 'Future' object has no attribute 'accepted'",
            "handle = client.send_goal_async(goal)\nhandle.accepted\nros.wait(handle)",
            "handle.accepted",
            "as in `ros.wait(future)`",
        ),
        (
            "AttributeError: 'Future' object has no attribute 'accepted'",
            "def answered():\n    handle.accepted\nros.start(A)",
            "handle.accepted",
            "`rclpy.spin_until_future_complete(node, future)`",
        ),
        (
            "AttributeError: 'Future' object has no attribute 'get_result_async'",
            "sent.add_done_callback(self.answered)\ndef answered(self, future):\n    future.get_result_async()\n",
            "future.get_result_async()",
            "A done callback gets the future, not the answer: take that first, `future.result().get_result_async`.",
        ),
        (
            "AttributeError: 'Future' object has no attribute 'accepted'",
            "sent.add_done_callback(lambda sent: print(sent.accepted))\n",
            "sent.add_done_callback(lambda sent: print(sent.accepted))",
            "take that first, `sent.result().accepted`.",
        ),
        (
            "AttributeError: 'Fibonacci_Goal' object has no attribute 'request'",
            "",
            "if goal_handle.request.order < 10:",
            "A goal callback gets the goal itself, not a goal handle: its fields are read without `.request`.",
        ),
        (
            "AttributeError: 'Lift_GetResult_Response' object has no attribute 'accepted'",
            "client.send_goal_async(goal)",
            "",
            "`accepted` belongs to the goal handle",
        ),
        (
            "AttributeError: 'Lift_GetResult_Response' object has no attribute 'resutl'",
            "",
            "",
            "Did you mean `result`?",
        ),
        (
            "AttributeError: 'Lift_GetResult_Response' object has no attribute 'stop'",
            "from course_interfaces.action import Lift",
            "",
            "and the result of Lift has the fields stops, floor. Did you mean `stops`?",
        ),
        ("AttributeError: 'Lift_FeedbackMessage' object has no attribute 'floor'", "", "", "write `.feedback.floor`"),
        ("AttributeError: property 'speed' of 'Motor' object has no setter", "", "", ""),
        (
            "AttributeError: handle cannot be modified after node creation",
            "",
            "",
            "Node already has an attribute `handle`",
        ),
        (
            "UnboundLocalError: cannot access local variable 'on' where it is not associated with a value",
            "class A:\n    def power(self):\n        on = not on",
            "",
            "",
        ),
        (
            "TypeError: 'NoneType' object does not support the context manager protocol",
            "with rclpy.init() as context:\n    pass",
            "",
            "in ROS 2 Jazzy, `rclpy.init()` returns nothing",
        ),
        (
            "TypeError: 'NoneType' object does not support the context manager protocol",
            "rclpy.init()\nwith lock:\n    pass",
            "",
            "",
        ),
        ("TypeError: Relay() takes no arguments", "class Relay:\n    def _init_(self): pass", "", "you have `_init_`"),
        ("TypeError: Relay() takes no arguments", "class Relay:\n    pass", "", ""),
        (
            "UnboundLocalError: cannot access local variable 'high' where it is not associated with a value",
            "def __init__(self):\n    high = 1\ndef check(self, params):\n    for each in params:\n        high = each",
            "return high",
            "No line that sets `high` in this function has run yet: give it a value at the beginning.",
        ),
        (
            "UnboundLocalError: cannot access local variable 'stopped' where it is not associated with a value",
            "class A:\n def __init__(self):\n  self.stopped = 0\n def a(self):\n  if a: stopped = 1\n  return stopped",
            "return stopped",
            "`stopped` is a variable of this function alone, and no line has set it yet. If the node's is meant, write",
        ),
        (
            "AssertionError: The 'success' field must be of type 'bool'",
            "",
            "response.success = 'False'",
            "The field 'success' takes True or False, without quotation marks; a comparison such as `count > 0`",
        ),
        (
            "NameError: name 'state' is not defined. Did you mean: 'State'?",
            "class State(Enum):\n LOOKING = 1\nclass Agent:\n state = 0\n def a(self): self.state = state.LOOKING",
            "self.state = state.LOOKING",
            "The class is called `State`: write `State.LOOKING`.",
        ),
        (
            "NameError: name 'state' is not defined",
            "class Agent:\n    def __init__(self):\n        self.state = 1\n    def turn(self):\n        return state",
            "return state",
            "An attribute needs `self.`: write `self.state`.",
        ),
        (
            "AttributeError: module 'rclpy' has no attribute 'Node'. Did you mean: 'node'?",
            "import rclpy\nclass A(rclpy.Node): pass",
            "class A(rclpy.Node): pass",
            "Node is in rclpy.node: write `from rclpy.node import Node`.",
        ),
        (
            "ImportError: cannot import name 'ActionServer' from 'rclpy' (/rclpy/__init__.py)",
            "from rclpy import ActionServer",
            "from rclpy import ActionServer",
            "ActionServer is in rclpy.action: write `from rclpy.action import ActionServer`.",
        ),
        (
            "UnboundLocalError: cannot access local variable 'sum' where it is not associated with a value",
            "class A:\n def __init__(self):\n  self.sum = 0.0\n def hear(self, msg):\n  sum += msg.data",
            "sum += msg.data",
            "`sum` is a variable of this function alone, and no line has set it yet. If the node's is meant, write",
        ),
        (
            "TypeError: Node.create_subscription() missing 1 required positional argument: 'qos_profile'",
            "",
            "self.create_subscription(Float64, 'error', self.hear)",
            "The last argument is the length of the queue, usually 10: `create_subscription(..., 10)`.",
        ),
        (
            "IndexError: array index out of range",
            "for i in range(len(scan.ranges)):\n    scan.ranges[i] - scan.ranges[i + 1]",
            "scan.ranges[i] - scan.ranges[i + 1]",
            "The last index is one less than the length",
        ),
        (
            "TypeError: Node.__init__() missing 1 required positional argument: 'node_name'",
            "class Relay(Node):\n    def _init_(self): pass",
            "",
            "you have `_init_`",
        ),
        (
            "TypeError: Node.__init__() missing 1 required positional argument: 'node_name'",
            "class Relay(Node):\n    def __init__(self): super().__init__()",
            "",
            "Give the node a name",
        ),
        (
            "NameError: name 'calculate' is not defined. Did you mean: 'Calculate'?",
            "class Server(Node):\n    def calculate(self): pass",
            "",
            "write `self.calculate`",
        ),
        (
            "AttributeError: type object 'str' has no attribute '_TYPE_SUPPORT' This might be a ROS 1 message type",
            "self.create_service('/ask', Trigger, self.ask)",
            "",
            "The arguments of `create_service` are in the wrong order",
        ),
        (
            "TypeError: __init__(): incompatible constructor arguments.",
            "self.create_service(Trigger, self.ask, '/ask')",
            "",
            "`create_service(TheType, '/name', self.callback)`",
        ),
        (
            "TypeError: Expected QoSProfile or int, but received <class 'method'>",
            "self.create_subscription(String, 'topic', 10, self.hear)",
            "",
            "`create_subscription(TheType, 'topic', self.callback, 10)`",
        ),
        ("AttributeError: type object 'int' has no attribute '_TYPE_SUPPORT'", "create_service(5, '/ask', f)", "", ""),
        (
            "RuntimeError: The service type provided is not valid (<class 'std_msgs.msg._string.String'>), this",
            "",
            "",
            "std_msgs/msg/String is a message: use `create_publisher` for it",
        ),
        (
            "RCLError: create_publisher() called for existing topic name rt/chatter with incompatible type std_msgs",
            "",
            "",
            "/chatter already has another",
        ),
        ("TypeError: spin() missing 1 required positional argument: 'node'", "", "", "`rclpy.spin(node)`"),
        (
            "TypeError: Node.create_service() takes 4 positional arguments but 5 were given",
            "self.busy = ReentrantCallbackGroup()\nself.create_service(Add, '/add', self.add, self.busy)",
            "",
            "`create_service` takes a callback group by name: write `callback_group=self.busy`.",
        ),
        (
            "TypeError: Node.create_client() takes 3 positional arguments but 4 were given",
            "self.create_client(Add, '/add', ReentrantCallbackGroup())",
            "",
            "`create_client` takes a callback group by name: write `callback_group=ReentrantCallbackGroup()`.",
        ),
        (
            "TypeError: Node.create_subscription() takes 5 positional arguments but 6 were given",
            "self.create_subscription(Scan, 'scan', self.see, 10, True)",
            "",
            "`create_subscription` takes its further arguments by name",
        ),
        (
            "AttributeError: 'ServerGoalHandle' object has no attribute 'cancel'",
            "",
            "goal_handle.cancel()",
            "A server ends a goal that was cancelled with `goal_handle.canceled()`.",
        ),
        (
            "AttributeError: 'Motor' object has no attribute 'status'. Did you mean: 'state'?",
            "class Motor(Node):\n    def state(self):\n        self.status()\n\ndef status(self):\n    pass",
            "",
            "`def status(self, ...)` in line 5 stands outside of the class: indent it as the methods of Motor.",
        ),
        (
            "AttributeError: 'Motor' object has no attribute 'status'",
            "class Motor(Node):\n    def state(self):\n        def status(self):\n            return 1",
            "",
            "`def status(self, ...)` in line 3 stands inside of `state`",
        ),
        (
            "AttributeError: 'Other' object has no attribute 'status'",
            "class Motor(Node):\n    def status(self):\n        pass\n\ndef status(self):\n    pass",
            "",
            "",
        ),
        (
            "TypeError: Motor.status() missing 2 required positional arguments: 'request' and 'response'",
            "self.create_service(Trigger, 'status', self.status)\nresponse.message = self.status()",
            "response.message = self.status()",
            "This line calls the callback `status` itself. ROS 2 calls it, and passes `request, response` to it.",
        ),
        (
            "TypeError: Motor.status() missing 1 required positional argument: 'response'",
            "self.create_service(Trigger, 'status', self.status)",
            "rclpy.spin(node)",
            "`create_service` calls `status`, which must take (self, request, response).",
        ),
        (
            PUBLISHERS,
            "class Pid(Node):\n    def f(self):\n        self.create_publisher(Float64, 'effort', 10)",
            "self.publisher.publish(Float64())",
            "Line 3 keeps the publisher under no name: write `self.publisher = self.create_publisher(...)`.",
        ),
        (
            PUBLISHERS,
            "class Pid(Node):\n    def f(self):\n        self.pub = self.create_publisher(Float64, 'effort', 10)",
            "self.publisher.publish(Float64())",
            "Line 3 keeps the publisher in `self.pub`: use that name here, too. (`publishers`, which Python proposes,",
        ),
        (
            "AttributeError: 'Relay' object has no attribute 'client'",
            "class Relay(Node):\n    def f(self):\n        client = self.create_client(AddTwoInts, 'add_two_ints')",
            "future = self.client.call_async(request)",
            "`client`",
        ),
        (
            "AttributeError: 'Relay' object has no attribute 'answers'",
            "class Relay(Node):\n    def f(self):\n        self.client = self.create_client(AddTwoInts, 'a')",
            "self.answers.append(3)",
            "",
        ),
        (
            "UnboundLocalError: cannot access local variable 'ki' where it is not associated with a value",
            "class Pid(Node):\n    def f(self):\n        self.ki = 0.0\n        ki = self.get_parameter(ki).value",
            "ki = self.get_parameter(ki).value",
            "The name of a parameter is a text: `get_parameter('ki')`.",
        ),
        (
            "NameError: name 'kp' is not defined. Did you mean: 'p'?",
            "p = self.get_parameter(kp).value",
            "p = self.get_parameter(kp).value",
            "The name of a parameter is a text: `get_parameter('kp')`.",
        ),
        (
            "NameError: name 'front' is not defined. Did you mean: 'print'?",
            "def decide_action(distances):\n    if distances[front] < 0.5:\n        pass",
            "if distances[front] < 0.5:",
            "A key that is a text stands in quotation marks: `distances['front']`.",
        ),
        ("NameError: name 'i' is not defined", "print(ranges[i])", "print(ranges[i])", ""),
        (
            "NameError: name 'place' is not defined",
            "def f():\n    place = 3\ndef g():\n    print(ranges[place])",
            "print(ranges[place])",
            "",
        ),
        (
            "ParameterNotDeclaredException: Invalid access to undeclared parameter(s): 0.0",
            "",
            "ki = self.get_parameter(self.ki).value",
            "takes the name of a parameter, a text, and `self.ki` is 0.0 here: write `get_parameter('ki')`.",
        ),
        (
            "NameError: name 'np' is not defined",
            "import math",
            "effort = np.clip(effort, a, b)",
            "`import numpy as np`",
        ),
        (
            "TypeError: 'str' object is not callable",
            "self.create_service(Trigger, 'motors/status', 'status')",
            "",
            "Line 1 gives the callback as a text: write it without quotation marks, `self.status`.",
        ),
        (
            "TypeError: ActionServer.__init__() takes 5 positional arguments but 8 were given",
            "",
            "ActionServer(self, Lift, 'lift', self.execute, self.check_goal, self.take_over, self.allow_cancel)",
            "The others have names: `goal_callback=...`",
        ),
        (
            "AttributeError: 'ActionClient' object has no attribute 'subscriptions'",
            "",
            "rclpy.spin_until_future_complete(self.client, future)",
            "The first argument of `spin_until_future_complete` is the node, in its methods `self`.",
        ),
        ("AttributeError: 'Client' object has no attribute 'subscriptions'", "", "self.client.subscriptions", ""),
        (
            "TypeError: object of type 'NoneType' has no len()",
            "def main(args=None):\n    if len(args) != 4:\n        pass",
            "if len(args) != 4:",
            "`args` is None, because main() is called without arguments.",
        ),
        ("TypeError: object of type 'NoneType' has no len()", "def main(args=None):\n    pass", "len(self.x)", ""),
        (
            "TypeError: 'NoneType' object is not subscriptable",
            "def main(args=None):\n    a = float(args[1])",
            "a = float(args[1])",
            "`args` is None, because main() is called without arguments.",
        ),
        (
            "TypeError: cannot unpack non-iterable NoneType object",
            "def main(args=None):\n    _, a, b = args",
            "_, a, b = args",
            "`args` is None, because main() is called without arguments.",
        ),
        (
            "TypeError: 'NoneType' object is not subscriptable",
            "def main(args=None):\n    args = words(args)\n    a = float(args[1])",
            "a = float(args[1])",
            "`words` returned None.",
        ),
        (
            "NameError: name 'node' is not defined. Did you mean: 'Node'?",
            "class A(Node):\n    def call(self):\n        spin(node)\ndef main():\n    node = A()\n    node.call()",
            "spin(node)",
            "In a method the node is `self`.",
        ),
        ("NameError: name 'node' is not defined", "def main():\n    spin(node)", "spin(node)", ""),
        (
            "TypeError: Server.state() takes 0 positional arguments but 1 was given",
            "class Server(Node):\n    def state():\n        return self.on",
            "",
            "`def state(self, ...)`",
        ),
    ],
)
def test_a_known_cause_has_a_hint_and_no_other(error, text, code, says):
    said = hint(error, text, code)
    assert says in said and bool(says) == bool(said), said


@pytest.mark.parametrize(
    ("define", "body", "options", "says"),
    [
        ("def", "response.success = True", "", ""),
        ("def", "answer = self.client.call(r)", "", "waits in `self.client.call(...)`"),
        ("def", "answer = self.client.call(r, timeout_sec=1.0)", "", ""),
        (
            "def",
            "rclpy.spin_until_future_complete(self, future)",
            "",
            "waits in `rclpy.spin_until_future_complete(...)`",
        ),
        ("async def", "answer = await self.client.call_async(r)", "", "a group of its own"),
        ("async def", "answer = await self.client.call_async(r)", ", callback_group=group", ""),
        ("async def", "while not self.client.service_is_ready(): await self.sleep(0.1)", ", **together", ""),
        ("async def", "while not self.client.call_async(r).done(): await self.pause()", ", **together", ""),
        ("def", "while True:\n            if self.moved(): break", "", ""),
        ("def", "while True: pass", "", "loops without end"),
        ("def", "time.sleep(9)", "", "sleeps"),
        ("def", "time.sleep(0.1)", "", ""),
        ("def", "time.sleep(self.period)", "", "sleeps"),
        ("def", "while self.busy: time.sleep(0.1)", "", "sleeps"),
        ("def", "rclpy.spin_until_future_complete(self.helper, future)", "", ""),
        ("def", "self.client.wait_for_service()", "", "waits in line 9, `self.client.wait_for_service()`"),
        ("async def", "self.client.wait_for_service()", "", "Check `service_is_ready()`"),
        ("def", "self.client.wait_for_service(5.0)", "", ""),
        ("def", "answer = self.client.call(r, 1.0)", "", ""),
        ("def", "while not self.client.call_async(r).done(): time.sleep(1)", "", "waits in line 9, `while not "),
        ("def", "while not self.sent.done(): x = 1", "", ""),
        (
            "def",
            "while not self.client.call_async(r).done(): rclpy.spin_once(self, timeout_sec=0.1)",
            "",
            "spins its node there, which takes the node from the executor",
        ),
        (
            "async def",
            "while not self.client.call_async(r).done(): time.sleep(1)",
            ", callback_group=group",
            "busy with this callback. Write `await client.call_async(...)`.",
        ),
        (
            "async def",
            "answer = self.client.call(r)",
            "",
            "callback. Write `await client.call_async(...)`, and give the client a callback group of its own.",
        ),
        (
            "def",
            "answer = self.client.call(r)",
            ", callback_group=group",
            "callback. Make it `async def`, and write `await client.call_async(...)`.",
        ),
        ("async def", "answer = await self.call(r)", ", callback_group=group", ""),
        ("def", "answer = self.ask(r)", "", ""),
    ],
)
def test_why_a_service_may_never_answer(define, body, options, says):
    said = source.blocked(SERVER.format(define=define, body=body, options=options), "/ask")
    assert says in said and bool(says) == bool(said), said


@pytest.mark.parametrize(
    ("made", "given", "says"),
    [
        ("group = ReentrantCallbackGroup()", "callback_group=group", ""),
        ("group = MutuallyExclusiveCallbackGroup()", "callback_group=group", "a group of its own"),
        ("self.group = MutuallyExclusiveCallbackGroup()", "callback_group=self.group", "a group of its own"),
        ("pass", "callback_group=MutuallyExclusiveCallbackGroup()", ""),
        ("together = {'callback_group': ReentrantCallbackGroup()}", "**together", ""),
        ("together = dict(callback_group=MutuallyExclusiveCallbackGroup())", "**together", "a group of its own"),
        ("together = options()", "**together", ""),
    ],
)
def test_only_a_group_that_lets_nothing_else_run_is_named(made, given, says):
    text = SERVER.format(define="async def", body="await self.client.call_async(r)", options=f", {given}")
    text = text.replace("'/add')", f"'/add', {given})").replace(
        "        self.client =", f"        {made}\n        self.client ="
    )
    said = source.blocked(text, "/ask")
    assert says in said and bool(says) == bool(said), said
    assert bool(source.one_at_a_time(text, "/ask")) == (bool(says) or "Exclusive" in given)


BLOCKS = SERVER.format(define="def", body="answer = self.client.call(r)", options="{service}").replace(
    "'/add')", "'/add'{client})"
)
REENTRANT, OWN = ", callback_group=ReentrantCallbackGroup()", ", callback_group=self.own"


@pytest.mark.parametrize(
    ("service", "client", "says", "line"),
    [
        ("", "", "comes to a client in its own callback group, in which nothing else runs", 7),
        ("", REENTRANT, "", 7),
        (OWN, REENTRANT, "", 7),
        (REENTRANT, REENTRANT, "", 0),
    ],
)
def test_a_call_that_blocks_one_thread_of_many(service, client, says, line):
    text = BLOCKS.format(service=service, client=client).replace(
        "        self.client =", "        self.own = MutuallyExclusiveCallbackGroup()\n        self.client ="
    )
    assert "only its own executor can receive" in source.blocked(text, "/ask")
    text += "\nMultiThreadedExecutor(8)\n"
    said = source.blocked(text, "/ask")
    assert says in said and bool(says) == bool(said), said
    assert source.one_at_a_time(text, "/ask") == line


def test_a_call_that_blocks_in_a_cell_is_told_by_the_number_of_threads():
    text = BLOCKS.format(service=REENTRANT, client=REENTRANT)
    assert "only its own executor can receive" in source.blocked(text, "/ask", threads=1)
    assert source.blocked(text, "/ask", threads=2) == ""


@pytest.mark.parametrize("body", ["answer = self.client.call(r)", "answer = await self.client.call_async(r)"])
def test_a_service_that_a_callback_asks_and_nobody_serves_is_the_cause(body):
    text = SERVER.format(define="async def", body=body, options="")
    said = source.blocked(text, "/ask", is_served=lambda name: name != "/add")
    assert said == "its callback 'ask' asks /add in line 9, and no node serves that."
    assert "no node serves" not in source.blocked(text, "/ask", is_served=lambda name: name == "/add")
    in_a_namespace = text.replace("('server')", "('server', namespace='a')")
    assert "no node serves" not in source.blocked(in_a_namespace, "/ask", is_served=lambda name: False)


def test_a_server_that_asks_itself():
    text = SERVER.format(
        define="async def", body="answer = await self.client.call_async(r)", options=", callback_group=g"
    )
    assert "'ask' calls /ask, its own service, in line 9" in source.blocked(text.replace("'/add'", "'ask'"), "/ask")


def test_of_a_callback_whose_service_is_made_elsewhere_its_name_is_enough():
    text = "class B(A):\n    def ask(self, request, response):\n        while True: pass\n"
    assert source.blocked(text, "/ask") == ""
    assert "loops without end" in source.blocked(text, "/ask", "ask")
    assert source.blocked(text.replace("while True: pass", "await self.client.call_async(r)"), "/ask", "ask") == ""


@pytest.mark.parametrize("before", ["", "name? ", "step"])
def test_what_was_printed_without_an_end_of_line_hides_no_error(tmp_path, before):
    path = tmp_path / "asks.py"
    path.write_text("\n\ninput('name? ')\n")
    output = (
        f"{before}Traceback (most recent call last):\n"
        f'  File "{path}", line 3, in <module>\n'
        "    input('name? ')\n"
        "EOFError: EOF when reading a line\n"
    )
    report = str(failure_report.of_program(path, output, 1))
    assert "EOFError: EOF when reading a line\n  asks.py, line 3\n    input('name? ')\nHint: A program that" in report


def test_a_wrong_import_is_told_without_the_path_of_the_module(tmp_path):
    (path := tmp_path / "a.py").write_text("import rclpy\nfrom std_srvs.srv import Triger\n")
    said, module = "ImportError: cannot import name 'Triger' from 'std_srvs.srv'", "(/lib/std_srvs/srv/__init__.py)"
    for ending in f"{module}", f"{module}. Did you mean: 'Trigger'?":  # Python 3.11, and 3.12
        report = failure_report.of_program(path, f"Traceback (most recent call last):\n{said} {ending}\n", 1)
        assert report.error == f"{said}{ending.removeprefix(module)}"
        assert report.hint.endswith("Did you mean `Trigger`?")


def test_a_misspelt_field_is_told_in_the_same_words_by_each_python(tmp_path):
    (path := tmp_path / "a.py").write_text("response.reslt = 1\n")
    said = "AttributeError: 'Trigger_Response' object has no attribute 'mesage'"
    for ending in "", " and no __dict__ for setting new attributes. Did you mean: 'message'?":  # Python 3.13
        report = failure_report.of_program(path, f"Traceback (most recent call last):\n{said}{ending}\n", 1)
        assert report.error.removesuffix(". Did you mean: 'message'?") == said


def test_a_log_line_behind_what_was_printed_is_a_log_line():
    entries = program_logs("talks.py", "step[INFO] [talker]: on my way\n[WARN] [talker]: late", [])
    assert [(entry.level, entry.text) for entry in entries] == [
        ("PRINT", "step"),
        ("INFO", "on my way"),
        ("WARN", "late"),
    ]


def test_a_text_that_cannot_be_read_says_nothing():
    assert source.blocked("def (", "/ask") == "" and source.wrong_return("def (") is None
    assert hint("TypeError:", "def (") != ""


def test_what_a_callback_returns_in_the_place_of_its_response():
    text = SERVER.format(define="def", body="pass", options="")
    assert source.wrong_return(text) is None
    assert source.wrong_return(text.replace("return response", "return response.x")) == ("ask", 10, "response.x")
    assert source.wrong_return(text.replace("return response", "pass")) == ("ask", 8, "")


@pytest.mark.parametrize(
    "returned",
    ["{'success': True}", "dict(success=True)", "(True, response.message)", "True", "request.data > 3", "None",
     "f'{request.data}'", "SetBool.Request()", "not request.data", "answer"],
)  # fmt: skip
def test_what_is_no_response_is_named_with_its_line(tmp_path, returned):
    text = SERVER.format(define="def", body="answer = dict(success=True)", options="")
    text = text.replace("return response", f"return {returned}")
    assert source.wrong_return(text) == ("ask", 10, returned)
    path = tmp_path / "server.py"
    path.write_text(text)
    report = failure_report.of_program(path, "Traceback (most recent call last):\nTypeError\n", 1)
    assert [(frame.line, frame.code) for frame in report.frames] == [(10, f"return {returned}")]
    why = f"The service callback 'ask' returns `{returned}`, not the response: end it with `return response`."
    assert report.hint == why
    in_a_cell = failure_report.of_exception("a", TypeError(), [], cell=text)
    assert (in_a_cell.frames[-1].line, in_a_cell.hint) == (10, why)


@pytest.mark.parametrize(
    ("body", "returned"),
    [("pass", "SetBool.Response(success=True)"), ("response = SetBool.Response(success=True)", "response")],
)
def test_the_response_of_another_type_is_named(body, returned):
    text = SERVER.format(define="def", body=body, options="").replace("return response", f"return {returned}")
    why = "The service callback 'ask' returns `SetBool.Response(success=True)`, but its service has another type: "
    assert hint("TypeError", text).startswith(why)
    assert source.wrong_return(text.replace("SetBool", "Trigger")) is None


@pytest.mark.parametrize("returned",
    ["self.filled(response)", "Trigger.Response()", "srv.Trigger.Response()", "answer",
     "response if request.data else other"],
)  # fmt: skip
def test_what_may_be_the_response_is_not_named(returned):
    body = "answer = response; answer = dict(success=True)" if returned == "answer" else "pass"
    text = SERVER.format(define="def", body=body, options="").replace("return response", f"return {returned}")
    assert source.wrong_return(text) is None


@pytest.mark.parametrize("replaced", ["response = {'success': True}", "response = (True, 'on')", "response = 'on'"])
def test_what_replaces_the_response_is_named_with_its_line(tmp_path, replaced):
    text = SERVER.format(define="def", body=replaced, options="")
    path = tmp_path / "server.py"
    path.write_text(text)
    report = failure_report.of_program(path, "Traceback (most recent call last):\nTypeError\n", 1)
    assert [(frame.line, frame.code) for frame in report.frames] == [(9, replaced)]
    assert report.hint.startswith(f"In the service callback 'ask', `{replaced}` replaces the response that it is ")
    in_a_cell = failure_report.of_exception("a", TypeError(), [], cell=text)
    assert (in_a_cell.frames[-1].line, in_a_cell.hint) == (9, report.hint)


@pytest.mark.parametrize("made", ["SetBool.Response()", "self.filled(response)", "self.response", "request"])
def test_what_may_be_another_response_is_not_said_to_replace_it(made):
    text = SERVER.format(define="def", body=f"response = None; response = {made}", options="")
    assert source.wrong_return(text.replace("SetBool", "Trigger")) is None


def test_the_function_that_ends_a_server():
    assert source.exits("def main():\n    sys.exit(1)") == ""
    assert source.exits("def ask():\n    sys.exit(1)") == source.exits("def ask():\n    raise SystemExit") == "ask"


@pytest.mark.parametrize(
    ("main", "says"),
    [
        ("def main():\n    rclpy.spin(A())\n", "main() is defined, but never called: end the file with `if __na"),
        ("def main():\n    rclpy.spin(A())\n\nsys.exit(main)\n",
         "`sys.exit(main)` names the function and does not call it: write `sys.exit(main())`."),
        ("def main():\n    A()\n\nmain()\n", "It ended because nothing spins its node"),
        (
            "def main():\n    rclpy.spin(A())\n\nmain()\n",
            "'stop' calls `rclpy.shutdown()` in line 3, which ends the node",
        ),
    ],
)  # fmt: skip
def test_a_method_that_ends_the_node_is_the_cause_only_if_the_program_runs_it(tmp_path, main, says):
    (path := tmp_path / "a.py").write_text(f"class A(Node):\n    def stop(self):\n        rclpy.shutdown()\n\n{main}")
    assert failure_report.of_program(path, "", 0).hint.startswith(says)


def test_a_callback_whose_answer_cannot_be_sent_any_more_is_told_what_it_has_ended(tmp_path):
    (path := tmp_path / "a.py").write_text(
        "class A(Node):\n    def stop(self, request, response):\n        rclpy.shutdown()\n"
    )
    said = (
        "Traceback (most recent call last):\n"
        '  File "/x/site-packages/rclpy/service.py", line 9, in send_response\n'
        "rclpy._rclpy_pybind11.RCLError: failed to send response: publisher's context is invalid, at /p/p.c:423\n"
    )
    report = failure_report.of_program(path, said, 1)
    assert report.frames[0].line == 3 and report.hint.startswith(
        "'stop' calls `rclpy.shutdown()` in line 3, which ends"
    )


def test_the_story_of_a_program_has_the_readers_lines_alone(tmp_path):
    path = tmp_path / "server.py"
    path.write_text("import rclpy\n")
    output = textwrap.dedent("""\
        [INFO] [server]: ready
        Traceback (most recent call last):
          File "/home/a/server.py", line 9, in <module>
            main()
          File "/home/a/server.py", line 7, in main
            rclpy.spin(node)
          File "/opt/site-packages/rclpy/task.py", line 51, in __call__
            self.set_result(self._handler())
          File "/home/a/server.py", line 3, in ask
            return x / 0
        ZeroDivisionError: division by zero
        The following exception was never retrieved: no
        """)
    assert str(failure_report.of_program(path, output, 1)) == (
        "server.py ended with exit status 1: ZeroDivisionError: division by zero\n"
        "  server.py, line 3, in ask\n    return x / 0\n"
        "Hint: Check the divisor before you divide."
    )


def test_a_goal_without_a_state_and_one_with_an_exception(tmp_path):
    path = tmp_path / "server.py"
    path.write_text("")
    warning = "[WARN] [server.action_server]: Goal state not set, assuming aborted. Goal ID: 1\n"
    raised = (
        "[ERROR] [server.action_server]: Error raised in execute callback: 'x'\n"
        'Traceback (most recent call last):\n  File "/a/server.py", line 2, in execute\n    a[x]\nKeyError: x\n'
    )
    assert [each.ending for each in failure_report.failed_goals(path, warning)] == [failure_report.NO_STATE]
    ending = "Traceback (most recent call last):\nRuntimeError: of a cancel callback\n"
    assert failure_report.failed_goals(path, ending + warning) == [], "the program ends, and its goals with it"
    assert [each.error for each in failure_report.failed_goals(path, raised + warning)] == ["KeyError: x"]
    assert [each.error for each in failure_report.failed_goals(path, (raised + warning) * 2 + warning)] == [
        "",
        "KeyError: x",
    ]


def test_what_a_goal_raises_after_the_program_has_failed_is_no_cause(tmp_path):
    path = tmp_path / "lift.py"
    path.write_text("server = ActionServer(node, Lift, '/lift', execute)\n\ndef execute(goal):\n    return\n")
    line = "The 'result' field must be a sub message of type 'Lift_Result'"
    ended = f'{MARK}\n  File "/a/lift.py", line 9, in <module>\n    main()\nAssertionError: {line}\n'
    after = (
        "[ERROR] [lift.action_server]: Error raised in execute callback: feedback publisher is invalid\n"
        f'{MARK}\n  File "/a/lift.py", line 4, in execute\n    publish_feedback(x)\nRCLError: publisher is invalid\n'
        "[WARN] [lift.action_server]: Goal state not set, assuming aborted. Goal ID: 1\n"
    )
    report = failure_report.of_program(path, ended + after, 1)
    assert report.error == f"AssertionError: {line}" and "'execute' must end with `return Lift.Res" in report.hint
    assert failure_report.failed_goals(path, ended + after) == []
    (before,) = failure_report.failed_goals(path, after + ended)
    assert before.error == "RCLError: publisher is invalid"


def test_a_goal_callback_that_returns_no_response(tmp_path):
    path = tmp_path / "server.py"
    path.write_text("")
    said = "[WARN] [server.action_server]: Goal request callback did not return a GoalResponse type. Rejecting goal.\n"
    (report,) = failure_report.failed_goals(path, said * 2)
    assert str(report) == (
        "server.py rejected a goal, because its goal callback did not return a GoalResponse.\n"
        "Hint: Return `GoalResponse.ACCEPT` or `GoalResponse.REJECT`, on every path through it."
    )


@pytest.mark.parametrize(
    ("spins", "says"),
    [
        ("rclpy.spin_once(node)", "`rclpy.spin_once` handles one callback at most and returns: `rclpy.spin(node)`"),
        ("while rclpy.ok():\n        rclpy.spin_once(node)", "A server must run until it is stopped"),
        ("rclpy.spin_once(node)\n    rclpy.spin(node)", "A server must run until it is stopped"),
    ],
)
def test_a_server_that_spins_once(tmp_path, spins, says):
    path = tmp_path / "server.py"
    path.write_text(f"class A(Node):\n    pass\n\ndef main():\n    node = A()\n    {spins}\n\nmain()\n")
    report = failure_report.of_program(path, "", 0)
    assert report.hint.startswith(says)
    assert [frame.line for frame in report.frames] == ([6] if "once` handles" in says else [])


def test_a_server_that_spins_once_and_then_ends_its_node_is_told_of_the_spin(tmp_path):
    text = "class A(Node):\n    def close(self):\n        self.destroy_node()\n\ndef main():\n    node = A()\n"
    (path := tmp_path / "server.py").write_text(f"{text}    rclpy.spin_once(node)\n    node.close()\n\nmain()\n")
    assert failure_report.of_program(path, "", 0).hint.startswith("`rclpy.spin_once` handles one callback at most")


def test_a_file_of_a_name_alike_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall_agent.py").touch()
    path = tmp_path / "node.py"
    path.write_text("import wall_agnet\n")
    said = (
        'Traceback (most recent call last):\n  File "/a/node.py", line 1, in <module>\n    import wall_agnet\n'
        "ModuleNotFoundError: No module named 'wall_agnet'\n"
    )
    assert failure_report.of_program(path, said, 1).hint == (
        "This folder has wall_agent.py, but no wall_agnet.py: did you mean `wall_agent`?"
    )
    assert failure_report.of_program(path, said.replace("wall_agnet", "another"), 1).hint == ""


def test_a_file_that_its_cell_has_not_written_yet_is_named_with_the_cell(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall_agents.py").touch()  # alike, and not meant
    cell = {"cell_type": "code", "source": ["%%exercise wall_agent.py\n", "class WallAgent:\n"]}
    (tmp_path / "ai.ipynb").write_text(json.dumps({"cells": [cell]}))
    says = "wall_agent.py is not in this folder yet: run the cell `%%exercise wall_agent.py` first."
    assert hint("ModuleNotFoundError: No module named 'wall_agent'") == says


def test_a_file_that_hides_a_library_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = "AttributeError: module 'numpy' has no attribute 'array'"
    assert hint(error, "import numpy as np") == ""
    (tmp_path / "numpy.py").write_text("")
    (tmp_path / "mine.py").write_text("")
    says = "The file numpy.py beside the notebook hides the installed module `numpy`: rename it."
    assert hint(error, "import numpy as np") == says
    assert hint("AttributeError: module 'mine' has no attribute 'array'", "import mine") == ""
    (tmp_path / "queue.py").write_text("queue = []")
    says = "The file queue.py beside the notebook hides the installed module `queue`: rename it."
    assert hint("AttributeError: module 'queue' has no attribute 'SimpleQueue'", "import rclpy") == says
    assert hint("AttributeError: module 'queue' has no attribute 'mine'", "import rclpy") == ""
    (tmp_path / "std_srvs").mkdir()
    says = "The folder std_srvs beside the notebook hides the installed module `std_srvs`: rename it."
    assert hint("ModuleNotFoundError: No module named 'std_srvs.srv'", "from std_srvs.srv import Trigger") == says


def test_a_function_of_python_and_a_method_that_a_cell_has_overwritten(monkeypatch):
    main = sys.modules["__main__"]
    cells = {"/tmp/ipykernel_1/1.py": "x = 1\nlist = [2, 1]\n", "/tmp/ipykernel_1/2.py": "robot.until = 5"}
    for file, text in cells.items():
        monkeypatch.setitem(linecache.cache, file, (len(text), None, text.splitlines(keepends=True), file))
    robot = type("Robot", (), {"until": lambda self: None})()
    robot.until = 5
    monkeypatch.setattr(main, "list", [2, 1], raising=False)
    monkeypatch.setattr(main, "robot", robot, raising=False)
    said = hint("TypeError: 'list' object is not callable", "print(list(x))", "print(list(x))")
    assert said == (
        "`list` is a function of Python itself, and line 2 of a cell, `list = [2, 1]`, has overwritten it: it is a "
        "list now. Run `del list` in a cell, and choose another name there."
    )
    error = "TypeError: isinstance() arg 2 must be a type, a tuple of types, or a union"
    assert hint(error, "", "assert all(isinstance(speed, list) for speed in got), (").startswith("`list` is a function")
    said = hint("TypeError: 'int' object is not callable", "robot.until()", "robot.until(lambda: f() == 1)")
    assert said.startswith("`robot.until` is a method, and line 1 of a cell, `robot.until = 5`, has overwritten it")


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("x = 1", "`rear(...)` returned None: `rear` ends without a `return`."),
        ("if seen:\n        return 1.0", "`rear(...)` returned None"),
        ("return seen", ""),
    ],
)
def test_a_function_of_the_notebook_that_returns_nothing(monkeypatch, body, says):
    text, file = f"def rear(seen):\n    {body}\n", "/tmp/ipykernel_1/3.py"
    monkeypatch.setitem(linecache.cache, file, (len(text), None, text.splitlines(keepends=True), file))
    made: dict = {}
    exec(compile(text, file, "exec"), made)
    monkeypatch.setattr(sys.modules["__main__"], "rear", made["rear"], raising=False)
    said = hint("TypeError: must be real number, not NoneType", "", "if not math.isclose(rear(asked), wanted):")
    assert said.startswith(says) and bool(said) == bool(says)


def test_a_name_of_the_session_that_stands_for_something_else(monkeypatch):
    error, main = "AttributeError: 'NoneType' object has no attribute 'node'", vars(sys.modules["__main__"])
    assert hint(error, "", "ActionClient(ros.node, Lift, '/lift')") == ""
    monkeypatch.setitem(main, "ros", None)
    assert "A cell has assigned another value to `ros`" in hint(error, "", "ActionClient(ros.node, Lift, '/lift')")
    assert hint(error, "", "self.node") == ""


def test_lines_of_the_course_are_not_shown_as_the_readers_own():
    with pytest.raises(TypeError) as waiting:
        wait_until(None, 1.0)
    assert [frame.place for frame in failure_report.of_exception("x", waiting.value, []).frames] == [
        Path(__file__).name
    ]
    with pytest.raises(AttributeError) as names:
        is_hidden(None)
    places = [frame.place for frame in failure_report.of_exception("x", names.value, []).frames]
    assert places == [Path(__file__).name]


def test_a_pre_set_callback_without_a_list_is_named(tmp_path):
    def before(parameters):
        parameters.clear()

    with pytest.raises(TypeError) as raised:
        Node._call_pre_set_parameters_callback(SimpleNamespace(_pre_set_parameters_callbacks=[before]), [])
    trace = raised.value.__traceback__.tb_next
    report = failure_report.of_exception("The node a", raised.value.with_traceback(trace), [])
    assert "The pre-set callback 'before' must return the list" in report.hint
    path = tmp_path / "pid.py"
    path.write_text("self.add_pre_set_parameters_callback(before)\ndef before(params):\n    pass\n")
    said = (
        "Traceback (most recent call last):\n"
        '  File "/x/site-packages/rclpy/node.py", line 1046, in _call_pre_set_parameters_callback\n'
        "    modified_parameter_list.extend(callback(parameter_list))\n"
        "TypeError: 'NoneType' object is not iterable\n"
    )
    report = failure_report.of_program(path, said, 1)
    assert str(report.frames[0]) == "  pid.py, line 2\n    def before(params):" and "'before' must" in report.hint
    assert "add_on_set" not in report.hint
    path.write_text(path.read_text().replace("pass", "return SetParametersResult(successful=True)"))
    report = failure_report.of_program(path, said.replace("NoneType", "SetParametersResult"), 1)
    assert report.frames[0].line == 3 and "registered with `add_on_set_parameters_callback`" in report.hint


def test_the_calls_of_a_recursion_are_told_once(tmp_path):
    def again(count):
        return again(count + 1) if count < 200 else {}["front"]

    with pytest.raises(KeyError) as raised:
        again(0)
    assert len(failure_report.of_exception("x", raised.value, []).frames) == 2


def test_the_line_of_a_segmentation_fault_is_told(tmp_path):
    path = tmp_path / "crashing.py"
    path.write_text("import ctypes\n\ndef status():\n    ctypes.string_at(0)\n\nstatus()\n")
    ended = subprocess.run(
        [sys.executable, path.name],
        cwd=tmp_path,
        env={**os.environ, "PYTHONFAULTHANDLER": "1"},
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    report = failure_report.of_program(path, ended.stderr, ended.returncode)
    assert report.ending == "was ended by the signal SIGSEGV"
    assert [str(frame) for frame in report.frames] == ["  crashing.py, line 4, in status\n    ctypes.string_at(0)"]


def test_a_class_of_a_file_beside_the_notebook_is_named_with_its_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "relay.py").write_text("class Relay(Node):\n    pass\n")
    assert hint("NameError: name 'Relay' is not defined", "ros.start(Relay)").endswith("`ros.start('relay.py')`.")
    assert hint("NameError: name 'Rel' is not defined", "ros.start(Rel)") == ""


def test_where_a_program_is_may_be_in_another_file_beside_it(tmp_path):
    node, agent = tmp_path / "node.py", tmp_path / "agent.py"
    node.write_text("def tick():\n    decide()\n")
    agent.write_text("def decide():\n    while True: pass\n")
    other = tmp_path / "library" / "agent.py"
    stacks = (
        "Current thread 0x1 (most recent call first):\n"
        f'  File "{agent}", line 2 in decide\n  File "{other}", line 1 in call\n  File "node.py", line 2 in tick\n'
    )
    found = failure_report.where(stacks, node)
    assert [(frame.place, frame.line, frame.code) for frame in found] == [
        ("node.py", 2, "decide()"),
        ("agent.py", 2, "while True: pass"),
    ]


@pytest.mark.parametrize("made", ["turns = 0", "turns: int = 0"])
def test_an_error_in_a_file_beside_the_program_is_told_with_its_line_and_its_hint(tmp_path, made):
    node, agent = tmp_path / "node.py", tmp_path / "agent.py"
    node.write_text("import agent\n\ndef tick():\n    agent.decide()\n")
    agent.write_text(f"{made}\n\ndef decide():\n    turns += 1\n")
    output = (
        f'{MARK}\n  File "{node}", line 4, in tick\n    agent.decide()\n  File "{agent}", line 4, in decide\n'
        f'    turns += 1\n  File "{tmp_path}/library/agent.py", line 9, in call\n    raise\n'
        '  File "<string>", line 1, in <module>\n'
        "UnboundLocalError: cannot access local variable 'turns' where it is not associated with a value\n"
    )
    said = str(failure_report.of_program(node, output, 1))
    assert said.splitlines()[1:5] == [
        "  node.py, line 4, in tick", "    agent.decide()", "  agent.py, line 4, in decide", "    turns += 1"
    ]  # fmt: skip
    assert "a function that sets it begins with `global turns`" in said.splitlines()[5]


def test_a_name_that_a_module_has_nearly_is_named():
    said = hint("ImportError: cannot import name 'timelin' from 'course.figures' (/course/figures/__init__.py)")
    assert said == "course.figures has no timelin. Did you mean `timeline`?"


def test_a_hint_that_an_error_tells_already_is_not_told_again():
    said = "while the client ran: calculator_client.py ended: ZeroDivisionError: division by zero\n{}"
    assert failure_report.hint_on(AssertionError(said.format("Hint: Check the divisor."))) == ""
    assert "divisor" in failure_report.hint_on(ZeroDivisionError("division by zero"))


def test_a_guess_is_made_only_for_a_name_that_is_alike():
    text = "from rcl_interfaces.srv import SetParameters\nfrom std_srvs.srv import Trigger"
    told = hint("AttributeError: 'Trigger_Response' object has no attribute 'mesage'", text)
    assert told == "The response of Trigger has the fields success, message. Did you mean `message`?"
    told = hint("AttributeError: 'SetParameters_Response' object has no attribute 'reason'", text)
    assert told == "The response of SetParameters has the one field results."


def test_a_dict_inside_the_course_has_no_hint_on_the_readers_line():
    error = "AttributeError: 'dict' object has no attribute 'start'"
    assert hint(error, "figures.timeline(goal.table())") == ""
    assert "`['start']`" in hint(error, "print(table.start)")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        ("AttributeError: 'dict' object has no attribute 'has_key'", "if state.has_key('front'):"),
        ("AttributeError: 'dict' object has no attribute 'append'", "state.append(3)"),
        ("TypeError: float() argument must be a string or a real number, not 'method'", "a = float(self.half) * 2"),
    ],
)
def test_a_hint_on_another_mistake_is_not_given(error, code):
    assert hint(error, code, code) == ""


def test_the_callback_of_a_timer_before_its_period_is_told():
    error = "TypeError: float() argument must be a string or a real number, not 'method'"
    assert "First the period in seconds" in hint(error, "", "self.timer = self.create_timer(self.loop, 0.1)")


def test_a_type_that_was_changed_by_a_missing_bracket_is_told_with_the_cure():
    said = hint("AttributeError: 'AddTwoInts_Response' object attribute 'sum' is read-only")
    assert "`AddTwoInts.Response.sum = ...` was run, without brackets" in said and "restart the kernel" in said


@pytest.mark.parametrize(
    ("error", "text", "code", "says"),
    [
        (
            "TypeError: 'module' object is not callable",
            "import course.notebook.terminal as terminal",
            "terminal('ls')",
            "`terminal` is the module course.notebook.terminal: write `from course.notebook.terminal import terminal`.",
        ),
        (
            "TypeError: module() takes at most 2 arguments (3 given)",
            "import rclpy.node as Node",
            "class A(Node):",
            "`Node` is the module rclpy.node: write `from rclpy.node import Node`.",
        ),
        ("TypeError: 'module' object is not callable", "import math", "math(2)", "`math` is the module math, not a"),
        ("TypeError: 'method' object is not subscriptable", "", "ros.nodes['/a']", "`ros.nodes` is a method: call it"),
        ("TypeError: 'method' object is not subscriptable", "", "self.nodes['/a']", ""),
        (
            "TypeError: live() takes 0 positional arguments but 1 was given",
            "",
            "course.live(5)",
            "`course.live()` takes",
        ),
        ("ModuleNotFoundError: No module named 'course.recorder'", "", "", "Did you mean `course.recorders`?"),
        (
            "ImportError: cannot import name 'GoalRecorder' from 'course' (/course/__init__.py)",
            "",
            "",
            "GoalRecorder is in course.recorders: write `from course.recorders import GoalRecorder`.",
        ),
    ],
)
def test_what_is_taken_for_something_else_is_named(error, text, code, says):
    importlib.import_module("course.notebook.terminal")
    said = hint(error, text, code)
    assert said.startswith(says) and bool(said) == bool(says)


@pytest.mark.parametrize(
    ("source", "says"),
    [
        ("class Motors(Node):\n    pass\n", "The file has the class Motors, and makes no node of it."),
        ("print(1)\n", "It ended at once: it makes no node."),
        ("class Motors(Node):\n    pass\nnode = Motors()\n", "nothing spins its node"),
        ("import rclpy\nnode = rclpy.create_node('a')\n", "nothing spins its node"),
    ],
)
def test_a_program_that_ends_at_once_says_what_is_missing(tmp_path, source, says):
    (path := tmp_path / "a.py").write_text(source)
    assert says in failure_report.of_program(path, "", 0).hint


ENDS = """class Lift(Node):
    def __init__(self):
        super().__init__('lift')
        self.action = ActionServer(self, Kind, '/lift', self.execute){made}

    def execute(self, goal_handle):
        time.sleep(1.0)

    def go(self):
        time.sleep(1.0)


def main():
    node = Lift()
    {main}


main()
"""


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize(
    ("made", "main", "says"),
    [
        ("", "pass", "nothing spins its node: main() must call `rclpy.spin(node)`"),
        ("", "runs = MultiThreadedExecutor()", "nothing spins its node: main() must call `runs.spin()`"),
        ("", "rclpy.spin(node)", "A server must run until it is stopped: is `rclpy.spin(node)` reached?"),
        ("", "all = SingleThreadedExecutor()\n    all.spin()", "it is stopped: is `all.spin()` reached?"),
        ("", "node.go()", "it is stopped: is `rclpy.spin(node)` reached?"),
        ("; self.go()", "pass", "it is stopped: is `rclpy.spin(node)` reached?"),
    ],
)
def test_a_program_that_makes_its_node_and_ends_at_once_is_told_of_the_spin(tmp_path, made, main, says, seen):
    (path := tmp_path / "lift.py").write_text(ENDS.format(made=made, main=main))
    assert says in failure_report.of_program(path, "", 0, before_its_node=not seen).hint


def test_a_copy_of_a_file_is_not_the_file_that_has_a_class(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "motor.edited-1.py").write_text("class Motors(Node):\n    pass\n")
    assert hint("NameError: name 'Motors' is not defined") == ""
    (tmp_path / "motor.py").write_text("class Motors(Node):\n    pass\n")
    assert "`Motors` is a class of the file motor.py" in hint("NameError: name 'Motors' is not defined")
    assert "`ros.start('motor.py')`" in hint("NameError: name 'Motors' is not defined")
    (tmp_path / "wall_agent.py").write_text("class State(Enum):\n    AHEAD = 1\n")
    wanted = "`State` is a class of the file wall_agent.py: `from wall_agent import State`."
    assert hint("NameError: name 'State' is not defined") == wanted


RELAY = """class Relay(Node):
    def __init__(self):
        self.create_service(Trigger, '/relay', self.relay)
    async def ask(self, a, b):
        answer = await self.client.call_async(AddTwoInts.Request(a=a, b=b))
    async def relay(self, request, response):
        answer = await self.ask(1, 2)
        response.message = f'{answer.sum}'
        return response
"""
CLIENT = """class Client(Node):
    def ask(self, request):
        future = self.client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=1.0)
        {ends}
def main():
    node = Client()
    answer = node.ask(request)
    print(answer.sum)
"""
PARTLY = """class A:
    def b(self):
        if x:
            return
        return y
    def d(self):
        made = self.b()
        return made.sum
"""
OF_A_CLOCK = """class A:
    def now(self):
        pass
    def b(self):
        t = self.get_clock().now()
        t.sum
"""
SHARED = """class A(Node):
    async def b(self):
        {0} = self.client.call_async(request)
        await {0}
        answer = {0}.result()
        return answer.sum
"""
NOT_YET = "The response is not there yet: `future.result()`"


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        (RELAY, "response.message = f'{answer.sum}'", "Line 7: `ask` returns nothing, so `answer` is None. End `ask`"),
        ("def add(a):\n    b = a\n\nprint(add(1).sum)", "print(add(1).sum)", "`add` returns nothing, so `add(1)` is"),
        ("class A:\n    def b(self):\n        c = 1\n    def d(self):\n        if self.b().sum:\n            pass",
         "if self.b().sum:", "`b` returns nothing, so `self.b()` is None. End `b` with a `return`."),
        (PARTLY, "return made.sum", "`b(...)` returned None: `b` ends"),
        (CLIENT.format(ends=""), "print(answer.sum)", "Line 8: `ask` returns nothing, so `answer` is None."),
        (CLIENT.format(ends="return future.result()"), "print(answer.sum)", NOT_YET),
        (CLIENT.format(ends="return future.result().sum"), "return future.result().sum", NOT_YET),
        ("rclpy.init()\nanswer = client.call(request, timeout_sec=1.0)\nanswer.sum", "answer.sum", NOT_YET),
        (SHARED.format("self.future"), "return answer.sum", "`self.future` is the future of the newest call: while "),
        (SHARED.format("future"), "return answer.sum", NOT_YET),
        ("rclpy.init()\nfound = re.match('x', 'y')\nprint(found.sum)", "print(found.sum)", ""),
        ("rclpy.init()\nfuture = pool.submit(ask)\nfuture.result().sum", "future.result().sum", ""),
        ("class A(Node):\n    last = None\n    def b(self):\n        c = self.last.sum", "c = self.last.sum", ""),
        ("class A(Node):\n    def b(self, last):\n        c = last.sum", "c = last.sum", ""),
        (OF_A_CLOCK, "t.sum", ""),
    ],
)  # fmt: skip
def test_where_a_none_comes_from_is_told_only_if_the_text_shows_it(text, code, says):
    said = hint("AttributeError: 'NoneType' object has no attribute 'sum'", text, code)
    assert said.startswith(says) and bool(said) == bool(says), said


def test_a_method_of_the_program_is_not_taken_for_one_of_its_name_of_rclpy():
    text = """class Follower(Node):
    def now(self):
        self.get_clock().now()
    def hear(self, msg):
        self.came = self.get_clock().now()
    def fresh(self):
        return self.now() - self.came <= FRESH
"""
    error = "TypeError: unsupported operand type(s) for -: 'NoneType' and 'Time'"
    said = hint(error, text, "return self.now() - self.came <= FRESH")
    assert said == "`now` returns nothing, so `self.now()` is None. End `now` with a `return`."


@pytest.mark.parametrize(
    ("name", "lines", "says"),
    [
        ("count", ("self.count = 0", "count += 1"), "An attribute of the node needs `self.`: write `self.count`."),
        ("given", ("self.given = given", "given()"), "An attribute of the node needs `self.`: write `self.given`."),
        ("time", ("self.time = 0.0", "return time + 1"), "An attribute of the node needs `self.`: write `self.time`."),
        ("time", ("self.time = 0.0", "now = time.monotonic()"), "`import time` is missing at the beginning."),
        ("deque", ("self.deque = deque(maxlen=5)", "pass"), ""),
        ("random", ("pass", "self.random = random.randint(1, 6)"), "`import random` is missing at the beginning."),
    ],
)
def test_what_is_not_imported_is_not_called_an_attribute(name, lines, says):
    text = (
        f"class A(Node):\n    def __init__(self, given):\n        {lines[0]}\n    def hear(self):\n        {lines[1]}\n"
    )
    assert hint(f"NameError: name '{name}' is not defined", text, lines[1]) == says


@pytest.mark.parametrize(
    ("imported_again", "says"), [(False, "`Trigger` is still the type of the build before"), (True, "")]
)
def test_a_type_that_was_built_again_is_to_be_imported_again(monkeypatch, imported_again, says):
    from std_srvs.srv import Trigger

    old = type("Trigger", (), {"__module__": "std_srvs.srv._trigger"})
    monkeypatch.setattr(sys.modules["__main__"], "Trigger", Trigger if imported_again else old, raising=False)
    said = hint("AssertionError: Invalid arguments passed to constructor: message", "", "Trigger.Response(message='')")
    assert says in said and ("import Trigger`" in said) == bool(says)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("heard", "`heard` is a list, not a function: pass its method, `heard.append`."),
        ("lambda: hear()", "The callback of a subscription must take the message: `lambda msg: ...`."),
        ("self.hear", "The callback of a subscription must take the message: `(self, msg)`."),
    ],
)
def test_what_is_no_callback_of_a_subscription(monkeypatch, given, says):
    monkeypatch.setattr(sys.modules["__main__"], "heard", [], raising=False)
    error = "RuntimeError: Subscription.__init__(): callback should be either be callable with one argument"
    line = f"node.create_subscription(String, 'chatter', {given}, 10)"
    assert hint(error, line, line) == says


@pytest.mark.parametrize(
    ("ends", "told"), [("pass", True), ("return response", False), ("return made(response)", False)]
)
def test_a_helper_that_gives_a_callback_no_response_is_named_with_its_line(tmp_path, ends, told):
    text = SERVER.format(define="def", body="pass", options="").replace("return response", "return self.say(response)")
    text += f"\n    def say(self, response):\n        response.message = 'on'\n        {ends}\n"
    (path := tmp_path / "server.py").write_text(text)
    report = failure_report.of_program(path, "Traceback (most recent call last):\nTypeError\n", 1)
    in_a_cell = failure_report.of_exception("a", TypeError(), [], cell=text)
    assert [frame.line for frame in (*report.frames, *in_a_cell.frames)] == [12, 12] * told
    assert report.hint == in_a_cell.hint
    assert ("'ask' returns what `say` returns, which is nothing: end `say`" in report.hint) == told


ASKS = "node.create_client(Trigger, 'ask')\nrclpy.spin_until_future_complete(node, future)\n"


@pytest.mark.parametrize(
    ("more", "said", "printed"),
    [
        ("", "client.py is a client, and a client ends by itself. As a command: `python3 client.py`.", True),
        ("node.create_service(Trigger, 'tell', tell)\n", "A server must run until it is stopped: is", False),
    ],
)
def test_a_client_that_has_ended_is_not_taken_for_a_server(tmp_path, more, said, printed):
    (path := tmp_path / "client.py").write_text(f"node = rclpy.create_node('asks')\n{ASKS}{more}")
    report = failure_report.of_program(path, "1 + 2 = 3\n", 0)
    assert report.hint.startswith(said) and ("1 + 2 = 3" in str(report)) == printed


@pytest.mark.parametrize(
    ("last", "says"),
    [
        ("", "main() ended while one of its threads still spun the node."),
        ("rclpy.spin(node)", "One of its threads, such as one that spins, still ran"),
        ("thread.join()", "One of its threads, such as one that spins, still ran"),
    ],
)
def test_a_server_whose_main_part_ends_before_its_thread_is_told_to_spin_itself(last, says):
    thread = "thread = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)\nthread.start()\n"
    text = f"node.create_service(Trigger, 'ask', ask)\n{thread}{last}\n"
    assert failure_report.left_thread(failure_report.TERMINATED, text).startswith(says)


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ("", "A word of the command line is text: for a number, write `type=int`"),
        (", type=float", ""),
        (", action='append'", ""),
    ],
)
def test_a_word_of_the_command_line_that_is_compared_with_a_number(option, says):
    text = f"words.add_argument('--cancel-after'{option})\nwords.add_argument('floors')\n"
    error = "TypeError: '>=' not supported between instances of 'int' and 'str'"
    said = hint(error, text, "if self.count >= self.cancel_after:")
    assert said.startswith(says) and bool(said) == bool(says)
    assert not hint(error, text, "if self.count >= self.most:")


def test_a_result_with_more_digits_than_python_writes_is_told_by_its_kind():
    told = [failure_report.of_no_result("lift", NoResult(len, each)).ending for each in (10**5000, [10**5000], 3)]
    assert told == [
        f"returned {what}, and no result from an execute callback" for what in ("an int", "a list", "3, an int")
    ]


LONG = "0x" + "f" * 4000  # has more digits than Python writes in decimal


@pytest.mark.parametrize(
    ("error", "line"),
    [
        ("TypeError: RcutilsLogger.info() takes 2 positional arguments but 3 were given", "log.info('a', {})"),
        ("TypeError: 'int' object is not callable", "{}(1)"),
        ("TypeError: can only concatenate str", "print('a' + {})"),
        ("AssertionError: The 'data' field must be of type 'str'", "msg.data = {}"),
    ],
)
def test_a_hint_on_a_line_with_a_long_number_raises_nothing(error, line):
    text = f"def main():\n    log = node.get_logger()\n    {line.format(LONG)}\n"
    assert isinstance(hint(error, text, line.format(LONG)), str)


@pytest.mark.parametrize(
    ("call", "line"), [("node.ask(words)", "node.ask(words)"), ("rclpy.spin(node)", "def ask(self, a, b):")]
)
def test_a_call_with_too_few_arguments_is_shown_where_main_makes_it(tmp_path, call, line):
    path = tmp_path / "client.py"
    path.write_text(f"class Asker(Node):\n    def ask(self, a, b):\n        pass\ndef main():\n    {call}\nmain()\n")
    frames = f'  File "{path}", line 6, in <module>\n    main()\n  File "{path}", line 5, in main\n    {call}\n'
    error = "TypeError: Asker.ask() missing 1 required positional argument: 'b'"
    report = failure_report.of_program(path, f"Traceback (most recent call last):\n{frames}{error}\n", 1)
    assert report.frames[-1].code == line
