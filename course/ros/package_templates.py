"""The files of a new package, as `ros2 pkg create` writes them: they build with colcon unchanged."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from xml.sax.saxutils import escape, quoteattr

LINTERS = ("ament_copyright", "ament_flake8", "ament_pep257")
SETUP = """\
from setuptools import find_packages, setup

package_name = {name!r}

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer={maintainer!r},
    maintainer_email={email!r},
    description={description!r},
    license={license!r},
    tests_require=['pytest'],
    entry_points={{
        'console_scripts': [
{scripts}        ],
    }},
)
"""
SETUP_CFG = """\
[develop]
script_dir=$base/lib/{name}
[install]
install_scripts=$base/lib/{name}
"""
PYTHON_NODE = """\
def main():
    print('Hi from {name}.')


if __name__ == '__main__':
    main()
"""
TEST = """\
import pytest

linter = pytest.importorskip('ament_{mark}.main', reason='ament_{mark} is not installed')


{skip}@pytest.mark.{mark}
@pytest.mark.linter
def test_{mark}():
    assert linter.{call}, 'Found code style errors / warnings'
"""
TESTS = {
    "copyright": (
        "@pytest.mark.skip(reason='The source files have no copyright header yet.')\n",
        "main(argv=['.', 'test']) == 0",
    ),
    "flake8": ("", "main_with_errors(argv=[])[0] == 0"),
    "pep257": ("", "main(argv=['.', 'test']) == 0"),
}
CPP_NODE = """\
#include <cstdio>

int main(int argc, char ** argv)
{{
  (void) argc;
  (void) argv;

  printf("hello world {name} package\\n");
  return 0;
}}
"""
HEADER = """\
#ifndef {guard}
#define {guard}

#include "{name}/visibility_control.h"

namespace {name}
{{

class {type}
{{
public:
  {type}();

  virtual ~{type}();
}};

}}  // namespace {name}

#endif  // {guard}
"""
SOURCE = """\
#include "{name}/{library}.hpp"

namespace {name}
{{

{type}::{type}()
{{
}}

{type}::~{type}()
{{
}}

}}  // namespace {name}
"""
VISIBILITY = """\
#ifndef {upper}__VISIBILITY_CONTROL_H_
#define {upper}__VISIBILITY_CONTROL_H_

#if defined _WIN32 || defined __CYGWIN__
  #ifdef {upper}_BUILDING_LIBRARY
    #define {upper}_PUBLIC __declspec(dllexport)
  #else
    #define {upper}_PUBLIC __declspec(dllimport)
  #endif
  #define {upper}_LOCAL
#else
  #define {upper}_PUBLIC __attribute__ ((visibility("default")))
  #define {upper}_LOCAL __attribute__ ((visibility("hidden")))
#endif

#endif  // {upper}__VISIBILITY_CONTROL_H_
"""
CMAKE_HEAD = """\
cmake_minimum_required(VERSION 3.8)
project({name})

if(CMAKE_COMPILER_IS_GNUCXX OR CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  add_compile_options(-Wall -Wextra -Wpedantic)
endif()
"""
NO_DEPENDENCIES = """\
# uncomment the following section in order to fill in
# further dependencies manually.
# find_package(<dependency> REQUIRED)
"""
LIBRARY = """\

add_library({library}{shared} src/{library}.cpp)
target_compile_features({library} PUBLIC c_std_99 cxx_std_17)
target_include_directories({library} PUBLIC
  $<BUILD_INTERFACE:${{CMAKE_CURRENT_SOURCE_DIR}}/include>
  $<INSTALL_INTERFACE:include/${{PROJECT_NAME}}>)
target_compile_definitions({library} PRIVATE "{upper}_BUILDING_LIBRARY")
{link}
install(DIRECTORY include/ DESTINATION include/${{PROJECT_NAME}})
install(
  TARGETS {library}
  EXPORT export_${{PROJECT_NAME}}
  ARCHIVE DESTINATION lib
  LIBRARY DESTINATION lib
  RUNTIME DESTINATION bin
)
"""
EXECUTABLE = """\

add_executable({node} src/{node}.cpp)
target_compile_features({node} PUBLIC c_std_99 cxx_std_17)
target_include_directories({node} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}}/include)
{link}
install(TARGETS {node} DESTINATION lib/${{PROJECT_NAME}})
"""
AMENT_TESTS = """\

