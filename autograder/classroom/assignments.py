"""The exercises of a class over a term: each is a draft until it is released, later due, and perhaps over.

`up` releases nothing.  The dates are in `state/assignments.json`.  An exercise counts as released when it is in
nbgrader's exchange, even if an instructor put it there by hand.
"""

import contextlib
import json
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from autograder.classroom import accounts, course_files
from autograder.classroom.plan import COURSE_ID, Classroom
from autograder.errors import UsageError
from autograder.gradebook.release import names as exercises
from autograder.submissions.times import parse_time
from course.foundation import storage
from course.foundation.times import MINUTES
from course.hand_in import UNTIL
from course.notebook.progress import in_order

DATES = "assignments.json"
OWN = "dates"  # in the exchange, beside nbgrader's own: for each student a file with the dates that are told to them
DRAFT, DATED, OPEN, DUE, OVER = "draft", "dated", "released", "past the due date", "over"
LAST = datetime.max.replace(tzinfo=UTC)


@dataclass(frozen=True)
class Dates:
    """The times at which an exercise is released, due and over, in ISO 8601 (UTC); "" for a time that is not set."""

    release: str = ""
    due: str = ""
    until: str = ""


@dataclass(frozen=True)
class Row:
    """The state of an exercise."""

    name: str
    state: str  # DRAFT, DATED, OPEN, DUE or OVER
    dates: Dates
    # How many students have done so before their end, or have been returned their page by the exchange:
    handed_in: int
    graded: int
    returned: int


def read(classroom: Classroom) -> dict[str, Dates]:
    """Return the dates that are set, by exercise."""
    path = classroom.state / DATES
    return {name: Dates(**dates) for name, dates in json.loads(path.read_text()).items()} if path.exists() else {}


def change(
    classroom: Classroom,
    names: Iterable[str],
    release: Mapping[str, datetime] | None = None,
    due: datetime | None = None,
    until: datetime | str | None = None,
) -> dict[str, Dates]:
    """Set the dates that are given, and return all dates of the named exercises.

    `release` has a date for each exercise that is not released yet; `ends.NONE` removes an end.  Raises UsageError, and
    changes nothing, when the dates of an exercise are not in order.
    """
    known = read(classroom)
    changed = {}
    for name in names:
        new = {"release": (release or {}).get(name), "due": due, "until": until}
        given = {key: time.isoformat() if isinstance(time, datetime) else "" for key, time in new.items() if time}
        dates = replace(known.get(name, Dates()), **given)
        steps = {"release": dates.release, "due date": dates.due, "end": dates.until}
        for (first, then), (second, later) in pairwise((step, time) for step, time in steps.items() if time):
            if datetime.fromisoformat(later) < datetime.fromisoformat(then):
                raise UsageError(f"{name}: the {second}, {said(later)}, would come before the {first}, {said(then)}")
        changed[name] = dates
    text = json.dumps({name: asdict(dates) for name, dates in (known | changed).items()}, indent=1)
    storage.replace(classroom.state / DATES, text.encode(), storage.PRIVATE)
    return changed


def to_release(classroom: Classroom, now: datetime) -> list[str]:
    """Return the exercises that should be released by now and are not."""
    there = course_files.released(classroom)
    return [
        name
        for name, dates in read(classroom).items()
        if dates.release and datetime.fromisoformat(dates.release) <= now and name not in there
    ]


def table(classroom: Classroom, now: datetime) -> list[Row]:
    """Return the state of each exercise."""
    there, dates, handed_in = course_files.released(classroom), read(classroom), _handed_in(classroom)
    graded, returned = course_files.judged(classroom)
    rows = []
    for name in in_order(sorted({*exercises(), *there})):
        own = dates.get(name, Dates())
        counts = (len(found.get(name, ())) for found in (handed_in, graded, returned))
        rows.append(Row(name, _state(own, name in there, now), own, *counts))
    return rows


def said(time: str) -> str:
    """Return a date as people read it; "" for none."""
    return f"{datetime.fromisoformat(time):{MINUTES} UTC}" if time else ""


def shown(row: Row) -> str:
    """Return a row as a line of text."""
    release = "will be released on" if row.state == DATED else "released on"
    dates = {release: row.dates.release, "due": row.dates.due, "until": row.dates.until}
    parts = [f"{what} {said(time)}" for what, time in dates.items() if time]
    if row.state not in (DRAFT, DATED):
        parts += [f"{row.handed_in} handed in, {row.graded} graded, {row.returned} returned"]
    return f"  {row.name:<20} {row.state:<18} {', '.join(parts)}".rstrip()


def _state(dates: Dates, there: bool, now: datetime) -> str:
    if not there:
        return DATED if dates.release else DRAFT
    for time, state in ((dates.until, OVER), (dates.due, DUE)):
        if time and datetime.fromisoformat(time) < now:
            return state
    return OPEN


def _handed_in(classroom: Classroom) -> dict[str, set[str]]:
    """Return the students who handed in each exercise in time: the owners of the hand-ins, whatever their names say."""
    found: dict[str, set[str]] = {}
    users = {accounts.ids(classroom, member)[0]: member.name for member in classroom.students}
    ends = {name: _ends(classroom, name) for name in users.values()}
    for entry in each_entry(classroom.exchange / COURSE_ID / "inbound"):
        _, exercise, time, *_ = [*entry.name.split("+"), "", "", ""]
        try:
            status = entry.stat(follow_symlinks=False)
        except OSError:  # its owner has just moved it
            continue
        student = users.get(status.st_uid)
        if student and stat.S_ISDIR(status.st_mode) and _came_at(time, status) <= ends[student].get(exercise, LAST):
            found.setdefault(exercise, set()).add(student)
    return found


def each_entry(folder: Path) -> Iterator[os.DirEntry[str]]:
    """Go through a folder that students write to, and hold one entry at a time; nothing if it is not there."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        yield from entries


def _came_at(time: str, status: os.stat_result) -> datetime:
    """Return when something was handed in, as collecting does: what its name says, or else its last change."""
    try:
        return parse_time(time)
    except UsageError:
        return datetime.fromtimestamp(status.st_ctime, UTC)


def _ends(classroom: Classroom, student: str) -> dict[str, datetime]:
    """Return when each exercise is over for a student, with their extension, as they are told; {} before they are."""
    try:
        told = json.loads((classroom.exchange / COURSE_ID / OWN / f"{student}.json").read_text())
    except FileNotFoundError:
        return {}
    return {name: datetime.fromisoformat(each[UNTIL]) for name, each in told.items() if each.get(UNTIL)}
