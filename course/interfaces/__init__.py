"""The course's ROS interface packages, and building a student's own `.srv`, `.msg` or `.action` at run time."""

from .builder import Built, build, cache_folder
from .definition import Definition, Field, InterfaceError, parse

__all__ = ["Built", "Definition", "Field", "InterfaceError", "build", "cache_folder", "parse"]
