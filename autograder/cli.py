"""The command line: `autograder check` for one submission, `autograder grade` for a folder of them."""

import contextlib
import json
import logging
import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from autograder.errors import ClusterError, SandboxUnavailable, UsageError
from autograder.grading import batch
from autograder.grading.single import FAULT
from autograder.grading.single import grade as grade_one
from autograder.records import GRADED, INFRASTRUCTURE_ERROR, PASSED, Report
from autograder.results import output, progress, storage
from autograder.results.progress import line, printable
from autograder.sandbox.box import choose
from autograder.submissions import exercises, listing, reading

USAGE, INFRASTRUCTURE, INTERRUPTED = 2, 3, 130  # exit codes
UsageProblem = typer.BadParameter.__base__  # typer carries a click of its own, and gives this class no name

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, help="Grade ROS 2 programs with hidden tests, in a sandbox."
)
Unsafe = Annotated[
    bool, typer.Option("--unsafe", help="Run students' programs without a sandbox, and flag the results.")
]
Seed = Annotated[int | None, typer.Option(help="Draw the hidden inputs from this seed instead of a new one.")]
Jobs = Annotated[int | None, typer.Option(min=1, help="Gradings at a time; default: one for each core.")]
Scheduler = Annotated[
    str | None, typer.Option(help="Grade on the Dask cluster at tcp://HOST:PORT instead of this machine.")
]
NoGradebook = Annotated[bool, typer.Option("--no-gradebook", help="Leave nbgrader's gradebook alone.")]
GradebookUrl = Annotated[
    str | None,
    typer.Option(
        "--gradebook",
        help="The gradebook's database URL; default: the course's that SUBMITTED lies in, or one in OUTPUT.",
    ),
]
Patience = Annotated[float, typer.Option(min=0.1, help="Stretch every wait by this factor, for a slow machine.")]


