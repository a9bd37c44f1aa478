"""The command line: `autograder check` grades one submission, `autograder grade` a folder of them."""

import contextlib
import errno
import json
import logging
import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from autograder import platforms
from autograder.authoring.kinds import Kind
from autograder.errors import InfrastructureError, SandboxUnavailable, UsageError
from autograder.grading import batch, regrade, single
from autograder.paths import repository
from autograder.records import INFRASTRUCTURE_ERROR, Report
from autograder.results import output, progress, summary, targets
from autograder.results.looks import REPLACED, Known, looks
from autograder.results.text import PRINTED, describe, one_line, printable, quoted
from autograder.sandbox.sandbox import choose
from autograder.submissions import exercises, listing, reading
from autograder.submissions.roster import Roster, of_class, read_rosters
from autograder.usage import UsageProblem, told
from course.foundation import storage

if TYPE_CHECKING:
    from autograder.gradebook.entering import Entering

# Packages that take a second to load (Dask, nbgrader, numpy) are imported by the commands that need them.

ALIKE = 10  # groups of an exercise that the report names, and pairs
USAGE, INFRASTRUCTURE, INTERRUPTED = 2, 3, 130  # exit codes
GO_ON = "Free some space, and run the command again; `grade` continues with --resume"

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, help="Grade ROS 2 programs with hidden tests, in a sandbox."
)


class Grades(StrEnum):
    """The format of a file of grades."""

    CANVAS = platforms.CANVAS.form
    MOODLE = platforms.MOODLE.form
    CSV = platforms.TABLE


class Unanswered(StrEnum):
    """The treatment of questions in words if no notebook was handed in."""

    ASK = "ask"
    ZERO = "zero"


Assignment = Annotated[str | None, typer.Option(help="Only this exercise.")]
Students = Annotated[list[str] | None, typer.Option(help="Only this student; repeat the option for several.")]
Unsafe = Annotated[
    bool, typer.Option("--unsafe", help="Run students' programs without a sandbox, and flag the results.")
]
Seed = Annotated[int | None, typer.Option(help="Draw the hidden inputs from this seed; default: a new one.")]
Jobs = Annotated[
    int | None,
    typer.Option(
        min=1, help="The number of submissions to grade at a time; default: as many as the processors can run."
    ),
]
Scheduler = Annotated[
    str | None, typer.Option(help="Grade on the Dask cluster at tcp://HOST:PORT instead of this machine.")
]
NoGradebook = Annotated[bool, typer.Option("--no-gradebook", help="Write no scores to nbgrader's gradebook.")]
GradebookUrl = Annotated[
    str | None,
    typer.Option(
        "--gradebook",
        help="The database URL of the gradebook; default: that of the course around SUBMITTED, or else one in OUTPUT.",
    ),
]
Patience = Annotated[
    float, typer.Option(min=0.1, help="Multiply the time limits of students' programs by this, for a slow machine.")
]
Rosters = Annotated[
    list[Path] | None,
    typer.Option(
        help="The class, a CSV file: the column `student` has the name of the student's folder, the other columns have "
        "the student's other names (login, number, first_name, last_name). Repeat the option for several files. "
        "Later commands remember it."
    ),
]
WithoutNotebook = Annotated[
    Unanswered,
    typer.Option(
        help="The score of questions in words when no notebook was handed in: ask (wait for a mark by hand), or zero."
    ),
]


class Form(StrEnum):
    """The platform to which students' pages are returned."""

    CANVAS = platforms.CANVAS.form
    MOODLE = platforms.MOODLE.form
    FILES = platforms.FILES


Out = Annotated[Path, typer.Argument(metavar="OUTPUT", help="The output folder of `autograder grade`.")]


