"""The ROS domains of a user on this machine: one for each session, and one for all terminals.

The session of a notebook has a domain that no other session has.  A terminal is in the domain of the notebook that runs
in its folder, or that is in front in its JupyterLab; all other terminals of a user share one domain, whatever their
folders.  A notebook that starts in a folder where a terminal already is takes the terminal's domain, unless another
notebook has it, so terminal and notebook meet in either order.  While the notebook in front has no session, a terminal
beside it waits in a domain that no notebook has.
"""

import os
import socket
import sys
import time
from pathlib import Path
from typing import NamedTuple

from course import registry
from course.errors import LiveError
from course.foundation import processes
from course.ros.graph import participants_here

# 0 is the default of all; from 101 on, ports overlap with Linux's ephemeral ones, and `ros2` cannot count nodes.
DOMAINS = range(1, 101)
LAST = 232  # from 233 on, the ports of a domain would exceed 65535
CLAIM = "ros2-course-domain-{}"  # an abstract socket's name; later holders add a hyphen
KERNEL = "kernel-"  # Jupyter's prefix of a kernel's id in the name of its connection file


class Place(NamedTuple):
    """A terminal's place: its ROS domain, and the folder and claim that belong to it."""

    domain: int
    folder: Path  # whose interface packages it uses: the notebook's, or its own
    claim: socket.socket | None  # holds the terminals' domain until the process ends
    with_notebook: bool
    waits: bool  # for the session of the notebook in front


def domain_number(text: str) -> int:
    """Return the domain that the user has set in ROS_DOMAIN_ID; raises LiveError for an invalid one."""
    if text.isascii() and text.isdecimal() and int(text) <= LAST:
        return int(text)
    raise LiveError(
        f"ROS_DOMAIN_ID is set to '{text}', but a ROS domain is a number from 0 to {LAST}: correct or unset it, in the "
        "cell that sets it or where you start JupyterLab (then restart JupyterLab)"
    )


def session_domain(folder: Path) -> tuple[socket.socket | None, int]:
    """Return the domain for a new session in `folder`, and the socket that claims it; raises LiveError if none is free.

    It is the domain of a terminal in that folder, or else a new one.
    """
    with registry.lock():
        taken = {record.domain for record in registry.running()}
        waiting = [shell.domain for shell in registry.shells() if Path(shell.folder) == folder and not shell.chosen]
        domain = next((domain for domain in waiting if domain not in taken), None)
        claim: socket.socket | None = None
        if domain is None:
            claim, domain = claim_domain()
        pid = os.getpid()
        born = processes.birth(pid)
        registry.write(registry.SessionRecord(pid, domain, str(folder), time.time(), born, kernel=kernel_id()))
        registry.note_change()
    return claim, domain


def shell_domain(folder: Path, pid: int, front: str = "", front_folder: Path | None = None) -> Place:
    """Return the place of a terminal in `folder` with the shell process `pid`; raises LiveError if all are in use.

    It joins the session of the kernel `front`, if that runs, or the oldest session in the folder, or else the domain
    that this user's terminals share.  In `front_folder`, where the notebook in front is, it joins no other notebook.
    """
    with registry.lock():
        sessions = registry.running()
        met = next((record for record in sessions if front and record.kernel == front), None)
        if met is None and folder != front_folder:
            met = next((record for record in sessions if Path(record.folder) == folder), None)
        waits = met is None and front_folder is not None
        shells = registry.shells()
        taken = {record.domain for record in sessions} if waits else set()
        own = next((shell.own for shell in shells if shell.pid == pid and shell.own not in taken), 0)
        claim: socket.socket | None = None
        if not own:
            try:
                others = [shell for shell in shells if shell.pid != pid and shell.own not in taken]
                claim, own = _shared_domain(others)
            except LiveError:
                if met is None:
                    raise
        domain = met.domain if met else own
        registry.write(registry.ShellRecord(pid, processes.birth(pid), str(folder), domain, own))
    return Place(domain, Path(met.folder) if met else folder, claim, met is not None, waits)


def note_chosen(folder: Path, pid: int, domain: int) -> None:
    """Record that the user has exported `domain` in the terminal of process `pid`."""
    with registry.lock():
        own = next((shell.own for shell in registry.shells() if shell.pid == pid), 0)
        registry.write(registry.ShellRecord(pid, processes.birth(pid), str(folder), domain, own, chosen=True))


def kernel_id() -> str:
    """Return the Jupyter id of this kernel; '' if this process is not a kernel."""
    kernels = sys.modules.get("ipykernel.kernelapp")
    if kernels is None or not kernels.IPKernelApp.initialized():
        return ""
    return Path(kernels.IPKernelApp.instance().connection_file).stem.removeprefix(KERNEL)


def _shared_domain(others: list[registry.ShellRecord]) -> tuple[socket.socket | None, int]:
    """Return the domain shared with this user's `others` (terminals), and the socket that claims it while one runs."""
    domain = next((shell.own for shell in others if shell.own), None)
    if domain is None:
        return claim_domain()
    first = CLAIM.format(domain)
    return _bound(first) or _bound(f"{first}-{os.getpid()}"), domain


def claim_domain() -> tuple[socket.socket, int]:
    """Find a domain without participants, and claim it by an abstract socket until the process ends.

    The socket keeps other users of this network namespace away from the domain before it has nodes.
    """
    reserved = {domain for shell in registry.shells() for domain in (shell.domain, shell.own)}
    first = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[first:], *DOMAINS[:first]):
        claim = _bound(CLAIM.format(domain))
        if claim is None:
            continue
        if domain not in reserved and not participants_here(domain) and not _held(domain):
            return claim, domain
        claim.close()
    raise LiveError(
        f"all {len(DOMAINS)} ROS domains of this machine are in use: close some notebooks, or shut down their kernels; "
        "`course sessions` lists those of yours. If others have taken them, choose one: set ROS_DOMAIN_ID in the "
        "terminal before you start JupyterLab"
    )


def _bound(name: str) -> socket.socket | None:
    """Bind an abstract socket of this name, which nobody else can bind until it is closed; None if it is taken."""
    claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        claim.bind(f"\0{name}")
    except OSError:
        claim.close()
        return None
    return claim


def _held(domain: int) -> bool:
    """Return True if a later terminal holds the domain in addition to the first one."""
    try:
        with open("/proc/net/unix") as file:
            return any(f" @{CLAIM.format(domain)}-" in line for line in file)
    except OSError:
        return False
