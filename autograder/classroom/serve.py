"""Starts a member's Jupyter server, in the member's box, on the socket that it inherits.

This file is copied into the box, so it must not import the grader.  The socket is made outside the box, where no
student can replace it.
"""

import asyncio
import contextlib
import importlib
import os
import site
import socket
import stat
import sys

from tornado.iostream import IOStream

SOCKET = "CLASSROOM_SOCKET"  # the environment variable with the socket's descriptor
ALONE = "CLASSROOM_CONFIGURATION"  # the variable with the only folder to read configuration from, if any

LINGER = 5.0  # s at most for which a connection stays half closed
CHUNK = 65536  # bytes
LARGEST_SECRET = 4096  # bytes


def every(idle: float) -> int:
    """Return the interval (s) at which to look for what has been idle for `idle` (s)."""
    return max(1, min(60, round(idle / 4)))


def close_gently() -> None:
    """Have this process close Unix sockets in two steps: for writing first, and fully once the other side has closed.

    The proxy asks for each connection to be closed after the response.  If a Unix socket is closed at once, the proxy's
    next write fails, even an empty one, and the proxy answers 503 instead of the response, although the request was
    served.  A server should close in these two steps (RFC 9112, section 9.6).
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
    """Read nbgrader's configuration only from `folder`, as `Spawner.disable_user_config` does for Jupyter's.

    Its assignment list would also run `nbgrader_config.py` in the server's and the assignment's folder.
    """
    from nbgrader.apps import NbGrader

    NbGrader.load_cwd_config = False
    NbGrader.config_file_paths = property(lambda _: [folder])


def look_at_home() -> None:
    """Have modules that were loaded before the fork (`template`) read this server's environment again.

    The modules in `template.IMPORTED_AGAIN` are imported again.  The functions of `send2trash` are already held by
    modules that are not, so it is reloaded in place.
    """
    site.USER_BASE = site.USER_SITE = None  # computed again when needed
    if trash := sys.modules.get("send2trash.plat_other"):  # has the path of the trash folder
        importlib.reload(trash)


def remove_false_secret(path: str) -> None:
    """Remove what is not a small file where the server reads its cookie secret: a pipe, or gigabytes, would delay it.

    The server makes a new secret then.
    """
    with contextlib.suppress(OSError):  # there is nothing, or a folder: the server says so
        known = os.lstat(path)
        if not stat.S_ISREG(known.st_mode) or known.st_size > LARGEST_SECRET:
            os.unlink(path)


def ask_no_node() -> None:
    """Keep JupyterLab from asking Node.js at each start for the package registry: nothing is ever built here.

    That takes as much processor time as the rest of the start.  JupyterLab also works without Node.js.
    """
    from jupyterlab import commands  # type: ignore[import-untyped]

    commands._yarn_config = lambda _: {"yarn config": {}, "npm config": {}}


def main() -> None:
    """Serve one member; imports here what is needed only in the box, not by the commands that start it."""
    look_at_home()
    ask_no_node()
    from jupyter_server.serverapp import ServerApp
    from jupyterhub.singleuser.extension import JupyterHubSingleUser
    from tornado.ioloop import PeriodicCallback
    from traitlets import default

    class Server(ServerApp):
        """A Jupyter server that listens on the inherited socket."""

        @default("cookie_secret")
        def _default_cookie_secret(self) -> bytes:
            remove_false_secret(self.cookie_secret_file)
            return super()._default_cookie_secret()

        def _bind_http_server(self) -> None:
            listening = socket.socket(fileno=int(os.environ.pop(SOCKET)))
            listening.setblocking(False)
            listening.set_inheritable(False)
            self.http_server.add_socket(listening)

        def init_shutdown_no_activity(self) -> None:
            """End after the idle time; jupyter_server alone would look only once a minute, however short that is."""
            if self.shutdown_no_activity_timeout > 0:
                PeriodicCallback(self.shutdown_no_activity, 1000 * every(self.shutdown_no_activity_timeout)).start()

    if folder := os.environ.pop(ALONE, ""):
        read_configuration_only_from(folder)
    close_gently()
    JupyterHubSingleUser.serverapp_class = Server  # not in a subclass: extensions are found by the package of the class
    JupyterHubSingleUser.launch_instance()


if __name__ == "__main__":
    main()
