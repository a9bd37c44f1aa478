"""`autograder collect`: finds hand-ins, and lays them out as `STUDENT/ASSIGNMENT/FILES`.

Nothing is lost: of several hand-ins the newest on time is laid out, and the others are kept in `.others` beside the
students' folders, where the grader does not look.  Files that cannot be placed are named, and stay where they are.
"""

import contextlib
import hashlib
import itertools
import os
import re
import shutil
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from autograder.collecting.bundles import bundles, check, files_of
from autograder.collecting.identify import TIME, VERIFIED, HandedIn, compared, identify
from autograder.errors import Unplaced, UsageError
from autograder.platforms import users_are_global
from autograder.results.output import lock
from autograder.results.text import counted
from autograder.submissions import exercises, listing, provenance, reading
from autograder.submissions.provenance import KNOWN, ON_TIME, Source
from autograder.submissions.roster import Roster
from course.foundation import storage
from course.foundation.untrusted import one_line

OTHERS = ".others"  # hand-ins that do not count
Found = dict[tuple[str, str], list[HandedIn]]  # by student and exercise
Before = Mapping[tuple[str, str], list[Source]]  # recorded origins of earlier hand-ins, by student and exercise

INSTEAD = "it did not come from a platform, but replaces a hand-in from {}: check whose it is"
MOST_UNNAMED = 300  # students of one archive in which no platform has named anybody, without a roster
NAME_EACH = "name each in a roster (--roster)"
EAST_ASIAN = {"CJK", "HIRAGANA", "KATAKANA", "HANGUL", "BOPOMOFO"}  # scripts that one name may have
# Letters, digits and signs that are seen as small Latin letters; the last ones are hardly seen at all.
SEEN_AS = str.maketrans(
    "\u0430\u0441\u0435\u043e\u0440\u0445\u0443\u0456\u0458\u0455\u0501\u04bb\u051b\u051d\u03b1\u03bf\u03c1\u03bd\u03c5\u03b9\u03ba\u01311|0"
    "\u0269\u01c0\ua4f2\u1d0f\u3007",
    "aceopxyijsdhqwaopvuikillollloo",
    "\u115f\u1160\u02b9\u02bb\u02bc",
)
SEEN_AS_ONE = {"rn": "m", "vv": "w"}
SAME_SECOND = re.compile(r"\d{8}T\d{6}Z-(\d{1,2})\.zip$")  # `course hand-in` numbers those of one second


@dataclass
class Collection:
    """The result of collecting."""

    laid_out: list[HandedIn]
    kept: list[HandedIn]  # in `.others`
    unplaced: list[str]  # one line each
    missing: dict[str, list[str]] = field(default_factory=dict)  # students of the roster, by exercise
    looks: list[str] = field(default_factory=list)  # what to look at of a whole archive, one line each


@contextlib.contextmanager
def alone(sources: Sequence[Path], into: Path) -> Iterator[None]:
    """Make the folder `into`, and keep other collections out of it meanwhile.

    Notes in it if the folder around it is among the sources: whatever is there may be a student's.
    Raises UsageError when one is writing to it, when it cannot be written, or, before anything is made, for a source
    that does not exist.
    """
    for source in sources:
        check(source)
    try:
        (into / provenance.ORIGINS).mkdir(parents=True, exist_ok=True)
        held = lock(into / provenance.ORIGINS / ".lock", f"another `autograder collect` is writing to {into}")
    except OSError as error:
        raise UsageError(f"cannot write to {into}: {error.strerror}") from None
    try:
        around = into.resolve().parent
        if any(source.resolve() in (around, *around.parents) for source in sources):
            provenance.among_hand_ins(into).touch()
        for beside in ("*", f"{OTHERS}/*/*"):  # what a collection has left that was killed
            for draft in into.glob(f"{beside}/{storage.DRAFT}*"):
                shutil.rmtree(draft, ignore_errors=True)
        yield
    finally:
        os.close(held)


