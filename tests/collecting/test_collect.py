"""`autograder collect`: whatever form hand-ins come in, each is laid out for its student, and nothing is lost."""

import ctypes
import io
import itertools
import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime
from errno import EINVAL
from functools import partial
from pathlib import Path, PurePosixPath
from types import SimpleNamespace

import pytest

from autograder.collecting.collect import alone, collect, describe
from autograder.errors import UsageError
from autograder.platforms import origin
from autograder.submissions import provenance
from autograder.submissions.roster import LONGEST, Roster, read_rosters
from autograder.submissions.times import parse_time
from course.foundation import storage
from course.hand_in import HandIn, write

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
EARLY, LATER = datetime(2026, 11, 2, 9, 30, tzinfo=UTC), datetime(2026, 11, 3, 9, 30, tzinfo=UTC)
FILES = {"motor_service.py": b"print('motor')\n", "relay.py": b"print('relay')\n", "services.ipynb": b"{}"}


def handed_in(folder: Path, name: str = "ada", at: datetime = EARLY, files: dict[str, bytes] = FILES) -> Path:
    """Return what `course hand-in` writes."""
    folder.mkdir(parents=True, exist_ok=True)
    return write(HandIn("services", [], files, {}), folder, name, {}, at)


def archive(path: Path, files: dict[str, bytes], at: datetime = LATER) -> Path:
    with zipfile.ZipFile(path, "w") as writer:
        for name, content in files.items():
            writer.writestr(zipfile.ZipInfo(name, at.timetuple()[:6]), content)
    return path


def repacked(path: Path, change: dict[str, object]) -> Path:
    """The archive with another receipt: these entries changed, or the text of it."""
    with zipfile.ZipFile(path) as whole:
        content = {name: whole.read(name) for name in whole.namelist()}
    text = change.get("text")
    known = json.loads(content["receipt.json"])
    content["receipt.json"] = str(text).encode() if text else json.dumps(known | change).encode()
    return archive(path, content)


def laid_out(into: Path) -> dict[str, bytes]:
    """Return what was handed in, without what is remembered of where it came from."""
    files = (path for path in sorted(into.rglob("*")) if path.is_file() and ".origins" not in path.parts)
    return {str(path.relative_to(into)): path.read_bytes() for path in files}


def counted(into: Path) -> set[str]:
    """STUDENT/ASSIGNMENT of what the grader would find."""
    return {f"{path.parent.name}/{path.name}" for path in into.glob("[!.]*/*")}


def test_an_archive_is_laid_out_with_its_files_and_the_receipt_s_time(tmp_path):
    result = collect([handed_in(tmp_path / "in")], tmp_path / "out")
    assert [each.receipt for each in result.laid_out] == ["verified"]
    assert laid_out(tmp_path / "out") == {
        **{f"ada/services/{name}": content for name, content in FILES.items()},
        "ada/services/timestamp.txt": b"2026-11-02 09:30:00 UTC\n",
    }
    assert (result.kept, result.unplaced) == ([], [])


def test_collecting_again_changes_nothing(tmp_path):
    handed_in(tmp_path / "in")
    collect([tmp_path / "in"], tmp_path / "out")
    before = laid_out(tmp_path / "out")
    again = collect([tmp_path / "in"], tmp_path / "out")
    assert laid_out(tmp_path / "out") == before
    assert again.kept == []


def test_the_newest_counts_and_the_others_are_kept(tmp_path):
    handed_in(tmp_path / "in", at=EARLY)
    handed_in(tmp_path / "in", at=LATER, files=FILES | {"relay.py": b"print('better')\n"})
    result = collect([tmp_path / "in"], tmp_path / "out")
    assert (tmp_path / "out" / "ada" / "services" / "relay.py").read_bytes() == b"print('better')\n"
    assert [each.at for each in result.kept] == [EARLY]
    (kept,) = (tmp_path / "out" / ".others" / "ada" / "services").iterdir()
    assert (kept / "relay.py").read_bytes() == FILES["relay.py"]


def test_the_newest_on_time_counts_more_than_a_late_one(tmp_path):
    handed_in(tmp_path / "in", at=EARLY)
    handed_in(tmp_path / "in", at=LATER, files=FILES | {"relay.py": b"late"})
    collect([tmp_path / "in"], tmp_path / "out", due=parse_time("2026-11-02 23:59 UTC"))
    assert (tmp_path / "out" / "ada" / "services" / "relay.py").read_bytes() == FILES["relay.py"]


