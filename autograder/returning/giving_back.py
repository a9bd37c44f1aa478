"""Makes the pages to return to the students from a grading's output folder."""

import hashlib
import io
import itertools
import json
import os
import zipfile
from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from nbgrader.api import Gradebook, MissingEntry
from traitlets.config import Config

from autograder.errors import Unplaced, UsageError
from autograder.gradebook import late
from autograder.gradebook.book import by_hand, existing_url
from autograder.platforms import FILES, instruction
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import feedback, output
from autograder.results.text import counted
from autograder.returning import ways
from autograder.submissions import provenance
from course.foundation import storage
from course.foundation.untrusted import one_line
from course.returned.record import Mark

FOLDER = "returned"  # in the output folder
RETURNED = "returned.json"  # in that folder: a record of the last return
LOCK = ".returning"  # in that folder, while a return goes on
UNMARKED = (
    "LOOK: no gradebook was found, so the pages have no marks by hand and no late penalties. If there is one, name it: "
    "--gradebook URL"
)


@dataclass
class Returned:
    """The pages that were made, and those that were not."""

    made: dict[Path, int] = field(default_factory=dict)  # pages, by archive or folder
    forms: dict[Path, str] = field(default_factory=dict)  # a platform's form, or FILES
    left_out: list[str] = field(default_factory=list)  # one line each
    waiting: list[str] = field(default_factory=list)  # returned although a cell is still to be marked by hand
    nothing: list[str] = field(default_factory=list)  # students of the roster without a submission
    ungraded: list[str] = field(default_factory=list)  # what is not in the results: a student, or STUDENT/ASSIGNMENT
    unchanged: int = 0  # pages whose content is the same as at the last return
    changed: list[str] | None = None  # those returned now, if only changed pages were asked for
    unmarked: bool = False  # without the marks by hand: no gradebook was found


class Marks:
    """The manual marks from a gradebook; none without a gradebook."""

    def __init__(self, url: str | None, submitted: Path):
        """Load the course's configuration, for late penalties; raises UsageError when that fails."""
        self.url = url
        self._config: Config | None = late.course_config(submitted) if url else None

    def of(self, report: Report) -> list[Mark]:
        """Return the marks of a submission, and its late penalty with these marks."""
        name, student = report.assignment, report.student
        if self.url is None:
            return []
        try:
            if self._config is not None:
                with Gradebook(self.url) as book:
                    concerned = late.concerned(book.find_submission(name, student))
                if concerned:
                    late.assign(self._config, self.url, name, name, student)
            return by_hand(self.url, name, student)
        except MissingEntry:  # graded without the gradebook
            return []


def give_back(
    out: Path,
    into: Path,
    form: str | None = None,
    assignment: str | None = None,
    students: Collection[str] = (),
    gradebook: str | None = None,
    roster: Iterable[str] = (),
    changed: bool = False,
) -> Returned:
    """Write the pages of the results in `out` to the folder `into`, as archives for the platforms that they came from.

    `form` is a platform's form or FILES, for all pages.  `gradebook` is "" for none, and by default the one that `out`
    was graded into.  With `changed`, only pages that differ from the last return are made.  Raises UsageError when
    there is nothing to return, and while another return of these results goes on.
    """
    results = output.read_results(out)
    reports = {
        key: report
        for key, report in results.items()
        if assignment in (None, key[1]) and (not students or key[0] in students)
    }
    if not reports:
        raise UsageError(f"no results in {out}{' of that student and assignment' if assignment or students else ''}")
    busy = f"another `autograder return` is running in {out}: wait until it has finished"
    with os.fdopen(output.lock(out / LOCK, busy)):
        bases = output.bases(out, lost=form == FILES)
        places = {key: Path(bases[key].submitted) for key in reports if key in bases}
        marks = {place: Marks(_url(gradebook, place, out), place) for place in set(places.values())}
        before = _returned(out)
        now: dict[str, str] = {}
        without = sorted(
            {each for each in roster if not students or each in students} - {student for student, _ in reports}
        )
        names = {assignment for _, assignment in reports}
        expected = list(itertools.product(without, names))
        found = {key for place in marks for key in output.ungraded(out, place, results, expected)}
        left = [key for key in sorted(found) if assignment in (None, key[1]) and (not students or key[0] in students)]
        nothing = [each for each in without if each not in {student for student, _ in left}]
        several = len({*names, *(name for _, name in left)}) > 1
        ungraded = ["/".join(key) if several else key[0] for key in left]
        unmarked = gradebook is None and any(each.url is None for each in marks.values())
        result = Returned(changed=[] if changed else None, nothing=nothing, ungraded=ungraded, unmarked=unmarked)
        pages: dict[tuple[str, str], list[tuple[str, str, bytes]]] = defaultdict(list)
        for key, report in sorted(reports.items()):
            who = "/".join(key)
            try:
                if report.status == INFRASTRUCTURE_ERROR:
                    raise Unplaced("the grader failed, and there is no score yet: `autograder grade --resume`")
                if key not in places:
                    raise Unplaced("the graded folder is unknown: grade it again")
                way = ways.way(*key, provenance.read(places[key], *key), form)
                gone = not places[key].joinpath(*key).exists()
                if bases[key].is_replaced(key) or (gone and way.form != FILES):
                    raise Unplaced("other files were handed in since: `autograder regrade` grades them")
            except Unplaced as error:
                result.left_out.append(f"{who}: {error.args[0]}")
                continue
            by_hand = marks[places[key]].of(report)
            said = feedback.feedback(report, by_hand).to_text().encode(errors="replace")
            now[who] = hashlib.sha256(said).hexdigest()
            if changed and before.get(who) == now[who]:
                result.unchanged += 1
                continue
            if any(mark.waiting for mark in by_hand):
                result.waiting.append(who)
            page = feedback.page(report, by_hand).encode(errors="replace")
            pages[way.form, "" if way.form == FILES else key[1]].append((who, way.name, page))
        made = _write(pages, into, result)
        if changed:
            result.changed = sorted(made)
        known = before | {who: digest for who, digest in now.items() if who in made}
        storage.replace(out / RETURNED, json.dumps(known, indent=1).encode(), storage.PRIVATE)
        return result


