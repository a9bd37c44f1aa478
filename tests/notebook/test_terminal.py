"""A command in a cell: where a program hangs or loops, and a traceback without the libraries' lines."""

import pytest

from course.errors import ExerciseError, NodeFailed
from course.foundation import waiting
from course.notebook.terminal import USUAL, terminal
from course.session import stacks

SPINNER = """import rclpy
node = rclpy
node.create_client("Trigger", "/ask")
rclpy.spin_until_future_complete(1, 2)
"""
SPINS = """from rclpy import executors
def create_client(*given): pass
def spin_until_future_complete(*given): executors.wait()
"""


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(stacks, "SPENT", 0.5)


def run(folder, text, timeout=30.0):
    (folder / "client.py").write_text(text)
    ((_, output, status),) = terminal("python3 client.py", timeout=timeout).runs
    return output, status


def test_a_program_that_loops_is_not_waited_for_and_tells_its_line(tmp_path):
    output, status = run(tmp_path, "print('begun')\n\ndef ask():\n    while True: pass\n\nask()\n")
    assert status == 124
    assert "begun\n" not in output or output.startswith("begun\n")
    assert output.endswith("client.py was here:\n  client.py, line 4, in ask\n    while True: pass")
    assert "(stopped after 30 s)" not in output


def test_a_loop_that_cannot_end_is_told_before_it_has_used_much_time(tmp_path, monkeypatch):
    monkeypatch.setattr("course.session.stacks.SPENT", 60.0)
    monkeypatch.setattr("course.notebook.terminal.current", Served)
    loop = "def ask():\n    while not future.done:\n        pass\n\nask()\n"
    output, status = run(tmp_path, f"import types\nfuture = types.SimpleNamespace(done=False)\n{loop}")
    assert status == 124 and ("line 4, in ask\n" in output or "line 5, in ask\n" in output), output
    assert "(stopped after 30 s)" not in output


def test_a_program_that_is_given_more_time_than_usual_may_compute_for_long(tmp_path, monkeypatch):
    monkeypatch.setattr("course.session.stacks.SPENT", 0.3)
    work = "import time\nwhile time.process_time() < 0.8: pass\nprint('done')\n"
    assert run(tmp_path, work, timeout=USUAL + 1) == ("done\n", 0)


def test_a_program_that_waits_tells_its_line_at_the_end_of_its_time(tmp_path):
    output, status = run(tmp_path, "import threading\n\nthreading.Event().wait()\n", timeout=1.0)
    assert (output, status) == (
        "(stopped after 1 s). client.py was here:\n  client.py, line 3\n    threading.Event().wait()",
        124,
    )


def test_a_program_that_waits_for_what_cannot_come_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr("course.notebook.terminal.HELD", 0.2)
    monkeypatch.setattr("course.notebook.terminal.AGAIN", 0.2)
    monkeypatch.setattr("course.notebook.terminal.current", Served)
    (tmp_path / "rclpy").mkdir()
    (tmp_path / "rclpy" / "__init__.py").touch()
    (tmp_path / "rclpy" / "client.py").write_text("import threading\n\n\ndef call():\n    threading.Event().wait()\n")
    output, status = run(tmp_path, "from rclpy import client\nclient.call()\n")
    assert status == 124
    assert ". client.py was here:\n  client.py, line 2\n    client.call()\n`call(...)` in line 2 waits for" in output
    assert "(stopped after 30 s)" not in output


@pytest.mark.parametrize(("rests", "failed"), [(True, False), (False, False), (True, True)])
def test_a_program_that_spins_for_nothing_is_not_waited_for(tmp_path, monkeypatch, session, rests, failed):
    monkeypatch.setattr("course.notebook.terminal.IN_VAIN", 1.0)
    session.untold = ["lift_server.py ended"] * failed
    asked = []
    served = type("Session", (Served,), {"is_at_rest": lambda _, names=(): asked.append(names) or rests or not names})
    monkeypatch.setattr("course.notebook.terminal.SLEPT", 2)
    monkeypatch.setattr("course.notebook.terminal.current", served)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "library"))
    (tmp_path / "library" / "rclpy").mkdir(parents=True)
    for name, text in (
        ("__init__", SPINS),
        ("executors", "import threading\nwait = lambda: threading.Event().wait()\n"),
    ):
        (tmp_path / "library" / "rclpy" / f"{name}.py").write_text(text)
    output, status = run(tmp_path, SPINNER, timeout=4.0)
    assert status == 124 and (("/ask",) in asked) != failed
    assert ("because a node of this notebook has failed" in output) == failed
    assert ("(stopped after 4 s)" in output) != rests
    at = "client.py was here:\n  client.py, line 4\n    rclpy.spin_until_future_complete(1, 2)\nLine 4 spins until a"
    assert (at in output) == (rests and not failed)


