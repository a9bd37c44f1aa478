"""A class over a term: absent students, hand-ins without a notebook, marks by hand, and what Formgrader finds."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from datetime import datetime
from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from typer.testing import CliRunner

from autograder.cli import app, main
from autograder.gradebook import ends, members, release
from autograder.gradebook.book import Scores, by_hand
from autograder.gradebook.entering import Entering
from autograder.records import FAILED, GRADED, INFRASTRUCTURE_ERROR, PASSED, Report, Result
from autograder.results.output import Basis, Output
from autograder.submissions import exercises, listing, provenance
from autograder.submissions.roster import REMEMBERED, of_class
from course import hand_in
from course.returned import record
from tests.chosen import each_night
from tests.gradebook.test_nbgrader import formgrader_page

pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
ROSTER = "student,first_name,last_name,email,canvas_id,role\nada,Ada,Lovelace,ada@uni.edu,11,student\n"
ROSTER += "bob,Bob,Ross,bob@uni.edu,12,student\nzoe,Zoë,Müller,zoe@uni.edu,13,\nprof,Alan,T,p@uni.edu,14,instructor\n"
TESTS = exercises.load("calculator").tests
MOST = sum(test.points for test in TESTS)
AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
os.umask(UMASK := os.umask(0))
QUESTION = "exponentiation"  # the cell that is marked by hand


def report(student: str) -> Report:
    tests = [Result(test.id, test.title, PASSED, test.points, test.points) for test in TESTS]
    return Report(student, "calculator", GRADED, MOST, MOST, 1, 0.0, tests=tests)


def run(*arguments: object) -> str:
    """Return what the command prints; it ends well."""
    ran = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert ran.exit_code == 0, ran.output
    return ran.output


@pytest.fixture(scope="module")
def released(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("released")
    release.release(folder, ["calculator"])
    return folder


@pytest.fixture
def course(released, tmp_path) -> Path:
    """A course in which ada has handed in files and notebook, bob files alone, and zoe nothing; results, no grades."""
    course = tmp_path / "course"
    shutil.copytree(released, course)
    (tmp_path / "roster.csv").write_text(ROSTER)
    for student in ("ada", "bob"):
        (course / "submitted" / student / "calculator").mkdir(parents=True)
        (course / "submitted" / student / "calculator" / "calculator_server.py").write_text("print()")
    shutil.copy(course / "release" / "calculator" / "calculator.ipynb", course / "submitted" / "ada" / "calculator")
    for student in ("ada", "bob"):
        passed(course / "submitted", student)
    return course


def passed(submitted: Path, student: str) -> None:
    """Write a result for what a student has handed in now, as if all hidden tests were passed."""
    files = listing.digest(listing.read(submitted, student, "calculator"))
    with Output(submitted.parent / "out", resume=True) as output:
        output.write(report(student), Basis(str(submitted), exercises.pack("calculator").digest, files))


def grade(course: Path, *options: object) -> str:
    """Enter the results that are there into the gradebook: nothing is run."""
    return run("grade", course / "submitted", "--output", course / "out", "--resume", *options)


def exported(course: Path, *options: object) -> tuple[dict[str, dict[str, str]], str]:
    """The lines of a table of grades, by student, and what the command prints."""
    said = run("export", course / "out", "--for", "csv", "--to", course / "grades.csv", *options)
    with open(course / "grades.csv", newline="") as file:
        return {line["student_id"]: line for line in csv.DictReader(file)}, said


def test_a_roster_that_was_given_once_is_known_to_all_commands(course, tmp_path):
    said = grade(course, "--roster", tmp_path / "roster.csv")
    assert "Not handed in: calculator: zoe." in said.splitlines()
    assert "Not handed in: calculator: zoe." in grade(course).splitlines()  # it is kept
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        names = {one.id: (one.first_name, one.last_name, one.email, one.lms_user_id) for one in book.students}
    assert names == {
        "ada": ("Ada", "Lovelace", "ada@uni.edu", "11"),
        "bob": ("Bob", "Ross", "bob@uni.edu", "12"),
        "zoe": ("Zoë", "Müller", "zoe@uni.edu", "13"),
    }
    table, said = exported(course, "--automatic")
    assert {student: line["state"] for student, line in table.items()} == {
        "ada": "graded",
        "bob": "graded",
        "zoe": "not handed in",
    }
    assert table["zoe"]["last_name"] == "Müller" and table["zoe"]["score"] == ""
    assert "calculator: not handed in by zoe" in said
    table, said = exported(course, "--automatic", "--missing-is-zero")
    assert table["zoe"]["score"] == "0" and "calculator: 2 grades; 0 points: 1 not handed in" in said.splitlines()
    assert "zoe" in run("return", course / "out").partition("Without a page")[2]
    assert (course / "submitted" / REMEMBERED).stat().st_mode & 0o077 == 0
    assert of_class(course / "submitted", None).students == {"ada", "bob", "zoe"}


def test_the_platform_is_told_who_handed_in_nothing(course, tmp_path):
    grade(course, "--roster", tmp_path / "roster.csv")
    run(
        "export", course / "out", "--for", "moodle", "--to", tmp_path / "moodle.csv", "--automatic", "--missing-is-zero"
    )
    assert (tmp_path / "moodle.csv").read_text().split() == [
        "username,calculator",
        f"ada,{MOST:g}",
        f"bob,{MOST:g}",
        "zoe,0",
    ]


def test_a_submission_that_the_grader_failed_at_is_named_beside_the_grades(course):
    with Output(course / "out", resume=True) as output:
        failed = Report("bob", "calculator", INFRASTRUCTURE_ERROR, None, MOST, 1, 0.0)
        output.write(failed, Basis(str(course / "submitted"), "suite", "files"))
    with Scores(f"sqlite:///{course / 'gradebook.db'}", course / "submitted") as scores:
        scores.write(report("ada"))
    line = "No grade, because the grader failed: bob/calculator."
    assert line in exported(course, "--automatic")[1].splitlines()
    assert line not in exported(course, "--automatic", "--student", "ada")[1].splitlines()


def test_who_has_left_the_class_did_not_fail_to_hand_in(course, tmp_path):
    """They are in no list of those who handed in nothing, and get no 0; what was collected before is exported."""
    (tmp_path / "roster.csv").write_text(f"{ROSTER}eve,Eve,Left,eve@uni.edu,15,\n")
    grade(course, "--roster", tmp_path / "roster.csv")
    assert exported(course, "--automatic")[0]["eve"]["state"] == "not handed in"
    (tmp_path / "roster.csv").write_text("\n".join(ROSTER.splitlines()[:1] + ROSTER.splitlines()[2:]))  # nor is ada
    assert "Not handed in: calculator: zoe." in grade(course, "--roster", tmp_path / "roster.csv").splitlines()
    table, said = exported(course, "--automatic", "--missing-is-zero")
    assert {student: line["state"] for student, line in table.items()} == {
        "ada": "graded",
        "bob": "graded",
        "zoe": "not handed in",
    }
    why = "because they have left the class without a hand-in: eve"
    assert f"1 student without a line in the file, {why}" in said and "not handed in by zoe" in said
    moodle = tmp_path / "moodle.csv"
    said = run("export", course / "out", "--for", "moodle", "--to", moodle, "--automatic", "--missing-is-zero")
    assert [line.partition(",")[0] for line in moodle.read_text().splitlines()] == ["username", "ada", "bob", "zoe"]
    assert why in said
    # In a class without such a roster: the members that `up` has noted; and who has other work keeps the line.
    (course / "submitted" / REMEMBERED).unlink()
    members.write(course, {1: "bob", 2: "zoe"})
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        book.add_assignment("services")
    said = run("export", course / "out", "--for", "csv", "--to", course / "grades.csv", "--missing-is-zero")
    assert "services: no hand-in from these students, who have left the class: ada" in said
    with open(course / "grades.csv", newline="") as file:
        lines = {(one["assignment"], one["student_id"]): (one["state"], one["score"]) for one in csv.DictReader(file)}
    assert lines["services", "ada"] == ("has left the class", "") and lines["services", "bob"] == ("not handed in", "0")
    assert "eve" not in {student for _, student in lines}


def graded(course: Path, tmp_path: Path, roster: str, **senders: str) -> Path:
    """Grade with this roster what came from these numbers in Canvas; return the file of the roster."""
    (tmp_path / "roster.csv").write_text(roster)
    for student, number in senders.items():
        came = provenance.Source("Canvas", student, number, "calculator.zip", 7)
        provenance.add(course / "submitted", student, "calculator", came)
    grade(course, "--roster", tmp_path / "roster.csv")
    return tmp_path / "roster.csv"


def written(course: Path, *options: object) -> tuple[list[list[str]], list[str]]:
    """Return the lines of a file of the tests' points, and those that the command prints."""
    said = run("export", course / "out", "--automatic", "--to", course / "x.csv", *options)
    with open(course / "x.csv", newline="") as file:
        return list(csv.reader(file)), said.splitlines()


