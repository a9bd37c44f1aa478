"""Grades for Moodle."""

import re

from nbgrader.api import Student
from traitlets import Bool, Enum

from autograder.errors import CannotExport
from autograder.gradebook.book import COLUMNS
from autograder.gradebook.exporter import DONE, MISSING, Exporter, Grade, Grades, Rows, harmless, number
from autograder.platforms import MOODLE

NO_FORMULA = re.compile(  # a key that starts like a formula but is none: no sum, no cell reference
    r"[-+@](?![A-Za-z]{1,3}\d{1,7}$)[\w.]+|[-+@][\w.+-]*[^\W\d][\w.+-]*@[\w.-]+"
)
# Columns of a roster that have a key, the first of them that there is; and those that fill the gradebook's LMS id, too.
IN_ROSTER = {"username": (("username",), ()), "idnumber": (("idnumber", "lms_user_id"), COLUMNS["lms_user_id"])}


class MoodleExporter(Exporter):
    """The file that Moodle imports with Grades > Import > CSV file.

    Format (its sources are in `platforms`): a header, a line for each student, points with a decimal point.  In the
    preview choose "Map from" the first column, "Map to" the field of the same name (username, useremail or
    useridnumber), and the grade item of each column.  One unknown user stops Moodle's whole import; an empty cell
    removes a grade that Moodle has, so a student without any grade gets no line.

    Moodle finds students by their username, email or id number, so these are never changed.  One that starts like a
    formula but cannot be one (`-ada@uni.edu`) is written as it is; a student with a real formula (`=HYPERLINK(...)`) is
    left out and named.
    """

    default_name = MOODLE.grades
    user = Enum(
        MOODLE.columns,
        MOODLE.columns[0],
        help="The column by which Moodle finds students: username and idnumber are the roster's, if it has such a "
        "column. Otherwise username is the gradebook's student id; idnumber is its LMS id, or the student id if there "
        "is none; a number that the roster calls canvas_id or moodle_id does not count as one.",
    ).tag(config=True)
    feedback = Bool(
        False,
        help="Add a column of feedback for each assignment: lateness, and comments written by hand. It replaces "
        "the feedback in Moodle.",
    ).tag(config=True)

    def rows(self, grades: Grades) -> Rows:
        """Return a line for each student who has a grade."""
        names = list(next(iter(grades.values()), {}))
        header = [self.user]
        for name in names:
            header += [name, f"{name} (feedback)"] if self.feedback else [name]
        rows, without_grade, without_key, unsafe = [header], [], [], []
        key_of: dict[str, str] = {}
        for student, mine in grades.items():
            if not any(grade.points for grade in mine.values()):
                without_grade.append(student)
                continue
            key = self._key(next(iter(mine.values())).student)
            if not key:
                without_key.append(student)
            elif harmless(key) != key and not NO_FORMULA.fullmatch(key):
                unsafe.append(student)
            elif key in key_of:
                raise CannotExport(f"{key_of[key]} and {student} have the same {self.user}, {key}")
            else:
                key_of[key] = student
                rows.append([key, *(cell for name in names for cell in self._cells(mine[name]))])
        self.tell(without_grade, "because there is no grade to export")
        self.tell(
            without_key, f"because neither the roster (column {self.user!r}) nor the gradebook has their {self.user}"
        )
        self.tell(unsafe, f"because a spreadsheet would take their {self.user} for a formula or for several cells")
        return rows

    def _key(self, student: Student) -> str:
        """Return the key by which Moodle finds the student; empty if neither roster nor gradebook has it."""
        roster, (own, others) = self.class_roster, IN_ROSTER.get(self.user, ((), ()))
        if roster and any(map(roster.has_column, (*own, *others))):  # another number may be somebody else's idnumber
            column = next(filter(roster.has_column, own), "")
            return roster.value(student.id, column)
        keys = {"username": student.id, "email": student.email, "idnumber": student.lms_user_id or student.id}
        return (keys[self.user] or "").strip()

    def _cells(self, grade: Grade) -> list[str]:
        return [grade.points, self._feedback(grade)] if self.feedback else [grade.points]

    def _feedback(self, grade: Grade) -> str:
        if grade.handed_in is None:
            return "Not handed in." if grade.state == MISSING else ""
        if grade.state != DONE:
            return ""
        said = [f"Handed in late: {number(grade.penalty)} points off."] if grade.penalty else []
        comments = (comment.comment for notebook in grade.handed_in.notebooks for comment in notebook.comments)
        said += [comment for comment in comments if comment]
        return harmless(" ".join(said).replace("&", "&amp;").replace("<", "&lt;"))  # Moodle shows it as HTML
