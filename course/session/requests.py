"""Converts values from a cell to a request or a command line."""

import contextlib
import importlib
from collections.abc import Mapping
from typing import Any

import yaml

from course.errors import LiveError
from course.explaining.arguments import half, type_of
from course.explaining.interface_parts import type_name

REQUEST = "_Request"


def service_type(given: Any) -> Any:
    """Return the type of a service that a cell gives for a call, as its definition was built last.

    Raises LiveError when it is something else.
    """
    kind = given if isinstance(given, type) else type(given)
    if kind is str:
        name = given.rpartition("/")[2]
        raise LiveError(f"the type of a call is a class, not text: write {name} without quotes, and import it first")
    if not isinstance(given, type) and type_of(kind.__name__):
        fields = given.get_fields_and_field_types()
        values = "".join(f", {name}={getattr(given, name)!r}" for name in fields)
        whole = type_of(kind.__name__)
        raise LiveError(
            f"give the type of the service, `{whole}`, and not a message of it. A call takes the type, and then the "
            f"fields of the request by name: ros.call(name, {whole}{values if kind.__name__.endswith(REQUEST) else ''})"
        )
    if not hasattr(given, "Request"):
        raise LiveError(half(kind.__name__) or f"{kind.__name__} is not the type of a service, such as AddTwoInts")
    with contextlib.suppress(ImportError, ValueError):
        return getattr(importlib.import_module(kind.__module__.rpartition("._")[0]), kind.__name__, kind)
    return given


def fill(srv_type: type[Any], fields: Mapping[str, object]) -> Any:
    """Return a request of `srv_type` with these fields; raises LiveError for an unknown field or an unfit value."""
    request = srv_type.Request()
    known = request.get_fields_and_field_types()
    for name, value in fields.items():
        if name not in known:
            listed = ", ".join(f"{field} ({type_name(kind)})" for field, kind in known.items()) or "no fields"
            raise LiveError(f"{srv_type.__name__} has no request field '{name}': it has {listed}")
        try:
            whole = known[name] in ("double", "float") and isinstance(value, int)
            setattr(request, name, float(value) if whole else value)  # type: ignore[arg-type]
        except (AssertionError, TypeError, ValueError) as error:
            if any(
                hasattr(each, "to_parameter_msg") for each in (value if isinstance(value, list | tuple) else [value])
            ):
                raise LiveError(
                    f"{srv_type.__name__}.{name} holds messages, but this is a parameter of rclpy: write "
                    "`.to_parameter_msg()` after it, as in [Parameter('max_speed', value=2.0).to_parameter_msg()]"
                ) from None
            plain = "field must be of type" in str(error)  # repeats the message
            why = f"which is a {type(value).__name__}" if plain else error
            kind = type_name(known[name])
            if kind.endswith("]") and isinstance(value, (bool, int, float, str)):
                raise LiveError(
                    f"{srv_type.__name__}.{name} must be {kind}, a list, even for a single value: {name}={[value]}"
                ) from None
            raise LiveError(
                f"{srv_type.__name__}.{name} must be {kind}, not {value!r}{',' if plain else ':'} {why}"
            ) from None
    return request


def argument(value: object) -> str:
    """Return a parameter's value as YAML in one line, for `-p name:=value`."""
    return yaml.safe_dump(value, default_flow_style=True, width=10**6).strip().removesuffix("\n...").strip()
