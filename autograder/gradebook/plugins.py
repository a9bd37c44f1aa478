"""What nbgrader's `autograde` and `generate_feedback` do in this course, set by `nbgrader_config.py`.

nbgrader would run a handed-in notebook here, in the instructor's account, and believe what it prints.  Instead the
submission's files are graded in the sandbox, as `autograder grade` does, and the notebook is only shown: as handed in,
without what could act on the instructor's browser.
"""

import os
import shutil
from pathlib import Path

from nbconvert.exporters import Exporter, NotebookExporter
from nbformat import read as read_notebook
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from nbgrader.api import Gradebook
from nbgrader.preprocessors import NbGraderPreprocessor
from traitlets import Bool, Float, Integer

from autograder.errors import InfrastructureError
from autograder.gradebook.book import Scores, by_hand
from autograder.grading.single import grade
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import feedback
from autograder.sandbox.box import choose
from autograder.submissions import listing, notebook
from autograder.submissions.reading import read_notebook as read_handed_in
from course.errors import UnreadableNotebook


class HandedIn(NotebookExporter):
    """Reads the notebook that a student handed in, whatever it is."""

    def from_filename(self, filename, resources=None, **kw):
        """A notebook that cannot be read is replaced by one that says so: its files are graded all the same."""
        try:
            shown = notebook.safe(read_handed_in(Path(filename)))
        except UnreadableNotebook as error:
            shown = new_notebook(
                cells=[
                    new_markdown_cell(
                        notebook.plain(
                            f"**The notebook that was handed in cannot be shown: {error}.** Its files were graded."
                        )
                    )
                ]
            )
        return self.from_notebook_node(shown, resources, **kw)


class NameCells(NbGraderPreprocessor):
    """Takes what is known of a cell from the gradebook, not from the notebook handed in, and adds what is missing.

    The text stays as the student left it, also in a test cell: no points depend on it.
    """

    def preprocess(self, nb, resources):
        """Give each of the assignment's cells nbgrader's metadata once, in the order handed in."""
        names = resources["nbgrader"]
        with Gradebook(names["db_url"]) as book:
            known = _known_cells(book.find_notebook(names["notebook"], names["assignment"]))
        for cell in nb.cells:
            name = cell.metadata.pop("nbgrader", {}).get("grade_id")
            if name in known:
                cell.metadata["nbgrader"] = known.pop(name)[0]
        for metadata, kind in known.values():
            new = new_code_cell if kind == "code" else new_markdown_cell
            nb.cells.append(
                new("# This cell is not in the notebook that was handed in.", metadata={"nbgrader": metadata})
            )
        return nb, resources


class GradeInSandbox(NbGraderPreprocessor):
    """Grades the submission's files, as `autograder grade` does, and writes the points of the hidden tests."""

    unsafe = Bool(False, help="Run students' programs without a sandbox, and flag the results.").tag(config=True)
    seed = Integer(None, allow_none=True, help="Draw the hidden inputs from this seed.").tag(config=True)
    patience = Float(1.0, help="Stretch every wait by this factor, for a slow machine.").tag(config=True)

    def preprocess(self, nb, resources):
        """Raises InfrastructureError when there is no result: nbgrader then reports the submission as failed."""
        names = resources["nbgrader"]
        student, assignment = names["student"], names["assignment"]
        if names["notebook"] != assignment:
            return nb, resources  # one beside the exercise's
        converter = self.parent.parent
        report = grade(
            listing.read(_folder(converter, "submitted"), student, assignment),
            choose(self.unsafe),
            self.seed,
            self.patience,
        )
        if report.status == INFRASTRUCTURE_ERROR:
            raise InfrastructureError(f"{student}/{assignment} was not graded, and no score was written")
        with Scores(names["db_url"]) as scores:
            scores.write(report)
        nb.metadata["autograder"] = report.public()
        _remove_unwanted(
            _folder(converter, "submitted") / student / assignment,
            _folder(converter, "autograded") / student / assignment,
        )
        return nb, resources


class FeedbackPage(Exporter):
    """The student's page, as `autograder grade` writes it, with what the instructor has marked by hand."""

    def _file_extension_default(self):
        return ".html"

    def from_filename(self, filename, resources=None, **kw):
        """The page of the report that `GradeInSandbox` has put into the graded notebook."""
        fields = read_notebook(filename, as_version=4).metadata.get("autograder")
        names = resources["nbgrader"]
        if fields is None:
            raise ValueError(f"{filename} was not graded by this grader: run nbgrader autograde again")
        page = feedback.page(
            Report.from_fields(fields), by_hand(names["db_url"], names["assignment"], names["student"])
        )
        return page, resources | {"output_extension": ".html"}


def _folder(converter, step: str) -> Path:
    """The course's folder of a step, submitted or autograded, that holds a folder for each student."""
    course = converter.coursedir
    return Path(course.root) / getattr(course, f"{step}_directory")


def _known_cells(known) -> dict[str, tuple[dict, str]]:
    """nbgrader's metadata and the kind of each cell of a notebook in the gradebook, by name."""
    sources = {cell.name: cell for cell in known.source_cells}
    graded = {cell.name: cell for cell in [*known.grade_cells, *known.task_cells]}
    solutions = {cell.name for cell in known.solution_cells}
    tasks = {cell.name for cell in known.task_cells}
    cells = {}
    for name in dict.fromkeys([*sources, *graded, *solutions]):
        source = sources.get(name)
        kind = source.cell_type if source else "code"
        cells[name] = (
            {
                "grade_id": name,
                "grade": name in graded and name not in tasks,
                "solution": name in solutions,
                "task": name in tasks,
                "locked": bool(source and source.locked),
                "cell_type": kind,
                "schema_version": 3,
            },
            kind,
        )
        if name in graded:
            cells[name][0]["points"] = graded[name].max_score
    return cells


def _remove_unwanted(submitted: Path, graded: Path) -> None:
    """Remove from the graded folder, whose files go on to the feedback, what must not: copies through links, pages."""
    for folder, folders, files in os.walk(submitted):
        for path in (Path(folder, name) for name in [*folders, *files]):
            copy = graded / path.relative_to(submitted)
            if path.suffix.lower() == ".html" and copy.is_dir():
                shutil.rmtree(copy)
            elif path.suffix.lower() == ".html" or (path.is_symlink() and path.suffix != ".ipynb"):
                copy.unlink(missing_ok=True)
