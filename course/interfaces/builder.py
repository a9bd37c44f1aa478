"""Building a student's own interface package at run time, into a cache, and making it importable in this process."""

import hashlib
import importlib
import json
import os
import platform
import re
import shutil
import site
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from filelock import FileLock

from course.errors import InterfaceError, ToolChainError
from course.foundation.folders import user_cache
from course.foundation.untrusted import read_regular_text
from course.interfaces.definition import Definition, near_types, parse, without_comments

# What the generated code of a service or an action uses beside the packages named in its fields.
IMPLIED = {
    "msg": set(),
    "srv": {"service_msgs", "builtin_interfaces"},
    "action": {"service_msgs", "builtin_interfaces", "action_msgs", "unique_identifier_msgs"},
}
LIBRARIES = (
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_fastrtps_cpp",
    "rosidl_typesupport_introspection_c",
    "rcutils",
    "rmw",
    "fastcdr",
)
# The libraries of a package whose messages a field uses.
PARTS_USED = (
    "rosidl_generator_c",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
    "rosidl_generator_py",
)
TOOL_CHAIN = (
    "ros-jazzy-rosidl-generator-c",
    "ros-jazzy-rosidl-generator-py",
    "ros-jazzy-rosidl-typesupport-c",
    "ros-jazzy-rosidl-typesupport-fastrtps-c",
    "ros-jazzy-common-interfaces",
    "numpy",
)
LARGEST = 1_000_000  # bytes of a definition
PACKAGE = re.compile(r"[a-z](_?[a-z0-9]+)*")
STARTING = ("sitecustomize", "usercustomize")  # imported by each Python at its start
COURSE = Path(__file__).parents[2]  # the folder in which the course's own packages are

# Called with a package's name before another build of it takes its place in this process.
on_replace: list[Callable[[str], None]] = []


@dataclass(frozen=True)
class Built:
    """A built package.  `prefix` is laid out as an installed ROS package: `share/`, Python under `site_packages`."""

    package: str
    prefix: Path

    @property
    def site_packages(self) -> Path:
        """The folder for `sys.path`."""
        return self.prefix / "lib" / "python"

    def variables(self, base: Mapping[str, str] = os.environ) -> dict[str, str]:
        """Return what a process needs to import the package: the search paths in `base`, with this package in front."""
        return {
            name: os.pathsep.join([str(folder), *(e for e in base.get(name, "").split(os.pathsep) if e)])
            for name, folder in (("PYTHONPATH", self.site_packages), ("AMENT_PREFIX_PATH", self.prefix))
        }

    def use(self) -> None:
        """Make the package importable here and in child processes, in the place of an earlier build of the same name.

        Fast DDS knows a type by its name: what uses the earlier build's types in this process must go first.  The
        listeners in `on_replace` see to that; the live session is one.
        """
        sys.path[:] = [str(self.site_packages), *self._others(sys.path)]
        base = {
            name: os.pathsep.join(self._others(os.environ.get(name, "").split(os.pathsep)))
            for name in ("PYTHONPATH", "AMENT_PREFIX_PATH")
        }
        os.environ.update(self.variables(base))
        loaded = sys.modules.get(self.package)
        if loaded and not Path(loaded.__path__[0]).is_relative_to(self.prefix):
            for listener in on_replace:
                listener(self.package)
            for name in [n for n in sys.modules if n == self.package or n.startswith(f"{self.package}.")]:
                del sys.modules[name]
        importlib.invalidate_caches()

    def _others(self, entries: Iterable[str]) -> list[str]:
        """`entries` without the builds of this package."""
        return [entry for entry in entries if not Path(entry).is_relative_to(self.prefix.parent)]


def cache_folder() -> Path:
    """Return the folder of builds: $COURSE_CACHE, or `ros2-course` in the user's cache folder."""
    return Path(os.environ.get("COURSE_CACHE", user_cache()))


def build(
    package: str, files: Mapping[str, str] | Iterable[str | Path], *, cache: Path | None = None, use: bool = True
) -> Built:
    """Build `package` from definitions and make it importable here and in child processes.

    `files` holds paths of `.msg`, `.srv` and `.action` files, or maps their names to their texts.  The build is kept
    under `cache` (default: `cache_folder()`) by content and versions, so that the same files are compiled once.  With
    `use=False` nothing is changed in this process.

    Raises InterfaceError, with the file and the line, when a definition or a name is not valid, and ToolChainError
    when the tool chain itself fails.
    """
    if not PACKAGE.fullmatch(package):
        raise InterfaceError(
            f"'{package}' is not a valid package name: use lower-case letters, digits and single underscores"
        )
    if use and (hidden := hides(package)):
        raise InterfaceError(f"{package} is {hidden}, which yours would hide: choose another name")
    texts = _read(files)
    definitions = [parse(text, name, package) for name, text in texts.items()]
    _check_types(package, definitions)
    folder = (cache or cache_folder()) / "interfaces" / package
    prefix = folder / _key(package, texts)
    if not prefix.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(f"{prefix}.lock"):
            if not prefix.exists():
                with tempfile.TemporaryDirectory(dir=folder) as scratch:
                    made = Path(scratch) / prefix.name
                    _build(package, texts, definitions, Path(scratch), made)
                    made.rename(prefix)
    built = Built(package, prefix)
    if use:
        built.use()
    return built


