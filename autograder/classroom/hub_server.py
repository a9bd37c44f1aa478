"""JupyterHub for a classroom, with one socket for the proxy and another for the members' servers.

Members' processes see the second socket, which leads to the hub's API only; the connections and the requests of each
user are limited.
Everything else is served through the proxy, whose socket no member sees.  What the proxy adds to a request on its
origin can be trusted (`TrustsTheProxyOnly`).
"""

import asyncio
import os
import socket
import struct
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from jupyterhub import orm
from jupyterhub.app import JupyterHub
from tornado.http1connection import HTTP1Connection
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPMessageDelegate, HTTPServerRequest, RequestStartLine, ResponseStartLine
from tornado.iostream import IOStream
from tornado.netutil import add_accept_handler, bind_unix_socket
from tornado.routing import Router
from tornado.web import Application

from autograder.classroom.class_page import PAGE, ClassPage
from autograder.classroom.plan import Classroom
from autograder.classroom.servers import VARIABLE
from autograder.classroom.spawner import BoxSpawner

MOST = 64  # simultaneous connections of one user; a server needs a few
LARGEST = 4 << 10  # bytes of a request's body, and of a server's headers: the hub has one thread, and reads slowly
AT_ONCE, EACH = 20, 0.25  # requests of one user that are answered at once, and s between further ones
API = "/hub/api"


class ApiAlone(Router):
    """Routes requests to an application's API; anything else is not found, and not logged."""

    def __init__(self, application: Application):
        self._application = application
        self._pace = Pace()

    def find_handler(self, request: HTTPServerRequest, **options: Any) -> HTTPMessageDelegate | None:
        """Return the handler of a request to the API, or None for any other."""
        if request.path == API or request.path.startswith(f"{API}/"):
            found = self._application.find_handler(request, **options)
            connection = cast(HTTP1Connection, request.connection)
            (user,) = cast(Any, connection.context).address
            return found and InTurn(found, connection, lambda: self._pace.wait(user))
        return None


class Pace:
    """Spreads the requests of each user over time: AT_ONCE without a wait, and then one in each EACH seconds."""

    def __init__(self, now: Callable[[], float] = time.monotonic):
        self._now = now
        self._free: dict[int, float] = {}  # by user: when all requests up to now would be done at this pace

    def wait(self, user: int) -> float:
        """Return how long (s) the next request of a user must wait."""
        now = self._now()
        free = min(max(self._free.get(user, 0.0), now), now + (AT_ONCE + MOST) * EACH)
        self._free[user] = free + EACH
        return max(0.0, free - now - (AT_ONCE - 1) * EACH)


class Passing(HTTPMessageDelegate):
    """A base that passes a request on to its handler as it comes."""

    def __init__(self, handler: HTTPMessageDelegate):
        self._handler = handler

    def headers_received(self, start_line: RequestStartLine | ResponseStartLine, headers: HTTPHeaders) -> Any:
        """Pass on the first line and the headers."""
        return self._handler.headers_received(start_line, headers)

    def data_received(self, chunk: bytes) -> Any:
        """Pass on a part of the body."""
        return self._handler.data_received(chunk)

    def finish(self) -> None:
        """Have the request handled."""
        self._handler.finish()

    def on_connection_close(self) -> None:
        """Tell the handler."""
        self._handler.on_connection_close()


class TrustsTheProxyOnly(Passing):
    """A request from the proxy, without the headers in which only its sender says where it comes from.

    Tornado believes these before the last address in X-Forwarded-For, which the proxy adds.
    """

    SENDERS = ("X-Real-Ip", "X-Scheme")

    def headers_received(self, start_line: RequestStartLine | ResponseStartLine, headers: HTTPHeaders) -> Any:
        """Pass on the first line and the other headers."""
        for name in self.SENDERS:
            headers.pop(name, None)
        return super().headers_received(start_line, headers)


class InTurn(Passing):
    """A request that may have to wait before it is handled; it is dropped if its client gives up meanwhile."""

    def __init__(self, handler: HTTPMessageDelegate, connection: HTTP1Connection, wait: Callable[[], float]):
        super().__init__(handler)
        self._connection, self._wait = connection, wait

    def finish(self) -> None:
        """Have the request handled, at once or when its turn has come."""
        if not (seconds := self._wait()):
            self._handler.finish()
            return
        later = asyncio.get_running_loop().call_later(seconds, self._handler.finish)
        self._connection.set_close_callback(later.cancel)  # the handler sets its own once it begins


def listen(path: Path, application: Application) -> HTTPServer:
    """Serve an application's API at a socket that everybody who sees it may connect to."""
    server = HTTPServer(
        ApiAlone(application), max_body_size=LARGEST, max_header_size=LARGEST
    )  # trusts no header about a request's origin
    opened: defaultdict[int, list[socket.socket]] = defaultdict(list)

    def accept(connection: socket.socket, _: Any) -> None:
        user = owner(connection)
        opened[user] = [each for each in opened[user] if each.fileno() >= 0]  # the others are closed
        if len(opened[user]) >= MOST:
            connection.close()
            return
        opened[user].append(connection)
        server.handle_stream(IOStream(connection), (user,))

    path.unlink(missing_ok=True)
    add_accept_handler(bind_unix_socket(str(path), mode=0o666), accept)
    return server


def trust_the_proxy_only(server: HTTPServer) -> None:
    """Have a server behind the proxy believe about the origin of a request what the proxy says, and nothing else."""
    begin = server.start_request
    server.start_request = lambda *connections: TrustsTheProxyOnly(begin(*connections))  # type: ignore[method-assign]


def owner(connection: socket.socket) -> int:
    """Return the user id at the other end of a Unix socket (unix(7), SO_PEERCRED)."""
    _, user, _ = struct.unpack("3i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
    return int(user)


class ClassHub(JupyterHub):
    """JupyterHub that also listens at the members' socket, and has a page for the instructors."""

    def init_handlers(self) -> None:
        """Add the instructors' page."""
        super().init_handlers()
        page = (f"/{PAGE}", ClassPage, {"classroom": Classroom.load(Path(os.environ[VARIABLE]))})
        self.handlers[:0] = self.add_url_prefix(self.hub_prefix, [page])

    async def init_users(self) -> None:
        """Forget whoever is not in the class any more, with their cookies and tokens."""
        known = {member.name for member in Classroom.load(Path(os.environ[VARIABLE])).members}
        for user in self.db.query(orm.User).filter(orm.User.name.not_in(known)):
            self.log.info("%s is not in the class any more", user.name)
            self.db.delete(user)
        self.db.commit()
        await super().init_users()

    async def start(self) -> None:
        """Listen at the members' socket, and start."""
        BoxSpawner.begin()
        self._members = listen(Classroom.load(Path(os.environ[VARIABLE])).hub_socket, self.tornado_application)
        await super().start()
        trust_the_proxy_only(self.http_server)
        self.http_server.conn_params.max_body_size = LARGEST  # the proxy's requests, of anybody


if __name__ == "__main__":
    ClassHub.launch_instance()
