"""`autograder release`: makes the student version of the notebooks, and all that students need to work with them.

nbgrader removes the solutions; `leaks` then searches every released file for remains.
"""

import hashlib
import json
import logging
import re
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from traitlets.config import PyFileConfigLoader
from traitlets.log import get_logger

from autograder.errors import Leak, UsageError
from autograder.gradebook import address, apart, course_folder, ends
from autograder.gradebook.leaks import leaks, secrets
from autograder.paths import repository
from autograder.results.targets import SOURCE
from autograder.submissions import exercises
from course.foundation import storage
from course.hand_in import DUE, NOTED, UNTIL
from course.notebook.stubs import RELEASED

if TYPE_CHECKING:
    from nbgrader.apps import NbGraderAPI

log = logging.getLogger(__name__)

START_PAGE = "index.ipynb"
PICTURE = "jupyterlab.png"  # in the students' README
DEVCONTAINER = "devcontainer.json"
# Files in environment/ that students do not get, or get in another place.
DEVELOPERS = ["check", "classroom", "lab-build", "lock", "proxy", "site", "test", DEVCONTAINER]
PROJECT = ("[build-system]", "[project", "[tool.setuptools")  # the sections of pyproject.toml for students

# The configuration of a new course folder.  It names the module, not its file, because the repository may move.
COURSE_FILE = """\
from autograder.gradebook.config import apply

c = get_config()
apply(c)
"""


def names(notebooks: Path | None = None) -> list[str]:
    """Return the notebooks that can be released, in the folder `notebooks` or else in this checkout."""
    notebooks = notebooks or repository() / "notebooks"
    return sorted(path.stem for path in notebooks.glob("*/*.ipynb") if path.stem == path.parent.name)


def release(
    course: Path,
    chosen: Iterable[str] = (),
    notebooks: Path | None = None,
    due: datetime | None = None,
    until: datetime | str | None = None,
) -> list[Path]:
    """Make the student version of the `chosen` notebooks, or of all, in `course`/release; return the folders made.

    Only notebooks are copied, not the files written by running them.  `due` goes into the gradebook, `until` into
    `ends.json` (`ends.NONE` removes an earlier one); what is not given stays as it was.  Both go into the notebook, so
    that handing in can say what is late.  Raises UsageError when a notebook cannot be released, and Leak, after
    removing the student version, when that would show an answer.
    """
    notebooks = notebooks or repository() / "notebooks"
    known, chosen = names(notebooks), list(chosen)
    if not known:
        raise UsageError(f"there are no notebooks in {notebooks}")
    if unknown := set(chosen) - set(known):
        raise UsageError(f"there is no notebook '{unknown.pop()}'; there are: {', '.join(known)}")
    set_up(course)
    nbgrader = api(course)
    end = until if isinstance(until, datetime) else None
    if due and end and end < due:
        raise UsageError("the end is before the due date")
    folders = [_release(nbgrader, course, name, notebooks / name / f"{name}.ipynb") for name in chosen or known]
    ends.change(course, {folder.name: until for folder in folders})
    in_force = ends.read(course)
    for folder in folders:
        with nbgrader.gradebook as book:
            if due:
                book.update_or_create_assignment(folder.name, duedate=due.astimezone(UTC).replace(tzinfo=None))
            given = book.find_assignment(folder.name).duedate  # now or in an earlier release
        dates = {DUE: given and given.replace(tzinfo=UTC), UNTIL: in_force.get(folder.name)}
        _note_dates(folder / f"{folder.name}.ipynb", dates)
    return folders


