"""The files of ROS 2 packages, as `ros2 pkg create` would make them, with an exercise's files.

Sources: https://docs.ros.org/en/jazzy/Tutorials/Beginner-Client-Libraries/Custom-ROS2-Interfaces.html and
https://docs.ros.org/en/jazzy/How-To-Guides/Developing-a-ROS-2-Package.html
"""

import keyword
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from string import Template
from xml.sax.saxutils import escape

from course import interfaces
from course.errors import WorkspaceError
from course.ros.package_templates import SETUP, SETUP_CFG
from course.workspace.exercise_files import Exercise, Interface, Program

# An interface package of the course that no ROS 2 installation has, so it is exported with programs that use it.
COURSES_OWN = "course_interfaces"

# rosdep's names of Python libraries; a ROS 2 package has the name of its import.
LIBRARIES = {name: f"python3-{name}" for name in ("matplotlib", "numpy", "psutil", "requests", "scipy", "serial")} | {
    "cv2": "python3-opencv",
    "yaml": "python3-yaml",
}

# colcon refuses a package whose maintainer's e-mail does not look like one.
MANIFEST = Template("""\
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>$name</name>
  <version>0.0.0</version>
  <description>$description</description>
  <maintainer email="student@example.org">student</maintainer>
  <license>TODO: License declaration</license>

$dependencies

  <export>
    <build_type>$build_type</build_type>
  </export>
</package>
""")

CMAKE = Template("""\
cmake_minimum_required(VERSION 3.10)
project($name)

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
$found
rosidl_generate_interfaces($${PROJECT_NAME}
$files
)

ament_export_dependencies(rosidl_default_runtime)
ament_package()
""")


def of_exercise(exercise: Exercise, name: str) -> dict[str, dict[str, str]]:
    """Return the packages of `exercise`; the one with the programs is called `name`.

    Each package maps the paths of its files, relative to the package's folder, to their texts.  Raises WorkspaceError
    for a name that ROS 2 does not allow.
    """
    packages: dict[str, dict[str, str]] = {}
    for package in dict.fromkeys(interface.package for interface in exercise.interfaces):
        check_name(package)
        packages[package] = _interface_package(package, [i for i in exercise.interfaces if i.package == package])
    imported = {module for program in exercise.programs for module in program.imports}
    if COURSES_OWN in imported:
        packages[COURSES_OWN] = _courses_package(COURSES_OWN)
    if exercise.programs:
        check_name(name)
        if name in packages or name in imported or name in sys.stdlib_module_names:
            raise WorkspaceError(
                f"a package called '{name}' would hide an existing package of that name: choose another "
                "name with --package"
            )
        packages[name] = _python_package(name, exercise)
    return packages


def notes(exercise: Exercise) -> list[str]:
    """Return a line for each thing in the programs that will not work in a ROS 2 package."""
    return [
        f"{program.file} imports course, which is not installed on a robot"
        for program in exercise.programs
        if "course" in program.imports
    ]


def check_name(name: str) -> None:
    """Raise WorkspaceError unless ROS 2 and Python allow a package called `name` (REP 144)."""
    if not re.fullmatch(r"[a-z](_?[a-z0-9]+)+", name) or keyword.iskeyword(name):
        raise WorkspaceError(
            f"'{name}' is not a valid package name: use lower-case letters, digits and single underscores, beginning "
            "with a letter"
        )


def _interface_package(name: str, files: list[Interface]) -> dict[str, str]:
    used = set().union(*(file.definition.packages for file in files)) - {name}
    if any(file.definition.kind == "action" for file in files):
        used.add("action_msgs")
    listed = [f'  "{file.definition.kind}/{file.file}"' for file in files]
    if used:
        listed.append(f"  DEPENDENCIES {' '.join(sorted(used))}")
    dependencies = [
        ("buildtool_depend", ["ament_cmake"]),
        ("build_depend", ["rosidl_default_generators"]),
        ("depend", sorted(used)),
        ("exec_depend", ["rosidl_default_runtime"]),
        ("member_of_group", ["rosidl_interface_packages"]),
    ]
    names = ", ".join(file.file for file in files)
    return {
        "package.xml": _manifest(name, f"Interfaces: {names}", "ament_cmake", dependencies),
        "CMakeLists.txt": CMAKE.substitute(
            name=name,
            found="".join(f"find_package({package} REQUIRED)\n" for package in sorted(used)),
            files="\n".join(listed),
        ),
        **{f"{file.definition.kind}/{file.file}": file.text for file in files},
    }


def _python_package(name: str, exercise: Exercise) -> dict[str, str]:
    description = f"My nodes of the exercise {exercise.name}"
    scripts = [
        f"            '{program.name} = {name}.{program.name}:main',\n" for program in exercise.programs if program.runs
    ]
    return {
        "package.xml": _manifest(
            name, description, "ament_python", [("exec_depend", sorted(_used(exercise.programs, name)))]
        ),
        "setup.py": SETUP.format(
            name=name,
            maintainer="student",
            email="student@example.org",
            description=description,
            license="TODO: License declaration",
            scripts="".join(scripts),
        ),
        "setup.cfg": SETUP_CFG.format(name=name),
        f"resource/{name}": "",
        f"{name}/__init__.py": "",
        **{f"{name}/{program.file}": _in_package(program, name, exercise) for program in exercise.programs},
    }


def _in_package(program: Program, name: str, exercise: Exercise) -> str:
    """Return the program's text, with imports of files beside it changed to imports from the package."""
    beside = "|".join(other.name for other in exercise.programs)
    text = re.sub(rf"^(\s*)from ({beside}) import ", rf"\1from {name}.\2 import ", program.text, flags=re.MULTILINE)
    return re.sub(
        rf"^(\s*)import ({beside})(?= as |\s*(?:#.*)?$)", rf"\1from {name} import \2", text, flags=re.MULTILINE
    )


def _used(programs: list[Program], name: str) -> set[str]:
    """Return the names in package.xml of the packages and libraries that the programs import."""
    imported = {module for program in programs for module in program.imports}
    own = {program.name for program in programs} | {name, "course"}
    return {LIBRARIES.get(module, module) for module in imported - own}


def _courses_package(name: str) -> dict[str, str]:
    folder = Path(interfaces.__file__).parent / name
    return {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _manifest(name: str, description: str, build_type: str, dependencies: Iterable[tuple[str, list[str]]]) -> str:
    lines = [f"  <{tag}>{package}</{tag}>" for tag, packages in dependencies for package in packages]
    listed = "\n".join(lines)
    return MANIFEST.substitute(name=name, description=escape(description), build_type=build_type, dependencies=listed)
