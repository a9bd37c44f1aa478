"""The page that a student reads: score, and each test with its outcome and what to do.  Everything in it is escaped."""

from jinja2 import Environment, PackageLoader

from .exercises import load
from .records import Report


def page(report: Report) -> str:
    """The feedback on one submission as an HTML page."""
    environment = Environment(loader=PackageLoader("autograder"), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.get_template("feedback.html")
    return template.render(report=report, exercise=load(report.assignment), number=lambda points: f"{points:g}")