def collect(
    sources: Iterable[Path],
    into: Path,
    roster: Roster | None = None,
    due: datetime | None = None,
    assignment: str | None = None,
    end: Callable[[str, str], datetime | None] = lambda student, exercise: None,
) -> Collection:
    """Lay out the hand-ins in `sources`: archives, folders of them, and bulk downloads of Canvas and Moodle.

    With a `roster`, hand-ins of people who are not in it, or who could be mistaken for somebody else, are not laid out.
    Of several hand-ins the newest until `due` counts, or the newest of all if none was on time.  Raises UsageError for
    a source that does not exist.

    With `assignment`, a hand-in of another exercise is not laid out; neither is one whose known time is after the `end`
    of the exercise for its student.  Every file in a source is laid out, kept, or has a line in the result.
    """
    expected = exercises.load(assignment).name if assignment else None
    unplaced: list[str] = []
    found: Found = defaultdict(list)
    unnamed: dict[tuple[Path, str], list[HandedIn]] = defaultdict(list)  # by the archive that they were in together
    for source in sources:
        for bundle in bundles(source, unplaced, without=into):
            try:
                handed_in = identify(bundle, roster, expected, due)
            except Unplaced as error:
                unplaced.append(f"{bundle.source}: {error.args[0]}")
            else:
                over = end(handed_in.student, handed_in.assignment)
                if over and handed_in.came.time == KNOWN and handed_in.at > over:
                    unplaced.append(
                        f"{bundle.source}: it was handed in at {handed_in.when}, after the end at {over:{TIME}}"
                    )
                else:
                    found[handed_in.student, handed_in.assignment].append(handed_in)
                    if bundle.unnamed:
                        unnamed[source, bundle.download].append(handed_in)
    into.mkdir(parents=True, exist_ok=True)
    looks = _of_no_student(into, roster) if roster else _compare_students(unnamed.values(), found, unplaced)
    before = {key: provenance.read(into, *key) for key in found}
    if not roster:
        _compare_receipts(found)
    else:
        unplaced += _take_out_namesakes(found, before, roster) + _take_out_unvouched(found, before, roster)
    unplaced += _take_out_other_numbers(found, before, roster)
    result = Collection([], [], unplaced, looks=looks)
    _compare(each for those in found.values() for each in those)
    for key in sorted(key for key, those in found.items() if those):
        unplaced += _take_out_other_spellings(found[key], before[key]) if not roster else []
        if not found[key]:
            continue
        if why := _several_people(found[key], before[key], roster):
            unplaced += [f"{each.source}: {why}" for each in found[key]]
            continue
        uploads = all(each.came.upload for each in found[key])
        best, *others = sorted(found[key], key=lambda each: _rank(each, due, uploads), reverse=True)
        former = [each.came.platform for each in others if each.came.platform and each.files != best.files]
        if former and not best.came.platform:
            best.notes.append(INSTEAD.format(former[0]))
        if _place(best, into, due, roster):
            result.laid_out.append(best)
        else:
            others.insert(0, best)
        for other in others:
            _keep(other, into)
            result.kept.append(other)
    if not roster:
        _note_lookalikes(result.laid_out, into)
    names = {expected} if expected else {name for _, name in found}
    students = sorted(roster.students) if roster else []
    for name in sorted(names):
        if absent := [student for student in students if not os.path.lexists(into / student / name)]:
            result.missing[name] = absent
    return result


def _note_lookalikes(laid_out: Iterable[HandedIn], into: Path) -> None:
    """Note on each hand-in if its student's name could be taken for another one: anybody can choose such a name."""

    def seen(name: str) -> str:
        folded = unicodedata.normalize("NFKD", name.replace("I", "l")).casefold()  # a capital i is seen as an l
        bare = "".join(letter for letter in folded if not unicodedata.combining(letter))
        bare = bare.translate(SEEN_AS)
        for two, one in SEEN_AS_ONE.items():
            bare = bare.replace(two, one)
        return bare

    alike: dict[str, list[str]] = defaultdict(list)
    for name in sorted(entry.name for entry in into.iterdir() if not entry.name.startswith(".")):
        alike[seen(name)].append(name)
    for each in laid_out:
        if others := [name for name in alike[seen(each.student)] if name != each.student]:
            each.notes.append(f"its student's name looks like that of {' and '.join(others)}: check whose it is")
        letters = filter(str.isalpha, unicodedata.normalize("NFKC", each.student))
        scripts = {unicodedata.name(letter, "").partition(" ")[0] for letter in letters} - {"MODIFIER"}
        if len(scripts) > 1 and not scripts <= EAST_ASIAN:
            found = " and ".join(sorted(script.capitalize() for script in scripts))
            each.notes.append(f"its student's name mixes {found} letters, which may look alike: check whose it is")


