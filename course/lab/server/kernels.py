"""Sockets by which the Jupyter server reaches its kernels, and which only its user can open."""

import tempfile
from pathlib import Path

from jupyter_server.services.kernels.kernelmanager import ServerKernelManager
from traitlets.config import Config

from course.foundation.folders import runtime_folder

LONGEST = 107  # bytes of a Unix socket's name (unix(7))
NUMBER = len("-1")  # which of a kernel's five sockets it is


class PrivateKernel(ServerKernelManager):
    """A kernel that listens at Unix sockets, in a folder of this user alone.

    A message to a kernel is signed with a key, but what a kernel publishes goes to whoever connects to its TCP port:
    every user of the machine could read all cells and their outputs.  Jupyter would lay the sockets into its runtime
    folder, whose name may be too long for them; here it is the registry's, or else a new one.
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
    """Configure Unix sockets in place of TCP ports."""
    c.MappingKernelManager.kernel_manager_class = f"{__name__}.{PrivateKernel.__name__}"
    c.KernelManager.transport = "ipc"
