"""Plug-ins for nbgrader's `autograde` and `generate_feedback`, set in its configuration (`config`).

nbgrader itself would run a handed-in notebook in the instructor's account, and trust its outputs.  Instead the files of
the submission are graded in the sandbox, as `autograder grade` does, and the notebook is only shown, as handed in but
without active content.
"""

import os
import shutil
from pathlib import Path
from typing import Any

from nbconvert.exporters import Exporter, NotebookExporter
from nbformat import NotebookNode
from nbformat import read as read_notebook
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from nbgrader.api import Gradebook, Notebook
from nbgrader.converters.base import BaseConverter
from nbgrader.preprocessors import NbGraderPreprocessor
from traitlets import Bool, Float, Integer

from autograder.errors import InfrastructureError, NotGradedHere
from autograder.gradebook.book import Scores, by_hand
from autograder.grading.single import grade
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import feedback, text
from autograder.sandbox.sandbox import choose
from autograder.submissions import listing, notebook
from autograder.submissions.exercises import load
from autograder.submissions.reading import read_notebook as read_handed_in
from course.errors import UnreadableNotebook

Resources = dict[str, Any]  # that nbconvert passes from step to step
Preprocessed = tuple[NotebookNode, Resources]


class HandedInNotebook(NotebookExporter):
    """Reads the notebook file that a student handed in, whatever it contains."""

    def from_filename(
        self, filename: str, resources: Resources | None = None, **kw: Any
    ) -> tuple[NotebookNode, Resources]:
        """Return the notebook to show, made safe; one that cannot be read is replaced by one that says so."""
        return self.from_notebook_node(handed_in_notebook(Path(filename)), resources, **kw)


def handed_in_notebook(path: Path) -> NotebookNode:
    """Return the notebook to show, made safe, or one that says why it cannot be shown."""
    try:
        return notebook.safe(read_handed_in(path))
    except UnreadableNotebook as error:
        why = f"**The notebook that was handed in cannot be shown: {error}.** Its files were graded."
        if not os.path.lexists(path):
            why = "No notebook was handed in, only files. They were graded."
        return new_notebook(cells=[new_markdown_cell(notebook.plain(why))])


class NameCells(NbGraderPreprocessor):
    """Takes nbgrader's metadata of each cell from the gradebook, not from the handed-in notebook.

    The text stays as the student left it, even in a test cell, because no points depend on it.
    """

    absent = "This cell is not in the notebook that was handed in."  # the text of a missing cell

    def preprocess(self, nb: NotebookNode, resources: Resources) -> Preprocessed:
        """Give the metadata of each of the assignment's cells to the first cell of that name; add missing cells."""
        names = resources["nbgrader"]
        with Gradebook(names["db_url"]) as book:
            known = _known_cells(book.find_notebook(names["notebook"], names["assignment"]))
        for cell in nb.cells:
            name = cell.metadata.pop("nbgrader", {}).get("grade_id")
            if name in known:
                cell.metadata["nbgrader"] = known.pop(name)[0]
        for metadata, kind in known.values():
            text, new = (f"# {self.absent}", new_code_cell) if kind == "code" else (self.absent, new_markdown_cell)
            nb.cells.append(new(text, metadata={"nbgrader": metadata}))
        return nb, resources


class GradeInSandbox(NbGraderPreprocessor):
    """Grades the submission's files, as `autograder grade` does, and writes the points of the hidden tests."""

    unsafe = Bool(False, help="Run students' programs without a sandbox, and flag the results.").tag(config=True)
    seed = Integer(None, allow_none=True, help="Draw the hidden inputs from this seed.").tag(config=True)
    patience = Float(1.0, help="Multiply the time limits of students' programs by this, for a slow machine.").tag(
        config=True
    )

    def preprocess(self, nb: NotebookNode, resources: Resources) -> Preprocessed:
        """Grade; raises InfrastructureError when there is no result: nbgrader then reports the submission as failed."""
        names = resources["nbgrader"]
        student, assignment = names["student"], names["assignment"]
        if names["notebook"] != assignment:
            return nb, resources  # a further notebook beside the exercise's
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
            scores.write(report, _folder(converter, "submitted") / student / assignment)
        nb.metadata["autograder"] = report.public()
        show_results(nb, report)
        _remove_unwanted(
            _folder(converter, "submitted") / student / assignment,
            _folder(converter, "autograded") / student / assignment,
        )
        return nb, resources


def show_results(nb: NotebookNode, report: Report) -> None:
    """Put the outcomes of the hidden tests above the student's own outputs in each cell with points."""
    tests = {test.id: test.cell for test in load(report.assignment).tests}
    for cell in nb.cells:
        name = cell.metadata.get("nbgrader", {}).get("grade_id")
        results = [result for result in report.tests if tests.get(result.id) == name]
        if results and cell.cell_type == "code":
            lines = ["Hidden tests:", *map(text.result, results), ""]
            if cell.outputs:
                lines.append("Printed when it was handed in:\n")
            cell.outputs.insert(0, new_output("stream", name="stdout", text=text.printable("\n".join(lines))))


class FeedbackPage(Exporter):
    """Exports the student's page, as `autograder grade` writes it, with the instructor's marks and comments."""

    def _file_extension_default(self) -> str:
        return ".html"

    def from_filename(  # type: ignore[override]  # a page is text, which nbconvert's own exporters return too
        self, filename: str, resources: Resources | None = None, **kw: object
    ) -> tuple[str, Resources]:
        """Return the page of the report that `GradeInSandbox` put into the notebook; raises NotGradedHere without."""
        fields = read_notebook(filename, as_version=4).metadata.get("autograder")
        resources = resources or {}
        names = resources["nbgrader"]
        if fields is None:
            raise NotGradedHere(f"{filename} was not graded by this grader: run nbgrader autograde again")
        page = feedback.page(
            Report.from_fields(fields), by_hand(names["db_url"], names["assignment"], names["student"])
        )
        return page, resources | {"output_extension": ".html"}


def _folder(converter: BaseConverter, step: str) -> Path:
    """Return the course's folder of a step (submitted or autograded), which has a folder for each student."""
    course = converter.coursedir
    return Path(course.root) / getattr(course, f"{step}_directory")


def _known_cells(known: Notebook) -> dict[str, tuple[dict[str, object], str]]:
    """Return nbgrader's metadata and the type of each cell of a notebook in the gradebook, by name."""
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
    """Remove HTML pages and copies made through links, because the graded folder is copied to the feedback."""
    for folder, folders, files in os.walk(submitted):
        for path in (Path(folder, name) for name in [*folders, *files]):
            copy = graded / path.relative_to(submitted)
            if path.suffix.lower() == ".html" and copy.is_dir():
                shutil.rmtree(copy)
            elif path.suffix.lower() == ".html" or (path.is_symlink() and path.suffix != ".ipynb"):
                copy.unlink(missing_ok=True)
