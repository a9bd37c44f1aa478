"""The start of public checks: the files as they lie there, started afresh, and nobody else under their names."""

import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from rclpy.action import ActionClient
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from course.errors import ExerciseError, LiveError, NodeFailed
from course.interfaces.builder import build
from course.interfaces.definition import SECTIONS
from course.interfaces.kept import packages
from course.notebook.file_differences import refusal_of
from course.session.failure_report import of_program
from course.session.hints import type_name
from course.session.live import live
from course.session.node_process import NodeProcess
from course.session.source import blocked
from course.session.watch import Handle

# Python itself tells where a program hangs, and ends it (`faulthandler`), whatever the program waits for.
WATCHED = "import faulthandler; faulthandler.dump_traceback_later({timeout}, exit=True)"
LATE = "Timeout ("  # how that report begins


def judge(
    file: str, *arguments: object, names: tuple[str, ...] = (), parameters: Mapping[str, object] | None = None
) -> Handle:
    """Start the program `file`, as it lies there, for the check that follows.

    `names` are the services, actions and topics that the check uses.  Raises ExerciseError for a file that is not what
    its cell was to write, LiveError while another node serves one of the names, and what `ros.start` raises.
    """
    as_it_lies(file)
    session = live()
    if file in {row.started_as for row in session.rows()}:
        session.stop(file)
    for name in names:
        for who, ending in session.others(name):
            raise LiveError(f"{file} cannot be judged while {who} uses {name}, too. To end it: {ending}.")
    return session.start(file, *arguments, parameters=parameters)


def meet(*ends: Publisher | Subscription | ActionClient, timeout: float = 5.0) -> None:
    """Wait until another node has the other end of these; raises LiveError that says why none has."""
    session = live()
    for end in ends:
        if isinstance(end, ActionClient):
            if not session.until(end.server_is_ready, timeout):
                raise LiveError(session.apart(end))
            continue
        count = end.get_subscription_count if isinstance(end, Publisher) else end.get_publisher_count
        if not session.until(count, timeout):
            raise LiveError(session.apart(end))


def busy(process: Handle, service: str = "") -> str:
    """Return where a program is that does not get on, as lines to put below what it has not done; '' if it waits.

    With a `service` also why its callback may never answer, where its text shows that.
    """
    if not isinstance(process, NodeProcess):
        return ""
    why = blocked(process.source, service) if service else ""
    found = ["", f"{process.name}: {why}"] if why else []
    first, second = process.doing(), process.doing()
    if first and second and first[-1].function == second[-1].function:
        found += [*([] if found else [""]), f"{process.name} is here:", *map(str, second)]
    return "\n".join(found)


def fields(section: type) -> dict[str, str]:
    """Return the fields of a request, a response or a message, with their types as a definition writes them."""
    return {name: type_name(kind) for name, kind in section.get_fields_and_field_types().items()}  # type: ignore[attr-defined]


def run(source: str, *arguments: str, file: str, timeout: float = 5.0) -> str:
    """Run Python's `source` in a process of its own, and return what it printed.

    It uses `file`, which is judged.  Raises NodeFailed with the lines of that file where it failed, or where it still
    was after `timeout` s.
    """
    as_it_lies(file)
    done = subprocess.run(
        [sys.executable, "-c", f"{WATCHED.format(timeout=timeout)}\n{source}", *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    place = rf'File ".*{re.escape(file)}", line (\d+) in (.+)'
    if LATE in done.stderr and (late := re.search(place, done.stderr)):
        number = int(late[1])
        code = Path(file).read_text(errors="replace").splitlines()[number - 1 : number]
        raise NodeFailed(
            f"{file} had not answered after {timeout:g} s. It was here:\n"
            f"  {file}, line {number}, in {late[2]}\n    {''.join(code).strip()}"
        )
    if done.returncode:
        raise NodeFailed(str(of_program(Path(file), done.stderr, done.returncode)))
    return done.stdout


def as_it_lies(*files: str) -> None:
    """Raise ExerciseError if one of the files is not what a run of its cell has left.

    An interface is built again when its file has changed; raises InterfaceError when it cannot be built.
    """
    for name in files:
        path = Path(name)
        if why := refusal_of(path):
            raise ExerciseError(
                f"{name} is still the one before the last run of its cell, which was refused: {why}\n"
                "Mend the cell and run it, then check again."
            )
        if not path.is_file():
            raise ExerciseError(f"{name} is not there, beside the notebook: run its cell, then check again.")
        if path.suffix[1:] in SECTIONS:
            _build(name)


def _build(name: str) -> None:
    known = next((kept for kept in packages(Path()) if name in kept.files), None)
    if known is None:
        raise ExerciseError(f"{name} was not built here: run its cell, then check again.")
    build(known.package, [Path(file) for file in known.files])
