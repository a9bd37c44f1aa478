"""colcon leaves out a workspace's packages in C++, and what needs them, and builds the rest."""

import argparse
from types import SimpleNamespace

import pytest

from course.ros import packages
from course.workspace import cpp_packages
from tests.workspace.test_build import colcon

CPP = """<package format="3">
  <name>talker_cpp</name><version>0.0.0</version><description>C++</description>
  <maintainer email="ada@uni.edu">Ada</maintainer><license>MIT</license>
  <buildtool_depend>ament_cmake</buildtool_depend><build_depend>rclcpp</build_depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""


def decorator(name: str, *needs: str) -> SimpleNamespace:
    descriptor = SimpleNamespace(name=name, get_dependencies=lambda categories: {*needs})
    return SimpleNamespace(descriptor=descriptor, selected=True)


def selected(verb: str, *decorators: SimpleNamespace) -> list[str]:
    selection = cpp_packages.CppPackageSelection()
    selection.select_packages(args=argparse.Namespace(verb_name=verb), decorators=list(decorators))
    return [each.descriptor.name for each in decorators if each.selected]


def workspace_of_both() -> tuple[SimpleNamespace, ...]:
    return (
        decorator("talker_cpp", "rclcpp", "std_msgs"),
        decorator("talker_py", "rclpy"),
        decorator("parts_cpp", "rclcpp_components"),
        decorator("bringup", "talker_cpp", "talker_py"),
    )


def test_what_needs_rclcpp_and_what_needs_that_is_left_out_and_named(capsys):
    assert selected("build", *workspace_of_both()) == ["talker_py"]
    assert "leaving out 3 packages in C++" in (said := capsys.readouterr().err)
    assert "talker_cpp, parts_cpp, bringup" in said


@pytest.mark.parametrize("why", ["installed", "in the workspace", "only listed"])
def test_nothing_is_left_out_where_it_can_be_built(why, monkeypatch, capsys):
    workspace, verb = workspace_of_both(), "list" if why == "only listed" else "build"
    libraries = ("rclcpp", "rclcpp_components")
    if why == "installed":
        monkeypatch.setattr(cpp_packages, "installed_packages", lambda: [*packages.installed_packages(), *libraries])
    elif why == "in the workspace":
        workspace = (*map(decorator, libraries), *workspace)
    assert {"talker_cpp", "talker_py", "parts_cpp", "bringup"} <= {*selected(verb, *workspace)}
    assert capsys.readouterr().err == ""


def test_colcon_asks_it(shell, tmp_path):
    folder = tmp_path / "ws/src/talker_cpp"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(CPP)
    (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.20)\nproject(talker_cpp)\n")
    done = colcon(tmp_path / "ws", shell)
    assert done.returncode == 0, done.stderr
    assert "leaving out one package in C++, because rclcpp, the ROS 2 library for C++, is not installed" in done.stderr
    assert "0 packages finished" in done.stdout
