"""The folder `autograded` of a course, as `nbgrader autograde` leaves it: Formgrader and `generate_feedback` read it.

So a class that `autograder grade` has graded is marked by hand at once, and need not be graded again by nbgrader.
"""

import shutil
import tempfile
from pathlib import Path

import nbformat
from traitlets.config import Config

from autograder.gradebook.plugins import NameCells, handed_in_notebook, show_results
from autograder.records import Report
from autograder.submissions import notebook, reading
from course.foundation import storage

FOLDER = "autograded"


def lay_out(config: Config, url: str, submitted: Path, report: Report) -> Path:
    """Write the submission's folder in the course around `submitted`, whole or not at all; return it."""
    student, assignment = report.student, report.assignment
    handed_in, name = submitted / student / assignment, f"{assignment}.ipynb"
    names = {"student": student, "assignment": assignment, "notebook": assignment, "db_url": url}
    shown, _ = NameCells().preprocess(handed_in_notebook(handed_in / name), {"nbgrader": names})
    shown.metadata["autograder"] = report.public()
    show_results(shown, report)
    folder = submitted.resolve().parent / str(config.CourseDirectory.get("autograded_directory", FOLDER))
    folder.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=".part-", dir=folder))
    target = folder / student / assignment
    try:
        for path, content in reading.regular_files(handed_in, notebook.MAX_BYTES):
            if path.suffix.lower() not in (".html", ".ipynb"):  # a page would go on to the feedback folder
                (draft / path.name).write_bytes(content)
        (draft / name).write_text(nbformat.writes(shown), encoding="utf-8", errors="replace")
        target.parent.mkdir(storage.PRIVATE_FOLDER, exist_ok=True)
        if target.exists():
            shutil.rmtree(target)
        draft.rename(target)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise
    return target
