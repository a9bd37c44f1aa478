"""The report and `show` say first what needs a look, by name; what is well folds."""

import fcntl
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from nbgrader.api import Gradebook

from autograder import cli
from autograder.gradebook import ends, extensions, members, release
from autograder.gradebook.book import Scores, lateness
from autograder.grading import single
from autograder.records import BUSY_MACHINE, FAILED, GRADED, INVALID_SUBMISSION, PASSED, TIME_UNKNOWN, Report, Result
from autograder.results import summary, targets
from autograder.results.looks import REPLACED, Known, Look, looks
from autograder.results.output import Basis, Output
from autograder.returning.giving_back import LOCK, RETURNED
from autograder.submissions import exercises, listing
from tests.gradebook.test_late import DUE, HOUR
from tests.hidden import answers

AUTOGRADER = str(Path(sys.executable).with_name("autograder"))
pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
TESTS = exercises.load("calculator").tests
LIMIT = exercises.load("calculator").time_limit


def report(student: str, lost: tuple[int, ...] = (), flags: tuple[str, ...] = (), seconds: float = 9.0) -> Report:
    tests = [
        Result(test.id, test.title, FAILED, 0, test.points, "Mend this.")
        if number in lost
        else Result(test.id, test.title, PASSED, test.points, test.points)
        for number, test in enumerate(TESTS)
    ]
    score = sum(test.points for test in tests)
    most = sum(test.max_points for test in tests)
    return Report(student, "calculator", GRADED, score, most, 1, seconds, [*flags], tests)


def refused(student: str) -> Report:
    tests = [Result(test.id, test.title, "not_run", 0, test.points, "Missing: a.py.") for test in TESTS]
    return Report(student, "calculator", INVALID_SUBMISSION, 0.0, 20.0, 1, 0.0, tests=tests)


CLASS = [report("ada"), report("cy", (1,)), report("dee"), report("eve", (1,), (BUSY_MACHINE,)), report("fay")]


def test_who_needs_a_look_is_named_by_reason():
    known = Known({("ada", "calculator"): 90_000.0}, {"calculator": ["zoe"]}, {"calculator: ada and dee (98)": []})
    reports = [*CLASS, refused("gus"), report("hal", (), (TIME_UNKNOWN,), 0.9 * LIMIT)]
    found = {look.why: look.who for look in looks(reports, known)}
    assert found == {
        "refused, nothing was run": ["gus/calculator (Missing: a.py.)"],
        "flagged: busy machine": ["eve/calculator"],
        "flagged: time of handing in unknown, nothing deducted": ["hal/calculator"],
        "near the time limit, or beyond it with a second try": [
            f"hal/calculator ({0.9 * LIMIT:.0f} s of {LIMIT:.0f} s)"
        ],
        "handed in late": ["ada/calculator (1.0 days)"],
        "calculator not handed in": ["zoe"],
        "more alike than others (`autograder similar` shows them)": ["calculator: ada and dee (98)"],
    }
    assert looks([report("ada")]) == []


def test_a_missing_file_whose_stub_was_graded_is_named(tmp_path, monkeypatch):
    solved, stub = "%%exercise motor_service.py\nprint()\n", "%%exercise relay.py\n# YOUR CODE HERE\n"
    cells = [{"cell_type": "code", "source": source} for source in (solved, stub)]
    folder = tmp_path / "eve" / "services"
    folder.mkdir(parents=True)
    (folder / "services.ipynb").write_text(json.dumps({"cells": cells}))
    monkeypatch.setattr(single, "judge", lambda *_: single.Judgement(GRADED))
    why = "a file was not handed in, and the notebook's unsolved cell was graded instead"
    assert looks([single.grade(listing.read(tmp_path, "eve", "services"), "root")]) == [
        Look(why, ["eve/services (relay.py)"])
    ]
    (folder / "relay.py").write_text("# YOUR CODE HERE\n")  # handed in
    assert looks([single.grade(listing.read(tmp_path, "eve", "services"), "root")]) == []


def test_a_test_that_most_have_passed_is_not_one_that_everybody_has():
    (one,) = summary.classes(CLASS)
    assert [(item.title, item.passed, item.remark) for item in one.telling] == [(TESTS[1].title, 0.6, "")]
    assert len(one.rest) == len(TESTS) - 1 and all(item.passed == 1 for item in one.rest)


