"""The environment variables of a ROS 2 process, with ROS 2 from the wheels or from a sourced installation."""

import os
import sys
from pathlib import Path

DISCOVERY_PROFILE = Path(__file__).parent / "discovery.xml"
DISTRIBUTION = "jazzy"
KERNEL = "JPY_PARENT_PID"  # a variable of what runs in a notebook's kernel
DOMAIN = "COURSE_DOMAIN"  # the ROS domain that a terminal of the course has set
TOOLCHAIN = Path(__file__).parent / "interfaces" / "toolchain.cmake"


def sourced() -> bool:
    """Return True if a ROS 2 installation, not this environment's wheels, was sourced before this interpreter started.

    The course's own shell names a distribution, too (`workspace_variables`); a workspace has no client library.
    """
    others = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p and p != sys.prefix]
    return "ROS_DISTRO" in os.environ and any((Path(p) / "share" / "rclpy").exists() for p in others)


def foreign_distribution() -> str:
    """The name of a ROS 2 distribution that is sourced and is not the course's, or ''."""
    name = os.environ.get("ROS_DISTRO", DISTRIBUTION)
    return "" if name == DISTRIBUTION else name


def workspace_variables() -> dict[str, str]:
    """Return the variables, besides those of `prepare`, for `colcon build` and CMake to work as they do on a robot.

    With a sourced ROS 2 that is nothing.  With the wheels: where the packages are, as a sourced ROS 2 would say, and a
    file that adapts CMake to the wheels (`interfaces/toolchain.cmake`).  CMake finds this interpreter by VIRTUAL_ENV,
    and takes ninja, which is among the wheels, because a student's machine need not have make.
    """
    if sourced():
        return {}
    prefixes = [p for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if p and p != sys.prefix]
    return {
        "CMAKE_GENERATOR": "Ninja",
        "CMAKE_POLICY_VERSION_MINIMUM": "3.10",  # many packages ask for less, and this CMake warns of that
        "CMAKE_PREFIX_PATH": os.pathsep.join([*prefixes, sys.prefix]),
        "CMAKE_TOOLCHAIN_FILE": str(TOOLCHAIN),
        "ROS_DISTRO": DISTRIBUTION,
        "ROS_PYTHON_VERSION": "3",
        "ROS_VERSION": "2",
        "VIRTUAL_ENV": sys.prefix,
    }


def session_variables(domain: int | str) -> dict[str, str]:
    """Return the variables that a session and its terminals share: the ROS domain, how to discover, speak and log.

    Fast DDS's shared memory may be read by all users of a machine, keeps the segments of processes that were killed,
    and its error messages would reach the cells.  It is left out where the range is not LOCALHOST: for that one
    rmw_fastrtps (of Jazzy) brings transports of its own, shared memory among them, whatever this variable says.
    """
    return {
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
        "FASTDDS_BUILTIN_TRANSPORTS": os.environ.get("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4"),
        # As in the book.
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": os.environ.get(
            "RCUTILS_CONSOLE_OUTPUT_FORMAT", "[{severity}] [{name}]: {message}"
        ),
    }


def chosen_domain() -> str:
    """Return the ROS domain that somebody has exported; '' for none, and for that which a terminal of ours has set."""
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    return "" if domain == os.environ.get(DOMAIN) else domain


def prepare() -> None:
    """Complete `os.environ` for this process and its children; what the user has set is kept.

    Puts the interpreter's folder first in PATH, so that `python` and `ros2` in a cell are this environment's.  Adds
    the interpreter's prefix to AMENT_PREFIX_PATH (package index, `.srv` files), and has Fast DDS announce nodes often
    enough that they find each other at once.  Message classes check the type of what is assigned to a field: a wrong
    one otherwise aborts the whole process when the message is sent.
    """
    programs = os.path.dirname(sys.executable)
    path = os.environ.get("PATH", os.defpath).split(os.pathsep)
    if path[0] != programs:
        os.environ["PATH"] = os.pathsep.join([programs, *(folder for folder in path if folder != programs)])
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    if sys.prefix not in prefixes:
        os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join([*prefixes, sys.prefix])
    os.environ.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", str(DISCOVERY_PROFILE))
    os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")
