"""A ROS domain for each session: that of the folder it runs in, which no other session of this machine has.

A terminal and a notebook in the same folder meet, whoever was first.  A second session in a folder, of another kernel
or another user, gets a domain of its own.
"""

import contextlib
import os
import socket
import time
from pathlib import Path

from course import registry
from course.errors import LiveError
from course.foundation import processes
from course.ros.graph import participants_here

# 0 is everybody's; from 101 on the ports meet Linux's ephemeral ones, and `ros2` cannot count nodes.
DOMAINS = range(1, 101)


def session_domain(folder: Path) -> tuple[socket.socket | None, int]:
    """The domain for a new session in `folder`, and what holds it; raises LiveError when all are in use.

    It is the domain of a terminal that waits there for a session, or else a new one.
    """
    with registry.lock():
        taken = {record.domain for record in registry.running()}
        waiting = [shell.domain for shell in registry.shells() if Path(shell.folder) == folder]
        domain = next((domain for domain in waiting if domain not in taken), None)
        claim: socket.socket | None = None
        if domain is None:
            claim, domain = claim_domain()
        born = processes.birth(os.getpid())
        registry.write(registry.SessionRecord(os.getpid(), domain, str(folder), time.time(), born))
    return claim, domain


def shell_domain(folder: Path, pid: int) -> tuple[socket.socket | None, int]:
    """The domain for a terminal in `folder` whose shell is the process `pid`; raises LiveError when all are in use.

    It is the domain of the oldest session there, or of another terminal, or else a new one.
    """
    with registry.lock():
        known = [record.domain for record in registry.running() if Path(record.folder) == folder]
        known += [shell.domain for shell in registry.shells() if Path(shell.folder) == folder and shell.pid != pid]
        claim, domain = (None, known[0]) if known else claim_domain()
        registry.write(registry.ShellRecord(pid, processes.birth(pid), str(folder), domain))
    return claim, domain


def claim_domain() -> tuple[socket.socket, int]:
    """Find a domain without any participant, and hold it by an abstract socket until the process ends.

    The socket keeps other users of this network namespace away from a domain whose nodes are still to come.
    """
    reserved = {shell.domain for shell in registry.shells()}
    first = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[first:], *DOMAINS[:first]):
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        with contextlib.suppress(OSError):
            claim.bind(f"\0ros2-course-domain-{domain}")
            if domain not in reserved and not participants_here(domain):
                return claim, domain
        claim.close()
    raise LiveError(
        f"all {len(DOMAINS)} ROS domains of this machine are in use: close some notebooks, or shut down their kernels; "
        "`course sessions` lists those of yours. If others have taken them, choose one: set ROS_DOMAIN_ID in the "
        "terminal before you start JupyterLab"
    )