@app.command()
def check(
    folder: Annotated[Path, typer.Argument(help="The folder with the files handed in, or an archive of them.")],
    assignment: Annotated[str, typer.Option(help="The exercise, for example calculator.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    unsafe: Unsafe = False,
    seed: Seed = None,
    patience: Patience = 1.0,
) -> None:
    """Grade one submission and print the report; show on stderr what it is waiting for."""
    logging.getLogger("autograder").setLevel(logging.INFO)  # on stderr, for the person who waits
    exercise = exercises.load(assignment)
    if folder.is_file():
        from autograder.collecting.bundles import unpacked

        with unpacked(folder, assignment) as files:
            handed_in = reading.read(files, folder.stem, assignment, exercise.files)
    elif folder.is_dir():
        place = folder.resolve()
        student = (place.parent if place.name == assignment else place).name
        handed_in = reading.read(folder, student, assignment, exercise.files)
    else:
        raise UsageError(f"there is no folder or archive {folder}")
    report = single.grade(handed_in, choose(unsafe), seed, patience)
    print(json.dumps(report.public(), indent=2) if as_json else printable(describe(report)))
    raise typer.Exit(_exit_code([report]))


@app.command()
def grade(
    submitted: Annotated[Path, typer.Argument(help="The folder with STUDENT/ASSIGNMENT/FILES.")],
    out: Annotated[Path, typer.Option("--output", help="The folder for the results and the students' feedback.")],
    assignment: Assignment = None,
    student: Students = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue a batch: grade only submissions without a result in OUTPUT.")
    ] = False,
    roster: Rosters = None,
    without_notebook: WithoutNotebook = Unanswered.ASK,
    no_gradebook: NoGradebook = False,
    gradebook: GradebookUrl = None,
    unsafe: Unsafe = False,
    seed: Seed = None,
    patience: Patience = 1.0,
) -> None:
    """Grade a folder of submissions; write results, feedback and the gradebook."""
    from autograder.gradebook.apart import expect_private

    _one_of(jobs, scheduler)
    expect_private(out)
    found = listing.find(submitted, assignment, student or [])
    known = of_class(submitted, roster)
    zero = without_notebook == Unanswered.ZERO
    with output.Output(out, resume) as results, contextlib.ExitStack() as opened:
        results.asks(found)
        before = output.bases(out, lost=True)
        elsewhere = batch.of_other_folders(before, submitted, results.done.keys() & {*found})
        other = {key for key, basis in elsewhere.items() if basis.is_replaced(key)}
        left = {*results.left(found), *other}
        results.move({key: basis for key, basis in elsewhere.items() if key not in left})
        _tell_of_other_folders(out, submitted, before, other)
        seeds = batch.draw([key for key in found if key in left], seed)
        if seeds:
            pool = opened.enter_context(batch.workers(jobs, scheduler, patience, unsafe))
            graded = batch.run(pool, submitted, seeds)  # while the gradebook opens, which takes seconds
        book = opened.enter_context(_gradebook(no_gradebook, gradebook, submitted, out, known, zero))
        for key, report in results.done.items():
            if key not in seeds:
                book.write(report)
        if seeds:
            with progress.shown(len(seeds)) as show_progress:
                for report, origin in graded:
                    results.write(report, origin)
                    book.write(report)
                    show_progress(report)
        reports = [results.done[key] for key in found]
        changed = batch.changed(out, [key for key in found if key not in seeds])
    summary.show(reports)
    if hints := listing.overlooked(submitted):
        print(printable("\n".join(["Not graded, because it is not in the form STUDENT/ASSIGNMENT/FILES:", *hints])))
    _print_unsettled(book)
    expected = known.students if known and not student else set()
    for name in sorted({name for _, name in found}):
        if absent := sorted(expected - {who for who, of in found if of == name}):
            print(printable(one_line(f"Not handed in: {name}: {', '.join(absent)}.")))
    if changed:
        names = one_line(", ".join(map("/".join, changed)))
        print(printable(f"Handed in again, or graded with an older version of the hidden tests: {names}."))
        print(printable(f"`autograder regrade {out}` grades them again."))
    print(f"Results: {out / output.RESULTS}")
    raise typer.Exit(_exit_code(reports))


@app.command("regrade")
def regrade_command(
    out: Out,
    assignment: Assignment = None,
    student: Students = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Grade again even if neither the hidden tests nor the files have changed.")
    ] = False,
    apply: Annotated[bool, typer.Option("--apply", help="Write the new results, feedback and gradebook.")] = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    without_notebook: WithoutNotebook = Unanswered.ASK,
    no_gradebook: NoGradebook = False,
    gradebook: GradebookUrl = None,
    unsafe: Unsafe = False,
    patience: Patience = 1.0,
) -> None:
    """Grade again where hidden tests (with the same seeds) or hand-ins changed; show which scores change, and why."""
    _one_of(jobs, scheduler)
    if not output.read_results(out):
        raise UsageError(f"no results in {out}")
    _tell_of_a_copy(out, output.bases(out, lost=True))
    with (
        output.Output(out, resume=True) as results,
        regrade.Regrading(results, assignment, student or [], everything) as again,
    ):
        if count := len(again.waiting):
            with batch.workers(jobs, scheduler, patience, unsafe) as pool, progress.shown(count) as show_progress:
                for report in again.run(pool):
                    show_progress(report)
        moves = again.moves()
        for move in moves:
            if move.why or move.moved:
                print(printable(move.describe()))
        print(f"{len(moves)} graded again, {sum(move.moved for move in moves)} of them with a different score.")
        if apply:
            zero = without_notebook == Unanswered.ZERO
            for submitted in again.folders:
                with _gradebook(no_gradebook, gradebook, submitted, out, None, zero) as book:
                    again.apply(submitted, book.write)
                _print_unsettled(book)
            again.forget()
            if moves:
                print(f"Written; the old results are in {out / output.HISTORY}.")
        else:
            print(
                "Nothing is written yet; the same command with --apply writes the new results, and enters written "
                "answers and times of hand-ins that have changed."
            )
    raise typer.Exit(_exit_code([move.new for move in moves]))