def hides(package: str) -> str:
    """Return what a package of this name would hide: a package of ROS 2, or an installed module; '' for nothing.

    ROS 2 is what lies beside rclpy, in the wheels or in a sourced ROS 2.  Packages of a workspace, other builds and
    files in the folder do not count.
    """
    prefixes = [Path(prefix) for prefix in (sys.prefix, *os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep))]
    of_ros = [prefix for prefix in prefixes if (prefix / "share" / "rclpy").is_dir()]
    if any((prefix / "share" / package / "package.xml").is_file() for prefix in of_ros):
        return "a package of ROS 2"
    if package in sys.stdlib_module_names or package in STARTING:
        return "a module of Python"
    places = [sysconfig.get_path("stdlib"), *site.getsitepackages()]
    places += [str(place) for prefix in of_ros for place in prefix.glob("lib/python3*/site-packages")]
    found = PathFinder.find_spec(package, places)
    if (COURSE / package / "__init__.py").is_file() or (found and found.origin):  # a mere folder has no origin
        return "an installed Python module"
    return ""


def identity(package: str, files: Mapping[str, str] | Iterable[str | Path]) -> str:
    """Return the name of a build's folder, which differs for other definitions; raises InterfaceError."""
    return _key(package, _read(files))


def _read(files: Mapping[str, str] | Iterable[str | Path]) -> dict[str, str]:
    if isinstance(files, str):
        raise InterfaceError("the definitions have names: write build('my_package', {'Half.srv': '''...'''})")
    if isinstance(files, Mapping):
        texts = dict(files)
    else:
        texts = {Path(file).name: read_definition(Path(file)) for file in files}
    if not texts:
        raise InterfaceError("a package needs at least one .msg, .srv or .action file")
    return dict(sorted(texts.items()))


def read_definition(file: Path) -> str:
    """Return the text of a definition's file; raises InterfaceError if it cannot be read, is too large or no text."""
    try:
        return read_regular_text(file, LARGEST)
    except OSError as error:
        raise InterfaceError(f"cannot read {error.filename}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InterfaceError("a definition must be UTF-8 text") from None
    except ValueError as error:
        raise InterfaceError(f"cannot read {file}: {error}") from None


def _key(package: str, texts: Mapping[str, str]) -> str:
    versions, own = _builder()
    return hashlib.sha256(json.dumps([package, texts, versions, own]).encode()).hexdigest()[:20]


@cache
def _builder() -> tuple[list[str], list[str]]:
    """Return the versions of the tools, and this package's own text.  Asked at every start of a node."""
    versions = [sys.version, platform.machine()]
    for distribution in TOOL_CHAIN:
        try:
            versions.append(f"{distribution} {version(distribution)}")
        except PackageNotFoundError:  # a sourced ROS 2
            versions.append(f"{distribution} {os.environ.get('ROS_DISTRO')}")
    return versions, [Path(__file__).with_name(name).read_text() for name in ("builder.py", "generate.py")]


def _prefixes() -> list[Path]:
    return [Path(prefix) for prefix in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)]


def _check_types(package: str, definitions: list[Definition]) -> None:
    own = {d.name for d in definitions if d.kind == "msg"}
    for definition in definitions:
        for field in (field for section in definition.sections for field in section):
            owner, _, name = field.type.partition("[")[0].partition("<")[0].partition("/")
            if not name or (owner == package and name in own):
                continue
            if not any((prefix / "share" / owner / "msg" / f"{name}.msg").exists() for prefix in _prefixes()):
                near = near_types(name)
                where = (
                    f"there is no type '{name}', and no {name}.msg beside it"
                    + (f"; did you mean {' or '.join(near)}?" if near else "")
                    if owner == package
                    else f"no installed package has a message {owner}/{name}"
                )
                raise InterfaceError(f"{definition.name}.{definition.kind}, field '{field.name}': {where}")


def _build(package: str, texts: Mapping[str, str], definitions: list[Definition], scratch: Path, prefix: Path) -> None:
    """Generate and compile in `scratch`, and install into `prefix`, whose name makes the libraries' names unique."""
    share = _install_definitions(package, texts, definitions, prefix)
    source, plain = scratch / "source", scratch / "plain"
    _lay_out({name: without_comments(text) for name, text in texts.items()}, plain)
    generator = [sys.executable, "-P", "-m", "course.interfaces.generate"]  # -P: imports nothing from this folder
    _run([*generator, package, plain, share, source], "generating the code")
    python = _install_python(package, source, prefix)
    # The type supports are loaded by names made from the package's: with the key in them, a later build of the same
    # package can be loaded beside this one.
    unique = f"{package}_{prefix.name}"
    for file in source.glob(f"{package}/*/*__type_support.cpp"):
        file.write_text(file.read_text().replace(f'\n  "{package}",\n', f'\n  "{unique}",\n'))
    objects = _compile(package, source, scratch)
    used = set().union(*(d.packages | IMPLIED[d.kind] for d in definitions)) - {package}
    _link(unique, python / f"{package}_s__", prefix / "lib", objects, used)


