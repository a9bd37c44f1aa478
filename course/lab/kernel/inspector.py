"""The inspector: a form to call a service, send a goal, publish a message or set a parameter, and the result."""

from collections import Counter
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.action import get_action_names_and_types
from rclpy.parameter import Parameter, parameter_value_to_python

from course.errors import LiveError
from course.foundation.untrusted import all_visible
from course.lab import protocol
from course.lab.kernel import exchange, forms, programs, sending, traffic
from course.lab.kernel.nodes import of_interest, of_usual_length, session
from course.lab.kernel.panels import Changes, Panels, Topic
from course.ros.names import SEND, TYPE_NAMES, own_first
from course.session.live import Session, current

ANSWER = 5.0  # s
LONGEST = 3600.0  # s that a reader may choose to wait
FORM = protocol.LINE // 2  # bytes of a node's parameters; what does not fit is left out
ARRAY = " array"
# Those that a form can set, by their numbers.
PARAMETER_TYPES = {number: name for number, name in enumerate(TYPE_NAMES) if name not in ("not set", f"byte{ARRAY}")}
PARAMETER = "parameter"
RATE, LIMIT = "(rate)", "(limit)"  # cannot be the names of a message's fields


def add(panels: Panels) -> None:
    """Add the panel's methods and topics."""
    panels.methods |= {
        "inspector.form": form,
        "inspector.look": look,
        "inspector.send": send,
        "inspector.cancel": lambda number: exchange.find(number).cancel(),
        "inspector.latest": exchange.latest,
        "inspector.restart_server": restart_server,
    }
    panels.topics |= {
        "inspector": Topic(lambda: Changes(offers), 0.5),
        "inspector.exchange": Topic(exchange.Followed, 0.1),
        "inspector.exchanges": Topic(traffic.Summaries, 0.25),
        "inspector.unseen": Topic(lambda: Changes(traffic.unseen), 1.0),
    }


def restart_server(service: str) -> None:
    """Restart the server of `service` in the session; raises LiveError when that is impossible."""
    session().restart_server(service)


def offers() -> dict[str, Any]:
    """Return the possible receivers with their types, by kind; for parameters, the nodes.

    "several" has a sentence for each of which there are several, by its kind and name: "service /add_two_ints".
    It is empty without a session.
    """
    if (live := current()) is None:
        return {kind: [] for kind in (*forms.LOADERS, PARAMETER)} | {"several": {}}
    count = live.node.count_services
    nodes = Counter(row.name for row in live.rows() if row.alive and row.name.startswith("/"))  # not yet: its file's
    services = _of_interest([each for each in live.node.get_service_names_and_types() if count(each[0])])
    actions = _of_interest([each for each in get_action_names_and_types(live.node) if count(f"{each[0]}{SEND}")])
    several = {f"service {name}": _servers(live, name) for name, _ in services if count(name) > 1}
    several |= {f"action {name}": _servers(live, name) for name, _ in actions if count(f"{name}{SEND}") > 1}
    several |= {
        f"{PARAMETER} {name}": f"{number} nodes have this name: {_any_of(number)} may answer. Nodes shows where each "
        "runs: stop one, or give it another name."
        for name, number in nodes.items()
        if number > 1
    }
    return {
        "service": services,
        "action": actions,
        "topic": _of_interest(live.node.get_topic_names_and_types()),
        PARAMETER: [[name, ""] for name in sorted(nodes)],
        "several": {what: said for what, said in several.items() if said},
    }


def _servers(live: Session, name: str) -> str:
    """Return a sentence that names the servers of a service or action; '' if only one is left."""
    servers = [who for who, _ in live.others(name)]
    if len(servers) < 2:
        return ""
    told = " and by ".join(servers)
    return f"It is served by {told}: {_any_of(len(servers))} may answer. Nodes shows where each runs: stop all but one."


def _any_of(count: int) -> str:
    return "either" if count == 2 else "any of them"


def _of_interest(found: list[tuple[str, list[str]]]) -> list[list[str]]:
    return sorted([name, kind] for name, types in found for kind in types if of_interest(name, kind))


def form(kind: str, name: str, type_name: str) -> list[dict[str, Any]]:
    """Return the fields of a form, see `forms.fields_of`; for a node, its parameters with their current values.

    Raises LiveError when the type cannot be imported, or the node does not answer.
    """
    if kind == PARAMETER:
        return _parameters(name)
    return forms.fields_of(forms.interface(kind, type_name).message)


def _parameters(node: str) -> list[dict[str, Any]]:
    live = session()
    listed = live.call(f"{node}/list_parameters", ListParameters, timeout=ANSWER)
    names = sorted(of_usual_length(set(listed.result.names)), key=own_first)
    values = live.call(f"{node}/get_parameters", GetParameters, timeout=ANSWER, names=names).values
    described = live.call(f"{node}/describe_parameters", DescribeParameters, timeout=ANSWER, names=names).descriptors
    found, room = [], FORM
    for name, value, descriptor in zip(names, values, described, strict=False):
        kind = PARAMETER_TYPES.get(value.type)
        plain: Any = parameter_value_to_python(value) if kind else None  # rclpy knows no types but those of ROS 2
        shown = forms.listed(plain) if kind and kind.endswith(ARRAY) else str(plain)
        field: dict[str, Any] = {"name": name, "type": kind or _type_name(value.type), "about": _about(descriptor)}
        field |= {"fixed": kind is None, "read_only": descriptor.read_only}  # a node refuses to set the latter
        if kind == "boolean":
            field |= {"kind": "truth", "default": plain}
        else:
            field |= {"kind": "list" if kind and kind.endswith(ARRAY) else "scalar", "default": shown, "choices": {}}
        if (size := len(protocol.encoded(all_visible(field)))) <= room:
            found.append(field)
            room -= size
    return found