def canvas(course: Path, *lines: str) -> Path:
    """A gradebook exported from Canvas, with the students of these lines."""
    header = ["Student,ID,SIS User ID,SIS Login ID,Section,calculator (77)", "    Points Possible,,,,,20"]
    (course / "from_canvas.csv").write_text("\n".join([*header, *lines]) + "\n")
    return course / "from_canvas.csv"


@pytest.mark.parametrize("number", ["moodle_id", "canvas_id", "lms_user_id"])
def test_moodle_gets_the_idnumber_and_username_that_the_roster_has(course, tmp_path, number):
    """And no other number, which may be somebody else's idnumber; who has none has no line."""
    graded(course, tmp_path, f"student,{number},idnumber,username\nada,501,900,al\nbob,900,,br\n")
    lines, said = written(course, "--for", "moodle", "--user", "idnumber")
    assert lines == [["idnumber", "calculator"], ["900", f"{MOST:g}"]]
    why = "because neither the roster (column 'idnumber') nor the gradebook has their idnumber: bob"
    assert f"1 student without a line in the file, {why}" in said
    lines, _ = written(course, "--for", "moodle", "--user", "username")
    assert lines[1:] == [["al", f"{MOST:g}"], ["br", f"{MOST:g}"]]


def test_moodle_gets_no_moodle_id_as_idnumber(course, tmp_path):
    graded(course, tmp_path, "student,moodle_id\nada,501\nbob,502\n")
    lines, said = written(course, "--for", "moodle", "--user", "idnumber")
    assert lines == [["idnumber", "calculator"]] and said[-2].endswith("nor the gradebook has their idnumber: ada, bob")
    (tmp_path / "roster.csv").write_text("student\nada\nbob\n")
    lines, _ = written(course, "--for", "moodle", "--roster", tmp_path / "roster.csv")
    assert [line[0] for line in lines[1:]] == ["ada", "bob"]  # without a column of usernames


