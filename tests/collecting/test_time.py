"""The time of a hand-in is what somebody vouches for: a receipt or the platform, and never the click on Download."""

import json

import pytest
from nbgrader.api import Gradebook
from typer.testing import CliRunner

from autograder.cli import app
from autograder.collecting.collect import collect, describe
from autograder.gradebook import ends, extensions
from autograder.gradebook.book import Scores
from autograder.gradebook.release import COURSE_FILE
from autograder.records import TIME_UNKNOWN
from autograder.submissions import provenance
from autograder.submissions.provenance import KNOWN, ON_TIME, UNKNOWN
from autograder.submissions.times import parse_time
from tests.gradebook.test_late import penalties
from tests.returning.test_return import report

from .test_collect import EARLY, FILES, LATER, archive, handed_in

pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
DUE = parse_time("2026-11-02 23:59 UTC")  # between EARLY and LATER


@pytest.fixture
def submitted(tmp_path):
    """A course in which a day costs ten percent, and what was downloaded from Canvas a day after the due date."""
    course = tmp_path / "course"
    (course / "source").mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(COURSE_FILE + "c.LatePolicy.percent_per_day = 10\n")
    receipt = handed_in(tmp_path / "one", "x").read_bytes()
    late_receipt = handed_in(tmp_path / "two", "y", at=LATER).read_bytes()
    bulk = archive(
        tmp_path / "canvas.zip",
        {
            "ontime_1_11_relay.py": b"relay",
            "late_LATE_2_12_relay.py": b"relay",
            "receipt_3_13_services.zip": receipt,
            "byreceipt_LATE_4_14_services.zip": late_receipt,
            "contradicted_LATE_5_15_services.zip": receipt,
        },
    )
    moodle = archive(tmp_path / "moodle.zip", {"Zoe_55_assignsubmission_file_/relay.py": b"relay"})
    collection = collect([bulk, moodle], course / "submitted", due=DUE)
    assert collection.unplaced == []
    return course / "submitted", describe(collection)


def test_only_a_time_that_somebody_vouches_for_is_written(submitted):
    folder, said = submitted
    stamped = {path.parent.parent.name: path.read_text().strip() for path in folder.glob("*/services/timestamp.txt")}
    assert stamped == {"receipt": "2026-11-02 09:30:00 UTC", "byreceipt": "2026-11-03 09:30:00 UTC"}
    known = {name: provenance.read(folder, name, "services")[-1].time for name in ("ontime", "late", "receipt", "Zoe")}
    assert known == {"ontime": ON_TIME, "late": UNKNOWN, "receipt": KNOWN, "Zoe": UNKNOWN}
    lines = {line.split("/")[0].strip(): line for line in said.splitlines()}
    assert "on time, as Canvas says" in lines["ontime"]
    assert "LOOK: the platform marks it late" in lines["late"] and "time unknown" in lines["late"]
    assert "time unknown" in lines["Zoe"]
    assert "2026-11-03" not in lines["ontime"] + lines["late"] + lines["Zoe"]


def test_no_points_go_by_the_time_of_a_download(submitted):
    folder, _ = submitted
    url = f"sqlite:///{folder.parent / 'gradebook.db'}"
    students = ["ontime", "late", "receipt", "byreceipt", "contradicted", "Zoe"]
    with Scores(url) as scores:
        for student in students:
            scores.write(report(student))
    with Gradebook(url) as book:
        book.update_or_create_assignment("services", duedate=DUE.replace(tzinfo=None))
        for student in students:  # as an earlier version entered them
            book.update_or_create_submission("services", student, timestamp=LATER.replace(tzinfo=None))
    with Scores(url, folder) as scores:
        for student in students:
            scores.write(report(student))
    taken = penalties(url, "services")
    assert {student for student, points in taken.items() if points} == {"byreceipt"}


