"""A shell, or one command, in the course's world: `environment/shell [--session NUMBER] [COMMAND...]`.

It has the course's Python and `ros2`, the middleware's profile, the interface packages that were built in the folder it
stands in, and the ROS domain of that folder: it meets the nodes of the notebook that runs there.  A shell that changes
into another folder joins that folder's session.
"""

import os
import shlex
import sys
from pathlib import Path

from course import environment, registry
from course.errors import LiveError
from course.interfaces import kept
from course.session.domains import shell_domain

BASHRC = Path(__file__).parent / "bashrc"
# What a shell hands on to its later looks (`--refresh`).
FIXED = "COURSE_SESSION"  # the session that was asked for, by --session
SHELL = "COURSE_SHELL"  # the process of the shell
USAGE = "Usage: environment/shell [--session NUMBER] [COMMAND...]"


def main(words: list[str]) -> int:
    """Become the shell or the command; returns an exit status only when that fails."""
    if words[:1] == ["--refresh"]:
        print(exports(Path.cwd(), int(os.environ[SHELL]), os.environ.get(FIXED, "")))
        return 0
    session = ""
    if words[:1] == ["--session"]:
        session, words = words[1] if len(words) > 1 else "", words[2:]
        if not session.isdigit():
            print(USAGE, file=sys.stderr)
            return 2
    try:
        variables = join(Path.cwd(), os.getpid(), session)
    except LiveError as error:
        print(f"environment/shell: {error}", file=sys.stderr)
        return 2
    os.environ.update(variables)
    command = words or ["bash", "--rcfile", str(BASHRC), "-i"]
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"environment/shell: {command[0]}: {error.strerror}", file=sys.stderr)
        return 127


def join(folder: Path, shell: int, session: str = "") -> dict[str, str]:
    """The variables of a shell, the process `shell`, in `folder`: of its session, or of the one with this number.

    Raises LiveError when there is no session of this number, or no domain is left.
    """
    environment.prepare()
    if other := environment.foreign_distribution():
        raise LiveError(
            f"ROS 2 {other} is sourced in this terminal, and this course is for Jazzy: open a terminal without it "
            "(look for `source /opt/ros/...` in ~/.bashrc)"
        )
    if session:
        record = next((found for found in registry.running() if str(found.pid) == session), None)
        if record is None:
            raise LiveError(f"there is no session {session}; `course sessions` lists them")
        domain, home = record.domain, Path(record.folder)
    else:
        claim, domain = shell_domain(folder, shell)
        home = folder
        if claim is not None:
            claim.set_inheritable(True)  # the shell goes on holding it
            claim.detach()
    for line in kept.refresh(home):
        print(line, file=sys.stderr)
    kept.use(home)
    stamp = kept.record_file(home)
    return (
        environment.workspace_variables()
        | environment.session_variables(domain)
        | {
            "PATH": os.environ["PATH"],
            "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
            "AMENT_PREFIX_PATH": os.environ["AMENT_PREFIX_PATH"],
            "FASTRTPS_DEFAULT_PROFILES_FILE": os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"],
            "ROS_PYTHON_CHECK_FIELDS": os.environ["ROS_PYTHON_CHECK_FIELDS"],
            SHELL: str(shell),
            FIXED: session,
            "COURSE_FOLDER": str(folder),
            "COURSE_PYTHON": sys.executable,
            "COURSE_BUILT": str(stamp),
            "COURSE_BUILT_AT": str(int(stamp.stat().st_mtime)) if stamp.exists() else "",
            "COURSE_PROMPT": f"{home.name or '/'}, ROS domain {domain}",
        }
    )


def exports(folder: Path, shell: int, session: str) -> str:
    """The same variables as a shell's commands; a line on stderr instead when it cannot join."""
    try:
        variables = join(folder, shell, session)
    except LiveError as error:
        print(f"environment/shell: {error}", file=sys.stderr)
        variables = {"COURSE_FOLDER": str(folder)}
    return "\n".join(f"export {name}={shlex.quote(value)}" for name, value in variables.items())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
