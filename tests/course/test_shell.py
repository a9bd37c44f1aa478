"""environment/shell: a terminal, or one command, in the course's world, and in the session of its folder."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections import deque
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from course import registry
from course.foundation.waiting import wait_until
from course.interfaces import InterfaceError, build, kept
from course.interfaces.builder import Built
from course.lab.server import replay
from course.lab.server.prompts import AGAIN, ENDS, waits
from tests.kernels import Kernel
from tests.processes import runs
from tests.terminals import SHELL, WIDTH, Terminal

ROOT = Path(__file__).parents[2]
SOLUTION = ROOT / "solutions" / "calculator"
WAIT = 30  # s
STRANGE = "Übung 3, calculator"  # a folder's name with a space, an umlaut and a comma


def cell(file: str, options: str = "") -> str:
    return f"%%exercise {file}{options}\n{(SOLUTION / file).read_text()}"


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The environment of a terminal that was opened anywhere: nothing of the course, and a registry for the test."""
    kept = ("HOME", "LANG", "TERM", "USER")
    return {name: os.environ[name] for name in kept if name in os.environ} | {
        "PATH": "/usr/local/bin:/usr/bin:/bin",
        "XDG_RUNTIME_DIR": str(tmp_path_factory.mktemp("run")),
        "COURSE_CACHE": os.environ.get("COURSE_CACHE", str(Path.home() / ".cache" / "ros2-course")),
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("notebooks") / STRANGE
    folder.mkdir()
    return folder


@pytest.fixture(scope="module")
def kernel(folder, environment):
    """A notebook's kernel with a session, the calculator built and its server running."""
    kernel = Kernel(folder, {"XDG_RUNTIME_DIR": environment["XDG_RUNTIME_DIR"]})
    kernel.run("import course\nros = course.live()")
    assert "built as" in kernel.run(cell("Calculate.srv", " --package calculator_interfaces"))
    assert "running as" in kernel.run(cell("calculator_server.py"))
    assert "written" in kernel.run(cell("calculator_client.py", " --no-start"))
    yield kernel
    kernel.stop()


def shell(environment, folder, *words: str, **more: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [SHELL, *words], env=environment | more, cwd=folder, capture_output=True, text=True, timeout=60
    )


def test_a_command_meets_the_notebook_of_its_folder(kernel, environment, folder):
    assert shell(environment, folder, "ros2", "node", "list").stdout == "/calculator_server\n"
    done = shell(environment, folder, "python3", "calculator_client.py", "15.5", "3.2", "add")
    assert done.returncode == 0 and "18.7" in done.stdout
    refused = shell(environment, folder, "python3", "calculator_client.py", "10", "0", "divide")
    assert refused.returncode != 0 and "zero" in (refused.stdout + refused.stderr)
    request = "{a: 100, b: 25, operation: 'subtract'}"
    called = shell(
        environment, folder, "ros2", "service", "call", "/calculator", "calculator_interfaces/srv/Calculate", request
    )
    assert "result=75.0" in called.stdout


def test_a_command_in_another_folder_does_not(kernel, environment, tmp_path):
    assert shell(environment, tmp_path, "ros2", "node", "list").stdout == ""


def test_another_session_is_joined_by_its_number(kernel, environment, tmp_path):
    pid = kernel.run("import os; print(os.getpid())")
    done = shell(environment, tmp_path, "--session", pid, "ros2", "node", "list")
    assert (done.stdout, done.stderr) == ("/calculator_server\n", "")
    unknown = shell(environment, tmp_path, "--session", "1", "ros2", "node", "list")
    assert unknown.returncode == 2
    assert unknown.stderr == "environment/shell: there is no session 1; `course sessions` lists them\n"
    assert shell(environment, tmp_path, "--session").returncode == 2


def test_what_was_built_can_be_imported_after_a_restart(kernel, environment, folder):
    kernel.manager.restart_kernel(now=True)
    kernel.client.wait_for_ready(timeout=30)
    assert kernel.run("from calculator_interfaces.srv import Calculate\nprint(Calculate.Request().a)") == "0.0"
    kernel.run("import course\nros = course.live()\nros.start('calculator_server.py')")
    assert kernel.run("print(ros.call('/calculator', Calculate, a=1, b=2, operation='add').result)") == "3.0"


def test_a_definition_that_changed_on_the_disk_is_built_again(environment, tmp_path):
    program = (
        "from course.notebook.exercise_magic import _interface as write; from pathlib import Path; "
        "write({}, {!r}, 'ask')"
    )
    text = "int32 a\n---\n"
    shell(environment, tmp_path, "python3", "-c", program.format("Path('Ask.srv')", text))
    fields = ("python3", "-c", "from ask.srv import Ask; print(list(Ask.Request().get_fields_and_field_types()))")
    assert shell(environment, tmp_path, *fields).stdout == "['a']\n"
    (tmp_path / "Ask.srv").write_text("int32 b\n---\n")
    done = shell(environment, tmp_path, *fields)
    assert (done.stdout, done.stderr) == (
        "['b']\n",
        "Ask.srv has changed: ask was built again. Run the cell that imports it again.\n",
    )
    assert shell(environment, tmp_path, *fields).stderr == ""
    (tmp_path / "Ask.srv").write_text("float b\n---\n")
    done = shell(environment, tmp_path, *fields)
    assert done.stdout == "['b']\n" and "ask was not built again: Ask.srv, line 1" in done.stderr
    (tmp_path / "Ask.srv").unlink()
    assert shell(environment, tmp_path, *fields).stderr.startswith("Ask.srv is missing")


def test_a_folder_made_anew_under_an_old_name_remembers_nothing(tmp_path):
    """As a fresh clone where an earlier one was: nobody has deleted a definition there."""
    folder = tmp_path / "calculator"
    for _ in range(2):
        folder.mkdir()
        assert kept.packages(folder) == [] and kept.refresh(folder) == []
        (folder / "Ask.srv").write_text("int32 a\n---\n")
        kept.keep(folder, build("ask", [folder / "Ask.srv"], use=False), ["Ask.srv"])
        assert [each.package for each in kept.packages(folder)] == ["ask"]
        shutil.rmtree(folder)


@pytest.mark.parametrize(
    "record",
    [
        '{"packages": {"ask": {"files": ["Ask.srv"], "build": ".."}}}',
        '{"packages": {"../ask": {"files": ["Ask.srv"], "build": "0123456789abcdef0123"}}}',
        '{"packages": {"ask": {"files": ["../Ask.srv"], "build": "0123456789abcdef0123"}}}',
        '{"packages": {"ask": {"files": ["Ask.srv"], "build": 3}}}',
        '{"packages": {"ask": {"files": 3, "build": "0123456789abcdef0123"}}}',
        json.dumps({"packages": {"ask": {"files": ["Ask.srv"] * 101, "build": "0123456789abcdef0123"}}}),
        json.dumps({"packages": {"a" * 101: {"files": ["Ask.srv"], "build": "0123456789abcdef0123"}}}),
        '{"packages": []}',
        "[]",
        "not JSON",
    ],
)
def test_a_record_from_elsewhere_leads_to_no_other_folder(record, tmp_path):
    kept.record_file(tmp_path).write_text(record)
    assert kept.packages(tmp_path) == [] and kept.refresh(tmp_path) == []


@pytest.mark.parametrize("change", ["nothing", "the definition", "the name"])
def test_a_handed_in_record_has_nothing_built_and_nothing_added(change, environment, tmp_path):
    """Not in a folder that came with its record, and not where the reader has once built a package of this name."""
    folder = tmp_path / "calculator"
    folder.mkdir()
    (folder / "Ask.srv").write_text("int32 a\n---\n")
    record = {"ask": {"files": ["Ask.srv"], "build": "0123456789abcdef0123"}}
    if change == "the definition":
        kept.keep(folder, build("ask", [folder / "Ask.srv"], use=False), ["Ask.srv"])
        record = json.loads(kept.record_file(folder).read_text())["packages"]
        folder = folder.rename(tmp_path / "eve")
        (folder / "Ask.srv").write_text(f"int32 other{os.getpid()}\n---\n")
    elif change == "the name":
        record = {"encodings": record["ask"]}
    kept.record_file(folder).write_text(json.dumps({"packages": record}))
    built = Path(environment["COURSE_CACHE"]) / "interfaces"
    before = sorted(built.glob("*/*"))
    done = shell(environment, folder, "python3", "-c", "import os; print(os.environ['PYTHONPATH'])")
    assert done.returncode == 0 and sorted(built.glob("*/*")) == before
    cell = "run the cell `%%exercise Ask.srv --package ask`.\n"
    assert (done.stdout, done.stderr) == {
        "nothing": ("\n", f"ask is not built on this machine: {cell}"),
        "the definition": (
            f"{built / 'ask' / record.get('ask', {}).get('build', '') / 'lib' / 'python'}\n",
            "ask stays as it was last built, and Ask.srv or the course has changed since. To build it again, " + cell,
        ),
        "the name": ("\n", ""),
    }[change]


@pytest.mark.parametrize("how", [shutil.copytree, shutil.move])
def test_a_folder_that_was_moved_or_copied_finds_what_was_built_in_it(how, environment, tmp_path):
    (tmp_path / "first").mkdir()
    (tmp_path / "first" / "Ask.srv").write_text("int32 a\n---\n")
    kept.keep(tmp_path / "first", build("ask", [tmp_path / "first" / "Ask.srv"], use=False), ["Ask.srv"])
    how(tmp_path / "first", tmp_path / "second")
    done = shell(environment, tmp_path / "second", "python3", "-c", "from ask.srv import Ask; print(Ask.__name__)")
    assert (done.stdout, done.stderr) == ("Ask\n", "")


def test_a_cell_does_not_vouch_for_the_rest_of_a_record_from_elsewhere(tmp_path):
    """Of two packages in a copied folder, only the one that is built there is built again when it has changed."""
    (tmp_path / "first").mkdir()
    for name in ("Ask", "Tell"):
        (tmp_path / "first" / f"{name}.srv").write_text("int32 a\n---\n")
        built = build(name.lower(), [tmp_path / "first" / f"{name}.srv"], use=False)
        kept.keep(tmp_path / "first", built, [f"{name}.srv"])
    copy = shutil.copytree(tmp_path / "first", tmp_path / "copy")
    kept.keep(copy, build("ask", [copy / "Ask.srv"], use=False), ["Ask.srv"])
    for name in ("Ask", "Tell"):
        (copy / f"{name}.srv").write_text("int32 b\n---\n")
    again, stays = sorted(kept.refresh(copy))
    assert again.startswith("Ask.srv has changed: ask was built again") and stays.startswith("tell stays as it was")


@pytest.mark.timeout(30)  # s; a pipe would be waited for without an end
@pytest.mark.parametrize("content", ["long", "deep", "a pipe"])
def test_a_record_is_a_small_ordinary_file(content, tmp_path):
    record = {"packages": {"ask": {"files": ["Ask.srv"], "build": "0123456789abcdef0123"}}}
    if content == "a pipe":
        os.mkfifo(kept.record_file(tmp_path))
    else:
        text = json.dumps({**record, "more": "x" * 100_000}) if content == "long" else "[" * 90_000
        kept.record_file(tmp_path).write_text(text)
    assert kept.packages(tmp_path) == []


@pytest.mark.timeout(30)  # s
def test_a_definition_is_a_small_ordinary_file(tmp_path):
    """One that was, when its package was built here."""
    (tmp_path / "Ask.srv").write_text("int32 a\r\n---\r\n")
    (tmp_path / "Tell.srv").write_text("int32 a\n---\n")
    for name in ("Ask", "Tell"):
        kept.keep(tmp_path, build(name.lower(), [tmp_path / f"{name}.srv"], use=False), [f"{name}.srv"])
    (tmp_path / "Ask.srv").unlink()
    os.mkfifo(tmp_path / "Ask.srv")
    (tmp_path / "Tell.srv").write_text("# " + "x" * 1_000_000 + "\n---\n")
    assert [line.replace(f"{tmp_path}/", "") for line in kept.refresh(tmp_path)] == [
        "ask was not built again: cannot read Ask.srv: it is not an ordinary file",
        "tell was not built again: cannot read Tell.srv: it is larger than 1 MB",
    ]


def test_a_record_names_at_most_fifty_packages(tmp_path):
    """The newest: one that is built later is not lost."""
    entry = {"files": ["Ask.srv"], "build": "0123456789abcdef0123"}
    kept.record_file(tmp_path).write_text(json.dumps({"packages": {f"ask_{i}": entry for i in range(300)}}))
    kept.keep(tmp_path, Built("newest", tmp_path / entry["build"]), ["Newest.srv"])
    assert [each.package for each in kept.packages(tmp_path)] == [*(f"ask_{i}" for i in range(251, 300)), "newest"]


@pytest.mark.parametrize("name", ["encodings", "sitecustomize", "yaml", "course", "rclpy", "std_msgs"])
def test_a_record_names_no_package_that_would_hide_another(name, tmp_path):
    (tmp_path / "Ask.srv").write_text("int32 a\n---\n")
    with pytest.raises(InterfaceError, match=f"{name} is .*, which yours would hide: choose another name"):
        build(name, [tmp_path / "Ask.srv"])
    kept.keep(tmp_path, Built(name, tmp_path / "interfaces" / name / "0123456789abcdef0123"), ["Ask.srv"])
    assert kept.record_file(tmp_path).exists() and kept.packages(tmp_path) == []


def test_two_terminals_that_build_at_once_build_once(environment, tmp_path):
    (tmp_path / "Ask.msg").write_text(f"int32 a{os.getpid()}\n")
    program = (
        "from course.interfaces import build;"
        "built = build('ask_at_once', ['Ask.msg']); from ask_at_once.msg import Ask; print(built.prefix, Ask.__name__)"
    )
    both = [
        subprocess.Popen(
            [SHELL, "python3", "-c", program],
            env=environment | {"COURSE_CACHE": str(tmp_path / "cache")},
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    said = {process.communicate(timeout=90)[0] for process in both}
    assert len(said) == 1 and said.pop().endswith(" Ask\n")
    assert len([path for path in (tmp_path / "cache/interfaces/ask_at_once").iterdir() if path.is_dir()]) == 1


def test_a_command_that_is_not_there_is_a_line(environment, tmp_path):
    done = shell(environment, tmp_path, "no-such-command")
    assert done.returncode == 127
    assert done.stderr == "environment/shell: no-such-command: No such file or directory\n"


def test_another_ros_that_is_sourced_is_told(environment, tmp_path):
    done = shell(environment, tmp_path, "true", ROS_DISTRO="humble")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "ROS 2 humble is sourced in this terminal" in done.stderr


def test_a_folder_that_cannot_be_written_is_no_hindrance(environment, tmp_path):
    tmp_path.chmod(0o555)
    try:
        assert shell(environment, tmp_path, "python3", "-c", "import rclpy; print('fine')").stdout == "fine\n"
    finally:
        tmp_path.chmod(0o755)


@pytest.fixture
def terminal(folder, environment):
    terminal = Terminal(folder, environment)
    yield terminal
    terminal.close()


def test_a_terminal_tells_its_session_and_types_the_chapters_commands(kernel, terminal):
    domain = kernel.run("print(ros.domain_id)")
    terminal.read_until(rf"~ \(domain {domain}\)")
    terminal.type("\x13ros2 node list\n")  # Ctrl+S, which saves a notebook, does not hold the terminal up
    terminal.read_until(r"[\r\n]/calculator_server\r\n")
    terminal.type("python3 calculator_client.py 15.5 3.2 add\n")
    terminal.read_until(r"18\.7")


def test_the_tab_key_completes_ros2(kernel, terminal):
    terminal.read_until(r"domain \d+\)")
    terminal.type("ros2 service ca\t")
    terminal.read_until("ros2 service call ")
    terminal.type("/calc\t")
    terminal.read_until(r"/calc\x07?ulator")


def test_a_terminal_that_changes_its_folder_joins_the_session_there(kernel, terminal, tmp_path):
    terminal.read_until(r"domain \d+\)")
    terminal.type(f"cd {tmp_path}\n")
    terminal.read_until(rf"{tmp_path.name} \(domain \d+\)")
    terminal.type("ros2 node list && echo none\n")
    assert "/calculator_server" not in terminal.read_until(r"[\r\n]none\r\n")
    terminal.type("cd -\n")
    terminal.read_until(r"~ \(domain \d+\)")
    terminal.type("ros2 node list\n")
    terminal.read_until(r"[\r\n]/calculator_server\r\n")


@pytest.fixture
def open_terminal(environment):
    """Opens a terminal in a folder."""
    opened = []

    def begin(folder: Path, *words: str, **more: str) -> Terminal:
        opened.append(Terminal(folder, environment | more, *words))
        return opened[-1]

    yield begin
    for each in opened:
        each.close()


TALKER = "import rclpy; rclpy.init(); node = rclpy.create_node('talker'); print('up', flush=True); rclpy.spin(node)"


def test_two_terminals_of_a_person_meet_wherever_they_are(open_terminal, tmp_path):
    (tmp_path / "ros2_ws").mkdir()
    (tmp_path / "talker.py").write_text(TALKER)
    home, workspace = open_terminal(tmp_path), open_terminal(tmp_path / "ros2_ws")
    domain = re.search(r"domain (\d+)\)", home.read_until(r"domain \d+\)"))[1]
    workspace.read_until(rf"domain {domain}\)")
    home.type("cd / && cd - && python3 talker.py\n")
    home.read_until(r"[\r\n]up\r\n")
    workspace.type("ros2 node list\n")
    workspace.read_until(r"[\r\n]/talker\r\n")


def test_a_domain_that_was_exported_stays_until_it_is_unset(open_terminal, tmp_path):
    (tmp_path / ".bashrc").write_text("export ROS_DOMAIN_ID=98\n")
    terminal = open_terminal(tmp_path, ROS_DOMAIN_ID="99")
    terminal.read_until(r"domain 98, as you set it\)")
    terminal.type("export ROS_DOMAIN_ID=97; cd /\n")
    terminal.read_until(r"/ \(domain 97, as you set it\)")
    terminal.type("echo in $ROS_DOMAIN_ID; false\n")
    terminal.read_until(r"[\r\n]in 97\r\n")
    terminal.type("echo failed $?; cd /tmp; unset ROS_DOMAIN_ID\n")
    terminal.read_until(r"[\r\n]failed 1\r\n")
    terminal.read_until(r"tmp \(domain \d+\)")


def test_a_terminal_moves_to_the_notebook_that_starts_beside_it_and_says_so(environment, open_terminal, tmp_path):
    """Its prompt is there already when the notebook starts in its folder; the domain that it waits in is taken."""
    terminal = open_terminal(tmp_path)
    shared = re.search(r"domain (\d+)\)", terminal.read_until(r"domain \d+\)[^\n]*\$ "))[1]
    others = [Kernel(tmp_path, {"XDG_RUNTIME_DIR": environment["XDG_RUNTIME_DIR"]}) for _ in range(2)]
    try:
        domains = [other.run("import course\nros = course.live()\nprint(ros.domain_id)") for other in others]
        assert domains[0] == shared and domains[1] != shared
        others[0].stop()
        terminal.type("echo in $ROS_DOMAIN_ID\n")
        terminal.read_until(rf"This terminal is now in ROS domain {domains[1]}, with the notebook in [^\n]*\r\n")
        terminal.read_until(rf"in {domains[1]}\r\n")
    finally:
        others[1].stop()


def test_an_empty_graph_says_where_there_are_nodes_and_how_to_join(kernel, environment, open_terminal, tmp_path):
    domain = kernel.run("print(ros.domain_id)")
    every = "for each in node topic service action param; do ros2 $each list; done"
    told = shell(environment, tmp_path, "sh", "-c", every).stderr.splitlines()
    assert len(told) == 5
    for line in told:
        assert re.fullmatch(
            rf"ROS domain \d+ has no nodes\. You have nodes in ROS domain {domain} \(the notebook in .*{STRANGE}\)\. "
            rf"To join: export ROS_DOMAIN_ID={domain}",
            line,
        ), told
    terminal = open_terminal(tmp_path)
    terminal.type("ros2 service call /calculator std_srvs/srv/Empty\n")
    terminal.read_until(rf"You have nodes in ROS domain {domain} ")
    terminal.type("\x03")
    terminal.type(f"export ROS_DOMAIN_ID={domain}\n")
    terminal.read_until(rf"~ \(domain {domain}, as you set it\)")
    terminal.type("ros2 node list; ros2 interface show calculator_interfaces/srv/Calculate\n")
    terminal.read_until(r"[\r\n]/calculator_server\r\n")
    terminal.read_until(r"float64 a\r\n")
    assert shell(environment, tmp_path, "ros2", "node", "list", ROS_DOMAIN_ID=domain).stderr == ""


def test_a_graph_that_is_not_known_yet_is_not_called_empty(kernel, environment, tmp_path):
    slow = Kernel(tmp_path, {"XDG_RUNTIME_DIR": environment["XDG_RUNTIME_DIR"]})
    try:
        pid = int(slow.run("import os, course\nros = course.live()\nprint(os.getpid())"))
        os.kill(pid, signal.SIGSTOP)  # as a busy computer does, for longer than discovery is waited for
        try:
            done = shell(environment, tmp_path, "ros2", "node", "list")
        finally:
            os.kill(pid, signal.SIGCONT)
        assert (done.stdout, done.stderr) == ("", "")
        assert "has no nodes" in shell(environment, tmp_path, "ros2", "node", "list").stderr
    finally:
        slow.stop()


def test_an_empty_graph_says_where_another_terminal_has_nodes(environment, open_terminal, tmp_path):
    (tmp_path / "talker.py").write_text(TALKER)
    terminal = open_terminal(tmp_path, ROS_DOMAIN_ID="95")
    terminal.type("python3 talker.py\n")
    terminal.read_until(r"[\r\n]up\r\n")
    assert "95 (a terminal)" in shell(environment, tmp_path, "ros2", "node", "list").stderr


def test_what_runs_in_a_terminal_ends_when_it_is_closed(environment, tmp_path):
    (tmp_path / "talker.py").write_text(f"import os; print(os.getpid()); {TALKER}")
    terminal = Terminal(tmp_path, environment)
    terminal.type("python3 talker.py\n")
    talker = psutil.Process(int(re.search(r"(\d+)\r\nup", terminal.read_until(r"[\r\n]up\r\n"))[1]))
    terminal.close()
    assert wait_until(lambda: not runs(talker), WAIT)  # nobody may bury it


def test_a_program_of_the_tutorials_that_is_not_here_says_what_stands_in_for_it(open_terminal, tmp_path):
    terminal = open_terminal(tmp_path)
    for command, word in (
        ("rqt_graph", "panel Graph"),
        ("rqt", "panel Inspector"),
        ("rviz2", "panel Robot"),
        ("no-such-program", "command not found"),
    ):
        terminal.type(f"{command} || echo status $?\n")
        terminal.read_until(rf"{word}[^\n]*\r\n")
        terminal.read_until(r"status 127\r\n")


def test_a_terminal_of_jupyterlab_follows_the_notebook_in_front_through_a_restart(
    environment, open_terminal, tmp_path, monkeypatch
):
    """This process is in the place of the server that has started the terminal."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
    (tmp_path / "notebook").mkdir()
    kernel = Kernel(tmp_path / "notebook")
    live = "import course\nros = course.live()\nprint(ros.domain_id)"
    try:
        identity = Path(kernel.manager.connection_file).stem.removeprefix("kernel-")
        registry.put_in_front(os.getpid(), identity)
        terminal = open_terminal(tmp_path, "--lab")
        own = re.search(r"domain (\d+)\)", terminal.read_until(r"domain \d+\)"))[1]
        for _ in range(2):
            domain = kernel.run(live)
            assert domain != own
            terminal.type(AGAIN)  # without Enter, as the server does
            terminal.read_until(rf"This terminal is now in ROS domain {domain}, with the notebook in notebook\.")
            terminal.read_until(rf"\(domain {domain}\)")
            kernel.manager.restart_kernel(now=True)
            kernel.client.wait_for_ready(timeout=30)
            terminal.type("cd .\n")
        registry.put_in_front(os.getpid(), "")
        terminal.type("\n")
        terminal.read_until(rf"This terminal is now in ROS domain {own}, with your other terminals\.")
    finally:
        registry.forget_front(os.getpid())
        kernel.stop()


def test_a_terminal_of_jupyterlab_says_that_the_notebook_in_front_has_no_session_and_joins_it_when_it_has(
    environment, open_terminal, tmp_path, monkeypatch
):
    """The start page's session takes the domain that the terminal is in, in whose strip it was opened."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
    (tmp_path / "services").mkdir()
    kernels = [Kernel(folder) for folder in (tmp_path, tmp_path / "services")]
    start, section = (Path(each.manager.connection_file).stem.removeprefix("kernel-") for each in kernels)
    live = "import course\nros = course.live()\nprint(ros.domain_id)"
    nobody = r"in front has no session: run its cell with ros = course\.live\(\)\. "
    nobody += r"Until then, this terminal is in ROS domain (\d+),"
    try:
        registry.put_in_front(os.getpid(), start, str(tmp_path))
        terminal = open_terminal(tmp_path, "--lab", JUPYTER_SERVER_ROOT=str(tmp_path))
        terminal.read_until(nobody)
        first = re.search(r"domain (\d+)\)", terminal.read_until(r"domain \d+\)\S* \$ $"))[1]
        assert kernels[0].run(live) == first
        here = r"The notebook in {} has joined this terminal in ROS domain {}\."
        terminal.type(AGAIN)
        terminal.read_until(here.format(re.escape(tmp_path.name), first))
        terminal.read_until(rf"\(domain {first}\)")
        registry.put_in_front(os.getpid(), section, str(tmp_path / "services"))
        terminal.type(AGAIN)
        waiting = re.search(nobody, terminal.read_until(nobody))[1]
        assert waiting != first
        terminal.read_until(rf"services \(domain {waiting}\)")
        assert kernels[1].run(live) == waiting
        terminal.type("ros2 node list && echo done\n")
        said = terminal.read_until(r"[\r\n]done\r\n")
        assert "no session" not in said and re.search(here.format("services", waiting), said)
        kernels[1].manager.restart_kernel()
        kernels[1].client.wait_for_ready(timeout=30)
        terminal.type("cd .\n")
        again = re.search(nobody, terminal.read_until(nobody))[1]
        assert again != first
        terminal.read_until(rf"services \(domain {again}\)")
        assert kernels[1].run(live) == again
        registry.put_in_front(os.getpid(), start, str(tmp_path))
        terminal.type(AGAIN)
        terminal.read_until(rf"This terminal is now in ROS domain {first}, with the notebook in ")
    finally:
        registry.forget_front(os.getpid())
        for each in kernels:
            each.stop()


def test_a_terminal_of_jupyterlab_is_in_the_folder_of_the_notebook_in_front_until_one_goes_elsewhere(
    environment, open_terminal, tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
    for name in ("services", STRANGE, "ros2_ws"):
        (tmp_path / name).mkdir()

    def bring(name: str) -> None:
        registry.put_in_front(os.getpid(), "", str(tmp_path / name) if name else "")

    def expect_folder(terminal: Terminal, keys: str, name: str) -> str:
        terminal.type(keys)
        return terminal.read_until(rf"\x1b\[1m{name} \(domain \d+\)\x1b\[0m \$ $")

    try:
        bring("services")
        terminal = open_terminal(tmp_path, "--lab", JUPYTER_SERVER_ROOT=str(tmp_path))
        assert terminal.read_until(r"services \(").count("no session") == 1
        for name in (STRANGE, "services"):  # as while a page is loaded
            bring(name)
            assert "no session" not in expect_folder(terminal, AGAIN, name)
        expect_folder(terminal, "true\n", "services")
        bring(STRANGE)
        assert "no session" in expect_folder(terminal, AGAIN, STRANGE)
        bring("services")
        elsewhere = open_terminal(tmp_path / "ros2_ws", "--lab", JUPYTER_SERVER_ROOT=str(tmp_path))
        expect_folder(terminal, AGAIN, "services")
        expect_folder(elsewhere, "", "~")  # its home
        bring(STRANGE)
        terminal.type("half")
        terminal.read_until("half$")
        expect_folder(terminal, AGAIN + "\x15" + AGAIN, STRANGE)  # not while one types
        bring("")
        expect_folder(terminal, "\n", STRANGE)
        expect_folder(terminal, "cd ../ros2_ws && false\n", "ros2_ws")
        bring("services")
        terminal.type("echo failed $?\n")
        terminal.read_until(r"[\r\n]failed 1\r\n")
        expect_folder(terminal, "\n", "ros2_ws")
        expect_folder(terminal, "cd ../services\n", "services")
        bring(STRANGE)
        expect_folder(terminal, AGAIN, STRANGE)  # gone back to where it follows
    finally:
        registry.forget_front(os.getpid())


def test_an_old_prompt_stays_until_what_follows_it_is_known(environment, open_terminal, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", environment["XDG_RUNTIME_DIR"])
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\necho looks > /dev/tty\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    try:
        registry.put_in_front(os.getpid(), "", "")
        terminal = open_terminal(tmp_path, "--lab", JUPYTER_SERVER_ROOT=str(tmp_path))
        terminal.read_until(r"\$ $")
        terminal.type(f"COURSE_PYTHON={python}\n")
        terminal.read_until(r"\$ $")
        (tmp_path / "services").mkdir()
        registry.put_in_front(os.getpid(), "", str(tmp_path / "services"))
        terminal.type(AGAIN)
        terminal.read_until(r"\rlooks\r\n\x1b\[A\r\x1b\[JThe notebook in front has no session: [^$]*\$ $")
        terminal.type(f"COURSE_PYTHON={python}\n")  # what has looked has set it
        terminal.read_until(r"\$ $")
        registry.put_in_front(os.getpid(), "another", str(tmp_path))  # another kernel, too
        terminal.type(AGAIN)
        old, removed = r"^\r\x1b\[K\r[^\r\n]+\$ \r\n[^\n]*", r"\x1b\[A\r\x1b\[J"
        terminal.read_until(rf"{old}\rlooks\r\n{removed}The notebook in front has no session: [^$]*\$ $")
    finally:
        registry.forget_front(os.getpid())


def test_a_prompt_is_drawn_again_only_where_nothing_was_typed_and_nothing_runs(open_terminal, tmp_path):
    terminal = open_terminal(tmp_path)
    printed: deque[str] = deque()
    shown = SimpleNamespace(ptyproc=SimpleNamespace(fd=terminal.descriptor, pid=terminal.pid), read_buffer=printed)

    def read(pattern: str) -> None:
        printed.extend(terminal.read_until(pattern))  # by characters, as output comes in pieces

    read(r"\(domain \d+\)\S* \$ $")
    assert waits(shown)
    terminal.type("\x7f")  # Backspace, where there is nothing to remove
    read(r"\a$")
    assert waits(shown)
    terminal.type(AGAIN)
    read(r"\n.*\x1b\[A\r\x1b\[J.*\$ $")  # one line up, and in the place of the first
    prompt = re.escape(re.search(r"\x1b\[1m[^\x1b]*\x1b\[0m \$ $", "".join(printed))[0])
    before = len(printed)
    terminal.resize(10)
    read(rf"\r{prompt}$")
    terminal.type(AGAIN)
    read(rf"\n[^\n]*\r\x1b\[A\x1b\[A\r\x1b\[J\S*{prompt}$")  # it had two lines
    terminal.resize(WIDTH)
    read(rf"\x1b\[A\x1b\[K\r{prompt}$")
    assert re.fullmatch(rf"(\x1b\[\S\w+)*{prompt}", replay.shown("".join(list(printed)[before:])))
    terminal.type("stat() { echo asks > /dev/tty; sleep 0.5; }\n")  # one can type before the prompt is there
    read(r"\rasks\r\n.*\$ $")
    terminal.type(AGAIN)
    read(r"asks\r\n")
    terminal.type("half")
    drawn = terminal.read_until(r"\$ half$")
    assert "half" not in drawn.rpartition("\x1b[J")[2].partition("$ ")[0], drawn
    printed.extend(drawn)
    assert not waits(shown)
    terminal.type("\x15cat\n")
    read("cat\r\n")
    printed.append(ENDS)  # a program may print what looks like a prompt
    assert wait_until(lambda: not waits(shown), WAIT)
