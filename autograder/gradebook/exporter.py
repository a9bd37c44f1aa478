"""Parts that the exporters share: whose grades of which assignments, and a CSV file that is safe to open.

The exporters are plug-ins of `nbgrader export`, which finds them by module and name:

    nbgrader export --exporter autograder.gradebook.moodle_export.MoodleExporter --to moodle.csv

A grade is the score minus the late penalty.  A submission that waits for marks by hand, has no score yet or was not
handed in gives an empty cell, never 0.  How many there are of each is in the log, and so is every student without a
line in the file.

Spreadsheets run a cell that begins with = + - or @ as a formula, and students choose their names (OWASP, "CSV
Injection").  Names, and whatever else the import does not use, get an apostrophe in front, as OWASP advises.  What
the import finds students by is never changed: see each exporter.

Files are UTF-8 without a byte order mark: Moodle's import removes it (lib/csvlib.class.php), Canvas's does not
(lib/gradebook_importer.rb).
"""

import csv
import io
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from nbgrader.api import Assignment, Gradebook, Student, SubmittedAssignment
from nbgrader.plugins import ExportPlugin

from autograder.errors import CannotExport
from autograder.gradebook import late
from autograder.results.text import printable
from course.foundation import storage

DONE, WAITING, MISSING = "graded", "waiting for marks", "not handed in"
Thing = TypeVar("Thing", Assignment, Student)


@dataclass(frozen=True)
class Grade:
    """One student's grade for one assignment."""

    student: Student
    assignment: Assignment
    handed_in: SubmittedAssignment | None

    @cached_property
    def state(self) -> str:
        """DONE, WAITING or MISSING."""
        if self.handed_in is None:
            return MISSING
        parts = [part for notebook in self.handed_in.notebooks for part in notebook.grades]
        unmarked = any(part.needs_manual_grade or not has_score(part) for part in parts)
        return WAITING if unmarked or not parts else DONE

    @property
    def penalty(self) -> float:
        """Points lost for being late."""
        return (self.handed_in.late_submission_penalty or 0.0) if self.handed_in else 0.0

    @property
    def points(self) -> str:
        """The score minus the penalty, as the cell of a file: empty unless DONE."""
        if self.handed_in is None or self.state != DONE:
            return ""
        return number(max(0.0, self.handed_in.score - self.penalty))


Grades = dict[str, dict[str, Grade]]  # by student and assignment
Rows = list[list[str]]


class Exporter(ExportPlugin):
    """A plug-in of `nbgrader export`; the file that it writes is whole, or not there."""

    default_name = "grades.csv"

    def export(self, gradebook: Gradebook) -> None:
        """Write the file; nbgrader calls this.  A mistake that the instructor can fix is one line and exit status 1."""
        target = Path(self.to or self.default_name)
        try:
            rows = self.rows(self._grades(gradebook))
        except CannotExport as error:
            raise SystemExit(f"autograder: {error}") from None
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows)
        storage.replace(target, text.getvalue().encode(), storage.PRIVATE)
        self.log.info("Exported to %s", target)

    def rows(self, grades: Grades) -> Rows:
        """The lines of the file, its header first; raises CannotExport."""
        raise NotImplementedError

    def tell(self, students: Iterable[str], why: str) -> None:
        """Log one line that names the students who have no line in the file."""
        if names := sorted(map(printable, students)):
            self.log.warning("%d without a line in the file, %s: %s", len(names), why, ", ".join(names))

    def _grades(self, gradebook: Gradebook) -> Grades:
        """The grades asked for."""
        chosen = _chosen(gradebook.assignments, lambda thing: thing.name, self.assignment, "assignment")
        students = _chosen(gradebook.students, lambda thing: thing.id, self.student, "student")
        self._assign_penalties(gradebook, chosen)
        grades: Grades = {student.id: {} for student in students}
        for assignment in chosen:
            handed_in = {one.student_id: one for one in assignment.submissions}
            for student in students:
                grades[student.id][assignment.name] = Grade(student, assignment, handed_in.get(student.id))
        for assignment in chosen:
            states = Counter(grades[student.id][assignment.name].state for student in students)
            empty = ", ".join(f"{states[state]} {state}" for state in (WAITING, MISSING) if states[state])
            self.log.info("%s: %d grades%s", assignment.name, states[DONE], f"; left empty: {empty}" if empty else "")
        return grades

    def _assign_penalties(self, gradebook: Gradebook, assignments: Iterable[Assignment]) -> None:
        """Work out late penalties again, where a policy is set: marks by hand and new extensions change them."""
        if "AssignLatePenalties.plugin_class" not in self.config:
            return
        url = gradebook.engine.url.render_as_string(hide_password=False)
        for assignment in assignments:
            for handed_in in assignment.submissions:
                if late.concerned(handed_in):
                    for notebook in handed_in.notebooks:
                        late.assign(self.config, url, assignment.name, notebook.name, handed_in.student_id)
        gradebook.db.expire_all()


def has_score(part: object) -> bool:
    """Return True if one of nbgrader's grades (of a cell) has points, from tests or by hand."""
    return getattr(part, "auto_score", None) is not None or getattr(part, "manual_score", None) is not None


def harmless(text: str) -> str:
    """`text` for a cell, so that no spreadsheet takes it for a formula, or for several cells.

    Not for ids that an import looks for.  A semicolon is replaced, because in some languages it separates cells.
    """
    text = "".join(" " if char == ";" or unicodedata.category(char) == "Cc" else char for char in text)
    return f"'{text}" if unicodedata.normalize("NFKC", text).lstrip()[:1] in ("=", "+", "-", "@") else text


def number(value: float) -> str:
    """At most two decimals, a decimal point, no thousands separator: as Canvas and Moodle show points."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _chosen(things: Iterable[Thing], name: Callable[[Thing], str], names: list[object], what: str) -> list[Thing]:
    """The things of these names, or all, sorted by name; raises CannotExport when the gradebook lacks one."""
    by_name = {name(thing): thing for thing in things}
    wanted = {str(given) for given in names} or set(by_name)
    if missing := wanted - set(by_name):
        raise CannotExport(f"the gradebook has no {what} {min(missing)!r}")
    return [by_name[given] for given in sorted(wanted)]
