"""Late penalties: the policy, and that nbgrader and `autograder grade` take off the same."""

import contextlib
import io
import json
import logging
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from pathlib import Path
from unittest.mock import patch

import pytest
from nbgrader.api import Gradebook
from traitlets import TraitError
from traitlets.config import Config

from autograder import cli
from autograder.gradebook import extensions, late, plugins, release, shared_file
from autograder.gradebook.book import Scores
from autograder.records import GRADED, PASSED, Report, Result
from autograder.results.output import UsageError
from autograder.submissions import exercises, listing, reading

pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
DUE = datetime(2026, 5, 1, 12)
HOUR = timedelta(hours=1)


def report(student: str, assignment: str = "calculator") -> Report:
    """All points of the hidden tests."""
    tests = [Result(test.id, test.title, PASSED, test.points, test.points) for test in exercises.load(assignment).tests]
    most = sum(test.points for test in tests)
    return Report(student, assignment, GRADED, most, most, 1, 0.0, tests=tests)


def hand_in(submitted: Path, student: str, hours: float | None, assignment: str = "calculator") -> None:
    """An empty notebook, so many hours after the due date; None: without a time."""
    folder = submitted / student / assignment
    folder.mkdir(parents=True)
    (folder / f"{assignment}.ipynb").write_text('{"cells": []}')
    if hours is not None:
        (folder / "timestamp.txt").write_text(f"{DUE + hours * HOUR:%Y-%m-%d %H:%M:%S} UTC\n")


def penalties(url: str, assignment: str = "calculator") -> dict[str, float]:
    with Gradebook(url) as book:
        return {
            late.student_id: late.notebooks[0].late_submission_penalty or 0
            for late in book.assignment_submissions(assignment)
        }


@pytest.fixture(scope="module")
def memory():
    """A gradebook with a due date and a student."""
    with Gradebook("sqlite://") as book:
        book.add_assignment("calculator", duedate=DUE)
        book.add_student("ada")
        yield book


@pytest.mark.parametrize(
    ("options", "hours", "days"),
    [
        ({}, -1, 0),
        ({}, 0, 0),
        ({}, 0.01, 1),
        ({}, 24, 1),
        ({}, 24.01, 2),
        ({"count": "whole"}, 23.9, 0),
        ({"count": "whole"}, 49, 2),
        ({"grace_days": 1}, 24, 0),
        ({"grace_days": 1}, 25, 1),
        ({"grace_days": 0.25}, 6, 0),
        ({"grace_budget": 2}, 49, 1),
        ({"extensions": {"ada": 2}}, 48, 0),
        ({"extensions": {"ada": 2}}, 49, 1),
        ({"extensions": {"bob": 2}}, 49, 3),
        ({"extensions": {"ada": {"calculator": "2026-05-02 13:00 UTC"}}}, 24.5, 0),
        ({"extensions": {"ada": {"calculator": "2026-05-02 13:00 UTC"}}}, 26, 1),
        ({"extensions": {"ada": {"services": 9}}}, 1, 1),
        ({"extensions": {"ada": "2026-04-01 00:00 UTC"}}, 1, 1),
        ({"extensions": {"ada": -5}}, 1, 1),
    ],
)
def test_days(memory, options, hours, days):
    handed_in = memory.update_or_create_submission("calculator", "ada", timestamp=DUE + hours * HOUR)
    assert late.LatePolicy(**options).charged_days(handed_in) == days


def test_points():
    policy = late.LatePolicy(percent_per_day=10)
    assert [policy.points(days, 15, 20) for days in (0, 1, 3, 10, 99)] == [0, 1.5, 4.5, 15, 15]
    policy = late.LatePolicy(percent_per_day=10, percent_of="max_score", cap=50)
    assert [policy.points(days, 15, 20) for days in (1, 3, 99)] == [2, 6, 10]
    assert policy.points(99, 8, 20) == 8 and policy.points(99, 0, 20) == 0 and policy.points(1, -2, 20) == 0
    assert late.LatePolicy().points(99, 15, 20) == 0


@pytest.mark.parametrize("extension", ["tomorrow, maybe", None, [3], {"calculator": "never"}])
def test_an_extension_that_is_none_is_refused(extension):
    with pytest.raises(TraitError, match="'ada' has"):
        late.LatePolicy(extensions={"ada": extension})