@pytest.mark.parametrize("form", ["csv", "moodle", "canvas"])
@pytest.mark.parametrize("column", ["canvas_id", "number"])  # called so, or found by bob's
def test_another_student_of_the_same_name_gets_no_grade(course, tmp_path, form, column):
    """The old ada, 11, was graded, and has left; the new one is 99."""
    roster = graded(course, tmp_path, f"student,{column}\nada,11\nbob,12\n", ada="11", bob="12")
    roster.write_text(f"student,{column}\nada,99\nbob,12\n")
    options = ["--for", form, "--roster", roster, "--missing-is-zero"]
    if form == "canvas":
        options += ["--from-canvas", canvas(course, '"New, Ada",99,ada,a9,S,', '"Ross, Bob",12,bob,b2,S,')]
    lines, said = written(course, *options)
    points = {line[1 if form == "canvas" else 3 if form == "csv" else 0]: line for line in lines[1:]}
    place = lines[0].index("score") if form == "csv" else -1
    assert points["12" if form == "canvas" else "bob"][place] == f"{MOST:g}"
    if form == "moodle":
        assert "ada" not in points
    else:
        assert points["99" if form == "canvas" else "ada"][place] == ""
    if form == "csv":
        ada = dict(zip(lines[0], points["ada"], strict=True))
        assert (ada["state"], ada["raw_score"], ada["timestamp"]) == ("from another number", "", "")
    assert (
        "calculator: no grade for ada: the hand-in came from the number 11 in Canvas, and in the roster ada has 99 "
        f"(column {column!r}). Correct the roster if it is wrong. If they are two people, list both: ada with 11, and "
        "the other one with another name in the column 'student'"
    ) in said
    assert "calculator: 1 grade; left empty: 1 from another number" in said
    roster.write_text(f"student,{column}\nada,11\nada2,99\nbob,12\n")  # as the line says
    lines, said = written(course, "--for", "csv", "--roster", roster)
    assert {line[3]: line[7] for line in lines[1:]} == {"ada": "graded", "ada2": "not handed in", "bob": "graded"}


