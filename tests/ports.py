"""Ports for servers that tests start."""

import random
import socket

BELOW_EPHEMERAL = range(20_000, 32_000)  # no connection is given one of these while a server starts (ip(7))


def free_port() -> int:
    """A TCP port of 127.0.0.1 that nobody listens at."""
    for port in random.sample(BELOW_EPHEMERAL, 100):
        with socket.socket() as trying:
            try:
                trying.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError("none of 100 ports is free")
