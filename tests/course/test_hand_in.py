"""`course hand-in`: one archive with a receipt, of what is there; what is doubtful is asked, nothing is lost."""

import hashlib
import json
import os
import re
import resource
import signal
import subprocess
import sys
import zipfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import nbformat
import pytest

from course import hand_in
from course.errors import HandInError
from course.foundation import cells
from course.notebook import runs
from course.notebook.exercise_names import wanted_files
from course.notebook.progress import parts
from course.returned import reading

COURSE = str(Path(sys.executable).with_name("course"))
NOW = datetime(2026, 11, 2, 9, 30, 5, tzinfo=UTC)
SERVER = "print('server')\n"


CHECK = {
    "solution": False,
    "grade": True,
    "locked": True,
    "grade_id": "says-server",
    "points": 1,
    "schema_version": 3,
    "cell_type": "code",
}


def notebook(*sources: tuple[str, dict]) -> str:
    cells = [nbformat.v4.new_code_cell(source, metadata={"nbgrader": mark} if mark else {}) for source, mark in sources]
    return nbformat.writes(nbformat.v4.new_notebook(cells=cells))


@pytest.fixture
def folder(tmp_path):
    """An exercise as a student has it: a notebook whose check reads the file, and the file."""
    solution = CHECK | {"solution": True, "grade": False, "locked": False, "grade_id": "file"}
    text = notebook(
        ("raise SystemError('a cell that no exercise needs')", {}),
        (f"%%exercise server.py --no-start\n{SERVER}", solution),
        ("assert 'server' in open('server.py').read(), 'it must say server'\nprint('as asked')", CHECK),
    )
    (tmp_path / "greeter.ipynb").write_text(text)
    (tmp_path / "server.py").write_text(SERVER)
    return tmp_path


def run(folder, *arguments, stdin=""):
    environment = {name: value for name, value in os.environ.items() if name != "COURSE_STUDENT"}
    return subprocess.run(
        [COURSE, "hand-in", *arguments],
        cwd=folder,
        input=stdin,
        capture_output=True,
        text=True,
        timeout=100,
        env=environment | {"LOGNAME": "ada"},
    )


def receipt_of(path):
    with zipfile.ZipFile(path) as archive:
        return json.loads(archive.read("receipt.json")), {name: archive.read(name) for name in archive.namelist()}


def test_an_archive_holds_the_files_as_they_are_and_a_receipt(folder):
    ran = run(folder)
    assert ran.returncode == 0, ran.stderr
    (path,) = folder.glob("*.zip")
    assert re.fullmatch(r"ada-greeter-\d{8}T\d{6}Z\.zip", path.name)
    receipt, content = receipt_of(path)
    assert receipt["student"] == "ada"
    assert receipt["assignment"] == "greeter"
    assert receipt["checks"] == {"says-server": "passed"}
    assert receipt["doubts"] == {}
    for name in ("server.py", "greeter.ipynb"):
        assert content[name] == (folder / name).read_bytes()
        expected = {"bytes": len(content[name]), "sha256": hashlib.sha256(content[name]).hexdigest()}
        assert receipt["files"][name] == expected
    assert "1 of 1 public checks passed" in ran.stdout
    assert ran.stderr == ""
    known = cells.read(folder / "greeter.ipynb")
    assert [part.state for part in parts("greeter", known, folder)] == ["passed"]  # though no cell was run


def test_the_checks_see_the_files_that_are_handed_in_not_their_cells(folder):
    """One that is missing fails its check though its cell would pass, and so does one that was edited elsewhere."""
    solution = CHECK | {"solution": True, "grade": False, "locked": False}
    book = nbformat.read(folder / "greeter.ipynb", 4)
    more = notebook(
        ("%%exercise client.py --no-start\nprint('client')", solution | {"grade_id": "other"}),
        ("assert 'client' in open('client.py').read()\nprint('as asked')", CHECK | {"grade_id": "says-client"}),
    )
    book.cells += nbformat.reads(more, 4).cells
    nbformat.write(book, folder / "greeter.ipynb")
    (folder / "server.py").write_text("print('other')\n")
    ran = run(folder, "--yes")
    assert ran.returncode == 0, ran.stderr
    assert "says-client: not yet: FileNotFoundError" in ran.stdout
    assert "says-server: not yet: it must say server" in ran.stdout
    assert "0 of 2 public checks passed; client.py was not handed in." in ran.stdout