def test_a_grade_waits_when_another_number_has_handed_in_since(course, tmp_path):
    roster = graded(course, tmp_path, "student,canvas_id\nada,11\nbob,12\n", ada="11", bob="12")
    roster.write_text("student,canvas_id\nada,99\nbob,12\n")
    (course / "submitted" / "ada" / "calculator" / "calculator_server.py").write_text("print('new')")
    provenance.add(course / "submitted", "ada", "calculator", provenance.Source("Canvas", "ada", "99", "x.zip", 9))
    lines, said = written(course, "--for", "moodle", "--roster", roster)
    assert lines[1:] == [["bob", f"{MOST:g}"]]
    assert (
        "calculator: no grade for ada: hand-ins came from 11 and 99 in Canvas, and what counts now is not what was "
        "graded. Grade it with `autograder regrade`, and export again"
    ) in said
    with Output(course / "out", resume=True) as output:  # as `regrade` does
        handed_in = listing.read(course / "submitted", "ada", "calculator")
        digest = exercises.pack("calculator").digest
        output.write(report("ada"), Basis(str(course / "submitted"), digest, listing.digest(handed_in)))
    assert written(course, "--for", "moodle")[0][1:] == [["ada", f"{MOST:g}"], ["bob", f"{MOST:g}"]]


def test_a_line_of_canvas_with_another_number_than_the_roster_has_gets_no_grade(course, tmp_path):
    """Eve's login is bob's SIS id, and Bob's own line is missing."""
    graded(course, tmp_path, "student,canvas_id\nada,11\nbob,22\n")
    file = canvas(course, '"Love, Ada",11,s1,a1,S,3', '"Eve, Eve",33,eve77,bob,S,4')
    lines, said = written(course, "--for", "canvas", "--from-canvas", file)
    assert {line[1]: line[-1] for line in lines[2:]} == {"11": f"{MOST:g}", "33": "4"}
    assert (
        f"1 student without a line in the file, because their ID in {file} is not their number in the roster (correct "
        "the one in the roster if it is wrong; if it is right, the line there is somebody else's): bob (33 there, 22 "
        "in the roster's column 'canvas_id')"
    ) in said


def test_a_line_of_canvas_with_another_number_than_the_sender_gets_no_grade(course, tmp_path):
    """As it was collected, without a number in the roster."""
    graded(course, tmp_path, "student\nada\nbob\n", ada="11", bob="22")
    file = canvas(course, '"Love, Ada",11,ada,a1,S,3', '"Eve, Eve",33,eve77,bob,S,4')
    lines, said = written(course, "--for", "canvas", "--from-canvas", file)
    assert {line[1]: line[-1] for line in lines[2:]} == {"11": f"{MOST:g}", "33": "4"}
    assert (
        f"calculator: no grade for bob: the hand-in came from the number 22 in Canvas, and in {file} bob has the ID "
        "33. If they are one person, enter the grade in Canvas by hand"
    ) in said


def test_numbers_of_moodle_are_those_of_one_assignment(course, tmp_path):
    """A number of the roster that no hand-in came from is another one, and says nothing."""
    (tmp_path / "roster.csv").write_text("student,moodle_id\nada,501\nbob,502\n")
    for student, number in (("ada", "71"), ("bob", "72")):
        came = provenance.Source("Moodle", student, number, "calculator.zip")
        provenance.add(course / "submitted", student, "calculator", came)
    grade(course, "--roster", tmp_path / "roster.csv")
    assert len(written(course, "--for", "moodle")[0]) == 3
    (tmp_path / "roster.csv").write_text("student,moodle_id\nada,99\nbob,72\n")
    lines, said = written(course, "--for", "moodle", "--roster", tmp_path / "roster.csv")
    assert [line[0] for line in lines[1:]] == ["bob"] and any("no grade for ada" in line for line in said)


def test_what_the_tests_gave_is_exported_before_anything_is_marked(course):
    grade(course)
    table, said = exported(course)
    assert {line["state"] for line in table.values()} == {"waiting for marks"}
    assert f"calculator: waiting for a mark of {QUESTION}: ada, bob" in said
    assert "--automatic exports the points of the tests" in said.splitlines()
    table, _ = exported(course, "--automatic")
    assert {line["score"] for line in table.values()} == {f"{MOST:g}"}


