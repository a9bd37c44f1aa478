"""Mistakes in a command line, as both commands tell them."""

from typing import cast

import typer

# typer has a copy of click of its own, and does not export click's UsageError.
UsageProblem = cast(type[typer.BadParameter], typer.BadParameter.__base__)


def told(problem: typer.BadParameter) -> str:
    """Return what is wrong, in one line."""
    return " ".join(problem.format_message().split())
