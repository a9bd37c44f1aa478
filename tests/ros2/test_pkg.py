"""`ros2 pkg` finds packages and begins new ones as ros2cli does."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

CREATED = """\
going to create a new package
package name: my_robot
destination directory: {folder}
package format: 3
version: 0.0.0
description: Drives & turns
maintainer: ['Ada <ada@robots.edu>']
licenses: ['MIT']
build type: ament_python
dependencies: ['rclpy', 'std_srvs']
node_name: driver
creating folder ./my_robot
creating ./my_robot/package.xml
creating source folder
creating folder ./my_robot/my_robot
creating ./my_robot/setup.py
creating ./my_robot/setup.cfg
creating folder ./my_robot/resource
creating ./my_robot/resource/my_robot
creating ./my_robot/my_robot/__init__.py
creating folder ./my_robot/test
creating ./my_robot/test/test_copyright.py
creating ./my_robot/test/test_flake8.py
creating ./my_robot/test/test_pep257.py
creating ./my_robot/my_robot/driver.py
"""
UNKNOWN_LICENSE = """

[WARNING]: Unknown license 'TODO: License declaration'.  This has been set in the package.xml, but no LICENSE file has \
been created.
It is recommended to use one of the ament license identifiers:
Apache-2.0
BSL-1.0
BSD-2.0
BSD-2-Clause
BSD-3-Clause
GPL-3.0-only
LGPL-3.0-only
MIT
MIT-0
"""


@pytest.fixture
def prefix(tmp_path) -> Path:
    """An installation with one package, `walker`, that has two executables."""
    folder = tmp_path / "installed"
    for path, text in {
        "share/ament_index/resource_index/packages/walker": "",
        "share/ament_index/resource_index/packages/bare": "",
        "share/ament_index/resource_index/packages/broken": "",
        "share/walker/package.xml": '<package format="3"><name>walker</name><version>1.2.3</version></package>',
        "share/broken/package.xml": "<package>",
        "lib/walker/walk": "",
        "lib/walker/tools/measure": "",
        "lib/walker/notes.txt": "",
    }.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        file.chmod(0o755 if "." not in file.name else 0o644)
    return folder


def test_what_is_installed(alone, prefix):
    """Names, executables, folders and manifests."""
    environment = {"AMENT_PREFIX_PATH": str(prefix)}
    names = alone.output("pkg", "list", **environment).splitlines()
    assert names == sorted(names) and {"bare", "walker", "rclpy"} <= set(names)
    assert alone.output("pkg", "executables", "walker", **environment) == "walker measure\nwalker walk\n"
    assert "\nwalker walk\n" in alone.output("pkg", "executables", **environment)
    assert alone.output("pkg", "executables", "--full-path", "walker", **environment) == (
        f"{prefix}/lib/walker/tools/measure\n{prefix}/lib/walker/walk\n"
    )
    assert alone.output("pkg", "prefix", "walker", **environment) == f"{prefix}\n"
    assert alone.output("pkg", "prefix", "--share", "walker", **environment) == f"{prefix}/share/walker\n"
    assert alone.output("pkg", "xml", "walker", "-t", "version", **environment) == "1.2.3\n"
    assert alone.output("pkg", "xml", "walker", **environment).startswith('<package format="3"><name>walker</name>')


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("executables nowhere", "Package 'nowhere' not found\n"),
        ("prefix nowhere", "Package not found\n"),
        ("prefix --share nowhere", "Package not found\n"),
        ("xml nowhere", "Package not found\n"),
        ("xml bare", "Package XML manifest not found\n"),
        ("xml walker -t author", "XML tag not found\n"),
        ("xml broken", "'{prefix}/share/broken/package.xml' is not valid XML: no element found: line 1, column 9\n"),
    ],
)
def test_what_is_not_there(alone, prefix, words, message):
    """ros2cli's messages, status 1; a broken manifest is told with its place."""
    done = alone("pkg", *words.split(), AMENT_PREFIX_PATH=str(prefix))
    assert (done.returncode, done.stdout, done.stderr) == (1, "", message.format(prefix=prefix))


def test_the_executables_of_a_package_in_this_folder(alone, tmp_path):
    """The files that `ros2 run` would find there are listed."""
    (tmp_path / "my_package").mkdir()
    (tmp_path / "my_package" / "node.py").write_text("")
    assert alone.output("pkg", "executables", "my_package", cwd=tmp_path) == "my_package node.py\n"


