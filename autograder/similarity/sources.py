"""The programs to compare: those handed in, and those that students were given."""

import re
from collections.abc import Iterable
from pathlib import Path

from autograder.errors import UsageError
from autograder.paths import COURSE, repository
from autograder.results import output
from autograder.results.output import Basis
from autograder.similarity.tokens import clean
from autograder.submissions import exercises, listing, reading
from course.foundation import cells
from course.foundation.cells import SOLUTION

COMMAND = re.compile(r"^[%!].*$", re.MULTILINE)  # Jupyter's, not Python's


def places(folder: Path, assignment: str | None) -> dict[tuple[str, str], tuple[Path, Basis | None]]:
    """Return the folder of submissions for each student and assignment, and the basis of the result if there is one.

    The folder is one of submissions, or an output of `autograder grade`.  Raises UsageError when it holds nothing, or
    when an output does not say where the submissions are.
    """
    if not (folder / output.RESULTS).is_file():  # a student may be called so
        return dict.fromkeys(listing.find(folder, assignment, []), (folder, None))
    wanted = assignment and exercises.load(assignment).name
    try:
        bases = output.bases(folder)
    except UsageError as error:
        raise UsageError(f"{error}: give their folder instead") from None
    found: dict[tuple[str, str], tuple[Path, Basis | None]]
    found = {key: (Path(basis.submitted), basis) for key, basis in bases.items() if wanted in (None, key[1])}
    if not found:
        raise UsageError(f"{folder} does not record where its submissions are: give their folder instead")
    return found


def files(submitted: Path, student: str, assignment: str) -> dict[str, str]:
    """Return the readable Python files of a submission, even if others are missing."""
    found = {}
    if not (submitted / student).is_symlink():
        for name in exercises.load(assignment).files:
            if name.endswith(".py"):
                read = reading.read(submitted / student / assignment, student, assignment, [name]).files
                found.update({name: clean(text.decode(errors="replace")) for name, text in read.items()})
    return found


def given(assignment: str, courses: Iterable[Path] = ()) -> list[str]:
    """Return the programs that students were given: those in the notebooks, and the chapter's nodes.

    `courses` are folders of submissions: the course folder around each may have its own version of the notebook.
    """
    books = [*(repository() / "notebooks").glob("[!.]*/*.ipynb")]
    books += [folder.resolve().parent / "release" / assignment / f"{assignment}.ipynb" for folder in courses]
    texts = [path.read_text(encoding="utf-8") for path in sorted((COURSE / "nodes").glob("*.py"))]
    for path in books:
        if path.exists():
            texts += [
                COMMAND.sub("", SOLUTION.sub("", cell.source)) for cell in cells.read(path) if cell.kind == "code"
            ]
    return texts