def _type_name(number: int) -> str:
    """Return the name of a parameter's type that a form cannot set."""
    return TYPE_NAMES[number] if number < len(TYPE_NAMES) else "of an unknown type"


def _about(descriptor: ParameterDescriptor) -> str:
    """Return a line that sums up a parameter's descriptor."""
    said = [descriptor.description.rstrip(".")] if descriptor.description else []
    for each in (*descriptor.floating_point_range, *descriptor.integer_range):
        step = f", in steps of {each.step}" if each.step else ""
        said.append(f"{each.from_value} to {each.to_value}{step}")
    if descriptor.additional_constraints:
        said.append(descriptor.additional_constraints)
    if descriptor.read_only:
        said.append("read-only")
    return "; ".join(said)


def look(
    kind: str, name: str, type_name: str, given: dict[str, Any], rate: str = "", timeout: str | None = None
) -> dict[str, Any]:
    """Return the errors of a form, by field, or else the program and the command that do the same as the form.

    For a parameter, `given` has its name and value, and `type_name` is its type.  With a `rate` (Hz, as typed) a
    message is published repeatedly; an error in it is reported for the field RATE.  `timeout` is as in `send`; an error
    in it is reported for the field LIMIT, beside the program and the command, which wait in their own ways.
    """
    looked = (
        _look_at_parameter(name, type_name, given) if kind == PARAMETER else _look(kind, name, type_name, given, rate)
    )
    try:
        _seconds(timeout)
    except ValueError as error:
        looked["wrong"][LIMIT] = str(error)
    return looked


def _look(kind: str, name: str, type_name: str, given: dict[str, Any], rate: str) -> dict[str, Any]:
    interface = forms.interface(kind, type_name)
    filled = forms.fill(interface.message, given)
    hertz = None
    try:
        hertz = _hertz(kind, rate)
    except ValueError as error:
        filled.wrong[RATE] = str(error)
    if filled.wrong:
        return {"wrong": filled.wrong, "python": "", "ros2": ""}
    return {
        "wrong": {},
        "python": programs.python(interface, name, filled.values, hertz),
        "ros2": programs.command(interface, name, filled.values, hertz),
    }


def _seconds(timeout: str | None) -> float:
    """Return the time limit (s); raises ValueError that says what to write."""
    if timeout is None:
        return ANSWER
    if not 0.0 < (seconds := forms.scalar("float64", timeout)) <= LONGEST:
        raise ValueError(f"write a number of seconds above 0 and at most {LONGEST:g} (an hour)")
    return float(seconds)


def _hertz(kind: str, rate: str) -> float | None:
    """Return the rate (Hz) to publish at, None for once; raises ValueError that says what to write."""
    if kind != "topic" or not rate.strip():
        return None
    least, most = sending.RATES
    if not least <= (hertz := forms.scalar("float64", rate)) <= most:
        raise ValueError(f"write a number from {least:g} to {most:g}, in Hz")
    return float(hertz)


def _look_at_parameter(node: str, kind: str, given: dict[str, Any]) -> dict[str, Any]:
    ((parameter, text),) = given.items()
    try:
        value = _parameter_value(kind, text)
    except ValueError as error:
        return {"wrong": {parameter: str(error)}, "python": "", "ros2": ""}
    return {
        "wrong": {},
        "python": programs.python_of_parameter(node, parameter, value, _number_of(kind)),
        "ros2": programs.command_of_parameter(node, parameter, value, _number_of(kind)),
    }


def _number_of(kind: str) -> int:
    """Return the number of a parameter's type, one of PARAMETER_TYPES."""
    return next(number for number, known in PARAMETER_TYPES.items() if known == kind)


def _parameter_value(kind: str, text: Any) -> Any:
    if kind not in PARAMETER_TYPES.values():
        raise ValueError("it has no value yet, and so no type: its node must declare it with a default")
    element = kind.removesuffix(ARRAY)
    return forms.scalar(element, text) if element == kind else forms.scalars(element, str(text))


def send(
    kind: str, name: str, type_name: str, given: dict[str, Any], rate: str = "", timeout: str | None = None
) -> str:
    """Send the content of a form; return the number of the exchange.  Raises LiveError when the form has an error.

    `timeout` (s, as typed) is how long to wait for a server and its answer, ANSWER if None: for a goal, until the
    action server accepts or rejects it.  `rate` is as in `look`.
    """
    live = session()
    try:
        limit = _seconds(timeout)
    except ValueError as error:
        raise LiveError(f"Wait at most: {error}") from None
    if kind == PARAMETER:
        ((parameter, text),) = given.items()
        try:
            value = _parameter_value(type_name, text)
        except ValueError as error:
            raise LiveError(f"{parameter}: {error}") from None
        made = Parameter(parameter, Parameter.Type(_number_of(type_name)), value)
        return sending.set_parameter(live, name, made, limit).number
    interface = forms.interface(kind, type_name)
    filled = forms.fill(interface.message, given)
    message = forms.message_of(interface.message, filled)
    if kind == "topic":
        try:
            hertz = _hertz(kind, rate)
        except ValueError as error:
            raise LiveError(f"rate: {error}") from None
        line = programs.command(interface, name, filled.values, hertz)
        return sending.publish(live, interface, name, message, hertz, line).number
    begin = sending.call if kind == "service" else sending.send_goal
    return begin(live, interface, name, message, limit).number
