"""Submissions that are broken or hostile: each gets its status and a message, and leaves nothing behind."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from autograder.records import CRASHED, GRADED, INVALID_SUBMISSION, NOT_RUN, PASSED, TIMED_OUT
from autograder.submissions import listing, notebook, reading
from tests import chosen
from tests.hidden.answers import services
from tests.hidden.answers.calculator import CLIENT, REFERENCE, SERVER, SRV
from tests.processes import programs_left

AUTOGRADER = [str(Path(sys.executable).with_name("autograder"))]
FILES = (SRV, SERVER, CLIENT)
NEEDS_SERVER = ("test_status", "test_enable_and_disable")
NEEDS_NONE = ("test_relay_sends_parameters", "test_changed_parameters")
QUICK = "0.35"  # of the usual patience: a silent program is given up on sooner

# Motors that do not work, the outcome of the server's tests, and a pattern of what the student is told.
SERVERS = {
    "syntax": ("def main(:\n    pass\n", CRASHED, r"SyntaxError: invalid syntax \(motor_service.py, line 1\)"),
    "ends": ("print('hello')\n", CRASHED, "ended by itself right after its start"),
    "raises": ("import nothing_of_that_name\n", CRASHED, "ModuleNotFoundError: No module named 'nothing_of_that_name'"),
    "never_starts": ("import time\ntime.sleep(1000)\n", TIMED_OUT, "no node appeared"),
    "prints": ("while True:\n    print('x' * 1000)\n", CRASHED, "printed more than 64 MiB"),
    "forks": (
        "import os, time\nwhile True:\n    try:\n        os.fork()\n    except OSError:\n        time.sleep(0.1)\n",
        CRASHED,
        "it (started 64|kept 5) processes",  # on a busy machine it is ended before it has 64
    ),
    "takes_memory": ("kept = []\nwhile True:\n    kept.append(bytes(1 << 24))\n", CRASHED, "MemoryError"),
    "takes_memory_in_parts": (
        "import os, time\nos.fork()\nos.fork()\nkept = [os.urandom(1) * (400 << 20)]\ntime.sleep(99)\n",
        CRASHED,
        "more than 1 GiB of memory",
    ),
    "daemon": (
        (
            "import os, signal, sys, time\nif os.fork():\n    sys.exit()\nos.setsid()\n"
            "for number in range(1, 32):\n    try:\n        signal.signal(number, signal.SIG_IGN)\n"
            "    except OSError:\n        pass\nif os.fork():\n    sys.exit()\ntime.sleep(1000)\n"
        ),
        CRASHED,
        "ended by itself right after its start",
    ),
    "stops_itself": ("import os, signal\nos.kill(os.getpid(), signal.SIGSTOP)\n", TIMED_OUT, "no node appeared"),
}


# Belong to the matrix: tests/hidden has programs that raise, tests/attacks memory in several processes, and daemons.
ALIKE = {"raises", "takes_memory_in_parts", "daemon"}


def write(folder: Path, files: dict[str, bytes]) -> Path:
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder


@pytest.fixture
def handed_in(tmp_path) -> Path:
    return write(tmp_path / "student" / "calculator", REFERENCE)


def problems(folder: Path) -> str:
    read = reading.read(folder, "student", "calculator", FILES)
    assert read.problems and not read.files
    return " ".join(read.problems)


def test_reads_only_what_is_wanted(handed_in):
    (handed_in / "conftest.py").write_text("raise SystemExit")
    read = reading.read(handed_in, "student", "calculator", FILES)
    assert read.problems == [] and read.files == REFERENCE


def test_missing_file(handed_in):
    (handed_in / SRV).rename(handed_in / "calculate.srv")
    (handed_in / CLIENT).unlink()
    assert "Missing: Calculate.srv (there is calculate.srv: capital" in problems(handed_in)
    assert "calculator_client.py" in problems(handed_in)


def test_files_in_a_folder_inside(handed_in):
    """As many a zip has them."""
    (handed_in / "calculator").mkdir()
    for name in (SRV, SERVER, CLIENT):
        (handed_in / name).rename(handed_in / "calculator" / name)
    assert "What is in the folder calculator does not count" in problems(handed_in)


def test_folder_for_a_file(handed_in):
    (handed_in / SERVER).unlink()
    (handed_in / SERVER).mkdir()
    assert "calculator_server.py is a folder" in problems(handed_in)


def test_a_folder_named_in_latin_1_inside_is_told_in_text_that_can_be_written(tmp_path):
    folder = write(tmp_path / "student" / "calculator", {})
    (folder / os.fsdecode("J\u00f6rg".encode("latin-1"))).mkdir()
    assert b"J?rg" in problems(folder).encode()


def test_a_student_s_folder_named_in_latin_1_is_listed_and_stops_nobody(tmp_path):
    write(tmp_path / "ada" / "calculator", REFERENCE)
    write(tmp_path / os.fsdecode("J\u00f6rg".encode("latin-1")) / "calculator", REFERENCE)
    assert listing.find(tmp_path, None, []) == [("ada", "calculator")]
    assert listing.overlooked(tmp_path) == [r"b'J\xf6rg': not a name in UTF-8: rename the folder"]


def test_half_a_surrogate_pair_in_a_notebook_s_marks_becomes_text():
    mark = {"nbgrader": {"grade_id": "\ud800x"}}
    text = json.dumps({"cells": [{"cell_type": "code", "source": "", "metadata": mark}]})
    (cell,) = notebook.parse(text.encode())
    assert cell.name.encode() == b"?x"


def test_a_picture_in_markdown_is_not_fetched():
    shown = notebook.plain("see ![it](https://example.org/seen.png) and ![it][1]\n\n[1]: https://example.org/1.png")
    assert "![" not in shown
    assert "see !" in shown


@pytest.mark.parametrize("encoding", ["raw_unicode_escape", "unicode-escape", "utf-7", "punycode", "iso2022_jp", "hz"])
@pytest.mark.parametrize("place", [0, 1])
def test_an_encoding_in_which_a_comment_can_hold_statements(handed_in, encoding, place):
    """Python runs what nobody sees, and no copy of it is found."""
    lines = ["#!/usr/bin/env python3"] * place + [f"# vim: fileencoding={encoding} :", r"# Hello \u000aprint('hidden')"]
    (handed_in / SERVER).write_text("\n".join(lines))
    assert f"{SERVER} is in the encoding {encoding}, in which" in problems(handed_in)


def test_a_cell_s_file_in_such_an_encoding(handed_in):
    (handed_in / SERVER).unlink()
    source = f"%%exercise {SERVER}\n# coding: utf-7\npass\n"
    cell = {"cell_type": "code", "source": source, "metadata": {}, "outputs": [], "execution_count": None}
    (handed_in / "calculator.ipynb").write_text(json.dumps({"cells": [cell], "nbformat": 4, "metadata": {}}))
    assert "in the encoding utf-7" in problems(handed_in)


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "utf-8-sig", "cp932", "gb18030", "koi8_r", "mac_roman"])
def test_an_encoding_that_an_editor_saves_in_is_read(handed_in, encoding):
    content = f"# coding: {encoding}\npass\n".encode(encoding)
    (handed_in / SERVER).write_bytes(content)
    assert reading.read(handed_in, "student", "calculator", FILES).files[SERVER] == content


def test_a_coding_that_python_refuses_is_the_program_s_own_mistake(handed_in):
    (handed_in / SERVER).write_bytes(b"# coding: rot13\nz = '\xff'\n")
    assert reading.read(handed_in, "student", "calculator", FILES).problems == []


@pytest.mark.parametrize("target", ["/etc/passwd", "../../../nothing", "calculator_client.py"])
def test_link(handed_in, target):
    (handed_in / SERVER).unlink()
    (handed_in / SERVER).symlink_to(target)
    assert "calculator_server.py is a link" in problems(handed_in)


def test_linked_folder(handed_in, tmp_path):
    other = tmp_path / "other" / "calculator"
    other.parent.mkdir()
    other.symlink_to(handed_in)
    assert "is a link, not a folder: hand in the folder itself" in problems(other)


def test_fifo(handed_in):
    (handed_in / SERVER).unlink()
    os.mkfifo(handed_in / SERVER)
    assert "not an ordinary file" in problems(handed_in)


def test_a_gigabyte(handed_in):
    with open(handed_in / SERVER, "r+b") as file:
        file.truncate(1 << 30)
    assert "larger than 1 MB" in problems(handed_in)


@pytest.mark.parametrize("name", chosen.cases(SERVERS, ALIKE))
def test_broken_server(broken, name):
    _, outcome, message = SERVERS[name]
    verdicts = broken[name].result().verdicts
    assert {verdicts[test].outcome for test in NEEDS_SERVER} == {outcome}
    assert re.search(message, verdicts[NEEDS_SERVER[0]].message)
    # What does not need the server is judged all the same.
    assert {verdicts[test].outcome for test in NEEDS_NONE} == {PASSED}


@pytest.fixture(scope="module")
def broken(request, judge):
    """The judgements of the broken servers that are asked about, all begun at once."""
    asked = chosen.values(request, "name")
    return {
        name: judge(
            services.REFERENCE | {services.MOTORS: text.encode()},
            "services",
            *NEEDS_SERVER,
            *NEEDS_NONE,
            patience=float(QUICK) if outcome == TIMED_OUT else 1.0,
        )
        for name, (text, outcome, _) in SERVERS.items()
        if name in asked
    }


def test_a_class_with_bad_submissions(confinement, tmp_path):
    """As a command: the good submission after the bad ones is graded as ever, and no process is left."""
    waits = REFERENCE[SERVER].replace(b"        return response", b"        import time; time.sleep(1000)")
    write(tmp_path / "in" / "a_empty" / "calculator", {})
    raises = {SERVER: SERVERS["raises"][0].encode(), CLIENT: b"def main(:\n"}  # both end at once
    write(tmp_path / "in" / "b_<i>raises" / "calculator", REFERENCE | raises)
    write(tmp_path / "in" / "c_silent" / "calculator", REFERENCE | {SERVER: waits})
    write(tmp_path / "in" / "d_good" / "calculator", REFERENCE)
    write(tmp_path / "in" / "d_good" / "unknown", {})
    (tmp_path / "in" / "e_link").mkdir()
    (tmp_path / "in" / "e_link" / "calculator").symlink_to("../d_good/calculator")
    out = tmp_path / "out"
    command = [*AUTOGRADER, "grade", str(tmp_path / "in"), "--output", str(out), "--patience", QUICK, "--jobs", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200)
    assert (done.returncode, done.stderr) == (0, "")
    lines = {line["student"]: line for line in map(json.loads, (out / "results.jsonl").read_text().splitlines())}
    assert {name: (line["status"], line["score"]) for name, line in lines.items()} == {
        "a_empty": (INVALID_SUBMISSION, 0),
        "b_<i>raises": (GRADED, 2),
        "c_silent": (GRADED, 8),
        "d_good": (GRADED, 20),
        "e_link": (INVALID_SUBMISSION, 0),
    }
    assert {test["outcome"] for test in lines["a_empty"]["tests"]} == {NOT_RUN}
    assert any("no answer within" in test["message"] for test in lines["c_silent"]["tests"])
    assert programs_left() == []
    page = (out / "feedback" / "b_<i>raises" / "calculator.html").read_text()
    assert "b_&lt;i&gt;raises" in page and "<i>" not in page and "2 of 20 points" in page

    from nbgrader.api import Gradebook

    with Gradebook(f"sqlite:///{out / 'gradebook.db'}") as book:
        assert {s.student_id: s.score for s in book.assignment_submissions("calculator")} == {
            name: line["score"] for name, line in lines.items()
        }

    # A line that was cut off by a kill is graded again, the others are not.
    last = "b_<i>raises"
    whole = (out / "results.jsonl").read_bytes().splitlines(keepends=True)
    whole.sort(key=lambda line: last.encode() in line)
    (out / "results.jsonl").write_bytes(b"".join(whole)[:-20])
    (out / "feedback" / "a_empty" / "calculator.html").unlink()
    assert subprocess.run(command, capture_output=True).returncode == 2
    done = subprocess.run([*command, "--resume"], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0 and done.stdout.startswith(f"[1/1] {last}")
    assert len((out / "results.jsonl").read_text().splitlines()) == 5
    assert (out / "feedback" / "a_empty" / "calculator.html").exists()


def test_no_process_is_left(broken):
    """After all of them, in this process."""
    for judgement in broken.values():
        judgement.result()
    assert programs_left() == []
