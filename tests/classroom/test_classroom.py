"""A class of two students and an instructor: they log in, work, hand in, grade, and read what came back."""

import json
import os
import pwd
import re
import signal
import subprocess
from pathlib import Path

import pytest
import requests
from nbgrader.api import Gradebook

from autograder.classroom import accounts, hub, servers
from autograder.classroom.box import NEVER
from autograder.paths import repository
from course.foundation.waiting import wait_until
from tests.classroom.conftest import DATED, call_classroom, run_classroom
from tests.classroom.visitor import Visitor

SOLUTION = repository() / "solutions" / "calculator"


def put(visitor: Visitor, path: str, text: str) -> None:
    body = {"type": "file", "format": "text", "content": text}
    assert visitor.call("PUT", f"api/contents/{path}", json=body).ok


def test_who_is_not_in_the_roster_or_has_another_password_stays_outside(classroom):
    students, instructors = (hub.shared_passwords(classroom)[who] for who in ("students", "instructors"))
    assert not Visitor(classroom.url, "ada").log_in("guessed")
    assert not Visitor(classroom.url, "teacher").log_in(students), "a student came in as the instructor"
    assert not Visitor(classroom.url, "eve").log_in(students)
    assert not Visitor(classroom.url, "root").log_in(instructors)


def test_a_notebook_runs_as_on_a_laptop(ada, kernel):
    cells = ada.cells("calculator/calculator.ipynb")
    live = kernel(ada, "calculator")
    assert "live session" in live.run(cells[0]).text
    ran = live.run("import os, course; print(os.getcwd(), course.__file__)")
    assert f"/home/ada/notebooks/calculator {repository()}/course" in ran.text
    assert live.run("%%exercise Half.srv\nfloat64 a\n---\nfloat64 half").error == "", "a .srv is built in the box"


@pytest.mark.matrix  # the same loop by clicks is in test_pages.py
@pytest.mark.long("nbgrader's commands, one after the other")
def test_an_assignment_is_handed_in_graded_and_returned_by_the_exchange(ada, bob, teacher, kernel, classroom):
    for file in SOLUTION.iterdir():
        put(ada, f"calculator/{file.name}", file.read_text())
    sent = kernel(ada, "calculator").run("!course hand-in --yes --no-check").text
    assert "It is in the exchange of your class." in sent

    # bob pretends to be ada, later than she was, and links to the answer
    forged = f"""
import os
folder = "/srv/exchange/ros2/inbound/ada+calculator+2090-01-01 00:00:00.000000 UTC+forged"
os.makedirs(folder)
os.chmod(folder, 0o755)
for name in {[file.name for file in SOLUTION.iterdir()]}:
    os.symlink("{SOLUTION}/" + name, f"{{folder}}/{{name}}")
open(f"{{folder}}/calculator.ipynb", "w").write({json.dumps(empty_notebook(ada))})
os.chmod(f"{{folder}}/calculator.ipynb", 0o644)
os.mkfifo(f"{{folder}}/waits.py")
os.makedirs("/srv/exchange/ros2/inbound/bob+calculator+never+x")
"""
    assert kernel(bob).run(forged).text == ""

    grading = kernel(teacher, "grading")
    collected = grading.run("!nbgrader collect calculator").text
    assert "belongs to bob, and is collected as theirs" in collected
    assert sorted(path.name for path in (classroom.grading / "submitted").iterdir()) == ["ada", "bob"]
    assert not [path for path in (classroom.grading / "submitted").rglob("*") if path.is_symlink() or path.is_fifo()]
    for command in ("autograde calculator", "generate_feedback calculator", "release_feedback calculator"):
        said = grading.run(
            f"import subprocess; done = subprocess.run('nbgrader {command}'.split(), capture_output=True, text=True)\n"
            "print(done.stderr, done.returncode, sep='\\n')"
        ).text
        assert said.splitlines()[-1] == "0", said
    with Gradebook(f"sqlite:///{classroom.grading / 'gradebook.db'}") as book:
        scores = {each.student.id: each.score for each in book.assignment_submissions("calculator")}
    assert scores["ada"] == 20.0 and scores["bob"] == 0.0

    found = ada.call("POST", "assignments/fetch_feedback", json={"course_id": "ros2", "assignment_id": "calculator"})
    handed_in = next(each for each in found.json()["value"] if each["status"] == "submitted")
    page = handed_in["submissions"][0]["local_feedback_path"] + "/calculator.html"
    assert "20 of 20" in ada.call("GET", f"api/contents/{page}").json()["content"]
    assert "feedback" not in kernel(bob).run("!ls /srv/exchange/ros2/feedback").text.replace("/feedback'", "")


