"""`autograder return`: each page goes to the student whose work it is about, with marks by hand and lateness in it."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from nbgrader.api import Gradebook

from autograder import cli
from autograder.collecting.collect import collect
from autograder.errors import UsageError
from autograder.gradebook.book import Scores
from autograder.gradebook.release import COURSE_FILE
from autograder.records import FAILED, GRADED, INFRASTRUCTURE_ERROR, INVALID_SUBMISSION, NOT_RUN, PASSED, Report, Result
from autograder.results.output import Basis, Output, lock
from autograder.returning.giving_back import LOCK, describe, give_back
from autograder.submissions import exercises, listing, provenance
from autograder.submissions.roster import read_rosters
from autograder.submissions.times import parse_time
from course.returned import record
from tests.collecting.test_collect import FILES, LATER, archive, handed_in

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
TESTS = exercises.load("services").tests
NEXT_WEEK = LATER.replace(day=9)
MOST = sum(test.points for test in TESTS)


def report(student: str, status: str = GRADED) -> Report:
    """All tests passed but the first, unless the status says otherwise."""
    if status == INFRASTRUCTURE_ERROR:
        return Report(student, "services", status, None, MOST, 7, 1.0)
    outcome = NOT_RUN if status == INVALID_SUBMISSION else PASSED
    tests = [Result(test.id, test.title, outcome, test.points * (outcome == PASSED), test.points) for test in TESTS]
    lost = Result(TESTS[0].id, TESTS[0].title, FAILED, 0.0, TESTS[0].points, f"{student} must mend this.")
    tests = [lost, *tests[1:]] if status == GRADED else tests
    return Report(student, "services", status, sum(test.points for test in tests), MOST, 7, 1.0, [], tests)


def graded(submitted: Path, out: Path, *reports: Report) -> Path:
    """An output folder as `autograder grade` writes it."""
    with Output(out, resume=True) as output:
        for one in reports:
            handed = listing.read(submitted, one.student, "services")
            output.write(one, Basis(str(submitted), "suite", listing.digest(handed)))
    return out


def receipt_of(student: str) -> bytes:
    """Return a receipt that somebody may have written, with any name."""
    return json.dumps({"student": student, "assignment": "services"}).encode()


def moodle(path: Path, *names: str) -> Path:
    """A bulk download with a file of each student."""
    return archive(path, {f"{name}_assignsubmission_file_/relay.py": name.encode() for name in names})


def pages(path: Path) -> dict[str, record.Feedback]:
    """The pages of an archive, by name."""
    with zipfile.ZipFile(path) as packed:
        return {name: record.read(packed.read(name)) for name in packed.namelist()}


@pytest.fixture
def submitted(tmp_path) -> Path:
    """Hand-ins that came by Moodle, by Canvas, and as an archive."""
    canvas = {"doejane_LATE_1234_900_relay.py": b"jane", "doejane_1234_901_motor_service.py": b"jane"}
    sources = [moodle(tmp_path / "moodle.zip", "Zoë Müller_55", "Jim Roe_56"), archive(tmp_path / "canvas.zip", canvas)]
    collect([*sources, handed_in(tmp_path / "in", "ada")], tmp_path / "submitted")
    return tmp_path / "submitted"


@pytest.mark.parametrize("letters", [80, 100])
def test_a_name_that_takes_many_bytes_is_collected_and_returned_beside_the_others(tmp_path, letters):
    """Three bytes a letter: as a file's name it would be longer than a file system takes."""
    long = "+" + "\u4e2d" * letters  # the first of all
    (tmp_path / "in").mkdir()
    archive(tmp_path / "in" / "long.zip", {**FILES, "receipt.json": receipt_of(long)})
    handed_in(tmp_path / "in", "zed")
    collected = collect([tmp_path / "in"], tmp_path / "out")
    students = sorted(each.student for each in collected.laid_out)
    assert students[1] == "zed" and len(students[0].encode()) <= 120 and long.startswith(students[0])
    out = graded(tmp_path / "out", tmp_path / "results", *map(report, students))
    assert sum(give_back(out, tmp_path / "returned").made.values()) == 2


