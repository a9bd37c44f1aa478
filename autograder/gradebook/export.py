"""Grades for other systems: plug-ins of `nbgrader export` for Canvas, Moodle, and anything that reads a CSV.

    nbgrader export --exporter autograder.export.CanvasExporter --CanvasExporter.roster=FROM_CANVAS.csv --to canvas.csv
    nbgrader export --exporter autograder.export.MoodleExporter --to moodle.csv
    nbgrader export --exporter autograder.export.CsvExporter --to grades.csv

A grade is the score less the late penalty.  What waits for marks by hand, has no score yet or was not handed in has an
empty cell, never 0, and is counted in a line of the log; so is every student without a line in the file.

Spreadsheets run a cell that begins with = + - or @ as a formula, and students choose their names (OWASP, "CSV
Injection").  Names, and whatever else the import does not look at, get an apostrophe in front, as OWASP advises.  What it
finds the student by is never changed: Canvas's ID is a number; of Moodle's usernames, emails and id numbers, one with
nothing in it that could make a formula of it (`-ada@uni.edu`) is written as it is, and a student with any other
(`=HYPERLINK(...)`) is left out and named.

Files are UTF-8 without a byte order mark: Moodle's import takes it off (lib/csvlib.class.php), Canvas's does not
(lib/gradebook_importer.rb).
"""

import csv
import io
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from nbgrader.api import Assignment, Gradebook, Student, SubmittedAssignment
from nbgrader.plugins import ExportPlugin
from traitlets import Bool, Dict, Enum, Unicode

from autograder.errors import CannotExport
from autograder.gradebook import late
from autograder.results import storage
from autograder.results.text import printable

DONE, WAITING, MISSING = "graded", "waiting for marks", "not handed in"


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
        grades = [grade for notebook in self.handed_in.notebooks for grade in notebook.grades]
        left = any(
            grade.needs_manual_grade or (grade.auto_score is None and grade.manual_score is None) for grade in grades
        )
        return WAITING if left or not grades else DONE

    @property
    def penalty(self) -> float:
        """Points lost for being late."""
        return self.handed_in.late_submission_penalty or 0.0 if self.handed_in else 0.0

    @property
    def points(self) -> str:
        """As the cell of a file: empty unless DONE."""
        return _number(max(0.0, self.handed_in.score - self.penalty)) if self.state == DONE else ""


class _Exporter(ExportPlugin):
    """What the exporters share: whose grades, of what, and a file that is whole or not there."""

    default_name = "grades.csv"

    def export(self, gradebook: Gradebook) -> None:
        """Write the file; nbgrader calls this.  What the instructor can mend is one line and exit code 1."""
        target = Path(self.to or self.default_name)
        try:
            rows = self.rows(self._grades(gradebook))
        except CannotExport as error:
            raise SystemExit(f"autograder: {error}") from None
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows)
        storage.replace(target, text.getvalue().encode(), storage.PRIVATE)
        self.log.info("Exported to %s", target)

    def rows(self, grades: dict[str, dict[str, Grade]]) -> list[list[str]]:
        """The lines of the file, from the grades by student and assignment."""
        raise NotImplementedError

    def _grades(self, gradebook: Gradebook) -> dict[str, dict[str, Grade]]:
        """The grades asked for, by student and assignment."""
        chosen = _chosen(gradebook.assignments, "name", self.assignment, "assignment")
        students = _chosen(gradebook.students, "id", self.student, "student")
        self._assign_penalties(gradebook, chosen)
        grades = {student.id: {} for student in students}
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
        """Late penalties anew, where a policy is set: marks by hand and extensions given since grading change them."""
        if "AssignLatePenalties.plugin_class" not in self.config:
            return
        url = gradebook.engine.url.render_as_string(hide_password=False)
        for assignment in assignments:
            for handed_in in assignment.submissions:
                if late.concerned(handed_in):
                    for notebook in handed_in.notebooks:
                        late.assign(self.config, url, assignment.name, notebook.name, handed_in.student_id)
        gradebook.db.expire_all()

    def _tell(self, students: Iterable[str], why: str) -> None:
        """One line that names the students who have no line in the file."""
        if names := sorted(map(printable, students)):
            self.log.warning("%d without a line in the file, %s: %s", len(names), why, ", ".join(names))


