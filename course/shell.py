"""A shell, or one command, in the course's environment: `environment/shell [--session NUMBER] [COMMAND...]`.

It has the course's Python and `ros2`, the middleware's profile, the interface packages built in its folder, and a ROS
domain.  That is the domain of the notebook that runs in its folder, so that it finds the nodes there, or else the one
that all terminals of its user share.  A terminal of JupyterLab (`--lab`) follows the notebook in front.  A domain that
the user exports is kept.
"""

import contextlib
import io
import os
import shlex
import signal
import socket
import subprocess
import sys
from pathlib import Path

from course import environment, registry
from course.errors import LiveError
from course.interfaces import kept
from course.session.domains import note_chosen, shell_domain

BASHRC = Path(__file__).parent / "bashrc"
# Variables that a shell passes to its later refreshes (`--refresh`).
FIXED = "COURSE_SESSION"  # the session chosen by --session
SHELL = "COURSE_SHELL"  # the process id of the shell
FRONT = "COURSE_FRONT"  # in a terminal of JupyterLab, the file that names the notebook in front
WAITS = "COURSE_WAITS"  # the folder of the notebook in front, if that has no session
SAID = "COURSE_SAID"  # what stands above the prompt, until the next command is entered
WATCHED = "COURSE_WATCHED"  # the content of the two watched files at the last refresh
USAGE = "Usage: environment/shell [--session NUMBER] [COMMAND...]"


def main(words: list[str]) -> int:
    """Replace this process by the shell or the command; return an exit status only if that fails."""
    if words[:1] == ["--refresh"]:
        with contextlib.redirect_stderr(io.StringIO()) as said:
            commands = exports(Path.cwd(), int(os.environ[SHELL]), os.environ.get(FIXED, ""))
        print(commands)
        if said.getvalue():  # printed by the shell, once it has removed its old prompt
            print(f"printf %s {shlex.quote(said.getvalue())} >&2")
            print(f"export {SAID}={shlex.quote(said.getvalue())}")
        return 0
    session = ""
    os.environ.pop(FRONT, None)  # belongs to another terminal
    if words[:1] == ["--lab"]:
        words = words[1:]
        with contextlib.suppress(OSError):
            os.environ[FRONT] = str(registry.front(os.getppid()))  # the Jupyter server is the parent process
    elif words[:1] == ["--session"]:
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
    os.environ[SAID] = _no_session(variables[environment.DOMAIN]) if variables[WAITS] else ""
    if os.environ[SAID]:
        print(os.environ[SAID], file=sys.stderr)
    if not words:  # closing a terminal must end its programs, even if the server was started by `nohup`
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    command = words or ["bash", "--rcfile", str(BASHRC), "-i"]
    try:
        os.execvp(command[0], command)
    except OSError as error:
        print(f"environment/shell: {command[0]}: {error.strerror}", file=sys.stderr)
        return 127


def join(folder: Path, shell: int, session: str = "") -> dict[str, str]:
    """Return the variables of the shell process `shell` in `folder`, for its session or the one with this number.

    Raises LiveError if there is no session with this number, or no free domain.
    """
    environment.prepare()
    if other := environment.foreign_distribution():
        raise LiveError(
            f"ROS 2 {other} is sourced in this terminal, and this course is for Jazzy: open a terminal without it "
            "(look for `source /opt/ros/...` in ~/.bashrc)"
        )
    watched = _watched()  # first, so that later changes are seen at the next refresh
    home, where, waits = folder, "", ""
    if session:
        record = next((found for found in registry.running() if str(found.pid) == session), None)
        if record is None:
            raise LiveError(f"there is no session {session}; `course sessions` lists them")
        domain, home = str(record.domain), Path(record.folder)
    elif domain := environment.chosen_domain():
        where = ", as you set it"
        if domain.isascii() and domain.isdigit():
            note_chosen(folder, shell, int(domain))
            record = registry.of_domain(int(domain))
            home = Path(record.folder) if record else folder
    else:
        beside = _front_folder()
        place = shell_domain(folder, shell, watched.partition(" ")[2], beside)
        domain, home = str(place.domain), place.folder
        waits = str(beside) if place.waits else ""
        if place.claim is not None:
            _keep(place.claim, shell)
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
            WAITS: waits,
            environment.DOMAIN: os.environ.get(environment.DOMAIN, "") if where else domain,
            WATCHED: watched,
            "COURSE_CHANGES": _changes(),
            "COURSE_PYTHON": sys.executable,
            "COURSE_BUILT": str(stamp),
            "COURSE_BUILT_AT": str(int(stamp.stat().st_mtime)) if stamp.exists() else "",
            "COURSE_PROMPT": f"domain {domain}{where}",
        }
    )


def exports(folder: Path, shell: int, session: str) -> str:
    """Return the same variables as shell commands; if joining fails, print a line on stderr instead.

    If this moves the shell to another domain, or the notebook for which it waited has come, a line on stderr says so.
    """
    before, waited = os.environ.get(environment.DOMAIN, ""), os.environ.get(WAITS, "")
    try:
        variables = join(folder, shell, session)
    except LiveError as error:
        print(f"environment/shell: {error}", file=sys.stderr)
        variables = {WATCHED: _watched()}
    else:
        now = variables[environment.DOMAIN]
        if variables[WAITS]:
            # Said once while the front goes from notebook to notebook, as when a page is loaded.
            told = os.environ.get(SAID, "").rstrip("\n").endswith(_no_session(now))
            if (variables[WAITS], now) != (waited, before) and not told:
                print(_no_session(now), file=sys.stderr)
        elif now != before or waited:
            record = registry.of_domain(int(now)) if now.isdigit() else None
            notebook = f"notebook in {Path(record.folder).name}" if record else ""
            if now != before:
                where = f"the {notebook}" if notebook else "your other terminals"
                print(f"This terminal is now in ROS domain {now}, with {where}.", file=sys.stderr)
            elif notebook:
                print(f"The {notebook} has joined this terminal in ROS domain {now}.", file=sys.stderr)
    return "\n".join(f"export {name}={shlex.quote(value)}" for name, value in variables.items())


def _no_session(domain: str) -> str:
    return (
        "The notebook in front has no session: run its cell with ros = course.live(). "
        f"Until then, this terminal is in ROS domain {domain}, without a notebook."
    )


def _keep(claim: socket.socket, shell: int) -> None:
    """Have the claim held until the process `shell` ends: by itself, if it is this one, or else by a `tail`."""
    claim.set_inheritable(True)
    if shell == os.getpid():
        claim.detach()
        return
    with contextlib.suppress(OSError):
        subprocess.Popen(
            ["tail", "-s", "5", f"--pid={shell}", "-f", "/dev/null"],
            pass_fds=[claim.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )


def _front_folder() -> Path | None:
    """Return the folder of the notebook in front, or None."""
    with contextlib.suppress(OSError, ValueError, IndexError, KeyError):
        if folder := Path(os.environ[FRONT]).read_text(encoding="utf-8").splitlines()[1]:
            return Path(folder).resolve()
    return None


def _changes() -> str:
    """Return the file that changes with the sessions, or ''."""
    try:
        return str(registry.changes())
    except OSError:
        return ""


def _watched() -> str:
    """Return the first lines of the two files that a shell watches, combined as in `course/bashrc`."""
    return f"{_first_line(_changes())} {_first_line(os.environ.get(FRONT, ''))}"


def _first_line(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8").partition("\n")[0] if path else ""
    except (OSError, ValueError):
        return ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