def test_an_unknown_time_is_flagged_and_one_on_time_is_not(submitted, tmp_path):
    """Refused files are enough to see the flags: nothing is run."""
    from autograder.cli import app

    folder, _ = submitted
    for student in ("ontime", "late", "Zoe", "contradicted", "receipt"):
        for path in (folder / student / "services").glob("*.py"):
            path.unlink()
    ran = CliRunner().invoke(
        app,
        [
            "grade",
            str(folder),
            "--output",
            str(tmp_path / "out"),
            "--no-gradebook",
            *(f"--student={name}" for name in ("ontime", "late", "Zoe", "contradicted")),
        ],
    )
    assert ran.exit_code == 0, ran.output
    found = [json.loads(line) for line in (tmp_path / "out" / "results.jsonl").read_text().splitlines()]
    flagged = {one["student"] for one in found if TIME_UNKNOWN in one["flags"]}
    assert flagged == {"late", "Zoe", "contradicted"}


def test_downloading_again_later_changes_nothing(tmp_path):
    """The archive of a later download has later times; the same files do not become a newer hand-in by that."""
    files = {"doejane_1_11_relay.py": b"relay", "roejim_2_12_relay.py": b"relay"}
    collect([archive(tmp_path / "first.zip", files)], tmp_path / "out")
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    again = collect([archive(tmp_path / "second.zip", files, LATER.replace(day=20))], tmp_path / "out")
    assert again.kept == []
    assert {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()} == before


def test_of_several_uploads_the_last_counts_whatever_the_time_of_the_download(tmp_path):
    first, second = archive(tmp_path / "w.zip", {"relay.py": b"first"}), handed_in(tmp_path / "in", "x")
    bulk = archive(
        tmp_path / "bulk.zip",
        {"doejane_1_11_work.zip": first.read_bytes(), "doejane_1_12_work.zip": second.read_bytes()},
    )
    (best,) = collect([bulk], tmp_path / "out").laid_out
    assert best.files["relay.py"] == FILES["relay.py"]  # its receipt is older than the download


def test_a_folder_that_is_laid_out_keeps_its_time(tmp_path):
    folder = tmp_path / "in" / "ada" / "services"
    folder.mkdir(parents=True)
    (folder / "relay.py").write_bytes(b"relay")
    (folder / "timestamp.txt").write_text("2026-11-02 11:30:00 +0200\n")
    (only,) = collect([tmp_path / "in"], tmp_path / "out").laid_out
    assert only.at == EARLY
    assert (tmp_path / "out" / "ada" / "services" / "timestamp.txt").read_text() == "2026-11-02 09:30:00 UTC\n"


def test_after_the_end_a_hand_in_is_listed_unless_its_student_has_an_extension(tmp_path):
    """The end is said to the command, or is that of the course folder; without a known time nobody is kept out."""
    for name in ("ada", "bob"):
        handed_in(tmp_path / "in", name, at=LATER)
    archive(tmp_path / "in" / "canvas.zip", {"zoe_LATE_2_12_relay.py": b"relay"})
    arguments = ["collect", str(tmp_path / "in"), "--into"]
    runner = CliRunner()
    ran = runner.invoke(app, [*arguments, str(tmp_path / "out"), "--until", "2026-11-02 23:59 UTC"])
    late = "it was handed in at 2026-11-03 09:30:00 UTC, after the end at 2026-11-02 23:59:00 UTC"
    assert ran.exit_code == 1 and ran.output.count(late) == 2
    assert {path.name for path in (tmp_path / "out").glob("[!.]*")} == {"zoe"}

    course = tmp_path / "course"
    (course / "source").mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(COURSE_FILE)
    ends.change(course, {"services": DUE})
    extensions.change(course, ["bob"], None, 1.0)
    ran = runner.invoke(app, [*arguments, str(course / "submitted")])
    assert ran.exit_code == 1 and ran.output.count(late) == 1
    assert {path.name for path in (course / "submitted").glob("[!.]*")} == {"bob", "zoe"}
    (course / "ends.json").write_text("[]")
    ran = runner.invoke(app, [*arguments, str(course / "submitted")])
    assert "ends.json cannot be read" in str(ran.exception)