def create(command, folder, *words: str, name: str = "my_robot", **more):
    """Run `pkg create` with a maintainer."""
    who = ("--maintainer-name", "Ada", "--maintainer-email", "ada@robots.edu")
    return command("pkg", "create", name, *who, *words, cwd=folder, **more)


def test_create_a_python_package(alone, tmp_path):
    """Its output is that of ros2cli; its manifest is valid, its node runs, and a second time changes nothing."""
    words = (
        "--build-type", "ament_python", "--license", "MIT", "--node-name", "driver", "--description", "Drives & turns",
        "--dependencies", "rclpy", "std_srvs",
    )  # fmt: skip
    done = create(alone, tmp_path, *words)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", CREATED.format(folder=tmp_path))
    package = parse_package(str(tmp_path / "my_robot"))
    # A description may have tags, so that catkin_pkg leaves it as it is written.
    assert (package.description, package.licenses) == ("Drives &amp; turns", ["MIT"])
    assert [str(each) for each in package.build_depends] == ["rclpy", "std_srvs"]
    assert package.get_build_type() == "ament_python"
    assert (tmp_path / "my_robot" / "LICENSE").read_text().startswith("Permission is hereby granted, free of charge")
    assert "'driver = my_robot.driver:main'" in (tmp_path / "my_robot" / "setup.py").read_text()
    for file in (tmp_path / "my_robot").rglob("*.py"):
        ast.parse(file.read_text())
    assert alone.output("run", "my_robot", "driver", cwd=tmp_path) == "Hi from my_robot.\n"
    again = create(alone, tmp_path, *words)
    assert (again.returncode, again.stdout) == (1, "")
    assert again.stderr == (
        "\nAborted!\nThe directory already exists: ./my_robot\n"
        "Either remove the directory or choose a different destination directory or package name\n"
    )


@pytest.mark.parametrize("build_type", ["ament_cmake", "cmake"])
def test_create_a_package_that_cmake_builds(alone, tmp_path, build_type):
    """Library and node, without change."""
    done = create(
        alone, tmp_path, "--build-type", build_type, "--library-name", "legs", "--node-name", "legs", name="walker"
    )
    assert done.returncode == 0
    assert done.stderr == (
        "[WARNING] node name can not be equal to the library name\n[WARNING] renaming node to legs_node\n"
    )
    assert done.stdout.endswith(UNKNOWN_LICENSE.replace("\n", "", 1))
    assert not (tmp_path / "walker" / "LICENSE").exists()
    source, build, prefix = tmp_path / "walker", tmp_path / "build", tmp_path / "prefix"
    tools = {
        **os.environ,
        "PATH": str(Path(sys.executable).parent) + os.pathsep + os.environ["PATH"],
        "CMAKE_PREFIX_PATH": os.environ["AMENT_PREFIX_PATH"],
    }
    for command in (
        ["cmake", "-S", source, "-B", build, f"-DCMAKE_INSTALL_PREFIX={prefix}", "-DBUILD_TESTING=OFF"],
        ["cmake", "--build", build, "--target", "install"],
    ):
        made = subprocess.run(command, env=tools, capture_output=True, text=True)
        assert made.returncode == 0, made.stdout + made.stderr
    said = subprocess.run([prefix / "lib" / "walker" / "legs_node"], capture_output=True, text=True).stdout
    assert said == "hello world walker package\n"
    assert (prefix / "include" / "walker" / "walker" / "legs.hpp").exists()


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        (
            "My-Robot",
            (),
            (
                "'My-Robot' cannot be the name of a package: "
                "it consists of lower-case letters, digits and single underscores, and begins with a letter\n"
            ),
        ),
        (
            "test",
            ("--build-type", "ament_python"),
            "Aborted since 'ament_python' packages can't be named 'test'. Please choose a different package name.\n",
        ),
        ("robot", ("--destination-directory", "/proc/nowhere"), "No such file or directory: '/proc/nowhere"),
    ],
)
def test_create_refuses(alone, tmp_path, name, words, message):
    """One line, status 1, and nothing is left behind."""
    done = create(alone, tmp_path, *words, name=name)
    assert done.returncode == 1 and done.stderr.startswith(message)
    assert not any(tmp_path.iterdir())


def test_the_licenses(alone):
    """`?` lists them."""
    said = alone.output("pkg", "create", "x", "--license", "?")
    assert said.startswith("Supported licenses:\nApache-2.0\nBSL-1.0\n") and said.endswith("\nMIT\nMIT-0\n")
