"""Wrong input is reported in a line, mixes up no students, and loses nothing."""

import os
import shutil
import subprocess
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from autograder.collecting.bundles import unpacked
from autograder.collecting.collect import alone, collect, describe
from autograder.errors import UsageError
from autograder.submissions import provenance
from autograder.submissions.roster import of_class, read_rosters
from course.hand_in import HandIn, write

from .test_collect import AUTOGRADER, EARLY, FILES, LATER, archive, counted, handed_in, laid_out, repacked


def test_of_two_hand_ins_in_one_second_the_second_counts_and_both_are_kept(tmp_path):
    handed_in(tmp_path / "in", files=FILES | {"relay.py": b"first"})
    handed_in(tmp_path / "in", files=FILES | {"relay.py": b"second"})
    assert len(list((tmp_path / "in").iterdir())) == 2
    for _ in range(2):  # collecting again changes nothing
        collect([tmp_path / "in"], tmp_path / "out")
        content = laid_out(tmp_path / "out")
        assert content["ada/services/relay.py"] == b"second"
        assert [value for value in content.values() if value in (b"first", b"second")].count(b"first") == 1


def test_an_exercise_of_another_course_is_not_taken_for_ours_because_of_a_file_s_name(tmp_path):
    other = write(HandIn("networks", [], {"relay.py": b"x"}, {}), tmp_path, "ada", {}, EARLY)
    result = collect([other], tmp_path / "out")
    assert (result.laid_out, counted(tmp_path / "out")) == ([], set())
    assert result.unplaced == [f"{other.name}: its receipt says 'networks', which is not an exercise in this course"]


def test_a_renamed_archive_is_known_by_its_receipt(tmp_path):
    path = handed_in(tmp_path / "in").rename(tmp_path / "in" / "my homework (final).ZIP")
    (only,) = collect([path], tmp_path / "out").laid_out
    assert (only.student, only.assignment, only.at, only.receipt) == ("ada", "services", EARLY, "verified")


def test_an_archive_in_an_archive_is_opened(tmp_path):
    path = handed_in(tmp_path / "in")
    again = archive(tmp_path / "work.zip", {f"homework/{path.name}": path.read_bytes(), "homework/readme.txt": b""})
    assert [each.student for each in collect([again], tmp_path / "mailed").laid_out] == ["ada"]
    bulk = archive(tmp_path / "bulk.zip", {"doejane_1_2_work.zip": again.read_bytes()})
    collect([bulk], tmp_path / "out")
    assert laid_out(tmp_path / "out")["doejane/services/relay.py"] == FILES["relay.py"]


def test_archives_in_each_other_have_an_end(tmp_path):
    path = handed_in(tmp_path / "in")
    for number in range(10):
        path = archive(tmp_path / f"{number}.zip", {"again.zip": path.read_bytes()})
    result = collect([path], tmp_path / "out")
    assert result.unplaced == ["9.zip: more than 3 nested archives"]


def test_a_bulk_download_that_the_browser_has_unpacked(tmp_path):
    whole = handed_in(tmp_path / "made", "x")
    folder = tmp_path / "Downloads" / "Zoë Müller_55_assignsubmission_file_"
    folder.mkdir(parents=True)
    shutil.copy(whole, folder)
    (folder / "link.py").symlink_to("/etc/passwd")
    (tmp_path / "Downloads" / "roejim_77_902_relay.py").write_bytes(b"loose")
    shutil.copy(whole, tmp_path / "Downloads" / "doejane_1_2_work.zip")
    (tmp_path / "Downloads" / "holiday.jpg").write_bytes(b"")
    result = collect([tmp_path / "Downloads"], tmp_path / "out")
    assert counted(tmp_path / "out") == {"Zoë_Müller/services", "roejim/services", "doejane/services"}
    assert result.unplaced == [
        "Zoë Müller_55_assignsubmission_file_/link.py: a link, which is not followed",
        "holiday.jpg: neither an archive nor named by a platform, so its student is unknown",
    ]


