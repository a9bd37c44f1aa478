"""The environment variables of a student's program, and those that it shares with the grader's ROS 2 processes."""

import os
import sys
from pathlib import Path

from autograder.paths import COURSE, PACKAGE
from course import environment

# An ament resource that each ROS 2 installation with Python has, but a workspace does not.
OF_ROS = "share/ament_index/resource_index/packages/rclpy"


def ros_prefixes() -> list[Path]:
    """Return the install prefixes of ROS 2: this environment's, and a sourced installation's.

    A sourced workspace is left out: it may contain somebody's solution.
    """
    prefixes = map(Path, os.environ["AMENT_PREFIX_PATH"].split(os.pathsep))
    return [prefix for prefix in prefixes if (prefix / OF_ROS).is_file()]


def ros_variables(domain: int, own_network: bool) -> dict[str, str]:
    """Return the variables that the grader's and the student's ROS 2 processes have in common.

    They use UDP, because the two share no /dev/shm, and multicast, because LOCALHOST discovery does not cross
    namespaces.
    """
    return {
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET" if own_network else "LOCALHOST",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(environment.DISCOVERY_PROFILE),
    }


def of_judge(home: str) -> dict[str, str]:
    """Return all environment variables of the judging process, whose home is the empty folder `home`."""
    variables = of_program(0, home, None, str(environment.DISCOVERY_PROFILE), confined=True)
    modules = [variables["PYTHONPATH"], str(PACKAGE.parent), str(COURSE.parent)]
    return variables | {
        "PYTHONPATH": os.pathsep.join(entry for entry in modules if entry),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "ROS_LOG_DIR": f"{home}/log",
        "TMPDIR": home,
    }


def of_program(domain: int, home: str, interfaces: str | None, profile: str, confined: bool) -> dict[str, str]:
    """Return all environment variables of a program in ROS domain `domain`.

    `home`, `interfaces` (the install prefix of an exercise's own interface package) and `profile` (Fast DDS's) are
    paths as the program sees them.
    """
    prefixes = [str(folder) for folder in ros_prefixes()]
    libraries = [entry for entry in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if entry]
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    python = [f"{prefix}/lib/{version}/site-packages" for prefix in prefixes if prefix != sys.prefix]
    if interfaces:
        prefixes.insert(0, interfaces)
        python.insert(0, f"{interfaces}/lib/python")
    return {
        "PATH": f"{sys.prefix}/bin:/usr/local/bin:/usr/bin:/bin",
        "HOME": home,
        "LANG": "C.UTF-8",
        "PYTHONUNBUFFERED": "1",  # print() must be seen at once
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONPATH": os.pathsep.join(python),
        "LD_LIBRARY_PATH": os.pathsep.join(libraries),
        "AMENT_PREFIX_PATH": os.pathsep.join(prefixes),
        "OPENBLAS_NUM_THREADS": "1",  # every ROS 2 program loads NumPy, whose unused threads take a third of the start
        "ROS_PYTHON_CHECK_FIELDS": "1",  # a field of a wrong type raises an exception instead of ending the process
        "ROS_DISTRO": os.environ.get("ROS_DISTRO", "jazzy"),
        "ROS_VERSION": "2",
        "ROS_LOG_DIR": "/tmp/log" if confined else f"{home}/log",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        **ros_variables(domain, confined),
        "FASTRTPS_DEFAULT_PROFILES_FILE": profile,
    }
