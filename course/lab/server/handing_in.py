"""The hand-in button's work: what `course hand-in` does, asked for by a page.  It needs no kernel of the page's."""

import asyncio
import json
from pathlib import Path
from typing import Any

from jupyter_server.base.handlers import APIHandler
from tornado import web

from course import hand_in
from course.errors import HandInError


class HandingIn(APIHandler):
    """POST {"path": the notebook's, "name": the student's, "agreed": the doubts that the student has seen}.

    Without "agreed", or when there are other doubts by now, the answer is {"ask": {...}}, what there is to say before
    handing in.  Otherwise it is a line of JSON for each step: {"began": true}, {"ran": 1, "of": 4}, and at last
    {"done": {...}} or {"error": "..."}.
    """

    auth_resource = "contents"

    @web.authenticated
    async def post(self) -> None:
        """Hand in the exercise beside a notebook, as saved."""
        if not await self._may_write():
            raise web.HTTPError(403)
        body = self.get_json_body() or {}
        path, name, agreed = body.get("path"), body.get("name"), body.get("agreed")
        if not isinstance(path, str) or not isinstance(name, str | None) or not isinstance(agreed, dict | None):
            raise web.HTTPError(400, "a hand-in names the notebook's path")
        folder = self._folder(path)
        try:
            found = await asyncio.to_thread(hand_in.read, folder)
        except HandInError as error:
            self.finish({"error": str(error)})
            return
        if agreed != found.doubts:
            checks = [cell.name for cell in found.cells if cell.public_check]
            ask = {"name": hand_in.student(), "files": list(found.files), "doubts": found.doubts, "checks": checks}
            self.finish({"ask": ask})
            return
        self.set_header("Content-Type", "application/x-ndjson")
        loop = asyncio.get_running_loop()
        news: asyncio.Queue[dict[str, Any] | None] = asyncio.Queue()

        def work() -> None:
            def tell(message: dict[str, Any] | None) -> None:
                loop.call_soon_threadsafe(news.put_nowait, message)

            try:
                done = hand_in.deliver(
                    found,
                    folder,
                    name or hand_in.student(),
                    check=True,
                    tell=lambda ran, of: tell({"ran": ran, "of": of}),
                )
                archive = str(Path(path).parent / done.archive.name)
                tell({"done": {"archive": archive, "files": done.files, "checks": done.checks,
                               "said": [*filter(None, [done.summary]), hand_in.KEEP]}})  # fmt: skip
            except HandInError as error:
                tell({"error": str(error)})
            finally:
                tell(None)

        news.put_nowait({"began": True})
        ended = asyncio.create_task(asyncio.to_thread(work))
        while (message := await news.get()) is not None:
            self.write(json.dumps(message) + "\n")
            await self.flush()
        await ended  # raises what nobody has foreseen

    async def _may_write(self) -> bool:
        from jupyter_core.utils import ensure_async

        user = self.current_user
        return bool(await ensure_async(self.authorizer.is_authorized(self, user, "write", self.auth_resource)))

    def _folder(self, path: str) -> Path:
        """The folder of a notebook that the server serves; raises 404 for any other."""
        root = Path(self.contents_manager.root_dir).resolve()
        folder = (root / path.strip("/")).parent
        if not folder.resolve().is_relative_to(root) or ".." in Path(path).parts:
            raise web.HTTPError(404, f"there is no {path} here")
        return folder
