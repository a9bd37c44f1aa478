"""nbgrader with this course's configuration: the sandbox decides the points, and nothing else that was handed in."""

import copy
import errno
import html
import json
import os
import re
import subprocess
import sys
import tomllib
from datetime import UTC, datetime
from pathlib import Path

import pytest
from nbconvert.exporters import HTMLExporter
from nbconvert.writers import FilesWriter
from nbgrader.api import Gradebook
from nbgrader.server_extensions.formgrader import handlers

from autograder.errors import UsageError
from autograder.gradebook import apart, database, ends, leaks, plugins, release
from autograder.paths import HIDDEN, repository
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.submissions import exercises, notebook, reading
from course.errors import UnreadableNotebook
from course.foundation.cells import exercise_file
from tests.hidden.answers.calculator import CLIENT, REFERENCE, SERVER, SRV, server

pytestmark = pytest.mark.filterwarnings("ignore:Object of type")  # nbgrader's own, about its sessions
SEED = 20
FILES = (SRV, SERVER, CLIENT)
HOSTILE_HTML = "<script>alert(1)</script><img src=x onerror=alert(2)><b onclick='alert(3)'>bold</b>"
WRONG = server(("request.a + request.b", "request.a - request.b"))
ENDS = {CLIENT: b"def main(:\n"}  # at once, and so it is judged quickly


@pytest.fixture(scope="module")
def course(tmp_path_factory) -> Path:
    """A course folder in which every notebook is released."""
    folder = tmp_path_factory.mktemp("course")
    release.release(folder)
    with open(folder / "nbgrader_config.py", "a") as config:
        config.write(f"c.GradeInSandbox.seed = {SEED}\nc.GradeInSandbox.patience = 2.0\n")
    return folder


@pytest.fixture(scope="module")
def blank(course) -> dict:
    """The calculator's notebook as students get it."""
    return json.loads((course / "release" / "calculator" / "calculator.ipynb").read_text())


def cell(book: dict, grade_id: str) -> dict:
    return next(cell for cell in book["cells"] if cell["metadata"].get("nbgrader", {}).get("grade_id") == grade_id)


def completed(book: dict, files: dict[str, bytes]) -> dict:
    """The notebook with the files written into its `%%exercise` cells."""
    book = copy.deepcopy(book)
    for name, content in files.items():
        target = next(c for c in book["cells"] if "".join(c["source"]).startswith(f"%%exercise {name}"))
        first = "".join(target["source"]).partition("\n")[0]
        target["source"] = f"{first}\n{content.decode()}"
    return book


def hostile(book: dict) -> dict:
    """A notebook that fakes its checks, lacks cells, repeats one, and brings scripts wherever there is text."""
    book = copy.deepcopy(book)
    book["cells"].remove(cell(book, "calculator-client"))
    faked = cell(book, "calculator-server")
    faked["source"] = "import os\nos._exit(0)"
    faked["metadata"]["nbgrader"]["points"] = 1000
    faked["execution_count"] = HOSTILE_HTML
    faked["outputs"] = [
        {"output_type": "stream", "name": "stderr", "text": "kept as handed in" + HOSTILE_HTML},
        {
            "output_type": "display_data",
            "metadata": {},
            "data": {
                "text/html": HOSTILE_HTML,
                "application/javascript": "alert(4)",
                "image/svg+xml": "<svg onload=alert(5)>",
                "text/markdown": HOSTILE_HTML,
                "text/latex": HOSTILE_HTML,
                "image/png": f"' {HOSTILE_HTML}",
            },
        },
        {"output_type": "error", "ename": HOSTILE_HTML, "evalue": "", "traceback": [HOSTILE_HTML]},
    ]
    book["cells"] += [
        copy.deepcopy(faked),
        {
            "cell_type": "markdown",
            "source": [
                (
                    f"{HOSTILE_HTML}\n[link](javascript:alert(6)) [link](java&#115;cript:alert(7)) a<b "
                    "![seen](https://example.org/seen.png)"
                )
            ],
            "attachments": {"x": {}},
            "metadata": {
                "nbgrader": {"grade_id": f"\ud800'>{HOSTILE_HTML}", "grade": True, "points": 9, "solution": True}
            },
        },
    ]
    book["metadata"] = {"title": HOSTILE_HTML, "kernelspec": {"name": HOSTILE_HTML}}
    return book