@app.command()
def check(
    folder: Annotated[Path, typer.Argument(help="The folder with the files handed in.")],
    assignment: Annotated[str, typer.Option(help="The exercise, for example calculator.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    unsafe: Unsafe = False,
    seed: Seed = None,
    patience: Patience = 1.0,
) -> None:
    """Grade one submission and print the report."""
    exercise = exercises.load(assignment)
    if not folder.is_dir():
        raise UsageError(f"there is no folder {folder}")
    place = folder.resolve()
    student = (place.parent if place.name == assignment else place).name
    handed_in = reading.read(folder, student, assignment, exercise.files)
    report = grade_one(handed_in, choose(unsafe), seed, patience)
    print(json.dumps(report.public(), indent=2) if as_json else printable(_describe(report)))
    raise typer.Exit(INFRASTRUCTURE if report.status == INFRASTRUCTURE_ERROR else 0)


@app.command()
def grade(
    submitted: Annotated[Path, typer.Argument(help="The folder with STUDENT/ASSIGNMENT/FILES.")],
    out: Annotated[Path, typer.Option("--output", help="Where results.jsonl and the feedback go.")],
    assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None,
    student: Annotated[list[str] | None, typer.Option(help="Only this student; may be given again.")] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with what OUTPUT does not have yet.")] = False,
    no_gradebook: NoGradebook = False,
    gradebook: GradebookUrl = None,
    unsafe: Unsafe = False,
    seed: Seed = None,
    patience: Patience = 1.0,
) -> None:
    """Grade a folder of submissions, write results, feedback and gradebook."""
    _one_of(jobs, scheduler)
    found = listing.find(submitted, assignment, student or [])
    with output.Output(out, resume) as results, _scores(no_gradebook, gradebook, submitted, out) as scores:
        if scores:
            for report in results.done.values():
                scores.write(report)
        seeds = batch.draw(results.left(found), seed)
        with _workers(jobs, scheduler, unsafe, len(seeds)) as client, progress.shown(len(seeds)) as show_progress:
            for report, origin in batch.grade(client, submitted, seeds, patience, unsafe):
                results.write(report, origin)
                if scores:
                    scores.write(report)
                show_progress(report)
        reports = [results.done[key] for key in found]
        known = output.origins(out, lost=True)
        changed = [key for key in found if key not in seeds and key in known and batch.outdated(known[key], key)]
    from autograder.results.summary import show

    show(reports)
    if hints := listing.overlooked(submitted):
        print(printable("\n".join(["Not graded, for want of the form STUDENT/ASSIGNMENT/FILES:", *hints])))
    if changed:
        print(
            printable(
                f"Handed in again, or graded by an older suite: {', '.join(map('/'.join, changed))}.\n"
                f"`autograder regrade {out}` grades these again."
            )
        )
    print(f"Results: {out / output.RESULTS}")
    raise typer.Exit(INFRASTRUCTURE if any(report.status == INFRASTRUCTURE_ERROR for report in reports) else 0)


@app.command("regrade")
def regrade_command(
    out: Annotated[Path, typer.Argument(metavar="OUTPUT", help="The output folder of `autograder grade`.")],
    assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None,
    student: Annotated[list[str] | None, typer.Option(help="Only this student; may be given again.")] = None,
    everything: Annotated[bool, typer.Option("--all", help="Also what the suite as it is has graded.")] = False,
    apply: Annotated[bool, typer.Option("--apply", help="Write the new results, feedback and gradebook.")] = False,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    no_gradebook: NoGradebook = False,
    gradebook: GradebookUrl = None,
    unsafe: Unsafe = False,
    patience: Patience = 1.0,
) -> None:
    """Grade again what a changed suite or a new hand-in touches, with the seeds of before, and show who moves and why."""
    _one_of(jobs, scheduler)
    if not output.read_results(out):
        raise UsageError(f"no results in {out}")
    from autograder.grading import regrade

    with (
        output.Output(out, resume=True) as results,
        regrade.Regrading(results, assignment, student or [], everything) as again,
    ):
        count = len(again.waiting)
        with _workers(jobs, scheduler, unsafe, count) as client, progress.shown(count) as show_progress:
            for report in again.grade(client, patience, unsafe):
                show_progress(report)
        moves = again.moves()
        for move in moves:
            if move.why or move.moved:
                print(printable(f"{move.old.student}/{move.old.assignment}: {_score(move.old)} -> {_score(move.new)}"))
                print(printable("".join(f"    {reason}\n" for reason in move.why)), end="")
        moved = sum(move.moved for move in moves)
        print(f"{len(moves)} graded again, {moved} of them with another score.")
        if apply and moves:
            submitted = Path(next(iter(again.origins.values())).submitted)
            with _scores(no_gradebook, gradebook, submitted, out) as scores:
                again.apply(scores)
            print(f"Written; the results of before are in {out / output.HISTORY}.")
        elif moves:
            print("Nothing is written yet: --apply writes it.")
    raise typer.Exit(INFRASTRUCTURE if any(move.new.status == INFRASTRUCTURE_ERROR for move in moves) else 0)


@app.command("report")
def report_command(
    out: Annotated[Path, typer.Argument(metavar="OUTPUT", help="The output folder of `autograder grade`.")],
    html: Annotated[Path | None, typer.Option(help="The page; default: report.html in OUTPUT.")] = None,
) -> None:
    """Write one HTML page on the class: scores, each hidden test, time, and what needs a look."""
    from autograder.results.summary import page

    reports = output.read_results(out)
    if not reports:
        raise UsageError(f"no results in {out}")
    target = html or out / "report.html"
    storage.replace(target, page(list(reports.values())).encode(errors="replace"), storage.PRIVATE)
    print(target)


@app.command()
def show(
    folder: Annotated[Path, typer.Argument(help="The output folder of `autograder grade`.")],
    student: Annotated[str | None, typer.Option(help="Only this student.")] = None,
    assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None,
) -> None:
    """Show results to an instructor: with the hidden inputs, what was expected and got, and the seed."""
    from autograder.results.show import reports

    for report, details in reports(folder, student, assignment):
        print(printable(_describe(report, details)))
        for name, log in report.logs.items() if student else ():
            print(printable(f"\n{name} printed:\n{log}"))


@app.command()
def similar(
    folder: Annotated[Path, typer.Argument(help="The output folder of `autograder grade`, or the submissions.")],
    assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None,
    html: Annotated[Path | None, typer.Option(help="Write a page with the texts of each pair side by side.")] = None,
    top: Annotated[int, typer.Option(min=1, help="How many pairs of each exercise.")] = 20,
) -> None:
    """List the pairs of submissions that are most alike: a reason to look at them, not a verdict."""
    from autograder.similarity.similar import describe, find, write

    findings = find(folder, assignment, top)
    if html:
        write(findings, html)
    for finding in findings:
        print(printable(describe(finding)))


@app.command()
def doctor() -> None:
    """Show which layers of the sandbox hold on this machine; exit code 1 when grading is refused."""
    from rich.console import Console
    from rich.table import Table

    from autograder.sandbox import doctor

    try:
        layers = doctor.examine()
    except SandboxUnavailable as error:
        print(f"Grading is refused: {error}.")
        raise typer.Exit(1) from None
    table = Table("layer", "holds", "seen")
    for layer in layers:
        table.add_row(layer.name, "yes" if layer.holds else "NO" if layer.required else "no (not required)", layer.seen)
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    raise typer.Exit(1 if doctor.refused(layers) else 0)


@app.command("release")
def release_command(
    assignment: Annotated[list[str] | None, typer.Argument(help="The notebooks to release; default: all.")] = None,
    course: Annotated[Path, typer.Option(help="nbgrader's course folder; made if there is none.")] = Path("."),
    notebooks: Annotated[Path | None, typer.Option(help="Where the notebooks are; default: this course's.")] = None,
    students: Annotated[
        Path | None,
        typer.Option(help="Lay out here what students get: the released notebooks with all that they need to run."),
    ] = None,
) -> None:
    """Make the student version of notebooks, and refuse what would show a solution or a hidden test."""
    from autograder.gradebook.release import hand_out, release

    released = release(course, assignment or [], notebooks)
    for folder in released:
        print(f"{folder}: released, and searched for solutions, marking schemes and hidden tests")
    if students:
        hand_out(students, released)
        print(f"{students}: what students need, without the answers")


def main() -> None:
    """Run the command line; whatever the user can mend is one line and exit code 2."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        code = app(standalone_mode=False)
    except UsageProblem as error:
        _fail(error.format_message())
    except UsageError as error:
        _fail(str(error.args[0]))
    except SandboxUnavailable as error:
        _fail(f"{error}; --unsafe grades without a sandbox")
    except OSError as error:
        _fail(f"stopped, what is done is kept: {error.filename or 'writing'}: {error.strerror}", INFRASTRUCTURE)
    if code == INTERRUPTED:  # typer makes an exit code of Ctrl-C
        _fail("stopped, what is done is kept", INTERRUPTED)
    raise SystemExit(code)


def _fail(message: str, code: int = USAGE) -> None:
    print(f"autograder: {message}", file=sys.stderr)
    raise SystemExit(code)


def _one_of(jobs: int | None, scheduler: str | None) -> None:
    if jobs and scheduler:
        raise UsageError("give --jobs, for this machine, or --scheduler, for a cluster; not both")


def _score(report: Report) -> str:
    return report.status if report.score is None else f"{report.score:g} of {report.max_score:g}"


@contextlib.contextmanager
def _workers(jobs: int | None, scheduler: str | None, unsafe: bool, count: int):
    """A client of the workers that are to grade `count` submissions; None when there are none to grade."""
    if not count:
        yield None
        return
    if not scheduler:
        choose(unsafe)  # says what is missing before the workers do
    from autograder.grading import cluster  # takes a second to load

    try:
        with cluster.remote(scheduler) if scheduler else cluster.local(min(count, jobs or _cores())) as client:
            yield client
    except ClusterError as error:
        _fail(f"stopped, what is done is kept: {error}", INFRASTRUCTURE)


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def _scores(no_gradebook: bool, url: str | None, submitted: Path, output: Path):
    """The gradebook to write to, or a context that gives None."""
    if no_gradebook:
        return contextlib.nullcontext()
    from autograder.gradebook.book import Scores, default_url  # nbgrader takes a second to load

    return Scores(url or default_url(submitted, output), submitted)


def _describe(report: Report, details: dict[str, str] | None = None) -> str:
    """A report for a person at a terminal; `details` are for instructors."""
    lines = []
    if report.status == GRADED:
        for test in report.tests:
            mark = "+" if test.outcome == PASSED else "-"
            outcome = "" if test.outcome == PASSED else f" [{test.outcome.replace('_', ' ')}]"
            lines.append(f" {mark} {test.points:g}/{test.max_points:g}  {test.title}{outcome}")
            lines += [f"         {test.message}"] if test.message else []
            if detail := (details or {}).get(test.id):
                lines.append(f"         > {detail}")
    else:
        lines.append(f" {report.tests[0].message}")
        if fault := (details or {}).get(FAULT):
            lines += [f"         > {said}" for said in fault.splitlines()]
    flags = f", {', '.join(report.flags)}" if report.flags else ""
    lines.append(f"{line(report)} (seed {report.seed}{flags})")
    return "\n".join(lines)
