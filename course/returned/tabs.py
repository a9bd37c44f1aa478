"""The choice of nbgrader's tabs in JupyterLab: Assignments only if there is an exchange to list.

Loaded by JupyterLab's server through a setting written by environment/install.
"""

from typing import Any

from course.returned import nbgrader_exchange

ASSIGNMENTS, FORMGRADER, MENU = (f"@jupyter/nbgrader:{name}" for name in ("assignment-list", "formgrader", "menu"))


def page_config_hook(handler: object, page_config: dict[str, Any]) -> dict[str, Any]:
    """Disable tabs that cannot work here; JupyterLab's `page_config_hook`."""
    off = page_config["disabledExtensions"]
    try:
        works = nbgrader_exchange.folder() is not None
    except Exception:  # nbgrader's configuration cannot be loaded, which nbgrader itself reports
        works = True
    if not works:
        off = [*off, ASSIGNMENTS, *([MENU] if FORMGRADER in off else [])]  # the menu would be empty
    return page_config | {"disabledExtensions": off}
