"""Shared parts of the exporters: choosing students and assignments, and writing a CSV file that is safe to open.

The exporters are plug-ins of `nbgrader export`, which finds them by module and name:

    nbgrader export --exporter autograder.gradebook.moodle_export.MoodleExporter --to moodle.csv

A grade is the score minus the late penalty.  The cell is empty, not 0, if a submission waits for manual marks, has no
score yet or is missing.  Options change that: `automatic` exports the points of the tests, and `not_handed_in` fills
the cells of missing submissions.  The log has the numbers of each, the students who wait for marks or handed in
nothing, and every student without a line in the file.

The gradebook keeps students who have left the class (see `members.in_class`).  What was collected of theirs is
exported; what was not is never called missing, and a student without any collected hand-in has no line.

The platform's number decides whose a hand-in is, not the name (see `Senders`): a student who has another number in the
roster than the sender of the hand-in gets no grade for it, and is named.

Spreadsheets run a cell that begins with = + - or @ as a formula, and students choose their names (OWASP, "CSV
Injection").  Names, and whatever else the import does not use, get an apostrophe in front, as OWASP advises.  What
the import finds students by is never changed: see each exporter.

Files are UTF-8 without a byte order mark: Moodle's import removes it (lib/csvlib.class.php), Canvas's does not
(lib/gradebook_importer.rb).
"""

import csv
import io
import itertools
import unicodedata
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from nbgrader.api import Assignment, Gradebook, Student, SubmittedAssignment
from nbgrader.api import Grade as CellGrade
from nbgrader.plugins import ExportPlugin
from traitlets import Bool, Enum

from autograder.errors import CannotExport, UsageError
from autograder.gradebook import late, members
from autograder.results import targets
from autograder.results.text import counted, printable
from autograder.submissions import exercises, listing, provenance
from autograder.submissions.roster import Roster, of_class
from autograder.submissions.senders import Senders
from course.foundation import storage

DONE, WAITING, MISSING, LEFT = "graded", "waiting for marks", "not handed in", "has left the class"
UNGRADED, OTHERS = "not graded yet", "from another number"
Thing = TypeVar("Thing", Assignment, Student)


@dataclass(frozen=True)
class Grade:
    """One student's grade for one assignment."""

    student: Student
    assignment: Assignment
    handed_in: SubmittedAssignment | None
    automatic: bool = False  # only the points of tests count
    not_handed_in: str = ""  # the text of the cell without a submission
    left: bool = False  # the student is not in the class any more
    collected: bool = False  # the folder of the submissions has one
    others: bool = False  # the platform's number of its sender is not the student's

    @cached_property
    def parts(self) -> list[CellGrade]:
        """Return the grades of the notebook cells that count."""
        found = [part for notebook in self.handed_in.notebooks for part in notebook.grades] if self.handed_in else []
        return [part for part in found if part.auto_score is not None] if self.automatic else found

    @cached_property
    def unmarked(self) -> list[str]:
        """Return the names of the notebook cells that wait for a mark."""
        return [part.name for part in self.parts if _waits(part)] if not self.automatic else []

    @cached_property
    def state(self) -> str:
        """Return DONE, WAITING, UNGRADED, OTHERS, MISSING, or LEFT: nothing was collected, and the student has left."""
        if self.others:
            return OTHERS
        if self.handed_in is None:
            return UNGRADED if self.collected else LEFT if self.left else MISSING
        return WAITING if self.unmarked or not self.parts else DONE

    @property
    def penalty(self) -> float:
        """Return the points lost for lateness."""
        return (self.handed_in.late_submission_penalty or 0.0) if self.handed_in else 0.0

    @property
    def points(self) -> str:
        """Return the score minus the penalty as text for the file; empty while it waits for marks."""
        if self.handed_in is None:
            return self.not_handed_in if self.state == MISSING else ""
        if self.state != DONE:
            return ""
        return number(max(0.0, sum(part.score for part in self.parts) - self.penalty))


Grades = dict[str, dict[str, Grade]]  # by student and assignment
Rows = list[list[str]]