def test_the_page_begins_with_names_and_folds_the_rest():
    page = summary.page([*CLASS, refused("gus")])
    body = page.partition("<body>")[2]
    places = [body.index(text) for text in ("gus/calculator", "Students", TESTS[1].title, "<details>", TESTS[0].title)]
    assert places == sorted(places)
    assert "20 points" in body and "5 more are for answers that are marked by hand" in body
    assert looks([refused("gus")]) == [Look("refused, nothing was run", ["gus/calculator (Missing: a.py.)"])]


def test_the_terminal_shows_no_histogram_and_breaks_no_name(capsys):
    student = "bob-with-a-very-long-name-" * 5
    summary.show([*CLASS, refused(student)])
    said = capsys.readouterr().out
    assert f"{student}/calculator" in said
    assert said.index("Needs a look") < said.index(TESTS[1].title)
    assert "\u2588" not in said and TESTS[0].title not in said
    assert f"{len(TESTS) - 1} more hidden tests passed by nearly everybody." in said
    assert "and 5 points for answers that are marked by hand" in said


@pytest.fixture
def out(tmp_path) -> Path:
    """Results of three students: bob has copied ada's programs and was late, cy has lost a test."""
    submitted = tmp_path / "submitted"
    right = answers.load("calculator").RIGHT
    for student, files in {"ada": right["reference"], "bob": right["reference"], "cy": {}}.items():
        (submitted / student / "calculator").mkdir(parents=True)
        for name, content in files.items():
            (submitted / student / "calculator" / name).write_bytes(content)
    (submitted / "bob" / "calculator" / "timestamp.txt").write_text(f"{DUE + 3 * HOUR} UTC\n")
    reports = [report("ada"), report("bob"), report("cy", (1,))]
    with Output(tmp_path / "out", resume=True) as output:
        for one in reports:
            handed_in = listing.read(submitted, one.student, "calculator")
            output.write(one, Basis(str(submitted), "suite", listing.digest(handed_in)))
    url = f"sqlite:///{tmp_path / 'out' / 'gradebook.db'}"
    with Gradebook(url) as book:
        book.update_or_create_assignment("calculator", duedate=DUE)
    with Scores(url, submitted) as scores:
        for one in reports:
            scores.write(one)
    return tmp_path / "out"


def test_the_report_knows_late_missing_and_alike(out, tmp_path):
    (tmp_path / "roster.csv").write_text("student\nada\nbob\ncy\ndan\nzoe\n")
    (tmp_path / "submitted" / "dan" / "calculator").mkdir(parents=True)  # as after a grading that was killed
    command = [AUTOGRADER, "report", str(out), "--roster", str(tmp_path / "roster.csv")]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "handed in late: bob/calculator (3.0 h)" in ran.stdout
    assert "calculator not handed in: zoe" in ran.stdout
    assert "(`autograder grade` with --resume grades the rest): dan/calculator\n" in ran.stdout
    assert "calculator: ada and bob (the same to the letter: " in ran.stdout
    page = (out / "report.html").read_text()
    assert "bob/calculator (3.0 h)" in page and "<li>zoe</li>" in page and "ada and bob" in page


def test_who_has_handed_in_again_since_is_named_so_that_nobody_hides_a_copy(out, tmp_path, capsys):
    """Compared is what was handed in last; the points are those of what was graded."""
    (tmp_path / "submitted" / "bob" / "calculator" / "calculator_server.py").write_text("pass\n")
    cli.app(["report", str(out)], standalone_mode=False)
    assert "handed in again since this result" in (said := capsys.readouterr().out)
    assert "(`autograder regrade` grades the new files): bob/calculator\n" in said
    assert "handed in again since this result" in (out / "report.html").read_text()
    cli.app(["similar", str(out), "--html", str(tmp_path / "similar.html")], standalone_mode=False)
    assert "handed in again since the grading; compared is the new hand-in" in (said := capsys.readouterr().out)
    assert "grades it, too: bob\n" in said
    assert "Handed in again since the grading" in (tmp_path / "similar.html").read_text()
    shutil.rmtree(tmp_path / "submitted" / "cy")
    cli.app(["export", str(out), "--for", "csv", "--to", str(tmp_path / "grades.csv")], standalone_mode=False)
    assert f"LOOK: {REPLACED}: bob/calculator\n" in (said := capsys.readouterr().out)
    assert "their folder no longer exists (was it renamed?): cy/calculator\n" in said
    cli.app(["similar", str(tmp_path / "submitted")], standalone_mode=False)  # of these nothing was graded
    assert "handed in again" not in capsys.readouterr().out


