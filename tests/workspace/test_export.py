"""`course export`: which files it makes, what it keeps, and what it says to bad input, always in one line."""

import ast
import json
import os
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

from course.environment import foreign_distribution, sourced, workspace_variables
from course.errors import InterfaceError, WorkspaceError
from course.workspace.export import export
from tests.workspace.conftest import ROOT, SOLUTIONS

EXERCISES = sorted(path.name for path in SOLUTIONS.iterdir() if path.is_dir())


@pytest.fixture
def files(tmp_path) -> Path:
    """A student's folder of the calculator."""
    return Path(shutil.copytree(SOLUTIONS / "calculator", tmp_path / "files"))


def tree(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refusal(*arguments, error=WorkspaceError, **options) -> str:
    """The one line that says why nothing was exported."""
    with pytest.raises(error) as raised:
        export(*arguments, **options)
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_the_calculator_becomes_two_packages(tmp_path):
    lines = export("calculator", tmp_path / "ws", SOLUTIONS / "calculator")
    source = tmp_path / "ws/src"
    assert lines == [
        f"{source}/calculator_interfaces: Calculate.srv",
        f"{source}/calculator: calculator_server.py, calculator_client.py",
    ]
    assert sorted(tree(source)) == [
        "calculator/calculator/__init__.py",
        "calculator/calculator/calculator_client.py",
        "calculator/calculator/calculator_server.py",
        "calculator/package.xml",
        "calculator/resource/calculator",
        "calculator/setup.cfg",
        "calculator/setup.py",
        "calculator_interfaces/CMakeLists.txt",
        "calculator_interfaces/package.xml",
        "calculator_interfaces/srv/Calculate.srv",
    ]
    for name in ("calculator_server.py", "calculator_client.py"):
        assert (source / "calculator/calculator" / name).read_bytes() == (SOLUTIONS / "calculator" / name).read_bytes()
    manifest = ElementTree.parse(source / "calculator_interfaces/package.xml").getroot()
    assert manifest.findtext("member_of_group") == "rosidl_interface_packages"
    assert manifest.findtext("export/build_type") == "ament_cmake"
    needs = ElementTree.parse(source / "calculator/package.xml").getroot()
    assert [each.text for each in needs.findall("exec_depend")] == ["calculator_interfaces", "rclpy"]
    assert "'calculator_server = calculator.calculator_server:main'" in (source / "calculator/setup.py").read_text()


@pytest.mark.parametrize("name", EXERCISES)
def test_every_exercise_can_be_exported_and_needs_nothing_of_the_course(tmp_path, name):
    export(name, tmp_path, SOLUTIONS / name)
    for path in tmp_path.rglob("*.py"):
        imported = [n.module for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.ImportFrom)]
        assert "course" not in {module.partition(".")[0] for module in imported}
    packages = {path.name for path in (tmp_path / "src").iterdir()}
    extra = {"calculator": {"calculator_interfaces"}, "actions": {"course_interfaces"}}
    assert packages == {name} | extra.get(name, set())


def test_the_command_exports_the_current_folder(files, course_command):
    done = course_command("export", "calculator", "ws", cwd=files)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[0] == "ws/src/calculator_interfaces: Calculate.srv"
    refused = course_command("export", "calculator", "ws", "--from", "nowhere", cwd=files)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert refused.stderr == "course export: there is no folder nowhere\n"


def test_interfaces_that_use_others_say_so(tmp_path, files):
    notebook = (ROOT / "notebooks/calculator/calculator.ipynb").read_text()
    (files / "moving.ipynb").write_text(notebook.replace("%%exercise Calculate.srv", "%%exercise Calculate.action"))
    (files / "Calculate.action").write_text("geometry_msgs/Point goal\n---\nbool done\n---\nfloat64 left\n")
    export("moving", tmp_path, files)
    rules = (tmp_path / "src/calculator_interfaces/CMakeLists.txt").read_text()
    assert "find_package(geometry_msgs REQUIRED)" in rules
    assert '"action/Calculate.action"\n  DEPENDENCIES action_msgs geometry_msgs\n' in rules


