"""`ros2 param` reads and changes parameters as ros2cli does."""

import pytest

from course.ros import parameter_services

CALL = parameter_services.call
NODE = "/parameter_node"
NAMES = """\
  debug_mode
  gains
  joints
  max_speed
  pid.i
  pid.p
  robot_name
  serial
  start_type_description_service
  threshold
  use_sim_time
"""
DESCRIPTIONS = """\
Parameter name: max_speed
  Type: double
  Description: Top speed in m/s
  Constraints:
    Min value: 0.0
    Max value: 5.0
    Step: 0.5
Parameter name: serial
  Type: integer
  Constraints:
    Read only: true
"""


def test_list_of_a_node_and_of_all_nodes(ros2):
    """Two spaces before a name; the node's name above them when nobody asked for one node."""
    assert ros2.output("param", "list", NODE) == NAMES
    everything = ros2.output("param", "list")
    assert f"{NODE}:\n{NAMES}" in everything
    assert everything.startswith("/add_two_ints_server:\n  start_type_description_service\n  use_sim_time\n/fib")
    assert "silent" not in everything


def test_list_filters_and_types(ros2):
    """`--filter` is a regular expression, `--param-prefixes` names groups, `--param-type` adds the type."""
    assert ros2.output("param", "list", NODE, "--filter", ".*_name") == "  robot_name\n"
    assert ros2.output("param", "list", NODE, "--param-prefixes", "pid", "--param-type") == (
        "  pid.i (type: double)\n  pid.p (type: double)\n"
    )
    done = ros2("param", "list", NODE, "--filter", "[")
    assert done.returncode == 1 and done.stderr.startswith("Invalid regular expression '['")


def test_get_prints_the_value_after_its_type(ros2):
    """ros2cli's labels; an array prints as a list; `--hide-type` leaves the value, for scripts."""
    assert ros2.outputs(
        f"param get {NODE} debug_mode",
        f"param get {NODE} serial",
        f"param get {NODE} gains",
        f"param get {NODE} joints",
        "param get parameter_node serial --hide-type",
    ) == [
        "Boolean value is: False\n",
        "Integer value is: 42\n",
        "Double values are: [1.0, 2.5]\n",
        "String values are: ['hip', 'knee']\n",
        "42\n",
    ]


def test_get_of_an_undeclared_parameter(ros2):
    """ros2cli's message, status 1."""
    done = ros2("param", "get", NODE, "nothing")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "Parameter not set\n")


def test_set_and_get_of_a_misspelt_parameter_name_the_near_one(ros2):
    for verb, more in (("get", ()), ("set", ("2.0",))):
        done = ros2("param", verb, NODE, "max_sped", *more)
        assert "Did you mean max_speed?\n" in done.stderr, done.stderr


def test_an_unknown_node(ros2):
    """Every verb says the same, status 1."""
    verbs = ("get /no x", "set /no x 1", "delete /no x", "describe /no x", "dump /no", "load /no x.yaml", "list /no")
    for done in ros2.each(*(f"param {verb}" for verb in verbs)):
        assert (done.returncode, done.stdout, done.stderr) == (1, "", "Node not found\n")


def test_set_then_get(ros2):
    """The chapter's `param set`, and the type that YAML gives a value."""
    done = "Set parameter successful\n"
    assert ros2.outputs(f"param set {NODE} max_speed 3.0", f"param set {NODE} gains '[4.0, 5.0]'") == [done, done]
    assert ros2.outputs(f"param get {NODE} max_speed", f"param get {NODE} gains") == [
        "Double value is: 3.0\n",
        "Double values are: [4.0, 5.0]\n",
    ]
    assert ros2.output("param", "set", NODE, "gains", "[1.0, 2.5]") == done


def test_set_tells_a_refusal_with_the_node_s_reason(ros2):
    """On stderr, and with status 0 as in ros2cli; a reason is there only if the node gave one."""
    refusals = {
        "max_speed 99.0": ": Parameter max_speed out of range Min: 0.0, Max: 5.0, value: 99.0",
        "serial 1": ": Trying to set a read-only parameter: serial.",
        "threshold -- -1.0": ": must not be negative",
        "robot_name nobody": "",
        "debug_mode 3": ": Wrong parameter type, expected 'Type.BOOL' got 'Type.INTEGER'",
        "max_speed 1,5": (
            ": Wrong parameter type, expected 'Type.DOUBLE' got 'Type.STRING'\nA number has a decimal point: 1.5"
        ),
    }
    ran = ros2.each(*(f"param set {NODE} {words}" for words in refusals))
    assert [done.stderr for done in ran] == [f"Setting parameter failed{reason}\n" for reason in refusals.values()]
    assert [(done.returncode, done.stdout) for done in ran] == [(0, "")] * len(ran)


