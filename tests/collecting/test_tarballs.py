"""Hand-ins as .tar.gz: taken as .zip is, within the same bounds; a hostile one costs its sender alone."""

import gzip
import io
import os
import random
import subprocess
import tarfile

import pytest

from autograder.collecting.archives import MAX_FILES, MAX_STUDENT, members_of
from autograder.collecting.bundles import unpacked
from autograder.collecting.collect import collect
from autograder.errors import UsageError
from autograder.submissions.roster import Roster
from course.errors import BadArchive
from course.foundation.tarball import BLOCK, LONGEST_DESCRIPTION
from course.foundation.untrusted import Allowance

from .test_collect import FILES, archive, counted, handed_in, laid_out
from .test_hostile_archives import measured

MB = 1_000_000
FORMATS = {"ustar": tarfile.USTAR_FORMAT, "GNU": tarfile.GNU_FORMAT, "pax": tarfile.PAX_FORMAT}
PLAIN, NAMED = (b"\x1f\x8b\x08" + bytes([flags]) + bytes(6) for flags in (0, 8))  # how a gzip file begins
LONG = "folder/" * 5 + "n" * 120 + "ü.py"


def entry(name: str, kind: bytes = tarfile.REGTYPE, **fields) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.type = kind
    for field, value in fields.items():
        setattr(info, field, value)
    return info


