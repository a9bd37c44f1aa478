"""The Python program and the `ros2` command that do the same as a form in the inspector."""

import re
import shlex
from typing import Any

import yaml
from jinja2 import Environment, StrictUndefined
from rcl_interfaces.msg import ParameterType
from rclpy.parameter import Parameter

from course.lab.kernel.forms import Interface
from course.ros import messages
from course.session.requests import argument

SERVICE = """import rclpy
{{ imports }}
from rclpy.node import Node


class {{ cls }}Client(Node):
    def __init__(self):
        super().__init__('{{ node }}_client')
        self.client = self.create_client({{ cls }}, '{{ name }}')

    def send_request(self):
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('Waiting for {{ name }} ...')
        request = {{ made }}
        future = self.client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=5.0)
        return future.result()  # None when no answer has come


def main(args=None):
    rclpy.init(args=args)
    node = {{ cls }}Client()
    response = node.send_request()
    node.get_logger().info(f'Response: {response}')
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
"""

ACTION = """import rclpy
{{ imports }}
from rclpy.action import ActionClient
from rclpy.node import Node


class {{ cls }}Client(Node):
    def __init__(self):
        super().__init__('{{ node }}_client')
        self.client = ActionClient(self, {{ cls }}, '{{ name }}')

    def send_goal(self):
        self.client.wait_for_server()
        goal = {{ made }}
        sent = self.client.send_goal_async(goal, feedback_callback=self.feedback_callback)
        rclpy.spin_until_future_complete(self, sent)
        goal_handle = sent.result()
        if not goal_handle.accepted:
            self.get_logger().info('Goal rejected')
            return
        done = goal_handle.get_result_async()
        rclpy.spin_until_future_complete(self, done)
        self.get_logger().info(f'Result: {done.result().result}')

    def feedback_callback(self, message):
        self.get_logger().info(f'Feedback: {message.feedback}')


def main(args=None):
    rclpy.init(args=args)
    node = {{ cls }}Client()
    node.send_goal()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
"""

TOPIC = """import rclpy
{{ imports }}
from rclpy.node import Node


class {{ cls }}Publisher(Node):
    def __init__(self):
        super().__init__('{{ node }}_publisher')
        self.publisher = self.create_publisher({{ cls }}, '{{ name }}', 10)

    def publish_once(self):
        while self.publisher.get_subscription_count() == 0:  # a message that nobody receives is lost
            rclpy.spin_once(self, timeout_sec=0.1)
        message = {{ made }}
        self.publisher.publish(message)
        self.publisher.wait_for_all_acked()


def main(args=None):
    rclpy.init(args=args)
    node = {{ cls }}Publisher()
    node.publish_once()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
"""

REPEATED = """import rclpy
{{ imports }}
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class {{ cls }}Publisher(Node):
    def __init__(self):
        super().__init__('{{ node }}_publisher')
        self.publisher = self.create_publisher({{ cls }}, '{{ name }}', 10)
        self.timer = self.create_timer({{ period }}, self.publish)  # s

    def publish(self):
        message = {{ made }}
        self.publisher.publish(message)


def main(args=None):
    rclpy.init(args=args)
    try:
        rclpy.spin({{ cls }}Publisher())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
"""

PARAMETER = """import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient


class ParameterSetter(Node):
    def __init__(self):
        super().__init__('parameter_setter')
        self.client = AsyncParameterClient(self, '{{ name }}')

    def set_parameter(self):
        self.client.wait_for_services()
        future = self.client.set_parameters([Parameter({{ parameter }}value={{ value }})])
        rclpy.spin_until_future_complete(self, future, timeout_sec=5.0)
        return future.result()  # None when no answer has come


def main(args=None):
    rclpy.init(args=args)
    node = ParameterSetter()
    response = node.set_parameter()
    node.get_logger().info(f'Response: {response}')
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
"""

PROGRAMS = {"service": SERVICE, "action": ACTION, "topic": TOPIC}
PART = {"service": ".Request", "action": ".Goal", "topic": ""}
COMMAND = {"service": "ros2 service call", "action": "ros2 action send_goal", "topic": "ros2 topic pub --once"}
NEGATIVE = r"-\d+|-\d*\.\d+"  # what argparse takes for a number, and not for an option
_TEMPLATES = Environment(undefined=StrictUndefined, keep_trailing_newline=True)