def test_an_older_one_that_comes_later_replaces_nothing_and_is_kept(tmp_path):
    collect([handed_in(tmp_path / "new", at=LATER)], tmp_path / "out")
    old = handed_in(tmp_path / "old", at=EARLY, files=FILES | {"relay.py": b"old"})
    result = collect([old], tmp_path / "out")
    assert (tmp_path / "out" / "ada" / "services" / "relay.py").read_bytes() == FILES["relay.py"]
    assert len(result.kept) == 1
    assert b"old" in laid_out(tmp_path / "out").values()


def test_what_is_replaced_is_kept(tmp_path):
    collect([handed_in(tmp_path / "old", at=EARLY)], tmp_path / "out")
    new = handed_in(tmp_path / "new", at=LATER, files=FILES | {"relay.py": b"new"})
    collect([new], tmp_path / "out")
    content = laid_out(tmp_path / "out")
    assert content["ada/services/relay.py"] == b"new"
    assert any(name.startswith(".others/") and value == FILES["relay.py"] for name, value in content.items())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"relay.py": b"changed after the receipt"}, "does not match relay.py"),
        ({"receipt.json": b"{"}, "cannot be read"),
        ({"receipt.json": b"[" * 100_000}, "cannot be read"),
    ],
    ids=["a changed file", "a broken receipt", "a deep receipt"],
)
def test_a_receipt_that_does_not_fit_is_named_and_its_time_is_not_believed(tmp_path, change, says):
    path = handed_in(tmp_path / "in", at=EARLY)
    with zipfile.ZipFile(path) as whole:
        content = {name: whole.read(name) for name in whole.namelist()} | change
    bulk = archive(tmp_path / "bulk.zip", {f"doejane_1_2_{path.name}": archive(path, content).read_bytes()})
    (only,) = collect([bulk], tmp_path / "out").laid_out
    assert says in only.remark
    assert only.at == LATER  # the platform's


def test_a_receipt_from_the_future_is_not_believed(tmp_path):
    path = handed_in(tmp_path / "in", at=datetime(2999, 1, 1, tzinfo=UTC))
    os.utime(path, (EARLY.timestamp(), EARLY.timestamp()))
    (only,) = collect([path], tmp_path / "out").laid_out
    assert only.at == EARLY
    assert only.remark == "the time in its receipt, 2999-01-01 00:00:00 UTC, is in the future"


def test_a_receipt_that_is_newer_than_its_archive_is_not_believed_and_says_why(tmp_path):
    path = handed_in(tmp_path / "in", at=LATER)
    os.utime(path, (EARLY.timestamp(), EARLY.timestamp()))
    (only,) = collect([path], tmp_path / "out").laid_out
    assert (only.at, only.when) == (EARLY, "time unknown")
    assert only.remark.endswith("2026-11-03 09:30:00 UTC, is after that of its archive, 2026-11-02 09:30:00 UTC")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (b'"services"', b'"calculator"', "is of calculator"),
        (b'"services"', b"null", "cannot be read"),
        (b'"services"', b'["services"]', "cannot be read"),
        (b'"format": 1', b'"format": 2', "has a format that this version of the course does not write: 2"),
        (b'"format": 1', b'"format": true', "has a format that this version of the course does not write: True"),
    ],
)
def test_a_receipt_that_is_not_of_its_files_exercise_or_not_ours_is_named(tmp_path, before, after, said):
    path = handed_in(tmp_path / "in")
    with zipfile.ZipFile(path) as whole:
        content = {name: whole.read(name) for name in whole.namelist()}
    assert before in content["receipt.json"]
    content["receipt.json"] = content["receipt.json"].replace(before, after)
    (only,) = collect([archive(tmp_path / "changed.zip", content)], tmp_path / "out").laid_out
    assert (only.assignment, only.receipt) == ("services", said)
    assert f"its receipt {said}" in only.remark


def test_files_in_a_folder_beside_the_receipt_are_told(tmp_path):
    path = handed_in(tmp_path / "in")
    with zipfile.ZipFile(path) as whole:
        content = {
            name if name == "receipt.json" else f"services/{name}": whole.read(name) for name in whole.namelist()
        }
    (line,) = collect([archive(tmp_path / "changed.zip", content)], tmp_path / "out").unplaced
    assert "its files, such as services/" in line and "only files beside the receipt count" in line


@pytest.mark.parametrize("text", ["2026-11-02", "2026-11-02 UTC", "2026-11-02+01:00"])
def test_a_date_without_a_time_of_day_is_told_what_it_lacks(text):
    with pytest.raises(UsageError, match="has no time of day: write it as '2026-11-20 23:59 UTC'"):
        parse_time(text)


