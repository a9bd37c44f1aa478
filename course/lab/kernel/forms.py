"""Forms made from an interface's type: the fields with their defaults, and the reader's input as values.

The page sends texts as they were typed, so that 64-bit numbers stay exact and all input is checked here.
"""

import contextlib
import json
import math
import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import yaml

from course.errors import LiveError
from course.explaining.interface_parts import type_name
from course.ros import messages

WHOLE = {
    f"{sign}int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
} | {"byte": (0, 255), "char": (0, 255)}
WHOLE["integer"] = WHOLE["int64"]  # of a parameter
TRUE, FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")
LOADERS = {
    "service": (messages.get_service, "Request"),
    "action": (messages.get_action, "Goal"),
    "topic": (messages.get_message, ""),
}
ITEMS = 10_000  # elements of a list at most


@dataclass(frozen=True)
class Interface:
    """A type, and its message class that a form fills in."""

    kind: str  # service, action or topic
    name: str  # package/srv/Name
    loaded: Any
    message: type[Any]


def interface(kind: str, name: str) -> Interface:
    """Return the type called `name`; raises LiveError when the kernel cannot import it."""
    load, part = LOADERS[kind]
    try:
        loaded = load(name)
    except (*messages.INVALID_TYPE, RuntimeError) as error:
        raise LiveError(
            f"this kernel cannot import {name} ({error}): build its package, or run the cell that writes it"
        ) from None
    return Interface(kind, name, loaded, getattr(loaded, part) if part else loaded)


def fields_of(message: type[Any]) -> list[dict[str, Any]]:
    """Return the fields of a form for a message: for each field its name, type, kind, default and choices.

    The kinds are `truth`, `scalar` (one line of text), `list` (of scalars, in a line of text), `message` (with
    `fields`) and `messages` (a list of messages, with the `fields` of each).
    """
    blank = message()
    texts = message.get_fields_and_field_types()
    found = []
    for (name, text), slot in zip(texts.items(), message.SLOT_TYPES, strict=True):
        shown: dict[str, Any] = {"name": name, "type": type_name(text)}
        element = getattr(slot, "value_type", slot)
        value = getattr(blank, name)
        if hasattr(element, "namespaces"):
            nested = _loaded(element)
            shown |= {"kind": "message" if element is slot else "messages", "fields": fields_of(nested)}
            shown["length"] = getattr(slot, "size", None)
        elif element is not slot:
            shown |= {"kind": "list", "default": listed(value)}
        elif isinstance(value, bool):
            shown |= {"kind": "truth", "default": value}
        else:
            shown |= {"kind": "scalar", "default": _text(value), "choices": _choices(message, name, value)}
        found.append(shown)
    return found


def _loaded(element: Any) -> type[Any]:
    loaded: type[Any] = messages.get_message("/".join([*element.namespaces, element.name]))
    return loaded


def _text(value: Any) -> str:
    """Return the text that a form shows for a scalar."""
    return str(value[0] if isinstance(value, bytes) else value)


def listed(values: Iterable[Any]) -> str:
    """Return the text that a form shows for a list, which `scalars` reads as the same values."""
    return ", ".join(_quoted(value) if isinstance(value, str) else _text(value) for value in values)


def _quoted(text: str) -> str:
    """Return a text as it is written in a list: in quotes if it would be read as something else."""
    with contextlib.suppress(ValueError):
        if text.isprintable() and scalars("string", text) == [text]:
            return text
    return json.dumps(text, ensure_ascii=False)


def _choices(message: type[Any], name: str, value: object) -> dict[str, str]:
    """The constants of the definition that belong to a field: those that begin with its name, or else, when no other
    field has their type, all of them.
    """  # fmt: skip
    constants = {
        each: getattr(message, each)
        for each in dir(message)
        if each.isupper() and each != "SLOT_TYPES" and type(getattr(message, each)) is type(value)
    }
    if own := {each for each in constants if each.startswith(name.upper() + "_")}:
        constants = {each: constants[each] for each in own}
        alike = [name]
    else:
        blank = message()
        fields = message.get_fields_and_field_types()
        alike = [each for each in fields if type(getattr(blank, each)) is type(value)]
    by_value = sorted(constants.items(), key=lambda pair: pair[1])
    return {each: _text(constant) for each, constant in by_value} if alike == [name] else {}


@dataclass
class Filled:
    """A form filled in by the reader."""

    values: dict[str, Any] = field(default_factory=dict)  # those changed, and every top-level scalar
    wrong: dict[str, str] = field(default_factory=dict)  # corrections by the path of the field: pose.position.x


def fill(message: type[Any], given: Mapping[str, Any]) -> Filled:
    """Read the input of a form for `message`; a missing field keeps its default."""
    filled = Filled()
    filled.values = _read(message, given, "", filled.wrong)
    return filled


def message_of(message: type[Any], filled: Filled) -> Any:
    """Return the message of a form; raises LiveError when the form has an error."""
    if filled.wrong:
        raise LiveError("\n".join(f"{path}: {why}" for path, why in filled.wrong.items()))
    made = message()
    messages.fill(made, filled.values)
    return made


