"""`course doctor`: green and red lines, what to do about each, and the exit status."""

import io
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from rich.console import Console

from course.foundation.waiting import wait_until
from course.installation_check import CHECKS, Check, brief, report


def broken() -> str:
    raise RuntimeError("it is not there\nwith details")


@pytest.mark.parametrize(("student", "status"), [(True, 1), (False, 0)])
def test_only_what_a_student_needs_fails_the_command(student, status):
    out = io.StringIO()
    checks = (Check("fine", lambda: "found", "nothing"), Check("lost", broken, "look for it", student=student))
    assert report(checks, Console(file=out, width=100)) == status
    fine, lost = (line for line in out.getvalue().splitlines() if "fine" in line or "lost" in line)
    assert "ok" in fine and "found" in fine
    assert "no" in lost and "it is not there: look for it" in lost


def test_a_terminal_shows_which_check_runs():
    out = io.StringIO()
    shown = threading.Event()

    def slow() -> str:
        assert wait_until(lambda: "checking: slow" in out.getvalue(), 5.0)
        shown.set()
        return "found"

    assert report((Check("slow", slow, "nothing"),), Console(file=out, width=100, force_terminal=True)) == 0
    assert shown.is_set()


def test_brief_is_a_line_for_each_check_that_a_student_needs(capsys):
    checks = (Check("fine", lambda: "found", "nothing"), Check("grading", broken, "look for it", student=False))
    assert brief(checks) == 0 and capsys.readouterr().out == "ok  fine\n"
    assert brief((Check("lost", broken, "look for it"),)) == 1
    assert capsys.readouterr().out == "no  lost: it is not there: look for it\n"


def test_every_check_has_a_cure():
    assert all(check.cure for check in CHECKS)


def test_this_machine_is_fit():
    done = subprocess.run(
        [Path(sys.executable).parent / "course", "doctor"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("ok") >= len(CHECKS) and not done.stderr


WITHOUT_A_BUILD = """
import sys
from course.installation_check import CHECKS, build, report
sys.exit(report(tuple(check for check in CHECKS if check.test is not build)))
"""


def test_an_interpreter_without_the_ros_libraries_is_red():
    """A child of another environment that inherits the wheels' marker cannot load them."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_A_BUILD],
        env={"PATH": "/usr/bin:/bin", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1", "COLUMNS": "150"},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 1
    assert "run environment/install" in done.stdout and "Traceback" not in done.stdout + done.stderr