def hand_in(course: Path, student: str, files: dict[str, bytes], text: str | None) -> None:
    folder = course / "submitted" / student / "calculator"
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    if text is not None:
        (folder / "calculator.ipynb").write_text(text)


@pytest.fixture(scope="module")
def graded(course, blank, confinement) -> tuple[Path, dict, dict]:
    """A class graded by nbgrader, with its answer, and at the same time by `autograder grade`, with its results."""
    hand_in(course, "hostile", REFERENCE | ENDS | {"page.html": b"<script>"}, json.dumps(hostile(blank)))
    hand_in(course, "no_json", WRONG | ENDS, "{" * 10_000)
    hand_in(course, "no_client", {SRV: REFERENCE[SRV], SERVER: REFERENCE[SERVER]}, json.dumps({"cells": []}))
    hand_in(course, "only_notebook", {}, json.dumps(completed(blank, REFERENCE | {SERVER: ENDS[CLIENT]})))
    secret = course / "secret.txt"
    secret.write_text("another student's work")
    (course / "submitted" / "hostile" / "calculator" / "linked.txt").symlink_to(secret)
    command = [
        str(Path(sys.executable).with_name("autograder")),
        "grade",
        str(course / "submitted"),
        "--output",
        str(course / "out"),
        "--gradebook",
        f"sqlite:///{course / 'other.db'}",
        "--assignment",
        "calculator",
        "--seed",
        str(SEED),
        "--patience",
        "2",
        "--jobs",
        "1",
    ]
    beside = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    answer = release.api(course).autograde("calculator", "*")
    assert beside.wait(200) == 0
    lines = map(json.loads, (course / "out" / "results.jsonl").read_text().splitlines())
    return course, answer, {line["student"]: line for line in lines}


def scores(database: Path) -> dict[str, dict[str, float | None]]:
    with Gradebook(f"sqlite:///{database}") as book:
        return {
            s.student_id: {g.name: g.auto_score for n in s.notebooks for g in n.grades if g.auto_score is not None}
            for s in book.assignment_submissions("calculator")
        }


def test_formgraders_button_grades_with_this_grader(graded):
    course, answer, _ = graded
    assert answer["success"], answer
    assert scores(course / "gradebook.db") == {
        "hostile": {"calculate-srv": 2, "calculator-server": 12, "calculator-client": 0},
        "no_json": {"calculate-srv": 2, "calculator-server": 11, "calculator-client": 0},
        "no_client": {"calculate-srv": 0, "calculator-server": 0, "calculator-client": 0},
        "only_notebook": {"calculate-srv": 2, "calculator-server": 0, "calculator-client": 6},
    }


def test_both_commands_give_the_same_scores(graded):
    course, _, results = graded
    by_nbgrader = scores(course / "gradebook.db")
    assert by_nbgrader == scores(course / "other.db")
    assert {name: sum(points.values()) for name, points in by_nbgrader.items()} == {
        name: line["score"] for name, line in results.items()
    }


def test_cells_marked_by_hand_wait_for_the_instructor(graded):
    with Gradebook(f"sqlite:///{graded[0] / 'gradebook.db'}") as book:
        for s in book.assignment_submissions("calculator"):
            waiting = [grade.name for grade in s.notebooks[0].grades if grade.needs_manual_grade]
            assert waiting == ["exponentiation"] and s.max_score == 25


def formgrader_page(course: Path, student: str) -> str:
    exporter = HTMLExporter(template_name="formgrade", extra_template_basedirs=[handlers.template_path])
    path = course / "autograded" / student / "calculator" / "calculator.ipynb"
    return exporter.from_filename(
        str(path), resources={"base_url": "/", "student": student, "notebook_path": "n", "index": 0, "total": 1}
    )[0]


