"""`autograder new`: what it makes can be graded, released and tested at once; a wrong name writes nothing."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from autograder.authoring import new as authoring
from autograder.authoring.kinds import Kind
from autograder.errors import UsageError
from course.notebook.progress import progress

ROOT = Path(__file__).parents[2]
NAME = "wave_hello"
POINTS = 5  # of the kind that is made by default


def paths(name: str) -> list[str]:
    """Return what is made for an exercise."""
    return [
        f"notebooks/{name}/{name}.ipynb",
        f"solutions/{name}/{name}.py",
        *(f"autograder/hidden/{name}/{file}" for file in HIDDEN),
        f"tests/hidden/answers/{name}.py",
    ]


HIDDEN = ("exercise.toml", "conversation.py", "conftest.py", "suite.py")
MADE = paths(NAME)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs Python in a copy of the repository, whose packages come before the installed ones.

    What is compiled already comes along, so that no command compiles it again.
    """
    copy = tmp_path_factory.mktemp("copy")
    for folder in ("autograder", "course", "solutions", "tests"):
        shutil.copytree(ROOT / folder, copy / folder)
    for notebook in ROOT.glob("notebooks/[!.]*/*.ipynb"):
        (copy / "notebooks" / notebook.stem).mkdir(parents=True)
        shutil.copy(notebook, copy / "notebooks" / notebook.stem)
    shutil.copy(ROOT / "notebooks/index.ipynb", copy / "notebooks")
    shutil.copy(ROOT / "pyproject.toml", copy)

    def python(*command: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
        return subprocess.run(
            [sys.executable, *command], cwd=copy, env=environment, capture_output=True, text=True, timeout=900
        )

    python.root = copy
    return python


@pytest.fixture(scope="module")
def autograder(run):
    """Runs the command line of the copy."""
    return lambda *arguments: run("-c", "from autograder.cli import main; main()", *arguments)


@pytest.fixture(scope="module")
def made(run, autograder):
    """The copy, after `autograder new`; what it has made is removed in the end."""
    before = files(run.root)
    done = autograder("new", NAME)
    assert (done.returncode, done.stderr) == (0, "")
    assert files(run.root) - before == set(MADE)
    assert all(file in done.stdout for file in MADE)
    yield run.root
    remove(run.root, MADE)
    assert files(run.root) == before


def remove(root: Path, made: list[str]) -> None:
    for file in made[:3]:
        shutil.rmtree(root / Path(file).parent)
    (root / made[-1]).unlink()


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_answers_of_ones_own_can_be_tried(made, autograder, confinement, tmp_path):
    """The solution, which keeps all points, one that does nothing, and the tests that the second does not lose."""
    program = (made / f"solutions/{NAME}/{NAME}.py").read_text()
    for name, content in {"right/same": program, "wrong/nothing": "print('hello')\n"}.items():
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / f"{NAME}.py").write_text(content)
    done = autograder("try", str(tmp_path), "--assignment", NAME)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert f"right/same: {POINTS} of {POINTS}\n" in done.stdout
    assert f"wrong/nothing: 0 of {POINTS}\n" in done.stdout
    assert done.stdout.endswith("Each hidden test is lost by a wrong answer.\n")


def test_it_can_be_released(made, autograder, tmp_path):
    done = autograder("release", NAME, "--course", str(tmp_path))
    assert done.returncode == 0, done.stderr
    released = (tmp_path / "release" / NAME / f"{NAME}.ipynb").read_text()
    assert "YOUR CODE HERE" in released and "Hello, " not in released


@pytest.fixture
def german(made, tmp_path):
    """The folder of a page in German: its text is translated, its cells of code are not."""
    notebook = nbformat.read(made / f"notebooks/{NAME}/{NAME}.ipynb", 4)
    text = (Path(__file__).parent / "greeter.de.txt").read_text(encoding="utf-8")
    translated = dict(part.split("\n", 1) for part in text.split("=== markdown ")[1:])
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = translated.pop(cell.id).strip().format(title="Wave hello", name=NAME)
    assert not translated
    (tmp_path / "de" / NAME).mkdir(parents=True)
    nbformat.write(notebook, tmp_path / "de" / NAME / f"{NAME}.ipynb")
    return tmp_path / "de"


def test_a_page_in_another_language_is_released_worked_on_and_graded(made, autograder, german, confinement, tmp_path):
    """No part of the course looks for English words on a page: cells are known by their marks, hints by a number."""
    done = autograder("release", NAME, "--course", str(tmp_path / "course"), "--notebooks", str(german))
    assert done.returncode == 0, done.stderr
    page = nbformat.read(tmp_path / "course/release" / NAME / f"{NAME}.ipynb", 4)
    assert page.cells[0].source.startswith("# Wave hello: ein Dienst")
    (stub,) = (cell for cell in page.cells if "YOUR CODE HERE" in cell.source)
    work = tmp_path / "ada" / NAME
    work.mkdir(parents=True)
    solution = (made / f"solutions/{NAME}/{NAME}.py").read_text()
    (work / f"{NAME}.py").write_text(solution)
    stub.source = f"{stub.source.splitlines()[0]}\n{solution}"
    nbformat.write(page, work / f"{NAME}.ipynb")
    report = json.loads(autograder("check", str(work), "--assignment", NAME, "--json").stdout)
    assert (report["status"], report["score"], report["max_score"]) == ("graded", POINTS, POINTS)
    assert [(part.name, part.state) for part in progress(tmp_path / "ada")] == [(NAME, "not run")]