def test_a_bulk_download_of_canvas(tmp_path):
    one = handed_in(tmp_path / "one", "x").read_bytes()
    two = handed_in(tmp_path / "two", "y", files=FILES | {"relay.py": b"again"}).read_bytes()
    bulk = archive(
        tmp_path / "submissions.zip",
        {
            "doejane_LATE_1234_900_x-services-20261102T093000Z.zip": one,
            "doejane_1234_901_x-services-20261102T093000Z-1.zip": two,  # handed in again
            "roejim_77_902_motor_service.py": b"first",
            "roejim_77_903_motor_service-1.py": b"second",
            "roejim_77_904_relay.py": b"relay",
        },
    )
    result = collect([bulk], tmp_path / "out")
    assert counted(tmp_path / "out") == {"doejane/services", "roejim/services"}
    content = laid_out(tmp_path / "out")
    assert content["doejane/services/relay.py"] == b"again"
    assert content["roejim/services/motor_service.py"] == b"second"
    assert [each.came.late for each in result.kept] == [True]
    assert "the platform marks it late" in describe(result)


def test_a_bulk_download_of_moodle_with_folders_and_without(tmp_path):
    one = handed_in(tmp_path / "one", "x").read_bytes()
    bulk = archive(
        tmp_path / "moodle.zip",
        {
            "Zoë Müller_55_assignsubmission_file_/services/motor_service.py": b"motor",
            "Zoë Müller_55_assignsubmission_file_/services/relay.py": b"relay",
            "Jim Roe_56_assignsubmission_file_/x-services-20261102T093000Z.zip": one,
            "Jane Doe_57_assignsubmission_file_pid_node.py": b"pid",
            "Jane Doe_57_assignsubmission_onlinetext_/onlinetext.html": b"hello",
        },
    )
    result = collect([bulk], tmp_path / "out")
    assert counted(tmp_path / "out") == {"Zoë_Müller/services", "Jim_Roe/services", "Jane_Doe/parameters"}
    assert len(result.unplaced) == 1
    assert "onlinetext.html: its name matches neither Canvas nor Moodle" in result.unplaced[0]


def test_a_folder_that_is_laid_out_already_is_taken_as_it_is(tmp_path):
    folder = tmp_path / "in" / "ada" / "services"
    folder.mkdir(parents=True)
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    (folder / "link.py").symlink_to("/etc/passwd")
    collect([tmp_path / "in"], tmp_path / "out")
    assert {name.rpartition("/")[2] for name in laid_out(tmp_path / "out")} == {*FILES}


def test_files_in_a_folder_inside_the_archive_are_found(tmp_path):
    path = archive(tmp_path / "ada.zip", {f"my work/services/{name}": content for name, content in FILES.items()})
    result = collect([path], tmp_path / "out")
    assert [line.partition(";")[0] for line in result.unplaced] == ["ada.zip: it does not say who handed it in"]
    bulk = archive(tmp_path / "bulk.zip", {"doejane_1_2_work.zip": path.read_bytes()})
    collect([bulk], tmp_path / "out")
    assert counted(tmp_path / "out") == {"doejane/services"}


def test_a_roster_tells_folders_from_names(tmp_path):
    roster = tmp_path / "roster.csv"
    roster.write_text(
        "student,login,canvas_id,first_name,last_name\n"
        "ada,al12,1234,Ada,Lovelace\njim,jr3,,Jim,Roe\nzoe,zm9,,Zoë,Müller\n"
    )
    bulk = archive(
        tmp_path / "bulk.zip",
        {
            "lovelaceada_1234_900_relay.py": b"by number",
            "roejim_9999_901_relay.py": b"by name",
            "mullerzoe_8888_902_relay.py": b"without accents",
            "strangersam_5_903_relay.py": b"nobody knows",
        },
    )
    result = collect([bulk], tmp_path / "out", read_rosters([roster]))
    content = laid_out(tmp_path / "out")
    assert content["ada/services/relay.py"] == b"by number"
    assert content["jim/services/relay.py"] == b"by name"
    assert content["zoe/services/relay.py"] == b"without accents"
    assert len(result.laid_out) == 3
    assert result.unplaced == ["bulk.zip, files of strangersam: '5' or 'strangersam' is not in the roster"]


