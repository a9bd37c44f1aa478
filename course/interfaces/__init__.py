"""The course's ROS interface packages, and building a student's own `.srv`, `.msg` or `.action` at run time."""

from course.errors import InterfaceError
from course.interfaces.builder import Built, build, cache_folder
from course.interfaces.definition import Definition, Field, parse

__all__ = ["Built", "Definition", "Field", "InterfaceError", "build", "cache_folder", "parse"]