@pytest.mark.parametrize(("answer", "told"), [("YOUR ANSWER HERE", True), ("Because it may fail.", False)])
def test_a_question_without_an_answer_is_told(folder, answer, told):
    read = nbformat.read(folder / "greeter.ipynb", 4)
    mark = CHECK | {"solution": True, "locked": False, "cell_type": "markdown", "grade_id": "why", "points": 3}
    read.cells.append(nbformat.v4.new_markdown_cell(answer, metadata={"nbgrader": mark}))
    nbformat.write(read, folder / "greeter.ipynb")
    ran = run(folder, "--no-check")
    assert ran.returncode == 0, ran.stderr
    assert ("Not answered: why (3 points)." in ran.stdout) == told


def test_a_failed_check_is_told_and_keeps_nobody_from_handing_in(folder):
    text = (folder / "greeter.ipynb").read_text().replace("print('server')", "print('other')")
    (folder / "greeter.ipynb").write_text(text)
    (folder / "server.py").write_text(SERVER.replace("server", "other"))
    ran = run(folder)
    assert ran.returncode == 0
    assert "says-server: not yet: it must say server" in ran.stdout
    receipt, _ = receipt_of(*folder.glob("*.zip"))
    assert receipt["checks"] == {"says-server": "not yet: it must say server"}


SAYS = "not yet: it must say server\nHint: ..."


@pytest.mark.parametrize(
    ("says", "terminal", "yes", "answer", "asked"),
    [
        (SAYS, True, False, True, True),
        (SAYS, True, False, False, True),
        (SAYS, True, True, False, False),
        (SAYS, False, False, False, False),
        ("not yet: it had not finished after 60 s, in `wait()`", True, False, False, False),
    ],
    ids=["yes", "no", "--yes", "nobody to answer", "too little time"],
)
def test_where_somebody_can_answer_a_failed_check_is_asked_about(
    folder, monkeypatch, capsys, says, terminal, yes, answer, asked
):
    questions = []
    monkeypatch.delenv("JPY_PARENT_PID", raising=False)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: terminal))
    monkeypatch.setattr("typer.confirm", lambda text: questions.append(text) or answer)
    monkeypatch.setattr(runs, "outcomes", lambda *_: {"greets": "passed", "says-server": says})
    status = hand_in.hand_in(folder, "ada", yes=yes, check=True)
    told = capsys.readouterr()
    assert questions == ["Hand it in as it is?"] * asked
    assert told.err == "Careful: the public check says-server has failed.\n" * asked
    assert f"says-server: {says}\n" in told.out
    refused = asked and not answer
    assert (status, len([*folder.glob("*.zip")])) == ((1, 0) if refused else (0, 1))
    assert ("Nothing was handed in." in told.out) == refused


def test_nothing_is_asked_below_a_cell(folder, monkeypatch):
    """A cell's command has a terminal, and nobody at its keyboard."""
    (folder / "server.py").write_text("print('edited elsewhere: server')\n")
    monkeypatch.setenv("JPY_PARENT_PID", "1")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("typer.confirm", lambda text: pytest.fail(f"it asks: {text}"))
    with pytest.raises(HandInError, match="--yes"):
        hand_in.hand_in(folder, "ada", yes=False, check=False)


def test_a_file_that_is_not_what_its_cell_says_is_asked_about(folder):
    (folder / "server.py").write_text("print('edited elsewhere: server')\n")
    refused = run(folder)
    assert refused.returncode == 1
    assert "Careful: server.py differs from its cell" in refused.stderr
    assert "--yes" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert list(folder.glob("*.zip")) == []
    handed_in = run(folder, "--yes", "--no-check")
    assert handed_in.returncode == 0
    receipt, content = receipt_of(*folder.glob("*.zip"))
    assert content["server.py"] == b"print('edited elsewhere: server')\n"  # the file counts
    assert list(receipt["doubts"]) == ["server.py"]
    assert (folder / "server.py").read_text() == "print('edited elsewhere: server')\n"  # and is not written over


@pytest.mark.parametrize(
    ("break_it", "says"),
    [
        (lambda folder: (folder / "greeter.ipynb").unlink(), "there is no notebook with an exercise in"),
        (lambda folder: (folder / "server.py").unlink(), "run the cells that write server.py"),
        (lambda folder: (folder / "greeter.ipynb").write_text("no JSON"), "greeter.ipynb cannot be read"),
        (
            lambda folder: (folder / "copy.ipynb").write_text((folder / "greeter.ipynb").read_text()),
            "only one can be handed in",
        ),
    ],
    ids=["no notebook", "no file", "a broken notebook", "a copy of the notebook"],
)
def test_what_cannot_be_handed_in_is_told_in_a_line(folder, break_it, says):
    break_it(folder)
    ran = run(folder)
    assert ran.returncode == 1
    assert says in ran.stderr
    assert "Traceback" not in ran.stderr
    assert list(folder.glob("*.zip")) == []


