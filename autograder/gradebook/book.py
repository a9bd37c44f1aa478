"""The scores in nbgrader's gradebook: the points of the hidden tests, summed for each of the notebook's grade cells."""

import contextlib
import math
import warnings
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from nbgrader.api import Grade, Gradebook, MissingEntry, SubmittedNotebook
from sqlalchemy.exc import SAWarning

from autograder.errors import UsageError
from autograder.gradebook import address, course_folder, database, late, written
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.submissions import reading
from autograder.submissions.exercises import load
from autograder.submissions.roster import Roster
from course.returned.record import Mark


def default_url(submitted: Path, out: Path) -> str:
    """Return the URL of the gradebook of the submissions' nbgrader course, or else of one in `out`."""
    course = submitted.resolve().parent
    place = course if course_folder.has_gradebook(submitted) else out.resolve()
    return address.url(place / course_folder.GRADEBOOK)


def existing_url(url: str | None, submitted: Path, out: Path) -> str:
    """Return `url`, or else the URL of the gradebook that `out` was graded into; raises UsageError without one.

    nbgrader itself would create an empty one.
    """
    found = url or default_url(submitted, out)
    if (file := address.file(found)) and not file.exists():
        raise UsageError(f"there is no gradebook {file}")
    return found


# Columns of a roster by nbgrader's name for them; of several columns, the first that is filled in counts.
COLUMNS = {
    "first_name": ("first_name",),
    "last_name": ("last_name",),
    "email": ("email",),
    "lms_user_id": ("lms_user_id", "canvas_id", "moodle_id", "idnumber"),
}


class Scores:
    """An open gradebook; writing the same report again changes nothing.

    Given the folder of the submissions, it also writes the times of handing in, and the late penalties of the course
    that the folder is in; otherwise nbgrader does that.  Questions in words are marked in the notebook.  For a
    submission without a notebook they count 0 if `unanswered_is_zero`; otherwise they wait for a mark, too, and the
    student is listed in `unanswered`.  A mark that was given counts, with a notebook or without; if the text of the
    answer is another one than was marked, it waits for a mark again, and the student is listed in `rewritten`; in
    `withdrawn` if the notebook that was marked is no longer handed in.  Nobody is listed whose folder is gone.
    """

    def __init__(self, url: str, submitted: Path | None = None, unanswered_is_zero: bool = False):
        database.read_version_in_process()
        self._url, self._submitted, self._zero = url, submitted, unanswered_is_zero
        self.unanswered: dict[str, list[str]] = {}  # students, by exercise
        self.rewritten: dict[str, list[str]] = {}
        self.withdrawn: dict[str, list[str]] = {}
        self._config = late.course_config(submitted) if submitted else None
        self._book = Gradebook(url)
        self._known: set[str] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._book.close()

    def enrol(self, roster: Roster) -> None:
        """Enter the students of the roster, with their names, so that those who hand in nothing are exported, too."""
        for student in sorted(roster.students):
            about = roster.about.get(student, {})
            known = {
                name: next((about[column] for column in columns if about.get(column)), "")
                for name, columns in COLUMNS.items()
            }
            self._book.update_or_create_student(student, **{name: value for name, value in known.items() if value})

    def write(self, report: Report, handed_in: Path | None = None) -> None:
        """Write a report's points; a report of an infrastructure error has none, and changes nothing.

        The submission is in `handed_in`; by default, it is where the folder of all submissions has it.
        """
        if report.status == INFRASTRUCTURE_ERROR:
            return
        name, student = report.assignment, report.student
        if name not in self._known:
            self._add_assignment(name)
        self._book.update_or_create_student(student)
        at = late.timestamp(self._submitted, student, name) if self._submitted else {}
        with warnings.catch_warnings(action="ignore", category=SAWarning):  # nbgrader's own, about autoflush
            self._book.update_or_create_submission(name, student, **at)
        notebook = self._book.find_submission_notebook(name, name, student)
        for cell, points in _by_cell(report).items():
            try:
                grade = self._book.find_grade(cell, name, name, student)
            except MissingEntry:  # the submission is older than the cell
                grade = Grade(cell_id=self._book.find_grade_cell(cell, name, name).id, notebook=notebook)
                self._book.db.add(grade)
            if grade.manual_score is None:
                grade.needs_manual_grade = False
            elif grade.auto_score != points:
                grade.needs_manual_grade = True  # points changed by hand need another look
            grade.auto_score = points
        if self._submitted:
            handed_in = self._submitted / student / name
            self._questions(notebook, handed_in)
        if handed_in and handed_in.exists():
            self._rewritten(notebook, handed_in)
        self._book.db.commit()
        if self._config and late.concerned(self._book.find_submission(name, student)):
            late.assign(self._config, self._url, name, name, student)

    def _questions(self, notebook: SubmittedNotebook, handed_in: Path) -> None:
        """Flag the questions that no test judges for manual grading; without a notebook they may count 0."""
        answered = reading.has_notebook(handed_in, notebook.assignment.name)
        tested = load(notebook.assignment.name).cells.keys()
        questions = [grade for grade in notebook.grades if grade.name not in tested and grade.manual_score is None]
        for grade in questions:
            grade.auto_score = None if answered or not self._zero else 0.0
            grade.needs_manual_grade = grade.auto_score is None
        if questions and handed_in.exists() and not answered and not self._zero:
            self.unanswered.setdefault(notebook.assignment.name, []).append(notebook.student.id)

    def _rewritten(self, notebook: SubmittedNotebook, handed_in: Path) -> None:
        """Flag the questions with another text than the one that was marked; without the notebook, list the student."""
        name = notebook.assignment.name
        texts = written.answers(handed_in, name)
        tested = load(name).cells.keys()
        questions = [grade for grade in notebook.grades if grade.name not in tested]
        if texts is None:
            if written.noted(self._book, [grade for grade in questions if grade.manual_score]):
                self.withdrawn.setdefault(name, []).append(notebook.student.id)
        elif written.note(self._book, questions, texts):
            self.rewritten.setdefault(name, []).append(notebook.student.id)

    def _add_assignment(self, name: str) -> None:
        self._book.update_or_create_assignment(name)
        self._book.update_or_create_notebook(name, name)
        for cell, points in load(name).cells.items():  # not the report's, which may come from an older suite
            self._book.update_or_create_grade_cell(cell, name, name, max_score=points, cell_type="code")
        self._known.add(name)


