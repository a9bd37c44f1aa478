"""The HTML pages for results: one template each in `templates`, with a common head and content security policy."""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader

from course.foundation.untrusted import visible

TEMPLATES = Path(__file__).resolve().with_name("templates")  # absolute now, because nbgrader changes the working folder


def render(template: str, **values: object) -> str:
    """Return `template` filled with `values`; each is escaped, and characters that reverse or hide text are shown."""
    return _environment().get_template(template).render(values)


@cache  # compiling a template takes longer than filling it
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )


def _shown(value: object) -> object:
    return visible(value) if type(value) is str else value  # Markup that is marked as safe is kept