def python(interface: Interface, name: str, values: dict[str, Any], rate: float | None = None) -> str:
    """Return a program that sends `values` to the service, action or topic `name`, to a topic at `rate` Hz."""
    imports = {(interface.loaded.__module__.rpartition("._")[0], interface.loaded.__name__)}
    made = _expression(interface.message, values, imports, interface.loaded.__name__ + PART[interface.kind], 8)
    lines = [f"from {module} import {', '.join(names)}" for module, names in sorted(_grouped(imports).items())]
    node = re.sub(r"\W+", "_", name.strip("/")) or "course"
    return _TEMPLATES.from_string(REPEATED if rate else PROGRAMS[interface.kind]).render(
        imports="\n".join(lines),
        cls=interface.loaded.__name__,
        node=node,
        name=name,
        made=made,
        period=f"{1.0 / rate:.6g}" if rate else "",
    )


def command(interface: Interface, name: str, values: dict[str, Any], rate: float | None = None) -> str:
    """Return the shell command that sends `values` to the service, action or topic `name`, as `python` does."""
    text = as_yaml(values)
    feedback = " --feedback" if interface.kind == "action" else ""
    verb = f"ros2 topic pub --rate {rate:g}" if rate else COMMAND[interface.kind]
    return f"{verb} {name} {interface.name} {shlex.quote(text)}{feedback}"


def as_yaml(values: dict[str, Any]) -> str:
    """Values as YAML in one line: {a: 5, b: 3}."""
    return str(
        yaml.safe_dump(values, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6)
    ).strip()


def python_of_parameter(node: str, parameter: str, value: object, number: int) -> str:
    """Return a program that sets a parameter of a node, of the type with this number."""
    kind = f"Parameter.Type.{Parameter.Type(number).name}, " if value == [] else ""  # the value does not tell it
    return _TEMPLATES.from_string(PARAMETER).render(
        name=node, parameter=f"{parameter!r}, {kind}", value=_literal(value)
    )


def command_of_parameter(node: str, parameter: str, value: object, number: int) -> str:
    """Return the shell command that sets a parameter of a node, of the type with this number.

    `ros2 param set` takes an empty list for one of truth values, so that another one is sent by the node's service.
    """
    if value == [] and number != ParameterType.PARAMETER_BOOL_ARRAY:
        request = as_yaml({"parameters": [{"name": parameter, "value": {"type": number}}]})
        return f"ros2 service call {node}/set_parameters rcl_interfaces/srv/SetParameters {shlex.quote(request)}"
    text = argument(value)
    end = "-- " if text.startswith("-") and not re.fullmatch(NEGATIVE, text) else ""  # of the options
    return f"ros2 param set {node} {shlex.quote(parameter)} {end}{shlex.quote(text)}"


def _grouped(imports: set[tuple[str, str]]) -> dict[str, list[str]]:
    grouped: dict[str, list[str]] = {}
    for module, name in sorted(imports):
        grouped.setdefault(module, []).append(name)
    return grouped


def _expression(message: type[Any], values: dict[str, Any], imports: set[tuple[str, str]], called: str, at: int) -> str:
    """Return a call that makes a message; one that is too long for a line is wrapped, indented by `at` columns."""
    slots = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    parts = [f"{name}={_field(slots[name], value, imports, at + 4)}" for name, value in values.items()]
    line = f"{called}({', '.join(parts)})"
    if at + len(line) < 90 and "\n" not in line:
        return line
    indent = " " * (at + 4)
    return f"{called}(\n" + "".join(f"{indent}{part},\n" for part in parts) + " " * at + ")"


def _field(slot: Any, value: Any, imports: set[tuple[str, str]], at: int) -> str:
    element = getattr(slot, "value_type", slot)
    if not hasattr(element, "namespaces"):
        return _literal(value)
    nested = messages.get_message("/".join([*element.namespaces, element.name]))
    imports.add((".".join(element.namespaces), element.name))
    if element is slot:
        return _expression(nested, value, imports, element.name, at)
    return "[" + ", ".join(_expression(nested, each, imports, element.name, at) for each in value) + "]"


def _literal(value: Any) -> str:
    if (isinstance(value, float) and value in (float("inf"), float("-inf"))) or value != value:
        return f"float('{value}')"
    if isinstance(value, list):
        return "[" + ", ".join(map(_literal, value)) + "]"
    return repr(value)
