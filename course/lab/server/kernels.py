"""How the Jupyter server reaches its kernels: by sockets that only its user can open."""

from pathlib import Path

from jupyter_server.services.kernels.kernelmanager import ServerKernelManager
from traitlets.config import Config

from course import registry


class PrivateKernel(ServerKernelManager):
    """A kernel that listens at Unix sockets, in the folder that the registry keeps for this user alone.

    A message to a kernel is signed with a key, but what a kernel publishes goes to whoever connects to its TCP port:
    every user of the machine could read all cells and their outputs.  Jupyter would lay the sockets into its runtime
    folder, whose name may be too long for them (unix(7)).
    """

    def _ip_default(self) -> str:
        if self.transport == "ipc":
            return str(registry.folder() / Path(self.connection_file).stem)
        return str(super()._ip_default())


def keep_private(c: Config) -> None:
    """Configure Unix sockets in place of TCP ports."""
    c.MappingKernelManager.kernel_manager_class = f"{__name__}.{PrivateKernel.__name__}"
    c.KernelManager.transport = "ipc"