def _of_no_student(into: Path, roster: Roster) -> list[str]:
    """Return a line on folders that were collected earlier, perhaps without a roster, and are of no student in it."""
    names = [name for name in listing.folders(into) if name not in roster.students]
    line = (
        f"collected earlier, but not in the roster: {', '.join(names)}. These folders are graded, too: move away each "
        "one that belongs to a student of the roster under another name"
    )
    return [line] if names else []


def _compare_receipts(found: Found) -> None:
    """Compare the name in each receipt with those of the other students in its download, as with a roster."""
    there: dict[str, Roster] = defaultdict(Roster)
    for each in itertools.chain.from_iterable(found.values()):
        if each.came.platform:
            there[each.download].add(each.student, [each.came.name, each.came.user])
    for key, those in found.items():
        found[key] = [compared(each, there[each.download]) if each.came.platform else each for each in those]


def _compare_students(together: Iterable[list[HandedIn]], found: Found, unplaced: list[str]) -> list[str]:
    """Return a line on each archive that has hand-ins of several students, all of whom one person may have invented.

    Those in an archive of too many students are removed, and the archive has a line in `unplaced` instead.
    """
    lines = []
    for those in together:
        count = len({each.student for each in those})
        said = f"hand-ins of {count:,} students, and no platform has named them"
        if count > MOST_UNNAMED:
            unplaced.append(
                f"{those[0].download}: nothing from it was collected, because it has {said}. Give a roster (--roster), "
                "or, if you have packed it yourself, unpack it"
            )
            these = set(map(id, those))
            for key in {(each.student, each.assignment) for each in those}:
                found[key] = [each for each in found[key] if id(each) not in these]
        elif count > 1:
            lines.append(f"{those[0].download} has {said}: did one person send it?")
    return lines


def _compare(found: Iterable[HandedIn]) -> None:
    """Note on each hand-in if most of its download is of another exercise: it may be in the wrong place."""
    downloads: dict[str, list[HandedIn]] = defaultdict(list)
    for each in found:
        if each.came.platform:
            downloads[each.download].append(each)
    for those in downloads.values():
        (usual, count), *_ = Counter(each.assignment for each in those).most_common(1)
        for each in those if 2 * count > len(those) else ():
            if each.assignment != usual:
                each.notes.append(
                    f"it is a hand-in of {each.assignment}, and most hand-ins in {each.download} are of {usual}"
                )


def _rank(handed_in: HandedIn, due: datetime | None, uploads: bool) -> tuple[bool, int, datetime, int, int]:
    """Return the sort key of a hand-in; if all are uploads to a platform, their numbers count more than times."""
    again = SAME_SECOND.search(handed_in.source)
    on_time, at = _weight(handed_in.at, handed_in.came, due)
    upload = handed_in.came.upload
    return on_time, upload if uploads else 0, at, upload, int(again[1]) if again else 1


def _spelled(came: Source) -> str:
    """Return the name in the receipt of a hand-in that came from no platform."""
    return unicodedata.normalize("NFC", came.name).strip()


def _take_out_other_spellings(found: list[HandedIn], before: list[Source]) -> list[str]:
    """Remove the hand-ins of names that only have the same folder as one that is spelled like it; return their lines.

    Of `ada` and `ada.`, whose folder is `ada`, the first one keeps it.
    """
    folder = found[0].student
    if folder not in {_spelled(came) for came in [*(each.came for each in found), *before] if not came.platform}:
        return []
    lines = []
    for each in [each for each in found if not each.came.platform and _spelled(each.came) != folder]:
        name = _spelled(each.came)[:60]
        lines.append(f"{each.source}: hand-ins of {name!a} have the same folder as those of {folder}: {NAME_EACH}")
        found.remove(each)
    return lines