if(BUILD_TESTING)
  find_package(ament_lint_auto REQUIRED)
  # These two linters need a copyright header in each source file; remove the lines when there is one.
  set(ament_cmake_copyright_FOUND TRUE)
  set(ament_cmake_cpplint_FOUND TRUE)
  ament_lint_auto_find_test_dependencies()
endif()
"""
AMENT_EXPORTS = """\

ament_export_include_directories("include/${{PROJECT_NAME}}")
ament_export_libraries({library})
ament_export_targets(export_${{PROJECT_NAME}})
"""
CONFIG_INSTALL = """\

include(CMakePackageConfigHelpers)
configure_package_config_file(
  ${PROJECT_NAME}Config.cmake.in ${PROJECT_NAME}Config.cmake INSTALL_DESTINATION share/${PROJECT_NAME}/cmake)
configure_file(${PROJECT_NAME}ConfigVersion.cmake.in ${PROJECT_NAME}ConfigVersion.cmake @ONLY)
install(
  FILES ${CMAKE_CURRENT_BINARY_DIR}/${PROJECT_NAME}Config.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/${PROJECT_NAME}ConfigVersion.cmake
  DESTINATION share/${PROJECT_NAME}/cmake
)
install(FILES package.xml DESTINATION share/${PROJECT_NAME})
"""
EXPORT_INSTALL = """\
install(
  EXPORT export_${PROJECT_NAME}
  FILE export_${PROJECT_NAME}.cmake
  DESTINATION share/${PROJECT_NAME}/cmake
)
"""
CONFIG_VERSION = """\
set(PACKAGE_VERSION "0.0.0")
if(NOT PACKAGE_VERSION VERSION_LESS "${PACKAGE_FIND_VERSION}")
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
endif()
if(PACKAGE_VERSION VERSION_EQUAL "${PACKAGE_FIND_VERSION}")
  set(PACKAGE_VERSION_EXACT TRUE)
endif()
"""


class NewPackage(NamedTuple):
    """The command line's description of a new package; without a node or a library its name is empty."""

    name: str
    format: int
    description: str
    maintainer: str
    email: str
    license: str
    build_type: str
    dependencies: tuple[str, ...]
    node: str
    library: str


class Step(NamedTuple):
    """A file to write below the package's folder, a folder to create if there is no text, or a line to print."""

    path: str = ""
    text: str | None = None
    note: str = ""


def steps(package: NewPackage) -> Iterator[Step]:
    """Yield the steps of creating a package, in ros2cli's order."""
    yield Step("package.xml", manifest(package))
    if package.build_type == "ament_python":
        yield from _python_steps(package)
    else:
        yield Step(note="creating source and include folder")
        yield Step("src")
        yield Step(f"include/{package.name}")
        yield from _cmake_steps(package)


def _python_steps(package: NewPackage) -> Iterator[Step]:
    name = package.name
    yield Step(note="creating source folder")
    yield Step(name)
    script = f"            '{package.node} = {name}.{package.node}:main',\n" if package.node else ""
    yield Step("setup.py", SETUP.format(**package._asdict(), scripts=script))
    yield Step("setup.cfg", SETUP_CFG.format(name=name))
    yield Step("resource")
    yield Step(f"resource/{name}", "")
    yield Step(f"{name}/__init__.py", "")
    yield Step("test")
    for mark, (skip, call) in TESTS.items():
        text = TEST.format(mark=mark, skip=skip, call=call)
        yield Step(f"test/test_{mark}.py", text)
    if package.node:
        yield Step(f"{name}/{package.node}.py", PYTHON_NODE.format(name=name))
    if package.library:
        yield Step(f"{name}/{package.library}")
        yield Step(f"{name}/{package.library}/__init__.py", "")


