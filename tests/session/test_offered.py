"""The names that a program's text can offer: those that are written out, and no others."""

import pytest

from course.ros.names import SERVICES_OF_EVERY_NODE
from course.session.offered import _has_none, client_for_service, never_made, other_names, services_made, strangers
from tests.hidden import answers

SERVER = "class Server(Node):\n    def __init__(self):\n        self.create_service(Ask, {name}, self.ask)\n"


@pytest.mark.parametrize(("name", "found"), [("'/asks'", "/asks"), ("'asks'", "asks")])
def test_a_name_that_is_written_out_and_is_another_one(name, found):
    assert other_names(SERVER.format(name=name), "create_service", "/ask") == [(found, 3)]


@pytest.mark.parametrize("name", ["'/ask'", "'ask'", "'~/ask'", "NAME", "f'{space}/ask'", "'/a' + 'sk'"])
def test_a_name_that_may_be_the_wanted_one(name):
    assert other_names(SERVER.format(name=name), "create_service", "/ask") == []


@pytest.mark.parametrize("name", ["'ask'", "'~/ask'"])
def test_a_name_in_a_namespace(name):
    assert other_names(SERVER.format(name=name), "create_service", "/robot/ask") == []


def test_one_of_several_names_is_the_wanted_one():
    text = SERVER.format(name="'/asks'") + "        self.create_service(Ask, '/ask', self.ask)\n"
    assert other_names(text, "create_service", "/ask") == []


ASKS = "import rclpy\nnode.create_client(Ask, '/robot/ask')\nnode.create_publisher(Text, 'said', 10)\n"


@pytest.mark.parametrize(
    ("other", "are"),
    [
        ("import rclpy\nnode.create_service(Ask, '/asks', answer)\n", True),
        ("import rclpy\nnode.create_service(Ask, '~/ask', answer)\n", False),
        ("import rclpy\nnode.create_subscription(Text, '/said', hear, 10)\n", False),
        ("import rclpy\nnode.create_service(Ask, NAME, answer)\n", False),
        ("import rclpy\nnode.create_client(SetParameters, '/asks/set_parameters')\n", False),
        ("import rclpy\nnode.create_timer(1.0, tick)\n", True),
        ("import rclpy\nmake = node.create_service\n", False),
        ("import rclpy\nAsyncParameterClient(node, 'ask')\n", False),
        ("from course.nodes import add_two_ints_server\n", False),
        ("import rclpy\nimport own\nnode.create_service(Ask, '/asks', answer)\n", False),
        ("print('no ROS')\n", True),
        ("", False),
    ],
)
def test_programs_that_have_no_name_in_common(tmp_path, monkeypatch, other, are):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").touch()  # it may make anything
    assert strangers(ASKS, other) == strangers(other, ASKS) == are


def test_a_program_that_makes_none_at_all(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "from agent import Agent\n\nclass Server(Node):\n    pass\n"
    assert _has_none(text, "create_service")
    assert not _has_none(text.replace("(Node)", "(Base)"), "create_service")  # its base may make one
    assert not _has_none("print('no class')", "create_service")
    (tmp_path / "agent.py").touch()  # it may make one for the node
    assert not _has_none(text, "create_service")


def test_the_services_that_a_program_can_make():
    own = "import rclpy\n" + SERVER
    assert services_made(own.format(name="'~/asks'")) == ["~/asks", *sorted(SERVICES_OF_EVERY_NODE)]
    assert services_made(own.format(name="NAME")) is None
    assert services_made("print('no node')") == []
    assert services_made("import rclpy\n\nclass Server(Node):\n    pass\n") == sorted(SERVICES_OF_EVERY_NODE)
    assert services_made("") is None


NEEDED = {
    "services": [
        ("motor_service.py", "create_service", "/motors/enable"),
        ("motor_service.py", "create_service", "/motors/emergency_stop"),
        ("motor_service.py", "create_service", "/motors/status"),
        ("relay.py", "create_service", "/relay"),
    ],
    "calculator": [
        ("calculator_server.py", "create_service", "/calculator"),
        ("calculator_client.py", "create_client", "/calculator"),
    ],
    "actions": [
        ("lift_server.py", "ActionServer", "/lift"),
        ("lift_server.py", "create_service", "/lift/block"),
        ("lift_client.py", "ActionClient", "/lift"),
    ],
    "parameters": [("pid_node.py", "create_subscription", "/error"), ("pid_node.py", "create_publisher", "/effort")],
    "ai_integration": [
        ("wall_follower.py", "create_subscription", "/scan"),
        ("wall_follower.py", "create_publisher", "/cmd_vel"),
    ],
}


@pytest.mark.parametrize("exercise", NEEDED)
def test_no_right_answer_is_taken_for_one_that_offers_something_else(exercise, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in answers.load(exercise).RIGHT:
        files = answers.files(exercise, name)
        for file, content in files.items():
            (tmp_path / file).write_bytes(content)
        for file, maker, needed in NEEDED[exercise]:
            text = files[file].decode(errors="replace")
            assert not other_names(text, maker, needed), (name, file)
            assert not _has_none(text, maker), (name, file)


MAKES = "class A(Node):\n    def __init__(self):\n        self.{}(Calculate, '{}', self.calculate)\n"


def test_a_client_in_the_place_of_a_service_is_told():
    says = client_for_service(MAKES.format("create_client", "calculator"), "/calculator")
    assert says.startswith("`create_client(...)` in line 3 makes a client, which asks.")
    assert "`create_service(TheType, '/calculator', self.callback)`" in says
    for maker, name in (("create_service", "/calculator"), ("create_client", "/other")):
        assert client_for_service(MAKES.format(maker, name), "/calculator") == ""


LATE = """class Motors(Node):
    def __init__(self):
        self.create_service(SetBool, '/enable', self.enable)
        {begins}
    def enable(self, request, response):
        {line}
        return response
    def make(self):
        {helper}
"""
STATUS = "self.create_service(Trigger, '/status', self.status)"


@pytest.mark.parametrize(
    ("part", "text", "says"),
    [
        ("line", STATUS,
         f"\n  motors.py, line 6, in enable\n    {STATUS}\nThis is in a callback, and runs only when that is called."),
        ("begins", f"return\n        {STATUS}",
         f"\n  motors.py, line 5, in __init__\n    {STATUS}\nThis never runs: the `return` of line 4 ends '__init__'."),
        ("begins", f"return\n        self.on = 1\n        {STATUS}", "\n  motors.py, line 6, in __init__"),
        ("begins", f"if self.on: return\n        {STATUS}", ""),
        ("helper", STATUS, ""),
        ("line", STATUS.replace("status", "stop"), ""),
    ],
)  # fmt: skip
def test_a_service_that_is_not_made_is_told_with_its_line(part, text, says):
    source = LATE.format(**{"begins": "pass", "line": "pass", "helper": "pass", part: text})
    said = never_made("motors.py", source, "/status")
    assert said.startswith(says) and bool(said) == bool(says)


def test_a_service_behind_a_return_is_not_waited_for():
    parts = {"line": "pass", "helper": "pass"}
    for begins, names in (("return", [("/enable", 3)]), ("pass", [])):
        text = LATE.format(**parts, begins=f"{begins}\n        {STATUS}")
        assert other_names(text, "create_service", "/status", reached=True) == names
        assert other_names(text, "create_service", "/status") == []