@app.command("report")
def report_command(
    out: Out,
    html: Annotated[Path | None, typer.Option(help="The page to write; default: report.html in OUTPUT.")] = None,
    roster: Rosters = None,
    gradebook: GradebookUrl = None,
) -> None:
    """Write an HTML page about the class: what needs attention, then scores, hidden tests and grading times."""
    reports = output.read_results(out)
    if not reports:
        raise UsageError(f"no results in {out}")
    target = html or out / "report.html"
    _check_target(target, [out], roster, gradebook)
    known = _circumstances(out, reports, _roster_of(out, roster), gradebook)
    summary.write(list(reports.values()), target, out, known)
    for look in looks(reports.values(), known):
        print(printable(one_line(f"{look.why}: {'; '.join(look.who)}")))
    print(target)


@app.command()
def show(
    folder: Annotated[Path, typer.Argument(help="The output folder of `autograder grade`.")],
    student: Annotated[str | None, typer.Option(help="Only this student, with the output of the programs.")] = None,
    assignment: Assignment = None,
    passed: Annotated[bool, typer.Option("--passed", help="Also show the tests that were passed.")] = False,
) -> None:
    """Show results to an instructor, with the hidden inputs, expected and actual behaviour, and the seed.

    For the whole class, only tests that were not passed are shown, unless --passed is given.
    """
    for report, details in output.read_with_details(folder, student, assignment):
        print(printable(describe(report, details, all_tests=passed or bool(student))))
        for name, log in report.logs.items() if student else ():
            print(printable(f"\n{name} printed:\n{quoted(log, PRINTED)}"))


@app.command()
def similar(
    folder: Annotated[Path, typer.Argument(help="The output folder of `autograder grade`, or the submissions.")],
    earlier: Annotated[
        list[Path] | None, typer.Argument(help="Folders of earlier courses to compare FOLDER with, too.")
    ] = None,
    assignment: Assignment = None,
    html: Annotated[
        Path | None, typer.Option(help="Also write a page to this file, with the texts of each pair side by side.")
    ] = None,
    top: Annotated[int, typer.Option(min=1, help="The number of pairs to list for each exercise.")] = 20,
) -> None:
    """List the most similar pairs of submissions: a reason to look at them, not a verdict."""
    from autograder.similarity import find, presenting

    if html:
        _check_target(html, [folder, *(earlier or [])])
    findings = find(folder, assignment, top, earlier or [])
    if html:
        presenting.write(findings, html)
    for finding in findings:
        print(printable(presenting.describe(finding)))


