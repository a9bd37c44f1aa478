"""What a ROS 2 process needs in its environment, whether ROS 2 comes from the wheels or from a sourced installation."""

import os
import sys
from pathlib import Path

DISCOVERY_PROFILE = Path(__file__).parent / "discovery.xml"


def sourced() -> bool:
    """Whether a ROS 2 installation was sourced before this interpreter started."""
    return "ROS_DISTRO" in os.environ


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
