"""Hints on values that do not fit where they are used: a message for its field, a time for a number of seconds."""

import re
import sys

import std_msgs.msg

FIT = re.compile(r"operand type|between instances of|argument must be|must be (?:a )?real number")
NUMBERS = {"int", "float"}


def unfit(found: re.Match[str], source: str) -> str:
    """Return the hint on an operand or an argument of the wrong type, by the names of the types in the error."""
    if not FIT.search(found.string):
        return ""
    kinds = re.findall(r"'(\w+)'", found.string) + re.findall(r"not (\w+)$", found.string)
    for kind in kinds:
        if kind in WITH_DATA and _is_message(kind, source):
            return f"This is the whole message: its value is in the field `data` of {kind}, as in `msg.data`."
    if "Duration" in kinds and NUMBERS.intersection(kinds) and not re.search(r"builtin_interfaces", source):
        return "A Duration is not a number: its seconds are `.nanoseconds / 1e9`."
    if kinds == ["Time", "Time"] and "for +" not in found.string:
        return OF_A_STAMP
    if "Time" in kinds and NUMBERS.intersection(kinds):
        return (
            "One is a time, and the other a number. Take both from the same clock: the difference of two "
            "`self.get_clock().now()` is a Duration, and its seconds are `.nanoseconds / 1e9`."
        )
    return ""


OF_A_STAMP = (
    "One of these is the message of a time, as `header.stamp` is. Make it a time of rclpy first: "
    "`Time.from_msg(msg.header.stamp)` (from rclpy.time)."
)


def time_without(found: re.Match[str], source: str) -> str:
    """Return the hint on an attribute that a time, or a duration, of rclpy does not have, or that only it has."""
    kind, name = found[1], found[2]
    if name == "nanoseconds":
        how = OF_A_STAMP.partition(". ")[2] if kind == "Time" else "Its fields are `.sec` and `.nanosec`."
        return f"This is a message, not a {kind} of rclpy. {how}"
    if name not in OF_A_TIME or "builtin_interfaces" in source:
        return ""
    if name not in ("sec", "nanosec") and re.search(r"\b(?:stamp|lifetime|time_from_start)\b", source):
        return ""  # which are messages
    return f"A {kind} of rclpy has `.nanoseconds`: its seconds are `.nanoseconds / 1e9`."


OF_A_TIME = (
    "sec",
    "secs",
    "seconds",
    "nanosec",
    "nsecs",
    "milliseconds",
    "microseconds",
    "to_sec",
    "to_seconds",
    "total_seconds",
)


def _with_data() -> set[str]:
    kinds = {name: getattr(std_msgs.msg, name) for name in dir(std_msgs.msg)}
    return {name for name, kind in kinds.items() if list(getattr(kind, "_fields_and_field_types", ())) == ["data"]}


WITH_DATA = _with_data()  # the names of the messages that hold a single value


def _is_message(name: str, source: str) -> bool:
    """Return True if a program, or the notebook, has imported this message of std_msgs."""
    imported = re.search(rf"from std_msgs\.msg import (?:\([^)]*|[^\n]*)\b{name}\b", source)
    used = getattr(sys.modules.get("__main__"), name, None)
    return bool(imported) or getattr(used, "__module__", "").startswith("std_msgs.")