def test_two_people_of_one_name_are_not_made_one(tmp_path):
    moodle = archive(
        tmp_path / "moodle.zip",
        {
            "Jane Doe_55_assignsubmission_file_/relay.py": b"of the one",
            "Jane Doe_77_assignsubmission_file_/relay.py": b"of the other",
            "Jim Roe_56_assignsubmission_file_/relay.py": b"jim",
        },
    )
    result = collect([moodle], tmp_path / "out")
    assert counted(tmp_path / "out") == {"Jim_Roe/services"}
    assert len(result.unplaced) == 2
    assert all(
        "several students called 'Jane Doe', 55 and 77: name each in the roster" in line for line in result.unplaced
    )
    roster = tmp_path / "roster.csv"
    roster.write_text("student,number\njane1,55\njane2,77\njim,56\n")
    collect([moodle], tmp_path / "out", read_rosters([roster]))
    assert laid_out(tmp_path / "out")["jane2/services/relay.py"] == b"of the other"


def test_a_namesake_who_comes_later_is_not_made_one_with_the_first(tmp_path):
    collect([archive(tmp_path / "a.zip", {"doejane_1_2_relay.py": b"the one"})], tmp_path / "out")
    result = collect([archive(tmp_path / "b.zip", {"doejane_9_3_relay.py": b"the other"})], tmp_path / "out")
    assert "several students called 'doejane', 1 and 9" in result.unplaced[0]
    assert laid_out(tmp_path / "out")["doejane/services/relay.py"] == b"the one"


def moodle(path, **numbers):
    """A download in which each student has a number."""
    names = [f"{name}_{number}_assignsubmission_file_/relay.py" for name, number in numbers.items()]
    return archive(path, dict.fromkeys(names, path.name.encode()))


@pytest.mark.parametrize("together", [False, True])
def test_another_number_under_a_name_in_a_later_download_replaces_nobody(tmp_path, together):
    """In two downloads of one assignment Moodle has the same numbers: zoe shows that these are."""
    one, other = moodle(tmp_path / "a.zip", ada=101, zoe=103), moodle(tmp_path / "b.zip", ada=202, zoe=103)
    for sources in ([one, other],) if together else ([one], [other]):
        result = collect(sources, tmp_path / "out")
    left_out = [line for line in result.unplaced if "'ada' with the number 101" in line and "and 202 in b.zip" in line]
    assert len(left_out) == len(result.unplaced) == (2 if together else 1)
    ada = laid_out(tmp_path / "out").get("ada/services/relay.py")
    assert ada == (None if together else b"a.zip")
    assert "zoe/services" in counted(tmp_path / "out")


def test_archives_that_a_browser_has_unpacked_into_a_folder_are_one_download(tmp_path):
    def folder(name, **numbers):
        for student, number in numbers.items():
            path = handed_in(tmp_path / name, student, files=FILES | {"relay.py": name.encode()})
            path.rename(path.with_name(f"{student}_{number}_assignsubmission_file_work.zip"))
        return tmp_path / name

    collect([folder("a", ada=101, zoe=103)], tmp_path / "out")
    result = collect([folder("b", ada=202, zoe=103)], tmp_path / "out")
    assert ["'ada' with the number 101" in line for line in result.unplaced] == [True]
    result = collect([folder("c", ada=302, zoe=303)], tmp_path / "out")
    assert result.unplaced == []


def test_one_alone_with_another_number_is_left_out_and_all_of_them_are_another_assignment(tmp_path):
    collect([moodle(tmp_path / "a.zip", ada=101, zoe=103)], tmp_path / "out")
    result = collect([moodle(tmp_path / "b.zip", ada=202)], tmp_path / "out")
    assert "two people: name each in the roster, with the number" in result.unplaced[0]
    assert laid_out(tmp_path / "out")["ada/services/relay.py"] == b"a.zip"
    result = collect([moodle(tmp_path / "c.zip", ada=302, zoe=303)], tmp_path / "out")
    assert result.unplaced == []
    remarks = [each.remark for each in (*result.laid_out, *result.kept)]
    assert len(remarks) == 2 and all("are these two assignments on the platform?" in remark for remark in remarks)


def test_numbers_of_the_roster_are_believed(tmp_path):
    roster = tmp_path / "roster.csv"
    roster.write_text("student,first,second\nada,101,202\n")
    collect([moodle(tmp_path / "a.zip", ada=101)], tmp_path / "out", read_rosters([roster]))
    assert collect([moodle(tmp_path / "b.zip", ada=202)], tmp_path / "out", read_rosters([roster])).unplaced == []


