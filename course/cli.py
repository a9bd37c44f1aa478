"""The `course` command."""

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


def main() -> None:
    """Run the command."""
    app()
