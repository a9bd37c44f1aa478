"""`autograder release`: the student version of the notebooks, and the proof that it shows nothing of the answers.

nbgrader takes the solutions out.  Afterwards every released file is searched for the text of the solutions and marking
schemes, of the reference files and of the hidden suites: one forgotten mark in a notebook would otherwise be found by
the class.
"""

import hashlib
import json
import logging
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from traitlets.config import PyFileConfigLoader
from traitlets.log import get_logger

from autograder.errors import Leak, UsageError
from autograder.gradebook.config import COURSE_FILE
from autograder.paths import COURSE, HIDDEN, repository
from autograder.results import storage
from autograder.submissions import exercises
from course.environment import prepare
from course.notebook import cells
from course.notebook.cells import MARKERS, SOLUTION

log = logging.getLogger(__name__)

TELLTALES = ("BEGIN SOLUTION", "END SOLUTION", "HIDDEN TESTS", "marking scheme", "mark scheme", "autograder")
ANSWER = "the solution or its marking scheme"
TELLING = 2  # lines of an answer in one place: a single one may be in any program (`response.success = True`)
LONG = 16  # characters: shorter lines (`return response`) say nothing


def names(notebooks: Path) -> list[str]:
    """The notebooks that can be released."""
    return sorted(path.stem for path in notebooks.glob("*/*.ipynb") if path.stem == path.parent.name)


def release(course: Path, chosen: Iterable[str] = (), notebooks: Path | None = None) -> list[Path]:
    """Make the student version of the `chosen` notebooks, or of all, in `course`/release; return its folders.

    Only notebooks are staged, never the files that running them leaves beside them.  Raises UsageError, and Leak after
    removing the release.
    """
    notebooks = notebooks or repository() / "notebooks"
    known, chosen = names(notebooks), list(chosen)
    if not known:
        raise UsageError(f"there are no notebooks in {notebooks}")
    if unknown := set(chosen) - set(known):
        raise UsageError(f"there is no notebook '{unknown.pop()}'; there are: {', '.join(known)}")
    config = course / "nbgrader_config.py"
    course.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
    if not config.exists():
        config.write_text(COURSE_FILE, encoding="utf-8")
    nbgrader = api(course)
    return [_release(nbgrader, course, name, notebooks / name / f"{name}.ipynb") for name in chosen or known]


def hand_out(folder: Path, released: Iterable[Path]) -> None:
    """Lay out in `folder` what students need to work: released notebooks, `course` and its set-up, and no answers.

    What is there already is brought up to date; nothing is removed.
    """
    root = repository()
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(root / "course", folder / "course", ignore=ignored, dirs_exist_ok=True)
    shutil.copytree(
        root / "environment", folder / "environment", dirs_exist_ok=True, ignore=shutil.ignore_patterns("test", "lock")
    )
    for notebooks in released:
        shutil.copytree(notebooks, folder / "notebooks" / notebooks.name, dirs_exist_ok=True)
    shutil.copy(root / "LICENSE", folder)
    project = (root / "pyproject.toml").read_text(encoding="utf-8").replace(', "autograder*"', "")
    (folder / "pyproject.toml").write_text(
        re.sub(r"^autograder = .*\n", "", project, flags=re.MULTILINE), encoding="utf-8"
    )
    readme = (root / "README.md").read_text(encoding="utf-8")
    title, day = (
        readme.partition("\n")[0],
        re.search(r"^## The student's day\n+(.*?)^## ", readme, re.MULTILINE | re.DOTALL)[1],
    )
    (folder / "README.md").write_text(
        f"{title}\n\n`environment/start student` sets up what is missing, and opens JupyterLab.\n\n{day}",
        encoding="utf-8",
    )


def api(course: Path):
    """nbgrader with a course's configuration, as its Formgrader page uses it (an `nbgrader.apps.NbGraderAPI`).

    What its methods log is in what they return.
    """
    from nbgrader.apps import NbGraderAPI

    prepare()  # nbgrader runs `alembic`, which is beside this interpreter
    get_logger().propagate = False
    config = PyFileConfigLoader("nbgrader_config.py", path=str(course)).load_config()
    config.CourseDirectory.root = str(course.resolve())
    return NbGraderAPI(config=config)