def lateness(url: str, submitted: Path) -> dict[tuple[str, str], float]:
    """Return the lateness (s) of late submissions, by student and exercise.

    The extensions of the course around `submitted` count.  Raises UsageError when its configuration is invalid.
    """
    config = late.course_config(submitted)
    with Gradebook(url) as book:
        found = {
            (one.student.id, assignment.name): late.lateness(config, one)
            for assignment in book.assignments
            for one in assignment.submissions
        }
    return {key: seconds for key, seconds in found.items() if seconds}


def differing(url: str, reports: Iterable[Report]) -> list[tuple[str, str]]:
    """Return the students and exercises for which the gradebook has other points of the tests than the report.

    The reports are of the present suites.  What is not in the gradebook, or has no points there, is left out.
    """
    found = []
    with Gradebook(url) as book:
        for report in reports:
            name, student = report.assignment, report.student
            entered: dict[str, float | None] = {}
            with contextlib.suppress(MissingEntry):
                notebook = book.find_submission_notebook(name, name, student)
                entered = {grade.name: grade.auto_score for grade in notebook.grades}
            for cell, points in _by_cell(report).items():
                if (known := entered.get(cell)) is not None and not math.isclose(known, points, abs_tol=1e-6):
                    found.append((student, name))
                    break
    return found


def by_hand(url: str, assignment: str, student: str) -> list[Mark]:
    """Return a submission's manual marks and comments, those still missing, and its late penalty."""
    tested = {test.cell for test in load(assignment).tests}
    with Gradebook(url) as book:
        notebook = book.find_submission_notebook(assignment, assignment, student)
        comments = {comment.name: comment.comment for comment in notebook.comments if comment.comment}
        marks = {}
        for grade in notebook.grades:
            changed = grade.manual_score is not None or bool(grade.extra_credit)
            waiting = bool(grade.needs_manual_grade) and not (changed and grade.name in tested)
            rewritten = waiting and changed  # mark and comment are about another text
            if grade.name not in tested or changed:
                marks[grade.name] = Mark(
                    grade.name,
                    None if rewritten else grade.score,
                    grade.max_score,
                    "" if rewritten else comments.get(grade.name, ""),
                    waiting,
                )
        penalty = notebook.late_submission_penalty
    rest = [Mark(name, None, 0.0, comment) for name, comment in comments.items() if name not in marks]
    rest += [Mark("Handed in late", -penalty, 0.0)] if penalty else []
    return [*marks.values(), *rest]


def _by_cell(report: Report) -> dict[str, float]:
    """Return the points earned in each of the notebook's grade cells."""
    cells = {test.id: test.cell for test in load(report.assignment).tests}
    points = dict.fromkeys(cells.values(), 0.0)
    for test in report.tests:
        if test.id in cells:  # otherwise the suite no longer has the test
            points[cells[test.id]] += test.points
    return points
