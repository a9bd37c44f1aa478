"""A message that a cell shows: all of it, unless it is huge, as one from a stranger's program may be."""

from typing import Any

from IPython.core.formatters import DisplayFormatter, PlainTextFormatter

LONGEST = 100_000  # characters, bytes or elements of a message that are shown whole
SHOWN = 1_000  # of a field that is cut


class Messages(PlainTextFormatter):
    """IPython's text of a cell's result, but cut if it is a huge message."""

    def __call__(self, result: Any) -> Any:
        """Return the text of a result."""
        return brief(result) if _is_message(result) and _size(result) > LONGEST else super().__call__(result)


def cut_messages(display: DisplayFormatter) -> None:
    """Have a shell cut huge messages."""
    before = display.formatters["text/plain"]
    after = Messages(parent=display)
    after.type_printers, after.deferred_printers = before.type_printers, before.deferred_printers
    display.formatters["text/plain"] = after


def brief(value: Any) -> str:
    """Return the text of a message, or of a value in it, with long fields cut."""
    if _is_message(value):
        fields = ", ".join(f"{name}={brief(getattr(value, name))}" for name in value.get_fields_and_field_types())
        return f"{type(value).__module__.rpartition('.')[0]}.{type(value).__name__}({fields})"
    if not hasattr(value, "__len__") or len(value) <= SHOWN:
        value = value.tolist() if hasattr(value, "tolist") else value  # an array, as rclpy writes it
        return f"[{', '.join(map(brief, value))}]" if isinstance(value, list) else repr(value)
    return f"{brief(value[:SHOWN])}... ({len(value) - SHOWN:,} more, with `print` you see all)"


def _is_message(value: Any) -> bool:
    return hasattr(type(value), "get_fields_and_field_types")


def _size(value: Any) -> int:
    if _is_message(value):
        return sum(_size(getattr(value, name)) for name in value.get_fields_and_field_types())
    if not hasattr(value, "__len__"):
        return 1
    count = len(value)
    return count if count > LONGEST or not isinstance(value, list) else sum(map(_size, value))
