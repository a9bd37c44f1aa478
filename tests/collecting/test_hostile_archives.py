"""Archives that are made to cost much, to be taken for another's, or to lead elsewhere: each costs its sender alone."""

import contextlib
import io
import os
import struct
import sys
import tracemalloc
import zipfile
from datetime import timedelta
from pathlib import Path, PurePosixPath

import pytest

import autograder.cli
import course.cli
from autograder.collecting.archives import MAX_STUDENT
from autograder.collecting.bundles import unpacked
from autograder.collecting.collect import collect, describe
from autograder.errors import UsageError
from autograder.platforms import origin
from autograder.submissions.roster import Roster
from course.errors import FeedbackError
from course.foundation import untrusted
from course.returned import pages

from .test_collect import EARLY, FILES, LATER, archive, counted, handed_in, laid_out

MB = 1_000_000
TABLE, LOCAL, END = b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06"  # how the parts of a zip archive begin


def zipped(files, method=zipfile.ZIP_DEFLATED) -> bytes:
    """An archive of files, given as pairs of a name, or of zipfile's record of one, and a content."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method, compresslevel=1) as writer:
        for name, content in files:
            writer.writestr(name, content)
    return buffer.getvalue()


def kind(mode: int) -> bytes:
    info = zipfile.ZipInfo("relay.py")
    info.external_attr = mode << 16
    return zipped([(info, "/etc/passwd")])


def changed(content: bytes, part: bytes, offset: int, value: bytes) -> bytes:
    """An archive with something else in each of its parts of a kind."""
    at = content.find(part)
    while at >= 0:
        content = content[: at + offset] + value + content[at + offset + len(value) :]
        at = content.find(part, at + 1)
    return content


def with_password() -> bytes:
    plain = zipped([("relay.py", b"x" * 100)])
    return changed(changed(plain, TABLE, 8, b"\1\0"), LOCAL, 6, b"\1\0")


def overlapping() -> bytes:
    """A thousand entries that are one and the same file of 1 MB: 1 GB out of 100 kB."""
    one = zipped([("relay.py", bytes(MB))])
    start, end = one.find(TABLE), one.find(END)
    entry = one[start:end]
    entries = b"".join(changed(entry, b"relay.py", 0, f"{number:08}".encode()) for number in range(1000))
    return one[:start] + entries + END + struct.pack("<HHHHLLH", 0, 0, 1000, 1000, len(entries), start, 0)


def many(count: int) -> bytes:
    return zipped([(f"{number}", b"") for number in range(count)], zipfile.ZIP_STORED)


def says_less() -> bytes:
    """A file of 100 MB that the table of contents calls one of 10 bytes."""
    return changed(zipped([("relay.py", bytes(100 * MB))]), TABLE, 24, struct.pack("<L", 10))


def says_more() -> bytes:
    return changed(zipped([("relay.py", b"short")]), TABLE, 24, struct.pack("<L", 2**31))


def zip64_lie() -> bytes:
    """A table of contents that is said to have 2**62 bytes."""
    plain = zipped([("relay.py", b"x")])
    at = plain.find(END)
    record = b"PK\x06\x06" + struct.pack("<QHHLLQQQQ", 44, 45, 45, 0, 0, 1, 1, 2**62, 0)
    locator = b"PK\x06\x07" + struct.pack("<LQL", 0, at, 1)
    return (
        plain[:at] + record + locator + END + struct.pack("<HHHHLLH", 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0)
    )


def large_table() -> bytes:
    """A table of contents of 12 MB, by long comments."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as writer:
        for number in range(200):
            info = zipfile.ZipInfo(f"{number}")
            info.comment = bytes(60_000)
            writer.writestr(info, b"")
    return buffer.getvalue()


def nested_bomb() -> bytes:
    """Three archives around each other, each of 40 MB when it is unpacked."""
    content = zipped([("relay.py", bytes(40 * MB))])
    for _ in range(3):
        content = zipped([("again.zip", content), ("filling", bytes(40 * MB))])
    return content


def twice() -> bytes:
    with contextlib.suppress(UserWarning):
        return zipped([("relay.py", b"what one sees"), ("./relay.py", b"what is graded")])


