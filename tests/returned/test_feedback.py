"""`course feedback`: what came back is read as data, kept beside the work, and shown; a page may come from anywhere."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import replace
from html import escape
from pathlib import Path

import pytest
from nbgrader.exchange.default.exchange import Exchange
from nbgrader.utils import notebook_hash

import course
from autograder.records import Report, Result
from autograder.results import feedback
from course.errors import FeedbackError
from course.returned import made, nbgrader_exchange, pages, reading, record, shown
from course.returned.record import Feedback, Mark, Test

COURSE = str(Path(sys.executable).with_name("course"))
LATE = "relay.py answered too late."
TESTS = [
    Test("The motors switch", "passed", 9.0, 9.0, "", "motor-service"),
    Test("The relay answers", "failed", 0.0, 2.0, LATE, "relay"),
    Test("Each caller gets its answer", "timed_out", 1.0, 4.0, LATE, "relay"),
]
FOUND = Feedback("ada", "services", "Services", "graded", 10.0, 15.0, TESTS)
HOSTILE = "<script>alert(1)</script><img src=x onerror=alert(2)>\x1b[2J"


HEAD = (
    '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
    '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    """<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">\n"""
)


def page(found: Feedback) -> bytes:
    return f'{HEAD}<meta name="course-feedback" content="{escape(found.to_text())}">\n</head>\n</html>'.encode()


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An exercise's folder, of somebody who has handed nothing in to an exchange."""
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path / "none"))
    place = tmp_path / "services"
    place.mkdir()
    (place / "services.ipynb").write_text('{"cells": []}')
    return place


def run(folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [COURSE, "feedback", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)


def test_a_page_is_put_beside_the_work_and_summed_up(folder, tmp_path):
    (tmp_path / "came.html").write_bytes(page(FOUND))
    ran = run(folder, tmp_path / "came.html")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "Services: 10 of 15 points" in ran.stdout
    assert "relay          1 of 6 points" in ran.stdout
    assert ran.stdout.count(LATE) == 1
    assert "cost 5 points: The relay answers; Each caller gets its answer" in ran.stdout
    assert (folder / "feedback" / "services.html").read_bytes() == page(FOUND)
    assert run(folder).stdout == ran.stdout  # it is found again without its name


def test_an_archive_is_looked_into_and_the_exercise_s_folder_is_found(folder, tmp_path):
    with zipfile.ZipFile(tmp_path / "came.zip", "w") as archive:
        archive.writestr("Ada_55_assignsubmission_file_/services-feedback.html", page(FOUND))
        archive.writestr("readme.html", "<p>not a page of feedback")
    ran = run(tmp_path, tmp_path / "came.zip")
    assert ran.returncode == 0, ran.stderr
    assert (folder / "feedback" / "services.html").exists()


def test_marks_by_hand_and_lateness_are_in_the_sum_and_said():
    marks = [
        Mark("relay", 5.5, 6.0, "Good."),
        Mark("service-or-action", 0.0, 5.0, "", waiting=True),
        Mark("Handed in late", -2.0, 0.0),
        Mark("motor-service", None, 0.0, "See line 3."),
    ]
    said = shown.text(Feedback("ada", "services", "Services", "graded", 12.5, 20.0, TESTS, marks))
    assert "12.5 of 20 points so far" in said
    assert "relay: 5.5 of 6 points. Good." in said
    assert "service-or-action: still to be marked" in said
    assert "service-or-action  still to be marked" in said and "0 of 5" not in said
    assert "Handed in late: -2 points" in said
    assert "motor-service. See line 3." in said


def test_a_newer_page_is_shown_and_the_older_one_is_kept(folder):
    better = Feedback("ada", "services", "Services", "graded", 15.0, 15.0, TESTS[:1])
    for found in (FOUND, better):
        pages.keep(page(found), found, folder)
    assert reading.find(folder)[1] == better
    pages.keep(page(FOUND), FOUND, folder)
    assert reading.find(folder)[1] == FOUND
    assert len(list((folder / "feedback").iterdir())) == 2


def test_what_lies_in_its_place_and_is_no_file_is_neither_read_nor_replaced(folder):
    """Such a folder may come from anywhere: a pipe would be waited for, and a device read until memory is gone."""
    kept = folder / "feedback"
    kept.mkdir()
    os.mkfifo(kept / "services.html")
    (kept / "services-2.html").symlink_to("/dev/zero")
    assert pages.keep(page(FOUND), FOUND, folder) == kept / "services-3.html"
    assert reading.find(folder)[1] == FOUND


def test_a_record_is_read_as_it_was_written():
    marks = [Mark("relay", None, 6.0, 'a "quoted" & <b>', waiting=True)]
    found = Feedback("Zoë", "services", "Services", "graded", 1.5, 15.0, TESTS, marks)
    assert record.read(page(found)) == found


def test_what_a_hostile_page_says_is_shown_and_not_run(folder, monkeypatch):
    tests = [Test(HOSTILE, HOSTILE, 0.0, 1.0, HOSTILE, HOSTILE)]
    found = Feedback(HOSTILE, "services", HOSTILE, "graded", 0.0, 1.0, tests, [Mark(HOSTILE, 0.0, 1.0, HOSTILE)])
    read = record.read(page(found))
    html = shown.html(read)
    assert "<script" not in html and "<img" not in html and "&lt;script&gt;" in html
    assert "\x1b" not in shown.text(read) + html


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        "[" * 100_000,
        '{"format": 1}',
        FOUND.to_text().replace('"points": 10.0', '"points": "10"'),
        FOUND.to_text().replace('"points": 10.0', '"points": NaN'),
        FOUND.to_text().replace('"points": 10.0', '"points": 1e300'),
        FOUND.to_text().replace('"points": 10.0', f'"points": {"9" * 4000}'),
        FOUND.to_text().replace('"student": "ada"', '"student": ["ada"]'),
        FOUND.to_text().replace('"tests": [', '"tests": [7, '),
    ],
)
def test_what_is_no_record_is_refused(text):
    with pytest.raises(FeedbackError, match="not a feedback page from this course"):
        Feedback.from_text(text)