def packed(files, form=tarfile.GNU_FORMAT) -> bytes:
    """An archive of files, given as pairs of a name, or of tarfile's record of one, and a content."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz", format=form) as writer:
        for name, content in files:
            info = name if isinstance(name, tarfile.TarInfo) else entry(name)
            info.size = len(content)
            writer.addfile(info, io.BytesIO(content))
    return buffer.getvalue()


def raw(*headers: tuple[dict[str, object], bytes]) -> bytes:
    """An archive of entries as they should not be: fields of a header, whose sum is right, and what follows it."""
    content = b""
    for given, body in headers:
        fields = dict(given)
        info = entry(str(fields.pop("name", "relay.py")), fields.pop("kind", tarfile.REGTYPE))
        header = bytearray(info.tobuf(tarfile.GNU_FORMAT)[:BLOCK])
        size = fields.get("size", f"{len(body):011o}\0".encode())
        header[124:136] = size
        header[148:156] = b" " * 8
        header[148:156] = f"{sum(header):06o}\0 ".encode()
        content += bytes(header) + body + bytes(-len(body) % BLOCK)
    return gzip.compress(content + bytes(2 * BLOCK))


def sparse() -> bytes:
    """A file of 1 TB that has nothing in it, as GNU tar writes it in an extended header."""
    info = entry("relay.py", pax_headers={"GNU.sparse.major": "1", "GNU.sparse.realsize": "1000000000000"})
    return packed([(info, b"0\n")], tarfile.PAX_FORMAT)


HOSTILE = {
    "a bomb": (lambda: packed([("relay.py", bytes(200 * MB))]), "more than 50 MB when it is unpacked"),
    "a bomb in archives": (
        lambda: packed([("again.tgz", packed([("relay.py", bytes(40 * MB))])), ("filling", bytes(40 * MB))]),
        "more than 50 MB when it is unpacked",
    ),
    "many files": (lambda: packed([(f"{n}", b"") for n in range(5000)]), f"more than {MAX_FILES:,} files"),
    "many descriptions": (
        lambda: raw(*[({"kind": tarfile.GNUTYPE_LONGNAME}, b"x")] * 5000),
        "its headers are too long",
    ),
    "a long description": (
        lambda: raw(({"kind": tarfile.XHDTYPE}, b"1" * (LONGEST_DESCRIPTION + 1))),
        "its headers are too long",
    ),
    "a damaged description": (lambda: raw(({"kind": tarfile.XHDTYPE}, b"0 path=x\n" * 9)), "a header in it is"),
    "no size": (lambda: raw(({"size": b"nonsense    "}, b"")), "it is damaged, or no tar archive"),
    "a size below zero": (lambda: raw(({"size": b"\xff" * 12}, b"")), "it is damaged, or no tar archive"),
    "an octal size below zero": (  # the folder before it would be read again, and again
        lambda: raw(({"name": "x/", "kind": tarfile.DIRTYPE, "size": b"-0000001000\0"}, b"")),
        "it is damaged, or no tar archive",
    ),
    "a size with underscores": (lambda: raw(({"size": b"0_0_0_0_0_0\0"}, b"")), "it is damaged, or no tar archive"),
    "a size without end": (lambda: raw(({"size": b"\x80" + b"\xff" * 11}, b"")), "it ends too early"),
    "cut": (lambda: packed([("relay.py", os.urandom(5000))])[:3000], "not a .tar.gz archive that can be read"),
    "damage": (lambda: gzip.compress(b"relay.py" * 1000), "it is damaged, or no tar archive"),
    "nothing": (lambda: gzip.compress(b""), "it is empty"),
    "parts without end": (lambda: gzip.compress(b"") * 20_000, "too much of it unpacks to nothing"),
    "parts of a byte": (lambda: gzip.compress(b"x" * 1000) * 3_000, "too much of it unpacks to nothing"),
    "a long name in gzip's header": (lambda: NAMED + b"n" * 400_000, "too much of it unpacks to nothing"),
    "blocks of nothing": (lambda: PLAIN + b"\0\0\0\xff\xff" * 80_000, "too much of it unpacks to nothing"),
    "sparse": (sparse, "relay.py is not an ordinary file"),
    "a link": (lambda: packed([(entry("relay.py", tarfile.SYMTYPE, linkname="/etc/passwd"), b"")]), "is a link"),
    "a hard link": (lambda: packed([(entry("relay.py", tarfile.LNKTYPE, linkname="/etc/passwd"), b"")]), "is a link"),
    "a device": (lambda: packed([(entry("relay.py", tarfile.BLKTYPE), b"")]), "relay.py is not an ordinary file"),
    "a pipe": (lambda: packed([(entry("relay.py", tarfile.FIFOTYPE), b"")]), "relay.py is not an ordinary file"),
    "twice": (lambda: packed([("relay.py", b"a"), ("./relay.py", b"b")]), "relay.py is in the archive twice"),
    "up": (lambda: packed([("../../relay.py", b"x")]), "the path ../../relay.py leads outside the archive"),
    "absolute": (lambda: packed([("/tmp/relay.py", b"x")]), "the path /tmp/relay.py leads outside the archive"),
    "a zero byte": (
        lambda: raw(({"kind": tarfile.GNUTYPE_LONGNAME}, b"relay.py\0txt\0"), ({}, b"x")),
        "the path relay.py\\x00txt leads outside the archive",
    ),
    "deep": (lambda: packed([("a/" * 500 + "relay.py", b"x")]), "a/ ... is nested too deeply"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_archive_costs_its_sender_alone(tmp_path, name):
    make, says = HOSTILE[name]
    good = handed_in(tmp_path / "in").read_bytes()
    bulk = archive(
        tmp_path / "bulk.zip",
        {"good_3_4_services.zip": good, "bad_1_2_services.tar.gz": make(), "last_5_6_services.zip": good},
    )
    small = len(bulk.read_bytes())
    result, most = measured(lambda: collect([bulk], tmp_path / "out"))
    assert counted(tmp_path / "out") == {"good/services", "last/services"}
    (said,) = result.unplaced
    assert says in said and len(said) < 600
    assert most < 2.5 * MAX_STUDENT + 3 * small
    (tmp_path / "bad.tgz").write_bytes(make())
    with pytest.raises(UsageError) as caught, unpacked(tmp_path / "bad.tgz", "services"):
        pass
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("bound", "name"), [("MAX_CLASS", "student{0}_{0}_1_work.tar.gz"), ("MAX_UNNAMED", "student{0}.tar.gz")]
)
def test_many_in_one_archive_have_a_bound_together(tmp_path, monkeypatch, bound, name):
    """That of a class, or a lower one if no platform has named anybody: the archive may be one student's."""
    monkeypatch.setattr(f"autograder.collecting.bundles.{bound}", 10 * MB)
    bomb = gzip.compress(gzip.decompress(packed([("relay.py", b"x")])) + bytes(4 * MB))  # of no file in it
    roster = Roster()
    for number in range(4):
        roster.add(f"student{number}", [])
    bulk = archive(tmp_path / "bulk.zip", {name.format(number): bomb for number in range(4)})
    result = collect([bulk], tmp_path / "out", roster)
    assert [each.student for each in result.laid_out] == ["student0", "student1"]
    assert [line.partition(": ")[2] for line in result.unplaced] == ["more than 10 MB when it is unpacked"] * 2