def test_a_number_of_the_roster_takes_the_place_of_one_that_nobody_has_vouched_for(tmp_path):
    """Whoever calls himself Ada comes first, and later by his clock."""
    roster = tmp_path / "roster.csv"
    roster.write_text("student,moodle\nada,101\nbob,102\n")
    mallory = archive(
        tmp_path / "m.zip", {"ada_777_assignsubmission_file_/relay.py": b"of mallory"}, at=LATER + timedelta(days=9)
    )
    own = moodle(tmp_path / "own.zip", ada=101)
    for sources in ([mallory], [own], [mallory]):
        result = collect(sources, tmp_path / "out", read_rosters([roster]))
    assert laid_out(tmp_path / "out")["ada/services/relay.py"] == b"own.zip"
    assert "with the number 777, and with 101, as the roster says" in result.unplaced[0]
    result = collect([mallory, own], tmp_path / "both", read_rosters([roster]))
    assert laid_out(tmp_path / "both")["ada/services/relay.py"] == b"own.zip" and len(result.unplaced) == 1


def test_a_canvas_name_that_two_users_could_have_is_nobodys_without_a_roster_too(tmp_path):
    collect([archive(tmp_path / "a.zip", {"lovelaceada_11_900_relay.py": b"ada"})], tmp_path / "out")
    work = handed_in(tmp_path / "made", "x").read_bytes()
    result = collect([archive(tmp_path / "b.zip", {"lovelaceada_11_2020_901_work.zip": work})], tmp_path / "out")
    assert "its name could mean user 11 or 2020" in result.unplaced[0]
    assert laid_out(tmp_path / "out")["lovelaceada/services/relay.py"] == b"ada"


def test_what_came_from_nowhere_and_takes_the_place_of_a_platforms_is_marked(tmp_path):
    """Anybody can mail an archive that calls itself ada's."""
    collect([moodle(tmp_path / "a.zip", ada=101)], tmp_path / "out")
    mailed = handed_in(tmp_path / "mail", "ada", at=datetime.now(UTC), files=FILES | {"relay.py": b"mailed"})
    (laid,) = collect([mailed], tmp_path / "out").laid_out
    assert "it did not come from a platform, but replaces a hand-in from Moodle" in laid.remark


def test_a_platforms_hand_in_that_does_not_count_because_of_one_from_nowhere_is_marked(tmp_path):
    mailed = handed_in(tmp_path / "mail", "ada", at=LATER, files=FILES | {"relay.py": b"mailed"})
    collect([mailed], tmp_path / "out")
    own = archive(tmp_path / "own.zip", {"ada_101_assignsubmission_file_/relay.py": b"own"}, at=EARLY)
    (kept,) = collect([own], tmp_path / "out").kept
    assert "the one that counts did not come from a platform" in kept.remark


@pytest.mark.parametrize("name", ["0\ud800", "m\udcfcller"])
def test_a_name_that_is_no_text_stops_nobody(tmp_path, name):
    """In a receipt, and as the name of a file on a disk of elsewhere."""
    if "\udcfc" in name:
        folder = tmp_path / "in" / f"{name}_7_assignsubmission_file_"
        folder.mkdir(parents=True)
        (folder / "relay.py").write_bytes(b"of one")
    else:
        handed_in(tmp_path / "in", name)
    handed_in(tmp_path / "in", "zoe")
    result = collect([tmp_path / "in"], tmp_path / "out")
    assert "zoe/services" in counted(tmp_path / "out")
    assert len(result.laid_out) + len(result.unplaced) == 2
    describe(result).encode()
    assert collect([tmp_path / "in"], tmp_path / "out").unplaced == result.unplaced


def test_a_folder_that_its_owner_has_closed_is_listed_and_stops_nobody(tmp_path, monkeypatch):
    handed_in(tmp_path / "in", "zoe")
    (tmp_path / "in" / "ada").mkdir()
    may = os.access
    monkeypatch.setattr(os, "access", lambda path, mode, **more: Path(path).name != "ada" and may(path, mode, **more))
    result = collect([tmp_path / "in"], tmp_path / "out")
    assert counted(tmp_path / "out") == {"zoe/services"}
    assert result.unplaced == ["ada: no permission to read it: ask its owner to change that, or to remove it"]


