"""Interfaces by name, messages to YAML or CSV, and messages from YAML, as in rosidl_runtime_py for ros2cli."""

import array
import importlib
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial, reduce
from pathlib import Path
from typing import Any, NamedTuple

from course.errors import NotInstalled, RosError, WrongKind

KINDS = ("msg", "srv", "action")
Message = Any  # an object of a generated message class; those come without types
Stamp = Callable[[Any], None]  # sets a field to a given time (builtin_interfaces/msg/Time)


class Limits(NamedTuple):
    """The limits on how much of a message is printed."""

    length: int | None = None  # longer arrays and strings are cut here
    no_arr: bool = False  # print only the type and length of an array
    no_str: bool = False  # print only the length of a string


ALL = Limits()


# --- types ---


def _load(identifier: str, kind: str, parts: tuple[str, ...]) -> Any:
    """Return the class `package/kind/Name`, or `package/Name`; it must have all of `parts`.

    Raises one of INVALID_TYPE if there is no such class of that kind.
    """
    words = identifier.split("/")
    if len(words) == 2:
        words.insert(1, kind)
    if len(words) < 3 or not all(words):
        raise ValueError(f"Expected the full name of an interface, got '{identifier}'")
    loaded = getattr(importlib.import_module(".".join(words[:-1])), words[-1])
    if not all(hasattr(loaded, part) for part in parts):
        raise WrongKind(f"Expected '{identifier}' to be a {kind}")
    return loaded


def get_message(identifier: str) -> Any:
    """Return the message class of this name; raises one of INVALID_TYPE."""
    return _load(identifier, "msg", ("SLOT_TYPES",))


def get_service(identifier: str) -> Any:
    """Return the service class of this name; raises one of INVALID_TYPE, or RosError for another kind of type."""
    try:
        return _load(identifier, "srv", ("Request", "Response"))
    except WrongKind:
        raise RosError("The passed type is not a service") from None


def get_action(identifier: str) -> Any:
    """Return the action class of this name; raises one of INVALID_TYPE."""
    return _load(identifier, "action", ("Goal", "Result", "Feedback"))


def get_prototype(identifier: str) -> Message:
    """Return a message, a service's request or an action's goal with its default values; raises one of INVALID_TYPE."""
    loaded = _load(identifier, "", ())
    return getattr(loaded, "Goal", getattr(loaded, "Request", loaded))()


INVALID_TYPE = (AttributeError, ModuleNotFoundError, ValueError)


# --- the packages' interfaces, from the ament index ---


def interface_packages() -> list[str]:
    """Return the packages that have interfaces."""
    from ament_index_python import get_resources

    return list(get_resources("rosidl_interfaces"))


def interfaces_of(package: str) -> list[str]:
    """Return the interfaces of a package as `kind/Name`, sorted; raises NotInstalled for an unknown package."""
    from ament_index_python import get_resource, has_resource

    if not has_resource("packages", package):
        raise NotInstalled(f"Unknown package '{package}'")
    if not has_resource("rosidl_interfaces", package):
        return []
    names = (Path(line) for line in get_resource("rosidl_interfaces", package)[0].splitlines())
    # rosidl's derived types (`Fibonacci_Goal`) have an underscore, which the name of an interface may not have.
    return sorted({str(name.with_suffix("")) for name in names if "_" not in str(name) and name.suffix != ".json"})


def all_types(kind: str) -> list[str]:
    """Return every interface of a kind (msg, srv or action) as `package/kind/Name`, sorted."""
    return [
        f"{package}/{name}"
        for package in sorted(interface_packages())
        for name in interfaces_of(package)
        if name.startswith(kind + "/")
    ]


def definition_path(identifier: str) -> Path:
    """Return the file that defines `package/kind/Name`.

    Raises ValueError for an invalid name and NotInstalled for one that is not installed, with ros2cli's messages.
    """
    words = identifier.split("/")
    if len(words) != 3:
        raise ValueError(f"Invalid name '{identifier}'. Expected three parts separated by '/'")
    if not all(words):
        raise ValueError(f"Invalid name '{identifier}'. Must not contain empty parts")
    if ".." in words:
        raise ValueError(f"Invalid name '{identifier}'. Must not contain '..'")
    from ament_index_python import has_resource

    prefix = has_resource("packages", words[0])
    if not prefix:
        raise NotInstalled(f"Unknown package '{words[0]}'")
    base = Path(prefix, "share", identifier)
    for suffix in (words[1], "idl"):
        path = base.with_name(f"{base.name}.{suffix}")
        if path.exists():
            return path
    raise NotInstalled(f"Could not find the interface '{path}'")


# --- messages to text ---


def _type_name(definition: Any) -> str:
    """Return the element type of a sequence, as in the .msg file."""
    if hasattr(definition, "typename"):
        return definition.typename
    if hasattr(definition, "namespaced_name"):
        return "/".join(definition.namespaced_name())
    return "wstring" if "WString" in type(definition).__name__ else "string"


def _length_only(value: Sequence[Any], definition: Any) -> str:
    """Return the text of an array for `--no-arr`."""
    name = _type_name(definition.value_type)
    if hasattr(definition, "size"):
        return f"<array type: {name}[{definition.size}]>"
    bound = f"[{definition.maximum_size}]" if hasattr(definition, "maximum_size") else ""
    return f"<sequence type: {name}{bound}, length: {len(value)}>"


def _is_sequence(value: object) -> bool:
    # A float64[9] is a numpy array; its elements are numpy's numbers, which have no dimensions.
    return isinstance(value, (list, tuple, array.array)) or getattr(value, "ndim", 0) > 0


