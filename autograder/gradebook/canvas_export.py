"""Grades for Canvas."""

import csv
import io
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from traitlets import Dict, Unicode

from autograder.errors import CannotExport
from autograder.gradebook.exporter import Exporter, Grades, Rows, harmless, number
from autograder.platforms import CANVAS
from autograder.results.text import counted, printable

ABOUT = ("Student", "LastName", "FirstName", "ID", "SIS User ID", "SIS Login ID", "Integration ID", "Root Account")
ABOUT_STUDENTS = (*ABOUT, "Section")  # columns that are not assignments


@dataclass(frozen=True)
class CanvasGradebook:
    """The gradebook as exported from Canvas; every line has as many cells as the header."""

    file: str
    header: list[str]
    possible: list[str]  # the maximum points of each assignment in Canvas
    students: list[list[str]]

    @classmethod
    def read(cls, file: str) -> "CanvasGradebook":
        """Read the file; raises CannotExport when it is not a gradebook exported from Canvas."""
        try:
            text = Path(file).read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise CannotExport(f"{file} cannot be read: {error}") from None
        first = text.partition("\n")[0]
        separator = ";" if first.count(";") > first.count(",") else ","  # Canvas writes either
        try:
            lines = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
        except csv.Error as error:
            raise CannotExport(f"{file} is not a gradebook exported from Canvas: {error}") from None
        header = [title.strip() for title in lines[0]] if lines else []
        if not {"ID", "Section"} <= set(header) or not {"Student", "LastName"} & set(header):
            missing = "it has no columns Student, ID, Section"
            raise CannotExport(f"{file} is not a gradebook exported from Canvas: {missing}")
        possible, students = [""] * len(header), []
        for count, given in enumerate(lines[1:], 2):
            line = (given + [""] * len(header))[: len(header)]
            if "Points Possible" in line[0]:
                possible = line
            elif line[header.index("ID")].strip().isdecimal():
                students.append(line)
            elif any(re.fullmatch(r"\s*(?!Manual Posting|Muted)\S.*", cell) for cell in line):
                raise CannotExport(f"line {count} of {file} has no student ID")
        return cls(file, header, possible, students)

    def column(self, name: str, title: str | None) -> int | None:
        """Return the index of an assignment's column, named `title` or like the assignment; None if there is none.

        Raises CannotExport when there is no column `title`, or several are named like the assignment.
        """
        if title is not None:
            if title not in self.header:
                raise CannotExport(f"{self.file} has no column {title!r}")
            return self.header.index(title)
        found = [
            place
            for place, title in enumerate(self.header)
            if re.sub(r" \(\d+\)$", "", title).strip().casefold() == name.casefold() and title not in ABOUT_STUDENTS
        ]
        if len(found) > 1:
            raise CannotExport(
                f"{self.file} has {len(found)} columns for {name}: "
                "choose one with c.CanvasExporter.columns in nbgrader_config.py"
            )
        return found[0] if found else None

    def number(self, line: int) -> str:
        """Return the ID of the student in a line."""
        return self.students[line][self.header.index("ID")].strip()

    def lines_of(self, keys: set[str]) -> set[int]:
        """Return the lines with one of these case-folded `keys` in a column that Canvas finds students by."""
        places = [self.header.index(name) for name in CANVAS.columns if name in self.header]
        return {
            count
            for count, line in enumerate(self.students)
            if any(line[place].strip().casefold() in keys for place in places)
        }


