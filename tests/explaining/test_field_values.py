"""Hints on what a line gives to a field of a message look at the value, not only at the field's type."""

import pytest

from course.explaining.hints import hint

PID = """from std_msgs.msg import Float64
from geometry_msgs.msg import Vector3
from example_interfaces.srv import AddTwoInts
class A(Node):
    def __init__(self):
        self.create_subscription(Float64, 'error', self.error_callback, 10)
        self.create_subscription(Vector3, 'wind', self.wind_callback, 10)
        self.create_service(AddTwoInts, 'add', self.answer)
    def error_callback(self, msg):
        {line}
    def wind_callback(self, msg):
        {wind}
    def answer(self, request, response):
        {answer}
    def add(self, a, b):
        {add}
"""
AGENT = """class Agent:
    def decide_action(self, distances):
        if not distances:
            return {'linear': 0.0, 'angular': 0.0}
        return {'linear': 0.3, 'angular': 0.0}
"""
DECIDES = "action = self.agent.decide_action(1)"
TURNS = f"{DECIDES}\n        cmd.linear.x = action"


@pytest.mark.parametrize(
    ("field", "kind", "part", "line", "says"),
    [
        ("data", "float", "line", "self.pub.publish(Float64(data=msg))",
         "`msg` is the whole message: its value is `msg.data`."),
        ("data", "float", "line", "msg = msg.data\n        self.pub.publish(Float64(data=msg))", "takes a float"),
        ("data", "float", "line", "self.pub.publish(Float64(data=self.add))", "Call it: `self.add()`."),
        ("data", "float", "line", "self.pub.publish(Float64(data=round(msg.data)))", "takes a float"),
        ("data", "float", "wind", "self.pub.publish(Float64(data=msg))",
         "`msg` is the whole message: write one of its fields, `msg.x` or `msg.y` or `msg.z`."),
        ("data", "float", "line", "float(a), float(b)\n        self.pub.publish(Float64(data=a))",
         "Nothing keeps the result of line 11: write `a, b = float(a), float(b)`."),
        ("data", "float", "line", "float(a)\n        self.pub.publish(Float64(data=a))", "write `a = float(a)`."),
        ("data", "float", "line", "a = float(b)\n        self.pub.publish(Float64(data=b))", "takes a float"),
        ("data", "float", "line", "int(a)\n        self.pub.publish(Float64(data=a))", "takes a float"),
        ("sum", "int", "answer", "response.sum = None",
         "None is not a value of a field. A field that nobody sets is `0`: leave this out."),
        ("data", "float", "line", "self.pub.publish(Float64(data=None))", "A field that nobody sets is `0.0`"),
        ("sum", "int", "answer", "response.sum = request",
         "`request` is the whole request: write one of its fields, `request.a` or `request.b`."),
        ("sum", "int", "answer", "response.sum = self.add(1, 2)",
         "`add` returns nothing, so `self.add(1, 2)` is None. End `add` with a `return`."),
        ("sum", "int", "answer", "total = self.add(1, 2)\n        response.sum = total",
         "Line 15: `add` returns nothing, so `total` is None."),
        ("sum", "int", "answer", "response.sum = self.sum(1, 2)", "takes a whole number"),
        ("x", "float", "wind", TURNS,
         "`action` is a dict: write one of its values, `action['linear']` or `action['angular']`."),
        ("x", "float", "wind", TURNS.replace("= action", "= action['linear']"), "takes a float"),
        ("x", "float", "wind", f"{DECIDES}\n        x, z = action\n        cmd.linear.x = x",
         "Line 14: `x, z = action` gives the keys, because `action` is a dict. Its values are `action['linear']` and"),
        ("x", "float", "wind", "x, z = self.agent.decide_action(1)\n        cmd.linear.x = x",
         "gives the keys, because what it returns is a dict."),
        ("x", "float", "wind", f"{DECIDES}\n        x, z = action.values()\n        cmd.linear.x = x", "takes a float"),
    ],
)  # fmt: skip
def test_what_a_field_is_given_is_named(tmp_path, monkeypatch, field, kind, part, line, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall_agent.py").write_text(AGENT)
    parts = {"line": "pass", "wind": "pass", "answer": "pass", "add": "print(a + b)", part: line}
    source = f"from wall_agent import Agent\n{PID.format(**parts)}"
    said = hint(f"AssertionError: The '{field}' field must be of type '{kind}'", source, line.splitlines()[-1].strip())
    assert says in said
