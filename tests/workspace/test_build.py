"""Real colcon builds what was exported, and the chapter's three terminals (3.5) work in it."""

import os
import pty
import subprocess
from pathlib import Path

import pytest

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


def test_the_readers_own_cmake_options_do_not_replace_the_courses(workspace, shell):
    done = colcon(workspace, shell, "--packages-select", "calculator_interfaces", "--cmake-args", "-DCMAKE_CXX_FLAGS=")
    assert done.returncode == 0, done.stdout + done.stderr


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
