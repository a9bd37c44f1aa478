"""Grades as a CSV file, for anything that reads one."""

import math

from autograder.gradebook import late
from autograder.gradebook.exporter import WAITING, Exporter, Grade, Grades, Rows, harmless, has_score, number

DECIMALS = 4  # of days late; the last one stands for 9 s


class CsvExporter(Exporter):
    """A line for each student and assignment.

    nbgrader's own CsvExportPlugin does not quote, so a comma in a name shifts the columns; it gives 0 for missing
    submissions; and it does not show what is still to be marked.

    `days_late` is the time since the due date, moved by the student's extension, in days: 3 hours are 0.125.  Grace
    days do not shorten it, and it is not the number of days that cost points.
    """

    columns = (
        "assignment",
        "duedate",
        "timestamp",
        "student_id",
        "last_name",
        "first_name",
        "email",
        "state",
        "raw_score",
        "late_submission_penalty",
        "score",
        "max_score",
        "days_late",
        "needs_manual_grade",
    )

    def rows(self, grades: Grades) -> Rows:
        """Return the lines, sorted by assignment, then by student."""
        lines = [self._line(grade) for student in grades.values() for grade in student.values()]
        lines.sort(key=lambda line: (line["assignment"], line["student_id"]))
        return [list(self.columns), *([line[column] for column in self.columns] for line in lines)]

    def _line(self, grade: Grade) -> dict[str, str]:
        student, assignment, handed_in = grade.student, grade.assignment, grade.handed_in
        line = dict.fromkeys(self.columns, "") | {
            "assignment": harmless(assignment.name),
            "duedate": str(assignment.duedate or ""),
            "student_id": harmless(student.id),
            "last_name": harmless(student.last_name or ""),
            "first_name": harmless(student.first_name or ""),
            "email": harmless(student.email or ""),
            "state": grade.state,
            "score": grade.points,
            "max_score": number(assignment.max_score),
        }
        if handed_in:
            line["timestamp"] = str(handed_in.timestamp or "")
            if any(map(has_score, grade.parts)):  # of the parts that `score` counts, even while some wait for a mark
                line["raw_score"] = number(sum(part.score for part in grade.parts))
            line["late_submission_penalty"] = number(grade.penalty)
            line["days_late"] = _days(late.lateness(self.config, handed_in))
            line["needs_manual_grade"] = str(grade.state == WAITING)
        return line


def _days(seconds: float) -> str:
    """Return a time in days, rounded up, so that only what was in time has 0."""
    return f"{math.ceil(seconds / late.DAY * 10**DECIMALS) / 10**DECIMALS:.{DECIMALS}f}".rstrip("0").rstrip(".")