def nameless() -> bytes:
    """A file whose name the table of contents takes for a comment."""
    return changed(changed(zipped([("relay.py", b"x")]), TABLE, 28, b"\0\0"), TABLE, 32, b"\x08\0")


def damaged() -> bytes:
    return changed(zipped([("relay.py", os.urandom(1000))]), LOCAL, 50, b"\xff\xff\xff")


HOSTILE = {
    "a bomb": (lambda: zipped([("relay.py", bytes(200 * MB))]), "more than 50 MB when it is unpacked"),
    "many files of zeros": (
        lambda: zipped([(f"{number}.py", bytes(MB)) for number in range(200)]),
        "more than 50 MB when it is unpacked",
    ),
    "a bomb in archives": (nested_bomb, "more than 50 MB when it is unpacked"),
    "one file as a thousand": (overlapping, "not a zip archive that can be read"),
    "bzip2": (
        lambda: zipped([("relay.py", bytes(100 * MB))], zipfile.ZIP_BZIP2),
        "relay.py uses an unsupported compression: create an ordinary zip archive",
    ),
    "LZMA": (lambda: zipped([("relay.py", b"x")], zipfile.ZIP_LZMA), "relay.py uses an unsupported compression"),
    "many files": (lambda: many(3_000), "more than 1,000 files"),
    "a large table of contents": (large_table, "too many files in it"),
    "a smaller size": (says_less, "not a zip archive that can be read"),
    "a larger size": (says_more, "more than 50 MB when it is unpacked"),
    "ZIP64": (zip64_lie, "not a zip archive that can be read"),
    "a link": (lambda: kind(0o120777), "relay.py is a link"),
    "a device": (lambda: kind(0o020666), "relay.py is not an ordinary file"),
    "a pipe": (lambda: kind(0o010666), "relay.py is not an ordinary file"),
    "a password": (with_password, "relay.py needs a password"),
    "twice": (twice, "relay.py is in the archive twice"),
    "no name": (nameless, "a file in it has no name"),
    "damage": (damaged, "not a zip archive that can be read"),
    "up": (lambda: zipped([("../../relay.py", "x")]), "the path ../../relay.py leads outside the archive"),
    "up, by backslashes": (lambda: zipped([("..\\..\\relay.py", "x")]), "leads outside the archive"),
    "absolute": (lambda: zipped([("/tmp/relay.py", "x")]), "the path /tmp/relay.py leads outside the archive"),
    "deep": (lambda: zipped([("a/" * 5000 + "relay.py", "x")]), "a/ ... is nested too deeply"),
    "a long name": (lambda: zipped([("n" * 60_000, "x")]), "only nnnnnn"),
    "a zero byte": (
        lambda: zipped([("relay.pyXtxt", "x")]).replace(b"relay.pyXtxt", b"relay.py\0txt"),
        "the path relay.py\\x00txt leads outside the archive",
    ),
    "escapes": (lambda: zipped([("\x1b]0;owned\x07\x1b]52;c;cm0gLXJm\x07\u202e\r", "x")]), "only \\x1b]0;owned\\x07"),
    "lines": (lambda: zipped([("x\nCollected:\n  jim, 20 of 20", "x")]), "only x\\x0aCollected:\\x0a"),
    "the names of devices": (lambda: zipped([("CON", "x"), ("C:relay.py", "x")]), "only C:relay.py, CON"),
    "Latin-1": (lambda: zipped([("\u00ff.py", "x")]).replace("\u00ff".encode(), b"\xff\xfe"), "not a zip archive"),
    "tar": (lambda: b"relay.py".ljust(100, b"\0") + bytes(10_000), "not a zip archive that can be read"),
    "two archives, the first cut": (
        lambda: zipped([("relay.py", b"x")])[:60] + zipped([("other.py", b"x")]),
        "only other.py",
    ),
}


@pytest.fixture(scope="module", params=HOSTILE, ids=str)
def hostile(request):
    """A hostile archive, and what is said of it."""
    make, says = HOSTILE[request.param]
    return make(), says


