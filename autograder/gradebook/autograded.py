"""The folder `autograded` of a course, as `nbgrader autograde` leaves it: Formgrader and `generate_feedback` read it.

So a class that `autograder grade` has graded is marked by hand at once, and need not be graded again by nbgrader.
"""

import json
import secrets
import shutil
from pathlib import Path

import nbformat
from traitlets.config import Config

from autograder.gradebook.plugins import NameCells, handed_in_notebook, show_results
from autograder.records import Report
from autograder.submissions import notebook, reading

FOLDER = "autograded"


def lay_out(config: Config, url: str, submitted: Path, report: Report) -> Path:
    """Write the submission's folder in the course around `submitted`, whole or not at all; return it.

    One that shows this report already is left as it is: a class that is graded to its end has many.
    """
    student, assignment = report.student, report.assignment
    handed_in, name = submitted / student / assignment, f"{assignment}.ipynb"
    folder = submitted.resolve().parent / str(config.CourseDirectory.get("autograded_directory", FOLDER))
    target = folder / student / assignment
    if _shows(target / name, report):
        return target
    names = {"student": student, "assignment": assignment, "notebook": assignment, "db_url": url}
    shown, _ = NameCells().preprocess(handed_in_notebook(handed_in / name), {"nbgrader": names})
    shown.metadata["autograder"] = report.public()
    show_results(shown, report)
    target.parent.mkdir(parents=True, exist_ok=True)  # open to whom the course is: instructors may share it
    draft = folder / f".part-{secrets.token_hex(8)}"
    draft.mkdir()
    try:
        for path, content in reading.regular_files(handed_in, notebook.MAX_BYTES):
            if path.suffix.lower() not in (".html", ".ipynb"):  # a page would go on to the feedback folder
                (draft / path.name).write_bytes(content)
        (draft / name).write_text(nbformat.writes(shown), encoding="utf-8", errors="replace")
        if target.exists():
            shutil.rmtree(target)
        draft.rename(target)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise
    return target


def _shows(laid_out: Path, report: Report) -> bool:
    try:
        shown = json.loads(laid_out.read_bytes())["metadata"]["autograder"]
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return bool(shown == json.loads(json.dumps(report.public())))
