"""Hints on values that do not fit where they are used: a message for its field, a number in the place of a function."""

import ast
import builtins
import re
import sys
from collections.abc import Iterator

import std_msgs.msg

from course.foundation.syntax import walk

FIT = re.compile(r"operand type|between instances of|argument must be|must be (?:a )?real number")
NUMBERS = {"int", "float"}
GIVE_NUMBERS = ("abs", "float", "int", "len", "max", "min", "pow", "round", "sum")  # of Python's own functions


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


CLOCKS = re.compile(r"\btime\.(?:time|monotonic|perf_counter)\(\)|\b(?:monotonic|perf_counter)\(\)")


def duration_and_number(found: re.Match[str], source: str, code: str) -> str:
    """Return the hint on a comparison of a Duration with a number: what its number is made of, if that is seen."""
    elsewhere = not found[1] and not re.search(r"\d|\bnow\(", code)  # the number was made in another line
    if clock := CLOCKS.search(code) or (CLOCKS.search(source) if elsewhere else None):
        return (
            f"`{clock[0]}` is a number of seconds, and this is compared with a Duration. Write "
            "`self.get_clock().now()` in both places, where the time is kept and where its age is asked for: the "
            "difference is a Duration."
        )
    if re.search(r"\.nanoseconds\b", code):
        return "`.nanoseconds` is a number, and this is compared with a Duration: leave it out, and what divides it."
    return "Compare a duration with a duration, as in `age <= Duration(seconds=0.5)` (from rclpy.duration)."


OF_A_STAMP = (
    "One of these is the message of a time, as `header.stamp` is. Make it a time of rclpy first: "
    "`Time.from_msg(msg.header.stamp)` (from rclpy.time)."
)


def product(call: ast.Call) -> str:
    """Return the product for which a call may be meant, as `kp * error` for `kp(error)`; '' if none is possible."""
    if len(call.args) != 1 or call.keywords or not _may_be_a_number(call.args[0]):
        return ""
    sides = (call.func, call.args[0])
    return " * ".join(f"({ast.unparse(each)})" if isinstance(each, ast.BinOp) else ast.unparse(each) for each in sides)


def _may_be_a_number(value: ast.expr) -> bool:
    if isinstance(value, ast.Constant):
        return type(value.value) in (int, float)
    if isinstance(value, ast.UnaryOp):
        return isinstance(value.op, ast.USub) and _may_be_a_number(value.operand)
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and hasattr(builtins, value.func.id):
        return value.func.id in GIVE_NUMBERS
    return isinstance(value, (ast.Attribute, ast.BinOp, ast.Call, ast.Name, ast.Subscript))


def called_numbers(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the numbers that a text calls as a function, and a sentence: `1.5(0.6 - right)`."""
    for call in (node for node in walk(tree) if isinstance(node, ast.Call)):
        number = call.func.value if isinstance(call.func, ast.Constant) else None
        if isinstance(number, (int, float)) and not isinstance(number, bool) and (how := product(call)):
            yield call.lineno, f"the number {number} is not a function. To multiply, write `{how}`."


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