@pytest.mark.parametrize("left", ["", "a copy"])
def test_what_a_save_has_left_on_a_full_disk_is_no_notebook(folder, monkeypatch, left):
    """JupyterLab leaves `.~NAME.ipynb`, which its list of files does not show."""
    text = (folder / "greeter.ipynb").read_text()
    (folder / ".~greeter.ipynb").write_text(text if left else "")
    assert hand_in.read(folder).assignment == "greeter"
    assert cells.notebooks(folder) == [folder / "greeter.ipynb"]
    monkeypatch.chdir(folder)
    assert wanted_files() == ["server.py"]
    assert reading._assignments(folder) == ["greeter"]


@pytest.mark.parametrize("where", ["notebooks/greeter", "greeter"])
def test_where_no_exercise_lies_the_folders_that_have_one_are_named(folder, monkeypatch, where):
    top = folder / "course"
    (top / where).mkdir(parents=True)
    for path in folder.glob("*.*"):
        path.rename(top / where / path.name)
    monkeypatch.chdir(top)
    with pytest.raises(HandInError, match=f"or name it: `course hand-in {where}`$"):
        hand_in.read(Path())


def test_handing_in_twice_in_a_second_keeps_both(folder):
    found = hand_in.read(folder)
    first = hand_in.write(found, folder, "ada", {}, NOW)
    second = hand_in.write(found, folder, "ada", {}, NOW)
    assert first.name == "ada-greeter-20261102T093005Z.zip"
    assert second.name == "ada-greeter-20261102T093005Z-2.zip"
    assert first.exists()


def test_a_name_of_any_letters_makes_a_file_name(folder):
    path = hand_in.write(hand_in.read(folder), folder, "../Zoë Müller", {}, NOW)
    assert path.parent == folder
    assert path.name == "Zoë_Müller-greeter-20261102T093005Z.zip"


def test_a_full_disk_leaves_no_half_archive(folder, monkeypatch):
    found = hand_in.read(folder)
    monkeypatch.setattr(hand_in, "_archive", lambda *_: b"x" * 100_000)
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limit[1]))
    try:
        with pytest.raises(HandInError, match="File too large; nothing was handed in"):
            hand_in.write(found, folder, "ada", {}, NOW)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(folder.glob("*.zip")) == []


def test_a_full_disk_is_a_line_and_changes_nothing(folder):
    before = {path: path.read_bytes() for path in folder.iterdir()}
    command = f"ulimit -f 0; trap '' XFSZ; exec {COURSE} hand-in --name ada"
    ran = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, timeout=100)
    assert ran.returncode == 1
    assert "The public checks could not be run" in ran.stdout
    assert "File too large; nothing was handed in" in ran.stderr and len(ran.stderr.splitlines()) == 1
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


def test_the_report_of_validate_begins_with_what_the_check_says(folder):
    text = (folder / "greeter.ipynb").read_text().replace("print('server')", "print('other')")
    (folder / "greeter.ipynb").write_text(text)
    command = [str(Path(sys.executable).with_name("nbgrader")), "validate", "greeter.ipynb"]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=100)
    assert ran.stdout.partition("The error was:")[2].strip() == "AssertionError: it must say server"


def test_validate_runs_what_the_exercises_need_and_leaves_the_folder_as_it_was(folder):
    solution = CHECK | {"solution": True, "grade": False, "locked": False, "grade_id": "file"}
    shown, checked = (folder.with_name(f"{folder.name}-{name}") for name in ("shown", "checked"))
    text = notebook(
        (f"open({str(shown)!r}, 'w').close()", {}),
        ("wanted = 'server'", {}),
        (f"%%exercise server.py --no-start\n{SERVER}", solution),
        (f"assert wanted in open('server.py').read()\nopen({str(checked)!r}, 'w').close()", CHECK),
    )
    (folder / "greeter.ipynb").write_text(text)
    (folder / "server.py").write_text("print('edited elsewhere: server')\n")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    nbgrader = str(Path(sys.executable).with_name("nbgrader"))
    ran = subprocess.run(
        [nbgrader, "validate", "greeter.ipynb"], cwd=folder, capture_output=True, text=True, timeout=100
    )
    assert "Success" in ran.stdout, ran.stdout + ran.stderr
    assert checked.exists() and not shown.exists()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_what_is_late_is_said_by_the_dates_that_the_release_has_noted(folder):
    book = json.loads((folder / "greeter.ipynb").read_text())
    book["metadata"]["course"] = {"due": "2026-11-02T09:30:05+00:00", "until": "2026-11-04T10:30:05+01:00"}
    (folder / "greeter.ipynb").write_text(json.dumps(book))
    found = hand_in.read(folder)
    assert found.lateness(NOW) == "This is in time: it is due on 2026-11-02 09:30 UTC. Your instructor's clock decides."
    assert (
        found.lateness(NOW + timedelta(minutes=5))
        == "This is late by less than 1 h: it was due on 2026-11-02 09:30 UTC."
    )
    assert found.lateness(NOW + timedelta(hours=30)) == "This is late by 1.2 days: it was due on 2026-11-02 09:30 UTC."
    assert found.lateness(NOW + timedelta(days=2, seconds=1)).startswith(
        "This is too late: hand-ins ended on 2026-11-04 09:30"
    )
    done = run(folder, "--no-check")
    assert done.returncode == 0 and re.search(r"^This is (in time|late by|too late)", done.stdout, re.MULTILINE)