@app.command("doctor")
def doctor_command() -> None:
    """Show which layers of the sandbox work on this machine; exit code 1 when it cannot grade safely."""
    from rich.console import Console
    from rich.table import Table

    from autograder.sandbox import layer_check

    try:
        layers = layer_check.examine()
    except SandboxUnavailable as error:
        print(f"Grading is refused: {error}.")
        raise typer.Exit(1) from None
    table = Table("layer", "holds", "seen")
    for layer in layers:
        table.add_row(layer.name, "yes" if layer.holds else "NO" if layer.required else "no (not required)", layer.seen)
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    raise typer.Exit(1 if layer_check.refused(layers) else 0)


@app.command("collect")
def collect_command(
    sources: Annotated[
        list[Path],
        typer.Argument(metavar="SOURCE...", help="Archives of `course hand-in`, bulk downloads, or folders of them."),
    ],
    into: Annotated[Path, typer.Option(help="The folder for STUDENT/ASSIGNMENT/FILES; made if it does not exist.")],
    roster: Rosters = None,
    due: Annotated[
        str | None,
        typer.Option(help="The due date, such as '2026-11-20 23:59 UTC': the newest hand-in until then counts."),
    ] = None,
    assignment: Annotated[
        str | None, typer.Option(help="The expected exercise; hand-ins of others are listed, and not collected.")
    ] = None,
    until: Annotated[
        str | None,
        typer.Option(
            help="The end: later hand-ins are listed, and not collected; default: the end set by `release --until`, if "
            "INTO is in the course folder. Extensions set there move it in both cases."
        ),
    ] = None,
) -> None:
    """Sort hand-ins into folders, one for each student and exercise.

    The exit code is 1 when some could not be placed; the command lists them, and says why.
    """
    from autograder.collecting.collect import alone, collect
    from autograder.collecting.collect import describe as describe_collection
    from autograder.submissions.times import parse_time

    over, in_time = (parse_time(time) if time else None for time in (until, due))
    with alone(sources, into):  # also notes whether the folder around INTO is among the sources
        end = _end(into, over)
        collection = collect(sources, into, of_class(into, roster), in_time, assignment, end)
    print(printable(describe_collection(collection)))
    raise typer.Exit(1 if collection.unplaced else 0)


@app.command("return")
def return_command(
    out: Out,
    into: Annotated[
        Path | None, typer.Option(help="The folder for pages and archives; default: `returned` in OUTPUT.")
    ] = None,
    form: Annotated[
        Form | None,
        typer.Option("--for", help="The destination of the pages; default: where each submission came from."),
    ] = None,
    assignment: Assignment = None,
    student: Students = None,
    roster: Rosters = None,
    changed: Annotated[
        bool, typer.Option("--changed", help="Only pages that have changed since they were last returned.")
    ] = False,
    no_gradebook: Annotated[
        bool, typer.Option("--no-gradebook", help="Leave out marks by hand and late penalties.")
    ] = False,
    gradebook: GradebookUrl = None,
) -> None:
    """Prepare the pages to return to students, with marks by hand and lateness, packed for Canvas and Moodle.

    The exit code is 1 when pages are not returned; the command lists them, and says why.
    """
    from autograder.returning.giving_back import FOLDER, give_back, place_for_changed
    from autograder.returning.giving_back import describe as describe_returned

    _tell_of_a_copy(out, output.bases(out, lost=True))
    known = _roster_of(out, roster)
    url = "" if no_gradebook else gradebook
    absent = known.students if known else ()
    target = into or (place_for_changed(out) if changed else out / FOLDER)
    platform = form.value if form else None
    result = give_back(out, target, platform, assignment, student or [], url, absent, changed)
    print(printable(describe_returned(result)))
    raise typer.Exit(1 if result.left_out or result.ungraded else 0)