def test_a_page_whose_name_is_too_long_for_a_file_is_named_and_the_others_are_returned(tmp_path):
    """In a folder that somebody has laid out by hand."""
    long = 250 * "a"
    for student in (long, "zed"):
        (tmp_path / "in" / student / "services").mkdir(parents=True)
    result = give_back(graded(tmp_path / "in", tmp_path / "out", report(long), report("zed")), tmp_path / "returned")
    assert [path.name for path in (tmp_path / "returned").iterdir()] == ["zed-services-feedback.html"]
    assert [line.replace(long, "LONG") for line in result.left_out] == [
        "LONG/services: its page's name would be too long for a file: give the student's folder a shorter name"
    ]


def test_each_page_goes_back_the_way_its_submission_came(submitted, tmp_path):
    students = ["Zoë_Müller", "Jim_Roe", "doejane", "ada"]
    out = graded(submitted, tmp_path / "out", *map(report, students))
    result = give_back(out, out / "returned")
    assert result.left_out == []
    assert {name: page.student for name, page in pages(out / "returned" / "services-moodle.zip").items()} == {
        "Zoë Müller_55_assignsubmission_file_/services-feedback.html": "Zoë_Müller",
        "Jim Roe_56_assignsubmission_file_/services-feedback.html": "Jim_Roe",
    }
    assert {name: page.student for name, page in pages(out / "returned" / "services-canvas.zip").items()} == {
        "doejane_LATE_1234_901_services-feedback.html": "doejane"
    }
    assert record.read((out / "returned" / "ada-services-feedback.html").read_bytes()).student == "ada"
    assert sorted(path.name for path in (out / "returned").iterdir()) == [
        "ada-services-feedback.html",
        "services-canvas.zip",
        "services-moodle.zip",
    ]


def test_one_form_for_all_names_those_who_did_not_come_that_way(submitted, tmp_path):
    out = graded(submitted, tmp_path / "out", *map(report, ["Jim_Roe", "doejane", "ada"]))
    result = give_back(out, tmp_path / "a", "moodle")
    assert list(pages(tmp_path / "a" / "services-moodle.zip")) == [
        "Jim Roe_56_assignsubmission_file_/services-feedback.html"
    ]
    assert [line.partition(":")[0] for line in result.left_out] == ["ada/services", "doejane/services"]
    give_back(out, tmp_path / "b", "files")
    assert len(list((tmp_path / "b").glob("*-services-feedback.html"))) == 3


def test_marks_by_hand_and_lateness_are_in_what_is_returned(tmp_path):
    course = tmp_path / "course"
    (course / "source").mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(COURSE_FILE + "c.LatePolicy.percent_per_day = 10\n")
    submitted = course / "submitted"
    collect([handed_in(tmp_path / "in", "ada", at=LATER)], submitted)
    out = graded(submitted, tmp_path / "out", report("ada"))
    url = f"sqlite:///{course / 'gradebook.db'}"
    with Scores(url, submitted) as scores:
        scores.write(report("ada"))
    with Gradebook(url) as book:
        book.update_or_create_assignment("services", duedate=parse_time("2026-11-02 23:59 UTC").replace(tzinfo=None))
        book.find_grade("relay", "services", "services", "ada").manual_score = 4.0
        book.db.commit()
    result = give_back(out, out / "returned")
    page = record.read((out / "returned" / "ada-services-feedback.html").read_bytes())
    by_tests = report("ada").score - 10.0  # the relay's points are the instructor's now
    assert page.cells["relay"] == (4.0, 10.0)
    assert page.points == pytest.approx((by_tests + 4.0) * 0.9)
    assert [mark.cell for mark in page.marks] == ["relay", "Handed in late"]
    assert result.waiting == []
    give_back(out, tmp_path / "without", gradebook="")
    assert record.read((tmp_path / "without" / "ada-services-feedback.html").read_bytes()).points == report("ada").score
    assert "LOOK" not in describe(result)
    (course / "gradebook.db").rename(tmp_path / "kept.db")
    assert describe(give_back(out, out / "returned")).startswith("LOOK: no gradebook was found, so the pages have no ")
    course.rename(tmp_path / "moved")
    with pytest.raises(UsageError, match=r"are no longer in .*course.submitted, so the gradebook is unknown"):
        give_back(out, out / "returned", "files")
    give_back(out, tmp_path / "named", "files", gradebook=f"sqlite:///{tmp_path / 'kept.db'}")
    page = record.read((tmp_path / "named" / "ada-services-feedback.html").read_bytes())
    assert page.cells["relay"] == (4.0, 10.0)
    assert describe(give_back(out, tmp_path / "plain", "files", gradebook="")).startswith(str(tmp_path / "plain"))


