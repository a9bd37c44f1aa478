"""Records the notebook in front in JupyterLab, which terminals follow (`course/shell.py`)."""

import asyncio
import atexit
import os
import re
from typing import Any

from jupyter_core.utils import ensure_async
from jupyter_server.base.handlers import APIHandler
from tornado import web

from course import registry
from course.lab import protocol


class Front(APIHandler):
    """POST {"kernel": the id of the kernel of the notebook in front, or "" for none}."""

    auth_resource = "terminals"

    @web.authenticated
    async def post(self) -> None:
        """Record the kernel for the terminals."""
        user = self.current_user
        if not await ensure_async(self.authorizer.is_authorized(self, user, "write", self.auth_resource)):
            raise web.HTTPError(403)
        body: Any = self.get_json_body()
        kernel = body.get("kernel") if isinstance(body, dict) else None
        if not isinstance(kernel, str) or not re.fullmatch(rf"({protocol.KERNEL_ID})?", kernel):
            raise web.HTTPError(400, "the id of a kernel is needed")
        await asyncio.to_thread(registry.put_in_front, os.getpid(), kernel)
        self.finish({})


def begin() -> None:
    """Record that no notebook is in front, now and at the server's exit."""
    registry.put_in_front(os.getpid(), "")
    atexit.register(registry.forget_front, os.getpid())