@app.command("export")
def export_command(
    out: Out,
    form: Annotated[Grades, typer.Option("--for", help="The format of the file.")],
    to: Annotated[Path, typer.Option(help="The file to write.")],
    automatic: Annotated[
        bool, typer.Option("--automatic", help="Export the points of the tests, without waiting for marks by hand.")
    ] = False,
    missing_is_zero: Annotated[
        bool, typer.Option("--missing-is-zero", help="Write 0 points for missing hand-ins; default: leave them empty.")
    ] = False,
    from_canvas: Annotated[
        Path | None, typer.Option(help="The gradebook exported from Canvas; needed with --for canvas.")
    ] = None,
    user: Annotated[
        str | None,
        typer.Option(help=f"The column by which Moodle finds students: {', '.join(platforms.MOODLE.columns)}."),
    ] = None,
    assignment: Assignment = None,
    student: Students = None,
    roster: Rosters = None,
    gradebook: GradebookUrl = None,
) -> None:
    """Write the grades for Canvas or Moodle, or as a table; list missing marks and missing hand-ins."""
    from autograder.gradebook.book import differing, existing_url
    from autograder.gradebook.exporting import Wish, export

    if user not in (None, *platforms.MOODLE.columns):
        raise UsageError(f"--user must be one of {', '.join(platforms.MOODLE.columns)}")
    bases = output.bases(out, lost=True)
    _tell_of_a_copy(out, bases)
    submitted = output.submitted(out)
    _check_target(to, [out], roster, gradebook)
    replaced = [key for key, basis in bases.items() if basis.is_replaced(key)]
    names = [assignment] if assignment else []
    wish = Wish(form.value, to, automatic, missing_is_zero, from_canvas, user, names, student or [], replaced)
    url = existing_url(gradebook, submitted, out)
    export(wish, url, submitted, _roster_of(out, roster))
    exported = {
        key: report
        for key, report in sorted(output.read_results(out).items())
        if assignment in (None, report.assignment) and (not student or report.student in student)
    }
    bases = {key: basis for key, basis in bases.items() if key in exported}
    gone = [key for key, basis in bases.items() if not listing.is_handed_in(Path(basis.submitted), *key)]
    comparable = [
        report
        for key, report in exported.items()
        if report.status != INFRASTRUCTURE_ERROR
        and key in bases
        and key[1] in exercises.names()
        and batch.is_of_present_suite(bases[key], key)
    ]
    others = f"the gradebook has other points of the hidden tests than {out}, and the file has those of the gradebook"
    for why, keys in (
        (REPLACED, [key for key in replaced if key in exported]),
        ("graded, but their folder no longer exists (was it renamed?)", gone),
        (f"{others} (`autograder grade` with --resume enters those of {out})", differing(url, comparable)),
    ):
        if keys:
            print(printable(one_line(f"LOOK: {why}: {', '.join('/'.join(key) for key in sorted(keys))}")))
    failed = ["/".join(key) for key, report in exported.items() if report.status == INFRASTRUCTURE_ERROR]
    if failed:
        print(printable(one_line(f"No grade, because the grader failed: {', '.join(failed)}.")))
        print("`autograder grade` with --resume grades them again; then export again.")


@app.command("release")
def release_command(
    assignment: Annotated[list[str] | None, typer.Argument(help="The notebooks to release; default: all.")] = None,
    course: Annotated[Path, typer.Option(help="nbgrader's course folder; made if it does not exist.")] = Path("."),
    notebooks: Annotated[
        Path | None, typer.Option(help="The folder of the notebooks; default: that of this course.")
    ] = None,
    students: Annotated[
        Path | None,
        typer.Option(
            help="Also make this folder for students: the released notebooks, and everything needed to run them."
        ),
    ] = None,
    due: Annotated[
        str | None,
        typer.Option(help="The due date, for the gradebook and the hand-in, such as '2026-11-20 23:59 UTC'."),
    ] = None,
    until: Annotated[
        str | None, typer.Option(help="The end: a later hand-in is told that it is too late. 'none' removes the end.")
    ] = None,
) -> None:
    """Make the students' version of notebooks; stop if one would show a solution or a hidden test."""
    from autograder.gradebook import ends
    from autograder.gradebook.apart import expect_apart
    from autograder.gradebook.release import hand_out, release
    from autograder.submissions.times import parse_time

    if students:
        expect_apart(course, students)
    dates = parse_time(due) if due else None, ends.parse(until) if until else None
    released = release(course, assignment or [], notebooks, *dates)
    for folder in released:
        print(f"{folder}: released, and searched for solutions, marking schemes and hidden tests")
    if students:
        hand_out(students, released)
        print(f"{students}: what students need, without the answers")