def _cut(text: str, length: int | None) -> str:
    return text if length is None or len(text) <= length else text[:length] + "..."


def to_plain(value: Any, limits: Limits = ALL, definition: Any = None) -> Any:
    """Return a message, or the value of a field, as dicts, lists and YAML's scalars.

    `definition` is the field's type from rosidl_parser, which `no_arr` prints.
    """
    if hasattr(value, "SLOT_TYPES"):
        names = value.get_fields_and_field_types()
        return {
            name: to_plain(getattr(value, name), limits, slot)
            for name, slot in zip(names, value.SLOT_TYPES, strict=True)
        }
    if isinstance(value, bytes):
        return _cut(value.decode("latin-1"), limits.length)
    if isinstance(value, str):
        return f"<string length: <{len(value)}>>" if limits.no_str else _cut(value, limits.length)
    if hasattr(value, "item"):
        value = value.item() if getattr(value, "ndim", 1) == 0 else value
    if _is_sequence(value):
        if limits.no_arr and definition is not None:
            return _length_only(value, definition)
        plain = [to_plain(item, limits) for item in value[: limits.length]]
        return [*plain, "..."] if len(plain) < len(value) else plain
    return value


def to_yaml(message: Message, limits: Limits = ALL, *, flow_style: bool = False) -> str:
    """Return a message in YAML, its fields in the order of their definition."""
    return plain_to_yaml(to_plain(message, limits), flow_style=flow_style)


def plain_to_yaml(plain: dict[str, Any], *, flow_style: bool = False) -> str:
    """Return the result of `to_plain` in YAML; `flow_style` writes arrays in one line, but a message as a block."""
    import yaml

    class Dumper(yaml.Dumper):
        pass

    def represent(dumper: yaml.Dumper, fields: dict[str, Any]) -> yaml.MappingNode:
        pairs = [(dumper.represent_data(name), dumper.represent_data(value)) for name, value in fields.items()]
        return yaml.MappingNode("tag:yaml.org,2002:map", pairs)

    Dumper.add_representer(dict, represent)
    return yaml.dump(plain, Dumper=Dumper, allow_unicode=True, width=sys.maxsize, default_flow_style=flow_style)


def to_csv(message: Message, limits: Limits = ALL) -> str:
    """Return all of a message's fields, those of nested messages too, separated by commas.

    As in ros2cli there is no comma before the first text that is not empty: an empty array at the beginning of a
    message takes no column.
    """

    def joined(parts: Iterable[str]) -> str:
        return reduce(lambda line, part: f"{line},{part}" if line else part, parts, "")

    def text(value: Any, definition: Any = None) -> str:
        if hasattr(value, "SLOT_TYPES"):
            return to_csv(value, limits)
        if _is_sequence(value):
            if limits.no_arr and definition is not None:
                return _length_only(value, definition)
            cut = limits.length is not None and len(value) > limits.length
            return joined([*(text(item) for item in value[: limits.length]), *(["..."] if cut else [])])
        if isinstance(value, bytes) and limits.length is not None and len(value) > limits.length:
            return str(value[: limits.length] + b"...")
        return to_plain(value, limits) if isinstance(value, str) else str(value)

    names = message.get_fields_and_field_types()
    return joined(text(getattr(message, name), slot) for name, slot in zip(names, message.SLOT_TYPES, strict=True))


# --- text to messages ---


def fill(message: Message, values: Any, stamps: list[Stamp] | None = None) -> None:
    """Set the fields of a message from a YAML mapping.

    With `stamps`, `auto` for a std_msgs/Header and `now` for a Time are set later: for each, a function that sets the
    time is appended to `stamps`.  Raises AttributeError for an unknown field, and TypeError, ValueError or
    AssertionError for a value that does not fit.
    """
    if not isinstance(values, dict):
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a {type(values).__name__}")
    slots = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for before, (name, value) in zip([None, *values.values()], values.items(), strict=False):
        if value is None and isinstance(name, int) and isinstance(before, int):  # YAML's reading of {a: 1,5}
            raise ValueError(f"'{before},{name}': a number has a decimal point, as in {before}.{name}")
        if value is None and str(name).partition(":")[0] in slots:
            raise ValueError(f"'{name}': write a blank after the colon, as in '{str(name).replace(':', ': ', 1)}'")
        current = getattr(message, str(name))
        kind = type(current)
        if _is_sequence(current) and isinstance(value, (bool, int, float)):
            raise ValueError(f"'{name}' takes a list, even for a single value: {name}: {[value]}")
        if stamps is not None and value == "auto" and kind.__module__ == "std_msgs.msg._header":
            stamps.append(partial(setattr, current, "stamp"))
            continue
        if stamps is not None and value == "now" and kind.__module__ == "builtin_interfaces.msg._time":
            stamps.append(partial(setattr, message, name))
            continue
        setattr(message, name, _converted(value, current, slots.get(name), stamps))


def _converted(value: Any, current: Any, definition: Any, stamps: list[Stamp] | None) -> Any:
    """Return `value` in the type of a field whose current value is `current`."""
    kind = type(current)
    if hasattr(current, "SLOT_TYPES"):
        filled = kind()
        fill(filled, value, stamps)
        return filled
    if kind is array.array:
        return array.array(current.typecode, value)
    if kind.__module__ == "numpy":
        import numpy

        return numpy.array(value, dtype=current.dtype)
    if type(value) is not kind:
        value = kind(value)
    element: Any = getattr(definition, "value_type", None)
    if hasattr(element, "namespaces"):
        loaded = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
        items = [loaded() for _ in value]
        for item, item_values in zip(items, value, strict=True):
            fill(item, item_values, stamps)
        return items
    return value
