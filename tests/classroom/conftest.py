"""A class on this machine, for all tests of this folder together.

ada, bob and the teacher are everybody's; carol and dan hand in and are graded in the tests of the pages alone; erin
forgets her password.
"""

import asyncio
import contextlib
import io
import os
import secrets
import shutil
import subprocess
import sys
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import pytest

from autograder.classroom import accounts, cli, course_files, hub
from autograder.classroom.members import Member
from autograder.classroom.plan import Classroom
from tests.classroom.visitor import Visitor
from tests.ports import free_port

T = TypeVar("T")

COMMAND = Path(__file__).parents[2] / "environment" / "classroom"
RELEASED = ("calculator", "services")
DATED = "ai_integration"  # the exercise that the hub releases at its date
SOON = 30  # s until then, in which the command that says so must have begun
ROSTER = "student,role\nada,\nbob,student\nteacher,instructor\n"


def run_classroom(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([COMMAND, *arguments], capture_output=True, text=True, timeout=600)


def call_classroom(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Have the command's own code do it, in this process: to start the command takes as long as most of what it does.

    The command line itself is proven by the tests that run it.
    """
    out, errors = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
        patch.setattr(sys, "argv", [str(COMMAND), *arguments])
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
            cli.main()
    return subprocess.CompletedProcess(arguments, ended.value.code or 0, out.getvalue(), errors.getvalue())


def run_apart(work: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in a thread of its own: a browser of another test may have an event loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


@pytest.fixture(scope="session")
def able():
    if os.geteuid() != 0:
        pytest.skip("a classroom makes users and namespaces, which takes root")
    missing = hub.missing_tools()
    if missing:
        pytest.skip(missing[0])


@pytest.fixture
def quiet(able, tmp_path):
    """A class that is written down, without Unix users and without a hub."""
    members = (Member("ada"), Member("bob"), Member("teacher", True))
    for around in tmp_path.parents:  # pytest's are closed to the users of the class, whose homes are in them
        if around.stat().st_mode & 0o005 != 0o005 and around.is_relative_to("/tmp"):
            around.chmod(around.stat().st_mode | 0o011)
    tmp_path.chmod(0o711)
    made = Classroom(tmp_path / "class", members, port=free_port(), prefix=f"p{secrets.token_hex(2)}-")
    course_files.make_folders(made)
    made.save()
    try:
        yield made
    finally:
        accounts.remove(made)
        shutil.rmtree(made.run)


@pytest.fixture(scope="session")
def up(able, tmp_path_factory):
    """The arguments of `up`, with which the class was started."""
    folder = tmp_path_factory.mktemp("classroom")
    for around in folder.parents:  # pytest's are closed to the users of the class, whose homes are in them
        if around.stat().st_mode & 0o005 != 0o005 and around.is_relative_to("/tmp"):
            around.chmod(around.stat().st_mode | 0o011)
    roster = folder / "roster.csv"
    roster.write_text(ROSTER.replace("role", "role,first_name,last_name") + "carol,,Carol,Lovelace\ndan,,,\nerin,,,\n")
    arguments = ["up", "--roster", str(roster), "--folder", str(folder / "class"), "--passwords", "dummy"]
    arguments += ["--port", str(free_port()), "--prefix", f"t{secrets.token_hex(2)}-"]
    done = run_classroom(*arguments)
    try:
        assert done.returncode == 0, done.stdout + done.stderr
        assert "FOR TRIALS ONLY" in done.stdout
        assert "Each server has its own address, NAME.localhost" in done.stdout
        assert "Drafts, which no student sees: " in done.stdout and "Released" not in done.stdout
        done = run_classroom("release", *RELEASED, "--folder", str(folder / "class"))
        assert done.returncode == 0, done.stdout + done.stderr
        soon = f"{datetime.now(UTC) + timedelta(seconds=SOON):%Y-%m-%d %H:%M:%S UTC}"
        done = run_classroom("release", DATED, "--at", soon, "--folder", str(folder / "class"))
        assert done.returncode == 0 and "Released" not in done.stdout, done.stdout + done.stderr
        yield arguments
    finally:
        if (folder / "class").exists():
            down = run_classroom("down", "--folder", str(folder / "class"), "--delete-homes")
            assert down.returncode == 0, down.stderr  # otherwise its processes and users would stay
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def classroom(up) -> Classroom:
    return Classroom.load(Path(up[up.index("--folder") + 1]))


@pytest.fixture(scope="session")
def come_in(classroom):
    """Log in as somebody, with a running server."""

    def visit(name: str) -> Visitor:
        known = hub.shared_passwords(classroom)
        visitor = Visitor(classroom.address_of(classroom.find(name)), name)
        assert visitor.log_in(known["instructors" if classroom.find(name).instructor else "students"])
        return visitor.start()

    return visit


@pytest.fixture(scope="session")
def ada(come_in):
    return come_in("ada")


@pytest.fixture(scope="session")
def bob(come_in):
    return come_in("bob")


@pytest.fixture(scope="session")
def teacher(come_in):
    return come_in("teacher")


@pytest.fixture
def kernel():
    """A new kernel of somebody, ended after the test."""
    kernels = []

    def start(visitor: Visitor, folder: str = ""):
        kernels.append(visitor.kernel(folder))
        return kernels[-1]

    yield start
    for each in kernels:
        each.close()
