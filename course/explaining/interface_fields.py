"""The fields of the interfaces that a text imports."""

import ast
import importlib

from course.explaining.source import name_of
from course.foundation.syntax import walk


def fields_of(tree: ast.AST, kind: ast.expr | None, part: str = "") -> dict[str, str]:
    """Return the fields, with their types, of a type that a text imports, or of its part, such as 'Response'.

    {} for a type that the text does not import, or that is not there.
    """
    for node in walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and name_of(kind) in {each.name for each in node.names}:
            try:
                made = getattr(importlib.import_module(node.module), name_of(kind))
                fields: dict[str, str] = (getattr(made, part) if part else made).get_fields_and_field_types()
            except (ImportError, AttributeError):
                return {}
            return fields
    return {}