def test_the_budget_is_spent_in_the_order_of_due_dates(memory):
    policy = late.LatePolicy(grace_budget=3)
    lateness = {"services": 30, "actions": 10, "calculator": 50}  # h
    memory.update_or_create_student("bob")
    for week, (name, hours) in enumerate(lateness.items()):
        due = DUE - timedelta(weeks=2 - week)
        memory.update_or_create_assignment(name, duedate=due)
        memory.update_or_create_submission(name, "bob", timestamp=due + hours * HOUR)
    charged = {name: policy.charged_days(memory.find_submission(name, "bob")) for name in lateness}
    assert charged == {"services": 0, "actions": 0, "calculator": 3}


@pytest.fixture(scope="module")
def released(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("released")
    release.release(folder, ["calculator"])
    return folder


@pytest.fixture
def course(released, tmp_path, monkeypatch) -> Path:
    """A course with a due date and a policy; every submission gets all points, without running it."""
    shutil.copytree(released, tmp_path, dirs_exist_ok=True)
    with open(tmp_path / "nbgrader_config.py", "a") as config:
        config.write(
            "c.LatePolicy.percent_per_day = 10\nc.LatePolicy.grace_days = 1\nc.LatePolicy.cap = 50\n"
            "c.LatePolicy.extensions = {'excused': 30, 'put_off': {'calculator': '2026-05-04 12:00 UTC'}}\n"
        )
    set_due(f"sqlite:///{tmp_path / 'gradebook.db'}")
    for student, hours in {
        "early": -5,
        "on_time": 0,
        "in_grace": 24,
        "two_days": 26,
        "weeks": 999,
        "excused": 100,
        "put_off": 97,
        "no_time": None,
    }.items():
        hand_in(tmp_path / "submitted", student, hours)
    monkeypatch.setattr(plugins, "grade", lambda handed_in, *_: report(handed_in.student))
    monkeypatch.setattr(plugins, "choose", lambda *_: "none")
    return tmp_path


def set_due(url: str) -> None:
    with Gradebook(url) as book:
        book.update_or_create_assignment("calculator", duedate=DUE)


def test_both_commands_take_off_the_same(course):
    by_nbgrader, by_grade = f"sqlite:///{course / 'gradebook.db'}", f"sqlite:///{course / 'other.db'}"
    (course / "other.db").write_bytes((course / "gradebook.db").read_bytes())
    answer = release.api(course).autograde("calculator", "*")
    assert answer["success"], answer
    assert release.api(course).generate_feedback("calculator")["success"]
    pages = {
        student: (course / "feedback" / student / "calculator" / "calculator.html").read_text()
        for student in ("two_days", "early")
    }
    assert "Handed in late: -2 points" in pages["two_days"] and "Handed in late" not in pages["early"]
    assert "18 of 25 points so far" in pages["two_days"] and "20 of 25 points so far" in pages["early"]
    for _ in range(2):  # writing again changes nothing
        with Scores(by_grade, course / "submitted") as scores:
            for student, assignment in listing.find(course / "submitted", None, []):
                scores.write(report(student, assignment))
        assert (
            penalties(by_grade)
            == penalties(by_nbgrader)
            == {
                "early": 0,
                "on_time": 0,
                "in_grace": 0,
                "two_days": 2,
                "weeks": 10,
                "excused": 0,
                "put_off": 2,
                "no_time": 0,
            }
        )


def test_there_is_no_penalty_unless_the_course_sets_one(course):
    config = course / "nbgrader_config.py"
    config.write_text("".join(line for line in config.open() if "LatePolicy" not in line))
    url = f"sqlite:///{course / 'gradebook.db'}"
    with Scores(url, course / "submitted") as scores:
        scores.write(report("weeks"))
    assert penalties(url) == {"weeks": 0}
    with Gradebook(url) as book:
        assert book.find_submission("calculator", "weeks").total_seconds_late == 999 * 3600


@pytest.mark.parametrize("line", ["percent_per_day = 'ten'", "extensions = {'ada': 'soon'}"])
def test_a_mistake_in_the_policy_is_told_before_anything_is_graded(course, line):
    with (course / "nbgrader_config.py").open("a") as config:
        config.write(f"c.LatePolicy.{line}\n")
    with pytest.raises(UsageError, match=f"nbgrader_config.py: .*{line.split()[0]}"):
        Scores(f"sqlite:///{course / 'gradebook.db'}", course / "submitted")


def test_nbgraders_own_method_still_works(course):
    with open(course / "nbgrader_config.py", "a") as config:
        config.write("c.LateSubmissionPlugin.penalty_method = 'zero'\n")
    url = f"sqlite:///{course / 'gradebook.db'}"
    with Scores(url, course / "submitted") as scores:
        for student in ("in_grace", "two_days"):
            scores.write(report(student))
    assert penalties(url) == {"in_grace": 0, "two_days": 20}


def test_what_is_no_time_is_told_and_loses_no_score(course, caplog):
    submitted = course / "submitted"
    for student, text in {
        "words": "yesterday",
        "long": "2026-05-01 " * 99,
        "bytes": "\0\ud800",
        "far": "9" * 30,
        "hours": "9" * 30 + "h",
        "zone": "2026-05-01 12:00:00 PST",
        "future": "2999-05-01 12:00:00 UTC",
        "no_day": "2026-02-30 12:00:00 UTC",
    }.items():
        hand_in(submitted, student, None)
        (submitted / student / "calculator" / "timestamp.txt").write_bytes(text.encode(errors="surrogatepass"))
    hand_in(submitted, "linked", None)
    (submitted / "linked" / "calculator" / "timestamp.txt").symlink_to("/dev/stdin")
    url = f"sqlite:///{course / 'gradebook.db'}"
    names = ("words", "long", "bytes", "far", "hours", "zone", "future", "no_day", "linked")
    with caplog.at_level(logging.WARNING), Scores(url, submitted) as scores:
        for student in names:
            scores.write(report(student))
    told = "{}/calculator: the time of handing in is unknown"
    assert [told.format(name) in caplog.text for name in names] == [True] * len(names)
    assert penalties(url) == dict.fromkeys(names, 0)


def test_a_configuration_that_does_not_load_is_one_line(course):
    (course / "nbgrader_config.py").write_text("c = get_config(")
    with pytest.raises(UsageError, match=r"nbgrader_config.py cannot be loaded: SyntaxError"):
        Scores(f"sqlite:///{course / 'gradebook.db'}", course / "submitted")


def test_marks_by_hand_change_what_is_taken_off_when_assigned_again(course):
    """A percentage of the score; nbgrader alone would leave the penalty as it was before marking."""
    url = f"sqlite:///{course / 'gradebook.db'}"
    with Scores(url, course / "submitted") as scores:
        scores.write(report("two_days"))
    with Gradebook(url) as book:
        grade = book.find_grade("exponentiation", "calculator", "calculator", "two_days")
        grade.manual_score, grade.needs_manual_grade = 5, False
        book.db.commit()
    late.assign(late.course_config(course / "submitted"), url, "calculator", "calculator", "two_days")
    assert penalties(url) == {"two_days": 2.5}
    late.assign(Config(), url, "calculator", "calculator", "two_days")
    assert penalties(url) == {"two_days": 0}


def test_grade_on_the_command_line(course, monkeypatch, capsys):
    """The results keep the score of the tests; the gradebook knows the penalty."""
    from autograder import cli

    (course / "submitted" / "two_days" / "calculator" / "calculator_server.py").symlink_to("/etc/passwd")
    arguments = ["grade", str(course / "submitted"), "--output", str(course / "out"), "--student", "two_days"]
    try:
        cli.app(arguments, standalone_mode=False)
    except SystemExit as done:
        assert not done.code
    assert json.loads((course / "out" / "results.jsonl").read_text())["student"] == "two_days"
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        assert book.find_submission("calculator", "two_days").timestamp == DUE + 26 * HOUR
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "text",
    [
        "2026-05-08 12:30:00 UTC",
        "2026-05-08 12:30:00.000000 UTC\n",
        "2026-05-08 12:30",
        "2026-05-08T12:30:00Z",
        "2026-05-08 14:30:00 +0200",
        "2026-05-08 14:30:00+02:00",
    ],
)
def test_a_time_is_read_in_utc(text, tmp_path):
    (tmp_path / "timestamp.txt").write_text(text)
    assert reading.handed_in_at(tmp_path) == datetime(2026, 5, 8, 12, 30)