@app.command()
def extend(
    students: Annotated[
        list[str] | None,
        typer.Argument(help="The students, by the names of their folders; without any, list the extensions."),
    ] = None,
    course: Annotated[Path, typer.Option(help="nbgrader's course folder.")] = Path("."),
    assignment: Annotated[str | None, typer.Option(help="For this exercise; default: for all.")] = None,
    days: Annotated[float | None, typer.Option(min=0, help="The number of additional days.")] = None,
    until: Annotated[str | None, typer.Option(help="Or the new deadline, such as '2026-11-27 23:59 UTC'.")] = None,
    take_back: Annotated[bool, typer.Option("--take-back", help="Or remove the extension.")] = False,
) -> None:
    """Extend deadlines for students, or list the extensions; the next export or return recalculates penalties."""
    from autograder.gradebook import extensions
    from autograder.submissions.times import parse_time

    if students and (days is not None) + bool(until) + take_back != 1:
        raise UsageError("give one of --days, --until and --take-back")
    if not students and (days is not None or until or take_back):
        raise UsageError("name the students, before the options")
    extension = parse_time(until) if until else days
    given = extensions.change(course, students or [], assignment, None if take_back else extension)
    if not given:
        print("No student has an extension.")
    for student, name, more in extensions.listed(given):
        what = "every exercise" if name == extensions.ALL else name
        print(printable(one_line(f"{student}: {what}: {more}")))
    for student, meant in extensions.unknown(course, students or []).items():
        hint = f" Do you mean {meant}?" if meant else ""
        print(printable(one_line(f"LOOK: no student of this course has the name {student}.{hint}")))


@app.command("new")
def new_command(
    name: Annotated[str, typer.Argument(help="The exercise's name, for example greeter: lower case, as in Python.")],
    like: Annotated[Kind, typer.Option(help="The kind of exercise to begin with.")] = Kind.SERVICE,
) -> None:
    """Make a new exercise, small but complete, for you to change; docs/ADDING.md shows how."""
    from autograder.authoring.new import new

    for path in new(name, like):
        print(os.path.relpath(path))
    print(f"Try it: autograder check {os.path.relpath(repository() / 'solutions' / name)} --assignment {name}")


@app.command("try")
def try_command(
    folder: Annotated[Path, typer.Argument(help="The folder with right/NAME/FILES and wrong/NAME/FILES.")],
    assignment: Annotated[str, typer.Option(help="The exercise, for example calculator.")],
    jobs: Jobs = None,
    unsafe: Unsafe = False,
    seed: Seed = None,
    patience: Patience = 1.0,
) -> None:
    """Grade your own right and wrong answers to an exercise, and show which hidden test notices which mistake.

    The exit code is 1 when a right answer loses points, a wrong answer loses none, or a hidden test notices no mistake.
    """
    from autograder.authoring import trying

    with batch.workers(jobs, None, patience, unsafe) as pool:
        trial = trying.run(folder, assignment, pool, seed)
    print(printable(trial.describe()))
    raise typer.Exit(0 if trial.right else 1)


