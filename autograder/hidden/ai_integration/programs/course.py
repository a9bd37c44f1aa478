"""Stands in for the course's library, which no robot has: laid beside a student's files that import it for nothing.

So a line that was left in costs what it is worth, and all else can be judged.  Whatever is imported from here raises
the error that the import itself raises on a robot, as soon as it is used.
"""

import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any, NoReturn

ERROR = "No module named 'course'"


class Absent:
    """Something that a robot does not have."""

    def __call__(self, *_: object, **__: object) -> NoReturn:
        """Raise what the import raises on a robot."""
        raise ModuleNotFoundError(ERROR, name="course")

    def __mro_entries__(self, bases: tuple[Any, ...]) -> NoReturn:
        raise ModuleNotFoundError(ERROR, name="course")

    def __getattr__(self, name: str) -> Any:
        return __getattr__(name)


def __getattr__(name: str) -> Any:
    """Any name can be imported, but not used."""
    if name.startswith("__"):
        raise AttributeError(name)
    return Absent()


class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds every module of the course, with nothing in it."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """A module of the course, which is a package too."""
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if name.startswith("course.") else None

    def exec_module(self, module: ModuleType) -> None:
        """Any name can be imported from it."""
        module.__dict__["__getattr__"] = __getattr__


__path__: list[str] = []
sys.meta_path.insert(0, Finder())