@pytest.mark.parametrize(
    "line",
    [
        "%%exercise Calculate.srv --package calculator_interfaces",
        "%%exercise --package=calculator_interfaces Calculate.srv",
        "%%exercise --no-start Calculate.srv --package  calculator_interfaces -- it's an argument",
    ],
)
def test_the_options_of_an_exercise_cell_come_in_any_order(tmp_path, files, line):
    cell = {"cell_type": "code", "source": f"{line}\nfloat64 a\n"}
    (files / "one.ipynb").write_text(json.dumps({"cells": [cell]}))
    assert export("one", tmp_path, files) == [f"{tmp_path}/src/calculator_interfaces: Calculate.srv"]


def test_a_later_export_brings_files_up_to_date_and_leaves_others_alone(tmp_path, files):
    export("calculator", tmp_path / "ws", files)
    package = tmp_path / "ws/src/calculator"
    (package / "launch").mkdir()
    (package / "launch/both.launch.py").write_text("mine")
    (files / "calculator_server.py").write_text("def main(args=None):\n    return 3\n")
    export("calculator", tmp_path / "ws", files)
    assert "return 3" in (package / "calculator/calculator_server.py").read_text()
    assert (package / "launch/both.launch.py").read_text() == "mine"


def test_a_file_edited_in_the_workspace_is_kept(tmp_path, files):
    export("calculator", tmp_path / "ws", files)
    edited = tmp_path / "ws/src/calculator/setup.py"
    edited.write_text("mine")
    (files / "Calculate.srv").write_text("int64 a\n---\nint64 b\n")
    before = tree(tmp_path / "ws")
    assert "src/calculator/setup.py was edited" in refusal("calculator", tmp_path / "ws", files)
    assert tree(tmp_path / "ws") == before
    for number, text in enumerate(("mine", "mine again"), 1):
        edited.write_text(text)
        export("calculator", tmp_path / "ws", files, force=True)
        assert "entry_points" in edited.read_text()
        assert edited.with_name("setup.py" + "~" * number).read_text() == text


def test_a_package_of_that_name_made_by_hand_is_kept(tmp_path, files):
    mine = tmp_path / "src/calculator/package.xml"
    mine.parent.mkdir(parents=True)
    mine.write_text("<package><name>calculator</name></package>")
    assert "was not written by an export" in refusal("calculator", tmp_path, files)
    elsewhere = tmp_path / "src/deep/er/package.xml"
    elsewhere.parent.mkdir(parents=True)
    mine.rename(elsewhere)
    assert "colcon builds only one package of each name" in refusal("calculator", tmp_path, files)


def test_a_broken_package_xml_elsewhere_is_told(tmp_path, files):
    other = tmp_path / "src/other/package.xml"
    other.parent.mkdir(parents=True)
    other.write_text("<package><name>")
    assert any("its package.xml is broken" in line for line in export("calculator", tmp_path, files))
    assert other.read_text() == "<package><name>"


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("calculator_server.py", None, "run its %%exercise cell in calculator.ipynb"),
        ("calculator_server.py", "print('no function')\n", "write `def main(args=None):`"),
        ("calculator_server.py", "def main(args):\n    pass\n", "calls main without arguments"),
        ("calculator_server.py", "def main(*, args):\n    pass\n", "calls main without arguments"),
        ("calculator_server.py", "def main(:\n", "calculator_server.py, line 1"),
        ("calculator_server.py", "def main(args=None):\0\n", "calculator_server.py"),
    ],
)
def test_a_program_that_cannot_be_a_command(tmp_path, files, file, text, said):
    (files / file).unlink()
    if text is not None:
        (files / file).write_text(text)
    assert said in refusal("calculator", tmp_path / "ws", files)
    assert not (tmp_path / "ws").exists()