def test_a_group_that_is_alike_is_one_line_and_its_pairs_fold():
    known = Known(alike={"calculator: ada, bob and cy (3 pairs)": ["ada and bob (98)", "bob and <cy> (70)"]})
    (look,) = looks([report("ada")], known)
    assert look.who == ["calculator: ada, bob and cy (3 pairs)"]
    page = summary.page([report("ada")], known=known)
    folded = page.partition("ada, bob and cy (3 pairs)<details>")[2].partition("</details>")[0]
    assert "ada and bob (98)" in folded and "bob and &lt;cy&gt; (70)" in folded


def test_an_extension_counts_in_the_report_as_in_penalties(out):
    url, submitted = f"sqlite:///{out / 'gradebook.db'}", out.parent / "submitted"
    late = {("bob", "calculator"): 3 * 3600.0}
    assert lateness(url, submitted) == late  # outside of a course there are no extensions
    (out.parent / "source").mkdir()
    (out.parent / "nbgrader_config.py").write_text(release.COURSE_FILE)
    assert lateness(url, submitted) == late
    extensions.change(out.parent, ["bob"], None, 0.1)
    assert lateness(url, submitted) == {("bob", "calculator"): pytest.approx(0.6 * 3600)}
    extensions.change(out.parent, ["bob"], "calculator", 1.0)
    assert lateness(url, submitted) == {}


def test_show_prints_of_a_class_what_was_not_passed(out, capsys):
    def shown(*options: str) -> str:
        cli.app(["show", str(out), *options], standalone_mode=False)
        return capsys.readouterr().out

    said = subprocess.run([AUTOGRADER, "show", str(out)], capture_output=True, text=True).stdout
    assert TESTS[1].title in said and TESTS[0].title not in said
    heads = [line.partition(":")[0] for line in said.splitlines() if not line.startswith(" ")]
    assert heads == ["ada/calculator", "bob/calculator", "cy/calculator"]
    assert TESTS[1].title in said.partition("cy/calculator: ")[2]  # below its student
    assert shown("--passed").count(TESTS[0].title) == 3
    assert TESTS[0].title in shown("--student", "ada")


@pytest.mark.parametrize("command", ["report", "show", "export"])
@pytest.mark.parametrize(
    "change",
    [
        lambda line: json.dumps(json.loads(line) | {"extra": 1}),
        lambda line: json.dumps({name: value for name, value in json.loads(line).items() if name != "max_score"}),
        lambda line: json.dumps(json.loads(line) | {"score": "20"}),
        lambda line: json.dumps(json.loads(line) | {"score": float("nan")}),
        lambda line: json.dumps(json.loads(line) | {"score": 1e308}),
        lambda line: json.dumps(json.loads(line) | {"student": "../../ada"}),  # of its page, which would be elsewhere
        lambda line: json.dumps(json.loads(line) | {"assignment": "/tmp/services"}),
        lambda line: json.dumps(json.loads(line) | {"flags": [5]}),
        lambda line: json.dumps(json.loads(line) | {"tests": [{"id": "x"}]}),
        lambda _: "",
        lambda _: "\0\0\0\0",
        lambda _: "5",
        lambda _: "[" * 100_000,
    ],
)
def test_a_line_that_cannot_be_read_is_named(out, capsys, monkeypatch, command, change):
    """A traceback said neither which file nor what to do."""
    lines = (out / "results.jsonl").read_text().splitlines()
    lines[1] = change(lines[1])
    (out / "results.jsonl").write_text("\n".join(lines) + "\n")
    options = ["--for", "csv", "--to", str(out / "grades.csv")] if command == "export" else []
    monkeypatch.setattr(sys, "argv", ["autograder", command, str(out), *options])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    (said,) = capsys.readouterr().err.splitlines()
    assert ended.value.code == 2
    assert (
        said.startswith(f"autograder: {out}/results.jsonl, line 2, is damaged or of another version")
        and len(said) < 600
    )
    assert said.endswith("remove that line: `autograder grade` with --resume grades the submission again")