def test_a_page_that_would_keep_a_parser_busy_is_looked_through_at_once(tmp_path):
    (tmp_path / "came.html").write_bytes(b"<!--<a x='" * 400_000)
    begun = time.process_time()
    with pytest.raises(FeedbackError):
        pages.take(tmp_path / "came.html")
    assert time.process_time() - begun < 5  # s of this process alone; html.parser takes minutes


@pytest.mark.parametrize("packed", [False, True])
def test_only_the_first_megabytes_of_a_page_are_parsed(packed, tmp_path):
    """A compressed page of 50 MB, full of brackets, took more than 1 GB."""
    long, came = b"<!--" + b" " * pages.LARGEST + b"-->" + page(FOUND), tmp_path / "came"
    if packed:
        with zipfile.ZipFile(came, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("ada.html", long)
    else:
        came.write_bytes(long)
    with pytest.raises(FeedbackError):
        pages.take(came)


def graders_pages() -> dict[str, bytes]:
    """Every kind of page that the grader writes, full of what a page might do."""
    results = [Result("a", HOSTILE, outcome, 0, 4, HOSTILE) for outcome in ("failed", "timed_out", "not_run")]
    whole = Report("ada", "services", "graded", 1.0, 9.0, 1, 1.0, [], [*results, Result("b", "b", "passed", 1, 1)])
    marks = [Mark(HOSTILE, None, 6.0, HOSTILE, waiting=True), Mark("relay", 1.5, 6.0), Mark("late", -2.0, 0.0)]
    kinds = {
        "graded": feedback.page(whole),
        "with all it may say": feedback.page(
            replace(whole, flags=["unsafe", "killed_judge", "time_unknown"], logs={"a.py": HOSTILE}), marks
        ),
        "refused": feedback.page(replace(whole, status="invalid_submission")),
        "not graded yet": feedback.page(replace(whole, status="infrastructure_error", tests=[])),
    }
    return {kind: text.encode() for kind, text in kinds.items()}


def test_every_page_of_the_grader_is_taken(tmp_path):
    for text in graders_pages().values():
        for came in (text, text.replace(b"\n", b"\r\n")):
            (tmp_path / "came.html").write_bytes(came)
            assert pages.take(tmp_path / "came.html")[1] == came


POLICY = b"default-src 'none'; style-src 'unsafe-inline'"
RUN = b"<script>alert(1)</script>"


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"</body>", RUN + b"</body>"),
        (b"</body>", b"<ScRiPt/x>alert(1)</sCrIpT></body>"),
        (b"</body>", b"<iframe src=javascript:alert(1)></iframe></body>"),
        (b"</body>", b"<img src=https://evil.example/x></body>"),
        (b"</body>", b'<a href="https://evil.example">a page</a></body>'),
        (b"</body>", b"<form><input></form></body>"),
        (b"</body>", b"<!-- <p> --></body>"),
        (b"</body>", b"<p</body>"),
        (b"</body>", b" " * pages.LARGEST + RUN + b"</body>"),  # beyond what is parsed
        (b"<h1>", b"<h1 onclick=alert(1)>"),
        (b"<h1>", b'<h1 style="position:fixed">'),
        (b'class="score"', b'class="score" onclick="alert(1)"'),
        (b'class="score"', b'class="score"onclick="alert(1)"'),
        (b"<title>", b'<title><meta name="course-feedback" content="</title>' + RUN + b'">'),
        (b"<style>", b"<style></style>" + RUN + b"<style>"),
        (POLICY, b"default-src *"),
        (POLICY, POLICY + b"; script-src 'unsafe-inline'"),
        (b"<title>", b'<meta http-equiv="refresh" content="0;url=https://evil.example"><title>'),
        (b'<meta http-equiv="Content-Security-Policy" content="' + POLICY + b'">', b""),
        (b'<html lang="en">', b'<html lang="en"><body>'),  # a policy in the body does not count
        (b"<!doctype html>", b"\0<!doctype html>"),
        (b"<!doctype html>", b"<?xml version='1.0'?><!doctype html>"),
    ],
)
def test_a_page_that_was_changed_is_not_kept(folder, tmp_path, old, new, packed):
    came = graders_pages()["with all it may say"].replace(old, new, 1)
    if packed:
        with zipfile.ZipFile(tmp_path / "came", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("ada.html", came)
    else:
        (tmp_path / "came").write_bytes(came)
    with pytest.raises(FeedbackError, match="came: it was not made by the course's grader, or was changed afterwards"):
        reading.take(tmp_path / "came", folder)
    assert not (folder / "feedback").exists()


@pytest.mark.parametrize("part", [b"<p>", b"<", b"a<p>", b'<p class="', b"<meta name="])
def test_a_long_page_is_looked_through_in_a_time_in_proportion_to_its_size(part):
    begun = time.process_time()
    with pytest.raises(FeedbackError):
        made.check(page(FOUND) + part * (4_000_000 // len(part)) + b"<b>")
    assert time.process_time() - begun < 8  # s of this process alone, on a busy machine; about 1


def test_a_page_of_a_later_form_says_so():
    with pytest.raises(FeedbackError, match="update yours"):
        Feedback.from_text(FOUND.to_text().replace('"format": 1', '"format": 2'))


@pytest.mark.parametrize("name", ["../../services", "/etc", "", "..", "nothing", "n" * 300, "\u4e00" * 99])
def test_a_page_cannot_choose_where_it_is_put(folder, tmp_path, name):
    (tmp_path / "came.html").write_bytes(page(Feedback("ada", name, "Services", "graded", 1.0, 1.0)))
    before = sorted(tmp_path.rglob("*"))
    ran = run(folder, tmp_path / "came.html")
    assert ran.returncode == 1
    assert "that notebook is not here" in ran.stderr and len(ran.stderr.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not a feedback page"),
        (b"<html><p>an old page</html>", "open it in a browser"),
        (b"PK\x05\x06" + bytes(18), "contains no page of feedback"),
    ],
)
def test_what_is_no_feedback_is_told_in_a_line(folder, tmp_path, content, says):
    (tmp_path / "came").write_bytes(content)
    ran = run(folder, tmp_path / "came")
    assert ran.returncode == 1
    assert says in ran.stderr and len(ran.stderr.splitlines()) == 1


def test_an_archive_with_pages_of_several_is_not_guessed_at(tmp_path):
    with zipfile.ZipFile(tmp_path / "class.zip", "w") as archive:
        for student in ("ada", "bob"):
            archive.writestr(f"{student}.html", page(Feedback(student, "services", "", "graded", 1.0, 1.0)))
    with pytest.raises(FeedbackError, match="contains 2 pages of feedback"):
        pages.take(tmp_path / "class.zip")


def test_a_full_disk_leaves_the_page_that_was_there(folder, tmp_path):
    pages.keep(page(FOUND), FOUND, folder)
    long = Feedback("ada", "services", "Services", "graded", 1.0, 15.0, TESTS * 50)
    (tmp_path / "came.html").write_bytes(page(long))
    command = f"ulimit -f 4; trap '' XFSZ; exec {COURSE} feedback {tmp_path / 'came.html'}"
    ran = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 1
    assert "File too large" in ran.stderr and len(ran.stderr.splitlines()) == 1
    assert [path.name for path in (folder / "feedback").iterdir()] == ["services.html"]
    assert (folder / "feedback" / "services.html").read_bytes() == page(FOUND)


# By itself, where there is an exchange.


@pytest.fixture
def released(folder, monkeypatch):
    """A page that was released in an exchange of nbgrader's, for a hand-in of this student."""
    base = Path(tempfile.mkdtemp())  # pytest's own folders are closed to other users
    base.chmod(0o755)
    data, root = base / "data", base / "exchange"
    hand_in = data / "nbgrader_cache" / "ros2" / "ada+services+2026-11-02 09:30:00.000000 UTC"
    hand_in.mkdir(parents=True)
    (hand_in / "services.ipynb").write_text("{}")
    (hand_in / "submission_secret.txt").write_text("secret")
    target = root / "ros2" / "feedback" / f"{notebook_hash(secret='secret', notebook_id='services')}.html"
    target.parent.mkdir(parents=True)
    target.write_bytes(page(FOUND))
    config = base / "config"
    config.mkdir()
    (config / "nbgrader_config.py").write_text(f"c = get_config()\nc.Exchange.root = {str(root)!r}\n")
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(config))
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(data))
    monkeypatch.chdir(folder)
    yield target
    shutil.rmtree(base)


