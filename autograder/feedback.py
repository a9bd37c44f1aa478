"""The page that a student reads: score, and each test with its outcome and what to do.  Everything in it is escaped."""

from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, Template

from .exercises import load
from .records import Mark, Report

TEMPLATES = Path(__file__).resolve().with_name("templates")  # now: nbgrader changes the working folder


def template(name: str) -> Template:
    """One of the pages' templates."""
    environment = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(name)


def page(report: Report, by_hand: Iterable[Mark] = ()) -> str:
    """The feedback on one submission as an HTML page, with what the instructor has marked by hand."""
    return template("feedback.html").render(report=report, by_hand=list(by_hand), exercise=load(report.assignment),
                                            number=lambda points: f"{points:g}")