class CsvExporter(_Exporter):
    """A line for each student and assignment.

    nbgrader's own CsvExportPlugin does not quote, so that a comma in a name moves its columns; gives 0 for what was not
    handed in; and does not tell what is still to be marked.
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

    def rows(self, grades: dict[str, dict[str, Grade]]) -> list[list[str]]:
        """Sorted by assignment, then by student."""
        lines = [self._line(grade) for student in grades.values() for grade in student.values()]
        return [list(self.columns), *sorted(lines, key=lambda line: (line[0], line[3]))]

    def _line(self, grade: Grade) -> list[str]:
        student, assignment, handed_in = grade.student, grade.assignment, grade.handed_in
        names = [harmless(text or "") for text in (student.id, student.last_name, student.first_name, student.email)]
        line = [
            harmless(assignment.name),
            str(assignment.duedate or ""),
            "",
            *names,
            grade.state,
            "",
            "",
            grade.points,
            _number(assignment.max_score),
            "",
            "",
        ]
        if handed_in:
            line[2] = str(handed_in.timestamp or "")
            if any(
                part.auto_score is not None or part.manual_score is not None
                for notebook in handed_in.notebooks
                for part in notebook.grades
            ):
                line[8] = _number(handed_in.score)  # also while parts wait: what there is so far
            line[9] = _number(grade.penalty)
            line[12] = _number(handed_in.total_seconds_late / late.DAY)
            line[13] = str(grade.state == WAITING)
        return line


class CanvasExporter(_Exporter):
    """The file that Canvas's Gradebook imports, made from the one that it exports.

    Format: Canvas Instructor Guide, "How do I import grades in the Gradebook?", and Canvas's own reader,
    lib/gradebook_importer.rb: columns Student, ID, perhaps SIS User ID, SIS Login ID, Integration ID and Root Account,
    then Section, then one for each assignment, `Name (ID)`; under the header a line "Points Possible"; students are
    found by their ID first.  A cell left empty would clear a grade that Canvas has: where there is nothing to tell, the
    cell stays as it was exported.  Columns that are not of this course are left out, and so left alone by the import.
    """

    default_name = "canvas.csv"
    roster = Unicode(help="The gradebook as exported from Canvas.").tag(config=True)
    columns = Dict(
        help="The Canvas assignment of each assignment that is called differently there, as in the header, "
        "for example {'calculator': 'Exercise 5 (1234)'}."
    ).tag(config=True)
    ids = ("SIS User ID", "SIS Login ID", "ID")
    about = (
        "Student",
        "LastName",
        "FirstName",
        "ID",
        "SIS User ID",
        "SIS Login ID",
        "Integration ID",
        "Root Account",
        "Section",
    )

    def rows(self, grades: dict[str, dict[str, Grade]]) -> list[list[str]]:
        """The students and columns of the roster that there is something to tell about."""
        if not self.roster:
            raise CannotExport("export the gradebook from Canvas, and give the file: --CanvasExporter.roster=FILE")
        if Path(self.to or self.default_name).resolve() == Path(self.roster).resolve():
            raise CannotExport(f"{self.roster} would be overwritten: choose another name with --to")
        header, possible, lines = self._read()
        known = [header.index(name) for name in self.about if name in header]
        assignments = {name: grade.assignment for student in grades.values() for name, grade in student.items()}
        places = {name: self._column(name, header) for name in assignments}
        if twice := [name for name, count in Counter(filter(None, places.values())).items() if count > 1]:
            raise CannotExport(f"two assignments are the column {header[twice[0]]!r}")
        titles, most = [], []
        for name, place in places.items():
            here = _number(assignments[name].max_score)
            there = possible[place].strip() if place is not None else here
            if place is None:
                self.log.warning(
                    "%s is not in %s: Canvas will ask whether to make a new assignment", printable(name), self.roster
                )
            elif _value(there) != _value(here):
                self.log.warning(
                    "%s: Canvas has %s points possible, the gradebook %s; points are exported as they are",
                    printable(name),
                    there or "no",
                    here,
                )
            titles.append(header[place] if place is not None else name)
            most.append(there)
        by_line = self._match(grades, header, lines)
        rows = [
            [*(header[i] for i in known), *titles],
            [*("    Points Possible" if header[i] in ("Student", "LastName") else "" for i in known), *most],
        ]
        for number, line in enumerate(lines):
            mine = grades.get(by_line.get(number), {})
            cells = [
                (mine[name].points if name in mine else "") or (line[place] if place is not None else "")
                for name, place in places.items()
            ]
            rows.append([*(harmless(line[i]) for i in known), *cells])
        return rows

    def _read(self) -> tuple[list[str], list[str], list[list[str]]]:
        """Header, points possible and the students' lines of the roster, all of one length."""
        try:
            text = Path(self.roster).read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise CannotExport(f"{self.roster} cannot be read: {error}") from None
        first = text.partition("\n")[0]
        separator = ";" if first.count(";") > first.count(",") else ","  # Canvas writes either
        lines = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
        header = [title.strip() for title in lines[0]] if lines else []
        if not {"ID", "Section"} <= set(header) or not {"Student", "LastName"} & set(header):
            raise CannotExport(
                f"{self.roster} is no gradebook exported from Canvas: it has no columns Student, ID, Section"
            )
        possible, students = [""] * len(header), []
        for number, line in enumerate(lines[1:], 2):
            line = (line + [""] * len(header))[: len(header)]
            if "Points Possible" in line[0]:
                possible = line
            elif line[header.index("ID")].strip().isdecimal():
                students.append(line)
            elif any(re.fullmatch(r"\s*(?!Manual Posting|Muted)\S.*", cell) for cell in line):
                raise CannotExport(f"line {number} of {self.roster} has no ID of a student")
        return header, possible, students

    def _column(self, name: str, header: list[str]) -> int | None:
        """The place of an assignment's column; None when there is none."""
        if name in self.columns:
            if self.columns[name] not in header:
                raise CannotExport(f"{self.roster} has no column {self.columns[name]!r}")
            return header.index(self.columns[name])
        found = [
            place
            for place, title in enumerate(header)
            if re.sub(r" \(\d+\)$", "", title).strip().casefold() == name.casefold() and title not in self.about
        ]
        if len(found) > 1:
            raise CannotExport(
                f"{self.roster} has {len(found)} columns for {name}: choose one with CanvasExporter.columns"
            )
        return found[0] if found else None

    def _match(self, grades: dict[str, dict[str, Grade]], header: list[str], lines: list[list[str]]) -> dict[int, str]:
        """The student of each line that has one: by id, email or LMS id in any of the roster's three columns."""
        places = [header.index(name) for name in self.ids if name in header]
        found: dict[str, set[int]] = {}
        for student, mine in grades.items():
            person = next(iter(mine.values())).student if mine else None
            keys = {
                key.strip().casefold()
                for key in (student, person and person.email, person and person.lms_user_id)
                if key
            }
            found[student] = {
                number
                for number, line in enumerate(lines)
                if any(line[place].strip().casefold() in keys for place in places)
            }
        claims = Counter(number for numbers in found.values() for number in numbers)
        clear = {
            student: next(iter(numbers))
            for student, numbers in found.items()
            if len(numbers) == 1 and claims[next(iter(numbers))] == 1
        }
        self._tell(
            [student for student, numbers in found.items() if not numbers], f"because {self.roster} does not have them"
        )
        self._tell(
            [student for student, numbers in found.items() if numbers and student not in clear],
            f"because they fit several lines of {self.roster}, or a line fits several of them",
        )
        if rest := len(lines) - len(clear):
            self.log.info(
                "%d of the %d students in %s have no grade here, and keep what Canvas has",
                rest,
                len(lines),
                self.roster,
            )
        return {number: student for student, number in clear.items()}