def test_a_student_in_two_rosters_is_one_student(tmp_path):
    (tmp_path / "a.csv").write_text("student,login\nada,al12\n")
    (tmp_path / "b.csv").write_text("student,login,canvas\nada,AL12,1234\nbob,bb\n")
    roster = read_rosters([tmp_path / "a.csv", tmp_path / "b.csv"])
    assert roster.students == {"ada", "bob"}
    assert roster.find(("1234",)) == roster.find(("al12",)) == "ada"


def test_two_students_of_one_folder_in_two_rosters_are_refused(tmp_path):
    (tmp_path / "a.csv").write_text("student,login\nada,al12\n")
    (tmp_path / "b.csv").write_text("student,login\nada,zz99\n")
    with pytest.raises(UsageError, match="'ada' is in .*a.csv and in .*b.csv with another login, 'al12' and 'zz99'"):
        read_rosters([tmp_path / "a.csv", tmp_path / "b.csv"])


def test_a_clock_that_is_ahead_makes_nobody_the_newest_for_ever(tmp_path):
    future = datetime.now(UTC) + timedelta(days=700)
    path = handed_in(tmp_path / "in", at=future, files=FILES | {"relay.py": b"by a wrong clock"})
    os.utime(path, (future.timestamp(), future.timestamp()))
    before = datetime.now(UTC).replace(microsecond=0)
    result = collect([path], tmp_path / "out")
    (only,) = result.laid_out
    assert before <= only.at <= datetime.now(UTC)
    assert f"a wrong clock: its time, {future:%Y-%m-%d %H:%M} UTC, is in the future" in describe(result)
    content = laid_out(tmp_path / "out")
    collect([path], tmp_path / "out")
    assert laid_out(tmp_path / "out") == content


def test_a_clock_from_before_archives_had_a_date(tmp_path):
    path = handed_in(tmp_path / "in", at=datetime(1970, 1, 2, tzinfo=UTC))
    (only,) = collect([path], tmp_path / "out").laid_out
    assert (only.receipt, only.when) == ("verified", "time unknown")
    assert only.at.year > 1970 and "1970-01-02 00:00:00+00:00, is too long ago" in only.remark


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can make a file system")
def test_a_disk_that_is_full_loses_nothing_and_is_one_line(tmp_path):
    """Collecting onto a disk of 64 kB: what was there stays, and the rest is collected when there is room."""
    handed_in(tmp_path / "in", at=EARLY)
    small = tmp_path / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", small], capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        command = [AUTOGRADER, "collect", str(tmp_path / "in"), "--into", str(small / "out")]
        assert subprocess.run(command, capture_output=True, timeout=60).returncode == 0
        before = laid_out(small / "out")
        handed_in(tmp_path / "in", "bob", LATER, FILES | {"services.ipynb": os.urandom(100_000)})
        ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert ran.returncode == 3
        assert "No space left on device" in ran.stderr and len(ran.stderr.splitlines()) == 1
        assert laid_out(small / "out") == before
    finally:
        subprocess.run(["umount", small], check=True)