def test_describe(ros2):
    """Type, description and constraints."""
    assert ros2.output("param", "describe", NODE, "max_speed", "serial") == DESCRIPTIONS


def test_dump_is_what_load_reads(ros2, tmp_path):
    """A dump saved by redirection, edited, and loaded back: Jazzy's dump has no `--output-dir` any more."""
    saved = ros2.output("param", "dump", NODE)
    assert saved.startswith("/parameter_node:\n  ros__parameters:\n    debug_mode: false\n    gains:\n    - 1.0\n")
    assert "    pid:\n      i: 0.1\n      p: 1.0\n" in saved and saved.endswith("\n\n")
    file = tmp_path / "parameters.yaml"
    file.write_text("/parameter_node:\n  ros__parameters:\n    pid:\n      p: 2.0\n    serial: 7\n")
    done = ros2("param", "load", NODE, str(file))
    assert done.stdout == "Set parameter pid.p successful\n"
    assert done.stderr == "Set parameter serial failed: Trying to set a read-only parameter: serial.\n"
    assert ros2.output("param", "get", NODE, "pid.p") == "Double value is: 2.0\n"
    file.write_text("/parameter_node:\n  ros__parameters:\n    pid.p: 1.0\n")
    assert ros2.output("param", "load", NODE, str(file)) == "Set parameter pid.p successful\n"
    refused = ros2("param", "dump", NODE, "--output-dir", str(tmp_path))
    assert refused.returncode == 2 and "unrecognized arguments: --output-dir" in refused.stderr


def test_load_takes_what_a_file_has_for_every_node(ros2, tmp_path):
    """`/**:` counts, under the node's own values, unless `--no-use-wildcard` is given."""
    file = tmp_path / "parameters.yaml"
    file.write_text("/**:\n  ros__parameters:\n    pid.p: 3.0\n    pid.i: 0.1\n")
    assert sorted(ros2.output("param", "load", NODE, str(file)).splitlines()) == [
        "Set parameter pid.i successful",
        "Set parameter pid.p successful",
    ]
    assert ros2.output("param", "get", NODE, "pid.p", "--hide-type") == "3.0\n"
    file.write_text(file.read_text() + f"{NODE}:\n  ros__parameters:\n    pid.p: 1.0\n")
    assert ros2.output("param", "load", "--no-use-wildcard", NODE, str(file)) == "Set parameter pid.p successful\n"
    assert "Set parameter pid.p successful\n" in ros2.output("param", "load", NODE, str(file))
    assert ros2.output("param", "get", NODE, "pid.p", "--hide-type") == "1.0\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("/parameter_node:\n  serial: 7\n", "YAML file is not a valid ROS parameter file for node /parameter_node"),
        ("just text", "YAML file is not a valid ROS parameter file"),
        ("{a: [", "YAML file is not a valid ROS parameter file"),
        (None, "No such file or directory: 'parameters.yaml'"),
    ],
)
def test_load_of_what_is_no_parameter_file(ros2, tmp_path, content, message):
    """One message, status 1, no traceback."""
    if content is not None:
        (tmp_path / "parameters.yaml").write_text(content)
    done = ros2("param", "load", NODE, "parameters.yaml", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(message)


def test_delete(ros2):
    """A parameter of dynamic type can be undeclared, others refuse."""
    assert ros2.output("param", "delete", "/talker", "spare") == "Deleted parameter successfully\n"
    gone, refused = ros2.each("param get /talker spare", "param delete /talker use_sim_time")
    assert gone.stderr == "Parameter not set\n"
    assert refused.returncode == 0
    assert refused.stderr.startswith("Deleting parameter failed: ")


class Unanswered:
    """A graph with a node whose parameter services are there and do not answer before the third look."""

    def __init__(self):
        self.node = self
        self.asked = []
        self.looks = 0

    def create_client(self, service, name):
        return self

    def service_is_ready(self):
        return True

    def call_async(self, request):
        self.asked.append(request)
        return self

    def done(self):
        return self.looks > 3

    def result(self):
        return self.asked[-1]

    def wait_until(self, ready, timeout):
        return ready()

    def spin(self, until, timeout):
        self.looks += 1
        return until()


@pytest.mark.parametrize(("kind", "asked"), [("ListParameters", 4), ("SetParameters", 1)])
def test_a_node_that_does_not_answer_is_told_once_while_it_is_asked(monkeypatch, capsys, kind, asked):
    monkeypatch.setattr(parameter_services, "TELL", 0.0)
    graph = Unanswered()
    monkeypatch.setattr(parameter_services, "call", lambda *_: None)  # that comes before something is set
    assert CALL(graph, "busy", kind) is graph.asked[-1]
    assert len(graph.asked) == asked  # a set is sent once
    assert capsys.readouterr().err == (
        "still waiting: /busy does not answer. Is it in a callback that does not return? Ctrl-C ends this.\n"
    )
