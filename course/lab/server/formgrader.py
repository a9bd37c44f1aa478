"""nbgrader's Formgrader shows names as text, files that were handed in have no rights in it, and it runs none of them.

nbgrader 0.9 puts names and the parts of an address into its pages as they are, so that a link, or a student whose name
or folder is HTML, would run a script with the rights of the instructor who looks. So would a drawing (SVG) beside a
handed-in notebook that links to it.  It would run the `nbgrader_config.py` of whatever folder an address names, such as
a student's.  And it puts the server's folder first on the path of all modules.
"""

import html
import re
from collections.abc import Callable
from typing import Any

from jinja2 import Environment, FileSystemLoader
from nbconvert.exporters import HTMLExporter
from tornado.web import Application, HTTPError

from course.lab.server import shown_files
from course.notebook import own_path

IN_SCRIPT = re.compile(r'"\{\{ (\w+) \}\}"(?=;)')  # the value of a variable of JavaScript
DIALOGS = '/formgrader/static/js/utils.js"></script>'
# jQuery takes a text with tags for HTML; nbgrader's dialogs on failures name the student in such a text.
TEXT_ALONE = """
<script>
var createDialog = createModal;
createModal = function (id, title, body, footer) {
    return createDialog(id, title, typeof body === "string" ? document.createTextNode(body) : body, footer);
};
</script>"""


class Loader(FileSystemLoader):
    """Gives nbgrader's templates with their values in scripts written as JavaScript, and dialogs that show text."""

    def get_source(self, environment: Environment, template: str) -> tuple[str, str, Callable[[], bool]]:
        """Return the template's text, its path, and a function that tells whether that is up to date."""
        source, path, fresh = super().get_source(environment, template)
        source = IN_SCRIPT.sub(r"{{ \1 | tojson }}", source)
        return source.replace(DIALOGS, DIALOGS + TEXT_ALONE), path, fresh


class Exporter(HTMLExporter):
    """Makes the page on which an instructor marks a notebook."""

    def from_filename(self, filename: str, resources: dict[str, Any] | None = None, **kw: Any) -> tuple[Any, Any]:
        """Return the page, with the student's names as text, and what nbconvert knows about it."""
        shown = {
            name: html.escape(value) if isinstance(value, str) else value for name, value in (resources or {}).items()
        }
        return super().from_filename(filename, shown, **kw)


def guard() -> None:
    """Have Formgrader, which is not loaded yet, make its pages so, give out files so, and stay in its course."""
    from nbgrader.server_extensions.formgrader import handlers
    from nbgrader.server_extensions.formgrader.formgrader import FormgradeExtension

    own_path.keep_path()
    handlers.SubmissionFilesHandler.set_extra_headers = shown_files.confine
    show = handlers.FormgraderHandler.get

    def get(handler: handlers.FormgraderHandler) -> None:
        if handler.get_argument("path", ""):
            raise HTTPError(403, "Formgrader shows the course of the folder in which JupyterLab was started, no other")
        show(handler)

    handlers.FormgraderHandler.get = get
    begin = FormgradeExtension.init_tornado_settings

    def init_tornado_settings(extension: FormgradeExtension, application: Application) -> None:
        begin(extension, application)
        application.settings["nbgrader_jinja2_env"] = Environment(
            loader=Loader([handlers.template_path]), autoescape=True
        )
        application.settings["nbgrader_exporter"] = Exporter(config=extension.config)

    FormgradeExtension.init_tornado_settings = init_tornado_settings