@pytest.mark.parametrize(
    ("own", "other"),
    [
        ("lovelaceada_101_9001_services.zip", "lovelaceada_205_9005_services.zip"),
        ("lovelaceada_101_9001_relay.py", "lovelaceada_205_9005_relay.py"),
        (
            "Ada Lovelace_101_assignsubmission_file_/services.zip",
            "Ada Lovelace_205_assignsubmission_file_/services.zip",
        ),
    ],
)
def test_whoever_calls_themselves_as_another_student_is_not_that_student(tmp_path, own, other):
    """The roster has the number of the one, and the other's hand-in is newer: it replaces nothing, and is listed."""
    roster = tmp_path / "roster.csv"
    roster.write_text("student,number,first_name,last_name\nada,101,Ada,Lovelace\njim,7,Jim,Roe\n")
    mine, foreign = (
        handed_in(tmp_path / name, name, at, {**FILES, "relay.py": name.encode()}).read_bytes()
        for name, at in (("ada", EARLY), ("x", LATER))
    )
    names = {own: mine, other: foreign} if own.endswith("zip") else {own: b"ada", other: b"x"}
    result = collect([archive(tmp_path / "bulk.zip", names)], tmp_path / "out", read_rosters([roster]))
    assert [each.came.user for each in result.laid_out] == ["101"]
    assert laid_out(tmp_path / "out")["ada/services/relay.py"] == b"ada"
    (line,) = result.unplaced
    assert "ada has the number 101 in the roster (column 'number')" in line and " calls 205 " in line
    alone = collect([archive(tmp_path / "later.zip", {other: foreign})], tmp_path / "out", read_rosters([roster]))
    if "assignsubmission" not in other:  # Moodle's numbers hold in one download alone
        assert not alone.laid_out and len(alone.unplaced) == 1


@pytest.mark.parametrize(
    ("own", "other"),
    [
        ("Ada Lovelace_101_assignsubmission_file_/a.zip", f"{odd}/x.zip")
        for odd in (
            "Ada Lovelace_101_assignsubmission_file_205_assignsubmission_file_",
            "_205_assignsubmission_file_",
            "Mal Lory_205_assignsubmission_onlinetext_",
            "odd",
        )
    ]
    + [
        ("lovelaceada_101_9001_a.zip", odd)
        for odd in (
            "_205_9002_x.zip",
            "lovelaceada_101_99999_205_9002_x.zip",
            "_LATE_205_9002_x.zip",
            "mal_205_text.html/x.zip",
        )
    ],
)
@pytest.mark.parametrize("beside", [True, False], ids=["beside hers", "alone"])
def test_a_receipt_makes_no_archive_in_a_bulk_download_that_of_another_student(tmp_path, own, other, beside):
    """A student with an invalid name at the platform is unknown, whatever a receipt in the archive says."""
    roster = tmp_path / "roster.csv"
    roster.write_text("student,number,first_name,last_name\nada,101,Ada,Lovelace\n")
    hers = handed_in(tmp_path / "hers", "ada").read_bytes()
    forged = handed_in(tmp_path / "forged", "ada", LATER, {**FILES, "relay.py": b"forged"}).read_bytes()
    if not beside and other.startswith(("odd", "mal_205_text")):
        pytest.skip("a zip file with a single archive, of no platform")
    files = {other: forged} | ({own: hers} if beside else {})
    result = collect([archive(tmp_path / "bulk.zip", files)], tmp_path / "out", read_rosters([roster]))
    assert len(result.unplaced) == 1
    assert laid_out(tmp_path / "out").get("ada/services/relay.py") == (FILES["relay.py"] if beside else None)
    with zipfile.ZipFile(tmp_path / "bulk.zip") as bulk:  # as a browser unpacks it
        bulk.extractall(tmp_path / "unpacked")
    if not other.startswith(("odd", "mal_205_text")):
        again = collect([tmp_path / "unpacked"], tmp_path / "again", read_rosters([roster]))
        assert laid_out(tmp_path / "again") == laid_out(tmp_path / "out") and len(again.unplaced) == 1


