"""The kernel's thread that answers pages: it listens on a Unix socket, and sleeps while no page is connected.

It answers while a cell runs.  Each page gets data no faster than it acknowledges it, so that nothing piles up.
"""

import asyncio
import atexit
import contextlib
import json
import os
import socket
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from course.errors import CourseError, LiveError
from course.foundation.untrusted import LONGEST_TEXT, all_visible
from course.lab import protocol
from course.lab.kernel.panels import Feed, Panels, Topic
from course.ros.rclpy_internals import unwatched

REQUESTS = 16  # simultaneous requests of a page
AHEAD = 2  # events of a subscription that the page may not have acknowledged yet
TEXTS = (LONGEST_TEXT, 10_000, 1000, 100)  # characters of a text: fewer where a line would be too long
# Since Python 3.13 asyncio removes a server's socket, and finds it by the name it was bound with, see protocol.address.
BY_US: dict[str, Any] = {"cleanup_socket": False} if sys.version_info >= (3, 13) else {}


class Bridge:
    """A thread that listens at `path` until `close`; `panels` is called when the first page connects."""

    def __init__(self, path: Path, panels: Callable[[], Panels]):
        """Begin to listen; raises OSError."""
        self._path, self._make = path, panels
        self._panels: Panels | None = None
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        os.fchmod(self._socket.fileno(), 0o600)  # before it is bound to a name
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        path.unlink(missing_ok=True)  # left by a killed kernel
        with protocol.address(path) as name:
            self._socket.bind(name)
        self._socket.listen()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="lab", daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def close(self) -> None:
        """Stop listening and disconnect the pages; closing twice is not an error."""
        atexit.unregister(self.close)
        self._path.unlink(missing_ok=True)
        with contextlib.suppress(RuntimeError):  # already closed
            self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(2.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        serving = asyncio.start_unix_server(self._page, sock=self._socket, limit=protocol.LINE, **BY_US)
        self._serving = self._loop.create_task(serving)  # a session may be closed before it has begun
        self._loop.run_forever()
        for task in asyncio.all_tasks(self._loop):
            task.cancel()
        self._loop.run_until_complete(asyncio.sleep(0))
        self._loop.close()
        self._socket.close()

    async def _page(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._panels is None:
            self._panels = await in_thread(self._make)
        await Page(self._panels, reader, writer).serve()


class Page:
    """A connected page."""

    def __init__(self, panels: Panels, reader: asyncio.StreamReader, writer: asyncio.StreamWriter):
        self._panels, self._reader, self._writer = panels, reader, writer
        self._free = asyncio.Semaphore(REQUESTS)
        self._tasks: set[asyncio.Task[None]] = set()
        self._subscriptions: dict[int, tuple[asyncio.Task[None], asyncio.Semaphore]] = {}

    async def serve(self) -> None:
        """Answer the page until it disconnects."""
        try:
            while line := await self._reader.readline():
                message = json.loads(line)
                if "ack" in message:
                    if message["ack"] in self._subscriptions:
                        self._subscriptions[message["ack"]][1].release()
                    continue
                await self._free.acquire()
                self._keep(asyncio.create_task(self._answer(message)))
        except (OSError, ValueError, KeyError, TypeError):
            pass  # it has disconnected, or uses another protocol
        finally:
            for task in self._tasks:
                task.cancel()
            self._writer.close()

    def _keep(self, task: "asyncio.Task[None]") -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _answer(self, message: dict[str, Any]) -> None:
        try:
            result = await self._do(message["id"], message["method"], message.get("params") or {})
            await self._send({"id": message["id"], "result": result})
        except Exception as error:
            await self._send({"id": message.get("id"), "error": sentence(error)})
        finally:
            self._free.release()

    async def _do(self, number: int, method: str, params: dict[str, Any]) -> Any:
        if method == "subscribe":
            topic = params["topic"]
            if topic not in self._panels.topics:
                raise LiveError(f"this kernel has no topic {topic}: reload the page and restart the kernel")
            known = self._panels.topics[topic]
            feed = await in_thread(lambda: known.open(**params.get("options") or {}))
            window = asyncio.Semaphore(AHEAD)
            task = asyncio.create_task(self._feed(number, topic, known, feed, window))
            self._subscriptions[number] = task, window
            self._keep(task)
            return None
        if method == "unsubscribe":
            if params["id"] in self._subscriptions:
                self._subscriptions.pop(params["id"])[0].cancel()
            return None
        if method not in self._panels.methods:
            raise LiveError(f"this kernel has no method {method}: reload the page and restart the kernel")
        return await in_thread(lambda: self._panels.methods[method](**params))

    async def _feed(self, number: int, name: str, topic: Topic, feed: Feed, window: asyncio.Semaphore) -> None:
        try:
            while True:
                await window.acquire()
                while (data := await in_thread(feed.read)) is None:
                    await asyncio.sleep(topic.period)
                await self._send({"id": number, "topic": name, "data": data})
                await asyncio.sleep(topic.period)
        except Exception as error:
            await self._send({"id": number, "topic": name, "error": sentence(error)})
        finally:
            self._subscriptions.pop(number, None)
            feed.close()

    async def _send(self, message: dict[str, Any]) -> None:
        line = fitting(message)
        with contextlib.suppress(OSError):  # it has disconnected
            self._writer.write(line)
            await self._writer.drain()


def fitting(message: dict[str, Any]) -> bytes:
    """Return a message as a line that is not too long: names, values and logs can come from any program.

    An event has None for infinity and NaN, so that one number does not end a panel.  Raises LiveError when it would be
    too long with short texts, too; ValueError and TypeError as `protocol.encoded`.
    """
    for longest in TEXTS:
        said = all_visible(message, longest)
        try:
            line = protocol.encoded(said)
        except ValueError:
            if "topic" not in message:
                raise
            line = protocol.encoded(protocol.finite(said))
        if len(line) <= protocol.LINE:
            return line
    raise LiveError(
        f"There is too much to show: {len(line) >> 20} MiB of at most {protocol.LINE >> 20} MiB. Stop the node that "
        "causes it."
    )


def sentence(error: Exception) -> str:
    """Return the message about an error for the reader."""
    return str(error) if isinstance(error, CourseError) else f"{type(error).__name__}: {error}"


async def in_thread(work: Callable[[], Any]) -> Any:
    """Run `work` in a daemon thread, which does not keep the kernel from ending."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[Any] = loop.create_future()

    def settle(result: Any, error: BaseException | None) -> None:
        if future.cancelled():
            return
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)

    def run() -> None:
        result, failed = None, None
        try:
            with unwatched():
                result = work()
        except Exception as error:
            failed = error
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            loop.call_soon_threadsafe(settle, result, failed)

    threading.Thread(target=run, name="lab's work", daemon=True).start()
    return await future