def _note_dates(notebook: Path, dates: dict[str, datetime | None]) -> None:
    """Write dates into a released notebook's metadata."""
    if noted := {key: time.astimezone(UTC).isoformat() for key, time in dates.items() if time}:
        content = json.loads(notebook.read_text(encoding="utf-8"))
        content["metadata"][NOTED] = noted
        storage.replace(notebook, (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode())


def set_up(course: Path) -> None:
    """Make nbgrader's course folder, unless it exists; raises UsageError for a path with which nbgrader errs."""
    address.expect_usable(course)
    config = course / course_folder.CONFIGURATION
    course.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
    (course / SOURCE).mkdir(exist_ok=True)  # which makes it one, see `course_folder`
    if not config.exists():
        config.write_text(COURSE_FILE, encoding="utf-8")


def hand_out(folder: Path, released: Iterable[Path]) -> None:
    """Copy into `folder` what students get: start page, released notebooks, `course`, its set-up, README; no answers.

    Existing files are updated; none is removed.
    """
    root = repository()
    for name, without in (("course", ["__pycache__"]), ("environment", DEVELOPERS)):
        ignore = shutil.ignore_patterns(*without)
        shutil.copytree(root / name, folder / name, ignore=ignore, copy_function=_copy, dirs_exist_ok=True)
    for notebooks in released:
        for where in (notebooks.name, f"{RELEASED}/{notebooks.name}"):  # to work in, and to restore a stub from
            shutil.copytree(notebooks, folder / "notebooks" / where, copy_function=_copy, dirs_exist_ok=True)
    (folder / "notebooks").mkdir(exist_ok=True)
    storage.replace(folder / "notebooks" / START_PAGE, start_page().encode())
    for name in ("LICENSE", ".dockerignore"):
        _copy(root / name, folder / name)
    # The places where Codespaces and editors look for it, and where Binder does.
    for name, where in ((DEVCONTAINER, ".devcontainer"), ("Dockerfile", "binder")):
        (folder / where).mkdir(exist_ok=True)
        _copy(root / "environment" / name, folder / where / name)
    storage.replace(folder / "pyproject.toml", _students_project(root / "pyproject.toml").encode())
    for path, page in pages().items():
        (folder / path).parent.mkdir(exist_ok=True)
        _copy(page, folder / path)


def _copy(source: Path | str, target: Path | str) -> None:
    """Copy a file with its mode, as a new one: what is there may be a link to a file elsewhere."""
    Path(target).unlink(missing_ok=True)
    shutil.copy(source, target)


def pages() -> dict[str, Path]:
    """Return the pages that students get beside the notebooks, and their picture, by path in the student folder."""
    docs = repository() / "docs"
    found = {name: docs / "student" / name for name in ("README.md", PICTURE)}
    found |= {"when-it-goes-wrong.md": docs / "when-it-goes-wrong.md"}
    return found | {f"{page.parent.name}/{page.name}": page for page in sorted(docs.glob("when-it-goes-wrong/*.md"))}


def start_page() -> str:
    """Return the start page, a notebook that is not an nbgrader assignment, without its stored outputs."""
    import nbformat

    notebook = nbformat.read(repository() / "notebooks" / START_PAGE, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return str(nbformat.writes(notebook)) + "\n"


def api(course: Path) -> "NbGraderAPI":
    """Return nbgrader's API with a course's configuration, as Formgrader uses it.  Its methods return their logs."""
    from nbgrader.apps import NbGraderAPI

    from autograder.gradebook import database

    database.read_version_in_process()
    nbgraders_log = get_logger()
    if isinstance(nbgraders_log, logging.Logger):
        nbgraders_log.propagate = False
    course_folder.expect_own(course)
    config = PyFileConfigLoader(course_folder.CONFIGURATION, path=str(course)).load_config()
    config.CourseDirectory.root = str(course.resolve())
    return NbGraderAPI(config=config)


def _release(nbgrader: "NbGraderAPI", course: Path, name: str, notebook: Path) -> Path:
    source, released = course / SOURCE / name, course / "release" / name
    if difference := exercises.difference(name, notebook) if name in exercises.names() else "":
        raise UsageError(f"{name} is not released: {difference}")
    source.mkdir(parents=True, exist_ok=True)
    apart.expect_no_results(source)
    _stage(notebook, source / notebook.name, course / "replaced")
    done = nbgrader.generate_assignment(name)
    if not done["success"]:
        said = (done.get("error") or done.get("log") or "no reason was given").strip()
        raise UsageError(f"nbgrader could not release {name}: {said.splitlines()[-1]}")
    found = next(leaks(released, secrets(name, notebook)), None)
    if found:
        shutil.rmtree(released)
        raise Leak(f"{name} is not released: {found}")
    return released


def _students_project(project: Path) -> str:
    """Return this checkout's pyproject.toml without the grader's package and command, and without developers' tools."""
    sections = re.split(r"^(?=\[)", project.read_text(encoding="utf-8"), flags=re.MULTILINE)
    text = "".join(section for section in sections if section.startswith(PROJECT)).replace(', "autograder*"', "")
    return re.sub(r"^autograder = .*\n", "", text, flags=re.MULTILINE)


def _stage(notebook: Path, staged: Path, kept: Path) -> None:
    """Copy the notebook to where nbgrader looks for it; keep a different one there, which may have been edited."""
    if staged.exists() and (before := staged.read_bytes()) != notebook.read_bytes():
        kept.mkdir(parents=True, exist_ok=True)
        backup = kept / f"{staged.stem}-{hashlib.sha256(before).hexdigest()[:8]}.ipynb"
        backup.write_bytes(before)
        log.warning("%s was a different notebook: kept as %s", staged, backup)
    shutil.copyfile(notebook, staged)