def own_tests(run, name: str) -> None:
    """Run its notebook by nbval, its right and wrong answers, and what is held of every notebook and suite."""
    done = run(
        "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "matrix or not matrix", "-k", name, f"notebooks/{name}",
        "tests/notebooks/test_notebooks.py", "tests/notebooks/test_pages.py", "tests/hidden/test_answers.py",
        "tests/submissions/test_exercises.py",
    )  # fmt: skip
    assert done.returncode == 0 and "skipped" not in done.stdout, done.stdout
    (run.root / f"notebooks/{name}/{name}.py").unlink()  # nbval ran the notebook in its folder


@pytest.mark.matrix  # its parts are run by the other tests of this file
def test_its_own_tests_pass(made, run, confinement):
    own_tests(run, NAME)


@pytest.mark.matrix
@pytest.mark.timeout(900)
@pytest.mark.parametrize("like", [kind for kind in Kind if kind is not Kind.SERVICE], ids=str)
def test_each_kind_works_at_once(run, autograder, confinement, like):
    """Its solution passes all tests, and each of its wrong answers loses what is written beside it."""
    name = f"{like}_hello"
    done = autograder("new", name, "--like", like)
    assert (done.returncode, done.stderr) == (0, "")
    try:
        own_tests(run, name)
    finally:
        remove(run.root, paths(name))


def test_each_kind_is_named_after_its_exercise_and_passes_the_guards(run):
    """As text: nothing is run."""
    made = []
    for kind in Kind:
        name = f"third_{kind}"
        texts = {file: authoring._render(f"{file}.jinja", name, kind) for file in (*HIDDEN, "answers.py")}
        notebook = authoring._notebook(authoring._render("notebook.txt.jinja", name, kind))
        texts["solution.py"] = authoring._solution(notebook)
        for file, text in texts.items():
            assert name in text, (kind, file)
            if file.endswith(".py") and file != "solution.py":
                made.append(run.root / "autograder" / "hidden" / name / file)
                made[-1].parent.mkdir(exist_ok=True)
                made[-1].write_text(text.replace("from . import", "from tests.hidden.answers import"))
        assert f'super().__init__("{name}")' in texts["solution.py"]
        assert f"class Third{kind.capitalize()}(Node)" in texts["solution.py"]
        assert all(len(line) <= 90 for line in texts["solution.py"].splitlines()), kind
        worth = sum(map(int, re.findall(rf'@points\((\d+), cell="{name}"\)', texts["suite.py"])))
        (checks,) = (cell for cell in notebook.cells if cell.id == name)
        assert checks.metadata["nbgrader"]["points"] == worth > 0
        tested, answers = re.findall(r"^def test_(\w+)", texts["suite.py"], re.MULTILINE), texts["answers.py"]
        assert all(f'{{"{test}"}}' in answers for test in tested), kind  # lost alone by a wrong answer
    try:
        for command in (["check", "--no-cache"], ["format", "--check", "--no-cache"]):
            done = run("-m", "ruff", *command, *map(str, made))
            assert done.returncode == 0, done.stdout
    finally:
        for folder in {path.parent for path in made}:
            shutil.rmtree(folder)


def test_what_it_makes_passes_the_guards(made, run):
    python = [file for file in MADE if file.endswith(".py")]
    for command in (["check", "--no-cache"], ["format", "--check", "--no-cache"]):
        done = run("-m", "ruff", *command, *python)
        assert done.returncode == 0, done.stdout
    done = run("-m", "mypy", f"--cache-dir={ROOT / '.mypy_cache'}", f"autograder/hidden/{NAME}")
    assert done.returncode == 0, done.stdout


def test_a_second_one_of_that_name_is_refused(made, autograder):
    before = {file: (made / file).read_bytes() for file in MADE}
    done = autograder("new", NAME)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"autograder: '{NAME}' is taken: there is already notebooks/{NAME}\n"
    assert {file: (made / file).read_bytes() for file in MADE} == before


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Greeter", "not a valid name"),
        ("2greet", "not a valid name"),
        ("a-b", "not a valid name"),
        ("../greeter", "not a valid name"),
        ("", "not a valid name"),
        ("größe", "not a valid name"),
        ("class", "not a valid name"),
        ("g" * 41, "not a valid name"),
        ("services", "is taken: there is already notebooks/services"),
        ("calculator", "is taken"),
        ("random", "is the name of a Python module"),
        ("rclpy", "is the name of a Python module"),
    ],
)
def test_a_wrong_name_is_refused_in_a_line(monkeypatch, name, message):
    monkeypatch.setattr(authoring, "_notebook", pytest.fail)
    with pytest.raises(UsageError, match=message) as told:
        authoring.new(name)
    assert "\n" not in str(told.value)
