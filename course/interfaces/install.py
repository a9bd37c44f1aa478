"""Build the course's interface packages with ament_cmake and install them: python -m course.interfaces.install.

A package that a sourced ROS 2 installation provides is left alone.  In an environment of wheels the packages go to the
interpreter's prefix, beside the wheels' own.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PACKAGES = ("example_interfaces", "course_interfaces")
HERE = Path(__file__).parent


def provided_elsewhere(package: str) -> bool:
    """Whether a ROS 2 prefix other than this interpreter's has the package."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return any(
        (Path(prefix) / "share" / package / "package.xml").exists()
        for prefix in prefixes
        if prefix and prefix != sys.prefix
    )


def install(package: str, prefix: Path) -> None:
    """Build the ROS package in the folder `package` and install it below `prefix`; raises RuntimeError with the log."""
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
                raise RuntimeError(f"building {package} failed:\n{(done.stdout + done.stderr)[-4000:]}")


def main() -> int:
    """Install what is missing; 1, with the tool's own words, when a build fails."""
    if not shutil.which("g++"):
        print("A C++ compiler is needed: install g++", file=sys.stderr)
        return 1
    for package in PACKAGES:
        if provided_elsewhere(package):
            print(f"{package}: provided by the sourced ROS 2")
            continue
        try:
            install(package, Path(sys.prefix))
        except RuntimeError as error:
            print(error, file=sys.stderr)
            return 1
        print(f"{package}: built")
    return 0


if __name__ == "__main__":
    sys.exit(main())