def extend(course: Path, *words: str) -> subprocess.CompletedProcess:
    """Run the command in this process, and return its status and output."""
    command = ["autograder", "extend", *words, "--course", str(course)]
    with (
        patch.object(sys, "argv", command),
        contextlib.redirect_stdout(io.StringIO()) as said,
        contextlib.redirect_stderr(io.StringIO()) as errors,
        pytest.raises(SystemExit) as end,
    ):
        cli.main()
    return subprocess.CompletedProcess(command, end.value.code or 0, said.getvalue(), errors.getvalue())


def test_a_name_that_nobody_has_is_told(course):
    """In other letters it is another student's: this one's hand-in would stay late."""
    (course / "submitted" / "ada").mkdir()
    said = extend(course, "Ada", "zoe", "ada", "--days", "3").stdout.splitlines()
    assert said[-1] == "LOOK: no student of this course has the name Ada. Do you mean ada?"
    assert not any("LOOK" in line for line in said[:-1])  # zoe has not handed in yet
    (course / "submitted" / ".roster.csv").write_text("student,email\nada,a@example.org\nben,b@example.org\n")
    said = extend(course, "zoe", "ben", "ada2", "--take-back").stdout
    assert "LOOK: no student of this course has the name zoe.\n" in said
    assert "the name ada2. Do you mean ada?\n" in said and "the name ben" not in said


