"""The same fixtures as the autograder's own tests."""

from tests.autograder.conftest import box, grade

__all__ = ["box", "grade"]
