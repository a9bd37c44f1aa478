"""Real colcon builds what was exported, and the chapter's three terminals (3.5) work in it."""

import os
import pty
import subprocess
from pathlib import Path

import pytest

from course.environment import workspace_variables
from course.foundation.waiting import wait_until
from course.workspace.export import export
from tests.workspace.conftest import SOLUTIONS

SECONDS = 200  # s for one build on a busy machine


def colcon(workspace: Path, shell: dict[str, str], *options: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        ["colcon", "build", *options],
        cwd=workspace,
        env=shell,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        stdin=subprocess.DEVNULL,
    )


@pytest.fixture(scope="session")
def workspace(tmp_path_factory, shell) -> Path:
    """The calculator's workspace, built as on a robot: without an option."""
    folder = tmp_path_factory.mktemp("robot") / "ros2_ws"
    export("calculator", folder, SOLUTIONS / "calculator")
    done = colcon(folder, shell)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 packages finished" in done.stdout
    assert "CMake" not in done.stderr and "AMENT_PREFIX_PATH" not in done.stderr
    return folder


class Terminal:
    """A pseudo-terminal in which somebody has typed `. install/setup.bash`, and then one command."""

    def __init__(self, workspace: Path, shell: dict[str, str], command: str):
        self.screen, inside = pty.openpty()
        self.shell = subprocess.Popen(
            ["bash", "--norc", "-c", f". {workspace}/install/setup.bash && exec {command}"],
            cwd=workspace.parent,  # where `ros2 run` finds no package in the current folder
            env=shell,
            stdin=inside,
            stdout=inside,
            stderr=inside,
            start_new_session=True,
        )
        os.close(inside)
        os.set_blocking(self.screen, False)
        self.seen = ""

    def text(self) -> str:
        """All that it shows so far."""
        try:
            while data := os.read(self.screen, 65536):
                self.seen += data.decode()
        except OSError:  # nothing to read now, or nobody writes any more
            pass
        return self.seen

    def shows(self, words: str) -> bool:
        return wait_until(lambda: words in self.text(), 30)

    def status(self) -> int:
        """Its exit status, once it has ended."""
        assert wait_until(lambda: self.text() is not None and self.shell.poll() is not None, 30), self.seen
        self.text()
        return self.shell.returncode

    def close(self) -> None:
        self.shell.terminate()
        try:
            self.shell.wait(10)
        except subprocess.TimeoutExpired:
            self.shell.kill()
            self.shell.wait()
        os.close(self.screen)


@pytest.fixture
def terminal(workspace, shell):
    opened = []

    def run(command: str) -> Terminal:
        opened.append(Terminal(workspace, shell, command))
        return opened[-1]

    yield run
    for each in opened:
        each.close()


@pytest.mark.timeout(400)
def test_the_chapters_three_terminals(terminal):
    server = terminal("ros2 run calculator calculator_server")
    assert server.shows("Calculator ready"), server.seen

    added = terminal("ros2 run calculator calculator_client 15.5 3.2 add")
    refused = terminal("ros2 run calculator calculator_client 10 0 divide")
    called = terminal(
        "ros2 service call /calculator calculator_interfaces/srv/Calculate \"{a: 100, b: 25, operation: 'subtract'}\""
    )
    assert added.status() == 0 and "15.5 add 3.2 = 18.7" in added.seen
    assert refused.status() == 1 and "Division by zero" in refused.seen  # what main returns
    assert called.status() == 0 and "result=75.0, success=True" in called.seen
    assert server.shows("a=100.0 b=25.0 operation=subtract")


def test_the_build_is_this_environments_and_all_that_runs_is_installed(workspace, shell):
    script = workspace / "install/calculator/lib/calculator/calculator_server"
    assert script.read_text().startswith(f"#!{shell['VIRTUAL_ENV']}/bin/python")
    installed = {path.name for path in workspace.glob("install/calculator/lib/python3*/site-packages/calculator/*.py")}
    assert installed == {"__init__.py", "calculator_server.py", "calculator_client.py"}
    assert (workspace / "install/calculator/share/ament_index/resource_index/packages/calculator").exists()


@pytest.mark.matrix  # the other tests build with the course's own options
def test_the_readers_own_cmake_options_do_not_replace_the_courses(workspace, shell):
    done = colcon(workspace, shell, "--packages-select", "calculator_interfaces", "--cmake-args", "-DCMAKE_CXX_FLAGS=")
    assert done.returncode == 0, done.stdout + done.stderr


