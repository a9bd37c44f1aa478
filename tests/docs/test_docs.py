"""The pages: what they name exists, what they link to is there, and the drawing shows what the guards hold."""

import re
import tomllib
from pathlib import Path

import nbformat
import pytest
import typer

from autograder import cli
from autograder.authoring.kinds import Kind
from autograder.submissions import exercises

ROOT = Path(__file__).parents[2]
STUDENT = ROOT / "docs/student/README.md"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/**/*.md"))]
TEXTS = {page.relative_to(ROOT).as_posix(): page.read_text(encoding="utf-8") for page in PAGES}
COMMAND = re.compile(r"(?<![\w/.])(?:\.venv/bin/)?autograder ([a-z]+)((?: [^`\n#]*)?)")
FOLDERS = "autograder|course|docs|environment|notebooks|solutions|tests"


def pages(*without: str):
    return pytest.mark.parametrize("page", [page for page in TEXTS if page not in without])


@pages()
def test_links_lead_to_files_that_are_there(page):
    links = re.findall(r"\]\((?!https?:)([^)#]+)", TEXTS[page])
    assert [link for link in links if not (ROOT / page).parent.joinpath(link).exists()] == []


@pages()
def test_links_into_notebooks_lead_to_headings(page):
    for notebook, heading in re.findall(r"\]\(([^)#:]+\.ipynb)#([^)]+)\)", TEXTS[page]):
        cells = nbformat.read((ROOT / page).parent / notebook, 4).cells
        lines = [line for cell in cells if cell.cell_type == "markdown" for line in cell.source.splitlines()]
        headings = {line.lstrip("# ").replace(" ", "-") for line in lines if line.startswith("#")}
        assert heading in headings, notebook


@pytest.mark.parametrize("name", exercises.names())
def test_a_lesson_names_hidden_tests_that_exist(name):
    named = set(re.findall(r"`(test_\w+)`", TEXTS[f"docs/teaching/{name}.md"]))
    assert named
    assert named <= {test.id for test in exercises.load(name).tests}


@pages("CHANGELOG.md", "docs/ADDING.md")
def test_paths_that_are_named_exist(page):
    text = TEXTS[page].replace("autograder new greeter", "")
    named = re.findall(rf"(?<![\w/.-])(?:{FOLDERS})(?:/[\w.-]+)+", text)
    known = {path.rstrip(".") for path in named}
    assert sorted(path for path in known if not (ROOT / path).exists()) == []


def test_the_new_exercise_of_adding_is_what_the_command_makes():
    templates = ROOT / "autograder/authoring/templates"
    text = TEXTS["docs/ADDING.md"]
    for template in ("conversation.py", "conftest.py", "suite.py", "exercise.toml"):
        for kind in Kind:
            assert any((folder / f"{template}.jinja").exists() for folder in (templates / kind, templates))
        assert f"`autograder/hidden/greeter/{template}`" in text
    assert all(f"`{cell}`" in text for cell in ("exercise", "greeter-file", "greeter", *Kind))


@pages()
def test_commands_and_their_options_exist(page):
    commands = typer.main.get_command(cli.app).commands
    for name, rest in COMMAND.findall(TEXTS[page]):
        if name in commands:
            known = {option for parameter in commands[name].params for option in parameter.opts}
            assert set(re.findall(r"--[a-z-]+", rest)) <= known, f"{name}{rest}"
        else:
            assert not rest.strip().startswith("--"), f"{page}: autograder {name}"


def test_every_command_is_explained_to_instructors_or_developers():
    told = {name for text in TEXTS.values() for name, _ in COMMAND.findall(text)}
    assert set(typer.main.get_command(cli.app).commands) <= told


def test_the_readme_names_every_command():
    assert {name for name, _ in COMMAND.findall(TEXTS["README.md"])} >= set(typer.main.get_command(cli.app).commands)


def test_the_readme_is_short():
    assert len(TEXTS["README.md"].split()) <= 700


def test_the_readme_shows_three_pictures_that_load_quickly():
    shown = re.findall(r"^!\[[^]]+\]\((docs/pictures/[^)]+\.png)\)$", TEXTS["README.md"], re.MULTILINE)
    assert len(shown) == 3
    assert {ROOT / name for name in shown} == set((ROOT / "docs/pictures").iterdir())
    assert [name for name in shown if (ROOT / name).stat().st_size >= 200_000] == []


def test_students_see_the_same_picture_of_the_lab():
    (name,) = re.findall(r"^!\[[^]]+\]\(([^)]+\.png)\)$", STUDENT.read_text(encoding="utf-8"), re.MULTILINE)
    assert (STUDENT.parent / name).read_bytes() == (ROOT / "docs/pictures" / name).read_bytes()


def test_the_drawing_shows_the_layers_that_are_held():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    for package, letter in (("autograder", "A"), ("course", "C")):
        layers = next(contract["layers"] for contract in contracts if contract.get("containers") == [package])
        drawn = re.findall(rf'\b{letter}(\d+)\["([^"]+)"\]', TEXTS["docs/architecture.md"])
        assert [int(number) for number, _ in drawn] == list(range(1, len(layers) + 1))
        assert [set(parts.split(", ")) for _, parts in drawn] == [set(layer.split(" | ")) for layer in layers]
        arrows = re.findall(rf"\b({letter}\d+)(?:\[[^\]]+\])? --> ({letter}\d+)\b", TEXTS["docs/architecture.md"])
        assert arrows == [(f"{letter}{n}", f"{letter}{n + 1}") for n in range(1, len(layers))]


def test_the_page_for_students_names_their_files_and_nothing_of_the_grader():
    text = TEXTS[STUDENT.relative_to(ROOT).as_posix()]
    for name in exercises.names():
        assert f"`{name}`" in text and all(f"`{file}`" in text for file in exercises.load(name).files)
    assert not re.search(r"autograder|solutions|hidden", text)


@pages("CHANGELOG.md", "docs/architecture.md")
def test_python_modules_that_are_named_exist(page):
    for name in re.findall(r"(?<!tests\.)\bautograder\.([a-z_]+)\b", TEXTS[page]):
        assert (ROOT / "autograder" / name).exists() or (ROOT / f"autograder/{name}.py").exists(), name


def test_the_modules_that_the_changelog_names_now_exist():
    moved = re.findall(r"^\| `.*\| (.+) \|$", TEXTS["CHANGELOG.md"], re.MULTILINE)
    named = [name for cell in moved for name in re.findall(r"`((?:autograder|course)\.[\w.]+)`", cell)]
    assert len(named) > 20
    for name in named:
        path = ROOT / name.replace(".", "/")
        assert path.is_dir() or path.with_suffix(".py").exists(), name


def test_the_faq_has_questions_of_both():
    students, instructors = TEXTS["docs/faq.md"].split("## From instructors")
    assert students.count("\n### ") >= 6 and instructors.count("\n### ") >= 6