def test_an_archive_of_another_exercise_is_told_so_by_check(tmp_path):
    path = handed_in(tmp_path)
    command = [AUTOGRADER, "check", str(path), "--assignment", "calculator"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 2
    assert "is a hand-in of services, not of calculator" in ran.stderr and len(ran.stderr.splitlines()) == 1


def test_check_opens_an_archive_in_an_archive(tmp_path):
    inner = handed_in(tmp_path)
    outer = archive(tmp_path / "outer.zip", {f"my/{inner.name}": inner.read_bytes()})
    with unpacked(outer, "services") as folder:
        assert {path.name for path in Path(folder).iterdir()} == set(FILES)


def test_what_is_remembered_can_be_read_and_is_not_the_student_s(tmp_path):
    bulk = archive(tmp_path / "bulk.zip", {"doejane_LATE_1_22_relay.py": b"x", "doejane_LATE_1_23_origin.json": b"{}"})
    for _ in range(2):
        collect([bulk], tmp_path / "out")
    (source,) = provenance.read(tmp_path / "out", "doejane", "services")
    assert replace(source, at="") == provenance.Source("Canvas", "doejane", "1", "", 23, late=True, time="unknown")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [".origins", "doejane"]


@pytest.mark.parametrize("text", ["{", "[" * 200_000, "[]", '{"handed_in": ' + "1" * 6000 + "}"])
def test_a_receipt_that_cannot_be_read_is_told_from_none(tmp_path, text):
    path = repacked(handed_in(tmp_path / "in"), {"text": text}).rename(tmp_path / "x.zip")
    (line,) = collect([path], tmp_path / "out").unplaced
    assert "its receipt cannot be read, so it does not say who handed it in" in line


@pytest.mark.parametrize("when", ["NaN", "20261102", "9999-12-31T23:59:59-23:59", "2026-11-02\n2026-11-03", None])
def test_a_time_in_a_receipt_that_cannot_be_read_has_a_look(tmp_path, when):
    path = repacked(handed_in(tmp_path / "in"), {"handed_in": when})
    (only,) = collect([path], tmp_path / "out").laid_out
    assert (only.when, only.remark) == ("time unknown", "the time in its receipt cannot be read")


def test_students_names_that_look_alike_have_a_look(tmp_path):
    """Whoever hands in under a name that looks like Ada's must not be taken for her, nor she for them."""
    names = [
        "ok",
        "OK",
        "o\N{KELVIN SIGN}",
        "\N{CYRILLIC SMALL LETTER O}k",
        "\N{CYRILLIC SMALL LETTER O}",
        "Zoë",
        "李田た",
        "김민준",
        "\N{HEBREW LETTER ALEF}x",
    ]
    for number, name in enumerate(names):
        handed_in(tmp_path / "in" / str(number), name)
    looks = {each.student: each.remark for each in collect([tmp_path / "in"], tmp_path / "out").laid_out}
    cyrillic = "\N{CYRILLIC SMALL LETTER O}k"
    assert looks["ok"] == f"its student's name looks like that of OK and oK and {cyrillic}: check whose it is"
    assert "of OK and ok" in looks["oK"] and "and ok" in looks["OK"]
    assert "mixes Cyrillic and Latin letters" in looks["\N{CYRILLIC SMALL LETTER O}k"]
    assert "mixes Hebrew and Latin letters" in looks[names[-1]]
    assert not any(looks[name] for name in names[4:-1])


def test_a_pipe_in_place_of_the_roster_is_a_line(tmp_path):
    os.mkfifo(tmp_path / ".roster.csv")
    with pytest.raises(UsageError, match="is not an ordinary file"):
        of_class(tmp_path, None)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("cope", "\u0441\u043e\u0440\u0435"),
        ("llam", "lIam"),
        ("llam", "l1am"),
        ("ada", "ad\u1ea1"),
        ("ada", "ada\u3164"),
        ("ilker", "\u0131lker"),
        ("Ida", "\u0196da"),
        ("Ida", "\u01c0da"),
        ("Ida", "\ua4f2da"),
        ("ok", "\u1d0fk"),
        ("bob", "bob\u02bc"),
        ("arnold", "amold"),
    ],
)
def test_a_name_that_is_seen_as_another_is_marked_whatever_its_letters(tmp_path, one, other):
    for name in (one, other):
        handed_in(tmp_path / "in" / str(ord(name[-1])) / name, name)
    laid = collect([tmp_path / "in"], tmp_path / "out").laid_out
    assert len(laid) == 2 and all("looks like that of" in each.remark for each in laid)


def test_a_second_collection_into_the_same_folder_refuses_and_changes_nothing(tmp_path):
    handed_in(tmp_path / "in")
    (tmp_path / "roster.csv").write_text("student,login\nada,ada1\n")
    command = [AUTOGRADER, "collect", "in", "--into", "out", "--roster", "roster.csv"]
    with alone([], tmp_path / "out"):
        ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stderr) == (2, "autograder: another `autograder collect` is writing to out\n")
    assert (ran.stdout, laid_out(tmp_path / "out")) == ("", {})
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60).returncode == 0
    assert counted(tmp_path / "out") == {"ada/services"}


def test_a_source_that_does_not_exist_makes_nothing(tmp_path):
    handed_in(tmp_path / "in")
    command = [AUTOGRADER, "collect", "in", "none", "--into", "out"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stderr) == (2, "autograder: there is no file or folder none\n")
    assert not (tmp_path / "out").exists()


def test_a_file_in_place_of_the_folder_is_one_line(tmp_path):
    handed_in(tmp_path / "in")
    (tmp_path / "out").write_text("")
    command = [AUTOGRADER, "collect", "in", "--into", "out"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stderr) == (2, "autograder: cannot write to out: Not a directory\n")
