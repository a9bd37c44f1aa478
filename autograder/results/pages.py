"""The HTML pages that results are shown on: one template each in `templates`, all with the same head and policy."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader

from course.foundation.untrusted import visible

TEMPLATES = Path(__file__).resolve().with_name("templates")  # absolute now, because nbgrader changes the working folder


def render(template: str, **values: object) -> str:
    """The page that `template` makes of `values`; every value is escaped, and what would turn or hide text is shown."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )
    return environment.get_template(template).render(values)


def _shown(value: object) -> object:
    return visible(value) if type(value) is str else value  # what is marked as safe stays as it is
