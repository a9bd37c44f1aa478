"""Starts a member's Jupyter server, in its box, on the socket that it was given.

This file is laid into the box: of the grader it may import nothing.  The socket was made outside, where no student can
put another in its place.
"""

import asyncio
import importlib
import os
import site
import socket
import sys

from tornado.iostream import IOStream

SOCKET = "CLASSROOM_SOCKET"  # the environment variable with its descriptor
ALONE = "CLASSROOM_CONFIGURATION"  # the same for the only folder in which configuration is looked for, if there is one

LINGER = 5.0  # s at most that a connection stays half open
CHUNK = 65536  # bytes


def every(idle: float) -> int:
    """Return how often (s) to look for what has been idle for so long (s)."""
    return max(1, min(60, round(idle / 4)))


def close_gently() -> None:
    """Have this process close what it writes to a Unix socket first, and what it reads once the other side has closed.

    The proxy asks for each connection to be closed after the response.  A Unix socket that is closed at once refuses
    what the proxy has yet to write, be it empty, and the proxy then answers 503 in place of the response, although the
    request was served.  A server should close in these two steps (RFC 9112, section 9.6).
    """
    IOStream.close_fd = _close_fd  # type: ignore[method-assign, assignment]


def _close_fd(stream: IOStream) -> None:
    connection, stream.socket = stream.socket, None  # type: ignore[assignment]
    if connection.family != socket.AF_UNIX:
        connection.close()
        return
    try:
        loop = asyncio.get_running_loop()
        connection.shutdown(socket.SHUT_WR)
    except (OSError, RuntimeError):  # the other side has closed; the server ends
        connection.close()
        return

    def end() -> None:
        loop.remove_reader(connection)
        late.cancel()
        connection.close()

    def drop() -> None:
        try:
            if connection.recv(CHUNK):
                return
        except BlockingIOError:
            return
        except OSError:
            pass
        end()

    late = loop.call_later(LINGER, end)
    loop.add_reader(connection, drop)


def read_configuration_only_from(folder: str) -> None:
    """Read nbgrader's configuration there, and in no home folder, as `Spawner.disable_user_config` has Jupyter's read.

    Its assignment list runs `nbgrader_config.py` of the server's folder and of the assignment's, too.
    """
    from nbgrader.apps import NbGrader

    NbGrader.load_cwd_config = False
    NbGrader.config_file_paths = property(lambda _: [folder])


def look_at_home() -> None:
    """Have modules that were loaded elsewhere (`template`) take from the environment what they took when loaded.

    Those of `template.FORGOTTEN` are loaded anew; this one has its functions in others that are not.
    """
    site.USER_BASE = site.USER_SITE = None  # found again when they are asked for
    if trash := sys.modules.get("send2trash.plat_other"):  # knows the folder, in which it puts what is deleted
        importlib.reload(trash)


def ask_no_node() -> None:
    """Keep JupyterLab from asking Node.js, at each start, where packages would come from: it is never built here.

    That takes as much of a processor as all else.  It does without where there is no Node.js.
    """
    from jupyterlab import commands  # type: ignore[import-untyped]

    commands._yarn_config = lambda _: {"yarn config": {}, "npm config": {}}


def main() -> None:
    """Serve one member; what only the box needs is imported here, and not by the commands that start it."""
    look_at_home()
    ask_no_node()
    from jupyter_server.serverapp import ServerApp
    from jupyterhub.singleuser.extension import JupyterHubSingleUser
    from tornado.ioloop import PeriodicCallback

    class Server(ServerApp):
        """A Jupyter server that listens where it was told."""

        def _bind_http_server(self) -> None:
            listening = socket.socket(fileno=int(os.environ.pop(SOCKET)))
            listening.setblocking(False)
            listening.set_inheritable(False)
            self.http_server.add_socket(listening)

        def init_shutdown_no_activity(self) -> None:
            """End when nobody has been here for long; jupyter_server looks once a minute, however short that is."""
            if self.shutdown_no_activity_timeout > 0:
                PeriodicCallback(self.shutdown_no_activity, 1000 * every(self.shutdown_no_activity_timeout)).start()

    if folder := os.environ.pop(ALONE, ""):
        read_configuration_only_from(folder)
    close_gently()
    JupyterHubSingleUser.serverapp_class = Server  # not in a subclass: an extension is found by its class's package
    JupyterHubSingleUser.launch_instance()


if __name__ == "__main__":
    main()