def test_questions_without_a_notebook_are_asked_for_or_count_0(course):
    said = grade(course)
    assert "Handed in without a notebook, so calculator's questions wait for a mark: bob." in said
    assert exported(course)[0]["bob"]["state"] == "waiting for marks"
    said = grade(course, "--without-notebook", "zero")
    assert "without a notebook" not in said
    table, _ = exported(course)
    assert (table["bob"]["state"], table["bob"]["score"]) == ("graded", f"{MOST:g}")
    assert table["ada"]["state"] == "waiting for marks"
    shutil.copy(course / "submitted" / "ada" / "calculator" / "calculator.ipynb", course / "submitted/bob/calculator")
    grade(course, "--without-notebook", "zero")  # now there is something to mark
    assert exported(course)[0]["bob"]["state"] == "waiting for marks"
    assert "No notebook was handed in" not in formgrader_page(course, "bob")  # and it is shown


def test_a_mark_without_a_notebook_counts_like_any_other(course):
    grade(course)
    page = formgrader_page(course, "bob")
    assert page.count("No notebook was handed in") > 1 and "cannot be shown" not in page
    assert not re.search(r"<h\d[^>]*>[^<]*handed in", page)  # it is said in plain text
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        for student in ("ada", "bob"):
            marked = book.find_grade(QUESTION, "calculator", "calculator", student)
            assert marked.needs_manual_grade  # Manual Grading lists it
            marked.manual_score, marked.needs_manual_grade = 4, False
        book.db.commit()
    assert "without a notebook" not in grade(course)
    for options, points in (((), MOST + 4), (["--automatic"], MOST)):
        for line in exported(course, *options)[0].values():
            assert (line["state"], line["raw_score"], line["score"]) == ("graded", f"{points:g}", f"{points:g}"), line


def test_a_class_graded_by_autograder_is_marked_by_hand_at_once(course):
    (course / "submitted" / "ada" / "calculator" / "page.html").write_text("<script>")
    (course / "submitted" / "ada" / "calculator" / "link.txt").symlink_to("/etc/passwd")
    grade(course)
    assert sorted(path.name for path in (course / "autograded" / "ada" / "calculator").iterdir()) == [
        "calculator.ipynb",
        "calculator_server.py",
    ]
    for student in ("ada", "bob"):
        page = formgrader_page(course, student)
        assert TESTS[0].title in page
    nbgrader = release.api(course)
    assert {one["student"] for one in nbgrader.get_submissions("calculator") if one["autograded"]} == {"ada", "bob"}
    assert nbgrader.generate_feedback("calculator")["success"]
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        marked = book.find_grade(QUESTION, "calculator", "calculator", "ada")
        assert marked.needs_manual_grade  # Manual Grading lists it
        marked.manual_score, marked.needs_manual_grade = 4, False
        book.db.commit()
    # The pages made before the mark are made again by the command, too, though no file has changed since.
    command = [sys.executable, "-m", "nbgrader", "generate_feedback", "calculator"]
    subprocess.run(command, cwd=course, capture_output=True, timeout=60, check=True)
    page = record.read((course / "feedback" / "ada" / "calculator" / "calculator.html").read_bytes())
    assert page.cells[QUESTION][0] == 4 and page.points == MOST + 4
    shown = course / "autograded" / "ada" / "calculator" / "calculator.ipynb"
    before = shown.stat().st_mtime_ns
    grade(course)  # again: the mark stays
    folders = list(shown.parents)[:3]
    assert {path.stat().st_mode & 0o777 for path in folders} == {0o777 & ~UMASK}  # instructors may share them
    assert shown.stat().st_mtime_ns == before  # and what shows this result already is not written again
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        marked = book.find_grade(QUESTION, "calculator", "calculator", "ada")
        assert (marked.manual_score, bool(marked.needs_manual_grade)) == (4, False)


def answered(course: Path, student: str, text: str) -> None:
    """Write the answer to the question into the student's notebook."""
    path = course / "submitted" / student / "calculator" / "calculator.ipynb"
    notebook = json.loads(path.read_text())
    for cell in notebook["cells"]:
        if cell["metadata"].get("nbgrader", {}).get("grade_id") == QUESTION:
            cell["source"] = text
    path.write_text(json.dumps(notebook))