def measured(work):
    """Return the result of `work`, and the largest amount of memory (bytes) that it had at a time."""
    tracemalloc.start()
    try:
        return work(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.fixture
def read_bytes(monkeypatch):
    """The numbers of bytes that were unpacked, as a list."""
    counts: list[int] = []
    real = zipfile.ZipExtFile.read

    def read(self, n=-1):
        content = real(self, n)
        counts.append(len(content))
        return content

    monkeypatch.setattr(zipfile.ZipExtFile, "read", read)
    return counts


def test_a_hostile_archive_costs_its_sender_alone(tmp_path, hostile, read_bytes):
    content, says = hostile
    good = handed_in(tmp_path / "in").read_bytes()
    bulk = archive(
        tmp_path / "bulk.zip",
        {"good_3_4_services.zip": good, "bad_1_2_services.zip": content, "last_5_6_services.zip": good},
    )
    small = len(bulk.read_bytes())
    result, most = measured(lambda: collect([bulk], tmp_path / "out"))
    assert counted(tmp_path / "out") == {"good/services", "last/services"}
    assert len(result.unplaced) == 1
    assert says in result.unplaced[0]
    assert len(result.unplaced[0]) < 600
    assert {path.name for path in tmp_path.iterdir()} == {"in", "bulk.zip", "out"}
    assert most < 2.5 * MAX_STUDENT + 3 * small
    assert sum(read_bytes) < 1.1 * MAX_STUDENT + 3 * small


def test_check_says_the_same_of_it_in_a_line(tmp_path, hostile):
    content, says = hostile
    (tmp_path / "bad.zip").write_bytes(content)
    if says.startswith("only "):  # it can be read, and has no file of the exercise
        with unpacked(tmp_path / "bad.zip", "services") as folder:
            assert list(folder.iterdir()) == []
        return
    with pytest.raises(UsageError) as caught, unpacked(tmp_path / "bad.zip", "services"):
        pass
    assert says in str(caught.value)


def of_pages(content: bytes) -> bytes:
    """The archive with pages in place of programs: `course feedback` reads nothing else."""
    assert b"relay.py" in content
    return content.replace(b"relay.py", b"ray.html")


@pytest.mark.parametrize(
    "name",
    [
        "a bomb",
        "bzip2",
        "LZMA",
        "a smaller size",
        "a larger size",
        "a link",
        "a device",
        "a pipe",
        "a password",
        "damage",
    ],
)
def test_feedback_refuses_pages_in_it_for_the_same_reason(tmp_path, name, read_bytes):
    make, says = HOSTILE[name]
    (tmp_path / "bad.zip").write_bytes(of_pages(make()))
    with pytest.raises(FeedbackError, match="bad.zip cannot be unpacked: ") as caught:
        pages.take(tmp_path / "bad.zip")
    assert says.replace("relay.py", "ray.html") in str(caught.value)
    assert sum(read_bytes) <= pages.LARGEST_ARCHIVE


@pytest.mark.parametrize(
    "name", ["one file as a thousand", "up", "up, by backslashes", "absolute", "deep", "a zero byte"]
)
def test_feedback_takes_nothing_for_a_page_that_is_none(tmp_path, name, read_bytes):
    content = HOSTILE[name][0]()
    (tmp_path / "bad.zip").write_bytes(of_pages(content) if b"relay.py" in content else content)
    with pytest.raises(FeedbackError, match="contains no page of feedback|cannot be unpacked"):
        pages.take(tmp_path / "bad.zip")
    assert sum(read_bytes) <= pages.LARGEST_ARCHIVE


def test_the_commands_end_with_one_line_and_write_nothing(tmp_path, capsys, monkeypatch):
    """As a person types them; what a name would do to the terminal is shown instead."""
    (tmp_path / "bomb.zip").write_bytes(HOSTILE["a bomb in archives"][0]())
    (tmp_path / "\x1b]0;owned\x07.zip").write_bytes(HOSTILE["a link"][0]())
    (tmp_path / "page.zip").write_bytes(of_pages(HOSTILE["a bomb"][0]()))
    before = sorted(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    for path in before:
        for main, words, status in (
            (autograder.cli.main, ["autograder", "check", str(path), "--assignment", "services"], 2),
            (course.cli.main, ["course", "feedback", str(path)], 1),
        ):
            monkeypatch.setattr(sys, "argv", words)
            with pytest.raises(SystemExit) as ended:
                main()
            ran = capsys.readouterr()
            assert ended.value.code == status
            assert (ran.out, len(ran.err.splitlines())) == ("", 1)
            assert "\x1b" not in ran.err and "\x07" not in ran.err
            assert ("more than 50 MB" in ran.err) == (
                path.name == "page.zip" or (path.name == "bomb.zip" and status == 2)
            )
            assert ".zip" in ran.err and "Traceback" not in ran.err
    assert sorted(tmp_path.iterdir()) == before


def test_what_is_printed_obeys_no_name(tmp_path):
    names = ("escapes", "lines")
    for name in names:
        (tmp_path / f"{name}.zip").write_bytes(HOSTILE[name][0]())
    said = describe(collect([tmp_path], tmp_path / "out"))
    assert "\x1b" not in said and "\u202e" not in said
    assert len(said.splitlines()) == 1 + len(names) + 1


def test_an_archive_that_a_platform_named_is_one_student_s_whatever_is_in_it(tmp_path):
    """A browser has unpacked the download; what one student called like another's upload stays their own."""
    (tmp_path / "Downloads").mkdir()
    archive(tmp_path / "Downloads" / "doejane_1_2_work.zip", {"relay.py": b"jane", "roejim_77_902_relay.py": b""})
    result = collect([tmp_path / "Downloads"], tmp_path / "out")
    assert counted(tmp_path / "out") == {"doejane/services"}
    assert result.unplaced == []


@pytest.mark.parametrize(
    "name",
    [
        "Jane Doe_57_assignsubmission_file_Jim Roe_77_assignsubmission_file_relay.py",
        "doejane_57_58_Jim Roe_77_assignsubmission_file_relay.py",
        f"doejane_57_{'9' * 5000}_relay.py",
        f"{'doejane' * 40}_57_901_relay.py",
    ],
    ids=["Moodle", "Canvas", "digits without end", "a name that no disk keeps"],
)
def test_a_file_s_name_makes_nobody_another_student(tmp_path, name):
    assert origin(PurePosixPath(name)) is None
    roster = Roster()
    roster.add("jim", ["77"])
    roster.add("jane", ["57"])
    bulk = archive(tmp_path / "bulk.zip", {name: b"not jim's", "roejim_77_901_relay.py": b"jim's"})
    result = collect([bulk], tmp_path / "out", roster)
    assert laid_out(tmp_path / "out")["jim/services/relay.py"] == b"jim's"
    assert counted(tmp_path / "out") == {"jim/services"}
    assert "its name matches neither Canvas nor Moodle" in result.unplaced[0]


def test_one_large_or_odd_file_in_a_bulk_download_costs_only_itself(tmp_path):
    link = zipfile.ZipInfo("Eve_3_assignsubmission_file_/relay.py")
    link.external_attr = 0o120777 << 16
    bulk = tmp_path / "moodle.zip"
    bulk.write_bytes(
        zipped(
            [
                ("Jane Doe_1_assignsubmission_file_/relay.py", FILES["relay.py"]),
                ("Jim Roe_2_assignsubmission_file_/video.mp4", bytes(60 * MB)),
                ("Jim Roe_2_assignsubmission_file_/relay.py", FILES["relay.py"]),
                (link, "/etc/passwd"),
                ("../Ann_4_assignsubmission_file_/relay.py", "x"),
                ("Bob_5_assignsubmission_file_/relay.py", FILES["relay.py"]),
            ]
        )
    )
    result, most = measured(lambda: collect([bulk], tmp_path / "out"))
    assert counted(tmp_path / "out") == {"Jane_Doe/services", "Jim_Roe/services", "Bob/services"}
    said = sorted(line.partition(": ")[2] for line in result.unplaced)
    assert said == [
        "Eve_3_assignsubmission_file_/relay.py is a link",
        "more than 50 MB when it is unpacked",
        "the path ../Ann_4_assignsubmission_file_/relay.py leads outside the archive",
    ]
    assert most < 10 * MB


def test_a_class_of_bombs_fits_into_memory(tmp_path):
    """Five students with 40 MB each of what an exercise takes: memory follows what was handed in, not its size."""
    bomb = zipped([("relay.py", bytes(40 * MB))])
    bulk = archive(tmp_path / "bulk.zip", {f"student{number}_{number}_1_work.zip": bomb for number in range(5)})
    result, most = measured(lambda: collect([bulk], tmp_path / "out"))
    assert len(result.laid_out) == 5
    assert most < 3 * MAX_STUDENT


def test_a_bulk_download_has_a_bound_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr("autograder.collecting.bundles.MAX_CLASS", 10 * MB)
    bomb = zipped([("relay.py", bytes(4 * MB))])
    bulk = archive(tmp_path / "bulk.zip", {f"student{number}_{number}_1_work.zip": bomb for number in range(4)})
    result = collect([bulk], tmp_path / "out")
    assert [each.student for each in result.laid_out] == ["student0", "student1"]
    assert [line.partition(": ")[2] for line in result.unplaced] == ["more than 10 MB when it is unpacked"] * 2


def test_a_large_source_is_not_read_whole(tmp_path):
    """A sparse file of 3 GB with an archive at its end, as a bulk download may be large."""
    inside = zipped([("doejane_1_2_relay.py", FILES["relay.py"])])
    with (tmp_path / "bulk.zip").open("wb") as file:
        file.seek(3000 * MB)
        file.write(inside)
    result, most = measured(lambda: collect([tmp_path / "bulk.zip"], tmp_path / "out"))
    assert [each.student for each in result.laid_out] == ["doejane"]
    assert most < 10 * MB


def of_several(path: Path, name: str, students: int) -> Path:
    """An archive with one archive of `course hand-in` of each of so many students, and an older one of the first."""
    files = {}
    for number in range(students):
        made = handed_in(path.with_suffix(""), f"st{number}")
        files[name.format(number)] = made.read_bytes()
    files[f"again/{name.format(0)}"] = handed_in(path.with_suffix(""), "st0", EARLY - timedelta(1)).read_bytes()
    return archive(path, files)


def test_who_is_in_an_archive_of_several_students_is_told_and_bounded_unless_it_is_known_who_they_are(
    tmp_path, monkeypatch
):
    """One person may have invented them all, if no platform has named them and there is no roster."""
    monkeypatch.setattr("autograder.collecting.collect.MOST_UNNAMED", 3)
    several = of_several(tmp_path / "several.zip", "{}.zip", 3)
    other = handed_in(tmp_path / "mail", "st1", LATER)
    result = collect([several, other], tmp_path / "several")
    said = "several.zip has hand-ins of 3 students, and no platform has named them: did one person send it?"
    assert result.looks == [said] and f"LOOK: {said}" in describe(result).splitlines()
    assert counted(tmp_path / "several") == {f"st{number}/services" for number in range(3)}

    many = of_several(tmp_path / "many.zip", "{}.zip", 4)
    result = collect([many, other], tmp_path / "many")
    assert counted(tmp_path / "many") == {"st1/services"} and result.laid_out[0].source == other.name
    assert not result.kept and not result.looks
    (line,) = result.unplaced
    assert line.startswith("many.zip: nothing from it was collected, because it has hand-ins of 4 students, and no ")

    roster = Roster()
    for number in range(4):
        roster.add(f"st{number}", [])
    alone = of_several(tmp_path / "alone.zip", "{}.zip", 1)
    moodle = of_several(tmp_path / "moodle.zip", "St {0}_1{0}_assignsubmission_file_/{0}.zip", 4)
    with zipfile.ZipFile(many) as whole:
        whole.extractall(tmp_path / "unpacked")
    known = [([many], roster, 4), ([alone], None, 1), ([moodle], None, 4), ([tmp_path / "unpacked"], None, 4)]
    for number, (sources, names, students) in enumerate(known):
        result = collect(sources, tmp_path / f"known{number}", names)
        assert (len(result.laid_out), result.looks, result.unplaced) == (students, [], [])


def test_a_table_of_contents_is_bounded(monkeypatch):
    monkeypatch.setattr(untrusted, "MOST_DIRECTORY", 1000)
    with pytest.raises(untrusted.BadArchive, match="too many files in it"):
        untrusted.Archive(io.BytesIO(many(100)))