class Served:
    """A session without servers."""

    def served(self):
        return {}

    def is_at_rest(self, names=()):
        return False


def test_a_program_that_works_and_prints_may_take_its_time(tmp_path, monkeypatch):
    monkeypatch.setattr("course.session.stacks.SPENT", 0.6)
    work = "import time\nfor number in range(4):\n    end = time.process_time() + 0.2\n"
    work += "    while time.process_time() < end: pass\n    print(number, flush=True)\n"
    assert run(tmp_path, work) == ("0\n1\n2\n3\n", 0)


def test_a_traceback_has_the_lines_of_the_program_alone(tmp_path):
    text = "import json\n\ndef ask(words):\n    return json.loads(words)\n\nprint('begun')\nask('{')\n"
    output, status = run(tmp_path, text)
    assert status == 1
    assert "/json/" not in output
    assert "Traceback (its 5 calls, folded):\n  client.py, line 4, in ask\n    return json.loads(words)\n" in output
    assert output.splitlines()[0] == "begun" and output.splitlines()[4].startswith("json.decoder.JSONDecodeError: ")


RAISES_TWICE = """import sys
class Node:
    def __del__(self):
        self.ended

def ask(words):
    int(words)

sys.excepthook = lambda *error: (sys.__excepthook__(*error), Node())
ask('{')
"""


def test_an_exception_that_python_ignores_hides_no_other(tmp_path):
    output, _ = run(tmp_path, RAISES_TWICE)
    assert (
        "Traceback (its 2 calls, folded):\n  client.py, line 7, in ask\n    int(words)\nValueError: invalid" in output
    )
    assert "__del__" not in output


def test_a_program_that_ends_by_itself_is_shown_as_it_is(tmp_path):
    assert run(tmp_path, "import sys\nprint('no answer')\nsys.exit(3)\n") == ("no answer\n", 3)


@pytest.mark.parametrize(
    ("command", "word"),
    [
        ("cd ros2_ws && colcon build", "cd"),
        (". install/setup.bash", "."),
        ("source install/setup.bash", "source"),
        ("ros2 node list | sort", "|"),
        ("python3 client.py > out.txt", ">"),
    ],
)
def test_what_only_a_shell_can_do_is_told(command, word):
    ((_, output, status),) = terminal(command).runs
    assert status == 127
    assert f"`{word}` needs a shell" in output
    lost = word in (".", "source")  # in a cell it would act on a shell that ends at once
    assert (f"`!{command}`" in output) != lost


@pytest.mark.parametrize(
    ("command", "said", "number"),
    [
        ("", "it names no program", 127),
        ("echo 'a", "A quotation mark is missing, or there is one too many", 2),
        ("./folder", "./folder: permission denied", 126),
        ("nonsense", "nonsense: command not found", 127),
    ],
)
def test_a_line_that_cannot_be_run_is_a_line(tmp_path, command, said, number):
    (tmp_path / "folder").mkdir()
    ((_, output, status),) = terminal(command).runs
    assert status == number
    assert said in output and len(output.splitlines()) == 1


@pytest.mark.parametrize(("command", "number"), [("client.py 1 2", 127), ("./client.py 1 2", 126)])
def test_a_file_of_python_as_a_command_is_told(tmp_path, monkeypatch, command, number):
    monkeypatch.chdir(tmp_path)
    ((_, output, _),) = terminal(command).runs
    assert "Hint" not in output
    (tmp_path / "client.py").write_text("")
    ((_, output, status),) = terminal(command).runs
    assert (status, output.splitlines()[1:]) == (number, [f"Hint: Python runs this file: `python3 {command}`."])