def test_an_answer_that_is_another_than_the_marked_one_waits_for_a_mark_again(course):
    answered(course, "ada", "")
    grade(course)
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        marked = book.find_grade(QUESTION, "calculator", "calculator", "ada")
        marked.manual_score, marked.needs_manual_grade = 1, False
        book.find_comment(QUESTION, "calculator", "calculator", "ada").manual_comment = "Nothing there."
        book.db.commit()
    said = "Answers of calculator changed after they were marked by hand, and wait for a new mark: ada."
    assert said not in grade(course).splitlines()
    answered(course, "ada", " \n")  # no other text
    assert said not in grade(course).splitlines()
    assert exported(course)[0]["ada"]["raw_score"] == f"{MOST + 1:g}"

    answered(course, "ada", "Because the client compiled the old definition.")
    assert said in grade(course).splitlines()
    line, printed = exported(course)[0]["ada"], exported(course)[1]
    assert (line["state"], line["score"]) == ("waiting for marks", "")
    assert f"calculator: waiting for a mark of {QUESTION}: ada" in printed
    (mark,) = by_hand(f"sqlite:///{course / 'gradebook.db'}", "calculator", "ada")
    assert (mark.cell, mark.waiting, mark.points, mark.comment) == (QUESTION, True, None, "")
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        marked = book.find_grade(QUESTION, "calculator", "calculator", "ada")
        assert (marked.manual_score, bool(marked.needs_manual_grade)) == (1, True)
        marked.manual_score, marked.needs_manual_grade = 4, False
        book.db.commit()
    assert said not in grade(course).splitlines()
    assert exported(course)[0]["ada"]["raw_score"] == f"{MOST + 4:g}"


def marked(course: Path, cell: str, points: float) -> None:
    """Mark a cell of ada's by hand, as in Formgrader."""
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        grade = book.find_grade(cell, "calculator", "calculator", "ada")
        grade.manual_score, grade.needs_manual_grade = points, False
        book.db.commit()


COMMANDS = {"grade": grade, "regrade": lambda course: run("regrade", course / "out", "--apply")}


@pytest.mark.parametrize("enter", COMMANDS.values(), ids=COMMANDS)
def test_an_answer_and_a_time_that_changed_are_entered_though_no_program_did(course, enter):
    answered(course, "ada", "A")
    time = course / "submitted" / "ada" / "calculator" / "timestamp.txt"
    time.write_text("2026-05-01 12:00:00 UTC")
    grade(course)
    marked(course, QUESTION, 4)
    marked(course, TESTS[0].cell, 1)
    answered(course, "ada", "C")
    time.write_text("2026-05-02 12:00:00 UTC")
    shown = course / "autograded" / "ada" / "calculator" / "calculator.ipynb"
    before = shown.read_bytes()
    if enter is not grade:
        assert "0 graded again" in (said := run("regrade", course / "out"))
        assert "Nothing is written yet; the same command with --apply" in said and shown.read_bytes() == before
    said = "Answers of calculator changed after they were marked by hand, and wait for a new mark: ada."
    assert said in enter(course).splitlines()
    assert shown.read_bytes() != before
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        assert book.find_submission("calculator", "ada").timestamp == datetime(2026, 5, 2, 12)
        grades = book.find_submission("calculator", "ada").notebooks[0].grades
        assert [grade.name for grade in grades if grade.needs_manual_grade] == [QUESTION]
    assert said not in enter(course).splitlines()


@pytest.mark.parametrize("enter", COMMANDS.values(), ids=COMMANDS)
def test_who_has_points_by_hand_and_no_notebook_any_more_is_named(course, enter):
    notebook = course / "submitted" / "ada" / "calculator" / "calculator.ipynb"
    said = "Handed in again without a notebook that can be read, but with marks by hand for answers of calculator: ada."
    answered(course, "ada", "A")
    for name in exercises.load("calculator").files:  # that none is taken from the notebook
        path = notebook.parent / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("print()")
    passed(course / "submitted", "ada")
    grade(course)
    before = notebook.read_bytes()
    notebook.unlink()
    assert said not in enter(course).splitlines()  # there is no mark yet
    marked(course, QUESTION, 4)
    assert said in enter(course).splitlines()
    notebook.write_text("{")
    assert said in enter(course).splitlines()
    assert exported(course)[0]["ada"]["raw_score"] == f"{MOST + 4:g}"  # and the mark stays
    notebook.write_bytes(before)
    assert said not in enter(course).splitlines()
    notebook.unlink()
    marked(course, QUESTION, 0)
    assert said not in enter(course).splitlines()  # no points for it


