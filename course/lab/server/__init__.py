"""The Jupyter server extension: it relays pages to kernels, and hands in.  `environment/install` enables it."""

import os

from jupyter_server.serverapp import ServerApp
from jupyter_server.utils import url_path_join

from course.lab import protocol
from course.lab.server import front, parts_of_pages, shown_files
from course.lab.server.exercise_state import Exercise, Reset
from course.lab.server.front import Front
from course.lab.server.handing_in import HandingIn
from course.lab.server.prompts import Prompts
from course.lab.server.relay import Relay

FORMGRADER = "nbgrader.server_extensions.formgrader"  # loaded after this extension: by name


def _jupyter_server_extension_points() -> list[dict[str, str]]:
    return [{"module": "course.lab.server"}]


def _load_jupyter_server_extension(server: ServerApp) -> None:
    if os.environ.get("COURSE_ARRANGE"):  # set by environment/start
        server.web_app.settings.setdefault("page_config_data", {})["rosCourseArrange"] = "true"
    front.begin()
    parts_of_pages.guard()
    shown_files.guard()
    if server.jpserver_extensions.get(FORMGRADER):
        from course.lab.server import formgrader  # takes a second to load

        formgrader.guard()
    Prompts(server)
    base = server.web_app.settings["base_url"]
    handlers = [
        (url_path_join(base, rf"/course/lab/(?P<kernel_id>{protocol.KERNEL_ID})"), Relay),
        (url_path_join(base, "/course/hand-in"), HandingIn),
        (url_path_join(base, "/course/exercise"), Exercise),
        (url_path_join(base, "/course/front"), Front),
        (url_path_join(base, "/course/exercise/reset"), Reset),
    ]
    server.web_app.add_handlers(".*$", handlers)
