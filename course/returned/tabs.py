"""The choice of nbgrader's tabs in JupyterLab: Assignments only where there is an exchange that it can list.

Loaded by JupyterLab's server, in a setting that environment/install writes.
"""

from typing import Any

from course.returned import nbgrader_exchange

ASSIGNMENTS, FORMGRADER, MENU = (f"@jupyter/nbgrader:{name}" for name in ("assignment-list", "formgrader", "menu"))


def page_config_hook(handler: object, page_config: dict[str, Any]) -> dict[str, Any]:
    """JupyterLab's `page_config_hook`: leave out what could only say that it does not work."""
    off = page_config["disabledExtensions"]
    try:
        works = nbgrader_exchange.folder() is not None
    except Exception:  # a configuration of nbgrader's that cannot be loaded: nbgrader says so itself
        works = True
    if not works:
        off = [*off, ASSIGNMENTS, *([MENU] if FORMGRADER in off else [])]  # a menu with nothing in it
    return page_config | {"disabledExtensions": off}