WRITING = {"report": ["--html"], "similar": ["--html"], "export": ["--for", "csv", "--to"]}


@pytest.mark.parametrize("command", WRITING)
def test_what_lies_where_a_command_writes_is_not_replaced_unless_it_is_a_file(
    out, tmp_path, capsys, monkeypatch, command
):
    def run(target: Path) -> tuple[int, list[str]]:
        monkeypatch.setattr(sys, "argv", ["autograder", command, str(out), *WRITING[command], str(target)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0), capsys.readouterr().err.splitlines()

    (tmp_path / "folder").mkdir()
    why = "it is a folder: name a file"
    assert run(tmp_path / "folder") == (2, [f"autograder: cannot write to {tmp_path / 'folder'}: {why}"])
    (tmp_path / "file").write_text("old")
    (tmp_path / "link").symlink_to("file")
    assert run(tmp_path / "link") == (0, [])
    assert (tmp_path / "link").is_symlink() and "ada" in (tmp_path / "file").read_text()
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    fcntl.fcntl(reader, fcntl.F_SETPIPE_SZ, 1 << 20)  # for a whole page
    assert run(tmp_path / "pipe") == (0, [])
    assert b"ada" in os.read(reader, 1 << 20)
    os.close(reader)


KEPT = [
    "out/results.jsonl",
    "out/details.jsonl",
    "out/gradebook.db",
    "out/feedback/ada/calculator.html",
    "out/feedback/new.html",
    "submitted/.roster.csv",
    "submitted/ada/calculator/calculator_server.py",
    "submitted/ada/new.csv",
    "nbgrader_config.py",
    "gradebook.db",
    "source/calculator/new.csv",
    "roster.csv",
    "given.db",
]


@pytest.mark.parametrize("command", WRITING)
@pytest.mark.parametrize("way", ["its name", "a link", "a link to its folder", "another name"])
def test_the_files_of_the_course_and_its_results_are_never_written_over(
    out, tmp_path, capsys, monkeypatch, command, way
):
    """Marks by hand, hidden inputs and hand-ins were replaced by a table of grades, without a word."""

    def run(target: Path) -> tuple[int, str]:
        options = ["--roster", str(tmp_path / "roster.csv")] if command != "similar" else []
        options += ["--gradebook", f"sqlite:///{tmp_path / 'given.db'}"] if command != "similar" else []
        monkeypatch.setattr(sys, "argv", ["autograder", command, str(out), *options, *WRITING[command], str(target)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0), capsys.readouterr().err

    (tmp_path / "source" / "calculator").mkdir(parents=True)
    (tmp_path / "roster.csv").write_text("student\nada\nbob\ncy\n")
    (tmp_path / "submitted" / ".roster.csv").write_text("student\nada\nbob\ncy\n")
    (tmp_path / "nbgrader_config.py").write_text(release.COURSE_FILE)
    (tmp_path / "gradebook.db").touch()
    shutil.copy(out / "gradebook.db", tmp_path / "given.db")
    (out / "feedback").mkdir(exist_ok=True)
    for number, name in enumerate(KEPT):
        kept = target = tmp_path / name
        if command == "similar" and name in ("roster.csv", "given.db"):
            continue
        before = kept.read_bytes() if kept.exists() else None
        if way == "a link":
            target = tmp_path / f"link-{number}"
            target.symlink_to(kept)
        elif way == "a link to its folder":
            (tmp_path / f"folder-{number}").symlink_to(kept.parent)
            target = tmp_path / f"folder-{number}" / kept.name
        elif way == "another name":
            if not kept.exists() or kept.parent not in (out, tmp_path):
                continue  # the folder tells
            target = tmp_path / f"other-{number}"
            target.hardlink_to(kept)
        code, said = run(target)
        assert code == 2 and said.startswith(f"autograder: cannot write to {target}: ") and said.count("\n") == 1, name
        assert said.endswith((": name another file\n", ": name another folder\n"))
        assert (kept.read_bytes() if kept.exists() else None) == before
    for fine in (tmp_path / "grades.csv", out / "grades.csv", tmp_path / "submitted" / "grades.csv"):
        assert run(fine) == run(fine) == (0, "")


def test_the_names_of_the_course_s_files_are_known():
    assert {ends.FILE, extensions.FILE, members.FILE, RETURNED, LOCK} < targets.NAMES
