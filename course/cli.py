"""The `course` command."""

from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, add_completion=False, help="The ROS 2 course's own command.")


@app.callback()
def main_options() -> None:
    """The ROS 2 course's own command."""


@app.command()
def doctor() -> None:
    """Check that this machine can run the course, and say what to do where it cannot."""
    from course.doctor import report

    raise typer.Exit(report())


@app.command("sessions")
def sessions_command(
    stop: Annotated[
        list[int] | None,
        typer.Option("--stop", metavar="NUMBER", help="End the session of this number; may be given again."),
    ] = None,
    stop_all: Annotated[bool, typer.Option("--stop-all", help="End every session of yours.")] = False,
) -> None:
    """List the live sessions of this machine that are yours, with their nodes; --stop ends one that was forgotten.

    Ending a session ends its kernel and all of its nodes.  Jupyter may start the kernel anew, without a session.
    """
    from course.forgotten import end, show

    raise typer.Exit(end(stop or [], everything=stop_all) if stop or stop_all else show())


def main() -> None:
    """Run the command."""
    app()