@pytest.mark.parametrize("mark", [None, 4], ids=["unmarked", "marked"])
def test_of_a_student_whose_folder_is_gone_no_hand_in_without_a_notebook_is_told(course, mark):
    """A student who has left has handed in nothing again, and the points stay."""
    answered(course, "ada", "A")
    for name in exercises.load("calculator").files:
        path = course / "submitted" / "ada" / "calculator" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("print()")
    passed(course / "submitted", "ada")
    grade(course)
    if mark:
        marked(course, QUESTION, mark)
    shutil.rmtree(course / "submitted" / "ada")
    said = [line for line in grade(course).splitlines() if "without a notebook" in line]
    assert len(said) == 1 and said[0].endswith(": bob.")
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        assert book.find_grade(QUESTION, "calculator", "calculator", "ada").score == (mark or 0)


def test_an_export_names_whose_points_in_the_gradebook_are_of_another_output(course):
    """Two outputs in one gradebook: the later one counts, and the export of the earlier one said nothing."""
    told = "LOOK: the gradebook has other points of the hidden tests than"
    grade(course)
    assert told not in exported(course)[1]
    other = course / "other"
    shutil.copytree(course / "out", other)
    handed_in = listing.read(course / "submitted", "ada", "calculator")
    basis = Basis(str(course / "submitted"), exercises.pack("calculator").digest, listing.digest(handed_in))
    lost = [Result(test.id, test.title, FAILED, 0, test.points) for test in TESTS]
    with Output(other, resume=True) as results:
        results.write(Report("ada", "calculator", GRADED, 0.0, MOST, 1, 0.0, tests=lost), basis)
    run("grade", course / "submitted", "--output", other, "--resume")
    (line,) = [line for line in exported(course)[1].splitlines() if line.startswith(told)]
    assert line.startswith(f"{told} {course / 'out'}, ") and line.endswith(": ada/calculator")
    assert told not in run("export", other, "--for", "csv", "--to", course / "others.csv")
    grade(course)
    assert told not in exported(course)[1]


def test_a_mark_for_an_answer_that_came_by_mail_is_no_news(course):
    (course / "submitted" / "ada" / "calculator" / "calculator.ipynb").unlink()
    grade(course)
    marked(course, QUESTION, 4)
    assert "Handed in again without" not in grade(course)


def test_each_result_is_entered_from_the_folder_that_it_was_graded_in(course):
    """Bob's is beside the others, with a notebook; a folder that was renamed says nothing about an answer."""
    grade(course)
    marked(course, QUESTION, 4)
    (course / "second").mkdir()
    (course / "submitted" / "bob").rename(course / "second" / "bob")
    shutil.copy(course / "release" / "calculator" / "calculator.ipynb", course / "second" / "bob" / "calculator")
    passed(course / "second", "bob")
    (course / "submitted" / "ada").rename(course / "submitted" / "eve")
    said = run("regrade", course / "out", "--apply")
    assert "0 graded again" in said and "without a notebook" not in said
    bob = (course / "autograded" / "bob" / "calculator" / "calculator.ipynb").read_text()
    assert "No notebook was handed in" not in bob


def test_feedback_is_released_to_all_who_handed_in_through_the_exchange(course, tmp_path):
    """Folders of `autograder collect` have no secret of the exchange, and perhaps no time: all pages are released."""
    (tmp_path / "exchange").mkdir(mode=0o777)
    (tmp_path / "exchange").chmod(0o777)
    with open(course / "nbgrader_config.py", "a") as config:
        config.write(f"c.Exchange.root = {str(tmp_path / 'exchange')!r}\n")
    through = course / "submitted" / "bob" / "calculator"
    (through / "submission_secret.txt").write_text("s" * 32)
    (through / "timestamp.txt").write_text("2026-05-01 12:00:00 UTC")
    grade(course)
    nbgrader = release.api(course)
    assert nbgrader.generate_feedback("calculator")["success"]
    released = nbgrader.release_feedback("calculator")
    assert released["success"], released
    assert "feedback/ada/calculator was not released, because" in released["log"]
    (page,) = (tmp_path / "exchange" / "ros2" / "feedback").iterdir()
    assert page.read_bytes() == (course / "feedback" / "bob" / "calculator" / "calculator.html").read_bytes()