def test_a_class_on_one_server_tells_ones_own_dates(folder, tmp_path, monkeypatch):
    """Whatever the notebook says; what cannot be read says nothing."""
    dates = tmp_path / "ada.json"
    dates.write_text('{"greeter": {"due": "2026-11-09T09:30:05+00:00"}, "other": {}}')
    book = json.loads((folder / "greeter.ipynb").read_text())
    book["metadata"]["course"] = {"due": "2026-11-02T09:30:05+00:00", "until": "2026-11-10T09:30:05+00:00"}
    (folder / "greeter.ipynb").write_text(json.dumps(book))
    assert "Now give the archive to your instructor." in hand_in.HandedIn(tmp_path, [], {}).kept
    monkeypatch.setenv(hand_in.DATES, str(dates))
    monkeypatch.setenv(hand_in.EXCHANGE, "ros2")
    found = hand_in.read(folder)
    assert "in time: it is due on 2026-11-09 09:30 UTC" in found.lateness(NOW + timedelta(days=5))
    assert found.lateness(NOW + timedelta(days=9)).endswith("ended on 2026-11-10 09:30 UTC. It will not be collected.")
    assert [found.is_over(NOW + timedelta(days=days)) for days in (5, 9)] == [False, True]
    done = hand_in.HandedIn(tmp_path, [], {})
    assert "in the exchange of your class" in done.kept and "You can hand in again" in done.kept
    assert replace(done, over=True).kept == "Keep the archive: it is your receipt."
    for content in ("", "[]", '{"greeter": 7}', '{"greeter": {"due": 7}}'):
        dates.write_text(content)
        assert "late by 5.0 days: it was due on 2026-11-02" in found.lateness(NOW + timedelta(days=5))


@pytest.mark.parametrize("noted", [None, 7, {}, {"due": 7}, {"due": "tomorrow"}, {"due": None, "until": ""}, [1]])
def test_dates_that_somebody_has_edited_say_nothing(folder, noted):
    book = json.loads((folder / "greeter.ipynb").read_text())
    book["metadata"]["course"] = noted
    (folder / "greeter.ipynb").write_text(json.dumps(book))
    assert hand_in.read(folder).lateness(NOW) == ""


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("greeter-Copy1", "greeter"),
        ("greeter (2)", "greeter"),
        ("greeter_final", "greeter"),
        ("my_greeter", "greeter"),
        ("greeter_ada", "greeter"),
        ("greeter", ""),
        ("greeters", ""),
        ("welcome", ""),
    ],
)
def test_a_notebook_with_another_name_is_asked_about(folder, name, meant):
    place = folder / "greeter"
    place.mkdir()
    (folder / "server.py").rename(place / "server.py")
    (folder / "greeter.ipynb").rename(place / f"{name}.ipynb")
    doubts = hand_in.read(place).doubts
    assert list(doubts) == ([f"{name}.ipynb"] if meant else [])
    assert all(f"rename it to {meant}.ipynb" in why for why in doubts.values())


def test_a_link_out_of_the_folder_is_asked_about(folder, tmp_path_factory):
    """The folder may come from somebody else, who would like to know what lies there."""
    private = tmp_path_factory.mktemp("home") / "private.txt"
    private.write_text("secret")
    (folder / "server.py").unlink()
    (folder / "server.py").symlink_to(private)
    refused = run(folder, "--no-check")
    assert refused.returncode == 1 and f"Careful: server.py is a link to {private}, which would be" in refused.stderr


def test_a_file_that_is_not_filled_in_is_asked_about(folder):
    stub = "def main():\n    # YOUR CODE HERE\n    raise NotImplementedError\n"
    text = (folder / "greeter.ipynb").read_text()
    (folder / "greeter.ipynb").write_text(text.replace(json.dumps(SERVER)[1:-1], json.dumps(stub)[1:-1]))
    (folder / "server.py").write_text(stub)
    assert hand_in.read(folder).doubts == {
        "server.py": "server.py still has a line `# YOUR CODE HERE`: fill it in, or delete the line if you have."
    }
