"""`ros2 pkg`: list the installed packages and their executables, and create a new package."""

import getpass
import os
import re
import shutil
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from course.errors import RosError
from course.ros import package_templates
from course.ros.package_templates import NewPackage
from course.ros.packages import find_executables, installed_packages, installed_paths, installed_prefix
from course.ros2 import completion, grammar
from course.ros2.grammar import Verb
from course.ros2.licenses import LICENSES, license_text

NOT_FOUND = "Package not found"
NAME = re.compile(r"[a-z](_?[a-z0-9]+)*")


def _add_name_argument(parser: ArgumentParser, *, optional: bool = False) -> None:
    grammar.complete_with(
        parser.add_argument("package_name", help="The package name", nargs="?" if optional else None),
        completion.installed_packages,
    )


def add_list_arguments(parser: ArgumentParser) -> None:
    """Do nothing: `ros2 pkg list` has no arguments."""


def list_packages(args: Namespace) -> None:
    """Print the names of the installed packages."""
    for name in installed_packages():
        print(name)


def add_executables_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 pkg executables`."""
    _add_name_argument(parser, optional=True)
    parser.add_argument("--full-path", action="store_true", help="Show full path of each executable")


def executables(args: Namespace) -> None:
    """Print the executables of a package, installed or in this folder, or of all installed packages."""
    names = installed_packages() if args.package_name is None else [args.package_name]
    for name in names:
        paths = installed_paths(name)
        if paths is None:
            found = find_executables(name)
            if found is None:
                raise RosError(f"Package '{name}' not found")
            # A demo is run as a module of the course, so its command names no file.
            files = [(each, Path(command[-1])) for each, commands in found.items() for command in commands]
            paths = [file if file.is_file() else Path(each) for each, file in files]
        for path in sorted(paths):
            print(path if args.full_path else f"{name} {path.name}")


def add_prefix_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 pkg prefix`."""
    _add_name_argument(parser)
    parser.add_argument("--share", action="store_true", help="Show share directory for the package")


def prefix(args: Namespace) -> str | None:
    """Print the folder that a package is installed in."""
    found = installed_prefix(args.package_name)
    if found is None:
        return NOT_FOUND
    print(found / "share" / args.package_name if args.share else found)
    return None


def add_xml_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 pkg xml`."""
    _add_name_argument(parser)
    parser.add_argument("-t", "--tag", help="The XML tag to output (e.g. 'version')")


def xml(args: Namespace) -> str | None:
    """Print the package.xml of an installed package, or the text of one of its tags."""
    from xml.etree import ElementTree

    found = installed_prefix(args.package_name)
    if found is None:
        return NOT_FOUND
    manifest = found / "share" / args.package_name / "package.xml"
    if not manifest.is_file():
        return "Package XML manifest not found"
    try:
        tree = ElementTree.parse(manifest)
    except ElementTree.ParseError as error:
        return f"'{manifest}' is not valid XML: {error}"
    if args.tag is None:
        ElementTree.dump(tree)
        return None
    elements = tree.getroot().findall(args.tag)
    for element in elements:
        print(element.text)
    return None if elements else "XML tag not found"


# --- create ---


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a user without a name, as in containers
        return "todo"


