"""The HTML pages that results are shown on: one template each in `templates`, all with the same head and policy."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader

TEMPLATES = Path(__file__).resolve().with_name("templates")  # absolute now, because nbgrader changes the working folder


def render(template: str, **values: object) -> str:
    """The page that `template` makes of `values`; every value is escaped."""
    environment = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template(template).render(values)
