"""Writes a course's folder `autograded` as `nbgrader autograde` does, for Formgrader and `generate_feedback`.

So a class graded by `autograder grade` can be marked by hand at once, without being graded again by nbgrader.
"""

import hashlib
import json
from pathlib import Path

import nbformat
from traitlets.config import Config

from autograder.errors import RefusedFile
from autograder.gradebook.plugins import NameCells, handed_in_notebook, show_results
from autograder.records import Report
from autograder.submissions import notebook, reading
from course.foundation import storage

FOLDER = "autograded"
HANDED_IN = "handed_in"  # key in the metadata of what is shown: a digest of the notebook file, "" without one
NO_NOTEBOOK = "No notebook was handed in, so there is nothing here."


def lay_out(config: Config, url: str, submitted: Path, report: Report) -> Path:
    """Write the submission's folder into the course that contains `submitted`, whole or not at all; return it.

    A folder that already shows this report and notebook is left as it is: resuming a graded class meets many of them.
    """
    student, assignment = report.student, report.assignment
    handed_in, name = submitted / student / assignment, f"{assignment}.ipynb"
    folder = submitted.resolve().parent / str(config.CourseDirectory.get("autograded_directory", FOLDER))
    target = folder / student / assignment
    digest = _digest(handed_in / name)
    if _shows(target / name, report, digest):
        return target
    names = {"student": student, "assignment": assignment, "notebook": assignment, "db_url": url}
    naming = NameCells()
    if not reading.has_notebook(handed_in, assignment):
        naming.absent = NO_NOTEBOOK
    shown, _ = naming.preprocess(handed_in_notebook(handed_in / name), {"nbgrader": names})
    shown.metadata["autograder"], shown.metadata[HANDED_IN] = report.public(), digest
    show_results(shown, report)
    with storage.folder(target) as draft:  # with the course's permissions: instructors may share it
        for path, content in reading.regular_files(handed_in, notebook.MAX_BYTES):
            if path.suffix.lower() not in (".html", ".ipynb"):  # nbgrader would copy a page to the feedback
                (draft / path.name).write_bytes(content)
        (draft / name).write_text(nbformat.writes(shown), encoding="utf-8", errors="replace")
    return target


def _shows(laid_out: Path, report: Report, digest: str) -> bool:
    """Return True if this report and notebook are what is shown."""
    try:
        metadata = json.loads(laid_out.read_bytes())["metadata"]
        shown, of = metadata["autograder"], metadata[HANDED_IN]
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return bool(of == digest and shown == json.loads(json.dumps(report.public())))


def _digest(handed_in: Path) -> str:
    """Return a digest of the notebook file; "" if it cannot be read."""
    try:
        return hashlib.sha256(reading.read_file(handed_in, notebook.MAX_BYTES)).hexdigest()
    except (OSError, RefusedFile):
        return ""