def test_what_still_waits_for_a_mark_is_returned_and_said(submitted, tmp_path):
    out = graded(submitted, tmp_path / "out", report("ada"))
    url = f"sqlite:///{out / 'gradebook.db'}"
    with Gradebook(url) as book:
        book.update_or_create_assignment("services")
        book.update_or_create_notebook("services", "services")
        book.update_or_create_grade_cell("service-or-action", "services", "services", max_score=5, cell_type="markdown")
    with Scores(url) as scores:
        scores.write(report("ada"))
    with Gradebook(url) as book:
        book.find_grade("service-or-action", "services", "services", "ada").needs_manual_grade = True
        book.db.commit()
    result = give_back(out, out / "returned")
    assert result.waiting == ["ada/services"]
    assert record.read((out / "returned" / "ada-services-feedback.html").read_bytes()).waiting
    again = give_back(out, out / "returned" / "changed-1", changed=True)
    assert (again.waiting, again.unchanged) == ([], 1)  # nothing is said of a page that is not returned this time


def test_no_page_goes_to_somebody_who_handed_in_something_else_since(tmp_path):
    """The folder's owner on the platform may have changed with what lies in it."""
    submitted, folder = tmp_path / "submitted", "Jim Roe_56_assignsubmission_file_"
    collect([archive(tmp_path / "a.zip", {f"{folder}/{name}": content for name, content in FILES.items()})], submitted)
    out = graded(submitted, tmp_path / "out", report("Jim_Roe"))
    changed = {f"{folder}/{name}": content + b"#" for name, content in FILES.items()}
    collect([archive(tmp_path / "b.zip", changed, at=NEXT_WEEK)], submitted)
    result = give_back(out, out / "returned")
    assert result.made == {}
    assert "other files were handed in since" in result.left_out[0]


def test_no_page_goes_to_one_of_two_people_under_one_name(tmp_path):
    """Two Moodle assignments number their participants anew: the same name may be another person."""
    submitted = tmp_path / "submitted"
    collect([moodle(tmp_path / "a.zip", "Jane Doe_55")], submitted)
    other = archive(tmp_path / "b.zip", {"Jane Doe_77_assignsubmission_file_/relay.py": b"b"}, at=NEXT_WEEK)
    collect([other], submitted)  # leaves it out
    provenance.add(submitted, "Jane_Doe", "services", provenance.Source("Moodle", "Jane Doe", "77", "relay.py"))
    out = graded(submitted, tmp_path / "out", report("Jane_Doe"))
    result = give_back(out, out / "returned")
    assert result.made == {}
    assert "handed in by 55 and 77 of Moodle" in result.left_out[0]


def test_a_page_of_what_was_mailed_before_something_else_is_not_returned(tmp_path):
    submitted = tmp_path / "submitted"
    collect([handed_in(tmp_path / "in", "ada")], submitted)
    out = graded(submitted, tmp_path / "out", report("ada"))
    newer = handed_in(tmp_path / "newer", "ada", at=LATER, files=FILES | {"relay.py": b"newer"})
    collect([newer], submitted)
    result = give_back(out, out / "returned")
    assert result.made == {} and "other files were handed in since" in result.left_out[0]


