"""Records the notebook in front in JupyterLab, which terminals follow (`course/shell.py`)."""

import asyncio
import atexit
import os
import re

from tornado import web

from course import registry
from course.lab import protocol
from course.lab.server.files import Beside


class Front(Beside):
    """POST {"path": the path of the notebook in front, "kernel": its kernel's id}, each "" for none."""

    auth_resource = "terminals"

    @web.authenticated
    async def post(self) -> None:
        """Record the kernel and the folder for the terminals."""
        body = await self.asked()
        kernel, folder = body.get("kernel"), str(self.notebook(body["path"]).parent) if body["path"] else ""
        if not isinstance(kernel, str) or not re.fullmatch(rf"({protocol.KERNEL_ID})?", kernel):
            raise web.HTTPError(400, "the id of a kernel is needed")
        await asyncio.to_thread(registry.put_in_front, os.getpid(), kernel, "" if "\n" in folder else folder)
        self.finish({})


def begin() -> None:
    """Record that no notebook is in front, now and at the server's exit."""
    registry.put_in_front(os.getpid(), "")
    atexit.register(registry.forget_front, os.getpid())