class Exporter(ExportPlugin):
    """A plug-in of `nbgrader export` that writes its file atomically."""

    default_name = "grades.csv"
    options: Mapping[str, str] = MappingProxyType({})  # another command's options for the traits below
    replaced: Collection[tuple[str, str]] = ()  # students and assignments with other files now than were graded
    class_roster: Roster | None = None  # set by `export`, if it is known
    automatic = Bool(False, help="Export the points of the tests, without waiting for marks by hand.").tag(config=True)
    not_handed_in = Enum(
        ("", "0"), "", help="The cell of an assignment that was not handed in: empty, or 0 points."
    ).tag(config=True)

    def export(self, gradebook: Gradebook) -> None:
        """Write the file; nbgrader calls this.  A mistake that the instructor can fix is one line and exit status 1."""
        target = Path(self.to or self.default_name)
        if why := targets.refused(target, [], [self._submitted()], [Path(gradebook.engine.url.database or "")]):
            raise SystemExit(f"autograder: cannot write to {target}: {why}")
        try:
            rows = self.rows(self._grades(gradebook))
        except CannotExport as error:
            raise SystemExit(f"autograder: {error}") from None
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows)
        storage.write(target, text.getvalue().encode(), storage.PRIVATE)
        self.log.info("Exported to %s", target)

    def rows(self, grades: Grades) -> Rows:
        """Return the lines of the file, its header first; raises CannotExport."""
        raise NotImplementedError

    def option(self, trait: str, value: str) -> str:
        """Return the option that sets a trait, for the command in use: `nbgrader export` unless `options` says more."""
        return self.options.get(trait, f"--{type(self).__name__}.{trait}={value}")

    def tell(self, students: Iterable[str], why: str) -> None:
        """Log one line that names the students who have no line in the file."""
        if names := sorted(map(printable, students)):
            self.log.warning(
                "%s without a line in the file, %s: %s", counted(len(names), "student"), why, ", ".join(names)
            )

    def _grades(self, gradebook: Gradebook) -> Grades:
        """Return the requested grades."""
        chosen = _chosen(gradebook.assignments, lambda thing: thing.name, self.assignment, "assignment")
        students = _chosen(gradebook.students, lambda thing: thing.id, self.student, "student")
        self._assign_penalties(gradebook, chosen)
        submitted = self._submitted()
        now, self.class_roster = self._in_class(submitted)
        every = itertools.product(
            (thing.id for thing in gradebook.students), (thing.name for thing in gradebook.assignments)
        )
        self.senders = Senders.read(submitted, every, self.class_roster)
        grades: Grades = {student.id: {} for student in students}
        for assignment in chosen:
            handed_in = {one.student_id: one for one in assignment.submissions}
            others = self._of_others(assignment.name, handed_in, students)
            for student in students:
                grades[student.id][assignment.name] = Grade(
                    student,
                    assignment,
                    None if student.id in others else handed_in.get(student.id),
                    self.automatic,
                    self.not_handed_in,
                    now is not None and student.id not in now,
                    listing.is_handed_in(submitted, student.id, assignment.name),
                    student.id in others,
                )
        gone = [name for name, mine in grades.items() if mine and {grade.state for grade in mine.values()} == {LEFT}]
        self.tell(gone, "because they have left the class without a hand-in")
        grades = {name: mine for name, mine in grades.items() if name not in gone}
        students = [student for student in students if student.id in grades]
        for assignment in chosen:
            states = Counter(grades[student.id][assignment.name].state for student in students)
            unfilled = (WAITING, UNGRADED, OTHERS, *([] if self.not_handed_in else [MISSING]), LEFT)
            empty = ", ".join(f"{states[state]} {state}" for state in unfilled if states[state])
            parts = [counted(states[DONE], "grade"), *([f"left empty: {empty}"] if empty else [])]
            if self.not_handed_in and states[MISSING]:
                parts.append(f"{self.not_handed_in} points: {states[MISSING]} {MISSING}")
            self.log.info("%s: %s", assignment.name, "; ".join(parts))
            if states[DONE] and not self.automatic and (points := _not_in(assignment)):
                self.log.warning(
                    "%s: without the %s for answers that are marked by hand: this gradebook does not have these "
                    "questions. Release the exercise (`autograder release`), and grade in that course folder, to mark "
                    "them",
                    *(printable(assignment.name), f"{points:g} points"),
                )
            self._tell_who(assignment.name, [grades[student.id][assignment.name] for student in students])
            self._tell_unknown(assignment.name, submitted, {student.id for student in gradebook.students})
        return grades

    def _tell_who(self, assignment: str, grades: list[Grade]) -> None:
        """Log the students who wait for marks, those who handed in nothing, and those who have left before."""
        waiting: dict[tuple[str, ...], list[str]] = {}
        for grade in grades:
            if grade.state == WAITING:
                waiting.setdefault(tuple(grade.unmarked), []).append(printable(grade.student.id))
        for cells, students in waiting.items():
            what = f"a mark of {' and '.join(cells)}" if cells else "any score"
            self.log.warning("%s: waiting for %s: %s", printable(assignment), what, ", ".join(students))
        if waiting and not self.automatic:
            self.log.warning("%s exports the points of the tests", self.option("automatic", "True"))
        if missing := [printable(grade.student.id) for grade in grades if grade.state == MISSING]:
            self.log.warning("%s: %s by %s", printable(assignment), MISSING, ", ".join(missing))
        if ungraded := [printable(grade.student.id) for grade in grades if grade.state == UNGRADED]:
            self.log.warning(
                "%s: handed in, but %s: %s. Grade, and export again",
                printable(assignment),
                UNGRADED,
                ", ".join(ungraded),
            )
        if left := [printable(grade.student.id) for grade in grades if grade.state == LEFT]:
            who = ", ".join(left)
            self.log.warning(
                "%s: no hand-in from these students, who have left the class: %s", printable(assignment), who
            )

    def _tell_unknown(self, assignment: str, submitted: Path, known: set[str]) -> None:
        """Log the students who have handed in, and whom the gradebook does not have, because nothing was graded yet."""
        found = listing.folders(submitted) if submitted.is_dir() else []
        new = [each for each in found if each not in known and listing.is_handed_in(submitted, each, assignment)]
        if new and not self.student:
            who = ", ".join(map(printable, new))
            self.log.warning(
                "%s: handed in, %s, and not in the gradebook: %s. Grade, and export again",
                printable(assignment),
                UNGRADED,
                who,
            )

    def _of_others(self, assignment: str, handed_in: Iterable[str], students: Iterable[Student]) -> set[str]:
        """Return the students whose graded hand-in came from another number than theirs; log a line for each."""
        found = set()
        for student in sorted(set(handed_in) & {each.id for each in students}):
            came = self.senders.came.get((student, assignment), [])
            if (student, assignment) in self.replaced and len(people := provenance.people(came)) > 1:
                self.log.warning(
                    "%s: no grade for %s: hand-ins came from %s in %s, and what counts now is not what was graded. "
                    "Grade it with `autograder regrade`, and export again",
                    *map(printable, (assignment, student, " and ".join(people), came[-1].platform)),
                )
                found.add(student)
            elif contradiction := self.senders.contradicted((student, assignment)):
                last, number, column = contradiction
                self.log.warning(
                    "%s: no grade for %s: the hand-in came from the number %s in %s, and in the roster %s has %s "
                    "(column %r). Correct the roster if it is wrong. If they are two people, list both: %s with %s, "
                    "and the other one with another name in the column 'student'",
                    *map(printable, (assignment, student, last.user, last.platform, student, number)),
                    *(column, printable(student), printable(last.user)),
                )
                found.add(student)
        return found

    def _in_class(self, submitted: Path) -> tuple[set[str] | None, Roster | None]:
        """Return the students who are in the class now, and the roster; None for what is not known."""
        try:
            now = members.in_class(Path(self.config.CourseDirectory.get("root", ".")), submitted)
            return now, of_class(submitted, None)
        except UsageError as error:
            self.log.warning("The roster was not compared, nor is it known who has left the class: %s", error)
            return None, None

    def _submitted(self) -> Path:
        """Return the folder with STUDENT/ASSIGNMENT/FILES."""
        folders = self.config.CourseDirectory
        return Path(folders.get("root", "."), folders.get("submitted_directory", "submitted"))

    def _assign_penalties(self, gradebook: Gradebook, assignments: Iterable[Assignment]) -> None:
        """Compute late penalties again, where a policy is set: manual marks and new extensions change them."""
        if late.POLICY not in self.config:
            return
        url = gradebook.engine.url.render_as_string(hide_password=False)
        for assignment in assignments:
            for handed_in in assignment.submissions:
                if late.concerned(handed_in):
                    for notebook in handed_in.notebooks:
                        late.assign(self.config, url, assignment.name, notebook.name, handed_in.student_id)
        gradebook.db.expire_all()


