"""The configuration that older course folders load by this file's path: `autograder release` wrote that into them."""

from autograder.gradebook.config import apply

apply(get_config())  # type: ignore[name-defined]  # noqa: F821  nbgrader's loader defines it
