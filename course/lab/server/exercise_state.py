"""The state of an exercise for its panel, from the notebook in the page, saved or not; it needs no kernel."""

import asyncio
import json
from pathlib import Path
from typing import Any

from tornado import web

from course.errors import CourseError, UnreadableNotebook
from course.foundation import cells
from course.lab.server import handed_in
from course.lab.server.files import Beside
from course.notebook import file_differences, file_record, stubs
from course.notebook.progress import LONGEST, error_of, parts

FAILED_RUN = "the same as in its cell, whose last run ended with an error:"


class Exercise(Beside):
    """POST {"path": the notebook's, "cells": its cells, with only errors and what was printed as one}.

    The answer has parts, files, summary, and what was handed in last.
    """

    @web.authenticated
    async def post(self) -> None:
        """Answer with the state of the exercise."""
        body = await self.asked()
        found = await asyncio.to_thread(_state, self.notebook(body["path"]), body.get("cells"))
        if (told := found["handed_in"]) and told["archive"]:
            told["archive"] = str(Path(body["path"]).parent / told["archive"])  # its path in JupyterLab
        self.finish(found)


class Reset(Beside):
    """POST {"path": the notebook's, "cell": the cell's name, "file": its file's name, "text": its present text}.

    The answer is {"stub": the text as released, "copy": the file that keeps the present text, or "" if that is the
    same, "written": whether there is such a file}, or {"error": "..."}.  With "look": true nothing is done, and the
    answer is {"same": whether the present text is the released one}, or {"error": "..."}.
    """

    @web.authenticated
    async def post(self) -> None:
        """Keep a copy, and answer with the stub."""
        body = await self.asked()
        cell, file, text = (str(body.get(key) or "") for key in ("cell", "file", "text"))
        if not cell or Path(file).name != file or Path(file).suffix not in file_differences.SUFFIXES:
            raise web.HTTPError(400, "a cell, its file and its text are needed")
        notebook = self.notebook(body["path"])
        try:
            stub = stubs.stub_of(notebook, cell)
            if body.get("look"):
                self.finish({"same": text == stub})
                return
            kept = None
            if text != stub:
                kept = stubs.keep_copy(notebook.parent, file, text.encode(errors="replace"), "before-reset")
        except CourseError as error:
            self.finish({"error": f"Nothing was changed: {error}"})
        except OSError as error:
            self.finish({"error": f"Nothing was changed, because no copy could be kept: {error.strerror}"})
        else:
            released = cells.exercise_file([cells.Cell("code", stub)], file) or b""
            file_record.note_reset(notebook.parent / file, released)
            written = (notebook.parent / file).exists()
            self.finish({"stub": stub, "copy": kept.name if kept else "", "written": written})


def _state(notebook: Path, raw: Any) -> dict[str, Any]:
    try:
        known = cells.parse(json.dumps({"cells": raw}))
    except UnreadableNotebook as error:
        raise web.HTTPError(400, str(error)) from None
    found = parts(notebook.stem, known, notebook.parent, handed_in.last_run(notebook.parent, notebook.stem))
    return {
        "parts": [
            {
                "name": part.name,
                "state": part.state,
                "more": part.more,
                "done": part.done,
                "failed": part.failed,
                "points": part.points,
            }
            for part in found
        ],
        "summary": found.summary if found else "",
        "files": _files(notebook.parent, [cell for cell in known if cell.solution]),
        "handed_in": handed_in.told(notebook.parent, notebook.stem),
    }


def _files(folder: Path, known: list[cells.Cell]) -> dict[str, str]:
    """Return for each exercise file why it differs from its cell, or else how that cell's program has failed; or ''."""
    notes = file_differences.unlike(folder, known)
    for cell in known:
        name = file_differences.written_by(cell)
        if notes.get(name) == "" and (lines := error_of(cell)) and not file_differences.refused(cell):
            notes[name] = "\n".join([FAILED_RUN, *lines])[:LONGEST]
    return notes
