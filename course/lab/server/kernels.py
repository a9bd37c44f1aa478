"""Kernel connections by Unix sockets that only the server's user can open."""

import tempfile
from pathlib import Path

from jupyter_server.services.kernels.kernelmanager import ServerKernelManager
from traitlets.config import Config

from course.foundation.folders import runtime_folder

LONGEST = 107  # bytes of a Unix socket's path (unix(7))
NUMBER = len("-1")  # the suffix for one of a kernel's five sockets


class PrivateKernel(ServerKernelManager):
    """A kernel that listens on Unix sockets, in a folder private to this user.

    Messages to a kernel are signed with a key, but a kernel publishes to anybody who connects to its TCP port: every
    user of the machine could read all cells and their outputs.  Jupyter itself would put Unix sockets into its runtime
    folder, whose path may be too long; here it is the registry's folder, or else a new one.
    """

    def _ip_default(self) -> str:
        if self.transport != "ipc":
            return str(super()._ip_default())
        name = Path(self.connection_file).stem
        place = runtime_folder() / name
        if len(bytes(place)) + NUMBER > LONGEST:
            place = Path(tempfile.mkdtemp(prefix="kernel-"), name)
        return str(place)


def keep_private(c: Config) -> None:
    """Configure Unix sockets instead of TCP ports."""
    c.MappingKernelManager.kernel_manager_class = f"{__name__}.{PrivateKernel.__name__}"
    c.KernelManager.transport = "ipc"
