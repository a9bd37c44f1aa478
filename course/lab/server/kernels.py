"""The Jupyter server's connections to its kernels, by sockets that only its user can open."""

from jupyter_core.paths import jupyter_runtime_dir
from traitlets.config import Config

LONGEST = 107  # bytes of a Unix socket's name (unix(7))
NAME = len("/kernel-01234567-0123-0123-0123-0123456789ab-ipc-1")


def keep_private(c: Config) -> None:
    """Configure Unix sockets in Jupyter's runtime folder in place of TCP ports.

    A message to a kernel is signed with a key, but what a kernel publishes goes to whoever connects to its port: every
    user of the machine could read all cells and their outputs.  Where the folder's name is too long, ports it is.
    """
    if len(jupyter_runtime_dir().encode()) + NAME <= LONGEST:
        c.KernelManager.transport = "ipc"
