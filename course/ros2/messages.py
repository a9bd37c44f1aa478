"""Interfaces by name, and messages as YAML, CSV and back: what ros2cli takes from rosidl_runtime_py."""

import array
import importlib
import sys
from pathlib import Path

KINDS = ("msg", "srv", "action")


# --- types ---


def _load(identifier: str, kind: str, parts: tuple[str, ...]):
    """Return the class `package/kind/Name`, or `package/Name`.

    Raises ValueError, ModuleNotFoundError or AttributeError if there is none of that kind.
    """
    words = identifier.split("/")
    if len(words) == 2:
        words.insert(1, kind)
    if len(words) < 3 or not all(words):
        raise ValueError(f"Expected the full name of an interface, got '{identifier}'")
    loaded = getattr(importlib.import_module(".".join(words[:-1])), words[-1])
    if not all(hasattr(loaded, part) for part in parts):
        raise ValueError(f"Expected '{identifier}' to be a {kind}")
    return loaded


def get_message(identifier: str):
    """Return the message class of that name; raises as `_load`."""
    return _load(identifier, "msg", ("SLOT_TYPES",))


def get_service(identifier: str):
    """Return the service class of that name; raises as `_load`."""
    return _load(identifier, "srv", ("Request", "Response"))


def get_action(identifier: str):
    """Return the action class of that name; raises as `_load`."""
    return _load(identifier, "action", ("Goal", "Result", "Feedback"))


INVALID_TYPE = (AttributeError, ModuleNotFoundError, ValueError)


# --- the packages' interfaces, from the ament index ---


def interface_packages() -> list[str]:
    """Return the packages that have interfaces."""
    from ament_index_python import get_resources

    return list(get_resources("rosidl_interfaces"))


def interfaces_of(package: str) -> list[str]:
    """Return a package's interfaces as `kind/Name`, sorted; raises LookupError for a package that is not there."""
    from ament_index_python import get_resource, has_resource

    if not has_resource("packages", package):
        raise LookupError(f"Unknown package '{package}'")
    if not has_resource("rosidl_interfaces", package):
        return []
    names = (Path(line) for line in get_resource("rosidl_interfaces", package)[0].splitlines())
    # What rosidl derives (`Fibonacci_Goal`) has an underscore, which no interface's own name may have.
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

    Raises ValueError for a malformed name and LookupError for one that is not installed, with ros2cli's messages.
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
        raise LookupError(f"Unknown package '{words[0]}'")
    base = Path(prefix, "share", identifier)
    for suffix in (words[1], "idl"):
        path = base.with_name(f"{base.name}.{suffix}")
        if path.exists():
            return path
    raise LookupError(f"Could not find the interface '{path}'")


# --- messages to text ---


def _type_name(definition) -> str:
    """Return a sequence's element type as its .msg file has it."""
    if hasattr(definition, "typename"):
        return definition.typename
    if hasattr(definition, "namespaced_name"):
        return "/".join(definition.namespaced_name())
    return "wstring" if "WString" in type(definition).__name__ else "string"


def _length_only(value, definition) -> str:
    """Return what `--no-arr` shows of an array."""
    name = _type_name(definition.value_type)
    if hasattr(definition, "size"):
        return f"<array type: {name}[{definition.size}]>"
    bound = f"[{definition.maximum_size}]" if hasattr(definition, "maximum_size") else ""
    return f"<sequence type: {name}{bound}, length: {len(value)}>"


def _is_sequence(value) -> bool:
    return isinstance(value, (list, tuple, array.array)) or type(value).__module__ == "numpy"


def to_plain(value, definition=None, *, length: int | None = None, no_arr: bool = False, no_str: bool = False):
    """Return a message, or a field's value, as dicts, lists and YAML's scalars; `length` truncates what is longer."""
    limits = {"length": length, "no_arr": no_arr, "no_str": no_str}
    if hasattr(value, "SLOT_TYPES"):
        names = value.get_fields_and_field_types()
        return {
            name: to_plain(getattr(value, name), slot, **limits)
            for name, slot in zip(names, value.SLOT_TYPES, strict=True)
        }
    if isinstance(value, bytes):
        value = value.decode("latin-1")
        return value if length is None or len(value) <= length else value[:length] + "..."
    if isinstance(value, str):
        if no_str:
            return f"<string length: <{len(value)}>>"
        return value if length is None or len(value) <= length else value[:length] + "..."
    if hasattr(value, "item"):
        value = value.item() if getattr(value, "ndim", 1) == 0 else value
    if _is_sequence(value):
        if no_arr and definition is not None:
            return _length_only(value, definition)
        cut = length is not None and len(value) > length
        plain = [to_plain(item, **limits) for item in (value[:length] if cut else value)]
        return [*plain, "..."] if cut else plain
    return value


def to_yaml(message, *, flow_style: bool = False, **limits) -> str:
    """Return a message in YAML, fields in the order of their definition."""
    import yaml

    return yaml.dump(
        to_plain(message, **limits),
        sort_keys=False,
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow_style,
    )


def to_csv(message, *, length: int | None = None, no_arr: bool = False, no_str: bool = False) -> str:
    """Return all of a message's fields, recursively, separated by commas."""
    limits = {"length": length, "no_arr": no_arr, "no_str": no_str}

    def text(value, definition=None) -> str:
        if hasattr(value, "SLOT_TYPES"):
            return to_csv(value, **limits)
        if _is_sequence(value):
            if no_arr and definition is not None:
                return _length_only(value, definition)
            cut = length is not None and len(value) > length
            return ",".join([text(item) for item in value[:length]] + (["..."] if cut else []))
        if isinstance(value, bytes) and length is not None and len(value) > length:
            return str(value[:length] + b"...")
        if isinstance(value, str):
            return to_plain(value, length=length, no_str=no_str)
        return str(value)

    return ",".join(
        text(getattr(message, name), slot)
        for name, slot in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True)
    )


# --- text to messages ---


def fill(message, values, stamps: list | None = None) -> None:
    """Set a message's fields from a YAML mapping.

    With `stamps`, `auto` for a std_msgs/Header and `now` for a Time are left for later: a function that sets the time
    is appended to it.  Raises AttributeError for an unknown field, TypeError, ValueError or AssertionError for a value
    that does not fit.
    """
    if not isinstance(values, dict):
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a {type(values).__name__}")
    slots = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in values.items():
        current = getattr(message, str(name))
        kind = type(current)
        if stamps is not None and value == "auto" and kind.__module__ == "std_msgs.msg._header":
            stamps.append(lambda now, header=current: setattr(header, "stamp", now))
            continue
        if stamps is not None and value == "now" and kind.__module__ == "builtin_interfaces.msg._time":
            stamps.append(lambda now, name=name: setattr(message, name, now))
            continue
        setattr(message, name, _converted(value, current, slots.get(name), stamps))


def _converted(value, current, definition, stamps):
    """Return `value` as the type of a field whose present value is `current`."""
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
    element = getattr(definition, "value_type", None)
    if hasattr(element, "namespaces"):
        loaded = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
        items = [loaded() for _ in value]
        for item, item_values in zip(items, value, strict=True):
            fill(item, item_values, stamps)
        return items
    return value
