"""The `course` command."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from course.foundation.untrusted import printable

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # its colours cannot be read in a light terminal
    help="The ROS 2 course's own command.",
)


@app.callback()
def main_options() -> None:
    """The ROS 2 course's own command."""


@app.command()
def doctor(
    short: Annotated[
        bool, typer.Option("--brief", help="Only the checks that a student needs, one line each.")
    ] = False,
) -> None:
    """Check that this machine can run the course, and say what to do where it cannot."""
    from course.installation_check import brief, report

    raise typer.Exit(brief() if short else report())


@app.command("sessions")
def sessions_command(
    stop: Annotated[
        list[int] | None,
        typer.Option("--stop", metavar="NUMBER", help="End the session with this number; can be given more than once."),
    ] = None,
    stop_all: Annotated[bool, typer.Option("--stop-all", help="End all of your sessions.")] = False,
) -> None:
    """List your live sessions on this machine, with their nodes; --stop ends one.

    Ending a session ends its kernel and all of its nodes.  Jupyter may start the kernel again, without a session.
    """
    from course.running_sessions import end, show

    raise typer.Exit(end(stop or [], everything=stop_all) if stop or stop_all else show())


@app.command()
def export(
    exercise: Annotated[str, typer.Argument(help="The name of the exercise and of its notebook: calculator.")],
    workspace: Annotated[Path, typer.Argument(help="The workspace: a folder, made if it does not exist.")],
    folder: Annotated[Path, typer.Option("--from", help="Where the exercise's files are.")] = Path(),
    package: Annotated[str, typer.Option(help="The name of the package; default: that of the exercise.")] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace files that were edited there.")] = False,
) -> None:
    """Create ROS 2 packages from an exercise's files, for `colcon build`, here and on a robot."""
    from course.errors import CourseError
    from course.workspace.export import export as export_files

    try:
        lines = export_files(exercise, workspace, folder, package=package, force=force)
    except CourseError as error:
        print(printable(f"course export: {error}"), file=sys.stderr)
        raise typer.Exit(1) from None
    print("\n".join(lines))


@app.command("hand-in")
def hand_in_command(
    folder: Annotated[Path, typer.Argument(help="The exercise's folder; default: this one.")] = Path(),
    name: Annotated[
        str, typer.Option(envvar="COURSE_STUDENT", help="Your name on the course; default: your login name.")
    ] = "",
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Hand in without asking, even with warnings.")] = False,
    check: Annotated[bool, typer.Option("--check/--no-check", help="Run the public checks first.")] = True,
) -> None:
    """Write an archive of the exercise, with a receipt, to hand in.

    It is called NAME-ASSIGNMENT-TIME.zip. What counts are the files, and the notebook as you last saved it.
    """
    from course.errors import CourseError
    from course.hand_in import hand_in, student

    try:
        status = hand_in(folder, name or student(), yes=yes, check=check)
    except CourseError as error:
        print(printable(f"course hand-in: {error}"), file=sys.stderr)
        raise typer.Exit(1) from None
    raise typer.Exit(status)


@app.command("feedback")
def feedback_command(
    file: Annotated[
        Path | None,
        typer.Argument(
            help="The feedback page, or an archive that contains it; default: the page here, or the released one."
        ),
    ] = None,
) -> None:
    """Show the feedback on an exercise: the points of each cell, and what to correct.

    The page is put into the folder `feedback` beside the notebook, where `course.feedback()` finds it.
    """
    from rich.console import Console

    from course.errors import CourseError
    from course.returned import reading, shown

    try:
        page, found = reading.take(file, Path()) if file else reading.find(Path())
    except CourseError as error:
        print(printable(f"course feedback: {error}"), file=sys.stderr)
        raise typer.Exit(1) from None
    first, _, rest = shown.text(found).partition("\n")
    console = Console(highlight=False, soft_wrap=True)
    console.print(first, style="bold", markup=False)
    console.print(rest, markup=False)
    console.print(f"\nThe page: {page}. In the notebook, course.feedback() shows it below the exercise.", markup=False)


def main() -> None:
    """Run the command."""
    app()