def test_the_instructor_sees_the_notebook_as_handed_in(graded):
    course = graded[0]
    shown = json.loads((course / "autograded" / "hostile" / "calculator" / "calculator.ipynb").read_text())
    faked = cell(shown, "calculator-server")
    assert "".join(faked["source"]) == "import os\nos._exit(0)"
    assert "".join(faked["outputs"][1]["text"]).startswith("kept as handed in")
    assert faked["metadata"]["nbgrader"]["points"] == 12
    assert "not in the notebook that was handed in" in "".join(cell(shown, "calculator-client")["source"])
    named = [c["metadata"]["nbgrader"]["grade_id"] for c in shown["cells"] if "nbgrader" in c["metadata"]]
    assert sorted(named) == sorted(set(named)) and len(named) == 7


def test_formgrader_shows_what_each_hidden_test_said_beside_its_cell(graded):
    course, _, reports = graded
    cells = {test.id: test.cell for test in exercises.load("calculator").tests}
    for student in ("no_client", "no_json"):
        shown = json.loads((course / "autograded" / student / "calculator" / "calculator.ipynb").read_text())
        lost = [test for test in reports[student]["tests"] if not test["points"]]
        assert lost
        for test in reports[student]["tests"]:
            said = "".join(cell(shown, cells[test["id"]])["outputs"][0]["text"])
            assert f"/{test['max_points']:g}  {test['title']}" in said and test["message"] in said
        page = html.unescape(formgrader_page(course, student))
        assert all(test["title"] in page for test in lost)


def test_no_script_of_a_student_runs_in_formgrader(graded):
    course = graded[0]
    page, clean = formgrader_page(course, "hostile"), formgrader_page(course, "only_notebook")
    assert "bold" in page and page.count("<script") == clean.count("<script")
    for tag in re.findall(r"<[a-zA-Z][^>]*>", page):
        assert not (tag.startswith("<img") and "seen.png" in tag)
        assert "alert(" not in tag or re.match(r'<a href="java[^:]*%E2%81%A0', tag), tag  # no scheme: a broken link


def test_a_notebook_that_is_none_is_graded_by_its_files(graded):
    assert "cannot be shown" in formgrader_page(graded[0], "no_json")


@pytest.fixture(scope="module")
def feedback(graded) -> Path:
    course = graded[0]
    with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
        grade = book.find_grade("exponentiation", "calculator", "calculator", "no_json")
        grade.manual_score, grade.needs_manual_grade = 4, False
        book.find_comment("exponentiation", "calculator", "calculator", "no_json").manual_comment = "Good <b>point</b>."
        book.db.commit()
    answer = release.api(course).generate_feedback("calculator")
    assert answer["success"], answer
    return course / "feedback"


def test_nbgraders_feedback_is_the_students_page(graded, feedback):
    page = (feedback / "no_json" / "calculator" / "calculator.html").read_text()
    assert all(title in page for title in ("The server adds", "13 of 20", "4 of 5", "Good &lt;b&gt;point&lt;/b&gt;."))
    assert "Missing: calculator_client.py" in (feedback / "no_client" / "calculator" / "calculator.html").read_text()


def test_the_page_and_the_gradebook_add_up_to_the_same(graded, feedback):
    """Tests and marks together; "so far" while an answer waits for its mark."""
    with Gradebook(f"sqlite:///{graded[0] / 'gradebook.db'}") as book:
        found = {
            s.student.id: (s.score, s.max_score, s.needs_manual_grade)
            for s in book.assignment_submissions("calculator")
        }
    assert len({waiting for *_, waiting in found.values()}) == 2
    for student, (score, most, waiting) in found.items():
        page = (feedback / student / "calculator" / "calculator.html").read_text()
        assert f">{score:g} of {most:g} points{' so far' if waiting else ''}</p>" in page