def main() -> None:
    """Run the command line; a problem that the user can solve is one line and exit code 2."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    for name in ("sqlalchemy.pool", "tornado.application"):  # they log a database's error before raising it
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        code = app(standalone_mode=False)
    except UsageProblem as error:
        _fail(told(error))
    except UsageError as error:
        _fail(str(error.args[0]))
    except SandboxUnavailable as error:
        _fail(f"{error}; --unsafe grades without a sandbox")
    except InfrastructureError as error:
        _fail(f"stopped, finished work is kept: {error}", INFRASTRUCTURE)
    except OSError as error:
        _fail(_stopped(f"{error.filename or 'writing'}: {storage.why(error)}"), INFRASTRUCTURE)
    except Exception as error:
        if not (why := _database_refuses(error)):
            raise
        _fail(_stopped(f"the gradebook: {why}"), INFRASTRUCTURE)
    if code == INTERRUPTED:  # typer turns Ctrl-C into an exit code
        _fail("stopped, finished work is kept", INTERRUPTED)
    raise SystemExit(code)


def _stopped(why: str) -> str:
    """Return why a command has stopped, and how to go on."""
    full = any(word in why for word in ("full", os.strerror(errno.ENOSPC), os.strerror(errno.EDQUOT)))
    return f"stopped, finished work is kept: {why}{'. ' + GO_ON if full else ''}"


def _database_refuses(error: BaseException) -> str:
    """Return the database's own message in an error; '' for other errors.

    nbgrader wraps some of them in its own exceptions.
    """
    told: BaseException | None = error
    while told is not None:
        if type(told).__module__ == "sqlite3":
            return str(told).partition("\n")[0]
        told = told.__cause__ or told.__context__
    return ""


def _fail(message: str, code: int = USAGE) -> NoReturn:
    print(printable(f"autograder: {message}"), file=sys.stderr)
    raise SystemExit(code)


def _check_target(
    named: Path, folders: Iterable[Path], roster: Iterable[Path] | None = None, gradebook: str | None = None
) -> None:
    """Raise UsageError for what is not a file to write to, before the work begins.

    Nor are the files of the `folders`, which are outputs of `grade` or submissions, nor the roster and the gradebook.
    """
    files = [*(roster or [])]
    if gradebook:
        from autograder.gradebook import address

        files += [file] if (file := address.file(gradebook)) else []
    outs = [folder for folder in folders if (folder / output.RESULTS).is_file()]
    submitted = {Path(basis.submitted) for out in outs for basis in output.bases(out, lost=True).values()}
    if why := targets.refused(named, outs, [*submitted, *(each for each in folders if each not in outs)], files):
        raise UsageError(f"cannot write to {named}: {why}")


def _one_of(jobs: int | None, scheduler: str | None) -> None:
    if jobs and scheduler:
        raise UsageError("give --jobs, for this machine, or --scheduler, for a cluster; not both")


class NoBook:
    """A gradebook that records nothing."""

    def __init__(self) -> None:
        self.unanswered: dict[str, list[str]] = {}
        self.rewritten: dict[str, list[str]] = {}
        self.withdrawn: dict[str, list[str]] = {}

    def write(self, report: Report) -> None:
        """Do nothing."""


@contextlib.contextmanager
def _gradebook(
    no_gradebook: bool, url: str | None, submitted: Path, out: Path, roster: Roster | None, unanswered_is_zero: bool
) -> Iterator["Entering | NoBook"]:
    """Yield the object that enters reports into the gradebook; with `no_gradebook`, it does nothing."""
    if no_gradebook:
        yield NoBook()
        return
    from autograder.gradebook.entering import Entering

    with Entering(url, submitted, out, roster, unanswered_is_zero) as entering:
        yield entering


def _print_unsettled(book: "Entering | NoBook") -> None:
    """Name the students whose questions in words wait for a mark, or have a mark for an answer that is gone."""
    for name, students in book.unanswered.items():
        who = ", ".join(students)
        print(printable(one_line(f"Handed in without a notebook, so {name}'s questions wait for a mark: {who}.")))
        print("Ask for the notebook, mark them in Formgrader without it, or give --without-notebook zero.")
    for name, students in book.rewritten.items():
        changed = f"Answers of {name} changed after they were marked by hand, and wait for a new mark"
        print(printable(one_line(f"{changed}: {', '.join(students)}.")))
    for name, students in book.withdrawn.items():
        gone = f"Handed in again without a notebook that can be read, but with marks by hand for answers of {name}"
        print(printable(one_line(f"{gone}: {', '.join(students)}.")))
        print("Ask for the notebook, or change the marks in Formgrader if they should not count.")


def _end(into: Path, until: datetime | None) -> Callable[[str, str], datetime | None]:
    """Return a function that tells when an exercise ends for a student: at `until`, or as the course folder says.

    Extensions in that folder move either.
    """
    from autograder.gradebook import course_folder

    course = course_folder.around(into)
    if not course:
        return lambda student, exercise: until
    from autograder.gradebook import ends, late

    known = ends.read(course)
    policy = late.LatePolicy(config=late.course_config(into))

    def end(student: str, exercise: str) -> datetime | None:
        over = until or known.get(exercise)
        return policy.moved(over.replace(tzinfo=None), student, exercise).replace(tzinfo=UTC) if over else None

    return end


def _tell_of_a_copy(out: Path, bases: Mapping[tuple[str, str], output.Basis]) -> None:
    """Print a line if `out` lies beside other submissions than its own, as in the copy of a course's folder."""
    around = out.resolve().parent
    for place in sorted({basis.submitted for basis in bases.values()}):
        own = around / Path(place).name
        if Path(place).parent != around and own.is_dir():
            told = f"LOOK: {out} was graded from {place}, with the gradebook there; {own} is ignored"
            print(printable(f"{told}: was the course's folder copied or moved?"), file=sys.stderr)


