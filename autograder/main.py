"""The command line: `autograder check` for one submission, `autograder grade` for a folder of them."""

import json
import logging
import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from . import batch, exercises, grading, sandbox, submission
from .records import GRADED, INFRASTRUCTURE_ERROR, PASSED, Report

USAGE, INFRASTRUCTURE = 2, 3  # exit codes
UsageProblem = typer.BadParameter.__base__  # typer carries a click of its own, and gives this class no name

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False,
                  help="Grade ROS 2 programs with hidden tests, in a sandbox.")
Unsafe = Annotated[bool, typer.Option("--unsafe", help="Run students' programs without a sandbox, and flag the results.")]
Seed = Annotated[int | None, typer.Option(help="Draw the hidden inputs from this seed instead of a new one.")]
Patience = Annotated[float, typer.Option(min=0.1, help="Stretch every wait by this factor, for a slow machine.")]


@app.command()
def check(folder: Annotated[Path, typer.Argument(help="The folder with the files handed in.")],
          assignment: Annotated[str, typer.Option(help="The exercise, for example calculator.")],
          as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
          unsafe: Unsafe = False, seed: Seed = None, patience: Patience = 1.0) -> None:
    """Grade one submission and print the report."""
    exercise = exercises.load(assignment)
    if not folder.is_dir():
        raise batch.UsageError(f"there is no folder {folder}")
    handed_in = submission.read(folder, folder.resolve().name, assignment, exercise.files)
    report = grading.grade(handed_in, _box(unsafe), seed, patience)
    print(json.dumps(report.public(), indent=2) if as_json else _printable(_describe(report)))
    raise typer.Exit(INFRASTRUCTURE if report.status == INFRASTRUCTURE_ERROR else 0)


@app.command()
def grade(submitted: Annotated[Path, typer.Argument(help="The folder with STUDENT/ASSIGNMENT/FILES.")],
          output: Annotated[Path, typer.Option(help="Where results.jsonl and the feedback go.")],
          assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None,
          student: Annotated[list[str] | None, typer.Option(help="Only this student; may be given again.")] = None,
          resume: Annotated[bool, typer.Option("--resume", help="Go on with what OUTPUT does not have yet.")] = False,
          no_gradebook: Annotated[bool, typer.Option("--no-gradebook", help="Leave nbgrader's gradebook alone.")] = False,
          gradebook: Annotated[str | None, typer.Option(
              help="The gradebook's database URL; default: the course's that SUBMITTED lies in, or one in OUTPUT.")] = None,
          unsafe: Unsafe = False, seed: Seed = None, patience: Patience = 1.0) -> None:
    """Grade a folder of submissions, write results, feedback and gradebook."""
    found = batch.find(submitted, assignment, student or [])
    box = _box(unsafe)
    with batch.Output(output, resume) as out, _scores(no_gradebook, gradebook, submitted, output) as scores:
        if scores:
            for report in out.done.values():
                scores.write(report)
        todo = out.left(found)
        for number, key in enumerate(todo, 1):
            report = grading.grade(batch.read(submitted, *key), box, seed, patience)
            out.write(report)
            if scores:
                scores.write(report)
            print(_printable(f"[{number}/{len(todo)}] {_line(report)}"), flush=True)
        reports = [out.done[key] for key in found]
    counts = Counter(report.status for report in reports)
    print(f"{len(reports)} submissions: {', '.join(f'{count} {status}' for status, count in counts.items())}; "
          f"results in {output / 'results.jsonl'}")
    raise typer.Exit(INFRASTRUCTURE if counts[INFRASTRUCTURE_ERROR] else 0)


@app.command()
def show(folder: Annotated[Path, typer.Argument(help="The output folder of `autograder grade`.")],
         student: Annotated[str | None, typer.Option(help="Only this student.")] = None,
         assignment: Annotated[str | None, typer.Option(help="Only this exercise.")] = None) -> None:
    """Show results to an instructor: with the hidden inputs, what was expected and got, and the seed."""
    from .show import reports
    for report, details in reports(folder, student, assignment):
        print(_printable(_describe(report, details)))
        for name, log in report.logs.items() if student else ():
            print(_printable(f"\n{name} printed:\n{log}"))


@app.command()
def doctor() -> None:
    """Show which layers of the sandbox hold on this machine; exit code 1 when grading is refused."""
    from rich.console import Console
    from rich.table import Table

    from . import doctor
    try:
        layers = doctor.examine()
    except sandbox.SandboxUnavailable as error:
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
) -> None:
    """Make the student version of notebooks, and refuse what would show a solution or a hidden test."""
    from .release import NOTEBOOKS, release
    for folder in release(course, assignment or [], notebooks or NOTEBOOKS):
        print(f"{folder}: released, and searched for solutions, marking schemes and hidden tests")


def main() -> None:
    """Run the command line; whatever the user can mend is one line and exit code 2."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    try:
        raise SystemExit(app(standalone_mode=False))
    except UsageProblem as error:
        _fail(error.format_message())
    except typer.Abort:
        raise SystemExit(130) from None
    except (batch.UsageError, exercises.UnknownExercise) as error:
        _fail(str(error.args[0]))
    except sandbox.SandboxUnavailable as error:
        _fail(f"{error}; --unsafe grades without a sandbox")
    except OSError as error:
        _fail(f"stopped, what is done is kept: {error.filename or 'writing'}: {error.strerror}", INFRASTRUCTURE)


def _fail(message: str, code: int = USAGE) -> None:
    print(f"autograder: {message}", file=sys.stderr)
    raise SystemExit(code)


def _box(unsafe: bool) -> str:
    return sandbox.choose(unsafe)


def _scores(no_gradebook: bool, url: str | None, submitted: Path, output: Path):
    """The gradebook to write to, or a context that gives None."""
    if no_gradebook:
        from contextlib import nullcontext
        return nullcontext()
    from .gradebook import Scores, default_url  # nbgrader takes a second to load
    return Scores(url or default_url(submitted, output), submitted)


def _line(report: Report) -> str:
    if report.status != GRADED:
        return f"{report.student}/{report.assignment}: {report.status}"
    return f"{report.student}/{report.assignment}: {report.score:g} of {report.max_score:g}, {report.duration_s:.1f} s"


def _printable(text: str) -> str:
    """Without what would command the terminal: names and messages are a student's."""
    return "".join(c if c == "\n" or c.isprintable() else f"\\x{ord(c):02x}" for c in text)


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
    flags = f", {', '.join(report.flags)}" if report.flags else ""
    lines.append(f"{_line(report)} (seed {report.seed}{flags})")
    return "\n".join(lines)