@pytest.mark.parametrize(
    "inside",
    [
        "roejim_12_99902_x.zip",
        "deep/roejim_12_99902_x.zip",
        "roejim_12_99902_relay.py",
        "bulk.zip",
        "jim/services/relay.py",
    ],
)
@pytest.mark.parametrize("packed", [False, True], ids=["unpacked", "in the download"])
def test_what_was_unpacked_from_an_upload_to_canvas_replaces_nobodys_hand_in(tmp_path, inside, packed):
    """An instructor has unpacked ada's .7z, in which files have names that Canvas would give to jim's."""
    roster = tmp_path / "roster.csv"
    roster.write_text("student,number\nada,11\njim,12\n")
    forged = handed_in(tmp_path / "forged", "jim", LATER, {**FILES, "relay.py": b"forged"}).read_bytes()
    if inside == "bulk.zip":
        forged = archive(
            tmp_path / "forged/all.zip", {"roejim_12_99902_x.zip": forged, "y_3_4_z.zip": b""}
        ).read_bytes()
    elif not inside.endswith(".zip"):
        forged = b"forged"
    files = {
        "roejim_12_902_jim-services.zip": handed_in(tmp_path / "his", "jim").read_bytes(),
        f"lovelaceada_11_901_sub/{inside}": forged,
    }
    download = archive(tmp_path / "submissions.zip", files)
    if not packed:
        with zipfile.ZipFile(download) as whole:
            whole.extractall(tmp_path / "unpacked")
        download = tmp_path / "unpacked"
    result = collect([download], tmp_path / "out", read_rosters([roster]))
    assert laid_out(tmp_path / "out")["jim/services/relay.py"] == FILES["relay.py"]
    assert counted(tmp_path / "out") == {"jim/services"} and not result.kept
    (said,) = result.unplaced
    assert said.partition(":")[0].endswith("lovelaceada_11_901_sub" if not packed else PurePosixPath(inside).name)
    assert packed or "Pack it as .zip, under the same name" in said


def test_a_name_with_an_underscore_is_one(tmp_path):
    assert origin(PurePosixPath("mal_lory_205_9002_x.zip")).names == ("205", "mal_lory")


def test_an_archive_that_is_made_out_to_another_student_is_named(tmp_path):
    roster = Roster()
    roster.add("ada", ["Ada Lovelace", "1"])
    roster.add("jim", ["Jim Roe", "2"])
    copied = handed_in(tmp_path / "in", "ada").read_bytes()
    bulk = archive(tmp_path / "bulk.zip", {"roejim_2_3_services.zip": copied})
    (only,) = collect([bulk], tmp_path / "out", roster).laid_out
    assert only.student == "jim"
    assert only.remark == "its receipt names ada"


@pytest.mark.parametrize("signed", ["ada", "Ada", "../ada"])
def test_without_a_roster_those_in_the_same_download_are_the_class(tmp_path, signed):
    hers = handed_in(tmp_path / "hers", "ada").read_bytes()
    own = handed_in(tmp_path / "own", "somebody").read_bytes()  # the name on the student's machine
    copied = archive(tmp_path / "copied.zip", {"x.zip": made_out_to(tmp_path / "his", signed, EARLY).read_bytes()})
    files = {"ada_1_3_a.zip": hers, "joe_2_4_x.zip": copied.read_bytes(), "eve_3_5_x.zip": own}
    found = collect([archive(tmp_path / "bulk.zip", files)], tmp_path / "out").laid_out
    assert {each.student: (each.remark, each.came.time) for each in found} == {
        "ada": ("", "known"),
        "joe": ("its receipt names ada", "on time"),
        "eve": ("", "known"),
    }
    assert not (tmp_path / "out" / "joe" / "services" / "timestamp.txt").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name,login\nada,x\n", "has no column 'student'"),
        ("student,login\nada,x\nada,y\n", "line 3: 'ada' is listed twice"),
        ("student,login\n../ada,x\n", "cannot be the name of a folder"),
        ("student,login\n.others,x\n", "cannot be the name of a folder"),
        ("student,login\n-rf,x\n", "cannot be the name of a folder"),
        (b"student,login\nJ\xf6rg,x\n", "is not a CSV file in UTF-8"),
    ],
)
def test_a_wrong_roster_is_one_line(tmp_path, text, says):
    roster = tmp_path / "roster.csv"
    roster.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(UsageError, match=".*") as caught:
        read_rosters([roster])
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("students", "shown"),
    [
        ({"jane1": "Jane Doe", "jane2": "Jane Doe"}, "janedoe"),
        ({"ada": "Ada Lovelace", "eve": "ada"}, "ada"),  # without the platform's numbers, it may be either of them
    ],
)
def test_a_name_on_a_platform_that_two_students_have_is_placed_with_neither(tmp_path, students, shown):
    roster = Roster()
    for student, name in students.items():
        roster.add(student, [name])
    bulk = archive(tmp_path / "bulk.zip", {f"{shown}_5_6_relay.py": b"x"})
    result = collect([bulk], tmp_path / "out", roster)
    assert (result.laid_out, len(result.unplaced)) == ([], 1)
    assert f"'{shown}' could be {' or '.join(students)} in the roster" in result.unplaced[0]