def test_another_gradebook_leaves_the_course_alone(course, tmp_path):
    url = f"sqlite:///{tmp_path / 'other.db'}"
    with Entering(url, course / "submitted", course / "out") as entering:
        entering.write(report("ada"))
    assert not (course / "autograded").exists()


def test_a_wrong_export_is_one_line(course, tmp_path):
    grade(course)
    for options, says in {
        ("--for", "canvas"): "export the gradebook from Canvas, and give the file: --from-canvas FILE",
        ("--for", "moodle", "--user", "shoe"): "--user must be one of username",
    }.items():
        ran = CliRunner().invoke(app, ["export", str(course / "out"), *options, "--to", str(tmp_path / "x.csv")])
        assert says in str(ran.exception) and type(ran.exception).__name__ in ("CannotExport", "UsageError")
    assert json.loads((course / "out" / "results.jsonl").read_text().splitlines()[0])["student"] == "ada"


@pytest.mark.skipif(os.geteuid() != 0, reason="a file system of its own size needs root")
@pytest.mark.parametrize("size", [each_night(120), 200])
def test_a_gradebook_on_a_full_disk_is_one_line_and_goes_on(course, tmp_path, size):
    """The results are kept, and entered when there is room: sqlite tells of it in several ways."""
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", small], capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        shutil.copytree(course / "out", small / "out")
        for name in ("nbgrader_config.py", "gradebook.db"):  # not a course: the gradebook is in OUTPUT
            (course / name).unlink()
        for number in range(8):
            (course / "submitted" / f"student{number}" / "calculator").mkdir(parents=True)
        command = [AUTOGRADER, "grade", str(course / "submitted"), "--output", str(small / "out"), "--resume"]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert ran.returncode == 3
        (line,) = ran.stderr.splitlines()
        assert line.startswith("autograder: stopped, finished work is kept: ")
        assert line.endswith(". Free some space, and run the command again; `grade` continues with --resume")
        subprocess.run(["mount", "-o", "remount,size=9m", small], check=True)
        ran = subprocess.run(command, capture_output=True, text=True, timeout=120)
        assert (ran.returncode, ran.stderr) == (0, "")
        with Gradebook(f"sqlite:///{small / 'out' / 'gradebook.db'}") as book:
            assert len(book.students) == 10
    finally:
        subprocess.run(["umount", "-l", small], check=True)


def test_a_release_notes_the_due_date_for_the_gradebook_and_for_handing_in(tmp_path):
    due, until = "2026-11-20 23:59 UTC", "2026-11-27 23:59 UTC"
    arguments = ["release", "parameters", "--course", tmp_path / "course", "--due", due, "--until"]
    run(*arguments, until)
    notebook = tmp_path / "course" / "release" / "parameters" / "parameters.ipynb"
    noted = json.loads(notebook.read_text())["metadata"]["course"]
    assert noted == {"due": "2026-11-20T23:59:00+00:00", "until": "2026-11-27T23:59:00+00:00"}
    with Gradebook(f"sqlite:///{tmp_path / 'course' / 'gradebook.db'}") as book:
        assert f"{book.find_assignment('parameters').duedate}" == "2026-11-20 23:59:00"
    (tmp_path / "pid_node.py").write_text("print()\n")
    shutil.copy(notebook, tmp_path)
    assert hand_in.read(tmp_path).dates.keys() == {"due", "until"}
    ran = CliRunner().invoke(app, [str(argument) for argument in [*arguments, "2026-11-01 23:59 UTC"]])
    assert "the end is before the due date" in str(ran.exception)
    run(*arguments, "none")
    assert json.loads(notebook.read_text())["metadata"]["course"].keys() == {"due"}
    assert ends.read(tmp_path / "course") == {}


def test_a_missing_choice_is_one_line_without_escaped_characters(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["autograder", "export", "out"])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert capsys.readouterr().err == "autograder: Missing option '--for'. Choose from: canvas, moodle, csv\n"
