"""A file of parameters for a node of another name, of which ROS 2 says nothing."""

import pytest

from course.explaining.parameter_files import set_parameters, unparsed, unread_files, unread_words, with_tabs
from course.session.live import Session

PROGRAM = "import rclpy\nrclpy.init()\nnode = rclpy.create_node('parameter_node')\nrclpy.spin(node)\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("parameternode:\n  ros__parameters: {speed: 1.0}", "parameternode, and the node is called parameter_node"),
        ("a:\n  ros__parameters: {}\nlab:\n  b:\n    ros__parameters: {}", "for a and lab/b, and the node"),
        ("parameter_node:\n  ros__parameters: {speed: 1.0}", ""),
        ("/lab:\n  parameter_node:\n    ros__parameters: {speed: 1.0}", ""),
        ("/lab/parameter_node:\n  ros__parameters: {speed: 1.0}", ""),
        ("/**:\n  ros__parameters: {speed: 1.0}", ""),
        ("other:\n  ros__parameters: {}\nparameter_node:\n  ros__parameters: {}", ""),
        ("a: [", ""),
        ("a list", ""),
        ("", ""),
    ],
)
def test_what_a_file_is_for(tmp_path, text, told):
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    found = unread_files(["--ros-args", "--params-file", str(path)], ["/parameter_node"])
    assert bool(found) == bool(told) and told in "".join(found)
    assert unread_files(["--params-file", str(path)], []) == []
    assert unread_files(["--params-file", str(tmp_path)], ["/parameter_node"]) == []


@pytest.mark.parametrize(
    ("words", "source", "unread"),
    [
        ("--params-file a.yaml", "", "--params-file a.yaml"),
        ("--params-file a.yaml", "words.add_argument('--params-file')", ""),
        ("--ros-args --params-file a.yaml -p b:=1", "", ""),
        ("-p b:=1 --ros-args", "", "-p b:=1"),
        ("-p 80", "", ""),
    ],
)
def test_what_stands_before_the_words_for_ros_is_not_read(words, source, unread):
    assert unread_words(words.split(), source) == unread


def test_the_parameters_that_a_command_line_sets():
    words = "-p a:=1 --ros-args -p kp:=1.0 --param gains.ki:=0.5 -p other:kd:=1 -r x:=y"
    assert set_parameters(words.split()) == ["kp", "gains.ki"]


def test_a_tab_is_named_with_its_line(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text("a:\n  b: 'x\ty'\n \t c: 1\n")
    assert with_tabs(["--params-file", str(path)]) == [
        f"{path}, line 3, begins with a tab: a parameter file is indented with spaces only."
    ]
    path.write_text("a:\n  b: 'x\ty'\n")
    assert with_tabs(["--params-file", str(path)]) == []


def test_a_file_that_is_started_with_one(tmp_path):
    (tmp_path / "robot.yaml").write_text("other:\n  ros__parameters: {use_sim_time: true}\n")
    (tmp_path / "program.py").write_text(PROGRAM)
    session = Session()
    try:
        session.start(tmp_path / "program.py", "--ros-args", "--params-file", str(tmp_path / "robot.yaml"))
        (told,) = session.watch.notices()
    finally:
        session.close()
    assert "has parameters for other, and the node is called parameter_node" in told


def test_a_parameter_without_its_option_is_told():
    said = unparsed("rclpy._rclpy_pybind11.UnknownROSArgsError: ['max_speed:=2.0']")
    assert said == "A parameter on a command line has `-p` before it: `-p max_speed:=2.0`."
    assert unparsed("rclpy._rclpy_pybind11.UnknownROSArgsError: ['max_speed']") == ""


RULE = "failed to initialize rcl: Couldn't parse parameter override rule: '{}'. Error: Expected"
OPTION = "rclpy._rclpy_pybind11.UnknownROSArgsError: [{}]"


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (RULE.format("-p max_speed:"), "after `:=`, without a space: `-p max_speed:=2.0`, for example."),
        (RULE.format("-p max-speed:=1.2"), "The name of a parameter has no `-`. Did you mean `-p max_speed:=1.2`?"),
        (OPTION.format("'--params', 'robot.yaml'"), "ROS 2 has no option `--params`. Did you mean `--params-file`?"),
        (OPTION.format("'--remaps', 'a:=b'"), "ROS 2 has no option `--remaps`. Did you mean `--remap`?"),
        (OPTION.format("'--verbose'"), ""),
        ("Trying to set parameter 'v' to '1,2' of type 'STRING', expecting type 'DOUBLE'", "point: `1.2`, not `1,2`."),
        (
            "Trying to set parameter 'v' to '1' of type 'INTEGER', expecting type 'DOUBLE'",
            "1 is an integer: write 1.0.",
        ),
        ("Trying to set parameter 'v' to 'a,b' of type 'STRING', expecting type 'DOUBLE'", ""),
    ],
)
def test_words_of_a_command_line_that_ros_cannot_read(error, says):
    assert says in unparsed(error) and bool(says) == bool(unparsed(error))


@pytest.mark.parametrize(
    ("text", "near", "line"),
    [
        (
            "/**:\n  ros__parameters:\n    name: talos\n    max_speed = 0.8  # m/s: fast\n    a: true\n",
            3,
            "4, `max_speed = 0",
        ),
        ("\nparameter_node\n  ros__parameters:\n    a: 1.0\n", 2, "2, `parameter_node`"),
        ("/**:\n  ros__parameters:\n   a: 1\n    b: 0.8\n", 3, ""),
    ],
)
def test_a_line_of_a_file_without_its_colon_is_named(tmp_path, text, near, line):
    (path := tmp_path / "robot.yaml").write_text(text)
    said = unparsed(
        f"Couldn't parse params file: '--params-file {path}'. Error: Error parsing a event near line {near}, at"
    )
    assert bool(said) == bool(line) and said.startswith(f"{path}, line {line}" if line else "")
