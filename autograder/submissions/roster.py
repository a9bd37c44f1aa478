"""The roster of a class: CSV files with the names of each student.

It is given once; `SUBMITTED/.roster.csv` keeps it for later commands.
"""

import csv
import io
import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from autograder.errors import Unplaced, UsageError
from course.foundation import storage

REMEMBERED = ".roster.csv"  # in the folder of the submissions
STUDENT = "student"  # the column that names the folder
ROLE, INSTRUCTOR = "role", "instructor"  # a column of the class's server, and who in it hands in nothing
LONGEST = 120  # bytes of a name from a file: what is made of it, as NAME-EXERCISE.html, is called in 255 at most
ID = re.compile(r"[\w.@+-]+(?: [\w.@+-]+)*")


@dataclass
class Roster:
    """The students of a class: for each the name of their folder, and their other names."""

    students: set[str] = field(default_factory=set)
    about: dict[str, dict[str, str]] = field(default_factory=dict)  # further columns, by student
    _called: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))

    def find(self, names: tuple[str, ...], of_platform: bool = False) -> str:
        """Return the student with the first of `names` that is in the roster; raises Unplaced.

        The error's message briefly says why.  The name of a student's folder comes before what other students are
        called, except among names `of_platform`: a student may have chosen that of another one's folder there.
        """
        for name in names:
            found = self._called.get(_plain(name), set())
            if len(found) > 1 and not of_platform:
                found = {each for each in found if _plain(each) == _plain(name)} or found
                found = {name} if name in found else found
            if len(found) > 1:
                raise Unplaced(f"{name!r} could be {' or '.join(sorted(found))} in the roster")
            if found:
                return next(iter(found))
        raise Unplaced(f"{' or '.join(map(repr, names))} is not in the roster")

    def has(self, name: str) -> bool:
        """Return True if a student has this name."""
        return bool(self._called.get(_plain(name)))

    def value(self, student: str, column: str) -> str:
        """Return the value in a column of a student's line; '' if it is empty."""
        return student if column == STUDENT else self.about.get(student, {}).get(column, "")

    def columns(self, student: str, value: str) -> set[str]:
        """Return the columns of a student's line that hold `value`."""
        return {column for column in (STUDENT, *self.about.get(student, {})) if self.value(student, column) == value}

    def other_number(self, student: str, number: str, columns: Iterable[str]) -> tuple[str, str] | None:
        """Return the student's own number and its column if `number` is another person's; None if it may be theirs.

        `columns` are those that hold the numbers of one platform.  Where a student has one, it decides, not the name.
        """
        own = {self.value(student, column): column for column in sorted(columns)}
        own.pop("", None)
        return next(iter(own.items())) if own and number not in own else None

    def has_column(self, column: str) -> bool:
        """Return True if a student has a value in this column."""
        return any(column in about for about in self.about.values())

    def has_numbers(self, column: str) -> bool:
        """Return True if this column has values, all of them digits."""
        values = [about[column] for about in self.about.values() if column in about]
        return bool(values) and all(value.isdecimal() for value in values)

    def add(self, student: str, names: list[str]) -> None:
        """Add a student with their other names."""
        self.students.add(student)
        for name in (student, *names):
            if _plain(name):
                self._called[_plain(name)].add(student)


def read_rosters(paths: Iterable[Path]) -> Roster:
    """Read the roster from CSV files with a header: `student` names the folder, other columns are further names.

    The columns `first_name` and `last_name` together also give the full name in both orders.  A student may be in
    several files, if these do not contradict each other.  Raises UsageError.
    """
    roster = Roster()
    known: dict[str, tuple[Path, dict[str, str]]] = {}
    for path in paths:
        for student, columns in _lines(path):
            before, said = known.get(student, (path, {}))
            for column in said.keys() & columns.keys():
                if _plain(said[column]) != _plain(columns[column]):
                    raise UsageError(
                        f"{student!r} is in {before} and in {path} with another {column}, {said[column]!r} and "
                        f"{columns[column]!r}: give them different names if they are two students"
                    )
            known[student] = (path, said | columns)
            if columns.pop(ROLE, "").lower() == INSTRUCTOR:
                continue
            roster.about[student] = said | columns
            first, last = columns.get("first_name", ""), columns.get("last_name", "")
            roster.add(
                student, [*columns.values(), *([f"{first} {last}", f"{last} {first}"] if first and last else [])]
            )
    return roster


def of_class(submitted: Path, given: Iterable[Path] | None) -> Roster | None:
    """Return the roster in the files `given`, and remember it beside the submissions; or else the one remembered.

    None when there is neither.  Raises UsageError.
    """
    kept = submitted / REMEMBERED
    if not given:
        if kept.exists() and not kept.is_file():  # a pipe would be waited for
            raise UsageError(f"{kept} is not an ordinary file: remove it, and give the roster again with --roster")
        return read_rosters([kept]) if kept.exists() else None
    roster = read_rosters(given)
    columns = [STUDENT, *dict.fromkeys(column for about in roster.about.values() for column in about)]
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, restval="")
    writer.writeheader()
    writer.writerows({STUDENT: student, **about} for student, about in sorted(roster.about.items()))
    submitted.mkdir(parents=True, exist_ok=True)
    storage.replace(kept, text.getvalue().encode(), storage.PRIVATE)
    return roster


def _lines(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield each student of a roster with the other values of the line; raises UsageError."""
    seen = set()
    for number, line in table(path):
        student = (line.get(STUDENT) or "").strip()
        if not ID.fullmatch(student) or student.startswith((".", "-")):
            raise UsageError(f"{path}, line {number}: {student!r} cannot be the name of a folder")
        if student in seen:
            raise UsageError(f"{path}, line {number}: {student!r} is listed twice")
        seen.add(student)
        yield (
            student,
            {
                key: value.strip()
                for key, value in line.items()
                if key and key != STUDENT and isinstance(value, str) and value.strip()
            },
        )


def table(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield each line of a roster with its number; raises UsageError unless it is a table with the column `student`."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            if STUDENT not in (reader.fieldnames or ()):
                raise UsageError(f"{path} has no column 'student' in its first line")
            for line in reader:
                yield reader.line_num, line
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path} is not a CSV file in UTF-8: {error}") from None


def folder_name(name: str) -> str:
    """Return a name as that of a folder: its letters, digits and `._-`, never hidden, at most LONGEST bytes.

    '' if nothing is left of it, or if a command would take it for an option.
    """
    plain = re.sub(r"[^\w.@+-]+", "_", unicodedata.normalize("NFC", name)).strip("._")
    if plain.startswith("-"):
        return ""
    return plain.encode()[:LONGEST].decode(errors="ignore")


def _plain(name: str) -> str:
    """Return a name as it is compared: letters and digits, without accents and case, as in Canvas's file names."""
    letters = unicodedata.normalize("NFKD", name.casefold())
    return "".join(letter for letter in letters if letter.isalnum())
