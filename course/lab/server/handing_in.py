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

_checked: dict[Path, tuple[dict[str, Any], hand_in.Checked]] = {}  # of the files that are asked about, by folder


class HandingIn(Beside):
    """POST {"path": the notebook's, "name": the student's, "agreed": the doubts that the student has seen, "failed":
    the failed checks that the student has seen}.

    Without "agreed", or if the doubts have changed since, the answer is {"ask": {...}} with the questions before
    handing in.  Otherwise it is a line of JSON for each step: {"began": true}, {"ran": 1, "of": 4}, and finally
    {"done": {...}}, {"error": "..."}, or {"ask": {...}} if checks have failed other than those in "failed".  The checks
    are not run again for an answer to that.
    """

    gone = False  # whether the page has closed the connection

    def on_connection_close(self) -> None:
        """Note that nobody can answer a question."""
        self.gone = True
        super().on_connection_close()

    @web.authenticated
    async def post(self) -> None:
        """Hand in the exercise beside a notebook, as saved."""
        body = await self.asked()
        path, name, agreed, seen = body["path"], body.get("name"), body.get("agreed"), body.get("failed")
        if not isinstance(name, str | None) or not isinstance(agreed, dict | None) or not isinstance(seen, dict | None):
            raise web.HTTPError(400, "expected a name, accepted warnings by file, and failed checks by name")
        folder = self.notebook(path).parent
        try:
            handed_in.expect_none(folder)
            found = await asyncio.to_thread(hand_in.read, folder)
        except HandInError as error:
            self.finish({"error": str(error)})
            return
        ask: dict[str, Any] = {
            "name": hand_in.student(),
            "known": hand_in.known(),
            "files": list(found.files),
            "doubts": found.doubts,
            "unanswered": found.unanswered,
            "checks": [cell.name for cell in found.cells if cell.public_check],
        }
        if agreed != found.doubts:
            self.finish({"ask": ask})
            return
        try:
            handing_in = handed_in.begin(folder)
        except HandInError as error:  # another one has begun meanwhile
            self.finish({"error": str(error)})
            return
        digests, known = _checked.pop(folder, ({}, hand_in.Checked()))
        again = seen is None or digests != found.digests
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
                checked = hand_in.run_checks(found, progress) if again else known
                if checked.failed and checked.failed != seen and not self.gone:
                    _checked[folder] = found.digests, checked
                    handed_in.withdraw(folder, handing_in)
                    tell({"ask": ask | {"failed": checked.failed}})
                    return
                by = hand_in.student() if hand_in.known() else name or hand_in.student()
                done = hand_in.deliver(found, folder, by, checked)
                handing_in.end(sent=done.archive.name if hand_in.known() else "")
                archive = str(Path(path).parent / done.archive.name)
                said = [*filter(None, (done.summary, done.unanswered, done.lateness)), done.kept]
                told = {"archive": archive, "sent": hand_in.known(), "files": done.files, "checks": done.checks}
                tell({"done": told | {"said": said}})
            except HandInError as error:
                handing_in.end(failed=str(error))
                tell({"error": str(error)})
            finally:
                handing_in.end(failed="the terminal in which Jupyter's server runs shows why.")
                tell(None)

        if again:
            news.put_nowait({"began": True})
        ended = asyncio.create_task(asyncio.to_thread(work))
        while (message := await news.get()) is not None:
            with contextlib.suppress(StreamClosedError):  # the page is gone: the work goes on
                self.write(json.dumps(message) + "\n")
                await self.flush()
        await ended  # raises unexpected errors