def test_pages_that_would_be_called_alike_are_given_to_neither(tmp_path):
    submitted = tmp_path / "submitted"
    for student in ("ada", "Ada"):
        handed_in(tmp_path / "in", student)
    collect([tmp_path / "in"], submitted)
    out = graded(submitted, tmp_path / "out", report("ada"), report("Ada"))
    result = give_back(out, out / "returned")
    assert result.made == {}
    assert [line.partition(":")[0] for line in result.left_out] == ["Ada/services", "ada/services"]


def test_who_has_no_page_is_said(submitted, tmp_path):
    (tmp_path / "roster.csv").write_text("student\nada\nJim_Roe\ndan\nnobody\n")
    (submitted / "dan" / "services").mkdir(parents=True)  # as after a grading that was killed
    roster = read_rosters([tmp_path / "roster.csv"]).students
    reports = report("ada", INFRASTRUCTURE_ERROR), report("Jim_Roe", INVALID_SUBMISSION)
    out = graded(submitted, tmp_path / "out", *reports)
    result = give_back(out, out / "returned", roster=roster)
    assert "ada/services: the grader failed, and there is no score yet" in describe(result)
    assert (result.nothing, result.ungraded) == (["nobody"], ["dan"])
    assert "the submission is not graded yet:\n  dan" in describe(result)
    (page,) = pages(out / "returned" / "services-moodle.zip").values()
    assert page.status == INVALID_SUBMISSION


def test_what_an_unfinished_grading_has_left_is_said_without_a_roster(submitted, tmp_path, capsys):
    out = graded(submitted, tmp_path / "out", report("ada"))
    with Output(out, resume=True) as results:
        results.asks([(student, "services") for student in ("ada", "doejane", "gone")])
    assert cli.app(["return", str(out)], standalone_mode=False) == 1
    told = capsys.readouterr().out
    assert "Without a page, because the submission is not graded yet:\n  doejane\n" in told
    assert told.endswith("1 page returned; 1 not.\n")
    cli.app(["report", str(out)], standalone_mode=False)
    told = " ".join(capsys.readouterr().out.split())
    assert "handed in, but not graded yet (`autograder grade` with --resume grades the rest): doejane/services" in told
    graded(submitted, out, report("doejane"))
    assert cli.app(["return", str(out)], standalone_mode=False) == 0
    (submitted / "ada" / "calculator").mkdir()
    with Output(out, resume=True) as results:
        results.asks([("ada", "calculator")])
    assert give_back(out, out / "returned").ungraded == ["ada/calculator"]  # her other exercise has a page


def test_what_a_student_could_write_decides_nothing(submitted, tmp_path):
    """A student's own files and file names say who somebody is to nobody."""
    folder = submitted / "ada" / "services"
    (folder / "services.jsonl").write_text('{"platform": "Moodle", "name": "Jim Roe", "user": "56", "file": ""}\n')
    out = graded(submitted, tmp_path / "out", report("ada"))
    give_back(out, out / "returned")
    assert [path.name for path in (out / "returned").iterdir()] == ["ada-services-feedback.html"]


def test_returning_again_replaces_what_was_made(submitted, tmp_path):
    out = graded(submitted, tmp_path / "out", report("Jim_Roe"))
    give_back(out, out / "returned")
    graded(submitted, out, report("Zoë_Müller"))
    give_back(out, out / "returned")
    assert len(pages(out / "returned" / "services-moodle.zip")) == 2


def test_the_command(submitted, tmp_path, capsys):
    out = graded(submitted, tmp_path / "out", report("ada"), report("doejane"))
    ran = subprocess.run([AUTOGRADER, "return", out], capture_output=True, text=True, timeout=100)
    assert ran.returncode == 0, ran.stderr
    assert (
        f"{out}/returned/services-canvas.zip: 1 page; upload it in Canvas: the assignment, Upload Submissions"
        in ran.stdout
    )
    assert "2 pages returned; 0 not." in ran.stdout
    assert cli.app(["return", str(out), "--for", "canvas"], standalone_mode=False) == 1
    assert "ada/services: it did not come from Canvas" in capsys.readouterr().out