@pytest.mark.parametrize("after", [b"", bytes(10_000), gzip.compress(b"")], ids=["nothing", "zeros", "a part"])
def test_several_parts_and_a_filled_last_block_are_read(after):
    content = gzip.decompress(packed([("relay.py", os.urandom(3 * MB))]))
    parts = b"".join(gzip.compress(content[at : at + 65_280]) for at in range(0, len(content), 65_280))
    (found,) = members_of(parts + after, "ada.tgz", Allowance(MAX_STUDENT))
    assert found.content == content[BLOCK : BLOCK + 3 * MB]


@pytest.mark.parametrize("form", FORMATS.values(), ids=FORMATS)
def test_what_programs_write_is_read(form):
    names = ["a.py", "folder/b.py"] + ([LONG] if form != tarfile.USTAR_FORMAT else ["folder/" * 5 + "n" * 90 + ".py"])
    files = [(entry(name, mtime=1.7e9 + 0.5), name.encode() * 300) for name in names]
    files.insert(1, (entry("folder", tarfile.DIRTYPE), b""))
    found = members_of(packed(files, form), "ada.tar.gz", Allowance(MAX_STUDENT))
    assert {str(each.path): each.content for each in found} == {name: name.encode() * 300 for name in names}
    assert {f"{each.changed:%Y-%m-%d %H:%M}" for each in found} == {"2023-11-14 22:13"}


def test_the_commands_take_it_as_they_take_zip(tmp_path):
    """Made by tar, as a student makes it: around the folder, and named as the student."""
    work = tmp_path / "services"
    work.mkdir()
    for name, content in FILES.items():
        (work / name).write_bytes(content)
    (tmp_path / "in").mkdir()
    subprocess.run(["tar", "czf", "in/ada.tar.gz", "services"], cwd=tmp_path, check=True)
    with unpacked(tmp_path / "in" / "ada.tar.gz", "services") as folder:
        assert (folder / "relay.py").exists()
    roster = Roster()
    roster.add("ada", [])
    result = collect([tmp_path / "in"], tmp_path / "out", roster)
    assert result.unplaced == [] and counted(tmp_path / "out") == {"ada/services"}
    assert laid_out(tmp_path / "out")["ada/services/relay.py"] == (work / "relay.py").read_bytes()


def test_damage_of_any_kind_is_a_bad_archive_or_another_content():
    draw = random.Random(1)
    plain = gzip.decompress(packed([("relay.py", b"x" * 600), (LONG, b"y")], tarfile.PAX_FORMAT))
    for _ in range(1000):
        changed = bytearray(plain)
        for _ in range(draw.randint(1, 4)):
            changed[draw.randrange(len(plain))] = draw.randrange(256)
        try:
            members_of(gzip.compress(bytes(changed), 0), "ada.tgz", Allowance(MB))
        except BadArchive as error:
            assert str(error.args[0])
