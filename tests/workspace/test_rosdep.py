"""`rosdep` in a terminal of the course: which packages a workspace needs that are not here."""

import pytest

from course.workspace.rosdep import ALL_THERE, main

MANIFEST = "<package format='3'><name>{name}</name>{needs}<test_depend>ament_flake8</test_depend></package>"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Lays a package into the workspace that one stands in."""
    monkeypatch.chdir(tmp_path)

    def lay(name: str, **needs: str) -> None:
        (tmp_path / "src" / name).mkdir(parents=True)
        lines = "".join(f"<{tag}>{need}</{tag}>" for need, tag in needs.items())
        (tmp_path / "src" / name / "package.xml").write_text(MANIFEST.format(name=name, needs=lines))

    return lay


@pytest.mark.parametrize("option", ["--from-path", "--from-paths"])
def test_all_is_there(package, option, capsys):
    """The wheels' packages, the other packages of the workspace, and libraries that can be imported."""
    package(
        "mine", rclpy="depend", other="exec_depend", example_interfaces="build_depend", **{"python3-numpy": "depend"}
    )
    package("other")
    assert main(["install", "-i", option, "src", "--rosdistro", "jazzy", "-y"]) == 0
    assert capsys.readouterr() == (f"{ALL_THERE}\n", "")


def test_what_is_missing_is_named_with_who_needs_it(package, capsys):
    package("clouds", sensor_msgs_py="exec_depend", sensor_msgs="depend")
    package("more_clouds", sensor_msgs_py="depend", **{"python3-no-such-library": "depend"})
    assert main(["install", "--from-paths", "src", "-y", "--ignore-src"]) == 1
    said = capsys.readouterr()
    library, module = said.err.splitlines()
    assert library.startswith(
        "python3-no-such-library is not installed here, but more_clouds needs it. If it is on PyPI"
    )
    assert (
        module.startswith("sensor_msgs_py is not installed here, but clouds, more_clouds needs it. ")
        and "into src" in module
    )
    assert said.out == ""


def test_a_wrong_folder_and_the_other_commands(package, capsys):
    assert main(["install", "-i", "--from-path", "src"]) == 1
    assert capsys.readouterr().err == "rosdep: there is no folder src: go to the workspace's root first\n"
    assert main(["update"]) == 0
    assert "rosdep install" in capsys.readouterr().out