def test_feedback_holds_nothing_but_the_page_and_what_was_handed_in(graded, feedback):
    course, *_ = graded
    kept = leaks.secrets("calculator", repository() / "notebooks" / "calculator" / "calculator.ipynb")
    details = (course / "out" / "details.jsonl").read_text()
    inputs = {number for number in re.findall(r"-?\d+\.\d+", details) if len(number) >= 5}
    assert len(inputs) >= 2
    for path in (path for path in feedback.rglob("*") if path.is_file()):
        if path.name == "calculator.html":
            page = path.read_text()
            assert not [line for line in kept if line.lower() in " ".join(page.split()).lower()]
            assert not [number for number in inputs if number in page]
        else:
            assert path.name in FILES
            assert path.read_bytes() == (course / "submitted" / path.relative_to(feedback)).read_bytes()


def test_a_failure_of_the_grader_is_no_score_and_stops_no_one_else(graded, monkeypatch):
    course, *_ = graded
    for student in ("x_fault", "y_after"):
        hand_in(course, student, {}, '{"cells": []}')

    def grade(handed_in, *_):
        status = INFRASTRUCTURE_ERROR if handed_in.student == "x_fault" else "graded"
        return Report(
            handed_in.student, "calculator", status, None if status == INFRASTRUCTURE_ERROR else 0, 20, 0, 0.0
        )

    monkeypatch.setattr(plugins, "grade", grade)
    answer = release.api(course).autograde("calculator", "[xy]_*", force=False)
    assert not answer["success"] and "x_fault/calculator was not graded" in answer["log"]
    assert not (course / "autograded" / "x_fault" / "calculator").exists()
    found = scores(course / "gradebook.db")
    assert found["x_fault"] == {} and found["y_after"].keys() == found["hostile"].keys()


def test_on_a_full_disk_autograde_keeps_what_was_typed_by_hand(graded, feedback, monkeypatch):
    """nbgrader removes what it wrote before, and it can be written again; a mark and a comment cannot."""
    course, *_ = graded
    shown = course / "autograded" / "no_json" / "calculator"

    def typed() -> tuple[float | None, str | None]:
        names = "exponentiation", "calculator", "calculator", "no_json"
        with Gradebook(f"sqlite:///{course / 'gradebook.db'}") as book:
            return book.find_grade(*names).manual_score, book.find_comment(*names).manual_comment

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(plugins, "grade", lambda found, *_: Report(found.student, "calculator", "graded", 0, 20, 0, 0))
    before = typed()
    assert before == (4, "Good <b>point</b>.")
    with monkeypatch.context() as disk:
        disk.setattr(FilesWriter, "write", full)
        assert not release.api(course).autograde("calculator", "no_json")["success"]
    assert not shown.exists() and typed() == before
    assert release.api(course).autograde("calculator", "no_json")["success"]
    assert shown.exists() and typed() == before


def test_a_file_of_the_folder_goes_before_the_notebooks_cell(tmp_path, blank):
    hand_in(tmp_path, "student", {SERVER: WRONG[SERVER]}, json.dumps(completed(blank, REFERENCE)))
    folder = tmp_path / "submitted" / "student" / "calculator"
    assert reading.read(folder, "student", "calculator", FILES).files == REFERENCE | {SERVER: WRONG[SERVER]}


def test_a_cell_is_the_file_that_running_it_would_write():
    for path in repository().glob("solutions/*/*.*"):
        book = repository() / "notebooks" / path.parent.name / f"{path.parent.name}.ipynb"
        cells = reading.read_notebook(book)
        if f"%%exercise {path.name}" in book.read_text():
            assert exercise_file(cells, path.name) == path.read_bytes()
        else:
            assert exercise_file(cells, path.name) is None


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\xff\xfe",
        b"[]",
        b"null",
        b'{"cells": 3}',
        b'{"cells": [3]}',
        b'{"cells": [{"cell_type": "code"}]}',
        b"[" * 1_000_000,
        b'{"cells": [' + b"9" * 5000 + b"]}",
        b" " * (notebook.MAX_BYTES + 1),
        b'{"cells": [{"cell_type": "code", "source": 1}]}',
        b'{"worksheets": []}',
    ],
    ids=range(12),
)
def test_what_is_no_notebook_is_refused(text):
    with pytest.raises(UnreadableNotebook):
        notebook.parse(text)