def _not_in(assignment: Assignment) -> float:
    """Return the points of the exercise's written answers, if the gradebook has none of these questions."""
    try:
        exercise = exercises.load(assignment.name)
    except UsageError:  # an assignment of the instructor's own
        return 0.0
    known = {cell.name for notebook in assignment.notebooks for cell in (*notebook.grade_cells, *notebook.task_cells)}
    return 0.0 if known - exercise.cells.keys() else exercises.points_by_hand(exercise.name)


def has_score(part: object) -> bool:
    """Return True if nbgrader's grade of a notebook cell has points, automatic or manual."""
    return getattr(part, "auto_score", None) is not None or getattr(part, "manual_score", None) is not None


def _waits(part: CellGrade) -> bool:
    return bool(part.needs_manual_grade) or not has_score(part)


def harmless(text: str) -> str:
    """Return `text` for a cell, changed so that no spreadsheet takes it for a formula or for several cells.

    Not for ids by which an import finds students.  A semicolon is replaced, because some locales separate cells by it.
    """
    text = "".join(" " if char == ";" or unicodedata.category(char) == "Cc" else char for char in text)
    return f"'{text}" if unicodedata.normalize("NFKC", text).lstrip()[:1] in ("=", "+", "-", "@") else text


def number(value: float) -> str:
    """Return a number with at most two decimals and no thousands separator, as Canvas and Moodle show points."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _chosen(things: Iterable[Thing], name: Callable[[Thing], str], names: list[object], what: str) -> list[Thing]:
    """Return the things with these names, or all, sorted by name; raises CannotExport when the gradebook lacks one."""
    by_name = {name(thing): thing for thing in things}
    wanted = {str(given) for given in names} or set(by_name)
    if missing := wanted - set(by_name):
        raise CannotExport(f"the gradebook has no {what} {min(missing)!r}")
    return [by_name[given] for given in sorted(wanted)]
