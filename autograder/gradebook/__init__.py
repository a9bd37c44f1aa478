"""nbgrader: the course's configuration and plug-ins, the gradebook, lateness, exports and releases."""

import importlib
import sys
from functools import partial
from types import ModuleType

SERVER_EXTENSIONS = ("assignment_list", "course_list", "formgrader", "validate_assignment")
LOAD = "load_jupyter_server_extension"


def _import_nbgrader() -> None:
    """Import nbgrader without its extensions of the Jupyter server, which commands do not need, and which take long.

    A server that loads them later gets them.
    """
    places = [f"nbgrader.server_extensions.{name}" for name in SERVER_EXTENSIONS]
    if "nbgrader" in sys.modules:
        return
    for place in places:
        sys.modules[place] = ModuleType(place)
        vars(sys.modules[place])[LOAD] = partial(_load, place)
    try:
        importlib.import_module("nbgrader")
    finally:
        for place in places:
            del sys.modules[place]


def _load(place: str, app: object) -> None:
    vars(importlib.import_module(place))[LOAD](app)


_import_nbgrader()
