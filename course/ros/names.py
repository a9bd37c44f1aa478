"""Names in the ROS graph: with and without their namespace, and those that are hidden."""

import re

HIDDEN_PREFIX = "_"
VALID = re.compile(r"(/[A-Za-z_]\w*)+", re.ASCII)
PARAMETERS_OF_EVERY_NODE = ("use_sim_time", "start_type_description_service")
SERVICES_OF_EVERY_NODE = {
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "get_type_description",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
}
SEND = "/_action/send_goal"  # a service of every action server
OF_EVERY_NODE = ("rcl_interfaces/", "type_description_interfaces/")  # types of the services that every node has

# The names of the types of parameters, as `ros2 param` has them, in the order of rcl_interfaces/msg/ParameterType.
TYPE_NAMES = (
    "not set", "boolean", "integer", "double", "string",
    "byte array", "boolean array", "integer array", "double array", "string array",
)  # fmt: skip


def is_hidden(name: str) -> bool:
    """Return True if any part of the name of a topic, service or node begins with an underscore."""
    return any(part.startswith(HIDDEN_PREFIX) for part in name.split("/"))


def is_valid(full_name: str) -> bool:
    """Return True for a node's full name that rclpy accepts; a program without rclpy can announce any other."""
    return bool(VALID.fullmatch(full_name))


def own_first(parameter: str) -> tuple[bool, str]:
    """Return a key that sorts a node's parameters: by name, with those that every node has at the end."""
    return parameter in PARAMETERS_OF_EVERY_NODE, parameter


def absolute(node_name: str) -> str:
    """Return a node's name with a leading slash."""
    return node_name if node_name.startswith("/") else "/" + node_name


def full(name: str, namespace: str) -> str:
    """Return a node's full name from name and namespace."""
    return f"{namespace.rstrip('/')}/{name}"


def split(node_name: str) -> tuple[str, str]:
    """Return the name and the namespace of a full node name, the two arguments of rclpy's functions."""
    namespace, name = absolute(node_name).rsplit("/", 1)
    return name, namespace or "/"


def is_of_every_node(service: str) -> bool:
    """Return True for a service that every node has, whatever the node is called."""
    return service.rpartition("/")[2] in SERVICES_OF_EVERY_NODE


def can_be(full_name: str, written: str) -> bool:
    """Return True if a name `written` in a program, `asks` or `~/asks`, is `full_name` in some namespace."""
    return full_name.endswith(f"/{written.lstrip('~/')}")


def base(node_name: str) -> str:
    """Return the name of a node without its namespace."""
    return node_name.rpartition("/")[2]


def type_name(kind: type) -> str:
    """Return the name that ROS 2 has for an interface type: std_srvs/srv/Trigger."""
    package, category, *_ = kind.__module__.split(".")
    return f"{package}/{category}/{kind.__name__}"