def test_of_some_students_no_other_is_said_to_be_without_a_page(submitted, tmp_path):
    out = graded(submitted, tmp_path / "out", report("ada"), report("Jim_Roe"))
    result = give_back(out, out / "returned", students=["ada"], roster=["ada", "Jim_Roe", "nobody"])
    assert (result.ungraded, result.nothing) == ([], [])


def test_the_copy_of_a_course_is_told_whose_submissions_are_meant(submitted, tmp_path, capsys):
    out = graded(submitted, submitted.parent / "out", report("ada"))
    copy = shutil.copytree(submitted.parent, tmp_path.parent / f"{tmp_path.name}-copy")
    told = []
    for each in (out.parent, copy):
        assert not cli.app(["return", "--no-gradebook", str(each / out.name)], standalone_mode=False)
        told.append(capsys.readouterr().err)
    assert told[0] == ""
    assert "was graded from" in told[1] and "was the course's folder copied or moved?" in told[1]


def test_a_wrong_call_is_a_line(tmp_path):
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(UsageError, match="no results in"):
            give_back(folder, tmp_path / "returned")
    assert [*tmp_path.iterdir()] == []


def test_a_gradebook_that_is_not_there_is_a_line_and_is_not_made(submitted, tmp_path):
    out = graded(submitted, tmp_path / "out", report("ada"))
    with pytest.raises(UsageError, match="there is no gradebook"):
        give_back(out, out / "returned", gradebook=f"sqlite:///{tmp_path / 'none.db'}")
    assert not (tmp_path / "none.db").exists()


def test_only_what_has_changed_is_returned_again(submitted, tmp_path):
    students = ["Zoë_Müller", "Jim_Roe", "doejane", "ada"]
    out = graded(submitted, tmp_path / "out", *map(report, students))
    give_back(out, out / "returned", assignment="services", students=students[:3])  # ada was never returned
    graded(submitted, out, report("Jim_Roe", INVALID_SUBMISSION))
    result = give_back(out, out / "returned" / "changed-1", changed=True)
    assert result.changed == ["Jim_Roe/services", "ada/services"] and result.unchanged == 2
    assert "Changed since the last return: Jim_Roe/services, ada/services" in describe(result)
    assert list(pages(out / "returned" / "changed-1" / "services-moodle.zip")) == [
        "Jim Roe_56_assignsubmission_file_/services-feedback.html"
    ]
    again = give_back(out, out / "returned" / "changed-2", changed=True)
    assert (again.changed, again.unchanged, again.made) == ([], 4, {})
    assert "Changed since the last return: nothing" in describe(again)
    assert not (out / "returned" / "changed-2").exists()


def test_one_return_at_a_time(submitted, tmp_path):
    """Two would both find the same pages changed, and a student would get a comment twice."""
    out = graded(submitted, tmp_path / "out", report("ada"))
    descriptor = lock(out / LOCK, "busy")
    with pytest.raises(UsageError, match="another `autograder return` is running in .*out: wait until it has finished"):
        give_back(out, out / "returned", changed=True)
    os.close(descriptor)
    assert give_back(out, out / "returned", changed=True).changed == ["ada/services"]


def test_a_mark_by_hand_is_a_change_and_the_command_uses_a_folder_of_its_own(submitted, tmp_path, capsys):
    out = graded(submitted, tmp_path / "out", report("ada"), report("Jim_Roe"))
    url = f"sqlite:///{out / 'gradebook.db'}"
    with Scores(url, submitted) as scores:
        scores.write(report("ada"))
        scores.write(report("Jim_Roe"))
    command = ["return", str(out), "--changed"]
    assert not cli.app(command, standalone_mode=False) and "2 pages returned" in capsys.readouterr().out
    with Gradebook(url) as book:
        book.find_grade("relay", "services", "services", "ada").manual_score = 4.0
        book.db.commit()
    assert not cli.app(command, standalone_mode=False)
    second = capsys.readouterr().out
    assert "Changed since the last return: ada/services" in second and "1 page returned" in second
    assert [path.name for path in (out / "returned" / "changed-2").iterdir()] == ["ada-services-feedback.html"]