def test_what_was_released_is_said_in_a_line_until_it_is_read(released, folder, capsys):
    course.check()
    assert "Feedback on services has been released: course.feedback() shows it." in capsys.readouterr().out
    assert repr(course.feedback("relay")).startswith("Services: 10 of 15 points")
    assert (folder / "feedback" / "services.html").read_bytes() == page(FOUND)
    assert reading.unread_line(folder) == ""


def test_in_a_class_one_reads_whether_feedback_is_missing_because_nothing_was_handed_in(released, folder):
    released.unlink()
    with pytest.raises(FeedbackError, match="no feedback on services yet: your instructor has not released it"):
        reading.find(folder)
    shutil.rmtree(released.parents[3] / "data")
    with pytest.raises(FeedbackError, match="no feedback on services, because you have not handed it in"):
        reading.find(folder)


def test_the_command_finds_what_was_released_and_runs_no_configuration_of_the_folder(released, folder):
    """The folder may have come from somebody else."""
    (folder / "nbgrader_config.py").write_text("open('ran', 'w')  # Exchange\n")
    ran = run(folder)
    assert "Services: 10 of 15 points" in ran.stdout, ran.stderr
    assert not (folder / "ran").exists()


def test_without_an_exchange_nothing_is_said_and_nbgrader_is_not_loaded(folder):
    code = (
        "import sys, course.returned.reading as r, pathlib; print(repr(r.unread_line(pathlib.Path()))); "
        "print([name for name in sys.modules if name.startswith('nbgrader')])"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    assert ran.stdout.split() == ["''", "[]"]


def test_that_there_is_no_feedback_is_said_without_loading_nbgrader(folder):
    code = (
        "import sys, course\ntry:\n    course.feedback()\nexcept course.CourseError as error:\n    print(error)\n"
        "print([name for name in sys.modules if name.startswith('nbgrader')])"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    said, loaded = ran.stdout.splitlines()
    assert said.startswith("there is no feedback") and loaded == "[]", ran.stderr


def test_the_default_place_of_the_exchange_is_nbgraders():
    assert Exchange.class_traits()["root"].default() == str(nbgrader_exchange.ROOT)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can work as another user")
def test_an_exchange_without_permission_is_a_line_and_stops_nothing(released, folder, monkeypatch):
    work = shutil.copytree(folder, released.parents[3] / "services")
    assert reading.unread_line(work) != ""
    fetcher = nbgrader_exchange._fetcher("ros2", "services")  # made now: the other user may not read the course
    monkeypatch.setattr(nbgrader_exchange, "_fetcher", lambda *_: fetcher)
    monkeypatch.setattr(nbgrader_exchange, "_may_be_configured", lambda: True)  # for which Jupyter looks there, too
    released.parents[1].chmod(0o700)
    os.setresuid(65534, 65534, 0)
    try:
        assert reading.unread_line(work) == ""
        with pytest.raises(FeedbackError, match="the exchange .*/exchange cannot be read: Permission denied"):
            nbgrader_exchange.released("services")
        assert nbgrader_exchange.folder() is None  # nbgrader needs to write there
    finally:
        os.setresuid(0, 0, 0)


def test_feedback_that_nbgrader_s_own_page_has_fetched_is_found(folder):
    place = folder / "feedback" / "2026-11-02 09:30:00.000000 UTC"
    place.mkdir(parents=True)
    (place / "services.html").write_bytes(page(FOUND))
    assert reading.find(folder) == (place / "services.html", FOUND)


def test_the_exchange_is_where_nbgrader_looks_for_it(released):
    assert nbgrader_exchange.folder() == released.parents[2]
