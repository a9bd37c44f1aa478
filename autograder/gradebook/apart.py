"""The borders that keep answers, results and marks out of the folders that students get."""

import os
from collections.abc import Iterator
from pathlib import Path

from autograder.errors import UsageError
from autograder.paths import repository
from autograder.results.targets import CONFIGURATION, NAMES, STEPS
from course.foundation.untrusted import read_regular
from course.notebook.stubs import RELEASED

SOLVED = b"BEGIN SOLUTION"
OTHERS = (".venv", ".git", "node_modules")  # folders in which nobody looks for an exercise
MOST = 50_000_000  # bytes of a file that is searched


def expect_apart(course: Path, students: Path) -> None:
    """Raise UsageError when the folder for students would hold answers: the course's folder, a checkout, old files."""
    inside, made, checkout = course.resolve(), students.resolve(), repository()
    above = (inside, *inside.parents)
    if made in above:
        why = f"the course folder {inside}, which has the answers, would be in it: choose another folder for students"
    elif _is_in_a_step(made, inside):
        why = f"it belongs to a step of the course folder {inside}: choose another folder for students"
    elif released := _students_folder(inside):
        why = f"the course folder {inside} lies in {released}, which was made for students: choose another --course"
    elif made in (checkout, *checkout.parents):
        why = f"the repository {checkout}, which has the answers, would be in it: choose another folder for students"
    elif found := next(_answers(made), ""):
        why = f"it has {found}: move that away, or choose another folder for students"
    else:
        return
    raise UsageError(f"{students} cannot be the folder for students: {why}")


def expect_no_results(source: Path) -> None:
    """Raise UsageError when a folder from which an exercise is released has files of the grader's."""
    if found := next((path for path in sorted(source.rglob("*")) if path.name in NAMES), None):
        raise UsageError(f"{found} would be released: it belongs to a grading, so move it out of {source}")


def expect_private(out: Path) -> None:
    """Raise UsageError when results would be written where students get them, or into a step of a course folder."""
    made = out.resolve()
    if released := _students_folder(made):
        raise UsageError(f"{out} lies in {released}, which was made for students: choose another --output")
    for course in (each for each in made.parents if (each / CONFIGURATION).exists()):
        if _is_in_a_step(made, course):
            raise UsageError(f"{out} lies in a step of the course folder {course}: choose another --output")


def _is_in_a_step(path: Path, course: Path) -> bool:
    return any(course / name in (path, *path.parents) for name in STEPS)


def _students_folder(path: Path) -> Path | None:
    """Return the folder that a release has made for students, if `path` is or lies in one."""
    return next((each for each in (path, *path.parents) if (each / "notebooks" / RELEASED).is_dir()), None)


def _answers(folder: Path) -> Iterator[str]:
    """Yield in words what a folder for students has that they must not get: answers, results, and links out of it."""
    solutions = {path.read_bytes() for path in (repository() / "solutions").rglob("*.py")}
    for parent, folders, files in os.walk(folder):
        folders[:] = sorted(set(folders) - {*OTHERS})
        for path in (Path(parent, name) for name in sorted([*folders, *files])):
            shown = path.relative_to(folder)
            if path.is_symlink():
                if folder not in (target := path.resolve()).parents:
                    yield f"the link {shown}, which leads to {target}"
            elif path.name in NAMES:
                yield f"{shown}, which belongs to a course folder or to results"
            elif path.suffix in (".ipynb", ".py") and _is_solved(path, solutions):
                yield f"{shown}, which has answers"


def _is_solved(path: Path, solutions: set[bytes]) -> bool:
    try:
        content = read_regular(path, MOST)
    except (OSError, ValueError):
        return False
    return (path.suffix == ".ipynb" and SOLVED in content) or content in solutions
