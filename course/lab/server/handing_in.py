"""The hand-in button: does the same as `course hand-in`, for a page.  It does not need the notebook's kernel."""

import asyncio
import contextlib
import json
from pathlib import Path
from typing import Any

from tornado import web
from tornado.iostream import StreamClosedError

from course import hand_in
from course.errors import HandInError
from course.lab.server import handed_in
from course.lab.server.files import Beside


class HandingIn(Beside):
    """POST {"path": the notebook's, "name": the student's, "agreed": the doubts that the student has seen}.

    Without "agreed", or if the doubts have changed since, the answer is {"ask": {...}} with the questions before
    handing in.  Otherwise it is a line of JSON for each step: {"began": true}, {"ran": 1, "of": 4}, and finally
    {"done": {...}} or {"error": "..."}.
    """

    @web.authenticated
    async def post(self) -> None:
        """Hand in the exercise beside a notebook, as saved."""
        body = await self.asked()
        path, name, agreed = body["path"], body.get("name"), body.get("agreed")
        if not isinstance(name, str | None) or not isinstance(agreed, dict | None):
            raise web.HTTPError(400, "a name is a text, and what is agreed to are doubts by file")
        folder = self.notebook(path).parent
        try:
            handed_in.expect_none(folder)
            found = await asyncio.to_thread(hand_in.read, folder)
        except HandInError as error:
            self.finish({"error": str(error)})
            return
        if agreed != found.doubts:
            checks = [cell.name for cell in found.cells if cell.public_check]
            ask = {
                "name": hand_in.student(),
                "known": hand_in.known(),
                "files": list(found.files),
                "doubts": found.doubts,
                "checks": checks,
            }
            self.finish({"ask": ask})
            return
        try:
            handing_in = handed_in.begin(folder)
        except HandInError as error:  # another one has begun meanwhile
            self.finish({"error": str(error)})
            return
        self.set_header("Content-Type", "application/x-ndjson")
        loop = asyncio.get_running_loop()
        news: asyncio.Queue[dict[str, Any] | None] = asyncio.Queue()

        def work() -> None:
            def tell(message: dict[str, Any] | None) -> None:
                loop.call_soon_threadsafe(news.put_nowait, message)

            def progress(ran: int, of: int) -> None:
                handing_in.ran, handing_in.of = ran, of
                tell({"ran": ran, "of": of})

            try:
                done = hand_in.deliver(
                    found,
                    folder,
                    hand_in.student() if hand_in.known() else name or hand_in.student(),
                    check=True,
                    tell=progress,
                )
                handing_in.end(sent=done.archive.name if hand_in.known() else "")
                archive = str(Path(path).parent / done.archive.name)
                said = [*filter(None, (done.summary, done.unanswered, done.lateness)), done.kept]
                told = {"archive": archive, "sent": hand_in.known(), "files": done.files, "checks": done.checks}
                tell({"done": told | {"said": said}})
            except HandInError as error:
                handing_in.end(failed=str(error))
                tell({"error": str(error)})
            finally:
                handing_in.end(failed="the terminal in which Jupyter's server runs says why.")
                tell(None)

        news.put_nowait({"began": True})
        ended = asyncio.create_task(asyncio.to_thread(work))
        while (message := await news.get()) is not None:
            with contextlib.suppress(StreamClosedError):  # the page is gone: the work goes on
                self.write(json.dumps(message) + "\n")
                await self.flush()
        await ended  # raises unexpected errors