class CanvasExporter(Exporter):
    """The file that Canvas's Gradebook imports, made from the one that it exports.

    Format (its sources are in `platforms`): columns Student, ID, perhaps SIS User ID, SIS Login ID, Integration ID and
    Root Account, then Section, then one for each assignment, `Name (ID)`; under the header a line "Points Possible";
    students are found first by their ID, a number.  An empty cell would clear a grade in Canvas, so without a grade the
    cell stays as it was exported.  Columns of other assignments are left out, and the import does not change them.
    """

    default_name = CANVAS.grades
    roster = Unicode(help="The gradebook as exported from Canvas.").tag(config=True)
    columns = Dict(
        help="The Canvas column of each assignment that has another name there, as in the header, for example "
        "{'calculator': 'Exercise 5 (1234)'}."
    ).tag(config=True)

    def rows(self, grades: Grades) -> Rows:
        """Return the students of the roster, with its columns about them and the exported assignments."""
        if not self.roster:
            raise CannotExport(f"export the gradebook from Canvas, and give the file: {self.option('roster', 'FILE')}")
        if Path(self.to or self.default_name).resolve() == Path(self.roster).resolve():
            raise CannotExport(f"{self.roster} would be overwritten: choose another name with --to")
        roster = CanvasGradebook.read(self.roster)
        known = [roster.header.index(name) for name in ABOUT_STUDENTS if name in roster.header]
        names = {name for student in grades.values() for name in student}
        places = {name: roster.column(name, self.columns.get(name)) for name in sorted(names)}
        if twice := [name for name, count in Counter(filter(None, places.values())).items() if count > 1]:
            raise CannotExport(f"two assignments map to the column {roster.header[twice[0]]!r}")
        header, possible = self._assignments(grades, roster, places)
        rows = [
            [*(roster.header[i] for i in known), *header],
            [*("    Points Possible" if roster.header[i] in ("Student", "LastName") else "" for i in known), *possible],
        ]
        students = self._students(grades, roster)
        for count, line in enumerate(roster.students):
            mine = self._of_line(students[count], grades, roster.number(count)) if count in students else {}
            cells = [mine.get(name) or (line[place] if place is not None else "") for name, place in places.items()]
            rows.append([*(harmless(line[i]) for i in known), *cells])
        return rows

    def _of_line(self, student: str, grades: Grades, number: str) -> dict[str, str]:
        """Return a student's points, without those for a hand-in that came from another number than the line's."""
        points = {}
        for name, grade in grades[student].items():
            sender = self.senders.number((student, name), CANVAS.name)
            if grade.points and grade.handed_in and sender not in ("", number):
                self.log.warning(
                    "%s: no grade for %s: the hand-in came from the number %s in Canvas, and in %s %s has the ID %s. "
                    "If they are one person, enter the grade in Canvas by hand",
                    *map(printable, (name, student, sender, self.roster, student, number)),
                )
            else:
                points[name] = grade.points
        return points

    def _assignments(
        self, grades: Grades, roster: CanvasGradebook, places: dict[str, int | None]
    ) -> tuple[list[str], list[str]]:
        """Return title and possible points of each assignment's column; logs differences from Canvas."""
        assignments = {name: grade.assignment for student in grades.values() for name, grade in student.items()}
        titles, possible = [], []
        for name, place in places.items():
            here = number(assignments[name].max_score)
            there = roster.possible[place].strip() if place is not None else here
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
            titles.append(roster.header[place] if place is not None else name)
            possible.append(there)
        return titles, possible

    def _students(self, grades: Grades, roster: CanvasGradebook) -> dict[int, str]:
        """Return the student of each line that has one, by id, email or LMS id in any of the roster's three columns."""
        found: dict[str, set[int]] = {}
        for student, mine in grades.items():
            person = next(iter(mine.values())).student if mine else None
            keys = (student, person and person.email, person and person.lms_user_id)
            found[student] = roster.lines_of({key.strip().casefold() for key in keys if key})
        claims = Counter(line for lines in found.values() for line in lines)
        clear = {
            line: student for student, lines in found.items() for line in lines if len(lines) == 1 and claims[line] == 1
        }
        others = {}
        for line, student in list(clear.items()):
            if own := self.senders.other((student, ""), CANVAS.name, roster.number(line)):
                others[student] = f"{student} ({roster.number(line)} there, {own[0]} in the roster's column {own[1]!r})"
                del clear[line]
        self.tell(
            [student for student, lines in found.items() if not lines], f"because {self.roster} does not have them"
        )
        self.tell(
            [student for student, lines in found.items() if lines and student not in {*clear.values(), *others}],
            f"because they match several lines of {self.roster}, or a line matches several of them",
        )
        self.tell(
            others.values(),
            f"because their ID in {self.roster} is not their number in the roster (correct the one in the roster if it "
            "is wrong; if it is right, the line there is somebody else's)",
        )
        if rest := len(roster.students) - len(clear):
            self.log.info(
                "%d of %s in %s have no grade here: their grades in Canvas are kept",
                rest,
                counted(len(roster.students), "student"),
                self.roster,
            )
        return clear


def _value(text: str) -> float | None:
    """Return a number of the roster, with decimal point or comma; None if it is not a number."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None
