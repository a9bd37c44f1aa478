"""The notebook's `check()`."""

import contextlib
import json
import linecache
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import course
from course.errors import ExerciseError
from course.explaining.hints import hint
from course.foundation.cells import Cell
from course.notebook import checks, extension, runs
from tests.kernels import Kernel

RELAY = object()


class Session(int):
    """A session that can be added up."""

    elsewhere = ""

    def checking(self, source):
        return contextlib.nullcontext()


def cell(name: str, source: str, **mark) -> dict:
    mark = {"grade": True, "locked": True, "grade_id": name} | mark
    return {"cell_type": "code", "metadata": {"nbgrader": mark}, "source": source}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A notebook's folder and kernel."""
    (tmp_path / "section.ipynb").write_text(
        json.dumps(
            {
                "cells": [
                    cell(
                        "adds",
                        ["# Public checks.\n", "assert total == 3, f'1 + 2 gave {total}'\n", "print('as asked')"],
                    ),
                    cell("other", "missing"),
                    cell("answer", "raise SystemExit", locked=False),
                    {"cell_type": "code", "metadata": {}, "source": "raise SystemExit"},
                ]
            }
        )
    )
    monkeypatch.chdir(tmp_path)
    shell = SimpleNamespace(user_ns={"total": 3}, transform_cell=lambda source: source)
    monkeypatch.setattr(checks, "get_ipython", lambda: shell)
    return shell.user_ns


@pytest.mark.parametrize("left", [False, True], ids=["", "a save that failed on a full disk"])
def test_check_says_in_a_line_how_each_ended(here, capsys, left):
    if left:
        Path(".~section.ipynb").touch()
    course.check()
    assert capsys.readouterr().out == "adds: passed\nother: not yet: NameError: name 'missing' is not defined\n"


def test_check_shows_the_message_of_the_one_asked_for(here, capsys):
    here["total"] = 4
    course.check("adds")
    course.check("no such")
    assert (
        capsys.readouterr().out
        == "adds: not yet: 1 + 2 gave 4\nthere are no checks 'no such' here: there are 'adds', 'other'\n"
    )


def test_a_check_runs_with_the_session_and_the_functions_of_python_whatever_the_cells_call_so(
    here, monkeypatch, capsys
):
    Path("section.ipynb").write_text(json.dumps({"cells": [cell("adds", "assert sum([ros, total]) == 4\nmade = 1")]}))
    monkeypatch.setattr(checks, "current", lambda: Session(1))
    here.update(sum=5, ros="text")
    course.check("adds")
    assert capsys.readouterr().out == "adds: passed\n"
    assert here == {"total": 3, "sum": 5, "ros": "text"}


class OtherServer:
    """Of the name of a check, as a class has it."""


def test_a_hint_on_a_name_without_its_quotation_marks_has_the_name_of_the_check(here):
    Path("section.ipynb").write_text(json.dumps({"cells": [cell("adds", ""), cell("other-server", "")]}))
    error = "NameError: name 'other_server' is not defined"
    assert hint(error, code="course.check(other_server)").endswith("`course.check('other-server')`.")


@pytest.mark.parametrize(
    ("given", "meant"),
    [(RELAY, "relay"), (4, "adds"), (ModuleType("other_server"), "other-server"), (OtherServer, "other-server"),
     (OtherServer(), "other-server"), (SimpleNamespace(name="other_server.py"), "other-server"),
     (Path("other.py"), "other-server")],
)  # fmt: skip
def test_a_name_without_its_quotation_marks(here, given, meant):
    """The name of something else: the check of this name, or the first one."""
    names = ("adds", "other-server", "relay")
    Path("section.ipynb").write_text(json.dumps({"cells": [cell(name, "") for name in names]}))
    here["relay"] = RELAY
    with pytest.raises(ExerciseError, match=f"a text, in quotation marks: course.check\\('{meant}'\\)"):
        course.check(given)


