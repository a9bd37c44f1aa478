"""Checks of what a cell gives to a session: a wrong argument is reported at once."""

import difflib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import BuiltinMethodType
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

from course.errors import LiveError
from course.explaining.parameter_files import ROS_ARGS, unread_words
from course.explaining.source import text_at

OF_A_FILE = "ros__parameters"  # the key above a node's parameters in a parameter file
OF_START = ("parameters", "threads", "timeout")  # arguments of `ros.start`
ALIKE = 0.75  # least similarity of two names of an argument that should be the same


def expect_name(name: object, method: str, known: Mapping[str, Any]) -> None:
    """Raise LiveError unless `name` is text or None; `known` has the session's nodes by name."""
    if name is None or isinstance(name, str):
        return
    if isinstance(name, Node):
        meant = name.get_name()
    else:
        kind = name if isinstance(name, type) else type(name)
        found = (key for key, each in known.items() if each is name or kind in type(getattr(each, "node", None)).mro())
        meant = next(found, "name")
    raise LiveError(f"the name of a node or a file is text: write ros.{method}('{meant}')")


def no_node(what: object) -> str:
    """Return what to tell who starts something else than a class of nodes."""
    if not isinstance(what, type):
        return f"start() takes a Node class or the path of a Python file, not {type(what).__name__}"
    if what.__bases__ == (object,):
        how = f"write `class {what.__name__}(Node):`"
    else:
        how = f"derive {what.__name__} from Node (from rclpy.node)"
    return (
        f"start() takes a Node class or the path of a Python file, and {what.__name__} is a class without Node: {how}"
    )


def expect_service(service: object, srv_type: object, method: str) -> None:
    """Raise LiveError when the name of a service is not text, or stands in the place of its type."""
    if isinstance(service, str):
        return
    if isinstance(srv_type, str):
        kind = getattr(service, "__name__", "TheType")
        raise LiveError(f"first the name, then the type: write ros.{method}({srv_type!r}, {kind}, ...)")
    raise LiveError(f"the name of a service is text, such as ros.{method}('/add_two_ints', AddTwoInts, ...)")


def expect_request(request: object, service: str, srv_type: Any) -> None:
    """Raise LiveError for the fields of a request in a dict or a list, or one by one without their names."""
    if isinstance(request, srv_type.Request) or hasattr(request, "get_fields_and_field_types"):
        return
    if isinstance(request, Mapping):
        given = {name: repr(value) for name, value in request.items()}
    else:  # the value of the first field
        names = list(srv_type.Request.get_fields_and_field_types())
        given = dict.fromkeys(names, "...") | dict.fromkeys(names[:1], repr(request))
    written = ", ".join(f"{name}={value}" for name, value in given.items())
    raise LiveError(
        f"a request's fields are given by name: write ros.call('{service}', {srv_type.__name__}, {written})"
    )


def condition_of(given: object) -> Callable[[], object]:
    """Return the condition of a wait; raises LiveError unless it is a function, and when its value is a method."""
    if isinstance(given, Future):
        raise LiveError(
            "ros.until takes a function that it can call again and again. ros.wait(future) waits for a future, and "
            "returns its result"
        )
    if not callable(given):
        kind, how = f"a {type(given).__name__}: its value now", ""
        if isinstance(given, bool):
            kind = f"{given}, which stays so"
            how = "leave out the brackets after its last name, as in `ros.until(future.done)`, or "
        raise LiveError(
            f"ros.until takes a function that it can call again and again, and this is {kind}. To wait for a "
            f"condition, {how}write `lambda:` before it, as in `ros.until(lambda: len(scans) > 0)`"
        )

    def value() -> object:
        found = given()
        if inspect.ismethod(found) or isinstance(found, BuiltinMethodType):
            raise LiveError(
                f"the condition is the method `{found.__name__}` itself, which always counts as true: call it, "
                f"`{found.__name__}()`"
            )
        return found

    return value


def expect_of_a_file(file: str, threads: int, fields: Mapping[str, object]) -> None:
    """Raise LiveError for what only a class can be started with."""
    if fields:
        given = ", ".join(f"{name!r}: {value!r}" for name, value in fields.items())
        raise LiveError(
            f"a file is started with words of its command line, or with parameters: write "
            f"ros.start({file!r}, parameters={{{given}}})"
        )
    if threads != 1:
        raise LiveError(
            f"`threads` is for a class in this notebook. A file's program makes its executor itself: "
            f"MultiThreadedExecutor(num_threads={threads})"
        )


def expect_words(file: str, args: Sequence[object]) -> None:
    """Raise LiveError for parameters on a command line that its program would not read."""
    texts = [str(each) for each in args]
    words = [word for each in texts for word in (each.split() if each.startswith("-") else [each])]
    given = unread_words(words, text_at(Path(file)))
    joined = [each for each in texts if each.startswith((f"{ROS_ARGS} ", "-p "))]
    if given or joined:
        if given:
            words = [word for word in words if word != ROS_ARGS]
            words.insert(words.index(given.partition(" ")[0]), ROS_ARGS)
        raise LiveError(
            f"the program would not read `{given or joined[0]}`: write "
            f"ros.start({', '.join(map(repr, [file, *words]))})"
        )


def expect_of_a_class(cls: type, fields: Mapping[str, object], error: TypeError) -> None:
    """Raise LiveError if `error` says that the class does not take one of the arguments with a name, or needs more."""
    missing = re.match(
        rf"{re.escape(cls.__qualname__)}\.__init__\(\) missing \d+ required [\w-]+ arguments?: (.+)", str(error)
    )
    if missing:
        names = re.findall(r"'(\w+)'", missing[1])
        given = ", ".join(f"{each}=..." for each in names)
        raise LiveError(
            f"{cls.__name__} needs {' and '.join(names)}, which ros.start passes on: ros.start({cls.__name__}, {given})"
        ) from None
    found = re.search(r"__init__\(\) got an unexpected keyword argument '(\w+)'", str(error))
    if found and found[1] in fields and found[1] not in inspect.signature(cls).parameters:
        if near := difflib.get_close_matches(found[1], OF_START, 1, ALIKE):
            raise LiveError(
                f"{cls.__name__} takes no argument {found[1]!r}, and neither does ros.start. Did you mean `{near[0]}`?"
            ) from None
        raise LiveError(
            f"{cls.__name__} takes no argument {found[1]!r}. If it is a parameter of the node, write "
            f"ros.start({cls.__name__}, parameters={{{found[1]!r}: {fields[found[1]]!r}}})"
        ) from None


def expect_parameters(parameters: object) -> None:
    """Raise LiveError for anything but a dict of parameters, and for a dict in it."""
    if isinstance(parameters, Mapping) and any(isinstance(each, Mapping) for each in parameters.values()):
        raise LiveError(f"`parameters` must not contain nested dicts: write parameters={_flat(parameters)}")
    if parameters is not None and not isinstance(parameters, Mapping):
        raise LiveError(
            f"`parameters` is a dict of names and values, such as parameters={{'max_speed': 2.0}}, not a "
            f"{type(parameters).__name__}"
        )


def _flat(parameters: Mapping[Any, Any], above: str = "") -> dict[str, object]:
    """Return parameters without the levels of a parameter file, and with a full name for those of a group: `pid.kp`."""
    found: dict[str, object] = {}
    for name, value in parameters.items():
        if isinstance(value, Mapping):
            found |= _flat(value, "" if name == OF_A_FILE else f"{above}{name}.")
        else:
            found[f"{above}{name}"] = value
    return found