def test_a_program_that_is_not_text_and_a_definition_that_ros_refuses(tmp_path, files):
    (files / "calculator_client.py").write_bytes(b"\xff\xfe")
    assert "not UTF-8" in refusal("calculator", tmp_path / "ws", files)
    shutil.copy(SOLUTIONS / "calculator/calculator_client.py", files)
    (files / "Calculate.srv").write_text("float a\n---\n")
    assert "Calculate.srv, line 1" in refusal("calculator", tmp_path / "ws", files, error=InterfaceError)


@pytest.mark.parametrize(
    "name", ["My_Package", "my-package", "1st", "my__package", "_my", "a", "class", "mein_überblick"]
)
def test_a_package_name_that_ros_does_not_allow(tmp_path, files, name):
    assert f"'{name}' is not a valid package name" in refusal("calculator", tmp_path / "ws", files, package=name)


@pytest.mark.parametrize("name", ["rclpy", "json", "calculator_interfaces"])
def test_a_package_name_that_hides_another(tmp_path, files, name):
    assert "would hide an existing package" in refusal("calculator", tmp_path / "ws", files, package=name)


@pytest.mark.parametrize("linked", ["src", "src/calculator", "src/calculator/calculator", "src/calculator/setup.py"])
def test_a_link_out_of_the_workspace_is_not_followed(tmp_path, files, linked):
    """Also not if the workspace came with a record that names what lies there."""
    export("calculator", tmp_path / "ws", files)
    there = (tmp_path / "ws" / linked).rename(tmp_path / "elsewhere")
    (tmp_path / "ws" / linked).symlink_to(there)
    (files / "calculator_server.py").write_text((files / "calculator_server.py").read_text() + "# newer\n")
    before = tree(tmp_path)
    said = refusal("calculator", tmp_path / "ws", files)
    assert f"nothing was written: {tmp_path / 'ws' / linked} is a link to {there}, outside of the workspace" in said
    assert tree(tmp_path) == before


def test_links_to_a_workspace_and_within_it_are_followed(tmp_path, files):
    export("calculator", tmp_path / "ws", files)
    (tmp_path / "ws/src/calculator").rename(tmp_path / "ws/mine")
    (tmp_path / "ws/src/calculator").symlink_to("../mine")
    (tmp_path / "link").symlink_to("ws")
    (files / "calculator_server.py").write_text((files / "calculator_server.py").read_text() + "# newer\n")
    export("calculator", tmp_path / "link", files)
    assert (tmp_path / "ws/mine/calculator/calculator_server.py").read_text().endswith("# newer\n")


@pytest.mark.timeout(30)  # s; a pipe would be waited for without an end
def test_a_pipe_is_not_waited_for(tmp_path, files):
    made = tmp_path / "ws/src/calculator/setup.py"
    for pipe in (tmp_path / "ws/.course-export.json", made, tmp_path / "ws/src/other/package.xml"):
        pipe.parent.mkdir(parents=True, exist_ok=True)
        os.mkfifo(pipe)
    assert "src/calculator/setup.py was edited, or was not" in refusal("calculator", tmp_path / "ws", files)
    made.unlink()
    assert any("broken (it is not an ordinary file)" in line for line in export("calculator", tmp_path / "ws", files))
    (files / "calculator_server.py").unlink()
    os.mkfifo(files / "calculator_server.py")
    assert "calculator_server.py: it is not an ordinary file" in refusal("calculator", tmp_path / "ws", files)


@pytest.mark.parametrize("folder", ["my workspace", "Überblick", "a;b c"])
def test_a_folder_in_which_ros_cannot_build_interfaces(tmp_path, files, folder):
    assert "ROS 2 cannot build interfaces" in refusal("calculator", tmp_path / folder, files)
    assert not (tmp_path / folder).exists()