def test_a_check_that_takes_too_long_says_where_it_was(tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "CELL", 3)
    mark = {"grade": True, "locked": True, "grade_id": "slow"}
    waits = Cell("code", "import threading\nprint('begun')\nthreading.Event().wait()", mark)
    assert runs.outcomes([waits], {}, tmp_path) == {
        "slow": "not yet: it had not finished after 3 s, in `threading.Event().wait()`"
    }


HELD = """# Public checks.
import threading
from rclpy.node import Node
from std_srvs.srv import Trigger

class Other(Node):
    def __init__(self):
        super().__init__("held")
        self.create_service(Trigger, "/asked", self.answer)
    def answer(self, request, response):
        threading.Event().wait(6.0)
        return response

ros.start(Other)
asked = ros.node.create_client(Trigger, "/asked").call_async(Trigger.Request())
assert ros.until(asked.done, timeout=3.5), "it holds its answer back"
"""


@pytest.fixture
def kernel(tmp_path):
    kernel = Kernel(tmp_path)
    yield kernel
    kernel.stop()


def test_the_nodes_of_a_check_that_failed_are_stopped_and_their_callbacks_are_not_told(kernel):
    (kernel.folder / "section.ipynb").write_text(json.dumps({"cells": [cell("held", HELD)]}))
    kernel.run("import course\nros = course.live()")
    kernel.run("from rclpy.node import Node\nclass Own(Node):\n    def __init__(self): super().__init__('own')")
    kernel.run("ros.start(Own)")
    for run in (HELD, "course.check('held')"):
        said = kernel.run(run)
        assert "it holds its answer back" in said
        assert "has not returned" not in said
        assert kernel.run("print(list(ros.nodes()))") == "['/own']"


SERVER = "class AddServer(Node):\n    def __init__(self):\n        super().__init__('add_server')\n"
JUDGED = "assert judged, 'it must'\nadd_server = judged = server = 1"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "ros.start(add_server)",
            (
                "Hint: `add_server` is the name of a node, and `ros.start` takes its class: write "
                "`ros.start(AddServer)`."
            ),
        ),
        ("ros.stop(add_server)", 'Hint: The name of a node is a text: write `ros.stop("add_server")`.'),
        ("ros.start(relay, 1)", 'Hint: `relay.py` is a file: write its name as text, `ros.start("relay.py")`.'),
        ("ros.start(late.py)", 'Hint: `late.py` is a file: write its name as text, `ros.start("late.py")`.'),
        ("print(server)", ""),
        (
            "print(own)",
            (
                "Hint: `own` is defined in the cell of section.ipynb that begins with `own = 1`: run that cell "
                "first, and let it finish."
            ),
        ),
        (
            JUDGED,
            (
                "Hint: `judged` is defined in the cell of section.ipynb that begins with `assert judged, 'it must'`"
                ": run that cell first, and let it finish."
            ),
        ),
    ],
)
def test_a_name_of_a_check_alone_is_not_the_one_that_a_cell_means(here, line, said):
    plain = [{"cell_type": "code", "metadata": {}, "source": source} for source in (SERVER, "own = 1")]
    Path("section.ipynb").write_text(json.dumps({"cells": [*plain, cell("other", JUDGED)]}))
    Path("relay.py").touch()
    name = "/tmp/ipykernel_1/71.py"
    linecache.cache[name] = (len(line), None, f"{line}\n".splitlines(keepends=True), name)
    with pytest.raises(NameError) as error:
        exec(compile(line, name, "exec"), {"ros": SimpleNamespace(start=print, stop=print)})
    assert extension.reason(error.value, Path()) == said


@pytest.mark.parametrize(("domain", "joins"), [("77", False), ("78", True), ("many", True), ("", True)])
def test_checks_of_a_hand_in_do_not_join_the_session_whose_cell_has_started_it(monkeypatch, domain, joins):
    """Its programs serve what the checks' programs serve; a domain that the user has chosen is kept."""
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    monkeypatch.setattr(runs.registry, "of_domain", {77: "a session"}.get)
    assert (runs._kernel_variables().get("ROS_DOMAIN_ID") == domain) == joins
