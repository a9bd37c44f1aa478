"""For every test: the course comes first, because it prepares the environment that message classes read."""

import course  # noqa: F401