def test_files_may_come_from_a_folder_with_a_space_and_an_umlaut(tmp_path, files):
    folder = files.rename(tmp_path / "meine Übung")
    assert len(export("calculator", tmp_path / "ws", folder)) == 2


def test_a_full_disk_leaves_the_workspace_as_it_was(tmp_path, files, shell):
    export("calculator", tmp_path / "ws", files)
    before = tree(tmp_path / "ws")
    text = (files / "calculator_server.py").read_text()
    (files / "calculator_server.py").write_text(text + "#" * 5000)
    limited = ["bash", "-c", f"ulimit -f 4; exec course export calculator {tmp_path / 'ws'}"]  # blocks of 1024 bytes
    done = subprocess.run(limited, cwd=files, env=shell, capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.startswith("course export: cannot write "), done
    assert done.stderr.count("\n") == 1 and "choose another WORKSPACE" in done.stderr
    assert tree(tmp_path / "ws") == before


def test_a_folder_that_cannot_be_written(files):
    assert "choose another WORKSPACE" in refusal("calculator", Path("/proc/ws"), files)
    assert "choose another WORKSPACE" in refusal("calculator", Path("/dev/null"), files)


def test_what_a_robot_will_not_find_is_told(tmp_path, files):
    (files / "calculator_client.py").write_text(
        "import course\nimport calculator_server\ndef main(args=None):\n    pass\n"
    )
    notes = [line for line in export("calculator", tmp_path, files) if line.startswith("Note: ")]
    assert len(notes) == 1 and "imports course" in notes[0]


def test_a_file_without_main_is_a_module_that_the_others_import_from_the_package(tmp_path):
    export("ai_integration", tmp_path, SOLUTIONS / "ai_integration", package="robot")
    package = tmp_path / "src/robot"
    assert "from robot.wall_agent import WallAgent\n" in (package / "robot/wall_follower.py").read_text()
    assert "wall_agent" not in (package / "setup.py").read_text()


@pytest.mark.parametrize(
    ("written", "exported"),
    [
        ("import calculator_server", "from calculator import calculator_server"),
        ("import calculator_server as server  # mine", "from calculator import calculator_server as server  # mine"),
        ("from calculator_server import main as serve", "from calculator.calculator_server import main as serve"),
    ],
)
def test_a_file_beside_it_is_imported_from_the_package(tmp_path, files, written, exported):
    (files / "calculator_client.py").write_text(f"{written}\ndef main(args=None):\n    pass\n")
    export("calculator", tmp_path, files)
    assert (tmp_path / "src/calculator/calculator/calculator_client.py").read_text().startswith(f"{exported}\n")


def test_a_foreign_ros_is_told_and_is_no_reason_to_refuse(tmp_path, files, course_command):
    done = course_command("export", "calculator", "ws", cwd=files, ROS_DISTRO="humble")
    assert done.returncode == 0 and done.stdout.splitlines()[-1].startswith("Note: ROS 2 humble is sourced here")


def test_the_courses_own_shell_is_no_sourced_ros(tmp_path, monkeypatch):
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    for name, value in workspace_variables().items():
        monkeypatch.setenv(name, value)
    assert not sourced() and not foreign_distribution()
    (tmp_path / "share/rclpy").mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}{os.pathsep}{os.environ['AMENT_PREFIX_PATH']}")
    assert sourced() and workspace_variables() == {}
    monkeypatch.setenv("ROS_DISTRO", "humble")
    assert foreign_distribution() == "humble"


def test_without_a_notebook_the_exercise_is_unknown(tmp_path):
    assert "there is no exercise 'juggling'; there are: actions," in refusal("juggling", tmp_path / "ws", tmp_path)
    (tmp_path / "broken.ipynb").write_text("{")
    assert "cannot read" in refusal("broken", tmp_path / "ws", tmp_path)
    (tmp_path / "empty.ipynb").write_text('{"cells": []}')
    assert "nothing to export" in refusal("empty", tmp_path / "ws", tmp_path)