def test_colcon_in_a_cell_knows_what_a_terminal_of_the_course_knows(tmp_path, shell):
    """A kernel's environment has none of the variables that CMake needs to find this Python."""
    package = tmp_path / "src/told"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package format='3'><name>told</name><version>0.0.0</version><description>d</description>"
        "<maintainer email='a@b.c'>a</maintainer><license>MIT</license>"
        "<export><build_type>cmake</build_type></export></package>"
    )
    (package / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.20)\nproject(told NONE)\n"
        "file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/told $ENV{CMAKE_TOOLCHAIN_FILE})\n"
        "install(FILES package.xml DESTINATION share)\n"
    )
    kernel = {name: value for name, value in shell.items() if name not in workspace_variables()}
    done = colcon(tmp_path, kernel)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "build/told/told").read_text() == workspace_variables()["CMAKE_TOOLCHAIN_FILE"]


def test_programs_without_an_interface_are_one_package_even_in_a_folder_with_a_space(tmp_path, shell):
    folder = tmp_path / "meine Übung"
    export("services", folder, SOLUTIONS / "services", package="my_package")
    done = colcon(folder, shell)
    assert done.returncode == 0 and "1 package finished" in done.stdout, done.stdout + done.stderr
    run = f"""
        . '{folder}/install/setup.bash'
        exec timeout 60 ros2 run my_package motor_service --ros-args --log-level bad:bad:bad
    """
    ran = subprocess.run(["bash", "--norc", "-c", run], cwd=tmp_path, env=shell, capture_output=True, text=True)
    assert "lib/my_package/motor_service" in ran.stderr and "ModuleNotFoundError" not in ran.stderr, ran


@pytest.fixture(scope="session")
def tutorial(tmp_path_factory, shell) -> Path:
    """The workspace of the beginner's tutorials: a package that `ros2 pkg create` has made, not built yet."""
    folder = tmp_path_factory.mktemp("tutorial") / "ros2_ws"
    (folder / "src").mkdir(parents=True)
    create = ["ros2", "pkg", "create", "--build-type", "ament_python", "--license", "Apache-2.0", "my_package"]
    done = subprocess.run([*create, "--node-name", "my_node"], cwd=folder / "src", env=shell, capture_output=True)
    assert done.returncode == 0, done
    return folder


def says(workspace: Path, shell: dict[str, str]) -> str:
    """Return what the tutorial's node prints, in a terminal that has sourced the workspace."""
    words = ["bash", "--norc", "-c", ". install/setup.bash && exec ros2 run my_package my_node"]
    return subprocess.run(words, cwd=workspace, env=shell, capture_output=True, text=True, timeout=60).stdout


@pytest.mark.timeout(600)
def test_a_build_says_no_warning_and_symlinks_let_an_edit_count_at_once(tutorial, shell, tmp_path):
    """Beside an interface that a cell has built, too."""
    built = os.pathsep.join([*filter(None, [shell.get("AMENT_PREFIX_PATH")]), str(tmp_path)])
    shell = {**shell, "AMENT_PREFIX_PATH": built}
    node = tutorial / "src/my_package/my_package/my_node.py"
    first = colcon(tutorial, shell)
    assert first.returncode == 0 and "1 package finished" in first.stdout and first.stderr == "", first
    assert says(tutorial, shell) == "Hi from my_package.\n"
    linked = colcon(tutorial, shell, "--symlink-install")
    assert linked.returncode == 0 and linked.stderr == "", linked
    node.write_text(node.read_text().replace("Hi", "Good evening"))
    assert says(tutorial, shell) == "Good evening from my_package.\n"
    again = colcon(tutorial, shell)
    assert again.returncode == 0 and again.stderr == "", again
    node.write_text(node.read_text().replace("Good evening", "Good night"))
    assert says(tutorial, shell) == "Good evening from my_package.\n", "a plain build copies"


@pytest.mark.timeout(600)
def test_colcon_test_runs_the_packages_tests_and_tells_which_fail(tutorial, shell):
    if not (tutorial / "install/my_package").exists():  # the test above has built it
        assert colcon(tutorial, shell).returncode == 0
    tests = tutorial / "src/my_package/test"
    (tests / "test_sum.py").write_text(
        "def test_right():\n    assert 2 + 2 == 4\n\n\ndef test_sum():\n    assert 2 + 2 == 5\n"
    )

    def run(*words: str) -> subprocess.CompletedProcess:
        return subprocess.run(words, cwd=tutorial, env=shell, capture_output=True, text=True, timeout=SECONDS)

    done = run("colcon", "test", "--event-handlers", "console_direct+")
    assert "assert (2 + 2) == 5" in done.stdout and "1 failed, 1 passed, 3 skipped" in done.stdout, done
    result = run("colcon", "test-result", "--verbose")
    assert result.returncode == 1 and "Summary: 5 tests, 0 errors, 1 failure, 3 skipped" in result.stdout, result
    reasons = (tutorial / "build/my_package/pytest.xml").read_text()
    for linter in ("ament_copyright", "ament_flake8", "ament_pep257"):
        assert f"{linter} is not installed" in reasons
