"""What a check adds from the text of a program: true of the mistake, and nothing of a right program."""

import pytest

from course.notebook.judging import unlike
from course.notebook.shown_by_text import no_cancel, published_only_if
from tests.mistakes import SOLUTIONS

LOOP = """class Follower(Node):
    def __init__(self):
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.loop)
    def loop(self):
        {body}
    def send(self, cmd):
        self.pub.publish(cmd)
"""
ALONE = "\nThis runs in a branch of the `if` of line 6 alone. "


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("if self.scan:\n            self.pub.publish(cmd)", f"line 7\n    self.pub.publish(cmd){ALONE}"),
        ("if self.scan:\n            self.send(cmd)", f"line 7\n    self.send(cmd){ALONE}"),
        ("if not self.scan:\n            return\n        self.pub.publish(cmd)",
         "line 7\n    return\nThis ends 'loop' without a command. "),
        ("if self.scan:\n            cmd = self.decide()\n        self.pub.publish(cmd)", ""),
        ("if self.scan:\n            self.send(cmd)\n        else:\n            self.send(Twist())", ""),
        ("try:\n            cmd = self.decide()\n        finally:\n            self.send(cmd)", ""),
        ("if not self.scan:\n            self.send(Twist())\n            return\n        self.send(cmd)", ""),
        ("pass", ""),
    ],
)  # fmt: skip
def test_a_command_that_is_published_in_a_branch_alone_is_told(tmp_path, monkeypatch, body, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "follower.py").write_text(LOOP.format(body=body))
    said = published_only_if("follower.py")
    assert says in said and bool(said) == bool(says)


def test_of_a_right_program_nothing_is_said(monkeypatch):
    monkeypatch.chdir(SOLUTIONS / "ai_integration")
    assert published_only_if("wall_follower.py") == ""
    monkeypatch.chdir(SOLUTIONS / "actions")
    assert no_cancel("lift_server.py") == ""


def test_a_server_that_never_looks_for_a_cancel_is_told(tmp_path, monkeypatch):
    text = (SOLUTIONS / "actions" / "lift_server.py").read_text()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lift_server.py").write_text(text.replace("goal_handle.is_cancel_requested", "False"))
    assert no_cancel("lift_server.py").startswith(". Nothing in lift_server.py reads `is_cancel_requested` of ")


@pytest.mark.parametrize(
    ("has", "says"),
    [
        ({"a": "float32", "name": "string"}, "`a` is a float32 and must be a float64"),
        ({"a": "float64", "nam": "string"}, "`nam` is one too many, `name` is missing"),
        ({"name": "string", "a": "float64"}, "the order must be a, name"),
    ],
)
def test_fields_that_differ_are_told_with_what_they_must_be(has, says):
    assert unlike(has, {"a": "float64", "name": "string"}) == says
