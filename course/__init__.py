"""What a student imports: a live ROS 2 session inside the notebook's kernel, and the chapter's nodes, agent and figures."""

from course import environment
from course.errors import CallTimeout, CourseError, LiveError

__all__ = ["CallTimeout", "CourseError", "LiveError", "check", "live"]

environment.prepare()


def live():
    """The kernel's live session (`course.live.session.Session`), made at the first call; adds the `%%exercise` magic."""
    # Here, so that the pure-Python parts of the course load no ROS.
    from course.live.session import live as session
    from course.notebook.exercise import register

    register()
    return session()


def check(name=""):
    """Run the notebook's public checks again: those called `name`, or all (`course.notebook.checks.check`)."""
    from course.notebook.checks import check as run

    run(name)