def _release(nbgrader, course: Path, name: str, notebook: Path) -> Path:
    source, released = course / "source" / name, course / "release" / name
    if difference := exercises.difference(name, notebook) if name in exercises.names() else "":
        raise UsageError(f"{name} is not released: {difference}")
    source.mkdir(parents=True, exist_ok=True)
    _stage(notebook, source / notebook.name, course / "replaced")
    done = nbgrader.generate_assignment(name)
    if not done["success"]:
        said = done.get("error") or done.get("log") or ""
        raise UsageError(f"nbgrader could not release {name}: {said.strip().splitlines()[-1:]}")
    found = next(leaks(released, secrets(name, notebook)), None)
    if found:
        shutil.rmtree(released)
        raise Leak(f"{name} is not released: {found}")
    return released


def _stage(notebook: Path, staged: Path, kept: Path) -> None:
    """Copy the notebook to where nbgrader looks for it; another one that is there is kept, for it may have been edited."""
    if staged.exists() and (before := staged.read_bytes()) != notebook.read_bytes():
        kept.mkdir(parents=True, exist_ok=True)
        backup = kept / f"{staged.stem}-{hashlib.sha256(before).hexdigest()[:8]}.ipynb"
        backup.write_bytes(before)
        log.warning("%s was another one: kept as %s", staged, backup)
    shutil.copyfile(notebook, staged)


def secrets(name: str, notebook: Path) -> dict[str, str]:
    """What no released file may show of an exercise: each text with what it is."""
    marked = cells.read(notebook)
    public = [file.read_text(encoding="utf-8") for file in COURSE.rglob("*.py")]
    stubs = [SOLUTION.sub("", cell.source) for cell in marked if cell.solution]
    shown = _squeeze("\n".join([*public, *stubs]))
    kept = {text: "a word that is only for instructors" for text in TELLTALES}
    for cell in marked:
        for region in SOLUTION.findall(cell.source):
            kept.update(_lines(region, ANSWER, unless=shown))
    for file in sorted((repository() / "solutions" / name).glob("*")):
        if file.is_file():
            kept[_squeeze(MARKERS.sub("", file.read_text(encoding="utf-8")))] = f"all of the solution {file.name}"
    for file in sorted((HIDDEN / name).glob("*.py")):
        # A line that says what is asked or expected; `except ValueError:` is in many a program.
        lines = _lines(file.read_text(encoding="utf-8"), "a hidden test", unless="")
        kept.update({line: what for line, what in lines.items() if re.search(r"[\d\"']|test_", line)})
    return kept


def leaks(folder: Path, kept: dict[str, str]) -> Iterator[str]:
    """Where a file below `folder` shows one of the texts, for the instructor."""
    kept = {text.lower(): (text, what) for text, what in kept.items()}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        for place, shown in _texts(path):
            shown = _squeeze(shown).lower()
            found = [known for key, known in kept.items() if key in shown]
            answers = [what for _, what in found].count(ANSWER)
            for text, what in found:
                if what != ANSWER or answers >= TELLING:
                    yield f"{path.name}{place} shows {what}: {text[:60]!r}"


def _texts(path: Path) -> Iterator[tuple[str, str]]:
    """The text of a file, and of a notebook that of each cell and of its metadata."""
    raw = path.read_text(encoding="utf-8", errors="replace")
    if path.suffix != ".ipynb":
        yield "", raw
    else:
        for number, cell in enumerate(json.loads(raw)["cells"]):
            yield f", cell {number}", cells.text_of(cell["source"])
            yield f", cell {number}", "\n".join(_strings([cell.get("outputs", []), cell.get("metadata", {})]))
        yield (
            "'s metadata",
            "\n".join(_strings({key: value for key, value in json.loads(raw).items() if key != "cells"})),
        )


def _strings(value) -> Iterator[str]:
    """All text in a value of JSON; a list of lines is one text."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from _strings(inner)
    elif isinstance(value, list) and value and all(isinstance(line, str) for line in value):
        yield "".join(value)
    elif isinstance(value, list):
        for inner in value:
            yield from _strings(inner)


def _lines(text: str, what: str, unless: str) -> dict[str, str]:
    """The telling lines of a text that are not in `unless`."""
    lines = map(_squeeze, text.splitlines())
    return {line: what for line in lines if len(line) >= LONG and not IMPORT.match(line) and line not in unless}


IMPORT = re.compile(r"(?:from [\w.]+ )?import [\w., ]+$")


def _squeeze(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()
