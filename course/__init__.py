"""What a student imports: a live ROS 2 session inside the notebook's kernel, and the chapter's nodes, agent and figures."""

from . import environment

environment.prepare()


def live():
    """The kernel's live session (`course.session.Session`), made at the first call; adds the `%%exercise` magic."""
    from .session import live as session  # here, so that the pure-Python parts of the course load no ROS
    return session()


def check(name=""):
    """Run the notebook's public checks again: those called `name`, or all (`course.checks.check`)."""
    from .checks import check as run
    run(name)


def __getattr__(name: str):
    if name in ("CallTimeout", "LiveError"):
        from . import session
        return getattr(session, name)
    raise AttributeError(f"module 'course' has no attribute '{name}'")
