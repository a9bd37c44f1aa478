"""Build the course's interface packages with ament_cmake and install them: python -m course.interfaces.install.

A package that a sourced ROS 2 installation provides is left alone.  In an environment of wheels the packages go to the
interpreter's prefix, beside the wheels' own.  The course itself is registered there as an ament package with its nodes
as executables, so that `ros2 run course ...` finds them, with this repository's command or the real one.
"""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import metadata
from pathlib import Path
from xml.sax.saxutils import escape

from course.errors import ToolChainError

PACKAGES = ("example_interfaces", "course_interfaces")
HERE = Path(__file__).parent
COURSE = "course"
NODES = HERE.parent / "nodes"
MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>course</name>
  <version>{version}</version>
  <description>{summary}</description>
  <maintainer email="course@example.org">The authors of the course</maintainer>
  <license>Apache-2.0</license>
  <exec_depend>rclpy</exec_depend>
  <export>
    <build_type>ament_python</build_type>
  </export>
</package>
"""
# Not `#!` with the interpreter's path, which may contain a space.  -P: do not import from a folder called `course`.
LAUNCHER = """\
#!/bin/sh
exec {python} -P -m course.nodes.{node} "$@"
"""


def provided_elsewhere(package: str) -> bool:
    """Return True if a ROS 2 prefix other than this interpreter's has the package."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return any(
        (Path(prefix) / "share" / package / "package.xml").exists()
        for prefix in prefixes
        if prefix and prefix != sys.prefix
    )


def install(package: str, prefix: Path) -> None:
    """Build the ROS package in the folder `package`, and install it below `prefix`.

    Raises ToolChainError with the end of the log.
    """
    tools = {
        **os.environ,
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]),
        "CMAKE_PREFIX_PATH": os.environ["AMENT_PREFIX_PATH"],
    }
    with tempfile.TemporaryDirectory() as build:
        for command in (
            [
                "cmake",
                "-S",
                str(HERE / package),
                "-B",
                build,
                "-G",
                "Ninja",
                f"-DCMAKE_INSTALL_PREFIX={prefix}",
                f"-DCMAKE_PROJECT_INCLUDE={HERE / 'wheels.cmake'}",
                f"-DPython3_EXECUTABLE={sys.executable}",
                "-DBUILD_TESTING=OFF",
            ],
            ["cmake", "--build", build, "--target", "install"],
        ):
            done = subprocess.run(command, env=tools, capture_output=True, text=True, stdin=subprocess.DEVNULL)
            if done.returncode:
                raise ToolChainError(f"building {package} failed:\n{(done.stdout + done.stderr)[-4000:]}")


def register(prefix: Path) -> None:
    """Register the package `course` in the ament index of `prefix`, and install its nodes in `prefix`/lib/course."""
    about = metadata("ros2-course")
    share = prefix / "share"
    programs = prefix / "lib" / COURSE
    shutil.rmtree(programs, ignore_errors=True)
    for folder in (programs, share / COURSE, share / "ament_index" / "resource_index" / "packages"):
        folder.mkdir(parents=True, exist_ok=True)
    (share / COURSE / "package.xml").write_text(
        MANIFEST.format(version=about["Version"], summary=escape(about["Summary"])), encoding="utf-8"
    )
    for node in sorted(path.stem for path in NODES.glob("[!_]*.py")):
        program = programs / node
        program.write_text(LAUNCHER.format(python=shlex.quote(sys.executable), node=node), encoding="utf-8")
        program.chmod(0o755)
    (share / "ament_index" / "resource_index" / "packages" / COURSE).write_text("")


def main() -> int:
    """Install what is missing; return 1, after printing the tool's log, if a build fails."""
    if not shutil.which("g++"):
        print("A C++ compiler is needed: install g++", file=sys.stderr)
        return 1
    for package in PACKAGES:
        if provided_elsewhere(package):
            print(f"{package}: provided by the sourced ROS 2")
            continue
        try:
            install(package, Path(sys.prefix))
        except ToolChainError as error:
            print(error, file=sys.stderr)
            return 1
        print(f"{package}: built")
    register(Path(sys.prefix))
    print(f"{COURSE}: registered")
    return 0


if __name__ == "__main__":
    sys.exit(main())
