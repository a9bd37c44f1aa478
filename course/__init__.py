"""The students' interface: a live ROS 2 session in the notebook's kernel, and a chapter's nodes, agent, figures."""

import sys
from typing import TYPE_CHECKING

from course import environment
from course.errors import CallTimeout, CourseError, LiveError, NodeFailed
from course.session.beginnings import begun

if TYPE_CHECKING:
    from IPython.core.interactiveshell import InteractiveShell

    from course.notebook.progress import Progress
    from course.returned.shown import Shown
    from course.session.live import Session

__all__ = ["CallTimeout", "CourseError", "LiveError", "NodeFailed", "check", "feedback", "live", "progress"]

environment.prepare()


def live() -> "Session":
    """Return the kernel's live session; the first call makes it, and adds the `%%exercise` magic."""
    # Imported here, so that the pure-Python parts of the course load no ROS.
    from course.session.live import live as session

    if (shell := _shell()) is not None:
        from course.notebook.extension import load_ipython_extension
        from course.session.live import current

        load_ipython_extension(shell)
        if current() is None:
            _tell_of_feedback()
    return session()


def check(name: str = "") -> None:
    """Run the notebook's public checks again: those called `name`, or all of them."""
    from course.notebook.checks import check as run

    run(name)
    _tell_of_feedback()


def feedback(cell: str = "") -> "Shown":
    """Return the newest feedback on this notebook's exercise, returned or released, for one cell or for all."""
    from course.returned.reading import feedback as read

    return read(cell)


def progress() -> "Progress":
    """Return the results of all sections' public checks, as last saved in the notebooks, with the points."""
    from course.notebook.progress import progress as read

    return read()


def _show_session() -> None:
    """Let JupyterLab's panels show the session that has begun in a kernel; files are compared before they start."""
    if _shell() is None:
        return
    from course.lab.kernel.start import start
    from course.notebook.file_differences import difference_of
    from course.session.started_nodes import before_start

    before_start[:] = [difference_of]
    start()


def _tell_of_feedback() -> None:
    """Print a line if feedback in the exchange has not been read yet."""
    from pathlib import Path

    from course.returned.reading import unread_line

    if said := unread_line(Path()):
        print(said)


def _shell() -> "InteractiveShell | None":
    """Return the running IPython shell, or None."""
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython else None


begun.append(_show_session)