def _read(message: type[Any], given: Mapping[str, Any], path: str, wrong: dict[str, str]) -> dict[str, Any]:
    blank, values = message(), {}
    for (name, text), slot in zip(message.get_fields_and_field_types().items(), message.SLOT_TYPES, strict=True):
        here = f"{path}.{name}" if path else name
        element = getattr(slot, "value_type", slot)
        default = _plain(getattr(blank, name))
        try:
            if name not in given:
                value = default
            elif hasattr(element, "namespaces"):
                value = _nested(_loaded(element), given[name], here, wrong, alone=element is slot)
            elif element is slot:
                value = scalar(type_name(text), given[name], getattr(slot, "maximum_size", None))
            else:
                longest = getattr(element, "maximum_size", None)
                value = scalars(type_name(text).partition("[")[0], str(given[name]), longest)
            if element is not slot:
                _check_length(slot, value)
        except ValueError as error:
            wrong[here] = str(error)
            continue
        shown = element is slot and not hasattr(element, "namespaces") and not path
        if shown or (value != default and value != {}):
            values[name] = value
    return values


def _plain(value: Any) -> Any:
    """Return a default in the form for `fill` of `course.ros.messages`, which expects a byte as bytes."""
    if isinstance(value, bytes) or (isinstance(value, list) and value and isinstance(value[0], bytes)):
        return value
    return messages.to_plain(value)


def _nested(message: type[Any], given: Any, path: str, wrong: dict[str, str], *, alone: bool) -> Any:
    if alone:
        return _read(message, given, path, wrong)
    return [_read(message, each, f"{path}.{number}", wrong) for number, each in enumerate(given[:ITEMS])]


def scalar(kind: str, given: Any, longest: int | None = None) -> Any:
    """Parse a text as a value of a type, named as in a definition, or of a parameter's: integer, double or boolean.

    Raises ValueError that says what to write.
    """
    text = str(given)
    if kind in ("bool", "boolean"):
        if text.strip().casefold() not in TRUE + FALSE:
            raise ValueError(f"write true or false: {text!r} is neither")
        return text.strip().casefold() in TRUE
    if kind in WHOLE:
        return _whole(kind, text)
    if kind.startswith(("float", "double")):
        return _real(kind, text)
    if longest is not None and len(text) > longest:
        raise ValueError(f"write at most {longest} characters: it has {len(text)}")
    return text


def _whole(kind: str, text: str) -> int | bytes:
    least, most = WHOLE[kind]
    if not re.fullmatch(r"[-+]?\d{1,30}", text.strip()):
        raise ValueError(f"write a whole number: {_refused(kind, text)}")
    if not least <= (value := int(text)) <= most:
        raise ValueError(f"write a number from {least} to {most}: {text.strip()} does not fit {kind}")
    return bytes([value]) if kind == "byte" else value


def _refused(kind: str, text: str) -> str:
    return f"{kind} does not accept {text.strip()!r}" if text.strip() else "the field is empty"


def _real(kind: str, text: str) -> float:
    try:
        value = float(text.strip().replace(".inf", "inf").replace(".nan", "nan"))  # accepts YAML's forms, too
    except ValueError:
        comma = ": write a point, not a comma" if re.fullmatch(r"\s*-?\d+,\d+\s*", text) else ""
        raise ValueError(f"write a number: {_refused(kind, text)}{comma}") from None
    if kind == "float32" and math.isfinite(value):
        try:
            struct.pack("<f", value)
        except OverflowError:
            raise ValueError(f"write a number below 3.4e38: {text.strip()} does not fit float32") from None
    return value


def scalars(kind: str, text: str, longest: int | None = None) -> list[Any]:
    """Parse a text as a list of values; raises ValueError that says what to write."""
    if not text.strip().startswith("["):
        text = f"[{text}]"
    if "string" in kind:
        items = _texts(text)
    elif text.strip().endswith("]"):
        items = [each for each in text.strip()[1:-1].split(",") if each.strip()]
    else:
        raise ValueError("end the list with ], or leave out both brackets")
    if len(items) > ITEMS:
        raise ValueError(f"write at most {ITEMS} values here")
    values = []
    for number, item in enumerate(items):
        try:
            values.append(scalar(kind, item, longest))
        except ValueError as error:
            raise ValueError(f"value {number + 1}: {error}") from None
    return values


def _texts(text: str) -> list[str]:
    try:
        found = yaml.load(text, yaml.BaseLoader)  # BaseLoader keeps every scalar as text
    except yaml.YAMLError:
        found = None
    if not isinstance(found, list) or not all(isinstance(each, str) for each in found):
        raise ValueError('separate the texts by commas; put one with a comma or a bracket in it in quotes: "a, b", c')
    return found


def _check_length(slot: Any, value: list[Any]) -> None:
    if (size := getattr(slot, "size", None)) is not None and len(value) != size:
        raise ValueError(f"write exactly {size} values: there are {len(value)}")
    if (most := getattr(slot, "maximum_size", None)) is not None and len(value) > most:
        raise ValueError(f"write at most {most} values: there are {len(value)}")
