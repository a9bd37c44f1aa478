"""The environment variables of a ROS 2 process, whether ROS 2 is from the wheels or a sourced installation."""

import os
import sys
from pathlib import Path

DISCOVERY_PROFILE = Path(__file__).parent / "discovery.xml"
DISTRIBUTION = "jazzy"
KERNEL = "JPY_PARENT_PID"  # set for processes in a notebook's kernel
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"  # which hosts a process discovers
DOMAIN = "COURSE_DOMAIN"  # the ROS domain that the course has set in a terminal
TOOLCHAIN = Path(__file__).parent / "interfaces" / "toolchain.cmake"


def sourced() -> bool:
    """Return True if a ROS 2 installation, not this environment's wheels, was sourced before this interpreter started.

    The course's own shell sets ROS_DISTRO, too (`workspace_variables`), but without a prefix that has rclpy.
    """
    others = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p and p != sys.prefix]
    return "ROS_DISTRO" in os.environ and any((Path(p) / "share" / "rclpy").exists() for p in others)


def foreign_distribution() -> str:
    """Return the name of a sourced ROS 2 distribution other than the course's, or ''."""
    name = os.environ.get("ROS_DISTRO", DISTRIBUTION)
    return "" if name == DISTRIBUTION else name


def workspace_variables() -> dict[str, str]:
    """Return the variables, in addition to `prepare`, that `colcon build` and CMake need to work as on a robot.

    With a sourced ROS 2 there are none.  With the wheels they are the paths of the packages, which a sourced ROS 2
    would set, and a file that adapts CMake to the wheels (`interfaces/toolchain.cmake`).  CMake finds this interpreter
    by VIRTUAL_ENV, and uses ninja, which is among the wheels, because a student's machine may not have make.
    """
    if sourced():
        return {}
    prefixes = [p for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if p and p != sys.prefix]
    return {
        "CMAKE_GENERATOR": "Ninja",
        "CMAKE_POLICY_VERSION_MINIMUM": "3.10",  # many packages ask for an older one, of which this CMake warns
        "CMAKE_PREFIX_PATH": os.pathsep.join([*prefixes, sys.prefix]),
        "CMAKE_TOOLCHAIN_FILE": str(TOOLCHAIN),
        "ROS_DISTRO": DISTRIBUTION,
        "ROS_PYTHON_VERSION": "3",
        "ROS_VERSION": "2",
        "VIRTUAL_ENV": sys.prefix,
    }


def session_variables(domain: int | str) -> dict[str, str]:
    """Return the variables that a session and its terminals share: ROS domain, discovery, transport and logging.

    Fast DDS's shared memory can be read by all users of a machine, keeps the segments of killed processes, and prints
    error messages into the cells.  It is disabled unless the discovery range is LOCALHOST: then rmw_fastrtps (of Jazzy)
    chooses the transports itself, shared memory included, whatever this variable says.
    """
    return {
        "ROS_DOMAIN_ID": str(domain),
        RANGE: os.environ.get(RANGE, "LOCALHOST"),
        "FASTDDS_BUILTIN_TRANSPORTS": os.environ.get("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4"),
        # The format of the log lines in the book.
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": os.environ.get(
            "RCUTILS_CONSOLE_OUTPUT_FORMAT", "[{severity}] [{name}]: {message}"
        ),
    }


def chosen_domain() -> str:
    """Return the ROS domain that the user has exported; '' for none, or for one set by a terminal of the course."""
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    return "" if domain == os.environ.get(DOMAIN) else domain


def prepare() -> None:
    """Complete `os.environ` for this process and its children; variables that the user has set are kept.

    Puts the interpreter's folder first in PATH, so that `python` and `ros2` in a cell are this environment's.  Adds the
    interpreter's prefix to AMENT_PREFIX_PATH (package index, `.srv` files), and has Fast DDS announce nodes often
    enough that they find each other at once.  Message classes check the type of a value assigned to a field, because a
    wrong one would otherwise abort the process when the message is sent.
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