def test_a_parameter_that_is_set_with_an_equals_sign(tmp_path):
    said = "Couldn't parse parameter override rule: '-p use_sim_time=true'. Error: Expected lexeme type (22) not found"
    output, _ = run(tmp_path, f"raise SystemExit({said!r})\n")
    assert output.splitlines()[-1] == "Hint: A parameter is set with `:=`: `-p use_sim_time:=true`"


def test_a_node_that_never_ends_tells_how_it_is_started(tmp_path):
    output, status = run(tmp_path, "import threading as rclpy\nrclpy.spin = rclpy.Event().wait\nrclpy.spin()\n", 1.0)
    assert status == 124
    assert "start it with `ros.start('client.py')`" in output


def test_a_client_that_never_ends_is_not_to_be_started_as_a_node(tmp_path):
    text = "import threading as rclpy\nrclpy.spin = rclpy.Event().wait\nif 0: ActionClient()\nrclpy.spin()\n"
    output, status = run(tmp_path, text, 1.0)
    assert status == 124
    assert output.endswith("A client ends by itself: once its answer has come, or when none can come.")


def test_a_program_that_prints_without_end_is_stopped_and_shown_in_part(tmp_path):
    """A megabyte in a cell's output, and in the search for a hint, would hold the page and the kernel up."""
    output, status = run(tmp_path, "def tell():\n    while True: print('sum')\n\ntell()\n")
    assert status == 124
    assert "of which only the first are shown" in output and len(output) < 3000
    assert "client.py, line 2, in tell" in output


@pytest.mark.parametrize("words", ["-p max_speed:=2.0", "--params-file robot.yaml"])
def test_a_parameter_that_the_program_would_not_read_is_told_before_it_runs(words):
    ((_, output, status),) = terminal(f"ros2 run course parameter_node {words}", until="2.0").runs
    assert status == 2
    assert output.endswith(f"Write `--ros-args {words}`.")