@pytest.mark.parametrize(
    ("others", "signed", "whose"),
    [
        ({"ada": [], "eve": ["ada"]}, "ada", "ada"),  # she chose that name on the platform
        ({"ada": [], "eve": ["ada"]}, "eve", "eve"),
        ({"ada.b": [], "adab": ["Ada"], "eve": ["ada.b"]}, "ada.b", "ada.b"),
        ({"ada.b": [], "adab": []}, "ADA B", ""),
        ({"ada": ["ok"], "eve": ["ok"]}, "ok", ""),
    ],
)
def test_the_name_of_a_folder_comes_before_what_others_are_called(tmp_path, others, signed, whose):
    roster = Roster()
    for student, names in others.items():
        roster.add(student, names)
    result = collect([made_out_to(tmp_path / "in", signed, EARLY)], tmp_path / "out", roster)
    assert [each.student for each in result.laid_out] == [whose] * bool(whose)
    assert len(result.unplaced) == (not whose)


def bomb() -> bytes:
    """A small archive of a file of 100 MB."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as writer:
        writer.writestr("relay.py", bytes(100_000_000))
    return buffer.getvalue()


def linked() -> bytes:
    buffer = io.BytesIO()
    info = zipfile.ZipInfo("relay.py")
    info.external_attr = 0o120777 << 16
    with zipfile.ZipFile(buffer, "w") as writer:
        writer.writestr(info, "/etc/passwd")
    return buffer.getvalue()


def named(name: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as writer:
        writer.writestr(name, "x")
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not a zip archive"),
        (b"PK\x03\x04" + os.urandom(50), "not a zip archive"),
        (bomb, "more than 50 MB when it is unpacked"),
        (linked, "relay.py is a link"),
        (lambda: named("../../relay.py"), "leads outside the archive"),
        (lambda: named("/etc/relay.py"), "leads outside the archive"),
        (lambda: named("..\\..\\relay.py"), "leads outside the archive"),
        (lambda: named("a/" * 50 + "relay.py"), "too deep"),
        (lambda: named("thesis.docx"), "no file for an exercise of this course, only thesis.docx"),
    ],
    ids=["empty", "noise", "bomb", "link", "up", "absolute", "backslash", "deep", "another course's"],
)
def test_a_bad_archive_is_a_line_and_stops_nobody(tmp_path, content, says):
    bad = content if isinstance(content, bytes) else content()
    bulk = archive(
        tmp_path / "bulk.zip",
        {"bad_1_2_services.zip": bad, "good_3_4_services.zip": handed_in(tmp_path / "in").read_bytes()},
    )
    result = collect([bulk], tmp_path / "out")
    assert counted(tmp_path / "out") == {"good/services"}
    assert len(result.unplaced) == 1
    assert says in result.unplaced[0]
    assert not (tmp_path / "relay.py").exists()


def test_no_student_s_name_leads_out_of_the_folder(tmp_path):
    path = handed_in(tmp_path / "in")
    with zipfile.ZipFile(path) as whole:
        content = {name: whole.read(name) for name in whole.namelist()}
    for number, student in enumerate(("../../evil", ".others", "..", "/etc", "a\nb", "x" * 1000)):
        receipt = json.loads(content["receipt.json"]) | {"student": student}
        archive(tmp_path / "in" / f"{number}.zip", content | {"receipt.json": json.dumps(receipt).encode()})
    collect([tmp_path / "in"], tmp_path / "deep" / "out")
    assert {path.name for path in tmp_path.iterdir()} == {"in", "deep"}
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["out"]
    assert counted(tmp_path / "deep" / "out") == {
        f"{name}/services" for name in ("ada", "evil", "others", "etc", "a_b", "x" * LONGEST)
    }


def test_a_full_disk_leaves_what_was_there(tmp_path, monkeypatch):
    collect([handed_in(tmp_path / "old", at=EARLY)], tmp_path / "out")
    before = laid_out(tmp_path / "out")
    new = handed_in(tmp_path / "new", "bob", at=LATER)

    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        collect([new], tmp_path / "out")
    monkeypatch.undo()
    assert laid_out(tmp_path / "out") == before


STEPS = ((storage, "_exchange"), (Path, "rename"), (os, "replace"))  # with which folders and files take their places


def stopped_at(monkeypatch, step: int, done: bool, stop: Callable[[], object]) -> None:
    """Let the `step`-th of STEPS stop the program, before it or when it is `done`."""
    count = iter(range(step, -1, -1))

    def stopping(act: Callable[..., object]) -> Callable[..., object]:
        def step(*args: object) -> object:
            last = next(count, None) == 0
            if last and not done:
                stop()
            result = act(*args)
            if last:
                stop()
            return result

        return step

    for owner, name in STEPS:
        monkeypatch.setattr(owner, name, stopping(getattr(owner, name)))


@pytest.mark.parametrize("done", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("how", ["at once", "one after the other", "killed"])
@pytest.mark.parametrize("platform", [False, True], ids=["archives", "canvas"])
def test_whenever_a_collection_is_stopped_each_student_has_the_old_hand_in_or_the_new(
    tmp_path, monkeypatch, how, done, platform
):
    """Also where a file system cannot exchange two folders; and the next collection completes it."""
    new = FILES | {"relay.py": b"new"}
    if platform:
        old_source = archive(tmp_path / "old.zip", {"ada_1_11_relay.py": FILES["relay.py"]}, EARLY)
        new_source = archive(tmp_path / "new.zip", {"ada_1_12_relay.py": b"new"})
    else:
        old_source = handed_in(tmp_path / "old", at=EARLY)
        new_source = handed_in(tmp_path / "new", at=LATER, files=new)
    if how == "one after the other":
        monkeypatch.setattr(storage, "_libc", SimpleNamespace(renameat2=lambda *args: ctypes.set_errno(EINVAL) or -1))
    for step in itertools.count():
        out = tmp_path / f"out{step}"
        collect([old_source], out)
        before = content(out / "ada/services")
        with monkeypatch.context() as patched:
            stop = killed_while if how == "killed" else interrupted_in
            stopped = stop(partial(collect, [new_source], out), patched, step, done)
        there = content(out / "ada/services")
        if there != before:
            assert there["relay.py"] == b"new" and there.keys() == before.keys()
            assert FILES["relay.py"] in laid_out(out).values()
        assert how == "killed" or counted(out) == {"ada/services"}
        with alone([new_source], out):
            collect([new_source], out)
        after = laid_out(out)
        assert counted(out) == {"ada/services"} and after["ada/services/relay.py"] == b"new"
        assert FILES["relay.py"] in after.values()
        assert provenance.read(out, "ada", "services")[-1].upload == (12 if platform else 0)
        if not stopped:
            break
    assert step >= 3


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def interrupted_in(act: Callable[[], object], monkeypatch, step: int, done: bool) -> bool:
    """Return True if Ctrl-C has stopped this at this step."""

    def interrupt() -> None:
        raise KeyboardInterrupt

    stopped_at(monkeypatch, step, done, interrupt)
    try:
        act()
    except KeyboardInterrupt:
        return True
    return False


def killed_while(act: Callable[[], object], monkeypatch, step: int, done: bool) -> bool:
    """Return True if a process that does this was stopped at this step, without any clearing up."""
    child = os.fork()
    if not child:
        try:
            stopped_at(monkeypatch, step, done, lambda: os._exit(1))
            act()
            os._exit(0)
        finally:
            os._exit(2)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, 1)
    return code == 1


def test_what_a_killed_collection_leaves_is_cleared_away_and_nothing_else(tmp_path):
    out = tmp_path / "out"
    collect([handed_in(tmp_path / "one", at=EARLY), handed_in(tmp_path / "two", at=LATER)], out)
    there = laid_out(out)
    for left in (out / "ada", out / ".others/ada/services", out / "zoe"):
        (left / f"{storage.DRAFT}0123").mkdir(parents=True)
        (left / f"{storage.DRAFT}0123/relay.py").write_text("half")
    (out / "ada/services/.part-of-the-work").mkdir()  # a student's own
    with alone([tmp_path / "one"], out):
        assert laid_out(out) == there
    assert [path.relative_to(out) for path in out.rglob(".part-*")] == [Path("ada/services/.part-of-the-work")]


def test_a_folder_that_was_laid_out_before_for_nobody_in_the_roster_is_named(tmp_path):
    roster = tmp_path / "roster.csv"
    roster.write_text("student,login\ncarl,cs99\n")
    archives = handed_in(tmp_path / "in", "cs99").parent
    assert collect([archives], tmp_path / "out").looks == []
    result = collect([archives], tmp_path / "out", read_rosters([roster]))
    assert counted(tmp_path / "out") == {"carl/services", "cs99/services"}
    assert "LOOK: collected earlier, but not in the roster: cs99. These folders are graded, too" in describe(result)
    shutil.rmtree(tmp_path / "out/cs99")
    assert collect([archives], tmp_path / "out", read_rosters([roster])).looks == []


def test_the_command_says_what_came_of_it(tmp_path):
    handed_in(tmp_path / "in")
    (tmp_path / "in" / "broken.zip").write_text("no archive")
    command = [AUTOGRADER, "collect", str(tmp_path / "in"), "--into", str(tmp_path / "out")]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 1
    assert "ada/services, 2026-11-02 09:30:00 UTC, receipt verified" in ran.stdout
    assert "broken.zip: not a zip archive" in ran.stdout
    assert "1 submission of 1 student; 1 not placed." in ran.stdout
    assert ran.stderr == ""


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nothing.zip", "--into", "out"], "there is no file or folder nothing.zip"),
        ([".", "--into", "out", "--due", "yesterday"], "'yesterday' is not a time"),
        ([".", "--into", "out", "--due", "2026-11-20 23:59"], "has no time zone"),
        ([".", "--into", "out", "--roster", "none.csv"], "none.csv cannot be read"),
    ],
)
def test_a_wrong_command_is_one_line(tmp_path, arguments, says):
    ran = subprocess.run([AUTOGRADER, "collect", *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 2
    assert says in ran.stderr
    assert "Traceback" not in ran.stderr


def made_out_to(folder: Path, name: str, at: datetime, files: dict[str, bytes] = FILES) -> Path:
    """An archive whose receipt has a name that `course hand-in` would not write so."""
    return repacked(handed_in(folder, "somebody", at, files), {"student": name})


ODD = ("ada:l", "ada;l", "ada\N{NO-BREAK SPACE}l", "ada l\N{ZERO WIDTH JOINER}", "\N{RIGHT-TO-LEFT OVERRIDE}ada l")


@pytest.mark.parametrize("other", ODD)
def test_names_that_would_share_a_folder_are_not_taken_for_one_student(tmp_path, other):
    """Not at once, and not later, when the first is laid out; a roster tells whose each is."""
    first = made_out_to(tmp_path / "first", "ada l", EARLY)
    second = made_out_to(tmp_path / "second", other, LATER, {**FILES, "relay.py": b"print('mine')\n"})
    result = collect([first, second], tmp_path / "both")
    assert (result.laid_out, len(result.unplaced)) == ([], 2)
    assert all("have the same folder, ada_l: name each in a roster (--roster)" in line for line in result.unplaced)
    assert "'ada l'" in result.unplaced[0] and ascii(other) in result.unplaced[0]

    collect([first], tmp_path / "out")
    before = laid_out(tmp_path / "out")
    assert collect([second], tmp_path / "out").laid_out == []
    assert laid_out(tmp_path / "out") == before


@pytest.mark.parametrize("other", ["ada l", "ada_l.", "ada_l\0", ["ada_l"]])
def test_of_names_that_would_share_a_folder_the_one_that_is_spelled_like_it_keeps_it(tmp_path, other):
    """At once, and whichever was laid out before."""
    mine = {**FILES, "relay.py": b"print('mine')\n"}
    own = made_out_to(tmp_path / "own", "ada_l", EARLY, mine)
    odd = made_out_to(tmp_path / "odd", other, LATER)
    for made in ([[own, odd]], [[own], [odd]], [[odd], [own]], [[odd], [odd, own], [own]]):
        out = tmp_path / "out"
        results = [collect(sources, out) for sources in made]
        laid = {each for each in laid_out(out).items() if not each[0].startswith(".others")}
        assert ("ada_l/services/relay.py", mine["relay.py"]) in laid
        unplaced = [line for result in results for line in result.unplaced]
        told = [each.remark for result in results for each in result.laid_out]
        if made[0] == [odd]:
            assert "has the same folder, and no longer counts" in str(told)
            assert b"print('relay')\n" in laid_out(out).values()  # kept
        else:
            assert len(unplaced) == 1 and unplaced[0].startswith(odd.name)
            assert "have the same folder as those of ada_l: name each in a roster (--roster)" in unplaced[0]
        shutil.rmtree(out)


@pytest.mark.parametrize("name", ["-rf", "--help", " -x", "._-x"])
def test_a_name_that_a_command_would_take_for_an_option_is_listed_and_not_laid_out(tmp_path, name):
    hostile = made_out_to(tmp_path / "hostile", name, EARLY)
    result = collect([hostile, made_out_to(tmp_path / "in", "a-b", EARLY)], tmp_path / "out")
    assert counted(tmp_path / "out") == {"a-b/services"}
    assert result.unplaced == [f"{hostile.name}: {name!r} cannot be the name of a folder"]


def test_one_student_may_write_a_name_in_two_ways_of_unicode(tmp_path):
    two = ("Zoe\N{COMBINING DIAERESIS}", "Zo\N{LATIN SMALL LETTER E WITH DIAERESIS} ")
    made = [made_out_to(tmp_path / str(at.day), name, at) for name, at in zip(two, (EARLY, LATER), strict=True)]
    result = collect(made, tmp_path / "out")
    assert (len(result.laid_out), len(result.kept), result.unplaced) == (1, 1, [])