def empty_notebook(visitor: Visitor) -> str:
    return json.dumps(visitor.call("GET", "api/contents/calculator/calculator.ipynb").json()["content"])


def test_an_assignment_can_be_fetched(bob, kernel):
    bob.call("PATCH", "api/contents/services", json={"path": "before"})
    done = bob.call("POST", "assignments/fetch", json={"course_id": "ros2", "assignment_id": "services"})
    assert done.json()["success"]
    assert bob.cells("services/services.ipynb")


def test_instructors_have_formgrader_and_students_have_not_and_nobody_what_acts_by_itself(ada, teacher):
    hidden = ("formgrader", "course-list", "create-assignment", "validate-assignment")
    names = dict.fromkeys(hidden, False) | {"assignment-list": True}
    for visitor, instructor in ((ada, False), (teacher, True)):
        page = visitor.call("GET", "lab").text
        config = json.loads(page.partition('id="jupyter-config-data" type="application/json">')[2].partition("<")[0])
        disabled = config["disabledExtensions"]
        for name, everybody in names.items():
            assert (f"@jupyter/nbgrader:{name}" in disabled) is not (instructor or everybody), (visitor.name, name)
        assert {*NEVER} <= {*disabled}
    assert ada.call("GET", "formgrader/api/assignments").status_code == 404
    assignments = teacher.call("GET", "formgrader/api/assignments").json()
    assert "calculator" in {each["name"] for each in assignments}


def test_an_exercise_is_released_at_its_date(classroom):
    """The command has only written its date down: the hub releases it."""
    notebook = classroom.home(classroom.find("ada")) / "notebooks" / DATED / f"{DATED}.ipynb"
    assert wait_until(notebook.exists, 300, alert=False)
    status = call_classroom("status", "--folder", str(classroom.folder)).stdout
    assert [line.split()[1] for line in status.splitlines() if line.split()[:1] == [DATED]] == ["released"]
    assert "Released ai_integration, at its date." in (classroom.state / hub.LOG).read_text()


def test_when_the_hub_is_killed_work_goes_on_and_up_finds_it_again(up, classroom, bob, come_in, kernel):
    live = kernel(bob)
    live.run("kept = 17")
    before = servers.started(classroom)
    os.kill(hub.running(classroom).pid, signal.SIGKILL)
    page = requests.get(classroom.url)
    assert page.status_code == 503 and "Your work is safe" in page.text and "try again" in page.text
    os.kill(int(hub.proxy_pid(classroom).read_text()), signal.SIGKILL)
    status = run_classroom("status", "--folder", str(classroom.folder))
    assert status.returncode == 1 and "does not run" in status.stdout
    again = run_classroom(*up)
    assert again.returncode == 0, again.stderr
    assert servers.started(classroom) == before, "servers were started anew"
    later = come_in("bob")
    found = later.call("GET", "api/kernels").json()
    assert live.number in {each["id"] for each in found}
    live.visitor = later
    live.connect()
    assert live.run("print(kept)").text == "17\n"
    assert call_classroom("status", "--folder", str(classroom.folder)).returncode == 0


def test_a_server_is_limited(classroom, ada, kernel):
    limits = classroom.limits
    live = kernel(ada)
    said = live.run("import resource; print(resource.getrlimit(resource.RLIMIT_NPROC))").text
    assert said.strip() == f"({limits.tasks}, {limits.tasks})"
    assert live.run(f"bytearray({limits.memory})").error == "MemoryError", "which tells the student, in the cell"
    groups = servers.started(classroom)["ada"].groups
    written = {path.read_text().strip() for group in groups for path in Path(group).glob("memory.*") if readable(path)}
    assert not groups or str(limits.memory) in written


def test_status_tells_who_has_most_on_the_disk(classroom, ada, kernel):
    assert kernel(ada).run(f"open('large', 'wb').write(bytes({60 << 20}))").error == ""
    said = call_classroom("status", "--folder", str(classroom.folder)).stdout
    assert kernel(ada).run("import os; os.remove('large')").error == ""
    assert re.search(r"GiB are free\. Most: ada [67]\d MiB, \w+ \d+ MiB, ", said), said


def readable(path: Path) -> bool:
    return path.name in ("memory.max", "memory.limit_in_bytes")


def test_up_makes_users_nobody_can_log_in_as(classroom):
    for member in classroom.members:
        user = pwd.getpwnam(classroom.user(member))
        assert user.pw_shell.endswith("nologin")
        locked = subprocess.run(["passwd", "--status", user.pw_name], capture_output=True, text=True).stdout
        assert locked.split()[1] == "L"
        assert accounts.ids(classroom, member) == (
            classroom.home(member).stat().st_uid,
            classroom.home(member).stat().st_gid,
        )