def _tell_of_other_folders(
    out: Path, submitted: Path, bases: Mapping[tuple[str, str], output.Basis], other: Collection[tuple[str, str]]
) -> None:
    """Print a line if `out` has results from other folders than `submitted`, and name what has `other` files there."""
    here = str(submitted.resolve())
    if places := sorted({basis.submitted for basis in bases.values()} - {here}):
        told = f"LOOK: {out} has results from {', '.join(places)}, and now {here} is graded into it"
        if other:
            names = ", ".join(map("/".join, sorted(other)))
            told += f". Graded again, because other files are there: {names} (old results: {out / output.HISTORY})"
        print(
            printable(one_line(f"{told}. For another class, give another --output: students may have the same names."))
        )


def _roster_of(out: Path, given: list[Path] | None) -> Roster | None:
    """Return the roster given, or that of the submissions that were graded into `out`."""
    try:
        submitted = output.submitted(out)
    except UsageError:  # the submissions are gone, and their roster, too
        return read_rosters(given) if given else None
    return of_class(submitted, given)


def _circumstances(
    out: Path, reports: dict[tuple[str, str], Report], roster: Roster | None, gradebook: str | None
) -> Known:
    """Return further facts: late submissions, missing ones, and groups that are alike."""
    from autograder.gradebook.book import existing_url, lateness
    from autograder.similarity import find, presenting

    names = sorted({name for _, name in reports})
    students = sorted(roster.students) if roster else []
    absent = {name: [student for student in students if (student, name) not in reports] for name in names}
    try:
        submitted = output.submitted(out)
    except UsageError:  # the submissions are gone, so there is nothing to compare
        return Known(missing=absent)
    try:
        url = existing_url(gradebook, submitted, out)
    except UsageError:
        if gradebook:
            raise
        url = ""
    ungraded = output.ungraded(out, submitted, reports, ((who, name) for name in names for who in absent[name]))
    absent = {name: [each for each in absent[name] if (each, name) not in ungraded] for name in names}
    late = lateness(url, submitted) if url else {}
    findings = [finding for name in names for finding in find(out, name, ALIKE)]
    return Known(
        {key: seconds for key, seconds in late.items() if key in reports},
        absent,
        dict(group for finding in findings for group in presenting.striking(finding, ALIKE).items()),
        ungraded,
        [
            key
            for finding in findings
            for student in finding.replaced
            if (key := (student, finding.assignment)) in reports
        ],
    )


def _exit_code(reports: list[Report]) -> int:
    return INFRASTRUCTURE if any(report.status == INFRASTRUCTURE_ERROR for report in reports) else 0