def _several_people(found: list[HandedIn], before: list[Source], roster: Roster | None) -> str:
    """Return why hand-ins under one name seem to be from several people; '' if they do not.

    A platform's user number identifies a person: Canvas's everywhere, Moodle's within one download of an assignment.
    Without a platform and a roster, a person is whom the receipt names, of which the folder's name leaves some out; the
    one whose name is that of the folder keeps it.
    """
    every = [*(each.came for each in found), *before]
    names = {_spelled(came) for came in every if not came.platform}
    if len(names) > 1 and not roster and found[0].student not in names:
        who = " and ".join(f"{name[:60]!a}" for name in sorted(names))
        return f"hand-ins of {who} have the same folder, {found[0].student}: {NAME_EACH}"
    numbers: dict[tuple[str, str], set[str]] = defaultdict(set)
    everywhere = [("", each) for each in before]
    for download, came in [*((each.download, each.came) for each in found), *everywhere]:
        if came.platform and not (roster and roster.has(came.user)):
            numbers[came.platform, "" if users_are_global(came.platform) else download].add(came.user)
    for (platform, download), users in numbers.items():
        if len(users) > 1 and (download or users_are_global(platform)):
            who = " and ".join(sorted(users))
            name = found[0].came.name
            return f"{platform} has several students called {name!r}, {who}: name each in the roster, with the number"
    return ""


def _take_out_namesakes(found: Found, before: Before, roster: Roster) -> list[str]:
    """Remove each hand-in with a student's name and a platform's number that is not theirs; return a line for each.

    A column of the roster is taken to hold a platform's numbers if a number of a hand-in is in it.  A hand-in with
    another number is from another person, whatever its name.
    """
    columns: dict[tuple[str, str], set[str]] = defaultdict(set)
    for key, those in found.items():
        known = [came for came in before[key] if users_are_global(came.platform)]
        for scope, came in [*((_scope(each), each.came) for each in those), *(((c.platform, ""), c) for c in known)]:
            columns[scope] |= roster.columns(key[0], came.user) if came.platform else set()
    lines = []
    for those in found.values():
        for each in [each for each in those if each.came.platform]:
            came = each.came
            if own := roster.other_number(each.student, came.user, columns[_scope(each)]):
                number, column = own
                lines.append(
                    f"{each.source}: {came.platform} calls {came.user} {came.name!r}, and {each.student} has the "
                    f"number {number} in the roster (column {column!r}): it is not theirs, or the roster is wrong"
                )
                those.remove(each)
    return lines


def _vouched(student: str, came: Source, roster: Roster | None) -> bool:
    """Return True if the platform's number of a hand-in is in its student's line of the roster."""
    return bool(roster and came.platform and roster.columns(student, came.user))


def _take_out_unvouched(found: Found, before: Before, roster: Roster) -> list[str]:
    """Remove a student's hand-ins whose number is not in the roster, if they also have one whose number is."""
    lines = []
    for key, those in found.items():
        every = [*(each.came for each in those), *before[key]]
        own = {came.platform: came.user for came in every if _vouched(key[0], came, roster)}
        for each in [each for each in those if each.came.platform in own]:
            if not _vouched(key[0], each.came, roster):
                lines.append(
                    f"{each.source}: {each.came.platform} has {each.came.name!r} with the number {each.came.user}, and "
                    f"with {own[each.came.platform]}, as the roster says: it is not theirs, or the roster is wrong"
                )
                those.remove(each)
    return lines