def add_create_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `ros2 pkg create`."""
    add = parser.add_argument
    add("package_name", help="The package name")
    add("--package-format", "--package_format", type=int, default=3, choices=[2, 3], help="The package.xml format.")
    add("--description", default="TODO: Package description", help="The description given in the package.xml")
    add(
        "--license",
        default="TODO: License declaration",
        help="The license attached to this package; this can be an arbitrary string, but a LICENSE file will only be "
        "generated if it is one of the supported licenses (pass '?' to get a list)",
    )
    add("--destination-directory", default=os.curdir, help="Directory where to create the package directory")
    add(
        "--build-type",
        default="ament_cmake",
        choices=["cmake", "ament_cmake", "ament_python"],
        help="The build type to process the package with",
    )
    grammar.complete_with(
        add("--dependencies", nargs="+", default=[], help="list of dependencies"), completion.installed_packages
    )
    add("--maintainer-email", help="email address of the maintainer of this package")
    add("--maintainer-name", default=_user(), help="name of the maintainer of this package")
    add("--node-name", help="name of the empty executable")
    add("--library-name", help="name of the empty library")


def _email(args: Namespace) -> str:
    """Return the maintainer's address: the given one, or git's, or one to be replaced."""
    if args.maintainer_email:
        return args.maintainer_email
    if git := shutil.which("git"):
        said = subprocess.run([git, "config", "user.email"], stdout=subprocess.PIPE, text=True, check=False)
        if said.stdout.strip():
            return said.stdout.strip()
    return f"{args.maintainer_name}@todo.todo"


def create(args: Namespace) -> str | None:
    """Create a new package; prints the same as ros2cli."""
    if args.license == "?":
        print("\n".join(["Supported licenses:", *LICENSES]))
        return None
    if not NAME.fullmatch(args.package_name):
        return (
            f"'{args.package_name}' cannot be the name of a package: "
            "it consists of lower-case letters, digits and single underscores, and begins with a letter"
        )
    if args.build_type == "ament_python" and args.package_name == "test":
        return "Aborted since 'ament_python' packages can't be named 'test'. Please choose a different package name."
    node_name = args.node_name
    if node_name and node_name == args.library_name:
        node_name += "_node"
        print("[WARNING] node name can not be equal to the library name", file=sys.stderr)
        print(f"[WARNING] renaming node to {node_name}", file=sys.stderr)
    package = NewPackage(
        args.package_name, args.package_format, args.description, args.maintainer_name, _email(args), args.license,
        args.build_type, tuple(args.dependencies), node_name or "", args.library_name or "",
    )  # fmt: skip
    folder = os.path.join(args.destination_directory, package.name)
    if os.path.exists(folder):
        return (
            f"\nAborted!\nThe directory already exists: {folder}\n"
            "Either remove the directory or choose a different destination directory or package name"
        )
    _describe(package, os.path.abspath(args.destination_directory))
    try:
        _write(package, folder)
    except OSError as error:
        return f"{error.strerror}: '{error.filename}'"
    return None


def _describe(package: NewPackage, destination: str) -> None:
    print("going to create a new package")
    print("package name:", package.name)
    print("destination directory:", destination)
    print("package format:", package.format)
    print("version: 0.0.0")
    print("description:", package.description)
    print("maintainer:", [f"{package.maintainer} <{package.email}>"])
    print("licenses:", [package.license])
    print("build type:", package.build_type)
    print("dependencies:", list(package.dependencies))
    if package.node:
        print("node_name:", package.node)
    if package.library:
        print("library_name:", package.library)


def _write(package: NewPackage, folder: str) -> None:
    """Create the folders and files of a package, and say so for each."""
    print("creating folder", folder)
    os.makedirs(folder)
    for step in package_templates.steps(package):
        if step.note:
            print(step.note)
            continue
        path = os.path.join(folder, step.path)
        print("creating folder" if step.text is None else "creating", path)
        if step.text is None:
            os.makedirs(path, exist_ok=True)
        else:
            Path(path).write_text(step.text, encoding="utf-8")
    if package.license not in LICENSES:
        print(
            f"\n[WARNING]: Unknown license '{package.license}'.  This has been set in the package.xml, but no LICENSE "
            "file has been created.\nIt is recommended to use one of the ament license identifiers:\n"
            + "\n".join(LICENSES)
        )
    elif (text := license_text(package.license)) is not None:
        Path(folder, "LICENSE").write_text(text, encoding="utf-8")
    else:
        print(
            f"\n[WARNING]: The text of the license '{package.license}' is not on this machine: "
            "no LICENSE file has been created."
        )


VERBS = {
    "create": Verb("Create a new ROS 2 package", add_create_arguments, create),
    "executables": Verb("Output a list of package specific executables", add_executables_arguments, executables),
    "list": Verb("Output a list of available packages", add_list_arguments, list_packages),
    "prefix": Verb("Output the prefix path of a package", add_prefix_arguments, prefix),
    "xml": Verb("Output the XML of the package manifest or a specific tag", add_xml_arguments, xml),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Add the verbs of `ros2 pkg`."""
    grammar.add_verbs(parser, "ros2 pkg", VERBS)