def _returned(out: Path) -> dict[str, str]:
    """Return the digests of the pages as last returned, by STUDENT/ASSIGNMENT."""
    try:
        known = json.loads((out / RETURNED).read_bytes())
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def place_for_changed(out: Path) -> Path:
    """Return a new folder for the pages that have changed since the last return."""
    number = next(number for number in itertools.count(1) if not (out / FOLDER / f"changed-{number}").exists())
    return out / FOLDER / f"changed-{number}"


def describe(result: Returned) -> str:
    """Return the result as lines for the instructor."""
    lines = [UNMARKED] * result.unmarked
    for path, count in result.made.items():
        lines.append(f"{path}: {counted(count, 'page')}; {instruction(result.forms[path])}")
    for title, names in (
        ("Returned, but waiting for a mark by hand (the page says so):", result.waiting),
        ("Not returned:", result.left_out),
        ("Without a page, because there is no submission:", result.nothing),
        ("Without a page, because the submission is not graded yet:", result.ungraded),
    ):
        lines += [title] * bool(names)
        lines += [f"  {one_line(name)}" for name in names]
    if result.changed is not None:
        lines += [f"Changed since the last return: {one_line(', '.join(result.changed)) or 'nothing'}"]
        lines += [f"{counted(result.unchanged, 'page')} skipped: unchanged since the last return."] * bool(
            result.unchanged
        )
    made, left = sum(result.made.values()), len(result.left_out) + len(result.ungraded)
    return "\n".join([*lines, f"{counted(made, 'page')} returned; {left} not."])


def _url(gradebook: str | None, submitted: Path, out: Path) -> str | None:
    """Return the URL of the gradebook to read; None if there is none."""
    if gradebook == "":
        return None
    try:
        return existing_url(gradebook, submitted, out)
    except UsageError:
        if gradebook:
            raise
        if not submitted.is_dir():
            raise UsageError(
                f"the submissions of {out} are no longer in {submitted}, so the gradebook is unknown: name it "
                "(--gradebook URL), or leave out marks by hand and late penalties (--no-gradebook)"
            ) from None
        return None


def _write(pages: dict[tuple[str, str], list[tuple[str, str, bytes]]], into: Path, result: Returned) -> set[str]:
    """Write archives and pages, each whole or not at all; return their submissions.

    If two submissions would get the same name, neither is written.
    """
    made: set[str] = set()
    if not pages:
        return made
    into.mkdir(storage.PRIVATE_FOLDER, parents=True, exist_ok=True)
    for (form, assignment), found in sorted(pages.items()):
        called: dict[str, list[str]] = defaultdict(list)
        for who, name, _ in found:
            called[name.casefold()].append(who)  # on a case-insensitive disk one page would replace the other
        result.left_out += [
            f"{who}: {' and '.join(called[name.casefold()])} would both be called {name}"
            for who, name, _ in found
            if len(called[name.casefold()]) > 1
        ]
        single = [(name, page) for _, name, page in found if len(called[name.casefold()]) == 1]
        if not single:
            continue
        if form == FILES:
            target = into
            for name, page in single:
                storage.replace(into / name, page, storage.PRIVATE)
        else:
            target = into / f"{assignment}-{form}.zip"
            storage.replace(target, _archive(single), storage.PRIVATE)
        result.made[target], result.forms[target] = len(single), form
        made |= {who for who, name, _ in found if len(called[name.casefold()]) == 1}
    return made


def _archive(pages: list[tuple[str, bytes]]) -> bytes:
    buffer, now = io.BytesIO(), datetime.now().timetuple()[:6]
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, page in pages:
            archive.writestr(zipfile.ZipInfo(name, now), page, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()