def _take_out_other_numbers(found: Found, before: Before, roster: Roster | None) -> list[str]:
    """Remove a student's hand-ins whose number differs between downloads; return a line for each.

    Moodle numbers students differently in each assignment.  In two downloads of one assignment most students keep their
    number, and one with a different number is another person; if nobody keeps their number, the downloads are of two
    assignments, which is noted on each hand-in.  A number in the roster belongs to that student alone.
    """
    numbers: dict[tuple[str, str, str], dict[str, str]] = defaultdict(dict)  # by student, per exercise and download
    for (student, exercise), those in found.items():
        local = [each for each in those if each.came.platform and not users_are_global(each.came.platform)]
        for each in local:
            if not (roster and roster.has(each.came.user)):
                numbers[each.came.platform, exercise, each.download][student] = each.came.user
        for platform in {each.came.platform for each in local}:
            users = [came.user for came in before[student, exercise] if came.platform == platform]
            if users:
                numbers[platform, exercise, ""][student] = users[-1]  # "": hand-ins laid out before
    lines = []
    for one, other in itertools.combinations(sorted(numbers), 2):
        (platform, exercise, earlier), later = one, other[2]
        known = numbers.get((platform, exercise, ""), {}) if earlier else {}  # numbers to compare with
        common = numbers[one].keys() & numbers[other].keys() - known.keys() if one[:2] == other[:2] else set()
        differ = sorted(student for student in common if numbers[one][student] != numbers[other][student])
        two_assignments = len(differ) > 1 and len(differ) == len(common)
        for student in differ:
            where = f"{numbers[one][student]} {f'in {earlier}' if earlier else 'before'}"
            said = f"the number {where} and {numbers[other][student]} in {later}"
            theirs = found[student, exercise]
            for each in [each for each in theirs if each.came.platform and each.download in (earlier, later)]:
                if two_assignments:
                    each.notes.append(f"{platform} has {said}: are these two assignments on the platform?")
                else:
                    theirs.remove(each)
                    lines.append(
                        f"{each.source}: {platform} has {each.came.name!r} with {said}, which may be two people: name "
                        "each in the roster, with the number"
                    )
    return lines


def _scope(handed_in: HandedIn) -> tuple[str, str]:
    """Return the scope in which a user number means one person: everywhere for Canvas, one download for Moodle."""
    platform = handed_in.came.platform
    return platform, "" if users_are_global(platform) else handed_in.download


def _weight(at: datetime, came: Source, due: datetime | None) -> tuple[bool, datetime]:
    """Return the sort key of two hand-ins to compare: on time before late, then newer before older.

    A hand-in of unknown time that no platform marks as late is on time if its latest possible time is before `due`.
    """
    in_time = due is None or came.time == ON_TIME or (at <= due and (came.time == KNOWN or not came.late))
    return in_time, at


# Laying out.


def _place(handed_in: HandedIn, into: Path, due: datetime | None, roster: Roster | None) -> bool:
    """Lay a hand-in out; return False if one that counts more is already there."""
    target = into / handed_in.student / handed_in.assignment
    came = handed_in.came
    if os.path.lexists(target):
        files, at, before = _laid_out(target, into)
        same = files == handed_in.files
        if before.name and not (before.platform or came.platform or roster) and _spelled(before) != _spelled(came):
            handed_in.notes.append(
                f"the hand-in collected before, of {_spelled(before)[:60]!a}, has the same folder, and no longer counts"
            )
            return _lay_out(handed_in, into, _kept_at(target, into, at))
        if same and at and (handed_in.ahead or KNOWN not in (came.time, before.time)):
            if came.platform and before.upload != came.upload:  # the page goes back to the newer upload
                provenance.add(into, handed_in.student, handed_in.assignment, replace(came, at=before.at))
            return True  # collected before: a later download does not make it newer
        somebodys = before.platform == came.platform and before.user != came.user  # from another number
        if somebodys and _vouched(handed_in.student, came, roster):
            handed_in.notes.append(
                f"the hand-in collected before came from the number {before.user}, and no longer counts"
            )
        elif at and _more(before, at, came, handed_in.at, due):
            if same and at == handed_in.at:
                provenance.add(into, handed_in.student, handed_in.assignment, came)
                return True
            if came.platform and not before.platform and not same:
                handed_in.notes.append("the one that counts did not come from a platform: check whose it is")
            return False
        if before.platform and not came.platform:
            handed_in.notes.append(INSTEAD.format(before.platform))
        return _lay_out(handed_in, into, _kept_at(target, into, at))
    return _lay_out(handed_in, into)


