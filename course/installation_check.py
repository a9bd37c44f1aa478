"""`course doctor`: checks that a student can work here, and that an instructor could grade here."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from course.errors import CheckError

INSTALL = "run environment/install"


@dataclass(frozen=True)
class Check:
    """One line of the table: `test` returns a finding or raises; `cure` says what to do about a failure."""

    title: str
    test: Callable[[], str]
    cure: str
    student: bool = True


def interpreter() -> str:
    """Return the version of this Python."""
    version = ".".join(map(str, sys.version_info[:3]))
    if not (3, 11) <= sys.version_info[:2] <= (3, 13):
        raise CheckError(f"Python {version}")
    return f"Python {version} in {sys.prefix}"


def client_library() -> str:
    """Return the source of rclpy."""
    import rclpy

    from course import environment

    return f"rclpy in {Path(rclpy.__file__).parent}" + (" (a sourced ROS 2)" if environment.sourced() else "")


def middleware() -> str:
    """Return the name of the middleware that rclpy uses."""
    from rclpy.utilities import get_rmw_implementation_identifier

    return get_rmw_implementation_identifier()


def interfaces() -> str:
    """Check the interface packages that environment/install builds."""
    from course_interfaces.action import Fibonacci
    from example_interfaces.srv import AddTwoInts

    if Fibonacci.Feedback().get_fields_and_field_types() != {"partial_sequence": "sequence<int32>"}:
        raise CheckError("course_interfaces/action/Fibonacci is not the one of this course")
    return f"{AddTwoInts.__module__.split('.')[0]}, {Fibonacci.__module__.split('.')[0]}"


def build() -> str:
    """Check that a student's definition can be compiled."""
    from course.interfaces import build as build_interface

    with tempfile.TemporaryDirectory() as cache:
        build_interface("doctor_interfaces", {"Ping.srv": "int32 a\n---\nint32 b\n"}, cache=Path(cache), use=False)
    return "a .srv was compiled"


def round_trip() -> str:
    """Check that a service call gets its response."""
    from example_interfaces.srv import AddTwoInts
    from rclpy.node import Node

    from course.session.live import Session

    class Adder(Node):
        def __init__(self) -> None:
            super().__init__("doctor_adder")
            self.create_service(AddTwoInts, "doctor_add", self.add)

        def add(self, request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
            response.sum = request.a + request.b
            return response

    session = Session()
    try:
        session.start(Adder)
        total = session.call("doctor_add", AddTwoInts, a=2, b=3).sum
    finally:
        session.close()
    if total != 5:
        raise CheckError(f"2 + 3 gave {total}")
    return f"2 + 3 = {total} over ROS domain {session.domain_id}"


def kernel() -> str:
    """Check that a notebook's kernel starts and holds a live session."""
    from jupyter_client.manager import start_new_kernel

    manager, client = start_new_kernel(kernel_name="python3", startup_timeout=30, stderr=subprocess.DEVNULL)
    try:
        reply = client.execute_interactive("import course; course.live()", timeout=30, output_hook=lambda _: None)
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    if reply["content"]["status"] != "ok":
        raise CheckError(f"{reply['content']['ename']}: {reply['content']['evalue']}")
    return "a kernel started, and a live session worked in it"


def bubblewrap() -> str:
    """Return the version of bubblewrap."""
    program = shutil.which("bwrap")
    if not program:
        raise CheckError("bwrap is not installed")
    return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()


def namespaces() -> str:
    """Check that this user may make namespaces for confining a program."""
    command = ["unshare", "-n"] if os.getuid() == 0 else ["unshare", "-Urn"]
    inner = (
        "ip link set lo up && bwrap --ro-bind / / --dev /dev --proc /proc --unshare-user --unshare-pid "
        "--unshare-ipc --unshare-uts true"
    )
    done = subprocess.run([*command, "sh", "-c", inner], capture_output=True, text=True, timeout=20)
    if done.returncode:
        raise CheckError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "refused")
    return "network, user, process and IPC namespaces"


CHECKS = (
    Check("interpreter", interpreter, "install Python 3.11, 3.12 or 3.13, then " + INSTALL),
    Check("ROS 2 client library", client_library, INSTALL),
    Check("middleware", middleware, INSTALL),
    Check("interface packages", interfaces, INSTALL + "; it builds them with g++"),
    Check("building a .srv", build, "install g++ and python3-dev, then " + INSTALL),
    Check(
        "service round trip", round_trip, "allow UDP on the loopback interface; unset ROS_DOMAIN_ID and RMW_* settings"
    ),
    Check("notebook kernel", kernel, INSTALL + "; remove a 'python3' kernel of your own: jupyter kernelspec list"),
    Check("bubblewrap", bubblewrap, "install bubblewrap (for grading only)", student=False),
    Check(
        "namespaces",
        namespaces,
        "allow user namespaces: sysctl kernel.unprivileged_userns_clone=1, "
        "or kernel.apparmor_restrict_unprivileged_userns=0 on Ubuntu (for grading only)",
        student=False,
    ),
)


def brief(checks: tuple[Check, ...] = CHECKS) -> int:
    """Run the checks that a student needs and print a line for each; 1 if a student could not work, else 0."""
    failed = False
    for check in checks:
        if not check.student:
            continue
        try:
            with _quiet():
                check.test()
            print(f"ok  {check.title}", flush=True)
        except Exception as error:
            failed = True
            line = str(error).strip().splitlines() or [type(error).__name__]
            print(f"no  {check.title}: {line[0]}: {check.cure}", flush=True)
    return int(failed)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hide the middleware's messages on stderr about ports in use: the check itself reports."""
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def report(checks: tuple[Check, ...] = CHECKS, console: Console | None = None) -> int:
    """Run the checks and print a table; 1 if a student could not work, else 0.  A terminal shows which one runs."""
    console = console or Console()
    table = Table(title="course doctor")
    table.add_column("")
    table.add_column("check")
    table.add_column("found, or what to do", overflow="fold")
    failed = False
    with console.status("") as status:
        for check in checks:
            status.update(f"checking: {check.title}")
            try:
                table.add_row("[green]ok[/]", check.title, check.test())
            except Exception as error:
                failed |= check.student
                line = str(error).strip().splitlines() or [type(error).__name__]
                told = f"{line[0]}: {check.cure}"
                table.add_row("[red]no[/]" if check.student else "[yellow]no[/]", check.title, told)
    console.print(table)
    return int(failed)