def released_files(course: Path):
    return sorted(path.relative_to(course / "release") for path in (course / "release").rglob("*") if path.is_file())


def test_a_release_is_the_notebooks_alone_and_shows_no_answer(course):
    names = release.names()
    assert {str(path) for path in released_files(course)} == {f"{name}/{name}.ipynb" for name in names}
    for name in names:
        kept = leaks.secrets(name, repository() / "notebooks" / name / f"{name}.ipynb")
        assert len(kept) > 10 and list(leaks.leaks(course / "release" / name, kept)) == []


@pytest.mark.parametrize(
    ("course", "students", "said"),
    [
        (".", ".", "the course folder FOLDER, which has the answers, would be in it"),
        ("class/grading", "class", "the course folder FOLDER/class/grading, which has the answers, would be in it"),
        ("link", "class", "the course folder FOLDER/class, which has the answers, would be in it"),
        ("class", "class/submitted/ada", "it belongs to a step of the course folder FOLDER/class"),
        ("given/notebooks", "others", "the course folder FOLDER/given/notebooks lies in FOLDER/given, which was made "),
        ("class", str(repository()), f"the repository {repository()}, which has the answers, would be in it"),
        ("class", str(repository().parent), f"the repository {repository()}, which has the answers, would be in it"),
    ],
)
def test_a_folder_for_students_that_would_hold_answers_is_refused_before_anything_is_made(
    tmp_path, course, students, said
):
    """With `--students .`, where `--course` is `.` as well, students would get the solved notebooks."""
    (tmp_path / "given/notebooks/.released").mkdir(parents=True)
    (tmp_path / "class").mkdir()
    (tmp_path / "link").symlink_to("class")
    before = sorted(tmp_path.rglob("*"))
    command = [Path(sys.executable).with_name("autograder"), "release", "calculator"]
    done = subprocess.run(
        [*command, "--course", course, "--students", students], capture_output=True, text=True, cwd=tmp_path
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"autograder: {students} cannot be the folder for students: ")
    assert said.replace("FOLDER", str(tmp_path)) in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


SOLVED_NOTEBOOK = (repository() / "notebooks/calculator/calculator.ipynb").read_text()
SOLVED_PROGRAM = (repository() / "solutions/calculator/calculator_server.py").read_text()


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("calculator/calculator.ipynb", SOLVED_NOTEBOOK, "which has answers"),
        ("notebooks/.ipynb_checkpoints/calculator-checkpoint.ipynb", SOLVED_NOTEBOOK, "which has answers"),
        ("notebooks/calculator/calculator_server.py", SOLVED_PROGRAM, "which has answers"),
        ("old/gradebook.db", "", "which belongs to a course folder or to results"),
        ("results/details.jsonl", "", "which belongs to a course folder or to results"),
        ("answers", None, "which leads to "),
    ],
)
def test_a_folder_for_students_that_has_answers_already_is_refused(tmp_path, name, text, said):
    """As one with the solved notebooks of `--notebooks`, or that is the course folder by another mount."""
    there = tmp_path / "students" / name
    there.parent.mkdir(parents=True)
    if text is None:
        there.symlink_to("../grading")
    else:
        there.write_text(text)
    with pytest.raises(UsageError, match="cannot be the folder for students: it has ") as refused:
        apart.expect_apart(tmp_path / "grading", tmp_path / "students")
    assert name in str(refused.value) and said in str(refused.value)


def test_what_students_work_with_is_no_answer(tmp_path):
    (tmp_path / "students/notebooks/calculator").mkdir(parents=True)
    (tmp_path / "students/notebooks/calculator/calculator_server.py").write_text("print('mine')\n")
    (tmp_path / "students/link.py").symlink_to("notebooks/calculator/calculator_server.py")
    (tmp_path / "students/.venv").symlink_to("/usr")
    apart.expect_apart(tmp_path / "grading", tmp_path / "students")