def _lay_out(handed_in: HandedIn, into: Path, former: Path | None = None) -> bool:
    """Lay a hand-in out, move the one that is there to `former`, and return True.

    If it is stopped between the two steps, the next collection lays the hand-in out again: with the new origin and the
    old files, it would take it for collected.
    """
    _write(handed_in, into / handed_in.student / handed_in.assignment, former)
    provenance.add(into, handed_in.student, handed_in.assignment, handed_in.came)
    return True


def _more(before: Source, at: datetime, came: Source, newer: datetime, due: datetime | None) -> bool:
    """Return True if the hand-in that is laid out counts as much as the new one, or more."""
    old, new = _weight(at, before, due), _weight(newer, came, due)
    if before.upload and came.upload and before.platform == came.platform:
        return (old[0], before.upload, old[1]) >= (new[0], came.upload, new[1])
    return old >= new


def _laid_out(target: Path, into: Path) -> tuple[dict[str, bytes], datetime | None, Source]:
    """Return the files of a submission that is laid out, its time, and its origin."""
    files = {path.name: content for path, content in files_of(target)}
    came = next(reversed(provenance.read(into, target.parent.name, target.name)), Source("", "", "", ""))
    text = files.pop(reading.TIMESTAMP, b"").decode(errors="replace").strip()
    for said, form in ((text, TIME), (came.at, "%Y-%m-%dT%H:%M:%SZ")):
        try:
            return files, datetime.strptime(said, form).replace(tzinfo=UTC), came
        except ValueError:
            continue
    return files, None, came


def _keep(handed_in: HandedIn, into: Path) -> None:
    """Keep a hand-in that does not count, unless it is kept already."""
    folder = into / OTHERS / handed_in.student / handed_in.assignment
    digest = hashlib.sha256(repr(sorted(handed_in.files.items())).encode()).hexdigest()[:8]
    target = folder / f"{handed_in.at:%Y%m%dT%H%M%SZ}-{digest}"
    if not target.exists():
        _write(handed_in, target)


def _kept_at(target: Path, into: Path, at: datetime | None) -> Path:
    """Return where the hand-in that is laid out is kept when another one replaces it."""
    folder = into / OTHERS / target.parent.name / target.name
    folder.mkdir(parents=True, exist_ok=True)
    stem = f"{at:%Y%m%dT%H%M%SZ}" if at else "no-time"
    number = next(number for number in range(10_000) if not (folder / f"{stem}-{number}").exists())
    return folder / f"{stem}-{number}"


def _write(handed_in: HandedIn, target: Path, former: Path | None = None) -> None:
    """Write a hand-in's folder, whole or not at all; what is there is moved to `former`."""
    with storage.folder(target, former=former) as draft:
        for name, content in handed_in.files.items():
            (draft / name).write_bytes(content)
        if handed_in.came.time == KNOWN:
            (draft / reading.TIMESTAMP).write_bytes(f"{handed_in.at:{TIME}}\n".encode())


def describe(collection: Collection) -> str:
    """Return the result of a collection as lines for the instructor."""
    lines = []
    for title, handed_in in (("Collected:", collection.laid_out), ("Kept, but not counted:", collection.kept)):
        lines += [title] * bool(handed_in)
        for each in handed_in:
            verified = ", receipt verified" if each.receipt == VERIFIED else ""
            look = f"  LOOK: {each.remark}" if each.remark else ""
            less = f"; not used: {', '.join(each.not_taken)}" if each.not_taken else ""
            lines.append(
                one_line(f"  {each.student}/{each.assignment}, {each.when}{verified} ({each.source}{less}){look}")
            )
    lines += [one_line(f"LOOK: {line}") for line in collection.looks]
    lines += ["Could not be placed:"] * bool(collection.unplaced)
    lines += [one_line(f"  {line}") for line in collection.unplaced]
    for name, absent in collection.missing.items():
        lines.append(one_line(f"{name}: not handed in by {counted(len(absent), 'student')}: {', '.join(absent)}"))
    count = counted(len(collection.laid_out), "submission")
    students = counted(len({each.student for each in collection.laid_out}), "student")
    return "\n".join([*lines, f"{count} of {students}; {len(collection.unplaced)} not placed."])