def test_more_time_given_by_the_command_counts_for_both_commands_and_can_be_taken_back(course):
    url = f"sqlite:///{course / 'gradebook.db'}"
    assert extend(course).stdout == "No student has an extension.\n"
    command = [Path(sys.executable).with_name("autograder"), "extend", "weeks", "two_days", "--days", "1.5"]
    given = subprocess.run([*command, "--course", course], capture_output=True, text=True)
    assert (given.returncode, given.stderr) == (0, "")
    assert given.stdout == "two_days: every exercise: 1.5 days more\nweeks: every exercise: 1.5 days more\n"
    given = extend(course, "weeks", "put_off", "--assignment", "calculator", "--until", "2026-06-11 01:00+02:00")
    assert given.stdout.splitlines() == [
        "put_off: calculator: until 2026-06-10 23:00 UTC",
        "two_days: every exercise: 1.5 days more",
        "weeks: every exercise: 1.5 days more",
        "weeks: calculator: until 2026-06-10 23:00 UTC",
    ]
    assert release.api(course).autograde("calculator", "*")["success"]
    wanted = {"two_days": 0, "put_off": 0, "weeks": 2}
    assert wanted.items() <= penalties(url).items()
    with Scores(url, course / "submitted") as scores:
        for student in wanted:
            scores.write(report(student))
    assert wanted.items() <= penalties(url).items()
    taken = extend(course, "weeks", "put_off", "--take-back")
    assert taken.stdout == "two_days: every exercise: 1.5 days more\n"
    with Scores(url, course / "submitted") as scores:
        for student in wanted:
            scores.write(report(student))
    assert {"two_days": 0, "put_off": 2, "weeks": 10}.items() <= penalties(url).items()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["ada"], "give one of --days, --until and --take-back"),
        (["ada", "--days", "1", "--take-back"], "give one of --days, --until and --take-back"),
        (["--days", "1"], "name the students, before the options"),
        (["ada", "", "--days", "1"], "the name of a student is empty"),
        (["ada", "--days", "1e308"], "an extension is at most 3660 days"),
        (["ada", "--until", "tomorrow"], "'tomorrow' is not a time: write it as '2026-11-20 23:59 UTC'"),
        (["ada", "--days", "1", "--assignment", "calculus"], "there is no exercise 'calculus'; there are: actions, "),
    ],
)
def test_an_extension_that_cannot_be_given_is_refused_and_changes_nothing(course, words, said):
    done = extend(course, *words)
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1
    assert not (course / extensions.FILE).exists()


def test_two_instructors_extend_at_the_same_time_and_neither_loses_an_extension(course, monkeypatch):
    both = threading.Barrier(2)
    read = shared_file.read

    def slowly(path: Path) -> bytes:
        content = read(path)
        with contextlib.suppress(threading.BrokenBarrierError):
            both.wait(0.5)  # s: both have read before one writes, if nothing prevents it
        return content

    monkeypatch.setattr(shared_file, "read", slowly)
    (course / extensions.FILE).write_text("{}\n")
    with ThreadPoolExecutor(2) as pool:
        [*pool.map(lambda student: extensions.change(course, [student], None, 1.0), ["ada", "bob"])]
    assert {*extensions.read(course)} == {"ada", "bob"}


def test_a_folder_without_a_course_has_no_extensions(tmp_path):
    done = extend(tmp_path, "ada", "--days", "1")
    assert (done.returncode, list(tmp_path.iterdir())) == (2, [])
    assert done.stderr.endswith("is not a course folder: `autograder release --course` makes one\n")


def test_extensions_that_cannot_be_read_are_told_before_anything_is_graded(course):
    (course / extensions.FILE).write_text('{"ada": 3}')
    with pytest.raises(UsageError, match="extensions.json cannot be read: .* Correct it, or delete it"):
        Scores(f"sqlite:///{course / 'gradebook.db'}", course / "submitted")
    assert "extensions.json cannot be read" in extend(course, "bob", "--days", "1").stderr