def _cmake_steps(package: NewPackage) -> Iterator[Step]:
    name, library = package.name, package.library
    if package.build_type == "ament_cmake":
        yield Step("CMakeLists.txt", ament_cmake_lists(package))
    else:
        yield Step("CMakeLists.txt", cmake_lists(package))
        targets = f'include("${{CMAKE_CURRENT_LIST_DIR}}/export_{name}.cmake")\n' if library else ""
        yield Step(f"{name}Config.cmake.in", f"@PACKAGE_INIT@\n\n{targets}")
        yield Step(f"{name}ConfigVersion.cmake.in", CONFIG_VERSION)
    if package.node:
        yield Step(f"src/{package.node}.cpp", CPP_NODE.format(name=name))
    if library:
        words = {
            "name": name,
            "library": library,
            "type": library.replace("_", " ").title().replace(" ", ""),
            "guard": f"{name}__{library}_HPP_".upper(),
            "upper": name.upper(),
        }
        yield Step(f"include/{name}/{library}.hpp", HEADER.format(**words))
        yield Step(f"src/{library}.cpp", SOURCE.format(**words))
        yield Step(f"include/{name}/visibility_control.h", VISIBILITY.format(**words))


def manifest(package: NewPackage) -> str:
    """Return the package.xml."""
    groups: list[tuple[str, tuple[str, ...]]] = [("depend", package.dependencies)]
    if package.build_type == "ament_cmake":
        tool = "ament_cmake_ros" if package.library else "ament_cmake"
        groups.insert(0, ("buildtool_depend", (tool,)))
        groups.append(("test_depend", ("ament_lint_auto", "ament_lint_common")))
    elif package.build_type == "ament_python":
        groups.append(("test_depend", (*LINTERS, "python3-pytest")))
    depends = "".join(
        "".join(f"  <{tag}>{escape(name)}</{tag}>\n" for name in names) + "\n" for tag, names in groups if names
    )
    schema = f"http://download.ros.org/schema/package_format{package.format}.xsd"
    return f"""\
<?xml version="1.0"?>
<?xml-model href="{schema}" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="{package.format}">
  <name>{package.name}</name>
  <version>0.0.0</version>
  <description>{escape(package.description)}</description>
  <maintainer email={quoteattr(package.email)}>{escape(package.maintainer)}</maintainer>
  <license>{escape(package.license)}</license>

{depends}  <export>
    <build_type>{package.build_type}</build_type>
  </export>
</package>
"""


def _targets(package: NewPackage, link: str, shared: str = "") -> str:
    """Return the lines of CMakeLists.txt for library and node; `link` gives a target {} its dependencies."""
    text = ""
    dependencies = link if package.dependencies else ""
    if package.library:
        own = dependencies.replace("{}", package.library)
        text += LIBRARY.format(library=package.library, upper=package.name.upper(), shared=shared, link=own)
    if package.node:
        own = dependencies.replace("{}", package.node)
        if package.library:
            own = f"target_link_libraries({package.node} {package.library})\n"
        text += EXECUTABLE.format(node=package.node, link=own)
    return text


def _found(package: NewPackage) -> str:
    return "".join(f"find_package({name} REQUIRED)\n" for name in package.dependencies) or NO_DEPENDENCIES


def ament_cmake_lists(package: NewPackage) -> str:
    """Return the CMakeLists.txt of a package that is built with ament_cmake."""
    text = CMAKE_HEAD.format(name=package.name) + "\n# find dependencies\nfind_package(ament_cmake REQUIRED)\n"
    if package.library:
        text += "find_package(ament_cmake_ros REQUIRED)\n"
    text += _found(package)
    text += _targets(package, f"ament_target_dependencies({{}} {' '.join(package.dependencies)})\n")
    text += AMENT_TESTS
    if package.library:
        text += AMENT_EXPORTS.format(library=package.library)
    return text + "\nament_package()\n"


def cmake_lists(package: NewPackage) -> str:
    """Return the CMakeLists.txt of a package that is built with plain CMake."""
    libraries = " ".join(f"${{{name}_LIBRARIES}}" for name in package.dependencies)
    text = CMAKE_HEAD.format(name=package.name) + "\n# find dependencies\n" + _found(package)
    text += _targets(package, f"target_link_libraries({{}} {libraries})\n", shared=" SHARED")
    return text + CONFIG_INSTALL + (EXPORT_INSTALL if package.library else "")
