"""A ROS domain for each session: one that no other session of this machine has."""

import os
import socket

from course.errors import LiveError
from course.ros2.graph import participants_here

# 0 is everybody's; from 101 on the ports meet Linux's ephemeral ones, and `ros2` cannot count nodes.
DOMAINS = range(1, 101)


def claim_domain() -> tuple[socket.socket, int]:
    """Find a domain without any participant, and hold it by an abstract socket until the process ends.

    The socket keeps other sessions of this network namespace away from a domain whose nodes are still to come.
    """
    first = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[first:], *DOMAINS[:first]):
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0ros2-course-domain-{domain}")
            if not participants_here(domain):
                return claim, domain
        except OSError:
            pass
        claim.close()
    raise LiveError(
        f"all {len(DOMAINS)} ROS domains of this machine are in use: close some notebooks, or shut down their kernels"
    )
