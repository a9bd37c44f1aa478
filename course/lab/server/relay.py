"""Relays a page's websocket to the kernel's socket, with Jupyter's authentication."""

import asyncio
import contextlib
from typing import Any

from jupyter_core.utils import ensure_async
from jupyter_server.auth.decorator import ws_authenticated
from jupyter_server.base.handlers import JupyterHandler
from jupyter_server.base.websocket import WebSocketMixin
from tornado import web
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from course.lab import protocol

LOOK = 0.5  # s between two checks whether the kernel listens, while a page waits for it


class Relay(WebSocketMixin, WebSocketHandler, JupyterHandler):
    """A websocket that stays open over restarts of the kernel, and tells the page whether the kernel listens."""

    auth_resource = "kernels"
    _task: asyncio.Task[None] | None = None
    _kernel: asyncio.StreamWriter | None = None

    def set_default_headers(self) -> None:
        """Set no headers: a websocket has none of those of Jupyter's pages."""

    @ws_authenticated
    async def get(self, kernel_id: str) -> None:
        """Open the websocket, if the user may run code in the kernel `kernel_id`."""
        allowed = await ensure_async(
            self.authorizer.is_authorized(self, self.current_user, "execute", self.auth_resource)
        )
        if not allowed:
            raise web.HTTPError(403)
        if kernel_id not in self.kernel_manager:
            raise web.HTTPError(404, f"there is no kernel {kernel_id}")
        await super().get(kernel_id=kernel_id)

    async def open(self, kernel_id: str) -> None:
        """Start relaying."""
        super().open()
        self._task = asyncio.create_task(self._relay(kernel_id))

    async def on_message(self, message: str | bytes) -> None:
        """Pass a message of the page on; without a kernel it is dropped."""
        if self._kernel is not None:
            content = message if isinstance(message, bytes) else message.encode()
            with contextlib.suppress(OSError):
                self._kernel.write(content.replace(b"\n", b" ") + b"\n")
                await self._kernel.drain()

    def on_close(self) -> None:
        """Stop relaying."""
        if self._task is not None:
            self._task.cancel()

    async def _relay(self, kernel_id: str) -> None:
        with contextlib.suppress(WebSocketClosedError):
            connected = await self._connected(kernel_id)  # a page that is loaded again does not hear "waiting" first
            while kernel_id in self.kernel_manager:
                if connected is not None and not await self._pass_on(*connected):
                    await self._say({"link": "connecting"})
                    await asyncio.sleep(LOOK)
                    connected = await self._connected(kernel_id)
                    if connected is not None:
                        continue
                elif connected is not None:
                    # A server that is stopped ends its kernels first: that is no restart, of which to tell.
                    while self._is_ended(kernel_id):
                        await asyncio.sleep(LOOK)
                    if kernel_id not in self.kernel_manager:
                        break
                await self._say({"link": "waiting"})
                while (connected := await self._connected(kernel_id)) is None and kernel_id in self.kernel_manager:
                    await asyncio.sleep(LOOK)
            self.close()

    def _is_ended(self, kernel_id: str) -> bool:
        """Return True while the server ends the kernel; at a restart, until it is started again."""
        return kernel_id in self.kernel_manager and self.kernel_manager.get_kernel(kernel_id).shutting_down

    async def _connected(self, kernel_id: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter] | None:
        with contextlib.suppress(OSError), protocol.address(protocol.socket_path(kernel_id)) as name:
            return await asyncio.open_unix_connection(name, limit=protocol.LINE)
        return None

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Pass the kernel's messages on, as fast as the page reads them; return True once the kernel has ended.

        Return False after a line that is too long, as no kernel of this course sends it.
        """
        self._kernel = writer
        try:
            await self._say({"link": "up"})
            while line := await reader.readline():
                await self.write_message(line.decode())
        except ConnectionError:
            pass  # the kernel was killed in the middle of a line
        except ValueError:
            return False
        finally:
            self._kernel = None
            writer.close()
        return True

    async def _say(self, message: dict[str, Any]) -> None:
        await self.write_message(message)