@pytest.mark.parametrize(
    "out", ["given/results", "given", "class/source/calculator", "class/submitted/ada", "class/release"]
)
def test_results_are_not_written_where_students_get_them(tmp_path, out):
    (tmp_path / "given/notebooks/.released").mkdir(parents=True)
    (tmp_path / "class").mkdir()
    (tmp_path / "class/nbgrader_config.py").touch()
    with pytest.raises(UsageError, match="choose another --output"):
        apart.expect_private(tmp_path / out)
    for fine in ("out", "class/out", "class", "source/out"):
        apart.expect_private(tmp_path / fine)


def test_results_in_the_folder_of_an_exercise_are_not_released(tmp_path):
    (tmp_path / "source/calculator").mkdir(parents=True)
    (tmp_path / "source/calculator/details.jsonl").touch()
    with pytest.raises(UsageError, match=r"details\.jsonl would be released: it belongs to a grading"):
        release.release(tmp_path, ["calculator"])
    assert not (tmp_path / "release").exists()


def test_dates_stay_in_force_and_in_the_notebook_until_they_are_changed(tmp_path):
    """A second release without them told students nothing of the dates by which their work was judged."""
    due, end = (datetime(2026, 11, day, 10, tzinfo=UTC) for day in (20, 21))

    def noted(*dates) -> dict:
        folder = release.release(tmp_path, ["calculator"], None, *dates)[0]
        return json.loads((folder / "calculator.ipynb").read_text())["metadata"].get("course", {})

    both = {"due": due.isoformat(), "until": end.isoformat()}
    assert noted(due, end) == noted() == both
    assert noted(None, ends.NONE) == {"due": due.isoformat()}


def test_a_release_writes_through_no_link(course, tmp_path):
    """A file there may be the same one as in a folder elsewhere."""
    kept = tmp_path / "mine.md"
    kept.write_text("mine")
    (tmp_path / "students").mkdir()
    os.link(kept, tmp_path / "students/README.md")
    release.hand_out(tmp_path / "students", [course / "release/calculator"])
    assert kept.read_text() == "mine" and (tmp_path / "students/README.md").read_text() != "mine"


@pytest.mark.parametrize(("course", "students"), [("grading", "students"), (".", "students"), ("a/b", "a/c")])
def test_a_folder_for_students_beside_or_in_the_course_folder_is_not_refused(tmp_path, course, students):
    apart.expect_apart(tmp_path / course, tmp_path / students)


def test_what_students_get_can_be_set_up_and_holds_no_answer(course, tmp_path):
    """All of `course`, the set-up, the notebooks and a README; of the answers and the grader not even the names."""
    released = [course / "release" / name for name in release.names()]
    for _ in range(2):  # again, to bring it up to date
        apart.expect_apart(course, tmp_path)
        release.hand_out(tmp_path, released)
    files = {str(path.relative_to(tmp_path)): path for path in tmp_path.rglob("*") if path.is_file()}
    here = {
        str(path.relative_to(repository()))
        for path in (repository() / "course").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert files.keys() - here == {
        "LICENSE",
        "README.md",
        "jupyterlab.png",
        "when-it-goes-wrong.md",
        *(f"when-it-goes-wrong/{page.name}" for page in (repository() / "docs/when-it-goes-wrong").iterdir()),
        "pyproject.toml",
        "environment/install",
        "environment/shell",
        "environment/start",
        "environment/requirements.lock",
        "environment/colcon.lock",
        ".dockerignore",
        ".devcontainer/devcontainer.json",
        "environment/Dockerfile",
        "binder/Dockerfile",
        "notebooks/index.ipynb",
        *(f"notebooks/{where}/{name}.ipynb" for name in release.names() for where in (name, f".released/{name}")),
    }
    assert all(files[f"environment/{name}"].stat().st_mode & 0o100 for name in ("install", "start"))
    kept = [
        text
        for name in release.names()
        for text, what in leaks.secrets(name, repository() / "notebooks" / name / f"{name}.ipynb").items()
        if what.startswith("all of the solution")
    ]
    for name, path in files.items():
        shown = " ".join(path.read_text(errors="replace").split())
        assert "autograder" not in shown and not [text for text in kept if text in shown], name
    project = tomllib.loads(files["pyproject.toml"].read_text())
    assert project["tool"]["setuptools"]["packages"]["find"]["include"] == ["course*"]
    start = json.loads(files["notebooks/index.ipynb"].read_text())
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in start["cells"])
    assert files["README.md"].read_text().startswith("# ROS 2") and "%%exercise" in files["README.md"].read_text()
    assert files["README.md"].read_text() == (repository() / "docs" / "student" / "README.md").read_text()