def test_a_node_of_ros2_run_that_never_ends_tells_how_it_is_ended(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("course.notebook.terminal.TELLING", 1.0)
    ((_, output, status),) = terminal("ros2 run course parameter_node", timeout=4.0).runs
    told = capsys.readouterr().err
    assert "`ros2 run course parameter_node` still runs after 1 s" in told and told.count("still runs") == 1
    assert status == 124
    assert output.endswith("`terminal(..., until='some words of that line')`.")


def test_a_parameter_file_with_a_colon_alone_has_a_hint(tmp_path):
    (tmp_path / "robot.yaml").write_text("/**:\n  ros__parameters:\n    max_speed:0.8\n")
    command = "ros2 run course parameter_node --ros-args --params-file robot.yaml"
    ((_, output, _),) = terminal(command, until="Max speed:").runs
    assert "with a space after the colon" in output


def test_a_parameter_file_for_another_node_is_told(tmp_path):
    (tmp_path / "robot.yaml").write_text("parameternode:\n  ros__parameters:\n    max_speed: 0.8\n")
    (tmp_path / "node.py").write_text("print('[INFO] [parameter_node]: Max speed: 1.5', flush=True)\n")
    ((_, output, _),) = terminal("python3 node.py --ros-args --params-file robot.yaml", until="Max speed:").runs
    assert "Hint: robot.yaml has parameters for parameternode, and the node is called parameter_node" in output


@pytest.mark.parametrize("command", ["python3 node.py", "python3 -B node.py"])  # its traceback is folded, or is not
def test_an_integer_for_a_double_has_one_hint(tmp_path, command):
    said = "Trying to set parameter 'v' to '1' of type 'INTEGER', expecting type 'DOUBLE': v"
    error = "InvalidParameterTypeException"
    (tmp_path / "node.py").write_text(f"class {error}(Exception):\n    pass\n\n\nraise {error}({said!r})\n")
    ((_, output, _),) = terminal(command).runs
    assert output.count("Hint: ") == 1 and "1 is an integer: write 1.0." in output


def test_a_parameter_file_that_rcl_cannot_read_is_not_said_to_be_for_another_node(tmp_path):
    (tmp_path / "robot.yaml").write_text("parameter_node:\n  ros__parameters:\n    max_speed = 0.8\n")
    said = "[ERROR] [rcl]: Failed to parse global arguments\\nCouldn't parse params file: '--params-file robot.yaml'."
    (tmp_path / "node.py").write_text(f'print("{said} Error: Cannot have a value before ros__parameters at line 4")\n')
    ((_, output, _),) = terminal("python3 node.py --ros-args --params-file robot.yaml").runs
    assert output.count("Hint: ") == 1 and "each value is `name: value`" in output


@pytest.mark.parametrize("commands", [(), (["ros2", "node", "list"],)])
def test_commands_that_are_no_text_are_told(commands):
    with pytest.raises(ExerciseError, match="takes each command as one text"):
        terminal(*commands)


def test_a_line_that_never_comes_is_told(tmp_path):
    (tmp_path / "client.py").write_text("import time\nprint('Max speed: 2.0', flush=True)\ntime.sleep(60)\n")
    ((_, output, status),) = terminal("python3 client.py", timeout=1.0, until="Max speed: 2.00").runs
    assert status == 124
    assert output.endswith("(stopped after 1 s: no line contained 'Max speed: 2.00')")


def test_a_line_that_has_not_come_is_told_long_before_the_limit(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("course.notebook.terminal.WITHOUT", 0.3)
    (tmp_path / "client.py").write_text("import time\nprint('It is \"\\xe9\"', flush=True)\ntime.sleep(60)\n")
    terminal("python3 client.py", timeout=1.0, until="Max speed: 2.00")
    said = (
        "`python3 client.py` has printed no line with 'Max speed: 2.00' for 0.3 s. This cell waits for it, at most 1 "
        's. Its last line is:\n  It is "\u00e9"\n'
    )
    assert said in capsys.readouterr().err


def test_a_parameter_file_for_another_node_is_told_while_the_line_is_waited_for(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("course.notebook.terminal.WITHOUT", 0.3)
    (tmp_path / "robot.yaml").write_text("robot:\n  ros__parameters:\n    max_speed: 0.8\n")
    said = "[INFO] [parameter_node]: Max speed: 1.5"
    (tmp_path / "node.py").write_text(f"import time\nprint('{said}', flush=True)\ntime.sleep(60)\n")
    terminal("python3 node.py --ros-args --params-file robot.yaml", timeout=1.0, until="Max speed: 0.8")
    told = capsys.readouterr().err
    assert "Hint: robot.yaml has parameters for robot, and the node is called parameter_node" in told


def test_a_program_that_ends_without_the_line_is_told(tmp_path):
    (tmp_path / "client.py").write_text("print('Max speed: 2.0')\n")
    (tmp_path / "other.py").write_text("print('Max speed: 2.00')\n")
    ((_, output, status),) = terminal("python3 client.py", until="Max speed: 2.00").runs
    assert (output, status) == ("Max speed: 2.0\n(it has ended; no line contained 'Max speed: 2.00')\n", 0)
    shown = repr(terminal("python3 client.py", "python3 other.py", until="Max speed: 2.00"))
    assert "no line contained" not in shown  # one is waited for until the other has ended


@pytest.mark.parametrize("end", ["chr(10)", "''"])
def test_a_program_that_prints_without_the_line_is_stopped_and_shown_in_part(tmp_path, end):
    (tmp_path / "client.py").write_text(f"while True: print('sum', end={end})\n")
    ((_, output, status),) = terminal("python3 client.py", until="Max speed").runs
    assert status == 124
    assert "of which only the first are shown; no line contained 'Max speed')" in output and len(output) < 3000


def test_a_command_that_waits_for_a_name_that_nobody_serves_is_not_waited_for(tmp_path, monkeypatch):
    monkeypatch.setattr("course.notebook.terminal.IN_VAIN", 0.3)
    (tmp_path / "ros2").write_text(
        "#!/bin/sh\necho 'still waiting; served here: /b. Ctrl-C ends this.'\nexec sleep 60\n"
    )
    (tmp_path / "ros2").chmod(0o755)
    ((_, output, status),) = terminal("./ros2 service call /a std_srvs/srv/Trigger").runs
    assert status == 124
    assert "served here: /b" in output and "(stopped after " in output and "30 s" not in output


class Session:
    """A session in which nodes fail when they are told to: each failure is told once."""

    def __init__(self):
        self.untold = []
        self.source = ""  # of the nodes

    def look(self):
        if self.untold:
            failure = NodeFailed(self.untold.pop(0))
            failure.source = self.source
            raise failure


@pytest.fixture
def session(monkeypatch):
    session = Session()
    monkeypatch.setattr(waiting, "lookouts", [session.look])
    monkeypatch.setattr("course.notebook.terminal.lookouts", waiting.lookouts)
    return session


def test_what_has_failed_in_the_session_meanwhile_is_told_below(tmp_path, session):
    """As a client is told that its goal was aborted, and no more."""
    (tmp_path / "client.py").write_text("import sys\nprint('aborted')\nsys.exit(1)\n")
    session.untold = ["lift_server.py raised: KeyError: 'x'\n  lift_server.py, line 3", "other.py ended"]
    assert terminal("python3 client.py").lines == [
        "$ python3 client.py",
        "aborted",
        "[exit status 1]",
        "lift_server.py raised: KeyError: 'x'",
        "  lift_server.py, line 3",
        "other.py ended",
    ]
    assert terminal("python3 client.py").failures == []


def test_a_program_that_waits_when_a_node_has_failed_is_not_waited_for(tmp_path, session, monkeypatch):
    monkeypatch.setattr("course.notebook.terminal.IN_VAIN", 0.3)
    (tmp_path / "client.py").write_text("import threading  # and rclpy\n\nthreading.Event().wait()\n")
    session.untold = ["server.py ended"]
    lines = terminal("python3 client.py").lines
    assert lines[1].endswith(", because a node of this notebook has failed). client.py was here:")
    assert lines[2:] == ["  client.py, line 3", "    threading.Event().wait()", "[exit status 124]", "server.py ended"]


def test_a_program_that_goes_on_when_a_node_has_failed_is_left_to_it(tmp_path, session, monkeypatch):
    """One that prints, or was given more time than usual."""
    monkeypatch.setattr("course.notebook.terminal.IN_VAIN", 2.0)
    session.untold = ["server.py ended"]
    prints = "import time\nfor number in range(16):\n    time.sleep(0.15)\n    print(number, flush=True)\n"
    assert run(tmp_path, prints)[1] == 0
    session.untold = ["server.py ended"]
    assert run(tmp_path, "import time\ntime.sleep(3)\n", timeout=USUAL + 1) == ("", 0)


@pytest.mark.parametrize("imports", ["import time", "import time, rclpy\nnode.create_client(Trigger, '/ask')"])
def test_a_program_that_needs_nothing_of_a_node_that_has_failed_is_shown_to_its_end(
    tmp_path, session, monkeypatch, imports
):
    """And the failure is told below."""
    monkeypatch.setattr("course.notebook.terminal.IN_VAIN", 0.2)
    session.untold = ["server.py ended"]
    session.source = "import rclpy\nnode.create_service(Trigger, '/other', answer)\n"
    client = "class node:\n    create_client = print\nTrigger = 0\n"
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "rclpy.py").touch()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "library"))
    (tmp_path / "client.py").write_text(f"{client}{imports}\ntime.sleep(1.5)\nprint('done')\n")
    assert terminal("python3 client.py").lines[-2:] == ["done", "server.py ended"]


def test_a_thread_that_still_runs_at_the_end_of_a_program_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    program = "import os, sys\nfrom threading import Thread\n\nos.write(2, b'{}')\nos.abort()\n"
    (tmp_path / "client.py").write_text(program.format("terminate called without an active exception\\n"))
    ((_, output, status),) = terminal("python3 client.py").runs
    assert status == -6
    assert "\nHint: One of its threads, such as one that spins, still ran when the program ended. " in output