class MoodleExporter(_Exporter):
    """The file that Moodle imports with Grades > Import > CSV file.

    Format: Moodle documentation, "Grade import", and Moodle's own reader, grade/import/csv/classes/load_data.php: a
    header, a line for each student, points with a decimal point.  In the preview choose "Map from" the first column,
    "Map to" as it is called (username, useremail or useridnumber), and the grade item of each column.  One unknown user
    stops Moodle's whole import; a cell left empty takes away a grade that Moodle has, so a student without any grade
    gets no line.
    """

    default_name = "moodle.csv"
    user = Enum(
        ("username", "email", "idnumber"),
        "username",
        help="What Moodle finds students by: username is the "
        "gradebook's student id; idnumber its LMS id, or the student id where there is none.",
    ).tag(config=True)
    feedback = Bool(
        False,
        help="Add a column of feedback for each assignment: lateness, and what was written by hand. "
        "Moodle shows it instead of the feedback that it has.",
    ).tag(config=True)

    def rows(self, grades: dict[str, dict[str, Grade]]) -> list[list[str]]:
        """One line for each student who has a grade."""
        names = list(next(iter(grades.values()), {}))
        header = [self.user]
        for name in names:
            header += [name, f"{name} (feedback)"] if self.feedback else [name]
        rows, without, unsafe, key_of = [header], [], [], {}
        for student, mine in grades.items():
            if not any(grade.points for grade in mine.values()):
                continue
            key = self._key(next(iter(mine.values())).student)
            if not key:
                without.append(student)
            elif harmless(key) != key and not re.fullmatch(r"[-+@][\w.@+-]*", key):
                unsafe.append(student)
            elif key in key_of:
                raise CannotExport(f"{key_of[key]} and {student} have the same {self.user}, {key}")
            else:
                key_of[key] = student
                row = [key]
                for name in names:
                    row += [mine[name].points, self._feedback(mine[name])] if self.feedback else [mine[name].points]
                rows.append(row)
        self._tell(
            [student for student, mine in grades.items() if not any(grade.points for grade in mine.values())],
            "because there is no grade to tell",
        )
        self._tell(without, f"because the gradebook does not have their {self.user}")
        self._tell(unsafe, f"because a spreadsheet would run their {self.user} as a formula")
        return rows

    def _key(self, student: Student) -> str:
        key = {"username": student.id, "email": student.email, "idnumber": student.lms_user_id or student.id}[self.user]
        return (key or "").strip()

    def _feedback(self, grade: Grade) -> str:
        if grade.state != DONE:
            return ""
        said = [f"Handed in late: {_number(grade.penalty)} points off."] if grade.penalty else []
        said += [
            comment.comment
            for notebook in grade.handed_in.notebooks
            for comment in notebook.comments
            if comment.comment
        ]
        return harmless(" ".join(said).replace("&", "&amp;").replace("<", "&lt;"))  # Moodle shows it as HTML


def harmless(text: str) -> str:
    """A text for a cell that no spreadsheet takes for a formula, or for several cells.

    Not ids that an import looks for: see the top.  A semicolon would end the cell where the list separator is one.
    """
    text = "".join(" " if char == ";" or unicodedata.category(char) == "Cc" else char for char in text)
    return f"'{text}" if unicodedata.normalize("NFKC", text).lstrip()[:1] in ("=", "+", "-", "@") else text


def _chosen(things: list, key: str, names: list, what: str) -> list:
    """Those of the names given, or all, in the order of their names."""
    wanted = {str(name) for name in names}
    if missing := wanted - {getattr(thing, key) for thing in things}:
        raise CannotExport(f"the gradebook has no {what} {min(missing)!r}")
    return sorted(
        (thing for thing in things if not wanted or getattr(thing, key) in wanted),
        key=lambda thing: getattr(thing, key),
    )


def _number(value: float) -> str:
    """At most two decimals, a decimal point, no thousands separator: as Canvas and Moodle show points."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _value(text: str) -> float | None:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None