def _install_definitions(package: str, texts: Mapping[str, str], definitions: list[Definition], prefix: Path) -> Path:
    """Lay the definitions out as an installed package has them, and enter it in the ament index; returns its share."""
    share = prefix / "share" / package
    _lay_out(texts, share)
    interfaces = "\n".join(f"{d.kind}/{d.name}.{d.kind}" for d in definitions)
    for resource, content in (("packages", ""), ("rosidl_interfaces", interfaces)):
        marker = prefix / "share" / "ament_index" / "resource_index" / resource / package
        marker.parent.mkdir(parents=True)
        marker.write_text(content)
    return share


def _lay_out(texts: Mapping[str, str], folder: Path) -> None:
    """Write definitions to the subfolders of their kinds."""
    for name, text in texts.items():
        target = folder / name.rpartition(".")[2] / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")


def _install_python(package: str, source: Path, prefix: Path) -> Path:
    """Copy the generated Python modules; returns the folder of the Python package."""
    python = prefix / "lib" / "python" / package
    python.mkdir(parents=True)
    (python / "__init__.py").touch()
    for file in source.rglob("*.py"):
        target = python / file.relative_to(source / package)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, target)
    return python


def _compile(package: str, source: Path, scratch: Path) -> dict[Path, Path]:
    """Compile the generated sources on all cores; returns the object file of each."""
    includes = [source, source / package / "introspection", sysconfig.get_path("include"), _numpy_include()]
    for path in _prefixes():
        includes += [path / "include", *sorted((path / "include").glob("*/"))]
    flags = ["-O0", "-fPIC", "-w", f'-DROS_PACKAGE_NAME="{package}"', *(f"-I{folder}" for folder in includes)]
    sources = [file for file in source.rglob("*.c*") if file.suffix in (".c", ".cpp")]
    sources.sort(key=lambda file: file.suffix, reverse=True)  # C++ takes longest: first
    objects = {file: scratch / f"{number}.o" for number, file in enumerate(sources)}

    def compile_one(file: Path) -> None:
        compiler = "g++" if file.suffix == ".cpp" else "gcc"
        _run([compiler, *flags, "-c", file, "-o", objects[file]], f"compiling {file.name}")

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(compile_one, sources))
    return objects


def _link(unique: str, module: Path, lib: Path, objects: dict[Path, Path], used: set[str]) -> None:
    """Link the libraries into `lib`, and the Python module whose path begins with `module`, against `used` packages."""
    libraries = [*LIBRARIES, *(f"{name}__{part}" for name in sorted(used) for part in PARTS_USED)]
    search = [f"-L{lib}", "-Wl,-rpath,$ORIGIN", "-Wl,-rpath,$ORIGIN/../..", "-Wl,--no-as-needed"]
    for path in _prefixes():
        search += [f"-L{path / 'lib'}", f"-Wl,-rpath,{path / 'lib'}"]
    own: list[str] = []
    for part, sources in _parts(list(objects)).items():
        target = lib / f"lib{unique}__{part}.so"
        if part == "rosidl_typesupport_c":
            target = module.with_name(f"{module.name}{part}{sysconfig.get_config_var('EXT_SUFFIX')}")
        inputs = [*(objects[file] for file in sources), *search, *(f"-l{unique}__{name}" for name in own)]
        inputs += ["-Wl,--as-needed", *(f"-l{name}" for name in libraries)]
        _run(["g++", "-shared", f"-Wl,-soname,{target.name}", "-o", target, *inputs], "linking")
        own.append(part)


def _parts(sources: list[Path]) -> dict[str, list[Path]]:
    """The generated sources by the library that they belong to, in the order of linking."""
    parts: dict[str, list[Path]] = {
        "rosidl_generator_c": [],
        "rosidl_typesupport_fastrtps_c": [],
        "rosidl_typesupport_introspection_c": [],
        "rosidl_typesupport_c": [],
    }
    for file in sources:
        if "introspection" in file.parts:
            part = "rosidl_typesupport_introspection_c"
        elif file.name.endswith("__type_support_c.cpp"):
            part = "rosidl_typesupport_fastrtps_c"
        elif file.suffix == ".c" and file.parent.name == "detail":
            part = "rosidl_generator_c"
        else:  # the dispatch and the conversions to and from Python
            part = "rosidl_typesupport_c"
        parts[part].append(file)
    return parts


def _numpy_include() -> str:
    import numpy

    return numpy.get_include()


def _run(command: list, doing: str) -> None:
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    except FileNotFoundError:
        raise ToolChainError(f"{command[0]} is not installed: run environment/install") from None
    if done.returncode:
        raise ToolChainError(f"{doing} failed:\n{done.stderr[-2000:]}")
