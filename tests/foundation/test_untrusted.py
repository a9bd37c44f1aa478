"""Files, archives and texts from anybody: nothing waits, nothing fills the memory, and no terminal obeys."""

import io
import os
import pty
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path

import nbformat
import pytest

from course import hand_in, registry, running_sessions
from course.errors import FeedbackError, HandInError
from course.foundation.untrusted import all_visible, read_regular, visible
from course.returned import pages

COURSE = str(Path(sys.executable).with_name("course"))
EVIL = "\x1b]52;c;cm0=\x07\x1b[2J\u202e\r[/][link=x]"
MB = 1_000_000


def zipped(name: str, content: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as writer:
        for number in range(30):
            writer.writestr(f"{number}{name}", content)
    return buffer.getvalue()


def test_a_text_in_a_page_turns_and_hides_nothing_and_has_an_end():
    assert (
        visible("as it is, ü, \u05e9\u05dc\u05d5\u05dd\n\tand on") == "as it is, ü, \u05e9\u05dc\u05d5\u05dd\n\tand on"
    )
    assert visible("\x1b[31m\u202e\ud800") == "\\x1b[31m\\x202e\\xd800"
    assert visible("a\u2028b\u200bc\ufeffd\u2060") == "a\\x2028b\\x200bc\\xfeffd\\x2060"
    assert visible("\u0646\u0645\u06cc\u200c\u062e") == "\u0646\u0645\u06cc\u200c\u062e"  # Persian needs it
    assert visible("x" * 200_000).endswith(" ... (100,000 more characters)")
    assert all_visible({"\x00": ["\u2066", 1, None, ("\x7f",)]}) == {"\\x00": ["\\x2066", 1, None, ["\\x7f"]]}


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_what_is_no_ordinary_file_keeps_nobody_waiting(tmp_path, make):
    """A page that is none, and an exercise's file that is none: told in a line, by the function and by the command."""
    (tmp_path / "feedback").mkdir()
    make(tmp_path / "feedback/page.html")
    with pytest.raises(FeedbackError, match="page.html"):
        pages.take(tmp_path / "feedback/page.html")
    assert pages.newest(tmp_path, "one") is None
    cell = nbformat.v4.new_code_cell("%%exercise relay.py\npass", metadata={"nbgrader": {"solution": True}})
    nbformat.write(nbformat.v4.new_notebook(cells=[cell]), tmp_path / "one.ipynb")
    make(tmp_path / "relay.py")
    command = [COURSE, "hand-in", str(tmp_path), "--yes", "--no-check"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 1
    assert "none of the exercise's files exists: run the cells that write relay.py" in ran.stderr
    make(tmp_path / "two.ipynb")
    with pytest.raises(HandInError, match="two.ipynb cannot be read"):
        hand_in.read(tmp_path)


def test_a_file_has_a_largest_size(tmp_path):
    (tmp_path / "large").write_bytes(b"12345")
    assert read_regular(tmp_path / "large", 5) == b"12345"
    with pytest.raises(ValueError, match="larger than"):
        read_regular(tmp_path / "large", 4)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (lambda: zipped(".html", bytes(4 * MB)), "more than 50 MB when it is unpacked"),
        (lambda: zipped(".html", bytes(4 * MB), zipfile.ZIP_BZIP2), "uses an unsupported compression"),
        (lambda: zipped(f"{EVIL}.html", b"x", zipfile.ZIP_LZMA), "uses an unsupported compression"),
        (lambda: b"PK" + os.urandom(1000), "not a zip archive that can be read"),
        (lambda: zipped(".zip", zipped(".html", b"")), "no page of feedback"),
    ],
    ids=["bomb", "bzip2", "escapes", "noise", "archives"],
)
def test_an_archive_of_feedback_costs_little_and_is_told_in_a_line(tmp_path, content, says):
    (tmp_path / "back.zip").write_bytes(content())
    tracemalloc.start()
    try:
        with pytest.raises(FeedbackError, match=says) as caught:
            pages.take(tmp_path / "back.zip")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "\x1b" not in str(caught.value)
    assert most < 100 * MB
    assert [path.name for path in tmp_path.iterdir()] == ["back.zip"]


def test_the_list_of_sessions_obeys_no_name(monkeypatch, capsys):
    """Neither the terminal's escapes nor rich's own markup, which would end the command."""
    node = registry.NodeRecord(EVIL, EVIL, True, 0.0, EVIL)
    record = registry.SessionRecord(1, 1, f"/home/{EVIL}", 0.0, 1, [node])
    monkeypatch.setattr(registry, "running", lambda: [record])
    assert running_sessions.show() == 0
    said = capsys.readouterr().out
    assert "[link=x]" in said
    assert not {"\x07", "\u202e", "\x1b", "\r"} & set(said)


SAYS = """import sys
from course.foundation.untrusted import guard_terminal
guard_terminal()
print(sys.argv[1] + chr(9) + 'end')
print(sys.argv[1], file=sys.stderr)
"""


def test_a_terminal_is_guarded_and_a_file_gets_what_was_said(tmp_path):
    command = [sys.executable, "-c", SAYS, EVIL]
    assert EVIL in subprocess.run(command, capture_output=True, timeout=60).stdout.decode()
    ours, terminals = pty.openpty()
    process = subprocess.Popen(command, stdout=terminals, stderr=terminals)
    os.close(terminals)
    said = b""
    while b"end" not in said or said.count(b"link") < 2:
        said += os.read(ours, 4096)
    assert process.wait(60) == 0
    os.close(ours)
    assert b"\\x1b]52;c;cm0=\\x07\\x1b[2J\\x202e\\x0d" in said
    assert b"\x1b" not in said and b"\x07" not in said
    assert b"\tend" in said or b" end" in said
