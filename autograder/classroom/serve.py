"""Starts a member's Jupyter server, in its box, on the socket that it was given.

This file is laid into the box: of the grader it may import nothing.  The socket was made outside, where no student can
put another in its place.
"""

import os
import socket

from jupyter_server.serverapp import ServerApp
from jupyterhub.singleuser.extension import JupyterHubSingleUser

SOCKET = "CLASSROOM_SOCKET"  # the environment variable with its descriptor


class Server(ServerApp):
    """A Jupyter server that listens where it was told."""

    def _bind_http_server(self) -> None:
        listening = socket.socket(fileno=int(os.environ.pop(SOCKET)))
        listening.setblocking(False)
        listening.set_inheritable(False)
        self.http_server.add_socket(listening)


if __name__ == "__main__":
    JupyterHubSingleUser.serverapp_class = Server  # not in a subclass: an extension is found by its class's package
    JupyterHubSingleUser.launch_instance()