def test_a_notebook_that_was_edited_in_the_course_is_kept(tmp_path, caplog):
    staged = tmp_path / "source" / "calculator" / "calculator.ipynb"
    for edit in ("", " ", "  "):
        staged.parent.mkdir(parents=True, exist_ok=True)
        staged.write_text(staged.read_text() + edit if edit else "first")
        text = staged.read_text()
        release._stage(repository() / "notebooks" / "calculator" / "calculator.ipynb", staged, tmp_path / "replaced")
        assert text in [path.read_text() for path in (tmp_path / "replaced").iterdir()]
    assert len([*(tmp_path / "replaced").iterdir()]) == 3 and caplog.text.count("kept as") == 3


LEAKS = {
    "a marking scheme": ("marking scheme", lambda text: text + "\n**Marking scheme**: 1 point for each"),
    "a hidden test": ("hidden", lambda text: text + "\n" + suite_line()),
    "the word": ("only for instructors", lambda text: text + "\nsee autograder/hidden"),
    "solution lines": (
        "the solution",
        lambda text: (
            text
            + """
self.srv = self.create_service(Calculate, '/calculator', self.calculate)
self.get_logger().info('Calculator ready')"""
        ),
    ),
}


def suite_line() -> str:
    text = (HIDDEN / "calculator" / "suite.py").read_text()
    return next(line for line in text.splitlines() if '("' in line and len(line) > 50)


@pytest.mark.parametrize("kind", LEAKS)
def test_leaks_finds(kind, tmp_path):
    source = repository() / "notebooks" / "calculator" / "calculator.ipynb"
    what, change = LEAKS[kind]
    (tmp_path / "notes.md").write_text(change("Notes."))
    assert what in next(leaks.leaks(tmp_path, leaks.secrets("calculator", source)))


def test_a_release_that_would_leak_is_refused_and_removed(tmp_path):
    """A marking scheme was written outside the marks."""
    book = json.loads((repository() / "notebooks" / "calculator" / "calculator.ipynb").read_text())
    question = next(cell for cell in book["cells"] if cell["id"] == "question")
    question["source"] = [*question["source"], "\n\n**Marking scheme** (5 points): all or nothing."]
    folder = tmp_path / "notebooks" / "calculator"
    folder.mkdir(parents=True)
    (folder / "calculator.ipynb").write_text(json.dumps(book))
    (folder / "calculator_server.py").write_text("left by running the notebook")
    done = subprocess.run(
        [
            str(Path(sys.executable).with_name("autograder")),
            "release",
            "calculator",
            "--course",
            str(tmp_path),
            "--notebooks",
            str(folder.parent),
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and done.stdout == ""
    assert re.fullmatch(r"autograder: calculator is not released: .*marking scheme.*\n", done.stderr)
    assert released_files(tmp_path) == [] and not (tmp_path / "source/calculator/calculator_server.py").exists()


LOADING = """
import sys
import autograder.gradebook.entering
print(*({"alembic", "jupyter_server", "nbconvert"} & {*sys.modules}))
import nbgrader
from nbgrader.server_extensions import formgrader
formgrader.load_jupyter_server_extension = print
nbgrader.load_formgrader("as a server does")
print(nbgrader.api.get_alembic_version())
"""


def test_commands_load_little_of_nbgrader_and_a_server_all_and_a_new_gradebook_has_its_schemas_version():
    """The version is read in this process, because nbgrader's way runs a program for each new gradebook."""
    done = subprocess.run([sys.executable, "-c", LOADING], capture_output=True, text=True, check=True)
    assert done.stdout == f"\nas a server does\n{database.version()}\n"
